//! The report of a fit as text for a terminal: the grade, the estimates with intervals, the warnings, then details by
//! topic.
//!
//! Input: a [`FitReport`]. Output: a [`Summary`]. Estimates are in the units of the parameters; residuals, sigmas and
//! errors of predictions are in the units of the data files (Hz if frequencies are given in Hz and none in rad/s).
//! First are the status with the code of the grade, the validation error, the table of estimates, the combinations of
//! parameters that the data determine, the content of the intervals, and the warnings, most severe first. Then follow
//! uncertainty details, omitted effects, mesh and step, left-out rows, robust losses and predictions. Residuals with
//! the noise, the search and the cost are last. `Grade::tone` is the color of a grade.

use crate::fit::report::estimate_table::{estimate_table, interval_content};
use crate::fit::report::quoted::quoted_estimates;
use crate::fit::report::{FitReport, effects, uncertainty, validation};
use crate::fit::uncertainty::grade::Grade;
use crate::scene::Resolution;
use crate::summary::quantity::{duration, number, quantity};
use crate::summary::{Summary, Tone};
use std::fmt::{self, Formatter};

/// Largest number of listed combinations of mesh, step and scheme, one per group of equal experiments.
const NAMED_RESOLUTIONS: usize = 3;
/// Significant digits of displayed residuals and noise.
const DIGITS: usize = 4;

impl fmt::Display for FitReport {
    /// Writes the [summary](FitReport::summary) of the report as text.
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        self.summary().fmt(f)
    }
}

impl Grade {
    /// The tone of the grade, from which the color of the status follows: good (trustworthy), bad (not identifiable,
    /// interrupted, unusable), else doubtful.
    pub(crate) fn tone(self) -> Tone {
        match self {
            Self::Trustworthy => Tone::Good,
            Self::NotIdentifiable | Self::Interrupted | Self::NotUsable => Tone::Bad,
            _ => Tone::Doubtful,
        }
    }
}

impl FitReport {
    /// The result as text for a terminal: status with the grade's code, validation error, table of estimates,
    /// determined combinations, interval content, warnings, uncertainty, omitted effects, data, residuals, search and
    /// cost.
    pub fn summary(&self) -> Summary {
        let status = match self.grade {
            Grade::Trustworthy if self.warnings.is_empty() => {
                "converged, no problem detected".to_string()
            }
            Grade::Trustworthy => "converged".to_string(),
            grade => format!("{grade}: {}", self.verdict),
        };
        let mut summary =
            Summary::new(status, self.grade.tone()).with_code(Some(self.grade.code()));
        // The verdict of an unusable result already has its status.
        if self.status != "converged" && self.grade != Grade::NotUsable {
            summary = summary.note(&self.status);
        }
        summary = validation::add_validation_error(summary, self);
        let estimates = quoted_estimates(&self.parameters, &[]);
        summary = summary.table("", estimate_table(&estimates, "estimate"));
        let combinations = self.determined_groups.iter().filter(|g| g.interval95.is_some());
        summary = summary.facts("Determined combination", combinations.map(ToString::to_string));
        if let Some(text) = interval_content(self) {
            summary = summary.note(text);
        }
        summary = summary.warnings(&self.warnings);
        // The verdicts of other grades have their reason.
        if self.grade == Grade::Trustworthy {
            summary = summary.naming_warnings();
        }
        summary = uncertainty::add_uncertainty(summary, self);
        summary = effects::add_omitted_effects(summary, self);
        self.add_cost(self.add_data(summary))
    }

    /// Mesh, step and scheme that the program chose, one text per distinct combination in the order of the experiments,
    /// with the number of experiments if several have it.
    fn resolution_texts(&self) -> Vec<String> {
        let all: Vec<String> = self.resolution.iter().flatten().map(Resolution::words).collect();
        let mut texts = Vec::new();
        for (i, words) in all.iter().enumerate().filter(|(i, words)| !all[..*i].contains(words)) {
            texts.push(match all[i..].iter().filter(|other| *other == words).count() {
                1 => words.clone(),
                count => format!("{words} ({count} experiments)"),
            });
        }
        texts
    }

    /// The `summary` with facts: the first [`NAMED_RESOLUTIONS`] combinations of mesh, step and scheme, left-out rows,
    /// robust losses, errors of validation data (if there are at least two), and errors of recordings.
    fn add_data(&self, mut summary: Summary) -> Summary {
        let chosen = self.resolution_texts().into_iter().take(NAMED_RESOLUTIONS);
        summary = summary.facts("Numerics", chosen);
        let dropped = self.dropped.iter().map(|d| format!("{}: {}", d.observation, d.rows));
        summary = summary.facts("Rows left out", dropped);
        let losses = self.losses.iter().map(|l| {
            format!(
                "{}: {} of {} values down-weighted, {} beyond 5 sigma; standard errors x {:.2} (applied)",
                l.observation, l.down_weighted, l.values, l.beyond_5_sigma, l.std_error_factor
            )
        });
        summary = summary.facts("Robust loss", losses);
        // The error of a single validation measurement is already part of the result.
        let several = self.predictions.iter().filter(|_| self.predictions.len() > 1);
        let predictions = several.map(|p| {
            let [rms, expected] =
                [p.rms, p.expected].map(|x| self.data_quantity(x, &p.unit, DIGITS));
            format!("{}: RMS error {rms}, {expected} expected", p.observation)
        });
        summary = summary.facts("Validation data", predictions);
        match &self.recordings {
            Some(recordings) => recordings.add_to(summary),
            None => summary,
        }
    }

    /// The `summary` with facts. They are the RMS residual (of positions, if any) with the noise (sigma) of each fitted
    /// measurement, and the noise estimate. Three or more equal noises in a row are one text. The summary of the local
    /// minima, if not empty, and the work in full simulations with the wall time follow.
    fn add_cost(&self, mut summary: Summary) -> Summary {
        let pairs = self.sigma.iter().zip(&self.units);
        let sigma: Vec<String> =
            pairs.map(|(s, unit)| self.data_quantity(*s, unit, DIGITS)).collect();
        // Equal noises of several observations are listed once.
        let grouped = sigma.chunk_by(|a, b| a == b).map(|same| match same.len() {
            ..3 => same.join(", "),
            n => format!("{} (each of {n} observations)", same[0]),
        });
        let sigma: Vec<String> = grouped.collect();
        // The RMS residual is that of positions, if there are any.
        let unit = self.units.iter().find(|unit| **unit == "m").or(self.units.first());
        let unit = unit.map_or("m", String::as_str);
        let rms = self.data_quantity(self.residual_rms, unit, DIGITS);
        summary = summary.fact("Residuals", format!("RMS {rms}; sigma {}", sigma.join(", ")));
        summary = summary.facts("Noise by differences", self.noise_scale_texts());
        if !self.local_minima.summary.is_empty() {
            summary = summary.fact("Search", &self.local_minima.summary);
        }
        let cost = format!(
            "equal to {} full simulations, {}",
            number(self.simulations, 2),
            duration(self.wall_seconds)
        );
        summary.fact("Cost", cost)
    }

    /// A value and its `unit` as text with this number of significant `digits`, converted to the unit of the data files
    /// (Hz for rad/s if frequencies are given in Hz and none in rad/s).
    pub(super) fn data_quantity(&self, value: f64, unit: &str, digits: usize) -> String {
        let (value, unit) = self.in_data_unit(value, unit);
        quantity(value, unit, digits)
    }

    /// The noise estimated from differences of the samples, one [text](Self::noise_scale_text) for each unit.
    fn noise_scale_texts(&self) -> Vec<String> {
        let mut units: Vec<&str> = Vec::new();
        for scale in &self.noise_scale {
            if !units.contains(&&*scale.unit) {
                units.push(&scale.unit);
            }
        }
        units.into_iter().filter_map(|unit| self.noise_scale_text(unit)).collect()
    }

    /// The noise of the coordinates in a `unit`, as text. It is the value or the range over the coordinates that have
    /// an estimate, with the number and the reasons of the others. If none has one: the first reason. `None` if no
    /// coordinate was examined.
    fn noise_scale_text(&self, unit: &str) -> Option<String> {
        let scales = || self.noise_scale.iter().filter(|scale| scale.unit == unit);
        let values: Vec<f64> = scales().filter_map(|scale| scale.value).collect();
        let [low, high] =
            values.iter().fold([f64::INFINITY, 0.0], |[low, high], x| [x.min(low), x.max(high)]);
        // Coordinates without an estimate are counted by their reason.
        let mut reasons: Vec<(&str, usize)> = Vec::new();
        for reason in scales().filter_map(|scale| scale.unavailable.as_deref()) {
            match reasons.iter_mut().find(|(known, _)| *known == reason) {
                Some((_, count)) => *count += 1,
                None => reasons.push((reason, 1)),
            }
        }
        let shown = match values.len() {
            0 => {
                let (reason, _) = reasons.first()?;
                return Some(format!(
                    "none from the samples ({reason}); state sigma to separate noise from model error"
                ));
            }
            1 => quantity(low, unit, DIGITS),
            _ => format!("{} to {}", quantity(low, unit, DIGITS), quantity(high, unit, DIGITS)),
        };
        let source = match values.len() {
            1 => "from differences of the samples",
            _ => "by coordinate, from differences",
        };
        let of = match values.len() == scales().count() {
            true => String::new(),
            false => {
                let others = reasons
                    .iter()
                    .map(|(reason, count)| format!("; no estimate for {count}: {reason}"));
                let others: String = others.collect();
                format!(" ({} of {} coordinates{others})", values.len(), scales().count())
            }
        };
        Some(format!("{shown} {source}{of}"))
    }
}
