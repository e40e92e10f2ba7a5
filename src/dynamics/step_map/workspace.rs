//! Lists that the linear map of a step works in: derivatives of forces, strains, stresses and drag along `G` parameters, kept
//! from step to step so that a step does not allocate.

use crate::numerics::lanes::Lanes;
use crate::numerics::vector::Vector;
use crate::rod::{DualFrames, EffectiveStrains, NodalDrag, Rod};
use num_dual::Dual64;

/// The forces whose stresses are meant.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HistoryMoment {
    /// Those at the end of the step, in its equations.
    End,
    /// Those that the next step takes as the forces at its start.
    NextStart,
}

/// Strains and stresses of a step with their derivatives along `G` parameters.
#[derive(Clone, Default)]
pub struct HistoryWorkspace<const G: usize> {
    /// Derivatives of the strains at the end: at fixed unknowns, and in all.
    pub rest: Vec<Lanes<G>>,
    pub strain: Vec<Lanes<G>>,
    /// Stretches of springs of internal friction without slip, and the derivatives of those with slip.
    pub z: Vec<f64>,
    pub slid: Vec<Lanes<G>>,
    pub effective: EffectiveStrains<G>,
    /// Derivatives of the stresses.
    pub stress: Vec<Lanes<G>>,
    /// Strains along a change of the forces' unknowns; derivatives of a misfit by effective strains.
    pub along: Vec<f64>,
    pub by_strain: Vec<f64>,
    pub by_own: Vec<f64>,
}

/// Places and velocities with their derivatives along one parameter, and the drag there.
#[derive(Clone, Default)]
pub struct DragWorkspace {
    pub places: Vec<Dual64>,
    pub v: Vec<Dual64>,
    tangents: Vec<Vector<Dual64>>,
    forces: Vec<Dual64>,
}

impl DragWorkspace {
    /// Adds the derivatives of the drag to lane `g`.
    pub fn add_rates<const G: usize>(
        &mut self,
        drag: &NodalDrag<Dual64>,
        g: usize,
        out: &mut [[f64; G]],
    ) {
        drag.tangents(&self.places, &mut self.tangents);
        self.forces.clear();
        self.forces.resize(self.v.len(), Dual64::from(0.0));
        drag.add_forces(&self.tangents, &self.v, &mut self.forces);
        out.iter_mut().zip(&self.forces).for_each(|(out, force)| out[g] += force.eps);
    }
}

/// An unknown that a support holds, with the derivatives of its place and velocity at the end of the step.
#[derive(Clone, Copy)]
pub struct Held<const G: usize> {
    pub i: usize,
    pub q: [f64; G],
    pub v: [f64; G],
}

/// Lists that the map works in.
#[derive(Clone)]
pub struct StepWorkspace<R: Rod<f64>, const G: usize> {
    /// Derivatives of the forces at fixed unknowns, or of a misfit by the forces.
    pub direct: Vec<[f64; G]>,
    /// The right-hand side of the step's equations, and its solution.
    pub right: Vec<[f64; G]>,
    pub solution: Vec<[f64; G]>,
    pub stiff: Vec<f64>,
    pub held: Vec<Held<G>>,
    /// Frames with derivatives, for supports that parameters move; empty elsewhere.
    pub dual_frames: Vec<DualFrames<R, f64>>,
    pub history: HistoryWorkspace<G>,
    pub drag: DragWorkspace,
}

impl<R: Rod<f64>, const G: usize> StepWorkspace<R, G> {
    /// StepWorkspace for a rod with so many unknowns.
    pub fn new(unknowns: usize, dual_frames: Vec<DualFrames<R, f64>>) -> Self {
        let zero = vec![[0.0; G]; unknowns];
        Self {
            direct: zero.clone(),
            right: zero.clone(),
            solution: zero,
            stiff: vec![0.0; unknowns],
            held: Vec::new(),
            dual_frames,
            history: HistoryWorkspace::default(),
            drag: DragWorkspace::default(),
        }
    }
}
