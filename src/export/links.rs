//! A rod at rest as a chain of rigid links with elastic joints, for files of other programs.
//!
//! Input: a problem of one rod. Output: a [`RodChain`] with the nodes in world axes, m, a frame (tangent and directors)
//! per edge, a [`ChainLink`] per edge and a [`ChainJoint`] per inner node. A link has mass, kg, moment of inertia and
//! section; half of the mass is at each of its nodes, as in the rod. A joint represents the length `l` of rod between
//! the middles of its edges. Its rotational stiffnesses, N m/rad, are `EI/l` for bending and `GJ/l` for twist. It also
//! has the rotations without stress, viscous times, and moments of internal friction. Directors are free of twist at
//! rest; the first one is that of the section. Supports, gravity, mass-proportional damping and moduli are those of the
//! scene. `tip_fraction` is the place of the end of the rod in the last link, below 1 within a clamp; `weight_strain`
//! is the largest axial strain by the weight, which rigid links leave out. Error: point masses outside the rod.

use crate::energy::frame::{EdgeFrame, Frames};
use crate::error::{Error, GIVEN_AS_TEXT};
use crate::numerics::vector::{Vector, cross, dot, scale, sub, unit};
use crate::problem::model::{first_director, tilted};
use crate::problem::{Problem, SectionProfile, nodal_masses};
use crate::scene::mesh::Mesh;
use crate::scene::{Scene, Section, Support};

/// A rod as links and joints.
pub(super) struct RodChain {
    /// Name of the scene file without its ending, or `rod`.
    pub name: String,
    /// Positions of the nodes at rest, m.
    pub nodes: Vec<Vector<f64>>,
    /// Arc lengths of the nodes from the first wall or end, m; negative behind the wall.
    pub places: Vec<f64>,
    /// Length of the rod between its walls or ends, m.
    pub length: f64,
    /// Duration of a motion, s: that of the scene, or 1.
    pub end: f64,
    /// Tangent, first and second director of every edge.
    pub frames: Vec<[Vector<f64>; 3]>,
    pub links: Vec<ChainLink>,
    /// One per inner node.
    pub joints: Vec<ChainJoint>,
    /// Point masses at nodes.
    pub masses: Vec<PlacedMass>,
    pub supports: [Support; 2],
    pub gravity: Vector<f64>,
    /// Rate of the force `-rate M v`, 1/s.
    pub mass_damping: f64,
    /// Young's and shear modulus, Pa, density, kg/m^3, and shear coefficient, without taper. The shear modulus is
    /// `None` if the scene has neither a shear modulus nor Poisson's ratio.
    pub moduli: ChainModuli,
}

/// Constants of the material without taper.
pub(super) struct ChainModuli {
    /// Young's modulus, Pa.
    pub young: f64,
    /// Shear modulus, Pa; `None` if the scene has neither `shear_modulus` nor `poisson_ratio`.
    pub shear: Option<f64>,
    /// Density, kg/m^3.
    pub density: f64,
    /// Timoshenko's shear coefficient of the section.
    pub shear_coefficient: f64,
}

/// A mass at a node.
pub(super) struct PlacedMass {
    pub node: usize,
    /// Mass, kg.
    pub mass: f64,
}

/// The rod between two nodes as a rigid body.
pub(super) struct ChainLink {
    /// Distance of the nodes, m.
    pub length: f64,
    /// Outer radius of a circle or tube; for other sections that of a circle of the same area, m.
    pub radius: f64,
    /// Mass, kg: half at each node.
    pub mass: f64,
    /// Moment of inertia about the tangent, kg m^2.
    pub inertia: f64,
    /// Area, m^2.
    pub area: f64,
    /// EA, N.
    pub axial: f64,
    /// rho A, kg/m.
    pub line_density: f64,
    /// GJ, and EI of bending towards the second and then the first director, which are rotations about the first and
    /// the second one, N m^2.
    pub rigidity: [f64; 3],
}

/// The elastic joint at an inner node.
pub(super) struct ChainJoint {
    /// Length of the rod that the joint represents, m.
    pub length: f64,
    /// Rotational stiffnesses, N m/rad: about the tangent, the first and the second director.
    pub stiffness: [f64; 3],
    /// Rotations without stress beyond that at rest about the same axes, rad.
    pub reference: [f64; 3],
    /// Viscous times about the same axes, s.
    pub viscous: [f64; 3],
    /// Largest moments of internal friction about the same axes, N m.
    pub friction: [f64; 3],
}

impl RodChain {
    /// The chain of a problem of one rod, in its rest shape on the mesh of the problem. Error: point masses outside the
    /// rod.
    pub fn of(problem: &Problem) -> Result<Self, Error> {
        let (scene, mesh) = (problem.scene(), &problem.mesh);
        let nodes = match problem.planar() {
            Some(planar) => tilted(scene, &mesh.nodes, &planar.model.normal()),
            None => mesh.nodes.clone(),
        };
        let tangents: Vec<_> = nodes.windows(2).map(|pair| unit(sub(pair[1], pair[0]))).collect();
        let frames = Frames::bishop(&tangents, first_director(scene, &nodes));
        let masses = nodal_masses(scene, mesh)?;
        let material = &scene.material;
        let shear = material.has_shear_modulus().then(|| material.shear_modulus());
        let poisson = shear.map_or(0.0, |shear| material.youngs_modulus / (2.0 * shear) - 1.0);
        Ok(Self {
            name: name_of(scene),
            places: mesh.arc_length.clone(),
            length: mesh.length,
            end: scene.time.as_ref().map_or(1.0, |time| time.end),
            links: links(scene, mesh, &nodes),
            joints: joints(scene, mesh, &frames.edges),
            frames: frames.edges.iter().map(axes).collect(),
            nodes,
            masses: masses
                .into_iter()
                .map(|at| PlacedMass { node: at.node, mass: at.mass })
                .collect(),
            supports: [scene.supports.start, scene.supports.end],
            gravity: scene.loads.gravity,
            mass_damping: scene.loads.damping.mass,
            moduli: ChainModuli {
                young: material.youngs_modulus,
                shear,
                density: material.density,
                shear_coefficient: scene.rod.section.shear_coefficient(poisson),
            },
        })
    }

    /// Position of the end of the rod in its last link, as a fraction of the link, at most 1. It is below 1 where a
    /// clamp holds the rod within the link.
    pub fn tip_fraction(&self) -> f64 {
        let last = self.places.len() - 1;
        let [from, to] = [self.places[last - 1], self.places[last]];
        ((self.length - from) / (to - from)).min(1.0)
    }

    /// Largest axial strain by the weight of the rod and its point masses: their sum over the least EA. It measures the
    /// stretch that rigid links leave out.
    pub fn weight_strain(&self) -> f64 {
        let mass: f64 = self.links.iter().map(|link| link.mass).sum();
        let points: f64 = self.masses.iter().map(|at| at.mass).sum();
        let least = self.links.iter().map(|link| link.axial).fold(f64::INFINITY, f64::min);
        (mass + points) * dot(self.gravity, self.gravity).sqrt() / least
    }
}

/// The name of the scene file without folder and ending, in which all characters but ASCII letters, digits, `_` and `-`
/// are replaced by `_`; `rod` without a file.
fn name_of(scene: &Scene) -> String {
    let path = scene.path.as_deref().filter(|path| !path.ends_with(GIVEN_AS_TEXT));
    let stem = path.and_then(|path| path.file_stem());
    let name = stem.map_or_else(|| "rod".into(), |stem| stem.to_string_lossy().into_owned());
    name.chars().map(|c| if c.is_ascii_alphanumeric() || c == '-' { c } else { '_' }).collect()
}

/// Tangent, first and second director of an edge, unit vectors.
fn axes(frame: &EdgeFrame<f64>) -> [Vector<f64>; 3] {
    [frame.tangent, frame.director, cross(frame.tangent, frame.director)]
}

/// The links of all edges: lengths from the positions of the `nodes`, m, masses and sections at the middles of the
/// edges.
fn links(scene: &Scene, mesh: &Mesh, nodes: &[Vector<f64>]) -> Vec<ChainLink> {
    let places = mesh.places();
    let profile = SectionProfile::new(scene, &places);
    let link = |j: usize| {
        let constants = profile.edge(j);
        let between = sub(nodes[j + 1], nodes[j]);
        let length = dot(between, between).sqrt();
        let (section, _) = scene.at(0.5 * (places[j] + places[j + 1]));
        let radius = match section {
            Section::Circle { radius } | Section::Tube { radius, .. } => radius,
            _ => (constants.area / std::f64::consts::PI).sqrt(),
        };
        ChainLink {
            length,
            radius,
            mass: constants.line_density * mesh.arcs[j],
            inertia: constants.line_inertia * mesh.arcs[j],
            area: constants.area,
            axial: constants.axial,
            line_density: constants.line_density,
            rigidity: [constants.torsion, constants.bending[1], constants.bending[0]],
        }
    };
    (0..mesh.arcs.len()).map(link).collect()
}

/// The joints of all inner nodes, between edges with these `frames` at rest: stiffnesses, viscous times and friction
/// about the tangent, the first and the second director.
fn joints(scene: &Scene, mesh: &Mesh, frames: &[EdgeFrame<f64>]) -> Vec<ChainJoint> {
    let places = mesh.places();
    let profile = SectionProfile::new(scene, &places);
    let damping = &scene.loads.damping;
    let viscous =
        [damping.twisting, damping.bending, damping.bending].map(|t| damping.stiffness + t);
    let joint = |i: usize| {
        let constants = profile.joint(i);
        let length = 0.5 * (mesh.arcs[i] + mesh.arcs[i + 1]);
        // Bending towards the first director is a rotation about the second one.
        let [first, second] = constants.bending;
        let stiffness = [constants.torsion, second, first].map(|k| k / length);
        let slip = damping.friction.map_or(0.0, |f| f.stiffness * f.curvature * length);
        ChainJoint {
            length,
            stiffness,
            reference: reference(scene, frames, i, &places, length),
            viscous,
            friction: stiffness.map(|k| k * slip),
        }
    };
    (0..frames.len() - 1).map(joint).collect()
}

/// Rotations at which joint `i` has no stress, less those at rest, about tangent, first and second director, rad. They
/// follow from natural curvature, bending and twist of the scene; bending is converted from curvatures `2 tan(angle/2)`
/// to angles. `places` are those of all nodes, as fractions of the length of the rod, `length` is the length that the
/// joint represents, m.
fn reference(
    scene: &Scene,
    frames: &[EdgeFrame<f64>],
    i: usize,
    places: &[f64],
    length: f64,
) -> [f64; 3] {
    let [a, b] = [axes(&frames[i]), axes(&frames[i + 1])];
    // Curvature binormal 2 a x b/(1 + a.b), of size 2 tan(angle/2).
    let binormal = scale(cross(a[0], b[0]), 2.0 / (1.0 + dot(a[0], b[0])));
    let about = |k: usize| 0.5 * (dot(binormal, a[k]) + dot(binormal, b[k]));
    // Towards the first director, then towards the second one.
    let at_rest = [about(2), -about(1)];
    let factor = scene.rod.natural_curvature.at_joint(i + 1, places);
    let more = scene.rod.bending_at(i + 1, places);
    let beyond = [0, 1].map(|c| {
        let natural = factor * at_rest[c] + more[c] * length;
        2.0 * ((0.5 * natural).atan() - (0.5 * at_rest[c]).atan())
    });
    [scene.rod.natural_twist.at_joint(i + 1, places) * length, -beyond[1], beyond[0]]
}
