//! `pose` of `[[supports.motion]]`: how a gripper with recorded position and rotation holds the end of the rod.
//!
//! Input: the [`Track`] of the gripper, with its origin and two points on its first two axes (made by
//! [`Track::of_poses`]), and a time, s. Output of `end_pose`: position, m, of the support point of the rod and the
//! directions of tangent and directors there, in world axes (`EndPose`). With the position p and the rotation R of
//! the gripper they are
//!
//! ```text
//! x = p + R offset,   [t, d1, d2] = R exp(rotation) A
//! ```
//!
//! where the columns of A are the signed axes of the gripper named in `axes`. Points are interpolated as markers are;
//! the two axes between them are made orthonormal (Gram-Schmidt, the first one keeps its direction). Velocities are
//! continuous. All functions take dual numbers, of time and of `offset` and `rotation`.

use crate::error::Error;
use crate::numerics::rotation::{
    Matrix3, components_of, exponential, orthonormal, product, times, transpose,
};
use crate::numerics::scalar::Scalar;
use crate::numerics::vector::{Vector, add, sub};
use crate::scene::number::{Quantity, is_default};
use crate::scene::table::table;
use crate::scene::track::Track;
use marker_files::Axes;

table! {
    /// How a gripper, whose position and rotation are recorded, holds the end of the rod.
    #[derive(Default)]
    pub struct GripperPose {
        /// Name of the rigid body in an export of OptiTrack Motive; default: the only one. Tables have no bodies.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        pub body: Option<String>,
        /// Axes of the gripper along tangent (from start to end of the rod), first and second director of the rod, as
        /// `["z", "x", "y"]`; default: x, y and z.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        pub axes: Option<Axes>,
        /// Position of the end of the rod in the axes of the gripper, m.
        #[serde(
            deserialize_with = "crate::input::arrays::numbers",
            default,
            skip_serializing_if = "is_default"
        )]
        pub offset: [D; 3] = Quantity::signed("m"),
        /// Rotation vector of tangent and directors beyond `axes`, in the axes of the gripper, rad.
        #[serde(
            deserialize_with = "crate::input::arrays::numbers",
            default,
            skip_serializing_if = "is_default"
        )]
        pub rotation: [D; 3] = Quantity::signed("rad"),
    }
}

/// Position and orientation of an end of the rod in the world.
#[derive(Clone, Copy, Debug)]
pub(crate) struct EndPose<D> {
    /// Position of the support point, m.
    pub position: Vector<D>,
    /// Matrix whose columns are tangent, first and second director.
    pub axes: Matrix3<D>,
}

impl<D: Scalar> GripperPose<D> {
    /// The same table with its numbers converted by `convert`.
    pub(super) fn map<E>(&self, convert: impl Fn(D) -> E + Copy) -> GripperPose<E> {
        GripperPose {
            body: self.body.clone(),
            axes: self.axes,
            offset: self.offset.map(convert),
            rotation: self.rotation.map(convert),
        }
    }

    /// Position and orientation of the end of the rod at a time, s, from the track of the gripper. `None` if the track
    /// does not have three points.
    pub(super) fn end_pose(&self, track: &Track, time: D) -> Option<EndPose<D>> {
        let [origin, first, second] = track.markers() else { return None };
        let origin = origin.at(time);
        let [first, second] = [first, second].map(|point| sub(point.at(time), origin));
        let rotation = orthonormal(&transpose(&[first, second, [D::from(0.0); 3]]));
        Some(EndPose {
            position: add(origin, times(&rotation, self.offset)),
            axes: product(&rotation, &self.directions()),
        })
    }

    /// Matrix whose columns are tangent, first and second director in the axes of the gripper: `exp(rotation) A`.
    pub(crate) fn directions(&self) -> Matrix3<D> {
        let columns = components_of(|row, column| {
            let own = std::array::from_fn(|c| Some(if c == row { 1.0 } else { 0.0 }));
            let along = self.axes.map_or(own, |axes| axes.to_world(own));
            D::from(along[column].unwrap_or(0.0))
        });
        product(&exponential(self.rotation), &columns)
    }
}

impl GripperPose {
    /// Rejects `axes` that leave out one of the three; `key` is the path of the table.
    pub(crate) fn check(&self, key: &str) -> Result<(), Error> {
        match self.axes {
            Some(axes) if axes.to_world([Some(1.0); 3]).contains(&None) => {
                let allowed = "three axes of the gripper";
                Err(Error::invalid(format!("{key}.axes"), "an axis \"none\"", allowed))
            }
            _ => Ok(()),
        }
    }
}
