//! How the forces of a rod change with parameters.

use crate::energy::law::slip::SliderRates;
use crate::energy::law::{LawRate, Symmetric};
use crate::energy::{Derivatives, Law, Stretch};
use crate::numerics::lanes::{Lanes, all};
use crate::numerics::vector::components;
use crate::rod::discrete::DiscreteRod;
use crate::rod::layout::Layout;
use crate::rod::{
    ChangedRods, EffectiveStrains, FrameRate, ReferenceFrames, RodGeometry, Sensitive,
};
use num_dual::Dual64;

/// Derivatives of the forces of a [`Layout`] along parameters.
pub trait RateLayout<const N: usize, const S: usize>: Layout<N, S> {
    /// Writes the derivatives of the gradient at fixed unknowns and frames from those of the axial forces, by the strain
    /// of an edge, of the stresses, by those of a joint, and of the loads.
    fn pull<const G: usize>(
        geometry: &Self::Geometry,
        axial: impl Fn(usize, f64) -> Lanes<G>,
        stress: impl Fn(usize, &[f64; S]) -> [Lanes<G>; S],
        load: impl Fn(usize) -> [Lanes<G>; N],
        out: &mut [[f64; G]],
    );

    /// Adds the derivatives of the strains along those of the unknowns and frames.
    fn add_strain_rates<const G: usize>(
        stretch: &[Stretch<f64, N>],
        frames: &[FrameRate<G>],
        geometry: &Self::Geometry,
        q: &[[f64; G]],
        edges: &mut [Lanes<G>],
        joints: &mut [[Lanes<G>; S]],
    );
}

/// Derivatives of the law of a joint along `G` parameters.
type JointRate<L, const N: usize, const S: usize, const G: usize> =
    LawRate<<L as Layout<N, S>>::Stiffness<Lanes<G>>, S, G>;

/// Derivatives of the laws and loads of a rod along `G` parameters.
#[derive(Clone, Debug)]
pub struct Rates<L: RateLayout<N, S>, const N: usize, const S: usize, const G: usize> {
    /// Whether anything elastic changes.
    elastic: bool,
    /// Laws of the edges at fixed unknowns.
    pub(super) stretch: Vec<LawRate<[Lanes<G>; 1], 1, G>>,
    /// Rest lengths, over themselves.
    pub(super) rest: Vec<Lanes<G>>,
    pub(super) joint: Vec<JointRate<L, N, S, G>>,
    pub(super) load: Vec<[Lanes<G>; N]>,
    sliders: Option<SliderRates<G>>,
}

impl<L: RateLayout<N, S>, const N: usize, const S: usize, const G: usize> Default
    for Rates<L, N, S, G>
{
    fn default() -> Self {
        Self {
            elastic: false,
            stretch: Vec::new(),
            rest: Vec::new(),
            joint: Vec::new(),
            load: Vec::new(),
            sliders: None,
        }
    }
}

/// A rod over dual numbers.
type Dual<L, const N: usize, const S: usize> = DiscreteRod<Dual64, L, N, S>;

/// One number of each of `G` dual rods.
#[inline(always)]
fn lanes<R, const G: usize>(duals: &[R; G], of: impl Fn(&R) -> f64) -> Lanes<G> {
    Lanes(components(|g| of(&duals[g])))
}

/// Adds the derivatives of the forces of moments and of user-defined energies, and of edges and joints where they are
/// those by num-dual, at fixed unknowns and frames.
fn add_others<L: RateLayout<N, S>, const N: usize, const S: usize, const G: usize>(
    duals: &[Dual<L, N, S>; G],
    q: &[f64],
    frames: &L::Frames<f64>,
    derivatives: Derivatives,
    with_elements: bool,
    out: &mut [[f64; G]],
) {
    let has_others = |rod: &Dual<L, N, S>| !rod.moments.list.is_empty() || !rod.own.is_empty();
    if !with_elements && !duals.iter().any(has_others) {
        return;
    }
    // Unknowns and frames without derivatives: only the numbers of the rod have some.
    let q: Vec<Dual64> = q.iter().map(|q| Dual64::from(*q)).collect();
    let edges = frames.edge_frames().iter().map(|frame| frame.map(Dual64::from));
    let twists = frames.twists().iter().map(|twist| Dual64::from(*twist));
    let frames = L::Frames::<Dual64>::from_parts(edges.collect(), twists.collect());
    for (g, dual) in duals.iter().enumerate() {
        let mut gradient = vec![Dual64::from(0.0); q.len()];
        if with_elements {
            L::dual_gradients(dual.at(&q, &frames), |first, local| {
                gradient[first..].iter_mut().zip(local).for_each(|(to, local)| *to += *local);
            });
        }
        dual.moments.add_gradient(&q, &mut gradient);
        dual.own.add_gradient(&q, frames.edge_frames(), derivatives, &mut gradient);
        out.iter_mut().zip(gradient).for_each(|(out, rate)| out[g] += rate.eps);
    }
}

/// Writes the derivatives of the stresses of laws with these rates, whose effective strains are those from `first` on.
#[inline(always)]
fn stress_rates<W, K, const S: usize, const G: usize>(
    laws: &[W],
    rate: impl Fn(usize) -> LawRate<K, S, G>,
    strains: &EffectiveStrains<G>,
    first: usize,
    out: &mut [Lanes<G>],
) where
    W: Law<f64, S>,
    K: Symmetric<Lanes<G>, S>,
{
    let (count, natural) = (laws.len(), if strains.natural { 1.0 } else { 0.0 });
    let out = &mut out.as_chunks_mut::<S>().0[..count];
    let values = &strains.values[first..].as_chunks::<S>().0[..count];
    let changes = &strains.rates[first..].as_chunks::<S>().0[..count];
    for i in 0..count {
        let rate = rate(i);
        // d(K s) = K ds + dK s, and the change of the natural part.
        let stiff: [Lanes<G>; S] = laws[i].stiffness().times(&changes[i]);
        let changed: [Lanes<G>; S] = rate.stiffness.times(&values[i]);
        for c in 0..S {
            out[i][c] = stiff[c] + changed[c] + rate.offset[c] * natural;
        }
    }
    // Strains with times of their own act without the coupling of bending and twisting.
    if strains.own.is_empty() {
        return;
    }
    let values = &strains.own[first..].as_chunks::<S>().0[..count];
    let changes = &strains.own_rates[first..].as_chunks::<S>().0[..count];
    for i in 0..count {
        let stiff: [Lanes<G>; S] = laws[i].stiffness().uncoupled().times(&changes[i]);
        let changed: [Lanes<G>; S] = rate(i).stiffness.uncoupled().times(&values[i]);
        for c in 0..S {
            out[i][c] += stiff[c] + changed[c];
        }
    }
}

impl<L: RateLayout<N, S>, const N: usize, const S: usize> Sensitive for DiscreteRod<f64, L, N, S> {
    type Rates<const G: usize> = Rates<L, N, S, G>;

    /// Writes the derivatives that dual rods contain.
    fn set_rates<const G: usize>(duals: &[Dual<L, N, S>; G], rates: &mut Self::Rates<G>) {
        let Rates { elastic, stretch, rest, joint, load, sliders } = rates;
        let [first, ..] = &duals[..] else { return };
        stretch.clear();
        for (i, law) in first.stretch.iter().enumerate() {
            let laws = duals.each_ref().map(|rod| &rod.stretch[i]);
            let mut rate = LawRate::<[Lanes<G>; 1], 1, G>::from_duals(laws);
            // The strain at fixed unknowns changes with the rest length l: d eps/dl = -(1 + eps)/l.
            let length = law.rest_length.re;
            let shorter =
                lanes(duals, |rod| law.stiffness.re * rod.stretch[i].rest_length.eps / length);
            rate.stiffness[0] -= shorter;
            rate.offset[0] -= shorter;
            stretch.push(rate);
        }
        rest.clear();
        rest.extend(first.stretch.iter().enumerate().map(|(i, law)| {
            lanes(duals, |rod| rod.stretch[i].rest_length.eps) * law.rest_length.re.recip()
        }));
        joint.clear();
        let joints = 0..first.joint.len();
        joint
            .extend(joints.map(|i| LawRate::from_duals(duals.each_ref().map(|rod| &rod.joint[i]))));
        load.clear();
        load.extend(
            (0..first.load.len())
                .map(|i| std::array::from_fn(|c| lanes(duals, |rod| rod.load[i].force[c].eps))),
        );
        let own = all(duals.each_ref().map(|rod| Some(&*rod.sliders.as_ref()?.sliders)));
        *sliders = own.map(SliderRates::from_duals);
        *elastic =
            stretch.iter().any(|law| !law.is_zero()) || joint.iter().any(|law| !law.is_zero());
    }

    /// Writes the derivatives of the gradient at fixed unknowns and frames, at the state of the `geometry`, by the
    /// numbers that have `changed`.
    #[inline(always)]
    fn gradient_rate<const G: usize>(
        ChangedRods { duals, rates }: ChangedRods<'_, Self, G>,
        geometry: &L::Geometry,
        q: &[f64],
        frames: &L::Frames<f64>,
        derivatives: Derivatives,
        out: &mut [[f64; G]],
    ) {
        let Rates { elastic, stretch, joint, load, .. } = rates;
        // Only loads change: the derivatives of the gradient are those of the loads.
        if derivatives == Derivatives::Hand && *elastic {
            let axial = |i: usize, strain: f64| stretch[i].stress(&[strain])[0];
            L::pull(geometry, axial, |i, strains| joint[i].stress(strains), |i| load[i], out);
        } else {
            out.fill([0.0; G]);
            for (i, load) in load.iter().enumerate() {
                for c in 0..N {
                    out[L::STRIDE * i + c] = (Lanes::ZERO - load[c]).0;
                }
            }
        }
        let with_elements = derivatives == Derivatives::Dual;
        add_others(duals, q, frames, derivatives, with_elements, out);
    }

    /// The kind of a strain: 0 of stretching, 1 of bending, 2 of twisting.
    fn kind(&self, strain: usize) -> usize {
        strain.checked_sub(self.stretch.len()).map_or(0, |own| 1 + usize::from(own % S == 2))
    }

    /// Writes the derivatives of the strains at fixed unknowns: those by the rest lengths of the edges.
    #[inline(always)]
    fn rest_strain_rates<const G: usize>(
        rates: &Self::Rates<G>,
        geometry: &L::Geometry,
        out: &mut [Lanes<G>],
    ) {
        let (edges, joints) = out.split_at_mut(rates.rest.len());
        let strains = geometry.edge_strains();
        for ((out, strain), rest) in edges.iter_mut().zip(strains).zip(&rates.rest) {
            *out = *rest * -(1.0 + strain);
        }
        joints.fill(Lanes::ZERO);
    }

    /// Adds the derivatives of the strains along those of the unknowns and frames.
    #[inline(always)]
    fn add_strain_rates<const G: usize>(
        &self,
        frames: &[FrameRate<G>],
        geometry: &L::Geometry,
        q: &[[f64; G]],
        out: &mut [Lanes<G>],
    ) {
        let (edges, joints) = out.split_at_mut(self.stretch.len());
        let joints = joints.as_chunks_mut::<S>().0;
        L::add_strain_rates(&self.stretch, frames, geometry, q, edges, joints);
    }

    /// Converts the derivatives of the stretches `z` of springs without slip to those with slip.
    fn slip_rates<const G: usize>(&self, rates: &Self::Rates<G>, z: &[f64], out: &mut [Lanes<G>]) {
        let (Some(springs), Some(changes)) = (&self.sliders, &rates.sliders) else { return };
        let (z, out) = (z.as_chunks::<S>().0, out.as_chunks_mut::<S>().0);
        for (i, (z, out)) in z.iter().zip(out).enumerate() {
            let (elastic, stiffer) = (self.joint[i].stiffness(), &rates.joint[i].stiffness);
            *out = changes.slip_rate(&springs.sliders, i, &elastic, stiffer, *z, *out);
        }
    }

    /// Writes the derivatives of the stresses of all elements: N, and N m.
    #[inline(always)]
    fn stress_rates<const G: usize>(
        &self,
        rates: &Self::Rates<G>,
        strains: &EffectiveStrains<G>,
        out: &mut [Lanes<G>],
    ) {
        let edges = self.stretch.len();
        let (axial, joints) = out.split_at_mut(edges);
        let stretch = |i: usize| {
            // At fixed strains.
            let (mut rate, shorter) = (rates.stretch[i], rates.rest[i] * self.stretch[i].stiffness);
            rate.stiffness[0] += shorter;
            rate.offset[0] += shorter;
            rate
        };
        stress_rates(&self.stretch, stretch, strains, 0, axial);
        stress_rates(&self.joint, |i| rates.joint[i], strains, edges, joints);
    }

    /// Writes the derivatives of the gradient at fixed unknowns and frames from the derivatives `stress` of the
    /// stresses, and of the loads and user-defined energies that have `changed`, if any.
    #[inline(always)]
    fn stressed_rate<const G: usize>(
        changed: Option<ChangedRods<'_, Self, G>>,
        stress: &[Lanes<G>],
        geometry: &L::Geometry,
        q: &[f64],
        frames: &L::Frames<f64>,
        derivatives: Derivatives,
        out: &mut [[f64; G]],
    ) {
        let edges = q.len().div_ceil(L::STRIDE) - 1;
        let (axial, joints) = stress.split_at(edges);
        let (joints, _) = joints.as_chunks::<S>();
        let load = |i: usize| changed.map_or([Lanes::ZERO; N], |changed| changed.rates.load[i]);
        L::pull(geometry, |i, _| axial[i], |i, _| joints[i], load, out);
        if let Some(ChangedRods { duals, .. }) = changed {
            add_others(duals, q, frames, derivatives, false, out);
        }
    }
}
