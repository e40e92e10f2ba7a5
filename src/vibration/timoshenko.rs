//! Reduction of a natural frequency by shear deformation and rotary inertia, which the rod model omits (Timoshenko).
//!
//! Input: a mode of the rod model, without these effects, over any scalar. Let `phi` be its deflection, `Q` its shear
//! force and `theta` the rotation of its sections. Timoshenko's beam has these additional terms, of first order in
//! `I/(A L^2)` by Rayleigh's quotient:
//!
//! ```text
//! omega^2 = omega_0^2 (1 - e),   e = (int Q^2/(kappa G A) ds + omega_0^2 int rho I theta^2 ds)
//!                                    / (omega_0^2 int rho A phi^2 ds)
//! ```
//!
//! The shear strain `Q/(kappa G A)` minimizes the quotient for any supports, since deflection and rotation may both
//! change. For a simply supported rod `e = (I/A) k^2 (1 + E/(kappa G))` with `k = n pi/L` (S. P. Timoshenko, Phil.
//! Mag. 41 (1921) 744). For a free one it is the first term of the correction in ASTM E1876.
//!
//! `Q` is the transverse part of the sum of inertia forces and reactions on one side of the section. The part of
//! the tension that rotates with the section is subtracted. This holds for curved, tapered and hanging rods.
//!
//! Beyond first order, with the reductions `s` by shear and `r` by rotary inertia, `omega^2 = omega_0^2/T`:
//!
//! ```text
//! T^2 - (1 + s + r) T + s r = 0
//! ```
//!
//! This is exact for a simply supported rod, whose `s` and `r` are `(I/A) k^2 E/(kappa G)` and `(I/A) k^2`. For other
//! supports it is an approximation up to [`LARGEST_FACTOR`]. [`ThicknessEffect`] (`thickness_effect`) has `s` for
//! `E/(kappa G) = 1` and `r`; [`ThicknessEffect::factor`] returns `T`. [`VibrationState::frequency_factor`] returns
//! `1/sqrt(T)` with derivatives.

use crate::numerics::scalar::{RodScalar, Scalar};
use crate::numerics::tangent::Tangent;
use crate::numerics::vector::{add, dot, scale, sub};
use crate::problem::{Discretized, FramesOver, Model, Setup};
use crate::statics::{Pencil, free_part, internal_forces};
use crate::vibration::mode::ModePlane;
use crate::vibration::modes::motion_in_model;

/// Largest factor `T` of the closed form: frequencies are lower by 14 %, with an error of at most 0.3 %. Differences
/// from Timoshenko's frequency equation are in `tests/statics/thick_bars.rs`.
pub(crate) const LARGEST_FACTOR: f64 = 1.35;

/// Relative reductions of a squared frequency by the effects of thickness, to first order.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct ThicknessEffect<D = f64> {
    /// By shear deformation, for `E/(kappa G) = 1`.
    pub shear: D,
    /// By rotary inertia.
    pub rotary: D,
}

impl<D: Scalar> ThicknessEffect<D> {
    /// The factor `T` by which the squared frequency of the slender rod is larger, for the ratio `E/(kappa G)`,
    /// `shear_flexibility`. It is the larger root of `T^2 - (1 + s + r) T + s r = 0` with the reductions by shear `s`
    /// and by rotary inertia `r`.
    pub fn factor(&self, shear_flexibility: D) -> D {
        let shear = self.shear * shear_flexibility;
        let sum = shear + self.rotary + 1.0;
        (sum + (sum * sum - shear * self.rotary * 4.0).sqrt()) * 0.5
    }
}

/// A rod at the state about which it vibrates, over any scalar.
pub(super) struct VibrationState<'a, D: RodScalar, M: Model, T> {
    /// The discretized problem.
    pub discretized: &'a Discretized<'a, M>,
    /// Scene and rest shape.
    pub setup: &'a Setup<D, M>,
    /// Unknowns at the state, m (rad for angles).
    pub q: &'a [D],
    /// Frames at the state, from which angles are measured.
    pub frames: &'a FramesOver<D, M>,
    /// Stiffness `K` and masses `M` at the state.
    pub pencil: &'a Pencil<D, T>,
    /// The plane of the vibrations of a planar scene; none in space.
    pub plane: Option<ModePlane>,
}

impl<D: RodScalar, M: Model, T: Tangent<D>> VibrationState<'_, D, M, T> {
    /// Factor of the angular frequency of a bending mode by shear and rotary inertia, `1/sqrt(T)`, at most 1, with `T`
    /// by [`ThicknessEffect::factor`]. The mode has the angular frequency `frequency`, rad/s, without these effects,
    /// and the eigenvector `mode` over the unknowns of the pencil.
    pub fn frequency_factor(&self, frequency: D, mode: &[D]) -> D {
        let effect = self.thickness_effect(frequency * frequency, mode);
        effect.factor(self.setup.scene.shear_flexibility()).sqrt().recip()
    }

    /// The relative reductions of the `squared` angular frequency, 1/s^2, of the mode with the eigenvector `mode`, for
    /// `E/(kappa G) = 1`. By shear it is `int Q^2/(E A) ds`, by rotary inertia `omega^2 int rho I theta^2 ds`, each
    /// over `omega^2 int rho A phi^2 ds`, twice the kinetic energy. Both integrals are midpoint sums over edges,
    /// without the parts behind walls. The rotation `theta` of sections is the transverse change of the chord over its
    /// length. The shear force `Q` is transverse to the edge: internal force of inertia and reactions plus tension
    /// times rotation.
    pub fn thickness_effect(&self, squared: D, mode: &[D]) -> ThicknessEffect<D> {
        let (discretized, model) = (self.discretized, self.discretized.model);
        let edges = discretized.nodes() - 1;
        let inertia = mode.iter().zip(&self.pencil.mass).map(|(x, m)| squared * *m * *x);
        let inertia: Vec<D> = inertia.collect();
        let zero = D::from(0.0);
        let twice_kinetic = inertia.iter().zip(mode).fold(zero, |sum, (f, x)| sum + *f * *x);
        // Inertia forces and reactions balance the elastic forces; the latter act on held unknowns.
        let mut on_nodes = vec![zero; mode.len()];
        self.pencil.tangent.product(mode, &mut on_nodes);
        for i in self.pencil.free.clone() {
            on_nodes[i] = inertia[i];
        }
        let in_model = |vector: &[D]| motion_in_model(discretized, self.plane, vector);
        let (on_nodes, rates) = (in_model(&on_nodes), in_model(mode));
        let forces = internal_forces(discretized, |i| model.rate(&on_nodes, i));
        let directors = discretized.directors(self.setup);
        let still = vec![zero; self.q.len()];
        let rest = model.unknowns(&self.setup.rest);
        let chord = |q: &[D], j: usize| sub(model.position(q, j + 1), model.position(q, j));
        let mut effect = ThicknessEffect { shear: zero, rotary: zero };
        // Edge by edge: rotation of the section per amplitude, tension, transverse shear force, and
        // the two integrands.
        for j in 0..edges {
            let own = chord(self.q, j);
            let length = dot(own, own).sqrt();
            let [tangent, d1, d2] =
                discretized.axes(directors, self.q, &still, self.frames, j).map(|[axis, _]| axis);
            let transverse = |v: [D; 3]| sub(v, scale(tangent, dot(v, tangent)));
            let rotation =
                scale(sub(model.rate(&rates, j + 1), model.rate(&rates, j)), length.recip());
            let (section, material) = self.setup.scene.at((j as f64 + 0.5) / edges as f64);
            let moments = section.moments();
            let [i1, i2] = moments.second_moments;
            let axial = material.youngs_modulus * moments.area;
            let rest_chord = chord(&rest, j);
            let tension = axial * (length / dot(rest_chord, rest_chord).sqrt() - 1.0);
            let shear = transverse(add(forces[j], scale(rotation, tension)));
            let (about_d2, about_d1) = (dot(rotation, d1), dot(rotation, d2));
            let inertia = i1 * about_d2 * about_d2 + i2 * about_d1 * about_d1;
            let piece = length * free_part(discretized, j);
            effect.shear += dot(shear, shear) * piece / axial;
            effect.rotary += squared * material.density * inertia * piece;
        }
        // The denominator, twice the kinetic energy of the mode without the effects.
        ThicknessEffect {
            shear: effect.shear / twice_kinetic,
            rotary: effect.rotary / twice_kinetic,
        }
    }
}
