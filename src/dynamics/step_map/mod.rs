//! The derivative of an implicit time step as a linear map, and its transpose.
//!
//! A converged step satisfies `R(q1; q0, v0, a0, n0, p) = 0`, with unknowns `q`, velocities `v`, accelerations `a`,
//! forces `n` and parameters `p`. Forward, for sensitivities: `J dq1 = -dR|q1` with the tangent `J` of the step at
//! its solution. The derivatives of velocities, forces and internal variables follow from `dq1`. Transposed, for
//! the adjoint: the derivatives of a misfit by the state at the end become those by the state at the start, in
//! reverse order of the operations. `J` is symmetric, so that its factors solve both.
//!
//! One description serves both directions: the factors of the [equations of every unknown](nodal), the [effective
//! strains of the history](history), and the rod's products with the derivatives of strains.
//!
//! Input: a linearized step ([`Linearization`]). [`StepMap`] is the map; its arguments
//! and results are [`StateRates`], with [`ParameterRates`] forward and [`ParameterSlopes`] transposed (`rates`). The
//! forward map is in `forward_derivatives`, its transpose in `transposed`, with `drag`, `timed_loads` and `supports`;
//! `numbers` lists the numbers of damping and scheme, `workspace` has reusable lists. An inaccurate solution with an
//! indefinite matrix is [`Error::SingularTangent`](crate::Error::SingularTangent).

mod branch_relaxation;
mod drag;
mod forward_derivatives;
mod history;
mod nodal;
mod numbers;
mod rates;
mod supports;
mod timed_loads;
mod transposed;
mod workspace;

pub use history::add_by_strains;
pub use rates::{DualSimulation, ParameterRates, ParameterSlopes, StateRates};
pub use supports::MovingSupports;
pub use timed_loads::{TimedLoadRates, TimedLoadSlopes};
pub use workspace::StepWorkspace;

use crate::dynamics::linearization::Linearization;
use crate::dynamics::step_map::nodal::{NodalEquations, StepMotion};
use crate::rod::{ForwardSensitivity, FrameRate, Rod};
use num_dual::Dual64;
use std::ops::Range;

/// A linearized step with the factors of its equations, ready to be applied to derivatives.
pub struct StepMap<'a, R: Rod<f64>> {
    /// States, tangents and factors of the step.
    step: &'a Linearization<'a, f64, R>,
    /// Equations of each unknown.
    nodal: NodalEquations,
    /// Whether the forces are an average over the step.
    averages: bool,
    /// Transposed map only: whether kinds of strain have, or could have, damping times of their own.
    has_own_times: bool,
    /// Transposed map only: zero derivatives of the frames.
    still: Vec<FrameRate<1>>,
}

impl<'a, R: ForwardSensitivity> StepMap<'a, R> {
    /// The map of a `step` for forward use: its linearization, the factors of its equations, and their derivatives by
    /// the scheme's parameter. [`transposed`](Self::transposed) makes the map for the adjoint.
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

    /// The indices of the unknowns outside the free range: those that supports hold.
    fn fixed(&self) -> impl Iterator<Item = usize> + use<R> {
        let (count, Range { start, end }) = (self.step.after.q.len(), self.step.free.clone());
        (0..start).chain(end..count)
    }

    /// Of unknown `i`: change over the step, m, velocity, m/s, and acceleration, m/s^2, at the start; zero acceleration
    /// for schemes without.
    #[inline(always)]
    fn step_motion(&self, i: usize) -> StepMotion {
        let (before, now) = (self.step.before, self.step.after);
        let a0 = before.acceleration.get(i).copied().unwrap_or(0.0);
        [now.q[i] - before.q[i], before.v[i], a0]
    }
}
