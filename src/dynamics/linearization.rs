//! Linearization of an implicit step at its solution: the data from which derivatives over the step follow.
//!
//! [`Linearization`] refers to the states before and after, to gradient (N) and tangent (N/m) of the forces at the
//! solution, without and with drag. It also has those at the stages of averaging schemes ([`StageForces`]), and those
//! of a viscous rod at the start of the next step ([`StartForces`]). It has damping, the parameter of the scheme, and
//! the factors of the matrix of the step, for Newmark-beta `M (1 + h beta c) + h^2 beta^2 K` with the mass damping `c`.
//! Forward sensitivities and the adjoint solve with these factors. `check_solution` tests a solution `x` for the
//! right-hand side `b`, with an indefinite matrix only. A residual above `SOLUTION_TOLERANCE` times the sum of the
//! largest entries of `|b|` and `|b - m M x|`, with the factor `m` of the masses, is [`Error::SingularTangent`].
//! `coefficients` returns the coefficients of the step's equations for a parameter of the scheme over any scalar.

use crate::dynamics::coefficients::StepCoefficients;
use crate::energy::Derivatives;
use crate::error::Error;
use crate::numerics::prescribed_dofs::PrescribedDofs;
use crate::numerics::scalar::Scalar;
use crate::numerics::tangent::{Factors, Tangent};
use crate::rod::{EdgeMoment, FactorsOf, NodalDrag, Rod, State};
use crate::scene::{Damping, Scheme};
use std::ops::Range;

/// Largest residual of a linear solution, over the size of its right-hand side: half of all digits. Only solutions with
/// an indefinite matrix are checked.
const SOLUTION_TOLERANCE: f64 = 1e-8;

/// The forces of a rod at one stage of an averaging scheme: the elastic ones at a point of its quadrature, or the
/// viscous ones at the end of the step.
#[derive(Clone, Debug)]
pub struct StageForces<D: Scalar, R: Rod<D>> {
    /// The unknowns there, m (rad for angles).
    pub q: Vec<D>,
    /// The elastic gradient less the loads there, N (N m for angles).
    pub gradient: Vec<D>,
    /// The tangent of that gradient, N/m.
    pub tangent: R::Tangent,
    /// Geometry and strains of edges and joints at `q`, in plain numbers; empty over dual numbers.
    pub geometry: R::Geometry,
}

/// The forces of a rod at the start of a step.
#[derive(Clone, Debug)]
pub struct StartForces<D, T> {
    /// The elastic gradient less the loads, without mass damping and drag, N (N m for angles).
    pub gradient: Vec<D>,
    /// The tangent of that gradient, N/m, with the elastic stiffness.
    pub tangent: T,
}

/// A step solved by Newton's method, with the tangents, factors and states from which its derivatives and their
/// transpose follow.
#[derive(Debug)]
pub struct Linearization<'a, D: Scalar, R: Rod<D>> {
    /// The rod under its loads.
    pub rod: &'a R,
    /// Which derivatives of the energy were used.
    pub derivatives: Derivatives,
    /// The unknowns that move.
    pub free: Range<usize>,
    /// Those among them with a recorded motion: they have no derivatives, and rows and columns of the identity in
    /// [`tangent`](Self::tangent) and [`matrix`](Self::matrix).
    pub prescribed: &'a PrescribedDofs,
    /// The scheme whose equations were solved.
    pub scheme: Scheme,
    /// The parameter of the scheme.
    pub parameter: D,
    /// Damping: rates in 1/s, times in s.
    pub damping: &'a Damping<D>,
    /// Drag of a fluid, if there is one.
    pub drag: Option<&'a NodalDrag<D>>,
    /// Mean moments of loads in time over the step; they are part of gradient and tangent.
    pub timed_moments: &'a [EdgeMoment<D>],
    /// The state at the start of the step.
    pub before: &'a State<D, R::Frames>,
    /// The state at its end.
    pub after: &'a State<D, R::Frames>,
    /// The elastic gradient less the loads at the solution, N (N m for angles), with viscous stress; the mean of an
    /// averaging scheme.
    pub gradient: &'a [D],
    /// The tangent of that gradient by the unknowns at the end, N/m.
    pub tangent: &'a R::Tangent,
    /// The gradient with the drag of a fluid.
    pub total: &'a [D],
    /// The tangent with that drag.
    pub matrix: &'a R::Tangent,
    /// Factors of the matrix of the step, `weights[0] M + weights[1] matrix`: `M (1 + h beta c) + h^2 beta^2 K` of
    /// Newmark-beta with the mass damping `c`.
    pub factors: &'a FactorsOf<R, D>,
    /// The factors of the masses and of [`matrix`](Self::matrix), s^2, in the factored matrix.
    pub weights: [D; 2],
    /// The forces at the stages within the step, one per stage of an averaging scheme, and the
    /// viscous ones at its end.
    pub stages: &'a [StageForces<D, R>],
    /// Geometry and strains of edges and joints at the end of the step, measured from the frames at its start, in plain
    /// numbers; empty over dual numbers.
    pub end: &'a R::Geometry,
    /// The forces that the next step takes as those of its start; empty for rods without viscosity, and where the
    /// transposed derivative is not needed.
    pub next: &'a StartForces<D, R::Tangent>,
}

impl<D: Scalar, R: Rod<D>> Linearization<'_, D, R> {
    /// The coefficients of the step, for a `parameter` of the scheme over any scalar, which may carry derivatives;
    /// the step size has none.
    pub fn coefficients<E: Scalar>(&self, parameter: E) -> StepCoefficients<E> {
        let knows_acceleration = !self.before.acceleration.is_empty();
        let h = self.after.time - self.before.time;
        StepCoefficients::new(self.scheme, parameter, knows_acceleration, h)
    }

    /// Rejects a solution `x` of the factored matrix `m M + k K` and the right-hand side `b` whose largest residual is
    /// too large. The limit is `SOLUTION_TOLERANCE` times the sum of the largest `|b - m M x|` and the largest `|b|`. A
    /// positive definite matrix always passes; the solution of one with negative pivots may be inaccurate. Newton's
    /// corrections need no such check: one that does not shrink as predicted is followed by another.
    ///
    /// # Errors
    /// [`Error::SingularTangent`].
    pub fn check_solution(&self, x: &[D], b: &[D]) -> Result<(), Error> {
        // LDL' without pivoting is backward stable for positive definite matrices only.
        if self.factors.negative_pivots() == 0 {
            return Ok(());
        }
        // `matrix` lacks the masses: their part is moved to the right-hand side, and both sides are
        // divided by the factor of the tangent.
        let [masses, tangent] = self.weights;
        let mass = self.rod.mass();
        let rest: Vec<D> = (0..x.len()).map(|i| b[i] - mass[i] * masses * x[i]).collect();
        let scaled: Vec<D> = rest.iter().map(|r| *r / tangent).collect();
        // The largest absolute value, NaN if any is.
        let larger = |a: f64, b: f64| if b > a || b.is_nan() { b } else { a };
        let largest =
            |v: &mut dyn Iterator<Item = D>| v.map(|r| r.value().abs()).fold(0.0_f64, larger);
        let residual = self.matrix.residual(self.free.clone(), x, &scaled);
        let error = largest(&mut residual.into_iter()) * tangent.value();
        let size = largest(&mut rest[self.free.clone()].iter().copied())
            + largest(&mut b[self.free.clone()].iter().copied());
        match error <= SOLUTION_TOLERANCE * size {
            true => Ok(()),
            false => Err(Error::SingularTangent { time: self.after.time, row: self.free.start }),
        }
    }
}
