//! Rows of the observation operator: coordinates of recorded motion as linear functions of positions.

use crate::dynamics::record::Record;
use crate::error::Error;
use crate::fit::measurement::motion::Sample;
use crate::fit::misfit::camera::View;
use crate::problem::Problem;
use crate::scene::{Parameter, Point};

/// One coordinate of a sample.
pub(crate) struct ObservationRow {
    pub point: Point,
    /// On the motion's clock, s.
    pub time: f64,
    /// What it takes of a place in the world, over sigma.
    pub axis: [f64; 3],
    /// What is left at the origin, over sigma.
    offset: f64,
}

impl ObservationRow {
    /// All coordinates of some samples of a point that were seen, with one over sigma of each.
    pub fn of(
        view: &View<f64>,
        (point, samples): (Point, &[Sample]),
        weights: impl IntoIterator<Item = f64>,
    ) -> Vec<Self> {
        let origin = view.recorded([0.0; 3]);
        let columns =
            [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(|axis| view.recorded(axis));
        let seen = samples.iter().flat_map(|sample| (0..3).map(move |c| (sample, c)));
        let seen = seen.filter_map(|(sample, c)| Some((sample.time, c, sample.position[c]?)));
        let of = |((time, c, place), weight): ((f64, usize, f64), f64)| Self {
            point: point.fixed(),
            time: view.time(time),
            axis: columns.map(|column| (column[c] - origin[c]) * weight),
            offset: (origin[c] - place) * weight,
        };
        seen.zip(weights).map(of).collect()
    }

    /// How far it is from where it was seen, over sigma.
    pub fn residual(&self, problem: &Problem, record: &Record) -> Result<f64, Error> {
        let place = record.read().position(&problem.stencil(self.point)?, self.time)?;
        Ok(place.iter().zip(self.axis).map(|(x, a)| x * a).sum::<f64>() + self.offset)
    }
}

/// Whether a parameter changes what is seen of a rod that stays where it is: the camera, what it is fixed to, and
/// where on the rod a point is.
pub(crate) fn affects_observation_operator(parameter: Parameter) -> bool {
    ["rod.shape.", "supports.", "camera."].iter().any(|place| parameter.path().starts_with(place))
}
