//! What damps strains over a step: Kelvin-Voigt stress and relaxation.
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
//! so that the branch adds `g w` to the factor of the stiffness and `g (w s0 - e^(-h/tau) z0)` to the shift.

use crate::dynamics::coefficients::StepCoefficients;
use crate::numerics::decay::mean_decay;
use crate::numerics::scalar::Scalar;
use crate::rod::{InternalVariables, Viscosity};
use crate::scene::{Damping, Maxwell};

/// What is left of `z0` after a step of length `h`, s, and what a change of the strain adds.
fn relaxation<D: Scalar>(maxwell: &Maxwell<D>, h: f64) -> [D; 2] {
    let x = maxwell.time.recip() * h;
    [(-x).exp(), mean_decay(x)]
}

/// The stress at the end of a step that began with `before`.
pub fn at_end<D: Scalar>(
    coefficients: &StepCoefficients<D>,
    damping: &Damping<D>,
    before: &InternalVariables<D>,
    viscosity: &mut Viscosity<D>,
) {
    let InternalVariables { strain, strain_rate, relaxing, .. } = before;
    let Viscosity { factor, shift, own } = viscosity;
    let starts = strain.iter().zip(strain_rate);
    if coefficients.averages() {
        // Of the dashpots alone, whose natural strains are the same whatever their time.
        *factor = coefficients.viscous_factor(damping.stiffness);
        let by_rate = coefficients.rate.recip();
        for (shift, (strain, rate)) in shift.iter_mut().zip(starts) {
            *shift = coefficients.viscous_past(*strain, *rate) * by_rate;
        }
        if let Some(own) = own {
            own.factor = damping.own_times().map(|time| coefficients.viscous_factor(time));
        }
        return;
    }
    *factor = coefficients.viscous_factor(damping.stiffness);
    for (shift, (strain, rate)) in shift.iter_mut().zip(starts.clone()) {
        *shift = damping.stiffness * coefficients.viscous_past(*strain, *rate);
    }
    if let Some(own) = own {
        own.time = damping.own_times();
        own.factor = own.time.map(|time| coefficients.viscous_factor(time) - 1.0);
        for (past, (strain, rate)) in own.past.iter_mut().zip(starts) {
            *past = coefficients.viscous_past(*strain, *rate);
        }
    }
    if let Some(maxwell) = &damping.maxwell {
        let [left, taken] = relaxation(maxwell, coefficients.h).map(|x| maxwell.stiffness * x);
        *factor += taken;
        for (shift, (strain, z)) in shift.iter_mut().zip(strain.iter().zip(relaxing)) {
            *shift += taken * *strain - left * *z;
        }
    }
}

/// The stress at the start of a step, where the rates are known.
pub fn at_start<D: Scalar>(
    coefficients: &StepCoefficients<D>,
    damping: &Damping<D>,
    now: &InternalVariables<D>,
    viscosity: &mut Viscosity<D>,
) {
    viscosity.now(damping, now);
    if coefficients.averages() {
        // Of the dashpots alone, and an average counts both ends by half.
        for (shift, strain) in viscosity.shift.iter_mut().zip(&now.strain) {
            *shift = *shift * 0.5 + *strain;
        }
        viscosity.own.iter_mut().for_each(|own| own.time = own.time.map(|time| time * 0.5));
    }
}

/// Writes how far the springs of the Maxwell branch are stretched after a step of length `h`, s, to these strains.
pub fn relax<D: Scalar>(
    damping: &Damping<D>,
    h: f64,
    before: &InternalVariables<D>,
    strains: &[D],
    z: &mut Vec<D>,
) {
    z.clear();
    let Some(maxwell) = &damping.maxwell else { return };
    let [left, taken] = relaxation(maxwell, h);
    let changes = strains.iter().zip(&before.strain).map(|(now, then)| *now - *then);
    z.extend(before.relaxing.iter().zip(changes).map(|(z, change)| *z * left + change * taken));
}
