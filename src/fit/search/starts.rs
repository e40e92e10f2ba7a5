//! A start for the optimiser when none is known, or when the one given may be far off.
//!
//! The misfit over Young's modulus has many minima: a wrong stiffness can match a long vibration
//! every few periods. Over the first period there is only one. So: scan a coarse model over the
//! first period, refine the best candidates there while the horizon doubles, and only then turn to
//! the full model, whose own horizon starts where the coarse model's bias is still harmless.

use crate::error::Error;
use crate::fit::search::Search;
use crate::fit::search::coarse::Coarse;
use crate::fit::search::journal::{Stage, Visit};
use crate::fit::search::optimum::Optimum;
use rayon::prelude::*;

/// Candidates of the scan that are refined.
const CANDIDATES: usize = 4;

/// Simulations after which no finer search is begun: what fits has mostly been found after 50.
const MOST_WORK: f64 = 1000.0;

/// Values on the unknowns' scales, and the misfit there.
type Candidate = (Vec<f64>, f64);

/// How much a search does before it believes its start.
struct Effort {
    /// Factor on the first period.
    stretch: f64,
    /// Factor on the number of candidates.
    grid: usize,
    /// How many first periods the coarse model is trusted for.
    trusted_periods: f64,
    /// Factor from one horizon of the full model to the next.
    growth: f64,
}

/// In order, until the motion is explained. The coarse model identifies the modulus of a
/// moderately robust rod to a few per cent, which is inside the basin of a record of 16 periods. A
/// rod so soft that it whips about needs the full model from the first period on.
const EFFORTS: [Effort; 4] = [
    Effort { stretch: 1.0, grid: 1, trusted_periods: 16.0, growth: 4.0 },
    Effort { stretch: 1.0, grid: 1, trusted_periods: 1.0, growth: 1.5 },
    Effort { stretch: 0.5, grid: 2, trusted_periods: 1.0, growth: 1.5 },
    Effort { stretch: 2.0, grid: 2, trusted_periods: 1.0, growth: 1.5 },
];

impl Search<'_> {
    /// The best of all starts; searches again, more finely, when much of what was measured is left
    /// unexplained.
    pub fn globally(&self) -> Result<Optimum, Error> {
        let mut best: Option<Optimum> = None;
        let mut failure = None;
        for effort in &EFFORTS {
            for start in self.starts(effort)? {
                match self.refine(&start, effort) {
                    Ok(optimum) => {
                        if best.as_ref().is_none_or(|b| optimum.cost < b.cost) {
                            best = Some(optimum);
                        }
                    }
                    Err(Error::Interrupted) => return Err(Error::Interrupted),
                    Err(error) => failure = Some(error),
                }
                // The first start is nearly always it; the second is for when it was not, or left
                // more than noise, as a wrong minimum of many unknowns may.
                let done = |b: &Optimum| b.converged && self.explained(b) && self.is_noise(b);
                if best.as_ref().is_some_and(done) {
                    break;
                }
            }
            let hopeless = self.suspicious || self.simulations() > MOST_WORK;
            if best.as_ref().is_some_and(|b| self.explained(b) || hopeless) {
                break;
            }
        }
        best.ok_or_else(|| {
            failure.unwrap_or_else(|| Error::Fit("no start for the fit was found".into()))
        })
    }

    /// Starts for the full model, most promising first.
    fn starts(&self, effort: &Effort) -> Result<Vec<Vec<f64>>, Error> {
        let first = self.first_periods(effort.stretch);
        let coarse = Coarse::new(self, &first)?;
        let mut candidates = apart(self.scan(&coarse, &first, effort.grid)?, effort);
        let durations = self.durations();
        let mut horizons = first.clone();
        loop {
            self.refine_coarse(&coarse, &horizons, &mut candidates)?;
            candidates.sort_by(|a, b| a.1.total_cmp(&b.1));
            let best = candidates[0].1;
            candidates.retain(|(_, cost)| *cost <= 4.0 * best);
            candidates.dedup_by(|a, b| a.0.iter().zip(&b.0).all(|(a, b)| (a - b).abs() < 1e-2));
            self.report("coarse model");
            let trusted = first.iter().zip(&durations).map(|(t, end)| {
                // The coarse model is not trusted further.
                end.min(effort.trusted_periods * t)
            });
            if horizons.iter().zip(trusted).all(|(h, most)| *h >= most) {
                break;
            }
            horizons.iter_mut().zip(&durations).for_each(|(h, end)| *h = (2.0 * *h).min(*end));
        }
        Ok(candidates.into_iter().take(2).map(|(x, _)| coarse.correct(self, x)).collect())
    }

    /// Fits the coarse model up to `horizons`, s, from every candidate at once.
    fn refine_coarse(
        &self,
        coarse: &Coarse,
        horizons: &[f64],
        candidates: &mut [Candidate],
    ) -> Result<(), Error> {
        let task = coarse.task(self);
        let fit = |(x, _): &Candidate| {
            let search = task.search();
            let residuals = search.residuals(horizons);
            let end = residuals.and_then(|r| search.optimize(r, x, (1e-4, 1e-2, 12), None));
            (end, search.work.total())
        };
        let ends: Vec<_> = candidates.par_iter().map(fit).collect();
        let mut stopped = false;
        for ((x, cost), (end, work)) in candidates.iter_mut().zip(ends) {
            self.work.add(work);
            match end {
                Ok(Optimum { x: there, cost: least, residuals, counts, .. }) => {
                    (*x, *cost) = (there, least);
                    let corrected = coarse.correct(self, x.clone());
                    let stage = Stage::Coarse;
                    self.note(Visit { stage, x: corrected, cost: least, residuals, counts });
                }
                Err(Error::Interrupted) => stopped = true,
                // A candidate whose refinement fails stays where it is.
                Err(_) => {}
            }
        }
        if stopped { Err(Error::Interrupted) } else { Ok(()) }
    }

    /// Fits the full model from `start`, over growing horizons where the record is long.
    fn refine(&self, start: &[f64], effort: &Effort) -> Result<Optimum, Error> {
        let durations = self.durations();
        let first = self.first_periods(effort.stretch);
        let mut horizons: Vec<f64> = first.iter().map(|t| effort.trusted_periods * t).collect();
        let nearly = 0.5 + 0.5 * effort.growth;
        let mut x = start.to_vec();
        while horizons.iter().zip(&durations).any(|(h, end)| *h < end / nearly) {
            let part = self.residuals(&horizons)?;
            x = self.optimize(part, &x, (1e-5, 1e-2, 20), Some(Stage::Growing))?.x;
            self.report("growing horizon");
            horizons.iter_mut().for_each(|h| *h *= effort.growth);
        }
        let optimum = self.raised(self.polish(&x)?)?;
        self.journal.reach((optimum.x.clone(), optimum.cost, optimum.converged));
        Ok(optimum)
    }
}

/// The best of the points scanned that are not near a better one.
fn apart(mut scanned: Vec<Candidate>, effort: &Effort) -> Vec<Candidate> {
    scanned.sort_by(|a, b| a.1.total_cmp(&b.1));
    let mut candidates: Vec<Candidate> = Vec::new();
    for (x, cost) in scanned {
        let far = |y: &[f64]| x.iter().zip(y).any(|(a, b)| (a - b).abs() > 0.9);
        if candidates.iter().all(|(y, _)| far(y)) && candidates.len() < CANDIDATES * effort.grid {
            candidates.push((x, cost));
        }
    }
    candidates
}
