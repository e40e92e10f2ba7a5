//! The transposed derivative of one implicit step, for the adjoint method.
//!
//! Input: derivatives of a misfit by the state at the end of the step ([`StateRates`] with one lane). Output: those by
//! the state at its start, in place. The derivatives by laws, loads, masses, damping numbers, scheme and drag are added
//! to [`ParameterSlopes`], those by moving supports to [`MovingSupports`], those through loads in time to
//! [`TimedLoadSlopes`]. Every stage of the forward map has its transpose here, in reverse order, with one solve with
//! the same factors. The average vector field scheme and internal friction have no transpose; callers reject them.
//! [`StepMap::transposed`] prepares the map of a step. `has_own_times` includes the terms of Kelvin-Voigt times of
//! single kinds of strain (stretch, bending, twist), and `frames` is the number of reference frames. An inaccurate
//! solution with an indefinite matrix is [`Error::SingularTangent`].

use crate::dynamics::linearization::{Linearization, StartForces};
use crate::dynamics::step_map::branch_relaxation::HistoryMoment;
use crate::dynamics::step_map::{
    MovingSupports, ParameterSlopes, StateRates, StepMap, StepWorkspace, TimedLoadSlopes,
};
use crate::error::Error;
use crate::numerics::tangent::{Factors, Tangent};
use crate::rod::{RodGeometry, Transposed, zero_frame_rates};

impl<'a, R: Transposed> StepMap<'a, R> {
    /// The map of a `step` for transposed use. `frames`: number of reference frames; `has_own_times`: whether single
    /// kinds of strain (stretch, bending, twist) have Kelvin-Voigt times of their own, or requested derivatives by
    /// these.
    pub fn transposed(
        step: &'a Linearization<'a, f64, R>,
        frames: usize,
        has_own_times: bool,
    ) -> Self {
        Self { has_own_times, still: zero_frame_rates(frames), ..Self::new(step) }
    }

    /// Replaces `state`, the derivatives of a misfit by the state at the end of the step, by the derivatives by the
    /// state at its start. Adds the derivatives by laws, masses, numbers of damping and scheme, and drag to `slopes`,
    /// by parameters that move supports to `supports`, and through loads in time to `timed_loads`. Stages of
    /// [`apply`](Self::apply) are transposed in reverse order.
    ///
    /// # Errors
    /// [`Error::SingularTangent`] where a matrix with negative pivots is not solved accurately.
    pub fn apply_transposed(
        &self,
        state: &mut StateRates<1>,
        slopes: &mut ParameterSlopes,
        supports: &mut MovingSupports<R>,
        timed_loads: &mut TimedLoadSlopes,
        room: &mut StepWorkspace<R, 1>,
    ) -> Result<(), Error> {
        let step = self.step;
        // In reverse order of the forward map: frames first, because they moved last.
        step.end.move_frames_back(&mut state.frames, state.q.as_flattened_mut());
        // Prescribed unknowns have no derivatives, and forces do not move them.
        step.prescribed.fill(&mut state.unbalanced, [0.0]);
        if !state.internal.strain.is_empty() {
            self.next_forces_transposed(state, slopes, room);
        }
        for by in [&mut state.q, &mut state.v, &mut state.acceleration] {
            step.prescribed.fill(by, [0.0]);
        }
        timed_loads.transpose_end(step, state);
        // State at the end, solution, right-hand side: the three stages of a step, transposed.
        self.end_transposed(state, slopes, room);
        self.solve_transposed(room)?;
        timed_loads.transpose_right(step, &room.right, &mut state.q);
        self.right_transposed(state, slopes, room);
        // `d` is the derivative of the misfit by the forces at fixed unknowns, to be carried to
        // laws, loads and frames.
        let d = std::mem::take(&mut room.direct).into_flattened();
        timed_loads.transpose_direct(step, &d);
        self.forces_transposed(&d, state, slopes, room);
        let by_place = self.drag_transposed(&d, state, slopes);
        let [q, v] = [&mut state.q, &mut state.v].map(|list| list.as_flattened_mut());
        // Supports that parameters move take the derivatives by the unknowns that they hold.
        supports.transpose(step, q, v, &mut state.frames);
        // Drag acts at the places expected from the start, q0 + h v0.
        for (i, by_place) in by_place.into_iter().enumerate() {
            q[i] += by_place;
            v[i] += self.nodal.h() * by_place;
        }
        room.direct = d.into_iter().map(|d| [d]).collect();
        Ok(())
    }

    /// The transpose of [`set_next_forces`](Self::set_next_forces) and [`advance_history`](Self::advance_history), for
    /// rods with a history of strains. `state.unbalanced` has the derivatives of a misfit by the forces at the start of
    /// the next step. The derivatives by unknowns, velocities and frames at the end of this step are added to `state`,
    /// those by numbers to `slopes`. `state.unbalanced` then becomes zero. The derivatives by the internal variables at
    /// the end are replaced by those at the start of the step. The tangent of the forces is used here; the forward map
    /// replaces it by products.
    fn next_forces_transposed(
        &self,
        state: &mut StateRates<1>,
        slopes: &mut ParameterSlopes,
        room: &mut StepWorkspace<R, 1>,
    ) {
        let step = self.step;
        let d = std::mem::take(&mut state.unbalanced).into_flattened();
        // Mass damping c M v: by velocity, damping and mass.
        let damping = step.damping.mass;
        for i in step.free.clone() {
            let (mass, v) = (step.rod.mass()[i], step.after.v[i]);
            state.v[i][0] += damping * mass * d[i];
            slopes.numbers.mass += mass * v * d[i];
            slopes.mass[i] += damping * v * d[i];
        }
        self.next_drag_transposed(&d, state, slopes);
        // By unknowns and frames through the tangent with the elastic stiffness, then by stresses and internal
        // variables.
        let StartForces { gradient, tangent } = step.next;
        tangent.product(&d, &mut room.stiff);
        state.q.as_flattened_mut().iter_mut().zip(&room.stiff).for_each(|(q, stiff)| *q += stiff);
        step.end.add_to_frames(gradient, &d, &room.stiff, &mut state.frames);
        self.stress_transposed(HistoryMoment::NextStart, &d, state, slopes, &mut room.history);
        self.history_transposed(state, slopes, &mut room.history);
        self.add_loads(&d, slopes);
        state.unbalanced = vec![[0.0]; d.len()];
    }

    /// The transpose of [`set_end`](Self::set_end) and [`add_scheme`](Self::add_scheme), for free unknowns. From the
    /// derivatives of a misfit by the state at the end follow those by forces at fixed unknowns, right-hand sides and
    /// solution, which overwrite `room.direct`, `room.right` and `room.solution`. The derivatives by unknowns,
    /// velocities and accelerations at the start, through velocity and acceleration at the end only, overwrite lists of
    /// `state`. The derivative by the scheme's parameter is added to `slopes`.
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
            slopes.numbers.scheme += v1 * v_slope;
            slopes.numbers.scheme += a1 * a_slope;
            let [q0, v0, a0, change] = self.nodal.end_transposed([v1, a1]);
            let [n, r, q1] = self.nodal.force_transposed(self.step.rod.mass()[i], n1);
            room.solution[i][0] = state.q[i][0] + change + q1;
            (room.direct[i], room.right[i]) = ([n], [r]);
            (state.q[i], state.v[i], state.acceleration[i]) = ([q0], [v0], [a0]);
        }
    }

    /// Adds `J^-1` times the derivatives by the solution to those by the right-hand side. `J` is symmetric.
    /// [`Error::SingularTangent`] where a matrix with negative pivots is not solved accurately.
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

    /// The transpose of [`set_right`](Self::set_right) and [`add_numbers`](Self::add_numbers), for free unknowns.
    /// `room.direct` and `room.right` have the derivatives of a misfit by forces and right-hand sides. Those by
    /// unknowns, velocities and accelerations at the start are added to `state`; those by the forces at the start
    /// overwrite `state.unbalanced`. The derivatives by masses, mass damping and the scheme's parameter are added to
    /// `slopes`. `room.direct` is overwritten by the derivatives by the forces at fixed unknowns and without mass
    /// damping.
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
            slopes.numbers.mass += damping;
            slopes.numbers.scheme += scheme;
        }
    }

    /// The transpose of [`set_end_stress`](Self::set_end_stress) and [`set_forces`](Self::set_forces). `d` are the
    /// derivatives of a misfit by the forces at fixed unknowns. Adds the derivatives by laws and loads to `slopes`, and
    /// the derivatives by frames, past strains and held unknowns to `state`.
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
            step.end.add_to_frames(step.gradient, d, stiff, &mut state.frames);
            self.fixed().for_each(|i| state.q[i][0] += stiff[i]);
        } else {
            for i in self.fixed() {
                let near = step.tangent.coupled(i, d.len());
                state.q[i][0] += near.map(|j| step.tangent.get(i, j) * d[j]).sum::<f64>();
            }
        }
    }

    /// Adds to `slopes` the derivatives of a misfit by loads and dead moments, from its derivatives `d` by the forces:
    /// `-d` for loads, which enter the gradient with negative sign.
    fn add_loads(&self, d: &[f64], slopes: &mut ParameterSlopes) {
        slopes.laws.load.iter_mut().zip(d).for_each(|(load, d)| *load -= d);
        self.step.rod.add_to_moments(&self.step.after.q, d, &mut slopes.laws);
    }
}
