//! The matrix pencil `(K, M)` of a rod at a state: tangent stiffness and diagonal masses, for small vibrations and
//! stability.
//!
//! Its eigenvalues `K x = omega^2 M x` are squared angular frequencies. At an equilibrium negligible stiffnesses can
//! replace the masses: eigenvalues are then multiples of these, and those below -1 are unstable motions. `at` takes
//! masses, `resting` negligible stiffnesses. Prescribed unknowns have no eigenvalues.
//!
//! The number of eigenvalues below `s` is that of the negative pivots of `K - s M` (`below`). A zero pivot is an error;
//! `inertia` tries up to `SHIFTS` values of `s`, each slightly lower. The finite eigenvalues are as many as unknowns
//! with a mass (`order`). For a planar rod the pencil of motions out of its plane (a deflection and an angle per node)
//! follows from the spatial model (`out_of_plane`). [`spatial_motion`] returns the unknowns of the spatial model for
//! such a motion.

use crate::energy::Derivatives;
use crate::error::Error;
use crate::numerics::banded::BandMatrix;
use crate::numerics::scalar::{RodScalar, Scalar};
use crate::numerics::tangent::{Factors, Singular, Tangent, UnsymmetricTangent};
use crate::problem::Model;
use crate::problem::{Discretized, FramesOf};
use crate::rod::{Rod, SpatialRod, TangentOf, planar};
use std::ops::Range;

/// Number of shifts that are tried until an elimination has no zero pivot.
const SHIFTS: u32 = 4;
/// Relative distance of successive shifts, so that a zero pivot of one is none of the next; an arbitrary small number.
const SHIFT_DISTANCE: f64 = 0.0137;
/// Half-bandwidth for motions out of the plane: a deflection and an angle per node, as many unknowns as in the plane.
const OUT_OF_PLANE_BANDWIDTH: usize = planar::HALF_BANDWIDTH;

/// The eigenvalue problem `K x = omega^2 M x` over the unknowns `free`. Prescribed unknowns among them are uncoupled
/// and have no mass, so that they have no finite eigenvalues.
pub(crate) struct Pencil<D, T> {
    /// `K`, N/m (N m for angles).
    pub tangent: T,
    /// The diagonal of `M`, kg (kg m^2 for angles).
    pub mass: Vec<D>,
    /// The unknowns that move.
    pub free: Range<usize>,
}

/// Tangent of motions out of the plane.
pub(crate) type OutOfPlaneTangent<D> = BandMatrix<D, OUT_OF_PLANE_BANDWIDTH>;

impl<D: RodScalar, T: Tangent<D>> Pencil<D, T> {
    /// The pencil of a rod at the unknowns `q`, m and rad, whose angles are measured from `frames`, over any scalar. It
    /// has the tangent there by the hand-derived formulas, the masses and the free range, in node coordinates.
    /// Prescribed unknowns are decoupled and have no mass.
    pub fn at<M: Model>(
        discretized: &Discretized<'_, M>,
        rod: &M::Rod<D>,
        q: &[D],
        frames: &<M::Rod<D> as Rod<D>>::Frames,
    ) -> Self
    where
        M::Rod<D>: Rod<D, Tangent = T>,
    {
        let mut tangent = rod.zero_tangent();
        let mut gradient = vec![D::from(0.0); q.len()];
        rod.tangent(q, frames, Derivatives::Hand, &mut gradient, &mut tangent);
        let (mut mass, prescribed) = (rod.mass().to_vec(), discretized.prescribed());
        prescribed.eliminate_rows_and_columns(&mut tangent);
        prescribed.fill(&mut mass, D::from(0.0));
        Self { tangent, mass, free: discretized.free() }
    }
}

impl<T: Tangent<f64>> Pencil<f64, T> {
    /// The pencil of a rod at an equilibrium `q` with [negligible stiffnesses](Discretized::negligible_stiffness) in
    /// place of masses: eigenvalues are multiples of these, and those of stable motions are above -1. Long rods are in
    /// edge coordinates; in node coordinates prescribed unknowns have no mass.
    pub fn resting<M: Model>(
        discretized: &Discretized<'_, M>,
        rod: &M::Rod<f64>,
        q: &[f64],
        frames: &FramesOf<M>,
    ) -> Self
    where
        M::Rod<f64>: Rod<f64, Tangent = T>,
    {
        let edges = discretized.edge_coordinates();
        let mut mass = discretized.negligible_stiffness(edges);
        match edges {
            Some(_) => {
                let mut tangent = rod.zero_tangent();
                rod.edge_tangent(q, frames, Derivatives::Hand, &mut tangent);
                Self { tangent, mass, free: discretized.free() }
            }
            None => {
                discretized.prescribed().fill(&mut mass, 0.0);
                Self { mass, ..Self::at(discretized, rod, q, frames) }
            }
        }
    }

    /// The factors of `K - squared M` over the free unknowns; the error is the row of a zero pivot.
    pub fn factor(&self, squared: f64) -> Result<T::Factors, Singular> {
        let mut factors = self.tangent.new_factors();
        factors.factor_sum(&self.mass, -squared, &self.tangent, 1.0, self.free.clone())?;
        Ok(factors)
    }

    /// The factors of `K - squared M` over the free unknowns.
    ///
    /// # Errors
    /// [`Error::SingularEquilibrium`] for a zero pivot.
    pub fn factors(&self, squared: f64) -> Result<T::Factors, Error> {
        self.factor(squared).map_err(|_| Error::SingularEquilibrium)
    }

    /// Number of finite eigenvalues: that of the free unknowns whose mass is not zero.
    pub fn order(&self) -> usize {
        self.free.clone().filter(|i| self.mass[*i] != 0.0).count()
    }

    /// Number of eigenvalues below `squared`, 1/s^2, by Sylvester's law of inertia: the negative pivots of `K - squared
    /// M`. A zero pivot is [`Error::SingularEquilibrium`].
    pub fn below(&self, squared: f64) -> Result<usize, Error> {
        Ok(self.factors(squared)?.negative_pivots())
    }

    /// Number of eigenvalues below `squared`, 1/s^2. In case of a zero pivot the shift is lowered by [`SHIFT_DISTANCE`]
    /// of itself, up to [`SHIFTS`] shifts in all (a shift of zero stays); then [`Error::SingularEquilibrium`].
    pub fn inertia(&self, squared: f64) -> Result<usize, Error> {
        // A zero pivot depends on the shift: a slightly lower one avoids it.
        (0..SHIFTS)
            .map(|k| squared - f64::from(k) * SHIFT_DISTANCE * squared.abs())
            .find_map(|shift| self.below(shift).ok())
            .ok_or(Error::SingularEquilibrium)
    }

    /// Rounding error of the eigenvalue of a mode `x` by rounding of the tangent, `eps |x|' |K| |x| / x' M x`, 1/s^2,
    /// with sums over the free unknowns.
    pub fn rounding(&self, x: &[f64]) -> f64 {
        let (mut product, mut own) = (vec![0.0; x.len()], 0.0);
        self.tangent.absolute_product(x, &mut product);
        for i in self.free.clone() {
            own += x[i] * x[i] * self.mass[i];
        }
        f64::EPSILON * self.free.clone().map(|i| x[i].abs() * product[i]).sum::<f64>() / own
    }
}

impl<D: RodScalar> Pencil<D, TangentOf<SpatialRod<D>, D>> {
    /// The pencil of motions out of the plane of a planar rod, from that of its spatial model. Unknowns are, node by
    /// node, the deflection along the `normal`, m, and the angle of the edge after the node, rad. Entries of `K` are
    /// sums over the components along the normal. In-plane motions are not coupled to them. A node with one held
    /// component has a held deflection.
    pub fn out_of_plane(&self, normal: [f64; 3]) -> Pencil<D, OutOfPlaneTangent<D>> {
        // Of 4 n - 1 unknowns in space 2 n - 1 remain: the last node has no angle.
        let unknowns = self.mass.len() / 2;
        // Spatial unknowns of an unknown of the result, with their weights.
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
            let size = (unknowns - r).min(OUT_OF_PLANE_BANDWIDTH + 1);
            let mut column =
                [[D::from(0.0); OUT_OF_PLANE_BANDWIDTH + 1]; OUT_OF_PLANE_BANDWIDTH + 1];
            for p in 0..size {
                column[p][0] = entry(r + p, r);
            }
            if self.tangent.is_symmetric() {
                tangent.add_corner(r, size, &column);
                continue;
            }
            for p in 1..size {
                column[0][p] = entry(r, r + p);
            }
            tangent.add_unsymmetric(r, size, &column);
        }
        // A support that holds one component of a node holds its deflection.
        let index = |i: usize, rounded: usize| 2 * (i / 4) + (i % 4 + rounded) / 4;
        let Range { start, end } = self.free;
        Pencil {
            tangent,
            mass: (0..unknowns).map(|r| self.mass[4 * (r / 2) + 3 * (r % 2)]).collect(),
            free: index(start, 3)..index(end, 1),
        }
    }
}

/// The unknowns of the spatial rod, four per node, for a motion [out of the plane](Pencil::out_of_plane).
/// `deflections` has two numbers per node, its deflection along the `normal` and the angle of the edge after it; the
/// last node has no angle.
pub(crate) fn spatial_motion<D: Scalar>(deflections: &[D], normal: [f64; 3]) -> Vec<D> {
    let node = |x: &[D]| {
        let [a, b, c] = normal.map(|n| x[0] * n);
        [a, b, c].into_iter().chain(x.get(1).copied())
    };
    deflections.chunks(2).flat_map(node).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Dimension, Material, Scene, Section, Shape, Support};

    /// A planar rod in space moves in its plane or out of it, without coupling: the numbers of eigenvalues add up.
    #[test]
    fn eigenvalues_in_and_out_of_plane_are_those_of_the_spatial_rod() {
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
                let outside = whole.out_of_plane(space.model.components(plane.normal()));
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
