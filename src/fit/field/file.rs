//! Conversion of a fit file with `[[field]]` tables to a fit of lists of values along the rod.
//!
//! [`FitFile::field_fit`] copies scene, recorded motions, lists and single parameters, each in the order of the file,
//! into a [`FieldFit`]. It returns `None` for a file without `[[field]]`. Keys without a meaning in such a fit are
//! errors: several experiments, a structure, input uncertainties, `[analysis]`, validation data, and measurements that
//! are no recorded motion. Other conditions, such as noise and mesh, are checked by `FieldFit::check`, not here.

use crate::error::Error;
use crate::fit::field::plan::FieldFit;
use crate::fit::file::FitFile;
use crate::fit::structure::structure_problem::refuse_structure;
use crate::fit::uncertainty::analysis::Analysis;

impl FitFile {
    /// The fit of lists along the rod that the file describes, before [`FieldFit`]'s own check of noise, mesh and
    /// priors; `None` for a file without `[[field]]`.
    ///
    /// # Errors
    ///
    /// Keys that such a fit does not support: several experiments, a structure, other measurements than motions,
    /// validation data, inputs with an uncertainty, and analyses.
    pub fn field_fit(&self) -> Result<Option<FieldFit>, Error> {
        if self.fields.is_empty() {
            return Ok(None);
        }
        let refused = |key: &str, found: &str, allowed: &str| {
            Err(Error::invalid(key, found, format!("{allowed} together with [[field]]")))
        };
        // A fit of lists has one problem, exact inputs and no further analyses.
        let [experiment] = &self.experiments[..] else {
            return refused("experiment", "several experiments", "one experiment");
        };
        if !self.knowns.is_empty() {
            return refused("known", "an input uncertainty", "none");
        }
        if self.analysis != Analysis::default() {
            return refused("analysis", "keys of [analysis]", "none");
        }
        refuse_structure(&experiment.problem, "scene", "[[field]]")?;
        let mut fit = FieldFit::new(&experiment.problem);
        for measurement in &experiment.measurements {
            match measurement.observation() {
                Some(observation) if !measurement.held_out() => fit = fit.observe(observation),
                Some(_) => {
                    return refused(
                        "observation.held_out",
                        "true",
                        "fitted observations \
                                           only",
                    );
                }
                None if !measurement.data.readings().is_empty() => {
                    return refused("observation.quantity", "a sensor", "recorded motions");
                }
                None => return refused("shape, frequencies", "one", "recorded motions"),
            }
        }
        // Lists and single parameters keep the order of the file.
        let fit = self.fields.iter().fold(fit, |fit, field| fit.along(field.clone()));
        Ok(Some(self.unknowns.iter().fold(fit, |fit, unknown| fit.identify(unknown.clone()))))
    }
}
