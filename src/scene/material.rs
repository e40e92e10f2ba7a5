//! `[material]`: density, kg/m^3, and elastic moduli, Pa, with their allowed ranges, the search ranges of fits, and validation.
//!
//! Spatial scenes need Poisson's ratio, in (-1, 0.5], or the shear modulus; both together are rejected.

use crate::error::Error;
use crate::scene::number::{Candidates, Quantity};
use crate::scene::table::{NumberTree, TABLE, table};

/// Quantity of Poisson's ratio of an isotropic material, in (-1, 0.5]; a search begins at 0.3.
const POISSON_RATIO: Quantity =
    Quantity::signed("").within(-1.0 + 1e-9, 0.5).searched(Candidates::Values(&[0.3]));

table! {
    /// `[material]`: density and elastic moduli.
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
    }
}

impl Material {
    /// Material of a density, kg/m^3, and a Young's modulus, Pa, without Poisson's ratio and shear modulus.
    pub fn new(density: f64, youngs_modulus: f64) -> Self {
        Self { density, youngs_modulus, poisson_ratio: None, shear_modulus: None }
    }

    /// Rejects constants that are not finite or not positive, Poisson's ratio outside (-1, 0.5], and Poisson's ratio beside the
    /// shear modulus.
    pub(super) fn check(&self) -> Result<(), Error> {
        if let Some(nu) = self.poisson_ratio {
            if !(nu > -1.0 && nu <= 0.5) {
                return Err(Error::invalid("material.poisson_ratio", nu, "in (-1, 0.5]"));
            }
            if self.shear_modulus.is_some() {
                let found = "both poisson_ratio and shear_modulus";
                return Err(Error::invalid("material.shear_modulus", found, "one of the two"));
            }
        }
        self.check_numbers("material", TABLE)
    }
}
