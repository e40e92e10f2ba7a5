//! Coordinates of a recording that never change: fillers of planar recordings, which are no measurements.
//!
//! Counted as measurements without a residual, they would lower the estimated noise of the other coordinates.

use crate::fit::measurement::Measurement;
use crate::fit::measurement::experiment::Experiment;

/// Fewer equal values may be a coincidence.
const FEWEST: usize = 3;
/// Part of the normal's length along an axis from which on a planar model does not move along it.
const NORMAL: f64 = 1.0 - 1e-9;

/// A coordinate with one value only.
pub(crate) struct ConstantAxis {
    /// The file, or the point.
    pub observation: String,
    pub axis: &'static str,
    /// In all samples, m.
    pub value: f64,
    pub samples: usize,
}

/// The experiment without the coordinates of its recordings that are constant while others vary.
pub(crate) fn without_constant_axes(experiment: &Experiment) -> Experiment {
    let mut experiment = experiment.clone();
    let normal = experiment.problem.model().0 == "planar";
    let normal = normal.then(|| experiment.problem.normal());
    for measurement in &mut experiment.measurements {
        let axes = constant_axes(measurement, normal);
        if !axes.is_empty() {
            remove(measurement, &axes);
        }
    }
    experiment
}

/// The coordinates that are left out of the experiments.
pub(crate) fn all_constant_axes(experiments: &[Experiment]) -> Vec<ConstantAxis> {
    let mut found = Vec::new();
    for experiment in experiments {
        let normal = experiment.problem.model().0 == "planar";
        let normal = normal.then(|| experiment.problem.normal());
        for measurement in &experiment.measurements {
            for axis in constant_axes(measurement, normal) {
                let values: Vec<f64> =
                    measurement.positions().iter().filter_map(|p| p[axis]).collect();
                found.push(ConstantAxis {
                    observation: experiment.label(measurement),
                    axis: ["x", "y", "z"][axis],
                    value: values[0],
                    samples: values.len(),
                });
            }
        }
    }
    found
}

/// Indices of the constant coordinates: of a motion any beside one that varies, of a shape at rest, which may hang
/// straight, that along the `normal` of a planar model.
fn constant_axes(measurement: &Measurement, normal: Option<[f64; 3]>) -> Vec<usize> {
    // Markers of a recording that prescribes the ends are compared in space, as their ends are.
    if measurement.planned() || measurement.marker().is_some() {
        return Vec::new();
    }
    let positions = measurement.positions();
    let is_constant = |axis: usize| {
        let mut values = positions.iter().filter_map(|p| p[axis]);
        let first = values.next();
        first.is_some() && values.clone().count() + 1 >= FEWEST && values.all(|x| Some(x) == first)
    };
    let varies = |axis: usize| {
        let mut values = positions.iter().filter_map(|p| p[axis]);
        let first = values.next();
        values.any(|x| Some(x) != first)
    };
    let is_irrelevant = |axis: &usize| {
        measurement.motion().is_some() || normal.is_some_and(|n| n[*axis].abs() >= NORMAL)
    };
    if !(0..3).any(varies) {
        return Vec::new();
    }
    (0..3).filter(|axis| is_constant(*axis)).filter(is_irrelevant).collect()
}

/// Leaves coordinates out, with the standard deviations of their values.
fn remove(measurement: &mut Measurement, axes: &[usize]) {
    let (mut kept, values) = (Vec::new(), measurement.values());
    for position in measurement.data.positions_mut() {
        for axis in 0..3 {
            if position[axis].is_some() {
                kept.push(!axes.contains(&axis));
            }
            if axes.contains(&axis) {
                position[axis] = None;
            }
        }
    }
    // Deviations are given per value or per sample.
    let factors = &mut measurement.header.sigma_factors;
    if factors.len() == values {
        let mut kept = kept.into_iter();
        factors.retain(|_| kept.next() == Some(true));
    }
}
