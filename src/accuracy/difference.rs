//! Differences of successive runs of which each is twice as fine as the one before in mesh or in step, and the error of the
//! last of them.
//!
//! Differences that fall by a factor are a geometric series; its remainder is the error of the last run (Aitken's
//! extrapolation; for errors of second order it is Richardson's). Modes that a coarse mesh does not have, or that large steps
//! damp, come in one after the other, and the differences then fall more slowly than the order of the method.

/// Differences over the length beyond which two motions are unrelated and determine no error.
pub(super) const UNRELATED: f64 = 0.15;

/// Positions over the length at the points and times where runs are compared.
pub(super) type Positions = Vec<[f64; 3]>;

/// The largest distance between two motions, over the length.
pub(super) fn largest_distance(a: &Positions, b: &Positions) -> f64 {
    let square =
        |(a, b): (&[f64; 3], &[f64; 3])| a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>();
    a.iter().zip(b).map(square).fold(0.0, f64::max).sqrt()
}

/// Bounds of the contraction with which differences are continued.
#[derive(Clone, Copy, Debug)]
pub(super) struct ContractionBounds {
    /// The fastest that is believed: 1/4 is that of second order.
    pub fastest: f64,
    /// The slowest with which the series is summed.
    pub slowest: f64,
    /// What is assumed after a single difference.
    pub assumed: f64,
}

/// Successive differences, over the length.
#[derive(Clone, Debug)]
pub(super) struct Differences {
    values: Vec<f64>,
    bounds: ContractionBounds,
}

impl Differences {
    pub fn new(bounds: ContractionBounds) -> Self {
        Self { values: Vec::new(), bounds }
    }

    pub fn push(&mut self, difference: f64) {
        self.values.push(difference);
    }

    pub fn clear(&mut self) {
        self.values.clear();
    }

    pub fn count(&self) -> usize {
        self.values.len()
    }

    pub fn last(&self) -> Option<f64> {
        self.values.last().copied()
    }

    /// The factor by which the differences fall.
    pub fn contraction(&self) -> f64 {
        let ContractionBounds { fastest, slowest, assumed } = self.bounds;
        match self.values[..] {
            [.., before, last] => (last / before.max(f64::MIN_POSITIVE)).clamp(fastest, slowest),
            _ => assumed,
        }
    }

    /// Whether the last difference is smaller than the one before.
    pub fn is_falling(&self) -> bool {
        !matches!(self.values[..], [.., before, last] if last >= before)
    }

    /// Whether the last two differences fall at least as fast as the slowest contraction; so does a single one.
    pub fn is_converging(&self) -> bool {
        match self.values[..] {
            [.., before, last] => last <= self.bounds.slowest * before,
            _ => true,
        }
    }

    /// The observed order, or another one after a single difference.
    pub fn order_or(&self, other: f64) -> f64 {
        if self.values.len() > 1 { self.order() } else { other }
    }

    /// The order: the power of the edge length or the step that the error falls with.
    pub fn order(&self) -> f64 {
        -self.contraction().log2()
    }

    /// The error of the last run, over the length; zero without a difference.
    pub fn error(&self) -> f64 {
        let contraction = self.contraction();
        self.last().unwrap_or(0.0) * contraction / (1.0 - contraction)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn differences(values: &[f64]) -> Differences {
        let bounds = ContractionBounds { fastest: 0.25, slowest: 0.8, assumed: 0.4 };
        Differences { values: values.to_vec(), bounds }
    }

    /// Errors e, e/4, e/16 have the differences 3e/4 and 3e/16, and the last is e/16.
    #[test]
    fn second_order_differences_give_richardsons_error() {
        let last = differences(&[0.75, 0.1875]);
        assert!((last.error() - 0.0625).abs() < 1e-15 && (last.order() - 2.0).abs() < 1e-15);
    }

    /// Errors e, e/2, e/4 of first order have the differences e/2 and e/4, and the last is e/4.
    #[test]
    fn first_order_differences_give_their_own_sum() {
        let last = differences(&[0.5, 0.25]);
        assert!((last.error() - 0.25).abs() < 1e-15 && (last.order() - 1.0).abs() < 1e-15);
    }

    #[test]
    fn sequence_converges_where_differences_fall_fast_enough() {
        assert!(differences(&[1.0]).is_converging() && differences(&[1.0, 0.79]).is_converging());
        let slow = differences(&[1.0, 0.81]);
        assert!(!slow.is_converging() && slow.is_falling());
        assert!(!differences(&[1.0, 1.0]).is_falling());
        assert_eq!(differences(&[1.0]).order_or(2.0), 2.0);
    }

    #[test]
    fn contraction_stays_between_its_bounds() {
        assert_eq!(differences(&[1.0, 1e-3]).contraction(), 0.25);
        assert_eq!(differences(&[1.0, 2.0]).contraction(), 0.8);
        assert_eq!(differences(&[1.0]).contraction(), 0.4);
        assert_eq!(differences(&[]).error(), 0.0);
    }
}
