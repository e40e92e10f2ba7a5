//! What is known of numbers along a rod before the data: how far they are from what the scene says, and over which length
//! that changes.
//!
//! With independent normal numbers `z` of variance one,
//!
//! ```text
//! x = x_scene + c A^-1 z,    A = 1 - l^2 d^2/ds^2
//! ```
//!
//! with a second difference that ends flat. So second differences of what is found cost, and so does, `l` being long,
//! little else but its size: the prior is that of Lindgren, Rue and Lindstrom (2011) for a smoothness of 3/2. `c` makes
//! the standard deviation what was asked for in the middle of the rod; at its ends it is up to 1.5 times as large.

/// Numbers along a rod, smooth as far as is known.
#[derive(Clone, Debug)]
pub struct Smooth {
    /// (length over spacing)^2.
    stiffness: f64,
    /// `c`.
    factor: f64,
    count: usize,
}

impl Smooth {
    /// Of `count` numbers with this standard deviation that change over so many spacings.
    pub fn new(count: usize, sigma: f64, spacings: f64) -> Self {
        let mut smooth = Self { stiffness: spacings * spacings, factor: 1.0, count };
        let size = smooth.deviation(count / 2);
        smooth.factor = sigma / size;
        smooth
    }

    /// The standard deviation of number `k`.
    pub fn deviation(&self, k: usize) -> f64 {
        let mut row = vec![0.0; self.count];
        row[k] = 1.0;
        self.spread(&mut row);
        row.iter().map(|x| x * x).sum::<f64>().sqrt()
    }

    /// Makes `z` the numbers less those of the scene: a symmetric matrix.
    pub fn spread(&self, z: &mut [f64]) {
        let (n, k) = (z.len(), self.stiffness);
        // Elimination of a matrix with 1 + k or 1 + 2 k on its diagonal and -k beside.
        let on = |i: usize| 1.0 + k * (f64::from(u8::from(i > 0)) + f64::from(u8::from(i + 1 < n)));
        let mut pivots = vec![0.0; n];
        for i in 0..n {
            pivots[i] = on(i);
            if i > 0 {
                let factor = k / pivots[i - 1];
                pivots[i] -= k * factor;
                z[i] += factor * z[i - 1];
            }
        }
        for i in (0..n).rev() {
            let after = if i + 1 < n { k * z[i + 1] } else { 0.0 };
            z[i] = (z[i] + after) / pivots[i];
        }
        z.iter_mut().for_each(|x| *x *= self.factor);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_deviation_is_the_one_asked_for() {
        for spacings in [0.0, 0.4, 5.0, 20.0] {
            let smooth = Smooth::new(200, 0.3, spacings);
            let deviations: Vec<f64> = (0..200).map(|k| smooth.deviation(k)).collect();
            assert!((deviations[100] - 0.3).abs() < 1e-12);
            assert!(
                deviations.iter().all(|d| (0.2999..0.45).contains(d)),
                "{spacings}: {deviations:?}"
            );
        }
    }

    #[test]
    fn neighbours_go_together_over_the_length() {
        let smooth = Smooth::new(200, 1.0, 10.0);
        let column = |k: usize| {
            let mut z = vec![0.0; 200];
            z[k] = 1.0;
            smooth.spread(&mut z);
            z
        };
        let correlation = |a: usize, b: usize| -> f64 {
            let (a, b) = (column(a), column(b));
            a.iter().zip(&b).map(|(a, b)| a * b).sum()
        };
        // (1 + d) e^-d at a distance of d lengths.
        for (apart, d) in [(1, 0.1_f64), (10, 1.0), (30, 3.0)] {
            let expected = (1.0 + d) * (-d).exp();
            let found = correlation(90, 90 + apart);
            assert!((found - expected).abs() < 0.02, "{apart}: {found} for {expected}");
        }
    }
}
