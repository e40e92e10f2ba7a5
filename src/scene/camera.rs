//! `[camera]`: relation between recorded and scene coordinates: clock, scale, rotation and position.
//!
//! A point at `x` is recorded at `wall + shift + pixel_scale R (x - wall)`, later by the time offset. `R` is the
//! rotation by `in_plane_rotation` about the normal of a planar scene (z in space). `shift` is `clamp_position`, and
//! `wall` the first node at rest. Offset in s, angle in rad, shift in m; by default there is no offset, rotation and
//! shift, and the scale is 1. Only fits apply it, with these numbers as possible parameters.

use crate::scene::number::{Quantity, is_default};
use crate::scene::table::table;

table! {
    /// `[camera]`: a point at `x` is recorded at `wall + shift + pixel_scale R (x - wall)`, with `R`
    /// the turn by `in_plane_rotation` about the normal of a planar scene (the z axis of a spatial
    /// one), and at `time_offset` after it was there. The wall is the rod's first node at rest. Only
    /// fits look through the camera.
    #[derive(Copy)]
    pub struct Camera {
        /// Reading of the recording's clock when the motion starts, s.
        #[serde(default)]
        pub time_offset: D = Quantity::signed("s").within(-1e6, 1e6).of_the_camera(),
        /// Ratio of recorded lengths to real lengths.
        #[serde(default = "one::<D>")]
        pub pixel_scale: D = Quantity::positive("").of_the_camera(),
        /// Rotation of the camera about the normal of the scene's plane, rad.
        #[serde(default)]
        pub in_plane_rotation: D = Quantity::ANGLE.of_the_camera(),
        /// Recorded position of the clamp minus its position in the scene, m.
        #[serde(deserialize_with = "crate::input::arrays::numbers", default)]
        pub clamp_position: [D; 3] = Quantity::signed("m").within(-1e6, 1e6).of_the_camera(),
    }
}

/// The number 1, a scale without effect.
pub(super) fn one<D: From<f64>>() -> D {
    D::from(1.0)
}

impl<D: From<f64> + Default> Default for Camera<D> {
    /// The camera without effect: no time offset, scale 1, no rotation, no shift.
    fn default() -> Self {
        Self {
            time_offset: D::default(),
            pixel_scale: one(),
            in_plane_rotation: D::default(),
            clamp_position: Default::default(),
        }
    }
}

impl<D: From<f64> + Default + PartialEq> Camera<D> {
    /// Whether recorded and scene coordinates and clocks are equal; such a camera is not written to files.
    pub(super) fn is_default(&self) -> bool {
        is_default(self)
    }
}
