//! Numbers with units as text on the terminal, such as 1.014 mm, 0.08 % and 3.2 min.
//!
//! Input is an SI value with a number of significant digits. Values in m, s, N, J and kg (as g below 1 kg) get the
//! largest prefix (none, m, u, n, p) of which they are at least a tenth. Numbers outside `FIXED_POINT` have an
//! exponent. [`duration`] is in s, min or h with two digits, [`p_value`] an upper bound below `SMALLEST_P`. Only ASCII
//! is used. Summaries and warnings of all reports are written with [`number`], [`quantity`], [`p_value`], [`counted`]
//! and [`duration`].

/// Prefixes with their factors, the largest first.
const PREFIXES: [(&str, f64); 5] = [("", 1.0), ("m", 1e-3), ("u", 1e-6), ("n", 1e-9), ("p", 1e-12)];
/// Units that get prefixes for small values. Masses are displayed in g below 1 kg.
const PREFIXED: [&str; 5] = ["m", "s", "N", "J", "g"];
/// Absolute values that are displayed without an exponent.
const FIXED_POINT: std::ops::Range<f64> = 1e-3..1e4;
/// A value gets a prefix if it is at least this fraction of the prefixed unit: 0.14 mm instead of 140 um.
const PREFIX_FROM: f64 = 0.1;
/// Durations shorter than this many seconds are in s, others shorter than this many minutes in min.
const MAX_COUNT: f64 = 100.0;
/// Number of seconds in a minute, and of minutes in an hour.
const SECONDS_PER_MINUTE: f64 = 60.0;
/// p-values below this are displayed as this upper bound.
const SMALLEST_P: f64 = 1e-99;

/// A number rounded to `digits` significant digits (at least one). Its absolute value is written without an exponent
/// from 1e-3 to below 1e4 ([`FIXED_POINT`]), else as `1.5e-5`. Zero is `0`.
pub(crate) fn number(value: f64, digits: usize) -> String {
    let digits = digits.max(1);
    match value.abs() {
        0.0 => "0".into(),
        size if FIXED_POINT.contains(&size) => {
            let integer_digits = size.log10().floor() as i32 + 1;
            let decimals = usize::try_from(digits as i32 - integer_digits).unwrap_or(0);
            // Rounded to the digits, also those before the point.
            let rounded: f64 = format!("{value:.*e}", digits - 1).parse().unwrap_or(value);
            format!("{rounded:.decimals$}")
        }
        _ => format!("{value:.*e}", digits - 1),
    }
}

/// An SI value with `digits` significant digits and its unit. Units of [`PREFIXED`] have the largest prefix (mm, us,
/// down to p) of which the value is at least a tenth; smaller values have none. Masses in kg are shown in g, with
/// prefixes, below 1 kg. Without a unit it is the number alone.
pub(crate) fn quantity(value: f64, unit: &str, digits: usize) -> String {
    let (value, unit) = if unit == "kg" { (value * 1e3, "g") } else { (value, unit) };
    let size = value.abs();
    let found = PREFIXES.iter().find(|(_, factor)| size >= PREFIX_FROM * factor);
    let (prefix, factor) = match found {
        Some(found) if PREFIXED.contains(&unit) => *found,
        _ => ("", 1.0),
    };
    // Masses are counted in g; from 1000 g on in kg.
    match (unit, size >= 1e3) {
        ("g", true) => format!("{} kg", number(value / 1e3, digits)),
        _ => format!("{} {prefix}{unit}", number(value / factor, digits)).trim_end().into(),
    }
}

/// The p-value of a test: `p = 0.034` with three decimals from 0.01 on, else with one digit and an exponent. Below
/// [`SMALLEST_P`], where rounding errors dominate, it is `p <` this bound.
pub(crate) fn p_value(p: f64) -> String {
    match p < SMALLEST_P {
        true => format!("p < {SMALLEST_P:e}"),
        // Values near the usual limits need their second digit.
        false if p >= 0.01 => format!("p = {p:.3}"),
        false => format!("p = {p:.0e}"),
    }
}

/// A relative error as text, in per cent with its sign and two significant digits: `-9.1 %`.
pub(crate) fn signed_percent(error: f64) -> String {
    let sign = if error < 0.0 { "-" } else { "+" };
    format!("{sign}{} %", number(100.0 * error.abs(), 2))
}

/// A count with its noun, which gets the plural s unless the count is 1: `3 edges`.
pub(crate) fn counted(n: usize, noun: &str) -> String {
    format!("{n} {noun}{}", if n == 1 { "" } else { "s" })
}

/// A duration, given in s, with two significant digits: in s below 100 s, in min below 100 min, else in h.
pub fn duration(seconds: f64) -> String {
    let minutes = seconds / SECONDS_PER_MINUTE;
    match (seconds < MAX_COUNT, minutes < MAX_COUNT) {
        (true, _) => format!("{} s", number(seconds, 2)),
        (_, true) => format!("{} min", number(minutes, 2)),
        _ => format!("{} h", number(minutes / SECONDS_PER_MINUTE, 2)),
    }
}

#[cfg(test)]
mod tests {
    use crate::summary::quantity::{counted, duration, number, p_value, quantity};

    #[test]
    fn p_value_below_rounding_errors_is_a_bound() {
        // Zero is below any double.
        assert_eq!([p_value(0.0), p_value(3.2e-7)], ["p < 1e-99", "p = 3e-7"]);
        assert_eq!([p_value(0.047), p_value(0.0047)], ["p = 0.047", "p = 5e-3"]);
    }

    #[test]
    fn small_values_have_prefixes() {
        // Plain units have prefixes, compound ones stay.
        assert_eq!(quantity(1.014e-3, "m", 4), "1.014 mm");
        assert_eq!(quantity(-5.6e-4, "kg", 2), "-0.56 g");
        assert_eq!(quantity(2.5, "kg", 2), "2.5 kg");
        assert_eq!(quantity(0.43, "rad/(N m)", 2), "0.43 rad/(N m)");
        assert_eq!(quantity(140.0, "kg/m^3", 2), "140 kg/m^3");
        assert_eq!(quantity(1.4e-4, "m", 2), "0.14 mm");
        assert_eq!(quantity(5e-5, "m", 2), "50 um");
        assert_eq!(quantity(0.0, "m", 3), "0 m");
        assert_eq!(quantity(0.5, "", 2), "0.50");
    }

    #[test]
    fn numbers_have_the_digits_that_are_given() {
        // Exponents from 1e4 on and below 1e-3.
        assert_eq!([number(1234.5, 2), number(0.01, 2)], ["1200", "0.010"]);
        assert_eq!([number(1e4, 3), number(9.4e-4, 2)], ["1.00e4", "9.4e-4"]);
        assert_eq!([number(f64::NAN, 2), number(f64::INFINITY, 2)], ["NaN", "inf"]);
    }

    #[test]
    fn count_of_one_has_singular() {
        assert_eq!([counted(1, "state"), counted(2, "state")], ["1 state", "2 states"]);
    }

    #[test]
    fn durations_are_in_seconds_minutes_or_hours() {
        // Minutes from 100 s on, hours from 100 min on.
        assert_eq!([duration(0.03), duration(45.0)], ["0.030 s", "45 s"]);
        assert_eq!([duration(190.0), duration(5400.0)], ["3.2 min", "90 min"]);
        assert_eq!(duration(36000.0), "10 h");
    }
}
