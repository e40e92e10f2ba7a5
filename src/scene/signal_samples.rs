//! Samples of a signal from a file, as a piecewise polynomial of time, and their defects.
//!
//! Input: a table with the columns `t` and `value`, or lists of them, and the interpolation. Linear pieces connect the
//! samples. Cubic pieces are the spline with continuous second derivatives, whose end slopes are those of the
//! polynomials through the (at most) four outermost samples. Before the first sample and after the last one the signal
//! is constant.
//!
//! Output is [`SignalSamples`] with these pieces, the time of the last sample and the median interval, s, the
//! bandwidth, Hz, and warnings of missing samples. Bandwidth and missing samples are found as for a recorded motion
//! ([`Track`]). Rejected are missing columns, times that do not increase, fewer than two samples, and a first time
//! after 0.

use crate::code::Code;
use crate::error::Error;
use crate::scene::track::{CLOCK_TOLERANCE, Track, median_step};
use crate::scene::track_defect::TrackDefect;
use marker_files::table::{TIMES, Table};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Interpolation between the samples of a signal.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum Interpolation {
    /// Straight lines.
    #[default]
    Linear,
    /// A cubic spline with continuous second derivatives.
    Cubic,
}

/// The samples of a signal, as polynomials of time between them.
#[derive(Clone, Debug, PartialEq)]
pub struct SignalSamples {
    /// Times of the samples, s, increasing.
    pub(super) times: Vec<f64>,
    /// Coefficients of the polynomial in the time since each sample, ascending from the constant; one for each sample.
    /// The last one is constant.
    pub(super) pieces: Vec<[f64; 4]>,
    /// Missing samples.
    faults: Vec<TrackDefect>,
    /// Frequency, Hz, below which 99 % of the variance lie; none for a signal that does not exceed its noise.
    bandwidth: Option<f64>,
}

impl SignalSamples {
    /// Reads a table with the columns `t` (unit in brackets, otherwise s) and `value`. Blank values are missing
    /// samples, over which the neighbors are interpolated.
    ///
    /// # Errors
    /// A file that cannot be read, missing columns, a unit of the values, times that do not increase, fewer than two
    /// samples, and a first time after 0. The error has the line.
    pub(super) fn read(path: &Path, interpolation: Interpolation) -> Result<Self, Error> {
        let table = Table::read(path)?;
        let (time, value) = (table.require("t")?, table.require("value")?);
        let unit = table.factor(time, &TIMES, "")?;
        table.factor(value, &[], "none; state it as the signal's gain")?;
        let (mut times, mut values) = (Vec::<f64>::new(), Vec::new());
        for row in &table.rows {
            let Some(t) = row.values[time].map(|t| t * unit) else {
                let message = "found no time in column `t`, allowed: a finite number";
                return Err(table.error(row.line, message).into());
            };
            if let Some(before) = times.last()
                && t <= *before
            {
                let message =
                    format!("found the time {t} s after {before} s, allowed: increasing times");
                return Err(table.error(row.line, &message).into());
            }
            if times.is_empty() && t > CLOCK_TOLERANCE {
                let message = format!(
                    "found {t} s as the first time, allowed: 0 s or earlier. Use the signal's delay to shift it"
                );
                return Err(table.error(row.line, &message).into());
            }
            times.push(t);
            values.push(row.values[value]);
        }
        Self::new(times, &values, interpolation).map_err(|message| table.error(1, &message).into())
    }

    /// The signal through `values`, one for each of the increasing `times`, s, or none where it is missing. Missing
    /// samples become defects unless interpolation over them is accurate, and the bandwidth is that of a recorded
    /// motion.
    ///
    /// # Errors
    /// A message for fewer than two values.
    pub(super) fn new(
        times: Vec<f64>,
        values: &[Option<f64>],
        interpolation: Interpolation,
    ) -> Result<Self, String> {
        let samples: Vec<[f64; 2]> =
            times.iter().zip(values).filter_map(|(t, x)| Some([*t, (*x)?])).collect();
        if samples.len() < 2 {
            return Err(format!("found {} samples, allowed: at least two", samples.len()));
        }
        // Missing samples and bandwidth as those of a point that moves along an axis.
        let seen = values.iter().map(|x| Some([(*x)?, 0.0, 0.0])).collect();
        let track = Track::new(times, vec![(String::new(), seen)])?.with_motion_defects(&[0]);
        // A jump of a signal is no defect: its impulse is exact.
        let is_gap = |fault: &&TrackDefect| matches!(fault, TrackDefect::MissingFrames { .. });
        let faults = track.faults().iter().filter(is_gap).cloned().collect();
        let pieces = match interpolation {
            Interpolation::Linear => linear_pieces(&samples),
            Interpolation::Cubic => cubic_pieces(&samples),
        };
        let times = samples.iter().map(|[t, _]| *t).collect();
        Ok(Self { times, pieces, faults, bandwidth: track.bandwidth() })
    }

    /// Time of the last sample, s.
    pub(super) fn end(&self) -> f64 {
        self.times[self.times.len() - 1]
    }

    /// Median (upper of two) time between two samples, s, without the missing ones.
    pub(super) fn usual_step(&self) -> f64 {
        median_step(&self.times)
    }

    /// Frequency, Hz, below which 99 % of the variance lie; none for a signal that does not exceed its noise.
    pub(super) fn bandwidth(&self) -> Option<f64> {
        self.bandwidth
    }

    /// Warnings, with codes, of missing samples; the texts begin with the path of the `file`.
    pub(super) fn warnings(&self, file: &Path) -> Vec<(Code, String)> {
        let text = |fault: &TrackDefect| match fault {
            TrackDefect::MissingFrames { from, to, frames, .. } => format!(
                "{}: {frames} samples are missing from t = {from:.4} s to {to:.4} s. The signal there is interpolated. \
                 Fill the gap in the program that recorded it, or simulate another part",
                file.display()
            ),
            other => format!("{}: {other}", file.display()),
        };
        self.faults.iter().map(|fault| (fault.code(), text(fault))).collect()
    }
}

/// Coefficients of the straight lines between the samples `[time, value]`, ascending in the time since each sample;
/// that after the last one is constant.
fn linear_pieces(samples: &[[f64; 2]]) -> Vec<[f64; 4]> {
    let mut pieces: Vec<[f64; 4]> = samples
        .windows(2)
        .map(|w| [w[0][1], (w[1][1] - w[0][1]) / (w[1][0] - w[0][0]), 0.0, 0.0])
        .collect();
    pieces.push([samples[samples.len() - 1][1], 0.0, 0.0, 0.0]);
    pieces
}

/// The derivative, at the first of `samples`, `[time, value]`, of the polynomial through all of them.
fn end_slope(samples: &[[f64; 2]]) -> f64 {
    let [t0, x0] = samples[0];
    let mut slope = 0.0;
    for (j, [tj, xj]) in samples.iter().enumerate().skip(1) {
        let mut weight = 1.0 / (tj - t0);
        for (m, [tm, _]) in samples.iter().enumerate().skip(1).filter(|(m, _)| *m != j) {
            debug_assert!(m > 0);
            weight *= (t0 - tm) / (tj - tm);
        }
        slope += weight * (xj - x0);
    }
    slope
}

/// Coefficients of the cubic spline through the samples `[time, value]`, ascending in the time since each sample; that
/// after the last one is constant. The slopes `s` solve `s[i-1]/h[i-1] + 2 (1/h[i-1] + 1/h[i]) s[i] + s[i+1]/h[i] = 3
/// (d[i-1]/h[i-1] + d[i]/h[i])` with the slopes `d` of the chords over the intervals `h`. The outermost two are given
/// by [`end_slope`] of up to four samples.
fn cubic_pieces(samples: &[[f64; 2]]) -> Vec<[f64; 4]> {
    let n = samples.len();
    let h: Vec<f64> = samples.windows(2).map(|w| w[1][0] - w[0][0]).collect();
    let d: Vec<f64> =
        samples.windows(2).map(|w| (w[1][1] - w[0][1]) / (w[1][0] - w[0][0])).collect();
    let outermost = n.min(4);
    let last: Vec<[f64; 2]> = samples[n - outermost..].iter().rev().copied().collect();
    let mut slopes = vec![0.0; n];
    (slopes[0], slopes[n - 1]) = (end_slope(&samples[..outermost]), end_slope(&last));
    // Elimination of the tridiagonal system of the inner slopes.
    let mut upper = vec![0.0; n];
    for i in 1..n - 1 {
        let (a, c) = (1.0 / h[i - 1], 1.0 / h[i]);
        let pivot = 2.0 * (a + c) - a * upper[i - 1];
        upper[i] = c / pivot;
        slopes[i] = (3.0 * (d[i - 1] * a + d[i] * c) - a * slopes[i - 1]) / pivot;
    }
    for i in (1..n - 1).rev() {
        slopes[i] -= upper[i] * slopes[i + 1];
    }
    let piece = |i: usize| {
        let [s0, s1] = [slopes[i], slopes[i + 1]];
        let second = (3.0 * d[i] - 2.0 * s0 - s1) / h[i];
        [samples[i][1], s0, second, (s0 + s1 - 2.0 * d[i]) / (h[i] * h[i])]
    };
    let mut pieces: Vec<[f64; 4]> = (0..n - 1).map(piece).collect();
    pieces.push([samples[n - 1][1], 0.0, 0.0, 0.0]);
    pieces
}
