//! The CSV table of DeepLabCut from its HDF5 file, which is a table of pandas.
//!
//! Input is a file with one group of pandas. With `format="table"`, as DeepLabCut writes its results, the data set
//! `table` has rows of `index` and `values_block_0`, and its attribute `values_block_0_kind` the names of the columns
//! as pickled tuples. Of the fixed format, `axis0_level0` and so on have the names of each level, `axis0_label0` their
//! numbers by column, `axis1` the frames and `block0_values` the numbers. The levels are the scorer, the individuals if
//! there are several animals, the body parts and the coordinates. Output: the rows `scorer`, `individuals`, `bodyparts`
//! and `coords`, and one row for each frame; NaN is a blank cell. Frames without numbers (names of images), and tables
//! of numbers in several blocks, are errors.

use crate::hdf5::contents::{frames, reason};
use crate::hdf5::data_set::{DataSet, NumberKind};
use crate::hdf5::pickled_names;
use crate::printable::token;
use hdf5_pure::{Datatype, File};

/// Names of the levels of the columns; `individuals` is missing for one animal.
const LEVELS: [&str; 4] = ["scorer", "individuals", "bodyparts", "coords"];

/// What is allowed instead of names of images.
const IMAGES: &str = "frame numbers; names of images are read in CSV";

/// Names of the columns by level, numbers of the frames, and values by frame and column.
struct PandasTable {
    /// For each column its names: three, or four with individuals.
    columns: Vec<Vec<String>>,
    frames: Vec<f64>,
    values: Vec<f64>,
}

/// The table of a file of `size` bytes. An error for no table of pandas or several, for other levels of names, and for
/// frames without numbers.
pub(crate) fn table(file: &File, size: usize) -> Result<Vec<u8>, String> {
    let found = frames(file)?;
    let [(group, kind)] = &found[..] else {
        let count = found.len();
        return Err(format!(
            "found {count} tables of pandas, allowed: one, as DeepLabCut writes `df_with_missing`"
        ));
    };
    let read = match &kind[..] {
        "frame_table" => of_rows(file, group, size)?,
        "frame" => of_blocks(file, group, size)?,
        _ => {
            return Err(format!(
                "found pandas_type = `{}`, allowed: frame_table or frame",
                token(kind)
            ));
        }
    };
    let levels: &[&str] = match read.columns.first().map_or(0, Vec::len) {
        3 => &[LEVELS[0], LEVELS[2], LEVELS[3]],
        4 => &LEVELS,
        count => {
            let allowed = "3, scorer, bodyparts and coords, or 4, with individuals";
            return Err(format!(
                "found {count} levels of columns in `{}`, allowed: {allowed}",
                token(group)
            ));
        }
    };
    let mut table = csv::Writer::from_writer(Vec::new());
    let failed = |error: csv::Error| error.to_string();
    for (k, level) in levels.iter().enumerate() {
        let names = read.columns.iter().map(|names| names.get(k).map_or("", |name| name));
        table.write_record(std::iter::once(*level).chain(names)).map_err(failed)?;
    }
    for (frame, values) in read.frames.iter().zip(read.values.chunks_exact(read.columns.len())) {
        table.write_field(frame.to_string()).map_err(failed)?;
        for value in values {
            let cell = if value.is_nan() { String::new() } else { format!("{value:?}") };
            table.write_field(cell).map_err(failed)?;
        }
        table.write_record(None::<&[u8]>).map_err(failed)?;
    }
    table.into_inner().map_err(|error| error.to_string())
}

/// Reads the rows of a group in the format `table`.
fn of_rows(file: &File, group: &str, size: usize) -> Result<PandasTable, String> {
    let set = DataSet::open(file, &format!("{group}/table"), size)?;
    let Datatype::Compound { size: width, members } = &set.kind else {
        return Err(set.refused("no rows", "rows of `index` and `values_block_0`"));
    };
    let member = |name: &str| members.iter().find(|member| member.name == name);
    let (Some(index), Some(block), 2) = (member("index"), member("values_block_0"), members.len())
    else {
        let names: Vec<_> =
            members.iter().take(8).map(|member| format!("`{}`", token(&member.name))).collect();
        return Err(set.refused(
            &format!("the columns {}", names.join(", ")),
            "`index` and `values_block_0`",
        ));
    };
    let Some(clock) = NumberKind::of(&index.datatype) else {
        return Err(set.refused("names of images", IMAGES));
    };
    let kind = match &block.datatype {
        Datatype::Array { base_type, dimensions } => {
            NumberKind::of(base_type).zip(match dimensions[..] {
                [count] => Some(count as usize),
                _ => None,
            })
        }
        _ => None,
    };
    let Some((kind, count)) = kind else {
        return Err(set.refused("other values", "an array of numbers in `values_block_0`"));
    };
    let pickle = set.text_attribute("values_block_0_kind")?.unwrap_or_default();
    let columns = pickled_names::tuples(&pickle).map_err(|found| {
        set.refused(
            &format!("{found} in the attribute `values_block_0_kind`"),
            "names of columns in ASCII, pickled as a list of tuples of texts",
        )
    })?;
    if columns.is_empty() || columns.len() != count {
        let found = format!("{} names of columns and {count} values in each row", columns.len());
        return Err(set.refused(&found, "one name for each"));
    }
    let [at, from] = [index.byte_offset, block.byte_offset].map(|at| at as usize);
    let mut read = PandasTable { columns, frames: Vec::new(), values: Vec::new() };
    for row in set.bytes()?.chunks_exact((*width).max(1) as usize) {
        read.frames.push(clock.number(row.get(at..).unwrap_or_default()));
        let values = row.get(from..).unwrap_or_default().chunks_exact(kind.width).take(count);
        if values.len() < count {
            return Err(set.refused(&format!("rows of {width} bytes"), "rows with all values"));
        }
        read.values.extend(values.map(|bytes| kind.number(bytes)));
    }
    Ok(read)
}

/// Reads the data sets of a group in the fixed format.
fn of_blocks(file: &File, group: &str, size: usize) -> Result<PandasTable, String> {
    let open = |name: String| DataSet::open(file, &format!("{group}/{name}"), size);
    let members = file.group(group).and_then(|group| group.datasets()).map_err(reason)?;
    let has = |name: &str| members.iter().any(|member| member == name);
    let values = open("block0_values".into())?;
    let index = match has("axis1_level0") {
        true => open("axis1_level0".into())?,
        false => open("axis1".into())?,
    };
    if NumberKind::of(&index.kind).is_none() {
        return Err(index.refused("names of images", IMAGES));
    }
    let [rows, count] = values.shape[..] else {
        return Err(values.refused("other axes", "frames, columns"));
    };
    if has("block1_values") || index.shape != [rows] || count == 0 {
        return Err(
            values.refused("other data sets beside it", "one block of all frames in `axis1`")
        );
    }
    let mut columns = vec![Vec::new(); count];
    for level in 0.. {
        if !has(&format!("block0_items_level{level}")) {
            break;
        }
        let names = open(format!("block0_items_level{level}"))?.texts()?;
        let labels = open(format!("block0_items_label{level}"))?;
        let numbers = labels.numbers()?;
        if level >= LEVELS.len() || numbers.len() != count {
            return Err(
                labels.refused("other names", "up to 4 levels, with a number for each column")
            );
        }
        for (column, number) in columns.iter_mut().zip(numbers) {
            let name = (number >= 0.0).then(|| names.get(number as usize)).flatten();
            let name = name.ok_or_else(|| {
                labels.refused(&format!("the number {number}"), "numbers of names")
            })?;
            column.push(name.clone());
        }
    }
    Ok(PandasTable { columns, frames: index.numbers()?, values: values.numbers()? })
}
