//! Differences of successive runs, each finer than the one before in mesh or in step, and from them order and error of
//! the last run.
//!
//! Let `e = C h^p` be the error after a refinement by `r`. The refinement changes the result by `d = e (r^p - 1)`
//! (Richardson). [`RefinementSequence`] stores the differences `d` with their factors `r`, and returns the order `p`
//! and the error `d/(r^p - 1)` of the last run (0 without a difference). The order is observed from the ratio of two
//! differences, and kept within [`OrderBounds`]. An order above its `at_once` needs a third difference; with a single
//! difference it is `assumed`. Modes that a coarse mesh does not have, or that large steps damp, appear one after the
//! other, so that differences decrease more slowly than the order of the method. A difference is the largest distance
//! of positions that are given over the rod length ([`largest_distance`]), or relative for modes.
//!
//! `last` is the last difference (`None` without one), `order` the observed order, and `error` the error of the last
//! run. Further functions of the sequence: `push` appends a difference with its factor, `pop` removes the last one and
//! returns its factor, `clear` removes all. `coarsened` is the sequence as it would end with the run before the last
//! one: a single difference `d r^p`, extrapolated from the last one `d` and its factor `r`; it is empty without a
//! difference. `count` is the number of differences. `is_falling` tests whether the last difference is the smaller one
//! of the last two, `is_converging` whether they decrease at least as the lowest order requires; both are true for
//! fewer than two. `order_or` is the observed order, or a given one for fewer than two differences. [`UNRELATED`] is a
//! difference above which runs have no relation.

use crate::accuracy::extrapolation::Extrapolation;

/// Difference over the length above which two motions are unrelated and determine no error.
pub(super) const UNRELATED: f64 = 0.15;
/// Bisections for an observed order: 2^-40 of the interval.
const BISECTIONS: usize = 40;

/// Positions over the length at the points and times at which runs are compared.
pub(crate) type Positions = Vec<[f64; 3]>;

/// The largest distance between corresponding positions of two motions, in their unit (lengths of the rod); zero for
/// empty lists.
pub(crate) fn largest_distance(a: &Positions, b: &Positions) -> f64 {
    let square =
        |(a, b): (&[f64; 3], &[f64; 3])| a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>();
    a.iter().zip(b).map(square).fold(0.0, f64::max).sqrt()
}

/// Bounds of the observed order, and the order that is assumed before one is observed.
#[derive(Clone, Copy, Debug)]
pub(super) struct OrderBounds {
    /// The highest order that is used: that of the method.
    pub highest: f64,
    /// The highest order that is accepted from two differences; a higher one needs a third difference.
    pub at_once: f64,
    /// The lowest order with which the sequence is extrapolated.
    pub lowest: f64,
    /// The order after a single difference.
    pub assumed: f64,
}

/// The change of the result by one refinement of mesh or step.
#[derive(Clone, Copy, Debug)]
struct RefinementChange {
    /// Over the length.
    difference: f64,
    /// Factor by which mesh or step became finer.
    ratio: f64,
}

impl RefinementChange {
    /// The order `p` that explains the decrease from this difference `d1` to the `next` one `d2`, for the refinement
    /// factors `r1` and `r2`: the solution of `d2/d1 = (1 - r2^-p)/(r1^p - 1)` by bisection. It is `lowest` or
    /// `highest` if the decrease is slower or faster than these orders.
    fn order_to(self, next: Self, lowest: f64, highest: f64) -> f64 {
        let fall = next.difference / self.difference.max(f64::MIN_POSITIVE);
        // With the order p the error falls by ratio^-p at each refinement; both ratios may
        // differ.
        let expected = |order: f64| {
            let [before, after] =
                [self.ratio, next.ratio].map(|ratio| Extrapolation { ratio, order });
            before.error_after() / after.error_before()
        };
        let [mut low, mut high] = [lowest, highest];
        // The expected ratio decreases with the order, so that the bisection has one solution at most.
        if fall >= expected(low) {
            return low;
        }
        if fall <= expected(high) {
            return high;
        }
        for _ in 0..BISECTIONS {
            let middle = 0.5 * (low + high);
            if fall < expected(middle) { low = middle } else { high = middle }
        }
        0.5 * (low + high)
    }
}

/// The differences of a sequence of successively refined runs, over the length, from which order and error of the last
/// run follow.
#[derive(Clone, Debug)]
pub(super) struct RefinementSequence {
    changes: Vec<RefinementChange>,
    bounds: OrderBounds,
}

impl RefinementSequence {
    /// A sequence without refinements, whose observed order of convergence is kept within `bounds`.
    pub fn new(bounds: OrderBounds) -> Self {
        Self { changes: Vec::new(), bounds }
    }

    /// Appends the `difference`, over the length, that a refinement by the factor `ratio` made.
    pub fn push(&mut self, difference: f64, ratio: f64) {
        self.changes.push(RefinementChange { difference, ratio });
    }

    /// Removes all differences, so that no order and no error are known.
    pub fn clear(&mut self) {
        self.changes.clear();
    }

    /// Removes the last difference and returns its refinement factor; 1 if there is none.
    pub fn pop(&mut self) -> f64 {
        self.changes.pop().map_or(1.0, |change| change.ratio)
    }

    /// The sequence as it would end with the run before the last one: a single difference, extrapolated from the last
    /// difference `d` and its factor `r` with the [order](Self::order) `p`, as `d r^p`. Empty without a difference.
    pub fn coarsened(mut self) -> Self {
        let order = self.order();
        if let Some(last) = self.changes.pop() {
            // One refinement before, the difference was larger by r^p.
            let difference = last.difference * last.ratio.powf(order);
            self.changes = vec![RefinementChange { difference, ..last }];
        }
        self
    }

    /// The number of stored differences.
    pub fn count(&self) -> usize {
        self.changes.len()
    }

    /// The difference between the last two runs, over the length; `None` without one.
    pub fn last(&self) -> Option<f64> {
        self.changes.last().map(|change| change.difference)
    }

    /// Whether the last difference is smaller than the one before; true for fewer than two.
    pub fn is_falling(&self) -> bool {
        !matches!(self.changes[..], [.., before, last] if last.difference >= before.difference)
    }

    /// Whether the last two differences decrease at least as fast as the lowest order requires; true for fewer than
    /// two. For this test orders down to half the lowest one are resolved.
    pub fn is_converging(&self) -> bool {
        let OrderBounds { lowest, highest, .. } = self.bounds;
        match self.changes[..] {
            // An order below the lowest one is recognized only if it is resolved.
            [.., before, last] => before.order_to(last, 0.5 * lowest, highest) >= lowest,
            _ => true,
        }
    }

    /// The [observed order](Self::order) with at least two differences, else `other`.
    pub fn order_or(&self, other: f64) -> f64 {
        if self.changes.len() > 1 { self.order() } else { other }
    }

    /// The observed order of convergence, within the bounds. With three or more differences it is that of the last two,
    /// but at most the larger of `at_once` and the order of the second and third last ones. With two it is at most
    /// `at_once`, with fewer the assumed order.
    pub fn order(&self) -> f64 {
        let OrderBounds { highest, at_once, lowest, assumed } = self.bounds;
        let order = |a: RefinementChange, b: RefinementChange| a.order_to(b, lowest, highest);
        match self.changes[..] {
            [.., first, before, last] => {
                // One irregular difference can suggest a high order, which would underestimate the error.
                let observed = order(before, last);
                observed.min(order(first, before).max(at_once))
            }
            [before, last] => order(before, last).min(at_once),
            _ => assumed,
        }
    }

    /// The estimated error of the last run, over the length: the last difference divided by `r^p - 1`, with its
    /// refinement factor `r` and the [order](Self::order) `p`. Zero without a difference.
    pub fn error(&self) -> f64 {
        self.changes.last().map_or(0.0, |RefinementChange { difference, ratio }| {
            difference * Extrapolation { ratio: *ratio, order: self.order() }.error_after()
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BOUNDS: OrderBounds =
        OrderBounds { highest: 2.0, at_once: 1.5, lowest: 0.4, assumed: 1.0 };

    fn differences(errors: &[f64], ratios: &[f64]) -> RefinementSequence {
        let mut found = RefinementSequence::new(BOUNDS);
        errors.windows(2).zip(ratios).for_each(|(e, ratio)| found.push(e[0] - e[1], *ratio));
        found
    }

    /// Errors `h^p` of refinements by 2, 4 and 3 have the order `p`, and the last of them is found.
    #[test]
    fn error_of_a_power_law_is_exact_for_any_refinements() {
        for order in [0.7, 1.0, 1.4, 2.0] {
            let errors = [1.0_f64, 2.0, 8.0, 24.0].map(|finer| finer.powf(-order));
            let found = differences(&errors, &[2.0, 4.0, 3.0]);
            assert!((found.order() - order).abs() < 1e-9, "{order}: {}", found.order());
            assert!((found.error() / errors[3] - 1.0).abs() < 1e-8, "{order}: {}", found.error());
        }
    }

    /// The order of the method needs two observations, the slower of which counts.
    #[test]
    fn high_order_is_used_after_two_observations() {
        assert_eq!(differences(&[1.0, 0.25], &[2.0]).order(), 1.0);
        let once = differences(&[1.0, 0.25, 0.0625], &[2.0; 2]);
        assert!((once.order() - 1.5).abs() < 1e-9);
        let twice = differences(&[1.0, 0.25, 0.0625, 0.015625], &[2.0; 3]);
        assert!((twice.order() - 2.0).abs() < 1e-9);
        let after_slow = differences(&[1.0, 0.5, 0.25, 0.0625], &[2.0; 3]);
        assert!(after_slow.order() <= 1.5);
    }

    #[test]
    fn sequence_converges_where_differences_fall_fast_enough() {
        let of = |values: &[f64]| {
            let mut found = RefinementSequence::new(BOUNDS);
            values.iter().for_each(|value| found.push(*value, 2.0));
            found
        };
        // The last fall 0.75 is below 2^-0.4 = 0.758, the fall of the lowest order 0.4; 0.8 is
        // not.
        assert!(of(&[1.0]).is_converging() && of(&[1.0, 0.75]).is_converging());
        let slow = of(&[1.0, 0.8]);
        assert!(!slow.is_converging() && slow.is_falling());
        assert!(!of(&[1.0, 1.0]).is_falling());
        assert_eq!(of(&[1.0]).order_or(2.0), 2.0);
        assert_eq!(of(&[1.0, 2.0]).order(), 0.4);
        assert_eq!(of(&[]).error(), 0.0);
    }
}
