//! Ranking of omitted effects by the part of the residuals that they explain; effects that the data cannot separate
//! share a rank.
//!
//! [`ranked`] receives all score tests, each with its direction (the change of the weighted residuals by the effect,
//! orthogonal to the Jacobian), and the weighted residuals. It returns the tests of the first [`RANKS`] ranks, the best
//! first. Significant effects are in the order of the explained part of the residuals, then all others in that of their
//! p-values. The best remaining effect takes the next rank. If it is significant, another effect joins its rank under
//! two conditions, with the z-scores `a` of the best and `b` of the other. First, the part of the other's direction
//! orthogonal to the best one correlates with the residuals by no more than noise does (below [`NOISE`] standard
//! deviations). Second, the best is not significantly better, `a^2 - b^2 < 1.645^2`. Effects of the wrong sign join
//! none. Within a rank, which the data cannot order, significant effects precede the others. Each part is in the order
//! of the estimated size over the plausible one, the smallest first.
//!
//! If the other effect is the cause, this difference has the mean `-m` and the standard deviation `2 sqrt(m)`, where
//! `m` measures the difference of the directions. It exceeds the limit in at most 5 % of all cases, for any `m`.

use crate::fit::uncertainty::discrepancy::findings::ScoreTest;
use crate::numerics::total_order;
use nalgebra::DVector;
use std::cmp::Ordering;

/// Number of ranks that are reported.
const RANKS: usize = 3;
/// Difference of two squared z-scores from which on the first is significantly better: the squared 95 % quantile.
const BETTER: f64 = 1.645 * 1.645;
/// Absolute score (scalar product of a direction with the residuals), in standard deviations, below which it is noise:
/// that of 95 % of pure noise.
const NOISE: f64 = 1.96;

/// A score test with the direction of its effect.
pub(crate) struct ScoredEffect {
    /// Result of the test, whose rank is not determined yet.
    pub test: ScoreTest,
    /// Norm of the part of the weighted residuals that the effect explains; 0 for an effect of the wrong sign.
    pub explained: f64,
    /// Estimated size, in plausible sizes.
    pub sizes: f64,
    /// Change of the weighted residuals by the effect, orthogonal to the Jacobian.
    pub direction: DVector<f64>,
}

/// The tests of the first [`RANKS`] ranks, the best first, with their ranks from 1. The best remaining effect takes the
/// next rank, with all others that cannot be separated from it if it is significant. `residuals` are the weighted ones,
/// `variance` returns that of the noise along a direction.
///
/// Significant ones are in the order of the explained part of the residuals, not of their p-values: unexplained motion
/// looks like autocorrelated noise, along some directions more than along others. All others are in the order of their
/// p-values.
pub(crate) fn ranked(
    mut scored: Vec<ScoredEffect>,
    residuals: &DVector<f64>,
    variance: impl Fn(&DVector<f64>) -> f64,
) -> Vec<ScoreTest> {
    scored.sort_by(order);
    let is_inseparable = |best: &ScoredEffect, other: &ScoredEffect| {
        let [a, b] = [best, other].map(|s| s.test.z_score);
        if other.explained <= 0.0 || a * a - b * b >= BETTER {
            return false;
        }
        // The score of the part of the other direction that the best effect cannot explain.
        let share = best.direction.dot(&other.direction) / best.direction.norm_squared();
        let beyond = &other.direction - share * &best.direction;
        beyond.dot(residuals).abs() < NOISE * variance(&beyond).sqrt()
    };
    let mut ranked = Vec::new();
    for rank in 1..=RANKS {
        if scored.is_empty() {
            break;
        }
        let best = scored.remove(0);
        let is_significant = best.test.is_significant();
        // Insignificant effects are not joined: noise has no cause.
        let (same, others): (Vec<_>, Vec<_>) =
            scored.into_iter().partition(|other| is_significant && is_inseparable(&best, other));
        scored = others;
        let mut group: Vec<ScoredEffect> = std::iter::once(best).chain(same).collect();
        let by_plausibility =
            |own: &ScoredEffect| (!own.test.is_significant(), total_order(own.sizes.abs()));
        group.sort_by_cached_key(by_plausibility);
        ranked.extend(group.into_iter().map(|scored| ScoreTest { rank, ..scored.test }));
    }
    ranked
}

/// Order of two effects: if both are significant by the explained part of the residuals, the largest first; else by
/// their p-values, the smallest first.
fn order(a: &ScoredEffect, b: &ScoredEffect) -> Ordering {
    match (a.test.is_significant(), b.test.is_significant()) {
        (true, true) => b.explained.total_cmp(&a.explained),
        _ => a.test.p_value.total_cmp(&b.test.p_value),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Indices and ranks of effects along `directions`, for noise with a standard deviation of 1. Effect `k` has `3 -
    /// k` plausible sizes.
    fn ranks(directions: &[[f64; 3]], residuals: [f64; 3]) -> Vec<[usize; 2]> {
        let residuals = DVector::from_column_slice(&residuals);
        let scored = |(k, direction): (usize, &[f64; 3])| {
            let direction = DVector::from_column_slice(direction);
            let sigmas = direction.dot(&residuals) / direction.norm();
            let test = ScoreTest {
                source: k.to_string(),
                effect: String::new(),
                rank: 0,
                estimate: 1.0,
                unit: String::new(),
                z_score: sigmas,
                p_value: (-0.5 * sigmas * sigmas).exp(),
                p_value_if_correlated: None,
                bias_std_errors: 0.0,
                biased_parameter: String::new(),
                relative_bias: None,
            };
            ScoredEffect { test, explained: sigmas.abs(), sizes: 3.0 - k as f64, direction }
        };
        let scored = directions.iter().enumerate().map(scored).collect();
        let tests = ranked(scored, &residuals, |direction| direction.norm_squared());
        tests.into_iter().map(|test| [test.source.parse().unwrap(), test.rank]).collect()
    }

    /// Effects 1 and 2 have nearly one direction; the size of effect 2 is more plausible. Effect 0 explains the
    /// residuals orthogonal to it.
    #[test]
    fn effects_with_one_direction_share_a_rank() {
        let directions = [[0.0, 0.0, 1.0], [2.0, 0.1, 0.0], [1.0, 0.0, 0.0]];
        assert_eq!(ranks(&directions, [6.0, 0.5, 4.0]), [[2, 1], [1, 1], [0, 2]]);
    }

    /// Directions at a cosine of 0.8: 8 and 6.4 standard deviations differ significantly, 3 and 3 do not.
    #[test]
    fn strong_effects_are_separated_and_weak_ones_are_not() {
        let directions = [[1.0, 0.0, 0.0], [0.8, 0.6, 0.0]];
        assert_eq!(ranks(&directions, [8.0, 0.0, 0.0]), [[0, 1], [1, 2]]);
        assert_eq!(ranks(&directions, [3.0, 1.0, 0.0]), [[1, 1], [0, 1]]);
    }

    #[test]
    fn insignificant_effects_have_ranks_of_their_own() {
        let directions = [[1.0, 0.0, 0.0], [1.0, 0.1, 0.0]];
        // Both directions are nearly parallel, but the second one is not significant.
        assert_eq!(ranks(&directions, [1.0, 0.0, 0.0]), [[0, 1], [1, 2]]);
    }
}
