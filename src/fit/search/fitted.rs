//! A fitted optimum with the search that found it, as the input of all analyses of a fit.
//!
//! [`Fitted`] pairs both. Its methods return results for the fitted values. `measured` iterates over the measurements
//! with their rows of the residual vector ([`MeasuredResiduals`]): sigma in the unit of the measurement, and plain
//! residuals in units of sigma, without robust loss and leverage weights. `problem` is the problem of an experiment
//! with the fitted values of its unknowns; `problem_at` is the same for any point of the unknowns on their scales.
//! [`Search::optimum_with_held`] is a further fit of the full model over all other unknowns with one held (on its
//! scale), for profile likelihoods; the journal stays. [`Fitted::without_undetermined`] holds the given unknowns, those
//! that the data do not determine, at their values. It fits the others, and replaces the minimum in the journal. Failed
//! fits, and scenes that do not allow the values, are errors. `leverage_weight` is the weight of a residual in the
//! search.

use crate::error::Error;
use crate::fit::measurement::Measurement;
use crate::fit::measurement::experiment::{Experiment, all};
use crate::fit::search::Search;
use crate::fit::search::optimum::Optimum;
use crate::fit::unknown::ParameterPoint;
use crate::problem::Problem;
use std::ops::Range;

/// An optimum with the search that found it, whose experiments and unknowns it belongs to.
#[derive(Clone, Copy)]
pub(crate) struct Fitted<'a> {
    pub search: &'a Search<'a>,
    pub optimum: &'a Optimum,
}

/// A measurement with its residuals at an optimum, as one block of the residual vector.
pub(crate) struct MeasuredResiduals<'a> {
    /// Index of the measurement among all.
    pub index: usize,
    pub experiment: &'a Experiment,
    pub measurement: &'a Measurement,
    /// Standard deviation in the unit of the measurement, by which the residuals are divided.
    pub sigma: f64,
    /// Plain residuals, in units of sigma.
    pub residuals: &'a [f64],
    /// Rows of the residuals among all.
    pub rows: Range<usize>,
}

impl MeasuredResiduals<'_> {
    /// Typical size of the measured effect, in the unit of the measurement, by
    /// [`DataKind::size`](crate::fit::measurement::dataset::DataKind::size). It is the spread of a motion, m, the
    /// deflection of a shape, m, the mean frequency, rad/s, or the spread or magnitude of other readings.
    pub fn size(&self) -> f64 {
        self.measurement.size(&self.experiment.problem)
    }
}

impl Search<'_> {
    /// The leverage weight of the residual with index `row`, 0 to 1; 1 where the search has no weights or none for this
    /// index.
    pub fn leverage_weight(&self, row: usize) -> f64 {
        self.leverage_weights.get(row).copied().unwrap_or(1.0)
    }

    /// Every measurement of all experiments in their order, with its index, sigma, its part of the optimum's residuals
    /// (in units of sigma, without robust loss and leverage weights) and the range of that part. Residuals of priors,
    /// at the end, belong to none.
    pub fn measured<'b>(
        &'b self,
        optimum: &'b Optimum,
    ) -> impl Iterator<Item = MeasuredResiduals<'b>> {
        let mut first = 0;
        let counts = self.sigmas.iter().zip(&optimum.counts);
        all(self.experiments).zip(counts).enumerate().map(move |(index, (measured, (sigma, n)))| {
            let rows = first..first + n;
            first += n;
            let (experiment, measurement) = measured;
            let residuals = &optimum.residuals[rows.clone()];
            MeasuredResiduals { index, experiment, measurement, sigma: *sigma, residuals, rows }
        })
    }

    /// The optimum over the other unknowns with unknown `i` held at `held` on its scale, by a fit of the full model to
    /// the whole records. The others start at `from`, a point of all unknowns on their scales. The work is added to
    /// that of this search; its journal does not change. An error if the start cannot be simulated or the user stops.
    pub fn optimum_with_held(&self, i: usize, held: f64, from: &[f64]) -> Result<Optimum, Error> {
        let mut start = from.to_vec();
        start[i] = held;
        self.optimum_with_all_held(&[i], &start)
    }

    /// The optimum of a fit of the full model from the point `start`, with the unknowns of the indices `held` fixed at
    /// their values there by equal bounds. All columns of the Jacobian stay. The work is added to that of this search.
    /// Error: the fit fails.
    fn optimum_with_all_held(&self, held: &[usize], start: &[f64]) -> Result<Optimum, Error> {
        // Equal bounds hold an unknown without changing the number of columns of the Jacobian.
        let mut unknowns = self.unknowns.to_vec();
        for i in held {
            let value = unknowns[*i].from_scale(start[*i]);
            unknowns[*i] = unknowns[*i].clone().bounds(value, value);
        }
        let search = Search { unknowns: &unknowns, ..self.detached() };
        let optimum = search.polish(start);
        // The work counts also where the fit fails.
        self.work.add(search.work.total());
        optimum
    }

    /// The problem of an experiment with the values of those unknowns that belong to it at `x`, on their scales. Mesh
    /// layout, steps and scheme stay. An error if the scene is invalid with these values.
    pub fn problem_at(&self, x: &[f64], experiment: &Experiment) -> Result<Problem, Error> {
        let point = ParameterPoint { unknowns: self.unknowns, x };
        experiment.problem.with_fixed_layout(point.values_of(experiment))
    }
}

impl<'a> Fitted<'a> {
    /// Every measurement of all experiments in their order, with its index, sigma, its residuals at this optimum (in
    /// units of sigma, without robust loss and leverage weights) and the range of their rows.
    pub fn measured(self) -> impl Iterator<Item = MeasuredResiduals<'a>> {
        self.search.measured(self.optimum)
    }

    /// The optimum of a fit from this one with the unknowns of the indices `held` fixed at their values. The others
    /// start at this optimum. The new minimum replaces this one in the journal. Reason: a step along an undetermined
    /// direction may end at the limit of its length. The search then stops short of the optimum along the others.
    /// Error: the fit fails.
    pub fn without_undetermined(self, held: &[usize]) -> Result<Optimum, Error> {
        let found = self.search.optimum_with_all_held(held, &self.optimum.x)?;
        // Both optima are in one basin, of which the journal keeps the last.
        self.search.follow(&self.optimum.x, &found.x, &found);
        Ok(found)
    }

    /// The problem of an experiment with the fitted values of the unknowns that belong to it, on the same mesh layout.
    /// An error if the scene is invalid with these values.
    pub fn problem(self, experiment: &Experiment) -> Result<Problem, Error> {
        self.search.problem_at(&self.optimum.x, experiment)
    }
}
