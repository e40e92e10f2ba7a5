//! Channels of sensors that are fixed to a point of the rod: acceleration along an axis of the rod, angle of its
//! tangent, curvature, or strain.
//!
//! Input: a [`PointChannel`], and the recorded motion of the nodes and director axes around its point. Output: the
//! component at every recorded time, m/s^2, rad, 1/m or part of the length, with derivatives. Acceleration
//! (`point_acceleration`) is that of the point less gravity, along an axis fixed to the rod: numbers along tangent,
//! first and second director. The angle (`point_angle`) is that of the tangent about an axis fixed in the world.
//! Curvature (`point_strain`) is that of the axis along a direction across the rod, fixed to it. Strain is that of the
//! rod parallel to its axis at an offset across it: the strain of the axis less the product of offset and bending.
//!
//! `values` returns the component, `require` adds its point to the outputs that a simulation records. `check` rejects a
//! point outside the rod, acceleration at rest, an angle about an axis in the plane of a planar motion, a curvature
//! across this plane, and a direction of curvature or offset of a strain that is not across the rod. `rotated` turns
//! the axes by a rotation vector, rad.

use crate::dynamics::record::RecordView;
use crate::error::{Error, ensure};
use crate::fit::measurement::point_acceleration::accelerations;
use crate::fit::measurement::point_angle::angles;
use crate::fit::measurement::point_strain::PointStrain;
use crate::fit::measurement::simulated::{Requirements, SimulatedOutput};
use crate::numerics::scalar::Scalar;
use crate::numerics::vector::{cross, dot, rotate};
use crate::problem::Problem;
use crate::scene::{Point, Section};

/// Smallest component along the normal of a planar motion of the axis of an angle, and smallest component in the plane
/// of the direction of a curvature: below it they are not defined.
const LEAST_NORMAL: f64 = 0.1;

/// Largest component along the tangent of a direction across the rod, over its length: rounding errors only.
const ALONG_ROD: f64 = 1e-9;

/// Largest distance of a strain gauge from the axis, over that of the surface: the rest is for adhesive, coating and an
/// inexact radius.
const BEYOND_SURFACE: f64 = 1.5;

/// Quantity of a sensor that is fixed to a point of the rod.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PointQuantity {
    /// Acceleration less gravity, m/s^2.
    Acceleration {
        /// Axis of the sensor, 0 to 2 for x, y and z: the name of the component.
        axis: usize,
        /// Direction of this axis, a unit vector along tangent, first and second director of the rod.
        direction: [f64; 3],
    },
    /// Angle of the tangent, rad, from the direction `from` about the axis `about`.
    Angle {
        /// Direction in the world of the angle zero, a unit vector.
        from: [f64; 3],
        /// Axis of the angle in the world, a unit vector normal to `from`.
        about: [f64; 3],
    },
    /// Curvature, 1/m.
    Curvature {
        /// Number of the component, 0 or 1 for `k1` and `k2`: its name.
        axis: usize,
        /// Direction towards which a positive curvature bends the rod, a unit vector along tangent, first and second
        /// director of the rod, without a component along the tangent.
        direction: [f64; 3],
    },
    /// Strain parallel to the axis of the rod, as a part of the length.
    Strain {
        /// Position of the sensor relative to the axis, m, along tangent, first and second director of the rod, without
        /// a component along the tangent.
        offset: [f64; 3],
    },
}

/// A quantity of a point of the rod.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointChannel {
    /// The point.
    pub point: Point,
    /// The measured quantity.
    pub quantity: PointQuantity,
}

/// Largest accepted distance of a strain gauge from the axis, m: [`BEYOND_SURFACE`] times the largest outer radius of
/// the rod (half the diagonal of a rectangle), or the length of a rod whose section has no known outline.
fn farthest_gauge(problem: &Problem) -> f64 {
    let outer = |place: &f64| match problem.scene().at(*place).0 {
        Section::Circle { radius } | Section::Tube { radius, .. } => radius,
        Section::Rectangle { width, height, .. } => 0.5 * width.hypot(height),
        Section::Custom { .. } => f64::INFINITY,
    };
    let outer = problem.scene().rod.taper.breaks().iter().map(outer).fold(0.0, f64::max);
    (BEYOND_SURFACE * outer).min(problem.length())
}

impl PointChannel {
    /// The channel of the angle of the tangent at a `point`, rad, counted from the world's x axis to its y axis, about
    /// z.
    pub fn angle(point: Point) -> Self {
        let quantity = PointQuantity::Angle { from: [1.0, 0.0, 0.0], about: [0.0, 0.0, 1.0] };
        Self { point, quantity }
    }

    /// The channel of the acceleration less gravity, m/s^2, of a `point` along an `axis` of the rod: 0 is the tangent,
    /// 1 and 2 are the first and second director.
    pub fn acceleration(point: Point, axis: usize) -> Self {
        Self { point, quantity: PointQuantity::Acceleration { axis, direction: unit_axis(axis) } }
    }

    /// The channel of the curvature at a `point`, 1/m, along the material director number `axis`, 0 or 1. It is
    /// positive if the rod bends towards the director.
    pub fn curvature(point: Point, axis: usize) -> Self {
        Self { point, quantity: PointQuantity::Curvature { axis, direction: unit_axis(axis + 1) } }
    }

    /// The channel of the strain parallel to the axis at a `point`, at the `offset`, m, along both material directors
    /// from the axis, relative to the rod without stress. It is positive where the rod is longer.
    ///
    /// ```
    /// use rodfit::{Point, fit::PointChannel};
    /// // A strain gauge on the upper face of a strip of 4 mm that lies along x.
    /// let gauge = PointChannel::strain(Point::ArcLength(0.02), [2e-3, 0.0]); // m
    /// assert_eq!(gauge.name(), "strain");
    /// ```
    pub fn strain(point: Point, [first, second]: [f64; 2]) -> Self {
        Self { point, quantity: PointQuantity::Strain { offset: [0.0, first, second] } }
    }

    /// The channel with its axes turned by the rotation vector `rotation`, rad: in the world for an angle, else in axes
    /// of the rod. Those of curvature and strain turn about the tangent only; other rotations are rejected by a fit.
    pub fn rotated(self, rotation: [f64; 3]) -> Self {
        let quantity = match self.quantity {
            PointQuantity::Acceleration { axis, direction } => {
                PointQuantity::Acceleration { axis, direction: rotate(rotation, direction) }
            }
            PointQuantity::Angle { from, about } => PointQuantity::Angle {
                from: rotate(rotation, from),
                about: rotate(rotation, about),
            },
            PointQuantity::Curvature { axis, direction } => {
                PointQuantity::Curvature { axis, direction: rotate(rotation, direction) }
            }
            PointQuantity::Strain { offset } => {
                PointQuantity::Strain { offset: rotate(rotation, offset) }
            }
        };
        Self { quantity, ..self }
    }

    /// The unit vector along which the component of a vector is measured, along tangent, first and second director:
    /// that of an acceleration or curvature. None of an angle and a strain.
    pub(crate) fn direction(&self) -> Option<[f64; 3]> {
        match self.quantity {
            PointQuantity::Acceleration { direction, .. }
            | PointQuantity::Curvature { direction, .. } => Some(direction),
            PointQuantity::Angle { .. } | PointQuantity::Strain { .. } => None,
        }
    }

    /// The channel of an acceleration or curvature along another `direction`; others are unchanged.
    pub(crate) fn along(self, direction: [f64; 3]) -> Self {
        let quantity = match self.quantity {
            PointQuantity::Acceleration { axis, .. } => {
                PointQuantity::Acceleration { axis, direction }
            }
            PointQuantity::Curvature { axis, .. } => PointQuantity::Curvature { axis, direction },
            other => other,
        };
        Self { quantity, ..self }
    }

    /// Name of the component in reports: `ax`, `ay`, `az`, `angle`, `k1`, `k2`, or `strain`.
    pub fn name(&self) -> &'static str {
        match self.quantity {
            PointQuantity::Acceleration { axis, .. } => ["ax", "ay", "az"][axis.min(2)],
            PointQuantity::Angle { .. } => "angle",
            PointQuantity::Curvature { axis, .. } => ["k1", "k2"][axis.min(1)],
            PointQuantity::Strain { .. } => "strain",
        }
    }

    /// Symbol of the unit: `m/s^2` of an acceleration, `rad` of an angle, `1/m` of a curvature, empty of a strain.
    pub(crate) fn unit(&self) -> &'static str {
        match self.quantity {
            PointQuantity::Acceleration { .. } => "m/s^2",
            PointQuantity::Angle { .. } => "rad",
            PointQuantity::Curvature { .. } => "1/m",
            PointQuantity::Strain { .. } => "",
        }
    }

    /// Whether the quantity is an angle, so that values that differ by whole turns are the same.
    pub(crate) fn is_angle(&self) -> bool {
        matches!(self.quantity, PointQuantity::Angle { .. })
    }

    /// Rejects a point outside the rod, readings of acceleration at rest, an angle about an axis in the plane of a
    /// planar motion, a curvature across this plane, and a direction or offset that is not across the rod. Errors have
    /// the key of the table.
    pub(crate) fn check(
        &self,
        problem: &Problem,
        key: &str,
        is_at_rest: bool,
    ) -> Result<(), Error> {
        let outside = |error| Error::invalid(format!("{key}.point"), error, "a point of the rod");
        problem.stencil(self.point).map_err(outside)?;
        match self.quantity {
            PointQuantity::Acceleration { .. } => {
                let found = "accelerations without times";
                ensure(!is_at_rest, format!("{key}.file"), found, "readings over time")
            }
            PointQuantity::Angle { about, .. } => {
                let normal = problem.planar().map(|planar| planar.model.normal());
                let is_defined = normal.is_none_or(|n| dot(n.into(), about).abs() > LEAST_NORMAL);
                let found = "an angle about an axis in the plane of the motion";
                ensure(is_defined, format!("{key}.rotation"), found, "an axis across this plane")
            }
            PointQuantity::Curvature { direction, .. } => {
                let (key, allowed) = (format!("{key}.rotation"), "a rotation about the tangent");
                let is_across = is_across_rod(direction);
                ensure(is_across, &key, "a direction of curvature along the rod", allowed)?;
                let Some(planar) = problem.planar() else { return Ok(()) };
                let marker = problem.marker(self.point, direction).map_err(outside)?;
                let normal: [f64; 3] = planar.model.normal().into();
                let in_plane = cross(normal, planar.beside_at_rest(&marker));
                let found = "a curvature across the plane of the motion, which is zero there";
                let allowed = "the component in the plane, or rod.dimension = \"spatial\"";
                ensure(dot(in_plane, in_plane).sqrt() > LEAST_NORMAL, key, found, allowed)
            }
            PointQuantity::Strain { offset } => {
                let found = format!("{offset:?}");
                let most = farthest_gauge(problem);
                let allowed = format!(
                    "finite components in m along both directors, up to {most:.3e} m (the surface of the rod and half \
                     as much), and none along the rod"
                );
                let is_valid = is_across_rod(offset) && dot(offset, offset).sqrt() <= most;
                ensure(is_valid, format!("{key}.offset"), found, allowed)
            }
        }
    }

    /// Adds the point to the required `outputs`: for an acceleration its motion and axes, always in motion; for an
    /// angle its tangent, and for curvature and strain its strains, in motion if `moves` and at rest if `rests`.
    pub(crate) fn require(&self, moves: bool, rests: bool, outputs: &mut Requirements) {
        let [moving, resting] = match self.quantity {
            PointQuantity::Acceleration { .. } => {
                outputs.moving.push(self.point);
                outputs.beside.push(self.point);
                return;
            }
            PointQuantity::Angle { .. } => {
                [&mut outputs.moving_tangents, &mut outputs.resting_tangents]
            }
            PointQuantity::Curvature { .. } | PointQuantity::Strain { .. } => {
                [&mut outputs.moving_strains, &mut outputs.resting_strains]
            }
        };
        if moves {
            moving.push(self.point);
        }
        if rests {
            resting.push(self.point);
        }
    }

    /// The quantity, m/s^2, rad, 1/m or part of the length, one value per time of a record of the `simulated` rod.
    /// Error: a point outside the rod or not recorded, or an angle about the tangent.
    pub(crate) fn values<D: Scalar>(
        &self,
        record: &RecordView<'_, D>,
        simulated: &SimulatedOutput<D>,
    ) -> Result<Vec<D>, Error> {
        match self.quantity {
            PointQuantity::Acceleration { direction, .. } => {
                accelerations(self.point, direction, record, simulated)
            }
            PointQuantity::Angle { from, about } => {
                angles(self.point, [from, about], record, simulated)
            }
            PointQuantity::Curvature { direction: [_, first, second], .. } => {
                let strain = PointStrain::new(self.point, simulated)?;
                let along = |[k1, k2]: [D; 2]| k1 * first + k2 * second;
                let at = |k: usize| Ok(along(strain.curvature(record, k)?));
                (0..record.times().len()).map(at).collect()
            }
            PointQuantity::Strain { offset: [_, first, second] } => {
                let strain = PointStrain::new(self.point, simulated)?;
                let at = |k: usize| {
                    let [k1, k2] = strain.bending(record, k)?;
                    Ok(strain.stretch(record, k)? - (k1 * first + k2 * second))
                };
                (0..record.times().len()).map(at).collect()
            }
        }
    }
}

/// The unit vector along axis `axis` (0 to 2).
fn unit_axis(axis: usize) -> [f64; 3] {
    std::array::from_fn(|c| f64::from(u8::from(c == axis)))
}

/// Whether a vector along tangent, first and second director is finite and has no component along the tangent.
fn is_across_rod(vector: [f64; 3]) -> bool {
    let size = dot(vector, vector).sqrt();
    size.is_finite() && vector[0].abs() <= ALONG_ROD * size
}
