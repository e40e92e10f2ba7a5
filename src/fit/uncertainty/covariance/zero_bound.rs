//! One-sided bounds of dampings that are zero at the optimum, or not distinguishable from it. Dampings here are all
//! parameters that may be zero, such as a damping, a drag or a compliance.
//!
//! The search works on the logarithm, which has no effect near zero. Dampings whose logarithm has a standard deviation
//! above [`SUSPICIOUS`] (the relative standard error) are examined. On the scale of the parameter itself the misfit is
//! a parabola about an estimate `p` that may be negative, with the standard error `s`. With the one-sided 95 % quantile
//! `q` the upper bound is
//!
//! ```text
//! p + sqrt(min(p, 0)^2 + (q s)^2)
//! ```
//!
//! where the misfit has risen by `q^2` from its least value for a non-negative damping. `s` and `q` include the effect
//! of autocorrelated noise. One simulation there must show a rise of at least [`CONFIRMED`] of the predicted one, or
//! the entry is none. Estimates from [`DETECTED`] standard errors on keep a two-sided interval: their entry has no
//! upper bound. Estimates up to [`ZERO`] of the bound, and negative ones, are reported as 0. [`zero_bounds`] returns
//! one entry per unknown, in its unit, for the covariance. It is none for unknowns that are not examined or whose bound
//! is not confirmed, and for all without convergence or with a singular normal matrix. An entry ([`NearZeroEstimate`])
//! also holds one-sided bounds of other parameters, from `one_sided_bound`.

use crate::fit::misfit::residuals::Residuals;
use crate::fit::search::damping::may_vanish;
use crate::fit::search::fitted::Fitted;
use crate::fit::uncertainty::covariance::identifiability::SUSPICIOUS;
use crate::fit::uncertainty::noise::autocorrelation::NoiseModel;
use crate::fit::uncertainty::noise::residual_noise::{ResidualNoise, misfit_slopes};
use crate::numerics::{column_norms, half_sum_of_squares};
use nalgebra::{DMatrix, DVector};

/// Least rise of the misfit at the upper bound, over the one that the parabola predicts. Below it the parabola does not
/// hold, and there is no bound. Larger: fewer bounds of nonlinear models.
const CONFIRMED: f64 = 0.3;
/// Distance of an estimate from zero, in standard errors, from which on a damping has a two-sided interval: one that is
/// zero exceeds it once in 700 times.
const DETECTED: f64 = 3.0;
/// Standard deviation of a logarithm below which the logarithm counts as having an effect on the residuals at the
/// optimum.
const LARGEST_LOGARITHMIC: f64 = 3.0;
/// Part of the upper bound up to which an estimate is reported as zero.
const ZERO: f64 = 1e-3;

/// Estimate of an unknown with a one-sided bound, or one whose logarithm is not normally distributed. All in the
/// parameter's unit.
#[derive(Clone, Copy, Debug)]
pub(crate) struct NearZeroEstimate {
    /// The estimate, never negative.
    pub value: f64,
    /// One-sided 95 % lower bound of a parameter that the data do not bound from above.
    pub lower95: Option<f64>,
    /// One-sided 95 % upper bound of a parameter that may be zero.
    pub upper95: Option<f64>,
    /// Standard deviation of the logarithm at the optimum.
    pub log_deviation: f64,
}

impl NearZeroEstimate {
    /// Whether the data bound the parameter from one side only: there is a lower or an upper bound.
    pub fn is_one_sided(&self) -> bool {
        self.lower95.is_some() || self.upper95.is_some()
    }

    /// Whether there is an upper bound, and the logarithm has an effect at the optimum: its standard deviation is below
    /// [`LARGEST_LOGARITHMIC`].
    pub fn is_away_from_zero(&self) -> bool {
        self.upper95.is_some() && self.log_deviation < LARGEST_LOGARITHMIC
    }
}

/// Bounds of all dampings whose logarithm has a standard deviation above [`SUSPICIOUS`], one entry per unknown. That
/// standard deviation is the relative standard error, with all other unknowns fitted and the inflation by
/// autocorrelated noise. `rows` are those of the Jacobian, in units of the noise. One Gauss-Newton step gives the
/// vertex of the parabola, that is the estimate. `residuals` simulates the misfit at the upper bound once. From
/// [`DETECTED`] standard errors on an entry has no upper bound; an estimate up to [`ZERO`] of the bound, or a negative
/// one, is 0. None for other unknowns, for dampings of exactly 0 and for unconfirmed bounds; all none without
/// convergence or with a singular normal matrix.
pub(crate) fn zero_bounds(
    Fitted { search, optimum }: Fitted,
    rows: &[Vec<f64>],
    noise: &ResidualNoise,
    correlations: &NoiseModel,
    residuals: &Residuals,
) -> Vec<Option<NearZeroEstimate>> {
    let unknowns = search.unknowns;
    let n = unknowns.len();
    let mut found = vec![None; n];
    if !optimum.converged || !unknowns.iter().any(may_vanish) {
        return found;
    }
    // Columns are scaled to length one; those without effect are left out.
    let norms = column_norms(rows, n);
    let active: Vec<usize> = (0..n).filter(|j| norms[*j] > 0.0).collect();
    let columns =
        DMatrix::from_fn(rows.len(), active.len(), |i, a| rows[i][active[a]] / norms[active[a]]);
    let Some(factors) = columns.tr_mul(&columns).cholesky() else { return found };
    let inverse = factors.inverse();
    // Gauss-Newton step of all unknowns to the vertex of the parabola.
    let robust = noise.misfit_scale / noise.variance;
    let slopes = misfit_slopes(residuals, optimum);
    // Rows of weight zero, as unusable ones of a plan, have no slope.
    let slopes = slopes
        .iter()
        .zip(&noise.weights)
        .map(|(slope, w)| if *w > 0.0 { slope / (robust * w) } else { 0.0 });
    let slopes = DVector::from_iterator(optimum.residuals.len(), slopes);
    let step = -(&inverse * columns.tr_mul(&slopes.rows(0, rows.len())));

    // Each damping has its own parabola, with the other unknowns at their conditional optima.
    for (a, j) in active.iter().copied().enumerate().filter(|(_, j)| may_vanish(&unknowns[*j])) {
        let inflation = correlations.inflation[j];
        let quantile = correlations.one_sided_factor(j);
        let white = (noise.variance * inverse[(a, a)]).sqrt();
        let log_deviation = inflation * white / norms[j];
        let here = unknowns[j].from_scale(optimum.x[j]);
        if log_deviation <= SUSPICIOUS || here == 0.0 {
            continue;
        }
        // On the scale of the parameter a logarithmic step is relative.
        let deviation = here * log_deviation;
        let estimate = here + here * step[a] / norms[j];
        let below_zero = estimate.min(0.0);
        let upper95 = estimate + (below_zero * below_zero + (quantile * deviation).powi(2)).sqrt();
        // The misfit at the bound, with the other unknowns where the linear model predicts them, must confirm it.
        let mut x = optimum.x.clone();
        let change = (upper95 - here) / here * norms[j] / inverse[(a, a)];
        for (b, k) in active.iter().copied().enumerate().filter(|(_, k)| *k != j) {
            if !may_vanish(&unknowns[k]) {
                x[k] += change * inverse[(a, b)] / norms[k];
            }
        }
        x[j] = unknowns[j].to_scale(upper95);
        let rise = residuals.residuals(&x).map_or(f64::INFINITY, |r| {
            2.0 * (half_sum_of_squares(&r) - optimum.cost) / noise.misfit_scale
        });
        // The search may have ended at zero, short of the vertex.
        let to_vertex = ((estimate - here) / (deviation / inflation)).max(0.0);
        let rise = rise + to_vertex * to_vertex;
        let is_confirmed = rise.is_finite() && rise >= CONFIRMED * (quantile * inflation).powi(2);
        if upper95.is_finite() && is_confirmed {
            found[j] = Some(NearZeroEstimate {
                value: if estimate > ZERO * upper95 { estimate } else { 0.0 },
                lower95: None,
                upper95: (estimate < DETECTED * deviation).then_some(upper95),
                log_deviation,
            });
        }
    }
    found
}
