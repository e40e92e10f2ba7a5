//! Parameters that are not identifiable are reported; wrong setups get errors before the search, or warnings.

use rodfit::fit::{FitReport, Sample};
use rodfit::scene::{End, Motion, Section, Shape, Support};
use rodfit::{Fit, Observation, Parameter, Point, Unknown};

use crate::common::fits::{fit, observe, value};
use crate::common::{coarse, simulate};
use crate::planar::small;

/// Halved steps make the misfit a discontinuous function of the modulus. A fit with residuals above the noise has a
/// warning with a recommended action, which removes the warning.
#[test]
fn discontinuous_misfit_is_a_warning() {
    let rod = |step: f64, damping: f64| {
        let mut scene = coarse(20, step, 2.4);
        scene.rod.shape = Shape::Straight { length: 0.12, direction: [1.0, 0.0, 0.0] };
        scene.rod.section = Section::Circle { radius: 1.2e-3 };
        scene.material.youngs_modulus = 2.9e7;
        scene.loads.damping.mass = damping;
        scene
    };
    let warned = |step: f64| {
        // What the model misses.
        let data = observe(&rod(step, 0.3), 200);
        let scene = rod(step, 0.32);
        let run = simulate(&scene);
        let halved = run.work().steps > run.times().len() - 1;
        let report = fit(&scene, &data, &[Parameter::YoungsModulus]);
        assert!(!report.warnings.is_empty(), "{report}");
        (halved, report.warnings.iter().any(|w| w.contains("halved some time steps")))
    };
    // Steps of 8 ms are halved in the simulation, those of 1 ms are not.
    assert_eq!(warned(8e-3), (true, true));
    assert_eq!(warned(1e-3), (false, false));
}

/// Requires an unsuccessful fit whose status has all words.
fn refusal(report: &FitReport, words: &[&str]) {
    assert!(!report.is_success());
    for word in words {
        assert!(report.status.contains(word), "`{word}` in: {}", report.status);
    }
    for estimate in report.parameters.iter().filter(|e| !e.identifiable) {
        assert!(
            estimate.value.is_none()
                && estimate.std_error.is_none()
                && estimate.interval95.is_none()
        );
    }
}

#[test]
fn modulus_and_density_under_gravity_are_not_identifiable() {
    let scene = small(1.0);
    let data = observe(&scene, 100);
    let report = fit(&scene, &data, &[Parameter::YoungsModulus, Parameter::Density]);
    refusal(&report, &["not identifiable", "youngs_modulus/density"]);
    assert!(report.parameters.iter().all(|e| !e.identifiable));
    // With damping, whose rate is identified all the same.
    let mut scene = scene;
    scene.loads.damping.mass = 0.8;
    let data = observe(&scene, 100);
    let report =
        fit(&scene, &data, &[Parameter::YoungsModulus, Parameter::DampingMass, Parameter::Density]);
    refusal(&report, &["youngs_modulus/density"]);
    let damping = report.estimate(Parameter::DampingMass).unwrap();
    // The damping of the simulation, 0.8 1/s.
    assert!((damping.value.unwrap() / 0.8 - 1.0).abs() < 1e-6, "{report}");
}

#[test]
fn parameter_without_effect_is_not_identifiable() {
    // Poisson's ratio does not enter a planar scene.
    let mut scene = small(1.0);
    scene.material.poisson_ratio = Some(0.4);
    let data = observe(&scene, 50);
    refusal(&fit(&scene, &data, &[Parameter::PoissonRatio]), &["poisson_ratio has no effect"]);
    // Nor does anything in a rod at rest without load.
    scene.loads.gravity = [0.0; 3];
    let data = observe(&scene, 50);
    refusal(&fit(&scene, &data, &[Parameter::YoungsModulus]), &["youngs_modulus has no effect"]);
}

/// The residuals of a wrong model are never consistent with noise.
#[test]
fn unexplained_motion_is_a_warning() {
    let scene = small(1.0);
    let mut data = observe(&scene, 100);
    for sample in &mut data.samples {
        sample.position[1] = sample.position[1].map(|y| -y);
    }
    let report = fit(&scene, &data, &[Parameter::YoungsModulus]);
    assert!(report.warnings.iter().any(|w| w.contains("of the observed motion")), "{report}");
    let mut data = observe(&scene, 100).sigma(1e-5);
    for (k, sample) in data.samples.iter_mut().enumerate() {
        sample.position[1] = sample.position[1].map(|y| y + 1e-3 * (k as f64).sin());
    }
    let report = fit(&scene, &data, &[Parameter::YoungsModulus]);
    assert!(report.warnings.iter().any(|w| w.contains("times the stated sigma")), "{report}");
}

#[test]
fn estimate_at_a_bound_is_a_warning() {
    let scene = small(1.0);
    let data = observe(&scene, 100);
    let bounded = Unknown::new(Parameter::YoungsModulus).bounds(1.2e8, 1e10);
    let report = fit(&scene, &data, &[bounded]);
    // The truth is 1e8 Pa, below the lower bound.
    assert!((value(&report, Parameter::YoungsModulus) / 1.2e8 - 1.0).abs() < 1e-12, "{report}");
    assert!(report.warnings.iter().any(|w| w.contains("bound")), "{report}");
}

/// The most common errors of a setup are reported before the search.
#[test]
fn wrong_set_ups_are_rejected_before_the_search() {
    let scene = small(1.0);
    let exact = observe(&scene, 200);
    let mut random = 1_u32;
    let mut noise = || {
        random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        2e-4 * (f64::from(random >> 8) / f64::from(1 << 23) - 1.0)
    };
    let mut changed = |change: &dyn Fn(f64, [f64; 2], [f64; 2]) -> (f64, [f64; 2])| {
        let mut data = exact.clone();
        for s in &mut data.samples {
            let [x, y] = [0, 1].map(|c| s.position[c].unwrap());
            let (time, [x, y]) = change(s.time, [x, y], [noise(), noise()]);
            *s = Sample { time, position: [Some(x), Some(y), None] };
        }
        data.samples.retain(|s| s.time <= 1.0);
        data
    };
    let cases: Vec<(Observation, &[&str])> = vec![
        (changed(&|t, [x, y], _| (t, [x + 0.5, y - 0.3])), &["starts 0.58", "origin"]),
        (changed(&|t, [x, y], _| (t, [0.2 * x + 0.4, 0.2 * y + 0.3])), &["origin"]),
        (changed(&|t, [x, y], _| (t, [0.45 * x, 0.45 * y])), &["the scale is wrong"]),
        (changed(&|t, [x, y], _| (t, [x, -y])), &["y = \"down\""]),
        (changed(&|t, [x, y], _| (8.0 * t, [x, y])), &["fps"]),
        (changed(&|t, [x, y], _| (0.125 * t, [x, y])), &["fps"]),
        (changed(&|t, _, [x, y]| (t, [0.5 + x, y])), &["nothing moves"]),
        (changed(&|t, _, _| (t, [0.5, 0.0])), &["nothing moves"]),
    ];
    let mut missed = Vec::new();
    for (data, words) in cases {
        let clock = std::time::Instant::now();
        let fit = Fit::new(&scene.problem().unwrap()).observe(data);
        let fit = fit.identify(Parameter::YoungsModulus).identify(Parameter::DampingMass);
        let found = match fit.solve() {
            Ok(report) => {
                assert!(!report.is_success(), "{report}");
                // However little is printed.
                format!("{} {}", report.status, report.verdict)
            }
            Err(error) => {
                println!("{error}");
                assert!(error.is_input(), "{error}");
                error.to_string()
            }
        };
        println!("{:?}", clock.elapsed());
        let whole = words.iter().all(|word| found.contains(word));
        missed.extend((!whole).then(|| format!("{words:?} in: {found}")));
    }
    assert!(missed.is_empty(), "{missed:#?}");
}

/// Inputs of fits that cannot be solved are errors with the key.
#[test]
fn impossible_fits_are_input_errors() {
    let scene = small(1.0);
    let problem = scene.problem().unwrap();
    let data = observe(&scene, 100);
    let base = || Fit::new(&problem).observe(data.clone());
    let late = Observation::new(vec![Sample { time: 1.1, position: [Some(0.0); 3] }; 1]);
    // Six values, three of them of a constant coordinate.
    let level = |k: u8| {
        let time = 0.1 * f64::from(k);
        Sample { time, position: [Some(0.5 - 0.1 * time), Some(0.0), None] }
    };
    let level = Observation::new((1..=3).map(level).collect());
    let cases: Vec<(Fit, &str)> = vec![
        (base(), "parameter: found none"),
        (Fit::new(&problem).identify(Parameter::YoungsModulus), "observation: found none"),
        (
            base().identify(Parameter::YoungsModulus).identify(Parameter::YoungsModulus),
            "each name once",
        ),
        (base().identify(Unknown::new(Parameter::YoungsModulus).start(-1.0)), "parameter[0].start"),
        (base().identify(Unknown::new(Parameter::Beta).start(0.4)), "parameter[0].start"),
        (
            base().identify(Unknown::new(Parameter::YoungsModulus).bounds(2.0, 1.0)),
            "parameter[0].bounds",
        ),
        (
            base().identify(Unknown::new(Parameter::YoungsModulus).start(5.0).bounds(1.0, 2.0)),
            "within the bounds",
        ),
        (Fit::new(&problem).observe(late).identify(Parameter::YoungsModulus), "time.end"),
        (
            base().observe(data.clone().sigma(0.0)).identify(Parameter::YoungsModulus),
            "observation[1].sigma",
        ),
        (
            base()
                .observe(data.clone().at(Point::ArcLength(0.6)))
                .identify(Parameter::YoungsModulus),
            "observation[1].point",
        ),
        (base().identify(Parameter::ShearModulus), "parameter"),
        // Three parameters and a noise cannot be determined by three values.
        (
            Fit::new(&problem)
                .observe(level)
                .identify(Parameter::YoungsModulus)
                .identify(Parameter::Density)
                .identify(Parameter::Radius),
            "observation: found 3 values that are not of a constant coordinate",
        ),
        // Shorter than up to a point that was observed.
        (
            base()
                .observe(data.clone().at(Point::ArcLength(0.3)))
                .identify(Unknown::new("rod.shape.length".parse().unwrap()).start(0.2)),
            "parameter[0].start: found 0.2, for which observation[1].point is not on the rod",
        ),
    ];
    for (fit, words) in cases {
        let error = fit.solve().unwrap_err();
        assert!(error.is_input() && error.to_string().contains(words), "`{words}` in: {error}");
    }
    let mut hinged = scene.clone();
    hinged.supports.start = Support::Pinned;
    let displacement = [0.01, 0.0, 0.0];
    let shakes =
        Motion { frequency: Some(2.0), displacement, end: End::Start, ..Motion::default() };
    hinged.supports.motion.push(shakes);
    let turn = Unknown::new("supports.motion.0.rotation.z".parse().unwrap());
    let fit = Fit::new(&hinged.problem().unwrap()).observe(data.clone()).identify(turn);
    let error = fit.solve().unwrap_err();
    let words = "rotation.z, a rotation of a pinned end";
    assert!(error.is_input() && error.to_string().contains(words), "{error}");
    let mut scene = scene;
    scene.rod.section =
        Section::Custom { area: 1e-4, i1: 1e-9, i2: 1e-9, j: 2e-9, up: [0.0, 1.0, 0.0] };
    let error =
        Fit::new(&scene.problem().unwrap()).observe(data).identify(Parameter::Radius).solve();
    let error = error.unwrap_err().to_string();
    assert!(error.contains("radius") && error.contains("circular section"), "{error}");
}

/// A fit all of whose simulations fail is an error of the computation.
#[test]
fn failing_simulations_are_errors() {
    let mut scene = small(1.0);
    let data = observe(&scene, 40);
    scene.loads.gravity = [0.0, -1e200, 0.0];
    let problem = scene.problem().unwrap();
    let error =
        Fit::new(&problem).observe(data).identify(Parameter::YoungsModulus).solve().unwrap_err();
    assert!(
        !error.is_input() && error.to_string().contains("all trial simulations failed"),
        "{error}"
    );
}
