//! Neutral equilibria, in which a motion meets no resistance: a rigid motion of a rod that no support holds, or the
//! spin of a straight round rod between hinges.
//!
//! Detection: the tangent has an eigenvalue within plus or minus the negligible stiffness. Its motion is found by
//! inverse iteration, and scaled to a displacement of the rod's length or a rotation of 1 rad ([`MotionMeasure`]). It
//! is a spin if nodes move by at most `SPIN` lengths, and rigid if the absolute strains sum to at most `RIGID`. The
//! equilibrium is neutral (`is_neutral`) if the motion is one of both; then the tangent is singular, and derivatives
//! need an added stiffness. Another motion without resistance, as at a critical load, is [`Error::Indifferent`] with
//! the node that moves most. Under loads without a potential no equilibrium counts as neutral.

use crate::error::Error;
use crate::numerics::tangent::Factors;
use crate::problem::{Discretized, FramesOf, Model};
use crate::rod::{Rod, strain_rates};
use crate::statics::pencil::Pencil;

/// Largest displacement of nodes, in lengths of the rod, of a motion that counts as a spin.
const SPIN: f64 = 1e-6;
/// Largest sum of the absolute strains of a motion that counts as rigid.
const RIGID: f64 = 1e-2;
/// Number of inverse iterations. The eigenvalue is smaller than the others by many orders of magnitude.
const ITERATIONS: usize = 3;
/// Shift of the elimination over the negligible stiffness, and another one in case of a zero pivot.
const SHIFTS: [f64; 2] = [1.0, 1.0137];

/// Displacement and strains of a motion. It is scaled to a largest displacement of the rod's length, or a largest
/// rotation of an edge about itself of 1 rad.
pub(crate) struct MotionMeasure {
    /// The node with the largest displacement.
    pub node: usize,
    /// Its displacement, in lengths of the rod.
    displacement: f64,
    /// Sum of the absolute values of all strains of the scaled motion, without a unit.
    strain: f64,
    /// Energies of stretching, bending and twisting by these strains, J.
    pub energies: [f64; 3],
}

impl MotionMeasure {
    /// Whether edges rotate about themselves and nodes stay: the largest displacement is at most `SPIN` lengths of
    /// the rod.
    pub fn is_spin(&self) -> bool {
        self.displacement <= SPIN
    }
    /// Whether the rod keeps its shape: the sum of absolute strains is at most `RIGID`.
    pub fn is_rigid(&self) -> bool {
        self.strain <= RIGID
    }
}

impl<M: Model> Discretized<'_, M> {
    /// Whether the equilibrium at `q` is neutral: the tangent has an eigenvalue between minus and plus one negligible
    /// stiffness. The motion of the eigenvalue nearest to that stiffness, found by inverse iteration, must then be
    /// rigid or a spin. Under loads without a potential the result is false.
    ///
    /// # Errors
    /// [`Error::Indifferent`], with the node that moves most, for other motions without resistance, as at a critical
    /// load. [`Error::SingularEquilibrium`] for zero pivots at all shifts.
    pub(crate) fn is_neutral(&self, q: &[f64], frames: &FramesOf<M>) -> Result<bool, Error> {
        // The eigenvalues of an unsymmetric tangent are not counted by its pivots.
        if self.has_follower_loads() {
            return Ok(false);
        }
        let pencil = Pencil::resting(self, &self.rod(), q, frames);
        let factors = pencil.factors(SHIFTS[0]).or_else(|_| pencil.factors(SHIFTS[1]))?;
        // An eigenvalue between -1 and 1 is zero: the masses of the pencil are negligible stiffnesses.
        if pencil.inertia(-1.0)? == factors.negative_pivots() {
            return Ok(false);
        }
        // Inverse iteration finds its motion.
        let mut x: Vec<f64> = (0..q.len()).map(|i| 1.0 + (i * 71 % 101) as f64 / 101.0).collect();
        for _ in 0..ITERATIONS {
            factors.solve(&mut x);
            let largest = x.iter().fold(f64::MIN_POSITIVE, |most, x| most.max(x.abs()));
            x.iter_mut().zip(&pencil.mass).for_each(|(x, m)| *x *= m / largest);
        }
        factors.solve(&mut x);
        if let Some(edges) = self.edge_coordinates() {
            edges.node_changes::<f64, M::Rod<f64>>(&mut x);
        }
        let motion = self.measure_motion(q, frames, &x);
        match motion.is_spin() || motion.is_rigid() {
            true => Ok(true),
            false => Err(Error::Indifferent { node: motion.node }),
        }
    }

    /// Displacement, strains and energies of the motion with the rates `x` of all unknowns from the state `q`. The
    /// motion is scaled: no component of a displacement exceeds the rod's length, no rotation of an edge about itself 1
    /// rad, and one of them reaches this limit. Strains are their rates along the scaled motion, by central
    /// differences. Energies are those of these strains with the elastic stiffness. `node` is the one with the largest
    /// component.
    pub(crate) fn measure_motion(
        &self,
        q: &[f64],
        frames: &FramesOf<M>,
        x: &[f64],
    ) -> MotionMeasure {
        let length = self.problem.length();
        // The node with the largest absolute rate, of positions or of angles, and that rate.
        let size = |of_angles: bool| {
            let own = (0..x.len()).filter(|i| M::Rod::<f64>::is_angle(*i) == of_angles);
            own.map(|i| (i / M::STRIDE, x[i].abs()))
                .fold((0, 0.0), |a: (usize, f64), b| if b.1 > a.1 { b } else { a })
        };
        let ((node, moved), (_, turned)) = (size(false), size(true));
        let scale = (moved / length).max(turned).max(f64::MIN_POSITIVE);
        let x: Vec<f64> = x.iter().map(|x| x / scale).collect();
        let (rod, mut strains) = (self.rod(), Vec::new());
        strain_rates(&rod, q, frames, &x, length, &mut strains);
        MotionMeasure {
            node,
            displacement: moved / length / scale,
            strain: strains.iter().map(|rate| rate.abs()).sum(),
            energies: rod.strain_energies(&strains),
        }
    }
}
