//! Derivatives of the energy of two touching edges by hand against dual numbers and differences, its independence of
//! the mesh, and the balance of its forces.

use super::*;
use crate::energy::autodiff::{self, ScalarFunction};
use crate::numerics::vector::{add, cross};
use num_dual::Dual64;

const STIFFNESS: f64 = 3e9;

/// The energy of a pair as a function of all coordinates.
struct EnergyOfPair<'a, B>(&'a EdgePair<B>);

impl<B: Scalar> ScalarFunction<B> for EnergyOfPair<'_, B> {
    fn at<D: Scalar>(&self, over: impl Fn(B) -> D + Copy, q: &[D]) -> D {
        self.0.map(over).energy(nodes(q))
    }
}

/// Nodes of both edges.
fn nodes<D: Scalar>(q: &[D]) -> [EdgeNodes<D>; 2] {
    [0, 1].map(|edge| [0, 1].map(|node| components(|k| q[6 * edge + 3 * node + k])))
}

/// All coordinates of the nodes of both edges.
fn coordinates(edges: [EdgeNodes<f64>; 2]) -> [f64; 12] {
    components(|i| edges[i / 6][i / 3 % 2][i % 3])
}

/// Gradient and lower triangle of the Hessian by hand.
fn by_hand<D: Scalar>(pair: &EdgePair<D>, q: &[D; 12]) -> ([D; 12], [[D; 12]; 12]) {
    let mut sums = PairDerivatives::zero();
    pair.derive(nodes(q), true, &mut sums);
    let gradient = components(|i| sums.gradient[i / 3][i % 3]);
    let zero = [D::from(0.0); 12];
    let mut hessian = [zero; 12];
    for i in 0..12 {
        for j in 0..=i {
            hessian[i][j] = sums.hessian[i / 3][j / 3][i % 3][j % 3];
        }
    }
    (gradient, hessian)
}

/// A pair of edges of 25 and 30 mm with radii of 4 and 3 mm.
fn pair(goes_on: [bool; 2]) -> EdgePair<f64> {
    EdgePair { lengths: [0.025, 0.03], radii: [0.004, 0.003], stiffness: STIFFNESS, goes_on }
}

/// Pairs of edges: parallel, skew, crossing, one end beside the middle of the other edge, ends beside each other, and
/// apart.
fn pairs() -> Vec<[EdgeNodes<f64>; 2]> {
    let mut all = Vec::new();
    let first = [[0.01, -0.02, 0.005], [0.03, -0.011, 0.013]];
    let axis = scale(sub(first[1], first[0]), 0.025_f64.recip());
    let side = unit(cross(axis, [0.2, 0.1, 1.0]));
    let third = cross(axis, side);
    for height in [0.8, 0.95, 1.2] {
        for slope in [-0.9, -0.1, 0.0, 0.4] {
            for turn in [0.0_f64, 0.3, 1.2, 2.9] {
                for shift in [-0.02, 0.003, 0.012, 0.024] {
                    let at = |x: f64| {
                        let (along, across) = (x * turn.cos(), x * turn.sin());
                        let out = 0.007 * height + slope * x;
                        components(|k| {
                            let place = first[0][k] + (shift + along) * axis[k];
                            place + across * third[k] + out * side[k]
                        })
                    };
                    all.push([first, [at(0.0), at(0.03)]]);
                }
            }
        }
    }
    all
}

/// Unit vector.
fn unit(v: [f64; 3]) -> [f64; 3] {
    scale(v, norm(v).recip())
}

/// Hand-derived gradient and Hessian against those of the energy in dual numbers, for plain numbers and for dual ones
/// with derivatives by lengths, radii, stiffness and nodes.
#[test]
fn hand_derived_derivatives_equal_those_in_dual_numbers() {
    let (mut touching, mut apart) = (0, 0);
    for goes_on in [[false, false], [true, false], [true, true]] {
        for edges in pairs() {
            let (pair, q) = (pair(goes_on), coordinates(edges));
            let (gradient, hessian) = by_hand(&pair, &q);
            let (dual_gradient, dual_hessian) = autodiff::hessian(&EnergyOfPair(&pair), &q);
            let size = dual_hessian.iter().flatten().fold(0.0_f64, |most, x| most.max(x.abs()));
            if size > 0.0 {
                touching += 1
            } else {
                apart += 1
            }
            for i in 0..12 {
                let off = (gradient[i] - dual_gradient[i]).abs();
                assert!(off <= 1e-12 * size, "{goes_on:?} {edges:?} {i}: {off:e}");
                for j in 0..=i {
                    let off = (hessian[i][j] - dual_hessian[i][j]).abs();
                    assert!(off <= 1e-10 * size, "{goes_on:?} {edges:?} {i} {j}: {off:e}");
                }
            }
            let mut rate = 0.1;
            let mut seeded = |x: f64| {
                rate += 0.03;
                Dual64::new(x, x * rate)
            };
            let pair = EdgePair {
                lengths: pair.lengths.map(&mut seeded),
                radii: pair.radii.map(&mut seeded),
                stiffness: seeded(STIFFNESS),
                goes_on,
            };
            let q = components(|i| seeded(q[i]));
            let (gradient, _) = by_hand(&pair, &q);
            let (dual_gradient, _) = autodiff::hessian(&EnergyOfPair(&pair), &q);
            for i in 0..12 {
                let off = (gradient[i].eps - dual_gradient[i].eps).abs();
                assert!(off <= 1e-10 * size, "{goes_on:?} {edges:?} {i}: {off:e}");
            }
        }
    }
    println!("{touching} touching, {apart} apart");
    assert!(touching > 200 && apart > 50, "{touching} {apart}");
}

/// The gradient is that of the energy, and the Hessian that of the gradient, by differences.
#[test]
fn derivatives_equal_differences() {
    let mut touching = 0;
    for goes_on in [[false, false], [true, true]] {
        for edges in pairs() {
            let (pair, q, h) = (pair(goes_on), coordinates(edges), 1e-7);
            let at = |c: usize, step: f64| {
                let mut q = q;
                q[c] += step;
                (pair.energy(nodes(&q)), by_hand(&pair, &q))
            };
            let (energy, local) = at(0, 0.0);
            touching += usize::from(energy > 0.0);
            let force = local.0.iter().fold(10.0, |most: f64, x| most.max(x.abs()));
            let stiff = local.1.iter().flatten().fold(1e5, |most: f64, x| most.max(x.abs()));
            for c in 0..12 {
                let ((more, after), (less, before)) = (at(c, h), at(c, -h));
                let off = ((more - less) / (2.0 * h) - local.0[c]).abs();
                assert!(off < 1e-6 * force, "{goes_on:?} {edges:?} {c}: {off:e} of {force:e}");
                for r in c..12 {
                    let slope = (after.0[r] - before.0[r]) / (2.0 * h);
                    let off = (slope - local.1[r][c]).abs();
                    assert!(off < 1e-4 * stiff, "{goes_on:?} {r} {c}: {slope} {}", local.1[r][c]);
                }
            }
        }
    }
    assert!(touching > 100, "{touching}");
}

/// Straight rods have the energy of their shape: that of either edge is the sum over two parts of it.
#[test]
fn energy_does_not_depend_on_the_division_into_edges() {
    for edges in pairs() {
        let [first, second] = edges;
        let whole = pair([false, false]).energy(edges);
        let middle = |[a, b]: EdgeNodes<f64>| add(scale(a, 0.7), scale(b, 0.3));
        let part = |lengths: [f64; 2], goes_on: [bool; 2], edges: [EdgeNodes<f64>; 2]| {
            EdgePair { lengths, ..pair(goes_on) }.energy(edges)
        };
        let cut = middle(first);
        let halves = part([0.0075, 0.03], [true, false], [[first[0], cut], second])
            + part([0.0175, 0.03], [false, false], [[cut, first[1]], second]);
        assert!((whole - halves).abs() <= 1e-12 * whole.max(1e-6), "{edges:?} {whole} {halves}");
        let cut = middle(second);
        let halves = part([0.025, 0.009], [false, true], [first, [second[0], cut]])
            + part([0.025, 0.021], [false, false], [first, [cut, second[1]]]);
        assert!((whole - halves).abs() <= 1e-12 * whole.max(1e-6), "{edges:?} {whole} {halves}");
    }
}

/// The forces on both edges are opposite, and so are their moments.
#[test]
fn forces_and_moments_balance() {
    for edges in pairs() {
        let mut sums = PairDerivatives::zero();
        pair([true, false]).derive(edges, false, &mut sums);
        let size = sums.gradient.iter().flatten().fold(0.0_f64, |most, x| most.max(x.abs()));
        let (mut force, mut moment) = ([0.0; 3], [0.0; 3]);
        for (node, gradient) in edges.iter().flatten().zip(sums.gradient) {
            force = add(force, gradient);
            moment = add(moment, cross(*node, gradient));
        }
        assert!(norm(force) <= 1e-13 * size.max(1e-9), "{force:?} of {size}");
        assert!(norm(moment) <= 1e-13 * size.max(1e-9), "{moment:?} of {size}");
    }
}
