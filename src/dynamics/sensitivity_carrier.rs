//! Derivatives of a run: computed by the thread that makes the steps, or by another one to which the steps are sent.
//!
//! [`SensitivityCarrier`] gives the main loop of a run the same three operations for both. They make a step of the
//! simulation to a time (`step_to`, s), undo it (`step_back`), and advance the derivatives over an accepted one
//! (`advance`).
//!
//! On the same thread there are three methods. Steps of Newmark-beta and generalised-alpha are in general linearized
//! again by a second simulation, from the states before and after the step. The other thread does the same, so that
//! both results are bitwise equal. Steps of the average vector field are linearized at their solution, with the
//! tangents of their stages. Steps of explicit and linearly implicit schemes, and those that
//! [need dual steps](Simulation::needs_dual_steps), are made in dual numbers, and the plain state is taken from them.
//!
//! Only the first method may use the other thread. Advancing then sends the state at the end of the step, in batches,
//! and waits while too many batches wait. Errors are those of steps and linear systems, and [`Error::Interrupted`] if
//! the other thread has ended; its own error has the reason.

use crate::dynamics::sensitivity::Sensitivities;
use crate::dynamics::sensitivity_pipeline::StepProducer;
use crate::dynamics::simulation::Simulation;
use crate::error::Error;
use crate::rod::ForwardSensitivity;

/// The derivatives of a running simulation, or the producer that sends its steps to another thread.
pub(super) enum SensitivityCarrier<R: ForwardSensitivity> {
    /// Derivatives after every accepted step, on the same thread.
    Synchronous {
        sensitivities: Sensitivities<R>,
        /// The simulation that linearizes accepted steps again, for schemes where states at both ends suffice.
        relinearized: Option<Box<Simulation<f64, R>>>,
    },
    /// Accepted steps are sent to the thread that computes derivatives.
    Asynchronous(StepProducer<R>),
}

impl<R: ForwardSensitivity> SensitivityCarrier<R> {
    /// Makes a step of `simulation` to `time`, s. If derivatives come from dual simulations, the first of them makes
    /// it, and `simulation` takes over its state. Errors are those of the step; the state is then the one before it.
    pub fn step_to(&mut self, simulation: &mut Simulation<f64, R>, time: f64) -> Result<(), Error> {
        match self {
            Self::Synchronous { sensitivities, .. } => sensitivities.step_to(simulation, time),
            // The other thread linearizes the step from its states: the step itself needs no
            // derivatives.
            Self::Asynchronous(_) => simulation.step_to(time),
        }
    }

    /// Undoes the last step of `simulation`, and of the dual simulation that made it, if there is one.
    pub fn step_back(&mut self, simulation: &mut Simulation<f64, R>) {
        match self {
            Self::Synchronous { sensitivities, .. } => sensitivities.step_back(simulation),
            Self::Asynchronous(_) => simulation.step_back(),
        }
    }

    /// Advances the derivatives over the last accepted step of `simulation`: by its linearization, by a step of the
    /// other dual simulations, or by sending the step to the other thread. Errors: [`Error::SingularTangent`], those of
    /// steps in dual numbers, and [`Error::Interrupted`] if the other thread has ended.
    pub fn advance(&mut self, simulation: &Simulation<f64, R>) -> Result<(), Error> {
        match self {
            Self::Synchronous { sensitivities, relinearized: None } => {
                sensitivities.advance(simulation)
            }
            // The same linearization as on a second thread, so that both results are bitwise equal.
            Self::Synchronous { sensitivities, relinearized: Some(linear) } => {
                let step = linear.linearized(simulation.previous(), simulation.state())?;
                step.map_or(Ok(()), |step| sensitivities.advance_over(&step))
            }
            Self::Asynchronous(producer) => producer.push(simulation),
        }
    }
}
