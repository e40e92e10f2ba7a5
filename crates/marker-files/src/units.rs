//! Units in the names of columns: in brackets, as `x[mm]` or `x (mm)`, or of times and lengths at the end, as `x_mm`.
//!
//! [`TIMES`], [`LENGTHS`] and the lists of sensors ([`FORCES`], [`MOMENTS`], [`ACCELERATIONS`], [`ANGLES`],
//! [`CURVATURES`], [`STRAINS`]) are the known units with their sizes in SI units. [`is_unit`] returns whether a text is
//! one of them, [`is_same_unit`] whether two texts are spellings of one unit. [`split_unit`] splits a name from any
//! unit in brackets, [`suffix_unit`] from a known unit behind `_`; both return names and symbols as text, without
//! errors. [`plain_unit`] writes a micro sign as `u`.

use std::f64::consts::PI;

/// Units of time with their sizes in s.
pub const TIMES: [(&str, f64); 4] = [("s", 1.0), ("ms", 1e-3), ("us", 1e-6), ("ns", 1e-9)];
/// Units of length with their sizes in m.
pub const LENGTHS: [(&str, f64); 4] = [("m", 1.0), ("cm", 1e-2), ("mm", 1e-3), ("um", 1e-6)];

/// Units of force with their sizes in N.
pub const FORCES: [(&str, f64); 3] = [("N", 1.0), ("mN", 1e-3), ("kN", 1e3)];
/// Units of moment with their sizes in N m.
pub const MOMENTS: [(&str, f64); 8] = [
    ("N m", 1.0),
    ("Nm", 1.0),
    ("N*m", 1.0),
    ("mN m", 1e-3),
    ("mNm", 1e-3),
    ("N mm", 1e-3),
    ("Nmm", 1e-3),
    ("N*mm", 1e-3),
];

/// Standard acceleration of gravity, m/s^2, the unit g.
pub const STANDARD_GRAVITY: f64 = 9.80665;
/// Units of acceleration with their sizes in m/s^2. The standard acceleration of gravity is exact (CGPM 1901).
pub const ACCELERATIONS: [(&str, f64); 6] = [
    ("m/s^2", 1.0),
    ("m/s2", 1.0),
    ("m/s²", 1.0),
    ("cm/s^2", 1e-2),
    ("mm/s^2", 1e-3),
    ("g", STANDARD_GRAVITY),
];
/// Units of angles with their sizes in rad.
pub const ANGLES: [(&str, f64); 4] =
    [("rad", 1.0), ("mrad", 1e-3), ("deg", PI / 180.0), ("°", PI / 180.0)];

/// Units of curvature with their sizes in 1/m.
pub const CURVATURES: [(&str, f64); 5] =
    [("1/m", 1.0), ("rad/m", 1.0), ("m^-1", 1.0), ("1/mm", 1e3), ("deg/m", PI / 180.0)];
/// Units of strain with their sizes: parts of the length.
pub const STRAINS: [(&str, f64); 9] = [
    ("1", 1.0),
    ("m/m", 1.0),
    ("%", 1e-2),
    ("mm/m", 1e-3),
    ("um/m", 1e-6),
    ("u\u{3b5}", 1e-6),
    ("ustrain", 1e-6),
    ("microstrain", 1e-6),
    ("nm/m", 1e-9),
];

/// Whether a text is the symbol of a unit in one of the lists of this file, or `px`. The strain `1` is none, as a line
/// of units may have a number there.
pub(crate) fn is_unit(symbol: &str) -> bool {
    let lengths_and_times = TIMES.iter().chain(&LENGTHS);
    let of_sensors = FORCES.iter().chain(&MOMENTS).chain(&ACCELERATIONS).chain(&ANGLES);
    // A strain of 1 is a number, not a unit in a line of units.
    let of_sensors = of_sensors.chain(&CURVATURES).chain(STRAINS.iter().filter(|own| own.0 != "1"));
    symbol == "px" || lengths_and_times.chain(of_sensors).any(|(own, _)| *own == symbol)
}

/// Whether two symbols are one unit: equal texts, or two units of one sensor quantity with equal sizes, as `N m` and
/// `Nm`.
pub(crate) fn is_same_unit(a: &str, b: &str) -> bool {
    let are_in = |units: &[(&str, f64)]| {
        let size = |symbol| units.iter().find(|(own, _)| *own == symbol).map(|(_, size)| *size);
        size(a).is_some() && size(a) == size(b)
    };
    let of_supports = are_in(&FORCES) || are_in(&MOMENTS);
    let of_points = are_in(&ACCELERATIONS) || are_in(&ANGLES) || are_in(&CURVATURES);
    a == b || of_supports || of_points || are_in(&STRAINS)
}

/// Name and unit of a column: `X` and `mm` of `X [mm]` or `X (mm)`, `X (tip)` and `mm` of `X (tip) (mm)`. Without
/// brackets at the end it is the whole header, without a unit. Any text in the last brackets is a unit.
pub fn split_unit(header: &str) -> (String, Option<String>) {
    let brackets = |open: char, close: char| header.strip_suffix(close)?.rsplit_once(open);
    // Brackets within a name belong to it; only those at the end have a unit.
    match brackets('[', ']').or_else(|| brackets('(', ')')) {
        Some((name, unit)) => (name.trim().into(), Some(plain_unit(unit))),
        None => (header.into(), None),
    }
}

/// The symbol of a unit without spaces around it, with `u` for a micro sign at its beginning.
pub(crate) fn plain_unit(unit: &str) -> String {
    let unit = unit.trim();
    match unit.strip_prefix(['\u{b5}', '\u{3bc}']) {
        Some(rest) => format!("u{rest}"),
        None => unit.into(),
    }
}

/// Name and unit of a column whose name ends with `_` and a unit, as `x_mm`, ignoring the case of the unit: a unit of
/// time if `is_time`, else of length or `px`. `None` without such a unit or with no name before it.
pub(crate) fn suffix_unit(name: &str, is_time: bool) -> Option<(&str, &'static str)> {
    let (own, ending) = name.rsplit_once('_')?;
    let ending = plain_unit(&ending.to_lowercase());
    let symbols: Vec<&'static str> = match is_time {
        true => TIMES.iter().map(|(symbol, _)| *symbol).collect(),
        false => LENGTHS.iter().map(|(symbol, _)| *symbol).chain(["px"]).collect(),
    };
    let unit = symbols.into_iter().find(|symbol| *symbol == ending)?;
    (!own.is_empty()).then_some((own, unit))
}

#[cfg(test)]
mod tests {
    use super::split_unit;

    #[test]
    fn unit_is_in_the_last_brackets() {
        for (header, name, unit) in [
            ("x [mm]", "x", Some("mm")),
            ("x (tip) (mm)", "x (tip)", Some("mm")),
            ("x [tip] [mm]", "x [tip]", Some("mm")),
            ("x (tip) y", "x (tip) y", None),
        ] {
            assert_eq!(split_unit(header), (name.into(), unit.map(Into::into)), "{header}");
        }
    }
}
