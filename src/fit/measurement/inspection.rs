//! Inspection of a marker file of a motion-capture or tracking program, before a fit (`rodfit inspect`).
//!
//! Input: a file, and its format, rate and scale as far as the user states them ([`Recording`]). Determined are its
//! format, its clock (unit, rate, gaps longer than [`STEP`] usual steps) and its unit of length. For each marker it
//! determines the axes, gaps, range, noise (from differences of the samples), single-frame jumps ([`JUMP`]) and
//! repeated frames, in the units of the file. Positions with a confidence below [`SURE`] are counted and taken for
//! missing. Three or more markers are tested for lost frames and swapped labels, as if along a rod, if unit and clock
//! are known. Output: [`Inspection`], with the `[[observation]]` table of a fit file that reads the marker with the
//! largest range of a coordinate. The table is checked by reading the file with it; an error is added as a comment.
//! Positions without a unit are taken as m; a largest absolute coordinate above [`FAR`] is then implausible.

use crate::error::Error;
use crate::fit::measurement::motion::Observation;
use crate::fit::measurement::repeated_frames::count_repeated_frames;
use crate::input::onset::onset_of_motion;
use crate::numerics::noise_scale::NoisySeries;
use crate::numerics::upper_median;
use crate::scene::{LostFrames, SwappedLabels, Track};
use marker_files::table::TIMES;
use marker_files::{Clock, Format, LengthUnit, MarkerData, MarkerFile, Recording, Vertical};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::ops::Range;
use std::path::{Path, PathBuf};

/// Smallest confidence of a position that counts as detected; also the proposed `likelihood` of the observation.
const SURE: f64 = 0.6;
/// Smallest step of the clock that is a gap, over the usual step. A smaller ratio reports the jitter of a clock as
/// gaps.
const STEP: f64 = 1.5;
/// Smallest deviation of a jump from the cubic through its neighbors: over the median deviation of all frames, and over
/// the deviations a few frames away.
const JUMP: [f64; 2] = [10.0, 4.0];
/// Largest plausible coordinate, m, in a file without a unit. Larger ones are most likely in pixels or millimeters.
pub(super) const FAR: f64 = 20.0;

/// Result of the inspection of a marker file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Inspection {
    /// The file.
    pub file: PathBuf,
    /// Program that wrote the file.
    pub format: Format,
    /// Number of frames.
    pub frames: usize,
    /// Frames per second, from the file or from the usual step of the clock; none without both.
    pub rate: Option<f64>,
    /// First and last reading of the clock, in its unit.
    pub clock: [f64; 2],
    /// Unit of the clock: `s`, `ms`, `us`, `ns` or `frames`.
    pub clock_unit: String,
    /// Gaps of the clock: the reading before the gap, and the number of missing steps.
    pub clock_gaps: Vec<(f64, usize)>,
    /// Unit of the positions: `m`, `cm`, `mm`, `um`, `px`, or `unnamed`.
    pub unit: String,
    /// The markers, in the order of the file.
    pub markers: Vec<InspectedMarker>,
    /// Lost frames and swapped labels, if the markers are along a rod in this order.
    pub faults: Vec<String>,
    /// Interpretation of the file by an observation of the marker that moves most. Keys without a value in the file or
    /// in the given recording are none.
    pub recording: Recording,
    /// The `[[observation]]` table of a fit file with this interpretation.
    pub observation: String,
}

/// Result of the inspection for one marker.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct InspectedMarker {
    /// Name of the marker; empty in a table of one.
    pub name: String,
    /// The recorded axes: `xy`, `xyz`.
    pub axes: String,
    /// Number of frames with a position, complete or partial, of sufficient confidence.
    pub detected: usize,
    /// Number of gaps between frames with a position, and number of frames of the longest gap.
    pub gaps: [usize; 2],
    /// Number of frames with a confidence below 0.6; null in files without confidences.
    pub low_confidence: Option<usize>,
    /// Smallest and largest coordinate along each of its axes, in the file's unit; none without positions.
    pub range: Vec<Option<[f64; 2]>>,
    /// Standard deviation of the noise per coordinate, by differences of the positions, in the file's unit. It is an
    /// upper bound, because fast motion adds to it. None where differences do not determine it, as with fewer than 20
    /// positions or in smoothed data.
    pub noise: Option<f64>,
    /// Clock readings at which the marker jumps for one frame.
    pub jumps: Vec<f64>,
    /// Number of frames in motion that repeat the previous one exactly: a video that was converted to a higher rate.
    pub repeated: usize,
}

impl Inspection {
    /// Inspects a file: format, clock with gaps, unit, markers, faults along a rod, and an `[[observation]]` table that
    /// reads the marker that moves most. `recording` may have the format, and the `fps` and `scale` that the file
    /// lacks. The rate is 1 over the median step of a clock in units of time, or that of the file or `fps` for a clock
    /// of frame numbers. Scale and rate that are still unknown are `..` in the table. If a fit cannot read the file
    /// with the table, the error is added to it as a comment.
    ///
    /// # Errors
    ///
    /// A file that cannot be read, or a line of it that makes no sense, with its number.
    pub fn of(path: impl AsRef<Path>, recording: &Recording) -> Result<Self, Error> {
        let path = path.as_ref();
        let source = marker_files::load(path, recording)?;
        let format = source.format;
        let clocks: Vec<f64> = source.frames.iter().map(|row| row.clock).collect();
        let step = upper_median(clocks.windows(2).map(|w| w[1] - w[0]));
        // Times give the rate by their usual step; frame numbers need it from the file or the user.
        let (clock_unit, rate) = match source.clock {
            Clock::Time(unit) => {
                let name = TIMES.iter().find(|(_, own)| *own == unit).map_or("s", |(name, _)| name);
                (name, step.map(|step| 1.0 / (step * unit)))
            }
            Clock::Frames { rate, .. } => ("frames", rate.or(recording.fps)),
        };
        let gap = |w: &[f64]| {
            let steps = (w[1] - w[0]) / step.filter(|s| *s > 0.0)?;
            (steps > STEP).then(|| (w[0], (steps.round() as usize).saturating_sub(1).max(1)))
        };
        let markers: Vec<InspectedMarker> =
            source.markers.iter().map(|marker| inspect_marker(marker, &clocks, step)).collect();
        // The observation is proposed from the markers, and read once, so that the user gets its errors.
        let mut inspection = Self {
            file: path.into(),
            format,
            frames: clocks.len(),
            rate,
            clock: [clocks[0], clocks[clocks.len() - 1]],
            clock_unit: clock_unit.into(),
            clock_gaps: clocks.windows(2).filter_map(gap).collect(),
            unit: match source.lengths {
                LengthUnit::Known(unit, _) => unit,
                LengthUnit::Pixels { .. } => "px",
                LengthUnit::Calibrated => "unnamed",
            }
            .into(),
            markers,
            faults: faults(&source, recording),
            recording: recording.clone(),
            observation: String::new(),
        };
        inspection.recording = inspection.interpretation(&source, recording);
        inspection.observation =
            inspection.observation_table(&quoted(&path.display().to_string()), &source);
        if let Err(error) = check_observation(path, &inspection.observation) {
            let error = error.to_string().replace('\n', " ");
            inspection.observation += &format!("# `rodfit fit` rejects these keys: {error}\n");
        }
        Ok(inspection)
    }

    /// The detected marker with the largest range of any coordinate, which is most likely at the tip; `None` if none
    /// was detected.
    fn most_moving_marker(&self) -> Option<&InspectedMarker> {
        let extent =
            |m: &&InspectedMarker| m.range.iter().flatten().map(|[a, b]| b - a).fold(0.0, f64::max);
        let detected = self.markers.iter().filter(|m| m.detected > 0);
        detected.max_by(|a, b| extent(a).total_cmp(&extent(b)))
    }

    /// The largest magnitude of a coordinate of all markers, in the file's unit; zero without positions.
    pub(super) fn largest_coordinate(&self) -> f64 {
        let ranges = self.markers.iter().flat_map(|m| m.range.iter().flatten().flatten());
        ranges.fold(0.0, |most, x| most.max(x.abs()))
    }

    /// The `given` recording completed for the file `source`. The marker that moves most is named if there are several.
    /// The confidence threshold is [`SURE`] if the file has confidences. y points down in image coordinates unless
    /// given. Time zero, given or not, is the frame nearest to the onset of motion, or an
    /// [assumed](Self::start_without_rest) one. Other keys of `given` stay.
    fn interpretation(&self, source: &MarkerFile, given: &Recording) -> Recording {
        let marker = self.most_moving_marker();
        let onset = marker.and_then(|m| onset(source, &m.name));
        Recording {
            marker: marker.filter(|_| self.markers.len() > 1).map(|m| m.name.clone()),
            likelihood: marker.and_then(|m| m.low_confidence).map(|_| SURE),
            y: given.y.or(self.has_image_coordinates(source).then_some(Vertical::Down)),
            time_zero: Some(onset.unwrap_or_else(|| self.start_without_rest())),
            ..given.clone()
        }
    }

    /// Assumed start of the motion of a marker that never rests: 0, where the clock starts less than two usual steps
    /// after it, else the first reading, in the unit of the clock.
    fn start_without_rest(&self) -> f64 {
        let [first, last] = self.clock;
        let step = (last - first) / self.frames.saturating_sub(1).max(1) as f64;
        if (0.0..=2.0 * step).contains(&first) { 0.0 } else { first }
    }

    /// Whether y points down as in an image: coordinates in pixels that are not stated to point up, or a file of
    /// TrackMate.
    fn has_image_coordinates(&self, source: &MarkerFile) -> bool {
        let pixels = matches!(source.lengths, LengthUnit::Pixels { down: None | Some(true) });
        pixels || self.format == Format::TrackMate
    }

    /// The `[[observation]]` table for `source` as TOML text. Its keys are file, format and columns if given, marker
    /// (if there are several), point (the tip), likelihood, and axes of a spatial marker. Frame rate and scale that the
    /// file lacks, y as stated or in image coordinates, origin, time zero and sigma (noise, m) follow. A frame rate or
    /// scale that neither file nor user state is `..`, to be filled in. Sigma is omitted if the noise is unknown or
    /// zero, or without a factor to meters. `file` is the name of the file as a TOML string.
    fn observation_table(&self, file: &str, source: &MarkerFile) -> String {
        let read = &self.recording;
        let mut lines = vec!["[[observation]]".to_string()];
        let mut line = |key: &str, value: String, words: &str| {
            let words = if words.is_empty() { String::new() } else { format!(" # {words}") };
            lines.push(format!("{:<27}{words}", format!("{key} = {value}")).trim_end().into());
        };
        // Keys of the file first: its format is stated only if the user stated one.
        line("file", file.into(), "");
        if read.format.is_some() {
            line("format", quoted(self.format.key()), "");
        }
        if let Some(columns) = &read.columns {
            line("columns", columns.to_string(), "");
        }
        if let Some(marker) = &read.marker {
            let others: Vec<&str> = self.markers.iter().map(|m| &m.name[..]).collect();
            line(
                "marker",
                quoted(marker),
                &format!("the marker with the largest motion of {}", others.join(", ")),
            );
        }
        // The place on the rod is unknown to the file; the tip is the default of an observation.
        line("point", "\"tip\"".into(), "or a node, or { arc_length = 0.2 }");
        if let Some(sure) = read.likelihood {
            line("likelihood", sure.to_string(), "positions with a lower likelihood are left out");
        }
        if self.most_moving_marker().is_some_and(|m| m.axes.len() == 3) {
            let words = "axes of the file that are x, y, z of the scene, such as [\"x\", \"z\", \
                         \"-y\"]";
            line("axes", "[\"x\", \"y\", \"z\"]".into(), words);
        }
        let or_dots = |value: Option<f64>| value.map_or("..".into(), |value| value.to_string());
        // Values that the file lacks are those given by the user, or dots to fill in.
        if matches!(source.clock, Clock::Frames { rate: None, .. }) {
            line("fps", or_dots(read.fps), "frames per second of the camera; not in the file");
        }
        let meters = match source.lengths {
            LengthUnit::Known(_, factor) => Some(factor),
            LengthUnit::Pixels { .. } => {
                line("scale", or_dots(read.scale), "m per pixel");
                read.scale
            }
            LengthUnit::Calibrated => {
                line(
                    "scale",
                    or_dots(read.scale),
                    "m per unit of the calibration; 1 if it is in \
                      m",
                );
                read.scale
            }
        };
        match read.y {
            Some(Vertical::Down) => line("y", "\"down\"".into(), "y points down, as in images"),
            Some(Vertical::Up) => line("y", "\"up\"".into(), "y points up"),
            None => {}
        }
        // The origin and the start of the motion relate the file to the scene.
        line("origin", "[0, 0, 0]".into(), "origin of the scene in coordinates of the file");
        let zero = read.time_zero.unwrap_or_else(|| self.start_without_rest());
        let words = match zero > self.clock[0] {
            true => "time in the file at which the motion starts; the marker rests before",
            false => {
                "assumed time in the file at which the motion starts: the marker does not rest before it"
            }
        };
        line("time_zero", zero.to_string(), words);
        // The noise is stated only with a factor to meters.
        let noise = self.most_moving_marker().and_then(|m| m.noise).filter(|noise| *noise > 0.0);
        if let (Some(noise), Some(meters)) = (noise, meters) {
            line(
                "sigma",
                format!("{:.1e}", noise * meters),
                "m, estimated from differences of \
                  the samples",
            );
        }
        lines.join("\n") + "\n"
    }
}

/// Clock reading of the frame nearest to the onset (change point) of the motion of the marker with this `name`, by its
/// positions of sufficient confidence. `None` if there is no such marker, or no onset was found, as of a marker that
/// moves from the first frame on.
fn onset(source: &MarkerFile, name: &str) -> Option<f64> {
    let marker = confident_positions(source.markers.iter().find(|m| m.name == name)?);
    let clocks: Vec<f64> = source.frames.iter().map(|row| row.clock).collect();
    let onset = onset_of_motion(&clocks, &marker.positions)?;
    clocks.into_iter().min_by(|a, b| (a - onset).abs().total_cmp(&(b - onset).abs()))
}

/// Reads the file at `path` with the keys of an `[[observation]]` table other than sigma, with 1 for the values that
/// the user has to fill in. An error if the keys or the file are invalid.
fn check_observation(path: &Path, observation: &str) -> Result<(), Error> {
    let text = observation.replace("= ..", "= 1.0");
    let written: Result<BTreeMap<String, Vec<toml::Table>>, _> = toml::from_str(&text);
    let recording =
        written.map_err(|error| Error::Fit(error.to_string())).and_then(|mut tables| {
            let mut keys =
                tables.remove("observation").and_then(|mut all| all.pop()).unwrap_or_default();
            // The sigma of an observation may be a number, that of a recording is a column.
            keys.remove("sigma");
            keys.try_into::<Recording>().map_err(|error| Error::Fit(error.to_string()))
        })?;
    Observation::read_as(path, &recording).map(|_| ())
}

/// A text as a quoted and escaped TOML string.
fn quoted(text: &str) -> String {
    toml::Value::String(text.into()).to_string()
}

/// Whether the confidence of a position is missing or below [`SURE`].
fn is_uncertain(confidence: &Option<f64>) -> bool {
    confidence.is_none_or(|confidence| confidence < SURE)
}

/// A copy of the marker whose positions with a missing confidence or one below [`SURE`] are `None`; unchanged without
/// confidences.
fn confident_positions(marker: &MarkerData) -> MarkerData {
    let mut marker = marker.clone();
    let confidences = marker.likelihood.iter().flatten();
    for (position, confidence) in marker.positions.iter_mut().zip(confidences) {
        if is_uncertain(confidence) {
            *position = [None; 3];
        }
    }
    marker
}

/// The properties of one marker in the file: axes, detected frames, gaps, confidences, ranges, noise (root mean square
/// over the axes), jumps and repeated frames. `clocks` are the clock readings of all frames, and `step` is the usual
/// one between frames.
fn inspect_marker(marker: &MarkerData, clocks: &[f64], step: Option<f64>) -> InspectedMarker {
    let marker = &confident_positions(marker);
    // Frames next to a gap of the clock are not compared.
    let has_no_gap = |frames: Range<usize>| {
        let most = STEP * step.unwrap_or(f64::INFINITY);
        clocks[frames].windows(2).all(|w| w[1] - w[0] < most)
    };
    let detected: Vec<bool> =
        marker.positions.iter().map(|position| position.iter().any(Option::is_some)).collect();
    let first = detected.iter().position(|own| *own).unwrap_or(0);
    let last = detected.iter().rposition(|own| *own).map_or(0, |k| k + 1);
    let lost = detected[first..last.max(first)].chunk_by(|a, b| a == b).filter(|run| !run[0]);
    let lost: Vec<usize> = lost.map(<[bool]>::len).collect();
    let axes: Vec<usize> = (0..3).filter(|c| marker.axes[*c]).collect();
    let along = |c: usize| marker.positions.iter().map(move |position| position[c]);
    let range = |c: &usize| {
        let ends = along(*c).flatten().map(|x| [x, x]);
        ends.reduce(|[a, b], [x, y]| [a.min(x), b.max(y)])
    };
    // Pooled over the axes; constant axes have no noise.
    let variances: Vec<f64> =
        axes.iter().filter_map(|c| Some(noise(clocks, along(*c))?.powi(2))).collect();
    let variance = variances.iter().sum::<f64>() / variances.len() as f64;
    let confidences = marker.likelihood.as_ref();
    InspectedMarker {
        name: marker.name.clone(),
        axes: axes.iter().map(|c| ["x", "y", "z"][*c]).collect(),
        detected: detected.iter().filter(|own| **own).count(),
        gaps: [lost.len(), lost.iter().copied().max().unwrap_or(0)],
        low_confidence: confidences.map(|all| all.iter().filter(|c| is_uncertain(c)).count()),
        range: axes.iter().map(range).collect(),
        noise: (!variances.is_empty()).then(|| variance.sqrt()),
        jumps: jumps(marker, has_no_gap).into_iter().map(|k| clocks[k]).collect(),
        repeated: count_repeated_frames(&marker.positions),
    }
}

/// Standard deviation of the noise of one coordinate, in its unit, by differences of its values at the times `clocks`;
/// missing values are skipped. `None` where differences do not determine it, as of constant, smoothed or few values.
fn noise(clocks: &[f64], coordinate: impl Iterator<Item = Option<f64>>) -> Option<f64> {
    let observed = clocks.iter().zip(coordinate).filter_map(|(t, x)| Some((*t, x?)));
    let (times, values): (Vec<f64>, Vec<f64>) = observed.unzip();
    let series = NoisySeries { times: &times, values: &values, factors: &[], excluded: &[] };
    Some(series.noise().ok()?.sigma)
}

/// Indices of frames in which a marker jumps, by the deviation of each frame from the cubic through the two positions
/// on each side. In a jump it exceeds the deviations of the two frames on each side. It also exceeds the first [`JUMP`]
/// times the (upper) median of all frames, and the second [`JUMP`] times the largest deviation of the frames three and
/// four away. Frames for which `has_no_gap` is false, next to a gap of the clock, and frames without all five positions
/// are left out.
fn jumps(marker: &MarkerData, has_no_gap: impl Fn(Range<usize>) -> bool) -> Vec<usize> {
    // The cubic through the positions at k-2, k-1, k+1 and k+2, evaluated at k: weights -1, 4, 4, -1 over 6.
    let deviation = |k: usize| -> Option<f64> {
        let mut squares = 0.0;
        for c in (0..3).filter(|c| marker.axes[*c]) {
            let at = |k: usize| marker.positions[k][c];
            let between = (4.0 * (at(k - 1)? + at(k + 1)?) - at(k - 2)? - at(k + 2)?) / 6.0;
            squares += (at(k)? - between).powi(2);
        }
        Some(squares.sqrt())
    };
    let frames = marker.positions.len();
    // A gap of the clock within the five frames would be counted as a jump.
    let is_inner = |k: usize| k >= 2 && k + 2 < frames && has_no_gap(k - 2..k + 3);
    let all: Vec<Option<f64>> =
        (0..frames).map(|k| if is_inner(k) { deviation(k) } else { None }).collect();
    let Some(usual) = upper_median(all.iter().copied().flatten()) else { return Vec::new() };
    let nearby = |k: usize| {
        // A jump makes the two frames on each side deviate too.
        let beside = [k.checked_sub(4), k.checked_sub(3), Some(k + 3), Some(k + 4)];
        beside.into_iter().flatten().filter_map(|k| *all.get(k)?).fold(0.0, f64::max)
    };
    let is_jump = |k: &usize| {
        let Some(own) = all[*k] else { return false };
        let near = (k.saturating_sub(2)..=k + 2).filter(|other| other != k);
        let most = near.filter_map(|other| *all.get(other)?).fold(0.0, f64::max);
        own > most && own > JUMP[0] * usual && own > JUMP[1] * nearby(*k)
    };
    (0..frames).filter(is_jump).collect()
}

/// Lost frames and swapped labels, one text each, of the markers in the order of the file, as if along a rod. The
/// motion of all markers determines gaps, and positions without all of the marker's axes count as missing. Empty for
/// fewer than three markers, for a unit or clock that `recording` does not convert, and for markers that form no track.
fn faults(source: &MarkerFile, recording: &Recording) -> Vec<String> {
    // Only the conversion to s and m matters for the tests, not the choice of a marker.
    let known = Recording {
        fps: recording.fps,
        scale: recording.scale,
        y: recording.y.or(Some(Vertical::Up)),
        ..Recording::default()
    };
    let along = |marker: &MarkerData| {
        let converted = known.convert(source, marker).ok()?;
        let whole = |position: &[Option<f64>; 3]| {
            let is_whole = (0..3).all(|c| position[c].is_some() == marker.axes[c]);
            is_whole.then(|| position.map(Option::unwrap_or_default))
        };
        let times = converted.times.iter().map(|(_, t)| *t).collect();
        Some((times, converted.positions.iter().map(whole).collect()))
    };
    // The tests of recordings along a rod need the motion of all markers, in one unit.
    let Some(all) = source.markers.iter().map(along).collect::<Option<Vec<_>>>() else {
        return Vec::new();
    };
    let Some((times, _)) = all.first().cloned().filter(|_| all.len() > 2) else {
        return Vec::new();
    };
    let names = source.markers.iter().map(|m| m.name.clone());
    let markers = names.zip(all.into_iter().map(|(_, positions)| positions)).collect();
    let Ok(track) = Track::new(times, markers) else { return Vec::new() };
    let held: Vec<usize> = (0..track.markers().len()).collect();
    let examined = track.examined(&held, LostFrames::Keep, SwappedLabels::Keep);
    examined.faults().iter().map(ToString::to_string).collect()
}
