//! Central differences of fourth order over a valley of step sizes.

/// Steps over the [scale](scale) of the energy.
pub(crate) const STEPS: [f64; 7] = [1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7];
/// How many decades below the largest unknown a scale is looked for.
const DECADES: i32 = 10;
/// Steps of this part of the scale change a derivative by less than this part.
const SMOOTH: f64 = 0.1;

/// A difference with what it is compared with.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Difference {
    /// By which unknown of which component.
    pub place: [usize; 2],
    pub expected: f64,
    pub found: f64,
    /// Of `found - expected` over the size of the terms.
    pub error: f64,
}

/// The energy's own scale at a state: the largest step, in decades below the largest unknown, up to
/// which differences of its `gradient` stay what they are for small ones. Coordinates may be large
/// against the distances that an energy sees. The stiffest entry of its Hessian is given.
pub(crate) fn scale(q: &[f64], gradient: &dyn Fn(&[f64]) -> Vec<f64>, stiffest: f64) -> f64 {
    let largest = q.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
    let largest = if largest > 0.0 { largest } else { 1.0 };
    let near = |a: f64, b: f64, part: f64| (a - b).abs() <= part * stiffest;
    let mut found: Option<(f64, Vec<[f64; 2]>)> = None;
    // From below: far from the state an energy may be smooth again, and another.
    for k in (0..=DECADES).rev() {
        let scale = largest * 0.1_f64.powi(k);
        let all: Vec<[f64; 2]> =
            (0..q.len()).flat_map(|j| pairs(q, j, SMOOTH * scale, gradient)).collect();
        // The first to be taken must be well out of the rounding errors.
        let part = if found.is_none() { SMOOTH * SMOOTH } else { SMOOTH };
        let smooth = all.iter().enumerate().all(|(k, &[one, two])| {
            let as_before = found.as_ref().is_none_or(|(_, before)| near(one, before[k][0], part));
            near(one, two, part) && as_before
        });
        match (smooth, &found) {
            (true, _) => found = Some((scale, all)),
            // Steps too small, lost in rounding errors.
            (false, None) => {}
            (false, Some(_)) => break,
        }
    }
    found.map_or(largest, |(scale, _)| scale)
}

/// Differences over one and two steps of size `h` along unknown `j`, of every component.
fn pairs(q: &[f64], j: usize, h: f64, function: &dyn Fn(&[f64]) -> Vec<f64>) -> Vec<[f64; 2]> {
    // The step that is really taken.
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

/// Differences of `function` by every unknown at every step, against what `expected` says of the
/// derivative by unknown `k[0]` of component `k[1]` and of the size it is measured by, given the
/// step. Returns the largest error per step, and of every difference the best over the steps: some
/// derivatives do not change where others do, and each has a step of its own.
pub(crate) fn difference(
    q: &[f64],
    scale: f64,
    function: &dyn Fn(&[f64]) -> Vec<f64>,
    expected: &dyn Fn([usize; 2], f64) -> (f64, f64),
) -> ([f64; STEPS.len()], Vec<Difference>) {
    let mut best: Vec<Difference> = Vec::new();
    let worst = STEPS.map(|step| {
        let h = step * scale;
        let all = (0..q.len()).flat_map(|j| {
            pairs(q, j, h, function).into_iter().enumerate().map(move |(i, pair)| ([j, i], pair))
        });
        let at_step: Vec<Difference> = all
            .map(|(place, [near, far])| {
                let found = (4.0 * near - far) / 3.0;
                let (derivative, size) = expected(place, h);
                let error = relative(found - derivative, size);
                Difference { place, expected: derivative, found, error }
            })
            .collect();
        let worst = at_step.iter().fold(0.0_f64, |worst, d| worst.max(d.error));
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
    (worst, best)
}

/// An error over its scale; infinite where it should be zero, and for NaN.
pub(crate) fn relative(error: f64, terms: f64) -> f64 {
    match error.abs() {
        0.0 => 0.0,
        // Below the normal numbers every result carries absolute rounding errors.
        e if e <= f64::MIN_POSITIVE => 0.0,
        e if (e / terms).is_finite() => e / terms,
        _ => f64::INFINITY,
    }
}
