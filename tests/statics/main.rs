//! Rods at rest: where they come to rest, where they lose their shape, and how they vibrate about it.

#[path = "../common/mod.rs"]
mod common;

mod bifurcations;
mod equilibrium;
mod growth;
mod led;
mod masses;
mod modes;
mod soft_clamps;
mod stability;
mod tapered;
