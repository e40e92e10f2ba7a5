//! Compliant clamps: walls that rotate and move under the load of the rod.
//!
//! Input: rotational compliance `c` (rad/(N m)) and axial compliance `a` (m/N) of the clamp at each end. The wall
//! rotates by `c M` under the moment `M` of the rod: a rotational spring in series with the rod. The outermost joint at
//! such a clamp gets the bending stiffness `K/(1 + K c)` instead of `K`, N m, in space in both directions of bending.
//! Torsion is unchanged. A clamp in the middle of an edge has no joint at its wall. If it is compliant ([`soft`]: `c`
//! is not zero or varies), the whole outermost edge counts as behind the wall, so that the joint is at the wall. A
//! rigid clamp keeps its wall at mid-edge. Along the rod the wall moves by `a` times the axial force: the edge next to
//! the outermost one, which the clamp holds, gets the axial stiffness `K/(1 + K a/l)`, N, with its rest length `l`.
//! [`SoftClamps`] returns these stiffnesses (`bending`, `stretching`); those of other joints and edges are unchanged.
//! [`soft_by_itself`] returns where the scene has a rotational compliance.

use crate::numerics::scalar::Scalar;
use crate::scene::{End, Parameter, Scene, Support};

/// Whether the clamp at `[start, end]` of the rod is modelled as compliant. Its rotational compliance in the scene is
/// then not zero, or is one of the `varying` parameters.
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

/// Whether the clamp at `[start, end]` of the rod has a rotational compliance other than zero in the scene.
pub(super) fn soft_by_itself(scene: &Scene) -> [bool; 2] {
    [End::Start, End::End].map(|end| scene.supports.compliance(end).rotation != 0.0)
}

/// Compliances of the clamps at both ends with the joints and edges that they act on.
pub(super) struct SoftClamps<D> {
    ends: Vec<SoftClamp<D>>,
}

/// Compliance of the clamp of one end.
struct SoftClamp<D> {
    /// Joint in series with the rotational compliance.
    joint: usize,
    /// Rotational compliance, rad/(N m).
    rotation: D,
    /// Edge in series with the axial compliance.
    edge: usize,
    /// Axial compliance, m/N.
    axial: D,
}

impl<D: Scalar> SoftClamps<D> {
    /// Compliances of the clamps of a scene on a mesh with `edges` edges, at least two. Each acts on the outermost
    /// joint, and along the rod on the edge next to the outermost one. Left out are ends without a clamp, and rigid
    /// clamps if `D` carries no derivatives.
    pub fn new(scene: &Scene<D>, edges: usize) -> Self {
        let supports = &scene.supports;
        let of = |end: End| {
            let give = supports.compliance(end);
            let rigid = give.rotation.value() == 0.0 && give.axial.value() == 0.0;
            // A rigid clamp stays where derivatives by its compliance may be wanted.
            if supports.at(end) != Support::Clamped || rigid && D::ORDER == 0 {
                return None;
            }
            // The outermost edge is held by the clamp: the next one is the first that stretches.
            let [joint, edge] = match end {
                End::Start => [0, 1],
                End::End => [edges - 2, edges - 2],
            };
            Some(SoftClamp { joint, rotation: give.rotation, edge, axial: give.axial })
        };
        Self { ends: [End::Start, End::End].into_iter().filter_map(of).collect() }
    }

    /// Bending stiffness over length of joint `i`, N m, in series with the rotational compliance `c` of a clamp:
    /// `K/(1 + K c)` with the `stiffness` K at a rigid clamp. Unchanged for joints that are not next to a clamp.
    pub fn bending(&self, i: usize, stiffness: D) -> D {
        let own = self.ends.iter().filter(|end| end.joint == i);
        own.fold(stiffness, |k, end| k / (k * end.rotation + 1.0))
    }

    /// Axial stiffness of edge `j`, N, in series with the axial compliance `a` of a clamp: `K/(1 + K a/l)`. K is the
    /// `stiffness` at a rigid clamp, l the `rest_length`, m. Unchanged for edges that are not next to a clamp.
    pub fn stretching(&self, j: usize, stiffness: D, rest_length: D) -> D {
        let own = self.ends.iter().filter(|end| end.edge == j);
        own.fold(stiffness, |k, end| k / (k / rest_length * end.axial + 1.0))
    }
}
