//! Modes of a rod under loads without a potential: frequencies (rad/s) and growth rates (1/s) of the unsymmetric
//! problem `K x = lambda M x`.
//!
//! Input: a [`Pencil`] whose tangent `K` is not symmetric, and the scale (1/s^2) of a small eigenvalue. With a motion
//! `x exp(s t)`, `s^2 = -lambda`. A positive `lambda` is a vibration, a negative one grows without vibrating
//! (divergence). A pair of complex ones is a vibration that grows, and one that decays, with the same frequency
//! (flutter). Damping is left out. Method: all eigenvalues of the dense matrix `M^(1/2) (K + scale M)^-1 M^(1/2)`,
//! whose largest ones are the lowest of the pencil, and accurate. Imaginary parts below the rounding error are zero. An
//! error for more unknowns than [`MOST_UNKNOWNS`].

use crate::error::Error;
use crate::numerics::tangent::{Factors, Tangent};
use crate::numerics::total_order;
use crate::statics::Pencil;
use faer::Mat;

/// Largest number of unknowns of the dense problem, which takes about half a minute.
const MOST_UNKNOWNS: usize = 1600;
/// Multiple of `eps` times the largest eigenvalue of the inverse up to which its imaginary parts are rounding errors.
const ROUNDING: f64 = 1e3;

/// A mode under loads without a potential.
pub(super) struct FollowerMode {
    /// Angular frequency, rad/s, zero or above; minus the growth rate, 1/s, of a divergence.
    pub frequency: f64,
    /// Growth rate, 1/s; negative if the vibration decays.
    pub growth_rate: f64,
    /// Real part of the mode over the unknowns of the pencil, at the phase at which its largest entry, weighted by the
    /// root of its mass, is real. It is not normalized.
    pub vector: Vec<f64>,
}

/// All modes of a pencil with their growth rates, in ascending order of frequency; that of a divergence is minus its
/// growth rate. `scale`, 1/s^2, is the size of a small eigenvalue: the matrix `K + scale M` is inverted. Modes whose
/// eigenvalue of the inverse is zero to rounding are left out.
///
/// # Errors
/// [`Error::Invalid`] for too many unknowns, [`Error::SingularEquilibrium`] if `K + scale M` is singular or the
/// eigenvalues cannot be computed.
pub(super) fn follower_modes<T: Tangent<f64>>(
    pencil: &Pencil<f64, T>,
    scale: f64,
) -> Result<Vec<FollowerMode>, Error> {
    let moving: Vec<usize> = pencil.free.clone().filter(|i| pencil.mass[*i] > 0.0).collect();
    let n = moving.len();
    if n > MOST_UNKNOWNS {
        let found = format!("a mesh with {n} unknowns under loads without a potential");
        let allowed = format!("up to {MOST_UNKNOWNS} unknowns for their modes");
        return Err(Error::invalid("rod.segments", found, allowed));
    }
    let factors = pencil.factors(-scale)?;
    let roots: Vec<f64> = moving.iter().map(|i| pencil.mass[*i].sqrt()).collect();
    let mut inverse = Mat::zeros(n, n);
    let mut column = vec![0.0; pencil.mass.len()];
    for (k, unknown) in moving.iter().enumerate() {
        column.fill(0.0);
        column[*unknown] = roots[k];
        factors.solve(&mut column);
        for (r, row) in moving.iter().enumerate() {
            inverse[(r, k)] = roots[r] * column[*row];
        }
    }
    let eigen = inverse.eigen().map_err(|_| Error::SingularEquilibrium)?;
    let (values, vectors) = (eigen.S().column_vector(), eigen.U());
    let largest = (0..n).map(|k| values[k].re.hypot(values[k].im)).fold(0.0, f64::max);
    let rounding = ROUNDING * f64::EPSILON * largest;
    let mut modes = Vec::with_capacity(n);
    for k in 0..n {
        let [re, im] = [values[k].re, values[k].im];
        let square = re * re + im * im;
        if square.sqrt() <= f64::EPSILON * largest {
            continue;
        }
        // The eigenvalue of the pencil, and the root of its negative.
        let real = re / square - scale;
        let imaginary = if im.abs() <= rounding { 0.0 } else { -im / square };
        let [frequency, growth_rate] = if imaginary == 0.0 {
            // An eigenvalue within the rounding error of the inverse is zero.
            let real = if real.abs() * square <= rounding { 0.0 } else { real };
            let root = real.abs().sqrt();
            if real < 0.0 { [-root, root] } else { [root, 0.0] }
        } else {
            let size = real.hypot(imaginary);
            let growth = (0.5 * (size - real)).sqrt();
            [(0.5 * (size + real)).sqrt(), growth.copysign(imaginary)]
        };
        let of = |i: usize| (vectors[(i, k)].re, vectors[(i, k)].im);
        let (most, _) = (0..n).fold((0, 0.0), |(place, size), i| {
            let own = of(i).0.hypot(of(i).1);
            if own > size { (i, own) } else { (place, size) }
        });
        let (a, b) = of(most);
        let mut vector = vec![0.0; pencil.mass.len()];
        for (i, unknown) in moving.iter().enumerate() {
            vector[*unknown] = (of(i).0 * a + of(i).1 * b) / roots[i];
        }
        modes.push(FollowerMode { frequency, growth_rate, vector });
    }
    modes.sort_by_cached_key(|mode| total_order(mode.frequency));
    Ok(modes)
}
