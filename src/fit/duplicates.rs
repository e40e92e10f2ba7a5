//! Refuses data that are listed twice: they would count twice, and intervals would be too narrow by the square root of 2;
//! as validation data they would validate nothing.
//!
//! Two recordings hold the same samples where, at the times that both have, all coordinates that both have are equal.
//! A copy may have been written in other units or with fewer digits: values count as equal within a relative 1e-9 or half
//! of the last decimal of the coarser one, times within a part of the interval between samples. Repeated measurements of
//! one motion agree in some values by chance, never in nearly all of them. Parts of one recording that do not overlap in
//! time have no sample in common, nor have several markers of one file.

use crate::error::Error;
use crate::fit::measurement::Measurement;
use crate::fit::measurement::dataset::Coordinate;
use crate::fit::measurement::experiment::Experiment;
use crate::fit::measurement::frequencies::{Frequency, ModeFrequencies};
use crate::fit::validate::key;
use crate::numerics::total_order;
use crate::problem::Problem;

/// Relative difference of numbers that are one number in two units.
const SAME: f64 = 1e-9;
/// Part of the usual interval between samples by which their times may differ.
const SAME_TIME: f64 = 0.01;
/// So many distinct values in common are no chance.
const FEWEST: usize = 8;
/// The same of shapes and of frequencies of different rods: lists that are equal as a whole.
const FEWEST_OF_A_LIST: usize = 3;
/// Part of the shorter record that both must have in common.
const SHARED: f64 = 0.2;
/// Part of what both have at the same times that must be equal.
const EQUAL: f64 = 0.95;
/// Decimals beyond which a number is not taken for rounded; 1e-9 m is below what any camera resolves.
const MOST_DECIMALS: i32 = 9;
/// Largest last decimal of a copy, over the range of its values: 1 mm of 0.2 m. Coarser pixels than that and than 20 times the
/// noise make independent recordings equal in nearly all values; with finer ones or more noise fewer than [`EQUAL`] are.
const FINE: f64 = 5e-3;
/// The same of shapes and gauges, whose few values repeat within a millimetre.
const FINE_OF_A_LIST: f64 = 1e-4;

/// A coordinate of a measurement over time or along the rod, ascending.
struct Record {
    axis: &'static str,
    at: Vec<f64>,
    values: Vec<f64>,
    /// Half of the last decimal of the values; zero where they are not rounded, or coarser than [`FINE`].
    rounding: f64,
}

/// Refuses measurements that have their samples in common.
pub(crate) fn check_duplicates(experiments: &[Experiment]) -> Result<(), Error> {
    let places = experiments.iter().enumerate();
    let places = places.flat_map(|(e, own)| (0..own.measurements.len()).map(move |i| (e, i)));
    let listed: Vec<(&Experiment, usize)> = places
        .map(|(e, i)| (&experiments[e], i))
        .filter(|(own, i)| !own.measurements[*i].planned())
        .collect();
    let of = |(own, i): &(&Experiment, usize)| records(&own.measurements[*i], &own.problem);
    let records: Vec<Vec<Record>> = listed.iter().map(of).collect();
    for (b, (later, j)) in listed.iter().enumerate() {
        for (a, (earlier, i)) in listed[..b].iter().enumerate() {
            let pair = (&earlier.measurements[*i], &later.measurements[*j]);
            let same_rod = earlier.name == later.name;
            let shared = match (pair.0.frequencies(), pair.1.frequencies()) {
                (Some(one), Some(other)) => same_frequencies(one, other, same_rod),
                _ if is_alike(pair.0, pair.1) => common(&records[a], &records[b]),
                _ => None,
            };
            if let Some(count) = shared {
                return Err(twice((earlier, *i), (later, *j), count));
            }
        }
    }
    Ok(())
}

fn twice(earlier: (&Experiment, usize), later: (&Experiment, usize), count: usize) -> Error {
    let named = |(experiment, i): (&Experiment, usize)| {
        format!("{} ({})", key(experiment, i), experiment.measurements[i].label())
    };
    let found = format!("{count} samples that are also in {}", named(earlier));
    let allowed = "each sample once. Duplicates make intervals too narrow, and fitted data validate nothing. \
                   Remove one of the two, or split the recording into parts without overlap";
    Error::invalid(named(later), found, allowed)
}

/// Whether two measurements are of one quantity.
fn is_alike(one: &Measurement, other: &Measurement) -> bool {
    one.table() == other.table() && one.unit() == other.unit()
}

/// The coordinates of a measurement, in order of time or place.
fn records(measurement: &Measurement, problem: &Problem) -> Vec<Record> {
    let all = measurement.values_in_order();
    let record = |Coordinate { axis, places }: Coordinate| {
        let mut pairs: Vec<[f64; 2]> = places.into_iter().map(|(k, at)| [at, all[k]]).collect();
        pairs.sort_by_cached_key(|x| total_order(x[0]));
        let (at, values): (Vec<f64>, Vec<f64>) = pairs.into_iter().map(|[at, x]| (at, x)).unzip();
        Record { axis, at, rounding: rounding(&values), values }
    };
    let mut records: Vec<Record> =
        measurement.coordinates(problem).into_iter().map(record).collect();
    // The coordinate that moves most shows how fine the digits are; one that hardly moves is compared with them too.
    let range = records.iter().map(Record::range).fold(0.0, f64::max);
    let fine = if measurement.motion().is_some() { FINE } else { FINE_OF_A_LIST };
    for record in records.iter_mut().filter(|record| 2.0 * record.rounding > fine * range) {
        record.rounding = 0.0;
    }
    records
}

/// Half of the last decimal that any of the values has; zero where one has more than [`MOST_DECIMALS`].
fn rounding(values: &[f64]) -> f64 {
    let has = |decimals: i32| {
        let unit = 10.0_f64.powi(decimals);
        values.iter().all(|x| {
            let scaled = x * unit;
            (scaled - scaled.round()).abs() <= 1e-6_f64.max(4.0 * f64::EPSILON * scaled.abs())
        })
    };
    let last = (0..=MOST_DECIMALS).find(|decimals| has(*decimals));
    last.map_or(0.0, |decimals| 0.5 * 10.0_f64.powi(-decimals))
}

/// How many samples two measurements have in common, where that is no chance.
fn common(one: &[Record], other: &[Record]) -> Option<usize> {
    let pairs = one.iter().filter_map(|a| Some((a, other.iter().find(|b| b.axis == a.axis)?)));
    let (mut most, mut distinct) = (0, 0);
    for (a, b) in pairs {
        let Match { met, equal, distinct: own } = a.compared(b);
        if met == 0 {
            continue;
        }
        let shorter = a.values.len().min(b.values.len()) as f64;
        if (equal as f64) < EQUAL * met as f64 || (met as f64) < SHARED * shorter {
            return None;
        }
        let whole = met == a.values.len() && met == b.values.len() && equal == met;
        let fewest = if whole { FEWEST_OF_A_LIST } else { FEWEST };
        most = most.max(equal);
        distinct = distinct.max(if own >= fewest { own } else { 0 });
    }
    (distinct > 0).then_some(most)
}

/// What two records have in common.
struct Match {
    /// Samples at the same time or place.
    met: usize,
    /// Those of them with the same value.
    equal: usize,
    /// Distinct values among those.
    distinct: usize,
}

impl Record {
    fn range(&self) -> f64 {
        let low = self.values.iter().copied().fold(f64::INFINITY, f64::min);
        self.values.iter().copied().fold(f64::NEG_INFINITY, f64::max) - low
    }

    fn compared(&self, other: &Self) -> Match {
        let interval = |record: &Self| {
            let mut gaps: Vec<f64> = record.at.windows(2).map(|w| w[1] - w[0]).collect();
            gaps.sort_by(f64::total_cmp);
            gaps.get(gaps.len() / 2).copied().unwrap_or(0.0)
        };
        let apart = SAME_TIME * interval(self).min(interval(other));
        let size = self.values.iter().chain(&other.values).fold(0.0_f64, |m, x| m.max(x.abs()));
        let within = (SAME * size).max(self.rounding.max(other.rounding) * (1.0 + 1e-6));
        let (mut met, mut same) = (0, Vec::new());
        let mut j = 0;
        for (at, value) in self.at.iter().zip(&self.values) {
            let near = apart.max(SAME * at.abs());
            while j < other.at.len() && other.at[j] < at - near {
                j += 1;
            }
            if j == other.at.len() {
                break;
            }
            if (other.at[j] - at).abs() <= near {
                met += 1;
                if (other.values[j] - value).abs() <= within {
                    same.push(*value);
                }
                j += 1;
            }
        }
        let equal = same.len();
        same.sort_by(f64::total_cmp);
        same.dedup_by(|a, b| (*a - *b).abs() <= within);
        Match { met, equal, distinct: same.len() }
    }
}

/// How many frequencies two lists have in common, where one is a part of the other: two rods may agree in a few.
fn same_frequencies(
    one: &ModeFrequencies,
    other: &ModeFrequencies,
    same_rod: bool,
) -> Option<usize> {
    if one.among != other.among {
        return None;
    }
    let in_both = |value: &&Frequency| {
        let same =
            |o: &Frequency| o.mode == value.mode && (o.rad_s / value.rad_s - 1.0).abs() <= SAME;
        other.values.iter().any(same)
    };
    let count = one.values.iter().filter(in_both).count();
    let whole = count == one.values.len().min(other.values.len());
    let fewest = if same_rod { 1 } else { FEWEST_OF_A_LIST };
    (whole && count >= fewest).then_some(count)
}
