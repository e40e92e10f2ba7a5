//! Clamps that give: a wall that turns and moves with what the rod does to it.
//!
//! A wall turns by `c M`, with the moment `M` where the rod leaves it: a hinge there, in series with the
//! rod. Where a wall cuts an edge in its middle, no joint is at it. So the outermost edge of an end whose clamp
//! gives is behind the wall as a whole: the first joint is at the wall, stands for the half of its next edge,
//! and its stiffness `K` becomes `K/(1 + K c)`, exactly and at the mesh's second order however soft the clamp
//! is. A rigid clamp keeps its wall at mid-edge; its derivative by the compliance, half an edge from the wall, is of first
//! order. Along the rod the wall gives in series with the first edge that stretches.

use crate::numerics::scalar::Scalar;
use crate::scene::{End, Parameter, Scene, Support};

/// Whose clamps turn, or are to be differentiated by how they do.
pub(super) fn soft(scene: &Scene, varying: &[Parameter]) -> [bool; 2] {
    let turns = soft_by_itself(scene);
    [End::Start, End::End].map(|end| {
        let place = match end {
            End::Start => "supports.start_compliance.rotation",
            End::End => "supports.end_compliance.rotation",
        };
        turns[usize::from(end == End::End)]
            || varying.iter().any(|parameter| parameter.path() == place)
    })
}

/// Whose clamps turn by themselves.
pub(super) fn soft_by_itself(scene: &Scene) -> [bool; 2] {
    [End::Start, End::End].map(|end| scene.supports.compliance(end).rotation != 0.0)
}

/// What the clamps of both ends do to joints and edges.
pub(super) struct SoftClamps<D> {
    ends: Vec<SoftClamp<D>>,
}

struct SoftClamp<D> {
    joint: usize,
    rotation: D,
    edge: usize,
    axial: D,
}

impl<D: Scalar> SoftClamps<D> {
    /// Of a rod of so many edges.
    pub fn new(scene: &Scene<D>, edges: usize) -> Self {
        let supports = &scene.supports;
        let of = |end: End| {
            let give = supports.compliance(end);
            let rigid = give.rotation.value() == 0.0 && give.axial.value() == 0.0;
            if supports.at(end) != Support::Clamped || rigid && D::ORDER == 0 {
                return None;
            }
            let [joint, edge] = match end {
                End::Start => [0, 1],
                End::End => [edges - 2, edges - 2],
            };
            Some(SoftClamp { joint, rotation: give.rotation, edge, axial: give.axial })
        };
        Self { ends: [End::Start, End::End].into_iter().filter_map(of).collect() }
    }

    /// The stiffness of joint `i` against bending, N m, in place of a rigid clamp's.
    pub fn bending(&self, i: usize, stiffness: D) -> D {
        let own = self.ends.iter().filter(|end| end.joint == i);
        own.fold(stiffness, |k, end| k / (k * end.rotation + 1.0))
    }

    /// The stiffness of edge `j` of this rest length against a strain, N.
    pub fn stretching(&self, j: usize, stiffness: D, rest_length: D) -> D {
        let own = self.ends.iter().filter(|end| end.edge == j);
        own.fold(stiffness, |k, end| k / (k / rest_length * end.axial + 1.0))
    }
}
