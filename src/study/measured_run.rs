//! A simulation with its wall-clock time, Newton iterations, energy drift and the motion of its tip, as one run of a
//! study.
//!
//! Input: a problem with a time. The tip is sampled at [`SAMPLES`] evenly spaced times up to the end, m. Completed runs
//! with a stepping time below [`SHORT`] are repeated up to [`REPETITIONS`] times; the shortest time counts, s. The
//! energy drift is the largest change of the energy over the largest kinetic energy. A run that stops has its error in
//! place of the motion. A problem that cannot begin, and a repetition that stops, are errors.

use crate::accuracy::Positions;
use crate::dynamics::{SimulationReport, Trajectory};
use crate::error::Error;
use crate::problem::Problem;
use crate::scene::Point;

/// Number of evenly spaced times at which tips are compared.
const SAMPLES: usize = 400;
/// Wall time, s, below which a run is timed again.
const SHORT: f64 = 0.05;
/// Largest number of repetitions of a short run; the fastest run counts.
const REPETITIONS: usize = 2;

/// A simulation with its cost.
pub(super) struct MeasuredRun {
    /// Positions of the tip at the [`SAMPLES`] times, m, or the error of a run that stopped.
    pub tip: Result<Positions, Error>,
    /// Wall time of the stepping, s.
    pub seconds: f64,
    /// Newton iterations of all steps.
    pub newton_iterations: usize,
    /// Largest change of the energy over the largest kinetic energy.
    pub energy_drift: f64,
}

impl MeasuredRun {
    /// Simulates a problem, samples its tip at [`SAMPLES`] evenly spaced times from the end of the first interval to
    /// the end of the simulation, and measures the stepping. A completed run below [`SHORT`] is repeated up to
    /// [`REPETITIONS`] times, and the shortest time counts. A run that stops is a result; a problem that cannot begin,
    /// and a repetition that stops, are errors.
    pub fn new(problem: &Problem) -> Result<Self, Error> {
        let time = problem.time()?;
        let nodes: Vec<usize> = problem.tip().nodes.iter().map(|(node, _)| *node).collect();
        let mut report = SimulationReport::new(problem);
        let mut trajectory = Trajectory::new(problem, &nodes, &[])?;
        let outcome = trajectory.run(problem, time.steps(), |now| report.push(problem, now));
        let tip = outcome.and_then(|()| {
            let sample = |k: usize| time.end * k as f64 / SAMPLES as f64;
            (1..=SAMPLES).map(|k| Ok(trajectory.at(Point::Tip, sample(k))?.0)).collect()
        });
        let mut seconds = trajectory.stepping().as_secs_f64();
        // Short times vary with the load of the machine: the shortest one counts.
        for _ in 0..REPETITIONS {
            if tip.is_ok() && seconds < SHORT {
                let mut again = Trajectory::new(problem, &nodes, &[])?;
                again.run(problem, time.steps(), |_| {})?;
                seconds = seconds.min(again.stepping().as_secs_f64());
            }
        }
        let newton_iterations = trajectory.work().newton_iterations;
        Ok(Self { tip, seconds, newton_iterations, energy_drift: report.energy_drift() })
    }
}
