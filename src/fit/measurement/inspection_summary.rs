//! The inspection of a marker file as text for a terminal.
//!
//! Input: an [`Inspection`]. Output: a [`Summary`] with the format, the frames and their rate, and a table of the
//! markers (frames, range per axis, noise, gaps). Likely problems follow as warnings: positions in m beyond [`FAR`],
//! gaps of the clock (at most [`NAMED_GAPS`] one by one), converted video, jumps, faults. The proposed
//! `[[observation]]` table is last.

use crate::fit::measurement::inspection::{FAR, InspectedMarker, Inspection};
use crate::fit::measurement::repeated_frames::is_converted_video;
use crate::summary::quantity::number;
use crate::summary::{ItemTable, Summary, SummaryTable, Tone};
use marker_files::Format;
use marker_files::printable::printable_path;
use std::fmt;

/// Largest number of listed gaps of the clock; further ones are only counted.
const NAMED_GAPS: usize = 5;
/// Significant digits of the displayed noise.
const DIGITS: usize = 3;

impl fmt::Display for Inspection {
    /// Writes the [summary](Inspection::summary) of the inspection as text.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.summary().fmt(f)
    }
}

impl Inspection {
    /// The result of the inspection for a terminal: format, frames, rate and unit as facts, the table of the markers,
    /// likely problems as warnings, and the `[[observation]]` table as verbatim text.
    pub fn summary(&self) -> Summary {
        let format = match self.format {
            Format::Csv => "a table".to_string(),
            format => format!("a file of {}", format.program()),
        };
        let [first, last] = self.clock;
        let unit = self.clock_suffix();
        let range = if unit.is_empty() { "numbered" } else { "from" };
        // Missing rates and scales are shown with the key by which the user states them.
        let rate = match self.rate {
            Some(rate) => format!("{} frames/s", (rate * 1e4).round() / 1e4),
            None => "no frame rate in the file (set fps)".into(),
        };
        let plural = if self.markers.len() == 1 { "" } else { "s" };
        let lengths = match &self.unit[..] {
            "unnamed" => "in a unit that the file does not state (set scale)".into(),
            unit => format!("in {unit}"),
        };
        // Facts first, then the table, the problems, and the text to copy.
        Summary::new(format!("{format}, format = \"{}\"", self.format.key()), Tone::Neutral)
            .with_subject(printable_path(&self.file))
            .fact(
                "Frames",
                format!("{}, {range} {first}{unit} to {last}{unit}, {rate}", self.frames),
            )
            .fact("Markers", format!("{} marker{plural}, positions {lengths}", self.markers.len()))
            .table("", self.marker_table())
            .warnings(self.likely_problems())
            .verbatim("Observation for a fit file:", self.observation.trim_end())
    }

    /// A space and the unit of the clock, to stand after its readings; empty for frame numbers.
    fn clock_suffix(&self) -> String {
        match &self.clock_unit[..] {
            "frames" => String::new(),
            unit => format!(" {unit}"),
        }
    }

    /// The table of the markers: one row each with name, detected frames, range per axis, noise and gaps. Columns for
    /// x, y and z are always there. Cells are empty for axes or noise that the marker does not have, and for a marker
    /// without gaps and uncertain frames.
    fn marker_table(&self) -> SummaryTable {
        // One column per axis, also for markers without it, keeps the table aligned.
        let range = |marker: &InspectedMarker, axis: char| -> Option<String> {
            let [low, high] = (*marker.range.get(marker.axes.find(axis)?)?)?;
            Some(format!("{low:.4} .. {high:.4}"))
        };
        ItemTable::new(&self.markers)
            .wrapped("marker", |marker| shown_name(marker))
            .right("frames", |marker| marker.detected.to_string())
            .left("x", |marker| range(marker, 'x'))
            .left("y", |marker| range(marker, 'y'))
            .left("z", |marker| range(marker, 'z'))
            .right("noise at most", |marker| marker.noise.map(|noise| number(noise, DIGITS)))
            .wrapped("gaps", |marker| gaps(marker))
            .into()
    }

    /// Likely problems of the file, as warning texts without codes. First a unit of m with a coordinate beyond [`FAR`],
    /// then at most [`NAMED_GAPS`] gaps of the clock (further ones as a count). Converted video and jumps of each
    /// marker and faults of markers along a rod follow.
    fn likely_problems(&self) -> Vec<String> {
        let unit = self.clock_suffix();
        let mut all = Vec::new();
        // Files without a unit in the header are read as meters: a likely mistake.
        if self.unit == "m" && self.largest_coordinate() > FAR {
            all.push(
                "the positions are far from the origin for a rod in m. They may be in another unit. State it in \
                 the header, as x[px] or x[mm]."
                    .to_string(),
            );
        }
        // A frame rate from the usual step is wrong beyond a gap of the clock.
        for (before, missing) in self.clock_gaps.iter().take(NAMED_GAPS) {
            all.push(format!("the time jumps after {before}{unit}: frames missing: {missing}"));
        }
        if self.clock_gaps.len() > NAMED_GAPS {
            let more = times(self.clock_gaps.len() - NAMED_GAPS);
            all.push(format!("the time jumps {more} more"));
        }
        for marker in &self.markers {
            let name = shown_name(marker);
            if is_converted_video(marker.repeated, marker.detected) {
                all.push(format!(
                    "{name}: {} frames repeat the one before. The video was converted to a higher rate. Keep one \
                     frame of each.",
                    marker.repeated
                ));
            }
            if let Some(first) = marker.jumps.first() {
                let count = times(marker.jumps.len());
                all.push(format!(
                    "{name}: jumps {count} for one frame, first at {first}{unit}. Remove these frames, or use a \
                     robust loss."
                ));
            }
        }
        let along = "if the markers are along a rod in this order";
        all.extend(self.faults.iter().map(|fault| format!("{along}: {fault}")));
        all
    }
}

/// The name of a marker for the table, or `(no name)`.
fn shown_name(marker: &InspectedMarker) -> String {
    if marker.name.is_empty() { "(no name)".into() } else { marker.name.clone() }
}

/// Text with the number of gaps of a marker, the frames of the longest one, and the number of frames with an
/// insufficient confidence; empty without any.
fn gaps(marker: &InspectedMarker) -> String {
    let [count, longest] = marker.gaps;
    let lost = (count > 0).then(|| format!("lost {} for up to {longest} frames", times(count)));
    let uncertain = marker.low_confidence.filter(|n| *n > 0).map(|n| format!("uncertain in {n}"));
    lost.into_iter().chain(uncertain).collect::<Vec<_>>().join(", ")
}

/// A number of occurrences as text: once, twice, `n` times.
fn times(n: usize) -> String {
    match n {
        1 => "once".into(),
        2 => "twice".into(),
        n => format!("{n} times"),
    }
}
