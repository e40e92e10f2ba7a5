//! Central differences of fourth order over a valley of step sizes.

use super::{relative, scale_of};

/// Steps over the size of the unknowns.
pub(super) const STEPS: [f64; 7] = [1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7];

/// Differences of `function` by every unknown at every step, against what `expected` says of the
/// derivative by unknown `k[0]` of component `k[1]` and of the size it is measured by, given the
/// step. Returns the largest error per step.
pub(super) fn difference<const N: usize, const M: usize>(
    q: &[f64; N],
    function: impl Fn(&[f64; N]) -> [f64; M],
    expected: impl Fn([usize; 2], f64) -> (f64, f64),
) -> [f64; STEPS.len()] {
    STEPS.map(|step| {
        let h = step * scale_of(q);
        let mut worst = 0.0_f64;
        for j in 0..N {
            // The step that is really taken.
            let shifted = |s: f64| {
                let mut moved = *q;
                moved[j] += s * h;
                (function(&moved), moved[j])
            };
            let ((a1, xa1), (b1, xb1)) = (shifted(1.0), shifted(-1.0));
            let ((a2, xa2), (b2, xb2)) = (shifted(2.0), shifted(-2.0));
            for i in 0..M {
                let near = (a1[i] - b1[i]) / (xa1 - xb1);
                let far = (a2[i] - b2[i]) / (xa2 - xb2);
                let (derivative, size) = expected([j, i], h);
                let error = relative((4.0 * near - far) / 3.0 - derivative, size);
                worst = worst.max(error);
            }
        }
        worst
    })
}
