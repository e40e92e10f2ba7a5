//! A recorded branched cable: its markers at rest, the pieces between its junctions, and its recordings.
//!
//! Input: the folder of the recordings. `rest/NAME_rest.csv` has a row for each marker with branch, previous marker, position
//! at rest, m, and the median of the recorded distance from the previous marker, m. `train/NAME_*.csv` are the clips, with a
//! clock `t` and columns `xA, yA, zA`, m, of every marker. Output: a [`Cable`] with pieces as smooth curves between junctions,
//! at equal distances. Segments of the rest shape have the recorded lengths.

use std::error::Error;
use std::path::{Path, PathBuf};

/// Points of the curve of a piece at rest.
const POINTS: usize = 25;
/// Points between two markers from which arc lengths are computed.
const FINE: usize = 40;

/// Edges of pieces are about as long, m: half of the distance of two markers.
const EDGE: f64 = 0.045;
/// Smallest number of edges of a piece.
const FEWEST_EDGES: f64 = 6.0;

/// A position, m.
pub type Point = [f64; 3];

/// A marker at rest.
pub struct Marker {
    pub name: String,
    pub branch: String,
    /// Index of the previous marker on its branch, or of the junction.
    pub previous: Option<usize>,
    pub position: Point,
}

/// The part of a branch between two junctions, or between a junction and an end.
pub struct Piece {
    /// Name of the rod: that of the branch, with a number behind the first piece.
    pub name: String,
    pub branch: String,
    /// Markers from the start to the end.
    pub markers: Vec<usize>,
    /// Arc lengths of these markers, m.
    pub arc_lengths: Vec<f64>,
    /// Points of the rest curve at equal distances, m.
    pub points: Vec<Point>,
    /// Number of edges.
    pub segments: usize,
    /// Whether the hand holds the first, and the last, edge.
    pub held: [bool; 2],
}

/// A marker at which branches begin.
pub struct Junction {
    pub marker: usize,
    /// Index of the piece that ends there.
    pub incoming: usize,
    /// Indices of the pieces that start there.
    pub outgoing: Vec<usize>,
}

/// A cable with its recordings.
pub struct Cable {
    pub name: String,
    pub markers: Vec<Marker>,
    pub pieces: Vec<Piece>,
    pub clips: Vec<PathBuf>,
    /// Number of markers of the parent, and of children.
    pub parent: usize,
    pub children: usize,
}

/// The sum `a + factor b`.
fn add(a: Point, b: Point, factor: f64) -> Point {
    [0, 1, 2].map(|c| a[c] + factor * b[c])
}

/// The distance of two points, m.
fn distance(a: Point, b: Point) -> f64 {
    [0, 1, 2].map(|c| (a[c] - b[c]).powi(2)).iter().sum::<f64>().sqrt()
}

/// The markers in the table of rest positions. Segments get their recorded lengths, along the directions of the table.
fn markers(path: &Path) -> Result<Vec<Marker>, Box<dyn Error>> {
    let text = std::fs::read_to_string(path)?;
    let mut markers: Vec<Marker> = Vec::new();
    let mut table: Vec<Point> = Vec::new();
    for line in text.lines().filter(|line| !line.starts_with('#')).skip(1) {
        let cells: Vec<&str> = line.split(',').collect();
        let number = |i: usize| cells[i].parse::<f64>();
        let at = [number(3)?, number(4)?, number(5)?];
        let previous = markers.iter().position(|marker| marker.name == cells[2]);
        let position = match previous {
            None => at,
            Some(j) => {
                let way = add(at, table[j], -1.0);
                add(markers[j].position, way, number(7)? / distance(at, table[j]))
            }
        };
        table.push(at);
        let [name, branch] = [cells[0], cells[1]].map(String::from);
        markers.push(Marker { name, branch, previous, position });
    }
    Ok(markers)
}

/// The smooth curve through points (Catmull-Rom), `FINE` points from one to the next, and its arc length at each of them, m.
fn curve(points: &[Point]) -> (Vec<Point>, Vec<f64>) {
    let last = points.len() - 1;
    let tangent = |i: usize| {
        let (a, b) = (i.saturating_sub(1), (i + 1).min(last));
        let parts = [(a, i), (i, b)].map(|(a, b)| distance(points[a], points[b]));
        let slope = |a: usize, b: usize, length: f64| {
            add(points[b], points[a], -1.0).map(|x| if length > 0.0 { x / length } else { 0.0 })
        };
        let [before, after] = [slope(a, i, parts[0]), slope(i, b, parts[1])];
        if i == 0 {
            return after;
        }
        if i == last {
            return before;
        }
        [0, 1, 2].map(|c| (before[c] * parts[1] + after[c] * parts[0]) / (parts[0] + parts[1]))
    };
    let mut fine = vec![points[0]];
    let mut lengths = vec![0.0];
    for i in 0..last {
        let length = distance(points[i], points[i + 1]);
        let [a, b] = [tangent(i), tangent(i + 1)];
        for k in 1..=FINE {
            let t = k as f64 / FINE as f64;
            let (t2, t3) = (t * t, t * t * t);
            let next = [0, 1, 2].map(|c| {
                (2.0 * t3 - 3.0 * t2 + 1.0) * points[i][c]
                    + (t3 - 2.0 * t2 + t) * length * a[c]
                    + (3.0 * t2 - 2.0 * t3) * points[i + 1][c]
                    + (t3 - t2) * length * b[c]
            });
            let step = distance(*fine.last().unwrap_or(&next), next);
            lengths.push(lengths[lengths.len() - 1] + step);
            fine.push(next);
        }
    }
    (fine, lengths)
}

/// The point at an arc length of a curve, m; beyond its ends on the tangent there.
fn at(fine: &[Point], lengths: &[f64], s: f64) -> Point {
    let k = lengths[1..lengths.len() - 1].partition_point(|own| *own < s);
    let part = (s - lengths[k]) / (lengths[k + 1] - lengths[k]);
    add(fine[k], add(fine[k + 1], fine[k], -1.0), part)
}

impl Piece {
    /// The piece through the markers of a `chain`, whose ends are held by a hand or clamped at a junction. A held edge is as
    /// long as every other one: arc lengths then begin at the end of the rod, which is one edge behind its second marker.
    fn new(
        name: String,
        markers: &[Marker],
        chain: &[usize],
        held: [bool; 2],
        is_clamped: [bool; 2],
    ) -> Self {
        let places: Vec<Point> = chain.iter().map(|i| markers[*i].position).collect();
        let (fine, lengths) = curve(&places);
        let (mut arc_lengths, last): (Vec<f64>, _) =
            ((0..places.len()).map(|i| lengths[i * FINE]).collect(), places.len() - 1);
        let [first, end] = [if held[0] { 1 } else { 0 }, if held[1] { last - 1 } else { last }]
            .map(|i| arc_lengths[i]);
        // Free edges fill the length between held nodes and joints, which are in the middle of an edge.
        let behind = is_clamped.iter().filter(|clamped| **clamped).count() as f64 / 2.0;
        let held_edges = held.iter().filter(|held| **held).count();
        let free = (end - first) / EDGE + behind;
        let free = free.round().max(FEWEST_EDGES - held_edges as f64);
        let edge = (end - first) / (free - behind);
        let start = if held[0] { first - edge } else { 0.0 };
        let stop = if held[1] { end + edge } else { end };
        let step = (stop - start) / (POINTS - 1) as f64;
        let points = (0..POINTS).map(|k| at(&fine, &lengths, start + k as f64 * step)).collect();
        arc_lengths.iter_mut().for_each(|s| *s -= start);
        Self {
            name,
            branch: markers[chain[last]].branch.clone(),
            markers: chain.to_vec(),
            arc_lengths,
            points,
            segments: free as usize + held_edges,
            held,
        }
    }
}

impl Cable {
    /// Reads the cable `name` in a folder.
    pub fn read(folder: &Path, name: &str) -> Result<Self, Box<dyn Error>> {
        let markers = markers(&folder.join(format!("rest/{name}_rest.csv")))?;
        let mut clips: Vec<PathBuf> = std::fs::read_dir(folder.join("train"))?
            .map(|entry| entry.map(|entry| entry.path()))
            .collect::<Result<_, _>>()?;
        let prefix = format!("{name}_");
        clips.retain(|path| {
            path.file_name().is_some_and(|file| file.to_string_lossy().starts_with(&prefix))
        });
        clips.sort();
        let mut branches: Vec<&str> = markers.iter().map(|marker| &marker.branch[..]).collect();
        branches.dedup();
        // A junction is the marker before the first one of a child.
        let is_junction = |i: usize| {
            markers.iter().any(|m| m.previous == Some(i) && m.branch != markers[i].branch)
        };
        let mut pieces = Vec::new();
        for branch in &branches {
            let own: Vec<usize> =
                (0..markers.len()).filter(|i| markers[*i].branch == **branch).collect();
            let mut chain: Vec<usize> = markers[own[0]].previous.into_iter().collect();
            let is_parent = chain.is_empty();
            let mut count = 0;
            for i in &own {
                chain.push(*i);
                let is_last = Some(i) == own.last();
                if !is_last && (chain.len() < 2 || !is_junction(*i)) {
                    continue;
                }
                count += 1;
                let held = [is_parent && count == 1, is_parent && is_last];
                let clamped = [!held[0], !is_last];
                let name = match count {
                    1 => branch.to_string(),
                    _ => format!("{branch}_{count}"),
                };
                pieces.push(Piece::new(name, &markers, &chain, held, clamped));
                chain = vec![*i];
            }
        }
        let parent = markers.iter().filter(|marker| marker.branch == branches[0]).count();
        let children = branches.len() - 1;
        Ok(Self { name: name.into(), markers, pieces, clips, parent, children })
    }

    /// The junctions, in the order of the pieces that lead to them.
    pub fn junctions(&self) -> Vec<Junction> {
        let mut junctions = Vec::new();
        for (incoming, piece) in self.pieces.iter().enumerate() {
            let marker = piece.markers[piece.markers.len() - 1];
            let starts = |k: &usize| self.pieces[*k].markers[0] == marker;
            let outgoing: Vec<usize> = (0..self.pieces.len()).filter(starts).collect();
            if !outgoing.is_empty() {
                junctions.push(Junction { marker, incoming, outgoing });
            }
        }
        junctions
    }

    /// The names of the branches; the parent is the first one.
    pub fn branches(&self) -> impl Iterator<Item = &str> {
        let mut names: Vec<&str> = self.markers.iter().map(|marker| &marker.branch[..]).collect();
        names.dedup();
        names.into_iter()
    }
}
