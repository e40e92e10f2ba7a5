//! Rods whose ends are carried by bodies ([`JoinedRods`]), in the plane or in space: gradient, tangent, energies and
//! checks.
//!
//! Unknowns are those of all rods, one rod after the other, and then the coordinates of the bodies. Each evaluation at
//! given unknowns copies the unknowns of each rod, places its carried and fixed nodes in the copy, and evaluates the
//! rod. Derivatives by carried nodes are added to those by the bodies. The unknowns of carried and fixed nodes have no
//! effect: gradients there are zero, and rows and columns of the tangent are those of the identity. In space the
//! unknowns of each rod and body begin at a multiple of four, and the gaps have no effect either.
//! `unknowns_without_effect` lists all of these. `derivatives` selects hand-derived or num-dual derivatives of the
//! elements.
//!
//! - `place_carried` and `set_carried_rates` overwrite the entries of carried and fixed nodes with positions and
//!   velocities that follow from the bodies; gaps stay.
//! - `gradient` (N, N m) and `tangent_with_tensions` (N/m, also with expected axial forces) overwrite their results;
//!   `tensions_after` predicts axial forces, N, after a change of the unknowns.
//! - `energies` (J; the kinetic one is zero, user-defined ones are those of contacts), `strains`, and
//!   `strain_energies` and `branch_energies` of given strains.
//! - `passed_obstacle`, `has_moved_obstacles`, `move_obstacles`, `obstacle_work` (J) and `contact_gradients` (N) are
//!   those of contacts with obstacles. Damping and friction in the equations of a step are in `contact_losses`.
//! - Contacts of rods with each other (`contact_pairs`) are added to gradient, tangent and energy; `passed_rod` is the
//!   first of which one rod passes through the other, and `contacts_on_nodes` are these contacts for given nodes.
//! - `folded_node` and `over_rotated_edge` return the first fold or large rotation of a step, `None` without one.
//! - `move_frames` moves the frames of rods and rotations to other unknowns.
//! - `mass` is the lumped mass of every unknown (arbitrary and positive for those without effect), `zero_tangent` a
//!   matrix of the sparsity pattern. `members`, `bodies` and `body_coordinates` (their range) return parts.
//!   `has_viscous_springs` returns whether a joint spring has a viscous moment.
//! - `dashpots` returns a copy for the viscous stress; `set_viscous` and `set_dashpots` overwrite laws for that of a
//!   step.

use crate::energy::Derivatives;
use crate::numerics::envelope::Envelope;
use crate::numerics::scalar::RodScalar;
use crate::rod::assembly::carrying::{CarryingBodies, MemberRod};
use crate::rod::assembly::contact_pairs::ContactPairs;
use crate::rod::assembly::frames::AssemblyFrames;
use crate::rod::assembly::layout::AssemblyLayout;
use crate::rod::assembly::member::{Member, MemberWorkspace, RodUnknowns};
use crate::rod::assembly::reduction::{reduce_gradient, reduce_tangent};
use crate::rod::assembly::rod_couplings::RodCouplings;
use crate::rod::assembly::skew_part::SkewPart;
use crate::rod::assembly::tangent::{BorderedTangent, MemberTangent};
use crate::rod::assembly::touching_edges::ContactLaw;
use crate::rod::{Energies, ReferenceFrames, Rod, Viscosity};
use std::ops::Range;

/// The tangent of an assembly of a layout.
pub(super) type TangentOfLayout<D, L> = BorderedTangent<D, <L as AssemblyLayout>::Band<D>>;

/// Rods with the bodies that join them.
#[derive(Clone, Debug)]
pub struct JoinedRods<D: RodScalar, L: AssemblyLayout> {
    pub(super) members: Vec<Member<D, L>>,
    pub(super) bodies: L::Bodies<D>,
    /// Index of the first coordinate of the bodies in the unknowns.
    pub(super) first: usize,
    /// Mass of every unknown, kg; without a meaning for carried and fixed nodes.
    mass: Vec<D>,
    /// Contacts of the rods with each other.
    pub(super) contacts: ContactPairs<D>,
    room: MemberWorkspace<D, L>,
}

/// Copies the unknowns `q` of a rod, with its carried and fixed nodes, or their velocities, to those of all rods,
/// unless that list is empty.
pub(super) fn keep_placed<D: RodScalar, L: AssemblyLayout>(
    member: &Member<D, L>,
    q: &[D],
    all: &mut [D],
) {
    if !all.is_empty() {
        all[member.range.clone()].copy_from_slice(q);
    }
}

impl<D: RodScalar, L: AssemblyLayout> JoinedRods<D, L> {
    /// An assembly of rods, whose `range`s follow each other, each from a multiple of the stride on, and of bodies with
    /// `coordinates` in all. Unknowns without effect get the first positive mass of a body, else of a rod, else 1, so
    /// that no mass is zero.
    pub fn new(members: Vec<Member<D, L>>, bodies: L::Bodies<D>, coordinates: usize) -> Self {
        let end = members.last().map_or(0, |member| member.range.end);
        let first = end.next_multiple_of(L::STRIDE);
        let mut mass = vec![D::from(0.0); first + coordinates];
        for member in &members {
            mass[member.range.clone()].copy_from_slice(member.rod.mass());
        }
        bodies.masses(&mut mass[first..]);
        // Unknowns without effect have the mass of a body, so that none is zero.
        let any = mass[first..].iter().chain(&mass).copied().find(|mass| mass.value() > 0.0);
        let contacts = ContactPairs::new(Vec::new(), L::STRIDE);
        let room = MemberWorkspace::default();
        let mut rods = Self { members, bodies, first, mass, contacts, room };
        let tied: Vec<usize> = rods.unknowns_without_effect().collect();
        tied.into_iter().for_each(|i| rods.mass[i] = any.unwrap_or(D::from(1.0)));
        rods
    }

    /// The assembly with contacts of the rods by these laws.
    #[must_use]
    pub fn with_contacts(self, laws: Vec<ContactLaw<D>>) -> Self {
        Self { contacts: ContactPairs::new(laws, L::STRIDE), ..self }
    }

    /// The rods with their ranges of unknowns and their carried and fixed nodes.
    pub fn members(&self) -> &[Member<D, L>] {
        &self.members
    }

    /// The bodies and joint springs.
    pub fn bodies(&self) -> &L::Bodies<D> {
        &self.bodies
    }

    /// Whether a joint spring has a viscous moment.
    pub fn has_viscous_springs(&self) -> bool {
        self.bodies.has_viscous_springs()
    }

    /// Range of the coordinates of bodies in the unknowns.
    pub fn body_coordinates(&self) -> Range<usize> {
        self.first..self.mass.len()
    }

    /// Indices of the unknowns without effect. For each rod in order: unknowns of carried nodes, of fixed nodes, and
    /// the gap after the rod. Last the idle coordinates of bodies.
    pub fn unknowns_without_effect(&self) -> impl Iterator<Item = usize> {
        let idle = self.bodies.idle_coordinates().into_iter().map(|i| self.first + i);
        let members = self.members.iter().flat_map(|member| {
            let gap = member.range.end..member.range.end.next_multiple_of(L::STRIDE);
            member.unknowns_without_effect().map(|i| member.range.start + i).chain(gap)
        });
        members.chain(idle)
    }

    /// Overwrites the unknowns of carried nodes in `q` with those that follow from the coordinates of bodies in `q`.
    /// Fixed nodes get their positions, carried and fixed angles become zero.
    pub fn place_carried(&self, q: &mut [D], frames: &AssemblyFrames<D>) {
        let (rods, z) = q.split_at_mut(self.first);
        let mut carried = Vec::new();
        for member in &self.members {
            member.place(&self.bodies, z, frames, &mut rods[member.range.clone()], &mut carried);
        }
    }

    /// Overwrites the entries of carried nodes in `rates` (velocities of all unknowns at `q`) with those that follow
    /// from the entries of the bodies' coordinates. Entries of fixed nodes become zero.
    pub fn set_carried_rates(&self, q: &[D], frames: &AssemblyFrames<D>, rates: &mut [D]) {
        let (rods, z_rates) = rates.split_at_mut(self.first);
        let (z, mut carried) = (&q[self.first..], Vec::new());
        // Derivatives of carried nodes are by increments of rotations, rates are those of coordinates.
        let increments = self.bodies.increments(z, frames, z_rates);
        for member in &self.members {
            member.carry(&self.bodies, z, frames, &mut carried);
            member.set_rates(&carried, &increments, &mut rods[member.range.clone()]);
        }
    }

    /// Calls `visit` for each rod in order with its frames and work space. The latter has a copy of the rod's unknowns
    /// at `q` with carried and fixed nodes placed, and the carried nodes with derivatives. Frames of carried edges are
    /// those of their bodies.
    pub(super) fn for_each_placed(
        &self,
        q: &[D],
        frames: &AssemblyFrames<D>,
        mut visit: impl FnMut(&Member<D, L>, &L::RodFrames<D>, &mut RodUnknowns<D, L>),
    ) {
        // The lists of the work space are kept between evaluations, so that steps do not allocate them.
        let (mut room, z) = (self.room.borrow(), &q[self.first..]);
        for (k, member) in self.members.iter().enumerate() {
            let RodUnknowns { q: own, carried, .. } = &mut *room;
            own.clear();
            own.extend_from_slice(&q[member.range.clone()]);
            member.place(&self.bodies, z, frames, own, carried);
            member.copy_frames(k, &self.bodies, z, frames, &mut room.frames);
            // Taken out for the call: `visit` gets the frames and, mutable, the rest of the work space.
            if let Some(rod_frames) = room.frames.take() {
                visit(member, &rod_frames, &mut room);
                room.frames = Some(rod_frames);
            }
        }
    }

    /// Calls `visit` for each rod as [`for_each_placed`](Self::for_each_placed) does, with the velocities of its
    /// unknowns in the list `other` of the work space. They are those of `v`, of carried nodes those that follow from
    /// the bodies.
    pub(super) fn for_each_moving(
        &self,
        [q, v]: [&[D]; 2],
        frames: &AssemblyFrames<D>,
        mut visit: impl FnMut(&Member<D, L>, &L::RodFrames<D>, &mut RodUnknowns<D, L>),
    ) {
        let (rods, z_rates) = v.split_at(self.first);
        let increments = self.bodies.increments(&q[self.first..], frames, z_rates);
        self.for_each_placed(q, frames, |member, own_frames, room| {
            let RodUnknowns { carried, other, .. } = &mut *room;
            other.clear();
            other.extend_from_slice(&rods[member.range.clone()]);
            member.set_rates(carried, &increments, other);
            visit(member, own_frames, room);
        });
    }

    /// The first place that `find` returns for a rod, in order, from its frames and its unknowns `before` and `now`.
    /// Its index is increased by the sum of `count` of the rods before. `None` if `find` returns none for every rod.
    fn find_place(
        &self,
        [before, now]: [&[D]; 2],
        frames: &AssemblyFrames<D>,
        count: impl Fn(&Member<D, L>) -> usize,
        find: impl Fn(&Member<D, L>, &L::RodFrames<D>, &[D], &[D]) -> Option<usize>,
    ) -> Option<usize> {
        let (mut found, mut first) = (None, 0);
        self.for_each_placed(now, frames, |member, own, room| {
            let RodUnknowns { q, other, other_carried, .. } = room;
            // The visit of all rods cannot end early.
            if found.is_some() {
                return;
            }
            other.clear();
            other.extend_from_slice(&before[member.range.clone()]);
            member.place(&self.bodies, &before[self.first..], frames, other, other_carried);
            found = find(member, own, other, q).map(|place| first + place);
            first += count(member);
        });
        found
    }
}

impl<D: RodScalar, L: AssemblyLayout> JoinedRods<D, L> {
    /// A zero matrix with the sparsity pattern of the tangent. Coordinates of bodies that carry the same rod are
    /// coupled: their rows in the envelope begin at the least of these coordinates.
    pub fn zero_tangent(&self) -> TangentOfLayout<D, L> {
        let member = |member: &Member<D, L>| MemberTangent {
            band: member.rod.zero_tangent(),
            range: member.range.clone(),
            couplings: member.couplings(&self.bodies),
        };
        let members: Vec<MemberTangent<D, L::Band<D>>> = self.members.iter().map(member).collect();
        // The elimination of a rod couples all coordinates of its ends: their rows begin at the least of them.
        let mut first: Vec<usize> = (0..self.mass.len() - self.first).collect();
        for member in &members {
            let all = || member.couplings.iter().flat_map(|coupling| &coupling.columns);
            let Some(least) = all().min() else { continue };
            all().for_each(|i| first[*i] = first[*i].min(*least));
        }
        let bodies = Envelope::zeros(first);
        let (blocks, skew) = (Vec::new(), SkewPart::none());
        let between = RodCouplings::none(L::STRIDE.min(3));
        BorderedTangent { members, first: self.first, bodies, blocks, skew, between }
    }

    /// Lumped mass of every unknown, kg (kg m^2 for angles of edges). Those without effect have an arbitrary positive
    /// one.
    pub fn mass(&self) -> &[D] {
        &self.mass
    }

    /// Overwrites `gradient` with that of elastic energy less work of the loads at `q`, N (N m for angles). Derivatives
    /// by carried nodes are added to those by the bodies; carried and fixed unknowns and gaps have zeros.
    pub fn gradient(
        &self,
        q: &[D],
        frames: &AssemblyFrames<D>,
        derivatives: Derivatives,
        gradient: &mut [D],
    ) {
        let ((rods, bodies), z) = (gradient.split_at_mut(self.first), &q[self.first..]);
        self.bodies.gradient(z, frames, bodies);
        let mut placed = self.contacts.borrow_placed(q);
        self.for_each_placed(q, frames, |member, own_frames, RodUnknowns { q, carried, .. }| {
            keep_placed(member, q, &mut placed);
            let own = &mut rods[member.range.clone()];
            member.rod.gradient(q, own_frames, derivatives, own);
            reduce_gradient(member, carried, own, bodies);
        });
        self.clear_gaps(rods);
        self.contacts.add_gradient(&placed, rods);
        self.contacts.return_placed(placed);
        self.bodies.convert_derivatives::<L::Band<D>>(z, frames, bodies, None);
    }

    /// Overwrites `gradient` as `gradient` does, and `tangent`, N/m, with its derivative by the unknowns; unsymmetric
    /// blocks are removed. `tensions` of the edges of all rods, N, if given, replace the axial forces in the geometric
    /// stiffness.
    pub fn tangent_with_tensions(
        &self,
        q: &[D],
        frames: &AssemblyFrames<D>,
        derivatives: Derivatives,
        tensions: Option<&[D]>,
        gradient: &mut [D],
        tangent: &mut TangentOfLayout<D, L>,
    ) {
        let ((rods, bodies), z) = (gradient.split_at_mut(self.first), &q[self.first..]);
        let BorderedTangent { members, bodies: corner, blocks, skew, between, .. } = &mut *tangent;
        blocks.clear();
        between.clear();
        skew.clear();
        self.bodies.gradient(z, frames, bodies);
        corner.clear();
        self.bodies.add_tangent(z, frames, |i, j, entry| corner.add(i, j, entry));
        let (mut members, mut edges) = (members.iter_mut(), 0);
        let mut placed = self.contacts.borrow_placed(q);
        self.for_each_placed(q, frames, |member, own_frames, RodUnknowns { q, carried, .. }| {
            keep_placed(member, q, &mut placed);
            let Some(own) = members.next() else { return };
            let forces = &mut rods[member.range.clone()];
            let count = member.rod.edges();
            let tensions = tensions.map(|all| &all[edges..edges + count]);
            edges += count;
            let band = &mut own.band;
            member.rod.tangent_with_tensions(q, own_frames, derivatives, tensions, forces, band);
            // The tangent first: it needs the forces on carried nodes, which the reduction of the gradient clears.
            reduce_tangent(member, carried, forces, own, corner);
            reduce_gradient(member, carried, forces, bodies);
        });
        self.clear_gaps(rods);
        self.contacts.add_tangent(&placed, rods, tangent);
        self.contacts.return_placed(placed);
        // Last: the conversion needs the complete gradient by increments, with the forces of all rods.
        self.bodies.convert_derivatives(z, frames, bodies, Some(tangent));
    }

    /// Sets the entries of the gap after each rod to zero in `rods`, a list of the unknowns of all rods.
    fn clear_gaps(&self, rods: &mut [D]) {
        for member in &self.members {
            let end = member.range.end;
            rods[end..end.next_multiple_of(L::STRIDE)].fill(D::from(0.0));
        }
    }

    /// Overwrites `tensions` with predicted axial forces, N, of the edges of all rods, one rod after the other: those
    /// at `q - change` plus their first-order change. Changes of carried nodes are those of their bodies.
    pub fn tensions_after(
        &self,
        change: &[D],
        q: &[D],
        frames: &AssemblyFrames<D>,
        tensions: &mut Vec<D>,
    ) {
        tensions.clear();
        let increments = self.bodies.increments(&q[self.first..], frames, &change[self.first..]);
        self.for_each_placed(q, frames, |member, own_frames, room| {
            let RodUnknowns { q, carried, other, elements, .. } = room;
            other.clear();
            other.extend_from_slice(&change[member.range.clone()]);
            member.set_rates(carried, &increments, other);
            member.rod.tensions_after(other, q, own_frames, elements);
            tensions.extend_from_slice(elements);
        });
    }

    /// The first inner node that a step from `before` to `now` has taken through a fold, by the criterion of
    /// [`Rod::folded_node`]. Its index counts the nodes of all rods before its own; `None` without a fold.
    pub fn folded_node(
        &self,
        before: &[D],
        now: &[D],
        frames: &AssemblyFrames<D>,
    ) -> Option<usize> {
        self.find_place([before, now], frames, Member::nodes, |member, own, a, b| {
            member.rod.folded_node(a, b, own)
        })
    }

    /// The first edge that turned by more than 45 degrees in a step from `before` to `now`. Its index counts the edges
    /// of all rods before its own; `None` without one.
    pub fn over_rotated_edge(
        &self,
        before: &[D],
        now: &[D],
        frames: &AssemblyFrames<D>,
    ) -> Option<usize> {
        let edges = |member: &Member<D, L>| member.nodes() - 1;
        self.find_place([before, now], frames, edges, |member, own, a, b| {
            member.rod.over_rotated_edge(a, b, own)
        })
    }

    /// The index of the first contact through whose obstacle some edge passes in a step from `before` to `now`; `None`
    /// without one.
    pub fn passed_obstacle(
        &self,
        before: &[D],
        now: &[D],
        frames: &AssemblyFrames<D>,
    ) -> Option<usize> {
        // All rods have the same contacts.
        if !self.members.iter().any(|member| member.rod.has_contacts()) {
            return None;
        }
        self.find_place(
            [before, now],
            frames,
            |_| 0,
            |member, own, a, b| member.rod.passed_obstacle(a, b, own),
        )
    }

    /// Index in `[[rod_contacts]]` of the first contact of rods of which one passes through the other in a step from
    /// `before` to `now`; `None` without one.
    pub fn passed_rod(&self, before: &[D], now: &[D], frames: &AssemblyFrames<D>) -> Option<usize> {
        if self.contacts.is_empty() {
            return None;
        }
        let [before, now] = [before, now].map(|q| {
            let mut placed = q.to_vec();
            self.place_carried(&mut placed, frames);
            placed
        });
        self.contacts.passed(&before, &now)
    }

    /// The contacts of the rods with each other, where the unknowns are the coordinates of the nodes of all rods.
    pub fn contacts_on_nodes(&self) -> ContactPairs<f64> {
        let ranges: Vec<Range<usize>> =
            self.members.iter().map(|member| member.range.clone()).collect();
        self.contacts.on_nodes(&ranges)
    }

    /// Whether an obstacle has a prescribed motion.
    pub fn has_moved_obstacles(&self) -> bool {
        self.members.iter().any(|member| member.rod.has_moved_obstacles())
    }

    /// Moves the obstacles to their places at the end of a step between two times, s.
    pub fn move_obstacles(&mut self, interval: [f64; 2]) {
        self.members.iter_mut().for_each(|member| member.rod.move_obstacles(interval));
    }

    /// The work, J, of the obstacles in their movement between two times, s, with the forces at the unknowns `q` and
    /// velocities `v`.
    pub fn obstacle_work(
        &self,
        interval: [f64; 2],
        [q, v]: [&[D]; 2],
        frames: &AssemblyFrames<D>,
    ) -> f64 {
        let mut work = 0.0;
        self.for_each_moving([q, v], frames, |member, own, RodUnknowns { q, other, .. }| {
            work += member.rod.obstacle_work(interval, [q, other], own);
        });
        work
    }

    /// Minus the forces of each contact on all nodes, N, damping and friction included, at the unknowns `q` and
    /// velocities `v`: one list of all unknowns per contact. Forces on carried nodes are in the entries of these nodes.
    pub fn contact_gradients(&self, [q, v]: [&[D]; 2], frames: &AssemblyFrames<D>) -> Vec<Vec<D>> {
        let mut gradients: Vec<Vec<D>> = Vec::new();
        self.for_each_moving([q, v], frames, |member, own, RodUnknowns { q, other, .. }| {
            let of_rod = member.rod.contact_gradients([q, other], own);
            gradients.resize_with(of_rod.len(), || vec![D::from(0.0); self.mass.len()]);
            for (all, own) in gradients.iter_mut().zip(of_rod) {
                all[member.range.clone()].copy_from_slice(&own);
            }
        });
        gradients
    }

    /// Moves the frames of all rods by parallel transport, and the references of all rotations, to `q`. Carried edges
    /// get the frames of their bodies. Energies at `q` do not change.
    pub fn move_frames(&self, frames: &mut AssemblyFrames<D>, q: &[D]) {
        let mut moved = Vec::with_capacity(frames.rods.len());
        self.for_each_placed(q, frames, |_, own_frames, RodUnknowns { q, .. }| {
            let mut own = own_frames.clone();
            own.move_to(q);
            moved.push(own);
        });
        // Stored after all visits, which read the frames from before.
        for (k, own) in moved.into_iter().enumerate() {
            L::store_frames(own, k, frames);
        }
        self.bodies.move_references(&q[self.first..], frames);
    }

    /// Energies at `q`, J, summed over the rods: stretching, bending, twisting and potential of loads. Joint springs
    /// count as bending, loads on bodies as potential, and contacts as user-defined energies. The kinetic one is zero.
    pub fn energies(&self, q: &[D], frames: &AssemblyFrames<D>) -> Energies {
        let mut sums = Energies::default();
        let mut placed = self.contacts.borrow_placed(q);
        self.for_each_placed(q, frames, |member, own_frames, RodUnknowns { q, .. }| {
            keep_placed(member, q, &mut placed);
            let own = member.rod.energies(q, own_frames);
            sums.stretch += own.stretch;
            sums.bend += own.bend;
            sums.twist += own.twist;
            sums.potential += own.potential;
            sums.own += own.own;
        });
        sums.own += self.contacts.energy(&placed).value();
        self.contacts.return_placed(placed);
        self.bodies.add_energies(&q[self.first..], frames, &mut sums);
        sums
    }

    /// Overwrites `strains` with those of all rods, one rod after the other, each first its edges, then its joints. The
    /// rotations of joint springs follow, rad.
    pub fn strains(&self, q: &[D], frames: &AssemblyFrames<D>, strains: &mut Vec<D>) {
        strains.clear();
        self.for_each_placed(q, frames, |member, own_frames, room| {
            let RodUnknowns { q, elements, .. } = room;
            member.rod.strains(q, own_frames, elements);
            strains.extend_from_slice(elements);
        });
        self.bodies.add_spring_strains(&q[self.first..], frames, strains);
    }

    /// A copy without loads, natural strains and stiffness of joint springs, whose elements act as dashpots: strains
    /// stand for strain rates.
    pub fn dashpots(&self) -> Self {
        let mut assembly = self.clone();
        assembly.members.iter_mut().for_each(|member| member.rod = member.rod.dashpots());
        assembly.bodies = self.bodies.passive();
        assembly.contacts = ContactPairs::new(Vec::new(), L::STRIDE);
        assembly
    }

    /// Energies of stretching, bending and twisting, J, by `strains` of the elements of all rods, with natural strains
    /// taken as zero. Joint springs have no part.
    pub fn strain_energies(&self, strains: &[D]) -> [D; 3] {
        let mut sums = [D::from(0.0); 3];
        for (member, range) in self.with_strains() {
            let own = member.rod.strain_energies(&strains[range]);
            (0..3).for_each(|kind| sums[kind] += own[kind]);
        }
        sums
    }

    /// Energies of Maxwell springs, J, with a stiffness of one times that of the rod, by their `stretches`, one per
    /// strain: stretching, bending and twisting. Each rod has its damping factor.
    pub fn branch_energies(&self, stretches: &[D]) -> [D; 3] {
        let mut sums = [D::from(0.0); 3];
        for (member, range) in self.with_strains() {
            let own = member.rod.strain_energies(&stretches[range]);
            (0..3).for_each(|kind| sums[kind] += own[kind] * member.damping_factor);
        }
        sums
    }

    /// Overwrites the laws of all rods and joint springs with those of `elastic` under the viscous stress, as
    /// stiffnesses and natural strains. The lists of `viscosity` have the strains of all rods in order, then those of
    /// joint springs, which change only with `viscosity.own`.
    pub fn set_viscous(&mut self, elastic: &Self, viscosity: &Viscosity<D>) {
        let mut first = 0;
        for (to, from) in self.members.iter_mut().zip(&elastic.members) {
            to.rod.set_viscous_part(&from.rod, from.viscosity(viscosity, first));
            first += from.rod.strain_count();
        }
        self.bodies.set_viscous_springs(&elastic.bodies, viscosity, first);
    }

    /// Overwrites the laws of all rods with those of `dashpots`: every stiffness times its factor, the shifts of
    /// `viscosity` as natural strains. Joint springs do not change.
    pub fn set_dashpots(&mut self, dashpots: &Self, viscosity: &Viscosity<D>) {
        let mut first = 0;
        for (to, from) in self.members.iter_mut().zip(&dashpots.members) {
            to.rod.set_dashpots_part(&from.rod, from.viscosity(viscosity, first));
            first += from.rod.strain_count();
        }
    }

    /// The rods in order, each with the range of its strains in the list of those of all rods.
    fn with_strains(&self) -> impl Iterator<Item = (&Member<D, L>, Range<usize>)> {
        let mut end = 0;
        self.members.iter().map(move |member| {
            let start = end;
            end += member.rod.strain_count();
            (member, start..end)
        })
    }
}
