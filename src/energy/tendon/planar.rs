//! A tendon around an inner node of a rod in a plane: hand-derived gradient and Hessian by the unknowns.
//!
//! Input: a part of the route, the tension (N), the components of the first director across the tangent (in the plane,
//! and along its normal), and the coordinates of three nodes, m. The length of the part depends on the mean length `l`
//! of both edges and on their curvature `k = 2 tan(phi/2)`, which is `k1 = c0 k` and `k2 = -c1 k` towards the
//! directors. By the lengths of the edges, and by the angle `phi` between them, all derivatives of the energy are
//! short. Those by an edge vector follow from those by its length `r` and its angle: with the unit tangent `t`, the
//! normal `n` to its left and the derivatives `E_r`, `E_a` by both,
//!
//! ```text
//! gradient  E_r t + E_a/r n     Hessian  E_rr t t' + (E_ra/r - E_a/r^2)(t n' + n t') + (E_aa/r^2 + E_r/r) n n'
//! ```

use crate::energy::planar_bend::{PlanarBend, curvature_between, to_nodes};
use crate::energy::tendon::RoutePart;
use crate::energy::tendon::route_length::RouteLength;
use crate::numerics::scalar::Scalar;

/// Length, inverse length, 1/m, and unit tangent of an edge.
#[derive(Clone, Copy)]
struct Edge<D> {
    length: D,
    inverse: D,
    tangent: [D; 2],
}

impl<D: Scalar> Edge<D> {
    /// The edge with the vector `[x, y]`, m.
    #[inline]
    fn new([x, y]: [D; 2]) -> Self {
        let length = (x * x + y * y).sqrt();
        let inverse = length.recip();
        Self { length, inverse, tangent: [x * inverse, y * inverse] }
    }

    /// The vector with the components `along` the tangent and `across` it, to the left.
    #[inline]
    fn vector(&self, [along, across]: [D; 2]) -> [D; 2] {
        let [x, y] = self.tangent;
        [along * x - across * y, along * y + across * x]
    }

    /// The matrix in the axes of the plane of a matrix by tangent and normal: its rows are those of this edge, its
    /// columns those of `other`.
    #[inline]
    fn matrix(&self, other: &Self, [along, across]: [[D; 2]; 2]) -> [[D; 2]; 2] {
        let (along, across) = (other.vector(along), other.vector(across));
        let columns = [0, 1].map(|c| self.vector([along[c], across[c]]));
        [[columns[0][0], columns[1][0]], [columns[0][1], columns[1][1]]]
    }
}

/// The tendon around the node of two edges, with the derivatives of its energy by their lengths and by the angle `phi`
/// between them.
pub(crate) struct PlanarTendon<D> {
    e: Edge<D>,
    f: Edge<D>,
    /// By each length, N.
    force: D,
    /// By the angle, N m.
    moment: D,
    /// By two lengths, N/m.
    by_lengths: D,
    /// By a length and the angle, N.
    by_length_and_angle: D,
    /// By the angle twice, N m.
    by_angles: D,
}

impl<D: Scalar> PlanarTendon<D> {
    /// The tendon with a `tension`, N, along the `part` of its route. `across` has the components of the first director
    /// in the plane and along its normal, `q` the coordinates of the three nodes, m.
    #[inline]
    pub fn new(part: &RoutePart<D>, tension: D, across: [D; 2], q: &[D; 6]) -> Self {
        let e = Edge::new([q[2] - q[0], q[3] - q[1]]);
        let f = Edge::new([q[4] - q[2], q[5] - q[3]]);
        let curvature = curvature_between(e.tangent, f.tangent);
        let [within, out] = [curvature * across[0], -(curvature * across[1])];
        let mean = (e.length + f.length) * 0.5;
        let route = RouteLength::new(part, mean, [within, out], D::from(0.0));
        // The length depends on l - k r only, with the offset r to the left of the tangent.
        let offset = part.offset[0] * across[0] - part.offset[1] * across[1];
        let (slope, own) = (PlanarBend::slope(curvature), route.by_length_twice * tension);
        let stress = -(tension * route.by_length * offset);
        let [moment, by_angles] =
            PlanarBend::by_angle(curvature, [own * offset * offset], [stress]);
        Self {
            e,
            f,
            force: tension * route.by_length * 0.5,
            moment,
            by_lengths: own * 0.25,
            by_length_and_angle: -(own * offset * slope * 0.5),
            by_angles,
        }
    }

    /// The gradient by the coordinates, N.
    #[inline]
    pub fn gradient(&self) -> [D; 6] {
        let Self { e, f, force, moment, .. } = self;
        to_nodes(
            e.vector([*force, -(*moment * e.inverse)]),
            f.vector([*force, *moment * f.inverse]),
        )
    }

    /// Gradient, N, and Hessian, N/m, by the coordinates.
    #[inline]
    pub fn tangent(&self) -> ([D; 6], [[D; 6]; 6]) {
        let Self { e, f, force, by_lengths, by_length_and_angle, by_angles, .. } = self;
        // The angle grows with that of the second edge, and falls with that of the first.
        let own = |edge: &Edge<D>, moment: D, mixed: D| {
            let mixed = (mixed - moment * edge.inverse) * edge.inverse;
            let across = (*by_angles * edge.inverse + *force) * edge.inverse;
            edge.matrix(edge, [[*by_lengths, mixed], [mixed, across]])
        };
        let ee = own(e, -self.moment, -*by_length_and_angle);
        let ff = own(f, self.moment, *by_length_and_angle);
        let fe = f.matrix(
            e,
            [
                [*by_lengths, -(*by_length_and_angle * e.inverse)],
                [*by_length_and_angle * f.inverse, -(*by_angles * e.inverse * f.inverse)],
            ],
        );
        // Rows of the edges by the nodes, then columns.
        let rows = [
            to_nodes(ee[0], [fe[0][0], fe[1][0]]),
            to_nodes(ee[1], [fe[0][1], fe[1][1]]),
            to_nodes(fe[0], ff[0]),
            to_nodes(fe[1], ff[1]),
        ];
        let mut hessian = [[D::from(0.0); 6]; 6];
        for c in 0..6 {
            let column = to_nodes([rows[0][c], rows[1][c]], [rows[2][c], rows[3][c]]);
            (0..6).for_each(|r| hessian[r][c] = column[r]);
        }
        (self.gradient(), hessian)
    }
}
