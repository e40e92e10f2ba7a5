//! Damping, which may be zero: the logarithm that the search works on has no effect there.

use crate::error::Error;
use crate::fit::search::Search;
use crate::fit::search::optimum::Optimum;
use crate::fit::unknown::Unknown;

/// A damping that wants to be this many times as large was left behind.
const RAISED: f64 = 10.0;

/// Whether an unknown is a damping, or drag.
pub(crate) fn is_damping(unknown: &Unknown) -> bool {
    unknown.parameter.quantity().may_vanish
}

impl Search<'_> {
    /// A damping that a search left at next to nothing, where its logarithm has no effect, may have to
    /// go up: tries where the parabola on the parameter's own scale has its minimum.
    pub fn raised(&self, optimum: Optimum) -> Result<Optimum, Error> {
        let residuals = self.all_residuals()?;
        let made: Vec<_> =
            residuals.losses().into_iter().zip(residuals.leverage_weights()).collect();
        let mut start = optimum.x.clone();
        for (j, _) in self.unknowns.iter().enumerate().filter(|(_, u)| is_damping(u)) {
            let rows = optimum.jacobian.iter().zip(&optimum.residuals).zip(&made);
            let (mut along, mut square) = (0.0, 0.0);
            for ((row, r), (loss, weight)) in rows {
                along += weight * row[j] * loss.influence(weight * r)[0];
                square += (weight * row[j]).powi(2);
            }
            let factor = 1.0 - along / square;
            if factor.is_finite() && factor > RAISED {
                start[j] += factor.ln();
            }
        }
        if start == optimum.x {
            return Ok(optimum);
        }
        match self.polish(&start) {
            Ok(higher) if higher.cost < optimum.cost => Ok(higher),
            Err(Error::Interrupted) => Err(Error::Interrupted),
            _ => Ok(optimum),
        }
    }
}
