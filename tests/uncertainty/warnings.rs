//! Wrong data, models and meshes lower the grade; right ones have no warnings.

use rodfit::fit::{FitReport, Grade, NonIdentifiability, Sample};
use rodfit::scene::{Clamp, Time};
use rodfit::{Fit, Parameter, Unknown};

use crate::common::fits::{fit, fit_with, noisy, observe, same_mesh};
use crate::intervals::small;

/// Requires an unsuccessful fit with this kind of non-identifiability, whose status has all words.
fn refused(report: &FitReport, kind: NonIdentifiability, words: &[&str]) {
    assert!(!report.is_success(), "{report}");
    assert!(report.not_identifiable.iter().any(|f| f.kind == kind), "{report:?}");
    for word in words {
        assert!(report.status.contains(word), "`{word}` in: {}", report.status);
    }
    for estimate in &report.parameters {
        assert_eq!(estimate.identifiable, estimate.value.is_some());
    }
}

#[test]
fn unidentifiable_parameters_and_combinations_are_reported() {
    let mut scene = small(1.0);
    let data = noisy(&observe(&scene, 100), 2.7e-3, 1);
    let report =
        fit(&scene, &data, &[Parameter::YoungsModulus, Parameter::Density, Parameter::DampingMass]);
    refused(&report, NonIdentifiability::Structural, &["youngs_modulus/density"]);
    assert!(report.parameters[2].identifiable, "{report}");
    // Bending depends on E r^2 at a given density; only stretching separates the two. For a thinner rod even that is lost to
    // rounding, and the finding is structural.
    let report = Fit::new(&scene.problem().unwrap())
        .observe(data.clone())
        .identify(Parameter::YoungsModulus)
        .identify(Unknown::new(Parameter::Radius).bounds(4e-3, 2e-2))
        .solve()
        .unwrap();
    println!("{}", report.status);
    refused(&report, NonIdentifiability::Practical, &["youngs_modulus*radius^2", "practically"]);
    assert!(report.parameters.iter().all(|e| !e.identifiable), "{report}");
    let report =
        fit(&scene, &data, &[Parameter::YoungsModulus, Parameter::Radius, Parameter::Density]);
    println!("{}", report.status);
    refused(&report, NonIdentifiability::Structural, &[]);
    assert!(report.parameters.iter().all(|e| !e.identifiable), "{report}");
    // Twist does not enter in a plane.
    scene.material.shear_modulus = Some(3e7);
    let report = fit(&scene, &data, &[Parameter::YoungsModulus, Parameter::ShearModulus]);
    refused(&report, NonIdentifiability::Structural, &["shear_modulus has no effect"]);
    assert!(report.parameters[0].identifiable && !report.parameters[1].identifiable);
    scene.loads.gravity = [0.0; 3];
    let data = noisy(&observe(&scene, 100), 1e-3, 1);
    let report = fit(&scene, &data, &[Parameter::YoungsModulus, Parameter::DampingMass]);
    refused(
        &report,
        NonIdentifiability::Structural,
        &["youngs_modulus has no effect", "damping.mass has no effect"],
    );
}

#[test]
fn wrong_optimum_model_or_mesh_is_never_trustworthy() {
    let scene = small(1.0);
    let data = noisy(&observe(&scene, 100), 1e-3, 4);
    let unknowns = [Parameter::YoungsModulus, Parameter::DampingMass];
    let fine = fit_with(&scene, &data, &unknowns, same_mesh());
    assert!(fine.warnings.is_empty() && fine.grade == Grade::Trustworthy, "{fine}");
    let warned = |report: &FitReport, word: &str| {
        assert!(report.grade != Grade::Trustworthy, "{report}");
        assert!(report.warnings.iter().any(|w| w.contains(word)), "{report}");
    };
    // Held in wrong minima, from a hundredth to a hundred times the truth, by bounds.
    let windows = [1e6, 2e6, 5e6, 1.5e7, 4e7, 9.5e7, 1.05e8, 2e8, 5e8, 2e9, 1e10];
    for window in windows.windows(2).filter(|w| !(w[0] < 1e8 && w[1] > 1e8)) {
        let report = Fit::new(&scene.problem().unwrap())
            .observe(data.clone())
            .identify(Unknown::new(Parameter::YoungsModulus).bounds(window[0], window[1]))
            .analyse(same_mesh())
            .solve()
            .unwrap();
        warned(&report, "are autocorrelated");
    }
    // Damped data, undamped model.
    let mut undamped = scene.clone();
    undamped.loads.damping.mass = 0.0;
    warned(&fit(&undamped, &data, &[Parameter::YoungsModulus]), "are autocorrelated");
    // A clock that is late by 10 ms.
    let mut late = data.clone();
    late.samples.iter_mut().for_each(|s| s.time -= 0.008);
    late.samples.retain(|s: &Sample| s.time >= 0.0);
    warned(&fit(&scene, &late, &unknowns), "are autocorrelated");
    // Ten edges and exact data: the mesh is too coarse.
    let mut coarse = scene.clone();
    coarse.supports.clamp = Clamp::Nodes;
    let report = fit(&coarse, &data, &unknowns);
    warned(&report, "the discretization error may be");
    assert_eq!(report.grade, Grade::RefineNumerics, "{report}");
}

/// Residuals by a coarse mesh are attributed to the mesh; those by a missing damping are not.
#[test]
fn discretization_error_is_reported_before_a_missing_effect() {
    let coarse = small(1.0);
    let mut fine = coarse.clone();
    fine.rod.segments = Some(60);
    let data = noisy(&observe(&fine, 100), 1e-4, 6);
    let unknowns = [Parameter::YoungsModulus, Parameter::DampingMass];
    let report = fit(&coarse, &data, &unknowns);
    assert!(report.warnings[0].contains("before searching for a missing effect"), "{report}");
    assert!(report.warnings.iter().any(|w| w.contains("are autocorrelated")), "{report}");
    assert_eq!(report.grade, Grade::RefineNumerics, "{report}");
    // Kelvin-Voigt damping, on a mesh that is fine enough for the motion.
    fine.time = Some(Time::new(1.0, 5e-4));
    let mut stiff = fine.clone();
    stiff.loads.damping.mass = 0.0;
    stiff.loads.damping.stiffness = 2e-2;
    let data = noisy(&observe(&stiff, 100), 1e-4, 6);
    let report = fit(&fine, &data, &unknowns);
    assert_eq!(report.grade, Grade::ModelDoesNotExplain, "{report}");
    assert!(report.verdict.contains("not noise"), "{report}");
}

/// Every coordinate is tested with its own residuals, also if values are missing.
#[test]
fn residual_tests_name_the_coordinate_with_the_defect() {
    let scene = small(1.0);
    let mut data = noisy(&observe(&scene, 120), 1e-3, 8);
    for (k, sample) in data.samples.iter_mut().enumerate() {
        if k % 7 == 0 {
            sample.position[0] = None;
        }
        // A camera that sinks by 3 mm.
        let t = sample.time;
        sample.position[1] = sample.position[1].map(|y| y - 3e-3 * (t - 0.5));
    }
    let report = fit(&scene, &data, &[Parameter::YoungsModulus, Parameter::DampingMass]);
    let [x, y] = &report.residual_tests[..] else { panic!("{report:?}") };
    assert!(x.axis == "x" && x.passed && y.axis == "y" && !y.is_noise(), "{x:?} {y:?}");
    // The p-value of a trend of 3 standard deviations is tiny.
    assert!(y.trend < 1e-6 || y.whiteness < 1e-6, "{y:?}");
}

/// Large noise of a right model does not lower the grade.
#[test]
fn large_noise_keeps_the_grade() {
    let mut scene = small(1.0);
    scene.rod.segments = Some(20);
    let data = noisy(&observe(&scene, 100), 1.2e-2, 2);
    let report = fit(&scene, &data, &[Parameter::YoungsModulus]);
    // The residuals exceed a tenth of 7 cm, the size of the motion.
    assert!(report.residual_rms > 0.1 * 7e-2 && report.warnings.is_empty(), "{report}");
    // An upper bound of the cost.
    assert!(report.simulations < 20.0, "{report}");
}
