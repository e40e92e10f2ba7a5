//! Damping and friction of contacts in an assembly: forces (N) and their derivatives (N/m) in the equations of a step.
//!
//! The velocities of carried nodes are `J v`, with the derivatives `J` of their unknowns by the coordinates of bodies
//! and the velocities `v` of these; fixed nodes have none. The forces `f` on carried nodes act on the coordinates as
//! `J' f` (chain rule). The derivatives `A` of the forces of one rod, with velocities that follow the unknowns, are not
//! symmetric, and so are those by the coordinates:
//!
//! ```text
//! columns of the coordinates:  D = A J + V E,     rows:  J' A,     both:  J' D + (dJ' f)
//! ```
//!
//! `V` are derivatives by the velocities. `E` is the change of `J v` beyond that of the unknowns times the slope of the
//! velocities ([`carried_velocities`](crate::rod::assembly::carrying::CarryingBodies::velocity_slopes)). In space
//! derivatives are by increments of rotations. The formulas of one rod are those of
//! [`contact_loss`](crate::energy::contact_loss). Rods that touch nothing cost an evaluation of their distances only.
//! Losses of contacts of rods with each other, whose edges are not carried, are those of `pair_losses`.

use crate::numerics::envelope::Envelope;
use crate::numerics::scalar::RodScalar;
use crate::numerics::tangent::{Tangent, UnsymmetricTangent};
use crate::rod::assembly::attachment::CarriedNode;
use crate::rod::assembly::carrying::{CarriedMotion, CarryingBodies, VelocitySlopes};
use crate::rod::assembly::coupling::Coupling;
use crate::rod::assembly::frames::AssemblyFrames;
use crate::rod::assembly::joined_rods::{JoinedRods, TangentOfLayout, keep_placed};
use crate::rod::assembly::layout::AssemblyLayout;
use crate::rod::assembly::member::{Member, MotionOf, RodUnknowns};
use crate::rod::assembly::reduction::reduce_gradient;
use crate::rod::assembly::skew_part::MemberSkewPart;
use crate::rod::assembly::tangent::BorderedTangent;
use crate::rod::{Rod, StepVelocities};
use std::cmp::Ordering;

impl<D: RodScalar, L: AssemblyLayout> JoinedRods<D, L> {
    /// Whether contacts have damping or friction.
    pub fn has_contact_losses(&self) -> bool {
        self.contacts.have_losses()
            || self.members.iter().any(|member| member.rod.has_contact_losses())
    }

    /// Adds minus the damping and friction forces of contacts at the unknowns `q`, N, to `forces`, which contains the
    /// gradient. Those on carried nodes are added to the coordinates of bodies. If `tangent` is given, their
    /// derivatives by the unknowns at the end of a step, N/m, are added to it. Velocities of rotations in space are
    /// angular velocities in their axes times their scale, and derivatives by them are by increments. With `tangent`
    /// the slope of the velocities is not zero.
    pub fn add_contact_losses(
        &self,
        q: &[D],
        frames: &AssemblyFrames<D>,
        velocities: StepVelocities<'_, D>,
        forces: &mut [D],
        mut tangent: Option<&mut TangentOfLayout<D, L>>,
    ) {
        let ((rods, bodies), z) = (forces.split_at_mut(self.first), &q[self.first..]);
        let z_rates = StepVelocities { velocity: &velocities.velocity[self.first..], ..velocities };
        if let Some(BorderedTangent { members, bodies, skew, .. }) = tangent.as_deref_mut() {
            let couplings = members.iter().map(|own| &own.couplings);
            skew.allocate(members.iter().map(|own| &own.band), couplings, bodies);
        }
        let [mut placed, mut moving] = self.contacts.borrow_moving([q, velocities.velocity]);
        let mut k = 0;
        self.for_each_moving([q, velocities.velocity], frames, |member, own_frames, room| {
            let RodUnknowns { q, carried, other, elements, slopes, .. } = room;
            keep_placed(member, q, &mut placed);
            keep_placed(member, other, &mut moving);
            let rates = StepVelocities { velocity: &other[..], ..velocities };
            let own = &mut rods[member.range.clone()];
            // Entries of carried nodes become those of the losses alone.
            member.unknowns_without_effect().for_each(|i| own[i] = D::from(0.0));
            match tangent.as_deref_mut() {
                None => member.rod.add_contact_losses(q, own_frames, rates, own, None),
                Some(tangent) => {
                    let bands = &mut tangent.skew.members[k].bands;
                    bands[0].clear();
                    let to = Some(&mut bands[0]);
                    member.rod.add_contact_losses(q, own_frames, rates, own, to);
                    // Without a touching edge nothing was added.
                    if !bands[0].is_symmetric() {
                        bands[1].clear();
                        // The forces once more, of which the list is not used.
                        elements.clear();
                        elements.resize(q.len(), D::from(0.0));
                        let still = StepVelocities { slope: D::from(0.0), ..rates };
                        let to = Some(&mut bands[1]);
                        member.rod.add_contact_losses(q, own_frames, still, elements, to);
                        self.find_velocity_slopes(member, z, frames, z_rates, carried, slopes);
                        add_to_tangent(member, carried, slopes, own, tangent, k);
                    }
                }
            }
            reduce_gradient(member, carried, own, bodies);
            k += 1;
        });
        // After the rods, whose reduction removes the forces on fixed nodes.
        let rates = StepVelocities { velocity: &moving[..], ..velocities };
        self.contacts.add_losses(&placed, rates, rods, tangent);
        self.contacts.return_moving([placed, moving]);
    }

    /// Overwrites `slopes` with those of the velocities of all carried nodes of a rod over the slope of `rates`, the
    /// velocities of all bodies at the coordinates `z`.
    fn find_velocity_slopes(
        &self,
        member: &Member<D, L>,
        z: &[D],
        frames: &AssemblyFrames<D>,
        rates: StepVelocities<'_, D>,
        carried: &[MotionOf<D, L>],
        slopes: &mut Vec<VelocitySlopes<D>>,
    ) {
        slopes.clear();
        let mut first = 0;
        for attachment in &member.attachments {
            let nodes = &carried[first..first + attachment.nodes.len()];
            first += attachment.nodes.len();
            self.bodies.velocity_slopes(z, frames, rates, attachment, nodes, slopes);
        }
        let by = rates.slope.recip();
        slopes.iter_mut().flatten().flatten().for_each(|slope| *slope *= by);
    }
}

/// Adds the derivatives of the forces on rod `k` to `tangent`. They are in both bands of its skew part: `A`, and those
/// at constant velocities. `carried` are the carried nodes with the slopes of their velocities over that of the step,
/// and `forces` has the forces on these nodes.
fn add_to_tangent<D: RodScalar, L: AssemblyLayout>(
    member: &Member<D, L>,
    carried: &[MotionOf<D, L>],
    slopes: &[VelocitySlopes<D>],
    forces: &[D],
    tangent: &mut TangentOfLayout<D, L>,
    k: usize,
) {
    let BorderedTangent { members, bodies, skew, .. } = tangent;
    skew.activate();
    let (own, MemberSkewPart { couplings, bands }) = (&mut members[k], &mut skew.members[k]);
    own.band.add_scaled(&bands[0], 1.0);
    member.unknowns_without_effect().for_each(|i| own.band.eliminate_row_and_column(i));
    let mut first = 0;
    let ends = member.attachments.iter().zip(own.couplings.iter_mut().zip(couplings));
    for (attachment, (coupling, differences)) in ends {
        let all = first..first + attachment.nodes.len();
        first = all.end;
        let (carried, slopes) = (&carried[all.clone()], &slopes[all]);
        let end = TouchingEnd::<D, L> { nodes: &attachment.nodes, carried, slopes, bands };
        end.add_couplings(coupling, differences);
        end.add_to_bodies(&coupling.columns, forces, [&mut *bodies, &mut skew.bodies]);
    }
}

/// A carried end of a rod that touches an obstacle, with the derivatives of the forces on the rod.
struct TouchingEnd<'a, D: RodScalar, L: AssemblyLayout> {
    nodes: &'a [CarriedNode<L::Place<D>>],
    /// The nodes with their derivatives by the coordinates.
    carried: &'a [MotionOf<D, L>],
    /// The slopes of their velocities over that of the step.
    slopes: &'a [VelocitySlopes<D>],
    /// Derivatives with velocities that follow the unknowns, `A`, and at constant velocities.
    bands: &'a [L::Band<D>; 2],
}

impl<D: RodScalar, L: AssemblyLayout> TouchingEnd<'_, D, L> {
    /// The derivative of the force on unknown `i` of the rod by the coordinate with number `k`: `A J + V E`.
    fn by_coordinate(&self, i: usize, k: usize) -> D {
        let mut sum = D::from(0.0);
        for ((node, carried), slopes) in self.nodes.iter().zip(self.carried).zip(self.slopes) {
            let (place, unknowns) = (L::STRIDE * node.node, carried.slope(k));
            for c in 0..node.width {
                let [all, still] = [0, 1].map(|band| self.bands[band].get(i, place + c));
                sum += all * unknowns[c] + (all - still) * slopes[k][c];
            }
        }
        sum
    }

    /// The sum over all carried unknowns of their derivatives by the coordinate with number `k`, times `force` of each:
    /// an entry of `J' f`.
    fn on_coordinate(&self, k: usize, force: impl Fn(usize) -> D) -> D {
        let mut sum = D::from(0.0);
        for (node, carried) in self.nodes.iter().zip(self.carried) {
            for c in 0..node.width {
                sum += carried.slope(k)[c] * force(L::STRIDE * node.node + c);
            }
        }
        sum
    }

    /// Adds the entries between the rows beside this end and its coordinates to `coupling`, and those at the transposed
    /// places less these to `differences`.
    fn add_couplings(&self, coupling: &mut Coupling<D>, differences: &mut Coupling<D>) {
        let (first, count) = (coupling.rows.start, coupling.rows.len());
        for k in 0..coupling.columns.len() {
            for r in 0..count {
                let by = self.by_coordinate(first + r, k);
                let on = self.on_coordinate(k, |i| self.bands[0].get(i, first + r));
                coupling.entries[k * count + r] += by;
                differences.entries[k * count + r] += on - by;
            }
        }
    }

    /// Adds the entries between the coordinates with the indices `columns` to the matrix of the bodies and to its skew
    /// part. `forces` has the forces on carried nodes.
    fn add_to_bodies(
        &self,
        columns: &[usize],
        forces: &[D],
        [bodies, skew]: [&mut Envelope<D>; 2],
    ) {
        let mut add = |i: usize, j: usize, entry: D| match i.cmp(&j) {
            Ordering::Equal => bodies.add(i, i, entry),
            // Above the diagonal the matrix is what is below it plus the skew part.
            Ordering::Greater => {
                bodies.add(i, j, entry);
                skew.add(i, j, -entry);
            }
            Ordering::Less => skew.add(j, i, entry),
        };
        for (k, i) in columns.iter().enumerate() {
            for (l, j) in columns.iter().enumerate() {
                add(*i, *j, self.on_coordinate(k, |unknown| self.by_coordinate(unknown, l)));
            }
        }
        for (node, carried) in self.nodes.iter().zip(self.carried) {
            carried.add_turned(&forces[L::STRIDE * node.node..][..node.width], &mut add);
        }
    }
}
