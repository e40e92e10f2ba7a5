//! Masses, centers and moments of inertia of the bodies of a structure in space, with those of the nodes and edges
//! that they carry.
//!
//! A body has its own mass, and that of nodes of the rod ends on it. For a clamped end it is the mass of the inner
//! node, which is without the part behind the joint, and the point masses on the outer node. Half of the rotational
//! inertia of the outer edge about itself is added. For a pinned end (of a ball joint) it is the mass of the outer
//! node. The mass of a sprung clamp counts at the joint; the clamp has a rotation of its own, with its moments of
//! inertia about the joint. The axes of a body are the principal ones of the sum. An elastic joint is a rotational
//! spring, or a hinge: a stiff spring ([`HINGE_STIFFNESS`] times the largest stiffness of the rod's joint beside it)
//! across its axis.
//!
//! [`SpatialBodiesAtRest`] has bodies with loads, springs, centers, m, coordinates at rest, m (zero for rotations), and
//! the references of the rotations. Axes of clamps and of rotations at rest are matrices with the axes in the columns.
//!
//! Errors: a body without three moments of inertia, a rotating joint without inertia, a hinge without axis, a spring
//! with one rest angle other than zero (three numbers are required), or one that is too stiff for its rod
//! ([`LEAST_COMPLIANCE`]).

use crate::error::{Error, ensure};
use crate::numerics::rotation::{
    Matrix3, column, components_of, exponential, identity, product, times, transpose,
    transposed_times,
};
use crate::numerics::scalar::{RodScalar, Scalar};
use crate::numerics::vector::{Vector, add, cross, dot, scale, sub, unit};
use crate::rod::assembly::joint_law::{ElasticJoint, JointStiffness};
use crate::rod::assembly::{
    RotationReference, SpatialBodies, SpatialBody, SpatialRotation, SpatialSpring,
};
use crate::rod::layout::Space;
use crate::scene::per_axis::PerAxis;
use crate::scene::structure::{RigidBody, StructureJoint, StructureScene};
use crate::structure::inertia::{LEAST_COMPLIANCE, without_inertia};
use crate::structure::placement::{PlacedRod, end_nodes};
use crate::structure::plan::{EndSupport, StructurePlan};

/// Part of the outer edge of a clamped end that belongs to the rod: the joint is in its middle.
const BEFORE_JOINT: f64 = 0.5;
/// Stiffness of a hinge across its axis, over that of bending of the edge beside it.
const HINGE_STIFFNESS: f64 = 1e6;

/// The bodies of a structure in space at rest.
pub(super) struct SpatialBodiesAtRest<D> {
    pub bodies: SpatialBodies<D>,
    /// Centers of mass, m.
    pub centers: Vec<Vector<D>>,
    /// The coordinates of all bodies and springs, m; those of rotations, zero at rest, are angles times a length.
    pub z: Vec<D>,
    /// References of all rotations.
    pub references: Vec<RotationReference<D>>,
}

/// A mass at a place with its own inertia tensor in world axes.
#[derive(Clone, Copy)]
struct PlacedInertia<D> {
    mass: D,
    place: Vector<D>,
    tensor: Matrix3<D>,
}

/// The outer product `v v'`: entry (i, j) is `v[i] v[j]`.
fn outer<D: Scalar>(v: Vector<D>) -> Matrix3<D> {
    components_of(|i, j| v[i] * v[j])
}

/// The inertia tensor of a body about its center of mass, in world axes, kg m^2: `R diag(I) R'` with the rotation R by
/// `orientation`. An error unless the body has three principal moments.
fn body_tensor<D: Scalar>(body: &RigidBody<D>) -> Result<Matrix3<D>, Error> {
    let PerAxis::Three(principal) = body.inertia else {
        let key = format!("bodies.{}.inertia", body.name);
        let allowed = "the three principal moments of inertia, kg m^2, of a body in space";
        return Err(Error::invalid(key, "one number", allowed));
    };
    let axes = body.orientation.map_or_else(identity, exponential);
    let zero = D::from(0.0);
    let diagonal = components_of(|i, j| if i == j { principal[i] } else { zero });
    Ok(product(&axes, &product(&diagonal, &transpose(&axes))))
}

/// The inertia tensor of all masses about `center`, kg m^2: the sum of their own tensors and of `m (a.a 1 - a a')` with
/// the arms a from the center.
fn tensor_about<D: Scalar>(masses: &[PlacedInertia<D>], center: Vector<D>) -> Matrix3<D> {
    let mut sum = [[D::from(0.0); 3]; 3];
    for own in masses {
        let arm = sub(own.place, center);
        let (square, across) = (dot(arm, arm), outer(arm));
        for i in 0..3 {
            for j in 0..3 {
                let mut entry = -across[i][j];
                if i == j {
                    entry += square;
                }
                sum[i][j] += own.tensor[i][j] + own.mass * entry;
            }
        }
    }
    sum
}

/// The principal axes of a symmetric tensor, in the columns and not sorted, in plain numbers. The method is Jacobi's,
/// with [`SWEEPS`] sweeps over the products of inertia. Products up to [`NO_PRODUCT`] of the trace cause no rotation,
/// so that axes of equal moments are those of the world where possible.
fn principal_axes<D: Scalar>(tensor: &Matrix3<D>) -> Matrix3<f64> {
    let mut own = tensor.map(|row| row.map(|x| x.value()));
    let trace = own[0][0] + own[1][1] + own[2][2];
    let mut axes = identity::<f64>();
    for _ in 0..SWEEPS {
        for (i, j) in [(0, 1), (0, 2), (1, 2)] {
            if own[i][j].abs() <= NO_PRODUCT * trace {
                continue;
            }
            // The rotation that makes this product of inertia zero.
            let angle = 0.5 * (2.0 * own[i][j]).atan2(own[i][i] - own[j][j]);
            let (sine, cosine) = angle.sin_cos();
            let mut turn = identity::<f64>();
            (turn[i][i], turn[j][j], turn[i][j], turn[j][i]) = (cosine, cosine, -sine, sine);
            own = product(&transpose(&turn), &product(&own, &turn));
            axes = product(&axes, &turn);
        }
    }
    axes
}

/// Number of sweeps over the products of inertia: convergence is quadratic.
const SWEEPS: usize = 12;
/// Products of inertia below this part of the trace are zero.
const NO_PRODUCT: f64 = 1e-14;

/// Axes of the clamp at an end of a rod at rest, in the columns: first director, second director (tangent x first) and
/// tangent of the outer edge.
pub(super) fn clamp_axes<D: RodScalar>(rod: &PlacedRod<D, Space>, end: usize) -> Matrix3<D> {
    let frame = &rod.frames.edges[end_edge(rod, end)];
    let (tangent, director) = (frame.tangent, frame.director);
    transpose(&[director, cross(tangent, director), tangent])
}

/// Index of the outermost edge of an end, 0 (start) or 1.
pub(super) fn end_edge<D: RodScalar>(rod: &PlacedRod<D, Space>, end: usize) -> usize {
    if end == 0 { 0 } else { rod.nodes() - 2 }
}

impl<D: RodScalar> SpatialBodiesAtRest<D> {
    /// The bodies of a plan with their carried masses of these `rods`, their loads, and the elastic joints. A body has
    /// mass, kg, center, m, and principal moments of inertia about its center, kg m^2; a joint that does not rotate has
    /// no moments. A body of the scene has its weight and the forces of `loads.point` on it, N, which act at its own
    /// center of mass. `z` has the centers at rest, m; coordinates of rotations are zero.
    ///
    /// # Errors
    /// [`Error::Invalid`] for a body without three moments of inertia, a rotating joint without inertia, or a hinge
    /// without axis. Also for a spring with one rest angle other than zero, or one that is too stiff for its rod
    /// ([`LEAST_COMPLIANCE`]).
    pub fn new(
        plan: &StructurePlan,
        scene: &StructureScene<D>,
        rods: &[PlacedRod<D, Space>],
    ) -> Result<Self, Error> {
        let zero = D::from(0.0);
        let mut built = Self {
            bodies: SpatialBodies { bodies: Vec::new(), springs: Vec::new(), by_increments: false },
            centers: Vec::new(),
            z: vec![zero; plan.coordinates],
            references: Vec::new(),
        };
        for (b, body) in plan.bodies.iter().enumerate() {
            let masses = carried_masses(plan, scene, rods, b)?;
            let mass = masses.iter().fold(zero, |sum, own| sum + own.mass);
            let center = [0, 1, 2]
                .map(|c| masses.iter().fold(zero, |sum, own| sum + own.mass * own.place[c]) / mass);
            let (mut axes, mut rotation) = (identity(), None);
            if body.rotates {
                let tensor = tensor_about(&masses, center);
                // Axes without derivatives: products of inertia are then zero in value, and have
                // the derivatives.
                axes = principal_axes(&tensor).map(|row| row.map(D::from));
                let tensor = product(&transpose(&axes), &product(&tensor, &axes));
                let own = built.add_rotation(body.coordinate + 4, axes, tensor, mass);
                rotation = Some(own.ok_or_else(|| without_inertia(plan, b))?);
            }
            built.z[body.coordinate..][..3].copy_from_slice(&center);
            let (mut load, mut load_arm) = ([zero; 3], [zero; 3]);
            if let Some(own) = body.own.map(|i| &scene.bodies[i]) {
                load_arm = transposed_times(&axes, sub(own.position, center));
                load = scale(scene.loads.gravity, own.mass);
                let forces = scene.loads.point.iter();
                for force in forces.filter(|force| force.body.as_ref() == Some(&own.name)) {
                    load = add(load, force.force);
                }
            }
            let coordinate = body.coordinate;
            built.bodies.bodies.push(SpatialBody { coordinate, rotation, mass, load, load_arm });
            built.centers.push(center);
        }
        let mut springs = vec![None; plan.springs.len()];
        for (rod, ends) in rods.iter().zip(&plan.ends) {
            for (end, hold) in ends.iter().enumerate() {
                if let EndSupport::Body { spring: Some(spring), .. } = *hold {
                    springs[spring] = Some(built.spring(plan, scene, spring, rod, end)?);
                }
            }
        }
        built.bodies.springs = springs.into_iter().flatten().collect();
        Ok(built)
    }

    /// Adds the reference of a rotation with the axes `axes`, at rest, and returns the rotation. `coordinate` is its
    /// first coordinate, `tensor` its inertia, kg m^2, in these axes. The scale of its coordinates, m, is
    /// `sqrt(trace/(2 mass))`, about the radius of gyration. Products of inertia keep their derivatives only. None, and
    /// nothing added, if a moment is at most 1e-12 of the trace or the scale is not a normal number.
    fn add_rotation(
        &mut self,
        coordinate: usize,
        axes: Matrix3<D>,
        tensor: Matrix3<D>,
        mass: D,
    ) -> Option<SpatialRotation<D>> {
        let inertia = [0, 1, 2].map(|c| tensor[c][c]);
        let trace: f64 = inertia.iter().map(Scalar::value).sum();
        // The radius of gyration, so that masses of coordinates are about that of the body.
        let length = (0.5 * trace / mass.value()).sqrt();
        let is_positive = inertia.iter().all(|moment| moment.value() > 1e-12 * trace);
        if !(length.is_normal() && is_positive) {
            return None;
        }
        let products = components_of(|i, j| match i == j {
            true => D::from(0.0),
            // In principal axes the value is a rounding error; derivatives are not.
            false => tensor[i][j] - tensor[i][j].value(),
        });
        let reference = self.references.len();
        self.references.push(RotationReference { axes, coordinates: [D::from(0.0); 3] });
        Some(SpatialRotation { coordinate, reference, length, inertia, products })
    }

    /// The elastic joint number `spring` of a plan at an end of a rod (0 start, 1 end), with a rotation of its own for
    /// the sprung clamp. Stiffnesses of a spring are the reciprocals of its compliances, N m/rad, in the axes of the
    /// clamp. A hinge is free about its axis, and resists across it with [`HINGE_STIFFNESS`] times the largest
    /// stiffness of the joint of the rod beside it. The rest rotation of a spring is that of the rest shapes, followed
    /// by the rotation vector `rest`. Errors: one rest angle other than zero, a compliance below [`LEAST_COMPLIANCE`]
    /// over that stiffness, a hinge without axis, no inertia.
    fn spring(
        &mut self,
        plan: &StructurePlan,
        scene: &StructureScene<D>,
        spring: usize,
        rod: &PlacedRod<D, Space>,
        end: usize,
    ) -> Result<SpatialSpring<D>, Error> {
        let (own, zero) = (&plan.springs[spring], D::from(0.0));
        let axes = clamp_axes(rod, end);
        let [outer, inner] = end_nodes(rod.nodes(), end);
        let arm = sub(rod.node(inner), rod.wall(end));
        let mass = rod.mass(outer) + rod.mass(inner);
        // The clamp is a point mass at an arm from the joint, with the inertia of half an edge
        // about itself.
        let across = mass * dot(arm, arm);
        let inertia = [across, across, edge_inertia(rod, end)];
        let tensor = components_of(|i, j| if i == j { inertia[i] } else { zero });
        let rotation = self.add_rotation(own.coordinate, axes, tensor, mass);
        let rotation = rotation.ok_or_else(|| without_inertia(plan, own.body))?;
        let body = &self.bodies.bodies[own.body];
        let body_axes =
            body.rotation.map_or_else(identity, |turn| self.references[turn.reference].axes);
        let mut rest = product(&transpose(&body_axes), &axes);
        let mut damping = zero;
        let joints = &rod.rod.joint;
        let beside = if end == 0 { joints.first() } else { joints.last() };
        let stiffest = beside.map_or(0.0, |joint| {
            let [a, _, b] = joint.stiffness.bend;
            a.value().max(b.value()).max(joint.stiffness.twist.value())
        });
        let key = |name: &str| format!("joints[{}].{name}", own.joint);
        let stiffness = match &scene.joints[own.joint] {
            StructureJoint::Spring { rotation, rest: turn, damping: time, .. } => {
                damping = *time;
                match turn {
                    PerAxis::Three(turn) => rest = product(&rest, &exponential(*turn)),
                    PerAxis::One(angle) => {
                        let allowed = "a list of three numbers in space, a rotation vector, rad";
                        ensure(angle.value() == 0.0, key("rest"), angle.value(), allowed)?;
                    }
                }
                let least = LEAST_COMPLIANCE / stiffest;
                let compliance = rotation.all();
                for c in compliance {
                    let allowed =
                        format!("{least:.1e} rad/(N m) or above; kind = \"rigid\" for none");
                    ensure(c.value() >= least, key("rotation"), c.value(), allowed)?;
                }
                JointStiffness::Spring(compliance.map(Scalar::recip))
            }
            StructureJoint::Hinge { axis: Some(axis), .. }
                if axis.iter().any(|c| c.value() != 0.0) =>
            {
                // Stiff against the rod, but not so stiff that the sum loses the digits of the rod.
                let across = D::from(HINGE_STIFFNESS * stiffest);
                JointStiffness::Hinge(unit(transposed_times(&axes, *axis)), across)
            }
            _ => {
                let allowed = "a direction, for a hinge in space";
                return Err(Error::invalid(key("axis"), "no direction", allowed));
            }
        };
        let law = ElasticJoint { rest, natural: [zero; 3], stiffness };
        Ok(SpatialSpring { body: own.body, rotation, law, damping })
    }
}

/// The rotational inertia about itself of the half ([`BEFORE_JOINT`]) of the outer edge of an end that belongs to the
/// rod, kg m^2.
fn edge_inertia<D: RodScalar>(rod: &PlacedRod<D, Space>, end: usize) -> D {
    rod.rod.mass[4 * end_edge(rod, end) + 3] * BEFORE_JOINT
}

/// The masses of body `b` of a plan: its own with its inertia tensor, then those of each rod end on it. A clamped end
/// has both nodes of its outer edge at their places, with the inertia of half that edge about its tangent. A pinned end
/// (of a ball joint) has the outer node, a sprung clamp (of a spring or a hinge) both nodes at the joint. Errors are
/// those of [`body_tensor`].
fn carried_masses<D: RodScalar>(
    plan: &StructurePlan,
    scene: &StructureScene<D>,
    rods: &[PlacedRod<D, Space>],
    b: usize,
) -> Result<Vec<PlacedInertia<D>>, Error> {
    let none = [[D::from(0.0); 3]; 3];
    let mut masses = Vec::new();
    if let Some(own) = plan.bodies[b].own.map(|i| &scene.bodies[i]) {
        let tensor = body_tensor(own)?;
        masses.push(PlacedInertia { mass: own.mass, place: own.position, tensor });
    }
    for (rod, ends) in rods.iter().zip(&plan.ends) {
        for (end, hold) in ends.iter().enumerate() {
            let EndSupport::Body { body, spring, pinned } = *hold else { continue };
            if body != b {
                continue;
            }
            let [outer_node, inner] = end_nodes(rod.nodes(), end);
            let outer_mass = rod.mass(outer_node);
            if spring.is_some() {
                let mass = outer_mass + rod.mass(inner);
                masses.push(PlacedInertia { mass, place: rod.wall(end), tensor: none });
                continue;
            }
            let place = rod.node(outer_node);
            masses.push(PlacedInertia { mass: outer_mass, place, tensor: none });
            if !pinned {
                let tangent = column(&clamp_axes(rod, end), 2);
                let spin = edge_inertia(rod, end);
                let tensor = outer(tangent).map(|row| row.map(|entry| entry * spin));
                masses.push(PlacedInertia {
                    mass: rod.mass(inner),
                    place: rod.node(inner),
                    tensor,
                });
            }
        }
    }
    Ok(masses)
}

/// The axes of a rotation at rest, in the columns, from its entry in `references`; the identity (world axes) without a
/// rotation.
pub(super) fn rest_axes<D: Scalar>(
    rotation: Option<&SpatialRotation<D>>,
    references: &[RotationReference<D>],
) -> Matrix3<D> {
    rotation.map_or_else(identity, |rotation| references[rotation.reference].axes)
}

/// Components `A' v` of a vector v of the world along the axes A, which are orthonormal vectors in the columns.
pub(super) fn in_axes<D: Scalar>(axes: &Matrix3<D>, vector: Vector<D>) -> Vector<D> {
    times(&transpose(axes), vector)
}
