//! Coverage of intervals under noise that is autocorrelated, heavy-tailed, rounded or unequal: 200 seeds each, a part of
//! `cargo run --release --example coverage -- 1000`.

use nalgebra::DMatrix;
use rayon::prelude::*;
use rodfit::fit::{Analysis, FitReport, Grade};
use rodfit::scene::{Drag, Scene};
use rodfit::{Fit, Observation, Parameter, Unknown};

use crate::common::coarse;
use crate::common::fits::{covers, fit_with, observe, same_mesh};

#[path = "../../examples/coverage/noise.rs"]
pub mod kinds;
use kinds::Noise;

const TRUTHS: [(Parameter, f64); 2] =
    [(Parameter::YoungsModulus, 1e8), (Parameter::DampingMass, 0.8)];

/// A damped oscillation of a rod with 6 edges.
fn swinging() -> Scene {
    let mut scene = coarse(6, 8e-3, 0.6);
    scene.loads.damping.mass = 0.8;
    scene
}

/// Both parameters with start values and bounds: no scan.
fn unknowns() -> [Unknown; 2] {
    TRUTHS.map(|(p, truth)| Unknown::new(p).start(truth).bounds(0.5 * truth, 2.0 * truth))
}

/// Standard errors of the parameters for independent residuals, `v (J'J)^-1`.
fn white_errors(report: &FitReport, data: &Observation) -> [f64; 2] {
    let scene = swinging();
    let fit = Fit::new(&scene.problem().unwrap()).observe(data.clone());
    let fit = TRUTHS.iter().fold(fit, |fit, (p, _)| fit.identify(*p));
    let residuals = fit.residuals().unwrap();
    let x = TRUTHS.map(|(p, _)| report.estimate(p).unwrap().value.unwrap().ln());
    let rows = residuals.jacobian_at(&x).unwrap();
    let j = DMatrix::from_fn(rows.len(), 2, |a, b| rows[a][b]);
    let r = residuals.residuals(&x).unwrap();
    let variance = r.iter().map(|r| r * r).sum::<f64>() / (r.len() - 2) as f64;
    let covariance = j.tr_mul(&j).try_inverse().unwrap() * variance;
    [0, 1].map(|k| covariance[(k, k)].sqrt() * x[k].exp())
}

/// Statistics of many fits with random noise.
struct Campaign {
    /// Fraction of the intervals that contain the truth, for E and damping.
    covered: [f64; 2],
    /// Mean width of the intervals over that for independent residuals.
    wider: f64,
    /// Fraction of fits with an accepted grade.
    trustworthy: f64,
    reports: Vec<FitReport>,
}

/// Statistics of the fits of many seeds to the same motion with this noise and these gaps.
fn campaign(noise: Noise, gap: usize, seeds: u64) -> Campaign {
    let scene = swinging();
    let clean = observe(&scene, 300);
    let fits = (0..seeds).into_par_iter().map(|seed| {
        let mut data = clean.clone();
        noise.add(&mut data, 1e-3, gap, seed);
        let report = fit_with(&scene, &data, &unknowns(), same_mesh());
        let white = white_errors(&report, &data);
        (report, white)
    });
    let fits: Vec<(FitReport, [f64; 2])> = fits.collect();
    let n = seeds as f64;
    let covered = TRUTHS
        .map(|(p, truth)| fits.iter().filter(|(r, _)| covers(r, p, truth)).count() as f64 / n);
    let mut wider = 0.0;
    for (report, white) in &fits {
        for ((p, _), white) in TRUTHS.iter().zip(white) {
            let [low, high] = report.estimate(*p).unwrap().interval95.unwrap();
            wider += (high - low) / (2.0 * 1.96 * white) / (2.0 * n);
        }
    }
    // Without a stated sigma autocorrelated noise is not separated from a missing effect.
    let accepted: &[Grade] = match noise {
        Noise::Correlated(_) => &[Grade::Trustworthy, Grade::CorrelatedOrMissing],
        _ => &[Grade::Trustworthy],
    };
    let trusted = |r: &FitReport| accepted.contains(&r.grade);
    let trustworthy = fits.iter().filter(|(r, _)| trusted(r)).count() as f64 / n;
    let simulations = fits.iter().map(|(r, _)| r.simulations).sum::<f64>() / n;
    println!(
        "{simulations:.1} simulations each, {noise:?}, gaps of {gap}: covered {covered:.3?}, {wider:.3} times as wide, {trustworthy:.2} trustworthy"
    );
    Campaign { covered, wider, trustworthy, reports: fits.into_iter().map(|(r, _)| r).collect() }
}

/// Coverage of 95 % in 200 fits: 190 expected; three standard deviations of the count are 9.
#[track_caller]
fn holds(campaign: &Campaign) {
    assert!(campaign.covered.iter().all(|c| (0.905..=0.995).contains(c)), "{:?}", campaign.covered);
}

#[test]
fn white_noise_keeps_the_intervals_of_independent_residuals() {
    let white = campaign(Noise::White, 0, 200);
    holds(&white);
    // A false alarm in a few per cent of 200 fits, and intervals hardly wider in the mean.
    assert!(white.wider < 1.05 && white.trustworthy > 0.97, "{}", white.wider);
}

/// AR(1) noise of the correlation `r` has the effective sample size `n (1 - r)/(1 + r)`.
#[test]
fn intervals_cover_under_autocorrelated_noise() {
    for (rho, gap) in [(0.3, 0), (0.8, 12), (0.95, 0)] {
        let found = campaign(Noise::Correlated(rho), gap, 200);
        holds(&found);
        let mean = |of: &dyn Fn(&FitReport) -> f64| {
            found.reports.iter().map(of).sum::<f64>() / found.reports.len() as f64
        };
        let correlation = mean(&|r| r.residual_tests[0].autocorrelation);
        // The correlation of the noise, estimated from many residuals.
        assert!((correlation - rho).abs() < 0.02, "{correlation}");
        let values = found.reports[0].residual_tests[0].values as f64;
        let effective = mean(&|r| r.residual_tests[0].effective_samples) / values;
        // Effective sample size of AR(1) noise, `n (1 - r)/(1 + r)`.
        assert!((effective / ((1.0 - rho) / (1.0 + rho)) - 1.0).abs() < 0.25, "{effective}");
        // The model is not graded as inadequate.
        assert!(found.trustworthy > 0.9, "{}", found.trustworthy);
        let is_noted =
            |r: &&FitReport| r.warnings.iter().any(|w| w.contains("carry the information of"));
        assert!(found.reports.iter().filter(is_noted).count() > 190);
    }
}

#[test]
fn intervals_cover_under_heavy_tails_whole_pixels_and_unequal_variances() {
    for noise in [Noise::HeavyTailed, Noise::Pixels, Noise::Unlike] {
        holds(&campaign(noise, 0, 200));
    }
}

/// Residuals of a wrong model are not taken for autocorrelated noise.
#[test]
fn wrong_models_are_graded_as_inadequate() {
    type Wrong = (&'static str, fn(&mut Scene));
    let wrong: [Wrong; 6] = [
        ("clock", |scene| scene.camera.time_offset = 1e-3),
        ("tilt", |scene| scene.supports.angle = 2e-3),
        ("roll", |scene| scene.camera.in_plane_rotation = 3e-3),
        ("strain rates", |scene| scene.loads.damping.stiffness = 2e-3),
        ("drag", |scene| {
            scene.loads.drag = Some(Drag { quadratic_normal: 0.15, ..Drag::default() });
        }),
        ("weight", |scene| scene.loads.gravity[1] *= 1.01),
    ];
    for (name, make) in wrong {
        let mut scene = swinging();
        make(&mut scene);
        let (offset, roll) = (scene.camera.time_offset, scene.camera.in_plane_rotation);
        let mut observed = observe(&scene, 300);
        observed.samples.retain(|s| s.time > offset);
        for sample in &mut observed.samples {
            sample.time -= offset;
            let (sin, cos) = roll.sin_cos();
            if let [Some(x), Some(y), _] = sample.position {
                sample.position = [Some(x * cos - y * sin), Some(x * sin + y * cos), None];
            }
        }
        let fit = |seed: u64| {
            let mut data = observed.clone();
            Noise::White.add(&mut data, 1e-3, 0, seed);
            fit_with(&swinging(), &data, &unknowns(), same_mesh())
        };
        let fits: Vec<FitReport> = (0..8).into_par_iter().map(fit).collect();
        for report in fits {
            assert_eq!(report.grade, Grade::ModelDoesNotExplain, "{name}: {report}");
        }
    }
}

/// The block bootstrap is independent of the AR(1) model of the standard errors.
#[test]
fn block_bootstrap_and_profile_agree_with_standard_errors() {
    let scene = swinging();
    let mut data = observe(&scene, 300);
    Noise::Correlated(0.8).add(&mut data, 1e-3, 0, 3);
    let analysis = Analysis { bootstrap: 100, profile: true, ..same_mesh() };
    let report = fit_with(&scene, &data, &unknowns(), analysis);
    println!("{report}");
    for estimate in &report.parameters {
        let sd = estimate.std_error.unwrap();
        let spread = estimate.bootstrap.as_ref().unwrap().std_error;
        // Correlation across blocks is lost: 10 to 20 % at these lengths.
        assert!((0.6..1.2).contains(&(spread / sd)), "{report}");
        let (interval, profile) = (estimate.interval95.unwrap(), estimate.profile95.unwrap());
        for (end, profile) in interval.into_iter().zip(profile) {
            assert!((end - profile.unwrap()).abs() < 0.2 * sd, "{report}");
        }
    }
}

/// Samples with a sigma of 3e-3 m beside as many with 1e-4 m add 0.1 % of the information.
#[test]
fn samples_are_weighted_by_their_own_sigmas() {
    let scene = swinging();
    let mut observed = observe(&scene, 100);
    let sigmas: Vec<f64> = (0..100).map(|k| if k % 2 == 0 { 1e-4 } else { 3e-3 }).collect();
    let mut noisy = observed.clone();
    Noise::White.add(&mut noisy, 1.0, 0, 5);
    for ((observed, noisy), sigma) in observed.samples.iter_mut().zip(&noisy.samples).zip(&sigmas) {
        for (x, noisy) in observed.position.iter_mut().zip(noisy.position) {
            *x = x.zip(noisy).map(|(x, noisy)| x + sigma * (noisy - x));
        }
    }
    let exact: Vec<_> = observed.samples.iter().copied().step_by(2).collect();
    let alone = Observation::new(exact).sigma(1e-4);
    let report = fit_with(&scene, &observed.sigmas(&sigmas), &unknowns(), same_mesh());
    assert!(report.grade == Grade::Trustworthy && report.warnings.is_empty(), "{report}");
    assert!(TRUTHS.iter().all(|(p, truth)| covers(&report, *p, *truth)), "{report}");
    // The standard errors are those of the accurate half.
    let alone = fit_with(&scene, &alone, &unknowns(), same_mesh());
    for (own, alone) in report.parameters.iter().zip(&alone.parameters) {
        let ratio = own.std_error.unwrap() / alone.std_error.unwrap();
        assert!((ratio - 1.0).abs() < 0.02, "{ratio}");
    }
}
