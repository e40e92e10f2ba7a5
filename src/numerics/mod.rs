//! What knows nothing of rods: numbers and their derivatives, vectors, band matrices, interpolation,
//! and least squares.

pub mod abreast;
pub mod banded;
pub mod called;
pub(crate) mod decay;
pub(crate) mod hermite;
pub mod krylov;
pub mod lanes;
pub mod led;
pub mod levenberg_marquardt;
mod linearized;
pub(crate) mod noise_scale;
pub mod scalar;
pub(crate) mod spectrum;
pub mod tangent;
pub mod terms;
mod trigonometry;
pub mod vector;

pub(crate) use linearized::half_square;

/// A key with the order of [`f64::total_cmp`]. All lists that are sorted by it (`sort_by_cached_key`) share one compiled sort.
pub fn ordered(x: f64) -> i64 {
    let bits = x.to_bits().cast_signed();
    bits ^ ((bits >> 63).cast_unsigned() >> 1).cast_signed()
}

#[cfg(test)]
mod tests {
    #[test]
    fn keys_have_the_order_of_all_numbers() {
        let all = [f64::NAN, f64::INFINITY, 1.0, -0.0, 0.0, -1.0, f64::NEG_INFINITY, -f64::NAN];
        for (a, b) in all.iter().flat_map(|a| all.iter().map(move |b| (a, b))) {
            assert_eq!(super::ordered(*a).cmp(&super::ordered(*b)), a.total_cmp(b), "{a} {b}");
        }
    }
}
