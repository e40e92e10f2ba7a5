//! How the forces of a rod change with parameters.

use crate::energy::Derivatives;
use crate::energy::friction::SliderRates;
use crate::numerics::lanes::{Lanes, all};
use crate::numerics::vector::components;
use crate::rod::discrete::DiscreteRod;
use crate::rod::layout::{JointRate, Layout};
use crate::rod::sensitive::{Counted, FrameRate, Sensitive};
use num_dual::Dual64;

/// Derivatives of the laws and loads of a rod along `G` parameters.
#[derive(Clone, Debug)]
pub struct Rates<L: Layout<N, S>, const N: usize, const S: usize, const G: usize> {
    /// Whether anything elastic changes.
    elastic: bool,
    /// Axial forces: by the strain, and without.
    pub(super) stretch: Vec<[Lanes<G>; 2]>,
    /// Rest lengths, over themselves.
    pub(super) rest: Vec<Lanes<G>>,
    pub(super) joint: Vec<L::JointRate<G>>,
    pub(super) load: Vec<[Lanes<G>; N]>,
    sliders: Option<SliderRates<G>>,
}

impl<L: Layout<N, S>, const N: usize, const S: usize, const G: usize> Default
    for Rates<L, N, S, G>
{
    fn default() -> Self {
        let (stretch, rest, joint, load) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        Self { elastic: false, stretch, rest, joint, load, sliders: None }
    }
}

/// A rod over dual numbers.
type Dual<L, const N: usize, const S: usize> = DiscreteRod<Dual64, L, N, S>;

/// One number of each of `G` dual rods.
#[inline(always)]
fn lanes<R, const G: usize>(duals: &[R; G], of: impl Fn(&R) -> f64) -> Lanes<G> {
    Lanes(components(|g| of(&duals[g])))
}

/// Adds the derivatives of the forces of moments and of user-defined energies.
fn add_others<L: Layout<N, S>, const N: usize, const S: usize, const G: usize>(
    duals: &[Dual<L, N, S>; G],
    (q, frames): (&[f64], &L::Frames<f64>),
    derivatives: Derivatives,
    out: &mut [[f64; G]],
) {
    for (g, dual) in duals.iter().enumerate() {
        let mut add = |first: usize, local: &[f64]| {
            out[first..].iter_mut().zip(local).for_each(|(out, local)| out[g] += local);
        };
        L::add_moment_rates(&dual.moments, q, &mut add);
        dual.own.add_gradient_rate(q, L::edge_frames(frames), derivatives, add);
    }
}

impl<L: Layout<N, S>, const N: usize, const S: usize> Sensitive for DiscreteRod<f64, L, N, S> {
    type Rates<const G: usize> = Rates<L, N, S, G>;

    fn set_rates<const G: usize>(duals: &[Dual<L, N, S>; G], rates: &mut Self::Rates<G>) {
        let Rates { elastic, stretch, rest, joint, load, sliders } = rates;
        let [first, ..] = &duals[..] else { return };
        stretch.clear();
        stretch.extend(
            (0..first.stretch.len())
                .map(|i| [0, 1].map(|k| lanes(duals, |rod| rod.stretch[i].force_rate()[k]))),
        );
        rest.clear();
        rest.extend(first.stretch.iter().enumerate().map(|(i, law)| {
            lanes(duals, |rod| rod.stretch[i].rest_length.eps) * law.rest_length.re.recip()
        }));
        joint.clear();
        joint.extend(
            (0..first.joint.len())
                .map(|i| L::JointRate::of(duals.each_ref().map(|rod| &rod.joint[i]))),
        );
        load.clear();
        load.extend(
            (0..first.load.len())
                .map(|i| std::array::from_fn(|c| lanes(duals, |rod| rod.load[i].force[c].eps))),
        );
        let own = all(duals.each_ref().map(|rod| Some(&*rod.sliders.as_ref()?.sliders)));
        *sliders = own.map(SliderRates::of);
        *elastic = stretch.iter().any(|law| *law != [Lanes::ZERO; 2])
            || joint.iter().any(|law| !law.is_zero());
    }

    fn gradient_rate<const G: usize>(
        (duals, rates): (&[Dual<L, N, S>; G], &Self::Rates<G>),
        geometry: &L::Geometry,
        at: (&[f64], &L::Frames<f64>),
        derivatives: Derivatives,
        out: &mut [[f64; G]],
    ) {
        let Rates { elastic, stretch, joint, load, .. } = rates;
        if derivatives == Derivatives::Hand && *elastic {
            let axial = |i: usize, strain: f64| stretch[i][0] * strain + stretch[i][1];
            L::pull(geometry, axial, |i, strains| joint[i].stress(strains), |i| load[i], out);
        } else {
            out.fill([0.0; G]);
            for (i, load) in load.iter().enumerate() {
                for c in 0..N {
                    out[L::STRIDE * i + c] = (Lanes::ZERO - load[c]).0;
                }
            }
        }
        if derivatives == Derivatives::Dual {
            for (g, dual) in duals.iter().enumerate() {
                L::add_rates_by_duals(dual.elements(), at.0, at.1, |first, local| {
                    out[first..].iter_mut().zip(local).for_each(|(out, local)| out[g] += local);
                });
            }
        }
        add_others(duals, at, derivatives, out);
    }

    fn kind(&self, strain: usize) -> usize {
        strain.checked_sub(self.stretch.len()).map_or(0, |own| 1 + usize::from(own % S == 2))
    }

    fn rest_strain_rates<const G: usize>(
        rates: &Self::Rates<G>,
        geometry: &L::Geometry,
        out: &mut [Lanes<G>],
    ) {
        let (edges, joints) = out.split_at_mut(rates.rest.len());
        let strains = L::measured_edges(geometry);
        for ((out, strain), rest) in edges.iter_mut().zip(strains).zip(&rates.rest) {
            *out = *rest * -(1.0 + strain);
        }
        joints.fill(Lanes::ZERO);
    }

    fn add_strain_rates<const G: usize>(
        &self,
        frames: &[FrameRate<G>],
        geometry: &L::Geometry,
        q: &[[f64; G]],
        out: &mut [Lanes<G>],
    ) {
        let (edges, joints) = out.split_at_mut(self.stretch.len());
        let joints = joints.as_chunks_mut::<S>().0;
        L::add_strain_rates(&self.stretch, frames, geometry, q, (edges, joints));
    }

    fn slip_rates<const G: usize>(&self, rates: &Self::Rates<G>, z: &[f64], out: &mut [Lanes<G>]) {
        let (Some(springs), Some(changes)) = (&self.sliders, &rates.sliders) else { return };
        let (z, out) = (z.as_chunks::<S>().0, out.as_chunks_mut::<S>().0);
        for (i, (z, out)) in z.iter().zip(out).enumerate() {
            let joint = (&self.joint[i], &rates.joint[i]);
            *out = L::slip_rate(changes, (&springs.sliders, i), joint, *z, *out);
        }
    }

    fn stress_rates<const G: usize>(
        &self,
        rates: &Self::Rates<G>,
        counted: &Counted<G>,
        out: &mut [Lanes<G>],
    ) {
        let edges = self.stretch.len();
        let (axial, joints) = out.split_at_mut(edges);
        let natural = if counted.natural { 1.0 } else { 0.0 };
        for (i, (out, law)) in axial.iter_mut().zip(&self.stretch).enumerate() {
            let (mut s, mut rate) = counted.strains[i];
            if let Some((own, own_rate)) = counted.own.get(i) {
                (s, rate) = (s + own, rate + *own_rate);
            }
            // Those at fixed unknowns have the change of the strain by the rest length in them.
            let shorter = rates.rest[i] * law.stiffness;
            let [slope, offset] = rates.stretch[i];
            *out = (slope + shorter) * s + rate * law.stiffness + (offset + shorter) * natural;
        }
        let strains = counted.strains[edges..].as_chunks::<S>().0;
        let own = counted.own.get(edges..).map_or(&[][..], |own| own.as_chunks::<S>().0);
        for (i, out) in joints.as_chunks_mut::<S>().0.iter_mut().enumerate() {
            let (law, changes) = (&self.joint[i], &rates.joint[i]);
            let stiff = L::stiffness_times(law, &strains[i].map(|(_, rate)| rate), true);
            let changed = changes.stiffer(&strains[i].map(|(s, _)| s), true);
            let offset = changes.offset();
            for c in 0..S {
                out[c] = stiff[c] + changed[c] + offset[c] * natural;
            }
            if let Some(own) = own.get(i) {
                let stiff = L::stiffness_times(law, &own.map(|(_, rate)| rate), false);
                let changed = changes.stiffer(&own.map(|(s, _)| s), false);
                for c in 0..S {
                    out[c] += stiff[c] + changed[c];
                }
            }
        }
    }

    fn stressed_rate<const G: usize>(
        changed: Option<(&[Dual<L, N, S>; G], &Self::Rates<G>)>,
        stress: &[Lanes<G>],
        geometry: &L::Geometry,
        at: (&[f64], &L::Frames<f64>),
        derivatives: Derivatives,
        out: &mut [[f64; G]],
    ) {
        let edges = at.0.len().div_ceil(L::STRIDE) - 1;
        let (axial, joints) = stress.split_at(edges);
        let (joints, _) = joints.as_chunks::<S>();
        let load = |i: usize| changed.map_or([Lanes::ZERO; N], |(_, rates)| rates.load[i]);
        L::pull(geometry, |i, _| axial[i], |i, _| joints[i], load, out);
        if let Some((duals, _)) = changed {
            add_others(duals, at, derivatives, out);
        }
    }

    fn frame_rate<const G: usize>(
        frames: &[FrameRate<G>],
        geometry: &L::Geometry,
        gradient: &[f64],
        tangent: &L::Tangent<f64>,
        out: &mut [[f64; G]],
    ) {
        L::frame_rate(frames, geometry, gradient, tangent, out);
    }

    fn rebase_rates<const G: usize>(
        frames: &mut [FrameRate<G>],
        geometry: &L::Geometry,
        q: &[[f64; G]],
    ) {
        L::rebase_rates(frames, geometry, q);
    }

    fn frame_rates<const G: usize>(frames: [&L::Frames<Dual64>; G]) -> Vec<FrameRate<G>> {
        L::frame_rates(frames)
    }

    fn set_dual_frames<const G: usize>(
        frames: &L::Frames<f64>,
        rates: &[FrameRate<G>],
        lane: usize,
        dual: &mut L::Frames<Dual64>,
    ) {
        L::set_dual_frames(frames, rates, lane, dual);
    }
}
