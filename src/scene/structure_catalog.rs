//! A structure for the catalog of parameters, which contains the numbers of a structure that can be parameters.
//!
//! Input is a scene of one rod, whose shape, section, material, taper, curvature, damping and time are used. Output of
//! [`catalog_structure`] is a [`StructureScene`] with one rod, one material, one point force and one hinge. It has two
//! bodies and two spring joints: one with a single number, one with three, for inertia, compliance and rest angle. All
//! names are `ANY_NAME` (`*`), so that paths are general: `rods.*.section.radius`. The module `parameter` visits the
//! numbers for their units and limits; the structure is neither validated nor simulated.

use crate::scene::mass::PointMass;
use crate::scene::per_axis::PerAxis;
use crate::scene::point::Point;
use crate::scene::rod::Dimension;
use crate::scene::rod_contact::RodContactLaw;
use crate::scene::structure::{
    JointEnd, NamedMaterial, RigidBody, RodMaterial, StructureForce, StructureJoint,
    StructureLoads, StructureRod, StructureScene, StructureStart,
};
use crate::scene::{Camera, Scene};

/// Name of rods, materials and bodies in general paths: `rods.*.section.radius`.
pub(crate) const ANY_NAME: &str = "*";

/// A structure with the rod, damping and time of a scene of one rod, a point force, a hinge, and bodies and spring
/// joints with one number and with three.
pub(crate) fn catalog_structure(scene: &Scene) -> StructureScene {
    let name = || ANY_NAME.to_string();
    let rod = StructureRod {
        name: name(),
        segments: 6,
        shape: scene.rod.shape.clone(),
        origin: Some([0.0; 3]),
        section: scene.rod.section.clone(),
        material: RodMaterial::Own(scene.material.clone()),
        taper: scene.rod.taper.clone(),
        natural_curvature: scene.rod.natural_curvature.clone(),
        damping_factor: 1.0,
        mass: vec![PointMass { node: Point::ArcLength(1.0), mass: 1.0 }],
        remeshed: None,
    };
    let material = NamedMaterial {
        name: name(),
        density: 1.0,
        youngs_modulus: 1.0,
        poisson_ratio: Some(0.3),
        shear_modulus: Some(1.0),
        stretch_law: Default::default(),
        mooney_rivlin_ratio: scene.material.mooney_rivlin_ratio,
        bending_law: scene.material.bending_law.clone(),
    };
    let end = JointEnd { rod: None, at: None, body: Some(name()), offset: Some([0.0; 3]) };
    let forms = [PerAxis::One(1.0), PerAxis::Three([1.0; 3])];
    let force = StructureForce {
        rod: Some(name()),
        node: Some(Point::ArcLength(1.0)),
        body: None,
        force: [1.0; 3],
    };
    let hinge = StructureJoint::Hinge { connects: vec![end.clone()], axis: Some([0.0; 3]) };
    let springs = forms.map(|numbers| StructureJoint::Spring {
        connects: vec![end.clone()],
        rotation: numbers,
        rest: numbers,
        damping: 0.0,
    });
    StructureScene {
        dimension: Dimension::default(),
        rods: vec![rod],
        materials: vec![material],
        // Numbers for one axis and for three.
        bodies: forms
            .map(|inertia| RigidBody {
                name: name(),
                mass: 1.0,
                inertia,
                orientation: Some([0.0; 3]),
                position: [0.0; 3],
            })
            .into(),
        joints: springs.into_iter().chain([hinge]).collect(),
        supports: Vec::new(),
        recording: None,
        contacts: scene.contacts.clone(),
        rod_contacts: vec![RodContactLaw {
            rods: Vec::new(),
            stiffness: Some(1.0),
            contact_radius: Some(1.0),
            damping: Some(1.0),
            friction: Some(1.0),
            slip_velocity: Some(1.0),
        }],
        loads: StructureLoads {
            gravity: [0.0; 3],
            damping: scene.loads.damping.clone(),
            point: vec![force],
        },
        initial: StructureStart::default(),
        time: scene.time.clone(),
        camera: Camera::default(),
        path: None,
    }
}
