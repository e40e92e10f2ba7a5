//! One experiment as a function of the unknowns: its simulation, its plain residuals (without robust loss and leverage
//! weights) and their exact derivatives.
//!
//! Input: an experiment (of a rod or a structure), cut to a horizon (the time, s, up to which its records are used),
//! the unknowns, and the standard deviations of its measurements. At a point of the unknowns it simulates the motion,
//! the equilibrium and the equilibria of load cases, as far as its measurements require them. Natural frequencies and
//! critical loads are solved with the residuals. The simulation has forward sensitivities by the parameters that change
//! the rod, and records only nodes and edges that the measurements require. Output: `(simulated - measured)/sigma` of
//! every value, and one column of the Jacobian per unknown, on the unknowns' scales. Dual numbers carry the derivatives
//! through camera and observation.
//!
//! Errors are points that are not on the rod, values that the scene does not allow, and a failed simulation. So is an
//! offset of the camera's clock, or a delay of a sensor, that extends the motion beyond [`MAX_DURATION_RATIO`].
//!
//! `run` makes the simulations, `residuals_and_jacobian` and `for_each_residual` (over any scalar) compute from them.
//! `problem_and_steps` is the problem at a point with the number of steps. `rest_work` is the work of static solutions,
//! in steps times segments. [`has_halved_steps`] returns whether a motion had halved time steps, and [`nodes`] the
//! nodes on which points depend.

use crate::dynamics::{Snapshot, Trajectory};
use crate::error::Error;
use crate::fit::measurement::MeasuredData;
use crate::fit::measurement::experiment::{Experiment, OwnLoad};
use crate::fit::measurement::loss::Loss;
use crate::fit::measurement::quantity::GaugeScalar;
use crate::fit::measurement::simulated::{
    BucklingCase, DelayedReading, LoadCase, Requirements, SimulatedOutput,
};
use crate::fit::misfit::camera::View;
use crate::fit::structure::structure_frequencies::structure_frequencies;
use crate::fit::structure::structure_problem::structure_of;
use crate::fit::unknown::{ParameterPoint, Unknown};
use crate::numerics::scalar::RodScalar;
use crate::problem::{Problem, ReferenceStrains};
use crate::scene::{Parameter, Point};
use crate::structure::Structure;
use crate::vibration::{CriticalLoad, ModeName, NaturalFrequency};
use num_dual::Dual64;
use std::collections::BTreeSet;

/// Longest simulated motion over the duration of the scene or of the recording, whichever is longer. A search may try
/// any offset of the camera's clock; larger ones would take too long.
const MAX_DURATION_RATIO: f64 = 2.0;

/// An experiment up to its horizon, with weighted measurements and the outputs that they require.
#[derive(Debug)]
pub(crate) struct ObservedExperiment {
    pub(super) problem: Problem,
    /// Indices of the unknowns that it depends on.
    pub(super) unknowns: Vec<usize>,
    pub(super) series: Vec<ObservedSeries>,
    /// Outputs of a simulation with which the values of the series are compared.
    pub(super) required: Requirements,
    /// Work of its static solutions, steps times segments.
    rest_work: f64,
    /// Loads that the scene has only while the mesh is chosen, with the values of the scene itself.
    own_loads: Vec<OwnLoad>,
}

/// Values of one measurement with their weights and their loss.
#[derive(Debug)]
pub(super) struct ObservedSeries {
    pub data: MeasuredData,
    /// Inverse of the standard deviation of every value.
    pub weights: Vec<f64>,
    pub loss: Loss,
}

/// Simulation of an experiment at one point of the unknowns.
pub(crate) struct ExperimentRun {
    pub problem: Problem,
    /// The motion; none if no measurement needs it.
    pub moving: Option<Trajectory>,
    /// The equilibrium; none if no measurement needs it.
    pub resting: Option<Trajectory>,
    /// The equilibria of the required load cases.
    pub load_cases: Vec<Trajectory>,
    /// The structure of the problem; none of one rod.
    pub structure: Option<Structure>,
}

/// The ratio of a `value` of a load to its number in the scene of `problem`; 0 without a load there.
fn load_ratio(problem: &Problem, load: Parameter, value: f64) -> f64 {
    load.of(problem.scene()).filter(|own| *own != 0.0).map_or(0.0, |own| value / own)
}

impl ObservedExperiment {
    /// The `experiment` with its measurements up to the `horizon`, s, and the indices of the `unknowns` that belong to
    /// it. Each of its measurements takes the next of `sigmas`, its standard deviation in its unit before its factors.
    /// An error for points that are not on the rod.
    pub fn new<'s>(
        experiment: &Experiment,
        unknowns: &[Unknown],
        sigmas: &mut impl Iterator<Item = &'s f64>,
        horizon: f64,
    ) -> Result<Self, Error> {
        let own = (0..unknowns.len()).filter(|i| unknowns[*i].is_of(experiment));
        let mut observed = Self {
            problem: experiment.problem.clone(),
            unknowns: own.collect(),
            series: Vec::new(),
            required: Requirements::default(),
            rest_work: experiment.rest_work(),
            own_loads: experiment.own_loads.clone(),
        };
        for (measurement, sigma) in experiment.measurements.iter().zip(sigmas) {
            let mut data = measurement.data.clone();
            data.prepare(&observed.problem, horizon);
            data.require(&mut observed.required);
            // Weights are those of all values: values after the horizon are last, and their weights have no effect.
            let weights = measurement.sigmas(*sigma).into_iter().map(f64::recip).collect();
            observed.series.push(ObservedSeries { data, weights, loss: measurement.loss() });
        }
        // Points that are not on the rod are reported here, not by the first simulation.
        nodes(&observed.required.moving, &observed.problem)?;
        nodes(&observed.required.resting, &observed.problem)?;
        observed.check_structure_points()?;
        Ok(observed)
    }

    /// Work of its static solutions, steps times segments: those of [`Experiment::rest_work`].
    pub(super) fn rest_work(&self) -> f64 {
        self.rest_work
    }

    /// Edges and joints of the rod of a `problem` without load, with the numbers of parameters that `seed` returns.
    /// None if no measurement requires them.
    pub(super) fn reference_strains<D: RodScalar>(
        &self,
        problem: &Problem,
        seed: impl Fn(Parameter, f64) -> D,
    ) -> Option<ReferenceStrains<D>> {
        self.required.has_strains().then(|| problem.reference_strains(seed))
    }

    /// Number of residuals of each measurement up to the horizon, in their order.
    pub fn counts(&self) -> impl Iterator<Item = usize> {
        self.series.iter().map(|s| s.data.values())
    }

    /// The loss of every residual, in the order of the residuals; without leverage weights.
    pub fn losses(&self) -> impl Iterator<Item = Loss> {
        self.series.iter().flat_map(|s| std::iter::repeat_n(s.loss, s.data.values()))
    }

    /// The modes whose frequencies were measured, in the order of the measurements.
    pub fn modes(&self) -> &[ModeName] {
        &self.required.modes
    }

    /// Whether the unknown with index `i` belongs to this experiment, so that its residuals depend on it.
    pub fn depends_on(&self, i: usize) -> bool {
        self.unknowns.contains(&i)
    }

    /// The parameters of the unknowns of this experiment other than those of the camera and of sensors, which do not
    /// change the motion of the rod.
    pub(super) fn motion_parameters(&self, unknowns: &[Unknown]) -> Vec<Parameter> {
        let own = self.unknowns.iter().map(|i| unknowns[*i].parameter);
        own.filter(|p| !p.is_of_the_recording()).collect()
    }

    /// The problem with the parameters at `point`, and the number of time steps up to the last sample; zero without a
    /// measured motion. The mesh layout and the step size stay. The motion lasts longer than the scene, by whole steps,
    /// where the clock or the row delay of the camera, or the delay of a sensor, requires it. An error beyond
    /// [`MAX_DURATION_RATIO`] times the duration of scene or recording.
    pub(super) fn problem_and_steps(
        &self,
        ParameterPoint { unknowns, x }: ParameterPoint,
    ) -> Result<(Problem, usize), Error> {
        let own =
            self.unknowns.iter().map(|i| (unknowns[*i].parameter, unknowns[*i].from_scale(x[*i])));
        let mut problem = self.problem.with_fixed_layout(own)?;
        if !self.required.has_motion() {
            return Ok((problem, 0));
        }
        let time = problem.time()?;
        // The clock of the camera may be ahead of that of the motion: the last sample determines the end.
        let Requirements { last_recorded, recorded_range, last_read, last_delayed, .. } =
            &self.required;
        let camera = problem.scene().camera;
        let end = match camera.row_delay == [0.0; 3] {
            true => camera.time_of_motion(*last_recorded),
            false => View::new(&problem, |_, x| x).latest_time(*last_recorded, recorded_range),
        };
        let of_sensor = |last: &DelayedReading| {
            let sensor = problem.scene().sensors.iter().find(|own| own.name == last.sensor);
            last.time - sensor.map_or(0.0, |sensor| sensor.delay)
        };
        let end = last_delayed.iter().map(of_sensor).fold(end.max(*last_read), f64::max);
        let last_delayed = last_delayed.iter().map(|last| last.time).fold(*last_recorded, f64::max);
        let longest = MAX_DURATION_RATIO * time.end.max(last_delayed);
        if end > longest {
            let words = "camera.time_offset, camera.time_scale, camera.row_delay or the delay of a sensor requires a longer motion \
                         than allowed";
            return Err(Error::Fit(format!("{words} ({end:.3e} s, at most {longest:.3e} s)")));
        }
        let steps = ((end / time.step_size() - 1e-9).ceil().max(1.0)) as usize;
        if end > time.end * (1.0 + 1e-9) {
            // Whole steps: a last step cut to the clock's offset would make the residuals depend on that cut.
            let end = steps as f64 * time.step_size();
            problem = problem.lasting(end);
        }
        let steps = steps.min(problem.time()?.steps());
        Ok((problem, steps))
    }

    /// Simulates the experiment at `point`: the motion up to its last sample on the camera's clock, the equilibrium,
    /// and the equilibria of load cases, each if a measurement requires it. With `derived`, they carry derivatives by
    /// the parameters of the unknowns that change the rod. `count` receives the work, steps times segments, of a motion
    /// also if it fails; a static solution counts as 20 steps. For one rod `after` is called at the start of the motion
    /// and after every step. Error: a simulation that fails, or values that the scene does not allow.
    pub fn run(
        &self,
        point: ParameterPoint,
        derived: bool,
        count: impl Fn(f64),
        after: &mut dyn FnMut(&Problem, &dyn Snapshot),
    ) -> Result<ExperimentRun, Error> {
        let (problem, steps) = self.problem_and_steps(point)?;
        let parameters = if derived { self.motion_parameters(point.unknowns) } else { Vec::new() };
        if let Some(structure) = structure_of(&problem)? {
            return self.run_structure(problem, structure, steps, &parameters, count);
        }
        let mut moving = None;
        if self.required.has_motion() {
            let Requirements { moving: points, moving_tangents, beside, .. } = &self.required;
            let strained = strained_edges(&self.required.moving_strains, &problem)?;
            let tracked = nodes_and_tangents(points, moving_tangents, &strained, &problem)?;
            let mut trajectory = Trajectory::new(&problem, &tracked, &parameters)?
                .keep_axes(&edges(beside, strained, &problem)?);
            if self.required.moving_reactions {
                trajectory = trajectory.keep_reactions();
            }
            // Work counts also where the run fails, so that failed trials are not free.
            let outcome = trajectory.run(&problem, steps, |simulation| after(&problem, simulation));
            let steps = trajectory.work().steps + usize::from(outcome.is_err());
            count((steps * problem.segments()) as f64);
            outcome?;
            moving = Some(trajectory);
        }
        // Static solutions count as a fixed number of time steps.
        count(self.rest_work);
        // Shapes without arc lengths need all nodes, others only those of their points.
        let strained = strained_edges(&self.required.resting_strains, &problem)?;
        let resting = match self.required.whole_rest {
            true => Some((0..problem.nodes()).collect()),
            false if self.required.is_at_rest() => {
                let Requirements { resting, resting_tangents, .. } = &self.required;
                Some(nodes_and_tangents(resting, resting_tangents, &strained, &problem)?)
            }
            false => None,
        };
        let at_rest = |nodes: Vec<usize>| {
            let edges = edges(&self.required.beside_at_rest, strained, &problem)?;
            let trajectory = Trajectory::new(&problem, &nodes, &parameters)?.keep_axes(&edges);
            match self.required.resting_reactions {
                true => trajectory.keep_reactions().find_equilibrium(),
                false => trajectory.find_equilibrium(),
            }
        };
        let resting = resting.map(at_rest).transpose()?;
        let load_cases = self.load_case_equilibria(&problem, &parameters)?;
        Ok(ExperimentRun { problem, moving, resting, load_cases, structure: None })
    }

    /// Whether a critical load was measured.
    pub(super) fn has_critical_loads(&self) -> bool {
        !self.required.buckling_cases.is_empty()
    }

    /// The critical loads of the required cases, in their order, in the units of the loads, with derivatives by
    /// `parameters`. Those by other loads are scaled to the numbers in the scene of `problem` ([`load_ratio`]). Error:
    /// one cannot be found.
    fn critical_loads(
        &self,
        problem: &Problem,
        parameters: &[Parameter],
    ) -> Result<Vec<CriticalLoad>, Error> {
        let critical = |case: &BucklingCase| {
            let posed = problem.with_fixed_layout(self.other_loads(case.load))?;
            let mut found = posed.critical_load(case.load, case.expected, parameters)?;
            for (load, value) in self.other_loads(case.load) {
                let derivatives = parameters.iter().zip(&mut found.derivatives);
                let by_load = derivatives.filter(|(parameter, _)| **parameter == load);
                by_load.for_each(|(_, x)| *x *= load_ratio(problem, load, value));
            }
            Ok(found)
        };
        self.required.buckling_cases.iter().map(critical).collect()
    }

    /// The loads that the scene has only while the mesh is chosen, but for `load`, with the values of the scene itself:
    /// a test with one load has the others as the scene has them.
    fn other_loads(&self, load: Parameter) -> impl Iterator<Item = (Parameter, f64)> {
        let others = self.own_loads.iter().filter(move |other| other.load != load);
        others.map(|OwnLoad { load, value }| (*load, *value))
    }

    /// The equilibria of the required load cases, in their order, with derivatives by `parameters`. Those of one
    /// measurement are computed in sequence: each starts at the one before. The derivative by the number of a load in
    /// the scene is that of a common relative error of all its values. So it is multiplied by the ratio of the value in
    /// the case to that in the scene ([`load_ratio`]).
    fn load_case_equilibria(
        &self,
        problem: &Problem,
        parameters: &[Parameter],
    ) -> Result<Vec<Trajectory>, Error> {
        let mut equilibria = Vec::with_capacity(self.required.load_cases.len());
        for series in &self.series {
            let cases = series.data.requirements().load_cases;
            let Some(LoadCase { point, .. }) = cases.first() else { continue };
            let tracked: Vec<usize> = problem.nodes_around(*point)?.collect();
            let loads =
                |case: &LoadCase| self.other_loads(case.load).chain([(case.load, case.value)]);
            let under_load = |case: &LoadCase| problem.with_fixed_layout(loads(case));
            let problems = cases.iter().map(under_load).collect::<Result<Vec<_>, Error>>()?;
            let mut own = Trajectory::load_path(&problems, &tracked, parameters)?;
            // All values of a load are proportional to its number in the scene: an error of it scales all of them.
            for (equilibrium, case) in own.iter_mut().zip(&cases) {
                for (load, value) in loads(case) {
                    equilibrium.scale_derivatives(load, load_ratio(problem, load, value));
                }
            }
            equilibria.extend(own);
        }
        Ok(equilibria)
    }

    /// The plain residuals `(simulated - measured)/sigma` of a `run` at the point, in the order of measurements and
    /// values. If `derived` also the rows of their Jacobian by all unknowns of the fit on their scales (zero for those
    /// of other experiments); else no rows. Natural frequencies are computed here. Errors: points that are not on the
    /// rod, times after the end of the simulation, and a frequency or critical load that cannot be computed.
    pub fn residuals_and_jacobian(
        &self,
        run: &ExperimentRun,
        ParameterPoint { unknowns, x }: ParameterPoint,
        derived: bool,
    ) -> Result<(Vec<f64>, Vec<Vec<f64>>), Error> {
        // The motion has forward derivatives only by parameters that change the rod.
        let parameters = if derived { self.motion_parameters(unknowns) } else { Vec::new() };
        let natural_frequencies = match self.modes().is_empty() {
            true => Vec::new(),
            false => match &run.structure {
                Some(structure) => structure_frequencies(structure, self.modes(), &parameters)?,
                None => run.problem.natural_frequencies(self.modes(), &parameters)?,
            },
        };
        let frequencies: Vec<f64> = natural_frequencies.iter().map(|t| t.frequency_rad_s).collect();
        let critical_loads = self.critical_loads(&run.problem, &parameters)?;
        let structure = run.structure.as_ref().map(Structure::nodes);
        let reference_strains = self.reference_strains(&run.problem, |_, x| x);
        let simulated = SimulatedOutput {
            moving: run.moving.as_ref().map(|motion| motion.record().read()),
            resting: run.resting.as_ref().map(|rest| rest.record().read()),
            frequencies: &frequencies,
            load_cases: &run.load_cases.iter().map(|own| own.record().read()).collect::<Vec<_>>(),
            critical_loads: &critical_loads.iter().map(|own| own.value).collect::<Vec<_>>(),
            view: &View::new(&run.problem, |_, value| value),
            scene: run.problem.scene(),
            mesh: &run.problem.scene().made_mesh(),
            reference_strains: reference_strains.as_ref(),
            structure: structure.as_ref(),
        };
        let mut residuals = Vec::with_capacity(self.counts().sum());
        self.for_each_residual(&simulated, |r: f64, _| residuals.push(r))?;
        // A plain evaluation ends here: derivatives cost a pass per unknown.
        if !derived {
            return Ok((residuals, Vec::new()));
        }
        // One pass over the residuals in dual numbers for each unknown: a column of the Jacobian.
        let mut rows = vec![vec![0.0; unknowns.len()]; residuals.len()];
        for i in &self.unknowns {
            let unknown = &unknowns[*i];
            let seed = |p, value| Dual64::new(value, f64::from(p == unknown.parameter));
            let track = parameters.iter().position(|p| *p == unknown.parameter);
            let slope = unknown.slope(unknown.from_scale(x[*i]));
            let rate = |t: &NaturalFrequency| track.map_or(0.0, |track| t.derivatives[track]);
            // Frequencies and motion carry the derivative along this unknown; camera and scene are seeded by it.
            let frequencies: Vec<Dual64> = natural_frequencies
                .iter()
                .map(|t| Dual64::new(t.frequency_rad_s, rate(t)))
                .collect();
            let slope_of = |own: &CriticalLoad| track.map_or(0.0, |track| own.derivatives[track]);
            let critical_loads: Vec<Dual64> =
                critical_loads.iter().map(|own| Dual64::new(own.value, slope_of(own))).collect();
            let scene = run.problem.scene().over_parameters(seed);
            let of_path = |path: &str, value, _| seed(Parameter::at(path), value);
            let structure = match &run.structure {
                Some(structure) => Some(structure.nodes_over(of_path)?),
                None => None,
            };
            let reference_strains = self.reference_strains(&run.problem, seed);
            let simulated = SimulatedOutput {
                moving: run.moving.as_ref().map(|motion| motion.record().along(track)),
                resting: run.resting.as_ref().map(|rest| rest.record().along(track)),
                frequencies: &frequencies,
                load_cases: &run
                    .load_cases
                    .iter()
                    .map(|own| own.record().along(track))
                    .collect::<Vec<_>>(),
                critical_loads: &critical_loads,
                view: &View::new(&run.problem, seed),
                scene: &scene,
                mesh: &scene.made_mesh(),
                reference_strains: reference_strains.as_ref(),
                structure: structure.as_ref(),
            };
            let mut row = rows.iter_mut();
            self.for_each_residual(&simulated, |r: Dual64, _| {
                if let Some(row) = row.next() {
                    row[*i] = r.eps * slope;
                }
            })?;
        }
        Ok((residuals, rows))
    }

    /// Calls `each` with every plain residual (without robust loss and leverage weight) `(simulated - measured)/sigma`
    /// and its loss, in the order of measurements and values. An error for points that are not on the rod and times
    /// after the end of the simulation.
    pub fn for_each_residual<D: GaugeScalar>(
        &self,
        simulated: &SimulatedOutput<D>,
        mut each: impl FnMut(D, Loss),
    ) -> Result<(), Error> {
        let SimulatedOutput { mut frequencies, mut load_cases, mut critical_loads, .. } =
            *simulated;
        for ObservedSeries { data, weights, loss } in &self.series {
            // Frequencies, load cases and critical loads of all measurements are solved together: each takes its own.
            let required = data.requirements();
            let own = frequencies.split_off(..required.modes.len()).unwrap_or_default();
            let own_cases = load_cases.split_off(..required.load_cases.len()).unwrap_or_default();
            let own_loads =
                critical_loads.split_off(..required.buckling_cases.len()).unwrap_or_default();
            let simulated = SimulatedOutput {
                frequencies: own,
                load_cases: own_cases,
                critical_loads: own_loads,
                ..*simulated
            };
            let mut weights = weights.iter().copied();
            data.differences(&simulated, &mut |difference| {
                if let Some(weight) = weights.next() {
                    each(difference * weight, *loss);
                }
            })?;
        }
        Ok(())
    }
}

/// Whether any time step of a motion was halved, as where it did not converge: at least as many steps were taken as
/// there are recorded times. These are the start and the ends of the scene's steps.
pub(super) fn has_halved_steps(motion: &Trajectory) -> bool {
    motion.record().taken.len() >= motion.times().len()
}

/// Indices of the nodes on which the positions of `points` depend, ascending, each once. A point at a node depends on
/// its neighbors too, because it moves between nodes when the length of the rod changes. An error for points that are
/// not on the rod.
pub(super) fn nodes(points: &[Point], problem: &Problem) -> Result<Vec<usize>, Error> {
    let mut nodes = BTreeSet::new();
    for point in points {
        nodes.extend(problem.nodes_around(*point)?);
    }
    Ok(nodes.into_iter().collect())
}

/// Indices of the nodes on which the positions of `points`, the edges around `tangents` and the edges `strained`
/// depend, ascending, each once. An error for points that are not on the rod.
fn nodes_and_tangents(
    points: &[Point],
    tangents: &[Point],
    strained: &BTreeSet<usize>,
    problem: &Problem,
) -> Result<Vec<usize>, Error> {
    let mut all: BTreeSet<usize> = nodes(points, problem)?.into_iter().collect();
    for point in tangents {
        let edges = problem.edges_around(*point)?;
        all.extend(edges.start..=edges.end);
    }
    all.extend(strained.iter().flat_map(|edge| [*edge, edge + 1]));
    Ok(all.into_iter().collect())
}

/// Indices of the edges whose axes the markers beside `points` depend on, and of the edges `strained`, ascending, each
/// once. An error for points that are not on the rod.
fn edges(
    points: &[Point],
    strained: BTreeSet<usize>,
    problem: &Problem,
) -> Result<Vec<usize>, Error> {
    let mut edges = strained;
    for point in points {
        edges.extend(problem.edges_around(*point)?);
    }
    Ok(edges.into_iter().collect())
}

/// Indices of the edges on which curvature and strain at `points` depend. An error for points that are not on the rod.
fn strained_edges(points: &[Point], problem: &Problem) -> Result<BTreeSet<usize>, Error> {
    let mut edges = BTreeSet::new();
    if !points.is_empty() {
        let reference = problem.reference_strains(|_, x| x);
        for point in points {
            edges.extend(reference.edges_around(problem.arc_length(*point)?));
        }
    }
    Ok(edges)
}
