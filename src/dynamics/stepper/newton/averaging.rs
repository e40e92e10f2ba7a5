//! Forces and tangents of averaging schemes: the mean over the step by Gauss quadrature.
//!
//! Input: unknowns before the step and at the iterate. At each stage on the straight line between them the elastic
//! gradient less the loads, N, and its tangent, N/m, are evaluated. They include the mean moments of loads in time, and
//! are summed with the weights of the quadrature. A stage's tangent is also multiplied by its fraction of the way, as a
//! stage moves by that part of a change of the end. The viscous stress is added as one more stage at the end of the
//! step. Output: gradient and tangent of the Newton solver; the stages are kept for derivatives.

use crate::dynamics::coefficients::END;
use crate::dynamics::linearization::StageForces;
use crate::dynamics::step::Step;
use crate::dynamics::stepper::newton::Newton;
use crate::dynamics::stepper::newton::timed_forces::add_moments;
use crate::numerics::scalar::RodScalar;
use crate::numerics::tangent::Tangent;
use crate::rod::{Rod, State};

impl<D: RodScalar, R: Rod<D>> Newton<D, R> {
    /// Overwrites the solver's gradient and, if `with_tangent`, its tangent by the unknowns at the end. They are the
    /// mean over the straight line from `before` to the iterate `state`, plus the viscous forces at the end, if any.
    /// The values at the stages are stored in `stages`.
    pub(super) fn average(
        &mut self,
        step: &Step<'_, D, R>,
        before: &State<D, R::Frames>,
        state: &State<D, R::Frames>,
        with_tangent: bool,
    ) {
        let (n, coefficients) = (self.gradient.len(), &self.coefficients);
        // Work arrays of the stages, at the first step only.
        if self.stages.is_empty() {
            let q = vec![D::from(0.0); n];
            let (gradient, tangent) = (q.clone(), step.system.rod.zero_tangent());
            let forces = StageForces { q, gradient, tangent, geometry: R::Geometry::default() };
            let stages = coefficients.stages.len() + usize::from(self.viscous.is_some());
            self.stages = vec![forces; stages];
        }
        // Sums of the quadrature begin at zero.
        self.gradient.fill(D::from(0.0));
        if with_tangent {
            self.tangent.clear();
        }
        for (k, forces) in self.stages.iter_mut().enumerate() {
            // Stages of the quadrature have elastic forces; one more, at the end, has the viscous
            // stress.
            let (rod, stage) = match (coefficients.stages.get(k), &self.viscous) {
                (None, Some(viscous)) => (viscous, &END),
                (stage, _) => (&step.system.rod, stage.unwrap_or(&END)),
            };
            let StageForces { q, gradient, tangent, .. } = forces;
            for (q, (start, end)) in q.iter_mut().zip(before.q.iter().zip(&state.q)) {
                *q = *start + (*end - *start) * stage.place;
            }
            match with_tangent {
                true => {
                    rod.tangent(q, &state.frames, step.system.derivatives, gradient, tangent);
                    if k < coefficients.stages.len() {
                        add_moments(&self.timed_moments, q, gradient, Some(&mut *tangent));
                    }
                    // By the chain rule: a stage moves by its place for a unit displacement of
                    // the end.
                    self.tangent.add_scaled(tangent, stage.weight * stage.place);
                }
                false => {
                    rod.gradient(q, &state.frames, step.system.derivatives, gradient);
                    if k < coefficients.stages.len() {
                        add_moments(&self.timed_moments, q, gradient, None::<&mut R::Tangent>);
                    }
                }
            }
            for (sum, gradient) in self.gradient.iter_mut().zip(gradient) {
                *sum += *gradient * stage.weight;
            }
        }
    }
}
