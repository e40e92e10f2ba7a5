//! `[recording]` of a structure: the recorded markers that drive recorded supports and that fits observe.
//!
//! The table names a file, its format, and the points of observed markers; recorded supports name the markers that they
//! follow. `StructureRecording::read` reads the positions of both as one [`Track`]: markers of supports first, then
//! observed ones. A given track is used instead of the file. One that has not been examined gets its defects, and lost
//! frames and exchanged labels are corrected as the settings request. Missing frames and jumps are found in the markers
//! that drive supports.
//!
//! `check_end` and `check_step` reject a simulation beyond the end of the recording and steps that do not resolve its
//! motion. `recording_warnings` and `step_warning` are those of its defects and of large steps. All have the
//! limits of `[supports.path]` of one rod, and no effect unless a support follows the recording.

use crate::code::Code;
use crate::error::Error;
use crate::scene::faults::{LostFrames, SwappedLabels};
use crate::scene::motion_rate::MotionRate;
use crate::scene::number::is_default;
use crate::scene::path::Recorded;
use crate::scene::structure_point::StructurePoint;
use crate::scene::structure_support::StructureSupport;
use crate::scene::supports::Supports;
use crate::scene::time::Time;
use crate::scene::track::Track;
use crate::scene::track_defect::TrackDefect;
use marker_files::{Axes, Format, Recording, Vertical, is_same_name};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// `[recording]`: recorded markers of a structure. Recorded supports follow some of them, the others are observed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct StructureRecording {
    /// Recording: a CSV file with a clock `t` and columns `xA, yA, zA` for every marker `A`, or a file of another
    /// [program](Format), relative to the scene file.
    pub file: PathBuf,
    /// Points of the observed markers, by their names.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub markers: BTreeMap<String, StructurePoint>,
    /// Program that wrote the file; default: determined from the first bytes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub format: Option<Format>,
    /// Confidence below which positions are treated as missing.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub likelihood: Option<f64>,
    /// Axes of the file that are the world's x, y and z.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub axes: Option<Axes>,
    /// Frames per second, Hz, for files with frame numbers only.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fps: Option<f64>,
    /// Meters per pixel, or per length unit where the file states none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scale: Option<f64>,
    /// Direction of the file's y axis.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub y: Option<Vertical>,
    /// Time on the file's own clock, in its unit, at which the motion starts.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub time_zero: Option<f64>,
    /// Treatment of lost frames.
    #[serde(default, skip_serializing_if = "is_default")]
    pub lost_frames: LostFrames,
    /// Treatment of exchanged labels of neighboring markers.
    #[serde(default, skip_serializing_if = "is_default")]
    pub swapped_labels: SwappedLabels,
    /// The recording, once it is read.
    #[serde(skip)]
    pub track: Option<Arc<Track>>,
}

/// Whether any of the supports names a marker, which it follows.
fn is_followed(supports: &[StructureSupport]) -> bool {
    supports.iter().any(|support| !support.markers.is_empty())
}

/// Whether any of the supports follows the marker of this name; names are compared by `is_same_name`.
fn is_driving(marker: &str, supports: &[StructureSupport]) -> bool {
    let mut names = supports.iter().flat_map(|support| &support.markers);
    names.any(|name| is_same_name(name, marker))
}

impl StructureRecording {
    /// A recording of a file, which is not read yet, without observed markers.
    pub fn new(file: impl Into<PathBuf>) -> Self {
        Self {
            file: file.into(),
            markers: BTreeMap::new(),
            format: None,
            likelihood: None,
            axes: None,
            fps: None,
            scale: None,
            y: None,
            time_zero: None,
            lost_frames: LostFrames::Keep,
            swapped_labels: SwappedLabels::Keep,
            track: None,
        }
    }

    /// A recording that is given as a track instead of a file, without observed markers and corrections.
    pub fn of(track: Track) -> Self {
        Self { track: Some(track.into()), ..Self::new("") }
    }

    /// Reads the markers of recorded `supports` and the observed ones from the file, relative to `folder`, unless there
    /// is a track. If the track has not been examined, its defects are found, and lost frames and exchanged labels
    /// corrected as the settings request.
    ///
    /// # Errors
    /// A file that cannot be read, and markers that it does not have.
    pub(crate) fn read(
        &mut self,
        folder: &Path,
        supports: &[StructureSupport],
    ) -> Result<(), Error> {
        let mut names: Vec<String> = Vec::new();
        let driving = supports.iter().flat_map(|support| &support.markers);
        for name in driving.chain(self.markers.keys()) {
            if !names.iter().any(|known| is_same_name(known, name)) {
                names.push(name.clone());
            }
        }
        let track = match self.track.take() {
            Some(track) => track,
            None => {
                let file = marker_files::file::at(folder, &self.file);
                Arc::new(Track::read_as(&file, &self.settings(), &names)?)
            }
        };
        self.track = Some(track.clone());
        if !track.is_examined() {
            let markers = track.markers().iter().enumerate();
            let held: Vec<usize> = markers
                .filter(|(_, own)| is_driving(&own.name, supports))
                .map(|(j, _)| j)
                .collect();
            let examined =
                track.examined_of_structure(&held, self.lost_frames, self.swapped_labels);
            self.track = Some(examined.with_motion_defects(&held).into());
        }
        Ok(())
    }

    /// Examines a track that was given instead of a file, as [`read`](Self::read) does. No effect without a track.
    pub(crate) fn examine(&mut self, supports: &[StructureSupport]) -> Result<(), Error> {
        if self.track.is_some() { self.read(Path::new(""), supports) } else { Ok(()) }
    }

    /// Positions, m, of the markers that recorded `supports` follow, marker by marker at all frames; missing ones are
    /// left out. Empty before the recording is read.
    pub(crate) fn driving_positions(
        &self,
        supports: &[StructureSupport],
    ) -> impl Iterator<Item = [f64; 3]> {
        let markers = self.track.iter().flat_map(|track| track.markers());
        let driving = markers.filter(move |marker| is_driving(&marker.name, supports));
        driving.flat_map(|marker| marker.seen.iter().copied().flatten())
    }

    /// Rejects a simulation that ends more than a step after the recording, as [`Supports::check_end`]. Accepted before
    /// the recording is read, and where no support follows it.
    pub(crate) fn check_end(
        &self,
        supports: &[StructureSupport],
        time: &Time,
    ) -> Result<(), Error> {
        self.as_supports(supports).map_or(Ok(()), |own| own.check_end(time))
    }

    /// Rejects a time step, s, that does not resolve the motion of the markers that `supports` follow
    /// (`MotionRate::check`). Accepted without such markers, before the recording is read, and for markers at rest.
    pub(crate) fn check_step(&self, supports: &[StructureSupport], step: f64) -> Result<(), Error> {
        self.rate(supports).map_or(Ok(()), |rate| rate.check(step))
    }

    /// Warnings, with codes, of the defects of the recording, corrected or not, with the name of its file in front.
    /// Empty before it is read, and where no support follows it. Glitches of observed markers are left out.
    pub(crate) fn recording_warnings(&self, supports: &[StructureSupport]) -> Vec<(Code, String)> {
        let Some(track) = self.track.as_ref().filter(|_| is_followed(supports)) else {
            return Vec::new();
        };
        let matters = |fault: &&TrackDefect| match fault {
            TrackDefect::Glitches { marker, .. } => is_driving(marker, supports),
            _ => true,
        };
        let faults = track.faults().iter().filter(matters).cloned().collect();
        Track::clone(track).with_faults(faults).warnings(&self.file)
    }

    /// The warning, with its code, of a time step, s, that resolves the motion of the markers that `supports` follow
    /// poorly (`MotionRate::warning`). None for smaller steps, without such markers, and for markers at rest.
    pub(crate) fn step_warning(
        &self,
        supports: &[StructureSupport],
        step: f64,
    ) -> Option<(Code, String)> {
        self.rate(supports)?.warning(step)
    }

    /// Supports of one rod whose path is this recording, for their checks. `None` before the recording is read, and
    /// unless a support follows it.
    fn as_supports(&self, supports: &[StructureSupport]) -> Option<Supports> {
        let track = self.track.clone().filter(|_| is_followed(supports))?;
        let path = Recorded { track: Some(track), ..Recorded::new(&self.file) };
        Some(Supports { path: Some(path), ..Supports::default() })
    }

    /// Rate of the motion of the markers that `supports` follow, by its bandwidth. `None` without a support that
    /// follows them, before the examination, and at rest.
    fn rate(&self, supports: &[StructureSupport]) -> Option<MotionRate> {
        let bandwidth = self.track.as_ref().filter(|_| is_followed(supports))?.bandwidth()?;
        Some(MotionRate::from_bandwidth("recording.file".into(), "recorded motion", bandwidth))
    }

    /// The settings of the table (format, confidence, axes, rate, scale, direction of y, start time) for the reader
    /// `marker_files`.
    fn settings(&self) -> Recording {
        let Self { format, likelihood, axes, fps, scale, y, time_zero, .. } = *self;
        Recording { format, likelihood, axes, fps, scale, y, time_zero, ..Recording::default() }
    }

    /// The track of the recording: the positions of its markers.
    ///
    /// # Errors
    /// A recording that has not been read.
    pub(crate) fn track(&self) -> Result<&Arc<Track>, Error> {
        self.track.as_ref().ok_or_else(|| {
            let found = format!("{}, which has not been read", self.file.display());
            Error::invalid("recording.file", found, "the recording of a loaded structure")
        })
    }

    /// Index of the marker `name` in the track. An error with `key` for a name that the track does not have, and for a
    /// recording that has not been read.
    pub(crate) fn marker(&self, key: &str, name: &str) -> Result<usize, Error> {
        let markers = self.track()?.markers();
        markers.iter().position(|marker| is_same_name(&marker.name, name)).ok_or_else(|| {
            let names: Vec<&str> = markers.iter().map(|marker| &marker.name[..]).collect();
            Error::invalid(key, format!("\"{name}\""), format!("one of {}", names.join(", ")))
        })
    }
}
