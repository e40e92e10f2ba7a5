//! Strains, and stretches of the springs of internal friction, at the current unknowns of a step.
//!
//! Input: unknowns and frames, and the internal variables at the start of the step. A friction spring stretches by the
//! change of the strain of its joint until its limit, and slips there. Output of `update`: strains, and stretches
//! without and with slip, over any scalar; `stretch_springs` overwrites a list with those without slip. If a correction
//! of Newton's method makes a spring begin to slip or stick, the error estimate does not hold. `is_unchanged` excludes
//! this: the distance of all springs from their limits must exceed `MAX_STRAIN_CHANGE` times the correction (over the
//! rod's length) times the number of edges.

use crate::numerics::scalar::RodScalar;
use crate::rod::{InternalVariables, Rod};

/// Largest change of a strain by a correction of a node, divided by the correction over the length of an edge. A larger
/// value forms more tangents near the slip limit; a smaller one may miss a spring that begins to slip.
const MAX_STRAIN_CHANGE: f64 = 20.0;

/// The strains at the end of a step, and the stretches of the springs of internal friction there.
#[derive(Clone, Debug)]
pub(super) struct SlipState<D> {
    /// Strains at the current unknowns.
    pub strains: Vec<D>,
    /// Stretches of the springs without slip.
    z: Vec<D>,
    /// Stretches of the springs with slip.
    pub slid: Vec<D>,
    /// Whether strains and stretches are those at the current unknowns.
    pub is_current: bool,
}

impl<D: RodScalar> SlipState<D> {
    /// Empty lists of strains and stretches, before the first step; they are not current.
    pub fn new() -> Self {
        Self { strains: Vec::new(), z: Vec::new(), slid: Vec::new(), is_current: false }
    }

    /// Overwrites strains and spring stretches (without and with slip) by those at the unknowns `q` of a step that
    /// began with the internal variables `before`. Limits follow from the laws of the `elastic` rod.
    pub fn update<R: Rod<D>>(
        &mut self,
        elastic: &R,
        before: &InternalVariables<D>,
        q: &[D],
        frames: &R::Frames,
    ) {
        elastic.strains(q, frames, &mut self.strains);
        stretch_springs(elastic.sliding_strains(), before, &self.strains, &mut self.z);
        self.slid.clone_from(&self.z);
        elastic.slip(&mut self.slid);
        self.is_current = true;
    }

    /// Whether the last correction, of up to `size` over the rod's length, cannot have made a spring begin to slip or
    /// stick. The distance of all springs from their limits must exceed [`MAX_STRAIN_CHANGE`] times `size` times the
    /// number of edges.
    pub fn is_unchanged<R: Rod<D>>(&self, elastic: &R, size: f64) -> bool {
        // Strains without a spring are those of the edges. `size` times their number is the
        // correction over the length of an edge, which bounds the change of a strain.
        let edges = (self.strains.len() - self.z.len()) as f64;
        elastic.distance_to_slipping(&self.z) > MAX_STRAIN_CHANGE * size * edges
    }
}

/// Overwrites `z` with the stretches, without slip, of the `count` friction springs: those in `before` plus the
/// change of their strains since then. The strains of the springs are the last `count` of `strains`.
pub fn stretch_springs<D: RodScalar>(
    count: usize,
    before: &InternalVariables<D>,
    strains: &[D],
    z: &mut Vec<D>,
) {
    let first = strains.len() - count;
    z.clone_from(&before.slid);
    for (z, (now, then)) in z.iter_mut().zip(strains[first..].iter().zip(&before.strain[first..])) {
        *z = *z + *now - *then;
    }
}
