//! Offset of an observed point of unknown arc length from the simulated rod: to the foot of its perpendicular.
//!
//! Input: recorded positions of the nodes, m, with their arc lengths, an observed point `y`, and an approximate arc
//! length. The arc length `s` of the foot satisfies `(x(s) - y).x'(s) = 0` in the observed coordinates, with cubic
//! polynomials through the nodes. It is found by bisection between the two neighbors of the nearest node, among the
//! nodes within [`SEARCH_RADIUS`] rod lengths of the approximate arc length. Without a sign change the arc length is
//! that of one of these two neighbors, and fixed. Else a foot follows the parameters: with `f(s, p)` for the left side,
//! `ds/dp = -f_p/f_s`, which two Newton steps over a number with derivatives yield to second order. Output: the offset
//! `x(s) - y`, m (along a coordinate not observed, that of the foot). It has no part along the rod: the data constrain
//! the line of the rod, not the place of the observed point on it (orthogonal distance regression, Boggs and Rogers
//! 1990).

use crate::numerics::scalar::Scalar;
use crate::scene::Stencil;

/// Half-width of the range in which the foot is searched, over the length of the rod. The range is centered at the arc
/// length that chords between the observed points yield.
const SEARCH_RADIUS: f64 = 0.2;
/// Number of bisections of the two edges at the nearest node: they determine the arc length of the foot to 1e-12 of an
/// edge.
const BISECTIONS: usize = 40;
/// Step of the difference quotient of `f`, over the length of an edge. `f` is a polynomial; an approximate slope is
/// sufficient for Newton's method.
const DIFFERENCE_STEP: f64 = 1e-4;

/// The nodes of a rod as a curve over the arc length, over a scalar type that may carry derivatives.
pub(crate) struct NodeCurve<'a, D> {
    /// Recorded positions of the nodes, m.
    pub nodes: &'a [[D; 3]],
    /// Arc lengths of the nodes, m.
    pub arc_length: &'a [D],
}

/// Position and tangent of a curve at one arc length.
struct CurvePoint<D> {
    /// m.
    position: [D; 3],
    /// Derivative of the position by the arc length.
    tangent: [D; 3],
}

impl<D: Scalar> NodeCurve<'_, D> {
    /// The vector from the `observed` point to the foot point, m, with derivatives of first and second order, searched
    /// about the arc length `near`, m. Its component along a coordinate that was not observed is the coordinate of the
    /// foot point. If the two edges at the nearest node have no foot of a perpendicular, the vector is that to one of
    /// their outer ends, at a fixed arc length.
    pub fn offset(&self, observed: &[Option<D>; 3], near: f64) -> [D; 3] {
        let plain_nodes: Vec<[f64; 3]> = self.nodes.iter().map(|x| x.map(|c| c.value())).collect();
        let plain_arcs: Vec<f64> = self.arc_length.iter().map(D::value).collect();
        let plain = NodeCurve { nodes: &plain_nodes, arc_length: &plain_arcs };
        let plain_observed = observed.map(|x| x.map(|c| c.value()));
        let (foot, is_inside) = plain.foot(&plain_observed, near);
        let mut s = D::from(foot);
        if is_inside {
            // Two Newton steps carry the derivatives of the foot by the parameters to second order.
            let step = DIFFERENCE_STEP * (plain_arcs[1] - plain_arcs[0]);
            let slope_at = |s: f64| plain.slope(&plain_observed, s);
            let slope = (slope_at(foot + step) - slope_at(foot - step)) / (2.0 * step);
            // The slope may be plain: each step with it makes one more order of the derivatives exact.
            for _ in 0..2 {
                let excess = self.slope(observed, s);
                s -= excess / slope;
            }
        }
        let position = self.interpolate(s).position;
        std::array::from_fn(|c| position[c] - observed[c].unwrap_or_else(|| D::from(0.0)))
    }

    /// Half the derivative of the squared distance from the `observed` point by the arc length, m, at the arc length
    /// `s`, m: `(x - y).x'` over the observed coordinates.
    fn slope(&self, observed: &[Option<D>; 3], s: D) -> D {
        let CurvePoint { position, tangent } = self.interpolate(s);
        let parts = (0..3).filter_map(|c| Some((position[c] - observed[c]?) * tangent[c]));
        parts.fold(D::from(0.0), |sum, part| sum + part)
    }

    /// Position and tangent at an arc length `s`, m, by the cubic Lagrange polynomial through the four nodes around it
    /// (fewer if the rod has fewer). Both carry the derivatives of nodes, arc lengths and `s`. The tangent is `dx/ds`,
    /// of length about 1.
    fn interpolate(&self, s: D) -> CurvePoint<D> {
        let near = Stencil::around(self.arc_length, s.value());
        let zero = [D::from(0.0); 3];
        let mut found = CurvePoint { position: zero, tangent: zero };
        for i in near.clone() {
            let others: Vec<usize> = near.clone().filter(|j| *j != i).collect();
            let factor =
                |j: usize| (s - self.arc_length[j]) / (self.arc_length[i] - self.arc_length[j]);
            let weight = others.iter().fold(D::from(1.0), |product, j| product * factor(*j));
            // Product rule: the derivative is a sum of products, each without one of the factors.
            let mut rate = D::from(0.0);
            for k in &others {
                let rest = others.iter().filter(|j| *j != k);
                let product = rest.fold(D::from(1.0), |product, j| product * factor(*j));
                rate += product / (self.arc_length[i] - self.arc_length[*k]);
            }
            for c in 0..3 {
                found.position[c] += weight * self.nodes[i][c];
                found.tangent[c] += rate * self.nodes[i][c];
            }
        }
        found
    }
}

impl NodeCurve<'_, f64> {
    /// The arc length, m, of the point of the curve nearest to the `observed` one, and whether that point is a foot of
    /// a perpendicular. Nodes within [`SEARCH_RADIUS`] lengths of `near`, m, compete, by the distance in the observed
    /// coordinates; if none does, the last node counts as nearest. Bisection follows in the two edges at the nearest
    /// node. `false`: the distance grows from their lower end on, or else falls up to their upper end, and the arc
    /// length of this end is returned.
    fn foot(&self, observed: &[Option<f64>; 3], near: f64) -> (f64, bool) {
        let last = self.arc_length.len() - 1;
        let (start, end) = (self.arc_length[0].max(0.0), self.arc_length[last]);
        let radius = SEARCH_RADIUS * (end - start);
        let distance = |i: usize| {
            let parts = (0..3).filter_map(|c| Some((self.nodes[i][c] - observed[c]?).powi(2)));
            parts.sum::<f64>()
        };
        // Of a curved rod several nodes may be near the point: only those about the approximate arc length compete.
        let is_near = |i: &usize| (self.arc_length[*i] - near.clamp(start, end)).abs() <= radius;
        let nearest =
            (0..=last).filter(is_near).min_by(|i, j| distance(*i).total_cmp(&distance(*j)));
        let nearest = nearest.unwrap_or(last);
        // The foot is in one of the two edges at the nearest node, or at an end of the curve.
        let mut low = self.arc_length[nearest.saturating_sub(1)].max(start);
        let mut high = self.arc_length[(nearest + 1).min(last)];
        // A distance that grows from the lower end, or falls up to the upper one, has its minimum there.
        if self.slope(observed, low) >= 0.0 {
            return (low, false);
        }
        if self.slope(observed, high) <= 0.0 {
            return (high, false);
        }
        // Bisection is safe for any curvature; the derivatives follow by Newton steps afterwards.
        for _ in 0..BISECTIONS {
            let middle = 0.5 * (low + high);
            match self.slope(observed, middle) < 0.0 {
                true => low = middle,
                false => high = middle,
            }
        }
        (0.5 * (low + high), true)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use num_dual::Dual64;

    /// Nodes and arc lengths of an arc of the radius `r`, m, in edges of 0.01 m, with derivatives by the radius.
    fn arc(r: f64) -> (Vec<[Dual64; 3]>, Vec<Dual64>) {
        let s: Vec<f64> = (0..40).map(|i| 0.01 * f64::from(i)).collect();
        let node = |s: &f64| {
            let (sin, cos) = (s / r).sin_cos();
            let x = Dual64::new(r * sin, sin - s / r * cos);
            let y = Dual64::new(r * (cos - 1.0), cos - 1.0 + s / r * sin);
            [x, y, Dual64::from(0.0)]
        };
        (s.iter().map(node).collect(), s.into_iter().map(Dual64::from).collect())
    }

    /// The offset from a circle of radius r is the distance to its center less r: -1 per meter of r along the normal.
    #[test]
    fn offset_from_arc_is_radial_with_exact_derivative() {
        let (nodes, arc_length) = arc(0.3);
        let curve = NodeCurve { nodes: &nodes, arc_length: &arc_length };
        for (angle, off) in [(0.3_f64, 0.004), (0.8, -0.003), (1.1, 0.0)] {
            let radius = 0.3 + off;
            let observed = [Some(radius * angle.sin()), Some(radius * angle.cos() - 0.3), None];
            // The approximate arc length has an error of 0.05 m.
            let offset = curve.offset(&observed.map(|x| x.map(Dual64::from)), 0.3 * angle + 0.05);
            let normal = [angle.sin(), angle.cos()];
            for c in 0..2 {
                assert!((offset[c].re + off * normal[c]).abs() < 1e-7, "{offset:?}");
                // The center moves down by dr, and the circle grows by dr.
                let about = [0.0, -1.0];
                let along = normal[0] * about[0] + normal[1] * about[1] + 1.0;
                // The normal turns about the observed point as the center moves.
                let turn = (about[c] - normal[c] * (along - 1.0)) / radius;
                let expected = along * normal[c] + off * turn;
                assert!(
                    (offset[c].eps - expected).abs() < 1e-5,
                    "{angle} {off}: {offset:?} {expected}"
                );
            }
        }
    }

    /// The nearest point of a curve to a point beyond its end is the end.
    #[test]
    fn offset_of_point_beyond_tip_is_offset_from_tip() {
        let (nodes, arc_length) = arc(0.3);
        let curve = NodeCurve { nodes: &nodes, arc_length: &arc_length };
        let tip = nodes[39].map(|x| x.re);
        let beyond = [Some(tip[0] + 0.01), Some(tip[1] - 0.01), None];
        let offset = curve.offset(&beyond.map(|x| x.map(Dual64::from)), 0.5);
        let [x, y, _] = offset.map(|x| x.re);
        assert!((x + 0.01).abs() < 1e-12 && (y - 0.01).abs() < 1e-12, "{offset:?}");
    }
}
