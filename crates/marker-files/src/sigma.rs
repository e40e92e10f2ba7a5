//! The key `sigma` of a recording: names of the columns with the standard deviations of the positions of a table.
//!
//! They are one column for all axes, or one for each axis of the file; names are compared ignoring case.
//! [`SigmaColumns::find`] takes a table, the axes that it has, and the names of columns with other contents. It returns
//! the index of the column of each axis that the table has, `None` for others. [`SigmaColumns::all`] returns all stated
//! names in lower case, that of all axes three times. An axis without a stated column, and a column that is missing or
//! has other contents, are errors.

use crate::error::Error;
use crate::table::Table;
use serde::{Deserialize, Serialize};

/// Columns with the standard deviations of the positions, row by row, in the unit of their headers
/// or of the positions.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(
    untagged,
    expecting = "expected the name of a column, or { x = \"..\", y = \"..\" } of those of the axes"
)]
pub enum SigmaColumns {
    /// Name of one column for all axes.
    All(String),
    /// Name of one column for each axis of the file.
    Each(AxisColumnNames),
}

/// Names of the columns with standard deviations, by axis of the file.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, default)]
pub struct AxisColumnNames {
    /// Column of x.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub x: Option<String>,
    /// Column of y.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub y: Option<String>,
    /// Column of z.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub z: Option<String>,
}

impl SigmaColumns {
    /// The name of the column of x, y and z, as stated; `None` where no column is stated.
    fn names(&self) -> [Option<&str>; 3] {
        match self {
            Self::All(name) => [Some(name); 3],
            Self::Each(AxisColumnNames { x, y, z }) => [x, y, z].map(|name| name.as_deref()),
        }
    }

    /// Names of all stated columns, in lower case as in tables; three times the same one if it is for all axes.
    pub fn all(&self) -> Vec<String> {
        self.names().into_iter().flatten().map(str::to_lowercase).collect()
    }

    /// Index, from 0, of the column of each axis of the file that is present (`there`), `None` for others; `others` are
    /// names of columns with other contents. An error for a present axis without a stated column, and for a column that
    /// the table does not have or that is in `others`.
    pub fn find(
        &self,
        table: &Table,
        there: [bool; 3],
        others: &[&str],
    ) -> Result<[Option<usize>; 3], Error> {
        let mut found = [None; 3];
        for (c, name) in self.names().into_iter().enumerate().filter(|(c, _)| there[*c]) {
            let axis = ["x", "y", "z"][c];
            // Every observed coordinate needs a standard deviation: a default would be a hidden assumption.
            let Some(name) = name.map(str::to_lowercase) else {
                let message = format!(
                    "found no column for {axis} in sigma, allowed: one column for each axis of \
                     the file"
                );
                return Err(table.error(1, &message));
            };
            if others.contains(&name.as_str()) {
                let message = format!(
                    "found sigma = `{name}`, a column with other contents, allowed: a \
                             separate column"
                );
                return Err(table.error(1, &message));
            }
            let column = table.find(&name).ok_or_else(|| {
                let found = table.columns_found();
                let message = format!(
                    "found no column `{name}` for sigma, allowed: a number, or one of the columns \
                     {found}"
                );
                table.error(1, &message)
            });
            found[c] = Some(column?);
        }
        Ok(found)
    }
}
