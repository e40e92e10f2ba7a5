//! The rod in the plane: stretch and bend, two unknowns a node.
//!
//! Unknowns `q = [x0, y0, x1, y1, ..]`, m, in the plane of the scene; half-bandwidth 5.

mod edges;
mod geometry;
mod rates;
mod sweep;
mod transposed;

use crate::energy::friction::Springs;
use crate::energy::{
    DeadLoad, DeadMoment, Derivatives, Element, Local, PlanarBend, Stretch, dual_gradient,
    dual_tangent,
};
use crate::numerics::banded::BandMatrix;
use crate::numerics::scalar::{Nestable, Scalar};
use crate::numerics::tangent::Tangent;
pub use crate::rod::planar::edges::HALF_BANDWIDTH;
use crate::rod::planar::edges::{ByEdge, TakesEdges, ToEdges, ToNodes};
pub use crate::rod::planar::geometry::Geometry;
use crate::rod::planar::sweep::{EdgeTangent, Elastic, Elements, Forces, Measured, TangentSweep};
use crate::rod::{
    Energies, Extra, InternalVariables, Rod, Viscosity, half_a_turn_apart, turned_far,
};
use num_dual::Dual64;
use std::f64::consts::TAU;

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
    /// Springs of internal friction beside the bends, acting ones with the elastic stiffness and where they would be
    /// at no curvature.
    pub sliders: Option<Springs<D, [D; 2]>>,
    /// Energies of one's own.
    pub own: Extra<D>,
}

/// The unknowns of element `i`: `N` of them from node `i` on.
#[inline(always)]
fn unknowns<D: Copy, const N: usize>(q: &[D], i: usize) -> &[D; N] {
    q[2 * i..].first_chunk().expect("an element's nodes are nodes of the rod")
}

/// The vector of edge `i`, m.
#[inline(always)]
fn edge<D: Scalar>(q: &[D], i: usize) -> [D; 2] {
    let [x0, y0, x1, y1] = *unknowns(q, i);
    [x1 - x0, y1 - y0]
}

#[inline(always)]
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
    /// What it is made of.
    fn elements(&self) -> Elements<'_, D> {
        let Self { stretch, bend, load, sliders, .. } = self;
        let springs = sliders.as_ref().filter(|springs| !springs.acting.is_empty());
        Elements { stretch, bend, load, springs, tensions: None }
    }

    /// Bend `i` with its spring of internal friction, where the rod is at `q`.
    fn element(&self, i: usize, q: &[D]) -> PlanarBend<D> {
        let bend = &self.bend[i];
        self.elements().sliding(i, bend, bend.strain(unknowns(q, i)))
    }

    /// Shows all derivatives by num-dual.
    fn each_edge_in_duals(&self, q: &[D], tensions: Option<&[D]>, to: &mut impl TakesEdges<D>) {
        let zero = D::from(0.0);
        let mut open = ByEdge { gradient: [zero; 2], vector: [zero; 3] };
        for (i, element) in self.stretch.iter().enumerate() {
            let Local { gradient: [.., gx, gy], hessian: h, .. } =
                dual_tangent(element, unknowns(q, i));
            let mut own = open.plus([gx, gy], [h[2][2], h[3][2], h[3][3]]);
            if let Some(tensions) = tensions {
                let gain = element.under(&edge(q, i), tensions[i]);
                own = own.plus([zero; 2], [gain[0][0], gain[1][0], gain[1][1]]);
            }
            let mut after = [[zero; 2]; 2];
            if i < self.bend.len() {
                let Local { gradient: g, hessian: h, .. } =
                    dual_tangent(&self.element(i, q), unknowns(q, i));
                // The first edge goes against the first node, the second with the last.
                own = own.plus([-g[0], -g[1]], [h[0][0], h[1][0], h[1][1]]);
                after = [[-h[4][0], -h[4][1]], [-h[5][0], -h[5][1]]];
                open = ByEdge { gradient: [g[4], g[5]], vector: [h[4][4], h[5][4], h[5][5]] };
            }
            to.edges(i, &own, &after);
        }
    }

    /// What acts beside stretching, bending and dead loads.
    #[inline(always)]
    fn add_to_tangent(
        &self,
        q: &[D],
        derivatives: Derivatives,
        gradient: &mut [D],
        tangent: &mut BandMatrix<D, HALF_BANDWIDTH>,
    ) {
        for (i, moment) in &self.moment {
            let local = moment.tangent(unknowns(q, *i));
            scatter(&local.gradient, gradient, *i);
            tangent.add_block(2 * i, &local.hessian);
        }
        self.own.add_tangent(q, &[], derivatives, gradient, tangent);
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

impl<D: Nestable> Rod<D> for PlanarRod<D> {
    type Tangent = BandMatrix<D, HALF_BANDWIDTH>;
    type Dual = PlanarRod<Dual64>;
    type Frames = ();
    type Geometry = Geometry;

    const HAS_FRAMES: bool = false;

    fn is_angle(_: usize) -> bool {
        false
    }

    fn mass(&self) -> &[D] {
        &self.mass
    }

    fn gradient(&self, q: &[D], (): &(), derivatives: Derivatives, gradient: &mut [D]) {
        if D::PLAIN && derivatives == Derivatives::Dual {
            self.set_loads(q, gradient);
            add_gradients(&self.stretch, q, gradient, dual_gradient);
            for i in 0..self.bend.len() {
                let local: [D; 6] = dual_gradient(&self.element(i, q), unknowns(q, i));
                scatter(&local, gradient, i);
            }
        } else {
            D::side_by_side(Forces { at: (self.elements(), q), gradient });
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
        self.tangent_under(q, &(), derivatives, None, (gradient, tangent));
    }

    fn tangent_under(
        &self,
        q: &[D],
        (): &(),
        derivatives: Derivatives,
        tensions: Option<&[D]>,
        (gradient, tangent): (&mut [D], &mut BandMatrix<D, HALF_BANDWIDTH>),
    ) {
        if D::PLAIN && derivatives == Derivatives::Dual {
            let mut nodes = ToNodes::<D, D>::new((), &self.load, gradient, tangent);
            self.each_edge_in_duals(q, tensions, &mut nodes);
            nodes.end();
        } else {
            let elements = Elements { tensions, ..self.elements() };
            let (at, gradient, tangent) = ((elements, q), &mut *gradient, &mut *tangent);
            D::side_by_side(TangentSweep { at, gradient, tangent, geometry: None });
        }
        self.add_to_tangent(q, derivatives, gradient, tangent);
    }

    fn tensions_after(&self, change: &[D], q: &[D], tensions: &mut Vec<D>) {
        tensions.clear();
        for (i, stretch) in self.stretch.iter().enumerate() {
            let (now, change) = (edge(q, i), edge(change, i));
            let before = [now[0] - change[0], now[1] - change[1]];
            tensions.push(stretch.tension_after(&before, &now));
        }
    }

    fn measure(&self, q: &[D], (): &(), geometry: &mut Geometry) {
        D::side_by_side(Measured { at: (self.elements(), q), geometry });
    }

    fn measured_tangent(
        &self,
        q: &[D],
        (): &(),
        derivatives: Derivatives,
        (gradient, tangent): (&mut [D], &mut BandMatrix<D, HALF_BANDWIDTH>),
        geometry: &mut Geometry,
    ) {
        if !D::PLAIN || derivatives == Derivatives::Dual {
            self.tangent(q, &(), derivatives, gradient, tangent);
            if D::PLAIN {
                self.measure(q, &(), geometry);
            }
            return;
        }
        let (forces, stiffness) = (&mut *gradient, &mut *tangent);
        D::side_by_side(TangentSweep {
            at: (self.elements(), q),
            gradient: forces,
            tangent: stiffness,
            geometry: Some(geometry),
        });
        self.add_to_tangent(q, derivatives, gradient, tangent);
    }

    fn edge_tangent(
        &self,
        q: &[D],
        (): &(),
        derivatives: Derivatives,
        tangent: &mut BandMatrix<D, HALF_BANDWIDTH>,
    ) {
        tangent.clear();
        let mut edges = ToEdges { tangent, last: self.bend.len() };
        if D::PLAIN && derivatives == Derivatives::Dual {
            self.each_edge_in_duals(q, None, &mut edges);
        } else {
            D::side_by_side(EdgeTangent { at: (self.elements(), q), edges });
        }
        for (i, moment) in &self.moment {
            // By its second node is by its edge.
            let h = moment.tangent(unknowns(q, *i)).hessian;
            tangent.add_block(2 * i + 2, &[[h[2][2], h[2][3]], [h[3][2], h[3][3]]]);
        }
    }

    fn rebase((): &mut (), _: &[D]) {}

    fn real_frames((): &(), (): &mut ()) {}

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
        // Hardly any edge is ever so far from the one before that it must be looked at closely.
        let (nodes, _) = now.as_chunks::<2>();
        let mut edge = [D::from(0.0); 2];
        let (mut last, mut least) = (nodes[0], 0.0);
        for node in &nodes[1..] {
            let next = [node[0] - last[0], node[1] - last[1]];
            let dot = (edge[0] * next[0] + edge[1] * next[1]).value();
            least = if dot < least { dot } else { least };
            (edge, last) = (next, *node);
        }
        if least == 0.0 {
            return None;
        }
        self.bend.iter().enumerate().position(struck).map(|i| i + 1)
    }

    fn leapt(&self, before: &[D], now: &[D]) -> Option<usize> {
        (0..self.stretch.len()).find(|i| turned_far(edge(before, *i), edge(now, *i)))
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
        let mut sums = D::side_by_side(Elastic { at: (self.elements(), q) });
        for (i, load) in self.load.iter().enumerate() {
            sums.potential += load.energy(unknowns(q, i)).value();
        }
        sums.potential += self.moment_potential(q);
        sums.own = self.own.energy(q, &[]);
        sums
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

    fn set_viscous(&mut self, elastic: &Self, viscosity: &Viscosity<D>) {
        let [stretch, bend] = [0, 1].map(|kind| viscosity.factor(kind));
        let edges = elastic.stretch.len();
        for (i, (to, from)) in self.stretch.iter_mut().zip(&elastic.stretch).enumerate() {
            *to = from.viscous(stretch, viscosity.shift(0, i));
        }
        for (i, (to, from)) in self.bend.iter_mut().zip(&elastic.bend).enumerate() {
            *to = from.viscous(bend, viscosity.shift(1, edges + i));
        }
    }

    fn set_dashpots(&mut self, dashpots: &Self, viscosity: &Viscosity<D>) {
        let [stretch, bend] = [0, 1].map(|kind| viscosity.factor(kind));
        let (stretched, bent) = viscosity.shift.split_at(dashpots.stretch.len());
        for ((to, from), strain) in self.stretch.iter_mut().zip(&dashpots.stretch).zip(stretched) {
            (to.stiffness, to.natural_strain) = (from.stiffness * stretch, *strain);
        }
        for ((to, from), strain) in self.bend.iter_mut().zip(&dashpots.bend).zip(bent) {
            (to.stiffness, to.natural_curvature) = (from.stiffness * bend, *strain);
        }
    }

    fn slides(&self) -> usize {
        if self.sliders.is_some() { self.bend.len() } else { 0 }
    }

    fn set_springs(&mut self, elastic: &Self, before: Option<&InternalVariables<D>>) {
        let Some(springs) = &mut self.sliders else { return };
        springs.acting.clear();
        let Some(InternalVariables { strain, slid, .. }) = before else { return };
        let starts = strain[elastic.stretch.len()..].iter().zip(slid);
        let spring =
            |(bend, (strain, slid)): (&PlanarBend<D>, (&D, &D))| [bend.stiffness, *slid - *strain];
        springs.acting.extend(elastic.bend.iter().zip(starts).map(spring));
    }

    fn slip(&self, z: &mut [D]) {
        if let Some(Springs { sliders, .. }) = &self.sliders {
            z.iter_mut().enumerate().for_each(|(i, z)| *z = sliders.slid(i, *z));
        }
    }

    fn distance_to_slipping(&self, z: &[D]) -> f64 {
        let Some(Springs { sliders, .. }) = &self.sliders else { return f64::INFINITY };
        let limits = z.iter().enumerate().map(|(i, z)| sliders.from_limit(i, *z));
        limits.fold(f64::INFINITY, f64::min)
    }

    fn slider_energy(&self, z: &[D]) -> f64 {
        let Some(Springs { sliders, .. }) = &self.sliders else { return 0.0 };
        let energy = |(z, bend): (&D, &PlanarBend<D>)| (*z * *z * bend.stiffness).value();
        0.5 * sliders.stiffness.value() * z.iter().zip(&self.bend).map(energy).sum::<f64>()
    }
}
