//! Frames of an assembly in space: those of the edges of all rods, and the reference rotations of all bodies.
//!
//! The rotation of a body is `R0 exp((z - z0)/length)`, with its coordinates `z` and the reference `R0` at `z0`. The
//! reference follows accepted states, so that the exponential map is taken of small vectors. In a plane there are none.

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
    /// The coordinates that belong to it, m.
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
    /// Those of an assembly in a plane.
    fn default() -> Self {
        Self { rods: Vec::new(), rotations: Vec::new() }
    }
}

impl<D: Clone> Clone for AssemblyFrames<D> {
    /// A copy of the frames.
    fn clone(&self) -> Self {
        Self { rods: self.rods.clone(), rotations: self.rotations.clone() }
    }

    /// Allocates nothing where there is room.
    fn clone_from(&mut self, from: &Self) {
        self.rods.clone_from(&from.rods);
        self.rotations.clone_from(&from.rotations);
    }
}

impl<D: Scalar> ReferenceFrames<D> for AssemblyFrames<D> {
    /// No frames: sensitivities of assemblies are those of simulations over dual numbers.
    fn from_parts(_: Vec<EdgeFrame<D>>, _: Vec<D>) -> Self {
        Self::default()
    }
}

impl<D: Scalar> AssemblyFrames<D> {
    /// The frames over another number type.
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
