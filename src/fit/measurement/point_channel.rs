//! Channels of sensors that are fixed to a point of the rod: acceleration along an axis of the rod, angle of its
//! tangent, curvature, or strain.
//!
//! Input: a [`PointChannel`], and the recorded motion of the nodes and director axes around its point. Output: the
//! component at every recorded time, m/s^2, rad, 1/m or part of the length, with derivatives. Acceleration is that of the point less gravity, as
//! an accelerometer measures it: the derivative of the recorded velocities by a parabola through three times, of second
//! order. Its axis is fixed to the rod: numbers along tangent, first and second director. The angle is that of the
//! tangent about an axis fixed in the world. The tangent is the sum of the directions of the edges around the point,
//! with the cubic weights of a marker there. Curvature is that of the axis (`point_strain`) along a direction across the
//! rod, fixed to it. Strain is that of the rod parallel to its axis at an offset across it: the strain of the axis less
//! the product of offset and bending.
//!
//! `values` returns the component, `require` adds its point to the outputs that a simulation records. `check` rejects a
//! point outside the rod, acceleration at rest, an angle about an axis in the plane of a planar motion, and a curvature
//! across this plane. `rotated` turns the axes by a rotation vector, rad. `name`, `unit` and `is_angle` (values that differ by whole turns are
//! equal) describe the component.

use crate::dynamics::record::RecordView;
use crate::error::{Error, ensure};
use crate::fit::measurement::point_strain::PointStrain;
use crate::fit::measurement::simulated::{Requirements, SimulatedOutput};
use crate::numerics::scalar::Scalar;
use crate::numerics::vector::{combine, cross, dot, rotate, sub, unit};
use crate::problem::Problem;
use crate::scene::marker::MarkerStencil;
use crate::scene::{Point, Stencil};

/// Smallest component of the axis of an angle along the normal of a planar motion: below it the angle is not defined.
const LEAST_NORMAL: f64 = 0.1;

/// Largest component along the tangent of a direction across the rod, over its length: rounding errors only.
const ALONG_ROD: f64 = 1e-9;

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
    /// Angle of the tangent from one direction to another, rad.
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

    /// The channel of the curvature at a `point`, 1/m, along the material director number `axis`, 0 or 1. It is positive
    /// if the rod bends towards the director.
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

    /// Rejects a point outside the rod, readings of acceleration at rest, an angle about an axis in the plane of a planar
    /// motion, a curvature across this plane, and a direction or offset that is not across the rod. Errors have the key
    /// of the table.
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
                let allowed = "finite components along both directors, and none along the rod";
                ensure(is_across_rod(offset), format!("{key}.offset"), found, allowed)
            }
        }
    }

    /// Adds the point to the required `outputs`: for an acceleration its motion and axes; for an angle its tangent, and
    /// for curvature and strain its strains, in motion if `moves` and at rest if `rests`.
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

    /// The quantity, m/s^2, rad, 1/m or part of the length, at every time of a record of the `simulated` rod. Error: a point outside the rod or
    /// not recorded, or an angle about the tangent.
    pub(crate) fn values<D: Scalar>(
        &self,
        record: &RecordView<'_, D>,
        simulated: &SimulatedOutput<D>,
    ) -> Result<Vec<D>, Error> {
        match self.quantity {
            PointQuantity::Acceleration { direction, .. } => {
                self.accelerations(direction, record, simulated)
            }
            PointQuantity::Angle { from, about } => self.angles([from, about], record, simulated),
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

    /// The component of acceleration less gravity, m/s^2, at every time of a record along `direction`, which is fixed
    /// to the rod: numbers along tangent, first and second director. Error: a point outside the rod or not recorded.
    fn accelerations<D: Scalar>(
        &self,
        direction: [f64; 3],
        record: &RecordView<'_, D>,
        simulated: &SimulatedOutput<D>,
    ) -> Result<Vec<D>, Error> {
        let marker = MarkerStencil::new(self.point.fixed(), direction, simulated.mesh)?;
        let axis = MarkerStencil { centre: Stencil { nodes: Vec::new() }, ..marker.clone() };
        let times = record.times();
        let velocity = |time: &f64| Ok(record.motion(&marker.centre, *time)?[1]);
        let velocities = times.iter().map(velocity).collect::<Result<Vec<_>, Error>>()?;
        let rates = parabola_slopes(times, &velocities);
        let component = |(time, rate): (&f64, [D; 3])| {
            let along = record.marker(&axis, D::from(*time))?;
            Ok(dot(sub(rate, simulated.scene.loads.gravity), along))
        };
        times.iter().zip(rates).map(component).collect()
    }

    /// The angle of the tangent at every time of a record, rad, in (-pi, pi], from the direction `from` about the axis
    /// `about`. Error: a tangent along that axis.
    fn angles<D: Scalar>(
        &self,
        [from, about]: [[f64; 3]; 2],
        record: &RecordView<'_, D>,
        simulated: &SimulatedOutput<D>,
    ) -> Result<Vec<D>, Error> {
        let across = cross(about, from).map(D::from);
        let from = from.map(D::from);
        // The weights with which the axes of the edges around the point are summed for a marker there.
        let edges = MarkerStencil::new(self.point.fixed(), [1.0, 0.0, 0.0], simulated.mesh)?.edges;
        let node = |i: usize| Stencil { nodes: vec![(i, D::from(1.0))] };
        let ends: Vec<_> = edges.iter().map(|(e, w)| (node(*e), node(*e + 1), *w)).collect();
        let angle = |time: &f64| {
            let time = D::from(*time);
            let mut tangent = [D::from(0.0); 3];
            for (start, end, weight) in &ends {
                let edge = sub(record.position(end, time)?, record.position(start, time)?);
                tangent = combine(D::from(1.0), tangent, *weight, unit(edge));
            }
            let (sine, cosine) = (dot(tangent, across), dot(tangent, from));
            // Along the axis the angle has no derivative.
            if sine.value() == 0.0 && cosine.value() == 0.0 {
                let found = "an axis of the angle along the tangent of the rod";
                return Err(Error::invalid(
                    "observation.rotation",
                    found,
                    "an axis across the rod",
                ));
            }
            Ok(sine.atan2(cosine))
        };
        record.times().iter().map(angle).collect()
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

/// The slope at each of these times of the parabola through the values there and at both neighbours; at an end the
/// parabola is that of its neighbour. Zero for a single value.
fn parabola_slopes<D: Scalar>(times: &[f64], values: &[[D; 3]]) -> Vec<[D; 3]> {
    let last = times.len().saturating_sub(1);
    let secant = |k: usize| {
        let over = 1.0 / (times[k + 1] - times[k]);
        sub(values[k + 1], values[k]).map(|x| x * over)
    };
    let slope = |k: usize| match last {
        0 => [D::from(0.0); 3],
        1 => secant(0),
        _ => {
            let middle = k.clamp(1, last - 1);
            let [before, after] = [secant(middle - 1), secant(middle)];
            let steps = [times[middle] - times[middle - 1], times[middle + 1] - times[middle]];
            // The slope of the parabola is linear, and equal to the secants in the middle of both steps.
            let from_first = times[k] - 0.5 * (times[middle - 1] + times[middle]);
            let part = from_first / (0.5 * (steps[0] + steps[1]));
            std::array::from_fn(|c| before[c] + (after[c] - before[c]) * part)
        }
    };
    (0..times.len()).map(slope).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The derivative of a parabola is exact at unequal times, also at both ends.
    #[test]
    fn slopes_of_a_parabola_are_exact() {
        let times = [0.0, 0.1, 0.25, 0.3, 0.7];
        let values = times.map(|t: f64| [1.0 - 3.0 * t + 5.0 * t * t, t, 0.0]);
        for (t, slope) in times.iter().zip(parabola_slopes(&times, &values)) {
            let exact = [-3.0 + 10.0 * t, 1.0, 0.0];
            assert!((0..3).all(|c| (slope[c] - exact[c]).abs() < 1e-12), "{t}: {slope:?}");
        }
        assert_eq!(parabola_slopes(&[0.0], &[[1.0; 3]]), [[0.0; 3]]);
    }
}
