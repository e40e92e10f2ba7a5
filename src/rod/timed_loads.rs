//! Forces on nodes that are constants times signals: loads in time.
//!
//! [`TimedLoads`] has one entry per signal, with the forces (N) on unknowns that it multiplies. It returns forces at a time,
//! their rates (N/s), and their means over an interval, which are exact integrals over its length. These forces have no
//! part in the energy or gradient of the rod; steppers add them to the equations of motion, with the mean over the step.

use crate::numerics::scalar::Scalar;
use crate::scene::SignalCurve;

/// A force on one unknown.
#[derive(Clone, Copy, Debug)]
pub struct UnknownForce<D> {
    /// Index of the unknown.
    pub unknown: usize,
    /// Force, N.
    pub force: D,
}

/// Forces that one signal multiplies.
#[derive(Clone, Debug)]
pub struct TimedLoad<D> {
    /// The signal.
    pub signal: SignalCurve<D>,
    /// The forces at the value 1 of the signal.
    pub forces: Vec<UnknownForce<D>>,
}

/// All forces of a rod that depend on time.
#[derive(Clone, Debug)]
pub struct TimedLoads<D> {
    /// One entry per signal.
    pub loads: Vec<TimedLoad<D>>,
}

impl<D: Scalar> TimedLoads<D> {
    /// No loads.
    pub fn none() -> Self {
        Self { loads: Vec::new() }
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.loads.is_empty()
    }

    /// Overwrites `forces` with the mean forces from the time `from` to `to`, s; an unknown may have several entries.
    pub fn set_mean(&self, from: D, to: D, forces: &mut Vec<UnknownForce<D>>) {
        forces.clear();
        for load in &self.loads {
            load.add(load.signal.mean(from, to), forces);
        }
    }

    /// Overwrites `forces` with those at the time `t`, s.
    pub fn set_at(&self, t: D, forces: &mut Vec<UnknownForce<D>>) {
        forces.clear();
        for load in &self.loads {
            load.add(load.signal.value(t), forces);
        }
    }

    /// Overwrites `forces` with those at the time `t`, s, plus the rates, N/s, at the time `start`, s, times `lead`, s.
    pub fn set_with_rate(
        &self,
        t: f64,
        [start, lead]: [f64; 2],
        forces: &mut Vec<UnknownForce<D>>,
    ) {
        forces.clear();
        for load in &self.loads {
            let rate = load.signal.rate(D::from(start)) * lead;
            load.add(load.signal.value(D::from(t)) + rate, forces);
        }
    }

    /// The work, J, of the mean forces from the time `from` to `to`, s, on the change of the unknowns from `before` to
    /// `now`.
    pub fn work(&self, [from, to]: [f64; 2], [before, now]: [&[D]; 2]) -> f64 {
        let mut work = 0.0;
        for load in &self.loads {
            let mean = load.signal.mean(D::from(from), D::from(to)).value();
            for UnknownForce { unknown, force } in &load.forces {
                work += mean * force.value() * (now[*unknown].value() - before[*unknown].value());
            }
        }
        work
    }
}

impl<D: Scalar> TimedLoad<D> {
    /// Appends the forces times `factor` to `forces`.
    fn add(&self, factor: D, forces: &mut Vec<UnknownForce<D>>) {
        for own in &self.forces {
            forces.push(UnknownForce { unknown: own.unknown, force: own.force * factor });
        }
    }
}
