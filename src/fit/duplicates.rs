//! Rejects a fit whose measurements contain the same samples twice. Input: the measurements of all experiments,
//! planned ones excepted. Output: an error that names the measurements, or `Ok`. Fitted twice, data make intervals
//! too narrow by the square root of 2; as validation data they validate nothing.
//!
//! Measurements of one kind and unit are compared coordinate by coordinate, at common times or arc lengths (within
//! [`SAME_TIME`] of the interval between samples). They are duplicates if, in every coordinate with common samples,
//! these are at least [`SHARED`] of the shorter record and at least [`EQUAL`] of them have equal values. One
//! coordinate also needs [`FEWEST`] distinct equal values, or [`FEWEST_OF_A_LIST`] if all samples of both are equal.
//! A copy may be in other units or have fewer digits. So values are equal within [`SAME`] of the largest value, or
//! within half of the last decimal of the coarser copy. That decimal counts only up to [`FINE`] of the range
//! ([`FINE_OF_A_LIST`] for other data than motions). Parts of a recording that do not overlap in time have no common
//! samples. Two lists of natural frequencies are duplicates if the longer one contains the shorter, with the same
//! filter of modes; of different experiments at least [`FEWEST_OF_A_LIST`] must be equal. Two critical loads are
//! duplicates if load and value are those of the other, in one experiment.
//!
//! Rows of one shape or one load-deflection curve are compared with each other too ([`repeated_rows`]). They are
//! duplicates if at least [`EQUAL`] of the rows at the point (or the load) of an earlier row have its values, bit by
//! bit, with at least [`FEWEST_OF_A_LIST`] distinct values. Repeated measurements have different values, unless the
//! last decimal is coarser than [`FINE_OF_A_LIST`] of the range; then nothing is compared.

use crate::error::Error;
use crate::fit::measurement::Measurement;
use crate::fit::measurement::buckling::BucklingLoad;
use crate::fit::measurement::dataset::Coordinate;
use crate::fit::measurement::experiment::Experiment;
use crate::fit::measurement::frequencies::{Frequency, ModeFrequencies};
use crate::fit::measurement::load_deflection::LoadedPoint;
use crate::fit::measurement::shape::ShapePoint;
use crate::fit::validate::measurement_key;
use crate::numerics::{total_order, upper_median};
use crate::problem::Problem;
use crate::scene::Point;
use std::collections::HashSet;

/// Largest relative difference of equal numbers in two units. Unit conversions differ by rounding only, about 1e-16;
/// measured values coincide to 1e-9 only as copies.
const SAME: f64 = 1e-9;
/// Largest difference of equal times (or arc lengths), as a fraction of the median interval between samples. A larger
/// fraction pairs samples of different frames.
const SAME_TIME: f64 = 0.01;
/// Smallest number of distinct common values of a coordinate of duplicates. Fewer may be equal by chance.
const FEWEST: usize = 8;
/// Like [`FEWEST`], for coordinates that are equal as a whole (all samples of both, as of shapes), and for frequencies
/// of two experiments.
const FEWEST_OF_A_LIST: usize = 3;
/// Smallest number of common times of duplicates, as a fraction of the samples of the shorter record. A smaller
/// fraction compares records that hardly overlap, whose few common values may be equal by chance.
const SHARED: f64 = 0.2;
/// Smallest fraction of equal values at the common times of duplicates. Copies may have a few corrected values; a
/// smaller fraction rejects repeated measurements.
const EQUAL: f64 = 0.95;
/// Largest number of decimals of a rounded number; 1e-9 m is below the resolution of any camera.
const MOST_DECIMALS: i32 = 9;
/// Largest last decimal of a copy, over the range of its values: 1 mm of 0.2 m. Coarser pixels than that and than 20
/// times the noise make independent recordings equal in nearly all values; with finer ones or more noise fewer than
/// [`EQUAL`] are.
const FINE: f64 = 5e-3;
/// Like [`FINE`], for other measurements than motions, whose few values may be equal within a millimeter.
const FINE_OF_A_LIST: f64 = 1e-4;

/// One coordinate of a measurement as a series, in ascending order of its abscissas.
struct CoordinateRecord {
    /// Name of the coordinate.
    axis: &'static str,
    /// Times, s, or arc lengths, m.
    abscissas: Vec<f64>,
    values: Vec<f64>,
    /// Half of the last decimal of the values; zero if they are not rounded, or coarser than [`FINE`].
    rounding: f64,
}

/// A measurement of an experiment with its coordinates, for the comparison with the measurements listed before it.
struct ListedMeasurement<'a> {
    experiment: &'a Experiment,
    /// Index of the measurement in the experiment.
    index: usize,
    measurement: &'a Measurement,
    records: Vec<CoordinateRecord>,
}

impl ListedMeasurement<'_> {
    /// The key of the measurement in the fit file, with its label (file or name) in parentheses, for the error message.
    fn name(&self) -> String {
        let key = measurement_key(self.experiment, self.index);
        format!("{key} ({})", self.measurement.label())
    }

    /// The number of common samples of two measurements. `None` if they are no duplicates, or of different kinds (table
    /// of the fit file, unit). Frequencies are compared by [`common_frequencies`], critical loads by
    /// [`is_same_critical_load`], other measurements coordinate by coordinate ([`common_values`]).
    fn common_samples(&self, other: &Self) -> Option<usize> {
        let (one, two) = (self.measurement, other.measurement);
        let same_rod = self.experiment.name == other.experiment.name;
        if let (Some(one), Some(two)) = (one.buckling(), two.buckling()) {
            return (same_rod && is_same_critical_load(one, two)).then_some(1);
        }
        match (one.frequencies(), two.frequencies()) {
            (Some(one), Some(two)) => common_frequencies(one, two, same_rod),
            // Equal numbers of a motion and a shape, or in two units, are different quantities.
            _ if one.table() == two.table() && one.unit() == two.unit() => {
                common_values(&self.records, &other.records)
            }
            _ => None,
        }
    }
}

/// Compares every recorded measurement of all experiments, validation data included, with all before it, and the rows
/// of each with each other. An error for the first one that is a duplicate of an earlier one by `common_samples`, with
/// both keys and the number of common samples, or that has [`repeated_rows`]. Planned measurements are skipped.
pub(crate) fn check_duplicates(experiments: &[Experiment]) -> Result<(), Error> {
    let mut listed: Vec<ListedMeasurement> = Vec::new();
    for experiment in experiments {
        for (index, measurement) in experiment.measurements.iter().enumerate() {
            if measurement.planned() {
                continue;
            }
            let records = records(measurement, &experiment.problem);
            let later = ListedMeasurement { experiment, index, measurement, records };
            if let Some(count) = repeated_rows(measurement, &later.records) {
                let found = format!("{count} samples that repeat earlier ones of the same table");
                let allowed = "each sample once. Repeated rows make intervals too narrow. Remove them; repeated \
                     measurements have values of their own";
                return Err(Error::invalid(later.name(), found, allowed));
            }
            for earlier in &listed {
                let Some(count) = earlier.common_samples(&later) else { continue };
                let found = format!("{count} samples that are also in {}", earlier.name());
                let allowed = "each sample once. Duplicates make intervals too narrow, and fitted data validate nothing. \
                     Remove one of the two, or split the recording into parts without overlap";
                return Err(Error::invalid(later.name(), found, allowed));
            }
            listed.push(later);
        }
    }
    Ok(())
}

/// One series per observed coordinate of a measurement, in ascending order of time, s, or arc length, m, with its
/// rounding. A rounding is set to zero if the last decimal is coarser than [`FINE`] of the largest range of any
/// coordinate ([`FINE_OF_A_LIST`] for other measurements than motions).
fn records(measurement: &Measurement, problem: &Problem) -> Vec<CoordinateRecord> {
    let all = measurement.values_in_order();
    let record = |Coordinate { axis, mut values }: Coordinate| {
        values.sort_by_cached_key(|value| total_order(value.abscissa));
        let abscissas = values.iter().map(|value| value.abscissa).collect();
        let values: Vec<f64> = values.iter().map(|value| all[value.index]).collect();
        CoordinateRecord { axis, abscissas, rounding: rounding(&values), values }
    };
    let mut records: Vec<CoordinateRecord> =
        measurement.coordinates(problem).into_iter().map(record).collect();
    // The largest range of all coordinates limits the rounding: a coordinate that hardly moves has the same digits.
    let range = records.iter().map(CoordinateRecord::range).fold(0.0, f64::max);
    let fine = if measurement.motion().is_some() { FINE } else { FINE_OF_A_LIST };
    for record in records.iter_mut().filter(|record| 2.0 * record.rounding > fine * range) {
        record.rounding = 0.0;
    }
    records
}

/// Half of the last decimal of the values, in their unit: 0.5 10^-d for the smallest `d` with which all values have at
/// most `d` decimals; zero if one has more than [`MOST_DECIMALS`].
fn rounding(values: &[f64]) -> f64 {
    let has = |decimals: i32| {
        let unit = 10.0_f64.powi(decimals);
        values.iter().all(|x| {
            // The decimal value of a number is binary: its multiple is an integer within rounding errors only.
            let scaled = x * unit;
            (scaled - scaled.round()).abs() <= 1e-6_f64.max(4.0 * f64::EPSILON * scaled.abs())
        })
    };
    let last = (0..=MOST_DECIMALS).find(|decimals| has(*decimals));
    last.map_or(0.0, |decimals| 0.5 * 10.0_f64.powi(-decimals))
}

/// The largest number of equal values of any coordinate that two measurements share. `None` if any coordinate with
/// common times has fewer than [`EQUAL`] equal or [`SHARED`] common ones. Also `None` if no coordinate has [`FEWEST`]
/// distinct equal values ([`FEWEST_OF_A_LIST`] if all values of both are equal).
fn common_values(one: &[CoordinateRecord], other: &[CoordinateRecord]) -> Option<usize> {
    let pairs = one.iter().filter_map(|a| Some((a, other.iter().find(|b| b.axis == a.axis)?)));
    let (mut most, mut is_duplicate) = (0, false);
    for (a, b) in pairs {
        let RecordMatch { common_samples, equal, distinct } = a.compare(b);
        if common_samples == 0 {
            continue;
        }
        // Few common times, or some different values, are no copy.
        let shorter = a.values.len().min(b.values.len()) as f64;
        if (equal as f64) < EQUAL * common_samples as f64
            || (common_samples as f64) < SHARED * shorter
        {
            return None;
        }
        let is_whole = [a.values.len(), b.values.len(), equal] == [common_samples; 3];
        let fewest = if is_whole { FEWEST_OF_A_LIST } else { FEWEST };
        most = most.max(equal);
        is_duplicate |= distinct >= fewest;
    }
    is_duplicate.then_some(most)
}

/// Counts of common samples of two records.
struct RecordMatch {
    /// Number of samples at the same time or arc length.
    common_samples: usize,
    /// Number of these with the same value.
    equal: usize,
    /// Number of distinct values among these.
    distinct: usize,
}

impl CoordinateRecord {
    /// The largest less the smallest value of the coordinate, in the unit of the values; minus infinity without values.
    fn range(&self) -> f64 {
        let low = self.values.iter().copied().fold(f64::INFINITY, f64::min);
        self.values.iter().copied().fold(f64::NEG_INFINITY, f64::max) - low
    }

    /// Counts of the samples at common times, of equal values there, and of distinct ones of these, in one pass over
    /// both records. Equal times are within [`SAME_TIME`] of the smaller median interval, or [`SAME`] of the time.
    /// Equal values are within [`SAME`] of the largest value, or the larger rounding of both.
    fn compare(&self, other: &Self) -> RecordMatch {
        let interval = |record: &Self| {
            upper_median(record.abscissas.windows(2).map(|w| w[1] - w[0])).unwrap_or(0.0)
        };
        let same_time = SAME_TIME * interval(self).min(interval(other));
        // The tolerance follows the largest value: a conversion with another origin rounds all values by its size.
        let size = self.values.iter().chain(&other.values).fold(0.0_f64, |m, x| m.max(x.abs()));
        let same_value = (SAME * size).max(self.rounding.max(other.rounding) * (1.0 + 1e-6));
        // Both records ascend: one index per record suffices.
        let (mut common_samples, mut same) = (0, Vec::new());
        let mut j = 0;
        for (time, value) in self.abscissas.iter().zip(&self.values) {
            let near = same_time.max(SAME * time.abs());
            while j < other.abscissas.len() && other.abscissas[j] < time - near {
                j += 1;
            }
            if j == other.abscissas.len() {
                break;
            }
            if (other.abscissas[j] - time).abs() <= near {
                common_samples += 1;
                if (other.values[j] - value).abs() <= same_value {
                    same.push(*value);
                }
                j += 1;
            }
        }
        let equal = same.len();
        same.sort_by_cached_key(|x| total_order(*x));
        // A constant coordinate has many equal values, but only one distinct.
        same.dedup_by(|a, b| (*a - *b).abs() <= same_value);
        RecordMatch { common_samples, equal, distinct: same.len() }
    }
}

/// Whether two critical loads are of the same load and have the same value, within a relative [`SAME`].
fn is_same_critical_load(one: &BucklingLoad, other: &BucklingLoad) -> bool {
    one.load == other.load && (one.value / other.value - 1.0).abs() <= SAME
}

/// A row of a shape or of a load-deflection curve: what is measured (point with the offset of a marker, or load) and
/// the values, bit by bit.
struct TableRow {
    at: [u64; 5],
    values: [Option<u64>; 3],
}

/// The rows of a shape or of a load-deflection curve, in the order of the table. Points of a centerline without arc
/// lengths are given by their positions. Empty for other measurements.
fn table_rows(measurement: &Measurement) -> Vec<TableRow> {
    if let Some(shape) = measurement.shape() {
        let row = |own: &ShapePoint| {
            let values = own.position.map(|x| x.map(f64::to_bits));
            let [a, b, c] = match shape.arc_lengths_fitted {
                // The arc lengths are approximations, and the position itself is the point.
                true => values.map(Option::unwrap_or_default),
                false => own.offset.map(f64::to_bits),
            };
            let [kind, place] = match own.point {
                _ if shape.arc_lengths_fitted => [0, 0],
                Point::Tip => [1, 0],
                Point::Node(node) => [2, node as u64],
                Point::ArcLength(s) => [3, s.to_bits()],
            };
            TableRow { at: [kind, place, a, b, c], values }
        };
        return shape.sightings.iter().map(row).collect();
    }
    let row = |own: &LoadedPoint| TableRow {
        at: [own.load.to_bits(), 0, 0, 0, 0],
        values: [Some(own.displacement.to_bits()), None, None],
    };
    measurement.load_curve().map_or_else(Vec::new, |own| own.curve.iter().map(row).collect())
}

/// The number of rows that repeat an earlier row of the same measurement, whose coordinates are the `records`. `None`
/// if fewer than [`EQUAL`] of the rows at the point or load of an earlier one are equal to one there, or if fewer than
/// [`FEWEST_OF_A_LIST`] distinct values are. `None` too if the last decimal of all coordinates is coarser than
/// [`FINE_OF_A_LIST`] of the largest range: readings of a ruler repeat.
fn repeated_rows(measurement: &Measurement, records: &[CoordinateRecord]) -> Option<usize> {
    let rows = table_rows(measurement);
    let range = records.iter().map(CoordinateRecord::range).fold(0.0, f64::max);
    if rows.is_empty()
        || records.iter().all(|own| 2.0 * rounding(&own.values) > FINE_OF_A_LIST * range)
    {
        return None;
    }
    let count = rows.len();
    let (mut places, mut seen, mut distinct) = (HashSet::new(), HashSet::new(), HashSet::new());
    let (mut common, mut equal) = (0_usize, 0_usize);
    for TableRow { at, values } in rows {
        let is_new_place = places.insert(at);
        let is_new = seen.insert((at, values));
        common += usize::from(!is_new_place);
        if !is_new {
            equal += 1;
            distinct.insert(values);
        }
    }
    // Positions without arc lengths are points of a line, which may cross itself: copies are a large part of them.
    let is_line = measurement.shape().is_some_and(|shape| shape.arc_lengths_fitted);
    let common = if is_line { common.max(count / 3) } else { common };
    let is_copy = equal as f64 >= EQUAL * common as f64 && distinct.len() >= FEWEST_OF_A_LIST;
    is_copy.then_some(equal)
}

/// The number of frequencies that two lists have in common, with the same mode and within a relative [`SAME`]. `None`
/// if the filters of the modes differ, or if neither list contains the other. Different rods (not `same_rod`) may have
/// a few equal frequencies by chance: they need [`FEWEST_OF_A_LIST`].
fn common_frequencies(
    one: &ModeFrequencies,
    other: &ModeFrequencies,
    same_rod: bool,
) -> Option<usize> {
    if one.among != other.among {
        return None;
    }
    let is_in_both = |value: &&Frequency| {
        let is_same =
            |o: &Frequency| o.mode == value.mode && (o.rad_s / value.rad_s - 1.0).abs() <= SAME;
        other.values.iter().any(is_same)
    };
    let count = one.values.iter().filter(is_in_both).count();
    // Single modes may agree by chance: the shorter list must be a part of the longer one.
    let is_contained = count == one.values.len().min(other.values.len());
    let fewest = if same_rod { 1 } else { FEWEST_OF_A_LIST };
    (is_contained && count >= fewest).then_some(count)
}
