//! Derivatives carried back over a run are those that were carried along with it.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rodfit::scene::*;
use rodfit::{Parameter, Point, Problem, Reversible};
use std::collections::BTreeSet;

use crate::parameters::{SEEDS, scene};

/// Of the sum of the sizes of all terms of a derivative.
const EXACT: f64 = 1e-9;
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
        let run = Reversible::run(problem, &all, time.steps()).unwrap();
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
    all.filter(|p| !p.is_of_the_camera() && problem.check_parameter(*p).is_ok()).collect()
}

/// The worst that a derivative is off, of the sizes of its terms.
fn worst(problem: &Problem, seed: u64) -> (f64, Vec<Parameter>) {
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
fn back_as_along_by_every_number() {
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
            damping.maxwell = Some(Maxwell { stiffness: 0.3, time: 4e-3 });
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
