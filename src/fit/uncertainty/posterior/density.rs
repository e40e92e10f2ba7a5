//! Log posterior density of the unknowns of a fit on their scales (logarithms of positive parameters), with its exact
//! gradient.
//!
//! The likelihood is that of independent noise. A measurement with a stated sigma adds minus half the sum of its
//! losses. Without a stated sigma the noise has the prior `1/sigma`, and sigma is integrated out: `-(n/2) ln S` with
//! the sum of squares `S` of `n` values, a Student-t form (Gelman et al. 2013, Bayesian Data Analysis, section 3.2).
//! Values with weights of growing sensitivities count in part, and fitted arc lengths use up a value each. A robust
//! loss has no such integral: sigma is the estimated one, and losses are over the misfit scale, as in the profile
//! likelihood.
//!
//! The prior is flat in the unknown on its scale: for positive parameters flat in the logarithm. A normal prior of an
//! unknown replaces it by a density in its unit. Output of [`PosteriorDensity::evaluate`]: the log density up to a
//! constant and its gradient, by the Jacobian of the residuals, or by the adjoint where sigmas are stated and that
//! costs less. `information` is the Gauss-Newton matrix, the negative Hessian for residuals that are linear.

use crate::error::Error;
use crate::fit::misfit::residuals::Residuals;
use crate::fit::search::fitted::{Fitted, MeasuredResiduals};
use crate::fit::uncertainty::noise::residual_noise::ResidualNoise;
use crate::fit::unknown::Unknown;
use argmin::core::Gradient;
use nalgebra::DMatrix;
use std::ops::Range;

/// Noise of a block of residuals.
#[derive(Clone, Copy, Debug, PartialEq)]
enum BlockNoise {
    /// Residuals are in units of the root of this scale.
    Known { scale: f64 },
    /// Sigma is integrated out; the number of values that determine it.
    Integrated { values: f64 },
}

impl BlockNoise {
    /// The log likelihood of residuals with this sum of squares, and minus its derivative by half the sum.
    fn log_likelihood(self, square: f64) -> [f64; 2] {
        match self {
            Self::Known { scale } => [-0.5 * square / scale, scale.recip()],
            Self::Integrated { values } => {
                // Exact data have no noise: the sum stays positive.
                let square = square.max(f64::MIN_POSITIVE);
                [-0.5 * values * square.ln(), values / square]
            }
        }
    }
}

/// Residuals of one measurement, or those of all priors.
struct ResidualBlock {
    /// Their places among all residuals.
    rows: Range<usize>,
    noise: BlockNoise,
}

/// Log posterior density of the unknowns on their scales.
pub(crate) struct PosteriorDensity<'a> {
    residuals: Residuals,
    unknowns: &'a [Unknown],
    /// Noise of each block of residuals, in their order; that of the priors is last.
    blocks: Vec<ResidualBlock>,
}

impl<'a> PosteriorDensity<'a> {
    /// The density of a fit at its optimum, with the sigmas, leverage weights and losses of the search. `noise` is that
    /// of the optimum. Error: a measured point is not on the rod.
    pub fn new(fitted: Fitted<'a>, noise: &ResidualNoise) -> Result<Self, Error> {
        let (search, mut first) = (fitted.search, 0);
        let mut blocks = Vec::new();
        let is_robust = fitted.measured().any(|own| own.measurement.loss().is_robust());
        let scale = if is_robust { noise.misfit_scale } else { 1.0 };
        for MeasuredResiduals { measurement, rows, .. } in fitted.measured() {
            let is_stated = measurement.sigma().is_some() || measurement.loss().is_robust();
            let noise = match is_stated {
                true => BlockNoise::Known { scale },
                false => {
                    let weights = rows.clone().map(|k| search.growth_weight(k).powi(2));
                    let values = weights.sum::<f64>() - measurement.fitted_nuisances() as f64;
                    BlockNoise::Integrated { values: values.max(1.0) }
                }
            };
            first = rows.end;
            blocks.push(ResidualBlock { rows, noise });
        }
        let rows = first..fitted.optimum.residuals.len();
        blocks.push(ResidualBlock { rows, noise: BlockNoise::Known { scale: 1.0 } });
        Ok(Self { residuals: search.all_residuals()?, unknowns: search.unknowns, blocks })
    }

    /// The log density at `x` on the scales of the unknowns, up to a constant; its gradient is set in `gradient`.
    /// Error: a simulation fails.
    pub fn evaluate(&self, x: &[f64], gradient: &mut [f64]) -> Result<f64, Error> {
        gradient.fill(0.0);
        let is_unit = |own: &ResidualBlock| own.noise == BlockNoise::Known { scale: 1.0 };
        let mut value = 0.0;
        if self.blocks.iter().all(is_unit) {
            // The objective of the search itself, whose gradient may be by the adjoint.
            let by = self.residuals.gradient(&x.to_vec()).map_err(own_error)?;
            gradient.iter_mut().zip(by).for_each(|(g, by)| *g = -by);
            value -= 0.5 * square_of(&self.residuals.residuals(x)?);
        } else {
            // The Jacobian first: the residuals of the same evaluation cost no simulation.
            let rows = self.residuals.jacobian_at(x)?;
            let residuals = self.residuals.residuals(x)?;
            for ResidualBlock { rows: range, noise } in &self.blocks {
                let own = &residuals[range.clone()];
                let [likelihood, factor] = noise.log_likelihood(square_of(own));
                value += likelihood;
                for (row, r) in rows[range.clone()].iter().zip(own) {
                    gradient.iter_mut().zip(row).for_each(|(g, by)| *g -= factor * by * r);
                }
            }
        }
        for ((unknown, x), g) in self.unknowns.iter().zip(x).zip(gradient) {
            // A prior is a density in the unit of the parameter: dv = v dx on a logarithmic scale.
            if unknown.prior.is_some() && unknown.is_logarithm() {
                value += x;
                *g += 1.0;
            }
        }
        Ok(value)
    }

    /// The Gauss-Newton matrix `sum c j j'` at `x`, with the rows `j` of the Jacobian and the factor `c` of each block.
    /// Error: a simulation fails.
    pub fn information(&self, x: &[f64]) -> Result<DMatrix<f64>, Error> {
        let rows = self.residuals.jacobian_at(x)?;
        let residuals = self.residuals.residuals(x)?;
        let mut sum = DMatrix::zeros(x.len(), x.len());
        for ResidualBlock { rows: range, noise } in &self.blocks {
            let [_, factor] = noise.log_likelihood(square_of(&residuals[range.clone()]));
            for row in &rows[range.clone()] {
                for (i, a) in row.iter().enumerate() {
                    for (j, b) in row.iter().enumerate() {
                        sum[(i, j)] += factor * a * b;
                    }
                }
            }
        }
        Ok(sum)
    }
}

/// Sum of squares.
fn square_of(residuals: &[f64]) -> f64 {
    residuals.iter().map(|r| r * r).sum()
}

/// The error of a simulation in an error of argmin.
fn own_error(error: argmin::core::Error) -> Error {
    let text = error.to_string();
    error.downcast().unwrap_or(Error::Fit(text))
}
