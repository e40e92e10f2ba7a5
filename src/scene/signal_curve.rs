//! Values, rates and means of a signal over any scalar.
//!
//! A [`SignalCurve`] is `gain * s(t - delay)`, with `s` a sine or polynomials in the time since a knot (ramp, pulse,
//! steps, samples). Before the first knot `s` is 0, or the first sample. [`SignalCurve::value`] is its value at a time,
//! s, [`SignalCurve::rate`] its derivative, 1/s, and [`SignalCurve::mean`] its mean over an interval. The mean is the
//! exact integral over the length, so that a jump within a time step enters by its exact impulse.
//!
//! All have derivatives with respect to time, or the ends of the interval, gain, delay and the numbers of the signal
//! (not samples). Where a time or an end meets a jump or a kink, they are one-sided, with the value after it.

use crate::numerics::scalar::Scalar;
use crate::scene::signal_samples::SignalSamples;
use std::sync::Arc;

/// A signal with gain and delay, ready to be evaluated.
#[derive(Clone, Debug)]
pub struct SignalCurve<D> {
    /// Factor of the signal.
    pub(super) gain: D,
    /// Time by which it is later, s.
    pub(super) delay: D,
    /// The signal without both.
    pub(super) shape: CurveShape<D>,
}

/// The shape of a signal.
#[derive(Clone, Debug)]
pub(super) enum CurveShape<D> {
    /// `amplitude sin(angular_frequency t + phase)`; rad/s and rad.
    Sine { amplitude: D, angular_frequency: D, phase: D },
    /// Polynomials in the time since each knot, s; zero before the first one.
    Pieces { knots: Vec<D>, pieces: Vec<[D; 4]> },
    /// Samples of a file, constant before the first one.
    Samples(Arc<SignalSamples>),
}

/// `sin(x)/x`, for |x| < 0.02 by its series to `x^6`. Its derivatives exist at 0 too.
fn sinc<D: Scalar>(x: D) -> D {
    let square = x * x;
    match x.value().abs() < 0.02 {
        // The next term is below 1e-18.
        true => ((square * (-1.0 / 5040.0) + 1.0 / 120.0) * square - 1.0 / 6.0) * square + 1.0,
        false => x.sin() / x,
    }
}

/// The cubic polynomial `c[0] + c[1] u + c[2] u^2 + c[3] u^3`.
fn polynomial<D: Scalar>(c: &[D; 4], u: D) -> D {
    ((c[3] * u + c[2]) * u + c[1]) * u + c[0]
}

impl<D: Scalar> CurveShape<D> {
    /// The time of the knot `k`, s; none beyond the last one, and for a sine.
    fn knot(&self, k: usize) -> Option<D> {
        match self {
            Self::Sine { .. } => None,
            Self::Pieces { knots, .. } => knots.get(k).copied(),
            Self::Samples(samples) => samples.times.get(k).map(|t| D::from(*t)),
        }
    }

    /// Coefficients of the polynomial in the time since the knot `k`, ascending from the constant. `None` is the part
    /// before the first knot: zero, or the constant first sample. Zero for a sine. It panics for a knot that does not
    /// exist.
    fn piece(&self, k: Option<usize>) -> [D; 4] {
        let zero = D::from(0.0);
        match (self, k) {
            (Self::Pieces { pieces, .. }, Some(k)) => pieces[k],
            (Self::Samples(samples), Some(k)) => samples.pieces[k].map(D::from),
            (Self::Samples(samples), None) => [samples.pieces[0][0].into(), zero, zero, zero],
            _ => [zero; 4],
        }
    }

    /// The index of the last knot at or before the time `t`, s; none before the first one.
    fn last_knot(&self, t: f64) -> Option<usize> {
        let count = match self {
            Self::Sine { .. } => 0,
            Self::Pieces { knots, .. } => knots.partition_point(|knot| knot.value() <= t),
            Self::Samples(samples) => samples.times.partition_point(|knot| *knot <= t),
        };
        count.checked_sub(1)
    }

    /// For a signal that is not a sine: coefficients of the polynomial piece that contains the time `t`, s, ascending
    /// from the constant, and the time since its knot, s (0 before the first knot). At a knot it is the piece after it.
    fn local(&self, t: D) -> ([D; 4], D) {
        let k = self.last_knot(t.value());
        let since = k.and_then(|k| self.knot(k)).map_or(D::from(0.0), |knot| t - knot);
        (self.piece(k), since)
    }

    /// The integral of a signal that is not a sine, without gain and delay, from the time `a` to `b >= a`, s, over all
    /// pieces between; in s.
    fn integral(&self, a: D, b: D) -> D {
        let (mut from, mut k) = (a, self.last_knot(a.value()));
        let mut sum = D::from(0.0);
        loop {
            let following = k.map_or(0, |k| k + 1);
            // A knot at the end is passed: the derivative by the end is then that of the next piece.
            let next = self.knot(following).filter(|next| next.value() <= b.value());
            let to = next.unwrap_or(b);
            let piece = self.piece(k);
            let start = k.and_then(|k| self.knot(k)).map_or(D::from(0.0), |knot| from - knot);
            // Gauss quadrature with two points is exact for cubics.
            let (half, root) = ((to - from) * 0.5, 1.0 / 3.0_f64.sqrt());
            for place in [1.0 - root, 1.0 + root] {
                sum += half * polynomial(&piece, start + half * place);
            }
            if next.is_none() {
                return sum;
            }
            (from, k) = (to, Some(following));
        }
    }
}

impl<D: Scalar> SignalCurve<D> {
    /// The value at the time `t`, s, with gain and delay; at a jump that after it.
    pub fn value(&self, t: D) -> D {
        let t = t - self.delay;
        let value = match &self.shape {
            CurveShape::Sine { amplitude, angular_frequency, phase } => {
                *amplitude * (*angular_frequency * t + *phase).sin()
            }
            shape => {
                let (piece, since) = shape.local(t);
                polynomial(&piece, since)
            }
        };
        self.gain * value
    }

    /// The derivative by time at `t`, s, in 1/s: at a kink or jump that of the part after it. Jumps themselves do not
    /// contribute.
    pub fn rate(&self, t: D) -> D {
        let t = t - self.delay;
        let rate = match &self.shape {
            CurveShape::Sine { amplitude, angular_frequency, phase } => {
                *amplitude * *angular_frequency * (*angular_frequency * t + *phase).cos()
            }
            shape => {
                let ([_, first, second, third], u) = shape.local(t);
                (third * u * 3.0 + second * 2.0) * u + first
            }
        };
        self.gain * rate
    }

    /// The mean from the time `from` to `to`, s, which must be later, with gain and delay: the exact integral over the
    /// length of the interval.
    pub fn mean(&self, from: D, to: D) -> D {
        let (from, to) = (from - self.delay, to - self.delay);
        let mean = match &self.shape {
            CurveShape::Sine { amplitude, angular_frequency, phase } => {
                let (middle, half) = ((from + to) * 0.5, (to - from) * 0.5);
                let at_middle = (*angular_frequency * middle + *phase).sin();
                *amplitude * at_middle * sinc(*angular_frequency * half)
            }
            shape => shape.integral(from, to) / (to - from),
        };
        self.gain * mean
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::signal_samples::Interpolation;
    use num_dual::Dual64;

    fn samples(interpolation: Interpolation, f: impl Fn(f64) -> f64) -> SignalCurve<f64> {
        let times: Vec<f64> = (0..21).map(|k| 0.05 * f64::from(k)).collect();
        let values: Vec<Option<f64>> = times.iter().map(|t| Some(f(*t))).collect();
        let samples = SignalSamples::new(times, &values, interpolation).unwrap();
        SignalCurve { gain: 2.0, delay: 0.1, shape: CurveShape::Samples(Arc::new(samples)) }
    }

    #[test]
    fn cubic_spline_reproduces_a_cubic_with_its_rate_and_mean() {
        let curve = samples(Interpolation::Cubic, |t| t * t * t - 2.0 * t);
        for t in [0.13, 0.2, 0.55, 0.93] {
            let u: f64 = t - 0.1;
            assert!((curve.value(t) - 2.0 * (u.powi(3) - 2.0 * u)).abs() < 1e-14);
            assert!((curve.rate(t) - 2.0 * (3.0 * u * u - 2.0)).abs() < 1e-12);
            let integral = |u: f64| 0.25 * u.powi(4) - u * u;
            let mean = 2.0 * (integral(u + 0.07) - integral(u)) / 0.07;
            assert!((curve.mean(t, t + 0.07) - mean).abs() < 1e-13);
        }
    }

    #[test]
    fn mean_over_a_jump_has_its_exact_impulse_and_derivative_by_the_delay() {
        // One from t = 0.3 + delay on.
        let curve = |delay: Dual64| SignalCurve {
            gain: Dual64::from(1.0),
            delay,
            shape: CurveShape::Pieces {
                knots: vec![Dual64::from(0.3)],
                pieces: vec![[1.0, 0.0, 0.0, 0.0].map(Dual64::from)],
            },
        };
        let mean = curve(Dual64::new(0.1, 1.0)).mean(0.35.into(), 0.45.into());
        assert!((mean.re - 0.5).abs() < 1e-14 && (mean.eps + 10.0).abs() < 1e-12);
        // A jump at the end of one interval belongs to the derivative of that one, and of no other.
        let [before, after] = [(0.25, 0.5), (0.5, 0.75)]
            .map(|(a, b): (f64, f64)| curve(Dual64::new(0.2, 1.0)).mean(a.into(), b.into()));
        assert_eq!((before.re, before.eps, after.re, after.eps), (0.0, -4.0, 1.0, 0.0));
    }

    #[test]
    fn mean_of_a_sine_is_its_integral_at_every_length() {
        let shape = CurveShape::Sine { amplitude: 3.0, angular_frequency: 7.0, phase: 0.4 };
        let curve = SignalCurve { gain: 0.5, delay: 0.2, shape };
        let integral = |t: f64| -1.5 / 7.0 * (7.0 * (t - 0.2) + 0.4).cos();
        for h in [1e-3, 4e-3, 0.1, 2.0] {
            let exact = (integral(0.6 + h) - integral(0.6)) / h;
            assert!((curve.mean(0.6, 0.6 + h) - exact).abs() < 1e-12 / h.min(1.0));
        }
    }
}
