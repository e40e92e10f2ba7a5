//! Edges and joints of a spatial rod, and how they are strained.

use crate::energy::Stretch;
use crate::energy::frame::{EdgeFrame, Frames, one_plus_dot};
use crate::energy::joint::{Between, ByEdge, EdgeState, Joint};
use crate::numerics::scalar::Scalar;
use crate::numerics::vector::{Vector, combine, scale};
use crate::rod::edges::{TakesEdges, ToNodes};

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

impl<D: Scalar> TakesEdges<D> for Measure<'_, D> {
    #[inline(always)]
    fn see(&mut self, i: usize, state: &EdgeState<D>, after: Option<(&Joint<D>, &EdgeState<D>)>) {
        let value = |x: D| x.value();
        let by_chi = one_plus_dot(self.frames[i].tangent, state.edge.tangent).recip().value();
        let inverse_length = state.edge.inverse_length.value();
        let across = state.edge.m.map(|m| scale(m.map(value), inverse_length));
        let turn = state.turn.map(value);
        self.edges[i] = Straight {
            length: state.length.value(),
            inverse_length,
            tangent: state.edge.tangent.map(value),
            strain: self.stretch[i].strain_of(state.squared, state.length).value(),
            across,
            turn,
            follow: combine(turn[0], across[0], turn[1], across[1]),
            by_chi,
        };
        if let Some((joint, next)) = after {
            self.joints[i] = Bent {
                strains: joint.strains.map(value),
                by: joint.slopes(&state.edge, &next.edge).map(|by| by.map(|by| by.map(value))),
            };
        }
    }

    fn edge(&mut self, _: usize, _: &ByEdge<D>, _: &Between<D>) {}
}

impl<D: Scalar> TakesEdges<D> for (ToNodes<'_, D>, Measure<'_, D>) {
    #[inline(always)]
    fn see(&mut self, i: usize, state: &EdgeState<D>, after: Option<(&Joint<D>, &EdgeState<D>)>) {
        self.1.see(i, state, after);
    }

    #[inline(always)]
    fn edge(&mut self, i: usize, own: &ByEdge<D>, after: &Between<D>) {
        self.0.edge(i, own, after);
    }
}
