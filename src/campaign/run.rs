//! Runs the tasks of a campaign that have no result, in parallel, and stores each outcome at once.
//!
//! [`Plan::run`] takes a plan and options (shard, threads, stop) and returns a [`RunSummary`] with counts, exit codes
//! and failures. Each worker thread takes the next open task and solves it with its own share of the processors. Before
//! a task is solved, its id is computed again: tasks with changed or missing files are listed in the summary and get no
//! result. A panic is caught, and the task remains open. After a stop no task begins, and running ones end without a
//! result. Results that cannot be read or stored are errors. [`Plan::solve`] solves and stores a single task: none
//! after a stop, an error for changed or missing files. [`Plan::open_tasks`] returns the tasks without a result, and
//! the number of the others. [`useful_threads`] limits a number of threads to that of the processors. Several processes
//! may run shards of one plan on a shared folder; each may be killed and repeated.

use crate::campaign::outcome::{Outcome, solve};
use crate::campaign::plan::{CampaignTask, Plan};
use crate::campaign::resolved::{DataHashes, ResolvedFit};
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

/// Options of a run.
#[derive(Clone, Debug)]
pub struct RunOptions {
    /// The part of the campaign; all tasks without one.
    pub shard: Option<Shard>,
    /// Number of threads, at most that of processors.
    pub threads: usize,
    /// Stops the run when set: unfinished fits have no result.
    pub stop: Arc<AtomicBool>,
}

/// The result of a run: counts and outcomes of the shard's tasks.
#[derive(Debug, Default)]
#[non_exhaustive]
pub struct RunSummary {
    /// Tasks of the shard, each id once.
    pub tasks: usize,
    /// Tasks that had a result before the run.
    pub before: usize,
    /// The [codes](Outcome::code) of the new results.
    pub codes: Vec<u8>,
    /// Tasks that could not begin.
    pub changed: Vec<ChangedTask>,
    /// Tasks whose fit ended in a fault of the program. They have no result; the next run repeats them.
    pub panicked: Vec<CampaignTask>,
}

/// A task whose files are missing or changed after the plan was written.
#[derive(Debug)]
#[non_exhaustive]
pub struct ChangedTask {
    /// The task.
    pub task: CampaignTask,
    /// The file and its change.
    pub error: Error,
}

/// An outcome with the wall time of its computation, s.
struct TimedOutcome {
    outcome: Outcome,
    seconds: f64,
}

impl RunSummary {
    /// Number of tasks of the shard without a result after the run: all, less those with one before it and the new
    /// results. Changed, panicked and stopped tasks are among them.
    pub fn open_tasks(&self) -> usize {
        self.tasks - self.before - self.codes.len()
    }
}

impl Plan {
    /// Solves one task and appends its outcome to the `store`; none, and nothing stored, if `stop` was set before its
    /// end.
    ///
    /// # Errors
    ///
    /// A task that differs from the planned one, and a result that cannot be stored.
    pub fn solve(
        &self,
        task: &CampaignTask,
        store: &Store,
        stop: Arc<AtomicBool>,
    ) -> Result<Option<Outcome>, Error> {
        let Some(timed) = self.solve_task(task, stop)? else { return Ok(None) };
        store.add(&task.id, &timed.outcome, timed.seconds)?;
        Ok(Some(timed.outcome))
    }

    /// Solves one task without storing its outcome, and measures its wall time, s. None if `stop` was set before its
    /// end. Error: a task that differs from the planned one.
    fn solve_task(
        &self,
        task: &CampaignTask,
        stop: Arc<AtomicBool>,
    ) -> Result<Option<TimedOutcome>, Error> {
        let start = Instant::now();
        let outcome = solve(&self.resolved(task)?, stop);
        let timed = |outcome| TimedOutcome { outcome, seconds: start.elapsed().as_secs_f64() };
        Ok(outcome.map(timed))
    }

    /// The fit of a task with all its files. Error: a file cannot be read, or the hash of all inputs differs from the
    /// planned id.
    fn resolved(&self, task: &CampaignTask) -> Result<ResolvedFit, Error> {
        let resolved = ResolvedFit::new(&self.root, &task.fit, &task.changes)?;
        // Files may have changed since the plan: their result must not be stored under the planned id.
        if resolved.id(&mut DataHashes::new())? != task.id {
            let found = "a fit, a scene or data that changed after the plan was written";
            let allowed = "unchanged files; run `rodfit campaign plan` again";
            let error = Error::invalid("campaign", found, allowed);
            return Err(error.in_file(Some(&resolved.file)));
        }
        Ok(resolved)
    }

    /// The tasks of a shard (all without one) that have no result, and the number of those with one. Each id counts
    /// once; the order is that of the plan.
    ///
    /// # Errors
    ///
    /// Results that cannot be read.
    pub fn open_tasks(&self, shard: Option<Shard>) -> Result<(Vec<&CampaignTask>, usize), Error> {
        let mut done = HashSet::new();
        Store::new(&self.folder).read(|record| {
            done.insert(record.id);
        })?;
        let mut seen = HashSet::new();
        let is_own = |task: &&CampaignTask| shard.is_none_or(|shard| shard.contains(&task.id));
        // Two rows of a plan may have one id, which is computed once.
        let own = self.tasks.iter().filter(is_own).filter(|task| seen.insert(&task.id));
        let (before, open): (Vec<&CampaignTask>, Vec<&CampaignTask>) =
            own.partition(|task| done.contains(&task.id));
        Ok((open, before.len()))
    }

    /// Runs the tasks of a shard without a result in parallel, and stores each outcome. The process may be killed at
    /// any moment and repeated, and any number of shards may run at once. `progress` is called at the start and after
    /// every result, with the number of results and that of tasks. Tasks whose files are missing or changed, and those
    /// that panic, are in the summary and have no result. Once the stop flag is set, no further task begins, and
    /// running ones end without a result.
    ///
    /// # Errors
    ///
    /// Results that cannot be read or stored, and threads that cannot be started. Results stored before the error stay.
    pub fn run(
        &self,
        options: &RunOptions,
        progress: impl Fn(usize, usize) + Sync,
    ) -> Result<RunSummary, Error> {
        let store = Store::new(&self.folder);
        let (open, before) = self.open_tasks(options.shard)?;
        let summary = RunSummary { tasks: open.len() + before, before, ..RunSummary::default() };
        progress(before, summary.tasks);
        if open.is_empty() {
            return Ok(summary);
        }
        // Each worker takes the next open task after its last, as costs differ. Each fit has its own share of the
        // processors: in a common pool a fit that waits for its parts would begin others within itself.
        let threads = useful_threads(options.threads);
        let workers = threads.min(open.len());
        let (next, summary, failure) = (AtomicUsize::new(0), Mutex::new(summary), Mutex::new(None));
        let work = |share: usize| -> Result<(), Error> {
            let pool = ThreadPoolBuilder::new().num_threads(share).build();
            let pool = pool
                .map_err(|error| Error::Fit(format!("the threads cannot be started: {error}")))?;
            // A result that cannot be stored ends all workers.
            while !options.stop.load(Ordering::Relaxed) && locked(&failure).is_none() {
                let Some(task) = open.get(next.fetch_add(1, Ordering::Relaxed)) else { break };
                let task: &CampaignTask = task;
                let attempt = || pool.install(|| self.solve_task(task, options.stop.clone()));
                // A fault of the program in one fit must not end the others.
                match catch_unwind(AssertUnwindSafe(attempt)) {
                    Ok(Ok(Some(TimedOutcome { outcome, seconds }))) => {
                        // The result is stored before it is counted: a killed process loses running fits only.
                        store.add(&task.id, &outcome, seconds)?;
                        let mut summary = locked(&summary);
                        summary.codes.push(outcome.code);
                        progress(summary.before + summary.codes.len(), summary.tasks);
                    }
                    // Stopped before its end.
                    Ok(Ok(None)) => {}
                    Ok(Err(error)) => {
                        locked(&summary).changed.push(ChangedTask { task: task.clone(), error })
                    }
                    Err(_) => locked(&summary).panicked.push(task.clone()),
                }
            }
            Ok(())
        };
        std::thread::scope(|scope| {
            for worker in 0..workers {
                // The first workers get one processor more if the division has a remainder.
                let share = threads / workers + usize::from(worker < threads % workers);
                let (work, failure) = (&work, &failure);
                scope.spawn(move || {
                    if let Err(error) = work(share.max(1)) {
                        locked(failure).get_or_insert(error);
                    }
                });
            }
        });
        let summary = summary.into_inner().unwrap_or_else(PoisonError::into_inner);
        let failure = failure.into_inner().unwrap_or_else(PoisonError::into_inner);
        failure.map_or(Ok(summary), Err)
    }
}

/// The number of threads that speed up a run: `asked`, but at least 1 and at most the number of processors. More
/// threads only take memory and switches.
pub fn useful_threads(asked: usize) -> usize {
    let processors = available_parallelism().map_or(1, NonZero::get);
    asked.clamp(1, processors)
}

/// Locks a mutex, also after a panic of another thread: every change of these values is complete or absent.
fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
