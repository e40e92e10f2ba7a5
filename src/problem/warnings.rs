//! Warnings of a simulation: time steps, recordings, units, and the estimated error.
//!
//! Each is a [`Code`] and a text with finding, consequence and action. `Problem::warnings` collects them for users.

use crate::code::Code;
use crate::problem::Problem;
use crate::problem::plausibility::Purpose;
use crate::scene::Resolution;

impl Problem {
    /// Warnings of a simulation of the scene: steps that do not resolve the motion of a support, and defects of the recordings
    /// that drive the ends. Others are implausible units, and an estimated error above the requested one.
    pub fn warnings(&self) -> Vec<String> {
        self.coded_warnings().into_iter().map(|(code, words)| code.behind(words)).collect()
    }

    /// The warnings with their codes, which their text does not contain.
    pub(crate) fn coded_warnings(&self) -> Vec<(Code, String)> {
        let mut warnings = self.recording_warnings();
        warnings.extend(self.step_warnings());
        warnings.extend(self.plausibility_notes(Purpose::Motion));
        warnings.extend(self.resolution().and_then(Resolution::warning));
        warnings
    }

    /// Warnings of steps that do not resolve the motion of a support, or are longer than the simulation; empty without `[time]`.
    pub(crate) fn step_warnings(&self) -> Vec<(Code, String)> {
        let Some(time) = &self.scene().time else { return Vec::new() };
        let mut warnings = self.scene().supports.step_warnings(time.step_size());
        if time.is_beyond_end() {
            let (step, end) = (time.step_size(), time.end);
            let words = format!(
                "time.step = {step:e} s is longer than time.end = {end:e} s. The motion is computed in one step, with a large \
                 error. Take a small part of time.end, or leave time.step out"
            );
            warnings.push((Code::StepBeyondEnd, words));
        }
        warnings
    }

    /// Warnings of defects, corrected or not, of the recordings that drive the ends; empty without recordings.
    pub(crate) fn recording_warnings(&self) -> Vec<(Code, String)> {
        self.scene().supports.recording_warnings()
    }
}
