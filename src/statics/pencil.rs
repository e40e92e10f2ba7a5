//! Tangent and masses of a rod at a state: what its small vibrations, and its stability, are of.

use crate::energy::Derivatives;
use crate::error::Error;
use crate::numerics::banded::BandMatrix;
use crate::numerics::scalar::Nestable;
use crate::numerics::tangent::{Factors, Tangent};
use crate::problem::Model;
use crate::problem::{Discretized, FramesOf};
use crate::rod::{Rod, SpatialRod, TangentOf, planar};
use std::ops::Range;

/// `K x = omega^2 M x` over the unknowns `free`. Those among them that a recording leads are
/// coupled to no other and weigh nothing: they have no eigenvalues.
pub(crate) struct Pencil<D, T> {
    /// `K`, N/m (N m for angles).
    pub tangent: T,
    /// The diagonal `M`.
    pub mass: Vec<D>,
    /// The unknowns that move.
    pub free: Range<usize>,
}

/// Shifts that an elimination is tried with, and their distance over the shift.
const SHIFTS: u32 = 4;
const SHIFTED: f64 = 0.0137;

/// Half-bandwidth for motions out of the plane: a deflection and an angle a node, as many as in the plane.
const ACROSS: usize = planar::HALF_BANDWIDTH;

/// The tangent of motions out of the plane.
pub(crate) type OutOfPlaneTangent<D> = BandMatrix<D, ACROSS>;

impl<D: Nestable, T: Tangent<D>> Pencil<D, T> {
    /// Of a rod at `q`, with its own masses.
    pub fn at<M: Model>(
        discretized: &Discretized<'_, M>,
        rod: &M::Rod<D>,
        q: &[D],
        frames: &<M::Rod<D> as Rod<D>>::Frames,
    ) -> Self
    where
        M::Rod<D>: Rod<D, Tangent = T>,
    {
        let mut tangent = Tangent::zeros(q.len());
        let mut gradient = vec![D::from(0.0); q.len()];
        rod.tangent(q, frames, Derivatives::Hand, &mut gradient, &mut tangent);
        let (mut mass, led) = (rod.mass().to_vec(), discretized.led());
        led.uncouple(&mut tangent);
        led.fill(&mut mass, D::from(0.0));
        Self { tangent, mass, free: discretized.free() }
    }
}

impl<T: Tangent<f64>> Pencil<f64, T> {
    /// Of a rod at rest, in edge coordinates where it is long and hangs from its start, with the stiffness that counts as
    /// [none](Discretized::negligible) in place of the masses: what is stable lies above -1.
    pub fn resting<M: Model>(
        discretized: &Discretized<'_, M>,
        q: &[f64],
        frames: &FramesOf<M>,
    ) -> Self
    where
        M::Rod<f64>: Rod<f64, Tangent = T>,
    {
        let (rod, edges) = (discretized.rod(), discretized.edge_coordinates());
        let mass = discretized.negligible(edges);
        match edges {
            Some(_) => {
                let mut tangent = Tangent::zeros(q.len());
                rod.edge_tangent(q, frames, Derivatives::Hand, &mut tangent);
                Self { tangent, mass, free: discretized.free() }
            }
            None => {
                let mut mass = mass;
                discretized.led().fill(&mut mass, 0.0);
                Self { mass, ..Self::at(discretized, &rod, q, frames) }
            }
        }
    }

    /// The factors of `K - squared M`.
    pub fn factors(&self, squared: f64) -> Result<T::Factors, Error> {
        let mut factors = T::Factors::with_order(self.mass.len());
        factors
            .factor_sum(&self.mass, -squared, &self.tangent, 1.0, self.free.clone())
            .map(|()| factors)
            .map_err(|_| Error::SingularEquilibrium)
    }

    /// How many eigenvalues there are.
    pub fn order(&self) -> usize {
        self.free.clone().filter(|i| self.mass[*i] != 0.0).count()
    }

    /// How many eigenvalues lie below `squared`, by Sylvester's law of inertia.
    pub fn below(&self, squared: f64) -> Result<usize, Error> {
        Ok(self.factors(squared)?.negative_pivots())
    }

    /// The same, where an elimination that meets a pivot of zero is repeated a little below.
    pub fn inertia(&self, squared: f64) -> Result<usize, Error> {
        let shifts = (0..SHIFTS).map(|k| squared - f64::from(k) * SHIFTED * squared.abs());
        let mut last = Err(Error::SingularEquilibrium);
        for shift in shifts {
            last = self.below(shift);
            if last.is_ok() {
                return last;
            }
        }
        last
    }

    /// How far rounding errors of the tangent may move the eigenvalue of the mode `x`, 1/s^2.
    pub fn rounding(&self, x: &[f64]) -> f64 {
        let (mut product, mut own) = (vec![0.0; x.len()], 0.0);
        self.tangent.absolute_product(x, &mut product);
        for i in self.free.clone() {
            own += x[i] * x[i] * self.mass[i];
        }
        f64::EPSILON * self.free.clone().map(|i| x[i].abs() * product[i]).sum::<f64>() / own
    }
}

impl<D: Nestable> Pencil<D, TangentOf<SpatialRod<D>, D>> {
    /// That of a planar rod's motions along the `normal` of its plane, which has no part in those
    /// in the plane: unknowns are each node's deflection and each edge's angle.
    pub fn across(&self, normal: [f64; 3]) -> Pencil<D, OutOfPlaneTangent<D>> {
        let unknowns = self.mass.len() / 2;
        let parts = |r: usize| -> [(usize, f64); 3] {
            let first = 4 * (r / 2);
            match r % 2 {
                0 => std::array::from_fn(|c| (first + c, normal[c])),
                _ => [(first + 3, 1.0), (first, 0.0), (first, 0.0)],
            }
        };
        let entry = |r: usize, s: usize| {
            let mut sum = D::from(0.0);
            for (i, a) in parts(r) {
                for (j, b) in parts(s).into_iter().filter(|(_, b)| a * b != 0.0) {
                    sum += self.tangent.get(i, j) * (a * b);
                }
            }
            sum
        };
        let mut tangent = OutOfPlaneTangent::zeros(unknowns);
        for r in 0..unknowns {
            let size = (unknowns - r).min(ACROSS + 1);
            let mut column = [[D::from(0.0); ACROSS + 1]; ACROSS + 1];
            for p in 0..size {
                column[p][0] = entry(r + p, r);
            }
            tangent.add_corner(r, size, &column);
        }
        // What holds a part of a node holds its deflection.
        let place = |i: usize, rounded: usize| 2 * (i / 4) + (i % 4 + rounded) / 4;
        let Range { start, end } = self.free;
        Pencil {
            tangent,
            mass: (0..unknowns).map(|r| self.mass[4 * (r / 2) + 3 * (r % 2)]).collect(),
            free: place(start, 3)..place(end, 1),
        }
    }
}

/// A motion [across](Pencil::across) the plane as one of the spatial rod.
pub(crate) fn spatial_motion(across: &[f64], normal: [f64; 3]) -> Vec<f64> {
    let node = |x: &[f64]| {
        let [a, b, c] = normal.map(|n| n * x[0]);
        [a, b, c].into_iter().chain(x.get(1).copied())
    };
    across.chunks(2).flat_map(node).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Dimension, Material, Scene, Section, Shape, Support};

    /// A planar rod in space moves in its plane and across it, and nothing couples the two.
    #[test]
    fn the_plane_and_what_is_across_are_all() {
        for start in [Support::Free, Support::Roller, Support::Pinned, Support::Clamped] {
            for end in [Support::Free, Support::Pinned, Support::Clamped] {
                let shape = Shape::Straight { length: 0.5, direction: [0.3, 0.4, 0.7] };
                let material = Material { poisson_ratio: Some(0.3), ..Material::new(1e3, 1e8) };
                let section = Section::Circle { radius: 0.005 };
                let mut scene = Scene::new(12, shape, section, material);
                (scene.supports.start, scene.supports.end) = (start, end);
                let plane = scene.problem().unwrap();
                scene.rod.dimension = Dimension::Spatial;
                let space = scene.problem().unwrap();
                let (plane, space) = (plane.planar().unwrap(), space.spatial().unwrap());
                let whole = Pencil::at(&space, &space.rod(), &space.rest(), &space.rest_frames());
                let inside = Pencil::at(&plane, &plane.rod(), &plane.rest(), &());
                let outside = whole.across(space.model.components(plane.normal()));
                for squared in [1.0, 1e3, 1e5, 1e7, 1e9] {
                    let parts = [inside.below(squared), outside.below(squared)];
                    let sum: usize = parts.map(Result::unwrap).iter().sum();
                    assert_eq!(sum, whole.below(squared).unwrap(), "{start:?} {end:?} {squared}");
                }
                assert_eq!(whole.free.len(), inside.free.len() + outside.free.len());
            }
        }
    }
}
