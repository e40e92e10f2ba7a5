//! Time steps and warnings of a scene by the motion of its supports and the signals of its loads and actuators.
//!
//! A step is compared with ramps, periods and recordings of supports, periods of sine signals and the bandwidth of
//! samples. Only signals that a load or an actuator names count (`used_signals`). `check_step` rejects a step, s, that
//! does not resolve these motions, `motion_step_warnings` returns warnings of poor resolution, `largest_good_step` the
//! largest one, s, that resolves them well, recorded ends left out. `recording_warnings` are those of defects in
//! recordings and samples.

use crate::code::Code;
use crate::error::Error;
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

    /// Rejects a time step, s, that does not resolve the motion of a support or a signal.
    pub(crate) fn check_step(&self, step: f64) -> Result<(), Error> {
        self.supports.check_step(step)?;
        self.used_signals().filter_map(Signal::motion_rate).try_for_each(|rate| rate.check(step))
    }

    /// Warnings, with codes, of a time step, s, that resolves the motion of a support or a signal poorly.
    pub(crate) fn motion_step_warnings(&self, step: f64) -> Vec<(Code, String)> {
        let mut warnings = self.supports.step_warnings(step);
        let rates = self.used_signals().filter_map(Signal::motion_rate);
        warnings.extend(rates.filter_map(|rate| rate.warning(step)));
        warnings
    }

    /// Largest time step, s, that resolves the motions of walls and hinges and all used signals well; infinity without
    /// any. Recorded ends are left out.
    pub(crate) fn largest_good_step(&self) -> f64 {
        let rates = self.used_signals().filter_map(Signal::motion_rate);
        rates.map(|rate| rate.good_step()).fold(self.supports.largest_good_step(), f64::min)
    }

    /// Warnings, with codes, of defects in the recordings that move supports and in the samples of signals.
    pub(crate) fn recording_warnings(&self) -> Vec<(Code, String)> {
        let mut warnings = self.supports.recording_warnings();
        warnings.extend(self.used_signals().flat_map(Signal::warnings));
        warnings
    }
}
