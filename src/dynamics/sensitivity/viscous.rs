//! Derivatives of viscous stress, of relaxation and of internal friction: of what strains have gone through.
//!
//! The stress of a moment counts every strain as some of the strain now and some of what it was before
//! ([`Memory`]), and how far a spring of internal friction is stretched. So its derivatives are those of plain
//! numbers, side by side, and what a rod makes of stresses it makes of their derivatives.

use crate::dynamics::coefficients::StepCoefficients;
use crate::dynamics::linearization::Linearization;
use crate::dynamics::simulation::Simulation;
use crate::dynamics::stepper::stretched;
use crate::dynamics::viscosity::{Memory, relaxation};
use crate::numerics::lanes::{Lanes, all};
use crate::numerics::vector::components;
use crate::rod::{EffectiveStrains, FrameRate, InternalVariables, Sensitive};
use crate::scene::Damping;
use num_dual::Dual64;

/// The derivatives, along `G` parameters, of a step's viscous stress.
#[derive(Clone)]
pub struct Viscous<const G: usize> {
    /// Of the internal variables.
    internal: InternalVariables<Lanes<G>>,
    /// Of the strains at the end of the step: at fixed unknowns, and in all.
    rest: Vec<Lanes<G>>,
    strain: Vec<Lanes<G>>,
    /// How far springs of internal friction would be stretched there if they did not slip, and the derivatives of how
    /// far they are.
    z: Vec<f64>,
    slid: Vec<Lanes<G>>,
    effective: EffectiveStrains<G>,
    /// Whether kinds of strain have times of their own.
    apart: bool,
    /// Of the stresses.
    stress: Vec<Lanes<G>>,
}

/// The numbers of a step and of the damping, with the derivatives along each parameter.
type Numbers<'a, const G: usize> = (&'a [StepCoefficients<Dual64>; G], &'a [Damping<Dual64>; G]);

impl<const G: usize> Viscous<G> {
    /// At the start of simulations; none of rods that are not viscous.
    pub fn new<R: Sensitive>(simulations: [&Simulation<Dual64, R::Dual>; G]) -> Option<Self> {
        let internal = simulations.map(|simulation| &simulation.state().internal);
        let times =
            simulations.iter().flat_map(|simulation| simulation.damping().additional_times());
        let apart = times.into_iter().any(|time| time != Dual64::from(0.0) || time.eps != 0.0);
        let rates = |of: &dyn Fn(&InternalVariables<Dual64>) -> &Vec<Dual64>| -> Vec<Lanes<G>> {
            let count = internal.iter().map(|internal| of(internal).len()).min().unwrap_or(0);
            (0..count).map(|i| Lanes(internal.map(|internal| of(internal)[i].eps))).collect()
        };
        let strain = rates(&|internal| &internal.strain);
        let slid = rates(&|internal| &internal.slid);
        let zero = vec![Lanes::ZERO; strain.len()];
        (!strain.is_empty()).then(|| Self {
            internal: InternalVariables {
                strain_rate: rates(&|internal| &internal.strain_rate),
                slid: slid.clone(),
                relaxing: rates(&|internal| &internal.relaxing),
                strain,
            },
            rest: zero.clone(),
            strain: zero.clone(),
            z: Vec::new(),
            slid,
            effective: EffectiveStrains::default(),
            apart,
            stress: zero,
        })
    }

    /// The derivatives of the stresses of all elements that were found last.
    pub fn stress(&self) -> &[Lanes<G>] {
        &self.stress
    }

    /// Finds those at the end of a step, at fixed unknowns and frames.
    pub fn at_end<R: Sensitive>(
        &mut self,
        rates: &R::Rates<G>,
        numbers: Numbers<G>,
        step: &Linearization<'_, f64, R>,
    ) {
        R::rest_strain_rates(rates, step.end, &mut self.rest);
        self.strain.copy_from_slice(&self.rest);
        self.slide(rates, step);
        let memories = each(numbers, Memory::at_end);
        let factor = memories.first().map_or(0.0, |memory| memory.factor.re);
        self.strain.iter_mut().for_each(|rate| *rate = *rate * factor);
        self.count(&memories, &step.before.internal, numbers, step);
        step.rod.stress_rates(rates, &self.effective, &mut self.stress);
    }

    /// Goes on to the end of the step, where unknowns have the derivatives `q`, and finds those of the stresses that
    /// the next step counts by its start; less what the tangent of the forces there makes of `q` and of the frames,
    /// that of the elastic stiffness.
    pub fn go_on<R: Sensitive>(
        &mut self,
        (rates, frames): (&R::Rates<G>, &[FrameRate<G>]),
        numbers: Numbers<G>,
        step: &Linearization<'_, f64, R>,
        q: &[[f64; G]],
    ) {
        self.strain.copy_from_slice(&self.rest);
        step.rod.add_strain_rates(frames, step.end, q, &mut self.strain);
        self.slide(rates, step);
        self.relax(numbers, step);
        let by_h = numbers.0.first().map_or(0.0, |coefficients| coefficients.h.recip());
        let own = &mut self.internal;
        for (i, now) in self.strain.iter().enumerate() {
            own.strain_rate[i] = (*now - own.strain[i]) * by_h;
        }
        own.strain.copy_from_slice(&self.strain);
        own.slid.copy_from_slice(&self.slid);

        let memories = each(numbers, Memory::at_start);
        let beyond = memories.first().map_or(0.0, |memory| memory.factor.re) - 1.0;
        for (rate, rest) in self.strain.iter_mut().zip(&self.rest) {
            *rate = *rest + *rate * beyond;
        }
        self.count(&memories, &step.after.internal, numbers, step);
        step.rod.stress_rates(rates, &self.effective, &mut self.stress);
    }

    /// How far springs of internal friction are stretched at the end of a step.
    fn slide<R: Sensitive>(&mut self, rates: &R::Rates<G>, step: &Linearization<'_, f64, R>) {
        let (before, own) = (&step.before.internal, &self.internal);
        let count = own.slid.len();
        stretched(count, before, &step.after.internal.strain, &mut self.z);
        let first = self.strain.len() - count;
        self.slid.copy_from_slice(&own.slid);
        let changes = self.strain[first..].iter().zip(&own.strain[first..]);
        for (slid, (now, then)) in self.slid.iter_mut().zip(changes) {
            *slid = *slid + *now - *then;
        }
        step.rod.slip_rates(rates, &self.z, &mut self.slid);
    }

    /// Takes the springs of a Maxwell branch to the end of a step.
    fn relax<R: Sensitive>(
        &mut self,
        (coefficients, damping): Numbers<G>,
        step: &Linearization<'_, f64, R>,
    ) {
        if self.internal.relaxing.is_empty() {
            return;
        }
        let relaxation = |g: usize| {
            let maxwell = damping[g].maxwell.as_ref();
            maxwell.map(|maxwell| relaxation(maxwell, coefficients[g].h))
        };
        let Some(all) = all::<_, G>(std::array::from_fn(relaxation)) else { return };
        let Some([left, taken]) = all.first().map(|[a, b]| [a.re, b.re]) else { return };
        let rates = |k: usize| Lanes::<G>(components(|g| all[g][k].eps));
        let (left_rate, taken_rate) = (rates(0), rates(1));
        let (before, now) = (&step.before.internal, &step.after.internal);
        let InternalVariables { relaxing, strain, .. } = &mut self.internal;
        for (i, z) in relaxing.iter_mut().enumerate() {
            let change = now.strain[i] - before.strain[i];
            *z = *z * left
                + left_rate * before.relaxing[i]
                + (self.strain[i] - strain[i]) * taken
                + taken_rate * change;
        }
    }

    /// The effective strains of a stress, from the strains at the end of a step and from `past` ones, where `strain` has
    /// the derivatives of the part by the strains at the end.
    fn count<R: Sensitive>(
        &mut self,
        memories: &[Memory<Dual64>; G],
        past: &InternalVariables<f64>,
        (coefficients, damping): Numbers<G>,
        step: &Linearization<'_, f64, R>,
    ) {
        let Some(memory) = memories.first().map(Memory::value) else { return };
        let slopes = Memory::rates(memories);
        let (now, own) = (&step.after.internal, &self.internal);
        let EffectiveStrains { natural, values, rates, .. } = &mut self.effective;
        *natural = !coefficients.iter().any(StepCoefficients::averages);
        let count = now.strain.len();
        values.resize(count, 0.0);
        rates.resize(count, Lanes::ZERO);
        let (strains, mean_rates) = (&past.strain[..count], &past.strain_rate[..count]);
        let (own_strains, own_rates) = (&own.strain[..count], &own.strain_rate[..count]);
        let (ends, end_rates) = (&now.strain[..count], &self.strain[..count]);
        for i in 0..count {
            values[i] =
                memory.factor * ends[i] - memory.strain * strains[i] - memory.rate * mean_rates[i];
        }
        for i in 0..count {
            rates[i] = end_rates[i] - own_strains[i] * memory.strain - own_rates[i] * memory.rate;
        }
        // The numbers of the step and of damping change with few parameters.
        if [slopes.factor, slopes.strain, slopes.rate] != [Lanes::ZERO; 3] {
            for i in 0..count {
                rates[i] = rates[i] + slopes.factor * ends[i]
                    - slopes.strain * strains[i]
                    - slopes.rate * mean_rates[i];
            }
        }
        for (i, z) in past.relaxing.iter().enumerate() {
            values[i] -= memory.relaxing * z;
            rates[i] -= slopes.relaxing * *z + own.relaxing[i] * memory.relaxing;
        }
        if let Some(friction) = damping.first().and_then(|damping| damping.friction.as_ref()) {
            let of = |g: usize| damping[g].friction.as_ref().map_or(0.0, |own| own.stiffness.eps);
            let (value, slope) = (friction.stiffness.re, Lanes(components(of)));
            let start = count - now.slid.len();
            for (i, (slid, own)) in now.slid.iter().zip(&self.slid).enumerate() {
                values[start + i] += value * slid;
                rates[start + i] += slope * *slid + *own * value;
            }
        }
        if self.apart {
            let EffectiveStrains { own: own_values, own_rates: own_changes, .. } =
                &mut self.effective;
            own_values.resize(count, 0.0);
            own_changes.resize(count, Lanes::ZERO);
            for i in 0..count {
                let kind = step.rod.kind(i);
                let before = memory.past[0] * strains[i] + memory.past[1] * mean_rates[i];
                let change = slopes.past[0] * strains[i]
                    + own_strains[i] * memory.past[0]
                    + slopes.past[1] * mean_rates[i]
                    + own_rates[i] * memory.past[1];
                let (factor, time) = (memory.own_factor[kind], memory.time[kind]);
                own_values[i] = factor * ends[i] - time * before;
                own_changes[i] = slopes.own_factor[kind] * ends[i] + self.rest[i] * factor
                    - slopes.time[kind] * before
                    - change * time;
            }
        }
    }
}

/// What the stress of a moment counts, along each parameter.
fn each<const G: usize>(
    (coefficients, damping): Numbers<G>,
    of: impl Fn(&StepCoefficients<Dual64>, &Damping<Dual64>) -> Memory<Dual64>,
) -> [Memory<Dual64>; G] {
    std::array::from_fn(|g| of(&coefficients[g], &damping[g]))
}
