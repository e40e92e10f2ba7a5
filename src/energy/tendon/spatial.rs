//! A tendon around an inner node of a rod in space: hand-derived gradient and Hessian by the unknowns.
//!
//! Input: a part of the route, the tension (N), the reference frames of both edges, and the unknowns
//! `[x0, theta0, x1, theta1, x2]` (m, rad). The length of the part depends on the mean length `l` of the edges and on
//! the strains of their joint: both curvatures, and the angle `tau` of the twist `2 tan(tau/2)`. Its derivatives by the
//! strains ([`RouteLength`]) times the tension are stresses and a stiffness of the joint, N m, which `energy::joint`
//! and `energy::bend_twist` convert to the edges. Both edges have the axial force `T/2 dL/dl`. In addition the Hessian
//! by the edges has
//!
//! ```text
//! a b' + b a' + E_ll a a'
//! ```
//!
//! with the derivative `a` of `l` by the edges, and that of `dE/dl`, by the strains only, `b`.

use crate::energy::bend_twist::{
    EDGE_UNKNOWNS, EdgeState, UNKNOWNS, by_edges, spread, to_edges, to_nodes,
};
use crate::energy::frame::EdgeFrame;
use crate::energy::joint::JointStrains;
use crate::energy::tendon::RoutePart;
use crate::energy::tendon::route_length::RouteLength;
use crate::numerics::scalar::Scalar;
use crate::numerics::vector::map_components;

/// The tendon around the node of two edges.
pub(crate) struct SpatialTendon<D> {
    e: EdgeState<D>,
    f: EdgeState<D>,
    joint: JointStrains<D>,
    tension: D,
    route: RouteLength<D>,
}

impl<D: Scalar> SpatialTendon<D> {
    /// The tendon with a `tension`, N, along the `part` of its route. `frames` are the references of both edges, `q`
    /// the unknowns of the element.
    #[inline]
    pub fn new(
        part: &RoutePart<D>,
        tension: D,
        frames: &[EdgeFrame<D>],
        q: &[D; UNKNOWNS],
    ) -> Self {
        let [e0, e1, e2, te, f0, f1, f2, tf] = to_edges(q);
        let e = EdgeState::new(&frames[0], [e0, e1, e2], te);
        let f = EdgeState::new(&frames[1], [f0, f1, f2], tf);
        // The derivatives of the joint do not depend on its own total twist.
        let joint = JointStrains::new(&e.edge, &f.edge, D::from(0.0));
        let [first, second, _] = joint.strains;
        let twist = joint.cayley_twist(&e.edge, &f.edge);
        let route = RouteLength::new(part, (e.length + f.length) * 0.5, [first, second], twist);
        Self { e, f, joint, tension, route }
    }

    /// Axial force of both edges, N: each has half of the mean length.
    #[inline]
    fn force(&self) -> D {
        self.tension * self.route.by_length * 0.5
    }

    /// The derivative by the 8 unknowns of the edges of an energy with the given stresses of the joint, N m, and axial
    /// `force` of both edges, N.
    #[inline]
    fn pull(&self, stress: &[D; 3], force: D) -> [D; EDGE_UNKNOWNS] {
        let pull = self.joint.pull(&self.e.edge, &self.f.edge, stress);
        let [e0, e1, e2, te] = self.e.gradient(pull.e, force);
        let [f0, f1, f2, tf] = self.f.gradient(pull.f, force);
        [e0, e1, e2, te, f0, f1, f2, tf]
    }

    /// The gradient by the unknowns, N (N m for angles).
    #[inline]
    pub fn gradient(&self) -> [D; UNKNOWNS] {
        let stress = map_components(&self.route.by_strains(), |x| x * self.tension);
        to_nodes(&self.pull(&stress, self.force()))
    }

    /// Gradient and Hessian by the unknowns, N/m (N for an angle and a position, N m for two angles).
    #[inline]
    pub fn tangent(&self) -> ([D; UNKNOWNS], [[D; UNKNOWNS]; UNKNOWNS]) {
        let Self { e, f, joint, tension, route } = self;
        let stress = map_components(&route.by_strains(), |x| x * *tension);
        let stiffness = route.by_strains_twice(*tension);
        let by_joint = joint.tangent(&e.edge, &f.edge, &stiffness, &stress);
        let mut local = by_edges([e, f], &by_joint, self.force(), D::from(0.0));
        // With b + E_ll/2 a in place of b the last term of the header is contained in the first two.
        let mixed = map_components(&route.by_length_and_strains(), |x| x * *tension);
        let by_both = self.pull(&mixed, *tension * route.by_length_twice * 0.25);
        let zero = D::from(0.0);
        let ([e0, e1, e2], [f0, f1, f2]) = (e.edge.tangent, f.edge.tangent);
        let half = map_components(&[e0, e1, e2, zero, f0, f1, f2, zero], |x| x * 0.5);
        for r in 0..EDGE_UNKNOWNS {
            for c in 0..=r {
                local.hessian[r][c] += half[r] * by_both[c] + by_both[r] * half[c];
            }
        }
        let spread = spread(local);
        (spread.gradient, spread.hessian)
    }
}
