//! Steps that went wrong: seen, and taken again in halves.
//!
//! At beta = 1/2 nothing dissipates what a large step gets wrong about a stiff rod: energy grows
//! until Newton's method fails, or finds a root of the step's equations that is not the motion.
//! Explicit schemes grow where the rod stiffens beyond their step. Dead loads do no net work, so a
//! rod's total energy can only fall, unless moving supports do work: growth is always an error.
//!
//! The average vector field keeps the energy where its quadrature is exact. A large step in which
//! the rod whips about may be beyond that, and has many roots; it shows in the energy at once.

use crate::error::Error;
use crate::rod::Rod;
use crate::scene::{Scene, Scheme};
use crate::simulation::Simulation;

/// How often a step is halved before the run ends.
pub(crate) const HALVINGS: u32 = 6;
/// All energies are summed after so many steps at the latest. Before, only where the kinetic
/// energy rises by more than a step may add: a wrong root shows as motion first.
const INTERVAL: usize = 16;
/// The same for the small steps of explicit schemes.
const EXPLICIT_INTERVAL: usize = 32;
/// Above this beta the scheme dissipates, and needs no watching.
const DISSIPATES: f64 = 0.505;

/// What a scheme may do to the energy, as parts of the largest kinetic energy.
#[derive(Clone, Copy, Debug)]
struct Limits {
    /// A step that adds more is taken in halves.
    per_step: f64,
    /// A run that has gained more has lost the motion.
    in_all: f64,
    /// Whether losses count like gains.
    losses: bool,
    interval: usize,
    /// Changes of this part of the other energies are taken for rounding errors: a rod at rest has
    /// nothing else to compare.
    rounding: f64,
}

impl Limits {
    /// Those of the scene's scheme; none for one that dissipates.
    fn of(scene: &Scene) -> Option<Self> {
        let time = scene.time.as_ref()?;
        if !scene.supports.motion.is_empty() {
            return None;
        }
        let grows = |interval| Self {
            per_step: 0.01,
            in_all: 0.1,
            losses: false,
            interval,
            rounding: 1e-8,
        };
        let damping = scene.loads.damping;
        match time.scheme {
            Scheme::NewmarkBeta if time.beta < DISSIPATES => Some(grows(INTERVAL)),
            Scheme::NewmarkBeta => None,
            Scheme::AverageVectorField if damping.mass > 0.0 || damping.stiffness > 0.0 => {
                Some(grows(INTERVAL))
            }
            Scheme::AverageVectorField => Some(Self {
                per_step: 1e-10,
                in_all: 1e-6,
                losses: true,
                interval: 0,
                rounding: 1e-13,
            }),
            Scheme::Verlet | Scheme::Pefrl => Some(grows(EXPLICIT_INTERVAL)),
            Scheme::Rodas4 => Some(grows(INTERVAL)),
        }
    }
}

/// Watches the energy of a run.
#[derive(Clone, Debug)]
pub(crate) struct Guard {
    limits: Option<Limits>,
    start: f64,
    /// Total energy when all energies were last summed, J.
    last: f64,
    /// The same of the step that waits to be taken; none if it was not summed.
    now: Option<f64>,
    kinetic: f64,
    kinetic_now: f64,
    kinetic_last: f64,
    /// Steps taken since the energies were summed.
    unseen: usize,
}

impl Guard {
    /// A guard at the start of a run.
    pub fn new<R: Rod<f64, W>, const W: usize>(
        scene: &Scene,
        simulation: &Simulation<f64, R, W>,
    ) -> Self {
        let limits = Limits::of(scene);
        let (start, kinetic) = match limits {
            Some(_) => (simulation.energies().total(), simulation.energies().kinetic),
            None => (0.0, 0.0),
        };
        Self {
            limits,
            start,
            last: start,
            now: None,
            kinetic,
            kinetic_now: kinetic,
            kinetic_last: kinetic,
            unseen: 0,
        }
    }

    /// Refuses the step `simulation` has just made if it gained energy it cannot have.
    pub fn check<R: Rod<f64, W>, const W: usize>(
        &mut self,
        simulation: &Simulation<f64, R, W>,
    ) -> Result<(), Error> {
        // Nothing of a refused step may stay.
        self.now = None;
        let Some(limits) = self.limits else { return Ok(()) };
        self.kinetic_now = simulation.kinetic_energy();
        let kinetic = self.kinetic.max(self.kinetic_now);
        let rise = self.kinetic_now - self.kinetic_last;
        if rise <= limits.per_step * kinetic && self.unseen < limits.interval {
            return Ok(());
        }
        let e = simulation.energies();
        let now = e.total();
        let floor = limits.rounding * (e.stretch + e.bend + e.twist + e.potential.abs());
        let steps = (self.unseen + 1) as f64;
        let change = |from: f64| if limits.losses { (now - from).abs() } else { now - from };
        if change(self.last) > limits.per_step * steps * kinetic + floor
            || change(self.start) > limits.in_all * kinetic + floor
        {
            return Err(Error::EnergyGrowth {
                time: simulation.state().time,
                part: change(self.last).max(change(self.start)) / kinetic,
            });
        }
        self.now = Some(now);
        Ok(())
    }

    /// Takes the checked step for good.
    pub fn accept(&mut self) {
        match self.now {
            Some(now) => (self.last, self.unseen) = (now, 0),
            None => self.unseen += 1,
        }
        self.kinetic_last = self.kinetic_now;
        // That of a refused step must not raise the allowance.
        self.kinetic = self.kinetic.max(self.kinetic_now);
    }
}
