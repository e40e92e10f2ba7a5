//! Estimate of the onset of motion (release) after a rest in a recording.
//!
//! Input: times and positions of a point, in any units; frames without all recorded coordinates are left out. The rest
//! is the last one before the first fast motion. It begins the recording, or is at least as long as the rise after it.
//! Slower motion may precede it, as that of a point that is pulled aside and held. Samples of the rest and of the
//! beginning of the motion are fitted by `x = c + a max(0, t - t0)^p` with a free `t0`. A point that is released from
//! rest accelerates (`p = 2`); after a blow it has a velocity (`p = 1`). Behind a driven support it starts more
//! smoothly (`p = 3, 4`). Least squares over `t0` and `p` is a change-point estimate (Hinkley 1970). It is accepted if
//! models without rest (a cubic, or a power from the first sample) have a larger sum of squares by more than
//! `SIGNIFICANT` residual variances.

use crate::numerics::upper_median;
use crate::numerics::vector::norm;
use std::collections::VecDeque;

/// Smallest number of samples for which an onset is searched; the fit needs [`FEWEST_AT_REST`] and [`FEWEST_MOVING`] of
/// them.
const FEWEST_SAMPLES: usize = 8;
/// Smallest number of samples at rest; with fewer the recording begins with the motion.
const FEWEST_AT_REST: usize = 3;
/// Largest range of positions at rest, as a fraction of the whole extent; tremor of a hand is smaller.
const REST_EXTENT: f64 = 0.02;
/// Range of positions in a noisy rest, in standard deviations of the noise. Smaller values reject a noisy rest, larger
/// ones accept slow motion.
const NOISE_EXTENT: f64 = 10.0;
/// Largest range that is attributed to noise, as a fraction of the whole extent; larger values accept slow motion as
/// rest.
const MOST_NOISE_EXTENT: f64 = 0.2;
/// Smallest displacement within the lag of the first fast motion, as a fraction of the largest at this lag. Smaller
/// values accept an earlier, slower motion as the first one.
const FAST: f64 = 0.5;
/// Displacement that determines the lag of the fast motion, as a fraction of the extent. Smaller ones take noise for
/// motion.
const FAST_EXTENT: f64 = 0.25;
/// Displacement at the end of the fit, as a fraction of the largest up to the end of the first fast motion; larger ones
/// do not follow a power of time.
const FITTED_PART: f64 = 0.35;
/// Smallest number of fitted samples of the motion.
const FEWEST_MOVING: usize = 4;
/// Largest number of fitted samples at rest, as the point may drift long before the onset: the larger of this number
/// and [`FITTED_REST`] for each sample of the motion.
const FITTED_AT_REST: usize = 100;
/// Number of fitted samples at rest for each sample of the motion, where that exceeds [`FITTED_AT_REST`].
const FITTED_REST: usize = 3;
/// Largest number of fitted samples, for run time; of longer windows every second, third, .. sample is used.
const MOST_FITTED: usize = 400;
/// Candidates of the onset in each of two grids, the second one over two steps of the first: the window is resolved to
/// 2e-4 of its length.
const CANDIDATES: usize = 100;
/// Least reduction of the sum of squares against models without rest, in residual variances: four standard errors.
const SIGNIFICANT: f64 = 16.0;

/// Range (highest minus lowest sample) of one axis over a sliding window, in constant time per sample. Stored are
/// number and value of the samples that are lower (`lows`), or higher (`highs`), than all later ones.
#[derive(Default)]
struct SlidingRange {
    lows: VecDeque<(usize, f64)>,
    highs: VecDeque<(usize, f64)>,
}

impl SlidingRange {
    /// Adds the sample `x` with the number `index` at the end of the window. Numbers must increase.
    fn push(&mut self, index: usize, x: f64) {
        // Samples that can never be the extreme any more are dropped: constant time per sample.
        while self.lows.back().is_some_and(|(_, low)| *low >= x) {
            self.lows.pop_back();
        }
        while self.highs.back().is_some_and(|(_, high)| *high <= x) {
            self.highs.pop_back();
        }
        self.lows.push_back((index, x));
        self.highs.push_back((index, x));
    }

    /// Removes the samples whose number is below `first`, at the beginning of the window.
    fn forget_before(&mut self, first: usize) {
        for list in [&mut self.lows, &mut self.highs] {
            while list.front().is_some_and(|(index, _)| *index < first) {
                list.pop_front();
            }
        }
    }

    /// Highest minus lowest sample of the window; 0 without samples.
    fn range(&self) -> f64 {
        match (self.lows.front(), self.highs.front()) {
            (Some((_, low)), Some((_, high))) => high - low,
            _ => 0.0,
        }
    }
}

/// Times and positions (unit of the recording) of a point in the frames with all recorded axes.
struct MotionSamples {
    /// Ascending times, in the unit of the recording.
    times: Vec<f64>,
    /// Position at each time; 0 along axes that are not recorded.
    places: Vec<[f64; 3]>,
}

/// Time of the onset of motion of a point that is at rest first, in the unit of `times`, between the samples. The rest
/// may follow slower motion, of a point that is pulled aside and held before its release. The largest range of
/// positions at rest is tried twice, by the extent of the motion and by the noise; the later onset is taken. Frames
/// without all recorded axes are left out. None if the recording begins with the motion, no motion exceeds the noise,
/// or there are fewer than [`FEWEST_SAMPLES`] samples.
pub(crate) fn onset_of_motion(times: &[f64], places: &[[Option<f64>; 3]]) -> Option<f64> {
    let samples = MotionSamples::of(times, places)?;
    let extent = samples.extent();
    let [still, noisy] = [REST_EXTENT * extent, NOISE_EXTENT * samples.noise()];
    // Second differences of few frames a swing exceed the noise: then the onset is found without it.
    let ranges = [still, noisy.clamp(still, MOST_NOISE_EXTENT * extent)];
    let onsets = ranges.into_iter().filter_map(|allowed| {
        let (rest, end) = samples.rest_before_motion(extent, allowed)?;
        samples.window(rest, end).onset()
    });
    // The later onset: noise may hide the beginning of a slow motion.
    onsets.reduce(f64::max)
}

impl MotionSamples {
    /// The samples of a recording in the frames that have all recorded axes. Axes that are never recorded are zero.
    /// None for fewer than [`FEWEST_SAMPLES`].
    fn of(times: &[f64], places: &[[Option<f64>; 3]]) -> Option<Self> {
        let seen = [0, 1, 2].map(|c| places.iter().any(|place| place[c].is_some()));
        let whole = |place: &[Option<f64>; 3]| (0..3).all(|c| place[c].is_some() == seen[c]);
        let (times, places): (Vec<f64>, Vec<[f64; 3]>) = times
            .iter()
            .zip(places)
            .filter(|(_, place)| whole(place))
            .map(|(t, place)| (*t, place.map(Option::unwrap_or_default)))
            .unzip();
        (times.len() >= FEWEST_SAMPLES).then_some(Self { times, places })
    }

    /// Distance between the positions of samples `i` and `j`, in their unit.
    fn distance(&self, i: usize, j: usize) -> f64 {
        norm([0, 1, 2].map(|c| self.places[i][c] - self.places[j][c]))
    }

    /// Diagonal of the bounding box of all positions, in their unit.
    fn extent(&self) -> f64 {
        let along = |c: usize| {
            let values = self.places.iter().map(|place| place[c]);
            let range = values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| {
                [low.min(x), high.max(x)]
            });
            range[1] - range[0]
        };
        norm([0, 1, 2].map(along))
    }

    /// Standard deviation of the noise, of all axes together: the median (upper of two) length of the second
    /// differences of successive samples over `sqrt(6)`. Zero for fewer than three samples.
    fn noise(&self) -> f64 {
        let second = |w: &[[f64; 3]]| {
            norm([0, 1, 2].map(|c| w[0][c] - 2.0 * w[1][c] + w[2][c])) / 6.0_f64.sqrt()
        };
        upper_median(self.places.windows(3).map(second)).unwrap_or(0.0)
    }

    /// Indices of the first and the last sample of the first fast motion; `extent` is that of all positions. The lag
    /// between both is the smallest power of two, in samples, at which some displacement is at least [`FAST_EXTENT`] of
    /// the extent. The motion is the first with at least [`FAST`] times the largest displacement at this lag. None
    /// without such a displacement.
    fn fast(&self, extent: f64) -> Option<[usize; 2]> {
        let count = self.places.len();
        // The lag doubles until a displacement of a quarter of the extent is found within it.
        let mut lag = 1;
        while lag < count {
            let way = |k: usize| self.distance(k, k + lag);
            let most = (0..count - lag).map(way).fold(0.0, f64::max);
            if most >= FAST_EXTENT * extent && most > 0.0 {
                return (0..count - lag).find(|k| way(*k) >= FAST * most).map(|k| [k, k + lag]);
            }
            lag *= 2;
        }
        None
    }

    /// Indices of the first sample to be fitted, in the last rest before the first fast motion, and of the last one;
    /// none without a rest. At rest the diagonal of the ranges of positions is at most `allowed`; `extent` is that of
    /// all positions. A rest has at least [`FEWEST_AT_REST`] samples. It begins the recording, or lasts at least as
    /// long as the rise from its end to the end of the fast motion. The fit ends where the displacement from the rest
    /// reaches [`FITTED_PART`] of the largest up to the end of the fast motion, after at least [`FEWEST_MOVING`]
    /// samples. Of a long rest only the last samples are fitted ([`FITTED_AT_REST`], [`FITTED_REST`]).
    fn rest_before_motion(&self, extent: f64, allowed: f64) -> Option<(usize, usize)> {
        let [fast, end] = self.fast(extent)?;
        let mut found = None;
        let mut first = 0;
        let mut window = [(); 3].map(|()| SlidingRange::default());
        for last in 0..=fast {
            // The longest window that ends here and stays within the allowed range.
            for (range, x) in window.iter_mut().zip(self.places[last]) {
                range.push(last, x);
            }
            while norm(window.each_ref().map(SlidingRange::range)) > allowed {
                first += 1;
                window.iter_mut().for_each(|range| range.forget_before(first));
            }
            let rest = self.times[last] - self.times[first];
            let rise = self.times[end] - self.times[last];
            // Turning points of an oscillation are shorter than its rise.
            if last + 1 - first >= FEWEST_AT_REST && (first == 0 || rest >= rise) {
                found = Some((first, last));
            }
        }
        let (first, last) = found?;
        let most = (last..=end).map(|k| self.distance(first, k)).fold(0.0, f64::max);
        // Only the beginning of the motion is fitted: it follows a power of time.
        let moved = (last..=end).find(|k| self.distance(first, *k) >= FITTED_PART * most)?;
        let end = moved.max(last + FEWEST_MOVING).min(self.times.len() - 1);
        let fitted_rest = FITTED_AT_REST.max(FITTED_REST * (end - last));
        Some((first.max(last.saturating_sub(fitted_rest)), end))
    }

    /// Samples from `first` to `last`: all, or at most about [`MOST_FITTED`] evenly spaced ones of a longer window.
    fn window(&self, first: usize, last: usize) -> Self {
        let stride = (last - first) / MOST_FITTED + 1;
        Self {
            times: self.times[first..=last].iter().step_by(stride).copied().collect(),
            places: self.places[first..=last].iter().step_by(stride).copied().collect(),
        }
    }

    /// Time of the onset by least squares over a grid of [`CANDIDATES`], refined once, with the best of the powers 1 to
    /// 4. None with fewer than [`FEWEST_AT_REST`] plus [`FEWEST_MOVING`] samples, or fewer than [`FEWEST_AT_REST`] up
    /// to the onset. None also if a model without rest (a power from the first sample, or a cubic) fits nearly as well,
    /// within [`SIGNIFICANT`] residual variances.
    fn onset(&self) -> Option<f64> {
        let count = self.times.len();
        let [first, last] = [self.times[0], self.times[count - 1]];
        if count < FEWEST_AT_REST + FEWEST_MOVING {
            return None;
        }
        // Models c + a (t - onset)^p with p = 1 to 4; the best of them counts.
        let squares = |onset: f64| {
            (1..=4).map(|power| self.squares_of_power(onset, power)).fold(f64::INFINITY, f64::min)
        };
        let (mut low, mut high) = (first, last);
        let mut best = (f64::INFINITY, first);
        // Two grids, the second one within the best interval of the first.
        for _ in 0..2 {
            let step = (high - low) / CANDIDATES as f64;
            for k in 0..CANDIDATES {
                let onset = low + step * k as f64;
                let sum = squares(onset);
                if sum < best.0 {
                    best = (sum, onset);
                }
            }
            [low, high] = [(best.1 - step).max(first), (best.1 + step).min(last)];
        }
        let (sum, onset) = best;
        let at_rest = self.times.iter().filter(|t| **t <= onset).count();
        // Models without rest: a power of time from the first sample on, or a cubic.
        let without_rest = squares(first).min(self.squares_of_cubic());
        let variance = sum / (count - FEWEST_AT_REST) as f64;
        (at_rest >= FEWEST_AT_REST && without_rest - sum > SIGNIFICANT * variance).then_some(onset)
    }

    /// Sum of squared residuals, all axes, of the least-squares fit of `c + a max(0, t - onset)^power`, with free `c`
    /// and `a` for each axis.
    fn squares_of_power(&self, onset: f64, power: i32) -> f64 {
        let basis: Vec<f64> = self.times.iter().map(|t| (t - onset).max(0.0).powi(power)).collect();
        self.squares_beside(&[vec![1.0; basis.len()], basis])
    }

    /// Sum of squared residuals, all axes, of the least-squares fit of a cubic of time to each axis.
    fn squares_of_cubic(&self) -> f64 {
        let (first, last) = (self.times[0], self.times[self.times.len() - 1]);
        let unit = |t: &f64| 2.0 * (t - first) / (last - first) - 1.0;
        let power = |p: i32| self.times.iter().map(|t| unit(t).powi(p)).collect();
        self.squares_beside(&[0, 1, 2, 3].map(power))
    }

    /// Sum of squared residuals of the positions, all axes, after linear least squares with the basis functions
    /// `columns` (Gram-Schmidt orthogonalization). Dependent columns have no effect.
    fn squares_beside(&self, columns: &[Vec<f64>]) -> f64 {
        let mut basis: Vec<Vec<f64>> = Vec::with_capacity(columns.len());
        let remove = |from: &mut [f64], basis: &[Vec<f64>]| {
            for direction in basis {
                let part: f64 = from.iter().zip(direction).map(|(x, e)| x * e).sum();
                from.iter_mut().zip(direction).for_each(|(x, e)| *x -= part * e);
            }
        };
        // Gram-Schmidt: orthonormal columns, of which the projections are removed from the
        // positions.
        for column in columns {
            let mut direction = column.clone();
            remove(&mut direction, &basis);
            let length = direction.iter().map(|x| x * x).sum::<f64>().sqrt();
            if length > 0.0 {
                direction.iter_mut().for_each(|x| *x /= length);
                basis.push(direction);
            }
        }
        let along = |c: usize| {
            let mut values: Vec<f64> =
                self.places.iter().map(|place| place[c] - self.places[0][c]).collect();
            remove(&mut values, &basis);
            values.iter().map(|x| x * x).sum::<f64>()
        };
        (0..3).map(along).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    /// Period of the swing, s.
    const PERIOD: f64 = 0.6;
    const RATE: f64 = 100.0;

    /// Two seconds of a motion after a rest, m, with noise of 0.1 mm.
    fn recorded(rest: f64, motion: impl Fn(f64) -> f64) -> (Vec<f64>, Vec<[Option<f64>; 3]>) {
        let count = ((rest + 2.0) * RATE) as usize;
        let times: Vec<f64> = (0..count).map(|k| k as f64 / RATE).collect();
        let noise = |k: usize| 1e-4 * ((k * 7919) as f64).sin();
        let place = |(k, t): (usize, &f64)| {
            [Some(0.5 + noise(k)), Some(motion(t - rest) + noise(k + 9)), None]
        };
        let places = times.iter().enumerate().map(place).collect();
        (times, places)
    }

    /// Damped oscillation, m, at the time `t` since the release, s.
    fn swing(t: f64) -> f64 {
        0.05 * (-0.5 * t).exp() * (TAU * t / PERIOD).cos()
    }

    /// Held aside until the release at t = 0, then the damped oscillation, m.
    fn released(t: f64) -> f64 {
        if t < 0.0 { 0.05 } else { swing(t) }
    }

    /// At rest until a blow at t = 0, then an oscillation with a velocity at its start, m.
    fn struck(t: f64) -> f64 {
        if t < 0.0 { 0.0 } else { 0.05 * (TAU * t / PERIOD).sin() }
    }

    /// Pulled aside from 1.4 to 0.6 s before its release, and held.
    fn held(t: f64) -> f64 {
        let pulled = ((t + 1.4) / 0.8).clamp(0.0, 1.0);
        if t < 0.0 { 0.05 * pulled * pulled * (3.0 - 2.0 * pulled) } else { swing(t) }
    }

    #[test]
    fn onset_is_found_within_a_frame() {
        for (name, motion, rest) in [
            ("released", released as fn(f64) -> f64, 0.2),
            ("released", released, 1.0),
            ("struck", struck, 0.2),
            ("struck", struck, 1.0),
            ("held", held, 2.0),
        ] {
            let (times, places) = recorded(rest, motion);
            let onset = onset_of_motion(&times, &places).unwrap();
            // The onset lies between two frames.
            assert!((onset - rest).abs() <= 1.0 / RATE, "{name} at {rest} s: {onset} s");
        }
    }

    #[test]
    fn motion_from_the_first_frame_has_no_onset() {
        for phase in 0..12 {
            let shift = f64::from(phase) / 12.0 * PERIOD;
            let (times, places) = recorded(0.0, |t| swing(t + shift));
            assert_eq!(onset_of_motion(&times, &places), None, "{phase}");
        }
    }

    #[test]
    fn onset_is_found_in_long_recordings() {
        // 2000 s of rest: the fitted window must not grow with them.
        let (times, places) = recorded(2000.0, released);
        let onset = onset_of_motion(&times, &places).unwrap();
        assert!((onset - 2000.0).abs() <= 1.0 / RATE, "{onset}");
    }

    #[test]
    fn recordings_without_motion_have_no_onset() {
        let (times, mut places) = recorded(0.0, |_| 0.0);
        assert_eq!(onset_of_motion(&times, &places), None);
        places.iter_mut().for_each(|place| *place = [None; 3]);
        assert_eq!(onset_of_motion(&times, &places), None);
        assert_eq!(onset_of_motion(&[], &[]), None);
    }
}
