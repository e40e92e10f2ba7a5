//! The 95 % intervals of the parameters by different methods, side by side.
//!
//! Input are the estimates of a fit. [`method_intervals`] returns one [`MethodIntervals`] for each: linear (from the
//! residuals and the Jacobian), profile likelihood, bootstrap and posterior distribution. Methods that were not
//! requested or have no result are none. Without any of the last three there is nothing to compare, and the list is
//! empty. All values are in the units of the parameters.

use crate::fit::uncertainty::estimate::Estimate;
use serde::{Deserialize, Serialize};

/// 95 % intervals of a parameter by each method, in the parameter's unit; null where a method has none.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct MethodIntervals {
    /// Name of the parameter, with its experiments in parentheses if it does not belong to all.
    pub parameter: String,
    /// SI unit of the parameter; empty for pure numbers.
    pub unit: String,
    /// Interval from the residuals and the Jacobian, with the remaining discretization error.
    pub linear95: Option<[f64; 2]>,
    /// Interval of the profile likelihood; an end is null where the data set no limit.
    pub profile95: Option<[Option<f64>; 2]>,
    /// 2.5 and 97.5 percentiles of the bootstrap.
    pub bootstrap95: Option<[f64; 2]>,
    /// 2.5 and 97.5 percentiles of the posterior distribution.
    pub posterior95: Option<[f64; 2]>,
}

impl MethodIntervals {
    /// Whether there is an interval beside the linear one.
    fn is_comparison(&self) -> bool {
        self.profile95.is_some() || self.bootstrap95.is_some() || self.posterior95.is_some()
    }

    /// The ends of the intervals in the order linear, profile likelihood, bootstrap, posterior; none without an
    /// interval of the method, and none for an open end.
    pub(crate) fn all(&self) -> [Option<[Option<f64>; 2]>; 4] {
        let closed = |ends: Option<[f64; 2]>| ends.map(|ends| ends.map(Some));
        [closed(self.linear95), self.profile95, closed(self.bootstrap95), closed(self.posterior95)]
    }
}

/// Names of the methods, in the order of [`MethodIntervals::all`].
pub(crate) const METHODS: [&str; 4] = ["linear", "profile", "bootstrap", "posterior"];

/// The intervals of all estimates by each method, in their order; empty if no estimate has one beside the linear one.
/// The linear interval is that of the residuals, also where the reported one is from differences between experiments.
pub(crate) fn method_intervals(estimates: &[Estimate]) -> Vec<MethodIntervals> {
    let of = |e: &Estimate| {
        let clusters = e.cluster_jackknife.as_ref().filter(|clusters| clusters.reported);
        MethodIntervals {
            parameter: e.label(),
            unit: e.unit.clone(),
            linear95: clusters.map_or(e.interval95, |own| Some(own.residual_interval95)),
            profile95: e.profile95,
            bootstrap95: e.bootstrap.as_ref().map(|own| own.interval95),
            posterior95: e.posterior.as_ref().map(|own| own.interval95),
        }
    };
    let all: Vec<MethodIntervals> = estimates.iter().map(of).collect();
    if all.iter().any(MethodIntervals::is_comparison) { all } else { Vec::new() }
}
