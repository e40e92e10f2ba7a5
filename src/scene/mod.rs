//! The scene file: what it may say, and whether it makes sense. All quantities are SI.

pub mod along;
pub mod camera;
mod drag;
pub mod fault;
pub mod faults;
pub mod initial;
pub mod loads;
pub(crate) mod marker;
pub mod mass;
pub mod material;
pub mod mesh;
mod nearest;
pub mod number;
pub mod own;
pub mod parameter;
pub mod path;
pub mod plane;
pub mod point;
mod polyline;
mod recorded_motion;
mod recorded_point;
mod required;
pub mod resolution;
pub mod rod;
pub mod scheme;
pub mod section;
pub mod shape;
pub mod support;
pub mod supports;
pub mod taper;
pub mod time;
pub mod tolerance;
pub mod track;
pub(crate) mod validate;

pub use along::{Along, Linear};
pub use camera::Camera;
pub use drag::Drag;
pub use fault::Fault;
pub use faults::{LostFrames, SwappedLabels};
pub use initial::{Initial, InitialState};
pub use loads::{Damping, Friction, Loads, Maxwell, PointForce};
pub use mass::PointMass;
pub use material::Material;
pub use own::{At, Attached};
pub use parameter::Parameter;
pub use path::Recorded;
pub use plane::Plane;
pub use point::{Point, Stencil};
pub use resolution::{Chosen, Resolution};
pub use rod::{Dimension, Discretization, RodSpec};
pub use scheme::{Scheme, SchemeParameter};
pub use section::Section;
pub use shape::{Handedness, Shape};
pub use support::{Clamp, End, Support};
pub use supports::{Compliance, Motion, Supports};
pub use taper::Taper;
pub use time::Time;
pub use tolerance::Tolerance;
pub use track::Track;

use crate::error::Error;
use crate::input::hints::{SCENE, explained};
use crate::input::missing_keys::parse;
use crate::numerics::scalar::Scalar;
use crate::scene::number::{Numbers, Quantity, Written};
use crate::scene::required::REQUIRED;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// A scene: rod, material, supports, loads, initial state and time. Read one with [`Scene::load`],
/// or build it in code:
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
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[cfg_attr(test, schemars(bound = "D: Written + schemars::JsonSchema"))]
#[serde(deny_unknown_fields, bound = "D: Written")]
pub struct Scene<D = f64> {
    /// Largest allowed error of the motion as a fraction of the rod length, 1e-8 to 0.1. Absent
    /// mesh and step are chosen for it; given ones are checked.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub accuracy: Option<f64>,
    /// Shape, cross-section and mesh of the rod.
    pub rod: RodSpec<D>,
    /// Density and elastic moduli.
    pub material: Material<D>,
    /// Supports of the ends of the rod.
    #[serde(default)]
    pub supports: Supports<D>,
    /// Gravity, point loads, damping and fluid.
    #[serde(default)]
    pub loads: Loads<D>,
    /// Initial state of the rod at t = 0.
    #[serde(default, skip_serializing_if = "Initial::is_rest")]
    pub initial: Initial<D>,
    /// Duration, time step and integration scheme.
    pub time: Option<Time<D>>,
    /// Relation between recorded and scene coordinates; used by fits only.
    #[serde(default, skip_serializing_if = "Camera::is_default")]
    pub camera: Camera<D>,
    /// [Energies of one's own](crate::energy::own).
    #[serde(rename = "energy", default, skip_serializing_if = "Vec::is_empty", with = "own")]
    // Nobody but a program gives them their code.
    #[cfg_attr(test, schemars(skip))]
    pub energies: Vec<Attached<D>>,
    /// The file the scene was read from; other paths are relative to it.
    #[serde(skip)]
    pub path: Option<PathBuf>,
    /// Edges to compute with, where they are not to be the scene's own; what it names by the index of a
    /// node stays where it is.
    #[serde(skip)]
    pub(crate) remeshed: Option<usize>,
    /// The ends whose clamps turn, or may.
    #[serde(skip)]
    pub(crate) soft: [bool; 2],
    /// Those whose clamps turn in the scene by itself: its nodes are named as they then are, whatever numbers vary.
    #[serde(skip)]
    pub(crate) soft_by_itself: [bool; 2],
    /// Whether the file that it was read from gives no gravity.
    #[serde(skip)]
    pub(crate) gravity_left_out: bool,
    /// What the program chose of the numerics, or checked.
    #[serde(skip)]
    pub(crate) resolution: Option<Resolution>,
    /// End of the recording that replaced a missing `time.end`, s.
    #[serde(skip)]
    pub(crate) end_of_recording: Option<f64>,
}

impl<D> Scene<D> {
    /// Whether the scene gives no `time.end`, and the motion lasts as long as its recording.
    fn ends_with_recording(&self) -> bool {
        let end = self.time.as_ref().map(|time| time.end);
        end.is_some() && end == self.end_of_recording
    }

    /// The time integrator.
    pub fn scheme(&self) -> Scheme {
        self.time.as_ref().map_or_else(Scheme::default, |time| time.scheme)
    }

    /// How exactly its steps are solved; the default without `[time]`.
    pub fn tolerance(&self) -> Tolerance {
        self.time.as_ref().map(|time| time.tolerance).unwrap_or_default()
    }
}

impl<D: Scalar> Scene<D> {
    /// Section and material at a place, given as a part of the rod's length.
    pub(crate) fn at(&self, place: f64) -> (Section<D>, Material<D>) {
        self.rod.taper.at(place, &self.rod.section, &self.material)
    }

    /// Both second moments, at so many places that two which are equal there are equal all along.
    pub(crate) fn second_moments_along(&self) -> Vec<[D; 2]> {
        let of = |place: f64| self.at(place).0.moments().second_moments;
        let breaks = self.rod.taper.breaks();
        let between =
            breaks.windows(2).flat_map(|w| [0.25, 0.75].map(|p| w[0] + p * (w[1] - w[0])));
        between.map(of).collect()
    }
}

impl Scene {
    /// A rod clamped at its start (mid-edge), without loads and without a time.
    pub fn new(segments: usize, shape: Shape, section: Section, material: Material) -> Self {
        let rod = RodSpec::new(segments, shape, section);
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
            soft: [false; 2],
            soft_by_itself: [false; 2],
            gravity_left_out: false,
            accuracy: None,
            resolution: None,
            end_of_recording: None,
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
            soft: self.soft,
            soft_by_itself: self.soft_by_itself,
            gravity_left_out: self.gravity_left_out,
            accuracy: self.accuracy,
            resolution: self.resolution,
            end_of_recording: self.end_of_recording,
        }
    }

    /// Reads the points of polylines and recordings, once.
    pub(crate) fn read_shapes(&mut self) -> Result<(), Error> {
        let folder = self.folder();
        self.rod.shape.read(&folder, false)?;
        for motion in &mut self.supports.motion {
            motion.read(&folder)?;
        }
        let ends = [self.supports.start, self.supports.end];
        if let Some(path) = &mut self.supports.path {
            path.read(&folder, ends)?;
            if let (Some(time), Ok(track)) = (&mut self.time, path.track())
                && time.end == Time::TO_THE_END
            {
                time.end = track.end();
                self.end_of_recording = Some(track.end());
            }
        }
        if let Some(time) = &self.time {
            self.supports.check_end(time)?;
        }
        self.initial.shape.as_mut().map_or(Ok(()), |shape| shape.read(&folder, true))
    }

    /// Reads and validates a scene file.
    ///
    /// # Errors
    ///
    /// A file that cannot be read or is no scene, or a value that is not allowed.
    pub fn load(path: impl AsRef<Path>) -> Result<Self, Error> {
        Self::load_file(path.as_ref())
    }

    /// What is generic over a path does nothing else: programs that use it would compile the reading of scenes again.
    fn load_file(path: &Path) -> Result<Self, Error> {
        Self::read(&marker_files::file::text(path)?, path)
    }

    /// Reads and validates a scene file with [energies of one's own](crate::energy::own), which
    /// `give` [gives](Self::give_energy) their code.
    pub fn load_with(
        path: impl AsRef<Path>,
        give: impl FnOnce(&mut Self) -> Result<(), Error>,
    ) -> Result<Self, Error> {
        let path = path.as_ref();
        Self::read_with(&marker_files::file::text(path)?, path, give)
    }

    /// Reads and validates the text of a scene file. Paths in it are relative to `folder`; messages name
    /// the text as if it were a file `scene` there.
    ///
    /// # Errors
    ///
    /// Text that is no scene, a value that is not allowed, or a file of a shape that cannot be read.
    ///
    /// ```
    /// use rodfit::Scene;
    /// let text = std::fs::read_to_string("data/cantilever.toml")?;
    /// assert_eq!(Scene::from_toml(&text, "data")?.rod, Scene::load("data/cantilever.toml")?.rod);
    /// let error = Scene::from_toml("[rod]", "data").unwrap_err().to_string();
    /// assert!(error.starts_with("data/scene: missing keys: rod.shape"), "{error}");
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn from_toml(text: &str, folder: impl AsRef<Path>) -> Result<Self, Error> {
        Self::read(text, &folder.as_ref().join("scene"))
    }

    /// The scene that stands in a file of this path.
    pub(crate) fn read(text: &str, path: &Path) -> Result<Self, Error> {
        Self::written(text, path)?.complete(path)
    }

    /// The same, with what `give` gives it before it is validated.
    pub(crate) fn read_with(
        text: &str,
        path: &Path,
        give: impl FnOnce(&mut Self) -> Result<(), Error>,
    ) -> Result<Self, Error> {
        let mut scene = Self::written(text, path)?;
        give(&mut scene).map_err(|error| error.in_file(Some(path)))?;
        scene.complete(path)
    }

    /// The same as it is written, not validated yet.
    fn written(text: &str, path: &Path) -> Result<Self, Error> {
        let mut scene: Self = parse(text, &REQUIRED)
            .map_err(|error| explained(error, text, &SCENE).in_file(Some(path)))?;
        scene.path = Some(path.into());
        // A gravity of zero that the file gives is meant.
        scene.gravity_left_out = scene.loads.gravity == [0.0; 3]
            && toml::from_str::<toml::Table>(text)
                .is_ok_and(|table| table.get("loads").is_none_or(|l| l.get("gravity").is_none()));
        Ok(scene)
    }

    /// Validates a scene that is written in a file of this path, and reads what it names.
    fn complete(mut self, path: &Path) -> Result<Self, Error> {
        self.validate()?;
        self.read_shapes().map_err(|error| error.in_file(Some(path)))?;
        Ok(self)
    }

    /// Lets the recorded ends go as in another recording than the scene's, `file`, relative to where the
    /// program runs.
    ///
    /// # Errors
    ///
    /// A scene without recorded ends.
    pub fn follow(&mut self, file: impl AsRef<Path>) -> Result<(), Error> {
        self.follow_file(file.as_ref())
    }

    fn follow_file(&mut self, file: &Path) -> Result<(), Error> {
        self.leave_end_to_recording();
        let Some(path) = &mut self.supports.path else {
            let (found, allowed) = (
                "no such table",
                "[supports.path] in the scene, whose file the recording \
                                                      replaces",
            );
            return Err(Error::invalid("supports.path", found, allowed));
        };
        path.file = std::path::absolute(file).map_err(|source| Error::io(file, source))?;
        path.track = None;
        Ok(())
    }

    /// Removes a `time.end` that the file did not give, so that another recording sets its own.
    fn leave_end_to_recording(&mut self) {
        if self.ends_with_recording() {
            self.time.iter_mut().for_each(|time| time.end = Time::TO_THE_END);
            self.end_of_recording = None;
        }
    }

    /// Whether two scenes of recorded ends have the same rod, material, loads and numerics, and differ in the recording
    /// only.
    pub fn differs_in_recording_only(&self, other: &Self) -> bool {
        let without_recording = |scene: &Self| {
            let mut scene = scene.reopened();
            scene.leave_end_to_recording();
            if let Some(path) = &mut scene.supports.path {
                (path.file, path.track) = (PathBuf::new(), None);
            }
            scene
        };
        self.supports.path.is_some() && without_recording(self) == without_recording(other)
    }

    /// The scene as a file. Without a `time.end` in its own file it has none here.
    pub fn to_toml(&self) -> Result<String, Error> {
        let mut written = self.clone();
        written.leave_end_to_recording();
        toml::to_string_pretty(&written)
            .map_err(|error| Error::Parse { file: None, message: error.to_string() })
    }

    /// Makes the paths in the scene independent of the folder it is saved in.
    pub fn make_paths_absolute(&mut self) -> Result<(), Error> {
        let folder = self.folder();
        for shape in [Some(&mut self.rod.shape), self.initial.shape.as_mut()].into_iter().flatten()
        {
            if let Shape::Polyline { file, points, .. } = shape
                && points.is_empty()
            {
                let path = marker_files::file::at(&folder, file);
                *file = std::path::absolute(&path).map_err(|source| Error::io(&path, source))?;
            }
        }
        for motion in &mut self.supports.motion {
            if !motion.file.as_os_str().is_empty() {
                let file = marker_files::file::at(&folder, &motion.file);
                motion.file =
                    std::path::absolute(&file).map_err(|source| Error::io(&file, source))?;
            }
        }
        if let Some(path) = &mut self.supports.path
            && !path.file.as_os_str().is_empty()
        {
            let file = marker_files::file::at(&folder, &path.file);
            path.file = std::path::absolute(&file).map_err(|source| Error::io(&file, source))?;
        }
        Ok(())
    }

    /// The files it was read from: its own and those of its shapes.
    pub fn files(&self) -> Vec<PathBuf> {
        let shapes = [Some(&self.rod.shape), self.initial.shape.as_ref()].into_iter().flatten();
        let polylines = shapes.filter_map(|shape| match shape {
            Shape::Polyline { file, points, .. } if points.is_empty() => {
                Some(marker_files::file::at(&self.folder(), file))
            }
            _ => None,
        });
        let recording = self.supports.path.iter().filter(|path| !path.file.as_os_str().is_empty());
        let recording = recording.map(|path| marker_files::file::at(&self.folder(), &path.file));
        let moved = self.supports.motion.iter().map(|motion| &motion.file);
        let moved = moved.filter(|file| !file.as_os_str().is_empty());
        let moved = moved.map(|file| marker_files::file::at(&self.folder(), file));
        self.path.iter().cloned().chain(polylines).chain(recording).chain(moved).collect()
    }

    /// Whether the mesh is given with the scene, by loads and masses on nodes that are named by their
    /// index. Another number of segments would be another scene.
    pub(crate) fn mesh_is_given(&self) -> bool {
        let loads = self.loads.point.iter().chain(&self.initial.point).map(|load| load.node);
        let masses = self.rod.mass.iter().map(|mass| mass.node);
        loads.chain(masses).any(|node| matches!(node, Point::Node(_)))
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

    /// Refuses a start that does not fit to recorded ends.
    fn check_recorded_start(&self) -> Result<(), Error> {
        let Initial { state, shape, .. } = &self.initial;
        let recorded = *state == InitialState::Recorded;
        let (found, allowed) = match &self.supports.path {
            None if recorded => ("\"recorded\"", "only with [supports.path]"),
            Some(_) if !recorded && *state != InitialState::Equilibrium => {
                ("a start elsewhere than the recorded ends", "\"recorded\" or \"equilibrium\"")
            }
            Some(_) if shape.is_some() => (
                "initial.shape beside recorded ends",
                "no such key: the markers give the initial shape",
            ),
            Some(_) if recorded && self.initial.moves() => (
                "a velocity beside a recorded start",
                "no such key: the markers give the initial velocity",
            ),
            _ => return Ok(()),
        };
        Err(Error::invalid("initial.state", found, allowed))
    }

    fn check(&self) -> Result<(), Error> {
        self.rod.check()?;
        self.material.check()?;
        self.rod.taper.check(&self.rod.section, &self.material)?;
        self.loads.check()?;
        self.initial.check()?;
        self.camera.check()?;
        own::check(&self.energies)?;
        self.check_accuracy()?;
        if self.supports.angle != 0.0 && self.initial.shape.is_some() {
            let allowed = "no such key with initial.shape, which gives the position of the rod";
            return Err(Error::invalid("supports.angle", self.supports.angle, allowed));
        }
        self.supports.check()?;
        self.check_recorded_start()?;
        if let Some(time) = &self.time {
            time.check(self.supports.path.is_some())?;
            let (damping, traits) = (&self.loads.damping, time.scheme.traits());
            let times = damping.times().into_iter().find(|(_, eta)| *eta > 0.0);
            if let Some((key, eta)) = times.filter(|_| !traits.takes_viscosity) {
                let takers = Scheme::names(|traits| traits.takes_viscosity);
                let allowed = format!("0 with {}; the schemes {takers} take it", traits.name);
                return Err(Error::invalid(format!("loads.damping.{key}"), eta, allowed));
            }
            let remembered =
                [("friction", damping.friction.is_some()), ("maxwell", damping.maxwell.is_some())];
            let refused = remembered.iter().find(|(_, there)| *there && !traits.takes_friction);
            if let Some((key, _)) = refused {
                let found = format!("{key} beside the scheme {}", traits.name);
                let allowed =
                    format!("with the schemes {}", Scheme::names(|traits| traits.takes_friction));
                return Err(Error::invalid(format!("loads.damping.{key}"), found, allowed));
            }
            if self.loads.drag.is_some() && !traits.takes_drag {
                let found = format!("drag beside the scheme {}", traits.name);
                let takers = Scheme::names(|traits| traits.takes_drag);
                let allowed = format!("with the schemes {takers}");
                return Err(Error::invalid("loads.drag", found, allowed));
            }
            if self.supports.move_ends() && !traits.takes_boundary_motion {
                let found = format!("a motion beside the scheme {}", traits.name);
                let takers = Scheme::names(|traits| traits.takes_boundary_motion);
                let allowed = format!("with the schemes {takers}");
                let recorded = self.supports.path.is_some();
                let key = if recorded { "supports.path" } else { "supports.motion" };
                return Err(Error::invalid(key, found, allowed));
            }
        }
        Ok(())
    }

    /// Whether a scheme can simulate it.
    pub(crate) fn is_taken_by(&self, scheme: Scheme) -> bool {
        let (traits, damping) = (scheme.traits(), &self.loads.damping);
        let remembers = damping.friction.is_some() || damping.maxwell.is_some();
        (traits.takes_viscosity || !damping.is_viscous())
            && (traits.takes_friction || !remembers)
            && (traits.takes_drag || self.loads.drag.is_none())
            && (traits.takes_boundary_motion || !self.supports.move_ends())
    }
}
