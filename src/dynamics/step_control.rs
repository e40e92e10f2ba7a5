//! Step control: detection of wrong time steps by the total energy, by rotations of edges, and by passed obstacles.
//!
//! [`StepControl::check`] is called with the simulation after every trial step. Its error makes the caller halve the
//! step or, after the last halving, end the run. [`StepControl::accept`] is called for each accepted step.
//!
//! Energy: the total energy of a rod under dead loads, their potential included, can only fall, except by the error of
//! the scheme. At beta = 1/2 nothing dissipates the error of a large step of a stiff rod. Energy then grows until
//! Newton's method fails, or finds a root of the equations that is not the motion. Dissipative schemes may find such
//! roots too, each at another energy; explicit schemes grow where the rod stiffens beyond their stability limit. A step
//! whose energy rises by more than [`MAX_GAIN_PER_STEP`] of the largest kinetic energy is rejected; so is a run that
//! gains more than [`MAX_GAIN`]. Gains of a run count from its start, or from the lowest energy so far with damping or
//! a dissipative parameter. Valid runs gain far less: in 250 random scenes with beta from 0.51 to 1 a step gained less
//! than 0.005 of the largest kinetic energy, or 0.01 to 1000 of it with a wrong motion.
//!
//! The work of loads in time, of loads without a potential, of actuators and of moved obstacles is subtracted from the
//! energy. The sum of its absolute values is added to the kinetic energy as a scale. Generalised-alpha takes loads of a
//! later interval, whose additional work is allowed. The average vector field conserves energy where its quadrature is
//! exact. Without damping, user-defined energies and tables its limits are much smaller, and hold for losses too.
//!
//! The sum of all energies is skipped for at most `INTERVAL` steps in succession (`EXPLICIT_INTERVAL` for explicit
//! schemes, none for the smaller limits); the limit per step holds for each step since the last sum. It is not skipped
//! after a rise of the kinetic energy, nor after many Newton iterations where energy must fall.
//!
//! Rotations: moving supports and flowing fluids do work, so that energy is not limited. There an edge may turn by at
//! most 45 degrees in a step. [`StepControl::without_limits`] makes a control with this limit only. Obstacles: contact
//! forces act at the ends of steps, so that a large step may lead the rod through an obstacle without an overlap. Such
//! a step is always rejected ([`swept_edge`](crate::energy::swept_edge)).
//!
//! Errors are [`Error::EnergyGrowth`], for rotations [`Error::Leap`], for obstacles [`Error::PassedObstacle`], and
//! [`Error::NotFinite`] for a user-defined energy.

use crate::dynamics::energy_balance::is_dissipative;
use crate::dynamics::simulation::Simulation;
use crate::error::Error;
use crate::rod::Rod;
use crate::scene::scheme::EnergyConservation;
use crate::scene::{Scene, Scheme};

/// How often a step is halved before the run ends: the smallest step is 1/64 of the scene's.
pub(crate) const HALVINGS: u32 = 6;
/// Largest number of steps between two sums of all energies. In between they are summed only after a rise of the
/// kinetic energy above the limit of a step, or a step with many iterations. A wrong root shows in the motion first, or
/// takes many iterations.
const INTERVAL: usize = 16;
/// The same for explicit schemes, whose steps are small.
const EXPLICIT_INTERVAL: usize = 32;
/// Newton iterations up to which a step was easy to solve, where the energy must fall. At beta = 1/2 the energy of limp
/// rods in large steps oscillates by a hundredth for long without growing; halving such steps would make the motion
/// discontinuous in parameters.
const EASY: usize = 5;
/// Relative accuracy of coordinates: rounding errors of a few operations.
const COORDINATES: f64 = 8.0 * f64::EPSILON;
/// Largest gain of energy in a step, over the largest kinetic energy: twice that of valid steps (see above).
const MAX_GAIN_PER_STEP: f64 = 0.01;
/// Largest gain of energy of a run, over the largest kinetic energy; with more the motion is wrong.
const MAX_GAIN: f64 = 0.1;
/// Change of energy over the other energies that counts as rounding: a rod at rest has no kinetic energy as a scale.
const ROUNDING: f64 = 1e-8;
/// Largest change of energy in a step of a scheme that conserves energy exactly, over the largest kinetic energy.
/// Larger values accept steps at which the quadrature is not exact; smaller ones halve more steps.
const EXACT_PER_STEP: f64 = 1e-10;
/// The same in a step that is not halved again.
const EXACT_AT_LAST: f64 = 1e-8;
/// The same in a whole run.
const EXACT_IN_ALL: f64 = 1e-6;
/// Change of energy over the other energies that counts as rounding in such a scheme.
const EXACT_ROUNDING: f64 = 1e-13;

/// Limits of the change of the energy by a scheme, as fractions of the largest kinetic energy.
#[derive(Clone, Copy, Debug)]
struct Limits {
    /// Largest change in a step; a step with a larger one is bisected.
    per_step: f64,
    /// The same in a step that is not halved again; a larger change ends the run.
    at_last: f64,
    /// Largest change since the reference energy of a run.
    in_all: f64,
    /// Whether losses count like gains.
    losses: bool,
    /// Whether the energy can only fall, so that the lowest energy so far is the reference energy of a run; else it is
    /// that of the start.
    falls: bool,
    /// Largest number of successive steps without a sum of all energies.
    interval: usize,
    /// Change over the sum of the other energies that is allowed in addition, as a rounding error: a rod at rest has no
    /// kinetic energy as a scale.
    rounding: f64,
    /// The remedy in the error message.
    remedy: &'static str,
}

impl Limits {
    /// The limits for the scheme of a scene. A scheme that conserves energy exactly, without damping and user-defined
    /// energies, has the `EXACT_` ones, for gains and losses, after every step. All others have those for gains only.
    /// `falls` holds for damped scenes and dissipative parameters, whose lowest energy so far is the reference. `None`
    /// without `[time]`, and where moving supports or a flow do work.
    fn of(scene: &Scene) -> Option<Self> {
        let time = scene.time.as_ref()?;
        if scene.supports.move_ends() || scene.loads.have_flow() {
            return None;
        }
        let damped = scene.is_dissipative();
        let traits = time.scheme.traits();
        // The quadrature of an exact scheme is not exact for user-defined energies and for tables of the bending
        // moment.
        let exactly = traits.energy == EnergyConservation::Exact
            && !scene.has_own_energies()
            && !scene.material.has_bending_table();
        if exactly && !damped {
            return Some(Self {
                per_step: EXACT_PER_STEP,
                at_last: EXACT_AT_LAST,
                in_all: EXACT_IN_ALL,
                losses: true,
                falls: false,
                interval: 0,
                rounding: EXACT_ROUNDING,
                remedy: SMALLER,
            });
        }
        // All other schemes have an error in the energy: only gains are limited.
        let dissipates = is_dissipative(time);
        let explicit = traits.stability_limit.is_some();
        let supports_exact_scheme = scene.is_supported_by(Scheme::AverageVectorField);
        Some(Self {
            per_step: MAX_GAIN_PER_STEP,
            at_last: MAX_GAIN_PER_STEP,
            in_all: MAX_GAIN,
            losses: false,
            falls: damped || dissipates,
            interval: if explicit { EXPLICIT_INTERVAL } else { INTERVAL },
            rounding: ROUNDING,
            remedy: match traits.energy {
                _ if !scene.contacts.is_empty() && time.scheme.takes_beta() && !dissipates => {
                    SOFTER_CONTACT_OR_DISSIPATION
                }
                _ if !scene.contacts.is_empty() => SOFTER_CONTACT,
                EnergyConservation::Inexact
                    if time.scheme == Scheme::GeneralisedAlpha && time.rho_inf > 0.0 =>
                {
                    SMALLER_OR_SMALLER_RHO[usize::from(supports_exact_scheme)]
                }
                EnergyConservation::Inexact if dissipates && time.scheme.takes_beta() => {
                    SMALLER_OR_LARGER_BETA[usize::from(supports_exact_scheme)]
                }
                EnergyConservation::Inexact if time.scheme.takes_beta() => {
                    SMALLER_OR_DISSIPATION[usize::from(supports_exact_scheme)]
                }
                EnergyConservation::Inexact if supports_exact_scheme => SMALLER_OR_KEEPING,
                EnergyConservation::Inexact => SMALLER,
                EnergyConservation::Exact | EnergyConservation::OnAverage => SMALLER,
            },
        })
    }
}

/// Remedy of growing energy that every scheme has.
const SMALLER: &str = "take a smaller time.step";
/// For scenes where a scheme that keeps energy helps.
const SMALLER_OR_KEEPING: &str = "take a smaller time.step, or scheme = \"average-vector-field\"";
/// For scenes with contacts.
const SOFTER_CONTACT: &str = "take a smaller time.step or a smaller stiffness of the contacts, whose \
     forces begin and end within a step";
/// For scenes with contacts and Newmark-beta without dissipation.
const SOFTER_CONTACT_OR_DISSIPATION: &str = "take a smaller time.step, a beta above 0.5, or a smaller \
     stiffness of the contacts, whose forces begin and end within a step";
/// For Newmark-beta without dissipation; the second one for scenes that `average-vector-field` supports.
const SMALLER_OR_DISSIPATION: [&str; 2] = [
    "take a smaller time.step, or a beta above 0.5",
    "take a smaller time.step, a beta above 0.5, or scheme = \"average-vector-field\"",
];
/// For generalised-alpha, as above.
const SMALLER_OR_SMALLER_RHO: [&str; 2] = [
    "take a smaller time.step, or a smaller rho_inf",
    "take a smaller time.step, a smaller rho_inf, or scheme = \"average-vector-field\"",
];
/// For Newmark-beta with dissipation, as above.
const SMALLER_OR_LARGER_BETA: [&str; 2] = [
    "take a smaller time.step, or a larger beta",
    "take a smaller time.step, a larger beta, or scheme = \"average-vector-field\"",
];

/// The energy of a run so far, by which its steps are accepted or rejected.
#[derive(Clone, Debug)]
pub(crate) struct StepControl {
    limits: Option<Limits>,
    /// The reference energy of gains, J: at the start, or the lowest so far.
    start: f64,
    /// Energy of a rod at rest by rounding errors of its coordinates, J.
    still: f64,
    /// Total energy when all energies were last summed, J.
    last: f64,
    /// Total energy after the checked step, J; `None` if it was not summed.
    now: Option<f64>,
    /// Largest kinetic energy of accepted states, J.
    kinetic: f64,
    /// Kinetic energy after the checked step, J.
    kinetic_now: f64,
    /// Kinetic energy after the last accepted step, J.
    kinetic_last: f64,
    /// Accepted steps since all energies were last summed.
    unseen: usize,
    /// Newton iterations before the step that is checked.
    iterations: usize,
}

impl StepControl {
    /// The control of a run of the scene, at the initial state of the simulation: its energy is the reference of gains.
    /// Rounding errors of coordinates in the smallest step give the energy that counts as zero. No energy is computed
    /// for scenes without limits.
    pub fn new<R: Rod<f64>>(scene: &Scene, simulation: &Simulation<f64, R>) -> Self {
        Self::within(Limits::of(scene), scene, simulation)
    }

    /// The control of a run of the scene without limits of the energy, where supports do work that the scene does not
    /// show: only rotations of edges are limited.
    pub fn without_limits<R: Rod<f64>>(scene: &Scene, simulation: &Simulation<f64, R>) -> Self {
        Self::within(None, scene, simulation)
    }

    /// The control with these limits, from the energies of `simulation` at the start of a run, as [`new`](Self::new).
    /// Without limits of the energy only rotations of edges are limited.
    fn within<R: Rod<f64>>(
        limits: Option<Limits>,
        scene: &Scene,
        simulation: &Simulation<f64, R>,
    ) -> Self {
        let (start, kinetic, still) = match limits {
            Some(_) => {
                let energies = simulation.energies();
                let shortest = scene.time.as_ref().map_or(f64::INFINITY, |time| time.step_size())
                    / f64::from(1 << HALVINGS);
                let still = simulation.energy_of_motion_by(COORDINATES, shortest);
                (energies.total(), energies.kinetic, still)
            }
            None => (0.0, 0.0, 0.0),
        };
        Self {
            limits,
            start,
            still,
            last: start,
            now: None,
            kinetic,
            kinetic_now: kinetic,
            kinetic_last: kinetic,
            unseen: 0,
            iterations: 0,
        }
    }

    /// Rejects the step that `simulation` has just made if the total energy changed beyond the limits of the scheme,
    /// per step or since the reference ([`Error::EnergyGrowth`]). A sum that is not finite by a user-defined energy is
    /// [`Error::NotFinite`]. Without limits it is rejected if an edge turned by more than 45 degrees ([`Error::Leap`]).
    /// With and without limits it is rejected if an edge passed through an obstacle ([`Error::PassedObstacle`]).
    /// The sum of all energies is skipped without a rise of the kinetic energy above the limit of a step, at most
    /// `interval` times in succession. Where energy must fall, the step must also have taken at most [`EASY`]
    /// iterations. `at_last`: the step will not be halved again, so that the wider limit holds.
    pub fn check<R: Rod<f64>>(
        &mut self,
        simulation: &Simulation<f64, R>,
        at_last: bool,
    ) -> Result<(), Error> {
        // Nothing of a refused step may stay.
        self.now = None;
        not_passed(simulation)?;
        let Some(limits) = self.limits else { return not_leapt(simulation) };
        self.kinetic_now = simulation.kinetic_energy();
        // Work of loads in time is a scale of the error as well: slow loads hardly move the rod.
        let exchanged = simulation.state().exchanged;
        let kinetic = self.kinetic.max(self.kinetic_now) + exchanged.work;
        let rise = self.kinetic_now - self.kinetic_last;
        let iterations = simulation.work().newton_iterations;
        // The kinetic energy is inexpensive. A wrong root shows in its rise, or takes many
        // iterations.
        let easy = !limits.falls || iterations - self.iterations <= EASY;
        self.iterations = iterations;
        if easy && rise <= limits.per_step * kinetic && self.unseen < limits.interval {
            return Ok(());
        }
        let e = simulation.energies();
        let now = e.total();
        if !now.is_finite()
            && let Some(error) = simulation.non_finite_energy(simulation.state().time)
        {
            return Err(error);
        }
        // The largest kinetic energy is no scale for a rod at rest: rounding errors of the other
        // energies are allowed in addition.
        let floor = limits.rounding
            * (e.stretch + e.bend + e.twist + e.potential.abs() + e.own.abs())
            + self.still
            + exchanged.lead
            + simulation.follower_work_error(COORDINATES);
        // Steps without a sum share this one: each may have gained the limit.
        let steps = (self.unseen + 1) as f64;
        let change = |from: f64| if limits.losses { (now - from).abs() } else { now - from };
        let per_step = if at_last { limits.at_last } else { limits.per_step };
        // NaN fails both comparisons.
        let sound = change(self.last) <= per_step * steps * kinetic + floor
            && change(self.start) <= limits.in_all * kinetic + floor;
        if !sound {
            let change = change(self.last).max(change(self.start));
            return Err(Error::EnergyGrowth {
                time: simulation.state().time,
                change,
                fraction: change / kinetic,
                remedy: limits.remedy,
            });
        }
        self.now = Some(now);
        Ok(())
    }

    /// Accepts the checked step. If its total energy was summed, that energy is the reference of the next check. Where
    /// energy must fall, it also becomes the reference of the run if it is lower. The largest kinetic energy is
    /// updated.
    pub fn accept(&mut self) {
        match self.now {
            Some(now) => {
                (self.last, self.unseen) = (now, 0);
                if self.limits.is_some_and(|limits| limits.falls) {
                    self.start = self.start.min(now);
                }
            }
            None => self.unseen += 1,
        }
        self.kinetic_last = self.kinetic_now;
        // That of a refused step must not raise the allowance.
        self.kinetic = self.kinetic.max(self.kinetic_now);
    }
}

/// The check where supports or a fluid do work, so that a wrong root does not show in the energy. It rejects the step
/// `simulation` has just made if an edge turned by more than 45 degrees ([`Error::Leap`]).
fn not_leapt<R: Rod<f64>>(simulation: &Simulation<f64, R>) -> Result<(), Error> {
    let (before, now) = (simulation.previous(), simulation.state());
    match simulation.rod().over_rotated_edge(&before.q, &now.q, &before.frames) {
        Some(edge) => Err(Error::Leap { time: now.time, edge }),
        None => Ok(()),
    }
}

/// Rejects the step `simulation` has just made if an edge passed through an obstacle ([`Error::PassedObstacle`])
/// or another rod ([`Error::PassedRod`]).
fn not_passed<R: Rod<f64>>(simulation: &Simulation<f64, R>) -> Result<(), Error> {
    let (before, now) = (simulation.previous(), simulation.state());
    match simulation.rod().passed_obstacle(&before.q, &now.q, &before.frames) {
        Some(contact) => Err(Error::PassedObstacle { time: now.time, contact }),
        None => match simulation.rod().passed_rod(&before.q, &now.q, &before.frames) {
            Some(contact) => Err(Error::PassedRod { time: now.time, contact }),
            None => Ok(()),
        },
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Drag, Material, Scheme, Section, Shape, Time};

    /// No scheme is advised to take itself or one that rejects the scene, nor one above beta = 0.5 to go there.
    #[test]
    fn remedies_are_others() {
        let shape = Shape::Straight { length: 1.0, direction: [1.0, 0.0, 0.0] };
        let mut scene =
            Scene::new(4, shape, Section::Circle { radius: 0.01 }, Material::new(1e3, 1e9));
        for scheme in Scheme::all() {
            for (beta, damping) in [(0.5, 0.0), (0.75, 0.0), (0.5, 1e-3)] {
                scene.time = Some(Time { scheme, beta, ..Time::new(1.0, 1e-3) });
                scene.loads.damping.mass = damping;
                let remedy = Limits::of(&scene).expect("every scheme is watched").remedy;
                assert!(!remedy.contains(scheme.name()), "{scheme:?}: {remedy}");
                assert!(remedy.contains("smaller time.step"));
                assert!(beta == 0.5 || !remedy.contains("above 0.5"), "{remedy}");
            }
        }
        // A rho_inf of zero cannot become smaller.
        scene.time =
            Some(Time { scheme: Scheme::GeneralisedAlpha, rho_inf: 0.0, ..Time::new(1.0, 1e-3) });
        let remedy = Limits::of(&scene).expect("every scheme is watched").remedy;
        assert!(!remedy.contains("rho_inf") && !remedy.contains("beta"), "{remedy}");
        // That scheme has no drag.
        scene.loads.drag = Some(Drag::default());
        for scheme in [Scheme::NewmarkBeta, Scheme::GeneralisedAlpha] {
            scene.time = Some(Time { scheme, ..Time::new(1.0, 1e-3) });
            let remedy = Limits::of(&scene).expect("every scheme is watched").remedy;
            assert!(!remedy.contains("average-vector-field"), "{scheme:?}: {remedy}");
        }
    }
}
