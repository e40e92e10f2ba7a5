//! `rodfit fit --extend`: refits with the omitted effects that may explain the residuals.

use crate::command::terminal;
use rodfit::Error;
use rodfit::fit::{FitFile, FitReport};

/// A fit with one more effect that is better than the first.
struct BetterFit {
    file: FitFile,
    /// Name of the effect.
    term: String,
    report: FitReport,
}

/// Fits with each effect that may explain the residuals of the `first` fit, one at a time. Sets `file` to that of the
/// best fit and returns its report, or the first report if no fit is better.
pub fn extended_fit(
    file: &mut FitFile,
    first: FitReport,
    solve: impl Fn(&FitFile) -> Result<FitReport, Error>,
) -> Result<FitReport, Error> {
    let mut better: Vec<BetterFit> = Vec::new();
    let mut failed = Vec::new();
    // Each candidate adds one effect to the original fit file.
    for candidate in file.extensions(&first)? {
        let report = match solve(&candidate.file) {
            Ok(report) if report.interrupted => break,
            Err(Error::Interrupted) => break,
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
    for term in &failed {
        terminal::print_note(format_args!("tested without improvement: {term}"));
    }
    // All better fits are compared: several effects may explain the residuals, with different values of the parameters.
    better.sort_by(|BetterFit { report: a, .. }, BetterFit { report: b, .. }| {
        a.grade.cmp(&b.grade).then(a.residual_rms.total_cmp(&b.residual_rms))
    });
    let mut better = better.into_iter();
    let Some(best) = better.next() else {
        if failed.is_empty() {
            let text = "not extended: no omitted effect explains the residuals";
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
