//! Derivatives of a step by parameters through loads in time, forward and transposed.
//!
//! The residual of a step has minus the mean forces times their factor. Both are evaluated over dual numbers along one
//! parameter: by forces and places of loads, gain, delay and numbers of signals, and the parameter of the scheme, on which
//! factor and interval depend. Forward, their derivatives are added to the right-hand sides. Transposed, the derivatives of
//! a misfit by the right-hand sides are multiplied with them, and summed over all steps for each parameter.

use crate::dynamics::linearization::Linearization;
use crate::rod::{Rod, TimedLoads, UnknownForce};
use num_dual::Dual64;

/// The loads in time with the derivative along one parameter.
#[derive(Clone)]
pub struct TimedLoadRates {
    loads: TimedLoads<Dual64>,
    /// The derivative of the parameter of the scheme.
    scheme: f64,
}

impl TimedLoadRates {
    /// Those of `loads`, with the derivative of the parameter of the `scheme`.
    pub fn new(loads: &TimedLoads<Dual64>, scheme: f64) -> Self {
        Self { loads: loads.clone(), scheme }
    }

    /// Calls `each(unknown, rate)` with the derivative of the mean force on an unknown times its factor, kg m, for each
    /// force over a step.
    pub fn for_each<R: Rod<f64>>(
        &self,
        step: &Linearization<'_, f64, R>,
        mut each: impl FnMut(usize, f64),
    ) {
        let coefficients = step.coefficients(Dual64::new(step.parameter, self.scheme));
        let [from, to] = coefficients.load_interval(step.before.time);
        for load in &self.loads.loads {
            let factor = coefficients.load_factor() * load.signal.mean(from, to);
            for UnknownForce { unknown, force } in &load.forces {
                if step.free.contains(unknown) {
                    each(*unknown, (factor * *force).eps);
                }
            }
        }
    }
}

/// A parameter with the derivative of a misfit through loads in time so far.
struct TimedParameter {
    parameter: usize,
    rates: TimedLoadRates,
    sum: f64,
}

/// Derivatives of a misfit by parameters through loads in time, for the adjoint method.
#[derive(Default)]
pub struct TimedLoadSlopes(Vec<TimedParameter>);

impl TimedLoadSlopes {
    /// Adds the parameter with this index.
    pub fn add(&mut self, parameter: usize, rates: TimedLoadRates) {
        self.0.push(TimedParameter { parameter, rates, sum: 0.0 });
    }

    /// Indices of the parameters, each with the derivative of the misfit through loads in time.
    pub fn sums(&self) -> impl Iterator<Item = (usize, f64)> {
        self.0.iter().map(|own| (own.parameter, own.sum))
    }

    /// Adds the derivatives over a step, from those of the misfit by the right-hand sides of its equations.
    pub fn transpose<R: Rod<f64>>(&mut self, step: &Linearization<'_, f64, R>, right: &[[f64; 1]]) {
        for TimedParameter { rates, sum, .. } in &mut self.0 {
            rates.for_each(step, |unknown, rate| *sum += right[unknown][0] * rate);
        }
    }
}
