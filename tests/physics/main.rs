//! Rods against physics: closed forms, published figures, conservation and invariance.

#[path = "../common/mod.rs"]
mod common;

mod accuracy;
mod corrections;
mod damping;
mod direct;
mod drag;
mod energy;
mod generalised_alpha;
mod hard_cases;
mod helix;
mod led;
mod numerical_damping;
mod paper;
mod recorded;
mod spatial;
mod supports;
mod tip;
mod unstable_states;
