//! Losses of two touching edges: derivatives against differences, balance of forces and moments, power, and Coulomb's
//! law.

use super::*;
use crate::energy::edge_pair::PairDerivatives;
use crate::numerics::vector::components;

const LOSS: ContactLoss<f64> = ContactLoss { damping: 3.0, friction: 0.4, slip_velocity: 2e-2 };

/// Calls `test` with pairs of edges that cross, are nearly parallel, and touch at an end, with unknowns and velocities.
fn for_each_pair(mut test: impl FnMut(LossyPair<f64>, [f64; 14], [f64; 14])) {
    for goes_on in [[false, false], [true, false], [true, true]] {
        let pair =
            EdgePair { lengths: [0.025, 0.03], radii: [0.004, 0.003], stiffness: 3e9, goes_on };
        for [place, way] in [
            [[0.012, 0.0, -0.013], [0.003, 0.0008, 0.03]],
            [[-0.004, 0.0003, 0.001], [0.029, -0.0004, 0.006]],
            [[0.0265, 0.0, -0.002], [0.0022, 0.001, 0.029]],
            [[0.02, 0.0, 0.0], [0.03, 0.001, 0.002]],
        ] {
            for height in [0.0062, 0.0067] {
                for speed in [-0.05, 0.002, 0.3] {
                    let start = [place[0], place[1] + height, place[2]];
                    let [x, y, z] = add(start, way);
                    let [a, b, c] = start;
                    let q = [0.0, 0.0, 0.0, 0.3, 0.025, 0.0004, 0.0, a, b, c, 0.1, x, y, z];
                    let v = components(|i| {
                        let spin = if i % 7 == 3 { 10.0 } else { 1.0 };
                        0.03 * spin * (1.7 * i as f64).sin()
                            + if i % 7 == 1 && i > 7 { speed } else { 0.0 }
                    });
                    test(LossyPair { pair, loss: LOSS }, q, v);
                }
            }
        }
    }
}

/// Both nodes of edge number `k`, of its unknowns.
fn ends(x: &[f64; 14], k: usize) -> [[f64; 3]; 2] {
    [0, 4].map(|first| [0, 1, 2].map(|c| x[7 * k + first + c]))
}

#[test]
fn derivatives_of_losses_equal_differences() {
    let (rate, mut touching) = (300.0, 0);
    for_each_pair(|lossy, q, v| {
        let tangent = lossy.tangent::<3, 14>(&q, &v, rate);
        let size = tangent.iter().flatten().fold(0.0_f64, |most, x| most.max(x.abs()));
        assert_eq!(lossy.touches::<3, 14>(&q), size > 0.0);
        touching += usize::from(size > 0.0);
        for c in 0..14 {
            let at = |h: f64| {
                let (mut q, mut v) = (q, v);
                (q[c], v[c]) = (q[c] + h, v[c] + rate * h);
                lossy.forces::<3, 14>(&q, &v)
            };
            let h = 1e-9;
            let (after, before) = (at(h), at(-h));
            for r in 0..14 {
                let off = ((after[r] - before[r]) / (2.0 * h) - tangent[r][c]).abs();
                assert!(off <= 1e-5 * size, "{r} {c}: {off:e} of {size:e}");
            }
        }
    });
    assert!(touching > 60, "{touching}");
}

/// Linear and angular momentum of both edges, spins included, do not change. A rigid motion has no losses.
#[test]
fn forces_and_moments_are_in_equilibrium() {
    for_each_pair(|lossy, q, v| {
        let forces = lossy.forces::<3, 14>(&q, &v);
        let size = forces.iter().fold(1e-9_f64, |most, x| most.max(x.abs()));
        let (mut force, mut moment) = ([0.0; 3], [0.0; 3]);
        for k in 0..2 {
            let nodes = ends(&q, k);
            for (x, f) in nodes.into_iter().zip(ends(&forces, k)) {
                (force, moment) = (add(force, f), add(moment, cross(x, f)));
            }
            moment = add(moment, scale(unit(sub(nodes[1], nodes[0])), forces[7 * k + 3]));
        }
        assert!(norm(force) < 1e-14 * size && norm(moment) < 1e-15 * size, "{force:?} {moment:?}");
        let (shift, turn) = ([0.3, -0.2, 0.5], [4.0, -7.0, 9.0]);
        let mut rigid = [0.0; 14];
        for k in 0..2 {
            let nodes = ends(&q, k);
            for (first, x) in [0, 4].into_iter().zip(nodes) {
                rigid[7 * k + first..][..3].copy_from_slice(&add(shift, cross(turn, x)));
            }
            rigid[7 * k + 3] = dot(turn, unit(sub(nodes[1], nodes[0])));
        }
        let left = lossy.forces::<3, 14>(&q, &rigid);
        assert!(left.iter().all(|force| force.abs() < 1e-9), "{left:?}");
    });
}

/// Losses take energy from every motion, and the normal force with damping never pulls.
#[test]
fn losses_have_negative_power_and_never_pull() {
    for_each_pair(|lossy, q, v| {
        let power = |loss: ContactLoss<f64>, v: [f64; 14]| {
            let forces = LossyPair { loss, ..lossy }.forces::<3, 14>(&q, &v);
            forces.iter().zip(v).map(|(force, v)| -force * v).sum::<f64>()
        };
        // Where a rod goes on behind an edge, spheres are subtracted that the pair with the next edge contains.
        if lossy.pair.goes_on == [false; 2] {
            assert!(power(LOSS, v) <= 0.0);
            assert!(power(ContactLoss { friction: 0.0, ..LOSS }, v) <= 0.0);
            assert!(power(ContactLoss { damping: 0.0, ..LOSS }, v) <= 0.0);
        }
        // The second edge leaves quickly: the damping cancels the elastic force and no more.
        let lifted = components(|i| if i == 8 || i == 12 { 50.0 } else { 0.0 });
        let loss = ContactLoss { friction: 0.0, ..LOSS };
        let forces = LossyPair { loss, ..lossy }.forces::<3, 14>(&q, &lifted);
        let mut elastic = PairDerivatives::zero();
        lossy.pair.derive([ends(&q, 0), ends(&q, 1)], false, &mut elastic);
        let damped = [ends(&forces, 0), ends(&forces, 1)].concat();
        let size = elastic.gradient.iter().flatten().fold(0.0_f64, |most, x| most.max(x.abs()));
        for (damped, elastic) in damped.iter().zip(elastic.gradient) {
            let left = norm(add(*damped, elastic));
            assert!(left <= 1e-9 * size, "{damped:?} {elastic:?}");
        }
    });
}

/// Edges that cross at right angles and slide along the first one: Coulomb's law times the normal force, in space and
/// in the plane of two parallel edges.
#[test]
fn friction_is_that_of_coulomb_beyond_the_slip_velocity() {
    let pair = EdgePair {
        lengths: [0.025; 2],
        radii: [0.004, 0.003],
        stiffness: 3e9,
        goes_on: [false; 2],
    };
    let loss = ContactLoss { damping: 0.0, friction: 0.4, slip_velocity: 1e-3 };
    let lossy = LossyPair { pair, loss };
    let nodes = [
        [[-0.0125, 0.0, 0.0], [0.0125, 0.0, 0.0]],
        [[0.0, 0.0065, -0.0125], [0.0, 0.0065, 0.0125]],
    ];
    let mut elastic = PairDerivatives::zero();
    pair.derive(nodes, false, &mut elastic);
    let normal = elastic.gradient[0][1] + elastic.gradient[1][1];
    assert!(normal > 0.1, "{normal}");
    for (speed, part) in [(0.0, 0.0), (5e-4, 0.75), (1.1e-3, 1.0), (-1.0, -1.0)] {
        let (mut q, mut v) = ([0.0; 14], [0.0; 14]);
        for k in 0..2 {
            for (first, x) in [0, 4].into_iter().zip(nodes[k]) {
                q[7 * k + first..][..3].copy_from_slice(&x);
            }
        }
        (v[0], v[4]) = (speed, speed);
        let forces = lossy.forces::<3, 14>(&q, &v);
        let drag = forces[0] + forces[4];
        // The normals of points beside the crossing are tilted.
        assert!((drag - 0.4 * normal * part).abs() < 2e-2 * normal, "{drag} {normal} {part}");
    }
    let q = [0.0, 0.0, 0.025, 0.0, 0.0, 0.0065, 0.025, 0.0065];
    let mut elastic = PairDerivatives::zero();
    let nodes = [0, 1].map(|k| [0, 1].map(|i| [q[4 * k + 2 * i], q[4 * k + 2 * i + 1], 0.0]));
    pair.derive(nodes, false, &mut elastic);
    let normal = elastic.gradient[0][1] + elastic.gradient[1][1];
    let forces = lossy.forces::<2, 8>(&q, &[0.1, 0.0, 0.1, 0.0, 0.0, 0.0, 0.0, 0.0]);
    assert!((forces[0] + forces[2] - 0.4 * normal).abs() < 1e-6 * normal, "{forces:?} {normal}");
    assert!((forces[0] + forces[2] + forces[4] + forces[6]).abs() < 1e-14 * normal);
}
