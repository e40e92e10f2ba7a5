//! Newton's iteration until the residual is a rounding error: for averaging schemes, dual numbers and the tolerance
//! `rounding`.
//!
//! Input: the state before the step and the predicted one. Output: the corrected unknowns, with a new tangent in each
//! iteration. The rounding level of a residual (kg m) is [`ROUNDING`] times `eps` times the sum of the absolute values
//! of its terms. The iteration ends when all residuals are at most at their levels, and the last correction was at most
//! `LAST_STEP` rod lengths, or at least half of the one before. It also ends after a correction of at most
//! [`SMALLEST_STEP`] rod lengths. Dual numbers get one more correction per order of derivatives. With kept tangents the
//! step is linearized at the solution. `solve_to_rounding` is the iteration, `set_rounding` overwrites the rounding
//! levels, and `largest_residual` returns the largest residual with its level, and whether all are at theirs. Errors:
//! no convergence within `MAX_ITERATIONS`, a residual that is not finite, or a zero pivot.

use crate::dynamics::linearization::StageForces;
use crate::dynamics::step::{Step, Work};
use crate::dynamics::stepper::newton::{MAX_ITERATIONS, Newton};
use crate::error::Error;
use crate::numerics::scalar::RodScalar;
use crate::numerics::tangent::Tangent;
use crate::rod::{Rod, State};
use std::ops::Range;

/// A residual counts as rounding below this many times `eps * sum |J_ij| |x_j|`: coordinates are stored to `eps/2`, and
/// strains formed from them have a few rounding errors more.
const ROUNDING: f64 = 8.0;
/// A correction below this fraction of the rod's length ends the iteration: it is a rounding error of coordinates.
const SMALLEST_STEP: f64 = 1e-12;
/// After a correction below this fraction of the rod's length the next iterate is expected to be the solution. Its
/// tangent is formed only if it is not: convergence is quadratic.
const LAST_STEP: f64 = 1e-8;

impl<D: RodScalar, R: Rod<D>> Newton<D, R> {
    /// Corrects the unknowns of `state`, with a new tangent in each iteration. It ends when all residuals are at their
    /// rounding levels, and the last correction was at most [`LAST_STEP`] lengths of the rod, or at least half of the
    /// one before. It also ends after a correction of at most [`SMALLEST_STEP`] lengths. Numbers that carry derivatives
    /// get one more correction per order. With kept tangents the step is linearized at the solution. [`Error::Newton`]
    /// after [`MAX_ITERATIONS`] corrections, or if the residual is not finite; [`Error::SingularTangent`] for a zero
    /// pivot.
    pub(super) fn solve_to_rounding(
        &mut self,
        step: &Step<'_, D, R>,
        before: &State<D, R::Frames>,
        state: &mut State<D, R::Frames>,
        work: &mut Work,
    ) -> Result<(), Error> {
        self.tensions.forget();
        let (mut largest, mut shrinks) = (f64::INFINITY, true);
        let mut last = false;
        let mut polish = D::ORDER;
        for iteration in 0..=MAX_ITERATIONS + D::ORDER {
            // Near the solution a tangent is likely to be the last one: it is formed only if
            // needed.
            let close = largest <= LAST_STEP * self.length;
            let with_tangent = !close || self.keeps_tangent;
            self.evaluate(step, before, state, with_tangent, work);
            // The rounding level depends on the size of the unknowns, which the iteration changes
            // little.
            if iteration == 0 {
                self.set_rounding(step, state);
            }
            self.residual(step, before, state);
            let (residual, tolerance, at_rounding) =
                self.largest_residual(step.system.free.clone());
            if !residual.is_finite() || (iteration >= MAX_ITERATIONS && !last && !at_rounding) {
                let (time, iterations) = (step.time, iteration);
                return Err(Error::Newton { time, iterations, residual, tolerance });
            }
            // In soft rods with many edges, rounding errors may hide the error of a large correction.
            let settled = close || !shrinks || iteration >= MAX_ITERATIONS;
            // After a correction below the smallest step, or at the rounding level.
            let done = last || (at_rounding && settled);
            if done && polish == 0 {
                if self.keeps_tangent {
                    if !with_tangent {
                        self.evaluate(step, before, state, true, work);
                    }
                    // Derivatives along parameters need the geometry at the solution, in plain
                    // numbers.
                    if D::PLAIN {
                        let rod = &step.system.rod;
                        rod.measure(&state.q, &state.frames, &mut self.end);
                        for StageForces { q, geometry, .. } in &mut self.stages {
                            rod.measure(q, &state.frames, geometry);
                        }
                    }
                    self.factor(step, work)?;
                }
                return Ok(());
            }
            // Each order of derivatives converges one iteration after the values.
            polish -= usize::from(done);

            if !with_tangent {
                self.evaluate(step, before, state, true, work);
            }
            self.factor(step, work)?;
            let [moved, turned] = self.correct(step, state, work);
            let size = moved.max(turned);
            (largest, shrinks) = (size, size < 0.5 * largest);
            last = done || largest <= SMALLEST_STEP * self.length;
        }
        unreachable!("the last iteration returns")
    }

    /// Overwrites the rounding level of each residual, kg m: [`ROUNDING`] times `eps` times `end (|K| |q|)_i + m_i
    /// |q_i|`, from the last tangent and the unknowns of `state`.
    pub(super) fn set_rounding(&mut self, step: &Step<'_, D, R>, state: &State<D, R::Frames>) {
        let matrix =
            self.drag_forces.as_ref().map_or(&self.tangent, |drag_forces| &drag_forces.matrix);
        // Sum of |J_ij| |x_j|: the terms whose rounding errors the residual contains.
        matrix.absolute_product(&state.q, &mut self.rounding);
        let end = self.coefficients.end.value();
        let masses = step.system.rod.mass().iter().zip(&state.q);
        for (level, (mass, q)) in self.rounding.iter_mut().zip(masses) {
            *level = ROUNDING * f64::EPSILON * (end * *level + mass.value() * q.value().abs());
        }
    }

    /// The largest absolute residual of the unknowns in `free`, kg m, the rounding level of that unknown, and whether
    /// all residuals are at or below theirs. A residual that is NaN counts as the largest.
    pub(super) fn largest_residual(&self, free: Range<usize>) -> (f64, f64, bool) {
        let (mut largest, mut level, mut at_rounding) = (0.0_f64, 0.0, true);
        for (residual, rounding) in self.correction[free.clone()].iter().zip(&self.rounding[free]) {
            let size = residual.value().abs();
            at_rounding &= size <= *rounding;
            if size > largest || size.is_nan() {
                (largest, level) = (size, *rounding);
            }
        }
        (largest, level, at_rounding)
    }
}
