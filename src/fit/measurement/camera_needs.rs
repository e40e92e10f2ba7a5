//! Observed coordinates that lens distortion and a rolling shutter need.
//!
//! The delay of rows depends on the coordinates along which it is not zero, the distortion on all coordinates of the
//! picture. [`camera_needs`] returns both for an experiment, for numbers of its camera that are not zero and for those
//! that a fit identifies or varies. Without errors.

use crate::fit::measurement::experiment::Experiment;
use crate::fit::misfit::camera::is_in_picture;
use crate::fit::unknown::Unknown;

/// Whether the effects of a camera depend on one observed coordinate.
#[derive(Clone, Copy)]
pub(crate) struct CameraNeeds {
    /// Whether the delay of rows does.
    pub row_delay: bool,
    /// Whether the lens distortion does.
    pub distortion: bool,
}

impl CameraNeeds {
    /// Whether any effect depends on the coordinate.
    pub fn any(self) -> bool {
        self.row_delay || self.distortion
    }
}

/// The needs of the camera of an experiment for x, y and z. `unknowns` are the numbers that are identified or varied; those of
/// other experiments do not count.
pub(crate) fn camera_needs(experiment: &Experiment, unknowns: &[Unknown]) -> [CameraNeeds; 3] {
    let (problem, camera) = (&experiment.problem, experiment.problem.scene().camera);
    let is_unknown =
        |path: &str| unknowns.iter().any(|u| u.parameter.path() == path && u.is_of(experiment));
    let is_distorted = camera.distortion != 0.0 || is_unknown("camera.distortion");
    std::array::from_fn(|c| {
        let path = format!("camera.row_delay.{}", ["x", "y", "z"][c]);
        CameraNeeds {
            row_delay: camera.row_delay[c] != 0.0 || is_unknown(&path),
            distortion: is_distorted && is_in_picture(problem, c),
        }
    })
}
