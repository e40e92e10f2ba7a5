//! Text of Universal Scene Description (USDA) of a rod: a linear curve with a width per node (of the edge after it),
//! and custom attributes.
//!
//! Input: a [`RodChain`] and the notes of the export, which become comments. Output: a stage in meters with the curve
//! `/rod` at rest, its density (kg/m^3) by the physics schema, and the attributes `rodfit:..`. These are Young's and
//! shear modulus (Pa; 0 if the chain has none), and bending and torsional rigidity (N m^2). Mass damping (1/s), the
//! viscous time of bending (s) and the kinds of both supports are the others. Rigidities and the viscous time are those
//! of the joint in the middle.

use crate::export::links::RodChain;
use std::fmt::Write;

/// The text of the stage of a chain, with the `notes` as comments. The width at a node, m, is twice the radius of the
/// edge after it, at the last node of the last edge.
pub(super) fn stage(chain: &RodChain, notes: &[String]) -> String {
    let mut text = String::from(
        "#usda 1.0\n(\n    defaultPrim = \"rod\"\n    metersPerUnit = 1\n    kilogramsPerUnit = 1\n",
    );
    // Only y and z can be up; planar scenes usually have their weight along y.
    let [_, y, z] = chain.gravity;
    let up = if y.abs() > z.abs() { "Y" } else { "Z" };
    let _ = write!(text, "    upAxis = \"{up}\"\n)\n\n");
    for note in notes {
        let _ = writeln!(text, "# {note}");
    }
    let points: Vec<String> =
        chain.nodes.iter().map(|[x, y, z]| format!("({x}, {y}, {z})")).collect();
    let width = |i: usize| 2.0 * chain.links[i.min(chain.links.len() - 1)].radius;
    let widths: Vec<String> = (0..chain.nodes.len()).map(|i| width(i).to_string()).collect();
    let joint = &chain.joints[chain.joints.len() / 2];
    let [torsion, second, first] = joint.stiffness.map(|k| k * joint.length);
    let _ = write!(
        text,
        "def BasisCurves \"rod\" (\n    prepend apiSchemas = [\"PhysicsMassAPI\"]\n)\n{{\n    \
         uniform token type = \"linear\"\n    \
         int[] curveVertexCounts = [{}]\n    \
         point3f[] points = [{}]\n    \
         float[] widths = [{}] (\n        interpolation = \"vertex\"\n    )\n    \
         float physics:density = {}\n    \
         custom double rodfit:youngsModulus = {}\n    \
         custom double rodfit:shearModulus = {}\n    \
         custom double2 rodfit:bendingRigidity = ({first}, {second})\n    \
         custom double rodfit:torsionalRigidity = {torsion}\n    \
         custom double rodfit:massDamping = {}\n    \
         custom double rodfit:bendingViscousTime = {}\n    \
         custom token[] rodfit:supports = [\"{}\", \"{}\"]\n}}\n",
        chain.nodes.len(),
        points.join(", "),
        widths.join(", "),
        chain.moduli.density,
        chain.moduli.young,
        chain.moduli.shear.unwrap_or(0.0),
        chain.mass_damping,
        joint.viscous[1],
        format!("{:?}", chain.supports[0]).to_lowercase(),
        format!("{:?}", chain.supports[1]).to_lowercase(),
    );
    text
}
