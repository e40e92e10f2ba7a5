//! Damping and friction of contacts of structures: against a rod alone, Coulomb's law on an incline, momentum,
//! energy, and a moved floor.

use crate::contact_scenes::{
    DIMENSIONS, GRAVITY, LOSSES, RADIUS, falling, gravity, plane, structure, time,
};
use crate::scenes::{joint, spatial_rod, support, twisting_steel};
use rodfit::rod::Rod;
use rodfit::{Scene, Structure, StructureScene, Trajectory};

/// A cantilever that falls on a floor with damping and friction moves in a structure as the same rod alone, and the
/// floor has the same force on it.
#[test]
fn structure_of_one_rod_moves_as_the_rod() {
    for dimension in DIMENSIONS {
        let floor = plane([0.0, -0.02], [0.1, 1.0], LOSSES);
        let time = time(0.15, 5e-4, "tolerance = \"rounding\"");
        let parts = [
            spatial_rod("a", 12, 0.3, [1.0, 0.0, 0.0]),
            support("a.start", "clamped"),
            gravity(),
            floor.clone(),
            time.clone(),
        ];
        let own = structure(dimension, 2e8, &parts);
        let mut motion = own.simulation().unwrap();
        let alone = format!(
            "[rod]\n{dimension}segments = 12\nshape = {{ kind = \"straight\", length = 0.3, direction = [1, 0, 0] }}\n\
             section = {{ kind = \"circle\", radius = 3e-3 }}\n\
             [material]\ndensity = 7800\nyoungs_modulus = 2e8\npoisson_ratio = 0.3\n\
             [supports]\nstart = \"clamped\"\n{}{floor}{time}",
            gravity()
        );
        let problem = Scene::from_toml(&alone, ".").unwrap().problem().unwrap();
        let mut alone = Trajectory::new(&problem, &[12], &[]).unwrap().keep_energies();
        alone.run(&problem, 300, |_| {}).unwrap();
        let (mut off, mut energy, mut pull) = (0.0_f64, 0.0_f64, 0.0_f64);
        for k in 1..=300 {
            motion.step_to(alone.times()[k]).unwrap();
            let (found, tip) = (motion.shape().rods["a"].tip, alone.tip(k));
            off = (0..3).map(|c| (found[c] - tip[c]).abs()).fold(off, f64::max);
            energy = energy.max((motion.energies().total() - alone.energies()[k].total()).abs());
            // Along the floor, against the normal force.
            let [x, y, _] = motion.contact_forces()[0];
            pull = pull.max((x - 0.1 * y).abs() / (y + 0.1 * x).max(1e-6));
        }
        println!(
            "{dimension}: off by {off:.1e} m, {energy:.1e} J; friction {pull:.4} of the normal force"
        );
        assert!(off < 1e-9 && energy < 1e-9, "{off:e} {energy:e}");
        assert!(pull > 0.3 && pull < 0.4 + 1e-9, "{pull}");
    }
}

/// A free rod of two welded pieces falls on an incline and slides down as one rod of the same length, with an error of
/// second order in the edges.
#[test]
fn welded_rod_slides_as_one_rod() {
    for dimension in DIMENSIONS {
        let keys = format!("{LOSSES}\nstiffness = 1e8");
        let end = |parts: &[String]| {
            let rest = [gravity(), plane([0.0, -0.004], [0.5, 1.0], &keys), time(0.1, 5e-4, "")];
            let own = structure(dimension, 2e8, &[parts, &rest[..]].concat());
            let mut motion = own.simulation().unwrap();
            (1..=200).for_each(|k| motion.step_to(5e-4 * f64::from(k)).unwrap());
            let shape = motion.shape();
            assert!(motion.contact_forces()[0][1] > 0.0);
            shape.rods["a"].tip
        };
        let direction = [1.0, -0.35, 0.0];
        let off = [16, 32].map(|segments| {
            let whole = end(&[spatial_rod("a", segments, 0.2, direction)]);
            let welded = end(&[
                spatial_rod("b", segments / 2, 0.1, direction),
                spatial_rod("a", segments / 2, 0.1, direction),
                joint("rigid", &["b.end", "a.start"], ""),
            ]);
            (0..3).map(|c| (whole[c] - welded[c]).abs()).fold(0.0, f64::max)
        });
        println!("{dimension}: off by {off:?} m");
        assert!(off[1] < 0.5 * off[0] && off[1] < 1e-4, "{off:?}");
    }
}

/// Rods that are welded at right angles, in the surface of an incline. They slide with g (sin - mu cos), or creep below
/// the slip velocity `s` at the speed y s with 2 y - y^2 = tan/mu. In a plane the rods form a straight line.
#[test]
fn stiff_structure_on_an_incline_sticks_below_the_friction_angle_and_slides_above() {
    let angle: f64 = 0.4;
    let (sin, cos) = angle.sin_cos();
    for (dimension, across) in DIMENSIONS.iter().zip([[cos, -sin, 0.0], [0.0, 0.0, 1.0]]) {
        for (friction, slides) in [(0.2, true), (0.45, false), (0.7, false)] {
            let keys = format!("friction = {friction}\ndamping = 20.0\nstiffness = 1e9");
            let own = structure(
                dimension,
                2e10,
                &[
                    spatial_rod("a", 8, 0.1, [cos, -sin, 0.0]),
                    spatial_rod("b", 8, 0.1, across),
                    joint("rigid", &["a.end", "b.start"], ""),
                    gravity(),
                    plane([-RADIUS * sin, -RADIUS * cos], [sin, cos], &keys),
                    time(0.2, 2e-4, "scheme = \"newmark-beta\"\nbeta = 0.55"),
                ],
            );
            let mut motion = own.simulation().unwrap();
            let ends: Vec<[f64; 3]> = [0.05, 0.1, 0.15, 0.2]
                .into_iter()
                .flat_map(|t| {
                    let steps = (t / 2e-4_f64).round() as u32;
                    ((steps - 249)..=steps)
                        .for_each(|k| motion.step_to(2e-4 * f64::from(k)).unwrap());
                    Some(motion.shape().rods["b"].tip)
                })
                .collect();
            let place = |[x, y, _]: [f64; 3]| x * cos - y * sin;
            let way = |k: usize| place(ends[k + 1]) - place(ends[k]);
            let drift = (ends[3][2] - ends[1][2]).abs();
            println!(
                "{dimension}, mu {friction}: {:.3e}, {:.3e} m, aside {drift:.1e} m",
                way(0),
                way(2)
            );
            if slides {
                let ratio = (way(2) - way(0)) / 0.1 / 0.05 / (GRAVITY * (sin - friction * cos));
                println!("acceleration {ratio:.5} of theory");
                assert!((ratio - 1.0).abs() < 1e-2, "{ratio}");
                assert!(drift < 1e-3 * way(2), "{drift:e}");
            } else {
                let creep = 1e-3 * (1.0 - (1.0 - angle.tan() / friction).sqrt());
                assert!((way(2) / 0.05 / creep - 1.0).abs() < 1e-2, "{} {creep}", way(2) / 0.05);
            }
        }
    }
}

/// The momentum of a free structure changes by weight and contact forces alone, friction included; the scheme takes the
/// mean of both ends of a step.
#[test]
fn contact_forces_with_friction_change_the_momentum() {
    let mut ends = Vec::new();
    for dimension in DIMENSIONS {
        let floor = format!("{LOSSES}\nstiffness = 1e8");
        let times = time(0.08, 2e-4, "tolerance = \"rounding\"\nscheme = \"newmark-beta\"");
        let own = falling(dimension, 2e9, &floor, &times);
        let mut motion = own.simulation().unwrap();
        let mass = 7800.0 * std::f64::consts::PI * RADIUS * RADIUS * 0.35 + 0.02;
        let (mut impulse, mut before, mut largest) = ([0.0; 3], [0.0; 3], 0.0_f64);
        for k in 1..=400 {
            let last = motion.time();
            motion.step_to(2e-4 * f64::from(k)).unwrap();
            let force = motion.contact_forces()[0];
            for c in 0..3 {
                let weight = if c == 1 { mass * GRAVITY } else { 0.0 };
                impulse[c] += (0.5 * (before[c] + force[c]) - weight) * (motion.time() - last);
            }
            (before, largest) = (force, largest.max(force[0].abs()));
        }
        let momentum = match motion.simulation().momentum_in_space() {
            Some([linear, _]) => linear,
            None => [motion.momentum()[0], motion.momentum()[1], 0.0],
        };
        println!(
            "{dimension}: momentum {momentum:?}, impulse {impulse:?} N s, largest {largest:.2} N"
        );
        assert!(largest > 0.3 * mass * GRAVITY, "{largest}");
        for c in 0..3 {
            assert!(
                (momentum[c] - impulse[c]).abs() < 1e-9 * mass * GRAVITY,
                "{momentum:?} {impulse:?}"
            );
        }
        ends.push(motion.shape().rods["c"].tip);
    }
    println!("{ends:?}");
    assert!((0..3).all(|c| (ends[0][c] - ends[1][c]).abs() < 1e-8), "{ends:?}");
}

/// The total energy of a structure that falls on a floor with damping and friction never rises by more than the
/// scheme's error.
#[test]
fn energy_never_rises_with_damping_and_friction() {
    for (dimension, losses) in [(0, LOSSES), (1, LOSSES), (1, "damping = 8.0")] {
        let rises = [2e-4, 1e-4].map(|step| {
            let floor = format!("{losses}\nstiffness = 1e8");
            let own = falling(DIMENSIONS[dimension], 2e9, &floor, &time(0.2, step, ""));
            let mut motion = own.simulation().unwrap();
            let (mut energy, start) = (motion.energies().total(), motion.energies().total());
            let (mut rise, mut kinetic) = (0.0_f64, 0.0_f64);
            let times = own.time().unwrap();
            for k in 1..=times.steps() {
                motion.step_to(times.at(k)).unwrap();
                let now = motion.energies();
                rise = rise.max(now.total() - energy);
                kinetic = kinetic.max(now.kinetic);
                energy = now.total();
            }
            let lost = start - energy;
            println!(
                "{losses:?}: rises by up to {:.1e}, loses {:.3} of the kinetic energy",
                rise / kinetic,
                lost / kinetic
            );
            assert!(lost > 0.1 * kinetic, "{lost} {kinetic}");
            rise / kinetic
        });
        assert!(rises[1] < 1e-6 && rises[1] < 0.5 * rises[0], "{rises:?}");
    }
}

/// A frame lies on a floor that moves sideways at a constant speed, faster than the frame: it accelerates with mu g.
/// The floor works with that force, of which the energies have the part that friction does not dissipate.
#[test]
fn moved_floor_drags_a_structure_with_the_force_of_coulomb() {
    let (friction, speed, end) = (0.3, 2.0, 0.1);
    for dimension in DIMENSIONS {
        let aside = if dimension == DIMENSIONS[0] { [1.0, 0.0, 0.0] } else { [0.0, 0.0, 1.0] };
        let keys = format!(
            "friction = {friction}\ndamping = 20.0\nstiffness = 1e9\nmotion = [{{ velocity = [{speed:?}, 0, 0] }}]"
        );
        let own = structure(
            dimension,
            2e10,
            &[
                spatial_rod("a", 8, 0.1, [1.0, 0.0, 0.0]),
                spatial_rod("b", 8, 0.1, aside),
                joint("rigid", &["a.end", "b.start"], ""),
                gravity(),
                plane([0.0, -RADIUS], [0.0, 1.0], &keys),
                time(end, 2e-4, "scheme = \"newmark-beta\"\nbeta = 0.55"),
            ],
        );
        let mut motion = own.simulation().unwrap();
        let start = motion.shape().rods["b"].tip[0];
        let times = own.time().unwrap();
        (1..=times.steps()).for_each(|k| motion.step_to(times.at(k)).unwrap());
        let way = motion.shape().rods["b"].tip[0] - start;
        let pull = friction * GRAVITY;
        let mass = 7800.0 * std::f64::consts::PI * RADIUS * RADIUS * 0.2;
        let lost = mass * pull * (speed * end - 0.5 * pull * end * end);
        let (energies, ratio) = (motion.energies(), way / (0.5 * pull * end * end));
        // At the start the total is zero, with the axis of all rods at y = 0.
        let loss = -energies.total() / lost;
        println!("{dimension}: way {ratio:.5}, loss {loss:.5} of theory");
        assert!((ratio - 1.0).abs() < 1e-2 && (loss - 1.0).abs() < 1e-2, "{ratio} {loss}");
    }
}

/// An averaging scheme does not take losses; the message has the key.
#[test]
fn losses_with_an_averaging_scheme_are_rejected() {
    let text = |scheme: &str| {
        DIMENSIONS[0].to_string()
            + &twisting_steel()
            + &spatial_rod("a", 8, 0.3, [1.0, 0.0, 0.0])
            + &support("a.start", "clamped")
            + &plane([0.0, -0.02], [0.0, 1.0], "friction = 0.3")
            + &time(0.1, 1e-3, &format!("scheme = \"{scheme}\""))
    };
    let load =
        |scheme: &str| StructureScene::from_toml(&text(scheme), ".").and_then(Structure::new);
    let error = load("average-vector-field").unwrap_err().to_string();
    assert!(error.contains("contacts[0].friction:"), "{error}");
    let loaded = load("generalised-alpha").unwrap();
    assert!(loaded.at_rest().assembly.has_contact_losses());
}

/// Equilibria and modes are without friction, and say so.
#[test]
fn equilibria_and_modes_warn_that_they_are_without_friction() {
    let of = |keys: &str| {
        let parts = [
            spatial_rod("a", 8, 0.3, [1.0, 0.0, 0.0]),
            support("a.start", "clamped"),
            gravity(),
            plane([0.0, -0.02], [0.0, 1.0], keys),
        ];
        structure(DIMENSIONS[0], 2e8, &parts)
    };
    for (keys, warns) in [("friction = 0.3", true), ("damping = 3.0", false)] {
        let own = of(keys);
        let at_rest = own.equilibrium_warnings(&own.equilibrium().unwrap());
        let warned = |list: &[String]| list.iter().any(|text| text.contains("[frictionless]"));
        assert_eq!([warned(&at_rest), warned(&own.modes(2, true).unwrap().warnings)], [warns; 2]);
    }
}
