//! Which part of a campaign a process does.

use crate::error::Error;
use std::str::FromStr;

/// One of so many parts: the tasks whose id leaves the same rest. `0/3`, `1/3` and `2/3` are all of them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    index: u128,
    of: u128,
}

const ALLOWED: &str = "i/n with n of 1 or more, and i from 0 to n - 1";

impl FromStr for Shard {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self, Error> {
        let refused = || Error::invalid("--shard", text, ALLOWED);
        let (index, of) = text.split_once('/').ok_or_else(refused)?;
        let number = |text: &str| text.trim().parse::<u64>().map_err(|_| refused());
        Self::new(number(index)?, number(of)?).ok_or_else(refused)
    }
}

impl Shard {
    fn new(index: u64, of: u64) -> Option<Self> {
        let (index, of) = (u128::from(index), u128::from(of));
        (index < of).then_some(Self { index, of })
    }

    /// Whether a task is in it.
    pub fn has(&self, id: &str) -> bool {
        u128::from_str_radix(id, 16).is_ok_and(|id| id % self.of == self.index)
    }

    /// The one that a scheduler gives this process: of a Slurm job array, or, where `of` says how many there are, a PBS
    /// job array or the tasks of HyperQueue. None without a scheduler.
    ///
    /// # Errors
    ///
    /// Variables that are no numbers, an array with gaps, and nothing that says how many shards there are.
    pub fn of_scheduler(
        variable: impl Fn(&str) -> Option<String>,
        of: Option<u64>,
    ) -> Result<Option<Self>, Error> {
        let number = |name: &str| -> Result<Option<u64>, Error> {
            let Some(text) = variable(name) else { return Ok(None) };
            let refused = || Error::invalid(name, &text, "a number of 0 or more");
            text.trim().parse().map(Some).map_err(|_| refused())
        };
        if let Some(id) = number("SLURM_ARRAY_TASK_ID")? {
            let first = number("SLURM_ARRAY_TASK_MIN")?.unwrap_or(0);
            let step = number("SLURM_ARRAY_TASK_STEP")?.unwrap_or(1).max(1);
            let count = number("SLURM_ARRAY_TASK_COUNT")?.or(of);
            let of = count.ok_or_else(|| unsaid("SLURM_ARRAY_TASK_ID", id))?;
            let index = id.saturating_sub(first) / step;
            return match Self::new(index, of) {
                Some(shard) => Ok(Some(shard)),
                None => Err(Error::invalid(
                    "SLURM_ARRAY_TASK_ID",
                    format!("{id} in an array of {of} from {first} in steps of {step}"),
                    "an array without gaps, in which fits with a result are skipped, or --shard i/n",
                )),
            };
        }
        for name in ["PBS_ARRAY_INDEX", "HQ_TASK_ID"] {
            if let Some(index) = number(name)? {
                let of = of.ok_or_else(|| unsaid(name, index))?;
                let refused = || {
                    let last = of.saturating_sub(1);
                    Error::invalid(name, index, format!("0 to {last}, as there are {of} shards"))
                };
                return Self::new(index, of).map(Some).ok_or_else(refused);
            }
        }
        Ok(None)
    }
}

fn unsaid(name: &str, index: u64) -> Error {
    Error::invalid(
        name,
        format!("{index} without the number of shards"),
        "--shards N in addition, or --shard i/n",
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scheduled(variables: &[(&str, &str)], of: Option<u64>) -> Result<Option<Shard>, Error> {
        let find =
            |name: &str| variables.iter().find(|(n, _)| *n == name).map(|(_, v)| v.to_string());
        Shard::of_scheduler(find, of)
    }

    fn shard(index: u64, of: u64) -> Shard {
        Shard::new(index, of).unwrap()
    }

    #[test]
    fn every_task_is_in_one_shard() {
        let ids = ["00000000000000000000000000000003", "ffffffffffffffffffffffffffffffff", "a1"];
        for n in [1, 3, 7, 40] {
            for id in ids {
                let in_it = |i: &u64| format!("{i}/{n}").parse::<Shard>().unwrap().has(id);
                assert_eq!((0..n).filter(in_it).count(), 1);
            }
        }
        for wrong in ["3", "3/3", "4/3", "0/0", "-1/3", "a/b", "1/2/3", ""] {
            let error = wrong.parse::<Shard>().unwrap_err().to_string();
            assert!(error.contains("--shard") && error.contains("i from 0 to n - 1"), "{error}");
        }
    }

    #[test]
    fn schedulers_say_which() {
        let slurm = |id, min, step, count| {
            scheduled(
                &[
                    ("SLURM_ARRAY_TASK_ID", id),
                    ("SLURM_ARRAY_TASK_MIN", min),
                    ("SLURM_ARRAY_TASK_STEP", step),
                    ("SLURM_ARRAY_TASK_COUNT", count),
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
            assert_eq!(scheduled(&[(name, "3")], Some(4)).unwrap(), Some(shard(3, 4)));
            let beyond = scheduled(&[(name, "4")], Some(4)).unwrap_err().to_string();
            assert!(beyond.contains(name) && beyond.contains("0 to 3"), "{beyond}");
            let unsaid = scheduled(&[(name, "4")], None).unwrap_err().to_string();
            assert!(unsaid.contains(name) && unsaid.contains("--shards N"), "{unsaid}");
        }
        assert_eq!(scheduled(&[], Some(4)).unwrap(), None);
    }
}
