//! Identification in space, from the tip of a released helix.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};
use rodfit::fit::{Analysis, FitReport, Refinement, Sample};
use rodfit::scene::{Clamp, Scene, Scheme, Time};
use rodfit::{Fit, Observation, Parameter, Point, Unknown};

use crate::common::helix_with;

/// 26 nodes for 1 s.
fn small() -> Scene {
    let mut scene = helix_with(0.5, 2e-3, 1.0, Clamp::MidEdge);
    scene.rod.segments = Some(25);
    scene
}

/// The tip at 100 times.
fn observe(scene: &Scene) -> Observation {
    let run = scene.problem().unwrap().simulate().unwrap();
    let samples = (1..=100).map(|k| {
        let time = f64::from(k) * 0.01;
        Sample { time, position: run.at(Point::Tip, time).unwrap().0.map(Some) }
    });
    Observation::new(samples.collect())
}

/// Data and model have the same mesh.
fn fit(scene: &Scene, observation: &Observation, unknowns: &[Unknown]) -> FitReport {
    let same = Analysis { discretization_error: Refinement::None, ..Analysis::default() };
    let fit = Fit::new(&scene.problem().unwrap()).observe(observation.clone()).analyse(same);
    unknowns.iter().fold(fit, |fit, unknown| fit.identify(unknown.clone())).solve().unwrap()
}

fn error(report: &FitReport, parameter: Parameter, truth: f64) -> f64 {
    let value = report.estimate(parameter).unwrap().value;
    assert!(report.is_success(), "{report}");
    (value.unwrap() / truth - 1.0).abs()
}

/// Six moduli, from no start and from a hundredth to a hundred times the truth.
#[test]
fn exact_modulus_from_anywhere() {
    let (mut worst, mut work) = (0.0_f64, Vec::new());
    for k in 0..6 {
        let truth = 4e6 * 25f64.powf(f64::from(k) / 5.0);
        let mut scene = small();
        scene.material.youngs_modulus = truth;
        let data = observe(&scene);
        scene.material.youngs_modulus = 1.0;
        let unknown = Unknown::new(Parameter::YoungsModulus);
        let starts =
            [0.01, 0.1, 1.0, 10.0, 100.0].map(|factor| unknown.clone().start(factor * truth));
        for unknown in [unknown.clone()].into_iter().chain(starts) {
            let report = fit(&scene, &data, std::slice::from_ref(&unknown));
            let error = error(&report, Parameter::YoungsModulus, truth);
            worst = worst.max(error);
            work.push(report.simulations);
            assert!(error < 1e-8, "{truth:e}, {unknown:?}: {report}");
        }
    }
    work.sort_by(f64::total_cmp);
    println!(
        "worst error {worst:.1e}; simulations: median {:.1}, most {:.1}",
        work[work.len() / 2],
        work[work.len() - 1]
    );
}

/// Bending and twisting both stretch a helix: one tip tells their moduli apart.
#[test]
fn young_and_shear_modulus_together() {
    let mut scene = small();
    (scene.material.poisson_ratio, scene.material.shear_modulus) = (None, Some(4.2e6));
    let data = observe(&scene);
    (scene.material.youngs_modulus, scene.material.shear_modulus) = (1.0, Some(1.0));
    let report =
        fit(&scene, &data, &[Parameter::YoungsModulus.into(), Parameter::ShearModulus.into()]);
    let errors = [
        error(&report, Parameter::YoungsModulus, 1e7),
        error(&report, Parameter::ShearModulus, 4.2e6),
    ];
    println!("errors {errors:?}, {:.1} simulations\n{report}", report.simulations);
    assert!(errors.iter().all(|e| *e < 1e-7), "{errors:?}");
    // The other way to say the same.
    let mut scene = small();
    let data = observe(&scene);
    scene.material.poisson_ratio = Some(0.2);
    let report =
        fit(&scene, &data, &[Parameter::YoungsModulus.into(), Parameter::PoissonRatio.into()]);
    assert!(error(&report, Parameter::YoungsModulus, 1e7) < 1e-7, "{report}");
    assert!(error(&report, Parameter::PoissonRatio, 0.5) < 1e-6, "{report}");
}

#[test]
fn modulus_and_beta_together() {
    let mut scene = small();
    scene.time = Some(Time { beta: 0.7, ..Time::new(1.0, 5e-3) });
    let data = observe(&scene);
    Parameter::Beta.set(&mut scene, 0.5).unwrap();
    let report = fit(&scene, &data, &[Parameter::YoungsModulus.into(), Parameter::Beta.into()]);
    assert!(error(&report, Parameter::YoungsModulus, 1e7) < 1e-7, "{report}");
    assert!(error(&report, Parameter::Beta, 0.7) < 1e-7, "{report}");
}

#[test]
fn exact_modulus_with_the_average_vector_field() {
    let mut scene = small();
    scene.time = Some(Time { scheme: Scheme::AverageVectorField, ..Time::new(1.0, 5e-3) });
    let data = observe(&scene);
    let report = fit(&scene, &data, &[Parameter::YoungsModulus.into()]);
    assert!(error(&report, Parameter::YoungsModulus, 1e7) < 1e-8, "{report}");
}

#[test]
fn modulus_and_natural_curvature_together() {
    let mut scene = small();
    scene.rod.natural_curvature = 0.93.into();
    let data = observe(&scene);
    scene.rod.natural_curvature = 1.0.into();
    let report =
        fit(&scene, &data, &[Parameter::YoungsModulus.into(), Parameter::NaturalCurvature.into()]);
    assert!(error(&report, Parameter::YoungsModulus, 1e7) < 1e-7, "{report}");
    assert!(error(&report, Parameter::NaturalCurvature, 0.93) < 1e-7, "{report}");
}

/// The standard error is the spread of the estimates over noisy data sets.
#[test]
fn standard_error_is_the_spread() {
    let scene = small();
    let clean = observe(&scene);
    let sigma = 2e-4;
    let noise = Normal::new(0.0, sigma).unwrap();
    let (mut estimates, mut errors, mut covered) = (Vec::new(), Vec::new(), 0);
    let seeds = 100;
    for seed in 0..seeds {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut data = clean.clone();
        for sample in &mut data.samples {
            sample.position = sample.position.map(|x| x.map(|x| x + noise.sample(&mut random)));
        }
        let report = fit(&scene, &data, &[Unknown::new(Parameter::YoungsModulus).start(1e7)]);
        let estimate = report.estimate(Parameter::YoungsModulus).unwrap();
        let [low, high] = estimate.interval95.unwrap();
        covered += usize::from(low <= 1e7 && 1e7 <= high);
        estimates.push(estimate.value.unwrap());
        errors.push(estimate.std_error.unwrap());
    }
    let n = seeds as f64;
    let mean = estimates.iter().sum::<f64>() / n;
    let spread = (estimates.iter().map(|e| (e - mean).powi(2)).sum::<f64>() / (n - 1.0)).sqrt();
    let stated = errors.iter().sum::<f64>() / n;
    println!("standard error over spread {:.3}; {covered} of {seeds} covered", stated / spread);
    assert!((stated / spread - 1.0).abs() < 0.2, "{stated:e} {spread:e}");
    assert!((89..=100).contains(&covered), "{covered}");
    assert!((mean - 1e7).abs() < 4.0 * stated / n.sqrt(), "{mean:e}");
}
