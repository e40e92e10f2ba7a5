//! User-defined energies on a rod: sums of energy (J), gradient (N) and tangent (N/m) over all places at which they
//! act.
//!
//! Each energy (the trait of [`crate::energy::own`]; energies of tendons and ties too) has its parameter values and a
//! list of weighted places on the mesh. Input: the unknowns `q` of the rod (m, rad) and the reference frames of its
//! edges, empty in a plane. For every place its local unknowns are taken from `q`, and its local derivatives are added
//! to those of the rod: by the energy's own formulas if requested and available, else by dual numbers. The energy is
//! returned in plain numbers. `non_finite_energy` returns name and arc length, m, of the first energy whose value or
//! gradient is not finite; `None` if all are finite. Places with unknowns that are not finite are skipped there.
//! `set_first_value` replaces the first parameter of energies, the tension of tendons; `with` joins two lists;
//! `copy_values` takes all values from another list of the same energies. `add_gradient` and `add_tangent` add to those
//! of the rod. `span` and `context` return, for one place, its ranges of unknowns and frames, and the other arguments
//! of the energy.

use crate::energy::Derivatives;
use crate::energy::adapter::{AnyEnergy, Chart, ElementContext, EnergyOver, MOST};
use crate::energy::frame::EdgeFrame;
use crate::energy::place::ElementPlacement;
use crate::numerics::scalar::{RodScalar, Scalar};
use crate::numerics::tangent::Tangent;
use std::sync::Arc;

/// The user-defined energies of a rod; an empty list without any.
#[derive(Clone, Debug)]
pub struct UserEnergies<D>(Vec<Placed<D>>);

/// A user-defined energy with its parameter values and its places on a mesh.
#[derive(Clone)]
pub(crate) struct Placed<D> {
    /// The name of the energy in messages.
    pub name: Arc<str>,
    /// The energy over plain and dual numbers.
    pub energy: Arc<dyn AnyEnergy>,
    /// The map from unknowns to positions and directors, with the number of unknowns of a node.
    pub chart: Chart<D>,
    /// The values of its parameters.
    pub values: Vec<D>,
    /// Its places on the mesh.
    pub placements: Vec<ElementPlacement<D>>,
}

impl<D> std::fmt::Debug for Placed<D> {
    /// Writes `NAME at COUNT places`.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} at {} places", self.name, self.placements.len())
    }
}

impl<D> Default for UserEnergies<D> {
    /// The empty list: no user-defined energies.
    fn default() -> Self {
        Self(Vec::new())
    }
}

impl<D: Scalar> Placed<D> {
    /// The range of the unknowns of a place in `q`, and the range of the reference frames of its edges. The latter is
    /// empty in the plane.
    pub fn span(
        &self,
        placement: &ElementPlacement<D>,
    ) -> (std::ops::Range<usize>, std::ops::Range<usize>) {
        let (nodes, first) = (self.energy.nodes(), self.chart.stride() * placement.first);
        let edges = match self.chart {
            Chart::Plane { .. } => 0..0,
            Chart::Space { .. } => placement.first..placement.first + nodes - 1,
        };
        (first..first + self.chart.unknowns(nodes), edges)
    }

    /// The arguments of the energy at a place, its unknowns excepted: layout, parameter values, numbers of the place,
    /// weight, and `frames`, the reference frames of its edges.
    pub fn context<'a>(
        &'a self,
        placement: &'a ElementPlacement<D>,
        frames: &'a [EdgeFrame<D>],
    ) -> ElementContext<'a, D> {
        let Self { chart, values, .. } = self;
        ElementContext {
            chart,
            frames,
            values,
            place: &placement.numbers,
            weight: placement.weight,
        }
    }
}

/// An energy at one of its places, with the unknowns there.
struct Occurrence<'a, D: RodScalar> {
    name: &'a str,
    energy: &'a dyn EnergyOver<D>,
    context: ElementContext<'a, D>,
    /// The index of its first unknown in the rod.
    first: usize,
    q: &'a [D],
}

impl<D> UserEnergies<D> {
    /// All user-defined energies with their places on the mesh.
    pub(crate) fn placed(&self) -> &[Placed<D>] {
        &self.0
    }
}

impl<D: RodScalar> UserEnergies<D> {
    /// User-defined energies with their places on a rod.
    pub(crate) fn new(placed: Vec<Placed<D>>) -> Self {
        Self(placed)
    }

    /// The energies of both lists, those of `other` last.
    pub(crate) fn with(mut self, other: Self) -> Self {
        self.0.extend(other.0);
        self
    }

    /// Sets the first parameter of the energies with the indices `energies`; other indices have no effect.
    pub(crate) fn set_first_value(&mut self, energies: &[usize], value: D) {
        for k in energies {
            if let Some(first) = self.0.get_mut(*k).and_then(|placed| placed.values.first_mut()) {
                *first = value;
            }
        }
    }

    /// Takes the parameter values of the same energies of another list; no effect if that list has another length.
    pub(crate) fn copy_values(&mut self, other: &Self) {
        if self.0.len() == other.0.len() {
            for (own, other) in self.0.iter_mut().zip(&other.0) {
                own.values.copy_from_slice(&other.values);
            }
        }
    }

    /// Whether there is no user-defined energy.
    pub(crate) fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// All places of all energies, energy after energy, each with name, energy function, arguments and local unknowns
    /// in `q`. `frames` are the reference frames of all edges; empty in the plane.
    #[inline]
    fn sites<'a>(
        &'a self,
        q: &'a [D],
        frames: &'a [EdgeFrame<D>],
    ) -> impl Iterator<Item = Occurrence<'a, D>> {
        self.0.iter().flat_map(move |placed| {
            // Once per energy: the choice of the compiled instance is the same for all places.
            let energy = D::instance(&*placed.energy);
            placed.placements.iter().map(move |placement| {
                let (own, edges) = placed.span(placement);
                let (first, context) = (own.start, placed.context(placement, &frames[edges]));
                Occurrence { name: &placed.name, energy, context, first, q: &q[own] }
            })
        })
    }

    /// The sum of all energies over all their places, with their weights, at the unknowns `q`, J, without derivatives;
    /// zero without energies.
    pub(crate) fn energy(&self, q: &[D], frames: &[EdgeFrame<D>]) -> f64 {
        self.sites(q, frames).map(|at| at.energy.energy(&at.context, at.q).value()).sum()
    }

    /// Adds to `gradient` that of all energies at `q`, N (N m for angles). `derivatives` selects an energy's own
    /// formulas, where it has them, or dual numbers. Without energies nothing happens.
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
            at.energy.gradient(&at.context, at.q, derivatives, &mut local);
            for (to, from) in gradient[at.first..].iter_mut().zip(&local[..at.q.len()]) {
                *to += *from;
            }
        }
    }

    /// Adds gradient and second derivatives of all energies at `q` to `gradient`, N, and `tangent`, N/m.
    /// `derivatives` selects an energy's own formulas, where it has them, or dual numbers. Without energies nothing
    /// happens.
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
        // One block on the stack for all places, of the size of the largest element.
        let mut local = ([D::from(0.0); MOST], [[D::from(0.0); MOST]; MOST]);
        for at in self.sites(q, frames) {
            at.energy.tangent(&at.context, at.q, derivatives, &mut local);
            for (to, from) in gradient[at.first..].iter_mut().zip(&local.0[..at.q.len()]) {
                *to += *from;
            }
            tangent.add_corner(at.first, at.q.len(), &local.1);
        }
    }

    /// Name and arc length, m, of the first energy whose value or gradient at `q` is not finite; `None` if all are
    /// finite. The gradient is by the energy's own formulas, where it has them, else by dual numbers. Places with
    /// unknowns that are not finite are skipped.
    pub(crate) fn non_finite_energy(
        &self,
        q: &[D],
        frames: &[EdgeFrame<D>],
    ) -> Option<(String, f64)> {
        let mut local = [D::from(0.0); MOST];
        for at in self.sites(q, frames) {
            at.energy.gradient(&at.context, at.q, Derivatives::Hand, &mut local);
            let slopes = local[..at.q.len()].iter().copied();
            let mut all = slopes.chain([at.energy.energy(&at.context, at.q)]);
            // Unknowns that are not finite are no fault of the energy.
            let is_there = at.q.iter().all(|x| x.value().is_finite());
            if is_there && all.any(|x| !x.value().is_finite()) {
                return Some((at.name.to_string(), at.context.place[0].value()));
            }
        }
        None
    }
}
