//! Uncertainty by resampling the data of a fit.
//!
//! `bootstrap` fits data that are simulated with random noise again, on request, for a bootstrap or a Monte Carlo with random
//! inputs. `cluster_jackknife` leaves out one experiment after the other, by the linear model and without further fits.

pub(crate) mod bootstrap;
pub(crate) mod cluster_jackknife;
