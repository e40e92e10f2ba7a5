//! The state of a rod between time steps: unknowns, velocities, accelerations, forces, reference frames and internal
//! variables.
//!
//! [`State`] has the time, s, the unknowns `q`, m (rad for angles), their rates, and reference frames. `unbalanced` is
//! the gradient of elastic energy less loads, plus damping for most schemes, N: minus the force that accelerates.
//! Accelerations are empty for schemes without them. [`InternalVariables`] are strains, their mean rates over the last
//! step, 1/s, and spring stretches, on which stresses with a history depend: Kelvin-Voigt damping, relaxation (Maxwell
//! branches), internal friction. Their lists are empty without these; `branches` are the stretches of each Maxwell
//! branch. `wound` corrects the potential at `q`, J: it adds whole turns of constant moments and subtracts the work of
//! loads in time since the start. [`ExchangedEnergy`] sums the absolute works of these loads. `at_rest` returns a state
//! at t = 0 without velocity; steppers overwrite it with that at the end of each step, and `restore` copies an earlier
//! one back.

use crate::numerics::scalar::Scalar;
use std::slice::ChunksExact;

/// The state of a rod at one time. Lengths: the rod's degrees of freedom, or its strains.
#[derive(Clone, Debug)]
pub struct State<D, F> {
    /// The time of the state, s.
    pub time: f64,
    /// Unknowns, m (rad for angles).
    pub q: Vec<D>,
    /// The reference frames of the angles; `()` in the plane.
    pub frames: F,
    /// Velocities, m/s (rad/s).
    pub v: Vec<D>,
    /// Accelerations, m/s^2 (rad/s^2), of a scheme that uses them; empty for other schemes, and before they are known.
    pub acceleration: Vec<D>,
    /// Gradient of elastic energy less loads, plus the forces of damping, drag and contact losses: minus the force that
    /// accelerates, N. Explicit and linearly implicit schemes have the gradient alone. The average vector field scheme
    /// leaves the gradient and mass damping out, and has half of the viscous forces.
    pub unbalanced: Vec<D>,
    /// The internal variables of the material.
    pub internal: InternalVariables<D>,
    /// The part of the potential of constant moments by whole turns of the first edge since the start, less the work of
    /// loads in time since then, J: added to the potential at `q`.
    pub wound: f64,
    /// The energy that loads in time have exchanged with the rod since the start, J.
    pub exchanged: ExchangedEnergy,
}

/// Sums over all steps of a run with loads in time, J; zero without them.
#[derive(Clone, Copy, Debug, Default)]
pub struct ExchangedEnergy {
    /// Sum of the absolute works of the steps.
    pub work: f64,
    /// Sum of the absolute differences between the work of the forces in the equations of a step, which may be those of
    /// a later interval, and the work of the step.
    pub lead: f64,
}

/// The internal variables of the material, for Kelvin-Voigt damping, relaxation and internal friction; without these
/// all lists are empty. Sensitivities keep the derivatives of the variables in the same struct.
#[derive(Clone, Debug)]
pub struct InternalVariables<D> {
    /// Strains of all elements, in the order of [`Rod::strains`](crate::rod::Rod::strains).
    pub strain: Vec<D>,
    /// Their mean rates over the step that ended here, 1/s.
    pub strain_rate: Vec<D>,
    /// Stretches of the springs of internal friction, one for each strain of bending and twisting; empty without
    /// friction.
    pub slid: Vec<D>,
    /// Stretches of the springs of the Maxwell branches, branch after branch, one for each strain; empty without any.
    pub relaxing: Vec<D>,
}

impl<D> Default for InternalVariables<D> {
    /// Empty lists: a material without viscosity, relaxation and internal friction.
    fn default() -> Self {
        Self { strain: Vec::new(), strain_rate: Vec::new(), slid: Vec::new(), relaxing: Vec::new() }
    }
}

impl<D> InternalVariables<D> {
    /// The lists of the spring stretches of the Maxwell branches, branch after branch, each with one stretch per
    /// strain; no list without branches.
    pub fn branches(&self) -> ChunksExact<'_, D> {
        self.relaxing.chunks_exact(self.strain.len().max(1))
    }
}

impl<D: Scalar> InternalVariables<D> {
    /// Overwrites these variables with a copy of `other`; allocated lists are reused.
    fn restore(&mut self, other: &Self) {
        self.strain.clone_from(&other.strain);
        self.strain_rate.clone_from(&other.strain_rate);
        self.slid.clone_from(&other.slid);
        self.relaxing.clone_from(&other.relaxing);
    }
}

impl<D: Scalar, F: Clone> State<D, F> {
    /// A state at the unknowns `q` and frames at time zero, with zero velocities and forces, no accelerations, and
    /// empty internal variables.
    pub fn at_rest(q: Vec<D>, frames: F) -> Self {
        let zero = vec![D::from(0.0); q.len()];
        Self {
            time: 0.0,
            v: zero.clone(),
            acceleration: Vec::new(),
            unbalanced: zero,
            q,
            frames,
            wound: 0.0,
            exchanged: ExchangedEnergy::default(),
            internal: InternalVariables::default(),
        }
    }

    /// Overwrites this state with a copy of `other`, time and internal variables included; allocated lists are
    /// reused.
    pub fn restore(&mut self, other: &Self) {
        self.time = other.time;
        self.wound = other.wound;
        self.exchanged = other.exchanged;
        self.q.clone_from(&other.q);
        self.frames.clone_from(&other.frames);
        self.v.clone_from(&other.v);
        self.acceleration.clone_from(&other.acceleration);
        self.unbalanced.clone_from(&other.unbalanced);
        self.internal.restore(&other.internal);
    }
}
