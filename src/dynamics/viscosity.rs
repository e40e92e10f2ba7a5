//! Viscous stress over a step: Kelvin-Voigt damping and relaxation.
//!
//! [Kelvin-Voigt stress](crate::dynamics::coefficients) is `K eta ds/dt`, with a time `eta` for all strains and
//! one more for each kind of them.
//!
//! A Maxwell branch is a spring of the stiffness `g K` in series with a dashpot, both of the whole rod's
//! form: its stress is `g K z`, and `dz/dt = ds/dt - z/tau`. For a strain that changes evenly over a
//! step of length `h` that is, exactly,
//!
//! ```text
//! z1 = z0 e^(-h/tau) + (s1 - s0) w,    w = (1 - e^(-h/tau)) tau/h
//! ```
//!
//! so that the branch adds `g w` to the factor of the stiffness and `g (w s0 - e^(-h/tau) z0)` to the shift. Several
//! branches add their parts: a Prony series.
//!
//! Input: coefficients of the step, damping (times in s), and strains, mean strain rates and spring stretches at its
//! start. Output: a [`Viscosity`] (factors of the stiffnesses and shifts of the natural strains) for the end of a step
//! ([`at_end`]) or for its start ([`at_start`]), from which the laws follow. [`relax`] returns the stretches of the
//! Maxwell springs after the step, by the factors `[e^(-h/tau), w]` of `relaxation`. Averaging schemes have the viscous
//! stress apart from the elastic one, half of it at each end, and no Maxwell branches.

use crate::dynamics::coefficients::StepCoefficients;
use crate::numerics::phi_function::phi1;
use crate::numerics::scalar::Scalar;
use crate::numerics::vector::map_components;
use crate::rod::{InternalVariables, Viscosity};
use crate::scene::{Damping, Maxwell};

/// The factors `[e^(-h/tau), w]` in the stretch of a Maxwell spring at the end of a step of length `h`, s: of its
/// stretch `z0` at the start, and of the change of its strain.
pub fn relaxation<D: Scalar>(maxwell: &Maxwell<D>, h: f64) -> [D; 2] {
    let x = maxwell.time.recip() * h;
    [(-x).exp(), phi1(x)]
}

/// Coefficients of the effective strain at one moment, from a strain `s` there. `s0` and `r0` are the strain before and
/// its mean rate over the step before, 1/s. The stress is that of the elastic rod at `factor s - strain s0 - rate r0`
/// plus the stretch of every Maxwell spring times its factor, which is no part of these. For each of stretching,
/// bending and twisting `own_factor s - time (past[0] s0 + past[1] r0)` is added.
#[derive(Clone, Copy, Debug)]
pub struct EffectiveStrainFactors<D> {
    /// Factor of the strain `s`.
    pub factor: D,
    /// Factor of the strain before.
    pub strain: D,
    /// Factor of its rate before, s.
    pub rate: D,
    /// Factors of strain, 1/s, and rate before in minus the rate of strain.
    pub past: [D; 2],
    /// Factor of `s` of each kind with a time of its own.
    pub own_factor: [D; 3],
    /// Time of each kind, s.
    pub time: [D; 3],
}

impl<D: Scalar> EffectiveStrainFactors<D> {
    /// The factors of the stress at the end of a step that began with `s0` and `r0`. `taken` is the sum of `g w` of the
    /// Maxwell branches. Those of an averaging scheme are for the viscous stress alone, with half of the damping times.
    pub fn at_end(coefficients: &StepCoefficients<D>, damping: &Damping<D>, taken: D) -> Self {
        let part = if coefficients.averages() { 0.5 } else { 1.0 };
        let past = [(1.0, 0.0), (0.0, 1.0)]
            .map(|(strain, rate)| coefficients.viscous_past(D::from(strain), D::from(rate)));
        let (eta, time) = (
            damping.stiffness * part,
            map_components(&damping.additional_times(), |time| time * part),
        );
        let own_factor = map_components(&time, |time| time * past[0]);
        Self {
            factor: coefficients.viscous_factor(damping.stiffness) + taken,
            strain: eta * past[0] + taken,
            rate: eta * past[1],
            past,
            own_factor,
            time,
        }
    }

    /// The factors of the whole stress, elastic and viscous, at the start of a step: `factor` is 1, for the strain `s0`
    /// there, and `strain` is zero. `r0` is its mean rate over the step before.
    /// For an averaging scheme they are those of half of the viscous stress, without the elastic one: `factor` is zero.
    pub fn at_start(coefficients: &StepCoefficients<D>, damping: &Damping<D>) -> Self {
        let zero = D::from(0.0);
        // An average counts both ends by half.
        let part = if coefficients.averages() { 0.5 } else { 1.0 };
        Self {
            factor: D::from(if coefficients.averages() { 0.0 } else { 1.0 }),
            strain: zero,
            rate: -(damping.stiffness * part),
            past: [zero, D::from(-1.0)],
            own_factor: [zero; 3],
            time: map_components(&damping.additional_times(), |time| time * part),
        }
    }
}

/// Overwrites `viscosity` with the stress at the end of a step that began with the internal variables `before`: a
/// factor of the stiffnesses, and shifts of the natural strains. A shift is `eta p`, plus `g (w s0 - e^(-h/tau) z0)` of
/// every Maxwell branch, with the [past](StepCoefficients::viscous_past) `p` of its strain. If `viscosity.own` is
/// present, it gets the factors of strains with a time of their kind, and `p`. For averaging schemes it is the stress
/// of dashpots alone: factors have half of the damping times, and shifts are `p` over the rate coefficient.
pub fn at_end<D: Scalar>(
    coefficients: &StepCoefficients<D>,
    damping: &Damping<D>,
    before: &InternalVariables<D>,
    viscosity: &mut Viscosity<D>,
) {
    let InternalVariables { strain, strain_rate, .. } = before;
    let Viscosity { factor, shift, elastic_shift, own } = viscosity;
    elastic_shift.clear();
    // The stress that remains of the Maxwell springs' stretches at the start, and the factor of the strain's change.
    let (branches, mut taken) = (damping.maxwell.as_slice(), D::from(0.0));
    for (k, (branch, stretches)) in branches.iter().zip(before.branches()).enumerate() {
        let [left, part] = relaxation(branch, coefficients.h).map(|x| branch.stiffness * x);
        let relaxing = -left;
        taken += part;
        if k == 0 {
            shift.iter_mut().zip(stretches).for_each(|(shift, z)| *shift = relaxing * *z);
        } else {
            shift.iter_mut().zip(stretches).for_each(|(shift, z)| *shift += relaxing * *z);
        }
    }
    let factors = EffectiveStrainFactors::at_end(coefficients, damping, taken);
    let starts = strain.iter().zip(strain_rate);
    let past = |strain: &D, rate: &D| factors.past[0] * *strain + factors.past[1] * *rate;
    *factor = factors.factor;
    if coefficients.averages() {
        // Of the dashpots alone, whose natural strains are the same whatever their time.
        let by_rate = coefficients.rate.recip();
        for (shift, (strain, rate)) in shift.iter_mut().zip(starts) {
            *shift = past(strain, rate) * by_rate;
        }
        if let Some(own) = own {
            own.factor = factors.own_factor;
        }
        return;
    }
    // Kelvin-Voigt stress and the strain at the start as shifts of the natural strains, then kinds with their own time.
    if branches.is_empty() {
        for (shift, (strain, rate)) in shift.iter_mut().zip(starts.clone()) {
            *shift = factors.strain * *strain + factors.rate * *rate;
        }
    } else {
        for (shift, (strain, rate)) in shift.iter_mut().zip(starts.clone()) {
            *shift += factors.strain * *strain + factors.rate * *rate;
        }
    }
    if let Some(own) = own {
        (own.factor, own.time) = (factors.own_factor, factors.time);
        own.rate = factors.past[0];
        for (to, (strain, rate)) in own.past.iter_mut().zip(starts) {
            *to = past(strain, rate);
        }
    }
}

/// Overwrites `viscosity` with the stress at the start of a step, from strain rates and spring stretches in `now`. For
/// averaging schemes it is half of the viscous stress of dashpots alone, `K eta r/2` with the strain rate `r`: each
/// shift is the strain less `eta r/2`, and times of single kinds are halved.
pub fn at_start<D: Scalar>(
    coefficients: &StepCoefficients<D>,
    damping: &Damping<D>,
    now: &InternalVariables<D>,
    viscosity: &mut Viscosity<D>,
) {
    viscosity.now(damping, now);
    if coefficients.averages() {
        // Of the dashpots alone, and an average counts both ends by half.
        viscosity.elastic_shift.clone_from(&now.strain);
        for (shift, strain) in viscosity.shift.iter_mut().zip(&now.strain) {
            *shift = *shift * 0.5 + *strain;
        }
        viscosity.own.iter_mut().for_each(|own| own.time = own.time.map(|time| time * 0.5));
    }
}

/// Overwrites `z` with the stretches of the Maxwell springs after a step of length `h`, s, from the internal
/// variables `before` to these `strains`: `z0 e^(-h/tau) + (s1 - s0) w`, branch after branch. Empty without any.
pub fn relax<D: Scalar>(
    damping: &Damping<D>,
    h: f64,
    before: &InternalVariables<D>,
    strains: &[D],
    z: &mut Vec<D>,
) {
    z.clone_from(&before.relaxing);
    let lists = z.chunks_exact_mut(strains.len().max(1));
    for (branch, z) in damping.maxwell.as_slice().iter().zip(lists) {
        let [left, taken] = relaxation(branch, h);
        for (z, (now, then)) in z.iter_mut().zip(strains.iter().zip(&before.strain)) {
            *z = *z * left + (*now - *then) * taken;
        }
    }
}
