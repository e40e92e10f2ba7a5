//! How far a campaign is.

use crate::campaign::collect::Collected;
use crate::summary::{Summary, SummaryTable, TextColumn, Tone, duration};
use serde::Serialize;
use std::collections::BTreeSet;
use std::fmt;

/// How far a campaign is. Fits that two rows of the plan have in common count once.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct Status {
    /// Fits that are planned.
    pub tasks: usize,
    /// Fits that have a result.
    pub done: usize,
    /// Of them, how many ended with each exit code of `rodfit fit`: 0, 2 and 3.
    pub codes: [usize; 3],
    /// Wall time of all that are done, s.
    pub seconds: f64,
    /// Of the longest, s.
    pub longest_seconds: f64,
}

/// Exit codes of fits.
const CODES: [u8; 3] = [0, 2, 3];

impl Status {
    /// Of results.
    pub fn of(collected: &Collected) -> Self {
        let mut status =
            Self { tasks: 0, done: 0, codes: [0; 3], seconds: 0.0, longest_seconds: 0.0 };
        let mut seen = BTreeSet::new();
        for (task, record) in collected.results() {
            if !seen.insert(&task.id) {
                continue;
            }
            status.done += 1;
            for (count, code) in status.codes.iter_mut().zip(CODES) {
                // What the program writes itself has its keys in alphabetical order.
                *count += usize::from(record.result.starts_with(&format!("{{\"code\":{code},")));
            }
            status.seconds += record.about.wall_seconds;
            status.longest_seconds = status.longest_seconds.max(record.about.wall_seconds);
        }
        status.tasks =
            status.done + collected.missing().map(|task| &task.id).collect::<BTreeSet<_>>().len();
        status
    }

    /// Fits that have no result.
    pub fn left(&self) -> usize {
        self.tasks - self.done
    }
}

impl fmt::Display for Status {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.summary().fmt(f)
    }
}

impl Status {
    /// The state of the campaign as text for a terminal.
    pub fn summary(&self) -> Summary {
        let [usable, refused, other] = self.codes;
        let status = format!("{} of {} fits have a result", self.done, self.tasks);
        let tone = match self.left() {
            0 => Tone::Good,
            _ => Tone::Doubtful,
        };
        let mut summary = Summary::new(status, tone);
        if self.done == 0 {
            return summary;
        }
        let mut table = SummaryTable::new([TextColumn::left("result"), TextColumn::right("fits")]);
        let all = [("usable", usable), ("not usable", other), ("rejected as bad input", refused)];
        for (name, count) in all {
            table.row([name.to_string(), count.to_string()]);
        }
        if self.left() > 0 {
            table.row(["no result yet".to_string(), self.left().to_string()]);
        }
        summary = summary.table("", table).warnings(Vec::<String>::new());
        let mean = self.seconds / self.done as f64;
        let text =
            format!("{} on average, {} at most", duration(mean), duration(self.longest_seconds));
        summary = summary.fact("Time of a fit", text);
        if self.left() > 0 {
            let text = format!("about {} on one processor", duration(self.left() as f64 * mean));
            summary = summary.fact("Remaining time", text);
        }
        summary
    }
}
