//! Interfaces between the parts of an assembly: its rods ([`MemberRod`]), its bodies ([`CarryingBodies`]), and the
//! nodes that the bodies carry ([`CarriedMotion`]).
//!
//! Bodies map their coordinates `z`, m, to the unknowns of carried nodes (positions, m, and in space the angle of a
//! carried edge, zero in the carried frame), with first and second derivatives. In space those by rotations are by
//! increments times their scale, unless `convert_derivatives` converts them to the coordinates. Bodies also have
//! masses, kg, and energies, gradients (N) and second derivatives (N/m) of their loads and joint springs, the latter
//! also with viscous moments. A [`MemberRod`] returns its numbers of edges and strains, and takes its viscous stress
//! from lists of the strains of several rods. Mass and load of a carried node can be removed from it. Planar and
//! spatial bodies and [`DiscreteRod`] implement the traits.

use crate::energy::frame::EdgeFrame;
use crate::numerics::scalar::RodScalar;
use crate::numerics::tangent::Tangent;
use crate::rod::assembly::attachment::Attachment;
use crate::rod::assembly::frames::AssemblyFrames;
use crate::rod::assembly::tangent::BorderedTangent;
use crate::rod::layout::Layout;
use crate::rod::{AssembledRod, DiscreteRod, Energies, RodViscosity, StepVelocities, Viscosity};
use std::borrow::Cow;
use std::fmt::Debug;

/// A rod of an assembly.
pub trait MemberRod<D: RodScalar>: AssembledRod<D> + Debug {
    /// Number of edges.
    fn edges(&self) -> usize;

    /// Number of strains: one per edge, and one (plane) or three (space) per joint.
    fn strain_count(&self) -> usize;

    /// Overwrites the linear laws of the elements with those of `elastic` under the viscous stress of a time step, as
    /// [`set_viscous`](crate::rod::Rod::set_viscous) does: with the stress `K (factor s - natural - shift)` of the
    /// strain `s`. Values that follow signals are copied from `elastic`; nonlinear parts of the laws stay.
    fn set_viscous_part(&mut self, elastic: &Self, viscosity: RodViscosity<'_, D>);

    /// Overwrites the linear laws of the elements with those of `dashpots`, as
    /// [`set_dashpots`](crate::rod::Rod::set_dashpots) does: stiffnesses are multiplied by the factors of `viscosity`,
    /// and its shifts become natural strains.
    fn set_dashpots_part(&mut self, dashpots: &Self, viscosity: RodViscosity<'_, D>);

    /// Sets mass and dead load of the coordinates of a node to zero; the inertia of an angle stays.
    fn clear_node(&mut self, node: usize);

    /// Whether the rod may touch obstacles.
    fn has_contacts(&self) -> bool;
}

impl<D: RodScalar, L: Layout<N, S>, const N: usize, const S: usize> MemberRod<D>
    for DiscreteRod<D, L, N, S>
{
    /// Number of edges.
    fn edges(&self) -> usize {
        self.stretch.len()
    }

    /// Number of strains: one per edge, and `S` per joint.
    fn strain_count(&self) -> usize {
        self.stretch.len() + S * self.joint.len()
    }

    /// Overwrites the linear laws of the elements with those of `elastic` under the viscous stress of a time step,
    /// `K (factor s - natural - shift)`.
    fn set_viscous_part(&mut self, elastic: &Self, viscosity: RodViscosity<'_, D>) {
        self.set_viscous_from(elastic, viscosity);
    }

    /// Overwrites the laws of the elements with those of `dashpots`, with stiffnesses times the factors of `viscosity`
    /// and its shifts as natural strains.
    fn set_dashpots_part(&mut self, dashpots: &Self, viscosity: RodViscosity<'_, D>) {
        self.set_dashpots_from(dashpots, viscosity);
    }

    /// Sets mass and dead load of the coordinates of a node to zero; the inertia of an angle stays.
    fn clear_node(&mut self, node: usize) {
        // Mass and weight of a carried node are those of its body; only the edge keeps its inertia.
        self.mass[L::STRIDE * node..][..N].fill(D::from(0.0));
        self.load[node].force = [D::from(0.0); N];
    }

    /// Whether the rod may touch obstacles.
    fn has_contacts(&self) -> bool {
        !self.contacts.is_empty()
    }
}

/// The unknowns of a carried node, with their derivatives by the coordinates that carry it.
pub trait CarriedMotion<D> {
    /// The unknowns of the node: its coordinates, m, and in space the angle of the edge after it, rad. That is measured
    /// from the carried frame and therefore zero.
    fn values(&self) -> &[D];

    /// Number of body coordinates on which the unknowns depend.
    fn count(&self) -> usize;

    /// The body coordinate with number `k` below [`count`](Self::count), as an index from the first one of all bodies.
    fn coordinate(&self, k: usize) -> usize;

    /// First derivatives of all unknowns by the coordinate with number `k`; of a rotation in space by its increment
    /// times its scale.
    fn slope(&self, k: usize) -> &[D];

    /// Calls `add(i, j, x)`, `j <= i`, with second derivatives `x` of `force.values` by the body coordinates with the
    /// indices `i` and `j`, N/m; by rotations in space they are those by the increment times its scale, as in `slope`.
    /// All pairs without a call have the second derivative zero.
    fn add_curvature(&self, force: &[D], add: impl FnMut(usize, usize, D));

    /// Calls `add(i, j, x)` with the change `x`, N/m, of the derivative of `force.values` by the body coordinate with
    /// the index `i`, by that with the index `j`, at a constant `force`. In space derivatives by a rotation are by
    /// increments in its axes, which turn with it, so that `x` is not symmetric: its symmetric part is that of
    /// `add_curvature`, which is the default.
    fn add_turned(&self, force: &[D], add: impl FnMut(usize, usize, D)) {
        self.add_curvature(force, add);
    }
}

/// For one carried node: derivatives of the velocities of its unknowns (up to four) by the increment of each coordinate
/// that carries it (up to nine, in the order of [`CarriedMotion`]) beyond those of the unknowns times the derivative of
/// a velocity by its unknown, 1/s.
pub(super) type VelocitySlopes<D> = [[D; 4]; 9];

/// Whether a viscous time, s, has a value or derivatives other than zero.
pub(super) fn is_viscous<D: RodScalar>(time: D) -> bool {
    !time.is_identically_zero()
}

/// All bodies and springs of an assembly. Coordinates are counted from the first one of all bodies; `z` are those of
/// all.
pub trait CarryingBodies<D: RodScalar, P>: Clone + Debug + Send + Sync {
    /// The unknowns of a carried node.
    type Motion: CarriedMotion<D> + Debug + Send;

    /// Indices of the coordinates on which the nodes of an attachment depend: of the body's position, then of its
    /// rotation, then of the sprung clamp's.
    fn coordinates(&self, attachment: &Attachment<P>) -> Vec<usize>;

    /// Indices of coordinates without effect, which fill gaps; none in a plane.
    fn idle_coordinates(&self) -> Vec<usize>;

    /// Appends to `to` the unknowns of each node of an attachment with their derivatives, at the coordinates `z` of all
    /// bodies.
    fn carry(
        &self,
        z: &[D],
        frames: &AssemblyFrames<D>,
        attachment: &Attachment<P>,
        to: &mut Vec<Self::Motion>,
    );

    /// Appends to `to` the slopes of the velocity of each node of an attachment, `carried`, at the end of a step: its
    /// derivatives by the increments of the coordinates beyond those of its unknowns times the slope in `rates`. These
    /// are the velocities of all body coordinates, those of rotations in space as angular velocities in their axes
    /// times their scale.
    fn velocity_slopes(
        &self,
        z: &[D],
        frames: &AssemblyFrames<D>,
        rates: StepVelocities<'_, D>,
        attachment: &Attachment<P>,
        carried: &[Self::Motion],
        to: &mut Vec<VelocitySlopes<D>>,
    );

    /// The frame (tangent and director, world axes) of the edge that an attachment carries. `None` in a plane, for a
    /// hinged end, and for a body without rotation and spring.
    fn edge_frame(
        &self,
        _z: &[D],
        _frames: &AssemblyFrames<D>,
        _attachment: &Attachment<P>,
    ) -> Option<EdgeFrame<D>> {
        None
    }

    /// Writes the mass of every coordinate with an effect, kg; that of a rotation is its inertia over its squared
    /// scale.
    fn masses(&self, mass: &mut [D]);

    /// Overwrites `gradient`, N, with that of the springs' energies less the work of the loads on bodies, by all
    /// coordinates. In space derivatives by rotations are those by their increments times their scale, at the present
    /// rotations.
    fn gradient(&self, z: &[D], frames: &AssemblyFrames<D>, gradient: &mut [D]);

    /// Calls `add(row, column, entry)`, `column <= row`, with the second derivatives of the energies of springs and
    /// loads, N/m, and with 1 for idle coordinates.
    fn add_tangent(&self, z: &[D], frames: &AssemblyFrames<D>, add: impl FnMut(usize, usize, D));

    /// Converts `gradient`, and `tangent` if given, in place: from derivatives by increments of rotations to those by
    /// the coordinates `z`. The default, of the plane, does nothing.
    fn convert_derivatives<T: Tangent<D>>(
        &self,
        _z: &[D],
        _frames: &AssemblyFrames<D>,
        _gradient: &mut [D],
        _tangent: Option<&mut BorderedTangent<D, T>>,
    ) {
    }

    /// The `changes` of all coordinates at `z`, with those of rotations converted to increments times their scales. The
    /// default, of the plane, returns `changes`.
    fn increments<'a>(
        &self,
        _z: &[D],
        _frames: &AssemblyFrames<D>,
        changes: &'a [D],
    ) -> Cow<'a, [D]> {
        Cow::Borrowed(changes)
    }

    /// Moves the references of all rotations in `frames` to their axes at the coordinates `z`. The default, of the
    /// plane, does nothing.
    fn move_references(&self, _z: &[D], _frames: &mut AssemblyFrames<D>) {}

    /// Adds the energies of springs, J, to the bending energy, and those of the loads to the potential.
    fn add_energies(&self, z: &[D], frames: &AssemblyFrames<D>, energies: &mut Energies);

    /// A copy whose loads and spring stiffnesses are zero, for the dashpots of an assembly; masses and arms stay.
    fn passive(&self) -> Self;

    /// Whether a spring has a viscous moment.
    fn has_viscous_springs(&self) -> bool;

    /// Appends the rotations of all springs from their rest, rad, at the coordinates `z`: one each in a plane, three in
    /// space.
    fn add_spring_strains(&self, z: &[D], frames: &AssemblyFrames<D>, strains: &mut Vec<D>);

    /// Overwrites the laws of all springs with those of `elastic` plus their viscous moments in a time step. The
    /// strains of the springs begin at index `first` of the lists of `viscosity.own`; nothing changes without it.
    fn set_viscous_springs(&mut self, elastic: &Self, viscosity: &Viscosity<D>, first: usize);
}
