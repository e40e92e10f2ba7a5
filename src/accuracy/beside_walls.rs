//! Edges of a first mesh by the loads and point masses beside clamped ends.
//!
//! A clamp holds two nodes. Loads between them do not move the rod, so that meshes whose held nodes carry a load or a
//! mass entirely agree without being right. [`edges_beside_walls`] returns the number of edges with which every load
//! and mass at an arc length is on free nodes. It is `2 L/d` with the length `L` of the rod and the smallest distance
//! `d` of these from a clamped end, at most [`MOST_EDGES`]. Loads nearer to a clamped end than this number permits,
//! `L/200`, do not count. The number is 0 without any.

use crate::scene::{Point, Scene, Support};

/// Edges per length of the rod over the distance of a load from a wall: free nodes are then on both sides of the load.
const EDGES_PER_DISTANCE: f64 = 2.0;
/// Largest number of edges because of a load: one nearer to a wall than half a per cent of the length hardly bends the
/// rod, and does not count.
const MOST_EDGES: f64 = 400.0;

/// The number of edges of a mesh of a `scene` whose rod has a `length` L, m, that loads and point masses beside clamped
/// ends require. It is `2 L/d` with the smallest distance `d` of one from a clamped end, of a line load that of its
/// farther end. Point loads of `initial` count too. Left out are distances below `L/200`, and points given as a node or
/// the tip. The result is 0 without any.
pub(super) fn edges_beside_walls(scene: &Scene, length: f64) -> f64 {
    let arc_length = |point: &Point| match point {
        Point::ArcLength(s) => Some([*s, *s]),
        _ => None,
    };
    let loads = scene.loads.point.iter().chain(&scene.initial.point).map(|load| &load.node);
    let masses = scene.rod.mass.iter().map(|mass| &mass.node);
    let lines = scene.loads.line.iter().map(|line| [line.from, line.to.unwrap_or(length)]);
    let parts: Vec<[f64; 2]> = loads.chain(masses).filter_map(arc_length).chain(lines).collect();
    let ends = [scene.supports.start, scene.supports.end];
    // The far end of a line load counts: the part before it may be on held nodes.
    let distances = parts.iter().flat_map(|[from, to]| [*to, length - from]);
    let beside = distances.zip(ends.into_iter().cycle()).filter_map(|(distance, support)| {
        let counts = distance * MOST_EDGES >= EDGES_PER_DISTANCE * length;
        (support == Support::Clamped && counts).then_some(distance)
    });
    EDGES_PER_DISTANCE * length / beside.fold(f64::INFINITY, f64::min)
}
