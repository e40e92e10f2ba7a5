//! What the derivatives of a misfit with respect to a rod's numbers are made of: the
//! [sensitive](crate::rod::sensitive) rod's formulas, transposed.
//!
//! A covector of the forces, `d`, meets the stresses through the strains that it would make, `w = B d`. Everything
//! that a parameter changes in a rod is a change of laws and loads, so it is enough to sum what each law counts for.

use crate::numerics::lanes::Lanes;
use crate::rod::sensitive::{FrameRate, Sensitive};

/// The derivatives of a misfit by the numbers of a rod's laws and loads.
#[derive(Clone, Debug, Default)]
pub struct Laws {
    /// By axial forces (N): as functions of the strain, and without.
    pub stretch: Vec<[f64; 2]>,
    /// By rest lengths over themselves, where they change strains that were counted.
    pub rest: Vec<f64>,
    /// By the stiffness of joints, the upper triangle row by row, and by what their stresses are at no strain; of planar
    /// rods the first of either.
    pub joint: Vec<([f64; 6], [f64; 3])>,
    /// By the loads on all unknowns.
    pub load: Vec<f64>,
    /// By dead moments on every edge, where any are or are asked for.
    pub moment: Vec<f64>,
}

impl Laws {
    /// Zeros.
    pub fn new(edges: usize, unknowns: usize, moments: usize) -> Self {
        Self {
            stretch: vec![[0.0; 2]; edges],
            rest: vec![0.0; edges],
            joint: vec![([0.0; 6], [0.0; 3]); edges - 1],
            load: vec![0.0; unknowns],
            moment: vec![0.0; moments],
        }
    }
}

/// What stresses follow from: the strains as they are counted, those that kinds of strain count besides, and whether
/// natural strains count.
#[derive(Clone, Copy, Debug)]
pub struct Strained<'a> {
    /// In the order of the strains.
    pub strains: &'a [f64],
    /// Empty of most rods.
    pub own: &'a [f64],
    /// Whether edges have their rest lengths in strains that were counted, and not in their law.
    pub counted: bool,
}

/// A rod whose [derivatives](Sensitive) go backwards too.
pub trait Transposed: Sensitive {
    /// No derivatives by what a rod is made of. `moments`: whether those by dead moments are asked for.
    fn no_laws(&self, moments: bool) -> Laws;

    /// Writes the strains of all elements where the rod is measured.
    fn measured_strains(geometry: &Self::Geometry, out: &mut Vec<f64>);

    /// Makes strains along a change of the unknowns what stresses are multiplied with: edges count with their lengths.
    fn by_length(&self, strains: &mut [f64]);

    /// Writes `K w` of strains `w`, and of what has no coupling of bending and twisting.
    fn stiffened(&self, w: &[f64], coupled: bool, out: &mut Vec<f64>);

    /// Adds what laws count for at these strains, where stresses count for `w`.
    fn add_to_laws(&self, w: &[f64], strained: Strained<'_>, laws: &mut Laws);

    /// Adds what dead moments at `q` count for, where forces count for `d`.
    fn add_to_moments(&self, q: &[f64], d: &[f64], laws: &mut Laws);

    /// Adds what frames count for where angles of the edges do.
    fn turn_frames(geometry: &Self::Geometry, angles: &[f64], frames: &mut [FrameRate<1>]);

    /// Adds what frames count for where forces count for the first of `by`, of which the tangent makes the second, and
    /// the gradient is that given.
    fn add_to_frames(
        geometry: &Self::Geometry,
        gradient: &[f64],
        by: (&[f64], &[f64]),
        frames: &mut [FrameRate<1>],
    );

    /// Takes what frames count for back over their [move](Sensitive::rebase_rates), and adds what it leaves of it to
    /// that of the unknowns.
    fn rebase_back(geometry: &Self::Geometry, frames: &mut [FrameRate<1>], q: &mut [f64]);

    /// The derivative along what a parameter changes.
    fn along(&self, dual: &Self::Dual, rates: &Self::Rates<1>, laws: &Laws) -> f64;

    /// The same of every joint's law alone.
    fn along_joints(rates: &Self::Rates<1>, laws: &Laws) -> Vec<f64>;
}

/// The strains along a change of the unknowns, as stresses are multiplied with.
pub fn strained<R: Transposed>(
    rod: &R,
    geometry: &R::Geometry,
    still: &[FrameRate<1>],
    change: &[f64],
    out: &mut [f64],
) {
    let mut strains = vec![Lanes::ZERO; out.len()];
    rod.add_strain_rates(still, geometry, change.as_chunks::<1>().0, &mut strains);
    out.iter_mut().zip(strains).for_each(|(out, strain)| *out = strain.0[0]);
    rod.by_length(out);
}

/// Frames that stay.
pub fn still_frames(count: usize) -> Vec<FrameRate<1>> {
    vec![FrameRate { tangent: [Lanes::ZERO; 3], turn: Lanes::ZERO }; count]
}
