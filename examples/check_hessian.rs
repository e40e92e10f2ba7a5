//! Verification of hand-derived derivatives: an energy is written once, its gradient and Hessian are compared with
//! automatic derivatives, and a Hessian with a missing term is reported as wrong.
//!
//! `cargo run --release --example check_hessian`

use rodfit::check::{Tolerance, check, check_hessian};
use rodfit::{Analytic, Energy, Scalar};

/// A pendulum with a spring: `1/2 k (r - l)^2 + weight y` of a mass at (x, y), suspended at the origin.
struct SpringPendulum {
    k: f64,
    l: f64,
    weight: f64,
}

impl Energy<2> for SpringPendulum {
    fn energy<D: Scalar>(&self, &[x, y]: &[D; 2]) -> D {
        let stretch = (x * x + y * y).sqrt() - self.l;
        stretch * stretch * (0.5 * self.k) + y * self.weight
    }
}

impl Analytic<2> for SpringPendulum {
    fn gradient(&self, &[x, y]: &[f64; 2]) -> [f64; 2] {
        let r = x.hypot(y);
        let force = self.k * (r - self.l) / r;
        [force * x, force * y + self.weight]
    }
    fn hessian(&self, &[x, y]: &[f64; 2]) -> [[f64; 2]; 2] {
        let r = x.hypot(y);
        let across = self.k * (1.0 - self.l / r);
        let along = self.k - across;
        let xy = along * x * y / (r * r);
        [[across + along * x * x / (r * r), xy], [xy, across + along * y * y / (r * r)]]
    }
}

fn main() {
    let pendulum = SpringPendulum { k: 40.0, l: 0.3, weight: 2.0 };
    let states = [[0.1, -0.4], [0.3, 0.0], [-0.2, 0.25]];
    println!("{}\n", check(&pendulum, &states, Tolerance::default()));

    // A frequent error: the geometric stiffness is omitted.
    let q = states[0];
    let r2 = q[0] * q[0] + q[1] * q[1];
    let material = |a: f64, b: f64| pendulum.k * a * b / r2;
    let incomplete = [
        [material(q[0], q[0]), material(q[0], q[1])],
        [material(q[1], q[0]), material(q[1], q[1])],
    ];
    let report = check_hessian(&pendulum, &q, &incomplete);
    println!("{report}");
    assert!(!report.passed());
}
