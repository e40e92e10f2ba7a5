//! Discretization errors of the estimates in a report, and warnings where they exceed the intervals.
//!
//! [`discretization_errors`] converts the bias of the unknowns by mesh and step to one [`DiscretizationError`] per
//! estimate, as fractions of its value (differences of logarithms of positive parameters). It is none where the
//! estimate is not identifiable or zero, or no other mesh or step was compared. For a mesh or step that the program
//! chose for all experiments the error is the part that may remain after the correction ([`REMAINING_FRACTION`]), and
//! the signed correction is given too. For others it is the whole bias. The report of a fit lists the errors.
//!
//! Errors by mesh and step that are not chosen, together above [`LARGE_ERROR`] half-widths of the 95 % interval, are a
//! warning (`Numerics`). If discretization errors are more than [`EXPLAINING_FRACTION`] of residuals that are no noise,
//! and any mesh or step is given, there is one more warning; all of them then have the severity `Mesh`.

use crate::code::Code;
use crate::fit::measurement::experiment::Experiment;
use crate::fit::search::fitted::Fitted;
use crate::fit::uncertainty::discretization::bias::{
    BiasPart, DiscretizationBias, EXPLAINING_FRACTION, REMAINING_FRACTION,
};
use crate::fit::uncertainty::estimate::Estimate;
use crate::fit::uncertainty::noise::coverage_factor::quantile95;
use crate::fit::uncertainty::noise::residual_noise::ResidualNoise;
use crate::fit::uncertainty::warning_list::{Severity, Warnings, percent};
use crate::scene::{Parameter, Shape};
use serde::{Deserialize, Serialize};

/// Discretization error by given numerics, in half-widths of the 95 % interval, above which there is a warning. The
/// bias of given numerics is an upper estimate: it is extrapolated as of first order. Larger: later warnings.
const LARGE_ERROR: f64 = 2.0;

/// Discretization error of a parameter, as fractions of its value.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct DiscretizationError {
    /// Name of the parameter.
    pub name: Parameter,
    /// Experiments with this parameter; empty: all.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub experiments: Vec<String>,
    /// Error of mesh and step as a fraction of the value; null if the parameter is not
    /// identifiable.
    pub relative: Option<f64>,
    /// Error of the mesh as a fraction of the value; null if the parameter is not identifiable.
    pub mesh: Option<f64>,
    /// Error of the time step as a fraction of the value; null where the fit identifies beta.
    pub step: Option<f64>,
    /// Correction of the value for mesh and step, as a fraction of it; null where the scene gives
    /// them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub correction: Option<f64>,
}

/// Discretization errors of the `estimates`, one each in their order, by the `bias` of their unknowns, as fractions of
/// the corrected values (for positive parameters differences of logarithms; none of a value that is zero). For a mesh
/// or step that the program chose for all experiments they are [`REMAINING_FRACTION`] of the bias, else all of it. An
/// estimate whose errors of the latter kind are together above [`LARGE_ERROR`] half-widths of the 95 % interval adds a
/// warning. If any mesh or step is given, more than [`EXPLAINING_FRACTION`] of the residuals are discretization errors
/// and the `warnings` have a misfit, one more is added. All then have the severity `Mesh` instead of `Numerics`.
/// `noise` has the degrees of freedom of the half-width.
pub(crate) fn discretization_errors(
    estimates: &[Estimate],
    Fitted { search, optimum }: Fitted,
    bias: &DiscretizationBias,
    noise: &ResidualNoise,
    warnings: &mut Warnings,
) -> Vec<DiscretizationError> {
    let remedy = remedy(search.experiments);
    let mut severity = Severity::Numerics;
    // Chosen numerics are compared with the residuals by `DiscretizationBias::explains_residuals`.
    let is_given = search.experiments.iter().any(|e| {
        let chosen = e.problem.scene().chosen();
        !chosen.segments || e.moves() && !chosen.step
    });
    if is_given && bias.residual_fraction() > EXPLAINING_FRACTION && warnings.has_misfit() {
        severity = Severity::Mesh;
        let text = "a finer mesh or step changes the motion by as much as the residuals. The residuals may be \
                     discretization error. Refine the numerics before searching for a missing effect";
        warnings.add(severity, Code::NumericsNotModel, format!("{text} ({remedy})"));
    }
    // Each unknown: its errors by mesh and by step.
    let coverage_factor = quantile95(noise.degrees_of_freedom);
    let mut errors = Vec::new();
    for (i, (unknown, estimate)) in search.unknowns.iter().zip(estimates).enumerate() {
        let correction = bias.correction(i);
        let value = unknown.from_scale(optimum.x[i] + correction);
        // A difference of logarithms is relative.
        let is_positive = unknown.parameter.is_positive();
        let size = if is_positive { 1.0 } else { value.abs() };
        let fraction = |error: f64| fraction_of(error, size);
        // In the unit of the value, or of its logarithm.
        let error = |part: &BiasPart| {
            let remaining = if part.is_chosen { REMAINING_FRACTION } else { 1.0 };
            let shift = part.shift(i).filter(|_| estimate.identifiable)?;
            Some(remaining * shift.abs())
        };
        let parts = bias.parts();
        let [mesh, step] = parts.map(error);
        let sum = |part: fn(&BiasPart) -> bool| -> f64 {
            parts.iter().filter(|p| part(p)).filter_map(|p| error(p)).sum()
        };
        let is_corrected = parts.iter().any(|p| p.is_chosen && error(p).is_some());
        errors.push(DiscretizationError {
            name: unknown.parameter,
            experiments: unknown.experiments.clone(),
            relative: mesh.or(step).and_then(|_| fraction(sum(|_| true))),
            mesh: mesh.and_then(fraction),
            step: step.and_then(fraction),
            correction: fraction(correction).filter(|_| is_corrected),
        });
        // Errors of chosen numerics are corrected, and in the interval.
        let given = sum(|part| !part.is_chosen);
        let change = |value: f64| if is_positive { given * value } else { given };
        if let (Some(value), Some(sd)) = (estimate.value, estimate.std_error)
            && change(value) > LARGE_ERROR * coverage_factor * sd
        {
            let size = match is_positive {
                true => percent(given),
                false => format!("{given:.1e} {}", estimate.name.unit()),
            };
            let text = format!(
                "{}: the discretization error may be {}, more than twice the half-width of the 95 % interval. \
                 The interval is too narrow. {remedy}",
                estimate.label(),
                size.trim_end()
            );
            warnings.add(severity, Code::DiscretizationError, text);
        }
    }
    errors
}

/// An `error` as a fraction of the `size` of a value, in the same unit; none for the size zero.
fn fraction_of(error: f64, size: f64) -> Option<f64> {
    (size > 0.0).then_some(error / size)
}

/// The action, as text, against discretization errors of a given mesh and step. If any scene is a structure, it is to
/// refine both. Else, if any rod is a polyline, whose mesh cannot be chosen, it is to leave out the step. Otherwise it
/// is to leave out both.
fn remedy(experiments: &[Experiment]) -> &'static str {
    let is_line = |e: &Experiment| matches!(e.problem.scene().rod.shape, Shape::Polyline { .. });
    let is_structure = |e: &Experiment| e.problem.scene().structure.is_some();
    match experiments.iter().any(is_line) {
        _ if experiments.iter().any(is_structure) => {
            "Use more rods.segments and a smaller time.step"
        }
        true => "Leave out time.step, and the program chooses it; the mesh is that of the polyline",
        false => "Leave out rod.segments and time.step, and the program chooses them",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A fraction of zero is neither infinite nor NaN, of which JSON has no numbers.
    #[test]
    fn fraction_of_a_value_of_zero_is_none() {
        assert_eq!(fraction_of(0.02, 0.5), Some(0.04));
        assert_eq!([0.0, 0.02].map(|error| fraction_of(error, 0.0)), [None; 2]);
    }
}
