//! `[supports.path]`: recording of markers that drives ends of the rod, and nodes between them.
//!
//! [`Recorded`] reads the file, examines it for defects, corrects these on request, and assigns markers to nodes. M
//! markers, from the start of the rod to its end, divide it into M - 1 parts with equally many edges. Each marker is at
//! a node, so that the number of edges must be a multiple of M - 1. A recorded end holds its outermost `held` markers,
//! with the nodes between them on chords. The positions of `inner` markers are prescribed too. All other markers are
//! observations (`free_markers`).
//!
//! Output: the nodes that an end holds and those at inner markers, each with two markers and the fraction of the chord
//! between them ([`RecordedNode`]). Rejected are settings that contradict the supports or leave no free node, and
//! `inner` names that are no markers between the held nodes. Before the recording is read, lists of nodes and markers
//! are empty, and functions that need it return an error.

use crate::error::Error;
use crate::scene::faults::{LostFrames, SwappedLabels};
use crate::scene::number::is_default;
use crate::scene::support::{End, Support};
use crate::scene::track::Track;
use marker_files::Axes;
use marker_files::ColumnRules;
use marker_files::Format;
use marker_files::is_same_name;
use marker_files::{Recording, Vertical};
use serde::{Deserialize, Serialize};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// `[supports.path]`: a recording of markers along the rod. The outermost markers drive recorded
/// ends. An end follows the twist-free (parallel-transported) frame, or rotates freely about the
/// rod. Markers are in the order of the columns, from the start of the rod to its end, with equally
/// many edges between neighbors.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Recorded {
    /// Recording: a CSV file with a clock `t` and columns `xA, yA, zA` for every marker `A`, or a file of another
    /// [program](Format), relative to the scene file.
    pub file: PathBuf,
    /// Names of the markers from the start of the rod to its end; default: all in the order of the
    /// file.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub markers: Vec<String>,
    /// Program that wrote the file; default: determined from the first bytes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub format: Option<Format>,
    /// Columns of a table by name or number, where the header has other names or is missing.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub columns: Option<ColumnRules>,
    /// Confidence below which positions are treated as missing.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub likelihood: Option<f64>,
    /// Axes of the file that are the world's x, y and z.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub axes: Option<Axes>,
    /// Frames per second, Hz, for files with frame numbers only.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fps: Option<f64>,
    /// Meters per pixel, or per length unit where the file states none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scale: Option<f64>,
    /// Direction of the file's y axis.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub y: Option<Vertical>,
    /// Time on the file's own clock, in its unit, at which the motion starts.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub time_zero: Option<f64>,
    /// Number of markers held at each recorded end; nodes between them stay on the chords.
    #[serde(default = "two")]
    pub held: usize,
    /// Names of markers between the ends whose positions are prescribed too.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub inner: Vec<String>,
    /// Recorded ends that rotate freely about the rod.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub free_twist: Vec<End>,
    /// Treatment of lost frames.
    #[serde(default, skip_serializing_if = "is_default")]
    pub lost_frames: LostFrames,
    /// Treatment of exchanged labels of neighboring markers.
    #[serde(default, skip_serializing_if = "is_default")]
    pub swapped_labels: SwappedLabels,
    /// The recording, once it is read.
    #[serde(skip)]
    pub track: Option<Arc<Track>>,
}

/// The number 2, the default number of held markers at a recorded end.
fn two() -> usize {
    2
}

impl Recorded {
    /// Recording of a file, which is not read yet, with default settings: all markers, no corrections, two held at each
    /// recorded end.
    pub fn new(file: impl Into<PathBuf>) -> Self {
        Self {
            file: file.into(),
            markers: Vec::new(),
            format: None,
            columns: None,
            likelihood: None,
            axes: None,
            fps: None,
            scale: None,
            y: None,
            time_zero: None,
            held: two(),
            inner: Vec::new(),
            free_twist: Vec::new(),
            lost_frames: LostFrames::Keep,
            swapped_labels: SwappedLabels::Keep,
            track: None,
        }
    }

    /// Recording that is given as a track instead of a file, with the settings of [`new`](Self::new).
    pub fn of(track: Track) -> Self {
        Self { track: Some(track.into()), ..Self::new("") }
    }

    /// Reads the recording from its file, relative to `folder`, unless there is a track. A track that has not been
    /// examined is then searched for defects in the markers that drive the rod, which are corrected as the settings
    /// request; its bandwidth is computed. `ends` are the supports at start and end, which determine these markers. An
    /// error for a file that cannot be read.
    pub(crate) fn read(&mut self, folder: &Path, ends: [Support; 2]) -> Result<(), Error> {
        // A scene made in code has its track; a file is read once.
        let track = match self.track.take() {
            Some(track) => track,
            None => {
                let file = marker_files::file::at(folder, &self.file);
                Arc::new(Track::read_as(&file, &self.recording(), &self.markers)?)
            }
        };
        self.track = Some(track.clone());
        if !track.is_examined() {
            // Only markers that drive a support are corrected; the others are observations.
            let free = self.free_markers(ends);
            let held: Vec<usize> =
                (0..track.markers().len()).filter(|j| !free.contains(j)).collect();
            let examined = track.examined(&held, self.lost_frames, self.swapped_labels);
            self.track = Some(examined.with_motion_defects(&held).into());
        }
        Ok(())
    }

    /// Settings of the file (format, columns, confidence, axes, frame rate, scale, direction of y, start time) for the
    /// reader `marker_files`.
    fn recording(&self) -> Recording {
        let Self { format, likelihood, axes, fps, scale, y, time_zero, .. } = *self;
        let columns = self.columns.clone();
        Recording {
            format,
            columns,
            likelihood,
            axes,
            fps,
            scale,
            y,
            time_zero,
            ..Recording::default()
        }
    }

    /// The track of the recording: the positions of its markers.
    ///
    /// # Errors
    /// A recording that has not been read.
    pub(crate) fn track(&self) -> Result<&Track, Error> {
        self.track.as_deref().ok_or_else(|| {
            let found = format!("{}, which has not been read", self.file.display());
            Error::invalid(
                "supports.path.file",
                found,
                "the recording of a loaded scene or of a \
                            problem",
            )
        })
    }

    /// Number of parts into which the markers divide the rod: their number minus one, at least 1; 1 before the
    /// recording is read.
    pub(crate) fn spans(&self) -> usize {
        self.track.as_ref().map_or(1, |track| track.markers().len().max(2) - 1)
    }

    /// Index of the node at every marker, in order from the start, on a mesh with `segments` edges: marker j of M is at
    /// node `j segments/(M - 1)`.
    ///
    /// # Errors
    /// A number of edges that is not a multiple of the number of parts between markers, fewer than two markers, or a
    /// recording that has not been read.
    pub(crate) fn nodes(&self, segments: usize) -> Result<Vec<usize>, Error> {
        let markers = self.track()?.markers().len();
        let spans = markers.saturating_sub(1);
        // Markers must be at nodes: an interpolated marker would prescribe two nodes at once.
        if spans == 0 || !segments.is_multiple_of(spans) {
            let found = format!("{segments} segments with {markers} markers along the rod");
            let allowed = format!("a multiple of {spans}, so that all markers are at nodes");
            return Err(Error::invalid("rod.segments", found, allowed));
        }
        Ok((0..markers).map(|j| j * (segments / spans)).collect())
    }

    /// Indices, ascending, of the markers that neither a recorded end holds, with these supports at start and end, nor
    /// `inner` names: they are observations. Empty before the recording is read.
    pub(crate) fn free_markers(&self, supports: [Support; 2]) -> Vec<usize> {
        let inner = self.inner_markers();
        self.between_ends(supports).filter(|j| !inner.contains(j)).collect()
    }

    /// Range of the indices of the markers that no recorded end holds: all but the outermost `held` ones at each such
    /// end; other supports hold none. Empty before the recording is read, and if the ends hold all markers.
    fn between_ends(&self, [start, end]: [Support; 2]) -> Range<usize> {
        let markers = self.track.as_ref().map_or(0, |track| track.markers().len());
        // Held markers are outermost at each recorded end.
        let held = |end| if end == Support::Recorded { self.held.min(markers) } else { 0 };
        held(start)..markers.saturating_sub(held(end))
    }

    /// Indices, ascending, of the markers named in `inner`, which drive the rod between the ends. Empty before the
    /// recording is read.
    fn inner_markers(&self) -> Vec<usize> {
        let markers = self.track.as_ref().map_or(&[][..], |track| track.markers());
        let is_inner =
            |j: &usize| self.inner.iter().any(|name| is_same_name(&markers[*j].name, name));
        (0..markers.len()).filter(is_inner).collect()
    }

    /// Number of nodes that a recorded end holds, on a mesh with `segments` edges: those at its `held` markers and
    /// between them, `(held - 1) segments/spans + 1`. At least one.
    pub(crate) fn held_nodes(&self, segments: usize) -> usize {
        (self.held.max(1) - 1).saturating_mul(segments / self.spans()).saturating_add(1)
    }

    /// Rejects a recording without use (neither a recorded end nor inner markers), free twist of an end that is not
    /// recorded, and a number of held markers of zero. The arguments are the supports at start and end.
    pub(super) fn check(&self, [start, end]: [Support; 2]) -> Result<(), Error> {
        let recorded = [start, end].into_iter().filter(|s| *s == Support::Recorded).count();
        if recorded == 0 && self.inner.is_empty() {
            let found = "a recording that prescribes no motion";
            let allowed = "only with start or end = \"recorded\", or with inner markers that prescribe the motion";
            return Err(Error::invalid("supports.path", found, allowed));
        }
        for (end, name, support) in [(End::Start, "start", start), (End::End, "end", end)] {
            if self.free_twist.contains(&end) && support != Support::Recorded {
                let found = format!("{name:?}, whose motion is not recorded");
                let allowed = "ends that are \"recorded\"";
                return Err(Error::invalid("supports.path.free_twist", found, allowed));
            }
        }
        if self.held == 0 {
            return Err(Error::invalid("supports.path.held", 0, "1 or more markers"));
        }
        Ok(())
    }

    /// Rejects a mesh with `segments` edges on which markers are not at nodes, or on which recorded ends hold all
    /// nodes. Rejects `inner` names that are no markers between the nodes that these supports hold: those at held
    /// markers of a recorded end, two of a clamp, one of a hinge or roller. Together with these nodes, inner markers
    /// must leave at least one node free.
    pub(crate) fn check_nodes(&self, supports: [Support; 2], segments: usize) -> Result<(), Error> {
        let nodes = self.nodes(segments)?;
        let ends = supports.into_iter().filter(|support| *support == Support::Recorded).count();
        let held = ends.saturating_mul(self.held_nodes(segments));
        // At least one node must remain free, or there is nothing to simulate.
        if held > segments {
            let found = format!("{} at {ends} ends, {held} of {} nodes", self.held, segments + 1);
            let allowed = "fewer markers, so that at least one node is free";
            return Err(Error::invalid("supports.path.held", found, allowed));
        }
        if self.inner.is_empty() {
            return Ok(());
        }
        // Other supports hold up to two nodes.
        let [first, last] = supports.map(|support| match support {
            Support::Recorded => self.held_nodes(segments),
            Support::Clamped => 2,
            Support::Pinned | Support::Roller => 1,
            Support::Free => 0,
        });
        let markers = self.track()?.markers();
        let between: Vec<&str> = (nodes.iter().zip(markers))
            .filter(|(node, _)| **node >= first && **node + last <= segments)
            .map(|(_, marker)| &*marker.name)
            .collect();
        let is_between = |name: &&String| between.iter().any(|marker| is_same_name(marker, name));
        if let Some(name) = self.inner.iter().find(|name| !is_between(name)) {
            let found = format!("{name:?}, which is not a marker between the supports");
            let allowed = format!("some of {between:?}");
            return Err(Error::invalid("supports.path.inner", found, allowed));
        }
        if first + last + self.inner_markers().len() > segments {
            let found = format!("{:?}, which leaves no node free", self.inner);
            return Err(Error::invalid(
                "supports.path.inner",
                found,
                "fewer markers, or a finer \
                                       mesh",
            ));
        }
        Ok(())
    }

    /// Nodes at the inner markers, in order from the start, on a mesh with `segments` edges. Each has its marker twice,
    /// with the fraction 0. Empty if the markers are not at nodes, or before the recording is read.
    pub(crate) fn inner_nodes(&self, segments: usize) -> Vec<RecordedNode> {
        let nodes = self.nodes(segments).unwrap_or_default();
        let node =
            |j: usize| Some(RecordedNode { node: *nodes.get(j)?, markers: [j, j], part: 0.0 });
        self.inner_markers().into_iter().filter_map(node).collect()
    }

    /// Nodes that a recorded end holds, from the end inwards, on a mesh with `segments` edges that
    /// [`check_nodes`](Self::check_nodes) accepts. Each has the marker next to it towards this end, the next marker
    /// inwards, and the fraction of the chord from the first to the second, 0 at a marker. Empty before the recording
    /// is read.
    pub(crate) fn end_nodes(&self, end: End, segments: usize) -> Vec<RecordedNode> {
        let Some(track) = &self.track else { return Vec::new() };
        let last = track.markers().len() - 1;
        let edges = segments / last;
        let node = |k: usize| {
            // Nodes between two held markers lie on the chord between them.
            let (marker, part) = (k / edges, (k % edges) as f64 / edges as f64);
            let markers = [marker, (marker + 1).min(last)];
            match end {
                End::Start => RecordedNode { node: k, markers, part },
                End::End => {
                    RecordedNode { node: segments - k, markers: markers.map(|j| last - j), part }
                }
            }
        };
        (0..self.held_nodes(segments)).map(node).collect()
    }
}

/// Node whose position is prescribed by recorded markers: `(1 - part) a + part b` with the positions a and b of two
/// markers.
#[derive(Clone, Debug)]
pub struct RecordedNode {
    /// Index of the node.
    pub node: usize,
    /// Indices of the two markers.
    pub markers: [usize; 2],
    /// Fraction `part` of the chord from the first marker to the second, from 0 to below 1.
    pub part: f64,
}
