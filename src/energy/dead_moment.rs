//! Element for a dead moment: a constant moment `M` about the normal of the plane on one edge.
//!
//! Energy, J: `E = -M phi` with the moment `M`, N m, and the angle `phi` of an edge, counter-clockwise from its
//! direction at rest. The element returns the energy at the angle in (-pi, pi], its gradient, N, and Hessian, N/m,
//! by the coordinates of both nodes, m. The rod's potential continues the angle from edge to edge (`rod::Moments`).
//! A simulation continues it beyond whole turns of the first edge (`Rod::winding_jump`, summed in `State::wound`).
//! In space a constant moment has no potential (Ziegler 1968), hence no element there.
//!
//! Hand derivation: `grad phi = n = perp(e)/|e|^2` and `Hess phi = -(u n' + n u')`, `u = e/|e|^2`, by the edge vector
//! `e`.

use crate::energy::{Element, Local};
use crate::numerics::scalar::Scalar;

/// A constant moment on one edge. Unknowns: `[x0, y0, x1, y1]` of its nodes, m.
#[derive(Clone, Copy, Debug)]
pub struct DeadMoment<D> {
    /// N m, counter-clockwise.
    pub moment: D,
    /// The edge's direction at rest, of any length.
    pub rest: [D; 2],
}

/// The vectors `u = e/|e|^2` and `n = perp(u)` (`u` rotated by +90 degrees), 1/m, of the edge `e` from the first to the
/// second node of `q`.
#[inline]
fn reciprocal<D: Scalar>(q: &[D; 4]) -> ([D; 2], [D; 2]) {
    let e = [q[2] - q[0], q[3] - q[1]];
    let inverse = (e[0] * e[0] + e[1] * e[1]).recip();
    let u = e.map(|c| c * inverse);
    (u, [-u[1], u[0]])
}

impl<D: Scalar> Element<D, 4> for DeadMoment<D> {
    const NAME: &'static str = "dead moment";
    type Over<E: Scalar> = DeadMoment<E>;

    /// The element with every parameter converted to another number type.
    fn map<E: Scalar>(&self, convert: impl Fn(D) -> E) -> DeadMoment<E> {
        DeadMoment { moment: convert(self.moment), rest: self.rest.map(&convert) }
    }
    /// The energy `-M phi`, J, at the nodes `q`, with the angle `phi` of the edge from its direction at rest, in (-pi,
    /// pi].
    fn energy(&self, q: &[D; 4]) -> D {
        // Cross and scalar product with the rest direction: sine and cosine of the angle, with a
        // common factor.
        let ([a, b], [x, y]) = (self.rest, [q[2] - q[0], q[3] - q[1]]);
        -(self.moment * (a * y - b * x).atan2(a * x + b * y))
    }
    /// dE/dq = -M dphi/dq at the nodes `q`, derived by hand, N.
    fn gradient(&self, q: &[D; 4]) -> [D; 4] {
        let (_, n) = reciprocal(q);
        let g = n.map(|c| c * self.moment);
        [g[0], g[1], -g[0], -g[1]]
    }
    /// E, J, dE/dq, N, and the full matrix d2E/dq2, N/m, at the nodes `q`, derived by hand. The block of one node twice
    /// is `M (u n' + n u')`, that of both nodes its negative.
    fn tangent(&self, q: &[D; 4]) -> Local<D, 4> {
        let (u, n) = reciprocal(q);
        let entry = |r: usize, c: usize| self.moment * (u[r] * n[c] + n[r] * u[c]);
        let (a, b, c) = (entry(0, 0), entry(0, 1), entry(1, 1));
        Local {
            energy: self.energy(q),
            gradient: self.gradient(q),
            hessian: [[a, b, -a, -b], [b, c, -b, -c], [-a, -b, a, b], [-b, -c, b, c]],
        }
    }
}
