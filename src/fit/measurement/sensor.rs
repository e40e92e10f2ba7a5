//! Readings of sensors: force or moment of a support on the rod, acceleration, angle, curvature or strain of a point,
//! over time or at rest.
//!
//! Input: a [`SensorChannel`], the measured component, and its readings (N, N m, m/s^2, rad, 1/m or part of the length,
//! with times in s or at rest). Output: [`Sensor`], a data set whose differences in a fit are simulated less measured
//! value. The simulated value at a recorded step passes the first-order [low-pass filter](SensorReadings::low_pass) of
//! the sensor, if it has one. The filter starts at the first value. Between steps the value is linear. A [known
//! tare](Tare::Known) is added to it. A [free tare](Tare::Free) is the offset of least squares: the mean is subtracted
//! from the differences, which takes one degree of freedom. Angles that differ by whole turns are the same. Times are
//! on the clock of the motion, and the camera has no effect. Errors: components that the [channel](SensorChannel) does
//! not have in the scene, as at a free end; structures; times that do not increase within the simulation; readings that
//! are not finite; and a filter of readings at rest. So is a free tare of a single reading, with another loss than
//! squares, or with unequal standard deviations.

use crate::dynamics::record::RecordView;
use crate::error::{Error, ensure};
use crate::fit::measurement::dataset::{DataKind, Dataset, Header, ValidationContext};
use crate::fit::measurement::gauge::check_readings;
use crate::fit::measurement::low_pass::low_pass_filter;
use crate::fit::measurement::quantity::GaugeScalar;
use crate::fit::measurement::reading::Reading;
use crate::fit::measurement::sensor_channel::SensorChannel;
use crate::fit::measurement::sensor_reference::{FilteredReadings, SensorReference};
use crate::fit::measurement::simulated::{Requirements, SimulatedOutput};
use crate::fit::structure::structure_problem::refuse_structure;
use crate::numerics::scalar::Scalar;
use crate::numerics::upper_median;
use std::f64::consts::TAU;

/// Offset of a sensor: its reading without a load.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Tare {
    /// A known offset, in the unit of the readings.
    Known(f64),
    /// An unknown constant offset, a nuisance parameter of the readings.
    Free,
}

/// Readings of one channel of a sensor, in the order of their times.
#[derive(Clone, Debug)]
pub struct SensorReadings {
    /// The measured component.
    pub channel: SensorChannel,
    /// Values with their times.
    pub readings: Vec<Reading>,
    /// Offset of the sensor.
    pub tare: Tare,
    /// Cutoff frequency of the first-order low-pass filter of the sensor, Hz; none without a filter.
    pub low_pass: Option<f64>,
    /// The sensor in `[[sensors]]` of the scene, with its frame, clock and filter.
    pub(crate) sensor: SensorReference,
}

/// Readings of a sensor with their header.
pub type Sensor = Dataset<SensorReadings>;

impl Sensor {
    /// Readings of a `channel`, N, N m, m/s^2, rad, 1/m or part of the length, without tare and filter, with unknown
    /// noise and squared loss.
    ///
    /// ```
    /// use rodfit::fit::{Channel, Reading, ReactionPart, Sensor, Tare};
    /// use rodfit::scene::End;
    /// let channel = Channel::along_world(End::Start, ReactionPart::Force, 1);
    /// let reading = Reading { time: Some(0.1), value: 0.52 }; // s, N
    /// let cell = Sensor::new(channel, vec![reading]).sigma(0.01).tare(Tare::Known(0.2)); // N
    /// assert_eq!(cell.values(), 1);
    /// ```
    pub fn new(channel: impl Into<SensorChannel>, readings: Vec<Reading>) -> Self {
        let channel = channel.into();
        let header = Header { unit: channel.unit().into(), ..Header::default() };
        let tare = Tare::Known(0.0);
        let data = SensorReadings {
            channel,
            readings,
            tare,
            low_pass: None,
            sensor: SensorReference::default(),
        };
        Self { header, data }
    }

    /// The readings with another offset of the sensor.
    pub fn tare(mut self, tare: Tare) -> Self {
        self.data.tare = tare;
        self
    }

    /// The readings of a sensor with a first-order low-pass filter of this cutoff frequency, Hz.
    pub fn low_pass(mut self, frequency: f64) -> Self {
        self.data.low_pass = Some(frequency);
        self
    }

    /// The readings of a sensor of the scene, by its name in `[[sensors]]`: rotation, gain, delay and filter are those
    /// of this table, and can be identified.
    pub fn of_sensor(mut self, name: &str) -> Self {
        self.data.sensor = SensorReference(Some(name.into()));
        self
    }
}

impl SensorReadings {
    /// The component at all times of a record, without filter, in the frame of the sensor of the scene and times its
    /// gain, which angles do not have.
    fn components<D: Scalar>(
        &self,
        record: &RecordView<'_, D>,
        simulated: &SimulatedOutput<D>,
    ) -> Result<Vec<D>, Error> {
        match self.sensor.model(simulated.scene) {
            Some(model) => {
                let mut values = self.channel.values_of_sensor(model, record, simulated)?;
                if !self.channel.is_angle() {
                    values.iter_mut().for_each(|value| *value *= model.gain);
                }
                Ok(values)
            }
            None => self.channel.values(record, simulated),
        }
    }

    /// The output of the sensor, without tare, at all recorded times of a motion: the component, filtered by
    /// `dy/dt = 2 pi f (u - y)` if the sensor has a filter with the cutoff frequency `f`. The filter is exact for a
    /// component `u` that is linear between the steps, and starts at the first value. Angles are continued without
    /// jumps of whole turns. Error: a point outside the rod or not recorded.
    fn output<D: Scalar>(
        &self,
        record: &RecordView<'_, D>,
        simulated: &SimulatedOutput<D>,
    ) -> Result<Vec<D>, Error> {
        let mut values = self.components(record, simulated)?;
        if self.channel.is_angle() {
            join_turns(&mut values);
        }
        if let Some(frequency) = self.sensor.low_pass(simulated.scene, self.low_pass) {
            low_pass_filter(&mut values, record.times(), frequency);
        }
        Ok(values)
    }
}

/// Adds whole turns to angles, rad, so that each differs from the one before by at most half a turn.
fn join_turns<D: Scalar>(angles: &mut [D]) {
    for k in 1..angles.len() {
        angles[k] = nearest_turn(angles[k], angles[k - 1].value());
    }
}

/// The angle, rad, plus the whole turns that bring it nearest to another one.
fn nearest_turn<D: Scalar>(angle: D, other: f64) -> D {
    angle - TAU * ((angle.value() - other) / TAU).round()
}

impl DataKind for SensorReadings {
    /// Name of the table of a fit file: `observation`.
    fn table(&self) -> &'static str {
        "observation"
    }

    /// The file, or the name of the header without a file, followed by the name of the component.
    fn label(&self, header: &Header) -> String {
        header.component_label(self.channel.name())
    }

    /// Name of the component in reports. Never `None`.
    fn axis(&self) -> Option<&'static str> {
        Some(self.channel.name())
    }

    /// The values of the sensor with their times.
    fn readings(&self) -> &[Reading] {
        &self.readings
    }

    /// The sensor of the scene. Never `None`.
    fn sensor_reference(&self) -> Option<&SensorReference> {
        Some(&self.sensor)
    }

    /// The list of the readings, for changes. Never `None`.
    fn readings_mut(&mut self) -> Option<&mut Vec<Reading>> {
        Some(&mut self.readings)
    }

    /// One for a free tare, which is fitted to the values.
    fn fitted_nuisances(&self) -> usize {
        usize::from(self.tare == Tare::Free)
    }

    /// Rejects structures, cases that the channel does not allow (as an end without a support), and a filter that is
    /// not positive or of readings at rest. Rejects times that do not increase within the simulation, and readings that
    /// are not finite. Also rejects a free tare of fewer than two readings, with another loss than squares or with
    /// unequal standard deviations.
    fn check(&self, header: &Header, context: &ValidationContext) -> Result<(), Error> {
        let ValidationContext { problem, key, label, parameters, .. } = context;
        refuse_structure(problem, label, "a sensor")?;
        let is_at_rest = self.readings.iter().any(|r| r.time.is_none());
        self.channel.check(problem, key, is_at_rest)?;
        let check_rotation =
            |rotation, name: &str| self.channel.check_rotated(rotation, problem, name);
        let filtered = FilteredReadings { readings: &self.readings, low_pass: self.low_pass };
        self.sensor.check(filtered, problem, key, parameters, check_rotation)?;
        if matches!(self.channel, SensorChannel::Point(_)) {
            self.sensor.check_without_position(problem)?;
        }
        if self.channel.is_angle() {
            self.sensor.check_without_gain(problem)?;
        }
        if let Tare::Known(offset) = self.tare {
            ensure(offset.is_finite(), format!("{key}.tare"), offset, "a finite number")?;
        }
        if self.tare == Tare::Free {
            header.check_free_nuisance(self.readings.len(), key, "a number")?;
        }
        check_readings(&self.readings, context)
    }

    /// Adds the reactions or the point of the channel to the required `outputs`: in motion, with the time of the last
    /// reading, if any reading has a time, and at rest if any has none.
    fn require(&self, outputs: &mut Requirements) {
        let last = self.readings.iter().filter_map(|r| r.time).reduce(f64::max);
        let rests = self.readings.iter().any(|r| r.time.is_none());
        self.sensor.require(last, outputs);
        self.channel.require(last.is_some(), rests, outputs);
    }

    /// Calls `each` with simulated plus tare less measured value, in the order of the readings and in their unit. A
    /// free tare is the constant that makes the mean of these differences zero. Differences of angles are continuous,
    /// with the whole turns for which their median is nearest to that of an exact model (minus a known tare, or zero).
    /// Readings whose kind of simulation (motion or rest) is absent are skipped. An error for times after the end, and
    /// a point outside the rod.
    fn differences<D: GaugeScalar>(
        &self,
        simulated: &SimulatedOutput<D>,
        each: &mut dyn FnMut(D),
    ) -> Result<(), Error> {
        // A record of other measurements may lack the nodes of this one.
        let moves = self.readings.iter().any(|r| r.time.is_some());
        let output = match simulated.moving.as_ref().filter(|_| moves) {
            Some(record) => Some(self.output(record, simulated)?),
            None => None,
        };
        let has_rest = self.readings.iter().any(|r| r.time.is_none());
        let at_rest = match simulated.resting.as_ref().filter(|_| has_rest) {
            Some(record) => self.components(record, simulated)?.first().copied(),
            None => None,
        };
        let exact = if let Tare::Known(tare) = self.tare { -tare } else { 0.0 };
        let mut differences = Vec::with_capacity(self.readings.len());
        for Reading { time, value } in &self.readings {
            let found = match (time, &simulated.moving, &output) {
                (Some(time), Some(record), Some(output)) => {
                    record.linear(output, self.sensor.time_of_motion(*time, simulated.scene))?
                }
                (None, ..) if let Some(at_rest) = at_rest => at_rest,
                _ => continue,
            };
            let difference = found - *value;
            // Whole turns: near the difference before, and the first one near that of an exact model.
            let before = differences.last().map_or(exact, |before: &D| before.value());
            let is_angle = self.channel.is_angle();
            differences.push(if is_angle { nearest_turn(difference, before) } else { difference });
        }
        if self.channel.is_angle() {
            // Outliers may have moved the later ones by a turn: most of them are near those of an exact model.
            let median = upper_median(differences.iter().map(|d| d.value())).unwrap_or(exact);
            let turns = TAU * ((median - exact) / TAU).round();
            differences.iter_mut().for_each(|difference| *difference -= turns);
        }
        let tare = match self.tare {
            Tare::Known(tare) => D::from(tare),
            // The tare of least squares makes the mean difference zero.
            Tare::Free => {
                let count = differences.len().max(1) as f64;
                -differences.iter().copied().sum::<D>() / count
            }
        };
        differences.into_iter().for_each(|difference| each(difference + tare));
        Ok(())
    }
}
