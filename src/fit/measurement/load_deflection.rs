//! Measured load-deflection curves: displacements of a point of a rod at rest under several values of one load.
//!
//! Input: the load, a number of the scene (as `loads.point.0.force.y`), and its values in the order in which they were
//! applied, N or N m. For each there is one coordinate of the displacement of a point, m, in world axes. Output:
//! [`LoadDeflection`], a data set whose differences in a fit are simulated less measured displacement. Displacements
//! are relative to the equilibrium at a load of zero, under the other loads of the scene. Those of a dial gauge in
//! `[[sensors]]` have its reading without load added. The equilibria are computed
//! in the order of the loads: each search begins at the equilibrium under the load before. The camera has no effect.
//! [`check_load`] rejects other parameters than loads, also for critical loads. Errors: a load that is no force or
//! moment of the scene, or that is an unknown of the fit; structures; values that are not finite, or displacements of
//! several rod lengths; an empty curve; and points that are not on the rod.

use crate::dynamics::record::RecordView;
use crate::error::{Error, ensure};
use crate::fit::measurement::dataset::{Abscissa, DataKind, Dataset, Header, ValidationContext};
use crate::fit::measurement::quantity::GaugeScalar;
use crate::fit::measurement::sensor_reference::SensorReference;
use crate::fit::measurement::simulated::{LoadCase, Requirements, SimulatedOutput};
use crate::fit::structure::structure_problem::refuse_structure;
use crate::problem::Problem;
use crate::scene::{Parameter, Point};

/// Largest displacement over the length of the rod. A larger one accepts more displacements in a wrong unit, a smaller
/// one rejects those of rods that stretch.
const MOST_DISPLACEMENT: f64 = 3.0;

/// A displacement under a load.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LoadedPoint {
    /// Value of the load, in its unit in the scene, N or N m.
    pub load: f64,
    /// Displacement from the equilibrium without this load, m.
    pub displacement: f64,
}

/// Displacements of a point of the rod at rest under several values of one load.
#[derive(Clone, Debug)]
pub struct LoadCurve {
    /// The number of the scene that takes the values of the load.
    pub load: Parameter,
    /// The point of the rod.
    pub point: Point,
    /// Axis of the displacement in the world, 0 to 2 for x, y and z.
    pub axis: usize,
    /// Loads and displacements, in the order in which the loads were applied.
    pub curve: Vec<LoadedPoint>,
    /// Dial gauge in `[[sensors]]` of the scene, with its reading without load.
    pub(crate) gauge: SensorReference,
}

/// A measured load-deflection curve with its header.
pub type LoadDeflection = Dataset<LoadCurve>;

impl LoadDeflection {
    /// Displacements of a `point` along an `axis` of the world (0 to 2 for x, y and z; larger numbers are taken as 2)
    /// under several values of a `load`, with unknown noise and squared loss.
    ///
    /// ```
    /// use rodfit::Point;
    /// use rodfit::fit::{LoadDeflection, LoadedPoint};
    /// let load = "loads.point.0.force.y".parse()?;
    /// let at = |load, displacement| LoadedPoint { load, displacement }; // N, m
    /// let curve = LoadDeflection::new(load, Point::Tip, 1, vec![at(-0.1, -0.02), at(-0.2, -0.04)]);
    /// assert_eq!(curve.sigma(1e-4).values(), 2);
    /// # Ok::<(), rodfit::Error>(())
    /// ```
    pub fn new(load: Parameter, point: Point, axis: usize, curve: Vec<LoadedPoint>) -> Self {
        Self {
            header: Header::in_meters(),
            data: LoadCurve {
                load,
                point,
                axis: axis.min(2),
                curve,
                gauge: SensorReference::default(),
            },
        }
    }

    /// The displacements as readings of a dial gauge of the scene, by its name in `[[sensors]]`: its `zero_offset` is
    /// added to them.
    pub fn of_sensor(mut self, name: &str) -> Self {
        self.data.gauge = SensorReference(Some(name.into()));
        self
    }
}

impl LoadCurve {
    /// The load of the largest absolute value, with its sign, N or N m; the first one of equal values, and zero for an
    /// empty curve.
    pub(crate) fn largest_load(&self) -> f64 {
        let loads = self.curve.iter().map(|own| own.load);
        loads.fold(0.0, |most: f64, load| if load.abs() > most.abs() { load } else { most })
    }
}

impl DataKind for LoadCurve {
    /// Name of the table of a fit file: `load_deflection`.
    fn table(&self) -> &'static str {
        "load_deflection"
    }

    /// The file, or the name of the header without a file, followed by the name of the displacement, `ux`, `uy` or
    /// `uz`.
    fn label(&self, header: &Header) -> String {
        header.component_label(["ux", "uy", "uz"][self.axis])
    }

    /// The abscissa of plots: the load, a force or a moment.
    fn abscissa(&self) -> Abscissa {
        if self.load.unit() == "N m" { Abscissa::Moment } else { Abscissa::Load }
    }

    /// The load of every displacement, N or N m.
    fn abscissas(&self, _problem: &Problem) -> Vec<f64> {
        self.curve.iter().map(|own| own.load).collect()
    }

    /// Name of the displacement in reports: `ux`, `uy` or `uz`. Never `None`.
    fn axis(&self) -> Option<&'static str> {
        Some(["ux", "uy", "uz"][self.axis])
    }

    /// The displacements in their order, m.
    fn scalars(&self) -> Vec<f64> {
        self.curve.iter().map(|own| own.displacement).collect()
    }

    /// Mutable references to the displacements, in their order.
    fn scalars_mut(&mut self) -> Vec<&mut f64> {
        self.curve.iter_mut().map(|own| &mut own.displacement).collect()
    }

    /// Root mean square of the displacements, m.
    fn size(&self, _problem: &Problem) -> f64 {
        let count = self.curve.len().max(1) as f64;
        (self.curve.iter().map(|own| own.displacement.powi(2)).sum::<f64>() / count).sqrt()
    }

    /// Rejects structures, a load that is no force or moment of the scene, a point that is not on the rod, and a curve
    /// without values. Rejects values that are not finite, displacements above [`MOST_DISPLACEMENT`] lengths, and loads
    /// that the scene does not allow, as a force out of its plane. Rejects a gauge that the scene does not have.
    fn check(&self, _header: &Header, context: &ValidationContext) -> Result<(), Error> {
        let ValidationContext { problem, key, label, .. } = context;
        refuse_structure(problem, label, "a load-deflection curve")?;
        check_load(self.load, problem, key)?;
        problem
            .stencil(self.point)
            .map_err(|error| Error::invalid(format!("{key}.point"), error, "a point of the rod"))?;
        ensure(!self.curve.is_empty(), *label, "no row", "at least one load")?;
        let are_finite =
            self.curve.iter().all(|own| own.load.is_finite() && own.displacement.is_finite());
        ensure(are_finite, *label, "other values", "finite values")?;
        let displacements = self.curve.iter().map(|own| own.displacement.abs());
        let (largest, length) = (displacements.fold(0.0, f64::max), problem.length());
        ensure(
            largest <= MOST_DISPLACEMENT * length,
            *label,
            format!("a displacement of {largest:.4} m of a rod {length} m long"),
            format!(
                "up to {MOST_DISPLACEMENT} times the length of the rod; state another unit in the header, as y[mm]"
            ),
        )?;
        self.gauge.check_gauge(problem, key)?;
        problem.with_fixed_layout([(self.load, self.largest_load())]).map(|_| ())
    }

    /// Adds the equilibria at a load of zero and under each of its values, in this order, to the required `outputs`.
    fn require(&self, outputs: &mut Requirements) {
        let loads = std::iter::once(0.0).chain(self.curve.iter().map(|own| own.load));
        let case = |value| LoadCase { load: self.load, value, point: self.point };
        outputs.load_cases.extend(loads.map(case));
    }

    /// Calls `each` with simulated less measured displacement, m, in the order of the loads; that of a gauge with its
    /// reading without load. `simulated` has the
    /// equilibria of this curve: the first one at a load of zero, from which displacements count. Nothing without
    /// equilibria. An error for a point that is not on the rod.
    fn differences<D: GaugeScalar>(
        &self,
        simulated: &SimulatedOutput<D>,
        each: &mut dyn FnMut(D),
    ) -> Result<(), Error> {
        let [unloaded, loaded @ ..] = simulated.load_cases else { return Ok(()) };
        let stencil = self.point.fixed().stencil(simulated.mesh)?;
        let coordinate = |record: &RecordView<'_, D>| -> Result<D, Error> {
            Ok(record.position(&stencil, D::from(0.0))?[self.axis])
        };
        let mut start = coordinate(unloaded)?;
        if let Some(gauge) = self.gauge.model(simulated.scene) {
            start -= gauge.zero_offset;
        }
        for (record, own) in loaded.iter().zip(&self.curve) {
            each(coordinate(record)? - start - own.displacement);
        }
        Ok(())
    }
}

/// Units of loads with measured values.
const LOAD_UNITS: [&str; 2] = ["N", "N m"];

/// Rejects a `load` that is no force or moment of the scene. `key` is that of the table of its values.
pub(crate) fn check_load(load: Parameter, problem: &Problem, key: &str) -> Result<(), Error> {
    problem.check_parameter(load)?;
    let is_load = load.path().starts_with("loads.point.") && LOAD_UNITS.contains(&load.unit());
    let allowed = "a force or moment in loads.point, such as loads.point.0.force.y";
    ensure(is_load, format!("{key}.load"), load, allowed)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn abscissa_of_plots_has_the_unit_of_the_load() {
        for (path, abscissa) in [
            ("loads.point.0.force.y", Abscissa::Load),
            ("loads.point.0.moment.z", Abscissa::Moment),
        ] {
            let curve = LoadDeflection::new(path.parse().unwrap(), Point::Tip, 1, Vec::new());
            assert_eq!(curve.data.abscissa(), abscissa, "{path}");
        }
    }
}
