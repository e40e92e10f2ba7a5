//! Frames of an assembly in space: those of the edges of all rods, and the reference rotations of bodies and sprung
//! clamps.
//!
//! A rotation is `R0 exp((z - z0)/length)`, with its coordinates `z` and the reference `R0` at `z0`. References move to
//! accepted states, so that the exponential map is taken of small vectors. In a plane both lists are empty.
//! [`AssemblyFrames::map`] converts all numbers to another number type.

use crate::energy::frame::{EdgeFrame, Frames};
use crate::numerics::rotation::Matrix3;
use crate::numerics::scalar::Scalar;
use crate::numerics::vector::Vector;
use crate::rod::ReferenceFrames;

/// The reference rotation of a body or a sprung clamp.
#[derive(Clone, Copy, Debug)]
pub struct RotationReference<D> {
    /// Its axes, in the columns, in those of the world.
    pub axes: Matrix3<D>,
    /// The coordinates `z0` at which the rotation has these axes, m.
    pub coordinates: Vector<D>,
}

/// Frames of all rods and references of all rotations.
#[derive(Debug)]
pub struct AssemblyFrames<D> {
    /// The frames of each rod.
    pub rods: Vec<Frames<D>>,
    /// The references of bodies and springs.
    pub rotations: Vec<RotationReference<D>>,
}

impl<D> Default for AssemblyFrames<D> {
    /// Empty lists: the frames of an assembly in a plane.
    fn default() -> Self {
        Self { rods: Vec::new(), rotations: Vec::new() }
    }
}

impl<D: Clone> Clone for AssemblyFrames<D> {
    /// A copy of the frames.
    fn clone(&self) -> Self {
        Self { rods: self.rods.clone(), rotations: self.rotations.clone() }
    }

    /// Overwrites these frames with a copy of `from`; allocated lists are reused.
    fn clone_from(&mut self, from: &Self) {
        self.rods.clone_from(&from.rods);
        self.rotations.clone_from(&from.rotations);
    }
}

impl<D: Scalar> ReferenceFrames<D> for AssemblyFrames<D> {
    /// Empty frames; both lists are ignored, as derivatives along parameters of assemblies use dual numbers.
    fn from_parts(_: Vec<EdgeFrame<D>>, _: Vec<D>) -> Self {
        Self::default()
    }
}

impl<D: Scalar> AssemblyFrames<D> {
    /// A copy with every number of frames, twists and references converted to another number type.
    pub fn map<E: Scalar>(&self, convert: impl Fn(D) -> E + Copy) -> AssemblyFrames<E> {
        let rod = |frames: &Frames<D>| Frames {
            edges: frames.edges.iter().map(|edge| edge.map(convert)).collect(),
            twist: frames.twist.iter().map(|twist| convert(*twist)).collect(),
        };
        let rotation = |reference: &RotationReference<D>| RotationReference {
            axes: reference.axes.map(|row| row.map(convert)),
            coordinates: reference.coordinates.map(convert),
        };
        AssemblyFrames {
            rods: self.rods.iter().map(rod).collect(),
            rotations: self.rotations.iter().map(rotation).collect(),
        }
    }
}
