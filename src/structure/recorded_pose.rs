//! Pose of a structure in space through recorded markers, from which its relaxation starts.
//!
//! Input of [`Structure::pose_at`]: markers with their places at rest, and their positions in a frame, m. Output:
//! unknowns (m, rad) and frames. The pose is the start of a descent: it satisfies neither equilibrium nor lengths.
//!
//! - Nodes of each rod are interpolated linearly by arc length between its known points, and extrapolated beyond them.
//!   These are markers of a recorded end, observed markers, and joints at which a marker of any rod is.
//! - A body is rotated by the rotation that best fits the directions of its rods (Kabsch 1976,
//!   doi:10.1107/S0567739476001873). A sprung clamp is rotated with its body, and then to the direction of its edge.
//! - Directors are transported in parallel along each rod from a body. The difference of the directors at a second body
//!   becomes a twist that is evenly distributed over the edges.
//!
//! Errors: a structure in a plane, and a rod with fewer than two such points.

use crate::energy::frame::{EdgeFrame, Frames};
use crate::error::Error;
use crate::numerics::rotation::{Matrix3, exponential, identity, product, times};
use crate::numerics::vector::{Vector, add, cross, dot, scale, sub, unit};
use crate::rod::Assembly;
use crate::rod::assembly::{AssemblyFrames, SpatialBodies};
use crate::scene::Support;
use crate::structure::definition::Structure;
use crate::structure::marker_place::MarkerPlace;
use crate::structure::placement::{end_nodes, end_point};
use crate::structure::plan::EndSupport;
use crate::structure::spatial_inertia::rest_axes;
use nalgebra::Matrix3 as Dense3;

/// Distance of a marker from a joint at rest, over the length of the longest rod, up to which it is at the joint.
const AT_JOINT: f64 = 1e-3;

/// A recorded point of a rod.
#[derive(Clone, Copy)]
struct Knot {
    /// Its arc length, m.
    arc_length: f64,
    /// Its recorded position, m.
    position: Vector<f64>,
}

/// The position, m, at arc length `s`, m, by linear interpolation between the `knots`, which are at least two in
/// ascending order. Beyond the outermost knots the first or last line is extrapolated.
fn between(knots: &[Knot], s: f64) -> Vector<f64> {
    let k = knots[1..knots.len() - 1].partition_point(|knot| knot.arc_length < s);
    let [Knot { arc_length: s0, position: x0 }, Knot { arc_length: s1, position: x1 }] =
        [knots[k], knots[k + 1]];
    add(x0, scale(sub(x1, x0), (s - s0) / (s1 - s0)))
}

/// The smallest rotation from the unit vector `from` to the unit vector `to`; the identity for parallel and for
/// opposite vectors.
fn smallest_rotation(from: Vector<f64>, to: Vector<f64>) -> Matrix3<f64> {
    let axis = cross(from, to);
    let (sine, cosine) = (dot(axis, axis).sqrt(), dot(from, to));
    match sine > 1e-12 {
        true => {
            let angle = sine.atan2(cosine);
            exponential(scale(axis, angle / sine))
        }
        false => identity(),
    }
}

/// The rotation R that minimizes the sum of `|b - R a|^2` over all pairs `[a, b]` (Kabsch), by a singular value
/// decomposition; the identity if that fails.
fn best_rotation(pairs: &[[Vector<f64>; 2]]) -> Matrix3<f64> {
    let mut sum = Dense3::<f64>::zeros();
    for [from, to] in pairs {
        sum += nalgebra::Vector3::from(*to) * nalgebra::Vector3::from(*from).transpose();
    }
    let svd = sum.svd(true, true);
    let (Some(u), Some(v)) = (svd.u, svd.v_t) else { return identity() };
    let mut signs = Dense3::<f64>::identity();
    // A proper rotation: the direction of the least singular value may have to be reversed.
    signs[(2, 2)] = (u * v).determinant().signum();
    let rotation = u * signs * v;
    [0, 1, 2].map(|i| [0, 1, 2].map(|j| rotation[(i, j)]))
}

/// A marker at the end of a rod on a body.
#[derive(Clone, Copy)]
struct JointMarker {
    /// Position of the joint at rest, m.
    rest: Vector<f64>,
    /// Recorded position, m.
    position: Vector<f64>,
}

/// Bodies with the markers at their joints.
struct PosedBodies {
    /// Markers at the joints of each body.
    joints: Vec<Vec<JointMarker>>,
    /// Rotation of each body from rest.
    turns: Vec<Matrix3<f64>>,
}

impl Structure {
    /// Unknowns (m, rad) and frames of the assembly with the markers `places` at the positions that `at` returns, m. An
    /// error for a structure in a plane, and for a rod with fewer than two markers and joints with markers.
    pub(super) fn pose_at(
        &self,
        places: &[MarkerPlace],
        at: impl Fn(&MarkerPlace) -> Vector<f64>,
    ) -> Result<(Vec<f64>, AssemblyFrames<f64>), Error> {
        let Assembly::Space(rods) = &self.at_rest.assembly else {
            let allowed = "\"rest\" or \"equilibrium\", for a structure in a plane";
            return Err(Error::invalid("initial.state", "\"recorded\"", allowed));
        };
        let (mut q, mut frames) = (self.at_rest.q.clone(), self.at_rest.frames.clone());
        let (bodies, first) = (rods.bodies(), rods.body_coordinates().start);
        let ranges = self.at_rest.assembly.rod_ranges();
        let mut posed = PosedBodies {
            joints: self.joints_at(places, &at),
            turns: vec![identity(); bodies.bodies.len()],
        };
        for (r, range) in ranges.iter().enumerate() {
            let knots = self.knots(r, places, &at, &posed.joints)?;
            for (i, s) in self.at_rest.meshes[r].arc_length.iter().enumerate() {
                q[range.start + 4 * i..][..3].copy_from_slice(&between(&knots, *s));
            }
        }
        let tangents: Vec<Vec<Vector<f64>>> = ranges
            .iter()
            .map(|range| {
                let node = |i: usize| [q[4 * i], q[4 * i + 1], q[4 * i + 2]];
                let nodes = range.start / 4..range.end.div_ceil(4) - 1;
                nodes.map(|i| unit(sub(node(i + 1), node(i)))).collect()
            })
            .collect();
        for b in 0..bodies.bodies.len() {
            self.turn_body(b, bodies, &tangents, &mut posed, &mut q[first..], &mut frames);
        }
        for (r, range) in ranges.iter().enumerate() {
            self.turn_rod(r, bodies, &tangents[r], &posed, &mut q[range.clone()], &mut frames);
        }
        Ok((q, frames))
    }

    /// The markers at the joints of each body. For each end of a rod on the body it is the first marker within
    /// [`AT_JOINT`] lengths of the longest rod from the joint at rest, if there is one.
    fn joints_at(
        &self,
        places: &[MarkerPlace],
        at: impl Fn(&MarkerPlace) -> Vector<f64>,
    ) -> Vec<Vec<JointMarker>> {
        let plan = &self.blueprint.plan;
        let longest = self.at_rest.meshes.iter().map(|mesh| mesh.length).fold(0.0, f64::max);
        let mut joints = vec![Vec::new(); plan.bodies.len()];
        for (r, ends) in plan.ends.iter().enumerate() {
            for (end, hold) in ends.iter().enumerate() {
                let EndSupport::Body { body, .. } = *hold else { continue };
                let joint = end_point(&self.at_rest.meshes[r].nodes, end, hold.support());
                let near = places.iter().find(|place| {
                    let apart = sub(place.rest, joint);
                    dot(apart, apart).sqrt() <= AT_JOINT * longest
                });
                if let Some(place) = near {
                    joints[body].push(JointMarker { rest: joint, position: at(place) });
                }
            }
        }
        joints
    }

    /// Arc lengths and recorded positions of the markers on rod `r`, and of its ends on bodies with markers at joints,
    /// in ascending order. Such an end has the position of the nearest of these markers, displaced as the joints are at
    /// rest. Of neighbors closer than [`AT_JOINT`] of the rod's length only the first remains. An error for fewer than
    /// two points.
    fn knots(
        &self,
        r: usize,
        places: &[MarkerPlace],
        at: impl Fn(&MarkerPlace) -> Vector<f64>,
        joints: &[Vec<JointMarker>],
    ) -> Result<Vec<Knot>, Error> {
        let mesh = &self.at_rest.meshes[r];
        let own = places.iter().filter(|place| place.rod == r);
        let mut knots: Vec<Knot> =
            own.map(|place| Knot { arc_length: place.arc_length, position: at(place) }).collect();
        for (end, hold) in self.blueprint.plan.ends[r].iter().enumerate() {
            let EndSupport::Body { body, .. } = *hold else { continue };
            let joint = end_point(&mesh.nodes, end, hold.support());
            let distance = |marker: &JointMarker| {
                let apart = sub(marker.rest, joint);
                dot(apart, apart)
            };
            let nearest = joints[body].iter().min_by(|a, b| distance(a).total_cmp(&distance(b)));
            if let Some(marker) = nearest {
                let arc_length = if end == 0 { 0.0 } else { mesh.length };
                let position = add(marker.position, sub(joint, marker.rest));
                knots.push(Knot { arc_length, position });
            }
        }
        knots.sort_by(|a, b| a.arc_length.total_cmp(&b.arc_length));
        knots.dedup_by(|a, b| (a.arc_length - b.arc_length).abs() <= AT_JOINT * mesh.length);
        if knots.len() < 2 {
            let name = &self.scene.rods[r].name;
            let found = format!("{} marker on the rod {name}", knots.len());
            let allowed = "two markers on every rod, or at its joints, to start from a recording";
            return Err(Error::invalid("recording.markers", found, allowed));
        }
        Ok(knots)
    }

    /// Sets center, m, and rotation of body `b` in the coordinates `z` and the `frames`, and its entry of `posed`. The
    /// rotation, of a body that rotates, is the [best one](best_rotation) from the directions of its rod ends at rest
    /// to those in `tangents`. The center follows from the last marker at a joint; without one it stays.
    fn turn_body(
        &self,
        b: usize,
        bodies: &SpatialBodies<f64>,
        tangents: &[Vec<Vector<f64>>],
        posed: &mut PosedBodies,
        z: &mut [f64],
        frames: &mut AssemblyFrames<f64>,
    ) {
        let mut pairs = Vec::new();
        for (r, ends) in self.blueprint.plan.ends.iter().enumerate() {
            for (end, hold) in ends.iter().enumerate() {
                let EndSupport::Body { body, .. } = *hold else { continue };
                if body != b {
                    continue;
                }
                let nodes = &self.at_rest.meshes[r].nodes;
                let [outer, inner] = end_nodes(nodes.len(), end).map(|i| nodes[i]);
                let edge = if end == 0 { 0 } else { nodes.len() - 2 };
                let sign = if end == 0 { 1.0 } else { -1.0 };
                pairs.push([unit(sub(inner, outer)), scale(tangents[r][edge], sign)]);
            }
        }
        let body = &bodies.bodies[b];
        if let Some(turn) = &body.rotation {
            posed.turns[b] = best_rotation(&pairs);
            let axes = &mut frames.rotations[turn.reference].axes;
            *axes = product(&posed.turns[b], axes);
        }
        if let Some(marker) = posed.joints[b].last() {
            let center = [0, 1, 2].map(|c| z[body.coordinate + c]);
            let arm = times(&posed.turns[b], sub(center, marker.rest));
            let center = add(marker.position, arm);
            z[body.coordinate..][..3].copy_from_slice(&center);
        }
    }

    /// Sets frames and angles of rod `r`, with the `tangents` of its edges, in `q` and `frames`, and the rotations of
    /// its sprung clamps. The directors are transported in parallel along the rod. They start from a body at a clamped
    /// start, or else from one at a clamped end. Without both the director of the first edge at rest is rotated by the
    /// smallest rotation to its tangent. With bodies at both ends the difference at the second one is distributed
    /// evenly over the angles of the edges.
    fn turn_rod(
        &self,
        r: usize,
        bodies: &SpatialBodies<f64>,
        tangents: &[Vector<f64>],
        posed: &PosedBodies,
        q: &mut [f64],
        frames: &mut AssemblyFrames<f64>,
    ) {
        let (rest, last) = (&self.at_rest.frames, tangents.len() - 1);
        let mut directors = [None; 2];
        for (end, hold) in self.blueprint.plan.ends[r].iter().enumerate() {
            let EndSupport::Body { body, spring, .. } = *hold else { continue };
            if hold.support() != Support::Clamped {
                continue;
            }
            let edge = if end == 0 { 0 } else { last };
            let frame = &rest.rods[r].edges[edge];
            let mut turn = posed.turns[body];
            if let Some(spring) = spring {
                let swing = smallest_rotation(times(&turn, frame.tangent), tangents[edge]);
                turn = product(&swing, &turn);
                let rotation = &bodies.springs[spring].rotation;
                let axes = rest_axes(Some(rotation), &rest.rotations);
                frames.rotations[rotation.reference].axes = product(&turn, &axes);
            }
            let moved = EdgeFrame {
                tangent: times(&turn, frame.tangent),
                director: times(&turn, frame.director),
            };
            directors[end] = Some(moved.transported(tangents[edge]).director);
        }
        let backward = |director: Vector<f64>| {
            let mut frame = EdgeFrame { tangent: tangents[last], director };
            for tangent in tangents.iter().rev() {
                frame = frame.transported(*tangent);
            }
            frame.director
        };
        let free = || {
            let frame = &rest.rods[r].edges[0];
            let swing = smallest_rotation(frame.tangent, tangents[0]);
            times(&swing, frame.director)
        };
        let director = directors[0].or(directors[1].map(backward)).unwrap_or_else(free);
        let own = Frames::bishop(tangents, director);
        // The rotation that is missing at a second body.
        let missing = directors[1].filter(|_| directors[0].is_some()).map_or(0.0, |to| {
            let EdgeFrame { tangent, director } = own.edges[last];
            dot(tangent, cross(director, to)).atan2(dot(director, to))
        });
        for j in 0..=last {
            q[4 * j + 3] = missing * j as f64 / last.max(1) as f64;
        }
        frames.rods[r] = own;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::rotation::column;
    use crate::scene::StructureScene;

    /// A body with two rods, whose joints are 0.1 m apart, and a marker at the joint of the first one only. If all
    /// markers are displaced by the same vector, so are all nodes and the center of the body.
    #[test]
    fn body_with_two_joints_follows_the_marker_of_one() {
        let text = r#"
            dimension = "spatial"
            [[rods]]
            name = "a"
            segments = 8
            shape = { kind = "straight", length = 0.2, direction = [1, 0, 0] }
            section = { kind = "circle", radius = 3e-3 }
            material = "rubber"
            [[rods]]
            name = "b"
            segments = 8
            origin = [0.2, 0.3, 0]
            shape = { kind = "straight", length = 0.2, direction = [0, -1, 0] }
            section = { kind = "circle", radius = 3e-3 }
            material = "rubber"
            [[materials]]
            name = "rubber"
            density = 1100
            youngs_modulus = 2e7
            poisson_ratio = 0.4
            [[bodies]]
            name = "grip"
            mass = 0.01
            inertia = [1e-6, 1e-6, 1e-6]
            position = [0.2, 0.05, 0]
            [[joints]]
            kind = "rigid"
            connects = [{ body = "grip", offset = [0, -0.05, 0] }, { rod = "a", at = "end" }]
            [[joints]]
            kind = "rigid"
            connects = [{ body = "grip", offset = [0, 0.05, 0] }, { rod = "b", at = "end" }]
            [[supports]]
            of = { rod = "a", at = "start" }
            kind = "clamped"
            [[supports]]
            of = { rod = "b", at = "start" }
            kind = "clamped"
        "#;
        let structure = Structure::new(StructureScene::from_toml(text, ".").unwrap()).unwrap();
        let marker = |rod: usize, arc_length: f64, rest: Vector<f64>| MarkerPlace {
            rod,
            arc_length,
            rest,
            marker: 0,
            is_held: false,
        };
        let places = [
            marker(0, 0.1, [0.1, 0.0, 0.0]),
            marker(0, 0.2, [0.2, 0.0, 0.0]),
            marker(1, 0.1, [0.2, 0.2, 0.0]),
        ];
        let way = [0.01, 0.02, 0.03];
        let (q, _) = structure.pose_at(&places, |place| add(place.rest, way)).unwrap();
        let at_rest = &structure.at_rest;
        let Assembly::Space(rods) = &at_rest.assembly else { panic!("a structure in a plane") };
        let nodes = at_rest.assembly.rod_ranges().into_iter().flat_map(|range| range.step_by(4));
        let center = rods.body_coordinates().start + rods.bodies().bodies[0].coordinate;
        for i in nodes.chain([center]) {
            for c in 0..3 {
                let moved = q[i + c] - at_rest.q[i + c];
                assert!((moved - way[c]).abs() < 1e-12, "{i} {c}: {moved}");
            }
        }
    }

    /// A rotation is recovered from three rotated vectors, and from two.
    #[test]
    fn best_rotation_of_rotated_vectors_is_their_rotation() {
        let turn = exponential([0.3, -1.2, 0.7]);
        let vectors = [[1.0, 0.0, 0.0], [-0.6, 0.8, 0.0], [0.0, 0.6, 0.8]];
        for count in [2, 3] {
            let pairs: Vec<_> = vectors[..count].iter().map(|v| [*v, times(&turn, *v)]).collect();
            let found = best_rotation(&pairs);
            for i in 0..3 {
                let (a, b) = (column(&found, i), column(&turn, i));
                assert!((0..3).all(|c| (a[c] - b[c]).abs() < 1e-12), "{count}");
            }
        }
    }
}
