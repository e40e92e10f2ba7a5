//! Assemblies: several rods whose ends are carried by rigid bodies, in a plane or in space.
//!
//! A joint is a clamp whose pose is unknown: the nodes that a body carries follow from its coordinates, as those at a wall
//! follow from the wall. An [`Assembly`] is a [`Rod`] for steppers, equilibria and modes. Its parts are written once over an
//! [`AssemblyLayout`]: [`JoinedRods`] with a bordered [tangent]; bodies in a [plane](bodies) and in [space](spatial_bodies).

pub mod attachment;
pub mod bodies;
mod bordered;
pub mod carrying;
mod conversion;
pub mod frames;
pub mod joined_rods;
pub mod joint_law;
pub mod layout;
mod member;
mod reduction;
mod rotational_inertia;
pub mod spatial_bodies;
pub mod spatial_motion;
mod tangent;

pub use attachment::{Attachment, CarriedEdge, CarriedNode, FixedNode};
pub use bodies::Bodies;
pub use bordered::{AssemblyFactors, AssemblyTangent};
pub use frames::{AssemblyFrames, RotationReference};
pub use joined_rods::JoinedRods;
pub use layout::AssemblyLayout;
pub use member::Member;
pub use spatial_bodies::{SpatialBodies, SpatialBody, SpatialSpring};
pub use spatial_motion::SpatialRotation;
pub use tangent::BorderedTangent;

use crate::energy::Derivatives;
use crate::numerics::scalar::Nestable;
use crate::rod::layout::{Plane, Space};
use crate::rod::{Energies, Rod, RotationRates, Viscosity};
use num_dual::Dual64;
use std::ops::Range;

/// Rods with the bodies that join them.
#[derive(Clone, Debug)]
pub enum Assembly<D: Nestable> {
    /// In a plane.
    Plane(JoinedRods<D, Plane>),
    /// In space.
    Space(JoinedRods<D, Space>),
}

/// The expression for the rods of an assembly, in the plane or in space.
macro_rules! of_either {
    ($assembly:expr, $rods:ident => $value:expr) => {
        match $assembly {
            Assembly::Plane($rods) => $value,
            Assembly::Space($rods) => $value,
        }
    };
}

/// The expression for rods and tangent of an assembly, which have the same layout.
macro_rules! with_tangent {
    ($assembly:expr, $rods:ident, $tangent:ident => $value:expr) => {
        match ($assembly, $tangent) {
            (Assembly::Plane($rods), AssemblyTangent::Plane($tangent)) => $value,
            (Assembly::Space($rods), AssemblyTangent::Space($tangent)) => $value,
            _ => debug_assert!(false, "a tangent of the other layout"),
        }
    };
}

impl<D: Nestable> Assembly<D> {
    /// Whether it is in space.
    pub fn is_spatial(&self) -> bool {
        matches!(self, Self::Space(_))
    }

    /// The assembly for the steps of a simulation, whose derivatives are those by increments of rotations.
    #[must_use]
    pub fn by_increments(mut self) -> Self {
        if let Self::Space(rods) = &mut self {
            rods.bodies.by_increments = true;
        }
        self
    }

    /// Range of the coordinates of bodies.
    pub fn body_coordinates(&self) -> Range<usize> {
        of_either!(self, rods => rods.body_coordinates())
    }

    /// Range of the unknowns of each rod.
    pub fn rod_ranges(&self) -> Vec<Range<usize>> {
        of_either!(self, rods => rods.members.iter().map(|member| member.range.clone()).collect())
    }

    /// The unknowns without effect: those of carried and fixed nodes, and gaps.
    pub fn tied(&self) -> impl Iterator<Item = usize> {
        of_either!(self, rods => rods.tied().collect::<Vec<_>>().into_iter())
    }

    /// Writes the unknowns of carried and fixed nodes that follow from the coordinates of the bodies.
    pub fn place_carried(&self, q: &mut [D], frames: &AssemblyFrames<D>) {
        of_either!(self, rods => rods.place_carried(q, frames));
    }

    /// Replaces the frames of edges at walls, in space, by those of `rest`.
    pub(crate) fn hold_walls(&self, rest: &AssemblyFrames<D>, frames: &mut AssemblyFrames<D>) {
        let Self::Space(rods) = self else { return };
        for (k, member) in rods.members.iter().enumerate() {
            let clamped = member.fixed.iter().filter(|node| node.width > 3);
            clamped
                .for_each(|node| frames.rods[k].replace(node.node, &rest.rods[k].edges[node.node]));
        }
    }

    /// Writes the velocities of carried nodes that follow from those of the bodies' coordinates; those of fixed nodes are
    /// zero.
    pub fn set_carried_rates(&self, q: &[D], frames: &AssemblyFrames<D>, rates: &mut [D]) {
        of_either!(self, rods => rods.set_carried_rates(q, frames, rates));
    }
}

impl<D: Nestable> Rod<D> for Assembly<D> {
    type Tangent = AssemblyTangent<D>;
    type Dual = Assembly<Dual64>;
    type Frames = AssemblyFrames<D>;
    type Geometry = ();

    const HAS_FRAMES: bool = false;

    /// Coordinates of rotations are lengths.
    fn is_angle(_: usize) -> bool {
        false
    }

    /// Angles of edges in space follow the coordinates of nodes; every fourth unknown of bodies has no effect.
    #[inline(always)]
    fn has_angle_at(&self, i: usize) -> bool {
        self.is_spatial() && i % 4 == 3
    }

    /// A zero matrix with the sparsity pattern of the tangent.
    fn zero_tangent(&self) -> AssemblyTangent<D> {
        match self {
            Self::Plane(rods) => AssemblyTangent::Plane(rods.zero_tangent()),
            Self::Space(rods) => AssemblyTangent::Space(rods.zero_tangent()),
        }
    }

    /// Lumped mass of every degree of freedom, kg (kg m^2 for angles).
    fn mass(&self) -> &[D] {
        of_either!(self, rods => rods.mass())
    }

    /// Writes the gradient of the elastic energy less the dead loads, N (N m for angles).
    fn gradient(
        &self,
        q: &[D],
        frames: &AssemblyFrames<D>,
        derivatives: Derivatives,
        gradient: &mut [D],
    ) {
        of_either!(self, rods => rods.gradient(q, frames, derivatives, gradient));
    }

    /// Writes the gradient as `gradient` does, and its tangent, N/m.
    fn tangent(
        &self,
        q: &[D],
        frames: &AssemblyFrames<D>,
        derivatives: Derivatives,
        gradient: &mut [D],
        tangent: &mut AssemblyTangent<D>,
    ) {
        self.tangent_under(q, frames, derivatives, None, gradient, tangent);
    }

    /// Writes gradient and tangent, the tangent for the given `tensions` of all edges, N, instead of those of their
    /// stretches.
    fn tangent_under(
        &self,
        q: &[D],
        frames: &AssemblyFrames<D>,
        derivatives: Derivatives,
        tensions: Option<&[D]>,
        gradient: &mut [D],
        tangent: &mut AssemblyTangent<D>,
    ) {
        with_tangent!(self, rods, tangent => {
            rods.tangent_under(q, frames, derivatives, tensions, gradient, tangent);
        });
    }

    /// Writes the tensions of all edges at `q`, N, to first order in the `change` that led to `q`.
    fn tensions_after(
        &self,
        change: &[D],
        q: &[D],
        frames: &AssemblyFrames<D>,
        tensions: &mut Vec<D>,
    ) {
        of_either!(self, rods => rods.tensions_after(change, q, frames, tensions));
    }

    /// Sensitivities of an assembly are those of simulations over dual numbers, which need no geometry.
    fn measure(&self, _: &[D], _: &AssemblyFrames<D>, (): &mut ()) {}

    /// The tangent by unknowns: an assembly has no edge coordinates.
    fn edge_tangent(
        &self,
        q: &[D],
        frames: &AssemblyFrames<D>,
        derivatives: Derivatives,
        tangent: &mut AssemblyTangent<D>,
    ) {
        self.tangent(q, frames, derivatives, &mut vec![D::from(0.0); q.len()], tangent);
    }

    /// Moves the frames to `q`, without changing any energy there.
    fn move_frames(&self, frames: &mut AssemblyFrames<D>, q: &[D]) {
        if let Self::Space(rods) = self {
            rods.move_frames(frames, q);
        }
    }

    /// The coordinates of bodies, if any of them rotates in space.
    fn rotation_coordinates(&self) -> Range<usize> {
        match self {
            Self::Space(rods) if rods.bodies.by_increments => rods.body_coordinates(),
            _ => 0..0,
        }
    }

    /// Adds the inertia forces of rotating bodies, and their derivatives.
    fn add_rotational_inertia(
        &self,
        q: &[D],
        frames: &AssemblyFrames<D>,
        rates: &RotationRates<'_, D>,
        forces: &mut [D],
        tangent: Option<&mut AssemblyTangent<D>>,
    ) {
        let Self::Space(rods) = self else { return };
        let blocks = match tangent {
            Some(AssemblyTangent::Space(tangent)) => Some(&mut tangent.blocks),
            _ => None,
        };
        let rates = RotationRates { velocity: &rates.velocity[rods.first..], ..*rates };
        let (z, forces) = (&q[rods.first..], &mut forces[rods.first..]);
        rods.bodies.add_rotational_inertia(z, frames, &rates, forces, blocks);
    }

    /// Converts increments of rotations to changes of the unknowns.
    fn convert_correction(&self, q: &[D], frames: &AssemblyFrames<D>, correction: &mut [D]) {
        if let Self::Space(rods) = self {
            let (z, own) = (&q[rods.first..], &mut correction[rods.first..]);
            rods.bodies.convert_correction(z, frames, own);
        }
    }

    /// Adds `factor` times the products of inertia with `rates` of all unknowns.
    fn add_products_of_inertia(&self, rates: &[D], factor: D, out: &mut [D]) {
        if let Self::Space(rods) = self {
            let (rates, out) = (&rates[rods.first..], &mut out[rods.first..]);
            rods.bodies.add_products_of_inertia(rates, factor, out);
        }
    }

    /// The first inner node that a step from `before` to `now` has taken through a fold: its joint turns by more than
    /// a right angle, to the opposite side.
    fn folded_node(&self, before: &[D], now: &[D], frames: &AssemblyFrames<D>) -> Option<usize> {
        of_either!(self, rods => rods.folded_node(before, now, frames))
    }

    /// The first edge that turned by more than 45 degrees in a step from `before` to `now`.
    fn over_rotated_edge(
        &self,
        before: &[D],
        now: &[D],
        frames: &AssemblyFrames<D>,
    ) -> Option<usize> {
        of_either!(self, rods => rods.over_rotated_edge(before, now, frames))
    }

    /// Elastic energies and the potential of the loads; kinetic energy zero.
    fn energies(&self, q: &[D], frames: &AssemblyFrames<D>) -> Energies {
        of_either!(self, rods => rods.energies(q, frames))
    }

    /// Writes the strains of all elements, in the order `set_viscous` expects.
    fn strains(&self, q: &[D], frames: &AssemblyFrames<D>, strains: &mut Vec<D>) {
        of_either!(self, rods => rods.strains(q, frames, strains));
    }

    /// The rods without loads and natural strains, whose elements act as dashpots: strains stand for strain rates.
    fn dashpots(&self) -> Self {
        match self {
            Self::Plane(rods) => Self::Plane(rods.dashpots()),
            Self::Space(rods) => Self::Space(rods.dashpots()),
        }
    }

    /// Energies of stretching, bending and twisting by `strains` of all elements, natural ones taken as zero, J.
    fn strain_energies(&self, strains: &[D]) -> [D; 3] {
        of_either!(self, rods => rods.strain_energies(strains))
    }

    /// Replaces the elements by those of `elastic` with viscous stress, expressed as stiffnesses and natural strains.
    fn set_viscous(&mut self, elastic: &Self, viscosity: &Viscosity<D>) {
        match (self, elastic) {
            (Self::Plane(rods), Self::Plane(elastic)) => rods.set_viscous(elastic, viscosity),
            (Self::Space(rods), Self::Space(elastic)) => rods.set_viscous(elastic, viscosity),
            _ => debug_assert!(false, "an assembly of the other layout"),
        }
    }

    /// Replaces the elements by dashpots with every stiffness times its factor, and the shifts as natural strains.
    fn set_dashpots(&mut self, dashpots: &Self, viscosity: &Viscosity<D>) {
        match (self, dashpots) {
            (Self::Plane(rods), Self::Plane(own)) => rods.set_dashpots(own, viscosity),
            (Self::Space(rods), Self::Space(own)) => rods.set_dashpots(own, viscosity),
            _ => debug_assert!(false, "an assembly of the other layout"),
        }
    }
}
