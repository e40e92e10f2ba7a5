//! Readings of a user-defined quantity, over time or at rest, as from a strain gauge or a load cell.
//!
//! Input: an [`Observable`], a function of positions and velocities of some points of the rod; its readings in its own
//! unit, with times in s or at rest; one standard deviation in this unit. Output: [`Gauge`], a data set whose
//! differences in a fit are the quantity of the simulated rod less the reading.
//! They do not depend on the camera of the scene. Points that are not on the rod, readings that are not finite, times
//! that do not strictly increase from 0 to the end of the simulation, and structures are errors. [`Gauge::over_time`]
//! and [`Gauge::at_rest`] make gauges. Only the library has gauges, fit files do not. [`check_readings`] checks times
//! and values, also of sensors.

use crate::error::{Error, ensure};
use crate::fit::measurement::dataset::{DataKind, Dataset, Header, ValidationContext};
use crate::fit::measurement::quantity::{
    DynObservable, GaugeContext, GaugeScalar, Observable, PointState,
};
use crate::fit::measurement::reading::Reading;
use crate::fit::measurement::simulated::{Requirements, SimulatedOutput};
use crate::fit::structure::structure_problem::refuse_structure;
use crate::scene::Point;
use std::sync::Arc;

/// Readings of an [`Observable`], in the order of their times. They do not depend on the camera of the scene.
#[derive(Clone, Debug)]
pub struct GaugeReadings {
    /// Values with their times.
    pub readings: Vec<Reading>,
    /// The points of the rod that the quantity depends on.
    points: Vec<Point>,
    quantity: Arc<dyn DynObservable>,
}

/// Readings of a user-defined quantity with their header.
pub type Gauge = Dataset<GaugeReadings>;

impl Gauge {
    /// Readings (time, s, and value) of a `quantity` during a motion, in the `unit`, with the standard deviation
    /// `sigma` of each. `name` is for messages.
    pub fn over_time(
        name: impl Into<String>,
        unit: impl Into<String>,
        quantity: impl Observable,
        readings: &[(f64, f64)],
        sigma: f64,
    ) -> Self {
        let reading = |(time, value): &(f64, f64)| Reading { time: Some(*time), value: *value };
        Self::new(name, unit, quantity, readings.iter().map(reading).collect(), sigma)
    }

    /// Readings of a `quantity` of the rod at rest, in the `unit`, with the standard deviation `sigma` of each. `name`
    /// is for messages.
    pub fn at_rest(
        name: impl Into<String>,
        unit: impl Into<String>,
        quantity: impl Observable,
        values: &[f64],
        sigma: f64,
    ) -> Self {
        let reading = |value: &f64| Reading { time: None, value: *value };
        Self::new(name, unit, quantity, values.iter().map(reading).collect(), sigma)
    }

    /// A gauge with these readings in the `unit`, with the standard deviation `sigma` of each. The points are those of
    /// the quantity.
    fn new(
        name: impl Into<String>,
        unit: impl Into<String>,
        quantity: impl Observable,
        readings: Vec<Reading>,
        sigma: f64,
    ) -> Self {
        let header = Header { name: name.into(), ..Header::with_sigma(unit, sigma) };
        let (points, quantity) = (quantity.points(), Arc::new(quantity));
        Self { header, data: GaugeReadings { readings, points, quantity } }
    }
}

impl DataKind for GaugeReadings {
    /// Name of the kind of data in keys of messages: `gauge`; fit files have no such table.
    fn table(&self) -> &'static str {
        "gauge"
    }

    /// The name of the gauge, from the header.
    fn label(&self, header: &Header) -> String {
        header.name.clone()
    }

    /// Name of the axis of readings in reports: `g`. Never `None`.
    fn axis(&self) -> Option<&'static str> {
        Some("g")
    }

    /// The values of the gauge with their times.
    fn readings(&self) -> &[Reading] {
        &self.readings
    }

    /// The list of the readings, for changes. Never `None`.
    fn readings_mut(&mut self) -> Option<&mut Vec<Reading>> {
        Some(&mut self.readings)
    }

    /// Rejects structures, points that are not on the rod and readings that are not finite. Times must strictly
    /// increase within 0 to the end of the simulation. Readings at rest have no times to check. Errors have the label.
    /// An error also for times with a scene that has none.
    fn check(&self, _header: &Header, context: &ValidationContext) -> Result<(), Error> {
        let ValidationContext { problem, label, .. } = context;
        refuse_structure(problem, label, "a user-defined measurement")?;
        for point in &self.points {
            problem.stencil(*point).map_err(|error| {
                Error::invalid(format!("{label}: points"), error, "points of the rod")
            })?;
        }
        check_readings(&self.readings, context)
    }

    /// Adds the points of the quantity to the required `outputs`. If any reading has a time, they are added to the
    /// points in motion, with the time of the last reading. If any has none, they are added to those at rest.
    fn require(&self, outputs: &mut Requirements) {
        if let Some(last) = self.readings.iter().filter_map(|r| r.time).reduce(f64::max) {
            outputs.last_read = outputs.last_read.max(last);
            outputs.moving.extend(&self.points);
        }
        if self.readings.iter().any(|r| r.time.is_none()) {
            outputs.resting.extend(&self.points);
        }
    }

    /// Calls `each` with the quantity of the simulated rod less the reading, in the order of the readings and in their
    /// unit. Readings whose kind of simulation (motion or rest) is absent are skipped. An error for points that are not
    /// on the rod and times after the end.
    fn differences<D: GaugeScalar>(
        &self,
        simulated: &SimulatedOutput<D>,
        each: &mut dyn FnMut(D),
    ) -> Result<(), Error> {
        // The points are located on the mesh once for all readings.
        let stencils = self.points.iter().map(|point| point.fixed().stencil(simulated.mesh));
        let stencils = stencils.collect::<Result<Vec<_>, _>>()?;
        let mut points = Vec::with_capacity(stencils.len());
        for Reading { time, value } in &self.readings {
            let (record, time) = match time {
                Some(time) => (simulated.moving, *time),
                None => (simulated.resting, 0.0),
            };
            let Some(record) = record else { continue };
            points.clear();
            for stencil in &stencils {
                let [position, velocity] = record.motion(stencil, time)?;
                points.push(PointState { position, velocity });
            }
            let context = GaugeContext { time, points: &points, scene: simulated.scene };
            each(D::evaluate(&*self.quantity, &context) - *value);
        }
        Ok(())
    }
}

/// Rejects readings that are not finite, and times that do not strictly increase within 0 to the end of the simulation.
/// Readings at rest have no times to check. Errors have the label and the times. An error also for times with a scene
/// that has none.
pub(crate) fn check_readings(
    readings: &[Reading],
    ValidationContext { problem, label, other_clock, .. }: &ValidationContext,
) -> Result<(), Error> {
    // Readings over time need increasing times within the simulation.
    let times: Vec<f64> = readings.iter().filter_map(|r| r.time).collect();
    if !times.is_empty() {
        let end = problem.time()?.end;
        let is_inside = |t: &f64| *t >= 0.0 && (*other_clock || *t <= end * (1.0 + 1e-9));
        let outside = times.iter().find(|t| !is_inside(t)).map(|t| format!("t = {t} s"));
        let unordered = || {
            // Times that are no numbers are outside.
            let pair = times.windows(2).find(|w| w[0] >= w[1])?;
            Some(format!("t = {} s after {} s", pair[1], pair[0]))
        };
        if let Some(found) = outside.or_else(unordered) {
            let allowed = format!("increasing times in 0 .. {end} s, time.end");
            return Err(Error::invalid(*label, found, allowed));
        }
    }
    let are_finite = readings.iter().all(|r| r.value.is_finite());
    ensure(are_finite, *label, "other readings", "finite values")
}
