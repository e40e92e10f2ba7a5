//! Counts and medians over the fits of a kind or a camera, their comparison with requirements, and the lines that print them.

use crate::laboratory::Camera;
use crate::outcome::{COVERING, Outcome};
use std::collections::BTreeMap;

/// Required share of fits that name the cause.
const NAMED: f64 = 2.0 / 3.0;
/// Required share of listed biases that cover the true one.
const COVERED_BIASES: f64 = 0.75;
/// Upper limit of the median ratio of a listed to a true bias.
const MEDIAN_RATIO: f64 = 3.0;
/// Required share of fits of right models that are graded without reservation.
const UNRESERVED: f64 = 0.96;

/// Outcomes of several fits.
#[derive(Default)]
pub struct Tally<'a> {
    outcomes: Vec<&'a Outcome>,
}

/// The median of values; the mean of the two middle ones of an even number, NaN of none.
fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    match values.len() {
        0 => f64::NAN,
        n if n % 2 == 1 => values[n / 2],
        n => 0.5 * (values[n / 2 - 1] + values[n / 2]),
    }
}

/// Whether a requirement on `value` is met, as text; values of no fits are NaN.
fn verdict(value: f64, is_met: bool) -> &'static str {
    match (value.is_nan(), is_met) {
        (true, _) => "no data",
        (_, true) => "met",
        (_, false) => "MISSED",
    }
}

impl<'a> Tally<'a> {
    /// Collects references to outcomes; they need not be in order.
    pub fn new(outcomes: impl IntoIterator<Item = &'a Outcome>) -> Self {
        Self { outcomes: outcomes.into_iter().collect() }
    }

    /// Whether there are no outcomes.
    pub fn is_empty(&self) -> bool {
        self.outcomes.is_empty()
    }

    /// Number of outcomes.
    fn len(&self) -> usize {
        self.outcomes.len()
    }

    /// Number of fits for which a predicate holds.
    fn count(&self, predicate: impl Fn(&Outcome) -> bool) -> usize {
        self.outcomes.iter().filter(|o| predicate(o)).count()
    }

    /// Share of fits for which a predicate holds; NaN without fits.
    fn share(&self, predicate: impl Fn(&Outcome) -> bool) -> f64 {
        self.count(predicate) as f64 / self.len() as f64
    }

    /// Listed over true bias of all fits.
    fn ratios(&self) -> Vec<f64> {
        self.outcomes.iter().map(|o| o.bias_ratio).collect()
    }

    /// The heading of the lines of wrong models.
    pub fn header() -> String {
        format!(
            "  {:<34} {:>5} {:>10} {:>7} {:>6} {:>9} {:>13}",
            "", "fits", "unreserved", "silent", "named", ">= 0.8", "median ratio"
        )
    }

    /// The line of a wrong model: its counts and median ratio.
    pub fn row(&self, name: &str) -> String {
        format!(
            "  {name:<34} {:>5} {:>10} {:>7} {:>6} {:>9} {:>13.2}",
            self.len(),
            self.count(|o| o.unreserved),
            self.count(Outcome::is_silent),
            self.count(|o| o.named),
            self.count(|o| o.bias_ratio >= COVERING),
            median(self.ratios())
        )
    }

    /// The line of a right model: its counts and medians.
    pub fn right_row(&self, name: &str) -> String {
        let covered = self.count(|o| o.covered == Some(true));
        let intervals = self.count(|o| o.covered.is_some());
        format!(
            "  {name:<40} {:>5} {:>10} {covered:>4}/{intervals:<4} {:>9.2} % {:>8.2}",
            self.len(),
            self.count(|o| o.unreserved),
            100.0 * median(self.changes()),
            median(self.size_ratios())
        )
    }

    /// The heading of the lines of right models.
    pub fn right_header() -> String {
        format!(
            "  {:<40} {:>5} {:>10} {:>9} {:>11} {:>8}",
            "", "fits", "unreserved", "covered", "listed", "ratio"
        )
    }

    /// The median of listed over true biases of wrong models and over plausible sizes of right models.
    pub fn overall_ratio(&self) -> String {
        let wrong = self.outcomes.iter().filter(|o| o.has_term).map(|o| o.bias_ratio);
        let ratio = median(wrong.chain(self.size_ratios()).collect());
        let verdict = verdict(ratio, ratio < MEDIAN_RATIO);
        format!(
            "median of listed over true or plausible bias: {ratio:.2} (below {MEDIAN_RATIO}: {verdict})"
        )
    }

    /// Listed relative changes of E by all effects of all fits.
    fn changes(&self) -> Vec<f64> {
        self.outcomes.iter().flat_map(|o| o.changes.iter().copied()).collect()
    }

    /// Ratios of the listed to the plausible size of each omitted effect, of all fits.
    fn size_ratios(&self) -> Vec<f64> {
        self.outcomes.iter().flat_map(|o| o.size_ratios.iter().copied()).collect()
    }

    /// Text with the number of fits of each grade; fits without a grade count as `failed`.
    pub fn grades(&self) -> String {
        let mut counts = BTreeMap::new();
        for outcome in &self.outcomes {
            *counts.entry(outcome.grade.unwrap_or("failed")).or_insert(0) += 1;
        }
        let counts: Vec<String> =
            counts.into_iter().map(|(grade, count)| format!("{grade} {count}")).collect();
        format!("  grades: {}", counts.join(", "))
    }

    /// The share of silent fits.
    pub fn silence(&self, name: &str, camera: &Camera) -> String {
        let (silent, limit) = (self.share(Outcome::is_silent), camera.accepted_silent);
        format!(
            "  silent, {name}: {} of {}, {:.1} % (at most {:.0} %: {})",
            self.count(Outcome::is_silent),
            self.len(),
            100.0 * silent,
            100.0 * limit,
            verdict(silent, silent <= limit)
        )
    }

    /// The share of fits that name the cause.
    pub fn naming(&self, name: &str) -> String {
        let named = self.share(|o| o.named);
        format!(
            "  cause named, {name}: {} of {}, {:.1} % (poor camera: at least {:.0} %: {})",
            self.count(|o| o.named),
            self.len(),
            100.0 * named,
            100.0 * NAMED,
            verdict(named, named >= NAMED)
        )
    }

    /// Comparison of the listed undetected biases with the true ones.
    pub fn biases(&self, name: &str) -> String {
        let (covering, ratio) = (self.share(|o| o.bias_ratio >= COVERING), median(self.ratios()));
        format!(
            "  undetected bias, {name}: {} of {} at least {COVERING} of the true one, {:.1} % (at least {:.0} %: {}); \
             median ratio {ratio:.2} (below {MEDIAN_RATIO}: {})",
            self.count(|o| o.bias_ratio >= COVERING),
            self.len(),
            100.0 * covering,
            100.0 * COVERED_BIASES,
            verdict(covering, covering >= COVERED_BIASES),
            verdict(ratio, ratio < MEDIAN_RATIO)
        )
    }

    /// The requirements on right models.
    pub fn right_requirements(&self) -> String {
        let unreserved = self.share(|o| o.unreserved);
        let intervals = self.count(|o| o.covered.is_some());
        let covered = self.count(|o| o.covered == Some(true));
        let ratio = median(self.size_ratios());
        format!(
            "  unreserved {:.1} % (at least {:.0} %: {}); covered {covered} of {intervals}; median listed over plausible \
             size {ratio:.2} (below {MEDIAN_RATIO}: {})",
            100.0 * unreserved,
            100.0 * UNRESERVED,
            verdict(unreserved, unreserved >= UNRESERVED),
            verdict(ratio, ratio < MEDIAN_RATIO)
        )
    }
}
