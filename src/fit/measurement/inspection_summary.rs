//! The summary of the inspection of a marker file as text.

use crate::fit::measurement::inspection::{FAR, InspectedMarker, Inspection};
use crate::fit::measurement::repeated_frames::is_converted_video;
use crate::summary::quantity::number;
use crate::summary::{Summary, SummaryTable, TextColumn, Tone};
use marker_files::Format;
use marker_files::printable::printable_path;
use std::fmt;

/// Largest number of listed gaps of the clock.
const NAMED_GAPS: usize = 5;
/// Significant digits of the noise.
const DIGITS: usize = 3;

impl fmt::Display for Inspection {
    /// Writes the inspection as text.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.summary().fmt(f)
    }
}

impl Inspection {
    /// The result as text for a terminal.
    pub fn summary(&self) -> Summary {
        let format = match self.format {
            Format::Csv => "a table".to_string(),
            format => format!("a file of {}", format.program()),
        };
        let [first, last] = self.clock;
        let unit = self.clock_suffix();
        let range = if unit.is_empty() { "numbered" } else { "from" };
        let rate = match self.rate {
            Some(rate) => format!("{} frames/s", (rate * 1e4).round() / 1e4),
            None => "no frame rate in the file (set fps)".into(),
        };
        let plural = if self.markers.len() == 1 { "" } else { "s" };
        let lengths = match &self.unit[..] {
            "unnamed" => "in a unit that the file does not state (set scale)".into(),
            unit => format!("in {unit}"),
        };
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

    /// The unit of the clock after a space; empty for numbers of frames.
    fn clock_suffix(&self) -> String {
        match &self.clock_unit[..] {
            "frames" => String::new(),
            unit => format!(" {unit}"),
        }
    }

    /// The table of the markers: frames, ranges, noise and gaps.
    fn marker_table(&self) -> SummaryTable {
        let axes = ["x", "y", "z"];
        // One column per axis, also for markers without it, keeps the table aligned.
        let mut columns = vec![TextColumn::wrapped("marker"), TextColumn::right("frames")];
        columns.extend(axes.map(TextColumn::left));
        columns.push(TextColumn::right("noise at most"));
        columns.push(TextColumn::wrapped("gaps"));
        let mut table = SummaryTable::new(columns);
        for marker in &self.markers {
            let mut row = vec![shown_name(marker), marker.detected.to_string()];
            for axis in axes {
                let place = marker.axes.find(axis);
                let range = place.and_then(|k| *marker.range.get(k)?);
                row.push(range.map_or("".into(), |[low, high]| format!("{low:.4} .. {high:.4}")));
            }
            row.push(marker.noise.map(|noise| number(noise, DIGITS)).unwrap_or_default());
            row.push(gaps(marker));
            table.row(row);
        }
        table
    }

    /// Likely problems of the file, as warnings without codes.
    fn likely_problems(&self) -> Vec<String> {
        let unit = self.clock_suffix();
        let mut all = Vec::new();
        if self.unit == "m" && self.largest_coordinate() > FAR {
            all.push(
                "the positions are far from the origin for a rod in m. They may be in another unit. State it in \
                 the header, as x[px] or x[mm]."
                    .to_string(),
            );
        }
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

/// The name of a marker; tables of one marker have none.
fn shown_name(marker: &InspectedMarker) -> String {
    if marker.name.is_empty() { "(no name)".into() } else { marker.name.clone() }
}

/// The numbers of gaps and of uncertain frames as text; empty without any.
fn gaps(marker: &InspectedMarker) -> String {
    let [count, longest] = marker.gaps;
    let lost = (count > 0).then(|| format!("lost {} for up to {longest} frames", times(count)));
    let uncertain = marker.low_confidence.filter(|n| *n > 0).map(|n| format!("uncertain in {n}"));
    lost.into_iter().chain(uncertain).collect::<Vec<_>>().join(", ")
}

/// A number of times as text.
fn times(n: usize) -> String {
    match n {
        1 => "once".into(),
        2 => "twice".into(),
        n => format!("{n} times"),
    }
}
