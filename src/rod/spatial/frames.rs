//! Reference frames of a rod in space: moves to other unknowns, and the angles measured from them.
//!
//! An angle `theta` of an edge, rad, turns the reference director, transported to the present tangent, to the material
//! director. All functions are those of [`ReferenceFrames`]:
//!
//! - `move_to` transports frames to the edges at `q`; no energy there changes.
//! - `convert_angles` overwrites the angles in `q`, measured from these frames, by those measured from another set;
//!   directors and twists stay.
//! - `untwist` overwrites the angles in `q` so that no joint is twisted, for edges along the tangents of the frames;
//!   that of the first edge stays.
//! - `align` overwrites the angle of one edge in `q` so that it has a given director. Of the possible angles, whole
//!   turns apart, it takes the one nearest to the present angle plus a given rotation.
//! - `director` returns the first material director of an edge in the rod's axes.

use crate::energy::frame::{EdgeFrame, Frames, transported_twist};
use crate::numerics::scalar::RodScalar;
use crate::numerics::vector::{Vector, dot, unit};
use crate::rod::edges::STRIDE;
use crate::rod::frames::ReferenceFrames;
use crate::rod::layout::{Layout, Space};
use crate::rod::spatial::moving::Rebase;
use std::f64::consts::TAU;

impl<D: RodScalar> ReferenceFrames<D> for Frames<D> {
    /// Frames from those of all edges and the reference twists of all joints, rad.
    fn from_parts(edges: Vec<EdgeFrame<D>>, twist: Vec<D>) -> Self {
        Self { edges, twist }
    }

    /// The reference frames of all edges.
    fn edge_frames(&self) -> &[EdgeFrame<D>] {
        &self.edges
    }

    /// The reference twists of all joints, rad.
    fn twists(&self) -> &[D] {
        &self.twist
    }

    /// The frames of all edges and the twists of all joints, mutable.
    fn parts_mut(&mut self) -> (&mut [EdgeFrame<D>], &mut [D]) {
        (&mut self.edges, &mut self.twist)
    }

    /// Moves the frames to the edges at `q` by parallel transport; no energy there changes.
    fn move_to(&mut self, q: &[D]) {
        D::run_sweep(Rebase { q, frames: self });
    }

    /// Overwrites the angles in `q`, measured from these frames, by those measured from the frames `to`. The directors
    /// stay. Of the possible angles, whole turns apart, the first edge gets the one nearest to its old angle, the
    /// others those with which the twist of every joint stays.
    fn convert_angles(&self, q: &mut [D], to: &Self) {
        let count = self.edges.len();
        let tangents: Vec<Vector<D>> = (0..count).map(|j| unit(Space::edge(q, j))).collect();
        let mut before: Option<(D, D)> = None;
        for (j, t) in tangents.iter().enumerate() {
            let theta = STRIDE * j + 3;
            let old = q[theta];
            let [director, _] = self.edges[j].material(*t, old);
            let [d1, d2] = to.edges[j].material(*t, D::from(0.0));
            let angle = dot(director, d2).atan2(dot(director, d1));
            // Whole turns: the first edge's as they were, the others' so that twist stays.
            let expected = match before {
                None => old,
                Some((old_left, new_left)) => {
                    let twist = |frames: &Frames<D>| {
                        let ends = [frames.edges[j - 1].tangent, frames.edges[j].tangent];
                        frames.twist[j - 1] - transported_twist(ends, [tangents[j - 1], *t])
                    };
                    old - old_left + twist(self) - twist(to) + new_left
                }
            };
            let turns = ((expected - angle).value() / TAU).round();
            let new = angle + turns * TAU;
            before = Some((old, new));
            q[theta] = new;
        }
    }

    /// The first material director of edge `j` at `q`, a unit vector in the rod's axes; never `None`.
    fn director(&self, q: &[D], j: usize) -> Option<[D; 3]> {
        Some(self.edges[j].material(unit(Space::edge(q, j)), q[STRIDE * j + 3])[0])
    }

    /// Sets the angles in `q` so that no joint is twisted, for edges along the tangents of these frames: each angle is
    /// the one before less the reference twist of the joint between. The angle of the first edge stays.
    fn untwist(&self, q: &mut [D]) {
        for (j, twist) in self.twist.iter().enumerate() {
            q[STRIDE * (j + 1) + 3] = q[STRIDE * j + 3] - *twist;
        }
    }

    /// Sets the angle of edge `j` in `q` so that its first material director is `director`. Of the possible angles,
    /// whole turns apart, the one nearest to the present angle plus `turn`, rad, is taken.
    fn align(&self, q: &mut [D], j: usize, director: [D; 3], turn: f64) {
        let [d1, d2] = self.edges[j].material(unit(Space::edge(q, j)), D::from(0.0));
        // Any angle plus whole turns has this director; the expected angle selects one.
        let angle = dot(director, d2).atan2(dot(director, d1));
        let theta = &mut q[STRIDE * j + 3];
        let turns = ((*theta + turn - angle).value() / TAU).round();
        *theta = angle + turns * TAU;
    }
}
