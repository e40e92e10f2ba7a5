//! Warnings about an optimum, by its residuals, its parameters and its data.

pub(crate) mod data;
pub(crate) mod parameters;
pub(crate) mod residuals;
