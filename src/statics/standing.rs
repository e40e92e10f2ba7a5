//! Load steps for limp rods that stand: loads that push a rod towards its clamp are increased step by step.
//!
//! Such a rod, clamped at its start and free at its end, buckles at `F L^2/(E I)` near 8 (Greenhill 1881). Far above, a
//! descent from the standing shape to the hanging one passes many saddles, and may end in another equilibrium. Slightly
//! above the critical load the rod bends to the side that the loads determine, and from there it follows the stable
//! branch.
//!
//! At [`LIMP`] or more (without loads across the rod [`LIMP_SYMMETRIC`]) the output of `standing_loads` is an ascending
//! list of load fractions below 1: `FIRST_LOAD` over `F L^2/(E I)`, then by factors of `LOAD_RATIO`. Where the loads
//! determine no side, the rod is also displaced by `PUSH` lengths. The output is `None` for other rods: loads that do
//! not push towards the clamp, moving ends, a recorded start, user-defined energies, contacts or tendons, and loads
//! without a potential. `partially_loaded_rod` returns the rod under such a fraction of gravity and loads.

use crate::numerics::vector::{add, dot, sub};
use crate::problem::{Discretized, Model, Setup};
use crate::scene::{InitialState, Support};

/// Value of `F L^2/(E I)` above which a standing rod is limp and loaded in steps.
const LIMP: f64 = 100.0;
/// The same without loads across the rod. Below this value the unstable standing shape is the equilibrium of a
/// symmetric scene. Above, Newton's method finds it only by chance.
const LIMP_SYMMETRIC: f64 = 1000.0;
/// Value of `F L^2/(E I)` in the first load step, above the critical load near 8.
const FIRST_LOAD: f64 = 30.0;
/// Ratio of the loads of successive steps. A smaller ratio takes more steps; a larger one may leave the stable branch.
const LOAD_RATIO: f64 = 3.0;
/// Squared ratio of the loads across the rod to all loads, up to which the loads determine no side.
const NEGLIGIBLE_SIDE: f64 = 1e-9;
/// Initial displacement of a rod whose loads determine no side, over its length.
const PUSH: f64 = 1e-4;

/// Load steps of a standing rod.
pub(super) struct StandingLoads {
    /// Fractions of the full loads, ascending and below 1.
    pub parts: Vec<f64>,
    /// Displacement across the rod before the first step, as a fraction of its length; 0 for none.
    pub push: f64,
}

impl<M: Model> Discretized<'_, M> {
    /// The load steps from the shape `q`, as fractions of the full loads: [`FIRST_LOAD`] over `F L^2/(E I)`, then by
    /// factors of [`LOAD_RATIO`], below 1. `F` is the size of the sum of all nodal loads, and `E I` the softer bending
    /// stiffness halfway along. `push` is [`PUSH`] without loads across the rod, else 0.
    ///
    /// `None` unless the rod is clamped at its start and free at its end, without motion of the ends, recorded start,
    /// user-defined energies, contacts, tendons and loads without a potential. `None` too if the loads do not push it
    /// towards the clamp, or `F L^2/(E I)` is below [`LIMP`] ([`LIMP_SYMMETRIC`] without loads across it).
    pub(super) fn standing_loads(&self, q: &[f64]) -> Option<StandingLoads> {
        let (scene, last) = (self.scene(), self.nodes() - 1);
        let supports = &scene.supports;
        let stands_alone = supports.start == Support::Clamped
            && supports.end == Support::Free
            && !supports.move_ends()
            && scene.initial.state != InitialState::Recorded
            && !scene.has_own_energies()
            && !self.has_follower_loads();
        if !stands_alone {
            return None;
        }
        let forces = self.nodal_loads(scene.loads.at_time);
        // The rod stands if the sum of force times position relative to the wall is negative. The total force must also
        // point against the axis from the wall to the tip.
        let wall = self.model.position(q, 0);
        let place = |i: usize| sub(self.model.position(q, i), wall);
        let total = forces.iter().fold([0.0; 3], |sum, force| add(sum, *force));
        let size = dot(total, total).sqrt();
        let work: f64 = (0..=last).map(|i| dot(forces[i], place(i))).sum();
        let axis = place(last);
        let along = dot(total, axis) / dot(axis, axis).sqrt();
        let (section, material) = scene.at(0.5);
        let [i1, i2] = section.moments().second_moments;
        let length = self.problem.length();
        let limpness = size * length.powi(2) / (material.youngs_modulus * i1.min(i2));
        if work >= 0.0 || along >= 0.0 || limpness.is_nan() || limpness < LIMP {
            return None;
        }
        // Steps from slightly above the critical load to the full one; without a side the rod gets a small push.
        let first = FIRST_LOAD / limpness;
        let parts = std::iter::successors(Some(first), |part| Some(part * LOAD_RATIO));
        let has_side =
            (size * size - along * along).max(0.0).sqrt() > NEGLIGIBLE_SIDE.sqrt() * size;
        if !has_side && limpness < LIMP_SYMMETRIC {
            return None;
        }
        let push = if has_side { 0.0 } else { PUSH };
        Some(StandingLoads { parts: parts.take_while(|part| *part < 1.0).collect(), push })
    }

    /// The rod under the fraction `part` of gravity, point and line loads; if `held`, also of the forces
    /// `initial.point`, which hold it until t = 0.
    pub(super) fn partially_loaded_rod(&self, part: f64, held: bool) -> M::Rod<f64> {
        let mut scene = self.setup.scene.clone();
        let scaled = |v: &mut [f64; 3]| *v = v.map(|c| c * part);
        scaled(&mut scene.loads.gravity);
        for load in scene.loads.point.iter_mut().chain(&mut scene.initial.point) {
            scaled(&mut load.force);
            scaled(&mut load.moment);
        }
        for load in &mut scene.loads.line {
            scaled(&mut load.force);
        }
        let setup = Setup::new(self.model, scene);
        let rod = setup.rod(self.model);
        if held { setup.rod_with_release_forces(self.model, &rod) } else { rod }
    }
}
