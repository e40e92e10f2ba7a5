//! Scene files: their keys, validation, physical numbers and parameter names. All quantities are SI.
//!
//! A [`Scene`] has tables for the rod, material, supports, loads, signals, actuators, contacts, initial state, time,
//! camera, sensors and user-defined energies. It is generic over the type of its physical numbers: `f64`, or dual
//! numbers for derivatives by parameters ([`Scene::map_numbers`]). Each number is declared once with its unit and
//! limits (`number`, `table`), and has a [`Parameter`] name, its path in the file. [`Scene::validate`] rejects invalid
//! values and contradicting keys; the error has file, key, and the found and the allowed value. [`Scene::load`] reads a
//! file, and the module `problem` builds the rod. [`StructureScene`] is the scene of several rods.
//!
//! Functions of this file combine several tables. They return the integration scheme and its tolerance (the defaults
//! without `[time]`), and the discretization (by default that of the kind of clamp). Section and material at a place
//! are those of the rod times the taper factors there. A motion is dissipative with damping, drag, or contacts with
//! friction or damping.
//!
//! Files: `rod`, `material`, `section`, `taper`, `along`, `break_points`, `mass`, `loads`, `drag`, `maxwell`,
//! `power_law`, `contact`, `actuation`, `signal`, `initial`, `camera`, `sensor_model`, `time`, `scheme`, `tolerance`
//! (tables); `shape`, `shear`, `polyline`, `mesh`, `plane`, `point`, `marker` (geometry); `support`, `supports`,
//! `prescribed_motion`, `motion_rate`, `signal_steps`, `path`, `track`, `recorded_point`, `gripper_frame`,
//! `gripper_pose`, `pose_table`, `recorded_motion`, `track_defect`, `faults` (ends and recordings); `own` (user-defined
//! energies); `structure` and others of this name, `per_axis` (several rods); `parameter`, `scene_catalog` (all
//! parameters); `resolution`, `scheme_support`, `required`, `validate`, `nearest` (choice and checks); `file`,
//! `scene_file` (reading).

pub mod actuation;
pub mod along;
pub mod break_points;
pub mod camera;
pub mod contact;
mod drag;
pub mod faults;
mod file;
pub mod gripper_frame;
pub mod gripper_pose;
pub mod initial;
pub mod loads;
pub(crate) mod marker;
pub mod mass;
pub mod material;
pub mod maxwell;
pub mod mesh;
mod motion_rate;
mod nearest;
pub mod number;
pub mod obstacle_motion;
pub mod own;
pub mod parameter;
pub mod path;
pub mod per_axis;
pub mod plane;
pub mod point;
mod polyline;
pub mod pose_table;
pub mod power_law;
pub mod prescribed_motion;
mod recorded_motion;
mod recorded_point;
mod required;
pub mod resolution;
pub mod rod;
pub mod rod_contact;
mod scene_catalog;
mod scene_file;
pub mod scheme;
mod scheme_support;
pub mod section;
pub mod sensor_model;
pub mod shape;
pub(crate) mod shear;
pub mod signal;
pub mod signal_curve;
pub mod signal_samples;
mod signal_steps;
pub mod structure;
mod structure_catalog;
mod structure_file;
pub mod structure_point;
pub mod structure_recording;
mod structure_support;
pub mod support;
pub mod supports;
mod table;
pub mod taper;
pub mod time;
pub mod tolerance;
pub mod track;
pub mod track_defect;
pub(crate) mod validate;

pub use actuation::{ActuatedStrain, Actuation, RoutePoint, Tension};
pub use along::{Along, Linear};
pub use break_points::BreakPoints;
pub use camera::Camera;
pub use contact::Contact;
pub use drag::Drag;
pub use faults::{LostFrames, SwappedLabels};
pub use gripper_frame::GripperFrame;
pub use gripper_pose::GripperPose;
pub use initial::{Initial, InitialState};
pub use loads::{Damping, Friction, LineForce, Loads, PointForce};
pub use mass::PointMass;
pub use material::{BendingLaw, Material, StretchLaw};
pub use maxwell::{Maxwell, MaxwellBranches};
pub use obstacle_motion::ObstacleMotion;
pub use own::{At, Attached};
pub use parameter::Parameter;
pub use path::Recorded;
pub use plane::Plane;
pub use point::{Point, Stencil};
pub use power_law::PowerLaw;
pub use prescribed_motion::Motion;
pub use recorded_point::{SubtractedMean, Subtraction};
pub use resolution::{Chosen, Resolution};
pub use rod::{Dimension, Discretization, RodSpec};
pub use scene_file::SceneFile;
pub use scheme::{Scheme, SchemeParameter};
pub use section::Section;
pub use sensor_model::SensorModel;
pub use shape::{Handedness, Shape};
pub use signal::{Signal, SignalKind};
pub use signal_curve::SignalCurve;
pub use signal_samples::{Interpolation, SignalSamples};
pub use structure::StructureScene;
pub use structure_point::{RodPoint, StructurePoint};
pub use structure_recording::StructureRecording;
pub use support::{Clamp, End, Support};
pub use supports::{Compliance, Supports};
pub use taper::Taper;
pub use time::Time;
pub use tolerance::StepTolerance;
pub use track::Track;
pub use track_defect::TrackDefect;

#[doc(hidden)]
#[deprecated(since = "0.2.0", note = "renamed to StepTolerance")]
pub use tolerance::StepTolerance as Tolerance;
#[doc(hidden)]
#[deprecated(since = "0.2.0", note = "renamed to TrackDefect")]
pub use track_defect::TrackDefect as Fault;

use crate::error::Error;
use crate::numerics::scalar::Scalar;
use crate::scene::number::{NumberVisitor, Quantity};
use crate::scene::table::{NumberTree, TABLE, table};
use std::path::PathBuf;

table! {
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
    pub struct Scene {
        /// Largest allowed error of the motion as a fraction of the rod length, 1e-8 to 0.1. Absent
        /// mesh and step are chosen for it; given ones are checked.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        pub accuracy: Option<f64>,
        /// Shape, cross-section and mesh of the rod.
        pub rod: RodSpec<D> = TABLE,
        /// Density and elastic moduli.
        pub material: Material<D> = TABLE,
        /// Supports of the ends of the rod.
        #[serde(default)]
        pub supports: Supports<D> = TABLE,
        /// Gravity, point loads, damping and fluid.
        #[serde(default)]
        pub loads: Loads<D> = TABLE,
        /// Factors of loads as functions of time.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        pub signals: Vec<Signal<D>> = TABLE,
        /// Actuators in the rod.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        pub actuation: Vec<Actuation<D>> = TABLE,
        /// Obstacles that the rod touches, fixed or moved.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        pub contacts: Vec<Contact<D>> = TABLE,
        /// Initial state of the rod at t = 0.
        #[serde(default, skip_serializing_if = "Initial::is_rest")]
        pub initial: Initial<D> = TABLE,
        /// Duration, time step and integration scheme.
        pub time: Option<Time<D>> = TABLE,
        /// Relation between recorded and scene coordinates; used by fits only.
        #[serde(default, skip_serializing_if = "Camera::is_default")]
        pub camera: Camera<D> = TABLE,
        /// Frame, clock and filter of sensors, to which observations refer; used by fits only.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        pub sensors: Vec<SensorModel<D>> = TABLE,
        /// [User-defined energies](crate::energy::own).
        #[serde(rename = "energy", default, skip_serializing_if = "Vec::is_empty", with = "own")]
        // Only a program can give them their code.
        #[cfg_attr(test, schemars(skip))]
        pub energies: Vec<Attached<D>> = TABLE => "energy",
        /// The file the scene was read from; other paths are relative to it.
        #[serde(skip)]
        pub path: Option<PathBuf>,
        /// Number of edges that replaces `rod.segments`. Points that the scene names by a node index keep the arc
        /// length of that node on the mesh with `rod.segments`.
        #[serde(skip)]
        pub(crate) remeshed: Option<usize>,
        /// For `[start, end]`, whether the clamp is modelled as compliant: its rotational compliance is not zero in the
        /// scene, or is a varying parameter.
        #[serde(skip)]
        pub(crate) soft: [bool; 2],
        /// For `[start, end]`, whether the rotational compliance in the scene is not zero. Node indices refer to the
        /// mesh with these clamps.
        #[serde(skip)]
        pub(crate) soft_by_itself: [bool; 2],
        /// Whether the file of the scene gives no gravity.
        #[serde(skip)]
        pub(crate) gravity_left_out: bool,
        /// Mesh, step and scheme that the program chose or checked.
        #[serde(skip)]
        pub(crate) resolution: Option<Resolution>,
        /// End of the recording that replaced a missing `time.end`, s.
        #[serde(skip)]
        pub(crate) end_of_recording: Option<f64>,
        /// The structure for which this scene stands in a fit: its parameters replace those of the rod, and the rod has
        /// its total length and number of edges.
        #[serde(skip)]
        pub(crate) structure: Option<Box<StructureScene<D>>> = TABLE => "",
    }
}

impl<D> Scene<D> {
    /// The time integrator `time.scheme`; the default, Newmark-beta, without `[time]`.
    pub fn scheme(&self) -> Scheme {
        self.time.as_ref().map_or_else(Scheme::default, |time| time.scheme)
    }

    /// Largest Newton error of a time step, as a fraction of the rod length: `time.tolerance`, or the default, 3e-14,
    /// without `[time]`.
    pub fn tolerance(&self) -> StepTolerance {
        self.time.as_ref().map(|time| time.tolerance).unwrap_or_default()
    }
}

impl<D> Scene<D> {
    /// Whether the scene has any user-defined energy, contact or tendon. Their energies are added to those of the
    /// elements.
    pub(crate) fn has_own_energies(&self) -> bool {
        !self.energies.is_empty()
            || !self.contacts.is_empty()
            || self.actuation.iter().any(Actuation::is_tendon)
    }
}

impl<D: Scalar> Scene<D> {
    /// Section and material at a place, a fraction of the rod length. Numbers with a factor in `rod.taper` are
    /// multiplied by that at the place; before 0 and beyond 1 the factors are those of the ends.
    pub(crate) fn at(&self, place: f64) -> (Section<D>, Material<D>) {
        self.rod.taper.at(place, &self.rod.section, &self.material)
    }

    /// Both second moments of area (in the plane of `up`, then across it), m^4, at 1/4 and 3/4 of each piece between
    /// two breaks of the taper, in order from the start. Factors are linear between breaks, so that two second moments
    /// that are equal at all these places are equal along the whole rod.
    pub(crate) fn second_moments_along(&self) -> Vec<[D; 2]> {
        let of = |place: f64| self.at(place).0.moments().second_moments;
        // Inside of the pieces, since the factors of two pieces meet at a break.
        let breaks = self.rod.taper.breaks();
        let between =
            breaks.windows(2).flat_map(|w| [0.25, 0.75].map(|p| w[0] + p * (w[1] - w[0])));
        between.map(of).collect()
    }
}

impl Scene {
    /// Whether any physical term takes energy from the motion: damping or drag of the loads, or a contact with friction
    /// or damping. Dissipation of the integration scheme does not count.
    pub(crate) fn is_dissipative(&self) -> bool {
        let has_loss = |contact: &Contact| contact.has_friction() || contact.has_damping();
        self.loads.are_dissipative() || self.contacts.iter().any(has_loss)
    }

    /// Scene of a rod of `segments` edges that is clamped at its start (wall in the middle of the first edge) and free
    /// at its end. It starts at rest, and has neither loads nor `[time]`. Nothing is validated.
    ///
    /// ```
    /// use rodfit::scene::{Material, Section, Shape};
    /// let shape = Shape::Straight { length: 0.5, direction: [1.0, 0.0, 0.0] }; // m
    /// let section = Section::Circle { radius: 0.005 }; // m
    /// let mut scene = rodfit::Scene::new(20, shape, section, Material::new(1200.0, 1e8)); // kg/m^3, Pa
    /// scene.loads.gravity = [0.0, -9.81, 0.0]; // m/s^2
    /// assert!(scene.problem()?.equilibrium()?.tip[1] < 0.0);
    /// # Ok::<(), rodfit::Error>(())
    /// ```
    pub fn new(segments: usize, shape: Shape, section: Section, material: Material) -> Self {
        Self {
            accuracy: None,
            rod: RodSpec::new(segments, shape, section),
            material,
            supports: Supports::default(),
            loads: Loads::default(),
            signals: Vec::new(),
            actuation: Vec::new(),
            contacts: Vec::new(),
            initial: Initial::default(),
            time: None,
            camera: Camera::default(),
            sensors: Vec::new(),
            energies: Vec::new(),
            path: None,
            remeshed: None,
            soft: [false; 2],
            soft_by_itself: [false; 2],
            gravity_left_out: false,
            resolution: None,
            end_of_recording: None,
            structure: None,
        }
    }

    /// The same scene over another number type. `convert` returns the new number of the path, value and quantity of
    /// each physical number, in the order of the tables. Numbers without effect are converted without derivatives, and
    /// `convert` is not called for them: initial velocities without `[time]`, `beta` and `rho_inf` if the scheme does
    /// not use them. If the scene stands for a structure, `convert` gets the numbers of the camera, then those of the
    /// structure. Those of the rod that represents the structure in a fit have no effect either.
    pub fn map_numbers<D: From<f64>>(
        &self,
        mut convert: impl FnMut(&str, f64, Quantity) -> D,
    ) -> Scene<D> {
        let parameter = self.scheme().traits().parameter;
        // Numbers without effect in this scene are no parameters of it.
        let has_effect = |path: &str| match path.split_once('.') {
            Some(("initial", key)) if key.contains("velocity") => self.time.is_some(),
            Some(("time", "beta")) => parameter == Some(SchemeParameter::Beta),
            Some(("time", "rho_inf")) => parameter == Some(SchemeParameter::RhoInf),
            _ => true,
        };
        let mut convert = |path: &str, value: f64, quantity| match has_effect(path) {
            true => convert(path, value, quantity),
            false => D::from(value),
        };
        let Some(structure) = &self.structure else {
            return NumberTree::map_numbers(self, "", TABLE, &mut NumberVisitor::new(&mut convert));
        };
        // Of the representative rod only the camera has parameters, of the structure all other numbers.
        let is_of_camera = |path: &str| path.starts_with("camera.");
        let mut of_rod = |path: &str, value: f64, quantity| match is_of_camera(path) {
            true => convert(path, value, quantity),
            false => D::from(value),
        };
        let rod = Self { structure: None, ..self.clone() };
        let mut mapped =
            NumberTree::map_numbers(&rod, "", TABLE, &mut NumberVisitor::new(&mut of_rod));
        let structure = StructureScene::map_numbers(structure, |path, value, quantity| {
            match is_of_camera(path) {
                true => D::from(value),
                false => convert(path, value, quantity),
            }
        });
        mapped.structure = Some(Box::new(structure));
        mapped
    }

    /// Whether `loads.point`, `initial.point` or `rod.mass` names a node by its index, so that another number of
    /// segments would change the scene.
    pub(crate) fn mesh_is_given(&self) -> bool {
        let loads = self.loads.point.iter().chain(&self.initial.point).map(|load| load.node);
        let masses = self.rod.mass.iter().map(|mass| mass.node);
        loads.chain(masses).any(|node| matches!(node, Point::Node(_)))
    }

    /// The discretization in `rod.discretization`. Without that key it is `corrected` if the walls of clamps are in the
    /// middle of an edge, and `paper` if they are at nodes.
    pub fn discretization(&self) -> Discretization {
        self.rod.discretization.unwrap_or(match self.supports.clamp {
            Clamp::MidEdge => Discretization::Corrected,
            Clamp::Nodes => Discretization::Paper,
        })
    }

    /// Rejects invalid values and contradicting keys of all tables; files are not read. The error has file, key, and
    /// the found and the allowed value.
    pub fn validate(&self) -> Result<(), Error> {
        self.check().map_err(|error| error.in_file(self.path.as_deref()))
    }

    /// Rejects `initial.state = "recorded"` without `[supports.path]`. With that table it rejects any state other than
    /// "recorded" and "equilibrium", an initial shape, and an initial velocity beside "recorded". No error otherwise.
    fn check_recorded_start(&self) -> Result<(), Error> {
        let Initial { state, shape, .. } = &self.initial;
        let recorded = *state == InitialState::Recorded;
        // Markers determine shape and velocity at t = 0; other values for them would be ignored.
        let (found, allowed) = match &self.supports.path {
            None if recorded => ("\"recorded\"", "only with [supports.path]"),
            Some(_) if !recorded && *state != InitialState::Equilibrium => (
                "an initial state that ignores the recorded ends",
                "\"recorded\" or \
                  \"equilibrium\"",
            ),
            Some(_) if shape.is_some() => (
                "initial.shape together with recorded ends",
                "no such key: the markers give the initial shape",
            ),
            Some(_) if recorded && self.initial.moves() => (
                "a velocity together with a recorded start",
                "no such key: the markers give the initial velocity",
            ),
            _ => return Ok(()),
        };
        Err(Error::invalid("initial.state", found, allowed))
    }

    /// Rejects invalid signals, point and line loads whose signal is not in the scene, and a time `loads.at_time` that
    /// is not finite. Forces that act until t = 0 only (`initial.point`) must not have a signal or be follower loads.
    fn check_signals(&self) -> Result<(), Error> {
        self.signals.check_numbers("signals", TABLE)?;
        signal::check_signals(&self.signals)?;
        let line = self.loads.line.iter().enumerate();
        let line = line.map(|(k, load)| (format!("loads.line[{k}]"), &load.signal));
        let point = self.loads.point.iter().enumerate();
        let point = point.map(|(k, load)| (format!("loads.point[{k}]"), &load.signal));
        for (key, name) in point.chain(line) {
            signal::check_reference(&self.signals, name.as_deref(), &key)?;
        }
        let has_signal = |load: &PointForce| load.signal.is_some();
        if let Some(k) = self.initial.point.iter().position(has_signal) {
            let allowed = "no such key, as the force acts until t = 0 only";
            return Err(Error::invalid(format!("initial.point[{k}].signal"), "a signal", allowed));
        }
        if let Some(k) = self.initial.point.iter().position(|load| load.follower) {
            let allowed = "no such key, as the force acts until t = 0 only";
            return Err(Error::invalid(format!("initial.point[{k}].follower"), "true", allowed));
        }
        if !self.loads.at_time.is_finite() {
            return Err(Error::invalid("loads.at_time", self.loads.at_time, "a finite time, s"));
        }
        Ok(())
    }

    /// Rejects the first signal that no point load, line load or actuator uses. It would have no effect, and the load
    /// for which it was meant would be constant.
    fn check_signals_act(&self) -> Result<(), Error> {
        let point = self.loads.point.iter().map(|load| load.signal.as_deref());
        let line = self.loads.line.iter().map(|load| load.signal.as_deref());
        let actuators = self.actuation.iter().map(|actuator| actuator.signal());
        let used: Vec<&str> = point.chain(line).chain(actuators).flatten().collect();
        let unused = |signal: &Signal| !used.contains(&&*signal.name);
        match self.signals.iter().position(unused) {
            None => Ok(()),
            Some(k) => Err(Error::invalid(
                format!("signals[{k}].name"),
                format!("{:?}, to which no load and no actuator refers", self.signals[k].name),
                "the `signal` of a load or of an actuator",
            )),
        }
    }

    /// The checks of [`validate`](Self::validate), table by table, without the file in errors; the first error is
    /// returned. Combinations of tables that are rejected: an axial compliance beside a stretch law that is not linear,
    /// a rotational compliance beside a bending law, and `supports.angle` beside `initial.shape`. So are signals to
    /// which nothing refers, an open mesh beside node indices, a recorded start that contradicts the supports, and a
    /// term that the scheme in `[time]` does not support.
    fn check(&self) -> Result<(), Error> {
        self.rod.check()?;
        self.material.check()?;
        self.rod.taper.check(&self.rod.section, &self.material)?;
        self.loads.check_numbers("loads", TABLE)?;
        self.loads.damping.check()?;
        self.check_signals()?;
        actuation::check_actuation(&self.actuation, &self.signals, self.material.stretch_law)?;
        self.check_signals_act()?;
        contact::check_contacts(&self.contacts, &self.rod.section)?;
        self.initial.check()?;
        self.camera.check_numbers("camera", TABLE)?;
        self.sensors.check_numbers("sensors", TABLE)?;
        sensor_model::check_sensors(&self.sensors)?;
        own::check(&self.energies)?;
        self.check_accuracy()?;
        // A clamp in series with an edge makes another law of the stretch.
        if self.material.stretch_law != StretchLaw::Linear {
            let clamps = [("start", End::Start), ("end", End::End)];
            for (name, end) in clamps {
                let axial = self.supports.compliance(end).axial;
                if axial != 0.0 {
                    let allowed = "0 with a material.stretch_law that is not linear";
                    return Err(Error::invalid(
                        format!("supports.{name}_compliance.axial"),
                        axial,
                        allowed,
                    ));
                }
            }
        }
        if self.material.bending_law.is_some() {
            for (name, end) in [("start", End::Start), ("end", End::End)] {
                let rotation = self.supports.compliance(end).rotation;
                if rotation != 0.0 {
                    let key = format!("supports.{name}_compliance.rotation");
                    return Err(Error::invalid(key, rotation, "0 with a material.bending_law"));
                }
            }
        }
        // The angle rotates the rest shape; an initial shape has its own position.
        if self.supports.angle != 0.0 && self.initial.shape.is_some() {
            let allowed = "no such key with initial.shape, which gives the position of the rod";
            return Err(Error::invalid("supports.angle", self.supports.angle, allowed));
        }
        self.supports.check()?;
        self.check_recorded_start()?;
        if let Some(time) = &self.time {
            time.check(self.supports.path.is_some())?;
            if let Some(term) = self.unsupported_by(time.scheme).into_iter().next() {
                return Err(Error::invalid(term.key, term.found, term.allowed));
            }
        }
        Ok(())
    }
}
