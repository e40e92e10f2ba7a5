//! Files with a line for every sighting, in any order: who was seen, when and where. They become a row a frame.

use crate::error::Error;
use crate::input::track::sheet::{Lines, Row, Sighted};
use crate::numerics::ordered;
use std::collections::HashMap;

/// Most places of all markers in all frames: a line for each of a million markers would make a million rows of a million.
const MOST_PLACES: usize = 10_000_000;

/// What has been read of a file so far.
#[derive(Default)]
pub(crate) struct Sightings {
    markers: HashMap<String, usize>,
    names: Vec<String>,
    all: Vec<Sighting>,
}

struct Sighting {
    row: Row,
    marker: usize,
    place: [Option<f64>; 3],
    likelihood: Option<f64>,
}

impl Sightings {
    /// Adds one, at its line and by its clock.
    pub fn add(&mut self, row: Row, name: &str, place: [Option<f64>; 3], likelihood: Option<f64>) {
        let marker = self.markers.get(name).copied().unwrap_or_else(|| {
            self.markers.insert(name.into(), self.names.len());
            self.names.push(name.into());
            self.names.len() - 1
        });
        self.all.push(Sighting { row, marker, place, likelihood });
    }

    /// All of them, by increasing time. `axes` are those that the file has, `sure` says whether it tells how sure it is.
    pub fn table(
        mut self,
        lines: &Lines,
        axes: [bool; 3],
        sure: bool,
    ) -> Result<(Vec<Row>, Vec<Sighted>), Error> {
        self.all.sort_by_cached_key(|x| ordered(x.row.clock));
        let mut rows: Vec<Row> = Vec::new();
        for sighting in &self.all {
            // Zero and minus zero are one time.
            if rows.last().is_none_or(|row| row.clock < sighting.row.clock) {
                rows.push(sighting.row);
            }
        }
        if rows.is_empty() {
            return Err(
                lines.error(1, "no line with the position of a marker, allowed: one at least")
            );
        }
        if self.names.len().saturating_mul(rows.len()) > MOST_PLACES {
            let message = format!(
                "{} markers in {} frames, allowed: up to {MOST_PLACES} positions; remove the markers that are not \
                 on the rod",
                self.names.len(),
                rows.len()
            );
            return Err(lines.error(1, message));
        }
        let new = |name: String| Sighted {
            name,
            axes,
            places: vec![[None; 3]; rows.len()],
            likelihood: sure.then(|| vec![None; rows.len()]),
        };
        let mut markers: Vec<Sighted> = self.names.into_iter().map(new).collect();
        let mut seen = vec![usize::MAX; markers.len()];
        let mut k = 0;
        for Sighting { row, marker, place, likelihood } in self.all {
            while rows[k].clock < row.clock {
                k += 1;
            }
            let own = &mut markers[marker];
            if std::mem::replace(&mut seen[marker], k) == k {
                let message = format!(
                    "a second position of the marker `{}` at {}, allowed: one at a time",
                    own.name, row.clock
                );
                return Err(lines.error(row.line, message));
            }
            own.places[k] = place;
            if let Some(all) = &mut own.likelihood {
                all[k] = likelihood;
            }
        }
        Ok((rows, markers))
    }
}
