//! The summary of a planned experiment as text and tables for a terminal.
//!
//! Input: a [`Design`]. [`Design::summary`] begins with whether the plan determines all parameters, or how many it
//! does not. It shows their expected standard errors, the unidentifiable ones and the warnings. Then follow the
//! uncertainty budget, undetected biases, tables of candidate designs, and the cost. There is one such table for each
//! recording or experiment and variable (marker position in m, duration in s, frames/s), with the marks `planned` and
//! `best`. Tables without any standard error are left out. Correlations, singular values and contributions are not
//! shown. Standard errors are in per cent of positive parameters, else in the unit.

use crate::code::Code;
use crate::fit::design::report::{Advice, Choice, Design, DesignVariable};
use crate::fit::report::budget;
use crate::fit::report::effects::add_undetected_bias;
use crate::fit::report::estimate_table::{estimate_table, relative_error};
use crate::fit::report::quoted::quoted_estimates;
use crate::fit::uncertainty::estimate::Estimate;
use crate::summary::quantity::{duration, number};
use crate::summary::{Summary, SummaryTable, TextColumn, Tone};
use std::fmt;

impl fmt::Display for Design {
    /// Writes [`Design::summary`] as text.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.summary().fmt(f)
    }
}

impl Design {
    /// The report as text for a terminal. The first line is whether the plan determines all parameters, or how many it
    /// does not. Then follow standard errors, unidentifiable parameters, warnings, budget, undetected biases, tables of
    /// candidate designs, and the cost. Tables without any standard error are left out. Correlations, singular values
    /// and contributions are not shown.
    pub fn summary(&self) -> Summary {
        let unknown = self.parameters.iter().filter(|e| !e.identifiable).count();
        let mut summary = match (unknown, self.parameters.len()) {
            (0, _) => Summary::new(
                "expected uncertainty of the planned experiment, with these values of the parameters",
                Tone::Good,
            ),
            (n, all) => Summary::new(
                format!("the plan does not determine {n} of {all} parameters"),
                Tone::Bad,
            )
            .with_code(Some(Code::NotIdentifiable)),
        };
        summary =
            summary.table("", estimate_table(&quoted_estimates(&self.parameters, &[]), "value"));
        for finding in &self.not_identifiable {
            summary = summary.note(format!("not identifiable: {}", finding.description));
        }
        // These parameters need another experiment, not another recording of this one.
        for label in &self.never_identifiable {
            let text = format!(
                "{label}: not identifiable with any other marker, duration or frame rate either"
            );
            summary = summary.note(text);
        }
        // Warnings precede budget, biases and candidate designs.
        summary = summary.warnings(&self.warnings);
        summary = self.parameters.iter().fold(summary, budget::add_budget);
        summary = add_undetected_bias(summary, &self.undetected_bias);
        // Tables without any standard error have no information.
        let determines = |choice: &Choice| choice.std_error.iter().any(Option::is_some);
        for advice in self.advice.iter().filter(|advice| advice.choices.iter().any(determines)) {
            summary = summary.table(advice.title(), advice.table(&self.parameters));
        }
        let cost =
            format!("{} simulations, {}", number(self.simulations, 2), duration(self.wall_seconds));
        summary.fact("Cost", cost)
    }
}

impl Advice {
    /// The title of the table: the design variable, and the recording or experiment in parentheses if it has a name.
    fn title(&self) -> String {
        let title = match self.variable {
            DesignVariable::MarkerPosition => "Expected standard error by marker position",
            DesignVariable::Duration => "Expected standard error by duration",
            DesignVariable::FrameRate => "Expected standard error by frame rate",
        };
        match self.observation.is_empty() {
            true => title.into(),
            false => format!("{title} ({})", self.observation),
        }
    }

    /// The table of the choices, a row each: value (unit in the heading), standard error of each of the `parameters`,
    /// and the marks `planned` and `best`. Errors are in per cent of a positive parameter, in the unit of another, and
    /// `-` if unidentified.
    fn table(&self, parameters: &[Estimate]) -> SummaryTable {
        let heading = match self.variable {
            DesignVariable::MarkerPosition => "m from the clamp",
            DesignVariable::Duration => "s",
            DesignVariable::FrameRate => "frames/s",
        };
        let mut columns = vec![TextColumn::right(heading)];
        columns.extend(parameters.iter().map(|e| TextColumn::right(e.label())));
        columns.push(TextColumn::left("choice"));
        let mut table = SummaryTable::new(columns);
        for Choice { value, std_error, planned, best } in &self.choices {
            let mut row = vec![number(*value, 3)];
            for (e, error) in parameters.iter().zip(std_error) {
                row.push(error.map_or("-".into(), |error| relative_error(e, error)));
            }
            let marks = [(*planned, "planned"), (*best, "best")];
            let marks: Vec<&str> = marks.iter().filter(|(is, _)| *is).map(|(_, m)| *m).collect();
            row.push(marks.join(", "));
            table.row(row);
        }
        table
    }
}
