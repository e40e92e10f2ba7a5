//! Time integration schemes: a `Stepper` advances the state of a rod from the start of a step to its end.
//!
//! Input: equations of motion, size of the step (s), state at its start. Output: state at its end (unknowns,
//! velocities, frames, and for implicit schemes forces, internal variables, and of generalised-alpha accelerations), in
//! two functions: `step`, and `finish` for a step that is accepted. `find_forces`, `find_acceleration` and
//! `set_initial_acceleration` overwrite forces and accelerations at the start of the next step. `keep_tangent` and
//! `keep_next_tangent` request tangents for derivatives; without Newton's method they have no effect. Errors: Newton's
//! method fails, a matrix is singular, or velocities are not finite. `newton` solves the implicit schemes; `rosenbrock`
//! and `splitting` are the others.
//!
//! | scheme | order | work per step | conserves | use for: tip error over length, or case |
//! |---|---|---|---|---|
//! | [Newmark-beta], 0.5 | 2 | 2 to 4 iterations | energy to O(h^2), not in long runs | 1 %, Kelvin-Voigt damping |
//! | [generalised-alpha], 0.5 | 2 | 2 to 4 iterations | slow modes | stiff rods and damping, recorded ends |
//! | [average vector field] | 2 | 2 to 4 iterations of four stages | energy exactly | long runs at large steps |
//! | [rodas4](rosenbrock) | 4 | 1 factorization, 6 gradients | momentum | 1e-3 to 1e-5 of the length |
//! | [verlet](splitting) | 2 | 1 gradient | momenta, phase volume; reversible | 1e-6 of the length |
//! | [pefrl](splitting) | 4 | 4 gradients | momenta, phase volume; reversible | 1e-8 of the length |
//!
//! [Newmark-beta]: crate::dynamics::coefficients
//! [generalised-alpha]: crate::dynamics::coefficients#generalised-alpha
//! [average vector field]: crate::dynamics::coefficients#average-vector-field
//!
//! The last two are explicit. Their steps must stay below [a limit of stability](crate::Discretized::largest_step),
//! proportional to the square of the edge length where bending is stiffer than stretching, else to that length: 36
//! us and 54 us on the paper's cantilever. `rodfit study` finds the least expensive scheme, step and mesh for a
//! scene; `cargo run --release --example work_precision` compares them on one mesh.
//!
//! # Tested and not included
//!
//! On the same kernels and meshes (50 segments, 1 s) no scheme below was better than those above by more than the
//! scatter of the times. Columns: largest tip error over length, and ms in one run.
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
//! Multirate kicks gain nothing on these meshes, because bending is half as stiff as stretching there, and they
//! resonate from the third step on. On finer meshes bending is the stiffer of the two. A factor of two in cost
//! between schemes of fourth order is one halving of the step, or 16 in the error: PEFRL, ROS4 at the same error
//! and schemes of more stages cost the same or more.
//!
//! The sudden release excites vibrations that no large step resolves. Here every implicit scheme has less than its
//! order, which it has on smooth motion (`cargo test --release --test physics order_in_the_step -- --nocapture`).
//! In space an implicit step measures angles from the frames at its start. That adds an error of first order, as
//! small as the rotational inertia of the edges: below 1e-9 m on the helix at 1 ms.

mod newton;
pub mod rosenbrock;
pub mod splitting;

pub(crate) use newton::{Newton, acceleration_within, stretch_springs};

use crate::dynamics::step::{Step, StepperSettings, System, Work};
use crate::dynamics::stepper::rosenbrock::Rosenbrock;
use crate::dynamics::stepper::splitting::Splitting;
use crate::error::Error;
use crate::numerics::scalar::{RodScalar, is_finite};
use crate::rod::{Rod, State};
use crate::scene::Scheme;

/// The stepper of a scheme, with its work arrays.
#[derive(Clone, Debug)]
pub(crate) enum Stepper<D: RodScalar, R: Rod<D>> {
    /// Solves the equations of an implicit step by Newton's method.
    Newton(Box<Newton<D, R>>),
    /// Explicit: Verlet or PEFRL.
    Splitting(Splitting<D>),
    /// Linearly implicit: rodas4.
    Rosenbrock(Box<Rosenbrock<D, R>>),
}

impl<D: RodScalar, R: Rod<D>> Stepper<D, R> {
    /// The stepper of the scheme in `settings` for a rod that starts in `state`: Verlet and PEFRL, rodas4, or
    /// Newton's method for all others. The Newton solver initializes the internal variables of `state`.
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

    /// The Newton solver; `None` for explicit and linearly implicit schemes.
    pub fn newton(&self) -> Option<&Newton<D, R>> {
        match self {
            Self::Newton(newton) => Some(newton),
            Self::Splitting(_) | Self::Rosenbrock(_) => None,
        }
    }

    /// Requests tangents and factors for [linearizations](crate::dynamics::Linearization) of later steps. No effect
    /// without Newton's method.
    pub fn keep_tangent(&mut self) {
        if let Self::Newton(newton) = self {
            newton.keep_tangent();
        }
    }

    /// Requests the tangents of the forces at the starts of later steps, too. No effect without Newton's method.
    pub fn keep_next_tangent(&mut self) {
        if let Self::Newton(newton) = self {
            newton.keep_next_tangent();
        }
    }

    /// Overwrites `state.unbalanced` with the forces that the next step takes as those of its start, N, without loads
    /// in time. Explicit and linearly implicit schemes take the gradient of energy less loads only.
    pub fn find_forces(&mut self, system: &System<D, R>, state: &mut State<D, R::Frames>) {
        match self {
            Self::Newton(newton) => newton.find_forces(system, state),
            Self::Splitting(_) | Self::Rosenbrock(_) => {
                let State { q, frames, unbalanced, .. } = state;
                system.rod.gradient(q, frames, system.derivatives, unbalanced);
            }
        }
    }

    /// Overwrites the accelerations of `state` at the start, m/s^2, with those by all forces, loads in time included,
    /// for generalised-alpha only. Those of held and prescribed unknowns are zero. No effect for other schemes.
    pub fn find_acceleration(&self, system: &System<D, R>, state: &mut State<D, R::Frames>) {
        if let Self::Newton(newton) = self {
            newton.find_acceleration(system, state);
        }
    }

    /// Sets the accelerations at the start to `a`, m/s^2 (stored for generalised-alpha only), and the forces there to
    /// those that cause them, without loads in time. No effect without Newton's method, and for averaging schemes.
    pub fn set_initial_acceleration(
        &self,
        a: Vec<D>,
        system: &System<D, R>,
        state: &mut State<D, R::Frames>,
    ) {
        if let Self::Newton(newton) = self {
            newton.set_initial_acceleration(a, system, state);
        }
    }

    /// Overwrites `state` with the unknowns that follow `before` after the step; explicit and linearly implicit
    /// schemes also write velocities and frames. [`finish`](Self::finish) completes it. Counts are added to `work`.
    /// The content of `state` has no meaning before the call, and after an error: [`Error::Newton`],
    /// [`Error::SingularTangent`], or [`Error::Unstable`] for velocities that are not finite.
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
        // These schemes solve no nonlinear equations: an unstable step shows only in values that
        // overflow.
        match is_finite(&state.v) {
            true => Ok(()),
            false => Err(Error::Unstable { time: step.time }),
        }
    }

    /// Completes the state after an accepted step: with Newton's method velocities, accelerations, internal variables
    /// and frames; with every scheme the potential of whole turns of moments, less the work of loads in time, J. The
    /// absolute value of that work, and its difference from the work in the equations of the scheme, are added to the
    /// exchanged energies of the state. Adds one to the count of steps.
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
        // The angle of a moment jumps by a whole turn where the first edge passes the direction
        // opposite to rest.
        state.wound = before.wound + step.system.rod.winding_jump(&before.q, &state.q);
        state.exchanged = before.exchanged;
        // Loads in time have no potential: their work counts instead.
        if !step.system.timed_loads.is_empty() {
            let times = [before.time, step.time];
            let work = match self {
                Self::Splitting(splitting) => splitting.timed_work(),
                _ => step.system.timed_loads.work(times, [&before.q, &state.q]),
            };
            let used = match self {
                Self::Newton(newton) => newton.timed_work([&before.q, &state.q]),
                _ => work,
            };
            state.wound -= work;
            state.exchanged.work += work.abs();
            state.exchanged.lead += (used - work).abs();
        }
        work.steps += 1;
    }
}
