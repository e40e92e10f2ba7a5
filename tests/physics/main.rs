//! Physics of simulated rods: closed forms, published figures, conservation laws and invariance.

#[path = "../common/mod.rs"]
mod common;

mod accuracy;
mod actuation;
mod coarse_steps;
mod contact;
mod contact_losses;
mod corrections;
mod damping;
mod drag;
mod drops;
mod energy;
mod explicit_schemes;
mod follower_loads;
mod generalised_alpha;
mod hard_cases;
mod helix;
mod hyperelastic;
mod mean_stretch;
mod moved_obstacles;
mod newton;
mod nonlinear_bending;
mod numerical_damping;
mod paper;
mod passed_obstacles;
mod plastic_bending;
mod posed_ends;
mod prescribed_motion;
mod prony;
mod recorded;
mod signals;
mod spatial;
mod supports;
mod tip;
mod unstable_states;
