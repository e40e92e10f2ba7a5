//! Structures in space: derivatives, equilibria and modes against closed forms and planar structures.

use crate::derivative_checks::{check_derivatives, check_factors};
use crate::joints::{frequencies, roots, stem_equation};
use crate::scenes::{
    STEEL, bending, joint, line_density, mixed_in_space, rod, shear_modulus, spatial, spatial_rod,
    structure, support, torsion, twisting_steel,
};
use rodfit::rod::Rod;
use rodfit::{Structure, StructureScene};
use std::f64::consts::PI;

/// A deformed state of a structure in space, in which bodies have turned by tenths of a radian.
fn deformed(structure: &Structure) -> Vec<f64> {
    let at_rest = structure.at_rest();
    let first = at_rest.assembly.body_coordinates().start;
    let mut q = at_rest.q.clone();
    for (i, q) in q.iter_mut().enumerate() {
        // Angles of edges, places of nodes and bodies, and rotations, whose coordinates are lengths.
        let size = match i % 4 {
            3 => 0.1,
            _ if i >= first && (i - first) % 8 >= 4 => 2e-3,
            _ => 2e-3,
        };
        *q += size * (3.7 * i as f64).sin();
    }
    let tied: Vec<usize> = at_rest.assembly.unknowns_without_effect().collect();
    tied.into_iter().for_each(|i| q[i] = at_rest.q[i]);
    q
}

/// Oracle: central differences of the energy, and dual numbers of the gradient, along three directions.
#[test]
fn spatial_gradient_and_tangent_are_derivatives_of_the_energy() {
    let structure = mixed_in_space(8, "");
    let tied: Vec<usize> = structure.at_rest().assembly.unknowns_without_effect().collect();
    check_derivatives(&structure, &deformed(&structure), 1e-6, 1e-9, &tied);
}

/// Frames that follow to a state change neither energy nor strains there.
#[test]
fn moved_frames_keep_energy_and_strains() {
    let structure = mixed_in_space(8, "");
    let at_rest = structure.at_rest();
    let (assembly, q) = (&at_rest.assembly, deformed(&structure));
    let mut frames = at_rest.frames.clone();
    let (mut before, mut after) = (Vec::new(), Vec::new());
    assembly.strains(&q, &frames, &mut before);
    let energy = assembly.energies(&q, &frames).total();
    assembly.move_frames(&mut frames, &q);
    assembly.strains(&q, &frames, &mut after);
    let apart = before.iter().zip(&after).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(apart < 1e-12, "{apart:e}");
    assert!((assembly.energies(&q, &frames).total() / energy - 1.0).abs() < 1e-12);
}

/// Oracle: the dense matrix of all entries, its LU factors and its eigenvalues.
#[test]
fn spatial_factors_solve_and_count_as_the_dense_matrix() {
    let structure = mixed_in_space(7, "");
    let tied: Vec<usize> = structure.at_rest().assembly.unknowns_without_effect().collect();
    check_factors(&structure, &deformed(&structure), &tied);
}

/// Deflection of the tip of a right-angled bracket under a force `F` out of its plane:
/// `F a^3/3EI + F b^3/3EI + F b^2 a/GJ` (Castigliano), to second order in the edge length.
#[test]
fn bracket_deflects_out_of_its_plane_by_bending_and_torsion() {
    let (a, b, force) = (0.3_f64, 0.2_f64, 1e-4);
    let exact = force * ((a.powi(3) + b.powi(3)) / (3.0 * bending()) + b.powi(2) * a / torsion());
    let error = |segments: usize| {
        let bracket = spatial(&[
            rod("a", segments, a, [1.0, 0.0]),
            rod("b", segments, b, [0.0, 1.0]),
            joint("rigid", &["a.end", "b.start"], ""),
            support("a.start", "clamped"),
            format!("[[loads.point]]\nrod = \"b\"\nforce = [0, 0, {force:e}]\n"),
        ]);
        let found = bracket.equilibrium().unwrap();
        assert_eq!(found.stable, Some(true));
        found.shape.rods["b"].tip[2] / exact - 1.0
    };
    let [coarse, fine] = [20, 40].map(error);
    println!("{coarse:e} {fine:e}");
    assert!(fine.abs() < 1e-3 && (3.4..4.6).contains(&(coarse / fine)), "{coarse:e} {fine:e}");
}

/// Oracle: one rod in space. A joint between pieces of one rod has no effect, except on mode shapes of second order.
#[test]
fn welded_pieces_in_space_have_the_frequencies_of_one_rod() {
    let whole = frequencies(
        &spatial(&[spatial_rod("a", 100, 0.5, [0.6, 0.48, 0.64]), support("a.start", "clamped")]),
        6,
    );
    let mut parts: Vec<String> =
        (0..5).map(|i| spatial_rod(&format!("r{i}"), 20, 0.1, [0.6, 0.48, 0.64])).collect();
    for i in 0..4 {
        let ends = [format!("r{i}.end"), format!("r{}.start", i + 1)];
        parts.push(joint("rigid", &[&ends[0], &ends[1]], ""));
    }
    parts.push(support("r0.start", "clamped"));
    let pieces = frequencies(&spatial(&parts), 6);
    let exact = [1.875_104, 1.875_104, 4.694_091, 4.694_091, 7.854_757, 7.854_757];
    for ((piece, whole), root) in pieces.iter().zip(&whole).zip(exact) {
        let beam = f64::powi(root, 2) * (bending() / line_density()).sqrt() / 0.25;
        println!("{:e} {:e}", piece / whole - 1.0, whole / beam - 1.0);
        assert!((piece / whole - 1.0).abs() < 5e-4, "{piece} {whole}");
        assert!((whole / beam - 1.0).abs() < 1e-3, "{whole} {beam}");
    }
}

/// The lowest torsional frequency of a clamped rod of several pieces is `pi/2L sqrt(G/rho)`.
#[test]
fn welded_pieces_twist_as_one_rod() {
    let length = 0.02;
    let mut parts: Vec<String> =
        (0..3).map(|i| spatial_rod(&format!("r{i}"), 20, length / 3.0, [0.0, 0.0, 1.0])).collect();
    for i in 0..2 {
        let ends = [format!("r{i}.end"), format!("r{}.start", i + 1)];
        parts.push(joint("rigid", &[&ends[0], &ends[1]], ""));
    }
    parts.push(support("r0.start", "clamped"));
    let found = frequencies(&spatial(&parts), 12);
    let exact = PI / (2.0 * length) * (shear_modulus() / STEEL[1]).sqrt();
    let nearest = found.iter().map(|w| (w / exact - 1.0).abs()).fold(f64::INFINITY, f64::min);
    println!("{nearest:e}");
    assert!(nearest < 1e-3, "{nearest:e}: {found:?} {exact}");
}

/// Parts of a portal frame.
fn portal(segments: usize) -> Vec<String> {
    vec![
        rod("left", segments, 0.3, [0.0, 1.0]),
        rod("beam", segments, 0.4, [1.0, 0.0]),
        rod("right", segments, 0.3, [0.0, -1.0]),
        joint("rigid", &["left.end", "beam.start"], ""),
        joint("rigid", &["beam.end", "right.start"], ""),
        support("left.start", "clamped"),
        support("right.end", "clamped"),
    ]
}

/// Parts of a tee with a hinge, whose axis is the normal.
fn tee(segments: usize) -> Vec<String> {
    vec![
        rod("left", segments, 0.2, [1.0, 0.0]),
        rod("right", segments, 0.25, [1.0, 0.0]),
        rod("stem", segments, 0.3, [0.0, -1.0]),
        joint("rigid", &["left.end", "right.start", "stem.start"], ""),
        support("left.start", "clamped"),
        support("right.end", "clamped"),
        support("stem.end", "pinned"),
    ]
}

/// Frequencies in the plane are among those in space, and the equilibrium is the same.
#[test]
fn planar_frames_given_in_space_have_the_planar_results() {
    let load = |rod: &str| {
        format!(
            "[loads]\ngravity = [0, -9.81, 0]\n[[loads.point]]\nrod = \"{rod}\"\nnode = 5\nforce = [0.2, -0.1, 0]\n"
        )
    };
    for (mut parts, loaded) in [(portal(12), "beam"), (tee(12), "right")] {
        parts.push(load(loaded));
        let (plane, space) = (structure(&parts), spatial(&parts));
        let [own, all] = [(&plane, 3), (&space, 8)].map(|(s, count)| frequencies(s, count));
        for w in &own {
            let nearest = all.iter().map(|v| (v / w - 1.0).abs()).fold(f64::INFINITY, f64::min);
            println!("{nearest:e}");
            assert!(nearest < 1e-7, "{w}: {all:?}");
        }
        let [a, b] = [plane.equilibrium().unwrap(), space.equilibrium().unwrap()];
        assert!((a.energy / b.energy - 1.0).abs() < 1e-9, "{} {}", a.energy, b.energy);
        for (name, rod) in &a.shape.rods {
            for (x, y) in rod.nodes.iter().zip(&b.shape.rods[name].nodes) {
                assert!((0..3).all(|c| (x[c] - y[c]).abs() < 1e-9), "{name} {x:?} {y:?}");
            }
        }
    }
}

/// Frequencies of a bracket between two walls out of its plane against the dynamic stiffness of both beams in bending and
/// torsion at the joint: deflection, and rotations about both arms.
#[test]
fn bracket_vibrates_out_of_its_plane_as_dynamic_stiffness_predicts() {
    let (a, b) = (0.3, 0.2);
    // Dynamic stiffness of a beam at an end, the other one clamped, by deflection and rotation (Banerjee 1997,
    // doi:10.1016/S0045-7949(96)00126-8), and in torsion.
    let beam = |w: f64, l: f64| {
        let x = (line_density() * w * w / bending()).powf(0.25) * l;
        let (s, c, sh, ch) = (x.sin(), x.cos(), x.sinh(), x.cosh());
        let unit = bending() / l.powi(3) / (1.0 - c * ch);
        let twist = w * (STEEL[1] / shear_modulus()).sqrt() * l;
        [
            unit * x.powi(3) * (c * sh + s * ch),
            unit * l * x * x * s * sh,
            unit * l * l * x * (s * ch - c * sh),
            torsion() / l * twist / twist.tan(),
        ]
    };
    let determinant = |w: f64| {
        let ([k1, m1, r1, t1], [k2, m2, r2, t2]) = (beam(w, a), beam(w, b));
        // Deflection, rotation about the first arm, and about the second.
        let matrix = nalgebra::Matrix3::new(k1 + k2, m2, m1, m2, r2 + t1, 0.0, m1, 0.0, r1 + t2);
        (matrix / (bending() * 1e2)).determinant()
    };
    let mut exact = Vec::new();
    let mut w = 50.0;
    while exact.len() < 3 && w < 2e4 {
        let (low, high) = (determinant(w), determinant(w + 1.0));
        if low * high < 0.0 && low.abs().max(high.abs()) < 1e3 * low.abs().min(high.abs()) {
            let (mut x, mut y) = (w, w + 1.0);
            for _ in 0..60 {
                let middle = 0.5 * (x + y);
                *if determinant(x) * determinant(middle) <= 0.0 { &mut y } else { &mut x } = middle;
            }
            if determinant(x).abs() < low.abs().max(high.abs()) {
                exact.push(x);
            }
        }
        w += 1.0;
    }
    let parts = |segments: usize| {
        [
            rod("a", segments, a, [1.0, 0.0]),
            rod("b", segments, b, [0.0, 1.0]),
            joint("rigid", &["a.end", "b.start"], ""),
            support("a.start", "clamped"),
            support("b.end", "clamped"),
        ]
    };
    let all = frequencies(&spatial(&parts(100)), 12);
    let planar = frequencies(&structure(&parts(100)), 8);
    let out: Vec<f64> =
        all.into_iter().filter(|w| planar.iter().all(|own| (w / own - 1.0).abs() > 1e-6)).collect();
    for (found, exact) in out.iter().zip(&exact) {
        println!("{found} {exact} {:e}", found / exact - 1.0);
    }
    for (found, exact) in out.iter().zip(&exact) {
        assert!((found / exact - 1.0).abs() < 1e-3, "{out:?} {exact:?}");
    }
}

/// A body with three moments of inertia on a stem: bending in both planes by the frequency equation, and torsion by
/// `x tan x = rho Jp L/I`.
#[test]
fn body_with_rotary_inertia_on_a_stem_satisfies_the_frequency_equations() {
    let (length, mass, inertia) = (0.2, 0.01, [4e-6, 6e-6, 9e-6]);
    let stem = spatial(&[
        spatial_rod("stem", 100, length, [1.0, 0.0, 0.0]),
        format!(
            "[[bodies]]\nname = \"bob\"\nmass = {mass}\ninertia = {inertia:?}\nposition = [{length}, 0, 0]\n"
        ),
        "[[joints]]\nkind = \"rigid\"\nconnects = [{ body = \"bob\", offset = [0, 0, 0] }, { rod = \"stem\", at = \"end\" }]\n".into(),
        support("stem.start", "clamped"),
    ]);
    let line = line_density() * length;
    let mut exact = Vec::new();
    // Deflection along z turns the body about y, along y about z.
    for own in [inertia[1], inertia[2]] {
        let equation = stem_equation(mass / line, own / (line * length * length));
        let scale = (bending() / line_density()).sqrt() / (length * length);
        exact.extend(roots(&equation, 2).into_iter().map(|x| x * x * scale));
    }
    let polar = STEEL[1] * PI * STEEL[2].powi(4) / 2.0 * length;
    let twist = roots(&|x: f64| x * x.sin() - polar / inertia[0] * x.cos(), 1)[0];
    exact.push(twist / length * (shear_modulus() / STEEL[1]).sqrt());
    exact.sort_by(f64::total_cmp);
    let found = frequencies(&stem, 5);
    for (found, exact) in found.iter().zip(&exact) {
        println!("{found} {exact} {:e}", found / exact - 1.0);
    }
    for (found, exact) in found.iter().zip(&exact) {
        assert!((found / exact - 1.0).abs() < 1e-3, "{found} {exact}");
    }
}

/// A hinge transmits moments across its axis: under a force along the axis the beam bends as one piece. A spring adds its
/// compliance by the moment about each axis.
#[test]
fn hinges_and_springs_turn_about_their_axes() {
    let (a, b, force) = (0.2, 0.15, 1e-4);
    let tip = |kind: &str, more: &str| {
        let beam = spatial(&[
            rod("a", 40, a, [1.0, 0.0]),
            rod("b", 40, b, [1.0, 0.0]),
            rod("c", 40, b, [0.0, 1.0]),
            joint(kind, &["a.end", "b.start"], more),
            joint("rigid", &["b.end", "c.start"], ""),
            support("a.start", "clamped"),
            format!("[[loads.point]]\nrod = \"c\"\nforce = [0, 0, {force:e}]\n"),
        ]);
        beam.equilibrium().unwrap().shape.rods["c"].tip[2]
    };
    let rigid = tip("rigid", "");
    // A force along z bends about y; the hinge turns about z only, where tension holds it.
    let straight = |kind: &str, more: &str| {
        let beam = spatial(&[
            rod("a", 40, a, [1.0, 0.0]),
            rod("b", 40, b, [1.0, 0.0]),
            joint(kind, &["a.end", "b.start"], more),
            support("a.start", "clamped"),
            format!("[[loads.point]]\nrod = \"b\"\nforce = [1e-3, 0, {force:e}]\n"),
        ]);
        beam.equilibrium().unwrap().shape.rods["b"].tip[2]
    };
    let [hinged, whole] = [straight("hinge", "axis = [0, 0, 2.0]"), straight("rigid", "")];
    println!("{:e}", hinged / whole - 1.0);
    assert!((hinged / whole - 1.0).abs() < 1e-5, "{hinged} {whole}");
    // Directors of the clamp are y and z, and its tangent is x.
    let [across, other, twist] = [0.02, 0.5, 0.03];
    let sprung = tip("spring", &format!("rotation = [{across}, {other}, {twist}]"));
    let expected = force * (across * b * b + twist * b * b);
    println!("{} {expected}", sprung - rigid);
    assert!(((sprung - rigid) / expected - 1.0).abs() < 1e-3, "{} {expected}", sprung - rigid);
}

/// A rod between two balls spins about itself: that motion is reported, and the equilibrium is stable.
#[test]
fn rod_between_balls_spins_in_a_stable_equilibrium() {
    let found = spatial(&[
        rod("left", 10, 0.2, [0.0, 1.0]),
        rod("bar", 10, 0.3, [1.0, 0.0]),
        rod("right", 10, 0.2, [0.0, -1.0]),
        joint("ball", &["left.end", "bar.start"], ""),
        joint("ball", &["bar.end", "right.start"], ""),
        support("left.start", "clamped"),
        support("right.end", "clamped"),
        "[loads]\ngravity = [0, -9.81, 1.0]\n".into(),
    ])
    .equilibrium()
    .unwrap();
    let counts = (found.negative_directions, found.marginal_directions, found.spinning_rods);
    assert_eq!((found.stable, counts), (Some(true), (0, 0, 1)));
}

/// What a structure in space needs, with the key in the message.
#[test]
fn incomplete_structures_in_space_are_rejected_with_their_key() {
    let message = |more: &str| {
        let text = "dimension = \"spatial\"\n".to_string()
            + &twisting_steel()
            + &rod("a", 10, 0.2, [1.0, 0.0])
            + &rod("b", 10, 0.2, [0.0, 1.0])
            + &support("a.start", "clamped")
            + more;
        match StructureScene::from_toml(&text, ".").and_then(Structure::new) {
            Ok(structure) => match structure.scene().time {
                Some(_) => {
                    structure.simulation().err().map_or("accepted".into(), |e| e.to_string())
                }
                None => "accepted".to_string(),
            },
            Err(error) => error.to_string(),
        }
    };
    let weld = joint("rigid", &["a.end", "b.start"], "");
    assert_eq!(message(&weld), "accepted");
    let body = |inertia: &str| {
        format!(
            "[[bodies]]\nname = \"bob\"\nmass = 1.0\ninertia = {inertia}\nposition = [0.2, 0.2, 0.1]\n"
        ) + &joint("rigid", &["bob", "b.end"], "")
    };
    let time = |scheme: &str| {
        weld.clone() + &format!("[time]\nend = 0.1\nstep = 1e-3\nscheme = \"{scheme}\"\n")
    };
    assert_eq!(message(&time("generalised-alpha")), "accepted");
    for (text, key) in [
        (joint("hinge", &["a.end", "b.start"], ""), "joints[0].axis: found no direction"),
        (
            joint("spring", &["a.end", "b.start"], "rotation = 1.0\nrest = 0.2"),
            "joints[0].rest: found 0.2",
        ),
        (
            joint("spring", &["a.end", "b.start"], "rotation = [1.0, 1e-30, 1.0]"),
            "joints[0].rotation: found 1e-30",
        ),
        (weld.clone() + &body("1e-3"), "bodies.bob.inertia: found one number"),
        (weld.clone() + &body("[1e-3, 1e-3, 3e-3]"), "bodies.bob.inertia: found"),
        (time("average-vector-field"), "time.scheme: found \"average-vector-field\""),
        (time("rodas4"), "time.scheme: found \"rodas4\""),
        (time("verlet"), "time.scheme: found \"verlet\""),
        (time("pefrl"), "time.scheme: found \"pefrl\""),
    ] {
        let message = message(&text);
        assert!(message.contains(key), "{key}: {message}");
    }
    // A load out of the plane makes a structure spatial.
    let text = twisting_steel()
        + &rod("a", 10, 0.2, [1.0, 0.0])
        + &support("a.start", "clamped")
        + "[loads]\ngravity = [0, 0, -9.81]\n[[loads.point]]\nrod = \"a\"\nforce = [0, 1e-3, 0]\n";
    let found = Structure::new(StructureScene::from_toml(&text, ".").unwrap()).unwrap();
    assert!(found.at_rest().assembly.is_spatial());
}
