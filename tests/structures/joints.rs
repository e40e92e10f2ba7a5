//! Rigid, hinged and sprung joints against closed forms of beams.

use crate::scenes::{bending, joint, line_density, rod, steel, structure, support};
use rodfit::{Structure, StructureScene};

/// Lowest `count` angular frequencies about the rest shape, rad/s.
pub fn frequencies(structure: &Structure, count: usize) -> Vec<f64> {
    let modes = structure.modes(count, true).unwrap().modes;
    modes.iter().map(|mode| mode.frequency_rad_s).collect()
}

/// Roots `beta L` of `cos cosh = -1`: a clamped beam with a free end.
const CANTILEVER: [f64; 3] = [1.875_104_068_711_961, 4.694_091_132_974_175, 7.854_757_438_237_613];

/// A cantilever of `pieces` rods of `segments` edges, welded end to end.
fn welded(pieces: usize, segments: usize) -> Structure {
    let names: Vec<String> = (0..pieces).map(|i| format!("piece{i}")).collect();
    let length = 0.5 / pieces as f64;
    let mut parts: Vec<String> =
        names.iter().map(|name| rod(name, segments, length, [1.0, 0.0])).collect();
    for pair in names.windows(2) {
        parts.push(joint(
            "rigid",
            &[&format!("{}.end", pair[0]), &format!("{}.start", pair[1])],
            "",
        ));
    }
    parts.push(support("piece0.start", "clamped"));
    structure(&parts)
}

/// The first three frequencies of a cantilever of five welded pieces, `beta^2 sqrt(EI/(m L^4))` with axial motion far
/// above; the error falls fourfold with half the edges.
#[test]
fn welded_pieces_have_the_frequencies_of_one_rod_to_second_order() {
    let scale = (bending() / line_density()).sqrt() / 0.25;
    let errors = |segments: usize| {
        let found = frequencies(&welded(5, segments), 3);
        let one_rod = frequencies(&welded(1, 5 * segments), 3);
        let exact = |i: usize| CANTILEVER[i].powi(2) * scale;
        [0, 1, 2].map(|i| [found[i] / exact(i) - 1.0, found[i] / one_rod[i] - 1.0])
    };
    let [coarse, fine] = [20, 40].map(errors);
    println!("{coarse:?} {fine:?}");
    for i in 0..3 {
        assert!(coarse[i][1].abs() < 5e-4, "{i}: {:e}", coarse[i][1]);
        let ratio = coarse[i][0] / fine[i][0];
        assert!((3.4..4.8).contains(&ratio), "{i}: {ratio}");
    }
}

/// A point mass at a joint of clamped ends counts in full, on whichever of the rods it is stated: the frequencies and the
/// deflection are those of one rod with the mass between two nodes, to second order in the edge.
#[test]
fn point_mass_at_a_joint_counts_in_full() {
    let mass = |at: &str| format!("mass = [{{ node = {at}, mass = 0.02 }}]\n");
    let gravity = "[loads]\ngravity = [0, -1.0, 0]\n".to_string();
    let one_rod = structure(&[
        rod("all", 100, 0.5, [1.0, 0.0]) + &mass("{ arc_length = 0.25 }"),
        support("all.start", "clamped"),
        gravity.clone(),
    ]);
    let welded = |kind: &str, more: &str, masses: [String; 2], dimension: &str| {
        let [first, second] = masses;
        let parts = [
            dimension.to_string(),
            rod("first", 50, 0.25, [1.0, 0.0]) + &first,
            rod("second", 50, 0.25, [1.0, 0.0]) + &second,
            joint(kind, &["first.end", "second.start"], more),
            support("first.start", "clamped"),
            gravity.clone(),
        ];
        let steel = steel() + "poisson_ratio = 0.3\n";
        let text = parts[0].clone() + &steel + &parts[1..].concat();
        Structure::new(StructureScene::from_toml(&text, ".").unwrap()).unwrap()
    };
    let sag = |structure: &Structure| {
        let rods = structure.equilibrium().unwrap().shape.rods;
        rods.values().next_back().unwrap().tip[1]
    };
    let none = String::new;
    let cases = [
        ("tip", welded("rigid", "", [mass("\"tip\""), none()], "")),
        ("start", welded("rigid", "", [none(), mass("{ arc_length = 0.0 }")], "")),
        ("space", welded("rigid", "", [mass("\"tip\""), none()], "dimension = \"spatial\"\n")),
        ("spring", welded("spring", "rotation = 1e-6", [none(), mass("{ arc_length = 0.0 }")], "")),
    ];
    let expected = frequencies(&one_rod, 2);
    for (name, found) in &cases {
        let mut lowest = frequencies(found, 4);
        // In space every frequency is there twice.
        lowest.dedup_by(|a, b| (*a / *b - 1.0).abs() < 1e-6);
        for (found, expected) in lowest.iter().zip(&expected) {
            println!("{name}: {:e}", found / expected - 1.0);
            assert!((found / expected - 1.0).abs() < 1e-3, "{name}: {found} {expected}");
        }
        let deflection = sag(found) / sag(&one_rod);
        println!("{name}: {:e}", deflection - 1.0);
        assert!((deflection - 1.0).abs() < 1e-3, "{name}: {deflection}");
    }
}

/// A beam of two pieces of `a` = 0.2 m between walls, with a joint in its middle and a small force there.
fn held_beam(kind: &str, more: &str, force: f64) -> Structure {
    structure(&[
        rod("a", 100, 0.2, [1.0, 0.0]),
        rod("b", 100, 0.2, [1.0, 0.0]),
        joint(kind, &["a.end", "b.start"], more),
        support("a.start", "clamped"),
        support("b.end", "clamped"),
        format!("[[loads.point]]\nrod = \"a\"\nnode = \"tip\"\nforce = [0, {force:e}, 0]\n"),
    ])
}

/// Deflection of a beam held at both ends under a force `P` in its middle: `P a^3/24EI` without a joint, `P a^3/6EI` with
/// a hinge; with a spring of the stiffness `k` the slope is `phi = (P a^2/4EI)/(1 + 2 k a/EI)`, the moment `2 k phi` and the
/// deflection `P a^3/6EI - 2 k phi a^2/2EI`.
#[test]
fn deflection_of_a_held_beam_with_a_joint_agrees_with_beam_theory() {
    let (force, a) = (1e-5, 0.2_f64);
    let unit = force * a.powi(3) / bending();
    let compliance = 0.3;
    let k = 1.0 / compliance;
    let phi = force * a * a / (4.0 * bending()) / (1.0 + 2.0 * k * a / bending());
    let sprung = unit / 6.0 - 2.0 * k * phi * a * a / (2.0 * bending());
    for (kind, more, expected) in [
        ("rigid", String::new(), unit / 24.0),
        ("ball", String::new(), unit / 6.0),
        ("spring", format!("rotation = {compliance}"), sprung),
    ] {
        let found = held_beam(kind, &more, force).equilibrium().unwrap();
        assert!(found.stable_in_plane);
        let deflection = found.shape.rods["a"].tip[1];
        println!("{kind}: {:e}", deflection / expected - 1.0);
        assert!((deflection / expected - 1.0).abs() < 1e-3, "{kind}: {deflection:e} {expected:e}");
    }
}

/// The lowest roots of an equation from 1e-3 on that are a hundredth apart, found from changes of sign.
pub fn roots(equation: &dyn Fn(f64) -> f64, count: usize) -> Vec<f64> {
    let (mut roots, mut x) = (Vec::new(), 1e-3);
    while roots.len() < count {
        if equation(x) * equation(x + 0.01) < 0.0 {
            let (mut low, mut high) = (x, x + 0.01);
            for _ in 0..60 {
                let middle = 0.5 * (low + high);
                *if equation(low) * equation(middle) <= 0.0 { &mut high } else { &mut low } =
                    middle;
            }
            roots.push(low);
        }
        x += 0.01;
    }
    roots
}

/// Frequency equation of a body of mass `m` and moment of inertia `J` on the end of a cantilever: with `x = beta L`,
/// `mu = m/(rho A L)` and `eta = J/(rho A L^3)`,
/// `1 + cos cosh - mu x (sin cosh - cos sinh) - eta x^3 (cosh sin + sinh cos) + mu eta x^4 (1 - cos cosh) = 0`.
pub fn stem_equation(mu: f64, eta: f64) -> impl Fn(f64) -> f64 {
    move |x| {
        let (s, c, sh, ch) = (x.sin(), x.cos(), x.sinh(), x.cosh());
        (1.0 + c * ch) - mu * x * (s * ch - c * sh) - eta * x.powi(3) * (ch * s + sh * c)
            + mu * eta * x.powi(4) * (1.0 - c * ch)
    }
}

/// The first three frequencies of a body on the end of a cantilever.
#[test]
fn frequencies_of_a_body_on_a_stem_satisfy_the_frequency_equation() {
    let (length, mass, inertia) = (0.5, 0.03, 4e-5);
    let body = format!(
        "[[bodies]]\nname = \"bob\"\nmass = {mass}\ninertia = {inertia}\nposition = [{length}, 0, 0]\n"
    );
    let stem = structure(&[
        rod("stem", 100, length, [1.0, 0.0]),
        body,
        "[[joints]]\nkind = \"rigid\"\nconnects = [{ body = \"bob\", offset = [0, 0, 0] }, { rod = \"stem\", at = \"end\" }]\n".into(),
        support("stem.start", "clamped"),
    ]);
    let line = line_density() * length;
    let equation = stem_equation(mass / line, inertia / (line * length * length));
    let scale = (bending() / line_density()).sqrt() / (length * length);
    for (found, root) in frequencies(&stem, 3).iter().zip(roots(&equation, 3)) {
        println!("{:e}", found / (root * root * scale) - 1.0);
        assert!(
            (found / (root * root * scale) - 1.0).abs() < 1e-3,
            "{found} {}",
            root * root * scale
        );
    }
}

/// Structures that cannot be built, with the key in the message.
#[test]
fn impossible_structures_are_rejected_with_their_key() {
    let two = |more: &str| {
        let text = crate::scenes::steel()
            + &rod("a", 10, 0.2, [1.0, 0.0])
            + &rod("b", 10, 0.2, [0.0, 1.0])
            + more;
        match StructureScene::from_toml(&text, ".").and_then(Structure::new) {
            Ok(_) => "accepted".to_string(),
            Err(error) => error.to_string(),
        }
    };
    let weld = joint("rigid", &["a.end", "b.start"], "");
    assert_eq!(two(&weld), "accepted");
    for (text, key) in [
        (String::new(), "rods.a: found neither joint nor support"),
        (joint("rigid", &["a.end", "c.start"], ""), "joints[0].connects[1].rod: found \"c\""),
        (joint("rigid", &["a.end"], ""), "joints[0].connects: found 1"),
        (
            weld.clone() + &support("a.end", "clamped"),
            "joints[0].connects[0]: found the end of rod a",
        ),
        (
            weld.clone() + &joint("rigid", &["a.start", "b.end"], ""),
            "joints[1]: found points that are",
        ),
        (
            weld.clone() + "[loads]\ngravity = [0, 0, -9.81]\n",
            "loads.gravity: found a direction out of",
        ),
        (weld.clone() + &support("a.start", "roller"), "supports[0].kind: found \"roller\""),
        (
            weld.clone() + "[[loads.point]]\nrod = \"zz\"\nforce = [1, 0, 0]\n",
            "loads.point[0].rod: found \"zz\"",
        ),
        (
            weld.clone() + "[[loads.point]]\nforce = [1, 0, 0]\n",
            "loads.point[0]: found neither rod nor body",
        ),
        (
            weld.clone() + "[[loads.point]]\nrod = \"a\"\nnode = 10\nforce = [1, 0, 0]\n",
            "loads.point[0].node: found node 10, which lies behind",
        ),
        (
            joint("spring", &["a.end", "b.start"], "rotation = 1e-30"),
            "joints[0].rotation: found 1e-30",
        ),
        (weld.clone() + "[time]\nend = 0.1\nstep = 0.2\n", "time.step: found 0.2"),
        (weld + "[initial]\nstate = \"shape\"\n", "initial.state: found shape"),
    ] {
        let message = two(&text);
        assert!(message.contains(key), "{key}: {message}");
    }
}

/// Numbers for three axes belong to a rotation in space, and a body with tilted principal axes turns out of the plane.
#[test]
fn planar_structures_reject_rotations_out_of_the_plane() {
    let error = |more: &str| {
        let text = "dimension = \"planar\"\n".to_string()
            + &steel()
            + &rod("a", 10, 0.2, [1.0, 0.0])
            + more
            + &support("a.start", "clamped");
        StructureScene::from_toml(&text, ".").and_then(Structure::new).err().map(|e| e.to_string())
    };
    let spring =
        |more: &str| rod("b", 10, 0.2, [0.0, 1.0]) + &joint("spring", &["a.end", "b.start"], more);
    let body = |orientation: &str| {
        format!(
            "[[bodies]]\nname = \"bob\"\nmass = 0.1\ninertia = [1e-5, 2e-5, 3e-5]\nposition = [0.2, 0, 0]\n\
             orientation = {orientation}\n"
        ) + &joint("rigid", &["bob", "a.end"], "")
    };
    for (text, key) in [
        (spring("rotation = 1.0\nrest = 0.1"), None),
        (
            spring("rotation = [1.0, 1.0, 2.0]"),
            Some("joints[0].rotation: found numbers for three axes"),
        ),
        (
            spring("rotation = 1.0\nrest = [0.1, 0.0, 0.0]"),
            Some("joints[0].rest: found numbers for"),
        ),
        (body("[0, 0, 0.4]"), None),
        (body("[1.5708, 0, 0]"), None),
        (body("[0.4, 0, 0]"), Some("bodies.bob.orientation: found a direction out of the plane")),
    ] {
        let found = error(&text);
        match key {
            None => assert_eq!(found, None, "{text}"),
            Some(key) => {
                assert!(found.as_deref().is_some_and(|found| found.contains(key)), "{found:?}")
            }
        }
    }
}

/// A structure that nothing holds has no unique equilibrium.
#[test]
fn equilibrium_of_a_floating_structure_under_gravity_is_rejected() {
    let parts = [
        rod("a", 10, 0.2, [1.0, 0.0]),
        rod("b", 10, 0.2, [0.0, 1.0]),
        joint("rigid", &["a.end", "b.start"], ""),
        "[loads]\ngravity = [0, -9.81, 0]\n".to_string(),
    ];
    assert!(structure(&parts).equilibrium().is_err());
}

/// A body on a rigid arm: its weight acts at its own center, so that the deflection of its rod is that of a force and a
/// moment at the end, `F a^3/3EI + F d a^2/2EI`, to second order in the edge length.
#[test]
fn weight_of_an_offset_body_acts_at_its_center() {
    let (length, distance, mass) = (0.2, 0.3, 1e-4);
    let error = |segments: usize| {
        let stem = structure(&[
            rod("stem", segments, length, [1.0, 0.0]),
            format!(
                "[[bodies]]\nname = \"bob\"\nmass = {mass}\ninertia = 1e-6\n\
                 position = [{}, 0, 0]\n",
                length + distance
            ),
            joint("rigid", &["bob", "stem.end"], ""),
            support("stem.start", "clamped"),
            "[loads]\ngravity = [0, -9.81, 0]\n".into(),
        ]);
        let found = stem.equilibrium().unwrap();
        let own = line_density() * 9.81 * length.powi(4) / 8.0;
        let force = mass * 9.81;
        let expected = force * (length.powi(3) / 3.0 + distance * length.powi(2) / 2.0) + own;
        -found.shape.rods["stem"].tip[1] * bending() / expected - 1.0
    };
    let [coarse, fine] = [20, 40].map(error);
    println!("{coarse:e} {fine:e}");
    assert!(fine.abs() < 1e-3 && (3.4..4.6).contains(&(coarse / fine)), "{coarse:e} {fine:e}");
}
