//! `[rod]`: shape, section, taper, masses, natural curvature, bending and twist, and mesh of the rod, with the
//! validation of these keys.
//!
//! [`RodSpec`] is the table. Numbers of edges are 2 to 1e7; without one it is that of a polyline, or the program
//! chooses it. A mesh of an arc or helix must have so many edges that they turn by less than half a turn on average.
//!
//! Natural curvature is a factor on the curvature of the rest shape, natural twist is in rad/m. Each is one number, or
//! a list or function along the rod. Natural bending, 1/m, is a list of pairs (one number for each director) at equally
//! spaced places from end to end, linear between them, for spatial rods only. The rest shape is free of stress if the
//! curvature factor is the single number 1, the natural twist the single number 0, and there is no natural bending.
//!
//! `check` rejects invalid shapes, sections, numbers and meshes. Tapers and the places of masses are checked with the
//! scene.

use crate::error::{Error, ensure};
use crate::numerics::scalar::Scalar;
use crate::scene::along::Along;
use crate::scene::mass::PointMass;
use crate::scene::number::{Candidates, Quantity};
use crate::scene::section::Section;
use crate::scene::shape::Shape;
use crate::scene::table::{NumberTree, TABLE, table};
use crate::scene::taper::Taper;
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;

/// Allowed numbers of edges.
const SEGMENTS: std::ops::RangeInclusive<usize> = 2..=10_000_000;

/// Quantities of the factor on the curvature of the rest shape: of the whole rod, and of a part of it.
pub(super) const CURVATURE_FACTOR: [Quantity; 2] = {
    let factor = Quantity::signed("").within(-1e3, 1e3);
    [factor.searched(Candidates::Values(&[0.5, 1.0, 1.5])), factor]
};
/// Quantities of the twist per length, rad/m: of the whole rod, and of a part of it.
const TWIST: [Quantity; 2] = {
    let twist = Quantity::signed("rad/m").within(-1e6, 1e6);
    [twist.searched(Candidates::PerLength(&[-2.0, 0.0, 2.0])), twist]
};

table! {
    /// `[rod]`: shape, section and mesh of the rod.
    pub struct RodSpec {
        /// Number of edges, 2 to 1e7; default: that of a polyline, otherwise chosen by the program.
        #[serde(skip_serializing_if = "Option::is_none")]
        pub segments: Option<usize>,
        /// Shape of the rod without loads.
        pub shape: Shape<D> = TABLE,
        /// Cross-section of the rod.
        pub section: Section<D> = TABLE,
        /// Factors along the rod on section and material.
        #[serde(default, skip_serializing_if = "Taper::is_none")]
        pub taper: Taper<D> = TABLE,
        /// Factor on the curvature of the rest shape that gives the stress-free curvature, or a list of
        /// factors along the rod; no effect on a straight rest shape.
        #[serde(default = "one::<D>")]
        pub natural_curvature: Along<D> = CURVATURE_FACTOR,
        /// Stress-free twist per length, rad/m, or a list along the rod.
        #[serde(default = "zero::<D>", skip_serializing_if = "is_zero")]
        pub natural_twist: Along<D> = TWIST,
        /// Additional stress-free curvature along both material directors, 1/m: pairs at equally spaced
        /// edges from end to end, linear between them; spatial rods only.
        #[serde(
            deserialize_with = "crate::input::arrays::rows",
            default,
            skip_serializing_if = "Vec::is_empty"
        )]
        pub natural_bending: Vec<[D; 2]> = Quantity::signed("1/m").within(-1e6, 1e6),
        /// Point masses on the rod.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        pub mass: Vec<PointMass<D>> = TABLE,
        /// Planar or spatial model.
        #[serde(default)]
        pub dimension: Dimension,
        /// Constants of the elements; default: `corrected`, and `paper` with walls at the nodes.
        #[serde(skip_serializing_if = "Option::is_none")]
        pub discretization: Option<Discretization>,
    }
}

/// The number 1, constant along the whole rod: the default factor on the curvature.
pub(super) fn one<D: From<f64>>() -> Along<D> {
    Along::Whole(D::from(1.0))
}

/// The number 0, constant along the whole rod: the default natural twist.
fn zero<D: From<f64>>() -> Along<D> {
    Along::Whole(D::from(0.0))
}

/// Whether a value is 0 along the whole rod, given as one number, and not as a list or linear function.
fn is_zero<D: From<f64> + PartialEq>(along: &Along<D>) -> bool {
    *along == zero()
}

/// Planar or spatial model.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum Dimension {
    /// The planar model wherever it can represent the scene.
    #[default]
    Auto,
    /// Stretch and bend in one plane.
    Planar,
    /// Stretch, bend and twist in space.
    Spatial,
}

/// Constants of the discrete elements.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum Discretization {
    /// Edges as chords of a curved rod, with the stiffnesses of the arc, as in the paper: a curved rod is too stiff.
    Paper,
    /// Edges with the arc lengths of a curved rod, stiffnesses corrected for the polygon, and clamps in the middle of
    /// an edge.
    Corrected,
    /// As `corrected`, with corrected joints at the clamps of straight rods: more accurate deflections,
    /// less accurate frequencies.
    CorrectedStatics,
}

impl<D: Scalar> RodSpec<D> {
    /// Additional natural curvature about both directors at node `i`, 1/m: linear between the two pairs of
    /// `natural_bending` around the node, and zero without pairs. `places` are the arc lengths of the nodes of the mesh
    /// as fractions of the rod length.
    pub(crate) fn bending_at(&self, i: usize, places: &[f64]) -> [D; 2] {
        let Some([(before, a), (after, b)]) = self.bending_shares(i, places) else {
            return [D::from(0.0); 2];
        };
        let both = [self.natural_bending[before], self.natural_bending[after]];
        [0, 1].map(|c| both[0][c] * a + both[1][c] * b)
    }

    /// Indices and weights of the two pairs of `natural_bending` around node `i`. `places` are the arc lengths of the
    /// nodes of the mesh, at least two, as fractions of the rod length. Pairs are equally spaced in the number of edges
    /// from wall or end to wall or end; the parts of outermost edges behind walls do not count. Beyond an end the
    /// outermost pair has the weight 1. None without pairs.
    pub(crate) fn bending_shares(&self, i: usize, places: &[f64]) -> Option<[(usize, f64); 2]> {
        let last = self.natural_bending.len().checked_sub(1)?;
        let edges = places.len() - 1;
        let before_start = -places[0] / (places[1] - places[0]);
        let behind_end = (places[edges] - 1.0) / (places[edges] - places[edges - 1]);
        let along = (i as f64 - before_start) / (edges as f64 - before_start - behind_end);
        let place = along.clamp(0.0, 1.0) * last as f64;
        let before = (place as usize).min(last);
        let part = place - before as f64;
        Some([(before, 1.0 - part), ((before + 1).min(last), part)])
    }
}

/// Largest difference of the last arc length of a list from the length of the rod, over that length. Lengths are often
/// given with three digits.
const END_TOLERANCE: f64 = 5e-3;

/// Rejects values at arc lengths whose last one differs from the `length` of the rod, m, by more than
/// [`END_TOLERANCE`] of it. Values in other forms are accepted. `key` is that of the values, for the error.
pub(super) fn check_end(key: &str, along: &Along, length: f64) -> Result<(), Error> {
    let Some(last) = along.last_arc_length() else { return Ok(()) };
    let found = format!("{last} m as the last arc length");
    let allowed = format!("{length} m, the length of the rod");
    let ends_with_rod = (last - length).abs() <= END_TOLERANCE * length;
    ensure(ends_with_rod, format!("{key}.at"), found, allowed)
}

impl RodSpec {
    /// Whether curvature factor and natural twist are the single numbers 1 and 0 and there is no natural bending, so
    /// that the rest shape is free of stress. False for lists and linear functions, also with these values.
    pub(crate) fn is_unstressed(&self) -> bool {
        self.natural_curvature == one()
            && is_zero(&self.natural_twist)
            && self.natural_bending.is_empty()
    }

    /// Values along the rod with their keys below `[rod]`: `natural_curvature` and `natural_twist`, given or by
    /// default, then the given factors `taper.<key>`. `natural_bending` is left out.
    fn lists(&self) -> impl Iterator<Item = (String, &Along)> {
        let natural = [
            ("natural_curvature".to_string(), &self.natural_curvature),
            ("natural_twist".to_string(), &self.natural_twist),
        ];
        let factors = self.taper.factors();
        natural.into_iter().chain(factors.map(|(key, along)| (format!("taper.{key}"), along)))
    }

    /// Rejects values at arc lengths that do not end with the rod ([`check_end`]). `table` is the path of the rod, for
    /// the error.
    pub(super) fn check_ends_of_lists(&self, table: &str) -> Result<(), Error> {
        let length = self.shape.curve_length();
        self.lists()
            .try_for_each(|(key, along)| check_end(&format!("{table}.{key}"), along, length))
    }

    /// Scales the arc lengths of all values that are given at arc lengths, so that the last one is the present length
    /// of the rod.
    pub(super) fn end_lists_with_rod(&mut self) {
        let length = self.shape.curve_length();
        let factors = self.taper.factors_mut();
        for along in factors.chain([&mut self.natural_curvature, &mut self.natural_twist]) {
            along.end_at(length);
        }
    }

    /// A rod with `segments` edges, free of stress in its shape, with neither taper nor masses; discretization and
    /// dimension are the defaults.
    pub(super) fn new(segments: usize, shape: Shape, section: Section) -> Self {
        Self {
            segments: Some(segments),
            shape,
            section,
            taper: Taper::default(),
            natural_curvature: one(),
            natural_twist: zero(),
            natural_bending: Vec::new(),
            mass: Vec::new(),
            dimension: Dimension::Auto,
            discretization: None,
        }
    }

    /// Rejects invalid numbers, shapes and sections, and numbers of edges outside [`SEGMENTS`]. Also rejected is a mesh
    /// of an arc or helix whose edges turn by half a turn or more on average.
    pub(super) fn check(&self) -> Result<(), Error> {
        self.shape.check("rod.shape")?;
        self.section.check()?;
        match (&self.shape, self.segments) {
            (_, None) => {}
            (_, Some(n)) if !SEGMENTS.contains(&n) => {
                return Err(Error::invalid("rod.segments", n, "2 .. 1e7"));
            }
            // Edges that turn by half a turn or more are those of another curve with less turning.
            (shape, Some(n)) if shape.turning().is_some_and(|turn| turn >= PI * n as f64) => {
                let turning = shape.turning().unwrap_or_default();
                let allowed = format!(
                    "more than {:.3e}: the shape turns by {turning:.3e} rad, and an edge by less than half a turn",
                    turning / PI
                );
                return Err(Error::invalid("rod.segments", n, allowed));
            }
            _ => {}
        }
        if !self.natural_bending.iter().flatten().all(|k| k.is_finite()) {
            let found = format!("{:?}", self.natural_bending);
            return Err(Error::invalid("rod.natural_bending", found, "finite numbers, 1/m"));
        }
        self.check_numbers("rod", TABLE)
    }
}
