//! `rodfit fit --extend`

use crate::command::terminal;
use rodfit::Error;
use rodfit::fit::{FitFile, FitReport};

/// Fits again with each effect that may explain the residuals of the `first` fit, one at a time, and returns the best
/// fit, or the first where none is better.
pub fn extended(
    file: FitFile,
    first: FitReport,
    solve: impl Fn(&FitFile) -> Result<FitReport, Error>,
) -> Result<(FitFile, FitReport), Error> {
    let mut better: Vec<(FitFile, String, FitReport)> = Vec::new();
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
        if report.improves_on(&first) {
            better.push((candidate.file, candidate.term, report));
        } else {
            let why = if report.converged { "no better" } else { "not converged" };
            failed.push(format!("{} ({why})", candidate.term));
        }
    }
    for term in &failed {
        terminal::tell(format_args!("tested without improvement: {term}"));
    }
    // The values of all of them are compared, also after one without reservation: several effects may explain the
    // residuals, with different values of the parameters.
    better.sort_by(|(_, _, one), (_, _, other)| {
        let by_rms = one.residual_rms.total_cmp(&other.residual_rms);
        one.grade.cmp(&other.grade).then(by_rms)
    });
    let mut better = better.into_iter();
    match better.next() {
        Some((file, term, report)) => {
            terminal::tell(format_args!("extended with {term}, which explains the residuals best"));
            let others: Vec<_> = better.map(|(_, term, report)| (term, report)).collect();
            Ok((file, report.among_alternatives(&others)))
        }
        None if failed.is_empty() => {
            terminal::tell(format_args!("not extended: no omitted effect explains the residuals"));
            Ok((file, first))
        }
        None => Ok((file, first.not_extended(&failed))),
    }
}
