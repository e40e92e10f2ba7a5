//! Warning of a rod that is too thick for a model without shear deformation and rotary inertia.
//!
//! Both lower the squared frequency of the first bending mode, and about as much the stiffness at rest, by
//!
//! ```text
//! r = lambda^2 (I/A)/L^2 (1 + E/(kappa G))
//! ```
//!
//! (Timoshenko, to first order) with the dimensionless frequency `lambda^2` of the first mode of a beam with such ends.
//! `Problem::thickness_note` warns where `r` is above [`LARGEST_REDUCTION`]. Section and material are those in the
//! middle of the rod, the plane of bending that of the softer direction.

use crate::code::Code;
use crate::problem::Problem;
use crate::scene::Support;

/// Relative reduction of the stiffness above which there is a warning: frequencies are 2.5 % too high.
const LARGEST_REDUCTION: f64 = 0.05;

/// Dimensionless first frequency `omega L^2 sqrt(rho A/(E I))` of a straight beam by the supports of its ends.
fn first_frequency(ends: [Support; 2]) -> f64 {
    let is_clamped = |end: &Support| matches!(end, Support::Clamped | Support::Recorded);
    let is_free = |end: &Support| *end == Support::Free;
    match ends {
        ends if ends.iter().all(is_clamped) || ends.iter().all(is_free) => 22.37,
        ends if ends.iter().any(is_clamped) && ends.iter().any(is_free) => 3.516,
        ends if ends.iter().any(is_clamped) || ends.iter().any(is_free) => 15.42,
        _ => 9.870,
    }
}

impl Problem {
    /// Warning of a thick rod, with the reductions of stiffness and frequency that the model leaves out; `None` of a
    /// slender one, and of sections whose shear coefficient is unknown.
    pub(super) fn thickness_note(&self) -> Option<(Code, String)> {
        let scene = self.scene();
        let moments = scene.at(0.5).0.moments();
        let [first, second] = moments.second_moments;
        let square = first.min(second) / moments.area / self.length().powi(2);
        let ends = [scene.supports.start, scene.supports.end];
        let reduction = first_frequency(ends) * square * (1.0 + scene.shear_flexibility());
        (reduction > LARGEST_REDUCTION).then(|| {
            let words = format!(
                "the rod is thick: shear deformation and rotary inertia, which the model leaves out, lower its \
                 stiffness by about {:.0} % and its first frequency by {:.0} %. Results are those of a slender rod. \
                 Use a longer or thinner rod; in fits of frequencies set timoshenko = true",
                100.0 * reduction,
                50.0 * reduction
            );
            (Code::ThickRod, words)
        })
    }
}
