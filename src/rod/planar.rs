//! The rod in the plane: stretch and bend, two unknowns a node.
//!
//! Unknowns `q = [x0, y0, x1, y1, ..]`, m, in the plane of the scene; half-bandwidth 5.

use crate::energy::{
    DeadLoad, DeadMoment, Derivatives, Element, Local, PlanarBend, Stretch, dual_gradient,
    dual_gradient_rate, dual_tangent,
};
use crate::numerics::banded::BandMatrix;
use crate::numerics::scalar::{Nestable, Scalar};
use crate::rod::edges::add_edges;
use crate::rod::{Energies, Extra, Rod, half_a_turn_apart};
use num_dual::Dual64;
use std::f64::consts::TAU;

/// Half-bandwidth of the planar tangent.
pub const HALF_BANDWIDTH: usize = 5;

/// The elements, masses and loads of a planar rod.
#[derive(Clone, Debug)]
pub struct PlanarRod<D> {
    /// One per edge.
    pub stretch: Vec<Stretch<D, 2>>,
    /// One per inner node: `bend[i]` sits at node `i + 1`.
    pub bend: Vec<PlanarBend<D>>,
    /// Lumped mass of every degree of freedom, kg.
    pub mass: Vec<D>,
    /// Weight and point forces, one per node.
    pub load: Vec<DeadLoad<D, 2>>,
    /// Moments, each with the edge it turns.
    pub moment: Vec<(usize, DeadMoment<D>)>,
    /// The first edge's direction at rest: angles of the moments' potential count from it.
    pub heading: [D; 2],
    /// Energies of one's own.
    pub own: Extra<D>,
}

/// The unknowns of element `i`: `N` of them from node `i` on.
#[inline]
fn unknowns<D: Copy, const N: usize>(q: &[D], i: usize) -> &[D; N] {
    q[2 * i..].first_chunk().expect("an element's nodes are nodes of the rod")
}

#[inline]
fn scatter<D: Scalar, const N: usize>(from: &[D; N], to: &mut [D], i: usize) {
    let to: &mut [D; N] = to[2 * i..].first_chunk_mut().expect("an element's nodes are the rod's");
    for (to, from) in to.iter_mut().zip(from) {
        *to += *from;
    }
}

fn add_gradients<D: Scalar, E: Element<D, N>, const N: usize>(
    elements: &[E],
    q: &[D],
    gradient: &mut [D],
    local: impl Fn(&E, &[D; N]) -> [D; N],
) {
    for (i, element) in elements.iter().enumerate() {
        scatter(&local(element, unknowns(q, i)), gradient, i);
    }
}

impl<D: Nestable> PlanarRod<D> {
    /// Gradient and tangent in one sweep along the rod; `stretch` and `bend` differentiate one
    /// element each.
    ///
    /// A window holds the sums for the three nodes that the current edge and bend touch. Once they
    /// are added, the window's first node is complete: its columns are written, once, and the
    /// window moves on.
    #[inline]
    fn sweep(
        &self,
        q: &[D],
        gradient: &mut [D],
        tangent: &mut BandMatrix<D, HALF_BANDWIDTH>,
        stretch: impl Fn(&Stretch<D, 2>, &[D; 4]) -> Local<D, 4>,
        bend: impl Fn(&PlanarBend<D>, &[D; 6]) -> Local<D, 6>,
    ) {
        let zero = D::from(0.0);
        let mut g = [zero; 6];
        // The lower triangle.
        let mut h = [[zero; 6]; 6];
        for (i, edge) in self.stretch.iter().enumerate() {
            add_lower(&mut g, &mut h, &stretch(edge, unknowns(q, i)));
            if let Some(node) = self.bend.get(i) {
                add_lower(&mut g, &mut h, &bend(node, unknowns(q, i)));
            }
            self.complete(i, &g, gradient);
            tangent.set_columns::<2, 6>(2 * i, &h);
            for r in 0..4 {
                g[r] = g[r + 2];
                for c in 0..=r {
                    h[r][c] = h[r + 2][c + 2];
                }
            }
            g[4..].fill(zero);
            h[4..].fill([zero; 6]);
        }
        self.complete(self.stretch.len(), &g, gradient);
        tangent.set_columns::<2, 6>(2 * self.stretch.len(), &h);
        for (i, moment) in &self.moment {
            let local = moment.tangent(unknowns(q, *i));
            scatter(&local.gradient, gradient, *i);
            tangent.add_block(2 * i, &local.hessian);
        }
    }

    /// Writes the gradient of node `i`: its elastic part, first in `g`, less its load.
    #[inline]
    fn complete(&self, i: usize, g: &[D; 6], gradient: &mut [D]) {
        let load = &self.load[i].force;
        gradient[2 * i] = g[0] - load[0];
        gradient[2 * i + 1] = g[1] - load[1];
    }

    /// The hand-derived gradient in one sweep. An edge carries its axial force, and the difference
    /// of the moments at its ends over its length as shear force; what two edges carry and the load
    /// of the node between them is the gradient there.
    #[inline]
    fn hand_gradient(&self, q: &[D], gradient: &mut [D]) {
        let zero = D::from(0.0);
        let (gradient, _) = gradient.as_chunks_mut::<2>();
        // Of the edge before: unit tangent, unit normal over length, force but for its last moment.
        let (mut t, mut n, mut open) = ([zero; 2], [zero; 2], [zero; 2]);
        let mut carried = [zero; 2];
        for (j, edge) in self.stretch.iter().enumerate() {
            let [x0, y0, x1, y1] = *unknowns(q, j);
            let e = [x1 - x0, y1 - y0];
            let squared = e[0] * e[0] + e[1] * e[1];
            let length = squared.sqrt();
            let inverse = length.recip();
            let next = [e[0] * inverse, e[1] * inverse];
            let normal = [-(next[1] * inverse), next[0] * inverse];
            let axial = edge.force(squared, length);
            let mut force = [next[0] * axial, next[1] * axial];
            if j > 0 {
                let moment = self.bend[j - 1].moment(t, next);
                let closed = [open[0] - moment * n[0], open[1] - moment * n[1]];
                force = [force[0] + moment * normal[0], force[1] + moment * normal[1]];
                let load = &self.load[j - 1].force;
                gradient[j - 1] =
                    [carried[0] - closed[0] - load[0], carried[1] - closed[1] - load[1]];
                carried = closed;
            }
            (t, n, open) = (next, normal, force);
        }
        let last = self.stretch.len();
        let (before, end) = (&self.load[last - 1].force, &self.load[last].force);
        gradient[last - 1] = [carried[0] - open[0] - before[0], carried[1] - open[1] - before[1]];
        gradient[last] = [open[0] - end[0], open[1] - end[1]];
    }

    fn set_loads(&self, q: &[D], gradient: &mut [D]) {
        for (i, load) in self.load.iter().enumerate() {
            gradient[2 * i..2 * i + 2].copy_from_slice(&load.gradient(unknowns(q, i)));
        }
    }

    /// The angle of the first edge from its direction at rest, in (-pi, pi], rad.
    fn first_angle(&self, q: &[D]) -> f64 {
        let first = DeadMoment { moment: D::from(-1.0), rest: self.heading };
        first.energy(unknowns(q, 0)).value()
    }

    /// The potential of the moments, J: angles are counted on from the first edge's, beyond half
    /// turns, by the turning angles of the joints.
    fn moment_potential(&self, q: &[D]) -> f64 {
        let Some(last) = self.moment.iter().map(|(i, _)| *i).max() else { return 0.0 };
        let mut angle = self.first_angle(q);
        let mut potential = 0.0;
        for j in 0..=last {
            if j > 0 {
                angle += 2.0 * (0.5 * self.bend[j - 1].strain(unknowns(q, j - 1)).value()).atan();
            }
            let here = self.moment.iter().filter(|(i, _)| *i == j);
            potential -= here.map(|(_, m)| m.moment.value() * angle).sum::<f64>();
        }
        potential
    }
}

/// Adds an element's gradient and the lower triangle of its Hessian.
#[inline]
fn add_lower<D: Scalar, const N: usize>(g: &mut [D; 6], h: &mut [[D; 6]; 6], local: &Local<D, N>) {
    for r in 0..N {
        g[r] += local.gradient[r];
        for c in 0..=r {
            h[r][c] += local.hessian[r][c];
        }
    }
}

impl<D: Nestable> Rod<D, HALF_BANDWIDTH> for PlanarRod<D> {
    type Dual = PlanarRod<Dual64>;
    type Frames = ();

    const HAS_FRAMES: bool = false;

    fn is_angle(_: usize) -> bool {
        false
    }

    fn mass(&self) -> &[D] {
        &self.mass
    }

    fn gradient(&self, q: &[D], (): &(), derivatives: Derivatives, gradient: &mut [D]) {
        match derivatives {
            Derivatives::Hand => self.hand_gradient(q, gradient),
            Derivatives::Dual => {
                self.set_loads(q, gradient);
                add_gradients(&self.stretch, q, gradient, dual_gradient);
                add_gradients(&self.bend, q, gradient, dual_gradient);
            }
        }
        for (i, moment) in &self.moment {
            scatter(&moment.gradient(unknowns(q, *i)), gradient, *i);
        }
        self.own.add_gradient(q, &[], derivatives, gradient);
    }

    fn tangent(
        &self,
        q: &[D],
        (): &(),
        derivatives: Derivatives,
        gradient: &mut [D],
        tangent: &mut BandMatrix<D, HALF_BANDWIDTH>,
    ) {
        match derivatives {
            Derivatives::Hand => {
                self.sweep(q, gradient, tangent, |e, q| e.tangent(q), |e, q| e.tangent(q));
            }
            Derivatives::Dual => self.sweep(q, gradient, tangent, dual_tangent, dual_tangent),
        }
        self.own.add_tangent(q, &[], derivatives, gradient, tangent);
    }

    fn edge_tangent(
        &self,
        q: &[D],
        (): &(),
        derivatives: Derivatives,
        tangent: &mut BandMatrix<D, HALF_BANDWIDTH>,
    ) {
        const EDGE: [(usize, f64); 2] = [(0, -1.0), (1, -1.0)];
        const EDGES: [(usize, f64); 4] = [(0, -1.0), (1, -1.0), (4, 1.0), (5, 1.0)];
        tangent.clear();
        for (i, element) in self.stretch.iter().enumerate() {
            let own = unknowns(q, i);
            let local = match derivatives {
                Derivatives::Hand => element.tangent(own),
                Derivatives::Dual => dual_tangent(element, own),
            };
            add_edges(tangent, 2 * i + 2, &local.hessian, &EDGE);
        }
        for (i, element) in self.bend.iter().enumerate() {
            let own = unknowns(q, i);
            let local = match derivatives {
                Derivatives::Hand => element.tangent(own),
                Derivatives::Dual => dual_tangent(element, own),
            };
            add_edges(tangent, 2 * i + 2, &local.hessian, &EDGES);
        }
        for (i, moment) in &self.moment {
            add_edges(tangent, 2 * i + 2, &moment.tangent(unknowns(q, *i)).hessian, &EDGE);
        }
    }

    fn gradient_rate(
        dual: &PlanarRod<Dual64>,
        q: &[f64],
        (): &(),
        derivatives: Derivatives,
        rate: &mut [f64],
    ) {
        rate.fill(0.0);
        macro_rules! add {
            ($elements:expr, $rate:expr) => {
                for (i, element) in $elements.iter().enumerate() {
                    scatter(&$rate(element, unknowns(q, i)), rate, i);
                }
            };
        }
        add!(dual.load, <DeadLoad<f64, 2> as Element<f64, 2>>::gradient_rate);
        for (i, moment) in &dual.moment {
            let own = <DeadMoment<f64> as Element<f64, 4>>::gradient_rate(moment, unknowns(q, *i));
            scatter(&own, rate, *i);
        }
        match derivatives {
            Derivatives::Hand => {
                add!(dual.stretch, <Stretch<f64, 2> as Element<f64, 4>>::gradient_rate);
                add!(dual.bend, <PlanarBend<f64> as Element<f64, 6>>::gradient_rate);
            }
            Derivatives::Dual => {
                add!(dual.stretch, dual_gradient_rate);
                add!(dual.bend, dual_gradient_rate);
            }
        }
        dual.own.add_gradient_rate(q, &[], derivatives, rate);
    }

    fn frame_rate(
        (): &(),
        _: &[f64],
        _: &[f64],
        _: &BandMatrix<f64, HALF_BANDWIDTH>,
        _: &mut [f64],
    ) {
    }

    fn rebase((): &mut (), _: &[D]) {}

    fn refer(_: &mut [D], (): &(), (): &()) {}

    fn folded(&self, before: &[D], now: &[D], (): &()) -> Option<usize> {
        let struck = |(i, bend): (usize, &PlanarBend<D>)| {
            let [x0, y0, x1, y1, x2, y2] = *unknowns(now, i);
            let dot = (x1 - x0) * (x2 - x1) + (y1 - y0) * (y2 - y1);
            dot.value() < 0.0 && {
                let curvature = |q: &[D]| bend.strain(unknowns(q, i)).value();
                half_a_turn_apart(curvature(before) * curvature(now))
            }
        };
        self.bend.iter().enumerate().position(struck).map(|i| i + 1)
    }

    /// A hinged rod turns beyond half a turn, where its first angle jumps.
    fn wound(&self, before: &[D], now: &[D]) -> f64 {
        if self.moment.is_empty() {
            return 0.0;
        }
        let turns = ((self.first_angle(before) - self.first_angle(now)) / TAU).round();
        let moments: f64 = self.moment.iter().map(|(_, m)| m.moment.value()).sum();
        -TAU * turns * moments
    }

    fn not_finite(&self, q: &[D], (): &()) -> Option<(String, f64)> {
        self.own.not_finite(q, &[])
    }

    fn energies(&self, q: &[D], (): &()) -> Energies {
        fn sum<D: Scalar, E: Element<D, N>, const N: usize>(elements: &[E], q: &[D]) -> f64 {
            elements.iter().enumerate().map(|(i, e)| e.energy(unknowns(q, i)).value()).sum()
        }
        Energies {
            stretch: sum(&self.stretch, q),
            bend: sum(&self.bend, q),
            potential: sum(&self.load, q) + self.moment_potential(q),
            own: self.own.energy(q, &[]),
            ..Energies::default()
        }
    }

    fn strains(&self, q: &[D], (): &(), strains: &mut Vec<D>) {
        strains.clear();
        strains.extend(self.stretch.iter().enumerate().map(|(i, e)| {
            let [x0, y0, x1, y1] = *unknowns(q, i);
            e.strain(&[x1 - x0, y1 - y0])
        }));
        strains.extend(self.bend.iter().enumerate().map(|(i, e)| e.strain(unknowns(q, i))));
    }

    fn dashpots(&self) -> Self {
        let mut rod = self.clone();
        let zero = D::from(0.0);
        rod.stretch.iter_mut().for_each(|e| e.natural_strain = zero);
        rod.bend.iter_mut().for_each(|e| e.natural_curvature = zero);
        rod.load.iter_mut().for_each(|load| load.force = [zero; 2]);
        rod.moment.clear();
        rod.own = Extra::default();
        rod
    }

    fn strain_energies(&self, strains: &[D]) -> [D; 3] {
        let (stretch, bend) = strains.split_at(self.stretch.len());
        let mut energies = [D::from(0.0); 3];
        for (e, s) in self.stretch.iter().zip(stretch) {
            energies[0] += e.stiffness * e.rest_length * *s * *s * 0.5;
        }
        for (e, s) in self.bend.iter().zip(bend) {
            energies[1] += e.stiffness * *s * *s * 0.5;
        }
        energies
    }

    fn set_viscous(&mut self, elastic: &Self, factor: D, shift: &[D]) {
        let (stretch_shift, bend_shift) = shift.split_at(elastic.stretch.len());
        for ((to, from), shift) in self.stretch.iter_mut().zip(&elastic.stretch).zip(stretch_shift)
        {
            *to = from.viscous(factor, *shift);
        }
        for ((to, from), shift) in self.bend.iter_mut().zip(&elastic.bend).zip(bend_shift) {
            *to = from.viscous(factor, *shift);
        }
    }
}
