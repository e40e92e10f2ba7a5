//! By how much runs are off.

/// What is looked at, at all times, over the length.
pub(super) type Seen = Vec<[f64; 3]>;

/// The largest distance between two motions.
pub(super) fn apart(a: &Seen, b: &Seen) -> f64 {
    let square =
        |(a, b): (&[f64; 3], &[f64; 3])| a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>();
    a.iter().zip(b).map(square).fold(0.0, f64::max).sqrt()
}

/// By how much a run is off at all times, and the order this falls with.
#[derive(Clone, Debug)]
pub(super) struct Off {
    pub by: Seen,
    pub order: f64,
}

impl Off {
    /// So many times what a run differs by from one that is finer.
    pub fn of(run: &Seen, finer: &Seen, times: f64, order: f64) -> Self {
        let difference = |(a, b): (&[f64; 3], &[f64; 3])| [0, 1, 2].map(|c| times * (a[c] - b[c]));
        Self { by: run.iter().zip(finer).map(difference).collect(), order }
    }

    /// Nobody knows by how much.
    pub fn unknown(order: f64) -> Self {
        Self { by: vec![[f64::INFINITY, 0.0, 0.0]], order }
    }

    /// The largest distance.
    pub fn size(&self) -> f64 {
        let square = |x: &[f64; 3]| x.iter().map(|x| x * x).sum::<f64>();
        self.by.iter().map(square).fold(0.0, f64::max).sqrt()
    }

    /// How many times as fine a run is that is off by no more than `allowed`.
    pub fn finer(&self, allowed: f64) -> f64 {
        (self.size() / allowed).powf(self.order.recip())
    }

    /// What is left of it in a run so many times as fine, as a part; beyond what was looked at it falls with `slower` times its
    /// order.
    pub fn left(&self, finer: f64, slower: f64) -> f64 {
        finer.powf(-self.order * if finer > 1.0 { slower } else { 1.0 })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_left_falls_with_the_order() {
        let off = Off::of(&vec![[0.9, 0.0, 0.0]], &vec![[0.0; 3]], 1.0, 2.0);
        assert!((off.finer(0.1) - 3.0).abs() < 1e-12);
        assert!((off.left(3.0, 1.0) - 1.0 / 9.0).abs() < 1e-15);
        // What is carried on falls slower; what is coarser than the run grows with the order itself.
        assert!((off.left(3.0, 0.5) - 1.0 / 3.0).abs() < 1e-15);
        assert!((off.left(0.5, 0.5) - 4.0).abs() < 1e-15);
    }
}
