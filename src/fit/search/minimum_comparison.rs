//! Comparison of the chosen minimum with other recorded minima, which may be lower on the final mesh.
//!
//! A search begins on a coarse mesh and with preliminary weights. The order of two minima may change with the mesh and
//! the weights. Input: the chosen optimum, the variance of the noise, and the minima in the journal. Recorded minima
//! compete if their objective is below that of the chosen one (on other meshes: below [`NEAR_OBJECTIVE`] times it), and
//! if they are more than [`SAME`] away from it. At most [`MOST_FOLLOWED`], the lowest first, are fitted again, on the
//! final mesh and with the final weights. Their records are replaced by the ends of these fits; fits that fail are
//! skipped. Output of `compare_minima`: [`MinimumComparison`] with the lowest end if it is lower than the chosen one,
//! and converged if that has. If the chosen one has converged, a clearly lower end without convergence is returned for
//! a warning ([`unreached_minimum_warning`]). It is clearly lower if twice the difference of the objectives exceeds
//! [`EXPLAINED_BY_NOISE`] noise variances. An interruption is an error. `follow` records the end of a fit on a new mesh
//! in the journal: in place of the former minimum, or as another one.
//!
//! At rest, without a measured motion, minima of other branches of equilibria may explain the data as well.
//! `is_preferred` chooses between two optima, and `equal_minimum` returns another minimum for a warning
//! ([`equal_minimum_warning`]).

use crate::error::{Error, none_on_failure};
use crate::fit::measurement::experiment::Experiment;
use crate::fit::search::Search;
use crate::fit::search::local_minima::{SAME, distance};
use crate::fit::search::minimum::{Minimum, Squares};
use crate::fit::search::optimum::Optimum;
use crate::fit::unknown::{ParameterPoint, Unknown};
use crate::numerics::total_order;

/// Largest recorded objective of a competing minimum of another mesh, over that of the chosen minimum. Another mesh
/// changes an objective by some tens of per cent.
const NEAR_OBJECTIVE: f64 = 1.5;
/// Largest number of minima that are fitted again, the lowest first. Each costs a complete fit on the final mesh.
const MOST_FOLLOWED: usize = 3;
/// Twice the difference of two objectives, in units of the variance of the noise, that the noise explains: the
/// threshold of a likelihood ratio at two standard deviations.
const EXPLAINED_BY_NOISE: f64 = 4.0;

/// Smallest distance of two minima of equilibria in different branches, on the unknowns' scales: a factor of 1.6 of a
/// positive parameter.
const OTHER_BRANCH: f64 = 0.5;
/// The same in standard deviations of the estimate; within it the data do not separate the two, which is no branch.
const OTHER_BRANCH_DEVIATIONS: f64 = 8.0;

/// Result of the comparison of the chosen minimum with others.
pub(crate) struct MinimumComparison<'a> {
    /// The search, with an optimizer that ends where the objective hardly changes.
    pub search: Search<'a>,
    /// The lowest minimum, if it is lower than the chosen one.
    pub lower: Option<Optimum>,
    /// A point with a clearly lower objective at which the optimizer did not converge.
    pub unreached: Option<Vec<f64>>,
}

impl<'a> Search<'a> {
    /// Whether a motion was measured in any experiment.
    pub fn moves(&self) -> bool {
        self.experiments.iter().any(Experiment::moves)
    }

    /// Whether the optimum `new` is preferred to the optimum `best`: the one with the lower objective. Without a
    /// measured motion two objectives may be equal to the noise in different branches of equilibria, such as a bent rod
    /// and a soft one that hangs down; then it is the one nearer to the values of the scene.
    pub fn is_preferred(&self, new: &Optimum, best: &Optimum) -> bool {
        let lower = new.cost < best.cost;
        if self.moves() || 2.0 * (new.cost - best.cost).abs() > EXPLAINED_BY_NOISE {
            return lower;
        }
        match (self.distance_from_scene(&new.x), self.distance_from_scene(&best.x)) {
            (Some(new), Some(best)) => new < best,
            _ => lower,
        }
    }

    /// Largest distance of a point from the values of the scene in any unknown, on the unknowns' scales; `None` if the
    /// scene lacks one of them.
    fn distance_from_scene(&self, x: &[f64]) -> Option<f64> {
        let scaled = |unknown: &Unknown| Some(unknown.to_scale(self.scene_value(unknown)?));
        let scene: Vec<f64> = self.unknowns.iter().map(scaled).collect::<Option<_>>()?;
        Some(distance(x, &scene))
    }

    /// Another recorded minimum on this mesh that explains the data as well as the `optimum` does: the lowest whose
    /// doubled objective is higher by at most [`EXPLAINED_BY_NOISE`] times the `variance` of the noise. It is more than
    /// [`OTHER_BRANCH`] and, in some unknown, [`OTHER_BRANCH_DEVIATIONS`] of the standard `deviations` away. `None` if
    /// an unknown has no deviation, so that minima are points of one valley. `None` also with a measured motion, whose
    /// search compares minima as it proceeds.
    pub fn equal_minimum(
        &self,
        optimum: &Optimum,
        variance: f64,
        deviations: &[Option<f64>],
    ) -> Option<Minimum> {
        let deviations: Vec<f64> = deviations.iter().copied().collect::<Option<_>>()?;
        let is_apart = |x: &[f64]| {
            let mut pairs = x.iter().zip(&optimum.x).zip(&deviations);
            pairs.any(|((x, own), deviation)| (x - own).abs() > OTHER_BRANCH_DEVIATIONS * deviation)
        };
        let misfit = |minimum: &Minimum| minimum.squares.misfit(&self.sigmas);
        let is_equal = |minimum: &Minimum| {
            minimum.converged
                && minimum.numerics == self.numerics
                && distance(&minimum.x, &optimum.x) > OTHER_BRANCH
                && is_apart(&minimum.x)
                && 2.0 * (misfit(minimum) - optimum.cost) <= EXPLAINED_BY_NOISE * variance
        };
        let mut minima = self.journal.minima();
        minima.retain(|minimum| !self.moves() && is_equal(minimum));
        minima.into_iter().min_by(|a, b| misfit(a).total_cmp(&misfit(b)))
    }

    /// Records an optimum, the end of a fit of the full model to the whole records, as a minimum in the journal.
    pub fn add_minimum(&self, optimum: &Optimum) {
        self.journal.add_minimum(self.minimum(optimum));
    }

    /// The record of an optimum for the journal: point, sums of squares by measurement, convergence, and number of mesh
    /// and steps.
    pub fn minimum(&self, optimum: &Optimum) -> Minimum {
        let Optimum { x, cost, residuals, counts, converged, .. } = optimum;
        let squares = Squares::new(residuals, counts, &self.sigmas, *cost);
        Minimum { x: x.clone(), squares, converged: *converged, numerics: self.numerics }
    }

    /// Fits at most [`MOST_FOLLOWED`] recorded minima again that may be lower than `optimum`, and replaces their
    /// records. `variance` is that of the noise of the residuals, in units of the sigmas squared. `search` in the
    /// result is a copy whose optimizer ends where the objective hardly changes. `lower` is the lowest of the ends of
    /// these fits, if lower than `optimum` and more than [`SAME`] away; it must have converged if `optimum` has. If
    /// `optimum` has converged, `unreached` is the last end without convergence whose doubled objective is below that
    /// of the lowest so far by more than [`EXPLAINED_BY_NOISE`] variances. Failed fits are skipped; an interruption is
    /// an error.
    pub fn compare_minima(
        &self,
        optimum: &Optimum,
        variance: f64,
    ) -> Result<MinimumComparison<'a>, Error> {
        // A descent that hardly lowers the objective does not change the order of the minima, and may end.
        let search = Self { ends_without_progress: true, ..self.clone() };
        let mut comparison =
            MinimumComparison { lower: None, unreached: None, search: search.clone() };
        // Minima that lead to an end already reached are skipped.
        let mut ends = vec![optimum.x.clone()];
        for other in self.competing_minima(optimum) {
            if ends.iter().any(|end| distance(end, &other.x) <= SAME) {
                continue;
            }
            let found = search.polish(&other.x).and_then(|end| search.with_raised_damping(end));
            // A minimum that cannot be simulated on this mesh does not compete.
            let Some(found) = none_on_failure(found)? else { continue };
            self.journal.move_minimum(&other.x, self.minimum(&found));
            ends.push(found.x.clone());
            // A lower converged minimum replaces the chosen one; a clearly lower point without convergence is a
            // warning.
            let least = comparison.lower.as_ref().unwrap_or(optimum).cost;
            let clearly = 2.0 * (least - found.cost) > EXPLAINED_BY_NOISE * variance;
            let is_other = distance(&found.x, &optimum.x) > SAME;
            match found.converged || !optimum.converged {
                // At rest a minimum of another branch replaces the chosen one only if it is clearly lower.
                true if found.cost < least && is_other && (clearly || self.moves()) => {
                    comparison.lower = Some(found);
                }
                false if clearly => comparison.unreached = Some(found.x),
                _ => {}
            }
        }
        Ok(comparison)
    }

    /// Records the optimum `found` by a fit that began from the minimum at `before`; on the mesh of this search that is
    /// expected at `expected`. Within half of the expected shift (at least [`SAME`]) of `expected` it replaces the
    /// minimum at `before`; elsewhere it is added as another one. All points are on the unknowns' scales.
    pub fn follow(&self, before: &[f64], expected: &[f64], found: &Optimum) {
        // A basin moves with the mesh by about the expected shift. An end farther away is in another basin.
        let moved = SAME.max(0.5 * distance(before, expected));
        match distance(&found.x, expected) <= moved {
            true => self.journal.move_minimum(before, self.minimum(found)),
            false => self.add_minimum(found),
        }
    }

    /// The recorded minima more than [`SAME`] away from `optimum` whose objective, with the present sigmas, is below
    /// its own; on other meshes below [`NEAR_OBJECTIVE`] times it. Of several within [`SAME`] of each other the lowest
    /// stays. The lowest come first, at most [`MOST_FOLLOWED`].
    fn competing_minima(&self, optimum: &Optimum) -> Vec<Minimum> {
        let misfit = |minimum: &Minimum| minimum.squares.misfit(&self.sigmas);
        let mut minima = self.journal.minima();
        minima.retain(|minimum| {
            let factor = if minimum.numerics == self.numerics { 1.0 } else { NEAR_OBJECTIVE };
            distance(&minimum.x, &optimum.x) > SAME && misfit(minimum) < factor * optimum.cost
        });
        minima.sort_by_cached_key(|x| total_order(misfit(x)));
        // Several fits may have ended in one minimum, of which the lowest record is kept.
        let mut apart: Vec<Minimum> = Vec::new();
        for minimum in minima {
            if apart.iter().all(|other| distance(&other.x, &minimum.x) > SAME) {
                apart.push(minimum);
            }
        }
        apart.truncate(MOST_FOLLOWED);
        apart
    }
}

/// The warning text that the misfit is lower at the point `x`, on the unknowns' scales, where the optimizer did not
/// converge. It has the values in their units, and recommends a start, bounds or a shorter record.
pub(crate) fn unreached_minimum_warning(unknowns: &[Unknown], x: &[f64]) -> String {
    format!(
        "{} has a lower misfit, but the search did not converge there. The estimates are not the optimum. Give a \
         start or bounds near it, or shorten the record",
        values_at(unknowns, x)
    )
}

/// The warning text that other values, at the point `x` on the unknowns' scales, explain the data as well as the
/// estimates. The first sentence names them.
pub(crate) fn equal_minimum_warning(unknowns: &[Unknown], x: &[f64]) -> String {
    format!(
        "{} explains the data as well as the estimates, which are those nearer to the scene. Give a start or bounds, or \
         data that exclude one of the two",
        values_at(unknowns, x)
    )
}

/// The values at the point `x`, on the unknowns' scales, as text with their units.
fn values_at(unknowns: &[Unknown], x: &[f64]) -> String {
    let value = |(unknown, value): (&Unknown, f64)| {
        format!("{unknown} = {value:.3e} {}", unknown.parameter.unit()).trim_end().to_string()
    };
    let values = unknowns.iter().zip(ParameterPoint { unknowns, x }.values());
    values.map(value).collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::Sample;
    use crate::fit::measurement::experiment::Experiment;
    use crate::fit::measurement::motion::Observation;
    use crate::scene::{Material, Parameter, Point, Scene, Section, Shape, Time};

    /// Observations of the tip of a rod that swings several times; its modulus is 1e8 Pa.
    fn experiments() -> [Experiment; 1] {
        let shape = Shape::Straight { length: 0.5, direction: [1.0, 0.0, 0.0] };
        let section = Section::Circle { radius: 0.005 };
        let mut scene = Scene::new(8, shape, section, Material::new(1273.52, 1e8));
        scene.loads.gravity = [0.0, -9.8, 0.0];
        scene.time = Some(Time::new(3.0, 5e-3));
        let problem = scene.problem().unwrap();
        let run = problem.simulate().unwrap();
        let samples = (1..=100).map(|k| {
            let time = 0.03 * f64::from(k);
            Sample { time, position: run.at(Point::Tip, time).unwrap().0.map(Some) }
        });
        [Experiment::new("", &problem).observe(Observation::new(samples.collect()).sigma(1e-3))]
    }

    /// A minimum of a coarser mesh is fitted again if its objective there was lower or up to 1.5 times as high, and
    /// chosen if it is lower here. A minimum with 1.6 times the objective, or near the chosen one, is not.
    #[test]
    fn lower_minimum_of_another_mesh_is_chosen() {
        let experiments = experiments();
        let unknowns = [Unknown::new(Parameter::YoungsModulus)];
        let search = Search::new(&experiments, &unknowns, None, 1e-2).unwrap();
        let (right, wrong) = (1e8_f64.ln(), 1.5e8_f64.ln());
        let local = search.polish(&[wrong]).unwrap();
        assert!(local.converged && distance(&local.x, &[right]) > 0.1, "{:?}", local.x);
        let found = |x: f64, factor: f64| {
            let next = search.with_experiments(&experiments).unwrap();
            let mut other = next.minimum(&local).scaled(factor);
            other.x = vec![x];
            other.numerics = next.numerics + 1;
            next.journal.add_minimum(other);
            let lower = next.compare_minima(&local, 1.0).unwrap().lower;
            next.journal.clear_minima();
            lower
        };
        for factor in [0.5, 1.3] {
            let lower = found(right + 0.02, factor).expect("the minimum at 1e8 Pa");
            assert!(distance(&lower.x, &[right]) < 1e-4 && lower.cost < 1e-3 * local.cost);
        }
        assert!(found(right + 0.02, 1.6).is_none());
        assert!(found(local.x[0] + 0.015, 0.5).is_none());
    }
}
