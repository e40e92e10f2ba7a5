//! The true motion of a scene: a run that is finer than the chosen ones, and a bound of its own error.

use crate::{Motion, distance, read, simulate};
use rodfit::{Error, Problem};

/// Refinements of mesh and step of the reference over the finest chosen run, and of the run that it is verified with.
const REFINEMENTS: [usize; 2] = [3, 2];
/// The same of the step of `rodas4`, which is of fourth order.
const REFINEMENTS_RODAS4: [f64; 2] = [2.0, 1.5];
/// Error of the reference over its distance to the coarser run, for errors of first order: `(1/3) / (1/2 - 1/3)`.
const ERROR_PER_DISTANCE: f64 = 2.0;
/// Positions over the length at the points and times of comparison.
pub struct Reference {
    pub places: Vec<[f64; 3]>,
    /// Estimated error of the positions.
    error: f64,
}

impl Reference {
    /// The reference of a scene, from the finest numerics that were chosen for it.
    ///
    /// # Errors
    /// Those of the finer runs.
    pub fn new(text: &str, finest: &Problem) -> Result<Self, Error> {
        let [reference, coarser] = [run(text, finest, 0)?, run(text, finest, 1)?];
        let error = ERROR_PER_DISTANCE * distance(&reference, &coarser);
        Ok(Self { places: reference, error })
    }

    /// Whether a run with this distance to the reference is within a requested error; none where the error of the reference
    /// is too large to decide.
    pub fn is_within(&self, distance: f64, requested: f64) -> Option<bool> {
        let is_decided = (distance - requested).abs() >= self.error;
        is_decided.then_some(distance <= requested)
    }
}

/// Positions of a run that is finer than the chosen one by one of the refinements.
fn run(text: &str, finest: &Problem, refinement: usize) -> Result<Vec<[f64; 3]>, Error> {
    let finer = REFINEMENTS[refinement];
    let segments = format!("segments = {}", finer * finest.segments());
    let step = finest.time()?.step_size();
    let step = match finest.time()?.scheme.name() {
        "rodas4" => {
            format!("step = {}\nscheme = \"rodas4\"", step / REFINEMENTS_RODAS4[refinement])
        }
        _ => {
            let step = step / finer as f64;
            format!("step = {step}\nscheme = \"generalised-alpha\"\nrho_inf = 0.9")
        }
    };
    let (problem, run) = simulate(&read(text, "", &segments, &step)?)?;
    Ok(Motion::of(&problem, &run)?.places)
}
