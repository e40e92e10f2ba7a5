//! The report of a fit on the terminal: the grade, the estimates, the warnings, then details by topic.

use crate::code::Code;
use crate::fit::report::{FitReport, budget, digits, hidden, validation};
use crate::fit::uncertainty::bootstrap::Bootstrap;
use crate::fit::uncertainty::estimate::Estimate;
use crate::fit::uncertainty::sources::looks_like;
use crate::fit::uncertainty::verdict::{Grade, percent};
use std::fmt::{self, Formatter};

/// Columns of the labels of details.
const LABEL: usize = 24;
/// Columns of the table of estimates: estimate, standard error, interval.
const COLUMNS: [usize; 3] = [14, 16, 28];
/// Meshes and steps that are named; several experiments may have as many.
const NAMED_RESOLUTIONS: usize = 3;

impl fmt::Display for FitReport {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        writeln!(f, "{}", self.first_line())?;
        if self.status != "converged" && self.grade != Grade::NotUsable {
            writeln!(f, "{}", self.status)?;
        }
        validation::write(f, self)?;
        writeln!(f)?;
        self.write_estimates(f)?;
        if !self.warnings.is_empty() {
            writeln!(f)?;
        }
        for warning in &self.warnings {
            writeln!(f, "warning: {warning}")?;
        }
        writeln!(f)?;
        self.write_uncertainty(f)?;
        self.write_effects(f)?;
        self.write_data(f)?;
        self.write_cost(f)
    }
}

/// A detail, with its label in front.
fn detail(f: &mut Formatter<'_>, label: &str, text: impl fmt::Display) -> fmt::Result {
    writeln!(f, "  {label:<LABEL$}{text}")
}

/// Details of one topic, the label in front of the first.
fn details(f: &mut Formatter<'_>, label: &str, texts: &[String]) -> fmt::Result {
    for (k, text) in texts.iter().enumerate() {
        detail(f, if k == 0 { label } else { "" }, text)?;
    }
    Ok(())
}

impl FitReport {
    /// The grade, with its reason and code.
    fn first_line(&self) -> String {
        match self.grade {
            Grade::Trustworthy => Code::Trustworthy.behind("converged, no problem detected"),
            grade => grade.code().behind(format!("{grade}: {}", self.verdict)),
        }
    }

    /// A table of the estimates, with the interval that is to be quoted, and what that does not include.
    fn write_estimates(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let width = self.parameters.iter().map(|e| e.label().len()).fold(16, usize::max);
        let [a, b, c] = COLUMNS;
        let expanded = self.parameters.iter().any(has_known_inputs);
        let interval = if expanded { "95 % interval (expanded)" } else { "95 % interval" };
        writeln!(
            f,
            "  {:<width$}  {:<a$}  {:<b$}  {interval:<c$}  unit",
            "parameter", "estimate", "standard error"
        )?;
        for e in &self.parameters {
            let [value, error, interval] = cells(e);
            let unit = if e.identifiable { e.name.unit() } else { "" };
            let row = format!(
                "  {:<width$}  {value:<a$}  {error:<b$}  {interval:<c$}  {unit}",
                e.label()
            );
            writeln!(f, "{}", row.trim_end())?;
            if let (true, Some(std_error), Some(ends)) =
                (has_known_inputs(e), e.std_error, e.interval95)
            {
                let error = relative_error(e, std_error);
                let ends = interval_of(ends, std_error);
                let row = format!(
                    "  {:<width$}  {:<a$}  {error:<b$}  {ends:<c$}",
                    "  statistical only", ""
                );
                writeln!(f, "{}", row.trim_end())?;
            }
        }
        if self.parameters.iter().any(|e| e.std_error.is_some()) && !expanded {
            writeln!(f, "  inputs taken as exact{}", self.largest_bias())?;
        } else if expanded {
            writeln!(f, "  expanded: noise, inputs and discretization{}", self.largest_bias())?;
        }
        Ok(())
    }

    /// The largest bias by an effect that the model omits, over all parameters.
    fn largest_bias(&self) -> String {
        let biases =
            self.undetected_bias.iter().filter_map(|bias| Some((bias.relative?.abs(), bias)));
        match biases.max_by(|a, b| a.0.total_cmp(&b.0)) {
            Some((relative, bias)) => format!(
                "; not included: up to {} of {} ({})",
                percent(relative),
                bias.parameter,
                bias.effect
            ),
            None => String::new(),
        }
    }

    /// Errors beside the statistical one, parameter by parameter.
    fn write_uncertainty(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let mut numerics = Vec::new();
        for (e, error) in self.parameters.iter().zip(&self.discretization_error) {
            let Some(relative) = error.relative else { continue };
            // Fractions of a value near zero mean nothing.
            let size = |part: f64| match (e.name.is_positive(), e.value) {
                (false, Some(value)) => format!("{:.1e} {}", part * value.abs(), e.name.unit()),
                _ => percent(part),
            };
            let rest = format!("at most {} of {}", size(relative).trim_end(), e.label());
            numerics.push(match error.correction {
                Some(by) => {
                    let sign = if by < 0.0 { "-" } else { "+" };
                    let by = size(by.abs());
                    format!(
                        "corrected by {sign}{}; {rest} remains (in the interval)",
                        by.trim_end()
                    )
                }
                None => rest,
            });
        }
        details(f, "Discretization error", &numerics)?;
        for e in &self.parameters {
            let (unit, label) = (e.name.unit(), e.label());
            let error = e.std_error.unwrap_or(0.0);
            let with = |error: f64, [low, high]: [f64; 2]| {
                let [size, low, high] = [error, low, high].map(|x| digits(x, error));
                format!("{label} +- {size} {unit}, 95 % [{low}, {high}]")
            };
            if let Some(observed) = e.observed_std_error {
                let text = format!("{label} +- {} {unit}", digits(observed, error));
                detail(f, "Observed information", text)?;
            }
            if let Some(across) = &e.cluster_jackknife {
                let (reported, other) = match across.reported {
                    true => ("reported", "too narrow"),
                    false => ("narrower", "reported"),
                };
                let differ = with(across.std_error, across.interval95);
                let text = format!("{differ} ({} experiments, {reported})", across.experiments);
                detail(f, "Between experiments", text)?;
                let own = with(across.residual_std_error, across.residual_interval95);
                detail(f, "Residuals alone", format!("{own} ({other})"))?;
            }
            if let Some(ends) = e.profile95 {
                let end = |x: Option<f64>| x.map_or("none".into(), |x| digits(x, error));
                let text = format!("{label} 95 % [{}, {}]", end(ends[0]), end(ends[1]));
                detail(f, "Profile likelihood", text)?;
            }
            if let Some(Bootstrap { std_error, interval95, .. }) = &e.bootstrap {
                detail(f, "Bootstrap", with(*std_error, *interval95))?;
            }
            budget::write(f, e)?;
        }
        let groups = self.determined_groups.iter().map(ToString::to_string);
        details(f, "Known without density", &groups.collect::<Vec<_>>())?;
        let several = self.parameters.len() > 1;
        let mut sensitivities = Vec::new();
        for e in self.parameters.iter().filter(|e| !e.input_sensitivities.is_empty()) {
            let of = if several { format!("{}: ", e.label()) } else { String::new() };
            sensitivities.push(format!("{of}{}", budget::per_cents(e)));
        }
        if !sensitivities.is_empty() {
            let advice = "of +1 % of an input; --known NAME=SIGMA includes input uncertainties";
            sensitivities.push(format!("({advice})"));
        }
        details(f, "Input sensitivities", &sensitivities)
    }

    /// Effects that the model omits.
    fn write_effects(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let likely = looks_like(&self.score_tests).into_iter();
        let likely: Vec<String> = likely.map(|words| Code::OmittedEffect.behind(words)).collect();
        details(f, "Likely omitted effects", &likely)?;
        let hidden = hidden(&self.undetected_bias).into_iter();
        let hidden: Vec<String> = hidden.map(|words| Code::UndetectedBias.behind(words)).collect();
        details(f, "Undetected bias", &hidden)
    }

    /// The numerics, and what of the data was used and how well it is explained.
    fn write_data(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let chosen = self.chosen_in_words().into_iter().take(NAMED_RESOLUTIONS);
        let chosen = chosen.map(|(words, count)| match count {
            1 => words,
            _ => format!("{words} ({count} experiments)"),
        });
        details(f, "Numerics", &chosen.collect::<Vec<_>>())?;
        let dropped = self.dropped.iter().map(|d| format!("{}: {}", d.observation, d.rows));
        details(f, "Rows left out", &dropped.collect::<Vec<_>>())?;
        let losses = self.losses.iter().map(|l| {
            format!(
                "{}: {} of {} values down-weighted, {} beyond 5 sigma; standard errors times {:.2}",
                l.observation, l.down_weighted, l.values, l.beyond_5_sigma, l.std_error_factor
            )
        });
        details(f, "Robust loss", &losses.collect::<Vec<_>>())?;
        let predictions = self.predictions.iter().map(|p| {
            let [(rms, unit), (expected, _)] =
                [p.rms, p.expected].map(|x| self.in_data_unit(x, &p.unit));
            format!("{}: RMS error {rms:.3e} {unit}, {expected:.3e} expected", p.observation)
        });
        details(f, "Validation data", &predictions.collect::<Vec<_>>())?;
        match &self.recordings {
            Some(recordings) => write!(f, "{recordings}"),
            None => Ok(()),
        }
    }

    /// Residuals beside the noise, the search and the work.
    fn write_cost(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let pairs = self.sigma.iter().zip(&self.units);
        let shown = |(s, unit): (&f64, &String)| {
            let (s, unit) = self.in_data_unit(*s, unit);
            format!("{s:.3e} {unit}")
        };
        let sigma: Vec<String> = pairs.map(shown).collect();
        let alike = sigma.chunk_by(|a, b| a == b).map(|same| match same.len() {
            ..3 => same.join(", "),
            n => format!("{} (of {n})", same[0]),
        });
        let sigma: Vec<String> = alike.collect();
        // Positions come before frequencies.
        let unit = self.units.iter().find(|unit| **unit == "m").or(self.units.first());
        let unit = unit.map_or("m", String::as_str);
        let (rms, unit) = self.in_data_unit(self.residual_rms, unit);
        let rms = format!("RMS {rms:.3e} {unit}, sigma {}", sigma.join(", "));
        detail(f, "Residuals", rms)?;
        if let Some(words) = self.noise_scale_in_words() {
            detail(f, "Noise scale", words)?;
        }
        if !self.local_minima.summary.is_empty() {
            detail(f, "Search", &self.local_minima.summary)?;
        }
        let text = format!("{:.1} simulations, {:.3} s", self.simulations, self.wall_seconds);
        write!(f, "  {:<LABEL$}{text}", "Cost")
    }

    /// The noise that differences of the samples show: its range over all coordinates, or why there is none.
    fn noise_scale_in_words(&self) -> Option<String> {
        let values: Vec<f64> = self.noise_scale.iter().filter_map(|scale| scale.value).collect();
        let first = self.noise_scale.first()?;
        let unit = &first.unit;
        let [low, high] =
            values.iter().fold([f64::INFINITY, 0.0], |[low, high], x| [x.min(low), x.max(high)]);
        let missing = self.noise_scale.iter().find_map(|scale| scale.unavailable.as_ref());
        let shown = match values.len() {
            0 => {
                let reason = missing?;
                return Some(format!(
                    "not independent ({reason}): misfit and noise cannot be separated; state sigma"
                ));
            }
            1 => format!("{low:.3e} {unit}"),
            _ => format!("{low:.3e} to {high:.3e} {unit}"),
        };
        let of = match values.len() == self.noise_scale.len() {
            true => String::new(),
            false => format!(" ({} of {} coordinates)", values.len(), self.noise_scale.len()),
        };
        Some(format!("{shown} from differences of the samples{of}"))
    }
}

/// Whether an input with a stated uncertainty contributes.
fn has_known_inputs(e: &Estimate) -> bool {
    e.expanded95.is_some() && e.budget.iter().any(|line| line.std.is_some())
}

/// Estimate, standard error and the interval that is to be quoted.
fn cells(e: &Estimate) -> [String; 3] {
    if let Some(lower) = e.lower95 {
        return ["-".into(), "-".into(), format!("at least {lower:.2e} (one-sided)")];
    }
    match (e.value, e.std_error, e.interval95) {
        (Some(value), None, Some([_, upper])) if e.upper95.is_some() => {
            [format!("{value:.2e}"), "-".into(), format!("at most {upper:.2e} (one-sided)")]
        }
        (Some(value), Some(error), Some(ends)) => {
            let quoted = e.expanded95.filter(|_| has_known_inputs(e));
            let error_there = e.combined_std.filter(|_| quoted.is_some()).unwrap_or(error);
            [
                digits(value, error),
                relative_error(e, error_there),
                interval_of(quoted.unwrap_or(ends), error_there),
            ]
        }
        (Some(value), ..) => [format!("{value:e}"), "-".into(), "no error".into()],
        _ => ["not identifiable".into(), String::new(), String::new()],
    }
}

/// An error in per cent of what is positive, else in the unit of the parameter.
fn relative_error(e: &Estimate, error: f64) -> String {
    match e.value.filter(|value| e.name.is_positive() && *value > 0.0) {
        Some(value) => two_digits(100.0 * error / value) + " %",
        None => format!("{} {}", digits(error, error), e.name.unit()).trim_end().into(),
    }
}

fn two_digits(value: f64) -> String {
    match value.abs() {
        1e-3..100.0 => {
            let after = (1 - value.abs().log10().floor() as i32).clamp(0, 5) as usize;
            format!("{value:.after$}")
        }
        _ => format!("{value:.1e}"),
    }
}

fn interval_of([low, high]: [f64; 2], error: f64) -> String {
    format!("[{}, {}]", digits(low, error), digits(high, error))
}
