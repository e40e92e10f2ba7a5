//! The reference motion of a scene: a run that is finer than the chosen ones, and an estimate of its own error.
//!
//! Three runs with mesh and step refined by 3, 2 and 1 are compared. Their distances give the order of convergence (between
//! 0.5 and 2), and by extrapolation the error of the finest (Richardson).

use crate::{Motion, distance, read, simulate};
use rodfit::{Error, Problem};

/// Refinements of mesh and step of the reference over the finest chosen run, and of the runs that it is verified with.
const REFINEMENTS: [f64; 3] = [3.0, 2.0, 1.0];
/// The same for the step of `rodas4`, which is of fourth order and needs smaller ratios.
const REFINEMENTS_RODAS4: [f64; 3] = [2.0, 1.5, 1.0];
/// Smallest and largest order of convergence that is assumed for the reference.
const ORDERS: [f64; 2] = [0.5, 2.0];
/// Bisections for the order of convergence: 2^-40 of the interval remains, far more accurate than needed.
const BISECTIONS: usize = 40;

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
        let [reference, finer, coarser] = [0, 1, 2].map(|run| simulate_finer(text, finest, run));
        let (reference, finer, coarser) = (reference?, finer?, coarser?);
        let error = error_of_finest(distance(&reference, &finer), distance(&finer, &coarser));
        Ok(Self { places: reference, error })
    }

    /// Whether a run with this distance to the reference is within a requested error; none where the error of the reference
    /// is too large to decide.
    pub fn is_within(&self, distance: f64, requested: f64) -> Option<bool> {
        let is_decided = (distance - requested).abs() >= self.error;
        is_decided.then_some(distance <= requested)
    }
}

/// The error of the finest of three runs from their distances: for errors `C r^-p` after refinements `r` of 3, 2 and 1 these
/// are `C (2^-p - 3^-p)` and `C (1 - 2^-p)`.
fn error_of_finest(to_finer: f64, to_coarser: f64) -> f64 {
    let left = |order: f64| REFINEMENTS.map(|finer| finer.powf(-order));
    let fall = |order: f64| {
        let [third, half, one] = left(order);
        (one - half) / (half - third)
    };
    let [mut low, mut high] = ORDERS;
    for _ in 0..BISECTIONS {
        let middle = 0.5 * (low + high);
        if to_coarser > fall(middle) * to_finer { low = middle } else { high = middle }
    }
    let [third, half, _] = left(0.5 * (low + high));
    to_finer * third / (half - third)
}

/// Positions of a run that is finer than the chosen one by one of the refinements.
fn simulate_finer(text: &str, finest: &Problem, refinement: usize) -> Result<Vec<[f64; 3]>, Error> {
    let finer = REFINEMENTS[refinement];
    let segments = format!("segments = {}", (finer * finest.segments() as f64).round());
    let step = finest.time()?.step_size();
    let step = match finest.time()?.scheme.name() {
        "rodas4" => {
            format!("step = {}\nscheme = \"rodas4\"", step / REFINEMENTS_RODAS4[refinement])
        }
        _ => format!("step = {}\nscheme = \"generalised-alpha\"\nrho_inf = 0.9", step / finer),
    };
    let (problem, run) = simulate(&read(text, "", &segments, &step)?)?;
    Ok(Motion::of(&problem, &run)?.places)
}
