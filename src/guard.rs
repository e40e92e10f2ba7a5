//! Steps that went wrong: seen, and taken again in halves.
//!
//! At beta = 1/2 nothing dissipates what a large step gets wrong about a stiff rod: energy grows
//! until Newton's method fails, or finds a root of the step's equations that is not the motion.
//! Dead loads do no net work, so a rod's total energy can only fall: growth is always an error.

use crate::direct::splitting::stability_limit;
use crate::error::Error;
use crate::rod::Rod;
use crate::scene::{Scene, Scheme};
use crate::simulation::Simulation;

/// How often a step is halved before the run ends.
pub(crate) const HALVINGS: u32 = 6;
/// A step that adds more than this part of the largest kinetic energy is taken in halves.
const PER_STEP: f64 = 0.01;
/// A run that has gained more than this part has lost the motion.
const IN_ALL: f64 = 0.1;
/// All energies are summed after so many steps at the latest. Before, only where the kinetic
/// energy rises by more than a step may add: a wrong root shows as motion first.
const INTERVAL: usize = 16;
/// The same for the small steps of explicit schemes.
const EXPLICIT_INTERVAL: usize = 64;
/// Changes of this part of the energies are taken for rounding errors.
const ROUNDING: f64 = 1e-6;
/// Above this beta the scheme dissipates, and needs no watching.
const DISSIPATES: f64 = 0.505;

/// Watches the energy of a run.
#[derive(Clone, Debug)]
pub(crate) struct Guard {
    watches: bool,
    interval: usize,
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
        let watches = scene.time.as_ref().is_some_and(|time| match time.scheme {
            Scheme::NewmarkBeta => time.beta < DISSIPATES,
            Scheme::AverageVectorField => false,
            Scheme::Verlet | Scheme::Pefrl | Scheme::Rodas4 => true,
        });
        let explicit = stability_limit(scene.scheme()).is_some();
        let (start, kinetic) = match watches {
            true => (simulation.energies().total(), simulation.energies().kinetic),
            false => (0.0, 0.0),
        };
        Self {
            watches,
            interval: if explicit { EXPLICIT_INTERVAL } else { INTERVAL },
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
        if !self.watches {
            return Ok(());
        }
        self.kinetic_now = simulation.kinetic_energy();
        let kinetic = self.kinetic.max(self.kinetic_now);
        if self.kinetic_now - self.kinetic_last <= PER_STEP * kinetic && self.unseen < self.interval
        {
            return Ok(());
        }
        let e = simulation.energies();
        let now = e.total();
        // A rod at rest has nothing but rounding errors to compare.
        let size = e.stretch + e.bend + e.twist + e.potential.abs();
        let kinetic = kinetic.max(ROUNDING * size);
        let steps = (self.unseen + 1) as f64;
        if now - self.last > PER_STEP * steps * kinetic || now - self.start > IN_ALL * kinetic {
            return Err(Error::EnergyGrowth {
                time: simulation.state().time,
                part: (now - self.start) / kinetic,
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
