//! Defects of a recorded motion that drives a support, and the bandwidth of the motion, for the choice of time steps.
//!
//! Input: a [`Track`] and the indices of the markers that drive a support. The extent of a marker is the diagonal of
//! the bounding box of its positions, m. Markers with an extent below `MOVING` of the largest in the recording count as
//! held, and are left out.
//!
//! - Missing frames before the first or after the last position of a marker are always a defect. Those between are one
//!   if the error of interpolation over equally many frames exceeds `GAP_ERROR` of the extent and `GAP_TO_NOISE` times
//!   that over one frame, or cannot be estimated.
//! - A jump is a displacement between two frames of more than `JUMP_TO_STEPS` times the largest of those around it. It
//!   also exceeds multiples of noise and resolution, and a fraction of the extent.
//! - The bandwidth is the frequency, Hz, below which 99 % of the variance of the motion lie, without white noise. There
//!   is none for a motion that does not exceed its noise.
//!
//! `detrended` returns the recording without the quadratic trend of each coordinate, for motions integrated from
//! accelerations.

use crate::numerics::noise_scale::{NoEstimate, NoisySeries, quantization_step};
use crate::numerics::spectrum::{harmonic_variances, intervals};
use crate::numerics::upper_median;
use crate::scene::track::{Marker, TimedPosition, Track, known_positions, with_velocities};
use crate::scene::track_defect::TrackDefect;

/// Extent of a marker, as a fraction of the largest in the recording, from which on it counts as moving; others are
/// held.
const MOVING: f64 = 0.01;
/// Length of an interval between two frames, in usual intervals, above which a frame is missing.
const LONG_INTERVAL: f64 = 1.5;
/// Error, RMS, of the interpolation over missing frames above which it is reported: this fraction of the extent of the
/// motion, ..
const GAP_ERROR: f64 = 0.01;
/// .. and this multiple of the error over a single frame, which is due to noise.
const GAP_TO_NOISE: f64 = 3.0;
/// Smallest number of complete sections of the recording from which the error of interpolation is estimated.
const FEWEST_SECTIONS: usize = 5;
/// Largest number of sections from which it is estimated, for run time.
const MOST_SECTIONS: usize = 200;
/// Displacement from one frame to the next, in units of the largest one of the frames around it, above which it is a
/// jump.
const JUMP_TO_STEPS: f64 = 5.0;
/// Number of displacements on each side of a jump, the adjacent ones included. Adjacent ones are not compared, since a
/// jump may take two frames.
const FRAMES_AROUND: usize = 4;
/// Smallest jump, in standard deviations of the noise, ..
const JUMP_TO_NOISE: f64 = 10.0;
/// .. as a fraction of the extent of the motion, ..
const JUMP_TO_EXTENT: f64 = 0.05;
/// .. and in units of the resolution of the recording, such as pixels.
const JUMP_TO_RESOLUTION: f64 = 3.0;
/// Fraction of the variance of a motion above its bandwidth: 1 %, an amplitude of a tenth.
const VARIANCE_ABOVE: f64 = 0.01;
/// Relative uncertainty of the noise variance that is subtracted. Larger values ignore more fast motion, smaller ones
/// count noise as motion.
const NOISE_UNCERTAINTY: f64 = 0.3;
/// Amplitude, relative to the coordinates, below which a marker is at rest: rounding errors of files with nine digits.
const STILL: f64 = 1e-9;
/// Variance of a motion, in noise variances, below which it has no bandwidth.
const LEAST_VARIANCE: f64 = 4.0;

impl Track {
    /// A copy of the recording in which the least-squares quadratic function of time is subtracted from each coordinate
    /// of each marker, m. Missing positions stay missing. The copy has no defects, and is not marked as integrated.
    /// Constant errors of an accelerometer, and a velocity at the start, cause such a trend, which exceeds the motion
    /// itself.
    pub(super) fn detrended(&self) -> Self {
        let of = |marker: &Marker| {
            let known = known_positions(self.times(), &marker.seen);
            let trends = [0, 1, 2].map(|c| quadratic(&known, c));
            let places = marker.seen.iter().zip(self.times());
            let places = places.map(|(place, time)| {
                let place = (*place)?;
                Some([0, 1, 2].map(|c| place[c] - trends[c](*time)))
            });
            (marker.name.clone(), places.collect())
        };
        let markers = self.markers().iter().map(of).collect();
        // As many positions as before, so that `new` succeeds.
        Self::new(self.times().to_vec(), markers).unwrap_or_else(|_| self.clone())
    }

    /// Defects of the markers `driven` (indices) that [move](Self::moving), marker by marker: missing frames, then
    /// jumps of each. The recording is not changed.
    pub(super) fn motion_faults(&self, driven: &[usize]) -> Vec<TrackDefect> {
        let step = self.usual_step();
        let faults = self.moving(driven).flat_map(|(marker, least)| {
            let mut faults = missing_frames(self.times(), marker, step);
            faults.extend(jumps(self.times(), marker, step, least));
            faults
        });
        faults.collect()
    }

    /// Largest bandwidth of those of the markers `driven` (indices) that [move](Self::moving), Hz: the frequency below
    /// which 99 % of the variance of a motion lie, without white noise. None if no motion exceeds its noise.
    pub(super) fn bandwidth_of(&self, driven: &[usize]) -> Option<f64> {
        self.moving(driven).filter_map(|(m, _)| bandwidth(self.times(), m)).reduce(f64::max)
    }

    /// Those of the markers `driven` (indices; unknown ones are left out) whose extent is at least [`MOVING`] of the
    /// largest in the recording, each with this smallest extent, m. Others are held, so that their positions differ by
    /// noise only.
    fn moving(&self, driven: &[usize]) -> impl Iterator<Item = (&Marker, f64)> {
        let largest = self.markers().iter().map(|m| extent(&m.seen)).fold(0.0, f64::max);
        let least = MOVING * largest;
        let markers = driven.iter().filter_map(|j| self.markers().get(*j));
        markers.filter(move |m| extent(&m.seen) >= least).map(move |marker| (marker, least))
    }
}

/// Distance of two points, m.
fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|c| (a[c] - b[c]).powi(2)).sum::<f64>().sqrt()
}

/// Diagonal of the bounding box of all positions, m; 0 without any.
fn extent(seen: &[Option<[f64; 3]>]) -> f64 {
    let along = |c: usize| {
        let values = seen.iter().flatten().map(|place| place[c]);
        let ends = values.fold(None, |ends: Option<[f64; 2]>, x| {
            Some(ends.map_or([x, x], |[low, high]| [low.min(x), high.max(x)]))
        });
        ends.map_or(0.0, |[low, high]| high - low)
    };
    (0..3).map(|c| along(c).powi(2)).sum::<f64>().sqrt()
}

/// Least-squares quadratic function of time, s, of coordinate `axis` of the known positions, m. It is computed by
/// normal equations of Legendre polynomials on the range of the times. The function is zero if the equations are
/// singular, as for fewer than three positions.
fn quadratic(known: &[TimedPosition], axis: usize) -> impl Fn(f64) -> f64 + use<> {
    let start = known.first().map_or(0.0, |first| first.time);
    let length = known.last().map_or(1.0, |last| last.time - start).max(f64::MIN_POSITIVE);
    let basis = move |time: f64| {
        let u = 2.0 * (time - start) / length - 1.0;
        [1.0, u, 1.5 * u * u - 0.5]
    };
    let mut normal = nalgebra::Matrix3::<f64>::zeros();
    let mut right = nalgebra::Vector3::<f64>::zeros();
    for TimedPosition { time, position } in known {
        let row = nalgebra::Vector3::from(basis(*time));
        normal += row * row.transpose();
        right += row * position[axis];
    }
    let found = normal.lu().solve(&right).unwrap_or_default();
    move |time| nalgebra::Vector3::from(basis(time)).dot(&found)
}

/// Missing frames of a marker as defects, in the order: at the start, at the end, between known positions. Those at the
/// start and end of `times`, s, are always reported. Those between are reported if the error of interpolation over
/// equally many frames cannot be estimated, or exceeds both [`GAP_ERROR`] of the extent and [`GAP_TO_NOISE`] times the
/// error over one frame. `step` is the usual interval, s: frames are missing in an interval above `LONG_INTERVAL` times
/// that. Empty for a marker without positions.
fn missing_frames(times: &[f64], marker: &Marker, step: f64) -> Vec<TrackDefect> {
    let known = known_positions(times, &marker.seen);
    let ([Some(first), Some(last)], [Some(start), Some(end)]) =
        ([known.first(), known.last()], [times.first(), times.last()])
    else {
        return Vec::new();
    };
    let missing = |from: f64, to: f64| match to - from > LONG_INTERVAL * step {
        true => ((to - from) / step).round() as usize - 1,
        false => 0,
    };
    let fault = |from: f64, to: f64, frames: usize, error: Option<f64>| {
        TrackDefect::MissingFrames { marker: marker.name.clone(), from, to, frames, error }
    };
    let mut faults = Vec::new();
    // Before the first position and after the last one the motion is extrapolated.
    for (from, to) in [(*start, first.time), (last.time, *end)] {
        let frames = ((to - from) / step).round() as usize;
        if frames > 0 {
            faults.push(fault(from, to, frames, None));
        }
    }
    // The error over one frame is that of the noise.
    let noise = interpolation_error(&known, 1, step).unwrap_or(0.0);
    let allowed = (GAP_ERROR * extent(&marker.seen)).max(GAP_TO_NOISE * noise);
    for pair in known.windows(2) {
        let (from, to) = (pair[0].time, pair[1].time);
        let frames = missing(from, to);
        if frames > 0 {
            let error = interpolation_error(&known, frames, step);
            if error.is_none_or(|error| error > allowed) {
                faults.push(fault(from, to, frames, error));
            }
        }
    }
    faults
}

/// Error, RMS, m, of the cubic interpolation over `frames` missing frames. It is estimated from sections of `frames +
/// 4` known positions without an interval above `LONG_INTERVAL` times the usual one, `step`, s. The inner frames of a
/// section are compared with the interpolant through two frames on each side. At most [`MOST_SECTIONS`] sections are
/// used. None if there are fewer than [`FEWEST_SECTIONS`].
fn interpolation_error(known: &[TimedPosition], frames: usize, step: f64) -> Option<f64> {
    // Two frames on each side determine the slopes.
    let length = frames + 4;
    let complete = |first: usize| {
        let section = &known[first..first + length];
        section.windows(2).all(|pair| pair[1].time - pair[0].time <= LONG_INTERVAL * step)
    };
    let starts = 0..(known.len() + 1).saturating_sub(length);
    let starts: Vec<usize> = starts.filter(|first| complete(*first)).collect();
    if starts.len() < FEWEST_SECTIONS {
        return None;
    }
    // The inner frames of a section are interpolated from the two on each side and compared.
    let (mut sum, mut count) = (0.0, 0);
    for first in starts.iter().step_by(starts.len() / MOST_SECTIONS + 1) {
        let section = &known[*first..first + length];
        let kept = [section[0], section[1], section[length - 2], section[length - 1]];
        let bridge = Marker { name: String::new(), seen: Vec::new(), path: with_velocities(&kept) };
        for frame in &section[2..length - 2] {
            sum += distance(bridge.at(frame.time), frame.position).powi(2);
            count += 1;
        }
    }
    Some((sum / f64::from(count)).sqrt())
}

/// Jumps of a marker from one frame to the next, as one defect with the times after the jumps and the largest
/// displacement, m; none without jumps. A jump is above [`JUMP_TO_STEPS`] times the largest displacement among the
/// three before and the three after it, without the adjacent ones; at least three of these six must be known. It is
/// also above each of: `least`, m, [`JUMP_TO_NOISE`] times the noise (the median norm of second differences over
/// `sqrt(6)`), [`JUMP_TO_EXTENT`] of the extent, and [`JUMP_TO_RESOLUTION`] times the resolution of the recording.
/// Displacements over missing frames are left out. `step` is the usual interval, s.
fn jumps(times: &[f64], marker: &Marker, step: f64, least: f64) -> Option<TrackDefect> {
    let frames = marker.seen.len();
    let steps: Vec<Option<f64>> = (1..frames)
        .map(|k| {
            let (a, b) = (marker.seen[k - 1]?, marker.seen[k]?);
            (times[k] - times[k - 1] <= LONG_INTERVAL * step).then(|| distance(a, b))
        })
        .collect();
    // Noise by the median of the second differences, whose variance is six times that of a sample.
    let second = |w: &[Option<[f64; 3]>]| {
        let (a, b, c) = (w[0]?, w[1]?, w[2]?);
        Some(distance([0, 1, 2].map(|i| a[i] - 2.0 * b[i] + c[i]), [0.0; 3]) / 6.0_f64.sqrt())
    };
    let noise = upper_median(marker.seen.windows(3).filter_map(second)).unwrap_or(0.0);
    let resolution = [0, 1, 2].map(|c| {
        let values: Vec<f64> = marker.seen.iter().flatten().map(|place| place[c]).collect();
        quantization_step(&values).unwrap_or(0.0)
    });
    // A jump must exceed noise, a fraction of the extent and the resolution of the recording.
    let least = least
        .max(JUMP_TO_NOISE * noise)
        .max(JUMP_TO_EXTENT * extent(&marker.seen))
        .max(JUMP_TO_RESOLUTION * resolution.into_iter().fold(0.0, f64::max));
    let around = |k: usize| {
        let before = k.saturating_sub(FRAMES_AROUND)..k.saturating_sub(1);
        let after = (k + 2).min(steps.len())..(k + 1 + FRAMES_AROUND).min(steps.len());
        let all = steps[before].iter().chain(&steps[after]).flatten();
        all.fold((0.0_f64, 0), |(most, count), x| (most.max(*x), count + 1))
    };
    let is_jump = |k: &usize| {
        let (most, count) = around(*k);
        // With fewer displacements around there is nothing to compare with.
        steps[*k].is_some_and(|own| {
            own > least && own > JUMP_TO_STEPS * most && count >= FRAMES_AROUND - 1
        })
    };
    let found: Vec<usize> = (0..steps.len()).filter(is_jump).collect();
    let distance = found.iter().filter_map(|k| steps[*k]).fold(0.0, f64::max);
    let times = found.iter().map(|k| times[k + 1]).collect();
    (!found.is_empty()).then(|| TrackDefect::Jumps { marker: marker.name.clone(), times, distance })
}

/// Lowest frequency, Hz, above which at most [`VARIANCE_ABOVE`] of the variance of a motion lie, all axes together,
/// without that of white noise. It is found from harmonics of the positions on a uniform grid over all frames. The
/// variance above it, less the part of the noise there, is at most [`VARIANCE_ABOVE`] of that of the motion plus
/// [`NOISE_UNCERTAINTY`] of that of the noise. Without such a frequency the result is the Nyquist frequency. None for a
/// variance up to [`LEAST_VARIANCE`] times that of the noise or to rounding ([`STILL`]), and for a duration of zero.
fn bandwidth(times: &[f64], marker: &Marker) -> Option<f64> {
    let (start, end) = (*times.first()?, *times.last()?);
    let intervals = intervals(times.len());
    let length = end - start;
    if !(length > 0.0 && length.is_finite()) {
        return None;
    }
    // Positions on a uniform grid, for the spectrum.
    let place = |k: usize| marker.at(start + length * k as f64 / intervals as f64);
    let places: Vec<[f64; 3]> = (0..=intervals).map(place).collect();
    let (mut variances, mut noise) = (vec![0.0; intervals], 0.0);
    for c in 0..3 {
        let signal: Vec<f64> = places.iter().map(|place| place[c]).collect();
        variances.iter_mut().zip(harmonic_variances(&signal)).for_each(|(sum, own)| *sum += own);
        noise += noise_variance(times, marker, c);
    }
    let total: f64 = variances.iter().sum();
    let size = places.iter().flatten().fold(0.0, |size: f64, x| size.max(x.abs()));
    if total.is_nan() || total <= (LEAST_VARIANCE * noise).max((STILL * size).powi(2)) {
        return None;
    }
    // The variance above a frequency, less its share of the noise, must be allowed.
    let nyquist = 0.5 * (times.len() - 1) as f64 / length;
    let allowed = VARIANCE_ABOVE * (total - noise) + NOISE_UNCERTAINTY * noise;
    let mut above = total;
    for (k, variance) in variances.iter().enumerate() {
        above -= variance;
        let frequency = 0.5 * (k + 1) as f64 / length;
        let noise_above = noise * (1.0 - frequency / nyquist).max(0.0);
        if above - noise_above <= allowed {
            return Some(frequency);
        }
    }
    Some(nyquist)
}

/// Variance of the white noise of a coordinate (`axis`), m^2, from its known positions. For oversampled, autocorrelated
/// noise it is its lower bound, and 0 if it cannot be estimated.
fn noise_variance(times: &[f64], marker: &Marker, axis: usize) -> f64 {
    let seen = times.iter().zip(&marker.seen).filter_map(|(t, place)| Some((*t, (*place)?[axis])));
    let (times, values): (Vec<f64>, Vec<f64>) = seen.unzip();
    let series = NoisySeries { times: &times, values: &values, factors: &[], excluded: &[] };
    match series.noise() {
        Ok(noise) => noise.sigma.powi(2),
        Err(NoEstimate::Oversampled { lower_bound, .. }) => lower_bound.powi(2),
        Err(_) => 0.0,
    }
}
