//! Detection and removal of constant coordinates of recordings, such as the z column of a planar recording. As
//! measurements without residuals they would lower the estimated noise of the other coordinates.
//!
//! Input: the measurements of experiments. A coordinate of a motion is constant if all its values (at least [`FEWEST`])
//! are equal while another coordinate of the measurement varies. Of shapes at rest only the coordinate along the normal
//! of a planar model counts. Planned data, markers of the recording that prescribes the ends, and coordinates that the
//! camera needs are left alone. Output: the experiment without these coordinates and without their standard deviations
//! per value ([`without_constant_axes`]), and their list for a warning in the report ([`all_constant_axes`]).

use crate::fit::measurement::Measurement;
use crate::fit::measurement::camera_needs::camera_needs;
use crate::fit::measurement::experiment::Experiment;
use crate::fit::unknown::Unknown;

/// Smallest number of equal values that are no coincidence. A larger number keeps constant coordinates of short
/// recordings.
const FEWEST: usize = 3;
/// Smallest component of the unit normal of a planar model along an axis that is perpendicular to the model.
const NORMAL: f64 = 1.0 - 1e-9;

/// A constant coordinate of a recording, for a warning.
pub(crate) struct ConstantAxis {
    /// The file, or the point.
    pub observation: String,
    /// x, y or z.
    pub axis: &'static str,
    /// The value of all samples, m.
    pub value: f64,
    /// Number of samples.
    pub samples: usize,
}

/// A copy of the experiment without constant coordinates of its measurements: coordinates of a motion, or along the
/// normal of a planar model, with at least [`FEWEST`] equal values while another coordinate varies. They are set to
/// `None`, and standard deviations of their values are removed. Coordinates that the camera needs, also for one of the
/// `unknowns`, stay.
pub(crate) fn without_constant_axes(experiment: &Experiment, unknowns: &[Unknown]) -> Experiment {
    let mut experiment = experiment.clone();
    let (normal, needed) = (planar_normal(&experiment), camera_needs(&experiment, unknowns));
    for measurement in &mut experiment.measurements {
        let mut axes = constant_axes(measurement, normal);
        axes.retain(|axis| !needed[*axis].any());
        if !axes.is_empty() {
            remove(measurement, &axes);
        }
    }
    experiment
}

/// The unit normal of the plane of an experiment with a planar model; `None` for a spatial one.
fn planar_normal(experiment: &Experiment) -> Option<[f64; 3]> {
    let problem = &experiment.problem;
    (problem.model().0 == "planar").then(|| problem.normal())
}

/// One entry per coordinate that [`without_constant_axes`] removes from a measurement, of all experiments in the order
/// of the measurements and then x, y, z: label, axis, value in m, and number of samples. Validation data are included.
pub(crate) fn all_constant_axes(
    experiments: &[Experiment],
    unknowns: &[Unknown],
) -> Vec<ConstantAxis> {
    let mut found = Vec::new();
    for experiment in experiments {
        let needed = camera_needs(experiment, unknowns);
        for measurement in &experiment.measurements {
            let axes = constant_axes(measurement, planar_normal(experiment)).into_iter();
            for axis in axes.filter(|axis| !needed[*axis].any()) {
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

/// Indices (0 to 2 for x to z) of the coordinates of a measurement with at least [`FEWEST`] values that are all equal,
/// while another coordinate varies. A shape at rest may hang straight: of it only the coordinate along the `normal` of
/// a planar model counts. Empty for planned data and markers of a recording that prescribes the ends.
fn constant_axes(measurement: &Measurement, normal: Option<[f64; 3]>) -> Vec<usize> {
    // Markers of a recording that prescribes the ends are compared in space, as the ends are.
    if measurement.planned() || measurement.marker().is_some() {
        return Vec::new();
    }
    let positions = measurement.positions();
    let values = |axis: usize| positions.iter().filter_map(move |p| p[axis]);
    let is_constant = |axis: usize| values(axis).all(|x| Some(x) == values(axis).next());
    // A coordinate of a shape may be constant by its nature, as of a rod that hangs straight.
    let is_irrelevant = |axis: &usize| {
        measurement.motion().is_some() || normal.is_some_and(|n| n[*axis].abs() >= NORMAL)
    };
    // A marker that does not move at all is a finding of the data precheck, not a constant column.
    if (0..3).all(is_constant) {
        return Vec::new();
    }
    let is_filler = |axis: &usize| is_constant(*axis) && values(*axis).count() >= FEWEST;
    (0..3).filter(is_filler).filter(is_irrelevant).collect()
}

/// Sets the coordinates with the indices `axes` of all samples to `None`, in place, and removes their entries from
/// standard deviations per value. Those per sample stay.
fn remove(measurement: &mut Measurement, axes: &[usize]) {
    // The values that remain are noted, to remove the entries of their standard deviations.
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
    // Only standard deviations per value, not per sample, have entries for the removed coordinates.
    let factors = &mut measurement.header.sigma_factors;
    if factors.len() == values {
        let mut kept = kept.into_iter();
        factors.retain(|_| kept.next() == Some(true));
    }
}
