//! Damping parameters near zero. The search identifies their logarithm, which has no effect on the motion there.

use crate::error::{Error, none_on_failure};
use crate::fit::search::Search;
use crate::fit::search::optimum::Optimum;
use crate::fit::unknown::Unknown;

/// Factor between the value of a damping at the minimum of the parabola and at the optimum above which the search starts
/// again there.
const LEAST_RISE: f64 = 10.0;

/// Whether an unknown is a damping or a drag, which may be zero.
pub(crate) fn is_damping(unknown: &Unknown) -> bool {
    unknown.parameter.quantity().may_vanish
}

impl Search<'_> {
    /// The optimum from a start with larger damping, if that has a lower objective; else the same optimum. The start is the
    /// minimum of the parabola of the objective over the damping itself, instead of its logarithm.
    pub fn with_raised_damping(&self, optimum: Optimum) -> Result<Optimum, Error> {
        let losses = self.all_residuals()?.weighted_losses();
        let mut start = optimum.x.clone();
        for (j, _) in self.unknowns.iter().enumerate().filter(|(_, u)| is_damping(u)) {
            let rows = optimum.jacobian.iter().zip(&optimum.residuals).zip(&losses);
            let (mut gradient, mut curvature) = (0.0, 0.0);
            for ((row, r), loss) in rows {
                gradient += row[j] * loss.influence(*r);
                curvature += (loss.weight * row[j]).powi(2);
            }
            let factor = 1.0 - gradient / curvature;
            if factor.is_finite() && factor > LEAST_RISE {
                start[j] += factor.ln();
            }
        }
        if start != optimum.x
            && let Some(raised) = none_on_failure(self.polish(&start))?
            && raised.cost < optimum.cost
        {
            return Ok(raised);
        }
        Ok(optimum)
    }
}
