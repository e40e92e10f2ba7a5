//! Corrected stiffness of the joints of a polygon that represents a curved rest shape: see [`crate::problem::model`].
//!
//! A joint resists bending and twisting about axes that lie along the curve, not along its two edges. Input: nodes and
//! lengths of arcs between them (m), frames of the edges, and integrated curvatures of the joints. [`joint_slants`]
//! returns for each joint its slant: the components of the curve's unit tangent (polynomial through the five nearest
//! nodes) along the two bending axes of the joint. A slant of more than half the turning angle is set to zero: the
//! polygon is too coarse. [`natural_slant`] converts it to the stress-free shape, with the curvature factor and the
//! natural twist. [`resistances`] returns three rows of coefficients of the strains: the combinations that the joint
//! resists with `EI1`, `EI2` and `GJ`, from the natural curvature and the slant. Zero for both gives [`PLAIN`]. The
//! spatial model builds the stiffness matrix of the joint from them.

use crate::energy::frame::{EdgeFrame, transport};
use crate::numerics::scalar::Scalar;
use crate::numerics::vector::{Vector, add, cross, dot, scale, sub, unit};

/// Strains `[k1, k2, tau]` in which a joint resists with EI1, with EI2 and with GJ: its stiffness
/// is `EI1 a a' + EI2 b b' + GJ c c'`, over its length.
pub(crate) type Resistances<D> = [[D; 3]; 3];

/// Uncorrected resistances: each strain with its own stiffness.
pub(crate) const PLAIN: Resistances<f64> = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

/// The slant of every joint: the components of the unit tangent of the curve at rest along the two bending axes of the
/// joint. They are zero if the curve has the tangent of the joint, and if the polygon is too coarse ([`limit_slant`]).
/// `nodes` and `arcs` are positions and lengths along the curve, m. `edges` has the material frames, `curvature` the
/// integrated curvature of each joint in them.
pub(crate) fn joint_slants<D: Scalar>(
    nodes: &[Vector<D>],
    arcs: &[D],
    edges: &[EdgeFrame<D>],
    curvature: &[[D; 2]],
) -> Vec<[D; 2]> {
    let joint = |(i, k): (usize, &[D; 2])| {
        let slant = bending_components(tangent(nodes, arcs, i + 1), &edges[i], &edges[i + 1]);
        limit_slant(slant, *k)
    };
    curvature.iter().enumerate().map(joint).collect()
}

/// The `slant` of a joint with the integrated curvature `k`, or zero if its angle exceeds half the turning angle,
/// `atan(|k|/2)`. The polygon is then too coarse to determine it.
fn limit_slant<D: Scalar>(slant: [D; 2], k: [D; 2]) -> [D; 2] {
    let [k, s] = [k, slant].map(|v| v[0].value().powi(2) + v[1].value().powi(2));
    let half = 0.25 * k;
    if s * (1.0 + half) <= half { slant } else { [D::from(0.0); 2] }
}

/// The slant in the stress-free shape, `factor (slant - twist k/6)`. `slant` and the integrated curvature `k` are those
/// at rest. `factor` is that of the natural curvature, `twist` the natural twist of the joint, rad. Zero if it is too
/// large for the curvature `factor k` ([`limit_slant`]).
pub(crate) fn natural_slant<D: Scalar>(slant: [D; 2], factor: D, k: [D; 2], twist: D) -> [D; 2] {
    let natural = [0, 1].map(|c| factor * (twist * (k[c] * (-1.0 / 6.0)) + slant[c]));
    limit_slant(natural, k.map(|k| factor * k))
}

/// Unit tangent of the curve at node `i`: that of the Lagrange polynomial of arc length through the five nearest nodes,
/// m. A short rod has fewer; at the ends the five are to one side. `arcs` are the lengths along the curve between the
/// nodes, m.
fn tangent<D: Scalar>(nodes: &[Vector<D>], arcs: &[D], i: usize) -> Vector<D> {
    let (zero, one) = (D::from(0.0), D::from(1.0));
    let count = nodes.len().min(5);
    // Five nodes around the joint, fewer at the ends: the derivative of the Lagrange polynomial.
    let first = i.saturating_sub(2).min(nodes.len() - count);
    // Arc length of node j relative to node i.
    let sum = |lengths: &[D]| lengths.iter().fold(zero, |sum, l| sum + *l);
    let s = |j: usize| if j < i { -sum(&arcs[j..i]) } else { sum(&arcs[i..j]) };
    let mut total = [zero; 3];
    for j in (first..first + count).filter(|j| *j != i) {
        let others = (first..first + count).filter(|m| ![i, j].contains(m));
        let weight = others.fold(one, |product, m| product * (s(m) / (s(m) - s(j)))) / s(j);
        total = add(total, scale(sub(nodes[j], nodes[i]), weight));
    }
    unit(total)
}

/// Components of the unit tangent `t` along the two bending axes of the joint between the edges `e` and `f`. These are
/// its directors `m2` and `-m1`, those of `e` transported to the mean tangent of both edges.
fn bending_components<D: Scalar>(t: Vector<D>, e: &EdgeFrame<D>, f: &EdgeFrame<D>) -> [D; 2] {
    let between = unit(add(e.tangent, f.tangent));
    let m1 = transport(e.tangent, between, e.director);
    [dot(t, cross(between, m1)), -dot(t, m1)]
}

/// Three rows of coefficients of the strains `[k1, k2, tau]`: those in which a joint resists with EI1, EI2 and GJ. Each
/// row is an axis, rotated by the slant `[a, b]`, times the matrix `S`. `S` is `c^2` along and `c` across the natural
/// curvature `k`, and `c` for twist, with `c = cos(phi/2)` and `tan(phi/2) = |k|/2`. [`PLAIN`] for zero curvature and
/// slant.
pub(crate) fn resistances<D: Scalar>(k: [D; 2], [a, b]: [D; 2]) -> Resistances<D> {
    // c = cos(phi/2) with tan(phi/2) = |k|/2.
    let c2 = ((k[0] * k[0] + k[1] * k[1]) * 0.25 + 1.0).recip();
    let c = c2.sqrt();
    // S = [s11, s12, s22] is c^2 along the curvature and c across it; (c^2 - c)/|k|^2 is written
    // without cancellation.
    let along = -(c2 * c) / (c + 1.0) * 0.25;
    let s12 = along * k[0] * k[1];
    let (s11, s22) = (c + along * k[0] * k[0], c + along * k[1] * k[1]);
    // The axes of the joint after the smallest rotation onto the tangent of the curve.
    let one = D::from(1.0);
    let z = (one - a * a - b * b).sqrt();
    let by = (z + 1.0).recip();
    let across = -(a * b * by);
    let axes = [[one - a * a * by, across, -a], [across, one - b * b * by, -b], [a, b, z]];
    axes.map(|[x, y, z]| [s11 * x + s12 * y, s12 * x + s22 * y, c * z])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::energy::frame::Frames;
    use nalgebra::Vector3;

    /// A helix of unit radius and torsion 1/2 in steps of `l`, and its tangent at node `i`.
    fn helix(l: f64) -> (Vec<[f64; 3]>, impl Fn(usize) -> Vector<f64>) {
        let point = |p: f64| [p.cos(), p.sin(), p];
        let node = move |i: usize| point(i as f64 * l / 2f64.sqrt());
        let tangent = move |i: usize| {
            let p = i as f64 * l / 2f64.sqrt();
            unit([-p.sin(), p.cos(), 1.0])
        };
        ((0..9).map(node).collect(), tangent)
    }

    #[test]
    fn tangent_is_of_fourth_order_up_to_the_ends() {
        for i in [1, 2, 4, 7] {
            let error = |l: f64| {
                let (nodes, exact) = helix(l);
                let off = Vector3::from(tangent(&nodes, &[l; 8], i)) - Vector3::from(exact(i));
                off.norm()
            };
            let order = (error(0.1) / error(0.05)).log2();
            // Five nodes: the interpolation has an error of fourth order.
            assert!(order > 3.8, "{i}: {} {order}", error(0.1));
        }
    }

    /// The axis of a joint deviates by l^2 kappa tau/6 towards the binormal (derivation: [`crate::problem::model`]).
    #[test]
    fn slant_of_a_helix_equals_the_derived_one() {
        let l = 0.05;
        let (nodes, exact) = helix(l);
        let edge = |i: usize| Vector3::from(nodes[i + 1]) - Vector3::from(nodes[i]);
        let tangents: Vec<[f64; 3]> = (0..8).map(|i| edge(i).normalize().into()).collect();
        let frames = Frames::bishop(&tangents, unit(cross(tangents[0], [0.3, 0.5, 0.8])));
        let lean = bending_components(exact(4), &frames.edges[3], &frames.edges[4]);
        let size = lean[0].hypot(lean[1]);
        // kappa = tau = 1/2.
        assert!((size / (l * l / 24.0) - 1.0).abs() < l * l, "{size}");
    }

    /// Natural twist has the same effect as the equal torsion of the curve.
    #[test]
    fn slant_by_natural_twist_equals_that_by_torsion() {
        let l = 0.05;
        let (nodes, exact) = helix(l);
        let edge = |i: usize| Vector3::from(nodes[i + 1]) - Vector3::from(nodes[i]);
        let tangents: Vec<[f64; 3]> = (0..8).map(|i| edge(i).normalize().into()).collect();
        let frames = Frames::bishop(&tangents, unit(cross(tangents[0], [0.3, 0.5, 0.8])));
        let [e, f] = [frames.edges[3], frames.edges[4]];
        let of_curve = bending_components(exact(4), &e, &f);
        // A circle's curvature, kb along the binormal, with the helix's torsion as natural twist.
        let kb = cross(e.tangent, f.tangent);
        let m1 = transport(e.tangent, unit(add(e.tangent, f.tangent)), e.director);
        let m2 = cross(unit(add(e.tangent, f.tangent)), m1);
        let k = [dot(kb, m2), -dot(kb, m1)];
        let of_twist = natural_slant([0.0; 2], 1.0, k, 0.5 * l);
        for c in 0..2 {
            assert!(
                (of_curve[c] - of_twist[c]).abs() < 1e-2 * l * l / 24.0,
                "{of_curve:?} {of_twist:?}"
            );
        }
    }

    /// Straight joints, and planar ones without slant, have no coupling.
    #[test]
    fn resistances_without_slant_equal_the_planar_ones() {
        assert_eq!(resistances([0.0_f64; 2], [0.0; 2]), PLAIN);
        let c2 = 1.0_f64 / (1.0 + 0.25 * 0.09);
        let [a, b, c] = resistances([0.3, 0.0], [0.0; 2]);
        assert!((a[0] - c2).abs() < 1e-15 && (b[1] - c2.sqrt()).abs() < 1e-15);
        assert!((c[2] - c2.sqrt()).abs() < 1e-15);
        assert!([a[1], a[2], b[0], b[2], c[0], c[1]].iter().all(|x| *x == 0.0));
    }

    /// A natural shape that is too curved for its polygon has no slant.
    #[test]
    fn slant_beyond_half_the_turning_angle_is_dropped() {
        let k = [5.1_f64, 0.0];
        for (slant, factor) in [(0.9_f64, 1.2), (0.4, 3.0), (0.1, 20.0)] {
            let natural = k.map(|k| k * factor);
            let all = resistances(natural, natural_slant([0.0, slant], factor, k, 0.0));
            assert!(all.iter().flatten().all(|x| x.is_finite()), "{slant} {factor}");
        }
        assert_eq!(natural_slant([0.0, 0.4], 1.2, k, 0.0), [0.0, 1.2 * 0.4]);
    }
}
