//! Warnings about an optimum: `residuals` that are no noise, `parameters` at a bound or in conflict with a prior, and `data`
//! (recordings, leverage, time steps).
//!
//! Each function adds warnings with a severity and a code to one `Warnings` list. The most severe one determines the grade of
//! the fit.

pub(crate) mod data;
pub(crate) mod parameters;
pub(crate) mod residuals;
