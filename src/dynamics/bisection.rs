//! Bisection of rejected steps: a step that fails, or violates the limits of step control, is replaced by two steps
//! of half its size.
//!
//! [`advance`] makes a step to a time (s) through the trait [`BisectedSteps`], which simulations with or without
//! derivatives and assemblies of rods implement. Halving continues up to [`HALVINGS`] times. At the last halving
//! wider limits hold. Its error then ends the run, at the last valid state, which may be inside the step. The
//! limits of [`StepControl`] are those of the energy or, where supports or a flow do work, of the rotation of
//! edges; a step through an obstacle is rejected too. `accepted` is called once per accepted part of a step, for
//! example to advance derivatives; its error ends the run without halving.

use crate::dynamics::simulation::Simulation;
use crate::dynamics::step_control::{HALVINGS, StepControl};
use crate::error::Error;
use crate::rod::Rod;

/// A simulation whose steps can be undone, together with its derivatives.
pub(crate) trait BisectedSteps {
    /// The rod.
    type Rod: Rod<f64>;

    /// The simulation at its present state.
    fn simulation(&self) -> &Simulation<f64, Self::Rod>;

    /// Makes a trial step of the simulation to a time, s.
    ///
    /// # Errors
    /// Those of the step; the state is then the one before it.
    fn step_to(&mut self, time: f64) -> Result<(), Error>;

    /// Restores the state before the last trial step, whether it succeeded or failed.
    fn step_back(&mut self);

    /// Completes an accepted step, for example by advancing derivatives over it. Called once per accepted step, also
    /// for each half of a bisected one.
    ///
    /// # Errors
    /// Those of the derivatives; they end the run without bisection.
    fn accepted(&mut self) -> Result<(), Error>;

    /// The control of the steps (limits of energy or rotation), mutable, with the simulation.
    fn control(&mut self) -> (&mut StepControl, &Simulation<f64, Self::Rod>);
}

/// Advances to a time, s, in one step. If it fails or step control rejects it, it is replaced by two steps of half its
/// size, and so on, at most [`HALVINGS`] times. Each accepted step is completed by [`BisectedSteps::accepted`].
///
/// # Errors
/// The error of a step that fails, or that step control rejects, also at the last halving. The state is then the last
/// valid one, which may be inside the step. An error of [`BisectedSteps::accepted`] is returned at once, without
/// halving.
pub(crate) fn advance(steps: &mut impl BisectedSteps, time: f64) -> Result<(), Error> {
    advance_halved(steps, time, 0)
}

/// [`advance`] for a step that results from `halvings` halvings of a step of the scene. At [`HALVINGS`] the wider
/// limits of the last halving hold, and the step is not halved again: its error is returned, with the state before it
/// restored.
fn advance_halved(steps: &mut impl BisectedSteps, time: f64, halvings: u32) -> Result<(), Error> {
    let at_last = halvings == HALVINGS;
    // Trial step, and its energy.
    let stepped = steps.step_to(time).and_then(|()| {
        let (control, simulation) = steps.control();
        control.check(simulation, at_last)
    });
    match stepped {
        Ok(()) => {
            steps.control().0.accept();
            steps.accepted()
        }
        Err(error) => {
            steps.step_back();
            if at_last {
                return Err(error);
            }
            // Two halves instead.
            let middle = 0.5 * (steps.simulation().state().time + time);
            advance_halved(steps, middle, halvings + 1)?;
            advance_halved(steps, time, halvings + 1)
        }
    }
}
