//! Rows of the observation operator: recorded coordinates of a point as linear functions of its position in the world.
//!
//! Input: the camera, the samples of a point and the inverse standard deviations, 1/m. Output: one [`ObservationRow`]
//! per observed coordinate, sample by sample and x, y, z in each. Its residual (simulated less observed, in units of
//! the standard deviation) is `axis . x(t) + offset`, with the position `x`, m, at the time `t`, s, of the motion (not
//! of the camera). `axis` (1/m) and `offset` follow from the camera at fixed parameters. The adjoint needs residuals in
//! this form. A row is made for each given weight: coordinates after the last one have none. Points that are not on the
//! rod and times after the end of the record are errors of the residual. [`affects_observation_operator`] returns
//! whether a parameter changes the recorded coordinates at a fixed motion.

use crate::dynamics::record::Record;
use crate::error::Error;
use crate::fit::measurement::motion::Sample;
use crate::fit::misfit::camera::View;
use crate::numerics::vector::sub;
use crate::problem::Problem;
use crate::scene::{Parameter, Point};

/// One observed coordinate of a sample, as a linear function of the position of the point.
pub(crate) struct ObservationRow {
    /// The observed point of the rod.
    pub point: Point,
    /// Time of the motion, s.
    pub time: f64,
    /// Derivative of the residual by the position of the point, 1/m.
    pub axis: [f64; 3],
    /// Residual of a point at the origin of the world.
    offset: f64,
}

impl ObservationRow {
    /// One row for every observed coordinate of the `samples` of a point, sample by sample and x, y, z in each, as the
    /// camera `view` records them. `weights` has the inverse of the standard deviation of each observed coordinate in
    /// this order, 1/m; coordinates after the last weight have no row. The time of a row is that of the motion by the
    /// camera's clock.
    pub fn from_samples(
        view: &View<f64>,
        point: Point,
        samples: &[Sample],
        weights: impl IntoIterator<Item = f64>,
    ) -> Vec<Self> {
        // The map to undistorted recorded positions is affine: the images of origin and unit vectors determine it.
        let origin = view.recorded([0.0; 3]);
        let columns =
            [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(|axis| view.recorded(axis));
        let mut weights = weights.into_iter();
        let mut rows = Vec::new();
        for sample in samples {
            // Differences of coordinates that were not observed do not count.
            let undistorted = view.undistorted(&sample.position);
            let seen = |x: [f64; 3]| [0, 1, 2].map(|c| undistorted[c].map_or(0.0, |_| x[c]));
            let in_picture = |x| view.distorted_difference(seen(x), &sample.position);
            let axes = columns.map(|column| in_picture(sub(column, origin)));
            let observed = undistorted.map(|x| x.unwrap_or(0.0));
            let offset = in_picture(sub(origin, observed));
            for c in (0..3).filter(|c| sample.position[*c].is_some()) {
                let Some(weight) = weights.next() else { return rows };
                rows.push(Self {
                    point: point.fixed(),
                    time: view.sample_time(sample.time, &sample.position),
                    axis: axes.map(|axis| axis[c] * weight),
                    offset: offset[c] * weight,
                });
            }
        }
        rows
    }

    /// Simulated less observed coordinate, in units of the standard deviation: `axis . x(t) + offset` with the position
    /// interpolated in the recorded motion `record` of the nodes. An error for a point that is not on the rod and times
    /// after the end of the record.
    pub fn residual(&self, problem: &Problem, record: &Record) -> Result<f64, Error> {
        let position = record.read().position(&problem.stencil(self.point)?, self.time)?;
        Ok(position.iter().zip(self.axis).map(|(x, a)| x * a).sum::<f64>() + self.offset)
    }
}

/// Whether a parameter changes the recorded coordinates at a fixed motion of the nodes: true for those of the camera,
/// of the supports, and of the shape of the rod, which changes the arc length of a point.
pub(crate) fn affects_observation_operator(parameter: Parameter) -> bool {
    ["rod.shape.", "supports.", "camera."].iter().any(|place| parameter.path().starts_with(place))
}
