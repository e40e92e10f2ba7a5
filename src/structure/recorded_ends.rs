//! Motion of the ends of rods that follow recorded markers: prescribed unknowns and their positions at a time.
//!
//! A recorded end holds the nodes at its two markers and those between them, which stay on the chord. In space it also
//! holds the angles of the edges between, relative to the parallel-transported frame, unless the end rotates freely.
//! Positions follow from the recording alone and have no derivatives with respect to numbers of the scene.
//!
//! Input: scene, plan, models and assembly at rest. [`RecordedEnds`] has the [`PrescribedDofs`] of steps, equilibria
//! and modes. `motion` is the [`BoundaryMotion`] over any number type, and `place` overwrites positions in the unknowns
//! by those at a time, s.

use crate::error::Error;
use crate::numerics::prescribed_dofs::PrescribedDofs;
use crate::numerics::scalar::RodScalar;
use crate::problem::boundary::{BoundaryMotion, RecordedPart};
use crate::problem::{PlanarModel, SpatialModel};
use crate::rod::Assembly;
use crate::rod::assembly::AssemblyFrames;
use crate::scene::StructureScene;
use crate::scene::path::RecordedNode;
use crate::scene::prescribed_motion::MotionTime;
use crate::scene::structure::{StructureRod, StructureSupport};
use crate::structure::blueprint::{AssemblyAtRest, RodModels};
use crate::structure::plan::{EndSupport, StructurePlan};

/// The recorded ends of a structure.
#[derive(Clone, Debug, Default)]
pub(super) struct RecordedEnds {
    /// Nodes, counted over the unknowns of all rods, with their markers.
    parts: Vec<RecordedPart>,
    /// Prescribed unknowns.
    pub prescribed: PrescribedDofs,
    /// Whether the structure is in space.
    is_spatial: bool,
}

/// Number of edges between the markers of a recorded `support` of a rod on a mesh with `edges` edges. It is
/// `support.edges` times `edges` over the number in the scene, so that the held length stays about the same. It is
/// rounded, to 1 or more and to less than `edges`.
pub(super) fn held_edges(support: &StructureSupport, rod: &StructureRod, edges: usize) -> usize {
    let ratio = edges as f64 / rod.segments as f64;
    ((support.edges as f64 * ratio).round() as usize).clamp(1, edges - 1)
}

impl RecordedEnds {
    /// The recorded ends of a plan, on the meshes of the assembly at rest: their nodes with markers and fractions of
    /// the chord, and the indices of the prescribed unknowns. None without a recording. An error for a marker that the
    /// recording does not have.
    pub fn new(
        scene: &StructureScene,
        plan: &StructurePlan,
        models: &RodModels,
        at_rest: &AssemblyAtRest<f64>,
    ) -> Result<Self, Error> {
        let (stride, axes) = match models {
            RodModels::Plane { plane, .. } => {
                let normal = plane.x.cross(&plane.y);
                (2, [plane.x.into(), plane.y.into(), normal.into()])
            }
            RodModels::Space(_) => (4, [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]),
        };
        let (mut parts, mut prescribed) = (Vec::new(), Vec::new());
        let ranges = at_rest.assembly.rod_ranges();
        for (rod, ends) in plan.ends.iter().enumerate() {
            let (first, last) = (ranges[rod].start / stride, at_rest.meshes[rod].nodes.len() - 1);
            for (end, hold) in ends.iter().enumerate() {
                let (EndSupport::Recorded(i), Some(recording)) = (*hold, &scene.recording) else {
                    continue;
                };
                let support = &scene.supports[i];
                let marker = |k: usize| {
                    recording.marker(&format!("supports[{i}].markers"), &support.markers[k])
                };
                let markers = [marker(0)?, marker(1)?];
                let edges = held_edges(support, &scene.rods[rod], last);
                let place = |k: usize| if end == 0 { k } else { last - k };
                let node = |k: usize| RecordedNode {
                    node: first + place(k),
                    markers,
                    part: k as f64 / edges as f64,
                };
                let nodes: Vec<RecordedNode> = (0..=edges).map(node).collect();
                let components = stride.min(3);
                for held in &nodes {
                    prescribed.extend(stride * held.node..stride * held.node + components);
                }
                if stride == 4 && !support.free_twist {
                    // The angle of an edge is that of its first node.
                    let edge = |k: usize| first + if end == 0 { k } else { last - 1 - k };
                    prescribed.extend((0..edges).map(|k| 4 * edge(k) + 3));
                }
                parts.push(RecordedPart { track: recording.track()?.clone(), nodes, axes });
            }
        }
        let prescribed = PrescribedDofs::new(prescribed);
        Ok(Self { parts, prescribed, is_spatial: stride == 4 })
    }

    /// Whether no end follows a recording.
    pub fn is_empty(&self) -> bool {
        self.parts.is_empty()
    }

    /// The prescribed motion of the nodes and edges of all recorded ends over a number type, in the axes of the model,
    /// as
    /// a function of time. Without recorded ends nothing moves.
    pub fn motion<D: RodScalar>(&self) -> BoundaryMotion<D> {
        match self.is_spatial {
            true => BoundaryMotion::new::<SpatialModel>(Vec::new(), self.parts.clone()),
            false => BoundaryMotion::new::<PlanarModel>(Vec::new(), self.parts.clone()),
        }
    }

    /// Overwrites the positions of recorded nodes in `q`, m, by those of the recording at a time, s. Angles are
    /// unchanged.
    pub fn place<D: RodScalar>(&self, time: f64, q: &mut [D], frames: &AssemblyFrames<D>) {
        let at = MotionTime::Time(time);
        self.motion::<D>().advance::<Assembly<D>>(at, at, q, frames);
    }
}
