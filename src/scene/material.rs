//! `[material]`: density, kg/m^3, elastic moduli, Pa, and the laws of stretch and bending, with their allowed ranges,
//! the search ranges of fits, and validation.
//!
//! Laws are linear by default. The stretch may be neo-Hookean or Mooney-Rivlin, the latter with its ratio in [0, 1];
//! the bending moment may be a cubic of the curvature with a coefficient, m^2, or a table over the curvature. Spatial
//! scenes need Poisson's ratio, in (-1, 0.5], or the shear modulus; both together are rejected. The two nonlinear
//! stretches are those of an incompressible material: Poisson's ratios below 0.495 are rejected beside them. A
//! Mooney-Rivlin ratio without its law is rejected, and so are numbers that are not finite or have a sign that is not
//! allowed.

use crate::error::Error;
use crate::scene::number::{Candidates, Quantity};
use crate::scene::table::{NumberTree, TABLE, table};
use serde::{Deserialize, Serialize};
use std::ops::RangeInclusive;

/// Quantity of Poisson's ratio of an isotropic material, in (-1, 0.5]; a search begins at 0.3.
const POISSON_RATIO: Quantity =
    Quantity::signed("").within(-1.0 + 1e-9, 0.5).searched(Candidates::Values(&[0.3]));

/// Largest number of curvatures of a table of [`BendingLaw`].
pub(crate) const MAX_BENDING_POINTS: usize = 16;

/// Range of the curvatures of such a table, 1/m.
const CURVATURES: RangeInclusive<f64> = 1e-6..=1e6;

/// The law of the stretch: the axial force as a function of the strain.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum StretchLaw {
    /// Hooke's law: the force is EA times the strain.
    #[default]
    Linear,
    /// An incompressible neo-Hookean material in uniaxial stretch: with the stretch ratio s, the force is EA/3 (s -
    /// 1/s^2).
    NeoHookean,
    /// An incompressible Mooney-Rivlin material in uniaxial stretch: with the stretch ratio s and `mooney_rivlin_ratio`
    /// r, the force is EA/3 (1 - r + r/s) (s - 1/s^2).
    MooneyRivlin,
}

impl StretchLaw {
    /// Whether the law is the linear one.
    fn is_linear(&self) -> bool {
        *self == Self::Linear
    }
}

table! {
    /// `material.bending_law`: the bending moment as a function of the curvature.
    pub enum BendingLaw {
        /// The moment EI kappa (1 + b kappa^2) at the difference kappa of the curvature from the natural one, 1/m.
        Cubic {
            /// The coefficient b, m^2: above zero the rod stiffens, below zero it softens.
            coefficient: D = Quantity::signed("m^2"),
        },
        /// Ratios of the moment to EI kappa at curvatures; kappa is the difference from the natural curvature.
        Table {
            /// Curvatures, 1/m, ascending from above zero; 1 to 16.
            curvature: Vec<f64>,
            /// The moment over EI kappa at each curvature; 1 at no curvature, constant beyond the last one.
            factor: Vec<D> = Quantity::positive("").within(1e-6, 1e6),
        },
    }
}

table! {
    /// `[material]`: density, elastic moduli and the law of the stretch.
    pub struct Material {
        /// Density, kg/m^3.
        pub density: D = Quantity::positive("kg/m^3").searched(Candidates::Decades(100.0, 2e4, 2.0)),
        /// Young's modulus E, Pa.
        pub youngs_modulus: D = Quantity::positive("Pa").searched(Candidates::Decades(1e3, 1e13, 3.0)),
        /// Poisson's ratio, above -1 and at most 0.5; spatial scenes require it or the shear modulus.
        #[serde(skip_serializing_if = "Option::is_none")]
        pub poisson_ratio: Option<D> = POISSON_RATIO,
        /// Shear modulus G, Pa; instead of Poisson's ratio.
        #[serde(skip_serializing_if = "Option::is_none")]
        pub shear_modulus: Option<D> = Quantity::positive("Pa").searched(Candidates::OfYoungsModulus(0.01, 3.0)),
        /// The law of the stretch: `linear`, or `neo-hookean` or `mooney-rivlin` for rubber under large stretches.
        #[serde(default, skip_serializing_if = "StretchLaw::is_linear")]
        pub stretch_law: StretchLaw,
        /// C2/(C1 + C2) of a Mooney-Rivlin stretch: 0 is neo-Hookean.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        pub mooney_rivlin_ratio: Option<D> = Quantity::signed("").within(0.0, 1.0),
        /// The law of the bending; linear by default.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        pub bending_law: Option<BendingLaw<D>> = TABLE,
    }
}

impl BendingLaw {
    /// Whether it is a cubic law with the coefficient zero.
    pub(crate) fn is_linear(&self) -> bool {
        matches!(self, Self::Cubic { coefficient } if *coefficient == 0.0)
    }

    /// Rejects a table without curvatures or with more than [`MAX_BENDING_POINTS`], curvatures that do not ascend
    /// within [`CURVATURES`], and another number of ratios. `key` is the path of the law, for the error.
    pub(super) fn check_table(&self, key: &str) -> Result<(), Error> {
        let Self::Table { curvature, factor } = self else { return Ok(()) };
        let key = |name: &str| format!("{key}.{name}");
        if curvature.is_empty() || curvature.len() > MAX_BENDING_POINTS {
            let found = format!("{} curvatures", curvature.len());
            return Err(Error::invalid(
                key("curvature"),
                found,
                format!("1 to {MAX_BENDING_POINTS}"),
            ));
        }
        let before = std::iter::once(&0.0).chain(curvature);
        let is_valid = |a: f64, b: f64| CURVATURES.contains(&b) && b > a;
        if let Some((_, found)) = before.zip(curvature).find(|(a, b)| !is_valid(**a, **b)) {
            let allowed = "ascending from 1e-6 to 1e6, in 1/m";
            return Err(Error::invalid(key("curvature"), found, allowed));
        }
        if factor.len() != curvature.len() {
            let found = format!("{} numbers", factor.len());
            let allowed = format!("{}, one for each curvature", curvature.len());
            return Err(Error::invalid(key("factor"), found, allowed));
        }
        Ok(())
    }
}

impl<D> Material<D> {
    /// Whether the bending moment is given by a table.
    pub(crate) fn has_bending_table(&self) -> bool {
        matches!(self.bending_law, Some(BendingLaw::Table { .. }))
    }
}

impl Material {
    /// Material of a density, kg/m^3, and a Young's modulus, Pa, without Poisson's ratio and shear modulus.
    pub fn new(density: f64, youngs_modulus: f64) -> Self {
        Self {
            density,
            youngs_modulus,
            poisson_ratio: None,
            shear_modulus: None,
            stretch_law: StretchLaw::Linear,
            mooney_rivlin_ratio: None,
            bending_law: None,
        }
    }

    /// Rejects constants that are not finite or not positive, Poisson's ratio outside (-1, 0.5], and Poisson's ratio
    /// beside the shear modulus. A ratio below 0.495 is rejected beside a neo-Hookean or Mooney-Rivlin stretch, which
    /// is incompressible. A Mooney-Rivlin stretch needs its ratio, in [0, 1], and others reject it.
    pub(super) fn check(&self) -> Result<(), Error> {
        if let Some(law) = &self.bending_law {
            law.check_table("material.bending_law")?;
        }
        if let Some(nu) = self.poisson_ratio {
            if !(nu > -1.0 && nu <= 0.5) {
                return Err(Error::invalid("material.poisson_ratio", nu, "in (-1, 0.5]"));
            }
            if self.shear_modulus.is_some() {
                let found = "both poisson_ratio and shear_modulus";
                return Err(Error::invalid("material.shear_modulus", found, "one of the two"));
            }
            // Rounded ratios of files are those of incompressible materials, too.
            if self.stretch_law != StretchLaw::Linear && nu < 0.495 {
                let name = if self.stretch_law == StretchLaw::NeoHookean {
                    "neo-hookean"
                } else {
                    "mooney-rivlin"
                };
                let allowed = format!(
                    "0.5 with stretch_law {name:?}, which is incompressible; or shear_modulus"
                );
                return Err(Error::invalid("material.poisson_ratio", nu, allowed));
            }
        }
        let key = "material.mooney_rivlin_ratio";
        match (self.stretch_law, self.mooney_rivlin_ratio) {
            (StretchLaw::MooneyRivlin, None) => {
                let allowed = "C2/(C1 + C2), 0 to 1, with stretch_law \"mooney-rivlin\"";
                Err(Error::invalid(key, "no such key", allowed))
            }
            (StretchLaw::MooneyRivlin, Some(ratio)) if !(0.0..=1.0).contains(&ratio) => {
                Err(Error::invalid(key, ratio, "0 to 1"))
            }
            (StretchLaw::Linear | StretchLaw::NeoHookean, Some(ratio)) => {
                let allowed = "no such key without stretch_law \"mooney-rivlin\"";
                Err(Error::invalid(key, ratio, allowed))
            }
            _ => self.check_numbers("material", TABLE),
        }
    }
}
