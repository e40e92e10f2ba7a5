//! Derivatives carried back over a run are those that were carried along with it.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rodfit::scene::*;
use rodfit::{AdjointRun, Parameter, Point, Problem};
use std::collections::BTreeSet;

use crate::common::at_tip;
use crate::parameters::{SEEDS, scene};

/// Of the sum of the sizes of all terms of a derivative.
pub const EXACT: f64 = 1e-9;
/// The least size of what a number of its own size makes of the misfit.
const LEAST: f64 = 1e-7;

/// A misfit's slopes by places, m^-1, and velocities, s/m, of all nodes after every step, and by the place of a point
/// between two steps.
struct Misfit {
    nodes: Vec<(usize, usize, [[f64; 3]; 2])>,
    between: (Point, f64, [f64; 3]),
}

impl Misfit {
    fn of(problem: &Problem, seed: u64) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut vector = || [0; 3].map(|_| random.random_range(-1.0..1.0));
        let time = problem.time().unwrap();
        let all = (0..problem.nodes()).flat_map(|i| (0..=time.steps()).map(move |k| (i, k)));
        let nodes = all.map(|(i, k)| (i, k, [vector(), vector().map(|c| 1e-2 * c)])).collect();
        let place = Point::Node(problem.nodes() / 2);
        Self { nodes, between: (place, 0.43 * time.end, vector()) }
    }

    /// The derivatives carried back.
    fn back(&self, problem: &Problem, parameters: &[Parameter]) -> Vec<f64> {
        let all: Vec<usize> = (0..problem.nodes()).collect();
        let time = problem.time().unwrap();
        let run = AdjointRun::run(problem, &all, time.steps()).unwrap();
        let mut slopes = run.slopes();
        for (i, k, slope) in &self.nodes {
            slopes.add_motion(*i, *k, *slope).unwrap();
        }
        let (point, at, slope) = self.between;
        slopes.add(point, at, slope).unwrap();
        run.gradient(parameters, &slopes).unwrap()
    }

    /// Those carried along, and the sizes of what they are the sums of.
    fn along(&self, problem: &Problem, parameters: &[Parameter]) -> Vec<[f64; 2]> {
        let run = problem.simulate_with(parameters).unwrap();
        let (point, at, slope) = self.between;
        let (_, between) = run.at(point, at).unwrap();
        let (_, _, derivatives) = run.into_parts();
        let terms = |k: usize| {
            let of = |a: &[f64; 3], b: &[f64; 3]| [0, 1, 2].map(|c| a[c] * b[c]);
            let motions = self.nodes.iter().flat_map(|(i, step, slope)| {
                let rates = &derivatives[k][step * problem.nodes() + i];
                [0, 1].map(|part| of(&rates[part], &slope[part]))
            });
            motions.chain([of(&between[k], &slope)]).flatten().collect::<Vec<f64>>()
        };
        let sums = |k: usize| {
            let terms = &terms(k);
            [terms.iter().sum(), terms.iter().map(|x| x.abs()).sum()]
        };
        (0..parameters.len()).map(sums).collect()
    }
}

/// The numbers that a scene may be differentiated by.
fn numbers(problem: &Problem) -> Vec<Parameter> {
    let all = Parameter::all(problem.scene()).into_iter();
    all.filter(|p| !p.is_of_the_recording() && problem.check_parameter(*p).is_ok()).collect()
}

/// The worst that a derivative is off, of the sizes of its terms.
pub fn worst(problem: &Problem, seed: u64) -> (f64, Vec<Parameter>) {
    let (misfit, parameters) = (Misfit::of(problem, seed), numbers(problem));
    let (back, along) = (misfit.back(problem, &parameters), misfit.along(problem, &parameters));
    let mut worst = 0.0_f64;
    for ((parameter, back), [along, size]) in parameters.iter().zip(&back).zip(&along) {
        // What moves nothing but by rounding errors has no digits.
        let value = parameter.of(problem.scene()).unwrap().abs();
        let off = (back - along).abs() / size.max(LEAST / value.max(1e-3));
        if off > EXACT {
            println!("{seed}, {parameter}: {back:e} for {along:e} of {size:e}");
        }
        worst = worst.max(off);
    }
    (worst, parameters)
}

/// Of scenes of all kinds, by every number that they have.
#[test]
fn adjoint_gradient_equals_forward_derivatives_by_every_number() {
    let (mut seen, mut all, mut checked) = (BTreeSet::new(), 0.0_f64, [0; 2]);
    let mut wrong = Vec::new();
    for seed in 0..SEEDS {
        let planar = seed % 2 == 0;
        let mut scene = scene(seed, planar);
        let scheme = scene.scheme();
        if !matches!(scheme, Scheme::NewmarkBeta | Scheme::GeneralisedAlpha) {
            // The same scene with a scheme that goes back.
            scene.time = scene.time.map(|time| Time { scheme: Scheme::GeneralisedAlpha, ..time });
        }
        let damping = &mut scene.loads.damping;
        if seed % 4 < 2 {
            (damping.bending, damping.stretching) = (1e-3, 5e-4);
        }
        if seed % 5 < 2 {
            damping.maxwell = Maxwell { stiffness: 0.3, time: 4e-3 }.into();
        }
        if seed % 6 < 2 {
            let fluid_velocity = [0.3, -0.2, if planar { 0.0 } else { 0.1 }];
            scene.loads.drag = Some(Drag {
                linear_normal: 0.02,
                quadratic_normal: 0.3,
                linear_tangential: 0.01,
                quadratic_tangential: 0.1,
                fluid_velocity,
                ..Drag::default()
            });
        }
        let Ok(problem) = scene.problem() else { continue };
        if problem.simulate().is_err() {
            continue;
        }
        let (worst, parameters) = worst(&problem, seed);
        checked[usize::from(planar)] += 1;
        seen.extend(parameters.iter().map(|parameter| parameter.path()));
        if worst > EXACT {
            wrong.push((seed, worst));
        }
        all = all.max(worst);
    }
    println!("{checked:?} scenes, {} numbers, off by {all:.1e}", seen.len());
    assert!(wrong.is_empty(), "{wrong:?}");
    assert!(checked.iter().all(|scenes| *scenes >= 12) && seen.len() > 60, "{checked:?}");
}

/// Whatever there is room for, states are found again as they were.
#[test]
fn adjoint_gradient_is_the_same_with_little_memory() {
    for planar in [true, false] {
        let mut scene = scene(if planar { 50 } else { 53 }, planar);
        scene.time = Some(Time { scheme: Scheme::GeneralisedAlpha, ..Time::new(0.1, 1e-3) });
        let problem = scene.problem().unwrap();
        let (tip, parameters) = (problem.nodes() - 1, numbers(&problem));
        let by = |bytes: usize| {
            let run = AdjointRun::run_within(&problem, &[tip], 100, bytes).unwrap();
            let mut slopes = run.slopes();
            for k in 0..=100 {
                slopes.add_motion(tip, k, [[1.0, -0.5, 0.2], [0.01, 0.0, 0.03]]).unwrap();
            }
            run.gradient(&parameters, &slopes).unwrap()
        };
        let (all, some, hardly_any) = (by(64 << 20), by(150_000), by(0));
        assert_eq!(all, some);
        assert_eq!(all, hardly_any);
        assert!(all.iter().all(|x| x.is_finite()) && all.iter().any(|x| *x != 0.0));
    }
}

/// Numbers of lists along the rod, as many as it has joints: also where the start follows them.
#[test]
fn adjoint_gradient_by_lists_of_natural_strains_equals_forward_derivatives() {
    for (planar, state) in [
        (true, InitialState::Rest),
        (true, InitialState::Equilibrium),
        (false, InitialState::Rest),
        (false, InitialState::Equilibrium),
    ] {
        let mut scene = scene(53, planar);
        scene.rod.shape = Shape::Arc { length: 0.5, angle: 1.2 };
        scene.rod.segments = Some(9);
        scene.rod.natural_curvature =
            (0..9).map(|k| 1.0 + 0.1 * f64::from(k)).collect::<Vec<_>>().into();
        scene.supports =
            Supports { start: Support::Clamped, end: Support::Free, ..Supports::default() };
        if !planar {
            scene.rod.natural_twist = vec![0.4, -0.2, 1.0, 0.0, 0.1].into();
            scene.rod.natural_bending = vec![[0.3, 0.1], [0.0, -0.2], [0.5, 0.0], [0.2, 0.2]];
        }
        scene.loads = Loads { gravity: [0.0, -9.8, 0.0], ..scene.loads };
        scene.loads.point = at_tip([0.01, 0.0, 0.0]);
        scene.loads.damping = Damping { mass: 0.5, stiffness: 1e-3, ..Damping::default() };
        scene.initial = Initial { state, point: Vec::new(), ..Initial::default() };
        if state == InitialState::Equilibrium {
            scene.initial.point = at_tip([0.0, 0.02, 0.0]);
        }
        scene.time = Some(Time { scheme: Scheme::GeneralisedAlpha, ..Time::new(0.02, 1e-3) });
        let problem = scene.problem().unwrap();
        assert_eq!(problem.planar().is_some(), planar);
        let (worst, parameters) = worst(&problem, 7);
        let lists = parameters.iter().filter(|p| p.path().starts_with("rod.natural_"));
        assert_eq!(lists.count(), if planar { 9 } else { 9 + 5 + 8 });
        assert!(worst < EXACT, "{planar}, {state:?}: {worst:e}");
    }
}

/// Of a cable between two hands, one of which lets it turn, with a marker between them that leads it too; with all that
/// makes forces.
#[test]
fn adjoint_gradient_with_driven_nodes_and_free_twists_equals_forward_derivatives() {
    for (planar, seed) in [(true, 1), (false, 2), (false, 3)] {
        let free_twist = if planar { &[][..] } else { &[End::Start] };
        let mut scene =
            crate::prescribed_motion::scene(planar, Scheme::GeneralisedAlpha, &["3"], free_twist);
        scene.supports.end = Support::Recorded;
        if seed == 3 {
            scene.supports.motion = vec![Motion { end: End::End, twist: 0.4, ..Motion::default() }];
            scene.loads.damping = Damping { mass: 0.4, ..Damping::default() };
        }
        if seed == 2 {
            scene.loads.damping.maxwell = Maxwell { stiffness: 0.3, time: 4e-3 }.into();
        }
        scene.loads.drag = (seed != 1).then_some(Drag {
            linear_normal: 0.02,
            quadratic_normal: 0.3,
            fluid_velocity: [6.0, -5.0, 3.0],
            ..Drag::default()
        });
        let problem = scene.problem().unwrap();
        let (worst, parameters) = worst(&problem, seed);
        println!("planar: {planar}, {} numbers, off by {worst:.1e}", parameters.len());
        assert!(worst < EXACT && parameters.len() > 8, "{planar}, {seed}: {worst:e}");
    }
}

/// What does not go back says so.
#[test]
fn adjoint_of_unsupported_scenes_is_rejected() {
    let refused = |change: &dyn Fn(&mut Scene)| {
        let mut scene = scene(2, true);
        scene.time = scene.time.map(|time| Time { scheme: Scheme::GeneralisedAlpha, ..time });
        change(&mut scene);
        AdjointRun::run(&scene.problem().unwrap(), &[1], 1).unwrap_err().to_string()
    };
    let scheme = refused(&|scene| {
        scene.time = scene.time.clone().map(|time| Time { scheme: Scheme::Rodas4, ..time });
        scene.loads.damping = Damping::default();
        scene.loads.drag = None;
    });
    assert!(scheme.contains("time.scheme: found rodas4, allowed: newmark-beta"), "{scheme}");
    let slipping = refused(&|scene| {
        scene.loads.damping.friction = Some(Friction { stiffness: 0.5, curvature: 1.0 });
    });
    assert!(slipping.contains("loads.damping.friction"), "{slipping}");
}

/// Along a direction and back are the same matrix and its transpose.
#[test]
fn directional_derivative_is_the_transpose_of_the_adjoint() {
    for (planar, bytes) in [(true, 64 << 20), (false, 64 << 20), (true, 0)] {
        let mut scene = scene(if planar { 50 } else { 53 }, planar);
        scene.time = Some(Time { scheme: Scheme::GeneralisedAlpha, ..Time::new(0.02, 1e-3) });
        let problem = scene.problem().unwrap();
        let (tip, parameters) = (problem.nodes() - 1, numbers(&problem));
        let run = AdjointRun::run_within(&problem, &[1, tip], 20, bytes).unwrap();
        let mut random = ChaCha8Rng::seed_from_u64(3);
        let direction: Vec<(Parameter, f64)> = parameters
            .iter()
            .map(|p| (*p, p.of(&scene).unwrap().abs().max(1e-3) * random.random_range(-1.0..1.0)))
            .collect();
        let changes = run.along(&direction).unwrap();
        // Components of one parameter add up.
        let halves = |(parameter, size): &(Parameter, f64)| {
            [(*parameter, 0.25 * size), (*parameter, 0.75 * size)]
        };
        let split: Vec<(Parameter, f64)> = direction.iter().flat_map(halves).collect();
        assert_eq!(run.along(&split).unwrap(), changes);
        let (mut slopes, mut forth) = (run.slopes(), 0.0);
        for (k, node) in (0..=20).flat_map(|k| [(k, 1), (k, tip)]) {
            let slope = [[0; 3]; 2].map(|v| v.map(|_| random.random_range(-1.0..1.0)));
            slopes.add_motion(node, k, slope).unwrap();
            let change = changes[2 * k + usize::from(node == tip)];
            forth += change
                .as_flattened()
                .iter()
                .zip(slope.as_flattened())
                .map(|(c, s)| c * s)
                .sum::<f64>();
        }
        let gradient = run.gradient(&parameters, &slopes).unwrap();
        let back: f64 = gradient.iter().zip(&direction).map(|(g, (_, d))| g * d).sum();
        assert!((forth - back).abs() < 1e-9 * forth.abs(), "{planar}: {forth:e} {back:e}");
    }
}
