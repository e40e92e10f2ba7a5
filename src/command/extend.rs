//! `rodfit fit --extend`

use crate::command::terminal;
use rodfit::Error;
use rodfit::fit::{FitFile, FitReport, Grade};

/// Fits again with the terms that may explain what the `first` report leaves, one at a time, and returns the best fit:
/// the first one where none is better.
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
        match report.improves_on(&first) {
            true if is_best => best = Some((candidate.file, report, candidate.term)),
            true => {}
            false => {
                let why = if report.converged { "no better" } else { "not converged" };
                failed.push(format!("{} ({why})", candidate.term));
            }
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
            terminal::tell(format_args!("extended, as what is left looks like {term}"));
            Ok((file, report))
        }
        None if failed.is_empty() => {
            terminal::tell(format_args!("not extended: noise explains what is left"));
            Ok((file, first))
        }
        None => Ok((file, first.not_extended(&failed))),
    }
}
