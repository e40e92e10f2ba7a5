//! The way down: how a rod creeps into an equilibrium.
//!
//! Plain Newton dies where the loads bend a stiff rod far: the first step stretches it beyond all
//! measure. Instead the rod creeps down its energy by pseudo-transient continuation (Kelley and Keyes
//! 1998, doi:10.1137/S0036142996304796),
//!
//! ```text
//! lambda M (q1 - q0) + dE/dq(q1) = 0
//! ```
//!
//! an implicit step of gradient descent in the metric `M`, solved by Newton's method on the exact tangent, and
//! `lambda` falls by a factor from step to step until it is zero: the last steps are Newton's own,
//! on the equilibrium itself, until the corrections are rounding errors. A step that Newton cannot
//! solve, or that ends where `K + lambda M` is not positive definite, is repeated with a larger
//! `lambda`. A rod that stands exactly upright stays there; the least asymmetry lets it fall. One that creeps
//! towards such a place, as a rod does that nothing leads out of a plane, is moved a little aside. A
//! long rod that hangs from one end takes these steps in [edge
//! coordinates](crate::statics::edge_coordinates), with another `M`.

use crate::energy::Derivatives;
use crate::error::Error;
use crate::numerics::prescribed_dofs::PrescribedDofs;
use crate::numerics::tangent::{Factors, Tangent};
use crate::rod::{FactorsOf, Rod};
use crate::statics::edge_coordinates::EdgeCoordinates;
use std::ops::Range;

/// Newton iterations of one step of the descent.
const ITERATIONS: usize = 20;
/// Iterations after which a step without `lambda` that is in balance to rounding may end.
const PATIENCE: usize = 10;
/// Forces count as rounding below this many times `eps * sum |K_ij| |q_j|`.
const ROUNDING: f64 = 8.0;
/// Corrections below this part of the rod's length are none.
const NONE: f64 = 1e-13;
/// Corrections below this part end a step of the descent: the way matters little.
const ON_THE_WAY: f64 = 1e-6;
/// Corrections below this part that fall no more are the rounding errors of a fine mesh.
const STALLED: f64 = 1e-5;
/// Steps of the descent, failures included.
const STEPS: usize = 400;
/// Factor by which `lambda` falls after a step, and rises after a failure.
const FALL: f64 = 0.1;
const RISE: f64 = 4.0;
/// The first step goes about this part of the rod's length.
const FIRST_STEP: f64 = 0.05;
/// After so many steps refused where the energy also falls to a side, the rod is moved by this part of its length.
const SADDLE: usize = 20;
const ASIDE: f64 = 1e-4;
/// Below this part of the first `lambda` the descent is Newton's method.
const SMALLEST: f64 = 1e-9;

/// Unknowns and frames at rest.
#[derive(Clone, Debug)]
pub struct EquilibriumState<F> {
    /// The unknowns at rest, m (rad for angles).
    pub q: Vec<f64>,
    /// Frames, moved to `q`.
    pub frames: F,
    /// Newton iterations it took.
    pub newton_iterations: usize,
    /// Largest force out of balance, N.
    pub residual: f64,
}

/// The descent and the room it needs.
pub(crate) struct Descent<'a, R: Rod<f64>> {
    rod: &'a R,
    free: Range<usize>,
    /// Those among them that stay where they are.
    led: PrescribedDofs,
    length: f64,
    derivatives: Derivatives,
    /// Stiffnesses that count as none, N/m (N m for angles).
    negligible: Vec<f64>,
    edges: Option<EdgeCoordinates>,
    /// Stiffnesses of springs to where the unknowns began, N/m (N m for angles); none of most.
    springs: Vec<f64>,
    /// What `lambda` multiplies: masses, or the metric of the edges.
    metric: Vec<f64>,
    q: Vec<f64>,
    start: Vec<f64>,
    /// Where springs hold the unknowns.
    begun: Vec<f64>,
    gradient: Vec<f64>,
    tangent: R::Tangent,
    factors: FactorsOf<R, f64>,
    correction: Vec<f64>,
    iterations: usize,
}

/// How a step of the descent ended.
enum Step {
    /// Elsewhere.
    Moved,
    /// Where it began, or, without `lambda`, in balance.
    Still,
    /// Newton did not converge, or not to a minimum.
    Failed,
    /// The energy falls to a side of where it began.
    Saddle,
}

impl<'a, R: Rod<f64>> Descent<'a, R> {
    /// A rod at `q` of which only the unknowns in `free` move. `length`, m, is the scale of the
    /// steps; stiffnesses below `negligible`, N/m (N m for angles), count as none. With
    /// `edges` it is solved in edge coordinates.
    pub fn new(
        rod: &'a R,
        free: Range<usize>,
        (length, negligible): (f64, Vec<f64>),
        edges: Option<EdgeCoordinates>,
        derivatives: Derivatives,
        q: Vec<f64>,
    ) -> Self {
        let n = q.len();
        Self {
            rod,
            free,
            led: PrescribedDofs::default(),
            length,
            derivatives,
            negligible,
            metric: edges.map_or_else(|| rod.mass().to_vec(), |edges| edges.metric(rod)),
            edges,
            springs: Vec::new(),
            start: q.clone(),
            begun: Vec::new(),
            q,
            gradient: vec![0.0; n],
            tangent: Tangent::zeros(n),
            factors: Factors::with_order(n),
            correction: vec![0.0; n],
            iterations: 0,
        }
    }

    /// Holds all unknowns by springs to where they are, N/m (N m for angles): weak ones hold what nothing
    /// else does, as the turn of a straight round rod about itself.
    pub fn holding(mut self, springs: Vec<f64>) -> Self {
        self.springs = springs;
        self.begun.clone_from(&self.q);
        self
    }

    /// Leaves unknowns among the free ones where they are.
    pub fn leading(self, led: PrescribedDofs) -> Self {
        Self { led, ..self }
    }

    fn assemble(&mut self, frames: &R::Frames) {
        let (q, derivatives, tangent) = (&self.q, self.derivatives, &mut self.tangent);
        if self.edges.is_some() {
            self.rod.gradient(q, frames, derivatives, &mut self.gradient);
            self.rod.edge_tangent(q, frames, derivatives, tangent);
        } else {
            self.rod.tangent(q, frames, derivatives, &mut self.gradient, tangent);
        }
        for (i, spring) in self.springs.iter().enumerate() {
            self.gradient[i] += spring * (self.q[i] - self.begun[i]);
        }
        self.led.fill(&mut self.gradient, 0.0);
        self.led.uncouple(&mut self.tangent);
    }

    /// The largest force out of balance, N.
    fn residual(&self) -> f64 {
        self.free
            .clone()
            .map(|i| self.gradient[i].abs())
            .fold(0.0, |largest, force| if force.is_nan() { force } else { largest.max(force) })
    }

    /// The equilibrium below, angles measured from `frames` at the start.
    pub fn descend(&mut self, mut frames: R::Frames) -> Result<EquilibriumState<R::Frames>, Error> {
        self.assemble(&frames);
        let acceleration = self
            .free
            .clone()
            .map(|i| self.gradient[i].abs() / self.rod.mass()[i])
            .zip(self.free.clone())
            .map(|(a, i)| if R::is_angle(i) { a * self.length } else { a })
            .fold(0.0, f64::max);
        let first = acceleration / (FIRST_STEP * self.length);
        let mut lambda = first;
        let mut fall = FALL;
        let mut saddles = 0;
        for _ in 0..STEPS {
            self.start.copy_from_slice(&self.q);
            let step = match self.step(&frames, lambda) {
                Step::Moved if self.rod.folded(&self.start, &self.q, &frames).is_some() => {
                    Step::Failed
                }
                step => step,
            };
            match step {
                // A large lambda holds everything still; one that cannot be much smaller holds
                // only what is in balance.
                Step::Still if lambda == 0.0 || fall > FALL => {
                    R::rebase(&mut frames, &self.q);
                    self.assemble(&frames);
                    return Ok(EquilibriumState {
                        residual: self.residual(),
                        newton_iterations: self.iterations,
                        q: std::mem::take(&mut self.q),
                        frames,
                    });
                }
                Step::Moved | Step::Still => {
                    R::rebase(&mut frames, &self.q);
                    lambda *= fall;
                    fall = FALL;
                    if lambda < SMALLEST * first {
                        lambda = 0.0;
                    }
                }
                Step::Failed | Step::Saddle => {
                    self.q.copy_from_slice(&self.start);
                    saddles += usize::from(matches!(step, Step::Saddle));
                    if saddles == SADDLE {
                        self.move_aside();
                    }
                    lambda = (lambda * RISE).max(SMALLEST * first);
                    fall = 0.5;
                }
            }
        }
        self.assemble(&frames);
        Err(Error::Equilibrium { iterations: self.iterations, residual: self.residual() })
    }

    /// Solves one step of the descent from `start`.
    fn step(&mut self, frames: &R::Frames, lambda: f64) -> Step {
        let mut before = f64::INFINITY;
        for iteration in 0..ITERATIONS {
            self.assemble(frames);
            self.iterations += 1;
            let free = self.free.clone();
            let held = self.springs.iter().zip(&self.metric).map(|(k, m)| k + lambda * m);
            let held: Vec<f64> = held.collect();
            let (added, weight) =
                if held.is_empty() { (&self.metric, lambda) } else { (&held, 1.0) };
            let factored = self.factors.factor_sum(added, weight, &self.tangent, 1.0, free).is_ok();
            // A step from a maximum along some direction would go up it.
            let downhill = factored && self.is_minimum(lambda);
            // Where nothing, or only upwards, resists, corrections are rounding errors over almost
            // nothing. What is in balance to rounding is in balance.
            let patient = iteration == if downhill { PATIENCE } else { 0 };
            if patient && lambda == 0.0 && self.edges.is_none() && self.in_balance() {
                return Step::Still;
            }
            if !factored || iteration == 0 && !downhill {
                return if factored { Step::Saddle } else { Step::Failed };
            }
            self.correction.copy_from_slice(&self.gradient);
            if let Some(edges) = self.edges {
                edges.gather::<f64, R>(&mut self.correction);
            }
            for i in self.free.clone() {
                let change = match self.edges {
                    Some(edges) => edges.change::<R>(i, &self.q, &self.start),
                    None => self.q[i] - self.start[i],
                };
                self.correction[i] = -(self.correction[i] + lambda * self.metric[i] * change);
            }
            self.factors.solve(&mut self.correction);
            if let Some(edges) = self.edges {
                edges.spread::<f64, R>(&mut self.correction);
            }
            let mut largest = 0.0_f64;
            for i in self.free.clone() {
                self.q[i] += self.correction[i];
                let unit = if R::is_angle(i) { 1.0 } else { self.length.recip() };
                let size = self.correction[i].abs() * unit;
                if size > largest || size.is_nan() {
                    largest = size;
                }
            }
            if largest.is_nan() || largest > 2.0 {
                return Step::Failed;
            }
            if iteration == 0 && largest < NONE {
                return Step::Still;
            }
            let stalled = largest < STALLED && largest > 0.3 * before;
            match lambda > 0.0 {
                _ if !(stalled || largest < ON_THE_WAY) => {}
                _ if !downhill => return Step::Failed,
                true => return Step::Moved,
                false if stalled || largest < NONE => return Step::Still,
                false => {}
            }
            before = largest;
        }
        Step::Failed
    }

    /// Moves the rod a little along what gives way most, of what was factored last, without regard to any symmetry.
    fn move_aside(&mut self) {
        // Numbers without a pattern: multiples of the golden ratio, without their whole parts.
        for (i, x) in self.correction.iter_mut().enumerate() {
            *x = (1.618_033_988_749_895 * i as f64).fract() - 0.5;
        }
        for _ in 0..2 {
            self.led.fill(&mut self.correction, 0.0);
            self.factors.solve(&mut self.correction);
        }
        if let Some(edges) = self.edges {
            edges.spread::<f64, R>(&mut self.correction);
        }
        let unit = |i: usize| if R::is_angle(i) { self.length } else { 1.0 };
        let sizes = self.correction.iter().enumerate().map(|(i, x)| x.abs() * unit(i));
        let scale = ASIDE * self.length / sizes.fold(0.0, f64::max);
        if scale.is_finite() {
            self.free.clone().for_each(|i| self.q[i] += scale * self.correction[i]);
        }
    }

    /// Whether all forces are rounding errors of the terms that make them.
    fn in_balance(&mut self) -> bool {
        self.tangent.absolute_product(&self.q, &mut self.correction);
        let level = |i: usize| ROUNDING * f64::EPSILON * self.correction[i];
        self.free.clone().all(|i| self.gradient[i].abs() <= level(i))
    }

    /// Whether the factored matrix, or that with the least stiffness that tells anything, is
    /// positive definite.
    fn is_minimum(&mut self, lambda: f64) -> bool {
        if self.factors.negative_pivots() == 0 {
            return true;
        }
        let added: Vec<f64> =
            self.metric.iter().zip(&self.negligible).map(|(m, k)| lambda * m + k).collect();
        let (mut factors, free) = (self.factors.clone(), self.free.clone());
        factors.factor_sum(&added, 1.0, &self.tangent, 1.0, free).is_ok()
            && factors.negative_pivots() == 0
    }
}
