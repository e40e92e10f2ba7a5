//! Richardson's extrapolation, and the orders that errors of mesh and step are known to have.

use crate::accuracy::aim::is_struck;
use crate::scene::{Scene, Time};

/// A refinement by a factor of mesh or step, whose error falls with a power of it; below one it is a coarser run.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Extrapolation {
    /// Edges or steps over those of the other run.
    pub ratio: f64,
    /// The power.
    pub order: f64,
}

impl Extrapolation {
    /// The error after the refinement, over the change that it makes: of `e = C h^p`, the change is `e (r^p - 1)`.
    pub fn error_after(self) -> f64 {
        (self.ratio.powf(self.order) - 1.0).recip()
    }

    /// The error before the refinement, over the change that it makes.
    pub fn error_before(self) -> f64 {
        1.0 + self.error_after()
    }
}

/// The order of the errors of a mesh: what walls at nodes cut off, or hold, goes with the length of an edge, all else with
/// its square.
pub(crate) fn smooth_mesh_order(scene: &Scene) -> f64 {
    if scene.supports.cut_edges() { 1.0 } else { 2.0 }
}

/// The same of motions that begin with a jump of velocities: mode `k` moves by `k^-3`, and is out of phase from the root of the
/// number of edges on: what those move by in all goes with the length of an edge.
pub(super) fn order_of_mesh(scene: &Scene) -> f64 {
    if is_struck(scene) { 1.0 } else { smooth_mesh_order(scene) }
}

/// The order of the errors of a step.
pub(crate) fn step_order(time: &Time) -> f64 {
    let dissipates = time.scheme.takes_beta() && time.beta > 0.5;
    if dissipates { 1.0 } else { time.scheme.traits().order as f64 }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Errors 1/n^2 of 10, 20 and 5 edges: the changes are -3/4 and 3 times the error on 10 edges.
    #[test]
    fn errors_of_a_power_law_follow_from_its_changes() {
        let finer = Extrapolation { ratio: 2.0, order: 2.0 };
        assert!((finer.error_before() - 4.0 / 3.0).abs() < 1e-15);
        assert!((finer.error_after() - 1.0 / 3.0).abs() < 1e-15);
        let coarser = Extrapolation { ratio: 0.5, order: 2.0 };
        assert!((coarser.error_before() + 1.0 / 3.0).abs() < 1e-15);
    }
}
