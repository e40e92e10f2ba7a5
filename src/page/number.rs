//! Numbers with units as text on pages: an SI prefix by the size, and decimals down to the second digit of the error.
//!
//! A [`Scale`] is the factor by which SI values are divided, and the unit with its prefix, common to a table or axis.
//! Without an error a number has at least five significant digits; quantities and fractions (in per cent) have three.
//! All digits in front of the decimal point are written. Very small or large numbers without a prefix have a power of
//! ten, and numbers that are not finite are a dash. Minus signs and exponents are typographic. All sections of pages
//! use these functions; CSV files have plain numbers instead.
//!
//! `Scale::for_size` and `Scale::for_values` choose the prefix; `Scale::format` writes an SI value with the decimals of
//! its error. `quantity` and `percent` write an SI value with a unit and a fraction in per cent with three digits,
//! `signed_quantity` and `signed_percent` with a plus sign too. [`MISSING`] is the dash.

/// Symbols of SI units that take prefixes; kilograms are converted to grams before.
const PREFIXED: [&str; 9] = ["m", "s", "Pa", "Hz", "N", "rad", "J", "W", "g"];
/// Units whose prefix always follows from the size; that of others does so only for sizes outside [`PLAIN`].
const ALWAYS_PREFIXED: [&str; 7] = ["m", "s", "Pa", "Hz", "N", "rad", "J"];
/// Sizes that are displayed without a prefix in all other units, and in three digits without a power of ten.
const PLAIN: std::ops::Range<f64> = 1e-3..1e5;
/// Prefixes from 10^-12 to 10^12, in steps of a thousand.
const PREFIXES: [&str; 9] = ["p", "n", "\u{b5}", "m", "", "k", "M", "G", "T"];
/// Index of the empty prefix in [`PREFIXES`].
const NO_PREFIX: i32 = 4;
/// Decimals of a number of order one whose error is not known.
const DECIMALS_WITHOUT_ERROR: f64 = 4.0;
/// Text in the place of a missing number: a dash.
pub(super) const MISSING: &str = "\u{2013}";

/// The factor by which SI values are divided for display, and the unit of the quotients.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Scale {
    /// SI value of one displayed unit.
    pub factor: f64,
    /// The displayed unit with its prefix and typographic exponents; empty for pure numbers.
    pub unit: String,
}

impl Scale {
    /// The scale for SI numbers of this size: a prefix from 1e-12 to 1e12, if the first symbol of the unit is one of
    /// [`PREFIXED`]. With it the number is from 1 to below 1000 (1e6 for a square, as in m^2), unless a larger or
    /// smaller prefix would be needed. Units outside [`ALWAYS_PREFIXED`] have no prefix for sizes in [`PLAIN`]. The
    /// factor is 1 for zero, NaN and infinity.
    pub fn for_size(size: f64, unit: &str) -> Self {
        let size = size.abs();
        let plain = Self { factor: 1.0, unit: with_superscripts(unit) };
        let is_plain = !ALWAYS_PREFIXED.contains(&unit) && PLAIN.contains(&size);
        // Zero and NaN have no size; numbers near one need no prefix.
        if !(size.is_finite() && size > 0.0) || is_plain {
            return plain;
        }
        // The first symbol takes the prefix. In m^2 a prefix counts twice: mm^2 is 1e-6 m^2.
        let end = unit.find(|c: char| !c.is_ascii_alphabetic()).unwrap_or(unit.len());
        let (symbol, rest) = unit.split_at(end);
        let (symbol, grams) = if symbol == "kg" { ("g", 1e3) } else { (symbol, 1.0) };
        let power = rest.strip_prefix('^').and_then(|rest| rest.chars().next()?.to_digit(10));
        let power = power.unwrap_or(1).max(1) as i32;
        if !PREFIXED.contains(&symbol) {
            return plain;
        }
        // The small addend keeps exact powers of a thousand in their own prefix despite rounding.
        let steps = ((size * grams).log10() / f64::from(3 * power) + 1e-12).floor() as i32;
        let steps = steps.clamp(-NO_PREFIX, NO_PREFIX);
        let prefix = PREFIXES[(steps + NO_PREFIX) as usize];
        let factor = 1e3_f64.powi(steps * power) / grams;
        Self { factor, unit: with_superscripts(&format!("{prefix}{symbol}{rest}")) }
    }

    /// The scale for the largest absolute value of these SI numbers; those that are not finite are ignored.
    pub fn for_values(values: impl IntoIterator<Item = f64>, unit: &str) -> Self {
        let finite = values.into_iter().filter(|x| x.is_finite());
        Self::for_size(finite.fold(0.0, |largest, x| largest.max(x.abs())), unit)
    }

    /// An SI value as a number in this unit, without the unit, with decimals down to the second digit of its SI
    /// `error`. Without an error it has five significant digits, or more in front of the decimal point. Absolute
    /// numbers below 1e-6 or from 1e7 on have a power of ten. [`MISSING`] unless the value is finite.
    pub fn format(&self, value: f64, error: Option<f64>) -> String {
        let value = value / self.factor;
        let decimals = match error.map(|e| (e / self.factor).abs()) {
            Some(error) if error.is_finite() && error > 0.0 => 1.0 - error.log10().floor(),
            _ if value == 0.0 => 0.0,
            _ => DECIMALS_WITHOUT_ERROR - value.abs().log10().floor(),
        };
        if !value.is_finite() {
            return MISSING.into();
        }
        if value != 0.0 && !(1e-6..1e7).contains(&value.abs()) {
            // Decimals of the number become those of its mantissa.
            let decimals = decimals + value.abs().log10().floor();
            return scientific(value, decimals.clamp(1.0, 9.0) as usize);
        }
        let decimals = decimals.clamp(0.0, 9.0) as usize;
        with_minus_sign(format!("{value:.decimals$}"))
    }

    /// The number of [`format`](Self::format), followed by the unit, if there is one.
    pub fn format_with_unit(&self, value: f64, error: Option<f64>) -> String {
        format!("{} {}", self.format(value, error), self.unit).trim_end().into()
    }
}

/// An SI value in three significant digits with its unit, prefixed by the size; a dash and the unit unless it is
/// finite.
pub(super) fn quantity(value: f64, unit: &str) -> String {
    let scale = Scale::for_size(value, unit);
    format!("{} {}", three_digits(value / scale.factor), scale.unit).trim_end().to_string()
}

/// An SI value in three significant digits with its unit, and a plus sign before positive values.
pub(super) fn signed_quantity(value: f64, unit: &str) -> String {
    let sign = if value > 0.0 { "+" } else { "" };
    format!("{sign}{}", quantity(value, unit))
}

/// A fraction in per cent, in three significant digits.
pub(super) fn percent(fraction: f64) -> String {
    format!("{} %", three_digits(100.0 * fraction))
}

/// A fraction in per cent, in three significant digits and with a plus sign before positive values.
pub(super) fn signed_percent(fraction: f64) -> String {
    let sign = if fraction > 0.0 { "+" } else { "" };
    format!("{sign}{}", percent(fraction))
}

/// A number without a unit in three significant digits, with a power of ten outside [`PLAIN`]; `0` for zero,
/// [`MISSING`] unless finite.
pub(super) fn three_digits(value: f64) -> String {
    match value.abs() {
        size if !size.is_finite() => MISSING.into(),
        0.0 => "0".into(),
        size if PLAIN.contains(&size) => {
            // The power of ten after rounding: 0.9999 is 1.00.
            let rounded: f64 = format!("{size:.2e}").parse().unwrap_or(size);
            let decimals = (2.0 - rounded.log10().floor()).max(0.0) as usize;
            with_minus_sign(format!("{value:.decimals$}"))
        }
        _ => scientific(value, 2),
    }
}

/// A number as a mantissa with these decimals and a power of ten, such as `1.5×10⁻³`.
pub(super) fn scientific(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$e}");
    let (mantissa, power) = text.split_once('e').unwrap_or((&text, "0"));
    with_minus_sign(format!("{mantissa}\u{d7}10")) + &superscripts(power)
}

/// A number with the minus sign U+2212, as wide as a plus, in the place of hyphens.
pub(super) fn with_minus_sign(number: String) -> String {
    number.replace('-', "\u{2212}")
}

/// Digits and hyphens as superscripts; other characters are kept.
pub(super) fn superscripts(text: &str) -> String {
    let superscript = |c: char| match c {
        '-' => '\u{207b}',
        '1' => '\u{b9}',
        '2' => '\u{b2}',
        '3' => '\u{b3}',
        '0' | '4'..='9' => char::from_u32('\u{2070}' as u32 + c as u32 - '0' as u32).unwrap_or(c),
        c => c,
    };
    text.chars().map(superscript).collect()
}

/// A unit with the digits after each `^` as Unicode superscripts, and without `^`: `kg/m³` for `kg/m^3`. An exponent
/// with a sign loses its `^`, and is not converted.
fn with_superscripts(unit: &str) -> String {
    let mut parts = unit.split('^');
    let first = parts.next().unwrap_or_default().to_string();
    parts.fold(first, |unit, part| {
        let end = part.find(|c: char| !c.is_ascii_digit()).unwrap_or(part.len());
        unit + &superscripts(&part[..end]) + &part[end..]
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn digits_follow_the_error_and_prefixes_the_size() {
        // Two digits of the error; prefixes keep the number between 1 and 1000.
        let mega = Scale::for_size(9.9935e7, "Pa");
        assert_eq!((mega.factor, mega.unit.as_str()), (1e6, "MPa"));
        assert_eq!(mega.format(9.99352e7, Some(3.6e4)), "99.935");
        assert_eq!(mega.format(3.6e4, Some(3.6e4)), "0.036");
        assert_eq!(Scale::for_size(1.017e-3, "m").format(1.017e-3, None), "1.0170");
        assert_eq!(Scale::for_size(0.75, "").format(0.75, Some(2e-3)), "0.7500");
        assert_eq!(Scale::for_size(0.0, "m"), Scale { factor: 1.0, unit: "m".into() });
        assert_eq!(Scale::for_size(f64::NAN, "m").format(f64::NAN, None), "\u{2013}");
        assert_eq!(Scale::for_size(1e3, "Pa").unit, "kPa");
        assert_eq!(Scale::for_size(-2e-2, "rad").format(-2e-2, Some(1e-3)), "\u{2212}20.0");
        assert_eq!(
            (three_digits(0.0123), three_digits(1.0), three_digits(-4e-9)),
            ("0.0123".into(), "1.00".into(), "\u{2212}4.00\u{d7}10\u{207b}\u{2079}".into())
        );
    }

    /// No unit has a power of ten in front.
    #[test]
    fn small_quantities_have_prefixes_or_powers_but_never_both() {
        let cases = [
            (6.57e-4, "s", "657 \u{b5}s"),
            (5.6e-4, "kg", "560 mg"),
            (1.2, "kg", "1.20 kg"),
            (2.5e-7, "J", "250 nJ"),
            (4.9e-10, "m^4", "490 mm\u{2074}"),
            (7.9e-5, "m^2", "79.0 mm\u{b2}"),
            (1273.5, "kg/m^3", "1274 kg/m\u{b3}"),
            (3e-5, "kg/m", "30.0 mg/m"),
            (5.4e-2, "rad/(N m)", "0.0540 rad/(N m)"),
            (5.4e-5, "rad/(N m)", "54.0 \u{b5}rad/(N m)"),
            (3e-7, "1/s", "3.00\u{d7}10\u{207b}\u{2077} 1/s"),
            (3e-7, "", "3.00\u{d7}10\u{207b}\u{2077}"),
            (0.5, "s", "500 ms"),
        ];
        for (value, unit, text) in cases {
            assert_eq!(quantity(value, unit), text);
            let scale = Scale::for_size(value, unit);
            assert!(!scale.unit.contains("10"), "{unit}: {}", scale.unit);
        }
        assert_eq!(signed_quantity(2e-3, "m"), "+2.00 mm");
        assert_eq!(percent(0.0213), "2.13 %");
        assert_eq!((three_digits(0.99996), three_digits(9.9996)), ("1.00".into(), "10.0".into()));
    }
}
