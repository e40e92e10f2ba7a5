//! SLEAP's analysis in CSV: a line for every animal in every frame, with x, y and score of every node. Pixels, with y
//! down; several tracks make markers `track:node`.

use crate::error::Error;
use crate::input::track::format::Format;
use crate::input::track::sheet::{Clock, Lengths, Lines, Row, Says, Sheet};
use crate::input::track::sightings::Sightings;
use std::collections::HashMap;
use std::path::Path;

/// Columns that are of no node.
const OTHERS: [&str; 4] = ["track", "frame_idx", "instance.score", "tracking_score"];

pub(crate) fn read(path: &Path, bytes: &[u8]) -> Result<Sheet, Error> {
    let lines = Lines::of(path, bytes, b',')?;
    let format = Format::Sleap;
    let not = |line, found: &str, allowed: &str| Err(lines.not_of(format, line, found, allowed));
    let Some((header, rows)) = lines.list.split_first() else {
        return not(1, "nothing", "a header with `track`, `frame_idx` and the nodes");
    };
    let column = |name: &str| header.fields().position(|field| field == name);
    let (Some(track), Some(frame)) = (column("track"), column("frame_idx")) else {
        return not(header.number, "no columns `track` and `frame_idx`", "both");
    };
    let mut numbers: HashMap<&str, usize> = HashMap::new();
    // Names, and their columns x, y and score.
    let mut nodes: Vec<(&str, [Option<usize>; 3])> = Vec::new();
    for (column, field) in
        header.fields().enumerate().filter(|(_, f)| !OTHERS.contains(f) && !f.is_empty())
    {
        let says = field.rsplit_once('.').and_then(|(node, what)| match (what, Says::axis(what)) {
            ("score", _) => Some((node, 2)),
            (_, Some(Says::Axis(axis @ 0..2))) => Some((node, axis)),
            _ => None,
        });
        let Some((node, own)) = says else {
            return not(header.number, &format!("column `{field}`"), "NODE.x, NODE.y, NODE.score");
        };
        let number = *numbers.entry(node).or_insert_with(|| {
            nodes.push((node, [None; 3]));
            nodes.len() - 1
        });
        if nodes[number].1[own].replace(column).is_some() {
            return not(header.number, &format!("two columns `{field}`"), "one");
        }
    }
    if let Some((node, _)) = nodes.iter().find(|(_, own)| own[0].is_none() || own[1].is_none()) {
        return not(header.number, &format!("node `{node}` without x or y"), "both");
    }
    if nodes.is_empty() {
        return not(header.number, "no node", "NODE.x and NODE.y of one at least");
    }
    let several = rows.iter().any(|line| line.field(track) != rows[0].field(track));
    let mut sightings = Sightings::default();
    for line in rows.iter().filter(|line| !line.is_empty()) {
        if line.len() != header.len() {
            let found = format!("{} fields", line.len());
            return not(line.number, &found, &format!("{} as in the header", header.len()));
        }
        let clock = lines.some_number(line, frame, "frame_idx")?;
        let row = Row { line: line.number, clock };
        for (node, own) in &nodes {
            let value = |what: usize| match own[what] {
                Some(column) => lines.number(line, column, node),
                None => Ok(None),
            };
            let place = [value(0)?, value(1)?, None];
            let name = match several {
                true => format!("{}:{node}", line.field(track)),
                false => node.to_string(),
            };
            sightings.add(row, &name, place, value(2)?);
        }
    }
    let sure = nodes.iter().any(|(_, own)| own[2].is_some());
    let (rows, markers) = sightings.table(&lines, [true, true, false], sure)?;
    let (clock, lengths) =
        (Clock::Frames { first: 0.0, rate: None }, Lengths::Pixels { down: Some(true) });
    Ok(Sheet { path: path.into(), format, clock, lengths, rows, markers })
}
