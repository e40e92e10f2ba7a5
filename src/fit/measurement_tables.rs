//! Tables of measurements of one experiment in a fit file: observations, shapes, natural frequencies, load-deflection
//! curves and critical loads.
//!
//! Input: the deserialized tables, the experiment, and the folder to which the paths of data files are relative.
//! [`MeasurementTables::add_to`] reads the measurements and adds them to the experiment, in this order. If all
//! measurements of the experiment are load-deflection curves and critical loads, the scene gets test loads
//! ([`Experiment::set_test_loads`]), so that the mesh is chosen for a loaded rod. Errors are those
//! of the tables and their files, and positions in a unit that does not fit the size of the scene.

use crate::error::Error;
use crate::fit::buckling_form::BucklingForm;
use crate::fit::frequencies_form::FrequenciesForm;
use crate::fit::load_deflection_form::LoadDeflectionForm;
use crate::fit::measurement::experiment::Experiment;
use crate::fit::observation_form::ObservationForm;
use crate::fit::shape_form::ShapeForm;
use std::path::Path;

/// Tables of measurements of one experiment.
pub(crate) struct MeasurementTables {
    pub observation: Vec<ObservationForm>,
    pub shape: Vec<ShapeForm>,
    pub frequencies: Vec<FrequenciesForm>,
    pub load_deflection: Vec<LoadDeflectionForm>,
    pub buckling: Vec<BucklingForm>,
}

impl MeasurementTables {
    /// Whether there is no table.
    pub fn is_empty(&self) -> bool {
        self.observation.is_empty()
            && self.shape.is_empty()
            && self.frequencies.is_empty()
            && self.load_deflection.is_empty()
            && self.buckling.is_empty()
    }

    /// Reads the measurements and adds them to an experiment, in the order observations, shapes, frequencies,
    /// load-deflection curves, critical loads. Paths are relative to `folder`. It also sets the loads of its scene
    /// ([`Experiment::set_test_loads`]). Errors are those of the tables and files, and positions of any measurement of
    /// the experiment in a unit that does not fit the size of the scene.
    pub fn add_to(self, experiment: &mut Experiment, folder: &Path) -> Result<(), Error> {
        // Keys of messages count the tables of this text, not the measurements that the experiment already has.
        let mut measurements = Vec::new();
        for (k, observation) in self.observation.into_iter().enumerate() {
            let key = experiment.key(&format!("observation[{k}]"));
            measurements.extend(observation.read(folder, &experiment.problem, &key)?);
        }
        for (k, shape) in self.shape.into_iter().enumerate() {
            measurements.push(shape.read(folder, &experiment.key(&format!("shape[{k}]")))?);
        }
        for (k, frequencies) in self.frequencies.into_iter().enumerate() {
            let key = experiment.key(&format!("frequencies[{k}]"));
            measurements.push(frequencies.read(&key)?);
        }
        for (k, curve) in self.load_deflection.into_iter().enumerate() {
            let key = experiment.key(&format!("load_deflection[{k}]"));
            measurements.extend(curve.read(folder, &key)?);
        }
        measurements.extend(self.buckling.iter().map(BucklingForm::read));
        experiment.measurements.extend(measurements);
        experiment.set_test_loads();
        // Units that do not fit the scene are found before the search.
        experiment.measurements.iter().try_for_each(|m| m.check_units(experiment))
    }
}
