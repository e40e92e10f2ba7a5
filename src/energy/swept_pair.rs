//! Distance of two edges, and whether one passes through the other within a step.
//!
//! [`segment_distance`] is the distance of two straight segments, m: the least over their closest points, which are
//! both interior, or one or both at ends. [`passes_edge`] is the criterion of [`swept_edge`](crate::energy::swept_edge)
//! for this distance, with the sum of both radii as reach. Edges that cross have a distance of zero in between.
//!
//! Input: positions of the nodes of both edges before and after the step, m, and the sum of the radii, m.

use crate::energy::swept_edge::passes;
use crate::numerics::vector::{Vector, combine, dot, norm, sub};

/// Nodes of two edges, m.
pub(crate) type TwoEdges = [[Vector<f64>; 2]; 2];

/// Distance of two segments, m; NaN for positions that are not finite.
pub(crate) fn segment_distance([[a, b], [c, d]]: TwoEdges) -> f64 {
    let (u, v, w) = (sub(b, a), sub(d, c), sub(a, c));
    let (uu, uv, vv, uw, vw) = (dot(u, u), dot(u, v), dot(v, v), dot(u, w), dot(v, w));
    // Closest points of both lines, on the first segment; parallel ones have any, so that its start serves.
    let determinant = uu * vv - uv * uv;
    let on_first = if determinant > 1e-14 * uu * vv {
        ((uv * vw - vv * uw) / determinant).clamp(0.0, 1.0)
    } else {
        0.0
    };
    let on_second = (uv * on_first + vw) / vv;
    // Beyond an end of the second segment that end is closest, and the first point is the one closest to it.
    let (t, s) = match on_second {
        s if s < 0.0 => ((-uw / uu).clamp(0.0, 1.0), 0.0),
        s if s > 1.0 => (((uv - uw) / uu).clamp(0.0, 1.0), 1.0),
        s => (on_first, s),
    };
    norm(sub(combine(1.0 - t, a, t, b), combine(1.0 - s, c, s, d)))
}

/// Whether two edges whose nodes move from `before` to `now`, m, on straight lines pass through each other. `reach` is
/// the sum of their radii, m.
pub(crate) fn passes_edge(reach: f64, before: TwoEdges, now: TwoEdges) -> bool {
    let movement = |edge: usize| {
        let of_node = |i: usize| norm(sub(now[edge][i], before[edge][i]));
        of_node(0).max(of_node(1))
    };
    passes(movement(0) + movement(1), reach, |t| {
        segment_distance(
            [0, 1].map(|e| [0, 1].map(|i| combine(1.0 - t, before[e][i], t, now[e][i]))),
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The closed form is the least distance of many points of both segments, in all its cases.
    #[test]
    fn distance_is_that_of_the_closest_points() {
        let first = [[0.0, 0.0, 0.0], [1.0, 0.2, 0.0]];
        let mut cases = 0;
        for shift in [-1.5, -0.2, 0.4, 0.9, 1.4] {
            for height in [0.1, 0.7] {
                for way in [[1.0, 0.2, 0.0], [0.1, 1.0, 0.3], [-0.5, 0.4, 1.0], [0.0, 0.0, -1.0]] {
                    let start = [shift, -0.3, height];
                    let second = [start, [0, 1, 2].map(|k| start[k] + way[k])];
                    let found = segment_distance([first, second]);
                    let mut least = f64::INFINITY;
                    for i in 0..=200 {
                        for k in 0..=200 {
                            let (t, s) = (f64::from(i) / 200.0, f64::from(k) / 200.0);
                            let [p, q] = [(t, first), (s, second)]
                                .map(|(t, [a, b])| combine(1.0 - t, a, t, b));
                            least = least.min(norm(sub(p, q)));
                        }
                    }
                    assert!(found <= least + 1e-12 && least < found + 5e-3, "{found} {least}");
                    assert!((found - segment_distance([second, first])).abs() < 1e-12);
                    cases += 1;
                }
            }
        }
        assert_eq!(cases, 40);
    }

    /// An edge that crosses another in a step has passed it; one that stops before it, or slides along it, has not.
    #[test]
    fn crossing_edges_pass_each_other() {
        let still = [[-0.5, 0.0, 0.0], [0.5, 0.0, 0.0]];
        let across = |height: f64, shift: f64| [[shift, -0.5, height], [shift, 0.5, height]];
        let passes = |before, now| passes_edge(0.01, [still, before], [still, now]);
        assert!(passes(across(0.02, 0.0), across(-0.02, 0.0)));
        assert!(passes(across(0.3, 0.1), across(-0.4, 0.0)));
        assert!(!passes(across(0.02, 0.0), across(0.0095, 0.0)));
        assert!(!passes(across(0.0098, -0.1), across(0.0098, 0.1)));
        assert!(!passes(across(0.02, 0.6), across(-0.02, 0.6)));
    }
}
