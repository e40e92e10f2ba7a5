//! Derivatives of the forces and strains of a [`DiscreteRod`] along `G` parameters: the implementation of
//! [`ForwardSensitivity`].
//!
//! Input: the geometry of the rod, and `G` rods over dual numbers. Each has the derivatives of stiffnesses, rest
//! lengths, natural strains, friction springs and loads along one parameter; [`Rates`] collects them. Output at fixed
//! unknowns and frames: derivatives of strains `s`, of stresses, `d(K s) = K ds + dK s` (N, N m), and of the energy
//! gradient (N). `add_strain_rates` adds `B dq`, with `B = ds/dq`: the part of the strain rates by given derivatives of
//! unknowns and frames. `viscous_force_rate` returns the derivatives of the forces `B^T K s` of effective strains `s`
//! along all changes. Each derivative has `G` values, in SIMD lanes. Follower loads and losses of contacts have no
//! part. Forward sensitivities use them for the right-hand side of each step.

use crate::energy::law::slip::SliderRates;
use crate::energy::law::{LawRate, NonlinearPart, Symmetric};
use crate::energy::{Derivatives, Law, Stretch};
use crate::numerics::directions::{Directions, all};
use crate::numerics::vector::components;
use crate::rod::discrete::DiscreteRod;
use crate::rod::layout::{Layout, LayoutBending};
use crate::rod::{
    ChangedRods, EffectiveStrains, ForwardSensitivity, FrameRate, ReferenceFrames, RodGeometry,
};
use num_dual::Dual64;

/// A planar or spatial layout with two products: derivatives of stresses to those of forces, derivatives of unknowns to
/// those of strains.
pub trait RateLayout<const N: usize, const S: usize>: Layout<N, S> {
    /// Overwrites `out`, one row per unknown, with the derivatives of the gradient at fixed unknowns and frames, N:
    /// `B^T` times the stress derivatives, less those of the loads. `axial` returns the derivative of the axial force
    /// of an edge from its index and strain. `stress` returns those of a joint from its index and strains, `load` those
    /// of the load on a node.
    fn gradient_rates<const G: usize>(
        geometry: &Self::Geometry,
        axial: impl Fn(usize, f64) -> Directions<G>,
        stress: impl Fn(usize, &[f64; S]) -> [Directions<G>; S],
        load: impl Fn(usize) -> [Directions<G>; N],
        out: &mut [[f64; G]],
    );

    /// Overwrites `out` with the derivatives of the forces `B^T sigma`, N, of given stresses `sigma` along `G`
    /// parameters. Both factors change: `sigma` by the rates that `axial` (edge) and `stress` (joint) return with the
    /// values, `B = ds/dq` by those of the unknowns, `q`, and of the `frames`. Loads have no part.
    fn node_force_rates<const G: usize>(
        geometry: &Self::Geometry,
        axial: impl Fn(usize) -> StressRate<1, G>,
        stress: impl Fn(usize) -> StressRate<S, G>,
        frames: &[FrameRate<G>],
        q: &[[f64; G]],
        out: &mut [[f64; G]],
    );

    /// Adds to `edges` and `joints` the derivatives `B dq` of the strains (`B = ds/dq`) that follow from those of the
    /// unknowns, `q`, and of the reference `frames`, at fixed rest lengths.
    fn add_strain_rates<const G: usize>(
        stretch: &[Stretch<f64, N>],
        frames: &[FrameRate<G>],
        geometry: &Self::Geometry,
        q: &[[f64; G]],
        edges: &mut [Directions<G>],
        joints: &mut [[Directions<G>; S]],
    );
}

/// The stresses of an edge or a joint, with their derivatives along `G` parameters: N, and N m.
#[derive(Clone, Copy)]
pub struct StressRate<const S: usize, const G: usize> {
    /// The stresses.
    pub value: [f64; S],
    /// Their derivatives.
    pub rate: [Directions<G>; S],
}

/// Derivatives of stiffness and natural stress of one joint along `G` parameters.
type JointRate<L, const N: usize, const S: usize, const G: usize> =
    LawRate<<L as Layout<N, S>>::Stiffness<Directions<G>>, S, G>;

/// Derivatives of the laws and loads of a rod along `G` parameters.
#[derive(Clone, Debug)]
pub struct Rates<L: RateLayout<N, S>, const N: usize, const S: usize, const G: usize> {
    /// Whether any derivative of a stretching, bending or twisting law differs from zero.
    elastic: bool,
    /// Derivatives of stiffness and natural stress of the law of each edge at fixed unknowns: they include the change
    /// of the strain by that of the rest length.
    pub(super) stretch: Vec<LawRate<[Directions<G>; 1], 1, G>>,
    /// The same derivatives at fixed strains.
    axial: Vec<LawRate<[Directions<G>; 1], 1, G>>,
    /// Parts of the laws of the edges beyond the linear ones, with the derivative along each parameter; empty for
    /// linear laws.
    pub(super) nonlinear: Vec<[NonlinearPart<Dual64>; G]>,
    /// Derivatives of the rest lengths, over the rest lengths.
    pub(super) rest: Vec<Directions<G>>,
    /// Laws of the joints.
    pub(super) joint: Vec<JointRate<L, N, S, G>>,
    /// Nonlinear bending of the joints, with the derivative along each parameter; empty for linear laws.
    pub(super) bending: Vec<[LayoutBending<L, Dual64, N, S>; G]>,
    /// Dead loads on the nodes, N.
    pub(super) load: Vec<[Directions<G>; N]>,
    /// Springs of internal friction, if there are any.
    sliders: Option<SliderRates<G>>,
}

impl<L: RateLayout<N, S>, const N: usize, const S: usize, const G: usize> Default
    for Rates<L, N, S, G>
{
    /// No derivatives: empty lists.
    fn default() -> Self {
        Self {
            elastic: false,
            stretch: Vec::new(),
            axial: Vec::new(),
            nonlinear: Vec::new(),
            rest: Vec::new(),
            joint: Vec::new(),
            bending: Vec::new(),
            load: Vec::new(),
            sliders: None,
        }
    }
}

impl<L: RateLayout<N, S>, const N: usize, const S: usize, const G: usize> Rates<L, N, S, G> {
    /// The derivatives of the force of edge `i` beyond a linear law, N, at fixed unknowns: its `strain` depends on the
    /// rest length.
    #[cold]
    #[inline(never)]
    fn nonlinear_rate(&self, i: usize, strain: f64) -> Directions<G> {
        let Some(nonlinear) = self.nonlinear.get(i) else { return Directions::ZERO };
        Directions(components(|g| {
            nonlinear[g].force(Dual64::new(strain, -(1.0 + strain) * self.rest[i].0[g])).eps
        }))
    }
}

impl<L: RateLayout<N, S>, const N: usize, const S: usize, const G: usize> Rates<L, N, S, G> {
    /// The derivatives of the stresses of joint `i` beyond its linear law, N m, at fixed strains.
    #[cold]
    #[inline(never)]
    fn bending_rate(&self, i: usize, strains: &[f64; S]) -> [Directions<G>; S] {
        let strains = components(|c| Dual64::from(strains[c]));
        let mut rates = [Directions::ZERO; S];
        for (g, bending) in self.bending[i].iter().enumerate() {
            let stress = bending.stress(&strains);
            for c in 0..S {
                rates[c].0[g] = stress[c].eps;
            }
        }
        rates
    }
}

/// A rod over dual numbers: every number with its derivative along one parameter.
type Dual<L, const N: usize, const S: usize> = DiscreteRod<Dual64, L, N, S>;

/// One number `of` each of the `G` dual rods, one SIMD lane per rod.
#[inline(always)]
fn lanes<R, const G: usize>(duals: &[R; G], of: impl Fn(&R) -> f64) -> Directions<G> {
    Directions(components(|g| of(&duals[g])))
}

/// Adds to lane `g` of `out` the gradient derivatives of dead moments, user-defined energies and contacts of dual rod
/// `g`, N, at fixed unknowns and frames. `with_elements` adds those of edges and joints by num-dual, for checks.
fn add_others<L: RateLayout<N, S>, const N: usize, const S: usize, const G: usize>(
    duals: &[Dual<L, N, S>; G],
    q: &[f64],
    frames: &L::Frames<f64>,
    derivatives: Derivatives,
    with_elements: bool,
    out: &mut [[f64; G]],
) {
    // Moments and user-defined energies are rare: without them no dual vectors are allocated.
    let has_others = |rod: &Dual<L, N, S>| {
        !(rod.moments.list.is_empty() && rod.own.is_empty() && rod.contacts.is_empty())
    };
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
        dual.contacts.add_gradient::<N>(&q, &mut gradient);
        out.iter_mut().zip(gradient).for_each(|(out, rate)| out[g] += rate.eps);
    }
}

/// Overwrites `out` with the derivatives of the stresses of `laws`: `K ds + dK s`, plus those of the natural stress if
/// `strains.natural` is set. Strains of kinds with a viscosity of their own act without the coupling of bending and
/// twisting. The effective strains of these laws begin at index `first` of the lists of `strains`; `rates[i]` has the
/// derivatives of law `i`.
#[inline(always)]
fn stress_rates<W, K, const S: usize, const G: usize>(
    laws: &[W],
    rates: &[LawRate<K, S, G>],
    strains: &EffectiveStrains<G>,
    first: usize,
    out: &mut [Directions<G>],
) where
    W: Law<f64, S>,
    K: Symmetric<Directions<G>, S>,
{
    let (count, natural) = (laws.len(), if strains.natural { 1.0 } else { 0.0 });
    let rates = &rates[..count];
    let out = &mut out.as_chunks_mut::<S>().0[..count];
    let values = &strains.values[first..].as_chunks::<S>().0[..count];
    let changes = &strains.rates[first..].as_chunks::<S>().0[..count];
    for i in 0..count {
        let rate = &rates[i];
        // d(K s) = K ds + dK s, and the change of the natural part.
        let stiff: [Directions<G>; S] = laws[i].stiffness().times(&changes[i]);
        let changed: [Directions<G>; S] = rate.stiffness.times(&values[i]);
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
        let stiff: [Directions<G>; S] = laws[i].stiffness().uncoupled().times(&changes[i]);
        let changed: [Directions<G>; S] = rates[i].stiffness.uncoupled().times(&values[i]);
        for c in 0..S {
            out[i][c] += stiff[c] + changed[c];
        }
    }
}

/// The stress `K s` of element `i`, N or N m, with its derivatives `K ds + dK s`, where the stiffness has the
/// derivatives `rate`. `values` and `changes` are the effective strains of all elements and their derivatives. Strains
/// `own`, if there are any, add a stress without the coupling of bending and twisting.
#[inline(always)]
fn viscous_stress<K, M, const S: usize, const G: usize>(
    stiffness: &K,
    rate: &M,
    [values, own]: [&[[f64; S]]; 2],
    [changes, own_changes]: [&[[Directions<G>; S]]; 2],
    i: usize,
) -> StressRate<S, G>
where
    K: Symmetric<f64, S>,
    M: Symmetric<Directions<G>, S>,
{
    let mut value: [f64; S] = stiffness.times(&values[i]);
    let (stiff, changed): ([Directions<G>; S], [Directions<G>; S]) =
        (stiffness.times(&changes[i]), rate.times(&values[i]));
    let mut rates = components(|c| stiff[c] + changed[c]);
    // Strains with times of their own act without the coupling of bending and twisting.
    if let (Some(own), Some(own_change)) = (own.get(i), own_changes.get(i)) {
        let (stiffness, rate) = (stiffness.uncoupled(), rate.uncoupled());
        let own_value: [f64; S] = stiffness.times(own);
        let (stiff, changed): ([Directions<G>; S], [Directions<G>; S]) =
            (stiffness.times(own_change), rate.times(own));
        for c in 0..S {
            value[c] += own_value[c];
            rates[c] += stiff[c] + changed[c];
        }
    }
    StressRate { value, rate: rates }
}

impl<L: RateLayout<N, S>, const N: usize, const S: usize> ForwardSensitivity
    for DiscreteRod<f64, L, N, S>
{
    type Rates<const G: usize> = Rates<L, N, S, G>;

    /// Overwrites `rates` with the derivatives that the dual rods contain, one lane per rod: laws, rest lengths, dead
    /// loads and friction springs. Those of moments, user-defined energies and contacts stay in the dual rods. No
    /// change without dual rods.
    fn set_rates<const G: usize>(duals: &[Dual<L, N, S>; G], rates: &mut Self::Rates<G>) {
        let Rates { elastic, stretch, axial, nonlinear, rest, joint, bending, load, sliders } =
            rates;
        let [first, ..] = &duals[..] else { return };
        nonlinear.clear();
        nonlinear.extend(
            (0..first.stretch.len()).filter_map(|i| {
                all(duals.each_ref().map(|rod| rod.nonlinear.edges.get(i).copied()))
            }),
        );
        stretch.clear();
        axial.clear();
        for (i, law) in first.stretch.iter().enumerate() {
            let laws = duals.each_ref().map(|rod| &rod.stretch[i]);
            let mut rate = LawRate::<[Directions<G>; 1], 1, G>::from_duals(laws);
            axial.push(rate);
            // The strain at fixed unknowns changes with the rest length l: d eps/dl = -(1 + eps)/l.
            let length = law.rest_length.re;
            let shorter =
                lanes(duals, |rod| law.stiffness.re * rod.stretch[i].rest_length.eps / length);
            rate.stiffness[0] -= shorter;
            rate.offset[0] -= shorter;
            stretch.push(rate);
        }
        // Relative changes of the rest lengths, used where the strain is given instead of the unknowns.
        rest.clear();
        rest.extend(first.stretch.iter().enumerate().map(|(i, law)| {
            lanes(duals, |rod| rod.stretch[i].rest_length.eps) * law.rest_length.re.recip()
        }));
        joint.clear();
        let joints = 0..first.joint.len();
        joint
            .extend(joints.map(|i| LawRate::from_duals(duals.each_ref().map(|rod| &rod.joint[i]))));
        bending.clear();
        bending.extend(
            (0..first.bending.len()).map(|i| duals.each_ref().map(|rod| rod.bending[i].clone())),
        );
        load.clear();
        load.extend(
            (0..first.load.len())
                .map(|i| std::array::from_fn(|c| lanes(duals, |rod| rod.load[i].force[c].eps))),
        );
        // Friction springs are present in all dual rods or in none.
        let own = all(duals.each_ref().map(|rod| Some(&*rod.sliders.as_ref()?.sliders)));
        *sliders = own.map(SliderRates::from_duals);
        // The second modulus of a stretch law may change alone.
        let has_second = nonlinear.iter().flatten().any(|part| part.second_modulus.eps != 0.0);
        *elastic = has_second
            || !bending.is_empty()
            || stretch.iter().any(|law| !law.is_zero())
            || joint.iter().any(|law| !law.is_zero());
    }

    /// Overwrites `out` with the derivatives of the gradient along all parameters, N, at fixed unknowns `q` and frames:
    /// those by laws, dead loads, moments, user-defined energies and contacts. `geometry` is that of the rod at `q`.
    /// Edges and joints are left out if no law changes; with [`Derivatives::Dual`] num-dual differentiates them.
    #[inline(always)]
    fn gradient_rate<const G: usize>(
        ChangedRods { duals, rates }: ChangedRods<'_, Self, G>,
        geometry: &L::Geometry,
        q: &[f64],
        frames: &L::Frames<f64>,
        derivatives: Derivatives,
        out: &mut [[f64; G]],
    ) {
        let Rates { elastic, stretch, nonlinear, joint, bending, load, .. } = rates;
        // An elastic law that changes needs the sweep over all elements; otherwise only loads have derivatives.
        if derivatives == Derivatives::Hand && *elastic {
            let axial = |i: usize, strain: f64| {
                let linear = stretch[i].stress(&[strain])[0];
                if nonlinear.is_empty() { linear } else { linear + rates.nonlinear_rate(i, strain) }
            };
            if bending.is_empty() {
                L::gradient_rates(
                    geometry,
                    axial,
                    |i, strains| joint[i].stress(strains),
                    |i| load[i],
                    out,
                );
            } else {
                let stress = |i: usize, strains: &[f64; S]| {
                    let (linear, own) = (joint[i].stress(strains), rates.bending_rate(i, strains));
                    components(|c| linear[c] + own[c])
                };
                L::gradient_rates(geometry, axial, stress, |i| load[i], out);
            }
        } else {
            // Only loads change, or num-dual differentiates edges and joints below.
            out.fill([0.0; G]);
            for (i, load) in load.iter().enumerate() {
                for c in 0..N {
                    out[L::STRIDE * i + c] = (Directions::ZERO - load[c]).0;
                }
            }
        }
        let with_elements = derivatives == Derivatives::Dual;
        add_others(duals, q, frames, derivatives, with_elements, out);
    }

    /// The kind of the strain with this index: 0 stretching, 1 bending, 2 twisting.
    fn kind(&self, strain: usize) -> usize {
        strain.checked_sub(self.stretch.len()).map_or(0, |own| 1 + usize::from(own % S == 2))
    }

    /// Overwrites `out`, edges first, with the derivatives of the strains at fixed unknowns. Those of an edge are
    /// `-(1 + eps) dl/l` by its rest length `l`; those of joints are zero.
    #[inline(always)]
    fn rest_strain_rates<const G: usize>(
        rates: &Self::Rates<G>,
        geometry: &L::Geometry,
        out: &mut [Directions<G>],
    ) {
        let (edges, joints) = out.split_at_mut(rates.rest.len());
        let strains = geometry.edge_strains();
        for ((out, strain), rest) in edges.iter_mut().zip(strains).zip(&rates.rest) {
            *out = *rest * -(1.0 + strain);
        }
        joints.fill(Directions::ZERO);
    }

    /// Adds to `out` the derivatives of the strains that follow from those of the unknowns, `q`, and of the reference
    /// frames: `B dq`.
    #[inline(always)]
    fn add_strain_rates<const G: usize>(
        &self,
        frames: &[FrameRate<G>],
        geometry: &L::Geometry,
        q: &[[f64; G]],
        out: &mut [Directions<G>],
    ) {
        let (edges, joints) = out.split_at_mut(self.stretch.len());
        let joints = joints.as_chunks_mut::<S>().0;
        L::add_strain_rates(&self.stretch, frames, geometry, q, edges, joints);
    }

    /// Converts `out`, the derivatives of the stretches of friction springs without slip, to those with slip. `z` are
    /// the stretches without slip. A spring beyond its limit gets the derivative of `z R/|z|`, also by its limit `R`;
    /// others stay.
    fn slip_rates<const G: usize>(
        &self,
        rates: &Self::Rates<G>,
        z: &[f64],
        out: &mut [Directions<G>],
    ) {
        let (Some(springs), Some(changes)) = (&self.sliders, &rates.sliders) else { return };
        let (z, out) = (z.as_chunks::<S>().0, out.as_chunks_mut::<S>().0);
        for (i, (z, out)) in z.iter().zip(out).enumerate() {
            let (elastic, stiffer) = (self.joint[i].stiffness(), &rates.joint[i].stiffness);
            *out = changes.slip_rate(&springs.sliders, i, &elastic, stiffer, *z, *out);
        }
    }

    /// Overwrites `out` with the derivatives of the stresses of all elements at the effective strains and their
    /// derivatives: N for edges, N m for joints. With natural strains, nonlinear laws of edges and joints add their
    /// changes at the strains of `geometry`.
    #[inline(always)]
    fn stress_rates<const G: usize>(
        &self,
        rates: &Self::Rates<G>,
        strains: &EffectiveStrains<G>,
        geometry: &L::Geometry,
        out: &mut [Directions<G>],
    ) {
        let edges = self.stretch.len();
        let (axial, joints) = out.split_at_mut(edges);
        stress_rates(&self.stretch, &rates.axial, strains, 0, axial);
        stress_rates(&self.joint, &rates.joint, strains, edges, joints);
        // Dashpots alone are linear.
        if strains.natural && !rates.nonlinear.is_empty() {
            for (i, (out, strain)) in axial.iter_mut().zip(geometry.edge_strains()).enumerate() {
                *out += rates.nonlinear_rate(i, strain);
            }
        }
        if strains.natural && !rates.bending.is_empty() {
            let mut values = geometry.joint_strains();
            for (i, out) in joints.as_chunks_mut::<S>().0.iter_mut().enumerate() {
                let own: [f64; S] = components(|_| values.next().unwrap_or_default());
                let own = rates.bending_rate(i, &own);
                for c in 0..S {
                    out[c] += own[c];
                }
            }
        }
    }

    /// Overwrites `out` with the derivatives of the forces, N, of the stresses `K s` of the effective `strains`, along
    /// stiffnesses, strains, unknowns `q` and `frames`. Natural stresses, nonlinear laws and loads have no part.
    #[inline(always)]
    fn viscous_force_rate<const G: usize>(
        &self,
        rates: &Self::Rates<G>,
        strains: &EffectiveStrains<G>,
        frames: &[FrameRate<G>],
        geometry: &L::Geometry,
        q: &[[f64; G]],
        out: &mut [[f64; G]],
    ) {
        let (edges, joints) = (self.stretch.len(), self.joint.len());
        let EffectiveStrains { values, rates: changes, own, own_rates, .. } = strains;
        let (stretch, by_law) = (&self.stretch[..edges], &rates.axial[..edges]);
        let split = own.len().min(edges);
        let (values, joint_values) = values.split_at(edges);
        let (changes, joint_changes) = changes.split_at(edges);
        let (own, joint_own) = own.split_at(split);
        let (own_rates, joint_own_rates) = own_rates.split_at(split);
        let axial = [values.as_chunks::<1>().0, own.as_chunks::<1>().0];
        let axial_changes = [changes.as_chunks::<1>().0, own_rates.as_chunks::<1>().0];
        let bent = [&joint_values.as_chunks::<S>().0[..joints], joint_own.as_chunks::<S>().0];
        let bent_changes =
            [&joint_changes.as_chunks::<S>().0[..joints], joint_own_rates.as_chunks::<S>().0];
        let (joint, by_joint) = (&self.joint[..joints], &rates.joint[..joints]);
        L::node_force_rates(
            geometry,
            #[inline(always)]
            |i| {
                let (stiffness, rate) = (stretch[i].stiffness(), &by_law[i].stiffness);
                viscous_stress(&stiffness, rate, axial, axial_changes, i)
            },
            #[inline(always)]
            |i| {
                let stiffness = joint[i].stiffness();
                viscous_stress(&stiffness, &by_joint[i].stiffness, bent, bent_changes, i)
            },
            frames,
            q,
            out,
        );
    }

    /// Overwrites `out` with the derivatives of the gradient, N, at fixed unknowns and frames, from the derivatives
    /// `stress` of the stresses of all elements. `changed` adds those of dead loads, moments, user-defined energies and
    /// contacts; `None` leaves them out.
    #[inline(always)]
    fn stressed_rate<const G: usize>(
        changed: Option<ChangedRods<'_, Self, G>>,
        stress: &[Directions<G>],
        geometry: &L::Geometry,
        q: &[f64],
        frames: &L::Frames<f64>,
        derivatives: Derivatives,
        out: &mut [[f64; G]],
    ) {
        let edges = q.len().div_ceil(L::STRIDE) - 1;
        let (axial, joints) = stress.split_at(edges);
        let (joints, _) = joints.as_chunks::<S>();
        let load =
            |i: usize| changed.map_or([Directions::ZERO; N], |changed| changed.rates.load[i]);
        L::gradient_rates(geometry, |i, _| axial[i], |i, _| joints[i], load, out);
        if let Some(ChangedRods { duals, .. }) = changed {
            add_others(duals, q, frames, derivatives, false, out);
        }
    }
}
