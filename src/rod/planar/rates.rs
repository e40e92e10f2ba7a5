//! How the forces of a planar rod change with parameters.

use crate::energy::{DeadMoment, Derivatives, Element, dual_gradient_rate};
use crate::numerics::banded::BandMatrix;
use crate::numerics::lanes::Lanes;
use crate::rod::planar::geometry::{Geometry, Straight};
use crate::rod::planar::{HALF_BANDWIDTH, PlanarRod, unknowns};
use crate::rod::sensitive::{FrameRate, Sensitive};
use num_dual::Dual64;

/// How a stress changes: by the strain, and without.
type Law<const G: usize> = [Lanes<G>; 2];

/// What parameters change of a planar rod.
#[derive(Clone, Debug, Default)]
pub struct Rates<const G: usize> {
    /// Whether anything elastic.
    elastic: bool,
    stretch: Vec<Law<G>>,
    bend: Vec<Law<G>>,
    load: Vec<[Lanes<G>; 2]>,
}

/// Writes a gradient by nodes from that by edges, one after the other.
struct Nodes<'a, const G: usize> {
    load: &'a [[Lanes<G>; 2]],
    out: &'a mut [[[f64; G]; 2]],
    /// By the edge before.
    carried: [Lanes<G>; 2],
}

impl<const G: usize> Nodes<'_, G> {
    #[inline(always)]
    fn edge(&mut self, i: usize, force: [Lanes<G>; 2]) {
        for c in 0..2 {
            self.out[i][c] = (self.carried[c] - force[c] - self.load[i][c]).0;
        }
        self.carried = force;
    }
}

#[inline(always)]
fn stress<const G: usize>([slope, offset]: &Law<G>, strain: f64) -> Lanes<G> {
    *slope * strain + *offset
}

fn hand_rate<const G: usize>(rates: &Rates<G>, geometry: &Geometry, out: &mut [[f64; G]]) {
    let Rates { stretch, bend, load, .. } = rates;
    let out = out.as_chunks_mut::<2>().0;
    let mut nodes = Nodes { load, out, carried: [Lanes::ZERO; 2] };
    let mut before = Lanes::ZERO;
    let by_edge = |edge: &Straight, law: &Law<G>, moment: Lanes<G>| -> [Lanes<G>; 2] {
        let axial = stress(law, edge.strain);
        let ([t0, t1], [n0, n1]) = (edge.tangent, edge.normal);
        [axial * t0 + moment * n0, axial * t1 + moment * n1]
    };
    let joints = geometry.joints.iter().zip(bend);
    for (i, (([curvature, slope], law), (edge, axial))) in
        joints.zip(geometry.edges.iter().zip(stretch)).enumerate()
    {
        let moment = stress(law, *curvature) * *slope;
        nodes.edge(i, by_edge(edge, axial, before - moment));
        before = moment;
    }
    let i = geometry.joints.len();
    nodes.edge(i, by_edge(&geometry.edges[i], &stretch[i], before));
    nodes.edge(i + 1, [Lanes::ZERO; 2]);
}

impl Sensitive<HALF_BANDWIDTH> for PlanarRod<f64> {
    type Rates<const G: usize> = Rates<G>;

    fn set_rates<const G: usize>(duals: &[PlanarRod<Dual64>; G], rates: &mut Rates<G>) {
        let lanes =
            |of: &dyn Fn(&PlanarRod<Dual64>) -> f64| Lanes(std::array::from_fn(|g| of(&duals[g])));
        let Rates { elastic, stretch, bend, load } = rates;
        let [first, ..] = &duals[..] else { return };
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
            Derivatives::Hand if rates.elastic => hand_rate(rates, geometry, out),
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
            for (i, DeadMoment { moment, .. }) in &dual.moment {
                let rate = DeadMoment { moment: moment.eps, rest: [0.0; 2] };
                add(2 * i, &rate.gradient(unknowns(q, *i)));
            }
            dual.own.add_gradient_rate(q, &[], derivatives, add);
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
