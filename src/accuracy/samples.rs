//! Times at which the runs of a motion are compared: about 140 to 180, not equidistant. Their number does not depend on
//! the steps of the runs.
//!
//! Input: the signals and the end time of the scene, and the record of the first trial run that reached the end. Output
//! of [`sample_times`]: ascending times, s, after 0 and up to the end. There are four kinds.
//!
//! - One in each of [`TIME_INTERVALS`] equal intervals of the time, at the fraction `k/phi mod 1` of interval `k` (from
//!   1), with the golden ratio `phi`. Equidistant times would meet one phase only of a motion whose period divides the
//!   interval.
//! - One in each of [`PATH_INTERVALS`] equal intervals of the path, at the fraction `(1/2 + k/phi) mod 1`. The path is
//!   the integral over time of the largest speed of the recorded nodes. A short and fast motion has many of these
//!   times.
//! - Kinks of signals (ramp, pulse, steps), and times after them and after the start. The delays after a kink are the
//!   time to the next one, divided by powers of [`DELAY_RATIO`]: the duration of the response need not be known.
//! - The end.
//!
//! Positions at these times are interpolated in the record of each run (cubic Hermite), as at any other time.

use crate::dynamics::record::{Motion, Record};
use crate::scene::{Signal, SignalKind};

/// Number of times in equal intervals of time. More times detect errors of shorter motions.
const TIME_INTERVALS: usize = 100;
/// Number of times in equal intervals of the path. They are 3 % of the path apart, which resolves the turning points of
/// a single fast motion.
const PATH_INTERVALS: usize = 32;
/// Largest number of kinks, the start included, after which there are times. A limit of the cost.
const MAX_KINKS: usize = 8;
/// Number of times after each kink.
const DELAYS: i32 = 5;
/// Ratio of successive delays after a kink: the shortest one is a thousandth of the time to the next kink.
const DELAY_RATIO: f64 = 4.0;
/// Shift of the sequence in intervals of the path. A motion of constant speed has other times there than in intervals
/// of time.
const PATH_SHIFT: f64 = 0.5;
/// The inverse of the golden ratio.
const INVERSE_GOLDEN_RATIO: f64 = 0.618_033_988_749_894_9;

/// Times at which runs of a scene with these `signals` up to `end`, s, are compared: ascending, above 0 and at most
/// `end`. `record` is that of a run up to the end.
pub(super) fn sample_times(signals: &[Signal], end: f64, record: &Record) -> Vec<f64> {
    let mut times: Vec<f64> = fractions(TIME_INTERVALS, 0.0).map(|part| part * end).collect();
    times.extend(times_of_equal_path(record));
    times.extend(times_after_kinks(&kinks(signals, end), end));
    times.push(end);
    times.retain(|time| *time > 0.0 && *time <= end);
    times.sort_unstable_by(f64::total_cmp);
    times.dedup();
    times
}

/// One fraction in each of `count` equal intervals from 0 to 1, ascending. That of interval `k` is at the fractional
/// part of `shift + (k + 1)/phi` in it, with the golden ratio `phi`.
fn fractions(count: usize, shift: f64) -> impl Iterator<Item = f64> {
    (0..count).map(move |k| {
        let place = (shift + INVERSE_GOLDEN_RATIO * (k + 1) as f64).fract();
        (k as f64 + place) / count as f64
    })
}

/// Times, s, at fractions of the path of the recorded nodes, one in each of [`PATH_INTERVALS`] equal intervals of it.
/// Between records the path is linear in time. None for a motion without a path, or a path that is not finite.
fn times_of_equal_path(record: &Record) -> Vec<f64> {
    let (times, tracked) = (record.times(), record.tracked().len());
    let mut motions = record.tracked_motions();
    let square = |[_, velocity]: &Motion| velocity.iter().map(|v| v * v).sum::<f64>();
    // The largest speed of the nodes at every record.
    let speeds: Vec<f64> = (0..times.len())
        .map(|_| motions.by_ref().take(tracked).map(square).fold(0.0, f64::max).sqrt())
        .collect();
    // The path at every record, by the trapezoidal rule.
    let mut path = vec![0.0];
    for (time, speed) in times.windows(2).zip(speeds.windows(2)) {
        path.push(path[path.len() - 1] + 0.5 * (time[1] - time[0]) * (speed[0] + speed[1]));
    }
    let whole = path[path.len() - 1];
    if !whole.is_finite() || whole <= 0.0 {
        return Vec::new();
    }
    let time_at = |part: f64| {
        let traveled = part * whole;
        let k = path.partition_point(|before| *before <= traveled).clamp(1, path.len() - 1);
        let within = (traveled - path[k - 1]) / (path[k] - path[k - 1]);
        times[k - 1] + within * (times[k] - times[k - 1])
    };
    fractions(PATH_INTERVALS, PATH_SHIFT).map(time_at).filter(|time| time.is_finite()).collect()
}

/// The start of the motion, 0, and the times before `end` at which a signal has a kink or a jump, s, ascending. Of more
/// than [`MAX_KINKS`] every second is returned, or every third and so on.
fn kinks(signals: &[Signal], end: f64) -> Vec<f64> {
    let mut kinks: Vec<f64> = signals.iter().flat_map(kinks_of).collect();
    kinks.retain(|time| *time > 0.0 && *time < end);
    kinks.push(0.0);
    kinks.sort_unstable_by(f64::total_cmp);
    kinks.dedup();
    let every = kinks.len().div_ceil(MAX_KINKS);
    kinks.into_iter().step_by(every).collect()
}

/// The times at which a ramp, a pulse or steps have a kink or a jump, s. None for a sine and for samples.
fn kinks_of(signal: &Signal) -> Vec<f64> {
    let begin = signal.start.unwrap_or(0.0);
    let end = begin + signal.duration.unwrap_or(1.0);
    let own = match signal.kind {
        Some(SignalKind::Ramp) => vec![begin, end],
        Some(SignalKind::Pulse) => {
            let rise = signal.rise.unwrap_or(0.0);
            vec![begin, begin + rise, end - rise, end]
        }
        Some(SignalKind::Steps) => signal.times.clone(),
        Some(SignalKind::Sine) | None => Vec::new(),
    };
    own.into_iter().map(|time| time + signal.delay).collect()
}

/// The ascending `kinks`, s, and [`DELAYS`] times after each of them: at distances `g r^-j`, `j` from 1. `g` is the
/// time to the next kink or to `end`, and `r` is [`DELAY_RATIO`].
fn times_after_kinks(kinks: &[f64], end: f64) -> Vec<f64> {
    let next = kinks.iter().skip(1).chain(std::iter::once(&end));
    let after = |(kink, next): (&f64, &f64)| {
        let (kink, gap) = (*kink, next - kink);
        let delays = (1..=DELAYS).map(move |j| gap * DELAY_RATIO.powi(-j));
        std::iter::once(kink).chain(delays.map(move |delay| kink + delay)).collect::<Vec<f64>>()
    };
    kinks.iter().zip(next).flat_map(after).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sample_times_have_one_time_per_interval_and_all_phases_of_a_periodic_motion() {
        let parts: Vec<f64> = fractions(TIME_INTERVALS, 0.0).collect();
        for (k, part) in parts.iter().enumerate() {
            assert_eq!((part * TIME_INTERVALS as f64).floor() as usize, k);
        }
        // Motions whose period divides the hundredth part of the time: equidistant times have one phase only.
        for periods in [1.0, 2.0, 3.0, 5.0] {
            let phase = |part: &f64| (periods * TIME_INTERVALS as f64 * part).fract();
            let mut phases: Vec<f64> = parts.iter().map(phase).collect();
            phases.sort_unstable_by(f64::total_cmp);
            let gap = phases.windows(2).map(|pair| pair[1] - pair[0]).fold(0.0, f64::max);
            // A mean gap is 1 % of a period.
            assert!(gap < 0.05, "{periods}: {gap}");
        }
    }

    /// A node moves within the first of 1000 steps, and then rests: 0.1 % of the time.
    #[test]
    fn sample_times_of_a_short_motion_are_within_it() {
        let mut record = Record::new([3], 0);
        for k in 0..=1000 {
            let speed = if k == 0 { 20.0 } else { 0.0 };
            record.push(0.1 * f64::from(k), std::iter::once([[0.0; 3], [speed, 0.0, 0.0]]));
        }
        let times = sample_times(&[], 100.0, &record);
        let count = times.iter().filter(|time| **time < 0.1).count();
        assert!(count >= PATH_INTERVALS, "{count}");
        assert!(times.windows(2).all(|pair| pair[0] < pair[1]) && times[0] > 0.0);
        assert_eq!(times.last(), Some(&100.0));
    }

    #[test]
    fn sample_times_follow_each_kink_of_a_signal() {
        let pulse = Signal {
            kind: Some(SignalKind::Pulse),
            duration: Some(0.5),
            rise: Some(0.125),
            delay: 1.0,
            ..Signal::new("p")
        };
        let kinks = kinks(&[pulse], 64.0);
        assert_eq!(kinks, [0.0, 1.0, 1.125, 1.375, 1.5]);
        let times = times_after_kinks(&kinks, 64.0);
        assert_eq!(times.len(), kinks.len() * (1 + DELAYS as usize));
        // A quarter of the time to the next kink, and a quarter and a 1024th part of that to the end.
        for expected in [0.25, 1.031_25, 1.5 + 15.625, 1.5 + 62.5 / 1024.0] {
            assert!(times.iter().any(|time| (time - expected).abs() < 1e-12), "{expected}");
        }
        let steps = Signal {
            kind: Some(SignalKind::Steps),
            times: (1..=100).map(f64::from).collect(),
            values: vec![1.0; 100],
            ..Signal::new("s")
        };
        assert!(super::kinks(&[steps], 200.0).len() <= MAX_KINKS);
    }
}
