//! Conversion of detections to a table: files with one line for every detection of a marker, in any order, become one
//! row for every frame with the positions of all markers.
//!
//! Input per detection: line and clock reading of its frame, name of the marker, position in the unit of the file, and
//! likelihood if known. Output: a [`FrameTable`] with the clock readings that have a detection, sorted, as frames, and
//! markers in the order of their first detection. A marker that is not detected in a frame is `None` there. No
//! detection, two detections of a marker in one frame, and more than [`MAX_POSITIONS`] frames times markers are errors.

use crate::error::Error;
use crate::marker_file::{FieldLines, FrameReading, FrameTable, MarkerData};
use std::collections::HashMap;

/// Most positions, frames times markers. A file of a million lines with a marker each would need 1e12 of them.
const MAX_POSITIONS: usize = 10_000_000;

/// The detections of a file, with the names of the markers in the order of their first appearance.
#[derive(Default)]
pub(crate) struct Detections {
    markers: HashMap<String, usize>,
    names: Vec<String>,
    all: Vec<Detection>,
}

/// Position of a marker in a frame, in the unit of the file, with its likelihood from 0 to 1, if the file has it.
struct Detection {
    row: FrameReading,
    marker: usize,
    position: [Option<f64>; 3],
    likelihood: Option<f64>,
}

impl Detections {
    /// Adds the position of the marker `name`, in the unit of the file, in the frame of `row`; `likelihood` is from 0
    /// to 1, if known. A new name is a new marker.
    pub fn add(
        &mut self,
        row: FrameReading,
        name: &str,
        position: [Option<f64>; 3],
        likelihood: Option<f64>,
    ) {
        let marker = self.markers.get(name).copied().unwrap_or_else(|| {
            self.markers.insert(name.into(), self.names.len());
            self.names.push(name.into());
            self.names.len() - 1
        });
        self.all.push(Detection { row, marker, position, likelihood });
    }

    /// The frames by increasing time with all markers, in the order of their first detection; a marker without a
    /// detection is `None` there. `axes` is whether the file has x, y and z, `has_confidence` whether it has
    /// likelihoods; otherwise they are dropped. Errors: no detection, more than [`MAX_POSITIONS`] frames times markers,
    /// two detections of a marker at one time.
    pub fn table(
        mut self,
        lines: &FieldLines,
        axes: [bool; 3],
        has_confidence: bool,
    ) -> Result<FrameTable, Error> {
        self.all.sort_by(|a, b| a.row.clock.total_cmp(&b.row.clock));
        let mut rows: Vec<FrameReading> = Vec::new();
        for detection in &self.all {
            // Zero and minus zero are equal times.
            if rows.last().is_none_or(|row| row.clock < detection.row.clock) {
                rows.push(detection.row);
            }
        }
        if rows.is_empty() {
            return Err(lines
                .error(1, "found no line with the position of a marker, allowed: at least one"));
        }
        if self.names.len().saturating_mul(rows.len()) > MAX_POSITIONS {
            let message = format!(
                "found {} markers in {} frames, allowed: up to {MAX_POSITIONS} positions; remove \
                 the markers that are not \
                 needed",
                self.names.len(),
                rows.len()
            );
            return Err(lines.error(1, message));
        }
        // Markers begin without any position; each detection fills one entry.
        let new = |name: String| MarkerData {
            name,
            axes,
            positions: vec![[None; 3]; rows.len()],
            likelihood: has_confidence.then(|| vec![None; rows.len()]),
        };
        let mut markers: Vec<MarkerData> = self.names.into_iter().map(new).collect();
        // The last frame of each marker shows a second detection in the same frame, as detections are sorted by time.
        let mut last_frames = vec![usize::MAX; markers.len()];
        let mut k = 0;
        for Detection { row, marker, position, likelihood } in self.all {
            while rows[k].clock < row.clock {
                k += 1;
            }
            let own = &mut markers[marker];
            if std::mem::replace(&mut last_frames[marker], k) == k {
                let message = format!(
                    "found a second position of the marker `{}` at {}, allowed: one position at \
                     each time",
                    own.name, row.clock
                );
                return Err(lines.error(row.line, message));
            }
            own.positions[k] = position;
            if let Some(all) = &mut own.likelihood {
                all[k] = likelihood;
            }
        }
        Ok(FrameTable { frames: rows, markers })
    }
}
