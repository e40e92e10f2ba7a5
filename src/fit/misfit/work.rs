//! Counter of the work of a fit: time steps times segments, summed over all simulations.
//!
//! The search and all residuals of a fit share one [`WorkCounter`] across threads. Over the work of one full simulation it is
//! the cost in simulations that reports and the progress display.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Steps times segments of all simulations so far. Clones share one counter.
#[derive(Clone, Debug, Default)]
pub(crate) struct WorkCounter(Arc<Mutex<f64>>);

impl WorkCounter {
    /// Adds `work`, steps times segments.
    pub fn add(&self, work: f64) {
        *self.count() += work;
    }

    /// The sum so far, steps times segments.
    pub fn total(&self) -> f64 {
        *self.count()
    }

    /// The sum so far; resets the counter to zero.
    pub fn take(&self) -> f64 {
        std::mem::take(&mut *self.count())
    }

    /// The locked counter. A thread that panicked leaves a valid sum.
    fn count(&self) -> MutexGuard<'_, f64> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
