//! User-defined energies on a rod.

use crate::energy::Derivatives;
use crate::energy::adapter::{AnyEnergy, Chart, MOST, Over, Site};
use crate::energy::frame::EdgeFrame;
use crate::energy::place::Spot;
use crate::numerics::scalar::{Nestable, Scalar};
use crate::numerics::tangent::Tangent;
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
    /// Writes a placed energy for debugging.
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

/// An energy at one of its places.
struct Occurrence<'a, D: Nestable> {
    name: &'a str,
    energy: &'a dyn Over<D>,
    site: Site<'a, D>,
    /// The first of its unknowns in the rod, and all of them.
    first: usize,
    q: &'a [D],
}

impl<D> Extra<D> {
    /// All user-defined energies with their places on the mesh.
    pub(crate) fn placed(&self) -> &[Placed<D>] {
        &self.0
    }
}

impl<D: Nestable> Extra<D> {
    /// User-defined energies at their places on a rod.
    pub(crate) fn new(placed: Vec<Placed<D>>) -> Self {
        Self(placed)
    }

    /// Whether there is none.
    pub(crate) fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// All places of all energies with their unknowns in `q`; `frames` are those of all edges, none in the plane.
    #[inline]
    fn sites<'a>(
        &'a self,
        q: &'a [D],
        frames: &'a [EdgeFrame<D>],
    ) -> impl Iterator<Item = Occurrence<'a, D>> {
        self.0.iter().flat_map(move |placed| {
            let energy = D::instance(&*placed.energy);
            placed.spots.iter().map(move |spot| {
                let (own, edges) = placed.span(spot);
                let (first, site) = (own.start, placed.site(spot, &frames[edges]));
                Occurrence { name: &placed.name, energy, site, first, q: &q[own] }
            })
        })
    }

    /// The sum of all energies, J.
    pub(crate) fn energy(&self, q: &[D], frames: &[EdgeFrame<D>]) -> f64 {
        self.sites(q, frames).map(|at| at.energy.energy(&at.site, at.q).value()).sum()
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
        // One array on the stack for all places.
        let mut local = [D::from(0.0); MOST];
        for at in self.sites(q, frames) {
            at.energy.gradient(&at.site, at.q, derivatives, &mut local);
            for (to, from) in gradient[at.first..].iter_mut().zip(&local[..at.q.len()]) {
                *to += *from;
            }
        }
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
        for at in self.sites(q, frames) {
            at.energy.tangent(&at.site, at.q, derivatives, &mut local);
            for (to, from) in gradient[at.first..].iter_mut().zip(&local.0[..at.q.len()]) {
                *to += *from;
            }
            tangent.add_corner(at.first, at.q.len(), &local.1);
        }
    }

    /// The first energy whose value or slope at `q` is no finite number, and where, m along the rod.
    pub(crate) fn non_finite_energy(
        &self,
        q: &[D],
        frames: &[EdgeFrame<D>],
    ) -> Option<(String, f64)> {
        let mut local = [D::from(0.0); MOST];
        for at in self.sites(q, frames) {
            at.energy.gradient(&at.site, at.q, Derivatives::Hand, &mut local);
            let slopes = local[..at.q.len()].iter().copied();
            let mut all = slopes.chain([at.energy.energy(&at.site, at.q)]);
            // Unknowns that are not finite are no fault of the energy.
            let is_there = at.q.iter().all(|x| x.value().is_finite());
            if is_there && all.any(|x| !x.value().is_finite()) {
                return Some((at.name.to_string(), at.site.place[0].value()));
            }
        }
        None
    }
}
