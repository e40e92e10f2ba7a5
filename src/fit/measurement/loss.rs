//! Robust losses, which down-weight outliers (M-estimation, Huber 1964 and 1981).
//!
//! A loss `rho` replaces the square of a residual `r` in units of the noise. Least squares on the robust residuals
//! `sign(r) sqrt(rho(r))` minimizes the sum of the losses, with any least-squares solver. [`Loss`] (squares, Huber,
//! soft L1, Cauchy) computes the loss (`rho`), half its first and second derivative (`influence`), the robust residual
//! (`robust`) and its inverse (`plain`). `spread` estimates the standard deviation of the noise of residuals: root mean
//! square, or by the median with a robust loss. `information` is that of the residuals relative to normal noise.
//! `scale` is the residual at which a loss departs from the square (infinite for squares); the scales are those of 95 %
//! efficiency: standard errors of normal data are 2.6 % larger. [`WeightedLoss`] multiplies the residual by a leverage
//! weight before the loss.

use serde::{Deserialize, Serialize};
use statrs::statistics::{Data, Median};

/// Factor from the median absolute value of a normal sample to its standard deviation: `1/Phi^-1(3/4)`.
const DEVIATION_OF_MEDIAN: f64 = 1.482602218505602;

/// Loss function of the residuals. Near zero all losses are quadratic.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum Loss {
    /// `r^2`: optimal for normal noise, sensitive to outliers.
    #[default]
    Squares,
    /// Linear beyond 1.345 sigma (Huber 1964).
    Huber,
    /// `2 c^2 (sqrt(1 + (r/c)^2) - 1)` with c = 1.29 sigma: a smooth Huber loss.
    SoftL1,
    /// `c^2 ln(1 + (r/c)^2)` with c = 2.385 sigma: distant outliers have almost no influence.
    Cauchy,
}

impl Loss {
    /// Residual at which the loss departs from the square, in units of the noise: 1.345 (Huber), 1.29 (soft L1), 2.385
    /// (Cauchy), infinite for squares.
    pub fn scale(self) -> f64 {
        match self {
            Self::Squares => f64::INFINITY,
            Self::Huber => 1.345,
            Self::SoftL1 => 1.29,
            Self::Cauchy => 2.385,
        }
    }

    /// Whether the loss down-weights outliers: all but squares.
    pub fn is_robust(self) -> bool {
        self != Self::Squares
    }

    /// The loss of a residual `r` in units of the noise. With the scale `c` it is `r^2` (squares; Huber up to `c`), `c
    /// (2 |r| - c)` (Huber beyond), `2 c^2 (sqrt(1 + (r/c)^2) - 1)` (soft L1) or `c^2 ln(1 + (r/c)^2)` (Cauchy).
    pub fn rho(self, r: f64) -> f64 {
        let c = self.scale();
        let square = r * r;
        let z = square / (c * c);
        match self {
            Self::Squares => square,
            Self::Huber if r.abs() <= c => square,
            Self::Huber => c * (2.0 * r.abs() - c),
            // Without the cancellation of sqrt(1 + z) - 1.
            Self::SoftL1 => square * 2.0 / ((z + 1.0).sqrt() + 1.0),
            Self::Cauchy => z.ln_1p() * (c * c),
        }
    }

    /// Half the first and half the second derivative of the loss (psi and psi') at the residual `r` in units of the
    /// noise: for squares `r` and 1.
    pub fn influence(self, r: f64) -> [f64; 2] {
        let c = self.scale();
        let z = (r / c).powi(2);
        match self {
            Self::Squares => [r, 1.0],
            Self::Huber => [r.clamp(-c, c), f64::from(u8::from(r.abs() <= c))],
            Self::SoftL1 => [r / (1.0 + z).sqrt(), (1.0 + z).powf(-1.5)],
            Self::Cauchy => [r / (1.0 + z), (1.0 - z) / (1.0 + z).powi(2)],
        }
    }

    /// The robust residual `sign(r) sqrt(rho(r))`, whose square is the loss of `r` in units of the noise, and its
    /// derivative by `r`: `psi(r)` (half the derivative of `rho`) over the robust residual, 1 at zero.
    pub fn robust(self, r: f64) -> [f64; 2] {
        if !self.is_robust() || r == 0.0 {
            return [r, 1.0];
        }
        // The derivative of sqrt(rho) is rho'/(2 sqrt(rho)), which is psi/sqrt(rho).
        let robust = self.rho(r).sqrt().copysign(r);
        [robust, self.influence(r)[0] / robust]
    }

    /// The residual, in units of the noise, whose [robust residual](Self::robust) is `robust`: the inverse function in
    /// closed form, with the same sign. Squares leave it unchanged.
    pub fn plain(self, robust: f64) -> f64 {
        let c = self.scale();
        let size = match self {
            Self::Squares => return robust,
            Self::Huber if robust.abs() <= c => return robust,
            Self::Huber => (robust * robust + c * c) / (2.0 * c),
            Self::SoftL1 => {
                // rho = 2 c^2 (sqrt(1 + z) - 1) has the inverse z = h (h + 2) with h = rho/(2 c^2).
                let half = robust * robust / (2.0 * c * c);
                c * (half * (half + 2.0)).sqrt()
            }
            Self::Cauchy => c * (robust / c).powi(2).exp_m1().sqrt(),
        };
        size.copysign(robust)
    }

    /// The standard deviation of the noise in these residuals, in their unit: the root mean square, or for a robust
    /// loss 1.4826 times the median of the absolute values, which outliers hardly change. Zero without residuals.
    pub fn spread(self, residuals: &[f64]) -> f64 {
        if residuals.is_empty() {
            return 0.0;
        }
        if !self.is_robust() {
            let mean = residuals.iter().map(|r| r * r).sum::<f64>() / residuals.len() as f64;
            return mean.sqrt();
        }
        let sizes: Vec<f64> = residuals.iter().map(|r| r.abs()).collect();
        DEVIATION_OF_MEDIAN * Data::new(sizes).median()
    }

    /// The factor on the information (inverse covariance of the fitted unknowns) of these residuals, in units of their
    /// noise, by this loss instead of squares and normal noise of variance 1. It is the inverse of the variance of an
    /// M-estimate (Huber 1981), `(mean psi')^2 f/(mean psi^2 K^2)`. With `n` residuals and `p` fitted `unknowns`, `f =
    /// (n - p)/n` (at least `1/n`) and `K = 1 + (p/n) var psi'/(mean psi')^2`. 1 for squares or without residuals, 0 if
    /// the mean psi' is not positive or all residuals are zero.
    pub fn information(self, residuals: &[f64], unknowns: usize) -> f64 {
        if !self.is_robust() || residuals.is_empty() {
            return 1.0;
        }
        let n = residuals.len() as f64;
        let mean = |part: &dyn Fn(f64) -> f64| residuals.iter().map(|r| part(*r)).sum::<f64>() / n;
        // Mean psi', mean psi^2 and the variance of psi' over the sample.
        let slope = mean(&|r| self.influence(r)[1]);
        let square = mean(&|r| self.influence(r)[0].powi(2));
        let scatter = mean(&|r| (self.influence(r)[1] - slope).powi(2));
        if slope <= 0.0 || square == 0.0 {
            return 0.0;
        }
        // Huber's correction for the fitted unknowns, and the lost degrees of freedom.
        let p = unknowns as f64;
        let correction = 1.0 + p / n * scatter / (slope * slope);
        let freedom = ((n - p) / n).max(1.0 / n);
        slope * slope / (square / freedom * correction * correction)
    }
}

/// Loss of one residual with its leverage weight: the loss is that of the weighted residual.
#[derive(Clone, Copy, Debug)]
pub(crate) struct WeightedLoss {
    pub loss: Loss,
    /// Factor on the residual.
    pub weight: f64,
}

impl WeightedLoss {
    /// The robust residual of the plain residual `r` times the weight, and its derivative by `r`.
    pub fn robust(self, r: f64) -> [f64; 2] {
        let [robust, slope] = self.loss.robust(self.weight * r);
        [robust, slope * self.weight]
    }

    /// The plain residual, without loss and weight, of a `robust` one: the inverse of [`robust`](Self::robust).
    pub fn plain(self, robust: f64) -> f64 {
        self.loss.plain(robust) / self.weight
    }

    /// Half the derivative of the weighted loss by the plain residual `r`: `w psi(w r)` with the weight `w`.
    pub fn influence(self, r: f64) -> f64 {
        self.weight * self.loss.influence(self.weight * r)[0]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    const ALL: [Loss; 4] = [Loss::Squares, Loss::Huber, Loss::SoftL1, Loss::Cauchy];

    /// Influences are the derivatives of the losses by fourth-order central differences; `plain` inverts `robust`.
    #[test]
    fn loss_derivatives_equal_differences_and_plain_inverts_robust() {
        for loss in ALL {
            for r in [-40.0_f64, -1.4, -0.3, 1e-6, 0.7, 1.3, 2.6, 1e3] {
                let h = 1e-3 * r.abs();
                let central = |f: &dyn Fn(f64) -> f64| {
                    (8.0 * (f(r + h) - f(r - h)) - f(r + 2.0 * h) + f(r - 2.0 * h)) / (12.0 * h)
                };
                let [psi, slope] = loss.influence(r);
                assert_relative_eq!(psi, 0.5 * central(&|r| loss.rho(r)), max_relative = 1e-9);
                let second = central(&|r| loss.influence(r)[0]);
                assert_relative_eq!(slope, second, max_relative = 1e-9, epsilon = 1e-12);
                let [robust, by_r] = loss.robust(r);
                assert_relative_eq!(robust * robust, loss.rho(r), max_relative = 1e-14);
                assert_relative_eq!(robust * by_r, psi, max_relative = 1e-14);
                assert_relative_eq!(loss.plain(robust), r, max_relative = 1e-9);
            }
        }
    }

    /// The scales of the losses are chosen for 95 % efficiency on normal noise.
    #[test]
    fn robust_losses_have_95_percent_efficiency_on_normal_noise() {
        let mut random = ChaCha8Rng::seed_from_u64(1);
        let r: Vec<f64> = (0..200_000).map(|_| StandardNormal.sample(&mut random)).collect();
        for loss in &ALL[1..] {
            assert_relative_eq!(loss.information(&r, 1), 0.95, epsilon = 6e-3);
            assert_relative_eq!(loss.spread(&r), 1.0, epsilon = 1e-2);
        }
    }
}
