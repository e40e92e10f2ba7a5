//! Loads without a potential on one edge: forces that turn with it, and moments in space.
//!
//! Input: components of forces on both nodes of an edge (N) along its tangent `t` and both directors, of a moment (N m)
//! about these, and of a moment about fixed axes. Further the unknowns of the edge, in space with its reference frame.
//! Output: the forces on the unknowns of the edge (N, N m for the angle; `planar_forces`, `spatial_forces`), and minus
//! their derivatives by these unknowns (N/m; `planar_tangent`, `spatial_tangent`), which are not symmetric. `scaled`
//! multiplies a load by a factor, `map` converts its scalar type.
//!
//! In the plane the components are those along the tangent and the normal to its left, and moments have no effect. In
//! space a moment `m` does the work `m . w` on the rotation `w` of the directors. With the reference tangent `t0`, from
//! which the directors are transported, and the angle `theta` of the edge of length `l`, that rotation is
//!
//! ```text
//! w = t x dt + (dtheta - (t0 x t).dt/(1 + t0.t)) t
//! ```
//!
//! where the last part is the turn of the directors by parallel transport over the spherical triangle of `t0`, `t` and
//! `t + dt`. So the second node carries `(m x t - (m.t) (t0 x t)/(1 + t0.t))/l`, the first one its negative, and the
//! angle `m.t`. Derivatives in space are computed in dual numbers. A moment about fixed axes has no potential in space
//! either (Ziegler 1968).

use crate::energy::autodiff::jacobian;
use crate::energy::frame::{EdgeFrame, one_plus_dot};
use crate::numerics::scalar::{RodScalar, Scalar};
use crate::numerics::vector::{Vector, add, combine, cross, dot, scale, sub};

/// Number of unknowns of an edge in space: positions of its nodes, and its angle between them.
const IN_SPACE: usize = 7;

/// Loads on one edge whose directions depend on it.
#[derive(Clone, Copy, Debug)]
pub struct FollowerLoad<D> {
    /// Forces on the first and the second node along the tangent and both directors, N. In the plane they are along
    /// tangent and normal, and the third component has no meaning.
    pub forces: [[D; 3]; 2],
    /// Moment about the tangent and both directors, N m; not used in the plane.
    pub moment: [D; 3],
    /// Moment about the axes of the model, N m; not used in the plane.
    pub fixed_moment: [D; 3],
}

impl<D: Scalar> FollowerLoad<D> {
    /// A load with all components zero.
    pub fn zero() -> Self {
        let zero = [D::from(0.0); 3];
        Self { forces: [zero; 2], moment: zero, fixed_moment: zero }
    }

    /// The load with all forces and moments times `factor`.
    pub fn scaled(&self, factor: D) -> Self {
        self.map(|x| x * factor)
    }

    /// The load with every number converted to another number type.
    pub fn map<E: Scalar>(&self, convert: impl Fn(D) -> E) -> FollowerLoad<E> {
        FollowerLoad {
            forces: self.forces.map(|force| force.map(&convert)),
            moment: self.moment.map(&convert),
            fixed_moment: self.fixed_moment.map(&convert),
        }
    }

    /// The forces on the coordinates `q` of both nodes of an edge in the plane, N; moments are left out.
    pub fn planar_forces(&self, q: &[D; 4]) -> [D; 4] {
        let EdgeHeading { tangent: [x, y], .. } = EdgeHeading::at(q);
        let [first, second] =
            self.forces.map(|[along, across, _]| [along * x - across * y, along * y + across * x]);
        [first[0], first[1], second[0], second[1]]
    }

    /// Minus the derivatives of [`planar_forces`](Self::planar_forces) by the coordinates, N/m; rows are forces,
    /// columns coordinates. A force `a t + b n` changes by `(a n - b t) (n . de)/l` with the edge vector `e` of length
    /// `l`.
    pub fn planar_tangent(&self, q: &[D; 4]) -> [[D; 4]; 4] {
        let EdgeHeading { tangent: [x, y], inverse } = EdgeHeading::at(q);
        let normal = [-(y * inverse), x * inverse];
        let mut rows = [[D::from(0.0); 4]; 4];
        for (k, [along, across, _]) in self.forces.into_iter().enumerate() {
            let change = [-(along * y) - across * x, along * x - across * y];
            for r in 0..2 {
                for c in 0..2 {
                    let entry = change[r] * normal[c];
                    (rows[2 * k + r][c], rows[2 * k + r][2 + c]) = (entry, -entry);
                }
            }
        }
        rows
    }

    /// The forces on the unknowns `q` of an edge in space, N (N m for the angle). Its directors are transported from
    /// the reference `frame` and turned by the angle.
    pub fn spatial_forces(&self, q: &[D; IN_SPACE], frame: &EdgeFrame<D>) -> [D; IN_SPACE] {
        let edge: Vector<D> = [q[4] - q[0], q[5] - q[1], q[6] - q[2]];
        let inverse = dot(edge, edge).sqrt().recip();
        let tangent = scale(edge, inverse);
        let [first_director, second_director] = frame.material(tangent, q[3]);
        let turned = |[along, first, second]: [D; 3]| {
            add(scale(tangent, along), combine(first, first_director, second, second_director))
        };
        let [first, second] = self.forces.map(turned);
        let moment = add(turned(self.moment), self.fixed_moment);
        let torque = dot(moment, tangent);
        let transported = torque / one_plus_dot(frame.tangent, tangent);
        let turn = scale(cross(frame.tangent, tangent), transported);
        let pair = scale(sub(cross(moment, tangent), turn), inverse);
        let ([a, b, c], [x, y, z]) = (sub(first, pair), add(second, pair));
        [a, b, c, torque, x, y, z]
    }
}

impl<D: RodScalar> FollowerLoad<D> {
    /// Minus the derivatives of [`spatial_forces`](Self::spatial_forces) by the unknowns, in dual numbers; rows are
    /// forces, columns unknowns. N/m for coordinates; N and N m with the angle.
    pub fn spatial_tangent(
        &self,
        q: &[D; IN_SPACE],
        frame: &EdgeFrame<D>,
    ) -> [[D; IN_SPACE]; IN_SPACE] {
        let rows: [[D; IN_SPACE]; IN_SPACE] = jacobian(
            |over, q| {
                let q = q.first_chunk().expect("as many unknowns as were given");
                self.map(over).spatial_forces(q, &frame.map(over))
            },
            q,
        );
        rows.map(|row| row.map(|entry| -entry))
    }
}

/// An edge in the plane.
struct EdgeHeading<D> {
    /// Unit tangent.
    tangent: [D; 2],
    /// One over its length, 1/m.
    inverse: D,
}

impl<D: Scalar> EdgeHeading<D> {
    /// Tangent and inverse length of the edge from the first to the second node of the coordinates `q`, m.
    fn at(q: &[D; 4]) -> Self {
        let edge = [q[2] - q[0], q[3] - q[1]];
        let inverse = (edge[0] * edge[0] + edge[1] * edge[1]).sqrt().recip();
        Self { tangent: edge.map(|c| c * inverse), inverse }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use num_dual::Dual64;

    fn load() -> FollowerLoad<f64> {
        FollowerLoad {
            forces: [[0.3, -1.2, 0.7], [1.1, 0.4, -0.6]],
            moment: [0.2, -0.5, 0.9],
            fixed_moment: [-0.8, 0.1, 0.6],
        }
    }

    #[test]
    fn planar_tangent_equals_the_derivative_in_dual_numbers() {
        let q = [0.1, -0.2, 0.4, 0.3];
        let tangent = load().planar_tangent(&q);
        for c in 0..4 {
            let seeded: [Dual64; 4] = std::array::from_fn(|i| Dual64::new(q[i], f64::from(i == c)));
            let forces = load().map(Dual64::from).planar_forces(&seeded);
            for r in 0..4 {
                assert!((tangent[r][c] + forces[r].eps).abs() < 1e-14, "{r} {c}");
            }
        }
    }

    /// The work of a moment is that on the rotation of the directors, which follows from the directors themselves.
    #[test]
    fn spatial_moment_does_the_work_on_the_rotation_of_the_directors() {
        let reference = [0.0, 0.6, 0.8];
        let frame = EdgeFrame { tangent: reference, director: [1.0, 0.0, 0.0] };
        let q = [0.1, -0.2, 0.3, 0.7, 0.4, 0.5, 0.6];
        let mut own = load();
        own.forces = [[0.0; 3]; 2];
        let forces = own.spatial_forces(&q, &frame);
        for c in 0..7 {
            let q: [Dual64; 7] = std::array::from_fn(|i| Dual64::new(q[i], f64::from(i == c)));
            let edge = [q[4] - q[0], q[5] - q[1], q[6] - q[2]];
            let tangent = scale(edge, dot(edge, edge).sqrt().recip());
            let [d1, d2] = frame.map(Dual64::from).material(tangent, q[3]);
            let values = |v: [Dual64; 3]| v.map(|x| x.re);
            // Twice the rotation is the sum of all directors times (cross product) their rates.
            let rotation = [tangent, d1, d2]
                .map(|d| cross(values(d), d.map(|x| x.eps)))
                .into_iter()
                .fold([0.0; 3], |sum, part| add(sum, scale(part, 0.5)));
            let moment = add(
                own.fixed_moment,
                add(
                    scale(values(tangent), own.moment[0]),
                    combine(own.moment[1], values(d1), own.moment[2], values(d2)),
                ),
            );
            let work = dot(moment, rotation);
            assert!((forces[c] - work).abs() < 1e-13, "{c}: {} {work}", forces[c]);
        }
    }

    #[test]
    fn spatial_tangent_equals_differences_of_the_forces() {
        let frame = EdgeFrame { tangent: [0.0, 0.6, 0.8], director: [1.0, 0.0, 0.0] };
        let q = [0.1, -0.2, 0.3, 0.7, 0.4, 0.5, 0.6];
        let tangent = load().spatial_tangent(&q, &frame);
        for c in 0..7 {
            let at = |step: f64| {
                let mut q = q;
                q[c] += step;
                load().spatial_forces(&q, &frame)
            };
            let (after, before) = (at(1e-6), at(-1e-6));
            for r in 0..7 {
                let slope = (after[r] - before[r]) / 2e-6;
                assert!((tangent[r][c] + slope).abs() < 1e-8, "{r} {c}");
            }
        }
    }
}
