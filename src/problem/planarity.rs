//! Vectors of a scene that must lie in the plane of a planar rod, or normal to it, and whether parameters keep them
//! there.
//!
//! [`PlanarVectors`] lists with their keys those in the plane: forces, displacements, velocities of nodes and fluid,
//! actuators, obstacles, a roller, recorded positions, and the initial shape. Moments, rotations and angular velocities
//! are normal to it. `rotations_about_rod` lists the twists, which a planar rod cannot have.
//! [`leaves_plane_to_first_order`] takes a scene in dual numbers, with the derivatives by one parameter. It returns the
//! key of the first quantity that leaves, or `None`. First is a section oblique to the plane with equal second moments
//! whose derivatives differ, then energies, then vectors with rest nodes and `up`, then twists. A vector leaves if the
//! component of its rate in the wrong direction exceeds `TOLERANCE` of the rate. Rates below `ROUNDING` of the fastest
//! are ignored. The planar model and the check of parameters use them.

use crate::numerics::scalar::Scalar;
use crate::numerics::vector::{Vector, dot, sub};
use crate::problem::follower_loads::follower_vector;
use crate::problem::model::{Model, first_director};
use crate::problem::own::find_nonplanar;
use crate::scene::actuation::actuated_directions;
use crate::scene::contact::contact_directions;
use crate::scene::mesh::Mesh;
use crate::scene::plane::KeyedVector;
use crate::scene::prescribed_motion::MotionTime;
use crate::scene::{ActuatedStrain, Actuation, Motion, Plane, Scene, Track};
use num_dual::Dual64;

/// Largest component of a vector out of its plane, or along its normal, relative to its length.
pub(super) const TOLERANCE: f64 = 1e-9;
/// Rate of a vector, relative to its length and to the fastest rate, below which it is a rounding error.
const ROUNDING: f64 = 1e-10;

/// Squared distance of a recorded marker from the first node, relative to the largest one, below which it is at this
/// node.
const AT_NODE: f64 = 1e-12;

/// Vectors of a scene by their direction in a planar model.
pub(super) struct PlanarVectors<D> {
    /// Vectors that must lie in the plane, beside the rest shape: forces, displacements, velocities.
    pub within: Vec<KeyedVector<D>>,
    /// Vectors that must be normal to the plane: moments, rotations, angular velocities.
    pub normal: Vec<KeyedVector<D>>,
}

impl<D: Scalar> PlanarVectors<D> {
    /// The vectors of a scene with their keys, also those of length zero. A recorded displacement has one vector for
    /// each frame; markers of `supports.path` are listed in `f64` only. `nodes` are those at rest, m. Nodes of the
    /// initial shape, `start`, are listed relative to the first of them; none if it is the rest shape.
    pub fn new(scene: &Scene<D>, nodes: &[Vector<D>], start: Option<&[Vector<D>]>) -> Self {
        let keyed = |key: &str, vector: Vector<D>| KeyedVector { key: key.into(), vector };
        let mut within = vec![
            keyed("loads.gravity", scene.loads.gravity),
            keyed("initial.velocity", scene.initial.velocity),
        ];
        let mut normal = vec![keyed("initial.angular_velocity", scene.initial.angular_velocity)];
        if let Some(drag) = &scene.loads.drag {
            within.push(keyed("loads.drag.fluid_velocity", drag.fluid_velocity));
        }
        for (table, points) in [("loads", &scene.loads.point), ("initial", &scene.initial.point)] {
            for (i, load) in points.iter().enumerate() {
                let [force, moment] =
                    [load.force, load.moment].map(|x| in_world(scene, nodes, load.follower, x));
                within.push(keyed(&format!("{table}.point[{i}].force"), force));
                normal.push(keyed(&format!("{table}.point[{i}].moment"), moment));
            }
        }
        for (i, load) in scene.loads.line.iter().enumerate() {
            let force = in_world(scene, nodes, load.follower, load.force);
            within.push(keyed(&format!("loads.line[{i}].force"), force));
        }
        if !scene.actuation.is_empty() {
            let director = first_director(scene, nodes);
            within.extend(actuated_directions(&scene.actuation, nodes, director));
        }
        let [in_plane, across] = contact_directions(&scene.contacts, nodes[0]);
        within.extend(in_plane);
        normal.extend(across);
        // Motions of ends and obstacles, also recorded ones at every frame.
        for (i, motion) in scene.supports.motion.iter().enumerate() {
            let key = format!("supports.motion[{i}]");
            within.push(keyed(&format!("{key}.displacement"), motion.displacement));
            normal.push(keyed(&format!("{key}.rotation"), motion.rotation));
            within.extend(recorded_displacements(&key, motion));
        }
        for (i, contact) in scene.contacts.iter().enumerate() {
            for (k, own) in contact.motions().iter().enumerate() {
                let key = format!("contacts[{i}].motion[{k}]");
                within.push(keyed(&format!("{key}.velocity"), own.velocity));
                within.push(keyed(&format!("{key}.displacement"), own.displacement));
                within.extend(recorded_displacements(&key, &own.support_motion()));
            }
        }
        // A recording has no derivatives.
        if D::PLAIN
            && let Some(track) = scene.supports.path.as_ref().and_then(|p| p.track.as_ref())
        {
            let positions = positions_from_first_node(nodes, track);
            within.extend(positions.map(|x| keyed("supports.path", x)));
        }
        if let Some(roller) = scene.supports.roller {
            within.push(keyed("supports.roller", roller.map(D::from)));
        }
        // An initial shape begins at the first node.
        if let Some(start) = start {
            let key = if scene.supports.path.is_some() { "supports.path" } else { "initial.shape" };
            within.extend(start.iter().map(|x| keyed(key, sub(*x, nodes[0]))));
        }
        Self { within, normal }
    }
}

/// Displacements, m, of the recording of a motion at all its frames, with the key of its file; `key` is that of the
/// motion. Empty without a recording.
fn recorded_displacements<D: Scalar>(key: &str, motion: &Motion<D>) -> Vec<KeyedVector<D>> {
    let times = motion.track.as_ref().map_or(&[][..], |track| track.times());
    let recorded = |t: &f64| motion.recorded_displacement(MotionTime::Time(D::from(*t)));
    let keyed = |vector| KeyedVector { key: format!("{key}.file"), vector };
    times.iter().filter_map(recorded).map(keyed).collect()
}

/// A vector of the world at rest, given in world axes or, if it `follows` the rod, along tangent and directors of the
/// first edge of `nodes`.
fn in_world<D: Scalar>(
    scene: &Scene<D>,
    nodes: &[Vector<D>],
    follows: bool,
    vector: Vector<D>,
) -> Vector<D> {
    match follows {
        true => follower_vector(vector, nodes, first_director(scene, nodes)),
        false => vector,
    }
}

/// Positions of all markers at all frames, m, relative to the first of the `nodes`. Missing ones are left out, and
/// those whose squared distance is at most [`AT_NODE`] of the largest.
fn positions_from_first_node<D: Scalar>(
    nodes: &[Vector<D>],
    track: &Track,
) -> impl Iterator<Item = Vector<D>> {
    let places = track.markers().iter().flat_map(|marker| marker.seen.iter().flatten());
    let origin = nodes[0].map(|x| x.value());
    let vectors = places.map(move |x| sub(*x, origin));
    let largest_square = vectors.clone().map(|v| dot(v, v)).fold(0.0, f64::max);
    vectors.filter(move |v| dot(*v, *v) > AT_NODE * largest_square).map(|v| v.map(D::from))
}

/// Keys and values of all natural twists, rad/m, of the twist of each support motion, rad, and of the gain of each
/// actuator of twist, rad/m. A recorded pose of an end, which rotates it in space, has the value 1. A planar rod has
/// none of them.
pub(super) fn rotations_about_rod<D: Scalar>(scene: &Scene<D>) -> Vec<(String, D)> {
    let twists = scene.rod.natural_twist.values().into_iter();
    let twists = twists.map(|t| ("rod.natural_twist".into(), t));
    let motions = scene.supports.motion.iter().enumerate();
    let motions = motions.map(|(i, motion)| (format!("supports.motion[{i}].twist"), motion.twist));
    let actuators = scene.actuation.iter().enumerate();
    let actuators = actuators.filter_map(|(i, actuator)| match actuator {
        Actuation::Curvature { component: ActuatedStrain::Twist, gain, .. } => {
            Some((format!("actuation[{i}].gain"), *gain))
        }
        _ => None,
    });
    let poses = scene.supports.motion.iter().enumerate().filter(|(_, own)| own.pose.is_some());
    let poses = poses.map(|(i, _)| (format!("supports.motion[{i}].pose"), D::from(1.0)));
    twists.chain(motions).chain(actuators).chain(poses).collect()
}

/// Key of the first quantity that leaves the plane, or its normal, to first order along the derivatives of the scene;
/// none if all stay. Checked are, in this order: a section oblique to the plane with equal second moments whose
/// derivatives differ, user-defined energies, vectors with rest nodes and `up` of the section, and twists. Energies are
/// evaluated at displaced parameter values. A rate leaves if its component out of the plane (or in it, of a normal
/// vector) exceeds [`TOLERANCE`] of it. Rates below [`ROUNDING`] of the fastest one, relative to the length of the
/// vector, are ignored. `model` has the axes of the `plane`; `start` has the nodes of the initial shape, m, if that is
/// not the rest shape.
pub(super) fn leaves_plane_to_first_order(
    model: &impl Model,
    plane: &Plane,
    scene: &Scene<Dual64>,
    mesh: &Mesh<Dual64>,
    start: Option<&[Vector<Dual64>]>,
) -> Option<String> {
    let size = |v: &[f64]| v.iter().map(|c| c * c).sum::<f64>().sqrt();
    let rate = |v: Vector<Dual64>| model.components(v).map(|c| c.eps);
    let PlanarVectors { mut within, mut normal } = PlanarVectors::new(scene, &mesh.nodes, start);
    let shape = |x: &Vector<Dual64>| KeyedVector { key: "rod.shape".into(), vector: *x };
    within.extend(mesh.nodes.iter().map(shape));
    if let Some(up) = scene.rod.section.up_across(&mesh.nodes) {
        let moments = scene.second_moments_along();
        let [x, y, z] = model.components(up.map(|c| c.re));
        let (in_plane, out) = (x.hypot(y), z.abs());
        if moments.iter().any(|[i1, i2]| i1.re != i2.re) {
            let up = KeyedVector { key: "rod.section.up".into(), vector: up };
            if in_plane > out { &mut within } else { &mut normal }.push(up);
        } else if moments.iter().any(|[i1, i2]| i1.eps != i2.eps) && in_plane.min(out) > TOLERANCE {
            // A square has no principal axes until its second moments differ.
            return Some("rod.section".into());
        }
    }
    // Rate relative to the length; a vector of length zero has no rounding errors.
    let relative = |v: &KeyedVector<Dual64>| match size(&v.vector.map(|c| c.re)) {
        0.0 => None,
        length => Some(size(&rate(v.vector)) / length),
    };
    // Vectors that change far more slowly than the fastest one have rounding errors only.
    let fastest = within.iter().chain(&normal).filter_map(relative).fold(0.0, f64::max);
    let changes = |v: &KeyedVector<Dual64>| relative(v).is_none_or(|r| r > ROUNDING * fastest);
    let leaves = |v: &KeyedVector<Dual64>| {
        let rate = rate(v.vector);
        rate[2].abs() > TOLERANCE * size(&rate) && changes(v)
    };
    let tilts = |v: &KeyedVector<Dual64>| {
        let rate = rate(v.vector);
        size(&rate[..2]) > TOLERANCE * size(&rate) && changes(v)
    };
    // User-defined energies are evaluated at displaced values.
    let displaced = |v: &Dual64| v.re + v.eps * (1.0 + v.re.abs());
    let energy = find_nonplanar(&scene.energies, displaced, plane.x.cross(&plane.y), plane.origin);
    let rotation = || rotations_about_rod(scene).into_iter().find(|(_, turn)| turn.eps != 0.0);
    let vector = || within.into_iter().find(leaves).or(normal.into_iter().find(tilts));
    energy.or_else(|| vector().map(|v| v.key)).or_else(|| rotation().map(|(key, _)| key))
}
