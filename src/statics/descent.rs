//! Descent to an equilibrium by pseudo-transient continuation (Kelley and Keyes 1998, doi:10.1137/S0036142996304796).
//!
//! Plain Newton iterations diverge where loads bend a stiff rod far, since the first step stretches it too much. Each
//! step of the descent solves
//!
//! ```text
//! lambda M (q1 - q0) + dE/dq(q1) = 0,
//! ```
//!
//! an implicit step of gradient descent in the metric `M` (the masses), by Newton's method with the exact tangent `K`.
//! `lambda`, 1/s^2, is multiplied by [`DECREASE`] after each step (`CAREFUL_DECREASE` after a repeated one), and is
//! zero below [`SMALLEST`] of its first value. The last steps are Newton iterations on the equilibrium itself, until
//! corrections or forces are rounding errors. A step that moves nothing, directly after a repeated one, ends the
//! descent too. A step is repeated with [`INCREASE`] times `lambda` where Newton's method fails or a joint passes
//! through a fold. So is one that leads an edge through an obstacle
//! ([`swept_edge`](crate::energy::swept_edge)), and one where `K + lambda M` is not positive definite at its start or
//! end, apart from negligible stiffnesses.
//!
//! A rod in an exactly symmetric unstable equilibrium stays there. After [`SADDLES`] steps that begin at an indefinite
//! matrix, the rod is displaced slightly along the softest motion, once. Long rods may use
//! [edge coordinates](crate::statics::edge_coordinates) with another metric.
//!
//! Input: a rod, or the assembly of a structure, with boundary conditions ([`DescentSettings`]), initial unknowns and
//! frames. Output: [`EquilibriumState`], with unknowns (m, rad), frames, number of Newton iterations and largest
//! unbalanced force (N), or an error after [`STEPS`] steps, failed ones included. The equilibrium may be unstable: its
//! stability is not examined.

use crate::energy::Derivatives;
use crate::error::Error;
use crate::numerics::prescribed_dofs::PrescribedDofs;
use crate::numerics::tangent::{Factors, Tangent};
use crate::rod::{FactorsOf, Rod};
use crate::statics::edge_coordinates::EdgeCoordinates;
use std::ops::Range;

/// Largest number of Newton iterations in a step of the descent.
const ITERATIONS: usize = 20;
/// Iterations after which a step without `lambda` ends if all forces are rounding errors.
const PATIENCE: usize = 10;
/// Forces count as rounding errors below this many times `eps * sum |K_ij| |q_j|`.
const ROUNDING: f64 = 8.0;
/// Corrections below this fraction of the rod's length count as zero: rounding errors of coordinates.
const STEP_TOLERANCE: f64 = 1e-13;
/// Corrections below this fraction of the length end a step with `lambda > 0`: intermediate states need no accuracy.
const INTERMEDIATE_TOLERANCE: f64 = 1e-6;
/// Corrections below this fraction of the length that no longer decrease are rounding errors of a fine mesh.
const STALLED: f64 = 1e-5;
/// Ratio to the previous correction above which a correction no longer decreases: Newton's method converges faster.
const STALLED_RATIO: f64 = 0.3;
/// Largest correction over the rod's length (rad for angles); a larger one fails the step.
const LARGEST_CORRECTION: f64 = 2.0;
/// Largest number of steps of a descent, failed ones included.
const STEPS: usize = 400;
/// Factor on `lambda` after a successful step. Closer to 1: more steps; smaller: more failed steps.
const DECREASE: f64 = 0.1;
/// Factor on `lambda` after the first successful step that follows a failure.
const CAREFUL_DECREASE: f64 = 0.5;
/// Factor on `lambda` after a failed step.
const INCREASE: f64 = 4.0;
/// Approximate displacement in the first step over the rod's length, from which the first `lambda` follows.
const FIRST_STEP: f64 = 0.05;
/// Number of steps that end at a saddle after which the rod is displaced.
const SADDLES: usize = 20;
/// Largest displacement from a saddle, over the rod's length: far above rounding errors, and small against the
/// deflection of a buckled rod.
const SADDLE_DISPLACEMENT: f64 = 1e-4;
/// Fraction of the first `lambda` below which it becomes zero: from there the steps are plain Newton iterations.
const SMALLEST: f64 = 1e-9;

/// An equilibrium: unknowns and frames, with the effort and the accuracy of the search.
#[derive(Clone, Debug)]
pub struct EquilibriumState<F> {
    /// The unknowns, m (rad for angles).
    pub q: Vec<f64>,
    /// The frames of the edges at `q`.
    pub frames: F,
    /// Number of Newton iterations.
    pub newton_iterations: usize,
    /// Largest unbalanced force, N.
    pub residual: f64,
}

/// Boundary conditions and scales of a descent.
pub(crate) struct DescentSettings {
    /// Range of the unknowns that move.
    pub free: Range<usize>,
    /// Unknowns in that range that stay in place.
    pub prescribed: PrescribedDofs,
    /// Length of the rod, m: the scale of the steps.
    pub length: f64,
    /// Stiffnesses that count as zero, N/m (N m for angles).
    pub negligible: Vec<f64>,
    /// Stiffnesses of springs between the unknowns and their initial values, N/m (N m for angles); empty without
    /// springs. Weak springs hold motions without resistance, such as the spin of a straight round rod.
    pub springs: Vec<f64>,
    /// Edge coordinates, for long rods.
    pub edges: Option<EdgeCoordinates>,
    /// Hand-derived or automatic derivatives.
    pub derivatives: Derivatives,
}

/// A descent: its rod, settings, current state and work arrays.
pub(crate) struct Descent<'a, R: Rod<f64>> {
    rod: &'a R,
    settings: DescentSettings,
    /// Diagonal of the metric `M`, kg (kg m^2 for angles): masses, or the metric of edge coordinates.
    metric: Vec<f64>,
    /// Current unknowns, m (rad for angles).
    q: Vec<f64>,
    /// State at the start of the step.
    step_start: Vec<f64>,
    /// State at the start of the descent, where springs are stress-free.
    initial: Vec<f64>,
    /// Gradient of the energy at the current state, N (N m for angles).
    gradient: Vec<f64>,
    /// Tangent at the current state, N/m (N m for angles), without springs.
    tangent: R::Tangent,
    /// Factors of the matrix of the last iteration.
    factors: FactorsOf<R, f64>,
    /// Right-hand side, then correction of the unknowns.
    correction: Vec<f64>,
    /// Number of Newton iterations so far.
    iterations: usize,
}

/// Outcome of a step of the descent.
enum DescentStep {
    /// The state changed.
    Moved,
    /// The state did not change, or, without `lambda`, it is an equilibrium.
    Stationary,
    /// Newton's method did not converge, or not to a minimum.
    Failed,
    /// The start is a saddle: the energy decreases along some motion.
    Saddle,
}

impl<'a, R: Rod<f64>> Descent<'a, R> {
    /// A descent of `rod` from the unknowns `q`, m (rad for angles), where springs are stress-free. The metric is the
    /// masses, or with edge coordinates in `settings` their [weights](EdgeCoordinates::metric). Nothing is evaluated
    /// yet.
    pub fn new(rod: &'a R, settings: DescentSettings, q: Vec<f64>) -> Self {
        let (n, tangent) = (q.len(), rod.zero_tangent());
        Self {
            rod,
            metric: match &settings.edges {
                Some(edges) => edges.metric(rod),
                None => rod.mass().to_vec(),
            },
            settings,
            step_start: q.clone(),
            initial: q.clone(),
            q,
            gradient: vec![0.0; n],
            factors: tangent.new_factors(),
            tangent,
            correction: vec![0.0; n],
            iterations: 0,
        }
    }

    /// Overwrites gradient and tangent with the derivatives of the energy at the current state, whose angles are
    /// measured from `frames`. The gradient includes the springs to the initial state; their stiffness is added to the
    /// tangent when it is factored. Prescribed unknowns get a zero gradient and are decoupled in the tangent. In edge
    /// coordinates the tangent is with respect to edge vectors, the gradient with respect to nodes.
    fn assemble(&mut self, frames: &R::Frames) {
        let (q, settings, tangent) = (&self.q, &self.settings, &mut self.tangent);
        let derivatives = settings.derivatives;
        // Edge coordinates have the tangent by edge vectors, and forces by nodes.
        if settings.edges.is_some() {
            self.rod.gradient(q, frames, derivatives, &mut self.gradient);
            self.rod.edge_tangent(q, frames, derivatives, tangent);
        } else {
            self.rod.tangent(q, frames, derivatives, &mut self.gradient, tangent);
        }
        for (i, spring) in settings.springs.iter().enumerate() {
            self.gradient[i] += spring * (self.q[i] - self.initial[i]);
        }
        settings.prescribed.fill(&mut self.gradient, 0.0);
        settings.prescribed.eliminate_rows_and_columns(&mut self.tangent);
    }

    /// The largest absolute unbalanced force on a free unknown, N (N m for angles), of the last assembled gradient; NaN
    /// if any of them is NaN.
    fn residual(&self) -> f64 {
        self.free()
            .map(|i| self.gradient[i].abs())
            .fold(0.0, |largest, force| if force.is_nan() { force } else { largest.max(force) })
    }

    /// The range of the unknowns that move; prescribed unknowns may be inside it.
    fn free(&self) -> Range<usize> {
        self.settings.free.clone()
    }

    /// The equilibrium that the descent reaches from its initial unknowns, whose angles are measured from `frames`. The
    /// first `lambda` is the largest `|g_i|/m_i` (times the length for angles) over [`FIRST_STEP`] lengths, with
    /// gradient `g` and masses `m`. The frames move with every step, so that angles of the result are measured from the
    /// frames at the equilibrium. The residual includes the forces of springs. The unknowns of this descent are moved
    /// out: it can be used once.
    ///
    /// # Errors
    /// [`Error::Equilibrium`] with iterations and residual after [`STEPS`] steps, failed ones included.
    pub fn descend(&mut self, mut frames: R::Frames) -> Result<EquilibriumState<R::Frames>, Error> {
        self.assemble(&frames);
        // The first lambda limits the first step to about a part of the rod's length.
        let length = self.settings.length;
        let acceleration = |i: usize| {
            let acceleration = self.gradient[i].abs() / self.rod.mass()[i];
            if self.rod.has_angle_at(i) { acceleration * length } else { acceleration }
        };
        let first = self.free().map(acceleration).fold(0.0, f64::max) / (FIRST_STEP * length);
        // An implicit gradient descent with a step of about 1/lambda.
        let mut lambda = first;
        let mut decrease = DECREASE;
        let mut saddles = 0;
        for _ in 0..STEPS {
            self.step_start.copy_from_slice(&self.q);
            let step = match self.step(&frames, lambda) {
                DescentStep::Moved
                    if self.rod.folded_node(&self.step_start, &self.q, &frames).is_some() =>
                {
                    DescentStep::Failed
                }
                // Newton iterations without lambda may lead through an obstacle or a rod, and end in an equilibrium
                // behind it.
                DescentStep::Moved | DescentStep::Stationary if self.passed_something(&frames) => {
                    DescentStep::Failed
                }
                step => step,
            };
            match step {
                // A large lambda prevents any motion. After failures with smaller ones, no motion means equilibrium.
                DescentStep::Stationary if lambda == 0.0 || decrease > DECREASE => {
                    self.rod.move_frames(&mut frames, &self.q);
                    self.assemble(&frames);
                    return Ok(EquilibriumState {
                        residual: self.residual(),
                        newton_iterations: self.iterations,
                        q: std::mem::take(&mut self.q),
                        frames,
                    });
                }
                DescentStep::Moved | DescentStep::Stationary => {
                    self.rod.move_frames(&mut frames, &self.q);
                    // A good step: lambda decreases, and the descent comes closer to Newton's
                    // method.
                    lambda *= decrease;
                    decrease = DECREASE;
                    if lambda < SMALLEST * first {
                        lambda = 0.0;
                    }
                }
                DescentStep::Failed | DescentStep::Saddle => {
                    // A bad step is repeated from its start, with a larger lambda.
                    self.q.copy_from_slice(&self.step_start);
                    saddles += usize::from(matches!(step, DescentStep::Saddle));
                    // Many attempts that end at a saddle: symmetry holds the rod there.
                    if saddles == SADDLES {
                        self.leave_saddle();
                    }
                    lambda = (lambda * INCREASE).max(SMALLEST * first);
                    decrease = CAREFUL_DECREASE;
                }
            }
        }
        self.assemble(&frames);
        Err(Error::Equilibrium { iterations: self.iterations, residual: self.residual() })
    }

    /// Whether the last step led a rod through an obstacle or another rod.
    fn passed_something(&self, frames: &R::Frames) -> bool {
        let (before, now) = (&self.step_start, &self.q);
        self.rod.passed_obstacle(before, now, frames).is_some()
            || self.rod.passed_rod(before, now, frames).is_some()
    }

    /// Solves one step of the descent with this `lambda`, 1/s^2, from the current state by Newton's method, at most
    /// [`ITERATIONS`] iterations; overwrites the unknowns. `Stationary`: the first correction is below
    /// [`STEP_TOLERANCE`], or without `lambda` corrections or forces are rounding errors. `Moved`: with `lambda`, a
    /// correction below [`INTERMEDIATE_TOLERANCE`], or a stalled one below [`STALLED`], at a minimum of the step.
    /// `Saddle`: the matrix is indefinite at the start. `Failed`: a singular matrix, a correction above
    /// [`LARGEST_CORRECTION`], no convergence, or an indefinite matrix at the end.
    fn step(&mut self, frames: &R::Frames, lambda: f64) -> DescentStep {
        let (edges, length) = (self.settings.edges, self.settings.length);
        let mut previous = f64::INFINITY;
        for iteration in 0..ITERATIONS {
            self.assemble(frames);
            self.iterations += 1;
            // K + lambda M, and the springs if there are any.
            let springs = self.settings.springs.iter().zip(&self.metric);
            let with_springs: Vec<f64> = springs.map(|(k, m)| k + lambda * m).collect();
            let (added, weight) =
                if with_springs.is_empty() { (&self.metric, lambda) } else { (&with_springs, 1.0) };
            let free = self.free();
            let factored = self.factors.factor_sum(added, weight, &self.tangent, 1.0, free).is_ok();
            // Where the tangent is not positive definite, the step would increase the energy.
            let downhill = factored && self.is_minimum(lambda);
            // Along motions without resistance, corrections are quotients of rounding errors and do not converge.
            // Forces below rounding errors are an equilibrium.
            let check_forces = iteration == if downhill { PATIENCE } else { 0 };
            if check_forces && lambda == 0.0 && edges.is_none() && self.is_balanced() {
                return DescentStep::Stationary;
            }
            if !factored || iteration == 0 && !downhill {
                return if factored { DescentStep::Saddle } else { DescentStep::Failed };
            }
            // Right-hand side -(dE/dq + lambda M (q - q0)).
            self.correction.copy_from_slice(&self.gradient);
            if let Some(edges) = edges {
                edges.edge_forces::<f64, R>(&mut self.correction);
            }
            for i in self.free() {
                let change = match edges {
                    Some(edges) => edges.change::<R>(i, &self.q, &self.step_start),
                    None => self.q[i] - self.step_start[i],
                };
                self.correction[i] = -(self.correction[i] + lambda * self.metric[i] * change);
            }
            self.factors.solve(&mut self.correction);
            if let Some(edges) = edges {
                edges.node_changes::<f64, R>(&mut self.correction);
            }
            // The size of the correction over the length of the rod, angles in rad.
            let mut largest = 0.0_f64;
            for i in self.free() {
                self.q[i] += self.correction[i];
                let unit = if self.rod.has_angle_at(i) { 1.0 } else { length.recip() };
                let size = self.correction[i].abs() * unit;
                if size > largest || size.is_nan() {
                    largest = size;
                }
            }
            // A correction beyond the size of the rod is outside the range of the linearization.
            if largest.is_nan() || largest > LARGEST_CORRECTION {
                return DescentStep::Failed;
            }
            if iteration == 0 && largest < STEP_TOLERANCE {
                return DescentStep::Stationary;
            }
            // Corrections that are small and no longer decrease are rounding errors.
            let stalled = largest < STALLED && largest > STALLED_RATIO * previous;
            match lambda > 0.0 {
                _ if !(stalled || largest < INTERMEDIATE_TOLERANCE) => {}
                _ if !downhill => return DescentStep::Failed,
                true => return DescentStep::Moved,
                false if stalled || largest < STEP_TOLERANCE => return DescentStep::Stationary,
                false => {}
            }
            previous = largest;
        }
        DescentStep::Failed
    }

    /// Displaces the free unknowns of the current state along the softest motion of the last factored matrix. It is
    /// found by two inverse iterations from a fixed vector without symmetry. The motion is scaled so that the largest
    /// displacement, or angle times the rod's length, is [`SADDLE_DISPLACEMENT`] of that length. Nothing moves if the
    /// scale is not finite.
    fn leave_saddle(&mut self) {
        // Fractional parts of multiples of the golden ratio: a start vector without any symmetry.
        for (i, x) in self.correction.iter_mut().enumerate() {
            *x = (1.618_033_988_749_895 * i as f64).fract() - 0.5;
        }
        // Two inverse iterations: enough to dominate by the softest motion.
        for _ in 0..2 {
            self.settings.prescribed.fill(&mut self.correction, 0.0);
            self.factors.solve(&mut self.correction);
        }
        if let Some(edges) = self.settings.edges {
            edges.node_changes::<f64, R>(&mut self.correction);
        }
        let length = self.settings.length;
        let unit = |i: usize| if self.rod.has_angle_at(i) { length } else { 1.0 };
        let sizes = self.correction.iter().enumerate().map(|(i, x)| x.abs() * unit(i));
        let scale = SADDLE_DISPLACEMENT * length / sizes.fold(0.0, f64::max);
        if scale.is_finite() {
            self.free().for_each(|i| self.q[i] += scale * self.correction[i]);
        }
    }

    /// Whether the force on every free unknown is at most its rounding level: [`ROUNDING`] times `eps` times `(|K|
    /// |q|)_i`, with gradient and tangent assembled last. Overwrites `correction`.
    fn is_balanced(&mut self) -> bool {
        self.tangent.absolute_product(&self.q, &mut self.correction);
        let level = |i: usize| ROUNDING * f64::EPSILON * self.correction[i];
        self.free().all(|i| self.gradient[i].abs() <= level(i))
    }

    /// Whether `K + lambda M` (and springs), as factored last, has no negative pivots, and so is positive definite. If
    /// it has some, `K + lambda M` plus the negligible stiffnesses, without the springs, is factored for this test: the
    /// result is whether that one is positive definite.
    fn is_minimum(&mut self, lambda: f64) -> bool {
        if self.factors.negative_pivots() == 0 {
            return true;
        }
        // A second factorization with the negligible stiffness, for rods with motions without
        // resistance.
        let added: Vec<f64> = self
            .metric
            .iter()
            .zip(&self.settings.negligible)
            .map(|(m, k)| lambda * m + k)
            .collect();
        let mut factors = self.factors.clone();
        factors.factor_sum(&added, 1.0, &self.tangent, 1.0, self.free()).is_ok()
            && factors.negative_pivots() == 0
    }
}
