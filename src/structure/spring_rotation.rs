//! Range of rotational springs in space: their relative rotation must stay below half a turn.
//!
//! The moment of a spring is that of the rotation vector of its end relative to the first entry of the joint. At half a
//! turn this vector changes its sign, and the moment with it, although the energy is continuous. `check_springs`
//! rejects a state (unknowns and frames of an assembly) in which the rotation from the rest rotation of a spring
//! exceeds [`LARGEST_ROTATION`]. The error names the joint. In a plane angles of springs have no limit, and hinges have
//! no such moment.

use crate::error::Error;
use crate::numerics::rotation::{product, rotation_vector, transpose};
use crate::numerics::vector::dot;
use crate::rod::Assembly;
use crate::rod::assembly::AssemblyFrames;
use crate::rod::assembly::joint_law::JointStiffness;
use crate::structure::definition::Structure;
use std::f64::consts::PI;

/// Largest rotation of a spring, rad: 0.9 of half a turn, so that a step does not pass half a turn unnoticed.
const LARGEST_ROTATION: f64 = 0.9 * PI;

impl Structure {
    /// Rejects a state in space in which a spring is rotated by more than [`LARGEST_ROTATION`] from its rest rotation.
    /// The state has the unknowns `q`, m and rad, measured from the `frames` of the `assembly`. The error has the key
    /// `joints[i]` and the `time`, s, if there is one; an equilibrium has none. `Ok` in a plane.
    pub(super) fn check_springs(
        &self,
        assembly: &Assembly<f64>,
        q: &[f64],
        frames: &AssemblyFrames<f64>,
        time: Option<f64>,
    ) -> Result<(), Error> {
        let Assembly::Space(rods) = assembly else { return Ok(()) };
        let (bodies, z) = (rods.bodies(), &q[rods.body_coordinates()]);
        // Rotations of springs follow those of all bodies that rotate.
        let rotating = bodies.bodies.iter().filter(|body| body.rotation.is_some()).count();
        let clamps = bodies.rotations_with_axes(z, frames).skip(rotating);
        let springs = bodies.springs.iter().zip(&self.blueprint.plan.springs).zip(clamps);
        for ((spring, plan), (_, clamp)) in springs {
            let JointStiffness::Spring(_) = spring.law.stiffness else { continue };
            let body = bodies.axes(z, frames, &bodies.bodies[spring.body]);
            let relative = product(&transpose(&body), &clamp);
            let turn = rotation_vector(&product(&transpose(&spring.law.rest), &relative));
            let angle = dot(turn, turn).sqrt();
            if angle <= LARGEST_ROTATION {
                continue;
            }
            let moment = time.map_or(String::new(), |time| format!(" at t = {time:.4} s"));
            let found = format!("a spring that is rotated by {angle:.3} rad{moment}");
            let allowed = format!(
                "up to {LARGEST_ROTATION:.3} rad, 0.9 of half a turn, in space. Its moment changes sign at half a turn"
            );
            let key = format!("joints[{}]", plan.joint);
            let error = Error::invalid(key, found, allowed);
            return Err(error.in_file(self.scene.path.as_deref()));
        }
        Ok(())
    }
}
