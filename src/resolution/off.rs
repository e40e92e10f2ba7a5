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

    /// Nothing.
    pub fn none(order: f64) -> Self {
        Self { by: Vec::new(), order }
    }

    /// Nobody knows by how much.
    pub fn unknown(order: f64) -> Self {
        Self { by: vec![[f64::INFINITY, 0.0, 0.0]], order }
    }

    /// With what something else adds to it.
    pub fn plus(mut self, other: &Self) -> Self {
        for (a, b) in self.by.iter_mut().zip(&other.by) {
            (0..3).for_each(|c| a[c] += b[c]);
        }
        self
    }

    /// So many times as much.
    pub fn times(mut self, factor: f64) -> Self {
        self.by.iter_mut().flatten().for_each(|x| *x *= factor);
        self
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
    fn errors_add_up_as_motions() {
        let (run, finer) = (vec![[0.3, 0.0, 0.0], [0.0, 0.4, 0.0]], vec![[0.0; 3]; 2]);
        let off = Off::of(&run, &finer, 2.0, 2.0);
        assert!((off.size() - 0.8).abs() < 1e-15);
        assert_eq!(apart(&run, &finer), 0.4);
        assert_eq!(off.clone().plus(&off.clone().times(-1.0)).size(), 0.0);
        assert_eq!(off.clone().plus(&Off::none(2.0)).size(), off.size());
        assert_eq!(Off::unknown(2.0).size(), f64::INFINITY);
    }

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
