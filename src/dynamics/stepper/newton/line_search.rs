//! Newton's iteration with a line search, for steps with friction or damping of contacts in which full corrections
//! do not converge.
//!
//! Coulomb's friction is steep up to the slip velocity and constant beyond. Full corrections may then alternate between
//! two directions of slip. Here a correction is halved until the sum `r_i^2/m_i` of the squared residuals (kg m) over
//! the masses decreases (Armijo's condition; Nocedal and Wright 2006, Numerical Optimization, chapter 11).
//!
//! Input: a step, and the state before it. Output: `approach_solution` overwrites the state with iterates from constant
//! velocities, until a full correction is below [`NEAR`] rod lengths, [`MOST_CORRECTIONS`] have been made, or no part
//! of a correction decreases the residuals. The usual iteration continues from there. A zero pivot is an error.

use crate::dynamics::step::{Step, Work};
use crate::dynamics::stepper::newton::Newton;
use crate::error::Error;
use crate::numerics::scalar::RodScalar;
use crate::rod::{Rod, State};

/// Largest number of corrections. Each may take one node from slip to stick or back.
const MOST_CORRECTIONS: usize = 100;
/// Largest number of halvings of a correction: smaller parts do not advance.
const MOST_HALVINGS: usize = 12;
/// Decrease of the sum of squares over that of its linear prediction, from which on a part is accepted.
const DECREASE: f64 = 1e-4;
/// Full correction, over the length of the rod, near which full corrections converge.
const NEAR: f64 = 1e-9;

impl<D: RodScalar, R: Rod<D>> Newton<D, R> {
    /// Overwrites `state` with an approximate solution of the step from `before`, by corrections from constant
    /// velocities, each by the largest of the parts 1, 1/2, 1/4, .. that decreases the residuals.
    /// [`Error::SingularTangent`] for a zero pivot.
    pub(super) fn approach_solution(
        &mut self,
        step: &Step<'_, D, R>,
        before: &State<D, R::Frames>,
        state: &mut State<D, R::Frames>,
        work: &mut Work,
    ) -> Result<(), Error> {
        self.predictor.predict_steadily(step, before, state);
        self.tensions.forget();
        let free = step.system.free.clone();
        let (mut start, mut correction) = (Vec::new(), Vec::new());
        for _ in 0..MOST_CORRECTIONS {
            self.evaluate(step, before, state, true, work);
            self.residual(step, before, state);
            let residuals = self.squared_residuals(step);
            self.factor(step, work)?;
            start.clone_from(&state.q);
            let [moved, turned] = self.correct(step, state, work);
            correction.clone_from(&self.correction);
            let (mut part, mut decreases) = (1.0, false);
            for _ in 0..MOST_HALVINGS {
                for i in free.clone() {
                    state.q[i] = start[i] + correction[i] * part;
                }
                self.slip_state.iter_mut().for_each(|slip_state| slip_state.is_current = false);
                self.evaluate(step, before, state, false, work);
                self.residual(step, before, state);
                decreases =
                    self.squared_residuals(step) <= (1.0 - 2.0 * DECREASE * part) * residuals;
                if decreases {
                    break;
                }
                part *= 0.5;
            }
            if !decreases || part == 1.0 && moved.max(turned) <= NEAR * self.length {
                return Ok(());
            }
        }
        Ok(())
    }

    /// The sum of the squares of the present residuals of the free unknowns, each over its mass, kg m^2.
    fn squared_residuals(&self, step: &Step<'_, D, R>) -> f64 {
        let free = step.system.free.clone();
        let masses = &step.system.rod.mass()[free.clone()];
        let square = |(r, m): (&D, &D)| r.value() * r.value() / m.value();
        self.correction[free].iter().zip(masses).map(square).sum()
    }
}
