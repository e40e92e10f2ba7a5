//! Runs of which each is twice as fine as the one before, and what their differences say.

/// What is looked at, at all times, over the length.
pub(super) type Seen = Vec<[f64; 3]>;

/// Differences of runs that fall by this factor when edges or steps are halved are those of a method that converges; of one of
/// first order by this part of its own.
const CONVERGES: f64 = 2.5;
const CONVERGES_SLOWLY: f64 = 0.7;
/// Runs that are as near as this are one.
const ROUNDING: f64 = 1e-12;
/// What is known from two runs only counts so many times.
const UNSURE: f64 = 1.5;

/// The largest distance between two motions.
pub(super) fn apart(a: &Seen, b: &Seen) -> f64 {
    let square =
        |(a, b): (&[f64; 3], &[f64; 3])| a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>();
    a.iter().zip(b).map(square).fold(0.0, f64::max).sqrt()
}

/// Runs of which each is twice as fine as the one before, and how far neighbours are apart.
#[derive(Default)]
pub(super) struct Ladder {
    last: Option<Seen>,
    apart: Vec<f64>,
    /// Whether one failed.
    failed: bool,
}

impl Ladder {
    /// Adds a run; one that failed is no neighbour of any.
    pub fn add(&mut self, seen: Option<Seen>) {
        match (&self.last, &seen) {
            (Some(last), Some(seen)) => self.apart.push(apart(last, seen)),
            _ => self.apart.clear(),
        }
        self.failed |= seen.is_none();
        self.last = seen;
    }

    /// How far runs and the ones before them are apart, since the last that failed.
    pub fn apart(&self) -> &[f64] {
        &self.apart
    }

    /// How much finer than the last run what is chosen must be to make no more than `allowed`, the error of the last
    /// run and the order it falls with, at most `order`; none where runs do not say, or from too far: it may be the first
    /// factor finer where three runs say so, the second where two do, and no finer than the last of two after one that failed.
    pub fn reaches(
        &self,
        allowed: f64,
        order: f64,
        [far, by_two]: [f64; 2],
    ) -> Option<(f64, [f64; 2])> {
        let [error, order] = self.error(order)?;
        let finer = (error / allowed).powf(order.recip());
        let far = match (self.apart.len(), self.failed) {
            (1, true) => 1.0,
            (1, false) => by_two,
            _ => far,
        };
        (finer <= far).then_some((finer, [error, order]))
    }

    /// The error of the last run and the order it falls with, at most `order`; none where runs do not say.
    pub fn error(&self, order: f64) -> Option<[f64; 2]> {
        match self.apart[..] {
            [] => None,
            [last] => Some([UNSURE * last / (order.exp2() - 1.0), order]),
            [.., last] if last < ROUNDING => Some([last, order]),
            [.., before, last] => {
                let falls = (before / last).min(order.exp2());
                (falls >= CONVERGES.min(CONVERGES_SLOWLY * order.exp2()))
                    .then(|| [last / (falls - 1.0), falls.log2()])
            }
        }
    }
}
