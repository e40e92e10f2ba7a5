//! Parallel transport of the reference frames of a rod to its edges at other unknowns, in SIMD lanes.
//!
//! Input: unknowns `q` and frames, which are overwritten. Each frame is rotated by the smallest rotation from its old
//! tangent to the new one. The reference twist of each joint, rad, changes by the angle that this transport adds.
//! Directors, twists and energies at the new unknowns stay the same. [`MovingFrames::next`] returns the moved edges,
//! the edges after them and the total twists block by block, so that a gradient is computed in the same sweep;
//! [`Rebase`] only moves the frames.

use crate::energy::frame::{EdgeFrame, Frames, moved_twist, vector_after};
use crate::energy::joint::{DirectedEdge, EdgeState};
use crate::numerics::scalar::{RodScalar, Scalar, SimdScalar, Sweep};
use crate::numerics::vector::{Vector, dot, scale};
use crate::rod::blocks::block;
use crate::rod::spatial::sweep::{frames_at, vectors_at};

/// Edges in SIMD lanes whose frames have moved with them.
#[derive(Clone, Copy)]
pub(super) struct MovedEdges<V> {
    squared: V,
    length: V,
    inverse_length: V,
    angle: V,
    frame: EdgeFrame<V>,
    /// The tangents they moved from.
    from: Vector<V>,
}

impl<V: Scalar> MovedEdges<V> {
    /// The edges as a joint element needs them, with their moved frames as references.
    #[inline(always)]
    pub fn state(&self) -> EdgeState<V> {
        let Self { squared, length, inverse_length, angle, frame, .. } = self;
        let edge = DirectedEdge::moved(frame, *inverse_length, *angle);
        EdgeState { edge, length: *length, squared: *squared, turn: [squared.like(0.0); 2] }
    }

    /// The edges shifted by one SIMD lane towards earlier ones; the last lane is the first one of `later`.
    #[inline(always)]
    fn after<S>(&self, later: &Self) -> Self
    where
        V: SimdScalar<S>,
    {
        Self {
            squared: self.squared.after(later.squared),
            length: self.length.after(later.length),
            inverse_length: self.inverse_length.after(later.inverse_length),
            angle: self.angle.after(later.angle),
            frame: self.frame.after::<S>(&later.frame),
            from: vector_after(self.from, later.from),
        }
    }
}

/// Edges in SIMD lanes, the edges after them, and the twists of the joints between, rad. Lanes after the last edge are
/// not used.
pub(super) struct MovedEdgePairs<V> {
    /// The index of the first edge.
    pub first: usize,
    /// The edges.
    pub e: MovedEdges<V>,
    /// The edges after them.
    pub f: MovedEdges<V>,
    pub twist: V,
}

/// Moves the frames of a rod to the unknowns `q` block by block, without changing any energy there.
pub(super) struct MovingFrames<'a, D, V: SimdScalar<D>> {
    q: &'a [D],
    frames: &'a mut [EdgeFrame<D>],
    twist: &'a mut [D],
    level: V::Level,
    /// The number of the first edge of the next block.
    first: usize,
    edges: MovedEdges<V>,
}

impl<'a, D: RodScalar, V: SimdScalar<D>> MovingFrames<'a, D, V> {
    /// Moves the first block of `frames` to the unknowns `q`, and returns the iterator over all blocks.
    #[inline(always)]
    pub fn new(q: &'a [D], frames: &'a mut Frames<D>, level: V::Level) -> Self {
        let edges = move_edges(q, &mut frames.edges, level, 0);
        let (frames, twist) = (&mut frames.edges[..], &mut frames.twist[..]);
        Self { q, frames, twist, level, first: 0, edges }
    }

    /// The next block: edges, the edges after them, and total twists of the joints between, rad; `None` after the last
    /// edge. Writes the moved reference twists of these joints, and moves the frames of the block after it.
    #[inline(always)]
    pub fn next(&mut self) -> Option<MovedEdgePairs<V>> {
        let (first, e) = (self.first, self.edges);
        if first >= self.frames.len() {
            return None;
        }
        // The last joint of this block needs the first edge of the next one, with its frame moved.
        self.first += V::LANES;
        if self.first < self.frames.len() {
            self.edges = move_edges(self.q, self.frames, self.level, self.first);
        }
        let f = e.after::<D>(&self.edges);
        let mut room = None;
        let before = block::<D, V, _>(self.twist, first, D::from(0.0), &mut room);
        let before = V::gather(self.level, |lane| before[lane]);
        // Transported directors of two edges differ from before by an angle, which the reference twist takes up.
        let twist = moved_twist([e.from, f.from], [&e.frame, &f.frame], before);
        for (lane, to) in self.twist[first..].iter_mut().take(V::LANES).enumerate() {
            *to = twist.lane(lane);
        }
        let turn = f.angle - e.angle;
        Some(MovedEdgePairs { first, e, f, twist: turn + twist })
    }
}

/// Moves the frames of one block of edges, from index `first` on, to their tangents at the unknowns `q`. Overwrites
/// these `frames` and returns the edges with their old tangents; the reference twists stay.
#[inline(always)]
fn move_edges<D: RodScalar, V: SimdScalar<D>>(
    q: &[D],
    frames: &mut [EdgeFrame<D>],
    level: V::Level,
    first: usize,
) -> MovedEdges<V> {
    let (e, angle) = vectors_at::<D, V>(q, level, first);
    let squared = dot(e, e);
    let length = squared.sqrt();
    let inverse_length = length.recip();
    let before = frames_at::<D, V>(frames, level, first);
    let frame = before.transported(scale(e, inverse_length));
    // Overwritten in place: the old tangents stay in the result for the reference twists.
    for (lane, to) in frames[first..].iter_mut().take(V::LANES).enumerate() {
        let (tangent, director) =
            (V::extract_lane(&frame.tangent, lane), V::extract_lane(&frame.director, lane));
        *to = EdgeFrame { tangent, director };
    }
    MovedEdges { squared, length, inverse_length, angle, frame, from: before.tangent }
}

/// Moves all frames to the unknowns `q`, without a gradient.
pub(super) struct Rebase<'a, D> {
    pub q: &'a [D],
    pub frames: &'a mut Frames<D>,
}

impl<D: RodScalar> Sweep<D> for Rebase<'_, D> {
    type Output = ();

    /// Moves all frames to the unknowns `q`, block by block, with numbers `V` in SIMD lanes.
    #[inline(always)]
    fn sweep<V: SimdScalar<D>>(self, level: V::Level) {
        let mut moving = MovingFrames::<D, V>::new(self.q, self.frames, level);
        while moving.next().is_some() {}
    }
}
