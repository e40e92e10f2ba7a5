//! Wall-clock time of a computation.
//!
//! [`Stopwatch::start`] reads a monotonic clock, and [`Stopwatch::elapsed`] returns the time since then. The target
//! `wasm32-unknown-unknown` has no clock: the time is zero there.

use std::time::Duration;

/// A stopwatch that runs from its creation.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Stopwatch {
    #[cfg(not(all(target_arch = "wasm32", target_os = "unknown")))]
    start: std::time::Instant,
}

#[cfg(not(all(target_arch = "wasm32", target_os = "unknown")))]
impl Stopwatch {
    /// A stopwatch that starts now.
    pub fn start() -> Self {
        Self { start: std::time::Instant::now() }
    }

    /// Time since the start.
    pub fn elapsed(self) -> Duration {
        self.start.elapsed()
    }
}

#[cfg(all(target_arch = "wasm32", target_os = "unknown"))]
impl Stopwatch {
    /// A stopwatch without a clock.
    pub fn start() -> Self {
        Self {}
    }

    /// Zero.
    pub fn elapsed(self) -> Duration {
        Duration::ZERO
    }
}
