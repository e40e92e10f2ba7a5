//! Long computations on a thread of their own: other Python threads continue, Ctrl-C stops the computation, and
//! progress is passed to a Python function.

use crate::error::{failed, raised};
use pyo3::exceptions::PyKeyboardInterrupt;
use pyo3::prelude::*;
use rodfit::Error;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::time::Duration;

/// Longest time between a Ctrl-C and its effect: the calling thread checks for signals at this interval.
const POLL_INTERVAL: Duration = Duration::from_millis(2);

/// A message of a computation.
pub enum WorkEvent {
    /// A stage of a fit, and the work so far in full simulations.
    Progress { stage: String, simulations: f64 },
    /// The end.
    Done,
}

/// The connections of a computation to the thread that called it.
pub struct WorkHooks {
    /// Set to stop the computation.
    pub stop: Arc<AtomicBool>,
    /// Receives its messages.
    pub events: Sender<WorkEvent>,
}

/// Sends [`WorkEvent::Done`] when it is dropped, also after a panic.
struct DoneOnDrop(Sender<WorkEvent>);

impl Drop for DoneOnDrop {
    fn drop(&mut self) {
        // Without a receiver nobody waits for the end.
        let _ = self.0.send(WorkEvent::Done);
    }
}

/// Runs `work` without the interpreter's lock, while the calling thread checks for Ctrl-C and calls `progress` with the
/// lock. A Ctrl-C or an exception of `progress` sets the flag that stops the work. The result is the exception, else
/// the value that the work returned, else a KeyboardInterrupt after a Ctrl-C, else the error of the work. A
/// KeyboardInterrupt that `progress` raises is a Ctrl-C, not an exception. A panic of the work is a `ComputationError`.
pub fn interruptible<T: Send + 'static>(
    py: Python<'_>,
    progress: Option<&Bound<'_, PyAny>>,
    work: impl FnOnce(WorkHooks) -> Result<T, Error> + Send + 'static,
) -> PyResult<T> {
    let (sender, mut events): (_, Receiver<WorkEvent>) = channel();
    let stop = Arc::new(AtomicBool::new(false));
    let hooks = WorkHooks { stop: stop.clone(), events: sender.clone() };
    let thread = std::thread::spawn(move || {
        let _done = DoneOnDrop(sender);
        work(hooks)
    });
    let (mut interrupted, mut exception) = (None, None);
    loop {
        // A receiver cannot be shared between threads: it moves into the closure and back.
        let (event, receiver) = py.detach(move || (events.recv_timeout(POLL_INTERVAL), events));
        events = receiver;
        match event {
            Ok(WorkEvent::Done) | Err(RecvTimeoutError::Disconnected) => break,
            Ok(WorkEvent::Progress { stage, simulations }) if exception.is_none() => {
                match progress.and_then(|call| call.call1((stage, simulations)).err()) {
                    Some(error) if error.is_instance_of::<PyKeyboardInterrupt>(py) => {
                        interrupted = Some(error)
                    }
                    error => exception = error,
                }
            }
            _ => {}
        }
        if interrupted.is_none() {
            interrupted = py.check_signals().err();
        }
        if interrupted.is_some() || exception.is_some() {
            stop.store(true, Ordering::Relaxed);
        }
    }
    // The work has ended: its result is read without the lock, as its thread may still be ending.
    let result = py
        .detach(|| thread.join())
        .map_err(|_| failed(py, "an internal error of rodfit. Report this fault"))?;
    match (result, exception, interrupted) {
        (_, Some(error), _) => Err(error),
        (Ok(value), None, _) => Ok(value),
        (Err(_), None, Some(error)) => Err(error),
        (Err(error), None, None) => Err(raised(py, error)),
    }
}
