//! Statics and vibration against theory: equilibria, stability limits, reactions and natural frequencies.

#[path = "../common/mod.rs"]
mod common;

mod bifurcations;
mod critical_loads;
mod equilibrium;
mod flutter;
mod given_mesh;
mod growth;
mod line_loads;
mod masses;
mod modes;
mod obstacles;
mod prescribed_motion;
mod soft_clamps;
mod stability;
mod tapered;
mod thick_bars;
mod wall_loads;
