//! Shards of a campaign: parts of the task list that are computed by separate processes.
//!
//! A task is in shard `i/n` (`i` from 0) if its id, a hexadecimal 128-bit hash read as a number, is `i` modulo `n`. So
//! shards are of nearly equal size and do not depend on the order of tasks. Input is the text `i/n` of the command
//! line, or the environment variables of a scheduler: Slurm job arrays first, then PBS job arrays and HyperQueue tasks.
//! Slurm's index is the job's less the first one, over the step, with the size of the array, else a given number, as
//! `n`; the others need a given `n`. Output: a [`Shard`], or None without a scheduler. Other texts, `i` not below `n`,
//! arrays with gaps and an unknown `n` are errors.

use crate::error::Error;
use std::str::FromStr;

/// One of several parts of a campaign: the tasks whose id, as a number, has the same remainder by the number of parts.
/// `0/3`, `1/3` and `2/3` are all tasks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    index: u128,
    count: u128,
}

/// The notation of shards, for error messages.
const ALLOWED: &str = "i/n with n of 1 or more, and i from 0 to n - 1";

impl FromStr for Shard {
    type Err = Error;

    /// Reads a shard from `i/n`, two whole numbers; spaces around them are allowed. Error: another text, or `i` not
    /// below `n`.
    fn from_str(text: &str) -> Result<Self, Error> {
        let invalid = || Error::invalid("--shard", text, ALLOWED);
        let (index, count) = text.split_once('/').ok_or_else(invalid)?;
        let number = |text: &str| text.trim().parse::<u64>().map_err(|_| invalid());
        Self::new(number(index)?, number(count)?).ok_or_else(invalid)
    }
}

impl Shard {
    /// Part `index`, counted from 0, of `count` parts of the tasks; `None` unless the index is below the count, so that
    /// the count is at least 1.
    fn new(index: u64, count: u64) -> Option<Self> {
        let (index, count) = (u128::from(index), u128::from(count));
        (index < count).then_some(Self { index, count })
    }

    /// Whether a task with this id (hexadecimal) is in the shard; false for a text that is no number.
    pub fn contains(&self, id: &str) -> bool {
        // Ids are hashes, so that their remainders are evenly distributed.
        u128::from_str_radix(id, 16).is_ok_and(|id| id % self.count == self.index)
    }

    /// The part that a scheduler assigns to this process, by its environment variables, which `variable` returns. Slurm
    /// job arrays come first, with the size of the array or else `count`; the index is that of the job less the first
    /// one, over the step. A PBS job array or the tasks of HyperQueue need `count`. None without a scheduler.
    ///
    /// # Errors
    ///
    /// Variables that are no numbers, an index outside the array as with gaps in it, and an unknown number of parts.
    pub fn from_scheduler(
        variable: impl Fn(&str) -> Option<String>,
        count: Option<u64>,
    ) -> Result<Option<Self>, Error> {
        let number = |name: &str| -> Result<Option<u64>, Error> {
            let Some(text) = variable(name) else { return Ok(None) };
            let invalid = |_| Error::invalid(name, &text, "a number of 0 or more");
            text.trim().parse().map(Some).map_err(invalid)
        };
        // Slurm gives the first index, the step and the number of jobs of the array.
        if let Some(id) = number("SLURM_ARRAY_TASK_ID")? {
            let first = number("SLURM_ARRAY_TASK_MIN")?.unwrap_or(0);
            let step = number("SLURM_ARRAY_TASK_STEP")?.unwrap_or(1).max(1);
            let count = number("SLURM_ARRAY_TASK_COUNT")?.or(count);
            let count = count.ok_or_else(|| unknown_count("SLURM_ARRAY_TASK_ID", id))?;
            let gaps = || {
                let found =
                    format!("{id} in an array of {count} indices from {first} in steps of {step}");
                let allowed = "an array without gaps, or --shard i/n. Fits with a result are \
                               skipped";
                Error::invalid("SLURM_ARRAY_TASK_ID", found, allowed)
            };
            let index = id.saturating_sub(first) / step;
            return Self::new(index, count).map(Some).ok_or_else(gaps);
        }
        // These schedulers give the index only.
        for name in ["PBS_ARRAY_INDEX", "HQ_TASK_ID"] {
            if let Some(index) = number(name)? {
                let count = count.ok_or_else(|| unknown_count(name, index))?;
                let invalid = || {
                    let last = count.saturating_sub(1);
                    Error::invalid(name, index, format!("0 to {last}, as there are {count} shards"))
                };
                return Self::new(index, count).map(Some).ok_or_else(invalid);
            }
        }
        Ok(None)
    }
}

/// The error of the environment variable `name` with an `index`, but without the number of shards.
fn unknown_count(name: &str, index: u64) -> Error {
    let found = format!("{index} without the number of shards");
    Error::invalid(name, found, "--shards N in addition, or --shard i/n")
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The shard from these environment variables (name and value) of a scheduler, with the number of shards if it is
    /// given.
    fn scheduled(variables: &[[&str; 2]], of: Option<u64>) -> Result<Option<Shard>, Error> {
        let find =
            |name: &str| variables.iter().find(|[n, _]| *n == name).map(|[_, v]| v.to_string());
        Shard::from_scheduler(find, of)
    }

    fn shard(index: u64, of: u64) -> Shard {
        Shard::new(index, of).unwrap()
    }

    #[test]
    fn every_task_is_in_exactly_one_shard() {
        let ids = ["00000000000000000000000000000003", "ffffffffffffffffffffffffffffffff", "a1"];
        for n in [1, 3, 7, 40] {
            for id in ids {
                let in_it = |i: &u64| format!("{i}/{n}").parse::<Shard>().unwrap().contains(id);
                assert_eq!((0..n).filter(in_it).count(), 1);
            }
        }
        for wrong in ["3", "3/3", "4/3", "0/0", "-1/3", "a/b", "1/2/3", ""] {
            let error = wrong.parse::<Shard>().unwrap_err().to_string();
            assert!(error.contains("--shard") && error.contains("i from 0 to n - 1"), "{error}");
        }
    }

    #[test]
    fn shard_follows_variables_of_scheduler() {
        let slurm = |id, min, step, count| {
            scheduled(
                &[
                    ["SLURM_ARRAY_TASK_ID", id],
                    ["SLURM_ARRAY_TASK_MIN", min],
                    ["SLURM_ARRAY_TASK_STEP", step],
                    ["SLURM_ARRAY_TASK_COUNT", count],
                ],
                None,
            )
        };
        assert_eq!(slurm("3", "0", "1", "7").unwrap(), Some(shard(3, 7)));
        assert_eq!(slurm("7", "1", "3", "4").unwrap(), Some(shard(2, 4)));
        let gaps = slurm("9", "3", "1", "2").unwrap_err().to_string();
        assert!(
            gaps.contains("SLURM_ARRAY_TASK_ID: found 9") && gaps.contains("without gaps"),
            "{gaps}"
        );
        assert!(slurm("x", "0", "1", "7").is_err());
        for name in ["PBS_ARRAY_INDEX", "HQ_TASK_ID"] {
            assert_eq!(scheduled(&[[name, "3"]], Some(4)).unwrap(), Some(shard(3, 4)));
            let beyond = scheduled(&[[name, "4"]], Some(4)).unwrap_err().to_string();
            assert!(beyond.contains(name) && beyond.contains("0 to 3"), "{beyond}");
            let unsaid = scheduled(&[[name, "4"]], None).unwrap_err().to_string();
            assert!(unsaid.contains(name) && unsaid.contains("--shards N"), "{unsaid}");
        }
        assert_eq!(scheduled(&[], Some(4)).unwrap(), None);
    }
}
