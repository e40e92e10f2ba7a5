//! Actuators: natural strains against those of the rod and closed forms, tendons in the plane against constant curvature and
//! in space against the boundary value problem of Rucker and Webster (2011), and the balance of energy with their work.

use rodfit::Trajectory;
use rodfit::scene::*;
use std::f64::consts::PI;

use crate::common::{
    at_tip, distance, energy_change, last_tip, observed_order, rest, simulate, straight_rod,
};

const LENGTH: f64 = 0.3;
const RADIUS: f64 = 0.004;
const MODULUS: f64 = 2e6;

/// A straight rod along x without weight, clamped at its start.
fn straight(segments: usize) -> Scene {
    let mut scene = straight_rod(segments, [LENGTH, RADIUS], Material::new(1200.0, MODULUS));
    scene.material.poisson_ratio = Some(0.4);
    scene
}

fn area() -> f64 {
    PI * RADIUS.powi(2)
}

fn bending_stiffness() -> f64 {
    MODULUS * PI / 4.0 * RADIUS.powi(4)
}

/// An actuator of the whole rod with a constant value.
fn curvature(component: ActuatedStrain, gain: f64) -> Actuation {
    Actuation::Curvature { component, from: 0.0, to: None, signal: None, gain }
}

/// A tendon of constant tension, N, through the points `(at, offset)`.
fn tendon(tension: f64, route: &[(f64, [f64; 2])]) -> Actuation {
    let point = |(at, offset): &(f64, [f64; 2])| RoutePoint { at: *at, offset: *offset };
    let tension = Tension::Constant(tension);
    Actuation::Tendon { tension, route: route.iter().map(point).collect() }
}

/// Positions of all nodes in equilibrium, m.
fn nodes(scene: &Scene) -> Vec<[f64; 3]> {
    let problem = scene.problem().unwrap();
    let all: Vec<usize> = (0..problem.nodes()).collect();
    let run = Trajectory::at_rest(&problem, &all, &[]).unwrap();
    (0..all.len()).map(|i| run.node(i, 0)).collect()
}

fn largest_distance(a: &[[f64; 3]], b: &[[f64; 3]]) -> f64 {
    a.iter().zip(b).map(|(a, b)| distance(*a, *b)).fold(0.0, f64::max)
}

/// In space the change of curvature and twist is that of `natural_bending` and `natural_twist` of the same size.
#[test]
fn actuated_strains_equal_natural_strains_of_the_same_size() {
    let mut natural = straight(40);
    natural.rod.dimension = Dimension::Spatial;
    natural.rod.discretization = Some(Discretization::Paper);
    natural.loads.gravity = [0.0, -9.8, 2.0];
    let mut actuated = natural.clone();
    natural.rod.natural_bending = vec![[2.0, -3.0]];
    natural.rod.natural_twist = 4.0.into();
    actuated.actuation = vec![
        curvature(ActuatedStrain::D1, 2.0),
        curvature(ActuatedStrain::D2, -3.0),
        curvature(ActuatedStrain::Twist, 4.0),
    ];
    let apart = largest_distance(&nodes(&natural), &nodes(&actuated));
    println!("apart by {apart:.1e} m");
    assert!(apart < 1e-9 * LENGTH, "{apart:e}");
}

/// In the plane, a part with the actuated curvature k and strain e is an arc of the length (1 + e) l between straight parts.
#[test]
fn planar_actuator_of_a_part_gives_an_arc() {
    // The mesh has nodes at 19.5 edges: the part begins and ends in the middles of edges.
    let edge = LENGTH / 39.5;
    let [from, to] = [10.0 * edge, 30.0 * edge];
    for (component, sign) in [(ActuatedStrain::D1, 1.0), (ActuatedStrain::D2, 1.0)] {
        let mut scene = straight(40);
        // The half edge behind the wall does not stretch: the strain is small.
        let (gain, strain) = (5.0, 0.003);
        scene.actuation = vec![
            Actuation::Curvature { component, from, to: Some(to), signal: None, gain },
            curvature(ActuatedStrain::Stretch, strain),
        ];
        let angle = gain * (to - from);
        let [before, arc, after] = [from, to - from, LENGTH - to].map(|l| l * (1.0 + strain));
        let radius = arc / angle;
        let along = before + radius * angle.sin() + after * angle.cos();
        let aside = sign * (radius * (1.0 - angle.cos()) + after * angle.sin());
        let problem = scene.problem().unwrap();
        assert!(problem.planar().is_some(), "{:?}", problem.model());
        let tip = rest(&scene).tip;
        let exact = match component {
            ActuatedStrain::D1 => [along, aside, 0.0],
            _ => [along, 0.0, aside],
        };
        let off = distance(tip, exact);
        println!("{component:?}: tip {tip:?}, off by {:.1e} of the length", off / LENGTH);
        assert!(off < 1e-4 * LENGTH, "{off:e}");
    }
}

/// A tendon beside a straight backbone: curvature T r/EI and strain -T/EA per rest length, in the plane and in space.
#[test]
fn tendon_along_a_backbone_gives_constant_curvature_and_strain() {
    let (tension, offset) = (0.6, 0.003);
    let bend = tension * offset / bending_stiffness();
    let strain = -tension / (MODULUS * area());
    let angle = bend * LENGTH;
    assert!(angle > 1.0 && strain < -5e-3, "{angle} {strain}");
    let radius = (1.0 + strain) / bend;
    let exact = [radius * angle.sin(), radius * (1.0 - angle.cos()), 0.0];
    for dimension in [Dimension::Auto, Dimension::Spatial] {
        let mut scene = straight(60);
        scene.rod.dimension = dimension;
        scene.actuation = vec![tendon(tension, &[(0.0, [offset, 0.0]), (LENGTH, [offset, 0.0])])];
        assert_eq!(scene.problem().unwrap().planar().is_some(), dimension == Dimension::Auto);
        let off = distance(rest(&scene).tip, exact);
        println!("{dimension:?}: off by {:.1e} of the length", off / LENGTH);
        assert!(off < 1e-4 * LENGTH, "{off:e}");
    }
}

type Vector = [f64; 3];

fn cross(a: Vector, b: Vector) -> Vector {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn dot(a: Vector, b: Vector) -> f64 {
    (0..3).map(|c| a[c] * b[c]).sum()
}

/// The Cosserat rod of Rucker and Webster with one tendon of the helical route `r(s)`, under a dead force at its tip: its
/// shape by shooting for the moment at the clamp. The rod does not shear.
struct Reference {
    tension: f64,
    force: Vector,
    /// Offsets, and their derivatives, at an arc length.
    route: fn(f64) -> [[f64; 2]; 2],
}

impl Reference {
    /// Curvatures and twist about the directors, and the stretch, at a moment and an axial force, both of rod and tendon.
    fn strains(&self, s: f64, moment: Vector, axial: f64) -> (Vector, f64) {
        let [[r1, r2], [d1, d2]] = (self.route)(s);
        let r = [r1, r2, 0.0];
        let bending = bending_stiffness();
        let stiffness = [bending, bending, bending / 1.4];
        let (mut turns, mut stretch) = ([0.0; 3], 1.0);
        for _ in 0..60 {
            let turned = cross(turns, r);
            let path = [turned[0] + d1, turned[1] + d2, turned[2] + stretch];
            let size = dot(path, path).sqrt();
            let along = path.map(|p| p / size);
            let lever = cross(r, along);
            for c in 0..3 {
                turns[c] = (moment[c] - self.tension * lever[c]) / stiffness[c];
            }
            stretch = 1.0 + (axial - self.tension * along[2]) / (MODULUS * area());
        }
        (turns, stretch)
    }

    /// The derivative of position and directors by arc length.
    fn rate(&self, s: f64, state: [Vector; 4], tip_moment: Vector, start: Vector) -> [Vector; 4] {
        let [x, d1, d2, d3] = state;
        // The moment of rod and tendon: that at the clamp less that of the force.
        let lever = cross([0, 1, 2].map(|c| x[c] - start[c]), self.force);
        let moment = [0, 1, 2].map(|c| tip_moment[c] - lever[c]);
        let local = [dot(moment, d1), dot(moment, d2), dot(moment, d3)];
        let (turns, stretch) = self.strains(s, local, dot(self.force, d3));
        let spin = [0, 1, 2].map(|c| turns[0] * d1[c] + turns[1] * d2[c] + turns[2] * d3[c]);
        [d3.map(|c| c * stretch), cross(spin, d1), cross(spin, d2), cross(spin, d3)]
    }

    /// The tip for a moment at the clamp, by 400 steps of the classical Runge-Kutta method.
    fn tip(&self, clamp_moment: Vector) -> Vector {
        let mut y = [[0.0; 3], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]];
        let steps = 400;
        let h = LENGTH / f64::from(steps);
        let moved = |y: [Vector; 4], k: [Vector; 4], h: f64| {
            [0, 1, 2, 3].map(|i| [0, 1, 2].map(|c| y[i][c] + h * k[i][c]))
        };
        for step in 0..steps {
            let s = f64::from(step) * h;
            let f = |s: f64, y: [Vector; 4]| self.rate(s, y, clamp_moment, [0.0; 3]);
            let a = f(s, y);
            let b = f(s + 0.5 * h, moved(y, a, 0.5 * h));
            let c = f(s + 0.5 * h, moved(y, b, 0.5 * h));
            let d = f(s + h, moved(y, c, h));
            for (k, weight) in [(a, 1.0), (b, 2.0), (c, 2.0), (d, 1.0)] {
                y = moved(y, k, weight * h / 6.0);
            }
        }
        y[0]
    }

    /// The tip of the rod whose moment at the tip is zero, with that of the tendon included.
    fn solve(&self) -> Vector {
        let mut moment = [0.0; 3];
        for _ in 0..200 {
            let wanted = cross(self.tip(moment), self.force);
            moment = [0, 1, 2].map(|c| 0.5 * (moment[c] + wanted[c]));
        }
        let tip = self.tip(moment);
        let left = distance(cross(tip, self.force), moment);
        assert!(left < 1e-12, "{left:e}");
        tip
    }
}

/// A helical tendon, and one that comes nearer to the center line, against the boundary value problem.
#[test]
fn tendon_in_space_equals_the_boundary_value_problem() {
    const TURN: f64 = 1.5 * PI / LENGTH;
    let helix: fn(f64) -> [[f64; 2]; 2] = |s| {
        let (sin, cos) = (TURN * s).sin_cos();
        [[0.003 * cos, 0.003 * sin], [-0.003 * TURN * sin, 0.003 * TURN * cos]]
    };
    let cone: fn(f64) -> [[f64; 2]; 2] = |s| {
        let part = s / LENGTH;
        [[0.0035 - 0.002 * part, 0.001 * part], [-0.002 / LENGTH, 0.001 / LENGTH]]
    };
    for (name, route, points) in [("helix", helix, 48), ("cone", cone, 1)] {
        let reference = Reference { tension: 0.5, force: [0.0, -4e-3, 3e-3], route };
        let exact = reference.solve();
        let mut scene = straight(100);
        scene.loads.point = at_tip(reference.force);
        let point = |k: i32| {
            let s = LENGTH * f64::from(k) / f64::from(points);
            (s, route(s)[0])
        };
        scene.actuation = vec![tendon(0.5, &(0..=points).map(point).collect::<Vec<_>>())];
        let tip = rest(&scene).tip;
        let off = distance(tip, exact);
        println!("{name}: tip {tip:?}, reference {exact:?}, off by {:.1e} L", off / LENGTH);
        assert!(distance(tip, [LENGTH, 0.0, 0.0]) > 0.2 * LENGTH);
        assert!(off < 1e-3 * LENGTH, "{name}: {off:e}");
    }
}

/// A rod that an actuated curvature or a tendon moves, with the sine `s`.
fn moved(scheme: Scheme, step: f64, pulled: bool) -> Scene {
    let mut scene = straight(6);
    scene.loads.gravity = [0.0, -9.8, 0.0];
    scene.loads.point = at_tip([0.0, 0.004, 0.0]);
    let sine = Signal {
        kind: Some(SignalKind::Sine),
        frequency: Some(12.0),
        phase: Some(0.4),
        ..Signal::new("s")
    };
    scene.signals = vec![Signal { gain: if pulled { 0.3 } else { 1.0 }, ..sine }];
    let signal = Some("s".to_string());
    scene.actuation = match pulled {
        true => {
            let offset = [0.003, 0.0];
            let route =
                vec![RoutePoint { at: 0.0, offset }, RoutePoint { at: 0.8 * LENGTH, offset }];
            vec![Actuation::Tendon { tension: Tension::Signal("s".into()), route }]
        }
        false => {
            let component = ActuatedStrain::D1;
            vec![Actuation::Curvature { component, from: 0.05, to: None, signal, gain: 4.0 }]
        }
    };
    scene.time = Some(Time { scheme, ..Time::new(0.1, step) });
    scene
}

fn takers() -> impl Iterator<Item = Scheme> {
    Scheme::all().filter(|scheme| scheme.traits().takes_timed_actuation)
}

/// The order in the step under an actuator that follows a sine is that of the scheme.
#[test]
fn order_of_schemes_with_actuators_is_two() {
    for pulled in [false, true] {
        for scheme in takers() {
            let base = if scheme == Scheme::Verlet { 2.5e-5 } else { 1.25e-4 };
            let tip = |step: f64| {
                // From rest a sudden tension would excite vibrations that the steps do not resolve.
                let mut scene = moved(scheme, step, pulled);
                scene.initial.state = InitialState::Equilibrium;
                last_tip(&scene)
            };
            let tips = [base, base / 2.0, base / 4.0].map(tip);
            let order = observed_order(tips);
            println!("{scheme:?}, tendon {pulled}: order {order:.2}");
            assert!((order - 2.0).abs() < 0.2, "{scheme:?}: {order}");
        }
    }
}

/// Energy less the work of the actuators: constant to rounding with the average vector field and actuated curvature; the
/// defect of others falls fourfold with half the step.
#[test]
fn energy_balance_includes_the_work_of_actuators() {
    for pulled in [false, true] {
        for scheme in takers() {
            let defect = |step: f64| energy_change(&moved(scheme, step, pulled), |e| e.kinetic)[0];
            let base = if scheme == Scheme::Verlet { 2.5e-5 } else { 1e-3 };
            let [coarse, fine] = [base, base / 2.0].map(defect);
            println!("{scheme:?}, tendon {pulled}: defect {coarse:.1e}, {fine:.1e}");
            match (scheme, pulled) {
                (Scheme::AverageVectorField, false) => assert!(coarse < 1e-9, "{coarse:e}"),
                (Scheme::AverageVectorField, true) => assert!(coarse < 1e-6, "{coarse:e}"),
                _ => assert!(fine < coarse / 3.4, "{scheme:?}: {coarse:e} {fine:e}"),
            }
        }
    }
}

/// A viscous rod comes to rest at the equilibrium of the last value of the signal.
#[test]
fn viscous_rod_ends_at_the_equilibrium_of_the_actuator() {
    for pulled in [false, true] {
        for scheme in [Scheme::NewmarkBeta, Scheme::GeneralisedAlpha, Scheme::AverageVectorField] {
            let mut scene = moved(scheme, 5e-3, pulled);
            scene.loads.damping = Damping { mass: 5.0, stiffness: 5e-3, ..Damping::default() };
            (scene.signals[0].frequency, scene.signals[0].phase) = (None, None);
            scene.signals[0].kind = Some(SignalKind::Ramp);
            scene.signals[0].duration = Some(0.5);
            scene.initial.state = InitialState::Equilibrium;
            scene.time = Some(Time { scheme, ..Time::new(4.0, 5e-3) });
            let run = simulate(&scene);
            scene.loads.at_time = 4.0;
            let (end, start) = (rest(&scene).tip, run.tip(0));
            let off = distance(run.tip(run.times().len() - 1), end);
            println!("{scheme:?}: off by {off:.1e} m of {:.1e}", distance(start, end));
            // Remainder of the motion after 3.5 s at the rate of 2.5 1/s.
            assert!(off < 2e-3 * distance(start, end), "{scheme:?}: {off:e}");
        }
    }
}

/// Actuators that do not fit the scene are rejected with key, found and allowed value.
#[test]
fn unsuitable_actuators_are_rejected() {
    type Change = fn(&mut Scene);
    let cases: [(Change, &str); 8] = [
        (|scene| scene.signals.clear(), "actuation[0].signal"),
        (
            |scene| {
                if let Actuation::Curvature { from, to, .. } = &mut scene.actuation[0] {
                    (*from, *to) = (2.0, Some(3.0));
                }
            },
            "actuation[0].from",
        ),
        (
            |scene| {
                scene.actuation = vec![Actuation::Tendon {
                    tension: Tension::Signal("none".into()),
                    route: Vec::new(),
                }];
            },
            "actuation[0].tension",
        ),
        (
            |scene| scene.actuation = vec![tendon(1.0, &[(0.1, [0.0; 2]), (0.1, [0.0; 2])])],
            "actuation[0].route",
        ),
        (
            |scene| {
                scene.signals.clear();
                scene.actuation = vec![tendon(1.0, &[(0.1, [0.0; 2]), (0.4, [0.0; 2])])];
            },
            "actuation[0].route",
        ),
        (
            |scene| {
                if let Actuation::Curvature { to, .. } = &mut scene.actuation[0] {
                    *to = Some(0.04);
                }
            },
            "actuation[0].to",
        ),
        (
            |scene| {
                scene.actuation = vec![curvature(ActuatedStrain::Stretch, 0.1)];
                scene.material.stretch_law = StretchLaw::NeoHookean;
                scene.material.poisson_ratio = Some(0.5);
            },
            "actuation[0].component",
        ),
        (
            |scene| {
                scene.time = Some(Time { scheme: Scheme::Rodas4, ..Time::new(0.1, 1e-3) });
            },
            "actuation[0].signal",
        ),
    ];
    for (change, key) in cases {
        let mut scene = moved(Scheme::NewmarkBeta, 1e-3, false);
        change(&mut scene);
        let message = scene.problem().unwrap_err().to_string();
        println!("{message}");
        assert!(message.contains(&format!("{key}: found")), "{key}: {message}");
        assert!(message.contains("allowed"), "{message}");
    }
}

/// Two tendons of the same tension at the same distance on both sides compress the rod and do not bend it.
#[test]
fn opposite_tendons_compress_without_bending() {
    let mut scene = straight(20);
    let beside = |r: f64| tendon(0.2, &[(0.0, [0.0, r]), (LENGTH, [0.0, r])]);
    scene.actuation = vec![beside(0.003), beside(-0.003)];
    let strain = 0.4 / (MODULUS * area());
    let off = distance(rest(&scene).tip, [LENGTH * (1.0 - strain), 0.0, 0.0]);
    assert!(off < 1e-9 * LENGTH, "{off:e}");
}
