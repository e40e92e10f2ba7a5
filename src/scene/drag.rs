//! The fluid around a rod.

use crate::error::Error;
use crate::scene::number::{Numbers, Quantity, Written};
use crate::scene::validate::{finite, not_negative};
use serde::{Deserialize, Serialize};

/// `[loads.drag]`: force per length of a fluid, `-(linear + quadratic |u|) u` for the velocities
/// `u` of the rod relative to the fluid, across the rod and along it, and buoyancy.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[cfg_attr(test, schemars(bound = "D: Written + schemars::JsonSchema"))]
#[serde(deny_unknown_fields, bound = "D: Written")]
pub struct Drag<D = f64> {
    /// Linear drag coefficient across the rod, kg/(m s).
    #[serde(default)]
    pub linear_normal: D,
    /// Linear drag coefficient along the rod, kg/(m s).
    #[serde(default)]
    pub linear_tangential: D,
    /// Quadratic drag coefficient across the rod, kg/m^2: half the fluid density times width times
    /// drag coefficient.
    #[serde(default)]
    pub quadratic_normal: D,
    /// Quadratic drag coefficient along the rod, kg/m^2.
    #[serde(default)]
    pub quadratic_tangential: D,
    /// Uniform velocity of the fluid, m/s.
    #[serde(deserialize_with = "crate::input::arrays::numbers", default)]
    pub fluid_velocity: [D; 3],
    /// Density of the fluid for buoyancy, kg/m^3.
    #[serde(default)]
    pub fluid_density: D,
    /// Mass of fluid that moves with the rod, isotropic and without weight, kg/m.
    #[serde(default)]
    pub added_mass: D,
}

impl Drag {
    pub(super) fn over<D>(&self, n: &mut Numbers<'_, D>) -> Drag<D> {
        let linear = Quantity::positive("kg/(m s)").vanishing();
        let quadratic = Quantity::positive("kg/m^2").vanishing();
        let density = Quantity::positive("kg/m^3").vanishing();
        let mass = Quantity::positive("kg/m").vanishing();
        let velocity = Quantity::signed("m/s");
        Drag {
            linear_normal: n.number("linear_normal", self.linear_normal, linear),
            linear_tangential: n.number("linear_tangential", self.linear_tangential, linear),
            quadratic_normal: n.number("quadratic_normal", self.quadratic_normal, quadratic),
            quadratic_tangential: n.number(
                "quadratic_tangential",
                self.quadratic_tangential,
                quadratic,
            ),
            fluid_velocity: n.vector("fluid_velocity", self.fluid_velocity, velocity),
            fluid_density: n.number("fluid_density", self.fluid_density, density),
            added_mass: n.number("added_mass", self.added_mass, mass),
        }
    }

    /// Whether the fluid moves.
    pub(crate) fn flows(&self) -> bool {
        self.fluid_velocity != [0.0; 3]
    }

    pub(super) fn check(&self) -> Result<(), Error> {
        let numbers = [
            ("linear_normal", self.linear_normal),
            ("linear_tangential", self.linear_tangential),
            ("quadratic_normal", self.quadratic_normal),
            ("quadratic_tangential", self.quadratic_tangential),
            ("fluid_density", self.fluid_density),
            ("added_mass", self.added_mass),
        ];
        for (key, value) in numbers {
            not_negative(&format!("loads.drag.{key}"), value)?;
        }
        finite("loads.drag.fluid_velocity", &self.fluid_velocity)
    }
}
