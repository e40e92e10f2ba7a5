//! Defects of a recorded motion that drives a support: missing frames, jumps, and motion faster than time steps resolve.

use crate::numerics::noise_scale::{NoEstimate, NoisySeries, quantization_step};
use crate::numerics::spectrum::{harmonic_variances, intervals};
use crate::scene::fault::Fault;
use crate::scene::track::{Marker, Track, way};

/// A marker moves if its extent is at least this part of the largest in the recording.
const MOVING: f64 = 0.01;
/// An interval between two frames longer than so many usual ones lacks a frame.
const LONG_INTERVAL: f64 = 1.5;
/// Interpolation over missing frames is reported where its error elsewhere in the recording, RMS, exceeds this part of
/// the extent of the motion, ..
const GAP_ERROR: f64 = 0.01;
/// .. and so many times the error over a single frame, which noise makes.
const GAP_TO_NOISE: f64 = 3.0;
/// Complete stretches of the recording over which that error is measured: at least, and at most.
const FEWEST_STRETCHES: usize = 5;
const MOST_STRETCHES: usize = 200;
/// A step from one frame to the next is a jump where it exceeds so many times the steps in the frames around it.
const JUMP_TO_STEPS: f64 = 5.0;
/// Frames around a jump whose steps are compared, on each side, beyond the next one: a jump may take two.
const FRAMES_AROUND: usize = 4;
/// A jump exceeds so many standard deviations of the noise, ..
const JUMP_TO_NOISE: f64 = 10.0;
/// .. this part of the extent of the motion, ..
const JUMP_TO_EXTENT: f64 = 0.05;
/// .. and so many steps of the resolution of the recording, such as pixels.
const JUMP_TO_RESOLUTION: f64 = 3.0;
/// Part of the variance of a motion that lies above its bandwidth: an amplitude of a tenth.
const VARIANCE_ABOVE: f64 = 0.01;
/// Uncertainty of the noise variance that is subtracted.
const NOISE_UNCERTAINTY: f64 = 0.3;
/// Amplitude over the coordinates below which a marker is at rest: rounding errors of files with nine digits.
const STILL: f64 = 1e-9;
/// Variance of a motion, in noise variances, below which it has no bandwidth.
const LEAST_VARIANCE: f64 = 4.0;

impl Track {
    /// Without the quadratic of time that fits the places best: constant errors of an accelerometer, and a velocity at the
    /// start, make one that exceeds the motion itself.
    pub(super) fn detrended(&self) -> Self {
        let of = |marker: &Marker| {
            let seen = marker.seen.iter().zip(self.times());
            let known: Vec<(f64, [f64; 3])> =
                seen.filter_map(|(place, time)| Some((*time, (*place)?))).collect();
            let trends = [0, 1, 2].map(|c| quadratic(&known, c));
            let places = marker.seen.iter().zip(self.times());
            let places = places.map(|(place, time)| {
                let place = (*place)?;
                Some([0, 1, 2].map(|c| place[c] - trends[c](*time)))
            });
            (marker.name.clone(), places.collect())
        };
        let markers = self.markers().iter().map(of).collect();
        // As many places as before.
        Self::new(self.times().to_vec(), markers).unwrap_or_else(|_| self.clone())
    }

    /// The defects of the motion of these markers.
    pub(super) fn motion_faults(&self, driven: &[usize]) -> Vec<Fault> {
        let step = self.usual_step();
        let faults = self.moving(driven).flat_map(|(marker, least)| {
            let mut faults = missing_frames(self.times(), marker, step);
            faults.extend(jumps(self.times(), marker, step, least));
            faults
        });
        faults.collect()
    }

    /// Frequency below which 99 % of the variance of the motion of these markers lie, the fastest of them, Hz. None
    /// where no motion stands out of the noise.
    pub(super) fn bandwidth_of(&self, driven: &[usize]) -> Option<f64> {
        self.moving(driven).filter_map(|(m, _)| bandwidth(self.times(), m)).reduce(f64::max)
    }

    /// Those of these markers that move as far as counts beside the largest motion in the recording, and how far that
    /// is, m: others are held still, and jitter.
    fn moving(&self, driven: &[usize]) -> impl Iterator<Item = (&Marker, f64)> {
        let largest = self.markers().iter().map(|m| extent(&m.seen)).fold(0.0, f64::max);
        let least = MOVING * largest;
        let markers = driven.iter().filter_map(|j| self.markers().get(*j));
        markers.filter(move |m| extent(&m.seen) >= least).map(move |marker| (marker, least))
    }
}

fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|c| (a[c] - b[c]).powi(2)).sum::<f64>().sqrt()
}

/// Diagonal of the box around all places, m.
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

/// The quadratic of time that fits an axis of these places best, by Legendre polynomials on the span of the times.
fn quadratic(known: &[(f64, [f64; 3])], axis: usize) -> impl Fn(f64) -> f64 + use<> {
    let start = known.first().map_or(0.0, |(time, _)| *time);
    let length = known.last().map_or(1.0, |(time, _)| time - start).max(f64::MIN_POSITIVE);
    let basis = move |time: f64| {
        let u = 2.0 * (time - start) / length - 1.0;
        [1.0, u, 1.5 * u * u - 0.5]
    };
    let mut normal = nalgebra::Matrix3::<f64>::zeros();
    let mut right = nalgebra::Vector3::<f64>::zeros();
    for (time, place) in known {
        let row = nalgebra::Vector3::from(basis(*time));
        normal += row * row.transpose();
        right += row * place[axis];
    }
    let found = normal.lu().solve(&right).unwrap_or_default();
    move |time| nalgebra::Vector3::from(basis(time)).dot(&found)
}

/// Where frames of a marker are missing, and interpolation over so many frames is inaccurate.
fn missing_frames(times: &[f64], marker: &Marker, step: f64) -> Vec<Fault> {
    let known: Vec<(f64, [f64; 3])> =
        times.iter().zip(&marker.seen).filter_map(|(t, place)| Some((*t, (*place)?))).collect();
    let ([Some(first), Some(last)], [Some(start), Some(end)]) =
        ([known.first(), known.last()], [times.first(), times.last()])
    else {
        return Vec::new();
    };
    let missing = |from: f64, to: f64| match to - from > LONG_INTERVAL * step {
        true => ((to - from) / step).round() as usize - 1,
        false => 0,
    };
    let fault = |from: f64, to: f64, frames: usize, error: Option<f64>| Fault::MissingFrames {
        marker: marker.name.clone(),
        from,
        to,
        frames,
        error,
    };
    let mut faults = Vec::new();
    // Before the first place and after the last it is extrapolated.
    for (from, to) in [(*start, first.0), (last.0, *end)] {
        let frames = ((to - from) / step).round() as usize;
        if frames > 0 {
            faults.push(fault(from, to, frames, None));
        }
    }
    let noise = interpolation_error(&known, 1, step).unwrap_or(0.0);
    let allowed = (GAP_ERROR * extent(&marker.seen)).max(GAP_TO_NOISE * noise);
    for pair in known.windows(2) {
        let (from, to) = (pair[0].0, pair[1].0);
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

/// Error, RMS, of the interpolation over so many frames where these were recorded, m. None where there are too few such
/// stretches.
fn interpolation_error(known: &[(f64, [f64; 3])], frames: usize, step: f64) -> Option<f64> {
    // Two frames on each side determine the slopes.
    let length = frames + 4;
    let complete = |first: usize| {
        let stretch = &known[first..first + length];
        stretch.windows(2).all(|pair| pair[1].0 - pair[0].0 <= LONG_INTERVAL * step)
    };
    let starts: Vec<usize> = (0..(known.len() + 1).saturating_sub(length)).collect();
    let starts: Vec<usize> = starts.into_iter().filter(|first| complete(*first)).collect();
    if starts.len() < FEWEST_STRETCHES {
        return None;
    }
    let (mut sum, mut count) = (0.0, 0);
    for first in starts.iter().step_by(starts.len() / MOST_STRETCHES + 1) {
        let stretch = &known[*first..first + length];
        let kept = [stretch[0], stretch[1], stretch[length - 2], stretch[length - 1]];
        let bridge = Marker { name: String::new(), seen: Vec::new(), way: way(&kept) };
        for (time, place) in &stretch[2..length - 2] {
            sum += distance(bridge.at(*time), *place).powi(2);
            count += 1;
        }
    }
    Some((sum / f64::from(count)).sqrt())
}

/// Where a marker jumps from one frame to the next, by `least` at the least, and does not move so fast in the frames
/// around.
fn jumps(times: &[f64], marker: &Marker, step: f64, least: f64) -> Option<Fault> {
    let frames = marker.seen.len();
    let steps: Vec<Option<f64>> = (1..frames)
        .map(|k| {
            let (a, b) = (marker.seen[k - 1]?, marker.seen[k]?);
            (times[k] - times[k - 1] <= LONG_INTERVAL * step).then(|| distance(a, b))
        })
        .collect();
    let second = |w: &[Option<[f64; 3]>]| {
        let (a, b, c) = (w[0]?, w[1]?, w[2]?);
        Some(distance([0, 1, 2].map(|i| a[i] - 2.0 * b[i] + c[i]), [0.0; 3]) / 6.0_f64.sqrt())
    };
    let mut seconds: Vec<f64> = marker.seen.windows(3).filter_map(second).collect();
    seconds.sort_by(f64::total_cmp);
    let noise = seconds.get(seconds.len() / 2).copied().unwrap_or(0.0);
    let resolution = [0, 1, 2].map(|c| {
        let values: Vec<f64> = marker.seen.iter().flatten().map(|place| place[c]).collect();
        quantization_step(&values).unwrap_or(0.0)
    });
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
        // Beside the first and the last frame too little is known of how fast it moves.
        steps[*k].is_some_and(|own| {
            own > least && own > JUMP_TO_STEPS * most && count >= FRAMES_AROUND - 1
        })
    };
    let found: Vec<usize> = (0..steps.len()).filter(is_jump).collect();
    let distance = found.iter().filter_map(|k| steps[*k]).fold(0.0, f64::max);
    let times = found.iter().map(|k| times[k + 1]).collect();
    (!found.is_empty()).then(|| Fault::Jumps { marker: marker.name.clone(), times, distance })
}

/// Frequency below which 99 % of the variance of a motion lie beside that of white noise, Hz.
fn bandwidth(times: &[f64], marker: &Marker) -> Option<f64> {
    let (start, end) = (*times.first()?, *times.last()?);
    let intervals = intervals(times.len());
    let length = end - start;
    if !(length > 0.0 && length.is_finite()) {
        return None;
    }
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

/// Variance of the white noise along an axis, m^2; 0 where it does not show.
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
