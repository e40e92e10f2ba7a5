//! Reusable lists of the linear map of a step: derivatives of forces, strains, stresses and drag along `G`
//! parameters.
//!
//! [`StepWorkspace`] has the derivatives of forces, right-hand sides and solutions per unknown, and the [`Held`]
//! unknowns of supports. [`HistoryWorkspace`] has those of strains, effective strains and stresses per strain.
//! [`DragWorkspace`] has places (m) and velocities (m/s) in dual numbers; its `add_rates` adds the derivatives of minus
//! the drag (N) there to one lane. The lists are kept from step to step, and resized at the first one. With `G = 1` the
//! transposed map uses them for derivatives of a misfit.

use crate::dynamics::step_map::branch_relaxation::BranchRelaxation;
use crate::numerics::directions::Directions;
use crate::numerics::vector::Vector;
use crate::rod::{DualFrames, EffectiveStrains, NodalDrag, Rod};
use num_dual::Dual64;

/// Strains and stresses of a step with their derivatives along `G` parameters.
#[derive(Clone, Default)]
pub struct HistoryWorkspace<const G: usize> {
    /// Derivatives of the strains at the end of the step at fixed unknowns, by rest lengths.
    pub rest: Vec<Directions<G>>,
    /// Derivatives of the strains at the end of the step in all.
    pub strain: Vec<Directions<G>>,
    /// Stretches of springs of internal friction without slip.
    pub z: Vec<f64>,
    /// Derivatives of those stretches with slip.
    pub slid: Vec<Directions<G>>,
    /// Relaxation of the Maxwell branches over the step.
    pub branches: Vec<BranchRelaxation>,
    /// Effective strains with their derivatives.
    pub effective: EffectiveStrains<G>,
    /// The effective strains with those of internal friction.
    pub slipping: EffectiveStrains<G>,
    /// Derivatives of the stresses.
    pub stress: Vec<Directions<G>>,
    /// Transposed map: strains along the direction `d` of the derivatives by the forces.
    pub along: Vec<f64>,
    /// Transposed map: derivatives of the misfit by the effective strains.
    pub by_strain: Vec<f64>,
    /// Transposed map: the same by the strains with damping times of their own.
    pub by_own: Vec<f64>,
}

/// Places, m, and velocities, m/s, of all unknowns with their derivatives along one parameter, and the drag there.
#[derive(Clone, Default)]
pub struct DragWorkspace {
    pub places: Vec<Dual64>,
    pub v: Vec<Dual64>,
    tangents: Vec<Vector<Dual64>>,
    forces: Vec<Dual64>,
}

impl DragWorkspace {
    /// Adds to lane `g` of `out` the derivatives of minus the drag, N, at the places and velocities of this workspace.
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

/// An unknown that a support holds: its index `i`, and the derivatives of its place and velocity at the end of the
/// step.
#[derive(Clone, Copy)]
pub struct Held<const G: usize> {
    pub i: usize,
    pub q: [f64; G],
    pub v: [f64; G],
}

/// All lists of the map of a step.
#[derive(Clone)]
pub struct StepWorkspace<R: Rod<f64>, const G: usize> {
    /// Derivatives of the forces at fixed unknowns, or transposed those of a misfit by the forces.
    pub direct: Vec<[f64; G]>,
    /// Right-hand sides of the step's equations.
    pub right: Vec<[f64; G]>,
    /// Their solutions: derivatives of the unknowns at the end.
    pub solution: Vec<[f64; G]>,
    /// Product of the tangent with a vector.
    pub stiff: Vec<f64>,
    /// Angles by which directors turn with their frames, rad; zero for other unknowns.
    pub turned: Vec<[f64; G]>,
    pub held: Vec<Held<G>>,
    /// Frames with derivatives, for supports that parameters move; empty elsewhere.
    pub dual_frames: Vec<DualFrames<R, f64>>,
    pub history: HistoryWorkspace<G>,
    pub drag: DragWorkspace,
    /// Derivatives of the drag at the end; of rods with drag and a history.
    pub dragged: Vec<[f64; G]>,
    /// Right-hand sides by loads in time; empty without any.
    pub timed: Vec<[f64; G]>,
}

impl<R: Rod<f64>, const G: usize> StepWorkspace<R, G> {
    /// Work lists with zeros for each of the `unknowns` of a rod, and empty lists for the others. `dual_frames`: one
    /// per parameter if parameters may move supports, else empty.
    pub fn new(unknowns: usize, dual_frames: Vec<DualFrames<R, f64>>) -> Self {
        let zero = vec![[0.0; G]; unknowns];
        Self {
            direct: zero.clone(),
            right: zero.clone(),
            turned: zero.clone(),
            solution: zero,
            stiff: vec![0.0; unknowns],
            held: Vec::new(),
            dual_frames,
            history: HistoryWorkspace::default(),
            drag: DragWorkspace::default(),
            dragged: Vec::new(),
            timed: Vec::new(),
        }
    }
}
