//! A simulation: the state of a rod, its equations of motion, and the stepper that advances it from time to time.
//!
//! Input: rod, unknowns, frames, free range, damping and scheme; then drag, loads in time, actuators that follow
//! signals, moving supports and velocities. `step_to` makes one step of any size. A step that fails, or goes through a
//! fold, is an error and leaves the state before it. `step_back` restores the state before the last step; counts of
//! work stay. After `stay` it changes nothing. The scalar is any number type: with dual numbers the state has
//! derivatives. If tangents were requested, `linearization` is the last step of Newton's method at its solution. It is
//! `None` at the start, after an undone step, and for explicit and linearly implicit schemes. Energies are in J,
//! without derivatives: the kinetic one of free unknowns, the elastic ones with those of Maxwell and friction springs,
//! and the potential of the loads. Of loads in time, loads without a potential, actuators and moved obstacles it has
//! minus the work since the start.
//!
//! `linearized` linearizes an earlier step from the states before and after it. `repeat_step` and `adopt` transfer a
//! step between simulations in plain and in dual numbers. `energy_of_motion_by` and `follower_work_error` bound the
//! effect of rounding errors of coordinates on the energy, J.
//!
//! Settings: `immerse` (drag), `load_in_time`, `follow` (actuators with signals), `move_supports`, `set_velocity`, and
//! `set_velocity_from_change` (of a recorded start). Each computes the forces at the start again. `keep_tangent`
//! requests tangents, `keep_all_tangents` also those that transposed derivatives need.
//!
//! Queries: `rod`, `state`, `free` (the range of free unknowns), `damping`, `drag` and `work` (counts, with undone
//! steps). `previous` is the state before the last step. `needs_dual_steps` and `can_linearize_again` state how
//! derivatives of steps are computed; `linear` is a copy that linearizes steps again. `kinetic_energy` and `energies`
//! are those of the present state; `non_finite_energy` is the error of the first user-defined energy that is not
//! finite. `timed_loads` are the loads in time, `boundary_motion` is the motion of supports, and `newton` the Newton
//! solver; the last two are `None` if absent.

use crate::dynamics::coefficients::AVERAGE;
use crate::dynamics::linearization::Linearization;
use crate::dynamics::step::{Step, StepperSettings, System, Work};
use crate::dynamics::stepper::{self, Newton, Stepper};
use crate::energy::Derivatives;
use crate::error::Error;
use crate::numerics::prescribed_dofs::PrescribedDofs;
use crate::numerics::scalar::RodScalar;
use crate::numerics::tangent::Tangent;
use crate::problem::boundary::BoundaryMotion;
use crate::rod::{Actuators, Energies, NodalDrag, Rod, State, TimedLoads, set_real_frames};
use crate::scene::Damping;
use num_dual::Dual64;
use std::ops::Range;

/// A simulation of a rod, over any scalar: with dual numbers it contains the derivatives of the motion.
#[derive(Clone, Debug)]
pub struct Simulation<D: RodScalar, R: Rod<D>> {
    /// The equations of motion.
    system: System<D, R>,
    /// The state now.
    state: State<D, R::Frames>,
    /// The state before the last step.
    previous: State<D, R::Frames>,
    /// The stepper of the scheme.
    stepper: Stepper<D, R>,
    /// Counts of the numerical work so far.
    work: Work,
}

impl<D: RodScalar, R: Rod<D>> Simulation<D, R> {
    /// A simulation of a rod at rest at `q` with the given frames, at time zero, without drag and moving supports. Only
    /// the unknowns in `free` move. The stepper follows from `settings`; `derivatives` selects hand-derived or dual
    /// derivatives of the energy. The forces at the start are computed, and the accelerations for generalised-alpha.
    pub fn new(
        rod: R,
        q: Vec<D>,
        frames: R::Frames,
        free: Range<usize>,
        damping: Damping<D>,
        settings: StepperSettings<D>,
        derivatives: Derivatives,
    ) -> Self {
        let mut state = State::at_rest(q, frames);
        let (prescribed, drag, boundary_motion) = (PrescribedDofs::default(), None, None);
        let timed_loads = TimedLoads::none();
        let actuators = Actuators::at(Vec::new(), 0.0);
        let system = System {
            rod,
            derivatives,
            free,
            prescribed,
            damping,
            drag,
            timed_loads,
            actuators,
            boundary_motion,
        };
        let mut stepper = Stepper::new(settings, &system, &mut state);
        stepper.find_forces(&system, &mut state);
        stepper.find_acceleration(&system, &mut state);
        Self { system, previous: state.clone(), state, stepper, work: Work::default() }
    }

    /// Requests tangents and factors at the solution of every later step, for its
    /// [linearization](Self::linearization). No effect for schemes without Newton's method.
    pub fn keep_tangent(&mut self) {
        self.stepper.keep_tangent();
    }

    /// Requests tangents and factors at the solution of every later step for its transposed derivatives. Those need
    /// the tangents of the forces at the starts of steps too, which viscous rods keep then.
    pub(crate) fn keep_all_tangents(&mut self) {
        self.stepper.keep_tangent();
        self.stepper.keep_next_tangent();
    }

    /// Sets the drag of a fluid, and computes the forces at the start again, and the accelerations for
    /// generalised-alpha.
    pub(crate) fn immerse(&mut self, drag: NodalDrag<D>) {
        self.system.drag = Some(drag);
        self.find_forces();
    }

    /// Sets the forces that depend on time (loads with signals), and computes the forces at the start again, and the
    /// accelerations for generalised-alpha.
    pub(crate) fn load_in_time(&mut self, timed_loads: TimedLoads<D>) {
        self.system.timed_loads = timed_loads;
        self.find_forces();
    }

    /// Sets the actuators that follow signals. The rod must have the values of these signals at the present time
    /// already.
    pub(crate) fn follow(&mut self, actuators: Actuators<D>) {
        self.system.actuators = actuators;
    }

    /// Whether actuators follow signals, so that the laws of the rod depend on time.
    fn has_actuators(&self) -> bool {
        !self.system.actuators.is_empty()
    }

    /// Whether derivatives come from the same steps in dual numbers, because steps are not linearized: with actuators
    /// that follow signals, loads without a potential, damping or friction of contacts, or moved obstacles.
    pub(crate) fn needs_dual_steps(&self) -> bool {
        let rod = &self.system.rod;
        self.has_actuators()
            || rod.has_follower_loads()
            || rod.has_contact_losses()
            || rod.has_moved_obstacles()
    }

    /// Sets the motion of supports, and the unknowns inside the free range that it prescribes. Overwrites the
    /// velocities of held nodes by those of the motion at the present time, and computes the forces at the start again,
    /// and the accelerations for generalised-alpha.
    pub(crate) fn move_supports(
        &mut self,
        boundary_motion: BoundaryMotion<D>,
        prescribed: PrescribedDofs,
    ) {
        boundary_motion.velocities(self.state.time, &mut self.state.v);
        self.system.boundary_motion = Some(boundary_motion);
        self.system.prescribed = prescribed;
        self.find_forces();
    }

    /// Sets the velocities, m/s (rad/s for angles), of the free unknowns; other entries of `v` are ignored, and
    /// prescribed unknowns keep the velocities of their recordings. Computes the forces at the start again, and the
    /// accelerations for generalised-alpha.
    pub fn set_velocity(&mut self, v: &[D]) {
        for i in self.system.free.clone() {
            self.state.v[i] = v[i];
        }
        self.system.apply_prescribed_velocities(self.state.time, &mut self.state.v);
        self.find_forces();
    }

    /// Sets initial velocities from the `change` of all unknowns in the first `h`, s: the mean velocity `change/h`
    /// less `a h/2`. `a` is the acceleration at the start as a step of `h/2` resolves it. Prescribed unknowns get the
    /// velocities of their recordings. `a` and the forces that cause it are stored for the first step.
    ///
    /// # Errors
    /// [`Error::SingularTangent`].
    pub(crate) fn set_velocity_from_change(&mut self, change: &[D], h: f64) -> Result<(), Error> {
        let half = 0.5 * h;
        for i in self.system.free.clone() {
            self.state.v[i] = change[i] * (1.0 / h);
        }
        // `change/h` is the velocity in the middle of the interval; the start is half an interval
        // of acceleration before it.
        let a = stepper::acceleration_within(half, &self.system, &mut self.state, change)?;
        for i in self.system.free.clone() {
            self.state.v[i] -= a[i] * half;
        }
        self.system.apply_prescribed_velocities(self.state.time, &mut self.state.v);
        self.find_forces();
        self.stepper.set_initial_acceleration(a, &self.system, &mut self.state);
        Ok(())
    }

    /// Computes the forces and, for generalised-alpha, the accelerations that the next step takes as those of its
    /// start.
    fn find_forces(&mut self) {
        self.stepper.find_forces(&self.system, &mut self.state);
        self.stepper.find_acceleration(&self.system, &mut self.state);
    }

    /// The rod under its loads.
    pub fn rod(&self) -> &R {
        &self.system.rod
    }
    /// The drag of a fluid on the nodes; `None` without a fluid.
    pub(crate) fn drag(&self) -> Option<&NodalDrag<D>> {
        self.system.drag.as_ref()
    }
    /// The loads in time: forces that follow signals, and in a plane moments; empty without any.
    pub(crate) fn timed_loads(&self) -> &TimedLoads<D> {
        &self.system.timed_loads
    }
    /// The motion of the supports and recorded nodes; `None` if nothing is moved.
    pub(crate) fn boundary_motion(&self) -> Option<&BoundaryMotion<D>> {
        self.system.boundary_motion.as_ref()
    }
    /// The present state.
    pub fn state(&self) -> &State<D, R::Frames> {
        &self.state
    }
    /// The state before the last step; the initial state if there was none. After [`step_back`](Self::step_back) it
    /// equals the present state.
    pub fn previous(&self) -> &State<D, R::Frames> {
        &self.previous
    }
    /// The index range of the free unknowns, which supports do not hold. Recordings may prescribe some of them.
    pub fn free(&self) -> Range<usize> {
        self.system.free.clone()
    }
    /// Mass damping, Kelvin-Voigt damping, relaxation and internal friction of the scene.
    pub fn damping(&self) -> &Damping<D> {
        &self.system.damping
    }
    /// Counts of the numerical work so far, undone steps included.
    pub fn work(&self) -> Work {
        self.work
    }
    /// The Newton solver; `None` for explicit and linearly implicit schemes.
    pub(crate) fn newton(&self) -> Option<&Newton<D, R>> {
        self.stepper.newton()
    }

    /// The last step, linearized at its solution. `None` at the start, after a step that was undone, without [kept
    /// tangents](Self::keep_tangent), and for schemes that solve no equations. Derivatives of the latter come from
    /// the same step in dual numbers.
    pub fn linearization(&self) -> Option<Linearization<'_, D, R>> {
        if self.previous.time >= self.state.time {
            return None;
        }
        self.newton()?.linearization(&self.system, &self.previous, &self.state)
    }

    /// Whether steps can be [linearized](Self::linearized) from the states before and after them: Newmark-beta and
    /// generalised-alpha, unless derivatives [need dual steps](Self::needs_dual_steps).
    pub(crate) fn can_linearize_again(&self) -> bool {
        !self.needs_dual_steps() && self.newton().is_some_and(|newton| !newton.averages())
    }

    /// A copy that [linearizes](Self::linearized) steps of this simulation again: it keeps tangents, and its work
    /// count begins at zero.
    pub(crate) fn linear(&self) -> Self {
        let mut linear = Self { work: Work::default(), ..self.clone() };
        linear.keep_tangent();
        linear
    }

    /// The [linearization](Self::linearization) of an earlier step from the states `before` and `after` it, with
    /// tangent and factors computed at `after`. `None` for schemes without Newton's method, and without kept tangents.
    /// Not for averaging schemes, whose stages are not stored. The state of this simulation does not change; its work
    /// count does.
    ///
    /// # Errors
    /// [`Error::SingularTangent`].
    pub(crate) fn linearized<'a>(
        &'a mut self,
        before: &'a State<D, R::Frames>,
        after: &'a State<D, R::Frames>,
    ) -> Result<Option<Linearization<'a, D, R>>, Error> {
        let Stepper::Newton(newton) = &mut self.stepper else { return Ok(None) };
        newton.linearize(&self.system, before, after, &mut self.work)?;
        Ok(newton.linearization(&self.system, before, after))
    }

    /// Kinetic energy of the free unknowns in the present state, J, without derivatives: half the sum of `mass v^2`.
    /// Held unknowns are left out, also those that supports move.
    pub fn kinetic_energy(&self) -> f64 {
        let twice = |mass: &D, v: &D| mass.value() * v.value() * v.value();
        let (masses, rest_mass) = self.system.rod.mass()[self.system.free.clone()].as_chunks::<4>();
        let (velocities, rest_v) = self.state.v[self.system.free.clone()].as_chunks::<4>();
        // Four sums in SIMD lanes: step control needs the energy after every step.
        let mut sums = [0.0; 4];
        for (mass, v) in masses.iter().zip(velocities) {
            for k in 0..4 {
                sums[k] += twice(&mass[k], &v[k]);
            }
        }
        let rest: f64 = rest_mass.iter().zip(rest_v).map(|(mass, v)| twice(mass, v)).sum();
        0.5 * (sums.iter().sum::<f64>() + rest)
    }

    /// All energies of the present state, J, without derivatives. Bending includes the energy of friction springs, each
    /// kind that of its Maxwell springs. The potential includes whole turns of constant moments. Of loads in time,
    /// loads without a potential, actuators that follow signals and moved obstacles it has minus the work since the
    /// start.
    pub fn energies(&self) -> Energies {
        let kinetic = self.kinetic_energy();
        let mut energies = self.system.rod.energies(&self.state.q, &self.state.frames);
        // The angle of a moment is known within one turn; whole turns since the start add to its
        // potential.
        energies.potential += self.state.wound;
        let internal = &self.state.internal;
        energies.bend += self.system.rod.slider_energy(&internal.slid);
        let branches = self.system.damping.maxwell.as_slice();
        for (branch, stretches) in branches.iter().zip(internal.branches()) {
            let kinds = self.system.rod.branch_energies(stretches);
            let [stretch, bend, twist] = kinds.map(|energy| (energy * branch.stiffness).value());
            energies.stretch += stretch;
            energies.bend += bend;
            energies.twist += twist;
        }
        Energies { kinetic, ..energies }
    }

    /// An upper bound of the energy, J, of a change of all free coordinates by the fraction `relative` of themselves
    /// within the time `h`, s: `relative^2/2 sum_i ((|K| |q|)_i |q_i| + m_i (q_i/h)^2)`. It bounds the effect of
    /// rounding errors of coordinates.
    pub(crate) fn energy_of_motion_by(&self, relative: f64, h: f64) -> f64 {
        let State { q, frames, .. } = &self.state;
        let n = q.len();
        let (mut gradient, mut tangent) = (vec![D::from(0.0); n], self.system.rod.zero_tangent());
        self.system.rod.tangent(q, frames, self.system.derivatives, &mut gradient, &mut tangent);
        let mut forces = vec![0.0; n];
        // Absolute values, because rounding errors of coordinates have any sign.
        tangent.absolute_product(q, &mut forces);
        let of = |i: usize| {
            let (mass, q) = (self.system.rod.mass()[i].value(), q[i].value().abs());
            forces[i] * q + mass * (q / h) * (q / h)
        };
        0.5 * relative * relative * self.system.free.clone().map(of).sum::<f64>()
    }

    /// Advances to `time`, s, in one step of any size. A step through a fold is rejected. If a step fails at values
    /// of a user-defined energy that are not finite, the error names that energy.
    ///
    /// # Errors
    /// [`Error::Newton`], [`Error::SingularTangent`], [`Error::Unstable`], [`Error::Fold`] or [`Error::NotFinite`]; the
    /// state is then the one before the step.
    pub fn step_to(&mut self, time: f64) -> Result<(), Error> {
        match self.system.rod.has_moved_obstacles() {
            true => self.step_with_moved_obstacles(time),
            false => self.step_between_obstacles(time),
        }
    }

    /// [`step_to`](Self::step_to) of a rod with moved obstacles, whose forces depend on their places and velocities at
    /// the end of the step. Their work is that of the mean of the forces at both ends of the step.
    fn step_with_moved_obstacles(&mut self, time: f64) -> Result<(), Error> {
        let interval = [self.state.time, time];
        let work = |simulation: &Self| {
            let State { q, v, frames, .. } = &simulation.state;
            simulation.system.rod.obstacle_work(interval, [q, v], frames)
        };
        let before = work(self);
        self.system.rod.move_obstacles(interval);
        if let Err(error) = self.step_between_obstacles(time) {
            self.system.rod.move_obstacles([self.state.time; 2]);
            return Err(error);
        }
        self.subtract_work(0.5 * (before + work(self)));
        Ok(())
    }

    /// [`step_to`](Self::step_to) with the present places of all obstacles.
    fn step_between_obstacles(&mut self, time: f64) -> Result<(), Error> {
        match self.has_actuators() {
            true => self.actuated_step_to(time),
            false => {
                self.plain_step_to(time)?;
                self.subtract_work(self.follower_work());
                Ok(())
            }
        }
    }

    /// The work, J, of the loads without a potential in the last step, with the present factors of these loads: on the
    /// straight line between its states, by the quadrature of the average vector field. It is the work in the equations
    /// of that scheme; for others the error is that of their order. Zero without such loads.
    fn follower_work(&self) -> f64 {
        if !self.system.rod.has_follower_loads() {
            return 0.0;
        }
        let (before, now) = (&self.previous, &self.state);
        let (mut forces, mut work) = (vec![D::from(0.0); now.q.len()], 0.0);
        for stage in &AVERAGE {
            let way = now.q.iter().zip(&before.q).map(|(now, before)| (*now - *before, before));
            let q: Vec<D> = way.map(|(change, before)| *before + change * stage.place).collect();
            forces.fill(D::from(0.0));
            self.system.rod.add_follower_forces(&q, &before.frames, &mut forces);
            for i in 0..q.len() {
                work += forces[i].value() * (now.q[i] - before.q[i]).value() * stage.weight;
            }
        }
        work
    }

    /// The error, J, of the work of loads without a potential by errors of the fraction `relative` of all coordinates:
    /// the sum of the absolute forces times coordinates. Zero without such loads.
    pub(crate) fn follower_work_error(&self, relative: f64) -> f64 {
        if !self.system.rod.has_follower_loads() {
            return 0.0;
        }
        let State { q, frames, .. } = &self.state;
        let mut forces = vec![D::from(0.0); q.len()];
        self.system.rod.add_follower_forces(q, frames, &mut forces);
        let sizes = forces.iter().zip(q).map(|(force, q)| (force.value() * q.value()).abs());
        relative * sizes.sum::<f64>()
    }

    /// Subtracts the work, J, of loads, actuators or obstacles in the last step from the potential. Adds its absolute
    /// value to the exchanged work, a scale of step control.
    fn subtract_work(&mut self, work: f64) {
        self.state.wound -= work;
        self.state.exchanged.work += work.abs();
    }

    /// [`step_to`](Self::step_to) of a rod whose actuators follow signals. Averaging schemes take the means of the
    /// signals over the step, others the values at its end; the forces at its start are those of the step before. The
    /// work of the actuators is the change of the energies with the signals at fixed unknowns: exactly with means, else
    /// the mean of both ends of the step.
    fn actuated_step_to(&mut self, time: f64) -> Result<(), Error> {
        let (start, before) = (self.state.time, self.system.actuators.values.clone());
        let after = self.system.actuators.values_at(time);
        let averages = self.newton().is_some_and(Newton::averages);
        let during = match averages {
            true => self.system.actuators.means(start, time),
            false => after.clone(),
        };
        let energy_at_start = self.elastic_energy();
        self.system.set_actuation(&during);
        let mut work = self.elastic_energy() - energy_at_start;
        if let Err(error) = self.plain_step_to(time) {
            self.system.set_actuation(&before);
            return Err(error);
        }
        // Change of the energies at the unknowns of the end: from the means, or from the start on.
        if !averages {
            self.system.set_actuation(&before);
        }
        let energy_before = self.elastic_energy();
        let followers_before = self.follower_work();
        self.system.set_actuation(&after);
        work += self.elastic_energy() - energy_before;
        if averages {
            self.subtract_work(work);
            self.subtract_work(followers_before);
        } else {
            self.subtract_work(0.5 * work);
            self.subtract_work(0.5 * (followers_before + self.follower_work()));
        }
        Ok(())
    }

    /// The sum of all energies of the rod in the present state but the kinetic one, J, without internal variables and
    /// the work of loads in time.
    fn elastic_energy(&self) -> f64 {
        self.system.rod.energies(&self.state.q, &self.state.frames).total()
    }

    /// Sets the actuators to the values of their signals at the time of the present state, and moves the obstacles to
    /// their places at the end of the last step.
    fn set_rod_now(&mut self) {
        self.system.rod.move_obstacles([self.previous.time, self.state.time]);
        if self.has_actuators() {
            let values = self.system.actuators.values_at(self.state.time);
            self.system.set_actuation(&values);
        }
    }

    /// [`step_to`](Self::step_to) of a rod with constant laws, without the work of loads that have no potential. A step
    /// that fails or goes through a fold restores the state before it. The error is then that of a user-defined energy
    /// that is not finite, if there is one, else that of the step.
    fn plain_step_to(&mut self, time: f64) -> Result<(), Error> {
        std::mem::swap(&mut self.state, &mut self.previous);
        let (before, state, work) = (&self.previous, &mut self.state, &mut self.work);
        let step = Step { system: &self.system, time, h: time - before.time };
        // A fold has infinite energy: a converged step beyond it is another root of the equations,
        // not the motion.
        let solved = self.stepper.step(&step, before, state, work).and_then(|()| {
            match step.system.rod.folded_node(&before.q, &state.q, &before.frames) {
                Some(node) => Err(Error::Fold { time, node }),
                None => Ok(()),
            }
        });
        match solved {
            Ok(()) => {
                self.stepper.finish(&step, before, state, work);
                state.time = time;
            }
            Err(_) => {
                // Newton's method fails at such values as well; the name of the energy is the more
                // helpful error.
                let named = self.non_finite_energy(time);
                self.state.restore(&self.previous);
                return named.map_or(solved, Err);
            }
        }
        solved
    }

    /// Repeats the last step of `plain`, a simulation of the same rod in plain numbers that [keeps
    /// tangents](Self::keep_tangent), over the numbers of this simulation, which carry derivatives: one linear solution
    /// with its factors for each order of derivatives. Returns false, and changes nothing, for schemes without Newton's
    /// method and averaging ones.
    pub(crate) fn repeat_step<P: Rod<f64>>(&mut self, plain: &Simulation<f64, P>) -> bool {
        let Some(solver) = plain.newton().filter(|newton| !newton.averages()) else { return false };
        let Stepper::Newton(newton) = &mut self.stepper else { return false };
        std::mem::swap(&mut self.state, &mut self.previous);
        let (before, state, work) = (&self.previous, &mut self.state, &mut self.work);
        let time = plain.state.time;
        self.system.rod.move_obstacles([before.time, time]);
        let step = Step { system: &self.system, time, h: time - before.time };
        newton.repeat(&step, before, state, solver, &plain.state.q, work);
        self.stepper.finish(&step, before, state, work);
        state.time = time;
        true
    }

    /// The error at `time` of the first user-defined energy whose value or gradient is not finite in the current
    /// state; `None` if all are finite.
    pub(crate) fn non_finite_energy(&self, time: f64) -> Option<Error> {
        let (name, arc_length) =
            self.system.rod.non_finite_energy(&self.state.q, &self.state.frames)?;
        Some(Error::NotFinite { time, name, arc_length })
    }

    /// Restores the state before the last step, the values of actuators and the places of obstacles at its time; a
    /// second call changes nothing. The work count stays.
    pub fn step_back(&mut self) {
        self.state.restore(&self.previous);
        self.set_rod_now();
    }
}

impl<R: Rod<f64>> Simulation<f64, R> {
    /// Takes over the last step of a simulation of the same rod in dual numbers: time, unknowns, velocities, forces,
    /// accelerations, frames, internal variables, potential of moments and exchanged work without derivatives, and its
    /// counts of work. The present state becomes the previous one, actuators get the values of their signals,
    /// and obstacles their places.
    pub(crate) fn adopt(&mut self, dual: &Simulation<Dual64, R::Dual>) {
        std::mem::swap(&mut self.state, &mut self.previous);
        let (state, of) = (&mut self.state, &dual.state);
        let real = |to: &mut Vec<f64>, from: &[Dual64]| {
            to.clear();
            to.extend(from.iter().map(|x| x.re));
        };
        real(&mut state.q, &of.q);
        real(&mut state.v, &of.v);
        real(&mut state.unbalanced, &of.unbalanced);
        real(&mut state.acceleration, &of.acceleration);
        let (internal, dual_internal) = (&mut state.internal, &of.internal);
        real(&mut internal.strain, &dual_internal.strain);
        real(&mut internal.strain_rate, &dual_internal.strain_rate);
        real(&mut internal.slid, &dual_internal.slid);
        real(&mut internal.relaxing, &dual_internal.relaxing);
        set_real_frames(&of.frames, &mut state.frames);
        (state.time, state.wound, self.work) = (of.time, of.wound, dual.work);
        state.exchanged = of.exchanged;
        self.set_rod_now();
    }

    /// Overwrites the stored state before the last step by the current state, so that [`step_back`](Self::step_back)
    /// changes nothing.
    pub(crate) fn stay(&mut self) {
        self.previous.restore(&self.state);
    }
}
