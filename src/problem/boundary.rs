//! Prescribed motion of the supports: positions, velocities and accelerations of held nodes and edges at a time.
//!
//! A moved end is rotated as a rigid body about its own point and then displaced,
//!
//! ```text
//! x = c + u + exp(r) (x0 - c)
//! ```
//!
//! with the displacement u, the rotation vector r and the point c. A wall also rotates its edge about the rod by the
//! twist. A recorded pose of a gripper is one more displacement, and a rotation before that by r. Displacements,
//! rotation vectors and twists of several motions of one end are added. The nodes of a recorded end are at the recorded
//! markers; its angles are constant relative to the parallel-transported frame, or free. Nodes between the ends may be
//! prescribed likewise. The mass matrix does not couple held and free unknowns, so that a step requires only the
//! positions of the supports at its end. All vectors are in the axes of the model; in the plane the third component is
//! zero. [`BoundaryMotion`] overwrites the entries of held and recorded nodes in lists of all unknowns with positions
//! (`advance`, m, with the angles of held edges), velocities (m/s) and accelerations (m/s^2). `prescribed` lists all
//! prescribed unknowns, and their angles alone. `has_numbers` returns whether the motion depends on numbers of the
//! scene, `changes` whether any of these has a derivative. Steppers, equilibria and sensitivities use it. For
//! equilibria, which move ends in stages, `stages` returns their number; more than `MOST_STAGES` are an error. `carry`
//! moves all nodes by weighted motions of the ends, as the initial guess of a stage.
//!
//! `MovedEnd` is an end that a support holds, with its nodes (`HeldNode`) and, at a clamp, its edge (`HeldEdge`)
//! without motion. `RecordedPart` is a part of the rod that follows recorded markers.

use crate::energy::frame::EdgeFrame;
use crate::error::Error;
use crate::numerics::rotation::{
    Matrix3, exponential, product, rotation_vector, times, transpose, transposed_times,
};
use crate::numerics::scalar::{RodScalar, Scalar};
use crate::numerics::vector::{Vector, add, cross, dot, rotate, scale, sub};
use crate::problem::model::Model;
use crate::rod::{ReferenceFrames, Rod};
use crate::scene::gripper_pose::EndPose;
use crate::scene::path::RecordedNode;
use crate::scene::prescribed_motion::MotionTime;
use crate::scene::{End, Motion, Track};
use num_dual::{Dual, Dual2, Dual64};
use std::f64::consts::TAU;
use std::sync::Arc;

/// Largest displacement of an end per stage of an equilibrium, as a fraction of the rod length. Newton's method
/// converges from one stage to the next; smaller stages take longer.
const LARGEST_SHIFT: f64 = 0.02;

/// Largest rotation of an end per stage, rad.
const LARGEST_TURN: f64 = 0.1;

/// Largest twist of an end per stage, rad.
const LARGEST_TWIST: f64 = 0.5;

/// Largest number of stages of one equilibrium: 400 rod lengths of displacement, or 1591 turns of twist.
const MOST_STAGES: f64 = 20_000.0;

/// Prescribed motion of the held nodes and edges of a rod.
#[derive(Clone, Debug)]
pub struct BoundaryMotion<D = f64> {
    ends: Vec<MovedEnd<D>>,
    recorded: Vec<RecordedPart>,
    /// Number of unknowns from one node to the next.
    stride: usize,
}

/// End that a support holds, and may move.
#[derive(Clone, Debug)]
pub struct MovedEnd<D = f64> {
    /// The held end.
    pub end: End,
    /// Its motions, with vectors in the axes of the model.
    pub motions: Vec<Motion<D>>,
    /// Axes of the model in the world, for recorded motions.
    pub axes: [[f64; 3]; 3],
    /// Center of its rotation, m.
    pub centre: Vector<D>,
    /// Held nodes with their positions without motion.
    pub nodes: Vec<HeldNode<D>>,
    /// Held edge with its axes without motion.
    pub edge: Option<HeldEdge<D>>,
}

/// Held node of an end and its position without motion, m.
#[derive(Clone, Debug)]
pub struct HeldNode<D = f64> {
    /// Index of the node.
    pub node: usize,
    /// Position without motion, m.
    pub position: Vector<D>,
}

/// Held edge of a clamped end and its axes without motion.
#[derive(Clone, Copy, Debug)]
pub struct HeldEdge<D = f64> {
    /// Index of the edge.
    pub edge: usize,
    /// Unit tangent without motion.
    pub tangent: Vector<D>,
    /// First material director without motion.
    pub director: Vector<D>,
}

/// Part of the rod, an end or nodes between the ends, that follows recorded markers.
#[derive(Clone, Debug)]
pub struct RecordedPart {
    /// The recording.
    pub track: Arc<Track>,
    /// Held nodes with the markers that they follow.
    pub nodes: Vec<RecordedNode>,
    /// Axes of the model in the world.
    pub axes: [[f64; 3]; 3],
}

impl RecordedPart {
    /// Index and position, m, in the axes of the model, of each held node at a time, s. The position is that of its
    /// marker, or a point on the chord between two markers.
    fn positions<D: Scalar>(&self, time: D) -> impl Iterator<Item = (usize, Vector<D>)> {
        self.nodes.iter().map(move |held| {
            let ([from, to], part) = (held.markers.map(|j| &self.track.markers()[j]), held.part);
            let mut x = from.at(time);
            if part != 0.0 {
                x = add(scale(x, D::from(1.0 - part)), scale(to.at(time), D::from(part)));
            }
            (held.node, along(&self.axes, x))
        })
    }
}

/// The three scalar products of the vector `x` of the world with the axes of the model.
fn along<D: Scalar>(axes: &[[f64; 3]; 3], x: Vector<D>) -> Vector<D> {
    axes.map(|axis| x[0] * axis[0] + x[1] * axis[1] + x[2] * axis[2])
}

/// The time, s, at which recorded motions are evaluated: that of a simulation, or 0 in the search for an equilibrium.
fn time<D: Scalar>(moment: MotionTime<D>) -> D {
    match moment {
        MotionTime::Time(time) => time,
        MotionTime::Approach { .. } => D::from(0.0),
    }
}

/// Rigid motion of an end: displacement, m, rotation vector, rad, and twist about the rod, rad. The rotation by a
/// recorded pose precedes that of the vector.
#[derive(Clone, Copy, Debug)]
struct Pose<D> {
    displacement: Vector<D>,
    recorded: Option<Matrix3<D>>,
    rotation: Vector<D>,
    twist: D,
}

impl<D: Scalar> Pose<D> {
    /// The vector `v` of the end rotated by the recorded pose, then by the rotation vector.
    fn rotated(&self, v: Vector<D>) -> Vector<D> {
        rotate(self.rotation, self.recorded.as_ref().map_or(v, |recorded| times(recorded, v)))
    }
}

impl<D: Scalar> MovedEnd<D> {
    /// Sum of displacements, rotation vectors and twists of all motions of the end, each times its factor. `at` is a
    /// time or a fraction of the approach to an equilibrium. Recorded displacements since t = 0 are added at a time,
    /// not in an approach.
    fn pose(&self, at: MotionTime<D>) -> Pose<D> {
        let zero = D::from(0.0);
        let mut pose =
            Pose { displacement: [zero; 3], recorded: None, rotation: [zero; 3], twist: zero };
        // Displacements, rotation vectors and twists of all motions of an end are added.
        for motion in &self.motions {
            let fraction = motion.factor(at);
            let share = |v: [D; 3]| v.map(|c| fraction * c);
            pose.displacement = add(pose.displacement, share(motion.displacement));
            pose.rotation = add(pose.rotation, share(motion.rotation));
            pose.twist += fraction * motion.twist;
            if let Some(x) = motion.recorded_displacement(at) {
                pose.displacement = add(pose.displacement, along(&self.axes, x));
            }
            if motion.pose.is_some()
                && let Some((displacement, rotation)) = self.recorded_pose(motion, at)
            {
                pose.displacement = add(pose.displacement, displacement);
                pose.recorded = Some(rotation);
            }
        }
        pose
    }

    /// Displacement, m, and rotation matrix that move the end from its place without motion to the recorded pose of
    /// `motion`. At a progress f of the search for an equilibrium they are f times the displacement, and the rotation
    /// about the same axis by f times the angle, at t = 0. `None` without an edge or a recorded pose.
    fn recorded_pose(
        &self,
        motion: &Motion<D>,
        at: MotionTime<D>,
    ) -> Option<(Vector<D>, Matrix3<D>)> {
        let HeldEdge { tangent, director, .. } = self.edge?;
        let EndPose { position, axes } = motion.end_pose(time(at))?;
        let displacement = sub(along(&self.axes, position), self.centre);
        let directions = transpose(&axes).map(|direction| along(&self.axes, direction));
        let still = [tangent, director, cross(tangent, director)];
        // Both matrices have a direction in each row.
        let rotation = product(&transpose(&directions), &still);
        let MotionTime::Approach { progress, .. } = at else {
            return Some((displacement, rotation));
        };
        let whole = rotation_vector(&rotation.map(|row| row.map(|c| c.value())));
        let missing = exponential(whole.map(|c| (progress - 1.0) * c));
        Some((scale(displacement, progress), product(&missing, &rotation)))
    }

    /// Position, m, of `point` of the end after the motion `pose`: `c + u + exp(r) Q (point - c)` with the center c of
    /// the end and the recorded rotation Q. The twist has no effect.
    fn moved(&self, pose: &Pose<D>, point: Vector<D>) -> Vector<D> {
        let arm = sub(point, self.centre);
        add(add(self.centre, pose.displacement), pose.rotated(arm))
    }
}

impl<D: Scalar> MovedEnd<D> {
    /// Moves all nodes in `q`, in space, and the `frames` of all edges rigidly, so that the end has its recorded pose
    /// at t = 0. No operation without one. The numbers of this end are those without motion.
    pub fn place(&self, q: &mut [D], frames: &mut [EdgeFrame<D>]) {
        let start = MotionTime::Time(D::from(0.0));
        let mut own = self.motions.iter().filter(|motion| motion.pose.is_some());
        let Some((displacement, rotation)) = own.find_map(|own| self.recorded_pose(own, start))
        else {
            return;
        };
        let center = add(self.centre, displacement);
        for node in q.chunks_mut(4) {
            let place = [node[0], node[1], node[2]];
            let moved = add(center, times(&rotation, sub(place, self.centre)));
            node[..3].copy_from_slice(&moved);
        }
        for frame in frames {
            frame.tangent = times(&rotation, frame.tangent);
            frame.director = times(&rotation, frame.director);
        }
    }
}

impl<D: Scalar> MovedEnd<D> {
    /// The end with all numbers converted by `to`, such as to dual numbers in time.
    fn over<E: Scalar>(&self, to: impl Fn(D) -> E + Copy) -> MovedEnd<E> {
        MovedEnd {
            end: self.end,
            motions: self.motions.iter().map(|motion| motion.map(to)).collect(),
            axes: self.axes,
            centre: self.centre.map(to),
            nodes: (self.nodes.iter())
                .map(|held| HeldNode { node: held.node, position: held.position.map(to) })
                .collect(),
            edge: self.edge.map(|held| HeldEdge {
                edge: held.edge,
                tangent: held.tangent.map(to),
                director: held.director.map(to),
            }),
        }
    }
}

impl<D: RodScalar> BoundaryMotion<D> {
    /// Prescribed motion of these held ends and recorded parts, for lists of unknowns of the model `M`.
    pub fn new<M: Model>(ends: Vec<MovedEnd<D>>, recorded: Vec<RecordedPart>) -> Self {
        Self { ends, recorded, stride: M::STRIDE }
    }

    /// Whether the motion depends on numbers of the scene: whether an end is clamped or pinned, moved or not. A
    /// recording has no such numbers.
    pub fn has_numbers(&self) -> bool {
        !self.ends.is_empty()
    }

    /// Indices of all prescribed unknowns (coordinates of held and recorded nodes, then angles of held edges), and of
    /// the angles alone.
    pub fn prescribed(&self) -> [Vec<usize>; 2] {
        let axes = self.stride.min(3);
        let ends = self.ends.iter().flat_map(|end| end.nodes.iter().map(|held| held.node));
        let recorded = self.recorded.iter().flat_map(|end| end.nodes.iter().map(|held| held.node));
        let nodes = ends.chain(recorded).flat_map(|i| self.stride * i..self.stride * i + axes);
        let edges = self.ends.iter().filter_map(|end| end.edge.as_ref());
        let angles: Vec<usize> = edges.map(|held| self.stride * held.edge + axes).collect();
        [nodes.chain(angles.iter().copied()).collect(), angles]
    }

    /// Overwrites the coordinates of held and recorded nodes in `q` by their positions at the time `to`. The angle of a
    /// held edge is set so that its director has the prescribed direction. Of angles that differ by whole turns, that
    /// nearest to the present angle plus the change of twist since `from` is taken. `frames` are the references of the
    /// angles.
    pub fn advance<R: Rod<D>>(
        &self,
        from: MotionTime<f64>,
        to: MotionTime<f64>,
        q: &mut [D],
        frames: &R::Frames,
    ) {
        let axes = self.stride.min(3);
        // Recorded nodes are at their markers.
        for end in &self.recorded {
            for (node, place) in end.positions(time(to)) {
                for c in 0..axes {
                    q[self.stride * node + c] = D::from(place[c]);
                }
            }
        }
        for end in &self.ends {
            // Held nodes move as a rigid body, and the held edge is rotated about the rod in
            // addition.
            let pose = end.pose(to.map(D::from));
            for HeldNode { node, position } in &end.nodes {
                let position = end.moved(&pose, *position);
                q[self.stride * node..][..axes].copy_from_slice(&position[..axes]);
            }
            if let Some(HeldEdge { edge, tangent, director }) = end.edge {
                let about = tangent.map(|c| c * pose.twist);
                let director = pose.rotated(rotate(about, director));
                // Frames are aligned on the turn nearest to the change of twist, which may be
                // above half a turn.
                let turn = pose.twist - end.pose(from.map(D::from)).twist;
                frames.align(q, edge, director, turn.value());
            }
        }
    }

    /// Overwrites the velocities of the coordinates of held and recorded nodes in `v`, m/s, at a time, s. They are
    /// derivatives of the positions in dual numbers. Rates of angles are unchanged.
    pub fn velocities(&self, time: f64, v: &mut [D]) {
        // Derivative by time in dual numbers, of the same function as the position.
        let now = Dual::new(D::from(time), D::from(1.0));
        self.write_rates(now, Dual::from_re, |rate| rate.eps, v);
    }

    /// Overwrites the accelerations of the coordinates of held and recorded nodes in `a`, m/s^2, at a time, s. They are
    /// second derivatives of the positions in dual numbers. Those of angles are unchanged.
    pub fn accelerations(&self, time: f64, a: &mut [D]) {
        let now = Dual2::from_re(D::from(time)).derivative();
        self.write_rates(now, Dual2::from_re, |rate| rate.v2, a);
    }

    /// Overwrites the entries of the coordinates of held and recorded nodes in `rates` by derivatives of their
    /// positions by time. `now` is the time, s, as a dual number, and `convert` returns a number without derivatives by
    /// time. `derivative` takes the wanted derivative from a position.
    fn write_rates<E: Scalar>(
        &self,
        now: E,
        convert: impl Fn(D) -> E + Copy,
        derivative: impl Fn(E) -> D,
        rates: &mut [D],
    ) {
        let mut write = |node: usize, position: [E; 3]| {
            for c in 0..self.stride.min(3) {
                rates[self.stride * node + c] = derivative(position[c]);
            }
        };
        for end in &self.recorded {
            end.positions(now).for_each(|(node, position)| write(node, position));
        }
        for end in &self.ends {
            let end = end.over(convert);
            let pose = end.pose(MotionTime::Time(now));
            end.nodes.iter().for_each(|held| write(held.node, end.moved(&pose, held.position)));
        }
    }
}

impl BoundaryMotion<Dual64> {
    /// Whether any number of the held ends (motions, nodes, edges, centers) has a derivative other than zero by the
    /// parameter of its dual numbers.
    pub fn changes(&self) -> bool {
        let seen = std::cell::Cell::new(false);
        let see = |x: Dual64| seen.set(seen.get() || x.eps != 0.0);
        for end in &self.ends {
            end.motions.iter().for_each(|motion| drop(motion.map(see)));
            let edge = end.edge.iter().flat_map(|held| [&held.tangent, &held.director]);
            let nodes = end.nodes.iter().map(|held| &held.position);
            nodes.chain(edge).chain([&end.centre]).flatten().for_each(|x| see(*x));
        }
        seen.get()
    }
}

impl BoundaryMotion {
    /// Moves all nodes in `q` with the ends, as an initial guess of the next stage of an equilibrium. Each end adds to
    /// node `i` the displacement by its rigid motion between the two times, times `weight(end, i)`. In space the angle
    /// of edge `i` changes by the weight times the change of twist. Recorded ends have no effect.
    pub fn carry(
        &self,
        from: MotionTime<f64>,
        to: MotionTime<f64>,
        q: &mut [f64],
        weight: impl Fn(End, usize) -> f64,
    ) {
        let axes = self.stride.min(3);
        let nodes = q.len().div_ceil(self.stride);
        let before: Vec<f64> = q.to_vec();
        for end in &self.ends {
            let (start, finish) = (end.pose(from), end.pose(to));
            for i in 0..nodes {
                let weight = weight(end.end, i);
                let mut x = [0.0; 3];
                x[..axes].copy_from_slice(&before[self.stride * i..][..axes]);
                // Undo the motion until `from`, then apply that until `to`.
                let arm = sub(sub(x, end.centre), start.displacement);
                let mut still = rotate(start.rotation.map(|r| -r), arm);
                if let Some(recorded) = &start.recorded {
                    still = transposed_times(recorded, still);
                }
                let there = end.moved(&finish, add(still, end.centre));
                for c in 0..axes {
                    q[self.stride * i + c] += weight * (there[c] - x[c]);
                }
                if self.stride == 4 && i + 1 < nodes {
                    q[self.stride * i + 3] += weight * (finish.twist - start.twist);
                }
            }
        }
    }

    /// Number of stages, at least one, in which an equilibrium applies the motions of the ends to a rod of a `length`,
    /// m. Per stage an end moves by at most `LARGEST_SHIFT` lengths, `LARGEST_TURN` and `LARGEST_TWIST`. The motions
    /// are those at t = 0, or after all ramps if `settled`. Recorded markers and displacements require no stages.
    ///
    /// # Errors
    /// More than `MOST_STAGES`.
    pub fn stages(&self, length: f64, settled: bool) -> Result<usize, Error> {
        let size = |v: Vector<f64>| dot(v, v).sqrt();
        // The number of stages that the largest of displacement, rotation and twist requires.
        let stages = |end: &MovedEnd| {
            let pose = end.pose(MotionTime::Approach { progress: 1.0, settled });
            let recorded = pose.recorded.as_ref().map_or(0.0, |own| size(rotation_vector(own)));
            (size(pose.displacement) / (LARGEST_SHIFT * length))
                .max((size(pose.rotation) + recorded) / LARGEST_TURN)
                .max(pose.twist.abs() / LARGEST_TWIST)
        };
        let stages = self.ends.iter().map(stages).fold(1.0, f64::max).ceil();
        // A motion beyond the limit is rejected before the first stage.
        if stages > MOST_STAGES {
            let turns = |angle: f64| (MOST_STAGES * angle / TAU).floor();
            let allowed = format!(
                "a displacement of {} rod lengths, a rotation of {} turns and a twist of {} turns at most",
                MOST_STAGES * LARGEST_SHIFT,
                turns(LARGEST_TURN),
                turns(LARGEST_TWIST)
            );
            let found = format!("a motion {stages:.1e} times the largest one of a single stage");
            return Err(Error::invalid("supports.motion", found, allowed));
        }
        Ok(stages as usize)
    }
}
