//! Actuators of a scene on the mesh of a rod: changes of natural strains of edges and joints, and elements of tendons.
//!
//! A joint represents the rod between the middles of its two edges, an edge that between its nodes. [`natural_shifts`]
//! integrates the change of a natural strain over the part of each that lies between the ends of the actuator: rad of a
//! joint, a strain of an edge. [`tendon`] returns the two energies of a tendon, one over the joints and one over the
//! outer halves of the first and the last edge. The part of the rod of a joint or half edge is its cell. A cell in
//! which the route has a corner has an element for each of its parts. Both functions take numbers of the scene over any
//! scalar.

use crate::energy::adapter::{AnyEnergy, Chart};
use crate::energy::place::ElementPlacement;
use crate::energy::tendon::RoutePart;
use crate::energy::tendon::element::TendonElement;
use crate::numerics::scalar::{RodScalar, Scalar};
use crate::rod::{EdgeShift, JointShift, NaturalShifts, Placed};
use crate::scene::actuation::{ActuatedStrain, RoutePoint};
use crate::scene::mesh::Mesh;
use std::sync::Arc;

/// A part of the rod between two arc lengths, m.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Interval<D> {
    /// Arc length of its start.
    pub from: D,
    /// Arc length of its end.
    pub to: D,
}

impl<D: Scalar> Interval<D> {
    /// The part that both intervals have in common; `None` without one.
    fn overlap(self, other: Self) -> Option<Self> {
        let from = if self.from.value() < other.from.value() { other.from } else { self.from };
        let to = if self.to.value() < other.to.value() { self.to } else { other.to };
        (from.value() < to.value()).then_some(Self { from, to })
    }

    /// Its length, m.
    fn length(self) -> D {
        self.to - self.from
    }

    /// Its middle, m.
    fn middle(self) -> D {
        (self.from + self.to) * 0.5
    }
}

/// The part of the rod that joint `i`, at node `i + 1`, represents: between the middles of its edges.
fn joint_cell<D: Scalar>(mesh: &Mesh<D>, i: usize) -> Interval<D> {
    let s = &mesh.arc_length;
    Interval { from: (s[i] + s[i + 1]) * 0.5, to: (s[i + 1] + s[i + 2]) * 0.5 }
}

/// The part of the rod that edge `j` represents: between its nodes.
fn edge_cell<D: Scalar>(mesh: &Mesh<D>, j: usize) -> Interval<D> {
    Interval { from: mesh.arc_length[j], to: mesh.arc_length[j + 1] }
}

/// Changes of natural strains by a strain `component` of the size `factor` (1/m, rad/m or a strain) within `part` of
/// the rod. A joint gets the angle, rad, of the covered length, an edge the strain times the covered fraction of its
/// length. In a plane, `across` has the components of the first director across the tangent: in the plane, and along
/// its normal.
pub(crate) fn natural_shifts<D: Scalar>(
    component: ActuatedStrain,
    factor: D,
    part: Interval<D>,
    mesh: &Mesh<D>,
    across: Option<[D; 2]>,
) -> NaturalShifts<D> {
    let (mut edges, mut joints) = (Vec::new(), Vec::new());
    let count = mesh.arc_length.len() - 1;
    if component == ActuatedStrain::Stretch {
        for edge in 0..count {
            let cell = edge_cell(mesh, edge);
            if let Some(covered) = cell.overlap(part) {
                let strain = factor * (covered.length() / cell.length());
                edges.push(EdgeShift { edge, strain });
            }
        }
        return NaturalShifts { edges, joints };
    }
    for joint in 0..count - 1 {
        let Some(covered) = joint_cell(mesh, joint).overlap(part) else { continue };
        let (angle, zero) = (factor * covered.length(), D::from(0.0));
        // In a plane a joint has one curvature: that to the left of the tangent.
        let strains = match (component, across) {
            (ActuatedStrain::D1, None) => [angle, zero, zero],
            (ActuatedStrain::D2, None) => [zero, angle, zero],
            (ActuatedStrain::D1, Some([within, _])) => [angle * within, zero, zero],
            (ActuatedStrain::D2, Some([_, out])) => [-(angle * out), zero, zero],
            (ActuatedStrain::Twist | ActuatedStrain::Stretch, _) => [zero, zero, angle],
        };
        joints.push(JointShift { joint, strains });
    }
    NaturalShifts { edges, joints }
}

/// Number of energies of a tendon: over joints, and over the outer halves of the first and the last edge.
pub(crate) const ENERGIES_PER_TENDON: usize = 2;

/// The energies of a tendon with a `tension`, N, along a `route`: over the joints, and over the outer halves of the
/// first and the last edge, which no joint represents. `name` is its key, for messages.
pub(crate) fn tendon<D: RodScalar>(
    name: &str,
    tension: D,
    route: &[RoutePoint<D>],
    chart: &Chart<D>,
    mesh: &Mesh<D>,
) -> [Placed<D>; ENERGIES_PER_TENDON] {
    let placed = |energy: Arc<dyn AnyEnergy>, placements: Vec<ElementPlacement<D>>| Placed {
        name: name.into(),
        energy,
        chart: chart.clone(),
        values: vec![tension],
        placements,
    };
    let edges = mesh.arc_length.len() - 1;
    let mut joints = Vec::new();
    for i in 0..edges - 1 {
        let cell = joint_cell(mesh, i);
        joints.extend(route_parts(route, cell, cell.length(), i));
    }
    // The halves of the outermost edges belong to no joint; those behind a wall carry nothing.
    let (first, last) = (edge_cell(mesh, 0), edge_cell(mesh, edges - 1));
    let start = Interval { from: first.from, to: first.middle() };
    let end = Interval { from: last.middle(), to: last.to };
    let mut halves = route_parts(route, start, first.length(), 0);
    halves.extend(route_parts(route, end, last.length(), edges - 1));
    [
        placed(Arc::new(TendonElement::<3>::default()), joints),
        placed(Arc::new(TendonElement::<2>::default()), halves),
    ]
}

/// The elements of a route within a `cell` of the rod (the part that a joint or half edge represents), one for each
/// straight part of the route there. `whole` is the length, m, of which the weight of an element is a fraction; the
/// elements begin at node `first`.
fn route_parts<D: Scalar>(
    route: &[RoutePoint<D>],
    cell: Interval<D>,
    whole: D,
    first: usize,
) -> Vec<ElementPlacement<D>> {
    let part = |pair: &[RoutePoint<D>]| {
        let (a, b) = (&pair[0], &pair[1]);
        let straight = Interval { from: a.at, to: b.at };
        let covered = cell.overlap(straight)?;
        let length = straight.length();
        let along = (covered.middle() - a.at) / length;
        let share = covered.length() / length;
        let step = [0, 1].map(|c| b.offset[c] - a.offset[c]);
        let part = RoutePart {
            weight: covered.length() / whole,
            offset: [0, 1].map(|c| a.offset[c] + step[c] * along),
            change: step.map(|step| step * share),
        };
        Some(ElementPlacement { first, weight: None, numbers: part.numbers(covered.middle()) })
    };
    route.windows(2).filter_map(part).collect()
}
