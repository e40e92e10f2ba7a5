//! Several experiments with shared parameters; shapes at rest and frequencies as measurements; priors; validation data.

use rodfit::fit::{Experiment, FitFile, Frequencies, MeasuredData, RestShape, ShapePoint};
use rodfit::scene::{Clamp, Material, Scene, Section, Shape, Support, Time};
use rodfit::vibration::{LinearizationPoint, ModeKind, ModePlane};
use rodfit::{Fit, FitReport, Parameter, Point, Problem, Unknown};

use crate::common::fits::{add_noise, found, noisy, observe, record, same_mesh, value};
use crate::common::{at_tip, cantilever_with, coarse, helix_with};

/// A released cantilever of a given length.
fn rod(length: f64, end: f64) -> Scene {
    let mut scene = coarse(12, 4e-3, end);
    scene.rod.shape = Shape::Straight { length, direction: [1.0, 0.0, 0.0] };
    scene
}

/// Where `count` points of the rod at rest are.
fn droop(problem: &Problem, count: usize) -> RestShape {
    let nodes = problem.equilibrium().unwrap().nodes;
    let seen = |k: usize| {
        let point = Point::ArcLength(problem.length() * k as f64 / count as f64);
        let stencil = problem.stencil(point).unwrap();
        let of = |c: usize| stencil.nodes.iter().map(|(i, w)| w * nodes[*i][c]).sum::<f64>();
        ShapePoint::new(point, [0, 1, 2].map(|c| Some(of(c))))
    };
    RestShape::new((1..=count).map(seen).collect())
}

fn frequencies(problem: &Problem, count: usize) -> Vec<f64> {
    problem.modes(count, LinearizationPoint::Equilibrium).unwrap().frequencies_rad_s
}

/// Requires the true values within 1e-7.
#[track_caller]
fn exact(report: &FitReport, truths: &[(Parameter, f64)]) {
    // Exact data: within the tolerance of the search.
    found(report, truths, 1e-7);
}

/// The droop determines E over the density, a frequency the root of that ratio: both
/// determine the same combination. With the
/// weight of a known body at the tip they determine both parameters.
#[test]
fn droop_and_frequency_give_modulus_and_density() {
    for (name, mut scene) in
        [("cantilever", rod(0.5, 1.0)), ("helix", helix_with(0.5, 2e-3, 1.0, Clamp::MidEdge))]
    {
        scene.time = None;
        let down = if name == "helix" { [0.0, 0.0, -0.01] } else { [0.0, -0.05, 0.0] };
        scene.loads.point = at_tip(down);
        let e = scene.material.youngs_modulus * 1.7;
        let mut true_scene = scene.clone();
        true_scene.material.youngs_modulus = e;
        true_scene.material.density = 900.0;
        let truth = true_scene.problem().unwrap();
        let problem = scene.problem().unwrap();
        let report = Fit::new(&problem)
            .observe(droop(&truth, 20).sigma(1e-4))
            .observe(Frequencies::new(&frequencies(&truth, 1), 0.01))
            .identify(Parameter::YoungsModulus)
            .identify(Parameter::Density)
            .solve()
            .unwrap();
        println!("{name}: {report}");
        // The values with which the data are simulated, without noise.
        exact(&report, &[(Parameter::YoungsModulus, e), (Parameter::Density, 900.0)]);
        // A droop under the rod's own weight alone leaves the two one.
        scene.loads.point.clear();
        true_scene.loads.point.clear();
        let (problem, truth) = (scene.problem().unwrap(), true_scene.problem().unwrap());
        let alone = Fit::new(&problem)
            .observe(droop(&truth, 20).sigma(1e-4))
            .identify(Parameter::YoungsModulus)
            .identify(Parameter::Density)
            .solve()
            .unwrap();
        assert!(!alone.is_success() && alone.status.contains("youngs_modulus/density"), "{alone}");
    }
}

/// The droop of a curved rod at two points gives its natural curvature and its modulus, exactly.
#[test]
fn droop_gives_modulus_and_natural_curvature() {
    let mut scene = rod(0.5, 1.0);
    scene.time = None;
    scene.rod.shape = Shape::Arc { length: 0.5, angle: 1.0 };
    let mut true_scene = scene.clone();
    true_scene.material.youngs_modulus = 3.3e7;
    true_scene.rod.natural_curvature = 0.8.into();
    let report = Fit::new(&scene.problem().unwrap())
        .observe(droop(&true_scene.problem().unwrap(), 20))
        .identify(Parameter::YoungsModulus)
        .identify(Parameter::NaturalCurvature)
        .solve()
        .unwrap();
    println!("{report}");
    // The values with which the data are simulated, without noise.
    exact(&report, &[(Parameter::YoungsModulus, 3.3e7), (Parameter::NaturalCurvature, 0.8)]);
}

/// The droop and two frequencies of a helix give E and G, without a recorded motion.
#[test]
fn helix_at_rest_gives_both_moduli() {
    let mut scene = helix_with(0.5, 2e-3, 1.0, Clamp::MidEdge);
    scene.time = None;
    scene.material.poisson_ratio = None;
    scene.material.shear_modulus = Some(3e6);
    let mut true_scene = scene.clone();
    true_scene.material.youngs_modulus = 2.2e7;
    true_scene.material.shear_modulus = Some(6.1e6);
    let truth = true_scene.problem().unwrap();
    let report = Fit::new(&scene.problem().unwrap())
        .observe(droop(&truth, 25).sigma(1e-4))
        .observe(Frequencies::new(&frequencies(&truth, 2), 0.02))
        .identify(Parameter::YoungsModulus)
        .identify(Parameter::ShearModulus)
        .solve()
        .unwrap();
    println!("{report}");
    // The values with which the data are simulated, without noise.
    exact(&report, &[(Parameter::YoungsModulus, 2.2e7), (Parameter::ShearModulus, 6.1e6)]);
}

/// Two rods of one material with different lengths, each with its own clamp, clock and air. Unknowns of
/// one experiment have its name.
#[test]
fn two_experiments_share_one_modulus() {
    let (long, short) = (rod(0.5, 0.8), rod(0.3, 0.4));
    let e = 2.3e8;
    let film = |scene: &Scene, angle: f64, offset: f64, damping: f64| {
        let mut scene = scene.clone();
        scene.material.youngs_modulus = e;
        scene.supports.angle = angle;
        scene.loads.damping.mass = damping;
        let mut seen = observe(&scene, 100);
        seen.samples.iter_mut().for_each(|s| s.time += offset);
        seen
    };
    let mut damped = [long.clone(), short.clone()];
    damped.iter_mut().for_each(|scene| scene.loads.damping.mass = 0.3);
    let [a, b] = damped.map(|scene| scene.problem().unwrap());
    let fit = Fit::of([
        Experiment::new("long", &a).observe(film(&long, 0.02, 0.01, 0.7)),
        Experiment::new("short", &b).observe(film(&short, -0.03, 0.02, 0.7)),
    ]);
    let report = fit
        .clone()
        .identify(Parameter::YoungsModulus)
        .identify(Parameter::DampingMass)
        .identify(Unknown::new(Parameter::ClampAngle).of_experiment("long"))
        .identify(Unknown::new(Parameter::ClampAngle).of_experiment("short"))
        .identify(Unknown::new(Parameter::TimeOffset).of_experiment("long"))
        .identify(Unknown::new(Parameter::TimeOffset).of_experiment("short"))
        .solve()
        .unwrap();
    println!("{report}");
    // The values with which the data are simulated, without noise.
    exact(&report, &[(Parameter::YoungsModulus, e), (Parameter::DampingMass, 0.7)]);
    for (k, truth) in [(2, 0.02), (3, -0.03), (4, 0.01), (5, 0.02)] {
        let found = report.parameters[k].value.unwrap();
        // Clamp angles, rad, and clock offsets, s, of both experiments.
        assert!((found - truth).abs() < 1e-8, "{}: {found}", report.parameters[k].label());
    }
    let both = [
        fit.clone()
            .identify(Parameter::ClampAngle)
            .identify(Unknown::new(Parameter::ClampAngle).of_experiment("long")),
        fit.clone().identify(Unknown::new(Parameter::ClampAngle).of_experiment("other")),
        Fit::of([Experiment::new("a", &a), Experiment::new("a", &b)])
            .identify(Parameter::YoungsModulus),
    ];
    for (fit, words) in both.iter().zip(["parameter[1].name", "experiment", "observation"]) {
        let error = fit.solve().unwrap_err().to_string();
        assert!(error.contains(words), "{error}");
    }
}

/// The fit of two experiments equals the fit of the sum of their normal equations.
#[test]
fn information_of_experiments_is_additive() {
    let scenes = [rod(0.5, 0.5), rod(0.35, 0.4)];
    let problems = scenes.map(|scene| scene.problem().unwrap());
    let data = |k: usize| {
        noisy(&record(&problems[k].simulate().unwrap(), 40), 1e-3, 5 + k as u64).sigma(1e-3)
    };
    let sd = |report: &FitReport| {
        let estimate = report.estimate(Parameter::YoungsModulus).unwrap();
        estimate.std_error.unwrap() / estimate.value.unwrap()
    };
    let alone = [0, 1].map(|k| {
        sd(&Fit::new(&problems[k])
            .observe(data(k))
            .identify(Parameter::YoungsModulus)
            .solve()
            .unwrap())
    });
    let experiments = [0, 1].map(|k| Experiment::new(["a", "b"][k], &problems[k]).observe(data(k)));
    let together = sd(&Fit::of(experiments).identify(Parameter::YoungsModulus).solve().unwrap());
    let expected = (alone[0].powi(-2) + alone[1].powi(-2)).powf(-0.5);
    // The errors are those at slightly different optima.
    assert!((together / expected - 1.0).abs() < 0.05, "{alone:?} {together}");
}

/// The motion determines only the ratio of E and density. A prior of the density makes E identifiable; the relative
/// error of E contains that of the prior.
#[test]
fn prior_error_propagates_to_the_estimate() {
    let scene = rod(0.5, 0.5);
    let problem = scene.problem().unwrap();
    let data = noisy(&observe(&scene, 60), 1e-3, 3).sigma(1e-3);
    let density = Unknown::new(Parameter::Density).prior(1300.0, 26.0);
    let fit = |unknowns: Vec<Unknown>| {
        let fit = Fit::new(&problem).observe(data.clone());
        unknowns.into_iter().fold(fit, |fit, unknown| fit.identify(unknown)).solve().unwrap()
    };
    let alone = fit(vec![Parameter::YoungsModulus.into()]);
    let with_prior = fit(vec![Parameter::YoungsModulus.into(), density.clone()]);
    println!("{with_prior}");
    assert!(with_prior.is_success());
    let relative = |report: &FitReport, p| {
        let e = report.estimate(p).unwrap();
        e.std_error.unwrap() / e.value.unwrap()
    };
    let expected = (relative(&alone, Parameter::YoungsModulus).powi(2) + 0.02_f64.powi(2)).sqrt();
    // Relative errors add in quadrature: that of E at known density, and 2 % of the density's prior.
    assert!((relative(&with_prior, Parameter::YoungsModulus) / expected - 1.0).abs() < 2e-3);
    // The data do not determine the density: its error is that of the prior.
    assert!((relative(&with_prior, Parameter::Density) / 0.02 - 1.0).abs() < 2e-3);
    // The optimiser ends a thousandth of a standard deviation from the minimum.
    assert!((value(&with_prior, Parameter::Density) / 1300.0 - 1.0).abs() < 2e-5);
    // E moves along with the density that the prior prefers.
    let ratio =
        value(&with_prior, Parameter::YoungsModulus) / value(&alone, Parameter::YoungsModulus);
    assert!((ratio / (1300.0 / 1273.52) - 1.0).abs() < 2e-5);
    // Data that say otherwise.
    let wrong = fit(vec![Unknown::new(Parameter::YoungsModulus).prior(2e8, 1e6)]);
    assert!(wrong.warnings.iter().any(|w| w.contains("contradict")), "{wrong}");
    let bad = Fit::new(&problem)
        .observe(data)
        .identify(Unknown::new(Parameter::Density).prior(-1.0, 1.0));
    assert!(bad.solve().unwrap_err().to_string().contains("prior.mean"));
}

/// Validation data do not change the estimate. The right model predicts them, a wrong one does not.
#[test]
fn held_out_data_are_predicted() {
    let mut scene = rod(0.5, 0.6);
    scene.loads.damping.mass = 0.8;
    let problem = scene.problem().unwrap();
    let run = problem.simulate().unwrap();
    let tip = noisy(&record(&run, 60), 1e-3, 1);
    let mut middle = record(&run, 60).at(Point::ArcLength(0.3));
    for sample in &mut middle.data.samples {
        let (x, _) = run.at(middle.data.point, sample.time).unwrap();
        sample.position = [Some(x[0]), Some(x[1]), None];
    }
    add_noise(&mut middle, 1e-3, 2);
    let shape = droop(&problem, 10).sigma(1e-4).held_out();
    let fit = |scene: &Scene| {
        Fit::new(&scene.problem().unwrap())
            .analyse(same_mesh())
            .observe(tip.clone())
            .observe(middle.clone().sigma(1e-3).held_out())
            .observe(shape.clone())
            .identify(Parameter::YoungsModulus)
            .solve()
            .unwrap()
    };
    let right = fit(&scene);
    println!("{right}");
    // The third coordinate of the shape is a filler.
    let codes: Vec<&str> = right.warning_codes.iter().map(|code| code.name()).collect();
    assert!(right.is_success() && codes == ["constant-axis"], "{right}");
    assert_eq!(right.predictions.len(), 2);
    assert!(right.predictions[0].rms < 1.2 * right.predictions[0].expected);
    let without =
        Fit::new(&problem).observe(tip.clone()).identify(Parameter::YoungsModulus).solve().unwrap();
    assert_eq!(value(&right, Parameter::YoungsModulus), value(&without, Parameter::YoungsModulus));
    // Without damping no modulus explains the later swings.
    scene.loads.damping.mass = 0.0;
    let wrong = fit(&scene);
    assert!(wrong.warnings.iter().any(|w| w.contains("validation data")), "{wrong}");
}

/// Held-out heights with sigmas of 0.1 mm and 10 mm by turns, each off by its sigma. Both the RMS error and the
/// expected one are the root mean square of these sigmas, m.
#[test]
fn predicted_rms_beside_sigmas_of_values_is_in_meters() {
    let problem = rod(0.5, 0.6).problem().unwrap();
    let sigmas: Vec<f64> =
        (0..10_usize).map(|k| if k.is_multiple_of(2) { 1e-4 } else { 1e-2 }).collect();
    let mut shape = droop(&problem, 10).sigmas(&sigmas).held_out();
    for (sighting, sigma) in shape.data.sightings.iter_mut().zip(&sigmas) {
        sighting.position = [None, sighting.position[1].map(|y| y + sigma), None];
    }
    let report = Fit::new(&problem)
        .analyse(same_mesh())
        .observe(droop(&problem, 10).sigma(1e-4))
        .observe(shape)
        .identify(Parameter::YoungsModulus)
        .solve()
        .unwrap();
    let rms = (0.5 * (1e-4_f64.powi(2) + 1e-2_f64.powi(2))).sqrt();
    let found = &report.predictions[0];
    // The error of the modulus adds less than 1 % of the large sigma.
    assert!((found.rms / rms - 1.0).abs() < 1e-2, "{}", found.rms);
    assert!((found.expected / rms - 1.0).abs() < 1e-2, "{}", found.expected);
    assert!(!report.warning_codes.contains(&rodfit::Code::LargePredictionError), "{report}");
}

/// A scene needs a time table only if a motion was measured.
/// With a given sigma one frequency determines one modulus, with a relative error of 2 sigma/f.
#[test]
fn one_frequency_gives_one_modulus() {
    let mut scene = cantilever_with(0.5, 1e-3, 0.1, Clamp::MidEdge);
    scene.loads.gravity = [0.0; 3];
    let problem = scene.problem().unwrap();
    let first = problem
        .modes(1, rodfit::vibration::LinearizationPoint::Equilibrium)
        .unwrap()
        .frequencies_rad_s[0];
    let sigma = 1e-3 * first;
    let fit = Fit::new(&problem).observe(Frequencies::new(&[first], sigma));
    let report = fit.identify(Parameter::YoungsModulus).solve().unwrap();
    let estimate = &report.parameters[0];
    let (value, error) = (estimate.value.unwrap(), estimate.std_error.unwrap());
    // Exact data: the modulus of the simulation.
    assert!((value / 1e8 - 1.0).abs() < 1e-6, "{report}");
    // `E` is proportional to `f^2`: a relative error of 2 sigma/f, 2e-3.
    assert!((error / value / 2e-3 - 1.0).abs() < 1e-3 && report.is_success(), "{report}");
    assert!(report.discretization_error[0].relative.is_some(), "{report}");
}

#[test]
fn motion_without_time_table_is_rejected() {
    let mut scene = rod(0.5, 0.2);
    let data = observe(&scene, 20);
    scene.time = None;
    let fit = Fit::new(&scene.problem().unwrap()).observe(data).identify(Parameter::YoungsModulus);
    assert!(fit.solve().unwrap_err().to_string().contains("time"));
    scene.time = Some(Time::new(0.2, 4e-3));
    let frequency = |rad_s| Frequencies::new(&[rad_s], 0.1).of_modes(&[0]).unwrap();
    let fit = Fit::new(&scene.problem().unwrap());
    let fit =
        fit.observe(frequency(26.0)).observe(frequency(27.0)).identify(Parameter::YoungsModulus);
    assert!(fit.solve().unwrap_err().to_string().contains("modes[0]"));
}

/// The torsional stiffness of a scene changes neither the frequencies in its plane nor their mode numbers, nor the fit.
#[test]
fn torsion_mode_does_not_change_mode_numbers() {
    let mut scene = rod(0.5, 1.0);
    scene.time = None;
    let mut true_scene = scene.clone();
    true_scene.material.youngs_modulus = 2.2e8;
    let seen = frequencies(&true_scene.problem().unwrap(), 3);
    for poisson_ratio in [None, Some(0.5), Some(0.0)] {
        scene.material.poisson_ratio = poisson_ratio;
        let fit = Fit::new(&scene.problem().unwrap()).observe(Frequencies::new(&seen, 0.01));
        // The modulus of the simulated frequencies.
        exact(
            &fit.identify(Parameter::YoungsModulus).solve().unwrap(),
            &[(Parameter::YoungsModulus, 2.2e8)],
        );
    }
    // Those across the plane are asked for, and are other ones here.
    let flat = Section::Rectangle { width: 0.01, height: 0.006, up: [0.0, 1.0, 0.0] };
    (scene.rod.section, true_scene.rod.section) = (flat.clone(), flat);
    true_scene.material.poisson_ratio = Some(0.0);
    let all =
        true_scene.problem().unwrap().modes(9, LinearizationPoint::Equilibrium).unwrap().modes;
    let own = all.iter().filter(|m| m.plane == Some(ModePlane::Out) && m.kind == ModeKind::Bending);
    let seen: Vec<f64> = own.map(|m| m.frequency_rad_s).take(2).collect();
    let seen = Frequencies::new(&seen, 0.01).plane(ModePlane::Out).of_kind(ModeKind::Bending);
    let fit = Fit::new(&scene.problem().unwrap()).observe(seen).identify(Parameter::YoungsModulus);
    // The modulus of the simulated frequencies.
    exact(&fit.solve().unwrap(), &[(Parameter::YoungsModulus, 2.2e8)]);
}

/// Impulse excitation (ASTM E1876): E from the first bending frequency of a free bar, G from the
/// first torsional one. The frequencies of the theory give both moduli up to the discretization error.
#[test]
fn free_bar_frequencies_give_both_moduli() {
    let shape = Shape::Straight { length: 0.4, direction: [1.0, 0.0, 0.0] };
    let section = Section::Rectangle { width: 0.02, height: 0.004, up: [0.0, 1.0, 0.0] };
    let guess = Material { shear_modulus: Some(1e10), ..Material::new(2700.0, 1e10) };
    let mut scene = Scene::new(60, shape, section, guess);
    scene.supports.start = Support::Free;
    let (e, g) = (69e9, 26e9);
    let mut true_scene = scene.clone();
    true_scene.material.youngs_modulus = e;
    true_scene.material.shear_modulus = Some(g);
    let all =
        true_scene.problem().unwrap().modes(40, LinearizationPoint::Equilibrium).unwrap().modes;
    let first = |kind| {
        let own = all.iter().filter(|m| m.kind == kind && m.number.is_some());
        own.map(|m| m.frequency_rad_s).take(2).collect::<Vec<_>>()
    };
    let problem = scene.problem().unwrap();
    let fit = |bending: &[f64], torsion: &[f64]| {
        Fit::new(&problem)
            .observe(Frequencies::new(bending, 1.0))
            .observe(Frequencies::new(torsion, 1.0).of_kind(ModeKind::Torsion))
            .identify(Parameter::YoungsModulus)
            .identify(Parameter::ShearModulus)
            .solve()
            .unwrap()
    };
    let report = fit(&first(ModeKind::Bending), &first(ModeKind::Torsion));
    exact(&report, &[(Parameter::YoungsModulus, e), (Parameter::ShearModulus, g)]);
    let unit = (e * 0.004_f64.powi(2) / 12.0 / 2700.0).sqrt() / 0.16;
    let report =
        fit(&[4.73004074_f64, 7.85320462].map(|b| b * b * unit), &first(ModeKind::Torsion));
    // Lumped masses: 1.1e-3 at 60 segments.
    assert!((value(&report, Parameter::YoungsModulus) / e - 1.0).abs() < 5e-3, "{report}");
}

/// The keys of `[[frequencies]]`, and the errors for modes that a scene does not have.
#[test]
fn fit_file_frequencies_are_read() {
    let folder = tempfile::TempDir::new().unwrap();
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
    let scene = |more: &str| {
        format!(
            "[rod]\nsegments = 20\nshape = {{ kind = \"straight\", length = 0.4, direction = [1, 0, 0] }}\n\
             section = {{ kind = \"circle\", radius = 0.004 }}\n\
             [material]\ndensity = 2700\nyoungs_modulus = 69e9\n{more}\n\
             [supports]\nstart = \"free\"\n"
        )
    };
    let load = |keys: &str| {
        write(
            "fit.toml",
            &format!(
                "scene = \"scene.toml\"\n[[frequencies]]\nhz = [3000, 6000]\nsigma = 1\n{keys}\n\
                 [[parameter]]\nname = \"youngs_modulus\"\n"
            ),
        );
        FitFile::load(folder.path().join("fit.toml"))
    };
    write("scene.toml", &scene("poisson_ratio = 0.33"));
    let file = load("plane = \"out\"\nkind = \"torsion\"\ndirection = [0, 1, 0]").unwrap();
    let MeasuredData::ModeFrequencies(f) = &file.experiments[0].measurements[0].data else {
        unreachable!()
    };
    assert_eq!((f.among.plane, f.among.kind), (Some(ModePlane::Out), Some(ModeKind::Torsion)));
    assert_eq!(f.among.direction, Some([0.0, 1.0, 0.0]));
    for (keys, words) in [
        ("plane = \"up\"", "in"),
        ("kind = \"swing\"", "torsion"),
        ("plane = \"in\"\nkind = \"torsion\"", "frequencies[0].kind"),
        ("plane = \"out\"\nkind = \"axial\"", "frequencies[0].kind"),
        ("direction = [0, 0, 0]", "frequencies[0].direction"),
    ] {
        let error = load(keys).and_then(|file| file.fit().solve().map(|_| ())).unwrap_err();
        assert!(error.to_string().contains(words), "{keys}: {error}");
    }
    write("scene.toml", &scene(""));
    let solved = |file: FitFile| file.fit().solve().map(|_| ());
    let error = load("kind = \"torsion\"").and_then(solved).unwrap_err().to_string();
    assert!(error.contains("poisson_ratio"), "{error}");
}

/// A prediction lists every parameter that is not fitted once, also if each experiment has its own.
#[test]
fn prediction_names_parameters_of_several_experiments_once() {
    let experiment = |(name, length): (&str, f64)| {
        let problem = rod(length, 0.2).problem().unwrap();
        Experiment::new(name, &problem).observe(droop(&problem, 4).sigma(1e-3))
    };
    let mut fit = Fit::of([("a", 0.5), ("b", 0.4)].map(experiment));
    for name in ["a", "b"] {
        for parameter in [Parameter::YoungsModulus, Parameter::Density] {
            fit = fit.identify(Unknown::new(parameter).of_experiment(name));
        }
    }
    let report = fit.predict().unwrap();
    let words = "youngs_modulus, density are not fitted";
    assert!(report.warnings[0].starts_with(words), "{}", report.warnings[0]);
}
