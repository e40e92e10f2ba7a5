//! How the estimates answer to numbers of the scenes that are not identified.
//!
//! Where a number is off by `dk`, the residuals are off by `dr = (dr/dk) dk` and the fit makes up for it:
//! the unknowns move by `-(J'WJ)^-1 J'W dr`. Derivatives of residuals by a number of the scene are those
//! by a parameter; one run has all of them.

use crate::error::Error;
use crate::fit::known::Known;
use crate::fit::measurement::experiment::Experiment;
use crate::fit::misfit::residuals::Residuals;
use crate::fit::search::Search;
use crate::fit::search::fitted::Fitted;
use crate::fit::uncertainty::budget::entries::InputSensitivity;
use crate::fit::uncertainty::covariance::gauss_newton::LinearFit;
use crate::fit::uncertainty::estimate::Estimate;
use crate::fit::uncertainty::noise::residual_noise::weighted;
use crate::fit::unknown::Unknown;
use crate::numerics::total_order;
use crate::scene::Parameter;
use nalgebra::{DMatrix, Dyn, QR};
use std::borrow::Borrow;
use std::cmp::Reverse;

/// So many numbers at most.
const MOST_NUMBERS: usize = 16;
/// Below so much of a per cent, or of its size, an estimate does not answer.
const SEEN: f64 = 1e-3;
/// Where the numbers stand of which one per cent matters. InputDirections, meshes and steps have none.
const MATTER: [&str; 10] = [
    "rod.shape.",
    "rod.section.",
    "rod.mass.",
    "material.",
    "loads.",
    "camera.pixel_scale",
    "supports.motion.",
    "initial.velocity.",
    "initial.angular_velocity.",
    "rod.taper.",
];
const DIRECTIONS: [&str; 3] = ["rod.shape.direction", "rod.shape.axis", "rod.section.up"];

/// A change of numbers of the scenes.
pub(crate) struct Change {
    /// What is off.
    pub source: String,
    parts: Vec<Part>,
}

/// One number, of the experiments that have the same value of it.
struct Part {
    number: Unknown,
    value: f64,
    /// By how much it changes, in its unit.
    by: f64,
}

/// The values of a number, with the experiments that have them.
fn values(experiments: &[Experiment], number: &Unknown) -> Vec<(f64, Vec<String>)> {
    let mut values: Vec<(f64, Vec<String>)> = Vec::new();
    for experiment in experiments.iter().filter(|e| number.is_of(e)) {
        let Some(value) = number.parameter.of(experiment.problem.scene()) else { continue };
        match values.iter_mut().find(|(known, _)| *known == value) {
            Some((_, names)) => names.push(experiment.name.clone()),
            None => values.push((value, vec![experiment.name.clone()])),
        }
    }
    values
}

impl Change {
    /// Of a number in all its experiments, by what `by` makes of its value.
    fn of(experiments: &[Experiment], number: &Unknown, by: impl Fn(f64) -> f64) -> Self {
        let part = |(value, experiments): (f64, Vec<String>)| Part {
            number: Unknown { experiments, plain: true, ..Unknown::new(number.parameter) },
            value,
            by: by(value),
        };
        let parts = values(experiments, number).into_iter().map(part).collect();
        Self { source: number.to_string(), parts }
    }

    /// Of a number in all its experiments, by the same in its unit.
    pub fn by(experiments: &[Experiment], source: &str, number: &Unknown, by: f64) -> Self {
        Self { source: source.into(), ..Self::of(experiments, number, |_| by) }
    }

    /// Together with another one.
    pub fn and(mut self, other: Self) -> Self {
        self.parts.extend(other.parts);
        self
    }

    /// Of a known number, by its standard uncertainty.
    pub fn of_known(experiments: &[Experiment], known: &Known) -> Self {
        Self::of(experiments, &known.as_unknown(), |_| known.sigma)
    }

    /// The same change about values that are so many times farther off.
    pub fn about(&self, times: f64) -> Self {
        let part = |part: &Part| Part {
            number: part.number.clone(),
            value: part.value + times * part.by,
            by: part.by,
        };
        Self { source: self.source.clone(), parts: self.parts.iter().map(part).collect() }
    }

    /// Relative change of the density, where it is that of the density of all these experiments.
    pub fn of_density(&self, experiments: &[Experiment]) -> Option<f64> {
        let first = self.parts.first()?;
        let is_density = |part: &Part| part.number.parameter == Parameter::Density;
        let of_all = |e: &Experiment| self.parts.iter().any(|part| part.number.is_of(e));
        let relative = |part: &Part| part.by / part.value;
        let alike = |part: &Part| (relative(part) / relative(first) - 1.0).abs() < 1e-9;
        let all = self.parts.iter().all(|part| is_density(part) && alike(part));
        (all && experiments.iter().all(of_all)).then(|| relative(first))
    }

    /// The value of its number, where all experiments have the same.
    pub fn value(&self) -> Option<f64> {
        match &self.parts[..] {
            [alone] => Some(alone.value),
            _ => None,
        }
    }
}

/// One per cent of everything that matters and is not said: components of a vector are one.
pub(crate) fn unstated_inputs(search: &Search, knowns: &[Known]) -> Vec<Change> {
    let said = |p: Parameter, e: &Experiment| {
        search.unknowns.iter().any(|u| u.parameter == p && u.is_of(e))
            || knowns.iter().any(|k| k.parameter == p && k.as_unknown().is_of(e))
    };
    let starts = |path: &str, places: &[&str]| places.iter().any(|place| path.starts_with(place));
    let mut changes: Vec<Change> = Vec::new();
    let mut seen: Vec<Parameter> = Vec::new();
    for experiment in search.experiments {
        let problem = &experiment.problem;
        for parameter in Parameter::all(problem.scene()) {
            let path = parameter.path();
            let there = parameter.of(problem.scene()).is_some_and(|value| value != 0.0);
            if !there
                || !starts(path, &MATTER)
                || starts(path, &DIRECTIONS)
                || seen.contains(&parameter)
                || said(parameter, experiment)
                || problem.check_parameter(parameter).is_err()
            {
                continue;
            }
            if seen.len() == MOST_NUMBERS {
                return changes;
            }
            seen.push(parameter);
            let mut change =
                Change::of(search.experiments, &parameter.into(), |value| 0.01 * value);
            if let Some(vector) = [".x", ".y", ".z"].iter().find_map(|c| path.strip_suffix(c)) {
                change.source = vector.into();
            }
            match changes.iter_mut().find(|other| other.source == change.source) {
                Some(other) => other.parts.append(&mut change.parts),
                None => changes.push(change),
            }
        }
    }
    changes
}

/// Derivatives of the weighted residuals: by the unknowns that are identified, and along changes of other
/// numbers.
pub(crate) struct InputDirections {
    free: Vec<usize>,
    norms: Vec<f64>,
    factors: QR<f64, Dyn, Dyn>,
    changes: DMatrix<f64>,
    /// Residuals at the point of the derivatives, plain.
    pub residuals: Vec<f64>,
}

impl InputDirections {
    /// At the optimum; `experiments` are those of the search, or a coarse model of them.
    pub fn of(
        Fitted { search, optimum }: Fitted,
        experiments: &[Experiment],
        LinearFit { identified, weights }: &LinearFit,
        changes: &[impl Borrow<Change>],
    ) -> Result<Self, Error> {
        let changes: Vec<&Change> = changes.iter().map(Borrow::borrow).collect();
        let n = search.unknowns.len();
        let (mut unknowns, mut x) = (search.unknowns.to_vec(), optimum.x.clone());
        for part in changes.iter().flat_map(|change| &change.parts) {
            unknowns.push(part.number.clone());
            x.push(part.value);
        }
        let durations = search.durations();
        let residuals =
            Residuals::new(experiments, &search.sigmas, &unknowns, &durations, search.full_work)?
                .counting(search.work.clone());
        let rows = weighted(&residuals.plain_jacobian(&x)?, weights);
        let plain = residuals.plain(&x)?;
        let norm = |j: usize| rows.iter().map(|row| row[j] * row[j]).sum::<f64>().sqrt();
        let norms: Vec<f64> = (0..n).map(norm).collect();
        let free: Vec<usize> = (0..n).filter(|j| identified[*j] && norms[*j] > 0.0).collect();
        let by_free =
            DMatrix::from_fn(rows.len(), free.len(), |i, a| rows[i][free[a]] / norms[free[a]]);
        let mut first = n;
        let mut along = DMatrix::zeros(rows.len(), changes.len());
        for (c, change) in changes.iter().enumerate() {
            for (k, part) in change.parts.iter().enumerate() {
                for (i, row) in rows.iter().enumerate() {
                    along[(i, c)] += part.by * row[first + k];
                }
            }
            first += change.parts.len();
        }
        Ok(Self { free, norms, factors: by_free.qr(), changes: along, residuals: plain })
    }

    /// How every unknown, on its scale, answers to every change; none for those that are not identified.
    pub fn answers(&self) -> Vec<Vec<Option<f64>>> {
        self.answers_to(&self.changes)
    }

    /// How every unknown, on its scale, answers to other changes of the weighted residuals, a column each.
    pub fn answers_to(&self, changes: &DMatrix<f64>) -> Vec<Vec<Option<f64>>> {
        let Self { free, norms, factors, .. } = self;
        let moved = factors.r().solve_upper_triangular(&(factors.q().tr_mul(changes)));
        let answer = |c: usize, j: usize| {
            let place = free.iter().position(|k| *k == j)?;
            let moved = -moved.as_ref()?[(place, c)] / norms[j];
            moved.is_finite().then_some(moved)
        };
        (0..changes.ncols()).map(|c| (0..norms.len()).map(|j| answer(c, j)).collect()).collect()
    }

    /// The changes as they are, and what of them the unknowns cannot follow.
    pub fn unfollowed(&self) -> [DMatrix<f64>; 2] {
        let q = self.factors.q();
        [self.changes.clone(), &self.changes - &q * q.tr_mul(&self.changes)]
    }
}

/// What one per cent of `changes` does to every estimate, by the answers to them: the most first.
pub(crate) fn per_cents(
    search: &Search,
    estimates: &[Estimate],
    (changes, answers): (&[Change], &[Vec<Option<f64>>]),
) -> Vec<Vec<InputSensitivity>> {
    let of = |(j, estimate): (usize, &Estimate)| {
        let mut all = Vec::new();
        let Some(value) = estimate.value.filter(|_| estimate.std_error.is_some()) else {
            return all;
        };
        for (change, moved) in changes.iter().zip(answers) {
            let Some((by, relative)) = effect(&search.unknowns[j], value, moved[j]) else {
                continue;
            };
            all.push(InputSensitivity { source: change.source.clone(), change: by, relative });
        }
        all.sort_by_cached_key(|x| Reverse(total_order(x.change.abs())));
        all
    };
    estimates.iter().enumerate().map(of).collect()
}

/// A move of an unknown on its scale, as a change of its value and as a part of it if it is positive; none
/// where it hardly moves.
pub(crate) fn effect(
    unknown: &Unknown,
    value: f64,
    moved: Option<f64>,
) -> Option<(f64, Option<f64>)> {
    let moved = moved?;
    let positive = unknown.parameter.is_positive();
    let by = moved * unknown.slope(value);
    let size = if positive { 0.01 * value } else { value.abs() };
    (by.abs() > SEEN * size).then(|| (by, positive.then_some(moved)))
}
