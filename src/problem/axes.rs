//! The axes of a rod's edges, that markers beside its centre line move with.
//!
//! The first is the tangent, the others are material directors `d1` and `d2 = t x d1`. On the first
//! edge at rest `d1` is the part across it of the section's `up`; of a circle or a tube, which have none, of
//! the y axis, or of the x axis where the rod begins within 8 degrees of y. So a marker is where it is
//! whether the model is planar or spatial.

use crate::numerics::scalar::Nestable;
use crate::numerics::vector::{Vector, add, cross, dot, scale, sub, unit};
use crate::problem::Discretized;
use crate::problem::model::{Model, first_director};
use crate::problem::setup::Setup;
use crate::rod::Rod;
use crate::scene::marker::Marker;

/// An axis in the world and its rate, 1/s.
type Axis<D> = [Vector<D>; 2];
type FramesOver<D, M> = <<M as Model>::Rod<D> as Rod<D>>::Frames;

/// How the directors lie to those of the model: the components of the first along the model's two. They
/// are the same for every edge at every time.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Directors<D>([D; 2]);

impl<M: Model> Discretized<'_, M> {
    /// The directors of a setup's rod.
    pub(crate) fn directors<D: Nestable>(&self, setup: &Setup<D, M>) -> Directors<D> {
        let (q, frames) = (self.model.unknowns(&setup.rest), self.model.frames(&setup.rest));
        let nodes = [0, 1].map(|i| self.model.position(&q, i));
        let tangent = unit(sub(nodes[1], nodes[0]));
        let first = self.model_director(&q, &frames, 0, tangent);
        let along = first_director(&setup.scene, &nodes);
        Directors([dot(along, first), dot(along, cross(tangent, first))])
    }

    /// The axes of an edge of a rod at `q` that moves with `v`.
    pub(crate) fn axes<D: Nestable>(
        &self,
        directors: Directors<D>,
        (q, v): (&[D], &[D]),
        frames: &FramesOver<D, M>,
        edge: usize,
    ) -> [Axis<D>; 3] {
        let between = |of: &dyn Fn(usize) -> Vector<D>| sub(of(edge + 1), of(edge));
        let chord = between(&|i| self.model.position(q, i));
        let rate = between(&|i| self.model.rate(v, i));
        let inverse_length = dot(chord, chord).sqrt().recip();
        let tangent = scale(chord, inverse_length);
        let first = self.model_director(q, frames, edge, tangent);
        let Directors([c, s]) = directors;
        let d1 = add(scale(first, c), scale(cross(tangent, first), s));
        // The reference of an angle does not turn about the tangent.
        let angle = M::STRIDE * edge + 3;
        let spin = if M::Rod::<D>::HAS_FRAMES { v[angle] } else { D::from(0.0) };
        let turning = add(scale(cross(tangent, rate), inverse_length), scale(tangent, spin));
        [tangent, d1, cross(tangent, d1)].map(|axis| [axis, cross(turning, axis)])
    }

    /// How far a marker is beside the centre line of the rest shape, m.
    pub(crate) fn beside_at_rest(&self, marker: &Marker) -> Vector<f64> {
        let (directors, q, frames) = (self.directors(self.setup), self.rest(), self.rest_frames());
        let still = vec![0.0; q.len()];
        marker.edges.iter().fold([0.0; 3], |sum, (edge, weight)| {
            let axes = self.axes(directors, (&q, &still), &frames, *edge);
            let parts = axes.iter().zip(marker.offset);
            parts.fold(sum, |sum, ([axis, _], part)| add(sum, scale(*axis, part * weight)))
        })
    }

    /// The model's own first director in the world: in a plane, across the edge within it.
    fn model_director<D: Nestable>(
        &self,
        q: &[D],
        frames: &FramesOver<D, M>,
        edge: usize,
        tangent: Vector<D>,
    ) -> Vector<D> {
        match M::Rod::<D>::director(q, frames, edge) {
            Some(director) => self.model.rate(&director, 0),
            None => cross(self.normal().map(D::from), tangent),
        }
    }
}
