//! `rodfit fit --extend`

use crate::command::terminal;
use rodfit::Error;
use rodfit::fit::{FitFile, FitReport, Grade};

/// Fits again with each effect that may explain the residuals of the `first` fit, one at a time, and returns the best
/// fit, or the first where none is better.
pub fn extended(
    file: FitFile,
    first: FitReport,
    solve: impl Fn(&FitFile) -> Result<FitReport, Error>,
) -> Result<(FitFile, FitReport), Error> {
    let mut best: Option<(FitFile, FitReport, String)> = None;
    let mut failed = Vec::new();
    for candidate in file.extensions(&first)? {
        let report = match solve(&candidate.file) {
            Ok(report) => report,
            Err(Error::Interrupted) => break,
            Err(error) => {
                failed.push(format!("{} ({error})", candidate.term));
                continue;
            }
        };
        if report.interrupted {
            break;
        }
        let is_best = best.as_ref().is_none_or(|(_, other, _)| {
            (report.grade, report.residual_rms) < (other.grade, other.residual_rms)
        });
        if !report.improves_on(&first) {
            let why = if report.converged { "no better" } else { "not converged" };
            failed.push(format!("{} ({why})", candidate.term));
        } else if is_best {
            best = Some((candidate.file, report, candidate.term));
        }
        if best.as_ref().is_some_and(|(_, report, _)| report.grade == Grade::Trustworthy) {
            break;
        }
    }
    for term in &failed {
        terminal::tell(format_args!("tried without success: {term}"));
    }
    match best {
        Some((file, report, term)) => {
            terminal::tell(format_args!("extended with {term}, which explains the residuals best"));
            Ok((file, report))
        }
        None if failed.is_empty() => {
            terminal::tell(format_args!("not extended: no omitted effect explains the residuals"));
            Ok((file, first))
        }
        None => Ok((file, first.not_extended(&failed))),
    }
}
