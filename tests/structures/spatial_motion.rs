//! Motions of structures in space: rotations, momentum, order and derivatives.

use crate::derivative_checks::{dual_run, shifted};
use crate::scenes::{joint, mixed_in_space, rod, spatial, spatial_rod, structure, support};
use rodfit::Structure;
use rodfit::dynamics::Simulation;
use rodfit::numerics::vector::{add, cross, dot, sub, unit};
use rodfit::rod::Assembly;

/// Text of soft rods.
fn soft(text: String) -> String {
    text.replace("steel", "rubber").replace("1e-3", "3e-3")
}

/// A free body with three different moments of inertia and three rods of rubber, `steps` steps in [`END`].
fn spinning(scheme: &str, steps: usize) -> Structure {
    spatial(&[
        soft(spatial_rod("a", 8, 0.10, [1.0, 0.0, 0.0])),
        soft(spatial_rod("b", 8, 0.08, [0.0, 1.0, 0.3])),
        soft(spatial_rod("c", 8, 0.06, [-0.5, 0.2, 1.0])),
        "[[materials]]\nname = \"rubber\"\ndensity = 1000\nyoungs_modulus = 1e7\npoisson_ratio = 0.4\n".into(),
        "[[bodies]]\nname = \"hub\"\nmass = 0.02\ninertia = [4e-6, 9e-6, 7e-6]\norientation = [0.2, 0.5, -0.3]\n         position = [-0.01, 0.005, 0.0]\n"
            .into(),
        joint("rigid", &["hub", "a.start", "b.start", "c.start"], ""),
        format!("[time]\nend = {END}\nstep = {:e}\nscheme = \"{scheme}\"\ntolerance = \"rounding\"\n", END / steps as f64),
    ])
}

/// Sets the velocities of a rigid motion with an angular velocity, rad/s, about the origin, and a velocity, m/s.
fn set_rigid_motion(
    simulation: &mut Simulation<f64, Assembly<f64>>,
    spin: [f64; 3],
    velocity: [f64; 3],
) {
    let state = simulation.state().clone();
    let mut q = state.q.clone();
    simulation.rod().place_carried(&mut q, &state.frames);
    let mut v = vec![0.0; q.len()];
    let three = |i: usize| [q[i], q[i + 1], q[i + 2]];
    let Assembly::Space(rods) = simulation.rod() else { panic!("a structure in space") };
    for member in rods.members() {
        for i in member.range.clone().step_by(4) {
            let own = add(velocity, cross(spin, three(i)));
            v[i..i + 3].copy_from_slice(&own);
            if i + 3 < member.range.end {
                v[i + 3] = dot(spin, unit(sub(three(i + 4), three(i))));
            }
        }
    }
    let first = rods.body_coordinates().start;
    for body in &rods.bodies().bodies {
        let i = first + body.coordinate;
        v[i..i + 3].copy_from_slice(&add(velocity, cross(spin, three(i))));
    }
    for (rotation, axes) in rods.bodies().rotations_with_axes(&q[first..], &state.frames) {
        for c in 0..3 {
            let axis = [axes[0][c], axes[1][c], axes[2][c]];
            v[first + rotation.coordinate + c] = dot(axis, spin) * rotation.length;
        }
    }
    for i in simulation.rod().unknowns_without_effect().collect::<Vec<_>>() {
        v[i] = 0.0;
    }
    simulation.set_velocity(&v);
}

/// Momenta of the free structure at the end, in `steps` steps, with their values at the start.
fn momenta(scheme: &str, steps: usize) -> [[[f64; 3]; 2]; 2] {
    let structure = spinning(scheme, steps);
    let mut simulation = structure.simulation_over(|_, value, _| value).unwrap();
    set_rigid_motion(&mut simulation, [12.0, -20.0, 16.0], [0.3, 0.2, -0.4]);
    let start = simulation.momentum_in_space().unwrap();
    let energy = simulation.energies();
    let mut largest = 0.0_f64;
    for k in 1..=steps {
        simulation.step_to(END * k as f64 / steps as f64).unwrap();
        let now = simulation.momentum_in_space().unwrap();
        largest = largest.max(distance(now[0], start[0]) / distance(start[0], [0.0; 3]));
    }
    assert!(largest < 1e-10, "linear momentum: {largest:e}");
    let change = (simulation.energies().total() - energy.total()).abs() / energy.kinetic;
    assert!(change < 1e-2, "energy: {change:e}");
    [start, simulation.momentum_in_space().unwrap()]
}

/// Duration of the motion of the free structure, s: 20 degrees. 400 steps resolve its vibrations.
const END: f64 = 0.0125;

/// `|a - b|`.
fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    dot(sub(a, b), sub(a, b)).sqrt()
}

/// Nothing acts on a free structure from outside: linear momentum stays to rounding. The error of the angular momentum by the
/// scheme falls fourfold with half the step; that of the rods, whose inertia about themselves lacks a term, stays below 1e-3.
#[test]
fn spatial_momentum_of_a_free_structure_is_conserved() {
    for scheme in ["newmark-beta", "generalised-alpha"] {
        let [coarse, middle, fine] = [400, 800, 1600].map(|steps| momenta(scheme, steps));
        let ends = [coarse[1][1], middle[1][1], fine[1][1]];
        let ratio = distance(ends[0], ends[1]) / distance(ends[1], ends[2]);
        let change = distance(fine[1][1], fine[0][1]) / distance(fine[0][1], [0.0; 3]);
        println!("{scheme}: {ratio} {change:e} {:e}", distance(ends[1], ends[2]));
        assert!((3.3..5.0).contains(&ratio), "{scheme} {ratio}");
        assert!(change < 1e-3, "{scheme} {change:e}");
    }
}

/// A body with a light rod turns as Euler's equations `J dw/dt + w x J w = 0` predict, and keeps its angular momentum, to
/// second order.
#[test]
fn heavy_body_turns_as_eulers_equations_predict() {
    let inertia = [1e-3, 2.5e-3, 2e-3];
    let (spin, end) = ([3.0, 0.4, 5.0], 1.0);
    let body = |steps: usize| {
        spatial(&[
            spatial_rod("a", 6, 0.02, [1.0, 0.0, 0.0]).replace("1e-3", "1e-4"),
            format!("[[bodies]]\nname = \"bob\"\nmass = 1.0\ninertia = {inertia:?}\nposition = [0, 0, 0]\n"),
            "[[joints]]\nkind = \"rigid\"\nconnects = [{ body = \"bob\", offset = [0, 0, 0] }, { rod = \"a\", at = \"start\" }]\n".into(),
            format!("[time]\nend = {end}\nstep = {:e}\n", end / steps as f64),
        ])
    };
    // Runge and Kutta's method of fourth order with small steps.
    let rate = |w: [f64; 3]| {
        let momentum = [0, 1, 2].map(|c| inertia[c] * w[c]);
        let turned = cross(momentum, w);
        [0, 1, 2].map(|c| turned[c] / inertia[c])
    };
    let (mut w, h) = (spin, end / 1e4);
    for _ in 0..10_000 {
        let ahead = |k: [f64; 3], part: f64| [0, 1, 2].map(|c| w[c] + part * h * k[c]);
        let k1 = rate(w);
        let k2 = rate(ahead(k1, 0.5));
        let k3 = rate(ahead(k2, 0.5));
        let k4 = rate(ahead(k3, 1.0));
        w = [0, 1, 2].map(|c| w[c] + h / 6.0 * (k1[c] + 2.0 * (k2[c] + k3[c]) + k4[c]));
    }
    let errors = |steps: usize| {
        let structure = body(steps);
        let mut simulation = structure.simulation_over(|_, value, _| value).unwrap();
        set_rigid_motion(&mut simulation, spin, [0.0; 3]);
        let start = simulation.momentum_in_space().unwrap()[1];
        for k in 1..=steps {
            simulation.step_to(end * k as f64 / steps as f64).unwrap();
        }
        let Assembly::Space(rods) = simulation.rod() else { panic!("a structure in space") };
        let (state, first) = (simulation.state(), rods.body_coordinates().start);
        let (rotation, axes) =
            rods.bodies().rotations_with_axes(&state.q[first..], &state.frames).next().unwrap();
        // Components in the axes of the body, whose order is that of the eigenvalues.
        let rest = rotation.rest_axes(&structure.at_rest().frames);
        let own = [0, 1, 2].map(|c| state.v[first + rotation.coordinate + c] / rotation.length);
        let found = [0, 1, 2].map(|c| (0..3).map(|k| rest[c][k] * own[k]).sum::<f64>());
        assert!(
            (dot([axes[0][0], axes[1][0], axes[2][0]], [axes[0][1], axes[1][1], axes[2][1]])).abs()
                < 1e-14
        );
        let now = simulation.momentum_in_space().unwrap()[1];
        [distance(found, w), distance(now, start) / distance(start, [0.0; 3])]
    };
    let [coarse, fine] = [100, 200].map(errors);
    println!("{coarse:?} {fine:?}");
    for (coarse, fine) in coarse.iter().zip(&fine) {
        assert!(*fine < 1e-2 && (3.4..4.6).contains(&(coarse / fine)), "{coarse:e} {fine:e}");
    }
}

/// A planar structure given in space moves as in the plane.
#[test]
fn planar_motion_given_in_space_is_the_planar_motion() {
    let parts = |rotation: &str| {
        [
            soft(rod("a", 10, 0.2, [1.0, 0.0])),
            soft(rod("b", 10, 0.15, [0.3, -1.0])),
            soft(rod("c", 10, 0.1, [1.0, 0.2])),
            "[[materials]]\nname = \"rubber\"\ndensity = 1000\nyoungs_modulus = 1e7\npoisson_ratio = 0.4\n".into(),
            format!("[[bodies]]\nname = \"bob\"\nmass = 0.01\ninertia = {rotation}\nposition = [0.25, -0.15, 0]\n"),
            joint("rigid", &["a.end", "b.start"], ""),
            joint("rigid", &["bob", "b.end"], ""),
            joint("spring", &["bob", "c.start"], "rotation = 30.0")
                .replace("{ body = \"bob\" }", "{ body = \"bob\", offset = [0.01, 0.0, 0] }"),
            support("a.start", "clamped"),
            "[loads]\ngravity = [0, -9.81, 0]\ndamping = { mass = 0.2, stiffness = 1e-4 }\n".into(),
            "[time]\nend = 0.2\nstep = 2e-3\ntolerance = \"rounding\"\n".into(),
        ]
    };
    let run = |structure: &Structure| {
        let mut motion = structure.simulation().unwrap();
        for k in 1..=100 {
            motion.step_to(2e-3 * f64::from(k)).unwrap();
        }
        (motion.shape(), motion.energies())
    };
    let [plane, space] = [structure(&parts("4e-6")), spatial(&parts("[3e-6, 2e-6, 4e-6]"))];
    let ((plane, a), (space, b)) = (run(&plane), run(&space));
    let mut largest = 0.0_f64;
    for (name, rod) in &plane.rods {
        for (x, y) in rod.nodes.iter().zip(&space.rods[name].nodes) {
            let apart = sub(*x, *y);
            largest = largest.max(dot(apart, apart).sqrt());
        }
    }
    println!("{largest:e} {} {}", a.kinetic, b.kinetic);
    assert!(largest < 1e-8, "{largest:e}");
    assert!((a.total() - b.total()).abs() < 1e-8 * a.kinetic.abs());
}

/// A structure that starts in its equilibrium stays there.
#[test]
fn equilibrium_in_space_is_at_rest() {
    let structure =
        mixed_in_space(8, "[initial]\nstate = \"equilibrium\"\n[time]\nend = 0.02\nstep = 1e-3\n");
    let mut motion = structure.simulation().unwrap();
    let before = motion.shape();
    for k in 1..=20 {
        motion.step_to(1e-3 * f64::from(k)).unwrap();
    }
    let after = motion.shape();
    for (name, rod) in &before.rods {
        for (x, y) in rod.nodes.iter().zip(&after.rods[name].nodes) {
            assert!((0..3).all(|c| (x[c] - y[c]).abs() < 1e-8), "{name} {x:?} {y:?}");
        }
    }
}

/// Differences of runs with half the step fall fourfold.
#[test]
fn spatial_motion_converges_to_second_order_in_the_step() {
    for scheme in ["newmark-beta", "generalised-alpha"] {
        let run = |steps: usize| {
            let structure = spinning(scheme, steps);
            let mut simulation = structure.simulation_over(|_, value, _| value).unwrap();
            set_rigid_motion(&mut simulation, [12.0, -20.0, 16.0], [0.0; 3]);
            for k in 1..=steps {
                simulation.step_to(END * k as f64 / steps as f64).unwrap();
            }
            let state = simulation.state();
            structure.shape_at(&state.q, &state.frames)
        };
        let [a, b, c] = [400, 800, 1600].map(run);
        let apart = |x: &rodfit::structure::StructureShape,
                     y: &rodfit::structure::StructureShape| {
            let tips = x.rods.values().zip(y.rods.values());
            tips.map(|(x, y)| dot(sub(x.tip, y.tip), sub(x.tip, y.tip)).sqrt()).fold(0.0, f64::max)
        };
        let ratio = apart(&a, &b) / apart(&b, &c);
        println!("{scheme} {ratio} {:e}", apart(&b, &c));
        assert!((3.3..5.0).contains(&ratio), "{scheme} {ratio}");
    }
}

/// Derivatives of a motion over 100 turning steps by numbers of rods, bodies and joints, from a run over dual numbers, against
/// central differences of plain runs.
#[test]
fn dual_derivatives_of_a_spatial_motion_agree_with_differences() {
    for scheme in ["newmark-beta", "generalised-alpha"] {
        let time = format!(
            "[initial]\nstate = \"rest\"\n[time]\nend = 0.1\nstep = 1e-3\nscheme = \"{scheme}\"\ntolerance = \"rounding\"\n"
        );
        let structure = mixed_in_space(6, &time);
        let steps = 40;
        let end = |structure: &Structure| {
            let mut simulation = structure.simulation_over(|_, value, _| value).unwrap();
            for k in 1..=steps {
                simulation.step_to(2e-4 * f64::from(k)).unwrap();
            }
            let state = simulation.state();
            let mut q = state.q.clone();
            simulation.rod().place_carried(&mut q, &state.frames);
            q.truncate(structure.at_rest().assembly.body_coordinates().start);
            q
        };
        for path in [
            "materials.steel.youngs_modulus",
            "rods.strut.section.radius",
            "rods.beam.shape.length",
            "bodies.bob.mass",
            "bodies.bob.inertia.0",
            "bodies.bob.orientation.y",
            "bodies.bob.position.z",
            "joints.1.rotation.2",
            "joints.3.axis.y",
            "rods.arm.shape.direction.x",
        ] {
            let (value, q) = dual_run(&structure, path, (1..=steps).map(|k| 2e-4 * f64::from(k)));
            // Numbers of a small effect need larger differences, and are as good as linear.
            let part =
                if path.starts_with("bodies") || path.starts_with("joints") { 1e-3 } else { 1e-5 };
            let h = part * value;
            let [plus, minus] = [h, -h].map(|h| end(&shifted(&structure, path, h)));
            // Positions of nodes; angles of edges are measured from frames that turn with the numbers.
            let nodes: Vec<usize> = (0..plus.len()).filter(|i| i % 4 != 3).collect();
            let size = nodes.iter().map(|i| q[*i].eps.abs()).fold(0.0, f64::max);
            assert!(size > 0.0, "{path}");
            let mut worst = 0.0_f64;
            for i in nodes {
                let difference = (plus[i] - minus[i]) / (2.0 * h);
                worst = worst.max((q[i].eps - difference).abs() / size);
            }
            println!("{scheme} {path} {worst:e}");
            assert!(worst < 1e-4, "{scheme} {path}: {worst:e}");
        }
    }
}
