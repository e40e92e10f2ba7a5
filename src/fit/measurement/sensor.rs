//! Readings of sensors: components of the force or moment that a support exerts on the rod, over time or at rest.
//!
//! Input: a [`Channel`], the measured component in the frame of the sensor, and its readings (N or N m, with times in s or at
//! rest). Output: [`Sensor`], a data set whose differences in a fit are simulated less measured value. The simulated value
//! at a recorded step passes the [low-pass filter](SensorReadings::low_pass) of the sensor, and is linear between steps. A
//! [known tare](Tare::Known) is added. A [free tare](Tare::Free) is the offset of least squares: the mean is subtracted from
//! the differences, which takes one degree of freedom. Both are exact for the squared loss and equal standard deviations.
//! Times are on the clock of the motion, and the camera has no effect. Free ends, structures, times outside of the
//! simulation, and a free tare of a single reading or with another loss are errors.

use crate::dynamics::record::RecordView;
use crate::error::{Error, ensure};
use crate::fit::measurement::dataset::{DataKind, Dataset, Header, ValidationContext};
use crate::fit::measurement::gauge::check_readings;
use crate::fit::measurement::loss::Loss;
use crate::fit::measurement::quantity::GaugeScalar;
use crate::fit::measurement::reading::Reading;
use crate::fit::measurement::simulated::{Requirements, SimulatedOutput};
use crate::fit::structure::structure_problem::refuse_structure;
use crate::numerics::scalar::Scalar;
use crate::numerics::vector::{Vector, dot, rotate};
use crate::scene::validate::positive;
use crate::scene::{End, Support};
use crate::statics::Reactions;
use serde::Deserialize;
use std::f64::consts::TAU;

/// Part of the reaction of a support.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
pub enum ReactionPart {
    /// Force of the support on the rod, N.
    Force,
    /// Moment of the support on the rod about the point of the support, N m.
    Moment,
}

impl ReactionPart {
    /// Symbol of the unit.
    pub(crate) fn unit(self) -> &'static str {
        match self {
            Self::Force => "N",
            Self::Moment => "N m",
        }
    }
}

/// A measured component of the reaction of a support.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Channel {
    /// End of the rod with the support.
    pub of: End,
    /// Force or moment.
    pub part: ReactionPart,
    /// Axis of the sensor, 0 to 2 for x, y and z: the name of the component.
    pub axis: usize,
    /// Direction of this axis in the world, a unit vector.
    pub direction: [f64; 3],
}

impl Channel {
    /// The component along axis `axis` (0 to 2) of the world.
    pub fn along_world(of: End, part: ReactionPart, axis: usize) -> Self {
        let direction = std::array::from_fn(|c| f64::from(u8::from(c == axis)));
        Self { of, part, axis, direction }
    }

    /// The component along an axis of a sensor whose frame is turned by the rotation vector `rotation`, rad.
    pub fn rotated(self, rotation: [f64; 3]) -> Self {
        Self { direction: rotate(rotation, self.direction), ..self }
    }

    /// Name of the component in reports: `fx` of a force, `mx` of a moment.
    pub fn name(&self) -> &'static str {
        let names = match self.part {
            ReactionPart::Force => ["fx", "fy", "fz"],
            ReactionPart::Moment => ["mx", "my", "mz"],
        };
        names[self.axis.min(2)]
    }

    /// The component in these reactions, N or N m.
    fn component<D: Scalar>(&self, reactions: &Reactions<D>) -> D {
        let reaction = match self.of {
            End::Start => &reactions.start,
            End::End => &reactions.end,
        };
        let vector: Vector<D> = match self.part {
            ReactionPart::Force => reaction.force,
            ReactionPart::Moment => reaction.moment,
        };
        dot(vector, self.direction.map(D::from))
    }
}

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
    pub channel: Channel,
    /// Values with their times.
    pub readings: Vec<Reading>,
    /// Offset of the sensor.
    pub tare: Tare,
    /// Cutoff frequency of the first-order low-pass filter of the sensor, Hz; none without a filter.
    pub low_pass: Option<f64>,
}

/// Readings of a sensor with their header.
pub type Sensor = Dataset<SensorReadings>;

impl Sensor {
    /// Readings of a `channel`, N or N m, without tare and filter, with unknown noise and squared loss.
    ///
    /// ```
    /// use rodfit::fit::{Channel, Reading, ReactionPart, Sensor, Tare};
    /// use rodfit::scene::End;
    /// let channel = Channel::along_world(End::Start, ReactionPart::Force, 1);
    /// let reading = Reading { time: Some(0.1), value: 0.52 }; // s, N
    /// let cell = Sensor::new(channel, vec![reading]).sigma(0.01).tare(Tare::Known(0.2)); // N
    /// assert_eq!(cell.values(), 1);
    /// ```
    pub fn new(channel: Channel, readings: Vec<Reading>) -> Self {
        let header = Header { unit: channel.part.unit().into(), ..Header::default() };
        let data = SensorReadings { channel, readings, tare: Tare::Known(0.0), low_pass: None };
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
}

impl SensorReadings {
    /// The output of the sensor, without tare, at all recorded times of a motion: the component, filtered if the sensor has a
    /// filter. The filter is exact for a component that is linear between the steps, and starts at the first value.
    fn output<D: Scalar>(&self, record: &RecordView<'_, D>) -> Vec<D> {
        let mut values: Vec<D> =
            record.reactions().map(|reactions| self.channel.component(&reactions)).collect();
        let (Some(frequency), Some(first)) = (self.low_pass, values.first().copied()) else {
            return values;
        };
        let (rate, mut output, mut before) = (TAU * frequency, first, first);
        for (k, value) in values.iter_mut().enumerate().skip(1) {
            let h = record.times()[k] - record.times()[k - 1];
            // dy/dt = rate (u - y) with u linear over the step.
            let lag = (*value - before) * (1.0 / (rate * h));
            before = *value;
            output =
                before - lag + (output - (before - lag * (rate * h)) + lag) * (-rate * h).exp();
            *value = output;
        }
        values
    }
}

impl DataKind for SensorReadings {
    /// Name of the table of a fit file: `observation`.
    fn table(&self) -> &'static str {
        "observation"
    }

    /// The file and the name of the component; without a file that of the header.
    fn label(&self, header: &Header) -> String {
        header.component_label(self.channel.name())
    }

    /// Name of the component in reports.
    fn axis(&self) -> Option<&'static str> {
        Some(self.channel.name())
    }

    /// The values of the sensor with their times.
    fn readings(&self) -> &[Reading] {
        &self.readings
    }

    /// The list of the readings, for changes.
    fn readings_mut(&mut self) -> Option<&mut Vec<Reading>> {
        Some(&mut self.readings)
    }

    /// One for a free tare, which is fitted to the values.
    fn fitted_nuisances(&self) -> usize {
        usize::from(self.tare == Tare::Free)
    }

    /// Rejects structures, an end without a support, a filter that is not positive or of readings at rest, a free tare of
    /// fewer than two readings, with another loss than squares or with unequal standard deviations, times that do not
    /// increase within the simulation, and readings that are not finite.
    fn check(&self, header: &Header, context: &ValidationContext) -> Result<(), Error> {
        let ValidationContext { problem, key, label, .. } = context;
        refuse_structure(problem, label, "a force or moment of a support")?;
        let (name, support) = match self.channel.of {
            End::Start => ("start", problem.scene().supports.start),
            End::End => ("end", problem.scene().supports.end),
        };
        let allowed = "an end that a support holds";
        ensure(
            support != Support::Free,
            format!("{key}.of"),
            format!("{name}, a free end"),
            allowed,
        )?;
        if let Some(frequency) = self.low_pass {
            positive(&format!("{key}.filter.low_pass"), frequency)?;
            let moves = self.readings.iter().all(|r| r.time.is_some());
            let found = "a filter of readings at rest";
            ensure(moves, format!("{key}.filter"), found, "a filter of readings over time only")?;
        }
        if self.tare == Tare::Free {
            let tare = format!("{key}.tare");
            let count = self.readings.len();
            let found = format!("\"free\" of {count} reading");
            ensure(count > 1, &tare, found, "a number, or at least two readings")?;
            let allowed = "a number, or loss = \"squares\" with one sigma";
            let is_linear = header.loss == Loss::Squares && header.sigma_factors.is_empty();
            ensure(is_linear, &tare, "\"free\" with a robust loss or several sigmas", allowed)?;
        }
        check_readings(&self.readings, context)
    }

    /// Adds the reactions to the required `outputs`: in motion, with the time of the last reading, or at rest.
    fn require(&self, outputs: &mut Requirements) {
        if let Some(last) = self.readings.iter().filter_map(|r| r.time).reduce(f64::max) {
            outputs.last_read = outputs.last_read.max(last);
            outputs.moving_reactions = true;
        }
        outputs.resting_reactions |= self.readings.iter().any(|r| r.time.is_none());
    }

    /// Calls `each` with simulated less measured value, in the order of the readings and in their unit. Readings whose kind of
    /// simulation (motion or rest) is absent are skipped. An error for times after the end.
    fn differences<D: GaugeScalar>(
        &self,
        simulated: &SimulatedOutput<D>,
        each: &mut dyn FnMut(D),
    ) -> Result<(), Error> {
        let output = simulated.moving.as_ref().map(|record| self.output(record));
        let at_rest = simulated.resting.as_ref().and_then(|record| record.reactions().next());
        let at_rest = at_rest.map(|reactions| self.channel.component(&reactions));
        let mut differences = Vec::with_capacity(self.readings.len());
        for Reading { time, value } in &self.readings {
            let found = match (time, &simulated.moving, &output) {
                (Some(time), Some(record), Some(output)) => record.linear(output, *time)?,
                (None, ..) if let Some(at_rest) = at_rest => at_rest,
                _ => continue,
            };
            differences.push(found - *value);
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
