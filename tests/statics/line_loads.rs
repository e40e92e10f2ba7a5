//! Equilibria under line loads against beam theory, and against the weight of the rod.

use rodfit::scene::{LineForce, Scene};

use crate::common::{cantilever, rest};

/// Stiff cantilever along x without weight, with the load `q`, N/m, between two arc lengths.
fn loaded(segments: usize, from: f64, to: Option<f64>, q: f64) -> Scene {
    let mut scene = cantilever();
    scene.rod.segments = Some(segments);
    scene.loads.gravity = [0.0; 3];
    scene.loads.line =
        vec![LineForce { from, to, force: [0.0, -q, 0.0], follower: false, signal: None }];
    scene
}

/// Bending stiffness of the rod of a scene, N m^2.
fn bending_stiffness(scene: &Scene) -> f64 {
    scene.material.youngs_modulus * scene.rod.section.moments().second_moments[0]
}

/// Deflection of the tip, `q/(6 E I) [L s^3 - s^4/4]` between both ends of the load (Euler and Bernoulli), in second order
/// of the element size.
#[test]
fn partial_line_load_deflects_the_tip_as_in_beam_theory() {
    let (length, from, to, q) = (0.5, 0.123, 0.377, 1e-6);
    let error = |segments: usize| {
        let scene = loaded(segments, from, Some(to), q);
        let integral = |s: f64| length * s.powi(3) - s.powi(4) / 4.0;
        let exact = q / (6.0 * bending_stiffness(&scene)) * (integral(to) - integral(from));
        -rest(&scene).tip[1] / exact - 1.0
    };
    let [coarse, fine] = [50, 200].map(error);
    println!("relative errors {coarse:.2e} with 50 segments, {fine:.2e} with 200");
    // 4^2 for four times as many segments; the load ends within an edge, whose share varies.
    assert!(fine.abs() < 3e-5 && (coarse / fine).abs() > 8.0, "{coarse:e} {fine:e}");
}

/// The support carries the whole load and its moment about the wall, `q (b^2 - a^2)/2`.
#[test]
fn reactions_balance_a_line_load() {
    let (from, to, q) = (0.123, 0.377, 1e-5);
    let found = rest(&loaded(100, from, Some(to), q)).reactions.start;
    let (force, moment) = (q * (to - from), q * (to * to - from * from) / 2.0);
    assert!((found.force[1] / force - 1.0).abs() < 1e-6, "{found:?}");
    // Hat functions carry the moment exactly; the rod bends by 1e-7 of its length.
    assert!((found.moment[2] / moment - 1.0).abs() < 1e-6, "{found:?}");
}

/// A load of `rho A g` along the whole rod has the equilibrium and the motion of its weight, to second order.
#[test]
fn uniform_line_load_replaces_the_weight() {
    let mut scene = cantilever();
    scene.rod.segments = Some(100);
    let by_weight = rest(&scene).tip;
    let line = scene.material.density * scene.rod.section.moments().area * 9.8;
    scene.loads.gravity = [0.0; 3];
    scene.loads.line = vec![LineForce { force: [0.0, -line, 0.0], ..LineForce::default() }];
    let by_line = rest(&scene).tip;
    for (a, b) in by_weight.iter().zip(by_line) {
        // 0.5 m long; the continuum value of the sag is 0.14531 m.
        assert!((a - b).abs() < 1e-5 * 0.5, "{by_weight:?} {by_line:?}");
    }
}

#[test]
fn line_loads_outside_the_rod_are_rejected_with_their_key() {
    for (from, to, key) in [
        (0.2, Some(0.7), "to"),
        (0.3, Some(0.3), "from"),
        (0.6, None, "from"),
        (-0.1, None, "from"),
    ] {
        let error = loaded(20, from, to, 1.0).problem().unwrap_err().to_string();
        assert!(error.contains(&format!("loads.line[0].{key}")), "{error}");
    }
}

#[test]
fn line_load_without_a_force_is_rejected_with_the_missing_key() {
    let text = cantilever().to_toml().unwrap() + "\n[[loads.line]]\nfrom = 0.1\n";
    let error = Scene::from_toml(&text, ".").unwrap_err().to_string();
    assert!(error.contains("missing key: loads.line[0].force"), "{error}");
}
