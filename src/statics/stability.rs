//! Stability of an equilibrium: how many independent motions decrease the energy to second order.
//!
//! Sylvester's law of inertia counts the negative eigenvalues of the tangent `K` without computing them. Elimination
//! on a fine mesh has rounding errors of `eps n^4 EI/L^3`, which hide the sign of small eigenvalues. The sign of
//! those is taken from the second variation of the energy along their eigenvectors,
//!
//! ```text
//! x' K x = x' d/dt grad E(q + t x),
//! ```
//!
//! evaluated element by element in dual numbers. There, strains and their rates are differences of neighboring nodes.
//! The rounding error is that of forces in elements times squared slopes of the motion, `eps n (EA + EI n^2/L^2) sum
//! |dx|^2/h`. It is some `n^3` times smaller for the motion of a rigid body. With more than [`MAX_UNCERTAIN`] such
//! eigenvalues, without their eigenvectors, and in edge coordinates, the inertia decides alone, and no motion is
//! marginal. Output of `stability`: numbers of unstable and of marginal motions, for equilibria and modes; a rigid
//! motion or spin without stiffness is neither. `stiffnesses` are the eigenvalues of the form `x' K x`, J, in the space
//! of given motions, each with its tolerance.

use crate::energy::Derivatives;
use crate::error::Error;
use crate::numerics::tangent::Tangent;
use crate::problem::{Discretized, FramesOf, Model};
use crate::rod::Rod;
use crate::statics::pencil::Pencil;
use crate::statics::reference_stiffness::NEGLIGIBLE;
use faer::{Mat, Side};
use num_dual::Dual64;

/// Eigenvalues within this many rounding levels of zero have an uncertain sign: rounding errors of the elimination
/// exceed the level, which is an estimate for single entries.
pub(crate) const UNCERTAIN_LEVELS: f64 = 100.0;
/// Largest number of eigenvalues whose signs are determined one by one. A free rod in space has six.
pub(crate) const MAX_UNCERTAIN: usize = 12;
/// Shift of the iteration for several such eigenvalues: far above the rounding level, which would keep the iteration
/// from converging, and below the stiffness of bending, which is `1/NEGLIGIBLE` levels.
const SHIFT_LEVELS: f64 = 1e8;

/// Numbers of independent motions that do not raise the energy.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Stability {
    /// Motions that decrease the energy.
    pub unstable: usize,
    /// Motions that deform the rod and whose stiffness is below its rounding error: at a critical load.
    pub marginal: usize,
}

impl std::ops::AddAssign for Stability {
    /// Adds the counts of unstable and marginal motions of another stability.
    fn add_assign(&mut self, other: Self) {
        self.unstable += other.unstable;
        self.marginal += other.marginal;
    }
}

/// The second variation of the energy along a motion `x`.
pub(crate) struct MotionStiffness {
    /// `x' K x`, J.
    pub value: f64,
    /// Sum of its rounding error and the negligible stiffness, J.
    pub tolerance: f64,
    /// Coefficients of the motion in the given ones.
    pub combination: Vec<f64>,
}

impl MotionStiffness {
    /// Whether the absolute stiffness is at most its tolerance, the sum of rounding error and negligible stiffness.
    pub fn is_zero(&self) -> bool {
        self.value.abs() <= self.tolerance
    }
}

impl<M: Model> Discretized<'_, M> {
    /// Numbers of unstable and marginal motions of an equilibrium at `q` with the tangent of `pencil`, whose masses are
    /// [negligible stiffnesses](Self::negligible_stiffness). Eigenvalues below minus [`UNCERTAIN_LEVELS`] are counted
    /// as unstable by inertia, those above it as stable. Between them the second variation decides: a negative one is
    /// unstable. A zero one is marginal, unless its motion is rigid or a spin, which is not counted. With more than
    /// [`MAX_UNCERTAIN`] eigenvalues between, in edge coordinates, or without eigenvectors, inertia decides alone, and
    /// no motion is marginal. `in_model` maps vectors of the pencil to the unknowns of the model.
    ///
    /// # Errors
    /// [`Error::SingularEquilibrium`] for zero pivots at all shifts.
    pub(crate) fn stability<T: Tangent<f64>>(
        &self,
        q: &[f64],
        frames: &FramesOf<M>,
        pencil: &Pencil<f64, T>,
        in_model: impl Fn(&[f64]) -> Vec<f64>,
    ) -> Result<Stability, Error> {
        // Eigenvalues far from zero have certain signs, which the inertia counts.
        let certain = pencil.inertia(-UNCERTAIN_LEVELS)?;
        let possible = pencil.inertia(UNCERTAIN_LEVELS)?;
        let by_inertia = |pencil: &Pencil<f64, T>| -> Result<Stability, Error> {
            Ok(Stability { unstable: pencil.inertia(-1.0)?, marginal: 0 })
        };
        if possible <= certain {
            return Ok(Stability { unstable: certain, marginal: 0 });
        }
        // Many uncertain signs, or a well-conditioned tangent in edge coordinates: the inertia decides.
        if possible - certain > MAX_UNCERTAIN || self.edge_coordinates().is_some() {
            return by_inertia(pencil);
        }
        // Several such eigenvalues are those of rigid motions; a single one passes through zero at a critical load.
        let shift = if possible - certain > 1 { SHIFT_LEVELS } else { 1.0 };
        let Ok(found) = pencil.lowest(possible, shift) else { return by_inertia(pencil) };
        let motions: Vec<Vec<f64>> =
            found[certain..].iter().map(|mode| in_model(&mode.vector)).collect();
        let mut stability = Stability { unstable: certain, marginal: 0 };
        // Of the others the second variation decides; motions without stiffness are marginal unless they are rigid or a
        // spin.
        for stiffness in self.stiffnesses(q, frames, &motions) {
            if !stiffness.is_zero() {
                stability.unstable += usize::from(stiffness.value < 0.0);
                continue;
            }
            let x = linear_combination(&motions, &stiffness.combination);
            let motion = self.measure_motion(q, frames, &x);
            stability.marginal += usize::from(!(motion.is_rigid() || motion.is_spin()));
        }
        Ok(stability)
    }

    /// Eigenvalues of the form `x' K x`, J, in the space of `motions`, ascending, one per motion. Each has its
    /// tolerance and its motion as a combination of the given ones, with coefficients of unit norm. `K x` is the
    /// derivative of the hand-derived gradient along `x` in dual numbers. The motions are rates of all unknowns and
    /// vanish where supports hold the rod. If the small eigenvalue problem fails, the motions themselves are returned
    /// in their order.
    pub(crate) fn stiffnesses(
        &self,
        q: &[f64],
        frames: &FramesOf<M>,
        motions: &[Vec<f64>],
    ) -> Vec<MotionStiffness> {
        // Derivatives of the forces along the motions, K x.
        let rod = self.setup_over(|_, value| Dual64::from(value)).rod(self.model);
        let frames = M::frames_over::<Dual64>(frames);
        let forces: Vec<Vec<f64>> = motions
            .iter()
            .map(|x| {
                let q: Vec<Dual64> = q.iter().zip(x).map(|(q, x)| Dual64::new(*q, *x)).collect();
                let mut gradient = vec![Dual64::from(0.0); q.len()];
                rod.gradient(&q, &frames, Derivatives::Hand, &mut gradient);
                gradient.into_iter().map(|g| g.eps).collect()
            })
            .collect();
        let (count, free) = (motions.len(), self.free());
        let product = |x: &[f64], f: &[f64]| free.clone().map(|i| x[i] * f[i]).sum::<f64>();
        // The quadratic form x' K x in the space of the motions; its eigenvectors are the principal motions.
        let form = Mat::from_fn(count, count, |i, j| {
            0.5 * (product(&motions[i], &forces[j]) + product(&motions[j], &forces[i]))
        });
        let principal: Vec<Vec<f64>> = match form.self_adjoint_eigen(Side::Lower) {
            Ok(eigen) => {
                (0..count).map(|k| (0..count).map(|j| eigen.U()[(j, k)]).collect()).collect()
            }
            Err(_) => (0..count)
                .map(|k| (0..count).map(|j| f64::from(u8::from(j == k))).collect())
                .collect(),
        };
        let stiffness = |combination: Vec<f64>| {
            let (x, f) = (
                linear_combination(motions, &combination),
                linear_combination(&forces, &combination),
            );
            MotionStiffness {
                value: product(&x, &f),
                tolerance: self.stiffness_tolerance(&x),
                combination,
            }
        };
        principal.into_iter().map(stiffness).collect()
    }

    /// The uncertainty of the stiffness of a motion `x`, J: rounding errors of the elements' forces plus the negligible
    /// stiffness, `sum k_i x_i^2` with [`NEGLIGIBLE`] of bending. The former are `eps n k |dx|^2/l`, summed over
    /// neighboring nodes, for `n` nodes and edges of length `l`. `k` is the axial plus bending stiffness, `E A + E I
    /// (n/L)^2`, for angles the torsional one.
    fn stiffness_tolerance(&self, x: &[f64]) -> f64 {
        let (section, material) = self.scene().at(0.5);
        let moments = section.moments();
        let [i1, i2] = moments.second_moments;
        let (nodes, length) = (self.nodes() as f64, self.problem.length());
        let edge = length / (nodes - 1.0);
        let bending = material.youngs_modulus * i1.max(i2) * (nodes / length).powi(2);
        let axial = material.youngs_modulus * moments.area + bending;
        let torsion = material.shear_modulus() * moments.torsion_constant;
        let mut rounding = 0.0;
        for i in M::STRIDE..x.len() {
            let stiffness = if M::Rod::<f64>::is_angle(i) { torsion } else { axial };
            rounding += stiffness * (x[i] - x[i - M::STRIDE]).powi(2) / edge;
        }
        let neutral: f64 =
            self.part_of_bending_stiffness(NEGLIGIBLE).iter().zip(x).map(|(k, x)| k * x * x).sum();
        f64::EPSILON * nodes * rounding + neutral
    }
}

/// The sum of `vectors` of one length, each times its entry of `weights`; an empty vector without vectors.
pub(crate) fn linear_combination(vectors: &[Vec<f64>], weights: &[f64]) -> Vec<f64> {
    let mut sum = vec![0.0; vectors.first().map_or(0, Vec::len)];
    for (vector, weight) in vectors.iter().zip(weights) {
        sum.iter_mut().zip(vector).for_each(|(sum, x)| *sum += weight * x);
    }
    sum
}
