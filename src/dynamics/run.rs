//! The run of a scene: initial state, time steps with bisection of rejected ones, and the record of states.
//!
//! Input: a discretized scene, parameters of the derivatives, number of steps. At the start and after every step of the
//! scene the motions (m, m/s) of tracked nodes, axes of selected edges and their derivatives are appended to a
//! [`Record`]. Energies, reactions and stability checks are added if requested. Observers are called with the states
//! ([`Snapshot`]) after steps of the scene and after accepted parts of them. The derivatives are computed on the same
//! thread, or on a second one for large runs ([`ActiveRun::has_room`]) whose steps can be linearized from their states;
//! results are bitwise equal. A scene without `[time]`, and an explicit scheme's step above its stability limit, are
//! errors before the run. A run ends early with the error of a step that bisection does not save, of a derivative, or
//! of an interruption; the record keeps the states before. [`repeat_over`] repeats a run with its accepted steps over
//! another scalar.

use crate::dynamics::bisection::{BisectedSteps, advance};
use crate::dynamics::director_axes::DirectorAxes;
use crate::dynamics::record::{Motion, Record};
use crate::dynamics::recorded_reactions::RecordedReactions;
use crate::dynamics::sensitivity::{Nodes, Sensitivities};
use crate::dynamics::sensitivity_carrier::SensitivityCarrier;
use crate::dynamics::sensitivity_pipeline::{self, ActiveRun};
use crate::dynamics::simulation::Simulation;
use crate::dynamics::step::Work;
use crate::dynamics::step_control::StepControl;
use crate::dynamics::unstable_state::StabilityChecks;
use crate::error::Error;
use crate::numerics::scalar::RodScalar;
use crate::numerics::stopwatch::Stopwatch;
use crate::numerics::vector::sub;
use crate::problem::{Discretized, FramesOf, Model, Problem};
use crate::rod::{Energies, ForwardSensitivity, Rod, State};
use crate::scene::{Parameter, Stencil};
use crate::statics::Reactions;

/// The state of a running simulation in world coordinates, whatever its model.
pub trait Snapshot {
    /// Time of the state, s.
    fn time(&self) -> f64;
    /// Position of node `i` in world coordinates, m.
    fn position(&self, i: usize) -> [f64; 3];
    /// Energies by term, J.
    fn energies(&self) -> Energies;
    /// Counts of the numerical work so far.
    fn work(&self) -> Work;
    /// Forces and moments of the supports on the rod, in world axes, computed at every call; `None` unless the run
    /// [keeps reactions](crate::Trajectory::keep_reactions).
    fn reactions(&self) -> Option<Reactions>;
    /// Forces of all obstacles on the rod, N, in world axes, in the order of the contacts, computed at every call;
    /// empty unless the run [keeps reactions](crate::Trajectory::keep_reactions).
    fn contact_forces(&self) -> Vec<[f64; 3]>;
    /// Position of a point on the rod in world coordinates, m: the weighted sum of node positions of its `stencil`.
    fn place(&self, stencil: &Stencil) -> [f64; 3] {
        stencil.place(|i| self.position(i))
    }
}

/// The snapshot of a simulation with its model, which converts to world coordinates.
struct SimulationSnapshot<'a, M: Model> {
    discretized: &'a Discretized<'a, M>,
    simulation: &'a Simulation<f64, M::Rod<f64>>,
    reactions: Option<&'a RecordedReactions<M>>,
}

impl<M: Model> Snapshot for SimulationSnapshot<'_, M> {
    /// Time of the state, s.
    fn time(&self) -> f64 {
        self.simulation.state().time
    }
    /// Position of node `i` in world coordinates, m, converted by the model.
    fn position(&self, i: usize) -> [f64; 3] {
        self.discretized.model.position(&self.simulation.state().q, i)
    }
    /// Energies of the present state by term, J, computed at every call.
    fn energies(&self) -> Energies {
        self.simulation.energies()
    }
    /// Counts of the numerical work of the simulation so far; that of linearizing steps again is not included.
    fn work(&self) -> Work {
        self.simulation.work()
    }
    /// Forces, N, and moments, N m, of the supports on the rod in the present state, in world axes; `None` unless
    /// requested.
    fn reactions(&self) -> Option<Reactions> {
        Some(self.reactions?.of(self.discretized, self.simulation.state()))
    }
    /// The force of each contact on the rod in the present state, N, summed over all nodes, in world axes; none unless
    /// reactions were requested.
    fn contact_forces(&self) -> Vec<[f64; 3]> {
        if self.reactions.is_none() {
            return Vec::new();
        }
        let (state, model) = (self.simulation.state(), self.discretized.model);
        let force = |gradient: Vec<f64>| {
            let on_nodes = (0..self.discretized.nodes()).map(|i| model.rate(&gradient, i));
            on_nodes.fold([0.0; 3], sub)
        };
        let gradients =
            self.simulation.rod().contact_gradients([&state.q, &state.v], &state.frames);
        gradients.into_iter().map(force).collect()
    }
}

/// A run to be made: the discretized scene, the parameters of the derivatives and the number of steps of the scene.
pub(super) struct RunTask<'a, M: Model> {
    pub problem: &'a Problem,
    pub discretized: &'a Discretized<'a, M>,
    pub parameters: &'a [Parameter],
    pub steps: usize,
}

/// A function that is called with the simulation after every accepted step.
type SubstepObserver<'a, M> = dyn FnMut(&Simulation<f64, <M as Model>::Rod<f64>>) + 'a;

/// Functions that a run calls with its states.
pub(super) struct RunObservers<'a, M: Model> {
    /// Called with the initial state and after every step of the scene.
    pub after_step: &'a mut dyn FnMut(&dyn Snapshot),
    /// Called with the initial state and after every accepted step, each part of a bisected one included.
    pub after_substep: &'a mut SubstepObserver<'a, M>,
}

/// Simulates a run into `record` and calls the `observers`. Its derivatives are computed on a second thread under three
/// conditions: [`ActiveRun::has_room`], at least one parameter, and steps that can be linearized from their states
/// ([`Simulation::can_linearize_again`]). Else they are computed on this thread. The run counts as active meanwhile.
///
/// # Errors
/// No `[time]`; those of the scene's step and initial state, of a step that bisection does not save, and of a
/// derivative. Also [`Error::Interrupted`]. The record then ends with the last valid step of the scene.
pub(super) fn run<M: Model>(
    task: &RunTask<'_, M>,
    record: &mut Record,
    observers: &mut RunObservers<'_, M>,
) -> Result<(), Error>
where
    M::Rod<f64>: ForwardSensitivity,
{
    let active = ActiveRun::begin();
    let asynchronous = active.has_room(task.steps * task.problem.nodes());
    run_with(task, asynchronous, record, observers)
}

/// [`run`] with a given choice. Derivatives are computed on a second thread if `asynchronous`, there are parameters,
/// and steps can be linearized again from two states ([`Simulation::can_linearize_again`]). Else they are computed
/// after every accepted step on this thread. Work of the linearizations is added to `record.work`. A step above the
/// stability limit of an explicit scheme is an error before the run.
fn run_with<M: Model>(
    task: &RunTask<'_, M>,
    asynchronous: bool,
    record: &mut Record,
    observers: &mut RunObservers<'_, M>,
) -> Result<(), Error>
where
    M::Rod<f64>: ForwardSensitivity,
{
    // Explicit schemes reject a step above their limit of stability before the run.
    task.discretized.check_step()?;
    let mut simulation = task.discretized.simulation()?;
    let sensitivities = task.discretized.sensitivities(task.parameters)?;
    let outputs = DerivedOutputs::new(task, record);
    // Most schemes are linearized again at the ends of their steps. Averaging schemes keep the
    // tangents of their stages.
    let has_parameters = !task.parameters.is_empty();
    let relinearizes = has_parameters && simulation.can_linearize_again();
    if relinearizes && asynchronous {
        return run_asynchronously(task, simulation, sensitivities, &outputs, record, observers);
    }
    if has_parameters && !relinearizes {
        simulation.keep_tangent();
    }
    // A copy of the simulation has the factors of the linearized steps; the simulation keeps its
    // own.
    let relinearized = relinearizes.then(|| Box::new(simulation.linear()));
    let mut carrier = SensitivityCarrier::Synchronous { sensitivities, relinearized };
    let result = take_steps(task, &mut simulation, &mut carrier, &outputs, record, observers);
    if let SensitivityCarrier::Synchronous { relinearized: Some(linear), .. } = carrier {
        record.work += linear.work();
    }
    result
}

/// Makes the run of `task` on this thread, and its derivatives on a second one, which linearizes accepted steps while
/// the next ones are made. Appends states and derivatives to `record`, and adds the time of waiting for the second
/// thread to `record.stepping`. If a derivative fails, the states after the last one with derivatives are removed from
/// `record`, and its error is returned.
fn run_asynchronously<M: Model>(
    task: &RunTask<'_, M>,
    mut simulation: Simulation<f64, M::Rod<f64>>,
    sensitivities: Sensitivities<M::Rod<f64>>,
    outputs: &DerivedOutputs<M>,
    record: &mut Record,
    observers: &mut RunObservers<'_, M>,
) -> Result<(), Error>
where
    M::Rod<f64>: ForwardSensitivity,
{
    let tracked = record.tracked();
    let recorder = DerivativeRecorder { discretized: task.discretized, tracked: &tracked, outputs };
    // Derivatives of the initial state.
    if record.keeps {
        for k in 0..sensitivities.count() {
            recorder.push(&sensitivities, k, simulation.state(), record.derivatives_mut(k));
        }
    }
    // Steps on this thread, their derivatives on the other.
    let (producer, consumer) = sensitivity_pipeline::new(&simulation, sensitivities);
    let (result, consumed) = std::thread::scope(|scope| {
        let consume = || {
            consumer.consume(|sensitivities, k, state, list| {
                recorder.push(sensitivities, k, state, list);
            })
        };
        let consuming = scope.spawn(consume);
        let mut carrier = SensitivityCarrier::Asynchronous(producer);
        let result = take_steps(task, &mut simulation, &mut carrier, outputs, record, observers);
        let since = Stopwatch::start();
        if let SensitivityCarrier::Asynchronous(producer) = carrier {
            producer.finish();
        }
        let consumed = consuming.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic));
        record.stepping += since.elapsed();
        (result, consumed)
    });
    // Derivatives of all recorded states; a failed derivative ends the record at its step.
    for (k, rates) in consumed.derivatives.into_iter().enumerate() {
        record.derivatives_mut(k).extend(rates);
    }
    let result = match consumed.failure {
        Some(failure) => {
            record.truncate(consumed.recorded + 1);
            record.work = failure.work;
            Err(failure.error)
        }
        None => result,
    };
    record.work += consumed.work;
    result
}

/// The main loop of a run. Records the initial state, then makes `task.steps` steps of the scene with bisection. After
/// each it records the state, examines stability at selected steps if requested, and calls the observer of steps; that
/// of substeps is called after every accepted step. Derivatives are computed or sent by the `carrier`. Ends with the
/// first error, or at an interruption, which is checked before every step. `record.work` and `record.stepping` are
/// updated after every step, also a failed one.
fn take_steps<M: Model>(
    task: &RunTask<'_, M>,
    simulation: &mut Simulation<f64, M::Rod<f64>>,
    carrier: &mut SensitivityCarrier<M::Rod<f64>>,
    outputs: &DerivedOutputs<M>,
    record: &mut Record,
    observers: &mut RunObservers<'_, M>,
) -> Result<(), Error>
where
    M::Rod<f64>: ForwardSensitivity,
{
    let (time, discretized) = (task.problem.time()?, task.discretized);
    let reactions = outputs.reactions.as_ref();
    let mut control = StepControl::new(task.problem.scene(), simulation);
    if let SensitivityCarrier::Synchronous { .. } = carrier {
        // The derivatives of another thread grow in lists of their own.
        record.make_room(task.steps + 1);
    }
    // Initial state.
    record_state(task.discretized, simulation, carrier, outputs, record);
    (observers.after_step)(&SimulationSnapshot { discretized, simulation, reactions });
    (observers.after_substep)(simulation);
    for k in 1..=task.steps {
        // Interruption by the user or by a limit of time.
        task.problem.check_stop()?;

        // Step to the next time of the scene, bisected where it is rejected, with its derivatives.
        let start = Stopwatch::start();
        let result = {
            let mut accepted = |simulation: &Simulation<_, _>| {
                record.taken.push(simulation.state().time);
                (observers.after_substep)(simulation);
            };
            let (control, accepted) = (&mut control, &mut accepted);
            advance(&mut RunSteps { simulation, carrier, control, accepted }, time.at(k))
        };
        record.stepping += start.elapsed();
        record.work = simulation.work();
        result?;

        // Record of the state and its derivatives.
        record_state(task.discretized, simulation, carrier, outputs, record);

        // Stability of some states.
        if let Some(stability) = &mut record.stability
            && StabilityChecks::includes(k, task.steps)
        {
            stability.examine(task.discretized, simulation);
            record.work.stability_checks = stability.count;
        }

        // Report to the caller.
        (observers.after_step)(&SimulationSnapshot { discretized, simulation, reactions });
    }
    Ok(())
}

/// The steps of a run with their derivatives, as bisection needs them.
struct RunSteps<'a, R: ForwardSensitivity> {
    simulation: &'a mut Simulation<f64, R>,
    carrier: &'a mut SensitivityCarrier<R>,
    control: &'a mut StepControl,
    /// Called after every accepted step.
    accepted: &'a mut dyn FnMut(&Simulation<f64, R>),
}

impl<R: ForwardSensitivity> BisectedSteps for RunSteps<'_, R> {
    type Rod = R;

    /// The simulation at its present state.
    fn simulation(&self) -> &Simulation<f64, R> {
        self.simulation
    }

    /// Makes a trial step of the simulation, and of dual simulations of the derivatives if the scheme needs them, to a
    /// time, s. Errors are those of a step; the state is then the one before it.
    fn step_to(&mut self, time: f64) -> Result<(), Error> {
        self.carrier.step_to(self.simulation, time)
    }

    /// Undoes the last trial step, of dual simulations too.
    fn step_back(&mut self) {
        self.carrier.step_back(self.simulation);
    }

    /// Completes an accepted step: calls the observer of substeps, then advances the derivatives over it or sends it to
    /// the other thread. Errors: derivatives that cannot be computed, and the end of the other thread.
    fn accepted(&mut self) -> Result<(), Error> {
        (self.accepted)(self.simulation);
        self.carrier.advance(self.simulation)
    }

    /// The control of the steps (limits of energy or rotation), mutable, with the simulation.
    fn control(&mut self) -> (&mut StepControl, &Simulation<f64, R>) {
        (self.control, self.simulation)
    }
}

/// Appends the present state to `record`: time, motions of tracked nodes and axes, reactions and energies if
/// requested. Its derivatives are appended too, unless another thread records them; then the step is marked for that
/// thread. If `record.keeps` is false, only the list of accepted steps is cleared.
fn record_state<M: Model>(
    discretized: &Discretized<'_, M>,
    simulation: &Simulation<f64, M::Rod<f64>>,
    carrier: &mut SensitivityCarrier<M::Rod<f64>>,
    outputs: &DerivedOutputs<M>,
    record: &mut Record,
) where
    M::Rod<f64>: ForwardSensitivity,
{
    // A run that is only observed has no record; its list of accepted steps would grow for ever.
    if !record.keeps {
        record.taken.clear();
        return;
    }
    let (model, state) = (discretized.model, simulation.state());
    if let Some(energies) = &mut record.energies {
        energies.push(simulation.energies());
    }
    let tracked = record.tracked();
    // Positions and velocities of tracked nodes, three axes of every recorded edge, then the reactions.
    let motion = |i: &usize| [model.position(&state.q, *i), model.rate(&state.v, *i)];
    let DerivedOutputs { axes, reactions } = outputs;
    let axes = axes.iter().flat_map(|axes| axes.motions(discretized, state));
    let reactions = reactions.iter().flat_map(|reactions| reactions.of(discretized, state).parts());
    record.push(state.time, tracked.iter().map(motion).chain(axes).chain(reactions));
    match carrier {
        SensitivityCarrier::Synchronous { sensitivities, .. } => {
            let recorder = DerivativeRecorder { discretized, tracked: &tracked, outputs };
            for k in 0..sensitivities.count() {
                recorder.push(sensitivities, k, state, record.derivatives_mut(k));
            }
        }
        SensitivityCarrier::Asynchronous(producer) => producer.mark_recorded(),
    }
}

/// Outputs of a run that are computed from its states, if they are requested.
struct DerivedOutputs<M: Model> {
    /// Director axes of recorded edges.
    axes: Option<DirectorAxes>,
    /// Reactions of the supports.
    reactions: Option<RecordedReactions<M>>,
}

impl<M: Model> DerivedOutputs<M> {
    /// The outputs of a run that its `record` requests, with their models over dual numbers for the derivatives by each
    /// of the parameters.
    fn new(RunTask { discretized, parameters, .. }: &RunTask<'_, M>, record: &Record) -> Self {
        Self {
            axes: DirectorAxes::new(discretized, parameters, record),
            reactions: record
                .has_reactions
                .then(|| RecordedReactions::new(discretized, parameters)),
        }
    }
}

/// Appends derivatives of tracked nodes, director axes and reactions to a record.
struct DerivativeRecorder<'a, M: Model> {
    discretized: &'a Discretized<'a, M>,
    tracked: &'a [usize],
    outputs: &'a DerivedOutputs<M>,
}

impl<M: Model> DerivativeRecorder<'_, M>
where
    M::Rod<f64>: ForwardSensitivity,
{
    /// Appends to `list` the derivatives by parameter `k` of the recorded motions of a state, in world axes: position
    /// and velocity of each tracked node, then of the axes and the reactions.
    fn push(
        &self,
        sensitivities: &Sensitivities<M::Rod<f64>>,
        k: usize,
        state: &State<f64, FramesOf<M>>,
        list: &mut Vec<Motion>,
    ) {
        let nodes = Nodes { nodes: self.tracked, stride: M::STRIDE, axes: M::STRIDE.min(3) };
        let model = self.discretized.model;
        list.reserve(self.tracked.len());
        sensitivities.of_nodes(k, nodes, |[q, v]| {
            list.push([model.rate(&q, 0), model.rate(&v, 0)]);
        });
        if let Some(axes) = &self.outputs.axes {
            list.extend(axes.rates(self.discretized, sensitivities, k, state));
        }
        if let Some(reactions) = &self.outputs.reactions {
            list.extend(reactions.rates(self.discretized, sensitivities, k, state));
        }
    }
}

/// Repeats a run over the scalar `D`, with the ends of the accepted steps of the `plain` record, bisected ones
/// included. Returns a record of the same nodes, axes and reactions at the same times, without lists of derivatives and
/// energies. `seed` converts the value of each parameter to the scalar. No step is bisected or checked again. Errors
/// are those of the initial state and of a step.
pub(super) fn repeat_over<D: RodScalar, M: Model>(
    discretized: &Discretized<'_, M>,
    plain: &Record,
    seed: impl Fn(Parameter, f64) -> D,
) -> Result<Record<D>, Error> {
    let model = discretized.model;
    let (tracked, edges) = (plain.tracked(), plain.edges());
    let mut record = Record::new(tracked.clone(), 0).with_axes(edges.clone());
    record.has_reactions = plain.has_reactions;
    let directors =
        (!edges.is_empty()).then(|| discretized.directors(&discretized.setup_over(&seed)));
    let reactions =
        plain.has_reactions.then(|| discretized.reactions_in_motion(discretized.setup_over(&seed)));
    let mut simulation = discretized.simulation_over(seed)?;
    let mut ends = plain.times().iter().peekable();
    // No step for the initial state, then the accepted steps of the plain run: bisection decided
    // on plain numbers, and a decision has no derivative.
    for time in std::iter::once(None).chain(plain.taken.iter().map(Some)) {
        if let Some(time) = time {
            simulation.step_to(*time)?;
        }
        let state = simulation.state();
        // Only ends of steps of the scene are recorded, not those of halves.
        if ends.next_if_eq(&&state.time).is_some() {
            let motion = |i: &usize| [model.position(&state.q, *i), model.rate(&state.v, *i)];
            let axes = directors.into_iter().flat_map(|directors| {
                let State { q, v, frames, .. } = state;
                edges.iter().flat_map(move |e| discretized.axes(directors, q, v, frames, *e))
            });
            let reactions =
                reactions.iter().flat_map(|model| discretized.reactions(model, state).parts());
            record.push(state.time, tracked.iter().map(motion).chain(axes).chain(reactions));
        }
    }
    record.taken = plain.taken.clone();
    record.work = simulation.work();
    Ok(record)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::problem::AnyProblem;
    use crate::scene::Scene;

    /// The result, as text, and the record of a run with synchronous or asynchronous derivatives.
    fn run_of(problem: &Problem, parameters: &[Parameter], asynchronous: bool) -> (String, Record) {
        let all: Vec<usize> = (0..problem.nodes()).collect();
        let mut record = Record::new(all, parameters.len());
        record.energies = Some(Vec::new());
        let steps = problem.time().unwrap().steps();
        let result = match problem.discretized() {
            AnyProblem::Planar(planar) => {
                let task = RunTask { problem, discretized: &planar, parameters, steps };
                let mut observers =
                    RunObservers { after_step: &mut |_| {}, after_substep: &mut |_| {} };
                run_with(&task, asynchronous, &mut record, &mut observers)
            }
            AnyProblem::Spatial(spatial) => {
                let task = RunTask { problem, discretized: &spatial, parameters, steps };
                let mut observers =
                    RunObservers { after_step: &mut |_| {}, after_substep: &mut |_| {} };
                run_with(&task, asynchronous, &mut record, &mut observers)
            }
        };
        (format!("{result:?}"), record)
    }

    /// Bitwise, with the same work, for every kind of dissipation, with bisected steps, and for runs that end early.
    #[test]
    fn asynchronous_derivatives_equal_synchronous_ones_bitwise() {
        let rods = [
            "[rod]\nsegments = 12\nshape = { kind = \"straight\", length = 0.5, direction = [1, 0, 0] }",
            "[rod]\nsegments = 12\nshape = { kind = \"helix\", length = 0.5, radius = 0.05, pitch = 0.1, axis = [0, 0, -1], handedness = \"left\" }",
        ];
        let dissipation = [
            "",
            "[loads.damping]\nmass = 0.5\n",
            "[loads.damping]\nstiffness = 2e-3\n",
            "[loads.damping]\nmaxwell = { stiffness = 0.5, time = 0.1 }\n",
            "[loads.damping]\nfriction = { stiffness = 0.8, curvature = 0.5 }\n",
            "[loads.drag]\nlinear_normal = 0.02\nquadratic_normal = 0.3\n",
        ];
        // The last is too soft for its steps: it takes some in halves, and some runs end there.
        let times = [
            ("end = 0.4\nstep = 2e-3", 1e7),
            ("end = 0.4\nstep = 2e-3\nscheme = \"generalised-alpha\"\nrho_inf = 0.5", 1e7),
            ("end = 2.0\nstep = 4e-2", 1e6),
        ];
        let (mut halved, mut ended, mut compared) = (0, 0, 0);
        for rod in rods {
            for dissipates in dissipation {
                for (time, modulus) in times {
                    let text = format!(
                        "{rod}\nsection = {{ kind = \"circle\", radius = 0.005 }}\n[material]\ndensity = 1200\n\
                         youngs_modulus = {modulus:e}\npoisson_ratio = 0.4\n[loads]\ngravity = [1, 0, -9.8]\n\
                         {dissipates}[time]\n{time}\n"
                    );
                    let problem = Scene::from_toml(&text, ".").unwrap().problem().unwrap();
                    let all = Parameter::all(problem.scene()).into_iter();
                    let numbers: Vec<Parameter> =
                        all.filter(|p| problem.check_parameter(*p).is_ok()).take(7).collect();
                    let (why, along) = run_of(&problem, &numbers, false);
                    let (why_behind, behind) = run_of(&problem, &numbers, true);
                    assert_eq!(why, why_behind, "{text}");
                    assert_eq!(along.work, behind.work, "{text}");
                    assert_eq!(along.taken, behind.taken, "{text}");
                    assert_eq!(along.energies, behind.energies, "{text}");
                    halved += usize::from(along.taken.len() > along.times().len());
                    ended += usize::from(why != "Ok(())");
                    compared += along.times().len();
                    assert_eq!(along.into_parts(), behind.into_parts(), "{text}");
                }
            }
        }
        println!("{compared} states, {halved} runs with halved steps, {ended} that ended early");
        assert!(compared > 3000 && halved > 0 && ended > 0, "{compared}, {halved}, {ended}");
    }
}
