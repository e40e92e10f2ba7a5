//! `[loads]`: gravity, point and line loads, damping (mass-proportional, Kelvin-Voigt, Maxwell, friction) and drag.
//!
//! The tables declare units and search ranges of their numbers: gravity, m/s^2, forces, N, and moments, N m, at points,
//! forces per length, N/m, between two arc lengths, and damping. The latter has a rate, 1/s, Kelvin-Voigt times, s,
//! Maxwell branches, a power law and friction springs (fractions of the rod's stiffness). Loads may have a signal over
//! time, or turn with the rod (follower loads). Numbers are validated with the scene.
//!
//! Functions for the choice of schemes and for checks: `have_forces` returns whether there are point or line loads,
//! also of zero force, and `have_flow` whether the fluid moves. `first_follower` is the key of the first load without a
//! potential (follower loads, in space also moments). `are_dissipative` returns whether damping dissipates energy
//! (`is_dissipative`) or there is a drag. `is_viscous` is true with a Kelvin-Voigt time, Maxwell branches or a power
//! law. `depends_on_history` is true with a Kelvin-Voigt time, or the stiffness of a Maxwell branch or of friction; in
//! both, derivatives that are not zero count too. `times` are the keys and values of all four Kelvin-Voigt times, s;
//! `additional_times` are the Kelvin-Voigt times of stretch, bending and twist, s. `has_additional_times` returns
//! whether one of these is above zero, and true for all numbers with derivatives. `LineForce::size` is the absolute
//! resultant, N.

use crate::error::Error;
use crate::numerics::scalar::{RodScalar, Scalar};
use crate::scene::drag::Drag;
use crate::scene::maxwell::MaxwellBranches;
use crate::scene::number::{Candidates, Quantity, is_default};
use crate::scene::point::Point;
use crate::scene::power_law::PowerLaw;
use crate::scene::table::{TABLE, table};
use num_dual::Dual64;

/// Quantity of the rate of mass-proportional damping, 1/s.
const RATE: Quantity =
    Quantity::positive("1/s").searched(Candidates::Rate(0.03, 10.0, 1.5)).vanishing();
/// Quantity of a Kelvin-Voigt time, s.
const TIME: Quantity =
    Quantity::positive("s").searched(Candidates::Time(1e-5, 0.1, 1.0)).vanishing();
/// Quantity of the stiffness of a branch as a fraction of that of the rod.
const FRACTION: Quantity = Quantity::positive("");

table! {
    /// `[loads]`: forces on the rod.
    #[derive(Default)]
    pub struct Loads {
        /// Gravitational acceleration, m/s^2.
        #[serde(deserialize_with = "crate::input::arrays::numbers", default)]
        pub gravity: [D; 3] = Quantity::signed("m/s^2"),
        /// Damping of the motion.
        #[serde(default)]
        pub damping: Damping<D> = TABLE,
        /// The fluid around the rod.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        pub drag: Option<Drag<D>> = TABLE,
        /// Forces and moments on nodes.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        pub point: Vec<PointForce<D>> = TABLE,
        /// Forces per unit length along parts of the rod.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        pub line: Vec<LineForce<D>> = TABLE,
        /// Time of the signals in an equilibrium and its vibrations (`rodfit static`, `rodfit modes`), s; default 0.
        #[serde(default, skip_serializing_if = "is_default")]
        pub at_time: f64,
    }
}

table! {
    /// `loads.damping`: damping of the motion.
    #[derive(Default)]
    pub struct Damping {
        /// Damping rate of the force -mass M v, 1/s.
        #[serde(default)]
        pub mass: D = RATE,
        /// Kelvin-Voigt time of all strains, s.
        #[serde(default)]
        pub stiffness: D = TIME,
        /// Additional Kelvin-Voigt time of bending, s.
        #[serde(default, skip_serializing_if = "is_default")]
        pub bending: D = TIME,
        /// Additional Kelvin-Voigt time of twist, s.
        #[serde(default, skip_serializing_if = "is_default")]
        pub twisting: D = TIME,
        /// Additional Kelvin-Voigt time of stretch, s.
        #[serde(default, skip_serializing_if = "is_default")]
        pub stretching: D = TIME,
        /// Parallel Maxwell branches that relax: one table, or a list of them (a Prony series).
        #[serde(default, skip_serializing_if = "MaxwellBranches::is_empty")]
        pub maxwell: MaxwellBranches<D> = TABLE,
        /// Relaxation by a power law of time, beside the branches of `maxwell`.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        pub power_law: Option<PowerLaw<D>> = TABLE,
        /// Internal friction of bending and twisting.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        pub friction: Option<Friction<D>> = TABLE,
    }
}

table! {
    /// `loads.damping.friction`: springs in series with sliders, parallel to the elastic law, as the strands of a cable
    /// (`energy::law`).
    #[derive(Copy)]
    pub struct Friction {
        /// Stiffness of the springs as a fraction of the bending and twist stiffness of the rod.
        pub stiffness: D = FRACTION,
        /// Curvature at which the springs slip, 1/m.
        pub curvature: D = Quantity::positive("1/m"),
    }
}

table! {
    /// `[[loads.point]]`: a force or moment at a point of the rod, constant or with a signal.
    #[derive(Default)]
    pub struct PointForce {
        /// Position of the load: `"tip"`, a node index or `{ arc_length = m }`. Between nodes the four nodes around
        /// share it by cubic weights, in the edge of a clamp the two next to it by the lever rule.
        pub node: Point<D> = TABLE,
        /// Force in world axes, N; of a follower load along tangent, first and second director of the rod.
        #[serde(deserialize_with = "crate::input::arrays::numbers", default)]
        pub force: [D; 3] = Quantity::signed("N"),
        /// Moment about world axes, N m, of a follower load about tangent, first and second director. Half of it acts
        /// on each adjacent edge. In a planar scene it is about the normal.
        #[serde(
            deserialize_with = "crate::input::arrays::numbers",
            default,
            skip_serializing_if = "is_default"
        )]
        pub moment: [D; 3] = Quantity::signed("N m"),
        /// Whether the load turns with the rod: components are along its tangent and directors; default: false.
        #[serde(default, skip_serializing_if = "is_default")]
        pub follower: bool,
        /// Name of the signal in `[[signals]]` that multiplies force and moment over time; default: constant.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        pub signal: Option<String>,
    }
}

table! {
    /// `[[loads.line]]`: a force per unit length along a part of the rod, constant or with a signal.
    #[derive(Default)]
    pub struct LineForce {
        /// Arc length from the start of the rod where the load begins, m; default: 0.
        #[serde(default)]
        pub from: D = Quantity::positive("m").vanishing(),
        /// Arc length where the load ends, m; default: the length of the rod.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        pub to: Option<D> = Quantity::positive("m"),
        /// Force per unit length at rest in world axes, N/m; of a follower load along tangent, first and second
        /// director.
        #[serde(deserialize_with = "crate::input::arrays::numbers")]
        pub force: [D; 3] = Quantity::signed("N/m"),
        /// Whether the load turns with the rod: components are along its tangent and directors; default: false.
        #[serde(default, skip_serializing_if = "is_default")]
        pub follower: bool,
        /// Name of the signal in `[[signals]]` that multiplies the force over time; default: constant.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        pub signal: Option<String>,
    }
}

impl Loads {
    /// Whether there are entries of `loads.point` or `loads.line`, also of zero force.
    pub(crate) fn have_forces(&self) -> bool {
        !self.point.is_empty() || !self.line.is_empty()
    }
}

impl<D: RodScalar> Loads<D> {
    /// Key of the first load without a potential, if there is one, point loads before line loads: a follower load, and
    /// on a `spatial` rod a moment that is not zero or has a derivative. A follower load that has only a moment counts,
    /// too.
    pub(crate) fn first_follower(&self, spatial: bool) -> Option<FollowerKey> {
        let points = self.point.iter().enumerate().filter_map(|(k, load)| {
            let turns = spatial && !load.moment.iter().all(RodScalar::is_identically_zero);
            let name = if load.follower { "follower" } else { "moment" };
            (load.follower || turns)
                .then(|| FollowerKey { load: format!("loads.point[{k}]"), name })
        });
        let lines = self.line.iter().enumerate().filter(|(_, load)| load.follower);
        let lines =
            lines.map(|(k, _)| FollowerKey { load: format!("loads.line[{k}]"), name: "follower" });
        points.chain(lines).next()
    }
}

/// Key of a load without a potential.
pub(crate) struct FollowerKey {
    /// Key of the load.
    pub load: String,
    /// Key in the load that makes it one without a potential: `follower` or `moment`.
    pub name: &'static str,
}

impl FollowerKey {
    /// The whole key, such as `loads.point[0].follower`.
    pub fn key(&self) -> String {
        format!("{}.{}", self.load, self.name)
    }
}

impl LineForce {
    /// Absolute value, N, of the resultant force on a rod of a `length`, m: force per length times the loaded length.
    /// Parts beyond the end of the rod are left out.
    pub(crate) fn size(&self, length: f64) -> f64 {
        let per_length = self.force.iter().map(|c| c * c).sum::<f64>().sqrt();
        per_length * (self.to.unwrap_or(length).min(length) - self.from).max(0.0)
    }
}

impl Damping {
    /// Rejects an invalid [power law](PowerLaw::check).
    pub(super) fn check(&self) -> Result<(), Error> {
        self.power_law.map_or(Ok(()), |law| law.check())
    }

    /// Whether any damping dissipates energy: a mass-proportional rate or Kelvin-Voigt time above zero, a Maxwell
    /// branch, a power law, or friction.
    pub(crate) fn is_dissipative(&self) -> bool {
        self.mass > 0.0 || self.is_viscous() || self.friction.is_some()
    }

    /// Keys within `loads.damping` and values, s, of the four Kelvin-Voigt times: stiffness, bending, twisting,
    /// stretching.
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
    /// The same damping with the Maxwell branches of the power law in the list of branches, and without the law.
    pub(crate) fn in_branches(&self) -> Self {
        let mut damping = self.clone();
        if let Some(law) = damping.power_law.take() {
            let mut branches = damping.maxwell.as_slice().to_vec();
            branches.extend(law.branches());
            damping.maxwell = branches.into();
        }
        damping
    }

    /// Kelvin-Voigt times, s, of stretch, bending and twist, in this order, that are added to that of all strains.
    pub(crate) fn additional_times(&self) -> [D; 3] {
        [self.stretching, self.bending, self.twisting]
    }

    /// Whether an additional Kelvin-Voigt time (stretch, bending, twist) is above zero; true for every number type that
    /// carries derivatives.
    pub(crate) fn has_additional_times(&self) -> bool {
        // A time of zero may still have a derivative.
        D::ORDER > 0 || self.additional_times().iter().any(|time| time.value() > 0.0)
    }
}

impl<D: RodScalar> Damping<D> {
    /// Whether a Kelvin-Voigt time, or a derivative of one, is not zero, or there are Maxwell branches or a power law.
    /// The stress then depends on strain rates or their history.
    pub(crate) fn is_viscous(&self) -> bool {
        // A time of zero with a derivative counts: the derivative of the stress depends on strain rates.
        let is_present = |time: &D| !time.is_identically_zero();
        is_present(&self.stiffness)
            || self.additional_times().iter().any(is_present)
            || !self.maxwell.is_empty()
            || self.power_law.is_some()
    }
}

impl Damping<Dual64> {
    /// Whether the stress, or its derivative, depends on the history of the strains. Then a Kelvin-Voigt time, or the
    /// stiffness of a Maxwell branch or of friction, has a value or derivative other than zero.
    pub(crate) fn depends_on_history(&self) -> bool {
        let branches = self.maxwell.as_slice().iter().map(|branch| branch.stiffness);
        let springs = self.friction.map(|springs| springs.stiffness);
        let springs = springs.into_iter().chain(self.power_law.map(|law| law.stiffness));
        let times = self.additional_times().into_iter().chain([self.stiffness]);
        times.chain(branches).chain(springs).any(|x| x.re != 0.0 || x.eps != 0.0)
    }
}

impl Loads {
    /// Whether damping dissipates energy, or there is a table `loads.drag`.
    pub(crate) fn are_dissipative(&self) -> bool {
        self.damping.is_dissipative() || self.drag.is_some()
    }

    /// Whether the fluid has a velocity other than zero, and so does work on the rod. False without a fluid.
    pub(crate) fn have_flow(&self) -> bool {
        self.drag.as_ref().is_some_and(|drag| drag.fluid_velocity != [0.0; 3])
    }
}
