//! A tendon as an element of a rod: energy, hand-derived gradient and Hessian by the unknowns.
//!
//! Input: the unknowns of an element of a rod in a plane or in space (m, rad), and its [`ElementContext`] with the
//! numbers of a [`RoutePart`] and the tension, N, over any scalar of rods. Output of [`TendonElement`]: energy, J,
//! gradient, N (N m for angles), and the lower triangle of the Hessian. Over three nodes the derivatives follow from
//! `planar` or `spatial`, over two nodes from the axial force in the edge. The energy, and on request all derivatives
//! in dual numbers, are those of the definition ([`Tendon`]).

use crate::energy::Derivatives;
use crate::energy::adapter::{
    Adapter, AnyEnergy, Chart, ElementContext, EnergyOver, MOST, OwnLocal,
};
use crate::energy::own::OwnEnergy;
use crate::energy::stretch::{along, axial_hessian, squared};
use crate::energy::tendon::planar::PlanarTendon;
use crate::energy::tendon::route_length::RouteLength;
use crate::energy::tendon::spatial::SpatialTendon;
use crate::energy::tendon::{RoutePart, Tendon};
use crate::numerics::scalar::{RodScalar, Scalar};
use crate::numerics::vector::components;
use crate::scene::number::Quantity;

/// The element of a tendon over `N` nodes: around the inner one of three, or along the edge of two.
pub(crate) struct TendonElement<const N: usize>(Adapter<Tendon<N>, N, 1>);

impl<const N: usize> Default for TendonElement<N> {
    /// The element; tension and route are numbers of its places.
    fn default() -> Self {
        Self(Adapter(Tendon))
    }
}

/// The part of the route at a place, and the tension there, N, times the weight of the place.
#[inline]
fn part_and_tension<D: Scalar>(context: &ElementContext<D>) -> (RoutePart<D>, D) {
    let tension = context.weight.map_or(context.values[0], |weight| context.values[0] * weight);
    (RoutePart::from_numbers(|i| context.place[i]), tension)
}

/// The unknowns of an element, whose number follows from the numbers of nodes and of unknowns per node.
#[inline]
fn sized<D, const Q: usize>(q: &[D]) -> &[D; Q] {
    q.first_chunk().expect("as many unknowns as the element has")
}

/// An edge of `M` components, whose nodes are `stride` unknowns apart, with the axial force of a tendon.
struct TendonEdge<D, const M: usize> {
    stride: usize,
    edge: [D; M],
    length: D,
    /// The axial force, N, and its derivative by the length, N/m.
    response: [D; 2],
}

impl<D: Scalar, const M: usize> TendonEdge<D, M> {
    /// The edge with the unknowns `q` of both nodes, at a place of a tendon.
    fn new(context: &ElementContext<D>, q: &[D]) -> Self {
        let (stride, (part, tension)) = (context.chart.stride(), part_and_tension(context));
        let edge = components(|c| q[stride + c] - q[c]);
        let (length, zero) = (squared(&edge).sqrt(), D::from(0.0));
        let route = RouteLength::new(&part, length, [zero; 2], zero);
        let response = [tension * route.by_length, tension * route.by_length_twice];
        Self { stride, edge, length, response }
    }

    /// Writes the gradient by the unknowns, N: opposite forces on both nodes, zero for an angle.
    fn write_gradient(&self, to: &mut [D; MOST]) {
        let force = along(&self.edge, self.length, self.response[0]);
        to[M..self.stride].fill(D::from(0.0));
        for c in 0..M {
            (to[c], to[self.stride + c]) = (-force[c], force[c]);
        }
    }

    /// Writes the lower triangle of the Hessian by the unknowns, N/m, zero for an angle.
    fn write_hessian(&self, to: &mut [[D; MOST]; MOST]) {
        let (stride, zero) = (self.stride, D::from(0.0));
        let hessian = axial_hessian(&self.edge, self.length, self.response);
        for angle in M..stride {
            to[angle][..=angle].fill(zero);
            (0..M).for_each(|r| to[stride + r][angle] = zero);
        }
        for r in 0..M {
            for c in 0..M {
                let entry = hessian[r][c];
                (to[r][c], to[stride + r][stride + c], to[stride + r][c]) = (entry, entry, -entry);
            }
        }
    }
}

impl<D: RodScalar, const N: usize> EnergyOver<D> for TendonElement<N>
where
    Tendon<N>: OwnEnergy<N, 1>,
{
    /// The energy, J, at the unknowns `q` of the element at `context`, times its weight.
    fn energy(&self, context: &ElementContext<D>, q: &[D]) -> D {
        self.0.energy(context, q)
    }

    /// Writes the derivatives by the unknowns `q`, N (N m for angles), times the weight of the element, to the first
    /// `q.len()` entries of `to`: by hand, or in dual numbers on request.
    fn gradient(
        &self,
        context: &ElementContext<D>,
        q: &[D],
        derivatives: Derivatives,
        to: &mut [D; MOST],
    ) {
        if derivatives == Derivatives::Dual {
            return self.0.gradient(context, q, derivatives, to);
        }
        let (part, tension) = part_and_tension(context);
        match (context.chart, N) {
            (Chart::Plane { .. }, 2) => TendonEdge::<D, 2>::new(context, q).write_gradient(to),
            (Chart::Space { .. }, 2) => TendonEdge::<D, 3>::new(context, q).write_gradient(to),
            (Chart::Plane { across, .. }, _) => {
                let tendon = PlanarTendon::new(&part, tension, *across, sized(q));
                to[..q.len()].copy_from_slice(&tendon.gradient());
            }
            (Chart::Space { .. }, _) => {
                let tendon = SpatialTendon::new(&part, tension, context.frames, sized(q));
                to[..q.len()].copy_from_slice(&tendon.gradient());
            }
        }
    }

    /// Writes first derivatives and the lower triangle of the second ones by `q`, times the weight of the element, to
    /// the first entries of `to`: by hand, or in dual numbers on request.
    fn tangent(
        &self,
        context: &ElementContext<D>,
        q: &[D],
        derivatives: Derivatives,
        to: &mut OwnLocal<D>,
    ) {
        if derivatives == Derivatives::Dual {
            return self.0.tangent(context, q, derivatives, to);
        }
        let (part, tension) = part_and_tension(context);
        match (context.chart, N) {
            (Chart::Plane { .. }, 2) => {
                let edge = TendonEdge::<D, 2>::new(context, q);
                edge.write_gradient(&mut to.0);
                edge.write_hessian(&mut to.1);
            }
            (Chart::Space { .. }, 2) => {
                let edge = TendonEdge::<D, 3>::new(context, q);
                edge.write_gradient(&mut to.0);
                edge.write_hessian(&mut to.1);
            }
            (Chart::Plane { across, .. }, _) => {
                let tendon = PlanarTendon::new(&part, tension, *across, sized(q));
                let (gradient, hessian) = tendon.tangent();
                write(gradient, hessian, to);
            }
            (Chart::Space { .. }, _) => {
                let tendon = SpatialTendon::new(&part, tension, context.frames, sized(q));
                let (gradient, hessian) = tendon.tangent();
                write(gradient, hessian, to);
            }
        }
    }
}

/// Writes gradient and Hessian by `Q` unknowns to the first entries of `to`.
#[inline]
fn write<D: Copy, const Q: usize>(gradient: [D; Q], hessian: [[D; Q]; Q], to: &mut OwnLocal<D>) {
    to.0[..Q].copy_from_slice(&gradient);
    for (to, row) in to.1.iter_mut().zip(&hessian) {
        to[..Q].copy_from_slice(row);
    }
}

impl<const N: usize> AnyEnergy for TendonElement<N>
where
    Tendon<N>: OwnEnergy<N, 1>,
{
    /// The number `N` of neighboring nodes of one element.
    fn nodes(&self) -> usize {
        N
    }

    /// The name and quantity of the only parameter, the tension.
    fn parameters(&self) -> &'static [(&'static str, Quantity)] {
        self.0.parameters()
    }

    /// That of the definition, always true.
    fn keeps_plane(&self, values: &[f64], normal: [f64; 3], point: [f64; 3]) -> bool {
        self.0.keeps_plane(values, normal, point)
    }

    /// Sums of the absolute terms in each entry of the gradient and Hessian by `q`, those of the definition.
    fn terms(&self, context: &ElementContext<f64>, q: &[f64]) -> OwnLocal<f64> {
        self.0.terms(context, q)
    }
}

#[cfg(test)]
mod tests;
