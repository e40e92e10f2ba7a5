//! Which observed coordinates the models of lens distortion and of a rolling shutter need as input.
//!
//! The delay of a row of pixels depends on the coordinates along which `camera.row_delay` is not zero, the distortion
//! on all coordinates in the picture plane. [`camera_needs`] returns both for x, y and z of an experiment. Numbers of
//! its camera count that are not zero, or that a fit identifies or varies. Such coordinates must not be removed from
//! recordings. There are no errors.

use crate::fit::measurement::experiment::Experiment;
use crate::fit::misfit::camera::is_in_picture;
use crate::fit::unknown::Unknown;

/// Which effects of a camera depend on one observed coordinate.
#[derive(Clone, Copy)]
pub(crate) struct CameraNeeds {
    /// Whether the delay of the rows of pixels (rolling shutter) depends on it.
    pub row_delay: bool,
    /// Whether the lens distortion depends on it.
    pub distortion: bool,
}

impl CameraNeeds {
    /// Whether any effect depends on the coordinate.
    pub fn any(self) -> bool {
        self.row_delay || self.distortion
    }
}

/// The needs of the camera of an experiment for x, y and z, in this order. `unknowns` are the numbers that are
/// identified or varied; those of other experiments do not count.
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
