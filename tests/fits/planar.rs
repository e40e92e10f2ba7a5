//! Identification: exact answers from exact data, honest errors from noisy ones, refusals by name.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};
use rodfit::fit::{Analysis, FitReport, Refinement, Sample};
use rodfit::scene::{
    Clamp, Dimension, End, Handedness, Motion, PointForce, Scene, Scheme, Section, Shape, Time,
};
use rodfit::{Fit, Observation, Parameter, Point, Unknown};

use crate::common::{cantilever_with, record};

/// 25 edges for `end` seconds.
fn small(end: f64) -> Scene {
    let mut scene = cantilever_with(0.5, 2e-3, end, Clamp::MidEdge);
    scene.rod.segments = Some(25);
    scene
}

fn observe(scene: &Scene, count: usize) -> Observation {
    record(&scene.problem().unwrap().simulate().unwrap(), count)
}

fn fit(scene: &Scene, observation: &Observation, unknowns: &[Unknown]) -> FitReport {
    let fit = Fit::new(&scene.problem().unwrap()).observe(observation.clone());
    unknowns.iter().fold(fit, |fit, unknown| fit.identify(unknown.clone())).solve().unwrap()
}

fn value(report: &FitReport, parameter: Parameter) -> f64 {
    report.estimate(parameter).unwrap().value.unwrap_or_else(|| panic!("{report}"))
}

/// 20 moduli over three decades, records of 1 s and 5 s, from no start and from a start anywhere
/// between a hundredth and a hundred times the truth.
#[test]
fn exact_modulus_from_anywhere() {
    let mut random = ChaCha8Rng::seed_from_u64(30);
    let (mut worst, mut work) = (0.0_f64, Vec::new());
    for k in 0..20 {
        let truth = 10f64.powf(7.0 + 3.0 * k as f64 / 19.0);
        for end in [1.0, 5.0] {
            let mut scene = small(end);
            scene.material.youngs_modulus = truth;
            let data = observe(&scene, (100.0 * end) as usize);
            scene.material.youngs_modulus = 1.0;
            let start = truth * 100f64.powf(random.random_range(-1.0..1.0));
            let starts = [truth / 100.0, truth * 100.0, start];
            let unknown = Unknown::new(Parameter::YoungsModulus);
            for unknown in [unknown.clone(), unknown.start(starts[k % 3])] {
                let report = fit(&scene, &data, std::slice::from_ref(&unknown));
                let error = (value(&report, Parameter::YoungsModulus) / truth - 1.0).abs();
                worst = worst.max(error);
                work.push(report.simulations);
                assert!(
                    report.is_success() && error < 1e-8,
                    "{truth:e}, {end} s, {unknown:?}: {report}"
                );
            }
        }
    }
    work.sort_by(f64::total_cmp);
    println!(
        "worst error {worst:.1e}; simulations: median {:.1}, most {:.1}",
        work[work.len() / 2],
        work[work.len() - 1]
    );
}

/// The paper's own walls: the coarse model of the search is much too short there.
#[test]
fn exact_modulus_with_walls_at_nodes() {
    let mut scene = small(3.0);
    scene.supports.clamp = Clamp::Nodes;
    let data = observe(&scene, 300);
    let report = fit(&scene, &data, &[Parameter::YoungsModulus.into()]);
    assert!((value(&report, Parameter::YoungsModulus) / 1e8 - 1.0).abs() < 1e-8, "{report}");
}

#[test]
fn exact_beta_alone_and_with_the_modulus() {
    for truth in [0.5, 0.55, 0.7, 0.9, 1.0] {
        let mut scene = small(2.0);
        scene.time = Some(Time { beta: truth, ..Time::new(2.0, 5e-3) });
        let data = observe(&scene, 200);
        Parameter::Beta.set(&mut scene, 0.62).unwrap();
        let report = fit(&scene, &data, &[Parameter::Beta.into()]);
        assert!((value(&report, Parameter::Beta) - truth).abs() < 1e-6, "{truth}: {report}");
        let report = fit(&scene, &data, &[Parameter::YoungsModulus.into(), Parameter::Beta.into()]);
        assert!((value(&report, Parameter::Beta) - truth).abs() < 1e-6, "{truth}: {report}");
        assert!(
            (value(&report, Parameter::YoungsModulus) / 1e8 - 1.0).abs() < 1e-6,
            "{truth}: {report}"
        );
    }
}

/// A drooping rod, bent at rest by less than its mould.
#[test]
fn exact_natural_curvature_with_the_modulus() {
    for truth in [0.4, 1.0, 1.3] {
        let mut scene = small(1.0);
        scene.rod.shape = Shape::Arc { length: 0.5, angle: 0.8 };
        scene.rod.natural_curvature = truth.into();
        let data = observe(&scene, 100);
        scene.rod.natural_curvature = 0.8.into();
        let report = fit(
            &scene,
            &data,
            &[Parameter::YoungsModulus.into(), Parameter::NaturalCurvature.into()],
        );
        assert!(
            (value(&report, Parameter::NaturalCurvature) / truth - 1.0).abs() < 1e-7,
            "{report}"
        );
        assert!((value(&report, Parameter::YoungsModulus) / 1e8 - 1.0).abs() < 1e-7, "{report}");
    }
}

#[test]
fn exact_dampings_with_the_modulus() {
    let mut scene = small(2.0);
    scene.loads.damping.mass = 0.8;
    scene.loads.damping.stiffness = 2e-3;
    let data = observe(&scene, 200);
    let unknowns = [
        Parameter::YoungsModulus.into(),
        Parameter::DampingMass.into(),
        Parameter::DampingStiffness.into(),
    ];
    let report = fit(&scene, &data, &unknowns);
    for (parameter, truth) in [
        (Parameter::YoungsModulus, 1e8),
        (Parameter::DampingMass, 0.8),
        (Parameter::DampingStiffness, 2e-3),
    ] {
        assert!((value(&report, parameter) / truth - 1.0).abs() < 1e-6, "{report}");
    }
}

/// Every scheme identifies the modulus behind its own motion, from no start; and the motion of a
/// good scheme has the same modulus for another.
#[test]
fn exact_modulus_with_every_scheme() {
    let mut scene = small(0.5);
    let time = |scheme, step| Some(Time { scheme, ..Time::new(0.5, step) });
    let mut records = Vec::new();
    for (scheme, step) in [
        (Scheme::AverageVectorField, 2e-3),
        (Scheme::Rodas4, 2e-3),
        (Scheme::Verlet, 6e-5),
        (Scheme::Pefrl, 1e-4),
    ] {
        scene.time = time(scheme, step);
        scene.material.youngs_modulus = 1e8;
        let data = observe(&scene, 50);
        scene.material.youngs_modulus = 1.0;
        let report = fit(&scene, &data, &[Parameter::YoungsModulus.into()]);
        let error = (value(&report, Parameter::YoungsModulus) / 1e8 - 1.0).abs();
        println!("{scheme:?}: off by {error:.1e} after {:.1} simulations", report.simulations);
        assert!(report.is_success() && error < 1e-8, "{scheme:?}: {report}");
        records.push(data);
    }
    let report = fit(&scene, &records[1], &[Parameter::YoungsModulus.into()]);
    assert!((value(&report, Parameter::YoungsModulus) / 1e8 - 1.0).abs() < 1e-4, "{report}");
}

/// A known force separates what gravity cannot.
#[test]
fn modulus_and_density_with_a_known_force() {
    let mut scene = small(1.0);
    scene.loads.point = vec![PointForce {
        node: rodfit::scene::Node::TIP,
        force: [0.0, -0.3, 0.0],
        ..PointForce::default()
    }];
    let data = observe(&scene, 100);
    let report = fit(&scene, &data, &[Parameter::YoungsModulus.into(), Parameter::Density.into()]);
    assert!((value(&report, Parameter::YoungsModulus) / 1e8 - 1.0).abs() < 1e-6, "{report}");
    assert!((value(&report, Parameter::Density) / 1273.52 - 1.0).abs() < 1e-6, "{report}");
}

/// Damping that is not there goes to zero without holding up the others, whose minimum is that
/// without it.
#[test]
fn what_vanishes_does_not_hold_up_the_rest() {
    let mut scene = cantilever_with(0.5, 2e-3, 0.8, Clamp::MidEdge);
    scene.rod.segments = Some(20);
    let mut data = observe(&scene, 80);
    let (mut random, noise) = (ChaCha8Rng::seed_from_u64(2), Normal::new(0.0, 1e-3).unwrap());
    for x in data.samples.iter_mut().flat_map(|s| s.position.iter_mut()).flatten() {
        *x += noise.sample(&mut random);
    }
    let camera =
        [Parameter::YoungsModulus, Parameter::ClampAngle, Parameter::PixelScale].map(Unknown::new);
    let without = fit(&scene, &data, &camera);
    let damping = [Parameter::DampingMass, Parameter::DampingStiffness].map(Unknown::new);
    let all: Vec<Unknown> = camera.into_iter().chain(damping).collect();
    let with = fit(&scene, &data, &all);
    println!("{with}");
    assert!(with.converged);
    for (a, b) in with.parameters.iter().zip(&without.parameters) {
        let (a, sd, b) = (a.value.unwrap(), b.std_error.unwrap(), b.value.unwrap());
        // A little damping may be mistaken for noise, and move the rest a little.
        assert!((a - b).abs() < 0.3 * sd, "{with}\n{without}");
    }
    let bounded = with.parameters.iter().filter_map(|e| e.upper95);
    assert!(bounded.clone().count() >= 1 && bounded.clone().all(|upper| upper > 0.0), "{with}");
}

/// Where steps are taken in halves the misfit jumps with the modulus. A fit that leaves more than
/// noise says so, with a way out; the way out works.
#[test]
fn jumps_of_the_misfit_are_named() {
    let rod = |step: f64, damping: f64| {
        let mut scene = cantilever_with(0.5, step, 2.4, Clamp::MidEdge);
        scene.rod.shape = Shape::Straight { length: 0.12, direction: [1.0, 0.0, 0.0] };
        scene.rod.section = Section::Circle { radius: 1.2e-3 };
        scene.rod.segments = Some(20);
        scene.material.youngs_modulus = 2.9e7;
        scene.loads.damping.mass = damping;
        scene
    };
    let warned = |step: f64| {
        // What the model misses.
        let data = observe(&rod(step, 0.3), 200);
        let scene = rod(step, 0.32);
        let run = scene.problem().unwrap().simulate().unwrap();
        let halved = run.work().steps > run.times().len() - 1;
        let report = fit(&scene, &data, &[Unknown::new(Parameter::YoungsModulus)]);
        assert!(!report.warnings.is_empty(), "{report}");
        (halved, report.warnings.iter().any(|w| w.contains("taken in halves")))
    };
    assert_eq!(warned(8e-3), (true, true));
    assert_eq!(warned(1e-3), (false, false));
}

/// Points inside the rod, missing coordinates and samples, two observations of unknown noise.
#[test]
fn partial_observations_of_several_points() {
    let scene = small(1.0);
    let run = scene.problem().unwrap().simulate().unwrap();
    let see = |point: Point, keep: fn(usize, usize) -> bool| {
        let sample = |k: usize| {
            let time = k as f64 * 0.013;
            let (x, _) = run.at(point, time).unwrap();
            let position = std::array::from_fn(|c| keep(k, c).then_some(x[c]));
            Sample { time, position }
        };
        Observation::new((1..70).map(sample).collect()).at(point)
    };
    let middle = see(Point::ArcLength(0.31), |k, c| c == 1 && k % 5 != 0);
    let node = see(Point::Node(20), |k, c| c < 2 && k % 3 != 0);
    let report = Fit::new(&scene.problem().unwrap())
        .observe(middle)
        .observe(node)
        .identify(Parameter::YoungsModulus)
        .solve()
        .unwrap();
    assert!((value(&report, Parameter::YoungsModulus) / 1e8 - 1.0).abs() < 1e-8, "{report}");
    assert_eq!(report.sigma.len(), 2);
}

/// 200 seeds of 1 % noise: the reported standard error is the spread of the estimates, and the
/// intervals cover.
#[test]
fn standard_error_is_the_spread() {
    let mut scene = small(1.0);
    scene.rod.segments = Some(16);
    scene.time = Some(Time::new(1.0, 4e-3));
    let exact = observe(&scene, 100);
    let problem = scene.problem().unwrap();
    // 1 % of the tip's largest excursion.
    let noise = Normal::new(0.0, 0.01 * 0.27).unwrap();
    let (mut estimates, mut errors, mut covered) = (Vec::new(), Vec::new(), 0);
    for seed in 0..200 {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut data = exact.clone();
        for x in data.samples.iter_mut().flat_map(|s| s.position.iter_mut()).flatten() {
            *x += noise.sample(&mut random);
        }
        // Of the mesh and the step of the data.
        let same = Analysis { discretization_error: Refinement::None, ..Analysis::default() };
        let fit = Fit::new(&problem).observe(data).identify(Parameter::YoungsModulus).analyse(same);
        let report = fit.solve().unwrap();
        let estimate = report.estimate(Parameter::YoungsModulus).unwrap();
        estimates.push((estimate.value.unwrap() / 1e8).ln());
        errors.push(estimate.std_error.unwrap() / estimate.value.unwrap());
        let [low, high] = estimate.interval95.unwrap();
        covered += usize::from(low <= 1e8 && 1e8 <= high);
    }
    let n = estimates.len() as f64;
    let mean = estimates.iter().sum::<f64>() / n;
    let spread = (estimates.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / (n - 1.0)).sqrt();
    let error = errors.iter().sum::<f64>() / n;
    println!(
        "standard error {error:.3e}, spread {spread:.3e}, ratio {:.3}; {covered} of 200 intervals cover",
        error / spread
    );
    assert!((error / spread - 1.0).abs() < 0.15);
    assert!(mean.abs() < 4.0 * spread / n.sqrt(), "bias {mean:e}");
    // 190 expected; three standard deviations of a binomial count are 9.
    assert!((181..=199).contains(&covered));
}

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
fn modulus_and_density_under_gravity_are_refused_by_name() {
    let scene = small(1.0);
    let data = observe(&scene, 100);
    let report = fit(&scene, &data, &[Parameter::YoungsModulus.into(), Parameter::Density.into()]);
    refusal(&report, &["not identifiable", "youngs_modulus/density"]);
    assert!(report.parameters.iter().all(|e| !e.identifiable));
    // With damping, whose rate is identified all the same.
    let mut scene = scene;
    scene.loads.damping.mass = 0.8;
    let data = observe(&scene, 100);
    let report = fit(
        &scene,
        &data,
        &[
            Parameter::YoungsModulus.into(),
            Parameter::DampingMass.into(),
            Parameter::Density.into(),
        ],
    );
    refusal(&report, &["youngs_modulus/density"]);
    let damping = report.estimate(Parameter::DampingMass).unwrap();
    assert!((damping.value.unwrap() / 0.8 - 1.0).abs() < 1e-6, "{report}");
}

#[test]
fn what_has_no_effect_is_refused_by_name() {
    // Poisson's ratio does not enter a planar scene.
    let mut scene = small(1.0);
    scene.material.poisson_ratio = Some(0.4);
    let data = observe(&scene, 50);
    refusal(
        &fit(&scene, &data, &[Parameter::PoissonRatio.into()]),
        &["poisson_ratio has no effect"],
    );
    // Nor does anything in a rod at rest without load.
    scene.loads.gravity = [0.0; 3];
    let data = observe(&scene, 50);
    refusal(
        &fit(&scene, &data, &[Parameter::YoungsModulus.into()]),
        &["youngs_modulus has no effect"],
    );
}

/// A wrong model never looks fine.
#[test]
fn an_unexplained_motion_is_a_warning() {
    let scene = small(1.0);
    let mut data = observe(&scene, 100);
    for sample in &mut data.samples {
        sample.position[1] = sample.position[1].map(|y| -y);
    }
    let report = fit(&scene, &data, &[Parameter::YoungsModulus.into()]);
    assert!(report.warnings.iter().any(|w| w.contains("unexplained")), "{report}");
    let mut data = observe(&scene, 100).sigma(1e-5);
    for (k, sample) in data.samples.iter_mut().enumerate() {
        sample.position[1] = sample.position[1].map(|y| y + 1e-3 * (k as f64).sin());
    }
    let report = fit(&scene, &data, &[Parameter::YoungsModulus.into()]);
    assert!(report.warnings.iter().any(|w| w.contains("times the stated sigma")), "{report}");
}

#[test]
fn bounds_hold_and_are_mentioned() {
    let scene = small(1.0);
    let data = observe(&scene, 100);
    let bounded = Unknown::new(Parameter::YoungsModulus).bounds(1.2e8, 1e10);
    let report = fit(&scene, &data, &[bounded]);
    assert!((value(&report, Parameter::YoungsModulus) / 1.2e8 - 1.0).abs() < 1e-12, "{report}");
    assert!(report.warnings.iter().any(|w| w.contains("bound")), "{report}");
}

/// Both routes of derivatives find the same.
#[test]
fn either_route_identifies_the_same() {
    let mut scene = small(0.5);
    scene.rod.segments = Some(10);
    let data = observe(&scene, 50);
    let problem = scene.problem().unwrap().with_derivatives(rodfit::Derivatives::Dual);
    let report =
        Fit::new(&problem).observe(data).identify(Parameter::YoungsModulus).solve().unwrap();
    assert!((value(&report, Parameter::YoungsModulus) / 1e8 - 1.0).abs() < 1e-8, "{report}");
}

/// The commonest slips of a set-up are named, in no time.
#[test]
fn wrong_set_ups_are_named_at_once() {
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
        (changed(&|t, [x, y], _| (t, [0.45 * x, 0.45 * y])), &["the scale is off"]),
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

/// Inputs no fit can start from are errors that name what is wrong.
#[test]
fn impossible_requests_are_input_errors() {
    let scene = small(1.0);
    let problem = scene.problem().unwrap();
    let data = observe(&scene, 100);
    let base = || Fit::new(&problem).observe(data.clone());
    let late = Observation::new(vec![Sample { time: 1.1, position: [Some(0.0); 3] }; 1]);
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
    ];
    for (fit, words) in cases {
        let error = fit.solve().unwrap_err();
        assert!(error.is_input() && error.to_string().contains(words), "`{words}` in: {error}");
    }
    let mut scene = scene;
    scene.rod.section =
        Section::Custom { area: 1e-4, i1: 1e-9, i2: 1e-9, j: 2e-9, up: [0.0, 1.0, 0.0] };
    let error =
        Fit::new(&scene.problem().unwrap()).observe(data).identify(Parameter::Radius).solve();
    let error = error.unwrap_err().to_string();
    assert!(error.contains("radius") && error.contains("circular section"), "{error}");
}

/// Where every simulation fails there is an error of the computation, not a number.
#[test]
fn failing_simulations_are_not_a_cost() {
    let mut scene = small(1.0);
    let data = observe(&scene, 40);
    scene.loads.gravity = [0.0, -1e200, 0.0];
    let problem = scene.problem().unwrap();
    let error =
        Fit::new(&problem).observe(data).identify(Parameter::YoungsModulus).solve().unwrap_err();
    assert!(
        !error.is_input() && error.to_string().contains("every trial simulation failed"),
        "{error}"
    );
}

/// What could not be identified before, from exact data of the tip, to the last digits: the length
/// beside E with a known load, a helix's pitch, the direction of the weight, a shaken wall's amplitude
/// and frequency, and a load.
#[test]
fn any_number_is_identified() {
    let mut rod = small(1.0);
    rod.material.poisson_ratio = Some(0.4);
    let mut loaded = rod.clone();
    loaded.loads.point = vec![PointForce { force: [0.0, -0.05, 0.0], ..PointForce::default() }];
    let mut helix = rod.clone();
    helix.rod.shape = Shape::Helix {
        length: 0.5,
        radius: 0.05,
        pitch: 0.1,
        axis: [0.0, 0.0, -1.0],
        handedness: Handedness::Left,
    };
    let mut shaken = rod.clone();
    shaken.loads.gravity = [0.0; 3];
    shaken.supports.motion = vec![Motion {
        end: End::Start,
        displacement: [0.0, 0.02, 0.0],
        frequency: Some(2.0),
        ..Motion::default()
    }];
    let mut spatial = rod.clone();
    spatial.rod.dimension = Dimension::Spatial;
    spatial.loads.gravity = [1.0, -9.0, 2.0];
    for (name, scene, wanted) in [
        ("length", &loaded, vec![("rod.shape.length", 0.9), ("youngs_modulus", 0.5)]),
        ("pitch", &helix, vec![("rod.shape.pitch", 1.2)]),
        (
            "weight",
            &spatial,
            vec![("loads.gravity.x", 0.5), ("loads.gravity.y", 0.9), ("loads.gravity.z", 1.3)],
        ),
        (
            "wall",
            &shaken,
            vec![("supports.motion.0.displacement.y", 0.7), ("supports.motion.0.frequency", 1.1)],
        ),
        ("load", &loaded, vec![("loads.point.0.force.y", 0.3), ("loads.point.0.force.x", 1.0)]),
    ] {
        let data = observe(scene, 100);
        let mut other = scene.clone();
        let mut fit_of = Vec::new();
        for (parameter, factor) in &wanted {
            let parameter: Parameter = parameter.parse().unwrap();
            let truth = parameter.of(scene).unwrap();
            parameter.set(&mut other, truth * factor).unwrap();
            fit_of.push((parameter, truth));
        }
        let problem = other.problem().unwrap();
        let fit = Fit::new(&problem).observe(data);
        let fit = fit_of.iter().fold(fit, |fit, (parameter, _)| fit.identify(*parameter));
        let report = fit.solve().unwrap();
        for (parameter, truth) in &fit_of {
            let found = report.estimate(*parameter).unwrap().value.unwrap_or(f64::NAN);
            let off = (found - truth).abs() / if *truth == 0.0 { 0.05 } else { truth.abs() };
            println!("{name}: {parameter} {off:.1e}, {:.1} simulations", report.simulations);
            assert!(off < 1e-7, "{name}, {parameter}: {found} {truth} {report}");
        }
    }
}
