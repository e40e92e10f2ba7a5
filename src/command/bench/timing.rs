//! Wall time of a repeated computation.
//!
//! [`fastest`] repeats a computation that returns its own duration, and returns the shortest one.

use rodfit::Error;
use std::time::{Duration, Instant};

/// The shortest duration that `run` returns when it is repeated until `least` has passed; it runs once at least. The
/// first error of a run ends it.
pub fn fastest(
    least: Duration,
    mut run: impl FnMut() -> Result<Duration, Error>,
) -> Result<Duration, Error> {
    let start = Instant::now();
    let mut fastest = run()?;
    while start.elapsed() < least {
        // The fastest run is the one with the least disturbance by other processes.
        fastest = fastest.min(run()?);
    }
    Ok(fastest)
}
