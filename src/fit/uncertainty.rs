//! What the data can tell, and how well: singular values, covariance, intervals.

use super::Unknown;
use crate::error::Error;
use faer::Mat;
use statrs::distribution::{ContinuousCDF, Normal, StudentsT};

/// A singular value of the column-scaled Jacobian below this part of the largest says that some
/// combination of the unknowns has no effect. Sensitivities are accurate to about 1e-9.
const STRUCTURAL: f64 = 1e-7;
/// Unknowns with less than this share in such a combination are not part of it.
const SHARE: f64 = 0.05;
/// A standard deviation of more than this on the unknown's scale (a factor of e for logarithms)
/// is not an identification.
const PRACTICAL_LOG: f64 = 1.0;
/// The same for unknowns that are not logarithms: a quarter of beta's or Poisson's range.
const PRACTICAL_LINEAR: f64 = 0.25;

/// The local analysis of a fit.
#[derive(Clone, Debug)]
pub(super) struct Uncertainty {
    /// Standard deviation of each unknown on its scale; `None` when not identifiable.
    pub deviation: Vec<Option<f64>>,
    /// Correlation of the identifiable ones.
    pub correlation: Vec<Vec<Option<f64>>>,
    /// What cannot be identified, in words.
    pub findings: Vec<String>,
}

impl Uncertainty {
    /// From the rows of the Jacobian on the unknowns' scales, residuals in units of the noise, and
    /// the variance of that noise (1 when sigma is known).
    pub fn new(
        unknowns: &[Unknown],
        rows: &[Vec<f64>],
        variance: f64,
        effect: f64,
    ) -> Result<Self, Error> {
        let n = unknowns.len();
        let norm = |j: usize| rows.iter().map(|row| row[j] * row[j]).sum::<f64>().sqrt();
        let norms: Vec<f64> = (0..n).map(norm).collect();
        let mut findings = Vec::new();
        // A parameter without effect is out before the columns are scaled.
        let active: Vec<usize> = (0..n).filter(|j| norms[*j] > 1e-9 * effect).collect();
        for j in (0..n).filter(|j| !active.contains(j)) {
            findings
                .push(format!("{} has no effect on the observed motion", unknowns[j].parameter));
        }
        let mut deviation = vec![None; n];
        let mut correlation = vec![vec![None; n]; n];
        if active.is_empty() {
            return Ok(Self { deviation, correlation, findings });
        }
        let scaled = Mat::from_fn(rows.len().max(active.len()), active.len(), |i, j| {
            rows.get(i).map_or(0.0, |row| row[active[j]] / norms[active[j]])
        });
        let svd = scaled.thin_svd().map_err(|error| {
            Error::Fit(format!("the singular values of the Jacobian cannot be computed: {error:?}"))
        })?;
        let (values, v) = (svd.S().column_vector(), svd.V());
        let kept = |k: usize| values[k] > STRUCTURAL * values[0];
        let mut structural = vec![false; active.len()];
        for k in (0..active.len()).filter(|k| !kept(*k)) {
            let share: Vec<f64> = (0..active.len()).map(|j| v[(j, k)] / norms[active[j]]).collect();
            let largest = share.iter().fold(0.0_f64, |m, s| m.max(s.abs()));
            let part: Vec<usize> =
                (0..active.len()).filter(|j| share[*j].abs() > SHARE * largest).collect();
            part.iter().for_each(|j| structural[*j] = true);
            let combination: Vec<(&Unknown, f64)> =
                part.iter().map(|j| (&unknowns[active[*j]], share[*j] / largest)).collect();
            findings.push(in_words(&combination));
        }
        // Covariance on the scales of the unknowns, over the directions the data see.
        let covariance = |a: usize, b: usize| -> f64 {
            let sum: f64 = (0..active.len())
                .filter(|k| kept(*k))
                .map(|k| v[(a, k)] * v[(b, k)] / (values[k] * values[k]))
                .sum();
            sum * variance / (norms[active[a]] * norms[active[b]])
        };
        for a in (0..active.len()).filter(|a| !structural[*a]) {
            let unknown = &unknowns[active[a]];
            let sd = covariance(a, a).sqrt();
            let limit =
                if unknown.parameter.is_positive() { PRACTICAL_LOG } else { PRACTICAL_LINEAR };
            if sd > limit {
                findings.push(format!(
                    "{} is practically not identifiable from these data: its standard deviation is {}",
                    unknown.parameter,
                    if unknown.parameter.is_positive() {
                        format!("a factor of {:.1}", sd.exp())
                    } else {
                        format!("{sd:.2}")
                    }
                ));
                continue;
            }
            deviation[active[a]] = Some(sd);
        }
        for a in 0..active.len() {
            for b in 0..active.len() {
                if let (Some(sa), Some(sb)) = (deviation[active[a]], deviation[active[b]])
                    && sa > 0.0
                    && sb > 0.0
                {
                    let value = if a == b { 1.0 } else { covariance(a, b) / (sa * sb) };
                    correlation[active[a]][active[b]] = Some(value);
                }
            }
        }
        Ok(Self { deviation, correlation, findings })
    }
}

/// Says which combination has no effect, and, for two logarithms, what alone enters.
fn in_words(combination: &[(&Unknown, f64)]) -> String {
    match combination {
        [(one, _)] => format!("{} has no effect on the observed motion", one.parameter),
        [(one, a), (two, b)] if one.parameter.is_positive() && two.parameter.is_positive() => {
            // Along (a, b) nothing changes: one^b / two^a is all the data see.
            let (p, q) = (b / b.abs().max(a.abs()), -a / b.abs().max(a.abs()));
            let (p, q) = if p < 0.0 { (-p, -q) } else { (p, q) };
            format!(
                "{} and {} enter only as {}; neither can be identified without the other",
                one.parameter,
                two.parameter,
                power_product(&[(one.parameter.name(), p), (two.parameter.name(), q)])
            )
        }
        many => {
            let parts: Vec<String> =
                many.iter().map(|(u, a)| format!("{a:+.3} {}", u.parameter)).collect();
            format!(
                "the data do not change along the combination {} (logarithms of positive parameters)",
                parts.join(" ")
            )
        }
    }
}

/// `a^p b^q` with exponents rounded to what the singular vectors are good for.
fn power_product(factors: &[(&str, f64)]) -> String {
    let power = |name: &str, p: f64| {
        let p = (p.abs() * 1e3).round() / 1e3;
        if p == 1.0 { name.to_string() } else { format!("{name}^{p}") }
    };
    let join = |positive: bool| {
        let chosen = factors.iter().filter(|(_, p)| (*p > 0.0) == positive && p.abs() > 5e-4);
        chosen.map(|(name, p)| power(name, *p)).collect::<Vec<_>>().join("*")
    };
    match (join(true), join(false)) {
        (over, under) if under.is_empty() => over,
        (over, under) => format!("{over}/{under}"),
    }
}

/// How many standard deviations a 95 % interval reaches to each side: normal when the noise is
/// known, Student's t when it was estimated with `freedom` degrees of freedom.
pub(super) fn quantile95(freedom: Option<f64>) -> f64 {
    let normal = || Normal::standard().inverse_cdf(0.975);
    match freedom {
        None => normal(),
        Some(freedom) => {
            StudentsT::new(0.0, 1.0, freedom).map_or_else(|_| normal(), |t| t.inverse_cdf(0.975))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parameter::Parameter;
    use approx::assert_relative_eq;

    fn unknowns() -> Vec<Unknown> {
        vec![Parameter::YoungsModulus.into(), Parameter::Density.into(), Parameter::Beta.into()]
    }

    #[test]
    fn the_covariance_is_the_inverse_of_the_normal_matrix() {
        let rows: Vec<Vec<f64>> = (0..20)
            .map(|i| {
                (0..3).map(|j| ((i * (j + 2)) as f64 + 0.3).sin() * [1.0, 3.0, 0.5][j]).collect()
            })
            .collect();
        let found = Uncertainty::new(&unknowns(), &rows, 1e-4, 1.0).unwrap();
        let j = nalgebra::DMatrix::from_fn(20, 3, |i, k| rows[i][k]);
        let covariance = (j.transpose() * &j).try_inverse().unwrap() * 1e-4;
        for k in 0..3 {
            assert_relative_eq!(
                found.deviation[k].unwrap().powi(2),
                covariance[(k, k)],
                max_relative = 1e-12
            );
        }
        let expected = covariance[(0, 2)] / (covariance[(0, 0)] * covariance[(2, 2)]).sqrt();
        assert_relative_eq!(found.correlation[0][2].unwrap(), expected, max_relative = 1e-10);
    }

    #[test]
    fn a_ratio_is_named_and_the_rest_stays_identified() {
        // Columns one and two are opposite: only E/density matters.
        let rows: Vec<Vec<f64>> = (0..20)
            .map(|i| vec![(i as f64).sin(), -(i as f64).sin(), (2.0 * i as f64).cos()])
            .collect();
        let found = Uncertainty::new(&unknowns(), &rows, 1e-4, 1.0).unwrap();
        assert_eq!(found.deviation[..2], [None, None]);
        assert!(found.deviation[2].is_some());
        assert!(found.findings[0].contains("youngs_modulus/density"), "{:?}", found.findings);
    }

    #[test]
    fn no_effect_and_no_information_are_told_apart() {
        let rows: Vec<Vec<f64>> = (0..9).map(|i| vec![0.0, (i as f64).cos(), 1e-3]).collect();
        let found = Uncertainty::new(&unknowns(), &rows, 1.0, 1.0).unwrap();
        assert!(found.findings[0].contains("youngs_modulus has no effect"));
        assert!(found.findings[1].contains("beta is practically not identifiable"));
        assert!(found.deviation[1].is_some());
    }

    #[test]
    fn quantiles() {
        assert_relative_eq!(quantile95(None), 1.959963984540054, max_relative = 1e-9);
        assert_relative_eq!(quantile95(Some(10.0)), 2.228138851964939, max_relative = 1e-9);
    }
}
