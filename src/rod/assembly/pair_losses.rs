//! Damping and friction of contacts of rods with each other: forces (N) and their derivatives (N/m) in the equations of
//! a step.
//!
//! Pairs of edges are those of [`contact_pairs`](crate::rod::assembly::contact_pairs), their forces and derivatives
//! those of [`pair_loss`](crate::energy::pair_loss). Pairs that do not touch cost an evaluation of their distance only.
//!
//! Input: unknowns and velocities of the assembly with carried and fixed nodes at their places. `add_losses` adds minus
//! the forces, and their derivatives by the unknowns at the end of a step: those of the forces on an edge by its own
//! unknowns to the band of its rod, and those by the unknowns of the other edge to the couplings of rods. Neither is
//! symmetric. Fixed nodes and angles are left out.

use crate::energy::pair_loss::LossyPair;
use crate::numerics::scalar::RodScalar;
use crate::numerics::tangent::UnsymmetricTangent;
use crate::rod::StepVelocities;
use crate::rod::assembly::contact_pairs::ContactPairs;
use crate::rod::assembly::rod_couplings::{EdgeBlock, LARGEST_EDGE};
use crate::rod::assembly::tangent::BorderedTangent;
use crate::rod::assembly::touching_edges::TouchingEdge;

impl<D: RodScalar> ContactPairs<D> {
    /// Adds minus the forces that depend on the velocity at the unknowns `q`, N, to `forces`, and their derivatives by
    /// the unknowns at the end of a step, N/m, to `tangent` if it is given. Nothing without damping and friction.
    pub(super) fn add_losses<T: UnsymmetricTangent<D>>(
        &self,
        q: &[D],
        velocities: StepVelocities<'_, D>,
        forces: &mut [D],
        tangent: Option<&mut BorderedTangent<D, T>>,
    ) {
        match self.width() {
            2 => self.sum_losses::<2, 8, T>(q, velocities, forces, tangent),
            _ => self.sum_losses::<3, 14, T>(q, velocities, forces, tangent),
        }
    }

    /// [`add_losses`](Self::add_losses) of rods whose nodes have `A` coordinates, with `P` unknowns of two edges.
    fn sum_losses<const A: usize, const P: usize, T: UnsymmetricTangent<D>>(
        &self,
        q: &[D],
        StepVelocities { velocity, slope }: StepVelocities<'_, D>,
        forces: &mut [D],
        mut tangent: Option<&mut BorderedTangent<D, T>>,
    ) {
        for law in &self.laws {
            let Some(loss) = law.loss else { continue };
            law.for_each_pair(&self.boxes, self.stride, &[q], |i, j| {
                let edges = [&law.edges[i], &law.edges[j]];
                let of_edges = |x: &[D]| {
                    let mut own = [D::from(0.0); P];
                    for (to, edge) in own.chunks_exact_mut(P / 2).zip(edges) {
                        to.copy_from_slice(&x[edge.first..edge.first + P / 2]);
                    }
                    own
                };
                let lossy = LossyPair { pair: law.pair(self.stride, [i, j]), loss };
                let q = of_edges(q);
                if !lossy.touches::<A, P>(&q) {
                    return;
                }
                let v = of_edges(velocity);
                let is_free = |k: usize| edges[2 * k / P].is_free_at::<A>(k % (P / 2));
                let place = |k: usize| edges[2 * k / P].first + k % (P / 2);
                for (k, force) in lossy.forces::<A, P>(&q, &v).into_iter().enumerate() {
                    if is_free(k) {
                        forces[place(k)] += force;
                    }
                }
                if let Some(tangent) = &mut tangent {
                    let mut all = lossy.tangent::<A, P>(&q, &v, slope);
                    for (k, row) in all.iter_mut().enumerate() {
                        for (l, entry) in row.iter_mut().enumerate() {
                            if !(is_free(k) && is_free(l)) {
                                *entry = D::from(0.0);
                            }
                        }
                    }
                    add_blocks(edges, &all, tangent);
                }
            });
        }
    }
}

impl<D> TouchingEdge<D> {
    /// Whether unknown `k` of the edge, whose nodes have `A` coordinates, may change.
    fn is_free_at<const A: usize>(&self, k: usize) -> bool {
        let last = if A == 2 { A } else { A + 1 };
        match k {
            k if k < A => self.is_free[0],
            k if k >= last => self.is_free[1],
            _ => self.has_free_angle,
        }
    }
}

/// Adds derivatives by the `P` unknowns of two edges to the bands of their rods and to the couplings between them.
fn add_blocks<D: RodScalar, T: UnsymmetricTangent<D>, const P: usize>(
    edges: [&TouchingEdge<D>; 2],
    all: &[[D; P]; P],
    tangent: &mut BorderedTangent<D, T>,
) {
    let width = P / 2;
    tangent.skew.activate();
    for (a, row) in edges.iter().enumerate() {
        for (b, column) in edges.iter().enumerate() {
            let mut entries = [[D::from(0.0); LARGEST_EDGE]; LARGEST_EDGE];
            for (to, from) in entries.iter_mut().zip(&all[width * a..width * (a + 1)]) {
                to[..width].copy_from_slice(&from[width * b..width * (b + 1)]);
            }
            if a == b {
                let member = &mut tangent.members[row.rod];
                member.band.add_unsymmetric(row.first - member.range.start, width, &entries);
            } else {
                let first = [row.first, column.first];
                tangent.between.losses.push(EdgeBlock { first, entries });
            }
        }
    }
}
