//! Derivatives of bending and twisting in space, hand against num-dual and finite differences, at
//! any rotation since the reference.

use nalgebra::{Rotation3, Unit, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rodfit::check::{CheckReport, Scaled, Tolerance, check};
use rodfit::energy::bend_twist::{Published, UNKNOWNS, dual_gradient, dual_tangent};
use rodfit::energy::{AsEnergy, BendTwist};
use rodfit::frame::EdgeFrame;

fn direction(random: &mut ChaCha8Rng) -> Vector3<f64> {
    loop {
        let v = Vector3::from([0; 3].map(|_| random.random_range(-1.0..1.0)));
        if (0.01..1.0).contains(&v.norm_squared()) {
            return v.normalize();
        }
    }
}

fn turned(random: &mut ChaCha8Rng, v: Vector3<f64>, degrees: f64) -> Vector3<f64> {
    let axis = Unit::new_normalize(direction(random).cross(&v));
    (Rotation3::from_axis_angle(&axis, degrees.to_radians()) * v).normalize()
}

fn frame(random: &mut ChaCha8Rng, tangent: Vector3<f64>) -> EdgeFrame<f64> {
    let director = direction(random).cross(&tangent).normalize();
    EdgeFrame { tangent: tangent.into(), director: director.into() }
}

/// A node with a turning angle now and rotations of its edges since the reference, degrees.
struct Case {
    element: BendTwist<f64>,
    q: [f64; UNKNOWNS],
    units: [f64; UNKNOWNS],
}

fn case(random: &mut ChaCha8Rng, turn: f64, rotation: f64) -> Case {
    let length = 10f64.powf(random.random_range(-6.0..1.0));
    let lengths = [length, length * 10f64.powf(random.random_range(-0.5..0.5))];
    let te = direction(random);
    let tf = turned(random, te, turn);
    let before = [te, tf].map(|t| turned(random, t, rotation));
    let x0 = direction(random) * length;
    let x1 = x0 + te * lengths[0];
    let x2 = x1 + tf * lengths[1];
    let mut angle = || random.random_range(-20.0..20.0);
    let q = [x0.x, x0.y, x0.z, angle(), x1.x, x1.y, x1.z, angle(), x2.x, x2.y, x2.z];
    let stiffness = 10f64.powf(random.random_range(-6.0..6.0));
    let element = BendTwist {
        stiffness: [1.0, 10f64.powf(random.random_range(-1.0..1.0)), random.random_range(0.1..2.0)]
            .map(|k| stiffness * k),
        natural: [0; 3].map(|_| random.random_range(-2.0..2.0)),
        frames: before.map(|t| frame(random, t)),
        twist: random.random_range(-20.0..20.0),
    };
    let units = std::array::from_fn(|i| if i % 4 == 3 { 1.0 } else { length });
    Case { element, q, units }
}

fn compare(case: &Case, tolerance: Tolerance) -> CheckReport {
    let scaled = Scaled { energy: AsEnergy(case.element), units: case.units };
    check(&scaled, &[scaled.scaled(&case.q)], tolerance)
}

#[test]
fn bend_and_twist_agree_on_random_states() {
    let mut random = ChaCha8Rng::seed_from_u64(30);
    let mut worst = [0.0_f64; 3];
    for k in 0..10_000 {
        let (low, high) = if k < 7_000 { (0.0, 170.0) } else { (165.0, 179.9) };
        let turn: f64 = random.random_range(low..high);
        let rotation: f64 = random.random_range(0.0..120.0);
        let case = case(&mut random, turn, if k % 10 == 0 { 0.0 } else { rotation });
        let allowed = 1e-12 * f64::max(1.0, 10.0 / (180.0 - turn));
        let tolerance =
            Tolerance { gradient: allowed, hessian: allowed, finite_difference: f64::INFINITY };
        let report = compare(&case, tolerance);
        if std::env::var("SHOW").is_ok() {
            let e = report.max_relative_error;
            println!(
                "{turn:.2} {rotation:.2} {:.1e} {:.1e} {:.1e} {}",
                e.gradient,
                e.hessian,
                e.finite_difference,
                report.passed()
            );
            continue;
        }
        assert!(report.passed(), "state {k}, turn {turn}, rotation {rotation}\n{report}");
        let errors = report.max_relative_error;
        let largest = errors.gradient.max(errors.hessian);
        if turn <= 170.0 {
            worst[0] = worst[0].max(largest);
        } else {
            worst[1] = worst[1].max(largest * 1e-12 / allowed);
        }
        if turn <= 150.0 {
            worst[2] = worst[2].max(errors.finite_difference);
        }
    }
    println!(
        "worst: to 170 degrees {:.1e}, beyond (scaled) {:.1e}, differences {:.1e}",
        worst[0], worst[1], worst[2]
    );
}

/// Eight seeds on the edges give what eleven on the nodes give.
#[test]
fn seeds_on_edges_are_enough() {
    let mut random = ChaCha8Rng::seed_from_u64(31);
    for _ in 0..200 {
        let case = case(&mut random, 60.0, 40.0);
        let nodes = rodfit::energy::dual_tangent(&case.element, &case.q);
        let edges = dual_tangent(&case.element, &case.q);
        let gradient = dual_gradient(&case.element, &case.q);
        for i in 0..UNKNOWNS {
            let scale = nodes.gradient[i].abs() + edges.energy / case.units[i];
            assert!((nodes.gradient[i] - edges.gradient[i]).abs() <= 1e-11 * scale);
            assert!((gradient[i] - edges.gradient[i]).abs() <= 1e-11 * scale);
        }
    }
}

#[test]
fn published() {
    let mut random = ChaCha8Rng::seed_from_u64(32);
    for rotation in [0.0, 1.0, 5.73, 30.0, 120.0] {
        let mut worst = [0.0_f64; 2];
        for _ in 0..500 {
            let case = case(&mut random, 40.0, rotation);
            let scaled = Scaled { energy: Published(case.element), units: case.units };
            let e =
                check(&scaled, &[scaled.scaled(&case.q)], Tolerance::default()).max_relative_error;
            worst = [worst[0].max(e.gradient), worst[1].max(e.hessian)];
        }
        println!("{rotation} {worst:?}");
    }
}
