//! The fitted model once more, for [plots](super::PlotData).

use crate::dynamics::Trajectory;
use crate::error::Error;
use crate::fit::measurement::Measurement;
use crate::fit::measurement::dataset::Coordinate;
use crate::fit::measurement::experiment::Experiment;
use crate::fit::measurement::motion::PointMotion;
use crate::fit::misfit::camera::View;
use crate::fit::misfit::observed_experiment::Run;
use crate::fit::report::plot_data::{
    Measured, PlotData, RodShape, SearchRange, Series, SimulationSettings,
};
use crate::fit::search::Search;
use crate::fit::search::fitted::Fitted;
use crate::fit::search::optimum::Optimum;
use crate::fit::unknown::Unknown;
use crate::problem::Problem;
use crate::scene::SchemeParameter;

/// Shapes of a moving rod that are kept.
const SHAPES: usize = 12;
/// Points of the model's line.
const CURVE: usize = 400;

/// What was asked for, and what was seen and simulated at the `optimum`, if there is one. `sigma`
/// is the noise that is reported.
pub(crate) fn still(search: &Search, optimum: Option<&Optimum>, sigma: &[f64]) -> PlotData {
    let range = |unknown: &Unknown| SearchRange {
        name: unknown.parameter,
        start: unknown.start,
        bounds: unknown.bounds,
    };
    PlotData {
        ranges: search.unknowns.iter().map(range).collect(),
        series: optimum.map_or(Vec::new(), |optimum| series(Fitted { search, optimum }, sigma)),
        history: search.journal.history(search.unknowns, &search.sigmas, search.full_work),
        landscape: search.journal.landscape(search.unknowns),
        settings: search.experiments.iter().map(settings).collect(),
        version: env!("CARGO_PKG_VERSION").into(),
        ..PlotData::default()
    }
}

fn settings(experiment: &Experiment) -> SimulationSettings {
    let measured = |measurement: &Measurement| Measured {
        label: experiment.label(measurement),
        points: measurement.points(),
        values: measurement.values(),
        recording: measurement.header.recording.clone(),
    };
    let problem = &experiment.problem;
    let (model, reason) = problem.model();
    let moves = experiment.moves();
    let time = problem.scene().time.as_ref().filter(|_| moves);
    SimulationSettings {
        experiment: experiment.name.clone(),
        scene: problem.scene().path.as_ref().map(|path| path.display().to_string()),
        model: format!("{model}: {reason}"),
        scheme: time.map(|time| match time.scheme.traits().parameter {
            Some(SchemeParameter::Beta) => {
                format!("{}, beta = {}", time.scheme.name(), time.beta)
            }
            Some(SchemeParameter::RhoInf) => {
                format!("{}, rho_inf = {}", time.scheme.name(), time.rho_inf)
            }
            None => time.scheme.name().to_string(),
        }),
        step: time.and_then(|time| time.step),
        end: time.map(|time| time.end),
        segments: problem.segments(),
        length: problem.length(),
        observations: experiment.measurements.iter().map(Measurement::label).collect(),
        measurements: experiment.measurements.iter().map(measured).collect(),
    }
}

/// Data and model, coordinate by coordinate; the model from its residuals.
fn series(fitted: Fitted, sigma: &[f64]) -> Vec<Series> {
    let mut all = Vec::new();
    for (own, sigma) in fitted.measured().zip(sigma) {
        let of = (&own.experiment.name[..], &own.experiment.problem);
        all.extend(compared(of, own.measurement, own.residuals, [own.sigma, *sigma]));
    }
    all
}

/// Data and model of a measurement, coordinate by coordinate; the model from its residuals, which are in units of the noise
/// `weight`.
pub(crate) fn compared(
    (experiment, problem): (&str, &Problem),
    measurement: &Measurement,
    residuals: &[f64],
    [weight, sigma]: [f64; 2],
) -> Vec<Series> {
    let seen = measurement.values_in_order();
    let units = measurement.sigmas(weight);
    let unit = measurement.data_unit();
    let series = |coordinate: Coordinate| {
        let own = || coordinate.places.iter().filter(|(k, _)| *k < residuals.len());
        Series {
            experiment: experiment.into(),
            label: measurement.label(),
            axis: coordinate.axis.into(),
            unit: unit.name.into(),
            abscissa: measurement.abscissa(),
            abscissa_values: own().map(|(_, at)| *at).collect(),
            observed: own().map(|(k, _)| seen[*k] / unit.size).collect(),
            simulated: own()
                .map(|(k, _)| (seen[*k] + residuals[*k] * units[*k]) / unit.size)
                .collect(),
            sigma: sigma / unit.size,
            curve: Vec::new(),
        }
    };
    measurement.coordinates(problem).into_iter().map(series).collect()
}

/// Adds what one more simulation at `x` shows: the model's lines, and the rod's shapes at moments evenly
/// spaced in time, or at rest. What was added before an error stays.
pub(crate) fn add_motion(search: &Search, x: &[f64], plots: &mut PlotData) -> Result<(), Error> {
    let residuals = search.all_residuals()?;
    let mut all = plots.series.iter_mut();
    for (k, experiment) in search.experiments.iter().enumerate() {
        let mut moments: Vec<RodShape> = Vec::new();
        let run = residuals.run_seen(k, x, &mut |problem, simulation| {
            let end = experiment.duration() - problem.scene().camera.time_offset;
            let next = end * moments.len() as f64 / (SHAPES - 1) as f64;
            if simulation.time() >= next * (1.0 - 1e-9) {
                moments.push(RodShape {
                    experiment: experiment.name.clone(),
                    time: Some(simulation.time()),
                    nodes: (0..problem.nodes()).map(|i| simulation.position(i)).collect(),
                });
            }
        })?;
        let view = View::new(&run.problem, |_, value: f64| value);
        for shape in &mut moments {
            shape.nodes.iter_mut().for_each(|x| *x = view.recorded(*x));
        }
        plots.shapes.extend(moments);
        let resting = at_rest(experiment, &run, &view)?;
        for measurement in &experiment.measurements {
            let lines = match (measurement.motion(), measurement.shape(), &resting) {
                (Some(own), ..) => motion(own, &run, &view)?,
                (_, Some(_), Some((arc_lengths, shape))) => [0, 1, 2].map(|c| {
                    let points = arc_lengths.iter().zip(&shape.nodes);
                    points.map(|(s, x)| [*s, x[c]]).collect()
                }),
                _ => Lines::default(),
            };
            for coordinate in measurement.coordinates(&experiment.problem) {
                let axis = ["x", "y", "z"].iter().position(|axis| *axis == coordinate.axis);
                if let (Some(series), Some(c)) = (all.next(), axis) {
                    series.curve = lines[c].clone();
                }
            }
        }
        plots.shapes.extend(resting.map(|(_, shape)| shape));
    }
    Ok(())
}

type Lines = [Vec<[f64; 2]>; 3];

/// Where the point is over the clock of its recording.
fn motion(own: &PointMotion, run: &Run, view: &View<f64>) -> Result<Lines, Error> {
    let mut lines = Lines::default();
    let Some(trajectory) = &run.moving else { return Ok(lines) };
    let marker = run.problem.marker(own.point, own.offset)?;
    let times = own.samples.iter().map(|s| s.time);
    let (first, last) = times.fold((f64::MAX, 0.0_f64), |(a, b), t| (a.min(t), b.max(t)));
    for k in 0..=CURVE {
        let clock = first + (last - first) * k as f64 / CURVE as f64;
        let place = trajectory.record().read().marker(&marker, view.time(clock))?;
        for (line, x) in lines.iter_mut().zip(view.recorded(place)) {
            line.push([clock, x]);
        }
    }
    Ok(lines)
}

/// Arc lengths of the nodes and the shape of the rod at rest, if it was looked at.
fn at_rest(
    experiment: &Experiment,
    run: &Run,
    view: &View<f64>,
) -> Result<Option<(Vec<f64>, RodShape)>, Error> {
    if run.resting.is_none() {
        return Ok(None);
    }
    let nodes: Vec<usize> = (0..run.problem.nodes()).collect();
    let rest = Trajectory::at_rest(&run.problem, &nodes, &[])?;
    let shape = RodShape {
        experiment: experiment.name.clone(),
        time: None,
        nodes: nodes.iter().map(|i| view.recorded(rest.node(*i, 0))).collect(),
    };
    Ok(Some((run.problem.arc_lengths().to_vec(), shape)))
}
