//! Columns of accelerations in a table: their names in logs of accelerometers, and the spellings of their units.
//!
//! Input: a [`Table`] whose header may be that of a plain table (`ax`, `acc_x`, `accx`) or of a log of phyphox and
//! other programs (`Acceleration x (m/s^2)`, `Linear Acceleration x (m/s^2)`, `accel_x`, `acceleration_x`); case is
//! ignored. Output ([`AccelerationColumns`]): the columns of x, y and z with their factors to m/s^2, and whether the
//! program has subtracted gravity (`linear`). Units are m/s^2, cm/s^2, mm/s^2 and g, also spelled `m/s2`, `m/s²`, `m
//! s^-2`, `m/s/s`. The size of the acceleration (`Absolute acceleration`) is no component. Errors: two columns of one
//! component, and unknown units.

use crate::error::Error;
use crate::table::Table;
use crate::units::ACCELERATIONS;

/// Names of a component in front of its axis, in lower case, of an accelerometer.
const NAMES: [&str; 9] = [
    "a",
    "acc",
    "acc_",
    "acc ",
    "accel_",
    "accel ",
    "acceleration ",
    "acceleration_",
    "acceleration-",
];
/// First words of names from which the program has subtracted gravity, as phyphox writes them.
const LINEAR: [&str; 5] = ["linear ", "linear_", "lin ", "lin_", "lin"];

/// Columns of accelerations in a table.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AccelerationColumns {
    /// Column, counted from 0, and factor to m/s^2 of x, y and z; `None` for a component that the table does not have.
    pub axes: [Option<(usize, f64)>; 3],
    /// Whether the names are those of accelerations without gravity.
    pub is_linear: bool,
}

impl AccelerationColumns {
    /// Finds the accelerations of a table; `None` without any. If the table has accelerations with and without gravity,
    /// those with gravity are taken.
    ///
    /// # Errors
    ///
    /// Two columns of one component, and a unit that is not one of acceleration.
    pub fn find(table: &Table) -> Result<Option<Self>, Error> {
        let mut found = [Self::default(), Self { is_linear: true, ..Self::default() }];
        for (column, (name, _)) in table.columns.iter().enumerate() {
            let Some((axis, is_linear)) = component(name) else { continue };
            let slot = &mut found[usize::from(is_linear)].axes[axis];
            if let Some((before, _)) = slot {
                let before = &table.columns[*before].0;
                let message =
                    format!("found the columns `{before}` and `{name}`, allowed: one of the two");
                return Err(table.error(1, &message));
            }
            *slot = Some((column, factor(table, column)?));
        }
        Ok(found.into_iter().find(|own| own.axes.iter().any(Option::is_some)))
    }

    /// Whether a column in lower case has the size of the acceleration, which logs have beside its components.
    pub fn is_size(name: &str) -> bool {
        name.starts_with("absolute acceleration")
    }
}

/// Axis (0 to 2) of the component with a name in lower case, and whether gravity was subtracted; `None` for other
/// names.
fn component(name: &str) -> Option<(usize, bool)> {
    let linear = LINEAR.iter().find_map(|word| name.strip_prefix(word));
    let own = linear.unwrap_or(name);
    let axis = ["x", "y", "z"].iter().position(|axis| own.ends_with(axis))?;
    NAMES.contains(&&own[..own.len() - 1]).then_some((axis, linear.is_some()))
}

/// Factor to m/s^2 from the unit in the header of a column, counted from 0; 1 without a unit. An error for a unit that
/// is not one of acceleration.
fn factor(table: &Table, column: usize) -> Result<f64, Error> {
    let (name, unit) = &table.columns[column];
    let Some(unit) = unit else { return Ok(1.0) };
    let spelled = unit.replace('\u{b2}', "^2").replace("s^-2", "/s^2").replace("/s/s", "/s^2");
    let spelled: String = spelled.chars().filter(|c| !"*\u{b7} ".contains(*c)).collect();
    let spelled = match spelled.strip_suffix("/s2") {
        Some(length) => format!("{length}/s^2"),
        None => spelled.replace("//", "/"),
    };
    let found = ACCELERATIONS.iter().find(|(symbol, _)| *symbol == spelled);
    found.map(|(_, factor)| *factor).ok_or_else(|| {
        let allowed = ACCELERATIONS.map(|(symbol, _)| symbol).join(", ");
        table.error(1, &format!("unit [{unit}] of `{name}`, allowed: {allowed}"))
    })
}

#[cfg(test)]
mod tests {
    use super::component;

    #[test]
    fn names_of_logs_are_components() {
        for (name, expected) in [
            ("ax", Some((0, false))),
            ("acc_y", Some((1, false))),
            ("acceleration z", Some((2, false))),
            ("linear acceleration x", Some((0, true))),
            ("lin_acc_x", Some((0, true))),
            ("lin ay", Some((1, true))),
            ("linaccz", Some((2, true))),
            ("absolute acceleration", None),
            ("x", None),
            ("", None),
            ("vmaxx", None),
            ("\u{b2}x", None),
        ] {
            assert_eq!(component(name), expected, "{name}");
        }
    }
}
