//! Sections and materials that change along the rod.

use crate::error::Error;
use crate::numerics::scalar::Scalar;
use crate::scene::along::Along;
use crate::scene::material::Material;
use crate::scene::number::{Numbers, Quantity, Written};
use crate::scene::section::Section;
use serde::{Deserialize, Serialize};

/// Declares the factors: one for each number of a section and a material that may change along the rod.
macro_rules! factors {
    ($($(#[$doc:meta])* $key:ident;)*) => {
        /// `[rod.taper]`: factors along the rod on section and material; default 1. Each is a list
        /// with one factor for each of equally many equal parts of the length, or a linear function
        /// `{ from = 1.0, to = 0.5 }`.
        #[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
        #[cfg_attr(test, derive(schemars::JsonSchema))]
        #[cfg_attr(test, schemars(bound = "D: Written + schemars::JsonSchema"))]
        #[serde(deny_unknown_fields, bound = "D: Written")]
        pub struct Taper<D = f64> {
            $($(#[$doc])*
            #[serde(default = "none::<D>", skip_serializing_if = "Option::is_none")]
            pub $key: Option<Along<D>>,)*
        }

        impl<D> Default for Taper<D> {
            fn default() -> Self {
                Self { $($key: None,)* }
            }
        }

        impl Taper {
            /// The same factor on every number.
            pub(super) fn all(factor: Along) -> Self {
                Self { $($key: Some(factor.clone()),)* }
            }
        }

        impl<D> Taper<D> {
            /// The factors that there are, with their keys.
            fn each(&self) -> impl Iterator<Item = (&'static str, &Along<D>)> {
                let all = [$((stringify!($key), self.$key.as_ref()),)*];
                all.into_iter().filter_map(|(key, factor)| Some((key, factor?)))
            }
        }

        impl Taper {
            pub(super) fn over<D>(&self, n: &mut Numbers<'_, D>) -> Taper<D> {
                let factor = [Quantity::positive("").within(1e-6, 1e6); 2];
                let mut over = |key: &str, along: &Option<Along>| {
                    along.as_ref().map(|along| along.over(key, factor, n))
                };
                Taper { $($key: over(stringify!($key), &self.$key),)* }
            }
        }
    };
}

factors! {
    /// Factor on the radius of a circle or a tube.
    radius;
    /// Factor on the wall thickness of a tube.
    thickness;
    /// Factor on the width of a rectangle.
    width;
    /// Factor on the height of a rectangle.
    height;
    /// Factor on the area of a custom section.
    area;
    /// Factor on the second moment `i1` of a custom section.
    i1;
    /// Factor on the second moment `i2` of a custom section.
    i2;
    /// Factor on the torsion constant of a custom section.
    j;
    /// Factor on the density.
    density;
    /// Factor on Young's modulus, and on the shear modulus that follows from Poisson's ratio.
    youngs_modulus;
    /// Factor on the shear modulus, if the material gives one.
    shear_modulus;
}

fn none<D>() -> Option<Along<D>> {
    None
}

impl<D> Taper<D> {
    /// Whether the rod is the same all along.
    pub fn is_none(&self) -> bool {
        self.each().next().is_none()
    }

    /// Where factors jump, ascending, and the ends: parts of the rod's length.
    pub(crate) fn breaks(&self) -> Vec<f64> {
        let mut breaks = vec![0.0, 1.0];
        breaks.extend(self.each().flat_map(|(_, factor)| factor.breaks()));
        breaks.sort_by(f64::total_cmp);
        breaks.dedup_by(|a, b| (*a - *b).abs() < 1e-12);
        breaks
    }
}

impl<D: Scalar> Taper<D> {
    /// Section and material at a place, given as a part of the rod's length.
    pub(crate) fn at(
        &self,
        place: f64,
        section: &Section<D>,
        material: &Material<D>,
    ) -> (Section<D>, Material<D>) {
        let times = |value: D, factor: &Option<Along<D>>| {
            factor.as_ref().map_or(value, |factor| value * factor.at(place))
        };
        let section = match *section {
            Section::Circle { radius } => Section::Circle { radius: times(radius, &self.radius) },
            Section::Tube { radius, thickness } => Section::Tube {
                radius: times(radius, &self.radius),
                thickness: times(thickness, &self.thickness),
            },
            Section::Rectangle { width, height, up } => Section::Rectangle {
                width: times(width, &self.width),
                height: times(height, &self.height),
                up,
            },
            Section::Custom { area, i1, i2, j, up } => Section::Custom {
                area: times(area, &self.area),
                i1: times(i1, &self.i1),
                i2: times(i2, &self.i2),
                j: times(j, &self.j),
                up,
            },
        };
        let material = Material {
            density: times(material.density, &self.density),
            youngs_modulus: times(material.youngs_modulus, &self.youngs_modulus),
            poisson_ratio: material.poisson_ratio,
            shear_modulus: material.shear_modulus.map(|g| times(g, &self.shear_modulus)),
        };
        (section, material)
    }
}

impl Taper {
    /// Refuses factors that make no sense on such a section and material.
    pub(super) fn check(&self, section: &Section, material: &Material) -> Result<(), Error> {
        let mut keys = match section {
            Section::Circle { .. } => vec!["radius"],
            Section::Tube { .. } => vec!["radius", "thickness"],
            Section::Rectangle { .. } => vec!["width", "height"],
            Section::Custom { .. } => vec!["area", "i1", "i2", "j"],
        };
        keys.extend(["density", "youngs_modulus"]);
        keys.extend(material.shear_modulus.map(|_| "shear_modulus"));
        for (key, factor) in self.each() {
            let key = format!("rod.taper.{key}");
            if !keys.iter().any(|known| key.ends_with(&format!(".{known}"))) {
                let allowed =
                    format!("a factor on a number that the scene has: {}", keys.join(", "));
                return Err(Error::invalid(key, "a factor", allowed));
            }
            factor.check(&key)?;
            if let Some(wrong) = factor.values().into_iter().find(|factor| *factor <= 0.0) {
                return Err(Error::invalid(key, wrong, "factors above 0"));
            }
        }
        // What is linear is largest and smallest at the ends of its pieces.
        for piece in self.breaks().windows(2) {
            let inside = 1e-9 * (piece[1] - piece[0]);
            for place in [piece[0] + inside, piece[1] - inside] {
                let (section, _) = self.at(place, section, material);
                section.check().map_err(|error| match error {
                    Error::Invalid { key, found, allowed, .. } => {
                        let number = key.trim_start_matches("rod.section.");
                        let found = format!("{number} = {found} at {place:.3} of the length");
                        Error::invalid("rod.taper", found, allowed)
                    }
                    error => error,
                })?;
            }
        }
        Ok(())
    }
}
