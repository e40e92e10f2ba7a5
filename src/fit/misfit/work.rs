//! Counter of the work of a fit: time steps times segments, summed over all simulations.
//!
//! The search and all residuals of a fit share one [`WorkCounter`] across threads. Its sum, divided by the work of one
//! full simulation, is the cost in simulations of reports and of the progress display. Limits of the search use the
//! same number. `add` adds the work of a simulation, `total` is the sum, and `take` returns it and resets the counter.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Steps times segments of all simulations so far. Clones share one counter.
#[derive(Clone, Debug, Default)]
pub(crate) struct WorkCounter(Arc<Mutex<f64>>);

impl WorkCounter {
    /// Adds the `work` of a simulation, steps times segments, to the sum.
    pub fn add(&self, work: f64) {
        *self.count() += work;
    }

    /// The sum of all work so far, steps times segments.
    pub fn total(&self) -> f64 {
        *self.count()
    }

    /// Returns the sum so far, steps times segments, and resets the counter to zero.
    pub fn take(&self) -> f64 {
        std::mem::take(&mut *self.count())
    }

    /// The locked counter. The lock of a thread that panicked is taken over: the sum stays valid.
    fn count(&self) -> MutexGuard<'_, f64> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
