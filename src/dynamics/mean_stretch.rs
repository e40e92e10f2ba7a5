//! Warning of the average vector field, which takes forces between the two states of a step: edges are shorter there.
//!
//! An edge that rotates by an angle `a` within a step is shorter by `a^2/8` in the mean of both states. Forces between
//! the ends of the step thus have a strain that the motion does not have. Where the edge is stiff, their energy is
//! taken from the kinetic energy, and the motion is slower than that of the rod. The total energy is conserved all the
//! same. [`MeanStretch`] is the stretching energy, J, of the edges of one rod in the mean of two successive states,
//! from the positions of its nodes, m. [`warning`] is the code and text of the warning of a run, if that energy exceeds
//! [`MAX_MEAN_STRETCH`] of the largest kinetic energy; `None` for other schemes.

use crate::code::Code;
use crate::numerics::vector::{norm, sub};
use crate::scene::{Scene, Scheme};

/// Largest stretching energy of mean states without a warning, over the largest kinetic energy. Pendulums of 20 edges
/// with moduli of 1e10 and 1e11 Pa were off by a fifth of this ratio times their length.
const MAX_MEAN_STRETCH: f64 = 0.02;

/// Stretching energies of a rod in the means of successive states.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct MeanStretch {
    /// Axial stiffness EA halfway along the rod, N.
    stiffness: f64,
    /// Edge vectors of the last state, m; empty before the first one.
    before: Vec<[f64; 3]>,
}

impl MeanStretch {
    /// For the rod of a scene with the scheme `average-vector-field`; `None` for other schemes and without `[time]`.
    pub fn new(scene: &Scene) -> Option<Self> {
        let is_averaging = |scheme| scheme == Scheme::AverageVectorField;
        scene.time.as_ref().filter(|time| is_averaging(time.scheme))?;
        let (section, material) = scene.at(0.5);
        let stiffness = material.youngs_modulus * section.moments().area;
        Some(Self { stiffness, before: Vec::new() })
    }

    /// The stretching energy, J, in the mean of the last state and the one with these positions of the nodes, m, which
    /// becomes the last one. Zero for the first state. Mean lengths of both states count as unstretched.
    pub fn next(&mut self, nodes: impl Iterator<Item = [f64; 3]>) -> f64 {
        let (mut energy, mut last, mut edge) = (0.0, None, 0);
        for node in nodes {
            let Some(previous) = last.replace(node) else { continue };
            let now: [f64; 3] = sub(node, previous);
            match self.before.get_mut(edge) {
                None => self.before.push(now),
                Some(before) => {
                    let mean = [0, 1, 2].map(|c| 0.5 * (now[c] + before[c]));
                    let length = 0.5 * (norm(now) + norm(*before));
                    let strain = norm(mean) / length - 1.0;
                    energy += 0.5 * self.stiffness * length * strain * strain;
                    *before = now;
                }
            }
            edge += 1;
        }
        energy
    }
}

/// Code and text of the warning of a run, in which the stretching energy of mean states was at most `stretch` and the
/// kinetic energy at most `kinetic`, J. `None` up to the limit and for other schemes; NaN is a warning.
pub(crate) fn warning(scene: &Scene, stretch: f64, kinetic: f64) -> Option<(Code, String)> {
    let time = scene.time.as_ref().filter(|time| time.scheme == Scheme::AverageVectorField)?;
    if stretch == 0.0 {
        return None;
    }
    let ratio = stretch / kinetic;
    // The angles of rotation are proportional to the step, their effect is of fourth order.
    // A motion that is much too slow does not show the rotation of the right one.
    let advice = match time.step {
        Some(step) if ratio <= 1.0 => {
            let step = 0.9 * step * (MAX_MEAN_STRETCH / ratio).powf(0.25);
            format!("a time.step of at most {step:.1e} s")
        }
        _ => "a much smaller time.step".into(),
    };
    let words = format!(
        "the steps are too long for average-vector-field and a rod of this axial stiffness. Edges rotate within a step, \
         and the mean of both ends of a step is shorter than they are: its stretching energy is {:.0} % of the largest \
         kinetic energy. The motion is too slow. Use {advice}, or scheme = \"newmark-beta\"",
        100.0 * ratio
    );
    (ratio.is_nan() || ratio > MAX_MEAN_STRETCH).then_some((Code::MeanStretch, words))
}
