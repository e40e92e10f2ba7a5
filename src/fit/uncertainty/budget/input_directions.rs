//! Linear response of the estimates to changes of inputs.
//!
//! A change `dk` of an input changes the residuals by `dr = (dr/dk) dk`. The fit follows: the unknowns move by
//! `-(J'WJ)^-1 J'W dr`, with the squared weights `W` and the Jacobian `J`. Derivatives of the residuals by inputs are
//! computed like those by parameters, all in one run; a run that fails is an error. Input: an optimum, its identified
//! unknowns, the weights, and the changes of inputs. [`InputDirections`] has one column per change: the change of the
//! weighted residuals, and its part that is orthogonal to the Jacobian (`orthogonal_changes`). `responses` are the
//! moves of each unknown on its scale (logarithm of a positive parameter), `None` where it is not identified;
//! `responses_to` are those for other changes of the weighted residuals. Budgets and score tests use the result.

use crate::error::Error;
use crate::fit::measurement::experiment::Experiment;
use crate::fit::misfit::residuals::Residuals;
use crate::fit::search::fitted::Fitted;
use crate::fit::uncertainty::budget::input_changes::InputChange;
use crate::fit::uncertainty::covariance::gauss_newton::LinearFit;
use crate::fit::uncertainty::noise::residual_noise::weighted_rows;
use crate::numerics::column_norms;
use nalgebra::{DMatrix, Dyn, QR};

/// Changes of the weighted residuals by changes of inputs, and the directions in which the identified unknowns can
/// follow.
pub(crate) struct InputDirections {
    /// Identified unknowns with an effect.
    free: Vec<usize>,
    /// Lengths of the columns of the weighted Jacobian, of all unknowns.
    norms: Vec<f64>,
    /// QR factors of the weighted columns of the free unknowns, scaled to length one.
    factors: QR<f64, Dyn, Dyn>,
    /// Changes of the weighted residuals, a column each.
    pub changes: DMatrix<f64>,
    /// Unweighted residuals at the point of the derivatives.
    pub residuals: Vec<f64>,
}

impl InputDirections {
    /// Computes the derivatives at an optimum by one run of the `experiments`, those of the search or a coarse model of
    /// them. The column of each of the `changes` is the sum, over its parts, of change times derivative of the weighted
    /// residuals. The linear fit has the identified unknowns and the weights of the rows. The work is added to that of
    /// the search. Error: the simulation fails.
    pub fn new(
        Fitted { search, optimum }: Fitted,
        experiments: &[Experiment],
        LinearFit { identified, weights }: &LinearFit,
        changes: &[&InputChange],
    ) -> Result<Self, Error> {
        // Inputs are differentiated like unknowns, in the same run and behind them.
        let n = search.unknowns.len();
        let parts = || changes.iter().flat_map(|change| &change.parts);
        let mut unknowns = search.unknowns.to_vec();
        unknowns.extend(parts().map(|part| part.number.clone()));
        let x: Vec<f64> = optimum.x.iter().copied().chain(parts().map(|part| part.value)).collect();
        let durations = search.durations();
        let model =
            Residuals::new(experiments, &search.sigmas, &unknowns, &durations, search.full_work)?
                .with_work_counter(search.work.clone());
        let rows = weighted_rows(&model.plain_jacobian(&x)?, weights);
        let residuals = model.plain_residuals(&x)?;
        let norms = column_norms(&rows, n);
        let free: Vec<usize> = (0..n).filter(|j| identified[*j] && norms[*j] > 0.0).collect();
        // Columns of length one, so that the factors do not depend on the units.
        let columns =
            DMatrix::from_fn(rows.len(), free.len(), |i, a| rows[i][free[a]] / norms[free[a]]);
        // The derivatives by the parts of all changes come after those by the unknowns.
        let mut by_changes = DMatrix::zeros(rows.len(), changes.len());
        let mut derivative = n;
        for (c, change) in changes.iter().enumerate() {
            for part in &change.parts {
                for (i, row) in rows.iter().enumerate() {
                    by_changes[(i, c)] += part.change * row[derivative];
                }
                derivative += 1;
            }
        }
        Ok(Self { free, norms, factors: columns.qr(), changes: by_changes, residuals })
    }

    /// Responses to every change (outer index) of every unknown (inner index), on its scale (logarithm of a positive
    /// parameter). `None` for unknowns that are not identified or have no effect, and without a finite solution, as
    /// where other unknowns have exactly the same effect.
    pub fn responses(&self) -> Vec<Vec<Option<f64>>> {
        self.responses_to(&self.changes)
    }

    /// Responses to other `changes` of the weighted residuals, a column each, of every unknown on its scale (logarithm
    /// of a positive parameter): `-R^-1 Q' change`, with the QR factors of the weighted Jacobian. The outer index is
    /// the column, the inner one the unknown. `None` for unknowns that are not identified or have no effect, and
    /// without a finite solution, as where other unknowns have exactly the same effect.
    pub fn responses_to(&self, changes: &DMatrix<f64>) -> Vec<Vec<Option<f64>>> {
        let Self { free, norms, factors, .. } = self;
        let solved = factors.r().solve_upper_triangular(&(factors.q().tr_mul(changes)));
        let response = |c: usize, j: usize| {
            let a = free.iter().position(|k| *k == j)?;
            // An unknown that other unknowns replace entirely has an infinite response.
            let response = -solved.as_ref()?[(a, c)] / norms[j];
            response.is_finite().then_some(response)
        };
        (0..changes.ncols()).map(|c| (0..norms.len()).map(|j| response(c, j)).collect()).collect()
    }

    /// The part of each change of the weighted residuals, a column each, that the unknowns cannot follow: `(1 - QQ')
    /// change`.
    pub fn orthogonal_changes(&self) -> DMatrix<f64> {
        let q = self.factors.q();
        &self.changes - &q * q.tr_mul(&self.changes)
    }
}
