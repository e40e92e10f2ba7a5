//! Identification in space, from the tip of a released helix: exact data give the parameters from any start.

use rodfit::fit::FitReport;
use rodfit::scene::{Clamp, Scene, Scheme, Time};
use rodfit::{Observation, Parameter, Unknown};

use crate::common::fits::{
    covers, error, fit_with, found, mean_and_spread, noisy, print_work, record_in_space, same_mesh,
};
use crate::common::{helix_with, simulate};

/// 26 nodes for 1 s.
fn small() -> Scene {
    let mut scene = helix_with(0.5, 2e-3, 1.0, Clamp::MidEdge);
    scene.rod.segments = Some(25);
    scene
}

/// The tip at 100 times.
fn observe(scene: &Scene) -> Observation {
    record_in_space(&simulate(scene), 100)
}

/// Data and model have the same mesh.
fn fit<U: Into<Unknown> + Clone>(scene: &Scene, data: &Observation, unknowns: &[U]) -> FitReport {
    fit_with(scene, data, unknowns, same_mesh())
}

/// Six moduli, without a start and with starts from a hundredth to a hundred times the true modulus.
#[test]
fn exact_data_give_exact_modulus_from_any_start() {
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
            // Exact data: within the tolerance of the search.
            assert!(error < 1e-8, "{truth:e}, {unknown:?}: {report}");
        }
    }
    print_work(worst, work);
}

/// Bending and twisting both extend a helix: the motion of the tip determines both moduli.
#[test]
fn exact_data_give_young_and_shear_modulus() {
    let mut scene = small();
    (scene.material.poisson_ratio, scene.material.shear_modulus) = (None, Some(4.2e6));
    let data = observe(&scene);
    (scene.material.youngs_modulus, scene.material.shear_modulus) = (1.0, Some(1.0));
    let report = fit(&scene, &data, &[Parameter::YoungsModulus, Parameter::ShearModulus]);
    let errors = [
        error(&report, Parameter::YoungsModulus, 1e7),
        error(&report, Parameter::ShearModulus, 4.2e6),
    ];
    println!("errors {errors:?}, {:.1} simulations\n{report}", report.simulations);
    // Exact data: within the tolerance of the search.
    assert!(errors.iter().all(|e| *e < 1e-7), "{errors:?}");
    // The other way to say the same.
    let mut scene = small();
    let data = observe(&scene);
    scene.material.poisson_ratio = Some(0.2);
    let report = fit(&scene, &data, &[Parameter::YoungsModulus, Parameter::PoissonRatio]);
    // The data are simulated with 1e7 Pa and a Poisson ratio of 0.5.
    found(&report, &[(Parameter::YoungsModulus, 1e7)], 1e-7);
    found(&report, &[(Parameter::PoissonRatio, 0.5)], 1e-6);
}

#[test]
fn exact_data_give_modulus_and_beta() {
    let mut scene = small();
    scene.time = Some(Time { beta: 0.7, ..Time::new(1.0, 5e-3) });
    let data = observe(&scene);
    Parameter::Beta.set(&mut scene, 0.5).unwrap();
    let truths = [(Parameter::YoungsModulus, 1e7), (Parameter::Beta, 0.7)];
    // The values with which the data are simulated, without noise.
    found(&fit(&scene, &data, &truths.map(|(p, _)| p)), &truths, 1e-7);
}

#[test]
fn average_vector_field_gives_exact_modulus() {
    let mut scene = small();
    scene.time = Some(Time { scheme: Scheme::AverageVectorField, ..Time::new(1.0, 5e-3) });
    let data = observe(&scene);
    // The modulus with which the data are simulated, without noise.
    found(
        &fit(&scene, &data, &[Parameter::YoungsModulus]),
        &[(Parameter::YoungsModulus, 1e7)],
        1e-8,
    );
}

#[test]
fn exact_data_give_modulus_and_natural_curvature() {
    let mut scene = small();
    scene.rod.natural_curvature = 0.93.into();
    let data = observe(&scene);
    scene.rod.natural_curvature = 1.0.into();
    let truths = [(Parameter::YoungsModulus, 1e7), (Parameter::NaturalCurvature, 0.93)];
    // The values with which the data are simulated, without noise.
    found(&fit(&scene, &data, &truths.map(|(p, _)| p)), &truths, 1e-7);
}

/// The reported standard error equals the standard deviation of the estimates over noisy data sets.
#[test]
fn standard_error_equals_spread_of_replicates() {
    let scene = small();
    let clean = observe(&scene);
    let (mut estimates, mut errors, mut covered) = (Vec::new(), Vec::new(), 0);
    let seeds = 100;
    for seed in 0..seeds {
        let data = noisy(&clean, 2e-4, seed);
        let report = fit(&scene, &data, &[Unknown::new(Parameter::YoungsModulus).start(1e7)]);
        let estimate = report.estimate(Parameter::YoungsModulus).unwrap();
        covered += usize::from(covers(&report, Parameter::YoungsModulus, 1e7));
        estimates.push(estimate.value.unwrap());
        errors.push(estimate.std_error.unwrap());
    }
    let ([mean, spread], [stated, _]) = (mean_and_spread(&estimates), mean_and_spread(&errors));
    println!("standard error over spread {:.3}; {covered} of {seeds} covered", stated / spread);
    // The spread of 100 estimates has a relative error of 7 %; three of them are 20 %.
    assert!((stated / spread - 1.0).abs() < 0.2, "{stated:e} {spread:e}");
    // 95 expected; three standard deviations of the count are 6.5.
    assert!((89..=100).contains(&covered), "{covered}");
    // The mean has a standard error of the spread over sqrt(100).
    assert!((mean - 1e7).abs() < 4.0 * stated / (seeds as f64).sqrt(), "{mean:e}");
}
