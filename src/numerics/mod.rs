//! Numerical methods that do not depend on rods.
//!
//! Numbers: the trait [`Scalar`](scalar::Scalar) (`scalar`), SIMD vectors of `f64` (`simd`, `trigonometry`), numbers
//! with operations as function calls (`out_of_line`), arrays of numbers (`directions`), error bounds of derivatives
//! (`term_bound`) and their common `operators`. Also the function `phi_1` (`phi_function`), vectors of three
//! components, `rotation`s, and their mean (`mean_rotation`). Symmetric matrices: the traits of `tangent`, `banded` and
//! `envelope` storage with `L D L^T` factors, `prescribed_dofs`, and the `lanczos` method. Matrices that are not
//! symmetric: `envelope_lu` and `dense_lu` with `L U` factors. Signals: `hermite` interpolation in time, power spectra
//! (`spectrum`), and noise estimates (`noise_scale`). Nonlinear least squares: `levenberg_marquardt`, with the step of
//! `linearized`. This file itself has `total_order`, an integer with the order of floating-point numbers, and two
//! medians. Of an even number of values, `upper_median` is the larger of the two middle ones (`None` without values),
//! and `median` their mean (0 without values).

pub mod banded;
pub mod dense_lu;
pub mod directions;
pub mod envelope;
pub mod envelope_lu;
pub(crate) mod hermite;
pub mod lanczos;
pub mod levenberg_marquardt;
mod linearized;
pub(crate) mod mean_rotation;
pub(crate) mod noise_scale;
mod operators;
pub mod out_of_line;
pub(crate) mod phi_function;
pub mod prescribed_dofs;
pub mod rotation;
pub mod scalar;
pub mod simd;
pub(crate) mod spectrum;
pub(crate) mod stopwatch;
pub mod tangent;
pub mod term_bound;
mod trigonometry;
pub mod vector;

pub(crate) use linearized::{column_norms, half_sum_of_squares};

/// An integer for `x` such that integers are ordered as the numbers by [`f64::total_cmp`], NaN included. Lists that are
/// sorted by it with `sort_by_cached_key` share one compiled sort.
pub fn total_order(x: f64) -> i64 {
    let bits = x.to_bits().cast_signed();
    // Larger sizes of negative numbers come first: all bits but their sign are inverted.
    bits ^ ((bits >> 63).cast_unsigned() >> 1).cast_signed()
}

/// The median of `values`: the larger of the two middle ones of an even number; `None` without values. NaN is sorted as
/// by [`f64::total_cmp`].
pub(crate) fn upper_median(values: impl Iterator<Item = f64>) -> Option<f64> {
    let mut values: Vec<f64> = values.collect();
    values.sort_by_cached_key(|x| total_order(*x));
    values.get(values.len() / 2).copied()
}

/// Median of `values`, the mean of the two middle ones of an even number; zero of none.
pub(crate) fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.collect();
    values.sort_by_cached_key(|x| total_order(*x));
    match values.len() {
        0 => 0.0,
        n => 0.5 * (values[(n - 1) / 2] + values[n / 2]),
    }
}

#[cfg(test)]
mod tests {
    #[test]
    fn total_order_agrees_with_total_cmp_for_all_kinds_of_numbers() {
        let all = [f64::NAN, f64::INFINITY, 1.0, -0.0, 0.0, -1.0, f64::NEG_INFINITY, -f64::NAN];
        for (a, b) in all.iter().flat_map(|a| all.iter().map(move |b| (a, b))) {
            assert_eq!(
                super::total_order(*a).cmp(&super::total_order(*b)),
                a.total_cmp(b),
                "{a} {b}"
            );
        }
    }
}
