//! Calibration of the posterior distribution: simulation-based calibration, and coverage of its 95 % interval.
//!
//! Truths are drawn from the prior, flat in the logarithm between bounds. Their motions with noise are fitted, and the
//! ranks of the truths among independent draws from the posteriors are uniform if these are right (Talts, Betancourt,
//! Simpson, Vehtari and Gelman 2018). Printed are the ranks in 10 classes, their chi-square p value, and the share of
//! 95 % intervals that contain the truth, of the posterior and of the linear model. The cases are E with damping over
//! 0.6 s, and E from the first tenth of a second, which is strongly nonlinear. A last case has the same truth, 1e8 Pa, in
//! all data sets; its ranks need not be uniform.
//!
//! `cargo run --release --example posterior_calibration` for 4 data sets a case, `-- 200` for the study,
//! `-- 200 short` for the second case.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;
use rodfit::fit::{Analysis, PosteriorSettings, Refinement, Sample};
use rodfit::scene::{Material, Section, Shape, Time};
use rodfit::{Error, Fit, Observation, Parameter, Point, Scene, Unknown};
use statrs::distribution::{ChiSquared, ContinuousCDF};

/// Number of classes of the ranks.
const CLASSES: usize = 10;
/// Number of draws of a posterior among which the truth is ranked, nearly independent ones.
const RANKED: usize = 99;

/// A kind of data: duration, s, standard deviation of the noise, m, and parameters with the bounds of their prior.
struct Case {
    name: &'static str,
    duration: f64,
    noise: f64,
    parameters: &'static [(Parameter, [f64; 2])],
    /// Whether the truths are drawn from the prior; else they are its median.
    are_drawn: bool,
}

/// Result for a parameter of one data set.
struct Calibration {
    /// Rank of the truth among the draws, as a fraction of their number.
    rank: f64,
    /// Whether the 95 % intervals of the posterior and of the linear model contain the truth.
    is_covered: [bool; 2],
}

/// A released cantilever of 11 nodes with mass damping.
fn cantilever(duration: f64) -> Scene {
    let shape = Shape::Straight { length: 0.5, direction: [1.0, 0.0, 0.0] };
    let section = Section::Circle { radius: 0.005 };
    let mut scene = Scene::new(10, shape, section, Material::new(1273.52, 1e8));
    scene.loads.gravity = [0.0, -9.8, 0.0];
    scene.loads.damping.mass = 0.8;
    scene.time = Some(Time::new(duration, 4e-3));
    scene
}

/// The calibration of every parameter for the data set `seed`; none for a fit without a posterior.
fn calibrate(case: &Case, seed: u64) -> Result<Option<Vec<Calibration>>, Error> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut truth = |[low, high]: [f64; 2]| {
        let place = if case.are_drawn { random.random_range(0.0..1.0) } else { 0.5 };
        low * (high / low).powf(place)
    };
    let truths: Vec<(Parameter, f64)> =
        case.parameters.iter().map(|(parameter, bounds)| (*parameter, truth(*bounds))).collect();
    let problem = cantilever(case.duration).problem()?;
    let run = problem.with(truths.iter().copied())?.simulate()?;
    let mut noise = || {
        let x: f64 = StandardNormal.sample(&mut random);
        case.noise * x
    };
    let sample = |k: u32| -> Result<Sample, Error> {
        let time = case.duration * f64::from(k) / 30.0;
        let [x, y, _] = run.at(Point::Tip, time)?.0;
        Ok(Sample { time, position: [Some(x + noise()), Some(y + noise()), None] })
    };
    let samples = (1..=30).map(sample).collect::<Result<_, _>>()?;
    let settings = PosteriorSettings { draws: 150, chains: 2, warmup: 100 };
    let analysis = Analysis {
        posterior: Some(settings),
        seed,
        discretization_error: Refinement::None,
        sensitivity_analysis: Some(false),
        ..Analysis::default()
    };
    let fit = Fit::new(&problem).observe(Observation::new(samples)).analyse(analysis);
    let unknown = |(parameter, [low, high]): &(Parameter, [f64; 2])| {
        Unknown::new(*parameter).start((low * high).sqrt()).bounds(*low, *high)
    };
    let fit = case.parameters.iter().fold(fit, |fit, parameter| fit.identify(unknown(parameter)));
    let report = fit.solve()?;
    let Some(draws) = &report.posterior_draws else { return Ok(None) };
    let all: Vec<&Vec<f64>> = draws.chains.iter().flatten().map(|draw| &draw.values).collect();
    let calibration = |(i, (_, truth)): (usize, &(Parameter, f64))| {
        let ranked = (0..RANKED).map(|k| all[k * all.len() / RANKED][i]);
        let below = ranked.filter(|value| value < truth).count();
        let estimate = &report.parameters[i];
        let contains = |ends: [f64; 2]| ends[0] <= *truth && *truth <= ends[1];
        let posterior = estimate.posterior.as_ref().is_some_and(|p| contains(p.interval95));
        let is_covered = [posterior, estimate.interval95.is_some_and(contains)];
        Calibration { rank: below as f64 / (RANKED + 1) as f64, is_covered }
    };
    Ok(Some(truths.iter().enumerate().map(calibration).collect()))
}

fn main() -> Result<(), Error> {
    let count: u64 = std::env::args().nth(1).and_then(|n| n.parse().ok()).unwrap_or(4);
    let wanted = std::env::args().nth(2).unwrap_or_default();
    let cases = [
        Case {
            name: "long: E with damping, 0.6 s, noise 1 mm",
            duration: 0.6,
            noise: 1e-3,
            parameters: &[
                (Parameter::YoungsModulus, [5e7, 2e8]),
                (Parameter::DampingMass, [0.4, 1.6]),
            ],
            are_drawn: true,
        },
        Case {
            name: "short: E, 0.1 s, noise 3 mm",
            duration: 0.1,
            noise: 3e-3,
            parameters: &[(Parameter::YoungsModulus, [1e7, 1e9])],
            are_drawn: true,
        },
        Case {
            name: "one truth: E = 1e8 Pa, 0.1 s, noise 3 mm",
            duration: 0.1,
            noise: 3e-3,
            parameters: &[(Parameter::YoungsModulus, [1e7, 1e9])],
            are_drawn: false,
        },
    ];
    for case in cases.iter().filter(|case| case.name.starts_with(&wanted)) {
        let all: Vec<_> = (0..count).into_par_iter().map(|seed| calibrate(case, seed)).collect();
        let found: Vec<_> = all.into_iter().flatten().flatten().collect();
        println!("{}: {} of {count} data sets with a posterior", case.name, found.len());
        for (i, (parameter, _)) in case.parameters.iter().enumerate() {
            let mut classes = [0_u32; CLASSES];
            let mut covered = [0_u32; 2];
            for own in found.iter().map(|parameters| &parameters[i]) {
                classes[(own.rank * CLASSES as f64) as usize] += 1;
                covered.iter_mut().zip(own.is_covered).for_each(|(n, is)| *n += u32::from(is));
            }
            let expected = found.len() as f64 / CLASSES as f64;
            let square = |n: &u32| (f64::from(*n) - expected).powi(2) / expected;
            let statistic: f64 = classes.iter().map(square).sum();
            let p = ChiSquared::new((CLASSES - 1) as f64).map_or(f64::NAN, |chi| chi.sf(statistic));
            let share = covered.map(|n| 100.0 * f64::from(n) / found.len() as f64);
            println!(
                "  {parameter}: ranks {classes:?}, chi-square p = {p:.3}; 95 % interval contains the truth: \
                 posterior {:.1} %, linear {:.1} %",
                share[0], share[1]
            );
        }
    }
    Ok(())
}
