//! Equilibria, stability, modes and reactions of rods with user-defined energies, against theory.

use crate::own_energy::energies::{Foundation, Magnet};
use crate::own_energy::scenes::{RADIUS, straight, with_both};
use rodfit::energy::At;
use rodfit::scene::*;
use rodfit::vibration::LinearizationPoint;
use std::f64::consts::PI;

/// A straight rod without weight and time stepping.
fn weightless(segments: usize) -> Scene {
    let mut scene = straight(segments);
    scene.loads.gravity = [0.0; 3];
    scene.time = None;
    scene
}

fn springs() -> Foundation {
    Foundation { by_hand: true }
}

/// A beam on springs: `omega_n^2 = omega_0n^2 + k/(rho A)`, on every mesh, in the plane and across.
#[test]
fn elastic_foundation_raises_all_frequencies() {
    let k = 5.0;
    for (start, end) in [
        (Support::Clamped, Support::Free),
        (Support::Clamped, Support::Pinned),
        (Support::Pinned, Support::Pinned),
    ] {
        let mut scene = weightless(40);
        (scene.supports.start, scene.supports.end) = (start, end);
        let line_density = scene.material.density * PI * RADIUS * RADIUS;
        let both = scene.clone().with_energy("springs", At::Whole, springs(), [k, 0.0]);
        // Hinges let the rod spin, which no spring resists: those in the plane, then.
        let squared = |scene: &Scene| -> Vec<f64> {
            let problem = scene.problem().unwrap();
            if start == Support::Pinned {
                let natural_frequencies = problem.natural_frequencies(&[1, 2, 3], &[]).unwrap();
                return natural_frequencies
                    .iter()
                    .map(|found| found.frequency_rad_s.powi(2))
                    .collect();
            }
            let modes = problem.modes(6, LinearizationPoint::Equilibrium).unwrap();
            modes.frequencies_rad_s.iter().map(|w| w * w).collect()
        };
        for (a, b) in squared(&scene).iter().zip(squared(&both)) {
            let shift = (b - a) / (k / line_density);
            println!("{start:?} {end:?}: {a:.3} {b:.3} {shift}");
            // The theory holds on every mesh, up to rounding errors.
            assert!((shift - 1.0).abs() < 1e-6, "{start:?} {end:?}: {a} {b}");
        }
    }
}

/// A force at the end of a long rod on springs: `w(0) = 2 F b/k`, `b = (k/(4 EI))^(1/4)`, at second
/// order in the mesh.
#[test]
fn beam_on_elastic_foundation_bends_as_in_theory() {
    let (k, force) = (2e3, 1e-3);
    let mut errors = Vec::new();
    for segments in [40, 80, 160] {
        let mut scene = weightless(segments);
        scene.supports.start = Support::Free;
        let load = PointForce { force: [0.0, force, 0.0], ..PointForce::default() };
        scene.loads.point = vec![load];
        let [ei, _] = scene.rod.section.moments().second_moments.map(|i| 2e7 * i);
        let found = scene.with_energy("springs", At::Whole, springs(), [k, 0.0]);
        let found = found.problem().unwrap().equilibrium().unwrap();
        let b = (k / (4.0 * ei)).powf(0.25);
        // The rod is so long (8 decay lengths) that its other end has no influence.
        assert!(b * 0.3 > 8.0 && found.stable == Some(true));
        let error = found.tip[1] / (2.0 * force * b / k) - 1.0;
        println!("{segments}: {error:.2e}, residual {:.1e}", found.residual);
        // The residual force is far below the load.
        assert!(found.residual < 1e-6 * force);
        errors.push(error.abs());
    }
    let order = (errors[1] / errors[2]).log2();
    // Second order in the mesh, by the theory of the semi-infinite beam on springs.
    assert!(errors[2] < 2e-3 && order > 1.8, "{errors:?} {order}");
}

/// Reactions at rest balance the weight of the rod and the forces of its springs.
#[test]
fn reactions_balance() {
    let mut scene = with_both(straight(20), false, [0.0, 0.05, 0.0]);
    scene.time = None;
    let problem = scene.problem().unwrap();
    let found = problem.equilibrium().unwrap();
    let mut force = found.reactions.start.force[1];
    // The springs from 0.1 to 0.22 m, from where they are at rest.
    let edge = 0.3 / 19.5;
    for (i, x) in found.nodes.iter().enumerate() {
        let cell = |side: f64| (i as f64 - 0.5 + side) * edge;
        let length = (cell(0.5).min(0.22) - cell(-0.5).max(0.1)).max(0.0);
        let way = [x[0] - (i as f64 - 0.5) * edge, x[1]];
        let square = way[0] * way[0] + way[1] * way[1];
        force -= (3.0 + 3e4 * square) * way[1] * length;
    }
    let weight = 1200.0 * PI * RADIUS * RADIUS * 0.3 * 9.8;
    println!("{force} {weight}");
    // Vertical equilibrium: reactions and springs carry the weight `rho A L g` of a rod of 0.3 m.
    assert!((force / weight - 1.0).abs() < 1e-9, "{force} {weight}");
}

/// A magnet against the field makes the straight rod unstable at `m B = EI/L`: stable 1 % below it, two negative directions 1 %
/// above.
#[test]
fn magnet_against_the_field_buckles_the_rod() {
    let scene = weightless(40);
    let ei = 2e7 * PI * RADIUS.powi(4) / 4.0;
    // The joints' length is half an edge short of the rod's.
    let critical = ei / (0.3 * 39.0 / 39.5);
    for (part, stable) in [(0.99, true), (1.01, false)] {
        let magnet = Magnet { field: [-1.0, 0.0, 0.0], by_hand: true };
        let scene = scene.clone().with_energy("magnet", At::End, magnet, [part * critical]);
        let found = scene.problem().unwrap().equilibrium().unwrap();
        println!("{part}: {:?} {:?}", found.stable, found.stable_in_plane);
        assert_eq!((found.stable, found.stable_in_plane), (Some(stable), Some(stable)));
        assert_eq!(found.negative_directions, if stable { 0 } else { 2 });
    }
}

/// Long rods (2500 edges) with an energy of absolute positions have an equilibrium, solved for the nodes.
#[test]
fn long_rod_on_elastic_foundation_has_equilibrium() {
    let mut scene = weightless(2500);
    scene.loads.gravity = [0.0, -9.8, 0.0];
    let (k, weight) = (50.0, 1200.0 * PI * RADIUS * RADIUS * 9.8);
    let scene = scene.with_energy("springs", At::Whole, springs(), [k, 0.0]);
    let found = scene.problem().unwrap().equilibrium().unwrap();
    println!("{:?} {}", found.tip, weight / k);
    // Far from the clamp the springs carry the weight: sag = weight per length over k.
    assert!((found.tip[1] / (-weight / k) - 1.0).abs() < 0.1, "{:?}", found.tip);
}
