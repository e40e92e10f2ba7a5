//! `[rod]`: shape, section and mesh.

use crate::error::Error;
use crate::numerics::scalar::Scalar;
use crate::scene::along::Along;
use crate::scene::mass::PointMass;
use crate::scene::number::{Candidates, Numbers, Quantity, Written};
use crate::scene::section::Section;
use crate::scene::shape::Shape;
use crate::scene::taper::Taper;
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;

/// Fewest and most edges of a rod.
const SEGMENTS: std::ops::RangeInclusive<usize> = 2..=10_000_000;

/// `[rod]`: shape, section and mesh of the rod.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[cfg_attr(test, schemars(bound = "D: Written + schemars::JsonSchema"))]
#[serde(deny_unknown_fields, bound = "D: Written")]
pub struct RodSpec<D = f64> {
    /// Number of edges, 2 to 1e7; default: that of a polyline, otherwise chosen by the program.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub segments: Option<usize>,
    /// Shape of the rod without loads.
    pub shape: Shape<D>,
    /// Cross-section of the rod.
    pub section: Section<D>,
    /// Factors along the rod on section and material.
    #[serde(default, skip_serializing_if = "Taper::is_none")]
    pub taper: Taper<D>,
    /// Factor on the curvature of the rest shape that gives the stress-free curvature, or a list of
    /// factors along the rod; no effect on a straight rest shape.
    #[serde(default = "one::<D>")]
    pub natural_curvature: Along<D>,
    /// Stress-free twist per length, rad/m, or a list along the rod.
    #[serde(default = "zero::<D>", skip_serializing_if = "is_zero")]
    pub natural_twist: Along<D>,
    /// Additional stress-free curvature along both material directors, 1/m: pairs at equally spaced
    /// edges from the first node to the last, linear between them; spatial rods only.
    #[serde(
        deserialize_with = "crate::input::arrays::rows",
        default,
        skip_serializing_if = "Vec::is_empty"
    )]
    pub natural_bending: Vec<[D; 2]>,
    /// Point masses on the rod.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub mass: Vec<PointMass<D>>,
    /// Planar or spatial model.
    #[serde(default)]
    pub dimension: Dimension,
    /// Constants of the elements; default: `corrected`, and `paper` with walls at the nodes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub discretization: Option<Discretization>,
}

fn one<D: From<f64>>() -> Along<D> {
    Along::Whole(D::from(1.0))
}

fn zero<D: From<f64>>() -> Along<D> {
    Along::Whole(D::from(0.0))
}

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
    /// Chords and plain stiffnesses, as in the paper; a curved rod is too stiff.
    Paper,
    /// Arc lengths, stiffnesses that make up for the polygon, and sums that end at walls in the
    /// middle of an edge: see [`crate::problem::model`].
    Corrected,
    /// As `corrected`, with corrected joints at the walls of straight rods: more accurate sags,
    /// less accurate frequencies.
    CorrectedStatics,
}

impl<D: Scalar> RodSpec<D> {
    /// The curvature beside that of the shape at node `i` of `segments` edges, 1/m.
    pub(crate) fn bending_at(&self, i: usize, segments: usize) -> [D; 2] {
        let Some([(before, a), (after, b)]) = self.bending_shares(i, segments) else {
            return [D::from(0.0); 2];
        };
        let both = [self.natural_bending[before], self.natural_bending[after]];
        [0, 1].map(|c| both[0][c] * a + both[1][c] * b)
    }

    /// The pairs it is made of, with their weights; none without any.
    pub(crate) fn bending_shares(&self, i: usize, segments: usize) -> Option<[(usize, f64); 2]> {
        let last = self.natural_bending.len().checked_sub(1)?;
        let place = (i * last) as f64 / segments as f64;
        let before = (place as usize).min(last);
        let part = place - before as f64;
        Some([(before, 1.0 - part), ((before + 1).min(last), part)])
    }
}

impl RodSpec {
    /// Whether the rod is free of stress in its rest shape.
    pub(crate) fn is_unstressed(&self) -> bool {
        self.natural_curvature == one()
            && is_zero(&self.natural_twist)
            && self.natural_bending.is_empty()
    }

    pub(super) fn over<D>(&self, n: &mut Numbers<'_, D>) -> RodSpec<D> {
        let factor = Quantity::signed("").within(-1e3, 1e3);
        let twist = Quantity::signed("rad/m").within(-1e6, 1e6);
        let bending = Quantity::signed("1/m").within(-1e6, 1e6);
        let factors = [factor.searched(Candidates::Values(&[0.5, 1.0, 1.5])), factor];
        let twists = [twist.searched(Candidates::PerLength(&[-2.0, 0.0, 2.0])), twist];
        RodSpec {
            segments: self.segments,
            shape: n.table("shape", |n| self.shape.over(n)),
            section: n.table("section", |n| self.section.over(n)),
            taper: n.table("taper", |n| self.taper.over(n)),
            natural_curvature: self.natural_curvature.over("natural_curvature", factors, n),
            natural_twist: self.natural_twist.over("natural_twist", twists, n),
            natural_bending: n.list("natural_bending", &self.natural_bending, |pair, n| {
                let [first, second] = *pair;
                [n.number("d1", first, bending), n.number("d2", second, bending)]
            }),
            mass: n.list("mass", &self.mass, PointMass::over),
            dimension: self.dimension,
            discretization: self.discretization,
        }
    }

    /// A rod of so many edges, free of stress in its shape.
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

    /// Refuses what makes no sense.
    pub(super) fn check(&self) -> Result<(), Error> {
        self.shape.check("rod.shape")?;
        self.section.check()?;
        match (&self.shape, self.segments) {
            (_, None) => {}
            (_, Some(n)) if !SEGMENTS.contains(&n) => {
                return Err(Error::invalid("rod.segments", n, "2 .. 1e7"));
            }
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
        self.natural_curvature.check("rod.natural_curvature")?;
        self.natural_twist.check("rod.natural_twist")?;
        if !self.natural_bending.iter().flatten().all(|k| k.is_finite()) {
            let found = format!("{:?}", self.natural_bending);
            return Err(Error::invalid("rod.natural_bending", found, "finite numbers, 1/m"));
        }
        let mut masses = self.mass.iter().enumerate();
        masses.try_for_each(|(k, mass)| mass.check(&format!("rod.mass[{k}]")))
    }
}
