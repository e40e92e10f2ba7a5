//! The fitted model once more, for the [evidence](super::Evidence).

use super::search::Search;
use super::view::View;
use super::{Asked, Evidence, Observation, Over, Series, Setup, Shape, Unknown};
use crate::error::Error;
use crate::problem::Problem;
use crate::scene::Scheme;

/// Shapes of the rod that are kept.
const SHAPES: usize = 12;
/// Points of the model's line.
const CURVE: usize = 400;
const AXES: [&str; 3] = ["x", "y", "z"];

/// What was asked for, and what was seen and simulated at the point with these `residuals`.
/// `sigma` is the noise that is reported.
pub(super) fn evidence(search: &Search, residuals: Option<&[f64]>, sigma: &[f64]) -> Evidence {
    let asked = |unknown: &Unknown| Asked {
        name: unknown.parameter,
        start: unknown.start,
        bounds: unknown.bounds,
        prior: None,
    };
    Evidence {
        asked: search.unknowns.iter().map(asked).collect(),
        series: residuals.map_or(Vec::new(), |residuals| series(search, residuals, sigma)),
        history: search.journal.history(search.unknowns),
        landscape: search.journal.landscape(search.unknowns),
        setups: vec![setup(search.problem, search.observations)],
        version: env!("CARGO_PKG_VERSION").into(),
        ..Evidence::default()
    }
}

fn setup(problem: &Problem, observations: &[Observation]) -> Setup {
    let (model, reason) = problem.model();
    let time = problem.scene().time.as_ref();
    Setup {
        experiment: String::new(),
        scene: problem.scene().path.as_ref().map(|path| path.display().to_string()),
        model: format!("{model}: {reason}"),
        scheme: time.map(|time| match time.scheme {
            Scheme::NewmarkBeta => format!("{}, beta = {}", time.scheme.name(), time.beta),
            scheme => scheme.name().to_string(),
        }),
        step: time.map(|time| time.step),
        end: time.map(|time| time.end),
        segments: problem.segments(),
        length: problem.length(),
        observations: observations.iter().map(Observation::label).collect(),
    }
}

/// Data and model, coordinate by coordinate; the model from its residuals.
fn series(search: &Search, residuals: &[f64], sigma: &[f64]) -> Vec<Series> {
    let mut residuals = residuals.iter();
    let mut all = Vec::new();
    for ((observation, weight), sigma) in search.observations.iter().zip(&search.sigmas).zip(sigma)
    {
        let mut own = AXES.map(|axis| Series {
            experiment: String::new(),
            label: observation.label(),
            axis: axis.into(),
            unit: "m",
            over: Over::Time,
            at: Vec::new(),
            observed: Vec::new(),
            simulated: Vec::new(),
            sigma: *sigma,
            curve: Vec::new(),
        });
        for sample in &observation.samples {
            for (series, seen) in own.iter_mut().zip(sample.position) {
                if let Some(seen) = seen
                    && let Some(residual) = residuals.next()
                {
                    series.at.push(sample.time);
                    series.observed.push(seen);
                    series.simulated.push(seen + residual * weight);
                }
            }
        }
        all.extend(own.into_iter().filter(|series| !series.at.is_empty()));
    }
    all
}

/// Simulates once more at `x`, and adds the model's lines and the rod's shapes at moments evenly
/// spaced in time.
pub(super) fn add_motion(search: &Search, x: &[f64], evidence: &mut Evidence) -> Result<(), Error> {
    let residuals = search.residuals(search.duration())?;
    let model = residuals.model(x)?;
    let view = View::new(&model, |_, value: f64| value);
    let spacing = view.time(search.duration()) / (SHAPES - 1) as f64;
    let mut shapes: Vec<Shape> = Vec::new();
    let (problem, trajectory) = residuals.run_seen(x, &[], |simulation| {
        if simulation.time() >= spacing * shapes.len() as f64 * (1.0 - 1e-9) {
            let place = |i: usize| view.recorded(simulation.position(i));
            shapes.push(Shape {
                experiment: String::new(),
                time: Some(simulation.time()),
                nodes: (0..model.nodes()).map(place).collect(),
            });
        }
    })?;
    evidence.shapes = shapes;
    let mut all = evidence.series.iter_mut();
    for observation in search.observations {
        let stencil = problem.stencil(observation.point)?;
        let times = observation.samples.iter().map(|s| s.time);
        let (first, last) = times.fold((f64::MAX, 0.0_f64), |(a, b), t| (a.min(t), b.max(t)));
        let mut lines = [const { Vec::new() }; 3];
        for k in 0..=CURVE {
            let clock = first + (last - first) * k as f64 / CURVE as f64;
            let place = trajectory.sample_over(&stencil, view.time(clock), [])?;
            for (line, x) in lines.iter_mut().zip(view.recorded(place)) {
                line.push([clock, x]);
            }
        }
        let seen = |c: usize| observation.samples.iter().any(|s| s.position[c].is_some());
        for (_, line) in lines.into_iter().enumerate().filter(|(c, _)| seen(*c)) {
            if let Some(series) = all.next() {
                series.curve = line;
            }
        }
    }
    Ok(())
}
