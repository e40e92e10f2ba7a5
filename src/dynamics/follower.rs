//! Derivatives behind a simulation: where a processor is idle, a thread of their own takes them over the steps that
//! the simulation has made, while it makes the next.
//!
//! Of a step they need nothing but the states before and after it: there the step is linearized once more, as it is
//! where they go along. So they are the same, to the last bit, on either way.

use crate::dynamics::record::Motion;
use crate::dynamics::sensitivity::Sensitivities;
use crate::dynamics::simulation::Simulation;
use crate::dynamics::step::Work;
use crate::error::Error;
use crate::rod::{Sensitive, State};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, Sender, SyncSender, channel, sync_channel};

/// Steps that go over at once, and how often that many may wait.
const BATCH: usize = 32;
const WAITING: usize = 2;
/// Steps times nodes of a run that is worth a thread of its own.
const WORTH: usize = 8000;

/// Runs that are under way.
static RUNS: AtomicUsize = AtomicUsize::new(0);

/// A run that is under way, as long as it is held.
pub(super) struct Running;

impl Running {
    pub fn begin() -> Self {
        RUNS.fetch_add(1, Ordering::Relaxed);
        Self
    }

    /// Whether a processor is idle that derivatives of so many steps times nodes are worth.
    pub fn has_room(&self, work: usize) -> bool {
        work >= WORTH && 2 * RUNS.load(Ordering::Relaxed) <= rayon::current_num_threads()
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        RUNS.fetch_sub(1, Ordering::Relaxed);
    }
}

/// A step that was taken: what came of it, what the run had cost then, and whether it is recorded.
struct Taken<S> {
    state: S,
    work: Work,
    recorded: bool,
}

type Batch<R> = Vec<Taken<State<f64, <R as crate::rod::Rod<f64>>::Frames>>>;

/// The simulation's end: passes its steps on.
pub(super) struct Leader<R: Sensitive> {
    /// The steps that wait to go over, of a batch that may be longer.
    batch: Batch<R>,
    filled: usize,
    full: SyncSender<(Batch<R>, usize)>,
    empty: Receiver<Batch<R>>,
}

impl<R: Sensitive> Leader<R> {
    /// Takes a step that a simulation has made.
    ///
    /// # Errors
    /// [`Error::Interrupted`] where the derivatives have ended: their own error says why.
    pub fn push(&mut self, simulation: &Simulation<f64, R>) -> Result<(), Error> {
        if self.filled == BATCH {
            self.send()?;
        }
        let (state, work) = (simulation.state(), simulation.work());
        match self.batch.get_mut(self.filled) {
            Some(taken) => {
                taken.state.restore(state);
                (taken.work, taken.recorded) = (work, false);
            }
            None => self.batch.push(Taken { state: state.clone(), work, recorded: false }),
        }
        self.filled += 1;
        Ok(())
    }

    /// The last step is recorded.
    pub fn record(&mut self) {
        if let Some(last) = self.filled.checked_sub(1) {
            self.batch[last].recorded = true;
        }
    }

    fn send(&mut self) -> Result<(), Error> {
        let next = self.empty.try_recv().unwrap_or_default();
        let batch = std::mem::replace(&mut self.batch, next);
        let filled = std::mem::take(&mut self.filled);
        self.full.send((batch, filled)).map_err(|_| Error::Interrupted)
    }

    /// Passes on what waits; nothing comes after it.
    pub fn end(mut self) {
        // Whoever does not take it any more says why.
        let _ = self.send();
    }
}

/// The derivatives' end.
pub(super) struct Follower<R: Sensitive> {
    simulation: Simulation<f64, R>,
    sensitivities: Sensitivities<R>,
    full: Receiver<(Batch<R>, usize)>,
    empty: Sender<Batch<R>>,
}

/// What came of following.
pub(super) struct Followed {
    /// The derivatives of every recorded step, by every parameter.
    pub derivatives: Vec<Vec<Motion>>,
    /// Recorded steps that were followed.
    pub recorded: usize,
    /// Work beside the simulation's.
    pub work: Work,
    /// Why it ended early, and the simulation's work by then.
    pub failed: Option<(Error, Work)>,
}

/// Both ends, of a simulation at its start.
pub(super) fn ends<R: Sensitive>(
    simulation: &Simulation<f64, R>,
    sensitivities: Sensitivities<R>,
) -> (Leader<R>, Follower<R>) {
    let (full, of_leader) = sync_channel(WAITING);
    let (empty, of_follower) = channel();
    let leader = Leader { batch: Vec::new(), filled: 0, full, empty: of_follower };
    (leader, Follower { simulation: simulation.linear(), sensitivities, full: of_leader, empty })
}

impl<R: Sensitive> Follower<R> {
    /// Follows all steps; `rates` are what is recorded of a state's derivatives by a parameter.
    pub fn follow(
        self,
        rates: impl Fn(&Sensitivities<R>, usize, &State<f64, R::Frames>, &mut Vec<Motion>),
    ) -> Followed {
        let Self { mut simulation, mut sensitivities, full, empty } = self;
        let mut before = simulation.state().clone();
        let mut followed = Followed {
            derivatives: vec![Vec::new(); sensitivities.count()],
            recorded: 0,
            work: Work::default(),
            failed: None,
        };
        'batches: for (batch, filled) in full {
            for Taken { state, work, recorded } in &batch[..filled] {
                let step = simulation.linearized(&before, state);
                let advanced = step.and_then(|step| match step {
                    Some(step) => sensitivities.advance_over(&step),
                    None => Ok(()),
                });
                if let Err(error) = advanced {
                    followed.failed = Some((error, *work));
                    break 'batches;
                }
                if *recorded {
                    for (k, list) in followed.derivatives.iter_mut().enumerate() {
                        rates(&sensitivities, k, state, list);
                    }
                    followed.recorded += 1;
                }
                before.restore(state);
            }
            // Whoever leads may have ended.
            let _ = empty.send(batch);
        }
        followed.work = simulation.work();
        followed
    }
}
