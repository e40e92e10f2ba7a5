//! Score tests of omitted effects: false-alarm rate, power and ranks; undetected biases equal those of fits.

use rodfit::fit::{Analysis, FitFile, Frequencies, ScoreTest};
use rodfit::scene::{
    Along, BendingLaw, Compliance, Drag, Friction, Material, Maxwell, PointMass, Scene, Section,
    Shape,
};
use rodfit::vibration::LinearizationPoint;
use rodfit::{Code, Fit, FitReport, Parameter, Point};

use crate::common::coarse;
use crate::common::fits::{
    fit_with, noisy, observe, of_a_right_mesh, same_mesh, write_scene_and_record,
};
use crate::noise::kinds::Noise;

const SIGMA: f64 = 5e-4;

/// A lightly damped oscillation.
fn scene() -> Scene {
    let mut scene = coarse(12, 4e-3, 1.2);
    scene.loads.damping.mass = 0.5;
    scene
}

/// Fit of `model` to noisy data of `truth`.
fn fit_of(truth: &Scene, model: &Scene, seed: u64) -> FitReport {
    let data = noisy(&observe(truth, 120), SIGMA, seed).sigma(SIGMA);
    fit_with(model, &data, &[Parameter::YoungsModulus, Parameter::DampingMass], of_a_right_mesh())
}

/// Path of an effect, and a function that adds a size of it to a scene.
type Case = (&'static str, fn(&mut Scene, f64));

/// Number of significant tests in 60 fits of a right model. At the rate of 5 % at most 3 are expected;
/// three standard deviations more are 8.
fn alarms(fit: impl Fn(u64) -> FitReport, p_value: impl Fn(&ScoreTest) -> f64) -> usize {
    let alarms = (0..60).filter(|seed| {
        let report = fit(*seed);
        let alarm = report.score_tests.iter().any(|test| p_value(test) < 0.05);
        if alarm {
            println!("{seed}: {}", report.score_tests[0]);
        }
        alarm
    });
    let alarms = alarms.count();
    println!("{alarms} of 60");
    alarms
}

/// Bonferroni: of fits of a right model 5 % have any significant test.
#[test]
fn right_model_has_five_percent_of_significant_tests() {
    assert!(alarms(|seed| fit_of(&scene(), &scene(), 500 + seed), |test| test.p_value) <= 8);
}

/// The p-value with the AR(1) correlation has the false-alarm rate of 5 % too.
#[test]
fn autocorrelated_noise_keeps_the_false_alarm_rate() {
    let clean = observe(&scene(), 300);
    let unknowns = [Parameter::YoungsModulus, Parameter::DampingMass];
    let of_seed = |seed: u64| {
        let mut data = clean.clone();
        Noise::Correlated(0.8).add(&mut data, SIGMA, 0, 900 + seed);
        fit_with(&scene(), &data, &unknowns, of_a_right_mesh())
    };
    let allowed = |test: &ScoreTest| test.p_value.max(test.p_value_if_correlated.unwrap_or(0.0));
    assert!(alarms(of_seed, allowed) <= 8);
}

/// A tip mass that the model omits lowers Young's modulus. The bias by the score test is that of the fit, with its sign.
#[test]
fn relative_bias_of_an_omitted_mass_is_that_of_the_estimate() {
    let mut truth = scene();
    // 2 % of the mass of the rod.
    truth.rod.mass = vec![PointMass::new(Point::Tip, 1e-3)];
    let report = fit_of(&truth, &scene(), 3);
    let error = report.estimate(Parameter::YoungsModulus).unwrap().value.unwrap()
        / truth.material.youngs_modulus
        - 1.0;
    let test = report.score_tests.iter().find(|t| t.source == "rod.mass.0.mass").unwrap();
    println!("{test}: bias {:?} of {}, error {error}", test.relative_bias, test.biased_parameter);
    assert_eq!(test.biased_parameter, "youngs_modulus");
    assert!(error < -0.02, "{error}");
    // The score test is linear, and its estimate of the mass has an error of noise.
    assert!((test.relative_bias.unwrap() / error - 1.0).abs() < 0.2, "{:?}", test.relative_bias);
}

/// The text of missing friction has the yield curvature of the test.
#[test]
fn missing_friction_is_found_with_its_yield_curvature() {
    let mut truth = scene();
    truth.loads.damping.friction = Some(Friction { stiffness: 0.03, curvature: 0.15 });
    let report = fit_of(&truth, &scene(), 1);
    println!("{report}");
    let test = report.score_tests.iter().find(|t| t.source == "loads.damping.friction.stiffness");
    let test = test.unwrap_or_else(|| panic!("{report}"));
    assert!(test.is_significant() && test.effect.contains("yield curvature"), "{report}");
}

/// A bending moment that is not linear in the curvature, and a second relaxation time beside a list of one branch, are found
/// by their own tests. A model with the effect, and one with a single table, have no such test.
#[test]
fn missing_parts_of_the_material_law_are_found() {
    let law = "material.bending_law.coefficient";
    let mut truth = scene();
    truth.material.bending_law = Some(BendingLaw::Cubic { coefficient: 5e-3 });
    let of = |report: &FitReport, source: &str| {
        report.score_tests.iter().find(|test| test.source == source).cloned()
    };
    let test = of(&fit_of(&truth, &scene(), 1), law).unwrap();
    println!("{test}");
    assert!(test.is_significant(), "{test}");
    assert!(of(&fit_of(&truth, &truth, 1), law).is_none());

    let branch = "loads.damping.maxwell.1.stiffness";
    let (fast, slow) =
        (Maxwell { stiffness: 0.1, time: 0.03 }, Maxwell { stiffness: 0.1, time: 0.3 });
    let with = |maxwell| {
        let mut scene = scene();
        scene.loads.damping.maxwell = maxwell;
        scene
    };
    let truth = with(vec![fast, slow].into());
    let test = of(&fit_of(&truth, &with(vec![fast].into()), 1), branch).unwrap();
    println!("{test}");
    assert!(test.is_significant(), "{test}");
    assert!(of(&fit_of(&truth, &truth, 1), branch).is_none());
    assert!(of(&fit_of(&truth, &with(fast.into()), 1), branch).is_none());
}

/// A clamp with rotational compliance and nonlinear bending exclude each other in a scene: where one is identified, the
/// other is not tested, and all other effects are.
#[test]
fn identified_effect_does_not_prevent_the_tests_of_others() {
    let mut with_law = scene();
    with_law.material.bending_law = Some(BendingLaw::Cubic { coefficient: 5e-3 });
    let identified = [
        (with_law, "material.bending_law.coefficient", "supports.start_compliance.rotation"),
        (scene(), "supports.start_compliance.rotation", "material.bending_law.coefficient"),
    ];
    for (model, number, other) in identified {
        let mut truth = model.clone();
        // 1 % of the mass of the rod.
        truth.rod.mass = vec![PointMass::new(Point::Tip, 5e-4)];
        let data = noisy(&observe(&truth, 120), SIGMA, 5).sigma(SIGMA);
        let unknowns = [Parameter::YoungsModulus, number.parse().unwrap()];
        let report = fit_with(&model, &data, &unknowns, of_a_right_mesh());
        assert!(!report.warning_codes.contains(&Code::NoSensitivityAnalysis), "{report}");
        assert!(!report.score_tests.is_empty() && !report.undetected_bias.is_empty(), "{report}");
        assert!(report.undetected_bias.iter().all(|bias| bias.source != other), "{report}");
    }
}

/// Plausible sizes of the fit file scale the undetected biases; unknown effects are rejected by name.
#[test]
fn plausible_sizes_of_the_fit_file_are_used() {
    let mut scene = coarse(20, 2e-3, 0.25);
    scene.material.youngs_modulus = 1e9;
    let folder = tempfile::tempdir().unwrap();
    let data = noisy(&observe(&scene, 30), 1e-3, 1);
    write_scene_and_record(folder.path(), &scene, &data);
    let solved = |plausible: &str| {
        let text = format!(
            "scene = \"scene.toml\"\nobservation = [{{ file = \"tip.csv\", sigma = 1e-3 }}]\n\
             parameter = [{{ name = \"youngs_modulus\" }}]\n\
             [analysis]\ndiscretization_error = \"none\"\nwhat_if = true\n{plausible}"
        );
        FitFile::from_toml(&text, folder.path())?.fit().solve()
    };
    let mass = |report: FitReport| {
        report.undetected_bias.into_iter().find(|h| h.source == "rod.mass.0.mass").unwrap()
    };
    let usual = mass(solved("").unwrap());
    let words = format!("plausible = {{ \"rod.mass.0.mass\" = {:e} }}", 0.5 * usual.plausible_size);
    let smaller = mass(solved(&words).unwrap());
    // Half the plausible size was stated.
    assert!(
        (smaller.plausible_size / usual.plausible_size - 0.5).abs() < 1e-12,
        "{usual:?} {smaller:?}"
    );
    assert!(smaller.size < usual.size && smaller.change.abs() < usual.change.abs(), "{smaller:?}");
    for (words, expected) in [
        ("plausible = { \"rod.mass\" = 1.0 }", "rod.mass.0.mass"),
        ("plausible = { \"supports.angle\" = -1.0 }", "-1"),
    ] {
        let error = solved(words).unwrap_err().to_string();
        assert!(error.contains("analysis.plausible") && error.contains(expected), "{error}");
    }
}

type Change = fn(&mut Scene);

/// Of nine effects with three seeds each nine of ten are significant and in the first two ranks.
#[test]
fn omitted_effects_are_in_the_first_two_ranks() {
    let wrong: [(&str, Change); 9] = [
        ("supports.angle", |s| s.supports.angle = 2e-3),
        ("camera.time_offset", |s| s.camera.time_offset = 1e-3),
        ("camera.pixel_scale", |s| s.camera.pixel_scale = 1.001),
        ("camera.time_scale", |s| s.camera.time_scale = 1.002),
        ("loads.drag.quadratic_normal", |s| {
            s.loads.drag = Some(Drag { quadratic_normal: 0.03, ..Drag::default() });
        }),
        ("loads.damping.stiffness", |s| s.loads.damping.stiffness = 4e-4),
        ("rod.shape.angle", |s| s.rod.shape = Shape::Arc { length: 0.5, angle: 6e-3 }),
        ("rod.taper.radius.to", |s| s.rod.taper.radius = Some(Along::linear(1.0, 0.985))),
        ("rod.mass.0.mass", |s| s.rod.mass = vec![PointMass::new(Point::Tip, 2e-4)]),
    ];
    let (mut found, mut all) = (0, 0);
    for (place, change) in wrong {
        let mut truth = scene();
        change(&mut truth);
        for seed in 0..3 {
            let data = {
                let mut recorded = truth.clone();
                // The camera is part of the model, not of the simulated record.
                let camera = std::mem::take(&mut recorded.camera);
                let mut data = noisy(&observe(&recorded, 120), SIGMA, seed).sigma(SIGMA);
                for sample in &mut data.samples {
                    sample.time = camera.time_scale * sample.time + camera.time_offset;
                    sample.position[0] = sample.position[0].map(|x| camera.pixel_scale * x);
                    sample.position[1] = sample.position[1].map(|y| camera.pixel_scale * y);
                }
                data.samples.retain(|sample| sample.time < 1.2);
                data
            };
            let unknowns = [Parameter::YoungsModulus, Parameter::DampingMass];
            let report = fit_with(&scene(), &data, &unknowns, of_a_right_mesh());
            let best = report.score_tests.iter().filter(|test| test.rank <= 2);
            let named = best.map(|test| &test.source).any(|source| source == place);
            all += 1;
            found += usize::from(named && report.score_tests[0].is_significant());
            let all: Vec<String> = report.score_tests.iter().map(|t| t.to_string()).collect();
            println!("{place}, {seed}: {named}; {all:?}");
        }
    }
    assert!(10 * found >= 9 * all, "{found} of {all}");
}

/// Biases by a compliant clamp and a tip mass against fits of simulated records with these effects.
#[test]
fn undetected_biases_equal_those_of_fits() {
    let mut scene = coarse(20, 2e-3, 0.25);
    scene.material.youngs_modulus = 1e9;
    let clean = observe(&scene, 30);
    let report = fit_with(
        &scene,
        &noisy(&clean, 1e-3, 1).sigma(1e-3),
        &[Parameter::YoungsModulus],
        Analysis { sensitivity_analysis: Some(true), ..Analysis::default() },
    );
    println!("{report}");
    let cases: [Case; 2] = [
        ("supports.start_compliance.rotation", |s, size| {
            s.supports.start_compliance = Compliance { rotation: size, axial: 0.0 };
        }),
        ("rod.mass.0.mass", |s, size| s.rod.mass = vec![PointMass::new(Point::Tip, size)]),
    ];
    for (place, change) in cases {
        let hidden = report.undetected_bias.iter().find(|hidden| hidden.source == place).unwrap();
        let mut truth = scene.clone();
        change(&mut truth, hidden.size);
        let data = observe(&truth, 30).sigma(1e-3);
        let biased = fit_with(&scene, &data, &[Parameter::YoungsModulus], same_mesh());
        let off = biased.parameters[0].value.unwrap() / 1e9 - 1.0;
        println!("{place}: {off}, listed {:?}", hidden.relative);
        // The listed bias is linear in the size: 20 % for its curvature.
        assert!((off / hidden.relative.unwrap() - 1.0).abs() < 0.2, "{place}: {off}, {hidden:?}");
    }
    assert!(report.to_string().contains("Undetected bias"), "{report}");
}

/// Where the data determine the size of an effect far better than plausibility, they prevail; the bias is that of a fit.
#[test]
fn size_that_the_data_determine_prevails_over_the_plausible_one() {
    let report = fit_of(&scene(), &scene(), 1);
    let modulus = report.parameters[0].name.to_string();
    let mut found = report.undetected_bias.iter().filter(|hidden| hidden.parameter == modulus);
    let hidden = found.find(|hidden| hidden.source == "supports.angle").unwrap();
    println!("{hidden:?}");
    let (estimate, error) = (hidden.estimate.unwrap(), hidden.estimate_std_error.unwrap());
    // The data determine the tilt ten times better than its plausible size.
    assert!(error < 0.1 * hidden.plausible_size, "{hidden:?}");
    // The limit of the absolute value is between 1.6 and 2 standard errors beyond the estimate.
    let beyond = (hidden.size.abs() - estimate.abs()) / error;
    assert!((1.5..2.1).contains(&beyond), "{hidden:?}");
    let mut truth = scene();
    truth.supports.angle = hidden.size;
    let modulus = |truth: &Scene| {
        let unknowns = [Parameter::YoungsModulus, Parameter::DampingMass];
        let data = observe(truth, 120).sigma(SIGMA);
        fit_with(&scene(), &data, &unknowns, same_mesh()).parameters[0].value.unwrap()
    };
    let off = modulus(&truth) - modulus(&scene());
    // The listed bias is linear in the size: 20 % for its curvature.
    assert!((off / hidden.change - 1.0).abs() < 0.2, "{off} {hidden:?}");
}

/// Gravity of a tenth less, as by buoyancy, and gravity along another direction are significant and listed. The latter
/// resembles another stiffness beside the clamp.
#[test]
fn different_gravity_is_named() {
    for (place, gravity) in
        [("loads.gravity.y", [0.0, -8.83, 0.0]), ("loads.gravity.x", [0.4, -9.81, 0.0])]
    {
        let mut truth = scene();
        truth.loads.gravity = gravity;
        let data = noisy(&observe(&truth, 120), SIGMA, 5).sigma(SIGMA);
        let unknowns = [Parameter::YoungsModulus, Parameter::DampingMass];
        let report = fit_with(&scene(), &data, &unknowns, of_a_right_mesh());
        let found = report.score_tests.iter().find(|test| test.source == place);
        let found = found.unwrap_or_else(|| panic!("{report}"));
        println!("{found}");
        let axis = if place.ends_with('x') { 0 } else { 1 };
        let size = gravity[axis] - scene().loads.gravity[axis];
        assert!(found.is_significant() && (found.estimate / size - 1.0).abs() < 0.3, "{report}");
    }
}

/// Two natural frequencies of a steel strip in a compliant clamp. The compliance is among the likely causes; a turned
/// clamp and a curved rest shape would have to be of more than 10 rad and are not.
#[test]
fn impossible_angles_are_no_causes() {
    let shape = Shape::Straight { length: 0.3, direction: [1.0, 0.0, 0.0] };
    let section = Section::Rectangle { width: 0.02, height: 0.002, up: [0.0, 1.0, 0.0] };
    let mut truth = Scene::new(20, shape, section, Material::new(7850.0, 2e11));
    truth.loads.gravity = [0.0, -9.8, 0.0];
    let model = truth.problem().unwrap();
    truth.supports.start_compliance.rotation = 0.01;
    let modes = truth.problem().unwrap().modes(2, LinearizationPoint::Equilibrium).unwrap();
    let fit = Fit::new(&model).observe(Frequencies::new(&modes.frequencies_rad_s, 0.2));
    let report = fit.identify(Parameter::YoungsModulus).analyse(of_a_right_mesh()).solve().unwrap();
    let cause = report.score_tests.iter().find(|t| t.source.ends_with("start_compliance.rotation"));
    assert!(cause.is_some_and(|test| test.rank == 1 && test.is_significant()), "{report}");
    let mut angles = report.score_tests.iter().filter(|test| test.unit == "rad");
    assert!(angles.all(|test| test.estimate.abs() < 1.0), "{report}");
}

/// A clamp that is tilted by 0.02 rad is found, and identified by the extended fit.
#[test]
fn fit_is_extended_by_the_effect_that_the_test_finds() {
    let mut truth = scene();
    truth.supports.angle = 0.02;
    let folder = tempfile::tempdir().unwrap();
    let data = noisy(&observe(&truth, 120), SIGMA, 3);
    write_scene_and_record(folder.path(), &scene(), &data);
    let text = "scene = \"scene.toml\"\nobservation = [{ file = \"tip.csv\", sigma = 5e-4 }]\n\
                [[parameter]]\nname = \"youngs_modulus\"\n[[parameter]]\nname = \"damping.mass\"\n";
    let file = FitFile::from_toml(text, folder.path()).unwrap();
    let report = file.fit().analyse(of_a_right_mesh()).solve().unwrap();
    println!("{report}");
    assert_eq!(report.score_tests[0].source, "supports.angle", "{report}");
    assert!(report.warnings.iter().any(|w| w.contains("tilted clamp")), "{report}");
    let extended = file.extended(&report).unwrap().unwrap();
    let report = extended.fit().analyse(of_a_right_mesh()).solve().unwrap();
    println!("{report}");
    let angle = report.parameters[2].value.unwrap();
    // The tilt of the simulation, 0.02 rad.
    assert!((angle / 0.02 - 1.0).abs() < 0.1 && report.is_success(), "{report}");
    assert!(extended.extended(&report).unwrap().is_none(), "{report}");
}
