//! Results of equilibria and motions: reactions, velocities and energies.

use rodfit::scene::{Clamp, End, Motion, Scheme, Shape, Support, Time};
use rodfit::{Problem, Reaction, Trajectory};

use crate::calls::short;
use crate::common::helix_with;

pub fn sum(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|c| a[c] + b[c])
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|c| a[(c + 1) % 3] * b[(c + 2) % 3] - a[(c + 2) % 3] * b[(c + 1) % 3])
}

/// Requires that all components differ by at most `tolerance`.
fn near(a: [f64; 3], b: [f64; 3], tolerance: f64) {
    assert!((0..3).all(|c| (a[c] - b[c]).abs() <= tolerance), "{a:?} {b:?}");
}

/// Masses of the nodes, kg.
fn masses(problem: &Problem) -> Vec<f64> {
    let nodes = 0..problem.nodes();
    match problem.discretized() {
        rodfit::AnyProblem::Planar(p) => nodes.map(|i| p.rod().mass[2 * i]).collect(),
        rodfit::AnyProblem::Spatial(p) => nodes.map(|i| p.rod().mass[4 * i]).collect(),
    }
}

/// Reactions at rest balance force and moment of the weight of all nodes that are not inside of a wall.
#[test]
fn reactions_of_equilibrium_balance_the_weight() {
    let mut helix = helix_with(0.5, 1e-3, 0.1, Clamp::MidEdge);
    helix.material.poisson_ratio = Some(0.4);
    helix.loads.gravity = [1.0, 2.0, -9.0];
    let mut paper = short();
    paper.supports.clamp = Clamp::Nodes;
    let mut between = short();
    (between.supports.start, between.supports.end) = (Support::Pinned, Support::Clamped);
    let mut rolling = helix.clone();
    rolling.supports.end = Support::Roller;
    for (scene, inside) in
        [(short(), &[0][..]), (paper, &[]), (helix, &[0]), (between, &[12]), (rolling, &[0])]
    {
        let problem = scene.problem().unwrap();
        let rest = problem.equilibrium().unwrap();
        let (m, g) = (masses(&problem), scene.loads.gravity);
        let outside = (0..problem.nodes()).filter(|i| !inside.contains(i));
        let (mut force, mut moment) = ([0.0; 3], [0.0; 3]);
        for i in outside {
            let weight = g.map(|g| m[i] * g);
            force = sum(force, weight);
            moment = sum(moment, cross(rest.nodes[i], weight));
        }
        if let (Shape::Straight { length, .. }, true) = (&scene.rod.shape, inside.len() == 1) {
            let whole = 1273.52 * std::f64::consts::PI * 0.005_f64.powi(2) * length;
            // The supports carry the weight of the rod, `rho A L g`: rounding errors.
            assert!((force[1] / (g[1] * whole) - 1.0).abs() < 1e-12);
        }
        let last = problem.nodes() - 1;
        let middle = |a: usize, b: usize| sum(rest.nodes[a], rest.nodes[b]).map(|x| 0.5 * x);
        let point = |inner: usize, outer: usize| match inside.contains(&outer) {
            true => middle(inner, outer),
            false => rest.nodes[outer],
        };
        let ends =
            [(rest.reactions.start, point(1, 0)), (rest.reactions.end, point(last - 1, last))];
        for (Reaction { force: f, moment: m }, at) in ends {
            force = sum(force, f);
            moment = sum(moment, sum(m, cross(at, f)));
        }
        // Equilibrium of forces, N, and moments, N m.
        near(force, [0.0; 3], 1e-8);
        near(moment, [0.0; 3], 1e-8);
    }
}

/// A wall that turns one end of a straight rod about itself feels the torque of its twist.
#[test]
fn twisted_rod_exerts_moments_on_its_walls() {
    let mut scene = short();
    scene.loads.gravity = [0.0; 3];
    scene.material.shear_modulus = Some(4e7);
    scene.supports.end = Support::Clamped;
    scene.supports.motion = vec![Motion { twist: 0.3, end: End::End, ..Motion::default() }];
    let rest = scene.problem().unwrap().equilibrium().unwrap();
    let torsion_constant = std::f64::consts::PI * 0.005_f64.powi(4) / 2.0;
    let torque = 4e7 * torsion_constant * 0.3 / 0.5;
    // Torsion of a uniform shaft: `G J twist / L`, with the twist of 0.3 rad over 0.5 m.
    near(rest.reactions.end.moment, [torque, 0.0, 0.0], 1e-9 * torque);
    near(rest.reactions.start.moment, [-torque, 0.0, 0.0], 1e-9 * torque);
    near(rest.reactions.start.force, [0.0; 3], 1e-9);
}

/// Velocities, reactions and energies of a run are consistent. Momentum changes by reactions, weight and drag, by the
/// trapezoidal rule; kinetic energy is that of the velocities; an undamped rod conserves energy.
#[test]
fn reactions_velocities_and_energies_of_a_run_are_consistent() {
    let mut damped = short();
    damped.loads.damping.mass = 3.0;
    damped.loads.damping.stiffness = 2e-3;
    damped.time = Some(Time::new(0.1, 2e-4));
    let mut shaken = damped.clone();
    let shake = Motion {
        displacement: [0.0, 0.01, 0.0],
        rotation: [0.0, 0.0, 0.2],
        ramp: Some(0.05),
        end: End::Start,
        ..Motion::default()
    };
    shaken.supports.motion = vec![shake];
    let mut helix = helix_with(0.5, 1e-3, 0.05, Clamp::MidEdge);
    helix.material.poisson_ratio = Some(0.4);
    helix.rod.segments = Some(30);
    // Kelvin-Voigt forces are those of the mean strain rates over a step, the shaken wall's own
    // momentum is summed by the trapezoidal rule, and the helix's steps, stiff in stretch, are solved
    // to the rounding errors of that.
    for (scene, tolerance) in [(short(), 1e-9), (damped, 1e-3), (shaken, 1e-3), (helix, 1e-7)] {
        let (problem, drag) = (scene.problem().unwrap(), scene.loads.damping.mass);
        let (m, g) = (masses(&problem), scene.loads.gravity);
        let all: Vec<usize> = (0..problem.nodes()).collect();
        let mut run =
            Trajectory::new(&problem, &all, &[]).unwrap().keep_energies().keep_reactions();
        run.run(&problem, problem.time().unwrap().steps(), |_| {}).unwrap();
        let (times, reactions) = (run.times(), run.reactions());
        assert_eq!([run.energies().len(), reactions.len()], [times.len(); 2]);
        let momentum = |k: usize| {
            let of = |i: &usize| run.velocity(*i, k).map(|v| m[*i] * v);
            all[1..].iter().map(of).fold([0.0; 3], sum)
        };
        let whole: f64 = m[1..].iter().sum();
        let push = |k: usize| {
            let (r, p) = (reactions[k].start.force, momentum(k));
            [0, 1, 2].map(|c| r[c] + whole * g[c] - drag * p[c])
        };
        let size = (1..times.len()).map(|k| momentum(k)[1].abs().max(momentum(k)[2].abs()));
        let size = size.fold(0.0, f64::max);
        for k in 1..times.len() {
            let (before, now, h) = (push(k - 1), push(k), times[k] - times[k - 1]);
            let impulse = [0, 1, 2].map(|c| 0.5 * h * (before[c] + now[c]));
            near(sum(momentum(k - 1), impulse), momentum(k), tolerance * size);
        }
        if problem.planar().is_some() && scene.supports.motion.is_empty() {
            let k = times.len() / 2;
            let square = |i: usize| run.velocity(i, k).map(|v| v * v).iter().sum::<f64>();
            let kinetic: f64 = all[2..].iter().map(|i| 0.5 * m[*i] * square(*i)).sum();
            // Definition of the kinetic energy with lumped masses: rounding errors.
            assert!((run.energies()[k].kinetic / kinetic - 1.0).abs() < 1e-12);
        }
        if drag == 0.0 {
            let total = |k: usize| run.energies()[k].total();
            let most = run.energies().iter().map(|e| e.kinetic).fold(0.0, f64::max);
            // The scheme conserves energy up to its order in the step.
            assert!((0..times.len()).all(|k| (total(k) - total(0)).abs() < 0.02 * most));
        }
    }
    // Nothing is kept that was not asked for, and other schemes keep the same.
    let problem = short().problem().unwrap();
    let plain = problem.simulate().unwrap();
    assert!(plain.energies().is_empty() && plain.reactions().is_empty());
    let wall = |scheme: Scheme| {
        let mut scene = short();
        scene.time = Some(Time { scheme, ..Time::new(0.1, 2e-4) });
        let problem = scene.problem().unwrap();
        let mut run = Trajectory::new(&problem, &[], &[]).unwrap().keep_reactions();
        run.run(&problem, 500, |_| {}).unwrap();
        run.reactions()[500].start
    };
    let (one, other) = (wall(Scheme::NewmarkBeta), wall(Scheme::Rodas4));
    // Two schemes of different order agree to their errors in the step.
    near(one.force, other.force, 2e-2 * one.force[1].abs());
    near(one.moment, other.moment, 2e-2 * one.moment[2].abs());
}
