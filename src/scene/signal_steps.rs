//! Time steps and warnings of a scene by the motions of its supports and obstacles and the signals of its loads and
//! actuators.
//!
//! A step is compared with ramps, periods and recordings of supports and obstacles, periods of sine signals and the
//! bandwidth of samples. Pulses count if their load follows the rod or has a moment, or if they control an actuator.
//! Only signals that a load or an actuator names count (`used_signals`).
//!
//! `check_step` rejects a step, s, that does not resolve these motions, and `motion_step_warnings` warns of one that
//! resolves them poorly, by the limits of the module `motion_rate`. `largest_good_step` is the largest one, s, without
//! a warning; recordings in `supports.path` and of structures are left out there.

use crate::code::Code;
use crate::error::Error;
use crate::scene::motion_rate::MotionRate;
use crate::scene::signal::Signal;
use crate::scene::{Actuation, Scene};

impl Scene {
    /// The signals that at least one load or actuator names, in the order of the scene.
    pub(crate) fn used_signals(&self) -> impl Iterator<Item = &Signal> {
        let point = self.loads.point.iter().map(|load| &load.signal);
        let names: Vec<&str> = point
            .chain(self.loads.line.iter().map(|load| &load.signal))
            .flatten()
            .map(|name| &**name)
            .chain(self.actuation.iter().filter_map(Actuation::signal))
            .collect();
        self.signals.iter().filter(move |signal| names.contains(&&*signal.name))
    }

    /// Rates of the used signals with which time steps are compared: first sines and samples, then pulses of follower
    /// loads, loads with a moment and actuators. These have the value of their signal at a time of each step, not its
    /// mean, so that a step may miss a short pulse.
    fn signal_rates(&self) -> impl Iterator<Item = MotionRate> {
        let loads = &self.loads;
        let moving = loads.point.iter().filter(|load| load.follower || load.moment != [0.0; 3]);
        let moving_lines = loads.line.iter().filter(|load| load.follower);
        let names: Vec<&str> = moving
            .filter_map(|load| load.signal.as_deref())
            .chain(moving_lines.filter_map(|load| load.signal.as_deref()))
            .chain(self.actuation.iter().filter_map(Actuation::signal))
            .collect();
        let sampled = self.signals.iter().filter(move |signal| names.contains(&&*signal.name));
        let rates = self.used_signals().filter_map(Signal::motion_rate);
        rates.chain(sampled.filter_map(Signal::pulse_rate))
    }

    /// Rates of the motions of obstacles, in the order of the contacts; of a structure, those of its contacts.
    fn obstacle_rates(&self) -> impl Iterator<Item = MotionRate> {
        // A scene that represents a structure has no contacts of its own.
        let structure =
            self.structure.iter().flat_map(|structure| structure.contacts.iter().enumerate());
        self.contacts.iter().enumerate().chain(structure).flat_map(|(i, contact)| {
            let motions = contact.motions().iter().enumerate();
            motions.flat_map(move |(k, motion)| {
                motion.support_motion().rates(&format!("contacts[{i}].motion[{k}]"))
            })
        })
    }

    /// Rejects a time step, s, that makes too few steps in a period, ramp or pulse of the motion of a support, an
    /// obstacle or a used signal (`MotionRate::check`); the first error is returned.
    pub(crate) fn check_step(&self, step: f64) -> Result<(), Error> {
        self.supports.check_step(step)?;
        let mut rates = self.obstacle_rates().chain(self.signal_rates());
        rates.try_for_each(|rate| rate.check(step))
    }

    /// Warnings, with codes, of a time step, s, that resolves motions of supports, obstacles and used signals poorly
    /// (`MotionRate::warning`); one for each such motion.
    pub(crate) fn motion_step_warnings(&self, step: f64) -> Vec<(Code, String)> {
        let mut warnings = self.supports.step_warnings(step);
        let rates = self.obstacle_rates().chain(self.signal_rates());
        warnings.extend(rates.filter_map(|rate| rate.warning(step)));
        warnings
    }

    /// Largest time step, s, for which [`motion_step_warnings`](Self::motion_step_warnings) has no warning of
    /// `supports.motion`, obstacles and the used signals; infinity without any. Recordings in `supports.path` and of
    /// structures are left out.
    pub(crate) fn largest_good_step(&self) -> f64 {
        let rates = self.obstacle_rates().chain(self.signal_rates());
        rates.map(|rate| rate.good_step()).fold(self.supports.largest_good_step(), f64::min)
    }

    /// Warnings, with codes, of defects in the recordings that move supports and obstacles, then of missing samples of
    /// used signals.
    pub(crate) fn recording_warnings(&self) -> Vec<(Code, String)> {
        let mut warnings = self.supports.recording_warnings();
        warnings.extend(self.obstacle_recording_warnings());
        warnings.extend(self.used_signals().flat_map(Signal::warnings));
        warnings
    }
}
