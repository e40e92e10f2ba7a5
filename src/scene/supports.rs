//! `[supports]`: supports of both ends of the rod, their compliance and their motion, with the validation of these
//! keys.
//!
//! An end is free, pinned, on a roller, clamped or recorded. A clamp has a compliance (rotation, rad/(N m), and axial,
//! m/N); zero is rigid. An end moves by `supports.motion` (displacements, rotations, twists) or follows the recording
//! `supports.path`.
//!
//! `check` rejects two rollers, a compliance without a clamp, recorded ends without a recording, and motions that an
//! end cannot have, and recorded poses beside recorded markers. `check_start` rejects an end that starts displaced,
//! `check_end` a simulation beyond the end of a recording. `cut_edges` is true if half an edge beside a held end does
//! not bend, `turns_freely` if an end rotates freely about the rod.

use crate::code::Code;
use crate::error::Error;
use crate::scene::number::{Candidates, Quantity, is_default};
use crate::scene::path::Recorded;
use crate::scene::prescribed_motion::Motion;
use crate::scene::support::{Clamp, End, Support};
use crate::scene::table::{NumberTree, TABLE, table};
use crate::scene::time::Time;
use crate::scene::track::Track;
use crate::scene::validate::direction;
use std::path::Path;

table! {
    /// `[supports]`: supports of both ends of the rod.
    pub struct Supports {
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
        #[serde(default, skip_serializing_if = "is_default")]
        pub angle: D = Quantity::ANGLE,
        /// Compliance of a clamped start.
        #[serde(default, skip_serializing_if = "is_default")]
        pub start_compliance: Compliance<D> = TABLE,
        /// Compliance of a clamped end.
        #[serde(default, skip_serializing_if = "is_default")]
        pub end_compliance: Compliance<D> = TABLE,
        /// Direction in which a roller moves; default: along the rod at that end.
        #[serde(
            default,
            deserialize_with = "crate::input::arrays::some_numbers",
            skip_serializing_if = "Option::is_none"
        )]
        pub roller: Option<[f64; 3]>,
        /// Prescribed motions of the ends.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        pub motion: Vec<Motion<D>> = TABLE,
        /// Recording that recorded ends follow.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        pub path: Option<Recorded>,
    }
}

/// Default support of the start: clamped.
fn clamped() -> Support {
    Support::Clamped
}

impl<D: Default> Default for Supports<D> {
    /// A rigid clamp at the start, with its wall in the middle of the first edge, and a free end; no motion, roller and
    /// recording.
    fn default() -> Self {
        Self {
            start: clamped(),
            end: Support::default(),
            clamp: Clamp::default(),
            angle: D::default(),
            start_compliance: Compliance::default(),
            end_compliance: Compliance::default(),
            roller: None,
            motion: Vec::new(),
            path: None,
        }
    }
}

/// Quantity of the compliance of a clamp in `unit`, zero or positive. A search covers `low` to `high`, in `unit`, with
/// one value per decade.
const fn compliance(unit: &'static str, low: f64, high: f64) -> Quantity {
    Quantity::positive(unit).searched(Candidates::Decades(low, high, 1.0)).vanishing()
}

table! {
    /// Compliance of a clamp (`start_compliance`, `end_compliance`); zero is rigid.
    #[derive(Copy, Default)]
    pub struct Compliance {
        /// Rotation per bending moment, rad/(N m).
        #[serde(default)]
        pub rotation: D = compliance("rad/(N m)", 1e-3, 10.0),
        /// Displacement along the rod per force, m/N.
        #[serde(default)]
        pub axial: D = compliance("m/N", 1e-6, 1e-2),
    }
}

impl<D> Supports<D> {
    /// Whether the ends or nodes have a prescribed motion: there is an entry of `supports.motion`, also of size zero,
    /// or a recording `supports.path`.
    pub(crate) fn move_ends(&self) -> bool {
        !self.motion.is_empty() || self.path.is_some()
    }

    /// Whether half an edge beside a held end does not bend, so that mesh errors are of first order. This is so at a
    /// clamp with its wall at a node, and at a recorded end with several held markers.
    pub(crate) fn cut_edges(&self) -> bool {
        let hold = self.path.as_ref().is_some_and(|path| path.held > 1);
        [self.start, self.end].into_iter().any(|support| match support {
            Support::Clamped => self.clamp == Clamp::Nodes,
            Support::Recorded => hold,
            _ => false,
        })
    }

    /// Each motion of a recorded end in the order of `supports.motion`: the end, and the constant twist about the rod,
    /// rad, that the motion adds.
    pub(crate) fn recorded_turns(&self) -> impl Iterator<Item = (End, &D)> {
        let turns = self.motion.iter().filter(|motion| self.at(motion.end) == Support::Recorded);
        turns.map(|motion| (motion.end, &motion.twist))
    }

    /// The end whose gripper places the whole rod in the world at t = 0: one with a recorded pose if the other end is
    /// free or has one too, the start if both have one. None otherwise: then the rest shape has its own place.
    pub(crate) fn placing_end(&self) -> Option<End> {
        let has_pose =
            |end: End| self.motion.iter().any(|own| own.end == end && own.pose.is_some());
        let places = |end: End, other: End| {
            has_pose(end) && (self.at(other) == Support::Free || has_pose(other))
        };
        match (places(End::Start, End::End), places(End::End, End::Start)) {
            (true, _) => Some(End::Start),
            (false, true) => Some(End::End),
            (false, false) => None,
        }
    }

    /// Whether the end is listed in `supports.path.free_twist`, so that it rotates freely about the rod. False without
    /// `supports.path`.
    pub(crate) fn turns_freely(&self, end: End) -> bool {
        self.path.as_ref().is_some_and(|path| path.free_twist.contains(&end))
    }

    /// Compliance of the clamp of an end: rotation, rad/(N m), and axial, m/N; zero is rigid.
    pub fn compliance(&self, end: End) -> &Compliance<D> {
        match end {
            End::Start => &self.start_compliance,
            End::End => &self.end_compliance,
        }
    }

    /// The kind of support (free, pinned, roller, clamped or recorded) of an end.
    pub fn at(&self, end: End) -> Support {
        match end {
            End::Start => self.start,
            End::End => self.end,
        }
    }
}

impl Supports {
    /// The end whose support is a roller; none without one. A valid scene has at most one.
    pub(crate) fn rolling(&self) -> Option<End> {
        [End::Start, End::End].into_iter().find(|end| self.at(*end) == Support::Roller)
    }

    /// Rejects the first motion of an end that is not recorded, also of size zero, without ramp, frequency and
    /// recording. It displaces the end from the beginning, which only an initial equilibrium allows. Rejects a recorded
    /// pose of an end beside a support of the other end, where the rest shape in general does not fit.
    pub(crate) fn check_start(&self) -> Result<(), Error> {
        let posed = |motion: &Motion| motion.pose.is_some();
        if let Some(i) = self.motion.iter().position(posed)
            && [self.start, self.end].iter().all(|support| *support != Support::Free)
        {
            let found = "a recorded pose of an end of a rod whose other end is held";
            let allowed = "initial.state = \"equilibrium\"";
            return Err(Error::invalid(format!("supports.motion[{i}].pose"), found, allowed));
        }
        // A recorded end begins where the recording does.
        let away = |motion: &Motion| motion.is_offset() && self.at(motion.end) != Support::Recorded;
        match self.motion.iter().position(away) {
            Some(i) => {
                let found = "an end that is displaced from the initial state";
                let allowed = "ramp or frequency, or initial.state = \"equilibrium\"";
                Err(Error::invalid(format!("supports.motion[{i}]"), found, allowed))
            }
            None => Ok(()),
        }
    }

    /// Files and tracks of all recordings that move the supports and have been read: `supports.path` first, then those
    /// of motions in order.
    fn recordings(&self) -> impl Iterator<Item = (&Path, &Track)> {
        let path = self.path.iter().map(|path| (&*path.file, &path.track));
        let walls = self.motion.iter().map(|motion| (&*motion.file, &motion.track));
        path.chain(walls).filter_map(|(file, track)| Some((file, &**track.as_ref()?)))
    }

    /// Warnings, with codes, of the defects of all recordings that move the supports, each with the name of its file in
    /// front.
    pub(crate) fn recording_warnings(&self) -> Vec<(Code, String)> {
        self.recordings().flat_map(|(file, track)| track.warnings(file)).collect()
    }

    /// Rejects a simulation that ends more than a step after the end of any recording that has been read
    /// ([`Track::check_end`]).
    pub(super) fn check_end(&self, time: &Time) -> Result<(), Error> {
        self.recordings().try_for_each(|(file, track)| track.check_end(file, time))
    }

    /// Rejects invalid numbers, two rollers, a roller direction of no length or without a roller, and a compliance
    /// without a clamp. Rejects recorded ends without a recording, and a recording that neither an end nor an inner
    /// marker uses. Motions that their ends cannot have are errors. So are all motions of an end with free twist, and
    /// of a recorded end with fewer than two held markers.
    pub(crate) fn check(&self) -> Result<(), Error> {
        // Two rollers do not determine the position along their lines.
        if (self.start, self.end) == (Support::Roller, Support::Roller) {
            let allowed = "one roller, as a rod on two rollers can slide without resistance";
            return Err(Error::invalid("supports.end", "a second roller", allowed));
        }
        self.check_numbers("supports", TABLE)?;
        if let Some(roller) = &self.roller {
            direction("supports.roller", roller)?;
            if self.rolling().is_none() {
                let allowed = "with start = \"roller\" or end = \"roller\" only";
                return Err(Error::invalid("supports.roller", "no end that rolls", allowed));
            }
        }
        // A compliance without a clamp would be ignored: it is an error.
        for (key, end) in [("start_compliance", End::Start), ("end_compliance", End::End)] {
            let give = self.compliance(end);
            for (own, value) in [("rotation", give.rotation), ("axial", give.axial)] {
                if value != 0.0 && self.at(end) != Support::Clamped {
                    let key = format!("supports.{key}.{own}");
                    return Err(Error::invalid(key, value, "0, as that end has no clamp"));
                }
            }
        }
        // A recording needs a recorded end, and a recorded end a recording.
        let ends = [self.start, self.end];
        match &self.path {
            Some(path) => path.check(ends)?,
            None if ends.contains(&Support::Recorded) => {
                let allowed = "with the file of a recording for \"recorded\" ends";
                return Err(Error::invalid("supports.path", "no such table", allowed));
            }
            None => {}
        }
        for (i, motion) in self.motion.iter().enumerate() {
            let key = format!("supports.motion[{i}]");
            motion.check(&key, self.at(motion.end))?;
            if motion.pose.is_some() {
                self.check_pose(&key, i)?;
            }
            // A single held marker prescribes a position, and no edge that could turn.
            let held = self.path.as_ref().map_or(0, |path| path.held);
            // A free twist cannot be prescribed as well.
            if self.turns_freely(motion.end) {
                let found = "a twist of an end with free twist";
                let allowed = "ends that are not in supports.path.free_twist";
                return Err(Error::invalid(format!("{key}.twist"), found, allowed));
            }
            if self.at(motion.end) == Support::Recorded && held < 2 {
                let found = "a twist of an end with one held marker";
                let allowed = "supports.path.held = 2 or more, so that the twist rotates an edge";
                return Err(Error::invalid(format!("{key}.twist"), found, allowed));
            }
        }
        Ok(())
    }
    /// Rejects a second recorded pose of one end, and one beside `supports.path`. `key` is the path of the motion `i`,
    /// which has a pose.
    fn check_pose(&self, key: &str, i: usize) -> Result<(), Error> {
        let is_same = |motion: &Motion| motion.end == self.motion[i].end && motion.pose.is_some();
        if self.motion[..i].iter().any(is_same) {
            let allowed = "one recorded pose for each end";
            return Err(Error::invalid(format!("{key}.pose"), "a second one of that end", allowed));
        }
        match self.path {
            Some(_) => {
                let found = "a recorded pose beside supports.path";
                let allowed = "one of the two: recorded poses of clamped ends, or recorded markers";
                Err(Error::invalid(format!("{key}.pose"), found, allowed))
            }
            None => Ok(()),
        }
    }
}
