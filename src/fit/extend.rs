//! A fit again, with what explains best what the first one left.

use crate::error::Error;
use crate::fit::file::FitFile;
use crate::fit::report::FitReport;
use crate::fit::uncertainty::extensions::{EXTENSIONS, Sizes};
use crate::fit::unknown::Unknown;

impl FitFile {
    /// The fit with the term that explains best what its `report` left, or with the number that is most likely off;
    /// none where noise explains it.
    ///
    /// # Errors
    ///
    /// Scenes that cannot have the values of the report.
    pub fn extended(&self, report: &FitReport) -> Result<Option<Self>, Error> {
        let best = report.score_tests.first().filter(|test| test.is_significant());
        let extension = best.and_then(|best| EXTENSIONS.iter().find(|e| e.place == best.source));
        let (Some(best), Some(extension)) = (best, extension) else { return Ok(None) };
        let (mut file, parameter) = (self.clone(), extension.parameter());
        let (mut names, mut start) = (Vec::new(), None);
        for experiment in &mut file.experiments {
            let problem = experiment.problem.with(report.parameters_of(experiment))?;
            let sizes = Sizes::of(experiment, &problem);
            if let Some(problem) = extension.added(&experiment.problem, &sizes) {
                let there = parameter.of(problem.scene()).unwrap_or(0.0);
                start.get_or_insert(there + best.estimate);
                names.push(experiment.name.clone());
                experiment.problem = problem;
            }
        }
        let [least, most] = parameter.limits();
        let mut unknown = Unknown::new(parameter);
        unknown.start = start.map(|start| start.clamp(least, most));
        if names.len() < file.experiments.len() {
            unknown.experiments = names;
        }
        file.unknowns.push(unknown);
        Ok(Some(file))
    }
}
