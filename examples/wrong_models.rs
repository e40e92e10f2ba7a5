//! Are wrong models found and named? A rod that falls, recorded as it is with something that the fitted scene lacks: ten such
//! things, each as strong as moves Young's modulus by two standard errors, and as strong as leaves five sigma in the data if that is more, with
//! ten noises. How often do the score tests name it first or second? What leaves two sigma or less can be told by no test.
//!
//! `cargo run --release --example wrong_models`; `-- 3` for another number of noises.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;
use rodfit::fit::{Analysis, Refinement, Sample};
use rodfit::scene::{
    Along, Compliance, Drag, Friction, Material, PointMass, Scene, Section, Shape, Time,
};
use rodfit::{Error, Fit, FitReport, Observation, Parameter, Point};

/// Of each coordinate, m; number of frames.
const SIGMA: f64 = 5e-4;
const FRAMES: usize = 120;
const LENGTH: f64 = 0.5;
/// Standard errors by which the modulus is off.
const BIAS: f64 = 2.0;
/// Sigmas that are clear.
const CLEAR: f64 = 5.0;

/// What is missing, a first guess of its size, and how the truth has it.
struct Wrong {
    place: &'static str,
    size: f64,
    there: fn(&mut Scene, f64),
}

const WRONG: [Wrong; 10] = [
    Wrong {
        place: "supports.start_compliance.rotation",
        size: 0.02,
        there: |s, size| s.supports.start_compliance = Compliance { rotation: size, axial: 0.0 },
    },
    Wrong { place: "supports.angle", size: 2e-3, there: |s, size| s.supports.angle = size },
    Wrong {
        place: "rod.mass.0.mass",
        size: 2e-4,
        there: |s, size| s.rod.mass = vec![PointMass::new(Point::Tip, size)],
    },
    Wrong {
        place: "rod.taper.radius.to",
        size: -0.01,
        there: |s, size| s.rod.taper.radius = Some(Along::linear(1.0, 1.0 + size)),
    },
    Wrong {
        place: "rod.shape.angle",
        size: 6e-3,
        there: |s, size| s.rod.shape = Shape::Arc { length: LENGTH, angle: size },
    },
    Wrong {
        place: "loads.damping.stiffness",
        size: 4e-4,
        there: |s, size| s.loads.damping.stiffness = size,
    },
    Wrong {
        place: "loads.damping.friction.stiffness",
        size: 5e-3,
        there: |s, size| {
            s.loads.damping.friction = Some(Friction { stiffness: size, curvature: 0.15 });
        },
    },
    Wrong {
        place: "loads.drag.quadratic_normal",
        size: 0.03,
        there: |s, size| {
            s.loads.drag = Some(Drag { quadratic_normal: size, ..Drag::default() });
        },
    },
    Wrong { place: "camera.time_offset", size: 1e-3, there: |s, size| s.camera.time_offset = size },
    Wrong {
        place: "camera.pixel_scale",
        size: 1e-3,
        there: |s, size| s.camera.pixel_scale = 1.0 + size,
    },
];

/// The scene that is fitted.
fn model() -> Scene {
    let shape = Shape::Straight { length: LENGTH, direction: [1.0, 0.0, 0.0] };
    let section = Section::Circle { radius: 0.005 };
    let mut scene = Scene::new(12, shape, section, Material::new(1273.52, 1e8));
    scene.loads.gravity = [0.0, -9.81, 0.0];
    scene.loads.damping.mass = 0.5;
    scene.time = Some(Time::new(1.2, 4e-3));
    scene
}

/// What is seen of the tip where something of this size is there.
fn seen(wrong: &Wrong, size: f64) -> Result<Observation, Error> {
    let mut scene = model();
    (wrong.there)(&mut scene, size);
    let camera = std::mem::take(&mut scene.camera);
    let run = scene.problem()?.simulate()?;
    let frame = |k: usize| {
        let time = 1.2 * (k + 1) as f64 / FRAMES as f64;
        let happened = time - camera.time_offset;
        let ([x, y, _], _) = run.at(Point::Tip, happened.max(0.0))?;
        let [x, y] = [x, y].map(|x| camera.pixel_scale * x);
        Ok::<_, Error>(Sample { time, position: [Some(x), Some(y), None] })
    };
    let samples = (0..FRAMES).map(frame).collect::<Result<_, _>>()?;
    Ok(Observation::new(samples).sigma(SIGMA))
}

fn fitted(mut data: Observation, noise: Option<u64>, what_if: bool) -> Result<FitReport, Error> {
    if let Some(seed) = noise {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
        for x in data.samples.iter_mut().flat_map(|s| &mut s.position).flatten() {
            *x += SIGMA * normal();
        }
    }
    let analysis = Analysis {
        discretization_error: Refinement::None,
        what_if: Some(what_if),
        ..Analysis::default()
    };
    Fit::new(&model().problem()?)
        .observe(data)
        .identify(Parameter::YoungsModulus)
        .identify(Parameter::DampingMass)
        .analyse(analysis)
        .solve()
}

/// By how many standard errors the modulus is off.
fn bias(report: &FitReport) -> f64 {
    let estimate = &report.parameters[0];
    match (estimate.value, estimate.std_error) {
        (Some(value), Some(error)) => (value - 1e8).abs() / error,
        _ => f64::NAN,
    }
}

/// The scores of ten noises, of something of this size.
fn scores(wrong: &Wrong, size: f64, noises: u64) -> Result<usize, Error> {
    let data = seen(wrong, size)?;
    let fits: Vec<FitReport> = (0..noises)
        .into_par_iter()
        .map(|seed| fitted(data.clone(), Some(seed), true))
        .collect::<Result<_, _>>()?;
    let named = |r: &&FitReport| r.score_tests.iter().take(2).any(|t| t.source == wrong.place);
    Ok(fits.iter().filter(named).count())
}

fn main() -> Result<(), Error> {
    let noises = std::env::args().nth(1).and_then(|n| n.parse().ok()).unwrap_or(10);
    let mut named = [0; 2];
    for wrong in &WRONG {
        let mut size = wrong.size;
        // Twice, as a large one may be no longer linear.
        for _ in 0..2 {
            size *= BIAS / bias(&fitted(seen(wrong, size)?, None, false)?);
        }
        let there = fitted(seen(wrong, size)?, None, true)?;
        let own = there.score_tests.iter().find(|test| test.source == wrong.place);
        let sigmas = own.map_or(0.0, |test| test.sigmas.abs());
        let clearer = if sigmas > 0.0 { (CLEAR / sigmas).max(1.0) } else { 1.0 };
        let found = [scores(wrong, size, noises)?, scores(wrong, clearer * size, noises)?];
        println!(
            "{}: {size:.1e} leaves {sigmas:.1} sigma: named first or second in {} of {noises}; {:.1e}: in {}",
            wrong.place,
            found[0],
            clearer * size,
            found[1]
        );
        named = [0, 1].map(|k| named[k] + found[k]);
    }
    let all = WRONG.len() * noises as usize;
    println!("named in {} and {} of {all}", named[0], named[1]);
    Ok(())
}
