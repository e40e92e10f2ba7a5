//! A validated scene, ready to simulate: rest state, supports, loads and the model they need.

mod remeshed;
mod start;

pub(crate) use start::Settled;

use crate::energy::Derivatives;
use crate::energy::bend_twist::JointLaw;
use crate::error::Error;
use crate::model::{Arcs, Model, NodalLoad, PlanarModel, SpatialModel};
use crate::parameter::{Parameter, Properties};
use crate::point::{Point, Stencil};
use crate::rod::{Rod, planar, spatial};
use crate::scalar::Nestable;
use crate::scene::shape::Mesh;
use crate::scene::{
    Clamp, Dimension, Discretization, InitialState, NamedNode, Node, PointForce, Scene, Support,
    Time,
};
use crate::sensitivity::{ImplicitSensitivity, Sensitivity};
use crate::simulation::Simulation;
use crate::vector::{add, scale};
use num_dual::Dual64;
use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Why a factor on the curvature does nothing.
const BESIDE_STRAIGHT: &str =
    "beside a straight rest shape, which has no curvature to be multiplied";

/// A scene with its mesh and model. Made by [`Scene::problem`].
#[derive(Clone, Debug)]
pub struct Problem {
    scene: Scene,
    derivatives: Derivatives,
    model: AnyModel,
    /// Why this model.
    reason: String,
    /// Of every node from the wall, m.
    arc_length: Vec<f64>,
    length: f64,
    /// Loads that hold the rod until t = 0.
    held: Vec<NodalLoad>,
    /// The nodes of the shape the rod begins in, if not the rest shape, m.
    start_shape: Option<Vec<[f64; 3]>>,
    /// The unknowns of the equilibrium the rod starts from, angles measured from the frames it
    /// begins with; empty if it does not.
    initial: Vec<f64>,
    /// Ends simulations when set.
    stop: Option<Arc<AtomicBool>>,
}

#[derive(Clone, Debug)]
enum AnyModel {
    Planar(PlanarModel),
    Spatial(SpatialModel),
}

/// A problem whose model is known: what makes rods, simulations and sensitivities.
#[derive(Debug)]
pub struct Posed<'a, M, const W: usize> {
    problem: &'a Problem,
    /// The model.
    pub model: &'a M,
}

/// A planar problem.
pub type PlanarProblem<'a> = Posed<'a, PlanarModel, { planar::HALF_BANDWIDTH }>;
/// A spatial problem.
pub type SpatialProblem<'a> = Posed<'a, SpatialModel, { spatial::HALF_BANDWIDTH }>;

/// A problem by its model.
#[derive(Debug)]
pub enum AnyProblem<'a> {
    /// In a plane.
    Planar(PlanarProblem<'a>),
    /// In space.
    Spatial(SpatialProblem<'a>),
}

impl Scene {
    /// Validates the scene and builds what a simulation needs.
    pub fn problem(&self) -> Result<Problem, Error> {
        self.validate()?;
        Problem::new(self.clone()).map_err(|error| error.in_file(self.path.as_deref()))
    }
}

impl Problem {
    fn new(mut scene: Scene) -> Result<Self, Error> {
        scene.rod.discretization = Some(scene.discretization());
        let mesh = mesh(&scene)?;
        let natural = &scene.rod.natural_curvature;
        if natural.values().iter().any(|factor| *factor != 1.0) && mesh.is_straight() {
            let found =
                natural.whole().map_or(format!("{:?}", natural.values()), |f| f.to_string());
            let allowed = format!("1 {BESIDE_STRAIGHT}");
            return Err(Error::invalid("rod.natural_curvature", found, allowed));
        }
        let loads = nodal(&scene.loads.point, "loads", mesh.nodes.len())?;
        let start_shape = start_shape(&scene, &mesh)?;
        let (model, reason) = choose(&scene, &mesh, start_shape.as_deref(), &loads)?;
        let held = nodal(&scene.initial.point, "initial", mesh.nodes.len())?;
        let mut problem = Self {
            held,
            start_shape,
            initial: Vec::new(),
            derivatives: Derivatives::default(),
            model,
            reason,
            arc_length: mesh.arc_length,
            length: mesh.length,
            scene,
            stop: None,
        };
        problem.check_sizes()?;
        problem.find_start()?;
        Ok(problem)
    }

    /// Finds the equilibrium the scene starts from, if it does.
    fn find_start(&mut self) -> Result<(), Error> {
        if self.scene.initial.state == InitialState::Equilibrium {
            self.initial = match self.posed() {
                AnyProblem::Planar(posed) => posed.equilibrium_held()?,
                AnyProblem::Spatial(posed) => posed.equilibrium_held()?,
            };
        }
        Ok(())
    }

    /// Refuses stiffnesses and masses that overflow or vanish, and folds.
    fn check_sizes(&self) -> Result<(), Error> {
        let (positive, natural): (Vec<f64>, Vec<f64>) = match self.posed() {
            AnyProblem::Planar(posed) => {
                let rod = posed.rod();
                let stiffness = rod.stretch.iter().map(|s| s.stiffness);
                (
                    stiffness.chain(rod.bend.iter().map(|b| b.stiffness)).chain(rod.mass).collect(),
                    rod.bend.iter().map(|b| b.natural_curvature).collect(),
                )
            }
            AnyProblem::Spatial(posed) => {
                let rod = posed.rod();
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

    /// The scene.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }
    /// The name of the model chosen, `planar` or `spatial`, and why.
    pub fn model(&self) -> (&'static str, &str) {
        let name = match self.model {
            AnyModel::Planar(_) => "planar",
            AnyModel::Spatial(_) => "spatial",
        };
        (name, &self.reason)
    }
    /// The problem with its model.
    pub fn posed(&self) -> AnyProblem<'_> {
        match &self.model {
            AnyModel::Planar(model) => AnyProblem::Planar(Posed { problem: self, model }),
            AnyModel::Spatial(model) => AnyProblem::Spatial(Posed { problem: self, model }),
        }
    }
    /// Whether the scene says how stiff the rod is in torsion, and has no moments, whose work out of
    /// the plane would depend on the way: whether it can be looked at in space.
    pub(crate) fn can_twist(&self) -> bool {
        let material = &self.scene.material;
        let known = material.shear_modulus.is_some() || material.poisson_ratio.is_some();
        known && self.scene.loads.point.iter().all(|load| load.moment == [0.0; 3])
    }
    /// The spatial model of the scene, whatever model it has.
    pub(crate) fn spatial_model(&self) -> Result<SpatialModel, Error> {
        let mut mesh = mesh(&self.scene)?;
        if let Some(posed) = self.planar() {
            // Turned as the planar model's.
            let rest = posed.rest();
            mesh.nodes = (0..self.nodes()).map(|i| posed.model.position(&rest, i)).collect();
        }
        let loads = nodal(&self.scene.loads.point, "loads", mesh.nodes.len())?;
        SpatialModel::new(&self.scene, &mesh, arcs(&self.scene, &mesh), &loads)
    }
    /// The problem with another model.
    pub(crate) fn posed_as<'a, M: Model<W>, const W: usize>(
        &'a self,
        model: &'a M,
    ) -> Posed<'a, M, W> {
        Posed { problem: self, model }
    }
    /// The problem with its planar model, if it has one.
    pub fn planar(&self) -> Option<PlanarProblem<'_>> {
        match self.posed() {
            AnyProblem::Planar(posed) => Some(posed),
            AnyProblem::Spatial(_) => None,
        }
    }
    /// The problem with its spatial model, if it has one.
    pub fn spatial(&self) -> Option<SpatialProblem<'_>> {
        match self.posed() {
            AnyProblem::Spatial(posed) => Some(posed),
            AnyProblem::Planar(_) => None,
        }
    }
    /// Number of unknowns, the supported ones included.
    pub fn dof(&self) -> usize {
        match &self.model {
            AnyModel::Planar(model) => model.dof(),
            AnyModel::Spatial(model) => model.dof(),
        }
    }
    /// Number of nodes.
    pub fn nodes(&self) -> usize {
        self.arc_length.len()
    }
    /// Number of edges.
    pub fn segments(&self) -> usize {
        self.nodes() - 1
    }
    /// The rod's first node at rest in the world, m.
    pub(crate) fn wall(&self) -> [f64; 3] {
        match self.posed() {
            AnyProblem::Planar(posed) => posed.model.position(&posed.rest(), 0),
            AnyProblem::Spatial(posed) => posed.model.position(&posed.rest(), 0),
        }
    }
    /// How far the rest shape's tangent turns from end to end, rad.
    pub(crate) fn turning(&self) -> Result<f64, Error> {
        let known = self.scene.rod.shape.turning();
        known.map_or_else(|| Ok(mesh(&self.scene)?.turning()), Ok)
    }
    /// A point of the rest shape in the world, m.
    pub(crate) fn rest_position(&self, stencil: &Stencil) -> [f64; 3] {
        let node: &dyn Fn(usize) -> [f64; 3] = match self.posed() {
            AnyProblem::Planar(posed) => &move |i| posed.model.position(&posed.rest(), i),
            AnyProblem::Spatial(posed) => &move |i| posed.model.position(&posed.rest(), i),
        };
        stencil.nodes.iter().fold([0.0; 3], |sum, (i, w)| add(sum, scale(node(*i), *w)))
    }
    /// The normal of the plane of a planar scene; of a spatial one the z axis.
    pub(crate) fn normal(&self) -> [f64; 3] {
        match self.posed() {
            AnyProblem::Planar(posed) => posed.model.plane.x.cross(&posed.model.plane.y).into(),
            AnyProblem::Spatial(_) => [0.0, 0.0, 1.0],
        }
    }
    /// The problem with a simulation that lasts until `end`, s.
    pub(crate) fn lasting(mut self, end: f64) -> Self {
        if let Some(time) = &mut self.scene.time {
            time.end = end;
        }
        self
    }
    /// Length between wall and tip, m.
    pub fn length(&self) -> f64 {
        self.length
    }
    /// Which derivatives simulations use.
    pub fn derivatives(&self) -> Derivatives {
        self.derivatives
    }
    /// Chooses the derivatives simulations use.
    pub fn with_derivatives(mut self, derivatives: Derivatives) -> Self {
        self.derivatives = derivatives;
        self
    }

    /// Ends every simulation of the problem at its next step, with [`Error::Interrupted`], once
    /// `flag` is set.
    pub fn stop_when(self, flag: Arc<AtomicBool>) -> Self {
        Self { stop: Some(flag), ..self }
    }
    /// With the choices of how to compute that `other` was given.
    pub(crate) fn computed_as(self, other: &Self) -> Self {
        Self { derivatives: other.derivatives, stop: other.stop.clone(), ..self }
    }
    /// Whether the flag is set.
    pub(crate) fn is_stopped(&self) -> bool {
        self.stop.as_ref().is_some_and(|flag| flag.load(Ordering::Relaxed))
    }
    /// An error once the flag is set.
    pub(crate) fn check_stop(&self) -> Result<(), Error> {
        if self.is_stopped() { Err(Error::Interrupted) } else { Ok(()) }
    }

    /// The problem with other values of some parameters.
    pub fn with(&self, values: impl IntoIterator<Item = (Parameter, f64)>) -> Result<Self, Error> {
        let mut scene = self.scene.clone();
        for (parameter, value) in values {
            parameter.set(&mut scene, value)?;
        }
        scene.validate()?;
        let turned = scene.supports.angle != self.scene.supports.angle;
        self.check_velocities(&scene)?;
        let twisted = scene.rod.natural_twist.is_zero() != self.scene.rod.natural_twist.is_zero();
        if turned || twisted {
            let path = scene.path.clone();
            let problem = Self::new(scene).map_err(|error| error.in_file(path.as_deref()))?;
            return Ok(problem.computed_as(self));
        }
        let mut problem = Self { scene, ..self.clone() };
        problem.check_sizes().map_err(|error| error.in_file(self.scene.path.as_deref()))?;
        problem.find_start()?;
        Ok(problem)
    }

    /// Refuses parameters that the scene does not have, or that would lead out of the plane of its
    /// model.
    pub fn check_parameter(&self, parameter: Parameter) -> Result<(), Error> {
        let value = parameter.of(&self.scene).ok_or_else(|| parameter.absent(&self.scene))?;
        if parameter == Parameter::ClampAngle && self.planar().is_none() {
            return Err(parameter.absent(&self.scene));
        }
        let curvature =
            matches!(parameter, Parameter::NaturalCurvature | Parameter::NaturalCurvatureOf(_));
        if curvature && mesh(&self.scene)?.is_straight() {
            let found = format!("{parameter} {BESIDE_STRAIGHT}");
            return Err(Error::invalid("parameter", found, "with a curved rest shape"));
        }
        let mut moved = self.scene.clone();
        let speeds = moved.initial.velocity.iter().chain(&moved.initial.angular_velocity);
        let step = speeds.fold(1.0_f64, |most, v| most.max(v.abs()));
        if parameter.is_initial_velocity() {
            parameter.set(&mut moved, value + step)?;
            self.check_velocities(&moved)?;
        }
        Ok(())
    }

    /// Refuses initial velocities that leave the plane of the model.
    fn check_velocities(&self, scene: &Scene) -> Result<(), Error> {
        let AnyModel::Planar(model) = &self.model else { return Ok(()) };
        let initial = &scene.initial;
        let [_, _, out] = model.components(initial.velocity);
        let [x, y, about] = model.components(initial.angular_velocity);
        let leaves = |part: f64, other: f64| part.abs() > 1e-9 * part.hypot(other);
        let found = if leaves(out, initial.velocity.map(f64::abs).into_iter().sum()) {
            ("initial.velocity", initial.velocity)
        } else if leaves(x.hypot(y), about) {
            ("initial.angular_velocity", initial.angular_velocity)
        } else {
            return Ok(());
        };
        let n = self.normal().map(|c| (c * 1e6).round() / 1e6 + 0.0);
        let allowed = format!(
            "a motion in the plane with normal {n:?} that the scene was found to lie in; \
             with rod.dimension = \"spatial\" any"
        );
        let error = Error::invalid(found.0, format!("{:?}", found.1), allowed);
        Err(error.in_file(self.scene.path.as_deref()))
    }

    /// What speaks against a simulation of the scene, though it can be made: steps that follow the
    /// motion of a support badly.
    pub fn warnings(&self) -> Vec<String> {
        let time = self.scene.time.as_ref();
        time.map_or(Vec::new(), |time| self.scene.supports.step_warnings(time.step))
    }

    /// The scene's `[time]`.
    pub fn time(&self) -> Result<&Time, Error> {
        let (file, supports) = (self.scene.path.as_deref(), &self.scene.supports);
        if self.scene.initial.state != InitialState::Equilibrium {
            supports.check_start().map_err(|error| error.in_file(file))?;
        }
        if let Some(time) = &self.scene.time {
            supports.check_step(time.step).map_err(|error| error.in_file(file))?;
        }
        self.scene.time.as_ref().ok_or_else(|| {
            Error::invalid("time", "no such table", "[time] with end and step, to simulate")
                .in_file(self.scene.path.as_deref())
        })
    }

    /// The nodes and weights whose sum is a point of the rod.
    pub fn stencil(&self, point: Point) -> Result<Stencil, Error> {
        match point {
            Point::Tip => Ok(Stencil::node(self.arc_length.len() - 1)),
            Point::Node(i) if i < self.arc_length.len() => Ok(Stencil::node(i)),
            Point::Node(i) => Err(Error::OutOfRange {
                what: "node",
                found: i as f64,
                low: 0.0,
                high: (self.arc_length.len() - 1) as f64,
            }),
            Point::ArcLength(s) => {
                if !(0.0..=self.length).contains(&s) {
                    return Err(Error::OutOfRange {
                        what: "arc_length",
                        found: s,
                        low: 0.0,
                        high: self.length,
                    });
                }
                Ok(Stencil::between(&self.arc_length, s))
            }
        }
    }

    /// Arc length of a point from the wall, m.
    pub fn arc_length(&self, point: Point) -> Result<f64, Error> {
        self.stencil(point)?;
        Ok(match point {
            Point::Tip => self.arc_length[self.arc_length.len() - 1],
            Point::Node(i) => self.arc_length[i],
            Point::ArcLength(s) => s,
        })
    }
}

/// A model's frames.
pub(crate) type FramesOf<M, const W: usize> = <<M as Model<W>>::Rod<f64> as Rod<f64, W>>::Frames;

impl<M: Model<W>, const W: usize> Posed<'_, M, W> {
    /// The unknowns at rest, m (rad for angles).
    pub fn rest(&self) -> Vec<f64> {
        self.model.rest()
    }

    /// The unknowns that the supports leave free.
    pub fn free(&self) -> Range<usize> {
        let (supports, dof) = (&self.problem.scene.supports, self.model.dof());
        let start = self.model.held(supports.start).min(dof);
        start..dof.saturating_sub(self.model.held(supports.end)).max(start)
    }

    /// Number of nodes.
    pub fn nodes(&self) -> usize {
        self.problem.nodes()
    }

    /// The scene.
    pub fn scene(&self) -> &Scene {
        &self.problem.scene
    }

    /// Which derivatives are used.
    pub(crate) fn derivatives(&self) -> Derivatives {
        self.problem.derivatives
    }

    /// The normal of the plane of a planar scene, whatever the model.
    pub(crate) fn normal(&self) -> [f64; 3] {
        self.problem.normal()
    }

    /// The square of the frequency scale of bending, `E I/(rho A L^4)`, 1/s^2.
    pub(crate) fn bending_frequency_squared(&self) -> f64 {
        let p = Properties::<f64>::of(&self.problem.scene, |_, value| value);
        let [i1, i2] = p.second_moments;
        p.youngs_modulus * i1.min(i2) / (p.density * p.area * self.problem.length.powi(4))
    }

    /// The rod with plain numbers.
    pub fn rod(&self) -> M::Rod<f64> {
        self.model.rod(&Properties::of(&self.problem.scene, |_, value| value))
    }

    /// A simulation at the start, over plain numbers.
    pub fn simulation(&self) -> Simulation<f64, M::Rod<f64>, W> {
        self.simulation_over(|_, value| value)
    }

    /// A simulation at the start over any scalar; `seed` makes the numbers of the parameters.
    ///
    /// ```no_run
    /// # use rodfit::{Scene, Parameter};
    /// use num_dual::Dual64;
    /// let problem = Scene::load("cantilever.toml")?.problem()?;
    /// let planar = problem.planar().expect("the cantilever lies in a plane");
    /// let mut simulation = planar.simulation_over(|parameter, value| {
    ///     Dual64::new(value, if parameter == Parameter::YoungsModulus { 1.0 } else { 0.0 })
    /// });
    /// simulation.step_to(1e-3)?;
    /// # Ok::<(), rodfit::Error>(())
    /// ```
    pub fn simulation_over<D: Nestable>(
        &self,
        seed: impl Fn(Parameter, f64) -> D,
    ) -> Simulation<D, M::Rod<D>, W> {
        let properties = Properties::of(&self.problem.scene, seed);
        let rod = self.model.rod(&properties);
        let start = self.start(&rod);
        let velocity = self.start_velocity(&rod, &start.0, &properties);
        let mut simulation = Simulation::new(
            rod,
            start,
            self.free(),
            properties.damping,
            (self.problem.scene.scheme(), properties.beta),
            self.problem.length,
            self.problem.derivatives,
        );
        if let Some(drive) = self.drive() {
            simulation.drive(drive);
        }
        if let Some(velocity) = velocity {
            simulation.set_velocity(&velocity);
        }
        simulation
    }

    /// The sensitivity of a simulation to one parameter, at the start.
    pub fn sensitivity(&self, parameter: Parameter) -> Sensitivity<M::Rod<Dual64>, W> {
        let seed = |p, value| Dual64::new(value, f64::from(p == parameter));
        let simulation = self.simulation_over(seed);
        match simulation.is_direct() {
            true => Sensitivity::direct(simulation),
            false => Sensitivity::Implicit(Box::new(ImplicitSensitivity::new(&simulation))),
        }
    }
}

/// The rest shape's mesh, cut by the walls.
fn mesh(scene: &Scene) -> Result<Mesh, Error> {
    let mesh = scene.rod.shape.mesh(scene.rod.segments, cuts(scene), &scene.folder())?;
    check_edges("rod.shape", &mesh.nodes)?;
    Ok(mesh)
}

/// Lengths of edges, m, whose fourth powers double precision can hold.
const EDGES: std::ops::RangeInclusive<f64> = 1e-50..=1e50;

/// Refuses edges, at `key`, that cannot be computed with.
fn check_edges(key: &str, nodes: &[[f64; 3]]) -> Result<(), Error> {
    let length = |p: &[[f64; 3]]| {
        let [x, y, z] = [0, 1, 2].map(|c| p[1][c] - p[0][c]);
        x.hypot(y).hypot(z)
    };
    match nodes.windows(2).map(length).find(|length| !EDGES.contains(length)) {
        Some(length) => {
            let allowed = format!("edges of {:e} to {:e} m", EDGES.start(), EDGES.end());
            Err(Error::invalid(key, format!("an edge of {length:e} m"), allowed))
        }
        None => Ok(()),
    }
}

/// Which outermost edges a wall cuts.
pub(crate) fn cuts(scene: &Scene) -> [bool; 2] {
    let cut = |support| support == Support::Clamped && scene.supports.clamp == Clamp::MidEdge;
    [cut(scene.supports.start), cut(scene.supports.end)]
}

/// The edges' arcs, where the discretisation counts them.
fn arcs<'a>(scene: &Scene, mesh: &'a Mesh) -> Option<Arcs<'a>> {
    let edges = mesh.nodes.windows(2).zip(&mesh.arcs);
    // Turns of 5e-6 a joint and more, which rounding errors do not make.
    let mut longer = edges.map(|(p, arc)| {
        let [x, y, z] = [0, 1, 2].map(|c| p[1][c] - p[0][c]);
        arc / (x * x + y * y + z * z).sqrt() - 1.0 > 1e-12
    });
    let curved = !scene.rod.natural_curvature.is_zero() && longer.any(|longer| longer);
    let joints = curved || scene.discretization() == Discretization::CorrectedStatics;
    let arcs = Arcs { lengths: &mesh.arcs, cut: cuts(scene), joints };
    (scene.discretization() != Discretization::Paper).then_some(arcs)
}

/// The smallest model that can hold the scene, or the one asked for; and why.
fn choose(
    scene: &Scene,
    mesh: &Mesh,
    start: Option<&[[f64; 3]]>,
    loads: &[NodalLoad],
) -> Result<(AnyModel, String), Error> {
    let arcs = arcs(scene, mesh);
    let asked = scene.rod.dimension;
    let why = match asked {
        Dimension::Spatial => "asked for".to_string(),
        Dimension::Auto | Dimension::Planar => {
            match PlanarModel::new(scene, mesh, start, arcs, loads)? {
                Ok(model) if asked == Dimension::Planar => {
                    return Ok((AnyModel::Planar(model), "asked for".into()));
                }
                Ok(model) => {
                    let n = model.plane.x.cross(&model.plane.y);
                    let n = [n.x, n.y, n.z].map(|c| (c * 1e6).round() / 1e6 + 0.0);
                    let why =
                        format!("rest shape, loads and section lie in the plane with normal {n:?}");
                    return Ok((AnyModel::Planar(model), why));
                }
                Err(why) if asked == Dimension::Planar => {
                    let allowed = format!("\"auto\" or \"spatial\", as {why}");
                    return Err(Error::invalid("rod.dimension", "\"planar\"", allowed));
                }
                Err(why) => why,
            }
        }
    };
    if scene.supports.angle != 0.0 {
        let found = format!("{} in a spatial scene ({why})", scene.supports.angle);
        return Err(Error::invalid("supports.angle", found, "planar scenes only"));
    }
    if scene.material.shear_modulus.is_none() && scene.material.poisson_ratio.is_none() {
        let found = format!("neither shear_modulus nor poisson_ratio, in a spatial scene ({why})");
        return Err(Error::invalid("material", found, "one of the two: the rod can twist"));
    }
    Ok((AnyModel::Spatial(SpatialModel::new(scene, mesh, arcs, loads)?), why))
}

/// The nodes of the shape the rod begins in, where the scene gives one.
fn start_shape(scene: &Scene, rest: &Mesh) -> Result<Option<Vec<[f64; 3]>>, Error> {
    let Some(shape) = &scene.initial.shape else { return Ok(None) };
    let nodes = shape.nodes_of(rest, &scene.folder())?;
    check_edges("initial.shape", &nodes)?;
    Ok(Some(nodes))
}

fn nodal(loads: &[PointForce], table: &str, nodes: usize) -> Result<Vec<NodalLoad>, Error> {
    let on = |(k, load): (usize, &PointForce)| {
        let node = match load.node {
            Node::Named(NamedNode::Tip) => nodes - 1,
            Node::Index(i) if i < nodes => i,
            Node::Index(i) => {
                let allowed = format!("\"tip\" or 0 .. {}", nodes - 1);
                return Err(Error::invalid(format!("{table}.point[{k}].node"), i, allowed));
            }
        };
        Ok(NodalLoad { node, force: load.force, moment: load.moment })
    };
    loads.iter().enumerate().map(on).collect()
}
