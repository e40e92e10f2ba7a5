//! User-defined energies on a rod.

use crate::energy::Derivatives;
use crate::energy::adapter::{AnyEnergy, Chart, MOST, Over, Site};
use crate::energy::frame::EdgeFrame;
use crate::energy::place::Spot;
use crate::numerics::scalar::{Nestable, Scalar};
use crate::numerics::tangent::Tangent;
use num_dual::Dual64;
use std::sync::Arc;

/// The user-defined energies of a rod; an empty list without any.
#[derive(Clone, Debug)]
pub struct Extra<D>(Vec<Placed<D>>);

/// An energy with its places on a mesh.
#[derive(Clone)]
pub(crate) struct Placed<D> {
    pub name: Arc<str>,
    pub energy: Arc<dyn AnyEnergy>,
    pub chart: Chart<D>,
    /// Of its parameters.
    pub values: Vec<D>,
    pub spots: Vec<Spot<D>>,
}

impl<D> std::fmt::Debug for Placed<D> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} at {} places", self.name, self.spots.len())
    }
}

impl<D> Default for Extra<D> {
    fn default() -> Self {
        Self(Vec::new())
    }
}

impl<D: Scalar> Placed<D> {
    /// Where the unknowns of a spot are, and the references of its edges.
    pub fn span(&self, spot: &Spot<D>) -> (std::ops::Range<usize>, std::ops::Range<usize>) {
        let (nodes, first) = (self.energy.nodes(), self.chart.stride() * spot.first);
        let edges = match self.chart {
            Chart::Plane { .. } => 0..0,
            Chart::Space { .. } => spot.first..spot.first + nodes - 1,
        };
        (first..first + self.chart.unknowns(nodes), edges)
    }

    /// A spot with the references of its edges.
    pub fn site<'a>(&'a self, spot: &'a Spot<D>, frames: &'a [EdgeFrame<D>]) -> Site<'a, D> {
        let Self { chart, values, .. } = self;
        Site { chart, frames, values, place: &spot.numbers, weight: spot.weight }
    }
}

impl<D> Extra<D> {
    /// All of them.
    pub(crate) fn placed(&self) -> &[Placed<D>] {
        &self.0
    }
}

impl<D: Nestable> Extra<D> {
    pub(crate) fn new(placed: Vec<Placed<D>>) -> Self {
        Self(placed)
    }

    /// Shows every place of every energy with the unknowns there.
    #[inline]
    fn each(
        &self,
        q: &[D],
        frames: &[EdgeFrame<D>],
        mut show: impl FnMut(&dyn Over<D>, Site<D>, &[D], usize),
    ) {
        for placed in &self.0 {
            let energy = D::instance(&*placed.energy);
            for spot in &placed.spots {
                let (own, edges) = placed.span(spot);
                let first = own.start;
                show(energy, placed.site(spot, &frames[edges]), &q[own], first);
            }
        }
    }

    /// The sum of all energies, J. `frames` of every edge; none in a plane.
    pub(crate) fn energy(&self, q: &[D], frames: &[EdgeFrame<D>]) -> f64 {
        let mut sum = 0.0;
        self.each(q, frames, |energy, site, q, _| sum += energy.energy(&site, q).value());
        sum
    }

    /// Adds their gradient.
    #[inline]
    pub(crate) fn add_gradient(
        &self,
        q: &[D],
        frames: &[EdgeFrame<D>],
        derivatives: Derivatives,
        gradient: &mut [D],
    ) {
        if self.0.is_empty() {
            return;
        }
        let mut local = [D::from(0.0); MOST];
        self.each(q, frames, |energy, site, q, first| {
            energy.gradient(&site, q, derivatives, &mut local);
            for (to, from) in gradient[first..].iter_mut().zip(&local[..q.len()]) {
                *to += *from;
            }
        });
    }

    /// Adds their gradient and its tangent.
    #[inline]
    pub(crate) fn add_tangent(
        &self,
        q: &[D],
        frames: &[EdgeFrame<D>],
        derivatives: Derivatives,
        gradient: &mut [D],
        tangent: &mut impl Tangent<D>,
    ) {
        if self.0.is_empty() {
            return;
        }
        let mut local = ([D::from(0.0); MOST], [[D::from(0.0); MOST]; MOST]);
        self.each(q, frames, |energy, site, q, first| {
            energy.tangent(&site, q, derivatives, &mut local);
            for (to, from) in gradient[first..].iter_mut().zip(&local.0[..q.len()]) {
                *to += *from;
            }
            tangent.add_corner(first, q.len(), &local.1);
        });
    }

    /// The first energy whose value or slope at `q` is no finite number, and where, m along the rod.
    pub(crate) fn not_finite(&self, q: &[D], frames: &[EdgeFrame<D>]) -> Option<(String, f64)> {
        let mut local = [D::from(0.0); MOST];
        for placed in &self.0 {
            let energy = D::instance(&*placed.energy);
            for spot in &placed.spots {
                let (own, edges) = placed.span(spot);
                let (site, own) = (placed.site(spot, &frames[edges]), &q[own]);
                energy.gradient(&site, own, Derivatives::Hand, &mut local);
                let slopes = local[..own.len()].iter().copied();
                let mut all = slopes.chain([energy.energy(&site, own)]);
                // Unknowns that are not finite are no fault of the energy.
                let is_there = own.iter().all(|x| x.value().is_finite());
                if is_there && all.any(|x| !x.value().is_finite()) {
                    return Some((placed.name.to_string(), spot.numbers[0].value()));
                }
            }
        }
        None
    }
}

impl Extra<Dual64> {
    /// Hands `add` the derivative of their gradient along the parameter they carry, at fixed unknowns
    /// and frames, place by place with its first unknown.
    pub(crate) fn add_gradient_rate(
        &self,
        q: &[f64],
        frames: &[EdgeFrame<f64>],
        derivatives: Derivatives,
        mut add: impl FnMut(usize, &[f64]),
    ) {
        if self.0.is_empty() {
            return;
        }
        let mut local = [Dual64::from(0.0); MOST];
        let mut own = [Dual64::from(0.0); MOST];
        let mut references = Vec::with_capacity(2);
        for placed in &self.0 {
            let energy = Dual64::instance(&*placed.energy);
            for spot in &placed.spots {
                let (unknowns, edges) = placed.span(spot);
                let (first, count) = (unknowns.start, unknowns.len());
                own.iter_mut().zip(&q[unknowns]).for_each(|(to, q)| *to = Dual64::from(*q));
                references.clear();
                references.extend(frames[edges].iter().map(|frame| frame.map(Dual64::from)));
                let site = placed.site(spot, &references);
                energy.gradient(&site, &own[..count], derivatives, &mut local);
                add(first, &local.map(|x| x.eps)[..count]);
            }
        }
    }
}
