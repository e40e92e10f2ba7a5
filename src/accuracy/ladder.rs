//! Runs of which each is twice as fine as the one before, and what their differences say.

use crate::accuracy::off::{Off, Seen, apart};

/// Differences of runs that fall by this factor when edges or steps are halved are those of a method that converges; of one of
/// first order by this part of its own.
const CONVERGES: f64 = 2.5;
const CONVERGES_SLOWLY: f64 = 0.7;
/// Runs that are as near as this are one.
const ROUNDING: f64 = 1e-12;

/// Runs of which each is twice as fine as the one before, and how far neighbours are apart.
#[derive(Default)]
pub(super) struct Ladder {
    before: Option<Seen>,
    last: Option<Seen>,
    apart: Vec<f64>,
    /// Whether one failed.
    failed: bool,
    /// What two runs alone say counts so many times.
    unsure: f64,
}

impl Ladder {
    pub fn new(unsure: f64) -> Self {
        Self { unsure, ..Self::default() }
    }

    /// Adds a run; one that failed is no neighbour of any.
    pub fn add(&mut self, seen: Option<Seen>) {
        match (&self.last, &seen) {
            (Some(last), Some(seen)) => self.apart.push(apart(last, seen)),
            _ => self.apart.clear(),
        }
        self.failed |= seen.is_none();
        self.before = std::mem::replace(&mut self.last, seen);
    }

    /// How far runs and the ones before them are apart, since the last that failed.
    pub fn apart(&self) -> &[f64] {
        &self.apart
    }

    /// By how much the last run is off, of at most this order; none where runs do not say.
    pub fn off(&self, order: f64) -> Option<Off> {
        match self.apart[..] {
            [] => None,
            [_] => Some(self.last_change(self.unsure / (order.exp2() - 1.0), order)),
            [.., last] if last < ROUNDING => Some(self.last_change(1.0, order)),
            [.., before, last] => {
                let falls = (before / last).min(order.exp2());
                (falls >= CONVERGES.min(CONVERGES_SLOWLY * order.exp2()))
                    .then(|| self.last_change((falls - 1.0).recip(), falls.log2()))
            }
        }
    }

    /// So many times what the last run changed; unknown where there is none before it.
    pub fn last_change(&self, times: f64, order: f64) -> Off {
        match self.before.as_ref().zip(self.last.as_ref()) {
            Some((before, last)) => Off::of(before, last, times, order),
            None => Off::unknown(order),
        }
    }

    /// By how much the last run is off and how many times as fine what is chosen may be, where as far as that makes no more than
    /// `allowed`: it may be the first factor finer where three runs say so, the second where two do, and no finer than the last
    /// of two after one that failed.
    pub fn reaches(&self, allowed: f64, order: f64, [far, by_two]: [f64; 2]) -> Option<(Off, f64)> {
        let off = self.off(order)?;
        let far = match (self.apart.len(), self.failed) {
            (1, true) => 1.0,
            (1, false) => by_two,
            _ => far,
        };
        (off.finer(allowed) <= far).then_some((off, far))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Runs that are off by these, of one number.
    fn ladder(off: &[f64], unsure: f64) -> Ladder {
        let mut ladder = Ladder::new(unsure);
        off.iter().for_each(|off| ladder.add(Some(vec![[*off, 0.0, 0.0]])));
        ladder
    }

    #[test]
    fn three_runs_say_what_the_last_is_off_by() {
        let off = ladder(&[16.0, 4.0, 1.0], 1.5).off(2.0).unwrap();
        assert!((off.size() - 1.0).abs() < 1e-12 && (off.order - 2.0).abs() < 1e-12);
        // No higher order is believed.
        let off = ladder(&[64.0, 8.0, 1.0], 1.5).off(2.0).unwrap();
        assert!((off.size() - 7.0 / 3.0).abs() < 1e-12 && off.order == 2.0);
        // Two are not sure, one says nothing, nor do three whose differences do not fall.
        assert!((ladder(&[4.0, 1.0], 1.5).off(2.0).unwrap().size() - 1.5).abs() < 1e-12);
        assert!(ladder(&[1.0], 1.5).off(2.0).is_none());
        assert!(ladder(&[3.0, 2.0, 1.0], 1.5).off(2.0).is_none());
        // Of a method of first order they need not fall as much.
        assert!((ladder(&[4.0, 2.0, 1.0], 1.5).off(1.0).unwrap().size() - 1.0).abs() < 1e-12);
    }

    #[test]
    fn a_run_that_failed_is_no_neighbour() {
        let mut ladder = Ladder::new(1.0);
        ladder.add(None);
        ladder.add(Some(vec![[4.0, 0.0, 0.0]]));
        assert!(ladder.off(2.0).is_none());
        ladder.add(Some(vec![[1.0, 0.0, 0.0]]));
        assert!((ladder.off(2.0).unwrap().size() - 1.0).abs() < 1e-12);
        // Nothing finer than the last of two is believed after one.
        assert!(ladder.reaches(0.9, 2.0, [3.0, 2.0]).is_none());
        assert_eq!(ladder.reaches(1.1, 2.0, [3.0, 2.0]).unwrap().1, 1.0);
    }
}
