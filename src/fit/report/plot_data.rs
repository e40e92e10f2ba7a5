//! What the numbers of a fit rest on, for a page or for plots of one's own.
//!
//! [`Fit::keep_plot_data`](super::Fit::keep_plot_data) asks for it; it costs one simulation and is
//! what `rodfit fit --report` draws.

use crate::fit::report::recorded::RecordingPlots;
use crate::fit::search::grid::Landscape;
use crate::fit::search::journal::Iterate;
use crate::fit::uncertainty::profile::Profile;
use crate::input::track::recording::Recording;
use crate::scene::Parameter;
use serde::{Deserialize, Serialize};

/// Data against model, how the optimum was found, and what the rod does there.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct PlotData {
    /// Where each parameter was looked for, in the order of the report's parameters.
    #[serde(alias = "asked")]
    pub ranges: Vec<SearchRange>,
    /// Data and model, one per observation and coordinate.
    pub series: Vec<Series>,
    /// The rod at about a dozen moments.
    pub shapes: Vec<RodShape>,
    /// Rods against the recordings that lead their ends, those held out too.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub recordings: Option<RecordingPlots>,
    /// The way to the optimum.
    pub history: Vec<Iterate>,
    /// The misfit in the scan over each unknown, all others at their best; none without a scan.
    pub landscape: Vec<Landscape>,
    /// Profiles of the likelihood, where they were asked for.
    pub profiles: Vec<Profile>,
    /// What was simulated, one per experiment.
    #[serde(alias = "setups")]
    pub settings: Vec<SimulationSettings>,
    /// Version of this crate.
    pub version: String,
}

/// Where a parameter was looked for.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct SearchRange {
    /// The parameter.
    pub name: Parameter,
    /// The start, if one was given.
    pub start: Option<f64>,
    /// The bounds, if any were given.
    pub bounds: Option<[f64; 2]>,
}

/// What an observation is given over.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum Abscissa {
    /// Time, s.
    Time,
    /// Arc length from the wall, m.
    ArcLength,
    /// The number of a mode, from 1 on.
    Mode,
    /// The number of a reading, from 1 on.
    Reading,
}

/// One coordinate of one observation, and what the model makes of it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct Series {
    /// The experiment; empty where there is only one.
    pub experiment: String,
    /// The measurement: its file, or what it is.
    pub label: String,
    /// Coordinate: x, y or z; f of frequencies, g of gauges.
    pub axis: String,
    /// Unit of `observed`, `simulated` and `sigma`.
    pub unit: String,
    /// What `at` counts.
    pub over: Abscissa,
    /// Where or when each value was seen.
    pub at: Vec<f64>,
    /// What was observed at each place.
    pub observed: Vec<f64>,
    /// What the model does at the same places.
    pub simulated: Vec<f64>,
    /// Standard deviation of the noise, given or estimated.
    pub sigma: f64,
    /// The model between the data: (place, value); empty where it has nothing there.
    pub curve: Vec<[f64; 2]>,
}

impl Series {
    /// Simulated less observed, in units of sigma.
    pub fn residuals(&self) -> Vec<f64> {
        let pairs = self.simulated.iter().zip(&self.observed);
        pairs.map(|(simulated, seen)| (simulated - seen) / self.sigma).collect()
    }
}

/// The rod at a moment, as it would have been recorded.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct RodShape {
    /// The experiment; empty where there is only one.
    pub experiment: String,
    /// Time of the motion, s; none at rest.
    pub time: Option<f64>,
    /// Positions of the nodes in world coordinates, m.
    pub nodes: Vec<[f64; 3]>,
}

/// What an experiment was simulated with.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct SimulationSettings {
    /// The experiment; empty where there is only one.
    pub experiment: String,
    /// The scene's file, if it was read from one.
    pub scene: Option<String>,
    /// `planar` or `spatial`, and why.
    pub model: String,
    /// The time integrator; none where nothing moves.
    pub scheme: Option<String>,
    /// Time step, s.
    pub step: Option<f64>,
    /// End of the motion, s.
    pub end: Option<f64>,
    /// Number of edges of the rod.
    pub segments: usize,
    /// Length of the rod, m.
    pub length: f64,
    /// What was observed, one per measurement.
    pub observations: Vec<String>,
    /// How much was measured, in the same order.
    #[serde(default)]
    pub measured: Vec<Measured>,
}

/// How much was measured, and how its file was read.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct Measured {
    /// The measurement, as warnings name it.
    pub label: String,
    /// Points in time or along the rod, frequencies or readings.
    pub points: usize,
    /// Values: coordinates seen, frequencies or readings.
    pub values: usize,
    /// How the file was read, if it was read from one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub recording: Option<Recording>,
}
