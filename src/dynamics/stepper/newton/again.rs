//! A step that was solved before, linearized at its solution once more.

use crate::dynamics::coefficients::StepCoefficients;
use crate::dynamics::step::{Step, System, Work};
use crate::dynamics::stepper::newton::Newton;
use crate::error::Error;
use crate::numerics::scalar::Nestable;
use crate::rod::{Rod, State};

impl<D: Nestable, R: Rod<D>> Newton<D, R> {
    /// Leaves behind what a step from `before` to `after` with [kept tangents](Self::keep_tangent) does; not of
    /// averaging schemes, whose stages it does not visit.
    pub fn linearize(
        &mut self,
        system: &System<D, R>,
        before: &State<D, R::Frames>,
        after: &State<D, R::Frames>,
        work: &mut Work,
    ) -> Result<(), Error> {
        let step = Step { system, time: after.time, h: after.time - before.time };
        let knows_acceleration = !before.acceleration.is_empty();
        self.coefficients =
            StepCoefficients::new(self.scheme, self.parameter, knows_acceleration, step.h);
        self.set_viscous(&step, before);
        if let (Some(drag), Some(dragging)) = (&system.drag, &mut self.dragging) {
            dragging.begin(drag, before, step.h);
        }
        self.linearize_at(&step, before, after, work)?;
        let mut forces = std::mem::take(&mut self.correction);
        self.find_viscous(system, &after.internal, (&after.q, &before.frames), &mut forces);
        self.correction = forces;
        work.tangents += usize::from(self.viscous.is_some());
        Ok(())
    }
}
