//! Constants of the search for the numerics of a motion, for motions of few and of many modes.

use crate::accuracy::aim::is_struck;
use crate::accuracy::difference::OrderBounds;
use crate::problem::Problem;
use crate::scene::{InitialState, Scene};

/// Constants of the search, chosen on the scenes of `cargo run --release --example chosen_numerics`.
pub(super) struct Tuning {
    /// RefinedPart of the requested error that the estimate may take: estimates are off by a factor of up to two.
    pub target: f64,
    /// Growth of the work from the last trial run to the chosen one at most, where both orders are observed, and where one is
    /// assumed: the trial runs together take about twice the last one.
    pub growth_observed: f64,
    pub growth_assumed: f64,
    pub orders: OrderBounds,
    /// What is taken off an observed order for runs that are finer than those it was observed of.
    pub doubt: f64,
    /// Whether every refinement adds modes to the motion.
    pub has_many_modes: bool,
}

/// Motions of a few low modes.
const SMOOTH: Tuning = Tuning {
    target: 0.45,
    growth_observed: 16.0,
    growth_assumed: 6.0,
    orders: OrderBounds { highest: 2.0, at_once: 2.0, lowest: 0.32, assumed: 1.4 },
    doubt: 0.0,
    has_many_modes: false,
};
/// Motions of many modes: higher ones come in with every refinement.
const EXCITED: Tuning = Tuning {
    target: 0.5,
    growth_observed: 16.0,
    growth_assumed: 6.0,
    orders: OrderBounds { highest: 2.0, at_once: 1.32, lowest: 0.32, assumed: 1.32 },
    doubt: 0.1,
    has_many_modes: true,
};
/// Deflection under the weight over the length, as of small motions, beyond which a rod is limp.
const LIMP: f64 = 1.0;

impl Tuning {
    /// The constants for a scene, whose first trial problem is `guess`.
    pub fn of(scene: &Scene, guess: &Problem) -> &'static Self {
        if has_many_modes(scene, guess) { &EXCITED } else { &SMOOTH }
    }
}

/// Whether the weight of a rod bends it by more than its length.
pub(super) fn is_limp(scene: &Scene, guess: &Problem) -> bool {
    let (section, material) = scene.at(0.5);
    let moments = section.moments();
    let [i1, i2] = moments.second_moments;
    let gravity = scene.loads.gravity.iter().map(|g| g * g).sum::<f64>().sqrt();
    let weight = material.density * moments.area * gravity;
    let deflection = weight * guess.length().powi(3) / (8.0 * material.youngs_modulus * i1.min(i2));
    deflection > LIMP
}

/// Whether higher modes of a motion matter: supports move or strike the rod, it is released from another shape, it twists, or
/// it is limp.
fn has_many_modes(scene: &Scene, guess: &Problem) -> bool {
    is_struck(scene)
        || !matches!(scene.initial.state, InitialState::Rest | InitialState::Equilibrium)
        || guess.planar().is_none()
        || is_limp(scene, guess)
}
