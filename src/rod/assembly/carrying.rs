//! Interfaces of the parts of an assembly: its rods, its bodies, and the nodes that these carry.

use crate::energy::frame::EdgeFrame;
use crate::numerics::scalar::Nestable;
use crate::numerics::tangent::Tangent;
use crate::rod::assembly::attachment::Attachment;
use crate::rod::assembly::frames::AssemblyFrames;
use crate::rod::assembly::tangent::BorderedTangent;
use crate::rod::layout::Layout;
use crate::rod::{AssembledRod, DiscreteRod, Energies, Viscosity};
use std::borrow::Cow;
use std::fmt::Debug;

/// A rod of an assembly.
pub trait MemberRod<D: Nestable>: AssembledRod<D> + Debug {
    /// Number of edges.
    fn edges(&self) -> usize;

    /// Number of strains: those of all edges and joints.
    fn strain_count(&self) -> usize;

    /// [`set_viscous`](crate::rod::Rod::set_viscous) for a viscosity of several rods, of which the strains of this one begin at `first`.
    fn set_viscous_part(&mut self, elastic: &Self, viscosity: &Viscosity<D>, first: usize);

    /// [`set_dashpots`](crate::rod::Rod::set_dashpots) for such a viscosity.
    fn set_dashpots_part(&mut self, dashpots: &Self, viscosity: &Viscosity<D>, first: usize);

    /// Removes mass and load of a node.
    fn clear_node(&mut self, node: usize);
}

impl<D: Nestable, L: Layout<N, S>, const N: usize, const S: usize> MemberRod<D>
    for DiscreteRod<D, L, N, S>
{
    /// Number of edges.
    fn edges(&self) -> usize {
        self.stretch.len()
    }

    /// Number of strains: those of all edges and joints.
    fn strain_count(&self) -> usize {
        self.stretch.len() + S * self.joint.len()
    }

    /// `set_viscous` for a viscosity of several rods, of which the strains of this one begin at `first`.
    fn set_viscous_part(&mut self, elastic: &Self, viscosity: &Viscosity<D>, first: usize) {
        self.set_viscous_from(elastic, viscosity, first);
    }

    /// `set_dashpots` for such a viscosity.
    fn set_dashpots_part(&mut self, dashpots: &Self, viscosity: &Viscosity<D>, first: usize) {
        self.set_dashpots_from(dashpots, viscosity, first);
    }

    /// Removes mass and load of a node.
    fn clear_node(&mut self, node: usize) {
        self.mass[L::STRIDE * node..][..N].fill(D::from(0.0));
        self.load[node].force = [D::from(0.0); N];
    }
}

/// The unknowns of a carried node, with their derivatives by the coordinates that carry it.
pub trait CarriedMotion<D> {
    /// The unknowns, m; the angle of an edge is measured from its carried frame.
    fn values(&self) -> &[D];

    /// Number of coordinates on which they depend.
    fn count(&self) -> usize;

    /// The coordinate with number `k`, counted from the first one of all bodies.
    fn coordinate(&self, k: usize) -> usize;

    /// First derivatives by the coordinate with number `k`.
    fn slope(&self, k: usize) -> &[D];

    /// Calls `add` with two coordinates, the second not above the first, and the second derivative of `force.values`.
    fn add_curvature(&self, force: &[D], add: impl FnMut(usize, usize, D));
}

/// All bodies and springs of an assembly. Coordinates are counted from the first one of all bodies; `z` are those of all.
pub trait CarryingBodies<D: Nestable, P>: Clone + Debug + Send + Sync {
    /// The unknowns of a carried node.
    type Motion: CarriedMotion<D> + Debug + Send;

    /// Coordinates of an attachment.
    fn coordinates(&self, attachment: &Attachment<P>) -> Vec<usize>;

    /// Coordinates without effect, which fill gaps.
    fn idle_coordinates(&self) -> Vec<usize>;

    /// Writes the unknowns of the nodes of an attachment with their derivatives.
    fn carry(
        &self,
        z: &[D],
        frames: &AssemblyFrames<D>,
        attachment: &Attachment<P>,
        to: &mut Vec<Self::Motion>,
    );

    /// The frame of the edge of an attachment, if it has one.
    fn edge_frame(
        &self,
        _z: &[D],
        _frames: &AssemblyFrames<D>,
        _attachment: &Attachment<P>,
    ) -> Option<EdgeFrame<D>> {
        None
    }

    /// Writes the mass of every coordinate, kg.
    fn masses(&self, mass: &mut [D]);

    /// Writes the gradient of the springs' energies less the loads on bodies, N.
    fn gradient(&self, z: &[D], frames: &AssemblyFrames<D>, gradient: &mut [D]);

    /// Adds the second derivatives of the energies of springs and loads: `add` takes two coordinates and an entry, N/m.
    fn add_tangent(&self, z: &[D], frames: &AssemblyFrames<D>, add: impl FnMut(usize, usize, D));

    /// Converts derivatives by increments of rotations to those by the coordinates.
    fn convert_derivatives<T: Tangent<D>>(
        &self,
        _z: &[D],
        _frames: &AssemblyFrames<D>,
        _gradient: &mut [D],
        _tangent: Option<&mut BorderedTangent<D, T>>,
    ) {
    }

    /// Increments of rotations from changes of the coordinates.
    fn increments<'a>(
        &self,
        _z: &[D],
        _frames: &AssemblyFrames<D>,
        changes: &'a [D],
    ) -> Cow<'a, [D]> {
        Cow::Borrowed(changes)
    }

    /// Moves the references of all rotations to the coordinates.
    fn move_references(&self, _z: &[D], _frames: &mut AssemblyFrames<D>) {}

    /// Adds the energies of springs and loads, J.
    fn add_energies(&self, z: &[D], frames: &AssemblyFrames<D>, energies: &mut Energies);

    /// The same bodies without springs and loads.
    fn passive(&self) -> Self;
}
