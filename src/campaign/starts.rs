//! What is drawn at random: where fits start, and seeds.

use crate::campaign::changes::Changes;
use crate::campaign::resolved::Resolved;
use crate::error::Error;
use crate::scene::Parameter;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use sha2::{Digest, Sha256};
use toml::Value;

/// Random numbers that belong to a fit, by its id, and to the seed of the campaign.
fn key(id: &str, seed: u64) -> [u8; 32] {
    Sha256::digest(format!("{id} {seed}")).into()
}

/// The seed of a fit's bootstrap. Files take whole numbers up to 2^63.
pub(crate) fn seed(id: &str, seed: u64) -> i64 {
    let [a, b, c, d, e, f, g, h, ..] = key(id, seed);
    i64::from_le_bytes([a, b, c, d, e, f, g, h]) & i64::MAX
}

/// Where parameters are looked for: name, bounds, and whether on a logarithmic scale.
pub(crate) struct Range {
    index: usize,
    low: f64,
    high: f64,
    logarithmic: bool,
}

/// The ranges of all parameters that are identified.
pub(crate) fn ranges(fit: &Resolved) -> Result<Vec<Range>, Error> {
    let parameters = fit.table.get("parameter").and_then(Value::as_array);
    let open = parameters.into_iter().flatten().enumerate();
    let open = open.filter(|(_, parameter)| parameter.get("fixed").is_none());
    open.map(|(index, parameter)| {
        let number = |k: usize| match parameter.get("bounds")?.get(k)? {
            Value::Float(x) => Some(*x),
            Value::Integer(n) => Some(*n as f64),
            _ => None,
        };
        let refused = |found: &str| {
            let allowed =
                "bounds = [low, high] of every parameter, between which random starts are drawn";
            Error::invalid(format!("parameter[{index}].bounds"), found, allowed)
                .in_file(Some(&fit.file))
        };
        let (Some(low), Some(high)) = (number(0), number(1)) else { return Err(refused("none")) };
        let name = parameter.get("name").and_then(Value::as_str).and_then(Parameter::named);
        let logarithmic = name.is_some_and(Parameter::is_positive);
        match low.is_finite() && high.is_finite() && low < high && (low > 0.0 || !logarithmic) {
            true => Ok(Range { index, low, high, logarithmic }),
            false => Err(refused(&format!("[{low}, {high}]"))),
        }
    })
    .collect()
}

/// One of the random starts of a fit.
pub(crate) fn start(ranges: &[Range], id: &str, seed: u64, number: usize) -> Changes {
    let mut random = ChaCha8Rng::from_seed(key(id, seed));
    random.set_stream(number as u64);
    let draw = |range: &Range| {
        let part: f64 = random.random_range(0.0..1.0);
        let value = match range.logarithmic {
            true => range.low * (range.high / range.low).powf(part),
            false => range.low + (range.high - range.low) * part,
        };
        // Rounding may lead out of the bounds.
        let value = value.clamp(range.low, range.high);
        (format!("parameter.{}.start", range.index), Value::Float(value))
    };
    ranges.iter().map(draw).collect()
}
