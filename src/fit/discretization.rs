//! The error that mesh and step leave in the identified parameters.
//!
//! The statistical interval knows nothing of it: it can only be seen by refining. The mesh and the
//! step are halved, one at a time; how far the parameters move, twice, is an estimate on the safe
//! side: the whole error of a first-order method, one and a half times that of a second-order one,
//! mesh and step never cancelling.

use super::analysis::Refinement;
use super::search::{Optimum, Search, Task};
use super::uncertainty::Local;
use super::{Observation, Unknown};
use crate::error::Error;
use crate::parameter::Parameter;
use crate::point::Point;
use crate::problem::Problem;
use serde::Serialize;

/// Error over change when a step is halved: one for first order, at second order a third is there
/// for what the estimate does not see.
const FACTOR: f64 = 2.0;

/// The discretisation error of an identified parameter.
#[derive(Clone, Debug, Serialize)]
pub struct DiscretizationError {
    /// Which.
    pub name: Parameter,
    /// Error over the value; none where the parameter is not identifiable.
    pub relative: Option<f64>,
    /// The part of the mesh; none where the scene fixes its mesh.
    pub mesh: Option<f64>,
    /// The part of the step; none where the fit identifies beta, whose meaning goes with the step.
    pub step: Option<f64>,
}

/// The scene with twice as many edges, if its mesh is its own choice.
fn finer_mesh(problem: &Problem) -> Result<Option<Problem>, Error> {
    let mut scene = problem.scene().clone();
    if scene.mesh_is_given() {
        return Ok(None);
    }
    scene.rod.segments = scene.rod.segments.map(|n| 2 * n);
    Ok(Some(scene.problem()?.with_derivatives(problem.derivatives())))
}

/// The scene with half the step, unless its beta is to be found.
fn finer_step(problem: &Problem, unknowns: &[Unknown]) -> Result<Option<Problem>, Error> {
    if unknowns.iter().any(|u| u.parameter == Parameter::Beta) {
        return Ok(None);
    }
    let mut scene = problem.scene().clone();
    if let Some(time) = &mut scene.time {
        time.step *= 0.5;
    }
    Ok(Some(scene.problem()?.with_derivatives(problem.derivatives())))
}

/// Observations of the same points on another mesh.
fn same_points(observations: &[Observation], problem: &Problem) -> Result<Vec<Observation>, Error> {
    let moved = |o: &Observation| {
        let point = match o.point {
            Point::Node(i) if i + 1 == problem.nodes() => Point::Tip,
            Point::Node(_) => {
                Point::ArcLength(problem.arc_length(o.point)?.clamp(0.0, problem.length()))
            }
            point => point,
        };
        Ok(Observation { point, ..o.clone() })
    };
    observations.iter().map(moved).collect()
}

/// How the unknowns move, on their scales, when the model of `task` becomes `finer`; and the work
/// that took.
fn change(
    task: Task,
    finer: &Problem,
    optimum: &Optimum,
    local: &Local,
    how: Refinement,
) -> Result<(Vec<Option<f64>>, f64), Error> {
    let observations = same_points(task.observations, task.problem)?;
    let search = Task { problem: finer, observations: &observations, ..task }.search();
    let moved = match how {
        Refinement::Refitted => {
            let there = search.polish(&optimum.x)?.x;
            let moved = there.iter().zip(&optimum.x).map(|(a, b)| a - b);
            moved.zip(&local.deviation).map(|(d, sd)| sd.map(|_| d)).collect()
        }
        _ => {
            let there = search.residuals(search.duration())?.residuals(&optimum.x)?;
            let change: Vec<f64> =
                there.iter().zip(&optimum.residuals).map(|(a, b)| a - b).collect();
            local.response(&optimum.jacobian, &change)
        }
    };
    Ok((moved, search.work.get()))
}

/// The discretisation error of every unknown.
pub(super) fn errors(
    search: &Search,
    optimum: &Optimum,
    local: &Local,
    how: Refinement,
) -> Result<Vec<DiscretizationError>, Error> {
    let (mesh, step) = (finer_mesh(search.problem)?, finer_step(search.problem, search.unknowns)?);
    let task = search.task();
    let part = |finer: &Option<Problem>| {
        finer.as_ref().map(|finer| change(task, finer, optimum, local, how)).transpose()
    };
    let (mesh, step) = rayon::join(|| part(&mesh), || part(&step));
    let moved = [mesh?, step?].map(|part| {
        part.map(|(moved, work)| {
            search.count(work);
            moved
        })
    });
    search.report("discretisation error");
    let error = |(i, unknown): (usize, &Unknown)| {
        let value = unknown.from_scale(optimum.x[i]);
        let relative = |part: &Option<Vec<Option<f64>>>| {
            let d = part.as_ref()?[i]?;
            // A change of the logarithm is a relative one.
            let size = if unknown.parameter.is_positive() { 1.0 } else { value.abs() };
            Some(FACTOR * (d / size).abs())
        };
        let (mesh, step) = (relative(&moved[0]), relative(&moved[1]));
        let known = mesh.is_some() || step.is_some();
        let relative = known.then_some(mesh.unwrap_or(0.0) + step.unwrap_or(0.0));
        DiscretizationError { name: unknown.parameter, relative, mesh, step }
    };
    Ok(search.unknowns.iter().enumerate().map(error).collect())
}
