//! Derivatives of the energy of a contact by hand against dual numbers and differences, and its independence of the mesh.

use super::*;
use crate::energy::adapter::Chart;
use crate::energy::overlap::ContactPart;
use crate::numerics::vector::{cross, sub};
use num_dual::Dual64;

/// Index of the axis of the obstacle in the values of a contact.
const AXIS: usize = 5;
const AXES: [[f64; 3]; 3] = [[0.6, 0.8, 0.0], [-0.48, 0.36, 0.8], [0.64, -0.48, 0.6]];

fn charts<D: Scalar>() -> [Chart<D>; 3] {
    let plane = Chart::Plane {
        origin: [0.01, -0.02, 0.03],
        axes: [AXES[0], AXES[1]],
        across: [D::from(1.0), D::from(0.0)],
    };
    [plane, Chart::Space { axes: Some(AXES) }, Chart::Space { axes: None }]
}

/// Unknowns of an edge whose nodes are at two points of the world, or at their projections onto a plane.
fn unknowns(chart: &Chart<f64>, nodes: [[f64; 3]; 2]) -> Vec<f64> {
    let axes = chart.stride().min(3);
    let origin = match chart {
        Chart::Plane { origin, .. } => *origin,
        Chart::Space { .. } => [0.0; 3],
    };
    let mut q = vec![0.3; chart.unknowns(2)];
    for (i, node) in nodes.iter().enumerate() {
        for k in 0..axes {
            q[chart.stride() * i + k] = dot(chart.axis(k), sub(*node, origin));
        }
    }
    q
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

/// Edges around the obstacle: in contact as a whole, at either end, in the middle, beyond the ends of a capsule, and apart.
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

/// Hand-derived gradient and Hessian against those of the energy in dual numbers, for plain numbers and for dual ones. The
/// cases include all kinds of contact.
#[test]
fn hand_derived_derivatives_equal_those_in_dual_numbers() {
    for kind in KINDS {
        let obstacle = obstacle(kind);
        let part =
            ContactPart { arc_length: 0.1, length: 0.025, bounds: [0.0, 1.0], radius: 0.004 };
        let (mut in_contact, mut apart) = (0, 0);
        for (k, chart) in charts::<f64>().iter().enumerate() {
            for edge in edges(&obstacle) {
                let q = unknowns(chart, edge);
                let (values, place) = (contact_values(3e9, &obstacle), part.numbers());
                let site =
                    Site { chart, frames: &[], values: &values, place: &place, weight: None };
                let contact = EdgeContact(kind);
                let empty = ([f64::NAN; MOST], [[f64::NAN; MOST]; MOST]);
                let (mut hand, mut dual) = (empty, empty);
                contact.tangent(&site, &q, Derivatives::Hand, &mut hand);
                contact.tangent(&site, &q, Derivatives::Dual, &mut dual);
                let size = |local: &OwnLocal<f64>| {
                    let all = local.1[..q.len()].iter().flat_map(|row| &row[..q.len()]);
                    all.fold(0.0_f64, |most, x| most.max(x.abs()))
                };
                match contact.energy(&site, &q) > 0.0 {
                    true => in_contact += 1,
                    false => apart += 1,
                }
                for r in 0..q.len() {
                    let off = (hand.0[r] - dual.0[r]).abs();
                    assert!(off <= 1e-12 * size(&dual), "{kind:?} {k} {r}: {off:e}");
                    for c in 0..=r {
                        let off = (hand.1[r][c] - dual.1[r][c]).abs();
                        assert!(off <= 1e-10 * size(&dual), "{kind:?} {k} {r} {c}: {off:e}");
                    }
                }
                // The same with a derivative by the stiffness, the radii and the obstacle, whose axis turns.
                let chart = &charts::<Dual64>()[k];
                let seeded = |x: &[f64]| -> Vec<Dual64> {
                    let rate = |i: usize| 0.1 + 0.03 * i as f64;
                    x.iter().enumerate().map(|(i, x)| Dual64::new(*x, x * rate(i))).collect()
                };
                let turn = cross([0.3, -0.2, 0.5], obstacle.axis);
                let (mut values, place, q) = (seeded(&values), seeded(&place), seeded(&q));
                for c in 0..3 {
                    values[AXIS + c] = Dual64::new(obstacle.axis[c], turn[c]);
                }
                let site =
                    Site { chart, frames: &[], values: &values, place: &place, weight: None };
                let empty = ([Dual64::from(0.0); MOST], [[Dual64::from(0.0); MOST]; MOST]);
                let (mut by_hand, mut by_dual) = (empty, empty);
                contact.tangent(&site, &q, Derivatives::Hand, &mut by_hand);
                contact.tangent(&site, &q, Derivatives::Dual, &mut by_dual);
                for r in 0..q.len() {
                    let off = (by_hand.0[r].eps - by_dual.0[r].eps).abs();
                    assert!(off <= 1e-10 * size(&dual), "{kind:?} {k} {r}: {off:e}");
                }
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
    let chart = &charts::<f64>()[1];
    for kind in KINDS {
        let obstacle = obstacle(kind);
        let (values, place) = (contact_values(3e9, &obstacle), part.numbers());
        let site = Site { chart, frames: &[], values: &values, place: &place, weight: None };
        let contact = EdgeContact(kind);
        for edge in edges(&obstacle) {
            let q = unknowns(chart, edge);
            let at = |c: usize, step: f64| {
                let mut q = q.clone();
                q[c] += step;
                let mut local = ([0.0; MOST], [[0.0; MOST]; MOST]);
                contact.tangent(&site, &q, Derivatives::Hand, &mut local);
                (contact.energy(&site, &q), local)
            };
            let (h, (_, local)) = (1e-7, at(0, 0.0));
            let force = local.0.iter().fold(10.0, |most: f64, x| most.max(x.abs()));
            let stiff = local.1.iter().flatten().fold(1e5, |most: f64, x| most.max(x.abs()));
            for c in 0..q.len() {
                let ((more, after), (less, before), (_, local)) = (at(c, h), at(c, -h), at(c, 0.0));
                let slope = (more - less) / (2.0 * h);
                assert!(
                    (slope - local.0[c]).abs() < 1e-6 * force,
                    "{kind:?} {slope} {}",
                    local.0[c]
                );
                for r in c..q.len() {
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
    let chart = &charts::<f64>()[2];
    for kind in KINDS {
        let obstacle = obstacle(kind);
        let values = contact_values(3e9, &obstacle);
        let energy = |[a, b]: [[f64; 3]; 2], length: f64| {
            let bounds = [0.0, 1.0];
            let part = ContactPart { arc_length: 0.1, length, bounds, radius: 0.004 };
            let place = part.numbers();
            let site = Site { chart, frames: &[], values: &values, place: &place, weight: None };
            EdgeContact(kind).energy(&site, &unknowns(chart, [a, b]))
        };
        for [a, b] in edges(&obstacle) {
            let middle: [f64; 3] = components(|c| a[c] + 0.3 * (b[c] - a[c]));
            let whole = energy([a, b], 0.025);
            let halves = energy([a, middle], 0.0075) + energy([middle, b], 0.0175);
            assert!((whole - halves).abs() <= 1e-12 * whole.max(1e-6), "{kind:?} {whole} {halves}");
        }
    }
}
