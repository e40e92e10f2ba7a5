//! Loads in time in the equations of a step and in the accelerations at its start.
//!
//! A step has the mean forces (N) over its interval, the same at its start and its end, times the factors of both in the
//! residual. So a jump of a signal within the step enters by its exact impulse, and every scheme keeps its order. The
//! forces of the states before and after are those without loads in time.

use crate::dynamics::step::{Step, System};
use crate::dynamics::stepper::newton::Newton;
use crate::numerics::scalar::Nestable;
use crate::rod::{Rod, UnknownForce};

impl<D: Nestable, R: Rod<D>> Newton<D, R> {
    /// Adds the mean forces of loads in time to minus the residual, kg m, of free unknowns.
    #[inline(always)]
    pub(super) fn add_timed_forces(&mut self, step: &Step<'_, D, R>) {
        if self.timed_forces.is_empty() {
            return;
        }
        let factor = self.coefficients.load_factor();
        for UnknownForce { unknown, force } in &self.timed_forces {
            if step.system.free.contains(unknown) {
                self.correction[*unknown] += factor * *force;
            }
        }
    }
}

impl<D: Nestable, R: Rod<D>> Newton<D, R> {
    /// The work, J, of the loads in time in the equations of the last step, on the change of the unknowns from `before` to
    /// `now`. Those of generalised-alpha belong to a later interval than the step.
    pub fn timed_work(&self, [before, now]: [&[D]; 2]) -> f64 {
        let work = |own: &UnknownForce<D>| {
            own.force.value() * (now[own.unknown].value() - before[own.unknown].value())
        };
        self.timed_forces.iter().map(work).sum()
    }
}

/// Adds the forces of loads in time at the time `t`, s, times `sign`, to `forces`, N.
pub(super) fn add_timed_now<D: Nestable, R: Rod<D>>(
    system: &System<D, R>,
    t: f64,
    sign: f64,
    forces: &mut [D],
) {
    if system.timed_loads.is_empty() {
        return;
    }
    let mut timed = Vec::new();
    system.timed_loads.set_at(D::from(t), &mut timed);
    for UnknownForce { unknown, force } in timed {
        forces[unknown] += force * sign;
    }
}
