//! Markers that were followed in time: a table of places, and the smooth way through them.

use crate::code::Code;
use crate::error::Error;
use crate::numerics::hermite::HermiteWeights;
use crate::numerics::scalar::Scalar;
use crate::numerics::vector::Vector;
use crate::scene::fault::Fault;
use marker_files::{MarkerData, Recording};
use std::ops::Range;
use std::path::Path;

/// Where markers were at increasing times.
///
/// Between two times a marker goes along the cubic with the slopes of the central differences, and of
/// the neighbouring interval at the ends. Markers that were not seen for a while go on through the gap
/// likewise.
#[derive(Clone, Debug, PartialEq)]
pub struct Track {
    times: Vec<f64>,
    markers: Vec<Marker>,
    /// Whether it was integrated from accelerations, and drifts.
    is_integrated: bool,
    /// What its reader found wrong.
    read_faults: Vec<Fault>,
    /// What is wrong in it, once that was looked for.
    faults: Option<Vec<Fault>>,
    /// Bandwidth of the markers that drive a support, Hz; none before it was computed, and where nothing moves.
    bandwidth: Option<f64>,
}

/// A marker.
#[derive(Clone, Debug, PartialEq)]
pub struct Marker {
    /// What follows x, y and z in the names of its columns.
    pub name: String,
    /// Where it was seen, m; none where it was not.
    pub seen: Vec<Option<[f64; 3]>>,
    /// When it was seen, s, where, m, and with which velocity, m/s.
    pub(super) way: Vec<(f64, [[f64; 3]; 2])>,
}

impl Track {
    /// Reads a CSV file with a clock `t` and columns `xA, yA, zA` for every marker `A`, units in brackets,
    /// SI without; or a file of another program, which is known by its first bytes. Without columns z all of it
    /// lies at z = 0.
    ///
    /// # Errors
    /// A file that cannot be read, or a line of it that makes no sense, with its number.
    pub fn read(path: &Path) -> Result<Self, Error> {
        Self::read_as(path, &Recording::default(), &[])
    }

    /// The markers of these names, in this order, or all in the order of the file; `recording` says how its numbers
    /// become seconds and metres.
    ///
    /// # Errors
    /// Those of [`read`](Self::read), a marker that is not there, and what makes no sense beside this file.
    pub fn read_as(path: &Path, recording: &Recording, names: &[String]) -> Result<Self, Error> {
        let (format, bytes) = marker_files::open(path, recording.format)?;
        let file = marker_files::parse(path, format, &bytes)?;
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
                let message = format!("marker `{0}` without a column x{0} or y{0}", marker.name);
                return Err(file.error(1, message).into());
            }
            let along = recording.observed_axes(marker.axes);
            let converted = recording.convert(&file, marker)?;
            let before = converted.times.partition_point(|(_, t)| *t < -CLOCK_TOLERANCE);
            let before = if recording.time_zero.is_some() { before } else { 0 };
            let place = |place: &[Option<f64>; 3]| {
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

    /// The motion of one point by its places and velocities at increasing times, s, m and m/s.
    pub(super) fn of_way(way: Vec<(f64, [[f64; 3]; 2])>) -> Result<Self, String> {
        let seen = way.iter().map(|(_, [place, _])| Some(*place)).collect();
        let times = way.iter().map(|(time, _)| *time).collect();
        let mut track = Self::new(times, vec![(String::new(), seen)])?;
        track.markers[0].way = way;
        track.is_integrated = true;
        Ok(track)
    }

    /// Markers by name, each seen at these increasing times, s, or not.
    ///
    /// # Errors
    /// A marker that was seen less than twice, in words.
    pub fn new(
        times: Vec<f64>,
        markers: Vec<(String, Vec<Option<[f64; 3]>>)>,
    ) -> Result<Self, String> {
        let of = |(name, seen): (String, Vec<Option<[f64; 3]>>)| {
            let known = times.iter().zip(&seen);
            let known: Vec<(f64, [f64; 3])> =
                known.filter_map(|(t, x)| Some((*t, (*x)?))).collect();
            if known.len() < 2 {
                return Err(format!("marker `{name}` seen {} times, allowed: twice", known.len()));
            }
            Ok(Marker { way: way(&known), name, seen })
        };
        let markers = markers.into_iter().map(of).collect::<Result<Vec<_>, _>>()?;
        if markers.is_empty() {
            return Err("no marker, allowed: one at least".into());
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

    /// With what was found wrong in it.
    pub(super) fn with_faults(self, faults: Vec<Fault>) -> Self {
        Self { faults: Some(faults), ..self }
    }

    /// With a fault that its reader found; the others have not been looked for yet.
    pub(super) fn with_first_fault(mut self, fault: Fault) -> Self {
        self.read_faults.push(fault);
        self
    }

    /// With the defects of the motion of these markers, which drive a support, and their bandwidth.
    pub(super) fn guarded(self, driven: &[usize]) -> Self {
        let detrended = self.is_integrated.then(|| self.detrended());
        let motion = detrended.as_ref().unwrap_or(&self);
        let (mut faults, bandwidth) = (motion.motion_faults(driven), motion.bandwidth_of(driven));
        let before: Vec<Fault> =
            self.faults.iter().flatten().chain(&self.read_faults).cloned().collect();
        faults.retain_mut(|fault| fault.is_beside(&before, self.usual_step()));
        faults.splice(0..0, before);
        Self { faults: Some(faults), bandwidth, ..self }
    }

    /// Some of its frames as a recording of its own, from time 0; faults are not looked for again.
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

    /// Whether faults were looked for.
    pub(super) fn is_examined(&self) -> bool {
        self.faults.is_some()
    }

    /// What is wrong in it, or was until it was mended; nothing before a problem was made of it.
    pub fn faults(&self) -> &[Fault] {
        self.faults.as_deref().unwrap_or_default()
    }

    /// What is wrong in it, in words, of a file with this name.
    pub(super) fn warnings(&self, file: &Path) -> Vec<(Code, String)> {
        let name = file.display().to_string();
        let place = if name.is_empty() { String::new() } else { format!("{name}: ") };
        self.faults().iter().map(|fault| (fault.code(), format!("{place}{fault}"))).collect()
    }

    /// Frequency below which 99 % of the variance of the motion lie that drives a support, Hz.
    pub(super) fn bandwidth(&self) -> Option<f64> {
        self.bandwidth
    }

    /// The usual time between two frames, s.
    pub(super) fn usual_step(&self) -> f64 {
        let mut steps: Vec<f64> = self.times.windows(2).map(|t| t[1] - t[0]).collect();
        steps.sort_by(f64::total_cmp);
        steps.get(steps.len() / 2).copied().unwrap_or(0.0)
    }

    /// When the markers were looked at, s.
    pub fn times(&self) -> &[f64] {
        &self.times
    }

    /// When they were looked at last, s.
    pub fn end(&self) -> f64 {
        self.times.last().copied().unwrap_or(0.0)
    }

    /// The markers, in the order of their columns.
    pub fn markers(&self) -> &[Marker] {
        &self.markers
    }
}

impl Marker {
    /// Where the marker is at a time, m; before the first time it was seen, and after the last, it goes
    /// on straight.
    pub fn at<D: Scalar>(&self, time: D) -> Vector<D> {
        let after = self.way.partition_point(|(t, _)| *t <= time.value());
        let straight =
            |(t, [x, v]): &(f64, [[f64; 3]; 2])| std::array::from_fn(|c| (time - *t) * v[c] + x[c]);
        if after == 0 {
            return straight(&self.way[0]);
        }
        let Some((t1, [x1, v1])) = self.way.get(after) else {
            return straight(&self.way[after - 1]);
        };
        let (t0, [x0, v0]) = &self.way[after - 1];
        let w = HermiteWeights::new(*t0, *t1, time);
        std::array::from_fn(|c| w.x0 * x0[c] + w.x1 * x1[c] + w.v0 * v0[c] + w.v1 * v1[c])
    }
}

/// The clock of a recording starts at 0 up to this, s.
pub(super) const CLOCK_TOLERANCE: f64 = 1e-9;
/// What to do where it does not.
pub(super) const TIME_ZERO_REMEDY: &str = "; state time_zero, the start on the file's clock";

/// Refuses a clock that does not start at 0, as the scene's does: the motion before it would be extrapolated.
pub(super) fn check_clock(first: f64, remedy: &str) -> Result<(), String> {
    match first.abs() > CLOCK_TOLERANCE {
        true => {
            Err(format!("the clock starts at {first} s, allowed: at 0, as the scene's{remedy}"))
        }
        false => Ok(()),
    }
}

/// Places with their velocities: central differences, of unequal intervals the parabola's.
pub(super) fn way(known: &[(f64, [f64; 3])]) -> Vec<(f64, [[f64; 3]; 2])> {
    let slope = |i: usize| {
        let ((t0, x0), (t1, x1)) = (known[i], known[i + 1]);
        std::array::from_fn::<f64, 3, _>(|c| (x1[c] - x0[c]) / (t1 - t0))
    };
    let last = known.len() - 1;
    let velocity = |i: usize| match i {
        0 => slope(0),
        _ if i == last => slope(last - 1),
        _ => {
            let (before, after) = (slope(i - 1), slope(i));
            let [h0, h1] = [known[i].0 - known[i - 1].0, known[i + 1].0 - known[i].0];
            std::array::from_fn(|c| (before[c] * h1 + after[c] * h0) / (h0 + h1))
        }
    };
    known.iter().enumerate().map(|(i, (t, x))| (*t, [*x, velocity(i)])).collect()
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
        assert_eq!(track.markers()[0].seen[1], None);
        assert_eq!(track.markers()[0].seen[2], Some([3e-3, 4e-3, 0.0]));
        assert_eq!(track.markers()[1].at(0.75), [3.0, 5.5, 0.0]);
        for (text, words) in [
            ("x0,y0\n1,2\n", "no column t"),
            ("t,a0\n1,2\n", "column `a0`"),
            ("t,x0\n0,2\n", "marker `0` without"),
            ("t,x0,y0\n0,2,3\n", "seen 1 times"),
            ("t,x0,y0\n3,2,3\n4,2,3\n", "starts at 3 s"),
            ("t,x0,y0\n1,2,3\n1,2,4\n", "increasing"),
        ] {
            let error = read(text).unwrap_err();
            assert!(error.contains(words), "{text}: {error}");
        }
    }
}
