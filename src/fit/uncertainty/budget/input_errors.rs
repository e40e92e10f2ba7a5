//! What numbers that are known with an error do to a fit that takes them for exact: how far they move the estimates,
//! and what they leave in the residuals.
//!
//! A number that is off by `dk` leaves `u dk` in the residuals, `u` being what of `dr/dk` the unknowns cannot follow. Its
//! error has a distribution, as the noise has: the most probable `dk` of all known numbers, with their correlations `R`
//! in units of their standard uncertainties and the variance `v` of the noise, is
//!
//! ```text
//! dk = -(U'U/v + R^-1)^-1 U'r/v
//! ```
//!
//! The estimates stay where they are, since `U` is across all that the unknowns can do.

use crate::code::Code;
use crate::error::Error;
use crate::fit::known::{Known, correlations};
use crate::fit::search::fitted::Fitted;
use crate::fit::search::optimum::Optimum;
use crate::fit::uncertainty::budget::input_sensitivities::InputSensitivities;
use crate::fit::uncertainty::grade::{Severity, Warnings};
use crate::fit::uncertainty::noise::residual_noise::{Noise, weighted_residuals};
use nalgebra::{DMatrix, DVector};

/// The variance of the noise follows from what the known numbers explain, and that from the variance.
const ROUNDS: usize = 10;
/// A known number is not farther off than so many standard uncertainties by chance.
const FAR: f64 = 4.0;

/// What the known numbers do to the unknowns, on their scales.
pub(crate) struct InputErrors<'a> {
    pub knowns: &'a [Known],
    /// Of every known number, the value that its experiments share, if they do.
    pub values: Vec<Option<f64>>,
    pub correlations: DMatrix<f64>,
    /// Answers of every unknown to one standard uncertainty of every known number.
    answers: Vec<Vec<Option<f64>>>,
    /// What one standard uncertainty of each leaves in the weighted residuals, whatever the unknowns do.
    unfollowed: DMatrix<f64>,
}

impl<'a> InputErrors<'a> {
    /// By the sensitivities to the known numbers.
    pub fn of(knowns: &'a [Known], sensitivities: &InputSensitivities) -> Result<Self, Error> {
        let values = sensitivities.known_values();
        let answers = sensitivities.known_responses().to_vec();
        let unfollowed = sensitivities.known_unfollowed();
        Ok(Self { knowns, values, correlations: correlations(knowns)?, answers, unfollowed })
    }

    /// No known numbers at all.
    pub fn none() -> Self {
        Self {
            knowns: &[],
            values: Vec::new(),
            correlations: DMatrix::zeros(0, 0),
            answers: Vec::new(),
            unfollowed: DMatrix::zeros(0, 0),
        }
    }

    /// Answers of an unknown to one standard uncertainty of each.
    pub fn of_unknown(&self, j: usize) -> DVector<f64> {
        let answers = self.answers.iter().map(|answers| answers[j].unwrap_or(0.0));
        DVector::from_iterator(self.knowns.len(), answers)
    }

    /// Variance of an unknown, on its scale, by all of them.
    pub fn variance(&self, j: usize) -> f64 {
        let by = self.of_unknown(j);
        by.dot(&(&self.correlations * &by)).max(0.0)
    }

    /// How far off, in their standard uncertainties, the residuals at an optimum say that the known numbers are: no
    /// farther than it takes, as their uncertainties count as those of the data do.
    fn off(&self, left: &DVector<f64>, noise: &Noise) -> DVector<f64> {
        let k = self.knowns.len();
        let (square, along) =
            (self.unfollowed.tr_mul(&self.unfollowed), self.unfollowed.tr_mul(left));
        let mut off = DVector::zeros(k);
        let mut variance = noise.variance;
        for _ in 0..ROUNDS {
            // R (A R + 1)^-1, which is (A + R^-1)^-1 where R has an inverse, and is there where it has none.
            let system = &square * &self.correlations / variance + DMatrix::identity(k, k);
            let Some(solved) = system.lu().solve(&(&along / -variance)) else { break };
            off = &self.correlations * solved;
            let Some(freedom) = noise.freedom.filter(|_| noise.is_estimated) else { break };
            variance = (left + &self.unfollowed * &off).norm_squared() / freedom;
        }
        off
    }

    /// The optimum with the residuals that would be left if the known numbers were what the data say that they are
    /// within their uncertainties: what they explain is no noise, and no fault of the model. Numbers that would have to be
    /// farther off than chance has them are a warning, and explain nothing.
    pub fn without_explained(
        &self,
        fitted: Fitted,
        noise: &Noise,
        warnings: &mut Warnings,
    ) -> Option<Optimum> {
        let Fitted { search, optimum } = fitted;
        if self.knowns.is_empty() || search.is_rounding(optimum) || !noise.variance.is_normal() {
            return None;
        }
        let off = self.off(&weighted_residuals(fitted, noise), noise);
        let farthest = off.iter().enumerate().max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()));
        if let Some((i, far)) = farthest.filter(|(_, off)| off.abs() > FAR) {
            let words = format!(
                "the data contradict the stated {} by {:.1} standard uncertainties ({:+.1e} {}). Its value is \
                 wrong, or the model lacks a similar effect. Measure it again",
                self.knowns[i].label(),
                far.abs(),
                far * self.knowns[i].sigma,
                self.knowns[i].parameter.unit()
            );
            warnings.add(Severity::Misfit, Code::InconsistentInput, words);
            return None;
        }
        let explained = &self.unfollowed * off;
        let mut optimum = optimum.clone();
        let told = explained.iter().zip(&noise.weights).filter(|(_, weight)| **weight > 0.0);
        optimum.residuals.iter_mut().zip(told).for_each(|(r, (by, weight))| *r += by / weight);
        Some(optimum)
    }
}
