//! Loss of stability of rods in space, and shapes beyond it, against published values (Michell 1889, van der Heijden & Thompson
//! 2000, Romero et al. 2021).

use rodfit::Derivatives;
use rodfit::numerics::banded::{BandMatrix, Ldlt};
use rodfit::numerics::tangent::Factors;
use rodfit::rod::Rod;
use rodfit::scene::{Material, Motion, Scene, Section, Shape, Support};
use std::f64::consts::PI;

use crate::common::{self, rest};

/// A rod of unit length, bending stiffness and mass, GJ = `torsion`, clamped at its start.
fn unit_rod(segments: usize, shape: Shape, torsion: f64) -> Scene {
    let mut scene = common::unit_rod(segments, 1e-3);
    scene.rod.shape = shape;
    scene.material.density = 1.0 / (PI * 1e-6);
    scene.material.shear_modulus = Some(0.5 * torsion * scene.material.youngs_modulus);
    scene
}

/// Where `holds` ceases to, by bisection to a part of it.
pub fn critical([mut low, mut high]: [f64; 2], part: f64, holds: impl Fn(f64) -> bool) -> f64 {
    assert!(holds(low) && !holds(high), "{low} {high}");
    while high - low > part * high {
        let middle = 0.5 * (low + high);
        if holds(middle) { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

/// A straight rod bent into a ring whose ends are turned against each other stays plane up to a
/// total twist of 2 pi sqrt(3) EI/GJ (Michell 1889). The ring as a whole turns about its clamp
/// without effort: that direction does not count.
#[test]
fn twisted_ring_is_stable_up_to_the_twist_of_michell() {
    let torsion = 1.0 / 1.3;
    let exact = 2.0 * PI * 3.0_f64.sqrt() / torsion;
    let ring = |segments: usize| {
        let shape = Shape::Arc { length: 1.0, angle: 2.0 * PI };
        let mut scene = unit_rod(segments, shape, torsion);
        scene.rod.natural_curvature = 0.0.into();
        scene.rod.dimension = rodfit::scene::Dimension::Spatial;
        scene.supports.end = Support::Clamped;
        scene
    };
    let found = [50, 100, 200].map(|segments| {
        let problem = ring(segments).problem().unwrap();
        let discretized = problem.spatial().unwrap();
        let (rod, frames) =
            (discretized.rod(), &discretized.simulation().unwrap().state().frames.clone());
        critical([0.97 * exact, 1.01 * exact], 1e-5, |twist| {
            // Evenly twisted, the polygon is in balance.
            let mut q = discretized.rest();
            for j in 0..segments {
                q[4 * j + 3] = twist * j as f64 / (segments - 1) as f64;
            }
            let n = q.len();
            let (mut gradient, mut tangent) = (vec![0.0; n], BandMatrix::zeros(n));
            rod.tangent(&q, frames, Derivatives::Hand, &mut gradient, &mut tangent);
            // The twisted ring is an equilibrium: forces vanish up to rounding errors.
            assert!(discretized.free().all(|i| gradient[i].abs() < 1e-6), "{segments}");
            // Squared frequencies below a ten-thousandth of EI/(rho A L^4) are zero.
            let mut factors = Ldlt::with_order(n);
            factors.factor_sum(rod.mass(), 1e-4, &tangent, 1.0, discretized.free()).unwrap();
            factors.negative_pivots() == 0
        })
    });
    let errors = found.map(|twist| twist / exact - 1.0);
    let order = (errors[0] / errors[1]).log2();
    println!("Michell's ring: errors {errors:?}, order {order:.2}");
    // Second order in the mesh, against Michell's twist.
    assert!(errors[1].abs() < 1e-3 && order > 1.8, "{errors:?}");
    // Turned by its ends it gets there, stays below, and lets nearly all of its twist go beyond.
    for (part, stays) in [(0.9, true), (1.1, false)] {
        let (mut scene, twist) = (ring(100), part * exact);
        scene.supports.motion = vec![Motion { twist, ..Motion::default() }];
        let kept = rest(&scene).energies.twist / (0.5 * torsion * twist * twist);
        // Below the limit all twist is kept; above it the ring leaves its plane and releases most of its twist energy.
        assert!(if stays { (kept - 1.0).abs() < 1e-6 } else { kept < 0.1 }, "{part}: {kept}");
    }
}

/// A straight rod between walls, twisted by 27 turns and let in by 3 % of its length, gathers its
/// slack in one helix whose slope falls off as (cos a - cos a0)/(1 - cos a0) = tanh^2(s/s0), with
/// 1/s0 = M/(2 EI) sqrt((1 - cos a0)/(1 + cos a0)), M = GJ times the twist per length left (van der
/// Heijden and Thompson 2000; the numbers are Bergou et al.'s of 2008).
#[test]
fn slack_twisted_rod_has_the_localized_helix_of_theory() {
    let (length, bending, torsion) = (9.29, 1.345, 0.789);
    let deviation = |segments: usize| {
        let shape = Shape::Straight { length, direction: [1.0, 0.0, 0.0] };
        let mut scene = unit_rod(segments, shape, 1.0);
        let (i, up) = (bending, [0.0, 0.0, 1.0]);
        scene.rod.section = Section::Custom { area: 1e5, i1: i, i2: i, j: torsion, up };
        scene.material = Material { shear_modulus: Some(1.0), ..Material::new(1e-5, 1.0) };
        // The least push decides where to.
        scene.loads.gravity = [0.0, 1e-3, 2e-4];
        scene.supports.end = Support::Clamped;
        let (twist, displacement) = (27.0 * 2.0 * PI, [-0.3, 0.0, 0.0]);
        scene.supports.motion = vec![Motion { twist, displacement, ..Motion::default() }];
        let found = rest(&scene);
        // Where along the rod and which way around hardly matters: these two directions may lead
        // down by next to nothing.
        assert!(found.negative_directions <= 2, "{found}");
        let moment = torsion * (2.0 * found.energies.twist / (torsion * length)).sqrt();
        let edge = length / (segments as f64 - 1.0);
        let slopes: Vec<f64> = found
            .nodes
            .windows(2)
            .map(|p| {
                let [x, y, z] = [0, 1, 2].map(|c| p[1][c] - p[0][c]);
                x / (x * x + y * y + z * z).sqrt()
            })
            .collect();
        // The steepest place, between edges, by a parabola.
        let k = (1..segments - 1).min_by(|a, b| slopes[*a].total_cmp(&slopes[*b])).unwrap();
        let [a, b, c] = [slopes[k - 1], slopes[k], slopes[k + 1]];
        let shift = 0.5 * (a - c) / (a - 2.0 * b + c);
        let steepest = b - 0.25 * (a - c) * shift;
        let rate = moment / (2.0 * bending) * ((1.0 - steepest) / (1.0 + steepest)).sqrt();
        let away = |(j, slope): (usize, &f64)| {
            let s = (j as f64 - k as f64 - shift) * edge;
            ((slope - steepest) / (1.0 - steepest) - (s * rate).tanh().powi(2)).abs()
        };
        slopes.iter().enumerate().map(away).fold(0.0, f64::max)
    };
    let deviations = [400, 800].map(deviation);
    let order = (deviations[0] / deviations[1]).log2();
    println!("localised helix: off the envelope by {deviations:?}, order {order:.2}");
    // Second order in the mesh, against the envelope of the theory.
    assert!(deviations[1] < 6e-3 && order > 1.7, "{deviations:?}");
}

/// A heavy cantilever's height over its width (Romero et al. 2021, the cantilever protocol).
#[test]
fn heavy_cantilever_height_over_width_agrees_with_published_values() {
    for (weight, exact) in [(1.0, 0.12456177), (10.0, 1.06680232), (100.0, 5.88810462)] {
        let ratio = |segments: usize| {
            let shape = Shape::Straight { length: 1.0, direction: [1.0, 0.0, 0.0] };
            let mut scene = unit_rod(segments, shape, 0.7);
            scene.loads.gravity = [0.0, -weight, 0.0];
            let [x, y, _] = rest(&scene).tip;
            -y / x / exact - 1.0
        };
        let errors = [100, 200].map(ratio);
        let order = (errors[0] / errors[1]).log2();
        println!("Gamma = {weight}: errors {errors:?}, order {order:.2}");
        // Second order in the mesh, against the published ratio.
        assert!(errors[0].abs() < 3e-3 && order > 1.8, "{errors:?}");
    }
}

/// A rod curved by nature into one turn, or one and a half, hangs down from its clamp in its plane
/// up to a weight of 12.19, or 26.31 (Romero et al. 2021, the bend-twist protocol; GJ/EI = 2/3).
#[test]
fn hanging_curl_loses_stability_at_published_weights() {
    for (turn, exact) in [(2.0 * PI, 12.19), (3.0 * PI, 26.31)] {
        let found = [50, 100].map(|segments| {
            critical([0.9 * exact, 1.1 * exact], 1e-5, |weight| {
                let curl = Shape::Arc { length: 1.0, angle: turn };
                let mut scene = unit_rod(segments, curl, 2.0 / 3.0);
                scene.loads.gravity = [weight, 0.0, 0.0];
                let found = rest(&scene);
                assert_eq!((found.model.as_str(), found.stable_in_plane), ("planar", Some(true)));
                found.stable == Some(true)
            })
        });
        println!("curl of {turn:.3}: leaves its plane at {found:.3?}, {exact} published");
        // Published critical weight, with the error of the mesh.
        assert!((found[1] / exact - 1.0).abs() < 3e-3, "{found:?}");
    }
}
