//! The scan: the misfit of the coarse model over the first period at every point of a grid of values of the unknowns.
//! Over the first period the misfit has few minima, with wide basins, and the grid is fine enough for all of them.
//!
//! Input: a search, its coarse model and the first period of each experiment, s. The values of an unknown are a range
//! about its start or prior ([`MODULUS_RANGE`], [`HINT_RANGE`]), or else the range of its kind of parameter, within the
//! bounds. With a start or prior, a parameter that may be negative has only that value. Some kinds have only their
//! start or the scene's value, and so have numbers of a structure other than moduli without a start or prior. With
//! driven ends all but Young's modulus have one value. A refined scan adds values half-way. The grid has at most
//! [`MOST_POINTS`] points: the longest lists of values are halved until it has. A shear modulus beside an unknown
//! Young's modulus, without start and prior, is [`SHEAR_OF_YOUNGS`] times that. Where the coarse model fails at a given
//! start, the full model is evaluated.
//!
//! Output: [`Candidate`]s, all points with a finite misfit, with it and a lower bound for a descent from them, on the
//! unknowns' scales and in coordinates of the coarse model. The grid is stored in the journal. No point that can be
//! simulated is an error. Threads share the points. The results are processed in the order of the grid, so that neither
//! the results nor the history depend on the number of threads.

use crate::error::Error;
use crate::fit::misfit::residuals::Residuals;
use crate::fit::search::Search;
use crate::fit::search::coarse::ScanModel;
use crate::fit::search::grid::{GridPoint, ScanGrid};
use crate::fit::search::journal::{SearchStage, Visit};
use crate::fit::unknown::Unknown;
use crate::numerics::half_sum_of_squares;
use crate::problem::Problem;
use crate::scene::Parameter;
use crate::scene::number::Candidates;
use rayon::prelude::*;

/// Shear modulus over Young's modulus in the scan where both are unknown: Poisson's ratio 0.3.
const SHEAR_OF_YOUNGS: f64 = 1.0 / 2.6;
/// Largest number of points of the scan, each of which costs a simulation of the coarse model. With more unknowns each
/// has fewer values.
const MOST_POINTS: usize = 6000;
/// Number of points between two reports of progress and checks for an interruption. A smaller number reports more
/// often, but leaves threads idle at the end of each batch.
const BATCH: usize = 16;
/// Number of points that a thread evaluates at a time. They have one set of residuals in common, which takes time to
/// prepare.
const SHARE: usize = 2;
/// Range of the scanned values of Young's modulus about its start or prior mean, as factors to both sides. A wider
/// range finds the minimum from a worse start, at the cost of more points.
const MODULUS_RANGE: [f64; 2] = [1e-3, 1e3];
/// Number of scanned values per decade of Young's modulus in that range. More values cost more simulations; fewer may
/// miss the basin of the minimum.
const MODULUS_PER_DECADE: f64 = 3.0;
/// Range of the scanned values of any other positive parameter about its start or prior mean: the factor to both sides.
const HINT_RANGE: f64 = 30.0;
/// Number of scanned values per decade in that range. More values cost more simulations; fewer may miss the basin of
/// the minimum.
const HINT_PER_DECADE: f64 = 1.4;
/// Factor by which the list of Young's modulus may be longer than others before it is halved: the misfit has most
/// minima over Young's modulus.
const MODULUS_SHARE: usize = 8;

/// A point on the unknowns' scales from which the coarse model may descend.
#[derive(Clone, Debug)]
pub(crate) struct Candidate {
    pub x: Vec<f64>,
    /// The misfit at this point.
    pub cost: f64,
    /// A lower bound of the misfit at which a descent from this point may end.
    pub bound: f64,
}

/// Result of the evaluation of one point of the scan by a thread.
struct ScannedPoint {
    /// Misfit and plain residuals.
    found: Result<(f64, Vec<f64>), Error>,
    /// Steps times segments.
    work: f64,
    /// Whether the full model was evaluated instead of the coarse one.
    is_full: bool,
}

/// Evaluates the model of the `coarse` search at `points` up to the horizons `first`, s, one per experiment. Where this
/// fails at the given start, the `full` model is evaluated instead. Returns for each point the misfit with the
/// residuals without robust loss (or the error), the work, and which model was evaluated. An error if a measured point
/// is not on the rod.
fn evaluate_points(
    coarse: &Search,
    full: &Search,
    first: &[f64],
    points: &[Vec<f64>],
) -> Result<Vec<ScannedPoint>, Error> {
    let coarse = coarse.detached();
    let residuals = coarse.residuals(first)?;
    let evaluate = |x: &Vec<f64>| {
        let found = misfit(&residuals, x);
        let work = coarse.work.take();
        match found {
            // A given start must not be lost because the coarse model fails there.
            Err(error) if !matches!(error, Error::Interrupted) && is_start(full.unknowns, x) => {
                let search = full.detached();
                let found = search.residuals(first).and_then(|residuals| misfit(&residuals, x));
                ScannedPoint { found, work: work + search.work.take(), is_full: true }
            }
            found => ScannedPoint { found, work, is_full: false },
        }
    };
    Ok(points.iter().map(evaluate).collect())
}

/// Half the sum of squares of the residuals at `x`, with robust losses, and the residuals without robust loss. An error
/// if the simulation fails.
fn misfit(residuals: &Residuals, x: &[f64]) -> Result<(f64, Vec<f64>), Error> {
    Ok((half_sum_of_squares(&residuals.residuals(x)?), residuals.plain_residuals(x)?))
}

/// Whether at least one unknown has a given start, and the point `x`, on the unknowns' scales, is within 1e-9 of all
/// given ones.
fn is_start(unknowns: &[Unknown], x: &[f64]) -> bool {
    let starts = || unknowns.iter().zip(x).filter_map(|(u, x)| Some((u.to_scale(u.start?), x)));
    starts().next().is_some() && starts().all(|(start, x)| (start - x).abs() < 1e-9)
}

impl Search<'_> {
    /// Evaluates the coarse model over the first periods `first`, s, at every combination of scanned values;
    /// `refinement` above 1 adds values half-way. Returns all points with a finite misfit, in the order of the grid and
    /// in coordinates of the coarse model; an error if there is none, or if the user stops. Where the coarse model
    /// fails at the given start, the full model is evaluated. The grid replaces that of the journal, and new lowest
    /// points enter its history. Reports progress.
    pub fn scan(
        &self,
        coarse: &ScanModel,
        first: &[f64],
        refinement: usize,
    ) -> Result<Vec<Candidate>, Error> {
        // Grid of candidate values, in the order that makes results independent of the number of
        // threads.
        let (axes, points) = self.grid(first, refinement);
        let model = coarse.search(self);
        let counts = model.residuals(first)?.counts();
        let mut is_full = Vec::new();
        let mut grid = ScanGrid { axes, points: Vec::with_capacity(points.len()) };
        let mut least = f64::INFINITY;
        let mut failure = None;
        // Batches, so that progress is reported and an interruption is noticed.
        for batch in points.chunks(BATCH) {
            let shares = batch.par_chunks(SHARE);
            let scanned: Vec<_> =
                shares.map(|share| evaluate_points(&model, self, first, share)).collect();
            let scanned = scanned.into_iter().collect::<Result<Vec<_>, Error>>()?;
            let mut stopped = false;
            for (x, point) in batch.iter().zip(scanned.into_iter().flatten()) {
                self.work.add(point.work);
                is_full.push(point.is_full);
                let mut misfit = f64::INFINITY;
                match point.found {
                    Ok((cost, residuals)) => {
                        misfit = cost;
                        // Only new lowest points enter the history.
                        if cost < least {
                            least = cost;
                            let x = match point.is_full {
                                true => x.clone(),
                                false => coarse.to_full_model(self, x.clone()),
                            };
                            let (stage, counts) = (SearchStage::Scan, counts.clone());
                            self.record_visit(Visit { stage, x, cost, residuals, counts });
                        }
                    }
                    Err(Error::Interrupted) => stopped = true,
                    Err(error) => failure = Some(error),
                }
                grid.points.push(GridPoint { x: x.clone(), misfit });
            }
            // The work of an interrupted batch counts; its points do not.
            if stopped {
                return Err(Error::Interrupted);
            }
            self.report("scan");
        }
        let points = grid.points.iter().enumerate();
        let simulated = points.filter(|(_, point)| point.misfit < f64::INFINITY);
        // Candidates: all simulated points, with the lower bound of the misfit for a descent from them.
        let candidate = |(i, point): (usize, &GridPoint)| Candidate {
            // Descents begin with the coarse model.
            x: match is_full[i] {
                true => coarse.reduced_point(self, point.x.clone()),
                false => point.x.clone(),
            },
            cost: point.misfit,
            bound: grid.descent_bound(i),
        };
        let candidates: Vec<Candidate> = simulated.map(candidate).collect();
        self.journal.set_scan(grid);
        // No candidate at all: the last error is the most informative.
        match failure {
            _ if !candidates.is_empty() => Ok(candidates),
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

    /// Scanned values of each unknown on its scale, and all their combinations, of which the values of the last unknown
    /// vary fastest. `first` are the first periods, s; a `refinement` above 1 adds values half-way on the scale. At
    /// most [`MOST_POINTS`] combinations. In these a shear modulus without start and prior is replaced by
    /// [`SHEAR_OF_YOUNGS`] times the unknown Young's modulus of the same rod, within its bounds. Returns the lists, one
    /// per unknown, and the combinations.
    fn grid(&self, first: &[f64], refinement: usize) -> (Vec<Vec<f64>>, Vec<Vec<f64>>) {
        let candidates = |unknown: &Unknown| {
            let mut values = self.candidates(unknown, first);
            if refinement > 1 {
                let middle = |v: &[f64]| {
                    unknown.from_scale(0.5 * (unknown.to_scale(v[0]) + unknown.to_scale(v[1])))
                };
                let middles: Vec<f64> = values.windows(2).map(middle).collect();
                // Half-way on the scale of the unknown: the middle of a logarithm is the
                // geometric mean.
                values.extend(middles);
                values.sort_by(f64::total_cmp);
            }
            values
        };
        let mut lists: Vec<Vec<f64>> = self.unknowns.iter().map(candidates).collect();
        // The number of combinations is limited, because each costs a simulation.
        thin(&mut lists, self.unknowns);
        let scaled = |(unknown, values): (&Unknown, &Vec<f64>)| {
            values.iter().map(|v| unknown.to_scale(*v)).collect()
        };
        let axes: Vec<Vec<f64>> = self.unknowns.iter().zip(&lists).map(scaled).collect();
        // Cartesian product of the axes.
        let mut points = vec![Vec::new()];
        for axis in &axes {
            let longer = |point: &Vec<f64>| {
                let point = point.clone();
                axis.iter().map(move |x| [&point[..], &[*x]].concat())
            };
            points = points.iter().flat_map(longer).collect();
        }
        // A shear modulus of which nothing is known follows Young's modulus of the same rod.
        let is_free = |u: &Unknown| {
            u.parameter == Parameter::ShearModulus && u.start.is_none() && u.prior.is_none()
        };
        for (g, unknown) in self.unknowns.iter().enumerate().filter(|(_, u)| is_free(u)) {
            let Some(e) = self.youngs_modulus_of_rod(unknown) else { continue };
            let [low, high] = unknown.scaled_bounds();
            for point in &mut points {
                point[g] = (point[e] + SHEAR_OF_YOUNGS.ln()).clamp(low, high);
            }
        }
        (axes, points)
    }

    /// Values of an unknown in the scan, in its unit: those of [`Unknown::candidates`] for the first experiment with
    /// measurements that has it, or else the first one that has it. `first` are the first periods, s. For rods with
    /// recorded ends an unknown other than Young's modulus has one value: its start, prior mean or scene value, or else
    /// the middle of the range. Empty for an unknown of no experiment.
    fn candidates(&self, unknown: &Unknown, first: &[f64]) -> Vec<f64> {
        let is_single = self.is_displacement_driven() && !unknown.is_stiffness();
        if let Some(start) = self.driven_start(unknown).filter(|_| is_single) {
            return vec![start];
        }
        let own = || self.experiments.iter().zip(first).filter(|(e, _)| unknown.is_of(e));
        // Experiments of validation data have no records to derive a range from.
        let measured = own().find(|(e, _)| !e.measurements.is_empty());
        let Some((experiment, first)) = measured.or_else(|| own().next()) else {
            return Vec::new();
        };
        let with_modulus = self.youngs_modulus_of_rod(unknown).is_some();
        let (duration, rise) = (experiment.duration(), 0.5 * first);
        let values = unknown.candidates(&experiment.problem, duration, rise, with_modulus);
        match is_single {
            true => values.get(values.len() / 2).copied().into_iter().collect(),
            false => values,
        }
    }

    /// The index of the unknown Young's modulus that shares an experiment with the given unknown; `None` if there is
    /// none.
    fn youngs_modulus_of_rod(&self, unknown: &Unknown) -> Option<usize> {
        self.unknowns.iter().position(|u| {
            u.parameter == Parameter::YoungsModulus
                && self.experiments.iter().any(|e| u.is_of(e) && unknown.is_of(e))
        })
    }
}

/// Whether the scene is a structure with a recording.
fn follows_recording(problem: &Problem) -> bool {
    problem.scene().structure.as_ref().is_some_and(|structure| structure.recording.is_some())
}

impl Unknown {
    /// Whether the unknown's parameter is Young's modulus, which determines the period of the motion and is scanned
    /// over decades.
    pub(super) fn is_stiffness(&self) -> bool {
        self.parameter == Parameter::YoungsModulus
            || self.parameter.is_of_structure() && self.parameter.path().ends_with("youngs_modulus")
    }

    /// Values in the scan, in the unit of the parameter, strictly within the bounds; if none is, the values moved to
    /// the nearest bounds. Parameters of kind [`Candidates::Here`] have their start or the scene's value only. Others
    /// have, about the start or the prior mean: factors [`MODULUS_RANGE`] for Young's modulus, [`HINT_RANGE`] for
    /// positive parameters, the value itself for the rest. Without start and prior it is the range of the parameter's
    /// kind, or the scene's value for numbers of a structure other than moduli. In a structure with a recording a start
    /// or prior mean is the only value. The range is absolute, or relative to the rod's length, the scene's Young's
    /// modulus, `duration` or `rise`: the length of the record and the time of its first swing, s. With an unknown
    /// Young's modulus of the same rod (`beside_youngs_modulus`), a shear modulus has the scene's Young's modulus as a
    /// placeholder, which [`Search::grid`] replaces.
    fn candidates(
        &self,
        problem: &Problem,
        duration: f64,
        rise: f64,
        beside_youngs_modulus: bool,
    ) -> Vec<f64> {
        let log_range = |low: f64, high: f64, per_decade: f64| -> Vec<f64> {
            // Equal ratios between both ends, at least one value.
            let n = ((high / low).log10() * per_decade).round().max(0.0) as i32;
            (0..=n).map(|i| low * (high / low).powf(f64::from(i) / f64::from(n.max(1)))).collect()
        };
        let length = problem.length();
        let hint = self.start.or(self.prior.map(|prior| prior.mean));
        let values = match (self.parameter.quantity().candidates, hint) {
            // Of a structure only moduli are searched over decades: the scene has the approximate values of others.
            (_, None) if self.parameter.is_of_structure() && !self.is_stiffness() => {
                self.parameter.of(problem.scene()).into_iter().collect()
            }
            // A start for a structure that follows a recording is not scanned: its motion depends little on the period,
            // and it may have several moduli.
            (_, Some(value)) if follows_recording(problem) => vec![value],
            (Candidates::Here, _) => {
                self.start.or(self.parameter.of(problem.scene())).into_iter().collect()
            }
            (_, Some(value)) if self.is_stiffness() => {
                log_range(value * MODULUS_RANGE[0], value * MODULUS_RANGE[1], MODULUS_PER_DECADE)
            }
            (_, Some(value)) if self.parameter.is_positive() => {
                log_range(value / HINT_RANGE, value * HINT_RANGE, HINT_PER_DECADE)
            }
            (_, Some(value)) => vec![value],
            // Ranges of the kind of parameter: absolute, per length, of the modulus, of the times
            // of the motion.
            (Candidates::Decades(low, high, per_decade), None) => log_range(low, high, per_decade),
            (Candidates::Values(values), None) => values.to_vec(),
            (Candidates::PerLength(values), None) => values.iter().map(|v| v / length).collect(),
            (Candidates::OfLength(low, high, per_decade), None) => {
                log_range(low * length, high * length, per_decade)
            }
            (Candidates::OfYoungsModulus(low, per_decade), None) => {
                let e = problem.scene().material.youngs_modulus;
                if beside_youngs_modulus { vec![e] } else { log_range(low * e, e, per_decade) }
            }
            (Candidates::Rate(low, high, per_decade), None) => {
                log_range(low / duration, high / rise, per_decade)
            }
            (Candidates::Time(low, high, per_decade), None) => {
                log_range(low * rise, high * rise, per_decade)
            }
        };
        // Values outside of the bounds are left out; if none remains, the nearest bound is the only value.
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

/// Keeps every second value of the longest list, its middle one included, in place, until the lists have at most
/// [`MOST_POINTS`] combinations. The list of Young's modulus counts as [`MODULUS_SHARE`] times shorter.
fn thin(lists: &mut [Vec<f64>], unknowns: &[Unknown]) {
    let points = |lists: &[Vec<f64>]| lists.iter().map(|l| l.len() as f64).product::<f64>();
    while points(lists) > MOST_POINTS as f64 {
        let weight = |i: usize| match unknowns[i].is_stiffness() {
            true => lists[i].len() / MODULUS_SHARE,
            false => lists[i].len(),
        };
        let Some(longest) = (0..lists.len()).max_by_key(|i| weight(*i)) else { return };
        let kept = lists[longest].iter().skip(lists[longest].len() / 2 % 2).step_by(2).copied();
        lists[longest] = kept.collect();
    }
}
