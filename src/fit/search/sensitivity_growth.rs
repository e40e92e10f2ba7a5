//! Sensitivities that grow exponentially along a motion, and the leverage weights of the values there.
//!
//! In a vibration a parameter changes phases, and the change of a position by one unit of the logarithm of a parameter
//! is at most of the order of `v t`, the largest speed times the time: for Young's modulus of a free vibration of
//! amplitude `a` it is `a omega t/2`. A limp rod that whips about without enough damping is chaotic: neighboring
//! motions diverge exponentially, and `dx/dp` with them. Errors of the model, of mesh and step diverge likewise, by the
//! same factor. So a value there has an error that is as many times larger than its noise as the sensitivities are
//! larger than a vibration has them: the linear model of the fit, in which only the noise counts, does not hold.
//!
//! Input: an optimum with its Jacobian. Let `M(t)` be the largest `|dx/dp|` up to the time `t`, and `T` about the first
//! period. A motion has growth if both of these hold for a parameter at any time `t` after `T`:
//!
//! ```text
//! M(t) > MAX_PHASE_SENSITIVITY (L + v t)        M(t)/t > MAX_LINEAR_GROWTH M(T)/T
//! ```
//!
//! with the length `L` of the rod and the largest speed `v`. Derivatives are multiplied by the typical size of the
//! parameter. From the time on at which the second begins to hold for such a parameter, values get the weight
//! `MAX_LINEAR_GROWTH (M(T)/T)/(M(t)/t)`, the smallest so far of all such parameters. Output: [`SensitivityGrowth`] per
//! experiment (`None` without growth), for warnings, and a weight of each value (`growth_weights`; empty without
//! growth). [`Search::with_growth_weights`] fits with these weights, and weights and fits alternate up to
//! [`MOST_WEIGHTINGS`] times; rods with recorded ends have none. [`are_alike`] compares two lists of weights.

use crate::error::{Error, none_on_failure};
use crate::fit::measurement::experiment::Experiment;
use crate::fit::search::Search;
use crate::fit::search::optimum::Optimum;
use crate::fit::unknown::Unknown;
use crate::numerics::total_order;
use statrs::statistics::{Data, Median};

/// Largest `|dx/d ln p|` over `L + v t` of a vibration. A phase proportional to `p^k` has `k`, at most 2 for
/// the length of a rod; shapes at rest have less.
const MAX_PHASE_SENSITIVITY: f64 = 10.0;
/// Largest growth rate of the sensitivities of a vibration, over that in the first period. Beats and large amplitudes
/// have 2 to 3.
const MAX_LINEAR_GROWTH: f64 = 5.0;
/// About a first period over the time in which a record reaches its first extreme.
const PERIOD_OF_RISE: f64 = 2.0;
/// Largest number of fits by which weights and optimum are brought into agreement. Each costs a fit of the whole
/// records.
const MOST_WEIGHTINGS: usize = 4;
/// Largest ratio of two weights that are taken to be the same; at it the iteration of weights and fits ends.
const SAME_WEIGHT: f64 = 1.2;

/// Exponential growth of the sensitivities in the motion of an experiment, with the weights of its values.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct SensitivityGrowth {
    /// Name of the experiment.
    pub experiment: String,
    /// The last recorded time before the first weight below 1, s.
    pub onset: f64,
    /// The largest growth rate over that of the first period, divided by [`MAX_LINEAR_GROWTH`].
    pub excess: f64,
    /// Number of recorded positions after the onset.
    pub later: usize,
    /// Number of recorded positions.
    pub values: usize,
    /// Weights with the times from which on they hold, ascending; the first one is 1 from minus infinity on.
    weights: Vec<TimedWeight>,
}

/// A weight that holds from a time on until the next one.
#[derive(Clone, Copy, Debug, PartialEq)]
struct TimedWeight {
    /// s.
    time: f64,
    weight: f64,
}

/// The sensitivities of one recorded position to all unknowns.
struct SampleSensitivity {
    /// s.
    time: f64,
    /// `|dx/dp|` times the typical size of every unknown, m.
    by_unknown: Vec<f64>,
}

impl SensitivityGrowth {
    /// The growth in an experiment; `None` if its sensitivities grow as those of a vibration, or without recorded
    /// motions. The first period is [`PERIOD_OF_RISE`] times the median rise time of its records. `rows` are the
    /// derivatives of its residuals by the unknowns on their scales, plain and in units of `sigmas`, the standard
    /// deviation of each of its measurements.
    pub fn new(
        experiment: &Experiment,
        unknowns: &[Unknown],
        sigmas: &[f64],
        rows: &[Vec<f64>],
    ) -> Option<Self> {
        let samples = samples(experiment, unknowns, sigmas, rows);
        let rises: Vec<f64> = experiment.records().map(|o| o.rise_time()).collect();
        // The median over the records: a marker that hardly moves has no meaningful rise time.
        let rise = if rises.is_empty() { return None } else { Data::new(rises).median() };
        let speed = experiment.motions().map(|o| o.largest_speed()).fold(0.0, f64::max);
        let (period, length) = (PERIOD_OF_RISE * rise, experiment.problem.length());
        let first = samples.iter().filter(|s| s.time > 0.0 && s.time <= period);
        let mut reference = vec![0.0_f64; unknowns.len()];
        for sample in first {
            for (most, by) in reference.iter_mut().zip(&sample.by_unknown) {
                *most = most.max(*by / period);
            }
        }
        let mut largest = vec![0.0_f64; unknowns.len()];
        let mut grows = vec![false; unknowns.len()];
        // First pass: growth rate over that of the first period, of every sample and unknown, and the unknowns whose
        // sensitivities grow exponentially at any time.
        let mut growths = Vec::with_capacity(samples.len());
        for sample in &samples {
            let mut growth = vec![0.0; unknowns.len()];
            for j in 0..unknowns.len() {
                largest[j] = largest[j].max(sample.by_unknown[j]);
                if sample.time <= period || reference[j] <= 0.0 {
                    continue;
                }
                growth[j] = largest[j] / sample.time / reference[j];
                let phase = length + speed * sample.time;
                grows[j] |=
                    growth[j] > MAX_LINEAR_GROWTH && largest[j] > MAX_PHASE_SENSITIVITY * phase;
            }
            growths.push(growth);
        }
        // Second pass: the weight falls whenever the growth rate reaches a new maximum.
        let mut excess = 1.0_f64;
        let mut weights = vec![TimedWeight { time: f64::NEG_INFINITY, weight: 1.0 }];
        let (mut onset, mut before) = (None, 0.0);
        for (sample, growth) in samples.iter().zip(growths) {
            let own = growth.iter().zip(&grows).filter(|(_, grows)| **grows).map(|(g, _)| *g);
            let own = own.fold(0.0, f64::max) / MAX_LINEAR_GROWTH;
            if own > excess {
                excess = own;
                onset = onset.or(Some(before));
                weights.push(TimedWeight { time: sample.time, weight: excess.recip() });
            }
            before = sample.time;
        }
        let onset = onset?;
        let later = samples.iter().filter(|s| s.time > onset).count();
        let (experiment, values) = (experiment.name.clone(), samples.len());
        Some(Self { experiment, onset, excess, later, values, weights })
    }

    /// The text of a warning: experiment, onset and largest excess of the growth, the `consequence` for later values,
    /// and the recommended action (shorter record or damping).
    pub fn describe(&self, consequence: &str) -> String {
        let Self { experiment, onset, excess, .. } = self;
        let of = if experiment.is_empty() { String::new() } else { format!("{experiment}: ") };
        format!(
            "{of}the derivatives by the parameters grow exponentially from t = {onset:.2} s on, to {excess:.0e} times \
             those of a vibration. The linear error is not usable beyond that time: {consequence}. End the record \
             there, or give the rod its internal damping (damping.stiffness)"
        )
    }

    /// The weight, 0 to 1, of a value at `time`, s: that of the last entry whose time is not later; 1 before the first
    /// weight below 1.
    fn weight(&self, time: f64) -> f64 {
        let after = self.weights.partition_point(|w| w.time <= time);
        self.weights[after.saturating_sub(1)].weight
    }
}

/// The sensitivities of all recorded positions of an experiment, in ascending order of their times: per unknown the
/// Euclidean norm of the derivatives of the observed coordinates, m, times the typical size of the unknown. `rows` are
/// the derivatives of its residuals in units of `sigmas`, one per measurement. Rows of other measurements than motions
/// are skipped.
fn samples(
    experiment: &Experiment,
    unknowns: &[Unknown],
    sigmas: &[f64],
    rows: &[Vec<f64>],
) -> Vec<SampleSensitivity> {
    let scales: Vec<f64> = unknowns.iter().map(|u| u.typical_size(experiment)).collect();
    let mut samples = Vec::new();
    let mut rest = rows.iter();
    for (measurement, sigma) in experiment.measurements.iter().zip(sigmas) {
        // Rows are in the order of the measurements: each takes its own.
        let mut own = rest.by_ref().take(measurement.values());
        if let Some(observation) = measurement.motion() {
            let mut sigmas = measurement.sigmas(*sigma).into_iter();
            for sample in &observation.samples {
                let mut squares = vec![0.0; unknowns.len()];
                // A residual is in units of sigma: times sigma it is a displacement, of which the coordinates are
                // combined.
                for _ in sample.position.iter().flatten() {
                    let (Some(row), Some(sigma)) = (own.next(), sigmas.next()) else { break };
                    for (square, d) in squares.iter_mut().zip(row) {
                        *square += (sigma * d).powi(2);
                    }
                }
                let pairs = squares.into_iter().zip(&scales);
                let by_unknown = pairs.map(|(square, scale)| square.sqrt() * scale).collect();
                samples.push(SampleSensitivity { time: sample.time, by_unknown });
            }
        }
        // Rows of other measurements are skipped.
        own.for_each(drop);
    }
    samples.sort_by_cached_key(|x| total_order(x.time));
    samples
}

/// The growth of sensitivities of every experiment, in their order; `None` where there is none. `rows` are the plain
/// derivatives of all residuals by the unknowns on their scales, experiment by experiment, in units of `sigmas`, one
/// per measurement of all experiments. Rows of priors at the end are not used.
pub(crate) fn growths(
    experiments: &[Experiment],
    unknowns: &[Unknown],
    sigmas: &[f64],
    rows: &[Vec<f64>],
) -> Vec<Option<SensitivityGrowth>> {
    let (mut rows, mut sigmas) = (rows, sigmas);
    let of = |experiment: &Experiment| {
        let values = experiment.measurements.iter().map(|m| m.data.values()).sum::<usize>();
        let (own, others) = rows.split_at(values.min(rows.len()));
        let (own_sigmas, other_sigmas) = sigmas.split_at(experiment.measurements.len());
        (rows, sigmas) = (others, other_sigmas);
        SensitivityGrowth::new(experiment, unknowns, own_sigmas, own)
    };
    experiments.iter().map(of).collect()
}

/// The weight of every value of the experiments, in the order of the residuals: that of its time by the experiment's
/// growth, 1 for values without a time or growth. Empty where no experiment has growth.
pub(crate) fn growth_weights(
    experiments: &[Experiment],
    growths: &[Option<SensitivityGrowth>],
) -> Vec<f64> {
    let mut weights = Vec::new();
    if growths.iter().all(Option::is_none) {
        return weights;
    }
    for (experiment, growth) in experiments.iter().zip(growths) {
        for measurement in &experiment.measurements {
            let first = weights.len();
            weights.resize(first + measurement.values(), 1.0);
            let Some(growth) = growth else { continue };
            let own = &mut weights[first..];
            for (weight, time) in own.iter_mut().zip(measurement.times()) {
                *weight = time.map_or(1.0, |time| growth.weight(time));
            }
        }
    }
    weights
}

impl Search<'_> {
    /// The leverage weights of growing sensitivities, in the order of the residuals. Empty where there are none, and
    /// for rods with recorded ends, whose weights are by the size of derivatives instead.
    pub fn growth_weights(&self) -> &[f64] {
        if self.is_displacement_driven() { &[] } else { &self.leverage_weights }
    }

    /// The weight by growing sensitivities of the residual with index `k`; 1 without growth.
    pub fn growth_weight(&self, k: usize) -> f64 {
        self.growth_weights().get(k).copied().unwrap_or(1.0)
    }

    /// For every experiment, the growth in time of its sensitivities at an optimum, by the optimum's Jacobian; `None`
    /// where there is none.
    pub fn growths(&self, optimum: &Optimum) -> Vec<Option<SensitivityGrowth>> {
        growths(self.experiments, self.unknowns, &self.sigmas, &optimum.jacobian)
    }

    /// The optimum with the leverage weights of the growing sensitivities at it. Weights and fits alternate, at most
    /// [`MOST_WEIGHTINGS`] times, until no weight changes by a factor of [`SAME_WEIGHT`]. The weights become those of
    /// the search. Without growth, for rods with recorded ends, or if the first fit fails, it is the same optimum. An
    /// interruption is an error.
    pub fn with_growth_weights(&mut self, mut optimum: Optimum) -> Result<Optimum, Error> {
        // Motions between recorded ends have leverage weights by the size of their derivatives.
        if self.is_displacement_driven() {
            return Ok(optimum);
        }
        // Weights and optimum depend on each other: a fixed-point iteration.
        for _ in 0..MOST_WEIGHTINGS {
            let weights = growth_weights(self.experiments, &self.growths(&optimum));
            if are_alike(&weights, &self.leverage_weights, SAME_WEIGHT.ln()) {
                break;
            }
            let before = std::mem::replace(&mut self.leverage_weights, weights);
            let start = optimum.clone().into_evaluation();
            // If the weighted fit fails, the optimum and the weights before it remain.
            let Some(weighted) = none_on_failure(self.polish_from(start))? else {
                self.leverage_weights = before;
                break;
            };
            optimum = weighted;
        }
        Ok(optimum)
    }
}

/// Whether at every index the logarithms of the weights in `a` and `b` differ by less than `tolerance`. Beyond the end
/// of a list weights are 1.
pub(crate) fn are_alike(a: &[f64], b: &[f64], tolerance: f64) -> bool {
    let at = |weights: &[f64], i: usize| weights.get(i).copied().unwrap_or(1.0);
    (0..a.len().max(b.len())).all(|i| (at(a, i) / at(b, i)).ln().abs() < tolerance)
}
