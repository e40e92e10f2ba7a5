//! Constants of the search for the numerics of a motion: one set for motions of a few modes, one for motions of many.
//!
//! Input: a scene and its problem on the first trial mesh. A motion has many modes if the scene has a
//! `supports.motion`, an initial velocity or angular velocity, or a spatial model, or if the rod is limp. A limp rod
//! deflects as a cantilever under its weight by more than its length ([`LIMP`]), by linear theory. A motion also has
//! many if it starts from another shape than rest or equilibrium. Then every refinement adds modes, and observed orders
//! are lower. [`Tuning::of`] returns the set of a scene: target error over the requested one, growth limits of the
//! work, bounds of orders and their reduction.

use crate::accuracy::calculation::begins_with_velocity_jump;
use crate::accuracy::difference::OrderBounds;
use crate::problem::Problem;
use crate::scene::{InitialState, Scene};

/// Constants of the search, chosen on the scenes of `cargo run --release --example chosen_numerics`.
pub(super) struct Tuning {
    /// Error for which the numerics are chosen, over the requested one: estimates are wrong by up to a factor of two.
    pub target: f64,
    /// Largest growth of the work from the last trial run to the chosen run where both orders were observed. All trial
    /// runs together take about twice the work of the last one.
    pub growth_observed: f64,
    /// The same where an order is assumed.
    pub growth_assumed: f64,
    /// Bounds of the observed orders.
    pub orders: OrderBounds,
    /// Amount subtracted from the orders for extrapolation, as further modes lower the order.
    pub doubt: f64,
    /// Whether every refinement adds modes to the motion.
    pub has_many_modes: bool,
}

/// Constants of motions of a few low modes.
const SMOOTH: Tuning = Tuning {
    target: 0.45,
    growth_observed: 16.0,
    growth_assumed: 6.0,
    orders: OrderBounds { highest: 2.0, at_once: 2.0, lowest: 0.32, assumed: 1.4 },
    doubt: 0.0,
    has_many_modes: false,
};
/// Constants of motions of many modes: every refinement adds higher ones.
const EXCITED: Tuning = Tuning {
    target: 0.5,
    growth_observed: 16.0,
    growth_assumed: 6.0,
    orders: OrderBounds { highest: 2.0, at_once: 1.32, lowest: 0.32, assumed: 1.32 },
    doubt: 0.1,
    has_many_modes: true,
};
/// Deflection under its weight over its length, by linear beam theory, above which a rod is limp.
const LIMP: f64 = 1.0;

impl Tuning {
    /// The constants for a scene: those of [many modes](has_many_modes) or those of few. `guess` is its problem with
    /// the first trial numerics.
    pub fn of(scene: &Scene, guess: &Problem) -> &'static Self {
        if has_many_modes(scene, guess) { &EXCITED } else { &SMOOTH }
    }
}

/// Whether a rod is limp: its deflection as a cantilever under its own weight, `w L^3/(8 E I)` over its length by
/// linear beam theory, is above [`LIMP`]. `w` is the weight per length, `I` the smaller second moment of the section in
/// its middle.
pub(super) fn is_limp(scene: &Scene, guess: &Problem) -> bool {
    let (section, material) = scene.at(0.5);
    let moments = section.moments();
    let [i1, i2] = moments.second_moments;
    let gravity = scene.loads.gravity.iter().map(|g| g * g).sum::<f64>().sqrt();
    let weight = material.density * moments.area * gravity;
    // A uniform load w deflects the tip of a cantilever by w L^4/(8 E I).
    let deflection = weight * guess.length().powi(3) / (8.0 * material.youngs_modulus * i1.min(i2));
    deflection > LIMP
}

/// Whether the motion has many modes: the scene has a `supports.motion` or an initial velocity or angular velocity, or
/// the model is spatial, or the rod is [limp](is_limp). It has many too if the rod starts neither from its rest shape
/// nor from its equilibrium. `guess` is the problem of the scene with the first trial mesh and step; its length and its
/// model (planar or spatial) are used.
fn has_many_modes(scene: &Scene, guess: &Problem) -> bool {
    begins_with_velocity_jump(scene)
        || !matches!(scene.initial.state, InitialState::Rest | InitialState::Equilibrium)
        || guess.planar().is_none()
        || is_limp(scene, guess)
}
