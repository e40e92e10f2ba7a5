//! Rollers, moments, moving ends, twisted walls and initial velocities, against theory.

use rodfit::scene::{
    End, Initial, InitialState, Material, Motion, PointForce, Scene, Section, Shape, Support, Time,
};
use rodfit::{Equilibrium, Parameter, Point};
use std::f64::consts::PI;

use crate::common::fits::{fit, observe, value};
use crate::common::{at_tip, rest, simulate, unit_rod};

/// A constant moment of 2 pi EI/L at its end rolls a cantilever into a circle, and half of it into
/// a half circle; a potential of -M phi counts the whole turn.
#[test]
fn moment_bends_a_rod_into_a_circle() {
    for (turn, exact) in [(PI, [0.0, 2.0 / PI]), (2.0 * PI, [0.0, 0.0]), (4.0 * PI, [0.0, 0.0])] {
        let errors = [50, 100, 200].map(|segments| {
            let mut scene = unit_rod(segments, 1e-3);
            // Nothing is said of what happens out of the plane, even where torsion is known.
            scene.material.poisson_ratio = Some(0.3);
            scene.loads.point =
                vec![PointForce { moment: [0.0, 0.0, turn], ..PointForce::default() }];
            let found = rest(&scene);
            assert_eq!((found.model.as_str(), found.stable_in_plane), ("planar", Some(true)));
            assert_eq!(found.stable, None);
            assert!(found.to_string().contains("shear modulus, no moment"), "{found}");
            let [x, y, _] = found.tip;
            // E = M^2 L/(2 EI), and the potential takes twice as much.
            let energy = found.energy / (-0.5 * turn * turn) - 1.0;
            assert!(energy.abs() < 0.05, "{energy}");
            (x - exact[0]).hypot(y - exact[1])
        });
        let order = (errors[1] / errors[2]).log2();
        println!("turn {turn:.3}: {errors:?}, order {order:.2}");
        // Second order in the mesh, against the circle of radius EI/M.
        assert!(errors[2] < 4e-3 && order > 1.9, "{errors:?}");
    }
}

/// Two opposite moments at inner nodes: only the part between them bends.
#[test]
fn moment_acts_at_its_node() {
    let mut scene = unit_rod(40, 1e-3);
    scene.supports.clamp = rodfit::scene::Clamp::Nodes;
    let at = |node, m| PointForce {
        node: Point::Node(node),
        force: [0.0; 3],
        moment: [0.0, 0.0, m],
        ..PointForce::default()
    };
    scene.loads.point = vec![at(10, -1.0), at(30, 1.0)];
    let found = rest(&scene);
    let angle = |j: usize| {
        let [a, b] = [found.nodes[j], found.nodes[j + 1]];
        (b[1] - a[1]).atan2(b[0] - a[0])
    };
    println!("{found}");
    // Outside of the moments the rod is straight; between them its angle is M s/EI.
    assert!(angle(8).abs() < 1e-9);
    assert!((angle(35) / 0.5 - 1.0).abs() < 1e-3, "{}", angle(35));
    let [left, right] = [angle(10) - angle(9), angle(30) - angle(29)];
    // The turning angle of a joint is the curvature times the edge length, 0.025.
    assert!((left - right).abs() < 1e-9 && (left / (0.5 * 0.025) - 1.0).abs() < 1e-3, "{left}");
}

/// Complete elliptic integrals K and E of a modulus, by the arithmetic-geometric mean.
fn elliptic(modulus: f64) -> [f64; 2] {
    let (mut a, mut b) = (1.0_f64, (1.0 - modulus * modulus).sqrt());
    let (mut c, mut power, mut sum) = (modulus, 0.5, 0.5 * modulus * modulus);
    while c.abs() > 1e-16 {
        (a, b, c) = (0.5 * (a + b), (a * b).sqrt(), 0.5 * (a - b));
        power *= 2.0;
        sum += power * c * c;
    }
    let k = PI / (2.0 * a);
    [k, k * (1.0 - sum)]
}

/// A hinged column on a roller: P = (2 K)^2 EI/L^2 where its ends turn by alpha, its ends come
/// together by 2 (1 - E/K) L and it bows by 2 k/K L/2... in whatever direction the roller lies.
#[test]
fn post_buckled_rod_between_hinges_equals_the_elastica() {
    for (rolling, direction) in
        [(End::End, [1.0, 0.0, 0.0]), (End::Start, [1.0, 0.0, 0.0]), (End::End, [0.6, 0.8, 0.0])]
    {
        for degrees in [20.0_f64, 60.0, 90.0, 120.0] {
            let modulus = (0.5 * degrees.to_radians()).sin();
            let [k, e] = elliptic(modulus);
            let exact = [2.0 * e / k - 1.0, modulus / k];
            let errors = [50, 100, 200].map(|segments| {
                let mut scene = unit_rod(segments, 1e-4);
                scene.rod.shape = Shape::Straight { length: 1.0, direction };
                (scene.supports.start, scene.supports.end) = match rolling {
                    End::End => (Support::Pinned, Support::Roller),
                    End::Start => (Support::Roller, Support::Pinned),
                };
                let push = 4.0 * k * k * if rolling == End::End { -1.0 } else { 1.0 };
                let node = if rolling == End::End { Point::Tip } else { Point::Node(0) };
                let [x, y, _] = direction;
                let side = [-y, x].map(|c| 1e-6 * c);
                scene.loads.point = vec![
                    PointForce { node, force: direction.map(|c| c * push), ..Default::default() },
                    PointForce {
                        node: Point::Node(segments / 2),
                        force: [side[0], side[1], 0.0],
                        ..Default::default()
                    },
                ];
                let found = rest(&scene);
                assert_eq!(found.stable_in_plane, Some(true), "{found}");
                let (first, last) = (found.nodes[0], found.nodes[segments]);
                let span = (last[0] - first[0]) * x + (last[1] - first[1]) * y;
                let across = (last[0] - first[0]) * y - (last[1] - first[1]) * x;
                // A roller moves along its line only.
                assert!(across.abs() < 1e-12, "the roller keeps its line: {across}");
                let bow = found.nodes.iter().map(|p| (p[1] - first[1]) * x - (p[0] - first[0]) * y);
                let bow = bow.fold(0.0, f64::max);
                (span - exact[0]).abs().max((bow - exact[1]).abs())
            });
            let order = (errors[1] / errors[2]).log2();
            println!("{rolling:?} {direction:?} {degrees}: {errors:?}, order {order:.2}");
            // Second order in the mesh, against the elastica.
            assert!(errors[2] < 1e-3 && order > 1.9, "{errors:?}");
        }
    }
}

/// A roller in space: a hinged column on it buckles at pi^2 EI/L^2 in either direction across.
#[test]
fn roller_in_space_moves_along_its_line() {
    let mut scene = unit_rod(100, 1e-3);
    scene.rod.shape = Shape::Straight { length: 1.0, direction: [1.0, 2.0, 2.0] };
    scene.rod.dimension = rodfit::scene::Dimension::Spatial;
    scene.material.poisson_ratio = Some(0.3);
    (scene.supports.start, scene.supports.end) = (Support::Pinned, Support::Roller);
    for (push, down) in [(0.99, 0), (1.01, 2)] {
        let force = [1.0, 2.0, 2.0].map(|c| -c / 3.0 * push * PI * PI);
        scene.loads.point = at_tip(force);
        let found = rest(&scene);
        assert_eq!(found.negative_directions, down, "{push}: {found}");
        let tip = found.tip;
        // The tip moves along the direction (1, 2, 2)/3 of the roller.
        assert!((tip[1] / tip[0] - 2.0).abs() < 1e-9 && (tip[2] - tip[1]).abs() < 1e-9);
    }
}

/// A cantilever whose wall shakes it: the steady swing of its tip against linear theory.
#[test]
fn cantilever_on_a_shaken_wall_follows_theory() {
    let (frequency, drag) = (1.5, 3.0);
    let mut scene = unit_rod(50, 1e-3);
    // Without the inertia of turning sections, EI/(rho A) = 1.
    scene.material.density = 1.0 / (PI * 1e-6);
    scene.loads.damping.mass = drag;
    scene.supports.motion = vec![Motion {
        end: End::Start,
        displacement: [0.0, 1e-4, 0.0],
        frequency: Some(frequency),
        ..Motion::default()
    }];
    scene.time = Some(Time::new(6.0, 2e-3));
    let run = simulate(&scene);
    // Damped by -c v of the whole motion: lambda^4 = w^2 - i c w, complex; tip over wall is
    // (cos + cosh)/(1 + cos cosh) of lambda.
    let w = 2.0 * PI * frequency;
    let square = Complex(w * w, -drag * w);
    let lambda = square.sqrt().sqrt();
    let (cos, cosh) = (lambda.cos(), lambda.cosh());
    let ratio = cos.add(cosh).over(Complex(1.0, 0.0).add(cos.times(cosh)));
    let exact = ratio.0.hypot(ratio.1);
    let swing = (0..200)
        .map(|k| run.at(Point::Tip, 4.0 + k as f64 / 100.0).unwrap().0[1].abs())
        .fold(0.0, f64::max);
    println!("shaken wall: {:.5} of its own swing, theory {exact:.5}", swing / 1e-4);
    // Linear theory of the damped beam on a moving support.
    assert!((swing / 1e-4 / exact - 1.0).abs() < 5e-3);
    // The wall itself is where it should be, at the middle of its edge.
    let t = 3.1;
    let [a, b] = [0, 1].map(|i| run.at(Point::Node(i), t).unwrap().0[1]);
    let wall = 1e-4 * (w * t).sin();
    assert!((0.5 * (a + b) - wall).abs() < 1e-7, "{a} {b} {wall}");
}

#[derive(Clone, Copy)]
struct Complex(f64, f64);

impl Complex {
    fn add(self, b: Self) -> Self {
        Self(self.0 + b.0, self.1 + b.1)
    }
    fn times(self, b: Self) -> Self {
        Self(self.0 * b.0 - self.1 * b.1, self.0 * b.1 + self.1 * b.0)
    }
    fn over(self, b: Self) -> Self {
        let n = b.0 * b.0 + b.1 * b.1;
        self.times(Self(b.0 / n, -b.1 / n))
    }
    fn sqrt(self) -> Self {
        let r = self.0.hypot(self.1).sqrt();
        let angle = 0.5 * self.1.atan2(self.0);
        Self(r * angle.cos(), r * angle.sin())
    }
    fn cosh(self) -> Self {
        Self(self.0.cosh() * self.1.cos(), self.0.sinh() * self.1.sin())
    }
    fn cos(self) -> Self {
        Self(-self.1, self.0).cosh()
    }
}

/// A rod drawn tight between walls, the one turned against the other about the rod, by many turns
/// and by more than half a turn a joint: the twist spreads evenly and its energy counts every turn.
/// The tension of 4e4 keeps it straight: M^2/(4 EI) is 1.5e4.
#[test]
fn twisted_end_has_the_torque_of_theory() {
    for (segments, turns) in [(50, 50.0), (5, 20.0)] {
        let mut scene = unit_rod(segments, 1e-3);
        scene.material.poisson_ratio = Some(0.3);
        scene.supports.end = Support::Clamped;
        let twist = 2.0 * PI * turns;
        let (displacement, ramp) = ([0.01, 0.0, 0.0], Some(4e-3));
        scene.supports.motion = vec![Motion { twist, displacement, ramp, ..Motion::default() }];
        let found = rest(&scene);
        let exact = 0.5 * (1.0 / 1.3) * twist * twist;
        // Between the middles of the outermost edges lies the whole rod.
        println!("{turns} turns: {:.3e}", found.energies.twist / exact - 1.0);
        assert!((found.energies.twist / exact - 1.0).abs() < 1e-9);
        assert_eq!((found.model.as_str(), found.stable), ("spatial", Some(true)));
        // In two steps of implicit Euler.
        scene.time = Some(Time { beta: 1.0, ..Time::new(0.4, 2e-3) });
        let mut twists = Vec::new();
        let problem = scene.problem().unwrap();
        let mut run = rodfit::Trajectory::new(&problem, &[0], &[]).unwrap();
        run.run(&problem, 200, |now| twists.push(now.energies().twist)).unwrap();
        let last = twists[twists.len() - 1];
        println!("thrown: {:.3e}", last / exact - 1.0);
        // Energy of a uniformly twisted shaft, `G J twist^2/(2 L)`.
        assert!((last / exact - 1.0).abs() < 1e-3);
    }
}

/// Moved slowly, a wall carries its rod along and turns it as a rigid body.
#[test]
fn rotated_wall_carries_its_rod() {
    let mut scene = unit_rod(20, 1e-2);
    scene.rod.shape = Shape::Helix {
        length: 1.0,
        radius: 0.1,
        pitch: 0.2,
        axis: [0.0, 0.0, -1.0],
        handedness: rodfit::scene::Handedness::Left,
    };
    scene.material.poisson_ratio = Some(0.3);
    let still = rest(&scene);
    let turn = [0.3, -2.0, 1.1];
    let shift = [0.5, 0.1, -0.7];
    scene.supports.motion = vec![Motion {
        end: End::Start,
        displacement: shift,
        rotation: turn,
        ramp: Some(1.0),
        ..Motion::default()
    }];
    let moved = rest(&scene);
    // The rod is carried as a rigid body: no elastic energy.
    assert!(moved.energies.bend + moved.energies.twist < 1e-16, "{:?}", moved.energies);
    let rotation = nalgebra::Rotation3::new(turn.into());
    let point = |e: &Equilibrium, i: usize| nalgebra::Vector3::from(e.nodes[i]);
    let wall = 0.5 * (point(&still, 0) + point(&still, 1));
    for i in 0..=20 {
        let there = wall + nalgebra::Vector3::from(shift) + rotation * (point(&still, i) - wall);
        // Rigid displacement and rotation about the wall.
        assert!((point(&moved, i) - there).norm() < 1e-9, "{i}");
    }
}

/// A rod thrown and spinning keeps its momentum and spin; its center flies straight.
#[test]
fn thrown_and_spinning_rod_follows_rigid_motion() {
    for spatial in [false, true] {
        let mut scene = unit_rod(20, 1e-2);
        scene.material.density = 1e3;
        scene.supports.start = Support::Free;
        scene.initial.velocity = [1.0, -2.0, 0.0];
        scene.initial.angular_velocity = [0.0, 0.0, 3.0];
        if spatial {
            scene.material.poisson_ratio = Some(0.3);
            scene.initial.angular_velocity = [0.5, 0.2, 3.0];
        }
        scene.time = Some(Time::new(1.0, 2e-3));
        let problem = scene.problem().unwrap();
        assert_eq!(problem.model().0, if spatial { "spatial" } else { "planar" });
        let run = problem.simulate().unwrap();
        let mass = |i: usize| if i == 0 || i == 20 { 0.5 } else { 1.0 };
        let centre =
            |k: usize, c: usize| (0..=20).map(|i| mass(i) * run.node(i, k)[c]).sum::<f64>() / 20.0;
        for (c, v) in [1.0, -2.0, 0.0].into_iter().enumerate() {
            let flown = centre(500, c) - centre(0, c);
            // Uniform motion of the center of mass for 1 s.
            assert!((flown - v).abs() < 1e-9, "{c}: {flown}");
        }
        // Slender and stiff against its spin: after a whole turn it lies where it lay.
        let spin = (scene.initial.angular_velocity.iter().map(|w| w * w).sum::<f64>()).sqrt();
        let turned = (2.0 * PI / spin / 2e-3).round() as usize;
        if !spatial && turned <= 500 {
            let [a, b] = [run.node(0, turned), run.node(20, turned)];
            // After a whole turn the rod has its first direction.
            assert!(((b[1] - a[1]) / (b[0] - a[0])).abs() < 1e-2);
        }
    }
}

/// A straight rod released from a coil of two turns conserves the energy of the coil, EI (4 pi)^2/2L; with damping it
/// ends straight.
#[test]
fn rod_released_from_a_coil_conserves_energy() {
    let mut scene = unit_rod(60, 1e-2);
    scene.initial = Initial {
        state: InitialState::Shape,
        shape: Some(Shape::Arc { length: 1.0, angle: 4.0 * PI }),
        ..Initial::default()
    };
    scene.material.density = 1.0 / (PI * 1e-4);
    let stored = 0.5 * (4.0 * PI).powi(2);
    let mut time = Time::new(0.05, 1e-4);
    time.scheme = rodfit::scene::Scheme::AverageVectorField;
    scene.time = Some(time);
    let problem = scene.problem().unwrap();
    let mut energies = Vec::new();
    let mut run = rodfit::Trajectory::new(&problem, &[60], &[]).unwrap();
    run.run(&problem, 500, |now| energies.push(now.energies())).unwrap();
    let start = energies[0];
    println!(
        "coil: bend {:.4} of the continuum's, stretch {:.1e}",
        start.bend / stored,
        start.stretch
    );
    // Energy of the continuum, EI (4 pi)^2/(2 L); the mesh is coarse for two turns.
    assert!((start.bend / stored - 1.0).abs() < 0.02);
    let most = energies.iter().map(|e| (e.total() - start.total()).abs()).fold(0.0, f64::max);
    // The scheme conserves energy up to the tolerance of Newton's method.
    assert!(most < 1e-8 * start.total(), "{most}");
    // Let go with damping.
    scene.loads.damping.mass = 7.0;
    scene.time = Some(Time { beta: 0.6, ..Time::new(6.0, 2e-3) });
    let run = simulate(&scene);
    let tip = run.tip(3000);
    let [x, y, _] = run.node(1, 3000);
    let [a, b, _] = run.node(0, 3000);
    let along = (x - a).hypot(y - b).recip();
    let straight = ((tip[0] - a) * (x - a) + (tip[1] - b) * (y - b)) * along;
    // Length from the first node: 1 m, and the half edge in the wall of 59.5 edges.
    assert!((straight - (1.0 + 0.5 / 59.5)).abs() < 1e-3, "{straight}");
}

/// Starts with a velocity have exact derivatives, damping included.
#[test]
fn derivatives_of_a_thrown_rod_equal_differences() {
    let mut scene = unit_rod(12, 1e-2);
    scene.material.density = 1.0 / (PI * 1e-4);
    scene.loads.damping.mass = 0.7;
    scene.loads.damping.stiffness = 1e-3;
    scene.initial.velocity = [0.0, 0.5, 0.0];
    scene.initial.angular_velocity = [0.0, 0.0, 1.0];
    scene.supports.motion = vec![Motion {
        end: End::Start,
        displacement: [0.0, 0.02, 0.0],
        rotation: [0.0, 0.0, 0.1],
        frequency: Some(2.0),
        ..Motion::default()
    }];
    scene.loads.point = vec![PointForce { moment: [0.0, 0.0, 0.3], ..PointForce::default() }];
    scene.time = Some(Time { beta: 0.55, ..Time::new(0.3, 2e-3) });
    let problem = scene.problem().unwrap();
    let parameters =
        [Parameter::YoungsModulus, Parameter::DampingMass, Parameter::DampingStiffness];
    let run = problem.simulate_with(&parameters).unwrap();
    let (_, derivatives) = run.at(Point::Tip, 0.3).unwrap();
    for (k, parameter) in parameters.into_iter().enumerate() {
        let value = parameter.of(&scene).unwrap();
        let at = |part: f64| {
            let other = problem.with([(parameter, value * (1.0 + part))]).unwrap();
            other.simulate().unwrap().tip(150)
        };
        let (plus, minus) = (at(1e-4), at(-1e-4));
        for c in 0..2 {
            let slope = (plus[c] - minus[c]) / (2e-4 * value);
            let error = (derivatives[k][c] - slope).abs() * value;
            // Central differences in relative steps of 1e-4.
            assert!(error < 1e-8, "{parameter} {c}: {} {slope}", derivatives[k][c]);
        }
    }
}

/// A straight ribbon twisted by nature lies still only when so twisted; its end has turned by the
/// whole of it, more than a turn.
#[test]
fn natural_twist_is_stress_free() {
    let mut scene = unit_rod(30, 1e-2);
    let up = [0.0, 0.0, 1.0];
    scene.rod.section = Section::Rectangle { width: 0.03, height: 0.01, up };
    scene.rod.natural_twist = 8.0.into();
    scene.material = Material { poisson_ratio: Some(0.3), ..Material::new(1e3, 1e9) };
    let problem = scene.problem().unwrap();
    assert_eq!(
        problem.model(),
        ("spatial", "rod.natural_twist leaves the plane of the rest shape")
    );
    let found = problem.spatial().unwrap().equilibrium().unwrap();
    let angle = found.q[found.q.len() - 4];
    // From the middle of the first edge to the middle of the last.
    assert!((angle / (8.0 * 29.0 / 29.5) - 1.0).abs() < 1e-9, "{angle}");
    assert!(rest(&scene).energy.abs() < 1e-12);
}

/// A wall motion with less than the required steps per period is rejected with the needed step; a badly resolved one
/// gives a warning.
#[test]
fn wall_motion_that_the_step_does_not_resolve_is_rejected() {
    let scene = |motion: Motion, step: f64| {
        let mut scene = unit_rod(10, 1e-3);
        scene.material.density = 1.0 / (PI * 1e-6);
        scene.time = Some(Time::new(20.0 * step, step));
        scene.supports.motion = vec![Motion { end: End::Start, ..motion }];
        scene
    };
    let displacement = [0.0, 1e-3, 0.0];
    let swing = |f: f64| Motion { displacement, frequency: Some(f), ..Motion::default() };
    let ramp = |t: f64| Motion { displacement, ramp: Some(t), ..Motion::default() };
    for (motion, key, needed) in [
        (swing(1000.0), "supports.motion[0].frequency: found 1000 Hz", "2.500e-4 s"),
        (swing(500.0), "supports.motion[0].frequency: found 500 Hz", "5.000e-4 s"),
        (swing(251.0), "supports.motion[0].frequency: found 251 Hz", "9.960e-4 s"),
        (ramp(5e-4), "supports.motion[0].ramp: found 0.0005 s", "2.500e-4 s"),
        (ramp(1.9e-3), "supports.motion[0].ramp: found 0.0019 s", "9.500e-4 s"),
    ] {
        let error = scene(motion, 1e-3).problem().unwrap().simulate().expect_err(key).to_string();
        assert!(error.starts_with(key) && error.contains(needed), "{error}");
    }
    for (motion, key) in [
        (swing(250.0), Some("supports.motion[0].frequency: found 250 Hz")),
        (swing(51.0), Some("a time.step of 9.804e-4 s")),
        (swing(50.0), None),
        (ramp(2e-3), Some("supports.motion[0].ramp: found 0.002 s")),
        (ramp(1e-2), None),
        (Motion { displacement: [0.0; 3], ..swing(1e4) }, None),
    ] {
        let problem = scene(motion, 1e-3).problem().unwrap();
        problem.simulate().unwrap();
        let mut warnings = rodfit::dynamics::SimulationReport::new(&problem).warnings;
        // The density of a rod of unit stiffness is implausible.
        warnings.retain(|words| words.contains("supports.motion"));
        assert_eq!(warnings.len(), usize::from(key.is_some()), "{warnings:?}");
        assert!(key.is_none_or(|key| warnings[0].contains(key)), "{warnings:?}");
    }
    // At rest nothing is stepped.
    rest(&scene(ramp(5e-4), 1e-3));
}

/// A fit to a rod on a shaken wall uses no coarse step that fails to resolve the motion of the wall. It passes the
/// warning of the run on.
#[test]
fn fit_on_a_shaken_wall_recovers_the_modulus() {
    for (frequency, warned) in [(10.0, true), (5.0, false)] {
        let mut scene = unit_rod(10, 1e-3);
        scene.material.density = 1.0 / (PI * 1e-6);
        scene.supports.motion = vec![Motion {
            end: End::Start,
            displacement: [0.0, 0.002, 0.0],
            frequency: Some(frequency),
            ..Motion::default()
        }];
        scene.time = Some(Time::new(1.5, 1e-2));
        let report = fit(&scene, &observe(&scene, 60), &[Parameter::YoungsModulus]);
        let found = value(&report, Parameter::YoungsModulus);
        // Exact data: within the tolerance of the search.
        assert!((found / scene.material.youngs_modulus - 1.0).abs() < 1e-6, "{report}");
        let words = |w: &String| w.starts_with("supports.motion[0].frequency: found 10 Hz");
        assert_eq!(report.warnings.iter().any(words), warned, "{:?}", report.warnings);
    }
}

/// A wall stays where it is and points where it did when the other end of the rod is moved away.
#[test]
fn wall_without_motion_stays_in_place() {
    let shape = Shape::Arc { length: 0.6, angle: 1.2 };
    let section = Section::Circle { radius: 0.004 };
    let mut scene = Scene::new(20, shape, section, Material::new(1200.0, 1e8));
    scene.supports.end = Support::Clamped;
    let still = rest(&scene);
    scene.supports.motion = vec![Motion {
        end: End::End,
        displacement: [-0.05, 0.02, 0.0],
        ramp: Some(1.0),
        ..Motion::default()
    }];
    let moved = rest(&scene);
    for i in [0, 1] {
        let off = (0..3).map(|c| (moved.nodes[i][c] - still.nodes[i][c]).abs()).fold(0.0, f64::max);
        // The wall does not move: rounding errors.
        assert!(off < 1e-15, "node {i}: {off:e}");
    }
}

/// A wall on a shaker: its own track, or its accelerometer's, in place of the formula.
#[test]
fn a_shaken_wall_by_its_recording() {
    let folder = tempfile::tempdir().unwrap();
    let mut scene = crate::common::cantilever();
    scene.time = Some(Time::new(0.3, 1e-3));
    let swing = |t: f64| 0.004 * (std::f64::consts::TAU * 6.0 * t).sin();
    // At rest until the first row, and on from there as a smooth ramp of the swing.
    let ramp = |t: f64| 1.0 - (-(t / 0.05).powi(4)).exp();
    let place = |t: f64| ramp(t) * swing(t);
    let write = |name: &str, header: &str, value: &dyn Fn(f64) -> f64| {
        let rows = (0..=1200).map(|k| 2.5e-4 * f64::from(k));
        let rows: String = rows.map(|t| format!("{t},0,{:e}\n", value(t))).collect();
        std::fs::write(folder.path().join(name), format!("{header}\n{rows}")).unwrap();
    };
    let h = 1e-4;
    write("track.csv", "t,x,y", &place);
    write("meter.csv", "t,ax,ay", &|t| (place(t + h) - 2.0 * place(t) + place(t - h)) / (h * h));
    let tip = |file: &str| {
        let mut scene = scene.clone();
        let file = folder.path().join(file);
        scene.supports.motion = vec![Motion { end: End::Start, file, ..Motion::default() }];
        let problem = scene.problem().unwrap();
        assert!(problem.planar().is_some(), "{}", problem.model().1);
        let run = problem.simulate().unwrap();
        let wall = |k: usize| 0.5 * (run.node(0, k)[1] + run.node(1, k)[1]);
        for k in [50, 123, 300] {
            let off = wall(k) - wall(0) - place(run.times()[k]);
            // The track is interpolated between its rows.
            assert!(off.abs() < 1e-7, "{k}: {off:e}");
        }
        run.tip(300)[1]
    };
    let still = scene.problem().unwrap().simulate().unwrap().tip(300)[1];
    let [track, meter] = [tip("track.csv"), tip("meter.csv")];
    println!("tip at {track} m by the track, {meter} m by the accelerometer, {still} m without");
    // Both recordings describe one motion; without it the tip is elsewhere.
    assert!((track - meter).abs() < 1e-6 && (track - still).abs() > 1e-3);
}

/// Supports at rest are displaced in stages. A displacement that would need millions of stages is rejected.
#[test]
fn displacement_beyond_all_stages_is_refused() {
    for displacement in [[1e9, 0.0, 0.0], [-1e308, 0.0, 0.0]] {
        let mut scene = unit_rod(8, 1e-3);
        scene.supports.motion = vec![Motion { end: End::Start, displacement, ..Motion::default() }];
        let error = scene.problem().unwrap().equilibrium().err().unwrap().to_string();
        assert!(error.contains("supports.motion") && error.contains("400 rod lengths"), "{error}");
    }
}
