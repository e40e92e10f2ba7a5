//! Robust losses (Huber, soft L1, Cauchy): estimates and intervals from records with gaps and outliers.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};
use rayon::prelude::*;
use rodfit::fit::Loss;
use rodfit::scene::Scene;
use rodfit::{FitReport, Observation, Parameter};

use crate::common::coarse;
use crate::common::fits::{covers, fit_with, observe, same_mesh};

const ROBUST: [Loss; 3] = [Loss::Huber, Loss::SoftL1, Loss::Cauchy];
const SIGMA: f64 = 1e-3;

fn scene(end: f64) -> Scene {
    let mut scene = coarse(10, 4e-3, end);
    scene.loads.damping.mass = 0.6;
    scene
}

/// Noise on every coordinate, without the fraction `missing` of the samples; of the other coordinates the fraction `outliers` has
/// errors of 50 sigma.
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
    fit_with(scene, &data, unknowns, same_mesh())
}

/// A fifth of the samples missing, a twentieth of the coordinates with errors of 50 sigma, and a clock that
/// starts 40 ms late: E within 1 % and inside its interval, without a start value, with a stated sigma or without.
#[test]
fn robust_fit_recovers_from_gaps_outliers_and_a_late_clock() {
    let scene = scene(0.8);
    let late = |mut data: Observation| {
        data.samples.iter_mut().for_each(|s| s.time -= 0.04);
        data.samples.retain(|s| s.time >= 0.0);
        data
    };
    let clean = observe(&scene, 120);
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
        // The modulus of the simulation, 1e8 Pa, to 1 %.
        assert!((e.value.unwrap() / 1e8 - 1.0).abs() < 0.01, "{loss:?}, {seed}: {report}");
        covered += usize::from(covers(&report, Parameter::YoungsModulus, 1e8));
        let effect = &report.losses[0];
        let share = effect.beyond_5_sigma as f64 / effect.values as f64;
        // A twentieth of the coordinates has errors of 50 sigma, of which most are beyond 5 sigma.
        assert!((0.01..0.1).contains(&share), "{report}");
        // The loss changes standard errors by a moderate factor.
        assert!((0.85..1.3).contains(&effect.std_error_factor), "{report}");
    }
    println!("{covered} of 12 intervals cover");
    assert!(covered >= 10);
    // Least squares on the same data has a much wider interval, and a warning or a wrong estimate.
    let data = late(spoiled(&clean, 0, [0.2, 0.05]));
    let robust = fit(
        &scene,
        data.clone().loss(Loss::Huber),
        &[Parameter::YoungsModulus, Parameter::TimeOffset],
    );
    let squares = fit(&scene, data, &[Parameter::YoungsModulus, Parameter::TimeOffset]);
    let error =
        |report: &FitReport| report.estimate(Parameter::YoungsModulus).unwrap().std_error.unwrap();
    // Least squares takes the outliers as noise.
    assert!(error(&squares) > 5.0 * error(&robust), "{squares}\n{robust}");
}

/// 95 % intervals under every loss, with outliers and without, of 120 data sets each.
#[test]
fn intervals_of_all_losses_cover_with_and_without_outliers() {
    let scene = scene(0.5);
    let clean = observe(&scene, 40);
    for loss in ROBUST {
        for outliers in [0.0, 0.05] {
            let covers = |seed: u64| {
                let data = spoiled(&clean, seed, [0.0, outliers]).loss(loss);
                let report = fit(&scene, data, &[Parameter::YoungsModulus]);
                assert!(report.is_success(), "{report}");
                usize::from(covers(&report, Parameter::YoungsModulus, 1e8))
            };
            let covered: usize = (0..120).into_par_iter().map(covers).sum();
            println!("{loss:?}, {outliers}: {covered} of 120");
            // Three standard deviations of the count are 7.
            assert!((106..=120).contains(&covered), "{loss:?}, {outliers}: {covered}");
        }
    }
}
