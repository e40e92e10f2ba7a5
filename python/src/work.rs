//! Long work in a thread of its own: other threads of Python go on meanwhile, Ctrl-C ends it, and progress is told.

use crate::error::{failed, raised};
use pyo3::prelude::*;
use rodfit::Error;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::time::Duration;

/// How long a Ctrl-C may wait to be seen.
const PATIENCE: Duration = Duration::from_millis(2);

/// Something that a work does.
pub enum News {
    /// A stage of a fit, and the work so far in full simulations.
    Progress(String, f64),
    Done,
}

/// What a work is given.
pub struct Hooks {
    /// Set when it shall stop.
    pub stop: Arc<AtomicBool>,
    /// Takes what is to be told.
    pub news: Sender<News>,
}

/// Tells that the work is done, also when it panics.
struct Bell(Sender<News>);

impl Drop for Bell {
    fn drop(&mut self) {
        // Nobody who waits is nobody to tell.
        let _ = self.0.send(News::Done);
    }
}

/// Does `work` without the interpreter's lock, while the thread that called looks for Ctrl-C and passes progress on
/// to `told`, which is called with the lock. After Ctrl-C, or an exception in `told`, the work is asked to stop: what it then
/// returns is returned after a Ctrl-C, and else the exception.
pub fn interruptible<T: Send + 'static>(
    py: Python<'_>,
    told: Option<&Bound<'_, PyAny>>,
    work: impl FnOnce(Hooks) -> Result<T, Error> + Send + 'static,
) -> PyResult<T> {
    let (sender, news): (_, Receiver<News>) = channel();
    let stop = Arc::new(AtomicBool::new(false));
    let hooks = Hooks { stop: stop.clone(), news: sender.clone() };
    let thread = std::thread::spawn(move || {
        let _bell = Bell(sender);
        work(hooks)
    });
    let (mut interrupted, mut refused) = (None, None);
    // Receivers stay with their thread, locks with the interpreter's.
    let mut news = news;
    loop {
        let (next, back) = py.detach(move || (news.recv_timeout(PATIENCE), news));
        news = back;
        match next {
            Ok(News::Done) | Err(RecvTimeoutError::Disconnected) => break,
            Ok(News::Progress(stage, simulations)) if refused.is_none() => {
                refused = told.and_then(|told| told.call1((stage, simulations)).err());
            }
            _ => {}
        }
        if interrupted.is_none() {
            interrupted = py.check_signals().err();
        }
        if interrupted.is_some() || refused.is_some() {
            stop.store(true, Ordering::Relaxed);
        }
    }
    let result =
        py.detach(|| thread.join()).map_err(|_| failed(py, "a panic of rodfit's: a bug"))?;
    match (result, refused, interrupted) {
        (_, Some(error), _) => Err(error),
        (Ok(value), None, _) => Ok(value),
        (Err(_), None, Some(error)) => Err(error),
        (Err(error), None, None) => Err(raised(py, error)),
    }
}
