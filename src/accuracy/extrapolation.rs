//! Richardson extrapolation: the error `e = C h^p` from the change by a refinement, and the theoretical orders `p` of
//! mesh and step errors of a scene.
//!
//! [`Extrapolation`]: from the refinement factor `r` and the order `p`, the error before (`error_before`) or after the
//! refinement (`error_after`) over the change that it makes. [`smooth_mesh_order`] is the theoretical order of the mesh
//! error: 2, or 1 with an end that is clamped at nodes, or a recorded end that holds several markers. [`order_of_mesh`]
//! is 1 also after a jump of velocities. [`step_order`] is the order of the scheme, or 1 for Newmark's method with
//! numerical damping.

use crate::accuracy::calculation::begins_with_velocity_jump;
use crate::scene::{Scene, Time};

/// A refinement of mesh or step by a factor `r`, whose error falls with `r^p`; a factor below one is a coarser run.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Extrapolation {
    /// Edges or steps over those of the other run.
    pub ratio: f64,
    /// The order `p`.
    pub order: f64,
}

impl Extrapolation {
    /// The error after the refinement over the change that it makes, `1/(r^p - 1)`: for `e = C h^p` the change is
    /// `e (r^p - 1)`.
    pub fn error_after(self) -> f64 {
        (self.ratio.powf(self.order) - 1.0).recip()
    }

    /// The error before the refinement over the change that it makes, `r^p/(r^p - 1)`.
    pub fn error_before(self) -> f64 {
        1.0 + self.error_after()
    }
}

/// The theoretical order of the mesh error of smooth motions. It is one if an end is clamped at nodes
/// (`supports.clamp`), or a recorded end holds several markers: that suppresses the bending of half an edge behind it.
/// It is two otherwise.
pub(crate) fn smooth_mesh_order(scene: &Scene) -> f64 {
    if scene.supports.cut_edges() { 1.0 } else { 2.0 }
}

/// The theoretical order of the mesh error: one if the scene has a `supports.motion`, or an initial velocity or angular
/// velocity ([`begins_with_velocity_jump`]), otherwise that of smooth motions. After such a jump of velocities mode `k`
/// has an amplitude of order `k^-3`. Modes above the root of the number of edges have a wrong phase: the sum of their
/// amplitudes decreases with the edge length.
pub(super) fn order_of_mesh(scene: &Scene) -> f64 {
    if begins_with_velocity_jump(scene) { 1.0 } else { smooth_mesh_order(scene) }
}

/// The theoretical order of the step error of the scene's scheme: one for Newmark with numerical damping (`beta` above
/// 0.5), otherwise that of the method.
pub(crate) fn step_order(time: &Time) -> f64 {
    // With beta above 1/2 the numerical damping of Newmark's method is an error of first order.
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
