//! Fits of structures: scenes of several rods, bodies and joints, in a plane or in space.
//!
//! The experiment of a structure has the problem of one [representative rod](structure_problem) with the structure in
//! its scene. The parameters of that scene are the numbers of the structure. The [motions and
//! equilibria](structure_run) of the nodes of a structure, with derivatives by the parameters, are compared with
//! measurements like those of one rod. [Frequencies](structure_frequencies), of structures in a plane only, are
//! computed apart, and [points](structure_places) of measurements are validated. Search, covariance, noise and budget
//! are those of any fit.

pub(crate) mod structure_frequencies;
pub(crate) mod structure_places;
pub(crate) mod structure_problem;
pub(crate) mod structure_run;
