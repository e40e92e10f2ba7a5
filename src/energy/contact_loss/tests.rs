//! Losses of contacts: their derivatives against differences, and their power.

use super::*;
use crate::energy::overlap::ContactPart;
use crate::numerics::vector::components;
use crate::scene::contact::{Obstacle, ObstacleKind};

const PART: ContactPart<f64> =
    ContactPart { arc_length: 0.1, length: 0.025, bounds: [0.0, 1.0], radius: 0.004 };
const LOSS: ContactLoss<f64> = ContactLoss { damping: 3.0, friction: 0.4, slip_velocity: 2e-2 };
const KINDS: [ObstacleKind; 4] =
    [ObstacleKind::Plane, ObstacleKind::Sphere, ObstacleKind::Cylinder, ObstacleKind::Capsule];

/// An obstacle below the origin, which an edge along x overlaps.
fn obstacle(kind: ObstacleKind, axis: [f64; 3]) -> Obstacle<f64> {
    let (radius, depth) = if kind == ObstacleKind::Plane { (0.0, 0.0) } else { (0.02, 0.02) };
    let axis = if kind == ObstacleKind::Plane { [0.0, 1.0, 0.0] } else { axis };
    Obstacle { kind, radius, point: [0.01, -depth, 0.003], axis, length: 0.03 }
}

/// Calls `test` with contacts at several overlaps and velocities, with the unknowns and velocities of an edge.
fn for_each_contact(mut test: impl FnMut(LossyContact<'_, f64>, [f64; 7], [f64; 7])) {
    for kind in KINDS {
        for axis in [[0.0, 0.0, 1.0], [0.6, 0.0, 0.8]] {
            let obstacle = obstacle(kind, axis);
            let edge = EdgePart { obstacle: &obstacle, part: &PART };
            let contact = EdgeContact { edge, stiffness: 3e9 };
            for height in [0.0030, 0.0037] {
                for speed in [-0.1, 0.002, 0.05, 0.5] {
                    let q = [0.0, height, 0.001, 0.2, 0.025, height + 0.0004, -0.002];
                    let v = [0.3, speed, -0.2, 40.0, 0.25, 1.1 * speed, 0.3];
                    test(LossyContact { contact, loss: LOSS }, q, v.map(|x| 0.1 * x));
                }
            }
        }
    }
}

#[test]
fn derivatives_of_losses_equal_differences() {
    let (rate, mut touching) = (300.0, 0);
    for_each_contact(|lossy, q, v| {
        let tangent = lossy.tangent::<3, 7>(&q, &v, rate);
        let size = tangent.iter().flatten().fold(0.0_f64, |most, x| most.max(x.abs()));
        touching += usize::from(size > 0.0);
        for c in 0..7 {
            let at = |h: f64| {
                let (mut q, mut v) = (q, v);
                (q[c], v[c]) = (q[c] + h, v[c] + rate * h);
                lossy.forces::<3, 7>(&q, &v)
            };
            let h = 2e-9;
            let (after, before) = (at(h), at(-h));
            for r in 0..7 {
                let slope = (after[r] - before[r]) / (2.0 * h);
                let off = (slope - tangent[r][c]).abs();
                assert!(off <= 1e-6 * size, "{r} {c}: {slope} {}", tangent[r][c]);
            }
        }
    });
    assert!(touching > 30, "{touching}");
}

/// Losses take energy from every motion, and the normal force with damping never pulls.
#[test]
fn losses_have_negative_power_and_never_pull() {
    for_each_contact(|lossy, q, v| {
        let power = |loss: ContactLoss<f64>| {
            let forces = LossyContact { loss, ..lossy }.forces::<3, 7>(&q, &v);
            forces.iter().zip(v).map(|(force, v)| -force * v).sum::<f64>()
        };
        assert!(power(LossyContact { ..lossy }.loss) <= 0.0);
        assert!(power(ContactLoss { friction: 0.0, ..LOSS }) <= 0.0);
        assert!(power(ContactLoss { damping: 0.0, ..LOSS }) <= 0.0);
        // Leaves quickly: the damping cancels the elastic force and no more.
        let lifted = components(|i| if i == 1 || i == 5 { 10.0 } else { 0.0 });
        let frictionless = LossyContact { loss: ContactLoss { friction: 0.0, ..LOSS }, ..lossy };
        let forces = frictionless.forces::<3, 7>(&q, &lifted);
        let nodes = [[q[0], q[1], q[2]], [q[4], q[5], q[6]]];
        let mut elastic = [0.0; 7];
        for k in 0..lossy.contact.edge.surfaces() {
            let mut local = crate::energy::edge_contact::ContactDerivatives::<f64, 7>::zero();
            if lossy.contact.derive::<3, 7>(k, nodes, false, &mut local) {
                (0..7).for_each(|i| elastic[i] += local.gradient[i]);
            }
        }
        for i in 0..7 {
            let size = elastic[1].abs() + elastic[5].abs();
            assert!((forces[i] + elastic[i]).abs() <= 1e-12 * size, "{i}: {forces:?} {elastic:?}");
        }
    });
}

/// A plane with friction on an edge that slides slowly and fast: Coulomb's law times the normal force.
#[test]
fn friction_is_that_of_coulomb_beyond_the_slip_velocity() {
    let obstacle = obstacle(ObstacleKind::Plane, [0.0; 3]);
    let edge = EdgePart { obstacle: &obstacle, part: &PART };
    let contact = EdgeContact { edge, stiffness: 3e9 };
    let loss = ContactLoss { damping: 0.0, friction: 0.4, slip_velocity: 1e-3 };
    let q = [0.0, 0.0035, 0.025, 0.0035];
    let normal = 3e9 * 0.0005_f64.powi(2) * 0.025;
    for (speed, part) in [(0.0, 0.0), (5e-4, 0.75), (1.1e-3, 1.0), (-1.0, -1.0)] {
        let forces = LossyContact { contact, loss }.forces::<2, 4>(&q, &[speed, 0.0, speed, 0.0]);
        assert!((forces[0] + forces[2] - 0.4 * normal * part).abs() < 2e-6 * normal, "{forces:?}");
        assert_eq!([forces[1], forces[3]], [0.0; 2]);
    }
}
