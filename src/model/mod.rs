//! The model of a scene: the rod's geometry at rest, in the dimension the scene needs.
//!
//! # The corrected discretisation
//!
//! A polygon that is bent at rest is stiffer than the curve it stands for. Let one edge turn
//! against the other about a joint with natural turning angle `phi`, by a small `omega`: the discrete
//! strains answer with `d kappa = omega/cos^2(phi/2)` in the plane of the joint,
//! `omega/cos(phi/2)` across it, and `d tau = omega/cos(phi/2)`. So that the joint resists `omega`
//! as the curve's `EI/dl` and `GJ/dl` do, the bending stiffness becomes `S diag(EI1, EI2) S/dl`
//! with `S = cos^2(phi/2)` along the natural curvature and `cos(phi/2)` across it, and the torsional
//! one `GJ cos^2(phi/2)/dl`. And a chord is shorter than its arc: `dl`, axial stiffness, mass and
//! weight count arcs. For a straight rod nothing changes. [`Discretization`](crate::scene::Discretization)
//! chooses.
//!
//! A model makes rods over any scalar and knows where their nodes are in the world.
//! [`PlanarModel`] drops the third coordinate, angles and frames; [`SpatialModel`] has them all.

mod planar;
mod spatial;

pub use planar::PlanarModel;
pub use spatial::SpatialModel;

use crate::parameter::Properties;
use crate::rod::Rod;
use crate::scalar::Nestable;
use crate::scene::{End, Support};
use nalgebra::Vector3;
use num_dual::Dual64;

/// A force and a moment on a node, in world axes.
#[derive(Clone, Copy, Debug)]
pub struct NodalLoad {
    /// Which node.
    pub node: usize,
    /// N.
    pub force: [f64; 3],
    /// N m.
    pub moment: [f64; 3],
}

/// What a [`Problem`](crate::Problem) asks of a model. `W` is the half-bandwidth of its tangent.
pub trait Model<const W: usize> {
    /// Unknowns from one node to the next.
    const STRIDE: usize;
    /// The rod over the scalar `D`.
    type Rod<D: Nestable>: Rod<D, W, Seeded = Self::Rod<Dual64>>;

    /// The rod with the given properties.
    fn rod<D: Nestable>(&self, properties: &Properties<D>) -> Self::Rod<D>;

    /// Adds forces and moments on nodes to a rod's loads.
    fn add_loads<D: Nestable>(&self, rod: &mut Self::Rod<D>, loads: &[NodalLoad]);

    /// Number of unknowns, the supported ones included.
    fn dof(&self) -> usize;

    /// The unknowns at rest, m (rad for angles).
    fn rest(&self) -> Vec<f64>;

    /// The frames at rest.
    fn frames(&self) -> <Self::Rod<f64> as Rod<f64, W>>::Frames;

    /// Frames over another scalar.
    fn lift<D: Nestable>(
        frames: &<Self::Rod<f64> as Rod<f64, W>>::Frames,
    ) -> <Self::Rod<D> as Rod<D, W>>::Frames;

    /// How many unknowns a support holds, counted from the end of the rod inwards.
    fn held(&self, support: Support) -> usize;

    /// A vector of the world in the model's axes; its third component leaves a plane.
    fn components(&self, vector: [f64; 3]) -> [f64; 3];

    /// The position of node `i` in the world, m.
    fn position(&self, q: &[f64], i: usize) -> [f64; 3];

    /// A rate of the position of node `i` in world axes, from the rates of all unknowns.
    fn rate(&self, v: &[f64], i: usize) -> [f64; 3];
}

/// Where an end rolls: as the scene says, or along the rod.
fn rolling(scene: &crate::scene::Scene, nodes: &[[f64; 3]]) -> Option<(End, Vector3<f64>)> {
    let end = scene.supports.rolling()?;
    let edge = match end {
        End::Start => &nodes[..2],
        End::End => &nodes[nodes.len() - 2..],
    };
    let along = Vector3::from(edge[1]) - Vector3::from(edge[0]);
    Some((end, scene.supports.roller.map_or(along, Vector3::from)))
}

/// Half of each adjacent edge.
fn voronoi_share(rest_length: &[f64], node: usize) -> f64 {
    let edge = |j: Option<usize>| j.and_then(|j| rest_length.get(j)).unwrap_or(&0.0);
    0.5 * (edge(node.checked_sub(1)) + edge(Some(node)))
}
