//! Posterior distributions of fits: agreement with the linear interval of long records, bounds and priors, and
//! repeatability.

use rodfit::fit::{Analysis, PosteriorSettings};
use rodfit::scene::Scene;
use rodfit::{Fit, FitReport, Parameter, Unknown};

use crate::common::coarse;
use crate::common::fits::{fit_with, noisy, observe, same_mesh};

/// A damped oscillation of a rod with 4 edges over 0.4 s.
fn small() -> Scene {
    let mut scene = coarse(4, 1e-2, 0.4);
    scene.loads.damping.mass = 2.0;
    scene
}

/// Four chains of so many draws, with a seed.
fn sampled(draws: usize, seed: u64) -> Analysis {
    let settings = PosteriorSettings { draws, chains: 4, warmup: 60 };
    Analysis { posterior: Some(settings), seed, ..same_mesh() }
}

/// A fit of E and damping to a record of `count` samples over 0.4 s.
fn report(count: usize, analysis: Analysis) -> FitReport {
    let scene = small();
    let data = noisy(&observe(&scene, count), 1e-3, 5);
    fit_with(&scene, &data, &[Parameter::YoungsModulus, Parameter::DampingMass], analysis)
}

/// Without bounds and prior, a damping that the data do not determine has no posterior: a density that is flat in its
/// logarithm stays above zero at zero damping. With bounds it has one.
#[test]
fn undetermined_damping_has_a_posterior_only_with_bounds() {
    let scene = small();
    let data = noisy(&observe(&scene, 40), 5e-2, 3);
    let solve = |damping: Unknown| {
        let fit = Fit::new(&scene.problem().unwrap()).observe(data.clone());
        let fit = fit.identify(Unknown::new(Parameter::YoungsModulus).bounds(1e7, 1e9));
        fit.identify(damping).analyse(sampled(60, 1)).solve().unwrap()
    };
    let damping = Unknown::new(Parameter::DampingMass).start(2.0);
    let without = solve(damping.clone());
    assert!(without.parameters.iter().all(|own| own.posterior.is_none()), "{without}");
    assert!(without.warnings.iter().any(|own| own.contains("no posterior distribution")));
    let within = solve(damping.bounds(0.1, 20.0));
    let posterior = within.parameters[1].posterior.as_ref().unwrap();
    let [low, high] = posterior.interval95;
    assert!(0.1 <= low && low < high && high <= 20.0, "{within}");
}

/// Mean and standard deviation of a nearly linear model are those of the linear interval, within Monte Carlo errors of
/// about 3 % and a part of the standard error.
#[test]
fn posterior_of_a_long_record_agrees_with_linear_interval() {
    let report = report(120, sampled(400, 1));
    println!("{report}");
    for estimate in &report.parameters {
        let (value, sd) = (estimate.value.unwrap(), estimate.std_error.unwrap());
        let posterior = estimate.posterior.as_ref().unwrap();
        let error = (posterior.mean - value).abs();
        assert!(error < 4.0 * posterior.mc_error + 0.05 * sd, "{report}");
        assert!((posterior.std_dev / sd - 1.0).abs() < 0.05, "{report}");
        assert!(posterior.r_hat < 1.01 && posterior.effective_draws > 400.0, "{report}");
        assert_eq!((posterior.divergences, posterior.draws), (0, 1600));
    }
    assert!(report.warnings.is_empty(), "{report}");
    assert!(report.to_string().contains("Posterior"), "{report}");
    let draws = report.posterior_draws.as_ref().unwrap();
    assert_eq!(draws.names, ["youngs_modulus", "damping.mass"]);
    assert_eq!(draws.to_csv().lines().count(), 1601);
}

/// The density of a draw is `-(n/2) ln S` of the misfit, whose sigma is not stated, up to a constant.
#[test]
fn log_density_of_draws_is_that_of_the_misfit() {
    let scene = small();
    let data = noisy(&observe(&scene, 30), 1e-3, 5);
    let unknowns = [Parameter::YoungsModulus, Parameter::DampingMass];
    let fit = unknowns.iter().fold(Fit::new(&scene.problem().unwrap()), |fit, p| fit.identify(*p));
    let fit = fit.observe(data).analyse(sampled(20, 2));
    let draws = fit.solve().unwrap().posterior_draws.unwrap();
    let residuals = fit.residuals().unwrap();
    let constant = |chain: usize, draw: usize| {
        let draw = &draws.chains[chain][draw];
        let x: Vec<f64> = draw.values.iter().map(|value| value.ln()).collect();
        let square: f64 = residuals.residuals(&x).unwrap().iter().map(|r| r * r).sum();
        draw.log_density + 30.0 * square.ln()
    };
    let first = constant(0, 0);
    for (chain, draw) in [(0, 7), (1, 3), (3, 19)] {
        let other = constant(chain, draw);
        assert!((other - first).abs() < 1e-6, "{other} for {first}");
    }
}

/// Data with a sigma of twenty lengths of the rod do not change a normal prior, which is normal in Pa and not in the
/// logarithm.
#[test]
fn posterior_without_information_is_the_prior() {
    let scene = small();
    let data = noisy(&observe(&scene, 12), 1e-3, 5).sigma(10.0);
    let unknown = Unknown::new(Parameter::YoungsModulus).start(1e8).prior(1e8, 2e7);
    let report = fit_with(&scene, &data, &[unknown], sampled(500, 4));
    let posterior = report.parameters[0].posterior.as_ref().unwrap();
    assert!((posterior.mean - 1e8).abs() < 4.0 * posterior.mc_error, "{posterior:?}");
    assert!((posterior.std_dev / 2e7 - 1.0).abs() < 0.08, "{posterior:?}");
}

/// Seeds and nothing else determine the draws: one thread gives those of two.
#[test]
fn draws_depend_on_the_seed_and_not_on_threads() {
    let draws = |threads: usize, seed: u64| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| report(30, sampled(20, seed)).posterior_draws.unwrap())
    };
    let first = draws(1, 1);
    assert_eq!(first, draws(3, 1));
    assert_ne!(first, draws(2, 2));
}
