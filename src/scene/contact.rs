//! `[[contacts]]`: obstacles, fixed in space or moved in time, that the rod touches.
//!
//! An obstacle is a half-space (`plane`), a `sphere`, an endless `cylinder`, or a `capsule`, which is a cylinder with
//! round ends. The rod is a tube of its outer radius, or of `contact_radius`. `stiffness` is the force per length over
//! the square of the overlap, N/m^3; without it, the program takes one from the weight and the bending stiffness of the
//! rod. `damping` (s/m) and `friction` (Coulomb's coefficient) with `slip_velocity` (m/s) are the numbers of the forces
//! that depend on the velocity; damping and friction are zero by default. `check_contacts` rejects, with the key,
//! invalid numbers and motions, directions without length, equal ends of a capsule, and sections other than circle and
//! tube where `contact_radius` is missing. Output over any number type: shape and size of an obstacle (`obstacle`), the
//! stiffness that the scene gives (`given_stiffness`, else `None`), losses (`loss`, `None` without damping and
//! friction) and radius of the rod in the contact (`rod_radius`, `None` without one). `has_damping` and `has_friction`
//! return whether these are above zero. `contact_directions` returns the vectors that the plane of a planar rod must
//! contain, and those that must be normal to it.

use crate::code::Code;
use crate::error::Error;
use crate::numerics::scalar::Scalar;
use crate::numerics::vector::{Vector, dot, scale, sub, unit};
use crate::scene::Scene;
use crate::scene::number::Quantity;
use crate::scene::obstacle_motion::ObstacleMotion;
use crate::scene::plane::KeyedVector;
use crate::scene::section::Section;
use crate::scene::table::{NumberTree, TABLE, table};
use crate::scene::time::Time;
use crate::scene::track::Track;
use crate::scene::validate::direction;
use std::path::Path;

/// Quantity of the coordinates of a point, m.
const POINT: Quantity = Quantity::signed("m");
/// Quantity of a radius, m.
pub(super) const RADIUS: Quantity = Quantity::positive("m");
/// Quantity of the components of a direction.
const DIRECTION: Quantity = Quantity::signed("");
/// Quantity of the contact stiffness.
pub(super) const STIFFNESS: Quantity = Quantity::positive("N/m^3");
/// Quantity of the damping of the normal force.
pub(super) const DAMPING: Quantity = Quantity::positive("s/m").vanishing();
/// Quantity of the friction coefficient.
pub(super) const FRICTION: Quantity = Quantity::positive("").vanishing();
/// Quantity of the slip velocity.
pub(super) const SLIP_VELOCITY: Quantity = Quantity::positive("m/s");
/// Slip velocity of a contact that gives none, m/s: slower than motions of interest.
const DEFAULT_SLIP_VELOCITY: f64 = 1e-3;

table! {
    /// `[[contacts]]`: an obstacle that the rod touches.
    pub enum Contact {
        /// The half-space behind a plane.
        Plane {
            /// A point of the plane, m.
            #[serde(deserialize_with = "crate::input::arrays::numbers")]
            point: [D; 3] = POINT,
            /// Normal of the plane towards the rod, of any length.
            #[serde(deserialize_with = "crate::input::arrays::numbers")]
            normal: [D; 3] = DIRECTION,
        },
        /// A sphere.
        Sphere {
            /// Center, m.
            #[serde(deserialize_with = "crate::input::arrays::numbers")]
            center: [D; 3] = POINT,
            /// Radius, m.
            radius: D = RADIUS,
        },
        /// A cylinder without ends.
        Cylinder {
            /// A point of the axis, m.
            #[serde(deserialize_with = "crate::input::arrays::numbers")]
            point: [D; 3] = POINT,
            /// Direction of the axis, of any length.
            #[serde(deserialize_with = "crate::input::arrays::numbers")]
            axis: [D; 3] = DIRECTION,
            /// Radius, m.
            radius: D = RADIUS,
        },
        /// A cylinder with a half sphere at either end.
        Capsule {
            /// Center of the first half sphere, m.
            #[serde(deserialize_with = "crate::input::arrays::numbers")]
            from: [D; 3] = POINT,
            /// Center of the second half sphere, m.
            #[serde(deserialize_with = "crate::input::arrays::numbers")]
            to: [D; 3] = POINT,
            /// Radius, m.
            radius: D = RADIUS,
        },
    } each with {
        /// Force per length over the square of the overlap, N/m^3; default: by the weight and bending stiffness of
        /// the rod.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        stiffness: Option<D> = STIFFNESS,
        /// Radius of the rod in contact, m; default: the outer radius of its section.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        contact_radius: Option<D> = RADIUS,
        /// Damping, s/m: the normal force is multiplied by one plus this number times the speed of approach;
        /// default: zero.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        damping: Option<D> = DAMPING,
        /// Friction coefficient of Coulomb's law; default: zero.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        friction: Option<D> = FRICTION,
        /// Speed from which on friction is that of Coulomb's law, m/s; default: 1 mm/s.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        slip_velocity: Option<D> = SLIP_VELOCITY,
        /// Prescribed translation in time; default: none.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        motion: Vec<ObstacleMotion<D>> = TABLE,
    }
}

/// Shape of an obstacle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ObstacleKind {
    /// Half-space.
    Plane,
    /// Sphere.
    Sphere,
    /// Endless cylinder.
    Cylinder,
    /// Cylinder with round ends.
    Capsule,
}

/// Numbers of the forces of a contact that depend on the velocity.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ContactLoss<D> {
    /// Damping `c` of the normal force, s/m: the force is multiplied by `max(0, 1 + c v)` at the speed of approach `v`.
    pub damping: D,
    /// Friction coefficient.
    pub friction: D,
    /// Speed from which on friction is that of Coulomb's law, m/s; below, with `u` as the speed over this one, the
    /// friction is `(2 - u) u` times that.
    pub slip_velocity: D,
}

impl<D: Scalar> ContactLoss<D> {
    /// The numbers from the damping, s/m, friction coefficient and slip velocity, m/s, that a scene gives, with the
    /// defaults of others; `None` if it gives neither damping nor friction.
    pub(super) fn from_given([damping, friction, slip_velocity]: [Option<D>; 3]) -> Option<Self> {
        let number = |x: Option<D>, default: f64| x.unwrap_or(D::from(default));
        (damping.is_some() || friction.is_some()).then(|| Self {
            damping: number(damping, 0.0),
            friction: number(friction, 0.0),
            slip_velocity: number(slip_velocity, DEFAULT_SLIP_VELOCITY),
        })
    }
}

impl<D: Copy> ContactLoss<D> {
    /// The numbers converted to another number type.
    pub fn map<E>(&self, over: impl Fn(D) -> E) -> ContactLoss<E> {
        ContactLoss {
            damping: over(self.damping),
            friction: over(self.friction),
            slip_velocity: over(self.slip_velocity),
        }
    }
}

/// Shape and size of an obstacle.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Obstacle<D> {
    /// Its kind.
    pub kind: ObstacleKind,
    /// Its radius, m; zero of a plane.
    pub radius: D,
    /// A point of the plane or of the axis, or the center, m.
    pub point: Vector<D>,
    /// Unit normal of the plane, or unit vector along the axis; not used by a sphere.
    pub axis: Vector<D>,
    /// Distance of the centers of the ends of a capsule, m; not used by others.
    pub length: D,
}

impl<D: Copy> Obstacle<D> {
    /// The obstacle with its numbers converted to another number type.
    pub fn map<E: Copy>(&self, over: impl Fn(D) -> E + Copy) -> Obstacle<E> {
        let Self { kind, radius, point, axis, length } = *self;
        let (radius, length) = (over(radius), over(length));
        Obstacle { kind, radius, point: point.map(over), axis: axis.map(over), length }
    }
}

/// The value of a key that all kinds of contacts have, by reference.
macro_rules! of_any_kind {
    ($contact:expr, $key:ident) => {
        match $contact {
            Contact::Plane { $key, .. }
            | Contact::Sphere { $key, .. }
            | Contact::Cylinder { $key, .. }
            | Contact::Capsule { $key, .. } => $key,
        }
    };
}

impl<D: Scalar> Contact<D> {
    /// Shape and size of the obstacle: kind, radius, point, axis as a unit vector (the normal of a plane), and length
    /// of a capsule from the point on. Numbers that the kind does not have are zero.
    pub(crate) fn obstacle(&self) -> Obstacle<D> {
        let zero = D::from(0.0);
        let (kind, radius, point, axis, length) = match *self {
            Self::Plane { point, normal, .. } => {
                (ObstacleKind::Plane, zero, point, unit(normal), zero)
            }
            Self::Sphere { center, radius, .. } => {
                (ObstacleKind::Sphere, radius, center, [zero; 3], zero)
            }
            Self::Cylinder { point, axis, radius, .. } => {
                (ObstacleKind::Cylinder, radius, point, unit(axis), zero)
            }
            Self::Capsule { from, to, radius, .. } => {
                let way = sub(to, from);
                let length = dot(way, way).sqrt();
                (ObstacleKind::Capsule, radius, from, scale(way, length.recip()), length)
            }
        };
        Obstacle { kind, radius, point, axis, length }
    }

    /// Prescribed motions of the obstacle; empty for a fixed one.
    pub(crate) fn motions(&self) -> &[ObstacleMotion<D>] {
        of_any_kind!(self, motion)
    }

    /// Stiffness of the contact that the scene gives, N/m^3; `None` without one.
    pub(crate) fn given_stiffness(&self) -> Option<D> {
        *of_any_kind!(self, stiffness)
    }

    /// The numbers of the forces that depend on the velocity, with their defaults; `None` if the scene gives neither
    /// damping nor friction.
    pub(crate) fn loss(&self) -> Option<ContactLoss<D>> {
        let (damping, friction) = (of_any_kind!(self, damping), of_any_kind!(self, friction));
        ContactLoss::from_given([*damping, *friction, *of_any_kind!(self, slip_velocity)])
    }

    /// Whether the contact has damping above zero.
    pub(crate) fn has_damping(&self) -> bool {
        self.loss().is_some_and(|loss| loss.damping.value() > 0.0)
    }

    /// Whether the contact has a friction coefficient above zero.
    pub(crate) fn has_friction(&self) -> bool {
        self.loss().is_some_and(|loss| loss.friction.value() > 0.0)
    }

    /// Radius, m, of a rod of this section in the contact: that of the contact, or the outer one of the section. `None`
    /// for a section without a radius where the contact gives none.
    pub(crate) fn rod_radius(&self, section: &Section<D>) -> Option<D> {
        of_any_kind!(self, contact_radius).or(section.outer_radius())
    }
}

/// A contact of this kind with these keys, without any of the keys that all kinds have.
macro_rules! contact {
    ($kind:ident { $($own:ident),* }) => {
        Self::$kind {
            $($own,)*
            stiffness: None,
            contact_radius: None,
            damping: None,
            friction: None,
            slip_velocity: None,
            motion: Vec::new(),
        }
    };
}

/// Contacts in code. They have the default stiffness and the radius of the rod's section, and neither losses nor
/// motions unless these are set.
///
/// ```
/// use rodfit::scene::Contact;
/// let floor = Contact::plane([0.0, -0.01, 0.0], [0.0, 1.0, 0.0]).friction(0.3);
/// assert!(matches!(floor, Contact::Plane { friction: Some(0.3), stiffness: None, .. }));
/// ```
impl Contact {
    /// The half-space behind the plane through a `point`, m, with this `normal` towards the rod.
    pub fn plane(point: [f64; 3], normal: [f64; 3]) -> Self {
        contact!(Plane { point, normal })
    }

    /// A sphere with this center and radius, m.
    pub fn sphere(center: [f64; 3], radius: f64) -> Self {
        contact!(Sphere { center, radius })
    }

    /// An endless cylinder with this radius, m, whose axis goes through a `point`, m, in this direction.
    pub fn cylinder(point: [f64; 3], axis: [f64; 3], radius: f64) -> Self {
        contact!(Cylinder { point, axis, radius })
    }

    /// A cylinder of this radius, m, between two points, m, with a half sphere at either end.
    pub fn capsule([from, to]: [[f64; 3]; 2], radius: f64) -> Self {
        contact!(Capsule { from, to, radius })
    }

    /// The contact with this force per length over the square of the overlap, N/m^3; `None` for the default.
    pub fn stiffness(mut self, stiffness: impl Into<Option<f64>>) -> Self {
        *of_any_kind!(&mut self, stiffness) = stiffness.into();
        self
    }

    /// The contact with this radius of the rod, m.
    pub fn contact_radius(mut self, radius: f64) -> Self {
        *of_any_kind!(&mut self, contact_radius) = Some(radius);
        self
    }

    /// The contact with this damping, s/m; `None` for none.
    pub fn damping(mut self, damping: impl Into<Option<f64>>) -> Self {
        *of_any_kind!(&mut self, damping) = damping.into();
        self
    }

    /// The contact with this friction coefficient; `None` for none.
    pub fn friction(mut self, friction: impl Into<Option<f64>>) -> Self {
        *of_any_kind!(&mut self, friction) = friction.into();
        self
    }

    /// The contact with this slip velocity, m/s.
    pub fn slip_velocity(mut self, speed: f64) -> Self {
        *of_any_kind!(&mut self, slip_velocity) = Some(speed);
        self
    }

    /// The contact with these prescribed motions of its obstacle.
    pub fn motion(mut self, motion: Vec<ObstacleMotion>) -> Self {
        *self.motions_mut() = motion;
        self
    }

    /// Prescribed motions of the obstacle, to be changed.
    pub(super) fn motions_mut(&mut self) -> &mut Vec<ObstacleMotion> {
        of_any_kind!(self, motion)
    }
}

impl Scene {
    /// Files and tracks of all recordings that move obstacles and have been read, in order.
    fn obstacle_recordings(&self) -> impl Iterator<Item = (&Path, &Track)> {
        let motions = self.contacts.iter().flat_map(Contact::motions);
        motions.filter_map(|motion| Some((&*motion.file, &**motion.track.as_ref()?)))
    }

    /// Whether an obstacle has a prescribed motion.
    pub(crate) fn has_moved_obstacles(&self) -> bool {
        self.contacts.iter().any(|contact| !contact.motions().is_empty())
    }

    /// Rejects a simulation beyond the end of a recording that moves an obstacle ([`Track::check_end`]).
    pub(super) fn check_obstacle_recordings(&self, time: &Time) -> Result<(), Error> {
        self.obstacle_recordings().try_for_each(|(file, track)| track.check_end(file, time))
    }

    /// Warnings, with codes, of the defects of recordings that move obstacles, each with the name of its file in front.
    pub(super) fn obstacle_recording_warnings(&self) -> Vec<(Code, String)> {
        self.obstacle_recordings().flat_map(|(file, track)| track.warnings(file)).collect()
    }
}

/// Rejects the first contact with invalid numbers or motions, a direction of no length, equal ends of a capsule, or
/// without a radius of the rod. The latter is missing without `contact_radius` if `section` is not a circle or a tube.
pub(super) fn check_contacts(contacts: &[Contact], section: &Section) -> Result<(), Error> {
    for (i, contact) in contacts.iter().enumerate() {
        let key = format!("contacts[{i}]");
        contact.check_numbers(&key, TABLE)?;
        match contact {
            Contact::Plane { normal, .. } => direction(&format!("{key}.normal"), normal)?,
            Contact::Cylinder { axis, .. } => direction(&format!("{key}.axis"), axis)?,
            Contact::Capsule { from, to, .. } if from == to => {
                let allowed = "another point than from; a sphere has a single center";
                return Err(Error::invalid(format!("{key}.to"), format!("{to:?}"), allowed));
            }
            Contact::Capsule { .. } | Contact::Sphere { .. } => {}
        }
        for (k, motion) in contact.motions().iter().enumerate() {
            motion.check(&format!("{key}.motion[{k}]"))?;
        }
        if contact.rod_radius(section).is_none() {
            let allowed = "a radius of the rod, m, for a section that is not a circle or a tube";
            return Err(Error::invalid(format!("{key}.contact_radius"), "no value", allowed));
        }
    }
    Ok(())
}

/// Vectors of the obstacles with their keys, for a planar rod whose first node is `origin`: those that its plane must
/// contain, then those that must be normal to it. The plane must contain normals of planes and centers of spheres (from
/// `origin`); axes of cylinders and capsules must be normal to it. Of a capsule that the plane misses, it must contain
/// the nearer end.
pub(crate) fn contact_directions<D: Scalar>(
    contacts: &[Contact<D>],
    origin: Vector<D>,
) -> [Vec<KeyedVector<D>>; 2] {
    let (mut within, mut normal) = (Vec::new(), Vec::new());
    for (i, contact) in contacts.iter().enumerate() {
        let keyed =
            |name: &str, vector| KeyedVector { key: format!("contacts[{i}].{name}"), vector };
        match *contact {
            Contact::Plane { normal, .. } => within.push(keyed("normal", normal)),
            Contact::Sphere { center, .. } => within.push(keyed("center", sub(center, origin))),
            Contact::Cylinder { axis, .. } => normal.push(keyed("axis", axis)),
            Contact::Capsule { from, to, .. } => {
                let axis = sub(to, from);
                normal.push(keyed("to", axis));
                // The plane of the rod meets the cylinder between the ends, or contains one of them.
                let [below, above] = [from, to].map(|end| dot(sub(end, origin), axis).value());
                if below > 0.0 {
                    within.push(keyed("from", sub(from, origin)));
                }
                if above < 0.0 {
                    within.push(keyed("to", sub(to, origin)));
                }
            }
        }
    }
    [within, normal]
}
