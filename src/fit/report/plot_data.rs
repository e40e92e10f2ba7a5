//! Data of the plots of a fit, for the page of `rodfit fit --report` or for other programs: data types and their JSON.
//!
//! [`PlotData`] has per coordinate the observed and simulated values ([`Series`]), and shapes of the rod
//! ([`RodShape`]). Of the search it has the ranges, the convergence history, the scan and profile likelihoods. Data and
//! model in pictures ([`ImageOverlay`]), comparisons with recordings that drive the ends, and the settings of the
//! simulations complete it. [`Series::residuals`] are simulated less observed values in sigmas. All else is only stored
//! here: `report::replay`, `report::overlay_run` and `report::recorded_motion` fill it, if
//! [`Fit::keep_plot_data`](crate::Fit::keep_plot_data) requests it. It costs one more simulation of each experiment,
//! two further ones of those with pictures, and several free runs of recordings that drive the ends.
//!
//! `SimulationSettings` are those of an experiment, with the size of each measurement (`Measured`); `SearchRange` is
//! that of a parameter.

use crate::fit::measurement::dataset::Abscissa;
use crate::fit::report::image_overlay::ImageOverlay;
use crate::fit::report::recorded_motion::RecordingPlots;
use crate::fit::search::grid::Landscape;
use crate::fit::search::journal::Iterate;
use crate::fit::uncertainty::covariance::profile_likelihood::Profile;
use crate::scene::Parameter;
use marker_files::Recording;
use serde::{Deserialize, Serialize};

/// Data of the plots: observations, model, search and shapes of the rod.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct PlotData {
    /// Search range of each parameter, in the order of `parameters`.
    pub ranges: Vec<SearchRange>,
    /// Data and model of each coordinate of each observation.
    pub series: Vec<Series>,
    /// Shape of the rod at about a dozen times.
    pub shapes: Vec<RodShape>,
    /// Data and model in pictures of the recordings; empty without the key `image`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub overlays: Vec<ImageOverlay>,
    /// Comparison of simulations with recordings that drive the ends.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub recordings: Option<RecordingPlots>,
    /// Convergence history of the search.
    pub history: Vec<Iterate>,
    /// Misfit of the scan over each parameter, minimized over all others; empty without a scan.
    pub landscape: Vec<Landscape>,
    /// Profile likelihoods, if requested.
    pub profiles: Vec<Profile>,
    /// Settings of the simulation of each experiment.
    pub settings: Vec<SimulationSettings>,
    /// Version of rodfit.
    pub version: String,
}

/// Search range of a parameter.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct SearchRange {
    /// Name of the parameter.
    pub name: Parameter,
    /// Given start value, in the unit of the parameter; null if none.
    pub start: Option<f64>,
    /// Given bounds, in the unit of the parameter; null if none.
    pub bounds: Option<[f64; 2]>,
}

/// Data and model of one coordinate of one observation.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct Series {
    /// Name of the experiment; empty if there is only one.
    pub experiment: String,
    /// Name of the measurement.
    pub label: String,
    /// Coordinate: x, y or z; f for frequencies, g for user-defined measurements, ux to uz for load-deflection curves,
    /// P for critical loads, or the component of a sensor, such as fx.
    pub axis: String,
    /// Unit of `observed`, `simulated` and `sigma`.
    pub unit: String,
    /// Abscissa of the values.
    pub abscissa: Abscissa,
    /// Abscissa of each value, in the unit of `abscissa`.
    pub abscissa_values: Vec<f64>,
    /// Observed values, in `unit`.
    pub observed: Vec<f64>,
    /// Model values at the same abscissas, in `unit`.
    pub simulated: Vec<f64>,
    /// Standard deviation of the noise, given or estimated, in `unit`.
    pub sigma: f64,
    /// Model between the data: pairs of abscissa and value, in the units of `abscissa` and of the series; empty if not
    /// available.
    pub curve: Vec<[f64; 2]>,
}

impl Series {
    /// Simulated less observed values over the `sigma` of the series, in their order. Factors of single values on
    /// `sigma` have no effect.
    pub fn residuals(&self) -> Vec<f64> {
        let pairs = self.simulated.iter().zip(&self.observed);
        pairs.map(|(simulated, observed)| (simulated - observed) / self.sigma).collect()
    }
}

/// Shape of the rod at one time, in recorded coordinates.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct RodShape {
    /// Name of the experiment; empty if there is only one.
    pub experiment: String,
    /// Time of the motion, s; null at rest.
    pub time: Option<f64>,
    /// Positions of the nodes in world coordinates, m.
    pub nodes: Vec<[f64; 3]>,
}

/// Settings of the simulation of an experiment.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct SimulationSettings {
    /// Name of the experiment; empty if there is only one.
    pub experiment: String,
    /// Scene file; null if it was not read from a file.
    pub scene: Option<String>,
    /// `planar` or `spatial`, with the reason.
    pub model: String,
    /// Time integration scheme; null without a motion.
    pub scheme: Option<String>,
    /// Time step, s; null without a motion.
    pub step: Option<f64>,
    /// End of the motion, s; null without a motion.
    pub end: Option<f64>,
    /// Number of edges of the rod.
    pub segments: usize,
    /// Length of the rod, m.
    pub length: f64,
    /// Measurements of the experiment.
    pub observations: Vec<String>,
    /// Number of measured values, in the order of `observations`.
    #[serde(default)]
    pub measurements: Vec<Measured>,
}

/// Size of a measurement, and the interpretation of its file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct Measured {
    /// Name of the measurement.
    pub label: String,
    /// Number of times, points of the rod, frequencies or readings.
    pub points: usize,
    /// Number of values: observed coordinates, frequencies or readings.
    pub values: usize,
    /// Interpretation of the file; null without a file.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub recording: Option<Recording>,
}
