//! Rigid bodies and elastic joints in space: unknowns of the nodes that they carry, masses, energies and derivatives.
//!
//! Each body has three coordinates of its center, m, and three of its [rotation](SpatialRotation) if it rotates; a
//! joint has those of the rotation of its clamp. One coordinate without effect follows each three, so that all begin at
//! a multiple of four. Output at given coordinates and reference rotations: unknowns of carried nodes (m, and the angle
//! of a carried edge, zero), masses (kg), energies of joints and dead loads (J), gradient (N) and second derivatives
//! (N/m). Derivatives by rotations are those by increments, rad, over `length`, m, a radius of gyration. For equilibria
//! and modes they are converted to the coordinates; a simulation keeps them
//! ([`by_increments`](SpatialBodies::by_increments)). `axes` are the axes of a body (world axes if it does not rotate),
//! `load_point` is the point of its load, and `rotations_with_axes` lists all rotations. In a time step the viscous
//! moment of a spring is added by other stiffnesses and natural rotations.

use crate::energy::frame::EdgeFrame;
use crate::numerics::rotation::{
    Matrix3, identity, orthonormal, product, tangent_map, times, transpose, transposed_times,
};
use crate::numerics::scalar::RodScalar;
use crate::numerics::tangent::Tangent;
use crate::numerics::vector::{Vector, cross, dot};
use crate::rod::assembly::attachment::Attachment;
use crate::rod::assembly::carrying::{CarryingBodies, VelocitySlopes, is_viscous};
use crate::rod::assembly::conversion::{convert_gradient, convert_tangent};
use crate::rod::assembly::frames::AssemblyFrames;
use crate::rod::assembly::joint_law::{ElasticJoint, JointStiffness};
use crate::rod::assembly::spatial_motion::{SpatialCarried, SpatialRotation, arm_curvature};
use crate::rod::assembly::tangent::BorderedTangent;
use crate::rod::{Energies, StepVelocities, Viscosity};
use std::borrow::Cow;

/// A rigid body in space, or the common point of a ball joint.
#[derive(Clone, Copy, Debug)]
pub struct SpatialBody<D> {
    /// Index of its coordinate x, followed by y and z, counted from the first coordinate of all bodies.
    pub coordinate: usize,
    /// Its rotation; none of a point.
    pub rotation: Option<SpatialRotation<D>>,
    /// Mass, kg, with that of the carried nodes.
    pub mass: D,
    /// Dead force, N, in world axes, without the weight of the carried nodes.
    pub load: Vector<D>,
    /// Arm of the force from the center, m, in the axes of the body: to the center of mass of the body alone.
    pub load_arm: Vector<D>,
}

/// An elastic joint between a body and the clamp of a rod, in space.
#[derive(Clone, Copy, Debug)]
pub struct SpatialSpring<D> {
    /// Index of the body.
    pub body: usize,
    /// Rotation of the clamp. Its axes are the directors and the tangent of the edge.
    pub rotation: SpatialRotation<D>,
    /// Its law.
    pub law: ElasticJoint<D>,
    /// Time `t` of the viscous moment, s: the stiffness times `t` times the rate of the rotation vector.
    pub damping: D,
}

/// All bodies and elastic joints of an assembly in space.
#[derive(Clone, Debug)]
pub struct SpatialBodies<D> {
    /// The bodies.
    pub bodies: Vec<SpatialBody<D>>,
    /// The elastic joints.
    pub springs: Vec<SpatialSpring<D>>,
    /// Whether derivatives are those by increments of rotations, as the steps of a simulation take them.
    pub by_increments: bool,
}

impl<D: RodScalar> SpatialBodies<D> {
    /// The rotations of all bodies that rotate, then those of all joints' clamps.
    pub(super) fn rotations(&self) -> impl Iterator<Item = &SpatialRotation<D>> {
        let bodies = self.bodies.iter().filter_map(|body| body.rotation.as_ref());
        bodies.chain(self.springs.iter().map(|spring| &spring.rotation))
    }

    /// The rotations in the order of `rotations`, each with its axes in the columns, in world components. `z` are the
    /// coordinates of all bodies: the unknowns of the assembly from the first of them on. `frames` have the references
    /// of the rotations.
    pub fn rotations_with_axes<'a>(
        &'a self,
        z: &'a [D],
        frames: &'a AssemblyFrames<D>,
    ) -> impl Iterator<Item = (&'a SpatialRotation<D>, Matrix3<D>)> {
        self.rotations().map(|rotation| (rotation, rotation.axes(z, frames)))
    }

    /// The rotation that carries the edge of an attachment: that of the joint's clamp, or that of the body without a
    /// joint. `None` for a body that does not rotate.
    fn carrying(&self, attachment: &Attachment<[D; 3]>) -> Option<&SpatialRotation<D>> {
        match attachment.spring {
            Some(i) => Some(&self.springs[i].rotation),
            None => self.bodies[attachment.body].rotation.as_ref(),
        }
    }

    /// Rotation of a clamp in the axes of its body at the coordinates `z`; in world axes for a body that does not
    /// rotate.
    fn relative(
        &self,
        z: &[D],
        frames: &AssemblyFrames<D>,
        spring: &SpatialSpring<D>,
    ) -> Matrix3<D> {
        let clamp = spring.rotation.axes(z, frames);
        match &self.bodies[spring.body].rotation {
            Some(body) => product(&transpose(&body.axes(z, frames)), &clamp),
            None => clamp,
        }
    }

    /// The rotations of a joint, each with the index of its first derivative in those of the joint's law: 0 for the
    /// body, if that rotates, then 3 for the clamp.
    fn turns(
        &self,
        spring: &SpatialSpring<D>,
    ) -> impl Iterator<Item = (usize, SpatialRotation<D>)> {
        let body = self.bodies[spring.body].rotation.map(|rotation| (0, rotation));
        body.into_iter().chain([(3, spring.rotation)])
    }

    /// The point of a body at which its load acts, m, in world axes: center plus turned `load_arm`, or the center of a
    /// body that does not rotate.
    pub fn load_point(
        &self,
        z: &[D],
        frames: &AssemblyFrames<D>,
        body: &SpatialBody<D>,
    ) -> Vector<D> {
        let arm = match &body.rotation {
            Some(rotation) => times(&rotation.axes(z, frames), body.load_arm),
            None => [D::from(0.0); 3],
        };
        [0, 1, 2].map(|c| z[body.coordinate + c] + arm[c])
    }

    /// The axes of a body in the columns, in world components; the identity for a body that does not rotate.
    pub fn axes(&self, z: &[D], frames: &AssemblyFrames<D>, body: &SpatialBody<D>) -> Matrix3<D> {
        body.rotation.map_or_else(identity, |rotation| rotation.axes(z, frames))
    }
}

impl<D: RodScalar> CarryingBodies<D, [D; 3]> for SpatialBodies<D> {
    type Motion = SpatialCarried<D>;

    /// Coordinates of an attachment, counted from the first one of all bodies: three of the center, three of the body's
    /// rotation, three of the clamp's, where these exist.
    fn coordinates(&self, attachment: &Attachment<[D; 3]>) -> Vec<usize> {
        let body = &self.bodies[attachment.body];
        let rotation = body.rotation.iter().map(|rotation| rotation.coordinate);
        let spring = attachment.spring.map(|i| self.springs[i].rotation.coordinate);
        let firsts = [body.coordinate].into_iter().chain(rotation).chain(spring);
        firsts.flat_map(|first| first..first + 3).collect()
    }

    /// The coordinates without effect: that after each three of a center, then that after each three of a rotation.
    fn idle_coordinates(&self) -> Vec<usize> {
        let bodies = self.bodies.iter().map(|body| body.coordinate + 3);
        bodies.chain(self.rotations().map(|rotation| rotation.coordinate + 3)).collect()
    }

    /// Appends to `to` the unknowns of each node of an attachment with their derivatives, at the coordinates `z` of all
    /// bodies. A node with four unknowns includes the angle of the carried edge.
    fn carry(
        &self,
        z: &[D],
        frames: &AssemblyFrames<D>,
        attachment: &Attachment<[D; 3]>,
        to: &mut Vec<SpatialCarried<D>>,
    ) {
        let body = &self.bodies[attachment.body];
        let first = body.coordinate;
        let turned = body.rotation.as_ref().map(|turn| (turn, turn.axes(z, frames)));
        let clamp = attachment.spring.map(|i| &self.springs[i].rotation);
        let clamped = clamp.map(|turn| (turn, turn.axes(z, frames)));
        for node in &attachment.nodes {
            let edge = attachment.edge.as_ref().filter(|_| node.width > 3);
            let tangent = edge.map(|edge| edge.frame[0]);
            let mut carried = SpatialCarried::at(first, [z[first], z[first + 1], z[first + 2]]);
            if let Some((turn, axes)) = &turned {
                // With a joint the edge turns with the clamp, not with the body.
                let tangent = tangent.filter(|_| clamped.is_none());
                carried.add_arm(turn, axes, node.on_body, tangent);
            }
            if let Some((turn, axes)) = &clamped {
                carried.add_arm(turn, axes, node.on_clamp, tangent);
            }
            to.push(carried);
        }
    }

    /// Appends to `to` the slopes of the velocities of each node of an attachment, by increments of the rotations.
    fn velocity_slopes(
        &self,
        z: &[D],
        frames: &AssemblyFrames<D>,
        rates: StepVelocities<'_, D>,
        attachment: &Attachment<[D; 3]>,
        _: &[SpatialCarried<D>],
        to: &mut Vec<VelocitySlopes<D>>,
    ) {
        self.spatial_velocity_slopes(z, frames, rates, attachment, to);
    }

    /// The frame of the edge of an attachment, turned by the joint's clamp or the body. `None` without an edge, or for
    /// a body without rotation and joint.
    fn edge_frame(
        &self,
        z: &[D],
        frames: &AssemblyFrames<D>,
        attachment: &Attachment<[D; 3]>,
    ) -> Option<EdgeFrame<D>> {
        let axes = self.carrying(attachment)?.axes(z, frames);
        let [tangent, director] = attachment.edge.as_ref()?.frame.map(|v| times(&axes, v));
        Some(EdgeFrame { tangent, director })
    }

    /// Writes the mass of every coordinate, kg: the body's for its center, moments of inertia over `length^2` for
    /// rotations. Those without effect stay.
    fn masses(&self, mass: &mut [D]) {
        for body in &self.bodies {
            mass[body.coordinate..][..3].fill(body.mass);
        }
        for SpatialRotation { coordinate, length, inertia, .. } in self.rotations() {
            for c in 0..3 {
                mass[coordinate + c] = inertia[c] * (length * length).recip();
            }
        }
    }

    /// Overwrites `gradient`, N, with that of the joints' energies less the work of the loads, by positions and by
    /// increments of rotations over `length`.
    fn gradient(&self, z: &[D], frames: &AssemblyFrames<D>, gradient: &mut [D]) {
        gradient.fill(D::from(0.0));
        for body in &self.bodies {
            for c in 0..3 {
                gradient[body.coordinate + c] = -body.load[c];
            }
            if let Some(turn) = &body.rotation {
                // In the axes of the body, since derivatives are by increments in these axes.
                let force = transposed_times(&turn.axes(z, frames), body.load);
                let moment = cross(body.load_arm, force);
                for c in 0..3 {
                    gradient[turn.coordinate + c] -= moment[c] * turn.length.recip();
                }
            }
        }
        for spring in &self.springs {
            let moments = spring.law.gradient(&self.relative(z, frames, spring));
            for (first, turn) in self.turns(spring) {
                for c in 0..3 {
                    gradient[turn.coordinate + c] += moments[first + c] * turn.length.recip();
                }
            }
        }
    }

    /// Calls `add(row, column, entry)`, `column <= row`, with the second derivatives of the energies of joints and
    /// loads by increments of rotations, N/m. Coordinates without effect have 1 on the diagonal.
    fn add_tangent(
        &self,
        z: &[D],
        frames: &AssemblyFrames<D>,
        mut add: impl FnMut(usize, usize, D),
    ) {
        // Without a pivot there the matrix would be singular.
        self.idle_coordinates().into_iter().for_each(|i| add(i, i, D::from(1.0)));
        for body in &self.bodies {
            if let Some(turn) = &body.rotation {
                let force = transposed_times(&turn.axes(z, frames), body.load);
                let curvature = arm_curvature(force, body.load_arm);
                let by = (turn.length * turn.length).recip();
                for i in 0..3 {
                    for j in 0..=i {
                        let entry = -(curvature[i][j] * by);
                        add(turn.coordinate + i, turn.coordinate + j, entry);
                    }
                }
            }
        }
        for spring in &self.springs {
            let local = spring.law.tangent(&self.relative(z, frames, spring));
            for (row, a) in self.turns(spring) {
                for (column, b) in self.turns(spring) {
                    let by = (a.length * b.length).recip();
                    for i in 0..3 {
                        for j in 0..3 {
                            if b.coordinate + j <= a.coordinate + i {
                                let entry = local.hessian[row + i][column + j] * by;
                                add(a.coordinate + i, b.coordinate + j, entry);
                            }
                        }
                    }
                }
            }
        }
    }

    /// Converts `gradient`, and `tangent` if given, in place, from derivatives by increments of rotations to those by
    /// the coordinates `z`. Nothing happens with `by_increments`. At their reference both are equal.
    fn convert_derivatives<T: Tangent<D>>(
        &self,
        z: &[D],
        frames: &AssemblyFrames<D>,
        gradient: &mut [D],
        tangent: Option<&mut BorderedTangent<D, T>>,
    ) {
        if self.by_increments {
            return;
        }
        let mut tangent = tangent;
        for rotation in self.rotations() {
            let vector = rotation.vector(z, frames);
            // At the reference `T` is the identity, and the symmetric part of its derivative is zero.
            if vector.iter().all(RodScalar::is_identically_zero) {
                continue;
            }
            if let Some(tangent) = &mut tangent {
                // Before the gradient: its entries by increments are part of the second derivatives.
                convert_tangent(rotation, vector, gradient, tangent);
            }
            convert_gradient(rotation, vector, gradient);
        }
    }

    /// The `changes` of all coordinates at `z`, with those of each rotation replaced by `T dz`, its increment times
    /// `length`. With `by_increments` they are increments already and returned unchanged.
    fn increments<'a>(
        &self,
        z: &[D],
        frames: &AssemblyFrames<D>,
        changes: &'a [D],
    ) -> Cow<'a, [D]> {
        if self.by_increments {
            return Cow::Borrowed(changes);
        }
        let mut increments = changes.to_vec();
        for rotation in self.rotations() {
            let map = tangent_map(rotation.vector(z, frames));
            let own = times(&map, rotation.of(changes));
            increments[rotation.coordinate..][..3].copy_from_slice(&own);
        }
        Cow::Owned(increments)
    }

    /// Moves the references of all rotations in `frames` to the coordinates `z`: their axes there, made orthonormal
    /// again.
    fn move_references(&self, z: &[D], frames: &mut AssemblyFrames<D>) {
        for rotation in self.rotations() {
            // Rounding errors of many successive rotations would add up to a shear of the axes.
            let axes = orthonormal(&rotation.axes(z, frames));
            let reference = &mut frames.rotations[rotation.reference];
            (reference.axes, reference.coordinates) = (axes, rotation.of(z));
        }
    }

    /// Adds the energy of each joint, J, to the bending energy, and minus load times load point of each body to the
    /// potential.
    fn add_energies(&self, z: &[D], frames: &AssemblyFrames<D>, energies: &mut Energies) {
        for body in &self.bodies {
            energies.potential -= dot(body.load, self.load_point(z, frames, body)).value();
        }
        for spring in &self.springs {
            energies.bend += spring.law.energy(&self.relative(z, frames, spring)).value();
        }
    }

    /// A copy with zero loads and joints without stiffness, for the dashpots of an assembly; masses and arms stay.
    fn passive(&self) -> Self {
        let (mut bodies, zero) = (self.clone(), D::from(0.0));
        bodies.bodies.iter_mut().for_each(|body| body.load = [zero; 3]);
        for spring in &mut bodies.springs {
            // Without stiffness springs and hinges are the same law.
            spring.law.stiffness = JointStiffness::Spring([zero; 3]);
        }
        bodies
    }

    /// Whether the time of the viscous moment of a joint, or a derivative of it, is not zero.
    fn has_viscous_springs(&self) -> bool {
        self.springs.iter().any(|spring| is_viscous(spring.damping))
    }

    /// Appends the rotation vector of each joint from its rest, rad, in the axes of the clamp; zeros for a hinge.
    fn add_spring_strains(&self, z: &[D], frames: &AssemblyFrames<D>, strains: &mut Vec<D>) {
        for spring in &self.springs {
            strains.extend(match spring.law.stiffness {
                JointStiffness::Spring(_) => spring.law.rotation(&self.relative(z, frames, spring)),
                JointStiffness::Hinge(..) => [D::from(0.0); 3],
            });
        }
    }

    /// Overwrites stiffnesses and natural rotations by those of the springs of `elastic` with viscous moments in a time
    /// step: the moment `k (xi + time (rate xi - past))` of the elastic rotation `xi` is that of another elastic
    /// spring. `rate` and `past` (three per joint from index `first` on) are those of `viscosity.own`; nothing changes
    /// without it. Hinges do not change.
    fn set_viscous_springs(&mut self, elastic: &Self, viscosity: &Viscosity<D>, first: usize) {
        let Some(own) = &viscosity.own else { return };
        for (i, (to, from)) in self.springs.iter_mut().zip(&elastic.springs).enumerate() {
            if let JointStiffness::Spring(stiffness) = from.law.stiffness {
                let factor = from.damping * own.rate + 1.0;
                to.law.stiffness = JointStiffness::Spring(stiffness.map(|k| k * factor));
                let past = &own.past[first + 3 * i..][..3];
                to.law.natural = [0, 1, 2].map(|c| from.damping * past[c] / factor);
            }
        }
    }
}
