//! Measured orientation of a point of the rod in space: rotation about tangent, first or second director.
//!
//! Input: the measured axes `Q_k` (columns: tangent, first and second director, in the world) at the times of the
//! readings or at rest, made by `pose_sensor`; and the recorded directors of the edges around the point. The simulated
//! axes `F` there are sums of those of the edges, with the cubic weights of a marker, made orthonormal (the tangent
//! keeps its direction). Tangent and first director pass the filter of the sensor, are linear between steps, and are
//! made orthonormal again. Output: [`PoseReadings`], whose differences in a fit are a component of the
//! rotation vector of the rotation from measured to simulated axes, rad, in the axes of the rod:
//!
//! ```text
//! r_k = log(C' Q_k' F_k)
//! ```
//!
//! `C` is the identity. With a free mounting it is the constant rotation with the least sum of squares of all `r_k`
//! ([`mean_rotation`]): the sum of each component is then zero, and it takes one degree of freedom of each. Quaternions
//! of either sign and whole turns are the same. All derivatives are finite; at half a turn from the model the sign of
//! `r_k` changes.
//!
//! A value is the component of the rotation vector from the axes of the rest shape to the measured ones, continuous in
//! time. Changes of a value, as for synthetic data, change the difference by their negative.
//!
//! Errors: structures, times that do not increase within the simulation, a filter of readings at rest; and a free
//! mounting of fewer than two readings, with another loss than squares, or with unequal standard deviations.

use crate::dynamics::record::RecordView;
use crate::error::{Error, ensure};
use crate::fit::measurement::dataset::{DataKind, Dataset, Header, ValidationContext};
use crate::fit::measurement::gauge::check_readings;
use crate::fit::measurement::low_pass::low_pass_filter;
use crate::fit::measurement::quantity::GaugeScalar;
use crate::fit::measurement::reading::{Reading, spread_or_size};
use crate::fit::measurement::sensor_reference::{FilteredReadings, SensorReference};
use crate::fit::measurement::simulated::{Requirements, SimulatedOutput};
use crate::fit::structure::structure_problem::refuse_structure;
use crate::numerics::mean_rotation::mean_rotation;
use crate::numerics::rotation::{Matrix3, orthonormal, product, rotation_vector, transpose};
use crate::numerics::scalar::Scalar;
use crate::numerics::vector::{Vector, combine, dot, scale};
use crate::problem::Problem;
use crate::scene::Point;
use crate::scene::marker::MarkerStencil;
use std::f64::consts::TAU;

/// Names of the components: rotation about tangent, first and second director.
const NAMES: [&str; 3] = ["rt", "r1", "r2"];

/// Measured axes of the rod at a point.
#[derive(Clone, Copy, Debug)]
struct MeasuredAxes {
    /// Time from the start of the motion, s; none at rest.
    time: Option<f64>,
    /// Tangent, first and second director in the world, in columns.
    axes: Matrix3<f64>,
    /// The value of the reading that was made of the axes, rad.
    value: f64,
}

/// One component of the measured orientations of a point, in the order of their times.
#[derive(Clone, Debug)]
pub struct PoseReadings {
    /// The point.
    point: Point,
    /// Axis of the component: 0 to 2 for tangent, first and second director.
    component: usize,
    /// Component of the rotation vectors from the rest shape, rad, with their times.
    readings: Vec<Reading>,
    /// The measured axes of the readings.
    measured: Vec<MeasuredAxes>,
    /// Whether the mounting rotation of the sensor is unknown.
    pub(super) has_free_mounting: bool,
    /// Cutoff frequency of the first-order low-pass filter of the sensor, Hz; none without a filter.
    pub(super) low_pass: Option<f64>,
    /// The sensor in `[[sensors]]` of the scene, with its clock and filter.
    pub(super) sensor: SensorReference,
    /// Size of the rotation vectors of all components, rad.
    size: f64,
}

impl PoseReadings {
    /// The three components of `measured` axes of a `point` at the `times` of the readings, with a known mounting and
    /// without a filter. `rest` has the axes of the rest shape.
    pub(super) fn components(
        point: Point,
        times: &[Option<f64>],
        measured: &[Matrix3<f64>],
        rest: &Matrix3<f64>,
    ) -> [Dataset<Self>; 3] {
        let mut vectors: Vec<Vector<f64>> = Vec::with_capacity(measured.len());
        for axes in measured {
            let own = rotation_vector(&product(&transpose(rest), axes));
            vectors.push(vectors.last().map_or(own, |before| nearest_turn(own, *before)));
        }
        let readings = [0, 1, 2].map(|c| -> Vec<Reading> {
            let reading = |(time, vector): (&Option<f64>, &Vector<f64>)| Reading {
                time: *time,
                value: vector[c],
            };
            times.iter().zip(&vectors).map(reading).collect()
        });
        let sizes = readings.each_ref().map(|readings| spread_or_size(readings));
        let size = dot(sizes, sizes).sqrt();
        [0, 1, 2].map(|component| {
            let readings = readings[component].clone();
            let own = |(reading, axes): (&Reading, &Matrix3<f64>)| MeasuredAxes {
                time: reading.time,
                axes: *axes,
                value: reading.value,
            };
            let data = Self {
                point,
                component,
                measured: readings.iter().zip(measured).map(own).collect(),
                readings,
                has_free_mounting: false,
                low_pass: None,
                sensor: SensorReference::default(),
                size,
            };
            Dataset { header: Header { unit: "rad".into(), ..Header::default() }, data }
        })
    }

    /// Tangent and first director of the simulated axes of the point at every time of a record: a list over time for
    /// each of their six entries. Error: a point outside the rod or not recorded.
    fn entries<D: Scalar>(
        &self,
        record: &RecordView<'_, D>,
        simulated: &SimulatedOutput<D>,
    ) -> Result<[Vec<D>; 6], Error> {
        // The weights with which the axes of the edges around the point are summed for a marker there.
        let stencil = MarkerStencil::new(self.point.fixed(), [1.0, 0.0, 0.0], simulated.mesh)?;
        let count = record.times().len();
        let mut entries = [(); 6].map(|()| Vec::with_capacity(count));
        for k in 0..count {
            let mut sums = [[D::from(0.0); 3]; 2];
            for (edge, weight) in &stencil.edges {
                let [tangent, first, _] = record.axes(*edge, k)?;
                for (sum, axis) in sums.iter_mut().zip([tangent, first]) {
                    *sum = combine(D::from(1.0), *sum, *weight, axis);
                }
            }
            let axes = transpose(&orthonormal_columns(sums));
            let own = axes[0].into_iter().chain(axes[1]);
            entries.iter_mut().zip(own).for_each(|(list, x)| list.push(x));
        }
        Ok(entries)
    }

    /// The simulated axes at the readings, in columns, of those readings whose kind of simulation (motion or rest) is
    /// present, with the indices of these.
    fn simulated_axes<D: Scalar>(
        &self,
        simulated: &SimulatedOutput<D>,
    ) -> Result<Vec<(usize, Matrix3<D>)>, Error> {
        let moves = self.readings.iter().any(|r| r.time.is_some());
        let rests = self.readings.iter().any(|r| r.time.is_none());
        let moving = simulated.moving.as_ref().filter(|_| moves);
        let moving = moving.map(|record| -> Result<_, Error> {
            let mut entries = self.entries(record, simulated)?;
            if let Some(frequency) = self.sensor.low_pass(simulated.scene, self.low_pass) {
                let filter = |list: &mut Vec<D>| low_pass_filter(list, record.times(), frequency);
                entries.iter_mut().for_each(filter);
            }
            Ok((record, entries))
        });
        let moving = moving.transpose()?;
        let resting = simulated.resting.as_ref().filter(|_| rests);
        let resting = resting.map(|record| self.entries(record, simulated)).transpose()?;
        let mut axes = Vec::with_capacity(self.readings.len());
        for (k, Reading { time, .. }) in self.readings.iter().enumerate() {
            let mut entries = [D::from(0.0); 6];
            match (time, &moving, &resting) {
                (Some(time), Some((record, lists)), _) => {
                    let time = self.sensor.time_of_motion(*time, simulated.scene);
                    for (entry, list) in entries.iter_mut().zip(lists) {
                        *entry = record.linear(list, time)?;
                    }
                }
                (None, _, Some(lists)) => {
                    for (entry, list) in entries.iter_mut().zip(lists) {
                        *entry = list.first().copied().unwrap_or(*entry);
                    }
                }
                _ => continue,
            }
            let [t0, t1, t2, d0, d1, d2] = entries;
            axes.push((k, orthonormal_columns([[t0, t1, t2], [d0, d1, d2]])));
        }
        Ok(axes)
    }
}

/// Orthonormal axes, in columns, whose first one is along the first of two vectors, and whose second one is in their
/// plane.
fn orthonormal_columns<D: Scalar>([first, second]: [Vector<D>; 2]) -> Matrix3<D> {
    orthonormal(&transpose(&[first, second, [D::from(0.0); 3]]))
}

/// A rotation vector, rad, with whole turns about its axis that bring it nearest to another one.
fn nearest_turn(vector: Vector<f64>, other: Vector<f64>) -> Vector<f64> {
    let angle = dot(vector, vector).sqrt();
    if angle == 0.0 {
        return vector;
    }
    let axis = scale(vector, angle.recip());
    let turns = TAU * ((dot(axis, other) - angle) / TAU).round();
    scale(axis, angle + turns)
}

impl DataKind for PoseReadings {
    /// Name of the table of a fit file: `observation`.
    fn table(&self) -> &'static str {
        "observation"
    }

    /// The file, or the name of the header without a file, followed by the name of the component.
    fn label(&self, header: &Header) -> String {
        header.component_label(NAMES[self.component])
    }

    /// Name of the component in reports. Never `None`.
    fn axis(&self) -> Option<&'static str> {
        Some(NAMES[self.component])
    }

    /// Components of the rotation vectors from the rest shape, with their times.
    fn readings(&self) -> &[Reading] {
        &self.readings
    }

    /// The sensor of the scene. Never `None`.
    fn sensor_reference(&self) -> Option<&SensorReference> {
        Some(&self.sensor)
    }

    /// The list of the readings, for changes of their values. Never `None`.
    fn readings_mut(&mut self) -> Option<&mut Vec<Reading>> {
        Some(&mut self.readings)
    }

    /// One for a free mounting, which is fitted to the three components.
    fn fitted_nuisances(&self) -> usize {
        usize::from(self.has_free_mounting)
    }

    /// Size of the measured rotation vectors, rad, of all three components: one of them may be zero.
    fn size(&self, _problem: &Problem) -> f64 {
        self.size
    }

    /// Removes readings after the `horizon`, s, with their axes.
    fn prepare(&mut self, _problem: &Problem, horizon: f64) {
        let is_kept = |time: &Option<f64>| time.is_none_or(|t| t <= horizon);
        self.readings.retain(|r| is_kept(&r.time));
        self.measured.retain(|m| is_kept(&m.time));
    }

    /// Rejects structures, a point outside the rod, a filter that is not positive or of readings at rest, and times
    /// that do not increase within the simulation. Also rejects a free mounting of fewer than two readings, with
    /// another loss than squares or with unequal standard deviations.
    fn check(&self, header: &Header, context: &ValidationContext) -> Result<(), Error> {
        let ValidationContext { problem, key, label, parameters, .. } = context;
        refuse_structure(problem, label, "an orientation of a point")?;
        let outside = |error| Error::invalid(format!("{key}.point"), error, "a point of the rod");
        problem.stencil(self.point).map_err(outside)?;
        let check_rotation = |rotation: [f64; 3], name: &str| {
            let (key, found) = (format!("sensors.{name}.rotation"), format!("{rotation:?}"));
            let allowed =
                "0 of an orientation: tare = \"free\" of the observation is its unknown rotation";
            ensure(rotation == [0.0; 3], key, found, allowed)
        };
        let filtered = FilteredReadings { readings: &self.readings, low_pass: self.low_pass };
        self.sensor.check(filtered, problem, key, parameters, check_rotation)?;
        self.sensor.check_without_position(problem)?;
        self.sensor.check_without_gain(problem)?;
        if self.has_free_mounting {
            header.check_free_nuisance(self.readings.len(), key, "axes and rotation")?;
        }
        check_readings(&self.readings, context)
    }

    /// Adds the axes at the point to the required `outputs`: in motion, with the time of the last reading, if any
    /// reading has a time, and at rest if any has none.
    fn require(&self, outputs: &mut Requirements) {
        let last = self.readings.iter().filter_map(|r| r.time).reduce(f64::max);
        self.sensor.require(last, outputs);
        if last.is_some() {
            outputs.moving.push(self.point);
            outputs.beside.push(self.point);
        }
        if self.readings.iter().any(|r| r.time.is_none()) {
            outputs.resting.push(self.point);
            outputs.beside_at_rest.push(self.point);
        }
    }

    /// Calls `each` with the component of the rotation vector from measured to simulated axes, rad, less the change of
    /// the value, in the order of the readings. With a free mounting the mean of these differences is zero. Readings
    /// whose kind of simulation (motion or rest) is absent are skipped. An error for times after the end, and a point
    /// outside the rod.
    fn differences<D: GaugeScalar>(
        &self,
        simulated: &SimulatedOutput<D>,
        each: &mut dyn FnMut(D),
    ) -> Result<(), Error> {
        let axes = self.simulated_axes(simulated)?;
        let relative = |(k, axes): &(usize, Matrix3<D>)| {
            let measured = self.measured[*k].axes.map(|row| row.map(D::from));
            product(&transpose(&measured), axes)
        };
        let rotations: Vec<Matrix3<D>> = axes.iter().map(relative).collect();
        let change = |k: usize| self.readings[k].value - self.measured[k].value;
        let (mut back, mut mean_change) = (None, 0.0);
        if self.has_free_mounting {
            back = Some(transpose(&mean_rotation(&rotations)));
            let count = axes.len().max(1) as f64;
            mean_change = axes.iter().map(|(k, _)| change(*k)).sum::<f64>() / count;
        }
        for ((k, _), rotation) in axes.iter().zip(&rotations) {
            let vector = match &back {
                Some(back) => rotation_vector(&product(back, rotation)),
                None => rotation_vector(rotation),
            };
            each(vector[self.component] - (change(*k) - mean_change));
        }
        Ok(())
    }
}
