//! Lengths and stress-free curvatures of the edges and joints of a rod, from which its strains follow.
//!
//! Input: a problem and the number of each parameter over any number type. Output of `reference_strains`:
//! [`ReferenceStrains`], with the edges that stretch and the joints that bend with the rod alone. An edge that a
//! support holds is left out, with joints between two of them, and so is the joint or edge that is in series with a
//! compliant clamp. All of them remain if none else would. Lengths are those of the elements: tributary lengths, m,
//! with the corrections at walls. The stress-free curvature of a joint has the components along both material
//! directors, without those of actuators. [`joint_curvature`] returns these components from the axes of two edges; it
//! is used for the deformed rod too. `edges_around` is the range of edges on which the strains at a place depend.

use crate::numerics::scalar::{RodScalar, Scalar};
use crate::numerics::vector::{Vector, add, dot, sub};
use crate::problem::{Discretized, Model, Problem, with_model};
use crate::scene::{End, Parameter, Stencil, Support};
use std::ops::Range;

/// Edge of a rod without load.
#[derive(Clone, Debug)]
pub(crate) struct ReferenceEdge<D> {
    /// Index of the edge.
    pub edge: usize,
    /// Distance of its nodes at rest, m.
    pub chord: D,
    /// Length of the rod that stretches in it, m.
    pub length: D,
}

/// Joint of a rod without load.
#[derive(Clone, Debug)]
pub(crate) struct ReferenceJoint<D> {
    /// Index of the edge before it.
    pub edge: usize,
    /// Length of the rod that bends in it, m.
    pub length: D,
    /// Integrated stress-free curvature along both material directors.
    pub natural: [D; 2],
    /// Stress-free curvature along both material directors, 1/m: per length of the curve, without the corrections at
    /// walls.
    pub natural_curvature: [D; 2],
}

/// Edges and joints of a rod without load, each with the arc length of its place from the wall, m.
#[derive(Clone, Debug)]
pub(crate) struct ReferenceStrains<D> {
    /// Edges that stretch with the rod alone.
    pub edges: Vec<ReferenceEdge<D>>,
    /// Arc lengths of their middles, m.
    pub edge_places: Vec<D>,
    /// Joints that bend with the rod alone.
    pub joints: Vec<ReferenceJoint<D>>,
    /// Arc lengths of their nodes, m.
    pub joint_places: Vec<D>,
}

impl<D: Scalar> ReferenceStrains<D> {
    /// Range of the edges on which the strains at the arc length `s`, m, depend: those of up to four joints, and up to
    /// four edges.
    pub fn edges_around(&self, s: f64) -> Range<usize> {
        let joints = self.joints[Stencil::around(&self.joint_places, s)].iter();
        let edges = self.edges[Stencil::around(&self.edge_places, s)].iter();
        let own = joints.flat_map(|j| [j.edge, j.edge + 1]).chain(edges.map(|own| own.edge));
        let all: Vec<usize> = own.collect();
        let first = all.iter().min().copied().unwrap_or(0);
        first..all.iter().max().map_or(first, |last| last + 1)
    }
}

/// Integrated curvature of the joint between two edges along both material directors, `2 tan(phi/2)` times the mean
/// direction, from their axes (tangent and both directors, unit vectors). It is positive if the rod bends towards the
/// director.
pub(crate) fn joint_curvature<D: Scalar>(
    before: &[Vector<D>; 3],
    after: &[Vector<D>; 3],
) -> [D; 2] {
    let both = add(before[0], after[0]);
    // 1/(1 + t_e.t_f), to full accuracy in a fold.
    let inverse = (dot(both, both) * 0.5).recip();
    [1, 2].map(|c| (dot(before[c], after[0]) - dot(after[c], before[0])) * inverse)
}

impl Problem {
    /// Edges and joints of the rod without load. `seed` returns the number of a parameter from its value.
    pub(crate) fn reference_strains<D: RodScalar>(
        &self,
        seed: impl Fn(Parameter, f64) -> D,
    ) -> ReferenceStrains<D> {
        with_model!(self, |discretized| discretized.reference_strains(seed))
    }

    /// Whether the clamp at an end moves along the rod under its load: it is compliant along the rod, or may become so.
    fn moves_along(&self, end: End) -> bool {
        let path = match end {
            End::Start => "supports.start_compliance.axial",
            End::End => "supports.end_compliance.axial",
        };
        self.scene.supports.compliance(end).axial != 0.0
            || self.varying.iter().any(|parameter| parameter.path() == path)
    }

    /// Whether each edge stretches with the rod alone: no support holds it, and it is not in series with a clamp that
    /// moves along the rod. All do if none would.
    fn stretching_edges(&self) -> Vec<bool> {
        let mut own = vec![true; self.segments()];
        let last = own.len() - 1;
        for (end, next) in [(End::Start, 1), (End::End, last - 1)] {
            let held = self.held_edges(end);
            match end {
                End::Start => own[..held].fill(false),
                End::End => own[last + 1 - held..].fill(false),
            }
            if self.scene.supports.at(end) == Support::Clamped {
                own[next] &= !self.moves_along(end);
            }
        }
        all_if_none(own)
    }

    /// Number of edges that the support of an end holds: one of a clamp, those between the held nodes of a recorded
    /// end, else 0.
    fn held_edges(&self, end: End) -> usize {
        let segments = self.segments();
        match (self.scene.supports.at(end), &self.scene.supports.path) {
            (Support::Clamped, _) => 1,
            (Support::Recorded, Some(path)) => (path.held_nodes(segments) - 1).min(segments),
            _ => 0,
        }
    }

    /// Whether each joint bends with the rod alone, and not with a compliant clamp. All do if none would.
    fn bending_joints(&self) -> Vec<bool> {
        let mut own = vec![true; self.segments() - 1];
        let last = own.len() - 1;
        let [start, end] = self.scene.soft;
        own[0] &= !start;
        own[last] &= !end;
        // Joints between held edges follow the support.
        let held = [End::Start, End::End].map(|end| self.held_edges(end).saturating_sub(1));
        own[..held[0].min(last + 1)].fill(false);
        own[(last + 1).saturating_sub(held[1])..].fill(false);
        all_if_none(own)
    }
}

/// The flags, or all true if none is.
fn all_if_none(flags: Vec<bool>) -> Vec<bool> {
    let has_none = flags.iter().all(|flag| !flag);
    flags.into_iter().map(|flag| flag || has_none).collect()
}

impl<M: Model> Discretized<'_, M> {
    /// Edges and joints of the rod without load. `seed` returns the number of a parameter from its value.
    fn reference_strains<D: RodScalar>(
        &self,
        seed: impl Fn(Parameter, f64) -> D,
    ) -> ReferenceStrains<D> {
        let (setup, problem) = (self.setup_over(seed), self.problem);
        let (q, frames) = (self.model.unknowns(&setup.rest), self.model.frames(&setup.rest));
        let segments = problem.segments();
        let axes = self.axes_at_rest(&setup, &q, &frames, &(0..segments).collect::<Vec<_>>());
        let axes = axes.as_chunks::<3>().0;
        let (tributary, arcs) = (M::tributary(&setup.rest), &setup.mesh.arc_length);
        let places = setup.mesh.places();
        let edge = |i: usize| {
            let chord = sub(self.model.position(&q, i + 1), self.model.position(&q, i));
            let chord = dot(chord, chord).sqrt();
            ReferenceEdge { edge: i, chord, length: tributary.stretch[i] }
        };
        let joint = |i: usize| {
            let rod = &setup.scene.rod;
            let own = joint_curvature(&axes[i], &axes[i + 1]);
            let factor = rod.natural_curvature.at(places[i + 1]);
            // Natural curvature is per length of the curve, without the corrections at walls.
            let length = (tributary.spin[i] + tributary.spin[i + 1]) * 0.5;
            let more = rod.bending_at(i + 1, &places);
            let natural = [0, 1].map(|c| factor * own[c] + more[c] * length);
            let natural_curvature = natural.map(|k| k / length);
            ReferenceJoint { edge: i, length: tributary.joint[i], natural, natural_curvature }
        };
        let chosen = |flags: Vec<bool>| (0..flags.len()).filter(move |i| flags[*i]);
        let edges: Vec<usize> = chosen(problem.stretching_edges()).collect();
        let joints: Vec<usize> = chosen(problem.bending_joints()).collect();
        ReferenceStrains {
            edge_places: edges.iter().map(|i| (arcs[*i] + arcs[*i + 1]) * 0.5).collect(),
            edges: edges.into_iter().map(edge).collect(),
            joint_places: joints.iter().map(|i| arcs[*i + 1]).collect(),
            joints: joints.into_iter().map(joint).collect(),
        }
    }
}
