//! `[rod.taper]`: factors along the rod on the numbers of section and material, for sections and materials that vary.
//!
//! Each factor is one number, a list with one number for each of equally many equal parts of the length, linear, or
//! linear between break points. A number of section or material at a place, a fraction of the rod length, is its value
//! in the scene times its factor there (`Taper::at`). Numbers without a factor are unchanged. `Taper::breaks` are the
//! boundaries of lists, the break points and both ends, ascending, as fractions of the length. `Taper::check` rejects
//! factors of numbers that the section or material does not have, factors of 0 or below, and invalid tapered sections.

use crate::error::Error;
use crate::numerics::scalar::Scalar;
use crate::scene::along::Along;
use crate::scene::material::Material;
use crate::scene::number::Quantity;
use crate::scene::section::Section;
use crate::scene::table::table;

/// Quantities of a factor on a number of section or material: of the whole rod, and of a part of it.
const FACTOR: [Quantity; 2] = [Quantity::positive("").within(1e-6, 1e6); 2];

/// Distance of two breaks, as a fraction of the rod length, below which they are the same.
const SAME_BREAK: f64 = 1e-12;

/// Distance from the ends of a piece, as a fraction of its length, at which its section is validated.
const INSIDE: f64 = 1e-9;

/// Declares one factor for each number of a section and a material that may vary along the rod.
macro_rules! factors {
    ($($(#[$doc:meta])* $key:ident;)*) => {
        table! {
            /// `[rod.taper]`: factors along the rod on section and material; default 1. Each is a list
            /// with one factor for each of equally many equal parts of the length, a linear function
            /// `{ from = 1.0, to = 0.5 }`, or factors at arc lengths, linear between,
            /// `{ at = [0.0, 0.3, 0.4], factor = [1.0, 0.5, 0.4] }`.
            pub struct Taper {
                $($(#[$doc])*
                #[serde(skip_serializing_if = "Option::is_none")]
                pub $key: Option<Along<D>> = FACTOR,)*
            }
        }

        impl<D> Default for Taper<D> {
            /// A taper without factors: section and material are constant along the rod.
            fn default() -> Self {
                Self { $($key: None,)* }
            }
        }

        impl<D: Clone> Taper<D> {
            /// A taper with the same factor on every number of section and material, of all kinds of sections, for the
            /// catalog of parameters.
            pub(super) fn uniform(factor: &Along<D>) -> Self {
                Self { $($key: Some(factor.clone()),)* }
            }
        }

        impl<D> Taper<D> {
            /// Keys and values of the factors that are given, in the order of their declaration.
            pub(super) fn factors(&self) -> impl Iterator<Item = (&'static str, &Along<D>)> {
                let all = [$((stringify!($key), self.$key.as_ref()),)*];
                all.into_iter().filter_map(|(key, factor)| Some((key, factor?)))
            }

            /// The factors that are given, in the order of their declaration.
            pub(super) fn factors_mut(&mut self) -> impl Iterator<Item = &mut Along<D>> {
                [$(self.$key.as_mut(),)*].into_iter().flatten()
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

impl<D> Taper<D> {
    /// Whether no factor is given, so that section and material are constant along the rod.
    pub fn is_none(&self) -> bool {
        self.factors().next().is_none()
    }

    /// Places at which any factor may jump or change its slope, and both ends 0 and 1, ascending, as fractions of the
    /// rod length. Of places within [`SAME_BREAK`] of each other only the first remains.
    pub(crate) fn breaks(&self) -> Vec<f64> {
        let mut breaks = vec![0.0, 1.0];
        breaks.extend(self.factors().flat_map(|(_, factor)| factor.breaks()));
        breaks.sort_by(f64::total_cmp);
        // Lists of different lengths share boundaries, such as 1/2 and 2/4, up to rounding.
        breaks.dedup_by(|a, b| (*a - *b).abs() < SAME_BREAK);
        breaks
    }
}

impl<D: Scalar> Taper<D> {
    /// Section and material at a place, a fraction of the rod length: their numbers times the factors there, 1 for
    /// those not given. Factors of numbers of another kind of section have no effect. Poisson's ratio, the laws of
    /// stretch and bending, and `up` are unchanged.
    pub(crate) fn at(
        &self,
        place: f64,
        section: &Section<D>,
        material: &Material<D>,
    ) -> (Section<D>, Material<D>) {
        let times = |value: D, factor: &Option<Along<D>>| {
            factor.as_ref().map_or(value, |factor| value * factor.at(place))
        };
        // Factors apply to the numbers of the section's own kind.
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
            stretch_law: material.stretch_law,
            mooney_rivlin_ratio: material.mooney_rivlin_ratio,
            bending_law: material.bending_law.clone(),
        };
        (section, material)
    }
}

impl Taper {
    /// Rejects factors on numbers that section and material do not have, and factors of 0 or below. Next to both ends
    /// of each piece between breaks, the tapered section must be valid: a wall must not be thicker than the radius.
    pub(super) fn check(&self, section: &Section, material: &Material) -> Result<(), Error> {
        let mut keys = match section {
            Section::Circle { .. } => vec!["radius"],
            Section::Tube { .. } => vec!["radius", "thickness"],
            Section::Rectangle { .. } => vec!["width", "height"],
            Section::Custom { .. } => vec!["area", "i1", "i2", "j"],
        };
        keys.extend(["density", "youngs_modulus"]);
        keys.extend(material.shear_modulus.map(|_| "shear_modulus"));
        // A factor without its number would have no effect.
        for (key, factor) in self.factors() {
            let key = format!("rod.taper.{key}");
            if !keys.iter().any(|known| key.ends_with(&format!(".{known}"))) {
                let allowed = format!("a factor for a number of the scene: {}", keys.join(", "));
                return Err(Error::invalid(key, "a factor", allowed));
            }
            if let Some(wrong) = factor.values().into_iter().find(|factor| *factor <= 0.0) {
                return Err(Error::invalid(key, wrong, "factors above 0"));
            }
        }
        // Linear factors are largest and smallest at the ends of their pieces.
        for piece in self.breaks().windows(2) {
            let inside = INSIDE * (piece[1] - piece[0]);
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
