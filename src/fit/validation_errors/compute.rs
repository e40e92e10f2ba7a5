//! Computation of validation errors: every experiment is simulated with the values of its scene, and compared with its
//! measurements, without a fit.
//!
//! Input: experiments. Mesh, step and scheme, where the scenes leave them open, are chosen for the accuracy that the
//! scene requests. Constant coordinates are left out. The mean, median, largest and RMS absolute difference of each
//! measurement are computed in the unit of its data file. The RMS is also divided by the measured change (none if that
//! is 0). All markers of a recording that prescribes the ends are one measurement. Output of `compare_all`:
//! [`ValidationReport`] with these errors, a summary of the mean errors per unit, and the errors of recordings with
//! prescribed ends. It also has the experiments that could not be simulated, warnings, and on demand data of plots.
//! Error: no experiment can be simulated, or an interruption.

use crate::code::Code;
use crate::error::Error;
use crate::fit::measurement::constant_axes::without_constant_axes;
use crate::fit::measurement::experiment::Experiment;
use crate::fit::report::overlay_run::image_overlays;
use crate::fit::report::plot_data::PlotData;
use crate::fit::report::recorded_motion::recording_plots;
use crate::fit::report::replay::{add_motion, static_plots};
use crate::fit::report::resolutions;
use crate::fit::search::Search;
use crate::fit::search::fitted::{Fitted, MeasuredResiduals};
use crate::fit::search::optimum::Optimum;
use crate::fit::uncertainty::analysis::TOLERANCE;
use crate::fit::uncertainty::discrepancy::free_run::RecordingErrors;
use crate::fit::validation_errors::report::{
    FailedPrediction, MeasurementError, ValidationReport, ValidationSummary,
};
use crate::numerics::{median, total_order};
use rayon::prelude::*;

/// Comparison of one experiment with its measurements.
struct ExperimentComparison {
    /// The experiment on the mesh of the simulation.
    experiment: Experiment,
    /// Errors of its measurements.
    errors: Vec<MeasurementError>,
    /// Data of plots, if they are kept.
    plots: Option<PlotData>,
    warnings: Vec<String>,
    /// Code of each warning, in the same order.
    codes: Vec<Code>,
}

/// Compares every experiment with its measurements, in parallel; results are in the order of the experiments. With
/// `keeps_plots` the report has data of plots. Experiments that cannot be simulated are listed with the reason. The
/// wall time is 0, to be set by the caller. Recordings that prescribe the ends are simulated once more for their
/// errors. Warnings begin with the name of the experiment, if it has one, and end with their code. Error: the first
/// failure if no experiment can be simulated, and an interruption.
pub(super) fn compare_all(
    experiments: &[Experiment],
    keeps_plots: bool,
) -> Result<ValidationReport, Error> {
    // 1. Meshes and steps first, then the simulations: the threads have tasks of similar size.
    let prepared: Vec<Result<Experiment, Error>> =
        experiments.par_iter().map(with_resolved_mesh).collect();
    let run = |own: Result<Experiment, Error>| own.and_then(|own| compare(own, keeps_plots));
    let all: Vec<Result<ExperimentComparison, Error>> = prepared.into_par_iter().map(run).collect();
    // 2. The results in the order of the experiments.
    let (mut errors, mut failed, mut predicted) = (Vec::new(), Vec::new(), Vec::new());
    let (mut warnings, mut warning_codes) = (Vec::new(), Vec::new());
    let mut plots = keeps_plots.then(PlotData::default);
    let mut first_error = None;
    for (Experiment { name, .. }, compared) in experiments.iter().zip(all) {
        match compared {
            Ok(own) => {
                errors.extend(own.errors);
                warning_codes.extend(&own.codes);
                warnings.extend(own.warnings.into_iter().zip(own.codes).map(|(text, code)| {
                    match name.is_empty() {
                        true => code.behind(text),
                        false => code.behind(format!("{name}: {text}")),
                    }
                }));
                if let (Some(all), Some(own)) = (&mut plots, own.plots) {
                    all.series.extend(own.series);
                    all.shapes.extend(own.shapes);
                    all.overlays.extend(own.overlays);
                    all.settings.extend(own.settings);
                    all.version = own.version;
                }
                predicted.push(own.experiment);
            }
            Err(Error::Interrupted) => return Err(Error::Interrupted),
            Err(error) => {
                let (experiment, reason) = (name.clone(), error.to_string());
                failed.push(FailedPrediction { experiment, reason });
                first_error.get_or_insert(error);
            }
        }
    }
    if let Some(error) = first_error.filter(|_| predicted.is_empty()) {
        return Err(error);
    }
    // 3. The errors of recordings that prescribe the ends.
    let search = Search::new(&predicted, &[], None, TOLERANCE)?;
    let optimum = Optimum { converged: true, ..Optimum::default() };
    if let Some(plots) = &mut plots {
        plots.recordings = recording_plots(&predicted, &search, &[]);
    }
    let fitted = Fitted { search: &search, optimum: &optimum };
    Ok(ValidationReport {
        summary: summaries(&errors),
        errors,
        recordings: RecordingErrors::new(&predicted, fitted),
        failed,
        resolution: resolutions(&predicted),
        warnings,
        warning_codes,
        wall_seconds: 0.0,
        plot_data: plots,
    })
}

/// A copy of the experiment without constant coordinates. Where its scene leaves mesh, step or scheme open, they are
/// chosen for the accuracy of the measured motion, modes or equilibrium. Error: that choice fails.
fn with_resolved_mesh(experiment: &Experiment) -> Result<Experiment, Error> {
    let experiment = without_constant_axes(experiment, &[]);
    let problem = &experiment.problem;
    if !problem.scene().chosen().any() {
        return Ok(experiment);
    }
    let accurate = problem.scene().reopened().problem_for(experiment.aim())?;
    Ok(experiment.with_problem(problem.with_scene(accurate.scene().clone())?))
}

/// The comparison of one experiment on its mesh, by the residuals of a simulation with the values of its scene. With
/// `keeps_plots` it has data of plots; if shapes of the rod cannot be computed, that is a warning. Error: the
/// simulation fails.
fn compare(experiment: Experiment, keeps_plots: bool) -> Result<ExperimentComparison, Error> {
    let search = Search::new(std::slice::from_ref(&experiment), &[], None, TOLERANCE)?;
    let residuals = search.all_residuals()?;
    let found = Optimum {
        residuals: residuals.plain_residuals(&[])?,
        counts: residuals.counts(),
        converged: true,
        ..Optimum::default()
    };
    let errors = measurement_errors(&search, &found);
    // Warnings of a scene are those of one rod.
    let own = match experiment.problem.scene().structure {
        Some(_) => Vec::new(),
        None => experiment.problem.coded_warnings(),
    };
    let (mut codes, mut warnings): (Vec<Code>, Vec<String>) = own.into_iter().unzip();
    let plots = keeps_plots.then(|| {
        let mut plots = static_plots(&search, Some(&found), &noise(&search, &found));
        if let Err(error) = add_motion(&search, &[], &mut plots) {
            codes.push(Code::NoShapes);
            warnings.push(format!("no shapes of the rod: {error}"));
        }
        match image_overlays(&search, std::slice::from_ref(&experiment), &[]) {
            Ok(overlays) => plots.overlays = overlays,
            Err(error) => {
                codes.push(Code::NoShapes);
                warnings.push(format!("no data and model in pictures: {error}"));
            }
        }
        plots
    });
    Ok(ExperimentComparison { errors, plots, warnings, codes, experiment })
}

/// Standard deviation of the noise of every measurement, in its unit, for the plots: the given sigma, or else the root
/// mean square of its differences.
fn noise(search: &Search, found: &Optimum) -> Vec<f64> {
    let rms = |MeasuredResiduals { measurement, sigma, residuals, .. }| {
        let square: f64 = residuals.iter().map(|r| r * r).sum();
        let rms = sigma * (square / residuals.len().max(1) as f64).sqrt();
        measurement.sigma().unwrap_or(rms.max(f64::MIN_POSITIVE))
    };
    search.measured(found).map(rms).collect()
}

/// Differences of one measurement, or of all markers of a recording, in the unit of the data file.
struct DifferenceGroup {
    /// Name of the measurement, or of the recording.
    observation: String,
    /// Unit of the data file.
    unit: String,
    /// Given noise, in the unit.
    sigma: Option<f64>,
    /// Simulated less measured values, in the unit.
    differences: Vec<f64>,
    /// Sum over the measurements of the squared size of the measured effect times the number of values, in the squared
    /// unit.
    size: f64,
}

/// The errors of all measurements of the one experiment of `search`, in their order and in the units of the data files.
/// A difference is the residual times the standard deviation of its value. Consecutive markers of a recording that
/// prescribes the ends are one measurement.
fn measurement_errors(search: &Search, found: &Optimum) -> Vec<MeasurementError> {
    // Consecutive markers of a recording form one group.
    let mut groups: Vec<DifferenceGroup> = Vec::new();
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
        let is_same = |last: &&mut DifferenceGroup| {
            measurement.marker().is_some() && last.observation == observation
        };
        let size = measurement.size(&experiment.problem) / unit.size;
        // Sizes of several markers are combined as root mean squares over all values.
        let size = size * size * residuals.len() as f64;
        match groups.last_mut().filter(is_same) {
            Some(group) => {
                group.differences.extend(differences);
                group.size += size;
            }
            None => groups.push(DifferenceGroup {
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

impl DifferenceGroup {
    /// Mean, median, largest and RMS absolute difference, all 0 without values, and the RMS over the size of the
    /// measured effect, none if that is 0. The size of several markers is the root mean square of theirs, weighted by
    /// their numbers of values. `experiment` is the name of the experiment.
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
            median: median(absolute.iter().copied()),
            worst: absolute.last().copied().unwrap_or(0.0),
            rms,
            sigma: self.sigma,
            relative: (size > 0.0).then(|| rms / size),
        }
    }
}

/// One summary per unit, in the order of first appearance: mean, median and largest of the mean errors of all
/// measurements in this unit, each measurement counting once.
fn summaries(errors: &[MeasurementError]) -> Vec<ValidationSummary> {
    // Errors in different units have summaries of their own.
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
            median: median(means.iter().copied()),
            worst: worst.mean,
            worst_observation: worst.observation.clone(),
        })
    };
    units.iter().filter_map(summary).collect()
}
