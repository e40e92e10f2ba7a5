//! The bounded, damped linear least-squares problem of a Levenberg-Marquardt step.
//!
//! Input: residuals `r`, rows of their Jacobian `J`, the iterate `x` and its bounds. Unknowns at a bound whose descent
//! points outward are held. [`Linearized::step`] minimizes `|r + J s|^2 + damping |D s|^2` over the step `s` by QR
//! factorization, with the diagonal scale `D`. Unknowns that leave their bounds stop there, and the others are solved
//! for again. A bounded step whose change `J s` has a larger norm than that of the unbounded one is repeated with
//! `DAMPING_FACTOR` times the damping, unless the damping was above `LARGEST_RETRIED_DAMPING`. Output: [`BoundedStep`],
//! the step `s` and the norm of `J s`; None if a step is not finite. `predicted` returns the decrease of the cost
//! `|r|^2/2` that the linear model predicts for a step. `least_kept_effect` returns how much of its effect the weakest
//! unknown keeps at another point.

use nalgebra::{DMatrix, DVector};

/// Factor on the damping of a bounded step that changes the model by more than the unbounded one.
const DAMPING_FACTOR: f64 = 100.0;

/// Relative excess of a bounded step's change of the model over the unbounded one that is attributed to rounding.
const CHANGE_TOLERANCE: f64 = 1e-6;

/// Damping, relative to the squared scales, above which a bounded step is accepted in any case.
const LARGEST_RETRIED_DAMPING: f64 = 1.0;

/// Half the sum of squares of the residuals, the cost of a least-squares problem.
pub(crate) fn half_sum_of_squares(residuals: &[f64]) -> f64 {
    0.5 * residuals.iter().map(|r| r * r).sum::<f64>()
}

/// The linear model `r + J step` around an iterate, reduced to the free unknowns by QR factorization.
pub(crate) struct Linearized {
    /// Unknowns that are not held at a bound.
    free: Vec<usize>,
    /// Upper triangle `R` of the QR factorization of the free columns of `J`.
    r: DMatrix<f64>,
    /// First rows of `Q' r`, one per free unknown.
    qtr: DVector<f64>,
    /// Norms of all columns of `J`.
    pub norms: Vec<f64>,
}

/// A step within bounds.
pub(crate) struct BoundedStep {
    /// The step of all unknowns.
    pub step: Vec<f64>,
    /// Norm of `J step`, the change of the linear model.
    pub change: f64,
    /// Norm of `J s` of the minimizing step `s` without bounds.
    unbounded_change: f64,
}

impl Linearized {
    /// The linear model from the rows of `J`, the residuals `r`, the iterate `x` and its bounds. Unknowns at a bound
    /// whose descent direction points outward are held there, for all steps. Also stores the Euclidean norms of all
    /// columns of `J`.
    pub fn new(rows: &[Vec<f64>], residuals: &[f64], x: &[f64], bounds: &[[f64; 2]]) -> Self {
        let gradient =
            |j: usize| rows.iter().zip(residuals).map(|(row, r)| row[j] * r).sum::<f64>();
        let free: Vec<usize> = (0..x.len())
            .filter(|j| {
                let g = gradient(*j);
                !(x[*j] <= bounds[*j][0] && g > 0.0 || x[*j] >= bounds[*j][1] && g < 0.0)
            })
            .collect();
        let n = free.len();
        // At least as many rows as columns, so that R is square.
        let m = rows.len().max(n);
        let jacobian = DMatrix::from_fn(m, n, |i, j| rows.get(i).map_or(0.0, |row| row[free[j]]));
        let mut qtr = DVector::from_fn(m, |i, _| residuals.get(i).copied().unwrap_or(0.0));
        let qr = jacobian.qr();
        qr.q_tr_mul(&mut qtr);
        let norms = column_norms(rows, x.len());
        Self { free, r: qr.r(), qtr: qtr.rows(0, n).into_owned(), norms }
    }

    /// The step from `x` that minimizes `|r + J step|^2 + damping |scale step|^2`; `scale` has one number per unknown.
    /// `None` if it is not finite. Unknowns that would leave their bounds stop at the bound, and the others are
    /// minimized again.
    ///
    /// Along combinations without an effect on the data, rounding errors determine the step. They may move several
    /// unknowns to bounds at once, and the others cannot compensate. A bounded step that changes the linear model by
    /// more (norm of `J step`) than the unbounded one is such a step; it is computed again with [`DAMPING_FACTOR`]
    /// times the damping, up to [`LARGEST_RETRIED_DAMPING`].
    pub fn step(
        &self,
        x: &[f64],
        bounds: &[[f64; 2]],
        scale: &[f64],
        mut damping: f64,
    ) -> Option<BoundedStep> {
        loop {
            let step = self.bounded(x, bounds, scale, damping)?;
            if step.change <= step.unbounded_change * (1.0 + CHANGE_TOLERANCE)
                || damping > LARGEST_RETRIED_DAMPING
            {
                return Some(step);
            }
            damping *= DAMPING_FACTOR;
        }
    }

    /// The step within bounds for this damping, without a limit on its change of the model. All free unknowns are
    /// solved for; those outside their bounds stop there, and the others are solved for again. Unknowns held at a bound
    /// have a step of zero. `None` if a solution is not finite.
    fn bounded(
        &self,
        x: &[f64],
        bounds: &[[f64; 2]],
        scale: &[f64],
        damping: f64,
    ) -> Option<BoundedStep> {
        let n = self.free.len();
        let mut step = DVector::zeros(n);
        let mut moving: Vec<usize> = (0..n).collect();
        let mut unbounded_change = None;
        // Unknowns that reach a bound are fixed there, until the others stay inside.
        while !moving.is_empty() {
            let solution = self.solve(&moving, &step, scale, damping)?;
            for (k, s) in moving.iter().zip(solution.iter()) {
                step[*k] = *s;
            }
            unbounded_change.get_or_insert_with(|| (&self.r * &step).norm());
            let is_inside = |k: &usize| {
                let j = self.free[*k];
                let to = x[j] + step[*k];
                to >= bounds[j][0] && to <= bounds[j][1]
            };
            // Unknowns outside their bounds stop there; the others are solved for again.
            let (inside, outside): (Vec<usize>, Vec<usize>) =
                moving.into_iter().partition(is_inside);
            if outside.is_empty() {
                break;
            }
            for k in outside {
                let j = self.free[k];
                step[k] = (x[j] + step[k]).clamp(bounds[j][0], bounds[j][1]) - x[j];
            }
            moving = inside;
        }
        let mut all = vec![0.0; x.len()];
        for (j, s) in self.free.iter().zip(step.iter()) {
            all[*j] = *s;
        }
        let change = (&self.r * step).norm();
        let unbounded_change = unbounded_change.unwrap_or(change);
        Some(BoundedStep { step: all, change, unbounded_change })
    }

    /// The steps of the free unknowns with the indices `moving` that minimize the damped sum of squares, with the given
    /// steps of the others. `None` if they are not finite. An unknown with the scale zero gets a weight of one.
    fn solve(
        &self,
        moving: &[usize],
        step: &DVector<f64>,
        scale: &[f64],
        damping: f64,
    ) -> Option<DVector<f64>> {
        let (n, m) = (self.free.len(), moving.len());
        let mut fixed = step.clone();
        moving.iter().for_each(|k| fixed[*k] = 0.0);
        let rest = &self.qtr + &self.r * fixed;
        // An unknown without an effect gets a scale too, so that damping keeps its step zero.
        let weight = |k: usize| match scale[self.free[moving[k]]] {
            scale if scale > 0.0 => damping.sqrt() * scale,
            _ => 1.0,
        };
        // The damping as additional rows of the least-squares problem.
        let stacked = DMatrix::from_fn(n + m, m, |i, k| match i {
            i if i < n => self.r[(i, moving[k])],
            i if i - n == k => weight(k),
            _ => 0.0,
        });
        let mut rhs = DVector::from_fn(n + m, |i, _| if i < n { -rest[i] } else { 0.0 });
        let qr = stacked.qr();
        qr.q_tr_mul(&mut rhs);
        let solution = qr.r().solve_upper_triangular(&rhs.rows(0, m).into_owned())?;
        solution.iter().all(|s| s.is_finite()).then_some(solution)
    }

    /// Decrease of the cost `1/2 |r|^2` by `step` that the linear model predicts; positive for a descent. Entries of
    /// unknowns that are held at a bound are ignored.
    pub fn predicted(&self, step: &[f64]) -> f64 {
        let s = DVector::from_fn(self.free.len(), |j, _| step[self.free[j]]);
        let change = &self.r * s;
        -(change.dot(&self.qtr) + 0.5 * change.norm_squared())
    }

    /// The smallest over the largest ratio, among the free unknowns, of a column norm of the Jacobian at another point,
    /// with these `rows`, to that at the iterate. It is near zero if one unknown alone loses its effect on the
    /// residuals; 1 if all keep the same part, all lose it, or none has an effect.
    pub fn least_kept_effect(&self, rows: &[Vec<f64>]) -> f64 {
        let norms = column_norms(rows, self.norms.len());
        let had_effect = self.free.iter().filter(|j| self.norms[**j] > 0.0);
        let kept = had_effect.map(|j| norms[*j] / self.norms[*j]);
        let (least, most) = kept.fold((f64::MAX, 0.0_f64), |(l, m), k| (l.min(k), m.max(k)));
        if most > 0.0 { least / most } else { 1.0 }
    }
}

/// Euclidean norms of the first `n` columns of a matrix of `rows`; zeros without rows.
pub(crate) fn column_norms(rows: &[Vec<f64>], n: usize) -> Vec<f64> {
    (0..n).map(|j| rows.iter().map(|row| row[j] * row[j]).sum::<f64>().sqrt()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The data determine two sums of three unknowns, except for rounding errors. The predicted change of the residuals
    /// does not exceed their norm.
    #[test]
    fn step_with_undetermined_unknowns_changes_no_more_than_the_residuals() {
        let row = |k: usize| {
            let (a, b) = (1.0 + 0.1 * k as f64, 1.0 - 0.2 * k as f64);
            vec![a, a + b, b + 1e-13 * (7.0 * k as f64).sin()]
        };
        let rows: Vec<Vec<f64>> = (0..20).map(row).collect();
        let residuals: Vec<f64> = (0..20).map(|k| 1.0 + (3.0 * k as f64).cos()).collect();
        let bounds = [[-1e6, 1e6], [-1e4, 1e4], [-1e6, 1e6]];
        let linear = Linearized::new(&rows, &residuals, &[0.0; 3], &bounds);
        let once = linear.bounded(&[0.0; 3], &bounds, &linear.norms, 1e-30).unwrap();
        assert!(once.change > 1e3 * once.unbounded_change, "the case is too easy");
        let BoundedStep { step, change, .. } =
            linear.step(&[0.0; 3], &bounds, &linear.norms, 1e-30).unwrap();
        let all = (2.0 * half_sum_of_squares(&residuals)).sqrt();
        assert!(change <= all, "{change:e} {all:e} {step:?}");
        assert!(linear.predicted(&step) > 0.0);
    }
}
