//! Finite differences of fourth order of a function of several unknowns, for the check of hand-derived derivatives.
//!
//! Central differences `D(h)` over `2 h` and `D(2 h)` over `4 h` give `(4 D(h) - D(2 h)) / 3` (Richardson
//! extrapolation, error `O(h^4)`). They are taken at seven step sizes (`STEPS`), relative to the length over which the
//! energy is smooth ([`scale`]). That is the largest power of ten times the largest unknown up to which differences of
//! the gradient stay those of small steps. [`compare_differences`] takes the function and the expected derivatives with
//! the sizes of their terms. An error is the absolute difference over this size ([`relative`]). Output: the largest
//! error for each step size, and each entry at the step with its smallest error. Errors are not judged here.

/// Step sizes of the differences, relative to the [length scale](scale) of the energy: large ones truncate, small ones
/// round.
pub(crate) const STEPS: [f64; 7] = [1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7];
/// Decades below the largest unknown over which a length scale is searched for. More decades find energies that vary
/// faster.
const DECADES: i32 = 10;
/// Step, relative to the length scale, at which a difference must not have changed by more than the same fraction of
/// the stiffest entry.
const SMOOTH: f64 = 0.1;

/// Finite difference of a derivative, and the value that it is compared with.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Difference {
    /// Indices of the unknown and of the component of the function.
    pub place: [usize; 2],
    /// Hand-derived derivative.
    pub expected: f64,
    /// Finite difference.
    pub found: f64,
    /// Absolute difference over the size of the terms.
    pub error: f64,
}

/// Length scale of an energy at the unknowns `q`: the largest step up to which differences of its `gradient` equal
/// those of small steps within [`SMOOTH`] of `stiffest`, the largest entry of the Hessian. Steps are decades below the
/// largest unknown (1 if all are zero), which is the result if no step is accepted. Coordinates may be much larger than
/// this scale.
pub(crate) fn scale(q: &[f64], gradient: &dyn Fn(&[f64]) -> Vec<f64>, stiffest: f64) -> f64 {
    let largest = q.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
    let largest = if largest > 0.0 { largest } else { 1.0 };
    let near = |a: f64, b: f64, part: f64| (a - b).abs() <= part * stiffest;
    let mut found: Option<(f64, Vec<[f64; 2]>)> = None;
    // From small steps to large ones: far from the state an energy may be smooth again, with other derivatives.
    for k in (0..=DECADES).rev() {
        let scale = largest * 0.1_f64.powi(k);
        // Differences by every unknown over one and two steps.
        let all: Vec<[f64; 2]> =
            (0..q.len()).flat_map(|j| pairs(q, j, SMOOTH * scale, gradient)).collect();
        // The first accepted step must be large against rounding errors.
        let part = if found.is_none() { SMOOTH * SMOOTH } else { SMOOTH };
        let smooth = all.iter().enumerate().all(|(k, &[one, two])| {
            let as_before = found.as_ref().is_none_or(|(_, before)| near(one, before[k][0], part));
            near(one, two, part) && as_before
        });
        // The scale grows as long as the differences remain those of the smaller steps.
        match (smooth, &found) {
            (true, _) => found = Some((scale, all)),
            // Too small a step: rounding errors dominate.
            (false, None) => {}
            (false, Some(_)) => break,
        }
    }
    found.map_or(largest, |(scale, _)| scale)
}

/// Central differences of every component of `function` by unknown `j` at `q`, an entry for each component: that
/// between `-h` and `h`, and that between `-2 h` and `2 h`, both per unit of the unknown.
fn pairs(q: &[f64], j: usize, h: f64, function: &dyn Fn(&[f64]) -> Vec<f64>) -> Vec<[f64; 2]> {
    // Differences are divided by the rounded step.
    let shifted = |s: f64| {
        let mut moved = q.to_vec();
        moved[j] += s * h;
        (function(&moved), moved[j])
    };
    let ((a1, xa1), (b1, xb1)) = (shifted(1.0), shifted(-1.0));
    let ((a2, xa2), (b2, xb2)) = (shifted(2.0), shifted(-2.0));
    let pair = |i: usize| [(a1[i] - b1[i]) / (xa1 - xb1), (a2[i] - b2[i]) / (xa2 - xb2)];
    (0..a1.len()).map(pair).collect()
}

/// Hand-derived derivative that a finite difference is compared with, and the size that its error is divided by.
pub(crate) struct Expected {
    pub derivative: f64,
    pub size: f64,
}

/// Differences by every unknown at every step size.
pub(crate) struct DifferenceErrors {
    /// Largest error for each step size.
    pub worst_per_step: [f64; STEPS.len()],
    /// Every difference at the step size with the smallest error, since derivatives have different length scales.
    pub best: Vec<Difference>,
}

/// Fourth-order differences of `function` at `q` by every unknown, at every step size `h = STEPS * scale`. Each is
/// compared with `expected(place, h)`: the derivative by unknown `place[0]` of component `place[1]`, and the size for
/// the relative error. Returned are the largest error of each step size, and each difference at its best step.
pub(crate) fn compare_differences(
    q: &[f64],
    scale: f64,
    function: &dyn Fn(&[f64]) -> Vec<f64>,
    expected: &dyn Fn([usize; 2], f64) -> Expected,
) -> DifferenceErrors {
    let mut best: Vec<Difference> = Vec::new();
    let worst_per_step = STEPS.map(|step| {
        let h = step * scale;
        let all = (0..q.len()).flat_map(|j| {
            pairs(q, j, h, function).into_iter().enumerate().map(move |(i, pair)| ([j, i], pair))
        });
        // Richardson extrapolation: the error terms of second order cancel.
        let at_step: Vec<Difference> = all
            .map(|(place, [near, far])| {
                let found = (4.0 * near - far) / 3.0;
                let Expected { derivative, size } = expected(place, h);
                let error = relative(found - derivative, size);
                Difference { place, expected: derivative, found, error }
            })
            .collect();
        let worst = at_step.iter().fold(0.0_f64, |worst, d| worst.max(d.error));
        // Each entry keeps its most accurate step: entries of an energy have different length scales.
        if best.is_empty() {
            best = at_step;
        } else {
            for (best, d) in best.iter_mut().zip(at_step) {
                if d.error <= best.error {
                    *best = d;
                }
            }
        }
        worst
    });
    DifferenceErrors { worst_per_step, best }
}

/// Absolute value of `error` over `terms`, the sum of absolute terms. It is 0 for errors up to the smallest normal
/// number, and infinite if the quotient is not finite (an error of vanishing terms, NaN).
pub(crate) fn relative(error: f64, terms: f64) -> f64 {
    match error.abs() {
        0.0 => 0.0,
        // Results below the normal numbers have absolute rounding errors.
        e if e <= f64::MIN_POSITIVE => 0.0,
        e if (e / terms).is_finite() => e / terms,
        _ => f64::INFINITY,
    }
}
