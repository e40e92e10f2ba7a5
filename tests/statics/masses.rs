//! Masses on the rod: frequencies and weight against beam theory.

use rodfit::Point;
use rodfit::scene::{Dimension, Material, PointForce, PointMass, Scene};
use rodfit::vibration::{LinearizationPoint, ModeKind, Modes};
use std::f64::consts::PI;

use crate::common::{rest, straight_rod};

const MODULUS: f64 = 1e8;
const DENSITY: f64 = 1000.0;
const RADIUS: f64 = 5e-3;
const LENGTH: f64 = 0.5;
const AREA: f64 = PI * RADIUS * RADIUS;

fn rod(segments: usize, dimension: Dimension, mass: Vec<PointMass>) -> Scene {
    let material = Material { poisson_ratio: Some(0.5), ..Material::new(DENSITY, MODULUS) };
    let mut scene = straight_rod(segments, [LENGTH, RADIUS], material);
    (scene.rod.dimension, scene.rod.mass) = (dimension, mass);
    scene
}

fn modes(scene: &Scene, count: usize) -> Modes {
    scene.problem().unwrap().modes(count, LinearizationPoint::Equilibrium).unwrap()
}

/// The root of a function that changes its sign between `low` and `high`.
fn root(f: impl Fn(f64) -> f64, mut low: f64, mut high: f64) -> f64 {
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if (f(middle) > 0.0) == (f(low) > 0.0) { low = middle } else { high = middle }
    }
    low
}

/// Frequencies of a cantilever with a tip mass, in parts of the rod's mass, converge to the roots of the frequency equation to
/// second order.
#[test]
fn tip_mass_frequencies_are_roots_of_the_frequency_equation() {
    let unit = (MODULUS * RADIUS * RADIUS / (4.0 * DENSITY)).sqrt() / (LENGTH * LENGTH);
    for part in [0.02, 0.5, 5.0] {
        let equation = |b: f64| {
            let (sin, cos, sinh, cosh) = (b.sin(), b.cos(), b.sinh(), b.cosh());
            1.0 + cos * cosh + part * b * (cos * sinh - sin * cosh)
        };
        // Between a free tip and one that a mass without limit holds in place.
        let exact = [root(equation, 0.2, 1.88), root(equation, 3.92, 4.70)].map(|b| b * b * unit);
        for dimension in [Dimension::Planar, Dimension::Spatial] {
            let errors = [25, 50, 100].map(|segments| {
                let mass = PointMass::new(Point::Tip, part * DENSITY * AREA * LENGTH);
                let found = modes(&rod(segments, dimension, vec![mass]), 8);
                let bending = found.modes.iter().filter(|m| m.kind == ModeKind::Bending);
                let mut found: Vec<f64> = bending.map(|m| m.frequency_rad_s).collect();
                // Both planes have the same.
                found.dedup_by(|a, b| (*a / *b - 1.0).abs() < 1e-6);
                [0, 1].map(|k| found[k] / exact[k] - 1.0)
            });
            for k in 0..2 {
                let [a, b, c] = errors.map(|e| e[k]);
                println!("{part} {dimension:?} mode {}: {a:.1e} {b:.1e} {c:.1e}", k + 1);
                // Second order in the mesh, against the roots of the frequency equation.
                assert!(c.abs() < 4e-4 && ((a - b) / (b - c)).log2() > 1.8, "{errors:?}");
            }
        }
    }
}

/// The weight of a mass equals a force at its place, exactly at nodes and to second order in the mesh between them.
#[test]
fn weight_of_a_point_mass_equals_a_force() {
    let (mass, g) = (2e-3, 9.8);
    for dimension in [Dimension::Planar, Dimension::Spatial] {
        let sags = |segments: usize, node: Point| {
            let mut scene = rod(segments, dimension, vec![PointMass::new(node, mass)]);
            scene.loads.gravity = [0.0, -g, 0.0];
            let weighed = rest(&scene).tip[1];
            scene.rod.mass.clear();
            let force = [0.0, -mass * g, 0.0];
            scene.loads.point = vec![PointForce { node, force, ..PointForce::default() }];
            [weighed, rest(&scene).tip[1]]
        };
        for node in [Point::Tip, Point::Node(13)] {
            let [weighed, pulled] = sags(20, node);
            // At nodes weight and force have the same equations: rounding errors.
            assert!((weighed / pulled - 1.0).abs() < 1e-10, "{node:?}: {weighed} {pulled}");
        }
        // The middle of an edge on both meshes.
        let errors = [20, 59].map(|segments| {
            let [weighed, pulled] = sags(segments, Point::ArcLength(10.0 / 19.5 * LENGTH));
            (weighed / pulled - 1.0).abs()
        });
        println!("{dimension:?}: {errors:?}");
        // Second order: three times finer gives errors nine times smaller.
        assert!(errors[0] < 1e-3 && errors[1] < errors[0] / 6.0, "{errors:?}");
    }
}

/// Masses that are not on the rod or not positive are rejected with their key.
#[test]
fn invalid_point_masses_are_rejected() {
    let wrong = [
        (PointMass::new(Point::Tip, 0.0), "rod.mass[0].mass"),
        (PointMass::new(Point::Tip, f64::NAN), "rod.mass[0].mass"),
        (PointMass::new(Point::Node(21), 1.0), "rod.mass[0].node"),
        (PointMass::new(Point::ArcLength(0.6), 1.0), "rod.mass[0].node.arc_length"),
    ];
    for (mass, key) in wrong {
        let refused = rod(20, Dimension::Auto, vec![mass]).problem().unwrap_err().to_string();
        assert!(refused.contains(&format!("{key}: found")), "{refused}");
    }
}
