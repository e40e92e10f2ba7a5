//! The analysis table of SLEAP from its analysis file in HDF5.
//!
//! Input are `tracks` (tracks, x and y, nodes, frames), `node_names` (nodes), and if they exist `track_names` (tracks)
//! and `point_scores` (tracks, nodes, frames). Output: the CSV table with one line for each track and frame with a
//! position. A node without a position has blank cells; a single track has no name. Other shapes are errors.

use crate::hdf5::contents::listed;
use crate::hdf5::data_set::DataSet;
use hdf5_pure::File;

/// The table of an analysis file of `size` bytes. An error for missing data sets, and for shapes that do not match.
pub(crate) fn table(file: &File, size: usize) -> Result<Vec<u8>, String> {
    let (tracks, nodes) =
        (DataSet::open(file, "tracks", size)?, DataSet::open(file, "node_names", size)?.texts()?);
    let allowed = format!("tracks, 2 coordinates, {} nodes, frames", nodes.len());
    let [count, 2, parts, frames] = tracks.shape[..] else {
        return Err(tracks.refused("other axes", &allowed));
    };
    if parts != nodes.len() {
        return Err(tracks.refused(&format!("{parts} nodes"), &allowed));
    }
    let root = listed(file.root().datasets())?;
    let named =
        |name: &str| root.iter().any(|own| own == name).then(|| DataSet::open(file, name, size));
    let names = match named("track_names").transpose()? {
        Some(names) if !names.shape.contains(&0) => names.texts()?,
        _ => Vec::new(),
    };
    let scores = named("point_scores").transpose()?;
    if let Some(scores) = scores.as_ref().filter(|scores| scores.shape != [count, parts, frames]) {
        let allowed = format!("{count} tracks, {parts} nodes, {frames} frames, as `tracks`");
        return Err(scores.refused("other axes", &allowed));
    }
    let scores = scores.map(|scores| scores.numbers()).transpose()?;
    let positions = tracks.numbers()?;
    let mut table = csv::Writer::from_writer(Vec::new());
    let failed = |error: csv::Error| error.to_string();
    for cell in ["track", "frame_idx", "instance.score"] {
        table.write_field(cell).map_err(failed)?;
    }
    let columns: &[&str] = if scores.is_some() { &["x", "y", "score"] } else { &["x", "y"] };
    for (node, column) in
        nodes.iter().flat_map(|node| columns.iter().map(move |column| (node, column)))
    {
        table.write_field(format!("{node}.{column}")).map_err(failed)?;
    }
    table.write_record(None::<&[u8]>).map_err(failed)?;
    for track in 0..count {
        let name = match names.get(track) {
            _ if count == 1 => String::new(),
            Some(name) => name.clone(),
            None => format!("track_{track}"),
        };
        for frame in 0..frames {
            let position = |node: usize| {
                let value = |axis: usize| {
                    positions.get(((2 * track + axis) * parts + node) * frames + frame)
                };
                let [x, y] = [value(0).copied()?, value(1).copied()?];
                (!x.is_nan() && !y.is_nan()).then_some([x, y])
            };
            if (0..parts).all(|node| position(node).is_none()) {
                continue;
            }
            for cell in [&name, &frame.to_string(), ""] {
                table.write_field(cell).map_err(failed)?;
            }
            for node in 0..parts {
                let found = position(node);
                let cell =
                    |value: Option<f64>| value.filter(|x| !x.is_nan()).map(|x| format!("{x:?}"));
                let [x, y] = [found.map(|p| p[0]), found.map(|p| p[1])].map(cell);
                let score = scores.as_ref().map(|all| {
                    cell(found.and(all.get((track * parts + node) * frames + frame).copied()))
                });
                for cell in [Some(x), Some(y), score].into_iter().flatten() {
                    table.write_field(cell.unwrap_or_default()).map_err(failed)?;
                }
            }
            table.write_record(None::<&[u8]>).map_err(failed)?;
        }
    }
    table.into_inner().map_err(|error| error.to_string())
}
