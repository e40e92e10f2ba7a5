//! Progress of a campaign: numbers of planned fits, of fits with a result by exit code, and the remaining time.
//!
//! Input are the collected results; each id counts once. [`Status`] has the number of planned fits and of those with a
//! result, and returns that of the others (`open_tasks`). It counts the exit codes 0 (usable), 2 (rejected input) and 3
//! (not usable), and has the sum and maximum of the wall times, s. It serializes to JSON. [`Status::summary`] is the
//! text: counts, mean and longest time, and the remaining time. That is the number of open fits times the mean wall
//! time of finished ones, on one processor. Without any result the text is one line.

use crate::campaign::collect::Collected;
use crate::summary::{ItemTable, Summary, Tone, duration};
use serde::Serialize;
use std::collections::BTreeSet;
use std::fmt;

/// Progress of a campaign. Fits that two rows of the plan have in common count once.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct Status {
    /// Planned fits.
    pub tasks: usize,
    /// Fits with a result.
    pub done: usize,
    /// Fits that ended with each exit code of `rodfit fit`: 0, 2 and 3.
    pub codes: [usize; 3],
    /// Sum of the wall times of all results, s.
    pub seconds: f64,
    /// Longest wall time, s.
    pub longest_seconds: f64,
}

/// Exit codes of fits that are counted: usable, rejected input, and not computed, not converged or not identifiable.
const CODES: [u8; 3] = [0, 2, 3];

impl Status {
    /// Counts the collected results by exit code, and sums their wall times, each id once; tasks without a result count
    /// too. Exit codes other than 0, 2 and 3 are in the number of results only.
    pub fn new(collected: &Collected) -> Self {
        let mut status =
            Self { tasks: 0, done: 0, codes: [0; 3], seconds: 0.0, longest_seconds: 0.0 };
        let mut seen = BTreeSet::new();
        for (_, record) in collected.results().filter(|(task, _)| seen.insert(&task.id)) {
            status.done += 1;
            for (count, code) in status.codes.iter_mut().zip(CODES) {
                // Stored results have their keys in alphabetical order: `code` is the first.
                *count += usize::from(record.result.starts_with(&format!("{{\"code\":{code},")));
            }
            status.seconds += record.context.wall_seconds;
            status.longest_seconds = status.longest_seconds.max(record.context.wall_seconds);
        }
        // Two rows of the plan may have one id.
        let missing: BTreeSet<_> = collected.missing().map(|task| &task.id).collect();
        status.tasks = status.done + missing.len();
        status
    }

    /// Number of fits without a result.
    pub fn open_tasks(&self) -> usize {
        self.tasks - self.done
    }

    /// The progress as text for a terminal: number of results, then counts by kind of result, mean and longest wall
    /// time of a fit, and remaining time if fits are open: their number times the mean, on one processor. The tone is
    /// good if no fit is open, else doubtful. Without any result only the first line.
    pub fn summary(&self) -> Summary {
        let [usable, rejected, unusable] = self.codes;
        let open = self.open_tasks();
        let status = format!("{} of {} fits have a result", self.done, self.tasks);
        let summary = Summary::new(status, if open == 0 { Tone::Good } else { Tone::Doubtful });
        if self.done == 0 {
            return summary;
        }
        let counts = [
            Some(("usable", usable)),
            Some(("not usable", unusable)),
            Some(("rejected as bad input", rejected)),
            Some(("no result yet", open)).filter(|_| open > 0),
        ];
        let table = ItemTable::new(counts.into_iter().flatten())
            .left("result", |(name, _)| name.to_string())
            .right("fits", |(_, count)| count.to_string());
        // Open fits are assumed to take the mean time of the finished ones.
        let mean = self.seconds / self.done as f64;
        let [average, longest] = [mean, self.longest_seconds].map(duration);
        let remaining = duration(open as f64 * mean);
        let remaining = (open > 0).then(|| format!("about {remaining} on one processor"));
        summary
            .table("", table)
            .details()
            .fact("Time of a fit", format!("{average} on average, {longest} at most"))
            .facts("Remaining time", remaining)
    }
}

impl fmt::Display for Status {
    /// Writes [`Status::summary`] as text.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.summary().fmt(f)
    }
}
