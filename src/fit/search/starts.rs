//! A start for the optimiser when none is known, or when the one given may be far off.
//!
//! The misfit over Young's modulus has many minima: a wrong stiffness can match a long vibration
//! every few periods. Over the first period there is only one. So: scan a coarse model over the
//! first period, descend from the best candidate, and from those that may end lower; refine what they
//! find while the horizon grows, and only then turn to the full model, whose own horizon starts where the
//! coarse model's bias is still harmless. The candidates that were left out have their turn when what was
//! found leaves more than noise.

use crate::error::Error;
use crate::fit::search::Search;
use crate::fit::search::coarse::Coarse;
use crate::fit::search::journal::{Stage, Visit};
use crate::fit::search::local_minima::{SAME, distance};
use crate::fit::search::neighbors;
use crate::fit::search::optimum::Optimum;
use crate::fit::search::scan::Candidate;
use crate::fit::unknown::Unknown;
use crate::numerics::half_sum_of_squares;
use crate::numerics::total_order;
use rayon::prelude::*;

/// Candidates of the scan that are refined.
const CANDIDATES: usize = 4;

/// Steps of the coarse model in the first period: in the scan, which finds no more than the basin, and in
/// descents.
const SCAN_STEPS: f64 = 24.0;
const COARSE_STEPS: f64 = 48.0;

/// The coarse model's horizon grows at least by this factor, and until what it leaves of the motion, which
/// grows with the horizon where the unknowns are off, would be this part of it.
const LEAST_GROWTH: f64 = 2.0;
const LEFT: f64 = 0.1;

/// What ends nearer than this to a start, on the scales of the unknowns, may have come from there.
const BASIN: f64 = 0.3;
/// So often a search goes on from a minimum to a lower one beside it.
const MOST_NEIGHBORHOODS: usize = 4;
/// Simulations after which no finer search is begun: what fits has mostly been found after 50.
const MOST_WORK: f64 = 1000.0;

/// How much a search does before it believes its start.
struct ScanLevel {
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
const EFFORTS: [ScanLevel; 4] = [
    ScanLevel { stretch: 1.0, grid: 1, trusted_periods: 16.0, growth: 4.0 },
    ScanLevel { stretch: 1.0, grid: 1, trusted_periods: 1.0, growth: 1.5 },
    ScanLevel { stretch: 0.5, grid: 2, trusted_periods: 1.0, growth: 1.5 },
    ScanLevel { stretch: 2.0, grid: 2, trusted_periods: 1.0, growth: 1.5 },
];

/// Of a start that is nearly right: the whole record from there.
const AT_ONCE: ScanLevel =
    ScanLevel { stretch: 1.0, grid: 1, trusted_periods: f64::MAX, growth: 4.0 };

/// Of a start near a minimum over a few first periods.
const NEIGHBOR: ScanLevel =
    ScanLevel { stretch: 1.0, grid: 1, trusted_periods: neighbors::PERIODS, growth: 2.0 };

impl ScanLevel {
    /// Whether its coarse models are another's.
    fn scans_as(&self, other: &Self) -> bool {
        (self.stretch, self.grid) == (other.stretch, other.grid)
    }
}

/// The coarse model over the first periods, s, and where its descents begin, best first.
struct Field {
    coarse: Coarse,
    first: Vec<f64>,
    /// Those that have descended, and those that have not.
    descended: Vec<Candidate>,
    others: Vec<Candidate>,
}

/// Which candidates of a scan descend: the best, and those that may end lower than it does; or all.
#[derive(Clone, Copy, PartialEq)]
enum Descents {
    Rivals,
    All,
}

impl Search<'_> {
    /// The best of all starts; searches again, more finely, when much of what was measured is left
    /// unexplained, or the way to the minimum was barred: where steps are halved the misfit jumps.
    pub fn globally(&self) -> Result<Optimum, Error> {
        let enough = |b: &Optimum| {
            b.converged
                && if self.stops_at_first_fit {
                    self.has_plausible_residuals(b)
                } else {
                    self.has_acceptable_residuals(b)
                }
        };
        // The first start is nearly always it; others are for when it was not, or left
        // more than noise, as a wrong minimum of many unknowns may.
        let done = |b: &Optimum| enough(b) && (self.stops_at_first_fit || self.is_noise(b));
        let mut best: Option<Optimum> = None;
        let mut failure = None;
        let mut untried = !self.stops_at_first_fit;
        let mut scanned: Option<(&ScanLevel, Field)> = None;
        'efforts: for effort in &EFFORTS {
            let same = |(other, _): &(&ScanLevel, Field)| effort.scans_as(other);
            let mut field = match scanned.take().filter(same) {
                Some((_, field)) => field,
                None => self.field(effort)?,
            };
            let mut tried: Vec<Vec<f64>> = Vec::new();
            for descents in [Descents::Rivals, Descents::All] {
                if descents == Descents::All && field.others.is_empty() {
                    continue;
                }
                for start in self.starts(&mut field, effort, descents)? {
                    if tried.iter().any(|other| is_near(other, &start)) {
                        continue;
                    }
                    self.try_start(&start, effort, (&mut best, &mut failure))?;
                    if best.as_ref().is_some_and(done) {
                        break 'efforts;
                    }
                    tried.push(start);
                }
            }
            scanned = Some((effort, field));
            // A coarse model may be wrong about a start that is right.
            if std::mem::take(&mut untried)
                && let Some(start) = self.given(best.as_ref())
            {
                for effort in [&AT_ONCE, &EFFORTS[1]] {
                    self.try_start(&start, effort, (&mut best, &mut failure))?;
                    if best.as_ref().is_some_and(done) {
                        break 'efforts;
                    }
                }
            }
            let hopeless = self.suspicious || self.simulations() > MOST_WORK;
            if best.as_ref().is_some_and(|b| enough(b) || hopeless) {
                break;
            }
        }
        // What explains the motion, but leaves more than white noise, may have a better one near it. Where that is so, the
        // better one may, too, whatever it leaves.
        let mut goes_on = best.as_ref().is_some_and(|b| enough(b) && !done(b));
        for _ in 0..MOST_NEIGHBORHOODS {
            let Some(found) = best.clone().filter(|_| goes_on) else { break };
            for start in self.neighbors(&found)? {
                self.try_start(&start, &NEIGHBOR, (&mut best, &mut failure))?;
            }
            let is_lower = |b: &Optimum| distance(&b.x, &found.x) > SAME && b.cost < found.cost;
            goes_on = best.as_ref().is_some_and(is_lower) && self.simulations() < MOST_WORK;
        }
        best.ok_or_else(|| {
            failure.unwrap_or_else(|| {
                Error::Fit(
                    "no start value for the fit was found. Give a start or bounds \
                                                  for each parameter"
                        .into(),
                )
            })
        })
    }

    /// Fits the full model from a start, and keeps what it finds where that is better.
    fn try_start(
        &self,
        start: &[f64],
        effort: &ScanLevel,
        (best, failure): (&mut Option<Optimum>, &mut Option<Error>),
    ) -> Result<(), Error> {
        match self.refine(start, effort) {
            Ok(optimum) => {
                if best.as_ref().is_none_or(|b| optimum.cost < b.cost) {
                    *best = Some(optimum);
                }
            }
            Err(Error::Interrupted) => return Err(Error::Interrupted),
            Err(error) => *failure = Some(error),
        }
        Ok(())
    }

    /// The starts that were given, beside what was found of the other unknowns; where none was, what the scene says, if that
    /// is better than what was found. None if the best that was found has come from there, or may have.
    pub fn given(&self, best: Option<&Optimum>) -> Option<Vec<f64>> {
        let told = self.unknowns.iter().any(|unknown| unknown.start.is_some());
        let at = |(i, unknown): (usize, &Unknown)| {
            let found = best.filter(|_| told).map(|best| best.x[i]);
            let [low, high] = unknown.scaled_bounds();
            let scaled = |value| unknown.to_scale(value).clamp(low, high);
            unknown.start.map(scaled).or(found).or_else(|| self.here(unknown).map(scaled))
        };
        let start: Vec<f64> = self.unknowns.iter().enumerate().map(at).collect::<Option<_>>()?;
        let Some(best) = best else { return Some(start) };
        let cost = |start: &Vec<f64>| {
            let there = self.all_residuals().and_then(|residuals| residuals.residuals(start));
            there.map_or(f64::INFINITY, |there| half_sum_of_squares(&there))
        };
        let is_other = distance(&best.x, &start) > BASIN && (told || cost(&start) < best.cost);
        is_other.then_some(start)
    }

    /// Scans a coarse model.
    fn field(&self, effort: &ScanLevel) -> Result<Field, Error> {
        let first = self.first_periods(effort.stretch);
        let scanned = Coarse::new(self, &first, SCAN_STEPS)?;
        let found = match self.scan(&scanned, &first, effort.grid) {
            // What the coarse model cannot take anywhere, the full one may.
            Err(Error::Fit(_)) => self.scan(&Coarse::as_it_is(self), &first, effort.grid),
            found => found,
        };
        let others = apart(found?, effort);
        let coarse = Coarse::new(self, &first, COARSE_STEPS)?;
        Ok(Field { coarse, first, descended: Vec::new(), others })
    }

    /// Starts for the full model, most promising first.
    fn starts(
        &self,
        field: &mut Field,
        effort: &ScanLevel,
        descents: Descents,
    ) -> Result<Vec<Vec<f64>>, Error> {
        let Field { coarse, first, descended, others } = field;
        loop {
            let least = descended.iter().map(|c| c.cost).reduce(f64::min);
            let chosen = |(k, candidate): &(usize, Candidate)| match (descents, least) {
                (Descents::All, _) => true,
                // The best alone says which others are worth it.
                (Descents::Rivals, None) => *k == 0,
                (Descents::Rivals, Some(least)) => candidate.floor <= least,
            };
            let (next, rest): (Vec<_>, Vec<_>) = others.drain(..).enumerate().partition(chosen);
            let alone = |(_, candidate)| candidate;
            *others = rest.into_iter().map(alone).collect();
            let mut next: Vec<Candidate> = next.into_iter().map(alone).collect();
            if next.is_empty() {
                break;
            }
            self.descend(coarse, first, &mut next)?;
            descended.append(&mut next);
        }
        let mut candidates = descended.clone();
        let durations = self.durations();
        let mut horizons = first.clone();
        loop {
            candidates.sort_by_cached_key(|x| total_order(x.cost));
            let best = candidates[0].cost;
            candidates.retain(|c| c.cost <= 4.0 * best);
            candidates.dedup_by(|a, b| is_near(&a.x, &b.x));
            self.report("coarse model");
            // The coarse model is not trusted further.
            let trusted = |(t, end): (&f64, &f64)| end.min(effort.trusted_periods * t);
            let trusted: Vec<f64> = first.iter().zip(&durations).map(trusted).collect();
            if horizons.iter().zip(&trusted).all(|(h, most)| h >= most) {
                break;
            }
            let counts = self.residuals(&horizons)?.counts();
            let growth = (LEFT / self.unexplained_fraction(best, &counts)).max(LEAST_GROWTH);
            horizons.iter_mut().zip(&trusted).for_each(|(h, most)| *h = (growth * *h).min(*most));
            self.descend(coarse, &horizons, &mut candidates)?;
        }
        Ok(candidates.into_iter().take(2).map(|c| coarse.correct(self, c.x)).collect())
    }

    /// Fits the coarse model up to `horizons`, s, from every candidate at once.
    fn descend(
        &self,
        coarse: &Coarse,
        horizons: &[f64],
        candidates: &mut [Candidate],
    ) -> Result<(), Error> {
        let task = coarse.task(self);
        let fit = |Candidate { x, .. }: &Candidate| {
            let search = task.search();
            let residuals = search.residuals(horizons);
            let end = residuals.and_then(|r| search.optimize(r, x, (1e-4, 1e-2, 12), None));
            (end, search.work.total())
        };
        let ends: Vec<_> = candidates.par_iter().map(fit).collect();
        let mut stopped = false;
        for (Candidate { x, cost, .. }, (end, work)) in candidates.iter_mut().zip(ends) {
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
    fn refine(&self, start: &[f64], effort: &ScanLevel) -> Result<Optimum, Error> {
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
        self.add_minimum(&optimum);
        Ok(optimum)
    }
}

/// The best of the points scanned that are not near a better one.
fn apart(mut scanned: Vec<Candidate>, effort: &ScanLevel) -> Vec<Candidate> {
    scanned.sort_by_cached_key(|x| total_order(x.cost));
    let mut candidates: Vec<Candidate> = Vec::new();
    for candidate in scanned {
        let far = |other: &Candidate| distance(&candidate.x, &other.x) > 0.9;
        if candidates.iter().all(far) && candidates.len() < CANDIDATES * effort.grid {
            candidates.push(candidate);
        }
    }
    candidates
}

/// Whether two points are one to the coarse model.
fn is_near(x: &[f64], y: &[f64]) -> bool {
    distance(x, y) < 1e-2
}
