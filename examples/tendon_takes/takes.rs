//! Takes of the tentacle: tensions of its tendons and mean positions of its markers.
//!
//! Input: a folder with `takes.csv` and `train/NAME.csv`, one file per take. Output: a list of [`Take`]. A marker is at
//! the mean over all frames, in the frame of the model: origin at the clamp, z up.

use crate::tentacle::Take;
use std::error::Error;
use std::path::Path;

/// Recorded position of the base marker relative to the clamp, m, in the axes of the cameras.
const BASE: [f64; 3] = [-0.030, -0.013, 0.0];

/// Reads all takes of a folder, in the order of `takes.csv`.
pub fn read(folder: &Path) -> Result<Vec<Take>, Box<dyn Error>> {
    let path = folder.join("takes.csv");
    let text = std::fs::read_to_string(&path).map_err(|e| format!("{}: {e}", path.display()))?;
    let mut lines = text.lines();
    let header: Vec<&str> = lines.next().unwrap_or_default().split(',').collect();
    let mut takes = Vec::new();
    for line in lines {
        let cells: Vec<&str> = line.split(',').collect();
        let cell = |name: &str| -> Result<&str, String> {
            let column = header.iter().position(|own| *own == name);
            let found = column.and_then(|column| cells.get(column).copied());
            found.ok_or_else(|| format!("{}: no column {name}", path.display()))
        };
        let name = cell("take")?;
        let means = means(&folder.join("train").join(format!("{name}.csv")))?;
        // The order of the markers in the file differs from take to take.
        let recorded = |column: &str| -> Result<[f64; 3], Box<dyn Error>> {
            let marker: usize = cell(column)?.parse()?;
            let found = means.get(3 * marker - 1..3 * marker + 2).ok_or("a marker is missing")?;
            Ok([found[0], found[1], found[2]])
        };
        let base = recorded("col_base")?;
        let in_model = |column: &str| -> Result<[f64; 3], Box<dyn Error>> {
            let marker = recorded(column)?;
            let [x, y, z] = std::array::from_fn(|c| marker[c] - base[c] - BASE[c]);
            // The y axis of the cameras points down.
            Ok([x, z, -y])
        };
        let markers = ["col_p1", "col_p2", "col_p3", "col_p4"].into_iter().map(in_model);
        takes.push(Take {
            name: name.into(),
            tensions: [cell("tension1_N")?.parse()?, cell("tension2_N")?.parse()?],
            markers: markers.collect::<Result<_, _>>()?,
        });
    }
    Ok(takes)
}

/// Mean of every column of a file of comma-separated numbers without a header.
fn means(path: &Path) -> Result<Vec<f64>, Box<dyn Error>> {
    let text = std::fs::read_to_string(path).map_err(|e| format!("{}: {e}", path.display()))?;
    let (mut sums, mut rows) = (Vec::new(), 0.0);
    for line in text.lines() {
        let values = line.split(',').map(str::parse).collect::<Result<Vec<f64>, _>>()?;
        sums.resize(values.len(), 0.0);
        sums.iter_mut().zip(values).for_each(|(sum, value)| *sum += value);
        rows += 1.0;
    }
    Ok(sums.into_iter().map(|sum| sum / rows).collect())
}
