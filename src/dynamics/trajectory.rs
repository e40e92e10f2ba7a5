//! Trajectories: positions and velocities of tracked nodes at the start and after every step of a run, with their
//! derivatives by parameters.
//!
//! [`Trajectory`] belongs to one problem and one run, or to an equilibrium (one record at time 0, with zero velocities,
//! [`Trajectory::at_rest`]). A run is made by [`Problem::simulate`] or [`Trajectory::run`], which rejects a second run,
//! another scene, more steps than the scene has, and a scene without `[time]`. A run that fails keeps the states
//! before. If parameters include a Kelvin-Voigt time and the rod has no viscosity, the run is made with a trace of it.
//! `at` returns the position (m, world axes) of a point on the rod at any simulated time (s), by cubic Hermite
//! interpolation, and its derivative by each parameter. Times that were not simulated, and points whose nodes were not
//! tracked, are errors; `node`, `velocity` and `tip` panic for these. [`Trajectory::over`] repeats the run with its
//! accepted steps in another scalar, for example hyper-dual numbers for second derivatives. Energies, reactions, axes
//! of edges and stability checks are recorded if requested before the run.
//!
//! - `simulate_with`, `new`, `at_rest` and `load_path` (equilibria of one rod under several loads) take parameters, by
//!   which there are derivatives. `find_equilibrium` computes an equilibrium in an empty trajectory. `unrecorded`
//!   records nothing, for a run with an observer.
//! - `keep_energies`, `keep_reactions`, `keep_axes` and `check_stability` request records before the run.
//! - `times` (s), `work` (counts), `stepping` (wall time), `energies` (J), `reactions` (N, N m) and `reaction_rates`
//!   (their derivatives) are results; lists that were not requested are empty. `into_parts` returns the lists of the
//!   record.
//! - `record`, `record_mut`, `into_record` and `recorded` (from a record made elsewhere) give access to the record;
//!   `parameters` are those of the derivatives, and `nodes` is the number of nodes of the rod. `scale_derivatives`
//!   multiplies the derivatives by one parameter by a factor. `check_run` rejects runs as above.

use crate::dynamics::record::{Motion, Record};
use crate::dynamics::run::{RunObservers, RunTask, Snapshot, repeat_over, run};
use crate::dynamics::step::Work;
use crate::dynamics::unstable_state::StabilityChecks;
use crate::error::Error;
use crate::numerics::scalar::{RodScalar, Scalar};
use crate::problem::{AnyProblem, Discretized, FramesOf, Model, Problem};
use crate::rod::{Energies, State};
use crate::scene::{Parameter, Point, Stencil};
use crate::statics::{CheckedEquilibrium, EquilibriumOutputs, EquilibriumRequest, Reactions};
use nalgebra::Vector3;
use num_dual::Dual64;
use std::time::Duration;

/// The recorded motion, in world coordinates, over the scalar it was computed in.
///
/// A trajectory in plain numbers stores the derivatives by its [parameters](Self::parameters) separately.
/// [`over`](Trajectory::over) repeats the run in numbers that carry derivatives.
#[derive(Clone, Debug)]
pub struct Trajectory<D = f64> {
    /// The problem of the run.
    problem: Problem,
    /// The parameters of the derivatives.
    parameters: Vec<Parameter>,
    /// Whether it is an equilibrium at time 0.
    rests: bool,
    /// The recorded motions.
    record: Record<D>,
}

impl Problem {
    /// Simulates the whole scene and keeps positions and velocities of every node, without derivatives.
    ///
    /// The numerics are those of the problem, and the run does not check them. Where the program chose them, use
    /// [`Scene::simulate`](crate::Scene::simulate), which repeats a run that is less accurate than requested.
    ///
    /// ```
    /// let problem = rodfit::Scene::load("data/cantilever.toml")?.problem()?;
    /// let run = problem.simulate()?;
    /// assert_eq!(run.times().len(), 1001); // the start and 1000 steps
    /// assert!(run.tip(1000)[1] < 0.0); // m
    /// # Ok::<(), rodfit::Error>(())
    /// ```
    ///
    /// # Errors
    /// Those of [`Trajectory::run`].
    pub fn simulate(&self) -> Result<Trajectory, Error> {
        self.simulate_with(&[])
    }

    /// Simulates the whole scene and keeps positions and velocities of every node, with their derivatives with
    /// respect to `parameters`.
    ///
    /// ```
    /// use rodfit::{Parameter, Point, Scene};
    /// let problem = Scene::load("data/cantilever.toml")?.problem()?;
    /// let run = problem.simulate_with(&[Parameter::YoungsModulus])?;
    /// let (_, slopes) = run.at(Point::Tip, 0.1)?;
    /// assert!(slopes[0][1] > 0.0); // m/Pa: a stiffer rod falls less
    /// # Ok::<(), rodfit::Error>(())
    /// ```
    ///
    /// # Errors
    /// Those of [`Trajectory::new`] and [`Trajectory::run`].
    pub fn simulate_with(&self, parameters: &[Parameter]) -> Result<Trajectory, Error> {
        // All nodes are tracked: any point of the rod can be interpolated.
        let all: Vec<usize> = (0..self.nodes()).collect();
        let mut trajectory = Trajectory::new(self, &all, parameters)?;
        trajectory.run(self, self.time()?.steps(), |_| {})?;
        Ok(trajectory)
    }
}

impl Trajectory {
    /// An empty record of the nodes `tracked`, sorted and without duplicates, for a run with derivatives by
    /// `parameters`. Nothing is simulated.
    ///
    /// # Errors
    /// [`Error::Invalid`] for a parameter that the scene does not have, [`Error::OutOfRange`] for a
    /// node that the rod does not have.
    pub fn new(
        problem: &Problem,
        tracked: &[usize],
        parameters: &[Parameter],
    ) -> Result<Self, Error> {
        // An unknown parameter is an error before any step is made.
        for parameter in parameters {
            problem.check_parameter(*parameter)?;
        }
        let mut tracked = tracked.to_vec();
        // Ascending and without duplicates: nodes are found by bisection.
        tracked.sort_unstable();
        tracked.dedup();
        if let Some(found) = tracked.last().filter(|node| **node >= problem.nodes()) {
            let (found, high) = (*found as f64, problem.segments() as f64);
            return Err(Error::OutOfRange { what: "node", found, low: 0.0, high });
        }
        Ok(Self {
            problem: problem.clone(),
            parameters: parameters.to_vec(),
            rests: false,
            record: Record::new(tracked, parameters.len()),
        })
    }

    /// An empty trajectory for a run whose states are only passed to an observer: no motion, energies or reactions
    /// are recorded, and there are no derivatives.
    ///
    /// # Errors
    /// None today.
    pub fn unrecorded(problem: &Problem) -> Result<Self, Error> {
        let mut trajectory = Self::new(problem, &[], &[])?;
        trajectory.record.keeps = false;
        Ok(trajectory)
    }

    /// Requests, for the run to come, the director axes of these edges; `edges` must be in ascending order.
    pub(crate) fn keep_axes(mut self, edges: &[usize]) -> Self {
        self.record = self.record.with_axes(edges);
        self
    }

    /// Requests the [energies](Self::energies) at every recorded time of the run to come.
    pub fn keep_energies(mut self) -> Self {
        self.record.energies = Some(Vec::new());
        self
    }

    /// Requests, for the run to come, stability checks of at most nine states, the last one included.
    /// [`SimulationReport`](crate::dynamics::SimulationReport) then has a warning if symmetry holds the rod at an
    /// unstable state.
    pub fn check_stability(mut self) -> Self {
        self.record.stability = Some(StabilityChecks::default());
        self
    }

    /// Requests the [reactions](Self::reactions) of the supports at every recorded time of the run to come, with their
    /// derivatives by the parameters.
    pub fn keep_reactions(mut self) -> Self {
        self.record.has_reactions = true;
        self
    }

    /// The [equilibrium](Problem::equilibrium) of a problem as a record at time 0: the nodes `tracked` of the rod at
    /// rest under its loads, with zero velocities, and their exact derivatives by `parameters`. The scene needs no
    /// `[time]`. The work counts the Newton iterations of the search.
    ///
    /// ```
    /// use rodfit::{Parameter, Point, Scene, Trajectory};
    /// let problem = Scene::load("data/cantilever.toml")?.problem()?;
    /// let rest = Trajectory::at_rest(&problem, &[50], &[Parameter::YoungsModulus])?;
    /// let (place, slopes) = rest.at(Point::Tip, 0.0)?;
    /// assert!(place[1] < 0.0 && slopes[0][1] > 0.0); // m, m/Pa
    /// # Ok::<(), rodfit::Error>(())
    /// ```
    ///
    /// # Errors
    /// Those of [`Problem::equilibrium`], and of [`new`](Self::new). [`Error::Indifferent`] at the limit of stability,
    /// where a motion that deforms the rod meets no resistance.
    pub fn at_rest(
        problem: &Problem,
        tracked: &[usize],
        parameters: &[Parameter],
    ) -> Result<Self, Error> {
        Self::new(problem, tracked, parameters)?.find_equilibrium()
    }

    /// The [equilibrium](Self::at_rest) of the problem in this empty trajectory, with the reactions of the supports if
    /// they [are kept](Self::keep_reactions).
    ///
    /// ```
    /// use rodfit::{Parameter, Scene, Trajectory};
    /// let problem = Scene::load("data/cantilever.toml")?.problem()?;
    /// let rest = Trajectory::new(&problem, &[], &[Parameter::Density])?.keep_reactions();
    /// let rest = rest.find_equilibrium()?;
    /// assert!(rest.reactions()[0].start.force[1] > 0.0); // N
    /// # Ok::<(), rodfit::Error>(())
    /// ```
    ///
    /// # Errors
    /// Those of [`Self::at_rest`], and [`Error::Invalid`] for a trajectory that is not empty.
    pub fn find_equilibrium(self) -> Result<Self, Error> {
        if !self.times().is_empty() {
            return Err(Error::invalid("trajectory", "a record", "an empty trajectory"));
        }
        let mut trajectory = Self { rests: true, ..self };
        let (record, parameters) = (&mut trajectory.record, &trajectory.parameters[..]);
        match trajectory.problem.discretized() {
            AnyProblem::Planar(planar) => rest(&planar, parameters, record)?,
            AnyProblem::Spatial(spatial) => rest(&spatial, parameters, record)?,
        }
        Ok(trajectory)
    }

    /// The equilibria of `problems`, which are one rod under different loads, with the positions of the nodes `tracked`
    /// and derivatives by `parameters`. Each search after the first begins at the equilibrium before.
    ///
    /// # Errors
    /// Those of [`Self::at_rest`].
    pub(crate) fn load_path(
        problems: &[Problem],
        tracked: &[usize],
        parameters: &[Parameter],
    ) -> Result<Vec<Self>, Error> {
        let (mut planar, mut spatial) = (None, None);
        let mut equilibria = Vec::with_capacity(problems.len());
        for problem in problems {
            let mut own = Self { rests: true, ..Self::new(problem, tracked, parameters)? };
            match problem.discretized() {
                AnyProblem::Planar(own_problem) => {
                    follow_load(&own_problem, &mut planar, parameters, &mut own.record)?;
                }
                AnyProblem::Spatial(own_problem) => {
                    follow_load(&own_problem, &mut spatial, parameters, &mut own.record)?;
                }
            }
            equilibria.push(own);
        }
        Ok(equilibria)
    }

    /// Multiplies all recorded derivatives with respect to `parameter` by a factor; nothing without such derivatives.
    pub(crate) fn scale_derivatives(&mut self, parameter: Parameter, factor: f64) {
        for k in 0..self.parameters.len() {
            if self.parameters[k] == parameter {
                let motions = self.record.derivatives_mut(k).iter_mut().flatten().flatten();
                motions.for_each(|x| *x *= factor);
            }
        }
    }

    /// Simulates `steps` steps of the scene from its start and records them, the start included. `after` is called
    /// with the initial state and after every step of the scene. If a step fails, its error is returned, and the
    /// states before it remain recorded.
    ///
    /// # Errors
    /// [`Error::Invalid`] for a trajectory that has run already, for another problem than the trajectory's, and for
    /// more steps than the scene has. The same for a scene without `[time]`, and for a step above the stability limit
    /// of an explicit scheme. Errors of the initial state. Errors of [a step](crate::dynamics::Simulation::step_to),
    /// and [`Error::EnergyGrowth`], [`Error::Leap`] or [`Error::PassedObstacle`], where halves of the step fail too.
    /// [`Error::SingularTangent`] where derivatives cannot be computed, and [`Error::Interrupted`].
    pub fn run(
        &mut self,
        problem: &Problem,
        steps: usize,
        mut after: impl FnMut(&dyn Snapshot),
    ) -> Result<(), Error> {
        self.run_observed(problem, steps, &mut after)
    }

    /// The run of [`run`](Self::run), not generic, so that callers do not compile the simulation again. If the
    /// parameters include a Kelvin-Voigt time and the rod is not viscous, the run is made with a trace of viscosity.
    /// Without it, derivatives by a time of zero would be lost.
    fn run_observed(
        &mut self,
        problem: &Problem,
        steps: usize,
        after: &mut dyn FnMut(&dyn Snapshot),
    ) -> Result<(), Error> {
        self.check_run(problem, steps)?;
        // A Kelvin-Voigt time of zero has a derivative only beside a trace of viscosity, with which
        // the run is made then.
        let with_viscosity = problem.with_trace_viscosity(&self.parameters)?;
        let problem = with_viscosity.as_ref().unwrap_or(problem);
        let (parameters, record) = (&self.parameters[..], &mut self.record);
        match problem.discretized() {
            AnyProblem::Planar(planar) => {
                let task = RunTask { problem, discretized: &planar, parameters, steps };
                let after_substep = &mut |_: &_| {};
                run(&task, record, &mut RunObservers { after_step: after, after_substep })
            }
            AnyProblem::Spatial(spatial) => {
                let task = RunTask { problem, discretized: &spatial, parameters, steps };
                let after_substep = &mut |_: &_| {};
                run(&task, record, &mut RunObservers { after_step: after, after_substep })
            }
        }
    }

    /// Rejects a run of `problem` over `steps` steps into a record that is not empty, of another scene than the
    /// trajectory's, or with more steps than the scene has. A scene without `[time]` is rejected too.
    ///
    /// # Errors
    /// [`Error::Invalid`].
    pub(super) fn check_run(&self, problem: &Problem, steps: usize) -> Result<(), Error> {
        let times = self.times().len();
        if times > 0 {
            let found = format!("a record of {times} times");
            return Err(Error::invalid(
                "trajectory",
                found,
                "an empty record. Make a new trajectory for each run",
            ));
        }
        if problem.scene() != self.problem.scene() {
            let allowed = "the problem of the trajectory. Make a new trajectory for each problem";
            return Err(Error::invalid("problem", "another scene", allowed));
        }
        let most = problem.time()?.steps();
        if steps > most {
            let allowed = format!("up to {most}, the end of the time of the scene");
            return Err(Error::invalid("steps", steps, allowed));
        }
        Ok(())
    }

    /// The same motion again over another scalar, with the numbers that `seed` makes of the parameters. A run is
    /// repeated with the same accepted steps, bisected ones included; an equilibrium is differentiated. Nodes, axes
    /// and times are those of this trajectory. Second derivatives of the motion come from hyper-dual numbers:
    ///
    /// ```
    /// use num_dual::HyperDual64;
    /// use rodfit::{Parameter, Point, Scene, Trajectory};
    /// let problem = Scene::load("data/cantilever.toml")?.problem()?;
    /// let tip = problem.nodes() - 1;
    /// let mut plain = Trajectory::new(&problem, &[tip], &[])?;
    /// plain.run(&problem, 100, |_| {})?;
    /// let twice = plain.over(|parameter, value| {
    ///     let along = f64::from(parameter == Parameter::YoungsModulus);
    ///     HyperDual64::new(value, along, along, 0.0)
    /// })?;
    /// let [_, y, _] = twice.tip(100); // m; y.eps1 in m/Pa, y.eps1eps2 in m/Pa^2
    /// # assert!((y.re - plain.tip(100)[1]).abs() < 1e-12 && y.eps1eps2 != 0.0);
    /// # Ok::<(), rodfit::Error>(())
    /// ```
    ///
    /// # Errors
    /// Those of [a step](crate::dynamics::Simulation::step_to); [`Error::Indifferent`] at rest.
    pub fn over<D: RodScalar>(
        &self,
        seed: impl Fn(Parameter, f64) -> D,
    ) -> Result<Trajectory<D>, Error> {
        let record = match self.problem.discretized() {
            AnyProblem::Planar(planar) => self.record_over(&planar, seed)?,
            AnyProblem::Spatial(spatial) => self.record_over(&spatial, seed)?,
        };
        Ok(Trajectory {
            problem: self.problem.clone(),
            parameters: Vec::new(),
            rests: self.rests,
            record,
        })
    }

    /// The recorded motion over the scalar `D`, with the numbers of the scene that `seed` returns. A run is repeated
    /// with the same accepted steps; an equilibrium is found again in plain numbers and differentiated, and recorded at
    /// time 0 with zero velocities. Errors are those of [`over`](Self::over).
    fn record_over<D: RodScalar, M: Model>(
        &self,
        discretized: &Discretized<'_, M>,
        seed: impl Fn(Parameter, f64) -> D,
    ) -> Result<Record<D>, Error> {
        // An equilibrium has no steps to repeat: it is differentiated instead.
        if !self.rests {
            return repeat_over(discretized, &self.record, seed);
        }
        let requested = requested_outputs(&self.record);
        let outputs = discretized.outputs_at_equilibrium(
            &discretized.checked_equilibrium()?,
            &requested,
            seed,
        )?;
        let mut record = Record::new(requested.nodes, 0).with_axes(requested.edges);
        record.has_reactions = requested.has_reactions;
        record.push(0.0, motions_at_rest(&outputs));
        Ok(record)
    }

    /// The parameters of the derivatives, in their order; empty for a trajectory in another scalar.
    pub fn parameters(&self) -> &[Parameter] {
        &self.parameters
    }

    /// Energies by term at each of [`times`](Self::times), J; empty unless they were requested by
    /// [`keep_energies`](Self::keep_energies).
    pub fn energies(&self) -> &[Energies] {
        self.record.energies.as_deref().unwrap_or_default()
    }

    /// Derivatives of the [reactions](Self::reactions) by each of [`parameters`](Self::parameters), at each of
    /// [`times`](Self::times), in N and N m per unit of the parameter. The lists are empty unless reactions were
    /// requested.
    ///
    /// ```
    /// use rodfit::{Parameter, Scene, Trajectory};
    /// let problem = Scene::load("data/cantilever.toml")?.problem()?;
    /// let mut run = Trajectory::new(&problem, &[], &[Parameter::Density])?.keep_reactions();
    /// run.run(&problem, 100, |_| {})?;
    /// let by_density = &run.reaction_rates()[0][100];
    /// let by_density = by_density.start.moment[2]; // N m per kg/m^3
    /// # assert!(by_density.is_finite() && by_density != 0.0);
    /// # Ok::<(), rodfit::Error>(())
    /// ```
    pub fn reaction_rates(&self) -> Vec<Vec<Reactions>> {
        let rates =
            |k: usize| self.record.along(Some(k)).reactions().map(|dual| dual.map(|x| x.eps));
        (0..self.parameters.len()).map(|k| rates(k).collect()).collect()
    }

    /// Position of a point at a time, s, in world axes, m, and its derivative by each of
    /// [`parameters`](Self::parameters), in their order. Between steps it is the cubic Hermite interpolant of
    /// positions and velocities of nodes. The derivatives include that of the point's weights of nodes, as the mesh
    /// may depend on a parameter.
    ///
    /// ```
    /// use rodfit::{Point, Scene};
    /// let run = Scene::load("data/cantilever.toml")?.problem()?.simulate()?;
    /// let ([x, y, _], _) = run.at(Point::ArcLength(0.31), 0.0123)?;
    /// assert!((x - 0.31).abs() < 1e-3 && y < 0.0); // m
    /// # Ok::<(), rodfit::Error>(())
    /// ```
    ///
    /// # Errors
    /// [`Error::OutOfRange`] for a time that was not simulated, and for a point that is not on the rod or whose nodes
    /// were not tracked. [`Error::Invalid`] for an empty trajectory.
    pub fn at(&self, point: Point, time: f64) -> Result<([f64; 3], Vec<[f64; 3]>), Error> {
        let stencil = self.problem.stencil(point)?;
        let position = self.record.read().position(&stencil, time)?;
        let rate = |(k, parameter): (usize, &Parameter)| {
            let seed = |p, value| Dual64::new(value, f64::from(u8::from(p == *parameter)));
            // The point stays where it is on the rod, and the nodes do not.
            let mut stencil =
                point.fixed().stencil(&self.problem.scene().over_parameters(seed).made_mesh())?;
            // Dual numbers are compared by their values alone: weights of zero may have a derivative.
            stencil.nodes.retain(|(_, weight)| weight.re != 0.0 || weight.eps != 0.0);
            let position = self.record.along(Some(k)).position(&stencil, Dual64::from(time))?;
            Ok::<_, Error>(position.map(|x| x.eps))
        };
        let rates = self.parameters.iter().enumerate().map(rate).collect::<Result<_, _>>()?;
        Ok((position, rates))
    }
}

impl Trajectory {
    /// A trajectory of a run, not of an equilibrium, with a `record` that was made elsewhere, such as that of a rod of
    /// a structure. `parameters` are those of its derivatives; nothing is checked.
    pub(crate) fn recorded(problem: &Problem, parameters: &[Parameter], record: Record) -> Self {
        let (problem, parameters) = (problem.clone(), parameters.to_vec());
        Self { problem, parameters, rests: false, record }
    }

    /// The record of the trajectory, by value.
    pub(crate) fn into_record(self) -> Record {
        self.record
    }

    /// The record of the trajectory, mutable: a run appends its states to it.
    pub(super) fn record_mut(&mut self) -> &mut Record {
        &mut self.record
    }
}

impl<D: Scalar> Trajectory<D> {
    /// The record of all states: times, motions and derivatives.
    pub(crate) fn record(&self) -> &Record<D> {
        &self.record
    }

    /// Times of the records, s: the start and the end of every step of the scene; 0 alone for an equilibrium.
    pub fn times(&self) -> &[f64] {
        self.record.times()
    }
    /// Counts of the numerical work of the run, or of the search for the equilibrium (Newton iterations only). All are
    /// zero for an equilibrium that [`over`](Trajectory::over) differentiated.
    pub fn work(&self) -> Work {
        self.record.work
    }
    /// Wall time of the stepping, without the setup of the run and the recording of states.
    pub fn stepping(&self) -> Duration {
        self.record.stepping
    }
    /// Number of nodes of the rod, tracked or not.
    pub fn nodes(&self) -> usize {
        self.problem.nodes()
    }

    /// Forces, N, and moments, N m, of the supports on the rod at each of [`times`](Self::times), in world axes.
    /// Empty unless they were requested by [`keep_reactions`](Self::keep_reactions).
    ///
    /// ```
    /// use rodfit::{Scene, Trajectory};
    /// let problem = Scene::load("data/cantilever.toml")?.problem()?;
    /// let mut run = Trajectory::new(&problem, &[], &[])?.keep_reactions();
    /// run.run(&problem, 100, |_| {})?;
    /// let wall = run.reactions()[100].start;
    /// let (lift, turning) = (wall.force[1], wall.moment[2]); // N, N m
    /// # assert!(lift.is_finite() && turning > 0.0);
    /// # Ok::<(), rodfit::Error>(())
    /// ```
    pub fn reactions(&self) -> Vec<Reactions<D>> {
        self.record.read().reactions().collect()
    }

    /// Position of the rod's end after `k` steps in world coordinates, m: its last node, or the wall that holds this
    /// end between two nodes. Panics if `k` was not recorded or its nodes not tracked.
    ///
    /// ```
    /// let run = rodfit::Scene::load("data/cantilever.toml")?.problem()?.simulate()?;
    /// let [x, y, z] = run.tip(0);
    /// assert!((x - 0.5).abs() < 1e-12 && [y, z] == [0.0, 0.0]); // m, at the start
    /// # Ok::<(), rodfit::Error>(())
    /// ```
    pub fn tip(&self, k: usize) -> [D; 3] {
        let nodes = self.problem.tip().nodes.into_iter();
        Stencil { nodes: nodes.map(|(i, weight)| (i, D::from(weight))).collect() }
            .place(|i| self.node(i, k))
    }

    /// Position of a tracked node after `k` steps of the scene in world coordinates, m. Panics if `k` was not
    /// recorded or the node not tracked.
    pub fn node(&self, node: usize, k: usize) -> [D; 3] {
        self.motion(node, k)[0]
    }

    /// Velocity of a tracked node after `k` steps of the scene in world axes, m/s. Panics if `k` was not recorded or
    /// the node not tracked.
    pub fn velocity(&self, node: usize, k: usize) -> [D; 3] {
        self.motion(node, k)[1]
    }

    /// The position, m, and velocity, m/s, of a tracked node in record `k`. Panics if it was not recorded.
    fn motion(&self, node: usize, k: usize) -> &Motion<D> {
        self.record.motion_of(node, k).expect("the node is tracked, and the step recorded")
    }
}

/// Finds the equilibrium of a problem and appends it to `record` at time 0: positions of the tracked nodes with zero
/// velocities, reactions of the supports if requested, and their derivatives by `parameters`. Sets the count of Newton
/// iterations. [`Error::Indifferent`] for a motion without resistance other than a rigid one or a spin; other errors
/// are those of the search.
fn rest<M: Model>(
    discretized: &Discretized<'_, M>,
    parameters: &[Parameter],
    record: &mut Record,
) -> Result<(), Error> {
    record_rest(discretized, &discretized.checked_equilibrium()?, parameters, record)
}

/// Appends an equilibrium to `record` at time 0: positions of the tracked nodes with zero velocities, axes of the
/// recorded edges, reactions if requested, and their derivatives by the `parameters`, in their order. Sets the count of
/// Newton iterations. Errors are those of the derivatives.
fn record_rest<M: Model>(
    discretized: &Discretized<'_, M>,
    settled: &CheckedEquilibrium<FramesOf<M>>,
    parameters: &[Parameter],
    record: &mut Record,
) -> Result<(), Error> {
    let rest = &settled.rest;
    record.work.newton_iterations = rest.newton_iterations;
    let requested = requested_outputs(record);
    let nodes = requested.nodes.iter().map(|i| discretized.model.position(&rest.q, *i)).collect();
    let axes = discretized.axes_at_rest(discretized.setup, &rest.q, &rest.frames, &requested.edges);
    let still = || State::at_rest(rest.q.clone(), rest.frames.clone());
    let reactions = requested.has_reactions.then(|| {
        discretized.reactions_at_rest(discretized.setup_over(|_, value: f64| value), &still())
    });
    record.push(0.0, motions_at_rest(&EquilibriumOutputs { nodes, axes, reactions }));
    // The equilibrium is searched once; each parameter takes linear systems with its tangent only.
    for (k, parameter) in parameters.iter().enumerate() {
        let seed = |p, value| Dual64::new(value, f64::from(u8::from(p == *parameter)));
        let outputs = discretized.outputs_at_equilibrium(settled, &requested, seed)?;
        let rates = motions_at_rest(&outputs).map(|motion| motion.map(|x| x.map(|x| x.eps)));
        record.derivatives_mut(k).extend(rates);
    }
    Ok(())
}

/// Searches the equilibrium, from that `before` if there is one, and appends it to `record` with its derivatives by the
/// `parameters`. It replaces `before`, which is `None` after a search that fails.
fn follow_load<M: Model>(
    discretized: &Discretized<'_, M>,
    before: &mut Option<CheckedEquilibrium<FramesOf<M>>>,
    parameters: &[Parameter],
    record: &mut Record,
) -> Result<(), Error> {
    let found = match before.take() {
        Some(before) => discretized.next_equilibrium(&before)?,
        None => discretized.checked_equilibrium()?,
    };
    record_rest(discretized, before.insert(found), parameters, record)
}

/// The outputs of an equilibrium that a record has: positions of its nodes, axes of its edges, and reactions.
fn requested_outputs<D: Scalar>(record: &Record<D>) -> EquilibriumRequest {
    EquilibriumRequest {
        nodes: record.tracked(),
        edges: record.edges(),
        has_reactions: record.has_reactions,
    }
}

/// The motions of a record at rest: positions and then axes with zero rates, then force and moment of both supports if
/// requested.
fn motions_at_rest<D: Scalar>(
    EquilibriumOutputs { nodes, axes, reactions }: &EquilibriumOutputs<D>,
) -> impl Iterator<Item = Motion<D>> {
    let still = nodes.iter().chain(axes).map(|x| [*x, [D::from(0.0); 3]]);
    still.chain(reactions.iter().flat_map(|reactions| reactions.parts()))
}

/// Positions, m, and velocities, m/s, of the tracked nodes, in ascending order within each record, record after record.
pub type Motions = Vec<[[f64; 3]; 2]>;

impl Trajectory {
    /// The parts of the record: times, s, and positions, m, and velocities, m/s, of the tracked nodes, record after
    /// record. With [kept reactions](Self::keep_reactions), force, N, and moment, N m, at the start and then at the end
    /// follow the nodes in each record. The third part has their derivatives in the same order, one list per parameter.
    pub fn into_parts(self) -> (Vec<f64>, Motions, Vec<Motions>) {
        self.record.into_parts()
    }
}

impl approx::AbsDiffEq for Trajectory {
    type Epsilon = f64;

    /// The default tolerance of positions, 1e-12 m.
    fn default_epsilon() -> f64 {
        1e-12
    }

    /// Whether times and tracked nodes are equal, and every position of a tracked node agrees to a distance of
    /// `epsilon`, m. Velocities, derivatives and kept reactions are not compared.
    fn abs_diff_eq(&self, other: &Self, epsilon: f64) -> bool {
        let [a, b] = [self, other].map(|t| t.record.tracked_motions());
        self.times() == other.times()
            && self.record.tracked() == other.record.tracked()
            && a.zip(b)
                .all(|([a, _], [b, _])| (Vector3::from(*a) - Vector3::from(*b)).norm() <= epsilon)
    }
}

impl PartialEq for Trajectory {
    /// Whether times, and positions and velocities of the same tracked nodes, are exactly equal. Derivatives and kept
    /// reactions are not compared.
    fn eq(&self, other: &Self) -> bool {
        self.times() == other.times()
            && self.record.tracked() == other.record.tracked()
            && self.record.tracked_motions().eq(other.record.tracked_motions())
    }
}
