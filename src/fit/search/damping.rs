//! Larger starts for damping parameters near zero. The search identifies their logarithm, which has no effect on the
//! motion there: the objective is flat, and a descent stops.
//!
//! [`Search::with_raised_damping`] takes an optimum. Each parameter that may vanish ([`may_vanish`]: a damping, a drag
//! or the like) has a quadratic model of the objective over its value `d`. The minimum of the model is at
//! `d (1 - g/c)`, with slope `g` and Gauss-Newton curvature `c` of the objective over `ln d`. Parameters whose minimum
//! is more than [`LEAST_RISE`] times their value start there, or at their bound, all in one further fit of the full
//! model. The other unknowns start at the optimum. Output: the new optimum if its objective is lower. It is the given
//! one otherwise, also if no parameter is raised or the fit fails. An interruption is an error.

use crate::error::{Error, none_on_failure};
use crate::fit::search::Search;
use crate::fit::search::optimum::Optimum;
use crate::fit::unknown::Unknown;

/// Smallest ratio of the damping at the minimum of the parabola to that at the optimum for a further descent. A smaller
/// threshold costs more descents.
const LEAST_RISE: f64 = 10.0;

/// Whether the parameter of an unknown is one that may be zero, and then has no effect: a damping, a drag or the like.
pub(crate) fn may_vanish(unknown: &Unknown) -> bool {
    unknown.parameter.quantity().may_vanish
}

impl Search<'_> {
    /// The optimum of a further fit from larger dampings, if that has a lower objective; else the same optimum, also
    /// where no damping is raised or the fit fails. The start of each damping is the minimum of the parabola of the
    /// objective over the damping itself, if more than [`LEAST_RISE`] times its value at the optimum. The curvature of
    /// the parabola is that of Gauss-Newton, with the leverage weights. A start beyond a bound is moved to it. An
    /// interruption is an error.
    pub fn with_raised_damping(&self, optimum: Optimum) -> Result<Optimum, Error> {
        let losses = self.all_residuals()?.weighted_losses();
        let mut start = optimum.x.clone();
        for (j, _) in self.unknowns.iter().enumerate().filter(|(_, u)| may_vanish(u)) {
            let rows = optimum.jacobian.iter().zip(&optimum.residuals).zip(&losses);
            let (mut gradient, mut curvature) = (0.0, 0.0);
            for ((row, r), loss) in rows {
                gradient += row[j] * loss.influence(*r);
                curvature += (loss.weight * row[j]).powi(2);
            }
            // With x = ln d: d dF/dd = g and d^2 F'' = c. The minimum of the parabola is at d (1 - g/c).
            let factor = 1.0 - gradient / curvature;
            if factor.is_finite() && factor > LEAST_RISE {
                start[j] += factor.ln();
            }
        }
        // A start that fails or leads to a higher objective is no reason to change the optimum.
        if start != optimum.x
            && let Some(raised) = none_on_failure(self.polish(&start))?
            && raised.cost < optimum.cost
        {
            return Ok(raised);
        }
        Ok(optimum)
    }
}
