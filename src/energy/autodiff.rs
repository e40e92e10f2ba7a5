//! First and second derivatives of a function `f(q)` by all its `Q` unknowns, in dual numbers (num-dual).
//!
//! Input: a [`ScalarFunction`] over any scalar, and the unknowns `q` of a rod's number type. [`gradient`] returns `Q`
//! first derivatives. [`hessian`] returns them with the second ones, of which only the lower triangle is valid.
//! [`jacobian`] returns the rows of a function with `R` results, always by one unknown at a time. For `f64`
//! gradient and Hessian are computed in one evaluation; for rods of dual numbers by one unknown, or one pair, at a
//! time. The function is then compiled for two more scalars only. They serve user-defined energies without
//! hand-derived formulas and the chain rule of their directors.

use crate::numerics::out_of_line::OutOfLine;
use crate::numerics::scalar::{RodScalar, Scalar};
use crate::numerics::vector::components;
use nalgebra::SVector;
use num_dual::{Dual, Dual2SVec, DualSVec, HyperDual};

/// A function of unknowns in any scalar. Its other arguments are numbers of the rod's scalar `B`.
pub trait ScalarFunction<B> {
    /// The value at the unknowns `q`; `over` converts numbers of the rod's scalar to that of the unknowns.
    fn at<D: Scalar>(&self, over: impl Fn(B) -> D + Copy, q: &[D]) -> D;
}

/// First derivatives of `f` by each of the `Q` unknowns at `q`, in their order: for `f64` all in one evaluation with
/// dual numbers, else in `Q` evaluations with one derivative each.
pub fn gradient<B: RodScalar, const Q: usize>(f: &impl ScalarFunction<B>, q: &[B; Q]) -> [B; Q] {
    if B::PLAIN {
        let at = |q: SVector<DualSVec<B, Q>, Q>| f.at(DualSVec::from_re, &q.data.0[0]);
        return num_dual::gradient(at, &SVector::from(*q)).1.data.0[0];
    }
    let over = |b: B| OutOfLine(Dual::from_re(b));
    components(|i| {
        let seeded: [_; Q] = components(|k| seed(over(q[k]), k == i));
        f.at(over, &seeded).0.eps
    })
}

/// First derivatives of `f` by the `Q` unknowns at `q`, and second ones, of which the lower triangle is valid. For
/// `f64` all at once, else by one pair of unknowns at a time (hyper-dual numbers).
pub fn hessian<B: RodScalar, const Q: usize>(
    f: &impl ScalarFunction<B>,
    q: &[B; Q],
) -> ([B; Q], [[B; Q]; Q]) {
    if B::PLAIN {
        let over = |b: B| OutOfLine(Dual2SVec::<B, Q>::from_re(b));
        let at = |q: SVector<Dual2SVec<B, Q>, Q>| f.at(over, &q.data.0[0].map(OutOfLine)).0;
        let (_, gradient, hessian) = num_dual::hessian(at, &SVector::from(*q));
        // Columns, but it is symmetric.
        return (gradient.data.0[0], hessian.data.0);
    }
    let over = |b: B| OutOfLine(HyperDual::from_re(b));
    let one = B::from(1.0);
    let (mut gradient, mut hessian) = ([B::from(0.0); Q], [[B::from(0.0); Q]; Q]);
    for r in 0..Q {
        // One evaluation for each pair of unknowns; the diagonal pair also gives the first derivative.
        for c in 0..=r {
            let seeded: [_; Q] = components(|k| {
                let mut q = over(q[k]);
                if k == r {
                    q.0.eps1 = one;
                }
                if k == c {
                    q.0.eps2 = one;
                }
                q
            });
            let value = f.at(over, &seeded).0;
            (gradient[r], hessian[r][c]) = (value.eps1, value.eps1eps2);
        }
    }
    (gradient, hessian)
}

/// The Jacobian at `q` of a function `of` with `R` results, by one unknown at a time: rows are results, columns
/// unknowns. `of` receives the conversion of the rod's numbers, and the unknowns.
pub fn jacobian<B: RodScalar, const Q: usize, const R: usize>(
    of: impl Fn(fn(B) -> OutOfLine<Dual<B>>, &[OutOfLine<Dual<B>>]) -> [OutOfLine<Dual<B>>; R],
    q: &[B; Q],
) -> [[B; Q]; R] {
    let over: fn(B) -> OutOfLine<Dual<B>> = |b| OutOfLine(Dual::from_re(b));
    let mut rows = [[B::from(0.0); Q]; R];
    for i in 0..Q {
        let seeded: [_; Q] = components(|k| seed(over(q[k]), k == i));
        let values = of(over, &seeded);
        for r in 0..R {
            rows[r][i] = values[r].0.eps;
        }
    }
    rows
}

/// The number `q`, with a unit derivative if `is_unknown`: it is then the unknown of the derivatives.
fn seed<B: RodScalar>(mut q: OutOfLine<Dual<B>>, is_unknown: bool) -> OutOfLine<Dual<B>> {
    if is_unknown {
        q.0.eps = B::from(1.0);
    }
    q
}
