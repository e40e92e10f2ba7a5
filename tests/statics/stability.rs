//! Stability near zero stiffness, where rounding errors of fine meshes exceed it; and limp rods that stand upright.

use rodfit::scene::{Dimension, Material, Scene, Section, Shape, Support};
use rodfit::vibration::LinearizationPoint;
use std::f64::consts::PI;

use crate::common::rest;

const GRAVITY: f64 = 9.81;

/// A thin stiff arc between two hinges, under gravity towards the hinges or away from them.
fn hinged_arc(segments: usize, length: f64, angle: f64, stands: bool) -> Scene {
    let material = Material { poisson_ratio: Some(0.3), ..Material::new(1856.0, 4.2e11) };
    let section = Section::Circle { radius: 3.9e-4 };
    let mut scene = Scene::new(segments, Shape::Arc { length, angle }, section, material);
    (scene.supports.start, scene.supports.end) = (Support::Pinned, Support::Pinned);
    // The arc turns from the x axis to the left, and lies to the right of its chord.
    let (sin, cos) = (0.5 * angle).sin_cos();
    let size = if stands { GRAVITY } else { -GRAVITY };
    scene.loads.gravity = [-size * sin, size * cos, 0.0];
    scene
}

/// A rigid arc that turns about the line of its hinges is a pendulum: sigma^2 = g h/(I/m) with the mean height `h` and the
/// mean squared height of an arc of radius R and half angle a, `y = R (cos phi - cos a)`.
fn pendulum_rate(length: f64, angle: f64) -> f64 {
    let (radius, a) = (length / angle, 0.5 * angle);
    let mean = radius * (a.sin() / a - a.cos());
    let mean_square =
        0.5 + (2.0 * a).sin() / (4.0 * a) - 2.0 * a.cos() * a.sin() / a + a.cos().powi(2);
    (GRAVITY * mean / (radius * radius * mean_square)).sqrt()
}

#[test]
fn arc_above_its_hinges_is_unstable_on_every_mesh() {
    for (length, angle) in [(0.27, 1.58), (0.4, 1.0)] {
        // Exact growth rate of the rigid arc as a pendulum above its hinges.
        let exact = pendulum_rate(length, angle);
        for segments in [16, 100, 400, 704, 1000] {
            let problem = hinged_arc(segments, length, angle, true).problem().unwrap();
            let found = problem.equilibrium().unwrap();
            assert_eq!((found.stable, found.negative_directions), (Some(false), 1), "{segments}");
            for count in [1, 2, 4] {
                let modes = problem.modes(count, LinearizationPoint::Equilibrium).unwrap();
                let rate = -modes.frequencies_rad_s[0];
                assert_eq!(modes.unstable, 1, "{segments} {count}");
                // The pendulum of the rigid arc, with errors of the polygon (1/segments) and of its elasticity.
                assert!(
                    (rate / exact - 1.0).abs() < 1.0 / segments as f64 + 2e-3,
                    "{rate} {exact}"
                );
            }
        }
    }
}

/// Below the line of its hinges the arc swings with the same pendulum frequency.
#[test]
fn arc_below_its_hinges_swings_on_every_mesh() {
    let exact = pendulum_rate(0.27, 1.58);
    for segments in [16, 400, 1000] {
        let problem = hinged_arc(segments, 0.27, 1.58, false).problem().unwrap();
        assert_eq!(problem.equilibrium().unwrap().stable, Some(true), "{segments}");
        let modes = problem.modes(1, LinearizationPoint::Equilibrium).unwrap();
        let found = modes.frequencies_rad_s[0];
        // As above: errors of the polygon and of the elasticity.
        assert!((found / exact - 1.0).abs() < 1.0 / segments as f64 + 2e-3, "{found} {exact}");
    }
}

/// A straight round rod bent into a ring that is clamped at one place turns about the tangent there without a change of
/// energy (Michell 1889): this motion deforms the rod, so that the ring is marginal.
#[test]
fn ring_of_a_straight_rod_is_marginal() {
    for segments in [50, 200] {
        let material = Material { poisson_ratio: Some(0.3), ..Material::new(1e3, 1e8) };
        let (section, shape) =
            (Section::Circle { radius: 2e-3 }, Shape::Arc { length: 1.0, angle: 2.0 * PI });
        let mut scene = Scene::new(segments, shape, section, material);
        scene.rod.natural_curvature = 0.0.into();
        scene.rod.dimension = Dimension::Spatial;
        scene.supports.end = Support::Clamped;
        let found = rest(&scene);
        assert_eq!(found.negative_directions, 0, "{found}");
        assert_eq!((found.marginal_directions, found.stable), (1, Some(false)), "{found}");
        assert!(found.to_string().contains("marginal equilibrium"), "{found}");
    }
}

/// A limp standing rod bends over its clamp with the length scale `lambda = sqrt(E I/T)`, T its weight. The elastica from upward
/// to downward takes 2 lambda of its length and is 2 lambda wide; T decreases along the bend by a few percent.
#[test]
fn limp_standing_rod_hangs_to_the_side_of_its_loads() {
    let (length, radius, density, modulus) = (0.7_f64, 6.75e-4_f64, 1200.0, 2e6);
    let (area, moment) = (PI * radius.powi(2), PI * radius.powi(4) / 4.0);
    let bend = 2.0 * (modulus * moment / (density * area * GRAVITY * length)).sqrt();
    for (dimension, side, segments) in [
        (Dimension::Auto, 1e-3, 200),
        (Dimension::Auto, -1e-3, 384),
        (Dimension::Auto, 0.0, 200),
        (Dimension::Spatial, 1e-3, 200),
        (Dimension::Spatial, 0.0, 200),
    ] {
        let material = Material { poisson_ratio: Some(0.49), ..Material::new(density, modulus) };
        let shape = Shape::Straight { length, direction: [0.0, 0.0, 1.0] };
        let mut scene = Scene::new(segments, shape, Section::Circle { radius }, material);
        scene.rod.dimension = dimension;
        scene.loads.gravity = [side, 0.0, -GRAVITY];
        let found = rest(&scene);
        let [x, y, z] = found.tip;
        println!("{dimension:?} {side} {segments}: {x} {y} {z}, bend {bend}, {found}");
        // Without a side the rod turns about the vertical without a change of energy.
        assert_eq!(found.negative_directions, 0, "{dimension:?} {side} {segments}: {found}");
        assert!(
            side == 0.0 || found.stable == Some(true),
            "{dimension:?} {side} {segments}: {found}"
        );
        // The bend of the elastica, up to the decrease of tension along it (some per cent).
        assert!((x.hypot(y) / bend - 1.0).abs() < 0.12, "{x} {y} {bend}");
        assert!((z + length - bend).abs() < 0.12 * bend + 0.5 * length / segments as f64, "{z}");
        assert!(side == 0.0 || x * side > 0.0, "{side}: {x}");
    }
}
