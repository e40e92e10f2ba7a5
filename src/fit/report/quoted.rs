//! Rows of the table of estimates with their quoted intervals, for the terminal and the pages.
//!
//! Input: estimates, and combinations of parameters that the data determine. The quoted interval is the expanded one
//! (GUM), with the combined standard uncertainty, if inputs have stated uncertainties. It is then followed by a row
//! with the statistical one, with the standard error. Else the statistical one is quoted. A one-sided bound replaces
//! it. Output: [`QuotedEstimate`] rows: the parameters in order, then the combinations that have an interval. Value,
//! error and interval are in the parameter's unit, the relative error is a fraction (of combinations, and of positive
//! values of positive parameters). Parameters that are not identifiable have no numbers. [`quoted_estimates`] makes the
//! rows. `size` is the number by which a page chooses the unit of a row. [`error_heading`] and [`interval_heading`] are
//! the headings of the columns.

use crate::fit::uncertainty::covariance::determined_groups::DeterminedGroup;
use crate::fit::uncertainty::estimate::Estimate;

/// A 95 % interval or one-sided bound, in the unit of the parameter.
#[derive(Clone, Copy)]
pub(crate) enum QuotedInterval {
    Between([f64; 2]),
    /// Bounded from below only.
    AtLeast(f64),
    /// Bounded from above only.
    AtMost(f64),
}

/// A row of the table of estimates. A parameter that is not identifiable has no numbers.
pub(crate) struct QuotedEstimate {
    pub label: String,
    pub unit: String,
    pub value: Option<f64>,
    /// Standard error, or combined standard uncertainty.
    pub std: Option<f64>,
    /// The same as a fraction of a positive value; none of other values.
    pub relative: Option<f64>,
    pub interval: Option<QuotedInterval>,
    /// Whether the interval is the expanded one.
    pub is_expanded: bool,
    /// Whether this is the statistical part of the estimate of the row above.
    pub is_part: bool,
}

impl QuotedEstimate {
    /// The row of an estimate with its quoted interval: expanded, with the combined standard uncertainty, if a budget
    /// line has a stated uncertainty; else statistical, with the standard error.
    pub fn new(e: &Estimate) -> Self {
        // Without a stated input uncertainty the statistical interval is the one to quote.
        let has_inputs = e.budget.iter().any(|line| line.std.is_some());
        match e.expanded95.zip(e.combined_std).filter(|_| has_inputs) {
            Some((ends, std)) => {
                Self { is_expanded: true, ..Self::with_interval(e, Some(std), Some(ends)) }
            }
            None => Self::with_interval(e, e.std_error, e.interval95),
        }
    }

    /// The row of the estimate `e` with this standard error `std` and the `ends` of its interval. One-sided bounds of
    /// the estimate replace the interval, the lower one first; without ends there is none.
    fn with_interval(e: &Estimate, std: Option<f64>, ends: Option<[f64; 2]>) -> Self {
        let positive = e.value.filter(|value| e.name.is_positive() && *value > 0.0);
        // A bound replaces the interval of a parameter that the data bound from one side only.
        let interval = match (e.lower95, e.upper95, ends) {
            (Some(lower), ..) => Some(QuotedInterval::AtLeast(lower)),
            (_, Some(upper), _) => Some(QuotedInterval::AtMost(upper)),
            (_, _, ends) => ends.map(QuotedInterval::Between),
        };
        Self {
            label: e.label(),
            unit: e.name.unit().into(),
            value: e.value,
            std,
            relative: std.zip(positive).map(|(std, value)| std / value),
            interval,
            is_expanded: false,
            is_part: false,
        }
    }

    /// The row of a combination of parameters that are not identifiable by themselves, with its 95 % interval. `None`
    /// for groups without an interval, the ratios to the density.
    fn from_combination(group: &DeterminedGroup) -> Option<Self> {
        Some(Self {
            label: group.name.clone(),
            unit: group.unit.clone(),
            value: Some(group.value),
            std: Some(group.value * group.relative_std_error),
            relative: Some(group.relative_std_error),
            interval: Some(QuotedInterval::Between(group.interval95?)),
            is_expanded: false,
            is_part: false,
        })
    }

    /// The number by which the page chooses the unit of the row: the lower bound, or else the estimate if it is not
    /// zero, or else the upper bound; zero without these.
    #[cfg(feature = "page")]
    pub fn size(&self) -> f64 {
        match (self.interval, self.value.filter(|value| *value != 0.0)) {
            (Some(QuotedInterval::AtLeast(bound)), _) => bound,
            (_, Some(value)) => value,
            (Some(QuotedInterval::AtMost(bound)), None) => bound,
            _ => 0.0,
        }
    }
}

/// The rows of the table of estimates: all `parameters` in order, each followed by the statistical part if its interval
/// is expanded, then the combinations in `groups` that have an interval.
pub(crate) fn quoted_estimates(
    parameters: &[Estimate],
    groups: &[DeterminedGroup],
) -> Vec<QuotedEstimate> {
    let mut rows = Vec::new();
    for e in parameters {
        let quoted = QuotedEstimate::new(e);
        let part = QuotedEstimate::with_interval(e, e.std_error, e.interval95);
        // The statistical part follows only where it differs from the quoted interval.
        let has_part = quoted.is_expanded && e.std_error.is_some() && e.interval95.is_some();
        rows.push(quoted);
        rows.extend(has_part.then(|| QuotedEstimate {
            label: "statistical only".into(),
            is_part: true,
            ..part
        }));
    }
    rows.extend(groups.iter().filter_map(QuotedEstimate::from_combination));
    rows
}

/// The column heading of the errors on a terminal: `std. uncertainty`, the term of the GUM, if any interval is
/// expanded, else `standard error`.
pub(crate) fn error_heading(rows: &[QuotedEstimate]) -> &'static str {
    match rows.iter().any(|row| row.is_expanded) {
        true => "std. uncertainty",
        false => "standard error",
    }
}

/// The column heading of the intervals: `95 % interval`, followed by `(expanded)` if any of the `rows` is expanded.
pub(crate) fn interval_heading(rows: &[QuotedEstimate]) -> &'static str {
    match rows.iter().any(|row| row.is_expanded) {
        true => "95 % interval (expanded)",
        false => "95 % interval",
    }
}
