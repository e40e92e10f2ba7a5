//! Warning of a rod that is too thick for a model without shear deformation and rotary inertia.
//!
//! Both lower the squared frequency of the first bending mode, by the relative amount
//!
//! ```text
//! r = (I/A)/L^2 (rotary + shear E/(kappa G))
//! ```
//!
//! (Timoshenko, to first order) with the mean square slope of the mode over its mean square (`rotary`), and that of the
//! third derivative over that of the second one (`shear`), for a length of 1. Shear also increases deflections at rest,
//! by up to about the second term. `Problem::thickness_note` warns where `r` is above [`LARGEST_REDUCTION`]. Section
//! and material are those in the middle of the rod, the plane of bending that of the softer direction.

use crate::code::Code;
use crate::problem::Problem;
use crate::scene::{Section, Support};

/// Relative reduction of the squared frequency above which there is a warning: frequencies are 2.5 % too high.
const LARGEST_REDUCTION: f64 = 0.05;

/// Coefficients of rotary inertia and of shear for the first mode of a straight beam by the supports of its ends.
fn thickness_coefficients(ends: [Support; 2]) -> [f64; 2] {
    let is_clamped = |end: &Support| matches!(end, Support::Clamped | Support::Recorded);
    let is_free = |end: &Support| *end == Support::Free;
    let clamped = ends.iter().filter(|end| is_clamped(end)).count();
    let free = ends.iter().filter(|end| is_free(end)).count();
    match (clamped, free) {
        (2, _) => [12.30, 49.48],
        (1, 1) => [4.65, 4.65],
        (1, _) => [11.51, 27.23],
        (_, 2) => [49.48, 12.30],
        (_, 1) => [27.23, 11.51],
        _ => [9.87, 9.87],
    }
}

impl Problem {
    /// Warning of a thick rod, with the changes of deflections and frequency that the model leaves out; `None` of a
    /// slender one, and of a section of unknown outline.
    pub(super) fn thickness_note(&self) -> Option<(Code, String)> {
        let scene = self.scene();
        let section = scene.at(0.5).0;
        if matches!(section, Section::Custom { .. }) {
            return None;
        }
        let moments = section.moments();
        let [first, second] = moments.second_moments;
        let square = first.min(second) / moments.area / self.length().powi(2);
        let [rotary, shear] = thickness_coefficients([scene.supports.start, scene.supports.end]);
        let deflection = shear * square * scene.shear_flexibility();
        let reduction = deflection + rotary * square;
        (reduction > LARGEST_REDUCTION).then(|| {
            let words = format!(
                "the rod is thick: shear deformation and rotary inertia, which the model leaves out, lower its first \
                 frequency by about {:.0} % and increase deflections by up to about {:.0} %. Use a longer or thinner \
                 rod; in fits of frequencies set timoshenko = true",
                50.0 * reduction,
                100.0 * deflection
            );
            (Code::ThickRod, words)
        })
    }
}
