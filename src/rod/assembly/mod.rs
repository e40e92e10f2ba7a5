//! Assemblies: several rods whose ends are carried by rigid bodies, in a plane or in space.
//!
//! Unknowns are those of all rods, one rod after the other, and then the coordinates of the bodies (position and
//! rotation) and of sprung clamps (rotation). The end nodes that a body carries follow from these: one node of a pinned
//! end (a ball, or a hinge in a plane), two of a clamped or sprung one. Nodes at walls are fixed. [`Assembly`] is a
//! [`Rod`] for steppers, equilibria and modes, without springs of internal friction: it returns gradient (N), tangent
//! (N/m), energies (J) and strains of all rods with bodies and joint springs. `place_carried` and `set_carried_rates`
//! overwrite positions and velocities of carried nodes by those that follow from the bodies, of fixed nodes by theirs.
//! `hold_walls` replaces the frames of edges clamped at walls by those at rest. `unknowns_without_effect` lists those
//! of carried and fixed nodes, gaps, and in space the unused coordinate after each three of a center or rotation.
//! `rod_ranges` and `body_coordinates` are ranges of unknowns. For the steps of a simulation in space,
//! [`Assembly::by_increments`] selects derivatives by increments of rotations. Both variants are [`JoinedRods`] over an
//! [`AssemblyLayout`], with a bordered `tangent`. Bodies and joint springs are in [`bodies`] (plane) and
//! [`spatial_bodies`] (space).
//!
//! Files: `member` (one rod with its carried and fixed nodes), `joined_rods` (evaluation of all rods), `reduction`
//! (chain rule through carried nodes), `joint_law` (elastic joints in space), `tangent`, `coupling`, `skew_part`,
//! `member_factors` and `bordered` (matrix and factors). Contacts of rods with each other are in `touching_edges` and
//! `contact_pairs`, their damping and friction in `pair_losses`, their entries in the matrix in `rod_couplings`.
//! Damping and friction of contacts with obstacles are in `contact_losses` and `carried_velocities`, rotations in space
//! in `spatial_motion`, `conversion` and `rotational_inertia`. `attachment`, `carrying`, `frames` and `layout` have
//! data and interfaces.

pub mod attachment;
pub mod bodies;
mod bordered;
mod carried_velocities;
pub mod carrying;
mod contact_losses;
pub mod contact_pairs;
mod conversion;
mod coupling;
pub mod frames;
pub mod joined_rods;
pub mod joint_law;
pub mod layout;
mod member;
mod member_factors;
mod pair_losses;
mod reduction;
mod rod_couplings;
mod rotational_inertia;
mod skew_part;
pub mod spatial_bodies;
pub mod spatial_motion;
mod tangent;
pub mod touching_edges;

pub use attachment::{Attachment, CarriedEdge, CarriedNode, FixedNode};
pub use bodies::Bodies;
pub use bordered::{AssemblyFactors, AssemblyTangent};
pub use contact_pairs::ContactPairs;
pub use frames::{AssemblyFrames, RotationReference};
pub use joined_rods::JoinedRods;
pub use layout::AssemblyLayout;
pub use member::Member;
pub use spatial_bodies::{SpatialBodies, SpatialBody, SpatialSpring};
pub use spatial_motion::SpatialRotation;
pub use tangent::BorderedTangent;
pub use touching_edges::{ContactLaw, JointDistance, TouchingEdge};

use crate::energy::Derivatives;
use crate::numerics::scalar::RodScalar;
use crate::rod::layout::{Plane, Space};
use crate::rod::{Energies, Rod, RotationRates, StepVelocities, Viscosity};
use num_dual::Dual64;
use std::ops::Range;

/// Rods with the bodies that join them.
#[derive(Clone, Debug)]
pub enum Assembly<D: RodScalar> {
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

impl<D: RodScalar> Assembly<D> {
    /// Whether the assembly is in space; otherwise it is in a plane.
    pub fn is_spatial(&self) -> bool {
        matches!(self, Self::Space(_))
    }

    /// The assembly for the steps of a simulation. In space its gradient and tangent are then by increments of
    /// rotations instead of by the coordinates of rotations. In a plane nothing changes.
    #[must_use]
    pub fn by_increments(mut self) -> Self {
        if let Self::Space(rods) = &mut self {
            rods.bodies.by_increments = true;
        }
        self
    }

    /// Range of the coordinates of all bodies and joint springs in the unknowns: from the end of the rods to the last
    /// unknown.
    pub fn body_coordinates(&self) -> Range<usize> {
        of_either!(self, rods => rods.body_coordinates())
    }

    /// Range of the unknowns of each rod in those of the assembly, in the order of the rods.
    pub fn rod_ranges(&self) -> Vec<Range<usize>> {
        of_either!(self, rods => rods.members.iter().map(|member| member.range.clone()).collect())
    }

    /// Indices of the unknowns without effect. For each rod in order: unknowns of carried nodes, of fixed nodes, and
    /// the gap after the rod. Last, in space, the unused coordinate after each three of a body or rotation.
    pub fn unknowns_without_effect(&self) -> impl Iterator<Item = usize> {
        of_either!(self, rods => rods.unknowns_without_effect().collect::<Vec<_>>().into_iter())
    }

    /// Overwrites the unknowns of carried nodes in `q` with those that follow from the coordinates of bodies in `q`.
    /// Fixed nodes get their positions. Angles of carried and fixed edges become zero.
    pub fn place_carried(&self, q: &mut [D], frames: &AssemblyFrames<D>) {
        of_either!(self, rods => rods.place_carried(q, frames));
    }

    /// Replaces the frames of edges clamped at walls by those of `rest`, in space; reference twists of their joints
    /// follow. Nothing happens in a plane.
    pub(crate) fn hold_walls(&self, rest: &AssemblyFrames<D>, frames: &mut AssemblyFrames<D>) {
        let Self::Space(rods) = self else { return };
        for (k, member) in rods.members.iter().enumerate() {
            // A clamp fixes the angle of the edge after its node too, a hinge the three coordinates only.
            let clamped = member.fixed.iter().filter(|node| node.width > 3);
            clamped
                .for_each(|node| frames.rods[k].replace(node.node, &rest.rods[k].edges[node.node]));
        }
    }

    /// The contacts of the rods with each other, where the unknowns are the coordinates of the nodes of all rods, three
    /// per node, rod after rod.
    pub fn contacts_on_nodes(&self) -> ContactPairs<f64> {
        of_either!(self, rods => rods.contacts_on_nodes())
    }

    /// Overwrites the entries of carried nodes in `rates` (velocities of all unknowns at `q`) with those that follow
    /// from the entries of the bodies' coordinates. Entries of fixed nodes become zero.
    pub fn set_carried_rates(&self, q: &[D], frames: &AssemblyFrames<D>, rates: &mut [D]) {
        of_either!(self, rods => rods.set_carried_rates(q, frames, rates));
    }
}

impl<D: RodScalar> Rod<D> for Assembly<D> {
    type Tangent = AssemblyTangent<D>;
    type Dual = Assembly<Dual64>;
    type Frames = AssemblyFrames<D>;
    type Geometry = ();

    const HAS_FRAMES: bool = false;

    /// False: coordinates of rotations are lengths. Angles of edges in space are found by `has_angle_at`.
    fn is_angle(_: usize) -> bool {
        false
    }

    /// Whether unknown `i` is an angle, rad: in space every fourth one (`i % 4 == 3`), in a plane none. Among the
    /// coordinates of bodies every fourth one has no effect.
    #[inline(always)]
    fn has_angle_at(&self, i: usize) -> bool {
        self.is_spatial() && i % 4 == 3
    }

    /// A zero matrix with the sparsity pattern of the tangent: a band per rod, couplings of carried ends, and an
    /// envelope for the coordinates of bodies.
    fn zero_tangent(&self) -> AssemblyTangent<D> {
        match self {
            Self::Plane(rods) => AssemblyTangent::Plane(rods.zero_tangent()),
            Self::Space(rods) => AssemblyTangent::Space(rods.zero_tangent()),
        }
    }

    /// Lumped mass of every unknown, kg (kg m^2 for angles of edges). Those without effect have an arbitrary positive
    /// one.
    fn mass(&self) -> &[D] {
        of_either!(self, rods => rods.mass())
    }

    /// Overwrites `gradient` with that of elastic energy less work of the loads at `q`, N (N m for angles). Forces on
    /// carried nodes are added to the coordinates of bodies; entries without effect are zero. Derivatives by rotations
    /// are those of `by_increments` if it was called.
    fn gradient(
        &self,
        q: &[D],
        frames: &AssemblyFrames<D>,
        derivatives: Derivatives,
        gradient: &mut [D],
    ) {
        of_either!(self, rods => rods.gradient(q, frames, derivatives, gradient));
    }

    /// Overwrites `gradient` as `gradient` does, and `tangent`, N/m, with its derivative by the unknowns. Rows and
    /// columns of carried and fixed unknowns become those of the identity.
    fn tangent(
        &self,
        q: &[D],
        frames: &AssemblyFrames<D>,
        derivatives: Derivatives,
        gradient: &mut [D],
        tangent: &mut AssemblyTangent<D>,
    ) {
        self.tangent_with_tensions(q, frames, derivatives, None, gradient, tangent);
    }

    /// Overwrites gradient and tangent as `tangent` does. `tensions` of the edges of all rods, N, if given, replace the
    /// axial forces in the geometric stiffness. A tangent of the other layout (plane, space) is left unchanged.
    fn tangent_with_tensions(
        &self,
        q: &[D],
        frames: &AssemblyFrames<D>,
        derivatives: Derivatives,
        tensions: Option<&[D]>,
        gradient: &mut [D],
        tangent: &mut AssemblyTangent<D>,
    ) {
        with_tangent!(self, rods, tangent => {
            rods.tangent_with_tensions(q, frames, derivatives, tensions, gradient, tangent);
        });
    }

    /// Overwrites `tensions` with predicted axial forces, N, of the edges of all rods, one rod after the other: those
    /// at `q - change` plus their first-order change. Carried nodes move with the bodies.
    fn tensions_after(
        &self,
        change: &[D],
        q: &[D],
        frames: &AssemblyFrames<D>,
        tensions: &mut Vec<D>,
    ) {
        of_either!(self, rods => rods.tensions_after(change, q, frames, tensions));
    }

    /// Does nothing: derivatives along parameters of an assembly are those of simulations over dual numbers, without
    /// geometry.
    fn measure(&self, _: &[D], _: &AssemblyFrames<D>, (): &mut ()) {}

    /// Overwrites `tangent` with that by the unknowns, N/m: an assembly has no edge coordinates.
    fn edge_tangent(
        &self,
        q: &[D],
        frames: &AssemblyFrames<D>,
        derivatives: Derivatives,
        tangent: &mut AssemblyTangent<D>,
    ) {
        // Ends of rods follow bodies, so that edge vectors alone are no coordinates.
        self.tangent(q, frames, derivatives, &mut vec![D::from(0.0); q.len()], tangent);
    }

    /// Moves the frames of all rods and the reference rotations of all bodies to `q`, in space. Energies at `q` do not
    /// change. Nothing happens in a plane.
    fn move_frames(&self, frames: &mut AssemblyFrames<D>, q: &[D]) {
        if let Self::Space(rods) = self {
            rods.move_frames(frames, q);
        }
    }

    /// Range of the coordinates of all bodies, if the assembly is in space and its derivatives are by increments; else
    /// empty.
    fn rotation_coordinates(&self) -> Range<usize> {
        match self {
            Self::Space(rods) if rods.bodies.by_increments => rods.body_coordinates(),
            _ => 0..0,
        }
    }

    /// In space, adds the gyroscopic forces of rotating bodies and the mass damping of their products of inertia, N, to
    /// `forces`. Appends their derivatives as unsymmetric blocks to `tangent` if one is given. `rates` has the
    /// velocities of all unknowns and coefficients of the step. `forces` must contain the gradient. Nothing happens in
    /// a plane.
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
        // Only coordinates of bodies have these forces: lists begin at the first one.
        let rates = RotationRates { velocity: &rates.velocity[rods.first..], ..*rates };
        let (z, forces) = (&q[rods.first..], &mut forces[rods.first..]);
        rods.bodies.add_rotational_inertia(z, frames, &rates, forces, blocks);
    }

    /// Replaces the increments of all rotations in `correction` by changes of their coordinates, in space; nothing in a
    /// plane.
    fn convert_correction(&self, q: &[D], frames: &AssemblyFrames<D>, correction: &mut [D]) {
        if let Self::Space(rods) = self {
            let (z, own) = (&q[rods.first..], &mut correction[rods.first..]);
            rods.bodies.convert_correction(z, frames, own);
        }
    }

    /// Adds to `out`, a list of all unknowns, `factor` times the products of inertia of rotating bodies times their
    /// entries in `rates`. They are divided by the squared scales `length` of the rotations. Nothing happens in a
    /// plane.
    fn add_products_of_inertia(&self, rates: &[D], factor: D, out: &mut [D]) {
        if let Self::Space(rods) = self {
            let (rates, out) = (&rates[rods.first..], &mut out[rods.first..]);
            rods.bodies.add_products_of_inertia(rates, factor, out);
        }
    }

    /// The first inner node that a step from `before` to `now` has taken through a fold, by the criterion of
    /// [`Rod::folded_node`]. Its index counts the nodes of all rods before its own; `None` without a fold.
    fn folded_node(&self, before: &[D], now: &[D], frames: &AssemblyFrames<D>) -> Option<usize> {
        of_either!(self, rods => rods.folded_node(before, now, frames))
    }

    /// The first edge that turned by more than 45 degrees in a step from `before` to `now`. Its index counts the edges
    /// of all rods before its own; `None` without one.
    fn over_rotated_edge(
        &self,
        before: &[D],
        now: &[D],
        frames: &AssemblyFrames<D>,
    ) -> Option<usize> {
        of_either!(self, rods => rods.over_rotated_edge(before, now, frames))
    }

    /// The index of the first contact through whose obstacle some edge passes in a step from `before` to `now`; `None`
    /// without one.
    fn passed_obstacle(
        &self,
        before: &[D],
        now: &[D],
        frames: &AssemblyFrames<D>,
    ) -> Option<usize> {
        of_either!(self, rods => rods.passed_obstacle(before, now, frames))
    }

    /// Index in `[[rod_contacts]]` of the first contact of rods of which one passes through the other in a step from
    /// `before` to `now`; `None` without one.
    fn passed_rod(&self, before: &[D], now: &[D], frames: &AssemblyFrames<D>) -> Option<usize> {
        of_either!(self, rods => rods.passed_rod(before, now, frames))
    }

    /// Whether contacts have damping or friction.
    #[inline(always)]
    fn has_contact_losses(&self) -> bool {
        of_either!(self, rods => rods.has_contact_losses())
    }

    /// Adds minus the damping and friction forces of contacts at `q`, N, to `forces`, those on carried nodes to the
    /// coordinates of bodies. If `tangent` is given, their derivatives by the unknowns at the end of the step, N/m, are
    /// added to it, which is then not symmetric. In space they are by increments of rotations.
    fn add_contact_losses(
        &self,
        q: &[D],
        frames: &AssemblyFrames<D>,
        velocities: StepVelocities<'_, D>,
        forces: &mut [D],
        tangent: Option<&mut AssemblyTangent<D>>,
    ) {
        match (self, tangent) {
            (Self::Plane(rods), Some(AssemblyTangent::Plane(tangent))) => {
                rods.add_contact_losses(q, frames, velocities, forces, Some(tangent));
            }
            (Self::Space(rods), Some(AssemblyTangent::Space(tangent))) => {
                rods.add_contact_losses(q, frames, velocities, forces, Some(tangent));
            }
            (Self::Plane(rods), _) => rods.add_contact_losses(q, frames, velocities, forces, None),
            (Self::Space(rods), _) => rods.add_contact_losses(q, frames, velocities, forces, None),
        }
    }

    /// Minus the forces of each contact on all unknowns, N, damping and friction included, at the unknowns `q` and
    /// velocities `v`: one list per contact.
    fn contact_gradients(&self, [q, v]: [&[D]; 2], frames: &AssemblyFrames<D>) -> Vec<Vec<D>> {
        of_either!(self, rods => rods.contact_gradients([q, v], frames))
    }

    /// Whether an obstacle has a prescribed motion.
    fn has_moved_obstacles(&self) -> bool {
        of_either!(self, rods => rods.has_moved_obstacles())
    }

    /// Moves the obstacles to their places at the end of a step between two times, s.
    fn move_obstacles(&mut self, interval: [f64; 2]) {
        of_either!(self, rods => rods.move_obstacles(interval));
    }

    /// The work, J, of the obstacles in their movement between two times, s, with the forces at the unknowns `q` and
    /// velocities `v`.
    fn obstacle_work(
        &self,
        interval: [f64; 2],
        [q, v]: [&[D]; 2],
        frames: &AssemblyFrames<D>,
    ) -> f64 {
        of_either!(self, rods => rods.obstacle_work(interval, [q, v], frames))
    }

    /// Energies at `q`, J, summed over the rods: stretching, bending, twisting and potential of loads. Joint springs
    /// count as bending, loads on bodies as potential, and contacts as user-defined energies. The kinetic one is zero.
    fn energies(&self, q: &[D], frames: &AssemblyFrames<D>) -> Energies {
        of_either!(self, rods => rods.energies(q, frames))
    }

    /// Overwrites `strains` with those of all rods, one rod after the other, each first its edges, then its joints. The
    /// rotations of joint springs follow, rad.
    fn strains(&self, q: &[D], frames: &AssemblyFrames<D>, strains: &mut Vec<D>) {
        of_either!(self, rods => rods.strains(q, frames, strains));
    }

    /// Whether a joint spring has a viscous moment.
    fn has_viscous_joints(&self) -> bool {
        of_either!(self, rods => rods.has_viscous_springs())
    }

    /// A copy without loads, natural strains and stiffness of joint springs, whose elements act as dashpots: strains
    /// stand for strain rates.
    fn dashpots(&self) -> Self {
        match self {
            Self::Plane(rods) => Self::Plane(rods.dashpots()),
            Self::Space(rods) => Self::Space(rods.dashpots()),
        }
    }

    /// Energies of stretching, bending and twisting, J, by `strains` of the elements of all rods, with natural strains
    /// taken as zero. Joint springs have no part.
    fn strain_energies(&self, strains: &[D]) -> [D; 3] {
        of_either!(self, rods => rods.strain_energies(strains))
    }

    /// Energies of springs in Maxwell branches by their `stretches`, J, with the damping factor of each rod.
    fn branch_energies(&self, stretches: &[D]) -> [D; 3] {
        of_either!(self, rods => rods.branch_energies(stretches))
    }

    /// Overwrites the laws of all rods and joint springs with those of `elastic` under the viscous stress, as
    /// stiffnesses and natural strains. The lists of `viscosity` have the strains of all rods in order, then those of
    /// joint springs, which change only with `viscosity.own`.
    fn set_viscous(&mut self, elastic: &Self, viscosity: &Viscosity<D>) {
        match (self, elastic) {
            (Self::Plane(rods), Self::Plane(elastic)) => rods.set_viscous(elastic, viscosity),
            (Self::Space(rods), Self::Space(elastic)) => rods.set_viscous(elastic, viscosity),
            _ => debug_assert!(false, "an assembly of the other layout"),
        }
    }

    /// Overwrites the laws of all rods with those of `dashpots`: every stiffness times its factor, the shifts as
    /// natural strains. Joint springs do not change.
    fn set_dashpots(&mut self, dashpots: &Self, viscosity: &Viscosity<D>) {
        match (self, dashpots) {
            (Self::Plane(rods), Self::Plane(own)) => rods.set_dashpots(own, viscosity),
            (Self::Space(rods), Self::Space(own)) => rods.set_dashpots(own, viscosity),
            _ => debug_assert!(false, "an assembly of the other layout"),
        }
    }
}
