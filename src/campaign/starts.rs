//! Random start values of fits (`[starts]` of a campaign), and seeds of their bootstraps.
//!
//! Input: a fit file with its changes, the id of the fit, the seed of the campaign, and the number of the start (from
//! 0). Each parameter that is not `fixed` has a start uniform between its bounds, in its unit; for positive parameters
//! it is log-uniform. Missing, infinite or reversed bounds are errors, and so is a lower bound of 0 or less of a
//! positive parameter. [`start_ranges`] returns the ranges of all such parameters, [`start`] changes
//! `parameter.K.start` of the fit file, from which `plan` makes a task. [`bootstrap_seed`] returns a seed of 63 bits.
//! The generator (ChaCha8) is keyed by the SHA-256 of id and seed, with one stream per start. So every start is
//! reproducible and independent of the other fits and starts.

use crate::campaign::changes::Changes;
use crate::campaign::resolved::ResolvedFit;
use crate::error::Error;
use crate::scene::Parameter;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use sha2::{Digest, Sha256};
use toml::Value;

/// The key of a random generator: the SHA-256 of the text `id seed`, with the id of a fit and the seed of the campaign.
fn generator_key(id: &str, seed: u64) -> [u8; 32] {
    Sha256::digest(format!("{id} {seed}")).into()
}

/// The seed of a fit's bootstrap, 0 or more: 63 bits of the first 8 bytes of [`generator_key`], as fit files take whole
/// numbers below 2^63.
pub(crate) fn bootstrap_seed(id: &str, seed: u64) -> i64 {
    let [a, b, c, d, e, f, g, h, ..] = generator_key(id, seed);
    i64::from_le_bytes([a, b, c, d, e, f, g, h]) & i64::MAX
}

/// The range from which start values of a parameter are drawn, in the parameter's unit; log-uniform if
/// `is_logarithmic`.
pub(crate) struct StartRange {
    /// Index of the parameter in the fit file.
    index: usize,
    low: f64,
    high: f64,
    is_logarithmic: bool,
}

/// The ranges of all parameters of the fit file that are not `fixed`, in its order: their bounds in the parameter's
/// unit, log-uniform for positive parameters. Missing, infinite or reversed bounds are errors, and so is a lower bound
/// of 0 or less for a positive parameter.
pub(crate) fn start_ranges(fit: &ResolvedFit) -> Result<Vec<StartRange>, Error> {
    let parameters = fit.table.get("parameter").and_then(Value::as_array).into_iter().flatten();
    let mut ranges = Vec::new();
    for (index, parameter) in parameters.enumerate().filter(|(_, p)| p.get("fixed").is_none()) {
        let bound = |k: usize| match parameter.get("bounds")?.get(k)? {
            Value::Float(x) => Some(*x),
            Value::Integer(n) => Some(*n as f64),
            _ => None,
        };
        let invalid = |found: String| {
            let key = format!("parameter[{index}].bounds");
            let allowed =
                "bounds = [low, high] of every parameter, between which random starts are drawn";
            Error::invalid(key, found, allowed).in_file(Some(&fit.file))
        };
        // Random starts need a finite range, and a positive one for a logarithmic scale.
        let bounds = bound(0).zip(bound(1));
        let (low, high) = bounds.ok_or_else(|| invalid("none".into()))?;
        // Positive parameters may vary over decades: they are drawn on a logarithmic scale.
        let name = parameter.get("name").and_then(Value::as_str).and_then(Parameter::named);
        let is_logarithmic = name.is_some_and(Parameter::is_positive);
        let is_finite = low.is_finite() && high.is_finite();
        if !(is_finite && low < high && (low > 0.0 || !is_logarithmic)) {
            return Err(invalid(format!("[{low}, {high}]")));
        }
        ranges.push(StartRange { index, low, high, is_logarithmic });
    }
    Ok(ranges)
}

/// The random start number `number` (from 0) as changes `parameter.K.start` of the fit file, one per range, in the unit
/// of each parameter. A start is uniform from `low` to `high`, or log-uniform: `low (high/low)^u` with `u` uniform from
/// 0 to 1. `id` and `seed` key the generator, and `number` is its stream.
pub(crate) fn start(ranges: &[StartRange], id: &str, seed: u64, number: usize) -> Changes {
    let mut random = ChaCha8Rng::from_seed(generator_key(id, seed));
    // Every start has a stream of its own, so that it does not depend on the others.
    random.set_stream(number as u64);
    let draw = |StartRange { index, low, high, is_logarithmic }: &StartRange| {
        let part: f64 = random.random_range(0.0..1.0);
        let value = match is_logarithmic {
            true => low * (high / low).powf(part),
            false => low + (high - low) * part,
        };
        // A rounding error may exceed a bound.
        (format!("parameter.{index}.start"), Value::Float(value.clamp(*low, *high)))
    };
    ranges.iter().map(draw).collect()
}
