//! The innermost loops of band matrices: products of numbers of `S` bands, by vector instructions for two of them.

use crate::numerics::scalar::Scalar;
use crate::numerics::simd::PairLevel;
use crate::numerics::tangent::RightHandSide;

/// The statement for each index below a number, at most 10 of them. Unrolled by hand: compilers keep a loop whose inner loop
/// depends on its index, and then arrays that are indexed by it are no registers.
macro_rules! unrolled {
    ($index:ident in $($number:literal)*, $count:ident: $statement:block) => {
        const { assert!($count <= 10, "the loop is unrolled for at most 10 indices") }
        $({
            const $index: usize = $number;
            if $index < $count $statement
        })*
    };
}

pub(super) use unrolled;

/// The first and the last number as a pair.
#[inline(always)]
fn pair<D: Scalar, const S: usize>(x: &[D; S]) -> [f64; 2] {
    [x[0].value(), x[S - 1].value()]
}

/// Subtracts `x y` from `a`, for each of several numbers of `S` bands with the same `y`.
#[inline(always)]
pub(super) fn subtract_products<V: PairLevel, D: Scalar, E: RightHandSide<D>, const S: usize>(
    level: V,
    a: &mut [[E; S]],
    x: &[[E; S]],
    y: &[D; S],
) {
    if S != 2 || !E::PLAIN || !D::PLAIN {
        for k in 0..a.len() {
            for s in 0..S {
                a[k][s] -= x[k][s] * y[s];
            }
        }
        return;
    }
    let y = pair(y);
    let (twos, rest) = a.as_chunks_mut::<2>();
    let (x_twos, x_rest) = x.as_chunks::<2>();
    for k in 0..twos.len() {
        let ([a, b], [c, d]) = (&mut twos[k], &x_twos[k]);
        let results = level.less_products([pair(a), pair(b)], [pair(c), pair(d)], y);
        for s in 0..S {
            (a[s], b[s]) = (E::from(results[0][s]), E::from(results[1][s]));
        }
    }
    for k in 0..rest.len() {
        let result = level.less_product(pair(&rest[k]), pair(&x_rest[k]), y);
        for s in 0..S {
            rest[k][s] = E::from(result[s]);
        }
    }
}
