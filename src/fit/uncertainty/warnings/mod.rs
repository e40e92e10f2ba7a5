//! Warnings about an optimum, as its assessment adds them.
//!
//! `residuals` warns of residuals that are no noise or larger than stated, `parameters` of one-sided bounds, bounds of
//! the search and conflicts with a prior. `data` warns of defects of recordings, high leverage and time steps,
//! `noise_comparison` of shapes that are nearly equal and of noises that differ much. Input of each function is a
//! result of the fit: the optimum, its local analysis, the estimates or the experiments. It adds warnings with a
//! severity and a code to a [`Warnings`](crate::fit::uncertainty::warning_list::Warnings) list. The most severe one
//! determines the grade of the fit; notes do not.

pub(crate) mod data;
pub(crate) mod noise_comparison;
pub(crate) mod parameters;
pub(crate) mod residuals;
