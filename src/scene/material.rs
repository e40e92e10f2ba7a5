//! `[material]`: density and moduli.

use crate::error::Error;
use crate::scene::number::{Candidates, Numbers, Quantity, Written};
use crate::scene::validate::positive;
use serde::{Deserialize, Serialize};

/// `[material]`: density and elastic moduli.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[cfg_attr(test, schemars(bound = "D: Written + schemars::JsonSchema"))]
#[serde(deny_unknown_fields, bound = "D: Written")]
pub struct Material<D = f64> {
    /// Density, kg/m^3.
    pub density: D,
    /// Young's modulus E, Pa.
    pub youngs_modulus: D,
    /// Poisson's ratio, above -1 and at most 0.5; spatial scenes require it or the shear modulus.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub poisson_ratio: Option<D>,
    /// Shear modulus G, Pa; instead of Poisson's ratio.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub shear_modulus: Option<D>,
}

impl Material {
    pub(super) fn over<D>(&self, n: &mut Numbers<'_, D>) -> Material<D> {
        let density = Quantity::positive("kg/m^3").searched(Candidates::Decades(100.0, 2e4, 2.0));
        let modulus = Quantity::positive("Pa");
        let youngs = modulus.searched(Candidates::Decades(1e3, 1e13, 3.0));
        let shear = modulus.searched(Candidates::OfYoungsModulus(0.01, 3.0));
        let ratio =
            Quantity::signed("").within(-1.0 + 1e-9, 0.5).searched(Candidates::Values(&[0.3]));
        Material {
            density: n.number("density", self.density, density),
            youngs_modulus: n.number("youngs_modulus", self.youngs_modulus, youngs),
            poisson_ratio: n.maybe("poisson_ratio", self.poisson_ratio, ratio),
            shear_modulus: n.maybe("shear_modulus", self.shear_modulus, shear),
        }
    }

    /// Density in kg/m^3 and Young's modulus in Pa; neither Poisson's ratio nor shear modulus.
    pub fn new(density: f64, youngs_modulus: f64) -> Self {
        Self { density, youngs_modulus, poisson_ratio: None, shear_modulus: None }
    }

    /// Refuses what makes no sense.
    pub(super) fn check(&self) -> Result<(), Error> {
        let material = self;
        positive("material.density", material.density)?;
        positive("material.youngs_modulus", material.youngs_modulus)?;
        if let Some(nu) = material.poisson_ratio {
            if !(nu > -1.0 && nu <= 0.5) {
                return Err(Error::invalid("material.poisson_ratio", nu, "in (-1, 0.5]"));
            }
            if material.shear_modulus.is_some() {
                let found = "both poisson_ratio and shear_modulus";
                return Err(Error::invalid("material.shear_modulus", found, "one of the two"));
            }
        }
        if let Some(modulus) = material.shear_modulus {
            positive("material.shear_modulus", modulus)?;
        }
        Ok(())
    }
}
