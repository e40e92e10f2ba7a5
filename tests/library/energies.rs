//! Simple user-defined energies in several notations, whose derivatives equal finite differences.

use num_dual::Dual64;
use rodfit::check::{CancellationBound, check_hessian};
use rodfit::{Energy, Scalar};

/// Declares energies as one writes them, and checks each: over plain, dual and second-order numbers
/// the same function, with derivatives as finite differences have them.
macro_rules! first_attempts {
    ($($test:ident: [$($q:literal),+], |$x:ident| $body:block)*) => {$(
        #[test]
        fn $test() {
            const N: usize = [$($q),+].len();
            #[derive(Clone)]
            struct Attempt;
            impl Energy<N> for Attempt {
                fn energy<D: Scalar>(&self, $x: &[D; N]) -> D $body
            }
            has_derivatives(&Attempt, [$($q),+]);
        }
    )*};
}

/// Requires a finite energy whose first derivatives by dual numbers agree with finite differences, and a finite check of its
/// Hessian.
fn has_derivatives<const N: usize>(energy: &impl Energy<N>, q: [f64; N]) {
    let value = energy.energy(&q);
    assert!(value.is_finite() && value != 0.0);
    // Powers may be multiplied out in another order.
    assert!((energy.energy(&CancellationBound::unknowns(&q)).value / value - 1.0).abs() < 1e-14);
    let mut slopes = [0.0; N];
    for i in 0..N {
        let along = |i: usize| move |j: usize| f64::from(u8::from(i == j));
        let dual: [Dual64; N] = std::array::from_fn(|j| Dual64::new(q[j], along(i)(j)));
        let by_dual = energy.energy(&dual);
        // The real part is the value: rounding errors.
        assert!((by_dual.re / value - 1.0).abs() < 1e-14);
        let h = 1e-5 * q[i].abs().max(1e-2);
        let at = |k: f64| energy.energy(&std::array::from_fn(|j| q[j] + k * h * along(i)(j)));
        let difference = (8.0 * (at(1.0) - at(-1.0)) - (at(2.0) - at(-2.0))) / (12.0 * h);
        // Five-point differences have truncation and rounding errors.
        assert!(
            (by_dual.eps - difference).abs() < 1e-7 * (difference.abs() + value.abs()),
            "q[{i}]: {} by dual numbers, {difference} by differences",
            by_dual.eps
        );
        slopes[i] = by_dual.eps;
    }
    assert!(slopes.iter().any(|slope| *slope != 0.0));
    // Second derivatives exist: a Hessian of zeros is found wrong, or is right.
    let report = check_hessian(energy, &q, &[[0.0; N]; N]);
    assert!(report.max_relative_error.hessian.is_finite());
}

first_attempts! {
    // A tip magnet that a fixed one repels.
    magnetic_tip: [0.3, 0.1, 0.05], |q| {
        let r2 = q[0] * q[0] + q[1] * q[1] + q[2] * q[2];
        D::from(1e-3) / r2.sqrt().powi(3)
    }
    // A Winkler foundation with a cubic part.
    foundation: [0.02, -0.01, 0.03], |q| {
        q.iter().map(|y| *y * *y * 500.0 + y.powi(4) * 1e4 / 4.0).sum::<D>() / 2.0
    }
    morse_spring: [0.1, 0.35], |q| {
        let (depth, a, rest) = (2.0, 5.0, 0.2);
        let stretch = (q[1] - q[0]).abs() - rest;
        (D::from(1.0) - (stretch * -a).exp()).powi(2) * depth
    }
    fene_spring: [0.1, 0.35], |q| {
        let (k, longest) = (30.0, 0.5);
        let x = (q[1] - q[0]) / longest;
        (-x * x + 1.0).ln() * (-k * longest * longest / 2.0)
    }
    // The wall that a tip meets, smoothed.
    tanh_contact: [0.01], |q| {
        let gap = q[0] - 0.012;
        let touching = (-(gap / 1e-3).tanh() + 1.0) / 2.0;
        gap.powi(2) * 1e5 * touching
    }
    one_sided_contact: [-0.004, 0.02], |q| {
        let mut sum = D::from(0.0);
        for y in q {
            if *y < 0.0 {
                sum += y.abs().powf(2.5) * 1e6;
            }
        }
        sum
    }
    softplus: [0.3], |q| {
        let mut x = q[0];
        x *= 4.0;
        x -= 1.0;
        (x.exp() + 1.0).ln() / 4.0
    }
    // A floor below the smaller of two heights, a ceiling above the larger.
    floor_and_ceiling: [0.2, 0.5], |q| {
        let low = q[0].min(q[1]) - 0.25;
        let high = q[0].max(q[1]) - 0.4;
        low.powi(2) + high * high * 3.0
    }
    // Opening angle of three points, by the law of cosines.
    angle: [0.0, 0.0, 0.1, 0.01, 0.2, 0.05], |q| {
        let (ux, uy) = (q[2] - q[0], q[3] - q[1]);
        let (vx, vy) = (q[4] - q[2], q[5] - q[3]);
        let cosine = (ux * vx + uy * vy) / (ux.hypot(uy) * vx.hypot(vy));
        let angle = cosine.acos();
        angle * angle / 2.0
    }
    // Gravity of a pendulum with an angular spring.
    pendulum: [0.4], |q| {
        let mut energy = -q[0].cos() * 9.81 + 9.81;
        energy += (q[0] - 0.1).powi(2) * 0.5;
        energy /= 2.0;
        energy
    }
    // A dielectric elastomer's field: hyperbolic functions and angles.
    field: [0.2, 0.3], |q| {
        let (x, y) = (q[0], q[1]);
        x.sinh() * y.cosh() + x.atan2(y) + (x / y).atan() - (x * y).asin()
    }
    lennard_jones: [0.9, 1.1], |q| {
        let mut r = q[0];
        r /= q[1];
        let sixth = r.recip().powi(6);
        let energy = (sixth * sixth - sixth) * 4.0;
        if energy > 100.0 { D::from(100.0) } else { energy }
    }
}
