//! How the forces of a rod change with parameters.

use crate::energy::Derivatives;
use crate::energy::friction::SliderRates;
use crate::energy::{Sliders, Stretch};
use crate::numerics::lanes::{Lanes, all};
use crate::numerics::vector::components;
use crate::rod::discrete::DiscreteRod;
use crate::rod::layout::{Elements, Layout};
use crate::rod::sensitive::{EffectiveStrains, FrameRate, Sensitive};
use num_dual::Dual64;
use std::fmt::Debug;
use std::ops::{Add, Mul};

/// Derivatives of the stresses of a joint along `G` parameters, as functions of its `S` strains.
pub trait JointRate<J, const S: usize, const G: usize>:
    Copy + Debug + PartialEq + Send + Sync
{
    /// Of dual joints, one for each parameter.
    fn of(duals: [&J; G]) -> Self;

    /// Whether nothing changes.
    fn is_zero(&self) -> bool;

    /// The part that is proportional to the strains, with the `coupled` part of bending and twisting or without.
    fn stiffer(&self, strains: &[f64; S], coupled: bool) -> [Lanes<G>; S];

    /// The part without strains.
    fn offset(&self) -> [Lanes<G>; S];

    /// The derivatives of the stresses at these strains.
    #[inline(always)]
    fn stress(&self, strains: &[f64; S]) -> [Lanes<G>; S] {
        let (mut stress, offset) = (self.stiffer(strains, true), self.offset());
        for c in 0..S {
            stress[c] += offset[c];
        }
        stress
    }

    /// The product with the derivatives of a number by the law of the joint, see [`Laws::joint`](crate::rod::Laws::joint).
    fn along(&self, law: &([f64; 6], [f64; 3])) -> Lanes<G>;
}

/// Derivatives of the forces of a [`Layout`] along parameters.
pub trait RateLayout<const N: usize, const S: usize>: Layout<N, S> {
    /// Derivatives of the law of a joint.
    type JointRate<const G: usize>: JointRate<Self::Joint<Dual64>, S, G>;

    /// Writes the derivatives of the gradient at fixed unknowns and frames from those of the axial forces, by the strain
    /// of an edge, of the stresses, by those of a joint, and of the loads.
    fn pull<const G: usize>(
        geometry: &Self::Geometry,
        axial: impl Fn(usize, f64) -> Lanes<G>,
        stress: impl Fn(usize, &[f64; S]) -> [Lanes<G>; S],
        load: impl Fn(usize) -> [Lanes<G>; N],
        out: &mut [[f64; G]],
    );

    /// Passes the derivatives of the gradients of edges and joints, by num-dual at fixed unknowns, to `add`, each with
    /// its first unknown.
    fn add_rates_by_duals(
        elements: Elements<'_, Dual64, Self, N, S>,
        q: &[f64],
        frames: &Self::Frames<f64>,
        add: impl FnMut(usize, &[f64]),
    );

    /// Passes the derivatives of the gradients of moments to `add`, likewise.
    fn add_moment_rates(_: &Self::Moments<Dual64>, _q: &[f64], _add: impl FnMut(usize, &[f64])) {}

    /// Adds the derivatives of the strains along those of the unknowns and frames.
    fn add_strain_rates<const G: usize>(
        stretch: &[Stretch<f64, N>],
        frames: &[FrameRate<G>],
        geometry: &Self::Geometry,
        q: &[[f64; G]],
        out: (&mut [Lanes<G>], &mut [[Lanes<G>; S]]),
    );

    /// The product of a joint's stiffness with `s`, with the `coupled` part of bending and twisting or without.
    fn stiffness_times<T>(joint: &Self::Joint<f64>, s: &[T; S], coupled: bool) -> [T; S]
    where
        T: Copy + Add<Output = T> + Mul<f64, Output = T>;

    /// The derivatives of the stretch of the springs of joint `i`, where that without slip is `z` with the derivatives
    /// `rate`.
    fn slip_rate<const G: usize>(
        changes: &SliderRates<G>,
        sliders: (&Sliders<f64>, usize),
        joint: (&Self::Joint<f64>, &Self::JointRate<G>),
        z: [f64; S],
        rate: [Lanes<G>; S],
    ) -> [Lanes<G>; S];

    /// Adds the derivatives of the gradient along those of the frames, see
    /// [`Sensitive::frame_rate`](crate::rod::Sensitive::frame_rate).
    fn frame_rate<const G: usize>(
        _frames: &[FrameRate<G>],
        _geometry: &Self::Geometry,
        _gradient: &[f64],
        _tangent: &Self::Tangent<f64>,
        _out: &mut [[f64; G]],
    ) {
    }

    /// Moves the derivatives of the frames to where the rod is measured and has the derivatives `q`.
    fn rebase_rates<const G: usize>(
        _frames: &mut [FrameRate<G>],
        _geometry: &Self::Geometry,
        _q: &[[f64; G]],
    ) {
    }

    /// The derivatives that frames carry.
    fn frame_rates<const G: usize>(_: [&Self::Frames<Dual64>; G]) -> Vec<FrameRate<G>> {
        Vec::new()
    }

    /// Writes frames with the derivatives along parameter `lane`.
    fn set_dual_frames<const G: usize>(
        _frames: &Self::Frames<f64>,
        _rates: &[FrameRate<G>],
        _lane: usize,
        _dual: &mut Self::Frames<Dual64>,
    ) {
    }
}

/// Derivatives of the laws and loads of a rod along `G` parameters.
#[derive(Clone, Debug)]
pub struct Rates<L: RateLayout<N, S>, const N: usize, const S: usize, const G: usize> {
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

impl<L: RateLayout<N, S>, const N: usize, const S: usize, const G: usize> Default
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
fn add_others<L: RateLayout<N, S>, const N: usize, const S: usize, const G: usize>(
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

impl<L: RateLayout<N, S>, const N: usize, const S: usize> Sensitive for DiscreteRod<f64, L, N, S> {
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
        strains: &EffectiveStrains<G>,
        out: &mut [Lanes<G>],
    ) {
        let edges = self.stretch.len();
        let (axial, joined) = out.split_at_mut(edges);
        let natural = if strains.natural { 1.0 } else { 0.0 };
        let (values, changes) = (&strains.values[..edges], &strains.rates[..edges]);
        let (rest, stretch) = (&rates.rest[..edges], &rates.stretch[..edges]);
        for (i, law) in self.stretch.iter().enumerate() {
            // The strains at fixed unknowns change with the rest length.
            let shorter = rest[i] * law.stiffness;
            let [slope, offset] = stretch[i];
            axial[i] = (slope + shorter) * values[i]
                + changes[i] * law.stiffness
                + (offset + shorter) * natural;
        }
        let joints = joined.as_chunks_mut::<S>().0;
        let (values, changes) =
            (strains.values[edges..].as_chunks::<S>().0, strains.rates[edges..].as_chunks::<S>().0);
        let (values, changes) = (&values[..joints.len()], &changes[..joints.len()]);
        for (i, (law, rate)) in self.joint.iter().zip(&rates.joint).enumerate() {
            let stiff = L::stiffness_times(law, &changes[i], true);
            let (changed, offset) = (rate.stiffer(&values[i], true), rate.offset());
            for c in 0..S {
                joints[i][c] = stiff[c] + changed[c] + offset[c] * natural;
            }
        }
        if strains.own.is_empty() {
            return;
        }
        for (i, law) in self.stretch.iter().enumerate() {
            let slope = stretch[i][0] + rest[i] * law.stiffness;
            axial[i] += slope * strains.own[i] + strains.own_rates[i] * law.stiffness;
        }
        let own = strains.own[edges..].as_chunks::<S>().0;
        let own_rates = strains.own_rates[edges..].as_chunks::<S>().0;
        for (i, (law, rate)) in self.joint.iter().zip(&rates.joint).enumerate() {
            let stiff = L::stiffness_times(law, &own_rates[i], false);
            let changed = rate.stiffer(&own[i], false);
            for c in 0..S {
                joints[i][c] += stiff[c] + changed[c];
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
