//! Contacts of rods with each other and with themselves: derivatives and factors, crossed rods and a ring against
//! theory, energy of a collision, fast steps, and rejected scenes.

use crate::contact_scenes::{
    DIMENSIONS, RADIUS, bundle, collision, gravity, placed, plane, structure, time, touching,
};
use crate::derivative_checks::{check_derivatives, check_factors, check_motion_derivative};
use crate::scenes::support;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rodfit::rod::Rod;
use rodfit::{Error, Structure, StructureScene};
use std::f64::consts::PI;

/// Gradient, tangent and factors of rods in contact with each other, against differences, dual numbers and dense
/// matrices.
#[test]
fn derivatives_of_touching_rods_agree_with_dual_numbers() {
    for dimension in DIMENSIONS {
        let own = bundle(dimension, "");
        let at_rest = own.at_rest();
        let tied: Vec<usize> = at_rest.assembly.unknowns_without_effect().collect();
        let ranges = at_rest.assembly.rod_ranges();
        let mut q = at_rest.q.clone();
        (0..q.len()).for_each(|i| q[i] += 1e-4 * (0.9 * i as f64).cos());
        // The second rod moves into the first one, and the third too.
        let stride = if dimension == DIMENSIONS[0] { 2 } else { 4 };
        ranges[1].clone().skip(1).step_by(stride).for_each(|i| q[i] -= 4.5e-3);
        ranges[2].clone().skip(1).step_by(stride).for_each(|i| q[i] += 4.5e-3);
        at_rest.assembly.place_carried(&mut q, &at_rest.frames);
        let own_energy = at_rest.assembly.energies(&q, &at_rest.frames).own;
        println!("{dimension}energy of contacts {own_energy:.3e} J");
        assert!(own_energy > 1e-6, "no contact");
        check_derivatives(&own, &q, 1e-7, 1e-9, &tied);
        check_factors(&own, &q, &tied);
    }
}

/// A rod that is pinned at both ends above a stiff one lies on it: the axes are a diameter apart, and the force is that
/// of a beam on a rigid support in its middle, `5/8 w L - 48 E I d/L^3`.
#[test]
fn crossed_rods_are_a_diameter_apart() {
    let (length, modulus, height) = (0.4, 2e9, 2.05 * RADIUS);
    let own = structure(
        DIMENSIONS[1],
        modulus,
        &[
            placed("below", 10, 0.02, [0.0, 0.0, 1.0], [0.0, 0.0, -0.01]),
            placed("above", 60, length, [1.0, 0.0, 0.0], [-0.5 * length, height, 0.0]),
            support("below.start", "clamped"),
            support("below.end", "clamped"),
            support("above.start", "pinned"),
            support("above.end", "pinned"),
            gravity(),
            "[[rod_contacts]]\n".into(),
        ],
    );
    let found = own.equilibrium().unwrap();
    assert_eq!(found.stable, Some(true));
    let axis = |name: &str| {
        let nodes = &found.shape.rods[name].nodes;
        nodes[nodes.len() / 2][1]
    };
    let distance = axis("above") - axis("below");
    println!("distance of the axes: {:.5} diameters", distance / (2.0 * RADIUS));
    assert!(distance < 2.0 * RADIUS && distance > 2.0 * RADIUS * 0.995);
    // The rod on the support sags by d = 0.05 r there; with its ends free to turn.
    let bending = modulus * PI * RADIUS.powi(4) / 4.0;
    let weight = 7800.0 * PI * RADIUS.powi(2) * 9.81;
    let sag = height - distance;
    let force = 0.625 * weight * length - 48.0 * bending * sag / length.powi(3);
    // By the shape: the deflection of the quarter point under weight and that force.
    let nodes = &found.shape.rods["above"].nodes;
    let quarter = height - nodes[nodes.len() / 4][1];
    let x: f64 = 0.25;
    let by_weight = weight * length.powi(4) / (24.0 * bending) * (x - 2.0 * x.powi(3) + x.powi(4));
    let by_force = force * length.powi(3) / (48.0 * bending) * (3.0 * x - 4.0 * x.powi(3));
    println!(
        "quarter point {quarter:.4e} m, theory {:.4e} m, force {force:.4} N",
        by_weight - by_force
    );
    assert!((quarter / (by_weight - by_force) - 1.0).abs() < 0.02, "{quarter}");
}

/// An open ring whose tip is pulled to its start touches itself: the axes there are a diameter apart.
#[test]
fn ring_touches_itself() {
    let dimension = DIMENSIONS[0];
    let text = format!(
        "{dimension}[[rods]]\nname = \"ring\"\nsegments = 60\n\
         shape = {{ kind = \"arc\", length = 0.3, angle = 5.6 }}\n\
         section = {{ kind = \"circle\", radius = 3e-3 }}\n\
         material = {{ density = 1100, youngs_modulus = 2e7, poisson_ratio = 0.45 }}\n\
         {}[[loads.point]]\nrod = \"ring\"\nforce = [0.05, -0.02, 0]\n[[rod_contacts]]\nstiffness = 1e11\n",
        support("ring.start", "clamped")
    );
    let own = Structure::new(StructureScene::from_toml(&text, ".").unwrap()).unwrap();
    let found = own.equilibrium().unwrap();
    let nodes = &found.shape.rods["ring"].nodes;
    // Segments that do not cross are closest at a node.
    let (first, last) = (&nodes[..25], &nodes[36..]);
    let distance = least_distance(first, last).min(least_distance(last, first));
    println!("{:.5} diameters", distance / (2.0 * RADIUS));
    assert!(distance < 2.0 * RADIUS && distance > 2.0 * RADIUS * 0.99, "{distance}");
}

/// The least distance of nodes from the segments between others, m.
fn least_distance(nodes: &[[f64; 3]], others: &[[f64; 3]]) -> f64 {
    let mut least = f64::INFINITY;
    for [x, y, _] in nodes {
        for pair in others.windows(2) {
            let ([a, b, _], [c, d, _]) = (pair[0], pair[1]);
            let (u, v) = (c - a, d - b);
            let t = (((x - a) * u + (y - b) * v) / (u * u + v * v)).clamp(0.0, 1.0);
            least = least.min((x - a - t * u).hypot(y - b - t * v));
        }
    }
    least
}

/// The energy of rods that collide is kept with an error of second order, and the momentum of the falling rod changes
/// by weight and contact force, which is opposite to that on the other rod.
#[test]
fn collision_of_rods_keeps_the_energy() {
    let changes = [4e-4, 2e-4, 1e-4].map(|step| {
        let keys = "tolerance = \"rounding\"\nscheme = \"newmark-beta\"";
        let own = collision(step, 0.005, "", keys);
        let mut motion = own.simulation().unwrap();
        let start = motion.energies().total();
        let (mut change, mut kinetic, mut contact) = (0.0_f64, 0.0_f64, 0.0_f64);
        let times = own.time().unwrap();
        for k in 1..=times.steps() {
            motion.step_to(times.at(k)).unwrap();
            let energies = motion.energies();
            change = change.max((energies.total() - start).abs());
            kinetic = kinetic.max(energies.kinetic);
            contact = contact.max(energies.own);
        }
        assert!(contact > 0.02 * kinetic, "{contact} {kinetic}");
        change / kinetic
    });
    println!("energy changes by {changes:?} of the largest kinetic energy");
    assert!(changes[2] < 0.01 && changes[0] / changes[2] > 6.0, "{changes:?}");
}

/// Derivatives of a motion in contact by numbers of rods and contacts, from dual numbers and from differences.
#[test]
fn derivatives_of_a_collision_agree_with_differences() {
    let keys = "tolerance = \"rounding\"\nscheme = \"generalised-alpha\"";
    let own = collision(4e-4, 0.005, "", keys);
    let times = || (1..=250).map(|k| 4e-4 * f64::from(k));
    let rods = own.at_rest().assembly.body_coordinates().start;
    let end = |own: &Structure| {
        let mut motion = own.simulation().unwrap();
        times().for_each(|t| motion.step_to(t).unwrap());
        let mut q = motion.simulation().state().q.clone();
        motion.simulation().rod().place_carried(&mut q, &motion.simulation().state().frames);
        q.truncate(rods);
        q
    };
    for path in
        ["materials.steel.youngs_modulus", "rod_contacts.0.stiffness", "rods.beam.section.radius"]
    {
        check_motion_derivative(&own, path, times(), end, 1e-6, [1e-9, 1e-4]);
    }
}

/// A rod that falls by many diameters in a step on another one does not pass through it.
#[test]
fn fast_rods_do_not_pass_through_each_other() {
    let own = structure(
        DIMENSIONS[1],
        2e11,
        &[
            placed("beam", 10, 0.2, [0.0, 0.0, 1.0], [0.0, 0.0, -0.1]),
            placed("falling", 9, 0.2, [1.0, 0.0, 0.0], [-0.1, 0.4, 0.0]),
            support("beam.start", "clamped"),
            support("beam.end", "clamped"),
            gravity(),
            touching(1e10),
            time(0.36, 1e-2, ""),
        ],
    );
    let mut motion = own.simulation().unwrap();
    let mut lowest = f64::INFINITY;
    for k in 1..=36 {
        match motion.step_to(1e-2 * f64::from(k)) {
            Ok(()) => {}
            Err(error) => {
                println!("{error}");
                assert!(matches!(error, Error::PassedRod { contact: 0, .. }), "{error}");
                return;
            }
        }
        let shape = motion.shape();
        // Both nodes beside the middle of the falling rod.
        let falling = 0.5 * (shape.rods["falling"].nodes[4][1] + shape.rods["falling"].nodes[5][1]);
        let distance = falling - shape.rods["beam"].nodes[5][1].max(shape.rods["beam"].nodes[6][1]);
        lowest = lowest.min(distance);
    }
    println!("lowest distance {:.4} diameters", lowest / (2.0 * RADIUS));
    assert!(lowest > RADIUS && lowest < 0.1, "{lowest}");
}

/// Rods that fall on each other and on a floor do not pass through each other, and gain no energy.
#[test]
fn heap_of_rods_gains_no_energy() {
    // Impacts raise the energy by an error of second order in the step: 1e-2 of the kinetic energy at 1 ms.
    const STEP: f64 = 5e-4;
    for seed in 0..4 {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let count = 2 + seed as usize;
        let mut parts = Vec::new();
        for i in 0..count {
            let angle: f64 = random.random_range(0.0..PI);
            let [x, z] = [0, 1].map(|_| random.random_range(-0.02..0.02));
            let (way, length) = ([angle.cos(), 0.05, angle.sin()], 0.15);
            let start =
                [x - 0.5 * length * way[0], 0.02 + 0.025 * i as f64, z - 0.5 * length * way[2]];
            parts.push(placed(&format!("r{i}"), 8, length, way, start));
        }
        parts.push("[loads]\ngravity = [0, -9.81, 0]\ndamping = { stiffness = 1e-3 }\n".into());
        parts.push(plane([0.0, 0.0], [0.0, 1.0], "friction = 0.4\ndamping = 2.0"));
        parts.push("[[rod_contacts]]\n".into());
        parts.push(time(0.25, STEP, ""));
        let own = structure(DIMENSIONS[1], 2e7, &parts);
        let mut motion = own.simulation().unwrap();
        let (mut before, mut rise, mut kinetic) = (motion.energies().total(), 0.0_f64, 0.0_f64);
        let (mut contact, mut least) = (0.0_f64, f64::INFINITY);
        for k in 1..=500 {
            motion.step_to(STEP * f64::from(k)).unwrap();
            let energies = motion.energies();
            rise = rise.max(energies.total() - before);
            before = before.min(energies.total());
            kinetic = kinetic.max(energies.kinetic);
            contact = contact.max(energies.own);
            let shape = motion.shape();
            for i in 0..count {
                for j in 0..i {
                    let [a, b] = [i, j].map(|rod| &shape.rods[&format!("r{rod}")].nodes);
                    least = least.min(distance_in_space(a, b));
                }
            }
        }
        println!(
            "{count} rods: least distance {:.3} diameters, rise of the energy {:.1e} of the kinetic energy",
            least / (2.0 * RADIUS),
            rise / kinetic
        );
        assert!(contact > 0.0 && least > RADIUS, "{least}");
        assert!(rise < 5e-3 * kinetic, "{rise} {kinetic}");
    }
}

/// Least distance of points on one polygon from points on another, ten on each edge, m.
fn distance_in_space(first: &[[f64; 3]], second: &[[f64; 3]]) -> f64 {
    let points = |nodes: &[[f64; 3]]| -> Vec<[f64; 3]> {
        let edges = nodes.windows(2);
        let along = |edge: &[[f64; 3]]| -> Vec<[f64; 3]> {
            let (a, b) = (edge[0], edge[1]);
            (0..10).map(|k| [0, 1, 2].map(|c| a[c] + f64::from(k) / 10.0 * (b[c] - a[c]))).collect()
        };
        edges.flat_map(along).collect()
    };
    let (first, second) = (points(first), points(second));
    let mut least = f64::INFINITY;
    for a in &first {
        for b in &second {
            least = least.min((0..3).map(|c| (a[c] - b[c]).powi(2)).sum::<f64>());
        }
    }
    least.sqrt()
}

#[test]
fn contacts_of_rods_that_are_not_possible_are_rejected() {
    let text = |contact: &str, height: f64, more: &str| {
        let material = "[[materials]]\nname = \"steel\"\ndensity = 7800\nyoungs_modulus = 2e11\npoisson_ratio = 0.3\n";
        let rods = placed("a", 8, 0.3, [1.0, 0.0, 0.0], [0.0; 3])
            + &placed("b", 8, 0.3, [1.0, 0.0, 1.0], [0.0, height, -0.1]);
        let supports = support("a.start", "clamped") + &support("b.start", "clamped");
        format!(
            "{material}{rods}{supports}[[rod_contacts]]\n{contact}\n[time]\nend = 0.1\nstep = 1e-3\n{more}"
        )
    };
    let result = |contact: &str, height: f64, more: &str| {
        StructureScene::from_toml(&text(contact, height, more), ".").and_then(Structure::new)
    };
    for (contact, height, more, key, words) in [
        ("rods = [\"a\", \"c\"]", 0.01, "", "rod_contacts[0].rods[1]", "a, b"),
        ("rods = [\"a\", \"a\"]", 0.01, "", "rod_contacts[0].rods[1]", "once"),
        ("stiffness = -1", 0.01, "", "rod_contacts[0].stiffness", ""),
        ("contact_radius = 0", 0.01, "", "rod_contacts[0].contact_radius", ""),
        ("", 0.0015, "", "rod_contacts[0]", "rods.a overlaps rods.b"),
        ("", 0.01, "scheme = \"rodas4\"", "time.scheme", "with rod_contacts"),
    ] {
        let error = result(contact, height, more).unwrap_err().to_string();
        assert!(error.contains(&format!("{key}:")) && error.contains(words), "{key}: {error}");
    }
    assert!(result("rods = [\"a\"]", 0.0015, "").is_ok());
    let scene = result("", 0.01, "").unwrap();
    assert_eq!(scene.time().unwrap().scheme, rodfit::scene::Scheme::GeneralisedAlpha);
    let flat = text("", 0.01, "").replace(
        "section = { kind = \"circle\", radius = 1e-3 }",
        "section = { kind = \"rectangle\", width = 2e-3, height = 1e-3, up = [0, 1, 0] }",
    );
    let error = StructureScene::from_toml(&flat, ".").unwrap_err().to_string();
    assert!(error.contains("rod_contacts[0].contact_radius:"), "{error}");
}
