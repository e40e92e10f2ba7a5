//! Sweeps over the edges of a spatial rod, several side by side.

use crate::energy::Stretch;
use crate::energy::bend_twist::{EdgeState, JointLaw, Stiffness};
use crate::energy::frame::EdgeFrame;
use crate::energy::joint::{Joint, Sum, between};
use crate::numerics::banded::BandMatrix;
use crate::numerics::scalar::{Nestable, Scalar, Sweep, Wide};
use crate::numerics::vector::{Vector, add, sub};
use crate::rod::Energies;
use crate::rod::blocks::{MOST, block, tension, window};
use crate::rod::edges::{HALF_BANDWIDTH, STRIDE, TakesEdges, ToEdges, ToNodes};
use crate::rod::layout::{self, Space};
use crate::rod::spatial::geometry::{Geometry, Measure};

/// The elements of a spatial rod.
pub(super) type Elements<'a, D> = layout::Elements<'a, D, Space, 3, 3>;

/// A spatial rod at its unknowns, with its frames.
pub(super) type At<'a, D> = layout::At<'a, D, Space, 3, 3>;

impl<D: Nestable> Elements<'_, D> {
    /// The stiffness and the stresses of joint `i` at its strains.
    pub(super) fn response(&self, i: usize, strains: &[D; 3]) -> (Stiffness<D>, [D; 3]) {
        let law = &self.joint[i];
        match self.springs.and_then(|springs| Some((springs, springs.acting.get(i)?))) {
            None => (law.stiffness, law.stiffness.times(&sub(*strains, law.natural))),
            Some((springs, (elastic, from))) => {
                springs.sliders.response(i, (law, elastic), *strains, add(*strains, *from))
            }
        }
    }
}

/// Edges as they are, with their angles and their references.
#[derive(Clone, Copy)]
struct Edges<V> {
    state: EdgeState<V>,
    angle: V,
    frame: EdgeFrame<V>,
}

/// Edges side by side, those next to them, and the joints between. The joint after the last edge is none: it has neither
/// stiffness nor stress; what lies beyond has no meaning.
pub(super) struct Pairs<V> {
    /// The number of the first edge.
    pub first: usize,
    pub e: EdgeState<V>,
    pub f: EdgeState<V>,
    pub law: JointLaw<V>,
    pub bent: Joint<V>,
}

/// A rod at `q` and what its elements are side by side.
pub(super) struct Along<'a, D: Scalar, V: Wide<D>> {
    elements: Elements<'a, D>,
    q: &'a [D],
    frames: &'a [EdgeFrame<D>],
    twist: &'a [D],
    level: V::Level,
    /// The edges from here on come next.
    first: usize,
    edges: Edges<V>,
}

impl<'a, D: Nestable, V: Wide<D>> Along<'a, D, V> {
    #[inline(always)]
    pub fn new(At { elements, q, frames }: At<'a, D>, level: V::Level) -> Self {
        let (frames, twist) = (&frames.edges[..], &frames.twist[..]);
        let edges = edges_at(q, frames, level, 0);
        Self { elements, q, frames, twist, level, first: 0, edges }
    }

    /// The next ones.
    #[inline(always)]
    pub fn next(&mut self) -> Option<Pairs<V>> {
        let (first, edges) = (self.first, self.edges);
        if first >= self.elements.stretch.len() {
            return None;
        }
        self.first += V::LANES;
        if self.first < self.elements.stretch.len() {
            self.edges = edges_at(self.q, self.frames, self.level, self.first);
        }
        let (e, f) = (edges.state, edges.state.after::<D>(&self.edges.state));
        let turn = edges.angle.after(self.edges.angle) - edges.angle;
        let frames = [edges.frame, edges.frame.after::<D>(&self.edges.frame)];
        let mut room = None;
        let twist = block::<D, V, _>(self.twist, first, D::from(0.0), &mut room);
        let law: JointLaw<V> = joints(self.elements.joint, self.level, first);
        let joint = law.at(frames, V::gather(self.level, |lane| twist[lane]));
        let bent = joint.joint(&e, &f, turn);
        Some(Pairs { first, e, f, law, bent })
    }

    /// How edges stretch.
    #[inline(always)]
    pub fn stretches(&self, first: usize) -> Stretch<V, 3> {
        stretches(self.elements.stretch, self.level, first)
    }

    /// The stiffness of joints and their stresses.
    #[inline(always)]
    pub fn response(&self, Pairs { first, law, bent, .. }: &Pairs<V>) -> (Stiffness<V>, [V; 3]) {
        if self.elements.springs.is_none() {
            return (law.stiffness, law.stiffness.times(&sub(bent.strains, law.natural)));
        }
        let none = JointLaw::<D>::none();
        let mut all = [(none.stiffness, none.natural); MOST];
        let joints = self.elements.joint.len().saturating_sub(*first);
        for (lane, own) in all.iter_mut().enumerate().take(V::LANES.min(joints)) {
            *own = self.elements.response(first + lane, &V::lane_of(&bent.strains, lane));
        }
        let stress = [
            V::gather(self.level, |lane| all[lane].1[0]),
            V::gather(self.level, |lane| all[lane].1[1]),
            V::gather(self.level, |lane| all[lane].1[2]),
        ];
        (Stiffness::side_by_side(self.level, &all, |own| &own.0), stress)
    }

    /// Shows all derivatives by the hand-derived formulas.
    #[inline(always)]
    fn derive(mut self, to: &mut impl TakesEdges<V>, mut measure: Option<Measure<'_, D>>) {
        let zero = V::gather(self.level, |_| D::from(0.0));
        let mut open = Sum { gradient: [zero; 3], hessian: [zero; 6] };
        while let Some(pairs) = self.next() {
            let Pairs { first, e, f, bent, .. } = &pairs;
            if let Some(measure) = &mut measure {
                measure.see(self.level, *first, e, (bent, f));
            }
            let (stiffness, stress) = self.response(&pairs);
            let tangent = bent.tangent(&e.edge, &f.edge, &stiffness, &stress);
            let [force, along] = self.stretches(*first).tension(e.squared, e.length);
            let sum = tangent.f.before::<D>(&open).plus(&tangent.e);
            let tension = tension(self.elements.tensions, self.level, *first, force);
            let own = e.derivatives(&sum, [force, tension], along);
            to.edges(*first, &own, &between(e, f, tangent.fe));
            open = tangent.f;
        }
    }
}

/// The joints after the edges from `first` on.
#[inline(always)]
pub(super) fn joints<D: Nestable, V: Wide<D>>(
    all: &[JointLaw<D>],
    level: V::Level,
    first: usize,
) -> JointLaw<V> {
    let mut room = None;
    JointLaw::side_by_side(level, block::<D, V, _>(all, first, JointLaw::none(), &mut room))
}

/// How the edges from `first` on stretch.
#[inline(always)]
pub(super) fn stretches<D: Nestable, V: Wide<D>>(
    all: &[Stretch<D, 3>],
    level: V::Level,
    first: usize,
) -> Stretch<V, 3> {
    let mut room = None;
    Stretch::side_by_side(level, block::<D, V, _>(all, first, Stretch::none(), &mut room))
}

/// The vectors of edges from `first` on, and their angles.
#[inline(always)]
pub(super) fn vectors_at<D: Nestable, V: Wide<D>>(
    q: &[D],
    level: V::Level,
    first: usize,
) -> (Vector<V>, V) {
    let mut room = None;
    let q = window(q, first, STRIDE, STRIDE * V::LANES + 3, &mut room);
    let start = [
        V::gather(level, |lane| q[STRIDE * lane]),
        V::gather(level, |lane| q[STRIDE * lane + 1]),
        V::gather(level, |lane| q[STRIDE * lane + 2]),
    ];
    let end = [
        V::gather(level, |lane| q[STRIDE * lane + 4]),
        V::gather(level, |lane| q[STRIDE * lane + 5]),
        V::gather(level, |lane| q[STRIDE * lane + 6]),
    ];
    (sub(end, start), V::gather(level, |lane| q[STRIDE * lane + 3]))
}

/// The frames of edges from `first` on.
#[inline(always)]
pub(super) fn frames_at<D: Nestable, V: Wide<D>>(
    frames: &[EdgeFrame<D>],
    level: V::Level,
    first: usize,
) -> EdgeFrame<V> {
    let mut room = None;
    let beyond = frames[frames.len() - 1];
    EdgeFrame::side_by_side(level, block::<D, V, _>(frames, first, beyond, &mut room))
}

/// The edges from `first` on.
#[inline(always)]
fn edges_at<D: Nestable, V: Wide<D>>(
    q: &[D],
    frames: &[EdgeFrame<D>],
    level: V::Level,
    first: usize,
) -> Edges<V> {
    let frame = frames_at(frames, level, first);
    let (e, angle) = vectors_at(q, level, first);
    Edges { state: EdgeState::new(&frame, e, angle), angle, frame }
}

/// Writes gradient and tangent, and measures the rod if that is asked for.
pub(super) struct TangentSweep<'a, D: Scalar> {
    pub at: At<'a, D>,
    pub gradient: &'a mut [D],
    pub tangent: &'a mut BandMatrix<D, HALF_BANDWIDTH>,
    pub geometry: Option<&'a mut Geometry>,
}

impl<D: Nestable> Sweep<D> for TangentSweep<'_, D> {
    type Output = ();

    #[inline(always)]
    fn sweep<V: Wide<D>>(self, level: V::Level) {
        let At { elements, frames, .. } = self.at;
        let mut nodes = ToNodes::<D, V>::new(level, elements.load, self.gradient, self.tangent);
        let measure =
            self.geometry.map(|geometry| Measure::new(elements.stretch, frames, geometry));
        Along::<D, V>::new(self.at, level).derive(&mut nodes, measure);
        nodes.end();
    }
}

/// Adds the tangent by edges.
pub(super) struct EdgeTangent<'a, D: Scalar> {
    pub at: At<'a, D>,
    pub edges: ToEdges<'a, D>,
}

impl<D: Nestable> Sweep<D> for EdgeTangent<'_, D> {
    type Output = ();

    #[inline(always)]
    fn sweep<V: Wide<D>>(mut self, level: V::Level) {
        Along::<D, V>::new(self.at, level).derive(&mut self.edges, None);
    }
}

/// Measures edges and joints alone.
pub(super) struct Measured<'a, D: Scalar> {
    pub at: At<'a, D>,
    pub geometry: &'a mut Geometry,
}

impl<D: Nestable> Sweep<D> for Measured<'_, D> {
    type Output = ();

    #[inline(always)]
    fn sweep<V: Wide<D>>(self, level: V::Level) {
        let At { elements, frames, .. } = self.at;
        let mut measure = Measure::new(elements.stretch, frames, self.geometry);
        let mut along = Along::<D, V>::new(self.at, level);
        while let Some(Pairs { first, e, f, bent, .. }) = along.next() {
            measure.see(level, first, &e, (&bent, &f));
        }
    }
}

/// Adds up the elastic energies, without those of springs.
pub(super) struct Elastic<'a, D: Scalar> {
    pub at: At<'a, D>,
}

impl<D: Nestable> Sweep<D> for Elastic<'_, D> {
    type Output = Energies;

    #[inline(always)]
    fn sweep<V: Wide<D>>(self, level: V::Level) -> Energies {
        let (mut sums, edges) = (Energies::default(), self.at.elements.stretch.len());
        let mut along = Along::<D, V>::new(self.at, level);
        while let Some(Pairs { first, e, law, bent, .. }) = along.next() {
            let [bend, twist] = law.energies_of(&bent.strains);
            let stretch = along.stretches(first).energy_at(e.squared, e.length);
            for lane in 0..V::LANES.min(edges - first) {
                sums.stretch += stretch.lane(lane).value();
                sums.bend += bend.lane(lane).value();
                sums.twist += twist.lane(lane).value();
            }
        }
        sums
    }
}

/// Writes the strains of edges and of joints.
pub(super) struct Strains<'a, D: Scalar> {
    pub at: At<'a, D>,
    pub edges: &'a mut [D],
    pub joints: &'a mut [[D; 3]],
}

impl<D: Nestable> Sweep<D> for Strains<'_, D> {
    type Output = ();

    #[inline(always)]
    fn sweep<V: Wide<D>>(self, level: V::Level) {
        let mut along = Along::<D, V>::new(self.at, level);
        while let Some(Pairs { first, e, bent, .. }) = along.next() {
            let strain = along.stretches(first).strain_of(e.squared, e.length);
            for (lane, to) in self.edges[first..].iter_mut().take(V::LANES).enumerate() {
                *to = strain.lane(lane);
            }
            for (lane, to) in self.joints[first..].iter_mut().take(V::LANES).enumerate() {
                *to = V::lane_of(&bent.strains, lane);
            }
        }
    }
}
