//! Supports that move: where the held nodes and edges are at a time.
//!
//! A moved end turns as a rigid body about its own point and is then displaced,
//!
//! ```text
//! x = c + u + exp(r) (x0 - c)
//! ```
//!
//! and a wall turns its edge about itself by the twist besides. Displacements, rotation vectors and
//! twists of several motions of one end are added. A recorded end has its nodes where markers were seen;
//! its angles stay what they are, against references that go along by parallel transport, or are free. Nodes between the
//! ends may be led likewise. The masses of held and of free unknowns are
//! apart, so that a step needs to know no more than where the supports are at its end. All vectors
//! are in the model's axes; in the plane the third component is zero.

use crate::error::Error;
use crate::numerics::scalar::{Nestable, Scalar};
use crate::numerics::vector::{Vector, add, dot, rotate, scale, sub};
use crate::problem::model::Model;
use crate::rod::Rod;
use crate::scene::supports::Moment;
use crate::scene::{End, Motion, Track};
use num_dual::{Dual, Dual2_64, Dual64};
use std::f64::consts::TAU;
use std::sync::Arc;

/// The ends that supports hold.
#[derive(Clone, Debug)]
pub struct BoundaryMotion<D = f64> {
    ends: Vec<MovedEnd<D>>,
    recorded: Vec<RecordedPart>,
    /// Unknowns from one node to the next.
    stride: usize,
}

/// An end that a support holds, and may move.
#[derive(Clone, Debug)]
pub struct MovedEnd<D = f64> {
    /// The end that is held.
    pub end: End,
    /// The motions it is given, vectors in the model's axes.
    pub motions: Vec<Motion<D>>,
    /// The model's axes in the world, for motions that were recorded.
    pub axes: [[f64; 3]; 3],
    /// The point it turns about, m.
    pub centre: Vector<D>,
    /// Held nodes, and where they are without motion, m.
    pub nodes: Vec<(usize, Vector<D>)>,
    /// The held edge with its tangent and its first material director without motion.
    pub edge: Option<(usize, [Vector<D>; 2])>,
}

/// A part of the rod, an end or nodes between the ends, that goes as markers were seen to go.
#[derive(Clone, Debug)]
pub struct RecordedPart {
    /// The recording.
    pub track: Arc<Track>,
    /// Held nodes, each with the two markers it stands between and its part of the way from one to the
    /// other.
    pub nodes: Vec<(usize, [usize; 2], f64)>,
    /// The model's axes in the world.
    pub axes: [[f64; 3]; 3],
}

impl RecordedPart {
    /// The held nodes and where they are at a time, s, in the model's axes, m.
    fn places<D: Scalar>(&self, time: D) -> impl Iterator<Item = (usize, Vector<D>)> {
        self.nodes.iter().map(move |(node, [from, to], part)| {
            let markers = self.track.markers();
            let mut x = markers[*from].at(time);
            if *part != 0.0 {
                x = add(
                    scale(x, D::from(1.0 - part)),
                    scale(markers[*to].at(time), D::from(*part)),
                );
            }
            (*node, along(&self.axes, x))
        })
    }
}

/// The components of a vector along some axes.
fn along<D: Scalar>(axes: &[[f64; 3]; 3], x: Vector<D>) -> Vector<D> {
    axes.map(|axis| x[0] * axis[0] + x[1] * axis[1] + x[2] * axis[2])
}

/// The time of a moment, s; on the way to a state at rest recorded ends are where they start.
fn time<D: Scalar>(moment: Moment<D>) -> D {
    match moment {
        Moment::Time(time) => time,
        Moment::Approach { .. } => D::from(0.0),
    }
}

/// A rigid motion.
#[derive(Clone, Copy, Debug)]
struct Pose<D> {
    displacement: Vector<D>,
    rotation: Vector<D>,
    twist: D,
}

impl<D: Scalar> MovedEnd<D> {
    fn pose(&self, moment: Moment<D>) -> Pose<D> {
        let zero = D::from(0.0);
        let mut pose = Pose { displacement: [zero; 3], rotation: [zero; 3], twist: zero };
        for motion in &self.motions {
            let fraction = motion.fraction(moment);
            let share = |v: [D; 3]| v.map(|c| fraction * c);
            pose.displacement = add(pose.displacement, share(motion.displacement));
            pose.rotation = add(pose.rotation, share(motion.rotation));
            pose.twist += fraction * motion.twist;
            if let Some(x) = motion.recorded(moment) {
                pose.displacement = add(pose.displacement, along(&self.axes, x));
            }
        }
        pose
    }

    /// Where the pose takes a point.
    fn moved(&self, pose: &Pose<D>, point: Vector<D>) -> Vector<D> {
        let arm = sub(point, self.centre);
        add(add(self.centre, pose.displacement), rotate(pose.rotation, arm))
    }
}

impl<D: Scalar> MovedEnd<D> {
    /// The same over other numbers, such as ones that carry rates in time; its nodes only.
    fn over<E: Scalar>(&self, to: impl Fn(D) -> E + Copy) -> MovedEnd<E> {
        MovedEnd {
            end: self.end,
            motions: self.motions.iter().map(|motion| motion.map(to)).collect(),
            axes: self.axes,
            centre: self.centre.map(to),
            nodes: self.nodes.iter().map(|(i, x)| (*i, x.map(to))).collect(),
            edge: None,
        }
    }
}

impl<D: Nestable> BoundaryMotion<D> {
    /// The motion of these ends, for a model's unknowns.
    pub fn new<M: Model>(ends: Vec<MovedEnd<D>>, recorded: Vec<RecordedPart>) -> Self {
        Self { ends, recorded, stride: M::STRIDE }
    }

    /// Whether its numbers can be parameters: a recording has none.
    pub fn has_numbers(&self) -> bool {
        !self.ends.is_empty()
    }

    /// The unknowns that it leads, and those of them that are angles.
    pub fn led(&self) -> [Vec<usize>; 2] {
        let axes = self.stride.min(3);
        let ends = self.ends.iter().flat_map(|end| end.nodes.iter().map(|(node, _)| *node));
        let recorded = self.recorded.iter().flat_map(|end| end.nodes.iter().map(|(i, ..)| *i));
        let nodes = ends.chain(recorded).flat_map(|i| self.stride * i..self.stride * i + axes);
        let edges = self.ends.iter().filter_map(|end| end.edge.as_ref());
        let angles: Vec<usize> = edges.map(|(edge, _)| self.stride * edge + axes).collect();
        [nodes.chain(angles.iter().copied()).collect(), angles]
    }

    /// Moves the held unknowns of `q`, which are where `from` puts them, to where `to` does.
    pub fn advance<R: Rod<D>>(
        &self,
        from: Moment<f64>,
        to: Moment<f64>,
        q: &mut [D],
        frames: &R::Frames,
    ) {
        let axes = self.stride.min(3);
        for end in &self.recorded {
            for (node, place) in end.places(time(to)) {
                for c in 0..axes {
                    q[self.stride * node + c] = D::from(place[c]);
                }
            }
        }
        for end in &self.ends {
            let pose = end.pose(to.map(D::from));
            for (node, point) in &end.nodes {
                let position = end.moved(&pose, *point);
                q[self.stride * node..][..axes].copy_from_slice(&position[..axes]);
            }
            if let Some((edge, [tangent, director])) = end.edge {
                let about = tangent.map(|c| c * pose.twist);
                let director = rotate(pose.rotation, rotate(about, director));
                let turn = pose.twist - end.pose(from.map(D::from)).twist;
                R::align(q, frames, edge, director, turn.value());
            }
        }
    }

    /// Writes the velocities of the held nodes, m/s.
    pub fn velocities(&self, time: f64, v: &mut [D]) {
        for end in &self.recorded {
            for (node, place) in end.places(Dual64::new(time, 1.0)) {
                for c in 0..self.stride.min(3) {
                    v[self.stride * node + c] = D::from(place[c].eps);
                }
            }
        }
        for end in &self.ends {
            let end = end.over(Dual::from_re);
            let pose = end.pose(Moment::Time(Dual::new(D::from(time), D::from(1.0))));
            for (node, point) in &end.nodes {
                let position = end.moved(&pose, *point);
                for c in 0..self.stride.min(3) {
                    v[self.stride * node + c] = position[c].eps;
                }
            }
        }
    }
}

impl BoundaryMotion<Dual64> {
    /// Whether it changes with the parameter that its numbers carry.
    pub fn changes(&self) -> bool {
        let seen = std::cell::Cell::new(false);
        let see = |x: Dual64| seen.set(seen.get() || x.eps != 0.0);
        for end in &self.ends {
            end.motions.iter().for_each(|motion| drop(motion.map(see)));
            let edge = end.edge.iter().flat_map(|(_, vectors)| vectors);
            let nodes = end.nodes.iter().map(|(_, x)| x);
            nodes.chain(edge).chain([&end.centre]).flatten().for_each(|x| see(*x));
        }
        seen.get()
    }
}

impl BoundaryMotion {
    /// Writes the accelerations of the held nodes, m/s^2.
    pub fn accelerations(&self, time: f64, a: &mut [f64]) {
        for end in &self.recorded {
            for (node, place) in end.places(Dual2_64::from_re(time).derivative()) {
                for c in 0..self.stride.min(3) {
                    a[self.stride * node + c] = place[c].v2;
                }
            }
        }
        for end in &self.ends {
            let end = end.over(Dual2_64::from_re);
            let pose = end.pose(Moment::Time(Dual2_64::from_re(time).derivative()));
            for (node, point) in &end.nodes {
                let position = end.moved(&pose, *point);
                for c in 0..self.stride.min(3) {
                    a[self.stride * node + c] = position[c].v2;
                }
            }
        }
    }

    /// Takes the whole rod along from one moment to another: node `i` goes as far as
    /// `weight(end, i)` says of the end's own way, a first guess for the rod between moved ends.
    pub fn carry(
        &self,
        from: Moment<f64>,
        to: Moment<f64>,
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
                // Back to where it would be without motion, and on.
                let arm = sub(sub(x, end.centre), start.displacement);
                let still = rotate(start.rotation.map(|r| -r), arm);
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

    /// Into how many stages the way from no motion to all of it should be cut.
    ///
    /// # Errors
    /// More than [`MOST_STAGES`].
    pub fn stages(&self, length: f64, settled: bool) -> Result<usize, Error> {
        let size = |v: Vector<f64>| dot(v, v).sqrt();
        let way = |end: &MovedEnd| {
            let pose = end.pose(Moment::Approach { progress: 1.0, settled });
            (size(pose.displacement) / (LARGEST_SHIFT * length))
                .max(size(pose.rotation) / LARGEST_TURN)
                .max(pose.twist.abs() / LARGEST_TWIST)
        };
        let stages = self.ends.iter().map(way).fold(1.0, f64::max).ceil();
        if stages > MOST_STAGES {
            let turns = |angle: f64| (MOST_STAGES * angle / TAU).floor();
            let allowed = format!(
                "a displacement of {} rod lengths, a rotation of {} turns and a twist of {} turns at most",
                MOST_STAGES * LARGEST_SHIFT,
                turns(LARGEST_TURN),
                turns(LARGEST_TWIST)
            );
            let found = format!("an end that is {stages:.1e} times too far for one step");
            return Err(Error::invalid("supports.motion", found, allowed));
        }
        Ok(stages as usize)
    }
}

/// Ends of a rod that comes to rest are displaced by this part of its length at a time, turned by
/// so many radians, and twisted.
const LARGEST_SHIFT: f64 = 0.02;
const LARGEST_TURN: f64 = 0.1;
const LARGEST_TWIST: f64 = 0.5;
/// Stages of one equilibrium, at most: 400 rod lengths of displacement, or 1591 turns of twist.
const MOST_STAGES: f64 = 20_000.0;
