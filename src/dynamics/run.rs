//! A run of a scene: from its start, step by step, each seen and recorded.

use crate::dynamics::follower::{self, Leader};
use crate::dynamics::record::{Motion, Record};
use crate::dynamics::sensitivity::{Nodes, Sensitivities};
use crate::dynamics::simulation::Simulation;
use crate::dynamics::step::Work;
use crate::dynamics::step_control::{HALVINGS, StepControl};
use crate::dynamics::unstable_state::StabilityChecks;
use crate::error::Error;
use crate::numerics::scalar::Nestable;
use crate::problem::{DirectorRotation, Discretized, FramesOf, Model, Problem};
use crate::rod::{Energies, Sensitive, State};
use crate::scene::{Parameter, Stencil};
use crate::statics::MotionResistances;
use num_dual::Dual64;
use std::sync::Arc;

/// A running simulation as it looks from outside the model.
pub trait Snapshot {
    /// Time, s.
    fn time(&self) -> f64;
    /// Position of node `i` in world coordinates, m.
    fn position(&self, i: usize) -> [f64; 3];
    /// Energies by term, J.
    fn energies(&self) -> Energies;
    /// The work so far.
    fn work(&self) -> Work;
    /// Position of a point in world coordinates, m.
    fn place(&self, stencil: &Stencil) -> [f64; 3] {
        stencil.place(|i| self.position(i))
    }
}

/// A simulation with the model that knows where its nodes are.
struct Running<'a, M: Model> {
    model: &'a M,
    simulation: &'a Simulation<f64, M::Rod<f64>>,
}

impl<M: Model> Snapshot for Running<'_, M> {
    fn time(&self) -> f64 {
        self.simulation.state().time
    }
    fn position(&self, i: usize) -> [f64; 3] {
        self.model.position(&self.simulation.state().q, i)
    }
    fn energies(&self) -> Energies {
        self.simulation.energies()
    }
    fn work(&self) -> Work {
        self.simulation.work()
    }
}

/// A simulation of a model.
type Simulated<M> = Simulation<f64, <M as Model>::Rod<f64>>;
/// At its start, with its derivatives.
type Started<M> = (Simulated<M>, Sensitivities<<M as Model>::Rod<f64>>);
/// On its way, with what carries them.
type Led<'a, M> = (&'a mut Simulated<M>, &'a mut Carried<<M as Model>::Rod<f64>>);
/// Sees it.
type Sees<'a, M> = dyn FnMut(&Simulated<M>) + 'a;

/// Simulates `steps` steps and records them with their derivatives by `parameters`; `after` sees the
/// simulation at the start and after every step, and `taken` each time that a step is taken, whole or in halves.
pub(super) fn run<M: Model>(
    problem: &Problem,
    discretized: &Discretized<'_, M>,
    (parameters, steps): (&[Parameter], usize),
    record: &mut Record,
    after: &mut dyn FnMut(&dyn Snapshot),
    taken: &mut Sees<'_, M>,
) -> Result<(), Error>
where
    M::Rod<f64>: Sensitive,
{
    let running = follower::Running::begin();
    let followed = running.has_room(steps * problem.nodes());
    run_so((problem, discretized, steps), (parameters, followed), record, (after, taken))
}

/// What is run, for so many steps.
type Task<'a, M> = (&'a Problem, &'a Discretized<'a, M>, usize);
/// Who sees it.
type Seen<'a, 'b, M> = (&'a mut dyn FnMut(&dyn Snapshot), &'a mut Sees<'b, M>);

/// The same; where the run may be `followed`, its derivatives come behind.
fn run_so<M: Model>(
    task: Task<'_, M>,
    (parameters, followed): (&[Parameter], bool),
    record: &mut Record,
    seen: Seen<'_, '_, M>,
) -> Result<(), Error>
where
    M::Rod<f64>: Sensitive,
{
    let (_, discretized, _) = task;
    discretized.check_step()?;
    let mut simulation = discretized.simulation()?;
    let sensitivities = discretized.sensitivities(parameters)?;
    let markers = Markers::new(discretized, parameters, record);
    let again = !parameters.is_empty() && simulation.can_linearize_again();
    if followed && again {
        return run_followed(task, (simulation, sensitivities), markers, record, seen);
    }
    if !again && !parameters.is_empty() {
        simulation.keep_tangent();
    }
    let linear = again.then(|| Box::new(simulation.linear()));
    let carried = &mut Carried::Here(sensitivities, linear);
    let result = make_steps(task, (&mut simulation, carried), markers.as_ref(), record, seen);
    if let Carried::Here(_, Some(linear)) = carried {
        record.work += linear.work();
    }
    result
}

/// The same where another thread takes the derivatives.
fn run_followed<M: Model>(
    task: Task<'_, M>,
    (mut simulation, sensitivities): Started<M>,
    markers: Option<Markers>,
    record: &mut Record,
    seen: Seen<'_, '_, M>,
) -> Result<(), Error>
where
    M::Rod<f64>: Sensitive,
{
    let (_, discretized, _) = task;
    let (tracked, markers) = (record.tracked(), markers.as_ref());
    if record.keeps {
        for k in 0..sensitivities.count() {
            let (of, list) = ((&sensitivities, k), record.derivatives_mut(k));
            add_rates(discretized, of, (&tracked, markers), simulation.state(), list);
        }
    }
    let (leader, follower) = follower::ends(&simulation, sensitivities);
    let (result, followed) = std::thread::scope(|scope| {
        let follow = || {
            follower.follow(|sensitivities, k, state, list| {
                add_rates(discretized, (sensitivities, k), (&tracked, markers), state, list);
            })
        };
        let following = scope.spawn(follow);
        let mut carried = Carried::Behind(leader);
        let led = (&mut simulation, &mut carried);
        let result = make_steps(task, led, markers, record, seen);
        let since = std::time::Instant::now();
        if let Carried::Behind(leader) = carried {
            leader.end();
        }
        let followed = following.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic));
        record.stepping += since.elapsed();
        (result, followed)
    });
    for (k, rates) in followed.derivatives.into_iter().enumerate() {
        record.derivatives_mut(k).extend(rates);
    }
    let result = match followed.failed {
        Some((error, work)) => {
            record.truncate(followed.recorded + 1);
            record.work = work;
            Err(error)
        }
        None => result,
    };
    record.work += followed.work;
    result
}

/// What carries the derivatives of a run.
enum Carried<R: Sensitive> {
    /// They go along: by steps linearized once more, where that can be done.
    Here(Sensitivities<R>, Option<Box<Simulation<f64, R>>>),
    /// They come behind.
    Behind(Leader<R>),
}

impl<R: Sensitive> Carried<R> {
    /// As [`Sensitivities::step_to`].
    fn step_to(&mut self, simulation: &mut Simulation<f64, R>, time: f64) -> Result<(), Error> {
        match self {
            Self::Here(sensitivities, _) => sensitivities.step_to(simulation, time),
            Self::Behind(_) => simulation.step_to(time),
        }
    }

    /// As [`Sensitivities::step_back`].
    fn step_back(&mut self, simulation: &mut Simulation<f64, R>) {
        match self {
            Self::Here(sensitivities, _) => sensitivities.step_back(simulation),
            Self::Behind(_) => simulation.step_back(),
        }
    }

    /// As [`Sensitivities::advance`].
    fn advance(&mut self, simulation: &Simulation<f64, R>) -> Result<(), Error> {
        match self {
            Self::Here(sensitivities, None) => sensitivities.advance(simulation),
            Self::Here(sensitivities, Some(linear)) => {
                let step = linear.linearized(simulation.previous(), simulation.state())?;
                step.map_or(Ok(()), |step| sensitivities.advance_over(&step))
            }
            Self::Behind(leader) => leader.push(simulation),
        }
    }
}

/// Makes the steps of a run, each seen and recorded.
fn make_steps<M: Model>(
    (problem, discretized, steps): Task<'_, M>,
    (simulation, carried): Led<'_, M>,
    markers: Option<&Markers>,
    record: &mut Record,
    (after, taken): Seen<'_, '_, M>,
) -> Result<(), Error>
where
    M::Rod<f64>: Sensitive,
{
    let (time, model) = (problem.time()?, discretized.model);
    let mut control = StepControl::new(problem.scene(), simulation);
    if let Carried::Here(..) = carried {
        record.make_room(steps + 1);
    }
    keep(discretized, simulation, (carried, markers), record);
    after(&Running { model, simulation });
    taken(simulation);
    for k in 1..=steps {
        problem.check_stop()?;
        let start = std::time::Instant::now();
        let result =
            advance(simulation, carried, &mut control, (time.at(k), 0), &mut |simulation| {
                record.taken.push(simulation.state().time);
                taken(simulation);
            });
        record.stepping += start.elapsed();
        record.work = simulation.work();
        result?;
        keep(discretized, simulation, (carried, markers), record);
        if let Some(stability) = &mut record.stability
            && StabilityChecks::includes(k, steps)
        {
            stability.examine(discretized, simulation);
            record.work.stability_checks = stability.count;
        }
        after(&Running { model, simulation });
    }
    Ok(())
}

/// Records the state of a simulation and, where they go along, of its sensitivities.
fn keep<M: Model>(
    discretized: &Discretized<'_, M>,
    simulation: &Simulation<f64, M::Rod<f64>>,
    (carried, markers): (&mut Carried<M::Rod<f64>>, Option<&Markers>),
    record: &mut Record,
) where
    M::Rod<f64>: Sensitive,
{
    if !record.keeps {
        record.taken.clear();
        return;
    }
    let (model, state) = (discretized.model, simulation.state());
    if let Some(energies) = &mut record.energies {
        energies.push(simulation.energies());
    }
    if let Some(reactions) = &mut record.reactions {
        let resistances =
            MotionResistances { damping: simulation.damping(), drag: simulation.drag() };
        reactions.push(discretized.reactions(simulation.rod(), resistances, state));
    }
    let tracked = record.tracked();
    let motion = |i: &usize| [model.position(&state.q, *i), model.rate(&state.v, *i)];
    let axes = markers.into_iter().flat_map(|m| m.axes(discretized, state));
    record.push(state.time, tracked.iter().map(motion).chain(axes));
    match carried {
        Carried::Here(sensitivities, _) => {
            for k in 0..sensitivities.count() {
                let (of, list) = ((&*sensitivities, k), record.derivatives_mut(k));
                add_rates(discretized, of, (&tracked, markers), state, list);
            }
        }
        Carried::Behind(leader) => leader.record(),
    }
}

/// Appends what is recorded of a state's derivatives by parameter `k`.
fn add_rates<M: Model>(
    discretized: &Discretized<'_, M>,
    (sensitivities, k): (&Sensitivities<M::Rod<f64>>, usize),
    (tracked, markers): (&[usize], Option<&Markers>),
    state: &State<f64, FramesOf<M>>,
    list: &mut Vec<Motion>,
) where
    M::Rod<f64>: Sensitive,
{
    let nodes = Nodes { nodes: tracked, stride: M::STRIDE, axes: M::STRIDE.min(3) };
    list.reserve(tracked.len());
    sensitivities.of_nodes(k, nodes, |[q, v]| {
        list.push([discretized.model.rate(&q, 0), discretized.model.rate(&v, 0)]);
    });
    let axes = markers.into_iter().flat_map(|m| m.rates(discretized, (sensitivities, k), state));
    list.extend(axes);
}

/// The axes that markers beside the centre line move with.
struct Markers {
    edges: Arc<[usize]>,
    directors: DirectorRotation<f64>,
    /// With the derivatives by every parameter.
    derived: Vec<DirectorRotation<Dual64>>,
}

impl Markers {
    /// None where no axes are recorded.
    fn new<M: Model>(
        discretized: &Discretized<'_, M>,
        parameters: &[Parameter],
        record: &Record,
    ) -> Option<Self> {
        let derived = |parameter: &Parameter| {
            let seed = |p, value| Dual64::new(value, f64::from(u8::from(p == *parameter)));
            discretized.directors(&discretized.setup_over(seed))
        };
        (!record.edges().is_empty()).then(|| Self {
            edges: record.edges(),
            directors: discretized.directors(discretized.setup),
            derived: parameters.iter().map(derived).collect(),
        })
    }

    fn axes<M: Model>(
        &self,
        discretized: &Discretized<'_, M>,
        State { q, v, frames, .. }: &State<f64, FramesOf<M>>,
    ) -> impl Iterator<Item = Motion> {
        self.edges
            .iter()
            .flat_map(move |edge| discretized.axes(self.directors, q, v, frames, *edge))
    }

    /// The derivatives of the axes by parameter `k`.
    fn rates<M: Model>(
        &self,
        discretized: &Discretized<'_, M>,
        (sensitivities, k): (&Sensitivities<M::Rod<f64>>, usize),
        state: &State<f64, FramesOf<M>>,
    ) -> Vec<Motion>
    where
        M::Rod<f64>: Sensitive,
    {
        let (q, v, frames) = sensitivities.motion(k, state);
        let axes = |edge: &usize| {
            let axes = discretized.axes::<Dual64>(self.derived[k], &q, &v, &frames, *edge);
            axes.map(|axis| axis.map(|x| x.map(|c| c.eps)))
        };
        self.edges.iter().flat_map(axes).collect()
    }
}

/// Advances a simulation and its derivatives to `time`, in halves where the step fails. On an
/// error the state is the last valid one.
fn advance<R: Sensitive>(
    simulation: &mut Simulation<f64, R>,
    carried: &mut Carried<R>,
    control: &mut StepControl,
    (time, halvings): (f64, u32),
    taken: &mut dyn FnMut(&Simulation<f64, R>),
) -> Result<(), Error> {
    let at_last = halvings == HALVINGS;
    let stepped = carried.step_to(simulation, time);
    match stepped.and_then(|()| control.check(simulation, at_last)) {
        Ok(()) => {
            control.accept();
            taken(simulation);
            carried.advance(simulation)
        }
        Err(error) => {
            carried.step_back(simulation);
            if at_last {
                return Err(error);
            }
            let middle = 0.5 * (simulation.state().time + time);
            let halvings = halvings + 1;
            advance(simulation, carried, control, (middle, halvings), taken)?;
            advance(simulation, carried, control, (time, halvings), taken)
        }
    }
}

/// A run again over another scalar, step for step as `plain` went; `seed` makes its numbers of the
/// parameters.
pub(super) fn follow<D: Nestable, M: Model>(
    discretized: &Discretized<'_, M>,
    plain: &Record,
    seed: impl Fn(Parameter, f64) -> D,
) -> Result<Record<D>, Error> {
    let model = discretized.model;
    let (tracked, edges) = (plain.tracked(), plain.edges());
    let mut record = Record::new(tracked.clone(), 0).with_axes(edges.clone());
    let directors =
        (!edges.is_empty()).then(|| discretized.directors(&discretized.setup_over(&seed)));
    let mut simulation = discretized.simulation_over(seed)?;
    let mut ends = plain.times().iter().peekable();
    for time in std::iter::once(None).chain(plain.taken.iter().map(Some)) {
        if let Some(time) = time {
            simulation.step_to(*time)?;
        }
        let state = simulation.state();
        if ends.next_if_eq(&&state.time).is_some() {
            let motion = |i: &usize| [model.position(&state.q, *i), model.rate(&state.v, *i)];
            let axes = directors.into_iter().flat_map(|directors| {
                let State { q, v, frames, .. } = state;
                edges.iter().flat_map(move |e| discretized.axes(directors, q, v, frames, *e))
            });
            record.push(state.time, tracked.iter().map(motion).chain(axes));
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

    /// A run with derivatives by some numbers that go along, or come behind: why it ended, and its record.
    fn run_of(problem: &Problem, parameters: &[Parameter], followed: bool) -> (String, Record) {
        let all: Vec<usize> = (0..problem.nodes()).collect();
        let mut record = Record::new(all, parameters.len());
        record.energies = Some(Vec::new());
        let steps = problem.time().unwrap().steps();
        let asked = (parameters, followed);
        let result = match problem.discretized() {
            AnyProblem::Planar(planar) => {
                let task = (problem, &planar, steps);
                run_so(task, asked, &mut record, (&mut |_| {}, &mut |_| {}))
            }
            AnyProblem::Spatial(spatial) => {
                let task = (problem, &spatial, steps);
                run_so(task, asked, &mut record, (&mut |_| {}, &mut |_| {}))
            }
        };
        (format!("{result:?}"), record)
    }

    /// To the last bit, with the same work, whatever dissipates; also where steps are taken in halves, and where the
    /// run ends early.
    #[test]
    fn derivatives_behind_are_those_that_go_along() {
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
