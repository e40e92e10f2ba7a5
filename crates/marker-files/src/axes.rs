//! Map from the axes of a file to those of the world: a permutation with signs, as `["x", "z", "-y"]`.
//!
//! Input are three names, one per world axis; a minus reverses the direction, and `none` is a coordinate that was not
//! observed. [`Axes::new`] rejects other names, no axis at all, an axis given twice, and three axes that form a
//! left-handed map; the error is a message. [`Axes::check`] rejects axes that the file does not have. Output: positions
//! in world axes with signs ([`Axes::to_world`], inverse [`Axes::to_file`]), and standard deviations without
//! ([`Axes::select`]). Both are `None` along axes that were not observed, and where the file has no value.

use serde::{Deserialize, Serialize};

/// Axes of the file that are the world's x, y and z: `["x", "z", "-y"]`; `"none"` for a coordinate
/// that was not observed.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(try_from = "Vec<String>", into = "Vec<String>")]
pub struct Axes([Option<(usize, f64)>; 3]);

/// Name in place of an axis that was not observed.
const NONE: &str = "none";

impl Axes {
    /// The map from the names of the file's axes along the world's x, y and z. A minus reverses an axis, and `none` is
    /// a coordinate that was not observed.
    ///
    /// # Errors
    /// Other names, no axis, an axis twice, and left-handed axes, as a message.
    pub fn new(names: [&str; 3]) -> Result<Self, String> {
        let mut axes = [None; 3];
        for (to, name) in axes.iter_mut().zip(names) {
            let (sign, letter) = name.strip_prefix('-').map_or((1.0, name), |rest| (-1.0, rest));
            *to = match (letter, ["x", "y", "z"].iter().position(|axis| *axis == letter)) {
                (_, Some(axis)) => Some((axis, sign)),
                (NONE, None) if sign > 0.0 => None,
                _ => {
                    return Err(format!(
                        "found the axis {name:?}, allowed: x, y, z, -x, -y, -z or \
                                        none"
                    ));
                }
            };
        }
        let named: Vec<(usize, f64)> = axes.iter().copied().flatten().collect();
        if (0..3).any(|axis| named.iter().filter(|(own, _)| *own == axis).count() > 1) {
            return Err(format!("found axes = {names:?}, allowed: each axis of the file once"));
        }
        // Two axes and a missing one can always be completed to a right-handed frame, so that only three are checked.
        if let [(a, s), (b, t), (c, u)] = named[..] {
            // The handedness is the sign of the permutation times the product of the three signs.
            let even = (b + 3 - a) % 3 == 1 && (c + 3 - b) % 3 == 1;
            if s * t * u * if even { 1.0 } else { -1.0 } < 0.0 {
                return Err(format!(
                    "found axes = {names:?}, a mirror image, allowed: right-handed axes, such as \
                     [\"x\", \"z\", \"-y\"]"
                ));
            }
        }
        match named.is_empty() {
            true => Err(format!("found axes = {names:?}, allowed: at least one axis")),
            false => Ok(Self(axes)),
        }
    }

    /// Converts a position from the axes of the file to those of the world, with signs. A coordinate is `None` along an
    /// axis that was not observed, and where `position` is.
    pub fn to_world(self, position: [Option<f64>; 3]) -> [Option<f64>; 3] {
        self.0.map(|axis| axis.and_then(|(c, sign)| Some(sign * position[c]?)))
    }

    /// Converts a position in the axes of the world to those of the file: the inverse of [`to_world`](Self::to_world).
    /// A coordinate is `None` along an axis of the file that is none of the world's, and where `position` is.
    pub fn to_file(self, position: [Option<f64>; 3]) -> [Option<f64>; 3] {
        let mut file = [None; 3];
        for (axis, x) in self.0.iter().zip(position) {
            if let Some((c, sign)) = axis {
                file[*c] = x.map(|x| sign * x);
            }
        }
        file
    }

    /// Reorders a property per axis of the file, such as a standard deviation, to the axes of the world, without signs.
    /// It is `None` for an axis that was not observed, and where `of` is.
    pub fn select<T: Copy>(self, of: [Option<T>; 3]) -> [Option<T>; 3] {
        self.0.map(|axis| axis.and_then(|(c, _)| of[c]))
    }

    /// Rejects axes that the file does not have. `has` is whether the file has x, y and z. The error is the message.
    pub fn check(self, has: [bool; 3]) -> Result<(), String> {
        match self.0.iter().flatten().find(|(axis, _)| !has[*axis]) {
            Some((axis, _)) => {
                let name = ["x", "y", "z"][*axis];
                Err(format!(
                    "found {name} in axes, which the file does not contain, allowed: axes of the \
                     file, or \"none\""
                ))
            }
            None => Ok(()),
        }
    }
}

impl TryFrom<Vec<String>> for Axes {
    type Error = String;

    /// The map from three names, as [`Axes::new`]; an error for another number of names.
    fn try_from(names: Vec<String>) -> Result<Self, String> {
        match &names[..] {
            [x, y, z] => Self::new([x, y, z]),
            _ => Err(format!("found {} axes, allowed: three", names.len())),
        }
    }
}

impl From<Axes> for Vec<String> {
    /// The three names, as `["x", "z", "-y"]`, with `none` for an axis that was not observed.
    fn from(axes: Axes) -> Self {
        let name = |axis: Option<(usize, f64)>| match axis {
            Some((axis, sign)) => {
                format!("{}{}", if sign < 0.0 { "-" } else { "" }, ["x", "y", "z"][axis])
            }
            None => NONE.into(),
        };
        axes.0.map(name).to_vec()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axes_of_the_file_are_the_inverse_of_those_of_the_world() {
        let file = [Some(1.0), Some(2.0), Some(3.0)];
        for names in [["x", "z", "-y"], ["-y", "x", "z"], ["z", "x", "y"]] {
            let axes = Axes::new(names).unwrap();
            assert_eq!(axes.to_file(axes.to_world(file)), file, "{names:?}");
        }
        let upright = Axes::new(["x", "none", "y"]).unwrap();
        assert_eq!(upright.to_file([Some(5.0), None, Some(7.0)]), [Some(5.0), Some(7.0), None]);
    }
}
