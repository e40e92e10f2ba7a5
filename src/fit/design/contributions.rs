//! Contribution of each planned measurement: the standard errors by it alone, and by all others.

use crate::error::Error;
use crate::fit::design::candidate_designs::{CandidateDesigns, standard_errors};
use crate::fit::design::report::Contribution;
use crate::fit::measurement::experiment::Experiment;
use crate::fit::unknown::Unknown;

/// Names of the coordinates of a position.
const AXES: [&str; 3] = ["x", "y", "z"];

/// Rows of the Jacobian of a measurement or a coordinate.
struct Group {
    measurement: String,
    axis: String,
    rows: Vec<usize>,
}

/// The contributions of all measurements of a plan; empty where there is only one group of values. `rows` are those of
/// all choices, the priors at the end.
pub(crate) fn contributions(
    choices: &CandidateDesigns,
    planned: &[Experiment],
    (unknowns, x): (&[Unknown], &[f64]),
    rows: &[Vec<f64>],
) -> Result<Vec<Contribution>, Error> {
    let groups = groups(choices, planned);
    if groups.len() < 2 {
        return Ok(Vec::new());
    }
    let priors = &rows[choices.end()..];
    let by = |chosen: &dyn Fn(usize) -> bool| {
        let own = groups.iter().enumerate().filter(|(k, _)| chosen(*k));
        let mut kept: Vec<Vec<f64>> =
            own.flat_map(|(_, group)| &group.rows).map(|i| rows[*i].clone()).collect();
        kept.extend_from_slice(priors);
        standard_errors((unknowns, x), &kept)
    };
    let contribution = |(k, group): (usize, &Group)| {
        Ok(Contribution {
            measurement: group.measurement.clone(),
            axis: group.axis.clone(),
            values: group.rows.len(),
            std_error_alone: by(&|other| other == k)?,
            std_error_without: by(&|other| other != k)?,
        })
    };
    groups.iter().enumerate().map(contribution).collect()
}

/// The measurements of a plan, or the coordinates of its only one.
fn groups(choices: &CandidateDesigns, planned: &[Experiment]) -> Vec<Group> {
    let own: Vec<_> = choices.planned_blocks().collect();
    if let [block] = &own[..]
        && let Some(motion) = block.measurement.motion()
    {
        let measurement = planned[block.experiment].label(&block.measurement);
        let given = motion.samples.iter().flat_map(|sample| {
            (0..AXES.len()).filter(|c| sample.position[*c].is_some()).collect::<Vec<usize>>()
        });
        let axes: Vec<(usize, usize)> = block.rows.clone().zip(given).collect();
        let of = |c: usize| Group {
            measurement: measurement.clone(),
            axis: AXES[c].into(),
            rows: axes.iter().filter(|(_, axis)| *axis == c).map(|(row, _)| *row).collect(),
        };
        return (0..AXES.len()).map(of).filter(|group| !group.rows.is_empty()).collect();
    }
    let whole = own.iter().map(|block| Group {
        measurement: planned[block.experiment].label(&block.measurement),
        axis: String::new(),
        rows: block.rows.clone().collect(),
    });
    whole.collect()
}
