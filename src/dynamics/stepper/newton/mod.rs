//! Newton's method for the [equations](crate::dynamics::coefficients) of an implicit step, with the exact banded
//! tangent.
//!
//! Input: the equations of motion, the end and size of the step (s), and the state at its start. A step starts from a
//! [predictor], forms one tangent there, and corrects with its factors until the [estimated error](convergence) is
//! below the [tolerance](crate::scene::StepTolerance), or the residual is a rounding error. A new tangent is formed
//! where the old one would take more corrections than it saves. If the estimate ends the iteration, the residual at the
//! solution is not evaluated: the forces there follow from the linear system. Averaging schemes, dual numbers and the
//! tolerance `rounding` iterate until the residual is a rounding error (`rounding`). If an iteration from extrapolated
//! velocities fails, one from constant velocities to the rounding error follows, and with friction or damping of
//! contacts one with a line search (`line_search`).
//!
//! Output: unknowns, velocities, forces and internal variables at the end of the step, for generalised-alpha also
//! accelerations; on request (`keep_tangent`, `keep_next_tangent`) the tangent and its factors at the solution, for
//! derivatives. `step` solves the equations, `finish` completes an accepted step, and `linearization` refers to its
//! tangent, `None` unless tangents are kept. `averages` and `parameter` describe the scheme. Failure is
//! [`Error::Newton`] with residual and number of iterations, or [`Error::SingularTangent`] for a zero pivot.
//!
//! `start_forces` has the forces at the start of a step, `acceleration` the accelerations of a recorded start.
//! `averaging`, `contact_losses`, `drag_forces`, `rotating_bodies`, `slip_state` and `timed_forces` have parts of the
//! equations, `tensions` the predicted tensions of tangents. `relinearize` linearizes an earlier step again, `repeat`
//! repeats a solved one over dual numbers.

mod acceleration;
mod averaging;
mod contact_losses;
mod convergence;
mod drag_forces;
mod line_search;
mod predictor;
mod relinearize;
mod repeat;
mod rotating_bodies;
mod rounding;
mod slip_state;
mod start_forces;
mod tensions;
mod timed_forces;

pub(crate) use acceleration::acceleration_within;
pub(crate) use slip_state::stretch_springs;

use crate::dynamics::coefficients::StepCoefficients;
use crate::dynamics::linearization::{Linearization, StageForces, StartForces};
use crate::dynamics::step::{Step, StepperSettings, System, Work};
use crate::dynamics::viscosity;
use crate::error::Error;
use crate::numerics::scalar::{RodScalar, is_finite};
use crate::numerics::simd::with_simd;
use crate::numerics::tangent::{Factors, Tangent};
use crate::rod::{EdgeMoment, FactorsOf, Rod, State, UnknownForce, Viscosity};
use crate::scene::{Scheme, StepTolerance};
use convergence::{Convergence, NextIteration, TangentOrigin, sizes};
use drag_forces::DragForces;
use predictor::Predictor;
use slip_state::SlipState;
use std::ops::Range;
use tensions::{TangentCount, Tensions};

/// Corrections after which the residual is compared with its rounding level, before another tangent is formed: the
/// tolerance may be below the rounding errors. A larger number costs useless tangents in that case.
const CHECK_RESIDUAL_AFTER: usize = 2;
/// The same number while corrections are larger than [`LARGE_CORRECTION`], which are not rounding errors.
const CHECK_LARGE_RESIDUAL_AFTER: usize = 10;
/// Size of a correction, over the length of the rod, from which on it is large: far above rounding errors of
/// coordinates.
const LARGE_CORRECTION: f64 = 1e-6;
/// Largest number of corrections. Quadratic convergence takes 2 to 5; more than this means another root.
const MAX_ITERATIONS: usize = 40;

/// The arguments of a step's solution as work for a vector unit. A closure instead would be compiled without its
/// instructions.
struct Solution<'a, 'b, D: RodScalar, R: Rod<D>> {
    newton: &'a mut Newton<D, R>,
    step: &'a Step<'b, D, R>,
    before: &'a State<D, R::Frames>,
    state: &'a mut State<D, R::Frames>,
    work: &'a mut Work,
}

impl<D: RodScalar, R: Rod<D>> pulp::NullaryFnOnce for Solution<'_, '_, D, R> {
    type Output = Result<(), Error>;

    /// Solves the step with the arguments of this struct, compiled for the instruction set of the caller.
    #[inline(always)]
    fn call(self) -> Self::Output {
        self.newton.step_inlined(self.step, self.before, self.state, self.work)
    }
}

/// The accelerations of the unknowns in `range` at the start of a step; `None` if the step's equations do not contain
/// them.
#[inline(always)]
fn accelerations<'a, D: RodScalar>(
    coefficients: &StepCoefficients<D>,
    all: &'a [D],
    range: Range<usize>,
) -> Option<&'a [D]> {
    coefficients.acceleration.as_ref().map(|_| &all[range])
}

/// The Newton solver for the steps of one scheme and one rod, with its work arrays.
#[derive(Clone, Debug)]
pub(crate) struct Newton<D: RodScalar, R: Rod<D>> {
    scheme: Scheme,
    /// The scheme's parameter.
    parameter: D,
    /// Tolerance of the error of a step.
    tolerance: StepTolerance,
    /// The length of the rod, m, of which the tolerance is a fraction.
    length: f64,
    /// The error estimate of the iteration.
    convergence: Convergence,
    predictor: Predictor<D>,
    /// Whether the tangent and its factors are formed again at the solution.
    keeps_tangent: bool,
    /// Whether the tangent of the forces that the next step takes as those of its start is formed, too.
    keeps_next: bool,
    /// The rod with viscous stress over the current step, or for averaging schemes that stress alone; set where there
    /// is viscous damping or internal friction.
    viscous: Option<R>,
    /// The rod without natural strains and loads, for averaging schemes.
    dashpots: Option<R>,
    /// Factors and shifts of the viscous stress.
    viscosity: Viscosity<D>,
    /// The springs of internal friction, if there are any.
    slip_state: Option<SlipState<D>>,
    /// The drag of the current step, if there is a fluid.
    drag_forces: Option<DragForces<D, R::Tangent>>,
    /// Mean forces of loads in time over the current step; empty without any.
    timed_forces: Vec<UnknownForce<D>>,
    /// Mean moments of loads in time over the current step; empty without any.
    timed_moments: Vec<EdgeMoment<D>>,
    /// The numbers of the current step.
    coefficients: StepCoefficients<D>,
    /// Elastic gradient less the loads, N.
    gradient: Vec<D>,
    /// Tangent of the gradient by the unknowns at the end, N/m.
    tangent: R::Tangent,
    /// Factors of masses and tangent in the factored matrix.
    weights: [D; 2],
    /// Factors of the step's matrix.
    factors: FactorsOf<R, D>,
    /// Minus the residual, then the correction of the unknowns.
    correction: Vec<D>,
    /// Velocities of the step's end, for rotating bodies in space and losses of contacts; empty without them.
    velocities: Vec<D>,
    /// The predicted tensions of the edges.
    tensions: Tensions<D>,
    /// The rounding level of every residual, N s^2.
    rounding: Vec<f64>,
    /// Forces at the stages of an averaging scheme.
    stages: Vec<StageForces<D, R>>,
    /// The geometry at the end of the step, if its tangent is kept.
    end: R::Geometry,
    /// Gradient and tangent of a viscous rod's forces that the next step takes as those of its start, if they are kept.
    next: StartForces<D, R::Tangent>,
}

impl<D: RodScalar, R: Rod<D>> Newton<D, R> {
    /// The solver of a scheme for a rod with the initial `state`. With viscous damping or internal friction the
    /// internal variables of `state` are initialized: strains of that state, zero rates and spring stretches.
    /// Tangents are not kept.
    pub fn new(
        settings: StepperSettings<D>,
        system: &System<D, R>,
        state: &mut State<D, R::Frames>,
    ) -> Self {
        let StepperSettings { scheme, parameter, tolerance, length } = settings;
        let coefficients = StepCoefficients::new(scheme, parameter, false, 1.0);
        let (rod, averages) = (&system.rod, coefficients.averages());
        let has_viscous_joints = rod.has_viscous_joints();
        let is_viscous = system.damping.is_viscous() || has_viscous_joints;
        let slides = rod.sliding_strains() > 0;
        // Stresses with a history need the strains of the first state; all rates and spring stretches begin at zero.
        if is_viscous || slides {
            let State { q, frames, internal, .. } = state;
            rod.strains(q, frames, &mut internal.strain);
            internal.strain_rate = vec![D::from(0.0); internal.strain.len()];
            internal.slid = vec![D::from(0.0); rod.sliding_strains()];
            let branches = system.damping.maxwell.as_slice().len();
            internal.relaxing.resize(branches * internal.strain.len(), D::from(0.0));
        }
        // Averaging schemes take the viscous stress separately, from a rod of dashpots.
        let law = || if averages { rod.dashpots() } else { rod.clone() };
        let viscous = (is_viscous || slides).then(law);
        let slip_state = slides.then(SlipState::new);
        let (n, tangent) = (state.q.len(), rod.zero_tangent());
        // Mean edge length, from the number of unknowns: 4 per node in space, 2 in the plane.
        let edges = (n.div_ceil(if R::HAS_FRAMES { 4 } else { 2 }) - 1) as f64;
        Self {
            scheme,
            parameter,
            tolerance,
            length,
            convergence: Convergence::new(tolerance.part() * length, length, length / edges),
            predictor: Predictor::new(),
            keeps_tangent: false,
            keeps_next: false,
            dashpots: viscous.clone().filter(|_| averages),
            viscous,
            viscosity: Viscosity::none(
                state.internal.strain.len(),
                system.damping.has_additional_times() || has_viscous_joints,
            ),
            slip_state,
            drag_forces: None,
            timed_forces: Vec::new(),
            timed_moments: Vec::new(),
            coefficients,
            gradient: vec![D::from(0.0); n],
            factors: tangent.new_factors(),
            tangent,
            weights: [D::from(1.0), D::from(0.0)],
            correction: vec![D::from(0.0); n],
            velocities: Vec::new(),
            tensions: Tensions::unknown(length / edges),
            rounding: vec![0.0; n],
            stages: Vec::new(),
            end: R::Geometry::default(),
            next: StartForces { gradient: Vec::new(), tangent: rod.zero_tangent() },
        }
    }

    /// Requests that every later step computes tangent, factors and geometry at its solution, for derivatives.
    pub fn keep_tangent(&mut self) {
        self.keeps_tangent = true;
    }

    /// Requests, for a viscous rod, the gradient and tangent of the forces that the next step takes as those of its
    /// start. The transposed derivative of a step needs them.
    pub fn keep_next_tangent(&mut self) {
        self.keeps_next = true;
        if self.viscous.is_some() {
            self.next.gradient = vec![D::from(0.0); self.gradient.len()];
        }
    }

    /// Whether the forces of a step are a mean over several stages: the average vector field.
    pub fn averages(&self) -> bool {
        StepCoefficients::new(self.scheme, self.parameter, false, 1.0).averages()
    }

    /// The scheme's parameter: beta of Newmark-beta, the spectral radius rho of generalised-alpha; without meaning
    /// for the average vector field.
    pub fn parameter(&self) -> D {
        self.parameter
    }

    /// References to states, tangent, factors and settings of the last step, from `before` to `after`, for its
    /// derivatives; `None` unless tangents are kept.
    pub fn linearization<'a>(
        &'a self,
        system: &'a System<D, R>,
        before: &'a State<D, R::Frames>,
        after: &'a State<D, R::Frames>,
    ) -> Option<Linearization<'a, D, R>> {
        self.keeps_tangent.then_some(Linearization {
            rod: &system.rod,
            derivatives: system.derivatives,
            free: system.free.clone(),
            prescribed: &system.prescribed,
            scheme: self.scheme,
            parameter: self.parameter,
            damping: &system.damping,
            drag: system.drag.as_ref(),
            timed_moments: &self.timed_moments,
            before,
            after,
            gradient: &self.gradient,
            tangent: &self.tangent,
            total: self
                .drag_forces
                .as_ref()
                .map_or(&self.gradient, |drag_forces| &drag_forces.total),
            matrix: self.matrix(),
            factors: &self.factors,
            weights: self.weights,
            stages: &self.stages,
            end: &self.end,
            next: &self.next,
        })
    }

    /// The derivatives of all forces except mass damping, drag included, by the unknowns at the end, N/m.
    fn matrix(&self) -> &R::Tangent {
        self.drag_forces.as_ref().map_or(&self.tangent, |drag_forces| &drag_forces.matrix)
    }

    /// Overwrites `state` with the unknowns and forces at the end of the step that begins in `before`, and adds
    /// counts to `work`. Plain numbers are compiled for the vector unit of the processor. Velocities follow in
    /// [`finish`](Self::finish). [`Error::Newton`] if the iteration fails, [`Error::SingularTangent`] for a zero pivot.
    pub fn step(
        &mut self,
        step: &Step<'_, D, R>,
        before: &State<D, R::Frames>,
        state: &mut State<D, R::Frames>,
        work: &mut Work,
    ) -> Result<(), Error> {
        match D::PLAIN {
            true => with_simd(Solution { newton: self, step, before, state, work }),
            false => self.step_inlined(step, before, state, work),
        }
    }

    /// [`step`](Self::step), inlined: predictor, then iteration to the estimated error or, for dual numbers,
    /// averaging schemes and the tolerance `rounding`, to the rounding level. If the iteration from extrapolated
    /// velocities fails, it is repeated from constant velocities to the rounding level. If that fails too, a rod with
    /// friction or damping of contacts is iterated with a line search first.
    #[inline(always)]
    fn step_inlined(
        &mut self,
        step: &Step<'_, D, R>,
        before: &State<D, R::Frames>,
        state: &mut State<D, R::Frames>,
        work: &mut Work,
    ) -> Result<(), Error> {
        self.begin(step, before);
        // The equations of an average have many roots at large steps. The motion is the one next to
        // constant velocity.
        let steady = self.coefficients.averages();
        let extrapolated = self.predictor.predict(step, &self.coefficients, before, state, steady);
        let mut solved = match self.tolerance {
            StepTolerance::Predicted(_) if D::ORDER == 0 && !self.coefficients.averages() => {
                self.solve_to_estimated_error(step, before, state, work)
            }
            _ => self.solve_to_rounding(step, before, state, work),
        };
        if solved.is_err() && extrapolated {
            // Extrapolated velocities failed: constant ones, to rounding.
            self.predictor.predict_steadily(step, before, state);
            solved = self.solve_to_rounding(step, before, state, work);
        }
        if solved.is_err() && step.system.rod.has_contact_losses() {
            // Without progress the first error stays.
            if self.approach_solution(step, before, state, work).is_ok() {
                solved = self.solve_to_rounding(step, before, state, work);
            }
        }
        solved
    }

    /// Sets coefficients, mean loads in time, viscous stress and the tangents of drag for a step that begins in
    /// `before`. Without accelerations in `before`, generalised-alpha takes a step of implicit Euler.
    fn begin(&mut self, step: &Step<'_, D, R>, before: &State<D, R::Frames>) {
        let knows_acceleration = !before.acceleration.is_empty();
        self.coefficients =
            StepCoefficients::new(self.scheme, self.parameter, knows_acceleration, step.h);
        if !step.system.timed_loads.is_empty() {
            let interval = self.coefficients.load_interval(before.time);
            let (forces, moments) = (&mut self.timed_forces, &mut self.timed_moments);
            step.system.timed_loads.set_mean(interval, forces, moments);
        }
        self.set_viscous(step, before);
        if let (Some(drag), Some(drag_forces)) = (&step.system.drag, &mut self.drag_forces) {
            drag_forces.begin(drag, before, step.h);
        }
    }

    /// Sets the laws of the viscous rod to the stress at the end of the `step`, which begins in `before`. They get
    /// factors and shifts by Kelvin-Voigt and Maxwell stress, and friction springs with their stretches in `before`.
    /// For averaging schemes they are those of dashpots alone. Without viscous damping and internal friction nothing
    /// happens.
    fn set_viscous(&mut self, step: &Step<'_, D, R>, before: &State<D, R::Frames>) {
        if let Some(viscous) = &mut self.viscous {
            let (damping, viscosity) = (&step.system.damping, &mut self.viscosity);
            viscosity::at_end(&self.coefficients, damping, &before.internal, viscosity);
            match &self.dashpots {
                Some(dashpots) => viscous.set_dashpots(dashpots, viscosity),
                None => viscous.set_viscous(&step.system.rod, viscosity),
            }
            viscous.set_springs(&step.system.rod, Some(&before.internal));
        }
    }

    /// Overwrites the solver's gradient of the forces at the end of the step, N, at the iterate `state`: elastic and
    /// viscous forces less the loads, with moments of loads in time, inertia of rotating bodies and losses of contacts;
    /// for averaging schemes the mean over the step. If `with_tangent`, the tangent by the unknowns there is
    /// overwritten too, under predicted tensions if these are in use, and prescribed unknowns are decoupled in it. Sums
    /// with drag are set, and `work` counts one tangent or one gradient.
    fn evaluate(
        &mut self,
        step: &Step<'_, D, R>,
        before: &State<D, R::Frames>,
        state: &State<D, R::Frames>,
        with_tangent: bool,
        work: &mut Work,
    ) {
        if self.coefficients.averages() {
            self.average(step, before, state, with_tangent);
        } else {
            let (q, frames, derivatives) = (&state.q, &state.frames, step.system.derivatives);
            let Self { gradient, tangent, viscous, tensions, .. } = self;
            let rod = viscous.as_ref().unwrap_or(&step.system.rod);
            let tensions = tensions.expected();
            match with_tangent {
                true => {
                    rod.tangent_with_tensions(q, frames, derivatives, tensions, gradient, tangent)
                }
                false => rod.gradient(q, frames, derivatives, gradient),
            }
        }
        self.add_timed_moments(state, with_tangent);
        self.add_rotational_inertia(step, before, state, with_tangent);
        self.add_contact_losses(step, before, state, with_tangent);
        self.drag(step, [before, state], with_tangent);
        work.tangents += usize::from(with_tangent);
        work.gradients += usize::from(!with_tangent);
    }

    /// With a fluid, overwrites `total`, the gradient less the drag forces, N. If `with_tangent`, it also overwrites
    /// `matrix`, the tangent plus the derivatives of minus the drag, N/m. With `with_tangent` prescribed unknowns are
    /// then decoupled in tangent and matrix, also without a fluid. `states`: before the step and at the iterate.
    fn drag(
        &mut self,
        step: &Step<'_, D, R>,
        states: [&State<D, R::Frames>; 2],
        with_tangent: bool,
    ) {
        if let (Some(drag), Some(drag_forces)) = (&step.system.drag, &mut self.drag_forces) {
            drag_forces.find(step, drag, &self.coefficients, states, &self.gradient);
            if with_tangent {
                let slope = self.coefficients.damped_velocity_slope();
                drag_forces.set_matrix(drag, slope, &self.tangent);
                step.system.prescribed.eliminate_rows_and_columns(&mut drag_forces.matrix);
            }
        }
        if with_tangent {
            step.system.prescribed.eliminate_rows_and_columns(&mut self.tangent);
        }
    }

    /// Corrects the unknowns of `state` until the estimated error is below the tolerance, or the residual is at its
    /// rounding level. The forces at the end follow from the linear system. With kept tangents, the step is linearized
    /// at the solution. [`Error::Newton`] after [`MAX_ITERATIONS`] corrections, or if the residual or the last
    /// correction is not finite; [`Error::SingularTangent`] for a zero pivot.
    #[inline(always)]
    fn solve_to_estimated_error(
        &mut self,
        step: &Step<'_, D, R>,
        before: &State<D, R::Frames>,
        state: &mut State<D, R::Frames>,
        work: &mut Work,
    ) -> Result<(), Error> {
        self.convergence.begin();
        self.tensions.begin();
        let mut next = NextIteration::Tangent;
        let (mut tangents, mut size) = (0, f64::INFINITY);
        for iteration in 0..=MAX_ITERATIONS {
            // Origin of the tangent: here, or an earlier iterate.
            let fresh = next == NextIteration::Tangent;
            let formed = match next {
                NextIteration::Chord => TangentOrigin::Previous,
                _ if self.tensions.expected().is_some() => TangentOrigin::ExpectedTensions,
                _ => TangentOrigin::Current,
            };
            let large = size > LARGE_CORRECTION * self.length;
            let check_after = if large { CHECK_LARGE_RESIDUAL_AFTER } else { CHECK_RESIDUAL_AFTER };
            let checks = iteration >= check_after + usize::from(!fresh);
            // Forces, tangent and residual.
            self.evaluate(step, before, state, fresh && !checks, work);
            if checks {
                self.set_rounding(step, state);
            }
            self.residual(step, before, state);
            let free = step.system.free.clone();
            // End at the rounding level, or failure.
            if checks || !is_finite(&self.correction[free.clone()]) {
                let (residual, tolerance, at_rounding) = self.largest_residual(free.clone());
                if checks && at_rounding {
                    break;
                }
                if !residual.is_finite() || iteration == MAX_ITERATIONS {
                    let (time, iterations) = (step.time, iteration);
                    return Err(Error::Newton { time, iterations, residual, tolerance });
                }
            }
            // Factors of a new tangent.
            if fresh {
                if checks {
                    self.evaluate(step, before, state, true, work);
                }
                self.factor(step, work)?;
                tangents += 1;
            }
            // Correction; the forces take its linear part.
            let by_end = self.coefficients.end.recip();
            let right = &self.correction[free.clone()];
            let forces = &mut state.unbalanced[free.clone()][..right.len()];
            for i in 0..forces.len() {
                forces[i] += right[i] * by_end;
            }
            let [moved, turned] = self.correct(step, state, work);
            size = moved.max(turned);
            // Estimated error, and the cheapest way on.
            next = self.convergence.corrected([moved, turned], formed);
            // Sizes ignore NaN, so that a correction of NaN would end the iteration.
            if next == NextIteration::Done && !is_finite(&self.correction[free.clone()]) {
                let (time, iterations) = (step.time, iteration + 1);
                let (residual, tolerance) = (f64::NAN, f64::NAN);
                return Err(Error::Newton { time, iterations, residual, tolerance });
            }
            if next == NextIteration::Done
                && !self.slip_state_is_unchanged(step, before, state, size)
            {
                // The estimate does not hold where springs begin to slip or stick.
                next = NextIteration::Tangent;
            }
            if next != NextIteration::Chord {
                let rod = self.viscous.as_ref().unwrap_or(&step.system.rod);
                let progress = TangentCount { tangents, is_done: next == NextIteration::Done };
                let at = (&state.q[..], &state.frames);
                self.tensions.corrected(rod, &self.correction, moved, at, progress);
            }
            if next == NextIteration::Done {
                // The forces at the end, by the linear system: its matrix is M + end dn1/dq1.
                let correction = &self.correction[free.clone()];
                let mass = &step.system.rod.mass()[free.clone()][..correction.len()];
                let forces = &mut state.unbalanced[free][..correction.len()];
                for i in 0..forces.len() {
                    forces[i] -= mass[i] * correction[i] * by_end;
                }
                break;
            }
        }
        match self.keeps_tangent {
            true => self.linearize_at(step, before, state, work),
            false => Ok(()),
        }
    }

    /// Overwrites gradient, tangent, factors and geometry of the solver with those at the solution `state` of a step
    /// from `before`, for derivatives. The geometry is measured from the frames of `before`. `work` counts one tangent
    /// and one factorization. [`Error::SingularTangent`] for a zero pivot.
    fn linearize_at(
        &mut self,
        step: &Step<'_, D, R>,
        before: &State<D, R::Frames>,
        state: &State<D, R::Frames>,
        work: &mut Work,
    ) -> Result<(), Error> {
        let rod = self.viscous.as_ref().unwrap_or(&step.system.rod);
        let Self { gradient, tangent, end, .. } = self;
        let (q, derivatives) = (&state.q, step.system.derivatives);
        rod.tangent_with_geometry(q, &before.frames, derivatives, gradient, tangent, end);
        self.add_timed_moments(state, true);
        self.add_rotational_inertia(step, before, state, true);
        self.add_contact_losses(step, before, state, true);
        self.drag(step, [before, state], true);
        work.tangents += 1;
        self.factor(step, work)
    }

    /// Whether the last correction, of `size` in m, cannot have made a spring of internal friction begin to slip or
    /// stick. True without internal friction, and for corrections within the tolerance; else by
    /// [`SlipState::is_unchanged`]. Updates the strains and stretches of the springs.
    fn slip_state_is_unchanged(
        &mut self,
        step: &Step<'_, D, R>,
        before: &State<D, R::Frames>,
        state: &State<D, R::Frames>,
        size: f64,
    ) -> bool {
        let Some(slip_state) = &mut self.slip_state else { return true };
        let elastic = &step.system.rod;
        slip_state.update(elastic, &before.internal, &state.q, &state.frames);
        // An error by a change of slip is at most the correction.
        let part = size / self.length;
        part <= self.tolerance.part() || slip_state.is_unchanged(elastic, part)
    }

    /// Replaces minus the residual in `correction` by the correction of the unknowns, by the factors of the step, and
    /// adds it to the free unknowns of `state`. Returns the largest displacement of a node along an axis, m, and the
    /// largest rotation of a director times the rod's length, m. Counts one Newton iteration.
    #[inline(always)]
    fn correct(
        &mut self,
        step: &Step<'_, D, R>,
        state: &mut State<D, R::Frames>,
        work: &mut Work,
    ) -> [f64; 2] {
        self.factors.solve(&mut self.correction);
        step.system.rod.convert_correction(&state.q, &state.frames, &mut self.correction);
        self.slip_state.iter_mut().for_each(|slip_state| slip_state.is_current = false);
        let free = step.system.free.clone();
        let correction = &self.correction[free.clone()];
        let q = &mut state.q[free.clone()][..correction.len()];
        for i in 0..q.len() {
            q[i] += correction[i];
        }
        work.newton_iterations += 1;
        sizes(&step.system.rod, correction, free.start, self.length)
    }

    /// Factors the matrix of the step, `M (1 + end slope c) + end K`, of the free unknowns, with the mass damping
    /// `c`; for Newmark-beta `M (1 + h beta c) + h^2 beta^2 K`. A zero pivot is [`Error::SingularTangent`].
    fn factor(&mut self, step: &Step<'_, D, R>, work: &mut Work) -> Result<(), Error> {
        work.factorizations += 1;
        let StepCoefficients { end, .. } = self.coefficients;
        let slope = self.coefficients.damped_velocity_slope();
        self.weights = [end * slope * step.system.damping.mass + 1.0, end];
        let [masses, tangent] = self.weights;
        let matrix =
            self.drag_forces.as_ref().map_or(&self.tangent, |drag_forces| &drag_forces.matrix);
        self.factors
            .factor_sum(step.system.rod.mass(), masses, matrix, tangent, step.system.free.clone())
            .map_err(|singular| Error::SingularTangent { time: step.time, row: singular.row })
    }

    /// Overwrites `correction` with minus the residual, kg m, of the free unknowns; prescribed ones get zero.
    /// Overwrites `now.unbalanced` with the forces at the end, N: the evaluated forces plus mass damping, without the
    /// mean forces of loads in time, which are in the residual only.
    #[inline(always)]
    fn residual(
        &mut self,
        step: &Step<'_, D, R>,
        before: &State<D, R::Frames>,
        now: &mut State<D, R::Frames>,
    ) {
        let (free, coefficients) = (step.system.free.clone(), self.coefficients);
        let (q1, n1) = (&now.q[free.clone()], &mut now.unbalanced[free.clone()]);
        let (q0, v0) = (&before.q[free.clone()], &before.v[free.clone()]);
        let n0 = &before.unbalanced[free.clone()];
        let a0 = accelerations(&coefficients, &before.acceleration, free.clone());
        let mass = &step.system.rod.mass()[free.clone()];
        let forces =
            self.drag_forces.as_ref().map_or(&self.gradient, |drag_forces| &drag_forces.total);
        let correction = &mut self.correction[free.clone()];
        let mass_damping = step.system.damping.mass;

        // All forces at the end: elastic gradient less loads, drag, and mass damping if there is any.
        n1.copy_from_slice(&forces[free.clone()]);
        let is_damped = mass_damping.value() != 0.0 || D::ORDER > 0;
        // Decided once for all unknowns.
        match a0 {
            None => {
                let coefficients = coefficients.without_acceleration();
                let none = |_| D::from(0.0);
                if is_damped {
                    coefficients.add_damping(mass, mass_damping, [q1, q0, v0], none, n1);
                }
                coefficients.residuals(mass, [q1, q0, v0, n1, n0], none, correction);
            }
            Some(a0) => {
                let a0 = &a0[..correction.len()];
                if is_damped {
                    coefficients.add_damping(mass, mass_damping, [q1, q0, v0], |i| a0[i], n1);
                }
                coefficients.residuals(mass, [q1, q0, v0, n1, n0], |i| a0[i], correction);
            }
        }
        self.add_timed_forces(step, before);
        self.add_products_of_inertia(step, before, now);
        step.system.prescribed.fill(&mut self.correction, D::from(0.0));
    }

    /// Completes an accepted step in `state`: velocities, accelerations (generalised-alpha only), and frames moved to
    /// the solution. Rods with viscosity or internal friction also get strains, mean strain rates over the step, and
    /// spring stretches. Their forces at the start of the next step are computed, for which `work` counts one tangent
    /// or gradient. Elastic rods keep the forces at the end without moments of loads in time, or zero for averaging
    /// schemes. Stores the velocities of `before` for the predictor.
    pub fn finish(
        &mut self,
        step: &Step<'_, D, R>,
        before: &State<D, R::Frames>,
        state: &mut State<D, R::Frames>,
        work: &mut Work,
    ) {
        // The states of past steps predict the next one.
        self.predictor.store(before);
        let (free, coefficients) = (step.system.free.clone(), self.coefficients);
        let a0 = accelerations(&coefficients, &before.acceleration, free.clone());
        let (q1, v1) = (&state.q[free.clone()], &mut state.v[free.clone()]);
        let (q0, v0) = (&before.q[free.clone()], &before.v[free.clone()]);
        match a0 {
            None => {
                let coefficients = coefficients.without_acceleration();
                coefficients.velocities([q1, q0, v0], |_| D::from(0.0), v1);
            }
            Some(a0) => {
                let a0 = &a0[..v1.len()];
                coefficients.velocities([q1, q0, v0], |i| a0[i], v1);
            }
        }
        // Only generalised-alpha continues from accelerations.
        if self.scheme == Scheme::GeneralisedAlpha {
            state.acceleration.resize(state.q.len(), D::from(0.0));
            let a1 = &mut state.acceleration[free.clone()];
            let lists = [q1, q0, v0, &*v1];
            match a0 {
                None => coefficients.accelerations(lists, |_| D::from(0.0), a1),
                Some(a0) => coefficients.accelerations(lists, |i| a0[i], a1),
            }
            step.system.prescribed.fill(&mut state.acceleration, D::from(0.0));
        }
        step.system.apply_prescribed_velocities(step.time, &mut state.v);
        if self.viscous.is_some() {
            let State { q, frames, internal, .. } = state;
            let rod = &step.system.rod;
            match &mut self.slip_state {
                Some(slip_state) => {
                    if !slip_state.is_current {
                        slip_state.update(rod, &before.internal, q, frames);
                    }
                    internal.strain.clone_from(&slip_state.strains);
                    internal.slid.clone_from(&slip_state.slid);
                }
                None => rod.strains(q, frames, &mut internal.strain),
            }
            let (damping, z) = (&step.system.damping, &mut internal.relaxing);
            // Maxwell elements relax along the change of the strains over the step.
            viscosity::relax(damping, step.h, &before.internal, &internal.strain, z);
            let changes = internal.strain.iter().zip(&before.internal.strain);
            // The mean rate over the step, (s1 - s0)/h, is the rate at the start of the next
            // step.
            internal.strain_rate.clear();
            internal.strain_rate.extend(changes.map(|(s1, s0)| (*s1 - *s0) * (1.0 / step.h)));
            self.find_forces(step.system, state);
            work.tangents += usize::from(self.keeps_next);
            work.gradients += usize::from(!self.keeps_next);
        } else if self.coefficients.averages() {
            state.unbalanced.fill(D::from(0.0));
        } else {
            self.leave_timed_moments_out(state);
        }
        // Reference frames follow accepted unknowns, so that their twist is continuous beyond
        // half a turn.
        step.system.rod.move_frames(&mut state.frames, &state.q);
    }
}
