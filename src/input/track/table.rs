//! Tables with a clock and columns `xA, yA, zA` of every marker A, or x, y and z of one without a name.

use crate::error::Error;
use crate::input::table::{LENGTHS, TIMES, Table};
use crate::input::track::format::Format;
use crate::input::track::sheet::{Clock, Lengths, Row, Sheet, Sighted};
use std::collections::{HashMap, HashSet};
use std::path::Path;

/// In SI or the units of the header; pixels where all are in pixels.
pub(crate) fn read(path: &Path, bytes: &[u8]) -> Result<Sheet, Error> {
    let table = Table::of(path, bytes)?;
    let clocks = ["t", "time", "frame"];
    let Some(column) = clocks.into_iter().find_map(|name| table.find(name)) else {
        return Err(table.error(1, "no column t, time or frame"));
    };
    let clock = match table.columns[column].0 == "frame" {
        true => Clock::Frames { first: 0.0, rate: None },
        false => Clock::Time(table.factor(column, &TIMES, "")?),
    };
    let (mut names, mut called): (Vec<[&str; 2]>, HashSet<&str>) = Default::default();
    let mut columns: HashMap<&str, usize> = HashMap::new();
    for (i, (name, _)) in table.columns.iter().enumerate().filter(|(i, _)| *i != column) {
        let Some(marker) = name.strip_prefix(['x', 'y', 'z']) else {
            let message = format!("column `{name}`, allowed: t, and x.., y.., z.. of markers");
            return Err(table.error(1, &message));
        };
        if columns.insert(name, i).is_some() {
            return Err(table.error(1, &format!("two columns `{name}`, allowed: one")));
        }
        if called.insert(marker) {
            names.push([marker, &table.written[i][1..]]);
        }
    }
    let mut rows: Vec<Row> = Vec::with_capacity(table.rows.len());
    for row in &table.rows {
        let blank = || table.error(row.line, "the time is blank, allowed: a time");
        let time = row.values[column].ok_or_else(blank)?;
        if let Some(before) = rows.last().filter(|before| before.clock >= time) {
            let message = format!("t = {time} after {}, allowed: increasing times", before.clock);
            return Err(table.error(row.line, &message));
        }
        rows.push(Row { line: row.line, clock: time });
    }
    if rows.is_empty() {
        return Err(table.error(1, "no row below the header, allowed: one at least"));
    }
    let pixels = |i: usize| i == column || table.columns[i].1.as_deref() == Some("px");
    let pixels = table.columns.len() > 1 && (0..table.columns.len()).all(pixels);
    let mut markers = Vec::with_capacity(names.len());
    for [name, written] in names {
        let mut axes = [None; 3];
        for (axis, letter) in axes.iter_mut().zip(['x', 'y', 'z']) {
            let column = format!("{letter}{name}");
            if let Some(column) = columns.get(&column[..]).copied() {
                let factor = match pixels {
                    true => 1.0,
                    false => table.factor(column, &LENGTHS, "")?,
                };
                *axis = Some((column, factor));
            }
        }
        if !name.is_empty() && axes[..2].contains(&None) {
            let message = format!("marker `{name}` without a column x{name} or y{name}");
            return Err(table.error(1, &message));
        }
        let place = |row: &crate::input::table::Row| {
            axes.map(|axis| axis.and_then(|(column, factor)| Some(row.values[column]? * factor)))
        };
        markers.push(Sighted {
            name: written.into(),
            axes: axes.map(|axis| axis.is_some()),
            places: table.rows.iter().map(place).collect(),
            likelihood: None,
        });
    }
    let lengths = match pixels {
        true => Lengths::Pixels { down: None },
        false => Lengths::Known("m", 1.0),
    };
    Ok(Sheet { path: path.into(), format: Format::Csv, clock, lengths, rows, markers })
}
