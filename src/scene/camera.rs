//! `[camera]`: relation between recorded and scene coordinates: clock, scale, rotation, position, lens and shutter.
//!
//! A point at `x` has the undistorted recorded position `u = wall + shift + pixel_scale R (x - wall)`. `R` is the
//! rotation by `in_plane_rotation` about the normal of a planar scene (z in space). `shift` is `clamp_position`, and
//! `wall` the first node at rest, of a structure the origin of its first rod. The recorded position `p` of a distorting
//! lens satisfies `u - c = (1 + distortion r^2) (p - c)` across the normal, with the distance `r` of `p` from the
//! optical center `c` in the picture (Brown 1971, first radial term). The clock of the recording shows `time_scale t +
//! time_offset + row_delay . (p - wall - shift)` for the motion at `t`: a rolling shutter reads the rows of a frame one
//! after the other.
//!
//! Times in s, angles in rad, positions in m, `distortion` in 1/m^2, `row_delay` in s/m. By default there is no effect:
//! the scales are 1, all other numbers are 0. Only fits apply the camera, with these numbers as possible parameters.

use crate::scene::number::{Quantity, is_default, one};
use crate::scene::table::table;

table! {
    /// `[camera]`: a point at `x` is recorded at `wall + clamp_position + pixel_scale R (x - wall)`, with the rotation
    /// `R` by `in_plane_rotation` about the normal of a planar scene (the z axis of a spatial one). The wall is the
    /// first node of the rod at rest. Lens distortion and the delay of rows follow. Only fits apply the camera.
    #[derive(Copy)]
    pub struct Camera {
        /// Reading of the recording's clock when the motion starts, s.
        #[serde(default)]
        pub time_offset: D = Quantity::signed("s").within(-1e6, 1e6).of_the_recording(),
        /// Ratio of recorded to real durations: below 1 if the stated frame rate is above the real one.
        #[serde(default = "one::<D>")]
        pub time_scale: D = Quantity::positive("").within(1e-3, 1e3).of_the_recording(),
        /// Ratio of recorded lengths to real lengths.
        #[serde(default = "one::<D>")]
        pub pixel_scale: D = Quantity::positive("").of_the_recording(),
        /// Rotation of the camera about the normal of the scene's plane, rad.
        #[serde(default)]
        pub in_plane_rotation: D = Quantity::ANGLE.of_the_recording(),
        /// Recorded position of the clamp minus its position in the scene, m.
        #[serde(deserialize_with = "crate::input::arrays::numbers", default)]
        pub clamp_position: [D; 3] = Quantity::signed("m").within(-1e6, 1e6).of_the_recording(),
        /// Radial distortion of the lens, 1/m^2: the undistorted distance from the optical center is
        /// `r (1 + distortion r^2)` for the recorded distance `r`, m.
        #[serde(default)]
        pub distortion: D = Quantity::signed("1/m^2").of_the_recording(),
        /// Recorded position of the optical center, m.
        #[serde(deserialize_with = "crate::input::arrays::numbers", default)]
        pub optical_center: [D; 3] = Quantity::signed("m").within(-1e6, 1e6).of_the_recording(),
        /// Delay of a rolling shutter per recorded distance from the clamp, s/m: positive along y if rows further up
        /// are read later.
        #[serde(deserialize_with = "crate::input::arrays::numbers", default)]
        pub row_delay: [D; 3] = Quantity::signed("s/m").of_the_recording(),
    }
}

impl<D: From<f64> + Default> Default for Camera<D> {
    /// The camera without effect: both scales 1, all other numbers 0.
    fn default() -> Self {
        Self {
            time_offset: D::default(),
            time_scale: one(),
            pixel_scale: one(),
            in_plane_rotation: D::default(),
            clamp_position: Default::default(),
            distortion: D::default(),
            optical_center: Default::default(),
            row_delay: Default::default(),
        }
    }
}

impl Camera {
    /// The time of the motion, s, at `time`, s, on the clock of the recording, in the row of the clamp. It may be
    /// negative.
    pub(crate) fn time_of_motion(&self, time: f64) -> f64 {
        (time - self.time_offset) / self.time_scale
    }
}

impl<D: From<f64> + Default + PartialEq> Camera<D> {
    /// Whether recorded and scene coordinates and clocks are equal; such a camera is not written to files.
    pub(super) fn is_default(&self) -> bool {
        is_default(self)
    }
}
