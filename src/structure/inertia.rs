//! Masses, centers and moments of inertia of the bodies of a planar structure, with those of the nodes that they
//! carry.
//!
//! A body has its own mass, and that of nodes of each rod end on it: the outer node of a hinged end, or both nodes of
//! the outer edge of a clamped end, of which the one behind the joint has point masses only. The mass of a sprung clamp
//! counts at the joint, with its moment of inertia about it: an error of second order in the length of an edge, with
//! which all masses are constant and diagonal. Center, m, and moment of inertia, kg m^2, are those of the sum; weight
//! and point forces act at the body's own center.
//!
//! [`BodiesAtRest`] has the bodies, the springs, the centers of mass, and the coordinates at rest, m: two of the
//! center, and the angle times the radius of gyration, which is zero at rest. A rotating joint without a moment of
//! inertia is an error. So is a spring compliance below `LEAST_COMPLIANCE` over the bending stiffness of the rod's
//! outermost joint.

use crate::error::{Error, ensure};
use crate::numerics::scalar::{RodScalar, Scalar};
use crate::numerics::vector::rotate;
use crate::rod::PlanarRod;
use crate::rod::assembly::bodies::{Bodies, Body, JointSpring, Rotation};
use crate::rod::layout::Plane as PlanarLayout;
use crate::scene::Plane;
use crate::scene::per_axis::PerAxis;
use crate::scene::structure::{RigidBody, StructureJoint, StructureScene};
use crate::structure::placement::{PlacedRod, end_nodes};
use crate::structure::plan::{EndSupport, StructurePlan};

/// The bodies of a structure at rest.
pub(super) struct BodiesAtRest<D> {
    pub bodies: Bodies<D>,
    /// Centers of mass, m.
    pub centers: Vec<[D; 2]>,
    /// The coordinates of all bodies and springs, m; rotations, zero at rest, are angles times a length.
    pub z: Vec<D>,
}

/// A mass at a place in the plane, with its own moment of inertia.
#[derive(Clone, Copy)]
struct CarriedMass<D> {
    mass: D,
    place: [D; 2],
    inertia: D,
}

/// Components of a vector of the world along the x and y axes of a plane: its scalar products with both.
fn in_plane<D: Scalar>(plane: &Plane, vector: [D; 3]) -> [D; 2] {
    [plane.x, plane.y].map(|axis| vector[0] * axis.x + vector[1] * axis.y + vector[2] * axis.z)
}

/// `a.a`, the square of the length of a planar vector.
fn square<D: Scalar>(a: [D; 2]) -> D {
    a[0] * a[0] + a[1] * a[1]
}

/// Moment of inertia of a body about the normal of a plane through its center of mass, kg m^2. A single number is it;
/// of three principal moments it is `n'I n` with the normal n in the axes of the body (`orientation`, a rotation
/// vector).
fn inertia_about_normal<D: Scalar>(body: &RigidBody<D>, plane: &Plane) -> D {
    match body.inertia {
        PerAxis::One(inertia) => inertia,
        PerAxis::Three(principal) => {
            let normal = <[f64; 3]>::from(plane.x.cross(&plane.y)).map(D::from);
            // Principal moments are in the axes of the body: the normal is rotated back into them.
            let back = body.orientation.map_or([D::from(0.0); 3], |turn| turn.map(|c| -c));
            let [x, y, z] = rotate(back, normal);
            principal[0] * x * x + principal[1] * y * y + principal[2] * z * z
        }
    }
}

impl<D: RodScalar> BodiesAtRest<D> {
    /// The bodies of a plan with their carried masses of these `rods`, their loads, and the springs of the plan. A body
    /// has mass, center, m, and the moment of inertia about its center, kg m^2; one that does not rotate (a hinged
    /// joint) has no moment of inertia. A body of the scene has its weight and the forces of `loads.point` on it, N,
    /// which act at its own center of mass. `z` has the centers at rest, m, and zero rotations.
    ///
    /// # Errors
    /// [`Error::Invalid`] for a rigid joint without a moment of inertia, and a spring that is too stiff for the rod
    /// beside it ([`LEAST_COMPLIANCE`]).
    pub fn new(
        plan: &StructurePlan,
        plane: &Plane,
        scene: &StructureScene<D>,
        rods: &[PlacedRod<D, PlanarLayout>],
    ) -> Result<Self, Error> {
        let zero = D::from(0.0);
        let mut z = vec![zero; plan.coordinates];
        let (mut bodies, mut centers) = (Vec::new(), Vec::new());
        let mut springs: Vec<Option<JointSpring<D>>> = vec![None; plan.springs.len()];
        for (b, body) in plan.bodies.iter().enumerate() {
            let mut masses = Vec::new();
            if let Some(own) = body.own.map(|i| &scene.bodies[i]) {
                let place = in_plane(plane, own.position);
                let inertia = inertia_about_normal(own, plane);
                masses.push(CarriedMass { mass: own.mass, place, inertia });
            }
            for (rod, ends) in rods.iter().zip(&plan.ends) {
                for (end, hold) in ends.iter().enumerate() {
                    let EndSupport::Body { body, spring, pinned } = *hold else { continue };
                    if body != b {
                        continue;
                    }
                    let ends = end_nodes(rod.nodes(), end);
                    // A pinned end carries its outer node, a clamp both nodes of the outer edge.
                    let carried = if pinned { &ends[..1] } else { &ends[..] };
                    let Some(spring) = spring else {
                        masses.extend(carried.iter().map(|&node| {
                            let (mass, place) = (rod.mass(node), rod.node(node));
                            CarriedMass { mass, place, inertia: zero }
                        }));
                        continue;
                    };
                    let mass = carried.iter().fold(zero, |sum, node| sum + rod.mass(*node));
                    let place = rod.node(ends[1]);
                    // A sprung clamp rotates on its own: its mass counts at the joint, and its
                    // inertia with the spring.
                    let wall = rod.wall(end);
                    masses.push(CarriedMass { mass, place: wall, inertia: zero });
                    check_compliance(plan, scene, spring, &rod.rod, end)?;
                    let reach = square([place[0] - wall[0], place[1] - wall[1]]);
                    springs[spring] =
                        Some(joint_spring(plan, scene, spring, mass * reach, reach.value().sqrt()));
                }
            }
            let mass = masses.iter().fold(zero, |sum, own| sum + own.mass);
            let center = [0, 1]
                .map(|c| masses.iter().fold(zero, |sum, own| sum + own.mass * own.place[c]) / mass);
            let inertia = masses.iter().fold(zero, |sum, own| {
                let arm = [own.place[0] - center[0], own.place[1] - center[1]];
                sum + own.inertia + own.mass * square(arm)
            });
            let rotation = match body.rotates {
                false => None,
                true => {
                    // The radius of gyration, so that the mass of the coordinate is that of the body.
                    let length = (inertia.value() / mass.value()).sqrt();
                    if !(length.is_normal() && length > 0.0) {
                        return Err(without_inertia(plan, b));
                    }
                    Some(Rotation { coordinate: body.coordinate + 2, length, inertia })
                }
            };
            z[body.coordinate..][..2].copy_from_slice(&center);
            let (mut load, mut load_arm) = ([zero; 2], [zero; 2]);
            if let Some(own) = body.own.map(|i| &scene.bodies[i]) {
                let place = in_plane(plane, own.position);
                // Weight and forces act at the body's own center, not at that with the carried
                // nodes.
                load_arm = [place[0] - center[0], place[1] - center[1]];
                load = in_plane(plane, scene.loads.gravity).map(|g| own.mass * g);
                let forces = scene.loads.point.iter();
                for force in forces.filter(|force| force.body.as_ref() == Some(&own.name)) {
                    let force = in_plane(plane, force.force);
                    load = [load[0] + force[0], load[1] + force[1]];
                }
            }
            bodies.push(Body { coordinate: body.coordinate, rotation, mass, load, load_arm });
            centers.push(center);
        }
        let springs = springs.into_iter().flatten().collect();
        Ok(Self { bodies: Bodies { bodies, springs }, centers, z })
    }
}

/// The spring number `spring` of a plan, for a clamp with the moment of inertia `inertia`, kg m^2, about the joint. The
/// coordinate of its rotation is the angle times `length`, m. The stiffness, N m/rad, is the reciprocal of the
/// compliance of the joint (the first of three); rest angle and damping are those of the joint. For other kinds of
/// joints they are 1, 0 and 0.
fn joint_spring<D: RodScalar>(
    plan: &StructurePlan,
    scene: &StructureScene<D>,
    spring: usize,
    inertia: D,
    length: f64,
) -> JointSpring<D> {
    let own = &plan.springs[spring];
    let (compliance, rest_angle, damping) = match &scene.joints[own.joint] {
        StructureJoint::Spring { rotation, rest, damping, .. } => {
            (rotation.all()[0], rest.all()[0], *damping)
        }
        _ => (D::from(1.0), D::from(0.0), D::from(0.0)),
    };
    JointSpring {
        body: own.body,
        rotation: Rotation { coordinate: own.coordinate, length, inertia },
        stiffness: compliance.recip(),
        rest_angle,
        damping,
    }
}

/// Rejects a spring so much stiffer than the joint of the rod beside it that the tangent loses the stiffness of the
/// rod. Its compliance (the first of three), rad/(N m), must be at least [`LEAST_COMPLIANCE`] over the bending
/// stiffness, N m, of the outermost joint at this `end` (0 start, 1 end). `Ok` for joints that are no springs.
fn check_compliance<D: RodScalar>(
    plan: &StructurePlan,
    scene: &StructureScene<D>,
    spring: usize,
    rod: &PlanarRod<D>,
    end: usize,
) -> Result<(), Error> {
    let number = plan.springs[spring].joint;
    let StructureJoint::Spring { rotation, .. } = &scene.joints[number] else { return Ok(()) };
    let beside = if end == 0 { rod.joint.first() } else { rod.joint.last() };
    let least = beside.map_or(0.0, |joint| LEAST_COMPLIANCE / joint.stiffness.value());
    let allowed = format!("{least:.1e} rad/(N m) or above; kind = \"rigid\" for none");
    let key = format!("joints[{number}].rotation");
    let rotation = rotation.all()[0].value();
    ensure(rotation >= least, key, rotation, allowed)
}

/// Least compliance of a spring over that of an edge of the rod beside it. Below, rounding errors of the spring's
/// moment exceed 1e-5 of that of the edge.
pub(super) const LEAST_COMPLIANCE: f64 = 1e-11;

/// The error, with the key `joints[i]`, that a rotating joint has no moment of inertia, since its rods lie on each
/// other. `i` is the joint of the `body` of the plan, 0 if it has none.
pub(super) fn without_inertia(plan: &StructurePlan, body: usize) -> Error {
    let joint = plan.bodies[body].joint.unwrap_or_default();
    let found = "a joint without a moment of inertia";
    Error::invalid(
        format!("joints[{joint}]"),
        found,
        "rods that leave the joint in different directions",
    )
}
