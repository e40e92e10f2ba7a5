//! The rod in space: stretch, bend and twist, four unknowns a node.
//!
//! Unknowns `q = [x0 (3), theta0, x1 (3), theta1, .., x_last (3)]`, m and rad; half-bandwidth 10.

mod forces;
mod geometry;
mod moving;
mod rates;
mod sweep;
mod transposed;

use crate::energy::BendTwist;
use crate::energy::bend_twist;
use crate::energy::bend_twist::JointLaw;
use crate::energy::frame::{EdgeFrame, Frames, transported_twist};
use crate::energy::friction::Springs;
use crate::energy::joint::ByEdge;
use crate::energy::{DeadLoad, Derivatives, Element, Local, Stretch, dual_gradient, dual_tangent};
use crate::numerics::banded::BandMatrix;
use crate::numerics::scalar::{Nestable, Scalar};
use crate::numerics::tangent::Tangent;
use crate::numerics::vector::{Vector, add, dot, each, sub, unit};
pub use crate::rod::edges::HALF_BANDWIDTH;
use crate::rod::edges::{STRIDE, TakesEdges, ToEdges, ToNodes};
use crate::rod::spatial::forces::{Gradient, MovedGradient};
pub use crate::rod::spatial::geometry::Geometry;
use crate::rod::spatial::moving::Rebase;
use crate::rod::spatial::sweep::{
    EdgeTangent, Elastic, Elements, Measured, Spring, Strains, TangentSweep,
};
use crate::rod::{
    Energies, Extra, InternalVariables, Rod, Viscosity, half_a_turn_apart, turned_far,
};
use num_dual::Dual64;
use std::f64::consts::TAU;

/// Unknowns of a bend and twist.
const WINDOW: usize = bend_twist::UNKNOWNS;
/// Where the six unknowns of a stretch stand in the window.
const ENDS: [usize; 6] = [0, 1, 2, 4, 5, 6];

/// The elements, masses and loads of a spatial rod.
#[derive(Clone, Debug)]
pub struct SpatialRod<D> {
    /// One per edge.
    pub stretch: Vec<Stretch<D, 3>>,
    /// One per inner node: `joint[i]` sits at node `i + 1`.
    pub joint: Vec<JointLaw<D>>,
    /// Lumped mass of every degree of freedom, kg, and rotational inertia of every edge, kg m^2.
    pub mass: Vec<D>,
    /// Weight and point forces, one per node.
    pub load: Vec<DeadLoad<D, 3>>,
    /// Springs of internal friction beside the joints.
    pub sliders: Option<Springs<D, Spring<D>>>,
    /// Energies of one's own.
    pub own: Extra<D>,
}

/// The unknowns of bend and twist `i`.
#[inline(always)]
fn around<D: Copy>(q: &[D], i: usize) -> &[D; WINDOW] {
    q[STRIDE * i..].first_chunk().expect("a joint's nodes are nodes of the rod")
}

/// The unknowns of stretch `i`.
#[inline(always)]
fn ends<D: Copy>(q: &[D], i: usize) -> [D; 6] {
    let own: &[D; 7] = q[STRIDE * i..].first_chunk().expect("an edge's nodes are nodes of the rod");
    let [a, b, c, d, e, f] = ENDS;
    [own[a], own[b], own[c], own[d], own[e], own[f]]
}

/// The position of node `i`, m.
#[inline(always)]
fn position<D: Copy>(q: &[D], i: usize) -> Vector<D> {
    *q[STRIDE * i..].first_chunk().expect("a node of the rod")
}

/// The vector of edge `i`, m.
#[inline(always)]
fn edge<D: Scalar>(q: &[D], i: usize) -> Vector<D> {
    sub(position(q, i + 1), position(q, i))
}

#[inline(always)]
fn add_at<D: Scalar>(to: &mut [D], i: usize, from: &Vector<D>) {
    for (to, from) in to[STRIDE * i..].iter_mut().zip(from) {
        *to += *from;
    }
}

/// The springs of friction, and the one of a joint.
type ActingSpring<'a, D> = (&'a Springs<D, Spring<D>>, &'a Spring<D>);

impl<D: Nestable> SpatialRod<D> {
    /// Bend and twist `i` with its reference.
    #[inline(always)]
    pub fn bend_twist(&self, i: usize, frames: &Frames<D>) -> BendTwist<D> {
        self.joint[i].at([frames.edges[i], frames.edges[i + 1]], frames.twist[i])
    }

    /// The same with the springs of internal friction that act there.
    fn element(&self, i: usize, q: &[D], frames: &Frames<D>) -> BendTwist<D> {
        let element = self.bend_twist(i, frames);
        let Some((springs, (elastic, from))) = self.spring(i) else { return element };
        let strains = element.strains(around(q, i));
        let both = (&self.joint[i], elastic);
        let JointLaw { stiffness, natural } =
            springs.sliders.joint(i, both, strains, add(strains, *from));
        BendTwist { stiffness, natural, ..element }
    }

    /// What it is made of.
    fn elements(&self) -> Elements<'_, D> {
        let Self { stretch, joint, load, sliders, .. } = self;
        let springs = sliders.as_ref().filter(|springs| !springs.acting.is_empty());
        Elements { stretch, joint, load, springs, tensions: None }
    }

    /// The spring of joint `i`, if one acts.
    #[inline(always)]
    fn spring(&self, i: usize) -> Option<ActingSpring<'_, D>> {
        let springs = self.sliders.as_ref()?;
        Some((springs, springs.acting.get(i)?))
    }

    /// Shows all derivatives by num-dual.
    fn each_edge_in_duals(
        &self,
        q: &[D],
        frames: &Frames<D>,
        tensions: Option<&[D]>,
        to: &mut impl TakesEdges<D>,
    ) {
        // Where the unknowns of the edges stand among those of an inner node, and their signs.
        const FIRST: [(usize, f64); 4] = [(0, -1.0), (1, -1.0), (2, -1.0), (3, 1.0)];
        const SECOND: [(usize, f64); 4] = [(8, 1.0), (9, 1.0), (10, 1.0), (7, 1.0)];
        let zero = D::from(0.0);
        let pick =
            |local: &Local<D, WINDOW>, rows: [(usize, f64); 4], columns: [(usize, f64); 4]| {
                let mut block = [[zero; 4]; 4];
                for (row, (r, a)) in block.iter_mut().zip(rows) {
                    for (to, (c, b)) in row.iter_mut().zip(columns) {
                        *to = local.hessian[r][c] * (a * b);
                    }
                }
                block
            };
        let mut open = ([zero; 4], [[zero; 4]; 4]);
        for (i, element) in self.stretch.iter().enumerate() {
            let stretch = dual_tangent(element, &ends(q, i));
            let (mut gradient, mut own) = open;
            for r in 0..3 {
                gradient[r] += stretch.gradient[3 + r];
                for c in 0..3 {
                    own[r][c] += stretch.hessian[3 + r][3 + c];
                }
            }
            if let Some(tensions) = tensions {
                let gain = element.under(&edge(q, i), tensions[i]);
                (0..3).for_each(|r| (0..3).for_each(|c| own[r][c] += gain[r][c]));
            }
            let mut after = [[zero; 4]; 4];
            if i < self.joint.len() {
                let joint = bend_twist::dual_tangent(&self.element(i, q, frames), around(q, i));
                let first = pick(&joint, FIRST, FIRST);
                for r in 0..4 {
                    gradient[r] += joint.gradient[FIRST[r].0] * FIRST[r].1;
                    for c in 0..4 {
                        own[r][c] += first[r][c];
                    }
                }
                after = pick(&joint, SECOND, FIRST);
                let second = each(&SECOND, |(r, sign)| joint.gradient[r] * sign);
                open = (second, pick(&joint, SECOND, SECOND));
            }
            let three = |r: usize| [own[r][0], own[r][1], own[r][2]];
            let (vector, angle_vector) = ([three(0), three(1), three(2)], three(3));
            to.edges(i, &ByEdge { gradient, vector, angle_vector, angle: own[3][3] }, &after);
        }
    }

    fn subtract_loads(&self, gradient: &mut [D]) {
        for (i, load) in self.load.iter().enumerate() {
            add_at(gradient, i, &each(&load.force, |f| -f));
        }
    }
}

impl<D: Nestable> Rod<D> for SpatialRod<D> {
    type Tangent = BandMatrix<D, HALF_BANDWIDTH>;
    type Dual = SpatialRod<Dual64>;
    type Frames = Frames<D>;
    type Geometry = Geometry;

    const HAS_FRAMES: bool = true;

    fn is_angle(i: usize) -> bool {
        i % STRIDE == 3
    }

    fn mass(&self) -> &[D] {
        &self.mass
    }

    fn gradient(&self, q: &[D], frames: &Frames<D>, derivatives: Derivatives, gradient: &mut [D]) {
        if D::PLAIN && derivatives == Derivatives::Dual {
            gradient.fill(D::from(0.0));
            self.subtract_loads(gradient);
            for (i, element) in self.stretch.iter().enumerate() {
                let local = dual_gradient(element, &ends(q, i));
                for r in 0..6 {
                    gradient[STRIDE * i + ENDS[r]] += local[r];
                }
            }
            for i in 0..self.joint.len() {
                let local = bend_twist::dual_gradient(&self.element(i, q, frames), around(q, i));
                for (to, from) in gradient[STRIDE * i..].iter_mut().zip(&local) {
                    *to += *from;
                }
            }
        } else {
            D::side_by_side(Gradient { at: (self.elements(), q, frames), gradient });
        }
        self.own.add_gradient(q, &frames.edges, derivatives, gradient);
    }

    fn tangent(
        &self,
        q: &[D],
        frames: &Frames<D>,
        derivatives: Derivatives,
        gradient: &mut [D],
        tangent: &mut BandMatrix<D, HALF_BANDWIDTH>,
    ) {
        self.tangent_under(q, frames, derivatives, None, (gradient, tangent));
    }

    fn tangent_under(
        &self,
        q: &[D],
        frames: &Frames<D>,
        derivatives: Derivatives,
        tensions: Option<&[D]>,
        (gradient, tangent): (&mut [D], &mut BandMatrix<D, HALF_BANDWIDTH>),
    ) {
        if D::PLAIN && derivatives == Derivatives::Dual {
            let mut nodes = ToNodes::<D, D>::new((), &self.load, gradient, tangent);
            self.each_edge_in_duals(q, frames, tensions, &mut nodes);
            nodes.end();
        } else {
            let elements = Elements { tensions, ..self.elements() };
            let (at, gradient, tangent) = ((elements, q, frames), &mut *gradient, &mut *tangent);
            D::side_by_side(TangentSweep { at, gradient, tangent, geometry: None });
        }
        self.own.add_tangent(q, &frames.edges, derivatives, gradient, tangent);
    }

    fn tensions_after(&self, change: &[D], q: &[D], tensions: &mut Vec<D>) {
        tensions.clear();
        let edge = |[x0, y0, z0, x1, y1, z1]: [D; 6]| [x1 - x0, y1 - y0, z1 - z0];
        for (i, stretch) in self.stretch.iter().enumerate() {
            let now = edge(ends(q, i));
            tensions.push(stretch.tension_after(&sub(now, edge(ends(change, i))), &now));
        }
    }

    fn measure(&self, q: &[D], frames: &Frames<D>, geometry: &mut Geometry) {
        D::side_by_side(Measured { at: (self.elements(), q, frames), geometry });
    }

    fn measured_tangent(
        &self,
        q: &[D],
        frames: &Frames<D>,
        derivatives: Derivatives,
        (gradient, tangent): (&mut [D], &mut BandMatrix<D, HALF_BANDWIDTH>),
        geometry: &mut Geometry,
    ) {
        if !D::PLAIN || derivatives == Derivatives::Dual {
            self.tangent(q, frames, derivatives, gradient, tangent);
            if D::PLAIN {
                self.measure(q, frames, geometry);
            }
            return;
        }
        let (at, forces, stiffness) = ((self.elements(), q, frames), &mut *gradient, &mut *tangent);
        let geometry = Some(geometry);
        D::side_by_side(TangentSweep { at, gradient: forces, tangent: stiffness, geometry });
        self.own.add_tangent(q, &frames.edges, derivatives, gradient, tangent);
    }

    fn edge_tangent(
        &self,
        q: &[D],
        frames: &Frames<D>,
        derivatives: Derivatives,
        tangent: &mut BandMatrix<D, HALF_BANDWIDTH>,
    ) {
        tangent.clear();
        let mut edges = ToEdges { tangent, last: self.joint.len() };
        if D::PLAIN && derivatives == Derivatives::Dual {
            self.each_edge_in_duals(q, frames, None, &mut edges);
        } else {
            D::side_by_side(EdgeTangent { at: (self.elements(), q, frames), edges });
        }
    }

    fn rebase(frames: &mut Frames<D>, q: &[D]) {
        D::side_by_side(Rebase { q, frames });
    }

    /// One sweep: every edge's frame is moved, and is its own reference.
    fn moved_gradient(
        &self,
        q: &[D],
        frames: &mut Frames<D>,
        derivatives: Derivatives,
        gradient: &mut [D],
    ) {
        if derivatives == Derivatives::Dual {
            Self::rebase(frames, q);
            return self.gradient(q, frames, derivatives, gradient);
        }
        D::side_by_side(MovedGradient { elements: self.elements(), q, frames, gradient });
        self.own.add_gradient(q, &frames.edges, derivatives, gradient);
    }

    fn real_frames(dual: &Frames<Dual64>, frames: &mut Frames<D>) {
        let real = |v: Vector<Dual64>| v.map(|c| D::from(c.re));
        for (to, from) in frames.edges.iter_mut().zip(&dual.edges) {
            *to = EdgeFrame { tangent: real(from.tangent), director: real(from.director) };
        }
        for (to, from) in frames.twist.iter_mut().zip(&dual.twist) {
            *to = D::from(from.re);
        }
    }

    fn refer(q: &mut [D], from: &Frames<D>, to: &Frames<D>) {
        let count = from.edges.len();
        let tangents: Vec<Vector<D>> = (0..count).map(|j| unit(edge(q, j))).collect();
        let mut before: Option<(D, D)> = None;
        for (j, t) in tangents.iter().enumerate() {
            let theta = STRIDE * j + 3;
            let old = q[theta];
            let [director, _] = from.edges[j].material(*t, old);
            let [d1, d2] = to.edges[j].material(*t, D::from(0.0));
            let angle = dot(director, d2).atan2(dot(director, d1));
            // Whole turns: the first edge's as they were, the others' so that twist stays.
            let expected = match before {
                None => old,
                Some((old_left, new_left)) => {
                    let twist = |frames: &Frames<D>| {
                        let ends = [frames.edges[j - 1].tangent, frames.edges[j].tangent];
                        frames.twist[j - 1] - transported_twist(ends, [tangents[j - 1], *t])
                    };
                    old - old_left + twist(from) - twist(to) + new_left
                }
            };
            let turns = ((expected - angle).value() / TAU).round();
            let new = angle + turns * TAU;
            before = Some((old, new));
            q[theta] = new;
        }
    }

    fn director(q: &[D], frames: &Frames<D>, j: usize) -> Option<[D; 3]> {
        Some(frames.edges[j].material(unit(edge(q, j)), q[STRIDE * j + 3])[0])
    }

    fn untwist(q: &mut [D], frames: &Frames<D>) {
        for (j, twist) in frames.twist.iter().enumerate() {
            q[STRIDE * (j + 1) + 3] = q[STRIDE * j + 3] - *twist;
        }
    }

    fn align(q: &mut [D], frames: &Frames<D>, j: usize, director: [D; 3], turn: f64) {
        let [d1, d2] = frames.edges[j].material(unit(edge(q, j)), D::from(0.0));
        let angle = dot(director, d2).atan2(dot(director, d1));
        let theta = &mut q[STRIDE * j + 3];
        let turns = ((*theta + turn - angle).value() / TAU).round();
        *theta = angle + turns * TAU;
    }

    fn folded(&self, before: &[D], now: &[D], frames: &Frames<D>) -> Option<usize> {
        let struck = |i: usize| {
            dot(edge(now, i), edge(now, i + 1)).value() < 0.0 && {
                let joint = self.bend_twist(i, frames);
                let curvature = |q: &[D]| joint.strains(around(q, i)).map(|k| k.value());
                let ([a1, a2, _], [b1, b2, _]) = (curvature(before), curvature(now));
                half_a_turn_apart(a1 * b1 + a2 * b2)
            }
        };
        (0..self.joint.len()).find(|i| struck(*i)).map(|i| i + 1)
    }

    fn leapt(&self, before: &[D], now: &[D]) -> Option<usize> {
        (0..self.stretch.len()).find(|i| turned_far(edge(before, *i), edge(now, *i)))
    }

    fn not_finite(&self, q: &[D], frames: &Frames<D>) -> Option<(String, f64)> {
        self.own.not_finite(q, &frames.edges)
    }

    fn energies(&self, q: &[D], frames: &Frames<D>) -> Energies {
        let mut sum = D::side_by_side(Elastic { at: (self.elements(), q, frames) });
        for (i, load) in self.load.iter().enumerate() {
            sum.potential += load.energy(&position(q, i)).value();
        }
        sum.own = self.own.energy(q, &frames.edges);
        sum
    }

    fn strains(&self, q: &[D], frames: &Frames<D>, strains: &mut Vec<D>) {
        let (edges, joints) = (self.stretch.len(), self.joint.len());
        strains.resize(edges + 3 * joints, D::from(0.0));
        let (axial, bent) = strains.split_at_mut(edges);
        let joints = bent.as_chunks_mut::<3>().0;
        D::side_by_side(Strains { at: (self.elements(), q, frames), edges: axial, joints });
    }

    fn dashpots(&self) -> Self {
        let mut rod = self.clone();
        let zero = D::from(0.0);
        rod.stretch.iter_mut().for_each(|e| e.natural_strain = zero);
        rod.joint.iter_mut().for_each(|joint| joint.natural = [zero; 3]);
        rod.load.iter_mut().for_each(|load| load.force = [zero; 3]);
        rod.own = Extra::default();
        rod
    }

    /// What couples bending and twisting counts half for each.
    fn strain_energies(&self, strains: &[D]) -> [D; 3] {
        let (stretch, joints) = strains.split_at(self.stretch.len());
        let mut energies = [D::from(0.0); 3];
        for (e, s) in self.stretch.iter().zip(stretch) {
            energies[0] += e.stiffness * e.rest_length * *s * *s * 0.5;
        }
        for (joint, s) in self.joint.iter().zip(joints.as_chunks::<3>().0) {
            let stress = joint.stiffness.times(s);
            energies[1] += (stress[0] * s[0] + stress[1] * s[1]) * 0.5;
            energies[2] += stress[2] * s[2] * 0.5;
        }
        energies
    }

    fn set_viscous(&mut self, elastic: &Self, viscosity: &Viscosity<D>) {
        let (edges, stretch) = (elastic.stretch.len(), viscosity.factor(0));
        for (i, (to, from)) in self.stretch.iter_mut().zip(&elastic.stretch).enumerate() {
            *to = from.viscous(stretch, viscosity.shift(0, i));
        }
        let own = viscosity.own.as_ref();
        let own = own.map(|own| (own, own.past[edges..].as_chunks::<3>().0));
        let (shifts, _) = viscosity.shift[edges..].as_chunks::<3>();
        for (i, (to, from)) in self.joint.iter_mut().zip(&elastic.joint).enumerate() {
            *to = match own {
                None => from.viscous(viscosity.factor, &shifts[i]),
                Some((own, past)) => {
                    let ([_, bend, twist], [_, bending, twisting]) = (own.factor, own.time);
                    let [k1, k2, tau] = past[i];
                    let past = [bending * k1, bending * k2, twisting * tau];
                    from.viscous_apart(viscosity.factor, &shifts[i], ([bend, twist], &past))
                }
            };
        }
    }

    fn set_dashpots(&mut self, dashpots: &Self, viscosity: &Viscosity<D>) {
        let [stretch, bend, twist] = [0, 1, 2].map(|kind| viscosity.factor(kind));
        let (stretched, joined) = viscosity.shift.split_at(dashpots.stretch.len());
        for ((to, from), strain) in self.stretch.iter_mut().zip(&dashpots.stretch).zip(stretched) {
            (to.stiffness, to.natural_strain) = (from.stiffness * stretch, *strain);
        }
        let joints = self.joint.iter_mut().zip(&dashpots.joint).zip(joined.as_chunks::<3>().0);
        for ((to, from), strains) in joints {
            to.stiffness = from.stiffness.by_kind(viscosity.factor, [bend, twist]);
            to.natural = *strains;
        }
    }

    fn slides(&self) -> usize {
        if self.sliders.is_some() { 3 * self.joint.len() } else { 0 }
    }

    fn set_springs(&mut self, elastic: &Self, before: Option<&InternalVariables<D>>) {
        let Some(springs) = &mut self.sliders else { return };
        springs.acting.clear();
        let Some(InternalVariables { strain, slid, .. }) = before else { return };
        let strains = strain[elastic.stretch.len()..].as_chunks::<3>().0;
        let starts = strains.iter().zip(slid.as_chunks::<3>().0);
        let spring = |(joint, (strain, slid)): (&JointLaw<D>, (&[D; 3], &[D; 3]))| {
            (joint.stiffness, sub(*slid, *strain))
        };
        springs.acting.extend(elastic.joint.iter().zip(starts).map(spring));
    }

    fn slip(&self, z: &mut [D]) {
        let Some(springs) = &self.sliders else { return };
        for (i, z) in z.as_chunks_mut::<3>().0.iter_mut().enumerate() {
            *z = springs.sliders.slid_in_space(i, &self.joint[i].stiffness, *z);
        }
    }

    fn distance_to_slipping(&self, z: &[D]) -> f64 {
        let Some(springs) = &self.sliders else { return f64::INFINITY };
        let of = |(i, z): (usize, &[D; 3])| {
            springs.sliders.from_limit_in_space(i, &self.joint[i].stiffness, *z)
        };
        z.as_chunks::<3>().0.iter().enumerate().map(of).fold(f64::INFINITY, f64::min)
    }

    fn slider_energy(&self, z: &[D]) -> f64 {
        let Some(Springs { sliders, .. }) = &self.sliders else { return 0.0 };
        let (z, _) = z.as_chunks::<3>();
        let energy =
            |(z, joint): (&[D; 3], &JointLaw<D>)| sliders.energy(&joint.stiffness, *z).value();
        z.iter().zip(&self.joint).map(energy).sum()
    }
}
