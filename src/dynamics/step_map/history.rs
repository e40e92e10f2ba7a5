//! Derivatives of stresses that depend on earlier strains: Kelvin-Voigt damping, relaxation and internal friction.
//!
//! A stress (N or N m) is `K (s - natural)`, with the elastic stiffness `K` and the natural strain of an element. The
//! effective strain `s` contains the damping:
//!
//! ```text
//! s = f1 s1 + f0 s0 + fr r0 + sum fz z0
//! ```
//!
//! `s1` and `s0` are the strains at the end and at the start of the step. `r0` is the mean strain rate (1/s) over the
//! step before, and `z0` the stretch of the spring of each Maxwell branch. The factors follow from the damping and the
//! scheme; those at the start of the next step are others than those at the end of this one ([`HistoryMoment`]).
//! Stretching, bending and twisting may have further terms by damping times of their own, friction springs add theirs.
//! An averaging scheme has the viscous stress apart from the elastic one: there `s` is that of the dashpots alone, and
//! the natural strain is left out.
//!
//! `coefficients` are those of the step with derivatives along the scheme's parameter. Forward, `set_end_stress`
//! returns the derivatives of the stresses along parameters at fixed unknowns, and `advance_history` moves those of
//! strains, rates and stretches to the end of the step. Transposed, `stress_transposed` and `history_transposed` take
//! derivatives of a misfit by the forces and by the history at the end. They return those by strains, rates, stretches,
//! laws and damping numbers; internal friction is left out there. [`add_by_strains`] returns derivatives by unknowns
//! and frames from those by strains.

use crate::dynamics::coefficients::StepCoefficients;
use crate::dynamics::step_map::StepMap;
use crate::dynamics::step_map::branch_relaxation::{BranchRelaxation, HistoryMoment};
use crate::dynamics::step_map::numbers::{NONE, SCHEME, StepNumbers, along};
use crate::dynamics::step_map::rates::{ParameterRates, ParameterSlopes, StateRates};
use crate::dynamics::step_map::workspace::HistoryWorkspace;
use crate::dynamics::stepper::stretch_springs;
use crate::dynamics::viscosity::EffectiveStrainFactors;
use crate::energy::Derivatives;
use crate::numerics::directions::Directions;
use crate::numerics::vector::map_components;
use crate::rod::{
    EffectiveStrains, ForwardSensitivity, FrameRate, InternalVariables, RodGeometry, StressInputs,
    Transposed, strained,
};
use num_dual::Dual64;

/// The factors of `s1`, `s0` and `r0` in the effective strains, or their derivatives by one number of damping or
/// scheme.
#[derive(Clone, Copy, Debug)]
struct HistoryForm {
    /// Factors of `s1`, `s0` and `r0` for all strains.
    all: [f64; 3],
    /// Factors of `s1`, `s0` and `r0` for stretching, bending and twisting, beside those for all.
    own: [[f64; 3]; 3],
}

impl HistoryForm {
    /// The factors of `s1`, `s0` and `r0` from those of the effective strain, with their signs; `part` selects values
    /// or derivatives.
    fn new(factors: &EffectiveStrainFactors<Dual64>, part: fn(Dual64) -> f64) -> Self {
        let EffectiveStrainFactors { factor, strain, rate, past, own_factor, time } = factors;
        // Strains with times of their own: effective strain own_factor s1 - time (past[0] s0 +
        // past[1] r0).
        let own = |k: usize| {
            map_components(&[own_factor[k], -(time[k] * past[0]), -(time[k] * past[1])], part)
        };
        let all = map_components(&[*factor, -strain, -rate], part);
        Self { all, own: [own(0), own(1), own(2)] }
    }
}

/// The lists `[s1, s0, r0]`: the given strains `s1`, and strains and mean strain rates of the `past`.
fn lists<'a, T>(s1: &'a [T], past: &'a InternalVariables<T>) -> [&'a [T]; 3] {
    [s1, &past.strain, &past.strain_rate]
}

impl<R: ForwardSensitivity> StepMap<'_, R> {
    /// The coefficients of the step at a scheme's `parameter`, with the derivatives along it if it has one.
    pub fn coefficients(&self, parameter: Dual64) -> StepCoefficients<Dual64> {
        // Coefficients in dual numbers only where the parameter of the scheme has a derivative.
        match parameter.eps == 0.0 {
            true => self.step.coefficients(parameter.re).map(Dual64::from),
            false => self.step.coefficients(parameter),
        }
    }

    /// The factors of the effective strain of a moment, with their derivatives by the Kelvin-Voigt time or the scheme's
    /// parameter at `place` (the order of [`along`]; [`NONE`]: no derivatives). `taken` is the sum over all Maxwell
    /// branches of the factors of the strain's change; the start of the next step does not use it.
    fn factors(
        &self,
        moment: HistoryMoment,
        place: usize,
        taken: f64,
    ) -> EffectiveStrainFactors<Dual64> {
        let (damping, parameter) = along(self.step.damping, self.step.parameter, place);
        let coefficients = self.coefficients(parameter);
        match moment {
            HistoryMoment::End => {
                EffectiveStrainFactors::at_end(&coefficients, &damping, taken.into())
            }
            HistoryMoment::NextStart => EffectiveStrainFactors::at_start(&coefficients, &damping),
        }
    }

    /// The factors of `s1`, `s0` and `r0` in the effective strains at the end of the step, or at the start of the next.
    /// Those at the end include the factors of the strain's change in the Maxwell `branches`; stretches are no part.
    fn form(&self, moment: HistoryMoment, branches: &[BranchRelaxation]) -> HistoryForm {
        let taken = branches.iter().map(BranchRelaxation::change_factor).sum();
        HistoryForm::new(&self.factors(moment, NONE, taken), |x| x.re)
    }

    /// The derivatives of the factors of `s1`, `s0` and `r0` in the effective strains of a moment, by the Kelvin-Voigt
    /// time or the scheme's parameter at `place` (the order of [`along`]).
    fn form_slope(&self, moment: HistoryMoment, place: usize) -> HistoryForm {
        HistoryForm::new(&self.factors(moment, place, 0.0), |x| x.eps)
    }

    /// Overwrites `branches` with the relaxation of the Maxwell branches over the step.
    fn set_branches(&self, branches: &mut Vec<BranchRelaxation>) {
        let h = self.step.after.time - self.step.before.time;
        branches.clear();
        branches.extend(
            self.step.damping.maxwell.as_slice().iter().map(|own| BranchRelaxation::new(own, h)),
        );
    }

    /// The lists `[s1, s0, r0]` of strains and mean rates from which the stress of a moment follows. For the end of the
    /// step they are the strains there, and strains and rates at its start. For the start of the next step `s1` and
    /// `s0` are both the strains at the end of this one, and `r0` is the mean rate over it.
    fn history(&self, moment: HistoryMoment) -> [&[f64]; 3] {
        lists(&self.step.after.internal.strain, self.past(moment))
    }

    /// The internal variables at the start of the step whose stress is taken: before this step for its end, after this
    /// step for the start of the next.
    fn past(&self, moment: HistoryMoment) -> &InternalVariables<f64> {
        match moment {
            HistoryMoment::End => &self.step.before.internal,
            HistoryMoment::NextStart => &self.step.after.internal,
        }
    }

    /// Overwrites `effective` with the effective strains of a moment, `f1 s1 + f0 s0 + fr r0`, plus `fz z0` of every
    /// Maxwell branch, one per strain. If `has_own_times`, the strains with damping times of their kind,
    /// `own[0] s1 + own[1] s0 + own[2] r0`, are listed beside them, else that list is empty. Derivatives are not set.
    #[inline(always)]
    fn set_effective<const G: usize>(
        &self,
        moment: HistoryMoment,
        form: &HistoryForm,
        branches: &[BranchRelaxation],
        has_own_times: bool,
        effective: &mut EffectiveStrains<G>,
    ) {
        let history = self.history(moment);
        // s = f1 s1 + f0 s0 + fr r0 + fz z0, the strain that the elastic stiffness multiplies.
        let (count, [s1, s0, r0], [f1, f0, fr]) = (history[0].len(), history, form.all);
        effective.natural = !self.averages;
        let values = &mut effective.values;
        values.resize(count, 0.0);
        let (values, s1, s0, r0) = (&mut values[..count], &s1[..count], &s0[..count], &r0[..count]);
        for i in 0..count {
            values[i] = f1 * s1[i] + f0 * s0[i] + fr * r0[i];
        }
        for (branch, z0) in branches.iter().zip(self.past(moment).branches()) {
            let fz = branch.stretch_factor(moment);
            for (value, z) in values.iter_mut().zip(z0) {
                *value += fz * z;
            }
        }
        // Stretching, bending and twisting may have damping times beside the common one.
        effective.own.clear();
        if has_own_times {
            effective.own.extend((0..s1.len()).map(|i| {
                let own = &form.own[self.step.rod.kind(i)];
                own[0] * s1[i] + own[1] * s0[i] + own[2] * r0[i]
            }));
        }
    }

    /// Overwrites `room.stress` with the derivatives of the stresses at the end of the step, N or N m, at fixed
    /// unknowns and frames. They are those of Kelvin-Voigt, Maxwell and friction stress, by laws, past strains and
    /// damping numbers. Leaves in `room.rest` the derivatives of strains by rest lengths, and in `room.effective` the
    /// effective strains without friction.
    #[inline(always)]
    pub fn set_end_stress<const G: usize>(
        &self,
        parameters: &ParameterRates<R, G>,
        internal: &InternalVariables<Directions<G>>,
        room: &mut HistoryWorkspace<G>,
    ) {
        // At fixed unknowns strains change with the rest lengths only.
        self.set_branches(&mut room.branches);
        room.rest.resize(internal.strain.len(), Directions::ZERO);
        R::rest_strain_rates(&parameters.laws, self.step.end, &mut room.rest);
        // The springs slip with the strain itself, the stress follows from its multiple f1 s1.
        room.strain.clone_from(&room.rest);
        self.slide(parameters, internal, room);
        self.set_end_strains(parameters, internal, room);
        let HistoryWorkspace { slid, effective, slipping, stress, .. } = room;
        stress.resize(internal.strain.len(), Directions::ZERO);
        // Springs of internal friction add g K z: the stretch counts as a strain with the factor
        // g.
        let strains = match &self.step.damping.friction {
            None => &*effective,
            Some(friction) => {
                slipping.clone_from(effective);
                let start = slipping.values.len() - slid.len();
                for (i, (z, rate)) in self.step.after.internal.slid.iter().zip(&*slid).enumerate() {
                    slipping.values[start + i] += friction.stiffness * z;
                    slipping.rates[start + i] +=
                        parameters.friction * *z + *rate * friction.stiffness;
                }
                slipping
            }
        };
        self.step.rod.stress_rates(&parameters.laws, strains, self.step.end, stress);
    }

    /// Replaces the derivatives of the internal variables at the start of the step by those at its end, where `state.q`
    /// already has the derivatives of the unknowns. Overwrites `room.effective` with the effective strains at the start
    /// of the next step less those at the end of this one, and their derivatives; an averaging scheme subtracts none.
    /// Internal friction and natural strains are equal in both and cancel.
    #[inline(always)]
    pub fn advance_history<const G: usize>(
        &self,
        parameters: &ParameterRates<R, G>,
        state: &mut StateRates<G>,
        room: &mut HistoryWorkspace<G>,
    ) {
        // All of the strain now: by rest lengths, and by the unknowns, whose derivatives are
        // known.
        room.strain.clone_from(&room.rest);
        self.step.rod.add_strain_rates(&state.frames, self.step.end, &state.q, &mut room.strain);
        self.slide(parameters, &state.internal, room);
        self.relax(parameters, &mut state.internal, &room.branches, &room.strain);
        let (internal, by_h) = (&mut state.internal, self.nodal.h().recip());
        let (now, count) = (&room.strain[..], room.strain.len());
        let (then, rate) = (&mut internal.strain[..count], &mut internal.strain_rate[..count]);
        for i in 0..count {
            // The mean rate over this step is the rate before the next one.
            rate[i] = (now[i] - then[i]) * by_h;
            then[i] = now[i];
        }
        internal.slid.copy_from_slice(&room.slid);
        self.subtract_end_strains(parameters, internal, room);
    }

    /// Replaces the effective strains in `room.effective`. They were those at the end of the step, with derivatives at
    /// fixed unknowns. They become those at the start of the next step less those at the end, with complete
    /// derivatives. An averaging scheme subtracts none.
    #[inline(always)]
    fn subtract_end_strains<const G: usize>(
        &self,
        parameters: &ParameterRates<R, G>,
        internal: &InternalVariables<Directions<G>>,
        HistoryWorkspace { rest, strain, branches, effective, .. }: &mut HistoryWorkspace<G>,
    ) {
        let end = self.form(HistoryMoment::End, branches);
        let next = self.form(HistoryMoment::NextStart, branches);
        let [s1, _, r1] = self.history(HistoryMoment::NextStart);
        // The forces of an averaging scheme at the next start are not those at the end and a
        // difference, but all viscous forces.
        let kept = if self.averages { 0.0 } else { 1.0 };
        let ([n1, n0, nr], e1) = (next.all, kept * end.all[0]);
        let EffectiveStrains { values, rates, own, own_rates, .. } = effective;
        let count = values.len();
        let (values, rates) = (&mut values[..count], &mut rates[..count]);
        let (rest, strain, rate) =
            (&rest[..count], &strain[..count], &internal.strain_rate[..count]);
        let (s1, r1) = (&s1[..count], &r1[..count]);
        // The strain now is that before the next step.
        let by_strain = n1 + n0 - e1;
        for i in 0..count {
            values[i] = (n1 + n0) * s1[i] + nr * r1[i] - kept * values[i];
            rates[i] = strain[i] * by_strain + rate[i] * nr + rest[i] * e1 - rates[i] * kept;
        }
        let past = self.past(HistoryMoment::NextStart);
        let stretches = past.branches().zip(internal.branches());
        for (branch, (z1, z_rates)) in branches.iter().zip(stretches) {
            let nz = branch.stretch_factor(HistoryMoment::NextStart);
            for (i, z) in z_rates.iter().enumerate() {
                values[i] += nz * z1[i];
                rates[i] += *z * nz;
            }
        }
        for (i, (value, rate)) in own.iter_mut().zip(own_rates.iter_mut()).enumerate() {
            let kind = self.step.rod.kind(i);
            let ([n1, n0, nr], e1) = (next.own[kind], kept * end.own[kind][0]);
            *value = (n1 + n0) * s1[i] + nr * r1[i] - kept * *value;
            *rate = strain[i] * (n1 + n0 - e1) + internal.strain_rate[i] * nr + rest[i] * e1
                - *rate * kept;
        }
        self.add_by_numbers(HistoryMoment::NextStart, parameters, branches, effective);
    }

    /// Overwrites `room.slid` with the derivatives of the stretches of friction springs, with slip, at the end of the
    /// step. Without slip they change as the strains, whose derivatives are in `room.strain`; with slip they are those
    /// of the limit. Empty without internal friction.
    fn slide<const G: usize>(
        &self,
        parameters: &ParameterRates<R, G>,
        internal: &InternalVariables<Directions<G>>,
        room: &mut HistoryWorkspace<G>,
    ) {
        let (count, HistoryWorkspace { strain, z, slid, .. }) = (internal.slid.len(), room);
        let (before, now) = (&self.step.before.internal, &self.step.after.internal.strain);
        slid.clone_from(&internal.slid);
        if count == 0 {
            return;
        }
        // Without slip a spring stretches as its joint does.
        stretch_springs(count, before, now, z);
        let first = strain.len() - count;
        let changes = strain[first..].iter().zip(&internal.strain[first..]);
        for (slid, (now, then)) in slid.iter_mut().zip(changes) {
            *slid = *slid + *now - *then;
        }
        // With slip the stretch stays at its limit, whose derivative replaces that part.
        self.step.rod.slip_rates(&parameters.laws, z, slid);
    }

    /// Replaces the derivatives of the stretches of the Maxwell springs by those at the end of the step, of `z1 = left
    /// z0 + taken (s1 - s0)`. They are by `z0`, by both strains, whose derivatives at the end are in `strain`, and by
    /// the relaxation time, branch after branch. No effect without a Maxwell branch.
    fn relax<const G: usize>(
        &self,
        parameters: &ParameterRates<R, G>,
        internal: &mut InternalVariables<Directions<G>>,
        branches: &[BranchRelaxation],
        strain: &[Directions<G>],
    ) {
        let (before, now) = (&self.step.before.internal, &self.step.after.internal);
        let InternalVariables { relaxing, strain: start, .. } = internal;
        let lists = relaxing.chunks_exact_mut(strain.len().max(1)).zip(before.branches());
        let numbers = branches.iter().zip(&parameters.numbers.branches);
        for ((branch, along), (relaxing, z0)) in numbers.zip(lists) {
            let (BranchRelaxation { left, taken, .. }, by_time) = (branch, along.time);
            for (i, z) in relaxing.iter_mut().enumerate() {
                let change = now.strain[i] - before.strain[i];
                // z1 = left z0 + taken (s1 - s0), by z0, by the strains, and by the relaxation
                // time in both factors.
                *z = *z * left.re
                    + by_time * left.eps * z0[i]
                    + (strain[i] - start[i]) * taken.re
                    + by_time * taken.eps * change;
            }
        }
    }

    /// Overwrites `room.effective` with the effective strains at the end of the step without internal friction, and
    /// their derivatives at fixed unknowns. Those are by rest lengths, by past strains, rates and stretches, and by
    /// damping numbers.
    #[inline(always)]
    fn set_end_strains<const G: usize>(
        &self,
        parameters: &ParameterRates<R, G>,
        internal: &InternalVariables<Directions<G>>,
        HistoryWorkspace { rest, branches, effective, .. }: &mut HistoryWorkspace<G>,
    ) {
        let form = self.form(HistoryMoment::End, branches);
        let has_own_times = parameters.has_own_times;
        self.set_effective(HistoryMoment::End, &form, branches, has_own_times, effective);
        let (count, EffectiveStrains { rates, own, own_rates, .. }) = (rest.len(), &mut *effective);
        let [f1, f0, fr] = form.all;
        rates.resize(count, Directions::ZERO);
        let (rates, rest) = (&mut rates[..count], &rest[..count]);
        let (strain, strain_rate) = (&internal.strain[..count], &internal.strain_rate[..count]);
        // By s1, s0 and r0, with the factors of the form; by the stretch of the Maxwell springs.
        for i in 0..count {
            rates[i] = rest[i] * f1 + strain[i] * f0 + strain_rate[i] * fr;
        }
        for (branch, z0) in branches.iter().zip(internal.branches()) {
            let fz = branch.stretch_factor(HistoryMoment::End);
            for (rate, z) in rates.iter_mut().zip(z0) {
                *rate += *z * fz;
            }
        }
        own_rates.clear();
        // The same for the strains with times of their own.
        own_rates.extend((0..own.len()).map(|i| {
            let own = &form.own[self.step.rod.kind(i)];
            rest[i] * own[0] + strain[i] * own[1] + strain_rate[i] * own[2]
        }));
        self.add_by_numbers(HistoryMoment::End, parameters, branches, effective);
    }

    /// Adds to `effective` the derivatives of the effective strains of a moment by the damping numbers and the
    /// parameter of the scheme: for each number the derivatives of the factors times strains, rates and stretches. Mass
    /// damping has no part in them; numbers without derivatives are skipped.
    #[inline(always)]
    fn add_by_numbers<const G: usize>(
        &self,
        moment: HistoryMoment,
        parameters: &ParameterRates<R, G>,
        branches: &[BranchRelaxation],
        effective: &mut EffectiveStrains<G>,
    ) {
        let numbers = &parameters.numbers;
        for (place, along) in numbers.times.iter().enumerate() {
            self.add_by_number(moment, place, along, effective);
        }
        let stretches = self.past(moment).branches();
        for ((branch, along), z0) in branches.iter().zip(&numbers.branches).zip(stretches) {
            let slopes = [
                (along.stiffness, branch.by_stiffness(moment)),
                (along.time, branch.by_time(moment)),
            ];
            for (along, slope) in slopes {
                if along != Directions::ZERO {
                    self.add_by_branch(moment, along, slope, z0, effective);
                }
            }
        }
        self.add_by_number(moment, SCHEME, &numbers.scheme, effective);
    }

    /// Adds the derivatives of effective strains of a moment by the Kelvin-Voigt time or the scheme's parameter at
    /// `place`, whose derivatives along the parameters are `along`; nothing if these are zero.
    #[inline(always)]
    fn add_by_number<const G: usize>(
        &self,
        moment: HistoryMoment,
        place: usize,
        along: &Directions<G>,
        EffectiveStrains { rates, own_rates, .. }: &mut EffectiveStrains<G>,
    ) {
        if *along == Directions::ZERO {
            return;
        }
        let count = rates.len();
        let ([s1, s0, r0], rates) = (self.history(moment), &mut rates[..count]);
        let (s1, s0, r0) = (&s1[..count], &s0[..count], &r0[..count]);
        let slope = self.form_slope(moment, place);
        let [g1, g0, gr] = slope.all;
        for i in 0..count {
            rates[i] += *along * (g1 * s1[i] + g0 * s0[i] + gr * r0[i]);
        }
        for (i, rate) in own_rates.iter_mut().enumerate() {
            let own = &slope.own[self.step.rod.kind(i)];
            *rate += *along * (own[0] * s1[i] + own[1] * s0[i] + own[2] * r0[i]);
        }
    }

    /// Adds the derivatives of effective strains of a moment by a number of a Maxwell branch, whose derivatives along
    /// the parameters are `along`. `by_change` and `by_stretch` are the derivatives by it of the factors of strain
    /// change and stretch, `z0` the stretches of the branch.
    #[inline(always)]
    fn add_by_branch<const G: usize>(
        &self,
        moment: HistoryMoment,
        along: Directions<G>,
        [by_change, by_stretch]: [f64; 2],
        z0: &[f64],
        EffectiveStrains { rates, .. }: &mut EffectiveStrains<G>,
    ) {
        let count = rates.len();
        let ([s1, s0, _], rates) = (self.history(moment), &mut rates[..count]);
        let (s1, s0) = (&s1[..count], &s0[..count]);
        for i in 0..count {
            rates[i] += along * (by_change * s1[i] - by_change * s0[i]);
        }
        for (rate, z) in rates.iter_mut().zip(z0) {
            *rate += along * (by_stretch * z);
        }
    }
}

impl<R: Transposed> StepMap<'_, R> {
    /// Transpose of the stresses of a moment; `d` are the derivatives of a misfit by the forces. Adds the derivatives
    /// by laws, rest lengths, and numbers of damping and scheme to `slopes`. With a history of strains it also adds the
    /// derivatives by past strains, rates and Maxwell stretches to `state`. Those by the effective strains are left in
    /// `room.by_strain`. Without a history only the derivatives by laws are added. Friction is left out.
    pub fn stress_transposed(
        &self,
        moment: HistoryMoment,
        d: &[f64],
        state: &mut StateRates<1>,
        slopes: &mut ParameterSlopes,
        room: &mut HistoryWorkspace<1>,
    ) {
        let rod = self.step.rod;
        let HistoryWorkspace { branches, effective, along, by_strain, by_own, .. } = room;
        let internal = &mut state.internal;
        let has_history = !internal.strain.is_empty();
        self.set_branches(branches);
        let form = has_history.then(|| self.form(moment, branches));
        // Without a history the stress follows from the strains at the end alone.
        match &form {
            Some(form) => self.set_effective(moment, form, branches, self.has_own_times, effective),
            None => self.step.end.write_strains(&mut effective.values),
        }
        along.resize(effective.values.len(), 0.0);
        // The force along d is the stress times the strain along d: w . (ds/dq d).
        strained(rod, self.step.end, &self.still, d, along);
        let EffectiveStrains { values, own, .. } = effective;
        let now = if has_history { &self.step.after.internal.strain } else { &*values };
        let of_strains = StressInputs { strains: values, own, now, counted: has_history };
        rod.add_to_laws(along, of_strains, &mut slopes.laws);
        let Some(form) = form else { return };
        // By the effective strain: K times that strain, and from it by s0, r0, z0 with the
        // factors of the form.
        rod.stiffened(along, true, by_strain);
        by_own.clear();
        if self.has_own_times {
            rod.stiffened(along, false, by_own);
        }

        let history = self.history(moment);
        let InternalVariables { strain, strain_rate, relaxing, .. } = internal;
        let [_, s0, r0] = form.all;
        for (factor, to) in [(s0, &mut *strain), (r0, &mut *strain_rate)] {
            to.iter_mut().zip(&*by_strain).for_each(|(to, by)| to.0[0] += factor * by);
        }
        for (branch, to) in branches.iter().zip(relaxing.chunks_exact_mut(by_strain.len().max(1))) {
            let factor = branch.stretch_factor(moment);
            to.iter_mut().zip(&*by_strain).for_each(|(to, by)| to.0[0] += factor * by);
        }
        let (mut sums, mut own_sums) = ([0.0; 3], [[0.0; 3]; 3]);
        // By the factors of the form, for the numbers that they depend on.
        for (sum, list) in sums.iter_mut().zip(history) {
            *sum = list.iter().zip(&*by_strain).map(|(x, by)| x * by).sum();
        }
        // By the rest length l0 of an edge: ds/dl0 = -(1 + s)/l0.
        for (i, rest) in slopes.laws.rest.iter_mut().enumerate() {
            *rest -= (1.0 + history[0][i]) * (form.all[0] * by_strain[i]);
        }
        // The same through the strains with times of their own.
        for (i, by) in by_own.iter().enumerate() {
            let kind = rod.kind(i);
            let own = &form.own[kind];
            strain[i].0[0] += own[1] * by;
            strain_rate[i].0[0] += own[2] * by;
            (0..3).for_each(|k| own_sums[kind][k] += history[k][i] * by);
            if let Some(rest) = slopes.laws.rest.get_mut(i) {
                *rest -= (1.0 + history[0][i]) * (own[0] * by);
            }
        }
        // By the damping numbers: the derivatives of the factors times the sums above.
        let StepNumbers { times, branches: by_branches, scheme, .. } = &mut slopes.numbers;
        for (place, by) in times.iter_mut().chain([scheme]).enumerate() {
            let slope = self.form_slope(moment, place);
            let all = slope.all.iter().zip(sums);
            let own = slope.own.as_flattened().iter().zip(own_sums.as_flattened());
            *by += all.map(|(a, b)| a * b).sum::<f64>();
            *by += own.map(|(a, b)| a * b).sum::<f64>();
        }
        let stretches = self.past(moment).branches();
        for ((branch, by), z0) in branches.iter().zip(by_branches).zip(stretches) {
            let stretch: f64 = z0.iter().zip(&*by_strain).map(|(x, by)| x * by).sum();
            let along =
                |[change, spring]: [f64; 2]| change * sums[0] - change * sums[1] + spring * stretch;
            by.stiffness += along(branch.by_stiffness(moment));
            by.time += along(branch.by_time(moment));
        }
    }

    /// Transpose of [`advance_history`](Self::advance_history) without friction. The derivatives of a misfit by the
    /// internal variables at the end of the step are replaced by those at its start. The parts by unknowns and frames
    /// at the end are added to `state`, those by rest lengths and relaxation time to `slopes`. `room.by_strain` has
    /// those by the strains of the end.
    pub fn history_transposed(
        &self,
        state: &mut StateRates<1>,
        slopes: &mut ParameterSlopes,
        room: &mut HistoryWorkspace<1>,
    ) {
        let (before, now) = (&self.step.before.internal, &self.step.after.internal);
        let InternalVariables { strain, strain_rate, relaxing, .. } = &mut state.internal;
        let HistoryWorkspace { branches, by_strain, .. } = room;
        self.set_branches(branches);
        let count = now.strain.len();
        // The start takes back the part of a strain's change over the step.
        for i in 0..count {
            by_strain[i] = strain_rate[i].0[0] / self.nodal.h();
        }
        let lists = relaxing.chunks_exact_mut(count.max(1)).zip(before.branches());
        let numbers = branches.iter().zip(&mut slopes.numbers.branches);
        for ((branch, by), (relaxing, z0)) in numbers.zip(lists) {
            let (BranchRelaxation { left, taken, .. }, mut sums) = (branch, [0.0; 2]);
            // z1 = left z0 + taken (s1 - s0), transposed.
            for (i, Directions([z])) in relaxing.iter_mut().enumerate() {
                by_strain[i] += taken.re * *z;
                sums[0] += z0[i] * *z;
                sums[1] += (now.strain[i] - before.strain[i]) * *z;
                *z *= left.re;
            }
            by.time += sums[0] * left.eps + sums[1] * taken.eps;
        }
        for i in 0..count {
            let by_change = by_strain[i];
            // The rate (s1 - s0)/h depends on both strains, with opposite signs.
            let by_end = strain[i].0[0] + by_change;
            (strain[i], strain_rate[i]) = (Directions([-by_change]), Directions::ZERO);
            by_strain[i] = by_end;
            if let Some(rest) = slopes.laws.rest.get_mut(i) {
                *rest -= (1.0 + now.strain[i]) * by_end;
            }
        }
        // What remains at the end of the step is a derivative by its strains: it goes on to
        // unknowns and frames.
        let (q, base) = (&self.step.after.q, &self.step.before.frames);
        let by_q = state.q.as_flattened_mut();
        let frames = &mut state.frames;
        add_by_strains(self.step.rod, self.step.end, q, base, by_strain, by_q, frames);
    }
}

/// Adds `(ds/dq)^T by_strain` to `by_q`, and the derivatives by turns of the frames to `by_frames`. `by_strain` are the
/// derivatives of a misfit by the strains, `q` the unknowns, `base` their reference frames, `geometry` that at `q`.
/// Method: the forces of stresses `by_strain`, divided by the rest length for stretching.
pub fn add_by_strains<R: Transposed>(
    rod: &R,
    geometry: &R::Geometry,
    q: &[f64],
    base: &R::Frames,
    by_strain: &[f64],
    by_q: &mut [f64],
    by_frames: &mut [FrameRate<1>],
) {
    // Strains of edges are not weighed with the length as axial forces are.
    let mut lengths = vec![1.0; by_strain.len()];
    rod.scale_edges_by_rest_length(&mut lengths);
    let stress: Vec<Directions<1>> =
        by_strain.iter().zip(lengths).map(|(by, length)| Directions([by / length])).collect();
    let mut out = vec![[0.0]; q.len()];
    R::stressed_rate(None, &stress, geometry, q, base, Derivatives::Hand, &mut out);
    let out = out.into_flattened();
    by_q.iter_mut().zip(&out).for_each(|(by, out)| *by += out);
    geometry.turn_frames(&out, by_frames);
}
