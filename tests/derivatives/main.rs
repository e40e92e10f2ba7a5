//! Every derivative is exact: of energies, of trajectories, of rods at rest and of misfits, against
//! num-dual and finite differences.

#[path = "../common/mod.rs"]
mod common;

mod actuation;
mod adjoint;
mod all_schemes;
mod contact;
mod follower_loads;
mod hessian;
mod hyperelastic;
mod lanes;
mod laws;
mod motion;
mod nonlinear_bending;
mod parameters;
mod planar_elements;
mod posed_ends;
mod prescribed_motion;
mod prony;
mod random_scene_checks;
mod rates;
mod recorded;
mod rest;
mod signals;
mod spatial_elements;
mod starts;
