//! The innermost loops of band matrices: `a - x y` for entries of `S` independent matrices (bands) at once, by vector
//! instructions for two bands of numbers without derivatives.
//!
//! [`subtract_products`] serves the elimination and the substitution; `unrolled!` repeats a statement for each
//! constant index below a number.

use crate::numerics::scalar::Scalar;
use crate::numerics::simd::PairLevel;
use crate::numerics::tangent::RightHandSide;

/// Repeats `statement` once for each listed number below `count` (at most 10), as the constant `index`, in the order of
/// the list. Unrolled by hand: compilers keep a loop whose inner loop depends on its index, and then arrays that are
/// indexed by it are no registers.
macro_rules! unrolled {
    ($index:ident in $($number:literal)*, $count:ident: $statement:block) => {
        const { assert!($count <= 10, "the loop is unrolled for at most 10 indices") }
        $({
            const $index: usize = $number;
            // A constant condition: the statement of an index above the number is not compiled at all.
            if const { $index < $count } $statement
        })*
    };
}

pub(super) use unrolled;

/// The real parts of the first and the last number.
#[inline(always)]
fn pair<D: Scalar, const S: usize>(x: &[D; S]) -> [f64; 2] {
    [x[0].value(), x[S - 1].value()]
}

/// Subtracts `x[k][s] y[s]` from `a[k][s]` for each `k` and each band `s` of `S`. Two bands of numbers without
/// derivatives use the vector instructions of `level`.
#[inline(always)]
pub(super) fn subtract_products<V: PairLevel, D: Scalar, E: RightHandSide<D>, const S: usize>(
    level: V,
    a: &mut [[E; S]],
    x: &[[E; S]],
    y: &[D; S],
) {
    // Numbers with derivatives, and single bands, take the plain loop.
    if S != 2 || !E::PLAIN || !D::PLAIN {
        for k in 0..a.len() {
            for s in 0..S {
                a[k][s] -= x[k][s] * y[s];
            }
        }
        return;
    }
    // Two entries of two bands fill one register of four numbers.
    let y = pair(y);
    let (twos, rest) = a.as_chunks_mut::<2>();
    let (x_twos, x_rest) = x.as_chunks::<2>();
    for k in 0..twos.len() {
        let ([a, b], [c, d]) = (&mut twos[k], &x_twos[k]);
        let results = level.subtract_products([pair(a), pair(b)], [pair(c), pair(d)], y);
        for s in 0..S {
            (a[s], b[s]) = (E::from(results[0][s]), E::from(results[1][s]));
        }
    }
    // An odd last entry takes a register of two numbers.
    for k in 0..rest.len() {
        let result = level.subtract_product(pair(&rest[k]), pair(&x_rest[k]), y);
        for s in 0..S {
            rest[k][s] = E::from(result[s]);
        }
    }
}
