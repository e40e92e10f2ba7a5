//! Loads of a scene without a potential on the edges of its mesh: follower loads at points and along lines, and in
//! space also the moments of point loads.
//!
//! The loads of a node act half on each of its edges, those of an end node on its only edge. So the direction of a
//! follower force, which is given along tangent and directors, is on an inner node the mean of both edges. In a plane
//! the components along both directors become one along the normal to the left of the tangent. A follower moment has a
//! potential there, as a moment about the normal of the plane ([`Setup::dead_part`]). In space every moment is without
//! a potential. [`Setup::follower_loads`] returns these loads, N and N m: a group of the constant ones, and one for
//! each signal, with its value at the given time (s) as factor; those of one edge are added. [`Setup::dead_part`]
//! returns the part of a follower point load that has a potential, and any other point load unchanged.
//! `follower_signals` iterates over the signals of loads without a potential. [`follower_vector`] returns the vector of
//! the world with given components along tangent and directors of the first edge.

use crate::energy::FollowerLoad;
use crate::energy::adapter::Chart;
use crate::numerics::scalar::{RodScalar, Scalar};
use crate::numerics::vector::{Vector, add, combine, cross, scale, sub, unit};
use crate::problem::line_loads::line_loads;
use crate::problem::model::{Model, NodalLoad};
use crate::problem::setup::Setup;
use crate::rod::{EdgeFollower, FollowerGroup, FollowerLoads};
use crate::scene::{LineForce, PointForce, Signal};

/// The vector of the world with `components` along the tangent of the first edge of `nodes`, the first `director`, and
/// the second one, tangent times (cross product) director.
pub(super) fn follower_vector<D: Scalar>(
    [along, first, second]: [D; 3],
    nodes: &[Vector<D>],
    director: Vector<D>,
) -> Vector<D> {
    let tangent = unit(sub(nodes[1], nodes[0]));
    add(scale(tangent, along), combine(first, director, second, cross(tangent, director)))
}

/// Converts components of a follower force along tangent and both directors to those along the axes of an edge of the
/// model. In a plane these are the tangent and the normal to its left, and the third is zero. In space nothing changes.
fn components<D: RodScalar>(chart: &Chart<D>, [along, first, second]: Vector<D>) -> Vector<D> {
    match chart {
        Chart::Plane { across: [within, out], .. } => {
            [along, first * *within - second * *out, D::from(0.0)]
        }
        Chart::Space { .. } => [along, first, second],
    }
}

/// Sums of the loads of each edge of a rod; `None` for an edge without loads so far.
struct EdgeSums<D>(Vec<Option<FollowerLoad<D>>>);

impl<D: RodScalar> EdgeSums<D> {
    /// Calls `add` for both edges of a node, or twice for the only edge of an end node. Its arguments are the sums of
    /// the edge and the number of the node in it (0 or 1). `add` must add half of the load of the node to these sums.
    fn add(&mut self, node: usize, add: impl Fn(&mut FollowerLoad<D>, usize)) {
        let last = self.0.len() - 1;
        for edge in [node.saturating_sub(1), node.min(last)] {
            add(self.0[edge].get_or_insert_with(FollowerLoad::zero), node - edge);
        }
    }
}

/// Adds half of the components `x` to the sums `to`.
fn add_half<D: Scalar>(to: &mut [D; 3], x: [D; 3]) {
    for c in 0..3 {
        to[c] += x[c] * 0.5;
    }
}

impl<D: RodScalar, M: Model> Setup<D, M> {
    /// The loads without a potential, with signals at a time, s. The first group has the constant loads, the others
    /// those of [`follower_signals`](Self::follower_signals) in their order.
    pub fn follower_loads(&self, model: &M, time: f64) -> FollowerLoads<D> {
        if self.scene.loads.first_follower(M::STRIDE > 2).is_none() {
            return FollowerLoads::none();
        }
        let chart = model.chart(&self.scene, &self.rest);
        let mut groups = vec![self.follower_group(model, &chart, None)];
        for signal in self.follower_signals() {
            let group = self.follower_group(model, &chart, Some(&signal.name));
            groups.push(FollowerGroup { factor: signal.curve().value(D::from(time)), ..group });
        }
        FollowerLoads { groups }
    }

    /// The signals of loads without a potential, in the order of the scene.
    pub fn follower_signals(&self) -> impl Iterator<Item = &Signal<D>> {
        let loads = &self.scene.loads;
        self.scene.signals.iter().filter(|signal| {
            let has = |name: &Option<String>| name.as_deref() == Some(&*signal.name);
            loads.point.iter().any(|load| has(&load.signal) && Self::has_no_potential(load))
                || loads.line.iter().any(|load| has(&load.signal) && load.follower)
        })
    }

    /// Whether a point load has no potential: it is a follower load, or in space has a moment that is not identically
    /// zero (value and derivatives).
    fn has_no_potential(load: &PointForce<D>) -> bool {
        let turns = || !load.moment.iter().all(RodScalar::is_identically_zero);
        load.follower || M::STRIDE > 2 && turns()
    }

    /// The loads without a potential that have this signal, or the constant ones (`None`), with the factor 1. Those of
    /// a node act half on each of its edges, and are summed over each edge.
    fn follower_group(
        &self,
        model: &M,
        chart: &Chart<D>,
        signal: Option<&str>,
    ) -> FollowerGroup<D> {
        let loads = &self.scene.loads;
        let in_space = M::STRIDE > 2;
        let mut sums = EdgeSums(vec![None; self.mesh.nodes.len() - 1]);
        let points = loads.point.iter().filter(|load| load.signal.as_deref() == signal);
        for load in points.filter(|load| Self::has_no_potential(load)) {
            for NodalLoad { node, force, moment } in self.nodal(std::slice::from_ref(load)) {
                let force = components(chart, force);
                sums.add(node, |sum, place| match load.follower {
                    true => {
                        add_half(&mut sum.forces[place], force);
                        if in_space {
                            add_half(&mut sum.moment, moment);
                        }
                    }
                    false => add_half(&mut sum.fixed_moment, model.components(moment)),
                });
            }
        }
        let lines = loads.line.iter().filter(|load| load.signal.as_deref() == signal);
        let lines: Vec<LineForce<D>> = lines.filter(|load| load.follower).cloned().collect();
        for NodalLoad { node, force, .. } in line_loads(&lines, &self.mesh) {
            let force = components(chart, force);
            sums.add(node, |sum, place| add_half(&mut sum.forces[place], force));
        }
        let edges = sums.0.into_iter().enumerate();
        let edges = edges.filter_map(|(edge, load)| Some(EdgeFollower { edge, load: load? }));
        FollowerGroup { factor: D::from(1.0), edges: edges.collect() }
    }

    /// The part of a follower point load that has a potential: the force is zero, in space the moment too. In a plane
    /// the moment becomes that about the normal, in world axes. Any other load is returned unchanged, also its moment
    /// in space, which has no potential either.
    pub(super) fn dead_part(&self, model: &M, load: &PointForce<D>) -> PointForce<D> {
        if !load.follower {
            return load.clone();
        }
        let zero = D::from(0.0);
        let moment = match model.chart(&self.scene, &self.rest) {
            Chart::Plane { axes: [x, y], across: [within, out], .. } => {
                let size = load.moment[1] * out + load.moment[2] * within;
                cross(x, y).map(|c| size * c)
            }
            Chart::Space { .. } => [zero; 3],
        };
        PointForce { force: [zero; 3], moment, ..load.clone() }
    }
}
