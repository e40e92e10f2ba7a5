//! Recorded motion: where a point of the rod was seen at which times.

use crate::error::Error;
use crate::point::Point;
use crate::table::Table;
use std::path::{Path, PathBuf};

/// One sighting of the point. World coordinates, m; a coordinate that was not seen is `None`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// s.
    pub time: f64,
    /// x, y, z in m.
    pub position: [Option<f64>; 3],
}

/// A recorded point.
#[derive(Clone, Debug)]
pub struct Observation {
    /// Which point of the rod.
    pub point: Point,
    /// Times increase.
    pub samples: Vec<Sample>,
    /// Standard deviation per coordinate, m; estimated from the residuals when `None`.
    pub sigma: Option<f64>,
    /// The file, for messages.
    pub source: Option<PathBuf>,
}

impl Observation {
    /// Sightings of the tip.
    pub fn new(samples: Vec<Sample>) -> Self {
        Self { point: Point::Tip, samples, sigma: None, source: None }
    }

    /// Reads a CSV file with the columns t and at least one of x, y, z. Units stand in brackets,
    /// `t[ms],x[mm]`; without them s and m. Blank or NaN is missing.
    pub fn read(path: impl AsRef<Path>) -> Result<Self, Error> {
        let path = path.as_ref();
        let table = Table::read(path)?;
        const NAMES: [&str; 4] = ["t", "x", "y", "z"];
        if let Some((name, _)) = table.columns.iter().find(|(n, _)| !NAMES.contains(&n.as_str())) {
            return Err(table.error(1, &format!("column `{name}`, allowed: t, x, y, z")));
        }
        for name in NAMES {
            if table.columns.iter().filter(|(column, _)| column == name).count() > 1 {
                return Err(table.error(1, &format!("two columns `{name}`, allowed: one")));
            }
        }
        let time_column = table.require("t")?;
        let time_unit = unit(&table, time_column, &[("s", 1.0), ("ms", 1e-3)])?;
        let mut columns = [None; 3];
        for (slot, name) in columns.iter_mut().zip(&NAMES[1..]) {
            if let Some(i) = table.find(name) {
                *slot = Some((i, unit(&table, i, &[("m", 1.0), ("cm", 1e-2), ("mm", 1e-3)])?));
            }
        }
        if columns.iter().all(Option::is_none) {
            return Err(table.error(1, "no column x, y or z"));
        }
        let mut samples: Vec<Sample> = Vec::with_capacity(table.rows.len());
        for row in &table.rows {
            let time = row.values[time_column]
                .ok_or_else(|| table.error(row.line, "t is blank, allowed: a time"))?
                * time_unit;
            if let Some(before) = samples.last().filter(|before| before.time >= time) {
                let message =
                    format!("t = {time} s after {} s, allowed: increasing times", before.time);
                return Err(table.error(row.line, &message));
            }
            if time < 0.0 {
                return Err(table.error(row.line, &format!("t = {time} s, allowed: 0 or later")));
            }
            let position = columns.map(|c| c.and_then(|(i, u)| row.values[i].map(|v| v * u)));
            samples.push(Sample { time, position });
        }
        let observation = Self { source: Some(path.into()), ..Self::new(samples) };
        if observation.values() == 0 {
            return Err(table.error(1, "no value below the header"));
        }
        Ok(observation)
    }

    /// Of another point than the tip.
    pub fn at(self, point: Point) -> Self {
        Self { point, ..self }
    }

    /// With a known standard deviation per coordinate, m.
    pub fn sigma(self, sigma: f64) -> Self {
        Self { sigma: Some(sigma), ..self }
    }

    /// Number of coordinates seen.
    pub fn values(&self) -> usize {
        self.samples.iter().flat_map(|s| s.position).flatten().count()
    }

    /// The file or the point, for messages.
    pub(crate) fn label(&self) -> String {
        match &self.source {
            Some(path) => path.display().to_string(),
            None => format!("the observation of {:?}", self.point),
        }
    }

    /// Root mean square distance of the seen coordinates from their means, m.
    pub(crate) fn spread(&self) -> f64 {
        let (mut sum, mut count) = (0.0, 0.0);
        for c in 0..3 {
            let seen: Vec<f64> = self.samples.iter().filter_map(|s| s.position[c]).collect();
            let mean = seen.iter().sum::<f64>() / seen.len().max(1) as f64;
            sum += seen.iter().map(|x| (x - mean).powi(2)).sum::<f64>();
            count += seen.len() as f64;
        }
        (sum / f64::max(count, 1.0)).sqrt()
    }

    /// When the point has first gone nine tenths of its first swing away from where it was first
    /// seen: about half a period of a free vibration. The first swing ends where the distance has
    /// fallen by a fifth from at least three tenths of the farthest it ever gets; in space the
    /// farthest itself may come much later, when sideways motion has built up.
    pub(crate) fn rise_time(&self) -> f64 {
        let first: [Option<f64>; 3] =
            [0, 1, 2].map(|c| self.samples.iter().find_map(|s| s.position[c]));
        let distance = |s: &Sample| -> f64 {
            let parts = (0..3).filter_map(|c| Some((s.position[c]? - first[c]?).powi(2)));
            parts.sum::<f64>().sqrt()
        };
        // A sample that misses coordinates seems near.
        let whole = |s: &&Sample| (0..3).all(|c| first[c].is_some() == s.position[c].is_some());
        let farthest = self.samples.iter().map(distance).fold(0.0, f64::max);
        let mut swing = 0.0_f64;
        for sample in self.samples.iter().filter(whole) {
            let d = distance(sample);
            if swing >= 0.3 * farthest && d < 0.8 * swing {
                break;
            }
            swing = swing.max(d);
        }
        let risen = self.samples.iter().find(|s| distance(s) >= 0.9 * swing);
        risen.map_or(0.0, |s| s.time)
    }
}

fn unit(table: &Table, column: usize, known: &[(&str, f64)]) -> Result<f64, Error> {
    let (name, unit) = &table.columns[column];
    let Some(unit) = unit else { return Ok(1.0) };
    known.iter().find(|(symbol, _)| symbol == unit).map(|(_, factor)| *factor).ok_or_else(|| {
        let symbols: Vec<&str> = known.iter().map(|(symbol, _)| *symbol).collect();
        table.error(1, &format!("unit [{unit}] of `{name}`, allowed: {}", symbols.join(", ")))
    })
}
