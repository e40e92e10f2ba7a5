//! The planar model: a rod with stretch and bending in the plane of its scene.
//!
//! [`PlanarModel`] finds the plane of rest shape, initial shape, loads, actuators, obstacles and motions. It rejects
//! scenes that leave the plane, also by natural twist or bending, the twist of an end or a user-defined energy, with
//! the key of the first such quantity. It selects the second moment of the section that resists bending in the plane
//! (`second_moment` is its index). `in_plane` is the model of one rod of a structure in a given plane, `normal` the
//! normal of the plane in the world. A section with principal axes oblique to the plane is rejected, unless both
//! moments are equal. As a [`Model`] it builds the `PlanarRod` over any number type, with two coordinates (m) per node,
//! in the axes of the plane. Point masses, loads and user-defined energies are added by the setup. Moments (N m) act by
//! half on both edges of a node. With a roller, one of the axes lies along its direction.

use crate::energy::adapter::Chart;
use crate::energy::law::{NonlinearBending, SecantStiffness};
use crate::energy::{DeadMoment, PlanarBend, planar_bend};
use crate::error::Error;
use crate::numerics::scalar::{RodScalar, Scalar};
use crate::numerics::vector::Vector;
use crate::problem::model::{
    Correction, Model, NodalLoad, first_director, rolling, springs, tilted,
};
use crate::problem::own::find_nonplanar;
use crate::problem::planarity::{PlanarVectors, TOLERANCE, rotations_about_rod};
use crate::problem::rest_line::{InertiaAndWeight, RestLine};
use crate::problem::section_profile::SectionProfile;
use crate::problem::soft_clamp::SoftClamps;
use crate::problem::tributary::TributaryLengths;
use crate::rod::{EdgeMoment, FollowerLoads, Moments, PlanarRod, RodContacts, UserEnergies};
use crate::scene::mesh::Mesh;
use crate::scene::plane::KeyedVector;
use crate::scene::{End, Plane, Scene, Support};
use nalgebra::Vector3;
use std::sync::Arc;

/// Plane of a scene, and the section that bends in it.
#[derive(Clone, Debug)]
pub struct PlanarModel {
    /// The plane.
    pub plane: Plane,
    correction: Correction,
    /// Index, 0 or 1, of the second moment of the section that resists bending in the plane.
    second_moment: usize,
    /// Number of nodes.
    nodes: usize,
}

/// Rest shape in the plane.
#[derive(Clone, Debug)]
pub struct PlanarRest<D> {
    line: RestLine<D, 2>,
    /// Integrated curvature of every joint, rad.
    curvature: Vec<D>,
}

impl PlanarModel {
    /// Index, 0 or 1, of the second moment of the section that resists bending in the plane.
    pub(crate) fn second_moment(&self) -> usize {
        self.second_moment
    }

    /// The planar model of a scene on its `mesh`. `start` has the nodes of the initial shape, m, if that is not the
    /// rest shape. The plane is found from nodes, forces, motions and moments of the scene ([`Plane::through`]). The
    /// error is a message with the key of the first quantity that leaves the plane, also a twist, natural bending or a
    /// user-defined energy. A section whose principal axes are oblique to the plane is rejected too, unless both second
    /// moments are equal. With a roller, the axes of the plane are rotated so that x (at the end) or y (at the start)
    /// lies along its direction.
    pub(crate) fn new(
        scene: &Scene,
        mesh: &Mesh,
        start: Option<&[Vector<f64>]>,
        correction: Correction,
    ) -> Result<Self, String> {
        let nodes = &mesh.nodes[..];
        let along = Vector3::from(nodes[1]) - Vector3::from(nodes[0]);
        // The vectors of the scene that must lie in the plane, and those that must be normal to
        // it.
        let PlanarVectors { within: mut vectors, normal } = PlanarVectors::new(scene, nodes, start);
        // A vector normal to the plane determines it by its cross product with the rod.
        let crossed = |v: &KeyedVector| KeyedVector {
            key: v.key.clone(),
            vector: Vector3::from(v.vector).cross(&along).into(),
        };
        vectors.extend(normal.iter().map(crossed));
        let up = scene.rod.section.up().map(Vector3::from);
        let leaves = |what: &str| format!("{what} leaves the plane of the rest shape");
        let mut plane = Plane::through(nodes, &vectors, up).map_err(|what| leaves(&what))?;
        for KeyedVector { key, vector } in &normal {
            let vector = Vector3::from(*vector);
            if plane.components(vector).0.norm() > TOLERANCE * vector.norm() {
                return Err(leaves(key));
            }
        }
        // Twist and natural bending out of the plane need the spatial model.
        if let Some((key, _)) = rotations_about_rod(scene).into_iter().find(|(_, t)| *t != 0.0) {
            return Err(leaves(&key));
        }
        if !scene.rod.natural_bending.is_empty() {
            return Err(leaves("rod.natural_bending"));
        }
        let normal = plane.x.cross(&plane.y);
        if let Some(energy) = find_nonplanar(&scene.energies, |v| *v, normal, plane.origin) {
            return Err(leaves(&energy));
        }
        let mut model = Self { plane: plane.clone(), correction, second_moment: 0, nodes: 0 };
        let tilted = tilted(scene, nodes, &model.normal());
        // A roller at the end holds the last coordinate of its node, one at the start the first, so
        // that the free unknowns stay side by side.
        if let Some((end, direction)) = rolling(scene, &tilted) {
            let normal = plane.x.cross(&plane.y);
            let along = direction.normalize();
            (plane.x, plane.y) = match end {
                End::End => (along, normal.cross(&along)),
                End::Start => (along.cross(&normal), along),
            };
        }
        // The section must bend about a principal axis, or it would leave the plane.
        let second_moment = second_moment_in(scene, &plane, &tilted)
            .ok_or("rod.section.up is neither in the plane of the rest shape nor normal to it")?;
        model = Self { plane, second_moment, nodes: nodes.len(), ..model };
        Ok(model)
    }

    /// The model of one rod of a structure in the given `plane`, on its mesh. Only the orientation of its section is
    /// checked; the axes are those of the plane.
    ///
    /// # Errors
    /// [`Error::Invalid`] for a section whose bending leaves the plane.
    pub(crate) fn in_plane(
        scene: &Scene,
        mesh: &Mesh,
        plane: Plane,
        correction: Correction,
    ) -> Result<Self, Error> {
        let second_moment = second_moment_in(scene, &plane, &mesh.nodes).ok_or_else(|| {
            let found = "a direction neither in the plane of the structure nor normal to it";
            Error::invalid("rod.section.up", found, "one of the two")
        })?;
        Ok(Self { plane, correction, second_moment, nodes: mesh.nodes.len() })
    }

    /// The unit normal of the plane in the world, x axis times (cross product) y axis of the plane.
    pub(crate) fn normal(&self) -> Vector3<f64> {
        self.plane.x.cross(&self.plane.y)
    }

    /// The scalar products of a vector of the world with the two axes of the plane; of a position, its planar
    /// coordinates, m.
    fn projected<D: Scalar>(&self, point: Vector<D>) -> [D; 2] {
        let [x, y, _] = self.components(point);
        [x, y]
    }
}

impl Model for PlanarModel {
    const STRIDE: usize = 2;
    type Rod<D: RodScalar> = PlanarRod<D>;
    type Rest<D: RodScalar> = PlanarRest<D>;

    /// The rest shape on a mesh, in the axes of the plane: nodes after the rotation by `supports.angle`, lengths and
    /// tributary lengths. Every joint with the turning angle phi has the integrated curvature `2 tan(phi/2)`.
    fn at_rest<D: RodScalar>(&self, scene: &Scene<D>, mesh: &Mesh<D>) -> PlanarRest<D> {
        let tilted = tilted(scene, &mesh.nodes, &self.normal());
        let nodes: Vec<[D; 2]> = tilted.iter().map(|x| self.projected(*x)).collect();
        let joints = nodes.windows(3);
        let curvature = joints
            .map(|p| planar_bend::curvature(p.first_chunk().expect("windows of three")))
            .collect();
        PlanarRest { line: RestLine::new(nodes, mesh, &self.correction), curvature }
    }

    /// The planar rod of a scene: edges with `EA`, joints with `EI/l` and natural curvature, nonlinear laws of the
    /// material, masses, weights and internal friction. Masses include the added mass of a fluid, weights its buoyancy.
    /// Stiffnesses are means of the tapered section, reduced by compliant clamps. In corrected discretizations those of
    /// bending are divided by `(1 + k^2/4)^2` for the natural curvature k of the joint. Point masses, loads and
    /// user-defined energies are not included.
    fn rod<D: RodScalar>(&self, scene: &Scene<D>, rest: &PlanarRest<D>) -> PlanarRod<D> {
        let PlanarRest { line, curvature } = rest;
        let profile = SectionProfile::new(scene, &line.places);
        let clamps = SoftClamps::new(scene, line.length.len());
        let joints = line.tributary.joint.iter().zip(curvature).enumerate();
        let secant = scene.material.bending_law.as_ref().map(SecantStiffness::new).map(Arc::new);
        let mut bending = Vec::new();
        let bend = joints.map(|(i, (l, k))| {
            let natural = scene.rod.natural_curvature.at_joint(i + 1, &line.places) * *k;
            // EI over the joint's length, times cos^4(phi/2) in the corrected form.
            // A soft clamp reduces the stiffness of the joints next to the wall.
            let own = profile.joint(i).bending[self.second_moment] * l.recip();
            let mut stiffness = clamps.bending(i, own);
            if self.correction.arcs {
                stiffness /= (natural * natural * 0.25 + 1.0).powi(2);
            }
            if let Some(secant) = &secant {
                bending.push(NonlinearBending::new(secant, &[stiffness], [natural], *l));
            }
            PlanarBend { stiffness, natural_curvature: natural }
        });
        let joint = bend.collect();
        // Springs slip by their energy over the mean bending stiffness, as in space, and here they
        // bend in the plane only.
        let slips = |i: usize| {
            let per_length = line.tributary.joint[i].recip();
            let both = profile.joint(i).bending.map(|ei| clamps.bending(i, ei * per_length));
            ((both[0] + both[1]) * 0.5 / both[self.second_moment]).sqrt()
        };
        let gravity = self.projected(scene.loads.gravity);
        let InertiaAndWeight { mass, load } = line.inertia_and_weight(scene, &profile, gravity);
        let (stretch, nonlinear) = line.stretch(&scene.material, &profile, &clamps);
        PlanarRod {
            stretch,
            nonlinear,
            joint,
            bending,
            mass,
            load,
            moments: Moments { list: Vec::new(), heading: line.edge(0) },
            sliders: springs(scene, &line.tributary, slips),
            own: UserEnergies::default(),
            followers: FollowerLoads::none(),
            contacts: RodContacts::default(),
        }
    }

    /// Adds to the rod the components of the moments of `loads` along the normal, N m, half on each edge of the node.
    /// At an end node both halves act on the only edge. Zero moments are left out unless `D` carries derivatives;
    /// forces are ignored.
    fn add_moments<D: RodScalar>(
        &self,
        rod: &mut PlanarRod<D>,
        rest: &PlanarRest<D>,
        loads: &[NodalLoad<D>],
    ) {
        for EdgeMoment { edge, moment } in self.edge_moments(rest.line.length.len(), loads) {
            let rest = rest.line.edge(edge);
            rod.moments.list.push((edge, DeadMoment { moment, rest }));
        }
    }

    /// The components of the moments of `loads` along the normal, N m, half on each edge of the node of a rod with so
    /// many `edges`; at an end node both halves act on the only edge. Zero moments are left out unless `D` carries
    /// derivatives.
    fn edge_moments<D: RodScalar>(
        &self,
        edges: usize,
        loads: &[NodalLoad<D>],
    ) -> Vec<EdgeMoment<D>> {
        let mut moments = Vec::new();
        for load in loads {
            let [_, _, moment] = self.components(load.moment);
            if moment.value() != 0.0 || D::ORDER > 0 {
                for edge in [load.node.saturating_sub(1), load.node.min(edges - 1)] {
                    moments.push(EdgeMoment { edge, moment: moment * 0.5 });
                }
            }
        }
        moments
    }

    /// Tributary lengths of nodes, edges and joints, m, with the corrections at walls.
    fn tributary<D: RodScalar>(rest: &PlanarRest<D>) -> &TributaryLengths<D> {
        &rest.line.tributary
    }

    /// The map from planar unknowns to positions and directors in the world: origin and axes of the plane. Its first
    /// director has constant components across the tangent, in the plane and along the normal. They are those of the
    /// first material director of the first edge at rest.
    fn chart<D: RodScalar>(&self, scene: &Scene<D>, rest: &PlanarRest<D>) -> Chart<D> {
        let tilted = tilted(scene, &scene.made_mesh().nodes, &self.normal());
        let [along, aside, out] = self.components(first_director(scene, &tilted));
        let [x, y] = rest.line.edge(0);
        let length = (x * x + y * y).sqrt();
        let Plane { origin, x: right, y: up } = &self.plane;
        Chart::Plane {
            origin: (*origin).into(),
            axes: [(*right).into(), (*up).into()],
            across: [(x * aside - y * along) / length, out],
        }
    }

    /// Number of unknowns, two for each node, those that supports hold included.
    fn dof(&self) -> usize {
        2 * self.nodes
    }

    /// Coordinates of all nodes at rest, x and y of each in turn, m, in the axes of the plane.
    fn unknowns<D: RodScalar>(&self, rest: &PlanarRest<D>) -> Vec<D> {
        rest.line.nodes.iter().flatten().copied().collect()
    }

    /// The empty value `()`: a plane has no frames.
    fn frames<D: RodScalar>(&self, _: &PlanarRest<D>) {}

    /// The empty value `()` over any number type: a plane has no frames.
    fn frames_over<D: RodScalar>((): &()) {}

    /// Number of coordinates that a support holds, counted from the end of the rod inwards: free 0, roller 1, pinned 2,
    /// clamped 4 (two nodes). For a recorded end also 4; more held markers hold more nodes.
    fn held_unknowns(&self, support: Support) -> usize {
        match support {
            Support::Free => 0,
            Support::Roller => 1,
            Support::Pinned => 2,
            // Of recorded ends more nodes may be held.
            Support::Clamped | Support::Recorded => 4,
        }
    }

    /// The three scalar products of a vector of the world with the two axes of the plane and its normal.
    fn components<D: Scalar>(&self, [x, y, z]: [D; 3]) -> [D; 3] {
        let axes = [self.plane.x, self.plane.y, self.normal()];
        axes.map(|axis| x * axis.x + y * axis.y + z * axis.z)
    }

    /// The position of node `i` in the world, m, from all unknowns `q`.
    #[inline]
    fn position<D: Scalar>(&self, q: &[D], i: usize) -> [D; 3] {
        self.plane.to_world([q[2 * i], q[2 * i + 1]])
    }

    /// The velocity of node `i` in the world, m/s, from the rates `v` of all unknowns; a rotation of any such vector
    /// into the world.
    #[inline]
    fn rate<D: Scalar>(&self, v: &[D], i: usize) -> [D; 3] {
        self.plane.direction_to_world([v[2 * i], v[2 * i + 1]])
    }
}

/// Index of the second moment that resists bending in the plane. It is 0 with `up` in the plane or without `up`, 1 with
/// `up` normal to it, within `TOLERANCE`. With another `up` it is 0 if both second moments are equal along the rod,
/// else none: bending would leave the plane. `nodes` are those at rest, m, of which the first edge is taken.
fn second_moment_in(scene: &Scene, plane: &Plane, nodes: &[Vector<f64>]) -> Option<usize> {
    let Some(up) = scene.rod.section.up_across(nodes) else { return Some(0) };
    let square = scene.second_moments_along().iter().all(|[i1, i2]| i1 == i2);
    let (in_plane, out) = plane.components(up.into());
    match () {
        // Either serves for equal second moments; this is the right one once they differ.
        () if out.abs() <= TOLERANCE => Some(0),
        () if in_plane.norm() <= TOLERANCE => Some(1),
        () if square => Some(0),
        () => None,
    }
}
