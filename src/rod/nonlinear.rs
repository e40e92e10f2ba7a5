//! Parts of the stretching laws of a rod that are not linear in the strain: energy (J), gradient (N), tangent (N/m) and
//! axial force (N).
//!
//! Input: one [`NonlinearPart`] per edge, which is the law less its linear part, or none at all, with the linear laws
//! of the edges and the unknowns `q`. The sweeps over edges evaluate the linear laws; the functions here add the rest
//! to their results, edge after edge. `add_gradient`, `add_tangent` and `add_edge_tangent` (second derivatives by edge
//! vectors) add to their results; `stretch_energy` is the sum of the energies, `axial_force` the force of one edge. The
//! list is empty for a rod with linear laws. Nonlinear bending is elsewhere
//! ([`LayoutBending`](crate::rod::layout::LayoutBending)).

use crate::energy::Stretch;
use crate::energy::hyperelastic_stretch::{nonlinear_derivatives, nonlinear_gradient};
use crate::energy::law::NonlinearPart;
use crate::numerics::scalar::{RodScalar, Scalar};
use crate::numerics::tangent::Tangent;
use crate::rod::layout::{Layout, MAX_EDGE_UNKNOWNS};

/// The parts of the laws beyond the linear ones.
#[derive(Clone, Debug)]
pub struct NonlinearParts<D> {
    /// One per edge, or empty for linear laws.
    pub edges: Vec<NonlinearPart<D>>,
}

impl<D> Default for NonlinearParts<D> {
    /// Linear laws only.
    fn default() -> Self {
        Self { edges: Vec::new() }
    }
}

impl<D: RodScalar> NonlinearParts<D> {
    /// The sum of the energies of the edges beyond the linear law at `q`, J; zero of linear laws.
    pub(super) fn stretch_energy<L: Layout<N, S>, const N: usize, const S: usize>(
        &self,
        linear: &[Stretch<D, N>],
        q: &[D],
    ) -> f64 {
        let parts = self.edges.iter().zip(linear).enumerate();
        let energy = |(i, (part, linear)): (usize, (&NonlinearPart<D>, &Stretch<D, N>))| {
            (part.energy(linear.strain(&L::edge(q, i))) * linear.rest_length).value()
        };
        parts.map(energy).sum()
    }

    /// Adds to `gradient` the forces beyond the linear laws at `q`, N, on both nodes of every edge.
    pub(super) fn add_gradient<L: Layout<N, S>, const N: usize, const S: usize>(
        &self,
        linear: &[Stretch<D, N>],
        q: &[D],
        gradient: &mut [D],
    ) {
        for (i, (part, linear)) in self.edges.iter().zip(linear).enumerate() {
            add_to_nodes::<D, L, N, S>(
                i,
                nonlinear_gradient(part, linear, &L::edge(q, i)),
                gradient,
            );
        }
    }

    /// Adds gradient, N, and tangent, N/m, of the parts beyond the linear laws at `q`. With `under_tension`, given
    /// tensions replace the axial forces elsewhere: the forces here then have no part in the geometric stiffness.
    pub(super) fn add_tangent<L: Layout<N, S>, const N: usize, const S: usize>(
        &self,
        linear: &[Stretch<D, N>],
        q: &[D],
        under_tension: bool,
        gradient: &mut [D],
        tangent: &mut impl Tangent<D>,
    ) {
        for (i, (part, linear)) in self.edges.iter().zip(linear).enumerate() {
            let (force, h) = nonlinear_derivatives(part, linear, &L::edge(q, i), under_tension);
            add_to_nodes::<D, L, N, S>(i, force, gradient);
            let mut block = [[D::from(0.0); MAX_EDGE_UNKNOWNS]; MAX_EDGE_UNKNOWNS];
            for r in 0..N {
                for c in 0..N {
                    (block[r][c], block[L::STRIDE + r][L::STRIDE + c]) = (h[r][c], h[r][c]);
                    (block[r][L::STRIDE + c], block[L::STRIDE + r][c]) = (-h[r][c], -h[r][c]);
                }
            }
            tangent.add_corner(L::STRIDE * i, L::STRIDE + N, &block);
        }
    }

    /// Adds to `tangent` the second derivatives by edge vectors beyond the linear laws at `q`, N/m. Edge `i` has the
    /// rows and columns of node `i + 1`.
    pub(super) fn add_edge_tangent<L: Layout<N, S>, const N: usize, const S: usize>(
        &self,
        linear: &[Stretch<D, N>],
        q: &[D],
        tangent: &mut impl Tangent<D>,
    ) {
        for (i, (part, linear)) in self.edges.iter().zip(linear).enumerate() {
            let (_, hessian) = nonlinear_derivatives(part, linear, &L::edge(q, i), false);
            tangent.add_corner(L::STRIDE * (i + 1), N, &hessian);
        }
    }

    /// The force of edge `i` beyond the linear law, N, at the strain; zero of linear laws.
    pub(super) fn axial_force(&self, i: usize, strain: D) -> D {
        self.edges.get(i).map_or(strain.like(0.0), |part| part.response(strain)[1])
    }
}

/// Adds the force along edge `i`, N, to the gradient of its second node, and subtracts it from that of the first.
fn add_to_nodes<D: Scalar, L: Layout<N, S>, const N: usize, const S: usize>(
    i: usize,
    force: [D; N],
    gradient: &mut [D],
) {
    for c in 0..N {
        gradient[L::STRIDE * i + c] -= force[c];
        gradient[L::STRIDE * (i + 1) + c] += force[c];
    }
}
