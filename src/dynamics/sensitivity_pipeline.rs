//! Two-stage pipeline for a run with derivatives: one thread makes the steps, a second one computes derivatives over
//! them.
//!
//! Used if steps can be linearized from the states before and after them (Newmark-beta and generalised-alpha in
//! general). Further conditions: the thread pool has two threads for each active run, and the product of steps and
//! nodes is at least `MIN_STEPS_TIMES_NODES` ([`ActiveRun::has_room`]). Input: a simulation in its initial state, and
//! then each accepted step. The consumer linearizes the step again, as a synchronous run does. Derivatives are
//! therefore bitwise the same either way. States are sent in batches over a bounded channel, and used batches are
//! returned for reuse. Output: the derivatives of all recorded states, one list per parameter, the work of the
//! derivatives, and the first error of a derivative, which ends the run.
//!
//! `new` returns both sides. On the first thread [`StepProducer::push`] appends a step, `mark_recorded` marks it as
//! recorded, and `finish` closes the pipeline; `push` waits for the consumer, and fails if that has ended. On the
//! second thread [`SensitivityConsumer::consume`] computes and records until then. [`ActiveRun::begin`] counts a run
//! while its result exists.
//!
//! `SensitivityResult` has the derivatives of a run, `SensitivityFailure` the error with the work up to its step.

use crate::dynamics::record::Motion;
use crate::dynamics::sensitivity::Sensitivities;
use crate::dynamics::simulation::Simulation;
use crate::dynamics::step::Work;
use crate::error::Error;
use crate::rod::{ForwardSensitivity, Rod, State};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, Sender, SyncSender, channel, sync_channel};

/// Steps per batch. A larger number takes more memory, a smaller one more synchronization of the threads.
const BATCH: usize = 32;
/// Batches that may wait for the consumer; then the producer waits.
const MAX_WAITING_BATCHES: usize = 2;
/// Smallest product of steps and nodes of a run for which a second thread is started: below it the thread costs more
/// than it saves.
const MIN_STEPS_TIMES_NODES: usize = 8000;

/// Number of active runs of the process.
static RUNS: AtomicUsize = AtomicUsize::new(0);

/// A run counted as active until it is dropped.
pub(super) struct ActiveRun;

impl ActiveRun {
    /// Adds one to the number of active runs of the process, until the result is dropped.
    pub fn begin() -> Self {
        RUNS.fetch_add(1, Ordering::Relaxed);
        Self
    }

    /// Whether a second thread is worthwhile: the product of steps and nodes is at least [`MIN_STEPS_TIMES_NODES`],
    /// and the thread pool has two threads for each active run of the process.
    pub fn has_room(&self, steps_times_nodes: usize) -> bool {
        let runs = RUNS.load(Ordering::Relaxed);
        // Two threads for each run: other runs of the process have theirs.
        steps_times_nodes >= MIN_STEPS_TIMES_NODES && 2 * runs <= rayon::current_num_threads()
    }
}

impl Drop for ActiveRun {
    /// Subtracts one from the number of active runs.
    fn drop(&mut self) {
        RUNS.fetch_sub(1, Ordering::Relaxed);
    }
}

/// An accepted step: the state at its end, the work of the run by then, and whether it is recorded.
struct AcceptedStep<S> {
    state: S,
    work: Work,
    is_recorded: bool,
}

/// Accepted steps of a rod; the first `filled` entries are valid.
struct Batch<R: Rod<f64>> {
    steps: Vec<AcceptedStep<State<f64, R::Frames>>>,
    filled: usize,
}

/// The producing end of the pipeline, on the thread of the simulation.
pub(super) struct StepProducer<R: ForwardSensitivity> {
    /// The batch being filled.
    batch: Batch<R>,
    /// Channel of filled batches.
    full: SyncSender<Batch<R>>,
    /// Channel of used batches.
    empty: Receiver<Batch<R>>,
}

impl<R: ForwardSensitivity> StepProducer<R> {
    /// Appends the last step of a simulation to the batch: its state, the work so far, not marked as recorded. A full
    /// batch is sent before; this waits while [`MAX_WAITING_BATCHES`] batches are waiting.
    ///
    /// # Errors
    /// [`Error::Interrupted`] where the consumer has ended; its own error has the reason.
    pub fn push(&mut self, simulation: &Simulation<f64, R>) -> Result<(), Error> {
        // Steps are sent in batches: one synchronization of the threads for all of them.
        if self.batch.filled == BATCH {
            self.send()?;
        }
        let (state, work) = (simulation.state(), simulation.work());
        let Batch { steps, filled } = &mut self.batch;
        match steps.get_mut(*filled) {
            Some(step) => {
                // Used batches come back, so that their states need no allocation.
                step.state.restore(state);
                (step.work, step.is_recorded) = (work, false);
            }
            None => steps.push(AcceptedStep { state: state.clone(), work, is_recorded: false }),
        }
        *filled += 1;
        Ok(())
    }

    /// Marks the last step as recorded, so that the consumer records its derivatives. Nothing happens at an empty
    /// batch.
    pub fn mark_recorded(&mut self) {
        if let Some(last) = self.batch.filled.checked_sub(1) {
            self.batch.steps[last].is_recorded = true;
        }
    }

    /// Sends the current batch to the consumer, and continues with an empty one, a returned batch if there is one.
    ///
    /// # Errors
    /// [`Error::Interrupted`] if the consumer has ended.
    fn send(&mut self) -> Result<(), Error> {
        let empty = || Batch { steps: Vec::new(), filled: 0 };
        let mut next = self.empty.try_recv().unwrap_or_else(|_| empty());
        next.filled = 0;
        let batch = std::mem::replace(&mut self.batch, next);
        self.full.send(batch).map_err(|_| Error::Interrupted)
    }

    /// Sends the last, incomplete batch and closes the pipeline. An error of sending is ignored, as the consumer
    /// reports its own.
    pub fn finish(mut self) {
        // A consumer that ended early reports its own error.
        let _ = self.send();
    }
}

/// The consuming end of the pipeline, on the thread of the derivatives.
pub(super) struct SensitivityConsumer<R: ForwardSensitivity> {
    simulation: Simulation<f64, R>,
    sensitivities: Sensitivities<R>,
    full: Receiver<Batch<R>>,
    empty: Sender<Batch<R>>,
}

/// The error of a derivative, and the work of the run up to its step.
pub(super) struct SensitivityFailure {
    pub error: Error,
    pub work: Work,
}

/// Derivatives of a run.
pub(super) struct SensitivityResult {
    /// The derivatives by every parameter, for all recorded steps.
    pub derivatives: Vec<Vec<Motion>>,
    /// Number of recorded steps with derivatives.
    pub recorded: usize,
    /// Work of the derivatives alone.
    pub work: Work,
    /// Set where the derivatives end early.
    pub failure: Option<SensitivityFailure>,
}

/// The producer and the consumer of a pipeline, for a `simulation` in its initial state, of which the consumer gets a
/// copy for linearization, and its `sensitivities`.
pub(super) fn new<R: ForwardSensitivity>(
    simulation: &Simulation<f64, R>,
    sensitivities: Sensitivities<R>,
) -> (StepProducer<R>, SensitivityConsumer<R>) {
    // A bounded channel: the simulation waits where derivatives are slower, instead of storing
    // the whole run.
    let (full_sender, full) = sync_channel(MAX_WAITING_BATCHES);
    let (empty, empty_receiver) = channel();
    let batch = Batch { steps: Vec::new(), filled: 0 };
    let producer = StepProducer { batch, full: full_sender, empty: empty_receiver };
    let simulation = simulation.linear();
    (producer, SensitivityConsumer { simulation, sensitivities, full, empty })
}

impl<R: ForwardSensitivity> SensitivityConsumer<R> {
    /// Computes the derivatives over all steps in their order, until the pipeline closes or a step has no derivatives
    /// (`failure` of the result). For each recorded step, `record` is called with every parameter's index and list,
    /// to which it appends derivatives. Used batches are returned to the producer.
    pub fn consume(
        self,
        record: impl Fn(&Sensitivities<R>, usize, &State<f64, R::Frames>, &mut Vec<Motion>),
    ) -> SensitivityResult {
        let Self { mut simulation, mut sensitivities, full, empty } = self;
        let mut before = simulation.state().clone();
        let mut result = SensitivityResult {
            derivatives: vec![Vec::new(); sensitivities.count()],
            recorded: 0,
            work: Work::default(),
            failure: None,
        };
        'batches: for batch in full {
            for AcceptedStep { state, work, is_recorded } in &batch.steps[..batch.filled] {
                // The step is linearized again from its two states; the sensitivities advance over it.
                let step = simulation.linearized(&before, state);
                let advanced = step.and_then(|step| match step {
                    Some(step) => sensitivities.advance_over(&step),
                    None => Ok(()),
                });
                if let Err(error) = advanced {
                    result.failure = Some(SensitivityFailure { error, work: *work });
                    break 'batches;
                }
                // Bisected steps are not recorded, but advance the derivatives.
                if *is_recorded {
                    for (k, list) in result.derivatives.iter_mut().enumerate() {
                        record(&sensitivities, k, state, list);
                    }
                    result.recorded += 1;
                }
                before.restore(state);
            }
            // The producer may have ended.
            let _ = empty.send(batch);
        }
        result.work = simulation.work();
        result
    }
}
