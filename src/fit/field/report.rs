//! Report of a fit of distributed parameters: estimates with standard errors from the directions that the data
//! determine.
//!
//! [`FieldReport::new`] takes the optimum and the largest eigenpairs `(l, v)` of `J'J`, where `J` is the Jacobian of
//! the residuals (in sigmas) by the unknowns `z`. The posterior covariance is `C (1 + J'J)^-1 C'` for the root `C` of
//! the prior covariance: every eigenvector lowers the prior variances by `l/(1 + l) (C v)^2`. Each list has values,
//! standard errors and prior standard deviations in its unit, with arc lengths in m. Each single parameter has a value
//! and a standard error in its unit. The report also has the effective number of parameters, the sum of `l/(1 + l)`,
//! the root mean square residual in sigmas, and the cost.
//!
//! Warnings are given for a search without convergence, residuals outside [`USUAL_RMS`], values farther from their
//! priors than chance allows ([`PRIOR_QUANTILE`]), and more directions than were computed. So are they for values of
//! lists with standard errors above [`UNDETERMINED`] of the prior. Correlations are not computed, which is a warning
//! with several lists or any single parameter. The warning on the local minimum is always there.
//! [`FieldReport::values`] returns the parameters with their values, [`FieldReport::summary`] the text for the
//! terminal.

use crate::code::Code;
use crate::error::{Error, ensure};
use crate::fit::field::plan::FieldFit;
use crate::fit::field::space::FieldSpace;
use crate::fit::report::plot_data::Series;
use crate::numerics::half_sum_of_squares;
use crate::numerics::lanczos::RitzPair;
use crate::numerics::stopwatch::Stopwatch;
use crate::scene::{Parameter, Scene};
use crate::summary::{ItemTable, Summary, Tone, duration};
use serde::{Deserialize, Serialize};
use statrs::distribution::{ChiSquared, ContinuousCDF};
use std::fmt;

/// Standard error over the prior standard deviation above which the data hardly determine a value. Smaller: more values
/// are warned of.
const UNDETERMINED: f64 = 0.9;
/// Range of the root mean square residual, in sigmas, without a warning. Beyond it the standard errors, which assume
/// sigma, are wrong.
const USUAL_RMS: [f64; 2] = [0.8, 1.25];

/// Probability that values are within the allowed distance of their priors, if the priors are right. Smaller: more
/// right priors are warned of.
const PRIOR_QUANTILE: f64 = 0.9999;

/// Estimates of a list along the rod.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct FieldEstimate {
    /// Name of the list.
    pub name: String,
    /// Unit of the values; empty for pure numbers.
    pub unit: String,
    /// Arc length of each value from the start of the rod, m.
    pub arc_lengths: Vec<f64>,
    /// Estimates, in `unit`.
    pub values: Vec<f64>,
    /// Standard errors from data and prior, in `unit`.
    pub standard_errors: Vec<f64>,
    /// Standard deviations of the prior, in `unit`.
    pub prior_std: Vec<f64>,
}

/// Estimate of a scalar parameter.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct SingleEstimate {
    /// Name of the parameter.
    pub name: Parameter,
    /// Estimate, in the parameter's unit.
    pub value: f64,
    /// Standard error from data and prior, in the parameter's unit.
    pub standard_error: f64,
}

/// Result of a fit of distributed parameters.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct FieldReport {
    /// Whether a minimum was reached.
    pub converged: bool,
    /// Estimates of the lists.
    pub fields: Vec<FieldEstimate>,
    /// Estimates of the scalar parameters.
    pub parameters: Vec<SingleEstimate>,
    /// Effective number of parameters: combinations that the data determine; weakly determined ones count as fractions.
    pub effective_parameters: f64,
    /// Root mean square of the residuals, each divided by its sigma.
    pub normalized_residual_rms: f64,
    /// Number of compared coordinates.
    pub values: usize,
    /// Half the sum of squares of residuals over sigma and of deviations from the prior over its standard deviation.
    pub misfit: f64,
    /// Cost: number of simulations and of products with the Jacobian.
    pub simulations: f64,
    /// Wall-clock time, s.
    pub wall_seconds: f64,
    /// Warnings about the estimates.
    pub warnings: Vec<String>,
    /// Data and model, coordinate by coordinate, for plots.
    #[serde(skip)]
    pub series: Vec<Series>,
}

/// Optimum of a fit along the rod, with the directions that the data determine.
pub(super) struct FieldOptimum<'a> {
    pub fit: &'a FieldFit,
    pub space: &'a FieldSpace,
    /// Independent numbers of variance one.
    pub z: &'a [f64],
    /// Residuals, in sigmas.
    pub residuals: &'a [f64],
    /// Data and model, coordinate by coordinate.
    pub series: Vec<Series>,
    /// Half the sum of squares of residuals and of `z`.
    pub misfit: f64,
    /// Eigenvalues and eigenvectors of `J'J`, the largest first.
    pub ritz: Vec<RitzPair>,
    /// Whether all directions that the data determine were found.
    pub complete: bool,
    /// Whether the search reached a minimum.
    pub converged: bool,
    /// Number of runs and of products with the Jacobian.
    pub runs: f64,
    /// Start of the fit.
    pub since: Stopwatch,
}

impl FieldReport {
    /// The report of an optimum: values with standard errors for each list and single parameter, and the warnings. The
    /// variance of a value is that of the prior less `l/(1 + l) (C v)^2` for each eigenpair `(l, v)`, at least 0. The
    /// effective number of parameters is the sum of `l/(1 + l)` over the eigenvalues `l`; negative ones count as 0.
    pub(super) fn new(optimum: FieldOptimum<'_>) -> Self {
        let FieldOptimum { space, z, ritz, residuals, .. } = &optimum;
        // (1 + J'J)^-1 is 1 less l/(1 + l) along every eigenvector with eigenvalue l.
        let reduction = |value: f64| value.max(0.0) / (1.0 + value.max(0.0));
        // The prior variances, from which each determined direction subtracts its reduction.
        let mut variances = Vec::with_capacity(z.len());
        for list in &space.lists {
            variances.extend((0..list.scene.len()).map(|k| list.prior.deviation(k).powi(2)));
        }
        variances.extend(space.singles.iter().map(|single| single.sigma.powi(2)));
        let prior: Vec<f64> = variances.iter().map(|variance| variance.sqrt()).collect();
        for RitzPair { value, vector, .. } in ritz {
            let mut direction = vector.clone();
            space.multiply(&mut direction);
            for (variance, x) in variances.iter_mut().zip(direction) {
                *variance -= reduction(*value) * x * x;
            }
        }
        let errors: Vec<f64> = variances.iter().map(|variance| variance.max(0.0).sqrt()).collect();
        let values: Vec<f64> = space.values(z).into_iter().map(|(_, value)| value).collect();
        // Values and errors are split into the lists, then single parameters follow.
        let mut fields = Vec::new();
        let mut first = 0;
        for list in &space.lists {
            let own = first..first + list.scene.len();
            fields.push(FieldEstimate {
                name: list.name.clone(),
                unit: list.unit.into(),
                arc_lengths: list.arc_lengths.clone(),
                values: values[own.clone()].to_vec(),
                standard_errors: errors[own.clone()].to_vec(),
                prior_std: prior[own].to_vec(),
            });
            first += list.scene.len();
        }
        let parameters = space.singles.iter().zip(first..).map(|(single, k)| SingleEstimate {
            name: single.parameter,
            value: values[k],
            standard_error: errors[k],
        });
        let mut report = Self {
            converged: optimum.converged,
            fields,
            parameters: parameters.collect(),
            effective_parameters: ritz.iter().map(|pair| reduction(pair.value)).sum(),
            normalized_residual_rms: (2.0 * half_sum_of_squares(residuals)
                / residuals.len() as f64)
                .sqrt(),
            values: residuals.len(),
            misfit: optimum.misfit,
            simulations: optimum.runs,
            wall_seconds: optimum.since.elapsed().as_secs_f64(),
            warnings: Vec::new(),
            series: Vec::new(),
        };
        report.warnings = report.all_warnings(&optimum);
        report.series = optimum.series;
        report
    }

    /// The identified parameters with their values in their units: the values of every list at the parameters that
    /// `scene` has for them, list after list, then the single parameters.
    ///
    /// # Errors
    /// [`Error::Invalid`] for a scene without one of the lists, or with another number of values. Single parameters are
    /// not compared with the scene.
    pub fn values(&self, scene: &Scene) -> Result<Vec<(Parameter, f64)>, Error> {
        let mut values = Vec::new();
        for field in &self.fields {
            let list = Parameter::list(scene, &field.name)?;
            let (found, allowed) = (list.len(), field.values.len());
            let allowed = format!("{allowed}, the number of values that were identified");
            ensure(list.len() == field.values.len(), &field.name, found, allowed)?;
            values.extend(list.into_iter().zip(field.values.iter().copied()));
        }
        values.extend(self.parameters.iter().map(|single| (single.name, single.value)));
        Ok(values)
    }

    /// Texts of all warnings in a fixed order: no convergence, residuals outside [`USUAL_RMS`] sigmas, a conflict with
    /// the priors (these with a code), missing directions, lists with values above [`UNDETERMINED`], correlations, if
    /// there are several lists or any single parameter. The last one, on the local minimum, is always there.
    fn all_warnings(&self, optimum: &FieldOptimum<'_>) -> Vec<String> {
        let mut warnings = Vec::new();
        if !self.converged {
            warnings.push("no minimum was reached. The values are the best so far".into());
        }
        // Standard errors assume the stated sigma: residuals far from it make them wrong.
        let ratio = self.normalized_residual_rms;
        if !(USUAL_RMS[0]..USUAL_RMS[1]).contains(&ratio) {
            let (code, fault) = match ratio > 1.0 {
                true => (
                    Code::BeyondSigma,
                    "The model lacks an effect, sigma is too small, or the prior of a field is too narrow or too smooth",
                ),
                false => (Code::SigmaDoubtful, "Sigma is too large"),
            };
            warnings.push(code.behind(format!(
                "the residuals are {ratio:.2} times the stated sigma. {fault}. The standard errors assume that sigma"
            )));
        }
        warnings.extend(prior_conflict(optimum).map(|text| Code::PriorConflict.behind(text)));
        // Missing directions are taken for undetermined.
        if !optimum.complete {
            warnings.push(
                "the data determine more combinations than were computed. The standard errors are too large"
                    .into(),
            );
        }
        // Values whose error is that of the prior are no result of the data.
        for field in &self.fields {
            let both = field.standard_errors.iter().zip(&field.prior_std);
            let count = both.filter(|(error, prior)| **error > UNDETERMINED * **prior).count();
            if count > 0 {
                let (name, all) = (&field.name, field.values.len());
                warnings.push(format!(
                    "the data hardly determine {count} of the {all} values of {name}. These follow from the prior and \
                     their neighbors. Add data where they are"
                ));
            }
        }
        if optimum.fit.fields.len() > 1 || !optimum.fit.unknowns.is_empty() {
            warnings.push(
                "correlations between the parameters are not reported. The standard errors are marginal".into(),
            );
        }
        warnings.push(
            "the minimum is the one reached from the values of the scene. Other minima were not searched".into(),
        );
        warnings
    }
}

/// Text of the warning of values that are farther from their priors than chance allows; `None` otherwise.
///
/// With right priors the sum of squares of the estimates `z`, whose prior variance is 1, has the mean `sum r` and the
/// variance `2 sum r^2` with `r = l/(1 + l)` for every eigenvalue `l` of `J'J`. It is compared with a multiple of a
/// chi-square distribution with both moments.
fn prior_conflict(optimum: &FieldOptimum<'_>) -> Option<String> {
    let parts = optimum.ritz.iter().map(|pair| pair.value.max(0.0) / (1.0 + pair.value.max(0.0)));
    let [mean, squares] = parts.fold([0.0, 0.0], |[sum, squares], r| [sum + r, squares + r * r]);
    let freedom = mean * mean / squares;
    let quantile = ChiSquared::new(freedom).ok()?.inverse_cdf(PRIOR_QUANTILE);
    let found = 2.0 * half_sum_of_squares(optimum.z);
    (found > quantile * mean / freedom).then(|| {
        format!(
            "the values are {:.1} times as far from their priors as these allow (root mean square). The prior of a field \
             is too narrow or too smooth, or the model lacks an effect that the values replace",
            (found / mean).sqrt()
        )
    })
}

impl fmt::Display for FieldReport {
    /// Writes [`FieldReport::summary`] as text.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.summary().fmt(f)
    }
}

impl FieldReport {
    /// The result as text for a terminal. The first line is whether it converged, with the numbers of values along the
    /// rod and of compared coordinates, and the codes of warnings. Then follow a table of single parameters (estimate,
    /// standard error, unit), and one of each list with a row per value: arc length, estimate, standard error.
    /// Warnings, number of determined combinations, residuals in sigmas and cost come last.
    pub fn summary(&self) -> Summary {
        let count: usize = self.fields.iter().map(|field| field.values.len()).sum();
        let estimates = format!("{count} values along the rod from {} coordinates", self.values);
        let mut summary = match self.converged {
            true => Summary::new(format!("converged: {estimates}"), Tone::Good),
            false => Summary::new(format!("not converged: {estimates}"), Tone::Bad)
                .with_code(Some(Code::NotUsable)),
        };
        // Single parameters first: their table is short.
        let singles = ItemTable::new(&self.parameters)
            .left("parameter", |single| single.name.to_string())
            .left("estimate", |single| format!("{:.6e}", single.value))
            .left("standard error", |single| format!("{:.1e}", single.standard_error))
            .left("unit", |single| single.name.unit().to_string());
        summary = summary.table("", singles);
        // One table for each list, a row for each value along the rod.
        for field in &self.fields {
            let unit =
                if field.unit.is_empty() { String::new() } else { format!(", {}", field.unit) };
            let table = ItemTable::new(field.arc_lengths.iter().enumerate())
                .right("m from the clamp", |(_, place)| format!("{place:.5}"))
                .right("estimate", |(k, _)| format!("{:.6}", field.values[*k]))
                .right("standard error", |(k, _)| format!("{:.2e}", field.standard_errors[*k]));
            summary = summary.table(format!("{}{unit}", field.name), table);
        }
        summary
            .warnings(&self.warnings)
            .naming_warnings()
            .fact(
                "Information",
                format!(
                    "{:.1} combinations of the values are determined",
                    self.effective_parameters
                ),
            )
            .fact("Residuals", format!("RMS {:.3} sigma", self.normalized_residual_rms))
            .fact(
                "Cost",
                format!(
                    "{:.0} runs or products, {}",
                    self.simulations,
                    duration(self.wall_seconds)
                ),
            )
    }
}
