//! Limp rods that stand: their loads are raised step by step.
//!
//! A rod whose loads push it towards its clamp falls over at `F L^2/(E I)` near 8 (Greenhill). Far above, the way from the
//! standing shape to the hanging one passes many saddles, and may end beside the hanging shape. At small loads the rod bends to
//! the side that the loads choose, and from there it follows the stable branch.

use crate::numerics::vector::{Vector, add, dot, scale, sub};
use crate::problem::{Discretized, Model, Setup};
use crate::rod::Rod;
use crate::scene::{InitialState, Support};

/// Loads times `L^2/(E I)` above which a standing rod is limp.
const LIMP: f64 = 100.0;
/// The same without loads across the rod: below, the unstable standing shape is the equilibrium of a symmetric scene. Above,
/// Newton's method does not find it but by chance.
const LIMP_WITHOUT_SIDE: f64 = 1000.0;
/// The same of the first equilibrium, above the critical load.
const FIRST: f64 = 30.0;
/// Factor from one load to the next.
const RAISE: f64 = 3.0;
/// Loads across the rod below this part are none.
const ACROSS: f64 = 1e-9;
/// Displacement of a rod whose loads choose no side, over its length.
const PUSH: f64 = 1e-4;

/// How the loads of a standing rod are raised.
pub(super) struct StandingLoads {
    /// Parts of the loads before all of them, ascending.
    pub parts: Vec<f64>,
    /// Displacement across the rod at the start, over its length.
    pub push: f64,
}

impl<M: Model> Discretized<'_, M> {
    /// The steps in which the loads are raised from the shape `q`; none where the rod does not stand, or is stiff.
    pub(super) fn standing_loads(&self, q: &[f64]) -> Option<StandingLoads> {
        let (scene, last) = (self.scene(), self.nodes() - 1);
        let supports = &scene.supports;
        let stands_alone = supports.start == Support::Clamped
            && supports.end == Support::Free
            && !supports.move_ends()
            && scene.initial.state != InitialState::Recorded
            && scene.energies.is_empty();
        if !stands_alone {
            return None;
        }
        let (rod, loads) = (self.rod(), self.setup.loads());
        let mut forces: Vec<Vector<f64>> =
            (0..=last).map(|i| scale(scene.loads.gravity, rod.mass()[M::STRIDE * i])).collect();
        for load in &loads {
            forces[load.node] = add(forces[load.node], load.force);
        }
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
        let first = FIRST / limpness;
        let parts = std::iter::successors(Some(first), |part| Some(part * RAISE));
        let is_aimed = (size * size - along * along).max(0.0).sqrt() > ACROSS.sqrt() * size;
        if !is_aimed && limpness < LIMP_WITHOUT_SIDE {
            return None;
        }
        let push = if is_aimed { 0.0 } else { PUSH };
        Some(StandingLoads { parts: parts.take_while(|part| *part < 1.0).collect(), push })
    }

    /// The rod under a part of its loads; with a part of the forces that hold it until t = 0 where it is `held`.
    pub(super) fn under_part(&self, part: f64, held: bool) -> M::Rod<f64> {
        let mut scene = self.setup.scene.clone();
        let scaled = |v: &mut [f64; 3]| *v = v.map(|c| c * part);
        scaled(&mut scene.loads.gravity);
        for load in scene.loads.point.iter_mut().chain(&mut scene.initial.point) {
            scaled(&mut load.force);
            scaled(&mut load.moment);
        }
        let setup = Setup::new(self.model, scene);
        let rod = setup.rod(self.model);
        if held { setup.rod_with_release_forces(self.model, &rod) } else { rod }
    }
}
