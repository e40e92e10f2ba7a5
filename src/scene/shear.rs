//! Shear flexibility of a rod: the ratio `E/(kappa G)` of Young's modulus over shear coefficient times shear modulus.
//!
//! The model has no shear deformation. The ratio corrects frequencies ([`vibration`](crate::vibration)) and shows which
//! rods are too thick. `Scene::shear_flexibility` is that of section and material in the middle of the rod.

use crate::numerics::scalar::Scalar;
use crate::scene::Scene;

/// Poisson's ratio that is assumed where a scene has none, or an impossible one.
pub(crate) const USUAL_RATIO: f64 = 0.3;

impl<D: Scalar> Scene<D> {
    /// Ratio `E/(kappa G)` of the section and the material in the middle of a rod. Without a shear modulus the material
    /// is isotropic, with Poisson's ratio or else [`USUAL_RATIO`]. With one, Poisson's ratio of the shear coefficient
    /// is `E/(2 G) - 1` where that is from -1 to 0.5, else [`USUAL_RATIO`].
    pub(crate) fn shear_flexibility(&self) -> D {
        let (section, material) = self.at(0.5);
        let Some(shear_modulus) = material.shear_modulus else {
            let nu = material.poisson_ratio.unwrap_or(D::from(USUAL_RATIO));
            return section.shear_flexibility(nu);
        };
        let ratio = material.youngs_modulus / shear_modulus;
        let implied = ratio * 0.5 - 1.0;
        let is_possible = (-1.0..=0.5).contains(&implied.value());
        let nu = if is_possible { implied } else { D::from(USUAL_RATIO) };
        section.shear_flexibility(nu) * ratio / ((nu + 1.0) * 2.0)
    }
}
