//! Convergence of Markov chains: R-hat, effective sample size, and Monte Carlo error of the mean.
//!
//! Input are the draws of one quantity, a list of equal length for every chain. Chains are split in halves, so that a
//! trend within a chain is a difference between chains. R-hat compares the variance of all draws with that within the
//! chains, for draws replaced by normal scores of their ranks, and for distances from the median; the larger one is
//! reported (Vehtari, Gelman, Simpson, Carpenter and Buerkner 2021). The effective sample size of the bulk is that of
//! the normal scores, by Geyer's initial monotone sequence of autocorrelations. [`Diagnostics::new`] returns none for
//! draws without a spread.

use statrs::distribution::{ContinuousCDF, Normal};

/// Quality of the draws of one quantity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Diagnostics {
    /// Rank-normalized split R-hat; 1 for chains of one distribution.
    pub r_hat: f64,
    /// Effective sample size of the bulk of the distribution.
    pub effective_draws: f64,
    /// Monte Carlo standard error of the mean, in the unit of the quantity.
    pub mc_error: f64,
}

impl Diagnostics {
    /// The diagnostics of `chains` of equal length, 4 draws or more. None where the variance within the halves of the
    /// chains is zero or not finite.
    pub fn new(chains: &[Vec<f64>]) -> Option<Self> {
        let halves: Vec<Vec<f64>> = chains.iter().flat_map(|chain| split(chain)).collect();
        let scores = normal_scores(&halves);
        let mut sorted: Vec<f64> = halves.concat();
        sorted.sort_by(f64::total_cmp);
        let median = sorted[sorted.len() / 2];
        let distance = |half: &Vec<f64>| half.iter().map(|x| (x - median).abs()).collect();
        let distances: Vec<Vec<f64>> = halves.iter().map(distance).collect();
        let tails = normal_scores(&distances);
        // Moments of the draws themselves give the error of their mean.
        let effective = effective_size(&halves)?;
        let n = sorted.len() as f64;
        let mean = sorted.iter().sum::<f64>() / n;
        let variance = sorted.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / (n - 1.0);
        Some(Self {
            r_hat: r_hat(&scores)?.max(r_hat(&tails)?),
            effective_draws: effective_size(&scores)?,
            mc_error: (variance / effective).sqrt(),
        })
    }
}

/// Both halves of a chain; the middle draw of an odd number is left out.
fn split(chain: &[f64]) -> [Vec<f64>; 2] {
    let half = chain.len() / 2;
    [chain[..half].to_vec(), chain[chain.len() - half..].to_vec()]
}

/// Normal scores of the ranks of all draws: the normal quantile at `(rank - 3/8)/(count + 1/4)`. Equal draws share the
/// mean of their ranks.
fn normal_scores(chains: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let mut places: Vec<(f64, usize, usize)> = Vec::new();
    for (k, chain) in chains.iter().enumerate() {
        places.extend(chain.iter().enumerate().map(|(i, x)| (*x, k, i)));
    }
    places.sort_by(|a, b| a.0.total_cmp(&b.0));
    let normal = Normal::standard();
    let count = places.len() as f64;
    let mut scores = chains.to_vec();
    for equal in places.chunk_by(|a, b| a.0 == b.0).scan(0, |first, equal| {
        *first += equal.len();
        Some((*first - equal.len(), equal))
    }) {
        let (first, equal) = equal;
        let rank = first as f64 + (equal.len() as f64 + 1.0) / 2.0;
        let score = normal.inverse_cdf((rank - 0.375) / (count + 0.25));
        equal.iter().for_each(|(_, k, i)| scores[*k][*i] = score);
    }
    scores
}

/// Mean of each chain, mean of the variances within the chains, and variance of all draws by both; each chain counts
/// the same.
struct ChainMoments {
    means: Vec<f64>,
    within: f64,
    total: f64,
}

impl ChainMoments {
    /// Moments of chains of equal length; none without a finite, positive variance.
    fn new(chains: &[Vec<f64>]) -> Option<Self> {
        let (m, n) = (chains.len() as f64, chains[0].len() as f64);
        let mean = |chain: &Vec<f64>| chain.iter().sum::<f64>() / n;
        let means: Vec<f64> = chains.iter().map(mean).collect();
        let squares = |(chain, mean): (&Vec<f64>, &f64)| {
            chain.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / (n - 1.0)
        };
        let within = chains.iter().zip(&means).map(squares).sum::<f64>() / m;
        let all = means.iter().sum::<f64>() / m;
        let between = means.iter().map(|mean| (mean - all).powi(2)).sum::<f64>() / (m - 1.0);
        let total = within * (n - 1.0) / n + between;
        (within > 0.0 && total.is_finite()).then_some(Self { means, within, total })
    }
}

/// Root of the variance of all draws over that within the chains.
fn r_hat(chains: &[Vec<f64>]) -> Option<f64> {
    let ChainMoments { within, total, .. } = ChainMoments::new(chains)?;
    Some((total / within).sqrt())
}

/// Number of independent draws with the same error of the mean, at most `N log10(N)` of `N` draws. The autocorrelation
/// is that over all chains, and its sum ends where that of two neighbors is no longer positive (Geyer 1992).
fn effective_size(chains: &[Vec<f64>]) -> Option<f64> {
    let ChainMoments { means, within, total } = ChainMoments::new(chains)?;
    let (m, n) = (chains.len() as f64, chains[0].len());
    // Autocorrelation at a lag, by the autocovariance of every chain about its own mean.
    let correlation = |lag: usize| {
        let covariance = |(chain, mean): (&Vec<f64>, &f64)| {
            let pairs = chain.iter().zip(&chain[lag..]);
            pairs.map(|(a, b)| (a - mean) * (b - mean)).sum::<f64>() / n as f64
        };
        let mean = chains.iter().zip(&means).map(covariance).sum::<f64>() / m;
        1.0 - (within - mean) / total
    };
    let mut sum = 0.0;
    let mut before = f64::INFINITY;
    for lag in (0..n.saturating_sub(1)).step_by(2) {
        let first = if lag == 0 { 1.0 } else { correlation(lag) };
        let pair = first + correlation(lag + 1);
        if pair <= 0.0 {
            break;
        }
        // Sums of pairs of a reversible chain decrease.
        before = pair.min(before);
        sum += before;
    }
    let draws = m * n as f64;
    let time = (2.0 * sum - 1.0).max(1.0 / draws.log10());
    Some(draws / time)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    /// Chains `x' = a x + sqrt(1 - a^2) noise + offset`, with the offset of each chain.
    fn chains(a: f64, offsets: &[f64], n: usize) -> Vec<Vec<f64>> {
        let mut random = ChaCha8Rng::seed_from_u64(4);
        let chain = |offset: &f64| {
            let mut x = 0.0;
            let mut next = || {
                let noise: f64 = StandardNormal.sample(&mut random);
                x = a * x + (1.0 - a * a).sqrt() * noise;
                x + offset
            };
            (0..n).map(|_| next()).collect()
        };
        offsets.iter().map(chain).collect()
    }

    /// The effective size of an AR(1) chain is `N (1 - a)/(1 + a)`.
    #[test]
    fn effective_size_of_ar1_chain_is_the_known_one() {
        for (a, part) in [(0.0, 1.0), (0.5, 1.0 / 3.0), (-0.4, 1.4 / 0.6), (0.9, 1.0 / 19.0)] {
            let found = Diagnostics::new(&chains(a, &[0.0; 4], 20_000)).unwrap();
            let size = found.effective_draws / 80_000.0;
            assert!((size / part - 1.0).abs() < 0.12, "{a}: {size} for {part}");
            assert!(found.r_hat < 1.01, "{a}: {found:?}");
            let error = (1.0 / (80_000.0 * part)).sqrt();
            assert!((found.mc_error / error - 1.0).abs() < 0.1, "{a}: {found:?}");
        }
    }

    /// Chains about means that differ by 0.5, or a trend in one chain, are detected; equal draws have no diagnostics.
    #[test]
    fn r_hat_of_unequal_chains_exceeds_the_limit() {
        let unequal = Diagnostics::new(&chains(0.0, &[0.0, 0.5], 1000)).unwrap();
        assert!(unequal.r_hat > 1.02, "{unequal:?}");
        let trend: Vec<f64> = chains(0.0, &[0.0], 1000)[0]
            .iter()
            .zip(0..)
            .map(|(x, k)| x + 2e-3 * f64::from(k))
            .collect();
        assert!(Diagnostics::new(&[trend]).unwrap().r_hat > 1.05);
        // Equal means and unequal spreads: only the distances from the median differ.
        let mut spreads = chains(0.0, &[0.0, 0.0], 1000);
        spreads[0].iter_mut().for_each(|x| *x *= 2.0);
        assert!(Diagnostics::new(&spreads).unwrap().r_hat > 1.05);
        assert_eq!(Diagnostics::new(&[vec![1.0; 100], vec![1.0; 100]]), None);
    }
}
