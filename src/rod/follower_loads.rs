//! Loads without a potential on the edges of a rod, such as forces that follow its tangent: forces (N) and tangent
//! (N/m, not symmetric).
//!
//! Input: groups of [`FollowerLoad`]s with a factor each, and the unknowns with their frames. A group has the constant
//! loads, or those that one signal multiplies. [`FollowerLoads`] adds their forces times a sign to a list
//! (`add_forces`); minus the forces is part of the gradient of the rod, which then is not the derivative of an energy.
//! `add_tangent` subtracts the forces from the gradient, and their derivatives by the unknowns from the tangent.
//! `set_factor` replaces the factor of a group by the value of its signal; `copy_factors` takes all factors from the
//! same loads of another rod. The list is empty without such loads.
//!
//! `EdgeFollower` is the load of one edge, `FollowerGroup` the loads with one factor.

use crate::energy::FollowerLoad;
use crate::numerics::scalar::{RodScalar, Scalar};
use crate::numerics::tangent::UnsymmetricTangent;
use crate::rod::layout::Layout;

/// A load without a potential on an edge.
#[derive(Clone, Copy, Debug)]
pub struct EdgeFollower<D> {
    /// Index of the edge.
    pub edge: usize,
    /// Its load at the factor 1.
    pub load: FollowerLoad<D>,
}

/// Loads with a common factor, one for each loaded edge.
#[derive(Clone, Debug)]
pub struct FollowerGroup<D> {
    /// The factor: 1, or the value of a signal.
    pub factor: D,
    /// The loads.
    pub edges: Vec<EdgeFollower<D>>,
}

/// All loads without a potential.
#[derive(Clone, Debug)]
pub struct FollowerLoads<D> {
    /// Their groups.
    pub groups: Vec<FollowerGroup<D>>,
}

impl<D> FollowerLoads<D> {
    /// No loads.
    pub fn none() -> Self {
        Self { groups: Vec::new() }
    }

    /// Whether there are no loads without a potential.
    pub fn is_empty(&self) -> bool {
        self.groups.is_empty()
    }
}

impl<D: Scalar> FollowerLoads<D> {
    /// Sets the factor of a group; without a group of this index nothing happens.
    pub fn set_factor(&mut self, group: usize, factor: D) {
        if let Some(group) = self.groups.get_mut(group) {
            group.factor = factor;
        }
    }

    /// Copies the factors of the groups of `other`, the same loads of another rod, in their order.
    pub fn copy_factors(&mut self, other: &Self) {
        for (own, other) in self.groups.iter_mut().zip(&other.groups) {
            own.factor = other.factor;
        }
    }

    /// All loads times their factors, with their edges.
    fn scaled(&self) -> impl Iterator<Item = EdgeFollower<D>> {
        self.groups.iter().flat_map(|FollowerGroup { factor, edges }| {
            edges.iter().map(|EdgeFollower { edge, load }| EdgeFollower {
                edge: *edge,
                load: load.scaled(*factor),
            })
        })
    }
}

impl<D: RodScalar> FollowerLoads<D> {
    /// Adds `sign` times the forces at `q`, N (N m for angles), to `forces`.
    pub(super) fn add_forces<L: Layout<N, S>, const N: usize, const S: usize>(
        &self,
        sign: f64,
        q: &[D],
        frames: &L::Frames<D>,
        forces: &mut [D],
    ) {
        for EdgeFollower { edge, load } in self.scaled() {
            let local = L::follower_forces(&load, q, frames, edge);
            let to = forces[L::STRIDE * edge..][..L::STRIDE + N].iter_mut();
            to.zip(local).for_each(|(to, force)| *to += force * sign);
        }
    }

    /// Subtracts the forces at `q`, N, from `gradient`, and their derivatives, N/m, from `tangent`.
    pub(super) fn add_tangent<L: Layout<N, S>, const N: usize, const S: usize>(
        &self,
        q: &[D],
        frames: &L::Frames<D>,
        gradient: &mut [D],
        tangent: &mut L::Tangent<D>,
    ) {
        self.add_forces::<L, N, S>(-1.0, q, frames, gradient);
        for EdgeFollower { edge, load } in self.scaled() {
            let block = L::follower_tangent(&load, q, frames, edge);
            tangent.add_unsymmetric(L::STRIDE * edge, L::STRIDE + N, &block);
        }
    }
}
