//! A step of a solved simulation repeated over dual numbers, with the factors of the plain solution.
//!
//! The step equations `r(q, p) = 0` of a solution `q` in plain numbers have the derivatives `-(dr/dq)^-1 dr/dp`
//! (implicit function theorem). The residual over dual numbers at `q` contains `dr/dp` times the derivatives of numbers
//! and start. One correction per order of derivatives, with the plain factors of `dr/dq`, gives the unknowns with their
//! derivatives. Neither tangent nor factors over dual numbers are needed. The values of the unknowns stay those of `q`:
//! corrected values would be those of another motion than the one that the factors belong to. The two would diverge
//! where stiffnesses differ by orders of magnitude.

use crate::dynamics::step::{Step, Work};
use crate::dynamics::stepper::newton::Newton;
use crate::numerics::scalar::RodScalar;
use crate::numerics::tangent::Factors;
use crate::rod::{Rod, State};

impl<D: RodScalar, R: Rod<D>> Newton<D, R> {
    /// Overwrites `state` with the unknowns and forces at the end of a step from `before`, with their derivatives.
    /// `solved` are the unknowns at the end of the same step in plain numbers, and `plain` is its solver, with the
    /// factors at that solution. `work` counts one gradient per order of derivatives. It does not fail.
    pub fn repeat<P: Rod<f64>>(
        &mut self,
        step: &Step<'_, D, R>,
        before: &State<D, R::Frames>,
        state: &mut State<D, R::Frames>,
        plain: &Newton<f64, P>,
        solved: &[f64],
        work: &mut Work,
    ) {
        self.begin(step, before);
        self.predictor.predict_steadily(step, before, state);
        for i in step.system.free.clone() {
            if !step.system.prescribed.contains(i) {
                state.q[i] = D::from(solved[i]);
            }
        }
        let by_end = self.coefficients.end.recip();
        for _ in 0..D::ORDER.max(1) {
            self.evaluate(step, before, state, false, work);
            self.residual(step, before, state);
            // The forces at the end, by the linear system: its matrix is M + end dn1/dq1.
            for i in step.system.free.clone() {
                state.unbalanced[i] += self.correction[i] * by_end;
            }
            plain.factors.solve(&mut self.correction);
            for correction in &mut self.correction {
                let value = correction.value();
                *correction -= value;
            }
            step.system.rod.convert_correction(&state.q, &state.frames, &mut self.correction);
            for i in step.system.free.clone() {
                let correction = self.correction[i];
                state.q[i] += correction;
                state.unbalanced[i] -= step.system.rod.mass()[i] * correction * by_end;
            }
        }
    }
}
