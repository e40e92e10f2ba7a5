//! Where the rod is at t = 0, and how it moves.

use crate::error::Error;
use crate::scene::loads::{PointForce, is_zero};
use crate::scene::number::{Numbers, Quantity, Written};
use crate::scene::shape::Shape;
use crate::scene::validate::finite;
use serde::{Deserialize, Serialize};

/// `[initial]`: initial state of the rod: rest shape, given shape, equilibrium or recording, with
/// an optional velocity.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[cfg_attr(test, schemars(bound = "D: Written + schemars::JsonSchema"))]
#[serde(deny_unknown_fields, bound = "D: Written")]
pub struct Initial<D = f64> {
    /// Kind of the initial state.
    #[serde(default)]
    pub state: InitialState,
    /// Initial shape, or the start of the search for the equilibrium, without twist. Supports hold
    /// the ends in this shape.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub shape: Option<Shape<D>>,
    /// Initial velocity of every node that no support holds, m/s.
    #[serde(
        deserialize_with = "crate::input::arrays::numbers",
        default,
        skip_serializing_if = "is_zero"
    )]
    pub velocity: [D; 3],
    /// Initial angular velocity about the center of mass, rad/s; added to `velocity`.
    #[serde(
        deserialize_with = "crate::input::arrays::numbers",
        default,
        skip_serializing_if = "is_zero"
    )]
    pub angular_velocity: [D; 3],
    /// Amplitude of an asymmetric displacement across the rod at t = 0, as a fraction of its length, -0.1 .. 0.1. It lets
    /// the rod leave unstable states, and vanishes at supports. A planar rod stays in its plane.
    #[serde(default, skip_serializing_if = "is_none")]
    pub perturbation: f64,
    /// Additional point forces until t = 0 (pluck and release).
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub point: Vec<PointForce<D>>,
}

/// Largest perturbation over the length.
const MAX_PERTURBATION: f64 = 0.1;

fn is_none(perturbation: &f64) -> bool {
    *perturbation == 0.0
}

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

impl<D: Written> Initial<D> {
    pub(super) fn is_rest(&self) -> bool {
        let perturbed = !is_none(&self.perturbation);
        self.state == InitialState::Rest && self.point.is_empty() && !self.moves() && !perturbed
    }

    /// Whether the rod starts with a velocity.
    pub fn moves(&self) -> bool {
        !is_zero(&self.velocity) || !is_zero(&self.angular_velocity)
    }
}

impl Initial {
    /// Velocities are numbers only of a scene that `moves`, others' stay what they are.
    pub(super) fn over<D: From<f64>>(&self, moves: bool, n: &mut Numbers<'_, D>) -> Initial<D> {
        let speed = Quantity::signed("m/s").within(-1e6, 1e6);
        let spin = Quantity::signed("rad/s").within(-1e6, 1e6);
        Initial {
            state: self.state,
            shape: self.shape.as_ref().map(|shape| n.table("shape", |n| shape.over(n))),
            velocity: match moves {
                true => n.vector("velocity", self.velocity, speed),
                false => self.velocity.map(D::from),
            },
            angular_velocity: match moves {
                true => n.vector("angular_velocity", self.angular_velocity, spin),
                false => self.angular_velocity.map(D::from),
            },
            perturbation: self.perturbation,
            point: n.list("point", &self.point, PointForce::over),
        }
    }

    pub(super) fn check(&self) -> Result<(), Error> {
        finite("initial.velocity", &self.velocity)?;
        finite("initial.angular_velocity", &self.angular_velocity)?;
        if self.perturbation.is_nan() || self.perturbation.abs() > MAX_PERTURBATION {
            let allowed = "-0.1 .. 0.1, a displacement over the rod's length";
            return Err(Error::invalid("initial.perturbation", self.perturbation, allowed));
        }
        if self.perturbation != 0.0 && self.state == InitialState::Recorded {
            let allowed = "0 beside state = \"recorded\"";
            return Err(Error::invalid("initial.perturbation", self.perturbation, allowed));
        }
        for (i, load) in self.point.iter().enumerate() {
            load.check(&format!("initial.point[{i}]"))?;
        }
        if self.state != InitialState::Equilibrium && !self.point.is_empty() {
            let found = "forces that hold a rod that is not in equilibrium";
            let allowed = "only with state = \"equilibrium\"";
            return Err(Error::invalid("initial.point", found, allowed));
        }
        match (&self.shape, self.state) {
            (Some(shape), InitialState::Shape | InitialState::Equilibrium) => {
                shape.check("initial.shape")
            }
            (None, InitialState::Shape) => {
                let allowed = "a shape beside state = \"shape\"";
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
