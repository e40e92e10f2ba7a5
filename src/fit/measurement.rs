//! What may be measured of a rod: its motion, its shape at rest, its frequencies.

use super::{Frequencies, Loss, Observation, RestShape};
use crate::error::Error;
use crate::point::Point;
use crate::problem::Problem;
use crate::scene::Support;

/// Points this many lengths from the wall of a held rod are not points of it.
const FARTHEST: f64 = 2.5;

/// A set of values with a common noise.
#[derive(Clone, Debug)]
pub enum Measurement {
    /// Where a point was at which times, m.
    Motion(Observation),
    /// Where points of the rod at rest were, m.
    RestShape(RestShape),
    /// Natural frequencies, rad/s.
    Frequencies(Frequencies),
}

impl From<Observation> for Measurement {
    fn from(observation: Observation) -> Self {
        Self::Motion(observation)
    }
}

impl From<RestShape> for Measurement {
    fn from(shape: RestShape) -> Self {
        Self::RestShape(shape)
    }
}

impl From<Frequencies> for Measurement {
    fn from(frequencies: Frequencies) -> Self {
        Self::Frequencies(frequencies)
    }
}

/// Values of one coordinate, in the order of the residuals, and what they are over: times, arc
/// lengths or modes.
pub(super) struct Coordinate {
    /// x, y, z, or f.
    pub axis: &'static str,
    /// Index among the measurement's values, and where.
    pub places: Vec<(usize, f64)>,
}

impl Measurement {
    /// Standard deviation of the values, m or rad/s, where it is known.
    pub fn sigma(&self) -> Option<f64> {
        match self {
            Self::Motion(o) => o.sigma,
            Self::RestShape(s) => s.sigma,
            Self::Frequencies(f) => Some(f.sigma),
        }
    }

    /// How residuals count.
    pub fn loss(&self) -> Loss {
        match self {
            Self::Motion(o) => o.loss,
            Self::RestShape(s) => s.loss,
            Self::Frequencies(f) => f.loss,
        }
    }

    /// Whether it is only predicted.
    pub fn held_out(&self) -> bool {
        match self {
            Self::Motion(o) => o.held_out,
            Self::RestShape(s) => s.held_out,
            Self::Frequencies(f) => f.held_out,
        }
    }

    /// The recorded motion, if it is one.
    pub fn motion(&self) -> Option<&Observation> {
        match self {
            Self::Motion(observation) => Some(observation),
            _ => None,
        }
    }

    /// Number of values.
    pub fn values(&self) -> usize {
        match self {
            Self::Motion(o) => o.values(),
            Self::RestShape(s) => s.values(),
            Self::Frequencies(f) => f.values.len(),
        }
    }

    /// Unit of the values.
    pub(super) fn unit(&self) -> &'static str {
        match self {
            Self::Frequencies(_) => "rad/s",
            _ => "m",
        }
    }

    /// The values, in the order of the residuals.
    pub(super) fn seen_mut(&mut self) -> Vec<&mut f64> {
        match self {
            Self::Motion(o) => {
                o.samples.iter_mut().flat_map(|s| s.position.iter_mut()).flatten().collect()
            }
            Self::RestShape(s) => {
                s.sightings.iter_mut().flat_map(|s| s.position.iter_mut()).flatten().collect()
            }
            Self::Frequencies(f) => f.values.iter_mut().map(|f| &mut f.rad_s).collect(),
        }
    }

    /// Positions with what they are over.
    fn positions(&self, problem: &Problem) -> Vec<(f64, [Option<f64>; 3])> {
        match self {
            Self::Motion(o) => o.samples.iter().map(|s| (s.time, s.position)).collect(),
            Self::RestShape(shape) => {
                let place = |point| problem.arc_length(point).unwrap_or(0.0);
                shape.sightings.iter().map(|s| (place(s.point), s.position)).collect()
            }
            Self::Frequencies(_) => Vec::new(),
        }
    }

    /// The values coordinate by coordinate; coordinates that were not seen are left out.
    pub(super) fn coordinates(&self, problem: &Problem) -> Vec<Coordinate> {
        if let Self::Frequencies(f) = self {
            let places = f.values.iter().enumerate().map(|(k, f)| (k, f.mode as f64)).collect();
            return vec![Coordinate { axis: "f", places }];
        }
        let mut axes = ["x", "y", "z"].map(|axis| Coordinate { axis, places: Vec::new() });
        let mut index = 0;
        for (at, position) in self.positions(problem) {
            for (axis, seen) in axes.iter_mut().zip(position) {
                if seen.is_some() {
                    axis.places.push((index, at));
                    index += 1;
                }
            }
        }
        axes.into_iter().filter(|axis| !axis.places.is_empty()).collect()
    }

    /// How large what is measured is, so that a misfit can be small against it: the spread of a
    /// motion, the way from the rest shape to a droop, a typical frequency.
    pub(super) fn size(&self, problem: &Problem) -> f64 {
        match self {
            Self::Motion(o) => o.spread(),
            Self::RestShape(shape) => {
                let (mut sum, mut count) = (0.0, 0.0_f64);
                for sighting in &shape.sightings {
                    let Ok(stencil) = problem.stencil(sighting.point) else { continue };
                    let rest = problem.rest_position(&stencil);
                    for (seen, rest) in sighting.position.iter().zip(rest) {
                        if let Some(seen) = seen {
                            sum += (seen - rest).powi(2);
                            count += 1.0;
                        }
                    }
                }
                (sum / count.max(1.0)).sqrt()
            }
            Self::Frequencies(f) => {
                let sum: f64 = f.values.iter().map(|f| f.rad_s).sum();
                sum / f.values.len().max(1) as f64
            }
        }
    }

    /// The scale that rounding errors and changes that matter are measured by: the rod's length or
    /// what is seen of it, or a typical frequency.
    pub(super) fn scale(&self, problem: &Problem) -> f64 {
        match self {
            Self::Frequencies(_) => self.size(problem),
            _ => problem.length().max(self.size(problem)),
        }
    }

    /// The same points of the rod on another mesh.
    pub(super) fn on_another_mesh(&self, problem: &Problem) -> Result<Self, Error> {
        let moved = |point: Point| match point {
            Point::Node(i) if i + 1 == problem.nodes() => Ok(Point::Tip),
            Point::Node(_) => {
                let s = problem.arc_length(point)?;
                Ok::<_, Error>(Point::ArcLength(s.clamp(0.0, problem.length())))
            }
            point => Ok(point),
        };
        let mut measurement = self.clone();
        match &mut measurement {
            Self::Motion(o) => o.point = moved(o.point)?,
            Self::RestShape(shape) => {
                for sighting in &mut shape.sightings {
                    sighting.point = moved(sighting.point)?;
                }
            }
            Self::Frequencies(_) => {}
        }
        Ok(measurement)
    }

    /// The file, or what it is, for messages.
    pub(super) fn label(&self) -> String {
        match self {
            Self::Motion(o) => o.label(),
            Self::RestShape(shape) => match &shape.source {
                Some(path) => path.display().to_string(),
                None => "the shape at rest".into(),
            },
            Self::Frequencies(_) => "the frequencies".into(),
        }
    }

    /// Refuses positions that no point of a held rod can have: most likely in other units.
    pub(super) fn check_units(&self, problem: &Problem) -> Result<(), Error> {
        let supports = &problem.scene().supports;
        if (supports.start, supports.end) == (Support::Free, Support::Free) {
            return Ok(());
        }
        let wall = problem.wall();
        let distance = |(_, position): &(f64, [Option<f64>; 3])| {
            let parts = (0..3).filter_map(|c| Some((position[c]? - wall[c]).abs()));
            parts.fold(0.0, f64::max)
        };
        let mut distances: Vec<f64> = self.positions(problem).iter().map(distance).collect();
        distances.sort_by(f64::total_cmp);
        // Single outliers are another matter.
        let Some(typical) = distances.get(distances.len() / 2) else { return Ok(()) };
        if *typical <= FARTHEST * problem.length() {
            return Ok(());
        }
        let found = format!("points typically {typical:.4} m from the wall of the rod");
        let allowed = format!(
            "points of a rod of {} m; a unit in the header, as in x[mm], an origin, or another scale \
             may be missing",
            problem.length()
        );
        Err(Error::invalid(self.label(), found, allowed))
    }

    /// Refuses what cannot be compared with the problem; `key` names the measurement.
    pub(super) fn check(
        &self,
        problem: &Problem,
        (key, other_clock): (&str, bool),
    ) -> Result<(), Error> {
        if let Some(sigma) = self.sigma() {
            crate::scene::positive(&format!("{key}.sigma"), sigma)?;
        }
        let finite = |position: &[Option<f64>; 3]| position.iter().flatten().all(|x| x.is_finite());
        let on_rod = |point: Point| match problem.stencil(point) {
            Ok(_) => Ok(()),
            Err(error) => Err(Error::invalid(format!("{key}.point"), error, "a point of the rod")),
        };
        let other = |what: &str, allowed: &str| Err(Error::invalid(self.label(), what, allowed));
        match self {
            Self::Motion(o) => {
                on_rod(o.point)?;
                let end = problem.time()?.end;
                let late = o.samples.iter().find(|s| s.time > end * (1.0 + 1e-9));
                if let Some(late) = late.filter(|_| !other_clock) {
                    let found = format!("t = {} s", late.time);
                    let allowed = format!("up to the scene's time.end = {end} s");
                    return Err(Error::invalid(self.label(), found, allowed));
                }
                let sane =
                    |s: &super::Sample| s.time.is_finite() && s.time >= 0.0 && finite(&s.position);
                let ascending = o.samples.windows(2).all(|w| w[0].time < w[1].time);
                if !(o.samples.iter().all(sane) && ascending) {
                    let allowed = "finite positions at increasing times from 0 on";
                    return other("other samples", allowed);
                }
            }
            Self::RestShape(shape) => {
                shape.sightings.iter().try_for_each(|s| on_rod(s.point))?;
                if !shape.sightings.iter().all(|s| finite(&s.position)) {
                    return other("other positions", "finite positions");
                }
            }
            Self::Frequencies(f) => {
                for (k, value) in f.values.iter().enumerate() {
                    if !(value.rad_s.is_finite() && value.rad_s > 0.0) {
                        let key = format!("{key}.rad_s[{k}]");
                        return Err(Error::invalid(key, value.rad_s, "above 0"));
                    }
                    let twice = f.values[..k].iter().any(|before| before.mode == value.mode);
                    if !(1..=200).contains(&value.mode) || twice {
                        let key = format!("{key}.modes[{k}]");
                        return Err(Error::invalid(key, value.mode, "1 .. 200, each once"));
                    }
                }
            }
        }
        Ok(())
    }
}
