//! Rigid bodies and joint springs in the plane: positions of the rods' nodes that they carry, masses, energies,
//! derivatives.
//!
//! A body has the coordinates `x, y`, m, of its center of mass, and those of a rotation `phi = length theta`, m, with
//! a constant `length`, so that all coordinates are lengths. A node that it carries is at the arm `a` from its
//! center. Through a rotational spring a second arm `b` follows, which turns with the absolute rotation `psi` of the
//! sprung clamp:
//!
//! ```text
//! X = x + R(theta) a + R(psi) b.
//! ```
//!
//! Second derivatives of `X` by different coordinates vanish, and those by a rotation are minus the rotated arm over
//! `length^2`. The spring has the energy `k (psi - theta - rest angle)^2/2`, J. A body without rotation is the point of
//! a ball joint; its `theta` is zero. A dead load on a body has the potential minus force times position of its load
//! point, J. Output: positions of carried nodes with derivatives, and energies, gradient (N) and second derivatives
//! (N/m) of springs and loads by the coordinates. Masses, kg (inertia over `length^2` for a rotation), are constant and
//! diagonal. In a time step the viscous moment of a spring is added by another stiffness and rest angle.
//!
//! `Bodies` are all bodies (`Body`) and springs (`JointSpring`) of an assembly; `Rotation` is a rotation about the
//! normal of the plane, and `CarriedPosition` the position of a carried node with its derivatives. `load_point` is the
//! point of a body's load, m.

use crate::numerics::scalar::{RodScalar, Scalar};
use crate::rod::assembly::attachment::Attachment;
use crate::rod::assembly::carrying::{CarriedMotion, CarryingBodies, VelocitySlopes, is_viscous};
use crate::rod::assembly::frames::AssemblyFrames;
use crate::rod::{Energies, StepVelocities, Viscosity};

/// Largest number of coordinates on which the position of a carried node depends.
const MOST: usize = 4;

/// A rotation about the normal of the plane.
#[derive(Clone, Copy, Debug)]
pub struct Rotation<D> {
    /// Index of its coordinate, counted from the first coordinate of all bodies.
    pub coordinate: usize,
    /// Coordinate over angle, m/rad: a constant scale.
    pub length: f64,
    /// Moment of inertia, kg m^2.
    pub inertia: D,
}

impl<D: Scalar> Rotation<D> {
    /// Cosine and sine, in this order, of the angle: its coordinate in `z` (coordinates of all bodies, m) over
    /// `length`.
    #[inline]
    fn cosine_and_sine(&self, z: &[D]) -> [D; 2] {
        let angle = z[self.coordinate] * self.length.recip();
        [angle.cos(), angle.sin()]
    }
}

/// A rigid body, or the common point of a ball joint.
#[derive(Clone, Copy, Debug)]
pub struct Body<D> {
    /// Index of its coordinate x, followed by y, counted from the first coordinate of all bodies.
    pub coordinate: usize,
    /// Its rotation; none of a point.
    pub rotation: Option<Rotation<D>>,
    /// Mass, kg, with that of the carried nodes.
    pub mass: D,
    /// Dead force, N, without the weight of the carried nodes.
    pub load: [D; 2],
    /// Arm of the force from the center, m, at rest: to the center of mass of the body alone.
    pub load_arm: [D; 2],
}

/// A rotational spring between a body and the clamp of a rod.
#[derive(Clone, Copy, Debug)]
pub struct JointSpring<D> {
    /// Index of the body.
    pub body: usize,
    /// Rotation of the clamp from rest, in the plane (not relative to the body).
    pub rotation: Rotation<D>,
    /// Stiffness, N m/rad.
    pub stiffness: D,
    /// Rotation of the clamp relative to the body without moment, rad.
    pub rest_angle: D,
    /// Time `t` of the viscous moment, s: `k t` times the rate of the relative rotation.
    pub damping: D,
}

/// All bodies and springs of an assembly.
#[derive(Clone, Debug, Default)]
pub struct Bodies<D> {
    /// The bodies.
    pub bodies: Vec<Body<D>>,
    /// The springs.
    pub springs: Vec<JointSpring<D>>,
}

/// Position of a carried node, m, with its first derivatives and its second ones by the same coordinate twice.
#[derive(Clone, Copy, Debug)]
pub struct CarriedPosition<D> {
    /// The position, m.
    pub position: [D; 2],
    /// Coordinates on which it depends; the first `count` have a meaning.
    pub coordinates: [usize; MOST],
    /// Number of these coordinates.
    pub count: usize,
    /// First derivatives by each coordinate.
    pub slopes: [[D; 2]; MOST],
    /// Second derivatives by each coordinate, 1/m.
    pub curvatures: [[D; 2]; MOST],
}

/// The arm `[x, y]`, m, at rest after the counter-clockwise rotation with this cosine and sine.
#[inline]
fn rotated<D: Scalar>([cosine, sine]: [D; 2], [x, y]: [D; 2]) -> [D; 2] {
    [cosine * x - sine * y, sine * x + cosine * y]
}

impl<D: Scalar> CarriedPosition<D> {
    /// Adds the `arm`, m, turned by the angle with the cosine and sine `direction`, to the position. Appends the
    /// coordinate of the `rotation` with first derivatives `perp(arm)/length` and second ones `-arm/length^2` of the
    /// turned arm.
    fn add_arm(&mut self, rotation: &Rotation<D>, direction: [D; 2], arm: [D; 2]) {
        let [x, y] = rotated(direction, arm);
        let (k, by) = (self.count, rotation.length.recip());
        self.position = [self.position[0] + x, self.position[1] + y];
        self.coordinates[k] = rotation.coordinate;
        // By the angle the derivative of the turned arm is the arm rotated by a right angle, the second one is minus
        // the arm. Each derivative by the coordinate divides by `length` once.
        self.slopes[k] = [-(y * by), x * by];
        self.curvatures[k] = [-(x * (by * by)), -(y * (by * by))];
        self.count += 1;
    }
}

impl<D: Scalar> Bodies<D> {
    /// Appends to `to` the position of each node of an attachment, m, at the coordinates `z` of all bodies. First and
    /// second derivatives are by the body's position, by its rotation, and by that of the sprung clamp, where these
    /// exist.
    fn place_nodes(
        &self,
        z: &[D],
        attachment: &Attachment<[D; 2]>,
        to: &mut Vec<CarriedPosition<D>>,
    ) {
        let (zero, one) = (D::from(0.0), D::from(1.0));
        let body = &self.bodies[attachment.body];
        let first = body.coordinate;
        let turned = body.rotation.as_ref().map(|turn| (turn, turn.cosine_and_sine(z)));
        let spring = attachment.spring.map(|i| &self.springs[i].rotation);
        let sprung = spring.map(|turn| (turn, turn.cosine_and_sine(z)));
        for node in &attachment.nodes {
            let mut carried = CarriedPosition {
                position: [z[first], z[first + 1]],
                coordinates: [first, first + 1, 0, 0],
                count: 2,
                slopes: [[one, zero], [zero, one], [zero; 2], [zero; 2]],
                curvatures: [[zero; 2]; MOST],
            };
            // The point of a ball joint does not rotate: no arm turns with it.
            if let Some((turn, direction)) = turned {
                carried.add_arm(turn, direction, node.on_body);
            }
            if let Some((turn, direction)) = sprung {
                carried.add_arm(turn, direction, node.on_clamp);
            }
            to.push(carried);
        }
    }

    /// The angle of a rotation from rest, rad, at the coordinates `z` of all bodies, m.
    fn angle(z: &[D], rotation: &Rotation<D>) -> D {
        z[rotation.coordinate] * rotation.length.recip()
    }

    /// Rotation of a sprung clamp less that of its body and less the rest angle, rad: the angle in the spring's energy.
    /// A body that does not rotate counts zero.
    fn spring_angle(&self, z: &[D], spring: &JointSpring<D>) -> D {
        let body = self.bodies[spring.body].rotation;
        let turned = body.map_or(D::from(0.0), |rotation| Self::angle(z, &rotation));
        Self::angle(z, &spring.rotation) - turned - spring.rest_angle
    }

    /// The rotations on which the angle of a spring depends, each with its derivative of the angle: +1 of the clamp,
    /// then -1 of the body if that rotates.
    fn turns(&self, spring: &JointSpring<D>) -> impl Iterator<Item = (Rotation<D>, f64)> {
        let body = self.bodies[spring.body].rotation.map(|rotation| (rotation, -1.0));
        [(spring.rotation, 1.0)].into_iter().chain(body)
    }

    /// The point of a body at which its load acts, m: center plus turned `load_arm`, or the center of a body without
    /// rotation.
    pub fn load_point(&self, z: &[D], body: &Body<D>) -> [D; 2] {
        let [x, y] = [z[body.coordinate], z[body.coordinate + 1]];
        let arm = match &body.rotation {
            Some(turn) => rotated(turn.cosine_and_sine(z), body.load_arm),
            None => [D::from(0.0); 2],
        };
        [x + arm[0], y + arm[1]]
    }
}

impl<D: Scalar> CarriedMotion<D> for CarriedPosition<D> {
    /// The position of the carried node, m: two coordinates.
    fn values(&self) -> &[D] {
        &self.position
    }

    /// Number of coordinates on which the position depends: 2 to 4.
    fn count(&self) -> usize {
        self.count
    }

    /// The coordinate with number `k`, counted from the first one of all bodies.
    fn coordinate(&self, k: usize) -> usize {
        self.coordinates[k]
    }

    /// First derivatives of the two components of the position by the coordinate with number `k`, dimensionless.
    fn slope(&self, k: usize) -> &[D] {
        &self.slopes[k]
    }

    /// Calls `add(i, i, x)` for each of its coordinates `i`, where `x` is the second derivative of `force.position` by
    /// it, N/m.
    fn add_curvature(&self, force: &[D], mut add: impl FnMut(usize, usize, D)) {
        for (i, curvature) in self.coordinates[..self.count].iter().zip(&self.curvatures) {
            add(*i, *i, force[0] * curvature[0] + force[1] * curvature[1]);
        }
    }
}

impl<D: RodScalar> CarryingBodies<D, [D; 2]> for Bodies<D> {
    type Motion = CarriedPosition<D>;

    /// Coordinates of an attachment, counted from the first one of all bodies: x and y, then the rotations of the body
    /// and of the sprung clamp, where these exist.
    fn coordinates(&self, attachment: &Attachment<[D; 2]>) -> Vec<usize> {
        let body = &self.bodies[attachment.body];
        let rotation = body.rotation.iter().map(|rotation| rotation.coordinate);
        let spring = attachment.spring.map(|i| self.springs[i].rotation.coordinate);
        [body.coordinate, body.coordinate + 1].into_iter().chain(rotation).chain(spring).collect()
    }

    /// Appends to `to` the position of each node of an attachment, m, with its derivatives, at the coordinates `z` of
    /// all bodies.
    fn carry(
        &self,
        z: &[D],
        _: &AssemblyFrames<D>,
        attachment: &Attachment<[D; 2]>,
        to: &mut Vec<CarriedPosition<D>>,
    ) {
        self.place_nodes(z, attachment, to);
    }

    /// Appends to `to` the slopes of the velocity of each node of an attachment.
    fn velocity_slopes(
        &self,
        _: &[D],
        _: &AssemblyFrames<D>,
        rates: StepVelocities<'_, D>,
        _: &Attachment<[D; 2]>,
        carried: &[CarriedPosition<D>],
        to: &mut Vec<VelocitySlopes<D>>,
    ) {
        to.extend(carried.iter().map(|node| node.planar_velocity_slopes(rates.velocity)));
    }

    /// An empty list: in a plane the coordinates of bodies have no gaps.
    fn idle_coordinates(&self) -> Vec<usize> {
        Vec::new()
    }

    /// Writes the mass of every coordinate of bodies, kg: the body's mass for x and y, and inertia over `length^2` for
    /// a rotation, of springs too.
    fn masses(&self, mass: &mut [D]) {
        let rotations = self.springs.iter().map(|spring| spring.rotation);
        for body in &self.bodies {
            mass[body.coordinate] = body.mass;
            mass[body.coordinate + 1] = body.mass;
        }
        // Coordinates are lengths: inertia over `length^2` is the mass with the same kinetic energy.
        for turn in self.bodies.iter().filter_map(|body| body.rotation).chain(rotations) {
            mass[turn.coordinate] = turn.inertia * (turn.length * turn.length).recip();
        }
    }

    /// Overwrites `gradient`, N, with that of the springs' energies less the work of the loads, by the coordinates of
    /// bodies.
    fn gradient(&self, z: &[D], _: &AssemblyFrames<D>, gradient: &mut [D]) {
        gradient.fill(D::from(0.0));
        for body in &self.bodies {
            for c in 0..2 {
                gradient[body.coordinate + c] = -body.load[c];
            }
            if let Some(turn) = &body.rotation {
                let [x, y] = rotated(turn.cosine_and_sine(z), body.load_arm);
                // The force acts at the center of mass of the body alone, beside that of the body with its nodes.
                let moment = body.load[1] * x - body.load[0] * y;
                gradient[turn.coordinate] -= moment * turn.length.recip();
            }
        }
        for spring in &self.springs {
            let moment = spring.stiffness * self.spring_angle(z, spring);
            for (turn, sign) in self.turns(spring) {
                gradient[turn.coordinate] += moment * (sign / turn.length);
            }
        }
    }

    /// Calls `add(row, column, entry)` with the second derivatives of the energies of springs and loads, N/m: entries
    /// of the lower triangle, diagonal included.
    fn add_tangent(&self, z: &[D], _: &AssemblyFrames<D>, mut add: impl FnMut(usize, usize, D)) {
        for body in &self.bodies {
            if let Some(turn) = &body.rotation {
                let [x, y] = rotated(turn.cosine_and_sine(z), body.load_arm);
                // The gradient is minus the moment `a x F`, whose derivative by the angle is `-F.a`.
                let along = body.load[0] * x + body.load[1] * y;
                let by = (turn.length * turn.length).recip();
                add(turn.coordinate, turn.coordinate, along * by);
            }
        }
        for spring in &self.springs {
            for (a, sign) in self.turns(spring) {
                for (b, other) in self.turns(spring) {
                    // Both orders of a pair occur: the lower triangle takes one.
                    if b.coordinate <= a.coordinate {
                        let by = sign * other / (a.length * b.length);
                        add(a.coordinate, b.coordinate, spring.stiffness * by);
                    }
                }
            }
        }
    }

    /// Adds `k angle^2/2` of each spring, J, to the bending energy, and minus force times load point of each body to
    /// the potential.
    fn add_energies(&self, z: &[D], _: &AssemblyFrames<D>, energies: &mut Energies) {
        for body in &self.bodies {
            let place = self.load_point(z, body);
            for c in 0..2 {
                energies.potential -= (body.load[c] * place[c]).value();
            }
        }
        for spring in &self.springs {
            let angle = self.spring_angle(z, spring);
            energies.bend += 0.5 * (spring.stiffness * angle * angle).value();
        }
    }

    /// A copy with zero loads and zero spring stiffnesses, for the dashpots of an assembly; masses and arms stay.
    fn passive(&self) -> Self {
        let mut bodies = self.clone();
        bodies.bodies.iter_mut().for_each(|body| body.load = [D::from(0.0); 2]);
        bodies.springs.iter_mut().for_each(|spring| spring.stiffness = D::from(0.0));
        bodies
    }

    /// Whether the time of the viscous moment of a spring, or a derivative of it, is not zero.
    fn has_viscous_springs(&self) -> bool {
        self.springs.iter().any(|spring| is_viscous(spring.damping))
    }

    /// Appends to `strains` the rotation of each spring from its rest, rad: that of the clamp less that of the body and
    /// the rest angle.
    fn add_spring_strains(&self, z: &[D], _: &AssemblyFrames<D>, strains: &mut Vec<D>) {
        strains.extend(self.springs.iter().map(|spring| self.spring_angle(z, spring)));
    }

    /// Overwrites stiffnesses and rest angles by those of the springs of `elastic` with viscous moments in a time step:
    /// the moment `k (a + time (rate a - past))` of the elastic angle `a` is that of another elastic spring. `rate` and
    /// `past` (from index `first` on) are those of `viscosity.own`; nothing changes without it.
    fn set_viscous_springs(&mut self, elastic: &Self, viscosity: &Viscosity<D>, first: usize) {
        let Some(own) = &viscosity.own else { return };
        for (i, (to, from)) in self.springs.iter_mut().zip(&elastic.springs).enumerate() {
            let factor = from.damping * own.rate + 1.0;
            to.stiffness = from.stiffness * factor;
            to.rest_angle = from.rest_angle + from.damping * own.past[first + i] / factor;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rod::assembly::attachment::CarriedNode;
    use num_dual::Dual2_64;

    fn bodies<D: Scalar>() -> (Bodies<D>, Attachment<[D; 2]>) {
        let x = |x: f64| D::from(x);
        let rotation = |coordinate, length| Rotation { coordinate, length, inertia: x(2.0) };
        let body = Body {
            coordinate: 1,
            rotation: Some(rotation(3, 0.3)),
            mass: x(1.0),
            load: [x(0.2), x(-0.4)],
            load_arm: [x(0.3), x(0.15)],
        };
        let spring = JointSpring {
            body: 0,
            rotation: rotation(0, 0.1),
            stiffness: x(1.7),
            rest_angle: x(0.2),
            damping: x(0.0),
        };
        let node = CarriedNode {
            node: 4,
            width: 2,
            on_body: [x(0.2), x(-0.1)],
            on_clamp: [x(0.05), x(0.07)],
        };
        let attachment = Attachment { body: 0, spring: Some(0), nodes: vec![node], edge: None };
        (Bodies { bodies: vec![body], springs: vec![spring] }, attachment)
    }

    const Z: [f64; 4] = [0.03, 1.1, -0.4, 0.2];

    /// Oracle: second-order dual numbers along each coordinate and along sums of two.
    #[test]
    fn derivatives_of_carried_positions_and_energies_agree_with_dual_numbers() {
        let (plain, attachment) = bodies::<f64>();
        let (dual, dual_attachment) = bodies::<Dual2_64>();
        let mut found = Vec::new();
        let frames = AssemblyFrames::default();
        plain.carry(&Z, &frames, &attachment, &mut found);
        let found = found[0];
        let (mut gradient, mut tangent) = ([0.0; 4], [[0.0; 4]; 4]);
        plain.gradient(&Z, &frames, &mut gradient);
        plain.add_tangent(&Z, &frames, |i, j, entry| tangent[i][j] += entry);
        let along = |moved: &[usize]| -> (Dual2_64, [Dual2_64; 2]) {
            let z: Vec<Dual2_64> =
                (0..4).map(|i| Dual2_64::new(Z[i], f64::from(moved.contains(&i)), 0.0)).collect();
            let mut carried = Vec::new();
            dual.place_nodes(&z, &dual_attachment, &mut carried);
            let position = carried[0].position;
            let spring = &dual.springs[0];
            let angle = dual.spring_angle(&z, spring);
            let (body, at) = (&dual.bodies[0], dual.load_point(&z, &dual.bodies[0]));
            let force = body.load[0] * at[0] + body.load[1] * at[1];
            (spring.stiffness * angle.powi(2) * 0.5 - force, position)
        };
        for i in 0..4 {
            let (energy, position) = along(&[i]);
            assert!((energy.v1 - gradient[i]).abs() < 1e-14);
            assert!((energy.v2 - tangent[i][i]).abs() < 1e-12);
            let k = found.coordinates[..found.count].iter().position(|c| *c == i).unwrap();
            for c in 0..2 {
                assert!((position[c].re - found.position[c]).abs() < 1e-15);
                assert!((position[c].v1 - found.slopes[k][c]).abs() < 1e-14);
                assert!((position[c].v2 - found.curvatures[k][c]).abs() < 1e-13);
            }
            for j in 0..i {
                let (both, moved) = along(&[i, j]);
                let mixed = 0.5 * (both.v2 - along(&[i]).0.v2 - along(&[j]).0.v2);
                assert!((mixed - tangent[i][j]).abs() < 1e-11);
                let other = along(&[j]).1;
                assert!((0..2).all(|c| (moved[c].v2 - position[c].v2 - other[c].v2).abs() < 1e-12));
            }
        }
    }
}
