//! Follower loads and moments in space: equilibria against initial value problems and closed forms, order of the schemes,
//! balance of energy with the work of the loads, and flutter of Beck's column.

use rodfit::scene::*;
use std::f64::consts::PI;

use crate::common::{
    at_tip, distance, energy_change, last_tip, observed_order, rest, simulate, straight_rod,
    unit_rod,
};

/// A follower load on the tip: force and moment along and about tangent, first and second director.
fn follower(force: [f64; 3], moment: [f64; 3]) -> Vec<PointForce> {
    vec![PointForce { force, moment, follower: true, ..PointForce::default() }]
}

/// The unit rod in space, with Poisson's ratio 0.3.
fn spatial_rod(segments: usize) -> Scene {
    let mut scene = unit_rod(segments, 1e-3);
    scene.material.poisson_ratio = Some(0.3);
    scene.rod.dimension = Dimension::Spatial;
    scene
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|c| a[c] * b[c]).sum()
}

/// Tip of the clamped elastica of unit length and stiffness under a force at its tip with the components `along` and `across`
/// the tangent there: an initial value problem from the tip to the clamp, by Runge's method.
fn elastica_tip([along, across]: [f64; 2]) -> [f64; 2] {
    let rate = |[x, y, angle]: [f64; 3]| {
        let moment = -(x * across - y * along);
        [-angle.cos(), -angle.sin(), -moment]
    };
    let steps = 4000;
    let h = 1.0 / f64::from(steps);
    let moved = |y: [f64; 3], k: [f64; 3], h: f64| [0, 1, 2].map(|c| y[c] + h * k[c]);
    let mut y = [0.0; 3];
    for _ in 0..steps {
        let a = rate(y);
        let b = rate(moved(y, a, 0.5 * h));
        let c = rate(moved(y, b, 0.5 * h));
        let d = rate(moved(y, c, h));
        for (k, weight) in [(a, 1.0), (b, 2.0), (c, 2.0), (d, 1.0)] {
            y = moved(y, k, weight * h / 6.0);
        }
    }
    // From the axes of the tip to those of the clamp.
    let [x, z, angle] = y;
    let (sin, cos) = angle.sin_cos();
    [-(x * cos + z * sin), -(z * cos - x * sin)]
}

#[test]
fn tip_follower_force_equals_the_initial_value_problem() {
    for force in [[0.0, 2.0], [0.0, 8.0], [-6.0, 3.0], [4.0, -5.0], [0.0, 20.0]] {
        let [x, y] = elastica_tip(force);
        for spatial in [false, true] {
            let mut scene = unit_rod(200, 1e-3);
            scene.material.poisson_ratio = Some(0.3);
            // The plane of the force and the tangent is between the directors in space.
            let (sin, cos) = if spatial { 0.7_f64.sin_cos() } else { (0.0, 1.0) };
            scene.loads.point = follower([force[0], force[1] * cos, force[1] * sin], [0.0; 3]);
            if spatial {
                scene.rod.dimension = Dimension::Spatial;
            }
            let found = rest(&scene);
            assert_eq!(found.model, if spatial { "spatial" } else { "planar" });
            assert!(found.stable.is_none() && found.stable_in_plane.is_none());
            let off = distance(found.tip, [x, y * cos, y * sin]);
            println!("{force:?} {}: tip {x:.4} {y:.4}, off by {off:.1e}", found.model);
            assert!(off < 1e-3, "{force:?}: {:?} {x} {y}", found.tip);
        }
    }
}

/// Reactions balance the follower force: the force of the clamp is its negative, the moment that of its lever.
#[test]
fn reactions_balance_a_follower_force() {
    let mut scene = unit_rod(60, 1e-2);
    scene.loads.point = follower([1.0, 3.0, 0.0], [0.0; 3]);
    let found = rest(&scene);
    let tangent = {
        let [a, b] = [found.nodes[59], found.nodes[60]];
        let length = distance(a, b);
        [(b[0] - a[0]) / length, (b[1] - a[1]) / length]
    };
    let force = [tangent[0] - 3.0 * tangent[1], tangent[1] + 3.0 * tangent[0], 0.0];
    let moment = cross(found.tip, force);
    let start = found.reactions.start;
    for c in 0..3 {
        assert!((start.force[c] + force[c]).abs() < 1e-6, "{:?} {force:?}", start.force);
        assert!((start.moment[c] + moment[c]).abs() < 1e-6, "{:?} {moment:?}", start.moment);
    }
}

/// The tip of a rod whose tangent turns about the constant moment, by the angle `|M|/EI` per length, from the x axis.
fn rolled_tip(moment: [f64; 3]) -> [f64; 3] {
    let size = dot(moment, moment).sqrt();
    let axis = moment.map(|c| c / size);
    let start = [1.0, 0.0, 0.0];
    let along = dot(axis, start);
    let aside = cross(axis, start);
    let (sin, cos) = size.sin_cos();
    [0, 1, 2].map(|c| {
        let across = start[c] - along * axis[c];
        along * axis[c] + (across * sin + aside[c] * (1.0 - cos)) / size
    })
}

/// A moment on the tip about fixed axes or about the directors there rolls a straight rod into a helix.
#[test]
fn moment_in_space_rolls_a_rod_into_a_helix() {
    let twist_compliance = 2.0 * 1.3 / 2.0;
    for moment in [[0.0, 0.0, 2.0], [1.5, 2.0, -1.0], [-3.0, 1.0, 4.0]] {
        let mut scene = spatial_rod(100);
        scene.loads.point = vec![PointForce { moment, ..PointForce::default() }];
        let off = distance(rest(&scene).tip, rolled_tip(moment));
        println!("{moment:?} about fixed axes: off by {off:.1e}");
        assert!(off < 1e-3, "{moment:?}: {off:e}");
        // In the directors the bending moment of a twisted rod turns along it, to its value at the tip.
        let [torque, first, second] = moment;
        let turn = -torque * (1.0 - twist_compliance);
        let (sin, cos) = turn.sin_cos();
        let at_clamp = [torque, first * cos - second * sin, second * cos + first * sin];
        // They are those of the last edge, half an edge from the tip: an error of first order.
        let mut scene = spatial_rod(200);
        scene.loads.point = follower([0.0; 3], moment);
        let off = distance(rest(&scene).tip, rolled_tip(at_clamp));
        println!("{moment:?} about the directors: off by {off:.1e}");
        assert!(off < 1e-3, "{moment:?}: {off:e}");
    }
}

/// A load at an arc length between nodes: the equilibrium converges with the second order of the mesh.
#[test]
fn follower_force_between_nodes_converges_with_the_mesh() {
    let tip = |segments: usize| {
        let mut scene = unit_rod(segments, 1e-2);
        let node = Point::ArcLength(0.613);
        scene.loads.point = vec![PointForce {
            node,
            force: [-2.0, 6.0, 0.0],
            follower: true,
            ..PointForce::default()
        }];
        rest(&scene).tip
    };
    let exact = tip(320);
    let errors = [20, 40].map(|segments| distance(tip(segments), exact));
    println!("errors {errors:?}");
    assert!(errors[0] < 1e-2 && errors[1] < errors[0] / 3.0, "{errors:?}");
}

/// A rod under weight, a follower force and moment on its tip and a follower line load; in space with a fixed moment too.
fn driven(scheme: Scheme, step: f64, spatial: bool, timed: bool) -> Scene {
    let mut material = Material::new(1200.0, 2e6);
    material.poisson_ratio = Some(0.4);
    let mut scene = straight_rod(6, [0.3, 0.004], material);
    scene.loads.gravity = [0.0, -9.8, 0.0];
    let z = if spatial { 1.0 } else { 0.0 };
    let signal = timed.then(|| "s".to_string());
    scene.loads.point = follower([-0.01, 0.006, 0.004 * z], [5e-4 * z, 0.0, 4e-4]);
    scene.loads.point[0].signal.clone_from(&signal);
    if spatial {
        scene.rod.dimension = Dimension::Spatial;
        let moment = [3e-4, -4e-4, 2e-4];
        scene.loads.point.push(PointForce { moment, signal, ..PointForce::default() });
    }
    let force = [0.01, 0.03, -0.02 * z];
    scene.loads.line = vec![LineForce { from: 0.1, to: None, force, follower: true, signal: None }];
    if timed {
        scene.signals = vec![Signal {
            kind: Some(SignalKind::Sine),
            frequency: Some(12.0),
            phase: Some(0.4),
            ..Signal::new("s")
        }];
    }
    scene.time = Some(Time { scheme, ..Time::new(0.1, step) });
    scene
}

fn takes(scheme: Scheme, timed: bool) -> bool {
    !timed || scheme.traits().takes_timed_actuation
}

fn base_step(scheme: Scheme) -> f64 {
    match scheme {
        Scheme::Verlet | Scheme::Pefrl => 2.5e-5,
        Scheme::Rodas4 => 2.5e-4,
        _ => 1.25e-4,
    }
}

#[test]
fn order_of_schemes_with_follower_loads_is_theirs() {
    for timed in [false, true] {
        for scheme in Scheme::all().filter(|scheme| takes(*scheme, timed)) {
            let tip = |step: f64| {
                let mut scene = driven(scheme, step, false, timed);
                scene.initial.state = InitialState::Equilibrium;
                scene.initial.velocity = [0.0, 0.05, 0.0];
                scene.initial.angular_velocity = [0.0, 0.0, 1.0];
                scene.supports.start = Support::Pinned;
                last_tip(&scene)
            };
            let base = base_step(scheme);
            let tips = [base, base / 2.0, base / 4.0].map(tip);
            let order = observed_order(tips);
            println!("{scheme:?}, timed {timed}: order {order:.2}");
            let expected = if matches!(scheme, Scheme::Rodas4 | Scheme::Pefrl) { 4.0 } else { 2.0 };
            assert!(order > expected - 0.4, "{scheme:?}: {order}");
        }
    }
}

/// Energy less the work of the loads: constant to rounding with the average vector field; the defect of others falls fourfold
/// with half the step.
#[test]
fn energy_balance_includes_the_work_of_follower_loads() {
    for (spatial, timed) in [(false, false), (false, true), (true, false), (true, true)] {
        for scheme in Scheme::all().filter(|scheme| takes(*scheme, timed)) {
            let defect =
                |step: f64| energy_change(&driven(scheme, step, spatial, timed), |e| e.kinetic)[0];
            let averages = scheme == Scheme::AverageVectorField;
            let base = if averages { 1e-3 } else { base_step(scheme) };
            let [coarse, fine] = [base, base / 2.0].map(defect);
            println!("{scheme:?}, spatial {spatial}, timed {timed}: {coarse:.1e}, {fine:.1e}");
            match averages {
                true => assert!(coarse < 1e-9, "{coarse:e}"),
                false => {
                    assert!(fine < coarse / 3.0 || fine < 1e-9, "{scheme:?}: {coarse:e} {fine:e}")
                }
            }
        }
    }
}

/// Beck's column released from a tiny deflection: bounded below the flutter load, growing above it.
#[test]
fn beck_column_flutters_above_its_critical_load() {
    let amplitudes = |load: f64| {
        let mut scene = unit_rod(40, 5e-3);
        scene.loads.point = follower([-load, 0.0, 0.0], [0.0; 3]);
        scene.initial.point = at_tip([0.0, 1e-9, 0.0]);
        scene.initial.state = InitialState::Equilibrium;
        // The lowest frequency of the unloaded rod is 3.52/s times this.
        let unit = (1.0 / (PI * 5e-3_f64.powi(2))).sqrt();
        let step = 0.02 / unit;
        let scheme = Scheme::AverageVectorField;
        scene.time = Some(Time { scheme, ..Time::new(16.0 / unit, step) });
        let run = simulate(&scene);
        let most =
            |from: usize, to: usize| (from..to).map(|k| run.tip(k)[1].abs()).fold(0.0, f64::max);
        let steps = run.times().len();
        [most(0, steps / 4), most(3 * steps / 4, steps)]
    };
    for (load, grows) in [(19.6, false), (20.5, true)] {
        let [early, late] = amplitudes(load);
        println!("P = {load}: tip {early:.2e}, later {late:.2e}");
        assert_eq!(late > 4.0 * early, grows, "{load}: {early:e} {late:e}");
    }
}

/// What no potential has is refused by name.
#[test]
fn unsupported_follower_loads_are_refused_with_their_key() {
    let refusal = |change: &dyn Fn(&mut Scene)| {
        let mut scene = driven(Scheme::NewmarkBeta, 1e-3, false, true);
        change(&mut scene);
        scene.problem().unwrap_err().to_string()
    };
    let message = refusal(&|scene| {
        scene.time = Some(Time { scheme: Scheme::Rodas4, ..Time::new(0.1, 1e-4) });
    });
    assert!(message.contains("loads.point[0].signal"), "{message}");
    let message = refusal(&|scene| {
        scene.initial.state = InitialState::Equilibrium;
        scene.initial.point = follower([1e-3, 0.0, 0.0], [0.0; 3]);
    });
    assert!(message.contains("initial.point[0].follower"), "{message}");
    let message = refusal(&|scene| {
        scene.rod.dimension = Dimension::Spatial;
        scene.initial.state = InitialState::Equilibrium;
        scene.initial.point =
            vec![PointForce { moment: [0.0, 0.0, 1e-4], ..PointForce::default() }];
    });
    assert!(message.contains("initial.point[0].moment"), "{message}");
    let message = refusal(&|scene| {
        scene.rod.dimension = Dimension::Planar;
        scene.loads.point[0].force[2] = 1.0;
    });
    assert!(message.contains("loads.point[0].force"), "{message}");
}
