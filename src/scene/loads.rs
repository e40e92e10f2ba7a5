//! What pulls and damps.

use crate::error::Error;
use crate::numerics::scalar::{Nestable, Scalar};
use crate::scene::drag::Drag;
use crate::scene::number::{Candidates, Numbers, Quantity, Written};
use crate::scene::point::Point;
use crate::scene::validate::{finite, not_negative, positive};
use num_dual::Dual64;
use serde::{Deserialize, Serialize};

/// `[loads]`: forces on the rod.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[cfg_attr(test, schemars(bound = "D: Written + schemars::JsonSchema"))]
#[serde(deny_unknown_fields, bound = "D: Written")]
pub struct Loads<D = f64> {
    /// Gravitational acceleration, m/s^2.
    #[serde(deserialize_with = "crate::input::arrays::numbers", default)]
    pub gravity: [D; 3],
    /// Damping of the motion.
    #[serde(default)]
    pub damping: Damping<D>,
    /// The fluid around the rod.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub drag: Option<Drag<D>>,
    /// Constant forces and moments on nodes.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub point: Vec<PointForce<D>>,
}

/// `loads.damping`: damping of the motion.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[cfg_attr(test, schemars(bound = "D: Written + schemars::JsonSchema"))]
#[serde(deny_unknown_fields, bound = "D: Written")]
pub struct Damping<D = f64> {
    /// Damping rate of the force -mass M v, 1/s.
    #[serde(default)]
    pub mass: D,
    /// Kelvin-Voigt time of all strains, s.
    #[serde(default)]
    pub stiffness: D,
    /// Additional Kelvin-Voigt time of bending, s.
    #[serde(default, skip_serializing_if = "Written::is_nothing")]
    pub bending: D,
    /// Additional Kelvin-Voigt time of twist, s.
    #[serde(default, skip_serializing_if = "Written::is_nothing")]
    pub twisting: D,
    /// Additional Kelvin-Voigt time of stretch, s.
    #[serde(default, skip_serializing_if = "Written::is_nothing")]
    pub stretching: D,
    /// Parallel Maxwell branch that relaxes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub maxwell: Option<Maxwell<D>>,
    /// Internal friction of bending and twisting.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub friction: Option<Friction<D>>,
}

/// `loads.damping.friction`: beside what is elastic in the rod, springs that slip, as strands of a cable
/// do: see [`crate::energy::friction`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[cfg_attr(test, schemars(bound = "D: Written + schemars::JsonSchema"))]
#[serde(deny_unknown_fields, bound = "D: Written")]
pub struct Friction<D = f64> {
    /// Stiffness of the springs as a fraction of the bending and twist stiffness of the rod.
    pub stiffness: D,
    /// Curvature at which the springs slip, 1/m.
    pub curvature: D,
}

/// `loads.damping.maxwell`: a spring in series with a dashpot, parallel to the elastic rod;
/// together a standard linear solid.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[cfg_attr(test, schemars(bound = "D: Written + schemars::JsonSchema"))]
#[serde(deny_unknown_fields, bound = "D: Written")]
pub struct Maxwell<D = f64> {
    /// Stiffness of the branch as a fraction of the stiffness of the rod.
    pub stiffness: D,
    /// Relaxation time of the branch, s.
    pub time: D,
}

/// `[[loads.point]]`: a constant force or moment at a point of the rod.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[cfg_attr(test, schemars(bound = "D: Written + schemars::JsonSchema"))]
#[serde(deny_unknown_fields, bound = "D: Written")]
pub struct PointForce<D = f64> {
    /// Position of the load: `"tip"`, a node index or `{ arc_length = m }`. Between nodes the two
    /// neighbors share it, with the same work on every motion.
    pub node: Point<D>,
    /// Force in world axes, N.
    #[serde(deserialize_with = "crate::input::arrays::numbers", default)]
    pub force: [D; 3],
    /// Moment about the normal of a planar scene, N m; half of it acts on each adjacent edge.
    #[serde(
        deserialize_with = "crate::input::arrays::numbers",
        default,
        skip_serializing_if = "is_zero"
    )]
    pub moment: [D; 3],
}

pub(super) fn is_zero<D: Written>(vector: &[D; 3]) -> bool {
    vector.iter().all(|c| *c == D::default())
}

impl PointForce {
    pub(super) fn over<D>(&self, n: &mut Numbers<'_, D>) -> PointForce<D> {
        PointForce {
            node: self.node.over("node", n),
            force: n.vector("force", self.force, Quantity::signed("N")),
            moment: n.vector("moment", self.moment, Quantity::signed("N m")),
        }
    }

    pub(crate) fn check(&self, key: &str) -> Result<(), Error> {
        finite(&format!("{key}.force"), &self.force)?;
        finite(&format!("{key}.moment"), &self.moment)
    }
}

impl Damping {
    fn over<D>(&self, n: &mut Numbers<'_, D>) -> Damping<D> {
        let rate =
            Quantity::positive("1/s").searched(Candidates::Rate(0.03, 10.0, 1.5)).vanishing();
        let time = Quantity::positive("s").searched(Candidates::Time(1e-5, 0.1, 1.0)).vanishing();
        let part = Quantity::positive("");
        let curvature = Quantity::positive("1/m");
        Damping {
            mass: n.number("mass", self.mass, rate),
            stiffness: n.number("stiffness", self.stiffness, time),
            bending: n.number("bending", self.bending, time),
            twisting: n.number("twisting", self.twisting, time),
            stretching: n.number("stretching", self.stretching, time),
            maxwell: self.maxwell.map(|maxwell| {
                n.table("maxwell", |n| Maxwell {
                    stiffness: n.number("stiffness", maxwell.stiffness, part.vanishing()),
                    time: n.number("time", maxwell.time, Quantity::positive("s")),
                })
            }),
            friction: self.friction.map(|friction| {
                n.table("friction", |n| Friction {
                    stiffness: n.number("stiffness", friction.stiffness, part),
                    curvature: n.number("curvature", friction.curvature, curvature),
                })
            }),
        }
    }

    /// Whether anything takes energy.
    pub(crate) fn is_there(&self) -> bool {
        self.mass > 0.0 || self.is_viscous() || self.friction.is_some()
    }

    /// The keys of the times of Kelvin-Voigt damping, with their values, s.
    pub(crate) fn times(&self) -> [(&'static str, f64); 4] {
        let Self { stiffness, bending, twisting, stretching, .. } = *self;
        [
            ("stiffness", stiffness),
            ("bending", bending),
            ("twisting", twisting),
            ("stretching", stretching),
        ]
    }
}

impl<D: Scalar> Damping<D> {
    /// The times of stretching, bending and twisting alone, s.
    pub(crate) fn own_times(&self) -> [D; 3] {
        [self.stretching, self.bending, self.twisting]
    }

    /// Whether kinds of strain differ, or derivatives may.
    pub(crate) fn has_own_times(&self) -> bool {
        D::ORDER > 0 || self.own_times().iter().any(|time| time.value() > 0.0)
    }
}

impl<D: Nestable> Damping<D> {
    /// Whether the stress, or a derivative of it, depends on how the strains have changed.
    pub(crate) fn is_viscous(&self) -> bool {
        let takes = |time: &D| !time.is_identically_zero();
        takes(&self.stiffness) || self.own_times().iter().any(takes) || self.maxwell.is_some()
    }
}

impl Damping<Dual64> {
    /// Whether the stress depends on how the strains have changed, or its derivative does.
    pub(crate) fn remembers(&self) -> bool {
        let Self { stiffness, maxwell, friction, .. } = self;
        let parts =
            [maxwell.map(|branch| branch.stiffness), friction.map(|springs| springs.stiffness)];
        let times = self.own_times().into_iter().chain([*stiffness]);
        times.chain(parts.into_iter().flatten()).any(|x| x.re != 0.0 || x.eps != 0.0)
    }
}

impl Loads {
    pub(super) fn over<D>(&self, n: &mut Numbers<'_, D>) -> Loads<D> {
        Loads {
            gravity: n.vector("gravity", self.gravity, Quantity::signed("m/s^2")),
            damping: n.table("damping", |n| self.damping.over(n)),
            drag: self.drag.map(|drag| n.table("drag", |n| drag.over(n))),
            point: n.list("point", &self.point, PointForce::over),
        }
    }

    /// Whether anything takes energy.
    pub(crate) fn take_energy(&self) -> bool {
        self.damping.is_there() || self.drag.is_some()
    }

    /// Whether a fluid that moves does work.
    pub(crate) fn flow(&self) -> bool {
        self.drag.as_ref().is_some_and(Drag::flows)
    }

    pub(crate) fn check(&self) -> Result<(), Error> {
        finite("loads.gravity", &self.gravity)?;
        not_negative("loads.damping.mass", self.damping.mass)?;
        for (key, time) in self.damping.times() {
            not_negative(&format!("loads.damping.{key}"), time)?;
        }
        if let Some(maxwell) = &self.damping.maxwell {
            not_negative("loads.damping.maxwell.stiffness", maxwell.stiffness)?;
            positive("loads.damping.maxwell.time", maxwell.time)?;
        }
        if let Some(friction) = &self.damping.friction {
            positive("loads.damping.friction.stiffness", friction.stiffness)?;
            positive("loads.damping.friction.curvature", friction.curvature)?;
        }
        self.drag.as_ref().map_or(Ok(()), Drag::check)?;
        let mut points = self.point.iter().enumerate();
        points.try_for_each(|(i, load)| load.check(&format!("loads.point[{i}]")))
    }
}
