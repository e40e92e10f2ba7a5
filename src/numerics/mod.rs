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
pub mod terms;
mod trigonometry;
pub mod vector;

pub(crate) use linearized::half_square;
