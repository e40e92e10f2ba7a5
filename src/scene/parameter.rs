//! Parameters: the physical [numbers](crate::scene::number) of a scene by their path in the file, or by a short name.
//!
//! Trajectories are differentiated with respect to parameters, and fits identify them. A [`Parameter`] is a path and
//! the name by which it was constructed; it has no value, which a scene has (`of`). A scene with other values is a copy
//! (`set`, `set_all`). The quantity (unit, limits, search range) of a built-in parameter is that of its path with list
//! indices and names replaced by placeholders. All such paths come from `catalog_scenes`, which contain every kind of
//! table; those of user-defined energies come from their declarations.
//!
//! Names are paths (`rod.natural_curvature.0`), short names (`youngs_modulus`), or numbered parts of lists, counted
//! from 1 (`natural_curvature.1`). Two names of one path are equal parameters. Numbers without effect in a scene are no
//! parameters of it ([`Scene::map_numbers`]). To parse an unknown name, and to set a parameter that the scene does not
//! have, are errors with similar names; [`Parameter::named`] and `of` return `None`.
//!
//! [`Scene::over_parameters`] converts a scene to another number type, with a given number for each parameter.

use crate::error::Error;
use crate::scene::Scene;
use crate::scene::loads::Damping;
use crate::scene::nearest::{LONGEST_NAME, nearest};
use crate::scene::number::Quantity;
use crate::scene::scene_catalog::catalog_scenes;
use crate::scene::structure_catalog::{ANY_NAME, catalog_structure};
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};
use std::fmt;
use std::hash::{Hash, Hasher};
use std::sync::{Mutex, OnceLock, PoisonError};

/// A physical number of a scene, by its path in the file: `rod.shape.length`,
/// `loads.point.0.force.y`. Common numbers also have short names, `radius`.
///
/// ```
/// use rodfit::Parameter;
/// let length: Parameter = "rod.shape.length".parse()?;
/// assert_eq!((length.name(), length.unit()), ("rod.shape.length", "m"));
/// let modulus: Parameter = "youngs_modulus".parse()?;
/// assert_eq!(modulus, Parameter::YoungsModulus);
/// assert_eq!(modulus.path(), "material.youngs_modulus");
/// # Ok::<(), rodfit::Error>(())
/// ```
/// It is displayed and written under the name by which it was constructed. Two names of one path are the same
/// parameter.
#[derive(Clone, Copy)]
pub struct Parameter {
    /// Path in the scene file.
    path: &'static str,
    /// Path or short name by which it was constructed.
    name: &'static str,
}

impl PartialEq for Parameter {
    /// Whether the paths are equal; names are not compared.
    fn eq(&self, other: &Self) -> bool {
        self.path == other.path
    }
}

impl Eq for Parameter {}

impl Hash for Parameter {
    /// Adds the path to the hash; equal parameters have equal hashes.
    fn hash<H: Hasher>(&self, state: &mut H) {
        self.path.hash(state);
    }
}

/// Declares constants and short names of paths.
macro_rules! short_names {
    ($($(#[$doc:meta])* $constant:ident = $name:literal: $path:literal;)*) => {
        #[allow(non_upper_case_globals)]
        impl Parameter {
            $($(#[$doc])* pub const $constant: Self = Self { path: $path, name: $name };)*
        }
        const SHORT_NAMES: &[(&str, Parameter)] = &[$(($name, Parameter::$constant)),*];
    };
}

short_names! {
    /// Young's modulus E, Pa. A fit of it keeps the shear modulus or Poisson's ratio, whichever the scene gives.
    YoungsModulus = "youngs_modulus": "material.youngs_modulus";
    /// Shear modulus G, Pa.
    ShearModulus = "shear_modulus": "material.shear_modulus";
    /// Poisson's ratio.
    PoissonRatio = "poisson_ratio": "material.poisson_ratio";
    /// Density, kg/m^3.
    Density = "density": "material.density";
    /// Radius of a circular section, m.
    Radius = "radius": "rod.section.radius";
    /// Width of a rectangular section, across `up`, m.
    Width = "width": "rod.section.width";
    /// Height of a rectangular section, along `up`, m.
    Height = "height": "rod.section.height";
    /// Factor on the curvature of the rest shape.
    NaturalCurvature = "natural_curvature": "rod.natural_curvature";
    /// Stress-free twist per length, rad/m.
    NaturalTwist = "natural_twist": "rod.natural_twist";
    /// Parameter beta of the Newmark-beta scheme.
    Beta = "beta": "time.beta";
    /// Mass-proportional damping, 1/s.
    DampingMass = "damping.mass": "loads.damping.mass";
    /// Kelvin-Voigt time, s.
    DampingStiffness = "damping.stiffness": "loads.damping.stiffness";
    /// Additional Kelvin-Voigt time of bending, s.
    DampingBending = "damping.bending": "loads.damping.bending";
    /// Additional Kelvin-Voigt time of twist, s.
    DampingTwisting = "damping.twisting": "loads.damping.twisting";
    /// Additional Kelvin-Voigt time of stretch, s.
    DampingStretching = "damping.stretching": "loads.damping.stretching";
    /// Rotation of the whole rod about its first node in its plane, rad.
    ClampAngle = "clamp_angle": "supports.angle";
    /// Velocity of the rod at t = 0 along x, m/s.
    InitialVelocityX = "initial.velocity.x": "initial.velocity.x";
    /// Its component along y.
    InitialVelocityY = "initial.velocity.y": "initial.velocity.y";
    /// Its component along z.
    InitialVelocityZ = "initial.velocity.z": "initial.velocity.z";
    /// Angular velocity of the rod at t = 0 about x, rad/s.
    InitialAngularVelocityX = "initial.angular_velocity.x": "initial.angular_velocity.x";
    /// Its component about y.
    InitialAngularVelocityY = "initial.angular_velocity.y": "initial.angular_velocity.y";
    /// Its component about z.
    InitialAngularVelocityZ = "initial.angular_velocity.z": "initial.angular_velocity.z";
    /// Reading of the recording's clock when the motion starts, s.
    TimeOffset = "time_offset": "camera.time_offset";
    /// Ratio of recorded to real durations.
    TimeScale = "time_scale": "camera.time_scale";
    /// Ratio of recorded lengths to real lengths.
    PixelScale = "pixel_scale": "camera.pixel_scale";
    /// Rotation of the camera about the normal of the scene's plane, rad.
    InPlaneRotation = "in_plane_rotation": "camera.in_plane_rotation";
    /// Recorded position of the clamp minus its position in the scene, along x, m.
    ClampPositionX = "clamp_position.x": "camera.clamp_position.x";
    /// Its component along y.
    ClampPositionY = "clamp_position.y": "camera.clamp_position.y";
    /// Its component along z.
    ClampPositionZ = "clamp_position.z": "camera.clamp_position.z";
}

/// Keys of `[rod]` whose values may be lists along the rod. Short names of their entries are numbered from 1.
const LISTS: [&str; 2] = ["natural_curvature", "natural_twist"];

impl Parameter {
    /// The parameter with this path, which is not checked; its name is the path. The program keeps one copy of each
    /// path.
    pub(crate) fn at(path: &str) -> Self {
        let path = intern(path);
        Self { path, name: path }
    }

    /// Declares the quantity (unit, limits) of the parameter of a user-defined energy at `path`, for the whole program.
    /// If the path has been declared before, the first quantity remains; a scene with another one is rejected.
    pub(crate) fn declare(path: &str, quantity: Quantity) {
        let mut own = user_quantities().lock().unwrap_or_else(PoisonError::into_inner);
        own.entry(path.into()).or_insert(quantity);
    }

    /// The parameter of a name: a short name, a numbered part of a list (`natural_curvature.1`, counted from 1), or a
    /// path in the scene file. None for an unknown name, and for a path longer than `LONGEST_NAME` bytes. No scene is
    /// needed: list indices of any size, any names of named lists, and all paths `energy.<name>.<parameter>` are
    /// accepted.
    ///
    /// ```
    /// use rodfit::Parameter;
    /// assert_eq!(Parameter::named("youngs_modulus"), Some(Parameter::YoungsModulus));
    /// assert_eq!(Parameter::named("material.youngs_modulus"), Some(Parameter::YoungsModulus));
    /// assert_eq!(Parameter::named("elasticity"), None);
    /// ```
    pub fn named(name: &str) -> Option<Self> {
        if let Some((_, parameter)) = SHORT_NAMES.iter().find(|(short, _)| *short == name) {
            return Some(*parameter);
        }
        // natural_curvature.1 is the first entry, rod.natural_curvature.0 in the file.
        for list in LISTS {
            let part = name.strip_prefix(list).and_then(|rest| index(rest.strip_prefix('.')?));
            if let Some(part) = part.and_then(|part| part.checked_sub(1)) {
                let path = intern(&format!("rod.{list}.{part}"));
                return Some(Self { path, name: intern(name) });
            }
        }
        // A name that no scene could have is rejected before it is interned for ever.
        let known =
            |name: &str| quantities().contains_key(&general_path(name)) || is_of_user_energy(name);
        (name.len() <= LONGEST_NAME && known(name)).then(|| Self::at(name))
    }

    /// All parameters of a scene that have an effect there, in the order of its tables, under their paths.
    ///
    /// ```
    /// use rodfit::{Parameter, Scene};
    /// let scene = Scene::load("data/cantilever.toml")?;
    /// assert!(Parameter::all(&scene).contains(&Parameter::Density));
    /// assert_eq!(Parameter::Density.of(&scene), Some(1273.52)); // kg/m^3
    /// # Ok::<(), rodfit::Error>(())
    /// ```
    pub fn all(scene: &Scene) -> Vec<Self> {
        let mut all = Vec::new();
        scene.map_numbers(|path, value, _| {
            all.push(Self::at(path));
            value
        });
        all
    }

    /// The short name of the parameter, as a list of one; an empty list without one.
    pub fn aliases(self) -> Vec<&'static str> {
        Vec::from_iter(self.short_name())
    }

    /// Name by which the parameter was constructed: its path or a short name.
    pub fn name(self) -> &'static str {
        self.name
    }

    /// Short name of the parameter; none without one. Entry `i` of `rod.natural_curvature` and `rod.natural_twist`
    /// (paths count from 0) has the short name with the number `i + 1`.
    fn short_name(self) -> Option<&'static str> {
        if let Some((short, _)) = SHORT_NAMES.iter().find(|(_, parameter)| *parameter == self) {
            return Some(short);
        }
        let part = |list: &&str| {
            let part = self.path.strip_prefix("rod.")?.strip_prefix(*list)?.strip_prefix('.')?;
            Some(intern(&format!("{list}.{}", index(part)?.checked_add(1)?)))
        };
        LISTS.iter().find_map(part)
    }

    /// Path of the parameter in the scene file.
    pub fn path(self) -> &'static str {
        self.path
    }

    /// Unit, limits and search range of the parameter's path: those of the built-in parameter, else those that a
    /// user-defined energy declared. For other paths the quantity is a signed number without a unit.
    pub fn quantity(self) -> Quantity {
        // The quantities of user-defined energies are known once a program has attached them.
        let own = || {
            let own = user_quantities().lock().unwrap_or_else(PoisonError::into_inner);
            own.get(self.path).copied()
        };
        let known = quantities().get(&general_path(self.path)).copied();
        known.or_else(own).unwrap_or(Quantity::signed(""))
    }

    /// Unit of the parameter's [quantity](Self::quantity), such as `m`; empty for pure numbers.
    pub fn unit(self) -> &'static str {
        self.quantity().unit
    }

    /// Whether the value must be positive, or may also be zero, in which case fits identify its logarithm; false for
    /// signed numbers.
    pub fn is_positive(self) -> bool {
        self.quantity().is_positive
    }

    /// Whether only the recording depends on the parameter, and not the motion.
    pub fn is_of_the_recording(self) -> bool {
        self.quantity().is_of_the_recording
    }

    #[doc(hidden)]
    #[deprecated(since = "0.2.0", note = "renamed to is_of_the_recording")]
    pub fn is_of_the_camera(self) -> bool {
        self.is_of_the_recording()
    }

    /// Whether the parameter is a number of a rod, material, body or joint of a structure: its path begins with `rods`,
    /// `materials`, `bodies` or `joints`.
    pub(crate) fn is_of_structure(self) -> bool {
        let list = self.path.split('.').next().unwrap_or_default();
        ["rods", "materials", "bodies", "joints"].contains(&list)
    }

    /// Whether the parameter is a component of a moment, N m, of `loads.point` or `initial.point`.
    pub(crate) fn is_moment(self) -> bool {
        let is_of_point =
            ["loads.point.", "initial.point."].iter().any(|t| self.path.starts_with(t));
        is_of_point && self.path.contains(".moment.")
    }

    /// Whether the parameter is a Kelvin-Voigt time, s: `stiffness`, `bending`, `twisting` or `stretching` of
    /// `loads.damping`.
    pub(crate) fn is_of_kelvin_voigt(self) -> bool {
        let own = self.path.strip_prefix("loads.damping.");
        own.is_some_and(|own| Damping::<f64>::default().times().iter().any(|(key, _)| *key == own))
    }

    /// Smallest and largest allowed value in a fit, in the unit of the parameter, by its [quantity](Self::quantity).
    pub fn limits(self) -> [f64; 2] {
        self.quantity().limits
    }

    /// Value in a scene. None if the scene does not have the parameter, or it has no effect there
    /// ([`Scene::map_numbers`]).
    pub fn of(self, scene: &Scene) -> Option<f64> {
        let mut found = None;
        scene.map_numbers(|path, value, _| {
            if path == self.path {
                found = Some(value);
            }
            value
        });
        found
    }

    /// Replaces the value of the parameter in a scene, in the unit of its quantity and without validation. An error,
    /// with the scene unchanged, if the scene does not have the parameter.
    pub fn set(self, scene: &mut Scene, value: f64) -> Result<(), Error> {
        *scene = Self::set_all(scene, [(self, value)])?;
        Ok(())
    }

    /// A copy of the scene with other values of some parameters, not validated; of several values of one parameter the
    /// last. An error for a parameter that the scene does not have.
    pub(crate) fn set_all(
        scene: &Scene,
        values: impl IntoIterator<Item = (Self, f64)>,
    ) -> Result<Scene, Error> {
        // One walk over the scene sets all values; those that were not found are errors.
        let mut values: BTreeMap<&str, (Self, f64, bool)> =
            values.into_iter().map(|(p, value)| (p.path, (p, value, false))).collect();
        let changed = scene.map_numbers(|path, old, _| match values.get_mut(path) {
            Some((_, value, found)) => {
                *found = true;
                *value
            }
            None => old,
        });
        match values.into_values().find(|(.., found)| !found) {
            Some((parameter, ..)) => Err(parameter.absent(scene)),
            None => Ok(changed),
        }
    }

    /// Parameters of the entries of one list of a scene along the rod, in order from its start. `name` is the path of
    /// the list or its short name, `natural_curvature`; for a list of pairs it ends with one component,
    /// `rod.natural_bending.d1`.
    ///
    /// # Errors
    /// [`Error::Invalid`] for names that are not lists of the scene along the rod, as values of a signal, and for
    /// factors at given arc lengths.
    pub fn list(scene: &Scene, name: &str) -> Result<Vec<Self>, Error> {
        let place = if LISTS.contains(&name) { format!("rod.{name}") } else { name.to_string() };
        // Pairs of natural bending are lists of one component each.
        let (list, component) = match place.rsplit_once('.') {
            Some((list, component @ ("d1" | "d2"))) => (list, Some(component)),
            _ => (&place[..], None),
        };
        // A path of the list is its key, an index and, of pairs, the component.
        let of_list = |p: &Self| {
            let rest = p.path.strip_prefix(list).and_then(|rest| rest.strip_prefix('.'));
            let (count, own) = rest.map_or(("", None), |rest| match rest.split_once('.') {
                Some((count, own)) => (count, Some(own)),
                None => (rest, None),
            });
            count.parse::<usize>().is_ok() && own == component
        };
        // Factors at arc lengths of their own and values of signals are not spread along the rod.
        let is_along_rod = list.starts_with("rod.") && !list.ends_with(".factor");
        let all = Self::all(scene).into_iter().filter(|p| is_along_rod && of_list(p));
        let all: Vec<Self> = all.collect();
        match all.is_empty() {
            true => {
                let allowed = "a list of values along the rod in the scene: \
                               rod.natural_curvature, rod.natural_twist, rod.natural_bending.d1 or rod.natural_bending.d2";
                Err(Error::invalid("parameter", name, allowed))
            }
            false => Ok(all),
        }
    }

    /// The error for a parameter that a scene does not have. It contains the condition under which a scene has the
    /// parameter, and the three most similar names (short ones, where they exist) of the scene's parameters.
    pub fn absent(self, scene: &Scene) -> Error {
        let short = |p: Self| p.short_name().unwrap_or(p.path);
        let names: Vec<&str> = Self::all(scene).into_iter().map(short).collect();
        let place = self.path.rsplit_once('.').map_or("", |(table, _)| table);
        // The condition under which a scene would have the parameter, for the message.
        let needs = match self.path {
            "rod.section.radius" => "with a circular section or a tube",
            "rod.section.width" | "rod.section.height" => "with a rectangular section",
            "time.beta" => "with [time] and the scheme newmark-beta",
            "time.rho_inf" => "with [time] and the scheme generalised-alpha",
            "rod.natural_curvature" | "rod.natural_twist" => {
                "with a single number there; parts of a list are .1, .2, .."
            }
            _ if is_of_user_energy(self.path) => {
                "with a user-defined energy of that name and parameter, attached by the program"
            }
            _ => match place {
                "material" => "with its key in [material]",
                "rod.natural_curvature" | "rod.natural_twist" => {
                    "with a list there that has this index"
                }
                _ if place.starts_with("rod.taper") => "with that factor in rod.taper",
                "initial.velocity" | "initial.angular_velocity" => "with a [time]",
                _ => "a parameter of the scene",
            },
        };
        let allowed = format!("{needs}; the scene has {}", nearest(self.name(), &names));
        Error::invalid("parameter", self.name(), allowed)
    }
}

impl Serialize for Parameter {
    /// Writes the name by which it was constructed.
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.name())
    }
}

impl<'de> Deserialize<'de> for Parameter {
    /// Reads a path or short name; an error with similar names if it is unknown.
    fn deserialize<T: serde::Deserializer<'de>>(deserializer: T) -> Result<Self, T::Error> {
        Self::try_from(String::deserialize(deserializer)?).map_err(serde::de::Error::custom)
    }
}

#[cfg(test)]
impl schemars::JsonSchema for Parameter {
    /// Name of the JSON schema of `Parameter`.
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "Parameter".into()
    }

    /// JSON schema of `Parameter`: a string, with all short names and general paths as suggestions.
    fn json_schema(_: &mut schemars::SchemaGenerator) -> schemars::Schema {
        // Paths without list indices and names; lists, structures and user-defined energies have more.
        let is_whole = |place: &&String| !place.contains('#') && !place.contains(ANY_NAME);
        let places = quantities().keys().filter(is_whole).cloned();
        let names = SHORT_NAMES.iter().map(|(short, _)| short.to_string()).chain(places);
        schemars::json_schema!({
            "description": "Name of a parameter: its path in the scene file, as material.youngs_modulus or \
                            loads.point.0.force.y, or a short name; `rodfit parameters` lists all of a scene.",
            "type": "string",
            "anyOf": [{ "enum": names.collect::<Vec<_>>() }, {}],
        })
    }
}

impl TryFrom<String> for Parameter {
    type Error = String;

    /// The parameter of a path or short name. The error is a message with similar names.
    fn try_from(name: String) -> Result<Self, String> {
        Self::named(&name).ok_or_else(|| {
            // Paths of structures are similar to names of structures only.
            let mut parts = name.split('.');
            let own = parts.next().filter(|list| NAMED_LISTS.contains(list));
            let own = own.and_then(|_| parts.next());
            let is_similar = |p: &&String| own.is_some() || !p.contains(ANY_NAME);
            let places: Vec<String> = quantities()
                .keys()
                .filter(is_similar)
                .map(|p| p.replace('#', "0").replace(ANY_NAME, own.unwrap_or_default()))
                .collect();
            let short = SHORT_NAMES.iter().map(|(short, _)| *short);
            let names: Vec<&str> = places.iter().map(String::as_str).chain(short).collect();
            format!(
                "found the unknown parameter {name:?}, allowed: the path of a parameter in the \
                 scene file, or its short name, such as youngs_modulus. Similar names: {}",
                nearest(&name, &names)
            )
        })
    }
}

impl std::str::FromStr for Parameter {
    type Err = Error;

    /// The parameter of a path or short name. An unknown name is [`Error::Parse`] with similar names.
    fn from_str(name: &str) -> Result<Self, Error> {
        Self::try_from(name.to_string()).map_err(|message| Error::Parse { file: None, message })
    }
}

impl fmt::Display for Parameter {
    /// Writes the name by which it was constructed.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl fmt::Debug for Parameter {
    /// Writes the name by which it was constructed.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl Scene {
    /// The scene over another number type; `seed(parameter, value)` returns the new number of each parameter. Numbers
    /// without effect in the scene are converted without a call of `seed`.
    pub fn over_parameters<D: From<f64>>(&self, seed: impl Fn(Parameter, f64) -> D) -> Scene<D> {
        self.map_numbers(|path, value, _| seed(Parameter::at(path), value))
    }
}

/// Copy of a name that is never freed. All calls with the same name return the same copy.
fn intern(name: &str) -> &'static str {
    static NAMES: Mutex<BTreeSet<&'static str>> = Mutex::new(BTreeSet::new());
    let mut names = NAMES.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(name) = names.get(name) {
        return name;
    }
    // Leaked once for each name: parameters are copied and compared as pointers to text.
    let name: &'static str = Box::leak(name.into());
    names.insert(name);
    name
}

/// Index of an entry of a list from its text in a path; none for a sign, leading zeros and other text.
fn index(text: &str) -> Option<usize> {
    let index: usize = text.parse().ok()?;
    (index.to_string() == text).then_some(index)
}

/// Lists of a scene or a structure whose entries have names.
const NAMED_LISTS: [&str; 5] = ["rods", "materials", "bodies", "signals", "sensors"];

/// Path with `#` in place of parts that are digits only, the list indices: `loads.point.#.force.y`. The name of an
/// entry of a [named list](NAMED_LISTS), its second part, is replaced by [`ANY_NAME`].
fn general_path(path: &str) -> String {
    let is_named = path.split('.').next().is_some_and(|list| NAMED_LISTS.contains(&list));
    let is_index = |part: &str| !part.is_empty() && part.bytes().all(|b| b.is_ascii_digit());
    let general = |(i, part): (usize, &'_ str)| match is_index(part) {
        _ if i == 1 && is_named => ANY_NAME.to_string(),
        true => "#".to_string(),
        false => part.to_string(),
    };
    path.split('.').enumerate().map(general).collect::<Vec<_>>().join(".")
}

/// Whether a name has the form of a parameter of a user-defined energy, `energy.magnet.moment`: three parts, of which
/// the last two begin with a letter.
fn is_of_user_energy(name: &str) -> bool {
    let mut parts = name.split('.');
    parts.next() == Some("energy")
        && parts.clone().count() == 2
        && parts.all(|part| part.starts_with(|c: char| c.is_ascii_alphabetic()))
}

/// Quantities that user-defined energies declared for their parameters, by path. There is one map for the whole
/// program.
fn user_quantities() -> &'static Mutex<BTreeMap<String, Quantity>> {
    static QUANTITIES: Mutex<BTreeMap<String, Quantity>> = Mutex::new(BTreeMap::new());
    &QUANTITIES
}

/// Quantities (unit, limits, search range) of all built-in parameters by their [general path](general_path). They are
/// collected once from the catalog scenes.
fn quantities() -> &'static BTreeMap<String, Quantity> {
    static QUANTITIES: OnceLock<BTreeMap<String, Quantity>> = OnceLock::new();
    // The scenes below have every kind of table, so that their numbers are all parameters.
    QUANTITIES.get_or_init(|| {
        let mut quantities = BTreeMap::new();
        for scene in catalog_scenes() {
            let mut insert = |path: &str, value, quantity| {
                quantities.insert(general_path(path), quantity);
                value
            };
            catalog_structure(&scene).map_numbers(&mut insert);
            scene.map_numbers(insert);
        }
        quantities
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn short_name_is_an_alias_of_an_existing_path() {
        for (short, parameter) in SHORT_NAMES {
            assert!(quantities().contains_key(parameter.path), "{parameter}");
            assert_eq!(Parameter::named(short), Some(*parameter));
            let written = Parameter::named(parameter.path).unwrap();
            assert_eq!((written, written.name()), (*parameter, parameter.path));
            assert_eq!(parameter.name(), *short);
        }
    }

    #[test]
    fn set_value_is_read_back_under_the_same_name() {
        for mut scene in catalog_scenes() {
            for (i, parameter) in Parameter::all(&scene).into_iter().enumerate() {
                let value = 17.0 + i as f64;
                parameter.set(&mut scene, value).unwrap();
                assert_eq!(parameter.of(&scene), Some(value), "{parameter}");
            }
        }
    }

    /// Fits report an upper bound of damping that the data do not show, which requires that it may be zero.
    #[test]
    fn damping_parameters_may_be_zero() {
        let zero = |of: &[&str]| {
            of.iter().all(|name| name.parse::<Parameter>().unwrap().quantity().may_vanish)
        };
        assert!(zero(&["damping.mass", "damping.stiffness", "damping.bending"]));
        assert!(zero(&["damping.twisting", "damping.stretching"]));
        assert!(zero(&["loads.damping.maxwell.stiffness", "loads.drag.linear_normal"]));
        assert!(!zero(&["loads.damping.maxwell.time"]) && !zero(&["youngs_modulus"]));
    }

    /// Only the digits of an index have the form of one, and an index without a successor has no short name.
    #[test]
    fn indices_of_lists_have_one_spelling() {
        for name in ["natural_curvature.+1", "natural_curvature.01", "loads.point..force.y"] {
            assert_eq!(Parameter::named(name), None, "{name}");
        }
        let last = format!("rod.natural_curvature.{}", usize::MAX);
        assert!(Parameter::named(&last).unwrap().aliases().is_empty());
    }

    /// A user-defined energy may have any name.
    #[test]
    fn parameter_of_an_energy_named_moment_is_no_moment() {
        let is_moment = |name: &str| Parameter::named(name).unwrap().is_moment();
        assert!(is_moment("loads.point.0.moment.z") && is_moment("initial.point.1.moment.x"));
        assert!(!is_moment("energy.moment.k") && !is_moment("loads.point.0.force.z"));
    }

    /// `rodfit parameters` lists the axes of hinges.
    #[test]
    fn axis_of_a_hinge_is_a_known_parameter() {
        assert!("joints.0.axis.x".parse::<Parameter>().is_ok());
    }

    #[test]
    fn error_of_an_unknown_name_contains_the_nearest_one() {
        let message = |name: &str| name.parse::<Parameter>().unwrap_err().to_string();
        assert!(
            message("youngs_moduls").contains("youngs_modulus"),
            "{}",
            message("youngs_moduls")
        );
        assert!(message("lenght").contains("rod.shape.length"), "{}", message("lenght"));
        let second: Parameter = "natural_curvature.2".parse().unwrap();
        assert_eq!(
            (second.path(), second.name()),
            ("rod.natural_curvature.1", "natural_curvature.2")
        );
    }
}
