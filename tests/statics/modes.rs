//! Frequencies of small vibrations against beam theory.

use rodfit::scene::{
    Dimension, Handedness, InitialState, Material, Point, PointForce, Scene, Section, Shape,
    Support, Time,
};
use rodfit::vibration::{LinearizationPoint, ModeKind, ModePlane, Modes};
use std::f64::consts::PI;

use crate::common::{at_tip, rest, simulate};

const MODULUS: f64 = 1e8;
const DENSITY: f64 = 1000.0;
const RADIUS: f64 = 5e-3;

/// A straight rod of 0.5 m with G = E/3.
fn rod(segments: usize, start: Support, end: Support) -> Scene {
    let shape = Shape::Straight { length: 0.5, direction: [0.6, 0.8, 0.0] };
    let material = Material { poisson_ratio: Some(0.5), ..Material::new(DENSITY, MODULUS) };
    let mut scene = Scene::new(segments, shape, Section::Circle { radius: RADIUS }, material);
    (scene.supports.start, scene.supports.end) = (start, end);
    scene
}

fn modes(scene: &Scene, count: usize) -> Modes {
    scene.problem().unwrap().modes(count, LinearizationPoint::Equilibrium).unwrap()
}

/// Frequencies, rad/s, of the modes in one plane.
fn in_plane(modes: &Modes, plane: ModePlane) -> Vec<f64> {
    modes.modes.iter().filter(|m| m.plane == Some(plane)).map(|m| m.frequency_rad_s).collect()
}

/// Frequencies of the modes of one kind, without free motions, rad/s.
fn of_kind(modes: &Modes, plane: Option<ModePlane>, kind: ModeKind) -> Vec<f64> {
    let own = modes.modes.iter().filter(|m| m.plane == plane && m.kind == kind);
    own.filter(|m| m.frequency_rad_s != 0.0).map(|m| m.frequency_rad_s).collect()
}

/// Roots of the beam's frequency equations: omega = (beta/L)^2 sqrt(EI/(rho A)), every one twice.
#[test]
fn bending_frequencies_agree_with_beam_theory() {
    use Support::{Clamped, Free, Pinned};
    let unit = (MODULUS * RADIUS * RADIUS / (4.0 * DENSITY)).sqrt() / 0.25;
    for (start, end, zeros, roots) in [
        (Clamped, Free, 0, [1.87510407, 4.69409113, 7.85475744]),
        (Pinned, Pinned, 0, [PI, 2.0 * PI, 3.0 * PI]),
        (Clamped, Clamped, 0, [4.73004074, 7.85320462, 10.99560784]),
        (Free, Free, 3, [4.73004074, 7.85320462, 10.99560784]),
        (Clamped, Pinned, 0, [3.92660231, 7.06858275, 10.21017612]),
    ] {
        let errors = [50, 100].map(|segments| {
            let found = modes(&rod(segments, start, end), 40);
            let planar = in_plane(&found, ModePlane::In);
            assert!(planar[..zeros].iter().all(|w| *w == 0.0), "{planar:?}");
            let bending = &planar[zeros..];
            [0, 1, 2].map(|k| bending[k] / (roots[k] * roots[k] * unit) - 1.0)
        });
        let order: Vec<f64> = (0..3).map(|k| (errors[0][k] / errors[1][k]).log2()).collect();
        println!("{start:?} {end:?}: errors {:e} order {order:.2?}", errors[1][0]);
        for k in 0..3 {
            // The slender rod of the theory has no axial and no rotational inertia: 1e-4.
            assert!(errors[1][k].abs() < 2e-3, "{errors:?}");
            assert!(order[k] > 1.7 || errors[1][k].abs() < 2e-4, "{order:?} {errors:?}");
        }
        // Out of the plane the same, and torsion beside it.
        let found = modes(&rod(50, start, end), 6 + 2 * zeros);
        let (inside, outside) = (in_plane(&found, ModePlane::In), in_plane(&found, ModePlane::Out));
        assert!((inside[zeros] / outside.iter().find(|w| **w > 0.0).unwrap() - 1.0).abs() < 1e-9);
    }
}

/// A roller takes the model's axes along; out of the plane it holds as a hinge does.
#[test]
fn hinge_and_roller_frequencies_agree_in_and_out_of_plane() {
    for direction in [[1.0, 0.0, 0.0], [0.6, 0.8, 0.0], [0.0, 0.3, 0.1]] {
        let mut scene = rod(40, Support::Pinned, Support::Roller);
        scene.rod.shape = Shape::Straight { length: 0.5, direction };
        let found = modes(&scene, 8);
        let [inside, outside] = [ModePlane::In, ModePlane::Out].map(|plane| {
            let resisted = in_plane(&found, plane).into_iter().filter(|w| *w > 0.0);
            resisted.take(2).collect::<Vec<f64>>()
        });
        for k in 0..2 {
            // A hinge holds alike in both planes: rounding errors.
            assert!((inside[k] / outside[k] - 1.0).abs() < 1e-9, "{inside:?} {outside:?}");
        }
    }
}

/// Torsion and stretch of a clamped rod: odd quarter waves.
#[test]
fn torsional_and_axial_frequencies_are_odd_quarter_waves() {
    let found = modes(&rod(100, Support::Clamped, Support::Free), 40);
    // A chain of springs and masses has (2 c/l) sin(k l/2) for c k, less by (k l)^2/24: 9.3e-5
    // of three quarter waves. The wall adds a third-order error.
    for (speed, plane, kind, allowed) in [
        ((MODULUS / 3.0 / DENSITY).sqrt(), ModePlane::Out, ModeKind::Torsion, 1e-4),
        ((MODULUS / DENSITY).sqrt(), ModePlane::In, ModeKind::Axial, 1.1e-4),
    ] {
        for (k, quarters) in [1.0, 3.0].into_iter().enumerate() {
            let exact = quarters * 0.5 * PI / 0.5 * speed;
            let off = (of_kind(&found, Some(plane), kind)[k] / exact - 1.0).abs();
            println!("{kind:?}, {quarters} quarter waves: {off:.1e}");
            assert!(off < allowed, "{kind:?} {quarters}: {off}");
        }
    }
}

/// The listed modes have the number by which a frequency with a kind names them.
#[test]
fn table_has_the_numbers_of_each_kind() {
    let rod = rod(20, Support::Clamped, Support::Free);
    let found = modes(&rod, 40);
    let text = found.to_string();
    assert!(text.contains("of its kind"), "{text}");
    let torsion = text.lines().find(|line| line.contains("torsion")).unwrap();
    // The first torsion follows bending modes out of the plane.
    assert!(torsion.trim_end().ends_with(" 1"), "{text}");
    let first = modes(&rod, 2).to_string();
    assert!(!first.contains("of its kind"), "{first}");
}

/// Two thousand segments, with the rounding errors of the band matrix.
#[test]
fn frequencies_on_two_thousand_segments_agree_with_beam_theory() {
    let mut scene = rod(2000, Support::Clamped, Support::Free);
    scene.material.poisson_ratio = None;
    let found = modes(&scene, 3);
    let unit = (MODULUS * RADIUS * RADIUS / (4.0 * DENSITY)).sqrt() / 0.25;
    for (w, root) in found.frequencies_rad_s.iter().zip([1.87510407, 4.69409113, 7.85475744]) {
        // Rounding errors of the tangent go with the fourth power of the mesh: eps N^4/12 = 3e-4.
        assert!((w / (root * root * unit) - 1.0).abs() < 1e-3, "{found}");
    }
}

/// A pull stiffens a hinged rod: omega^2 = (k L)^4 + P (k L)^2 in units of the rod, k = pi/L; a push
/// beyond the critical one makes the straight state unstable.
#[test]
fn axial_load_changes_frequencies_and_stability_as_in_theory() {
    let bending = MODULUS * PI * RADIUS.powi(4) / 4.0;
    let line = DENSITY * PI * RADIUS * RADIUS;
    for load in [1.0, 5.0, -0.9, -3.0] {
        // The load in units of the column's own critical one, clamped at one end: pi^2 EI/(4 L^2).
        let critical = PI * PI / 4.0 * bending / 0.25;
        let mut scene = rod(100, Support::Clamped, Support::Free);
        scene.rod.shape = Shape::Straight { length: 0.5, direction: [1.0, 0.0, 0.0] };
        let force = [load * critical, 0.0, 0.0];
        scene.loads.point = at_tip(force);
        let lowest = modes(&scene, 1).frequencies_rad_s[0];
        let free = 1.87510407_f64.powi(2) * (bending / line).sqrt() / 0.25;
        println!("{load} of the critical load: {lowest:.5} rad/s against {free:.5} without");
        match load {
            l if l < -1.0 => assert!(lowest < 0.0),
            l if l < 0.0 => assert!(lowest > 0.0 && lowest < 0.4 * free),
            _ => assert!(lowest > free),
        }
    }
}

/// A rod at rest stays at rest; slightly plucked it swings with its lowest frequency.
#[test]
fn plucked_rod_swings_at_its_lowest_frequency() {
    let mut helix = rod(40, Support::Clamped, Support::Free);
    helix.rod.shape = Shape::Helix {
        length: 0.5,
        radius: 0.02,
        pitch: 0.05,
        axis: [0.0, 0.0, -1.0],
        handedness: Handedness::Right,
    };
    for (mut scene, down, pluck) in [
        (rod(40, Support::Clamped, Support::Free), [7.84, -5.88, 0.0], [0.8, -0.6, 0.0]),
        (helix, [0.0, 0.0, -9.8], [0.0, 1.0, 0.0]),
    ] {
        scene.loads.gravity = down;
        scene.initial.state = InitialState::Equilibrium;
        let lowest = modes(&scene, 2).frequencies_rad_s;
        let period = 2.0 * PI / lowest[0];
        scene.time = Some(Time::new(3.0 * period, period / 200.0));
        let still = simulate(&scene);
        let tip = |run: &rodfit::Trajectory, k: usize| nalgebra::Vector3::from(run.node(40, k));
        let moved = (0..600).map(|k| (tip(&still, k) - tip(&still, 0)).norm()).fold(0.0, f64::max);
        // The equilibrium is stationary: rounding errors.
        assert!(moved < 1e-9, "{moved:e}");

        let force = pluck.map(|f| 1e-5 * f);
        scene.initial.point = at_tip(force);
        let run = simulate(&scene);
        let along = nalgebra::Vector3::from(pluck);
        let swing: Vec<f64> =
            (0..=600).map(|k| along.dot(&(tip(&run, k) - tip(&still, 0)))).collect();
        assert!(swing[0] > 0.0);
        // From one falling zero to the last.
        let zeros: Vec<f64> = (0..600)
            .filter(|k| swing[*k] > 0.0 && swing[k + 1] <= 0.0)
            .map(|k| k as f64 + swing[k] / (swing[k] - swing[k + 1]))
            .collect();
        let found = (zeros[zeros.len() - 1] - zeros[0]) / (zeros.len() - 1) as f64 / 200.0;
        println!("period over that of the lowest mode: {found:.4}");
        // Higher modes are in the pluck too, and the helix's two lowest differ by a per cent.
        assert!((found - 1.0).abs() < 0.02, "{found}");
    }
}

/// A free bar, as in impulse excitation: its modes are separated in the plane, out of it and in space, and free motions have
/// no number.
#[test]
fn free_bar_modes_are_separated_by_plane_and_kind() {
    let (e, g, rho, length) = (69e9, 26e9, 2700.0, 0.4);
    let (width, height) = (0.02, 0.004);
    let shape = |direction| Shape::Straight { length, direction };
    let material = Material { shear_modulus: Some(g), ..Material::new(rho, e) };
    for (direction, up, dimension) in [
        ([1.0, 0.0, 0.0], [0.0, 1.0, 0.0], Dimension::Auto),
        ([0.3, -0.7, 0.2], [0.0, 0.2, 0.7], Dimension::Auto),
        ([0.3, -0.7, 0.2], [0.1, 0.2, 0.9], Dimension::Spatial),
    ] {
        let section = Section::Rectangle { width, height, up };
        let mut scene = Scene::new(100, shape(direction), section, material.clone());
        (scene.supports.start, scene.rod.dimension) = (Support::Free, dimension);
        let found = modes(&scene, 40);
        assert_eq!(found.unstable, 0);
        let free = found.modes.iter().take_while(|m| m.frequency_rad_s == 0.0);
        assert!(free.clone().all(|m| m.kind == ModeKind::Rigid && m.number.is_none()), "{found}");
        assert_eq!(free.count(), 6, "{found}");
        // Six rigid motions are followed by elastic modes, which have numbers.
        assert!(found.modes[6..].iter().all(|m| m.kind != ModeKind::Rigid && m.number.is_some()));

        let i = width * height.powi(3) / 12.0;
        let unit = (e * i / (rho * width * height)).sqrt() / (length * length);
        let flat = [4.73004074_f64, 7.85320462, 10.99560784].map(|b| b * b * unit);
        // J of the section from the scene: Saint-Venant's for 5 to 1 is 0.2913 w h^3.
        let polar = width * height * (width * width + height * height) / 12.0;
        let torsion = PI / length * (g * 0.29132 * width * height.powi(3) / (rho * polar)).sqrt();
        let axial = PI / length * (e / rho).sqrt();
        let spatial = dimension == Dimension::Spatial;
        let [inside, outside] =
            if spatial { [None; 2] } else { [Some(ModePlane::In), Some(ModePlane::Out)] };
        let bending = of_kind(&found, inside, ModeKind::Bending);
        for (w, exact) in bending.iter().zip(flat) {
            // Lumped masses at 100 segments; in space, edgewise ones stand among them.
            assert!((w / exact - 1.0).abs() < 2e-3, "{w} {exact} {found}");
            if spatial {
                break;
            }
        }
        let first = |plane, kind| of_kind(&found, plane, kind)[0];
        assert!(
            (first(outside, ModeKind::Torsion) / torsion - 1.0).abs() < 3e-4,
            "{torsion} {found}"
        );
        // Half waves of a free bar in torsion and in tension, with the error of the mesh.
        assert!((first(inside, ModeKind::Axial) / axial - 1.0).abs() < 3e-4, "{axial} {found}");
        if !spatial {
            let edgewise = first(outside, ModeKind::Bending) / flat[0];
            // Bending frequencies are proportional to the height of the section in their plane.
            assert!((edgewise / (width / height) - 1.0).abs() < 1e-3, "{edgewise}");
        }
    }
}

/// A curved rod that nothing holds, loads that hold each other, and a hinged one.
#[test]
fn free_motions_have_zero_frequency_and_no_number() {
    let mut arc = rod(40, Support::Free, Support::Free);
    arc.rod.shape = Shape::Arc { length: 0.5, angle: 1.0 };
    let mut pulled = rod(40, Support::Free, Support::Free);
    let on = |node, force| PointForce { node, force, ..PointForce::default() };
    pulled.loads.point =
        vec![on(Point::Tip, [6e-4, 8e-4, 0.0]), on(Point::Node(0), [-6e-4, -8e-4, 0.0])];
    let mut hanging = rod(40, Support::Pinned, Support::Free);
    hanging.loads.gravity = [0.06, 0.08, 0.0];
    // In plane and across: what is free, and what only loads resist.
    for (name, scene, free, swings) in
        [("arc", arc, 6, 0), ("pulled", pulled, 4, 2), ("hanging", hanging, 1, 2)]
    {
        let found = modes(&scene, 14);
        let rigid = found.modes.iter().filter(|m| m.kind == ModeKind::Rigid);
        let [none, some] = [true, false]
            .map(|zero| rigid.clone().filter(|m| (m.frequency_rad_s == 0.0) == zero).count());
        assert_eq!((none, some, found.unstable), (free, swings, 0), "{name}: {found}");
        let static_ = rest(&scene);
        assert_eq!(static_.stable, Some(true), "{name}: {static_}");
        if name == "hanging" {
            // sqrt(3 g/(2 L)), and a little faster as it cannot bend with the swing for nothing.
            let exact = (1.5 * 0.1 / 0.5_f64).sqrt();
            assert!((found.frequencies_rad_s[1] / exact - 1.0).abs() < 2e-3, "{found}");
            assert_eq!(found.modes[1].number, Some(1));
        }
    }
}

/// Far above its buckling weight a strip on edge has many unstable modes. The fastest is found for every count, and all are
/// counted, as many as the static analysis finds.
#[test]
fn all_unstable_modes_are_counted_and_listed() {
    let mut strip = Scene::new(
        60,
        Shape::Straight { length: 1.0, direction: [1.0, 0.0, 0.0] },
        Section::Rectangle { width: 4e-4, height: 0.02, up: [0.0, 1.0, 0.0] },
        Material { poisson_ratio: Some(0.4), ..Material::new(2000.0, 5e7) },
    );
    strip.loads.gravity = [0.0, -9.81, 0.0];
    let mut column = rod(80, Support::Clamped, Support::Free);
    column.rod.shape = Shape::Straight { length: 0.5, direction: [0.0, 1.0, 0.0] };
    column.loads.gravity = [0.0, -900.0, 0.0];
    for (name, scene) in [("strip", strip), ("column", column)] {
        let expected = rest(&scene).negative_directions;
        println!("{name}: {expected} directions");
        assert!(expected > 3);
        // With all there are, subspace iteration is a dense solution.
        let all = modes(&scene, 1000).frequencies_rad_s;
        for count in [1, 3, 10, 20] {
            let found = modes(&scene, count);
            let growing: Vec<f64> =
                found.frequencies_rad_s.iter().copied().filter(|w| *w < 0.0).collect();
            assert_eq!((growing.len(), found.unstable), (expected, expected), "{name} {count}");
            for (w, exact) in found.frequencies_rad_s.iter().zip(&all) {
                // The modes do not depend on their requested number, up to the tolerance of the eigenvalues.
                assert!((w / exact - 1.0).abs() < 1e-7, "{name} {count}: {w} {exact}");
            }
        }
    }
}

/// Rounding errors of a rigid motion are those of the stiffer bending direction: a strip of 20 mm by 6 mm, or 60 mm by 3 mm,
/// has six free motions on every mesh, and none of them grows.
#[test]
fn free_strip_has_six_free_motions_on_every_mesh() {
    for [width, height] in [[0.02, 0.006], [0.06, 0.003]] {
        for segments in [54, 102, 110, 134, 190, 262] {
            let shape = Shape::Straight { length: 0.2, direction: [1.0, 0.0, 0.0] };
            let section = Section::Rectangle { width, height, up: [0.0, 1.0, 0.0] };
            let material = Material { shear_modulus: Some(5e10), ..Material::new(7850.0, 1e11) };
            let mut scene = Scene::new(segments, shape, section, material);
            (scene.supports.start, scene.supports.end) = (Support::Free, Support::Free);
            let found = modes(&scene, 8);
            assert_eq!(
                found.unstable, 0,
                "{segments} segments of {width} m by {height} m: {found}"
            );
            let free = found.modes.iter().filter(|m| m.frequency_rad_s == 0.0);
            assert!(
                free.clone().all(|m| m.kind == ModeKind::Rigid && m.number.is_none()),
                "{found}"
            );
            assert_eq!(free.count(), 6, "{segments}: {found}");
            assert_eq!(scene.problem().unwrap().equilibrium().unwrap().negative_directions, 0);
        }
    }
}
