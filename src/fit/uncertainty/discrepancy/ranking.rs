//! Terms in the order in which they explain what is left; those that the data cannot tell apart share a place.
//!
//! Of two terms with scores `a` and `b`, the second may be it as well as the first where it says nothing beside the first
//! (the score of what its direction has beyond the first's is noise) and the first is not better by more than chance,
//! `a^2 - b^2 < 1.64^2`. Were it the second that is there, `a^2 - b^2` would have the mean `-m` and the standard deviation
//! `2 sqrt(m)`, `m` of them what tells the two apart, and be as large in at most 5 of 100 whatever `m` is.

use crate::fit::uncertainty::discrepancy::findings::ScoreTest;
use nalgebra::DVector;
use std::cmp::Ordering;

/// Places that are reported.
const PLACES: usize = 3;
/// By how much a square is larger by more than chance: that of the quantile of 95 %.
const BETTER: f64 = 1.645 * 1.645;
/// What is less than this many standard deviations is noise.
const NOISE: f64 = 1.96;

/// A term, and what the data say of it.
pub(crate) struct Scored {
    pub test: ScoreTest,
    /// Part of what is left that it takes with it.
    pub takes: f64,
    /// What of its direction the unknowns cannot follow.
    pub along: DVector<f64>,
}

/// The best first. What chance hardly explains is in the order of what it takes of what is `left`: motion that is left makes
/// the noise look as if it remembered, along some directions more than along others. `variance` is that of the noise along
/// a direction.
pub(crate) fn ranked(
    mut scored: Vec<Scored>,
    left: &DVector<f64>,
    variance: impl Fn(&DVector<f64>) -> f64,
) -> Vec<ScoreTest> {
    scored.sort_by(order);
    let alike = |best: &Scored, other: &Scored| {
        let [a, b] = [best, other].map(|s| s.test.z_score);
        if other.takes <= 0.0 || a * a - b * b >= BETTER {
            return false;
        }
        let share = best.along.dot(&other.along) / best.along.norm_squared();
        let beyond = &other.along - share * &best.along;
        beyond.dot(left).abs() < NOISE * variance(&beyond).sqrt()
    };
    let mut ranked = Vec::new();
    for rank in 1..=PLACES {
        if scored.is_empty() {
            break;
        }
        let best = scored.remove(0);
        let found = best.test.is_significant();
        let (same, others) = scored.into_iter().partition(|other| found && alike(&best, other));
        scored = others;
        let at = |scored: Scored| ScoreTest { rank, ..scored.test };
        ranked.push(at(best));
        ranked.extend(Vec::into_iter(same).map(at));
    }
    ranked
}

fn order(a: &Scored, b: &Scored) -> Ordering {
    match (a.test.is_significant(), b.test.is_significant()) {
        (true, true) => b.takes.total_cmp(&a.takes),
        _ => a.test.p_value.total_cmp(&b.test.p_value),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Terms along these directions, where noise has a standard deviation of 1.
    fn places(directions: &[[f64; 3]], left: [f64; 3]) -> Vec<(String, usize)> {
        let left = DVector::from_column_slice(&left);
        let scored = |(k, along): (usize, &[f64; 3])| {
            let along = DVector::from_column_slice(along);
            let sigmas = along.dot(&left) / along.norm();
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
            };
            Scored { test, takes: sigmas.abs(), along }
        };
        let scored = directions.iter().enumerate().map(scored).collect();
        let tests = ranked(scored, &left, |along| along.norm_squared());
        tests.into_iter().map(|test| (test.source, test.rank)).collect()
    }

    fn said(places: &[(&str, usize)]) -> Vec<(String, usize)> {
        places.iter().map(|(source, place)| ((*source).into(), *place)).collect()
    }

    /// Two that are nearly one direction share a place; what is left beside them has its own.
    #[test]
    fn what_cannot_be_told_apart_shares_a_place() {
        let directions = [[0.0, 0.0, 1.0], [2.0, 0.1, 0.0], [1.0, 0.0, 0.0]];
        let found = places(&directions, [6.0, 0.5, 4.0]);
        assert_eq!(found, said(&[("1", 1), ("2", 1), ("0", 2)]));
    }

    /// A strong one is told from its neighbour, a weak one is not.
    #[test]
    fn strength_tells_apart() {
        let directions = [[1.0, 0.0, 0.0], [0.8, 0.6, 0.0]];
        assert_eq!(places(&directions, [8.0, 0.0, 0.0]), said(&[("0", 1), ("1", 2)]));
        assert_eq!(places(&directions, [3.0, 1.0, 0.0]), said(&[("1", 1), ("0", 1)]));
    }

    /// What noise explains is not joined.
    #[test]
    fn noise_has_places_of_its_own() {
        let directions = [[1.0, 0.0, 0.0], [1.0, 0.1, 0.0]];
        assert_eq!(places(&directions, [1.0, 0.0, 0.0]), said(&[("0", 1), ("1", 2)]));
    }
}
