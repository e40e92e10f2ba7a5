//! Derivatives of a state along `G` parameters over one implicit step, forward in time.
//!
//! Input: [`StateRates`] at the start and [`ParameterRates`] of laws, loads, masses, damping, drag and supports,
//! with `G` parameters in SIMD lanes. Stages: held unknowns, forces at fixed unknowns, right-hand side `-dR|q1`,
//! solution of `J dq1 = -dR|q1` with the factors of the step. Velocities, accelerations, internal variables, forces
//! and frames at the end follow from `dq1`. Forces of averaging schemes are sums over the stages of the quadrature.
//! Prescribed (recorded) unknowns have zero derivatives. Output: `StateRates` at the end, in place. An inaccurate
//! solution with an indefinite matrix is [`Error::SingularTangent`].

use crate::dynamics::coefficients::END;
use crate::dynamics::step_map::workspace::Held;
use crate::dynamics::step_map::{ParameterRates, StateRates, StepMap, StepWorkspace};
use crate::error::Error;
use crate::numerics::directions::Directions;
use crate::numerics::simd::with_simd;
use crate::numerics::tangent::{Factors, Tangent};
use crate::numerics::vector::components;
use crate::rod::{ForwardSensitivity, RodGeometry, set_dual_frames};
use crate::scene::prescribed_motion::MotionTime;
use num_dual::Dual64;

/// The arguments of [`StepMap::apply`] as work for a vector unit. A closure instead would be compiled without its
/// instructions.
struct Application<'a, R: ForwardSensitivity, const G: usize> {
    map: &'a StepMap<'a, R>,
    parameters: &'a ParameterRates<R, G>,
    state: &'a mut StateRates<G>,
    room: &'a mut StepWorkspace<R, G>,
}

impl<R: ForwardSensitivity, const G: usize> pulp::NullaryFnOnce for Application<'_, R, G> {
    type Output = Result<(), Error>;

    /// Applies the map to the derivatives, compiled for the instruction set of the caller.
    #[inline(always)]
    fn call(self) -> Self::Output {
        self.map.apply_inlined(self.parameters, self.state, self.room)
    }
}

impl<R: ForwardSensitivity> StepMap<'_, R> {
    /// Replaces the derivatives of the state at the start of the step by those at its end, along `G` parameters, in
    /// `state`. `room` are work lists. Compiled for the vector unit of the processor.
    ///
    /// # Errors
    /// [`Error::SingularTangent`] where a matrix with negative pivots is not solved accurately.
    pub fn apply<const G: usize>(
        &self,
        parameters: &ParameterRates<R, G>,
        state: &mut StateRates<G>,
        room: &mut StepWorkspace<R, G>,
    ) -> Result<(), Error> {
        with_simd(Application { map: self, parameters, state, room })
    }

    /// The work of [`apply`](Self::apply), compiled for the caller's instruction set. Stages: held unknowns, forces at
    /// fixed unknowns, drag, loads in time, right-hand sides, solution, state at the end. With a history of strains,
    /// internal variables and the forces at the next start follow; without it an averaging scheme has none there.
    /// Frames are moved last.
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
        let drags = has_history && !self.averages && !parameters.drag.is_empty();
        let undragged = drags.then(|| room.direct.clone());
        self.add_drag(parameters, state, &room.held, &mut room.drag, &mut room.direct);
        if let Some(undragged) = undragged {
            room.dragged.clone_from(&room.direct);
            for (dragged, undragged) in room.dragged.iter_mut().zip(undragged) {
                (0..G).for_each(|g| dragged[g] -= undragged[g]);
            }
        }
        if !parameters.timed_loads.is_empty() {
            room.timed.clear();
            room.timed.resize(room.right.len(), [0.0; G]);
            for (g, rates) in parameters.timed_loads.iter().enumerate() {
                rates.add(self.step, &state.q, g, [&mut room.direct, &mut room.timed]);
            }
        }
        // Right-hand side of the equations, their solution, and the state at the end.
        match state.acceleration.is_empty() {
            true => self.set_right::<G, false>(state, room),
            false => self.set_right::<G, true>(state, room),
        }
        self.add_numbers(parameters, room);
        for (own, timed) in room.right.iter_mut().zip(&room.timed) {
            (0..G).for_each(|g| own[g] += timed[g]);
        }
        self.solve(room)?;
        match state.acceleration.is_empty() {
            true => self.set_end::<G, false>(state, room),
            false => self.set_end::<G, true>(state, room),
        }
        self.add_scheme(parameters, state, room);
        for (g, rates) in parameters.timed_loads.iter().enumerate() {
            rates.subtract_moments(self.step, &state.q, g, &mut state.unbalanced);
        }
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

    /// Overwrites `room.held` with the derivatives, at the end of the step, of place and velocity of all unknowns
    /// outside the free range, in ascending order. If the parameters have moving supports, they follow from their
    /// motion in dual numbers at that time. Otherwise the derivative of the place stays, and that of the velocity is
    /// zero.
    fn hold<const G: usize>(
        &self,
        parameters: &ParameterRates<R, G>,
        state: &StateRates<G>,
        room: &mut StepWorkspace<R, G>,
    ) {
        room.held.clear();
        // Supports without parameters: a held unknown keeps its derivative, and does not move.
        let Some(motions) = &parameters.boundary_motion else {
            room.held.extend(self.fixed().map(|i| Held { i, q: state.q[i], v: [0.0; G] }));
            return;
        };
        let (step, now) = (self.step, self.step.after);
        let moment = MotionTime::Time(now.time);
        let frames = &mut room.dual_frames;
        // The motion of the supports over dual numbers, one parameter after the other.
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

    /// Overwrites `direct` with the derivatives of the forces at the end, N, at fixed free unknowns: by laws and loads,
    /// or with a history by stresses, then by frames and by held unknowns, through their columns of the tangent. In
    /// space `turned` gets the angles, rad, by which directors of free edges turn with their frames; these are left to
    /// the solution. Drag is not included.
    #[inline(always)]
    fn set_forces<const G: usize>(
        &self,
        parameters: &ParameterRates<R, G>,
        state: &StateRates<G>,
        has_history: bool,
        StepWorkspace { direct, held, history, turned, .. }: &mut StepWorkspace<R, G>,
    ) {
        let (step, elastic) = (self.step, parameters.changed_rods());
        let (q, frames) = (&step.after.q[..], &step.before.frames);
        // With a history the stresses have derivatives of their own; otherwise only laws and
        // loads change.
        match has_history {
            true => {
                let stress = &history.stress;
                R::stressed_rate(
                    Some(elastic),
                    stress,
                    step.end,
                    q,
                    frames,
                    step.derivatives,
                    direct,
                );
            }
            false => R::gradient_rate(elastic, step.end, q, frames, step.derivatives, direct),
        }
        // In space the frames at the start turn with parameters, and the forces with them. The directors turn as with
        // the angles of the edges: those of free edges count in the solution.
        step.end.add_frame_forces(&state.frames, step.gradient, turned, direct);
        if R::HAS_FRAMES {
            for i in self.fixed().filter(|i| R::is_angle(*i)) {
                step.tangent.add_column(i, turned[i], direct);
                turned[i] = [0.0; G];
            }
            step.prescribed.fill(turned, [0.0; G]);
        }
        // Held unknowns are no unknowns of the equations: their columns go to the right-hand
        // side.
        for Held { i, q, .. } in held.iter().filter(|held| held.q != [0.0; G]) {
            step.tangent.add_column(*i, *q, direct);
        }
    }

    /// The counterpart of [`set_forces`](Self::set_forces) for averaging schemes: overwrites `direct` with the weighted
    /// sum over the quadrature stages and, with a history, the viscous stage at the end. A stage is at
    /// `q0 + place (q1 - q0)`: the start enters with the factor `1 - place`, held unknowns at the end with `place`,
    /// through the tangent of the stage.
    fn set_average_forces<const G: usize>(
        &self,
        parameters: &ParameterRates<R, G>,
        state: &StateRates<G>,
        has_history: bool,
        StepWorkspace { direct, held, history, .. }: &mut StepWorkspace<R, G>,
    ) {
        let (step, elastic) = (self.step, parameters.changed_rods());
        let stages = step.coefficients(step.parameter).stages;
        let mut sum = vec![[0.0; G]; direct.len()];
        for (k, forces) in step.stages.iter().enumerate() {
            let (place, frames) = (&forces.geometry, &step.before.frames);
            let stage = stages.get(k).unwrap_or(&END);
            // The last stage is the viscous stress at the end; those before are elastic.
            match has_history && k >= stages.len() {
                true => {
                    let stress = &history.stress;
                    R::stressed_rate(
                        None,
                        stress,
                        place,
                        &forces.q,
                        frames,
                        step.derivatives,
                        direct,
                    );
                }
                false => {
                    R::gradient_rate(elastic, place, &forces.q, frames, step.derivatives, direct)
                }
            }
            place.add_frame_rates(&state.frames, &forces.gradient, &forces.tangent, direct);
            // A stage lies at q0 + place (q1 - q0): its part of the start is known.
            for (j, start) in state.q.iter().enumerate() {
                forces.tangent.add_column(j, (Directions(*start) * (1.0 - stage.place)).0, direct);
            }
            for Held { i, q, .. } in &*held {
                forces.tangent.add_column(*i, (Directions(*q) * stage.place).0, direct);
            }
            // The weights of the quadrature over the step.
            for (sum, direct) in sum.iter_mut().zip(&*direct) {
                (0..G).for_each(|g| sum[g] += stage.weight * direct[g]);
            }
        }
        *direct = sum;
    }

    /// Adds the derivatives of the force of mass damping to those of the forces, `room.direct`, of the free unknowns.
    /// Overwrites `room.right` with the right-hand side `-dR|q1` of their equations. Both are `n` and `r` of
    /// [`NodalEquations::residual`](super::nodal::NodalEquations::residual). `A`: whether the scheme uses
    /// accelerations.
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
        // The equations of `nodal` for one unknown after the other, with G parameters in SIMD lanes.
        for i in 0..count {
            let a0 = if A { Directions(a[i]) } else { Directions::ZERO };
            let start =
                [Directions(q[i]), Directions(v[i]), a0, Directions(n0[i]), Directions(direct[i])];
            let [n, r] = nodal.residual::<A, G>(mass[i], start);
            (direct[i], right[i]) = (n.0, r.0);
        }
    }

    /// Adds derivatives by numbers to those of forces, `room.direct`, and right-hand sides, `room.right`, of free
    /// unknowns. They are by masses and mass damping, and by the scheme's parameter, times the derivatives of these
    /// along the parameters. Either group is skipped if all of these are zero.
    fn add_numbers<const G: usize>(
        &self,
        parameters: &ParameterRates<R, G>,
        room: &mut StepWorkspace<R, G>,
    ) {
        let (damping, scheme) = (parameters.numbers.mass, parameters.numbers.scheme);
        let (nodal, step, mass) = (self.nodal, self.step, self.step.rod.mass());
        if parameters.mass.is_some() || damping != Directions::ZERO {
            for i in step.free.clone() {
                let of_mass = parameters.mass.as_ref().map_or([0.0; G], |mass| mass[i]);
                let (rates, step_motion) = ([Directions(of_mass), damping], self.step_motion(i));
                let at_fixed = [Directions(room.direct[i]), Directions(room.right[i])];
                let [n, r] = nodal.with_mass_and_damping(mass[i], &step_motion, rates, at_fixed);
                (room.direct[i], room.right[i]) = (n.0, r.0);
            }
        }
        // Most runs do not vary the parameter of the scheme.
        if scheme == Directions::ZERO {
            return;
        }
        for i in step.free.clone() {
            let (step_motion, forces) =
                (self.step_motion(i), [step.total[i], step.before.unbalanced[i]]);
            let at_fixed = [Directions(room.direct[i]), Directions(room.right[i])];
            let [n, r] = nodal.with_scheme(mass[i], &step_motion, forces, scheme, at_fixed);
            (room.direct[i], room.right[i]) = (n.0, r.0);
        }
    }

    /// Solves `J x = right` for `G` right-hand sides with the factors of the step, into `room.solution`. Right-hand
    /// sides of prescribed unknowns, and so their solutions, are zero. In space the turns of directors, `room.turned`,
    /// are taken into account: with `m M` the masses in `J`, `J (x + turned) = right + m M turned`.
    ///
    /// # Errors
    /// [`Error::SingularTangent`] where a matrix with negative pivots is not solved to half of all digits.
    fn solve<const G: usize>(&self, room: &mut StepWorkspace<R, G>) -> Result<(), Error> {
        let (step, StepWorkspace { right, solution, turned, .. }) = (self.step, room);
        // Prescribed unknowns follow a recording: their equations are q1 = recorded place.
        step.prescribed.fill(right, [0.0; G]);
        solution.copy_from_slice(right);
        // With directors that turn by `turned` the equations are J q1 = r - end K turned. As J = m M + end K with the
        // factor m of the masses, they are J (q1 + turned) = r + m M turned.
        let turns = R::HAS_FRAMES && !self.averages;
        if turns {
            // Every fourth unknown is an angle.
            let (mass, factor) = (step.rod.mass().as_chunks::<4>().0, step.weights[0]);
            let solution = &mut solution.as_chunks_mut::<4>().0[..mass.len()];
            let turned = &turned.as_chunks::<4>().0[..mass.len()];
            for j in 0..mass.len() {
                for g in 0..G {
                    solution[j][3][g] += factor * mass[j][3] * turned[j][3][g];
                }
            }
        }
        // A positive definite matrix is always solved well: LDL^T without pivoting is backward
        // stable.
        let right = (step.factors.negative_pivots() > 0).then(|| solution.clone());
        step.factors.solve_many(solution);
        if let Some(right) = right {
            for g in 0..G {
                let lane = |list: &[[f64; G]]| list.iter().map(|x| x[g]).collect::<Vec<f64>>();
                step.check_solution(&lane(solution), &lane(&right))?;
            }
        }
        if turns {
            let solution = solution.as_chunks_mut::<4>().0;
            let turned = &turned.as_chunks::<4>().0[..solution.len()];
            for j in 0..solution.len() {
                for g in 0..G {
                    solution[j][3][g] -= turned[j][3][g];
                }
            }
        }
        Ok(())
    }

    /// Overwrites unknowns, velocities, accelerations and forces of free unknowns in `state` with their derivatives at
    /// the end. They follow by the equations of the scheme from those at the start, `room.direct`, `room.right` and
    /// `room.solution`. The parameter of the scheme is held here. `A`: whether the scheme uses accelerations.
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
            let a0 = if A { Directions(a[i]) } else { Directions::ZERO };
            // Velocity, acceleration and force follow from q1 by the equations of the scheme.
            let q1 = Directions(solution[i]);
            let [v1, a1] = nodal.end::<A, G>([Directions(q[i]), Directions(v[i]), a0, q1]);
            n1[i] = nodal.force(mass[i], [Directions(direct[i]), Directions(right[i]), q1]).0;
            (q[i], v[i]) = (solution[i], v1.0);
            if A {
                a[i] = a1.0;
            }
        }
    }

    /// Adds the derivatives of velocities and accelerations of free unknowns by the scheme's parameter. Then sets place
    /// and velocity of unknowns outside the free range to `room.held`, and velocities and accelerations of recorded
    /// unknowns inside it to zero.
    fn add_scheme<const G: usize>(
        &self,
        parameters: &ParameterRates<R, G>,
        state: &mut StateRates<G>,
        room: &StepWorkspace<R, G>,
    ) {
        let scheme = parameters.numbers.scheme;
        if scheme != Directions::ZERO {
            for i in self.step.free.clone() {
                let [v, a] = self.nodal.end_by_scheme(&self.step_motion(i));
                state.v[i] = (Directions(state.v[i]) + scheme * v).0;
                if let Some(own) = state.acceleration.get_mut(i) {
                    *own = (Directions(*own) + scheme * a).0;
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

    /// Completes `state.unbalanced`, the derivatives of the forces at the end of the step, to those of the forces that
    /// the next step takes at its start, except drag, which the caller adds. Adds the derivatives of the viscous forces
    /// at the next start less the viscous forces at this end (stresses of `history.effective`), and subtracts the
    /// derivatives of the drag at the end. For an averaging scheme the result is the derivatives of the viscous forces
    /// at the next start alone.
    #[inline(always)]
    fn set_next_forces<const G: usize>(
        &self,
        parameters: &ParameterRates<R, G>,
        state: &mut StateRates<G>,
        StepWorkspace { direct, history, dragged, solution, .. }: &mut StepWorkspace<R, G>,
    ) {
        let step = self.step;
        if self.averages {
            state.unbalanced.fill([0.0; G]);
        } else if !parameters.drag.is_empty() {
            self.subtract_drag(solution, dragged, direct, state);
        }
        let (laws, strains) = (&parameters.laws, &history.effective);
        step.rod.viscous_force_rate(laws, strains, &state.frames, step.end, &state.q, direct);
        let forces = &mut state.unbalanced[step.free.clone()];
        let count = forces.len();
        let difference = &direct[step.free.clone()][..count];
        for i in 0..count {
            for g in 0..G {
                forces[i][g] += difference[i][g];
            }
        }
    }

    /// Subtracts the derivatives of the drag at the end of the step from those of the forces there, `state.unbalanced`.
    /// They are `dragged`, the derivatives at fixed free unknowns, plus the drag's part of the matrix times `solution`,
    /// the derivatives of the unknowns at the end. `dragged` and `room` are overwritten.
    fn subtract_drag<const G: usize>(
        &self,
        solution: &[[f64; G]],
        dragged: &mut [[f64; G]],
        room: &mut [[f64; G]],
        state: &mut StateRates<G>,
    ) {
        // Drag is the part of the matrix of the step that its tangent has not.
        let step = self.step;
        step.matrix.add_product(solution, dragged);
        room.fill([0.0; G]);
        step.tangent.add_product(solution, room);
        for (i, force) in state.unbalanced.iter_mut().enumerate() {
            (0..G).for_each(|g| force[g] -= dragged[i][g] - room[i][g]);
        }
    }
}
