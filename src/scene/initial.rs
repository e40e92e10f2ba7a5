//! `[initial]`: shape and velocity of the rod at t = 0, and the validation of these keys.
//!
//! The state is the rest shape, another given shape, the equilibrium under the loads, or that of the first two recorded
//! frames. A velocity, m/s, an angular velocity about the center of mass, rad/s, and a perturbation of the shape up to
//! `MAX_PERTURBATION` of the length may be given besides. Forces until t = 0 are allowed with an equilibrium only, a
//! perturbation not with a recorded start. A shape is required by the state "shape", and allowed as start of the search
//! for an equilibrium; with other states it is rejected. `check` makes these checks. `is_rest` returns whether the rod
//! starts at rest in its rest shape, `moves` whether it has a velocity.

use crate::error::Error;
use crate::scene::loads::PointForce;
use crate::scene::number::{Quantity, SceneNumber, is_default};
use crate::scene::shape::Shape;
use crate::scene::table::{NumberTree, TABLE, table};
use serde::{Deserialize, Serialize};

table! {
    /// `[initial]`: initial state of the rod: rest shape, given shape, equilibrium or recording, with
    /// an optional velocity.
    #[derive(Default)]
    pub struct Initial {
        /// Kind of the initial state.
        #[serde(default)]
        pub state: InitialState,
        /// Initial shape, or the start of the search for the equilibrium, without twist. Supports hold
        /// the ends in this shape.
        #[serde(skip_serializing_if = "Option::is_none")]
        pub shape: Option<Shape<D>> = TABLE,
        /// Initial velocity of every node that no support holds, m/s.
        #[serde(
            deserialize_with = "crate::input::arrays::numbers",
            default,
            skip_serializing_if = "is_default"
        )]
        pub velocity: [D; 3] = Quantity::signed("m/s").within(-1e6, 1e6),
        /// Initial angular velocity about the center of mass, rad/s; added to `velocity`.
        #[serde(
            deserialize_with = "crate::input::arrays::numbers",
            default,
            skip_serializing_if = "is_default"
        )]
        pub angular_velocity: [D; 3] = Quantity::signed("rad/s").within(-1e6, 1e6),
        /// Amplitude of an asymmetric displacement across the rod at t = 0, as a fraction of its length, -0.1 .. 0.1.
        /// It lets the rod leave unstable states, and vanishes at supports. A planar rod stays in its plane.
        #[serde(default, skip_serializing_if = "is_default")]
        pub perturbation: f64,
        /// Additional point forces until t = 0 (pluck and release).
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        pub point: Vec<PointForce<D>> = TABLE,
    }
}

/// Largest amplitude of `initial.perturbation`, as a fraction of the rod length.
const MAX_PERTURBATION: f64 = 0.1;

/// Kind of the initial state.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum InitialState {
    /// Rest shape.
    #[default]
    Rest,
    /// At rest in another given shape.
    Shape,
    /// Equilibrium under the loads.
    Equilibrium,
    /// Position and velocity from the first two frames of `supports.path`.
    Recorded,
}

impl<D: SceneNumber> Initial<D> {
    /// Whether the rod starts at rest in its rest shape: state "rest", no velocities, no perturbation and no forces of
    /// `initial.point`. Such a table is not written to files.
    pub(super) fn is_rest(&self) -> bool {
        let is_unperturbed = self.perturbation == 0.0 && self.point.is_empty();
        self.state == InitialState::Rest && is_unperturbed && !self.moves()
    }

    /// Whether a component of the initial velocity or angular velocity is other than zero.
    pub fn moves(&self) -> bool {
        !is_default(&self.velocity) || !is_default(&self.angular_velocity)
    }
}

impl Initial {
    /// Rejects invalid numbers, a perturbation above [`MAX_PERTURBATION`] in size, and one of a recorded start. Forces
    /// until t = 0 require the state "equilibrium". A shape is required by the state "shape", allowed with
    /// "equilibrium", and rejected with others.
    pub(super) fn check(&self) -> Result<(), Error> {
        self.check_numbers("initial", TABLE)?;
        if self.perturbation.is_nan() || self.perturbation.abs() > MAX_PERTURBATION {
            let allowed = "-0.1 .. 0.1, a displacement over the rod's length";
            return Err(Error::invalid("initial.perturbation", self.perturbation, allowed));
        }
        // Markers give the initial positions of a recorded start.
        if self.perturbation != 0.0 && self.state == InitialState::Recorded {
            let allowed = "0 with state = \"recorded\"";
            return Err(Error::invalid("initial.perturbation", self.perturbation, allowed));
        }
        // Forces until the release act in an equilibrium only.
        if self.state != InitialState::Equilibrium && !self.point.is_empty() {
            let found = "forces, but no equilibrium to compute with them";
            let allowed = "only with state = \"equilibrium\"";
            return Err(Error::invalid("initial.point", found, allowed));
        }
        // A shape is required by one state, and has no effect in others.
        match (&self.shape, self.state) {
            (Some(shape), InitialState::Shape | InitialState::Equilibrium) => {
                shape.check("initial.shape")
            }
            (None, InitialState::Shape) => {
                let allowed = "a shape together with state = \"shape\"";
                Err(Error::invalid("initial.shape", "no such key", allowed))
            }
            (Some(_), InitialState::Rest | InitialState::Recorded) => {
                let (found, allowed) =
                    ("a shape", "only with state = \"shape\" or \"equilibrium\"");
                Err(Error::invalid("initial.shape", found, allowed))
            }
            (None, _) => Ok(()),
        }
    }
}
