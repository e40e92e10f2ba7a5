//! Time integration schemes, and the steppers that carry out their steps.
//!
//! | scheme | order | a step takes | keeps | for |
//! |---|---|---|---|---|
//! | [Newmark-beta](crate::dynamics::coefficients), 0.5 | 2 | 2 to 4 Newton iterations | energy to O(h^2), not for good | a per cent, Kelvin-Voigt damping |
//! | [generalised-alpha](crate::dynamics::coefficients#generalised-alpha), 0.5 | 2 | the same | energy roughly, and nothing that is too fast for the step | rods that hardly stretch, stiff damping, recorded ends |
//! | [average vector field](crate::dynamics::coefficients#average-vector-field) | 2 | the same, of four stages | energy exactly | long runs at large steps |
//! | [rodas4](rosenbrock) | 4 | 1 factorisation, 6 gradients | momentum | 1e-3 to 1e-5 of the length |
//! | [verlet](splitting) | 2 | 1 gradient | momenta, phase volume; it runs backwards | 1e-6 |
//! | [pefrl](splitting) | 4 | 4 gradients | likewise | 1e-8 |
//!
//! The last two are explicit: their steps must stay below [a limit of
//! stability](crate::Discretized::largest_step), 36 us and 54 us on the paper's cantilever, that goes
//! with the square of an edge. `rodfit study` finds the cheapest scheme, step and mesh for a scene;
//! `cargo run --release --example work_precision` compares them on one mesh.
//!
//! # Tried and dropped
//!
//! On the same kernels and meshes (50 segments, 1 s, largest tip error over length, ms in one run)
//! these were nowhere ahead of the schemes above by more than the noise:
//!
//! | scheme | cantilever: error, ms | helix: error, ms |
//! |---|---|---|
//! | *Newmark-beta 0.5* | 3.2e-4, 8.8; 1.1e-4, 17 | 2.1e-4, 57; 9.2e-5, 92 |
//! | *rodas4* | 1.4e-3, 2.6; 7.0e-5, 5.1; 6.7e-6, 13 | 1.3e-4, 29; 1.2e-5, 58; 1.9e-6, 114 |
//! | *Verlet* | 1.3e-6, 17 | 5.5e-6, 56 |
//! | *PEFRL* | 5.4e-9, 39 | 2.4e-8, 140 |
//! | rodas4, step controlled by its error | 9.3e-5, 5.1; 1.1e-5, 11 | 1.5e-4, 24; 2.0e-5, 47 |
//! | Rosenbrock, L-stable, four stages (ROS4) | 2.0e-4, 8.1; 2.4e-5, 16 | 5.4e-4, 39; 7.2e-5, 78 |
//! | Rosenbrock, four stages (GRK4T) | grows at every step tried | likewise |
//! | Rosenbrock of order 3 (ROS3P) | 3.0e-4, 6.0; 3.1e-5, 12 | 8.9e-4, 32; 8.3e-5, 63 |
//! | Rosenbrock of order 2 (ROS2) | 4.6e-4, 4.9; 8.1e-5, 9.9 | 8.4e-4, 29; 9.4e-5, 58 |
//! | generalised-alpha, rho 0.9 | 3.2e-4, 9.2; 1.1e-4, 18 | 2.1e-4, 49; 9.4e-5, 98 |
//! | generalised-alpha, rho 0.4 | 4.7e-4, 9.2; 1.5e-4, 18 | 3.0e-4, 49; 1.2e-4, 99 |
//! | TR-BDF2 | 6.3e-4, 7.9; 1.7e-4, 16 | 3.1e-4, 57; 1.3e-4, 94 |
//! | Gauss, two stages, iterated with one real factorisation | 4.7e-5, 28; 9.2e-6, 57 | 4.2e-5, 116; 7.7e-6, 209 |
//! | velocity form of PEFRL (VEFRL) | 5.1e-8, 32 | 1.7e-7, 109 |
//! | Omelyan's five stages (4MN5FV) | 4.6e-9, 42 | 2.2e-8, 150 |
//! | Blanes and Moan's six stages | 2.2e-9, 50 | 1.9e-8, 184 |
//! | Verlet, bending at every second kick only | 3.5e-6 for 0.75 of the gradients | |
//!
//! Multirate kicks gain nothing on these meshes because bending is half as stiff as stretching
//! there, and resonate from the third step on; on finer ones bending is the stiffer of the two.
//! A factor of two between schemes of fourth order is one halving of the step, 16 in the error:
//! PEFRL, ROS4 at the same error and those of more stages lie on one line or behind it.
//!
//! The sudden release excites vibrations that no large step resolves: here every implicit scheme
//! falls short of its order, which it has on smooth motion
//! (`cargo test --release --test physics order_in_the_step -- --nocapture`). In space an implicit
//! step measures the angles from the frames at its start, which adds an error of first order as
//! small as the edges' rotational inertia: below 1e-9 m on the helix at 1 ms.

mod newton;
pub mod rosenbrock;
pub mod splitting;

pub(crate) use newton::{Newton, acceleration_within, stretch_springs};

use crate::dynamics::step::{Step, StepperSettings, System, Work};
use crate::dynamics::stepper::rosenbrock::Rosenbrock;
use crate::dynamics::stepper::splitting::Splitting;
use crate::error::Error;
use crate::numerics::scalar::{Nestable, is_finite};
use crate::rod::{Rod, State};
use crate::scene::Scheme;

/// The stepper of a scheme, with its work arrays.
#[derive(Clone, Debug)]
pub(crate) enum Stepper<D: Nestable, R: Rod<D>> {
    /// Solves the step's equations by Newton's method.
    Newton(Box<Newton<D, R>>),
    /// Explicit.
    Splitting(Splitting<D>),
    /// Linearly implicit.
    Rosenbrock(Box<Rosenbrock<D, R>>),
}

impl<D: Nestable, R: Rod<D>> Stepper<D, R> {
    /// The stepper of a scheme for a rod that starts in `state`.
    pub fn new(
        settings: StepperSettings<D>,
        system: &System<D, R>,
        state: &mut State<D, R::Frames>,
    ) -> Self {
        let mass = system.rod.mass();
        if let Some(splitting) = Splitting::of(settings.scheme, mass) {
            return Self::Splitting(splitting);
        }
        match settings.scheme {
            Scheme::Rodas4 => Self::Rosenbrock(Box::new(Rosenbrock::new(&system.rod))),
            _ => Self::Newton(Box::new(Newton::new(settings, system, state))),
        }
    }

    /// Newton's method, if it solves the steps.
    pub fn newton(&self) -> Option<&Newton<D, R>> {
        match self {
            Self::Newton(newton) => Some(newton),
            Self::Splitting(_) | Self::Rosenbrock(_) => None,
        }
    }

    /// Keeps tangents and factors for [linearizations](crate::dynamics::Linearization) of later steps.
    pub fn keep_tangent(&mut self) {
        if let Self::Newton(newton) = self {
            newton.keep_tangent();
        }
    }

    /// Writes the forces that the next step takes as those of its start.
    pub fn find_forces(&mut self, system: &System<D, R>, state: &mut State<D, R::Frames>) {
        match self {
            Self::Newton(newton) => newton.find_forces(system, state),
            Self::Splitting(_) | Self::Rosenbrock(_) => {
                let State { q, frames, unbalanced, .. } = state;
                system.rod.gradient(q, frames, system.derivatives, unbalanced);
            }
        }
    }

    /// Writes the accelerations at the start, for schemes that use them.
    pub fn find_acceleration(&self, system: &System<D, R>, state: &mut State<D, R::Frames>) {
        if let Self::Newton(newton) = self {
            newton.find_acceleration(system, state);
        }
    }

    /// Sets the accelerations at the start, and the forces there that cause them.
    pub fn know_acceleration(
        &self,
        a: Vec<D>,
        system: &System<D, R>,
        state: &mut State<D, R::Frames>,
    ) {
        if let Self::Newton(newton) = self {
            newton.know_acceleration(a, system, state);
        }
    }

    /// Writes the unknowns that follow `before` into `state`; [`finish`](Self::finish) completes it. The content of `state`
    /// has no meaning before the call, and after an error.
    pub fn step(
        &mut self,
        step: &Step<'_, D, R>,
        before: &State<D, R::Frames>,
        state: &mut State<D, R::Frames>,
        work: &mut Work,
    ) -> Result<(), Error> {
        match self {
            Self::Newton(newton) => return newton.step(step, before, state, work),
            Self::Splitting(splitting) => {
                state.restore(before);
                splitting.step(step, state, work);
            }
            Self::Rosenbrock(rosenbrock) => {
                state.restore(before);
                rosenbrock.step(step, state, work).map_err(|singular| Error::SingularTangent {
                    time: step.time,
                    row: singular.row,
                })?;
            }
        }
        match is_finite(&state.v) {
            true => Ok(()),
            false => Err(Error::Unstable { time: step.time }),
        }
    }

    /// Completes the state after an accepted step.
    pub fn finish(
        &mut self,
        step: &Step<'_, D, R>,
        before: &State<D, R::Frames>,
        state: &mut State<D, R::Frames>,
        work: &mut Work,
    ) {
        if let Self::Newton(newton) = self {
            newton.finish(step, before, state, work);
        }
        state.wound = before.wound + step.system.rod.winding_jump(&before.q, &state.q);
        work.steps += 1;
    }
}
