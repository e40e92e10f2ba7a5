//! Components that sensors measure: of the force or moment of a support, or of a quantity of a point of the rod.
//!
//! Input: a [`Channel`] (end of the rod, part of the reaction, direction in the world) or a [`PointChannel`]
//! (acceleration, angle, curvature or strain), and the record of a simulated rod. Output: [`SensorChannel`], with the
//! component at every recorded time, N, N m, m/s^2, rad, 1/m or part of the length, with derivatives (`values`); its
//! name and unit; and the outputs that a simulation must record for it (`require`). `check` rejects an end without a
//! support, and a point channel that the problem does not allow. `values_of_sensor` are those
//! in the frame of a sensor of the scene and about its position. `along_world` is the component along an axis of the
//! world; `rotated` turns its axis by a rotation vector, rad. `is_angle` returns whether values that differ by whole
//! turns are equal.

use crate::dynamics::record::RecordView;
use crate::error::{Error, ensure};
use crate::fit::measurement::point_channel::PointChannel;
use crate::fit::measurement::simulated::{Requirements, SimulatedOutput};
use crate::numerics::scalar::Scalar;
use crate::numerics::vector::{Vector, cross, dot, rotate, sub};
use crate::problem::Problem;
use crate::scene::{End, SensorModel, Support};
use crate::statics::Reactions;

/// Part of the reaction of a support.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ReactionPart {
    /// Force of the support on the rod, N.
    Force,
    /// Moment of the support on the rod about the point of the support, N m.
    Moment,
}

impl ReactionPart {
    /// Symbol of the unit: `N` of a force, `N m` of a moment.
    pub(crate) fn unit(self) -> &'static str {
        match self {
            Self::Force => "N",
            Self::Moment => "N m",
        }
    }
}

/// A measured component of the reaction of a support.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Channel {
    /// End of the rod with the support.
    pub of: End,
    /// Force or moment.
    pub part: ReactionPart,
    /// Axis of the sensor, 0 to 2 for x, y and z: the name of the component.
    pub axis: usize,
    /// Direction of this axis in the world, a unit vector.
    pub direction: [f64; 3],
}

impl Channel {
    /// The component along axis `axis` (0 to 2 for x, y and z) of the world of the force or moment of the support at
    /// the end `of`.
    pub fn along_world(of: End, part: ReactionPart, axis: usize) -> Self {
        let direction = std::array::from_fn(|c| f64::from(u8::from(c == axis)));
        Self { of, part, axis, direction }
    }

    /// The component along its axis turned by the rotation vector `rotation`, rad, in the world, as of a sensor whose
    /// frame is not that of the world.
    pub fn rotated(self, rotation: [f64; 3]) -> Self {
        Self { direction: rotate(rotation, self.direction), ..self }
    }

    /// Name of the component in reports, by its axis: `fx`, `fy` or `fz` of a force, `mx`, `my` or `mz` of a moment.
    pub fn name(&self) -> &'static str {
        let names = match self.part {
            ReactionPart::Force => ["fx", "fy", "fz"],
            ReactionPart::Moment => ["mx", "my", "mz"],
        };
        names[self.axis.min(2)]
    }

    /// Rejects an end without a support; the error has the key of the table.
    fn check(&self, problem: &Problem, key: &str) -> Result<(), Error> {
        let (name, support) = match self.of {
            End::Start => ("start", problem.scene().supports.start),
            End::End => ("end", problem.scene().supports.end),
        };
        let allowed = "an end that a support holds";
        let found = format!("{name}, a free end");
        ensure(support != Support::Free, format!("{key}.of"), found, allowed)
    }

    /// The component of these reactions at the end of the channel along its direction, N or N m. The moment is that
    /// about the point at `position`, m, relative to the point of the support, in axes of the world.
    fn component<D: Scalar>(&self, reactions: &Reactions<D>, position: Vector<D>) -> D {
        let reaction = match self.of {
            End::Start => &reactions.start,
            End::End => &reactions.end,
        };
        let vector: Vector<D> = match self.part {
            ReactionPart::Force => reaction.force,
            ReactionPart::Moment => sub(reaction.moment, cross(position, reaction.force)),
        };
        dot(vector, self.direction.map(D::from))
    }
}

/// The component that a sensor measures.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SensorChannel {
    /// Of the reaction of a support.
    Support(Channel),
    /// Of a point of the rod.
    Point(PointChannel),
}

impl From<Channel> for SensorChannel {
    /// The channel of a support.
    fn from(channel: Channel) -> Self {
        Self::Support(channel)
    }
}

impl From<PointChannel> for SensorChannel {
    /// The channel of a point.
    fn from(channel: PointChannel) -> Self {
        Self::Point(channel)
    }
}

impl SensorChannel {
    /// Name of the component in reports: `fx` to `fz`, `mx` to `mz`, `ax` to `az`, `angle`, `k1`, `k2`, or
    /// `strain`.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Support(channel) => channel.name(),
            Self::Point(channel) => channel.name(),
        }
    }

    /// Symbol of the unit: `N`, `N m`, `m/s^2`, `rad` or `1/m`; empty of a strain.
    pub(crate) fn unit(&self) -> &'static str {
        match self {
            Self::Support(channel) => channel.part.unit(),
            Self::Point(channel) => channel.unit(),
        }
    }

    /// Rejects an end without a support, and cases that the quantity of a point does not allow
    /// ([`PointChannel::check`]; `is_at_rest` if any reading is). Errors have the `key` of the table.
    pub(crate) fn check(
        &self,
        problem: &Problem,
        key: &str,
        is_at_rest: bool,
    ) -> Result<(), Error> {
        match self {
            Self::Support(channel) => channel.check(problem, key),
            Self::Point(channel) => channel.check(problem, key, is_at_rest),
        }
    }

    /// Adds the reactions of the supports, or the point, to the required `outputs`: in motion if `moves`, at rest if
    /// `rests`.
    pub(crate) fn require(&self, moves: bool, rests: bool, outputs: &mut Requirements) {
        match self {
            Self::Support(_) => {
                outputs.moving_reactions |= moves;
                outputs.resting_reactions |= rests;
            }
            Self::Point(channel) => channel.require(moves, rests, outputs),
        }
    }

    /// The unit vector along which the component of a vector is measured; none of an angle and a strain.
    fn direction(&self) -> Option<[f64; 3]> {
        match self {
            Self::Support(channel) => Some(channel.direction),
            Self::Point(channel) => channel.direction(),
        }
    }

    /// The channel of the same vector along another `direction`.
    fn along(self, direction: [f64; 3]) -> Self {
        match self {
            Self::Support(channel) => Channel { direction, ..channel }.into(),
            Self::Point(channel) => channel.along(direction).into(),
        }
    }

    /// Rejects a `rotation` of the sensor, rad, about an axis that the quantity does not have: any one of an angle or
    /// strain, and one about the directors of a curvature. Other errors are those of [`check`](Self::check) for the
    /// rotated channel. `name` is that of the sensor, for errors.
    pub(crate) fn check_rotated(
        &self,
        rotation: [f64; 3],
        problem: &Problem,
        name: &str,
    ) -> Result<(), Error> {
        if rotation == [0.0; 3] {
            return Ok(());
        }
        let (key, found) = (format!("sensors.{name}.rotation"), format!("{rotation:?}"));
        let Some(direction) = self.direction() else {
            let allowed = "0 of an angle or strain: `tare` of an angle, and `rotation` of the observation, have this effect";
            return Err(Error::invalid(key, found, allowed));
        };
        let rotated = self.along(rotate(rotation, direction));
        rotated.check(problem, &format!("sensors.{name}"), false)
    }

    /// The component along the axis of the channel in the frame of a `sensor` and about its position, one value per
    /// time of a record: the sum of the components of the vector along the three axes, each times that of the axis
    /// turned by the rotation vector of the sensor. Errors are those of [`values`](Self::values).
    pub(crate) fn values_of_sensor<D: Scalar>(
        &self,
        sensor: &SensorModel<D>,
        record: &RecordView<'_, D>,
        simulated: &SimulatedOutput<D>,
    ) -> Result<Vec<D>, Error> {
        let SensorModel { rotation, position, .. } = *sensor;
        let is_zero = D::ORDER == 0 && rotation.iter().all(|r| r.value() == 0.0);
        let Some(direction) = self.direction().filter(|_| !is_zero) else {
            return self.values_about(position, record, simulated);
        };
        let direction = rotate(rotation, direction.map(D::from));
        let mut sum = Vec::new();
        for axis in 0..3 {
            let own = self.along(std::array::from_fn(|c| f64::from(u8::from(c == axis))));
            let values = own.values_about(position, record, simulated)?;
            sum.resize(values.len(), D::from(0.0));
            sum.iter_mut().zip(values).for_each(|(sum, value)| *sum += value * direction[axis]);
        }
        Ok(sum)
    }

    /// Whether the component is an angle, so that values that differ by whole turns are the same.
    pub(crate) fn is_angle(&self) -> bool {
        matches!(self, Self::Point(channel) if channel.is_angle())
    }

    /// The component, N, N m, m/s^2, rad, 1/m or part of the length, one value per time of a record of the `simulated`
    /// rod. Errors are those of [`PointChannel::values`]; none for a support.
    pub(crate) fn values<D: Scalar>(
        &self,
        record: &RecordView<'_, D>,
        simulated: &SimulatedOutput<D>,
    ) -> Result<Vec<D>, Error> {
        self.values_about(std::array::from_fn(|_| D::from(0.0)), record, simulated)
    }

    /// The component as [`values`](Self::values) has it, but a moment about the point at `position`, m, relative to
    /// that of the support.
    fn values_about<D: Scalar>(
        &self,
        position: Vector<D>,
        record: &RecordView<'_, D>,
        simulated: &SimulatedOutput<D>,
    ) -> Result<Vec<D>, Error> {
        match self {
            Self::Support(channel) => {
                let component = |reactions| channel.component(&reactions, position);
                Ok(record.reactions().map(component).collect())
            }
            Self::Point(channel) => channel.values(record, simulated),
        }
    }
}
