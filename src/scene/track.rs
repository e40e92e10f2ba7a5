//! Recorded markers: their positions at the frames of a recording, and the cubic Hermite interpolant through them.
//!
//! [`Track`] reads a CSV file or a file of a motion-capture or video-tracking program (crate `marker-files`), and
//! selects markers by name; positions are in m, times in s. The clock of a file must start at 0 within
//! `CLOCK_TOLERANCE`, after frames before a given start time are left out; the times of [`Track::new`] are taken as
//! they are. Markers with fewer than two positions are errors.
//!
//! [`Marker::at`] is the position at any time, also with derivatives with respect to time. Velocities at the known
//! positions are the slopes of parabolas through three neighbors, those of the outermost interval at both ends, or
//! those of the integration for a track from accelerations. Before the first and after the last position the motion
//! continues with constant velocity.
//!
//! Building a problem examines a track: it then has the defects of the recording ([`TrackDefect`]), and the bandwidth,
//! Hz, of the markers that drive a support (none if they move less than the noise). Before that it has neither. Defects
//! become warnings.

use crate::code::Code;
use crate::error::Error;
use crate::numerics::hermite::HermiteWeights;
use crate::numerics::scalar::Scalar;
use crate::numerics::upper_median;
use crate::numerics::vector::Vector;
use crate::scene::time::Time;
use crate::scene::track_defect::TrackDefect;
use marker_files::{MarkerData, Recording};
use std::ops::Range;
use std::path::Path;

/// Positions of markers at increasing times.
///
/// Between two times the motion is the cubic with the velocities of central differences, one-sided at the ends. Gaps
/// are interpolated in the same way.
#[derive(Clone, Debug, PartialEq)]
pub struct Track {
    times: Vec<f64>,
    markers: Vec<Marker>,
    /// Whether it was integrated from accelerations, and may drift.
    is_integrated: bool,
    /// Defects that were found while reading, with which the examination begins.
    read_faults: Vec<TrackDefect>,
    /// Defects, once the recording was examined.
    faults: Option<Vec<TrackDefect>>,
    /// Bandwidth of the markers that drive a support, Hz; none before the examination, and for markers at rest.
    bandwidth: Option<f64>,
}

/// Recorded marker: name, positions at the frames, and positions with velocities.
#[derive(Clone, Debug, PartialEq)]
pub struct Marker {
    /// Name: the part of the column names behind x, y and z.
    pub name: String,
    /// Position at every frame, m; none where it is missing.
    pub seen: Vec<Option<[f64; 3]>>,
    /// Known positions with velocities, in the order of time.
    pub(super) path: Vec<PathPoint>,
}

/// Position of a marker, m, at a time, s.
#[derive(Clone, Copy, Debug)]
pub(super) struct TimedPosition {
    pub time: f64,
    pub position: [f64; 3],
}

/// Position of a marker, m, and its velocity, m/s, at a time, s.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct PathPoint {
    pub time: f64,
    pub position: [f64; 3],
    pub velocity: [f64; 3],
}

/// Median (upper of two) time between two of increasing `times`, s; 0 for fewer than two.
pub(super) fn median_step(times: &[f64]) -> f64 {
    upper_median(times.windows(2).map(|t| t[1] - t[0])).unwrap_or(0.0)
}

impl Track {
    /// Reads a CSV file with a clock `t` and columns `xA, yA, zA` for every marker `A`, with units in brackets,
    /// otherwise SI; or a file of another program, which is recognized by its first bytes. Without columns z, all z are
    /// 0.
    ///
    /// # Errors
    /// Those of [`read_as`](Self::read_as): a file that cannot be read, the number of an invalid line, a first time
    /// other than 0.
    pub fn read(path: &Path) -> Result<Self, Error> {
        Self::read_as(path, &Recording::default(), &[])
    }

    /// Reads the markers of these `names`, in this order, or all in the order of the file. `recording` has the units,
    /// axes and start time of the file; frames before a given start time are left out. A position without one of the
    /// coordinates of the file is missing.
    ///
    /// # Errors
    /// A file that cannot be read or has an invalid line, an unknown marker, one without a column x or y or with fewer
    /// than two positions. Also settings that contradict the file, and a first time other than 0.
    pub fn read_as(path: &Path, recording: &Recording, names: &[String]) -> Result<Self, Error> {
        // The format is given or recognized by the first bytes of the file.
        let file = marker_files::load(path, recording)?;
        let named = |name: &String| {
            Recording { marker: Some(name.clone()), ..Recording::default() }.select_marker(&file)
        };
        let chosen: Vec<&MarkerData> = match names.is_empty() {
            true => file.markers.iter().collect(),
            false => names.iter().map(named).collect::<Result<_, _>>()?,
        };
        let (mut times, mut markers) = (Vec::new(), Vec::with_capacity(chosen.len()));
        for marker in chosen {
            if !marker.axes[0] || !marker.axes[1] {
                let message = format!(
                    "found the marker `{0}` without a column x{0} or y{0}, \
                                       allowed: both columns",
                    marker.name
                );
                return Err(file.error(1, message).into());
            }
            let along = recording.observed_axes(marker.axes);
            let converted = recording.convert(&file, marker)?;
            // Frames before the zero of time are left out, if there is one.
            let before = converted.times.partition_point(|(_, t)| *t < -CLOCK_TOLERANCE);
            let before = if recording.time_zero.is_some() { before } else { 0 };
            let place = |place: &[Option<f64>; 3]| {
                // A position is known only with all coordinates that the file has.
                let whole = (0..3).all(|c| place[c].is_some() == along[c]);
                whole.then(|| place.map(Option::unwrap_or_default))
            };
            let seen = converted.positions[before..].iter().map(place).collect();
            markers.push((marker.name.clone(), seen));
            times = converted.times[before..].to_vec();
        }
        if let Some((line, first)) = times.first() {
            check_clock(*first, TIME_ZERO_REMEDY).map_err(|message| file.error(*line, message))?;
        }
        let found = markers.len();
        let track = Self::new(times.into_iter().map(|(_, t)| t).collect(), markers);
        track.map_err(|message| file.error(1, format!("{message}; {found} markers")).into())
    }

    /// Motion of one point, without a name, from positions and velocities at increasing times, marked as integrated
    /// from accelerations. Interpolation uses these velocities. A message if there are fewer than two points.
    pub(super) fn from_integrated(path: Vec<PathPoint>) -> Result<Self, String> {
        let seen = path.iter().map(|point| Some(point.position)).collect();
        let times = path.iter().map(|point| point.time).collect();
        let mut track = Self::new(times, vec![(String::new(), seen)])?;
        track.markers[0].path = path;
        track.is_integrated = true;
        Ok(track)
    }

    /// Recording of markers by name, each with its position, m, at every one of these increasing times, s, or none
    /// where it is missing. Velocities are slopes of parabolas through three successive known positions, at both ends
    /// those of the outermost two. The recording is not yet examined for defects.
    ///
    /// # Errors
    /// A message about the first marker with fewer than two positions, or that there is no marker.
    pub fn new(
        times: Vec<f64>,
        markers: Vec<(String, Vec<Option<[f64; 3]>>)>,
    ) -> Result<Self, String> {
        let of = |(name, seen): (String, Vec<Option<[f64; 3]>>)| {
            // Two positions are the least that determine a velocity.
            let known = known_positions(&times, &seen);
            if known.len() < 2 {
                return Err(format!(
                    "found the marker `{name}` in {} frames, allowed: at least two \
                                    frames",
                    known.len()
                ));
            }
            Ok(Marker { path: with_velocities(&known), name, seen })
        };
        let markers = markers.into_iter().map(of).collect::<Result<Vec<_>, _>>()?;
        if markers.is_empty() {
            return Err("found no marker, allowed: at least one".into());
        }
        Ok(Self {
            times,
            markers,
            is_integrated: false,
            read_faults: Vec::new(),
            faults: None,
            bandwidth: None,
        })
    }

    /// The recording with these defects in place of those of an earlier examination, marked as examined.
    pub(super) fn with_faults(self, faults: Vec<TrackDefect>) -> Self {
        Self { faults: Some(faults), ..self }
    }

    /// The recording with one more defect that was found while reading. The examination begins with these defects.
    pub(super) fn with_first_fault(mut self, fault: TrackDefect) -> Self {
        self.read_faults.push(fault);
        self
    }

    /// The recording marked as examined, with the bandwidth of the markers `driven` (indices), which drive a support.
    /// Its defects are those of an earlier examination, those found while reading, then missing frames and jumps of
    /// these markers. Jumps within two frame intervals of lost frames, and those of a marker with glitches, are left
    /// out. Integrated motions are detrended for both.
    pub(super) fn with_motion_defects(self, driven: &[usize]) -> Self {
        // The drift of an integrated motion is no motion of the marker.
        let detrended = self.is_integrated.then(|| self.detrended());
        let motion = detrended.as_ref().unwrap_or(&self);
        let (mut faults, bandwidth) = (motion.motion_faults(driven), motion.bandwidth_of(driven));
        let before: Vec<TrackDefect> =
            self.faults.iter().flatten().chain(&self.read_faults).cloned().collect();
        faults.retain_mut(|fault| fault.retain_distinct(&before, self.usual_step()));
        faults.splice(0..0, before);
        Self { faults: Some(faults), bandwidth, ..self }
    }

    /// The frames with the indices of a range as a recording of the same markers whose times start at 0, without
    /// defects, marked as examined. It panics for a range beyond the frames.
    ///
    /// # Errors
    /// Those of [`new`](Self::new).
    pub(crate) fn window(&self, frames: Range<usize>) -> Result<Self, String> {
        let first = self.times[frames.start];
        let times = self.times[frames.clone()].iter().map(|t| t - first).collect();
        let of = |m: &Marker| (m.name.clone(), m.seen[frames.clone()].to_vec());
        let window = Self::new(times, self.markers.iter().map(of).collect())?;
        Ok(window.with_faults(Vec::new()))
    }

    /// Whether the recording was examined for defects, found or not.
    pub(super) fn is_examined(&self) -> bool {
        self.faults.is_some()
    }

    /// Defects, the corrected ones included. Empty before the examination, which building a problem does.
    pub fn faults(&self) -> &[TrackDefect] {
        self.faults.as_deref().unwrap_or_default()
    }

    /// Warnings, with codes, one for each defect in order; the texts begin with the path of the `file`, unless that is
    /// empty.
    pub(super) fn warnings(&self, file: &Path) -> Vec<(Code, String)> {
        let name = file.display().to_string();
        let place = if name.is_empty() { String::new() } else { format!("{name}: ") };
        self.faults().iter().map(|fault| (fault.code(), format!("{place}{fault}"))).collect()
    }

    /// Frequency, Hz, below which 99 % of the variance of the driving motion lie. None before the examination, and for
    /// a motion that does not exceed the noise.
    pub(super) fn bandwidth(&self) -> Option<f64> {
        self.bandwidth
    }

    /// Median (upper of two) time between two frames, s; 0 for a single frame.
    pub(super) fn usual_step(&self) -> f64 {
        median_step(&self.times)
    }

    /// Rejects a simulation that ends more than a step after the end of the recording, where its motion would be
    /// extrapolated. If the step is left to the program, it is the median interval of the frames. A missing end is
    /// accepted. `file` names the recording in the error.
    pub(super) fn check_end(&self, file: &Path, time: &Time) -> Result<(), Error> {
        let last = self.end();
        // A step may begin before the last frame and end after it.
        let step = time.step.unwrap_or_else(|| self.usual_step());
        if time.end.is_finite() && time.end > last + step {
            let name = match file.as_os_str().is_empty() {
                true => "the recording".into(),
                false => file.display().to_string(),
            };
            let allowed = format!("up to {last} s, where {name} ends");
            return Err(Error::invalid("time.end", format!("{} s", time.end), allowed));
        }
        Ok(())
    }

    /// Times of the frames, s, increasing; the first one of a recording that was read is 0.
    pub fn times(&self) -> &[f64] {
        &self.times
    }

    /// Time of the last frame, s; 0 without frames.
    pub fn end(&self) -> f64 {
        self.times.last().copied().unwrap_or(0.0)
    }

    /// The markers, in the order of their selection, or else of the file.
    pub fn markers(&self) -> &[Marker] {
        &self.markers
    }
}

impl Marker {
    /// Position at a time, m: the cubic Hermite interpolant of the known positions and velocities, also over missing
    /// frames. Before the first known position and after the last the motion continues with constant velocity. It has
    /// derivatives with respect to `time`.
    pub fn at<D: Scalar>(&self, time: D) -> Vector<D> {
        let next = self.path.partition_point(|point| point.time <= time.value());
        // Outside of the frames the velocity at the end continues.
        let (Some(a), Some(b)) = (next.checked_sub(1), self.path.get(next)) else {
            let end = &self.path[next.saturating_sub(1)];
            return std::array::from_fn(|c| (time - end.time) * end.velocity[c] + end.position[c]);
        };
        let a = &self.path[a];
        let w = HermiteWeights::new(a.time, b.time, time);
        std::array::from_fn(|c| {
            w.x0 * a.position[c]
                + w.x1 * b.position[c]
                + w.v0 * a.velocity[c]
                + w.v1 * b.velocity[c]
        })
    }
}

/// Largest absolute time of the first frame, s, that counts as 0.
pub(super) const CLOCK_TOLERANCE: f64 = 1e-9;
/// Remedy in the message of a clock that starts at another time.
pub(super) const TIME_ZERO_REMEDY: &str = ". Set time_zero to the time in the file at which the \
                                           motion starts";

/// Rejects a first time, s, that differs from 0, the start of the simulation, by more than [`CLOCK_TOLERANCE`]: the
/// motion before it would be extrapolated. The error is a message that ends with `remedy`.
pub(super) fn check_clock(first: f64, remedy: &str) -> Result<(), String> {
    match first.abs() > CLOCK_TOLERANCE {
        true => Err(format!("found {first} s as the first time, allowed: 0 s{remedy}")),
        false => Ok(()),
    }
}

/// The positions that are not missing, m, with their times, s, in the order of the frames.
pub(super) fn known_positions(times: &[f64], seen: &[Option<[f64; 3]>]) -> Vec<TimedPosition> {
    let frames = times.iter().zip(seen);
    frames.filter_map(|(t, x)| Some(TimedPosition { time: *t, position: (*x)? })).collect()
}

/// The positions with velocities, m/s, in the order of increasing times. At inner points these are the slopes of the
/// parabola through the point and its neighbors, at the ends those of the outermost interval. It panics for fewer than
/// two positions.
pub(super) fn with_velocities(known: &[TimedPosition]) -> Vec<PathPoint> {
    let slope = |i: usize| {
        let (a, b) = (known[i], known[i + 1]);
        std::array::from_fn::<f64, 3, _>(|c| (b.position[c] - a.position[c]) / (b.time - a.time))
    };
    let last = known.len() - 1;
    let velocity = |i: usize| match i {
        0 => slope(0),
        _ if i == last => slope(last - 1),
        _ => {
            let (before, after) = (slope(i - 1), slope(i));
            let [h0, h1] = [known[i].time - known[i - 1].time, known[i + 1].time - known[i].time];
            std::array::from_fn(|c| (before[c] * h1 + after[c] * h0) / (h0 + h1))
        }
    };
    let point = |(i, x): (usize, &TimedPosition)| PathPoint {
        time: x.time,
        position: x.position,
        velocity: velocity(i),
    };
    known.iter().enumerate().map(point).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use num_dual::Dual64;

    /// A parabola is followed exactly inside, through a gap too, and rates are its rates.
    #[test]
    fn a_parabola_is_followed() {
        let place = |t: f64| [t, 2.0 * t * t - 0.3, -t * t];
        let times: Vec<f64> = (0..9).map(|k| 0.1 * f64::from(k)).collect();
        let seen = times.iter().enumerate().map(|(k, t)| (k != 4).then(|| place(*t))).collect();
        let track = Track::new(times, vec![("7".into(), seen)]).unwrap();
        for t in [0.1, 0.17, 0.3, 0.38, 0.41, 0.5, 0.63] {
            let found = track.markers()[0].at(Dual64::new(t, 1.0));
            let rates = [1.0, 4.0 * t, -2.0 * t];
            for c in 0..3 {
                assert!((found[c].re - place(t)[c]).abs() < 1e-15, "{t}");
                assert!((found[c].eps - rates[c]).abs() < 1e-14, "{t}");
            }
        }
    }

    #[test]
    fn files_are_read() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("clip.csv");
        let read = |text: &str| {
            std::fs::write(&path, text).unwrap();
            Track::read(&path).map_err(|error| error.to_string())
        };
        let track = read("t,x0[mm],y0[mm],xtip,ytip\n0,1,2,3,4\n0.5,2,,3,5\n1,3,4,3,6\n").unwrap();
        let names: Vec<&str> = track.markers().iter().map(|m| m.name.as_str()).collect();
        assert_eq!((names, track.times()), (vec!["0", "tip"], &[0.0, 0.5, 1.0][..]));
        // A blank is missing; mm become m; between frames the line through equal velocities.
        assert_eq!(track.markers()[0].seen[1], None);
        assert_eq!(track.markers()[0].seen[2], Some([3e-3, 4e-3, 0.0]));
        assert_eq!(track.markers()[1].at(0.75), [3.0, 5.5, 0.0]);
        for (text, words) in [
            ("x0,y0\n1,2\n", "no column t"),
            ("t,a0\n1,2\n", "column `a0`"),
            ("t,x0\n0,2\n", "marker `0` without"),
            ("t,x0,y0\n0,2,3\n", "in 1 frames"),
            ("t,x0,y0\n3,2,3\n4,2,3\n", "found 3 s"),
            ("t,x0,y0\n1,2,3\n1,2,4\n", "increasing"),
        ] {
            let error = read(text).unwrap_err();
            assert!(error.contains(words), "{text}: {error}");
        }
    }
}
