//! Identification in a plane: exact answers from exact data, honest errors from noisy ones.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};
use rodfit::fit::{Analysis, FitReport, Refinement, Sample};
use rodfit::scene::{
    Clamp, Dimension, End, Handedness, Motion, PointForce, Scene, Scheme, Shape, Time,
};
use rodfit::{Fit, Observation, Parameter, Point, Unknown};

use crate::common::{cantilever_with, record};

/// 25 edges for `end` seconds.
pub fn small(end: f64) -> Scene {
    let mut scene = cantilever_with(0.5, 2e-3, end, Clamp::MidEdge);
    scene.rod.segments = Some(25);
    scene
}

pub fn observe(scene: &Scene, count: usize) -> Observation {
    record(&scene.problem().unwrap().simulate().unwrap(), count)
}

pub fn fit(scene: &Scene, observation: &Observation, unknowns: &[Unknown]) -> FitReport {
    let fit = Fit::new(&scene.problem().unwrap()).observe(observation.clone());
    unknowns.iter().fold(fit, |fit, unknown| fit.identify(unknown.clone())).solve().unwrap()
}

pub fn value(report: &FitReport, parameter: Parameter) -> f64 {
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
