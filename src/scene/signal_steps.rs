//! Time steps and warnings of a scene by the motions of its supports and obstacles and the signals of its loads and
//! actuators.
//!
//! A step is compared with ramps, periods and recordings of supports and obstacles, periods of sine signals and the
//! bandwidth of samples. Pulses count if their load follows the rod or has a moment, or if they control an actuator.
//! Only signals that a load or an actuator names count (`used_signals`).
//!
//! `check_step` rejects a step, s, that does not resolve these motions, and `motion_step_warnings` warns of one that
//! resolves them poorly, by the limits of the module `motion_rate`. `largest_good_step` is the largest one, s, without
//! a warning; the recording in `supports.path` is left out there, that of a structure is included.

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

    /// Rates of the motions of obstacles, in the order of the contacts.
    fn obstacle_rates(&self) -> impl Iterator<Item = MotionRate> {
        self.contacts.iter().enumerate().flat_map(|(i, contact)| {
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
    /// `supports.motion`, obstacles and the used signals, and for which the recording of a structure has none; infinity
    /// without any. The recording in `supports.path` is left out.
    pub(crate) fn largest_good_step(&self) -> f64 {
        let recorded = self
            .structure
            .as_ref()
            .and_then(|structure| structure.recording.as_ref()?.good_step(&structure.supports));
        let rates = self.obstacle_rates().chain(self.signal_rates());
        let steps = rates.map(|rate| rate.good_step()).chain(recorded);
        steps.fold(self.supports.largest_good_step(), f64::min)
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{
        Material, Section, Shape, StructureRecording, StructureScene, Support, Track,
    };

    /// The largest good step of a scene with a structure is that without a warning of its recording: an oscillation of
    /// 5 Hz in 100 frames per second has a bandwidth of 5 to 10 Hz, and ten steps per period are 0.01 s to 0.02 s.
    #[test]
    fn recording_of_a_structure_limits_the_good_step() {
        let text = "[[rods]]\nname = \"a\"\nsegments = 20\n\
                    shape = { kind = \"straight\", length = 1.0, direction = [1, 0, 0] }\n\
                    section = { kind = \"circle\", radius = 3e-3 }\n\
                    material = { density = 1100, youngs_modulus = 2e7 }\n\
                    [[supports]]\nof = { rod = \"a\", at = \"start\" }\nkind = \"clamped\"\n";
        let mut structure = StructureScene::from_toml(text, ".").unwrap();
        structure.supports[0].kind = Support::Recorded;
        structure.supports[0].markers = vec!["m0".into(), "m1".into()];
        let times: Vec<f64> = (0..200).map(|k| 0.01 * f64::from(k)).collect();
        let place = |t: &f64| Some([0.01 * (10.0 * std::f64::consts::PI * t).sin(), 0.0, 0.0]);
        let seen: Vec<_> = times.iter().map(place).collect();
        let markers = ["m0", "m1"].map(|name| (name.to_string(), seen.clone())).to_vec();
        let mut recording = StructureRecording::of(Track::new(times, markers).unwrap());
        recording.examine(&structure.supports).unwrap();
        structure.recording = Some(recording.clone());
        let shape = Shape::Straight { length: 1.0, direction: [1.0, 0.0, 0.0] };
        let material = Material::new(1100.0, 2e7);
        let mut scene = Scene::new(20, shape, Section::Circle { radius: 3e-3 }, material);
        assert_eq!(scene.largest_good_step(), f64::INFINITY);
        scene.structure = Some(Box::new(structure.clone()));
        let step = scene.largest_good_step();
        // At least the 5 Hz of the oscillation; the spectrum of a finite recording is wider.
        assert!(step > 0.01 && step <= 0.02, "{step}");
        let has_warning = |step: f64| recording.step_warning(&structure.supports, step).is_some();
        assert!(has_warning(1.01 * step) && !has_warning(step), "{step}");
    }
}
