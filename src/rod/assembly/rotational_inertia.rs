//! Inertia forces of rotating bodies in the steps of a simulation.
//!
//! With the angular velocity `w` and the inertia tensor `J` in the axes of a body, and the moment `-m` of all forces,
//!
//! ```text
//! J dw/dt + w x J w + m = 0,    dR/dt = R w x.
//! ```
//!
//! A step takes the rotation vector of the change from the old rotation to the new one as the change of the unknowns,
//! and `w` as the velocity (Bruls, Cardona and Arnold 2012, doi:10.1016/j.mechmachtheory.2011.07.017): the formulas
//! of the scheme stay, and `m + w x J w` is a force. Its derivative by the increment `phi` of the new rotation is
//!
//! ```text
//! H + m x/2 + (w x J - (J w) x) dw/dr T^-1,    r + T^-1 phi the new rotation vector,
//! ```
//!
//! with the Hessian `H` of the energy by increments. It is not symmetric. `add_rotational_inertia` adds `w x J w`,
//! and the mass damping of the products of inertia, over `length`, N. On request it appends the derivative beside
//! `H`, and that of the inertia by the increments, as one block for each rotation, N/m. `convert_correction` replaces
//! the increments `phi` of a Newton correction by changes `T^-1 phi` of the coordinates. `add_products_of_inertia`
//! adds the product with the part of `J` that the diagonal masses lack, over `length^2`.

use crate::numerics::envelope_lu::DiagonalBlock;
use crate::numerics::rotation::{
    components_of, cross_matrix, inverse, product, tangent_map, times,
};
use crate::numerics::scalar::RodScalar;
use crate::numerics::vector::{cross, scale};
use crate::rod::RotationRates;
use crate::rod::assembly::frames::AssemblyFrames;
use crate::rod::assembly::spatial_bodies::SpatialBodies;

impl<D: RodScalar> SpatialBodies<D> {
    /// Adds to `forces`, N, the inertia forces of all rotations beyond those of diagonal masses: `w x J w` and the mass
    /// damping of the products of inertia, over `length`. Lists have the coordinates of bodies; `forces` contains the
    /// gradient. If `blocks` is given, appends one block, N/m, for each rotation by the increments. It has the
    /// derivative of `w x J w`, that of the inertia beyond the diagonal masses, and `m x/2` with the moment `m` of
    /// `forces`.
    pub(super) fn add_rotational_inertia(
        &self,
        z: &[D],
        frames: &AssemblyFrames<D>,
        rates: &RotationRates<'_, D>,
        forces: &mut [D],
        mut blocks: Option<&mut Vec<DiagonalBlock<D>>>,
    ) {
        for rotation in self.rotations() {
            let by = rotation.length.recip();
            let spin = rotation.of(rates.velocity).map(|rate| rate * by);
            let tensor = rotation.tensor();
            let momentum = times(&tensor, spin);
            if let Some(blocks) = &mut blocks {
                // The rotation vector of the step changes by `T^-1 phi` with the increment `phi` of the new rotation.
                let back = inverse(&tangent_map(rotation.vector(z, frames)));
                let (across, turning) = (cross_matrix(spin), cross_matrix(momentum));
                let gyroscopic = product(&across, &tensor);
                let by_spin = components_of(|i, j| gyroscopic[i][j] - turning[i][j]);
                let by_spin = product(&by_spin, &back);
                let inertia = product(&tensor, &back);
                // Second derivatives by increments of a turned frame lack symmetry by half of the moment.
                let moment = cross_matrix(rotation.of(forces));
                let entries = components_of(|i, j| {
                    let diagonal = if i == j { rotation.inertia[i] } else { D::from(0.0) };
                    // The matrix of the step has the diagonal masses already.
                    let masses = (inertia[i][j] - diagonal) * rates.mass_weight;
                    (by_spin[i][j] * rates.slope + masses) * (by * by) + moment[i][j] * (0.5 * by)
                });
                blocks.push(DiagonalBlock { start: rotation.coordinate, entries });
            }
            // The scheme damps the diagonal masses; the products of inertia are missing there.
            let damping = scale(times(&rotation.products, spin), rates.mass_damping);
            let gyroscopic = cross(spin, momentum);
            for c in 0..3 {
                forces[rotation.coordinate + c] += (gyroscopic[c] + damping[c]) * by;
            }
        }
    }

    /// Replaces the increments `phi` of all rotations in `correction`, a list of body coordinates at `z`, by changes
    /// `T^-1 phi` of the coordinates.
    pub(super) fn convert_correction(
        &self,
        z: &[D],
        frames: &AssemblyFrames<D>,
        correction: &mut [D],
    ) {
        for rotation in self.rotations() {
            let back = inverse(&tangent_map(rotation.vector(z, frames)));
            let own = times(&back, rotation.of(correction));
            correction[rotation.coordinate..][..3].copy_from_slice(&own);
        }
    }

    /// Adds to `out` the product `factor P w/length^2` for each rotation, with its products of inertia `P` and its
    /// entries `w` in `rates`. Both lists have the coordinates of bodies.
    pub(super) fn add_products_of_inertia(&self, rates: &[D], factor: D, out: &mut [D]) {
        for rotation in self.rotations() {
            let own = times(&rotation.products, rotation.of(rates));
            let by = factor * (rotation.length * rotation.length).recip();
            for c in 0..3 {
                out[rotation.coordinate + c] += own[c] * by;
            }
        }
    }
}
