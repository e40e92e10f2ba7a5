//! Curvature and strain at a point of the rod, from the recorded nodes and axes of edges around it.
//!
//! Input: the point, and the edges and joints of the rod without load (`reference_strains`). [`PointStrain`] has those
//! around the point with cubic (Lagrange) weights by arc length, beyond the outermost ones extrapolated. Output at the
//! recorded time with the index `k`: `bending` along both material directors, 1/m, the integrated curvature `2
//! tan(phi/2)` of each joint less the stress-free one, over the length that bends in the joint; `curvature`, the same
//! plus the stress-free curvature; and `stretch`, the change of length of each edge over the length that stretches in
//! it. Lengths are those without load, as in the strains of the model. Errors are a point outside the rod, and nodes or
//! edges that are not recorded.

use crate::dynamics::record::RecordView;
use crate::error::Error;
use crate::fit::measurement::simulated::SimulatedOutput;
use crate::numerics::scalar::Scalar;
use crate::numerics::vector::{dot, sub};
use crate::problem::{ReferenceEdge, ReferenceJoint, joint_curvature};
use crate::scene::{Point, Stencil};

/// A joint or an edge with its weight at a point.
struct Weighted<'a, T, D> {
    part: &'a T,
    weight: D,
}

/// Joints and edges around a point, each with its weight.
pub(super) struct PointStrain<'a, D> {
    joints: Vec<Weighted<'a, ReferenceJoint<D>, D>>,
    edges: Vec<Weighted<'a, ReferenceEdge<D>, D>>,
}

impl<'a, D: Scalar> PointStrain<'a, D> {
    /// The joints and edges around a `point` of the `simulated` rod, with their weights there. If `simulated` has no
    /// reference strains there are none, and all strains are zero. An error for a point outside the rod.
    pub fn new(point: Point, simulated: &SimulatedOutput<'a, D>) -> Result<Self, Error> {
        let place = point.fixed().place(simulated.mesh)?;
        let Some(reference) = simulated.reference_strains else {
            return Ok(Self { joints: Vec::new(), edges: Vec::new() });
        };
        let joints = Stencil::between(&reference.joint_places, place).nodes.into_iter();
        let edges = Stencil::between(&reference.edge_places, place).nodes.into_iter();
        Ok(Self {
            joints: joints
                .map(|(i, weight)| Weighted { part: &reference.joints[i], weight })
                .collect(),
            edges: edges
                .map(|(i, weight)| Weighted { part: &reference.edges[i], weight })
                .collect(),
        })
    }

    /// Curvature along both material directors at the recorded time with the index `k`, 1/m, positive if the rod bends
    /// towards the director. Error: a joint that is not recorded.
    pub fn curvature(&self, record: &RecordView<'_, D>, k: usize) -> Result<[D; 2], Error> {
        let mut sum = self.bending(record, k)?;
        for Weighted { part: joint, weight } in &self.joints {
            for c in 0..2 {
                sum[c] += joint.natural_curvature[c] * *weight;
            }
        }
        Ok(sum)
    }

    /// Curvature at the recorded time with the index `k` less the stress-free curvature, 1/m, along both material
    /// directors. Error: a joint that is not recorded.
    pub fn bending(&self, record: &RecordView<'_, D>, k: usize) -> Result<[D; 2], Error> {
        let mut sum = [D::from(0.0); 2];
        for Weighted { part: joint, weight } in &self.joints {
            let [before, after] = [record.axes(joint.edge, k)?, record.axes(joint.edge + 1, k)?];
            let own = joint_curvature(&before, &after);
            for c in 0..2 {
                sum[c] += (own[c] - joint.natural[c]) / joint.length * *weight;
            }
        }
        Ok(sum)
    }

    /// Strain of the axis (change of length over the length without load) at the recorded time with the index `k`.
    /// Error: an edge that is not recorded.
    pub fn stretch(&self, record: &RecordView<'_, D>, k: usize) -> Result<D, Error> {
        let mut sum = D::from(0.0);
        for Weighted { part: edge, weight } in &self.edges {
            let vector = sub(record.node(edge.edge + 1, k)?, record.node(edge.edge, k)?);
            sum += (dot(vector, vector).sqrt() - edge.chord) / edge.length * *weight;
        }
        Ok(sum)
    }
}
