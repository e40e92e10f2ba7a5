//! Edges and joints of a spatial rod, and how they are strained.

use crate::energy::Stretch;
use crate::energy::frame::{EdgeFrame, Frames, one_plus_dot};
use crate::energy::joint::{EdgeState, Joint};
use crate::numerics::scalar::{Scalar, Wide};
use crate::numerics::vector::{Vector, combine, scale};
use crate::rod::blocks::block;

/// An edge as it is, and how it has rotated since its reference.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Straight {
    pub(super) length: f64,
    pub(super) inverse_length: f64,
    pub(super) tangent: Vector<f64>,
    pub(super) strain: f64,
    /// Material directors over the length, 1/m.
    pub(super) across: [Vector<f64>; 2],
    /// How much the directors turn when the edge moves towards them.
    pub(super) turn: [f64; 2],
    /// How much they turn when the edge changes, 1/m.
    pub(super) follow: Vector<f64>,
    /// 1/(1 + t.t_ref).
    pub(super) by_chi: f64,
}

/// A joint as it is: strains, and their derivatives (columns) by what both edges can do (rows).
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Bent {
    pub(super) strains: [f64; 3],
    pub(super) by: [[[f64; 3]; 3]; 2],
}

/// Edges and joints of a spatial rod.
#[derive(Clone, Debug, Default)]
pub struct Geometry {
    pub(super) edges: Vec<Straight>,
    pub(super) joints: Vec<Bent>,
}

/// Writes the geometry of a rod from its edges.
pub(super) struct Measure<'a, D> {
    stretch: &'a [Stretch<D, 3>],
    frames: &'a [EdgeFrame<D>],
    edges: &'a mut [Straight],
    joints: &'a mut [Bent],
}

impl<'a, D: Scalar> Measure<'a, D> {
    #[inline(always)]
    pub fn new(
        stretch: &'a [Stretch<D, 3>],
        frames: &'a Frames<D>,
        geometry: &'a mut Geometry,
    ) -> Self {
        geometry.edges.resize(stretch.len(), Straight::default());
        geometry.joints.resize(stretch.len() - 1, Bent::default());
        Self {
            stretch,
            frames: &frames.edges,
            edges: &mut geometry.edges,
            joints: &mut geometry.joints,
        }
    }
}

impl<D: Scalar> Measure<'_, D> {
    /// Edges from `first` on as they are, with the joints after them and the next edges.
    #[inline(always)]
    pub fn see<V: Wide<D>>(
        &mut self,
        level: V::Level,
        first: usize,
        state: &EdgeState<V>,
        (joint, next): (&Joint<V>, &EdgeState<V>),
    ) {
        let (mut references, mut laws) = (None, None);
        let beyond = self.frames[self.frames.len() - 1];
        let frames = block::<D, V, _>(self.frames, first, beyond, &mut references);
        let frame = EdgeFrame::side_by_side::<V>(level, frames);
        let laws = block::<D, V, _>(self.stretch, first, Stretch::none(), &mut laws);
        let strain = Stretch::side_by_side::<V>(level, laws).strain_of(state.squared, state.length);
        let EdgeState { edge, length, turn, .. } = state;
        let by_chi = one_plus_dot(frame.tangent, edge.tangent).recip();
        let across = [scale(edge.m[0], edge.inverse_length), scale(edge.m[1], edge.inverse_length)];
        let follow = combine(turn[0], across[0], turn[1], across[1]);
        let value = |x: &V, lane: usize| x.lane(lane).value();
        for (lane, to) in self.edges[first..].iter_mut().take(V::LANES).enumerate() {
            let vector =
                |v: &Vector<V>| [value(&v[0], lane), value(&v[1], lane), value(&v[2], lane)];
            *to = Straight {
                length: value(length, lane),
                inverse_length: value(&edge.inverse_length, lane),
                tangent: vector(&edge.tangent),
                strain: value(&strain, lane),
                across: [vector(&across[0]), vector(&across[1])],
                turn: [value(&turn[0], lane), value(&turn[1], lane)],
                follow: vector(&follow),
                by_chi: value(&by_chi, lane),
            };
        }
        let slopes = joint.slopes(edge, &next.edge);
        for (lane, to) in self.joints[first..].iter_mut().take(V::LANES).enumerate() {
            for a in 0..3 {
                to.strains[a] = value(&joint.strains[a], lane);
                for c in 0..3 {
                    to.by[0][a][c] = value(&slopes[0][a][c], lane);
                    to.by[1][a][c] = value(&slopes[1][a][c], lane);
                }
            }
        }
    }
}
