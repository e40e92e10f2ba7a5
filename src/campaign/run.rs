//! Doing what is not done yet.

use crate::campaign::outcome::{Outcome, solve};
use crate::campaign::plan::{Plan, Task};
use crate::campaign::resolved::{Hashes, Resolved};
use crate::campaign::shard::Shard;
use crate::campaign::store::Store;
use crate::error::Error;
use rayon::ThreadPoolBuilder;
use std::collections::HashSet;
use std::num::NonZero;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::available_parallelism;
use std::time::Instant;

/// How a campaign is run.
#[derive(Clone, Debug)]
pub struct Way {
    /// Which part of it; all without.
    pub shard: Option<Shard>,
    /// Processors to use, up to as many as there are.
    pub threads: usize,
    /// Stops it when set: fits that are not done are left.
    pub stop: Arc<AtomicBool>,
}

/// What a run did.
#[derive(Debug, Default)]
#[non_exhaustive]
pub struct Ran {
    /// Tasks of the shard, each id once.
    pub tasks: usize,
    /// Of them, how many had a result already.
    pub before: usize,
    /// How many have one now that had none, by their [codes](Outcome::code).
    pub codes: Vec<u8>,
    /// Tasks that could not be begun, as what they are made of is gone or not what was planned, with the reason.
    pub changed: Vec<(Task, Error)>,
    /// Tasks whose fit ended in a fault of the program. They have no result, and are done again in the next run.
    pub panicked: Vec<Task>,
}

impl Ran {
    /// How many tasks are left.
    pub fn left(&self) -> usize {
        self.tasks - self.before - self.codes.len()
    }
}

impl Plan {
    /// Solves one task, and stores what came of it; nothing where it was told to stop.
    ///
    /// # Errors
    ///
    /// A task that is no longer what was planned, and a result that cannot be stored.
    pub fn solve(
        &self,
        task: &Task,
        store: &Store,
        stop: Arc<AtomicBool>,
    ) -> Result<Option<Outcome>, Error> {
        let done = self.attempt(task, stop)?;
        if let Some((outcome, seconds)) = &done {
            store.add(&task.id, outcome, *seconds)?;
        }
        Ok(done.map(|(outcome, _)| outcome))
    }

    /// What came of a task, and the wall time it took, s.
    fn attempt(&self, task: &Task, stop: Arc<AtomicBool>) -> Result<Option<(Outcome, f64)>, Error> {
        let since = Instant::now();
        let outcome = solve(&self.resolved(task)?, stop);
        Ok(outcome.map(|outcome| (outcome, since.elapsed().as_secs_f64())))
    }

    /// What a task is made of, if it is what was planned.
    fn resolved(&self, task: &Task) -> Result<Resolved, Error> {
        let resolved = Resolved::new(&self.root, &task.fit, &task.changes)?;
        match resolved.id(&mut Hashes::new())? == task.id {
            true => Ok(resolved),
            false => {
                let found = "a fit, a scene or data that changed after the plan was written";
                Err(Error::invalid(
                    "campaign",
                    found,
                    "unchanged files; run `rodfit campaign plan` again",
                )
                .in_file(Some(&resolved.file)))
            }
        }
    }

    /// The tasks of a shard that have no result yet, each id once, and how many have one.
    ///
    /// # Errors
    ///
    /// Results that cannot be read.
    pub fn open_tasks(&self, shard: Option<Shard>) -> Result<(Vec<&Task>, usize), Error> {
        let mut done = HashSet::new();
        Store::new(&self.folder).read(|record| {
            done.insert(record.id);
        })?;
        let mut seen = HashSet::new();
        let mine = self.tasks.iter().filter(|task| shard.is_none_or(|shard| shard.has(&task.id)));
        let (before, open): (Vec<&Task>, Vec<&Task>) =
            mine.filter(|task| seen.insert(&task.id)).partition(|task| done.contains(&task.id));
        Ok((open, before.len()))
    }

    /// Runs a shard: what has a result is skipped. It may be killed at any moment and run again, and any number of
    /// shards may run at once. `told` hears after every task how many of how many have a result.
    ///
    /// # Errors
    ///
    /// Results that cannot be read or stored.
    pub fn run(&self, way: &Way, told: impl Fn(usize, usize) + Sync) -> Result<Ran, Error> {
        let store = Store::new(&self.folder);
        let (open, before) = self.open_tasks(way.shard)?;
        let ran = Ran { tasks: open.len() + before, before, ..Ran::default() };
        told(before, ran.tasks);
        if open.is_empty() {
            return Ok(ran);
        }
        // Each worker takes the next task when it is done with one, as costs differ. Its fit has its own share of the
        // processors: in one pool a fit that waits for its parts would begin others within itself.
        let threads = useful_threads(way.threads);
        let workers = threads.min(open.len());
        let (next, ran, failure) = (AtomicUsize::new(0), Mutex::new(ran), Mutex::new(None));
        let work = |share: usize| -> Result<(), Error> {
            let pool = ThreadPoolBuilder::new().num_threads(share).build();
            let pool = pool
                .map_err(|error| Error::Fit(format!("the threads cannot be started: {error}")))?;
            while !way.stop.load(Ordering::Relaxed) && locked(&failure).is_none() {
                let Some(task) = open.get(next.fetch_add(1, Ordering::Relaxed)) else { break };
                let attempt = || pool.install(|| self.attempt(task, way.stop.clone()));
                match catch_unwind(AssertUnwindSafe(attempt)) {
                    Ok(Ok(Some((outcome, seconds)))) => {
                        store.add(&task.id, &outcome, seconds)?;
                        let mut ran = locked(&ran);
                        ran.codes.push(outcome.code);
                        told(ran.before + ran.codes.len(), ran.tasks);
                    }
                    Ok(Ok(None)) => {}
                    Ok(Err(error)) => locked(&ran).changed.push(((*task).clone(), error)),
                    Err(_) => locked(&ran).panicked.push((*task).clone()),
                }
            }
            Ok(())
        };
        std::thread::scope(|scope| {
            for worker in 0..workers {
                let share = threads / workers + usize::from(worker < threads % workers);
                let (work, failure) = (&work, &failure);
                scope.spawn(move || {
                    if let Err(error) = work(share.max(1)) {
                        locked(failure).get_or_insert(error);
                    }
                });
            }
        });
        match failure.into_inner().unwrap_or_else(PoisonError::into_inner) {
            Some(error) => Err(error),
            None => Ok(ran.into_inner().unwrap_or_else(PoisonError::into_inner)),
        }
    }
}

/// How many of so many threads are of use: as many as there are processors. More only take memory and turns, and many
/// thousands starve the machine.
pub fn useful_threads(asked: usize) -> usize {
    let processors = available_parallelism().map_or(1, NonZero::get);
    asked.clamp(1, processors)
}

/// What a fault elsewhere has left is still right: nothing is changed by halves.
fn locked<T>(of: &Mutex<T>) -> MutexGuard<'_, T> {
    of.lock().unwrap_or_else(PoisonError::into_inner)
}
