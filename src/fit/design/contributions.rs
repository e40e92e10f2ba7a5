//! Contribution of each planned measurement to the expected uncertainty: the standard errors by it alone, and by all
//! others.
//!
//! Input: the rows of the Jacobian of a plan in units of the noise, and those of the priors. Each group of rows is
//! kept alone or left out, always with the priors. A group is a measurement, or a measured coordinate of the only one
//! if that is a motion. The standard errors follow from the covariance of the remaining rows ([`standard_errors`]):
//! one per unknown in its unit, none if unidentified. [`contributions`] returns one entry per group, in the order of
//! the plan, an empty list for fewer than two groups, or an error if a covariance cannot be computed. The report of a
//! plan shows which measurement determines which parameter.

use crate::error::Error;
use crate::fit::design::candidate_designs::{CandidateDesigns, standard_errors};
use crate::fit::design::report::Contribution;
use crate::fit::measurement::experiment::Experiment;
use crate::fit::unknown::ParameterPoint;

/// Names of the coordinates of a position, in the order of its components.
const AXES: [&str; 3] = ["x", "y", "z"];

/// Rows of the Jacobian of a measurement, or of one of its coordinates.
struct RowGroup {
    /// Label of the measurement.
    measurement: String,
    /// x, y or z; empty for a whole measurement.
    axis: String,
    /// Indices of the rows in the common Jacobian.
    rows: Vec<usize>,
}

/// The contributions of all groups of a plan at `point`, in their order; empty for fewer than two groups. `rows` are
/// the Jacobian of all candidates in units of the noise, then those of the priors. Each contribution has the standard
/// errors by the rows of its group alone and by those of all other groups, both with the priors. Standard errors are
/// one per unknown in its unit, none if unidentified. Error: a covariance cannot be computed.
pub(crate) fn contributions(
    designs: &CandidateDesigns,
    planned: &[Experiment],
    point: ParameterPoint,
    rows: &[Vec<f64>],
) -> Result<Vec<Contribution>, Error> {
    let groups = row_groups(designs, planned);
    if groups.len() < 2 {
        return Ok(Vec::new());
    }
    // Priors constrain the parameters with every group of values.
    let priors = &rows[designs.end()..];
    let errors_by = |is_chosen: &dyn Fn(usize) -> bool| {
        let own = groups.iter().enumerate().filter(|(k, _)| is_chosen(*k));
        let mut kept: Vec<Vec<f64>> =
            own.flat_map(|(_, group)| &group.rows).map(|i| rows[*i].clone()).collect();
        kept.extend_from_slice(priors);
        standard_errors(point, &kept)
    };
    // A group that others replace has small errors without it; one that alone determines a parameter has none.
    let contribution = |(k, group): (usize, &RowGroup)| {
        Ok(Contribution {
            measurement: group.measurement.clone(),
            axis: group.axis.clone(),
            values: group.rows.len(),
            std_error_alone: errors_by(&|other| other == k)?,
            std_error_without: errors_by(&|other| other != k)?,
        })
    };
    groups.iter().enumerate().map(contribution).collect()
}

/// The rows of every measurement of a plan, as indices in the common Jacobian. A plan of a single measurement that is a
/// motion has a group per measured coordinate instead, in the order x, y, z.
fn row_groups(designs: &CandidateDesigns, planned: &[Experiment]) -> Vec<RowGroup> {
    let own: Vec<_> = designs.planned_blocks().collect();
    // Several measurements are compared with each other. A single motion is divided into its coordinates instead.
    if let [block] = &own[..]
        && let Some(motion) = block.measurement.motion()
    {
        let measurement = planned[block.experiment].label(&block.measurement);
        let mut groups = AXES.map(|axis| RowGroup {
            measurement: measurement.clone(),
            axis: axis.into(),
            rows: Vec::new(),
        });
        // Rows are sample by sample, in each the observed coordinates in order.
        let mut rows = block.rows.clone();
        for position in motion.samples.iter().map(|sample| sample.position) {
            for (group, _) in groups.iter_mut().zip(position).filter(|(_, x)| x.is_some()) {
                group.rows.extend(rows.next());
            }
        }
        return groups.into_iter().filter(|group| !group.rows.is_empty()).collect();
    }
    let whole = own.iter().map(|block| RowGroup {
        measurement: planned[block.experiment].label(&block.measurement),
        axis: String::new(),
        rows: block.rows.clone().collect(),
    });
    whole.collect()
}
