//! Derivatives of an equilibrium with respect to the scene's numbers, by the implicit function theorem.
//!
//! Input: an equilibrium in plain numbers, whether it is neutral (`CheckedEquilibrium`), and a setup over dual numbers.
//! An equilibrium satisfies `g(q, p) = 0` with the gradient `g` of the energy, unknowns `q` and numbers `p`. Newton
//! steps `q -= K^-1 g(q, p)` in dual numbers, with the tangent `K` in plain numbers, make one more order of derivatives
//! exact each. At a neutral equilibrium `K` is singular: a small stiffness is added, and the nodes move with the
//! initial position. Long rods are solved in edge coordinates. Held unknowns have the derivatives of the supports at
//! the end of their motion.
//!
//! Output: rod and unknowns (m, rad) with derivatives (`differentiated_equilibrium`), or the outputs in an
//! [`EquilibriumRequest`]: positions of nodes in the world (m), axes of edges and reactions (N, N m). A singular
//! tangent is [`Error::Indifferent`]. `displacement_under_forces` solves `K x = f` alone, for the adjoint; `None` for a
//! singular tangent and for long rods.

use crate::energy::Derivatives;
use crate::error::Error;
use crate::numerics::scalar::RodScalar;
use crate::numerics::tangent::{Factors, Singular};
use crate::problem::{Discretized, FramesOf, Model, Setup};
use crate::rod::{ReferenceFrames, Rod, State};
use crate::scene::prescribed_motion::MotionTime;
use crate::scene::{End, Parameter, Support};
use crate::statics::descent::EquilibriumState;
use crate::statics::pencil::Pencil;
use crate::statics::reaction::Reactions;
use std::sync::Arc;

/// Stiffness that is added to the tangent at a neutral equilibrium, over the negligible one: then rounding errors of
/// the edges' stiffness cause no motion.
const ADDED_STIFFNESS: f64 = 1e4;
/// Additional Newton steps at a neutral equilibrium. Each reduces the effect of the added stiffness on other motions by
/// a factor of 1e5.
const ADDED_STEPS: usize = 3;

/// An equilibrium, and whether it is neutral.
pub(crate) struct CheckedEquilibrium<F> {
    /// The equilibrium.
    pub rest: EquilibriumState<F>,
    /// Whether the rod can move without resistance: rigidly, or by a spin.
    neutral: bool,
}

/// Outputs of an equilibrium that are requested.
pub(crate) struct EquilibriumRequest {
    /// Nodes whose positions are requested.
    pub nodes: Arc<[usize]>,
    /// Edges whose director axes are requested.
    pub edges: Arc<[usize]>,
    /// Whether the reactions of the supports are requested.
    pub has_reactions: bool,
}

/// Outputs of an equilibrium over a scalar with derivatives.
pub(crate) struct EquilibriumOutputs<D> {
    /// Positions of the requested nodes, m.
    pub nodes: Vec<[D; 3]>,
    /// Tangent and both material directors of the requested edges, unit vectors, edge after edge.
    pub axes: Vec<[D; 3]>,
    /// Reactions of the supports, if requested.
    pub reactions: Option<Reactions<D>>,
}

impl<M: Model> Discretized<'_, M> {
    /// The [equilibrium](Self::equilibrium) with the result of [`is_neutral`](Self::is_neutral), which its
    /// differentiation requires.
    ///
    /// # Errors
    /// Those of [`equilibrium`](Self::equilibrium) and [`is_neutral`](Self::is_neutral).
    pub(crate) fn checked_equilibrium(&self) -> Result<CheckedEquilibrium<FramesOf<M>>, Error> {
        self.checked(self.equilibrium()?)
    }

    /// The equilibrium that a descent under the present loads reaches from `before`, an equilibrium under other loads.
    /// If that fails, it is the one that the search from the initial shape finds. The result of
    /// [`is_neutral`](Self::is_neutral) is added.
    ///
    /// # Errors
    /// Those of [`checked_equilibrium`](Self::checked_equilibrium).
    pub(crate) fn next_equilibrium(
        &self,
        before: &CheckedEquilibrium<FramesOf<M>>,
    ) -> Result<CheckedEquilibrium<FramesOf<M>>, Error> {
        match self.descend(&self.rod(), before.rest.q.clone(), before.rest.frames.clone()) {
            Ok(found) => self.checked(found),
            Err(_) => self.checked_equilibrium(),
        }
    }

    /// The equilibrium `rest` with the result of [`is_neutral`](Self::is_neutral), whose errors are passed on.
    fn checked(
        &self,
        rest: EquilibriumState<FramesOf<M>>,
    ) -> Result<CheckedEquilibrium<FramesOf<M>>, Error> {
        Ok(CheckedEquilibrium { neutral: self.is_neutral(&rest.q, &rest.frames)?, rest })
    }

    /// The rod over `D` and the unknowns of an equilibrium, m and rad, with the derivatives that `D` carries. Angles
    /// are measured from the frames of the equilibrium, which have no derivatives. Held unknowns have the derivatives
    /// of supports at the end of their motion. The nodes of a neutral equilibrium have the derivatives of the initial
    /// positions, as no equation determines them.
    ///
    /// # Errors
    /// [`Error::Indifferent`] where the tangent is singular, and those of a recorded start.
    pub(crate) fn differentiated_equilibrium<D: RodScalar>(
        &self,
        CheckedEquilibrium { rest, neutral }: &CheckedEquilibrium<FramesOf<M>>,
        setup: &Setup<D, M>,
    ) -> Result<(M::Rod<D>, Vec<D>), Error> {
        let rod = setup.rod(self.model);
        let mut q: Vec<D> = rest.q.iter().map(|x| D::from(*x)).collect();
        let frames = M::frames_over(&rest.frames);
        // No equation determines the position of such a rod: it follows its initial position.
        if *neutral {
            self.add_start_derivatives(&self.begin_at_rest(setup)?.0, &mut q);
        }
        self.hold(setup, MotionTime::Approach { progress: 1.0, settled: true }, &mut q, &frames)?;
        self.differentiate(&rod, &frames, &self.rod(), &rest.frames, &mut q, *neutral)
            .map_err(|singular| Error::Indifferent { node: singular.row / M::STRIDE })?;
        Ok((rod, q))
    }

    /// The `requested` outputs of an equilibrium: positions of nodes, axes of edges and, on request, reactions, with
    /// derivatives. `seed` returns the number over `D` of a parameter and its value. Errors are those of
    /// [`differentiated_equilibrium`](Self::differentiated_equilibrium).
    pub(crate) fn outputs_at_equilibrium<D: RodScalar>(
        &self,
        equilibrium: &CheckedEquilibrium<FramesOf<M>>,
        requested: &EquilibriumRequest,
        seed: impl Fn(Parameter, f64) -> D,
    ) -> Result<EquilibriumOutputs<D>, Error> {
        let setup = self.setup_over(seed);
        let (_, q) = self.differentiated_equilibrium(equilibrium, &setup)?;
        // Directors are normal to the tangent, and derivatives by coordinates are forces, only in frames at the current
        // shape, with all derivatives.
        let mut frames = M::frames_over(&equilibrium.rest.frames);
        M::Rod::<D>::update_reference_frames(&mut frames, &q);
        let nodes = requested.nodes.iter().map(|i| self.model.position(&q, *i)).collect();
        let axes = self.axes_at_rest(&setup, &q, &frames, &requested.edges);
        let reactions = requested
            .has_reactions
            .then(|| self.reactions_at_rest(setup, &State::at_rest(q, frames)));
        Ok(EquilibriumOutputs { nodes, axes, reactions })
    }

    /// Adds the derivatives to the unknowns `q` of an equilibrium of `rod` by Newton steps, `q -= K^-1 g`. The gradient
    /// `g` is that of `rod` over `D`, by the hand-derived formulas; the tangent `K` is that of the same rod in `plain`
    /// numbers. One step removes the residual, and one more per order adds derivatives. For a `neutral` equilibrium
    /// [`ADDED_STIFFNESS`] times the negligible stiffness is added to `K`, and [`ADDED_STEPS`] more steps are made.
    /// Long rods are solved in edge coordinates; held and prescribed unknowns stay.
    ///
    /// # Errors
    /// The row of a zero pivot of the tangent.
    pub(crate) fn differentiate<D: RodScalar>(
        &self,
        rod: &M::Rod<D>,
        frames: &<M::Rod<D> as Rod<D>>::Frames,
        plain: &M::Rod<f64>,
        plain_frames: &FramesOf<M>,
        q: &mut [D],
        neutral: bool,
    ) -> Result<(), Singular> {
        let found: Vec<f64> = q.iter().map(|x| x.value()).collect();
        let (free, prescribed, edges) = (self.free(), self.prescribed(), self.edge_coordinates());
        let pencil = Pencil::resting(self, plain, &found, plain_frames);
        // Masses of this pencil are negligible stiffnesses: a negative shift adds them to the tangent.
        let factors = pencil.factor(if neutral { -ADDED_STIFFNESS } else { 0.0 })?;
        let mut change = vec![D::from(0.0); q.len()];
        // The first step removes the residual, each further one makes one more order of derivatives exact.
        for _ in 0..1 + D::ORDER + if neutral { ADDED_STEPS } else { 0 } {
            rod.gradient(q, frames, Derivatives::Hand, &mut change);
            if let Some(edges) = edges {
                edges.edge_forces::<D, M::Rod<D>>(&mut change);
            }
            prescribed.fill(&mut change, D::from(0.0));
            factors.solve(&mut change);
            if let Some(edges) = edges {
                edges.node_changes::<D, M::Rod<D>>(&mut change);
            }
            for i in free.clone() {
                q[i] -= change[i];
            }
        }
        Ok(())
    }

    /// Replaces the forces `x`, N, on all unknowns of a rod in equilibrium at `q` by the displacements `K^-1 x` of its
    /// free unknowns, m (rad for angles). Held and prescribed unknowns get zero. `None` where the tangent is singular,
    /// or for long rods in edge coordinates; the displacements are then not computed.
    pub(crate) fn displacement_under_forces(
        &self,
        rod: &M::Rod<f64>,
        q: &[f64],
        frames: &FramesOf<M>,
        x: &mut [f64],
    ) -> Option<()> {
        // The tangent of a long rod is not factored in node coordinates.
        if self.edge_coordinates().is_some() {
            return None;
        }
        let pencil = Pencil::at(self, rod, q, frames);
        self.prescribed().fill(x, 0.0);
        pencil.factor(0.0).ok()?.solve(x);
        Some(())
    }

    /// Adds the derivatives of the initial positions `begin`, without their values, to the coordinates of the nodes in
    /// `q`. Angles are unchanged. This is for a rod that no support holds: it moves with its initial position.
    pub(crate) fn add_start_derivatives<D: RodScalar>(&self, begin: &[D], q: &mut [D]) {
        for i in (0..q.len()).filter(|i| !M::Rod::<D>::is_angle(*i)) {
            q[i] += begin[i] - D::from(begin[i].value());
        }
    }

    /// Sets the unknowns `q` outside the free range to their values at `moment`, with derivatives. Coordinates get the
    /// initial positions. Angles of recorded ends get those of the initial directors of their edges; other angles stay.
    /// Then the motion of clamped, pinned and recorded supports at `moment` is applied. Errors are those of a recorded
    /// start.
    pub(crate) fn hold<D: RodScalar>(
        &self,
        setup: &Setup<D, M>,
        moment: MotionTime<f64>,
        q: &mut [D],
        frames: &<M::Rod<D> as Rod<D>>::Frames,
    ) -> Result<(), Error> {
        let (begin, begin_frames) = self.begin_at_rest(setup)?;
        let (free, supports) = (self.free(), &self.scene().supports);
        for i in (0..q.len()).filter(|i| !free.contains(i)) {
            if !M::Rod::<D>::is_angle(i) {
                q[i] = begin[i];
                continue;
            }
            // Edges at recorded ends keep their initial twist.
            let end = if i < free.start { End::Start } else { End::End };
            if supports.at(end) == Support::Recorded
                && let edge = i / M::STRIDE
                && let Some(director) = begin_frames.director(&begin, edge)
            {
                frames.align(q, edge, director, 0.0);
            }
        }
        self.held_ends(setup).advance::<M::Rod<D>>(moment, moment, q, frames);
        Ok(())
    }
}
