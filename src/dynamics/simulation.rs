//! Stepping a rod through time.

use crate::dynamics::scheme::{END, Formulas};
use crate::dynamics::stepper::{Direct, Step};
use crate::energy::Derivatives;
use crate::error::Error;
use crate::numerics::banded::{BandMatrix, Ldlt};
use crate::numerics::scalar::{Nestable, Scalar};
use crate::problem::boundary::Drive;
use crate::rod::State;
use crate::rod::{Energies, Rod};
use crate::scene::supports::Moment;
use crate::scene::{Damping, Scheme};
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// A residual counts as rounding below this many times `eps * sum |J_ij| |x_j|`: coordinates are
/// stored to `eps/2`, and forming strains from them costs a few roundings more.
const ROUNDING: f64 = 8.0;
/// A Newton step below this part of the rod's length ends the iteration.
const SMALLEST_STEP: f64 = 1e-12;
/// After a Newton step below this part of the rod's length the next iterate is expected to be the
/// solution, so its tangent is formed only when that turns out wrong.
const LAST_STEP: f64 = 1e-8;
/// Quadratic convergence needs 2 to 5; a simulation that needs more than this has lost the branch.
const MAX_ITERATIONS: usize = 40;

/// What the work of a simulation consists of.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Work {
    /// Time steps.
    pub steps: usize,
    /// Newton iterations: linear solves for a correction of the step.
    pub newton_iterations: usize,
    /// Band factorisations.
    pub factorizations: usize,
    /// Evaluations of gradient and tangent.
    pub tangents: usize,
    /// Evaluations of the gradient alone.
    pub gradients: usize,
}

impl std::ops::AddAssign for Work {
    fn add_assign(&mut self, other: Self) {
        self.steps += other.steps;
        self.newton_iterations += other.newton_iterations;
        self.factorizations += other.factorizations;
        self.tangents += other.tangents;
        self.gradients += other.gradients;
    }
}

/// A rod, its state, and the room a step needs. Generic over the scalar: with dual numbers the
/// whole simulation carries derivatives.
#[derive(Clone, Debug)]
pub struct Simulation<D: Nestable, R: Rod<D, W>, const W: usize> {
    rod: R,
    /// The rod with Kelvin-Voigt stress over the current step, or of an averaging scheme that stress
    /// alone; only when damped.
    viscous: Option<R>,
    /// What that stress alone is made from.
    dashpots: Option<R>,
    free: Range<usize>,
    damping: Damping<D>,
    scheme: Scheme,
    beta: D,
    /// The scheme, where its steps need no iteration.
    direct: Option<Direct<D, W>>,
    length: f64,
    derivatives: Derivatives,
    keep_tangent: bool,
    /// The supports that move.
    drive: Option<Drive<D>>,
    state: State<D, R::Frames>,
    previous: State<D, R::Frames>,
    work: Work,
    gradient: Vec<D>,
    tangent: BandMatrix<D, W>,
    /// Factors of masses and tangent in the factored matrix.
    parts: [D; 2],
    factors: Ldlt<D, W>,
    correction: Vec<D>,
    rounding: Vec<f64>,
    shift: Vec<D>,
    /// Where the forces of an averaging scheme were taken.
    stages: Vec<StageForces<D, W>>,
}

/// Forces on the way through a step.
#[derive(Clone, Debug)]
pub struct StageForces<D, const W: usize> {
    /// Unknowns there.
    pub q: Vec<D>,
    /// Elastic gradient less loads there.
    pub gradient: Vec<D>,
    /// Its tangent.
    pub tangent: BandMatrix<D, W>,
}

impl<D: Nestable, R: Rod<D, W>, const W: usize> Simulation<D, R, W> {
    /// A rod at rest at `q` with the given frames. Only the unknowns in `free` move. `length`, m,
    /// is the scale of the stopping rule.
    pub fn new(
        rod: R,
        (q, frames): (Vec<D>, R::Frames),
        free: Range<usize>,
        damping: Damping<D>,
        (scheme, beta): (Scheme, D),
        length: f64,
        derivatives: Derivatives,
    ) -> Self {
        let direct = Direct::of(scheme, rod.mass());
        // What iterations need room for.
        let n = if direct.is_some() { 0 } else { q.len() };
        let mut state = State::at_rest(q, frames);
        let viscous = (damping.stiffness.value() > 0.0).then(|| {
            rod.strains(&state.q, &state.frames, &mut state.strain);
            state.strain_rate = vec![D::from(0.0); state.strain.len()];
            if scheme == Scheme::AverageVectorField { rod.dashpots() } else { rod.clone() }
        });
        let mut simulation = Self {
            dashpots: viscous.clone().filter(|_| scheme == Scheme::AverageVectorField),
            rod,
            viscous,
            free,
            damping,
            scheme,
            beta,
            direct,
            length,
            derivatives,
            keep_tangent: false,
            drive: None,
            previous: state.clone(),
            shift: state.strain.clone(),
            state,
            work: Work::default(),
            gradient: vec![D::from(0.0); n],
            tangent: BandMatrix::zeros(n),
            parts: [D::from(1.0), D::from(0.0)],
            factors: Ldlt::with_order(n),
            correction: vec![D::from(0.0); n],
            rounding: vec![0.0; n],
            stages: Vec::new(),
        };
        simulation.find_forces();
        simulation
    }

    /// Leaves the factors of the step's tangent at its solution behind, as sensitivities need it.
    pub fn keep_tangent(&mut self) {
        self.keep_tangent = true;
    }

    /// Moves supports.
    pub fn drive(&mut self, drive: Drive<D>) {
        drive.velocities(self.state.time, &mut self.state.v);
        self.drive = Some(drive);
        self.find_forces();
    }

    /// The forces that the next step counts by its start.
    fn find_forces(&mut self) {
        let Self { state, rod, viscous, dashpots, shift, .. } = self;
        let State { q, frames, v, strain, strain_rate, unbalanced, .. } = state;
        let scheme = Formulas::new(self.scheme, self.beta, 1.0);
        match viscous {
            Some(viscous) => {
                let eta = self.damping.stiffness;
                for (shift, (strain, rate)) in shift.iter_mut().zip(strain.iter().zip(strain_rate))
                {
                    *shift = scheme.viscous_shift_at(eta, *strain, *rate);
                }
                viscous.set_viscous(dashpots.as_ref().unwrap_or(rod), D::from(1.0), shift);
                viscous.gradient(q, frames, self.derivatives, unbalanced);
            }
            None if self.scheme == Scheme::AverageVectorField => unbalanced.fill(D::from(0.0)),
            None => rod.gradient(q, frames, self.derivatives, unbalanced),
        }
        if self.scheme == Scheme::NewmarkBeta {
            for i in self.free.clone() {
                unbalanced[i] += self.damping.mass * rod.mass()[i] * v[i];
            }
        }
    }

    /// The supports that move.
    pub(crate) fn driven(&self) -> Option<&Drive<D>> {
        self.drive.as_ref()
    }
    /// The rod.
    pub fn rod(&self) -> &R {
        &self.rod
    }
    /// The state now.
    pub fn state(&self) -> &State<D, R::Frames> {
        &self.state
    }
    /// The state before the last step.
    pub fn previous(&self) -> &State<D, R::Frames> {
        &self.previous
    }
    /// The formulas of the last step with the scheme's parameter as given; of a scheme that iterates.
    pub fn formulas<E: Scalar>(&self, beta: E) -> Formulas<E> {
        Formulas::new(self.scheme, beta, self.state.time - self.previous.time)
    }
    /// The forces on the way through the last step, one per stage of an averaging scheme, and the
    /// viscous ones at its end.
    pub fn stages(&self) -> &[StageForces<D, W>] {
        &self.stages
    }
    /// What the viscous stress of an averaging scheme is made from.
    pub fn dashpots(&self) -> Option<&R> {
        self.dashpots.as_ref()
    }
    /// The unknowns that move.
    pub fn free(&self) -> Range<usize> {
        self.free.clone()
    }
    /// Both dampings.
    pub fn damping(&self) -> Damping<D> {
        self.damping
    }
    /// The scheme's parameter.
    pub fn beta(&self) -> D {
        self.beta
    }
    /// The scale of the stopping rule, m.
    pub fn length(&self) -> f64 {
        self.length
    }
    /// The work so far.
    pub fn work(&self) -> Work {
        self.work
    }
    /// Whether steps need no iteration, so that derivatives come from the same step in dual numbers.
    pub fn is_direct(&self) -> bool {
        self.direct.is_some()
    }
    /// Which derivatives are used.
    pub fn derivatives(&self) -> Derivatives {
        self.derivatives
    }
    /// Elastic gradient less loads at the last step's solution, in its frames, N; as tangent and
    /// factors, of a scheme that iterates.
    pub fn gradient(&self) -> &[D] {
        &self.gradient
    }
    /// The tangent of that gradient; at the solution after [`keep_tangent`](Self::keep_tangent).
    pub fn tangent(&self) -> &BandMatrix<D, W> {
        &self.tangent
    }
    /// Factors of the last step's tangent `M + h^2 beta^2 dn1/dq1`; at its solution after
    /// [`keep_tangent`](Self::keep_tangent).
    pub fn factors(&self) -> &Ldlt<D, W> {
        &self.factors
    }

    /// Gives the rod a velocity, m/s (rad/s for angles); entries outside the free unknowns are
    /// ignored.
    pub fn set_velocity(&mut self, v: &[D]) {
        for i in self.free.clone() {
            self.state.v[i] = v[i];
        }
        self.find_forces();
    }

    /// Kinetic energy now, J.
    pub fn kinetic_energy(&self) -> f64 {
        let twice = |mass: &D, v: &D| mass.value() * v.value() * v.value();
        let (masses, rest_mass) = self.rod.mass()[self.free.clone()].as_chunks::<4>();
        let (velocities, rest_v) = self.state.v[self.free.clone()].as_chunks::<4>();
        // Four sums side by side: the guard looks at it after every step.
        let mut sums = [0.0; 4];
        for (mass, v) in masses.iter().zip(velocities) {
            for k in 0..4 {
                sums[k] += twice(&mass[k], &v[k]);
            }
        }
        let rest: f64 = rest_mass.iter().zip(rest_v).map(|(mass, v)| twice(mass, v)).sum();
        0.5 * (sums.iter().sum::<f64>() + rest)
    }

    /// All energies now, J.
    pub fn energies(&self) -> Energies {
        let kinetic = self.kinetic_energy();
        let mut energies = self.rod.energies(&self.state.q, &self.state.frames);
        energies.potential += self.state.wound;
        Energies { kinetic, ..energies }
    }

    /// No less than the energy, J, of a change of all coordinates by `part` of themselves that
    /// takes `h`, s.
    pub(crate) fn energy_of_motion_by(&self, part: f64, h: f64) -> f64 {
        let State { q, frames, .. } = &self.state;
        let n = q.len();
        let (mut gradient, mut tangent) = (vec![D::from(0.0); n], BandMatrix::zeros(n));
        self.rod.tangent(q, frames, self.derivatives, &mut gradient, &mut tangent);
        let mut forces = vec![0.0; n];
        tangent.absolute_product(q, &mut forces);
        let of = |i: usize| {
            let (mass, q) = (self.rod.mass()[i].value(), q[i].value().abs());
            forces[i] * q + mass * (q / h) * (q / h)
        };
        0.5 * part * part * self.free.clone().map(of).sum::<f64>()
    }

    /// Advances to `time`, s. On an error the state is what it was before the step.
    pub fn step_to(&mut self, time: f64) -> Result<(), Error> {
        let Some(direct) = &mut self.direct else { return self.iterate_to(time) };
        self.previous.restore(&self.state);
        let step = Step {
            rod: &self.rod,
            derivatives: self.derivatives,
            free: self.free.clone(),
            drag: self.damping.mass,
            h: time - self.previous.time,
        };
        let outcome = direct.step(&step, &mut self.state);
        self.state.time = time;
        let error = match outcome {
            Err(singular) => Error::SingularTangent { time, row: singular.row },
            Ok(_) if !is_finite(&self.state.v) => Error::Unstable { time },
            Ok(work) => match self.check_folds() {
                Ok(()) => {
                    self.state.wound += self.rod.wound(&self.previous.q, &self.state.q);
                    self.work += Work { steps: 1, ..work };
                    return Ok(());
                }
                Err(error) => error,
            },
        };
        self.state.restore(&self.previous);
        Err(error)
    }

    fn iterate_to(&mut self, time: f64) -> Result<(), Error> {
        std::mem::swap(&mut self.state, &mut self.previous);
        let scheme = Formulas::new(self.scheme, self.beta, time - self.previous.time);
        self.predict(&scheme, time);
        if let Err(error) = self.solve(&scheme).and_then(|()| self.check_folds()) {
            self.state.restore(&self.previous);
            return Err(error);
        }
        self.finish(&scheme);
        self.state.wound = self.previous.wound + self.rod.wound(&self.previous.q, &self.state.q);
        self.work.steps += 1;
        Ok(())
    }

    /// Takes back the last step.
    pub fn step_back(&mut self) {
        self.state.restore(&self.previous);
    }

    fn check_folds(&self) -> Result<(), Error> {
        let State { time, q, .. } = &self.state;
        match self.rod.folded(&self.previous.q, q, &self.previous.frames) {
            Some(node) => Err(Error::Fold { time: *time, node }),
            None => Ok(()),
        }
    }

    /// The guess q0 + h v0, and the viscous rod of this step.
    fn predict(&mut self, scheme: &Formulas<D>, time: f64) {
        self.state.time = time;
        self.state.frames.clone_from(&self.previous.frames);
        for (q, (q0, v0)) in
            self.state.q.iter_mut().zip(self.previous.q.iter().zip(&self.previous.v))
        {
            *q = *q0 + *v0 * scheme.h;
        }
        if let Some(drive) = &self.drive {
            let State { q, frames, v, .. } = &mut self.state;
            // Held angles count on from where they were.
            for (q, q0) in q.iter_mut().zip(&self.previous.q).take(self.free.start) {
                *q = *q0;
            }
            let end = self.free.end;
            q[end..].copy_from_slice(&self.previous.q[end..]);
            let [from, to] = [self.previous.time, time].map(Moment::Time);
            drive.advance::<R, W>(from, to, q, frames);
            drive.velocities(time, v);
        }
        self.set_viscous(scheme);
    }

    /// The rod with the viscous stress at the end of the step.
    fn set_viscous(&mut self, scheme: &Formulas<D>) {
        if let Some(viscous) = &mut self.viscous {
            let eta = self.damping.stiffness;
            let before = self.previous.strain.iter().zip(&self.previous.strain_rate);
            for (shift, (strain, rate)) in self.shift.iter_mut().zip(before) {
                *shift = scheme.viscous_shift(eta, *strain, *rate);
            }
            let base = self.dashpots.as_ref().unwrap_or(&self.rod);
            viscous.set_viscous(base, scheme.viscous_factor(eta), &self.shift);
        }
    }

    /// The gradient, with its tangent by the unknowns at the end if asked for.
    fn evaluate(&mut self, scheme: &Formulas<D>, with_tangent: bool) {
        if scheme.averages() {
            self.average(scheme, with_tangent);
        } else {
            let rod = self.viscous.as_ref().unwrap_or(&self.rod);
            let Self { state: State { q, frames, .. }, gradient, tangent, .. } = self;
            match with_tangent {
                true => rod.tangent(q, frames, self.derivatives, gradient, tangent),
                false => rod.gradient(q, frames, self.derivatives, gradient),
            }
        }
        self.work.tangents += usize::from(with_tangent);
        self.work.gradients += usize::from(!with_tangent);
    }

    /// The mean gradient over the straight way from the start of the step to its end, and the viscous
    /// forces at the end.
    fn average(&mut self, scheme: &Formulas<D>, with_tangent: bool) {
        let n = self.gradient.len();
        if self.stages.is_empty() {
            let q = vec![D::from(0.0); n];
            let forces = StageForces { gradient: q.clone(), q, tangent: BandMatrix::zeros(n) };
            self.stages = vec![forces; scheme.stages.len() + usize::from(self.viscous.is_some())];
        }
        self.gradient.fill(D::from(0.0));
        if with_tangent {
            self.tangent.clear();
        }
        for (k, forces) in self.stages.iter_mut().enumerate() {
            let (rod, stage) = match (scheme.stages.get(k), &self.viscous) {
                (None, Some(viscous)) => (viscous, &END),
                (stage, _) => (&self.rod, stage.unwrap_or(&END)),
            };
            let frames = &self.state.frames;
            let StageForces { q, gradient, tangent } = forces;
            let ends = self.previous.q.iter().zip(&self.state.q);
            for (q, (start, end)) in q.iter_mut().zip(ends) {
                *q = *start + (*end - *start) * stage.place;
            }
            match with_tangent {
                true => {
                    rod.tangent(q, frames, self.derivatives, gradient, tangent);
                    self.tangent.add_scaled(tangent, stage.weight * stage.place);
                }
                false => rod.gradient(q, frames, self.derivatives, gradient),
            }
            for (sum, gradient) in self.gradient.iter_mut().zip(gradient) {
                *sum += *gradient * stage.weight;
            }
        }
    }

    /// Newton's method. Stops when the residual is rounding error or the correction vanishes;
    /// numbers that carry derivatives get one more correction per order.
    fn solve(&mut self, scheme: &Formulas<D>) -> Result<(), Error> {
        let mut expect_solution = false;
        let mut last = false;
        let mut polish = D::ORDER;
        for iteration in 0..=MAX_ITERATIONS + D::ORDER {
            let with_tangent = !expect_solution;
            self.evaluate(scheme, with_tangent);
            if iteration == 0 {
                self.set_rounding(scheme);
            }
            let (residual, tolerance, at_rounding) = self.residual(scheme);
            if !residual.is_finite() || (iteration >= MAX_ITERATIONS && !last && !at_rounding) {
                return Err(Error::Newton {
                    time: self.state.time,
                    iterations: iteration,
                    residual,
                    tolerance,
                });
            }
            let done = last || at_rounding;
            if done && polish == 0 {
                if self.keep_tangent {
                    self.ensure_tangent(scheme, with_tangent);
                    self.factor(scheme)?;
                }
                return Ok(());
            }
            polish -= usize::from(done);

            self.ensure_tangent(scheme, with_tangent);
            self.factor(scheme)?;
            self.factors.solve(&mut self.correction);
            let mut largest = 0.0_f64;
            for i in self.free.clone() {
                self.state.q[i] += self.correction[i];
                let unit = if R::is_angle(i) { self.length } else { 1.0 };
                largest = largest.max(self.correction[i].value().abs() * unit);
            }
            self.work.newton_iterations += 1;
            last = done || largest <= SMALLEST_STEP * self.length;
            expect_solution = !self.keep_tangent && largest <= LAST_STEP * self.length;
        }
        unreachable!("the last iteration returns")
    }

    fn ensure_tangent(&mut self, scheme: &Formulas<D>, there: bool) {
        if !there {
            self.evaluate(scheme, true);
        }
    }

    /// Factors `M (1 + h beta damping) + h^2 beta^2 K`.
    fn factor(&mut self, scheme: &Formulas<D>) -> Result<(), Error> {
        self.work.factorizations += 1;
        self.parts = [self.mass_factor(scheme), scheme.end];
        let [masses, tangent] = self.parts;
        self.factors
            .factor_sum(self.rod.mass(), masses, &self.tangent, tangent, self.free.clone())
            .map_err(|singular| Error::SingularTangent { time: self.state.time, row: singular.row })
    }

    /// Refuses a solution `x` of the factored tangent and right-hand side `b` that is not one to
    /// about half of all digits. A positive definite tangent is always solved well; one with
    /// negative pivots may not be. (Newton's corrections need no such check: the next residual is
    /// it.)
    pub fn check_solution(&self, x: &[D], b: &[D]) -> Result<(), Error> {
        if self.factors.negative_pivots() == 0 {
            return Ok(());
        }
        let [masses, tangent] = self.parts;
        let mass = self.rod.mass();
        let rest: Vec<D> = (0..x.len()).map(|i| b[i] - mass[i] * masses * x[i]).collect();
        let scaled: Vec<D> = rest.iter().map(|r| *r / tangent).collect();
        let largest =
            |v: &mut dyn Iterator<Item = D>| v.map(|r| r.value().abs()).fold(0.0_f64, f64::max);
        let residual = self.tangent.residual(self.free.clone(), x, &scaled);
        let error = largest(&mut residual.into_iter()) * tangent.value();
        let size = largest(&mut rest[self.free.clone()].iter().copied())
            + largest(&mut b[self.free.clone()].iter().copied());
        match error <= 1e-8 * size {
            true => Ok(()),
            false => Err(Error::SingularTangent { time: self.state.time, row: self.free.start }),
        }
    }

    fn mass_factor(&self, scheme: &Formulas<D>) -> D {
        scheme.end * scheme.drag_rate() * self.damping.mass + 1.0
    }

    /// Rounding level of each residual.
    fn set_rounding(&mut self, scheme: &Formulas<D>) {
        self.tangent.absolute_product(&self.state.q, &mut self.rounding);
        let end = scheme.end.value();
        let masses = self.rod.mass().iter().zip(&self.state.q);
        for (level, (mass, q)) in self.rounding.iter_mut().zip(masses) {
            *level = ROUNDING * f64::EPSILON * (end * *level + mass.value() * q.value().abs());
        }
    }

    /// Leaves minus the residual in `correction`; returns its largest entry, that entry's
    /// rounding level, and whether all entries are at theirs.
    fn residual(&mut self, scheme: &Formulas<D>) -> (f64, f64, bool) {
        let free = self.free.clone();
        let (now, before) = (&mut self.state, &self.previous);
        let (q1, n1) = (&now.q[free.clone()], &mut now.unbalanced[free.clone()]);
        let (q0, v0) = (&before.q[free.clone()], &before.v[free.clone()]);
        let n0 = &before.unbalanced[free.clone()];
        let mass = &self.rod.mass()[free.clone()];
        let gradient = &self.gradient[free.clone()];
        let rounding = &self.rounding[free.clone()];
        let correction = &mut self.correction[free.clone()];
        let drag = self.damping.mass;
        let dragged = drag.value() != 0.0 || D::ORDER > 0;

        let (mut largest, mut level, mut at_rounding) = (0.0_f64, 0.0, true);
        for i in 0..free.len() {
            let change = q1[i] - q0[i];
            n1[i] = gradient[i];
            if dragged {
                n1[i] += drag * mass[i] * scheme.dragged(change, v0[i]);
            }
            let residual = scheme.residual(mass[i], change, v0[i], n1[i], n0[i]);
            correction[i] = -residual;
            let size = residual.value().abs();
            at_rounding &= size <= rounding[i];
            if size > largest || size.is_nan() {
                (largest, level) = (size, rounding[i]);
            }
        }
        (largest, level, at_rounding)
    }

    /// Velocities, strain rates and frames at the solution.
    fn finish(&mut self, scheme: &Formulas<D>) {
        let Self { state, previous, .. } = self;
        for i in self.free.clone() {
            state.v[i] = scheme.rate(state.q[i] - previous.q[i], previous.v[i]);
        }
        if self.viscous.is_some() {
            self.rod.strains(&state.q, &state.frames, &mut state.strain);
            state.strain_rate.clear();
            let changes = state.strain.iter().zip(&previous.strain).map(|(s1, s0)| *s1 - *s0);
            state.strain_rate.extend(changes.map(|change| change * (1.0 / scheme.h)));
            self.find_forces();
            self.work.gradients += 1;
        } else if scheme.averages() {
            state.unbalanced.fill(D::from(0.0));
        }
        R::rebase(&mut self.state.frames, &self.state.q);
    }
}

/// Whether all numbers are finite, by four sums side by side.
fn is_finite<D: Scalar>(x: &[D]) -> bool {
    let (chunks, rest) = x.as_chunks::<4>();
    let mut sums = [0.0; 4];
    for chunk in chunks {
        for k in 0..4 {
            sums[k] += chunk[k].value();
        }
    }
    sums.iter().copied().chain(rest.iter().map(D::value)).sum::<f64>().is_finite()
}
