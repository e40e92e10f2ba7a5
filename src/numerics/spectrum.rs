//! Power spectrum of a sampled signal by harmonics of its even extension (a discrete cosine transform of type I).
//!
//! [`harmonic_variances`] takes a signal on a uniform grid of a power of two of intervals, with both ends. It returns
//! the variance of each harmonic 1, 2, .., as many as intervals, in the squared unit of the signal; the mean is left
//! out. Harmonic `k` has `k/2` periods over the signal. `intervals` returns a suitable power of two for a number of
//! samples. The even extension of the signal is continuous. The spurious variance of a signal that ends elsewhere than
//! it begins therefore decreases with the fourth power of the frequency; that of a periodic extension decreases with
//! the second. The bandwidth of recorded motions follows from it.

use std::f64::consts::PI;

/// Largest number of intervals of a signal, a power of two: it bounds time and memory of the transform.
const MOST_INTERVALS: usize = 1 << 17;

/// Number of intervals of a uniform grid that resolves a signal of `samples` samples: the smallest power of two that is
/// at least `samples - 1`, clamped to 8 and [`MOST_INTERVALS`].
pub(crate) fn intervals(samples: usize) -> usize {
    samples.saturating_sub(1).next_power_of_two().clamp(8, MOST_INTERVALS)
}

/// Variances of the harmonics 1, 2, .. of the even extension of a signal, in the squared unit of the signal, as many as
/// intervals. The signal has both ends of a uniform grid with a power of two of intervals. Harmonic `k` has `k/2`
/// periods over it. The sum is the variance of the even extension (Parseval). Panics without intervals, and requires a
/// power of two of them.
pub(crate) fn harmonic_variances(signal: &[f64]) -> Vec<f64> {
    let intervals = signal.len() - 1;
    let extended = signal.iter().chain(signal[1..intervals].iter().rev());
    let mut terms: Vec<[f64; 2]> = extended.map(|x| [x - signal[0], 0.0]).collect();
    transform(&mut terms);
    let count = terms.len() as f64;
    let power = |k: usize| terms[k].iter().map(|x| (x / count).powi(2)).sum::<f64>();
    // Each harmonic has two terms, except for the highest.
    (1..=intervals).map(|k| if k < intervals { 2.0 * power(k) } else { power(k) }).collect()
}

/// Discrete Fourier transform, unnormalized, in place (Cooley and Tukey 1965), of complex numbers `[real, imaginary]`,
/// whose number is a power of two.
fn transform(terms: &mut [[f64; 2]]) {
    let count = terms.len();
    let bits = count.trailing_zeros();
    // Bit-reversed order, so that every pass combines adjacent blocks.
    for i in 0..count {
        let j = i.reverse_bits() >> (usize::BITS - bits);
        if i < j {
            terms.swap(i, j);
        }
    }
    let mut half = 1;
    while half < count {
        let root = |k: usize| (-PI * k as f64 / half as f64).sin_cos();
        let roots: Vec<(f64, f64)> = (0..half).map(root).collect();
        for block in terms.chunks_exact_mut(2 * half) {
            let (even, odd) = block.split_at_mut(half);
            // Butterfly: the odd term times a root of unity.
            for ((a, b), (s, c)) in even.iter_mut().zip(odd).zip(&roots) {
                let product = [b[0] * c - b[1] * s, b[0] * s + b[1] * c];
                *b = [a[0] - product[0], a[1] - product[1]];
                *a = [a[0] + product[0], a[1] + product[1]];
            }
        }
        half *= 2;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn variance_of_a_cosine_is_half_its_squared_amplitude() {
        let value = |x: f64| 0.3 + 2.0 * (3.0 * PI * x).cos() - 0.5 * (11.0 * PI * x).cos();
        let signal: Vec<f64> = (0..=32).map(|k| value(f64::from(k) / 32.0)).collect();
        // Amplitudes 2 and 0.5: 2^2/2 = 2 and 0.5^2/2 = 0.125.
        let variances = harmonic_variances(&signal);
        for (k, variance) in variances.iter().enumerate() {
            let expected = [(3, 2.0), (11, 0.125)].iter().find(|(n, _)| *n == k + 1);
            let expected = expected.map_or(0.0, |(_, variance)| *variance);
            assert!((variance - expected).abs() < 1e-14, "{}: {variance}", k + 1);
        }
    }

    #[test]
    fn variances_of_a_ramp_follow_its_fourier_series() {
        // x = 1/2 - sum over odd k of 4/(pi k)^2 cos(pi k x).
        let signal: Vec<f64> = (0..=1024).map(|k| f64::from(k) / 1024.0).collect();
        let variances = harmonic_variances(&signal);
        for k in [1, 2, 3, 4, 5, 9] {
            let expected =
                if k % 2 == 1 { 0.5 * (4.0 / (PI * k as f64).powi(2)).powi(2) } else { 0.0 };
            assert!((variances[k - 1] - expected).abs() < 1e-6, "{k}: {}", variances[k - 1]);
        }
    }
}
