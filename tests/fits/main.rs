//! Fits of simulated data give the parameters of the simulation, and report parameters that are not identifiable.

#[path = "../common/mod.rs"]
mod common;

mod bodies;
mod cable_models;
mod camera;
mod center_lines;
mod dialects;
mod duplicates;
mod experiments;
mod faulty_files;
mod field;
mod formats;
mod helix;
mod layout;
mod lens_and_shutter;
mod load_deflection;
mod markers;
mod minima;
mod nist;
mod pictures;
mod piecewise;
mod planar;
mod recordings;
mod refusals;
mod shape_markers;
mod sigmas;
mod signals;
