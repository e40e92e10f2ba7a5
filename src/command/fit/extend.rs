//! `rodfit fit --extend`: refits with one omitted effect added, for each effect that may explain the residuals.
//!
//! The significant score tests of the first fit propose candidates, such as a compliant clamp. Each candidate adds one
//! effect to the original fit file. A refit improves on the first if it converged, its grade is no worse, and twice its
//! log-likelihood is higher by more than 4. The last is not required if the first did not converge. Of these the one
//! with the best grade wins, then the smallest RMS residual. The fit file becomes that of the best one. Another one
//! that explains the residuals as well, with a contradicting value of a parameter, becomes a warning, and a better
//! grade becomes correlated-or-missing. Without an improvement file and report are those of the first fit, with a
//! warning that has the candidates tried, if there are any. An interruption ends the refits; the completed ones count.
//! Rejected candidates, and those whose refit fails, are printed as notes. So are the units of measurements that the
//! comparison leaves out: it is by the RMS residual of positions, or of one unit without positions. An error is
//! returned only if the candidates cannot be made.

use crate::command::terminal;
use rodfit::Error;
use rodfit::fit::{FitFile, FitReport};

/// A refit with one additional effect that improves on the first fit: its fit file, the effect's name, and its report.
struct BetterFit {
    file: FitFile,
    /// Name of the effect.
    term: String,
    report: FitReport,
}

/// Refits with each effect that may explain the residuals of the `first` report, one at a time, by `solve`. Sets `file`
/// to that of the best refit that improves on the first (best grade, then smallest RMS residual) and returns its
/// report. Another improving refit that explains the residuals as well, with a contradicting value, adds a warning, and
/// a better grade becomes correlated-or-missing. Without an improving refit it returns the first report, with a warning
/// if any candidate was tried. Candidates without improvement are printed. An interruption ends the search with the
/// refits so far. Error: the candidates cannot be made; a refit that fails is a candidate without improvement.
pub fn extended_fit(
    file: &mut FitFile,
    first: FitReport,
    solve: impl Fn(&FitFile) -> Result<FitReport, Error>,
) -> Result<FitReport, Error> {
    let mut better: Vec<BetterFit> = Vec::new();
    let mut failed = Vec::new();
    let mut is_interrupted = false;
    // Each candidate adds one effect to the original fit file.
    for candidate in file.extensions(&first)? {
        let report = match solve(&candidate.file) {
            Ok(FitReport { interrupted: true, .. }) | Err(Error::Interrupted) => {
                is_interrupted = true;
                break;
            }
            Ok(report) => report,
            Err(error) => {
                failed.push(format!("{} ({error})", candidate.term));
                continue;
            }
        };
        if report.improves_on(&first) {
            better.push(BetterFit { file: candidate.file, term: candidate.term, report });
        } else {
            let why = if report.converged { "no better" } else { "not converged" };
            failed.push(format!("{} ({why})", candidate.term));
        }
    }
    // Rejected candidates are printed, so that the user can exclude them.
    for term in &failed {
        terminal::print_note(format_args!("tested without improvement: {term}"));
    }
    let others = uncompared_units(&first);
    let is_compared = !better.is_empty() || !failed.is_empty();
    if is_compared && !others.is_empty() {
        terminal::print_note(format_args!(
            "fits are compared by their residuals in {}; those in {} are left out of the comparison",
            match compared_unit(&first) {
                "" => "no unit",
                unit => unit,
            },
            others.join(", ")
        ));
    }
    // All better fits are compared: several effects may explain the residuals, with different values of the parameters.
    better.sort_by(|BetterFit { report: a, .. }, BetterFit { report: b, .. }| {
        a.grade.cmp(&b.grade).then(a.residual_rms.total_cmp(&b.residual_rms))
    });
    let mut better = better.into_iter();
    let Some(best) = better.next() else {
        if failed.is_empty() {
            let text = match is_interrupted {
                true => "not extended: interrupted",
                false => "not extended: no omitted effect explains the residuals",
            };
            terminal::print_note(text);
            return Ok(first);
        }
        return Ok(first.not_extended(&failed));
    };
    let text = "which explains the residuals best";
    terminal::print_note(format_args!("extended with {}, {text}", best.term));
    *file = best.file;
    let others: Vec<_> = better.map(|other| (other.term, other.report)).collect();
    Ok(best.report.among_alternatives(&others))
}

/// The unit of the RMS residual of a report: m if positions were measured, else rad/s, else that of the first
/// measurement.
fn compared_unit(report: &FitReport) -> &str {
    let has = |unit: &str| report.units.iter().any(|own| own == unit);
    match (has("m"), has("rad/s")) {
        (true, _) => "m",
        (false, true) => "rad/s",
        (false, false) => report.units.first().map_or("", String::as_str),
    }
}

/// The units of the measurements that the RMS residual of a report leaves out, each once; `no unit` for strains.
fn uncompared_units(report: &FitReport) -> Vec<&str> {
    let mut others: Vec<&str> = Vec::new();
    for unit in report.units.iter().filter(|unit| **unit != compared_unit(report)) {
        let unit = if unit.is_empty() { "no unit" } else { unit.as_str() };
        if !others.contains(&unit) {
            others.push(unit);
        }
    }
    others
}
