//! What holds the ends of the rod, and how the ends are moved.

use crate::code::Code;
use crate::error::Error;
use crate::scene::number::{Candidates, Numbers, Quantity, Written};
use crate::scene::path::Recorded;
use crate::scene::support::{Clamp, End, Support};
use crate::scene::time::Time;
use crate::scene::track::Track;
use crate::scene::validate::{direction, finite, not_negative, positive};
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Steps a period that a swinging support needs at the least, and half as many a ramp: at two steps a
/// period they all find it where it stands still. With four the tip of a shaken cantilever was off by
/// 40 to 80 % of its largest way, with two steps a ramp by 7 to 33 %.
const FEWEST_STEPS: f64 = 4.0;
/// Those from which on no word is said. With 20 a period the same tip was off by 8 to 19 %, most of it
/// by the sudden start, and by 2 to 9 % with 10 a ramp.
const GOOD_STEPS: f64 = 20.0;

/// `[supports]`: supports of both ends of the rod.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[cfg_attr(test, schemars(bound = "D: Written + schemars::JsonSchema"))]
#[serde(deny_unknown_fields, bound = "D: Written")]
pub struct Supports<D = f64> {
    /// Support of the end at arc length zero.
    #[serde(default = "clamped")]
    pub start: Support,
    /// Support of the end at the largest arc length.
    #[serde(default)]
    pub end: Support,
    /// Position of the wall of a clamped end.
    #[serde(default)]
    pub clamp: Clamp,
    /// Rotation of the whole rod about its first node, rad, right-handed about the normal of its
    /// plane (in the xy plane about z, counterclockwise); planar scenes only.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub angle: D,
    /// Compliance of a clamped start.
    #[serde(default, skip_serializing_if = "Compliance::is_rigid")]
    pub start_compliance: Compliance<D>,
    /// Compliance of a clamped end.
    #[serde(default, skip_serializing_if = "Compliance::is_rigid")]
    pub end_compliance: Compliance<D>,
    /// Direction in which a roller moves; default: along the rod at that end.
    #[serde(
        default,
        deserialize_with = "crate::input::arrays::some_numbers",
        skip_serializing_if = "Option::is_none"
    )]
    pub roller: Option<[f64; 3]>,
    /// Prescribed motions of the ends.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub motion: Vec<Motion<D>>,
    /// Recording that recorded ends follow.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub path: Option<Recorded>,
}

fn is_zero<D: Written>(value: &D) -> bool {
    *value == D::default()
}

fn clamped() -> Support {
    Support::Clamped
}

impl<D: From<f64>> Default for Supports<D> {
    fn default() -> Self {
        Self {
            start: Support::Clamped,
            end: Support::Free,
            clamp: Clamp::default(),
            angle: D::from(0.0),
            start_compliance: Compliance::default(),
            end_compliance: Compliance::default(),
            roller: None,
            motion: Vec::new(),
            path: None,
        }
    }
}

/// Compliance of a clamp (`start_compliance`, `end_compliance`); zero is rigid.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[cfg_attr(test, schemars(bound = "D: Written + schemars::JsonSchema"))]
#[serde(deny_unknown_fields, bound = "D: Written")]
pub struct Compliance<D = f64> {
    /// Rotation per bending moment, rad/(N m).
    #[serde(default)]
    pub rotation: D,
    /// Displacement along the rod per force, m/N.
    #[serde(default)]
    pub axial: D,
}

impl<D: From<f64>> Default for Compliance<D> {
    fn default() -> Self {
        Self { rotation: D::from(0.0), axial: D::from(0.0) }
    }
}

impl<D: Written> Compliance<D> {
    fn is_rigid(&self) -> bool {
        *self == Self::default()
    }
}

impl Compliance {
    fn over<D>(&self, n: &mut Numbers<'_, D>) -> Compliance<D> {
        let compliance = |unit, [low, high]: [f64; 2]| {
            let searched = Candidates::Decades(low, high, 1.0);
            Quantity::positive(unit).searched(searched).vanishing()
        };
        let [turns, gives] = [[1e-3, 10.0], [1e-6, 1e-2]];
        Compliance {
            rotation: n.number("rotation", self.rotation, compliance("rad/(N m)", turns)),
            axial: n.number("axial", self.axial, compliance("m/N", gives)),
        }
    }
}

/// `[[supports.motion]]`: prescribed motion of a clamped or pinned end, or twist of a recorded one.
/// Motions of one end are added.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[cfg_attr(test, schemars(bound = "D: Written + schemars::JsonSchema"))]
#[serde(deny_unknown_fields, bound = "D: Written")]
pub struct Motion<D = f64> {
    /// End of the rod that moves.
    pub end: End,
    /// Displacement of the end, m.
    #[serde(deserialize_with = "crate::input::arrays::numbers", default)]
    pub displacement: [D; 3],
    /// Rotation vector of a clamped end about an axis through it, rad.
    #[serde(deserialize_with = "crate::input::arrays::numbers", default)]
    pub rotation: [D; 3],
    /// Rotation of a clamped end about the rod itself, rad, right-handed from start to end, counted
    /// beyond full turns. Of a recorded end: constant rotation relative to the position of least
    /// energy between the first markers.
    #[serde(default)]
    pub twist: D,
    /// Duration of a motion from rest to rest, s; without ramp and frequency the end is displaced
    /// from the beginning.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ramp: Option<D>,
    /// Frequency of a motion `sin(2 pi frequency t)`, Hz.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub frequency: Option<D>,
    /// Recording of the motion, relative to the scene file: a CSV file with a clock `t` and columns
    /// x, y, z of a point that moves with the end, m, or `ax, ay, az` of an accelerometer that
    /// starts at rest, m/s^2.
    #[serde(default, skip_serializing_if = "is_empty")]
    pub file: PathBuf,
    /// Time on the recording's own clock, in its unit, at which the simulation starts; default 0.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub time_zero: Option<f64>,
    /// The recording, once it is read.
    #[serde(skip)]
    pub track: Option<Arc<Track>>,
}

fn is_empty(file: &Path) -> bool {
    file.as_os_str().is_empty()
}

/// When the supports' motions are asked for.
#[derive(Clone, Copy, Debug)]
pub enum Moment<D> {
    /// The moment at a time, s.
    Time(D),
    /// On the way to a state at rest, of which this part is done: that at t = 0, or, `settled`,
    /// the one where every ramp has come to its end.
    Approach {
        /// How much of the way is done, from 0 to 1.
        progress: D,
        /// Whether ramps have come to their end.
        settled: bool,
    },
}

/// How fast a support moves.
struct Pace {
    /// Its place in the scene file.
    key: String,
    /// What moves so fast, with its unit.
    found: String,
    /// Period or duration of that, s.
    time: f64,
    /// What steps are counted by, and how many of them a period of a swing takes.
    of: &'static str,
    fraction: f64,
}

impl Pace {
    /// The largest step that makes so many a period, s.
    fn step(&self, per_period: f64) -> f64 {
        self.time / (self.fraction * per_period)
    }

    /// Whether a step is too large for so many a period: what is found, and what is needed.
    fn too_large(&self, step: f64, per_period: f64) -> Option<[String; 2]> {
        let Self { found, of, fraction, .. } = self;
        let largest = self.step(per_period);
        (step > largest * (1.0 + 1e-9)).then(|| {
            let steps = fraction * per_period;
            let taken = steps * largest / step;
            [
                format!("{found} with time.step = {step} s, {taken:.2} steps a {of}"),
                format!("{steps} steps a {of}, a time.step of {largest:.3e} s"),
            ]
        })
    }

    /// That of a recorded motion by its bandwidth, Hz. Slower parts make up 99 % of its variance, so that half as many
    /// steps a period resolve it as those of a single frequency: two are the sampling theorem's.
    fn of_recording(key: String, bandwidth: f64) -> Self {
        let found = format!("recorded motion of up to {bandwidth:.3} Hz (99 % of its variance)");
        Self { key, found, time: bandwidth.recip(), of: "period", fraction: 0.5 }
    }
}

impl<D> Moment<D> {
    /// The same moment over another number type.
    pub fn map<E>(self, convert: impl Fn(D) -> E) -> Moment<E> {
        match self {
            Self::Time(time) => Moment::Time(convert(time)),
            Self::Approach { progress, settled } => {
                Moment::Approach { progress: convert(progress), settled }
            }
        }
    }
}

impl<D: crate::Scalar> Motion<D> {
    /// The same motion over another number type.
    pub(crate) fn map<E>(&self, convert: impl Fn(D) -> E + Copy) -> Motion<E> {
        Motion {
            end: self.end,
            displacement: self.displacement.map(convert),
            rotation: self.rotation.map(convert),
            twist: convert(self.twist),
            ramp: self.ramp.map(convert),
            frequency: self.frequency.map(convert),
            file: self.file.clone(),
            time_zero: self.time_zero,
            track: self.track.clone(),
        }
    }

    /// How far a recording takes the end by a moment, m, in the world.
    pub(crate) fn recorded(&self, moment: Moment<D>) -> Option<[D; 3]> {
        let [marker, ..] = self.track.as_ref()?.markers() else { return None };
        let Moment::Time(time) = moment else { return None };
        let start = marker.at(0.0);
        let place = marker.at(time);
        Some(std::array::from_fn(|c| place[c] - start[c]))
    }

    /// The fraction of the motion that is done at a moment; its own numbers carry derivatives, and so
    /// does the moment.
    pub(crate) fn fraction(&self, moment: Moment<D>) -> D {
        let (zero, one) = (D::from(0.0), D::from(1.0));
        match (moment, self.ramp, self.frequency) {
            (Moment::Time(_), None, None) => one,
            (Moment::Approach { progress, .. }, None, None) => progress,
            (Moment::Time(t), None, Some(frequency)) => (t * frequency * TAU).sin(),
            (Moment::Time(t), Some(ramp), _) => {
                // The quintic without velocity and acceleration at its ends.
                let u = t / ramp;
                match u.value() {
                    ..=0.0 => zero,
                    1.0.. => one,
                    _ => u * u * u * ((u * 6.0 - 15.0) * u + 10.0),
                }
            }
            (Moment::Approach { progress, settled: true }, Some(_), _) => progress,
            (Moment::Approach { .. }, _, _) => zero,
        }
    }
}

impl Motion {
    fn over<D>(&self, n: &mut Numbers<'_, D>) -> Motion<D> {
        Motion {
            end: self.end,
            displacement: n.vector("displacement", self.displacement, Quantity::signed("m")),
            rotation: n.vector("rotation", self.rotation, Quantity::signed("rad")),
            twist: n.number("twist", self.twist, Quantity::signed("rad")),
            ramp: n.maybe("ramp", self.ramp, Quantity::positive("s")),
            frequency: n.maybe("frequency", self.frequency, Quantity::positive("Hz")),
            file: self.file.clone(),
            time_zero: self.time_zero,
            track: self.track.clone(),
        }
    }

    /// How fast it moves, of the motion with this key; none where it does not.
    fn pace(&self, key: &str) -> Option<Pace> {
        let moves = self.displacement != [0.0; 3] || self.rotation != [0.0; 3] || self.twist != 0.0;
        let (name, value, unit) = match (self.ramp, self.frequency) {
            (Some(value), _) => ("ramp", value, "s"),
            (None, Some(value)) => ("frequency", value, "Hz"),
            (None, None) => return None,
        };
        let (time, of, fraction) = match name {
            "ramp" => (value, "ramp", 0.5),
            _ => (value.recip(), "period", 1.0),
        };
        let (key, found) = (format!("{key}.{name}"), format!("{value} {unit}"));
        moves.then_some(Pace { key, found, time, of, fraction })
    }

    /// How fast its recording moves.
    fn recorded_pace(&self, key: &str) -> Option<Pace> {
        let bandwidth = self.track.as_ref()?.bandwidth()?;
        Some(Pace::of_recording(format!("{key}.file"), bandwidth))
    }

    /// Reads the recording, and looks for what is wrong in it, once.
    pub(super) fn read(&mut self, folder: &Path) -> Result<(), Error> {
        let track = match self.track.take() {
            Some(track) => track,
            None if is_empty(&self.file) => return Ok(()),
            None => {
                let file = marker_files::file::at(folder, &self.file);
                Track::read_one(&file, self.time_zero)?.into()
            }
        };
        let unguarded = (!track.is_examined()).then(|| Track::clone(&track).guarded(&[0]));
        self.track = Some(unguarded.map_or(track, Arc::new));
        Ok(())
    }

    /// Whether it is there from the beginning.
    pub(crate) fn is_offset(&self) -> bool {
        self.ramp.is_none() && self.frequency.is_none() && self.track.is_none()
    }

    fn check(&self, key: &str, support: Support) -> Result<(), Error> {
        let invalid = |name: &str, found: &dyn ToString, allowed: &str| {
            Err(Error::invalid(format!("{key}.{name}"), found.to_string(), allowed))
        };
        finite(&format!("{key}.displacement"), &self.displacement)?;
        finite(&format!("{key}.rotation"), &self.rotation)?;
        if !self.twist.is_finite() {
            return invalid("twist", &self.twist, "a finite number");
        }
        for (name, value) in [("ramp", self.ramp), ("frequency", self.frequency)] {
            value.map_or(Ok(()), |value| positive(&format!("{key}.{name}"), value))?;
        }
        if let Some(time_zero) = self.time_zero {
            if !time_zero.is_finite() {
                return invalid("time_zero", &time_zero, "a finite number");
            }
            if is_empty(&self.file) {
                return invalid("time_zero", &time_zero, "with the file of a recording only");
            }
        }
        if self.ramp.is_some() && self.frequency.is_some() {
            return invalid("frequency", &"both ramp and frequency", "one of the two");
        }
        match support {
            Support::Clamped => Ok(()),
            Support::Pinned if self.rotation == [0.0; 3] && self.twist == 0.0 => Ok(()),
            Support::Pinned => {
                invalid("rotation", &"a turn of a pinned end", "turns of clamped ends")
            }
            // Markers say all but how it is turned about itself.
            Support::Recorded => {
                let only = Self { twist: 0.0, end: self.end, ..Self::default() };
                match (Self { twist: 0.0, ..self.clone() }) == only {
                    true => Ok(()),
                    false => invalid(
                        "end",
                        &"a motion of a recorded end other than a twist that stays",
                        "twist alone: the recording moves the end",
                    ),
                }
            }
            Support::Free | Support::Roller => invalid(
                "end",
                &"a motion of an end that no wall or hinge holds",
                "clamped, pinned or recorded ends",
            ),
        }
    }
}

impl<D> Supports<D> {
    /// Whether an end moves, by a formula or as it was recorded.
    pub(crate) fn move_ends(&self) -> bool {
        !self.motion.is_empty() || self.path.is_some()
    }

    /// Whether walls at nodes, or hands that hold two, take from the rod what bends over half an edge behind them.
    pub(crate) fn cut_edges(&self) -> bool {
        let hold = self.path.as_ref().is_some_and(|path| path.held > 1);
        [self.start, self.end].into_iter().any(|support| match support {
            Support::Clamped => self.clamp == Clamp::Nodes,
            Support::Recorded => hold,
            _ => false,
        })
    }

    /// How far recorded ends are held turned about the rod, beyond how it lies.
    pub(crate) fn recorded_turns(&self) -> impl Iterator<Item = (End, &D)> {
        let turns = self.motion.iter().filter(|motion| self.at(motion.end) == Support::Recorded);
        turns.map(|motion| (motion.end, &motion.twist))
    }

    /// Whether a recorded end turns freely about itself.
    pub(crate) fn turns_freely(&self, end: End) -> bool {
        self.path.as_ref().is_some_and(|path| path.free_twist.contains(&end))
    }

    /// How the clamp of an end gives way.
    pub fn compliance(&self, end: End) -> &Compliance<D> {
        match end {
            End::Start => &self.start_compliance,
            End::End => &self.end_compliance,
        }
    }

    /// The support of an end.
    pub fn at(&self, end: End) -> Support {
        match end {
            End::Start => self.start,
            End::End => self.end,
        }
    }
}

impl Supports {
    pub(super) fn over<D>(&self, n: &mut Numbers<'_, D>) -> Supports<D> {
        Supports {
            start: self.start,
            end: self.end,
            clamp: self.clamp,
            angle: n.number("angle", self.angle, Quantity::ANGLE),
            start_compliance: n.table("start_compliance", |n| self.start_compliance.over(n)),
            end_compliance: n.table("end_compliance", |n| self.end_compliance.over(n)),
            roller: self.roller,
            motion: n.list("motion", &self.motion, Motion::over),
            path: self.path.clone(),
        }
    }

    /// The end that rolls.
    pub(crate) fn rolling(&self) -> Option<End> {
        [End::Start, End::End].into_iter().find(|end| self.at(*end) == Support::Roller)
    }

    /// Refuses motions that a rod cannot start with, outside of equilibrium.
    pub(crate) fn check_start(&self) -> Result<(), Error> {
        let away = |motion: &Motion| motion.is_offset() && self.at(motion.end) != Support::Recorded;
        match self.motion.iter().position(away) {
            Some(i) => {
                let found = "an end away from where the rod starts";
                let allowed = "ramp or frequency, or initial.state = \"equilibrium\"";
                Err(Error::invalid(format!("supports.motion[{i}]"), found, allowed))
            }
            None => Ok(()),
        }
    }

    /// Refuses steps that do not resolve how the supports move.
    pub(crate) fn check_step(&self, step: f64) -> Result<(), Error> {
        for pace in self.paces().chain(self.path_pace()) {
            if let Some([found, needed]) = pace.too_large(step, FEWEST_STEPS) {
                let good = pace.step(GOOD_STEPS);
                let allowed = format!("at least {needed}; {good:.3e} s follows it well");
                return Err(Error::invalid(pace.key, found, allowed));
            }
        }
        Ok(())
    }

    /// Which motions a step follows badly.
    pub(crate) fn step_warnings(&self, step: f64) -> Vec<(Code, String)> {
        let words = |pace: Pace| {
            let [found, needed] = pace.too_large(step, GOOD_STEPS)?;
            let key = &pace.key;
            let words = format!(
                "{key}: found {found}. The time steps do not resolve the motion, and the result \
                                 is inaccurate. Use {needed}"
            );
            Some((Code::StepTooLarge, words))
        };
        self.paces().chain(self.path_pace()).filter_map(words).collect()
    }

    /// The largest step that follows all motions well, s; infinite without any. Steps of recorded ends follow from
    /// the frames of the recording.
    pub(crate) fn largest_good_step(&self) -> f64 {
        self.paces().map(|pace| pace.step(GOOD_STEPS)).fold(f64::INFINITY, f64::min)
    }

    /// The motions of walls that take time.
    fn paces(&self) -> impl Iterator<Item = Pace> {
        let all = self.motion.iter().enumerate();
        all.flat_map(|(i, motion)| {
            let key = format!("supports.motion[{i}]");
            motion.pace(&key).into_iter().chain(motion.recorded_pace(&key))
        })
    }

    /// The motion of recorded ends.
    fn path_pace(&self) -> Option<Pace> {
        let bandwidth = self.path.as_ref()?.track.as_ref()?.bandwidth()?;
        Some(Pace::of_recording("supports.path.file".into(), bandwidth))
    }

    /// All recordings that move the supports.
    fn recordings(&self) -> impl Iterator<Item = (&Path, &Track)> {
        let path = self.path.iter().map(|path| (&*path.file, &path.track));
        let walls = self.motion.iter().map(|motion| (&*motion.file, &motion.track));
        path.chain(walls).filter_map(|(file, track)| Some((file, &**track.as_ref()?)))
    }

    /// What is wrong in the recordings that move the supports.
    pub(crate) fn recording_warnings(&self) -> Vec<(Code, String)> {
        self.recordings().flat_map(|(file, track)| track.warnings(file)).collect()
    }

    /// Refuses a simulation beyond the end of a recording, where its motion would be extrapolated.
    pub(super) fn check_end(&self, time: &Time) -> Result<(), Error> {
        for (file, track) in self.recordings() {
            let last = track.end();
            // A step may begin before the last frame and end after it.
            let step = time.step.unwrap_or_else(|| track.usual_step());
            if time.end.is_finite() && time.end > last + step {
                let name = if is_empty(file) {
                    "the recording".into()
                } else {
                    file.display().to_string()
                };
                let allowed = format!("up to {last} s, where {name} ends");
                return Err(Error::invalid("time.end", format!("{} s", time.end), allowed));
            }
        }
        Ok(())
    }

    /// Checks every value.
    pub(crate) fn check(&self) -> Result<(), Error> {
        if (self.start, self.end) == (Support::Roller, Support::Roller) {
            let allowed = "one roller: a rod on two slides away";
            return Err(Error::invalid("supports.end", "a second roller", allowed));
        }
        if !self.angle.is_finite() {
            return Err(Error::invalid("supports.angle", self.angle, "a finite number"));
        }
        if let Some(roller) = &self.roller {
            direction("supports.roller", roller)?;
            if self.rolling().is_none() {
                let allowed = "with start or end = \"roller\" only";
                return Err(Error::invalid("supports.roller", "no end that rolls", allowed));
            }
        }
        for (key, end) in [("start_compliance", End::Start), ("end_compliance", End::End)] {
            let give = self.compliance(end);
            for (own, value) in [("rotation", give.rotation), ("axial", give.axial)] {
                let key = format!("supports.{key}.{own}");
                not_negative(&key, value)?;
                if value != 0.0 && self.at(end) != Support::Clamped {
                    return Err(Error::invalid(key, value, "0, as that end has no support"));
                }
            }
        }
        let ends = [self.start, self.end];
        match &self.path {
            Some(path) => path.check(ends)?,
            None if ends.contains(&Support::Recorded) => {
                let allowed = "with the file of a recording beside \"recorded\" ends";
                return Err(Error::invalid("supports.path", "no such table", allowed));
            }
            None => {}
        }
        for (i, motion) in self.motion.iter().enumerate() {
            let key = format!("supports.motion[{i}]");
            motion.check(&key, self.at(motion.end))?;
            let held = self.path.as_ref().map_or(0, |path| path.held);
            if self.turns_freely(motion.end) {
                let found = "a twist of an end that turns freely";
                let allowed = "ends that are not in supports.path.free_twist";
                return Err(Error::invalid(format!("{key}.twist"), found, allowed));
            }
            if self.at(motion.end) == Support::Recorded && held < 2 {
                let found = "a twist of an end at which one marker is held";
                let allowed = "supports.path.held = 2 or more: an edge that it turns";
                return Err(Error::invalid(format!("{key}.twist"), found, allowed));
            }
        }
        Ok(())
    }
}
