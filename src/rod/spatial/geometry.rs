//! The geometry of a spatial rod in plain numbers: length (m), directions and axial strain of each edge, two curvatures
//! and twist (rad) of each joint, and their derivatives.
//!
//! Strains of a joint are differentiated by the rotations `p`, `q` and `h` of its two edges (`energy::joint`), not by
//! the unknowns. Of an edge there are the turns of its directors with its tangent and its vector; with them the users
//! convert to forces on nodes. Written by a sweep at the solution of a step; the products with derivatives along
//! parameters and with derivatives of frames use it.
//!
//! `Geometry` has one `SpatialEdgeGeometry` per edge (length, directions, strain, rotation since its reference) and one
//! `SpatialJointGeometry` per joint (strains and their derivatives).

use crate::numerics::directions::Directions;
use crate::numerics::vector::Vector;
use crate::rod::edges::STRIDE;

/// Length, m, directions and strain of an edge, and its rotation since its reference.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct SpatialEdgeGeometry {
    pub(super) length: f64,
    pub(super) inverse_length: f64,
    pub(super) tangent: Vector<f64>,
    pub(super) strain: f64,
    /// Material directors over the length, 1/m.
    pub(super) across: [Vector<f64>; 2],
    /// The turn of the directors, rad, per rotation of the tangent towards each of them.
    pub(super) turn: [f64; 2],
    /// The turn of the directors per change of the edge vector, 1/m.
    pub(super) follow: Vector<f64>,
    /// `1/(1 + t.t_ref)`: the factor of parallel transport from the reference tangent `t_ref` to the tangent `t`.
    pub(super) by_chi: f64,
}

/// The strains of a joint, and their derivatives (columns) by the rotations `p`, `q` and `h` of both edges (rows).
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct SpatialJointGeometry {
    /// Two curvatures and the twist.
    pub(super) strains: [f64; 3],
    /// Derivatives of these strains by the motions `p`, `q` and `h` of the first and the second edge.
    pub(super) by: [[[f64; 3]; 3]; 2],
}

/// Edges and joints of a spatial rod at its unknowns.
#[derive(Clone, Debug, Default)]
pub struct Geometry {
    pub(super) edges: Vec<SpatialEdgeGeometry>,
    pub(super) joints: Vec<SpatialJointGeometry>,
}

/// The vector of edge `j` (second node less first) in each of `G` lists of unknowns or of their derivatives, one list
/// per lane.
#[inline(always)]
pub(super) fn edge<const G: usize>(q: &[[f64; G]], j: usize) -> [Directions<G>; 3] {
    let own: &[[f64; G]; 7] =
        q[STRIDE * j..].first_chunk().expect("an edge's nodes are nodes of the rod");
    let along = |c: usize| Directions(own[STRIDE + c]) - Directions(own[c]);
    [along(0), along(1), along(2)]
}
