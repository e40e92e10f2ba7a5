//! The work that a fit has done.

use std::sync::{Arc, Mutex, PoisonError};

/// Steps times segments of all simulations so far; clones count together.
#[derive(Clone, Debug, Default)]
pub(crate) struct Work(Arc<Mutex<f64>>);

impl Work {
    /// Counts more.
    pub fn add(&self, work: f64) {
        *self.0.lock().unwrap_or_else(PoisonError::into_inner) += work;
    }

    /// All of it.
    pub fn total(&self) -> f64 {
        *self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// All of it; what is counted from now on starts from zero.
    pub fn take(&self) -> f64 {
        std::mem::take(&mut *self.0.lock().unwrap_or_else(PoisonError::into_inner))
    }
}
