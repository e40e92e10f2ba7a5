//! Minima found on the way that may be lower than the chosen one.
//!
//! A search begins on a coarse mesh and with preliminary weights, and ends with others. The order of two minima may
//! change with them. So the minima whose recorded objective is near the chosen one's are followed once more, on the
//! final mesh and with the final weights, and the lowest is taken.

use crate::error::Error;
use crate::fit::search::Search;
use crate::fit::search::local_minima::{SAME, distance, values};
use crate::fit::search::minimum::{Minimum, Squares};
use crate::fit::search::optimum::Optimum;
use crate::fit::unknown::Unknown;
use crate::numerics::total_order;

/// Minima of other meshes with an objective up to this many times the chosen one's are followed: another mesh changes
/// an objective by some tens of per cent.
const NEAR_OBJECTIVE: f64 = 1.5;
/// So many are followed at most, the lowest first.
const MOST_FOLLOWED: usize = 3;
/// Twice the difference of two objectives, in units of the variance of the noise, that the noise explains: the
/// threshold of a likelihood ratio at two standard deviations.
const EXPLAINED_BY_NOISE: f64 = 4.0;

/// What following the other minima has found.
pub(crate) struct MinimumComparison<'a> {
    /// The search, which no longer follows an objective that hardly changes.
    pub search: Search<'a>,
    /// A lower minimum than the chosen one.
    pub lower: Option<Optimum>,
    /// Where the objective is clearly lower, though the optimizer did not converge there.
    pub unreached: Option<Vec<f64>>,
}

impl<'a> Search<'a> {
    /// Records where a fit of the full model to the whole records ended.
    pub fn add_minimum(&self, optimum: &Optimum) {
        self.journal.add_minimum(self.minimum(optimum));
    }

    /// An end of a fit as the journal records it.
    pub fn minimum(&self, optimum: &Optimum) -> Minimum {
        let Optimum { x, cost, residuals, counts, converged, .. } = optimum;
        let squares = Squares::new(residuals, counts, &self.sigmas, *cost);
        Minimum { x: x.clone(), squares, converged: *converged, numerics: self.numerics }
    }

    /// Follows the minima that may be lower than `optimum`, where the noise has this variance.
    pub fn compare_minima(
        &self,
        optimum: &Optimum,
        variance: f64,
    ) -> Result<MinimumComparison<'a>, Error> {
        let search = Self { ends_crawling: true, ..self.clone() };
        let mut comparison =
            MinimumComparison { lower: None, unreached: None, search: search.clone() };
        let mut ends = vec![optimum.x.clone()];
        for rival in self.rivals(optimum) {
            if ends.iter().any(|end| distance(end, &rival.x) <= SAME) {
                continue;
            }
            let found = match search.polish(&rival.x).and_then(|end| search.raised(end)) {
                Ok(found) => found,
                Err(Error::Interrupted) => return Err(Error::Interrupted),
                // What cannot be simulated on this mesh is no better.
                Err(_) => continue,
            };
            self.journal.move_minimum(&rival.x, self.minimum(&found));
            ends.push(found.x.clone());
            let least = comparison.lower.as_ref().unwrap_or(optimum).cost;
            let clearly = 2.0 * (least - found.cost) > EXPLAINED_BY_NOISE * variance;
            let is_other = distance(&found.x, &optimum.x) > SAME;
            match found.converged || !optimum.converged {
                true if found.cost < least && is_other => comparison.lower = Some(found),
                false if clearly => comparison.unreached = Some(found.x),
                _ => {}
            }
        }
        Ok(comparison)
    }

    /// Records what became of the minimum at `before`, expected at `expected` on this search's mesh: the same minimum,
    /// or another one.
    pub fn follow(&self, before: &[f64], expected: &[f64], found: &Optimum) {
        let moved = SAME.max(0.5 * distance(before, expected));
        match distance(&found.x, expected) <= moved {
            true => self.journal.move_minimum(before, self.minimum(found)),
            false => self.add_minimum(found),
        }
    }

    /// The recorded minima whose objective is near or below that of `optimum`, the lowest first.
    fn rivals(&self, optimum: &Optimum) -> Vec<Minimum> {
        let misfit = |minimum: &Minimum| minimum.squares.misfit(&self.sigmas);
        let mut rivals = self.journal.minima();
        rivals.retain(|minimum| {
            let factor = if minimum.numerics == self.numerics { 1.0 } else { NEAR_OBJECTIVE };
            distance(&minimum.x, &optimum.x) > SAME && misfit(minimum) < factor * optimum.cost
        });
        rivals.sort_by_cached_key(|x| total_order(misfit(x)));
        let mut apart: Vec<Minimum> = Vec::new();
        for rival in rivals {
            if apart.iter().all(|other| distance(&other.x, &rival.x) > SAME) {
                apart.push(rival);
            }
        }
        apart.truncate(MOST_FOLLOWED);
        apart
    }
}

/// That the objective is lower where the optimizer did not converge.
pub(crate) fn better_elsewhere(unknowns: &[Unknown], x: &[f64]) -> String {
    let value = |(unknown, value): (&Unknown, f64)| {
        format!("{unknown} = {value:.3e} {}", unknown.parameter.unit()).trim_end().to_string()
    };
    let values: Vec<String> = unknowns.iter().zip(values(unknowns, x)).map(value).collect();
    format!(
        "{} has a lower misfit, but the search did not converge there. The estimates are not the optimum. Give a \
         start or bounds near it, or shorten the record",
        values.join(", ")
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::Sample;
    use crate::fit::measurement::experiment::Experiment;
    use crate::fit::measurement::motion::Observation;
    use crate::scene::{Material, Parameter, Point, Scene, Section, Shape, Time};

    /// A rod that swings several times, with its modulus to be found.
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

    /// A minimum of a coarser mesh is followed whether it was lower there or higher by a third, and taken if it is lower
    /// here. What is not near in its objective, or leads to the same minimum, is left.
    #[test]
    fn lower_minimum_of_another_mesh_is_taken() {
        let experiments = experiments();
        let unknowns = [Unknown::new(Parameter::YoungsModulus)];
        let search = Search::new(&experiments, &unknowns, None, 1e-2).unwrap();
        let (right, wrong) = (1e8_f64.ln(), 1.5e8_f64.ln());
        let local = search.polish(&[wrong]).unwrap();
        assert!(local.converged && distance(&local.x, &[right]) > 0.1, "{:?}", local.x);
        let found = |x: f64, factor: f64| {
            let next = search.on(&experiments).unwrap();
            let elsewhere = Minimum { numerics: next.numerics + 1, ..Minimum::at(&[x], 1.0) };
            let mut there = next.minimum(&local);
            there.x.clone_from(&elsewhere.x);
            there.numerics = elsewhere.numerics;
            next.journal.add_minimum(there.scaled(factor));
            let lower = next.compare_minima(&local, 1.0).unwrap().lower;
            next.journal.forget_minima();
            lower
        };
        for factor in [0.5, 1.3] {
            let lower = found(right + 0.02, factor).expect("the minimum of the truth");
            assert!(distance(&lower.x, &[right]) < 1e-4 && lower.cost < 1e-3 * local.cost);
        }
        assert!(found(right + 0.02, 1.6).is_none());
        assert!(found(local.x[0] + 0.015, 0.5).is_none());
    }
}
