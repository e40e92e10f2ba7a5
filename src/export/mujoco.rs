//! MJCF of MuJoCo: rigid links of a [`RodChain`] as nested bodies, each with hinges that have springs.
//!
//! Output: the text of the model, in SI units; conversions are added to the notes of the export. A link turns against
//! the one before it about tangent, first and second director halfway between both, with the stiffnesses, viscous times
//! and friction of the joint. Without a shear modulus there is no hinge about the tangent. The orientation of a body is
//! that at rest; rotations without stress beyond it are reference angles of the springs. A clamped start is a fixed
//! body, a pinned one a ball joint, a free one a free joint; a clamped or pinned end is an equality constraint. Point
//! masses are small bodies. An armature about the tangent, by the stiffness of twist, keeps twist from being faster
//! than the highest bending. The time step is [`STEP_FRACTION`] over the highest angular frequency, and less if viscous
//! damping requires it.

use crate::export::links::{ChainJoint, ChainLink, RodChain};
use crate::numerics::vector::{Vector, dot};
use crate::scene::Support;
use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};
use std::fmt::Write;

/// Time step times the highest angular frequency. The Runge-Kutta method of fourth order is stable up to 2.8, and
/// resolves the lower modes much better than the highest one.
const STEP_FRACTION: f64 = 0.5;

/// The text of the MJCF model of a chain. Notes on its conversions are added to `notes`, all of which become comments
/// in the text.
pub(super) fn model(chain: &RodChain, notes: &mut Vec<String>) -> String {
    notes.push(format!(
        "rigid links: axial strains, up to {:.1e} by the weight, are left out",
        chain.weight_strain()
    ));
    if chain.moduli.shear.is_none() {
        notes.push("no twist: the scene has neither poisson_ratio nor shear_modulus".into());
    }
    let rate = highest_rate(chain);
    let viscous = chain.joints.iter().flat_map(|joint| joint.viscous).fold(0.0, f64::max);
    // A viscous time t dampens the highest mode at the rate t rate^2.
    let decay = viscous * rate * rate;
    let (step, limit) = match decay * STEP_FRACTION > rate {
        true => (1.0 / decay, "1 over the viscous decay rate of the fastest mode".to_string()),
        false => {
            (STEP_FRACTION / rate, format!("{STEP_FRACTION} over the highest angular frequency"))
        }
    };
    notes.push(format!("time step {step:.1e} s: {limit}; larger ones are unstable"));
    let mut text = format!("<mujoco model=\"{}\">\n", chain.name);
    for note in notes.iter() {
        let _ = writeln!(text, "  <!-- {} -->", note.replace("--", "-"));
    }
    let [gx, gy, gz] = chain.gravity;
    let _ = write!(
        text,
        "  <compiler angle=\"radian\"/>\n  \
         <option timestep=\"{step:e}\" gravity=\"{gx} {gy} {gz}\" integrator=\"RK4\"/>\n  \
         <worldbody>\n"
    );
    let count = chain.links.len();
    for i in 0..count {
        open_body(&mut text, chain, i, rate);
    }
    let _ = writeln!(
        text,
        "<site name=\"tip\" pos=\"{} 0 0\"/>",
        chain.tip_fraction() * chain.links[count - 1].length
    );
    for _ in 0..count {
        text.push_str("</body>");
    }
    text.push_str("\n  </worldbody>\n");
    text.push_str(&end_constraint(chain));
    text.push_str("</mujoco>\n");
    text
}

/// Upper bound of the angular frequencies of the chain by bending, rad/s: the largest `2 sqrt(K (1/I + 1/I'))` of all
/// joints. `K` is the larger bending stiffness of the joint, `I` and `I'` are the moments of inertia of both links
/// ([`across`]).
fn highest_rate(chain: &RodChain) -> f64 {
    let pairs = chain.links.windows(2).zip(&chain.joints);
    let rate = |(links, joint): (&[ChainLink], &ChainJoint)| {
        let inverse: f64 = links.iter().map(|link| across(link).recip()).sum();
        2.0 * (joint.stiffness[1].max(joint.stiffness[2]) * inverse).sqrt()
    };
    pairs.map(rate).fold(f64::MIN_POSITIVE, f64::max)
}

/// Moment of inertia of a link about an axis across it through its center, kg m^2: half of its mass is at each node.
fn across(link: &ChainLink) -> f64 {
    0.25 * link.mass * link.length * link.length
}

/// Writes the opening tag of the body of link `i`, with its joints to the link before or the support, inertia and
/// geometry. Point masses at its last node follow, of the first link also those at its first node. `rate` is the
/// highest angular frequency, rad/s.
fn open_body(text: &mut String, chain: &RodChain, i: usize, rate: f64) {
    let link = &chain.links[i];
    let own = rotation(chain.frames[i]);
    let (position, turn) = match i {
        0 => (chain.nodes[0], own),
        _ => ([chain.links[i - 1].length, 0.0, 0.0], rotation(chain.frames[i - 1]).inverse() * own),
    };
    let [x, y, z] = position;
    let [w, a, b, c] = [turn.w, turn.i, turn.j, turn.k];
    let _ = writeln!(text, "<body name=\"link_{i}\" pos=\"{x} {y} {z}\" quat=\"{w} {a} {b} {c}\">");
    match (i, chain.supports[0]) {
        (0, Support::Clamped) => {}
        (0, Support::Pinned) => text.push_str("<joint type=\"ball\"/>"),
        (0, _) => text.push_str("<freejoint/>"),
        _ => hinges(text, chain, i, &turn, rate),
    }
    let half = 0.5 * link.length;
    let across = across(link);
    let about = link.inertia.max(1e-6 * across);
    let _ = writeln!(
        text,
        "<inertial pos=\"{half} 0 0\" mass=\"{:e}\" diaginertia=\"{about:e} {across:e} {across:e}\"/>\
         <geom type=\"capsule\" fromto=\"0 0 0 {} 0 0\" size=\"{}\" contype=\"0\" conaffinity=\"0\"/>",
        link.mass, link.length, link.radius
    );
    for at in &chain.masses {
        // A mass at an inner node belongs to the link that ends there.
        let place = match at.node {
            0 if i == 0 => 0.0,
            node if node == i + 1 => link.length,
            _ => continue,
        };
        let _ = writeln!(
            text,
            "<body pos=\"{place} 0 0\"><inertial pos=\"0 0 0\" mass=\"{:e}\" diaginertia=\"1e-12 1e-12 1e-12\"/></body>",
            at.mass
        );
    }
}

/// Writes the hinges of link `i` against the link before it, with the axes halfway between both. `turn` is the rotation
/// of the link at rest, in the link before; `rate` is the highest angular frequency, rad/s, which sets the armature
/// about the tangent. Every second joint has the reverse order of hinges, so that the errors of successive rotations
/// cancel.
fn hinges(text: &mut String, chain: &RodChain, i: usize, turn: &UnitQuaternion<f64>, rate: f64) {
    let joint = &chain.joints[i - 1];
    let back = turn.powf(0.5).inverse();
    let order = if i.is_multiple_of(2) { [0, 1, 2] } else { [2, 1, 0] };
    for k in order {
        let stiffness = joint.stiffness[k];
        if k == 0 && chain.moduli.shear.is_none() {
            continue;
        }
        let axis = back * Vector3::ith(k, 1.0);
        // Twist of a slender link is much faster than its bending.
        let armature = if k == 0 { 4.0 * stiffness / (rate * rate) } else { 0.0 };
        let _ = writeln!(
            text,
            "<joint type=\"hinge\" axis=\"{} {} {}\" stiffness=\"{stiffness:e}\" springref=\"{:e}\" damping=\"{:e}\" \
             frictionloss=\"{:e}\" armature=\"{armature:e}\"/>",
            axis.x,
            axis.y,
            axis.z,
            joint.reference[k],
            joint.viscous[k] * stiffness,
            joint.friction[k]
        );
    }
}

/// The equality constraint of the last link at a clamped (`weld`) or pinned end (`connect`); empty for a free one.
fn end_constraint(chain: &RodChain) -> String {
    let last = chain.links.len() - 1;
    match chain.supports[1] {
        Support::Clamped => format!("  <equality><weld body1=\"link_{last}\"/></equality>\n"),
        Support::Pinned => {
            let anchor = chain.links[last].length;
            format!(
                "  <equality><connect body1=\"link_{last}\" anchor=\"{anchor} 0 0\"/></equality>\n"
            )
        }
        _ => String::new(),
    }
}

/// The rotation that turns the x, y and z axis of the world into tangent `t`, first director `a` and second director
/// `b` (orthonormal).
fn rotation([t, a, b]: [Vector<f64>; 3]) -> UnitQuaternion<f64> {
    debug_assert!(dot(t, a).abs() < 1e-9);
    let columns = [t, a, b].map(Vector3::from);
    UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(Matrix3::from_columns(
        &columns,
    )))
}
