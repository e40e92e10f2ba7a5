//! Intervals from how experiments differ.
//!
//! The interval of the residuals takes each of them for a draw of its own. What a model lacks is another
//! matter: it pushes all residuals of an experiment the same way, and another way in the next, so that
//! hundreds of values a recording tell hardly more than one number. The experiments are what is
//! independent. With `H` the Hessian of the misfit by Gauss and Newton and `g_c` the gradient of what
//! experiment `c` adds to it, the fit without that experiment would be, after one step,
//!
//! ```text
//! x_c = x + (H - H_c)^-1 g_c
//! ```
//!
//! and the variance of `x` is `(n - 1)/n` times the sum of `(x_c - x)(x_c - x)'` over all `n` experiments:
//! the jackknife, which is the cluster-robust sandwich that minds how much each experiment weighs. For
//! experiments that tell alike it is exact, with Student's t of `n - 1`. Where a few tell most of an unknown, only those
//! few are compared, and their steps are longer than what they leave uncertain. If every experiment's gradient varied as
//! its Hessian says, the steps would have the covariances
//!
//! ```text
//! M_cd = u_c' (H_c delta_cd - H_c (2/H - S/H^2) H_d) u_d,    S = sum H_c,
//! ```
//!
//! with `u_c` the unknown's row of `(H - H_c)^-1`. The variance is scaled so that it would then be the right one in the
//! mean, and has `(tr M)^2 / tr(M^2)` degrees of freedom (Bell and McCaffrey 2002), both exact for experiments that tell alike.
//! No simulation is needed.

use crate::fit::search::fitted::{Fitted, MeasuredResiduals};
use crate::fit::uncertainty::estimate::{ClusterJackknife, Estimate};
use crate::fit::uncertainty::noise::coverage_factor::quantile95;
use crate::fit::uncertainty::shifts::Shifts;
use crate::fit::unknown::Unknown;
use nalgebra::{DMatrix, DVector};

/// Experiments from which on their differences say something.
const FEWEST: usize = 5;

/// What an experiment adds to the misfit.
struct Part {
    gradient: DVector<f64>,
    hessian: DMatrix<f64>,
}

/// Standard deviations of the unknowns on their scales, each with its degrees of freedom; none where an experiment alone
/// tells one of them.
fn deviations(parts: &[Part], prior: DMatrix<f64>) -> Option<Vec<[f64; 2]>> {
    let k = prior.nrows();
    let whole = parts.iter().fold(prior, |sum, part| sum + &part.hessian);
    // The optimiser leaves a little of the gradient.
    let n = parts.len() as f64;
    let left = parts.iter().fold(DVector::zeros(k), |sum, part| sum + &part.gradient) / n;
    let mut variance = vec![0.0; k];
    // Of every part the inverse without it, and what its Hessian makes of that.
    let mut rows = Vec::with_capacity(parts.len());
    for part in parts {
        let inverse = (&whole - &part.hessian).cholesky()?.inverse();
        let step = &inverse * (&part.gradient - &left);
        variance.iter_mut().zip(step.iter()).for_each(|(v, s)| *v += s * s * (n - 1.0) / n);
        rows.push((&part.hessian * &inverse, inverse));
    }
    let told = parts.iter().fold(DMatrix::zeros(k, k), |sum, part| sum + &part.hessian);
    let inverse = whole.cholesky()?.inverse();
    let spread = &inverse * told * &inverse;
    let common = &inverse * 2.0 - &spread;
    let scaled = |(j, variance): (usize, f64)| {
        let (mut trace, mut square) = (0.0, 0.0);
        for (c, (told, inverse)) in rows.iter().enumerate() {
            let shared = &common * told.column(j);
            for (d, (other, _)) in rows.iter().enumerate() {
                let own = if c == d { inverse.column(j).dot(&told.column(j)) } else { 0.0 };
                let m = own - shared.dot(&other.column(j));
                trace += if c == d { m } else { 0.0 };
                square += m * m;
            }
        }
        let right = spread[(j, j)] * n / ((n - 1.0) * trace);
        // Rounding errors must not make more of them than there are differences.
        [(variance * right).sqrt(), (trace * trace / square).min(n - 1.0)]
    };
    Some(variance.into_iter().enumerate().map(scaled).collect())
}

/// What every experiment adds, of the unknowns `known`.
fn parts(fitted: Fitted, known: &[usize]) -> Vec<Part> {
    let k = known.len();
    let mut parts: Vec<(&str, Part)> = Vec::new();
    for MeasuredResiduals { experiment, measurement, residuals, rows, .. } in fitted.measured() {
        if parts.last().is_none_or(|(name, _)| *name != experiment.name) {
            let (gradient, hessian) = (DVector::zeros(k), DMatrix::zeros(k, k));
            parts.push((&experiment.name, Part { gradient, hessian }));
        }
        let Some((_, part)) = parts.last_mut() else { continue };
        for (row, r) in rows.zip(residuals) {
            let weight = fitted.search.leverage_weight(row);
            let [psi, slope] = measurement.loss().influence(weight * r);
            let derivatives = &fitted.optimum.jacobian[row];
            let by: Vec<f64> = known.iter().map(|j| weight * derivatives[*j]).collect();
            for a in 0..k {
                part.gradient[a] += psi * by[a];
                for b in 0..k {
                    part.hessian[(a, b)] += slope * by[a] * by[b];
                }
            }
        }
    }
    parts.into_iter().map(|(_, part)| part).collect()
}

/// The estimates with what the differences between the experiments say of them, as their intervals where
/// that is wider. Differences say nothing of what mesh and step do to all experiments alike: `shifts` correct the values,
/// and widen the intervals, as they do those of the residuals.
pub(crate) fn cluster_jackknife(
    estimates: Vec<Estimate>,
    fitted: Fitted,
    shifts: &Shifts,
) -> Vec<Estimate> {
    let Fitted { search, optimum } = fitted;
    let n = estimates.len();
    // Of what may be zero there is no logarithm to speak of.
    let told = |e: &Estimate| e.std_error.is_some() && e.upper95.is_none();
    let known: Vec<usize> = (0..n).filter(|j| told(&estimates[*j])).collect();
    if known.is_empty() || !optimum.converged || optimum.jacobian.len() < optimum.residuals.len() {
        return estimates;
    }
    let parts = parts(fitted, &known);
    if parts.len() < FEWEST {
        return estimates;
    }
    let mut prior = DMatrix::zeros(known.len(), known.len());
    for row in &optimum.jacobian[optimum.counts.iter().sum()..] {
        let by = DVector::from_iterator(known.len(), known.iter().map(|j| row[*j]));
        prior += &by * by.transpose();
    }
    let Some(found) = deviations(&parts, prior) else { return estimates };
    let deviation = |j: usize| known.iter().position(|k| *k == j).map(|place| found[place]);
    let with = |(j, (estimate, unknown)): (usize, (Estimate, &Unknown))| {
        let (Some([sd, freedom]), Some(residual_std_error), Some(residual_interval95)) =
            (deviation(j), estimate.std_error, estimate.interval95)
        else {
            return estimate;
        };
        let [low, high] = unknown.scaled_bounds();
        let x = (optimum.x[j] + shifts.correction(j)).clamp(low, high);
        let [low, high] = unknown.parameter.limits();
        let half = (quantile95(Some(freedom)) * sd).hypot(shifts.open(j));
        let interval95 = [x - half, x + half].map(|x| unknown.from_scale(x).clamp(low, high));
        let std_error = sd * unknown.slope(unknown.from_scale(x));
        let width = |[low, high]: [f64; 2]| high - low;
        let reported = width(interval95) > width(residual_interval95);
        let jackknife = ClusterJackknife {
            experiments: parts.len(),
            std_error,
            interval95,
            residual_std_error,
            residual_interval95,
            reported,
        };
        let estimate = Estimate { cluster_jackknife: Some(jackknife), ..estimate };
        match reported {
            true => {
                Estimate { std_error: Some(std_error), interval95: Some(interval95), ..estimate }
            }
            false => estimate,
        }
    };
    estimates.into_iter().zip(search.unknowns).enumerate().map(with).collect()
}

/// Whether the intervals of all estimates are at least as wide as those from the differences between experiments.
pub(crate) fn compares_experiments(estimates: &[Estimate]) -> bool {
    let mut own = estimates.iter().filter(|e| e.std_error.is_some()).peekable();
    own.peek().is_some() && own.all(|e| e.cluster_jackknife.is_some())
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    /// Of experiments that tell alike it is the standard error of the mean of what each says alone.
    #[test]
    fn of_equal_experiments_it_is_the_error_of_their_mean() {
        let alone = [1.0, 3.0, 2.5, 0.5, 4.0, 1.5];
        let mean = alone.iter().sum::<f64>() / 6.0;
        let part = |x: &f64| Part {
            gradient: DVector::from_element(1, 7.0 * (mean - x)),
            hessian: DMatrix::from_element(1, 1, 7.0),
        };
        let parts: Vec<Part> = alone.iter().map(part).collect();
        let [found, freedom] = deviations(&parts, DMatrix::zeros(1, 1)).unwrap()[0];
        let square = alone.iter().map(|x| (x - mean).powi(2)).sum::<f64>();
        assert_relative_eq!(found, (square / 30.0).sqrt(), max_relative = 1e-12);
        assert_relative_eq!(freedom, 5.0, max_relative = 1e-12);
    }

    /// Whatever the experiments' shares, the interval holds what it says or more, also where what differs is the
    /// unknown itself; with `n - 1` degrees of freedom it holds too little.
    #[test]
    fn intervals_of_unequal_experiments_hold() {
        let mut random = ChaCha8Rng::seed_from_u64(1);
        for shares in [[1.0; 8], [10.0, 10.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0]] {
            for power in [0.5, 1.0] {
                let (mut inside, mut naive) = (0, 0);
                for _ in 0..4000 {
                    let pushes = shares.map(|share: f64| {
                        let normal: f64 = StandardNormal.sample(&mut random);
                        normal * share.powf(power)
                    });
                    let x = pushes.iter().sum::<f64>() / shares.iter().sum::<f64>();
                    let part = |(share, push): (&f64, &f64)| Part {
                        gradient: DVector::from_element(1, push - share * x),
                        hessian: DMatrix::from_element(1, 1, *share),
                    };
                    let parts: Vec<Part> = shares.iter().zip(&pushes).map(part).collect();
                    let [sd, freedom] = deviations(&parts, DMatrix::zeros(1, 1)).unwrap()[0];
                    inside += usize::from(x.abs() <= quantile95(Some(freedom)) * sd);
                    naive += usize::from(x.abs() <= quantile95(Some(7.0)) * sd);
                }
                println!("{shares:?} {power}: {inside} {naive}");
                assert!((3750..=3960).contains(&inside), "{shares:?} {power}: {inside}");
                assert!(shares[0] == 1.0 || naive < 3700, "{naive}");
            }
        }
    }

    /// One that alone tells an unknown leaves nothing to compare.
    #[test]
    fn one_that_tells_alone_is_not_compared() {
        let part = |tells: bool| Part {
            gradient: DVector::zeros(2),
            hessian: DMatrix::from_diagonal(&DVector::from_vec(vec![1.0, f64::from(tells)])),
        };
        let parts: Vec<Part> = (0..6).map(|c| part(c == 2)).collect();
        assert!(deviations(&parts, DMatrix::zeros(2, 2)).is_none());
    }
}
