//! Units of times and lengths in the names of columns: in brackets, as `x[mm]` or `x (mm)`, or at the end, as `x_mm`.
//!
//! [`TIMES`] and [`LENGTHS`] are the known units with their sizes in s and m. [`split_unit`] splits a name from any
//! unit in brackets, [`suffix_unit`] from a known unit behind `_`; both return names and symbols as text, without
//! errors. [`plain_unit`] writes a micro sign as `u`.

/// Units of time with their sizes in s.
pub const TIMES: [(&str, f64); 4] = [("s", 1.0), ("ms", 1e-3), ("us", 1e-6), ("ns", 1e-9)];
/// Units of length with their sizes in m.
pub const LENGTHS: [(&str, f64); 4] = [("m", 1.0), ("cm", 1e-2), ("mm", 1e-3), ("um", 1e-6)];

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
