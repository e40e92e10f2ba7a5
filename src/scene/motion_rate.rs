//! Time steps that resolve the prescribed motions of the supports and other time-dependent inputs: errors and warnings
//! for larger ones.
//!
//! Each ramp, oscillation or recorded motion has a duration, s: the ramp, the period, or the inverse of the bandwidth
//! (`MotionRate`, also used for signals; `of_frequency` and `from_bandwidth` make it from Hz, `of_interval` from s,
//! `good_step` is its largest step that resolves it well). A step must make at least `FEWEST_STEPS` per period of an
//! oscillation, else `check` rejects it; below `GOOD_STEPS` there is a warning for each motion. Ramps and recordings
//! require half as many. Motions of size zero and recordings at rest require none. `check_step` and `step_warnings` of
//! the supports cover `supports.motion` and `supports.path`. `largest_good_step` returns the step, s, with at least
//! `GOOD_STEPS` for all motions of `supports.motion`, infinite without any; `supports.path` is left out.

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

/// Time scale of a prescribed motion, and the fraction of the steps per period that resolves it.
pub(super) struct MotionRate {
    /// Key in the scene file.
    key: String,
    /// The value of the key with its unit, for messages.
    found: String,
    /// Duration of a period or ramp, s.
    time: f64,
    /// Name of that duration: `period`, `ramp` or `pulse`.
    interval: &'static str,
    /// Steps that the duration requires, as a fraction of those per period.
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

    /// Rate of a recorded motion of a bandwidth, Hz, whose period is `1/bandwidth`. Slower components make up 99 % of
    /// its variance, so that half as many steps a period resolve it as those of a single frequency. Two steps a period
    /// are those of the sampling theorem. `name` is that of the motion in messages.
    pub(super) fn from_bandwidth(key: String, name: &str, bandwidth: f64) -> Self {
        let found = format!("{name} of up to {bandwidth:.3} Hz (99 % of its variance)");
        Self { key, found, time: bandwidth.recip(), interval: "period", fraction: 0.5 }
    }

    /// Rate of an oscillation of a `frequency`, Hz.
    pub(super) fn of_frequency(key: String, frequency: f64) -> Self {
        let (found, time) = (format!("{frequency} Hz"), frequency.recip());
        Self { key, found, time, interval: "period", fraction: 1.0 }
    }

    /// Rate of an interval (its name, for messages) of a `duration`, s, within which a value acts.
    pub(super) fn of_interval(key: String, interval: &'static str, duration: f64) -> Self {
        let found = format!("{duration} s as the duration of a {interval}");
        Self { key, found, time: duration, interval, fraction: 0.5 }
    }

    /// Largest step size, s, that makes [`GOOD_STEPS`] per period, or half as many per ramp or recorded period.
    pub(super) fn good_step(&self) -> f64 {
        self.step(GOOD_STEPS)
    }

    /// Rejects a time step, s, that makes fewer than [`FEWEST_STEPS`] per period, or half as many per ramp or recorded
    /// period. The error has the key of the motion, and a step that resolves it well.
    pub(super) fn check(self, step: f64) -> Result<(), Error> {
        let Some([found, needed]) = self.too_large(step, FEWEST_STEPS) else { return Ok(()) };
        // The message advises a step without a warning, not the largest accepted one.
        let good = self.step(GOOD_STEPS);
        let allowed =
            format!("at least {needed}. A time.step of {good:.3e} s resolves the motion well");
        Err(Error::invalid(self.key, found, allowed))
    }

    /// The warning, with its code, of a time step, s, that makes fewer than [`GOOD_STEPS`] per period, or half as many
    /// per ramp or recorded period; `None` for smaller steps.
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
    /// Rate of the ramp, or else the oscillation, of the motion with this key. None for a motion of size zero, or
    /// without ramp and frequency.
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

    /// Largest time step, s, that makes [`GOOD_STEPS`] per period (half as many per ramp or recorded period) of all
    /// motions of walls and hinges. Infinite without any. Recorded ends are left out: their steps follow from the
    /// frames of the recording.
    pub(crate) fn largest_good_step(&self) -> f64 {
        self.rates().map(|rate| rate.step(GOOD_STEPS)).fold(f64::INFINITY, f64::min)
    }

    /// Rates of `supports.motion`, each with its key: its ramp or oscillation, then its recording that has a bandwidth.
    fn rates(&self) -> impl Iterator<Item = MotionRate> {
        self.motion.iter().enumerate().flat_map(|(i, motion)| {
            let key = format!("supports.motion[{i}]");
            let bandwidth = motion.track.as_ref().and_then(|track| track.bandwidth());
            let recorded = bandwidth.map(|hertz| {
                MotionRate::from_bandwidth(format!("{key}.file"), "recorded motion", hertz)
            });
            motion.rate(&key).into_iter().chain(recorded)
        })
    }

    /// Rate of the recording `supports.path`, by its bandwidth; none without a recording, before its examination, and
    /// at rest.
    fn path_rate(&self) -> Option<MotionRate> {
        let bandwidth = self.path.as_ref()?.track.as_ref()?.bandwidth()?;
        Some(MotionRate::from_bandwidth("supports.path.file".into(), "recorded motion", bandwidth))
    }
}
