//! Vectors of three components `[x, y, z]` over any [`Scalar`], with or without derivatives: sum (`add`), difference
//! (`sub`), multiple (`scale`), linear combination (`combine`), scalar and vector product (`dot`, `cross`), and unit
//! vector (`unit`). [`rotate`] rotates by a rotation vector, rad (Rodrigues' formula, by its series below an angle of
//! 0.01 rad). The unit vector of zero is NaN.
//!
//! Energies, frames and prescribed motions use them. [`components`] and [`map_components`] build arrays of any length
//! from a function, by inlined loops.

use crate::numerics::scalar::Scalar;

/// A vector, by its x, y and z components.
pub type Vector<D> = [D; 3];

/// The array of `N` numbers with `component(i)` at index `i`, called in ascending order. `std::array::from_fn`
/// instantiates several functions for every length and closure; this compiles to one inlined loop.
#[inline(always)]
pub fn components<D: Copy + From<f64>, const N: usize>(
    mut component: impl FnMut(usize) -> D,
) -> [D; N] {
    let mut all = [D::from(0.0); N];
    for i in 0..N {
        all[i] = component(i);
    }
    all
}

/// The array of `map(x)` for every component `x`, as an inlined loop.
#[inline(always)]
pub fn map_components<T: Copy, D: Copy + From<f64>, const N: usize>(
    all: &[T; N],
    mut map: impl FnMut(T) -> D,
) -> [D; N] {
    components(|i| map(all[i]))
}

/// The sum `a + b`.
#[inline(always)]
pub fn add<D: Scalar>(a: Vector<D>, b: Vector<D>) -> Vector<D> {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

/// The difference `a - b`.
#[inline(always)]
pub fn sub<D: Scalar>(a: Vector<D>, b: Vector<D>) -> Vector<D> {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// The vector `a` times `s`.
#[inline(always)]
pub fn scale<D: Scalar>(a: Vector<D>, s: D) -> Vector<D> {
    [a[0] * s, a[1] * s, a[2] * s]
}

/// The linear combination `s a + t b`.
#[inline(always)]
pub fn combine<D: Scalar>(s: D, a: Vector<D>, t: D, b: Vector<D>) -> Vector<D> {
    [s * a[0] + t * b[0], s * a[1] + t * b[1], s * a[2] + t * b[2]]
}

/// The scalar product `a . b`.
#[inline(always)]
pub fn dot<D: Scalar>(a: Vector<D>, b: Vector<D>) -> D {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// The Euclidean length `|a|`.
#[inline(always)]
pub fn norm<D: Scalar>(a: Vector<D>) -> D {
    dot(a, a).sqrt()
}

/// The vector product `a x b`.
#[inline(always)]
pub fn cross<D: Scalar>(a: Vector<D>, b: Vector<D>) -> Vector<D> {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// The unit vector `a/|a|`; NaN for a zero vector.
#[inline(always)]
pub fn unit<D: Scalar>(a: Vector<D>) -> Vector<D> {
    scale(a, norm(a).recip())
}

/// `v` rotated about the rotation vector `r` by the angle `a = |r|`, rad: `v + sin(a)/a r x v + (1 - cos a)/a^2 r x (r
/// x v)` (Rodrigues). Below an angle of 0.01 both factors are evaluated by their series.
pub fn rotate<D: Scalar>(r: Vector<D>, v: Vector<D>) -> Vector<D> {
    let square = dot(r, r);
    // sin(a)/a and (1 - cos a)/a^2, by their series at small angles, where the quotients lose digits.
    let (first, second) = match square.value() < 1e-4 {
        true => (
            square * (square * (1.0 / 120.0) - 1.0 / 6.0) + 1.0,
            square * (square * (1.0 / 720.0) - 1.0 / 24.0) + 0.5,
        ),
        false => {
            let angle = square.sqrt();
            (angle.sin() / angle, (-angle.cos() + 1.0) / square)
        }
    };
    let across = cross(r, v);
    add(v, add(scale(across, first), scale(cross(r, across), second)))
}
