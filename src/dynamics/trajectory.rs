//! What a simulation leaves behind: positions and velocities of the tracked nodes at every step,
//! and their derivatives where asked for.

use crate::dynamics::sensitivity;
use crate::dynamics::sensitivity::Sensitivity;
use crate::dynamics::simulation::Simulation;
use crate::dynamics::step::Work;
use crate::dynamics::step_control::{HALVINGS, StepControl};
use crate::error::Error;
use crate::numerics::hermite::{Hermite, Lifted};
use crate::numerics::scalar::Scalar;
use crate::numerics::vector::add;
use crate::problem::Model;
use crate::problem::{AnyProblem, Posed, Problem};
use crate::rod::{Energies, Rod};
use crate::scene::Parameter;
use crate::scene::{Point, Stencil};
use crate::statics::Reactions;
use crate::statics::nodes_over;
use nalgebra::Vector3;
use num_dual::Dual64;
use std::time::Duration;

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
}

/// A simulation with the model that knows where its nodes are.
struct Running<'a, M: Model<W>, const W: usize> {
    model: &'a M,
    simulation: &'a Simulation<f64, M::Rod<f64>, W>,
}

impl<M: Model<W>, const W: usize> Snapshot for Running<'_, M, W> {
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

/// Position and velocity of a node in world axes, m and m/s, or their derivatives.
pub(crate) type Motion = [[f64; 3]; 2];

/// The recorded motion, in world coordinates.
#[derive(Clone, Debug)]
pub struct Trajectory {
    tip: usize,
    nodes: usize,
    /// What it is a record of.
    problem: Problem,
    parameters: Vec<Parameter>,
    tracked: Vec<usize>,
    times: Vec<f64>,
    /// Of every tracked node, step after step.
    motion: Vec<Motion>,
    /// The same for every parameter.
    derivatives: Vec<Vec<Motion>>,
    work: Work,
    stepping: Duration,
    /// Ends of all steps taken, halves too, s.
    taken: Vec<f64>,
    /// Of every time, where asked for.
    energies: Option<Vec<Energies>>,
    reactions: Option<Vec<Reactions>>,
    /// Whether anything is kept at all.
    records: bool,
}

impl Problem {
    /// Simulates the whole scene and keeps every node.
    pub fn simulate(&self) -> Result<Trajectory, Error> {
        self.simulate_with(&[])
    }

    /// Simulates the whole scene with the derivatives of every node's motion with respect to
    /// `parameters`.
    pub fn simulate_with(&self, parameters: &[Parameter]) -> Result<Trajectory, Error> {
        let all: Vec<usize> = (0..self.nodes()).collect();
        let mut trajectory = Trajectory::new(self, &all, parameters)?;
        trajectory.run(self, self.time()?.steps(), |_| {})?;
        Ok(trajectory)
    }
}

impl Trajectory {
    /// An empty record of the nodes `tracked`, with derivatives by `parameters`.
    pub fn new(
        problem: &Problem,
        tracked: &[usize],
        parameters: &[Parameter],
    ) -> Result<Self, Error> {
        for parameter in parameters {
            problem.check_parameter(*parameter)?;
        }
        let mut tracked = tracked.to_vec();
        tracked.sort_unstable();
        tracked.dedup();
        if let Some(found) = tracked.last().filter(|node| **node >= problem.nodes()) {
            let (found, high) = (*found as f64, problem.segments() as f64);
            return Err(Error::OutOfRange { what: "node", found, low: 0.0, high });
        }
        Ok(Self {
            tip: problem.nodes() - 1,
            nodes: problem.nodes(),
            problem: problem.clone(),
            parameters: parameters.to_vec(),
            tracked,
            times: Vec::new(),
            motion: Vec::new(),
            derivatives: vec![Vec::new(); parameters.len()],
            work: Work::default(),
            stepping: Duration::ZERO,
            taken: Vec::new(),
            energies: None,
            reactions: None,
            records: true,
        })
    }

    /// For a run that is seen while it goes on and keeps nothing, however many its steps.
    pub fn unrecorded(problem: &Problem) -> Result<Self, Error> {
        Ok(Self { records: false, ..Self::new(problem, &[], &[])? })
    }

    /// Keeps the [energies](Self::energies) of a run to come.
    pub fn keep_energies(self) -> Self {
        Self { energies: Some(Vec::new()), ..self }
    }

    /// Keeps the [reactions](Self::reactions) of a run to come.
    pub fn keep_reactions(self) -> Self {
        Self { reactions: Some(Vec::new()), ..self }
    }

    /// The [equilibrium](Problem::equilibrium) of a problem as a record at time 0: the nodes
    /// `tracked` where the rod comes to rest under its loads, and their exact derivatives
    /// by `parameters`. The scene needs no `[time]`. The work counts the Newton iterations of the way.
    ///
    /// A rod that can move without a force, as at the limit of its stability, has no derivatives:
    /// [`Error::Indifferent`].
    pub fn at_rest(
        problem: &Problem,
        tracked: &[usize],
        parameters: &[Parameter],
    ) -> Result<Self, Error> {
        let mut record = Self::new(problem, tracked, parameters)?;
        match problem.posed() {
            AnyProblem::Planar(posed) => record.rest_posed(&posed)?,
            AnyProblem::Spatial(posed) => record.rest_posed(&posed)?,
        }
        Ok(record)
    }

    fn rest_posed<M: Model<W>, const W: usize>(
        &mut self,
        posed: &Posed<'_, M, W>,
    ) -> Result<(), Error> {
        let settled = posed.settled()?;
        let rest = &settled.rest;
        self.work.newton_iterations = rest.newton_iterations;
        self.times.push(0.0);
        let place = |i: &usize| [posed.model.position(&rest.q, *i), [0.0; 3]];
        self.motion.extend(self.tracked.iter().map(place));
        for (parameter, track) in self.parameters.iter().zip(&mut self.derivatives) {
            let seed = |p, value| Dual64::new(value, f64::from(u8::from(p == *parameter)));
            let nodes = nodes_over(posed, &settled, &self.tracked, seed)?;
            track.extend(nodes.iter().map(|x| [x.map(|x| x.eps), [0.0; 3]]));
        }
        Ok(())
    }

    /// Simulates `steps` steps of the scene from its start and records them; `after` sees the
    /// simulation at the start and after every step. What was recorded stays when a step fails.
    ///
    /// A record is of one run of the problem it was made for: [`Error::Invalid`] for a second run,
    /// another problem's, or one of more steps than the scene has.
    pub fn run(
        &mut self,
        problem: &Problem,
        steps: usize,
        mut after: impl FnMut(&dyn Snapshot),
    ) -> Result<(), Error> {
        self.run_seen(problem, steps, &mut after)
    }

    /// Not generic: whoever calls `run` need not compile the simulation again.
    fn run_seen(
        &mut self,
        problem: &Problem,
        steps: usize,
        after: &mut dyn FnMut(&dyn Snapshot),
    ) -> Result<(), Error> {
        self.check_run(problem, steps)?;
        match problem.posed() {
            AnyProblem::Planar(posed) => self.run_posed(problem, &posed, steps, after),
            AnyProblem::Spatial(posed) => self.run_posed(problem, &posed, steps, after),
        }
    }

    fn check_run(&self, problem: &Problem, steps: usize) -> Result<(), Error> {
        if !self.times.is_empty() {
            let found = format!("a record of {} times", self.times.len());
            return Err(Error::invalid(
                "trajectory",
                found,
                "an empty one: a new one for each run",
            ));
        }
        if problem.scene() != self.problem.scene() {
            let allowed = "the one the trajectory was made for: a new one for each problem";
            return Err(Error::invalid("problem", "another scene", allowed));
        }
        let most = problem.time()?.steps();
        if steps > most {
            let allowed = format!("up to {most}, where the scene's time ends");
            return Err(Error::invalid("steps", steps, allowed));
        }
        Ok(())
    }

    fn run_posed<M: Model<W>, const W: usize>(
        &mut self,
        problem: &Problem,
        posed: &Posed<'_, M, W>,
        steps: usize,
        after: &mut dyn FnMut(&dyn Snapshot),
    ) -> Result<(), Error> {
        let (time, model) = (problem.time()?, posed.model);
        posed.check_step()?;
        let mut simulation = posed.simulation()?;
        let mut sensitivities: Vec<Sensitivity<_, W>> =
            self.parameters.iter().map(|p| posed.sensitivity(*p)).collect::<Result<_, _>>()?;
        if !sensitivities.is_empty() {
            simulation.keep_tangent();
        }
        let mut room = Vec::new();
        let mut control = StepControl::new(problem.scene(), &simulation);
        self.record(posed, &simulation, &sensitivities);
        after(&Running { model, simulation: &simulation });
        for k in 1..=steps {
            problem.check_stop()?;
            let start = std::time::Instant::now();
            let result = advance(
                &mut simulation,
                &mut sensitivities,
                (&mut room, &mut self.taken),
                &mut control,
                time.at(k),
                0,
            );
            self.stepping += start.elapsed();
            self.work = simulation.work();
            result?;
            self.record(posed, &simulation, &sensitivities);
            after(&Running { model, simulation: &simulation });
        }
        Ok(())
    }

    fn record<M: Model<W>, const W: usize>(
        &mut self,
        posed: &Posed<'_, M, W>,
        simulation: &Simulation<f64, M::Rod<f64>, W>,
        sensitivities: &[Sensitivity<M::Rod<num_dual::Dual64>, W>],
    ) {
        if !self.records {
            self.taken.clear();
            return;
        }
        let (model, state) = (posed.model, simulation.state());
        if let Some(energies) = &mut self.energies {
            energies.push(simulation.energies());
        }
        if let Some(reactions) = &mut self.reactions {
            reactions.push(posed.reactions(simulation.rod(), simulation.damping(), state));
        }
        self.times.push(state.time);
        let motion = |i: &usize| [model.position(&state.q, *i), model.rate(&state.v, *i)];
        self.motion.extend(self.tracked.iter().map(motion));
        for (track, s) in self.derivatives.iter_mut().zip(sensitivities) {
            let rates = |i: &usize| [model.rate(s.q(), *i), model.rate(s.v(), *i)];
            track.extend(self.tracked.iter().map(rates));
        }
    }

    /// Adds a record with as many derivatives as the trajectory has room for: `motion` is that of
    /// the nodes themselves at 0, and their derivatives from 1 on.
    pub(crate) fn push(&mut self, time: f64, motion: impl Fn(usize, usize) -> Motion) {
        self.times.push(time);
        self.motion.extend(self.tracked.iter().map(|i| motion(0, *i)));
        for (k, track) in self.derivatives.iter_mut().enumerate() {
            track.extend(self.tracked.iter().map(|i| motion(k + 1, *i)));
        }
    }

    /// The nodes that are recorded, ascending.
    pub(crate) fn tracked(&self) -> &[usize] {
        &self.tracked
    }

    /// Ends of all steps taken, s: those of the scene, and halves where a step was refused.
    pub(crate) fn taken(&self) -> &[f64] {
        &self.taken
    }

    /// An empty record of the same nodes, with room for derivatives by `parameters`.
    pub(crate) fn emptied(&self, parameters: &[Parameter]) -> Self {
        Self {
            parameters: parameters.to_vec(),
            times: Vec::new(),
            motion: Vec::new(),
            derivatives: vec![Vec::new(); parameters.len()],
            taken: Vec::new(),
            energies: None,
            reactions: None,
            ..self.clone()
        }
    }

    /// Times of the records, s: the start and the end of every step.
    pub fn times(&self) -> &[f64] {
        &self.times
    }
    /// The parameters of the derivatives.
    pub fn parameters(&self) -> &[Parameter] {
        &self.parameters
    }
    /// The work it took.
    pub fn work(&self) -> Work {
        self.work
    }
    /// Wall time of the stepping alone.
    pub fn stepping(&self) -> Duration {
        self.stepping
    }
    /// Number of nodes of the rod.
    pub fn nodes(&self) -> usize {
        self.nodes
    }

    /// Position of the tip after `k` steps in world coordinates, m. Panics if `k` was not recorded
    /// or the tip not tracked.
    pub fn tip(&self, k: usize) -> [f64; 3] {
        self.node(self.tip, k)
    }

    /// Position of a tracked node after `k` steps in world coordinates, m. Panics if `k` was not
    /// recorded or the node not tracked.
    pub fn node(&self, node: usize, k: usize) -> [f64; 3] {
        self.motion_of(node, k)[0]
    }

    /// Velocity of a tracked node after `k` steps in world axes, m/s. Panics if `k` was not recorded
    /// or the node not tracked.
    pub fn velocity(&self, node: usize, k: usize) -> [f64; 3] {
        self.motion_of(node, k)[1]
    }

    fn motion_of(&self, node: usize, k: usize) -> &Motion {
        let column = self.tracked.binary_search(&node).expect("the node is tracked");
        &self.motion[k * self.tracked.len() + column]
    }

    /// Energies by term at each of [`times`](Self::times), J; empty unless they were to be
    /// [kept](Self::keep_energies).
    pub fn energies(&self) -> &[Energies] {
        self.energies.as_deref().unwrap_or_default()
    }

    /// What the supports exert on the rod at each of [`times`](Self::times); empty unless it was to
    /// be [kept](Self::keep_reactions).
    ///
    /// ```
    /// use rodfit::{Scene, Trajectory};
    /// let problem = Scene::load("data/cantilever.toml")?.problem()?;
    /// let mut run = Trajectory::new(&problem, &[], &[])?.keep_reactions();
    /// run.run(&problem, 100, |_| {})?;
    /// let wall = &run.reactions()[100].start;
    /// let (lift, turning) = (wall.force[1], wall.moment[2]); // N, N m
    /// # assert!(lift.is_finite() && turning > 0.0);
    /// # Ok::<(), rodfit::Error>(())
    /// ```
    pub fn reactions(&self) -> &[Reactions] {
        self.reactions.as_deref().unwrap_or_default()
    }

    /// Position of a point at a time, m, and its derivative by each of
    /// [`parameters`](Self::parameters), in world axes. Between steps the cubic Hermite
    /// interpolant of positions and velocities.
    pub fn at(&self, point: Point, time: f64) -> Result<([f64; 3], Vec<[f64; 3]>), Error> {
        let stencil = self.problem.stencil(point)?;
        let mut derivatives = vec![[0.0; 3]; self.parameters.len()];
        let position = self.sample(&stencil, time, &mut derivatives)?;
        if let Point::ArcLength(_) = point {
            let (k, hermite) = self.around(time)?;
            for (out, parameter) in derivatives.iter_mut().zip(&self.parameters) {
                let seed = |p, value| Dual64::new(value, f64::from(u8::from(p == *parameter)));
                let stencil =
                    point.fixed().stencil(&self.problem.scene().seeded(seed).made_mesh())?;
                // The point stays where it is on the rod, and the nodes do not.
                let rates = stencil.nodes.into_iter().map(|(node, weight)| (node, weight.eps));
                let nodes = rates.filter(|(_, rate)| *rate != 0.0).collect();
                let slide = self.interpolate(&self.motion, &Stencil { nodes }, k, &hermite)?;
                *out = add(*out, slide);
            }
        }
        Ok((position, derivatives))
    }

    /// As [`at`](Self::at) for a stencil, without allocating.
    pub fn sample(
        &self,
        stencil: &Stencil,
        time: f64,
        derivatives: &mut [[f64; 3]],
    ) -> Result<[f64; 3], Error> {
        let (k, hermite) = self.around(time)?;
        for (out, track) in derivatives.iter_mut().zip(&self.derivatives) {
            *out = self.interpolate(track, stencil, k, &hermite)?;
        }
        self.interpolate(&self.motion, stencil, k, &hermite)
    }

    /// The position of a point at a time that may carry derivatives, with those that the tracks of
    /// derivatives `tracks` have of it: one per part of `D`; none is zero.
    pub(crate) fn sample_over<D: Lifted<P>, const P: usize>(
        &self,
        stencil: &Stencil<D>,
        time: D,
        tracks: [Option<usize>; P],
    ) -> Result<[D; 3], Error> {
        let (k, hermite) = self.around(time)?;
        self.interpolate_over(stencil, k, &hermite, tracks)
    }

    /// Position and velocity of a point as [`sample_over`](Self::sample_over) has it.
    pub(crate) fn motion_over<D: Lifted<P>, const P: usize>(
        &self,
        stencil: &Stencil<D>,
        time: f64,
        tracks: [Option<usize>; P],
    ) -> Result<[[D; 3]; 2], Error> {
        let (k, hermite) = self.around(D::from(time))?;
        let position = self.interpolate_over(stencil, k, &hermite, tracks)?;
        let rates = match self.times.get(k) {
            Some(end) => Hermite::rates(self.times[k - 1], *end, D::from(time)),
            None => return Ok([position, [D::from(0.0); 3]]),
        };
        Ok([position, self.interpolate_over(stencil, k, &rates, tracks)?])
    }

    fn interpolate_over<D: Lifted<P>, const P: usize>(
        &self,
        stencil: &Stencil<D>,
        k: usize,
        hermite: &Hermite<D>,
        tracks: [Option<usize>; P],
    ) -> Result<[D; 3], Error> {
        let width = self.tracked.len();
        let mut sum = [D::from(0.0); 3];
        for (node, weight) in &stencil.nodes {
            let column = self.column(*node)?;
            let at = |row: usize, part: usize, c: usize| {
                let index = row * width + column;
                let of = |track: &[Motion]| track.get(index).map_or(0.0, |m| m[part][c]);
                let parts = tracks.map(|t| t.map_or(0.0, |t| of(&self.derivatives[t])));
                D::lift(of(&self.motion), parts)
            };
            let after = if k < self.times.len() { k } else { k - 1 };
            for (c, sum) in sum.iter_mut().enumerate() {
                let value = hermite.x0 * at(k - 1, 0, c)
                    + hermite.x1 * at(after, 0, c)
                    + hermite.v0 * at(k - 1, 1, c)
                    + hermite.v1 * at(after, 1, c);
                *sum += value * *weight;
            }
        }
        Ok(sum)
    }

    /// The step a time lies in, by its end, and the interpolant there.
    fn around<D: Scalar>(&self, time: D) -> Result<(usize, Hermite<D>), Error> {
        let Some(&last) = self.times.last() else {
            return Err(Error::invalid("trajectory", "no records", "one that has run"));
        };
        let t = time.value();
        if !(t >= 0.0 && t <= last * (1.0 + 1e-9)) {
            return Err(Error::OutOfRange { what: "time", found: t, low: 0.0, high: last });
        }
        let k = self.times.partition_point(|end| *end <= t).clamp(1, self.times.len().max(2) - 1);
        let hermite = match self.times.get(k) {
            Some(end) => Hermite::new(self.times[k - 1], *end, time),
            None => Hermite::new(0.0, 1.0, D::from(0.0)),
        };
        Ok((k, hermite))
    }

    /// Where a tracked node stands among the tracked.
    fn column(&self, node: usize) -> Result<usize, Error> {
        self.tracked.binary_search(&node).map_err(|_| Error::OutOfRange {
            what: "a node that was not tracked",
            found: node as f64,
            low: self.tracked.first().map_or(0.0, |i| *i as f64),
            high: self.tracked.last().map_or(0.0, |i| *i as f64),
        })
    }

    fn interpolate(
        &self,
        track: &[Motion],
        stencil: &Stencil,
        k: usize,
        hermite: &Hermite<f64>,
    ) -> Result<[f64; 3], Error> {
        let width = self.tracked.len();
        let mut sum = [0.0; 3];
        for (node, weight) in &stencil.nodes {
            let column = self.column(*node)?;
            let before = &track[(k - 1) * width + column];
            let after = track.get(k * width + column).unwrap_or(before);
            for (c, sum) in sum.iter_mut().enumerate() {
                *sum += weight
                    * (hermite.x0 * before[0][c]
                        + hermite.x1 * after[0][c]
                        + hermite.v0 * before[1][c]
                        + hermite.v1 * after[1][c]);
            }
        }
        Ok(sum)
    }
}

/// Advances a simulation and its sensitivities to `time`, in halves where the step fails. On an
/// error the state is the last valid one.
fn advance<R, S, const W: usize>(
    simulation: &mut Simulation<f64, R, W>,
    sensitivities: &mut [Sensitivity<S, W>],
    (room, taken): (&mut Vec<f64>, &mut Vec<f64>),
    control: &mut StepControl,
    time: f64,
    halvings: u32,
) -> Result<(), Error>
where
    R: Rod<f64, W, Seeded = S>,
    S: Rod<Dual64, W>,
{
    let at_last = halvings == HALVINGS;
    match simulation.step_to(time).and_then(|()| control.check(simulation, at_last)) {
        Ok(()) => {
            control.accept();
            taken.push(time);
            sensitivity::advance(simulation, sensitivities, room)
        }
        Err(error) => {
            simulation.step_back();
            if at_last {
                return Err(error);
            }
            let middle = 0.5 * (simulation.state().time + time);
            let halvings = halvings + 1;
            advance(simulation, sensitivities, (room, taken), control, middle, halvings)?;
            advance(simulation, sensitivities, (room, taken), control, time, halvings)
        }
    }
}

/// Largest distance between nodes of two trajectories of the same mesh and times.
impl approx::AbsDiffEq for Trajectory {
    type Epsilon = f64;

    /// A picometre.
    fn default_epsilon() -> f64 {
        1e-12
    }

    fn abs_diff_eq(&self, other: &Self, epsilon: f64) -> bool {
        self.times == other.times
            && self.tracked == other.tracked
            && self
                .motion
                .iter()
                .zip(&other.motion)
                .all(|([a, _], [b, _])| (Vector3::from(*a) - Vector3::from(*b)).norm() <= epsilon)
    }
}

impl PartialEq for Trajectory {
    fn eq(&self, other: &Self) -> bool {
        self.times == other.times && self.tracked == other.tracked && self.motion == other.motion
    }
}
