//! Model of the errors of mesh and step after a refinement, `e = e_m r_m^-p + e_s r_s^-q`, and the least expensive
//! refinement for a requested error.
//!
//! Input: estimated errors `e_m`, `e_s` of a run, in any common unit (over the length; in fits on the scale of an
//! unknown), and their orders `p`, `q`. Output: the factors `r_m` and `r_s` by which edges and steps increase (below 1:
//! coarser). [`work`] is (edges + [`EDGES_PER_STEP`]) times steps. Beyond a factor of [`MAX_EXTRAPOLATION`] the errors
//! are assumed to decrease with half the order. The best `r_m` is that of least work among equal ratios from
//! [`COARSEST`] to [`FINEST`]; `r_s` follows from the remaining error. A part that may not change keeps the factor 1;
//! in general the result is `None` if no candidate reaches the error. [`ErrorModel::cheapest`] returns these factors
//! with their work, and [`ErrorModel::after`] the error that any factors leave. [`ErrorModel::best_within`] returns the
//! most accurate factors within an allowed work. [`ErrorModel::finer_for`] has no factors below 1, and returns
//! [`FINEST`] for both if no candidate reaches the error. [`ErrorModel::underestimated`] is the model with larger
//! errors, and with the lower orders that then explain the same change.

/// Smallest refinement of the mesh that is considered.
const COARSEST: f64 = 0.5;
/// Largest refinement of the mesh that is considered.
const FINEST: f64 = 64.0;
/// Number of candidates between both, in equal ratios of 3.5 %.
const CANDIDATES: i32 = 140;
/// Bisections of the logarithm of a target error, over a range of 1e6: to the last digit.
const BISECTIONS: usize = 60;
/// Refinement up to which the observed order is used; beyond it the error falls with half the order, as a reserve.
pub(super) const MAX_EXTRAPOLATION: f64 = 7.0;
/// Work of a step that does not depend on the mesh, in edges (measured).
const EDGES_PER_STEP: f64 = 8.0;
/// Error for which a refinement is chosen over the allowed one, where the order is that of the method and not observed.
const TARGET_PART: f64 = 0.8;

/// Errors of mesh and step of a run, in one unit (over the length, or on the scale of an unknown), and the powers with
/// which they fall.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ErrorModel {
    /// Error of the mesh.
    pub mesh: f64,
    /// Error of the step.
    pub step: f64,
    /// Order of the mesh error.
    pub mesh_order: f64,
    /// Order of the step error.
    pub step_order: f64,
}

/// Factors by which mesh and step are finer than those of a run; below one they are coarser.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct RefinementFactors {
    /// Number of edges over that of the run.
    pub mesh: f64,
    /// Number of steps over that of the run.
    pub step: f64,
}

/// Whether the mesh and the step may change.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Free {
    pub mesh: bool,
    pub step: bool,
}

/// The refinement that enters the power law: `finer` itself up to [`MAX_EXTRAPOLATION`], beyond it that times the
/// square root of the remaining factor.
fn effective(finer: f64) -> f64 {
    finer.min(MAX_EXTRAPOLATION) * (finer / MAX_EXTRAPOLATION).max(1.0).sqrt()
}

/// The inverse of [`effective`]: the refinement factor whose effective one is given.
fn needed(effective: f64) -> f64 {
    effective * (effective / MAX_EXTRAPOLATION).max(1.0)
}

/// Work of a run: (edges + [`EDGES_PER_STEP`]) times steps. The added edges stand for the part of a step that does not
/// depend on the mesh. `steps` may be relative to those of another run.
pub(super) fn work(segments: f64, steps: f64) -> f64 {
    (segments + EDGES_PER_STEP) * steps
}

impl ErrorModel {
    /// The model of given errors of mesh and step, whose absolute values are used, both of second order.
    pub fn of_second_order([mesh, step]: [f64; 2]) -> Self {
        Self { mesh: mesh.abs(), step: step.abs(), mesh_order: 2.0, step_order: 2.0 }
    }

    /// The refinement with the least work of a run with `segments` edges whose error is at most `allowed`; neither mesh
    /// nor step is coarsened. Factors of one if the error is small enough already; else the target is [`TARGET_PART`]
    /// of `allowed`. [`FINEST`] for both if no refinement reaches it.
    pub fn finer_for(&self, allowed: f64, segments: usize) -> RefinementFactors {
        let same = RefinementFactors { mesh: 1.0, step: 1.0 };
        if self.after(same) <= allowed {
            return same;
        }
        // The order is not observed here: a part of the allowed error stays in reserve.
        let (target, both) = (TARGET_PART * allowed, Free { mesh: true, step: true });
        let RefinementFactors { mesh, step } = self
            .cheapest(target, segments as f64, both)
            .map_or(RefinementFactors { mesh: FINEST, step: FINEST }, |(finer, _)| finer);
        RefinementFactors { mesh: mesh.max(1.0), step: step.max(1.0) }
    }

    /// The error after a refinement by these factors: the sum of those of mesh and step, each divided by its effective
    /// refinement (see [`effective`]) to the power of its order.
    pub fn after(&self, finer: RefinementFactors) -> f64 {
        let Self { mesh, step, .. } = self.refined(finer);
        mesh + step
    }

    /// The model after a refinement: reduced errors, same orders.
    fn refined(&self, finer: RefinementFactors) -> Self {
        Self {
            mesh: self.mesh * effective(finer.mesh).powf(-self.mesh_order),
            step: self.step * effective(finer.step).powf(-self.step_order),
            ..*self
        }
    }

    /// The model with both errors multiplied by `factor`, after a finer run showed that they were underestimated. They
    /// were extrapolated from the change `d` of a refinement by two, `e = d/(2^p - 1)`: the same change with larger
    /// errors has a lower order `p`. Orders are lowered to it, at least to `lowest`; orders below `lowest` stay. The
    /// lowered order is `log2(1 + (2^p - 1)/factor)`.
    pub fn underestimated(&self, factor: f64, lowest: f64) -> Self {
        let lower = |order: f64| {
            let explained = (1.0 + (order.exp2() - 1.0) / factor).log2();
            // An order that is below the limit already is not raised to it.
            explained.max(lowest.min(order))
        };
        Self {
            mesh: factor * self.mesh,
            step: factor * self.step,
            mesh_order: lower(self.mesh_order),
            step_order: lower(self.step_order),
        }
    }

    /// The least expensive refinement of a run with `segments` edges whose error is at most `target`, and its work over
    /// that of the run. A part, mesh or step, that is not `free` has the factor one. Of each candidate of the mesh the
    /// step follows from the remaining error. Factors may be below one (coarser), down to [`COARSEST`]. `None` if no
    /// candidate reaches the target.
    pub fn cheapest(
        &self,
        target: f64,
        segments: f64,
        free: Free,
    ) -> Option<(RefinementFactors, f64)> {
        let factor =
            |k: i32| COARSEST * (FINEST / COARSEST).powf(f64::from(k) / f64::from(CANDIDATES));
        let meshes: Vec<f64> = match free.mesh {
            true => (0..=CANDIDATES).map(factor).collect(),
            false => vec![1.0],
        };
        let candidates = meshes.into_iter().filter_map(|mesh| {
            // The step may use the error that the mesh leaves of the target.
            let left = target - self.mesh * effective(mesh).powf(-self.mesh_order);
            let step = needed((self.step / left).powf(self.step_order.recip())).max(COARSEST);
            let step = if free.step { step } else { 1.0 };
            let finer = RefinementFactors { mesh, step };
            // The margin is for rounding: a free step uses up the target exactly.
            let is_enough = left > 0.0 && self.after(finer) <= target * (1.0 + 1e-9);
            is_enough.then(|| (finer, work(mesh * segments, step) / work(segments, 1.0)))
        });
        candidates.min_by(|a, b| a.1.total_cmp(&b.1))
    }

    /// The most accurate refinement whose work is at most `growth` times that of the run with `segments` edges, by
    /// bisection of the target error of [`cheapest`](Self::cheapest). Factors of one if there is none. The target is
    /// bracketed by 1e-3 and 1e3 times the present error.
    pub fn best_within(&self, growth: f64, segments: f64, free: Free) -> RefinementFactors {
        let [mut low, mut high] =
            [1e-3, 1e3].map(|factor| factor * (self.mesh + self.step).max(1e-300));
        let within =
            |target: f64| self.cheapest(target, segments, free).filter(|(_, cost)| *cost <= growth);
        // The least work falls with a growing target: the smallest target within the allowed work is bracketed.
        for _ in 0..BISECTIONS {
            let middle = (low * high).sqrt();
            match within(middle) {
                Some(_) => high = middle,
                None => low = middle,
            }
        }
        within(high).map_or(RefinementFactors { mesh: 1.0, step: 1.0 }, |(finer, _)| finer)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BOTH: Free = Free { mesh: true, step: true };

    fn model(mesh: f64, step: f64) -> ErrorModel {
        ErrorModel { mesh, step, mesh_order: 2.0, step_order: 2.0 }
    }

    /// Without a price for a step both errors are equal at the least work: with the orders equal, d(mesh part) = d(step
    /// part).
    #[test]
    fn cheapest_refinement_shares_the_error_equally_on_large_meshes() {
        let model = model(4e-3, 1e-3);
        let (finer, cost) = model.cheapest(1e-3, 1e9, BOTH).unwrap();
        let [mesh, step] = [4e-3 / finer.mesh.powi(2), 1e-3 / finer.step.powi(2)];
        assert!(
            (mesh / step - 1.0).abs() < 0.1 && (mesh + step - 1e-3).abs() < 1e-9,
            "{mesh} {step}"
        );
        // sqrt(4e-3/5e-4) sqrt(1e-3/5e-4)
        assert!((cost / 4.0 - 1.0).abs() < 0.01, "{cost}");
    }

    /// Beyond the largest extrapolation the error falls with half the order.
    #[test]
    fn far_extrapolation_halves_the_order() {
        let left =
            model(1.0, 0.0).after(RefinementFactors { mesh: 4.0 * MAX_EXTRAPOLATION, step: 1.0 });
        assert!((left * (2.0 * MAX_EXTRAPOLATION).powi(2) - 1.0).abs() < 1e-12, "{left}");
        for finer in [0.5, 3.0, MAX_EXTRAPOLATION, 50.0] {
            assert!((needed(effective(finer)) / finer - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn allowed_error_is_kept_without_coarsening_a_part() {
        for errors in [[0.3, 0.4], [0.1, 40.0], [9.0, 1e-3], [4.0, 5.0], [0.6, 0.45]] {
            let model = ErrorModel::of_second_order(errors);
            let finer = model.finer_for(1.0, 30);
            let left = model.after(finer);
            assert!(finer.mesh >= 1.0 && finer.step >= 1.0);
            // The error after the refinement is below the target of 1, and not far below it.
            assert!(left <= 1.0 && left > 0.6, "{errors:?}: {finer:?}, {left}");
        }
    }

    /// Of a change of 3 by a refinement by two, second order explains an error of 1, first order one of 3.
    #[test]
    fn larger_errors_of_the_same_change_have_lower_orders() {
        let errors = model(1.0, 2.0).underestimated(3.0, 0.25);
        assert!(
            (errors.mesh_order - 1.0).abs() < 1e-12 && errors.mesh == 3.0 && errors.step == 6.0
        );
        assert_eq!(model(1.0, 2.0).underestimated(1e6, 0.25).mesh_order, 0.25);
        assert_eq!(model(1.0, 2.0).underestimated(3.0, f64::INFINITY).mesh_order, 2.0);
    }

    #[test]
    fn given_part_is_not_refined() {
        let free = Free { mesh: false, step: true };
        assert!(model(2e-3, 1e-3).cheapest(1e-3, 10.0, free).is_none());
        // Second order: 5e-4 of the mesh remain, so that 1e-3/2 is left for the step: sqrt(2).
        let (finer, _) = model(5e-4, 1e-3).cheapest(1e-3, 10.0, free).unwrap();
        assert_eq!(finer.mesh, 1.0);
        assert!((finer.step - 2f64.sqrt()).abs() < 1e-6);
    }

    #[test]
    fn bounded_refinement_uses_its_work() {
        let model = model(1e-2, 1e-2);
        let finer = model.best_within(6.0, 50.0, BOTH);
        let cost = work(50.0 * finer.mesh, finer.step) / work(50.0, 1.0);
        // The allowed work is 6; candidates are a few per cent apart.
        assert!(cost <= 6.0 && cost > 5.0, "{cost}");
        assert!(model.after(finer) < model.after(RefinementFactors { mesh: 2.0, step: 2.0 }));
    }
}
