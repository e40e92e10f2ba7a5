//! The derivative of an implicit step as a linear map, and its transpose.
//!
//! A converged step satisfies `R(q1; q0, v0, a0, n0, p) = 0`. Derivatives along parameters go forward through it: with the
//! tangent `J` of the step at its solution, `J dq1 = -dR|q1`, and velocities, forces and internal variables follow from `dq1`. The
//! derivatives of a misfit by the state at the end go back through it, with the transposed operations in reverse order;
//! `J` is symmetric, so that its factors solve both. One description serves both directions: the factors of the
//! [equations of every unknown](nodal), the [forms of the strains' history](history), and the rod's products with the
//! derivatives of strains.

mod drag;
mod history;
mod nodal;
mod numbers;
mod rates;
mod supports;
mod workspace;

pub use history::add_by_strains;
pub use rates::{DualSimulation, ParameterRates, ParameterSlopes, StateRates};
pub use supports::MovingSupports;
pub use workspace::StepWorkspace;

use crate::dynamics::coefficients::END;
use crate::dynamics::linearization::Linearization;
use crate::dynamics::step_map::nodal::{NodalEquations, StepMotion};
use crate::dynamics::step_map::numbers::{MASS, SCHEME};
use crate::dynamics::step_map::workspace::{Held, HistoryMoment};
use crate::error::Error;
use crate::numerics::lanes::Lanes;
use crate::numerics::simd::with_simd;
use crate::numerics::tangent::{Factors, Tangent};
use crate::numerics::vector::components;
use crate::rod::{
    FrameRate, Rod, RodGeometry, Sensitive, Transposed, set_dual_frames, still_frames,
};
use crate::scene::prescribed_motion::MotionTime;
use num_dual::Dual64;
use std::ops::Range;

/// A linearized step, ready to be applied to derivatives.
pub struct StepMap<'a, R: Rod<f64>> {
    step: &'a Linearization<'a, f64, R>,
    nodal: NodalEquations,
    /// Whether the forces are an average over the step.
    averages: bool,
    /// Backwards: whether kinds of strain have, or could have, damping times of their own; frames that do not move.
    has_own_times: bool,
    still: Vec<FrameRate<1>>,
}

/// The map of a step applied to derivatives, as work for a vector unit. A closure instead would be compiled without its
/// instructions.
struct Application<'a, R: Sensitive, const G: usize> {
    map: &'a StepMap<'a, R>,
    parameters: &'a ParameterRates<R, G>,
    state: &'a mut StateRates<G>,
    room: &'a mut StepWorkspace<R, G>,
}

impl<R: Sensitive, const G: usize> pulp::NullaryFnOnce for Application<'_, R, G> {
    type Output = Result<(), Error>;

    /// Runs the computation, compiled for the instruction set of the caller.
    #[inline(always)]
    fn call(self) -> Self::Output {
        self.map.apply_inlined(self.parameters, self.state, self.room)
    }
}

impl<'a, R: Sensitive> StepMap<'a, R> {
    /// The derivative of a step.
    pub fn new(step: &'a Linearization<'a, f64, R>) -> Self {
        let coefficients = step.coefficients(step.parameter);
        let dual = step.coefficients(Dual64::new(step.parameter, 1.0));
        Self {
            nodal: NodalEquations::new(&coefficients, &dual, step.damping.mass),
            averages: coefficients.averages(),
            has_own_times: false,
            still: Vec::new(),
            step,
        }
    }

    /// The unknowns outside the free range.
    fn fixed(&self) -> impl Iterator<Item = usize> + use<R> {
        let (count, Range { start, end }) = (self.step.after.q.len(), self.step.free.clone());
        (0..start).chain(end..count)
    }

    /// The change of an unknown over the step, and its velocity and acceleration at the start.
    #[inline(always)]
    fn step_motion(&self, i: usize) -> StepMotion {
        let (before, now) = (self.step.before, self.step.after);
        let a0 = before.acceleration.get(i).copied().unwrap_or(0.0);
        [now.q[i] - before.q[i], before.v[i], a0]
    }

    /// Moves the derivatives of a state along parameters over the step.
    ///
    /// # Errors
    /// [`Error::SingularTangent`] where the step has no derivatives.
    pub fn apply<const G: usize>(
        &self,
        parameters: &ParameterRates<R, G>,
        state: &mut StateRates<G>,
        room: &mut StepWorkspace<R, G>,
    ) -> Result<(), Error> {
        with_simd(Application { map: self, parameters, state, room })
    }

    /// [`apply`](Self::apply), inlined.
    #[inline(always)]
    fn apply_inlined<const G: usize>(
        &self,
        parameters: &ParameterRates<R, G>,
        state: &mut StateRates<G>,
        room: &mut StepWorkspace<R, G>,
    ) -> Result<(), Error> {
        let has_history = !state.internal.strain.is_empty();
        state.acceleration.resize(self.step.after.acceleration.len(), [0.0; G]);
        self.hold(parameters, state, room);
        // Derivatives of the forces at the end at fixed unknowns.
        if has_history {
            self.set_end_stress(parameters, &state.internal, &mut room.history);
        }
        match self.averages {
            false => self.set_forces(parameters, state, has_history, room),
            true => self.set_average_forces(parameters, state, has_history, room),
        }
        self.add_drag(parameters, state, &room.held, &mut room.drag, &mut room.direct);
        // Right-hand side of the equations, their solution, and the state at the end.
        match state.acceleration.is_empty() {
            true => self.set_right::<G, false>(state, room),
            false => self.set_right::<G, true>(state, room),
        }
        self.add_numbers(parameters, room);
        self.solve(room)?;
        match state.acceleration.is_empty() {
            true => self.set_end::<G, false>(state, room),
            false => self.set_end::<G, true>(state, room),
        }
        self.add_scheme(parameters, state, room);
        // Internal variables, and the forces that the next step takes as those of its start.
        if has_history {
            self.advance_history(parameters, state, &mut room.history);
            self.set_next_forces(parameters, state, room);
            self.add_next_drag(parameters, state, &mut room.drag);
        } else if self.averages {
            state.unbalanced.fill([0.0; G]);
        }
        self.step.end.move_frame_rates(&mut state.frames, &state.q);
        Ok(())
    }

    /// Writes the derivatives at the end of the step of all unknowns that supports hold.
    fn hold<const G: usize>(
        &self,
        parameters: &ParameterRates<R, G>,
        state: &StateRates<G>,
        room: &mut StepWorkspace<R, G>,
    ) {
        room.held.clear();
        let Some(motions) = &parameters.boundary_motion else {
            room.held.extend(self.fixed().map(|i| Held { i, q: state.q[i], v: [0.0; G] }));
            return;
        };
        let (step, now) = (self.step, self.step.after);
        let moment = MotionTime::Time(now.time);
        let frames = &mut room.dual_frames;
        let ends: [_; G] = std::array::from_fn(|g| {
            let dual = |x: &[f64], rates: &[[f64; G]]| -> Vec<Dual64> {
                x.iter().zip(rates).map(|(x, rate)| Dual64::new(*x, rate[g])).collect()
            };
            set_dual_frames(&step.before.frames, &state.frames, g, &mut frames[g]);
            let (mut q, mut v) = (dual(&now.q, &state.q), dual(&now.v, &state.v));
            motions[g].advance::<R::Dual>(moment, moment, &mut q, &frames[g]);
            motions[g].velocities(now.time, &mut v);
            (q, v)
        });
        room.held.extend(self.fixed().map(|i| {
            let [q, v] = [components(|g| ends[g].0[i].eps), components(|g| ends[g].1[i].eps)];
            Held { i, q, v }
        }));
    }

    /// Writes the derivatives of the forces at the end, at fixed free unknowns: by parameters, frames and supports.
    #[inline(always)]
    fn set_forces<const G: usize>(
        &self,
        parameters: &ParameterRates<R, G>,
        state: &StateRates<G>,
        has_history: bool,
        StepWorkspace { direct, held, history, .. }: &mut StepWorkspace<R, G>,
    ) {
        let (step, elastic) = (self.step, (&parameters.rods, &parameters.laws));
        let at = (&step.after.q[..], &step.before.frames);
        match has_history {
            true => {
                let stress = &history.stress;
                R::stressed_rate(Some(elastic), stress, step.end, at, step.derivatives, direct);
            }
            false => R::gradient_rate(elastic, step.end, at, step.derivatives, direct),
        }
        step.end.add_frame_rates(&state.frames, step.gradient, step.tangent, direct);
        for Held { i, q, .. } in held.iter().filter(|held| held.q != [0.0; G]) {
            step.tangent.add_column(*i, *q, direct);
        }
    }

    /// The same of the average over the step, at a fixed end: by the start too.
    fn set_average_forces<const G: usize>(
        &self,
        parameters: &ParameterRates<R, G>,
        state: &StateRates<G>,
        has_history: bool,
        StepWorkspace { direct, held, history, .. }: &mut StepWorkspace<R, G>,
    ) {
        let (step, elastic) = (self.step, (&parameters.rods, &parameters.laws));
        let stages = step.coefficients(step.parameter).stages;
        let mut sum = vec![[0.0; G]; direct.len()];
        for (k, forces) in step.stages.iter().enumerate() {
            let (place, at) = (&forces.geometry, (&forces.q[..], &step.before.frames));
            let stage = stages.get(k).unwrap_or(&END);
            match has_history && k >= stages.len() {
                true => {
                    let stress = &history.stress;
                    R::stressed_rate(None, stress, place, at, step.derivatives, direct);
                }
                false => R::gradient_rate(elastic, place, at, step.derivatives, direct),
            }
            place.add_frame_rates(&state.frames, &forces.gradient, &forces.tangent, direct);
            for (j, start) in state.q.iter().enumerate() {
                forces.tangent.add_column(j, (Lanes(*start) * (1.0 - stage.place)).0, direct);
            }
            for Held { i, q, .. } in &*held {
                forces.tangent.add_column(*i, (Lanes(*q) * stage.place).0, direct);
            }
            for (sum, direct) in sum.iter_mut().zip(&*direct) {
                (0..G).for_each(|g| sum[g] += stage.weight * direct[g]);
            }
        }
        *direct = sum;
    }

    /// Adds mass damping to the derivatives of the forces, and writes the right-hand side of the equations. `A`: whether
    /// the scheme goes on from accelerations.
    #[inline(always)]
    fn set_right<const G: usize, const A: bool>(
        &self,
        state: &StateRates<G>,
        room: &mut StepWorkspace<R, G>,
    ) {
        let (nodal, free) = (self.nodal, self.step.free.clone());
        let mass = &self.step.rod.mass()[free.clone()];
        let count = mass.len();
        let (q, v) = (&state.q[free.clone()][..count], &state.v[free.clone()][..count]);
        let n0 = &state.unbalanced[free.clone()][..count];
        let a = if A { &state.acceleration[free.clone()] } else { &[][..] };
        let direct = &mut room.direct[free.clone()][..count];
        let right = &mut room.right[free][..count];
        for i in 0..count {
            for g in 0..G {
                let a0 = if A { a[i][g] } else { 0.0 };
                let start = [q[i][g], v[i][g], a0, n0[i][g], direct[i][g]];
                [direct[i][g], right[i][g]] = nodal.residual::<A>(mass[i], start);
            }
        }
    }

    /// Adds the parts by the masses, the mass damping and the scheme's parameter, where any of them changes.
    fn add_numbers<const G: usize>(
        &self,
        parameters: &ParameterRates<R, G>,
        room: &mut StepWorkspace<R, G>,
    ) {
        let [damping, scheme] = [parameters.numbers[MASS], parameters.numbers[SCHEME]];
        let (nodal, step, mass) = (self.nodal, self.step, self.step.rod.mass());
        if parameters.mass.is_some() || damping != Lanes::ZERO {
            for i in step.free.clone() {
                let of_mass = parameters.mass.as_ref().map_or([0.0; G], |mass| mass[i]);
                let (rates, step_motion) = ([Lanes(of_mass), damping], self.step_motion(i));
                let at_fixed = [Lanes(room.direct[i]), Lanes(room.right[i])];
                let [n, r] = nodal.with_mass_and_damping(mass[i], &step_motion, rates, at_fixed);
                (room.direct[i], room.right[i]) = (n.0, r.0);
            }
        }
        if scheme == Lanes::ZERO {
            return;
        }
        for i in step.free.clone() {
            let (step_motion, forces) =
                (self.step_motion(i), [step.total[i], step.before.unbalanced[i]]);
            let at_fixed = [Lanes(room.direct[i]), Lanes(room.right[i])];
            let [n, r] = nodal.with_scheme(mass[i], &step_motion, forces, scheme, at_fixed);
            (room.direct[i], room.right[i]) = (n.0, r.0);
        }
    }

    fn solve<const G: usize>(&self, room: &mut StepWorkspace<R, G>) -> Result<(), Error> {
        let (step, StepWorkspace { right, solution, .. }) = (self.step, room);
        step.prescribed.fill(right, [0.0; G]);
        solution.copy_from_slice(right);
        step.factors.solve_many(solution);
        if step.factors.negative_pivots() == 0 {
            return Ok(());
        }
        (0..G).try_for_each(|g| {
            let lane = |list: &[[f64; G]]| list.iter().map(|x| x[g]).collect::<Vec<f64>>();
            step.check_solution(&lane(solution), &lane(right))
        })
    }

    /// Takes the solution as the derivatives of the unknowns, and writes those of velocities, accelerations and forces.
    #[inline(always)]
    fn set_end<const G: usize, const A: bool>(
        &self,
        state: &mut StateRates<G>,
        room: &mut StepWorkspace<R, G>,
    ) {
        let (nodal, free) = (self.nodal, self.step.free.clone());
        let mass = &self.step.rod.mass()[free.clone()];
        let count = mass.len();
        let (q, v) = (&mut state.q[free.clone()][..count], &mut state.v[free.clone()][..count]);
        let n1 = &mut state.unbalanced[free.clone()][..count];
        let a = if A { &mut state.acceleration[free.clone()] } else { &mut [][..] };
        let (direct, right) = (&room.direct[free.clone()][..count], &room.right[free.clone()]);
        let (right, solution) = (&right[..count], &room.solution[free][..count]);
        for i in 0..count {
            for g in 0..G {
                let a0 = if A { a[i][g] } else { 0.0 };
                let [v1, a1] = nodal.end::<A>([q[i][g], v[i][g], a0, solution[i][g]]);
                let solved = [direct[i][g], right[i][g], solution[i][g]];
                n1[i][g] = nodal.force(mass[i], solved);
                (q[i][g], v[i][g]) = (solution[i][g], v1);
                if A {
                    a[i][g] = a1;
                }
            }
        }
    }

    /// Adds the parts of velocities and accelerations by the scheme's parameter, and sets held and prescribed unknowns.
    fn add_scheme<const G: usize>(
        &self,
        parameters: &ParameterRates<R, G>,
        state: &mut StateRates<G>,
        room: &StepWorkspace<R, G>,
    ) {
        let scheme = parameters.numbers[SCHEME];
        if scheme != Lanes::ZERO {
            for i in self.step.free.clone() {
                let [v, a] = self.nodal.end_by_scheme(&self.step_motion(i));
                state.v[i] = (Lanes(state.v[i]) + scheme * v).0;
                if let Some(own) = state.acceleration.get_mut(i) {
                    *own = (Lanes(*own) + scheme * a).0;
                }
            }
        }
        for Held { i, q, v } in &room.held {
            (state.q[*i], state.v[*i]) = (*q, *v);
        }
        // Recorded velocities do not depend on the scheme.
        self.step.prescribed.fill(&mut state.v, [0.0; G]);
        if !state.acceleration.is_empty() {
            self.step.prescribed.fill(&mut state.acceleration, [0.0; G]);
        }
    }

    /// Writes the derivatives of the forces that the next step takes as those of its start.
    #[inline(always)]
    fn set_next_forces<const G: usize>(
        &self,
        parameters: &ParameterRates<R, G>,
        state: &mut StateRates<G>,
        StepWorkspace { direct, history, .. }: &mut StepWorkspace<R, G>,
    ) {
        let (step, (gradient, tangent)) = (self.step, self.step.next);
        let elastic = (!self.averages).then_some((&parameters.rods, &parameters.laws));
        let at = (&step.after.q[..], &step.before.frames);
        R::stressed_rate(elastic, &history.stress, step.end, at, step.derivatives, direct);
        step.end.add_frame_rates(&state.frames, gradient, tangent, direct);
        tangent.add_product(&state.q, direct);
        let free = step.free.clone();
        state.unbalanced[free.clone()].copy_from_slice(&direct[free.clone()]);
        if self.averages {
            return;
        }
        let (by_damping, damping) = (parameters.numbers[MASS], step.damping.mass);
        let mass = &step.rod.mass()[free.clone()];
        let (count, v) = (mass.len(), &step.after.v[free.clone()][..mass.len()]);
        let rates = &state.v[free.clone()][..count];
        let forces = &mut state.unbalanced[free.clone()][..count];
        let of_mass = parameters.mass.as_ref().map(|of_mass| &of_mass[free][..count]);
        for i in 0..count {
            let of_mass = of_mass.map_or([0.0; G], |of_mass| of_mass[i]);
            for g in 0..G {
                let by_numbers = (by_damping.0[g] * mass[i] + of_mass[g] * damping) * v[i];
                forces[i][g] += by_numbers + rates[i][g] * (damping * mass[i]);
            }
        }
    }
}

impl<'a, R: Transposed> StepMap<'a, R> {
    /// The transposed derivative of a step. `has_own_times`: whether kinds of strain have, or could have, damping times of
    /// their own.
    pub fn transposed(
        step: &'a Linearization<'a, f64, R>,
        frames: usize,
        has_own_times: bool,
    ) -> Self {
        Self { has_own_times, still: still_frames(frames), ..Self::new(step) }
    }

    /// Replaces the derivatives of a misfit by the state at the end of the step by those by the state at its start, and
    /// adds those by the numbers of the simulation.
    ///
    /// # Errors
    /// [`Error::SingularTangent`] where the step has no derivatives.
    pub fn apply_transposed(
        &self,
        state: &mut StateRates<1>,
        slopes: &mut ParameterSlopes,
        supports: &mut MovingSupports<R>,
        room: &mut StepWorkspace<R, 1>,
    ) -> Result<(), Error> {
        let step = self.step;
        step.end.move_frames_back(&mut state.frames, state.q.as_flattened_mut());
        // Prescribed unknowns have no derivatives, and forces do not move them.
        step.prescribed.fill(&mut state.unbalanced, [0.0]);
        if !state.internal.strain.is_empty() {
            self.next_forces_transposed(state, slopes, room);
        }
        for by in [&mut state.q, &mut state.v, &mut state.acceleration] {
            step.prescribed.fill(by, [0.0]);
        }
        self.end_transposed(state, slopes, room);
        self.solve_transposed(room)?;
        self.right_transposed(state, slopes, room);
        let d = std::mem::take(&mut room.direct).into_flattened();
        self.forces_transposed(&d, state, slopes, room);
        let by_place = self.drag_transposed(&d, state, slopes);
        let [q, v] = [&mut state.q, &mut state.v].map(|list| list.as_flattened_mut());
        supports.transpose(step, (&mut *q, &mut *v), &mut state.frames);
        for (i, by_place) in by_place.into_iter().enumerate() {
            q[i] += by_place;
            v[i] += self.nodal.h() * by_place;
        }
        room.direct = d.into_iter().map(|d| [d]).collect();
        Ok(())
    }

    /// The transpose of [`set_next_forces`](Self::set_next_forces) and [`advance_history`](Self::advance_history).
    fn next_forces_transposed(
        &self,
        state: &mut StateRates<1>,
        slopes: &mut ParameterSlopes,
        room: &mut StepWorkspace<R, 1>,
    ) {
        let step = self.step;
        let d = std::mem::take(&mut state.unbalanced).into_flattened();
        let damping = step.damping.mass;
        for i in step.free.clone() {
            let (mass, v) = (step.rod.mass()[i], step.after.v[i]);
            state.v[i][0] += damping * mass * d[i];
            slopes.numbers[MASS] += mass * v * d[i];
            slopes.mass[i] += damping * v * d[i];
        }
        self.next_drag_transposed(&d, state, slopes);
        let (gradient, tangent) = step.next;
        tangent.product(&d, &mut room.stiff);
        state.q.as_flattened_mut().iter_mut().zip(&room.stiff).for_each(|(q, stiff)| *q += stiff);
        step.end.add_to_frames(gradient, (&d, &room.stiff), &mut state.frames);
        self.stress_transposed(HistoryMoment::NextStart, &d, state, slopes, &mut room.history);
        self.history_transposed(state, slopes, &mut room.history);
        self.add_loads(&d, slopes);
        state.unbalanced = vec![[0.0]; d.len()];
    }

    /// The transpose of [`set_end`](Self::set_end) and [`add_scheme`](Self::add_scheme), up to the solution.
    fn end_transposed(
        &self,
        state: &mut StateRates<1>,
        slopes: &mut ParameterSlopes,
        room: &mut StepWorkspace<R, 1>,
    ) {
        let has_acceleration = !self.step.after.acceleration.is_empty();
        room.direct.fill([0.0]);
        room.right.fill([0.0]);
        room.solution.fill([0.0]);
        for i in self.step.free.clone() {
            let (v1, n1) = (state.v[i][0], state.unbalanced[i][0]);
            let a1 = if has_acceleration { state.acceleration[i][0] } else { 0.0 };
            let [v_slope, a_slope] = self.nodal.end_by_scheme(&self.step_motion(i));
            slopes.numbers[SCHEME] += v1 * v_slope;
            slopes.numbers[SCHEME] += a1 * a_slope;
            let [q0, v0, a0, change] = self.nodal.end_transposed([v1, a1]);
            let [n, r, q1] = self.nodal.force_transposed(self.step.rod.mass()[i], n1);
            room.solution[i][0] = state.q[i][0] + change + q1;
            (room.direct[i], room.right[i]) = ([n], [r]);
            (state.q[i], state.v[i], state.acceleration[i]) = ([q0], [v0], [a0]);
        }
    }

    /// Adds the derivatives by the right-hand side that follow from those by the solution.
    fn solve_transposed(
        &self,
        StepWorkspace { right, solution, .. }: &mut StepWorkspace<R, 1>,
    ) -> Result<(), Error> {
        let (factors, x) = (self.step.factors, solution.as_flattened_mut());
        let b = (factors.negative_pivots() > 0).then(|| x.to_vec());
        factors.solve(x);
        if let Some(b) = b {
            self.step.check_solution(x, &b)?;
        }
        right.as_flattened_mut().iter_mut().zip(x).for_each(|(right, x)| *right += *x);
        Ok(())
    }

    /// The transpose of [`set_right`](Self::set_right) and [`add_numbers`](Self::add_numbers).
    fn right_transposed(
        &self,
        state: &mut StateRates<1>,
        slopes: &mut ParameterSlopes,
        room: &mut StepWorkspace<R, 1>,
    ) {
        let step = self.step;
        for i in step.free.clone() {
            let (mass, by) = (step.rod.mass()[i], [room.direct[i][0], room.right[i][0]]);
            let [q0, v0, a0, n0, direct] = self.nodal.residual_transposed(mass, by);
            state.q[i][0] += q0;
            state.v[i][0] += v0;
            state.acceleration[i][0] += a0;
            (state.unbalanced[i], room.direct[i]) = ([n0], [direct]);
            let forces = [step.total[i], step.before.unbalanced[i]];
            let [of_mass, damping, scheme] =
                self.nodal.numbers_transposed(mass, &self.step_motion(i), forces, by);
            slopes.mass[i] += of_mass;
            slopes.numbers[MASS] += damping;
            slopes.numbers[SCHEME] += scheme;
        }
    }

    /// The transpose of [`set_end_stress`](Self::set_end_stress) and [`set_forces`](Self::set_forces), where the
    /// derivatives by the forces are `d`.
    fn forces_transposed(
        &self,
        d: &[f64],
        state: &mut StateRates<1>,
        slopes: &mut ParameterSlopes,
        room: &mut StepWorkspace<R, 1>,
    ) {
        let step = self.step;
        self.stress_transposed(HistoryMoment::End, d, state, slopes, &mut room.history);
        self.add_loads(d, slopes);
        if R::HAS_FRAMES {
            let stiff = &mut room.stiff;
            step.tangent.product(d, stiff);
            step.end.add_to_frames(step.gradient, (d, stiff), &mut state.frames);
            self.fixed().for_each(|i| state.q[i][0] += stiff[i]);
        } else {
            for i in self.fixed() {
                let near = step.tangent.coupled(i, d.len());
                state.q[i][0] += near.map(|j| step.tangent.get(i, j) * d[j]).sum::<f64>();
            }
        }
    }

    /// Adds the derivatives by loads and dead moments, where those by the forces are `d`.
    fn add_loads(&self, d: &[f64], slopes: &mut ParameterSlopes) {
        slopes.laws.load.iter_mut().zip(d).for_each(|(load, d)| *load -= d);
        self.step.rod.add_to_moments(&self.step.after.q, d, &mut slopes.laws);
    }
}
