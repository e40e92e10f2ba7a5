//! The scene file: what it may say, and whether it makes sense. All quantities are SI.

pub mod along;
pub mod camera;
pub mod initial;
pub mod loads;
pub mod number;
pub mod own;
pub mod parameter;
pub mod plane;
pub mod point;
mod polyline;
pub mod scheme;
pub mod section;
pub mod shape;
pub mod supports;

pub use along::Along;
pub use camera::Camera;
pub use initial::{Initial, InitialState};
pub use loads::{Damping, Loads, PointForce};
pub use own::{At, Attached};
pub use parameter::Parameter;
pub use plane::Plane;
pub use point::{Point, Stencil};
pub use scheme::Scheme;
pub use section::Section;
pub use shape::{Handedness, Shape};
pub use supports::{Clamp, End, Motion, Support, Supports};

use crate::error::Error;
use crate::input::missing_keys::{Keys, Rule, always, if_there, missing};
use crate::scene::number::{Candidates, Numbers, Quantity, Written};
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;
use std::path::{Path, PathBuf};

/// Fewest and most edges of a rod.
const SEGMENTS: std::ops::RangeInclusive<usize> = 2..=10_000_000;
/// Most time steps of a simulation.
const MOST_STEPS: f64 = 1e9;

/// Everything a simulation needs to know. Read one with [`Scene::load`], or fill one in code:
///
/// ```
/// use rodfit::scene::*;
/// let shape = Shape::Straight { length: 0.5, direction: [1.0, 0.0, 0.0] };
/// let mut scene = Scene::new(50, shape, Section::Circle { radius: 0.005 }, Material::new(1273.52, 1e8));
/// scene.loads.gravity = [0.0, -9.8, 0.0];
/// scene.time = Some(Time::new(0.01, 1e-3));
/// let trajectory = scene.problem()?.simulate()?;
/// assert!(trajectory.tip(10)[1] < 0.0);
/// # Ok::<(), rodfit::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, bound = "D: Written")]
pub struct Scene<D = f64> {
    /// Shape, section and mesh.
    pub rod: RodSpec<D>,
    /// Density and moduli.
    pub material: Material<D>,
    /// What holds the ends.
    #[serde(default)]
    pub supports: Supports<D>,
    /// What pulls and damps.
    #[serde(default)]
    pub loads: Loads<D>,
    /// Where the rod is at t = 0.
    #[serde(default, skip_serializing_if = "Initial::is_rest")]
    pub initial: Initial<D>,
    /// How long and in which steps.
    pub time: Option<Time<D>>,
    /// How what was recorded relates to the scene.
    #[serde(default, skip_serializing_if = "Camera::is_default")]
    pub camera: Camera<D>,
    /// [Energies of one's own](crate::energy::own).
    #[serde(rename = "energy", default, skip_serializing_if = "Vec::is_empty", with = "own")]
    pub energies: Vec<Attached<D>>,
    /// The file the scene was read from; other paths are relative to it.
    #[serde(skip)]
    pub path: Option<PathBuf>,
    /// Edges to compute with, where they are not to be the scene's own; what it names by the index of a
    /// node stays where it is.
    #[serde(skip)]
    pub(crate) remeshed: Option<usize>,
}

/// `[rod]`
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, bound = "D: Written")]
pub struct RodSpec<D = f64> {
    /// Number of edges, 2 to 1e7; by default as many as a polyline has.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub segments: Option<usize>,
    /// Rest shape.
    pub shape: Shape<D>,
    /// Cross-section.
    pub section: Section<D>,
    /// Factor on the curvature of the rest shape: the rod is free of bending stress where it is
    /// so many times as curved. A list gives one for each of as many equal parts of its length; a
    /// rest shape that is straight has no curvature to be multiplied.
    #[serde(default = "one")]
    pub natural_curvature: Along<D>,
    /// Twist per length that the rod has when nothing acts on it, rad/m; or a list likewise.
    #[serde(default = "zero", skip_serializing_if = "is_zero")]
    pub natural_twist: Along<D>,
    /// Which model to use.
    #[serde(default)]
    pub dimension: Dimension,
    /// Which constants the elements get; by default the corrected ones, and the paper's with the
    /// paper's walls at the nodes.
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

/// Which model to use.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Dimension {
    /// The smallest model that can hold the scene.
    #[default]
    Auto,
    /// Stretch and bend in one plane.
    Planar,
    /// Stretch, bend and twist in space.
    Spatial,
}

/// Which constants the elements get.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Discretization {
    /// The paper's: chords and plain stiffnesses. A curved rod comes out too stiff.
    Paper,
    /// Arc lengths, stiffnesses that make up for the polygon, and sums that end at walls in the
    /// middle of an edge: see [`crate::problem::model`].
    Corrected,
    /// The same, and joints at the walls of straight rods corrected too: sags and swings of
    /// cantilevers come out better, frequencies of small vibrations worse.
    CorrectedStatics,
}

/// `[material]`
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, bound = "D: Written")]
pub struct Material<D = f64> {
    /// kg/m^3.
    pub density: D,
    /// E, Pa.
    pub youngs_modulus: D,
    /// In (-1, 0.5]; a spatial scene needs this or the shear modulus, a planar one neither.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub poisson_ratio: Option<D>,
    /// G, Pa.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub shear_modulus: Option<D>,
}

/// `[time]`
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "TimeForm<D>", into = "TimeForm<D>", bound = "D: Written")]
pub struct Time<D = f64> {
    /// Duration, s.
    pub end: f64,
    /// Step, s.
    pub step: f64,
    /// The time integrator.
    pub scheme: Scheme,
    /// Of Newmark-beta, in [0.5, 1]; 1 is implicit Euler.
    pub beta: D,
}

/// `[time]` as it is written: `beta` stands beside the scheme it belongs to only.
#[derive(Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields, bound = "D: Written")]
struct TimeForm<D> {
    end: f64,
    step: f64,
    #[serde(default)]
    scheme: Scheme,
    #[serde(skip_serializing_if = "Option::is_none")]
    beta: Option<D>,
}

impl<D: From<f64>> TryFrom<TimeForm<D>> for Time<D> {
    type Error = &'static str;

    fn try_from(form: TimeForm<D>) -> Result<Self, Self::Error> {
        let TimeForm { end, step, scheme, beta } = form;
        if beta.is_some() && !scheme.traits().takes_beta {
            return Err("time.beta: found beside another scheme, allowed: with newmark-beta only");
        }
        Ok(Self { end, step, scheme, beta: beta.unwrap_or(D::from(0.5)) })
    }
}

impl<D> From<Time<D>> for TimeForm<D> {
    fn from(Time { end, step, scheme, beta }: Time<D>) -> Self {
        Self { end, step, scheme, beta: scheme.traits().takes_beta.then_some(beta) }
    }
}

impl Material {
    fn over<D>(&self, n: &mut Numbers<'_, D>) -> Material<D> {
        let density = Quantity::positive("kg/m^3").searched(Candidates::Decades(100.0, 2e4, 2.0));
        let modulus = Quantity::positive("Pa");
        let youngs = modulus.searched(Candidates::Decades(1e3, 1e13, 3.0));
        let shear = modulus.searched(Candidates::OfYoungsModulus(0.01, 3.0));
        let ratio =
            Quantity::signed("").within(-1.0 + 1e-9, 0.5).searched(Candidates::Values(&[0.3]));
        Material {
            density: n.number("density", self.density, density),
            youngs_modulus: n.number("youngs_modulus", self.youngs_modulus, youngs),
            poisson_ratio: n.maybe("poisson_ratio", self.poisson_ratio, ratio),
            shear_modulus: n.maybe("shear_modulus", self.shear_modulus, shear),
        }
    }

    /// Density in kg/m^3 and Young's modulus in Pa; neither Poisson's ratio nor shear modulus.
    pub fn new(density: f64, youngs_modulus: f64) -> Self {
        Self { density, youngs_modulus, poisson_ratio: None, shear_modulus: None }
    }
}

impl RodSpec {
    fn over<D>(&self, n: &mut Numbers<'_, D>) -> RodSpec<D> {
        let factor = Quantity::signed("").within(-1e3, 1e3);
        let twist = Quantity::signed("rad/m").within(-1e6, 1e6);
        let factors = [factor.searched(Candidates::Values(&[0.5, 1.0, 1.5])), factor];
        let twists = [twist.searched(Candidates::PerLength(&[-2.0, 0.0, 2.0])), twist];
        RodSpec {
            segments: self.segments,
            shape: n.table("shape", |n| self.shape.over(n)),
            section: n.table("section", |n| self.section.over(n)),
            natural_curvature: self.natural_curvature.over("natural_curvature", factors, n),
            natural_twist: self.natural_twist.over("natural_twist", twists, n),
            dimension: self.dimension,
            discretization: self.discretization,
        }
    }
}

impl Time {
    fn over<D: From<f64>>(&self, n: &mut Numbers<'_, D>) -> Time<D> {
        let beta = Quantity::signed("").within(0.5, 1.0);
        let beta = beta.searched(Candidates::Values(&[0.55, 0.75, 0.95]));
        Time {
            end: self.end,
            step: self.step,
            scheme: self.scheme,
            beta: match self.scheme.traits().takes_beta {
                true => n.number("beta", self.beta, beta),
                false => D::from(self.beta),
            },
        }
    }

    /// Duration and step in s, Newmark-beta at beta = 0.5.
    pub fn new(end: f64, step: f64) -> Self {
        Self { end, step, scheme: Scheme::default(), beta: 0.5 }
    }

    /// Number of steps to the end; the last may be shorter.
    pub fn steps(&self) -> usize {
        ((self.end / self.step - 1e-9).ceil() as usize).max(1)
    }

    /// Time after `k` steps, s.
    pub fn at(&self, k: usize) -> f64 {
        if k >= self.steps() { self.end } else { k as f64 * self.step }
    }
}

impl<D> Scene<D> {
    /// The time integrator.
    pub fn scheme(&self) -> Scheme {
        self.time.as_ref().map_or_else(Scheme::default, |time| time.scheme)
    }
}

impl Scene {
    /// A rod clamped at its start (mid-edge), without loads and without a time.
    pub fn new(segments: usize, shape: Shape, section: Section, material: Material) -> Self {
        let rod = RodSpec {
            segments: Some(segments),
            shape,
            section,
            natural_curvature: one(),
            natural_twist: zero(),
            dimension: Dimension::Auto,
            discretization: None,
        };
        let (supports, loads) = (Supports::default(), Loads::default());
        let initial = Initial::default();
        let camera = Camera::default();
        Self {
            rod,
            material,
            supports,
            loads,
            initial,
            energies: Vec::new(),
            time: None,
            camera,
            path: None,
            remeshed: None,
        }
    }

    /// The same scene over other numbers: `make` gets the name of every physical number, its value
    /// and what kind of number it is.
    pub fn over<D: From<f64>>(&self, mut make: impl FnMut(&str, f64, Quantity) -> D) -> Scene<D> {
        let n = &mut Numbers::new(&mut make);
        Scene {
            rod: n.table("rod", |n| self.rod.over(n)),
            material: n.table("material", |n| self.material.over(n)),
            supports: n.table("supports", |n| self.supports.over(n)),
            loads: n.table("loads", |n| self.loads.over(n)),
            initial: n.table("initial", |n| self.initial.over(self.time.is_some(), n)),
            time: self.time.as_ref().map(|time| n.table("time", |n| time.over(n))),
            camera: n.table("camera", |n| self.camera.over(n)),
            energies: n.table("energy", |n| self.energies.iter().map(|e| e.over(n)).collect()),
            path: self.path.clone(),
            remeshed: self.remeshed,
        }
    }

    /// Reads the points of polylines, once.
    pub(crate) fn read_shapes(&mut self) -> Result<(), Error> {
        let folder = self.folder();
        self.rod.shape.read(&folder, false)?;
        self.initial.shape.as_mut().map_or(Ok(()), |shape| shape.read(&folder, true))
    }

    /// Reads and validates a scene file.
    pub fn load(path: impl AsRef<Path>) -> Result<Self, Error> {
        Self::load_with(path, |_| Ok(()))
    }

    /// Reads and validates a scene file with [energies of one's own](crate::energy::own), which
    /// `give` [gives](Self::give_energy) their code.
    pub fn load_with(
        path: impl AsRef<Path>,
        give: impl FnOnce(&mut Self) -> Result<(), Error>,
    ) -> Result<Self, Error> {
        let path = path.as_ref();
        let text = crate::input::file::text(path)?;
        let mut scene: Self = parse(&text, &REQUIRED).map_err(|error| error.in_file(Some(path)))?;
        scene.path = Some(path.into());
        give(&mut scene).map_err(|error| error.in_file(Some(path)))?;
        scene.validate()?;
        scene.read_shapes()?;
        Ok(scene)
    }

    /// The scene as a file.
    pub fn to_toml(&self) -> Result<String, Error> {
        toml::to_string_pretty(self)
            .map_err(|error| Error::Parse { file: None, message: error.to_string() })
    }

    /// Makes the paths in the scene independent of the folder it is saved in.
    pub fn make_paths_absolute(&mut self) -> Result<(), Error> {
        let folder = self.folder();
        for shape in [Some(&mut self.rod.shape), self.initial.shape.as_mut()].into_iter().flatten()
        {
            if let Shape::Polyline { file, .. } = shape {
                let path = folder.join(&*file);
                *file = std::path::absolute(&path).map_err(|source| Error::io(&path, source))?;
            }
        }
        Ok(())
    }

    /// The files it was read from: its own and those of its shapes.
    pub fn files(&self) -> Vec<PathBuf> {
        let shapes = [Some(&self.rod.shape), self.initial.shape.as_ref()].into_iter().flatten();
        let polylines = shapes.filter_map(|shape| match shape {
            Shape::Polyline { file, .. } => Some(self.folder().join(file)),
            _ => None,
        });
        self.path.iter().cloned().chain(polylines).collect()
    }

    /// Whether the mesh is given with the scene, by loads on nodes that are named by their index.
    /// Another number of segments would be another scene.
    pub(crate) fn mesh_is_given(&self) -> bool {
        self.loads
            .point
            .iter()
            .chain(&self.initial.point)
            .any(|load| matches!(load.node, Point::Node(_)))
    }

    /// The constants the elements get.
    pub fn discretization(&self) -> Discretization {
        self.rod.discretization.unwrap_or(match self.supports.clamp {
            Clamp::MidEdge => Discretization::Corrected,
            Clamp::Nodes => Discretization::Paper,
        })
    }

    /// The folder other paths are relative to.
    pub fn folder(&self) -> PathBuf {
        self.path.as_deref().and_then(Path::parent).map(Into::into).unwrap_or_default()
    }

    /// Checks every value.
    pub fn validate(&self) -> Result<(), Error> {
        self.check().map_err(|error| error.in_file(self.path.as_deref()))
    }

    fn check(&self) -> Result<(), Error> {
        self.rod.shape.check("rod.shape")?;
        self.rod.section.check()?;
        match (&self.rod.shape, self.rod.segments) {
            (Shape::Polyline { .. }, None) => {}
            (_, None) => return Err(shape::no_segments()),
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
        self.rod.natural_curvature.check("rod.natural_curvature")?;
        self.rod.natural_twist.check("rod.natural_twist")?;
        let material = &self.material;
        positive("material.density", material.density)?;
        positive("material.youngs_modulus", material.youngs_modulus)?;
        if let Some(nu) = material.poisson_ratio {
            if !(nu > -1.0 && nu <= 0.5) {
                return Err(Error::invalid("material.poisson_ratio", nu, "in (-1, 0.5]"));
            }
            if material.shear_modulus.is_some() {
                let found = "both poisson_ratio and shear_modulus";
                return Err(Error::invalid("material.shear_modulus", found, "one of the two"));
            }
        }
        if let Some(modulus) = material.shear_modulus {
            positive("material.shear_modulus", modulus)?;
        }
        self.loads.check()?;
        self.initial.check()?;
        self.camera.check()?;
        own::check(&self.energies)?;
        if self.supports.angle != 0.0 && self.initial.shape.is_some() {
            let allowed = "no such key beside initial.shape, which says where the rod is";
            return Err(Error::invalid("supports.angle", self.supports.angle, allowed));
        }
        self.supports.check()?;
        if let Some(time) = &self.time {
            positive("time.end", time.end)?;
            positive("time.step", time.step)?;
            if !(0.5..=1.0).contains(&time.beta) {
                return Err(Error::invalid("time.beta", time.beta, "in [0.5, 1]"));
            }
            let eta = self.loads.damping.stiffness;
            let traits = time.scheme.traits();
            if eta > 0.0 && !traits.takes_viscosity {
                let takers = Scheme::names(|traits| traits.takes_viscosity);
                let allowed = format!("0 with {}; the schemes {takers} take it", traits.name);
                return Err(Error::invalid("loads.damping.stiffness", eta, allowed));
            }
            if !self.supports.motion.is_empty() && !traits.takes_boundary_motion {
                let found = format!("a motion beside the scheme {}", traits.name);
                let takers = Scheme::names(|traits| traits.takes_boundary_motion);
                let allowed = format!("with the schemes {takers}");
                return Err(Error::invalid("supports.motion", found, allowed));
            }
            if time.end / time.step > MOST_STEPS {
                let found =
                    format!("{:e}, which needs {:.3e} steps", time.step, time.end / time.step);
                return Err(Error::invalid("time.step", found, "at most 1e9 steps"));
            }
        }
        Ok(())
    }
}

/// What a scene file must have.
const REQUIRED: [Rule; 9] = [
    always("rod", rod_keys),
    always("material", |_| &["density", "youngs_modulus"]),
    if_there("rod.shape", shape_keys),
    if_there("rod.section", section_keys),
    if_there("initial.shape", shape_keys),
    if_there("time", |_| &["end", "step"]),
    if_there("loads.point[]", |_| &["node"]),
    if_there("initial.point[]", |_| &["node"]),
    if_there("supports.motion[]", |_| &["end"]),
];

fn rod_keys(rod: &toml::Table) -> Keys {
    match rod.get("shape").and_then(|shape| shape.get("kind")?.as_str()) {
        Some("polyline") => &["shape", "section"],
        _ => &["segments", "shape", "section"],
    }
}

fn shape_keys(shape: &toml::Table) -> Keys {
    match shape.get("kind").and_then(toml::Value::as_str) {
        Some("straight") => &["length", "direction"],
        Some("helix") => &["length", "radius", "pitch", "axis", "handedness"],
        Some("arc") => &["length", "angle"],
        Some("polyline") => &["file"],
        _ => &["kind"],
    }
}

fn section_keys(section: &toml::Table) -> Keys {
    match section.get("kind").and_then(toml::Value::as_str) {
        Some("circle") => &["radius"],
        Some("rectangle") => &["width", "height", "up"],
        Some("custom") => &["area", "i1", "i2", "j", "up"],
        _ => &["kind"],
    }
}

/// Parses TOML; the message says line, key and what was expected, or all the keys that are missing.
pub(crate) fn parse<T: serde::de::DeserializeOwned>(
    text: &str,
    required: &[Rule],
) -> Result<T, Error> {
    toml::from_str(text).map_err(|error: toml::de::Error| {
        let missing = match (error.message().starts_with("missing field"), text.parse()) {
            (true, Ok(table)) => missing(&table, required),
            _ => Vec::new(),
        };
        let message = match &missing[..] {
            [] => error.to_string().trim_end().to_string(),
            [key] => {
                let before = error.span().map_or("", |span| &text[..span.start]);
                format!("line {}: missing key: {key}", before.matches('\n').count() + 1)
            }
            keys => format!("missing keys: {}", keys.join(", ")),
        };
        Error::Parse { file: None, message }
    })
}

pub(crate) fn positive(key: &str, value: f64) -> Result<(), Error> {
    if value.is_finite() && value > 0.0 {
        return Ok(());
    }
    Err(Error::invalid(key, value, "a finite number above 0"))
}

fn not_negative(key: &str, value: f64) -> Result<(), Error> {
    if value.is_finite() && value >= 0.0 {
        return Ok(());
    }
    Err(Error::invalid(key, value, "a finite number, 0 or above"))
}

fn finite(key: &str, values: &[f64; 3]) -> Result<(), Error> {
    if values.iter().all(|v| v.is_finite()) {
        return Ok(());
    }
    Err(Error::invalid(key, format!("{values:?}"), "finite numbers"))
}

/// A finite direction of non-zero length.
pub(crate) fn direction(key: &str, vector: &[f64; 3]) -> Result<(), Error> {
    finite(key, vector)?;
    let length = nalgebra::Vector3::from(*vector).norm();
    if length > 0.0 && length.is_finite() {
        return Ok(());
    }
    Err(Error::invalid(key, format!("{vector:?}"), "a direction of non-zero length"))
}
