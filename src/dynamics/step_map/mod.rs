//! The derivative of an implicit step as a linear map, and its transpose.
//!
//! A converged step satisfies `R(q1; q0, v0, a0, n0, p) = 0`. Derivatives along parameters go forward through it: with the
//! tangent `J` of the step at its solution, `J dq1 = -dR|q1`, and velocities, forces and internal variables follow from `dq1`. The
//! derivatives of a misfit by the state at the end go back through it, with the transposed operations in reverse order;
//! `J` is symmetric, so that its factors solve both. One description serves both directions: the factors of the
//! [equations of every unknown](nodal), the [forms of the strains' history](history), and the rod's products with the
//! derivatives of strains.

mod drag;
mod forward_derivatives;
mod history;
mod nodal;
mod numbers;
mod rates;
mod supports;
mod transposed;
mod workspace;

pub use history::add_by_strains;
pub use rates::{DualSimulation, ParameterRates, ParameterSlopes, StateRates};
pub use supports::MovingSupports;
pub use workspace::StepWorkspace;

use crate::dynamics::linearization::Linearization;
use crate::dynamics::step_map::nodal::{NodalEquations, StepMotion};
use crate::rod::{FrameRate, Rod, Sensitive};
use num_dual::Dual64;
use std::ops::Range;

/// A linearized step, ready to be applied to derivatives.
pub struct StepMap<'a, R: Rod<f64>> {
    step: &'a Linearization<'a, f64, R>,
    nodal: NodalEquations,
    /// Whether the forces are an average over the step.
    averages: bool,
    /// Backwards: whether kinds of strain have, or could have, damping times of their own; frames that do not move.
    has_own_times: bool,
    still: Vec<FrameRate<1>>,
}

impl<'a, R: Sensitive> StepMap<'a, R> {
    /// The derivative of a step.
    pub fn new(step: &'a Linearization<'a, f64, R>) -> Self {
        let coefficients = step.coefficients(step.parameter);
        let dual = step.coefficients(Dual64::new(step.parameter, 1.0));
        Self {
            nodal: NodalEquations::new(&coefficients, &dual, step.damping.mass),
            averages: coefficients.averages(),
            has_own_times: false,
            still: Vec::new(),
            step,
        }
    }

    /// The unknowns outside the free range.
    fn fixed(&self) -> impl Iterator<Item = usize> + use<R> {
        let (count, Range { start, end }) = (self.step.after.q.len(), self.step.free.clone());
        (0..start).chain(end..count)
    }

    /// The change of an unknown over the step, and its velocity and acceleration at the start.
    #[inline(always)]
    fn step_motion(&self, i: usize) -> StepMotion {
        let (before, now) = (self.step.before, self.step.after);
        let a0 = before.acceleration.get(i).copied().unwrap_or(0.0);
        [now.q[i] - before.q[i], before.v[i], a0]
    }
}
