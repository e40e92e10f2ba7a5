//! Effects that the scene of a structure may omit: compliant joints, markers, and errors of lengths, sections,
//! densities and masses of bodies.
//!
//! `StructureTerm::effects` lists the effects of one experiment, each with its number, plausible size in the unit of
//! that number, and distinguishing experiment; none for a scene of one rod. They are rotational compliances of rigid
//! joints and of clamped supports of straight rods, and the mass of a marker at the first observed point of a rod
//! without masses. Further ones are errors of lengths, radii and heights of the rods, of densities of their materials,
//! and of masses of bodies. Only straight rods and arcs have a marker and a length here.
//!
//! `StructureTerm::add_to` adds the term, where the structure can have it. Added compliances and masses are [`TRACE`]
//! times the plausible size; all other numbers are in the scene already. A compliant support is a spring joint between
//! the rod and a short stiff rod that the support clamps instead. Damping and camera have the effects of the table of
//! omitted effects. Motions out of the plane are not tested.

use crate::fit::measurement::experiment::Experiment;
use crate::fit::uncertainty::discrepancy::experiment_effect::{EffectTerm, ExperimentEffect};
use crate::fit::uncertainty::discrepancy::omitted_effects::{
    CLAMP_EXTENSION, DENSITY, LENGTH, MARKER_MASS, SECTION,
};
use crate::problem::Problem;
use crate::scene::per_axis::PerAxis;
use crate::scene::structure::{
    JointEnd, RodEnd, RodMaterial, StructureJoint, StructureRod, SupportedEnd,
};
use crate::scene::structure_point::{PointOfRod, StructurePoint};
use crate::scene::{Material, Parameter, Point, PointMass, Shape, StructureScene, Support, Taper};

/// Size of an added compliance or mass over its plausible size, as scenes do not allow zero.
const TRACE: f64 = 1e-4;
/// Plausible relative error of the mass of a body, of which parts such as screws and glue are not weighed.
const BODY_MASS: f64 = 0.05;
/// Number of edges of the stub of a compliant support: the short rod between support and spring joint.
const STUB_EDGES: usize = 6;
/// Young's modulus of the stub over that of its rod: its own compliance is a thousandth of the plausible one.
const STUB_STIFFENING: f64 = 2e3;

/// A term of a structure that an effect adds.
pub(super) enum StructureTerm {
    /// No term: the number is in the scene already.
    Present,
    /// A rotational spring instead of the rigid joint of this index.
    JointSpring(usize),
    /// A point mass at this point of the rod of this index.
    Marker(usize, Point),
    /// A stub between the support of this index and its rod, along this direction of the rod at the support.
    SoftSupport(usize, [f64; 3]),
}

/// Sizes of a rod of a structure.
struct RodOfStructure {
    /// Length of a straight rod or an arc, m; none of other shapes.
    length: Option<f64>,
    /// Thickness in the softer direction, m: four radii of gyration, `4 sqrt(I/A)`.
    thickness: f64,
    /// Least bending stiffness, N m^2.
    bending: f64,
    /// Mass per length, kg/m.
    line_mass: f64,
}

impl RodOfStructure {
    /// The sizes of a rod, from its section and material: length of a straight rod or an arc, m (none for other
    /// shapes), thickness `4 sqrt(I/A)`, m, stiffness `E I`, N m^2, and mass per length `rho A`, kg/m. `I` is the
    /// smaller second moment of area. None if the scene does not have the material of the rod.
    fn new(scene: &StructureScene, rod: &StructureRod) -> Option<Self> {
        let material = scene.material_of(rod).ok()?;
        let moments = rod.section.moments();
        let [i1, i2] = moments.second_moments;
        let least = i1.min(i2);
        let length = match &rod.shape {
            Shape::Straight { length, .. } | Shape::Arc { length, .. } => Some(*length),
            _ => None,
        };
        Some(Self {
            length,
            // A circle of radius a has I/A = a^2/4.
            thickness: 4.0 * (least / moments.area).sqrt(),
            bending: material.youngs_modulus * least,
            line_mass: material.density * moments.area,
        })
    }
}

impl EffectTerm for StructureTerm {
    /// All effects of the structure of an experiment, with their plausible sizes; empty for a scene of one rod. The
    /// path of a compliant support is that of the spring joint that `add_to` appends to the joints of the scene.
    fn effects(experiment: &Experiment) -> Vec<ExperimentEffect<Self>> {
        let Some(scene) = &experiment.problem.scene().structure else { return Vec::new() };
        let mut all = Vec::new();
        let mut add = |path: String, name: String, size: f64, test, term| {
            let path = Parameter::at(&path).path();
            all.push(ExperimentEffect { path, name, size, test, term });
        };
        let rod_of = |name: &str| scene.rods.iter().find(|rod| rod.name == name);
        for (i, joint) in scene.joints.iter().enumerate() {
            let StructureJoint::Rigid { connects } = joint else { continue };
            let rods: Vec<&str> = connects.iter().filter_map(|end| end.rod.as_deref()).collect();
            let sizes = rods.iter().filter_map(|name| RodOfStructure::new(scene, rod_of(name)?));
            let compliance = sizes.map(|own| CLAMP_EXTENSION * own.thickness / own.bending);
            // The most compliant of the joined rods determines the plausible size.
            let Some(size) = compliance.reduce(f64::max) else { continue };
            let name = format!("compliant joint of {}", rods.join(", "));
            let test = "load one rod at rest and photograph the angles at the joint";
            add(joint_rotation(i), name, size, test, Self::JointSpring(i));
        }
        for (i, support) in scene.supports.iter().enumerate() {
            let Some(rod) = rod_of(&support.of.rod) else { continue };
            // The stub continues the rod beyond its supported end, in the direction of a straight one.
            if let (Some(own), Shape::Straight { direction, .. }, Support::Clamped) =
                (RodOfStructure::new(scene, rod), &rod.shape, support.kind)
            {
                let size = CLAMP_EXTENSION * own.thickness / own.bending;
                let end = ["start", "end"][support.of.at.index()];
                let name = format!("compliant support of {}, {end}", rod.name);
                let test = "repeat at another free length";
                let term = Self::SoftSupport(i, *direction);
                add(joint_rotation(scene.joints.len()), name, size, test, term);
            }
        }
        for body in &scene.bodies {
            let (path, name) =
                (format!("bodies.{}.mass", body.name), format!("other mass of {}", body.name));
            add(path, name, BODY_MASS * body.mass, "weigh the body", Self::Present);
        }
        let mut materials: Vec<&str> = Vec::new();
        for (i, rod) in scene.rods.iter().enumerate() {
            let Some(own) = RodOfStructure::new(scene, rod) else { continue };
            let place = format!("rods.{}", rod.name);
            // A mass that the scene states may be the marker.
            let marker = observed_point(experiment, &rod.name).filter(|_| rod.mass.is_empty());
            if let (Some(point), Some(length)) = (marker, own.length) {
                let name = format!("marker on {}", rod.name);
                let (size, test) = (MARKER_MASS * own.line_mass * length, "weigh the marker");
                add(format!("{place}.mass.0.mass"), name, size, test, Self::Marker(i, point));
            }
            if let Some(length) = own.length {
                let (name, test) = (format!("other length of {}", rod.name), "measure the length");
                add(format!("{place}.shape.length"), name, LENGTH * length, test, Self::Present);
            }
            let section = format!("{place}.section");
            let scene = experiment.problem.scene();
            for (key, test) in [
                ("radius", "measure both ends with calipers"),
                ("height", "measure it with calipers"),
            ] {
                let path = format!("{section}.{key}");
                if let Some(value) = Parameter::at(&path).of(scene) {
                    let name = format!("other {key} of {}", rod.name);
                    add(path, name, SECTION * value, test, Self::Present);
                }
            }
            // Rods of one named material share its density: that is one effect.
            let (density, name) = match &rod.material {
                RodMaterial::Name(name) if materials.contains(&&name[..]) => continue,
                RodMaterial::Name(name) => {
                    materials.push(name);
                    (format!("materials.{name}.density"), format!("other density of {name}"))
                }
                RodMaterial::Own(_) => {
                    (format!("{place}.material.density"), format!("other density of {}", rod.name))
                }
            };
            if let Some(value) = Parameter::at(&density).of(scene) {
                add(density, name, DENSITY * value, "weigh the rod", Self::Present);
            }
        }
        all
    }

    /// The effect with the path of its number in `problem`, to which other effects may have been added. Only the path
    /// of a compliant support changes: its joint is appended after all joints of the problem.
    fn beside_others_of(
        effect: ExperimentEffect<Self>,
        problem: &Problem,
    ) -> ExperimentEffect<Self> {
        let structure = problem.scene().structure.as_ref();
        match (&effect.term, structure) {
            (Self::SoftSupport(..), Some(scene)) => {
                let path = Parameter::at(&joint_rotation(scene.joints.len())).path();
                ExperimentEffect { path, ..effect }
            }
            _ => effect,
        }
    }

    /// Adds the term to the structure of an experiment; nothing if the number is in the scene already. False, without a
    /// change, for one rod, where the structure cannot have the term, or where the model has no derivative by the
    /// number.
    fn add_to(effect: &ExperimentEffect<Self>, experiment: &mut Experiment) -> bool {
        let Some(problem) = added(effect, &experiment.problem) else { return false };
        experiment.problem = problem;
        true
    }
}

/// A copy of the problem with the term of the effect added; an unchanged one if the number is in the scene already.
/// None for a problem of one rod, where the structure cannot have the term, or where the model has no derivative by
/// the number.
fn added(effect: &ExperimentEffect<StructureTerm>, problem: &Problem) -> Option<Problem> {
    let trace = TRACE * effect.size;
    let mut scene = problem.scene().clone();
    let structure = scene.structure.as_mut()?;
    let mut stub_edges = None;
    match effect.term {
        StructureTerm::SoftSupport(support, direction) => {
            let edges: usize = structure.rods.iter().map(|rod| rod.segments).sum();
            stub_edges = Some((STUB_EDGES, edges));
            soften_support(structure, support, direction, trace)?;
        }
        StructureTerm::Present => {}
        StructureTerm::Marker(rod, node) => {
            structure.rods[rod].mass.push(PointMass::new(node, trace));
        }
        StructureTerm::JointSpring(joint) => {
            let mut connects = structure.joints[joint].connects().to_vec();
            // A spring turns the further entries against the first, which a body must be.
            connects.sort_by_key(|end| end.body.is_none());
            let rotation = PerAxis::One(trace);
            let rest = PerAxis::One(0.0);
            structure.joints[joint] =
                StructureJoint::Spring { connects, rotation, rest, damping: 0.0 };
        }
    }
    if let Some((stub, edges)) = stub_edges {
        // The representative rod has the edges of the stub too, in the same proportion on another mesh.
        let grown = |count: usize| (count as f64 * (1.0 + stub as f64 / edges as f64)).round();
        scene.rod.segments = scene.rod.segments.map(|count| count + stub);
        scene.remeshed = scene.remeshed.map(|count| grown(count) as usize);
    }
    let added = problem.with_scene(scene).ok()?;
    added.check_parameter(Parameter::at(effect.path)).ok()?;
    Some(added)
}

/// Path of the rotational compliance of the joint with the index `joint`.
fn joint_rotation(joint: usize) -> String {
    format!("joints.{joint}.rotation")
}

/// Changes the structure in place: the rod at the support with the index `support` is joined by a spring of this
/// rotational `compliance`, rad/(N m), to a short stiff rod, which the support clamps instead. The short rod continues
/// the supported one along its `direction`. None, without a change, if that rod or its material is missing.
fn soften_support(
    structure: &mut StructureScene,
    support: usize,
    direction: [f64; 3],
    compliance: f64,
) -> Option<()> {
    let end = structure.supports[support].of.clone();
    let rod = structure.rods.iter().find(|rod| rod.name == end.rod)?;
    let own = RodOfStructure::new(structure, rod)?;
    let material = structure.material_of(rod).ok()?;
    let name = format!("support-{support}-of-{}", end.rod);
    let stub = StructureRod {
        name: name.clone(),
        segments: STUB_EDGES,
        shape: Shape::Straight { length: own.thickness, direction },
        origin: None,
        section: rod.section.clone(),
        material: RodMaterial::Own(Material {
            youngs_modulus: STUB_STIFFENING * material.youngs_modulus,
            ..material
        }),
        taper: Taper::default(),
        natural_curvature: 1.0.into(),
        damping_factor: 1.0,
        mass: Vec::new(),
        remeshed: None,
    };
    // A stub at the start of a rod ends there, one at its end starts there.
    let [joined, clamped] = match end.at {
        RodEnd::Start => [RodEnd::End, RodEnd::Start],
        RodEnd::End => [RodEnd::Start, RodEnd::End],
    };
    let end_of = |rod: String, at: RodEnd| JointEnd {
        rod: Some(rod),
        at: Some(at),
        body: None,
        offset: None,
    };
    let connects = vec![end_of(name.clone(), joined), end_of(end.rod, end.at)];
    structure.rods.push(stub);
    structure.joints.push(StructureJoint::Spring {
        connects,
        rotation: PerAxis::One(compliance),
        rest: PerAxis::One(0.0),
        damping: 0.0,
    });
    structure.supports[support].of = SupportedEnd { rod: name, at: clamped };
    Some(())
}

/// The first observed point of the rod of this name in a structure, by the measured motions; none if no motion of it is
/// measured.
fn observed_point(experiment: &Experiment, rod: &str) -> Option<Point> {
    experiment.measurements.iter().find_map(|measurement| match &measurement.motion()?.place {
        Some(StructurePoint::Rod(PointOfRod { rod: own, at })) if own == rod => Some(at.point()),
        _ => None,
    })
}
