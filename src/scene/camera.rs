//! How what was recorded relates to the scene's world: clock, scale, tilt and place of the camera.

use super::positive;
use crate::error::Error;
use serde::{Deserialize, Serialize};

/// `[camera]`: a point at `x` is recorded at `wall + shift + pixel_scale R (x - wall)`, with `R`
/// the turn by `in_plane_rotation` about the normal of a planar scene (the z axis of a spatial
/// one), and at `time_offset` after it was there. The wall is the rod's first node at rest. Only
/// fits look through the camera.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Camera {
    /// What the recording's clock shows when the motion starts, s.
    #[serde(default)]
    pub time_offset: f64,
    /// Recorded over real lengths.
    #[serde(default = "one")]
    pub pixel_scale: f64,
    /// rad.
    #[serde(default)]
    pub in_plane_rotation: f64,
    /// Where the clamp is recorded, less where it is in the scene, m.
    #[serde(default, deserialize_with = "crate::exact::numbers")]
    pub clamp_position: [f64; 3],
}

fn one() -> f64 {
    1.0
}

impl Default for Camera {
    fn default() -> Self {
        Self {
            time_offset: 0.0,
            pixel_scale: 1.0,
            in_plane_rotation: 0.0,
            clamp_position: [0.0; 3],
        }
    }
}

impl Camera {
    pub(super) fn is_default(&self) -> bool {
        *self == Self::default()
    }

    pub(super) fn check(&self) -> Result<(), Error> {
        positive("camera.pixel_scale", self.pixel_scale)?;
        super::finite("camera.clamp_position", &self.clamp_position)?;
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
