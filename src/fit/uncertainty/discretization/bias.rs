//! Bias of the unknowns by mesh and step: their distance to the limit of zero element and step size.
//!
//! [`DiscretizationBias`] has this distance for each identifiable unknown on its scale (logarithm of a positive
//! parameter), separately for mesh and step; `limit` computes it. It also has the norm of the discretization errors of
//! the residuals by each, over the norm of the residuals. Where the program chose the mesh for all experiments, the
//! estimates are corrected by the distance for the mesh, and likewise for the step. [`REMAINING_FRACTION`] of the
//! absolute corrections may remain as an error, which widens the interval. A mesh or step that a scene gives has no
//! part in correction and remaining error.
//!
//! If the program chose both, its methods also return whether discretization errors are visible in the residuals (above
//! [`VISIBLE_FRACTION`] of them) or explain them (above [`EXPLAINING_FRACTION`]); else both are false. `refinement`
//! returns factors, 1 or more, on the numbers of edges and steps by which visible errors become [`INVISIBLE_FRACTION`]
//! of the residuals.

use crate::fit::unknown::Unknown;

/// Error that may remain after a correction, over the correction: at an order of 1.5 instead of 2 the error is 1.5
/// times the correction, at an order of 3 half of it.
pub(crate) const REMAINING_FRACTION: f64 = 0.5;
/// Part of the residuals by discretization errors above which these explain the residuals.
pub(crate) const EXPLAINING_FRACTION: f64 = 0.5;
/// Part of the residuals by discretization errors that explains a weak excess over the noise: a quarter adds 3 % to the
/// residuals.
const VISIBLE_FRACTION: f64 = 0.25;
/// Part of the residuals by discretization errors that is left after a refinement: tests for autocorrelation of 2000
/// values detect a part of about 0.05.
const INVISIBLE_FRACTION: f64 = 0.03;

/// Bias of all unknowns by the mesh, or by the step.
#[derive(Clone, Debug, Default)]
pub(crate) struct BiasPart {
    /// Limit of zero size less the optimum, for every unknown on its scale; none if it is not identifiable. Empty where
    /// no experiment has another mesh or step to compare with.
    pub shifts: Vec<Option<f64>>,
    /// Whether the program chose the mesh, or the step, for all experiments, so that the estimates are corrected.
    pub is_chosen: bool,
    /// Norm of the discretization errors of the residuals over that of the residuals.
    pub residual_fraction: f64,
}

/// Bias of all unknowns by mesh and by step.
#[derive(Clone, Debug, Default)]
pub(crate) struct DiscretizationBias {
    /// Bias by the element size.
    pub mesh: BiasPart,
    /// Bias by the time step.
    pub step: BiasPart,
}

impl BiasPart {
    /// Limit of zero element or step size less the optimum, for unknown `i` on its scale (logarithm of a positive
    /// parameter). None where it is not identifiable, or without another mesh or step to compare with.
    pub fn shift(&self, i: usize) -> Option<f64> {
        self.shifts.get(i).copied().flatten()
    }

    /// Correction of unknown `i` on its scale (logarithm of a positive parameter), to be added. It is the shift if the
    /// program chose the mesh, or the step; 0 if the scene gives it, and without a shift.
    fn correction(&self, i: usize) -> f64 {
        self.shift(i).filter(|_| self.is_chosen).unwrap_or(0.0)
    }
}

impl DiscretizationBias {
    /// The bias by the mesh and that by the step, in this order.
    pub fn parts(&self) -> [&BiasPart; 2] {
        [&self.mesh, &self.step]
    }

    /// Corrections of unknown `i` for mesh and for step, to be added on its scale (logarithm of a positive parameter).
    /// 0 for a mesh or step that the scene gives.
    pub fn corrections(&self, i: usize) -> [f64; 2] {
        self.parts().map(|part| part.correction(i))
    }

    /// Corrections, for mesh and for step, of the linear function `sum factor x` of the unknowns `x` on their scales
    /// (logarithms of positive parameters), with one of the `factors` per unknown.
    pub fn corrections_along(&self, factors: &[f64]) -> [f64; 2] {
        let own = |part: &BiasPart| -> f64 {
            factors.iter().enumerate().map(|(i, factor)| factor * part.correction(i)).sum()
        };
        self.parts().map(own)
    }

    /// Correction of unknown `i` for mesh and step together, to be added on its scale (logarithm of a positive
    /// parameter). A mesh or step that the scene gives has no part.
    pub fn correction(&self, i: usize) -> f64 {
        self.corrections(i).iter().sum()
    }

    /// The value `x` of unknown `i` on its scale, plus its correction for mesh and step, clamped to its bounds. Without
    /// a correction it stays exactly `x`.
    pub fn corrected(&self, unknown: &Unknown, i: usize, x: f64) -> f64 {
        let [low, high] = unknown.scaled_bounds();
        match self.correction(i) {
            // Without a correction the value stays exactly.
            0.0 => x,
            correction => (x + correction).clamp(low, high),
        }
    }

    /// Discretization error of unknown `i` that may remain after its correction, on its scale (logarithm of a positive
    /// parameter): [`REMAINING_FRACTION`] of the sum of the absolute corrections for mesh and step. A mesh or step that
    /// the scene gives has no part in it: it is not corrected, and `discretization_errors` reports its whole bias.
    pub fn remaining(&self, i: usize) -> f64 {
        remaining_error(self.corrections(i))
    }

    /// Norm of the discretization errors of the residuals over the norm of the residuals: the larger of those by mesh
    /// and by step, as a sum of the two may cancel.
    pub fn residual_fraction(&self) -> f64 {
        self.mesh.residual_fraction.max(self.step.residual_fraction)
    }

    /// Whether the program chose both mesh and step for all experiments, and `residual_fraction` is above
    /// [`VISIBLE_FRACTION`].
    pub fn is_visible(&self) -> bool {
        self.is_corrected() && self.residual_fraction() > VISIBLE_FRACTION
    }

    /// Factors, 1 or more, on the numbers of edges and of steps, so that their errors are only [`INVISIBLE_FRACTION`]
    /// of the residuals: `sqrt(f/INVISIBLE_FRACTION)` for the part `f` of the residuals that each causes (second
    /// order). Both are 1 unless `is_visible`. Both are 1 too if discretization errors explain the residuals: exact
    /// data have no noise to compare with.
    pub fn refinement(&self) -> [f64; 2] {
        let is_comparable = self.is_visible() && !self.explains_residuals();
        // Of second order.
        let factor =
            |part: &BiasPart| (part.residual_fraction / INVISIBLE_FRACTION).sqrt().max(1.0);
        self.parts().map(|part| if is_comparable { factor(part) } else { 1.0 })
    }

    /// Whether the program chose both mesh and step for all experiments, and `residual_fraction` is above
    /// [`EXPLAINING_FRACTION`].
    pub fn explains_residuals(&self) -> bool {
        self.is_corrected() && self.residual_fraction() > EXPLAINING_FRACTION
    }

    /// Whether the program chose both mesh and step for all experiments, so that the estimates are corrected for both.
    fn is_corrected(&self) -> bool {
        self.parts().iter().all(|part| part.is_chosen)
    }
}

/// Error that may remain after the `corrections` for mesh and step: [`REMAINING_FRACTION`] of the sum of their absolute
/// values.
pub(crate) fn remaining_error(corrections: [f64; 2]) -> f64 {
    corrections.iter().map(|correction| REMAINING_FRACTION * correction.abs()).sum()
}
