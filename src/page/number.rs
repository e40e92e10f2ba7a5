//! Numbers as engineers write them: a prefix to the unit, and no more digits than the error has.

/// Prefixes by the power of a thousand.
const PREFIXES: [(i32, &str); 9] = [
    (-4, "p"),
    (-3, "n"),
    (-2, "\u{b5}"),
    (-1, "m"),
    (0, ""),
    (1, "k"),
    (2, "M"),
    (3, "G"),
    (4, "T"),
];
/// Units that take prefixes.
const PREFIXED: [&str; 6] = ["m", "s", "Pa", "Hz", "N", "rad"];

/// What numbers are divided by for show, and the unit they then have.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Scale {
    pub factor: f64,
    pub unit: String,
}

impl Scale {
    /// That suits numbers of this size.
    pub fn of(size: f64, unit: &str) -> Self {
        let size = size.abs();
        let unit = &unit.replace("^2", "\u{b2}").replace("^3", "\u{b3}")[..];
        if !(size.is_finite() && size > 0.0) {
            return Self { factor: 1.0, unit: unit.into() };
        }
        let thousands = (size.log10() / 3.0 + 1e-12).floor() as i32;
        if PREFIXED.contains(&unit) {
            let thousands = thousands.clamp(-4, 4);
            let prefix = PREFIXES.iter().find(|(n, _)| *n == thousands).map_or("", |(_, p)| p);
            return Self { factor: 1e3_f64.powi(thousands), unit: format!("{prefix}{unit}") };
        }
        if (1e-3..1e5).contains(&size) {
            return Self { factor: 1.0, unit: unit.into() };
        }
        let power = 3 * thousands;
        let times = format!("10{}", raised(power));
        let unit = if unit.is_empty() { times } else { format!("{times} {unit}") };
        Self { factor: 10_f64.powi(power), unit }
    }

    /// That suits the largest of these.
    pub fn fitting(values: impl IntoIterator<Item = f64>, unit: &str) -> Self {
        let finite = values.into_iter().filter(|x| x.is_finite());
        Self::of(finite.fold(0.0, |largest, x| largest.max(x.abs())), unit)
    }

    /// A number with this unit's digits down to the second of its `error`.
    pub fn show(&self, value: f64, error: Option<f64>) -> String {
        let value = value / self.factor;
        let decimals = match error.map(|e| (e / self.factor).abs()) {
            Some(error) if error.is_finite() && error > 0.0 => 1.0 - error.log10().floor(),
            _ if value == 0.0 => 0.0,
            _ => 4.0 - value.abs().log10().floor(),
        };
        if !value.is_finite() {
            return "\u{2013}".into();
        }
        if value.abs() >= 1e7 || value != 0.0 && value.abs() < 1e-6 {
            return format!("{value:.3e}");
        }
        let decimals = decimals.clamp(0.0, 9.0) as usize;
        signed(format!("{value:.decimals$}"))
    }
}

/// A number in three digits with its unit.
pub(super) fn quantity(value: f64, unit: &str) -> String {
    let scale = Scale::of(value, unit);
    format!("{} {}", short(value / scale.factor), scale.unit).trim_end().to_string()
}

/// A number without a unit in three digits.
pub(super) fn short(value: f64) -> String {
    match value.abs() {
        size if !size.is_finite() => "\u{2013}".into(),
        0.0 => "0".into(),
        size if (1e-3..1e5).contains(&size) => {
            let decimals = (2.0 - size.log10().floor()).max(0.0) as usize;
            signed(format!("{value:.decimals$}"))
        }
        _ => signed(format!("{value:.2e}")),
    }
}

/// With the sign that is as wide as a plus.
fn signed(number: String) -> String {
    number.replace('-', "\u{2212}")
}

/// As an exponent.
pub(super) fn raised(power: i32) -> String {
    power.to_string().chars().map(superscript).collect()
}

fn superscript(digit: char) -> char {
    match digit {
        '-' => '\u{207b}',
        '1' => '\u{b9}',
        '2' => '\u{b2}',
        '3' => '\u{b3}',
        '0' => '\u{2070}',
        digit => char::from_u32('\u{2070}' as u32 + digit as u32 - '0' as u32).unwrap_or(digit),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn digits_follow_the_error_and_prefixes_the_size() {
        let mega = Scale::of(9.9935e7, "Pa");
        assert_eq!((mega.factor, mega.unit.as_str()), (1e6, "MPa"));
        assert_eq!(mega.show(9.99352e7, Some(3.6e4)), "99.935");
        assert_eq!(mega.show(3.6e4, Some(3.6e4)), "0.036");
        assert_eq!(Scale::of(1.017e-3, "m").show(1.017e-3, None), "1.0170");
        assert_eq!(Scale::of(0.75, "").show(0.75, Some(2e-3)), "0.7500");
        assert_eq!(Scale::of(3e-7, "1/s").unit, "10\u{207b}\u{2079} 1/s");
        assert_eq!(Scale::of(0.0, "m"), Scale { factor: 1.0, unit: "m".into() });
        assert_eq!(Scale::of(f64::NAN, "m").show(f64::NAN, None), "\u{2013}");
        assert_eq!(Scale::of(1e3, "Pa").unit, "kPa");
        assert_eq!(Scale::of(-2e-2, "rad").show(-2e-2, Some(1e-3)), "\u{2212}20.0");
        assert_eq!(
            (short(0.0123), short(1.0), short(-4e-9)),
            ("0.0123".into(), "1.00".into(), "\u{2212}4.00e\u{2212}9".into())
        );
    }
}
