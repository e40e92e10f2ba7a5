//! `[loads.drag]`: drag, buoyancy and added mass of the fluid around a rod.
//!
//! The force per length across the rod, and that along it, is `-(linear + quadratic |u|) u` each, with its own
//! coefficients and its own component `u`, m/s, of the velocity of the rod relative to the fluid. Coefficients are
//! constants per length, kg/(m s) and kg/m^2, not derived from a Reynolds number. The table declares units, and that
//! all numbers but the velocity of the fluid are positive or zero; all are zero by default. `rod::drag` computes
//! nodal forces from them. The masses of nodes take the added mass, kg/m, and their weights the buoyancy by the
//! density of the fluid, kg/m^3.

use crate::scene::number::Quantity;
use crate::scene::table::table;

/// Linear drag coefficient.
const LINEAR: Quantity = Quantity::positive("kg/(m s)").vanishing();
/// Quadratic drag coefficient.
const QUADRATIC: Quantity = Quantity::positive("kg/m^2").vanishing();

table! {
    /// `[loads.drag]`: force per length of a fluid, `-(linear + quadratic |u|) u` for the velocities
    /// `u` of the rod relative to the fluid, across the rod and along it, and buoyancy.
    #[derive(Copy, Default)]
    pub struct Drag {
        /// Linear drag coefficient across the rod, kg/(m s).
        #[serde(default)]
        pub linear_normal: D = LINEAR,
        /// Linear drag coefficient along the rod, kg/(m s).
        #[serde(default)]
        pub linear_tangential: D = LINEAR,
        /// Quadratic drag coefficient across the rod, kg/m^2: half the fluid density times width times
        /// drag coefficient.
        #[serde(default)]
        pub quadratic_normal: D = QUADRATIC,
        /// Quadratic drag coefficient along the rod, kg/m^2.
        #[serde(default)]
        pub quadratic_tangential: D = QUADRATIC,
        /// Uniform velocity of the fluid, m/s.
        #[serde(deserialize_with = "crate::input::arrays::numbers", default)]
        pub fluid_velocity: [D; 3] = Quantity::signed("m/s"),
        /// Density of the fluid for buoyancy, kg/m^3.
        #[serde(default)]
        pub fluid_density: D = Quantity::positive("kg/m^3").vanishing(),
        /// Mass of fluid that moves with the rod, isotropic and without weight, kg/m.
        #[serde(default)]
        pub added_mass: D = Quantity::positive("kg/m").vanishing(),
    }
}
