//! What may be measured of a rod: its motion, its shape at rest, its frequencies.

pub(crate) mod constant_axes;
pub(crate) mod experiment;
pub(crate) mod frequencies;
pub(crate) mod gauge;
pub(crate) mod inspection;
mod inspection_summary;
pub(crate) mod loss;
pub(crate) mod motion;
pub(crate) mod repeated_frames;
pub(crate) mod shape;

use crate::fit::measurement::frequencies::Frequencies;
use crate::fit::measurement::gauge::Gauge;
use crate::fit::measurement::loss::Loss;
use crate::fit::measurement::motion::{Dropped, Observation};
use crate::fit::measurement::shape::RestShape;
use crate::input::track::recording::Recording;
use crate::problem::Problem;
use std::path::PathBuf;

/// A set of values with a common noise.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub enum Measurement {
    /// Where a point was at which times, m.
    Motion(Observation),
    /// Where points of the rod at rest were, m.
    RestShape(RestShape),
    /// Natural frequencies, rad/s.
    Frequencies(Frequencies),
    /// Whatever follows from where points are and how they move, in its own unit.
    Gauge(Gauge),
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

impl From<Gauge> for Measurement {
    fn from(gauge: Gauge) -> Self {
        Self::Gauge(gauge)
    }
}

/// A unit that data are given in, and reports display them in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct DataUnit<'a> {
    /// Its symbol.
    pub name: &'a str,
    /// Its size in the unit of the values.
    pub size: f64,
}

impl DataUnit<'_> {
    /// Of frequencies, whose values are in rad/s.
    pub const HERTZ: Self = Self { name: "Hz", size: std::f64::consts::TAU };
}

/// Values of one coordinate, in the order of the residuals, and what they are over: times, arc
/// lengths or modes.
pub(crate) struct Coordinate {
    /// x, y, z, f of frequencies, or g of gauges.
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
            Self::Gauge(g) => Some(g.sigma),
        }
    }

    /// The standard deviation of every value, in the order of the residuals, where `sigma` is typical of them.
    pub(crate) fn sigmas(&self, sigma: f64) -> Vec<f64> {
        let each = |factors: &[f64], seen: &mut dyn Iterator<Item = [Option<f64>; 3]>| {
            if factors.len() == self.values() {
                return factors.iter().map(|factor| sigma * factor).collect();
            }
            let factors = factors.iter().copied().chain(std::iter::repeat(1.0));
            let of = |(position, factor): ([Option<f64>; 3], f64)| {
                std::iter::repeat_n(sigma * factor, position.iter().flatten().count())
            };
            seen.zip(factors).flat_map(of).collect()
        };
        match self {
            Self::Motion(o) => each(&o.sigma_factors, &mut o.samples.iter().map(|s| s.position)),
            Self::RestShape(s) => {
                each(&s.sigma_factors, &mut s.sightings.iter().map(|s| s.position))
            }
            Self::Frequencies(_) | Self::Gauge(_) => vec![sigma; self.values()],
        }
    }

    /// Values that unknown arc lengths use up.
    pub(crate) fn fitted_arc_lengths(&self) -> usize {
        match self {
            Self::RestShape(shape) => shape.fitted_arc_lengths(),
            _ => 0,
        }
    }

    /// The part of the values that unknown arc lengths leave as degrees of freedom.
    pub(crate) fn free_share(&self) -> f64 {
        let values = self.values().max(1) as f64;
        (1.0 - self.fitted_arc_lengths() as f64 / values).max(1.0 / values)
    }

    /// How residuals count.
    pub fn loss(&self) -> Loss {
        match self {
            Self::Motion(o) => o.loss,
            Self::RestShape(s) => s.loss,
            Self::Frequencies(f) => f.loss,
            Self::Gauge(g) => g.loss,
        }
    }

    /// Whether it is only predicted.
    pub fn held_out(&self) -> bool {
        match self {
            Self::Motion(o) => o.held_out,
            Self::RestShape(s) => s.held_out,
            Self::Frequencies(f) => f.held_out,
            Self::Gauge(g) => g.held_out,
        }
    }

    /// Whether it is only planned.
    pub fn planned(&self) -> bool {
        match self {
            Self::Motion(o) => o.planned,
            Self::RestShape(s) => s.planned,
            Self::Frequencies(_) | Self::Gauge(_) => false,
        }
    }

    /// Counts residuals by their squares.
    pub(crate) fn by_squares(&mut self) {
        *match self {
            Self::Motion(o) => &mut o.loss,
            Self::RestShape(s) => &mut s.loss,
            Self::Frequencies(f) => &mut f.loss,
            Self::Gauge(g) => &mut g.loss,
        } = Loss::Squares;
    }

    /// Keeps it out of the fit.
    pub(crate) fn hold_out(&mut self) {
        match self {
            Self::Motion(o) => o.held_out = true,
            Self::RestShape(s) => s.held_out = true,
            Self::Frequencies(f) => f.held_out = true,
            Self::Gauge(g) => g.held_out = true,
        }
    }

    /// The file it was read from, if it was.
    pub fn source(&self) -> Option<&PathBuf> {
        match self {
            Self::Motion(o) => o.source.as_ref(),
            Self::RestShape(s) => s.source.as_ref(),
            Self::Frequencies(_) | Self::Gauge(_) => None,
        }
    }

    /// Rows of its file that were left out.
    pub fn dropped(&self) -> Dropped {
        match self {
            Self::Motion(o) => o.dropped,
            Self::RestShape(s) => s.dropped,
            Self::Frequencies(_) | Self::Gauge(_) => Dropped::default(),
        }
    }

    /// The marker on the rod that was followed, if it is one of a recording that leads the ends.
    pub(crate) fn marker(&self) -> Option<&str> {
        self.motion()?.marker.as_deref()
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
            Self::Gauge(g) => g.readings.len(),
        }
    }

    /// Points in time or along the rod, frequencies or readings.
    pub(crate) fn points(&self) -> usize {
        match self {
            Self::Motion(o) => o.samples.len(),
            Self::RestShape(s) => s.sightings.len(),
            Self::Frequencies(_) | Self::Gauge(_) => self.values(),
        }
    }

    /// How its file was read, if it was read from one.
    pub(crate) fn recording(&self) -> Option<Recording> {
        match self {
            Self::Motion(o) => o.recording.clone(),
            Self::RestShape(s) => s.recording.clone(),
            Self::Frequencies(_) | Self::Gauge(_) => None,
        }
    }

    /// Unit of the values.
    pub(crate) fn unit(&self) -> &str {
        match self {
            Self::Frequencies(_) => "rad/s",
            Self::Gauge(g) => &g.unit,
            _ => "m",
        }
    }

    /// The unit that the values were given in.
    pub(crate) fn data_unit(&self) -> DataUnit<'_> {
        match self {
            Self::Frequencies(frequencies) if frequencies.in_hz => DataUnit::HERTZ,
            _ => DataUnit { name: self.unit(), size: 1.0 },
        }
    }

    /// The values, in the order of the residuals.
    pub(crate) fn seen_mut(&mut self) -> Vec<&mut f64> {
        match self {
            Self::Motion(o) => {
                o.samples.iter_mut().flat_map(|s| s.position.iter_mut()).flatten().collect()
            }
            Self::RestShape(s) => {
                s.sightings.iter_mut().flat_map(|s| s.position.iter_mut()).flatten().collect()
            }
            Self::Frequencies(f) => f.values.iter_mut().map(|f| &mut f.rad_s).collect(),
            Self::Gauge(g) => g.readings.iter_mut().map(|r| &mut r.value).collect(),
        }
    }

    /// The observed positions, coordinate by coordinate, in the order of the residuals.
    pub(crate) fn values_in_order(&self) -> Vec<f64> {
        match self {
            Self::Motion(o) => o.samples.iter().flat_map(|s| s.position).flatten().collect(),
            Self::RestShape(s) => s.sightings.iter().flat_map(|s| s.position).flatten().collect(),
            Self::Frequencies(_) | Self::Gauge(_) => Vec::new(),
        }
    }

    /// Positions with what they are over.
    pub(crate) fn positions(&self, problem: &Problem) -> Vec<(f64, [Option<f64>; 3])> {
        match self {
            Self::Motion(o) => o.samples.iter().map(|s| (s.time, s.position)).collect(),
            Self::RestShape(shape) => {
                let place = |point| problem.arc_length(point).unwrap_or(0.0);
                shape.placed(problem).iter().map(|s| (place(s.point), s.position)).collect()
            }
            Self::Frequencies(_) | Self::Gauge(_) => Vec::new(),
        }
    }

    /// The values coordinate by coordinate; coordinates that were not seen are left out.
    pub(crate) fn coordinates(&self, problem: &Problem) -> Vec<Coordinate> {
        if let Self::Frequencies(f) = self {
            let places = f.values.iter().enumerate().map(|(k, f)| (k, f.mode as f64)).collect();
            return vec![Coordinate { axis: "f", places }];
        }
        if let Self::Gauge(g) = self {
            let place = |k: usize| g.readings[k].time.unwrap_or((k + 1) as f64);
            let places = (0..g.readings.len()).map(|k| (k, place(k))).collect();
            return vec![Coordinate { axis: "g", places }];
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
    pub(crate) fn size(&self, problem: &Problem) -> f64 {
        match self {
            Self::Motion(o) => o.spread(),
            Self::RestShape(shape) => {
                let (mut sum, mut count) = (0.0, 0.0_f64);
                for sighting in shape.placed(problem) {
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
            Self::Gauge(g) => g.size(),
        }
    }

    /// The scale that rounding errors and changes that matter are measured by: the rod's length or
    /// what is seen of it, or a typical frequency.
    pub(crate) fn scale(&self, problem: &Problem) -> f64 {
        match self {
            Self::Frequencies(_) | Self::Gauge(_) => self.size(problem),
            _ => problem.length().max(self.size(problem)),
        }
    }

    /// The file, or what it is, for messages.
    pub(crate) fn label(&self) -> String {
        match self {
            Self::Motion(o) => o.label(),
            Self::RestShape(shape) => match &shape.source {
                Some(path) => path.display().to_string(),
                None => "the shape at rest".into(),
            },
            Self::Frequencies(f) => format!("the frequencies{}", f.among.words()),
            Self::Gauge(g) => g.name.clone(),
        }
    }
}
