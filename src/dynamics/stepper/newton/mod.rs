//! Schemes whose steps are equations: Newton's method on an exact banded tangent solves
//! [them](crate::dynamics::coefficients).
//!
//! A step starts from a [guess], forms one tangent there, and corrects with its factors until the
//! error that is [predicted](convergence) to be left is below the [tolerance](crate::scene::StepTolerance);
//! where that would take long, with a new tangent. The residual at the end is never looked at: the
//! forces there follow from the linear system. Averaging schemes, numbers that carry derivatives and
//! those who ask for it iterate until nothing but rounding errors is left.

mod acceleration;
mod again;
mod averaging;
mod convergence;
mod dragging;
mod guess;
mod rounding;
mod sliding;
mod tensions;

pub(crate) use acceleration::acceleration_within;
pub(crate) use sliding::stretched;

use crate::dynamics::coefficients::StepCoefficients;
use crate::dynamics::linearization::{Linearization, StageForces};
use crate::dynamics::step::{Step, System, Work};
use crate::dynamics::viscosity;
use crate::error::Error;
use crate::numerics::scalar::{Nestable, is_finite};
use crate::numerics::tangent::{Factors, Tangent};
use crate::rod::{FactorsOf, InternalVariables, Rod, State, Viscosity};
use crate::scene::{Scheme, StepTolerance};
use convergence::{Convergence, Formed, Next, sizes};
use dragging::Dragging;
use guess::Guess;
use sliding::Sliding;
use std::ops::Range;
use tensions::Tensions;

/// Corrections that a step takes without trouble. After these, and before another tangent is formed,
/// its residual is looked at: a tolerance may be below what rounding errors leave. Where corrections are still
/// above the second number, a part of the rod's length, that is not so for as long.
const UNTROUBLED: (usize, f64) = (2, 1e-6);
const MOSTLY_UNTROUBLED: usize = 10;
/// Quadratic convergence needs 2 to 5; a simulation that needs more than this has lost the branch.
const MAX_ITERATIONS: usize = 40;

/// The accelerations that a step goes on from, if it does.
#[inline]
fn accelerations<'a, D: Nestable>(
    coefficients: &StepCoefficients<D>,
    all: &'a [D],
    range: Range<usize>,
) -> Option<&'a [D]> {
    coefficients.acceleration.as_ref().map(|_| &all[range])
}

/// What Newton's method needs of a scheme and a rod, and the room it works in.
#[derive(Clone, Debug)]
pub(crate) struct Newton<D: Nestable, R: Rod<D>> {
    scheme: Scheme,
    /// The scheme's parameter.
    parameter: D,
    /// When to stop, with its scale, m.
    tolerance: StepTolerance,
    length: f64,
    convergence: Convergence,
    guess: Guess<D>,
    /// Whether the tangent and its factors are formed again at the solution.
    keeps_tangent: bool,
    /// The rod with Kelvin-Voigt stress over the current step, or of an averaging scheme that stress
    /// alone; only when damped, or with internal friction.
    viscous: Option<R>,
    /// What that stress alone is made from.
    dashpots: Option<R>,
    /// What makes that stress of the elastic one.
    viscosity: Viscosity<D>,
    /// The springs of internal friction, only where there are any.
    sliding: Option<Sliding<D>>,
    /// The drag of the current step, only in a fluid.
    dragging: Option<Dragging<D, R::Tangent>>,
    /// The numbers of the current step.
    coefficients: StepCoefficients<D>,
    gradient: Vec<D>,
    tangent: R::Tangent,
    /// Factors of masses and tangent in the factored matrix.
    weights: [D; 2],
    factors: FactorsOf<R, D>,
    correction: Vec<D>,
    tensions: Tensions<D>,
    /// The rounding level of every residual, N s^2.
    rounding: Vec<f64>,
    /// Where the forces of an averaging scheme were taken.
    stages: Vec<StageForces<D, R>>,
    /// The rod at the end of the step, where its tangent is kept.
    end: R::Geometry,
    /// Of a viscous rod the gradient and tangent of the forces that the next step counts by its start, likewise.
    next: (Vec<D>, R::Tangent),
}

impl<D: Nestable, R: Rod<D>> Newton<D, R> {
    /// For a rod that starts in `state`, whose internal variables it prepares. `length`, m, is the
    /// scale of the tolerance.
    pub fn new(
        (scheme, parameter): (Scheme, D),
        system: &System<D, R>,
        (tolerance, length): (StepTolerance, f64),
        state: &mut State<D, R::Frames>,
    ) -> Self {
        let coefficients = StepCoefficients::new(scheme, parameter, false, 1.0);
        let (rod, averages) = (&system.rod, coefficients.averages());
        let is_viscous = system.damping.is_viscous();
        let slides = rod.slides() > 0;
        if is_viscous || slides {
            let State { q, frames, internal, .. } = state;
            rod.strains(q, frames, &mut internal.strain);
            internal.strain_rate = vec![D::from(0.0); internal.strain.len()];
            internal.slid = vec![D::from(0.0); rod.slides()];
            let relaxes = system.damping.maxwell.is_some();
            internal.relaxing.resize(if relaxes { internal.strain.len() } else { 0 }, D::from(0.0));
        }
        let law = || if averages { rod.dashpots() } else { rod.clone() };
        let viscous = (is_viscous || slides).then(law);
        let sliding = slides.then(Sliding::new);
        let n = state.q.len();
        let edges = (n.div_ceil(if R::HAS_FRAMES { 4 } else { 2 }) - 1) as f64;
        Self {
            scheme,
            parameter,
            tolerance,
            length,
            convergence: Convergence::new(tolerance.part() * length, length, length / edges),
            guess: Guess::new(),
            keeps_tangent: false,
            dashpots: viscous.clone().filter(|_| averages),
            viscous,
            viscosity: Viscosity::none(
                state.internal.strain.len(),
                system.damping.has_additional_times(),
            ),
            sliding,
            dragging: None,
            coefficients,
            gradient: vec![D::from(0.0); n],
            tangent: Tangent::zeros(n),
            weights: [D::from(1.0), D::from(0.0)],
            factors: Factors::with_order(n),
            correction: vec![D::from(0.0); n],
            tensions: Tensions::unknown(length / edges),
            rounding: vec![0.0; n],
            stages: Vec::new(),
            end: R::Geometry::default(),
            next: (Vec::new(), Tangent::zeros(0)),
        }
    }

    /// Leaves the tangent and its factors behind at the solution of every step to come.
    pub fn keep_tangent(&mut self) {
        self.keeps_tangent = true;
        if self.viscous.is_some() {
            let n = self.gradient.len();
            self.next = (vec![D::from(0.0); n], Tangent::zeros(n));
        }
    }
    /// Whether the forces of a step are an average over it.
    pub fn averages(&self) -> bool {
        StepCoefficients::new(self.scheme, self.parameter, false, 1.0).averages()
    }

    /// The scheme's parameter.
    pub fn parameter(&self) -> D {
        self.parameter
    }

    /// The last step, which went from `before` to `after`; none if its tangent was not kept.
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
            led: &system.led,
            scheme: self.scheme,
            before,
            after,
            gradient: &self.gradient,
            tangent: &self.tangent,
            total: self.dragging.as_ref().map_or(&self.gradient, |dragging| &dragging.total),
            matrix: self.matrix(),
            factors: &self.factors,
            weights: self.weights,
            stages: &self.stages,
            end: &self.end,
            next: (&self.next.0, &self.next.1),
        })
    }

    /// The derivatives of all forces by the unknowns at the end, but for those of mass damping.
    fn matrix(&self) -> &R::Tangent {
        self.dragging.as_ref().map_or(&self.tangent, |dragging| &dragging.matrix)
    }

    /// Writes the forces that the next step counts by its start.
    pub fn find_forces(&mut self, system: &System<D, R>, state: &mut State<D, R::Frames>) {
        let System { rod, derivatives, free, damping, .. } = system;
        let State { q, frames, v, internal, unbalanced, .. } = state;
        // What is asked of them does not depend on the length of the step.
        let coefficients = StepCoefficients::new(self.scheme, self.parameter, false, 1.0);
        match self.viscous.is_some() {
            true => self.find_viscous(system, internal, (q, frames), unbalanced),
            false if coefficients.averages() => unbalanced.fill(D::from(0.0)),
            false => rod.gradient(q, frames, *derivatives, unbalanced),
        }
        if !coefficients.averages() {
            for i in free.clone() {
                unbalanced[i] += damping.mass * rod.mass()[i] * v[i];
            }
        }
        if let Some(drag) = &system.drag {
            let dragging = self.dragging.get_or_insert_with(|| Dragging::new(q.len()));
            dragging.add_now(drag, [q, v], unbalanced);
        }
    }

    /// The same of a viscous rod, without mass damping and drag.
    fn find_viscous(
        &mut self,
        System { rod, derivatives, damping, .. }: &System<D, R>,
        internal: &InternalVariables<D>,
        (q, frames): (&[D], &R::Frames),
        forces: &mut [D],
    ) {
        let Some(viscous) = &mut self.viscous else { return };
        let coefficients = StepCoefficients::new(self.scheme, self.parameter, false, 1.0);
        viscosity::at_start(&coefficients, damping, internal, &mut self.viscosity);
        let base = self.dashpots.as_ref().unwrap_or(rod);
        viscous.set_viscous(base, &self.viscosity);
        viscous.set_springs(rod, None);
        let (gradient, tangent) = &mut self.next;
        match self.keeps_tangent {
            true => {
                viscous.tangent(q, frames, *derivatives, forces, tangent);
                gradient.copy_from_slice(forces);
            }
            false => viscous.gradient(q, frames, *derivatives, forces),
        }
    }

    /// Writes the accelerations at the start, of a scheme that goes on from them.
    pub fn find_acceleration(&self, system: &System<D, R>, state: &mut State<D, R::Frames>) {
        if self.scheme != Scheme::GeneralisedAlpha {
            return;
        }
        state.acceleration.clear();
        state.acceleration.resize(state.q.len(), D::from(0.0));
        for i in system.free.clone() {
            state.acceleration[i] = -state.unbalanced[i] / system.rod.mass()[i];
        }
        system.led.fill(&mut state.acceleration, D::from(0.0));
    }

    /// Makes `state` what follows `before`.
    pub fn step(
        &mut self,
        step: &Step<'_, D, R>,
        before: &State<D, R::Frames>,
        state: &mut State<D, R::Frames>,
        work: &mut Work,
    ) -> Result<(), Error> {
        let knows_acceleration = !before.acceleration.is_empty();
        self.coefficients =
            StepCoefficients::new(self.scheme, self.parameter, knows_acceleration, step.h);
        self.set_viscous(step, before);
        if let (Some(drag), Some(dragging)) = (&step.system.drag, &mut self.dragging) {
            dragging.begin(drag, before, step.h);
        }
        // The equations of an average have many roots at large steps, the motion nearest to a steady one.
        let steady = self.coefficients.averages();
        let guessed = self.guess.place(step, &self.coefficients, before, state, steady);
        let solved = match self.tolerance {
            StepTolerance::Predicted(_) if D::ORDER == 0 && !self.coefficients.averages() => {
                self.solve_as_predicted(step, before, state, work)
            }
            _ => self.solve_to_rounding(step, before, state, work),
        };
        if solved.is_err() && guessed {
            // Velocities did not go on as before: from where they stay what they are, with all care.
            self.guess.place_steadily(step, before, state);
            return self.solve_to_rounding(step, before, state, work);
        }
        solved
    }

    /// The rod with the viscous stress at the end of the step.
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

    /// The gradient, with its tangent by the unknowns at the end if asked for.
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
                true => rod.tangent_under(q, frames, derivatives, tensions, (gradient, tangent)),
                false => rod.gradient(q, frames, derivatives, gradient),
            }
        }
        self.drag(step, [before, state], with_tangent);
        work.tangents += usize::from(with_tangent);
        work.gradients += usize::from(!with_tangent);
    }

    /// Adds the drag, if there is a fluid, to what was evaluated, and uncouples what is led.
    fn drag(
        &mut self,
        step: &Step<'_, D, R>,
        states: [&State<D, R::Frames>; 2],
        with_tangent: bool,
    ) {
        if let (Some(drag), Some(dragging)) = (&step.system.drag, &mut self.dragging) {
            dragging.find((step, drag), &self.coefficients, states, &self.gradient);
            if with_tangent {
                let slope = self.coefficients.damped_velocity_slope();
                dragging.set_matrix(drag, slope, &self.tangent);
                step.system.led.uncouple(&mut dragging.matrix);
            }
        }
        if with_tangent {
            step.system.led.uncouple(&mut self.tangent);
        }
    }

    /// Corrects until the error left is predicted to be below the tolerance.
    fn solve_as_predicted(
        &mut self,
        step: &Step<'_, D, R>,
        before: &State<D, R::Frames>,
        state: &mut State<D, R::Frames>,
        work: &mut Work,
    ) -> Result<(), Error> {
        self.convergence.begin();
        self.tensions.begin();
        let mut next = Next::Tangent;
        let (mut tangents, mut size) = (0, f64::INFINITY);
        for iteration in 0..=MAX_ITERATIONS {
            let fresh = next == Next::Tangent;
            let formed = match next {
                Next::Chord => Formed::Before,
                _ if self.tensions.expected().is_some() => Formed::Expecting,
                _ => Formed::Here,
            };
            let large = size > UNTROUBLED.1 * self.length;
            let untroubled = if large { MOSTLY_UNTROUBLED } else { UNTROUBLED.0 };
            let troubled = iteration >= untroubled + usize::from(!fresh);
            self.evaluate(step, before, state, fresh && !troubled, work);
            if troubled {
                self.set_rounding(step, state);
            }
            self.residual(step, before, state);
            let free = step.system.free.clone();
            if troubled || !is_finite(&self.correction[free.clone()]) {
                let (residual, tolerance, at_rounding) = self.largest_residual(free.clone());
                if troubled && at_rounding {
                    break;
                }
                if !residual.is_finite() || iteration == MAX_ITERATIONS {
                    let (time, iterations) = (step.time, iteration);
                    return Err(Error::Newton { time, iterations, residual, tolerance });
                }
            }
            if fresh {
                if troubled {
                    self.evaluate(step, before, state, true, work);
                }
                self.factor(step, work)?;
                tangents += 1;
            }
            let by_end = self.coefficients.end.recip();
            let right = &self.correction[free.clone()];
            let forces = &mut state.unbalanced[free.clone()][..right.len()];
            for i in 0..forces.len() {
                forces[i] += right[i] * by_end;
            }
            let [moved, turned] = self.correct(step, state, work);
            size = moved.max(turned);
            next = self.convergence.corrected([moved, turned], formed);
            if next == Next::Done && !self.slides_on(step, before, state, size) {
                // What is left cannot be predicted where springs begin to slip, or stick again.
                next = Next::Tangent;
            }
            if next != Next::Chord {
                let rod = self.viscous.as_ref().unwrap_or(&step.system.rod);
                let so_far = (tangents, next == Next::Done);
                self.tensions.corrected(rod, (&self.correction, moved), &state.q, so_far);
            }
            if next == Next::Done {
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

    /// Leaves tangent, factors and geometry behind at the solution.
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
        rod.measured_tangent(q, &before.frames, derivatives, (gradient, tangent), end);
        self.drag(step, [before, state], true);
        work.tangents += 1;
        self.factor(step, work)
    }

    /// Whether the last correction, m, let no spring of internal friction begin to slip or stick again.
    fn slides_on(
        &mut self,
        step: &Step<'_, D, R>,
        before: &State<D, R::Frames>,
        state: &State<D, R::Frames>,
        size: f64,
    ) -> bool {
        let Some(sliding) = &mut self.sliding else { return true };
        let elastic = &step.system.rod;
        sliding.look(elastic, &before.internal, (&state.q[..], &state.frames));
        // A corner leaves no more than the correction.
        let part = size / self.length;
        part <= self.tolerance.part() || sliding.goes_on(elastic, part)
    }

    /// Solves for the correction and takes it; returns how far it moves nodes, and turns directors, times the rod's length, m.
    fn correct(
        &mut self,
        step: &Step<'_, D, R>,
        state: &mut State<D, R::Frames>,
        work: &mut Work,
    ) -> [f64; 2] {
        self.factors.solve(&mut self.correction);
        self.sliding.iter_mut().for_each(|sliding| sliding.seen = false);
        let free = step.system.free.clone();
        let correction = &self.correction[free.clone()];
        let q = &mut state.q[free.clone()][..correction.len()];
        for i in 0..q.len() {
            q[i] += correction[i];
        }
        work.newton_iterations += 1;
        sizes::<D, R>(correction, free.start, self.length)
    }

    /// Factors `M (1 + h beta damping) + h^2 beta^2 K`.
    fn factor(&mut self, step: &Step<'_, D, R>, work: &mut Work) -> Result<(), Error> {
        work.factorizations += 1;
        let StepCoefficients { end, .. } = self.coefficients;
        let slope = self.coefficients.damped_velocity_slope();
        self.weights = [end * slope * step.system.damping.mass + 1.0, end];
        let [masses, tangent] = self.weights;
        let matrix = self.dragging.as_ref().map_or(&self.tangent, |dragging| &dragging.matrix);
        self.factors
            .factor_sum(step.system.rod.mass(), masses, matrix, tangent, step.system.free.clone())
            .map_err(|singular| Error::SingularTangent { time: step.time, row: singular.row })
    }

    /// Leaves minus the residual in `correction`.
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
        let forces = self.dragging.as_ref().map_or(&self.gradient, |dragging| &dragging.total);
        let correction = &mut self.correction[free.clone()];
        let mass_damping = step.system.damping.mass;

        n1.copy_from_slice(&forces[free.clone()]);
        let is_damped = mass_damping.value() != 0.0 || D::ORDER > 0;
        // Asked once for all unknowns.
        match a0 {
            None => {
                let coefficients = coefficients.without_acceleration();
                let none = |_| D::from(0.0);
                if is_damped {
                    coefficients.add_damping((mass, mass_damping), [q1, q0, v0], none, n1);
                }
                coefficients.residuals(mass, [q1, q0, v0, n1, n0], none, correction);
            }
            Some(a0) => {
                let a0 = &a0[..correction.len()];
                if is_damped {
                    coefficients.add_damping((mass, mass_damping), [q1, q0, v0], |i| a0[i], n1);
                }
                coefficients.residuals(mass, [q1, q0, v0, n1, n0], |i| a0[i], correction);
            }
        }
        step.system.led.fill(&mut self.correction, D::from(0.0));
    }

    /// Velocities, strain rates and frames at the solution.
    pub fn finish(
        &mut self,
        step: &Step<'_, D, R>,
        before: &State<D, R::Frames>,
        state: &mut State<D, R::Frames>,
        work: &mut Work,
    ) {
        self.guess.remember(before);
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
        if self.scheme == Scheme::GeneralisedAlpha {
            state.acceleration.resize(state.q.len(), D::from(0.0));
            let a1 = &mut state.acceleration[free.clone()];
            let lists = [q1, q0, v0, &*v1];
            match a0 {
                None => coefficients.accelerations(lists, |_| D::from(0.0), a1),
                Some(a0) => coefficients.accelerations(lists, |i| a0[i], a1),
            }
            step.system.led.fill(&mut state.acceleration, D::from(0.0));
        }
        step.system.lead(step.time, &mut state.v);
        if self.viscous.is_some() {
            let State { q, frames, internal, .. } = state;
            let rod = &step.system.rod;
            match &mut self.sliding {
                Some(sliding) => {
                    if !sliding.seen {
                        sliding.look(rod, &before.internal, (&q[..], frames));
                    }
                    internal.strain.clone_from(&sliding.strains);
                    internal.slid.clone_from(&sliding.slid);
                }
                None => rod.strains(q, frames, &mut internal.strain),
            }
            let (damping, z) = (&step.system.damping, &mut internal.relaxing);
            viscosity::relax(damping, step.h, &before.internal, &internal.strain, z);
            let changes = internal.strain.iter().zip(&before.internal.strain);
            internal.strain_rate.clear();
            internal.strain_rate.extend(changes.map(|(s1, s0)| (*s1 - *s0) * (1.0 / step.h)));
            self.find_forces(step.system, state);
            work.tangents += usize::from(self.keeps_tangent);
            work.gradients += usize::from(!self.keeps_tangent);
        } else if self.coefficients.averages() {
            state.unbalanced.fill(D::from(0.0));
        }
        R::rebase(&mut state.frames, &state.q);
    }
}
