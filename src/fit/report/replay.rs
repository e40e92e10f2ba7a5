//! The part of the [data of plots](super::PlotData) from the residuals of an optimum and from one simulation at it.
//!
//! Input: a search, its optimum, and the reported noise of each measurement. [`static_plots`] needs no simulation:
//! search ranges, history, scan, settings, and per coordinate the observed and simulated values (observed plus
//! residual) in the unit of the data file. Without an optimum there are no such values. [`measurement_series`] makes
//! those of one measurement. [`add_motion`] simulates once more at the optimum (an equilibrium or a structure again for
//! all nodes). It adds the curves of the model between the data, over the recording's clock, s ([`CURVE`] intervals),
//! or the arc length, m. It also adds shapes of the rod in recorded coordinates: about [`SHAPES`] at evenly spaced
//! times, and the one at rest. A simulation that fails is an error; results before it remain.

use crate::dynamics::Trajectory;
use crate::error::{Error, GIVEN_AS_TEXT};
use crate::fit::measurement::Measurement;
use crate::fit::measurement::dataset::Coordinate;
use crate::fit::measurement::experiment::Experiment;
use crate::fit::measurement::motion::PointMotion;
use crate::fit::misfit::camera::View;
use crate::fit::misfit::observed_experiment::ExperimentRun;
use crate::fit::report::plot_data::{
    Measured, PlotData, RodShape, SearchRange, Series, SimulationSettings,
};
use crate::fit::search::Search;
use crate::fit::search::fitted::{Fitted, MeasuredResiduals};
use crate::fit::search::optimum::Optimum;
use crate::fit::structure::structure_run::{motion_at_rest, repeated_motion};
use crate::fit::unknown::Unknown;
use crate::problem::Problem;
use crate::scene::SchemeParameter;
use crate::structure::{NodeMotion, Structure};

/// Number of shapes of a moving rod, evenly spaced in time.
const SHAPES: usize = 12;
/// Number of intervals of the curve of a simulated coordinate over time.
const CURVE: usize = 400;
/// Largest number of fixed-point iterations for the time at which a row of a rolling shutter is read.
pub(crate) const ROW_ITERATIONS: usize = 20;

/// The data of plots without a simulation: search ranges, history, scan, settings, version, and the series at the
/// `optimum`, if there is one. `sigma` is the reported noise of each measurement, in its unit.
pub(crate) fn static_plots(search: &Search, optimum: Option<&Optimum>, sigma: &[f64]) -> PlotData {
    let range = |unknown: &Unknown| SearchRange {
        name: unknown.parameter,
        start: unknown.start,
        bounds: unknown.bounds,
    };
    PlotData {
        ranges: search.unknowns.iter().map(range).collect(),
        series: optimum.map_or(Vec::new(), |optimum| series(Fitted { search, optimum }, sigma)),
        history: search.journal.history(search.unknowns, &search.sigmas, search.full_work),
        landscape: search.journal.landscape(search.unknowns),
        settings: search.experiments.iter().map(settings).collect(),
        version: env!("CARGO_PKG_VERSION").into(),
        ..PlotData::default()
    }
}

/// The settings of the simulation of an experiment: scene file, model with its reason, number of edges, length and
/// measurements. Scheme with its parameter, step and end follow only with a measured motion.
fn settings(experiment: &Experiment) -> SimulationSettings {
    // Settings are shown on the page with the number of values of each measurement.
    let measured = |measurement: &Measurement| Measured {
        label: experiment.label(measurement),
        points: measurement.points(),
        values: measurement.values(),
        recording: measurement.header.recording.clone(),
    };
    let problem = &experiment.problem;
    let (model, reason) = match &problem.scene().structure {
        Some(structure) => ("structure", format!("{} rods in a plane", structure.rods.len())),
        None => {
            let (model, reason) = problem.model();
            (model, reason.to_string())
        }
    };
    let moves = experiment.moves();
    // Experiments at rest have no scheme and no step, even if their scene has.
    let time = problem.scene().time.as_ref().filter(|_| moves);
    let scene_file = problem.scene().path.as_ref().filter(|path| !path.ends_with(GIVEN_AS_TEXT));
    SimulationSettings {
        experiment: experiment.name.clone(),
        scene: scene_file.map(|path| path.display().to_string()),
        model: format!("{model}: {reason}"),
        scheme: time.map(|time| {
            let name = time.scheme.name();
            match time.scheme.traits().parameter {
                Some(SchemeParameter::Beta) => format!("{name}, beta = {}", time.beta),
                Some(SchemeParameter::RhoInf) => format!("{name}, rho_inf = {}", time.rho_inf),
                None => name.to_string(),
            }
        }),
        step: time.and_then(|time| time.step),
        end: time.map(|time| time.end),
        segments: problem.segments(),
        length: problem.length(),
        observations: experiment.measurements.iter().map(Measurement::label).collect(),
        measurements: experiment.measurements.iter().map(measured).collect(),
    }
}

/// Observed and simulated values of all measurements at an optimum, one series per coordinate, in the order of the
/// measurements. `sigma` is the reported noise of each measurement, in its unit.
fn series(fitted: Fitted, sigma: &[f64]) -> Vec<Series> {
    let mut all = Vec::new();
    for (own, sigma) in fitted.measured().zip(sigma) {
        let MeasuredResiduals { experiment, measurement, residuals, .. } = own;
        let own =
            measurement_series(&experiment.problem, measurement, residuals, own.sigma, *sigma);
        all.extend(own.into_iter().map(|s| Series { experiment: experiment.name.clone(), ..s }));
    }
    all
}

/// Observed and simulated values of a measurement, one series per coordinate, in the unit of its file, without curve
/// and name of the experiment. A simulated value is the observed one plus its residual times its standard deviation:
/// `residual_sigma` times the factor of the value. `residuals` are those of the first values up to a horizon; later
/// values are left out. `sigma` is the reported noise.
pub(crate) fn measurement_series(
    problem: &Problem,
    measurement: &Measurement,
    residuals: &[f64],
    residual_sigma: f64,
    sigma: f64,
) -> Vec<Series> {
    let observed = measurement.values_in_order();
    // No simulation is needed: the simulated value is the observed one plus its residual.
    let sigmas = measurement.sigmas(residual_sigma);
    let unit = measurement.data_unit();
    let series = |coordinate: Coordinate| {
        let own = || coordinate.first_values(residuals.len());
        let simulated = |k: usize| (observed[k] + residuals[k] * sigmas[k]) / unit.size;
        Series {
            experiment: String::new(),
            label: measurement.label(),
            axis: coordinate.axis.into(),
            unit: unit.name.into(),
            abscissa: measurement.abscissa(),
            abscissa_values: own().map(|value| value.abscissa).collect(),
            observed: own().map(|value| observed[value.index] / unit.size).collect(),
            simulated: own().map(|value| simulated(value.index)).collect(),
            sigma: sigma / unit.size,
            curve: Vec::new(),
        }
    };
    measurement.coordinates(problem).into_iter().map(series).collect()
}

/// Simulates every fitted experiment at `x`, the unknowns on their scales, and adds the results to `plots`, in recorded
/// coordinates. These are the curves of the model in the series of motions, and of shapes at rest of one rod. Shapes of
/// the rod follow: about [`SHAPES`] at evenly spaced times of a motion, and the one at rest. `plots` must have the
/// series of [`static_plots`] in their order. Results before an error remain.
pub(crate) fn add_motion(search: &Search, x: &[f64], plots: &mut PlotData) -> Result<(), Error> {
    let residuals = search.all_residuals()?;
    let mut all = plots.series.iter_mut();
    for (k, experiment) in search.experiments.iter().enumerate() {
        let mut moving: Vec<RodShape> = Vec::new();
        // Shapes are taken at the first steps after evenly spaced times.
        let run = residuals.run(k, x, false, &mut |problem, simulation| {
            let end = problem.scene().camera.time_of_motion(experiment.duration());
            let next = end * moving.len() as f64 / (SHAPES - 1) as f64;
            if simulation.time() >= next * (1.0 - 1e-9) {
                moving.push(RodShape {
                    experiment: experiment.name.clone(),
                    time: Some(simulation.time()),
                    nodes: (0..problem.nodes()).map(|i| simulation.position(i)).collect(),
                });
            }
        })?;
        // Plots are in recorded coordinates, like the data.
        let view = View::new(&run.problem, |_, value: f64| value);
        for shape in &mut moving {
            shape.nodes.iter_mut().for_each(|x| *x = view.pictured(*x));
        }
        plots.shapes.extend(structure_shapes(experiment, &run, &view)?);
        plots.shapes.extend(moving);
        let resting = equilibrium_shape(experiment, &run, &view)?;
        for measurement in &experiment.measurements {
            let curves = match (measurement.motion(), measurement.shape(), &resting) {
                (Some(own), ..) => motion_curves(own, &run, &view)?,
                // A shape at rest is a curve over the arc length, through all nodes; markers beside it are not on the
                // curve.
                (_, Some(own), Some(shape)) if !own.is_beside() => [0, 1, 2].map(|c| {
                    let points = run.problem.arc_lengths().iter().zip(&shape.nodes);
                    points.map(|(s, x)| [*s, x[c]]).collect()
                }),
                _ => CoordinateCurves::default(),
            };
            // Every coordinate takes the next series, also those without a curve, as frequencies.
            for coordinate in measurement.coordinates(&experiment.problem) {
                let axis = ["x", "y", "z"].iter().position(|axis| *axis == coordinate.axis);
                if let (Some(series), Some(c)) = (all.next(), axis) {
                    series.curve = curves[c].clone();
                }
            }
        }
        plots.shapes.extend(resting);
    }
    Ok(())
}

/// Curves of x, y and z: pairs of abscissa (s or m) and value, m.
type CoordinateCurves = [Vec<[f64; 2]>; 3];

/// The simulated x, y and z of a recorded point, m, as the camera records them, over the clock of its recording, s.
/// There are [`CURVE`] intervals between its first and last sample. The last state stands for times after the end of
/// the simulation. Empty without a simulated motion. Error: a point outside the rod or the structure.
fn motion_curves(
    own: &PointMotion,
    run: &ExperimentRun,
    view: &View<f64>,
) -> Result<CoordinateCurves, Error> {
    let mut curves = CoordinateCurves::default();
    let Some(trajectory) = &run.moving else { return Ok(curves) };
    let nodes = run.structure.as_ref().map(Structure::nodes);
    let marker = own.stencil(&run.problem.scene().made_mesh(), nodes.as_ref())?;
    let end = trajectory.times().last().copied().unwrap_or(0.0);
    let times = own.samples.iter().map(|s| s.time);
    let (first, last) = times.fold((f64::MAX, 0.0_f64), |(a, b), t| (a.min(t), b.max(t)));
    for k in 0..=CURVE {
        // The abscissa is that of the data, the recording's clock, which may have an offset.
        let clock = first + (last - first) * k as f64 / CURVE as f64;
        let mut pictured = [0.0; 3];
        let mut time = view.time(clock).min(end);
        // The row in which the point is read, and with it the time, follows from the position.
        for _ in 0..ROW_ITERATIONS {
            pictured = view.pictured(trajectory.record().read().marker(&marker, time)?);
            let in_row = view.sample_time(clock, &pictured.map(Some)).min(end);
            if in_row == time {
                break;
            }
            time = in_row;
        }
        for (curve, x) in curves.iter_mut().zip(pictured) {
            curve.push([clock, x]);
        }
    }
    Ok(curves)
}

/// Shapes of a structure in recorded coordinates, one per rod: at [`SHAPES`] evenly spaced steps of the motion, and at
/// rest, each if a measurement requires it. Motion and equilibrium are computed again for all nodes. Empty for a scene
/// of one rod. Errors are those of the repeated steps and of the equilibrium.
fn structure_shapes(
    experiment: &Experiment,
    run: &ExperimentRun,
    view: &View<f64>,
) -> Result<Vec<RodShape>, Error> {
    let Some(structure) = &run.structure else { return Ok(Vec::new()) };
    let all: Vec<usize> = (0..structure.nodes().rod_nodes()).collect();
    let mut shapes = Vec::new();
    let mut add = |time: Option<f64>, motions: &[NodeMotion<f64>]| {
        let mut first = 0;
        for mesh in &structure.at_rest().meshes {
            let own = &motions[first..first + mesh.nodes.len()];
            first += mesh.nodes.len();
            let nodes = own.iter().map(|[position, _]| view.pictured(*position)).collect();
            shapes.push(RodShape { experiment: experiment.name.clone(), time, nodes });
        }
    };
    if let Some(moving) = &run.moving {
        let (times, taken) = (moving.times(), &moving.record().taken);
        let plain = |_: &str, value: f64, _| value;
        // The run has recorded the nodes of the measurements only; shapes need all nodes.
        let motions = repeated_motion(structure, &all, times, taken, plain)?;
        for k in 0..SHAPES {
            let step = k * (times.len() - 1) / (SHAPES - 1);
            add(Some(times[step]), &motions[step * all.len()..(step + 1) * all.len()]);
        }
    }
    if run.resting.is_some() {
        add(None, &motion_at_rest(structure, &all, |_, value, _| value)?);
    }
    Ok(shapes)
}

/// The shape of the rod in equilibrium, all nodes in recorded coordinates, by a further static solution; `None` if no
/// measurement requires it, and for structures. Errors are those of the equilibrium.
fn equilibrium_shape(
    experiment: &Experiment,
    run: &ExperimentRun,
    view: &View<f64>,
) -> Result<Option<RodShape>, Error> {
    if run.resting.is_none() || run.structure.is_some() {
        return Ok(None);
    }
    let nodes: Vec<usize> = (0..run.problem.nodes()).collect();
    // The run has the nodes of the measurements only; the shape needs all.
    let rest = Trajectory::at_rest(&run.problem, &nodes, &[])?;
    let nodes = nodes.iter().map(|i| view.pictured(rest.node(*i, 0))).collect();
    Ok(Some(RodShape { experiment: experiment.name.clone(), time: None, nodes }))
}
