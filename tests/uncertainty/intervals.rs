//! Intervals of identified parameters by standard error, profile, bootstrap and observed information, with discretization
//! error: agreement and coverage.

use rodfit::fit::{Analysis, Experiment, Refinement};
use rodfit::scene::{Clamp, Scene, Time};
use rodfit::{Fit, Parameter};

use crate::common::coarse;
use crate::common::fits::{covers, fit, fit_with, noisy, observe, same_mesh};

/// A damped oscillation of a rod with 10 edges.
pub fn small(end: f64) -> Scene {
    let mut scene = coarse(10, 4e-3, end);
    scene.loads.damping.mass = 0.8;
    scene
}

/// Profile, bootstrap and observed information agree with the standard error of a nearly linear model.
#[test]
fn four_methods_agree_on_a_nearly_linear_model() {
    let scene = small(0.8);
    let data = noisy(&observe(&scene, 60), 1e-3, 5);
    let analysis = Analysis {
        profile: true,
        bootstrap: 400,
        seed: 7,
        observed_information: true,
        discretization_error: Refinement::None,
        ..Analysis::default()
    };
    let report = fit_with(
        &scene,
        &data,
        &[Parameter::YoungsModulus, Parameter::DampingMass],
        analysis.clone(),
    );
    println!("{report}");
    for estimate in &report.parameters {
        let (sd, [low, high]) = (estimate.std_error.unwrap(), estimate.interval95.unwrap());
        let near = |a: f64, b: f64, part: f64| assert!((a - b).abs() < part * sd, "{report}");
        // Observed and expected information agree where the model is nearly linear.
        near(estimate.observed_std_error.unwrap(), sd, 0.1);
        let bootstrap = estimate.bootstrap.as_ref().unwrap();
        // The spread of 400 has an error of 4 %, its percentiles one of about 13 %.
        near(bootstrap.std_error, sd, 0.12);
        near(bootstrap.interval95[0], low, 0.4);
        near(bootstrap.interval95[1], high, 0.4);
        let [from, to] = estimate.profile95.unwrap();
        // The profile is a parabola there.
        near(from.unwrap(), low, 0.1);
        near(to.unwrap(), high, 0.1);
    }
    assert!(report.warnings.is_empty(), "{report}");
    // The same seed yields the same replicates.
    let again =
        fit_with(&scene, &data, &[Parameter::YoungsModulus, Parameter::DampingMass], analysis);
    assert_eq!(
        again.parameters[0].bootstrap.as_ref().unwrap().interval95,
        report.parameters[0].bootstrap.as_ref().unwrap().interval95
    );
}

/// The ends of the profile against fits with the parameter held there: twice the misfit has risen by the squared quantile.
#[test]
fn profile_ends_at_the_squared_quantile() {
    let scene = small(0.3);
    let data = noisy(&observe(&scene, 12), 1e-2, 3).sigma(1e-2);
    let analysis = Analysis { profile: true, ..Analysis::default() };
    let report = fit_with(&scene, &data, &[Parameter::YoungsModulus], analysis);
    let residuals = Fit::new(&scene.problem().unwrap())
        .observe(data)
        .identify(Parameter::YoungsModulus)
        .residuals()
        .unwrap();
    let square =
        |e: f64| residuals.residuals(&[e.ln()]).unwrap().iter().map(|r| r * r).sum::<f64>();
    let estimate = &report.parameters[0];
    let least = square(estimate.value.unwrap());
    for end in estimate.profile95.unwrap() {
        let rise = square(end.unwrap()) - least;
        // The normal quantile 0.975: twice the misfit rises by its square.
        assert!((rise.sqrt() - 1.959964).abs() < 2e-3, "{rise}: {report}");
    }
}

/// Damping near zero is bounded from above only, by the profile or by the fit.
#[test]
fn interval_of_undetermined_damping_is_open() {
    let mut scene = small(0.4);
    scene.loads.damping.mass = 0.1;
    let (mut open, mut bounded, mut covered) = (0, 0, 0);
    for seed in 0..8 {
        let data = noisy(&observe(&scene, 30), 1e-2, seed);
        let analysis = Analysis { profile: true, ..Analysis::default() };
        let report = fit_with(&scene, &data, &[Parameter::DampingMass], analysis);
        let estimate = &report.parameters[0];
        match estimate.profile95 {
            Some([low, high]) => {
                open += usize::from(low.is_none());
                // The upper end of the profile, if there is one, is above the true damping of 0.1 1/s.
                assert!(high.is_none_or(|high| high > 0.1));
            }
            None => {
                let upper = estimate.upper95.unwrap();
                assert!(estimate.interval95 == Some([0.0, upper]), "{report}");
                covered += usize::from(upper > 0.1);
                bounded += 1;
            }
        }
    }
    println!("{open} open, {bounded} bounded of 8");
    assert!(open + bounded >= 4 && covered + 1 >= bounded);
}

/// A part of `cargo run --release --example coverage -- 2000`: E with damping.
#[test]
fn intervals_of_modulus_and_damping_cover() {
    let scene = small(0.6);
    let clean = observe(&scene, 30);
    let truths = [(Parameter::YoungsModulus, 1e8), (Parameter::DampingMass, 0.8)];
    let mut covered = [0; 2];
    let seeds = 200;
    for seed in 0..seeds {
        let data = noisy(&clean, 1e-3, seed);
        let report = fit_with(&scene, &data, &truths.map(|(p, _)| p), same_mesh());
        for (count, (parameter, truth)) in covered.iter_mut().zip(truths) {
            *count += usize::from(covers(&report, parameter, truth));
        }
    }
    println!("covered {covered:?} of {seeds}");
    // 190 expected; three standard deviations of a binomial count are 9.
    assert!(covered.iter().all(|c| (181..=199).contains(c)), "{covered:?}");
}

/// Six recordings of four frames each, without stated sigmas: the weights of the recordings have errors of their own.
/// With the weights taken as known, far fewer than 95 % of the intervals cover.
#[test]
fn intervals_of_short_recordings_without_sigmas_cover() {
    let scene = small(0.6);
    let clean = observe(&scene, 4);
    let (seeds, mut covered, mut width) = (100, 0, 0.0);
    for seed in 0..seeds {
        let problem = scene.problem().unwrap();
        let experiment = |k: u64| {
            let mut data = noisy(&clean, 1e-3, 6 * seed + k);
            data.header.sigma = None;
            Experiment::new(format!("clip {k}"), &problem).observe(data)
        };
        let fit = Fit::of((0..6).map(experiment)).analyse(same_mesh());
        let report = fit.identify(Parameter::YoungsModulus).solve().unwrap();
        covered += usize::from(covers(&report, Parameter::YoungsModulus, 1e8));
        width += report.parameters[0].coverage_factor.unwrap() / seeds as f64;
    }
    println!("covered {covered} of {seeds}, mean coverage factor {width:.3}");
    // 95 expected; three standard deviations of a binomial count are 6.5. Of 300 seeds 286 cover.
    assert!((88..=100).contains(&covered), "{covered}");
}

/// E from the first tenth of a second: the misfit is far from a parabola. A part of the same
/// campaign, where the standard error's interval covers 88.6 % and the profile's 94.3 %.
#[test]
fn profiles_cover_under_a_nonlinear_model() {
    let scene = coarse(10, 4e-3, 0.1);
    let (mut by_error, mut by_profile) = (0, 0);
    for seed in 0..100 {
        let data = noisy(&observe(&scene, 30), 3e-3, seed);
        let analysis = Analysis { profile: true, ..same_mesh() };
        let report = fit_with(&scene, &data, &[Parameter::YoungsModulus], analysis);
        let [from, to] = report.parameters[0].profile95.unwrap();
        by_error += usize::from(covers(&report, Parameter::YoungsModulus, 1e8));
        by_profile += usize::from(from.is_none_or(|x| x <= 1e8) && to.is_none_or(|x| 1e8 <= x));
    }
    println!("covered by standard error {by_error}, by profile {by_profile} of 100");
    // 95 expected; three standard deviations are 6.5.
    assert!(by_profile >= 88 && by_profile >= by_error, "{by_profile} {by_error}");
}

/// A damping of zero, or near it, has an upper bound, and does not change the estimate and the error of the modulus.
#[test]
fn damping_of_zero_has_an_upper_bound_that_covers() {
    let mut scene = small(1.0);
    // Its standard error is about 0.006 1/s.
    for (truth, least) in [(0.0, 60), (6e-3, 52)] {
        scene.loads.damping.mass = truth;
        let (mut covered, mut bounded, mut known) = (0, 0, 0);
        for seed in 0..60 {
            let data = noisy(&observe(&scene, 100), 1e-3, 100 + seed);
            let unknowns = [Parameter::YoungsModulus, Parameter::DampingMass];
            let report = fit_with(&scene, &data, &unknowns, same_mesh());
            let [modulus, damping] = &report.parameters[..] else { panic!("{report}") };
            assert!(report.is_success() && damping.identifiable, "{report}");
            known += usize::from(covers(&report, Parameter::YoungsModulus, 1e8));
            // An upper bound of the standard error, Pa, as in fits without damping.
            assert!(modulus.std_error.unwrap() < 2e5, "{report}");
            let [low, high] = damping.interval95.unwrap();
            covered += usize::from(truth <= high);
            if let Some(upper) = damping.upper95 {
                bounded += 1;
                // One-sided: from zero to the upper bound.
                assert!(low == 0.0 && high == upper && upper < 0.05, "{report}");
                assert!(damping.std_error.is_none() && damping.value.unwrap() < upper);
                let words = report.warnings.iter().find(|w| w.contains("at most")).unwrap();
                assert!(words.contains("damping.mass") && words.contains("95 %"), "{words}");
            }
        }
        println!("{truth}: covered {covered}, {bounded} bounds, modulus {known} of 60");
        // Of 60 intervals 57 cover, three standard deviations fewer are 52; an upper bound of zero always covers.
        assert!(covered >= least && known >= 52 && bounded >= 12, "{covered} {known} {bounded}");
    }
}

/// Data of a mesh four times finer and a tenth of the step: the reported error covers the bias.
#[test]
fn discretization_error_covers_the_bias_of_a_coarse_mesh() {
    let (mut covered, mut total, mut ratios) = (0, 0, Vec::new());
    for (segments, step, clamp) in
        [(10, 2e-3, Clamp::MidEdge), (16, 4e-3, Clamp::MidEdge), (20, 2e-3, Clamp::Nodes)]
    {
        for e in [3e7, 1e8, 5e8] {
            let mut scene = coarse(segments, step, 0.6);
            scene.supports.clamp = clamp;
            scene.material.youngs_modulus = e;
            let mut fine = scene.clone();
            fine.rod.segments = Some(4 * segments);
            fine.time = Some(Time::new(0.6, 0.1 * step));
            let data = observe(&fine, 60);
            let report = fit(&scene, &data, &[Parameter::YoungsModulus]);
            let bias = (report.parameters[0].value.unwrap() / e - 1.0).abs();
            let stated = report.discretization_error[0].relative.unwrap();
            let how =
                Analysis { discretization_error: Refinement::Refitted, ..Analysis::default() };
            let refitted = fit_with(&scene, &data, &[Parameter::YoungsModulus], how);
            let again = refitted.discretization_error[0].relative.unwrap();
            println!(
                "{segments} edges, {step} s, {clamp:?}, {e:e} Pa: bias {bias:.2e}, stated \
                 {stated:.2e}, refitted {again:.2e}"
            );
            total += 1;
            covered += usize::from(stated >= bias);
            ratios.push(stated / bias);
        }
    }
    assert!(covered + 1 >= total, "{covered} of {total}");
    // The estimate is no gross overestimate.
    ratios.sort_by(f64::total_cmp);
    assert!(ratios[total / 2] < 4.0, "{ratios:?}");
}
