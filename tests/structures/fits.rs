//! Fits of structures: exact data, derivatives of residuals, coverage of intervals, and a welded rod against one rod.

use crate::derivative_checks::check_jacobian;
use crate::scenes::{joint, rod, rubber_rod, steel, support};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};
use rodfit::fit::{
    Analysis, Experiment, FitFile, Frequencies, Refinement, RestShape, Sample, ShapePoint,
};
use rodfit::scene::structure_point::{ArcLengthOfRod, RodPoint, StructurePoint};
use rodfit::scene::{Material, Scheme, Section, Shape, Time};
use rodfit::{
    Fit, FitReport, Observation, Parameter, Point, Scene, Structure, StructureScene, Unknown,
};

/// Names of the identified numbers: a modulus, Pa, the compliance of a joint, rad/(N m), and a mass, kg.
const NAMES: [&str; 3] =
    ["materials.rubber.youngs_modulus", "joints.0.rotation", "bodies.bob.mass"];
/// Their values in the data.
const TRUTH: [f64; 3] = [2.4e6, 35.0, 3e-3];
/// Their values in the scene of the fit.
const SCENE: [f64; 3] = [1e6, 20.0, 4e-3];
/// Number of recorded times.
const TIMES: usize = 60;
/// Duration of the motion, s.
const END: f64 = 0.3;

/// A mast with an arm that is sprung against it, and a bob at the end of the arm.
fn crane([modulus, compliance, mass]: [f64; 3]) -> StructureScene {
    let text = [
        rubber_rod("mast", "[0, 1, 0]"),
        rubber_rod("arm", "[1, 0, 0]"),
        format!("[[materials]]\nname = \"rubber\"\ndensity = 1100\nyoungs_modulus = {modulus:e}\n"),
        format!(
            "[[bodies]]\nname = \"bob\"\nmass = {mass:e}\ninertia = 2e-7\nposition = [0.15, 0.15, 0]\n"
        ),
        joint("spring", &["mast.end", "arm.start"], &format!("rotation = {compliance:e}")),
        joint("rigid", &["bob", "arm.end"], ""),
        support("mast.start", "clamped"),
        "[loads]\ngravity = [0, -9.81, 0]\ndamping = { mass = 0.5 }\n".into(),
        format!("[time]\nend = {END}\nstep = 5e-3\nscheme = \"generalised-alpha\"\n"),
    ];
    StructureScene::from_toml(&text.concat(), ".").unwrap()
}

/// The observed points: one on each rod, and one beside the bob.
fn places() -> [StructurePoint; 3] {
    [
        StructurePoint::on_rod("mast", RodPoint::ArcLength(ArcLengthOfRod { arc_length: 0.11 })),
        StructurePoint::tip("arm"),
        StructurePoint::on_body("bob", [0.01, -0.02, 0.0]),
    ]
}

/// Recorded motions of points of a structure, m.
fn recordings(scene: &StructureScene, places: &[StructurePoint]) -> Vec<Observation> {
    let structure = Structure::new(scene.clone()).unwrap();
    let mut motion = structure.simulation().unwrap();
    let mut samples = vec![Vec::new(); places.len()];
    for k in 1..=TIMES {
        let time = END * k as f64 / TIMES as f64;
        motion.step_to(time).unwrap();
        for (samples, place) in samples.iter_mut().zip(places) {
            let [x, y, _] = motion.position(place).unwrap();
            samples.push(Sample { time, position: [Some(x), Some(y), None] });
        }
    }
    let pairs = samples.into_iter().zip(places);
    pairs.map(|(samples, place)| Observation::new(samples).of_structure(place.clone())).collect()
}

/// The fit of the three numbers, without estimates of discretization errors.
fn fit_of(scene: StructureScene, observed: Vec<Observation>) -> Fit {
    let experiment = Experiment::of_structure("", scene).unwrap();
    let experiment = observed.into_iter().fold(experiment, Experiment::observe);
    let names = NAMES.iter().map(|name| name.parse::<Parameter>().unwrap());
    names.fold(Fit::of([experiment]), Fit::identify).analyse(Analysis {
        discretization_error: Refinement::None,
        sensitivity_analysis: Some(false),
        ..Analysis::default()
    })
}

/// The value of a parameter in a report.
fn value(report: &FitReport, name: &str) -> f64 {
    report.estimate(name.parse().unwrap()).unwrap().value.unwrap()
}

#[test]
fn exact_data_give_back_modulus_compliance_and_mass() {
    let observed = recordings(&crane(TRUTH), &places()[..2]);
    let report = fit_of(crane(SCENE), observed).solve().unwrap();
    assert!(report.converged, "{report}");
    for (name, truth) in NAMES.iter().zip(TRUTH) {
        let error = value(&report, name) / truth - 1.0;
        assert!(error.abs() < 1e-7, "{name}: {error:e}");
    }
}

/// Residuals of motions, of a shape at rest and of frequencies against central differences of half the step that
/// balances rounding and truncation.
#[test]
fn jacobian_of_residuals_equals_differences() {
    let scene = crane(SCENE);
    let at = |s: f64| ShapePoint::new(Point::ArcLength(s), [Some(0.1), Some(0.1), None]);
    let mut shape = RestShape::new(vec![at(0.05), at(0.12)]).sigma(1e-3);
    shape.data.rod = Some("arm".into());
    let experiment = recordings(&crane(TRUTH), &places())
        .into_iter()
        .fold(Experiment::of_structure("", scene).unwrap(), |experiment, own| {
            experiment.observe(own.sigma(1e-3))
        });
    let experiment = experiment.observe(shape).observe(Frequencies::hz(&[1.0, 5.0], 0.1));
    let extra = ["rods.arm.shape.length", "camera.in_plane_rotation", "rods.mast.section.radius"];
    let names = NAMES.iter().chain(&extra).map(|name| name.parse::<Parameter>().unwrap());
    let residuals = names.fold(Fit::of([experiment]), Fit::identify).residuals().unwrap();
    let values = [SCENE[0], SCENE[1], SCENE[2], 0.15, 0.0, 5e-3];
    let x: Vec<f64> =
        residuals.unknowns().iter().zip(values).map(|(u, value)| u.to_scale(value)).collect();
    check_jacobian(&residuals, &x, 2e-5, 1e-6);
}

/// Number of 95 % intervals with the truth, of all three parameters, in fits of noisy data sets of these seeds.
fn covered(seeds: std::ops::Range<u64>) -> [usize; 3] {
    let exact = recordings(&crane(TRUTH), &places()[..2]);
    let noise = Normal::new(0.0, 2e-4).unwrap();
    let mut counts = [0; 3];
    for seed in seeds {
        let (mut random, mut observed) = (ChaCha8Rng::seed_from_u64(seed), exact.clone());
        for own in &mut observed {
            let positions = own.samples.iter_mut().flat_map(|sample| sample.position.iter_mut());
            positions.flatten().for_each(|x| *x += noise.sample(&mut random));
        }
        let report = fit_of(crane(SCENE), observed).solve().unwrap();
        for (k, (name, truth)) in NAMES.iter().zip(TRUTH).enumerate() {
            let estimate = report.estimate(name.parse().unwrap()).unwrap();
            let [low, high] = estimate.interval95.unwrap();
            counts[k] += usize::from(low < truth && truth < high);
        }
    }
    counts
}

/// Of 20 intervals with 95 % each, 15 or fewer contain the truth with a probability of 3e-4.
#[test]
fn intervals_contain_the_truth_in_most_data_sets() {
    for (name, count) in NAMES.iter().zip(covered(0..20)) {
        assert!(count >= 16, "{name}: {count} of 20");
    }
}

/// Of 200 intervals with 95 % each, 181 to 198 contain the truth with a probability of 99 % (binomial distribution).
#[test]
#[ignore = "takes minutes; the short form runs always"]
fn intervals_have_their_coverage() {
    for (name, count) in NAMES.iter().zip(covered(1000..1200)) {
        println!("{name}: {count} of 200");
        assert!((181..=198).contains(&count), "{name}: {count} of 200");
    }
}

/// A cantilever as one rod, and as two welded pieces: modulus and standard error from the same noisy tip.
#[test]
fn welded_pieces_give_the_modulus_and_the_interval_of_one_rod() {
    let [modulus, density, radius] = crate::scenes::STEEL;
    let shape = Shape::Straight { length: 0.3, direction: [1.0, 0.0, 0.0] };
    let material = Material::new(density, modulus);
    let mut one = Scene::new(40, shape, Section::Circle { radius }, material);
    one.loads.gravity = [0.0, -9.81, 0.0];
    one.time = Some(Time { scheme: Scheme::GeneralisedAlpha, ..Time::new(0.1, 5e-4) });
    let problem = one.problem().unwrap();
    let run = problem.simulate().unwrap();
    let (mut random, noise) = (ChaCha8Rng::seed_from_u64(5), Normal::new(0.0, 2e-5).unwrap());
    let mut sample = |k: u32| {
        let time = 1e-3 * f64::from(k);
        let [x, y, _] = run.at(Point::Tip, time).unwrap().0;
        let mut noisy = |x: f64| Some(x + noise.sample(&mut random));
        Sample { time, position: [noisy(x), noisy(y), None] }
    };
    let samples: Vec<Sample> = (1..=100).map(&mut sample).collect();
    let text = [
        rod("a", 20, 0.15, [1.0, 0.0]),
        rod("b", 20, 0.15, [1.0, 0.0]),
        steel(),
        joint("rigid", &["a.end", "b.start"], ""),
        support("a.start", "clamped"),
        "[loads]\ngravity = [0, -9.81, 0]\n".into(),
        "[time]\nend = 0.1\nstep = 5e-4\nscheme = \"generalised-alpha\"\n".into(),
    ];
    let two = StructureScene::from_toml(&text.concat(), ".").unwrap();
    let analysis = Analysis {
        discretization_error: Refinement::None,
        sensitivity_analysis: Some(false),
        ..Analysis::default()
    };
    let seen = Observation::new(samples);
    let solve = |fit: Fit, name: &str| {
        let unknown = Unknown::new(name.parse().unwrap());
        let report = fit.identify(unknown).analyse(analysis.clone()).solve().unwrap();
        let estimate = report.parameters[0].clone();
        (estimate.value.unwrap(), estimate.std_error.unwrap())
    };
    let alone = solve(Fit::new(&problem).observe(seen.clone()), "youngs_modulus");
    let experiment = Experiment::of_structure("", two).unwrap();
    let seen = seen.of_structure(StructurePoint::tip("b"));
    let welded = solve(Fit::of([experiment.observe(seen)]), "materials.steel.youngs_modulus");
    assert!((welded.0 / alone.0 - 1.0).abs() < 1e-3, "{welded:?} {alone:?}");
    assert!((welded.1 / alone.1 - 1.0).abs() < 1e-2, "{welded:?} {alone:?}");
}

/// The mass of a body is an effect beside those of the rods. An error of 10 % is named by the score test, or its bias
/// is listed.
#[test]
fn mass_of_a_body_is_an_omitted_effect() {
    let observed = recordings(&crane(TRUTH), &places()[..2]);
    let mut random = ChaCha8Rng::seed_from_u64(5);
    let noise = Normal::new(0.0, 3e-4).unwrap();
    let noisy = observed.into_iter().map(|mut own| {
        for x in own.samples.iter_mut().flat_map(|sample| &mut sample.position).flatten() {
            *x += noise.sample(&mut random);
        }
        own.sigma(3e-4)
    });
    let scene = crane([TRUTH[0], TRUTH[1], 1.1 * TRUTH[2]]);
    let experiment = noisy.fold(Experiment::of_structure("", scene).unwrap(), Experiment::observe);
    let fit = Fit::of([experiment]).identify(NAMES[0].parse::<Parameter>().unwrap());
    let analysis = Analysis {
        discretization_error: Refinement::None,
        sensitivity_analysis: Some(true),
        ..Analysis::default()
    };
    let report = fit.analyse(analysis).solve().unwrap();
    println!("{report}");
    assert_ne!(report.grade, rodfit::fit::Grade::Trustworthy, "{report}");
    assert!(report.score_tests.iter().any(|test| test.source == NAMES[2]), "{report}");
}

/// The shipped fit: the data have 2.4e7 Pa, 3 rad/(N m) and 8 g. Its mesh has a quarter of the edges of the data's.
#[test]
fn shipped_fit_finds_the_numbers_of_its_data() {
    let report = FitFile::load("data/crane-fit.toml").unwrap().fit().solve().unwrap();
    let truth = [(NAMES[0], 2.4e7), (NAMES[1], 3.0), (NAMES[2], 8e-3)];
    assert!(report.is_success(), "{report}");
    for ((name, truth), numerics) in truth.into_iter().zip(&report.discretization_error) {
        let estimate = report.estimate(name.parse().unwrap()).unwrap();
        let [low, high] = estimate.interval95.unwrap();
        let slack = numerics.relative.unwrap() * truth;
        assert!(low - slack < truth && truth < high + slack, "{name}: {low:e} to {high:e}");
    }
    // Effects of a structure, and the note on those that are not assessed.
    let has = |source: &str| report.undetected_bias.iter().any(|bias| bias.source == source);
    assert!(has("materials.rubber.density") && has("rods.mast.section.radius"));
    assert!(report.warnings.iter().any(|text| text.contains("[structure-scope]")));
}

/// Errors of fit files have the key, the name that was found, and the names that are allowed.
#[test]
fn errors_name_rod_joint_and_key() {
    let scene = "[scene]\n".to_string() + &inline();
    let message = |observation: &str, parameter: &str| {
        let text = format!(
            "[[observation]]\nduration = 0.1\nfps = 100\nsigma = 1e-3\n{observation}\n\
             [[parameter]]\nname = \"{parameter}\"\n{scene}"
        );
        FitFile::from_toml(&text, ".").unwrap_err().to_string()
    };
    let tip = "point = { rod = \"arm\", at = \"tip\" }";
    let modulus = "materials.rubber.youngs_modulus";
    let cases = [
        (
            message("point = { rod = \"amr\", at = \"tip\" }", modulus),
            "observation[0].point.rod",
            "mast, arm",
        ),
        (message("point = { body = \"bobb\" }", modulus), "observation[0].point.body", "bob"),
        (
            message("point = { rod = \"arm\", at = 99 }", modulus),
            "observation[0].point.at: found node = 99",
            "of the rod arm",
        ),
        (message("point = \"tip\"", modulus), "observation[0].point", "mast, arm"),
        (message("", modulus), "observation[0].point", "mast, arm"),
        (message(tip, "rods.amr.section.radius"), "parameter[0].name", "rods.arm.section.radius"),
        (
            message(tip, "rods.arm.section.radus"),
            "rods.arm.section.radus",
            "rods.arm.section.radius",
        ),
        (message(tip, "joints.7.rotation"), "parameter[0].name", "joints.0.rotation"),
        (message(tip, "youngs_modulus"), "parameter[0].name", "materials.rubber.youngs_modulus"),
    ];
    for (message, key, allowed) in cases {
        assert!(message.contains(key) && message.contains(allowed), "{key}: {message}");
    }
}

/// The text of the crane as the table `scene` of a fit file.
fn inline() -> String {
    let text = toml::to_string(&crane(SCENE)).unwrap();
    let line = |line: &str| match line.strip_prefix("[[").or(line.strip_prefix('[')) {
        Some(rest) if line.starts_with("[[") => format!("[[scene.{rest}"),
        Some(rest) => format!("[scene.{rest}"),
        None => line.to_string(),
    };
    text.lines().map(line).collect::<Vec<_>>().join("\n")
}

/// A frame whose columns are both clamped: the compliance of each is assessed, also of the second one of a rod.
#[test]
fn compliance_of_every_clamped_support_is_assessed() {
    let text = [
        rubber_rod("beam", "[1, 0, 0]"),
        "[[materials]]\nname = \"rubber\"\ndensity = 1100\nyoungs_modulus = 2.4e6\n".into(),
        support("beam.start", "clamped"),
        support("beam.end", "clamped"),
        "[loads]\ngravity = [0, -9.81, 0]\ndamping = { mass = 0.5 }\n".into(),
        format!("[time]\nend = {END}\nstep = 5e-3\nscheme = \"generalised-alpha\"\n"),
    ];
    let scene = StructureScene::from_toml(&text.concat(), ".").unwrap();
    let place = RodPoint::ArcLength(ArcLengthOfRod { arc_length: 0.07 });
    let observed = recordings(&scene, &[StructurePoint::on_rod("beam", place)]);
    let experiment = Experiment::of_structure("", scene).unwrap();
    let experiment = observed.into_iter().fold(experiment, |e, o| e.observe(o.sigma(1e-4)));
    let fit = Fit::of([experiment]).identify(NAMES[0].parse::<Parameter>().unwrap());
    let report = fit.analyse(Analysis {
        discretization_error: Refinement::None,
        sensitivity_analysis: Some(true),
        ..Analysis::default()
    });
    let report = report.solve().unwrap();
    let mut tested: Vec<&str> =
        report.undetected_bias.iter().map(|bias| &bias.source[..]).collect();
    tested.retain(|source| source.starts_with("joints."));
    tested.sort_unstable();
    tested.dedup();
    assert_eq!(tested, ["joints.0.rotation", "joints.1.rotation"], "{report}");
}
