//! The global search of the optimum, without a given start, or where the given one may be far from the optimum.
//!
//! The misfit over Young's modulus has many minima: a wrong stiffness can match a long vibration every few periods.
//! Over the first period there is only one. Input: a search with its sigmas. A coarse model is scanned over the first
//! period. It is fitted from the best point of the scan and from those that may end lower, over a growing part of the
//! records. The full model is fitted from the ends of the best two, over growing parts of the records, from the horizon
//! (time, s) up to which the coarse model is trusted. It is fitted from the remaining points only if the search has not
//! ended by then. Then the given start is tried, if it is outside of the basin of the best optimum and the search does
//! not stop at the first fit. Further levels ([`LEVELS`]) follow while the optimum is not acceptable or not converged:
//! the full model from the first period on, then finer scans. Starts near an acceptable minimum follow (`neighbors`) if
//! its residuals are more than white noise.
//!
//! The search ends at the first converged optimum with acceptable residuals (`residual_acceptance`) that are white
//! noise. Without a measured motion it ends after all starts of a level. If it stops at the first fit, as on a mesh
//! that the program chose, plausible residuals suffice. After an optimum it begins no finer scan beyond [`MOST_WORK`],
//! or if the data precheck found a likely error of the setup. Output (`global_optimum`): the optimum with the lowest
//! objective of all starts; without one the last error. A stop by the user, and a scan without a point that can be
//! simulated, are errors in any case.

use crate::error::Error;
use crate::fit::search::Search;
use crate::fit::search::coarse::ScanModel;
use crate::fit::search::journal::{SearchStage, Visit};
use crate::fit::search::local_minima::{SAME, distance};
use crate::fit::search::neighbors;
use crate::fit::search::optimum::{NO_START, Optimum, Tolerances};
use crate::fit::search::scan::Candidate;
use crate::fit::unknown::Unknown;
use crate::numerics::half_sum_of_squares;
use crate::numerics::total_order;
use rayon::prelude::*;

/// Largest number of candidates of a scan that descend, on a grid that is not refined. More find more minima, at the
/// cost of a descent each.
const CANDIDATES: usize = 4;
/// Smallest distance of two candidates on the scales of the unknowns: a factor of 2.5 of a positive parameter.
const CANDIDATE_DISTANCE: f64 = 0.9;
/// Largest distance, on the scales of the unknowns, of two points that are the same to the coarse model.
const SAME_COARSE: f64 = 1e-2;
/// Largest misfit of a candidate over the best one, while the horizon of the coarse model grows. A larger ratio keeps
/// more candidates, at the cost of a descent of each per horizon.
const COMPETITIVE: f64 = 4.0;
/// Number of candidates of the coarse model from which the full one starts. Each costs a fit of the full model.
const FULL_STARTS: usize = 2;

/// Time steps of the coarse model in the first period, in the scan, which determines only the basin.
const SCAN_STEPS: f64 = 24.0;
/// Time steps of the coarse model in the first period, in its descents. More leave less bias at the end of a descent,
/// at a proportional cost.
const COARSE_STEPS: f64 = 48.0;

/// Smallest factor by which the horizon of the coarse model grows from descent to descent. A larger factor takes fewer
/// descents, but may leave the basin between two horizons.
const LEAST_GROWTH: f64 = 2.0;
/// Relative RMS residual up to which the horizon grows faster. The residuals of wrong unknowns grow in proportion to
/// the horizon.
const UNEXPLAINED_AT_HORIZON: f64 = 0.1;

/// Largest distance from a start to an optimum in the same basin, on the scales of the unknowns. A larger distance
/// omits given starts that would lead to another optimum; a smaller one repeats fits.
const BASIN: f64 = 0.3;
/// Largest number of times that the search continues from a minimum to a lower one near it. Each costs lines of coarse
/// simulations and up to three fits.
const MOST_NEIGHBORHOODS: usize = 4;
/// Work, in full simulations, after which no finer scan and no further neighborhood begins. Most optima are found
/// within 50.
const MOST_WORK: f64 = 1000.0;

/// Stopping criteria of the descents of the coarse model. They are loose, because its optimum is only a start.
const COARSE_DESCENT: Tolerances = Tolerances { step: 1e-4, noise: 1e-2, iterations: 12 };
/// Stopping criteria of the full model over a part of the records, whose optimum is the start over the next part.
const GROWING_DESCENT: Tolerances = Tolerances { step: 1e-5, noise: 1e-2, iterations: 20 };

/// Extent of a scan and of the descents from its candidates.
struct ScanLevel {
    /// Horizon of the scan, in first periods.
    stretch: f64,
    /// Refinement of the grid, and factor on the number of candidates.
    grid: usize,
    /// First horizon of the full model, in first periods: up to it the coarse model is accurate enough.
    trusted_periods: f64,
    /// Factor from one horizon of the full model to the next.
    growth: f64,
}

/// Levels of the search in their order, until an optimum is acceptable. The coarse model identifies the modulus of a
/// stiff rod to a few per cent, which is inside the basin of a record of 16 periods. A soft rod that whips needs the
/// full model from the first period on.
const LEVELS: [ScanLevel; 4] = [
    ScanLevel { stretch: 1.0, grid: 1, trusted_periods: 16.0, growth: 4.0 },
    ScanLevel { stretch: 1.0, grid: 1, trusted_periods: 1.0, growth: 1.5 },
    ScanLevel { stretch: 0.5, grid: 2, trusted_periods: 1.0, growth: 1.5 },
    ScanLevel { stretch: 2.0, grid: 2, trusted_periods: 1.0, growth: 1.5 },
];

/// Level of a fit of the whole records at once, from a start that may be right.
const AT_ONCE: ScanLevel =
    ScanLevel { stretch: 1.0, grid: 1, trusted_periods: f64::MAX, growth: 4.0 };

/// Level of a fit from a start near another minimum, found over a few first periods.
const NEIGHBOR: ScanLevel =
    ScanLevel { stretch: 1.0, grid: 1, trusted_periods: neighbors::PERIODS, growth: 2.0 };

/// A scanned coarse model with the candidates of its descents, the best first.
struct CoarseScan {
    /// Horizon and grid of the scan; levels with the same ones share it.
    stretch: f64,
    grid: usize,
    coarse: ScanModel,
    /// First periods, s, one per experiment.
    first: Vec<f64>,
    /// Candidates after their descents over the first periods.
    descended: Vec<Candidate>,
    /// Candidates before their descents.
    others: Vec<Candidate>,
}

/// Selection of the candidates of a scan from which the coarse model descends.
#[derive(Clone, Copy, PartialEq)]
enum Descents {
    /// The best one, and those that may end lower than it.
    Competitive,
    All,
}

/// The best optimum of several starts, and the last failure.
#[derive(Default)]
struct StartResults {
    best: Option<Optimum>,
    failure: Option<Error>,
}

impl StartResults {
    /// Whether there is a best optimum so far, and it satisfies the condition.
    fn has(&self, condition: impl Fn(&Optimum) -> bool) -> bool {
        self.best.as_ref().is_some_and(condition)
    }
}

impl Search<'_> {
    /// The optimum with the lowest objective of all starts. The search ends at a converged optimum with acceptable
    /// residuals that are white noise; one that stops at the first fit needs only plausible residuals. Finer scans
    /// follow as long as the best optimum is not acceptable or not converged, up to [`MOST_WORK`] or a suspicion. An
    /// acceptable one without white noise is compared with minima near it, then the lower one found with those near
    /// that, at most [`MOST_NEIGHBORHOODS`] times. An error if no start leads to an optimum, a scan has no point, or
    /// the user stops.
    pub fn global_optimum(&self) -> Result<Optimum, Error> {
        let is_acceptable = |b: &Optimum| {
            b.converged
                && match self.stops_at_first_fit {
                    true => self.has_plausible_residuals(b),
                    false => self.has_acceptable_residuals(b),
                }
        };
        // Residuals above the noise may be those of a wrong minimum of many unknowns.
        let is_final =
            |b: &Optimum| is_acceptable(b) && (self.stops_at_first_fit || self.is_noise(b));
        let mut results = StartResults::default();
        let mut tries_given_start = !self.stops_at_first_fit;
        let mut last_scan: Option<CoarseScan> = None;
        'levels: for level in &LEVELS {
            // 1. The coarse model over a grid.
            let is_same =
                |scan: &CoarseScan| (scan.stretch, scan.grid) == (level.stretch, level.grid);
            let mut scan = match last_scan.take().filter(is_same) {
                Some(scan) => scan,
                None => self.coarse_scan(level)?,
            };
            // 2. The full model from the best candidates, then from all others.
            let mut tried: Vec<Vec<f64>> = Vec::new();
            for descents in [Descents::Competitive, Descents::All] {
                if descents == Descents::All && scan.others.is_empty() {
                    continue;
                }
                for start in self.starts(&mut scan, level, descents)? {
                    if tried.iter().any(|other| is_near(other, &start)) {
                        continue;
                    }
                    self.try_start(&start, level, &mut results)?;
                    // Fits at rest take little work, and another minimum may be as low.
                    if results.has(is_final) && self.moves() {
                        break 'levels;
                    }
                    tried.push(start);
                }
            }
            last_scan = Some(scan);
            // 3. The full model from the given start: the coarse model may be wrong about it.
            if std::mem::take(&mut tries_given_start)
                && let Some(start) = self.given_start(results.best.as_ref())
            {
                for level in [&AT_ONCE, &LEVELS[1]] {
                    self.try_start(&start, level, &mut results)?;
                    if results.has(is_final) {
                        break 'levels;
                    }
                }
            }
            let is_hopeless = self.suspicious || self.simulations() > MOST_WORK;
            if results.has(|b| is_acceptable(b) || is_hopeless) {
                break;
            }
        }
        // 4. An acceptable optimum with residuals above white noise may have a lower minimum near it, and that one
        // again.
        let mut continues = results.has(|b| is_acceptable(b) && !is_final(b));
        for _ in 0..MOST_NEIGHBORHOODS {
            let Some(found) = results.best.clone().filter(|_| continues) else { break };
            for start in self.neighboring_starts(&found)? {
                self.try_start(&start, &NEIGHBOR, &mut results)?;
            }
            let is_lower = |b: &Optimum| distance(&b.x, &found.x) > SAME && b.cost < found.cost;
            continues = results.has(is_lower) && self.simulations() < MOST_WORK;
        }
        let StartResults { best, failure } = results;
        best.ok_or_else(|| failure.unwrap_or_else(|| Error::Fit(NO_START.into())))
    }

    /// Fits the full model from the point `start` over the growing horizons of the `level`. The optimum becomes the
    /// best one in `results` if it is [preferred](Search::is_preferred); a failure becomes the last one there. An error
    /// only if the user stopped the fit.
    fn try_start(
        &self,
        start: &[f64],
        level: &ScanLevel,
        results: &mut StartResults,
    ) -> Result<(), Error> {
        match self.refine(start, level) {
            Ok(optimum) if !results.has(|b| !self.is_preferred(&optimum, b)) => {
                results.best = Some(optimum);
            }
            Ok(_) => {}
            Err(Error::Interrupted) => return Err(Error::Interrupted),
            Err(error) => results.failure = Some(error),
        }
        Ok(())
    }

    /// The start point of the full model, on the unknowns' scales: given starts (at the nearest bound if outside), else
    /// the values of the `best` optimum, else those of the scene. If no unknown has a start it is the point of the
    /// scene, and only if its cost is below that of `best`. `None` if a value is missing, or `best` is within [`BASIN`]
    /// of it. Without `best` it is always returned, if no value is missing.
    pub fn given_start(&self, best: Option<&Optimum>) -> Option<Vec<f64>> {
        let has_start = self.unknowns.iter().any(|unknown| unknown.start.is_some());
        let at = |(i, unknown): (usize, &Unknown)| {
            let found = best.filter(|_| has_start).map(|best| best.x[i]);
            let [low, high] = unknown.scaled_bounds();
            let scaled = |value| unknown.to_scale(value).clamp(low, high);
            unknown.start.map(scaled).or(found).or_else(|| self.scene_value(unknown).map(scaled))
        };
        let start: Vec<f64> = self.unknowns.iter().enumerate().map(at).collect::<Option<_>>()?;
        // A given start is tried unless the best optimum is in its basin; the scene's own values only if they have a
        // lower cost.
        let Some(best) = best else { return Some(start) };
        let cost = |start: &Vec<f64>| {
            let found = self.all_residuals().and_then(|residuals| residuals.residuals(start));
            found.map_or(f64::INFINITY, |residuals| half_sum_of_squares(&residuals))
        };
        let is_other = distance(&best.x, &start) > BASIN && (has_start || cost(&start) < best.cost);
        is_other.then_some(start)
    }

    /// Scans the coarse model over the first periods of this `level` on its grid; the full model instead if no point of
    /// the coarse one has a finite misfit. Returns the scan with at most [`CANDIDATES`] times the refinement [distinct
    /// candidates](distinct_candidates), none descended yet. Its coarse model for the descents has [`COARSE_STEPS`]
    /// steps per first period, that of the scan [`SCAN_STEPS`]. An error if the full model has no finite misfit either,
    /// a coarse scene is invalid, or the user stops.
    fn coarse_scan(&self, level: &ScanLevel) -> Result<CoarseScan, Error> {
        let ScanLevel { stretch, grid, .. } = *level;
        let first = self.first_periods(stretch);
        let scanned = ScanModel::new(self, &first, SCAN_STEPS)?;
        let found = match self.scan(&scanned, &first, grid) {
            Err(Error::Fit(_)) => self.scan(&ScanModel::from_full_model(self), &first, grid),
            found => found,
        };
        let others = distinct_candidates(found?, CANDIDATES * grid);
        let coarse = ScanModel::new(self, &first, COARSE_STEPS)?;
        Ok(CoarseScan { stretch, grid, coarse, first, descended: Vec::new(), others })
    }

    /// Starts of the full model, on the unknowns' scales, at most [`FULL_STARTS`], the best first. Candidates of a
    /// `scan` descend over the first periods: all, or (`Competitive`) the best one, then those whose bound is not above
    /// the lowest end so far. Then the horizon grows to the trusted one of the `level`, with a descent at each. The
    /// factor is [`UNEXPLAINED_AT_HORIZON`] over the unexplained fraction, at least [`LEAST_GROWTH`]. Before each
    /// growth candidates above [`COMPETITIVE`] times the lowest misfit are dropped, and neighbors in the order of
    /// misfits within [`SAME_COARSE`] are merged. In the `scan` descended candidates move from `others` to `descended`,
    /// with their ends over the first periods. An error if the user stops.
    fn starts(
        &self,
        scan: &mut CoarseScan,
        level: &ScanLevel,
        descents: Descents,
    ) -> Result<Vec<Vec<f64>>, Error> {
        let CoarseScan { coarse, first, descended, others, .. } = scan;
        loop {
            let least = descended.iter().map(|c| c.cost).reduce(f64::min);
            // The best candidate descends alone: its end determines which others may end lower.
            let mut is_first = true;
            let descends = |candidate: &Candidate| match (descents, least) {
                (Descents::All, _) => true,
                (Descents::Competitive, None) => std::mem::take(&mut is_first),
                (Descents::Competitive, Some(least)) => candidate.bound <= least,
            };
            let (mut next, rest): (Vec<_>, Vec<_>) = others.drain(..).partition(descends);
            *others = rest;
            if next.is_empty() {
                break;
            }
            self.descend(coarse, first, &mut next)?;
            descended.append(&mut next);
        }
        // The horizon of the coarse model grows from the first periods; candidates that end in one minimum are merged.
        let mut candidates = descended.clone();
        let durations = self.durations();
        let mut horizons = first.clone();
        loop {
            candidates.sort_by_cached_key(|x| total_order(x.cost));
            let best = candidates[0].cost;
            candidates.retain(|c| c.cost <= COMPETITIVE * best);
            candidates.dedup_by(|a, b| is_near(&a.x, &b.x));
            self.report("coarse model");
            // Beyond this horizon the bias of the coarse model leaves the basin.
            let trusted = |(t, end): (&f64, &f64)| end.min(level.trusted_periods * t);
            let trusted: Vec<f64> = first.iter().zip(&durations).map(trusted).collect();
            if horizons.iter().zip(&trusted).all(|(h, most)| h >= most) {
                break;
            }
            let counts = self.residuals(&horizons)?.counts();
            let unexplained = self.unexplained_fraction(best, &counts);
            let growth = (UNEXPLAINED_AT_HORIZON / unexplained).max(LEAST_GROWTH);
            horizons.iter_mut().zip(&trusted).for_each(|(h, most)| *h = (growth * *h).min(*most));
            self.descend(coarse, &horizons, &mut candidates)?;
        }
        let starts = candidates.into_iter().take(FULL_STARTS);
        Ok(starts.map(|c| coarse.to_full_model(self, c.x)).collect())
    }

    /// Fits the coarse model up to `horizons`, s, from every candidate on several threads, and replaces point and
    /// misfit of each by the end of its fit. A candidate whose fit fails is unchanged. The ends enter the journal, the
    /// work is counted; an interruption is an error.
    fn descend(
        &self,
        coarse: &ScanModel,
        horizons: &[f64],
        candidates: &mut [Candidate],
    ) -> Result<(), Error> {
        let model = coarse.search(self);
        let fit = |Candidate { x, .. }: &Candidate| {
            let search = model.detached();
            let residuals = search.residuals(horizons);
            // Descents are not recorded one by one: only their ends enter the history.
            let end = residuals.and_then(|r| search.optimize(r, x, COARSE_DESCENT, None));
            (end, search.work.total())
        };
        // Threads count their own work, which is added in the order of the candidates: the history does not depend on
        // the threads.
        let ends: Vec<_> = candidates.par_iter().map(fit).collect();
        let mut stopped = false;
        for (Candidate { x, cost, .. }, (end, work)) in candidates.iter_mut().zip(ends) {
            self.work.add(work);
            match end {
                Ok(optimum) => {
                    (*x, *cost) = (optimum.x, optimum.cost);
                    self.record_visit(Visit {
                        stage: SearchStage::Coarse,
                        x: coarse.to_full_model(self, x.clone()),
                        cost: *cost,
                        residuals: optimum.residuals,
                        counts: optimum.counts,
                    });
                }
                Err(Error::Interrupted) => stopped = true,
                Err(_) => {}
            }
        }
        // An interruption counts after all work is counted.
        if stopped { Err(Error::Interrupted) } else { Ok(()) }
    }

    /// Fits the full model from the point `start`: over growing parts of the records, from the first horizon of the
    /// `level` on, by its growth factor. These fits end when every horizon reaches `1/(0.5 + 0.5 growth)` of its
    /// record. Then follow the whole records, and [raised dampings](Search::with_raised_damping). The end is recorded
    /// as a minimum. An error if any of the fits fails, except that with raised dampings.
    fn refine(&self, start: &[f64], level: &ScanLevel) -> Result<Optimum, Error> {
        let durations = self.durations();
        let first = self.first_periods(level.stretch);
        let mut horizons: Vec<f64> = first.iter().map(|t| level.trusted_periods * t).collect();
        // A last part that is nearly the whole record is not worth a fit of its own.
        let nearly = 0.5 + 0.5 * level.growth;
        let mut x = start.to_vec();
        while horizons.iter().zip(&durations).any(|(h, end)| *h < end / nearly) {
            let part = self.residuals(&horizons)?;
            x = self.optimize(part, &x, GROWING_DESCENT, Some(SearchStage::Growing))?.x;
            self.report("growing horizon");
            horizons.iter_mut().for_each(|h| *h *= level.growth);
        }
        let optimum = self.with_raised_damping(self.polish(&x)?)?;
        self.add_minimum(&optimum);
        Ok(optimum)
    }
}

/// The scanned points with the lowest misfits that are farther than [`CANDIDATE_DISTANCE`] (maximum norm) from every
/// better one kept, at most `most`, the lowest first.
fn distinct_candidates(mut scanned: Vec<Candidate>, most: usize) -> Vec<Candidate> {
    scanned.sort_by_cached_key(|x| total_order(x.cost));
    let mut candidates: Vec<Candidate> = Vec::new();
    for candidate in scanned {
        let is_far = |other: &Candidate| distance(&candidate.x, &other.x) > CANDIDATE_DISTANCE;
        if candidates.iter().all(is_far) && candidates.len() < most {
            candidates.push(candidate);
        }
    }
    candidates
}

/// Whether the points `x` and `y`, on the unknowns' scales, differ by less than [`SAME_COARSE`] in every unknown: they
/// are the same to the coarse model.
fn is_near(x: &[f64], y: &[f64]) -> bool {
    distance(x, y) < SAME_COARSE
}
