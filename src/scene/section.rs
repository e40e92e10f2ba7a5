//! Cross-sections.

use super::{direction, positive};
use crate::error::Error;
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;

/// The cross-section of the rod.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum Section {
    /// A full circle.
    Circle {
        /// m.
        radius: f64,
    },
    /// A rectangle, `height` along `up`.
    Rectangle {
        /// Across `up`, m.
        width: f64,
        /// Along `up`, m.
        height: f64,
        /// A direction; its part across the first edge counts.
        up: [f64; 3],
    },
    /// Any section, by its constants.
    Custom {
        /// m^2.
        area: f64,
        /// Second moment that resists bending in the plane of `up`, m^4.
        i1: f64,
        /// Second moment that resists bending across `up`, m^4.
        i2: f64,
        /// Torsion constant, m^4.
        j: f64,
        /// A direction; its part across the first edge counts.
        up: [f64; 3],
    },
}

impl Section {
    pub(crate) fn check(&self) -> Result<(), Error> {
        let key = |name: &str| format!("rod.section.{name}");
        match self {
            Self::Circle { radius } => positive(&key("radius"), *radius),
            Self::Rectangle { width, height, up } => {
                positive(&key("width"), *width)?;
                positive(&key("height"), *height)?;
                direction(&key("up"), up)
            }
            Self::Custom { area, i1, i2, j, up } => {
                for (name, value) in [("area", area), ("i1", i1), ("i2", i2), ("j", j)] {
                    positive(&key(name), *value)?;
                }
                direction(&key("up"), up)
            }
        }
    }

    /// The direction the section is oriented by; none for a circle.
    pub fn up(&self) -> Option<[f64; 3]> {
        match self {
            Self::Circle { .. } => None,
            Self::Rectangle { up, .. } | Self::Custom { up, .. } => Some(*up),
        }
    }

    /// Area, m^2.
    pub fn area(&self) -> f64 {
        match self {
            Self::Circle { radius } => PI * radius * radius,
            Self::Rectangle { width, height, .. } => width * height,
            Self::Custom { area, .. } => *area,
        }
    }

    /// Second moments of area, m^4, against bending in the plane of `up` and across it.
    pub fn second_moments(&self) -> [f64; 2] {
        match self {
            Self::Circle { radius } => [PI * radius.powi(4) / 4.0; 2],
            Self::Rectangle { width, height, .. } => {
                [width * height.powi(3) / 12.0, height * width.powi(3) / 12.0]
            }
            Self::Custom { i1, i2, .. } => [*i1, *i2],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn second_moments_of_a_rectangle_follow_up() {
        let section = Section::Rectangle { width: 0.01, height: 0.002, up: [0.0, 1.0, 0.0] };
        let [in_plane, across] = section.second_moments();
        assert_relative_eq!(in_plane, 0.01 * 0.002_f64.powi(3) / 12.0);
        assert_relative_eq!(across / in_plane, 25.0, max_relative = 1e-14);
    }
}
