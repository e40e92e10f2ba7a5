//! Flutter under follower loads: critical loads of the columns of Beck, Leipholz and Hauger, growth rates against the
//! characteristic equation of Beck's column, and refusals.

use rodfit::scene::*;
use rodfit::vibration::{LinearizationPoint, Modes};
use std::f64::consts::PI;

use crate::common::unit_rod;

/// Slenderness at which the stretch of a column under its flutter load is negligible.
const RADIUS: f64 = 1e-3;

/// The square root of EI over the mass per length of the unit rod: the unit of frequencies, 1/s.
fn unit() -> f64 {
    (PI * RADIUS * RADIUS).sqrt().recip()
}

/// Beck's column: a clamped rod of unit length and stiffness under a follower force that compresses it.
fn beck(segments: usize, load: f64) -> Scene {
    let mut scene = unit_rod(segments, RADIUS);
    let force = [-load, 0.0, 0.0];
    scene.loads.point = vec![PointForce { force, follower: true, ..PointForce::default() }];
    scene
}

/// A column under a tangential line load in as many pieces as edges; `size` returns it at an arc length.
fn distributed(segments: usize, size: impl Fn(f64) -> f64) -> Scene {
    let mut scene = unit_rod(segments, RADIUS);
    let pieces = segments;
    let piece = |k: usize| {
        let at = |k: usize| k as f64 / pieces as f64;
        let force = [-size(0.5 * (at(k) + at(k + 1))), 0.0, 0.0];
        let to = (k + 1 < pieces).then(|| at(k + 1));
        LineForce { from: at(k), to, force, follower: true, signal: None }
    };
    scene.loads.line = (0..pieces).map(piece).collect();
    scene
}

fn modes(scene: &Scene) -> Modes {
    scene.problem().unwrap().modes(4, LinearizationPoint::Equilibrium).unwrap()
}

/// The load at which the first mode begins to grow, by bisection.
fn critical(range: [f64; 2], scene: impl Fn(f64) -> Scene) -> f64 {
    let [mut low, mut high] = range;
    let grows = |load: f64| modes(&scene(load)).unstable > 0;
    assert!(!grows(low) && grows(high), "{range:?}");
    while high - low > 1e-3 * low {
        let middle = 0.5 * (low + high);
        *if grows(middle) { &mut high } else { &mut low } = middle;
    }
    0.5 * (low + high)
}

#[test]
fn flutter_loads_equal_those_of_beck_leipholz_and_hauger() {
    let found = critical([15.0, 25.0], |load| beck(100, load));
    println!("Beck: P L^2/EI = {found:.4}");
    assert!((found / 20.051 - 1.0).abs() < 5e-3, "{found}");
    let found = critical([30.0, 50.0], |load| distributed(100, |_| load));
    println!("Leipholz: q L^3/EI = {found:.4}");
    assert!((found / 40.05 - 1.0).abs() < 5e-3, "{found}");
    let found = critical([120.0, 180.0], |load| distributed(100, |s| load * (1.0 - s)));
    println!("Hauger: q0 L^3/EI = {found:.4}");
    assert!((found / 150.6 - 1.0).abs() < 5e-3, "{found}");
}

/// In space the columns flutter at the same loads, in every direction.
#[test]
fn beck_column_in_space_flutters_at_the_same_load() {
    let found = critical([15.0, 25.0], |load| {
        let mut scene = beck(40, load);
        scene.material.poisson_ratio = Some(0.3);
        scene.rod.dimension = Dimension::Spatial;
        scene
    });
    println!("P L^2/EI = {found:.4}");
    assert!((found / 20.051 - 1.0).abs() < 5e-3, "{found}");
}

/// The characteristic equation of Beck's column at a load `p` and the squared frequency `w`, real.
fn characteristic(p: f64, w: f64) -> f64 {
    let root = (0.25 * p * p + w).sqrt();
    let (a, b) = ((root + 0.5 * p).sqrt(), (root - 0.5 * p).sqrt());
    p * p + 2.0 * w + p * w.sqrt() * a.sin() * b.sinh() + 2.0 * w * a.cos() * b.cosh()
}

/// Below the flutter load frequencies are roots of the characteristic equation, and nothing grows.
#[test]
fn frequencies_below_the_flutter_load_equal_the_characteristic_equation() {
    for load in [5.0, 12.0, 18.0] {
        let found = modes(&beck(100, load));
        assert_eq!((found.unstable, found.growth_rates_1_s.len()), (0, found.modes.len()));
        for frequency in &found.frequencies_rad_s[..2] {
            let reduced = frequency / unit();
            let at = |factor: f64| characteristic(load, (reduced * factor).powi(2));
            let root = at(0.995) * at(1.005) < 0.0;
            println!("P = {load}: {reduced:.4}, sign change within 0.5 %: {root}");
            assert!(root, "{load}: {reduced}");
        }
    }
}

/// Above the flutter load a vibration grows and one of the same frequency decays at the same rate.
#[test]
fn flutter_has_a_growing_and_a_decaying_vibration() {
    let found = modes(&beck(60, 25.0));
    let [grows, decays] = [found.growth_rates_1_s[0], found.growth_rates_1_s[1]];
    assert_eq!(found.unstable, 1);
    assert!(grows.abs() > 0.1 * unit() && (grows + decays).abs() < 1e-6 * grows.abs());
    let [a, b] = [found.frequencies_rad_s[0], found.frequencies_rad_s[1]];
    assert!(a > 5.0 * unit() && (a / b - 1.0).abs() < 1e-6, "{a} {b}");
    assert!(found.to_string().contains("unstable: 1 mode"), "{found}");
}

/// Out of the plane of a planar scene the column flutters too; without growth rates the report has no such key.
#[test]
fn planar_columns_are_examined_out_of_their_plane() {
    let mut scene = beck(40, 25.0);
    scene.material.poisson_ratio = Some(0.3);
    assert_eq!(modes(&scene).unstable, 2);
    scene.loads.point.clear();
    assert!(modes(&scene).growth_rates_1_s.is_empty());
}

#[test]
fn named_frequencies_under_follower_loads_are_refused_with_their_key() {
    let problem = beck(20, 1.0).problem().unwrap();
    let error = problem.natural_frequencies(&[1_usize], &[]).unwrap_err().to_string();
    assert!(error.contains("loads.point[0].follower"), "{error}");
}
