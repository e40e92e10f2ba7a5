//! What the data can tell locally, and how well: singular values, covariance, intervals.

use crate::error::Error;
use crate::fit::uncertainty::covariance::combinations::{Combination, determined};
use crate::fit::uncertainty::covariance::identifiability::{
    NonIdentifiability, SUSPICIOUS, UnidentifiableDirection, findings, sparsest, without_effect,
};
use crate::fit::uncertainty::covariance::zero_bound::Bound;
use crate::fit::unknown::Unknown;
use faer::Mat;
use nalgebra::{DMatrix, SymmetricEigen};

/// A singular value of the column-scaled Jacobian below this part of the largest says that some
/// combination of the unknowns has no effect. Sensitivities are accurate to about 1e-9.
const STRUCTURAL: f64 = 1e-7;
/// A standard deviation of more than this on the unknown's scale (a factor of e for logarithms)
/// is not an identification.
const PRACTICAL_LOG: f64 = 1.0;
/// The same for unknowns that are not logarithms: a quarter of beta's or Poisson's range.
const PRACTICAL_LINEAR: f64 = 0.25;

/// The unknowns that the data determine, and the weights of the residuals.
pub(crate) struct LinearFit {
    pub identified: Vec<bool>,
    pub weights: Vec<f64>,
}

/// The local analysis of a fit.
#[derive(Clone, Debug)]
pub(crate) struct Covariance {
    /// Standard deviation of each unknown on its scale; `None` when not identifiable.
    pub deviation: Vec<Option<f64>>,
    /// Correlation of the identifiable ones.
    pub correlation: Vec<Vec<Option<f64>>>,
    /// What cannot be identified.
    pub findings: Vec<UnidentifiableDirection>,
    /// Combinations of unknowns that are identifiable where the unknowns are not.
    pub combinations: Vec<Combination>,
    /// Singular values of the Jacobian with columns scaled to length one, of the unknowns that
    /// have an effect; descending.
    pub singular_values: Vec<f64>,
    /// Inverse of the normal matrix, along the directions the data see.
    inverse: Vec<Vec<f64>>,
    /// Covariance over the variance of the noise: the same, where the noise is white.
    spread: Vec<Vec<f64>>,
    /// Variance of the noise.
    variance: f64,
    /// Unknowns that are bounded from one side, away from where their logarithm has no effect.
    bounded: Vec<bool>,
}

impl Covariance {
    /// From the rows of the Jacobian on the unknowns' scales, residuals in units of the noise, and
    /// the variance of that noise (1 when sigma is known). `effect` is the size of the observed
    /// motion in the same units: an unknown, unless it is known to be `vanishing`, needs a billionth of it to have an effect.
    /// `scatter` is that of the gradient over that variance, where it is not the normal matrix.
    /// `rise(step)` is the rise of the sum of squares by a step from the optimum, over the one that
    /// ends a 95 % interval.
    pub fn new(
        unknowns: &[Unknown],
        vanishing: &[Option<Bound>],
        rows: &[Vec<f64>],
        variance: f64,
        effect: f64,
        scatter: Option<&DMatrix<f64>>,
        mut rise: impl FnMut(&[f64]) -> f64,
    ) -> Result<Self, Error> {
        let n = unknowns.len();
        let norm = |j: usize| rows.iter().map(|row| row[j] * row[j]).sum::<f64>().sqrt();
        let norms: Vec<f64> = (0..n).map(norm).collect();
        let vanishing = |j: usize| vanishing.get(j).copied().flatten();
        let zero = |j: usize| vanishing(j).is_some_and(|v| v.is_one_sided());
        // A parameter without effect is out before the columns are scaled. The logarithm of one that vanishes has none, but
        // the parameter has, and the others are known no better for where on the way to zero the search has ended.
        let active: Vec<usize> =
            (0..n).filter(|j| norms[*j] > if zero(*j) { 0.0 } else { 1e-9 * effect }).collect();
        let out = (0..n).filter(|j| !active.contains(j) && !zero(*j));
        let mut local = Self {
            deviation: vec![None; n],
            correlation: vec![vec![None; n]; n],
            findings: out.map(|j| without_effect(&unknowns[j], active.is_empty())).collect(),
            combinations: Vec::new(),
            singular_values: Vec::new(),
            inverse: vec![vec![0.0; n]; n],
            spread: vec![vec![0.0; n]; n],
            variance,
            bounded: (0..n).map(|j| vanishing(j).is_some_and(|v| v.is_away_from_zero())).collect(),
        };
        if active.is_empty() {
            return Ok(local);
        }
        let scaled = Mat::from_fn(rows.len().max(active.len()), active.len(), |i, j| {
            rows.get(i).map_or(0.0, |row| row[active[j]] / norms[active[j]])
        });
        let svd = scaled.thin_svd().map_err(|error| {
            Error::Fit(format!("the singular values of the Jacobian cannot be computed: {error:?}"))
        })?;
        let (values, v) = (svd.S().column_vector(), svd.V());
        local.singular_values = (0..active.len()).map(|k| values[k]).collect();
        // Changes of the unknowns that change the residuals by one singular value.
        let direction = |k: usize| -> Vec<f64> {
            let mut all = vec![0.0; n];
            active.iter().enumerate().for_each(|(a, j)| all[*j] = v[(a, k)] / norms[*j]);
            all
        };
        let limit = |j: usize| match (vanishing(j), unknowns[j].parameter.is_positive()) {
            // It is not an identification, and no direction with it is to blame.
            (Some(vanishing), _) => 20.0 * vanishing.log_deviation,
            (None, true) => PRACTICAL_LOG,
            (None, false) => PRACTICAL_LINEAR,
        };
        let mut unseen = Vec::new();
        for k in 0..active.len() {
            let direction = direction(k);
            if values[k] <= STRUCTURAL * values[0] {
                unseen.push(direction);
                continue;
            }
            for (a, b) in (0..n).flat_map(|a| (0..n).map(move |b| (a, b))) {
                local.inverse[a][b] += direction[a] * direction[b] / (values[k] * values[k]);
            }
        }
        local.spread = match scatter {
            None => local.inverse.clone(),
            Some(scatter) => between(&local.inverse, scatter),
        };
        // Principal axes of the covariance in units of what is still an identification.
        let scaled =
            DMatrix::from_fn(n, n, |a, b| variance * local.spread[a][b] / (limit(a) * limit(b)));
        let axes = SymmetricEigen::new(scaled);
        let mut hidden = Vec::new();
        for (axis, value) in axes.eigenvectors.column_iter().zip(&axes.eigenvalues) {
            let size = axis.amax();
            let far = |side: f64| -> Vec<f64> {
                (0..n).map(|j| side * axis[j] * limit(j) / size).collect()
            };
            let deviation = value.max(0.0).sqrt() * size;
            let doubtful = deviation > SUSPICIOUS;
            if deviation > 1.0 || doubtful && [1.0, -1.0].iter().any(|s| rise(&far(*s)) < 1.0) {
                hidden.push(far(1.0));
            }
        }
        let deviation = |j: usize| (variance * local.spread[j][j]).sqrt();
        let (unseen, hidden) = sparsest(unseen, hidden);
        let named = |j: usize| unseen.iter().chain(&hidden).any(|along| along[j] != 0.0);
        let mut refused: Vec<bool> = (0..n).map(named).collect();
        let directions: Vec<&Vec<f64>> = unseen.iter().chain(&hidden).collect();
        for exponents in determined(unknowns, &directions) {
            let deviation = local.variance_of(&exponents).sqrt();
            if deviation < PRACTICAL_LOG {
                local.combinations.push(Combination { exponents, deviation });
            }
        }
        let structural = findings(unknowns, unseen, NonIdentifiability::Structural, deviation);
        let mut practical = findings(unknowns, hidden, NonIdentifiability::Practical, deviation);
        for j in active.iter().copied().filter(|j| deviation(*j) > limit(*j)) {
            // No single direction is to blame.
            if !refused[j] {
                let mut alone = vec![0.0; n];
                alone[j] = 1.0;
                practical.extend(findings(
                    unknowns,
                    vec![alone],
                    NonIdentifiability::Practical,
                    deviation,
                ));
            }
            refused[j] = true;
        }
        let seen = active.iter().copied().filter(|j| !refused[*j] && !zero(*j));
        for j in seen.clone() {
            local.deviation[j] = Some(deviation(j));
        }
        for (a, b) in seen.clone().flat_map(|a| seen.clone().map(move |b| (a, b))) {
            let product = local.spread[a][a] * local.spread[b][b];
            if product > 0.0 {
                let value = if a == b { 1.0 } else { local.spread[a][b] / product.sqrt() };
                local.correlation[a][b] = Some(value);
            }
        }
        local.findings.extend(structural);
        local.findings.extend(practical);
        Ok(local)
    }

    /// One unknown of each identifiable combination: with it held, the others are determined.
    pub fn held_unknowns(&self) -> Vec<usize> {
        let last = |c: &Combination| c.powers().map(|(j, _)| j).last();
        let mut held: Vec<usize> = self.combinations.iter().filter_map(last).collect();
        held.sort_unstable();
        held.dedup();
        held
    }

    /// Variance of the sum of the unknowns, on their scales, with these factors.
    fn variance_of(&self, factors: &[f64]) -> f64 {
        let rows = self.spread.iter().zip(factors);
        let product = |row: &Vec<f64>| row.iter().zip(factors).map(|(c, v)| c * v).sum::<f64>();
        self.variance * rows.map(|(row, v)| v * product(row)).sum::<f64>()
    }

    /// How the unknowns that are identifiable, bounded from one side, or part of an identifiable combination answer, on their scales, when the residuals
    /// change by `change` for a reason of its own: `-(J'J)^-1 J' change`.
    pub fn response(&self, rows: &[Vec<f64>], change: &[f64]) -> Vec<Option<f64>> {
        let n = self.inverse.len();
        let gradient = |j: usize| rows.iter().zip(change).map(|(row, c)| row[j] * c).sum::<f64>();
        let gradient: Vec<f64> = (0..n).map(gradient).collect();
        let answer = |j: usize| -> f64 {
            -self.inverse[j].iter().zip(&gradient).map(|(c, g)| c * g).sum::<f64>()
        };
        let is_combined = |j: usize| self.combinations.iter().any(|c| c.exponents[j] != 0.0);
        let answers = |j: usize| self.deviation[j].is_some() || self.bounded[j] || is_combined(j);
        (0..n).map(|j| answers(j).then(|| answer(j))).collect()
    }

    /// Variance, by the errors of the identifiable unknowns, of a quantity with these derivatives.
    pub fn variance_along(&self, row: &[f64]) -> f64 {
        let n = self.inverse.len();
        let known = (0..n).filter(|j| self.deviation[*j].is_some());
        let pairs = known.clone().flat_map(|a| known.clone().map(move |b| (a, b)));
        self.variance * pairs.map(|(a, b)| row[a] * self.spread[a][b] * row[b]).sum::<f64>()
    }
}

/// `inverse scatter inverse`.
fn between(inverse: &[Vec<f64>], scatter: &DMatrix<f64>) -> Vec<Vec<f64>> {
    let n = inverse.len();
    let inverse = DMatrix::from_fn(n, n, |a, b| inverse[a][b]);
    let product = &inverse * scatter * &inverse;
    (0..n).map(|a| (0..n).map(|b| product[(a, b)]).collect()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Parameter;
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
        let found =
            Covariance::new(&unknowns(), &[], &rows, 1e-4, 1.0, None, |_| f64::MAX).unwrap();
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
        let found =
            Covariance::new(&unknowns(), &[], &rows, 1e-4, 1.0, None, |_| f64::MAX).unwrap();
        assert_eq!(found.deviation[..2], [None, None]);
        assert!(found.deviation[2].is_some());
        assert!(
            found.findings[0].description.contains("youngs_modulus/density"),
            "{:?}",
            found.findings
        );
    }

    #[test]
    fn no_effect_and_no_information_are_told_apart() {
        let rows: Vec<Vec<f64>> = (0..9).map(|i| vec![0.0, (i as f64).cos(), 1e-3]).collect();
        let found = Covariance::new(&unknowns(), &[], &rows, 1.0, 1.0, None, |_| f64::MAX).unwrap();
        assert!(found.findings[0].description.contains("youngs_modulus has no effect"));
        assert!(found.findings[1].description.contains("beta is practically not identifiable"));
        assert!(found.deviation[1].is_some());
    }

    /// However far on the way to zero the search has followed a number, the others are known as well as beside it.
    #[test]
    fn what_vanishes_leaves_the_errors_of_the_others() {
        let found = |part: f64| {
            let row = |i: usize| {
                let (s, c) = ((i as f64).sin(), (2.0 * i as f64).cos());
                vec![s, part * (s + 0.5 * c), (3.0 * i as f64).cos()]
            };
            let rows: Vec<Vec<f64>> = (0..20).map(row).collect();
            let vanishing =
                Bound { value: part, lower95: None, upper95: Some(1.0), log_deviation: 0.1 / part };
            let vanishing = [None, Some(vanishing), None];
            Covariance::new(&unknowns(), &vanishing, &rows, 1e-4, 1.0, None, |_| f64::MAX).unwrap()
        };
        let (near, far) = (found(1e-3), found(1e-14));
        for j in [0, 2] {
            assert_relative_eq!(
                near.deviation[j].unwrap(),
                far.deviation[j].unwrap(),
                max_relative = 1e-9
            );
        }
        assert!(far.findings.is_empty() && far.deviation[1].is_none());
    }

    /// Well determined here, but the misfit is flat as far as it matters.
    #[test]
    fn a_flat_valley_is_not_an_identification() {
        let rows: Vec<Vec<f64>> = (0..20)
            .map(|i| {
                let (s, c) = ((i as f64).sin(), (2.0 * i as f64).cos());
                vec![s, 2.0 * s + 0.1 * c, (3.0 * i as f64).cos()]
            })
            .collect();
        let steep = Covariance::new(&unknowns(), &[], &rows, 2e-3, 1.0, None, |_| 5.0).unwrap();
        assert!(steep.findings.is_empty() && steep.deviation.iter().all(Option::is_some));
        let flat = Covariance::new(&unknowns(), &[], &rows, 2e-3, 1.0, None, |step| {
            if step[0] > 0.0 { 0.5 } else { 50.0 }
        });
        let flat = flat.unwrap();
        assert!(flat.findings[0].description.contains("practically not identifiable"), "{flat:?}");
        assert_eq!(flat.deviation[0], None);
    }
}
