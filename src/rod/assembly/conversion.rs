//! Conversion of derivatives by increments of a rotation in space, in the axes of the body, to those by coordinates.
//!
//! The coordinates `z`, m, have the rotation vector `r = (z - z0)/length` from the reference at `z0`. A change `dz` is
//! the increment `T dz/length`, rad, with the [tangent map](crate::numerics::rotation) `T(r)`. Derivatives `g` and `H`
//! by increments are those by the increment times `length`. In place, for one rotation, `g` becomes `T' g`, and `H`
//! becomes `T' H T` plus the symmetric part of `(d(T' g)/dr)/length` at constant `g`. Couplings to rods and to other
//! coordinates are multiplied by `T`. The tangent is converted before the gradient, whose entries by increments it
//! needs. Equilibria and modes of assemblies use it.

use crate::numerics::rotation::{
    Matrix3, product, tangent_map, tangent_map_slope, transpose, transposed_times,
};
use crate::numerics::scalar::Scalar;
use crate::numerics::tangent::Tangent;
use crate::numerics::vector::Vector;
use crate::rod::assembly::spatial_motion::SpatialRotation;
use crate::rod::assembly::tangent::BorderedTangent;

/// Replaces three numbers by the product of the transpose of `map` with them.
fn map_entries<D: Scalar>(map: &Matrix3<D>, entries: [&mut D; 3]) {
    let [a, b, c] = entries;
    [*a, *b, *c] = transposed_times(map, [*a, *b, *c]);
}

/// Replaces the three entries `g` of one rotation in `gradient`, which has all coordinates of bodies, by `T' g`. `T` is
/// the tangent map at the rotation vector `vector`, rad. Derivatives by increments become those by the coordinates.
pub(super) fn convert_gradient<D: Scalar>(
    rotation: &SpatialRotation<D>,
    vector: Vector<D>,
    gradient: &mut [D],
) {
    let map = tangent_map(vector);
    let [a, b, c] = &mut gradient[rotation.coordinate..][..3] else { return };
    map_entries(&map, [a, b, c]);
}

/// Converts the rows and columns of one rotation in `tangent`, in place, from derivatives by increments to those by the
/// coordinates. Couplings to rods and to other coordinates are multiplied by the tangent map `T` at the rotation vector
/// `vector`, rad. The own block `H` becomes `T' H T` plus the symmetric part of the derivative of `T' g` by `vector` at
/// constant `g`, over `length`. The entries `g` of `gradient`, which has all body coordinates, are still by increments.
pub(super) fn convert_tangent<D: Scalar, T: Tangent<D>>(
    rotation: &SpatialRotation<D>,
    vector: Vector<D>,
    gradient: &[D],
    tangent: &mut BorderedTangent<D, T>,
) {
    let (map, first) = (tangent_map(vector), rotation.coordinate);
    let moment = rotation.of(gradient);
    // Couplings are first derivatives by the increments: their three columns are multiplied by `T`.
    for coupling in tangent.members.iter_mut().flat_map(|member| &mut member.couplings) {
        let Some(k) = coupling.columns.iter().position(|column| *column == first) else { continue };
        let rows = coupling.rows.len();
        let [a, b, c] = [0, 1, 2].map(|c| (k + c) * rows);
        for r in 0..rows {
            let own = [a, b, c].map(|column| coupling.entries[column + r]);
            let own = transposed_times(&map, own);
            (0..3).for_each(|c| coupling.entries[(k + c) * rows + r] = own[c]);
        }
    }
    let bodies = &mut tangent.bodies;
    // The lower triangle is stored: rows of the rotation left of its block, then columns below it.
    for j in bodies.first(first)..first {
        let own = transposed_times(&map, [0, 1, 2].map(|r| bodies.get(first + r, j)));
        (0..3).for_each(|r| bodies.set(first + r, j, own[r]));
    }
    for i in first + 3..bodies.order() {
        if bodies.first(i) <= first {
            let own = transposed_times(&map, [0, 1, 2].map(|c| bodies.get(i, first + c)));
            (0..3).for_each(|c| bodies.set(i, first + c, own[c]));
        }
    }
    let own = [0, 1, 2].map(|r| [0, 1, 2].map(|c| bodies.get(first + r, first + c)));
    let own = product(&transpose(&map), &product(&own, &map));
    // `T` depends on the coordinates too, so that the moment contributes its derivative.
    let slope = tangent_map_slope(vector, moment);
    let by = rotation.length.recip();
    for r in 0..3 {
        for c in 0..=r {
            bodies.set(first + r, first + c, own[r][c] + slope[r][c] * by);
        }
    }
}
