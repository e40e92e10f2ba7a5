//! Derivatives of a trajectory with respect to a parameter, by the implicit function theorem.
//!
//! A converged step satisfies `R(q1; q0, v0, n0, p) = 0`, so its derivative solves
//! `J dq1 = -dR|q1` with the tangent `J` of the step at its solution. `dR|q1` is the step's own
//! residual formula evaluated in dual numbers with `q1` held: one scheme, written once.
//!
//! The oracle is the whole simulation run in dual numbers
//! ([`Discretized::simulation_over`](crate::Discretized::simulation_over)).

use crate::dynamics::coefficients::{END, StepCoefficients};
use crate::dynamics::linearization::Linearization;
use crate::dynamics::simulation::Simulation;
use crate::dynamics::stepper::Newton;
use crate::error::Error;
use crate::problem::boundary::BoundaryMotion;
use crate::rod::{InternalVariables, Rod};
use crate::scene::Damping;
use crate::scene::supports::Moment;
use num_dual::Dual64;

/// The derivative of a simulation's state with respect to one parameter.
#[derive(Clone, Debug)]
pub enum Sensitivity<S: Rod<Dual64, W>, const W: usize> {
    /// That of a scheme whose steps are equations: by the implicit function theorem.
    Implicit(Box<ImplicitSensitivity<S, W>>),
    /// That of any other scheme: the same step in dual numbers. The first of them makes the
    /// simulation's steps too.
    Direct {
        /// What goes along.
        simulation: Box<Simulation<Dual64, S, W>>,
        /// dq/dp.
        q: Vec<f64>,
        /// dv/dp.
        v: Vec<f64>,
    },
}

impl<S: Rod<Dual64, W>, const W: usize> Sensitivity<S, W> {
    /// At the start of a simulation whose numbers all carry the parameter's derivative.
    pub fn new(simulation: Simulation<Dual64, S, W>) -> Self {
        if let Some(newton) = simulation.newton() {
            return Self::Implicit(Box::new(ImplicitSensitivity::new(&simulation, newton)));
        }
        let rates = |x: &[Dual64]| x.iter().map(|x| x.eps).collect();
        let (q, v) = (rates(&simulation.state().q), rates(&simulation.state().v));
        Self::Direct { simulation: Box::new(simulation), q, v }
    }

    /// dq/dp.
    pub fn q(&self) -> &[f64] {
        match self {
            Self::Implicit(sensitivity) => &sensitivity.q,
            Self::Direct { q, .. } => q,
        }
    }

    /// dv/dp.
    pub fn v(&self) -> &[f64] {
        match self {
            Self::Implicit(sensitivity) => &sensitivity.v,
            Self::Direct { v, .. } => v,
        }
    }
}

/// The derivative of an implicit step's solution.
#[derive(Clone, Debug)]
pub struct ImplicitSensitivity<S: Rod<Dual64, W>, const W: usize> {
    rod: S,
    viscous: Option<S>,
    /// The supports that move.
    boundary_motion: Option<BoundaryMotion<Dual64>>,
    /// Whether the parameter moves what supports hold.
    moves_supports: bool,
    dashpots: Option<S>,
    damping: Damping<Dual64>,
    parameter: Dual64,
    q: Vec<f64>,
    v: Vec<f64>,
    acceleration: Vec<f64>,
    /// The frames with their derivatives.
    frames: S::Frames,
    unbalanced: Vec<f64>,
    /// Derivatives of the internal variables.
    internal: InternalVariables<f64>,
    /// Gradient rate at fixed unknowns.
    direct: Vec<f64>,
    /// dq0/dp, kept while q becomes dq1/dp.
    start: Vec<f64>,
    shift: Vec<Dual64>,
    dual_q: Vec<Dual64>,
    dual_strain: Vec<Dual64>,
    dual_forces: Vec<Dual64>,
}

/// The accelerations that a step goes on from, with their derivatives; zero where it does not.
struct Accelerations<'a>(Option<(&'a [f64], &'a [f64])>);

impl<'a> Accelerations<'a> {
    #[inline]
    fn of<R: Rod<f64, W>, const W: usize>(
        coefficients: &StepCoefficients<Dual64>,
        step: &Linearization<'a, f64, R, W>,
        rates: &'a [f64],
    ) -> Self {
        let free = step.free.clone();
        let both = || (&step.before.acceleration[free.clone()], &rates[free.clone()]);
        Self(coefficients.acceleration.as_ref().map(|_| both()))
    }

    #[inline]
    fn at(&self, i: usize) -> Dual64 {
        self.0.map_or(Dual64::from(0.0), |(a, rates)| Dual64::new(a[i], rates[i]))
    }
}

impl<S: Rod<Dual64, W>, const W: usize> ImplicitSensitivity<S, W> {
    fn new(simulation: &Simulation<Dual64, S, W>, newton: &Newton<Dual64, S, W>) -> Self {
        let state = simulation.state();
        let zero = vec![0.0; state.q.len()];
        let rates = |x: &[Dual64]| x.iter().map(|x| x.eps).collect::<Vec<f64>>();
        let (strains, n) = (state.internal.strain.len(), state.q.len());
        let rod = simulation.rod().clone();
        let free = simulation.free();
        let held = (0..state.q.len()).filter(|i| !free.contains(i));
        let boundary_motion = simulation.boundary_motion().cloned();
        Self {
            moves_supports: boundary_motion.is_some()
                || held.map(|i| state.q[i].eps).any(|rate| rate != 0.0),
            boundary_motion,
            viscous: (strains > 0).then(|| newton.dashpots().unwrap_or(&rod).clone()),
            dashpots: newton.dashpots().cloned(),
            rod,
            damping: simulation.damping(),
            parameter: newton.parameter(),
            frames: state.frames.clone(),
            q: rates(&state.q),
            v: rates(&state.v),
            acceleration: rates(&state.acceleration),
            unbalanced: rates(&state.unbalanced),
            internal: InternalVariables {
                strain: rates(&state.internal.strain),
                strain_rate: rates(&state.internal.strain_rate),
            },
            direct: zero.clone(),
            start: zero,
            shift: vec![Dual64::from(0.0); strains],
            dual_q: Vec::new(),
            dual_strain: Vec::new(),
            dual_forces: if strains > 0 { vec![Dual64::from(0.0); n] } else { Vec::new() },
        }
    }

    /// The right-hand side `-dR|q1` of a step, left in `q`.
    fn prepare<R>(&mut self, step: &Linearization<'_, f64, R, W>)
    where
        R: Rod<f64, W, Dual = S>,
    {
        let coefficients = step.coefficients(self.parameter);
        let (before, now) = (step.before, step.after);
        let held = self.held(step);
        if coefficients.averages() {
            self.average_rate(&coefficients, step, &held);
        } else {
            self.set_viscous(&coefficients, step);
            let rod = self.viscous.as_ref().unwrap_or(&self.rod);
            let (frames, direct) = (&self.frames, &mut self.direct);
            R::gradient_rate(rod, &now.q, frames, step.derivatives, direct);
            R::frame_rate(frames, &now.q, step.gradient, step.tangent, direct);
            for (i, rate, _) in &held {
                step.tangent.add_column(*i, *rate, direct);
            }
        }
        self.start.copy_from_slice(&self.q);
        for (i, q, v) in held {
            (self.q[i], self.v[i]) = (q, v);
        }
        let free = step.free.clone();
        let (q1, gradient) = (&now.q[free.clone()], &step.gradient[free.clone()]);
        let (q0, v0) = (&before.q[free.clone()], &before.v[free.clone()]);
        let n0 = &before.unbalanced[free.clone()];
        let (dq, dv) = (&mut self.q[free.clone()], &self.v[free.clone()]);
        let (dn, direct) = (&self.unbalanced[free.clone()], &mut self.direct[free.clone()]);
        let a0 = Accelerations::of(&coefficients, step, &self.acceleration);
        let mass = &self.rod.mass()[free.clone()];
        let mass_damping = self.damping.mass;
        let damped = mass_damping.re != 0.0 || mass_damping.eps != 0.0;
        for i in 0..free.len() {
            let change = Dual64::new(q1[i] - q0[i], -dq[i]);
            let v0 = Dual64::new(v0[i], dv[i]);
            let a0 = a0.at(i);
            let mut n1 = Dual64::new(gradient[i], direct[i]);
            if damped {
                n1 += mass_damping * mass[i] * coefficients.damped_velocity(change, v0, a0);
                direct[i] = n1.eps;
            }
            let n0 = Dual64::new(n0[i], dn[i]);
            dq[i] = -coefficients.residual(mass[i], change, [v0, a0], n1, n0).eps;
        }
    }

    /// The unknowns that supports hold, with the derivatives of their places and velocities at the
    /// end of the step; none where the parameter does not move them.
    fn held<R>(&mut self, step: &Linearization<'_, f64, R, W>) -> Vec<(usize, f64, f64)>
    where
        R: Rod<f64, W, Dual = S>,
    {
        if !self.moves_supports {
            return Vec::new();
        }
        let now = step.after;
        let free = step.free.clone();
        let held = (0..now.q.len()).filter(|i| !free.contains(i));
        let Some(boundary_motion) = &self.boundary_motion else {
            return held.map(|i| (i, self.q[i], 0.0)).collect();
        };
        let dual = |x: &[f64], rates: &[f64]| -> Vec<Dual64> {
            x.iter().zip(rates).map(|(x, rate)| Dual64::new(*x, *rate)).collect()
        };
        let (mut q, mut v) = (dual(&now.q, &self.q), dual(&now.v, &self.v));
        let moment = Moment::Time(now.time);
        boundary_motion.advance::<S, W>(moment, moment, &mut q, &self.frames);
        boundary_motion.velocities(now.time, &mut v);
        held.map(|i| (i, q[i].eps, v[i].eps)).collect()
    }

    /// The rod with the viscous stress at the end of the step, and its derivative.
    fn set_viscous<R>(
        &mut self,
        coefficients: &StepCoefficients<Dual64>,
        step: &Linearization<'_, f64, R, W>,
    ) where
        R: Rod<f64, W, Dual = S>,
    {
        let before = step.before;
        if let Some(viscous) = &mut self.viscous {
            let eta = self.damping.stiffness;
            for (i, shift) in self.shift.iter_mut().enumerate() {
                let strain = Dual64::new(before.internal.strain[i], self.internal.strain[i]);
                let rate =
                    Dual64::new(before.internal.strain_rate[i], self.internal.strain_rate[i]);
                *shift = coefficients.viscous_shift(eta, strain, rate);
            }
            let base = self.dashpots.as_ref().unwrap_or(&self.rod);
            viscous.set_viscous(base, coefficients.viscous_factor(eta), &self.shift);
        }
    }

    /// The derivative of the mean gradient at a fixed end of the step: by the parameter, the frames
    /// and the start.
    fn average_rate<R>(
        &mut self,
        coefficients: &StepCoefficients<Dual64>,
        step: &Linearization<'_, f64, R, W>,
        held: &[(usize, f64, f64)],
    ) where
        R: Rod<f64, W, Dual = S>,
    {
        let mut sum = vec![0.0; self.direct.len()];
        self.set_viscous(coefficients, step);
        for (k, forces) in step.stages.iter().enumerate() {
            let (rod, stage) = match (coefficients.stages.get(k), &self.viscous) {
                (None, Some(viscous)) => (viscous, &END),
                (stage, _) => (&self.rod, stage.unwrap_or(&END)),
            };
            let (frames, direct) = (&self.frames, &mut self.direct);
            R::gradient_rate(rod, &forces.q, frames, step.derivatives, direct);
            R::frame_rate(frames, &forces.q, &forces.gradient, &forces.tangent, direct);
            for (j, start) in self.q.iter().enumerate() {
                forces.tangent.add_column(j, start * (1.0 - stage.place), direct);
            }
            for (i, rate, _) in held {
                forces.tangent.add_column(*i, rate * stage.place, direct);
            }
            for (sum, direct) in sum.iter_mut().zip(direct) {
                *sum += stage.weight * *direct;
            }
        }
        self.direct = sum;
    }

    /// Takes the solution `dq1` and derives the rest of the state from it.
    fn finish<R>(&mut self, step: &Linearization<'_, f64, R, W>, solution: &[f64])
    where
        R: Rod<f64, W, Dual = S>,
    {
        let coefficients = step.coefficients(self.parameter);
        let (before, now) = (step.before, step.after);
        let free = step.free.clone();
        let by_end = coefficients.end.re.recip();
        let mass = &self.rod.mass()[free.clone()];
        let (q1, q0) = (&now.q[free.clone()], &before.q[free.clone()]);
        let v0 = &before.v[free.clone()];
        let (dq, start) = (&mut self.q[free.clone()], &self.start[free.clone()]);
        let (dv, dn) = (&mut self.v[free.clone()], &mut self.unbalanced[free.clone()]);
        let (direct, solution) = (&self.direct[free.clone()], &solution[free.clone()]);
        self.acceleration.resize(now.acceleration.len(), 0.0);
        for i in 0..free.len() {
            // dn1 = dn1|q1 + (J - M) dq1 / (h beta)^2, and J dq1 is the right-hand side.
            dn[i] = direct[i] + (dq[i] - mass[i].re * solution[i]) * by_end;
            let change = Dual64::new(q1[i] - q0[i], solution[i] - start[i]);
            let v0 = Dual64::new(v0[i], dv[i]);
            let a0 = Accelerations::of(&coefficients, step, &self.acceleration).at(i);
            let v1 = coefficients.velocity(change, v0, a0);
            dv[i] = v1.eps;
            if let Some(acceleration) = self.acceleration.get_mut(free.start + i) {
                *acceleration = coefficients.acceleration_at_end(change, [v0, v1], a0).eps;
            }
            dq[i] = solution[i];
        }
        if self.viscous.is_some() || S::HAS_FRAMES {
            self.dual_q.clear();
            self.dual_q.extend(now.q.iter().zip(&self.q).map(|(q, dq)| Dual64::new(*q, *dq)));
        }
        if let Some(viscous) = &mut self.viscous {
            self.rod.strains(&self.dual_q, &self.frames, &mut self.dual_strain);
            let eta = self.damping.stiffness;
            for (i, strain) in self.dual_strain.iter().enumerate() {
                let slope = (strain.eps - self.internal.strain[i]) / coefficients.h;
                let rate = Dual64::new(now.internal.strain_rate[i], slope);
                self.shift[i] = coefficients.viscous_shift_at(eta, *strain, rate);
                self.internal.strain[i] = strain.eps;
                self.internal.strain_rate[i] = slope;
            }
            let base = self.dashpots.as_ref().unwrap_or(&self.rod);
            viscous.set_viscous(base, Dual64::from(1.0), &self.shift);
            let forces = &mut self.dual_forces;
            viscous.gradient(&self.dual_q, &self.frames, step.derivatives, forces);
            let mass_damping =
                if coefficients.averages() { Dual64::from(0.0) } else { self.damping.mass };
            for i in step.free.clone() {
                let v = Dual64::new(now.v[i], self.v[i]);
                self.unbalanced[i] = (forces[i] + mass_damping * self.rod.mass()[i] * v).eps;
            }
        } else if coefficients.averages() {
            self.unbalanced.fill(0.0);
        }
        S::rebase(&mut self.frames, &self.dual_q);
    }
}

/// Makes the next step of `simulation`, to `time`: where its derivatives come from the same step in
/// dual numbers, the first of them makes it.
///
/// # Errors
/// Those of [`Simulation::step_to`].
pub fn step_to<R, S, const W: usize>(
    simulation: &mut Simulation<f64, R, W>,
    sensitivities: &mut [Sensitivity<S, W>],
    time: f64,
) -> Result<(), Error>
where
    R: Rod<f64, W, Dual = S>,
    S: Rod<Dual64, W>,
{
    match sensitivities.first_mut() {
        Some(Sensitivity::Direct { simulation: dual, .. }) => {
            dual.step_to(time).inspect_err(|_| simulation.stay())?;
            simulation.adopt(dual);
            Ok(())
        }
        _ => simulation.step_to(time),
    }
}

/// Takes back the step that was just made, or tried.
pub fn step_back<R, S, const W: usize>(
    simulation: &mut Simulation<f64, R, W>,
    sensitivities: &mut [Sensitivity<S, W>],
) where
    R: Rod<f64, W, Dual = S>,
    S: Rod<Dual64, W>,
{
    simulation.step_back();
    if let Some(Sensitivity::Direct { simulation: dual, .. }) = sensitivities.first_mut()
        && dual.state().time > simulation.state().time
    {
        dual.step_back();
    }
}

/// Advances several sensitivities over the step `simulation` has just made. One of a scheme that
/// solves equations must [keep its tangents](Simulation::keep_tangent).
///
/// # Errors
/// [`Error::SingularTangent`] where the step has no derivatives; those of the step itself where it is
/// made again in dual numbers.
pub fn advance<R, S, const W: usize>(
    simulation: &Simulation<f64, R, W>,
    sensitivities: &mut [Sensitivity<S, W>],
    room: &mut Vec<f64>,
) -> Result<(), Error>
where
    R: Rod<f64, W, Dual = S>,
    S: Rod<Dual64, W>,
{
    let step = simulation.linearization();
    for sensitivity in sensitivities.iter_mut() {
        match sensitivity {
            Sensitivity::Implicit(sensitivity) => {
                if let Some(step) = &step {
                    sensitivity.prepare(step);
                }
            }
            Sensitivity::Direct { simulation: dual, q, v } => {
                let time = simulation.state().time;
                if dual.state().time < time {
                    dual.step_to(time)?;
                }
                let state = dual.state();
                for (to, from) in [(q, &state.q), (v, &state.v)] {
                    to.iter_mut().zip(from).for_each(|(to, from)| *to = from.eps);
                }
            }
        }
    }
    let implicit = |sensitivity| match sensitivity {
        &mut Sensitivity::Implicit(ref mut sensitivity) => Some(&mut **sensitivity),
        Sensitivity::Direct { .. } => None,
    };
    let Some(step) = &step else { return Ok(()) };
    let mut rest = sensitivities.iter_mut().filter_map(implicit);
    loop {
        let group: [Option<_>; 4] = std::array::from_fn(|_| rest.next());
        match group {
            [None, ..] => return Ok(()),
            [Some(a), None, ..] => solve(step, [a], room),
            [Some(a), Some(b), None, _] => solve(step, [a, b], room),
            [Some(a), Some(b), Some(c), None] => solve(step, [a, b, c], room),
            [Some(a), Some(b), Some(c), Some(d)] => solve(step, [a, b, c, d], room),
        }?;
    }
}

/// Solves for `G` sensitivities at once: side by side, the solves share their memory traffic and
/// fill each other's waiting times.
fn solve<R, S, const W: usize, const G: usize>(
    step: &Linearization<'_, f64, R, W>,
    group: [&mut ImplicitSensitivity<S, W>; G],
    room: &mut Vec<f64>,
) -> Result<(), Error>
where
    R: Rod<f64, W, Dual = S>,
    S: Rod<Dual64, W>,
{
    let n = step.after.q.len();
    room.resize(2 * G * n, 0.0);
    let (side_by_side, single) = room.split_at_mut(G * n);
    let (side_by_side, _) = side_by_side.as_chunks_mut::<G>();
    for (i, row) in side_by_side.iter_mut().enumerate() {
        *row = std::array::from_fn(|g| group[g].q[i]);
    }
    step.factors.solve_many(side_by_side);
    for (g, sensitivity) in group.into_iter().enumerate() {
        for (to, from) in single[..n].iter_mut().zip(side_by_side.iter()) {
            *to = from[g];
        }
        step.check_solution(&single[..n], &sensitivity.q)?;
        sensitivity.finish(step, &single[..n]);
    }
    Ok(())
}
