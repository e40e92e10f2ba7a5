//! Data and model in the pictures of a recording: data types and their JSON, for [plots](super::PlotData).
//!
//! [`ImageOverlay`] has the places of the rod and of the markers in one picture, px, with its file. All places count
//! from the upper left corner of the picture to the right and down. `report::overlay_run` makes them. The file itself
//! is kept for the page, and is not in the JSON.

use crate::fit::image::ImageFile;
use serde::{Deserialize, Serialize};

/// Recorded and simulated positions in one picture of a recording.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct ImageOverlay {
    /// Name of the experiment; empty if there is only one.
    pub experiment: String,
    /// Name or pattern of the pictures of the recording.
    pub pattern: String,
    /// File of the picture.
    pub file: String,
    /// Time on the clock of the recording, s; null at rest.
    pub time: Option<f64>,
    /// Width and height of the picture, px.
    pub size: [u32; 2],
    /// Size of a pixel, m.
    pub pixel: f64,
    /// Simulated centerline of each rod, node by node, px from the upper left corner to the right and down, as the
    /// camera records it.
    pub rods: Vec<Vec<[f64; 2]>>,
    /// Markers in the picture.
    pub markers: Vec<OverlayMarker>,
    /// Root mean square distance between recorded and simulated markers, px; null without simulated ones.
    pub rms: Option<f64>,
    /// Whether this picture has the largest distance of all pictures of the recording.
    pub is_worst: bool,
    /// Whether the recording is validation data.
    pub held_out: bool,
    /// The file as it was read; none in a report from JSON.
    #[serde(skip)]
    pub(crate) image: Option<ImageFile>,
}

/// Recorded and simulated place of a marker in a picture.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct OverlayMarker {
    /// Recorded place, px from the upper left corner to the right and down.
    pub recorded: [f64; 2],
    /// Simulated place, px, as the camera records it; null for points of a center line without arc lengths.
    pub simulated: Option<[f64; 2]>,
}

impl ImageOverlay {
    /// Root mean square distance, px, between recorded and simulated places of these markers; none without simulated
    /// ones.
    pub(crate) fn rms_distance(markers: &[OverlayMarker]) -> Option<f64> {
        let squares = markers.iter().filter_map(|marker| {
            let simulated = marker.simulated?;
            Some((0..2).map(|c| (simulated[c] - marker.recorded[c]).powi(2)).sum::<f64>())
        });
        let squares: Vec<f64> = squares.collect();
        let mean = squares.iter().sum::<f64>() / squares.len() as f64;
        (!squares.is_empty()).then(|| mean.sqrt())
    }
}
