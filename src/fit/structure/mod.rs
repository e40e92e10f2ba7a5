//! Fits of structures: scenes of several rods, bodies and joints.
//!
//! The experiment of a structure has the problem of one [representative rod](structure_problem) with the structure in its
//! scene. The parameters of that scene are the numbers of the structure. Records of its [runs](structure_run) are read by
//! the measurements like those of one rod. Search, covariance, noise and budget are those of any fit.

pub(crate) mod structure_frequencies;
pub(crate) mod structure_places;
pub(crate) mod structure_problem;
pub(crate) mod structure_run;
