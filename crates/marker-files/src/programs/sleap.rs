//! Reader of the analysis of SLEAP in CSV: a line for every animal in every frame.
//!
//! A line has x, y and score of every node, in pixels with y down; the score is the likelihood of the position. Each
//! node is a marker, named after the node; if the lines have several tracks, `track:node`. The clock is the frame
//! number, without a rate. Errors: no columns `track` and `frame_idx`, no node, other columns, a node without x or y,
//! another number of fields than the header, and two lines of one marker in a frame.

use crate::detections::Detections;
use crate::error::Error;
use crate::format::Format;
use crate::hdf5;
use crate::marker_file::{Clock, ColumnKind, FieldLines, FrameReading, LengthUnit, MarkerFile};
use std::collections::HashMap;
use std::path::Path;

/// Columns that do not belong to a node.
const OTHERS: [&str; 4] = ["track", "frame_idx", "instance.score", "tracking_score"];

/// Reads the bytes of a file of SLEAP into frames by number and nodes as markers, in pixels; `path` is for messages.
/// The score of a node is the likelihood of its position. With several tracks the marker is named `track:node`. An
/// error for other columns, a node without x or y, another number of fields than the header, and two lines of a marker
/// in one frame.
pub(crate) fn read(path: &Path, bytes: &[u8]) -> Result<MarkerFile, Error> {
    let bytes = hdf5::sleap_table(path, bytes)?;
    let lines = FieldLines::new(path, Format::Sleap, &bytes, b',')?;
    let Some((header, rows)) = lines.list.split_first() else {
        return lines.rejected(1, "nothing", "a header with `track`, `frame_idx` and the nodes");
    };
    let column = |name: &str| header.fields().position(|field| field == name);
    let (Some(track), Some(frame)) = (column("track"), column("frame_idx")) else {
        return lines.rejected(header.number, "no columns `track` and `frame_idx`", "both");
    };
    let mut numbers: HashMap<&str, usize> = HashMap::new();
    // Names with their columns of x, y and score.
    let mut nodes: Vec<(&str, [Option<usize>; 3])> = Vec::new();
    for (column, field) in
        header.fields().enumerate().filter(|(_, f)| !OTHERS.contains(f) && !f.is_empty())
    {
        let kind =
            field.rsplit_once('.').and_then(|(node, what)| match (what, ColumnKind::axis(what)) {
                ("score", _) => Some((node, 2)),
                (_, Some(ColumnKind::Axis(axis @ 0..2))) => Some((node, axis)),
                _ => None,
            });
        let Some((node, own)) = kind else {
            return lines.rejected(
                header.number,
                &format!("column `{field}`"),
                "NODE.x, NODE.y, NODE.score",
            );
        };
        let number = *numbers.entry(node).or_insert_with(|| {
            nodes.push((node, [None; 3]));
            nodes.len() - 1
        });
        if nodes[number].1[own].replace(column).is_some() {
            return lines.rejected(header.number, &format!("two columns `{field}`"), "one column");
        }
    }
    if let Some((node, _)) = nodes.iter().find(|(_, own)| own[0].is_none() || own[1].is_none()) {
        return lines.rejected(
            header.number,
            &format!("node `{node}` without x or y"),
            "both \
                                                       columns",
        );
    }
    if nodes.is_empty() {
        return lines.rejected(header.number, "no node", "NODE.x and NODE.y of at least one node");
    }
    // Nodes of several animals need the track in their names.
    let mut filled = rows.iter().filter(|line| !line.is_empty());
    let first = filled.next().map(|line| line.field(track));
    let several = filled.any(|line| Some(line.field(track)) != first);
    let mut detections = Detections::default();
    for line in rows.iter().filter(|line| !line.is_empty()) {
        // A row with a missing field would shift all coordinates behind it.
        if line.len() != header.len() {
            let found = format!("{} fields", line.len());
            return lines.rejected(
                line.number,
                &found,
                &format!("{} fields, as in the header", header.len()),
            );
        }
        let clock = lines.required_number(line, frame, "frame_idx")?;
        let row = FrameReading { line: line.number, clock };
        for (node, own) in &nodes {
            let value = |what: usize| match own[what] {
                Some(column) => lines.number(line, column, node),
                None => Ok(None),
            };
            let position = [value(0)?, value(1)?, None];
            let name = match several {
                true => format!("{}:{node}", line.field(track)),
                false => node.to_string(),
            };
            detections.add(row, &name, position, value(2)?);
        }
    }
    let has_confidence = nodes.iter().any(|(_, own)| own[2].is_some());
    let table = detections.table(&lines, [true, true, false], has_confidence)?;
    let (clock, lengths) =
        (Clock::Frames { first: 0.0, rate: None }, LengthUnit::Pixels { down: Some(true) });
    Ok(lines.file(clock, lengths, table))
}
