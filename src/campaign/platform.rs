//! The key of the platform of a result: processor architecture, operating system, C library, a hash of its mathematical
//! functions, and vector unit.
//!
//! The last digits of a fit depend on the implementation of sin, exp and similar functions, of which one library may
//! have several variants. So the key contains a hash (4 bytes, hexadecimal) of all bits of the values of 16 functions
//! at `ARGUMENTS` positive arguments. [`platform`] returns the key as text, as `x86_64-linux-gnu libm-1a2b3c4d` and the
//! vector unit, computed once per process. It is a part of every stored result: results with equal keys are compared
//! byte by byte, others with a tolerance.

use crate::campaign::hash::hash;
use crate::numerics::simd::simd_level;
use std::env::consts::{ARCH, OS};
use std::hint::black_box;
use std::sync::OnceLock;

/// Number of arguments at which every function of the mathematical library is evaluated. More arguments detect rarer
/// differences between libraries, at a cost of microseconds.
const ARGUMENTS: usize = 256;

/// The key of this process as text, such as `x86_64-linux-gnu libm-1a2b3c4d` and the vector unit, computed once.
/// Results with the same key are equal to the last bit.
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

/// The k-th argument: `1e-3 * 2^(k / 20 + 1/3)`, k from 0, over four decades, with all binary digits in use. The
/// compiler cannot evaluate it in advance.
fn argument(k: usize) -> f64 {
    black_box(1e-3 * (k as f64 * 0.05 + 1.0 / 3.0).exp2())
}

/// Values of 16 functions of the mathematical library (sin to cbrt) at a positive argument; asin, acos and the second
/// arguments of atan2, hypot and powf are `x/(1 + x)`, and exp, sinh and cosh take at most 100.
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
