//! Problems: validated scenes with mesh, planar or spatial model, rest shape, supports and loads, from which rods
//! are built.
//!
//! [`Scene::problem`] builds a [`Problem`]: validation, choice of an open mesh, step and scheme (module `accuracy`),
//! mesh, choice of the model (`layout`), and setup. The `Setup` is the scene over a number type with mesh, rest shape
//! and initial shape. Stiffnesses, masses and natural curvatures of the rod are checked; errors of the scene have file,
//! key, and the found and the allowed value. A problem with other parameter values is built by [`Problem::with`], which
//! chooses the model again. `with_fixed_layout` keeps model and corrections, so that results are smooth functions of
//! the values. [`Discretized`] is the problem with the type of its model; statics, dynamics, vibration and fits compute
//! with it.
//!
//! Functions of [`Problem`]:
//!
//! - `with_scene` is the problem of another scene with the same settings, `lasting` of another duration.
//!   `with_generic_layout_for` and `with_generic_layout_for_another` choose a layout for all values of some parameters.
//! - `resolution` has mesh, step and scheme with their error (none if the program neither chose nor checked any);
//!   `set_estimated_error` replaces this error.
//! - `discretized`, `spatial_model` and `discretized_as` (with a given model) return typed problems. `can_twist`
//!   returns whether a planar scene has a spatial model for motion out of its plane.
//! - `dof`, `nodes`, `segments`, `length` (m), `turning` (upper bound of the turning angle, rad) and `normal` (of the
//!   plane) describe the rod. `wall` is the position of the first node at rest, `rest_position` and `marker_at_rest`
//!   are those of a point and a marker, m.
//! - `derivatives` and `with_derivatives` concern hand-derived or dual derivatives. `stop_when`, `is_stopped` and
//!   `check_stop` concern a flag that ends runs with [`Error::Interrupted`]. `time` is the table `[time]`, an error
//!   without one.
//!
//! Functions of [`Discretized`]: `setup_over` is the setup over a number type; `rest_frames` are the frames at rest.
//! `free` is the range of free unknowns, and `prescribed` are the unknowns in it that a recording prescribes.
//! `bending_frequency_squared` is `EI/(rho A L^4)`, 1/s^2.
//!
//! The models are in [`model`], `planar`, `spatial` and `model_with_setup`; their parts in `rest_line`,
//! `section_profile`, `tributary`, `curved_joints` and `soft_clamp`. Loads and energies: `line_loads`,
//! `follower_loads`, `setup`, `own`, `actuation`, `contact`. Start and supports: `start`, `boundary`, `perturbation`.
//! Checks: `parameters`, `planarity`, `natural_turn`, `penetration`. Warnings: `warnings`, `plausibility`, `strain`.
//! Points and meshes: `points`, `axes`, `remesh`. Strains without load: `reference_strains`.

mod actuation;
mod axes;
pub(crate) mod boundary;
mod contact;
mod curved_joints;
mod follower_loads;
mod layout;
mod line_loads;
pub mod model;
mod model_with_setup;
pub(crate) mod natural_turn;
mod own;
mod parameters;
pub(crate) mod penetration;
mod perturbation;
mod planar;
mod planarity;
mod plausibility;
mod points;
mod reference_strains;
mod remesh;
mod rest_line;
mod section_profile;
mod setup;
mod soft_clamp;
mod spatial;
mod start;
pub(crate) mod strain;
mod thickness_note;
mod tributary;
mod warnings;

pub(crate) use axes::DirectorRotation;
pub(crate) use contact::default_contact_stiffness;
pub(crate) use layout::{behind_walls, check_edges, check_on_mesh, correction};
pub use model::Model;
pub(crate) use model_with_setup::ModelWithSetup;
pub(crate) use own::{NodeTie, PointTie, point_ties};
pub use parameters::{ListedParameter, ParameterList};
pub(crate) use penetration::LARGEST_PENETRATION;
pub use planar::PlanarModel;
pub(crate) use plausibility::{Purpose, ignored_friction, is_implausible_mass};
pub(crate) use reference_strains::{
    ReferenceEdge, ReferenceJoint, ReferenceStrains, joint_curvature,
};
pub(crate) use section_profile::SectionProfile;
pub(crate) use setup::{Setup, between_markers, nodal as nodal_loads, nodal_masses};
pub use spatial::SpatialModel;
pub(crate) use start::{FramesOver, UnknownsAndFrames};

use crate::energy::Derivatives;
use crate::energy::bend_twist::JointLaw;
use crate::error::Error;
use crate::numerics::prescribed_dofs::PrescribedDofs;
use crate::numerics::scalar::RodScalar;
use crate::numerics::vector::add;
use crate::problem::layout::{BESIDE_STRAIGHT, choose};
use crate::problem::model_with_setup::AnyModel;
use crate::rod::Rod;
use crate::scene::Parameter;
use crate::scene::mesh::Mesh;
use crate::scene::resolution::Bound;
use crate::scene::{End, InitialState, Resolution, Scene, Support, Time};
use crate::scene::{Point, Stencil};
use std::ops::Range;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, OnceLock};

/// A validated scene with its mesh, and its planar or spatial model. Made by [`Scene::problem`].
#[derive(Clone, Debug)]
pub struct Problem {
    scene: Scene,
    derivatives: Derivatives,
    model: AnyModel,
    /// Reason of the choice of the model.
    reason: String,
    pub(super) mesh: Mesh,
    /// Parameters for all of whose values model and corrections are valid; empty if they were chosen for the present
    /// values.
    varying: Vec<Parameter>,
    /// Unknowns of the initial equilibrium, or of the first two frames of a recording, with angles relative to the
    /// initial frames; computed once, and shared by clones.
    pub(crate) start: Arc<OnceLock<Vec<Vec<f64>>>>,
    /// Flag that ends simulations once it is set.
    stop: Option<Arc<AtomicBool>>,
}

/// Problem with the type of its model, which builds rods, simulations and sensitivities. It borrows all its parts.
#[derive(Debug)]
pub struct Discretized<'a, M: Model> {
    pub(crate) problem: &'a Problem,
    /// The model.
    pub model: &'a M,
    pub(crate) setup: &'a Setup<f64, M>,
}

/// A planar problem.
pub type PlanarProblem<'a> = Discretized<'a, PlanarModel>;
/// A spatial problem.
pub type SpatialProblem<'a> = Discretized<'a, SpatialModel>;

/// Planar or spatial problem.
#[derive(Debug)]
pub enum AnyProblem<'a> {
    /// Problem in a plane.
    Planar(PlanarProblem<'a>),
    /// Problem in space.
    Spatial(SpatialProblem<'a>),
}

/// Evaluates an expression with the planar or the spatial discretization of a problem.
macro_rules! with_model {
    ($problem:expr, |$discretized:ident| $value:expr) => {
        match $problem.discretized() {
            $crate::problem::AnyProblem::Planar($discretized) => $value,
            $crate::problem::AnyProblem::Spatial($discretized) => $value,
        }
    };
}
pub(crate) use with_model;

impl Scene {
    /// Validates a scene and builds its problem, with model and layout chosen for its present values. Shapes and
    /// recordings that are not read yet are read from their files.
    ///
    /// # Errors
    /// [`Error::Invalid`] with file, key, and the found and the allowed value.
    pub(crate) fn build(&self) -> Result<Problem, Error> {
        self.validate()?;
        Problem::of(self.clone(), Vec::new(), None)
    }
}

impl Problem {
    /// The problem of a validated scene. Model and corrections suit all values of the `varying` parameters. With a
    /// problem `like`, its model and the reason of its choice are kept. Errors are those of [`new`](Self::new), with
    /// the scene file.
    fn of(scene: Scene, varying: Vec<Parameter>, like: Option<&Self>) -> Result<Self, Error> {
        let path = scene.path.clone();
        Self::new(scene, varying, like).map_err(|error| error.in_file(path.as_deref()))
    }

    /// The problem of a validated scene, as in [`of`](Self::of). In this order: makes the default discretization
    /// explicit, reads files, selects compliant clamps, builds the mesh, checks it, chooses the model and builds the
    /// setup. With a problem `like`, its model is kept, and only the fit of the keys to the mesh is checked. Errors,
    /// without the file: files that cannot be read, a missing number of edges, edges of extreme length. A natural
    /// curvature factor other than 1 of a straight rod, and joints that turn by half a turn or more, are errors too.
    /// Further ones are those of [`choose`], [`check_sizes`](Self::check_sizes), [`check_own`](Self::check_own) and
    /// [`check_contacts`](Self::check_contacts).
    fn new(mut scene: Scene, varying: Vec<Parameter>, like: Option<&Self>) -> Result<Self, Error> {
        // The default becomes explicit, so that a saved scene stays the same under another
        // default.
        scene.rod.discretization = Some(scene.discretization());
        scene.read_shapes()?;
        // The choice of the soft clamp is discrete, and must not change with parameters that
        // vary.
        if varying.is_empty() {
            scene.soft_by_itself = soft_clamp::soft_by_itself(&scene);
        }
        scene.soft = soft_clamp::soft(&scene, &varying);
        let mesh = scene.mesh()?;
        check_edges("rod.shape", &mesh.nodes)?;
        // Natural curvature is a factor on the curvature at rest, which a straight rod does not
        // have.
        let natural = &scene.rod.natural_curvature;
        if natural.values().iter().any(|factor| *factor != 1.0) && mesh.is_straight() {
            let found = match &natural.values()[..] {
                [factor] => factor.to_string(),
                factors => format!("{factors:?}"),
            };
            let allowed = format!("1 {BESIDE_STRAIGHT}");
            return Err(Error::invalid("rod.natural_curvature", found, allowed));
        }
        natural_turn::check(&scene, &mesh)?;
        // The model of another problem is kept, so that results stay smooth functions of the
        // parameters.
        let (model, reason) = match like {
            Some(like) => {
                check_on_mesh(&scene, &mesh)?;
                (like.model.with_scene(&scene), like.reason.clone())
            }
            None => choose(&scene, &mesh, &varying)?,
        };
        let problem = Self {
            start: Arc::default(),
            derivatives: Derivatives::default(),
            model,
            reason,
            mesh,
            varying,
            scene,
            stop: None,
        };
        problem.check_sizes()?;
        problem.check_own()?;
        problem.check_contacts()?;
        Ok(problem)
    }

    /// Builds the rod over `f64`. Rejects a joint of infinite natural curvature (a fold by 180 degrees), with its node.
    /// Rejects axial, bending and (in space) twist stiffnesses, nodal masses and rotational inertias that are not
    /// positive normal numbers in double precision. The error has the first such number, without its place.
    fn check_sizes(&self) -> Result<(), Error> {
        // All stiffnesses and masses of the rod, and its integrated natural curvatures.
        let (positive, natural): (Vec<f64>, Vec<f64>) = match self.discretized() {
            AnyProblem::Planar(discretized) => {
                let rod = discretized.rod();
                let stiffness = rod.stretch.iter().map(|s| s.stiffness);
                (
                    stiffness
                        .chain(rod.joint.iter().map(|b| b.stiffness))
                        .chain(rod.mass)
                        .collect(),
                    rod.joint.iter().map(|b| b.natural_curvature).collect(),
                )
            }
            AnyProblem::Spatial(discretized) => {
                let rod = discretized.rod();
                let stiffness = rod.stretch.iter().map(|s| s.stiffness);
                let stiffness_of = |j: &JointLaw<f64>| {
                    let [b11, _, b22] = j.stiffness.bend;
                    [b11, b22, j.stiffness.twist]
                };
                let joints = rod.joint.iter().flat_map(stiffness_of);
                (
                    stiffness.chain(joints).chain(rod.mass).collect(),
                    rod.joint.iter().map(|j| j.natural[0] + j.natural[1]).collect(),
                )
            }
        };
        // A fold of 180 degrees has infinite curvature.
        if let Some(i) = natural.iter().position(|k| !k.is_finite()) {
            let found = format!("a fold at node {}", i + 1);
            return Err(Error::invalid("rod.shape", found, "turning angles below 180 degrees"));
        }
        match positive.into_iter().find(|x| !(x.is_normal() && *x > 0.0)) {
            Some(x) => Err(Error::invalid(
                "rod.section, material",
                format!("a stiffness or nodal mass of {x:e}"),
                "sizes, density and moduli that double precision can hold",
            )),
            None => Ok(()),
        }
    }

    /// Rejects user-defined energies whose value or gradient is not finite in the initial state. The error has the name
    /// and arc length, m, of the first one. `Ok` without energies.
    fn check_own(&self) -> Result<(), Error> {
        if self.scene.energies.is_empty() {
            return Ok(());
        }
        let found = with_model!(self, |discretized| discretized.non_finite_energy());
        found.map_or(Ok(()), |(name, place)| {
            let found = format!(
                "a value or a gradient that is not a finite number, {place} m along the \
                         rod"
            );
            Err(Error::invalid(
                format!("energy.{name}"),
                found,
                "finite numbers in the initial \
                                        state",
            ))
        })
    }

    /// The scene of the problem: polylines and recordings are read, the discretization is explicit, and an open mesh,
    /// step and scheme have their chosen values.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }
    /// Mesh, step and scheme of the problem, their estimated error, and the settings among them that the program chose.
    /// None if the program neither chose nor checked any.
    pub fn resolution(&self) -> Option<&Resolution> {
        self.scene.resolution.as_ref()
    }

    /// Replaces the estimated error of the resolution, a fraction of the rod length, by that of the run itself. Its
    /// bound becomes none for an error up to the accuracy. Above, an earlier bound stays, else it is [`Bound::Work`].
    /// No effect without a resolution, and for an error that is none or not finite.
    pub fn set_estimated_error(&mut self, error: Option<f64>) {
        let Some(resolution) = &mut self.scene.resolution else { return };
        let Some(error) = error.filter(|error| error.is_finite()) else { return };
        resolution.error = Some(error);
        // The run decides on the bound: an error above the request is a limit of work.
        let exceeds = error > resolution.accuracy;
        resolution.bound = exceeds.then(|| resolution.bound.unwrap_or(Bound::Work));
    }
    /// Name of the model, `planar` or `spatial`, and the reason of its choice as text, such as the quantity that leaves
    /// the plane.
    pub fn model(&self) -> (&'static str, &str) {
        let name = match self.model {
            AnyModel::Planar(_) => "planar",
            AnyModel::Spatial(_) => "spatial",
        };
        (name, &self.reason)
    }
    /// The problem with the type of its model, planar or spatial, and its setup over `f64`, both borrowed.
    pub fn discretized(&self) -> AnyProblem<'_> {
        match &self.model {
            AnyModel::Planar(modelled) => AnyProblem::Planar(self.discretized_as(modelled)),
            AnyModel::Spatial(modelled) => AnyProblem::Spatial(self.discretized_as(modelled)),
        }
    }

    /// Whether modes and stability out of the plane of a planar scene can be computed with its spatial model. This
    /// requires a shear modulus or Poisson's ratio, and no entry of `loads.point` with a moment, whose work in space
    /// depends on the path.
    pub(crate) fn can_twist(&self) -> bool {
        self.scene.material.has_shear_modulus()
            && self.scene.loads.point.iter().all(|load| load.moment == [0.0; 3])
    }
    /// A new spatial model of the scene with its setup, also for a planar problem, whose normal it takes for
    /// `supports.angle`.
    pub(crate) fn spatial_model(&self) -> ModelWithSetup<SpatialModel> {
        let normal = self.planar().map(|discretized| discretized.model.normal());
        let correction = correction(&self.scene, &self.mesh, &self.varying);
        let model = SpatialModel::new(&self.scene, &self.mesh, correction, normal);
        ModelWithSetup::new(model, &self.scene)
    }
    /// This problem, borrowed, with the given model and setup in place of its own, such as the [spatial
    /// model](Self::spatial_model) of a planar problem.
    pub(crate) fn discretized_as<'a, M: Model>(
        &'a self,
        modelled: &'a ModelWithSetup<M>,
    ) -> Discretized<'a, M> {
        Discretized { problem: self, model: &modelled.model, setup: &modelled.setup }
    }
    /// The problem with its planar model and the setup of that; none if the model is spatial.
    pub fn planar(&self) -> Option<PlanarProblem<'_>> {
        match self.discretized() {
            AnyProblem::Planar(discretized) => Some(discretized),
            AnyProblem::Spatial(_) => None,
        }
    }
    /// The problem with its spatial model and the setup of that; none if the model is planar.
    pub fn spatial(&self) -> Option<SpatialProblem<'_>> {
        match self.discretized() {
            AnyProblem::Spatial(discretized) => Some(discretized),
            AnyProblem::Planar(_) => None,
        }
    }
    /// Number of unknowns of the rod, those that supports hold included: 2 per node in a plane, else 3 per node and 1
    /// per edge.
    pub fn dof(&self) -> usize {
        with_model!(self, |discretized| discretized.model.dof())
    }
    /// Number of nodes.
    pub fn nodes(&self) -> usize {
        self.mesh.nodes.len()
    }
    /// Number of edges.
    pub fn segments(&self) -> usize {
        self.nodes() - 1
    }
    /// Positions of all nodes in the rest shape, in the world, m, from the first node on.
    pub(crate) fn rest_positions(&self) -> Vec<[f64; 3]> {
        with_model!(self, |discretized| discretized.rest_positions())
    }
    /// Position of the first node at rest in the world, m. At a clamp in the middle of an edge it is behind the wall.
    pub(crate) fn wall(&self) -> [f64; 3] {
        self.rest_positions()[0]
    }
    /// Position of the first node of the rest mesh, m, and the scene, both over the number type `D`. `seed(parameter,
    /// value)` returns the number of a parameter.
    pub(crate) fn wall_over<D: RodScalar>(
        &self,
        seed: impl Fn(Parameter, f64) -> D,
    ) -> ([D; 3], Scene<D>) {
        let scene = self.scene.over_parameters(seed);
        // `supports.angle` rotates the rod about this node, so that it stays in place.
        (scene.made_mesh().nodes[0], scene)
    }
    /// Upper bound of the turning angle of the tangent along the rod, rad: the larger one of the rest shape and the
    /// stress-free shape. That of the rest shape is its formula, or for a polyline the sum of the angles between edges.
    pub(crate) fn turning(&self) -> f64 {
        let rest = self.scene.rod.shape.turning().unwrap_or_else(|| self.mesh.turning());
        natural_turn::turning(&self.scene, rest, self.length())
    }
    /// Position of a point of the rest shape in the world, m: the weighted sum of the nodes of its `stencil`.
    pub(crate) fn rest_position(&self, stencil: &Stencil) -> [f64; 3] {
        let nodes = self.rest_positions();
        stencil.place(|i| nodes[i])
    }
    /// Position in the world, m, of a marker on the rod in its rest shape. `offset`, m, is along the tangent and the
    /// two material directors at `point`. An error for a point that is not on the rod.
    pub(crate) fn marker_at_rest(&self, point: Point, offset: [f64; 3]) -> Result<[f64; 3], Error> {
        let marker = self.marker(point, offset)?;
        let beside = with_model!(self, |discretized| discretized.beside_at_rest(&marker));
        Ok(add(self.rest_position(&marker.centre), beside))
    }
    /// Unit normal of the plane of a planar problem, in the world; `[0, 0, 1]` for a spatial one.
    pub(crate) fn normal(&self) -> [f64; 3] {
        match self.discretized() {
            AnyProblem::Planar(discretized) => discretized.model.normal().into(),
            AnyProblem::Spatial(_) => [0.0, 0.0, 1.0],
        }
    }
    /// The problem with `time.end` replaced by `end`, s; unchanged without `[time]`.
    pub(crate) fn lasting(mut self, end: f64) -> Self {
        if let Some(time) = &mut self.scene.time {
            time.end = end;
        }
        self
    }
    /// Length of the rod at rest, m: between its ends, of which a clamp in the middle of an edge is at that middle.
    pub fn length(&self) -> f64 {
        self.mesh.length
    }
    /// The way in which simulations of the problem compute gradients and Hessians of energies: by hand-derived formulas
    /// or dual numbers.
    pub fn derivatives(&self) -> Derivatives {
        self.derivatives
    }
    /// The problem with another way of its simulations to differentiate energies: hand-derived formulas or dual
    /// numbers.
    pub fn with_derivatives(mut self, derivatives: Derivatives) -> Self {
        self.derivatives = derivatives;
        self
    }

    /// Ends every simulation of the problem at its next step, with [`Error::Interrupted`], once
    /// `flag` is set.
    pub fn stop_when(self, flag: Arc<AtomicBool>) -> Self {
        Self { stop: Some(flag), ..self }
    }
    /// This problem with the stop flag, and the choice of hand-derived or dual derivatives, of `other`.
    fn computed_as(self, other: &Self) -> Self {
        Self { derivatives: other.derivatives, stop: other.stop.clone(), ..self }
    }
    /// Whether the flag of [`stop_when`](Self::stop_when) is set; false without a flag.
    pub(crate) fn is_stopped(&self) -> bool {
        self.stop.as_ref().is_some_and(|flag| flag.load(Ordering::Relaxed))
    }
    /// [`Error::Interrupted`] if the stop flag is set, else `Ok`.
    pub(crate) fn check_stop(&self) -> Result<(), Error> {
        if self.is_stopped() { Err(Error::Interrupted) } else { Ok(()) }
    }

    /// The problem with other values of some parameters.
    ///
    /// Model and layout are chosen again, since a section may not be square any more, or a rod may leave its plane.
    /// Mesh, step and scheme stay the same, also if the program chose them; for another choice build the problem of the
    /// [reopened](Scene::reopened) scene. Varying parameters and the estimated error are dropped; the way of
    /// differentiation and the stop flag are kept.
    ///
    /// ```
    /// use rodfit::{Parameter, Scene};
    /// let problem = Scene::load("data/cantilever.toml")?.problem()?;
    /// let softer = problem.with([(Parameter::YoungsModulus, 5e7)])?; // Pa
    /// assert!(softer.equilibrium()?.tip[1] < problem.equilibrium()?.tip[1]);
    /// assert!(problem.with([(Parameter::Radius, -1.0)]).is_err());
    /// # Ok::<(), rodfit::Error>(())
    /// ```
    ///
    /// # Errors
    ///
    /// A parameter that the scene does not have, or a value that it cannot take.
    pub fn with(&self, values: impl IntoIterator<Item = (Parameter, f64)>) -> Result<Self, Error> {
        let mut scene = self.changed(values)?;
        if let Some(resolution) = &mut scene.resolution {
            // The estimated error belongs to the previous values.
            (resolution.error, resolution.bound) = (None, None);
        }
        Ok(scene.build()?.computed_as(self))
    }

    /// The problem with other values of some parameters, and model, corrections, varying parameters, derivatives and
    /// stop flag of this one. Its results are smooth functions of the values. An error for a missing parameter, or a
    /// value that scene or mesh do not allow.
    pub(crate) fn with_fixed_layout(
        &self,
        values: impl IntoIterator<Item = (Parameter, f64)>,
    ) -> Result<Self, Error> {
        let scene = self.changed(values)?;
        scene.validate()?;
        Ok(Self::of(scene, self.varying.clone(), Some(self))?.computed_as(self))
    }

    /// The problem of the same scene, with model and corrections that suit all values of the parameters `varying`. A
    /// clamp becomes compliant if its rotational compliance varies. Joints are those of a curved rod if the arc angle,
    /// or the curvature factor of a curved rod, varies. An error if no model represents the scene.
    pub(crate) fn with_generic_layout_for(&self, varying: Vec<Parameter>) -> Result<Self, Error> {
        Ok(Self::of(self.scene.clone(), varying, None)?.computed_as(self))
    }

    /// The problem as of [`with_generic_layout_for`](Self::with_generic_layout_for), for the present varying parameters
    /// and `parameter` in addition.
    pub(crate) fn with_generic_layout_for_another(
        &self,
        parameter: Parameter,
    ) -> Result<Self, Error> {
        self.with_generic_layout_for(self.varying.iter().copied().chain([parameter]).collect())
    }

    /// The problem of another scene, such as one with another mesh or step, which is validated. Varying parameters,
    /// choice of derivatives and stop flag are those of this problem; the model is chosen again. Error: an invalid
    /// scene, with the key.
    pub(crate) fn with_scene(&self, scene: Scene) -> Result<Self, Error> {
        scene.validate()?;
        Ok(Self::of(scene, self.varying.clone(), None)?.computed_as(self))
    }

    /// The scene with other values of some parameters, without validation; an error for a parameter that the scene does
    /// not have.
    fn changed(&self, values: impl IntoIterator<Item = (Parameter, f64)>) -> Result<Scene, Error> {
        Parameter::set_all(&self.scene, values)
    }

    /// The table `[time]` of the scene: duration, step and scheme.
    ///
    /// # Errors
    /// [`Error::Invalid`] for a scene without it, and for a step that does not resolve the motion of the supports. Also
    /// for a support that is displaced from t = 0 on, without ramp or frequency, unless the motion starts in
    /// equilibrium.
    pub fn time(&self) -> Result<&Time, Error> {
        let (file, supports) = (self.scene.path.as_deref(), &self.scene.supports);
        if self.scene.initial.state != InitialState::Equilibrium {
            supports.check_start().map_err(|error| error.in_file(file))?;
        }
        if let Some(time) = &self.scene.time {
            self.scene.check_step(time.step_size()).map_err(|error| error.in_file(file))?;
        }
        self.scene.time.as_ref().ok_or_else(|| {
            Error::invalid(
                "time",
                "no such table",
                "[time] with end, which a simulation requires; step is optional",
            )
            .in_file(self.scene.path.as_deref())
        })
    }
}

/// Frames of the rod of a model in plain numbers.
pub(crate) type FramesOf<M> = <<M as Model>::Rod<f64> as Rod<f64>>::Frames;

impl<'a, M: Model> Discretized<'a, M> {
    /// All unknowns of the rest shape in the axes of the model: the coordinates of each node in turn, m. In space an
    /// angle of zero, rad, for each edge follows those of its first node.
    pub fn rest(&self) -> Vec<f64> {
        self.model.unknowns(&self.setup.rest)
    }

    /// Positions of all nodes in the rest shape, in the world, m, from the first node on.
    fn rest_positions(&self) -> Vec<[f64; 3]> {
        let q = self.rest();
        (0..self.nodes()).map(|i| self.model.position(&q, i)).collect()
    }

    /// The reference frames of all edges at rest, from which the angles are measured; the empty type `()` in a plane.
    pub(crate) fn rest_frames(&self) -> FramesOf<M> {
        self.model.frames(&self.setup.rest)
    }

    /// Range of the indices of the free unknowns: all but those that supports hold at both ends, which are outermost. A
    /// recorded end holds all its recorded nodes; in space with free twist only the position of the outermost one.
    /// Other unknowns that a recording prescribes are part of the range; see `prescribed`. Empty if supports hold all.
    pub fn free(&self) -> Range<usize> {
        let (supports, dof) = (&self.problem.scene.supports, self.model.dof());
        let held = |end| match (supports.at(end), &supports.path) {
            // Position of the outermost node; the angle of its edge is free.
            (Support::Recorded, _) if M::STRIDE > 3 && supports.turns_freely(end) => 3,
            // All unknowns up to the position of the innermost held node.
            (Support::Recorded, Some(path)) => {
                M::STRIDE * path.held_nodes(self.nodes() - 1) - M::STRIDE.saturating_sub(3)
            }
            (support, _) => self.model.held_unknowns(support),
        };
        // Held unknowns are outermost on both sides: the free ones are one range.
        let start = held(End::Start).min(dof);
        start..dof.saturating_sub(held(End::End)).max(start)
    }

    /// Whether supports at the ends hold all coordinates of a node.
    pub(crate) fn holds(&self, node: usize) -> bool {
        let (free, first) = (self.free(), M::STRIDE * node);
        (first..first + M::STRIDE.min(3)).all(|i| !free.contains(&i))
    }

    /// Indices among all unknowns, ascending, of the coordinates of nodes whose positions a recording prescribes; those
    /// outside the [free](Self::free) range are left out. Empty without a recording.
    pub(crate) fn prescribed(&self) -> PrescribedDofs {
        let free = self.free();
        let nodes = self.recorded().into_iter().flat_map(|part| part.nodes);
        let places =
            nodes.flat_map(|held| M::STRIDE * held.node..M::STRIDE * held.node + M::STRIDE.min(3));
        PrescribedDofs::new(places.filter(|i| free.contains(i)).collect())
    }

    /// Number of nodes.
    pub fn nodes(&self) -> usize {
        self.problem.nodes()
    }

    /// The scene.
    pub fn scene(&self) -> &'a Scene {
        &self.problem.scene
    }

    /// The way in which simulations of the problem compute gradients and Hessians of energies: by hand-derived formulas
    /// or dual numbers.
    pub(crate) fn derivatives(&self) -> Derivatives {
        self.problem.derivatives
    }

    /// Unit normal of the plane of a planar problem, in the world, also if this is its spatial model; `[0, 0, 1]` for a
    /// spatial problem.
    pub(crate) fn normal(&self) -> [f64; 3] {
        self.problem.normal()
    }

    /// The square of the frequency scale of bending, `E I/(rho A L^4)`, 1/s^2, with material, area and smaller second
    /// moment halfway along the rod of the length L.
    pub(crate) fn bending_frequency_squared(&self) -> f64 {
        // Halfway along the rod, a representative place of tapered rods.
        let (section, material) = self.scene().at(0.5);
        let section = section.moments();
        let [i1, i2] = section.second_moments;
        let length = self.problem.length();
        material.youngs_modulus * i1.min(i2) / (material.density * section.area * length.powi(4))
    }

    /// The setup (scene, mesh, rest shape, initial shape) over the number type `D`, such as dual numbers;
    /// `seed(parameter, value)` returns the number of each parameter.
    pub(crate) fn setup_over<D: RodScalar>(
        &self,
        seed: impl Fn(Parameter, f64) -> D,
    ) -> Setup<D, M> {
        Setup::new(self.model, self.scene().over_parameters(seed))
    }

    /// Name and arc length, m, of the first user-defined energy whose value or gradient is not finite. It is evaluated
    /// in the initial shape of the scene, or else in the rest shape. None if all are finite.
    fn non_finite_energy(&self) -> Option<(String, f64)> {
        let (q, frames) = self.begin(self.setup);
        self.rod().non_finite_energy(&q, &frames)
    }

    /// The rod over `f64`: elements, masses with weight, point and line loads, internal friction, user-defined
    /// energies, actuators and contacts. Signals have their values at `loads.at_time`.
    pub fn rod(&self) -> M::Rod<f64> {
        self.setup.rod(self.model)
    }

    /// [`rod`](Self::rod) with the values of signals at a time, s.
    pub fn rod_at(&self, time: f64) -> M::Rod<f64> {
        self.setup.rod_at(self.model, time)
    }
}
