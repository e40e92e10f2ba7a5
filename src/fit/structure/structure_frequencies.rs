//! Natural frequencies of a structure in a plane with their derivatives by parameters, for comparison with measured
//! ones.
//!
//! Input: a structure, modes by their numbers (from 1, in the plane of the structure), and a list of parameters.
//! Output: one [`NaturalFrequency`] per mode in the same order, rad/s, with its derivatives by all parameters (one
//! computation over dual numbers for each). Modes are those with stiffness about the equilibrium (no free motions),
//! numbered by rising frequency. Modes with a filter (plane, kind or direction) or the correction for thick rods
//! (`timoshenko`) are errors ([`check_names`]). So are structures in space, an unstable mode among the lowest, and
//! fewer modes than the highest number.

use crate::error::{Error, ensure};
use crate::scene::Parameter;
use crate::structure::Structure;
use crate::vibration::{ModeFilter, ModeName, NaturalFrequency};
use num_dual::Dual64;

/// The frequencies, rad/s, of modes by their numbers in the plane of a structure, about its equilibrium, in the order
/// of `modes`. Each has its derivatives by the `parameters`, in their units.
///
/// # Errors
/// Names of modes with a filter or `timoshenko`, a structure in space, an equilibrium that cannot be computed, unstable
/// modes, and fewer modes than the highest number.
pub(crate) fn structure_frequencies(
    structure: &Structure,
    modes: &[ModeName],
    parameters: &[Parameter],
) -> Result<Vec<NaturalFrequency>, Error> {
    check_names(modes, "frequencies")?;
    let count = modes.iter().map(|mode| mode.number).max().unwrap_or(0);
    let plain = structure.natural_frequencies_over(count, |_, value, _| value)?;
    let of_mode = |mode: &ModeName| NaturalFrequency {
        frequency_rad_s: plain[mode.number - 1],
        derivatives: Vec::with_capacity(parameters.len()),
    };
    let mut frequencies: Vec<NaturalFrequency> = modes.iter().map(of_mode).collect();
    // One run for each parameter; the frequencies themselves are those of the plain run.
    for parameter in parameters {
        let duals = structure.natural_frequencies_over(count, |path, value, _| {
            Dual64::new(value, f64::from(u8::from(path == parameter.path())))
        })?;
        for (frequency, mode) in frequencies.iter_mut().zip(modes) {
            frequency.derivatives.push(duals[mode.number - 1].eps);
        }
    }
    Ok(frequencies)
}

/// Rejects `modes` with a filter, as all modes of a structure are in its plane, and with the correction for thick rods
/// (`timoshenko`). `key` is that of the frequencies, for the error.
pub(crate) fn check_names(modes: &[ModeName], key: &str) -> Result<(), Error> {
    let is_plain = modes.iter().all(|mode| mode.among == ModeFilter::default());
    let allowed = "no such keys for a structure, whose modes are all in its plane";
    ensure(is_plain, key, "plane, kind or direction", allowed)?;
    let is_slender = modes.iter().all(|mode| !mode.timoshenko);
    let allowed = "no such key for a structure, whose rods are slender";
    ensure(is_slender, format!("{key}.timoshenko"), "true", allowed)
}
