//! The scan: the coarse model's misfit over a grid of values, of which no basin that matters may slip
//! through. Over the first period the misfit has few minima, and wide ones.
//!
//! Threads share the points; what they find is gone through in the order of the grid, so that neither
//! the results nor the history depend on their number.

use crate::error::Error;
use crate::fit::measurement::experiment::Experiment;
use crate::fit::misfit::residuals::Residuals;
use crate::fit::search::coarse::Coarse;
use crate::fit::search::grid::Grid;
use crate::fit::search::journal::{Stage, Visit};
use crate::fit::search::{Search, Task};
use crate::fit::unknown::Unknown;
use crate::numerics::half_sum_of_squares;
use crate::problem::Problem;
use crate::scene::Parameter;
use crate::scene::number::Candidates;
use rayon::prelude::*;

/// Shear modulus over Young's modulus in the scan, when neither is known: Poisson's ratio 0.3.
const SHEAR_OF_YOUNGS: f64 = 1.0 / 2.6;
/// Points of the scan at most; with more unknowns, each is tried at fewer values.
const MOST_POINTS: usize = 6000;
/// Points between two reports of progress; and of them, those that a thread takes at a time.
const BATCH: usize = 16;
const SHARE: usize = 2;

/// A point on the unknowns' scales from which the coarse model may descend.
#[derive(Clone, Debug)]
pub(crate) struct Candidate {
    pub x: Vec<f64>,
    /// The misfit there.
    pub cost: f64,
    /// The least misfit that a descent from there may end with.
    pub floor: f64,
}

/// What a thread finds at a point: the misfit and the residuals, and the work that took.
struct Look {
    found: Result<(f64, Vec<f64>), Error>,
    work: f64,
    /// Whether the full model found it.
    in_full: bool,
}

/// Looks at some points up to the horizons `first`, s: by the coarse model, and where the starts that were given are one
/// that it cannot take, by the full one.
fn look([coarse, full]: [Task; 2], first: &[f64], points: &[Vec<f64>]) -> Result<Vec<Look>, Error> {
    let search = coarse.search();
    let residuals = search.residuals(first)?;
    let look = |x: &Vec<f64>| {
        let found = misfit(&residuals, x);
        let work = search.work.take();
        match found {
            Err(error) if !matches!(error, Error::Interrupted) && starts_at(full.unknowns, x) => {
                let search = full.search();
                let found = search.residuals(first).and_then(|residuals| misfit(&residuals, x));
                Look { found, work: work + search.work.take(), in_full: true }
            }
            found => Look { found, work, in_full: false },
        }
    };
    Ok(points.iter().map(look).collect())
}

/// The misfit and the residuals behind it.
fn misfit(residuals: &Residuals, x: &[f64]) -> Result<(f64, Vec<f64>), Error> {
    Ok((half_sum_of_squares(&residuals.residuals(x)?), residuals.plain(x)?))
}

/// Whether a point is at the starts that were given, if any were.
fn starts_at(unknowns: &[Unknown], x: &[f64]) -> bool {
    let starts = || unknowns.iter().zip(x).filter_map(|(u, x)| Some((u.to_scale(u.start?), x)));
    starts().next().is_some() && starts().all(|(start, x)| (start - x).abs() < 1e-9)
}

impl Search<'_> {
    /// Misfit of every combination of candidate values over the first period.
    pub fn scan(
        &self,
        coarse: &Coarse,
        first: &[f64],
        refinement: usize,
    ) -> Result<Vec<Candidate>, Error> {
        let (axes, points) = self.grid(first, refinement);
        let tasks = [coarse.task(self), self.task()];
        let counts = tasks[0].search().residuals(first)?.counts();
        let mut in_full = Vec::new();
        let mut grid = Grid { axes, points: Vec::with_capacity(points.len()) };
        let mut least = f64::INFINITY;
        let mut failure = None;
        for batch in points.chunks(BATCH) {
            let looks: Vec<_> =
                batch.par_chunks(SHARE).map(|share| look(tasks, first, share)).collect();
            let looks = looks.into_iter().collect::<Result<Vec<_>, Error>>()?;
            let mut stopped = false;
            for (x, look) in batch.iter().zip(looks.into_iter().flatten()) {
                self.work.add(look.work);
                in_full.push(look.in_full);
                let mut misfit = f64::INFINITY;
                match look.found {
                    Ok((cost, residuals)) => {
                        misfit = cost;
                        if cost < least {
                            least = cost;
                            let right = |x| if look.in_full { x } else { coarse.correct(self, x) };
                            let x = right(x.clone());
                            let (stage, counts) = (Stage::Scan, counts.clone());
                            self.note(Visit { stage, x, cost, residuals, counts });
                        }
                    }
                    Err(Error::Interrupted) => stopped = true,
                    Err(error) => failure = Some(error),
                }
                grid.points.push((x.clone(), misfit));
            }
            if stopped {
                return Err(Error::Interrupted);
            }
            self.report("scan");
        }
        let points = grid.points.iter().enumerate();
        let scanned: Vec<Candidate> = points
            .filter(|(_, (_, cost))| *cost < f64::INFINITY)
            .map(|(i, (x, cost))| {
                let as_coarse = |x| if in_full[i] { coarse.wrong(self, x) } else { x };
                Candidate { x: as_coarse(x.clone()), cost: *cost, floor: grid.floor(i) }
            })
            .collect();
        self.journal.scan(grid);
        match failure {
            _ if !scanned.is_empty() => Ok(scanned),
            Some(error) => Err(Error::Fit(format!(
                "no start value found: all trial simulations failed, the last one with: {error}. Check the scene, \
                 or give a start"
            ))),
            None => Err(Error::Fit(
                "no start value found: no trial simulation has a finite misfit. A sigma may be far too small. \
                 Check it, or give a start"
                    .into(),
            )),
        }
    }

    /// Candidate values of each unknown on its scale, and all their combinations, the last
    /// unknown's values varying fastest.
    fn grid(&self, first: &[f64], refinement: usize) -> (Vec<Vec<f64>>, Vec<Vec<f64>>) {
        let candidates = |unknown: &Unknown| {
            let mut values = self.candidates(unknown, first);
            if refinement > 1 {
                let middle = |v: &[f64]| {
                    unknown.from_scale(0.5 * (unknown.to_scale(v[0]) + unknown.to_scale(v[1])))
                };
                let middles: Vec<f64> = values.windows(2).map(middle).collect();
                values.extend(middles);
                values.sort_by(f64::total_cmp);
            }
            values
        };
        let mut lists: Vec<Vec<f64>> = self.unknowns.iter().map(candidates).collect();
        thin(&mut lists, self.unknowns);
        let scaled = |(unknown, values): (&Unknown, &Vec<f64>)| {
            values.iter().map(|v| unknown.to_scale(*v)).collect()
        };
        let axes: Vec<Vec<f64>> = self.unknowns.iter().zip(&lists).map(scaled).collect();
        let mut points = vec![Vec::new()];
        for axis in &axes {
            let longer = |point: &Vec<f64>| {
                let point = point.clone();
                axis.iter().map(move |x| [&point[..], &[*x]].concat())
            };
            points = points.iter().flat_map(longer).collect();
        }
        for (g, e) in self.tied_shear_moduli() {
            let [low, high] = self.unknowns[g].scaled_bounds();
            for point in &mut points {
                point[g] = (point[e] + SHEAR_OF_YOUNGS.ln()).clamp(low, high);
            }
        }
        (axes, points)
    }

    /// Values of an unknown worth trying, as the first experiment that has it suggests.
    fn candidates(&self, unknown: &Unknown, first: &[f64]) -> Vec<f64> {
        if self.is_displacement_driven() && !unknown.is_stiffness() {
            return self
                .led_start(unknown)
                .map_or_else(|| self.middle(unknown, first), |start| vec![start]);
        }
        self.worth_trying(unknown, first)
    }

    /// The middle one of the values worth trying.
    fn middle(&self, unknown: &Unknown, first: &[f64]) -> Vec<f64> {
        let values = self.worth_trying(unknown, first);
        values.get(values.len() / 2).copied().into_iter().collect()
    }

    fn worth_trying(&self, unknown: &Unknown, first: &[f64]) -> Vec<f64> {
        let of = |held: bool| {
            let own = move |(e, _): &(&Experiment, &f64)| {
                unknown.is_of(e) && (held || !e.measurements.is_empty())
            };
            self.experiments.iter().zip(first).find(own)
        };
        // What is held out shows nothing.
        let own = of(false).or_else(|| of(true));
        let Some((experiment, first)) = own else { return Vec::new() };
        let with_modulus = self.youngs_modulus_beside(unknown).is_some();
        let (duration, rise) = (experiment.duration(), 0.5 * first);
        unknown.candidates(&experiment.problem, duration, rise, with_modulus)
    }

    /// The unknown Young's modulus of the same rod as another unknown.
    fn youngs_modulus_beside(&self, unknown: &Unknown) -> Option<usize> {
        self.unknowns.iter().position(|u| {
            u.parameter == Parameter::YoungsModulus
                && self.experiments.iter().any(|e| u.is_of(e) && unknown.is_of(e))
        })
    }

    /// Unknown shear moduli of which nothing is known, with the Young's modulus beside each.
    fn tied_shear_moduli(&self) -> Vec<(usize, usize)> {
        let free = |u: &Unknown| {
            u.parameter == Parameter::ShearModulus && u.start.is_none() && u.prior.is_none()
        };
        let shear = self.unknowns.iter().enumerate().filter(|(_, u)| free(u));
        shear.filter_map(|(g, u)| Some((g, self.youngs_modulus_beside(u)?))).collect()
    }
}

impl Unknown {
    /// Whether it is what a rod's motion tells first, and a search looks for over decades.
    pub(super) fn is_stiffness(&self) -> bool {
        self.parameter == Parameter::YoungsModulus
    }

    /// Values worth trying before anything is known. A start is a hint: it may be far off.
    /// `duration` and `rise` are the record's length and the time of its first swing, s.
    fn candidates(
        &self,
        problem: &Problem,
        duration: f64,
        rise: f64,
        beside_youngs_modulus: bool,
    ) -> Vec<f64> {
        let log_range = |low: f64, high: f64, per_decade: f64| -> Vec<f64> {
            let n = ((high / low).log10() * per_decade).round().max(0.0) as i32;
            (0..=n).map(|i| low * (high / low).powf(f64::from(i) / f64::from(n.max(1)))).collect()
        };
        let length = problem.length();
        let here = self.start.or(self.parameter.of(problem.scene()));
        let hint = self.start.or(self.prior.map(|prior| prior.mean));
        let values = match (self.parameter.quantity().candidates, hint) {
            (Candidates::Here, _) => here.into_iter().collect(),
            (_, Some(value)) if self.parameter == Parameter::YoungsModulus => {
                log_range(value * 1e-3, value * 1e3, 3.0)
            }
            (_, Some(value)) if self.parameter.is_positive() => {
                log_range(value / 30.0, value * 30.0, 1.4)
            }
            (_, Some(value)) => vec![value],
            (Candidates::Decades(low, high, per_decade), None) => log_range(low, high, per_decade),
            (Candidates::Values(values), None) => values.to_vec(),
            (Candidates::PerLength(values), None) => values.iter().map(|v| v / length).collect(),
            (Candidates::OfLength(low, high, per_decade), None) => {
                log_range(low * length, high * length, per_decade)
            }
            (Candidates::OfYoungsModulus(low, per_decade), None) => {
                let e = problem.scene().material.youngs_modulus;
                // Beside an unknown Young's modulus the scan ties it to that; one value will do.
                if beside_youngs_modulus { vec![e] } else { log_range(low * e, e, per_decade) }
            }
            (Candidates::Rate(low, high, per_decade), None) => {
                log_range(low / duration, high / rise, per_decade)
            }
            (Candidates::Time(low, high, per_decade), None) => {
                log_range(low * rise, high * rise, per_decade)
            }
        };
        let [low, high] = self.scaled_bounds().map(|x| self.from_scale(x));
        let mut inside: Vec<f64> =
            values.iter().copied().filter(|v| *v > low && *v < high).collect();
        if inside.is_empty() {
            inside = values.iter().map(|v| v.clamp(low, high)).collect();
            inside.dedup();
        }
        inside
    }
}

/// Halves the longest lists of values until their combinations are few enough; Young's modulus, over
/// which the misfit has most minima, keeps its values longest.
fn thin(lists: &mut [Vec<f64>], unknowns: &[Unknown]) {
    let points = |lists: &[Vec<f64>]| lists.iter().map(|l| l.len() as f64).product::<f64>();
    while points(lists) > MOST_POINTS as f64 {
        let weight = |i: usize| match unknowns[i].parameter == Parameter::YoungsModulus {
            true => lists[i].len() / 8,
            false => lists[i].len(),
        };
        let Some(longest) = (0..lists.len()).max_by_key(|i| weight(*i)) else { return };
        let kept = lists[longest].iter().skip(lists[longest].len() / 2 % 2).step_by(2).copied();
        lists[longest] = kept.collect();
    }
}
