//! What is wrong with data, model or mesh does not look fine, and what is not is not warned of.

use rodfit::fit::{FitReport, Grade, NonIdentifiability, Sample};
use rodfit::scene::{Clamp, Time};
use rodfit::{Fit, Parameter, Unknown};

use crate::common::fits::{fit, fit_with, noisy, observe, same_mesh};
use crate::intervals::small;

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
fn what_is_not_identifiable_is_named() {
    let mut scene = small(1.0);
    let data = noisy(&observe(&scene, 100), 2.7e-3, 1);
    let report =
        fit(&scene, &data, &[Parameter::YoungsModulus, Parameter::Density, Parameter::DampingMass]);
    refused(&report, NonIdentifiability::Structural, &["youngs_modulus/density"]);
    assert!(report.parameters[2].identifiable, "{report}");
    // Bending goes with E r^2 at a given density; only stretching tells them apart.
    // Of a thinner rod the digits lose even that, and the finding is structural.
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

/// A fit at a wrong optimum, of a wrong model, or with a wrong mesh does not look fine.
#[test]
fn nothing_wrong_looks_fine() {
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
    // A clock that runs a hundredth of a second late.
    let mut late = data.clone();
    late.samples.iter_mut().for_each(|s| s.time -= 0.008);
    late.samples.retain(|s: &Sample| s.time >= 0.0);
    warned(&fit(&scene, &late, &unknowns), "are autocorrelated");
    // Ten edges and exact data: the mesh is what is wrong.
    let mut coarse = scene.clone();
    coarse.supports.clamp = Clamp::Nodes;
    let report = fit(&coarse, &data, &unknowns);
    warned(&report, "the discretization error may be");
    assert_eq!(report.grade, Grade::RefineNumerics, "{report}");
}

/// What a mesh leaves of the data is said to be the mesh's before anything else is suspected; what
/// the scene lacks is not.
#[test]
fn the_mesh_is_blamed_before_the_model() {
    let coarse = small(1.0);
    let mut fine = coarse.clone();
    fine.rod.segments = Some(60);
    let data = noisy(&observe(&fine, 100), 1e-4, 6);
    let unknowns = [Parameter::YoungsModulus, Parameter::DampingMass];
    let report = fit(&coarse, &data, &unknowns);
    assert!(report.warnings[0].contains("before searching for a missing effect"), "{report}");
    assert!(report.warnings.iter().any(|w| w.contains("are autocorrelated")), "{report}");
    assert_eq!(report.grade, Grade::RefineNumerics, "{report}");
    // Damping that goes with the strain rates, on a mesh that is good enough for the rest.
    fine.time = Some(Time::new(1.0, 5e-4));
    let mut stiff = fine.clone();
    stiff.loads.damping.mass = 0.0;
    stiff.loads.damping.stiffness = 2e-2;
    let data = noisy(&observe(&stiff, 100), 1e-4, 6);
    let report = fit(&fine, &data, &unknowns);
    assert_eq!(report.grade, Grade::ModelDoesNotExplain, "{report}");
    assert!(report.verdict.contains("not noise"), "{report}");
}

/// Every coordinate is tested with its own residuals, also where some are missing.
#[test]
fn residuals_are_tested_where_they_belong() {
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
    assert!(y.trend < 1e-6 || y.whiteness < 1e-6, "{y:?}");
}

/// Much noise is not a wrong model.
#[test]
fn noise_is_no_objection() {
    let mut scene = small(1.0);
    scene.rod.segments = Some(20);
    let data = noisy(&observe(&scene, 100), 1.2e-2, 2);
    let report = fit(&scene, &data, &[Parameter::YoungsModulus]);
    assert!(report.residual_rms > 0.1 * 7e-2 && report.warnings.is_empty(), "{report}");
    assert!(report.simulations < 20.0, "{report}");
}
