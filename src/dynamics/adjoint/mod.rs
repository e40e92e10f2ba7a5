//! Adjoint derivatives: the gradient of a misfit by any number of parameters, at the cost of about one more run.
//!
//! Forward sensitivities cost a part of a run for every parameter. The adjoint starts from the derivatives of the
//! misfit by the recorded motion and applies the [transposed map](crate::dynamics::sensitivity) of every step, from the
//! last to the first. Each step takes one solve with the factors of its symmetric matrix. The sweep sums the
//! derivatives `dJ/dn` by the numbers `n` of the simulation: laws (stiffnesses and natural stresses) of all elements,
//! masses, loads, damping and drag. It ends with those by the initial state `y0`. The gradient by a parameter `p` is
//! `dJ/dy0 dy0/dp + dJ/dn dn/dp`, plus the sum over the steps of the parts through moving supports and loads that
//! change with time. `dy0/dp` and `dn/dp` come from one initial state in dual numbers per parameter.
//!
//! Input: [`AdjointRun::run`] simulates a number of steps of a problem and records the tracked nodes
//! ([`AdjointRun::trajectory`]); `run_within` limits the bytes of the stored states. `AdjointRun::slopes` returns zero
//! derivatives, to which `TrajectorySlopes::add` adds those by the position of a point at a time, and `add_motion`
//! those by the motion of a node. `AdjointRun::gradient` is the reverse sweep. [`TrajectorySlopes`] has the derivatives
//! of the misfit by positions (m) and velocities (m/s) of these nodes at all records. Output: one derivative per
//! parameter, in their order, in the unit of the misfit over that of the parameter. [`AdjointRun::along`] returns the
//! derivatives of the motion of the tracked nodes along a direction of parameters, by one forward sensitivity.
//! `AdjointRun::problem` is the problem as it was given.
//!
//! The reverse sweep needs the states of the run. Where they exceed the memory (56 MiB by default), simulations at
//! checkpoints are stored (`checkpoints`), and the steps between are repeated. `start` makes the gradient at the
//! initial state; `lists` serves all entries of a list of natural strains by one product, if the start permits it.
//! Errors are schemes other than Newmark-beta and generalised-alpha, internal friction, user-defined energies,
//! contacts, loads without a potential, tendons, and actuators with signals ([`Problem::check_reversible`]). If a
//! parameter is a Kelvin-Voigt time and the rod is not viscous, `gradient` and `along` first repeat the run with a
//! trace of viscosity.

mod checkpoints;
mod lists;
mod start;

use crate::dynamics::adjoint::checkpoints::Checkpoints;
use crate::dynamics::adjoint::lists::{RequestedParameters, UnlistedParameter};
use crate::dynamics::record::{Motion, Record};
use crate::dynamics::run::{RunObservers, RunTask, run};
use crate::dynamics::sensitivity::{Nodes, Sensitivities};
use crate::dynamics::step_map::{
    MovingSupports, ParameterSlopes, StateRates, StepMap, StepWorkspace, TimedLoadRates,
    TimedLoadSlopes,
};
use crate::dynamics::trajectory::{Motions, Trajectory};
use crate::error::Error;
use crate::problem::{AnyProblem, Discretized, Model, Problem};
use crate::rod::{PlanarRod, SpatialRod, Transposed, zero_frame_rates};
use crate::scene::{Parameter, Point, Scheme};
use num_dual::Dual64;
use std::collections::HashMap;

/// Default memory for the stored states of a run, bytes. More memory avoids that steps are repeated in the reverse
/// sweep.
const DEFAULT_MEMORY: usize = 56 << 20;

/// A run with stored states, for adjoint derivatives.
///
/// ```
/// use rodfit::{Parameter, Point, AdjointRun, Scene};
/// let problem = Scene::load("data/cantilever.toml")?.problem()?;
/// let tip = problem.nodes() - 1;
/// let run = AdjointRun::run(&problem, &[tip], 100)?;
/// // A misfit: half the sum of the squared distances of the tip from its observed position.
/// let (mut misfit, mut slopes) = (0.0, run.slopes());
/// for k in 0..=100 {
///     let [x, y, z] = run.trajectory().node(tip, k); // m
///     let off = [x - 0.1, y, z];
///     misfit += 0.5 * off.iter().map(|c| c * c).sum::<f64>(); // m^2
///     slopes.add(Point::Node(tip), run.trajectory().times()[k], off)?; // its derivative by the place, m
/// }
/// // One number for each parameter, m^2 over the parameter's unit, at the cost of about one more run.
/// let gradient = run.gradient(&[Parameter::YoungsModulus, Parameter::Density], &slopes)?;
/// # assert!(misfit > 0.0 && gradient.len() == 2 && gradient.iter().all(|g| *g != 0.0));
/// # Ok::<(), rodfit::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct AdjointRun {
    problem: Problem,
    trajectory: Trajectory,
    checkpoints: AnyCheckpoints,
    /// Number of steps.
    steps: usize,
    /// Memory for the states, bytes.
    bytes: usize,
}

/// Checkpoints of a planar or spatial rod.
#[derive(Clone, Debug)]
enum AnyCheckpoints {
    Planar(Box<Checkpoints<PlanarRod<f64>>>),
    Spatial(Box<Checkpoints<SpatialRod<f64>>>),
}

impl Problem {
    /// Rejects a scene without adjoint derivatives: schemes other than Newmark-beta and generalised-alpha, internal
    /// friction, user-defined energies, contacts, loads without a potential, tendons, and actuators with a signal.
    /// Forward derivatives ([`simulate_with`](Self::simulate_with)) have no such limits.
    ///
    /// # Errors
    /// [`Error::Invalid`] with the reason.
    pub fn check_reversible(&self) -> Result<(), Error> {
        let scene = self.scene();
        let refused = |key: &str, found: &str, allowed: &str| {
            let allowed = format!("{allowed} for derivatives by the adjoint method");
            Err(Error::invalid(key, found, allowed).in_file(scene.path.as_deref()))
        };
        if !matches!(scene.scheme(), Scheme::NewmarkBeta | Scheme::GeneralisedAlpha) {
            let found = scene.scheme().name();
            return refused("time.scheme", found, "newmark-beta or generalised-alpha");
        }
        if scene.loads.damping.friction.is_some() {
            return refused("loads.damping.friction", "internal friction", "none");
        }
        if !scene.energies.is_empty() {
            return refused("energies", "user-defined energies", "none");
        }
        if !scene.contacts.is_empty() {
            return refused("contacts", "contacts", "none");
        }
        if let Some(load) = scene.loads.first_follower(self.spatial().is_some()) {
            return refused(&load.key(), "a load without a potential", "no such load");
        }
        for (i, actuator) in scene.actuation.iter().enumerate() {
            if actuator.is_tendon() {
                return refused(&format!("actuation[{i}].kind"), "a tendon", "curvature");
            }
            if actuator.signal().is_some() {
                let allowed = "no such key";
                return refused(&format!("actuation[{i}].signal"), "a signal", allowed);
            }
        }
        Ok(())
    }
}

impl AdjointRun {
    /// Simulates `steps` steps of a scene, records the nodes `tracked`, and stores its states, or simulations at
    /// checkpoints, in about 56 MiB (`DEFAULT_MEMORY`).
    ///
    /// # Errors
    /// Those of [`Problem::check_reversible`], [`Trajectory::new`] and [`Trajectory::run`].
    pub fn run(problem: &Problem, tracked: &[usize], steps: usize) -> Result<Self, Error> {
        Self::run_within(problem, tracked, steps, DEFAULT_MEMORY)
    }

    /// [`run`](Self::run) with about so many `bytes` for the stored states. If they take more, the gradient repeats
    /// the steps once, and with very few bytes twice or more.
    ///
    /// # Errors
    /// Those of [`run`](Self::run).
    pub fn run_within(
        problem: &Problem,
        tracked: &[usize],
        steps: usize,
        bytes: usize,
    ) -> Result<Self, Error> {
        problem.check_reversible()?;
        let mut trajectory = Trajectory::new(problem, tracked, &[])?;
        let checkpoints = match problem.discretized() {
            AnyProblem::Planar(planar) => AnyCheckpoints::Planar(Box::new(checkpoints(
                problem,
                &planar,
                steps,
                bytes,
                &mut trajectory,
            )?)),
            AnyProblem::Spatial(spatial) => AnyCheckpoints::Spatial(Box::new(checkpoints(
                problem,
                &spatial,
                steps,
                bytes,
                &mut trajectory,
            )?)),
        };
        Ok(Self { problem: problem.clone(), trajectory, checkpoints, steps, bytes })
    }

    /// The run repeated from its start, in the same memory, with a Kelvin-Voigt time that has no effect on the motion.
    /// It makes the rod store strain rates, which derivatives by a Kelvin-Voigt time of zero need. `None` if no
    /// parameter is such a time, or the rod is viscous already. Errors are those of a run.
    fn with_trace_viscosity(&self, parameters: &[Parameter]) -> Result<Option<Self>, Error> {
        // Damping times of zero: derivatives are those of a run with a trace of viscosity.
        let Some(problem) = self.problem.with_trace_viscosity(parameters)? else { return Ok(None) };
        let tracked = self.trajectory.record().tracked();
        Self::run_within(&problem, &tracked, self.steps, self.bytes).map(Some)
    }

    /// The problem of the run, as it was given (without a trace of viscosity).
    pub(crate) fn problem(&self) -> &Problem {
        &self.problem
    }

    /// The recorded motion of the tracked nodes at all steps, the start included.
    pub fn trajectory(&self) -> &Trajectory {
        &self.trajectory
    }

    /// Zero derivatives of a misfit by positions and velocities of all tracked nodes at all recorded times, to which
    /// those of a misfit are added ([`TrajectorySlopes::add`], [`TrajectorySlopes::add_motion`]).
    pub fn slopes(&self) -> TrajectorySlopes<'_> {
        let motions = vec![[[0.0; 3]; 2]; self.trajectory.record().motions().len()];
        TrajectorySlopes { trajectory: &self.trajectory, problem: &self.problem, motions }
    }

    /// The derivatives of a misfit by each of the `parameters`, in their order, in the unit of the misfit over that of
    /// the parameter. `slopes` are the derivatives of the misfit by the recorded motion of this run. If a parameter is
    /// a Kelvin-Voigt time and the rod has no viscosity, the run is repeated with a trace of it before the reverse
    /// sweep.
    ///
    /// # Errors
    /// [`Error::Invalid`] for a parameter that the scene does not have, and for slopes of a run with other times or
    /// tracked nodes; [`Error::SingularTangent`] where a step has no derivatives; those of a step where stretches are
    /// run again, and of [`Discretized::simulation_over`](crate::Discretized::simulation_over).
    pub fn gradient(
        &self,
        parameters: &[Parameter],
        slopes: &TrajectorySlopes<'_>,
    ) -> Result<Vec<f64>, Error> {
        let requested = RequestedParameters::new(&self.problem, parameters)?;
        // Slopes belong to the records of a run; those of an equal run, as its repetition below, fit too.
        let [own, other] = [&self.trajectory, slopes.trajectory].map(Trajectory::record);
        if own.times() != other.times() || own.tracked() != other.tracked() {
            let found = "those of a run with other times or tracked nodes";
            return Err(Error::invalid("slopes", found, "slopes of this run"));
        }
        // A Kelvin-Voigt time of zero has a derivative only in a run with a trace of viscosity.
        if let Some(with_viscosity) = self.with_trace_viscosity(parameters)? {
            return with_viscosity.gradient(parameters, slopes);
        }
        let (slopes, record) = (&slopes.motions[..], self.trajectory.record());
        match (&self.checkpoints, self.problem.discretized()) {
            (AnyCheckpoints::Planar(checkpoints), AnyProblem::Planar(planar)) => {
                gradient(&planar, checkpoints, slopes, record, requested)
            }
            (AnyCheckpoints::Spatial(checkpoints), AnyProblem::Spatial(spatial)) => {
                gradient(&spatial, checkpoints, slopes, record, requested)
            }
            _ => unreachable!("a checkpoints is of its problem's model"),
        }
    }
}

impl AdjointRun {
    /// The derivatives of positions, m, and velocities, m/s, of the tracked nodes along a `direction` in the space of
    /// parameters, in world axes, record after record. The direction has every parameter's component in its unit;
    /// components of one parameter add up. Method: one forward sensitivity over the stored states, which costs a part
    /// of a run for any number of parameters. The sum of its products with slopes is the product of
    /// [`gradient`](Self::gradient) with the direction.
    ///
    /// # Errors
    /// Those of [`gradient`](Self::gradient).
    pub fn along(&self, direction: &[(Parameter, f64)]) -> Result<Motions, Error> {
        let parameters: Vec<Parameter> =
            direction.iter().map(|(parameter, _)| *parameter).collect();
        RequestedParameters::new(&self.problem, &parameters)?;
        if let Some(with_viscosity) = self.with_trace_viscosity(&parameters)? {
            return with_viscosity.along(direction);
        }
        let record = self.trajectory.record();
        match (&self.checkpoints, self.problem.discretized()) {
            (AnyCheckpoints::Planar(checkpoints), AnyProblem::Planar(planar)) => {
                along(&planar, checkpoints, direction, record)
            }
            (AnyCheckpoints::Spatial(checkpoints), AnyProblem::Spatial(spatial)) => {
                along(&spatial, checkpoints, direction, record)
            }
            _ => unreachable!("a checkpoints is of its problem's model"),
        }
    }
}

/// The derivatives of the recorded motion along a `direction`: `[dq, dv]` of every tracked node in world axes, record
/// after record. Method: one forward sensitivity over the stored states; one dual number has all components of the
/// direction. Parameters that are not in it have the component zero. Errors are those of the start in dual numbers, of
/// repeated steps and of steps without derivatives.
fn along<M: Model>(
    discretized: &Discretized<'_, M>,
    checkpoints: &Checkpoints<M::Rod<f64>>,
    direction: &[(Parameter, f64)],
    record: &Record,
) -> Result<Motions, Error>
where
    M::Rod<f64>: Transposed,
{
    // All components of the direction in one dual number: one forward derivative, however many
    // parameters.
    let mut components: HashMap<Parameter, f64> = HashMap::new();
    for (parameter, component) in direction {
        *components.entry(*parameter).or_default() += component;
    }
    let seed = |p, value| Dual64::new(value, components.get(&p).copied().unwrap_or(0.0));
    let dual = discretized.simulation_over::<Dual64>(seed)?;
    let mut sensitivities = Sensitivities::<M::Rod<f64>>::new(vec![dual]);
    let (tracked, times) = (record.tracked(), record.times());
    let mut motions = Vec::with_capacity(record.motions().len());
    let mut row = 0;
    // Forward over the stored states, with the derivative of every step.
    checkpoints.forward(&mut |state, step| {
        step.map_or(Ok(()), |step| sensitivities.advance_over(step))?;
        if times.get(row) == Some(&state.time) {
            row += 1;
            let nodes = Nodes { nodes: &tracked, stride: M::STRIDE, axes: M::STRIDE.min(3) };
            sensitivities.of_nodes(0, nodes, |own| {
                motions.push(own.map(|own| discretized.model.rate(&own, 0)));
            });
        }
        Ok(())
    })?;
    Ok(motions)
}

/// The derivatives of a misfit by the positions and velocities of the tracked nodes at every record.
#[derive(Clone, Debug)]
pub struct TrajectorySlopes<'a> {
    problem: &'a Problem,
    trajectory: &'a Trajectory,
    /// In the order of the records.
    pub(crate) motions: Vec<Motion>,
}

impl TrajectorySlopes<'_> {
    /// Adds `slope`, the derivative of the misfit by the position of a point at a time, in world axes, unit of the
    /// misfit over m. It is distributed to positions and velocities of nodes at both ends of the step with the
    /// weights of the interpolation, as in [`Trajectory::at`].
    ///
    /// # Errors
    /// Those of [`Trajectory::at`].
    pub fn add(&mut self, point: Point, time: f64, slope: [f64; 3]) -> Result<(), Error> {
        let stencil = self.problem.stencil(point)?;
        let record = self.trajectory.record();
        for (index, [place, velocity]) in record.read().weights(&stencil, time)? {
            for c in 0..3 {
                self.motions[index][0][c] += place * slope[c];
                self.motions[index][1][c] += velocity * slope[c];
            }
        }
        Ok(())
    }

    /// Adds `slopes` to the derivatives of the misfit by the motion of a tracked node after `k` steps, in world axes.
    /// They are those by its [position](Trajectory::node), unit of the misfit over m, and
    /// [velocity](Trajectory::velocity), over m/s.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] for a node that was not tracked, and for a step that was not recorded.
    pub fn add_motion(
        &mut self,
        node: usize,
        k: usize,
        slopes: [[f64; 3]; 2],
    ) -> Result<(), Error> {
        let index = self.trajectory.record().index_of(node, k)?;
        for (to, from) in self.motions[index].iter_mut().flatten().zip(slopes.as_flattened()) {
            *to += from;
        }
        Ok(())
    }
}

/// Simulates `steps` steps of a problem, records them in `trajectory`, and returns its stored states or checkpoints,
/// within about `bytes` bytes. No derivatives are computed. Errors: a trajectory that has records or is of another
/// scene, more steps than the scene has, and those of the run.
fn checkpoints<M: Model>(
    problem: &Problem,
    discretized: &Discretized<'_, M>,
    steps: usize,
    bytes: usize,
    trajectory: &mut Trajectory,
) -> Result<Checkpoints<M::Rod<f64>>, Error>
where
    M::Rod<f64>: Transposed,
{
    trajectory.check_run(problem, steps)?;
    let mut checkpoints = None;
    let record = trajectory.record_mut();
    let task = RunTask { problem, discretized, parameters: &[], steps };
    let mut observers = RunObservers {
        after_step: &mut |_| {},
        after_substep: &mut |simulation| match &mut checkpoints {
            None => checkpoints = Some(Checkpoints::new(simulation, steps, bytes)),
            Some(checkpoints) => checkpoints.push(simulation),
        },
    };
    run(&task, record, &mut observers)?;
    Ok(checkpoints.expect("a run shows its start"))
}

/// The derivatives of a misfit by the `requested` parameters, in their order, from those by the recorded motion,
/// `slopes` (tracked nodes within records). A reverse sweep goes over all accepted steps from zero derivatives at the
/// end. At each recorded time its slopes are added to the derivatives by the state; then the transposed step is
/// applied. At the start the sums become the gradient. Errors are those of the linearizations, of repeated steps and of
/// the start in dual numbers.
fn gradient<M: Model>(
    discretized: &Discretized<'_, M>,
    checkpoints: &Checkpoints<M::Rod<f64>>,
    slopes: &[Motion],
    record: &Record,
    requested: RequestedParameters,
) -> Result<Vec<f64>, Error>
where
    M::Rod<f64>: Transposed,
{
    let start = checkpoints.start();
    // Strains with times of their own need more terms in the transposed step.
    let own = [Parameter::DampingBending, Parameter::DampingTwisting, Parameter::DampingStretching];
    let apart = start.damping().additional_times().iter().any(|time| *time != 0.0)
        || requested.all.iter().any(|parameter| own.contains(parameter));
    let moments = requested.all.iter().any(|parameter| parameter.is_moment());
    let mut supports = moving_supports(discretized, checkpoints, &requested);
    let mut timed_loads = timed_load_slopes(discretized, &requested);
    let frames = frame_count(discretized.model, start.rod());
    // Derivatives of the misfit by the state, at the end of the run: zero.
    let mut by_state = StateRates::zeros(start, frames);
    let mut by_parameters = ParameterSlopes::zeros(start, moments);
    let mut room = StepWorkspace::new(by_state.q.len(), Vec::new());
    let (tracked, times) = (record.tracked(), record.times());
    let mut row = times.len();
    // Reverse sweep: the slopes of a record are added where its time is reached, then the
    // transposed step.
    checkpoints.reverse(&mut |state, step| {
        if row > 0 && times[row - 1] == state.time {
            row -= 1;
            for (node, slope) in tracked.iter().zip(&slopes[row * tracked.len()..]) {
                let [q, v] = [&mut by_state.q, &mut by_state.v].map(|list| list.as_flattened_mut());
                add_slope(discretized.model, *node, slope, [q, v]);
            }
        }
        let Some(step) = step else { return Ok(()) };
        let map = StepMap::transposed(step, frames, apart);
        let (state, numbers) = (&mut by_state, &mut by_parameters);
        map.apply_transposed(state, numbers, &mut supports, &mut timed_loads, &mut room)
    })?;
    // At the start: derivatives by the initial state and the numbers of the simulation become the
    // gradient.
    let by_start =
        start::ByStart { start, state: by_state, parameters: by_parameters, supports, timed_loads };
    start::gradient(discretized, by_start, requested)
}

/// Adds the derivatives `slope` of a misfit by position and velocity of a node, in world axes, to `to`: its derivatives
/// by all unknowns and by all velocities. They are converted to the axes of the model.
fn add_slope<M: Model>(model: &M, node: usize, slope: &Motion, to: [&mut [f64]; 2]) {
    for (slope, to) in slope.iter().zip(to) {
        let own = model.components(*slope);
        let axes = M::STRIDE.min(3);
        to[M::STRIDE * node..][..axes].iter_mut().zip(own).for_each(|(to, own)| *to += own);
    }
}

/// The number of reference frames of a `rod`: one per edge in space, none in the plane. The model selects the kind
/// only.
fn frame_count<M: Model>(_: &M, rod: &M::Rod<f64>) -> usize
where
    M::Rod<f64>: Transposed,
{
    if M::STRIDE > 3 { rod.zero_law_derivatives(false).stretch.len() } else { 0 }
}

/// The loads that change with time, with their derivatives along each requested parameter that is no entry of a list of
/// natural strains; such entries never change loads. Empty without loads that change with time.
fn timed_load_slopes<M: Model>(
    discretized: &Discretized<'_, M>,
    requested: &RequestedParameters,
) -> TimedLoadSlopes {
    let mut slopes = TimedLoadSlopes::default();
    if discretized.setup.timed_loads(discretized.model).is_empty() {
        return slopes;
    }
    for UnlistedParameter { index, parameter } in &requested.single {
        let seed = |p, value| Dual64::new(value, f64::from(u8::from(p == *parameter)));
        let setup = discretized.setup_over(seed);
        let scheme = setup.scene.time.as_ref().map_or(0.0, |time| time.parameter().eps);
        slopes.add(*index, TimedLoadRates::new(&setup.timed_loads(discretized.model), scheme));
    }
    slopes
}

/// The moving supports of the run, with their motion in dual numbers for each requested parameter that changes this
/// motion. Entries of lists of natural strains never do. No parameter is added if the motion depends on no number of
/// the scene, as without moving supports or with a recorded motion.
fn moving_supports<M: Model>(
    discretized: &Discretized<'_, M>,
    checkpoints: &Checkpoints<M::Rod<f64>>,
    requested: &RequestedParameters,
) -> MovingSupports<M::Rod<f64>>
where
    M::Rod<f64>: Transposed,
{
    let start = checkpoints.start();
    let frames = zero_frame_rates(frame_count(discretized.model, start.rod()));
    let mut supports = MovingSupports::new(start.boundary_motion(), frames);
    // Only parameters that move a support need its motion over dual numbers.
    if supports.depends_on_parameters() {
        for UnlistedParameter { index, parameter } in &requested.single {
            let seed = |p, value| Dual64::new(value, f64::from(u8::from(p == *parameter)));
            let setup = discretized.setup_over(seed);
            let motion = discretized.boundary_motion(&setup);
            if let Some(motion) = motion.filter(|motion| motion.changes()) {
                supports.add(*index, motion, M::frames_over::<Dual64>(&start.state().frames));
            }
        }
    }
    supports
}
