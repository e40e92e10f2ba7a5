//! The equations of motion of a rod ([`System`]), one step of them ([`Step`]), settings of a stepper
//! ([`StepperSettings`]), and counts of numerical work ([`Work`]).
//!
//! A simulation passes these to the stepper of its scheme. A system has the rod under its loads, free and prescribed
//! unknowns, damping (1/s and s), drag, loads in time, actuators that follow signals, and moving supports.
//! `set_actuation` sets the natural strains, tensions and follower loads of the rod to values of the actuators'
//! signals. If recordings prescribe free unknowns, `apply_prescribed_velocities` overwrites the velocities of all
//! supports and recorded nodes at a time (s). A step has its system, end (s) and size (s). Settings are the scheme, its
//! parameter (beta or rho_inf), the tolerance, and the length (m) of which the tolerance is a part. `Work` counts
//! steps, Newton iterations, factorizations, tangents, gradients and stability checks; counts can be added.

use crate::energy::Derivatives;
use crate::numerics::prescribed_dofs::PrescribedDofs;
use crate::numerics::scalar::RodScalar;
use crate::problem::boundary::BoundaryMotion;
use crate::rod::{ActuatorEffect, Actuators, NodalDrag, Rod, TimedLoads};
use crate::scene::{Damping, Scheme, StepTolerance};
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// Counts of the numerical work of a simulation.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct Work {
    /// Number of time steps.
    pub steps: usize,
    /// Number of Newton iterations (linear solves).
    pub newton_iterations: usize,
    /// Number of band factorizations.
    pub factorizations: usize,
    /// Number of evaluations of gradient and tangent.
    pub tangents: usize,
    /// Number of evaluations of the gradient alone.
    pub gradients: usize,
    /// Number of states whose stability was examined.
    #[serde(default)]
    pub stability_checks: usize,
}

impl std::ops::AddAssign for Work {
    /// Adds each count of `other` to the same count.
    fn add_assign(&mut self, other: Self) {
        self.steps += other.steps;
        self.newton_iterations += other.newton_iterations;
        self.factorizations += other.factorizations;
        self.tangents += other.tangents;
        self.gradients += other.gradients;
        self.stability_checks += other.stability_checks;
    }
}

/// The settings of a stepper: scheme, its parameter, and the tolerance of its steps.
#[derive(Clone, Copy, Debug)]
pub struct StepperSettings<D> {
    /// The time integration scheme.
    pub scheme: Scheme,
    /// The parameter of the scheme: beta of Newmark-beta, the spectral radius of generalised-alpha; without meaning for
    /// the others.
    pub parameter: D,
    /// The error at which Newton's method ends.
    pub tolerance: StepTolerance,
    /// The length that the tolerance is a part of, m.
    pub length: f64,
}

/// The equations of motion of a rod: loads, supports, damping, drag and actuators.
#[derive(Clone, Debug)]
pub(crate) struct System<D, R> {
    /// The rod under its loads.
    pub rod: R,
    /// Which derivatives of the energy to use.
    pub derivatives: Derivatives,
    /// The unknowns that move.
    pub free: Range<usize>,
    /// Prescribed unknowns among them, which follow a recording.
    pub prescribed: PrescribedDofs,
    /// Mass damping, 1/s, and Kelvin-Voigt damping, s.
    pub damping: Damping<D>,
    /// The drag of a fluid, if there is one.
    pub drag: Option<NodalDrag<D>>,
    /// Forces that depend on time; none for most scenes.
    pub timed_loads: TimedLoads<D>,
    /// The actuators that follow signals, and the values to which the rod is set.
    pub actuators: Actuators<D>,
    /// How the supports move, if they do.
    pub boundary_motion: Option<BoundaryMotion<D>>,
}

/// One step of a system.
#[derive(Debug)]
pub(crate) struct Step<'a, D, R> {
    /// The equations of motion.
    pub system: &'a System<D, R>,
    /// The end of the step, s.
    pub time: f64,
    /// The length of the step, s.
    pub h: f64,
}

impl<D: RodScalar, R: Rod<D>> System<D, R> {
    /// Sets the rod to the `values` of the signals of its actuators, one per actuator, and stores them. By the effect
    /// of the actuator, a value is the tension of tendons, N, or the factor of a group of loads without a potential.
    /// Otherwise natural strains change by the actuator's shifts times the change of the value since the stored one.
    pub fn set_actuation(&mut self, values: &[D]) {
        let Self { rod, actuators, .. } = self;
        for (k, actuator) in actuators.list.iter().enumerate() {
            match &actuator.effect {
                ActuatorEffect::Strains(shifts) => {
                    rod.shift_natural_strains(shifts, values[k] - actuators.values[k]);
                }
                ActuatorEffect::Tensions(energies) => rod.set_tensions(energies, values[k]),
                ActuatorEffect::FollowerLoads(group) => rod.set_follower_factor(*group, values[k]),
            }
        }
        actuators.values.copy_from_slice(values);
    }
}

impl<D: RodScalar, R> System<D, R> {
    /// Overwrites the entries of `v`, m/s, of nodes held by moving supports or recordings with their velocities at
    /// `time`, s. Nothing changes without recorded unknowns inside the free range, or if no support moves.
    pub fn apply_prescribed_velocities(&self, time: f64, v: &mut [D]) {
        if let (false, Some(boundary_motion)) = (self.prescribed.is_empty(), &self.boundary_motion)
        {
            boundary_motion.velocities(time, v);
        }
    }
}
