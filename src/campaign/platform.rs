//! Key of the machine and library that determine the last digits of a result.

use crate::campaign::hash::hash;
use crate::numerics::simd::simd_level;
use std::env::consts::{ARCH, OS};
use std::hint::black_box;
use std::sync::OnceLock;

/// Arguments at which every function of the mathematical library is evaluated.
const ARGUMENTS: usize = 256;

/// The target, a hash of values of the mathematical library, and the vector unit: results with the same key are equal to
/// the last bit. Values identify the library, as one version has several variants for different processors.
pub fn platform() -> &'static str {
    static KEY: OnceLock<String> = OnceLock::new();
    KEY.get_or_init(|| {
        let environment = match () {
            () if cfg!(target_env = "gnu") => "-gnu",
            () if cfg!(target_env = "musl") => "-musl",
            () if cfg!(target_env = "msvc") => "-msvc",
            () => "",
        };
        // All bits of the values enter the hash.
        let bytes: Vec<u8> =
            (0..ARGUMENTS).flat_map(|k| values(argument(k))).flat_map(f64::to_le_bytes).collect();
        format!("{ARCH}-{OS}{environment} libm-{} {}", hash(&bytes, 4), simd_level())
    })
}

/// The k-th argument: spread over decades, with all digits in use.
fn argument(k: usize) -> f64 {
    black_box(1e-3 * (k as f64 * 0.05 + 1.0 / 3.0).exp2())
}

/// Values of the functions of the mathematical library at an argument.
fn values(x: f64) -> [f64; 16] {
    let small = x / (1.0 + x);
    [
        x.sin(),
        x.cos(),
        x.tan(),
        small.asin(),
        small.acos(),
        x.atan(),
        x.atan2(small),
        x.hypot(small),
        x.min(100.0).exp(),
        x.ln(),
        x.log10(),
        x.powf(small),
        x.min(100.0).sinh(),
        x.min(100.0).cosh(),
        x.tanh(),
        x.cbrt(),
    ]
}
