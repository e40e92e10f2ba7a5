//! First-order low-pass filter of simulated signals.
//!
//! Input: values `u` at recorded times, s, over a scalar type with derivatives, and the cutoff frequency `f`, Hz.
//! Output, in place: the solution of `dy/dt = 2 pi f (u - y)`, exact for `u` linear between the times. It starts at the
//! first value. A list without values stays empty.

use crate::numerics::scalar::Scalar;
use std::f64::consts::TAU;

/// Replaces `values` at these increasing `times`, s, by the output of the filter with the cutoff `frequency`, Hz.
pub(crate) fn low_pass_filter<D: Scalar>(values: &mut [D], times: &[f64], frequency: D) {
    let Some(first) = values.first().copied() else { return };
    let (rate, mut output, mut before) = (frequency * TAU, first, first);
    for (k, value) in values.iter_mut().enumerate().skip(1) {
        let h = times[k] - times[k - 1];
        // dy/dt = rate (u - y) with u linear over the step.
        let lag = (*value - before) / (rate * h);
        before = *value;
        output = before - lag + (output - (before - lag * (rate * h)) + lag) * (-rate * h).exp();
        *value = output;
    }
}
