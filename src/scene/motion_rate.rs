//! Time steps that resolve the prescribed motions of the supports and other time-dependent inputs: errors and warnings
//! for larger ones.
//!
//! A `MotionRate` has the duration `T` of a motion, s, and a fraction `f`. T and f are the period and 1 of an
//! oscillation, the ramp or pulse and 1/2, or the inverse of the bandwidth and 1/2 of a recording. For `n` steps per
//! period the largest step is `T/(f n)`. A step larger than that for `FEWEST_STEPS` is rejected, one larger than that
//! for `GOOD_STEPS` has a warning; rounding errors are tolerated.
//!
//! Motions of the supports are those of `supports.motion` and `supports.path`. A motion of size zero, one without ramp,
//! frequency and bandwidth, and a recording at rest allow every step. The largest good step of all supports does not
//! include `supports.path`. Signals use the same type.

use crate::code::Code;
use crate::error::Error;
use crate::scene::prescribed_motion::Motion;
use crate::scene::supports::Supports;

/// Smallest number of time steps per period of an oscillating support, and half as many per ramp. At two steps a period
/// every step ends where the support is at rest. With four, the tip of a shaken cantilever was off by 40 to 80 % of its
/// largest displacement; with two steps a ramp by 7 to 33 %.
const FEWEST_STEPS: f64 = 4.0;
/// Time steps per period below which a warning is given. With 20 a period the same tip was off by 8 to 19 %, most of it
/// by the sudden start; with 10 a ramp by 2 to 9 %.
const GOOD_STEPS: f64 = 20.0;
/// Tolerance of a step size, as a fraction of the largest allowed one, for rounding errors.
const ROUNDING: f64 = 1e-9;

/// Time scale of a prescribed motion or signal, and the steps that resolve it.
pub(super) struct MotionRate {
    /// Key in the scene file.
    key: String,
    /// The value of the key with its unit, for messages.
    found: String,
    /// Duration of a period or ramp, s.
    time: f64,
    /// Name of that duration: `period`, `ramp` or `pulse`.
    interval: &'static str,
    /// Steps that the duration requires, as a fraction of those that a period of an oscillation requires: 1 or 1/2.
    fraction: f64,
}

impl MotionRate {
    /// Largest step size, s, of the motion, `time/(fraction per_period)`, where an oscillation requires `per_period`
    /// steps per period.
    fn step(&self, per_period: f64) -> f64 {
        self.time / (self.fraction * per_period)
    }

    /// Two texts for messages if a `step`, s, is larger than that for `per_period` steps per period by more than
    /// rounding. The first has the value of the key, the step and its steps per interval, the second the required ones.
    /// None for a smaller step.
    fn too_large(&self, step: f64, per_period: f64) -> Option<[String; 2]> {
        let Self { found, interval, fraction, .. } = self;
        let largest = self.step(per_period);
        // A step that divides the duration evenly may exceed the largest one by rounding.
        (step > largest * (1.0 + ROUNDING)).then(|| {
            let steps = fraction * per_period;
            let taken = steps * largest / step;
            [
                format!("{found} with time.step = {step} s, {taken:.2} steps per {interval}"),
                format!("{steps} steps per {interval}, a time.step of {largest:.3e} s"),
            ]
        })
    }

    /// Rate of a recorded motion with the period `1/bandwidth`, of a `bandwidth` in Hz, below which 99 % of its
    /// variance lie. It requires half as many steps per period as an oscillation, since most of the motion is slower;
    /// two steps per period are those of the sampling theorem. `key` is the key in the scene and `name` the name of the
    /// motion, for messages.
    pub(super) fn from_bandwidth(key: String, name: &str, bandwidth: f64) -> Self {
        let found = format!("{name} of up to {bandwidth:.3} Hz (99 % of its variance)");
        Self { key, found, time: bandwidth.recip(), interval: "period", fraction: 0.5 }
    }

    /// Rate of an oscillation with a `frequency`, Hz, and thus the period `1/frequency`. `key` is its key, for
    /// messages.
    pub(super) fn of_frequency(key: String, frequency: f64) -> Self {
        let (found, time) = (format!("{frequency} Hz"), frequency.recip());
        Self { key, found, time, interval: "period", fraction: 1.0 }
    }

    /// Rate of a ramp or pulse with a `duration`, s, which requires half as many steps as a period. `interval` is its
    /// name and `key` its key, for messages.
    pub(super) fn of_interval(key: String, interval: &'static str, duration: f64) -> Self {
        let found = format!("{duration} s as the duration of a {interval}");
        Self { key, found, time: duration, interval, fraction: 0.5 }
    }

    /// Largest step size, s, that makes [`GOOD_STEPS`] per period, or half as many per ramp, pulse or recorded period.
    pub(super) fn good_step(&self) -> f64 {
        self.step(GOOD_STEPS)
    }

    /// Rejects a time step, s, that makes fewer than [`FEWEST_STEPS`] per period, or half as many per ramp, pulse or
    /// recorded period. The error has the key of the motion, and a step that resolves it well.
    pub(super) fn check(self, step: f64) -> Result<(), Error> {
        let Some([found, needed]) = self.too_large(step, FEWEST_STEPS) else { return Ok(()) };
        // The message advises a step without a warning, not the largest accepted one.
        let good = self.step(GOOD_STEPS);
        let allowed =
            format!("at least {needed}. A time.step of {good:.3e} s resolves the motion well");
        Err(Error::invalid(self.key, found, allowed))
    }

    /// The warning, with its code, of a time step, s, that makes fewer than [`GOOD_STEPS`] per period, or half as many
    /// per ramp, pulse or recorded period; `None` for smaller steps.
    pub(super) fn warning(&self, step: f64) -> Option<(Code, String)> {
        let [found, needed] = self.too_large(step, GOOD_STEPS)?;
        let key = &self.key;
        let message = format!(
            "{key}: found {found}. The time steps do not resolve the motion, and the result \
                             is inaccurate. Use {needed}"
        );
        Some((Code::StepTooLarge, message))
    }
}

impl Motion {
    /// Rate of the ramp of the motion, or without a ramp of its oscillation; `key` is the path of the motion. None if
    /// displacement, rotation and twist are all zero, or without ramp and frequency.
    fn rate(&self, key: &str) -> Option<MotionRate> {
        let moves = self.displacement != [0.0; 3] || self.rotation != [0.0; 3] || self.twist != 0.0;
        let (name, value, unit) = match (self.ramp, self.frequency) {
            (Some(value), _) => ("ramp", value, "s"),
            (None, Some(value)) => ("frequency", value, "Hz"),
            (None, None) => return None,
        };
        // A ramp leads from rest to rest, as half a period does.
        let (time, interval, fraction) = match name {
            "ramp" => (value, "ramp", 0.5),
            _ => (value.recip(), "period", 1.0),
        };
        let (key, found) = (format!("{key}.{name}"), format!("{value} {unit}"));
        moves.then_some(MotionRate { key, found, time, interval, fraction })
    }

    /// Rates of the ramp or oscillation of the motion, then of its recording if that has a bandwidth. `key` is the path
    /// of the motion.
    pub(super) fn rates(&self, key: &str) -> impl Iterator<Item = MotionRate> + use<> {
        let bandwidth = self.track.as_ref().and_then(|track| track.bandwidth());
        let recorded = bandwidth.map(|hertz| {
            MotionRate::from_bandwidth(format!("{key}.file"), "recorded motion", hertz)
        });
        self.rate(key).into_iter().chain(recorded)
    }
}

impl Supports {
    /// Rejects a time step, s, that makes fewer than [`FEWEST_STEPS`] per period of an oscillation of a support. Ramps
    /// and periods of recordings require half as many. The error has the key of the motion, and a step that resolves it
    /// well.
    pub(crate) fn check_step(&self, step: f64) -> Result<(), Error> {
        self.rates().chain(self.path_rate()).try_for_each(|rate| rate.check(step))
    }

    /// Warnings, with codes, of a time step, s, that makes fewer than [`GOOD_STEPS`] per period of an oscillation of a
    /// support. Ramps and periods of recordings require half as many. There is one warning for each such motion.
    pub(crate) fn step_warnings(&self, step: f64) -> Vec<(Code, String)> {
        self.rates().chain(self.path_rate()).filter_map(|rate| rate.warning(step)).collect()
    }

    /// Smallest of the step sizes, s, that make [`GOOD_STEPS`] per period (half as many per ramp or recorded period) of
    /// the motions in `supports.motion`. Infinite without any. The recording in `supports.path` is left out: its steps
    /// follow from the frames of the recording.
    pub(crate) fn largest_good_step(&self) -> f64 {
        self.rates().map(|rate| rate.step(GOOD_STEPS)).fold(f64::INFINITY, f64::min)
    }

    /// Rates of the entries of `supports.motion` in order: of each its ramp or oscillation, then its recording if that
    /// has a bandwidth.
    fn rates(&self) -> impl Iterator<Item = MotionRate> {
        let motions = self.motion.iter().enumerate();
        motions.flat_map(|(i, motion)| motion.rates(&format!("supports.motion[{i}]")))
    }

    /// Rate of the recording `supports.path`, with its bandwidth. None without a recording that was read and examined,
    /// and for one at rest.
    fn path_rate(&self) -> Option<MotionRate> {
        let bandwidth = self.path.as_ref()?.track.as_ref()?.bandwidth()?;
        Some(MotionRate::from_bandwidth("supports.path.file".into(), "recorded motion", bandwidth))
    }
}
