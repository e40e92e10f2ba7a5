//! `[[supports]]` of a structure: supports of the ends of its rods, and their validation.
//!
//! A [`StructureSupport`] names an end of a rod and its kind. A recorded one also names the two markers that it
//! follows, the number of edges between them, and whether the end rotates freely about the rod. [`check_supports`]
//! rejects recorded supports without a recording, without two markers, or with more edges between the markers than the
//! rod has, less three. Two recorded ends of a rod must leave a node free. It rejects these keys of other supports.
//! Whether the rods exist is checked elsewhere.

use crate::error::{Error, ensure};
use crate::scene::number::is_default;
use crate::scene::support::Support;
use serde::{Deserialize, Serialize};

/// An end of a rod.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
pub enum RodEnd {
    /// The end at arc length 0.
    Start,
    /// The other end.
    #[serde(alias = "tip")]
    End,
}

impl RodEnd {
    /// Index of the end: 0 for the start, 1 for the other end.
    pub fn index(self) -> usize {
        usize::from(self == Self::End)
    }
}

/// `[[supports]]`: the support of an end of a rod.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct StructureSupport {
    /// The end of a rod.
    pub of: SupportedEnd,
    /// Kind of the support: `clamped`, `pinned`, `recorded` or `free`.
    pub kind: Support,
    /// Names of the two markers that a recorded end follows, from the end inwards.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub markers: Vec<String>,
    /// Number of edges between both markers of a recorded end; nodes between them stay on the chord.
    #[serde(default = "one_edge", skip_serializing_if = "is_one_edge")]
    pub edges: usize,
    /// Whether a recorded end rotates freely about the rod. Otherwise it follows the twist-free (parallel-transported)
    /// frame.
    #[serde(default, skip_serializing_if = "is_default")]
    pub free_twist: bool,
}

/// The default number of edges between both markers of a recorded end.
fn one_edge() -> usize {
    1
}

/// Whether a number of edges is the default, which is not written to files.
fn is_one_edge(edges: &usize) -> bool {
    *edges == one_edge()
}

/// An end of a rod, `{ rod = "a", at = "start" }`.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct SupportedEnd {
    /// Name of the rod.
    pub rod: String,
    /// End of the rod.
    pub at: RodEnd,
}

/// Rejects recorded supports without a recording or without two markers, and markers, edges and free twist of other
/// supports; the first error is returned. `segments` returns the number of edges of a rod by its name, none for an
/// unknown rod. From 1 to that number less three edges (1 for an unknown rod) may be between the markers. Between those
/// of both ends of a rod there may be that number less two in all.
pub(super) fn check_supports(
    has_recording: bool,
    supports: &[StructureSupport],
    segments: impl Fn(&str) -> Option<usize>,
) -> Result<(), Error> {
    for (i, support) in supports.iter().enumerate() {
        let key = |own: &str| format!("supports[{i}].{own}");
        let StructureSupport { markers, edges, free_twist, .. } = support;
        if support.kind != Support::Recorded {
            let allowed = "with kind = \"recorded\" only";
            ensure(markers.is_empty(), key("markers"), format!("{markers:?}"), allowed)?;
            ensure(*edges == 1, key("edges"), edges, allowed)?;
            ensure(!free_twist, key("free_twist"), true, allowed)?;
            continue;
        }
        let allowed = "a table [recording] with the file of a recording";
        ensure(has_recording, "recording", "no such table", allowed)?;
        let allowed = "the names of two markers, from the end of the rod inwards";
        ensure(markers.len() == 2, key("markers"), format!("{markers:?}"), allowed)?;
        let most = segments(&support.of.rod).map_or(1, |count| count.saturating_sub(3).max(1));
        let allowed = format!("1 .. {most} edges between both markers");
        ensure((1..=most).contains(edges), key("edges"), edges, allowed)?;
        // Both recorded ends of a rod leave at least one node free.
        let other = supports[..i].iter().find(|other| {
            let is_other_end = other.of.rod == support.of.rod && other.of.at != support.of.at;
            is_other_end && other.kind == Support::Recorded
        });
        if let (Some(other), Some(count)) = (other, segments(&support.of.rod)) {
            let most = count.saturating_sub(2 + other.edges);
            let allowed = format!(
                "1 .. {most} edges between both markers, as the other end of the rod holds {}",
                other.edges
            );
            ensure(*edges <= most, key("edges"), edges, allowed)?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Ends over 4 and 4 of 10 edges hold 10 of the 11 nodes. With one edge more no node is free, and 7 and 7 edges
    /// overlap.
    #[test]
    fn recorded_ends_of_a_rod_that_hold_all_nodes_are_rejected() {
        let end = |at: RodEnd, edges: usize| StructureSupport {
            of: SupportedEnd { rod: "a".into(), at },
            kind: Support::Recorded,
            markers: vec!["m0".into(), "m1".into()],
            edges,
            free_twist: false,
        };
        let check = |start: usize, tip: usize| {
            let supports = [end(RodEnd::Start, start), end(RodEnd::End, tip)];
            check_supports(true, &supports, |_| Some(10))
        };
        assert!(check(4, 4).is_ok());
        for (start, tip) in [(5, 4), (7, 7)] {
            let error = check(start, tip).unwrap_err().to_string();
            assert!(error.contains("supports[1].edges: found"), "{error}");
        }
    }
}
