//! The gradient of a spatial rod, N and N m, in SIMD lanes by the hand-derived formulas: at given frames
//! ([`Gradient`]), or with frames that move to the unknowns in the same sweep ([`MovedGradient`]).
//!
//! Input: elements, unknowns and frames; the moving frames are overwritten. Stresses of the joints and axial forces
//! become derivatives by edge vectors and angles. The gradient at a node is the difference of the forces of its two
//! edges, less its dead load. Springs of internal friction and nonlinear bending act only at given frames. Nonlinear
//! parts of stretching laws are added elsewhere.

use crate::energy::DeadLoad;
use crate::energy::frame::Frames;
use crate::energy::joint::{EdgeState, JointGradient};
use crate::numerics::scalar::{RodScalar, SimdScalar, Sweep};
use crate::numerics::vector::{add, sub};
use crate::rod::columns::write_gradient;
use crate::rod::edges::STRIDE;
use crate::rod::layout::EdgeBlocks;
use crate::rod::spatial::moving::{MovedEdgePairs, MovingFrames};
use crate::rod::spatial::sweep::{At, Elements, SpatialBlocks, SpatialEdgePairs, joints};

/// A writer of the gradient by nodes from derivatives by edges, block after block.
struct GradientWriter<'a, D, V> {
    load: &'a [DeadLoad<D, 3>],
    gradient: &'a mut [D],
    /// Derivatives of the previous block's joints by their second edges.
    open: [V; 3],
    /// Forces of the previous block's edges, N.
    carried: [V; 3],
}

impl<'a, D: RodScalar, V: SimdScalar<D>> GradientWriter<'a, D, V> {
    /// The writer before the first edge. `load` are the dead loads on all nodes.
    #[inline(always)]
    fn new(level: V::Level, load: &'a [DeadLoad<D, 3>], gradient: &'a mut [D]) -> Self {
        let zero = V::gather(level, |_| D::from(0.0));
        Self { load, gradient, open: [zero; 3], carried: [zero; 3] }
    }

    /// Overwrites the gradient of the nodes at the start of the edges `e` from index `first` on, less their dead loads,
    /// and of the angles of these edges. `pull` are the derivatives of the energies of the joints after them by both
    /// edges, `axial` the axial forces of the edges, N. Both are kept for the next block.
    #[inline(always)]
    fn add(&mut self, first: usize, e: &EdgeState<V>, pull: &JointGradient<V>, axial: V) {
        // The joint before each edge is that of the previous lane.
        let (open, carried) = (&self.open, &self.carried);
        let before =
            [pull.f[0].before(open[0]), pull.f[1].before(open[1]), pull.f[2].before(open[2])];
        let [x, y, z, torque] = e.gradient(add(before, pull.e), axial);
        let elastic =
            [x.before(carried[0]) - x, y.before(carried[1]) - y, z.before(carried[2]) - z, torque];
        let nodes = self.gradient.as_chunks_mut::<STRIDE>().0;
        let left = self.load.len() - 1 - first;
        write_gradient::<D, V, STRIDE, 3>((first, left), &elastic, self.load, nodes);
        (self.open, self.carried) = (pull.f, [x, y, z]);
    }

    /// Writes the gradient of the last node: the force of the last edge less the node's load, N.
    #[inline(always)]
    fn end(self) {
        let edges = self.load.len() - 1;
        let last = V::extract_lane(&self.carried, (edges - 1) % V::LANES);
        self.gradient[STRIDE * edges..].copy_from_slice(&sub(last, self.load[edges].force));
    }
}

/// Overwrites the gradient at given frames, by the hand-derived formulas.
pub(super) struct Gradient<'a, D: RodScalar> {
    pub at: At<'a, D>,
    pub gradient: &'a mut [D],
}

impl<D: RodScalar> Sweep<D> for Gradient<'_, D> {
    type Output = ();

    /// Overwrites the gradient of all nodes and angles at the given frames, less the dead loads, block by block with
    /// one edge per SIMD lane. Nonlinear bending and active friction springs are included.
    #[inline(always)]
    fn sweep<V: SimdScalar<D>>(self, level: V::Level) {
        let elements = self.at.elements;
        let mut nodes = GradientWriter::<D, V>::new(level, elements.load, self.gradient);
        let mut along = SpatialBlocks::<D, V>::new(self.at, level);
        while let Some(pairs) = along.next() {
            let SpatialEdgePairs { first, e, f, bent, .. } = &pairs;
            let pull = bent.pull(&e.edge, &f.edge, &along.response(&pairs).1);
            let axial = elements.stretches::<V>(level, *first).force(e.squared, e.length);
            nodes.add(*first, e, &pull, axial);
        }
        nodes.end();
    }
}

/// Moves the frames to the edges at `q` and overwrites the gradient there.
pub(super) struct MovedGradient<'a, D: RodScalar> {
    pub elements: Elements<'a, D>,
    pub q: &'a [D],
    pub frames: &'a mut Frames<D>,
    pub gradient: &'a mut [D],
}

impl<D: RodScalar> Sweep<D> for MovedGradient<'_, D> {
    type Output = ();

    /// Moves the frames and their twists, and overwrites the gradient of all nodes and angles, less the dead loads,
    /// block by block with one edge per SIMD lane. Nonlinear bending and friction springs are left out.
    #[inline(always)]
    fn sweep<V: SimdScalar<D>>(self, level: V::Level) {
        let mut nodes = GradientWriter::<D, V>::new(level, self.elements.load, self.gradient);
        // One sweep for both: transport and forces need the same lengths and tangents.
        let mut moving = MovingFrames::<D, V>::new(self.q, self.frames, level);
        while let Some(pairs) = moving.next() {
            let MovedEdgePairs { first, twist, .. } = pairs;
            let (e, f) = (pairs.e.state(), pairs.f.state());
            let pull = joints(self.elements.joint, level, first).pull(&e.edge, &f.edge, twist);
            let axial = self.elements.stretches::<V>(level, first).force(e.squared, e.length);
            nodes.add(first, &e, &pull, axial);
        }
        nodes.end();
    }
}
