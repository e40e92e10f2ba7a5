//! The error that mesh and step leave in the identified parameters.
//!
//! The statistical interval knows nothing of it: it can only be seen by refining. Mesh and step are
//! made finer by a quarter, one at a time, and the parameters' changes are carried on to zero as if
//! they were of first order. That is on the safe side: nearly twice the error of a second-order
//! method, and mesh and step never cancel. A quarter is enough, as nothing here is random; halving
//! covers no better and costs 4 simulations instead of 2.5
//! (`cargo run --release --example discretization_error -- 100`).

use super::analysis::Refinement;
use super::search::{Optimum, Search, Task};
use super::uncertainty::Local;
use super::{Observation, Unknown};
use crate::error::Error;
use crate::parameter::Parameter;
use crate::point::Point;
use crate::problem::Problem;
use serde::Serialize;

/// How much finer.
const FINER: f64 = 1.25;

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

/// A finer problem, and the error over the change it makes, at first order.
type Finer = (Problem, f64);

/// The error over the change when what it is proportional to becomes smaller by `ratio`.
fn to_zero(ratio: f64) -> f64 {
    1.0 / (1.0 - 1.0 / ratio)
}

/// The scene with more edges, if its mesh is its own choice.
fn finer_mesh(problem: &Problem) -> Result<Option<Finer>, Error> {
    let mut scene = problem.scene().clone();
    if scene.mesh_is_given() {
        return Ok(None);
    }
    let segments = (problem.segments() as f64 * FINER).round();
    scene.rod.segments = Some(segments as usize);
    let finer = scene.problem()?.computed_as(problem);
    Ok(Some((finer, to_zero(segments / problem.segments() as f64))))
}

/// The scene with a smaller step, unless its beta is to be found.
fn finer_step(problem: &Problem, unknowns: &[Unknown]) -> Result<Option<Finer>, Error> {
    if unknowns.iter().any(|u| u.parameter == Parameter::Beta) {
        return Ok(None);
    }
    let mut scene = problem.scene().clone();
    if let Some(time) = &mut scene.time {
        time.step /= FINER;
    }
    Ok(Some((scene.problem()?.computed_as(problem), to_zero(FINER))))
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

/// How far the unknowns, on their scales, are from those of the limit that the model `finer` than
/// that of `task` is on the way to; and the work that took.
fn change(
    task: Task,
    (finer, to_zero): &Finer,
    optimum: &Optimum,
    local: &Local,
    how: Refinement,
) -> Result<(Vec<Option<f64>>, f64), Error> {
    let observations = same_points(task.observations, task.problem)?;
    let search = Task { problem: finer, observations: &observations, ..task }.search();
    let moved: Vec<Option<f64>> = match how {
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
    let carried_on = moved.into_iter().map(|d| d.map(|d| d * to_zero));
    Ok((carried_on.collect(), search.work.get()))
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
    let part = |finer: &Option<Finer>| {
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
            Some((d / size).abs())
        };
        let (mesh, step) = (relative(&moved[0]), relative(&moved[1]));
        let known = mesh.is_some() || step.is_some();
        let relative = known.then_some(mesh.unwrap_or(0.0) + step.unwrap_or(0.0));
        DiscretizationError { name: unknown.parameter, relative, mesh, step }
    };
    Ok(search.unknowns.iter().enumerate().map(error).collect())
}
