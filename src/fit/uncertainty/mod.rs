//! What an optimum is worth: its errors, what the data cannot tell, and what speaks against it.

pub(crate) mod across;
pub(crate) mod analysis;
pub(crate) mod assessment;
pub(crate) mod bootstrap;
pub(crate) mod budget;
pub(crate) mod correlation;
pub(crate) mod covariance;
pub(crate) mod discretization;
pub(crate) mod estimate;
pub(crate) mod extensions;
pub(crate) mod finer;
pub(crate) mod identifiability;
pub(crate) mod inputs;
pub(crate) mod known_errors;
pub(crate) mod noise;
pub(crate) mod observed;
pub(crate) mod prediction;
pub(crate) mod profile;
pub(crate) mod quantile;
pub(crate) mod recordings;
pub(crate) mod score;
pub(crate) mod shifts;
pub(crate) mod sources;
pub(crate) mod vanishing;
pub(crate) mod verdict;
pub(crate) mod warnings;
