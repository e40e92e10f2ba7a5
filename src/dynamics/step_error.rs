//! Estimated error of a time step that the user gave, from the curvature of the motion in time.
//!
//! A second-order scheme turns a vibration of amplitude `a` and angular frequency `w` too slowly, by `(w h)^2/12` of
//! the phase for the trapezoidal rule with the step `h`. After the time `T` it is off by `a w^3 h^2 T/12`. The third
//! differences of a position over the steps add up to `(2/pi) a w^3 h^2 T`, so that their sum times `pi/24` is this
//! error, of any motion that is a sum of vibrations. Newmark-beta with `beta > 0.5` also loses amplitude, in proportion
//! to the second differences. Positions are smoothed over three states, which removes vibrations that alternate from
//! step to step. With steps too long for these estimates the sums are large as well.
//!
//! [`StepError`] takes positions, m, of nodes at quarters of the length. `estimate` is the error, m; `warning` has code
//! and text if it exceeds [`MAX_OF_LENGTH`] of the length of the rod, or [`MAX_OF_EXTENT`] of the largest displacement.
//! There is none for steps that the program chose, schemes of other orders or explicit ones, and recorded ends, whose
//! noise has differences of its own.

use crate::code::Code;
use crate::numerics::vector::{norm, sub};
use crate::scene::{End, Scene, Scheme, Support};
use std::f64::consts::PI;

/// Largest estimated error without a warning, over the length of the rod.
const MAX_OF_LENGTH: f64 = 0.02;
/// The same over the largest displacement of a node from its start.
const MAX_OF_EXTENT: f64 = 0.1;
/// Largest displacement over the length that counts as motion.
const MIN_EXTENT: f64 = 1e-6;
/// Coefficient of `r^2` in the phase error of generalised-alpha over that of the trapezoidal rule, `1 + 4.5 r^2`. Here
/// `r` is `(1 - rho_inf)/(1 + rho_inf)`. It follows from the eigenvalues of the amplification matrix for short steps.
const DISSIPATIVE_PHASE: f64 = 4.5;
/// Weights of the second differences of positions smoothed by (1, 2, 1)/4.
const SECOND: [f64; 6] = [0.0, 0.25, 0.0, -0.5, 0.0, 0.25];
/// Weights of their third differences.
const THIRD: [f64; 6] = [-0.25, 0.25, 0.5, -0.5, -0.25, 0.25];

/// Sums of differences of positions over the steps of a run.
#[derive(Clone, Debug, Default)]
pub(crate) struct StepError {
    /// Time step, s.
    step: f64,
    /// Length of the rod, m.
    length: f64,
    /// Factors of the sums of second and third differences.
    factors: [f64; 2],
    /// Nodes at quarters of the length; empty without an estimate.
    nodes: Vec<TrackedNode>,
    /// Time of the last state, s.
    time: Option<f64>,
}

/// A node with the sums of its differences so far.
#[derive(Clone, Debug, Default)]
struct TrackedNode {
    /// Index of the node.
    node: usize,
    /// Position at the start, m.
    start: [f64; 3],
    /// The last six positions, m, the latest one last.
    last: [[f64; 3]; 6],
    /// Number of states so far.
    states: usize,
    /// Sums of the absolute second and third differences, m.
    sums: [f64; 2],
    /// Largest distance from the start, m.
    extent: f64,
}

/// All estimates are equal, so that they do not distinguish reports.
impl PartialEq for StepError {
    /// True for any two estimates.
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

impl StepError {
    /// For a rod of `scene` with `nodes` nodes and the `length`, m. The default, which never warns, where there is no
    /// estimate: without a given step, with ends that follow a recording, and for schemes other than Newmark-beta,
    /// generalised-alpha and average vector field.
    pub fn new(scene: &Scene, nodes: usize, length: f64) -> Self {
        Self::of_given_step(scene, nodes, length).unwrap_or_default()
    }

    /// As [`new`](Self::new); `None` where there is no estimate.
    fn of_given_step(scene: &Scene, nodes: usize, length: f64) -> Option<Self> {
        let time = scene.time.as_ref()?;
        let step = time.step.filter(|_| !scene.chosen().step)?;
        let phase = 1.0 / 12.0;
        let factors = match time.scheme {
            Scheme::NewmarkBeta => [time.beta - 0.5, phase],
            Scheme::AverageVectorField => [0.0, phase],
            Scheme::GeneralisedAlpha => {
                let ratio = (1.0 - time.rho_inf) / (1.0 + time.rho_inf);
                [0.0, phase * (1.0 + DISSIPATIVE_PHASE * ratio * ratio)]
            }
            Scheme::Rodas4 | Scheme::Verlet | Scheme::Pefrl => return None,
        };
        let is_recorded = |end| scene.supports.at(end) == Support::Recorded;
        if is_recorded(End::Start) || is_recorded(End::End) {
            return None;
        }
        let node =
            |quarter| TrackedNode { node: quarter * (nodes - 1) / 4, ..TrackedNode::default() };
        let followed = (1..=4).map(node).collect();
        Some(Self { step, length, factors, nodes: followed, time: None })
    }

    /// Adds the state at `time`, s, with the positions of the nodes, m. States that do not follow the last one by a
    /// full step are skipped.
    pub fn add(&mut self, time: f64, position: impl Fn(usize) -> [f64; 3]) {
        let is_next = |last: f64| (time - last - self.step).abs() < 1e-6 * self.step;
        if self.nodes.is_empty() || !self.time.is_none_or(is_next) {
            return;
        }
        self.time = Some(time);
        for own in &mut self.nodes {
            own.add(position(own.node));
        }
    }

    /// The estimated error of the position of the node where it is largest, m.
    pub fn estimate(&self) -> f64 {
        let error = |own: &TrackedNode| {
            PI / 2.0 * (0..2).map(|i| self.factors[i] * own.sums[i]).sum::<f64>()
        };
        self.nodes.iter().map(error).fold(0.0, f64::max)
    }

    /// Largest displacement of a node from its start, m.
    fn extent(&self) -> f64 {
        self.nodes.iter().map(|own| own.extent).fold(0.0, f64::max)
    }

    /// The estimated error over the largest one without a warning; 0 without motion.
    pub fn excess(&self) -> f64 {
        let extent = self.extent();
        let most = (MAX_OF_LENGTH * self.length).min(MAX_OF_EXTENT * extent);
        if extent > MIN_EXTENT * self.length { self.estimate() / most } else { 0.0 }
    }

    /// Code and text of the warning of a run with the states so far. `None` up to the limit, and without motion.
    pub fn warning(&self) -> Option<(Code, String)> {
        let excess = self.excess();
        (excess > 1.0).then(|| (Code::CoarseStep, self.words(excess)))
    }

    /// The warning for an error of `excess` times the limit.
    fn words(&self, excess: f64) -> String {
        let (error, extent) = (self.estimate(), self.extent());
        // The error of a dissipative beta is proportional to the step, the others to its square. A large loss of
        // amplitude is smaller than in proportion, so that its step has a larger margin.
        let [order, margin] = if self.factors[0] > 0.0 { [1.0, 0.4] } else { [0.5, 0.8] };
        let step = margin * self.step / excess.powf(order);
        // Rounded down to one digit.
        let decade = 10.0_f64.powf(step.log10().floor());
        let step = decade * (step / decade).floor();
        // An error of the size of the motion means only that the motion is not resolved.
        let found = match error < 0.5 * extent {
            true => format!(
                "has an estimated error of {error:.1e} m, {:.0} % of the largest displacement",
                100.0 * error / extent
            ),
            false => "does not resolve the motion".into(),
        };
        format!(
            "the given time step of {:.2e} s {found}. Use time.step = {step:.0e} or less, or omit time.step and \
             time.scheme to let the program choose them",
            self.step
        )
    }
}

impl TrackedNode {
    /// Adds the next position, m.
    fn add(&mut self, position: [f64; 3]) {
        if self.states == 0 {
            self.start = position;
        }
        self.last.rotate_left(1);
        self.last[5] = position;
        self.states += 1;
        self.extent = self.extent.max(norm(sub(position, self.start)));
        // Second differences of smoothed positions need five states, third ones six.
        if self.states >= 5 {
            self.sums[0] += self.difference(SECOND);
        }
        if self.states >= 6 {
            self.sums[1] += self.difference(THIRD);
        }
    }

    /// Length of the sum of the last positions with these weights, m.
    fn difference(&self, weights: [f64; 6]) -> f64 {
        norm([0, 1, 2].map(|c| (0..6).map(|i| weights[i] * self.last[i][c]).sum()))
    }
}
