//! Positions of nodes that bodies carry in space, with derivatives, and the rotations of bodies.
//!
//! A body has the coordinates `x, y, z`, m, of its center of mass, and three of its rotation
//! `R = R0 exp((z - z0)/length)`, m, with a constant `length`. First and second derivatives are those by increments
//! `phi` of the rotation in the axes of the body, `R exp(phi)`, at the present rotation `R`:
//!
//! ```text
//! X = x + R exp(phi) a,    dX = R (phi x a),    d2X = R (phi x (phi x a)).
//! ```
//!
//! A second arm turns likewise with the rotation of a sprung clamp. All derivatives are divided by `length` once for
//! each `phi`, as coordinates are lengths. The angle of a carried edge, from the frame that the body carries, turns by
//! `phi.t` with the tangent `t` in the axes of the body. Its second derivatives are zero: the rotation about `t` in
//! `exp(phi)`, beside the shortest rotation of `t`, differs from `phi.t` in the third order.
//!
//! [`SpatialRotation`]: `of` takes its three entries from a list, `vector` is the rotation vector from the reference,
//! rad. `axes` are the turned axes at given coordinates, `rest_axes` those at the reference; `tensor` is the inertia
//! tensor in the axes of the body. [`SpatialCarried`] is the position of a node with its derivatives: `at` is the
//! center of a body, and `add_arm` adds an arm that turns with a rotation. `arm_curvature` are second derivatives of
//! `force.(R exp(phi) arm)` by `phi`.

use crate::numerics::rotation::{Matrix3, column, exponential, product, times};
use crate::numerics::scalar::Scalar;
use crate::numerics::vector::{Vector, cross, dot};
use crate::rod::assembly::carrying::CarriedMotion;
use crate::rod::assembly::frames::AssemblyFrames;

/// Largest number of coordinates on which the position of a carried node depends.
const MOST: usize = 9;

/// A rotation in space.
#[derive(Clone, Copy, Debug)]
pub struct SpatialRotation<D> {
    /// Index of the first of its three coordinates, counted from the first coordinate of all bodies.
    pub coordinate: usize,
    /// Index of its reference in [`AssemblyFrames::rotations`].
    pub reference: usize,
    /// Coordinate over angle, m/rad: a constant scale.
    pub length: f64,
    /// Moments of inertia about its axes, kg m^2.
    pub inertia: Vector<D>,
    /// Products of inertia, kg m^2: zero with derivatives by the numbers of the scene, as the axes are principal ones.
    pub products: Matrix3<D>,
}

impl<D: Scalar> SpatialRotation<D> {
    /// The three entries of the rotation in a list of all body coordinates, or of their rates or changes.
    pub(super) fn of(&self, all: &[D]) -> Vector<D> {
        [all[self.coordinate], all[self.coordinate + 1], all[self.coordinate + 2]]
    }

    /// The axes of the rotation in the columns, in world components, at its reference in `frames`.
    pub fn rest_axes(&self, frames: &AssemblyFrames<D>) -> Matrix3<D> {
        frames.rotations[self.reference].axes
    }

    /// Rotation vector from the reference to the coordinates `z` of all bodies, rad: `(z - z0)/length`.
    pub(super) fn vector(&self, z: &[D], frames: &AssemblyFrames<D>) -> Vector<D> {
        let (own, from) = (self.of(z), frames.rotations[self.reference].coordinates);
        [0, 1, 2].map(|c| (own[c] - from[c]) * self.length.recip())
    }

    /// The axes of the rotation in the columns, in world components, at the coordinates `z` of all bodies:
    /// `R0 exp((z - z0)/length)`, with the axes `R0` of the reference at its coordinates `z0`.
    pub(super) fn axes(&self, z: &[D], frames: &AssemblyFrames<D>) -> Matrix3<D> {
        let turn = exponential(self.vector(z, frames));
        product(&frames.rotations[self.reference].axes, &turn)
    }

    /// Inertia tensor in the axes of the body, kg m^2: `products` plus the moments of `inertia` on the diagonal.
    pub(super) fn tensor(&self) -> Matrix3<D> {
        let mut tensor = self.products;
        (0..3).for_each(|c| tensor[c][c] += self.inertia[c]);
        tensor
    }
}

/// An arm that turns with a rotation.
#[derive(Clone, Copy, Debug)]
struct TurningArm<D> {
    /// First coordinate of the rotation.
    coordinate: usize,
    /// Coordinate over angle, m/rad.
    length: f64,
    /// The axes of the rotation, in the columns.
    axes: Matrix3<D>,
    /// The arm in these axes, m.
    arm: Vector<D>,
}

/// The unknowns of a carried node with their derivatives.
#[derive(Clone, Copy, Debug)]
pub struct SpatialCarried<D> {
    values: [D; 4],
    coordinates: [usize; MOST],
    count: usize,
    slopes: [[D; 4]; MOST],
    arms: [Option<TurningArm<D>>; 2],
}

/// Second derivatives of `force.(R exp(phi) arm)` by `phi` at zero, N m, with force and arm in the axes of the
/// rotation: `(f a' + a f')/2 - f.a 1`.
pub(super) fn arm_curvature<D: Scalar>(force: Vector<D>, arm: Vector<D>) -> Matrix3<D> {
    let along = dot(force, arm);
    let mut curvature = [[D::from(0.0); 3]; 3];
    for i in 0..3 {
        for j in 0..3 {
            curvature[i][j] = (force[i] * arm[j] + force[j] * arm[i]) * 0.5;
        }
        curvature[i][i] -= along;
    }
    curvature
}

impl<D: Scalar> SpatialCarried<D> {
    /// A node at the center of a body, m, with the angle zero: it depends on the three coordinates from `coordinate` on
    /// with unit derivatives.
    pub(super) fn at(coordinate: usize, position: Vector<D>) -> Self {
        let (zero, [x, y, z]) = (D::from(0.0), position);
        let mut slopes = [[zero; 4]; MOST];
        (0..3).for_each(|c| slopes[c][c] = D::from(1.0));
        let mut coordinates = [0; MOST];
        (0..3).for_each(|c| coordinates[c] = coordinate + c);
        Self { values: [x, y, z, zero], coordinates, count: 3, slopes, arms: [None; 2] }
    }

    /// Adds an `arm`, m, that turns with a rotation at its present `axes`, to the position, and appends the rotation's
    /// three coordinates with first derivatives. With a `tangent` of the carried edge, in these axes, the derivative of
    /// its angle is set too; else that is zero. At most two arms.
    pub(super) fn add_arm(
        &mut self,
        rotation: &SpatialRotation<D>,
        axes: &Matrix3<D>,
        arm: Vector<D>,
        tangent: Option<Vector<D>>,
    ) {
        let (turned, by) = (times(axes, arm), rotation.length.recip());
        for c in 0..3 {
            self.values[c] += turned[c];
            // `d(R exp(phi) a) = R (phi x a)`: the axis of the increment, in the world, times the turned arm.
            let slope = cross(column(axes, c), turned);
            let k = self.count + c;
            self.coordinates[k] = rotation.coordinate + c;
            let spin = tangent.map_or(D::from(0.0), |tangent| tangent[c]);
            self.slopes[k] = [slope[0] * by, slope[1] * by, slope[2] * by, spin * by];
        }
        self.count += 3;
        let SpatialRotation { coordinate, length, .. } = *rotation;
        let arm = TurningArm { coordinate, length, axes: *axes, arm };
        self.arms[usize::from(self.arms[0].is_some())] = Some(arm);
    }
}

impl<D: Scalar> CarriedMotion<D> for SpatialCarried<D> {
    /// The position, m, and the angle of the edge after the node from its carried frame, rad, which is zero.
    fn values(&self) -> &[D] {
        &self.values
    }

    /// Number of coordinates on which the node depends: three of the body's center, three more if the body rotates, and
    /// three more at a sprung clamp.
    fn count(&self) -> usize {
        self.count
    }

    /// The coordinate with number `k`, counted from the first one of all bodies.
    fn coordinate(&self, k: usize) -> usize {
        self.coordinates[k]
    }

    /// First derivatives of position and angle by the coordinate with number `k`; of a rotation by its increment times
    /// `length`.
    fn slope(&self, k: usize) -> &[D] {
        &self.slopes[k]
    }

    /// Calls `add(i, j, x)` with the derivatives `f a' - f.a 1` of `a x f` over `length^2`, N/m: `f` is the constant
    /// `force` in the axes of a rotation, which turn by the increment. An entry of `force` for the angle has no part,
    /// as the tangent of a carried edge is constant in these axes.
    fn add_turned(&self, force: &[D], mut add: impl FnMut(usize, usize, D)) {
        let force = [force[0], force[1], force[2]];
        for TurningArm { coordinate, length, axes, arm } in self.arms.iter().flatten() {
            let own = [0, 1, 2].map(|c| dot(column(axes, c), force));
            let (along, by) = (dot(own, *arm), (length * length).recip());
            for i in 0..3 {
                for j in 0..3 {
                    let diagonal = if i == j { along } else { D::from(0.0) };
                    add(coordinate + i, coordinate + j, (own[i] * arm[j] - diagonal) * by);
                }
            }
        }
    }

    /// Calls `add(i, j, x)`, `j <= i`, where `x` is the second derivative of `force.position` by increments of a
    /// rotation, over `length^2`, N/m. An entry of `force` for the angle has no part.
    fn add_curvature(&self, force: &[D], mut add: impl FnMut(usize, usize, D)) {
        let force = [force[0], force[1], force[2]];
        for TurningArm { coordinate, length, axes, arm } in self.arms.iter().flatten() {
            // The increments are in the axes of the rotation, and so must the force be.
            let own = [0, 1, 2].map(|c| dot(column(axes, c), force));
            let (curvature, by) = (arm_curvature(own, *arm), (length * length).recip());
            for i in 0..3 {
                for j in 0..=i {
                    add(coordinate + i, coordinate + j, curvature[i][j] * by);
                }
            }
        }
    }
}
