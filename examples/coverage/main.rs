//! Coverage of 95 % intervals: seeded data sets with known truth are fitted, and the share of intervals that contain the
//! truth is printed, for Young's modulus, damping, clamp angle, camera clock and friction, and for several kinds of noise.
//!
//! `cargo run --release --example coverage` for 40 data sets a case, `-- 2000` for the campaign,
//! `-- 1000 noise` for the cases whose name begins with `noise`, `-- 100 strip` for the strip on a floor.

use indicatif::{ParallelProgressIterator, ProgressBar};
use rayon::prelude::*;
use rodfit::fit::{Analysis, Refinement, Sample};
use rodfit::scene::{Camera, Material, Section, Shape, Time};
use rodfit::{Error, Fit, Observation, Parameter, Point, Scene, Unknown};

mod noise;
mod strip;
use noise::Noise;
use strip::dragged_strip;

/// Fits of one kind of data: true scene, noise, number of samples, and identified parameters.
struct Case {
    name: &'static str,
    scene: Scene,
    /// Its kind, and standard deviation per coordinate, m.
    kind: Noise,
    noise: f64,
    samples: u32,
    unknowns: Vec<Parameter>,
    /// Observed points of the rod.
    points: &'static [Point],
    /// Whether they are known within a factor of two, which saves the search for a start.
    known: bool,
    profile: bool,
}

/// A released cantilever of 11 nodes over `end` s with mass damping, 1/s.
fn cantilever(end: f64, damping: f64) -> Scene {
    let shape = Shape::Straight { length: 0.5, direction: [1.0, 0.0, 0.0] };
    let section = Section::Circle { radius: 0.005 };
    let mut scene = Scene::new(10, shape, section, Material::new(1273.52, 1e8));
    scene.loads.gravity = [0.0, -9.8, 0.0];
    scene.loads.damping.mass = damping;
    scene.time = Some(Time::new(end, 4e-3));
    scene
}

/// For every parameter: whether its interval contains the truth, and whether that of its profile does. None for a fit without
/// intervals.
fn covers(
    case: &Case,
    clean: &[Observation],
    seed: u64,
) -> Result<Option<Vec<(bool, bool)>>, Error> {
    let mut data = clean.to_vec();
    for (i, data) in data.iter_mut().enumerate() {
        // Each point has noise of its own.
        case.kind.add(data, case.noise, 0, seed + ((i as u64) << 32));
    }
    // Data and model have the same mesh and step.
    let analysis = Analysis {
        profile: case.profile,
        discretization_error: Refinement::None,
        ..Analysis::default()
    };
    // The fitted scene assumes an exact clamp and an exact camera.
    let mut scene = case.scene.clone();
    (scene.supports.angle, scene.camera) = (0.0, Camera::default());
    let fit = Fit::new(&scene.problem()?).analyse(analysis);
    let fit = data.into_iter().fold(fit, |fit, data| fit.observe(data));
    let unknown = |parameter: &Parameter| match parameter.of(&case.scene).filter(|_| case.known) {
        Some(truth) => Unknown::new(*parameter).start(truth).bounds(0.5 * truth, 2.0 * truth),
        None => Unknown::new(*parameter),
    };
    let fit = case.unknowns.iter().fold(fit, |fit, parameter| fit.identify(unknown(parameter)));
    let report = fit.solve()?;
    if !report.is_success() {
        return Ok(None);
    }
    let inside = |e: &rodfit::fit::Estimate| {
        let truth = e.name.of(&case.scene)?;
        let [low, high] = e.interval95?;
        let [from, to] = e.profile95.unwrap_or([Some(low), Some(high)]);
        let by_profile = from.is_none_or(|x| x <= truth) && to.is_none_or(|x| truth <= x);
        Some((low <= truth && truth <= high, by_profile))
    };
    Ok(report.parameters.iter().map(inside).collect())
}

fn main() -> Result<(), Error> {
    let count: u64 = std::env::args().nth(1).and_then(|n| n.parse().ok()).unwrap_or(40);
    // A tilted clamp and a late camera, both unknown to the fit.
    let mut tilted = cantilever(0.6, 0.0);
    (tilted.supports.angle, tilted.camera.time_offset) = (0.02, 0.013);
    let mut cases = vec![
        Case {
            name: "E alone",
            scene: cantilever(0.4, 0.0),
            kind: Noise::White,
            noise: 2e-3,
            samples: 30,
            unknowns: vec![Parameter::YoungsModulus],
            points: &[Point::Tip],
            known: false,
            profile: false,
        },
        Case {
            name: "E with damping",
            scene: cantilever(0.6, 0.8),
            kind: Noise::White,
            noise: 1e-3,
            samples: 30,
            unknowns: vec![Parameter::YoungsModulus, Parameter::DampingMass],
            points: &[Point::Tip],
            known: false,
            profile: false,
        },
        Case {
            name: "E with the clamp's angle and the camera's clock",
            scene: tilted,
            kind: Noise::White,
            noise: 1e-3,
            samples: 30,
            unknowns: vec![Parameter::YoungsModulus, Parameter::TimeOffset, Parameter::ClampAngle],
            points: &[Point::Tip],
            known: false,
            profile: false,
        },
        Case {
            name: "E from the first tenth of a second, strongly nonlinear",
            scene: cantilever(0.1, 0.0),
            kind: Noise::White,
            noise: 3e-3,
            samples: 30,
            unknowns: vec![Parameter::YoungsModulus],
            points: &[Point::Tip],
            known: false,
            profile: true,
        },
    ];
    cases.push(Case {
        name: "strip dragged over a floor, E and friction",
        scene: dragged_strip(),
        kind: Noise::White,
        noise: 5e-4,
        samples: 40,
        unknowns: vec![Parameter::YoungsModulus, "contacts.0.friction".parse()?],
        points: &[Point::Tip, Point::Node(5)],
        known: true,
        profile: false,
    });
    // All kinds of noise on one damped motion, with enough samples to estimate a correlation.
    let mut swinging = cantilever(0.6, 0.8);
    swinging.rod.segments = Some(6);
    swinging.time = Some(Time::new(0.6, 8e-3));
    let kinds = [
        ("noise: white", Noise::White),
        ("noise: AR(1) of 0.3", Noise::Correlated(0.3)),
        ("noise: AR(1) of 0.8", Noise::Correlated(0.8)),
        ("noise: AR(1) of 0.95", Noise::Correlated(0.95)),
        ("noise: Student's t of 3", Noise::HeavyTailed),
        ("noise: pixels of 2 sigma", Noise::Pixels),
        ("noise: three times as large in y", Noise::Unlike),
    ];
    cases.extend(kinds.map(|(name, kind)| Case {
        name,
        scene: swinging.clone(),
        kind,
        noise: 1e-3,
        samples: 300,
        unknowns: vec![Parameter::YoungsModulus, Parameter::DampingMass],
        points: &[Point::Tip],
        known: true,
        profile: false,
    }));
    let wanted = std::env::args().nth(2).unwrap_or_default();
    for case in cases.iter().filter(|case| case.name.starts_with(&wanted)) {
        // The data of a case differ in their noise only.
        let run = case.scene.problem()?.simulate()?;
        let end = case.scene.time.as_ref().map_or(0.0, |time| time.end);
        let sample = |point: Point, k: u32| -> Result<Sample, Error> {
            let time = end * f64::from(k) / f64::from(case.samples);
            let ([x, y, _], _) = run.at(point, time)?;
            let time = time + case.scene.camera.time_offset;
            Ok(Sample { time, position: [Some(x), Some(y), None] })
        };
        let observe = |point: &Point| -> Result<Observation, Error> {
            let samples = (1..=case.samples).map(|k| sample(*point, k));
            Ok(Observation::new(samples.collect::<Result<_, _>>()?).at(*point))
        };
        let clean: Vec<Observation> = case.points.iter().map(observe).collect::<Result<_, _>>()?;
        let results: Vec<Option<Vec<(bool, bool)>>> = (0..count)
            .into_par_iter()
            .progress_with(ProgressBar::new(count))
            .map(|seed| covers(case, &clean, seed))
            .collect::<Result<_, _>>()?;
        // Shares refer to fits that give intervals.
        let given: Vec<&Vec<(bool, bool)>> = results.iter().flatten().collect();
        println!("{}: {} of {count} fits gave intervals", case.name, given.len());
        for (i, unknown) in case.unknowns.iter().enumerate() {
            let share = |which: fn(&(bool, bool)) -> bool| {
                let covering = given.iter().filter(|fit| which(&fit[i])).count();
                100.0 * covering as f64 / given.len() as f64
            };
            print!("  {unknown}: {:.1} % covered by the standard error's interval", share(|c| c.0));
            match case.profile {
                true => println!(", {:.1} % by the profile's", share(|c| c.1)),
                false => println!(),
            }
        }
    }
    Ok(())
}
