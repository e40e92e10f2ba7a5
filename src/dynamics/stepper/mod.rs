//! Schemes whose steps need no iteration: explicit [splittings](splitting), and
//! [Rosenbrock](rosenbrock)'s linearly implicit scheme. See [`crate::dynamics::scheme`].

pub mod rosenbrock;
pub mod splitting;

use crate::dynamics::simulation::Work;
use crate::dynamics::stepper::rosenbrock::Rosenbrock;
use crate::dynamics::stepper::splitting::Splitting;
use crate::energy::Derivatives;
use crate::numerics::banded::Singular;
use crate::numerics::scalar::Scalar;
use crate::rod::Rod;
use crate::rod::State;
use crate::scene::Scheme;
use std::ops::Range;

/// What such a step does, and the room it needs.
#[derive(Clone, Debug)]
pub enum Direct<D, const W: usize> {
    /// Explicit.
    Splitting(Splitting<D>),
    /// Linearly implicit.
    Rosenbrock(Box<Rosenbrock<D, W>>),
}

/// What is stepped, and by how much.
#[derive(Debug)]
pub struct Step<'a, D, R> {
    /// The rod.
    pub rod: &'a R,
    /// Which derivatives to use.
    pub derivatives: Derivatives,
    /// The unknowns that move.
    pub free: Range<usize>,
    /// Mass-proportional damping, 1/s.
    pub drag: D,
    /// Length of the step, s.
    pub h: f64,
}

impl<D: Scalar, const W: usize> Direct<D, W> {
    /// The scheme's, if its steps need no iteration, for rods of these masses.
    pub fn of(scheme: Scheme, mass: &[D]) -> Option<Self> {
        if let Some(splitting) = Splitting::of(scheme, mass) {
            return Some(Self::Splitting(splitting));
        }
        (scheme == Scheme::Rodas4)
            .then(|| Self::Rosenbrock(Box::new(Rosenbrock::with_order(mass.len()))))
    }

    /// Advances `state`, but for its time, and returns the work.
    pub fn step<R: Rod<D, W>>(
        &mut self,
        step: &Step<'_, D, R>,
        state: &mut State<D, R::Frames>,
    ) -> Result<Work, Singular> {
        match self {
            Self::Splitting(splitting) => Ok(splitting.step(step, state)),
            Self::Rosenbrock(rosenbrock) => rosenbrock.step(step, state),
        }
    }
}
