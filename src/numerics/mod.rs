//! What knows nothing of rods: numbers and their derivatives, vectors, band matrices, interpolation,
//! and least squares.

pub mod banded;
pub(crate) mod hermite;
pub mod lanczos;
pub mod lanes;
pub mod levenberg_marquardt;
mod linearized;
pub(crate) mod noise_scale;
pub mod out_of_line;
pub(crate) mod phi_function;
pub mod prescribed_dofs;
pub mod scalar;
pub mod simd;
pub(crate) mod spectrum;
pub mod tangent;
pub mod term_bound;
mod trigonometry;
pub mod vector;

pub(crate) use linearized::half_sum_of_squares;

/// A key with the order of [`f64::total_cmp`]. All lists that are sorted by it (`sort_by_cached_key`) share one compiled sort.
pub fn total_order(x: f64) -> i64 {
    let bits = x.to_bits().cast_signed();
    bits ^ ((bits >> 63).cast_unsigned() >> 1).cast_signed()
}

#[cfg(test)]
mod tests {
    #[test]
    fn keys_have_the_order_of_all_numbers() {
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
