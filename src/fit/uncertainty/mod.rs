//! What an optimum is worth: its errors, what the data cannot tell, and what speaks against it.

pub(crate) mod analysis;
pub(crate) mod bootstrap;
pub(crate) mod covariance;
pub(crate) mod discretization;
pub(crate) mod identifiability;
pub(crate) mod noise;
pub(crate) mod on_request;
pub(crate) mod prediction;
pub(crate) mod profile;
pub(crate) mod residual_tests;
pub(crate) mod vanishing;
pub(crate) mod verdict;
pub(crate) mod warnings;
