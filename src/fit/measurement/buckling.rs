//! Measured critical loads of a rod: the value of a load at which it buckles.
//!
//! Input: the load, a number of the scene (as `loads.point.0.force.x`), and its measured critical value, N or N m.
//! Output: [`Buckling`], a data set whose difference in a fit is simulated less measured critical load. The simulated
//! one is the smallest value of the same sign at which the lowest mode loses its stiffness, under the other loads of
//! the scene. A load that is no force or moment of the scene, a value that is zero or not finite, and structures are
//! errors.

use crate::error::{Error, ensure};
use crate::fit::measurement::dataset::{DataKind, Dataset, Header, ValidationContext};
use crate::fit::measurement::load_deflection::check_load;
use crate::fit::measurement::quantity::GaugeScalar;
use crate::fit::measurement::simulated::{BucklingCase, Requirements, SimulatedOutput};
use crate::fit::structure::structure_problem::refuse_structure;
use crate::problem::Problem;
use crate::scene::Parameter;

/// A measured critical value of a load.
#[derive(Clone, Debug)]
pub struct BucklingLoad {
    /// The number of the scene that takes the value.
    pub load: Parameter,
    /// The critical value, in the unit of the number.
    pub value: f64,
}

/// A measured critical load with its header.
pub type Buckling = Dataset<BucklingLoad>;

impl Buckling {
    /// The critical value of a `load` with its standard deviation, both in the unit of the number in the scene.
    ///
    /// ```
    /// use rodfit::fit::Buckling;
    /// let measured = Buckling::new("loads.point.0.force.x".parse()?, -2.31, 0.02); // N
    /// assert_eq!(measured.values(), 1);
    /// # Ok::<(), rodfit::Error>(())
    /// ```
    pub fn new(load: Parameter, value: f64, sigma: f64) -> Self {
        Self { header: Header::with_sigma(load.unit(), sigma), data: BucklingLoad { load, value } }
    }
}

impl DataKind for BucklingLoad {
    /// Name of the table of a fit file: `buckling`.
    fn table(&self) -> &'static str {
        "buckling"
    }

    /// A name for messages: `the critical` and the name of the load.
    fn label(&self, _header: &Header) -> String {
        format!("the critical {}", self.load)
    }

    /// The number of the only reading, 1.
    fn abscissas(&self, _problem: &Problem) -> Vec<f64> {
        vec![1.0]
    }

    /// Name of the load in reports: `P`. Never `None`.
    fn axis(&self) -> Option<&'static str> {
        Some("P")
    }

    /// The measured critical load, a list of one number: N, or N m of a moment.
    fn scalars(&self) -> Vec<f64> {
        vec![self.value]
    }

    /// A mutable reference to the critical load.
    fn scalars_mut(&mut self) -> Vec<&mut f64> {
        vec![&mut self.value]
    }

    /// The magnitude of the critical load.
    fn size(&self, _problem: &Problem) -> f64 {
        self.value.abs()
    }

    /// Rejects structures, a load that is no force or moment of the scene, and a value that is zero or not finite.
    fn check(&self, _header: &Header, context: &ValidationContext) -> Result<(), Error> {
        let ValidationContext { problem, key, label, .. } = context;
        refuse_structure(problem, label, "a critical load")?;
        check_load(self.load, problem, key)?;
        let is_valid = self.value.is_finite() && self.value != 0.0;
        ensure(is_valid, format!("{key}.value"), self.value, "a finite number, not 0")
    }

    /// Adds the critical load, with the measured value as the expected one, to the required `outputs`.
    fn require(&self, outputs: &mut Requirements) {
        outputs.buckling_cases.push(BucklingCase { load: self.load, expected: self.value });
    }

    /// Calls `each` once, with the simulated less the measured critical load, N or N m; not at all if `simulated` has
    /// no critical load. There are no errors.
    fn differences<D: GaugeScalar>(
        &self,
        simulated: &SimulatedOutput<D>,
        each: &mut dyn FnMut(D),
    ) -> Result<(), Error> {
        simulated.critical_loads.iter().for_each(|found| each(*found - self.value));
        Ok(())
    }
}
