//! Identification in a plane: exact data give exact parameters, noisy data the errors that are reported.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rodfit::fit::Sample;
use rodfit::scene::{
    BendingLaw, Clamp, Dimension, End, Handedness, Maxwell, Motion, Scene, Scheme, Section, Shape,
    StretchLaw, Support, Time,
};
use rodfit::{Fit, Observation, Parameter, Point, Unknown};

use crate::common::fits::{
    covers, error, fit, fit_with, found, mean_and_spread, noisy, observe, print_work, same_mesh,
};
use crate::common::{at_tip, coarse, simulate};

/// 25 edges for `end` seconds.
pub fn small(end: f64) -> Scene {
    coarse(25, 2e-3, end)
}

/// 20 moduli over three decades and records of 1 s and 5 s, without a start and with starts
/// between a hundredth and a hundred times the true modulus.
#[test]
fn exact_data_give_exact_modulus_from_any_start() {
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
                let error = error(&report, Parameter::YoungsModulus, truth);
                worst = worst.max(error);
                work.push(report.simulations);
                // Exact data: within the tolerance of the search.
                assert!(error < 1e-8, "{truth:e}, {end} s, {unknown:?}: {report}");
            }
        }
    }
    print_work(worst, work);
}

/// The walls of the paper are at nodes, where the coarse model of the search is much too short.
#[test]
fn walls_at_nodes_give_exact_modulus() {
    let mut scene = small(3.0);
    scene.supports.clamp = Clamp::Nodes;
    let data = observe(&scene, 300);
    // The modulus with which the data are simulated, without noise.
    found(
        &fit(&scene, &data, &[Parameter::YoungsModulus]),
        &[(Parameter::YoungsModulus, 1e8)],
        1e-8,
    );
}

#[test]
fn exact_data_give_beta_alone_and_with_modulus() {
    for truth in [0.5, 0.55, 0.7, 0.9, 1.0] {
        let mut scene = small(2.0);
        scene.time = Some(Time { beta: truth, ..Time::new(2.0, 5e-3) });
        let data = observe(&scene, 200);
        Parameter::Beta.set(&mut scene, 0.62).unwrap();
        let truths = [(Parameter::Beta, truth), (Parameter::YoungsModulus, 1e8)];
        // The values with which the data are simulated, without noise.
        found(&fit(&scene, &data, &[Parameter::Beta]), &truths[..1], 1e-6);
        found(&fit(&scene, &data, &truths.map(|(p, _)| p)), &truths, 1e-6);
    }
}

/// A drooping rod with a natural curvature below that of its mold.
#[test]
fn exact_data_give_natural_curvature_and_modulus() {
    for truth in [0.4, 1.0, 1.3] {
        let mut scene = small(1.0);
        scene.rod.shape = Shape::Arc { length: 0.5, angle: 0.8 };
        scene.rod.natural_curvature = truth.into();
        let data = observe(&scene, 100);
        scene.rod.natural_curvature = 0.8.into();
        let truths = [(Parameter::YoungsModulus, 1e8), (Parameter::NaturalCurvature, truth)];
        // The values with which the data are simulated, without noise.
        found(&fit(&scene, &data, &truths.map(|(p, _)| p)), &truths, 1e-7);
    }
}

#[test]
fn exact_data_give_dampings_and_modulus() {
    let mut scene = small(2.0);
    scene.loads.damping.mass = 0.8;
    scene.loads.damping.stiffness = 2e-3;
    let data = observe(&scene, 200);
    let truths = [
        (Parameter::YoungsModulus, 1e8),
        (Parameter::DampingMass, 0.8),
        (Parameter::DampingStiffness, 2e-3),
    ];
    // The values with which the data are simulated, without noise.
    found(&fit(&scene, &data, &truths.map(|(p, _)| p)), &truths, 1e-6);
}

/// Modulus, stiffness fractions and relaxation times of two Maxwell branches.
#[test]
fn exact_data_give_the_prony_series() {
    let mut scene = small(2.0);
    let series = |[g, fast, h, slow]: [f64; 4]| {
        let branches =
            vec![Maxwell { stiffness: g, time: fast }, Maxwell { stiffness: h, time: slow }];
        branches.into()
    };
    let truth = [0.3, 0.02, 0.5, 0.4];
    scene.loads.damping.maxwell = series(truth);
    let data = observe(&scene, 200);
    let start = [0.2, 0.03, 0.4, 0.3];
    scene.loads.damping.maxwell = series(start);
    let names = ["0.stiffness", "0.time", "1.stiffness", "1.time"];
    let parameter =
        |name: &str| -> Parameter { format!("loads.damping.maxwell.{name}").parse().unwrap() };
    let mut truths = vec![(Parameter::YoungsModulus, 1e8)];
    truths.extend(names.iter().zip(truth).map(|(name, value)| (parameter(name), value)));
    let mut unknowns = vec![Unknown::new(Parameter::YoungsModulus).start(0.9e8)];
    let starts = names.iter().zip(start);
    unknowns.extend(starts.map(|(name, value)| Unknown::new(parameter(name)).start(value)));
    // The values with which the data are simulated, without noise.
    found(&fit(&scene, &data, &unknowns), &truths, 1e-6);
}

/// Modulus and ratio of a Mooney-Rivlin stretch, from a rubber band that falls into its support.
#[test]
fn exact_data_give_the_mooney_rivlin_ratio() {
    let mut scene = small(0.5);
    scene.rod.shape = Shape::Straight { length: 0.5, direction: [0.0, -1.0, 0.0] };
    scene.loads.point = at_tip([0.0, -10.0, 0.0]);
    scene.material.youngs_modulus = 5e5;
    scene.material.stretch_law = StretchLaw::MooneyRivlin;
    scene.material.mooney_rivlin_ratio = Some(0.3);
    let data = observe(&scene, 100);
    scene.material.mooney_rivlin_ratio = Some(0.1);
    let ratio: Parameter = "material.mooney_rivlin_ratio".parse().unwrap();
    let truths = [(Parameter::YoungsModulus, 5e5), (ratio, 0.3)];
    // The values with which the data are simulated, without noise.
    found(&fit(&scene, &data, &truths.map(|(p, _)| p)), &truths, 1e-6);
}

/// Modulus and coefficient of the cubic law of bending, from a motion of large curvature.
#[test]
fn exact_data_give_the_law_of_bending() {
    let mut scene = small(1.0);
    scene.material.youngs_modulus = 1e7;
    scene.material.bending_law = Some(BendingLaw::Cubic { coefficient: 0.02 });
    let data = observe(&scene, 100);
    scene.material.bending_law = Some(BendingLaw::Cubic { coefficient: 0.0 });
    let coefficient: Parameter = "material.bending_law.coefficient".parse().unwrap();
    let truths = [(Parameter::YoungsModulus, 1e7), (coefficient, 0.02)];
    // The values with which the data are simulated, without noise.
    found(&fit(&scene, &data, &truths.map(|(p, _)| p)), &truths, 1e-6);
}

/// Modulus and factors of a table of the bending moment, from a motion whose curvatures reach its last interval.
#[test]
fn exact_data_give_the_table_of_the_bending_moment() {
    let table = |factor: &[f64]| {
        let (curvature, factor) = (vec![2.0, 6.0], factor.to_vec());
        Some(BendingLaw::Table { curvature, factor })
    };
    let mut scene = small(1.0);
    scene.material.youngs_modulus = 1e7;
    scene.material.bending_law = table(&[0.8, 1.4]);
    let data = observe(&scene, 100);
    scene.material.bending_law = table(&[1.0, 1.0]);
    let [first, second] =
        [0, 1].map(|k| format!("material.bending_law.factor.{k}").parse().unwrap());
    let truths = [(Parameter::YoungsModulus, 1e7), (first, 0.8), (second, 1.4)];
    // The values with which the data are simulated, without noise.
    found(&fit(&scene, &data, &truths.map(|(p, _)| p)), &truths, 1e-6);
}

/// Every scheme identifies the modulus of its own simulation without a start. The motion of an accurate scheme gives the
/// same modulus with another accurate scheme.
#[test]
fn every_scheme_gives_exact_modulus() {
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
        let report = fit(&scene, &data, &[Parameter::YoungsModulus]);
        let error = error(&report, Parameter::YoungsModulus, 1e8);
        println!("{scheme:?}: off by {error:.1e} after {:.1} simulations", report.simulations);
        // Data and model have the same scheme and mesh: within the tolerance of the search.
        assert!(error < 1e-8, "{scheme:?}: {report}");
        records.push(data);
    }
    let report = fit(&scene, &records[1], &[Parameter::YoungsModulus]);
    // Another accurate scheme has an error of its own.
    found(&report, &[(Parameter::YoungsModulus, 1e8)], 1e-4);
}

/// Under gravity only the ratio of modulus and density is identifiable; a known force determines both.
#[test]
fn known_force_gives_modulus_and_density() {
    let mut scene = small(1.0);
    scene.loads.point = at_tip([0.0, -0.3, 0.0]);
    let data = observe(&scene, 100);
    let truths = [(Parameter::YoungsModulus, 1e8), (Parameter::Density, 1273.52)];
    // The values with which the data are simulated, without noise.
    found(&fit(&scene, &data, &truths.map(|(p, _)| p)), &truths, 1e-6);
}

/// For data without damping its estimate decreases to zero; the other unknowns converge to the minimum without it.
#[test]
fn vanishing_damping_does_not_stop_the_other_unknowns() {
    let scene = coarse(20, 2e-3, 0.8);
    let data = noisy(&observe(&scene, 80), 1e-3, 2);
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

/// Two observations with unknown noise of points inside the rod, with missing coordinates and samples.
#[test]
fn partial_observations_of_several_points_are_fitted() {
    let scene = small(1.0);
    let run = simulate(&scene);
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
    // The modulus with which the data are simulated, without noise.
    found(&report, &[(Parameter::YoungsModulus, 1e8)], 1e-8);
    assert_eq!(report.sigma.len(), 2);
}

/// 200 seeds of 1 % noise: the reported standard error equals the spread of the estimates, and the
/// intervals have their nominal coverage.
#[test]
fn standard_error_equals_spread_of_replicates() {
    let scene = coarse(16, 4e-3, 1.0);
    let exact = observe(&scene, 100);
    let (mut estimates, mut errors, mut covered) = (Vec::new(), Vec::new(), 0);
    for seed in 0..200 {
        // 1 % of the tip's largest excursion.
        let data = noisy(&exact, 0.01 * 0.27, seed);
        let report = fit_with(&scene, &data, &[Parameter::YoungsModulus], same_mesh());
        let estimate = report.estimate(Parameter::YoungsModulus).unwrap();
        estimates.push((estimate.value.unwrap() / 1e8).ln());
        errors.push(estimate.std_error.unwrap() / estimate.value.unwrap());
        covered += usize::from(covers(&report, Parameter::YoungsModulus, 1e8));
    }
    let ([mean, spread], [error, _]) = (mean_and_spread(&estimates), mean_and_spread(&errors));
    println!(
        "standard error {error:.3e}, spread {spread:.3e}, ratio {:.3}; {covered} of 200 intervals cover",
        error / spread
    );
    // The spread of 200 estimates has a relative error of 5 %; three of them are 15 %.
    assert!((error / spread - 1.0).abs() < 0.15);
    // The mean has a standard error of the spread over sqrt(200).
    assert!(mean.abs() < 4.0 * spread / 200_f64.sqrt(), "bias {mean:e}");
    // 190 expected; three standard deviations of a binomial count are 9.
    assert!((181..=199).contains(&covered));
}

/// Hand-derived and automatic derivatives give the same estimate.
#[test]
fn library_and_fit_file_give_the_same_estimate() {
    let scene = coarse(10, 2e-3, 0.5);
    let data = observe(&scene, 50);
    let problem = scene.problem().unwrap().with_derivatives(rodfit::Derivatives::Dual);
    let report =
        Fit::new(&problem).observe(data).identify(Parameter::YoungsModulus).solve().unwrap();
    // The modulus with which the data are simulated, without noise.
    found(&report, &[(Parameter::YoungsModulus, 1e8)], 1e-8);
}

/// Parameters of all kinds are recovered from exact data of the tip: length beside E with a known load, a helix's pitch, the
/// direction of the weight, amplitude and frequency of a shaken wall, and a load.
#[test]
fn any_scene_parameter_is_identified() {
    let mut rod = small(1.0);
    rod.material.poisson_ratio = Some(0.4);
    let mut loaded = rod.clone();
    loaded.loads.point = at_tip([0.0, -0.05, 0.0]);
    let mut between = loaded.clone();
    between.loads.point[0].node = Point::ArcLength(0.333);
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
        ("place", &between, vec![("loads.point.0.node.arc_length", 0.8), ("youngs_modulus", 2.0)]),
    ] {
        let mut other = scene.clone();
        let mut truths = Vec::new();
        for (parameter, factor) in &wanted {
            let parameter: Parameter = parameter.parse().unwrap();
            let truth = parameter.of(scene).unwrap();
            parameter.set(&mut other, truth * factor).unwrap();
            truths.push((parameter, truth));
        }
        let unknowns: Vec<Parameter> = truths.iter().map(|(parameter, _)| *parameter).collect();
        let report = fit(&other, &observe(scene, 100), &unknowns);
        for (parameter, truth) in &truths {
            let found = report.estimate(*parameter).unwrap().value.unwrap_or(f64::NAN);
            let off = (found - truth).abs() / if *truth == 0.0 { 0.05 } else { truth.abs() };
            println!("{name}: {parameter} {off:.1e}, {:.1} simulations", report.simulations);
            // Exact data: within the tolerance of the search.
            assert!(off < 1e-7, "{name}, {parameter}: {found} {truth} {report}");
        }
    }
}

/// A rod that is thrown about a hinge. The coarse model with its large steps cannot be simulated near the true modulus, and has
/// other minima. The full model is therefore evaluated at a given start too.
#[test]
fn given_start_is_used_where_the_coarse_model_fails() {
    let mut scene = small(0.618_796_662);
    scene.rod.segments = Some(10);
    scene.rod.shape =
        Shape::Straight { length: 0.915_546_741_570, direction: [-0.515_678, -0.856_782, 0.0] };
    scene.rod.section = Section::Tube { radius: 0.012_730_8, thickness: 0.001_707_79 };
    let material = &mut scene.material;
    (material.density, material.youngs_modulus) = (2940.68, 8.655_636_7e8);
    scene.loads.gravity = [2.495_685, 1.500_073, 0.0];
    scene.initial.velocity = [0.0, 0.422_153, 0.0];
    scene.supports.start = Support::Pinned;
    scene.supports.clamp = Clamp::MidEdge;
    scene.time = Some(Time::new(0.618_796_662, 0.618_796_662 / 150.0));
    let data = noisy(&observe(&scene, 50).sigma(9e-5), 9e-5, 5);
    for start in [8.2e8, 8.655e8, 9.1e8] {
        let modulus = [Unknown::new(Parameter::YoungsModulus).start(start)];
        let report = fit_with(&scene, &data, &modulus, same_mesh());
        // The modulus of the simulation; noise of 9e-5 m.
        assert!(error(&report, Parameter::YoungsModulus, 8.655_636_7e8).abs() < 0.01, "{report}");
    }
}
