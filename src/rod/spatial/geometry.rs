//! Edges and joints of a spatial rod, and how they are strained.

use crate::numerics::vector::Vector;

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

impl Geometry {
    /// Room for so many edges.
    pub(super) fn resize(&mut self, edges: usize) {
        self.edges.resize(edges, Straight::default());
        self.joints.resize(edges - 1, Bent::default());
    }
}
