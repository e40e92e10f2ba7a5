//! `[[signals]]`: factors of loads as functions of time, from a formula or from samples in a file.
//!
//! A [`Signal`] is `gain * s(t - delay)`, without a unit. `s` is a sine, a ramp from 0 to 1, a pulse from 0 to 1 and
//! back, values in steps, or the samples of a file. [`Signal::curve`] returns it over any scalar; gain, delay and the
//! numbers of the formula can be identified. `read` reads the file. Smooth signals, which some schemes require, are a
//! sine and samples with cubic interpolation.
//!
//! Rejected are missing keys, keys of another kind, names that are used twice, a load whose signal does not exist, and
//! a simulation beyond the samples. The rate for the choice of time steps is the frequency of a sine, the bandwidth of
//! samples, or the duration of a pulse; `warnings` are those of missing samples.

use crate::code::Code;
use crate::error::Error;
use crate::numerics::scalar::Scalar;
use crate::scene::motion_rate::MotionRate;
use crate::scene::number::{Quantity, is_default, one};
use crate::scene::signal_curve::{CurveShape, SignalCurve};
use crate::scene::signal_samples::{Interpolation, SignalSamples};
use crate::scene::table::table;
use crate::scene::time::Time;
use crate::scene::validate::check_name;
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Formula of a signal.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum SignalKind {
    /// `amplitude sin(2 pi frequency t + phase)`.
    Sine,
    /// From 0 at `start` to 1 after `duration`, on a straight line.
    Ramp,
    /// From 0 to 1 within `rise` from `start` on, and back to 0 within `rise` until `start + duration`.
    Pulse,
    /// Each of `values` from its entry of `times` on; 0 before the first.
    Steps,
}

table! {
    /// `[[signals]]`: a factor of loads as a function of time.
    pub struct Signal by name {
        /// Name by which loads refer to the signal.
        pub name: String,
        /// Formula of the signal; absent with a file.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        pub kind: Option<SignalKind>,
        /// File with the samples, relative to the scene file: a table with the columns `t` (s) and `value`.
        #[serde(default, skip_serializing_if = "is_default")]
        pub file: PathBuf,
        /// Interpolation between samples: `linear` (default) or `cubic`.
        #[serde(default, skip_serializing_if = "is_default")]
        pub interpolation: Interpolation,
        /// Amplitude of a sine; default 1.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        pub amplitude: Option<D> = Quantity::signed(""),
        /// Frequency of a sine, Hz.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        pub frequency: Option<D> = Quantity::positive("Hz"),
        /// Phase of a sine at t = 0, rad; default 0.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        pub phase: Option<D> = Quantity::signed("rad"),
        /// Time at which a ramp or a pulse begins, s; default 0.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        pub start: Option<D> = Quantity::signed("s"),
        /// Duration of a ramp, or of a pulse with both of its slopes, s.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        pub duration: Option<D> = Quantity::positive("s"),
        /// Duration of each slope of a pulse, s; default 0, a jump.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        pub rise: Option<D> = Quantity::positive("s").vanishing(),
        /// Times from which on each value of `steps` holds, s.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        pub times: Vec<f64>,
        /// Values of `steps`.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        pub values: Vec<D> = Quantity::signed(""),
        /// Factor of the signal; default 1.
        #[serde(default = "one::<D>")]
        pub gain: D = Quantity::signed(""),
        /// Time by which the signal is later, s; default 0.
        #[serde(default)]
        pub delay: D = Quantity::signed("s"),
        /// The samples, once they are read.
        #[serde(skip)]
        pub samples: Option<Arc<SignalSamples>>,
    }
}

impl<D: From<f64>> Signal<D> {
    /// A signal of this name without kind and file, with the gain 1 and no delay.
    pub fn new(name: &str) -> Self {
        Self {
            name: name.into(),
            kind: None,
            file: PathBuf::new(),
            interpolation: Interpolation::default(),
            amplitude: None,
            frequency: None,
            phase: None,
            start: None,
            duration: None,
            rise: None,
            times: Vec::new(),
            values: Vec::new(),
            gain: D::from(1.0),
            delay: D::from(0.0),
            samples: None,
        }
    }
}

impl<D: Scalar> Signal<D> {
    /// The signal as a function of time, with gain and delay, by its samples or else its kind. It is zero for a file
    /// that is not read, and without a kind. Missing numbers count as amplitude 1, duration 1 s, and otherwise 0;
    /// validation rejects a missing frequency or duration.
    pub fn curve(&self) -> SignalCurve<D> {
        let (zero, one) = (D::from(0.0), D::from(1.0));
        let constant = |value: D| [value, zero, zero, zero];
        let line = |value: D, slope: D| [value, slope, zero, zero];
        let start = self.start.unwrap_or(zero);
        let duration = self.duration.unwrap_or(one);
        let pieces = |list: Vec<(D, [D; 4])>| {
            let (knots, pieces) = list.into_iter().unzip();
            CurveShape::Pieces { knots, pieces }
        };
        let shape = match (&self.samples, self.kind) {
            (Some(samples), _) => CurveShape::Samples(samples.clone()),
            (None, Some(SignalKind::Sine)) => CurveShape::Sine {
                amplitude: self.amplitude.unwrap_or(one),
                angular_frequency: self.frequency.unwrap_or(zero) * TAU,
                phase: self.phase.unwrap_or(zero),
            },
            (None, Some(SignalKind::Ramp)) => pieces(vec![
                (start, line(zero, duration.recip())),
                (start + duration, constant(one)),
            ]),
            (None, Some(SignalKind::Pulse)) => {
                let end = start + duration;
                match self.rise.filter(|rise| rise.value() > 0.0) {
                    Some(rise) => pieces(vec![
                        (start, line(zero, rise.recip())),
                        (start + rise, constant(one)),
                        (end - rise, line(one, -rise.recip())),
                        (end, constant(zero)),
                    ]),
                    None => pieces(vec![(start, constant(one)), (end, constant(zero))]),
                }
            }
            (None, Some(SignalKind::Steps)) => {
                let steps = self.times.iter().zip(&self.values);
                pieces(steps.map(|(time, value)| (D::from(*time), constant(*value))).collect())
            }
            (None, None) => pieces(Vec::new()),
        };
        SignalCurve { gain: self.gain, delay: self.delay, shape }
    }
}

impl Signal {
    /// Whether a ramp, a pulse or steps have a value below zero, gain included. False for a sine and samples of a file,
    /// which are not examined.
    pub(super) fn has_negative_values(&self) -> bool {
        match self.kind {
            Some(SignalKind::Ramp | SignalKind::Pulse) => self.gain < 0.0,
            Some(SignalKind::Steps) => self.values.iter().any(|value| self.gain * value < 0.0),
            _ => false,
        }
    }

    /// Reads the samples from the file, relative to `folder`, unless there are samples. No effect without a file.
    ///
    /// # Errors
    /// A file that cannot be read.
    pub(super) fn read(&mut self, folder: &Path) -> Result<(), Error> {
        if self.samples.is_none() && !is_default(&self.file) {
            let file = marker_files::file::at(folder, &self.file);
            self.samples = Some(Arc::new(SignalSamples::read(&file, self.interpolation)?));
        }
        Ok(())
    }

    /// Whether schemes that require smooth signals accept this one: a sine, and samples with cubic interpolation.
    /// Between the first and the last sample both have continuous second derivatives.
    pub fn is_smooth(&self) -> bool {
        let is_cubic = self.kind.is_none() && self.interpolation == Interpolation::Cubic;
        self.kind == Some(SignalKind::Sine) || is_cubic
    }

    /// Rejects an invalid name (allowed: a letter, then letters, digits, - and _), and a signal with neither or both of
    /// kind and file. Missing keys, and keys that its kind does not have, are errors. Also rejected are a pulse shorter
    /// than its two slopes, an empty list of times of steps or one that does not increase, and another number of values
    /// than of times. `key` is that of the signal, for the error.
    pub(super) fn check(&self, key: &str) -> Result<(), Error> {
        let invalid = |name: &str, found: &dyn ToString, allowed: &str| {
            Err(Error::invalid(format!("{key}.{name}"), found.to_string(), allowed))
        };
        check_name(&format!("{key}.name"), &self.name)?;
        let has_samples = !is_default(&self.file) || self.samples.is_some();
        if has_samples == self.kind.is_some() {
            let found = if has_samples { "both kind and file" } else { "neither kind nor file" };
            return invalid("kind", &found, "one of kind and file");
        }
        let allowed_keys: &[&str] = match self.kind {
            None => &["interpolation"],
            Some(SignalKind::Sine) => &["amplitude", "frequency", "phase"],
            Some(SignalKind::Ramp) => &["start", "duration"],
            Some(SignalKind::Pulse) => &["start", "duration", "rise"],
            Some(SignalKind::Steps) => &["times", "values"],
        };
        let given = [
            ("interpolation", !is_default(&self.interpolation)),
            ("amplitude", self.amplitude.is_some()),
            ("frequency", self.frequency.is_some()),
            ("phase", self.phase.is_some()),
            ("start", self.start.is_some()),
            ("duration", self.duration.is_some()),
            ("rise", self.rise.is_some()),
            ("times", !self.times.is_empty()),
            ("values", !self.values.is_empty()),
        ];
        if let Some((name, _)) =
            given.iter().find(|(name, is_given)| *is_given && !allowed_keys.contains(name))
        {
            let allowed = format!("with this signal only {}", allowed_keys.join(", "));
            return invalid(name, &"a key of another kind of signal", &allowed);
        }
        match self.kind {
            Some(SignalKind::Sine) if self.frequency.is_none() => {
                return invalid("frequency", &"no such key", "the frequency of the sine, Hz");
            }
            Some(SignalKind::Ramp | SignalKind::Pulse) if self.duration.is_none() => {
                return invalid("duration", &"no such key", "the duration, s");
            }
            _ => {}
        }
        if let (Some(SignalKind::Pulse), Some(rise), Some(duration)) =
            (self.kind, self.rise, self.duration)
            && 2.0 * rise > duration
        {
            let allowed = format!("at most half of the duration, {} s", 0.5 * duration);
            return invalid("rise", &rise, &allowed);
        }
        if self.kind == Some(SignalKind::Steps) {
            let increasing = self.times.windows(2).all(|t| t[0] < t[1]);
            if self.times.is_empty() || !increasing || !self.times.iter().all(|t| t.is_finite()) {
                return invalid(
                    "times",
                    &format!("{:?}", self.times),
                    "increasing finite times, s",
                );
            }
            if self.values.len() != self.times.len() {
                let allowed = format!("{}, one for each of times", self.times.len());
                return invalid("values", &format!("{} values", self.values.len()), &allowed);
            }
        }
        Ok(())
    }

    /// Rejects a simulation that ends more than a step after the last sample, later by a positive delay. A negative
    /// delay does not count, so that it does not limit a search for the delay: the last value is kept until the end. If
    /// the step is left to the program, it is the median interval of the samples. A missing end, and a signal without
    /// samples, are accepted.
    pub(super) fn check_end(&self, time: &Time) -> Result<(), Error> {
        let Some(samples) = &self.samples else { return Ok(()) };
        let last = samples.end() + self.delay.max(0.0);
        let step = time.step.unwrap_or_else(|| samples.usual_step());
        if time.end.is_finite() && time.end > last + step {
            let allowed = format!("up to {last} s, where the signal {} ends", self.name);
            return Err(Error::invalid("time.end", format!("{} s", time.end), allowed));
        }
        Ok(())
    }

    /// Rate of the signal for the choice of time steps: the frequency of a sine, or the bandwidth of samples. None for
    /// other kinds, whose means over a step are exact for loads of constant direction, and for samples that do not
    /// exceed their noise.
    pub(super) fn motion_rate(&self) -> Option<MotionRate> {
        let key = format!("signals.{}", self.name);
        match (&self.samples, self.frequency) {
            (Some(samples), _) => Some(MotionRate::from_bandwidth(
                format!("{key}.file"),
                "recorded signal",
                samples.bandwidth()?,
            )),
            (None, Some(frequency)) if self.kind == Some(SignalKind::Sine) => {
                Some(MotionRate::of_frequency(format!("{key}.frequency"), frequency))
            }
            _ => None,
        }
    }

    /// Rate of a pulse by its duration, within which at least two time steps are required. None for other kinds, for
    /// the gain 0, and without a duration.
    pub(super) fn pulse_rate(&self) -> Option<MotionRate> {
        let duration = self.duration.filter(|_| self.gain != 0.0)?;
        let key = format!("signals.{}.duration", self.name);
        let is_pulse = self.kind == Some(SignalKind::Pulse);
        is_pulse.then(|| MotionRate::of_interval(key, "pulse", duration))
    }

    /// Warnings, with codes, of the missing samples of a file, with its name in front; empty without samples that have
    /// been read.
    pub(super) fn warnings(&self) -> Vec<(Code, String)> {
        self.samples.as_ref().map_or(Vec::new(), |samples| samples.warnings(&self.file))
    }
}

/// Rejects the first signal that is invalid ([`Signal::check`]), or has the name of one before it. The error has the
/// path `signals[i]`.
pub(super) fn check_signals(signals: &[Signal]) -> Result<(), Error> {
    for (i, signal) in signals.iter().enumerate() {
        let key = format!("signals[{i}]");
        signal.check(&key)?;
        if signals[..i].iter().any(|other| other.name == signal.name) {
            let found = format!("a second signal {:?}", signal.name);
            return Err(Error::invalid(
                format!("{key}.name"),
                found,
                "a different name for each signal",
            ));
        }
    }
    Ok(())
}

/// Rejects a `signal` of the load with the path `key` if none of the `signals` has this name. `Ok` for a load without
/// one.
pub(super) fn check_reference(
    signals: &[Signal],
    signal: Option<&str>,
    key: &str,
) -> Result<(), Error> {
    let Some(name) = signal else { return Ok(()) };
    if signals.iter().any(|signal| signal.name == name) {
        return Ok(());
    }
    let names: Vec<&str> = signals.iter().map(|signal| signal.name.as_str()).collect();
    let allowed = match names.is_empty() {
        true => "the name of one of [[signals]], of which the scene has none".to_string(),
        false => format!("one of the signals {}", names.join(", ")),
    };
    Err(Error::invalid(format!("{key}.signal"), format!("{name:?}"), allowed))
}
