//! Angle of the tangent at a point of the rod, about an axis that is fixed in the world.
//!
//! Input: the point, the direction of the angle zero and the axis, and the recorded motion of the nodes around the
//! point. Output of [`angles`]: the angle at every recorded time, rad. The tangent is the sum of the directions of the
//! edges around the point, with the cubic weights of a marker there. Errors are a point outside the rod, nodes that are
//! not recorded, and a tangent along the axis.

use crate::dynamics::record::RecordView;
use crate::error::Error;
use crate::fit::measurement::simulated::SimulatedOutput;
use crate::numerics::scalar::Scalar;
use crate::numerics::vector::{combine, cross, dot, sub, unit};
use crate::scene::marker::MarkerStencil;
use crate::scene::{Point, Stencil};

/// The angle of the tangent at every time of a record, rad, in (-pi, pi], from the unit vector `from` about the unit
/// vector `about`, normal to it: `atan2(t . (about x from), t . from)` of the tangent `t`. Error: a tangent along
/// `about`, and a point outside the rod or not recorded.
pub(super) fn angles<D: Scalar>(
    point: Point,
    [from, about]: [[f64; 3]; 2],
    record: &RecordView<'_, D>,
    simulated: &SimulatedOutput<D>,
) -> Result<Vec<D>, Error> {
    let across = cross(about, from).map(D::from);
    let from = from.map(D::from);
    // The weights with which the axes of the edges around the point are summed for a marker there.
    let edges = MarkerStencil::new(point.fixed(), [1.0, 0.0, 0.0], simulated.mesh)?.edges;
    let node = |i: usize| Stencil { nodes: vec![(i, D::from(1.0))] };
    let ends: Vec<_> = edges.iter().map(|(e, w)| (node(*e), node(*e + 1), *w)).collect();
    let angle = |time: &f64| {
        let time = D::from(*time);
        let mut tangent = [D::from(0.0); 3];
        for (start, end, weight) in &ends {
            let edge = sub(record.position(end, time)?, record.position(start, time)?);
            tangent = combine(D::from(1.0), tangent, *weight, unit(edge));
        }
        let (sine, cosine) = (dot(tangent, across), dot(tangent, from));
        // Along the axis the angle has no derivative.
        if sine.value() == 0.0 && cosine.value() == 0.0 {
            let found = "an axis of the angle along the tangent of the rod";
            return Err(Error::invalid("observation.rotation", found, "an axis across the rod"));
        }
        Ok(sine.atan2(cosine))
    };
    record.times().iter().map(angle).collect()
}
