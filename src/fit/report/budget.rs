//! The budget of an estimate, as the terminal shows it.

use crate::fit::report::digits;
use crate::fit::uncertainty::estimate::Estimate;
use crate::fit::uncertainty::sources::{BudgetLine, InputSensitivity};
use std::fmt;

/// So many of the numbers that matter most are named.
const NAMED: usize = 3;

/// The budget of an estimate, where an input has a stated uncertainty, and the Monte Carlo check.
pub(crate) fn write(f: &mut fmt::Formatter<'_>, e: &Estimate) -> fmt::Result {
    let unit = e.name.unit();
    if let (Some(combined), Some(factor)) = (e.combined_std, e.coverage_factor)
        && e.budget.iter().any(|line| line.std.is_some())
    {
        let one = digits(combined, combined);
        writeln!(
            f,
            "  Uncertainty budget      {}: combined standard uncertainty {one} {unit}, k = {factor:.2}",
            e.label()
        )?;
        let width = e.budget.iter().map(|line| line.source.len()).max().unwrap_or(0);
        for line in &e.budget {
            writeln!(f, "      {:<width$}  {}", line.source, words(line, unit))?;
        }
    }
    if let Some(found) = &e.monte_carlo {
        let [std, linear] = [found.std, found.linear_std].map(|x| digits(x, x));
        let [low, high] = found.interval95.map(|x| digits(x, found.std));
        writeln!(
            f,
            "  Monte Carlo             {} +- {std} {unit}, 95 % [{low}, {high}] ({} fits; budget +- {linear})",
            e.label(),
            found.fits
        )?;
    }
    Ok(())
}

fn words(line: &BudgetLine, unit: &str) -> String {
    let own = line.std.map(|std| format!("+- {} {}", digits(std, std), line.unit));
    let own = own.map(|own| own.trim_end().to_string());
    let relative = line.relative_sensitivity.map(|by| format!("relative sensitivity {by:+.2}"));
    let contribution = format!("{} {unit}", digits(line.contribution, line.contribution));
    let share = format!("{:.1} %", 100.0 * line.share);
    let parts = [own, relative, Some(contribution.trim_end().into()), Some(share)];
    parts.into_iter().flatten().collect::<Vec<_>>().join(", ")
}

/// What one per cent of the numbers that matter most would change.
pub(crate) fn per_cents(e: &Estimate) -> String {
    let words = |per_cent: &InputSensitivity| {
        let change = match per_cent.relative {
            Some(relative) => format!("{:+.2} %", 100.0 * relative),
            None => format!("{:+.1e} {}", per_cent.change, e.name.unit()),
        };
        format!("{} {}", per_cent.source, change.trim_end())
    };
    let named: Vec<String> = e.input_sensitivities.iter().take(NAMED).map(words).collect();
    named.join(", ")
}
