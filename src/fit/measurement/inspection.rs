//! What is in a file of markers, before anything is made of it.

use crate::error::Error;
use crate::fit::measurement::motion::Observation;
use crate::fit::measurement::repeated_frames::count_repeated_frames;
use crate::input::onset::onset_of_motion;
use crate::numerics::noise_scale::NoisySeries;
use crate::scene::{LostFrames, SwappedLabels, Track};
use marker_files::Format;
use marker_files::{Clock, LengthUnit, MarkerData, MarkerFile};
use marker_files::{Recording, Vertical};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::ops::Range;
use std::path::{Path, PathBuf};

/// Below this a program is not sure of a place.
const SURE: f64 = 0.6;
/// A step of the clock is a gap if it is so many times the usual one.
const STEP: f64 = 1.5;
/// A place jumps if it is off its neighbours' cubic by so many times the median, and by so many times what places a
/// few frames away are.
const JUMP: [f64; 2] = [10.0, 4.0];
/// Where no header says otherwise, places farther off than this, m, are more likely in pixels or millimetres.
pub(super) const FAR: f64 = 20.0;

/// What is in a file of markers.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Inspection {
    /// The file.
    pub file: PathBuf,
    /// Which program wrote it.
    pub format: Format,
    /// Number of frames.
    pub frames: usize,
    /// Frames a second: as the file says, or the clock's usual step; none where neither is there.
    pub rate: Option<f64>,
    /// First and last reading of its clock, in its unit.
    pub clock: [f64; 2],
    /// What the clock counts: `s`, `ms`, `us` or `frames`.
    pub clock_unit: String,
    /// Gaps of the clock: the reading before the gap, and the number of missing steps.
    pub clock_gaps: Vec<(f64, usize)>,
    /// Unit of places: `m`, `cm`, `mm`, `px`, or `unnamed`.
    pub unit: String,
    /// The markers, in the order of the file.
    pub markers: Vec<InspectedMarker>,
    /// What seems wrong if the markers stand along a rod in this order.
    pub faults: Vec<String>,
    /// How an observation reads it: the marker that moves most, from the first frame on. What the file does not say
    /// and nobody said is none.
    pub recording: Recording,
    /// That observation for a fit file.
    pub observation: String,
}

/// A marker.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct InspectedMarker {
    /// Its name; empty in a table of one.
    pub name: String,
    /// The axes that were recorded: `xy`, `xyz`.
    pub axes: String,
    /// Number of frames with a position, complete or partial, of sufficient confidence.
    pub detected: usize,
    /// How often it is lost between two frames in which it was seen, and for how many frames at most.
    pub gaps: [usize; 2],
    /// Number of frames with a confidence below 0.6; null in files without confidences.
    pub low_confidence: Option<usize>,
    /// Smallest and largest coordinate along each of its axes, in the file's unit; none where it was never seen.
    pub range: Vec<Option<[f64; 2]>>,
    /// Standard deviation of the noise per coordinate, by differences of the places, in the file's unit: at most that, as
    /// fast motion adds to it. None where differences do not show it, as with fewer than 20 or in smoothed data.
    pub noise: Option<f64>,
    /// Clock readings at which it jumps for a frame.
    pub jumps: Vec<f64>,
    /// Frames in motion that repeat the one before to the last digit: a video that was converted to a higher rate.
    pub repeated: usize,
}

impl Inspection {
    /// Looks into a file; `recording` may say its format, and the `fps` and `scale` that it does not.
    ///
    /// # Errors
    ///
    /// A file that cannot be read, or a line of it that makes no sense, with its number.
    pub fn of(path: impl AsRef<Path>, recording: &Recording) -> Result<Self, Error> {
        Self::of_file(path.as_ref(), recording)
    }

    fn of_file(path: &Path, recording: &Recording) -> Result<Self, Error> {
        let (format, bytes) = marker_files::open(path, recording.format)?;
        let source = marker_files::parse(path, format, &bytes)?;
        let clocks: Vec<f64> = source.frames.iter().map(|row| row.clock).collect();
        let step = median(clocks.windows(2).map(|w| w[1] - w[0]).collect());
        let (clock_unit, rate) = match source.clock {
            Clock::Time(unit) => {
                let named = [("s", 1.0), ("ms", 1e-3), ("us", 1e-6)];
                let name = named.iter().find(|(_, own)| *own == unit).map_or("s", |(name, _)| name);
                (name, step.map(|step| 1.0 / (step * unit)))
            }
            Clock::Frames { rate, .. } => ("frames", rate.or(recording.fps)),
        };
        let leap = |w: &[f64]| {
            let steps = (w[1] - w[0]) / step.filter(|s| *s > 0.0)?;
            (steps > STEP).then(|| (w[0], (steps.round() as usize).saturating_sub(1).max(1)))
        };
        let markers: Vec<InspectedMarker> =
            source.markers.iter().map(|marker| inspected(marker, &clocks, step)).collect();
        let mut inspection = Self {
            file: path.into(),
            format,
            frames: clocks.len(),
            rate,
            clock: [clocks[0], clocks[clocks.len() - 1]],
            clock_unit: clock_unit.into(),
            clock_gaps: clocks.windows(2).filter_map(leap).collect(),
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
        inspection.recording = inspection.read_as(&source, recording);
        inspection.observation = inspection.pasted(&quoted(&path.display().to_string()), &source);
        if let Err(error) = read_back(path, &inspection.observation) {
            let error = error.to_string().replace('\n', " ");
            inspection.observation += &format!("# fit does not read this: {error}\n");
        }
        Ok(inspection)
    }

    /// The marker that moves most: more likely a rod's tip than its wall.
    fn foremost(&self) -> Option<&InspectedMarker> {
        let extent =
            |m: &&InspectedMarker| m.range.iter().flatten().map(|[a, b]| b - a).fold(0.0, f64::max);
        let known = self.markers.iter().filter(|m| m.detected > 0);
        known.max_by(|a, b| extent(a).total_cmp(&extent(b)))
    }

    /// The largest coordinate, in the file's unit.
    pub(super) fn farthest(&self) -> f64 {
        let ranges = self.markers.iter().flat_map(|m| m.range.iter().flatten().flatten());
        ranges.fold(0.0, |most, x| most.max(x.abs()))
    }

    fn read_as(&self, source: &MarkerFile, said: &Recording) -> Recording {
        let marker = self.foremost();
        Recording {
            marker: marker.filter(|_| self.markers.len() > 1).map(|m| m.name.clone()),
            likelihood: marker.and_then(|m| m.low_confidence).map(|_| SURE),
            y: said.y.or(self.is_of_an_image(source).then_some(Vertical::Down)),
            time_zero: Some(marker.and_then(|m| onset(source, &m.name)).unwrap_or(self.clock[0])),
            ..said.clone()
        }
    }

    /// Whether y points down.
    fn is_of_an_image(&self, source: &MarkerFile) -> bool {
        let pixels = matches!(source.lengths, LengthUnit::Pixels { down: None | Some(true) });
        pixels || self.format == Format::TrackMate
    }

    /// The observation, of a file with this name as TOML writes it.
    fn pasted(&self, file: &str, source: &MarkerFile) -> String {
        let read = &self.recording;
        let mut lines = vec!["[[observation]]".to_string()];
        let mut line = |key: &str, value: String, words: &str| {
            let words = if words.is_empty() { String::new() } else { format!(" # {words}") };
            lines.push(format!("{:<27}{words}", format!("{key} = {value}")).trim_end().into());
        };
        line("file", file.into(), "");
        if read.format.is_some() {
            line("format", quoted(self.format.key()), "");
        }
        if let Some(marker) = &read.marker {
            let others: Vec<&str> = self.markers.iter().map(|m| &m.name[..]).collect();
            line(
                "marker",
                quoted(marker),
                &format!("the one that moves most of {}", others.join(", ")),
            );
        }
        line("point", "\"tip\"".into(), "or a node, or { arc_length = 0.2 }");
        if let Some(sure) = read.likelihood {
            line("likelihood", sure.to_string(), "what the program is less sure of is missing");
        }
        if self.foremost().is_some_and(|m| m.axes.len() == 3) {
            let words = "the world's in the file; [\"x\", \"z\", \"-y\"] for a picture of x and z";
            line("axes", "[\"x\", \"y\", \"z\"]".into(), words);
        }
        let or_dots = |value: Option<f64>| value.map_or("..".into(), |value| value.to_string());
        if matches!(source.clock, Clock::Frames { rate: None, .. }) {
            line("fps", or_dots(read.fps), "the camera's frames a second: the file does not say");
        }
        let metres = match source.lengths {
            LengthUnit::Known(_, factor) => Some(factor),
            LengthUnit::Pixels { .. } => {
                line("scale", or_dots(read.scale), "metres a pixel");
                read.scale
            }
            LengthUnit::Calibrated => {
                line("scale", or_dots(read.scale), "metres a unit of the calibration; 1 is metres");
                read.scale
            }
        };
        if self.is_of_an_image(source) {
            line("y", "\"down\"".into(), "as in images");
        }
        line("origin", "[0, 0, 0]".into(), "where the scene's origin is in the file's coordinates");
        let zero = read.time_zero.unwrap_or(self.clock[0]);
        let words = match zero > self.clock[0] {
            true => "the marker rests before: when the motion starts on the file's clock",
            false => "when the motion starts on the file's clock",
        };
        line("time_zero", zero.to_string(), words);
        let noise = self.foremost().and_then(|m| m.noise).filter(|noise| *noise > 0.0);
        if let (Some(noise), Some(metres)) = (noise, metres) {
            line("sigma", format!("{:.1e}", noise * metres), "m, by differences of the samples");
        }
        lines.join("\n") + "\n"
    }
}

/// Clock reading of the frame nearest to the onset of a marker's motion; none where it moves from the first frame on.
fn onset(source: &MarkerFile, name: &str) -> Option<f64> {
    let marker = sure(source.markers.iter().find(|m| m.name == name)?);
    let clocks: Vec<f64> = source.frames.iter().map(|row| row.clock).collect();
    let onset = onset_of_motion(&clocks, &marker.positions)?;
    clocks.into_iter().min_by(|a, b| (a - onset).abs().total_cmp(&(b - onset).abs()))
}

/// Reads the file as the observation that was printed says, with 1 for what only the user has.
fn read_back(path: &Path, observation: &str) -> Result<(), Error> {
    let text = observation.replace("= ..", "= 1.0");
    let written: Result<BTreeMap<String, Vec<toml::Table>>, _> = toml::from_str(&text);
    let recording =
        written.map_err(|error| Error::Fit(error.to_string())).and_then(|mut tables| {
            let mut keys =
                tables.remove("observation").and_then(|mut all| all.pop()).unwrap_or_default();
            // A number here, the name of a column in a recording.
            keys.remove("sigma");
            keys.try_into::<Recording>().map_err(|error| Error::Fit(error.to_string()))
        })?;
    Observation::read_as(path, &recording).map(|_| ())
}

/// As TOML writes it.
fn quoted(text: &str) -> String {
    toml::Value::String(text.into()).to_string()
}

fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied()
}

/// The marker where the program is sure of it.
fn sure(marker: &MarkerData) -> MarkerData {
    let mut marker = marker.clone();
    let unsure = |sure: &Option<f64>| sure.is_none_or(|sure| sure < SURE);
    for (place, sure) in marker.positions.iter_mut().zip(marker.likelihood.iter().flatten()) {
        if unsure(sure) {
            *place = [None; 3];
        }
    }
    marker
}

/// With a usual `step` of the clock: frames about a leap are not compared.
fn inspected(marker: &MarkerData, clocks: &[f64], step: Option<f64>) -> InspectedMarker {
    let marker = &sure(marker);
    let steady = |frames: Range<usize>| {
        let most = STEP * step.unwrap_or(f64::INFINITY);
        clocks[frames].windows(2).all(|w| w[1] - w[0] < most)
    };
    let there: Vec<bool> =
        marker.positions.iter().map(|place| place.iter().any(Option::is_some)).collect();
    let first = there.iter().position(|seen| *seen).unwrap_or(0);
    let last = there.iter().rposition(|seen| *seen).map_or(0, |k| k + 1);
    let lost = there[first..last.max(first)].chunk_by(|a, b| a == b).filter(|run| !run[0]);
    let lost: Vec<usize> = lost.map(<[bool]>::len).collect();
    let axes: Vec<usize> = (0..3).filter(|c| marker.axes[*c]).collect();
    let along = |c: usize| marker.positions.iter().map(move |place| place[c]);
    let range = |c: &usize| {
        let seen = along(*c).flatten().map(|x| [x, x]);
        seen.reduce(|[a, b], [x, y]| [a.min(x), b.max(y)])
    };
    // Pooled over the axes; constant ones have none.
    let variances: Vec<f64> =
        axes.iter().filter_map(|c| Some(noise(clocks, along(*c))?.powi(2))).collect();
    let variance = variances.iter().sum::<f64>() / variances.len() as f64;
    let unsure = marker.likelihood.as_ref();
    InspectedMarker {
        name: marker.name.clone(),
        axes: axes.iter().map(|c| ["x", "y", "z"][*c]).collect(),
        detected: there.iter().filter(|seen| **seen).count(),
        gaps: [lost.len(), lost.iter().copied().max().unwrap_or(0)],
        low_confidence: unsure
            .map(|all| all.iter().filter(|sure| sure.is_none_or(|s| s < SURE)).count()),
        range: axes.iter().map(range).collect(),
        noise: (!variances.is_empty()).then(|| variance.sqrt()),
        jumps: jumps(marker, steady).into_iter().map(|k| clocks[k]).collect(),
        repeated: count_repeated_frames(&marker.positions),
    }
}

/// Standard deviation of the noise on one axis by differences of its places; none where these do not show it.
fn noise(clocks: &[f64], places: impl Iterator<Item = Option<f64>>) -> Option<f64> {
    let seen = clocks.iter().zip(places).filter_map(|(t, x)| Some((*t, x?)));
    let (times, values): (Vec<f64>, Vec<f64>) = seen.unzip();
    let series = NoisySeries { times: &times, values: &values, factors: &[], excluded: &[] };
    Some(series.noise().ok()?.sigma)
}

/// Frames in which a marker is off the cubic through two places on each side of it, far more than usual and than a
/// few frames away.
fn jumps(marker: &MarkerData, steady: impl Fn(Range<usize>) -> bool) -> Vec<usize> {
    let off = |k: usize| -> Option<f64> {
        let mut squares = 0.0;
        for c in (0..3).filter(|c| marker.axes[*c]) {
            let at = |k: usize| marker.positions[k][c];
            let between = (4.0 * (at(k - 1)? + at(k + 1)?) - at(k - 2)? - at(k + 2)?) / 6.0;
            squares += (at(k)? - between).powi(2);
        }
        Some(squares.sqrt())
    };
    let frames = marker.positions.len();
    let all: Vec<Option<f64>> = (0..frames)
        .map(|k| if k >= 2 && k + 2 < frames && steady(k - 2..k + 3) { off(k) } else { None })
        .collect();
    let Some(usual) = median(all.iter().copied().flatten().collect()) else { return Vec::new() };
    let apart = |k: usize| {
        // Frames next to a jump are off because of it.
        let beside = [k.checked_sub(4), k.checked_sub(3), Some(k + 3), Some(k + 4)];
        beside.into_iter().flatten().filter_map(|k| *all.get(k)?).fold(0.0, f64::max)
    };
    let jumps = |k: &usize| {
        let Some(own) = all[*k] else { return false };
        let near = (k.saturating_sub(2)..=k + 2).filter(|other| other != k);
        let most = near.filter_map(|other| *all.get(other)?).fold(0.0, f64::max);
        own > most && own > JUMP[0] * usual && own > JUMP[1] * apart(*k)
    };
    (0..frames).filter(jumps).collect()
}

/// Frames that were lost while the clock went on, and labels that change places, of markers along a rod.
fn faults(source: &MarkerFile, recording: &Recording) -> Vec<String> {
    let known = Recording {
        fps: recording.fps,
        scale: recording.scale,
        y: recording.y.or(Some(Vertical::Up)),
        ..Recording::default()
    };
    let along = |marker: &MarkerData| {
        let converted = known.convert(source, marker).ok()?;
        let place = |place: &[Option<f64>; 3]| {
            let whole = (0..3).all(|c| place[c].is_some() == marker.axes[c]);
            whole.then(|| place.map(Option::unwrap_or_default))
        };
        let times = converted.times.iter().map(|(_, t)| *t).collect();
        Some((times, converted.positions.iter().map(place).collect()))
    };
    let Some(all) = source.markers.iter().map(along).collect::<Option<Vec<_>>>() else {
        return Vec::new();
    };
    let Some((times, _)) = all.first().cloned().filter(|_| all.len() > 2) else {
        return Vec::new();
    };
    let names = source.markers.iter().map(|m| m.name.clone());
    let markers = names.zip(all.into_iter().map(|(_, seen)| seen)).collect();
    let Ok(track) = Track::new(times, markers) else { return Vec::new() };
    let held: Vec<usize> = (0..track.markers().len()).collect();
    let examined = track.examined(&held, LostFrames::Keep, SwappedLabels::Keep);
    examined.faults().iter().map(ToString::to_string).collect()
}
