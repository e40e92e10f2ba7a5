//! How far a campaign is.

use crate::campaign::collect::Collected;
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
        let [usable, refused, other] = self.codes;
        write!(f, "{} of {} fits done", self.done, self.tasks)?;
        if self.done > 0 {
            writeln!(f, ": {usable} usable, {other} not, {refused} refused as input")?;
            let mean = self.seconds / self.done as f64;
            write!(f, "{mean:.3} s each, the longest {:.3} s", self.longest_seconds)?;
            if self.left() > 0 {
                write!(
                    f,
                    "; {} left, about {:.3} h on one processor",
                    self.left(),
                    self.left() as f64 * mean / 3600.0
                )?;
            }
        }
        Ok(())
    }
}
