//! How the forces of a planar rod change with parameters.

use crate::energy::friction::SliderRates;
use crate::energy::{DeadMoment, Derivatives, Element, dual_gradient_rate};
use crate::numerics::banded::BandMatrix;
use crate::numerics::lanes::{Lanes, all, dot};
use crate::rod::planar::geometry::{Geometry, Straight};
use crate::rod::planar::{HALF_BANDWIDTH, PlanarRod, unknowns};
use crate::rod::sensitive::{Counted, FrameRate, Sensitive};
use num_dual::Dual64;

/// How a stress changes: by the strain, and without.
pub(super) type Law<const G: usize> = [Lanes<G>; 2];

/// What parameters change of a planar rod.
#[derive(Clone, Debug, Default)]
pub struct Rates<const G: usize> {
    /// Whether anything elastic.
    elastic: bool,
    pub(super) stretch: Vec<Law<G>>,
    /// Rest lengths, over themselves.
    pub(super) rest: Vec<Lanes<G>>,
    pub(super) bend: Vec<Law<G>>,
    pub(super) load: Vec<[Lanes<G>; 2]>,
    sliders: Option<SliderRates<G>>,
}

/// Writes a gradient by nodes from that by edges, one after the other.
struct Nodes<'a, const G: usize> {
    /// Of every node, or none.
    load: &'a [[Lanes<G>; 2]],
    out: &'a mut [[[f64; G]; 2]],
    /// By the edge before.
    carried: [Lanes<G>; 2],
}

impl<const G: usize> Nodes<'_, G> {
    #[inline(always)]
    fn edge(&mut self, i: usize, force: [Lanes<G>; 2]) {
        let load = self.load.get(i).unwrap_or(&[Lanes::ZERO; 2]);
        for c in 0..2 {
            self.out[i][c] = (self.carried[c] - force[c] - load[c]).0;
        }
        self.carried = force;
    }
}

#[inline(always)]
fn stress<const G: usize>([slope, offset]: &Law<G>, strain: f64) -> Lanes<G> {
    *slope * strain + *offset
}

/// Writes the derivatives of the gradient at fixed unknowns from those of the axial forces, by the strain of an edge,
/// and of the stresses, by the curvature of a joint.
#[inline(always)]
fn pull<const G: usize>(
    geometry: &Geometry,
    axial: impl Fn(usize, f64) -> Lanes<G>,
    stress: impl Fn(usize, f64) -> Lanes<G>,
    load: &[[Lanes<G>; 2]],
    out: &mut [[f64; G]],
) {
    let out = out.as_chunks_mut::<2>().0;
    let mut nodes = Nodes { load, out, carried: [Lanes::ZERO; 2] };
    let mut before = Lanes::ZERO;
    let by_edge = |i: usize, moment: Lanes<G>| -> [Lanes<G>; 2] {
        let Straight { tangent: [t0, t1], normal: [n0, n1], strain } = geometry.edges[i];
        let axial = axial(i, strain);
        [axial * t0 + moment * n0, axial * t1 + moment * n1]
    };
    for (i, [curvature, slope]) in geometry.joints.iter().enumerate() {
        let moment = stress(i, *curvature) * *slope;
        nodes.edge(i, by_edge(i, before - moment));
        before = moment;
    }
    let i = geometry.joints.len();
    nodes.edge(i, by_edge(i, before));
    nodes.edge(i + 1, [Lanes::ZERO; 2]);
}

/// What dead moments and energies of one's own change.
fn add_others<const G: usize>(
    duals: &[PlanarRod<Dual64>; G],
    q: &[f64],
    derivatives: Derivatives,
    out: &mut [[f64; G]],
) {
    for (g, dual) in duals.iter().enumerate() {
        let mut add = |first: usize, local: &[f64]| {
            out[first..].iter_mut().zip(local).for_each(|(out, local)| out[g] += local);
        };
        for (i, DeadMoment { moment, .. }) in &dual.moment {
            let rate = DeadMoment { moment: moment.eps, rest: [0.0; 2] };
            add(2 * i, &rate.gradient(unknowns(q, *i)));
        }
        dual.own.add_gradient_rate(q, &[], derivatives, add);
    }
}

impl Sensitive for PlanarRod<f64> {
    type Rates<const G: usize> = Rates<G>;

    fn set_rates<const G: usize>(duals: &[PlanarRod<Dual64>; G], rates: &mut Rates<G>) {
        let lanes =
            |of: &dyn Fn(&PlanarRod<Dual64>) -> f64| Lanes(std::array::from_fn(|g| of(&duals[g])));
        let Rates { elastic, stretch, rest, bend, load, sliders } = rates;
        let [first, ..] = &duals[..] else { return };
        rest.clear();
        rest.extend(first.stretch.iter().enumerate().map(|(i, law)| {
            lanes(&|rod| rod.stretch[i].rest_length.eps) * law.rest_length.re.recip()
        }));
        let own = all(duals.each_ref().map(|rod| Some(&*rod.sliders.as_ref()?.sliders)));
        *sliders = own.map(SliderRates::of);
        stretch.clear();
        stretch.extend(
            (0..first.stretch.len())
                .map(|i| [0, 1].map(|k| lanes(&|rod| rod.stretch[i].force_rate()[k]))),
        );
        bend.clear();
        bend.extend(
            (0..first.bend.len())
                .map(|i| [0, 1].map(|k| lanes(&|rod| rod.bend[i].stress_rate()[k]))),
        );
        load.clear();
        load.extend(
            (0..first.load.len()).map(|i| [0, 1].map(|c| lanes(&|rod| rod.load[i].force[c].eps))),
        );
        *elastic = stretch.iter().chain(&*bend).any(|law| *law != [Lanes::ZERO; 2]);
    }

    fn gradient_rate<const G: usize>(
        (duals, rates): (&[PlanarRod<Dual64>; G], &Rates<G>),
        geometry: &Geometry,
        (q, ()): (&[f64], &()),
        derivatives: Derivatives,
        out: &mut [[f64; G]],
    ) {
        match derivatives {
            Derivatives::Hand if rates.elastic => {
                let Rates { stretch, bend, load, .. } = rates;
                let axial = |i: usize, strain: f64| stress(&stretch[i], strain);
                pull(geometry, axial, |i, curvature| stress(&bend[i], curvature), load, out);
            }
            _ => {
                for (out, load) in out.as_chunks_mut::<2>().0.iter_mut().zip(&rates.load) {
                    *out = load.map(|load| load.0.map(|load| -load));
                }
            }
        }
        for (g, dual) in duals.iter().enumerate() {
            let mut add = |first: usize, local: &[f64]| {
                out[first..].iter_mut().zip(local).for_each(|(out, local)| out[g] += local);
            };
            if derivatives == Derivatives::Dual {
                for (i, element) in dual.stretch.iter().enumerate() {
                    add(2 * i, &dual_gradient_rate(element, unknowns::<_, 4>(q, i)));
                }
                for (i, element) in dual.bend.iter().enumerate() {
                    add(2 * i, &dual_gradient_rate(element, unknowns::<_, 6>(q, i)));
                }
            }
        }
        add_others(duals, q, derivatives, out);
    }

    fn kind(&self, strain: usize) -> usize {
        usize::from(strain >= self.stretch.len())
    }

    fn rest_strain_rates<const G: usize>(
        rates: &Rates<G>,
        geometry: &Geometry,
        out: &mut [Lanes<G>],
    ) {
        let (edges, joints) = out.split_at_mut(geometry.edges.len());
        for ((out, edge), rest) in edges.iter_mut().zip(&geometry.edges).zip(&rates.rest) {
            *out = *rest * -(1.0 + edge.strain);
        }
        joints.fill(Lanes::ZERO);
    }

    fn add_strain_rates<const G: usize>(
        &self,
        _: &[FrameRate<G>],
        geometry: &Geometry,
        q: &[[f64; G]],
        out: &mut [Lanes<G>],
    ) {
        let (edges, joints) = out.split_at_mut(geometry.edges.len());
        let (q, _) = q.as_chunks::<2>();
        let mut before = Lanes::ZERO;
        for (j, Straight { tangent, normal, .. }) in geometry.edges.iter().enumerate() {
            let e = [0, 1].map(|c| Lanes(q[j + 1][c]) - Lanes(q[j][c]));
            edges[j] += dot(tangent, &e) * self.stretch[j].rest_length.recip();
            let turn = dot(normal, &e);
            if let Some(i) = j.checked_sub(1) {
                joints[i] += (turn - before) * geometry.joints[i][1];
            }
            before = turn;
        }
    }

    fn slip_rates<const G: usize>(&self, rates: &Rates<G>, z: &[f64], out: &mut [Lanes<G>]) {
        let (Some(springs), Some(changes)) = (&self.sliders, &rates.sliders) else { return };
        for (i, (z, out)) in z.iter().zip(out).enumerate() {
            *out = changes.slid(&springs.sliders, i, *z, *out);
        }
    }

    fn stress_rates<const G: usize>(
        &self,
        rates: &Rates<G>,
        counted: &Counted<G>,
        out: &mut [Lanes<G>],
    ) {
        let edges = self.stretch.len();
        let natural = if counted.natural { 1.0 } else { 0.0 };
        for (i, out) in out.iter_mut().enumerate() {
            let (mut s, mut rate) = counted.strains[i];
            if let Some((own, own_rate)) = counted.own.get(i) {
                (s, rate) = (s + own, rate + *own_rate);
            }
            let (stiffness, [slope, offset]) = match i.checked_sub(edges) {
                // Those at fixed unknowns have the change of the strain by the rest length in them.
                None => {
                    let stiffness = self.stretch[i].stiffness;
                    let shorter = rates.rest[i] * stiffness;
                    (stiffness, rates.stretch[i].map(|rate| rate + shorter))
                }
                Some(joint) => (self.bend[joint].stiffness, rates.bend[joint]),
            };
            *out = slope * s + rate * stiffness + offset * natural;
        }
    }

    fn stressed_rate<const G: usize>(
        changed: Option<(&[PlanarRod<Dual64>; G], &Rates<G>)>,
        stress: &[Lanes<G>],
        geometry: &Geometry,
        (q, ()): (&[f64], &()),
        derivatives: Derivatives,
        out: &mut [[f64; G]],
    ) {
        let (axial, joints) = stress.split_at(geometry.edges.len());
        let load = changed.map_or(&[][..], |(_, rates)| &rates.load);
        pull(geometry, |i, _| axial[i], |i, _| joints[i], load, out);
        if let Some((duals, _)) = changed {
            add_others(duals, q, derivatives, out);
        }
    }

    fn frame_rate<const G: usize>(
        _: &[FrameRate<G>],
        _: &Geometry,
        _: &[f64],
        _: &BandMatrix<f64, HALF_BANDWIDTH>,
        _: &mut [[f64; G]],
    ) {
    }

    fn rebase_rates<const G: usize>(_: &mut [FrameRate<G>], _: &Geometry, _: &[[f64; G]]) {}

    fn frame_rates<const G: usize>(_: [&(); G]) -> Vec<FrameRate<G>> {
        Vec::new()
    }

    fn set_dual_frames<const G: usize>(_: &(), _: &[FrameRate<G>], _: usize, (): &mut ()) {}
}
