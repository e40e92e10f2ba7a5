//! The spatial model: a rod with stretch, bending and twist in space.
//!
//! Input: a validated scene and its mesh. [`SpatialModel`] selects the axes: those of the world, or along and across
//! the direction of a roller. As a [`Model`] it returns the rest shape and the `SpatialRod` over any number type, and
//! converts unknowns to positions in the world. Unknowns are three coordinates (m) per node and one angle (rad) per
//! edge, measured from Bishop (twist-free) frames, in the order node, edge, node. Edges and joints have stiffnesses by
//! means of the tapered section, reduced by compliant clamps, and natural curvature and twist. In corrected
//! discretizations the stiffness of a joint is along the axes of the curve instead of the polygon (`curved_joints`).
//! Nonlinear laws of bending and stretch, masses, weights and internal friction are included; point masses, loads and
//! user-defined energies are added by the setup. With the normal of a planar scene, for vibrations out of its plane,
//! `supports.angle` rotates the rod about that normal.

use crate::energy::adapter::Chart;
use crate::energy::bend_twist::{JointLaw, Stiffness};
use crate::energy::frame::{EdgeFrame, Frames};
use crate::energy::law::{NonlinearBending, SecantStiffness};
use crate::numerics::scalar::{RodScalar, Scalar};
use crate::numerics::vector::{Vector, components, sub, unit};
use crate::problem::curved_joints::{PLAIN, joint_slants, natural_slant, resistances};
use crate::problem::model::{Correction, Model, first_director, rolling, springs, tilted};
use crate::problem::rest_line::{InertiaAndWeight, RestLine};
use crate::problem::section_profile::{SectionConstants, SectionProfile};
use crate::problem::soft_clamp::SoftClamps;
use crate::problem::tributary::TributaryLengths;
use crate::rod::{FollowerLoads, Moments, RodContacts, SpatialRod, UserEnergies};
use crate::scene::mesh::Mesh;
use crate::scene::{End, Scene, Support};
use nalgebra::Vector3;
use std::sync::Arc;

/// Axes of a spatial scene and correction of its elements.
#[derive(Clone, Debug)]
pub struct SpatialModel {
    correction: Correction,
    /// Number of nodes.
    nodes: usize,
    /// Axes of the model in the world: those of the world, unless an end is on a roller.
    axes: [Vector3<f64>; 3],
    /// Normal of the plane of a planar scene, about which `supports.angle` rotates the rod.
    normal: Option<Vector3<f64>>,
}

/// Rest shape and material frames, in the axes of the model.
#[derive(Clone, Debug)]
pub struct SpatialRest<D> {
    line: RestLine<D, 3>,
    /// Slants of the joints of the corrected discretization.
    slants: Option<Vec<[D; 2]>>,
    /// Integrated curvatures in the material frame.
    curvature: Vec<[D; 2]>,
    /// Frames without twist (space-parallel).
    frames: Frames<D>,
}

impl SpatialModel {
    /// The model of a scene on its mesh. With the `normal` of a planar scene, `supports.angle` rotates the rod about
    /// it. With a roller, the axes are along and across its direction.
    pub(crate) fn new(
        scene: &Scene,
        mesh: &Mesh,
        correction: Correction,
        normal: Option<Vector3<f64>>,
    ) -> Self {
        let turned = normal.map(|normal| tilted(scene, &mesh.nodes, &normal));
        let nodes = turned.as_deref().unwrap_or(&mesh.nodes);
        let axes = match rolling(scene, nodes) {
            None => [Vector3::x(), Vector3::y(), Vector3::z()],
            // A roller at the end holds the last two coordinates of its node, one at the start the
            // first two, so that the free unknowns stay side by side.
            Some((end, direction)) => {
                let along = direction.normalize();
                let across =
                    along.cross(&Vector3::ith(along.map(f64::abs).imin(), 1.0)).normalize();
                match end {
                    End::End => [along, across, along.cross(&across)],
                    End::Start => [across, along.cross(&across), along],
                }
            }
        };
        Self { correction, nodes: nodes.len(), axes, normal }
    }
}

impl Model for SpatialModel {
    const STRIDE: usize = 4;
    type Rod<D: RodScalar> = SpatialRod<D>;
    type Rest<D: RodScalar> = SpatialRest<D>;

    /// The rest shape on a mesh, in the axes of the model: nodes, tributary lengths and Bishop frames. The first frame
    /// has the first material director. Joints have integrated curvatures along the two directors, and for corrected
    /// discretizations their slants.
    fn at_rest<D: RodScalar>(&self, scene: &Scene<D>, mesh: &Mesh<D>) -> SpatialRest<D> {
        let turned = self.normal.map(|normal| tilted(scene, &mesh.nodes, &normal));
        let nodes = turned.as_deref().unwrap_or(&mesh.nodes);
        let director = self.components(first_director(scene, nodes));
        let nodes: Vec<Vector<D>> = nodes.iter().map(|x| self.components(*x)).collect();
        let tangents: Vec<Vector<D>> = nodes.windows(2).map(|p| unit(sub(p[1], p[0]))).collect();
        let frames = Frames::bishop(&tangents, director);
        let zero = D::from(0.0);
        let stiffness = Stiffness { bend: [zero; 3], twist: zero, coupling: [zero; 2] };
        let law = JointLaw { stiffness, natural: [zero; 3] };
        // Strains of joints at rest by an element without stiffness.
        let curvature: Vec<[D; 2]> = (0..nodes.len() - 2)
            .map(|i| {
                let joint = law.at([frames.edges[i], frames.edges[i + 1]], zero);
                let [a, b, c] = [nodes[i], nodes[i + 1], nodes[i + 2]];
                let q = [a[0], a[1], a[2], zero, b[0], b[1], b[2], zero, c[0], c[1], c[2]];
                let [k1, k2, _] = joint.strains(&q);
                [k1, k2]
            })
            .collect();
        let slants = self
            .correction
            .arcs(mesh)
            .map(|arcs| joint_slants(&nodes, arcs.lengths, &frames.edges, &curvature));
        let line = RestLine::new(nodes, mesh, &self.correction);
        SpatialRest { line, slants, curvature, frames }
    }

    /// The spatial rod of a scene: edges with `EA`, joints with `EI/l`, `GJ/l`, natural curvature and twist, masses,
    /// weights and internal friction, and nonlinear laws of bending and stretch where the material has them. Masses
    /// include rotational inertias and the added mass of a fluid, weights its buoyancy. Stiffnesses are means of the
    /// tapered section; those of bending and stretch are reduced by compliant clamps. Corrected discretizations rotate
    /// and scale the stiffness of curved joints. Point masses, loads and user-defined energies are not included.
    fn rod<D: RodScalar>(&self, scene: &Scene<D>, rest: &SpatialRest<D>) -> SpatialRod<D> {
        let line = &rest.line;
        let profile = SectionProfile::new(scene, &line.places);
        let clamps = SoftClamps::new(scene, line.length.len());
        let secant = scene.material.bending_law.as_ref().map(SecantStiffness::new).map(Arc::new);
        let mut nonlinear_bending = Vec::new();
        let joint = rest.curvature.iter().enumerate().map(|(i, k)| {
            let per_length = line.tributary.joint[i].recip();
            let SectionConstants { bending, torsion, .. } = profile.joint(i);
            let [k1, k2] = bending.map(|ei| clamps.bending(i, ei * per_length));
            let k3 = torsion * per_length;
            let factor = scene.rod.natural_curvature.at_joint(i + 1, &line.places);
            // Natural bending and twist are per length of the curve, without the corrections at
            // walls.
            let length = (line.tributary.spin[i] + line.tributary.spin[i + 1]) * 0.5;
            let bending = scene.rod.bending_at(i + 1, &line.places);
            // Natural curvature: a factor on that at rest, and additional bending; natural twist times length.
            let natural = [0, 1].map(|c| factor * k[c] + bending[c] * length);
            let twist = scene.rod.natural_twist.at_joint(i + 1, &line.places) * length;
            // The stiffness `EI1 a a' + EI2 b b' + GJ c c'` over the length of the joint.
            let [a, b, c] = match &rest.slants {
                Some(slants) => resistances(natural, natural_slant(slants[i], factor, *k, twist)),
                None => PLAIN.map(|a| a.map(D::from)),
            };
            let entry =
                |r: usize, s: usize| k1 * (a[r] * a[s]) + k2 * (b[r] * b[s]) + k3 * (c[r] * c[s]);
            let stiffness = Stiffness {
                bend: [entry(0, 0), entry(0, 1), entry(1, 1)],
                twist: entry(2, 2),
                coupling: [entry(0, 2), entry(1, 2)],
            };
            let natural = [natural[0], natural[1], twist];
            if let Some(secant) = &secant {
                let length = line.tributary.joint[i];
                nonlinear_bending.push(NonlinearBending::new(secant, &stiffness, natural, length));
            }
            JointLaw { stiffness, natural }
        });
        let joint = joint.collect();
        let gravity = self.components(scene.loads.gravity);
        let InertiaAndWeight { mass, load } = line.inertia_and_weight(scene, &profile, gravity);
        let (stretch, nonlinear) = line.stretch(&scene.material, &profile, &clamps);
        SpatialRod {
            stretch,
            nonlinear,
            joint,
            bending: nonlinear_bending,
            mass,
            load,
            moments: Moments::none(),
            sliders: springs(scene, &line.tributary, |_| D::from(1.0)),
            own: UserEnergies::default(),
            followers: FollowerLoads::none(),
            contacts: RodContacts::default(),
        }
    }

    /// Tributary lengths of nodes, edges and joints, m; in corrected discretizations of arcs, with the corrections at
    /// walls.
    fn tributary<D: RodScalar>(rest: &SpatialRest<D>) -> &TributaryLengths<D> {
        &rest.line.tributary
    }

    /// The map from unknowns to positions and directors in the world, for user-defined energies. It has the axes of the
    /// model, or none if they are those of the world.
    fn chart<D: RodScalar>(&self, _: &Scene<D>, _: &SpatialRest<D>) -> Chart<D> {
        let axes = self.axes.map(Into::into);
        let world = [0, 1, 2].map(|k| [0, 1, 2].map(|c| f64::from(c == k)));
        Chart::Space { axes: (axes != world).then_some(axes) }
    }

    /// Number of unknowns, the supported ones included: three coordinates per node and one angle per edge, `4 N - 1`
    /// for N nodes.
    fn dof(&self) -> usize {
        4 * self.nodes - 1
    }

    /// The unknowns at rest: the coordinates of each node in turn, in the axes of the model, m. An angle of zero, rad,
    /// for each edge follows those of its first node.
    fn unknowns<D: RodScalar>(&self, rest: &SpatialRest<D>) -> Vec<D> {
        let zero = D::from(0.0);
        let mut q: Vec<D> =
            rest.line.nodes.iter().flat_map(|[x, y, z]| [*x, *y, *z, zero]).collect();
        q.pop();
        q
    }

    /// The Bishop (twist-free) frames of the edges at rest, from which angles are measured.
    fn frames<D: RodScalar>(&self, rest: &SpatialRest<D>) -> Frames<D> {
        rest.frames.clone()
    }

    /// The frames (tangent and director of each edge, reference twist of each joint, rad), converted to the number type
    /// `D` without derivatives.
    fn frames_over<D: RodScalar>(frames: &Frames<f64>) -> Frames<D> {
        let over = |v: [f64; 3]| v.map(D::from);
        let edge = |frame: &EdgeFrame<f64>| EdgeFrame {
            tangent: over(frame.tangent),
            director: over(frame.director),
        };
        Frames {
            edges: frames.edges.iter().map(edge).collect(),
            twist: frames.twist.iter().map(|t| D::from(*t)).collect(),
        }
    }

    /// Number of unknowns that a support holds, counted from the end of the rod inwards: none (free), 2 (roller), 3
    /// (pinned) or 7 (clamped). A clamp holds two nodes and the angle of their edge. A recorded end counts as a clamp,
    /// although more held markers hold more nodes.
    fn held_unknowns(&self, support: Support) -> usize {
        match support {
            Support::Free => 0,
            Support::Roller => 2,
            Support::Pinned => 3,
            // Of recorded ends more nodes may be held.
            Support::Clamped | Support::Recorded => 7,
        }
    }

    /// The three scalar products of a vector of the world with the axes of the model.
    fn components<D: Scalar>(&self, [x, y, z]: [D; 3]) -> [D; 3] {
        self.axes.map(|axis| x * axis.x + y * axis.y + z * axis.z)
    }

    /// The position of node `i` in the world, m, from all unknowns `q`.
    #[inline]
    fn position<D: Scalar>(&self, q: &[D], i: usize) -> [D; 3] {
        let [x, y, z] = self.axes;
        components(|c| q[4 * i] * x[c] + q[4 * i + 1] * y[c] + q[4 * i + 2] * z[c])
    }

    /// The velocity of node `i` in the world, m/s, from the rates `v` of all unknowns; a rotation of any such vector
    /// into the world.
    #[inline]
    fn rate<D: Scalar>(&self, v: &[D], i: usize) -> [D; 3] {
        self.position(v, i)
    }
}
