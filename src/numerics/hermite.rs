//! Cubic Hermite interpolation between two time steps, from positions and velocities at both.
//!
//! Input: two times `t0`, `t1` and a time `t`, s, which may carry derivatives (dual numbers). Output:
//! [`HermiteWeights`], the weights of the two positions and the two velocities. `new` returns those of the position at
//! `t`; a `t` outside of the interval is clamped to it, but keeps its derivatives. `derivative` returns those of the
//! velocity at `t`, and extrapolates outside of the interval. Recorded frames between the steps of a simulation are
//! interpolated with it.

use crate::numerics::scalar::Scalar;

/// Weights of the cubic Hermite interpolant: the interpolated value is `x0 x(t0) + x1 x(t1) + v0 v(t0) + v1 v(t1)`.
pub(crate) struct HermiteWeights<D> {
    /// Weight of the position at the first time.
    pub x0: D,
    /// Weight of the position at the second time.
    pub x1: D,
    /// Weight of the velocity at the first time.
    pub v0: D,
    /// Weight of the velocity at the second time.
    pub v1: D,
}

impl<D: Scalar> HermiteWeights<D> {
    /// Weights of the interpolant's derivative by time, the velocity, at `t` between the times `t0` and `t1`, s. A `t`
    /// outside of the interval extrapolates.
    pub fn derivative(t0: f64, t1: f64, t: D) -> Self {
        let h = t1 - t0;
        let u = (t - t0) / h;
        let w = -u + 1.0;
        let x1 = u * w * (6.0 / h);
        Self { x0: -x1, x1, v0: w * (w - u * 2.0), v1: u * (u - w * 2.0) }
    }

    /// Weights of the position at `t` between the times `t0` and `t1`, s. A `t` outside of the interval is clamped to
    /// it; its derivatives stay.
    pub fn new(t0: f64, t1: f64, t: D) -> Self {
        let h = t1 - t0;
        let mut u = (t - D::from(t0)) * (1.0 / h);
        if !(0.0..=1.0).contains(&u.value()) {
            // Rounding may move `t` out of the interval.
            u = u - D::from(u.value()) + u.value().clamp(0.0, 1.0);
        }
        let (w, u2) = (-u + 1.0, u * u);
        let x1 = u2 * (u * -2.0 + 3.0);
        Self { x0: -x1 + 1.0, x1, v0: u * w * w * h, v1: -(u2 * w) * h }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hermite_reproduces_a_cubic() {
        // Cubics are interpolated exactly, by value and derivative.
        let (x, v) = (|t: f64| t * t * t - 2.0 * t, |t: f64| 3.0 * t * t - 2.0);
        let (t0, t1) = (0.3, 0.7);
        for t in [0.3, 0.41, 0.55, 0.7] {
            let w = HermiteWeights::new(t0, t1, t);
            let value = w.x0 * x(t0) + w.x1 * x(t1) + w.v0 * v(t0) + w.v1 * v(t1);
            assert!((value - x(t)).abs() < 1e-15);
            let w = HermiteWeights::derivative(t0, t1, t);
            let rate = w.x0 * x(t0) + w.x1 * x(t1) + w.v0 * v(t0) + w.v1 * v(t1);
            assert!((rate - v(t)).abs() < 1e-14);
        }
    }
}
