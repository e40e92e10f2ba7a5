//! Derivatives of the energy of a contact by hand against dual numbers and differences, and its independence of the
//! mesh.

use super::*;
use crate::energy::autodiff::{self, ScalarFunction};
use crate::energy::overlap::ContactPart;
use crate::numerics::vector::{components, cross, dot, sub};
use crate::scene::contact::{Obstacle, ObstacleKind};
use num_dual::Dual64;

const AXES: [[f64; 3]; 3] = [[0.6, 0.8, 0.0], [-0.48, 0.36, 0.8], [0.64, -0.48, 0.6]];
const STIFFNESS: f64 = 3e9;

/// The energy of a contact as a function of the coordinates of the nodes.
struct EnergyOfNodes<'a, B>(&'a EdgeContact<'a, B>);

impl<B: Scalar> ScalarFunction<B> for EnergyOfNodes<'_, B> {
    fn at<D: Scalar>(&self, over: impl Fn(B) -> D + Copy, q: &[D]) -> D {
        let obstacle = self.0.edge.obstacle.map(over);
        let part = self.0.edge.part.map(over);
        let edge = EdgePart { obstacle: &obstacle, part: &part };
        EdgeContact { edge, stiffness: over(self.0.stiffness) }.energy(nodes(q))
    }
}

/// The nodes of an edge with two or three coordinates each.
fn nodes<D: Scalar>(q: &[D]) -> [Vector<D>; 2] {
    let axes = q.len() / 2;
    let coordinate = |i: usize, c: usize| if c < axes { q[axes * i + c] } else { D::from(0.0) };
    [0, 1].map(|i| components(|c| coordinate(i, c)))
}

/// Gradient and Hessian by hand of the sum over all surfaces, for nodes of `A` coordinates.
fn by_hand<D: Scalar, const A: usize, const Q: usize>(
    contact: &EdgeContact<D>,
    q: &[D; Q],
) -> ([D; Q], [[D; Q]; Q]) {
    let (mut gradient, mut hessian) = ([D::from(0.0); Q], [[D::from(0.0); Q]; Q]);
    for k in 0..contact.edge.surfaces() {
        let mut local = ContactDerivatives::<D, Q>::zero();
        if contact.edge.is_apart(nodes(q)) || !contact.derive::<A, Q>(k, nodes(q), true, &mut local)
        {
            continue;
        }
        for r in 0..Q {
            gradient[r] += local.gradient[r];
            for c in 0..=r {
                hessian[r][c] += local.hessian[r][c];
            }
        }
    }
    (gradient, hessian)
}

/// An obstacle whose axis is `AXES[2]`, across the plane; of the capsule along the edge.
fn obstacle(kind: ObstacleKind) -> Obstacle<f64> {
    let axis = match kind {
        ObstacleKind::Plane => AXES[1],
        ObstacleKind::Capsule => [0.8, 0.6, 0.0],
        _ => AXES[2],
    };
    let point = [0.05, -0.04, 0.02];
    let (radius, length) = if kind == ObstacleKind::Plane { (0.0, 0.0) } else { (0.02, 0.03) };
    Obstacle { kind, radius, point, axis, length }
}

const KINDS: [ObstacleKind; 4] =
    [ObstacleKind::Plane, ObstacleKind::Sphere, ObstacleKind::Cylinder, ObstacleKind::Capsule];

/// Edges around the obstacle: in contact as a whole, at either end, in the middle, beyond the ends of a capsule, and
/// apart.
fn edges(obstacle: &Obstacle<f64>) -> Vec<[[f64; 3]; 2]> {
    let mut edges = Vec::new();
    let side = AXES[1];
    for height in [0.85, 0.95, 1.05, 1.3] {
        let reach = (obstacle.radius + 0.004) * height;
        for slope in [-0.3, -0.02, 0.0, 0.3] {
            for shift in [-0.03, -0.004, 0.0, 0.018] {
                let end = |s: f64| {
                    let along = [0.6 * s, 0.8 * s, 0.02 * s];
                    components(|c| obstacle.point[c] + along[c] + side[c] * (reach + slope * s))
                };
                edges.push([end(shift), end(shift + 0.025)]);
                edges.push([end(shift + 0.025), end(shift)]);
            }
        }
    }
    edges
}

/// An obstacle and edges in the axes of a plane through its point, as a planar rod has them.
fn in_plane(obstacle: &Obstacle<f64>, edge: [[f64; 3]; 2]) -> (Obstacle<f64>, [f64; 4]) {
    // The axis of a capsule is along the edge in space: a planar rod has it across.
    let axis = if obstacle.kind == ObstacleKind::Plane { [0.0, 1.0, 0.0] } else { [0.0, 0.0, 1.0] };
    let length = obstacle.length;
    let flat =
        |x: [f64; 3]| [dot(AXES[0], sub(x, obstacle.point)), dot(AXES[1], sub(x, obstacle.point))];
    let ([a, b], [c, d]) = (flat(edge[0]), flat(edge[1]));
    (Obstacle { point: [0.0, 0.0, -0.5 * length], axis, ..*obstacle }, [a, b, c, d])
}

/// Compares the derivatives by hand with those in dual numbers, for plain numbers and for dual ones with a derivative
/// by the stiffness, the radii, the obstacle, whose axis turns, and the nodes. Returns whether there is contact.
fn compare<const A: usize, const Q: usize>(obstacle: &Obstacle<f64>, q: &[f64; Q]) -> bool {
    let part = ContactPart { arc_length: 0.1, length: 0.025, bounds: [0.0, 1.0], radius: 0.004 };
    let kind = obstacle.kind;
    let contact = EdgeContact { edge: EdgePart { obstacle, part: &part }, stiffness: STIFFNESS };
    let (gradient, hessian) = by_hand::<f64, A, Q>(&contact, q);
    let (dual_gradient, dual_hessian) = autodiff::hessian(&EnergyOfNodes(&contact), q);
    let size = dual_hessian.iter().flatten().fold(0.0_f64, |most, x| most.max(x.abs()));
    for r in 0..Q {
        let off = (gradient[r] - dual_gradient[r]).abs();
        assert!(off <= 1e-12 * size, "{kind:?} {r}: {off:e}");
        for c in 0..=r {
            let off = (hessian[r][c] - dual_hessian[r][c]).abs();
            assert!(off <= 1e-10 * size, "{kind:?} {r} {c}: {off:e}");
        }
    }
    let mut rate = 0.1;
    let mut seeded = |x: f64| {
        rate += 0.03;
        Dual64::new(x, x * rate)
    };
    let turn = cross([0.3, -0.2, 0.5], obstacle.axis);
    let dual_obstacle = Obstacle {
        kind,
        radius: seeded(obstacle.radius),
        point: components(|c| seeded(obstacle.point[c])),
        axis: components(|c| Dual64::new(obstacle.axis[c], turn[c])),
        length: seeded(obstacle.length),
    };
    let dual_part =
        ContactPart { length: seeded(0.025), radius: seeded(0.004), ..part.map(Dual64::from) };
    let edge = EdgePart { obstacle: &dual_obstacle, part: &dual_part };
    let contact = EdgeContact { edge, stiffness: seeded(STIFFNESS) };
    let q = components(|i| seeded(q[i]));
    let (gradient, hessian) = by_hand::<Dual64, A, Q>(&contact, &q);
    let (dual_gradient, dual_hessian) = autodiff::hessian(&EnergyOfNodes(&contact), &q);
    let slopes = |rows: &[[Dual64; Q]; Q]| {
        rows.iter().flatten().fold(0.0_f64, |most, x| most.max(x.eps.abs()))
    };
    let slope = slopes(&dual_hessian);
    for r in 0..Q {
        let off = (gradient[r].eps - dual_gradient[r].eps).abs();
        assert!(off <= 1e-10 * size, "{kind:?} {r}: {off:e}");
        for c in 0..=r {
            let off = (hessian[r][c].eps - dual_hessian[r][c].eps).abs();
            assert!(off <= 1e-10 * slope, "{kind:?} {r} {c}: {off:e} {slope:e}");
        }
    }
    size > 0.0
}

/// Hand-derived gradient and Hessian against those of the energy in dual numbers. The cases include all kinds of
/// contact.
#[test]
fn hand_derived_derivatives_equal_those_in_dual_numbers() {
    for kind in KINDS {
        let obstacle = obstacle(kind);
        let (mut in_contact, mut apart) = (0, 0);
        for edge in edges(&obstacle) {
            let [a, b] = edge;
            let spatial = [a[0], a[1], a[2], b[0], b[1], b[2]];
            let (flat, planar) = in_plane(&obstacle, edge);
            for touches in [compare::<3, 6>(&obstacle, &spatial), compare::<2, 4>(&flat, &planar)] {
                in_contact += usize::from(touches);
                apart += usize::from(!touches);
            }
        }
        println!("{kind:?}: {in_contact} in contact, {apart} apart");
        assert!(in_contact > 40 && apart > 20, "{kind:?} {in_contact} {apart}");
    }
}

/// The gradient is that of the energy, and the Hessian that of the gradient, by differences.
#[test]
fn derivatives_equal_differences() {
    let part = ContactPart { arc_length: 0.1, length: 0.025, bounds: [0.2, 1.0], radius: 0.004 };
    for kind in KINDS {
        let obstacle = obstacle(kind);
        let edge = EdgePart { obstacle: &obstacle, part: &part };
        let contact = EdgeContact { edge, stiffness: STIFFNESS };
        for [a, b] in edges(&obstacle) {
            let q = [a[0], a[1], a[2], b[0], b[1], b[2]];
            let at = |c: usize, step: f64| {
                let mut q = q;
                q[c] += step;
                (contact.energy(nodes(&q)), by_hand::<f64, 3, 6>(&contact, &q))
            };
            let (h, (_, local)) = (1e-7, at(0, 0.0));
            let force = local.0.iter().fold(10.0, |most: f64, x| most.max(x.abs()));
            let stiff = local.1.iter().flatten().fold(1e5, |most: f64, x| most.max(x.abs()));
            for c in 0..6 {
                let ((more, after), (less, before), (_, local)) = (at(c, h), at(c, -h), at(c, 0.0));
                let slope = (more - less) / (2.0 * h);
                let off = (slope - local.0[c]).abs();
                assert!(off < 1e-6 * force, "{kind:?} {slope} {}", local.0[c]);
                for r in c..6 {
                    let slope = (after.0[r] - before.0[r]) / (2.0 * h);
                    let off = (slope - local.1[r][c]).abs();
                    assert!(off < 1e-4 * stiff, "{kind:?} {r} {c}: {slope} {}", local.1[r][c]);
                }
            }
        }
    }
}

/// The energy of a straight rod is that of its shape: an edge has the energy of its two halves.
#[test]
fn energy_does_not_depend_on_the_division_into_edges() {
    for kind in KINDS {
        let obstacle = obstacle(kind);
        let energy = |nodes: [[f64; 3]; 2], length: f64| {
            let part = ContactPart { arc_length: 0.1, length, bounds: [0.0, 1.0], radius: 0.004 };
            let edge = EdgePart { obstacle: &obstacle, part: &part };
            EdgeContact { edge, stiffness: STIFFNESS }.energy(nodes)
        };
        for [a, b] in edges(&obstacle) {
            let middle: [f64; 3] = components(|c| a[c] + 0.3 * (b[c] - a[c]));
            let whole = energy([a, b], 0.025);
            let halves = energy([a, middle], 0.0075) + energy([middle, b], 0.0175);
            assert!((whole - halves).abs() <= 1e-12 * whole.max(1e-6), "{kind:?} {whole} {halves}");
        }
    }
}
