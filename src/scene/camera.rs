//! How what was recorded relates to the scene's world: clock, scale, tilt and place of the camera.

use crate::error::Error;
use crate::scene::number::{Numbers, Quantity, Written};
use crate::scene::validate::{finite, positive};
use serde::{Deserialize, Serialize};

/// `[camera]`: a point at `x` is recorded at `wall + shift + pixel_scale R (x - wall)`, with `R`
/// the turn by `in_plane_rotation` about the normal of a planar scene (the z axis of a spatial
/// one), and at `time_offset` after it was there. The wall is the rod's first node at rest. Only
/// fits look through the camera.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[cfg_attr(test, schemars(bound = "D: Written + schemars::JsonSchema"))]
#[serde(deny_unknown_fields, bound = "D: Written")]
pub struct Camera<D = f64> {
    /// Reading of the recording's clock when the motion starts, s.
    #[serde(default)]
    pub time_offset: D,
    /// Ratio of recorded lengths to real lengths.
    #[serde(default = "one::<D>")]
    pub pixel_scale: D,
    /// Rotation of the camera about the normal of the scene's plane, rad.
    #[serde(default)]
    pub in_plane_rotation: D,
    /// Recorded position of the clamp minus its position in the scene, m.
    #[serde(deserialize_with = "crate::input::arrays::numbers", default)]
    pub clamp_position: [D; 3],
}

fn one<D: From<f64>>() -> D {
    D::from(1.0)
}

impl<D: From<f64>> Default for Camera<D> {
    fn default() -> Self {
        Self {
            time_offset: zero(),
            pixel_scale: one(),
            in_plane_rotation: zero(),
            clamp_position: [zero(), zero(), zero()],
        }
    }
}

fn zero<D: From<f64>>() -> D {
    D::from(0.0)
}

impl<D: Written> Camera<D> {
    pub(super) fn is_default(&self) -> bool {
        *self == Self::default()
    }
}

impl Camera {
    pub(super) fn over<D>(&self, n: &mut Numbers<'_, D>) -> Camera<D> {
        let place = Quantity::signed("m").within(-1e6, 1e6).of_the_camera();
        let clock = Quantity::signed("s").within(-1e6, 1e6).of_the_camera();
        let scale = Quantity::positive("").of_the_camera();
        let angle = Quantity::ANGLE.of_the_camera();
        Camera {
            time_offset: n.number("time_offset", self.time_offset, clock),
            pixel_scale: n.number("pixel_scale", self.pixel_scale, scale),
            in_plane_rotation: n.number("in_plane_rotation", self.in_plane_rotation, angle),
            clamp_position: n.vector("clamp_position", self.clamp_position, place),
        }
    }

    pub(super) fn check(&self) -> Result<(), Error> {
        positive("camera.pixel_scale", self.pixel_scale)?;
        finite("camera.clamp_position", &self.clamp_position)?;
        for (key, value) in
            [("time_offset", self.time_offset), ("in_plane_rotation", self.in_plane_rotation)]
        {
            if !value.is_finite() {
                return Err(Error::invalid(format!("camera.{key}"), value, "a finite number"));
            }
        }
        Ok(())
    }
}
