//! A fitted optimum with the search that found it, as the input of all analyses of a fit.
//!
//! [`Fitted`] pairs both. Derived from them are every measurement with its rows of the residual vector
//! ([`MeasuredResiduals`]), and the problem of an experiment with the fitted values. A further fit finds the optimum over the
//! other unknowns with some held, for profile likelihoods and for directions that the data do not determine.

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
    /// Unit of the residuals, in the unit of the measurement.
    pub sigma: f64,
    /// Plain residuals, in units of sigma.
    pub residuals: &'a [f64],
    /// Rows of the residuals among all.
    pub rows: Range<usize>,
}

impl MeasuredResiduals<'_> {
    /// Size of the observed motion, in the unit of the measurement (m or rad/s).
    pub fn size(&self) -> f64 {
        self.measurement.size(&self.experiment.problem)
    }
}

impl Search<'_> {
    /// The leverage weight of a row of the residuals, 0 to 1; 1 where no weights are set.
    pub fn leverage_weight(&self, row: usize) -> f64 {
        self.leverage_weights.get(row).copied().unwrap_or(1.0)
    }

    /// Every measurement with its residuals at an optimum, in the order of experiments and measurements.
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

    /// The optimum over the other unknowns with unknown `i` held at `held` on its scale. The others start at `from`, a point
    /// of all unknowns on their scales.
    pub fn optimum_with_held(&self, i: usize, held: f64, from: &[f64]) -> Result<Optimum, Error> {
        let mut start = from.to_vec();
        start[i] = held;
        self.optimum_with_all_held(&[i], &start)
    }

    /// The optimum from the point `start` with the unknowns of these indices held at their values there; without free
    /// unknowns the start itself.
    fn optimum_with_all_held(&self, held: &[usize], start: &[f64]) -> Result<Optimum, Error> {
        // Equal bounds hold an unknown without changing the number of columns of the Jacobian.
        let mut unknowns = self.unknowns.to_vec();
        for i in held {
            let value = unknowns[*i].from_scale(start[*i]);
            unknowns[*i] = unknowns[*i].clone().bounds(value, value);
        }
        let search = Search { unknowns: &unknowns, ..self.detached() };
        let optimum = search.polish(start);
        self.work.add(search.work.total());
        optimum
    }

    /// The problem of an experiment with the values of the unknowns at `x`, on their scales. Mesh layout and numerics stay.
    pub fn problem_at(&self, x: &[f64], experiment: &Experiment) -> Result<Problem, Error> {
        let point = ParameterPoint { unknowns: self.unknowns, x };
        experiment.problem.with_fixed_layout(point.values_of(experiment))
    }
}

impl<'a> Fitted<'a> {
    /// Every measurement with its residuals at this optimum.
    pub fn measured(self) -> impl Iterator<Item = MeasuredResiduals<'a>> {
        self.search.measured(self.optimum)
    }

    /// The optimum with the unknowns of these indices held at their values, from the same point. A step along a direction
    /// that the data do not determine may end at the limit of its length, so that the search stops short of the optimum along
    /// the others.
    pub fn without_undetermined(self, held: &[usize]) -> Result<Optimum, Error> {
        let found = self.search.optimum_with_all_held(held, &self.optimum.x)?;
        self.search.follow(&self.optimum.x, &found.x, &found);
        Ok(found)
    }

    /// The problem of an experiment with the fitted values of the unknowns.
    pub fn problem(self, experiment: &Experiment) -> Result<Problem, Error> {
        self.search.problem_at(&self.optimum.x, experiment)
    }
}
