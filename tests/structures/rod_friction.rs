//! Damping and friction of rods in contact with each other: sliding on rails against Coulomb's law, the restitution of
//! an impact, energy and momentum, the capstan, and rejected scenes.

use crate::contact_scenes::{
    DIMENSIONS, GRAVITY, RADIUS, collision, gravity, placed, structure, time,
};
use crate::scenes::{support, twisting_steel};
use rodfit::rod::{Rod, StepVelocities};
use rodfit::{Structure, StructureScene};
use std::f64::consts::PI;

/// A stiff rod on held rods: along one in a plane, across two in space. Gravity has this angle to the vertical. It
/// slides with g (sin - mu cos), or creeps below the slip velocity `s` at the speed y s with 2 y - y^2 = tan/mu.
#[test]
fn rod_on_held_rods_sticks_below_the_friction_angle_and_slides_above() {
    const STEP: f64 = 2e-4;
    let angle: f64 = 0.4;
    let (sin, cos) = angle.sin_cos();
    // At a crossing the force is concentrated. Damping resists sliding where the overlap tilts the normal: in space the
    // contact is stiffer, with less damping.
    for (dimension, length, law) in [
        (DIMENSIONS[0], 0.1, "damping = 20.0\nstiffness = 1e10"),
        (DIMENSIONS[1], 0.2, "damping = 5.0\nstiffness = 1e13"),
    ] {
        for (friction, slides) in [(0.2, true), (0.45, false), (0.7, false)] {
            let rails: Vec<String> = if dimension == DIMENSIONS[0] {
                vec![placed("left", 20, 0.24, [1.0, 0.0, 0.0], [-0.08, 0.0, 0.0])]
            } else {
                ["left", "right"]
                    .iter()
                    .zip([-0.02, 0.07])
                    .map(|(name, x)| placed(name, 7, 0.03, [0.0, 0.0, 1.0], [x, 0.0, -0.015]))
                    .collect()
            };
            let ends = ["left", "right"].iter().take(rails.len());
            let held = ends.flat_map(|name| {
                ["start", "end"].map(|end| support(&format!("{name}.{end}"), "clamped"))
            });
            let parts = [
                rails.concat(),
                held.collect(),
                placed("rider", 9, length, [1.0, 0.0, 0.0], [-0.4 * length, 2.0 * RADIUS, 0.0]),
                format!(
                    "[loads]\ndamping = {{ stiffness = 1e-3 }}\ngravity = [{:e}, {:e}, 0]\n",
                    GRAVITY * sin,
                    -GRAVITY * cos
                ),
                format!("[[rod_contacts]]\nfriction = {friction}\n{law}\n"),
                time(0.2, STEP, "scheme = \"newmark-beta\"\nbeta = 0.55"),
            ];
            let own = structure(dimension, 2e12, &parts);
            let mut motion = own.simulation().unwrap();
            let mut places = Vec::new();
            for k in 1..=1000 {
                motion.step_to(STEP * f64::from(k)).unwrap();
                if k % 250 == 0 {
                    places.push(motion.shape().rods["rider"].tip);
                }
            }
            let way = |k: usize| places[k + 1][0] - places[k][0];
            println!("{dimension}, mu {friction}: {:.4e}, {:.4e} m", way(0), way(2));
            assert!(
                (places[3][1] / (2.0 * RADIUS) - 1.0).abs() < 0.01 && places[3][2].abs() < 1e-6
            );
            if slides {
                let ratio = (way(2) - way(0)) / 0.1 / 0.05 / (GRAVITY * (sin - friction * cos));
                println!("acceleration {ratio:.5} of theory");
                assert!((ratio - 1.0).abs() < 1e-2, "{ratio}");
            } else {
                let creep = 1e-3 * (1.0 - (1.0 - angle.tan() / friction).sqrt());
                let ratio = way(2) / 0.05 / creep;
                println!("creep {ratio:.5} of theory");
                assert!((ratio - 1.0).abs() < 1e-2, "{ratio}");
            }
        }
    }
}

/// A short stiff rod that falls across a held one leaves with the speed of Hunt and Crossley's law.
#[test]
fn restitution_is_that_of_the_damping() {
    for damping in [1.0, 4.0] {
        let own = structure(
            DIMENSIONS[1],
            2e12,
            &[
                placed("below", 7, 0.03, [0.0, 0.0, 1.0], [0.0, 0.0, -0.015]),
                placed("falling", 7, 0.03, [1.0, 0.0, 0.0], [-0.015, 2.0 * RADIUS + 2e-3, 0.0]),
                support("below.start", "clamped"),
                support("below.end", "clamped"),
                gravity(),
                format!("[[rod_contacts]]\nstiffness = 1e16\ndamping = {damping}\n"),
                time(0.024, 1e-6, "tolerance = \"rounding\"\nscheme = \"newmark-beta\""),
            ],
        );
        let mut motion = own.simulation().unwrap();
        let range = own.at_rest().assembly.rod_ranges()[1].clone();
        let (mut speeds, mut touched) = (Vec::new(), false);
        // The impact begins at 20.19 ms, and takes about 0.1 ms.
        let fall = (1..=200).map(|k| 1e-4 * f64::from(k));
        for time in fall.chain((1..=1000).map(|k| 0.02 + 1e-6 * f64::from(k))) {
            motion.step_to(time).unwrap();
            let v = &motion.simulation().state().v[range.clone()];
            let speed = v.iter().skip(1).step_by(4).sum::<f64>() / 8.0;
            let touches = motion.energies().own > 0.0;
            if touches != touched {
                speeds.push(speed);
                touched = touches;
            }
            if speeds.len() == 2 {
                break;
            }
        }
        let [before, after] = [-speeds[0], speeds[1]];
        // c v - ln(1 + c v) = -c u - ln(1 - c u), by bisection.
        let lost = damping * before - (damping * before).ln_1p();
        let (mut low, mut high) = (0.0, before.min(1.0 / damping));
        for _ in 0..100 {
            let u = 0.5 * (low + high);
            if -damping * u - (-damping * u).ln_1p() < lost { low = u } else { high = u }
        }
        println!("damping {damping}: {before:.4} m/s to {after:.4} m/s, theory {low:.4} m/s");
        assert!((after / low - 1.0).abs() < 0.02, "{after} {low}");
    }
}

/// The energy of a collision with damping and friction falls by the work of their forces, with an error of second
/// order, and never rises by more than an error of the scheme.
#[test]
fn energy_falls_by_the_work_of_damping_and_friction() {
    let errors = [2e-4, 1e-4, 5e-5].map(|step| {
        let keys = "tolerance = \"rounding\"\nscheme = \"newmark-beta\"";
        let own =
            collision(step, 0.005, "friction = 0.4\ndamping = 2.0\nslip_velocity = 2e-2", keys);
        let mut motion = own.simulation().unwrap();
        let start = motion.energies().total();
        let (mut work, mut power, mut time) = (0.0, 0.0, 0.0);
        let (mut rise, mut energy, mut kinetic) = (0.0_f64, start, 0.0_f64);
        let times = own.time().unwrap();
        for k in 1..=times.steps() {
            motion.step_to(times.at(k)).unwrap();
            let (rod, state) = (motion.simulation().rod(), motion.simulation().state());
            let mut forces = vec![0.0; state.q.len()];
            let velocities = StepVelocities { velocity: &state.v[..], slope: 0.0 };
            rod.add_contact_losses(&state.q, &state.frames, velocities, &mut forces, None);
            let now: f64 = forces.iter().zip(&state.v).map(|(force, v)| force * v).sum();
            assert!(now >= 0.0);
            work += 0.5 * (now + power) * (state.time - time);
            (power, time) = (now, state.time);
            let energies = motion.energies();
            rise = rise.max(energies.total() - energy);
            energy = energies.total();
            kinetic = kinetic.max(energies.kinetic);
        }
        let lost = start - energy;
        println!(
            "lost {lost:.5e} J, work {work:.5e} J, kinetic {kinetic:.3e} J, rise {:.1e}",
            rise / kinetic
        );
        assert!(lost > 0.02 * kinetic, "{lost} {kinetic}");
        assert!(rise < 1e-3 * kinetic, "{rise} {kinetic}");
        (lost - work).abs() / kinetic
    });
    println!("errors of the balance {errors:?}");
    assert!(errors[2] < 1e-3 && errors[0] / errors[2] > 8.0, "{errors:?}");
}

/// Linear and angular momentum of two free rods that collide, slide along each other and roll do not change.
#[test]
fn rods_keep_their_momentum() {
    let own = structure(
        DIMENSIONS[1],
        2e9,
        &[
            placed("a", 9, 0.2, [1.0, 0.1, 0.1], [-0.11, 2.02 * RADIUS - 0.011, 0.05]),
            placed("b", 8, 0.2, [0.0, 0.0, 1.0], [0.0, 0.0, 0.0]),
            "[[loads.point]]\nrod = \"a\"\nnode = 4\nforce = [0.3, -0.5, 0.1]\n".into(),
            "[[loads.point]]\nrod = \"b\"\nnode = 2\nforce = [-0.3, 0.5, -0.1]\n".into(),
            "[[rod_contacts]]\nfriction = 0.4\ndamping = 2.0\nstiffness = 1e9\n".into(),
            time(0.02, 1e-4, "tolerance = \"rounding\"\nscheme = \"newmark-beta\""),
        ],
    );
    let mut motion = own.simulation().unwrap();
    let ranges = own.at_rest().assembly.rod_ranges();
    let (mut contact, mut size) = (0.0_f64, 0.0_f64);
    for k in 1..=200 {
        motion.step_to(1e-4 * f64::from(k)).unwrap();
        contact = contact.max(motion.energies().own);
        let (rod, state) = (motion.simulation().rod(), motion.simulation().state());
        let mut sum = [0.0; 3];
        for range in &ranges {
            for i in range.clone().filter(|i| (i - range.start) % 4 != 3) {
                sum[(i - range.start) % 4] += rod.mass()[i] * state.v[i];
                size = size.max((rod.mass()[i] * state.v[i]).abs());
            }
        }
        assert!(sum.iter().all(|p| p.abs() < 1e-11), "{sum:?}");
    }
    println!("contact {contact:.2e} J, momentum of a node {size:.2e} N s");
    assert!(contact > 0.0 && size > 1e-5);
}

#[test]
fn losses_of_rods_that_are_not_possible_are_rejected() {
    let text = |contact: &str, scheme: &str| {
        DIMENSIONS[1].to_string()
            + &twisting_steel()
            + &placed("a", 8, 0.3, [1.0, 0.0, 0.0], [0.0; 3])
            + &placed("b", 8, 0.3, [1.0, 0.0, 1.0], [0.0, 0.01, -0.1])
            + &support("a.start", "clamped")
            + &support("b.start", "clamped")
            + &format!("[[rod_contacts]]\n{contact}\n")
            + &time(0.1, 1e-3, scheme)
    };
    let load = |contact: &str, scheme: &str| {
        StructureScene::from_toml(&text(contact, scheme), ".").and_then(Structure::new)
    };
    for (contact, scheme, key) in [
        ("friction = -0.1", "", "rod_contacts[0].friction"),
        ("damping = -1", "", "rod_contacts[0].damping"),
        ("slip_velocity = 0", "", "rod_contacts[0].slip_velocity"),
        ("friction = 0.3", "scheme = \"average-vector-field\"", "rod_contacts[0].friction"),
        ("damping = 0.3", "scheme = \"average-vector-field\"", "rod_contacts[0].damping"),
    ] {
        let error = load(contact, scheme).unwrap_err().to_string();
        assert!(error.contains(&format!("{key}:")), "{key}: {error}");
    }
    let loaded = load("friction = 0.3", "").unwrap();
    assert!(loaded.at_rest().assembly.has_contact_losses());
    assert!(!load("", "").unwrap().at_rest().assembly.has_contact_losses());
    let found = loaded.equilibrium().unwrap();
    let warnings = loaded.equilibrium_warnings(&found);
    assert!(warnings.iter().any(|text| text.contains("[frictionless]")), "{warnings:?}");
}

/// A belt around half of a held drum (the capstan): the force `P` at one end and `Q` at the other accelerate it by
/// `(P - Q e)/(l (t + t e + r (e - 1)/mu))`, `e = exp(pi mu)`, with the mass per length `l` of the belt, the lengths `t`
/// of its straight parts and the radius `r` of its axis.
#[test]
fn belt_around_a_drum_is_accelerated_as_by_a_capstan() {
    const COUNT: usize = 24;
    let (friction, belt, drum, straight) = (0.3_f64, 1e-3, 0.0195, 0.02);
    let ([pull, hold], density) = ([3.0, 1.0], 1e5);
    // The edges of the belt touch the drum at the start, not its nodes.
    let ring = 1.003 * (belt + drum);
    let arc = (0..=COUNT).map(|k| {
        let angle = PI * k as f64 / COUNT as f64;
        [ring * angle.sin(), -ring * angle.cos(), 0.0]
    });
    let before = [[-straight, -ring, 0.0], [-0.5 * straight, -ring, 0.0]];
    let after = [[-0.5 * straight, ring, 0.0], [-straight, ring, 0.0]];
    let points: Vec<[f64; 3]> = before.into_iter().chain(arc).chain(after).collect();
    let text = [
        "dimension = \"spatial\"\n[[materials]]\nname = \"belt\"\n".into(),
        format!("density = {density:e}\nyoungs_modulus = 1e8\npoisson_ratio = 0.3\n"),
        "[[rods]]\nname = \"drum\"\nsegments = 6\nmaterial = \"belt\"\n".into(),
        "shape = { kind = \"straight\", length = 0.06, direction = [0, 0, 1] }\n".into(),
        format!("origin = [0, 0, -0.03]\nsection = {{ kind = \"circle\", radius = {drum} }}\n"),
        support("drum.start", "clamped"),
        support("drum.end", "clamped"),
        format!(
            "[[rods]]\nname = \"belt\"\nsegments = {}\nmaterial = \"belt\"\n",
            points.len() - 1
        ),
        format!("shape = {{ kind = \"polyline\", points = {points:?} }}\norigin = [0, 0, 0]\n"),
        format!("section = {{ kind = \"circle\", radius = {belt:e} }}\n"),
        format!("[[loads.point]]\nrod = \"belt\"\nnode = 0\nforce = [{:e}, 0, 0]\n", -hold),
        format!("[[loads.point]]\nrod = \"belt\"\nforce = [{:e}, 0, 0]\n", -pull),
        "[loads.damping]\nstiffness = 2e-3\n".into(),
        format!("[[rod_contacts]]\nfriction = {friction}\nslip_velocity = 1e-2\n"),
        time(0.03, 1e-4, ""),
    ];
    let own = Structure::new(StructureScene::from_toml(&text.concat(), ".").unwrap()).unwrap();
    let mut motion = own.simulation().unwrap();
    // The first 10 ms are those of the transient. Both ends have nearly the same speed.
    let places = [100, 200, 300].map(|last| {
        for k in last - 99..=last {
            motion.step_to(1e-4 * f64::from(k)).unwrap();
        }
        let nodes = &motion.shape().rods["belt"].nodes;
        0.5 * (nodes[0][0] - nodes[nodes.len() - 1][0])
    });
    let found = (places[2] - 2.0 * places[1] + places[0]) / 1e-4;
    let ratio = (PI * friction).exp();
    let length = straight * (1.0 + ratio) + (belt + drum) * (ratio - 1.0) / friction;
    let exact = (pull - hold * ratio) / (density * PI * belt * belt * length);
    println!("acceleration {found:.3}, by theory {exact:.3} m/s^2");
    // Edges of an eighth of the radius run onto the drum one after the other.
    assert!((found / exact - 1.0).abs() < 0.03, "{found} {exact}");
}
