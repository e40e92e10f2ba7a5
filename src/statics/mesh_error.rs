//! Estimated error of an equilibrium by a mesh that the user gave. The module `accuracy` computes it.

use crate::summary::quantity::number;
use serde::{Deserialize, Serialize};

/// Estimated error of the displacements of an equilibrium by its mesh.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct MeshError {
    /// Number of edges of the mesh, of all rods together.
    pub segments: usize,
    /// Largest error of the displacement of a point by the loads, m.
    pub displacement: f64,
    /// This error over the largest displacement; absent if that is a rounding error.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub relative: Option<f64>,
}

impl MeshError {
    /// The error `displacement`, m, of a mesh of so many `segments`, and over the largest displacement.
    pub(crate) fn new(segments: usize, displacement: f64, relative: Option<f64>) -> Self {
        Self { segments, displacement, relative }
    }

    /// The error as text, in m and in per cent of the largest displacement.
    pub fn words(&self) -> String {
        let relative = self.relative.map_or_else(String::new, |part| {
            format!(", {} % of the largest displacement", number(100.0 * part, 2))
        });
        format!("{:.1e} m{relative}", self.displacement)
    }

    /// Text of a report: number of edges and error.
    pub(crate) fn fact(&self) -> String {
        format!("{} segments as given; estimated error {}", self.segments, self.words())
    }
}
