//! Elastic joints between a body and a clamp in space: rotational springs and hinges, with energy and derivatives.
//!
//! Input: the rotation `Q` of the clamp in the axes of the body. With `Q0` at rest, the rotation from rest is `W = Q0'
//! Q` in the axes of the clamp. A spring has the energy `sum k_c (xi_c - n_c)^2/2`, J, of the rotation vector `xi = log
//! W`, rad, which needs a rotation `W` below half a turn. Its stiffnesses `k_c` are about both directors and the
//! tangent of the clamp, N m/rad. The natural rotation `n`, rad, is zero except for viscous moments in a time step. A
//! hinge with the axis `a` has `k (1 - a.W a)`: it turns freely about its axis, and resists other rotations with the
//! stiffness `k`. Output: energy (`energy`), and first and second derivatives (`gradient`, `tangent`), N m, by further
//! rotations (rad). Entries 0 to 2 are by rotations of the body, 3 to 5 by those of the clamp, each in its own axes.
//! The matrix of second derivatives is symmetric.

use crate::energy::Local;
use crate::numerics::out_of_line::OutOfLine;
use crate::numerics::rotation::{
    Matrix3, cross_matrix, exponential, inverse, logarithm, product, tangent_map, times, transpose,
    transposed_times,
};
use crate::numerics::scalar::{RodScalar, Scalar};
use crate::numerics::vector::{Vector, dot};
use nalgebra::SVector;
use num_dual::{Dual2SVec, DualSVec};

/// Resistance of a joint against relative rotation.
#[derive(Clone, Copy, Debug)]
pub enum JointStiffness<D> {
    /// Stiffnesses of rotations about both directors and the tangent of the clamp, N m/rad.
    Spring(Vector<D>),
    /// Free rotation about an axis, a unit vector in the axes of the clamp, with the stiffness across, N m/rad.
    Hinge(Vector<D>, D),
}

/// The law of an elastic joint.
#[derive(Clone, Copy, Debug)]
pub struct ElasticJoint<D> {
    /// Rotation of the clamp in the axes of the body at rest.
    pub rest: Matrix3<D>,
    /// Rotation vector from rest at which a spring has no moment, rad: zero except for viscous moments in a time step.
    /// Hinges ignore it.
    pub natural: Vector<D>,
    /// Its resistance.
    pub stiffness: JointStiffness<D>,
}

impl<D: Scalar> ElasticJoint<D> {
    /// The law with every number converted to another number type.
    fn map<E: Scalar>(&self, convert: impl Fn(D) -> E + Copy) -> ElasticJoint<E> {
        ElasticJoint {
            rest: self.rest.map(|row| row.map(convert)),
            natural: self.natural.map(convert),
            stiffness: match self.stiffness {
                JointStiffness::Spring(k) => JointStiffness::Spring(k.map(convert)),
                JointStiffness::Hinge(axis, k) => {
                    JointStiffness::Hinge(axis.map(convert), convert(k))
                }
            },
        }
    }

    /// The rotation vector from rest, rad, in the axes of the clamp, at the rotation `relative` of the clamp in the
    /// axes of the body. It needs a rotation below half a turn.
    pub fn rotation(&self, relative: &Matrix3<D>) -> Vector<D> {
        logarithm(&product(&transpose(&self.rest), relative))
    }

    /// Energy, J, at the rotation `relative` of the clamp in the axes of the body. Of a spring it is the sum of half
    /// the stiffnesses times the squared differences of the rotation vector from the natural one. Of a hinge with the
    /// axis `a` it is `k |W a - a|^2/2`, with the rotation `W` from rest. A spring needs rotations from rest below half
    /// a turn.
    pub fn energy(&self, relative: &Matrix3<D>) -> D {
        let turned = product(&transpose(&self.rest), relative);
        match self.stiffness {
            JointStiffness::Spring([k1, k2, k3]) => {
                let ([a, b, c], [a0, b0, c0]) = (logarithm(&turned), self.natural);
                let (a, b, c) = (a - a0, b - b0, c - c0);
                (k1 * a * a + k2 * b * b + k3 * c * c) * 0.5
            }
            // Half the square of the change of the axis, without cancellation.
            JointStiffness::Hinge(axis, k) => {
                let moved = times(&turned, axis);
                let change = [0, 1, 2].map(|c| moved[c] - axis[c]);
                k * dot(change, change) * 0.5
            }
        }
    }

    /// Energy, J, after further rotations from `relative`: of the body by the rotation vector `turns[0..3]`, of the
    /// clamp by `turns[3..6]`, rad, each in its own axes.
    fn turned_energy(&self, relative: &Matrix3<D>, turns: &[D; 6]) -> D {
        self.energy(&turned_relative(relative, turns))
    }

    /// First derivatives of the energy of a spring of this `stiffness`, N m, at the rotation `relative` of the clamp in
    /// the axes of the body: by rotations of the body, then of the clamp, each in its own axes.
    fn moments(&self, stiffness: Vector<D>, relative: &Matrix3<D>) -> [D; 6] {
        let [d, e, f] = moment_of_spring(stiffness, self.natural, self.rotation(relative));
        let [a, b, c] = times(relative, [d, e, f]);
        [-a, -b, -c, d, e, f]
    }
}

/// Moment of a spring on its clamp, N m, in the axes of the clamp, at the rotation vector `xi` with the `natural` one.
fn moment_of_spring<D: Scalar>(
    stiffness: Vector<D>,
    natural: Vector<D>,
    xi: Vector<D>,
) -> Vector<D> {
    let force = [0, 1, 2].map(|c| stiffness[c] * (xi[c] - natural[c]));
    transposed_times(&inverse(&tangent_map(xi)), force)
}

/// The rotation `relative` of a clamp in the axes of its body after further rotations: of the body by the rotation
/// vector `turns[0..3]`, of the clamp by `turns[3..6]`, rad, each in its own axes.
fn turned_relative<D: Scalar>(relative: &Matrix3<D>, turns: &[D; 6]) -> Matrix3<D> {
    let [a, b, c, d, e, f] = *turns;
    let clamp = product(relative, &exponential([d, e, f]));
    let back = exponential([a, b, c]);
    let columns = transpose(&clamp).map(|column| transposed_times(&back, column));
    transpose(&columns)
}

impl<D: RodScalar> ElasticJoint<D> {
    /// First derivatives of the energy, N m, at the rotation `relative` of the clamp in the axes of the body: three by
    /// rotations of the body, three by those of the clamp, each in its own axes. Those of a spring follow from
    /// `d xi = T^-1 d phi` with the tangent map `T` at the rotation vector; those of a hinge are computed in dual
    /// numbers.
    pub fn gradient(&self, relative: &Matrix3<D>) -> [D; 6] {
        match self.stiffness {
            JointStiffness::Spring(stiffness) => self.moments(stiffness, relative),
            JointStiffness::Hinge(..) => {
                let over = |x: D| OutOfLine(DualSVec::<D, 6>::from_re(x));
                let (law, relative) = (self.map(over), relative.map(|row| row.map(over)));
                let energy = |turns: SVector<DualSVec<D, 6>, 6>| {
                    law.turned_energy(&relative, &turns.data.0[0].map(OutOfLine)).0
                };
                num_dual::gradient(energy, &SVector::from([D::from(0.0); 6])).1.data.0[0]
            }
        }
    }

    /// Energy, J, first and second derivatives, N m, at the rotation `relative`. Entries 0 to 2 are by rotations of the
    /// body, 3 to 5 by those of the clamp, each in its own axes. Second derivatives of a spring are the symmetric part
    /// of the derivatives of its moments; those of a hinge are computed in dual numbers.
    pub fn tangent(&self, relative: &Matrix3<D>) -> Local<D, 6> {
        let at = SVector::from([D::from(0.0); 6]);
        let JointStiffness::Spring(stiffness) = self.stiffness else {
            let over = |x: D| OutOfLine(Dual2SVec::<D, 6>::from_re(x));
            let (law, relative) = (self.map(over), relative.map(|row| row.map(over)));
            let energy = |turns: SVector<Dual2SVec<D, 6>, 6>| {
                law.turned_energy(&relative, &turns.data.0[0].map(OutOfLine)).0
            };
            let (energy, gradient, hessian) = num_dual::hessian(energy, &at);
            return Local { energy, gradient: gradient.data.0[0], hessian: hessian.data.0 };
        };
        // The moment of the clamp is a function of the rotation vector alone: its derivatives by further rotations of
        // the clamp are those by the rotation vector times `T^-1`.
        let xi = self.rotation(relative);
        let natural = self.natural.map(|n| OutOfLine(DualSVec::<D, 3>::from_re(n)));
        let stiffness_over = stiffness.map(|k| OutOfLine(DualSVec::<D, 3>::from_re(k)));
        let moment = |xi: SVector<DualSVec<D, 3>, 3>| {
            let xi = xi.data.0[0].map(OutOfLine);
            SVector::from(moment_of_spring(stiffness_over, natural, xi).map(|moment| moment.0))
        };
        let (moment, slopes) = num_dual::jacobian(moment, &SVector::from(xi));
        let moment = moment.data.0[0];
        let slopes = [0, 1, 2].map(|i| [0, 1, 2].map(|j| slopes[(i, j)]));
        let by_clamp = product(&slopes, &inverse(&tangent_map(xi)));
        // The moment of the body is `-W m`, and its rotation `a` is the rotation `-W' a` of the clamp.
        let mut of_body = by_clamp;
        for (row, cross) in of_body.iter_mut().zip(cross_matrix(moment)) {
            for j in 0..3 {
                row[j] -= cross[j];
            }
        }
        let back = transpose(relative);
        let of_body = product(relative, &of_body);
        let (both, mixed) = (product(&of_body, &back), product(&by_clamp, &back));
        let mut hessian = [[D::from(0.0); 6]; 6];
        for i in 0..3 {
            for j in 0..3 {
                hessian[i][j] = (both[i][j] + both[j][i]) * 0.5;
                hessian[i + 3][j + 3] = (by_clamp[i][j] + by_clamp[j][i]) * 0.5;
                hessian[i][j + 3] = (of_body[i][j] + mixed[j][i]) * -0.5;
                hessian[j + 3][i] = hessian[i][j + 3];
            }
        }
        let [d, e, f] = moment;
        let [a, b, c] = times(relative, moment);
        let gradient = [-a, -b, -c, d, e, f];
        Local { energy: self.energy(relative), gradient, hessian }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::rotation::product;

    /// Oracle: differences of the energy.
    #[test]
    fn derivatives_of_joints_agree_with_differences() {
        let rest = exponential([0.3, -0.2, 1.0]);
        let axis = [0.6, 0.0, 0.8];
        for stiffness in [JointStiffness::Spring([1.0, 2.0, 0.5]), JointStiffness::Hinge(axis, 3.0)]
        {
            let law = ElasticJoint { rest, natural: [0.0, 0.1, -0.2], stiffness };
            for turn in [[0.0; 3], [0.02, -0.03, 0.01], [0.5, 0.4, -0.3]] {
                let relative = product(&rest, &exponential(turn));
                let found = law.tangent(&relative);
                let alone = law.gradient(&relative);
                let h = 1e-4;
                let at = |i: usize, a: f64, j: usize, b: f64| {
                    let mut turns = [0.0; 6];
                    turns[i] += a * h;
                    turns[j] += b * h;
                    law.turned_energy(&relative, &turns)
                };
                for i in 0..6 {
                    let slope = (at(i, 1.0, i, 0.0) - at(i, -1.0, i, 0.0)) / (2.0 * h);
                    assert!((slope - found.gradient[i]).abs() < 1e-7, "{turn:?} {i}");
                    // The moments of a spring by the same formula, those of a hinge in other dual numbers.
                    assert!((alone[i] - found.gradient[i]).abs() < 1e-15);
                    for j in 0..6 {
                        let second =
                            (at(i, 1.0, j, 1.0) - at(i, 1.0, j, -1.0) - at(i, -1.0, j, 1.0)
                                + at(i, -1.0, j, -1.0))
                                / (4.0 * h * h);
                        assert!((second - found.hessian[i][j]).abs() < 1e-6, "{turn:?} {i} {j}");
                    }
                }
            }
        }
    }
}
