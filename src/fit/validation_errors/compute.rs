//! Simulations of the experiments, and their differences to the measurements.

use crate::accuracy::Aim;
use crate::code::Code;
use crate::error::Error;
use crate::numerics::total_order;

use crate::fit::measurement::constant_axes::without_constant_axes;
use crate::fit::measurement::experiment::Experiment;
use crate::fit::report::plot_data::PlotData;
use crate::fit::report::recorded_motion::recorded;
use crate::fit::report::replay::{add_motion, still};
use crate::fit::report::resolutions;
use crate::fit::search::Search;
use crate::fit::search::fitted::{Fitted, MeasuredResiduals};
use crate::fit::search::optimum::Optimum;
use crate::fit::uncertainty::analysis::TOLERANCE;
use crate::fit::uncertainty::discrepancy::free_run::RecordingErrors;
use crate::fit::validation_errors::report::{
    FailedPrediction, MeasurementError, ValidationReport, ValidationSummary,
};
use rayon::prelude::*;

/// Errors of one experiment, with its plots.
struct Compared {
    errors: Vec<MeasurementError>,
    plots: Option<PlotData>,
    warnings: Vec<(Code, String)>,
}

/// Compares every experiment with its measurements; `keeps_plots` asks for the series.
pub(super) fn compared(
    experiments: &[Experiment],
    keeps_plots: bool,
) -> Result<ValidationReport, Error> {
    let resolved: Vec<(&Experiment, Result<Experiment, Error>)> =
        experiments.par_iter().map(|e| (e, prepared(e))).collect();
    let run = |(experiment, resolved): (&Experiment, Result<Experiment, Error>)| {
        let compared = resolved.and_then(|own| Ok((one(&own, keeps_plots)?, own)));
        (experiment.name.clone(), compared)
    };
    let all: Vec<_> = resolved.into_par_iter().map(run).collect();
    let (mut errors, mut failed, mut predicted) = (Vec::new(), Vec::new(), Vec::new());
    let mut warnings: Vec<(Code, String)> = Vec::new();
    let mut plots = keeps_plots.then(PlotData::default);
    let mut first_error = None;
    for (experiment, compared) in all {
        match compared {
            Ok((own, resolved)) => {
                errors.extend(own.errors);
                let named = |(code, words): (Code, String)| match experiment.is_empty() {
                    true => (code, words),
                    false => (code, format!("{experiment}: {words}")),
                };
                warnings.extend(own.warnings.into_iter().map(named));
                if let (Some(all), Some(own)) = (&mut plots, own.plots) {
                    all.series.extend(own.series);
                    all.shapes.extend(own.shapes);
                    all.settings.extend(own.settings);
                    all.version = own.version;
                }
                predicted.push(resolved);
            }
            Err(Error::Interrupted) => return Err(Error::Interrupted),
            Err(error) => {
                failed.push(FailedPrediction { experiment, reason: error.to_string() });
                first_error.get_or_insert(error);
            }
        }
    }
    if let Some(error) = first_error.filter(|_| predicted.is_empty()) {
        return Err(error);
    }
    let search = Search::new(&predicted, &[], None, TOLERANCE)?;
    let nothing_fitted = optimum(Vec::new(), Vec::new());
    if let Some(plots) = &mut plots {
        plots.recordings = recorded(&predicted, &search, &[]);
    }
    let (warning_codes, warnings) =
        warnings.into_iter().map(|(code, words)| (code, code.behind(words))).unzip();
    Ok(ValidationReport {
        summary: summaries(&errors),
        errors,
        recordings: RecordingErrors::new(
            &predicted,
            Fitted { search: &search, optimum: &nothing_fitted },
        ),
        failed,
        resolution: resolutions(&predicted),
        warnings,
        warning_codes,
        wall_seconds: 0.0,
        plot_data: plots,
    })
}

/// The experiment without coordinates that cannot differ, on the mesh and in the steps of a simulation of its scene where
/// the scene leaves these open.
fn prepared(experiment: &Experiment) -> Result<Experiment, Error> {
    let experiment = without_constant_axes(experiment);
    let problem = &experiment.problem;
    if !problem.scene().chosen().any() {
        return Ok(experiment);
    }
    let aim = match (experiment.moves(), experiment.highest_mode()) {
        (true, _) => Aim::Motion,
        (false, 0) => Aim::Rest,
        (false, highest) => Aim::Modes(highest),
    };
    let accurate = problem.scene().reopened().problem_for(aim)?;
    Ok(experiment.posed_as(problem.with_scene(accurate.scene().clone())?))
}

fn one(experiment: &Experiment, keeps_plots: bool) -> Result<Compared, Error> {
    let alone = std::slice::from_ref(experiment);
    let search = Search::new(alone, &[], None, TOLERANCE)?;
    let residuals = search.all_residuals()?;
    let found = optimum(residuals.plain(&[])?, residuals.counts());
    let errors = errors(&search, &found);
    let mut warnings = experiment.problem.coded_warnings();
    let plots = keeps_plots.then(|| {
        let mut plots = still(&search, Some(&found), &noise(&search, &found));
        if let Err(error) = add_motion(&search, &[], &mut plots) {
            warnings.push((Code::NoShapes, format!("no shapes of the rod: {error}")));
        }
        plots
    });
    Ok(Compared { errors, plots, warnings })
}

/// The state of a search that has no unknowns.
fn optimum(residuals: Vec<f64>, counts: Vec<usize>) -> Optimum {
    Optimum {
        x: Vec::new(),
        cost: 0.0,
        residuals,
        jacobian: Vec::new(),
        counts,
        converged: true,
        status: String::new(),
        halved: false,
    }
}

/// The given sigma of every measurement, or its root mean square difference.
fn noise(search: &Search, found: &Optimum) -> Vec<f64> {
    let rms = |MeasuredResiduals { measurement, sigma, residuals, .. }| {
        let square: f64 = residuals.iter().map(|r| r * r).sum();
        let rms = sigma * (square / residuals.len().max(1) as f64).sqrt();
        measurement.sigma().unwrap_or(rms.max(f64::MIN_POSITIVE))
    };
    search.measured(found).map(rms).collect()
}

/// Differences of one group of measurements while they are collected.
struct Group {
    observation: String,
    unit: String,
    sigma: Option<f64>,
    differences: Vec<f64>,
    /// Sum of the squares of the sizes of all values.
    size: f64,
}

fn errors(search: &Search, found: &Optimum) -> Vec<MeasurementError> {
    let mut groups: Vec<Group> = Vec::new();
    let mut name = String::new();
    for MeasuredResiduals { experiment, measurement, sigma, residuals, .. } in
        search.measured(found)
    {
        name.clone_from(&experiment.name);
        // Residuals are in units of the standard deviation of their value.
        let sigmas = measurement.sigmas(sigma);
        let unit = measurement.data_unit();
        let differences = residuals.iter().zip(sigmas).map(|(r, sigma)| r * sigma / unit.size);
        let observation = experiment.group(measurement);
        let is_same =
            |last: &&mut Group| measurement.marker().is_some() && last.observation == observation;
        let size = measurement.size(&experiment.problem) / unit.size;
        let size = size * size * residuals.len() as f64;
        match groups.last_mut().filter(is_same) {
            Some(group) => {
                group.differences.extend(differences);
                group.size += size;
            }
            None => groups.push(Group {
                observation,
                unit: unit.name.into(),
                sigma: measurement.sigma().map(|sigma| sigma / unit.size),
                differences: differences.collect(),
                size,
            }),
        }
    }
    groups.into_iter().map(|group| group.error(name.clone())).collect()
}

impl Group {
    fn error(self, experiment: String) -> MeasurementError {
        let mut absolute: Vec<f64> = self.differences.iter().map(|d| d.abs()).collect();
        absolute.sort_by(f64::total_cmp);
        let n = absolute.len().max(1) as f64;
        let rms = (absolute.iter().map(|d| d * d).sum::<f64>() / n).sqrt();
        let size = (self.size / n).sqrt();
        MeasurementError {
            experiment,
            observation: self.observation,
            unit: self.unit,
            values: absolute.len(),
            mean: absolute.iter().sum::<f64>() / n,
            median: median(&absolute),
            worst: absolute.last().copied().unwrap_or(0.0),
            rms,
            sigma: self.sigma,
            relative: (size > 0.0).then(|| rms / size),
        }
    }
}

/// Median of ascending values.
fn median(ascending: &[f64]) -> f64 {
    match ascending.len() {
        0 => 0.0,
        n => 0.5 * (ascending[(n - 1) / 2] + ascending[n / 2]),
    }
}

fn summaries(errors: &[MeasurementError]) -> Vec<ValidationSummary> {
    let mut units: Vec<&str> = Vec::new();
    for error in errors {
        if !units.contains(&&error.unit[..]) {
            units.push(&error.unit);
        }
    }
    let summary = |unit: &&str| {
        let mut own: Vec<&MeasurementError> = errors.iter().filter(|e| e.unit == *unit).collect();
        own.sort_by_cached_key(|x| total_order(x.mean));
        let means: Vec<f64> = own.iter().map(|error| error.mean).collect();
        let worst = own.last()?;
        Some(ValidationSummary {
            unit: (*unit).into(),
            measurements: own.len(),
            mean: means.iter().sum::<f64>() / means.len() as f64,
            median: median(&means),
            worst: worst.mean,
            worst_observation: worst.observation.clone(),
        })
    };
    units.iter().filter_map(summary).collect()
}
