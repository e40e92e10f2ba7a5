//! Linearization of an earlier step from the states before and after it, without solving the step again.
//!
//! Input: the equations of motion and both states. Output: coefficients, tangent, factors and geometry of the
//! Newton solver are overwritten by those at the state after the step. Counts of work are increased. On request the
//! tangent of a viscous rod's forces at the start of the next step is computed too. A zero pivot is an error. The
//! adjoint and the derivatives on a second thread store states only, and linearize each step with this. Averaging
//! schemes are excluded, as their stages are not stored.

use crate::dynamics::step::{Step, System, Work};
use crate::dynamics::stepper::newton::Newton;
use crate::error::Error;
use crate::numerics::scalar::RodScalar;
use crate::rod::{Rod, State};

impl<D: RodScalar, R: Rod<D>> Newton<D, R> {
    /// Overwrites coefficients, tangents and factors of the solver with those of a step from `before` to `after`, as
    /// a step with [kept tangents](Self::keep_tangent) does, and adds counts to `work`. Averaging schemes are
    /// excluded: their stages are not evaluated. A zero pivot is [`Error::SingularTangent`].
    pub fn linearize(
        &mut self,
        system: &System<D, R>,
        before: &State<D, R::Frames>,
        after: &State<D, R::Frames>,
        work: &mut Work,
    ) -> Result<(), Error> {
        let step = Step { system, time: after.time, h: after.time - before.time };
        self.begin(&step, before);
        self.linearize_at(&step, before, after, work)?;
        if !self.keeps_next {
            return Ok(());
        }
        // Only the gradient and tangent that this stores are used; the list of forces is any of the
        // right length.
        let mut forces = std::mem::take(&mut self.correction);
        self.find_viscous(system, &after.internal, &after.q, &before.frames, &mut forces);
        self.correction = forces;
        work.tangents += usize::from(self.viscous.is_some());
        Ok(())
    }
}
