//! Where a rod comes to rest, and whether it stays there.
//!
//! Plain Newton dies where the loads bend a stiff rod far: the first step stretches it beyond all
//! measure. Instead the rod creeps down its energy,
//!
//! ```text
//! lambda M (q1 - q0) + dE/dq(q1) = 0
//! ```
//!
//! an implicit step of the gradient flow, solved by Newton's method on the exact tangent, and
//! `lambda` falls by a factor from step to step until it is zero: the last steps are Newton's own,
//! on the equilibrium itself, until the corrections are rounding errors. A step that Newton cannot
//! solve, or that ends where `K + lambda M` is not positive definite, is repeated with a larger
//! `lambda`. A rod that stands exactly upright stays there; the least asymmetry lets it fall.
//!
//! An equilibrium is stable when its tangent has no negative eigenvalue; their number is that of
//! the negative pivots (Sylvester's law of inertia).

use crate::banded::{BandMatrix, Ldlt};
use crate::energy::Derivatives;
use crate::error::Error;
use crate::model::{Model, SpatialModel};
use crate::problem::{AnyProblem, Posed, Problem};
use crate::rod::{Energies, Rod};
use serde::Serialize;
use std::ops::Range;

/// Newton iterations of one step of the flow.
const ITERATIONS: usize = 20;
/// Corrections below this part of the rod's length are none.
const NONE: f64 = 1e-13;
/// Corrections below this part end a step of the flow: the way matters little.
const ON_THE_WAY: f64 = 1e-6;
/// Corrections below this part that fall no more are the rounding errors of a fine mesh.
const STALLED: f64 = 1e-5;
/// Steps of the flow, failures included.
const FLOW_STEPS: usize = 400;
/// Factor by which `lambda` falls after a step, and rises after a failure.
const FALL: f64 = 0.1;
const RISE: f64 = 4.0;
/// The first step goes about this part of the rod's length.
const FIRST_STEP: f64 = 0.05;
/// Below this part of the first `lambda` the flow is Newton's method.
const SMALLEST: f64 = 1e-9;

/// A rod at rest.
#[derive(Clone, Debug, Serialize)]
pub struct Equilibrium {
    /// `planar` or `spatial`.
    pub model: &'static str,
    /// Position of the last node, m.
    pub tip: [f64; 3],
    /// Total energy, elastic and of the loads, J.
    pub energy: f64,
    /// The energy by terms, J.
    pub energies: Energies,
    /// Newton iterations.
    pub newton_iterations: usize,
    /// Largest force out of balance, N (N m for angles).
    pub residual: f64,
    /// Whether no direction leads down, out of the plane included; absent when a planar scene
    /// gives no shear modulus, without which nothing is known of what happens out of its plane.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stable: Option<bool>,
    /// Whether no direction in the plane leads down; planar models only.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stable_in_plane: Option<bool>,
    /// How many independent directions lead down, of those that were looked at.
    pub negative_directions: usize,
    /// Position of every node, m.
    pub nodes: Vec<[f64; 3]>,
}

impl std::fmt::Display for Equilibrium {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let [x, y, z] = self.tip;
        let verdict = match (self.stable, self.stable_in_plane, self.negative_directions) {
            (Some(true), ..) => "stable".to_string(),
            (None, Some(true), _) => "stable in its plane".to_string(),
            (Some(false), Some(true), n) => {
                format!("UNSTABLE out of its plane, {n} directions lead down")
            }
            (.., n) => format!("UNSTABLE, {n} directions lead down"),
        };
        writeln!(f, "{} model: {verdict}", self.model)?;
        writeln!(f, "tip ({x:.6}, {y:.6}, {z:.6}) m, energy {:.6e} J", self.energy)?;
        write!(f, "{} Newton iterations, residual {:.1e} N", self.newton_iterations, self.residual)
    }
}

/// Unknowns and frames at rest.
#[derive(Clone, Debug)]
pub struct Rest<F> {
    /// Unknowns.
    pub q: Vec<f64>,
    /// Frames, moved to `q`.
    pub frames: F,
    /// Newton iterations it took.
    pub newton_iterations: usize,
    /// Largest force out of balance, N.
    pub residual: f64,
}

impl Problem {
    /// The equilibrium that the rod creeps into from its rest shape under its loads.
    pub fn equilibrium(&self) -> Result<Equilibrium, Error> {
        match self.posed() {
            AnyProblem::Planar(posed) => {
                let (rest, mut found) = at_rest(self, &posed)?;
                let in_plane = found.negative_directions;
                found.stable_in_plane = Some(in_plane == 0);
                if self.can_twist() {
                    // The plane's directions are among those of space.
                    let model = self.spatial_model()?;
                    let spatial = self.posed_as(&model);
                    let (q, frames) = lifted(self, &posed, &spatial, &rest.q);
                    let negative = negative_directions(&spatial, &q, &frames)?;
                    found.negative_directions = negative.max(in_plane);
                    found.stable = Some(found.negative_directions == 0);
                }
                Ok(found)
            }
            AnyProblem::Spatial(posed) => {
                let (_, mut found) = at_rest(self, &posed)?;
                found.stable = Some(found.negative_directions == 0);
                Ok(found)
            }
        }
    }
}

/// A model's frames.
pub(crate) type FramesOf<M, const W: usize> = <<M as Model<W>>::Rod<f64> as Rod<f64, W>>::Frames;

/// The equilibrium of a model, without a verdict.
fn at_rest<M: Model<W>, const W: usize>(
    problem: &Problem,
    posed: &Posed<'_, M, W>,
) -> Result<(Rest<FramesOf<M, W>>, Equilibrium), Error> {
    let rest = rest(posed, problem)?;
    let energies = posed.rod().energies(&rest.q, &rest.frames);
    let nodes: Vec<[f64; 3]> =
        (0..problem.nodes()).map(|i| posed.model.position(&rest.q, i)).collect();
    let found = Equilibrium {
        model: problem.model().0,
        tip: nodes[nodes.len() - 1],
        energy: energies.total(),
        energies,
        newton_iterations: rest.newton_iterations,
        residual: rest.residual,
        stable: None,
        stable_in_plane: None,
        negative_directions: negative_directions(posed, &rest.q, &rest.frames)?,
        nodes,
    };
    Ok((rest, found))
}

/// The state a model creeps into from its rest shape.
pub fn rest<M: Model<W>, const W: usize>(
    posed: &Posed<'_, M, W>,
    problem: &Problem,
) -> Result<Rest<FramesOf<M, W>>, Error> {
    rest_of(posed, problem, &posed.rod())
}

/// The state a rod of the model, with other loads maybe, creeps into from its rest shape.
pub(crate) fn rest_of<M: Model<W>, const W: usize>(
    posed: &Posed<'_, M, W>,
    problem: &Problem,
    rod: &M::Rod<f64>,
) -> Result<Rest<FramesOf<M, W>>, Error> {
    let free = posed.free();
    let frames = posed.model.frames::<f64>();
    let mut flow = Flow::new(rod, free, problem.length(), problem.derivatives(), posed.rest());
    flow.zero = zero_frequency_squared(posed);
    flow.descend(frames)
}

/// A planar state in the unknowns of the spatial model of the same scene.
pub(crate) fn lifted<M: Model<W>, const W: usize, const V: usize>(
    problem: &Problem,
    planar: &Posed<'_, M, W>,
    spatial: &Posed<'_, SpatialModel, V>,
    state: &[f64],
) -> (Vec<f64>, FramesOf<SpatialModel, V>)
where
    SpatialModel: Model<V>,
{
    let mut q = spatial.rest();
    for i in 0..problem.nodes() {
        let x = planar.model.position(state, i);
        q[4 * i..4 * i + 3].copy_from_slice(&x);
    }
    let mut frames = spatial.model.frames::<f64>();
    <<SpatialModel as Model<V>>::Rod<f64> as Rod<f64, V>>::rebase(&mut frames, &q);
    (q, frames)
}

/// How many directions lead down from a state. A direction along which nothing changes, such as
/// the spin of a straight rod between hinges, does not count: the tangent is shifted by
/// [`zero_frequency_squared`].
fn negative_directions<M: Model<W>, const W: usize>(
    posed: &Posed<'_, M, W>,
    q: &[f64],
    frames: &FramesOf<M, W>,
) -> Result<usize, Error> {
    let (rod, free) = (posed.rod(), posed.free());
    let (mut gradient, mut tangent) = (vec![0.0; q.len()], BandMatrix::zeros(q.len()));
    rod.tangent(q, frames, Derivatives::Hand, &mut gradient, &mut tangent);
    let shift = zero_frequency_squared(posed);
    let mut factors = Ldlt::with_order(q.len());
    factors
        .factor_sum(rod.mass(), shift, &tangent, 1.0, free)
        .map_err(|singular| Error::SingularTangent { time: 0.0, row: singular.row })?;
    Ok(factors.negative_pivots())
}

/// Squared frequencies below this are zero, 1/s^2: a billionth of the slowest bending vibration's,
/// or what rounding errors in a tangent that goes with the fourth power of the mesh amount to.
pub(crate) fn zero_frequency_squared<M: Model<W>, const W: usize>(posed: &Posed<'_, M, W>) -> f64 {
    let noise = f64::EPSILON * (posed.nodes() as f64).powi(4);
    posed.bending_frequency_squared() * (1e-9 + 10.0 * noise)
}

/// The descent and the room it needs.
struct Flow<'a, R, const W: usize> {
    rod: &'a R,
    free: Range<usize>,
    length: f64,
    derivatives: Derivatives,
    /// Squared frequencies below this are zero.
    zero: f64,
    q: Vec<f64>,
    start: Vec<f64>,
    gradient: Vec<f64>,
    tangent: BandMatrix<f64, W>,
    factors: Ldlt<f64, W>,
    correction: Vec<f64>,
    iterations: usize,
}

/// How a step of the flow ended.
enum Step {
    /// Elsewhere.
    Moved,
    /// Where it began, or, without `lambda`, in balance.
    Still,
    /// Newton did not converge, or not to a minimum.
    Failed,
}

impl<'a, R: Rod<f64, W>, const W: usize> Flow<'a, R, W> {
    fn new(
        rod: &'a R,
        free: Range<usize>,
        length: f64,
        derivatives: Derivatives,
        q: Vec<f64>,
    ) -> Self {
        let n = q.len();
        Self {
            rod,
            free,
            length,
            derivatives,
            zero: 0.0,
            start: q.clone(),
            q,
            gradient: vec![0.0; n],
            tangent: BandMatrix::zeros(n),
            factors: Ldlt::with_order(n),
            correction: vec![0.0; n],
            iterations: 0,
        }
    }

    fn assemble(&mut self, frames: &R::Frames) {
        self.rod.tangent(&self.q, frames, self.derivatives, &mut self.gradient, &mut self.tangent);
    }

    /// The largest force out of balance, N.
    fn residual(&self) -> f64 {
        self.free
            .clone()
            .map(|i| self.gradient[i].abs())
            .fold(0.0, |largest, force| if force.is_nan() { force } else { largest.max(force) })
    }

    fn descend(&mut self, mut frames: R::Frames) -> Result<Rest<R::Frames>, Error> {
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
        for _ in 0..FLOW_STEPS {
            self.start.copy_from_slice(&self.q);
            match self.step(&frames, lambda) {
                // A large lambda holds everything still; one that cannot be much smaller holds
                // only what is in balance.
                Step::Still if lambda == 0.0 || fall > FALL => {
                    R::rebase(&mut frames, &self.q);
                    self.assemble(&frames);
                    return Ok(Rest {
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
                Step::Failed => {
                    self.q.copy_from_slice(&self.start);
                    lambda = (lambda * RISE).max(SMALLEST * first);
                    fall = 0.5;
                }
            }
        }
        self.assemble(&frames);
        Err(Error::Equilibrium { iterations: self.iterations, residual: self.residual() })
    }

    /// Solves one step of the flow from `start`.
    fn step(&mut self, frames: &R::Frames, lambda: f64) -> Step {
        let mass = self.rod.mass();
        let mut before = f64::INFINITY;
        for iteration in 0..ITERATIONS {
            self.assemble(frames);
            self.iterations += 1;
            for i in self.free.clone() {
                let pull = lambda * mass[i] * (self.q[i] - self.start[i]);
                self.correction[i] = -(self.gradient[i] + pull);
            }
            let free = self.free.clone();
            if self.factors.factor_sum(mass, lambda, &self.tangent, 1.0, free).is_err() {
                return Step::Failed;
            }
            // A step from a maximum along some direction would go up it.
            let downhill = self.is_minimum(lambda);
            if iteration == 0 && !downhill {
                return Step::Failed;
            }
            self.factors.solve(&mut self.correction);
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

    /// Whether the factored matrix, or that with the least `lambda` that tells anything, is
    /// positive definite.
    fn is_minimum(&mut self, lambda: f64) -> bool {
        if self.factors.negative_pivots() == 0 || lambda >= self.zero {
            return self.factors.negative_pivots() == 0;
        }
        let mut factors = self.factors.clone();
        let free = self.free.clone();
        factors.factor_sum(self.rod.mass(), self.zero, &self.tangent, 1.0, free).is_ok()
            && factors.negative_pivots() == 0
    }
}
