//! A design as the terminal shows it.

use crate::code::Code;
use crate::fit::design::told::{Advice, Choice, Design, DesignVariable};
use crate::fit::report::{budget, digits, hidden};
use crate::fit::uncertainty::estimate::Estimate;
use std::fmt;

impl fmt::Display for Design {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "expected of this plan, if the values are these")?;
        for warning in &self.warnings {
            writeln!(f, "warning: {warning}")?;
        }
        for finding in &self.not_identifiable {
            writeln!(f, "not identifiable: {}", finding.description)?;
        }
        let width = self.parameters.iter().map(|e| e.label().len()).fold(18, usize::max);
        for e in &self.parameters {
            let unit = e.name.unit();
            let label = e.label();
            if let Some(lower) = e.lower95 {
                writeln!(f, "  {label:<width$} 95 % at least {lower:.2e} {unit}")?;
                continue;
            }
            match (e.value, e.std_error, e.interval95) {
                (Some(_), None, Some([_, upper])) if e.upper95.is_some() => {
                    writeln!(f, "  {label:<width$} 95 % at most {upper:.2e} {unit}")?
                }
                (Some(value), Some(error), Some([low, high])) => writeln!(
                    f,
                    "  {label:<width$} {} +- {}   95 % [{}, {}]",
                    digits(value, error),
                    size(e, error),
                    digits(low, error),
                    digits(high, error)
                )?,
                _ => writeln!(f, "  {label:<width$} not identifiable")?,
            }
            budget::write(f, e)?;
        }
        for hidden in hidden(&self.undetected_bias) {
            writeln!(f, "  undetected bias: {}", Code::UndetectedBias.behind(hidden))?;
        }
        let tells = |choice: &Choice| choice.std_error.iter().any(Option::is_some);
        for advice in self.advice.iter().filter(|advice| advice.choices.iter().any(tells)) {
            advice.write(f, &self.parameters)?;
        }
        for label in &self.never_identifiable {
            writeln!(f, "{label}: not identifiable with any other marker, length or rate either")?;
        }
        write!(f, "{:.1} simulations, {:.3} s", self.simulations, self.wall_seconds)
    }
}

impl Advice {
    /// A table, a column for each parameter.
    fn write(&self, f: &mut fmt::Formatter<'_>, parameters: &[Estimate]) -> fmt::Result {
        let of = match (self.observation.is_empty(), self.variable) {
            (true, _) => String::new(),
            (false, DesignVariable::MarkerPosition) => format!(" of {}", self.observation),
            (false, _) => format!(" in {}", self.observation),
        };
        let (question, unit) = match self.variable {
            DesignVariable::MarkerPosition => ("where the marker", "m from the wall"),
            DesignVariable::Duration => ("how long to film", "s"),
            DesignVariable::FrameRate => ("how fast to film", "frames/s"),
        };
        writeln!(f, "{question}{of}: expected standard errors")?;
        let column = |e: &Estimate| e.label().len().max(12);
        write!(f, "  {unit:>16}")?;
        for e in parameters {
            write!(f, "  {:>1$}", e.label(), column(e))?;
        }
        writeln!(f)?;
        for Choice { value, std_error, planned, best } in &self.choices {
            write!(f, "  {:>16}", number(*value))?;
            for (e, error) in parameters.iter().zip(std_error) {
                let words = error.map_or("-".into(), |error| size(e, error));
                write!(f, "  {words:>0$}", column(e))?;
            }
            let marks = [(*planned, "planned"), (*best, "best")];
            let marks: Vec<&str> = marks.iter().filter(|(is, _)| *is).map(|(_, m)| *m).collect();
            writeln!(f, "{}{}", if marks.is_empty() { "" } else { "  " }, marks.join(", "))?;
        }
        Ok(())
    }
}

/// A standard error, in per cent of what is positive.
fn size(e: &Estimate, error: f64) -> String {
    match e.value.filter(|value| e.name.is_positive() && *value > 0.0) {
        Some(value) => format!("{} %", number(100.0 * error / value)),
        None => format!("{error:.1e} {}", e.name.unit()).trim_end().into(),
    }
}

/// Three digits.
fn number(value: f64) -> String {
    match value.abs() {
        0.001..1e4 => {
            let after = (2 - value.abs().log10().floor() as i32).clamp(0, 5) as usize;
            format!("{value:.after$}")
        }
        _ => format!("{value:.2e}"),
    }
}
