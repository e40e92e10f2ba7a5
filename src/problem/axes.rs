//! Axes of the edges of a rod in the world and their rates (1/s), for markers beside the center line.
//!
//! Input: unknowns, velocities and frames of a state over any number type, and an edge. Output of `axes`: the tangent
//! and the material directors `d1` and `d2 = t x d1`, unit vectors, each with its rate. On the first edge at rest `d1`
//! is the component of the section's `up` across the edge. Circles and tubes, without `up`, take that of the y axis, or
//! of the x axis if the edge is within 8 degrees of y. The position of a marker is the same in the planar and the
//! spatial model: [`DirectorRotation`] is the constant rotation about the tangent from the directors of the model to
//! the material ones. `axes_at_rest` lists the axes of several edges without their rates. `beside_at_rest` returns the
//! offset (m) of a marker from the center line of the rest shape. Fits compute positions and velocities of observed
//! markers, and strains, from the axes.

use crate::numerics::scalar::RodScalar;
use crate::numerics::vector::{Vector, add, cross, dot, scale, sub, unit};
use crate::problem::Discretized;
use crate::problem::model::{Model, first_director};
use crate::problem::setup::Setup;
use crate::problem::start::FramesOver;
use crate::rod::{ReferenceFrames, Rod};
use crate::scene::marker::MarkerStencil;

/// An axis in the world and its rate, 1/s.
type Axis<D> = [Vector<D>; 2];

/// Components of the first material director along the two directors of the model, equal for all edges and times.
#[derive(Clone, Copy, Debug)]
pub(crate) struct DirectorRotation<D>([D; 2]);

impl<M: Model> Discretized<'_, M> {
    /// Rotation about the tangent from the directors of the model to the material directors, as its cosine and sine on
    /// the first edge at rest of the setup. It is the same for all edges and times.
    pub(crate) fn directors<D: RodScalar>(&self, setup: &Setup<D, M>) -> DirectorRotation<D> {
        let (q, frames) = (self.model.unknowns(&setup.rest), self.model.frames(&setup.rest));
        let nodes = [0, 1].map(|i| self.model.position(&q, i));
        let tangent = unit(sub(nodes[1], nodes[0]));
        let first = self.model_director(&q, &frames, 0, tangent);
        let along = first_director(&setup.scene, &nodes);
        DirectorRotation([dot(along, first), dot(along, cross(tangent, first))])
    }

    /// The axes `[t, d1, d2]` of the edge number `edge` in the world, unit vectors each with its rate, 1/s. The rod has
    /// the unknowns `q`, the velocities `v` and the reference frames `frames`. Rates are `w x axis` with the angular
    /// velocity w of the edge, in space with the rate of its angle.
    pub(crate) fn axes<D: RodScalar>(
        &self,
        directors: DirectorRotation<D>,
        q: &[D],
        v: &[D],
        frames: &FramesOver<D, M>,
        edge: usize,
    ) -> [Axis<D>; 3] {
        let chord = sub(self.model.position(q, edge + 1), self.model.position(q, edge));
        let rate = sub(self.model.rate(v, edge + 1), self.model.rate(v, edge));
        let inverse_length = dot(chord, chord).sqrt().recip();
        let tangent = scale(chord, inverse_length);
        let first = self.model_director(q, frames, edge, tangent);
        let DirectorRotation([c, s]) = directors;
        let d1 = add(scale(first, c), scale(cross(tangent, first), s));
        // The reference frame of the angle does not rotate about the tangent.
        let angle = M::STRIDE * edge + 3;
        let spin = if M::Rod::<D>::HAS_FRAMES { v[angle] } else { D::from(0.0) };
        // Angular velocity of the edge: that of its tangent, plus the spin about it.
        let turning = add(scale(cross(tangent, rate), inverse_length), scale(tangent, spin));
        [tangent, d1, cross(tangent, d1)].map(|axis| [axis, cross(turning, axis)])
    }

    /// The axes of `edges` of a rod at rest: tangent and both material directors, unit vectors in the world, edge after
    /// edge. The frames must be at the shape `q`, with all derivatives.
    pub(crate) fn axes_at_rest<D: RodScalar>(
        &self,
        setup: &Setup<D, M>,
        q: &[D],
        frames: &FramesOver<D, M>,
        edges: &[usize],
    ) -> Vec<Vector<D>> {
        if edges.is_empty() {
            return Vec::new();
        }
        let (directors, still) = (self.directors(setup), vec![D::from(0.0); q.len()]);
        let of_edge = |edge: &usize| self.axes(directors, q, &still, frames, *edge);
        edges.iter().flat_map(of_edge).map(|[axis, _]| axis).collect()
    }

    /// Offset of a marker from the center line of the rest shape in the world, m. It is the sum of its components times
    /// the axes, weighted over the edges of its stencil. Zero for a marker on the center line.
    pub(crate) fn beside_at_rest(&self, marker: &MarkerStencil) -> Vector<f64> {
        let (directors, q, frames) = (self.directors(self.setup), self.rest(), self.rest_frames());
        let still = vec![0.0; q.len()];
        marker.edges.iter().fold([0.0; 3], |sum, (edge, weight)| {
            let axes = self.axes(directors, &q, &still, &frames, *edge);
            let parts = axes.iter().zip(marker.offset);
            parts.fold(sum, |sum, ([axis, _], part)| add(sum, scale(*axis, part * weight)))
        })
    }

    /// First director of the model on an edge, in the world. In space it is the material director at the angle in `q`,
    /// in a plane the normal of the plane times (cross product) the `tangent`.
    fn model_director<D: RodScalar>(
        &self,
        q: &[D],
        frames: &FramesOver<D, M>,
        edge: usize,
        tangent: Vector<D>,
    ) -> Vector<D> {
        match frames.director(q, edge) {
            Some(director) => self.model.rate(&director, 0),
            None => cross(self.normal().map(D::from), tangent),
        }
    }
}
