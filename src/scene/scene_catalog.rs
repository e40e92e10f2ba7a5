//! Scenes for the catalog of parameters, which together contain every built-in number of a scene of one rod.
//!
//! [`catalog_scenes`] returns them: they have all kinds of shapes, sections, loads, actuators and contacts, all forms
//! of values along the rod, and both schemes with a parameter. The module `parameter` visits their numbers for units,
//! limits and search ranges. The scenes are neither validated nor simulated, and their values mean nothing.

use crate::scene::Scene;
use crate::scene::actuation::{ActuatedStrain, Actuation, RoutePoint, Tension};
use crate::scene::along::Along;
use crate::scene::break_points::BreakPoints;
use crate::scene::contact::Contact;
use crate::scene::drag::Drag;
use crate::scene::initial::Initial;
use crate::scene::loads::{Damping, Friction, LineForce, Loads, PointForce};
use crate::scene::mass::PointMass;
use crate::scene::material::{BendingLaw, Material};
use crate::scene::maxwell::Maxwell;
use crate::scene::obstacle_motion::ObstacleMotion;
use crate::scene::point::Point;
use crate::scene::power_law::PowerLaw;
use crate::scene::prescribed_motion::Motion;
use crate::scene::rod::RodSpec;
use crate::scene::scheme::Scheme;
use crate::scene::section::Section;
use crate::scene::sensor_model::SensorModel;
use crate::scene::shape::{Handedness, Shape};
use crate::scene::signal::Signal;
use crate::scene::structure_catalog::ANY_NAME;
use crate::scene::supports::Supports;
use crate::scene::taper::Taper;
use crate::scene::time::Time;

/// Ten scenes that together contain every built-in parameter: all kinds of shapes and sections, all forms of values
/// along the rod, and both schemes with a parameter (Newmark-beta, generalized-alpha). Loads, damping, drag, signals,
/// actuators, contacts, masses and motions are in each of them. They need not be valid.
pub(crate) fn catalog_scenes() -> [Scene; 10] {
    let up = [0.0, 1.0, 0.0];
    let circle = Section::Circle { radius: 1.0 };
    let rectangle = Section::Rectangle { width: 1.0, height: 1.0, up };
    let custom = Section::Custom { area: 1.0, i1: 1.0, i2: 1.0, j: 1.0, up };
    let straight = Shape::Straight { length: 1.0, direction: up };
    let arc = Shape::Arc { length: 1.0, angle: 1.0 };
    let (axis, handedness) = (up, Handedness::Left);
    let helix = Shape::Helix { length: 1.0, radius: 1.0, pitch: 1.0, axis, handedness };
    let polyline = Shape::polyline("");
    let tube = Section::Tube { radius: 1.0, thickness: 1.0 };
    let points = BreakPoints { at: vec![0.0, 1.0], factor: vec![1.0; 2] };
    let points = Along::BreakPoints(points);
    // Every kind of shape and section, and every form of a value along the rod.
    let kinds = [
        (straight.clone(), circle.clone(), 1.0.into()),
        (arc.clone(), rectangle.clone(), vec![1.0].into()),
        (helix, custom.clone(), Along::linear(1.0, 1.0)),
        (polyline, circle.clone(), Along::linear(1.0, 1.0)),
        (straight, tube.clone(), vec![1.0].into()),
        (arc.clone(), tube.clone(), Along::linear(1.0, 1.0)),
        (arc.clone(), circle, points.clone()),
        (arc.clone(), rectangle, points.clone()),
        (arc.clone(), custom, points.clone()),
        (arc, tube, points),
    ];
    kinds.map(|(shape, section, along)| {
        let material = Material {
            poisson_ratio: Some(0.3),
            shear_modulus: Some(1.0),
            mooney_rivlin_ratio: Some(0.2),
            bending_law: Some(match &along {
                Along::BreakPoints(_) => {
                    BendingLaw::Table { curvature: vec![1.0], factor: vec![1.0] }
                }
                _ => BendingLaw::Cubic { coefficient: 1.0 },
            }),
            ..Material::new(1.0, 1.0)
        };
        let mut scene = Scene::new(2, shape.clone(), section, material);
        let whole = matches!(shape, Shape::Straight { .. });
        if !whole {
            let RodSpec { natural_curvature, natural_twist, .. } = &mut scene.rod;
            (*natural_curvature, *natural_twist) = (vec![1.0].into(), vec![0.0].into());
            if matches!(along, Along::Linear(_) | Along::BreakPoints(_)) {
                (*natural_curvature, *natural_twist) = (along.clone(), along.clone());
            }
        }
        // Not valid for every section: these scenes only list quantities.
        scene.rod.taper = Taper::uniform(&along);
        let motion = Motion { ramp: Some(1.0), frequency: Some(1.0), ..Motion::default() };
        scene.supports = Supports { motion: vec![motion], ..Supports::default() };
        let node = Point::ArcLength(1.0);
        scene.rod.mass = vec![PointMass { node, mass: 1.0 }];
        let point = vec![PointForce { node, ..PointForce::default() }];
        let branch = Maxwell { stiffness: 1.0, time: 1.0 };
        let damping = Damping {
            power_law: Some(PowerLaw { stiffness: 1.0, exponent: 1.0, from: 1.0, to: 2.0 }),
            maxwell: if whole { branch.into() } else { vec![branch].into() },
            friction: Some(Friction { stiffness: 1.0, curvature: 1.0 }),
            ..Damping::default()
        };
        let drag = Some(Drag::default());
        let line = vec![LineForce { to: Some(1.0), ..LineForce::default() }];
        scene.loads = Loads { damping, drag, point: point.clone(), line, ..Loads::default() };
        scene.rod.natural_bending = vec![[1.0; 2]];
        scene.signals = vec![catalog_signal()];
        scene.sensors = vec![SensorModel { low_pass: Some(1.0), ..SensorModel::new(ANY_NAME) }];
        scene.actuation = catalog_actuation();
        scene.contacts = catalog_contacts();
        scene.initial = Initial { shape: Some(shape), point, ..Initial::default() };
        let scheme = if whole { Scheme::GeneralisedAlpha } else { Scheme::NewmarkBeta };
        scene.time = Some(Time { scheme, ..Time::new(1.0, 1.0) });
        scene
    })
}

/// Actuators with every number that an actuator may have.
fn catalog_actuation() -> Vec<Actuation> {
    let route = vec![RoutePoint { at: 1.0, offset: [1.0; 2] }];
    vec![
        Actuation::Curvature {
            component: ActuatedStrain::D1,
            from: 1.0,
            to: Some(1.0),
            signal: None,
            gain: 1.0,
        },
        Actuation::Tendon { tension: Tension::Constant(1.0), route },
    ]
}

/// Contacts with every number that a contact may have.
fn catalog_contacts() -> Vec<Contact> {
    let (point, length, own) = ([1.0; 3], 1.0, Some(1.0));
    let motion = ObstacleMotion {
        velocity: point,
        displacement: point,
        ramp: own,
        frequency: own,
        ..ObstacleMotion::default()
    };
    let contacts = [
        Contact::plane(point, point),
        Contact::sphere(point, length),
        Contact::cylinder(point, point, length),
        Contact::capsule([point; 2], length),
    ];
    let whole = |contact: Contact| {
        let contact = contact.stiffness(1.0).contact_radius(1.0).damping(1.0);
        contact.friction(1.0).slip_velocity(1.0).motion(vec![motion.clone()])
    };
    contacts.map(whole).into()
}

/// A signal with every number that a signal may have.
fn catalog_signal() -> Signal {
    let number = Some(1.0);
    Signal {
        amplitude: number,
        frequency: number,
        phase: number,
        start: number,
        duration: number,
        rise: number,
        values: vec![1.0],
        ..Signal::new(ANY_NAME)
    }
}
