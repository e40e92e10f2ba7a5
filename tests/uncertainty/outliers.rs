//! Robust losses: a record with gaps and outliers, and what its errors are worth.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};
use rayon::prelude::*;
use rodfit::fit::{Analysis, Loss, Refinement};
use rodfit::scene::{Clamp, Scene};
use rodfit::{Fit, FitReport, Observation, Parameter};

use crate::common::{cantilever_with, record};

const ROBUST: [Loss; 3] = [Loss::Huber, Loss::SoftL1, Loss::Cauchy];
const SIGMA: f64 = 1e-3;

fn scene(end: f64) -> Scene {
    let mut scene = cantilever_with(0.5, 4e-3, end, Clamp::MidEdge);
    scene.rod.segments = Some(10);
    scene.loads.damping.mass = 0.6;
    scene
}

/// Noise on every coordinate; of all samples `missing` are gone, and of the coordinates left
/// `outliers` are off by 50 sigma.
fn spoiled(clean: &Observation, seed: u64, [missing, outliers]: [f64; 2]) -> Observation {
    let (mut random, noise) = (ChaCha8Rng::seed_from_u64(seed), Normal::new(0.0, SIGMA).unwrap());
    let mut data = clean.clone();
    data.samples.retain(|_| !random.random_bool(missing));
    for x in data.samples.iter_mut().flat_map(|s| s.position.iter_mut()).flatten() {
        *x += noise.sample(&mut random);
        if random.random_bool(outliers) {
            *x += if random.random_bool(0.5) { 50.0 * SIGMA } else { -50.0 * SIGMA };
        }
    }
    data
}

fn fit(scene: &Scene, data: Observation, unknowns: &[Parameter]) -> FitReport {
    let quick = Analysis { discretization_error: Refinement::None, ..Analysis::default() };
    let fit = Fit::new(&scene.problem().unwrap()).observe(data).analyse(quick);
    unknowns.iter().fold(fit, |fit, p| fit.identify(*p)).solve().unwrap()
}

/// A fifth of the samples missing, a twentieth of the coordinates off by 50 sigma, and a clock that
/// starts 40 ms late: E within 1 % and inside its interval, from no start, whether sigma is known
/// or not.
#[test]
fn gaps_outliers_and_a_late_clock() {
    let scene = scene(0.8);
    let problem = scene.problem().unwrap();
    let late = |mut data: Observation| {
        data.samples.iter_mut().for_each(|s| s.time -= 0.04);
        data.samples.retain(|s| s.time >= 0.0);
        data
    };
    let clean = record(&problem.simulate().unwrap(), 120);
    let mut covered = 0;
    for (seed, loss) in ROBUST.into_iter().cycle().take(12).enumerate() {
        let data = late(spoiled(&clean, seed as u64, [0.2, 0.05])).loss(loss);
        let data = if seed % 2 == 0 { data.sigma(SIGMA) } else { data };
        let report = fit(
            &scene,
            data,
            &[Parameter::YoungsModulus, Parameter::DampingMass, Parameter::TimeOffset],
        );
        assert!(report.is_success(), "{loss:?}, {seed}: {report}");
        let e = report.estimate(Parameter::YoungsModulus).unwrap();
        let (found, [low, high]) = (e.value.unwrap(), e.interval95.unwrap());
        assert!((found / 1e8 - 1.0).abs() < 0.01, "{loss:?}, {seed}: {report}");
        covered += usize::from(low <= 1e8 && 1e8 <= high);
        let effect = &report.losses[0];
        let share = effect.beyond_5_sigma as f64 / effect.values as f64;
        assert!((0.01..0.1).contains(&share), "{report}");
        assert!((0.85..1.3).contains(&effect.error_factor), "{report}");
    }
    println!("{covered} of 12 intervals cover");
    assert!(covered >= 10);
    // Least squares on the same data: an interval many times wider, and a warning or a miss.
    let data = late(spoiled(&clean, 0, [0.2, 0.05]));
    let robust = fit(
        &scene,
        data.clone().loss(Loss::Huber),
        &[Parameter::YoungsModulus, Parameter::TimeOffset],
    );
    let squares = fit(&scene, data, &[Parameter::YoungsModulus, Parameter::TimeOffset]);
    let error =
        |report: &FitReport| report.estimate(Parameter::YoungsModulus).unwrap().std_error.unwrap();
    assert!(error(&squares) > 5.0 * error(&robust), "{squares}\n{robust}");
}

/// 95 % intervals under every loss, with outliers and without, of 120 data sets each.
#[test]
fn robust_intervals_cover() {
    let scene = scene(0.5);
    let clean = record(&scene.problem().unwrap().simulate().unwrap(), 40);
    for loss in ROBUST {
        for outliers in [0.0, 0.05] {
            let covers = |seed: u64| {
                let data = spoiled(&clean, seed, [0.0, outliers]).loss(loss);
                let report = fit(&scene, data, &[Parameter::YoungsModulus]);
                assert!(report.is_success(), "{report}");
                let [low, high] = report.parameters[0].interval95.unwrap();
                usize::from(low <= 1e8 && 1e8 <= high)
            };
            let covered: usize = (0..120).into_par_iter().map(covers).sum();
            println!("{loss:?}, {outliers}: {covered} of 120");
            // Three standard deviations of the count are 7.
            assert!((106..=120).contains(&covered), "{loss:?}, {outliers}: {covered}");
        }
    }
}
