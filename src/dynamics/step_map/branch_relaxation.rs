//! Factors of a Maxwell branch in the effective strains of a step, and their derivatives by stiffness and relaxation
//! time. (The effective strain is the strain that the elastic stiffness multiplies to give the stress.)
//!
//! A spring of the branch has the stretch `z1 = left z0 + taken (s1 - s0)` at the end of a step of length `h`, with
//! `left = e^(-h/tau)` and `taken = (1 - e^(-h/tau)) tau/h`. `s0` and `s1` are the strains at start and end, `tau` is
//! the relaxation time. In the stress at the end, the branch counts as a strain `g z1` with its stiffness fraction `g`.
//! At the start of the next step it counts as `g z`, with the stretch `z` there. Input: the branch (`g`, and `tau` in
//! s) and the step size (s). [`BranchRelaxation`] has `left` and `taken` with their derivatives by `tau`. It returns
//! the factors of strain change (`change_factor`) and stretch (`stretch_factor`), and the derivatives of both by `g`
//! (`by_stiffness`) and by `tau` (`by_time`, 1/s). [`HistoryMoment`] is the moment of a stress: the end of the step, or
//! the start of the next.

use crate::dynamics::viscosity::relaxation;
use crate::scene::Maxwell;
use num_dual::Dual64;

/// The moment at which stresses are taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HistoryMoment {
    /// The end of the step, in its equations.
    End,
    /// The start of the next step.
    NextStart,
}

/// The relaxation of a Maxwell branch over a step.
#[derive(Clone, Copy, Debug)]
pub struct BranchRelaxation {
    /// Stiffness of the branch as a fraction of that of the rod.
    stiffness: f64,
    /// Factor `e^(-h/tau)` of the stretch at the start, with its derivative by the relaxation time `tau`.
    pub left: Dual64,
    /// Factor `(1 - e^(-h/tau)) tau/h` of the change of the strain, with its derivative by the relaxation time `tau`.
    pub taken: Dual64,
}

impl BranchRelaxation {
    /// The relaxation of a branch over a step of length `h`, s: `left` and `taken`, with derivative 1 of the relaxation
    /// time.
    pub fn new(branch: &Maxwell<f64>, h: f64) -> Self {
        let time = Dual64::new(branch.time, 1.0);
        let [left, taken] = relaxation(&Maxwell { stiffness: branch.stiffness.into(), time }, h);
        Self { stiffness: branch.stiffness, left, taken }
    }

    /// The factor `g taken` of the strain's change in the effective strain at the end of the step.
    pub fn change_factor(&self) -> f64 {
        self.stiffness * self.taken.re
    }

    /// The factor of the stretch `z0` at the start in the effective strain of a moment: `g left` at the end of the
    /// step, `g` at the start of the next, where `z0` is the stretch there.
    pub fn stretch_factor(&self, moment: HistoryMoment) -> f64 {
        match moment {
            HistoryMoment::End => self.stiffness * self.left.re,
            HistoryMoment::NextStart => self.stiffness,
        }
    }

    /// The derivatives of the factors of strain change and stretch, in this order, by the stiffness fraction: `[taken,
    /// left]` at the end of the step, `[0, 1]` at the start of the next.
    pub fn by_stiffness(&self, moment: HistoryMoment) -> [f64; 2] {
        match moment {
            HistoryMoment::End => [self.taken.re, self.left.re],
            HistoryMoment::NextStart => [0.0, 1.0],
        }
    }

    /// The derivatives of the factors of strain change and stretch, in this order, by the relaxation time, 1/s. At the
    /// end of the step the factors are `g taken` and `g left`; at the start of the next the derivatives are zero.
    pub fn by_time(&self, moment: HistoryMoment) -> [f64; 2] {
        match moment {
            HistoryMoment::End => [self.taken, self.left].map(|x| self.stiffness * x.eps),
            HistoryMoment::NextStart => [0.0; 2],
        }
    }
}
