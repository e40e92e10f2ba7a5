//! Small asymmetric initial displacement of the nodes: `initial.perturbation`.
//!
//! A symmetric rod stays at an unstable state without a disturbance. Node `i` at the fraction `u` of the length is
//! displaced by `p L w(u) g(u)/max|w g|` across the rod, with the perturbation `p` (in rod lengths) and the length
//! `L` (m). The window `w` has a factor for each end: 1 if free, the distance from a hinge or roller, its square
//! for a clamped or recorded end. `g` is a sum of three sines without common periods, so that no mode of a
//! symmetric rod is orthogonal to it. In a plane the displacement is along the normal of the rod, in space along a
//! direction that rotates from 0.7 to 2 rad about it. Output: the unknowns, in place, over any number type. Angles,
//! and coordinates that supports or recordings hold, are unchanged. Starts of motions and equilibria use it.

use crate::numerics::scalar::RodScalar;
use crate::numerics::vector::{Vector, add, cross, dot, scale, sub, unit};
use crate::problem::{Discretized, Model, Setup};
use crate::scene::{End, Support};

/// Amplitude, wave number over the length (rad) and phase (rad) of the three sines; any values without common periods
/// serve.
const SINES: [[f64; 3]; 3] = [[1.0, 2.1, 1.9], [0.7, 4.3, 0.6], [0.5, 7.7, 2.7]];
/// Direction of the displacement about the rod at both ends, rad; linear between.
const DIRECTION: [f64; 2] = [0.7, 2.0];

/// Smallest largest value of window times sines by which the shape is divided, against division by zero.
const SMALLEST_SHAPE: f64 = 1e-9;

impl<M: Model> Discretized<'_, M> {
    /// Displaces the nodes in `q` by `initial.perturbation` rod lengths, as [`perturb_by`](Self::perturb_by).
    pub(crate) fn perturb<D: RodScalar>(&self, setup: &Setup<D, M>, q: &mut [D]) {
        self.perturb_by(setup, self.scene().initial.perturbation, q);
    }

    /// Displaces the nodes in `q` across the rod, with the shape of the module's header, whose largest value over all
    /// nodes is `amplitude` rod lengths. The direction is the normal of the rod in a plane; in space it rotates from
    /// 0.7 to 2 rad ([`DIRECTION`]) about the rod, from the axis with the smallest component along it. Coordinates that
    /// a support or recording holds, and angles, are unchanged.
    pub(crate) fn perturb_by<D: RodScalar>(
        &self,
        setup: &Setup<D, M>,
        amplitude: f64,
        q: &mut [D],
    ) {
        let places = setup.mesh.places();
        let shape: Vec<f64> = places.iter().map(|u| self.window(*u) * sines(*u)).collect();
        let largest = shape.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
        let size = setup.mesh.length * (amplitude / largest.max(SMALLEST_SHAPE));
        let (axes, last) = (M::STRIDE.min(3), self.nodes() - 1);
        let node = |i: usize| -> Vector<D> {
            let mut x = [D::from(0.0); 3];
            x[..axes].copy_from_slice(&q[M::STRIDE * i..][..axes]);
            x
        };
        // Across the rod: in a plane the normal, in space a direction that rotates along the rod.
        let normal = |i: usize| {
            let tangent = unit(sub(node(last.min(i + 1)), node(i.saturating_sub(1))));
            if axes == 2 {
                return cross([0.0, 0.0, 1.0].map(D::from), tangent);
            }
            // The axis with the smallest component along the tangent.
            let k = (0..3)
                .min_by(|a, b| tangent[*a].abs().value().total_cmp(&tangent[*b].abs().value()));
            let axis = std::array::from_fn(|c| D::from(f64::from(u8::from(Some(c) == k))));
            let first = unit(sub(axis, scale(tangent, dot(axis, tangent))));
            let angle = DIRECTION[0] + (DIRECTION[1] - DIRECTION[0]) * places[i];
            let second = scale(cross(tangent, first), D::from(angle.sin()));
            add(scale(first, D::from(angle.cos())), second)
        };
        let moved: Vec<Vector<D>> =
            (0..=last).map(|i| add(node(i), scale(normal(i), size * shape[i]))).collect();
        // Only unknowns that neither a support nor a recording holds are changed.
        let (free, prescribed) = (self.free(), self.prescribed());
        for i in 0..=last {
            for c in 0..axes {
                let place = M::STRIDE * i + c;
                if free.contains(&place) && !prescribed.contains(place) {
                    q[place] = moved[i][c];
                }
            }
        }
    }

    /// Product of the factors of both ends at the fraction `u` of the length, clamped to 0 .. 1. The factor is 1 for a
    /// free end, the distance (fraction) from a hinge or roller, and its square for a wall or recorded end.
    fn window(&self, u: f64) -> f64 {
        let u = u.clamp(0.0, 1.0);
        let end = |end: End, distance: f64| match self.scene().supports.at(end) {
            Support::Free => 1.0,
            Support::Pinned | Support::Roller => distance,
            Support::Clamped | Support::Recorded => distance * distance,
        };
        end(End::Start, u) * end(End::End, 1.0 - u)
    }
}

/// Sum of the sines `a sin(k u + phase)` of [`SINES`] at the fraction `u` of the length.
fn sines(u: f64) -> f64 {
    SINES.iter().map(|[amplitude, wave, phase]| amplitude * (wave * u + phase).sin()).sum()
}
