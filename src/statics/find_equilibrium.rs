//! Search for the equilibrium of a model under its loads by [descents](crate::statics::descent).
//!
//! The search starts from the initial shape, with the perturbation of the scene, or from the recorded shape. Ends that
//! move far are moved in several stages, each followed by a descent under the full loads. Only a rod that stands on a
//! clamp under loads far above buckling is first [loaded step by step](crate::statics::standing).
//!
//! Output: unknowns (m, rad) and frames of the last equilibrium, number of Newton iterations in all, largest unbalanced
//! force (N). Moved ends are at the end of their motion. In `held_equilibrium` they are at their places at t = 0, under
//! the forces `initial.point` too. Errors: no equilibrium, ends that move too far, an interruption, and those of a
//! recorded start. Stability is not examined.

use crate::error::Error;
use crate::numerics::scalar::RodScalar;
use crate::problem::{Discretized, FramesOf, Model, Setup, UnknownsAndFrames};
use crate::rod::ReferenceFrames;
use crate::scene::prescribed_motion::MotionTime;
use crate::scene::{End, InitialState, Support};
use crate::statics::descent::{Descent, DescentSettings, EquilibriumState};
use crate::statics::edge_coordinates::EdgeCoordinates;
use crate::statics::standing::StandingLoads;

impl<M: Model> Discretized<'_, M> {
    /// The equilibrium under the loads of the scene that the rod reaches from its initial or recorded shape, with the
    /// perturbation of the scene. Moved ends are at the end of their motion. The search is made anew at every call.
    ///
    /// # Errors
    /// [`Error::Equilibrium`] where none is found, [`Error::Interrupted`], [`Error::Invalid`] for ends that move too
    /// far, and those of a recorded start.
    pub fn equilibrium(&self) -> Result<EquilibriumState<FramesOf<M>>, Error> {
        self.equilibrium_of(&self.rod(), true)
    }

    /// Unknowns of the equilibrium at t = 0, m and rad, under the loads and the forces `initial.point` that hold the
    /// rod until then. Moved ends are at their places at t = 0. Angles are measured from the initial frames. Errors are
    /// those of [`equilibrium`](Self::equilibrium).
    pub(crate) fn held_equilibrium(&self) -> Result<Vec<f64>, Error> {
        let rod = self.setup.rod_at(self.model, 0.0);
        let rod = self.setup.rod_with_release_forces(self.model, &rod);
        let mut found = self.equilibrium_of(&rod, false)?;
        found.frames.convert_angles(&mut found.q, &self.begin(self.setup).1);
        Ok(found.q)
    }

    /// The equilibrium of `rod`, which may have other loads than the scene. The start is perturbed, and a limp standing
    /// rod is first [loaded step by step](Self::raise_loads). Moved ends are at the end of their motion (`settled`), or
    /// at their places at t = 0. In each stage ends move by an equal part, other nodes by their
    /// [share](Self::carried_share). The iterations are those of all descents. [`Error::Interrupted`] if the problem is
    /// stopped, checked at the start and before every stage.
    fn equilibrium_of(
        &self,
        rod: &M::Rod<f64>,
        settled: bool,
    ) -> Result<EquilibriumState<FramesOf<M>>, Error> {
        self.problem.check_stop()?;
        let (mut q, mut frames) = self.begin_at_rest(self.setup)?;
        if self.scene().initial.perturbation != 0.0 {
            self.perturb(self.setup, &mut q);
        }
        // Limp standing rods first follow the stable branch under increasing loads.
        let mut iterations = self.raise_loads(&mut q, &mut frames, settled);
        let boundary_motion = self.boundary_motion(self.setup);
        let stages = match &boundary_motion {
            Some(boundary_motion) => boundary_motion.stages(self.problem.length(), settled)?,
            None => 1,
        };
        // Ends move in stages; after each the rod descends to an equilibrium, from which the next stage starts.
        for k in 1..=stages {
            self.problem.check_stop()?;
            if let Some(boundary_motion) = &boundary_motion {
                let progress = |k: usize| k as f64 / stages as f64;
                let [from, to] =
                    [k - 1, k].map(|k| MotionTime::Approach { progress: progress(k), settled });
                boundary_motion.carry(from, to, &mut q, |end, node| self.carried_share(end, node));
                boundary_motion.advance::<M::Rod<f64>>(from, to, &mut q, &frames);
            }
            let found = self.descend(rod, q, frames)?;
            iterations += found.newton_iterations;
            if k == stages {
                return Ok(EquilibriumState { newton_iterations: iterations, ..found });
            }
            (q, frames) = (found.q, found.frames);
        }
        unreachable!("there is at least one stage")
    }

    /// The equilibrium of `rod` that one descent reaches from the unknowns `q`, m and rad, whose angles are measured
    /// from `frames`. Supports are those of the scene, and there are no springs; long rods are solved in edge
    /// coordinates. [`Error::Equilibrium`] where none is found.
    pub(super) fn descend(
        &self,
        rod: &M::Rod<f64>,
        q: Vec<f64>,
        frames: FramesOf<M>,
    ) -> Result<EquilibriumState<FramesOf<M>>, Error> {
        let edges = self.edge_coordinates();
        let settings = DescentSettings {
            free: self.free(),
            prescribed: self.prescribed(),
            length: self.problem.length(),
            negligible: self.negligible_stiffness(edges),
            springs: Vec::new(),
            edges,
            derivatives: self.problem.derivatives(),
        };
        Descent::new(rod, settings, q).descend(frames)
    }

    /// Unknowns and frames of the shape from which equilibria are searched, over `D`: the recorded shape if the scene
    /// starts there, else the initial one, without the perturbation. Twists that the scene gives to recorded ends are
    /// added to the angles. Errors are those of a recorded start.
    pub(super) fn begin_at_rest<D: RodScalar>(
        &self,
        setup: &Setup<D, M>,
    ) -> Result<UnknownsAndFrames<D, M>, Error> {
        if self.scene().initial.state == InitialState::Recorded {
            return self.recorded_shape(setup);
        }
        let (mut q, frames) = self.begin(setup);
        self.turn_ends(setup, &mut q);
        Ok((q, frames))
    }

    /// For a limp rod that stands: replaces `q` and `frames` by the equilibria under increasing fractions of its loads,
    /// one after the other, without the full loads. Where the loads determine no side and the scene has no
    /// perturbation, the rod is displaced slightly before. If not `settled`, the loads include the forces
    /// `initial.point`. Returns the number of Newton iterations; 0 for other rods, which do not change. A fraction
    /// without an equilibrium is left out.
    fn raise_loads(&self, q: &mut Vec<f64>, frames: &mut FramesOf<M>, settled: bool) -> usize {
        let Some(StandingLoads { parts, push }) = self.standing_loads(q) else { return 0 };
        if push > 0.0 && self.scene().initial.perturbation == 0.0 {
            self.perturb_by(self.setup, push, q);
        }
        let mut iterations = 0;
        for part in parts {
            let rod = self.partially_loaded_rod(part, !settled);
            // A part without an equilibrium is no error: the next one starts from the last shape found.
            if let Ok(found) = self.descend(&rod, q.clone(), frames.clone()) {
                iterations += found.newton_iterations;
                (*q, *frames) = (found.q, found.frames);
            }
        }
        iterations
    }

    /// The fraction, 0 to 1, of the displacement of the moving end `end` by which node `i` is displaced in the initial
    /// guess of a stage. It is 1 if the other end is free. Otherwise it decreases linearly in the index of the node,
    /// from 1 at the moving end to 0 at the other.
    fn carried_share(&self, end: End, i: usize) -> f64 {
        let supports = &self.problem.scene().supports;
        let along = i as f64 / (self.nodes() - 1) as f64;
        let (other, share) = match end {
            End::Start => (supports.end, 1.0 - along),
            End::End => (supports.start, along),
        };
        // With a free other end the rod moves as a whole; else both ends share the motion of the nodes between.
        if other == Support::Free { 1.0 } else { share }
    }

    /// Whether the scene has loads without a potential: follower loads, or moments in space.
    pub(crate) fn has_follower_loads(&self) -> bool {
        self.scene().loads.first_follower(M::STRIDE > 2).is_some()
    }

    /// The edge coordinates of a long rod that is held at its start only. `None` for other rods, for user-defined
    /// energies, contacts or tendons, for loads without a potential, and for prescribed nodes between the ends.
    pub(crate) fn edge_coordinates(&self) -> Option<EdgeCoordinates> {
        // User-defined energies may depend on the positions of nodes; the tangent of loads without a potential is by
        // nodes.
        let suitable = !self.scene().has_own_energies()
            && self.prescribed().is_empty()
            && !self.has_follower_loads();
        EdgeCoordinates::new(M::STRIDE, &self.free(), self.model.dof()).filter(|_| suitable)
    }
}
