//! Warnings of a simulation of one rod: recordings, time steps, units, gravity, mesh, and the estimated error.
//!
//! [`Problem::warnings`] returns all of them in this order, as texts with finding, consequence and action, and with the
//! [`Code`] in brackets at the end of each text; `coded_warnings` has the codes apart. The list is empty for a scene
//! without findings. Recordings (`recording_warnings`): all defects, corrected or not, of those that move supports and
//! of the samples of signals that a load or an actuator has. Steps (`step_warnings`), with `[time]` only: a step that
//! resolves the motion of a support or such a signal poorly, or is longer than the simulation. Units, gravity and mesh:
//! see `plausibility`. The last one is an estimated discretization error above the requested one.

use crate::code::Code;
use crate::problem::Problem;
use crate::problem::plausibility::Purpose;
use crate::scene::Resolution;

impl Problem {
    /// Warnings of a simulation of the scene, each with its code in brackets at the end: first defects of recordings
    /// that move supports and of samples of signals. Steps follow that resolve a support's motion or a signal poorly,
    /// or exceed the duration. Then come implausible units, missing gravity, and a coarse mesh for natural curvature.
    /// The last one is an estimated error above the requested one.
    pub fn warnings(&self) -> Vec<String> {
        self.coded_warnings().into_iter().map(|(code, words)| code.behind(words)).collect()
    }

    /// The [`warnings`](Self::warnings) with their codes apart from the texts, in the same order.
    pub(crate) fn coded_warnings(&self) -> Vec<(Code, String)> {
        let mut warnings = self.recording_warnings();
        warnings.extend(self.step_warnings());
        warnings.extend(self.plausibility_notes(Purpose::Motion));
        warnings.extend(self.resolution().and_then(Resolution::warning));
        warnings
    }

    /// Warnings, with codes, of steps that do not resolve the motion of a support or a signal well, or of a step longer
    /// than the simulation. Empty without `[time]`.
    pub(crate) fn step_warnings(&self) -> Vec<(Code, String)> {
        let Some(time) = &self.scene().time else { return Vec::new() };
        let mut warnings = self.scene().motion_step_warnings(time.step_size());
        // Ends of a structure follow its own recording, which the rod that represents it does not have.
        if let Some(structure) = &self.scene().structure
            && let Some(recording) = &structure.recording
        {
            warnings.extend(recording.step_warning(&structure.supports, time.step_size()));
        }
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

    /// Warnings, with codes, of all defects, corrected or not, of the recordings that move supports and of the samples
    /// of signals that a load or an actuator has. Those of a structure are of the recording that its ends follow. Empty
    /// without any.
    pub(crate) fn recording_warnings(&self) -> Vec<(Code, String)> {
        let mut warnings = self.scene().recording_warnings();
        if let Some(structure) = &self.scene().structure
            && let Some(recording) = &structure.recording
        {
            warnings.extend(recording.recording_warnings(&structure.supports));
        }
        warnings
    }
}
