//! The linear least-squares problem at one iterate of a nonlinear one.

use nalgebra::{DMatrix, DVector};

/// Factor on the damping of a step that changes more than it could.
const MORE: f64 = 100.0;

/// Half the sum of squares.
pub(crate) fn half_sum_of_squares(residuals: &[f64]) -> f64 {
    0.5 * residuals.iter().map(|r| r * r).sum::<f64>()
}

/// `|r + J step|^2` around an iterate, reduced to the unknowns that may move.
pub(crate) struct Linearized {
    free: Vec<usize>,
    /// Upper triangle of the QR factors of the free columns.
    r: DMatrix<f64>,
    /// First rows of Q' residuals.
    qtr: DVector<f64>,
    /// Norms of all columns of J.
    pub norms: Vec<f64>,
}

impl Linearized {
    /// Unknowns at a bound that the gradient pushes outward stay there.
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

    /// The step from `x` that minimises `|r + J step|^2 + damping |scale step|^2`, and the norm of
    /// the change it makes in the linear model. None when that is not finite. Unknowns that would
    /// leave their bounds go to the bound, and the others make the best of it.
    ///
    /// What the data say nothing about, such as a turn of all natural curvatures about the rod, rounding errors lead
    /// as far as they like: several unknowns at once to bounds, from where the others cannot make up
    /// for them. No step within bounds that include `x` changes more than the one without; one that does is
    /// looked for again with more damping.
    pub fn step(
        &self,
        x: &[f64],
        bounds: &[[f64; 2]],
        scale: &[f64],
        damping: f64,
    ) -> Option<(Vec<f64>, f64)> {
        let mut damping = damping;
        loop {
            let (step, [first, change]) = self.bounded(x, bounds, scale, damping)?;
            if change <= first * (1.0 + 1e-6) || damping > 1.0 {
                return Some((step, change));
            }
            damping *= MORE;
        }
    }

    /// The same with this damping, whatever it changes, and what it would change without bounds.
    fn bounded(
        &self,
        x: &[f64],
        bounds: &[[f64; 2]],
        scale: &[f64],
        damping: f64,
    ) -> Option<(Vec<f64>, [f64; 2])> {
        let n = self.free.len();
        let mut step = DVector::zeros(n);
        let mut moving: Vec<usize> = (0..n).collect();
        let mut first = None;
        while !moving.is_empty() {
            let solution = self.solve(&moving, &step, scale, damping)?;
            for (k, s) in moving.iter().zip(solution.iter()) {
                step[*k] = *s;
            }
            first.get_or_insert_with(|| (&self.r * &step).norm());
            let stays = |k: &usize| {
                let j = self.free[*k];
                let to = x[j] + step[*k];
                to >= bounds[j][0] && to <= bounds[j][1]
            };
            let (inside, outside): (Vec<usize>, Vec<usize>) = moving.into_iter().partition(stays);
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
        Some((all, [first.unwrap_or(change), change]))
    }

    /// The best steps of the unknowns `moving` while the others make theirs.
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
        // An unknown without effect gets a scale too, so that damping keeps it where it is.
        let weight = |k: usize| match scale[self.free[moving[k]]] {
            scale if scale > 0.0 => damping.sqrt() * scale,
            _ => 1.0,
        };
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

    /// Drop of the cost the linear model predicts for a step.
    pub fn predicted(&self, step: &[f64]) -> f64 {
        let s = DVector::from_fn(self.free.len(), |j, _| step[self.free[j]]);
        let change = &self.r * s;
        -(change.dot(&self.qtr) + 0.5 * change.norm_squared())
    }

    /// Smallest part of its effect that an unknown keeps at another point with the Jacobian `rows`,
    /// next to the one that gains or keeps most.
    pub fn least_kept(&self, rows: &[Vec<f64>]) -> f64 {
        let norms = column_norms(rows, self.norms.len());
        let had_effect = self.free.iter().filter(|j| self.norms[**j] > 0.0);
        let kept = had_effect.map(|j| norms[*j] / self.norms[*j]);
        let (least, most) = kept.fold((f64::MAX, 0.0_f64), |(l, m), k| (l.min(k), m.max(k)));
        if most > 0.0 { least / most } else { 1.0 }
    }
}

fn column_norms(rows: &[Vec<f64>], n: usize) -> Vec<f64> {
    (0..n).map(|j| rows.iter().map(|row| row[j] * row[j]).sum::<f64>().sqrt()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Three unknowns of which the data tell two sums, but for rounding: the step promises no more than there
    /// is to gain.
    #[test]
    fn what_the_data_say_nothing_about_promises_nothing() {
        let row = |k: usize| {
            let (a, b) = (1.0 + 0.1 * k as f64, 1.0 - 0.2 * k as f64);
            vec![a, a + b, b + 1e-13 * (7.0 * k as f64).sin()]
        };
        let rows: Vec<Vec<f64>> = (0..20).map(row).collect();
        let residuals: Vec<f64> = (0..20).map(|k| 1.0 + (3.0 * k as f64).cos()).collect();
        let bounds = [[-1e6, 1e6], [-1e4, 1e4], [-1e6, 1e6]];
        let linear = Linearized::new(&rows, &residuals, &[0.0; 3], &bounds);
        let (_, [first, blind]) = linear.bounded(&[0.0; 3], &bounds, &linear.norms, 1e-30).unwrap();
        assert!(blind > 1e3 * first, "{blind:e} {first:e}: the case shows nothing");
        let (step, change) = linear.step(&[0.0; 3], &bounds, &linear.norms, 1e-30).unwrap();
        let all = (2.0 * half_sum_of_squares(&residuals)).sqrt();
        assert!(change <= all, "{change:e} {all:e} {step:?}");
        assert!(linear.predicted(&step) > 0.0);
    }
}
