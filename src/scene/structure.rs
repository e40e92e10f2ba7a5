//! Scenes of several rods: `[[rods]]`, `[[materials]]`, `[[bodies]]`, `[[joints]]` and `[[supports]]`, and their
//! validation.
//!
//! [`StructureScene`] is generic over the type of its numbers, as [`Scene`]: `map_numbers` converts each by its path,
//! in which rods, materials and bodies have their names. Rods name materials; joints, supports and loads name rods and
//! bodies. [`StructureScene::validate`] rejects invalid numbers, names, supports and contacts, internal friction, a
//! `[time]` without a step or with an unsupported scheme; files are not read.
//!
//! `part` is the scene of one rod alone with given supports. It has shape, section, taper, natural curvature, masses
//! and material of the rod, and gravity, damping, contacts and `[time]` of the structure; `fill_part` replaces these in
//! a scene.

use crate::error::{Error, ensure};
use crate::numerics::scalar::Scalar;
use crate::scene::along::Along;
use crate::scene::camera::Camera;
use crate::scene::contact::{Contact, check_contacts};
use crate::scene::loads::Damping;
use crate::scene::mass::PointMass;
use crate::scene::material::{BendingLaw, Material, StretchLaw};
use crate::scene::number::{Candidates, NumberVisitor, Quantity, SceneNumber, is_default, is_one};
use crate::scene::per_axis::PerAxis;
use crate::scene::point::Point;
use crate::scene::rod::{CURVATURE_FACTOR, Dimension, check_end, one};
use crate::scene::rod_contact::{RodContactLaw, check_rod_contacts};
use crate::scene::scheme::{Scheme, SchemeParameter};
use crate::scene::section::Section;
use crate::scene::shape::Shape;
use crate::scene::structure_recording::StructureRecording;
use crate::scene::structure_support::check_supports;
use crate::scene::support::Support;
use crate::scene::table::{NumberTree, TABLE, TableKind, table};
use crate::scene::taper::Taper;
use crate::scene::time::Time;
use crate::scene::{InitialState, Scene};
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

pub use crate::scene::structure_support::{RodEnd, StructureSupport, SupportedEnd};

/// Coordinates and displacements, m.
const PLACE: Quantity = Quantity::signed("m");

table! {
    /// A scene of several rods, with the bodies and joints that connect them. Read one with [`StructureScene::load`].
    pub struct StructureScene {
        /// `auto`: in a plane where rods, bodies, joints and loads are in one, else in space; `planar`; `spatial`.
        #[serde(default, skip_serializing_if = "is_default")]
        pub dimension: Dimension,
        /// The rods.
        pub rods: Vec<StructureRod<D>> = TABLE,
        /// Materials that rods name.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        pub materials: Vec<NamedMaterial<D>> = TABLE,
        /// Rigid bodies.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        pub bodies: Vec<RigidBody<D>> = TABLE,
        /// Joints between rods, and of rods with bodies.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        pub joints: Vec<StructureJoint<D>> = TABLE,
        /// Supports of the ends of rods.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        pub supports: Vec<StructureSupport>,
        /// Recorded markers, which recorded supports follow and fits observe.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        pub recording: Option<StructureRecording>,
        /// Gravity, forces and damping.
        #[serde(default)]
        pub loads: StructureLoads<D> = TABLE,
        /// Obstacles that all rods touch.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        pub contacts: Vec<Contact<D>> = TABLE,
        /// Contacts of the rods with each other.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        pub rod_contacts: Vec<RodContactLaw<D>> = TABLE,
        /// State at t = 0.
        #[serde(default, skip_serializing_if = "is_default")]
        pub initial: StructureStart,
        /// Duration, time step and integration scheme.
        pub time: Option<Time<D>> = TABLE,
        /// Relation between recorded and scene coordinates; used by fits only.
        #[serde(default, skip_serializing_if = "Camera::is_default")]
        pub camera: Camera<D> = TABLE,
        /// The file the scene was read from.
        #[serde(skip)]
        pub path: Option<PathBuf>,
    }
}

table! {
    /// `[[rods]]`: a rod of a structure.
    pub struct StructureRod by name {
        /// Name of the rod.
        pub name: String,
        /// Number of edges, at least 6.
        pub segments: usize,
        /// Shape of the rod without loads.
        pub shape: Shape<D> = TABLE,
        /// Displacement of the shape, m: the position of arc length 0 of straight rods and arcs. Default: zero for the
        /// first rod, for others the place that a joint gives.
        #[serde(
            default,
            deserialize_with = "crate::input::arrays::some_numbers",
            skip_serializing_if = "Option::is_none"
        )]
        pub origin: Option<[D; 3]> = PLACE,
        /// Cross-section of the rod.
        pub section: Section<D> = TABLE,
        /// Name of a material, or a material.
        pub material: RodMaterial<D> = TABLE,
        /// Factors along the rod on section and material.
        #[serde(default, skip_serializing_if = "Taper::is_none")]
        pub taper: Taper<D> = TABLE,
        /// Factor on the curvature of the rest shape that gives the stress-free curvature.
        #[serde(default = "one::<D>")]
        pub natural_curvature: Along<D> = CURVATURE_FACTOR,
        /// Factor on the internal damping of this rod: its damping times and the stiffness of Maxwell branches in
        /// `loads.damping`.
        #[serde(default = "crate::scene::number::one::<D>", skip_serializing_if = "is_one")]
        pub damping_factor: D = Quantity::positive("").vanishing(),
        /// Point masses on the rod.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        pub mass: Vec<PointMass<D>> = TABLE,
        /// Number of edges of another mesh than the scene's own. Points that the scene names by a node index keep their
        /// arc length.
        #[serde(skip)]
        pub(crate) remeshed: Option<usize>,
    }
}

impl StructureRod {
    /// Rejects values at arc lengths that do not end with the rod ([`check_end`]); their keys are below `rods.<name>`.
    pub(super) fn check_ends_of_lists(&self) -> Result<(), Error> {
        let (rod, length) = (format!("rods.{}", self.name), self.shape.curve_length());
        check_end(&format!("{rod}.natural_curvature"), &self.natural_curvature, length)?;
        self.taper
            .factors()
            .into_iter()
            .try_for_each(|(key, along)| check_end(&format!("{rod}.taper.{key}"), along, length))
    }

    /// Scales the arc lengths of all values that are given at arc lengths, so that the last one is the present length
    /// of the rod.
    pub(super) fn end_lists_with_rod(&mut self) {
        let length = self.shape.curve_length();
        for along in self.taper.factors_mut().chain([&mut self.natural_curvature]) {
            along.end_at(length);
        }
    }
}

table! {
    /// `[[materials]]`: a material with a name.
    pub struct NamedMaterial by name {
        /// Name of the material.
        pub name: String,
        /// Density, kg/m^3.
        pub density: D = Quantity::positive("kg/m^3").searched(Candidates::Decades(100.0, 2e4, 2.0)),
        /// Young's modulus E, Pa.
        pub youngs_modulus: D = Quantity::positive("Pa").searched(Candidates::Decades(1e3, 1e13, 3.0)),
        /// Poisson's ratio.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        pub poisson_ratio: Option<D> = Quantity::signed("").within(-1.0 + 1e-9, 0.5),
        /// Shear modulus G, Pa; instead of Poisson's ratio.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        pub shear_modulus: Option<D> = Quantity::positive("Pa"),
        /// The law of the stretch.
        #[serde(default, skip_serializing_if = "is_default")]
        pub stretch_law: StretchLaw,
        /// C2/(C1 + C2) of a Mooney-Rivlin stretch.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        pub mooney_rivlin_ratio: Option<D> = Quantity::signed("").within(0.0, 1.0),
        /// The law of the bending; linear by default.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        pub bending_law: Option<BendingLaw<D>> = TABLE,
    }
}

impl<D: Copy> NamedMaterial<D> {
    /// The material with the constants of this one, without its name.
    fn material(&self) -> Material<D> {
        Material {
            density: self.density,
            youngs_modulus: self.youngs_modulus,
            poisson_ratio: self.poisson_ratio,
            shear_modulus: self.shear_modulus,
            stretch_law: self.stretch_law,
            mooney_rivlin_ratio: self.mooney_rivlin_ratio,
            bending_law: self.bending_law.clone(),
        }
    }
}

/// `rods.material`: the name of a material, or its constants.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[cfg_attr(test, schemars(bound = "D: SceneNumber + schemars::JsonSchema"))]
#[serde(
    untagged,
    expecting = "expected the name of one of [[materials]], or a table with density and youngs_modulus",
    bound = "D: SceneNumber"
)]
pub enum RodMaterial<D = f64> {
    /// Name of one of `[[materials]]`.
    Name(String),
    /// Constants of the material.
    Own(Material<D>),
}

impl NumberTree for RodMaterial {
    type Kind = TableKind;
    type Over<D> = RodMaterial<D>;

    /// The material over the number type `D`: a name is copied, the numbers of own constants are converted by the
    /// visitor below the path `key`.
    fn map_numbers<D: From<f64>>(
        &self,
        key: &str,
        kind: TableKind,
        visitor: &mut NumberVisitor<'_, D>,
    ) -> RodMaterial<D> {
        match self {
            Self::Name(name) => RodMaterial::Name(name.clone()),
            Self::Own(material) => RodMaterial::Own(material.map_numbers(key, kind, visitor)),
        }
    }

    /// Rejects own constants that are not finite or not of an allowed sign, with paths below `key`; a name is accepted.
    fn check_numbers(&self, key: &str, kind: TableKind) -> Result<(), Error> {
        match self {
            Self::Name(_) => Ok(()),
            Self::Own(material) => material.check_numbers(key, kind),
        }
    }
}

table! {
    /// `[[bodies]]`: a rigid body.
    pub struct RigidBody by name {
        /// Name of the body.
        pub name: String,
        /// Mass, kg.
        pub mass: D = Quantity::positive("kg"),
        /// Moment of inertia about its center of mass, kg m^2: one number in a plane, or the three principal ones.
        pub inertia: PerAxis<D> = Quantity::positive("kg m^2"),
        /// Rotation vector from the world axes to the principal axes at rest, rad.
        #[serde(
            default,
            deserialize_with = "crate::input::arrays::some_numbers",
            skip_serializing_if = "Option::is_none"
        )]
        pub orientation: Option<[D; 3]> = Quantity::signed("rad"),
        /// Position of its center of mass at rest, m.
        #[serde(deserialize_with = "crate::input::arrays::numbers")]
        pub position: [D; 3] = PLACE,
    }
}

table! {
    /// `[[joints]]`: a joint of two or more ends of rods, of which one may be a body.
    pub enum StructureJoint {
        /// All directions and positions are shared.
        Rigid {
            /// Ends of rods, and at most one body.
            connects: Vec<JointEnd<D>> = TABLE,
        },
        /// Positions are shared; all rods turn freely.
        Ball {
            /// Ends of rods, and at most one body.
            connects: Vec<JointEnd<D>> = TABLE,
        },
        /// Positions are shared; every end but the first turns freely about an axis. In a plane the same as `ball`.
        Hinge {
            /// Ends of rods; in space a body only as the first entry.
            connects: Vec<JointEnd<D>> = TABLE,
            /// Direction of the axis at rest, of any length; required in space. In a plane it is the normal.
            #[serde(
                default,
                deserialize_with = "crate::input::arrays::some_numbers",
                skip_serializing_if = "Option::is_none"
            )]
            axis: Option<[D; 3]> = Quantity::signed(""),
        },
        /// Positions are shared; every end but the first turns against the first one with an elastic moment.
        Spring {
            /// Ends of rods; a body only as the first entry.
            connects: Vec<JointEnd<D>> = TABLE,
            /// Angle over moment, rad/(N m): one number, or in space those of rotations about both directors and the
            /// tangent of the end.
            rotation: PerAxis<D> = Quantity::positive("rad/(N m)").searched(Candidates::Here),
            /// Rotation of the end relative to the first one without moment, rad; 0 is that of the rest shapes. In a
            /// plane an angle, counterclockwise; in space a rotation vector along both directors and the tangent of the
            /// end.
            #[serde(default, skip_serializing_if = "is_default")]
            rest: PerAxis<D> = Quantity::ANGLE,
            /// Time of the viscous moment (Kelvin-Voigt), s: moment over stiffness and rate of rotation.
            #[serde(default, skip_serializing_if = "is_default")]
            damping: D = Quantity::positive("s").searched(Candidates::Decades(1e-4, 1.0, 1.0)).vanishing(),
        },
    }
}

impl<D> StructureJoint<D> {
    /// The ends of rods and the body that the joint connects, in the order of the file.
    pub fn connects(&self) -> &[JointEnd<D>] {
        match self {
            Self::Rigid { connects }
            | Self::Ball { connects }
            | Self::Hinge { connects, .. }
            | Self::Spring { connects, .. } => connects,
        }
    }
}

table! {
    /// An end of a rod, `{ rod = "a", at = "end" }`, or a point of a body, `{ body = "b", offset = [0, 0.1, 0] }`.
    pub struct JointEnd {
        /// Name of the rod.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        pub rod: Option<String>,
        /// End of the rod.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        pub at: Option<RodEnd>,
        /// Name of the body.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        pub body: Option<String>,
        /// Point of the body relative to its center of mass at rest, m; default: where the rod ends.
        #[serde(
            default,
            deserialize_with = "crate::input::arrays::some_numbers",
            skip_serializing_if = "Option::is_none"
        )]
        pub offset: Option<[D; 3]> = PLACE,
    }
}

/// `[initial]` of a structure.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct StructureStart {
    /// `rest`, `equilibrium`, or `recorded`: position and velocity from the first two frames of `[recording]`.
    #[serde(default)]
    pub state: InitialState,
}

table! {
    /// `[loads]` of a structure.
    #[derive(Default)]
    pub struct StructureLoads {
        /// Gravitational acceleration, m/s^2.
        #[serde(deserialize_with = "crate::input::arrays::numbers", default)]
        pub gravity: [D; 3] = Quantity::signed("m/s^2"),
        /// Damping of the motion of all rods.
        #[serde(default)]
        pub damping: Damping<D> = TABLE,
        /// Constant forces.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        pub point: Vec<StructureForce<D>> = TABLE,
    }
}

table! {
    /// `[[loads.point]]` of a structure: a constant force at a point of a rod, or on the center of mass of a body.
    pub struct StructureForce {
        /// Name of the rod.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        pub rod: Option<String>,
        /// Position on the rod: `"tip"`, a node index or `{ arc_length = m }`; default: the tip.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        pub node: Option<Point<D>> = TABLE,
        /// Name of the body.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        pub body: Option<String>,
        /// Force in world axes, N.
        #[serde(deserialize_with = "crate::input::arrays::numbers")]
        pub force: [D; 3] = Quantity::signed("N"),
    }
}

/// Smallest number of edges of a rod, so that its ends are not coupled.
const SEGMENTS: usize = 6;

impl StructureScene {
    /// Rejects numbers and names that are not allowed; files are not read. Checked are, in this order:
    ///
    /// - names: a letter or _, then letters, digits, _ and -, not twice in a list
    /// - rods: at least one, each with at least `SEGMENTS` edges and a known material
    /// - loads: on one rod or one body that exists
    /// - three moments of inertia of a body: none above the sum of the others
    /// - the initial state: rest, equilibrium, or with a `[recording]` recorded
    /// - supports and contacts; and that there is no internal friction
    /// - `[time]`: a step up to its end, and a scheme that supports joints and supports
    ///
    /// Connections of joints, and supports of unknown rods, are checked when a model is built.
    ///
    /// # Errors
    /// [`Error::Invalid`] with file, key, and the found and the allowed value.
    pub fn validate(&self) -> Result<(), Error> {
        self.check().map_err(|error| error.in_file(self.path.as_deref()))
    }

    /// The checks of [`validate`](Self::validate), without the file in the error; the first error is returned. In this
    /// order: signs of numbers, at least one rod, names, numbers of edges and materials of rods, targets of loads. Then
    /// each of three moments of inertia of a body is at most the sum of the others. Initial state, supports, friction
    /// and `[time]` with its scheme follow.
    fn check(&self) -> Result<(), Error> {
        self.check_numbers("", TABLE)?;
        ensure(!self.rods.is_empty(), "rods", "an empty list", "at least one rod")?;
        // Names are parts of the paths of parameters: without dots, and unique in their list.
        let lists: [(&str, Vec<&String>); 3] = [
            ("rods", self.rods.iter().map(|rod| &rod.name).collect()),
            ("materials", self.materials.iter().map(|material| &material.name).collect()),
            ("bodies", self.bodies.iter().map(|body| &body.name).collect()),
        ];
        for (list, names) in lists {
            for (i, name) in names.iter().enumerate() {
                let letters = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
                let begins = name.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_');
                let allowed = "a letter or _, then letters, digits, _ and -";
                ensure(
                    begins && name.chars().all(letters),
                    format!("{list}[{i}].name"),
                    name,
                    allowed,
                )?;
                let allowed = format!("names that differ: {list}[..].name");
                ensure(!names[..i].contains(name), format!("{list}[{i}].name"), name, allowed)?;
            }
        }
        for rod in &self.rods {
            let key = format!("rods.{}.segments", rod.name);
            ensure(rod.segments >= SEGMENTS, key, rod.segments, format!("{SEGMENTS} or more"))?;
            self.material_of(rod)?;
        }
        for (k, load) in self.loads.point.iter().enumerate() {
            let key = format!("loads.point[{k}]");
            let allowed = "either rod, with node, or body";
            match (&load.rod, &load.body, &load.node) {
                (Some(rod), None, _) => drop(self.rod(&format!("{key}.rod"), rod)?),
                (None, Some(body), None) => drop(self.body(&format!("{key}.body"), body)?),
                (None, Some(_), Some(_)) => {
                    let allowed = "no such key with body, whose center of mass the force acts on";
                    return Err(Error::invalid(format!("{key}.node"), "a place on a rod", allowed));
                }
                (Some(_), Some(_), _) => return Err(Error::invalid(key, "rod and body", allowed)),
                (None, None, _) => {
                    return Err(Error::invalid(key, "neither rod nor body", allowed));
                }
            }
        }
        for body in &self.bodies {
            // No distribution of mass has a principal moment above the sum of the others.
            if let PerAxis::Three([a, b, c]) = body.inertia {
                let key = format!("bodies.{}.inertia", body.name);
                let allowed = "moments of inertia of which none exceeds the sum of the others";
                let possible = a <= b + c && b <= a + c && c <= a + b;
                ensure(possible, key, format!("[{a}, {b}, {c}]"), allowed)?;
            }
        }
        let state = self.initial.state;
        let allowed = "\"rest\", \"equilibrium\" or \"recorded\", for a structure";
        let is_known = state != InitialState::Shape;
        ensure(is_known, "initial.state", format!("{state:?}").to_lowercase(), allowed)?;
        let has_recording = state != InitialState::Recorded || self.recording.is_some();
        let allowed = "with a table [recording] only";
        ensure(has_recording, "initial.state", "\"recorded\"", allowed)?;
        check_supports(self.recording.is_some(), &self.supports, |name| {
            let rod = self.rods.iter().find(|rod| rod.name == name)?;
            Some(rod.segments)
        })?;
        self.check_contacts()?;
        let names: Vec<&str> = self.rods.iter().map(|rod| &*rod.name).collect();
        let sections: Vec<&Section> = self.rods.iter().map(|rod| &rod.section).collect();
        check_rod_contacts(&self.rod_contacts, &names, &sections)?;
        self.loads.damping.check()?;
        let friction = self.loads.damping.friction.is_some();
        ensure(!friction, "loads.damping.friction", "a table", "no such key for a structure")?;
        if let Some(time) = &self.time {
            time.check(false)?;
            let allowed = "a step, s: the program does not choose that of a structure";
            ensure(time.step.is_some(), "time.step", "no such key", allowed)?;
            let (step, allowed) = (time.step_size(), format!("up to time.end, {} s", time.end));
            ensure(step <= time.end, "time.step", step, allowed)?;
            self.check_scheme(time)?;
        }
        Ok(())
    }
}

impl StructureScene {
    /// Rejects schemes that take no contacts beside contacts of rods. Rejects springs with damping, contacts of rods
    /// with damping or friction, and recorded supports, for schemes other than Newmark-beta and generalized-alpha.
    fn check_scheme(&self, time: &Time) -> Result<(), Error> {
        let takers = Scheme::all().filter(|scheme| scheme.traits().takes_contacts);
        let takers: Vec<String> = takers.map(|scheme| format!("\"{}\"", scheme.name())).collect();
        let takes_contacts = time.scheme.traits().takes_contacts || self.rod_contacts.is_empty();
        let allowed = format!("{}, with rod_contacts", takers.join(", "));
        ensure(takes_contacts, "time.scheme", format!("\"{}\"", time.scheme.name()), allowed)?;
        if matches!(time.scheme, Scheme::NewmarkBeta | Scheme::GeneralisedAlpha) {
            return Ok(());
        }
        let found = format!("\"{}\"", time.scheme.name());
        let allowed = "\"newmark-beta\" or \"generalised-alpha\", with damping of joints";
        ensure(!self.has_damped_joints(), "time.scheme", &found, allowed)?;
        for (i, contact) in self.rod_contacts.iter().enumerate() {
            let name = if contact.has_friction() { "friction" } else { "damping" };
            let key = format!("rod_contacts[{i}].{name}");
            let found = format!("{name} with the scheme {}", time.scheme.name());
            let allowed = "\"newmark-beta\" or \"generalised-alpha\", with damping or friction";
            ensure(!contact.is_dissipative(), key, found, allowed)?;
        }
        let is_recorded = self.has_recorded_ends();
        let allowed = "\"newmark-beta\" or \"generalised-alpha\", with recorded supports";
        ensure(!is_recorded, "time.scheme", &found, allowed)
    }

    /// Rejects invalid contacts ([`check_contacts`]) of any rod, and obstacles that are moved by a recording.
    fn check_contacts(&self) -> Result<(), Error> {
        for rod in &self.rods {
            check_contacts(&self.contacts, &rod.section)?;
        }
        for (i, contact) in self.contacts.iter().enumerate() {
            for (k, motion) in contact.motions().iter().enumerate() {
                let key = format!("contacts[{i}].motion[{k}].file");
                let allowed = "no such key for a structure: a displacement with ramp or frequency";
                let is_formula = motion.file.as_os_str().is_empty();
                ensure(is_formula, key, motion.file.display(), allowed)?;
            }
        }
        Ok(())
    }

    /// Whether any spring joint has a damping time other than zero.
    pub(crate) fn has_damped_joints(&self) -> bool {
        let is_damped = |joint: &StructureJoint| match joint {
            StructureJoint::Spring { damping, .. } => *damping != 0.0,
            _ => false,
        };
        self.joints.iter().any(is_damped)
    }

    /// Whether the kind of any support is recorded.
    pub(crate) fn has_recorded_ends(&self) -> bool {
        self.supports.iter().any(|own| own.kind == Support::Recorded)
    }
}

impl<D: Copy> StructureScene<D> {
    /// Index in `[[rods]]` of the rod with this name. An unknown name is an error at `key`, with the known names.
    pub fn rod(&self, key: &str, name: &str) -> Result<usize, Error> {
        index(self.rods.iter().map(|rod| &rod.name), key, name, "rods")
    }

    /// Index in `[[bodies]]` of the body with this name. An unknown name is an error at `key`, with the known names.
    pub fn body(&self, key: &str, name: &str) -> Result<usize, Error> {
        index(self.bodies.iter().map(|body| &body.name), key, name, "bodies")
    }

    /// The material of a rod: its own constants, or those of the entry of `[[materials]]` that it names. An error, with
    /// the key of the rod, for an unknown name.
    pub fn material_of(&self, rod: &StructureRod<D>) -> Result<Material<D>, Error> {
        match &rod.material {
            RodMaterial::Own(material) => Ok(material.clone()),
            RodMaterial::Name(name) => {
                let names = self.materials.iter().map(|material| &material.name);
                let key = format!("rods.{}.material", rod.name);
                let i = index(names, &key, name, "materials")?;
                Ok(self.materials[i].material())
            }
        }
    }
}

/// Index of the first of `names` that equals `name`. `list` is their list in the scene, such as `rods`. The error for
/// an unknown name has `key` and the known names, or that the list is empty.
fn index<'a>(
    names: impl Iterator<Item = &'a String> + Clone,
    key: &str,
    name: &str,
    list: &str,
) -> Result<usize, Error> {
    names.clone().position(|own| own == name).ok_or_else(|| {
        let known: Vec<&str> = names.map(String::as_str).collect();
        let allowed = match known.is_empty() {
            true => format!("no name, as there are no [[{list}]]"),
            false => format!("one of {}", known.join(", ")),
        };
        Error::invalid(key, format!("\"{name}\""), allowed)
    })
}

impl StructureScene {
    /// The scene over another number type. `convert` returns the new number of the path, value and quantity (unit,
    /// limits) of each physical number, in the order of the tables. It is not called for `time.beta` and `time.rho_inf`
    /// unless the scheme uses them: without effect they are no parameters, and become constants.
    pub fn map_numbers<D: From<f64>>(
        &self,
        mut convert: impl FnMut(&str, f64, Quantity) -> D,
    ) -> StructureScene<D> {
        let parameter = self.time.as_ref().and_then(|time| time.scheme.traits().parameter);
        // Numbers without effect in this scene are no parameters of it.
        let has_effect = |path: &str| match path {
            "time.beta" => parameter == Some(SchemeParameter::Beta),
            "time.rho_inf" => parameter == Some(SchemeParameter::RhoInf),
            _ => true,
        };
        let mut convert = |path: &str, value: f64, quantity| match has_effect(path) {
            true => convert(path, value, quantity),
            false => D::from(value),
        };
        NumberTree::map_numbers(self, "", TABLE, &mut NumberVisitor::new(&mut convert))
    }

    /// The scene of the rod with the index `rod` alone, in plain numbers, with these supports of its start and end and
    /// the model of `dimension`. It has the numbers that [`fill_part`](Self::fill_part) sets, the number of edges of
    /// the rod, and the path of the file; there are no point loads. An error for an unknown material.
    pub(crate) fn part(
        &self,
        rod: usize,
        supports: [Support; 2],
        dimension: Dimension,
    ) -> Result<Scene, Error> {
        let own = &self.rods[rod];
        let material = self.material_of(own)?;
        let mut scene = Scene::new(own.segments, own.shape.clone(), own.section.clone(), material);
        scene.rod.dimension = dimension;
        scene.remeshed = own.remeshed;
        [scene.supports.start, scene.supports.end] = supports;
        self.fill_part(rod, &mut scene)?;
        scene.path.clone_from(&self.path);
        Ok(scene)
    }
}

impl<D: Scalar> StructureScene<D> {
    /// Replaces shape, section, taper, natural curvature, masses and material in `scene` by those of the rod of this
    /// index. Gravity, damping, contacts and `[time]` become those of the structure. Other keys are unchanged. An error
    /// for an unknown material.
    pub(crate) fn fill_part(&self, rod: usize, scene: &mut Scene<D>) -> Result<(), Error> {
        let own = &self.rods[rod];
        scene.rod.shape = own.shape.clone();
        scene.rod.section = own.section.clone();
        scene.rod.taper = own.taper.clone();
        scene.rod.natural_curvature = own.natural_curvature.clone();
        scene.rod.mass.clone_from(&own.mass);
        scene.material = self.material_of(own)?;
        scene.loads.gravity = self.loads.gravity;
        scene.loads.damping = self.loads.damping.clone();
        scene.contacts.clone_from(&self.contacts);
        scene.time.clone_from(&self.time);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Lists at arc lengths end with their rod; in a structure that is saved after a length has changed they do again.
    #[test]
    fn lists_of_a_structure_end_with_their_rod() {
        let read = |last: f64| {
            let text = format!(
                "[[rods]]\nname = \"a\"\nsegments = 10\n\
                 shape = {{ kind = \"straight\", length = 0.5, direction = [1, 0, 0] }}\n\
                 section = {{ kind = \"circle\", radius = 3e-3 }}\n\
                 material = {{ density = 1100, youngs_modulus = 2e7 }}\n\
                 taper.radius = {{ at = [0, 0.3, {last}], factor = [1, 0.8, 0.5] }}\n"
            );
            StructureScene::from_toml(&text, ".")
        };
        let error = read(0.4).unwrap_err().to_string();
        assert!(error.contains("rods.a.taper.radius.at: found 0.4 m"), "{error}");
        let mut structure = read(0.5).unwrap();
        let Shape::Straight { length, .. } = &mut structure.rods[0].shape else { unreachable!() };
        *length = 1.0;
        let mut scene = Scene::load("data/cantilever.toml").unwrap();
        scene.structure = Some(Box::new(structure));
        let saved = StructureScene::from_toml(&scene.to_toml().unwrap(), ".").unwrap();
        let Some(Along::BreakPoints(points)) = &saved.rods[0].taper.radius else {
            panic!("no list")
        };
        assert_eq!(points.at, [0.0, 0.6, 1.0]);
    }
}
