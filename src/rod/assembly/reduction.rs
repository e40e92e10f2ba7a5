//! Derivatives by the coordinates of bodies through the nodes that the bodies carry (chain rule), for one rod.
//!
//! `reduce_gradient` adds `J' f`, N, to the gradient by the bodies, with the derivatives `J` of the carried unknowns
//! and the gradient `f` of the rod by them. `reduce_tangent` adds `J' A J`, with the tangent `A` of the rod, and the
//! second derivatives of the carried unknowns times `f`, N/m, to the matrix of the bodies. It overwrites the couplings
//! `A J` between the rows beside an end and the coordinates that carry it. Both then remove the carried and fixed
//! unknowns from the rod: their gradient becomes zero, and their rows and columns those of the identity.

use crate::numerics::envelope::Envelope;
use crate::numerics::scalar::RodScalar;
use crate::numerics::tangent::Tangent;
use crate::rod::assembly::carrying::CarriedMotion;
use crate::rod::assembly::coupling::Coupling;
use crate::rod::assembly::layout::AssemblyLayout;
use crate::rod::assembly::member::{Member, MotionOf};
use crate::rod::assembly::tangent::MemberTangent;

/// Adds to `bodies`, N, the derivatives by the coordinates of bodies: the gradient `rod` at each carried node times the
/// derivatives of its unknowns (`carried`, in the order of the nodes). Entries of carried and fixed nodes in `rod`
/// become zero.
pub(super) fn reduce_gradient<D: RodScalar, L: AssemblyLayout>(
    member: &Member<D, L>,
    carried: &[MotionOf<D, L>],
    rod: &mut [D],
    bodies: &mut [D],
) {
    for (node, motion) in member.carried().zip(carried) {
        let force = &rod[L::STRIDE * node.node..][..node.width];
        for k in 0..motion.count() {
            bodies[motion.coordinate(k)] += inner(motion.slope(k), force);
        }
    }
    member.unknowns_without_effect().for_each(|i| rod[i] = D::from(0.0));
}

/// The inner product `a.b` over the length of `b`; `a` may be longer.
#[inline(always)]
fn inner<D: RodScalar>(a: &[D], b: &[D]) -> D {
    let mut sum = a[0] * b[0];
    for c in 1..b.len() {
        sum += a[c] * b[c];
    }
    sum
}

/// Largest number of unknowns of a carried node.
const WIDTH: usize = 4;

/// Adds to `bodies`, N/m, the second derivatives by the coordinates of bodies through the carried nodes of a rod, from
/// its band in `own` and its `gradient`. Overwrites the couplings in `own`: derivatives between the rows beside an end
/// and its coordinates. Rows and columns of carried and fixed nodes in the band become those of the identity.
pub(super) fn reduce_tangent<D: RodScalar, L: AssemblyLayout>(
    member: &Member<D, L>,
    carried: &[MotionOf<D, L>],
    gradient: &[D],
    own: &mut MemberTangent<D, L::Band<D>>,
    bodies: &mut Envelope<D>,
) {
    let (zero, mut first) = (D::from(0.0), 0);
    for (attachment, coupling) in member.attachments.iter().zip(&mut own.couplings) {
        let Coupling { rows, columns, entries } = coupling;
        entries.fill(zero);
        let moved = &carried[first..first + attachment.nodes.len()];
        first += attachment.nodes.len();
        for (node, motion) in attachment.nodes.iter().zip(moved) {
            let (place, width) = (L::STRIDE * node.node, node.width);
            // Between the rows beside the end and the coordinates.
            for (r, row) in rows.clone().enumerate() {
                let mut by = [zero; WIDTH];
                (0..width).for_each(|c| by[c] = own.band.get(row, place + c));
                for k in 0..columns.len() {
                    entries[k * rows.len() + r] += inner(motion.slope(k), &by[..width]);
                }
            }
            // Between coordinates, by the curvature of the position.
            motion.add_curvature(&gradient[place..place + width], |i, j, entry| {
                bodies.add(i, j, entry);
            });
            // And by pairs of carried nodes.
            for (other, also) in attachment.nodes.iter().zip(moved) {
                let at = L::STRIDE * other.node;
                let mut block = [[zero; WIDTH]; WIDTH];
                for c in 0..other.width {
                    (0..width).for_each(|r| block[c][r] = own.band.get(place + r, at + c));
                }
                for (k, i) in columns.iter().enumerate() {
                    let mut by = [zero; WIDTH];
                    (0..other.width)
                        .for_each(|c| by[c] = inner(motion.slope(k), &block[c][..width]));
                    for (l, j) in columns.iter().enumerate() {
                        if j <= i {
                            bodies.add(*i, *j, inner(also.slope(l), &by[..other.width]));
                        }
                    }
                }
            }
        }
    }
    member.unknowns_without_effect().for_each(|i| own.band.eliminate_row_and_column(i));
}
