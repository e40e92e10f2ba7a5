//! Covariance of the estimates by the Gauss-Newton approximation, with an analysis of identifiability.
//!
//! Input: the Jacobian `J` of the residuals by the unknowns on their scales (logarithms of positive parameters), in
//! units of the noise. A column whose norm is at most [`SMALLEST_EFFECT`] times the norm of the scales of the measured
//! values has no effect. Its unknown is a finding by itself, unless it has a one-sided bound. The other columns are
//! scaled to length one. Right singular vectors with singular values up to [`STRUCTURAL`] of the largest are
//! structurally unidentifiable directions; `(J'J)^-1` is formed without them (pseudoinverse). The covariance is
//! `v (J'J)^-1` for white noise of the variance `v`, and `v (J'J)^-1 M (J'J)^-1` for a gradient with the covariance
//! `v M`.
//!
//! Each unknown has a limit of its standard deviation: `practical_limit`, or with an entry of bounds [`BOUNDED_LIMIT`]
//! times the standard deviation of its logarithm. A principal axis of the covariance, in units of the limits, is
//! practically unidentifiable if one standard deviation along it moves an unknown beyond its limit. From [`SUSPICIOUS`]
//! of the limit on the misfit is computed at the limit, and the axis is unidentifiable if it is too flat there on
//! either side. An unknown whose own standard deviation exceeds its limit is a further direction.
//!
//! Output is a [`Covariance`]: standard deviations on these scales, correlations, unidentifiable directions with their
//! texts, and products of two unknowns that are identifiable although the unknowns are not. An unknown has no standard
//! deviation without effect, with a component in such a direction, or with a one-sided bound. Methods return the
//! response of the optimum to a change of the residuals, the variance of a linear function, and unknowns that a further
//! fit has to hold. Error: the singular value decomposition fails.
//!
//! [`LinearFit`] is the linear model of a fit for other modules, [`LinearResponse`] the response of an optimum.

use crate::error::Error;
use crate::fit::uncertainty::covariance::combinations::{Combination, constant_combinations};
use crate::fit::uncertainty::covariance::identifiability::{
    NonIdentifiability, PRACTICAL_LOG, SUSPICIOUS, UnidentifiableDirection, describe_directions,
    practical_limit, sparsest, without_effect,
};
use crate::fit::uncertainty::covariance::zero_bound::NearZeroEstimate;
use crate::fit::unknown::Unknown;
use crate::numerics::column_norms;
use faer::Mat;
use nalgebra::{DMatrix, DVector, SymmetricEigen};

/// Singular values of the column-scaled Jacobian up to this part of the largest are zero: the elements of the Jacobian
/// are accurate to about 1e-9.
const STRUCTURAL: f64 = 1e-7;
/// Part of the norm of the scales of all measured values up to which the effect of an unknown is a rounding error.
const SMALLEST_EFFECT: f64 = 1e-9;
/// Limit of the standard deviation of an unknown with an entry of bounds, over the standard deviation of its logarithm
/// in that entry. Well above 1: such an unknown makes no direction unidentifiable.
const BOUNDED_LIMIT: f64 = 20.0;

/// Linear model of a fit at its optimum: the unknowns that respond, and the weights of its residuals.
pub(crate) struct LinearFit {
    /// Whether each unknown responds to changes of the residuals.
    pub identified: Vec<bool>,
    /// Factor on every residual and its row of the Jacobian (robust loss and leverage), one per residual.
    pub weights: Vec<f64>,
}

/// Linear response of a fit to a change of its residuals.
pub(crate) struct LinearResponse {
    /// Changes of the unknowns on their scales, one per unknown; none for those that do not respond.
    pub unknowns: Vec<Option<f64>>,
    /// Changes of the unweighted residuals after the response: the given change plus that by the changed unknowns.
    pub residuals: Vec<f64>,
}

/// Covariance of the unknowns on their scales, and their identifiability.
#[derive(Clone, Debug)]
pub(crate) struct Covariance {
    /// Standard deviation of each unknown on its scale; none where it is not identifiable.
    pub deviation: Vec<Option<f64>>,
    /// Correlation matrix, one row and column per unknown; none where either unknown has no standard deviation.
    pub correlation: Vec<Vec<Option<f64>>>,
    /// Directions that are not identifiable.
    pub findings: Vec<UnidentifiableDirection>,
    /// Identifiable combinations of unknowns that are not identifiable separately.
    pub combinations: Vec<Combination>,
    /// Singular values of the Jacobian with columns scaled to length one, of the unknowns that
    /// have an effect; descending.
    pub singular_values: Vec<f64>,
    /// `(J'J)^-1` without structurally unidentifiable directions (pseudoinverse); rows and columns of unknowns without
    /// effect are zero.
    inverse: DMatrix<f64>,
    /// Covariance over the variance of the noise.
    unit_covariance: DMatrix<f64>,
    /// Variance of the noise.
    variance: f64,
    /// Whether each unknown has a one-sided upper bound and its logarithm an effect at the optimum
    /// ([`NearZeroEstimate::is_away_from_zero`]).
    has_bound: Vec<bool>,
}

impl Covariance {
    /// Covariance of the `unknowns` from the `rows` of the Jacobian by the unknowns on their scales (logarithms of
    /// positive parameters). Rows are in units of the noise, whose `variance` is 1 with a stated sigma. `bounds` are
    /// estimates of dampings near zero and one-sided bounds, one entry per unknown; empty: none. `motion` is the norm
    /// of the scales (such as the rod length) of all measured values, in the same units. `score_covariance` is the
    /// covariance of the gradient over `variance`; none: `J'J`. `rise` returns the rise of twice the misfit by a step
    /// of the unknowns from the optimum, divided by the rise at the end of a 95 % interval. Error: the singular value
    /// decomposition fails.
    ///
    /// A column of at most [`SMALLEST_EFFECT`] times `motion` is a finding by itself. Limits are `practical_limit`, or
    /// for an unknown with an entry of `bounds` [`BOUNDED_LIMIT`] times its `log_deviation`. A principal axis of the
    /// covariance is practically unidentifiable if one standard deviation along it moves an unknown beyond its limit.
    /// From [`SUSPICIOUS`] of the limit on it is so too if `rise` at the limit is below 1 on either side. Unknowns
    /// beyond their limit in no such axis are further findings. Unknowns in such directions, and those with a one-sided
    /// bound, have no deviation. Products that are constant along all of these directions become combinations, if the
    /// standard deviation of their logarithm is below [`PRACTICAL_LOG`].
    pub fn new(
        unknowns: &[Unknown],
        bounds: &[Option<NearZeroEstimate>],
        rows: &[Vec<f64>],
        variance: f64,
        motion: f64,
        score_covariance: Option<&DMatrix<f64>>,
        mut rise: impl FnMut(&[f64]) -> f64,
    ) -> Result<Self, Error> {
        let n = unknowns.len();
        let norms = column_norms(rows, n);
        let bound = |j: usize| bounds.get(j).copied().flatten();
        let is_one_sided = |j: usize| bound(j).is_some_and(|bound| bound.is_one_sided());
        // Unknowns without effect are left out before columns are scaled. The logarithm of a parameter near zero has no
        // effect, but the parameter has. The errors of the others must not depend on how near to zero the search has
        // ended.
        let least = |j: usize| if is_one_sided(j) { 0.0 } else { SMALLEST_EFFECT * motion };
        let active: Vec<usize> = (0..n).filter(|j| norms[*j] > least(*j)).collect();
        let inactive = (0..n).filter(|j| !active.contains(j) && !is_one_sided(*j));
        let mut found = Self {
            deviation: vec![None; n],
            correlation: vec![vec![None; n]; n],
            findings: inactive.map(|j| without_effect(&unknowns[j], active.is_empty())).collect(),
            combinations: Vec::new(),
            singular_values: Vec::new(),
            inverse: DMatrix::zeros(n, n),
            unit_covariance: DMatrix::zeros(n, n),
            variance,
            has_bound: (0..n).map(|j| bound(j).is_some_and(|b| b.is_away_from_zero())).collect(),
        };
        if active.is_empty() {
            return Ok(found);
        }
        // Columns of length one: singular values then do not depend on the units of the unknowns.
        // Rows of zeros fill a matrix with fewer rows than columns: the thin decomposition then has all right
        // singular vectors.
        let scaled = Mat::from_fn(rows.len().max(active.len()), active.len(), |i, j| {
            rows.get(i).map_or(0.0, |row| row[active[j]] / norms[active[j]])
        });
        let svd = scaled.thin_svd().map_err(|error| {
            Error::Fit(format!("the singular values of the Jacobian cannot be computed: {error:?}"))
        })?;
        let (values, v) = (svd.S().column_vector(), svd.V());
        found.singular_values = (0..active.len()).map(|k| values[k]).collect();

        // Structural analysis: right singular vectors, as changes of the unknowns, with and without an effect.
        let mut structural = Vec::new();
        for (k, value) in found.singular_values.iter().enumerate() {
            let mut direction = DVector::zeros(n);
            active.iter().enumerate().for_each(|(a, j)| direction[*j] = v[(a, k)] / norms[*j]);
            match *value <= STRUCTURAL * values[0] {
                true => structural.push(direction.as_slice().to_vec()),
                false => found.inverse.ger((value * value).recip(), &direction, &direction, 1.0),
            }
        }
        found.unit_covariance = match score_covariance {
            None => found.inverse.clone(),
            Some(scores) => &found.inverse * scores * &found.inverse,
        };

        // Practical analysis: principal axes of the covariance in units of the limits. Where the linear model is
        // doubtful, the misfit at the limit itself decides.
        let limit = |j: usize| match bound(j) {
            Some(bound) => BOUNDED_LIMIT * bound.log_deviation,
            None => practical_limit(&unknowns[j]),
        };
        let unit = &found.unit_covariance;
        let scaled = DMatrix::from_fn(n, n, |a, b| variance * unit[(a, b)] / (limit(a) * limit(b)));
        let axes = SymmetricEigen::new(scaled);
        let mut practical = Vec::new();
        for (axis, value) in axes.eigenvectors.column_iter().zip(&axes.eigenvalues) {
            let size = axis.amax();
            let at_limit = |side: f64| -> Vec<f64> {
                (0..n).map(|j| side * axis[j] * limit(j) / size).collect()
            };
            let deviation = value.max(0.0).sqrt() * size;
            // A misfit that is flat on one side is enough: an interval would have no end there.
            let mut is_flat = || [1.0, -1.0].iter().any(|side| rise(&at_limit(*side)) < 1.0);
            if deviation > 1.0 || deviation > SUSPICIOUS && is_flat() {
                practical.push(at_limit(1.0));
            }
        }
        let deviations: Vec<f64> = (0..n).map(|j| (variance * unit[(j, j)]).sqrt()).collect();
        let (structural, mut practical) = sparsest(structural, practical);
        // Unknowns with a component along any of these directions are refused; products that are constant along all of
        // them are kept.
        let directions: Vec<&Vec<f64>> = structural.iter().chain(&practical).collect();
        let mut is_refused: Vec<bool> =
            (0..n).map(|j| directions.iter().any(|along| along[j] != 0.0)).collect();
        for exponents in constant_combinations(unknowns, &directions) {
            let deviation = found.variance_of(DVector::from_column_slice(&exponents)).sqrt();
            if deviation < PRACTICAL_LOG {
                found.combinations.push(Combination { exponents, deviation });
            }
        }
        // Unknowns beyond their limit that are in none of these directions are directions of their own.
        for j in active.iter().copied().filter(|j| deviations[*j] > limit(*j)) {
            if !std::mem::replace(&mut is_refused[j], true) {
                practical.push((0..n).map(|k| f64::from(k == j)).collect());
            }
        }
        for (kind, directions) in [
            (NonIdentifiability::Structural, structural),
            (NonIdentifiability::Practical, practical),
        ] {
            found.findings.extend(describe_directions(unknowns, directions, kind, &deviations));
        }

        // Standard deviations and correlations of the identifiable unknowns.
        let identifiable = active.iter().copied().filter(|j| !is_refused[*j] && !is_one_sided(*j));
        for a in identifiable.clone() {
            found.deviation[a] = Some(deviations[a]);
            for b in identifiable.clone() {
                let unit = &found.unit_covariance;
                let product = unit[(a, a)] * unit[(b, b)];
                if product > 0.0 {
                    let value = if a == b { 1.0 } else { unit[(a, b)] / product.sqrt() };
                    found.correlation[a][b] = Some(value);
                }
            }
        }
        Ok(found)
    }

    /// Index of the last unknown of each identifiable combination, ascending and without repetition: with these held,
    /// the others are determined.
    pub fn held_unknowns(&self) -> Vec<usize> {
        let last = |c: &Combination| c.powers().map(|(j, _)| j).last();
        let mut held: Vec<usize> = self.combinations.iter().filter_map(last).collect();
        held.sort_unstable();
        held.dedup();
        held
    }

    /// Variance `v f'Cf` of the linear function `f'x` of the unknowns `x` on their scales, with one of the `factors`
    /// `f` per unknown. `v` is the variance of the noise, and `v C` the covariance of the unknowns.
    fn variance_of(&self, factors: DVector<f64>) -> f64 {
        self.variance * factors.dot(&(&self.unit_covariance * &factors))
    }

    /// Variance of a quantity by the errors of the unknowns with a standard deviation; all others count as exact. `row`
    /// are the derivatives of the quantity by the unknowns on their scales (logarithms of positive parameters).
    pub fn variance_along(&self, row: &[f64]) -> f64 {
        let factor = |j: usize| if self.deviation[j].is_some() { row[j] } else { 0.0 };
        self.variance_of(DVector::from_fn(row.len(), |j, _| factor(j)))
    }

    /// Response to a `change` of the unweighted residuals: the unknowns move by `-(J'WJ)^-1 J'W change`, with the
    /// squared `weights` and the `rows` of the unweighted Jacobian `J`. Unknowns respond that have a standard
    /// deviation, an upper bound away from zero, or a part in an identifiable combination; the others have none and
    /// count as fixed. Also returns the change of the unweighted residuals after the response. `change` has one value,
    /// and `weights` one factor, per row.
    pub fn response(&self, change: &[f64], weights: &[f64], rows: &[Vec<f64>]) -> LinearResponse {
        let n = self.deviation.len();
        let weighted: Vec<f64> = change.iter().zip(weights).map(|(c, w)| w * w * c).collect();
        let gradient =
            |j: usize| rows.iter().zip(&weighted).map(|(row, c)| row[j] * c).sum::<f64>();
        let all = &self.inverse * DVector::from_fn(n, |j, _| gradient(j));
        // Responses of undetermined unknowns are arbitrary, and are left out.
        let is_combined = |j: usize| self.combinations.iter().any(|c| c.exponents[j] != 0.0);
        let responds =
            |j: usize| self.deviation[j].is_some() || self.has_bound[j] || is_combined(j);
        let unknowns: Vec<Option<f64>> = (0..n).map(|j| responds(j).then(|| -all[j])).collect();
        let follow = |row: &Vec<f64>| -> f64 {
            row.iter().zip(&unknowns).map(|(d, by)| d * by.unwrap_or(0.0)).sum()
        };
        let residuals = change.iter().zip(rows).map(|(c, row)| c + follow(row)).collect();
        LinearResponse { unknowns, residuals }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Parameter;
    use approx::assert_relative_eq;

    fn unknowns() -> Vec<Unknown> {
        vec![Parameter::YoungsModulus.into(), Parameter::Density.into(), Parameter::Beta.into()]
    }

    /// `v (J'J)^-1` by an independent inverse.
    #[test]
    fn covariance_of_white_noise_is_the_inverse_normal_matrix() {
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
    fn opposite_columns_leave_a_ratio_and_other_unknowns_identifiable() {
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
    fn unknowns_without_effect_and_without_information_have_findings_of_their_own() {
        let rows: Vec<Vec<f64>> = (0..9).map(|i| vec![0.0, (i as f64).cos(), 1e-3]).collect();
        let found = Covariance::new(&unknowns(), &[], &rows, 1.0, 1.0, None, |_| f64::MAX).unwrap();
        assert!(found.findings[0].description.contains("youngs_modulus has no effect"));
        assert!(found.findings[1].description.contains("beta is practically not identifiable"));
        assert!(found.deviation[1].is_some());
    }

    /// Errors of the others do not depend on how near to zero the search has ended.
    #[test]
    fn bounded_unknown_does_not_change_the_errors_of_others() {
        let found = |part: f64| {
            let row = |i: usize| {
                let (s, c) = ((i as f64).sin(), (2.0 * i as f64).cos());
                vec![s, part * (s + 0.5 * c), (3.0 * i as f64).cos()]
            };
            let rows: Vec<Vec<f64>> = (0..20).map(row).collect();
            let vanishing = NearZeroEstimate {
                value: part,
                lower95: None,
                upper95: Some(1.0),
                log_deviation: 0.1 / part,
            };
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

    /// The linear model determines all unknowns, but the misfit at the limits of identification rises too little.
    #[test]
    fn flat_misfit_makes_an_unknown_practically_unidentifiable() {
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
