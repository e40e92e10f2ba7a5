//! Simulation of an experiment whose scene is a structure: its motion and equilibrium at the points of measurements.
//!
//! Input: an [`ObservedExperiment`], its problem and structure, a number of steps, and parameters. The nodes on which
//! the positions of measured points depend are recorded. `run_structure` simulates the motion if one is measured, and
//! solves the equilibrium if a measurement at rest requires it. Output: [`ExperimentRun`] with the two records (`None`
//! if not required) and their derivatives by the parameters; the work (steps times edges) is added by a callback.
//! `structure_over` computes both records again over another number type, from numbers of the scene with derivatives.
//! Points that the structure does not have are errors (`check_structure_points`).

use crate::dynamics::record::Record;
use crate::error::Error;
use crate::fit::misfit::observed_experiment::{ExperimentRun, ObservedExperiment};
use crate::fit::structure::structure_problem::structure_of;
use crate::fit::structure::structure_run::{
    equilibrium, motion_at_rest, repeated_motion, simulated_motion,
};
use crate::numerics::scalar::RodScalar;
use crate::problem::Problem;
use crate::scene::Parameter;
use crate::scene::number::Quantity;
use crate::scene::structure_point::StructurePoint;
use crate::structure::Structure;
use std::collections::BTreeSet;

/// The nodes on which the positions of `points` of a structure depend, ascending, each once. An error for a point that
/// the structure does not have.
fn nodes_of(structure: &Structure, points: &[StructurePoint]) -> Result<Vec<usize>, Error> {
    let mut tracked = BTreeSet::new();
    let nodes = structure.nodes();
    for point in points {
        tracked.extend(nodes.around(point, "observation.point")?);
    }
    Ok(tracked.into_iter().collect())
}

impl ObservedExperiment {
    /// Rejects observed points, in motion or at rest, that the structure of its problem does not have; nothing is
    /// checked for a scene of one rod.
    pub(super) fn check_structure_points(&self) -> Result<(), Error> {
        if let Some(structure) = structure_of(&self.problem)? {
            nodes_of(&structure, &self.required.moving_places)?;
            nodes_of(&structure, &self.required.resting_places)?;
        }
        Ok(())
    }

    /// Simulates a structure: the motion over a number of `steps`, and the equilibrium, each if a measurement requires
    /// it, with derivatives by `parameters`. `count` is called with the work, steps times edges, of the motion, and
    /// with that of the static solutions. Error: a simulation that fails.
    pub(super) fn run_structure(
        &self,
        problem: Problem,
        structure: Structure,
        steps: usize,
        parameters: &[Parameter],
        count: impl Fn(f64),
    ) -> Result<ExperimentRun, Error> {
        let edges = problem.segments();
        let mut moving = None;
        if self.required.has_motion() {
            let tracked = nodes_of(&structure, &self.required.moving_places)?;
            let count = |steps: usize| count((steps * edges) as f64);
            moving =
                Some(simulated_motion(&problem, &structure, &tracked, steps, parameters, count)?);
        }
        // Static solutions count as a fixed number of time steps.
        count(self.rest_work());
        let mut resting = None;
        if self.required.is_at_rest() {
            let tracked = nodes_of(&structure, &self.required.resting_places)?;
            resting = Some(equilibrium(&problem, &structure, &tracked, parameters)?);
        }
        // Structures have no load-deflection curves.
        let load_cases = Vec::new();
        Ok(ExperimentRun { problem, structure: Some(structure), moving, resting, load_cases })
    }
}

impl ExperimentRun {
    /// The records of the motion and of the equilibrium of this run of a `structure`, computed again over another
    /// number type; `None` where the run has none. `seed` returns the number for a path, value and quantity of the
    /// scene. The motion repeats the steps of this run. Errors are those of the steps and of the equilibrium.
    pub(super) fn structure_over<D: RodScalar>(
        &self,
        structure: &Structure,
        mut seed: impl FnMut(&str, f64, Quantity) -> D,
    ) -> Result<[Option<Record<D>>; 2], Error> {
        let mut records = [None, None];
        if let Some(moving) = &self.moving {
            let plain = moving.record();
            let (tracked, times) = (plain.tracked(), plain.times());
            // The plain run has determined the steps, halved ones included; this run repeats them.
            let motions = repeated_motion(structure, &tracked, times, &plain.taken, &mut seed)?;
            let mut record = Record::new(tracked.clone(), 0);
            for (time, own) in times.iter().zip(motions.chunks(tracked.len().max(1))) {
                record.push(*time, own.iter().copied());
            }
            records[0] = Some(record);
        }
        if let Some(resting) = &self.resting {
            let tracked = resting.record().tracked();
            let mut record = Record::new(tracked.clone(), 0);
            record.push(0.0, motion_at_rest(structure, &tracked, &mut seed)?.into_iter());
            records[1] = Some(record);
        }
        Ok(records)
    }
}
