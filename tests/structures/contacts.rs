//! Structures that touch obstacles: against a scene of one rod, a welded rod against one rod, derivatives, moved
//! obstacles and rejected keys.

use crate::derivative_checks::{check_derivatives, check_motion_derivative};
use crate::scenes::{joint, rod, spatial_rod, steel, support, twisting_steel};
use rodfit::{Scene, Structure, StructureScene};

/// Text of soft material in place of steel, so that the rod falls deep onto an obstacle.
fn soft(text: String) -> String {
    text.replace("2e11", "2e8").replace("radius = 1e-3", "radius = 3e-3")
}

const FLOOR: &str = "[[contacts]]\nkind = \"plane\"\npoint = [0, -0.02, 0]\nnormal = [0, 1, 0]\n";
const GRAVITY: &str = "[loads]\ngravity = [0, -9.81, 0]\n";
/// Until after the first contacts; the default scheme of contacts.
const TIME: &str = "[time]\nend = 0.15\nstep = 5e-4\ntolerance = \"rounding\"\n";

/// A cantilever that falls on a floor, as a structure, moves as the same rod alone.
#[test]
fn structure_of_one_rod_moves_as_the_rod() {
    for spatial in [false, true] {
        let material = if spatial { twisting_steel() } else { steel() };
        let dimension = if spatial { "dimension = \"spatial\"\n" } else { "" };
        let body = spatial_rod("a", 12, 0.3, [1.0, 0.0, 0.0]) + &support("a.start", "clamped");
        let text = soft(format!("{dimension}{material}{body}{GRAVITY}{FLOOR}{TIME}"));
        let structure = Structure::new(StructureScene::from_toml(&text, ".").unwrap()).unwrap();
        let mut motion = structure.simulation().unwrap();
        let alone = soft(format!(
            "[rod]\n{dimension}segments = 12\nshape = {{ kind = \"straight\", length = 0.3, direction = [1, 0, 0] }}\n\
             section = {{ kind = \"circle\", radius = 1e-3 }}\n\
             [material]\ndensity = 7800\nyoungs_modulus = 2e11\npoisson_ratio = 0.3\n\
             [supports]\nstart = \"clamped\"\n{GRAVITY}{FLOOR}{TIME}"
        ));
        let alone = Scene::from_toml(&alone, ".").unwrap().problem().unwrap().simulate().unwrap();
        let (mut lowest, mut off) = (0.0_f64, 0.0_f64);
        for k in 1..=300 {
            motion.step_to(alone.times()[k]).unwrap();
            let (found, tip) = (motion.shape().rods["a"].tip, alone.tip(k));
            off = (0..3).map(|c| (found[c] - tip[c]).abs()).fold(off, f64::max);
            lowest = lowest.min(found[1]);
        }
        println!("spatial {spatial}: lowest {lowest:.5} m, off by {off:.1e} m");
        // The floor holds the lower side of the rod: its axis stays above by nearly the radius.
        assert!(lowest < -0.016 && lowest > -0.0175, "{lowest}");
        assert!(off < 1e-9, "{off:e}");
    }
}

/// A rod of two welded pieces rests on a floor as one rod of the same length.
#[test]
fn welded_rod_rests_as_one_rod() {
    // The default stiffness depends on the length of the rod.
    let floor = format!("{FLOOR}stiffness = 1e10\n");
    let whole = |segments: usize| {
        structure_of(&[
            rod("a", segments, 0.3, [1.0, 0.0]),
            support("a.start", "clamped"),
            GRAVITY.into(),
            floor.clone(),
        ])
    };
    let welded = |segments: usize| {
        structure_of(&[
            rod("b", segments / 2, 0.15, [1.0, 0.0]),
            rod("a", segments / 2, 0.15, [1.0, 0.0]),
            joint("rigid", &["b.end", "a.start"], ""),
            support("b.start", "clamped"),
            GRAVITY.into(),
            floor.clone(),
        ])
    };
    let tip = |structure: &Structure| structure.equilibrium().unwrap().shape.rods["a"].tip;
    let off = [20, 40].map(|segments| {
        let [a, b] = [tip(&whole(segments)), tip(&welded(segments))];
        (0..3).map(|c| (a[c] - b[c]).abs()).fold(0.0, f64::max)
    });
    println!("off by {off:?} m, tip {:?}", tip(&welded(40)));
    // Second order in the edges; on the floor the deflection is about 2 cm.
    assert!(off[1] < 2e-5 && off[1] < 0.5 * off[0], "{off:?}");
    assert!((tip(&welded(40))[1] + 0.017).abs() < 5e-4);
}

/// The structure of these texts with soft material.
fn structure_of(parts: &[String]) -> Structure {
    let text = soft(steel() + &parts.concat());
    Structure::new(StructureScene::from_toml(&text, ".").unwrap()).unwrap()
}

/// A frame with a body that falls on a sphere and a floor, which moves up if `moved`.
fn falling(moved: bool, step: f64, scheme: &str) -> Structure {
    let motion = "motion = [{ displacement = [0, 0.01, 0], ramp = 0.1 }]\n";
    structure_of(&[
        rod("a", 10, 0.2, [1.0, 0.0]),
        rod("b", 8, 0.1, [0.6, -0.3]),
        "[[bodies]]\nname = \"bob\"\nmass = 0.02\ninertia = 3e-6\nposition = [0.3, -0.05, 0]\n".into(),
        joint("rigid", &["a.end", "b.start"], ""),
        joint("rigid", &["bob", "b.end"], ""),
        support("a.start", "clamped"),
        GRAVITY.into(),
        "[[contacts]]\nkind = \"sphere\"\ncenter = [0.12, -0.03, 0]\nradius = 0.015\nstiffness = 1e8\n".into(),
        "[[contacts]]\nkind = \"plane\"\npoint = [0, -0.08, 0]\nnormal = [0, 1, 0]\nstiffness = 1e8\n".into(),
        if moved { motion.into() } else { String::new() },
        format!("[time]\nend = 0.12\nstep = {step:e}\ntolerance = \"rounding\"\nscheme = \"{scheme}\"\n"),
    ])
}

/// Gradient and tangent of an assembly in contact, against differences and dual numbers.
#[test]
fn derivatives_in_contact_agree_with_dual_numbers() {
    let structure = falling(false, 1e-3, "newmark-beta");
    let mut motion = structure.simulation().unwrap();
    for k in 1..=100 {
        motion.step_to(1e-3 * f64::from(k)).unwrap();
    }
    assert!(motion.energies().own > 0.0, "no contact");
    let mut q = motion.simulation().state().q.clone();
    structure.at_rest().assembly.place_carried(&mut q, &structure.at_rest().frames);
    let tied: Vec<usize> = structure.at_rest().assembly.unknowns_without_effect().collect();
    check_derivatives(&structure, &q, 1e-7, 1e-9, &tied);
}

/// Derivatives of a motion with contacts by numbers of rods and contacts, from dual numbers and from differences.
#[test]
fn derivatives_of_a_motion_in_contact_agree_with_differences() {
    let structure = falling(true, 1e-3, "generalised-alpha");
    let times = || (1..=100).map(|k| 1e-3 * f64::from(k));
    let rods = structure.at_rest().assembly.body_coordinates().start;
    let end = |structure: &Structure| {
        let (mut motion, mut contact) = (structure.simulation().unwrap(), 0.0_f64);
        times().for_each(|t| {
            motion.step_to(t).unwrap();
            contact = contact.max(motion.energies().own);
        });
        assert!(contact > 0.0, "no contact");
        let mut q = motion.simulation().state().q.clone();
        let frames = &motion.simulation().state().frames;
        motion.simulation().rod().place_carried(&mut q, frames);
        q.truncate(rods);
        q
    };
    for path in [
        "materials.steel.youngs_modulus",
        "bodies.bob.mass",
        "contacts.0.stiffness",
        "contacts.0.center.y",
        "contacts.1.stiffness",
        "contacts.1.point.y",
        "contacts.1.motion.0.displacement.y",
    ] {
        check_motion_derivative(&structure, path, times(), end, 1e-6, [1e-9, 1e-4]);
    }
}

/// The total energy less the work of the moved obstacle is kept with an error of second order.
#[test]
fn moved_obstacle_does_the_work_that_the_energy_gains() {
    let changes = [1e-3, 5e-4, 2.5e-4].map(|step| {
        let structure = falling(true, step, "newmark-beta");
        let mut motion = structure.simulation().unwrap();
        let start = motion.energies().total();
        let time = structure.time().unwrap();
        let (mut change, mut kinetic) = (0.0_f64, 0.0_f64);
        for k in 1..=time.steps() {
            motion.step_to(time.at(k)).unwrap();
            let energies = motion.energies();
            change = change.max((energies.total() - start).abs());
            kinetic = kinetic.max(energies.kinetic);
        }
        change / kinetic
    });
    println!("energy changes by {changes:?} of the largest kinetic energy");
    assert!(changes[2] < 0.01 && changes[0] / changes[2] > 6.0, "{changes:?}");
}

/// The momentum of a free structure changes by weight and contact forces alone; the scheme takes the mean of both ends
/// of a step. In space the forces are those in the plane.
#[test]
fn contact_forces_change_the_momentum() {
    let mut impulses = Vec::new();
    for dimension in ["", "dimension = \"spatial\"\n"] {
        let body = rod("a", 10, 0.2, [1.0, 0.3]) + &rod("b", 8, 0.15, [0.4, 1.0]);
        let joint = joint("rigid", &["a.end", "b.start"], "");
        let time =
            "[time]\nend = 0.1\nstep = 2e-4\ntolerance = \"rounding\"\nscheme = \"newmark-beta\"\n";
        let material = twisting_steel();
        let text = soft(format!("{dimension}{material}{body}{joint}{GRAVITY}{FLOOR}{time}"));
        let structure = Structure::new(StructureScene::from_toml(&text, ".").unwrap()).unwrap();
        let mut motion = structure.simulation().unwrap();
        let weight = 7800.0 * std::f64::consts::PI * 9e-6 * 0.35 * 9.81;
        let (mut impulse, mut before, mut largest) = (0.0, 0.0, 0.0_f64);
        for k in 1..=500 {
            let last = motion.time();
            motion.step_to(2e-4 * f64::from(k)).unwrap();
            let [x, y, z] = motion.contact_forces()[0];
            assert!(x.abs() < 1e-9 && z.abs() < 1e-9, "{x} {z}");
            impulse += (0.5 * (before + y) - weight) * (motion.time() - last);
            (before, largest) = (y, largest.max(y));
        }
        assert!(largest > 2.0 * weight, "{largest}");
        impulses.push(impulse);
        if dimension.is_empty() {
            let momentum = motion.momentum()[1];
            println!("momentum {momentum:.6e}, impulse {impulse:.6e} N s, largest {largest:.2} N");
            assert!((momentum - impulse).abs() < 1e-9 * weight, "{momentum} {impulse}");
        }
    }
    assert!((impulses[0] - impulses[1]).abs() < 1e-6 * impulses[0].abs(), "{impulses:?}");
}

#[test]
fn contacts_that_a_structure_does_not_have_are_rejected() {
    let text = |contact: &str| {
        let parts = [
            rod("a", 8, 0.3, [1.0, 0.0]),
            support("a.start", "clamped"),
            contact.into(),
            "[time]\nend = 0.1\nstep = 1e-3\n".into(),
        ];
        steel() + &parts.concat()
    };
    let motion = "motion = [{ file = \"floor.csv\" }]\n";
    let beside = "[[contacts]]\nkind = \"cylinder\"\npoint = [0, -0.1, 0]\naxis = [0, 0, 1]\nradius = 0.099\n";
    for (contact, key) in [
        (format!("{FLOOR}{motion}"), "contacts[0].motion[0].file"),
        (FLOOR.replace("[0, 1, 0]", "[0, 0, 0]"), "contacts[0].normal"),
        (FLOOR.replace("-0.02", "0.001"), "contacts[0]"),
        (beside.replace("0.099", "0.1"), "contacts[0]"),
        (beside.replace("0.099", "-1"), "contacts[0].radius"),
    ] {
        let found = StructureScene::from_toml(&text(&contact), ".").and_then(Structure::new);
        let error = found.unwrap_err().to_string();
        assert!(error.contains(&format!("{key}:")), "{key}: {error}");
    }
    // Another scheme than those of contacts; without a scheme it is generalised-alpha.
    let rodas4 = text(FLOOR) + "scheme = \"rodas4\"\n";
    let found = StructureScene::from_toml(&rodas4, ".").and_then(Structure::new);
    let error = found.unwrap_err().to_string();
    assert!(error.starts_with("contacts:"), "{error}");
    // Ten steps make a hundred periods of the obstacle.
    let fast = format!("{FLOOR}motion = [{{ displacement = [0, -0.001, 0], frequency = 1e3 }}]\n");
    let structure = Structure::new(StructureScene::from_toml(&text(&fast), ".").unwrap()).unwrap();
    let error = structure.simulation().unwrap_err().to_string();
    assert!(error.contains("contacts[0].motion[0]"), "{error}");
    let plain = StructureScene::from_toml(&text(FLOOR), ".").unwrap();
    assert_eq!(plain.time.unwrap().scheme, rodfit::scene::Scheme::GeneralisedAlpha);
}
