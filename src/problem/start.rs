//! Initial state of a rod: unknowns and frames in the rest shape or a given shape, held ends, and prescribed nodes.
//!
//! `begin` returns unknowns (m, rad) and frames before supports and loads act: those of the rest shape, or of the
//! initial shape of the scene, whose joints have no twist. A recorded gripper may place this shape in the world.
//! `held_ends` returns a [`BoundaryMotion`] with nodes and edges of clamped and pinned ends, their motions (none if not
//! moved), and recorded nodes. `boundary_motion` is the same, `None` if nothing moves. Rollers and free ends are not
//! held. `turn_ends` adds the prescribed rotation about the rod (rad) of recorded ends to the angles of edges: it
//! decreases linearly to zero at a held other end, else it is equal for all edges. `placed`, in space only, returns the
//! state of a rod whose nodes are moved from rest to given positions (m). Its frames are moved by parallel transport,
//! so that it does not rotate about itself. `placed_still` is the same in plain numbers. If any edge rotates by more
//! than 120 degrees, the frames of all edges are transported by way of a state halfway. `start_positions` returns the
//! positions (m) of all nodes before supports and loads act, `recorded` the parts of the rod that follow a recording.
//! `is_held` returns whether the first coordinate of a node is prescribed.

use crate::energy::frame::Frames;
use crate::numerics::prescribed_dofs::PrescribedDofs;
use crate::numerics::scalar::RodScalar;
use crate::numerics::vector::{add, cross, dot, scale, sub, unit};
use crate::problem::boundary::{BoundaryMotion, HeldEdge, HeldNode, MovedEnd, RecordedPart};
use crate::problem::model::Model;
use crate::problem::setup::Setup;
use crate::problem::spatial::SpatialModel;
use crate::problem::{Discretized, SpatialProblem};
use crate::rod::{ReferenceFrames, Rod, SpatialRod};
use crate::scene::{Clamp, End, Motion, Recorded, Support};

/// Frames of the rod of a model `M` over the number type `D`.
pub(crate) type FramesOver<D, M> = <<M as Model>::Rod<D> as Rod<D>>::Frames;
/// Unknowns of a rod and the frames from which its angles are measured.
pub(crate) type UnknownsAndFrames<D, M> = (Vec<D>, FramesOver<D, M>);

/// Cosine of 120 degrees. If an edge rotates further between two states (its cosine is at most this value), parallel
/// transport takes an intermediate state.
const LARGE_ROTATION: f64 = -0.5;

/// Sine of the rotation of an edge below which its sense is undetermined near half a turn, and that of the edge before
/// is used.
const UNDETERMINED: f64 = 1e-3;

impl SpatialProblem<'_> {
    /// Unknowns and frames of a rod in space that moves from its rest shape in `setup` to `nodes`, m, in the world. Its
    /// frames are moved by parallel transport, so that all angles stay zero. If an edge rotates by more than 120
    /// degrees, they are transported by way of a state halfway.
    pub(crate) fn placed<D: RodScalar>(
        &self,
        setup: &Setup<D, SpatialModel>,
        nodes: &[[D; 3]],
    ) -> (Vec<D>, Frames<D>) {
        let mut q = self.model.unknowns(&setup.rest);
        for (i, x) in nodes.iter().enumerate() {
            q[4 * i..4 * i + 3].copy_from_slice(&self.model.components(*x));
        }
        // Transport over nearly half a turn is ill-conditioned: then by way of a state halfway.
        let mut frames = self.model.frames(&setup.rest);
        let rest = self.model.unknowns(&setup.rest);
        if let Some(halfway) = self.halfway(&rest, &q) {
            SpatialRod::<D>::update_reference_frames(&mut frames, &halfway);
        }
        SpatialRod::<D>::update_reference_frames(&mut frames, &q);
        (q, frames)
    }

    /// Unknowns halfway between two states, if an edge rotates by more than 120 degrees ([`LARGE_ROTATION`]) between
    /// them, otherwise none. Its edges have the mean directions of both states, and the lengths in `to`. For an edge
    /// with such a rotation, the cross product of a normal and its direction in `from` is added to the mean. The normal
    /// is that of a planar scene, else the z axis. The sign is that of the side to which the edge rotates. Near half a
    /// turn ([`UNDETERMINED`]) the side is that of the edge before.
    fn halfway<D: RodScalar>(&self, from: &[D], to: &[D]) -> Option<Vec<D>> {
        let edge = |q: &[D], j: usize| {
            let node = |i: usize| -> [D; 3] { std::array::from_fn(|c| q[4 * i + c]) };
            unit(sub(node(j + 1), node(j)))
        };
        let edges = self.nodes() - 1;
        if (0..edges).all(|j| dot(edge(from, j), edge(to, j)).value() > LARGE_ROTATION) {
            return None;
        }
        let normal = self.model.components(self.normal().map(D::from));
        let mut q = to.to_vec();
        // An edge that rotates by half a turn goes to the side of the edge before it.
        let mut side = 1.0;
        for j in 0..edges {
            let (a, b) = (edge(from, j), edge(to, j));
            // Direction in the plane to which the edge rotates.
            let across = cross(normal, a);
            let sine = dot(across, b).value();
            if sine.abs() > UNDETERMINED {
                side = sine.signum();
            }
            let between = match dot(a, b).value() > LARGE_ROTATION {
                true => unit(add(a, b)),
                false => unit(add(scale(add(a, b), D::from(0.5)), scale(across, D::from(side)))),
            };
            for c in 0..3 {
                q[4 * (j + 1) + c] = q[4 * j + c] + between[c] * edge_length(to, j);
            }
        }
        Some(q)
    }

    /// Unknowns and frames of a rod in space at `nodes`, m, over `f64`: [`placed`](Self::placed) from the rest shape of
    /// the problem.
    pub(crate) fn placed_still(&self, nodes: &[[f64; 3]]) -> (Vec<f64>, Frames<f64>) {
        self.placed(self.setup, nodes)
    }
}

/// Length of edge `j` of a spatial rod with the unknowns `q`, m.
fn edge_length<D: RodScalar>(q: &[D], j: usize) -> D {
    let edge: [D; 3] = std::array::from_fn(|c| q[4 * (j + 1) + c] - q[4 * j + c]);
    dot(edge, edge).sqrt()
}

impl<M: Model> Discretized<'_, M> {
    /// Positions of all nodes in the initial shape, or without one in the rest shape, in the world, m.
    pub(crate) fn start_positions(&self) -> Vec<[f64; 3]> {
        let (q, _) = self.begin(self.setup);
        (0..self.nodes()).map(|i| self.model.position(&q, i)).collect()
    }

    /// Unknowns and reference frames before supports and loads act: those of the rest shape, or of the initial shape in
    /// `setup`. The frames of an initial shape are transported from rest, and its angles are such that no joint is
    /// twisted. If a gripper [places](crate::scene::Supports::placing_end) the rod, the whole shape is moved rigidly so
    /// that this end has the recorded pose at t = 0.
    pub(crate) fn begin<D: RodScalar>(&self, setup: &Setup<D, M>) -> UnknownsAndFrames<D, M> {
        let (mut q, mut frames) = self.begin_unplaced(setup);
        if M::STRIDE == 4
            && let Some(end) = setup.scene.supports.placing_end()
        {
            self.held_end(setup, end, &q, &frames).place(&mut q, frames.parts_mut().0);
        }
        (q, frames)
    }

    /// Unknowns and reference frames of the rest shape, or of the initial shape, at its own place.
    fn begin_unplaced<D: RodScalar>(&self, setup: &Setup<D, M>) -> UnknownsAndFrames<D, M> {
        let mut q = self.model.unknowns(&setup.rest);
        let mut frames = self.model.frames(&setup.rest);
        let Some(nodes) = &setup.start else { return (q, frames) };
        // Nodes of the initial shape; its twist is the smallest one.
        for (i, x) in nodes.iter().enumerate() {
            let own = self.model.components(*x);
            let axes = M::STRIDE.min(3);
            q[M::STRIDE * i..][..axes].copy_from_slice(&own[..axes]);
        }
        M::Rod::<D>::update_reference_frames(&mut frames, &q);
        frames.untwist(&mut q);
        (q, frames)
    }

    /// Prescribed motion of the [held ends](Self::held_ends) and recorded nodes of `setup`; none for a scene without
    /// `supports.motion` and recording.
    pub(crate) fn boundary_motion<D: RodScalar>(
        &self,
        setup: &Setup<D, M>,
    ) -> Option<BoundaryMotion<D>> {
        setup.scene.supports.move_ends().then(|| self.held_ends(setup))
    }

    /// Prescribed motion of clamped and pinned ends, moved or not, and of recorded nodes. Rollers and free ends are not
    /// held.
    pub(crate) fn held_ends<D: RodScalar>(&self, setup: &Setup<D, M>) -> BoundaryMotion<D> {
        let supports = &setup.scene.supports;
        let (q, frames) = self.begin(setup);
        // Rollers move freely along one axis, and free ends are not held.
        let holds = |end: &End| matches!(supports.at(*end), Support::Clamped | Support::Pinned);
        let ends = [End::Start, End::End].into_iter().filter(holds);
        let ends = ends.map(|end| self.held_end(setup, end, &q, &frames));
        BoundaryMotion::new::<M>(ends.collect(), self.recorded())
    }

    /// The clamped or pinned end `end` of a rod that has the unknowns `q` and the `frames` without motion. A clamped
    /// end has its two outermost nodes and its edge with tangent and director, a pinned end one node. The end rotates
    /// about the middle of the edge of a clamp at mid-edge, else about the outermost node.
    fn held_end<D: RodScalar>(
        &self,
        setup: &Setup<D, M>,
        end: End,
        q: &[D],
        frames: &FramesOver<D, M>,
    ) -> MovedEnd<D> {
        let supports = &setup.scene.supports;
        let last = self.nodes() - 1;
        let place = |i: usize| {
            let mut x = [D::from(0.0); 3];
            let axes = M::STRIDE.min(3);
            x[..axes].copy_from_slice(&q[M::STRIDE * i..][..axes]);
            x
        };
        let ([outer, inner], edge) = match end {
            End::Start => ([0, 1], 0),
            End::End => ([last, last - 1], last - 1),
        };
        let clamped = supports.at(end) == Support::Clamped;
        let held = if clamped { vec![outer, inner] } else { vec![outer] };
        // The point about which a rotation of the end takes place: the wall.
        let centre = match supports.clamp {
            Clamp::MidEdge if clamped => scale(add(place(outer), place(inner)), D::from(0.5)),
            _ => place(outer),
        };
        let moved = supports.motion.iter().filter(|motion| motion.end == end);
        let motions = moved.map(|motion| Motion {
            displacement: self.model.components(motion.displacement),
            rotation: self.model.components(motion.rotation),
            ..motion.clone()
        });
        MovedEnd {
            end,
            motions: motions.collect(),
            axes: self.model_axes(),
            centre,
            nodes: held.into_iter().map(|node| HeldNode { node, position: place(node) }).collect(),
            edge: frames.director(q, edge).filter(|_| clamped).map(|director| {
                let tangent = unit(sub(place(edge + 1), place(edge)));
                HeldEdge { edge, tangent, director }
            }),
        }
    }

    /// The three axes of the model as unit vectors of the world, one per entry; in a plane its x and y axes and its
    /// normal.
    fn model_axes(&self) -> [[f64; 3]; 3] {
        let columns = [0, 1, 2].map(|c| {
            self.model.components(std::array::from_fn(|k| if k == c { 1.0 } else { 0.0 }))
        });
        [0, 1, 2].map(|r| [0, 1, 2].map(|c| columns[c][r]))
    }

    /// Parts of the rod that follow a recording, each with its nodes and their markers. The recorded ends come first,
    /// from the start on, then one part with the inner nodes, which may be empty. No parts without a recording that has
    /// been read.
    pub(super) fn recorded(&self) -> Vec<RecordedPart> {
        let supports = &self.scene().supports;
        let Some(path) = &supports.path else { return Vec::new() };
        let Recorded { track: Some(track), .. } = path else { return Vec::new() };
        let (axes, segments) = (self.model_axes(), self.nodes() - 1);
        let ends =
            [End::Start, End::End].into_iter().filter(|e| supports.at(*e) == Support::Recorded);
        let nodes = ends.map(|end| path.end_nodes(end, segments));
        nodes
            .chain([path.inner_nodes(segments)])
            .map(|nodes| RecordedPart { track: track.clone(), nodes, axes })
            .collect()
    }

    /// Whether a support or a recording prescribes the first coordinate of a node, in the axes of the model: it is not
    /// a free unknown, or is in `prescribed`, the recorded unknowns between the ends. True for nodes of clamped, pinned
    /// and recorded ends, and for a roller at the start of the rod; false for a roller at its end, which moves along
    /// that coordinate.
    pub(crate) fn is_held(&self, node: usize, prescribed: &PrescribedDofs) -> bool {
        let place = M::STRIDE * node;
        !self.free().contains(&place) || prescribed.contains(place)
    }

    /// Adds the rotations about the rod of recorded ends (`twist` of their motions, rad) to the angles of edges in `q`.
    /// If the other end is clamped or recorded, without free twist, the added angle decreases linearly to zero there.
    /// Else it is the same for all edges. No effect in a plane and without such motions.
    pub(crate) fn turn_ends<D: RodScalar>(&self, setup: &Setup<D, M>, q: &mut [D]) {
        let supports = &setup.scene.supports;
        let free = self.free();
        let angles: Vec<usize> = (0..q.len()).filter(|i| M::Rod::<D>::is_angle(*i)).collect();
        let [before, between] = [
            angles.iter().filter(|i| **i < free.start).count() as f64,
            angles.iter().filter(|i| free.contains(i)).count() as f64,
        ];
        for (end, turn) in supports.recorded_turns() {
            let other = if end == End::Start { End::End } else { End::Start };
            let is_held = matches!(supports.at(other), Support::Recorded | Support::Clamped)
                && !supports.turns_freely(other);
            for (edge, i) in angles.iter().enumerate() {
                // Twist between two held ends is linear; with one held end it is the same
                // everywhere.
                let along = ((edge as f64 + 1.0 - before) / (between + 1.0)).clamp(0.0, 1.0);
                let part = match end {
                    _ if !is_held => 1.0,
                    End::Start => 1.0 - along,
                    End::End => along,
                };
                q[*i] += *turn * part;
            }
        }
    }
}
