//! Cluster jackknife: uncertainty of the parameters from the differences between experiments.
//!
//! Intervals from the residuals take every residual for independent. An effect that the model lacks changes all
//! residuals of an experiment together, and differently in the next: only the experiments are independent. With the
//! Gauss-Newton Hessian `H` of the misfit, and the part `H_c` and the gradient `g_c` (about the mean of all) of
//! experiment `c`, the fit without it is, after one step,
//!
//! ```text
//! x_c = x + (H - H_c)^-1 g_c
//! ```
//!
//! and the variance of `x`, on the scales of the unknowns, is `(n - 1)/n` times the sum of `(x_c - x)(x_c - x)'` over
//! all `n` experiments. This jackknife is the cluster-robust sandwich with the leverage of each experiment. It is
//! exact for experiments with equal Hessians, with Student's t of `n - 1` degrees of freedom. Where few experiments
//! determine an unknown it is corrected. If the gradients had the covariances of their Hessians, the steps would have
//! the covariances
//!
//! ```text
//! M_cd = u_c' (H_c delta_cd - H_c (2/H - S/H^2) H_d) u_d,    S = sum H_c,
//! ```
//!
//! with the unknown's row `u_c` of `(H - H_c)^-1`. The variance is scaled to be unbiased in that case, and has `(tr
//! M)^2/tr(M^2)` degrees of freedom, at most `n - 1` (Bell and McCaffrey 2002). No simulation is needed. With
//! [`FEWEST`] experiments or more the interval, with the remaining discretization error, is added to each estimate with
//! a standard error and without an upper bound, in its unit. It replaces that by the residuals where it is wider.
//! Nothing is added without convergence, or where one experiment alone determines an unknown. [`add_cluster_jackknife`]
//! does this, and [`compares_experiments`] returns whether all estimates have a jackknife.

use crate::fit::search::fitted::{Fitted, MeasuredResiduals};
use crate::fit::uncertainty::discretization::bias::DiscretizationBias;
use crate::fit::uncertainty::estimate::{ClusterJackknife, Estimate, ExperimentEstimate};
use crate::fit::uncertainty::noise::coverage_factor::quantile95;
use nalgebra::{DMatrix, DVector};

/// Fewest experiments that are compared. Smaller: wider intervals, by Student's t of fewer degrees of freedom (2.8
/// standard errors for five experiments, 12.7 for two).
const FEWEST: usize = 5;

/// Largest step of an unknown on its scale from the common estimate to that of one experiment (a factor of 1.6 of a
/// positive parameter). A linear model has no meaning beyond.
const LARGEST_STEP: f64 = 0.5;

/// Gradient and Gauss-Newton Hessian of the misfit of one experiment.
struct ExperimentMisfit {
    /// Name of the experiment.
    name: String,
    /// By the determined unknowns on their scales.
    gradient: DVector<f64>,
    /// By the same unknowns.
    hessian: DMatrix<f64>,
}

impl ExperimentMisfit {
    /// The change of the unknowns on their scales to the optimum of this experiment alone, by one Gauss-Newton step;
    /// none if the experiment does not determine all of them, or a step exceeds [`LARGEST_STEP`].
    fn own_step(&self) -> Option<DVector<f64>> {
        let step = -self.hessian.clone().cholesky()?.solve(&self.gradient);
        step.iter().all(|x| x.abs() < LARGEST_STEP).then_some(step)
    }
}

/// Standard deviation of an unknown on its scale, with its degrees of freedom.
#[derive(Clone, Copy, Debug)]
struct JackknifeDeviation {
    value: f64,
    degrees_of_freedom: f64,
}

/// Standard deviations of all unknowns, on their scales (logarithms of positive parameters) and in their order, with
/// degrees of freedom. They are those of the jackknife over `experiments`, with gradients about their mean. The Hessian
/// of the `prior` belongs to no experiment. None where one experiment alone determines an unknown.
fn deviations(
    experiments: &[ExperimentMisfit],
    prior: DMatrix<f64>,
) -> Option<Vec<JackknifeDeviation>> {
    let k = prior.nrows();
    let data = experiments.iter().fold(DMatrix::zeros(k, k), |sum, own| sum + &own.hessian);
    let whole = experiments.iter().fold(prior, |sum, own| sum + &own.hessian);
    // The optimizer leaves a small gradient, which is no difference between experiments.
    let n = experiments.len() as f64;
    let mean = experiments.iter().fold(DVector::zeros(k), |sum, own| sum + &own.gradient) / n;
    let mut variance = vec![0.0; k];
    // (H - H_c)^-1 and H_c (H - H_c)^-1 of every experiment.
    let mut inverses = Vec::with_capacity(experiments.len());
    for own in experiments {
        let inverse = (&whole - &own.hessian).cholesky()?.inverse();
        let step = &inverse * (&own.gradient - &mean);
        variance.iter_mut().zip(step.iter()).for_each(|(v, s)| *v += s * s * (n - 1.0) / n);
        inverses.push((&own.hessian * &inverse, inverse));
    }
    // The expected variance and its degrees of freedom, if the gradients had the covariances of their Hessians.
    let inverse = whole.cholesky()?.inverse();
    let covariance = &inverse * data * &inverse;
    let common = &inverse * 2.0 - &covariance;
    let scaled = |(j, variance): (usize, f64)| {
        let (mut trace, mut square) = (0.0, 0.0);
        for (c, (product, inverse)) in inverses.iter().enumerate() {
            let shared = &common * product.column(j);
            for (d, (other, _)) in inverses.iter().enumerate() {
                let own = if c == d { inverse.column(j).dot(&product.column(j)) } else { 0.0 };
                let m = own - shared.dot(&other.column(j));
                trace += if c == d { m } else { 0.0 };
                square += m * m;
            }
        }
        // In that case the jackknife has the expectation (n - 1)/n tr M, and the linear model the variance
        // `covariance`.
        let scale = covariance[(j, j)] * n / ((n - 1.0) * trace);
        // Rounding errors could yield more than the n - 1 differences.
        let degrees_of_freedom = (trace * trace / square).min(n - 1.0);
        JackknifeDeviation { value: (variance * scale).sqrt(), degrees_of_freedom }
    };
    Some(variance.into_iter().enumerate().map(scaled).collect())
}

/// Gradients and Gauss-Newton Hessians of the misfit of all experiments with measurements, in their order, by the
/// `unknowns` with these indices, on their scales. They are the sums of `psi w j` and of `psi' w^2 j j'` over the rows
/// `j` of the Jacobian. Here `w` is the leverage weight, and `psi` the influence of the loss at the weighted residual.
fn experiment_misfits(fitted: Fitted, unknowns: &[usize]) -> Vec<ExperimentMisfit> {
    let k = unknowns.len();
    let mut experiments: Vec<ExperimentMisfit> = Vec::new();
    let mut last = None;
    for MeasuredResiduals { experiment, measurement, residuals, rows, .. } in fitted.measured() {
        if last.replace(&experiment.name) != Some(&experiment.name) {
            let (gradient, hessian) = (DVector::zeros(k), DMatrix::zeros(k, k));
            let name = experiment.name.clone();
            experiments.push(ExperimentMisfit { name, gradient, hessian });
        }
        let Some(ExperimentMisfit { gradient, hessian, .. }) = experiments.last_mut() else {
            continue;
        };
        // Robust losses and leverage weights enter as in the fit.
        for (row, r) in rows.zip(residuals) {
            let weight = fitted.search.leverage_weight(row);
            let [psi, slope] = measurement.loss().influence(weight * r);
            let derivatives = &fitted.optimum.jacobian[row];
            let by = DVector::from_fn(k, |a, _| weight * derivatives[unknowns[a]]);
            gradient.axpy(psi, &by, 1.0);
            hessian.ger(slope, &by, &by, 1.0);
        }
    }
    experiments
}

/// Sets the jackknife over experiments in the estimates with a standard error and without an upper bound. If its
/// interval is the wider one, it replaces standard error and interval of the estimate; those by the residuals are kept
/// in the jackknife. Experiments that determine all these unknowns alone also have estimates of their own. The
/// discretization error is common to all experiments: its `bias` corrects the values and widens the intervals. Nothing
/// is set for fewer than [`FEWEST`] experiments, without convergence, or where one experiment alone determines an
/// unknown.
pub(crate) fn add_cluster_jackknife(
    estimates: &mut [Estimate],
    fitted: Fitted,
    bias: &DiscretizationBias,
) {
    let Fitted { search, optimum } = fitted;
    // A parameter that may be zero has no standard deviation of its logarithm.
    let is_determined = |e: &Estimate| e.std_error.is_some() && e.upper95.is_none();
    let determined: Vec<usize> =
        (0..estimates.len()).filter(|j| is_determined(&estimates[*j])).collect();
    let has_all_rows = optimum.jacobian.len() >= optimum.residuals.len();
    if determined.is_empty() || !optimum.converged || !has_all_rows {
        return;
    }
    let experiments = experiment_misfits(fitted, &determined);
    if experiments.len() < FEWEST {
        return;
    }
    // Priors belong to no experiment.
    let mut prior = DMatrix::zeros(determined.len(), determined.len());
    for row in &optimum.jacobian[optimum.counts.iter().sum()..] {
        let by = DVector::from_iterator(determined.len(), determined.iter().map(|j| row[*j]));
        prior += &by * by.transpose();
    }
    let Some(found) = deviations(&experiments, prior) else { return };
    let steps: Vec<_> = experiments.iter().map(ExperimentMisfit::own_step).collect();
    // The wider of the two intervals is reported; the other one is kept beside it.
    for (k, (j, JackknifeDeviation { value: sd, degrees_of_freedom })) in
        determined.into_iter().zip(found).enumerate()
    {
        let (unknown, estimate) = (&search.unknowns[j], &mut estimates[j]);
        let (Some(residual_std_error), Some(residual_interval95)) =
            (estimate.std_error, estimate.interval95)
        else {
            continue;
        };
        let x = bias.corrected(unknown, j, optimum.x[j]);
        let half = (quantile95(Some(degrees_of_freedom)) * sd).hypot(bias.remaining(j));
        let [low, high] = unknown.parameter.limits();
        let interval95 = [x - half, x + half].map(|x| unknown.from_scale(x).clamp(low, high));
        let std_error = sd * unknown.slope(unknown.from_scale(x));
        let width = |[low, high]: [f64; 2]| high - low;
        let reported = width(interval95) > width(residual_interval95);
        estimate.cluster_jackknife = Some(ClusterJackknife {
            experiments: experiments.len(),
            std_error,
            interval95,
            residual_std_error,
            residual_interval95,
            reported,
            estimates: experiments
                .iter()
                .zip(&steps)
                .filter_map(|(own, step)| {
                    let value = unknown.from_scale(x + step.as_ref()?[k]);
                    Some(ExperimentEstimate { experiment: own.name.clone(), value })
                })
                .collect(),
        });
        if reported {
            (estimate.std_error, estimate.interval95) = (Some(std_error), Some(interval95));
        }
    }
}

/// Whether all estimates with a standard error have a cluster jackknife; false without any standard error.
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

    /// For experiments with equal Hessians it is the standard error of the mean of their separate estimates, with `n -
    /// 1` degrees of freedom.
    #[test]
    fn equal_experiments_have_the_standard_error_of_their_mean() {
        let alone = [1.0, 3.0, 2.5, 0.5, 4.0, 1.5];
        let mean = alone.iter().sum::<f64>() / 6.0;
        let part = |x: &f64| ExperimentMisfit {
            name: String::new(),
            gradient: DVector::from_element(1, 7.0 * (mean - x)),
            hessian: DMatrix::from_element(1, 1, 7.0),
        };
        let parts: Vec<ExperimentMisfit> = alone.iter().map(part).collect();
        let found = deviations(&parts, DMatrix::zeros(1, 1)).unwrap()[0];
        let square = alone.iter().map(|x| (x - mean).powi(2)).sum::<f64>();
        assert_relative_eq!(found.value, (square / 30.0).sqrt(), max_relative = 1e-12);
        assert_relative_eq!(found.degrees_of_freedom, 5.0, max_relative = 1e-12);
        // Of a quadratic misfit one step leads to the estimate of the experiment; too long steps have none.
        assert_relative_eq!(parts[2].own_step().unwrap()[0], 2.5 - mean, max_relative = 1e-12);
        assert!(parts[4].own_step().is_none());
    }

    /// Coverage of 95 % or more for any shares of the experiments in the Hessian, also where the unknown itself differs
    /// between experiments (power 1); with `n - 1` degrees of freedom unequal shares have too little.
    #[test]
    fn intervals_of_unequal_experiments_cover_at_least_95_percent() {
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
                    let part = |(share, push): (&f64, &f64)| ExperimentMisfit {
                        name: String::new(),
                        gradient: DVector::from_element(1, push - share * x),
                        hessian: DMatrix::from_element(1, 1, *share),
                    };
                    let parts: Vec<ExperimentMisfit> =
                        shares.iter().zip(&pushes).map(part).collect();
                    let JackknifeDeviation { value: sd, degrees_of_freedom } =
                        deviations(&parts, DMatrix::zeros(1, 1)).unwrap()[0];
                    inside += usize::from(x.abs() <= quantile95(Some(degrees_of_freedom)) * sd);
                    naive += usize::from(x.abs() <= quantile95(Some(7.0)) * sd);
                }
                println!("{shares:?} {power}: {inside} {naive}");
                assert!((3750..=3960).contains(&inside), "{shares:?} {power}: {inside}");
                assert!(shares[0] == 1.0 || naive < 3700, "{naive}");
            }
        }
    }

    /// The fit without the only experiment that determines an unknown is singular.
    #[test]
    fn experiment_that_alone_determines_an_unknown_has_no_jackknife() {
        let part = |determines: bool| ExperimentMisfit {
            name: String::new(),
            gradient: DVector::zeros(2),
            hessian: DMatrix::from_diagonal(&DVector::from_vec(vec![1.0, f64::from(determines)])),
        };
        let parts: Vec<ExperimentMisfit> = (0..6).map(|c| part(c == 2)).collect();
        assert!(deviations(&parts, DMatrix::zeros(2, 2)).is_none());
    }
}
