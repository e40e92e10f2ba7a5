//! A validated scene, ready to simulate: rest state, supports, loads and the model they need.

use crate::banded::{BandMatrix, Ldlt};
use crate::energy::Derivatives;
use crate::energy::bend_twist::JointLaw;
use crate::error::Error;
use crate::flow::{Flow, Rest};
use crate::frame::Frames;
use crate::model::{Model, PlanarModel, SpatialModel};
use crate::parameter::{Parameter, Properties};
use crate::point::{Point, Stencil};
use crate::rod::{Rod, SpatialRod, planar, spatial};
use crate::scalar::Nestable;
use crate::scene::shape::Mesh;
use crate::scene::{
    Clamp, Dimension, Discretization, InitialState, NamedNode, Node, PointForce, Scene, Support,
    Time,
};
use crate::sensitivity::{ImplicitSensitivity, Sensitivity};
use crate::simulation::Simulation;
use num_dual::Dual64;
use std::ops::Range;

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
    /// Forces that hold the rod until t = 0, N.
    held: Vec<(usize, [f64; 3])>,
    /// The unknowns at t = 0, angles measured from the frames of the rest shape; empty at rest.
    initial: Vec<f64>,
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
        let forces = forces_on(&scene.loads.point, "loads", mesh.nodes.len())?;
        let (model, reason) = choose(&scene, &mesh, &forces)?;
        let held = forces_on(&scene.initial.point, "initial", mesh.nodes.len())?;
        let mut problem = Self {
            held,
            initial: Vec::new(),
            derivatives: Derivatives::default(),
            model,
            reason,
            arc_length: mesh.arc_length,
            length: mesh.length,
            scene,
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
    /// Whether the scene says how stiff the rod is in torsion.
    pub(crate) fn can_twist(&self) -> bool {
        let material = &self.scene.material;
        material.shear_modulus.is_some() || material.poisson_ratio.is_some()
    }
    /// The spatial model of the scene, whatever model it has.
    pub(crate) fn spatial_model(&self) -> Result<SpatialModel, Error> {
        let mesh = mesh(&self.scene)?;
        let forces = forces_on(&self.scene.loads.point, "loads", mesh.nodes.len())?;
        SpatialModel::new(&self.scene, &mesh.nodes, arcs(&self.scene, &mesh), &forces)
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

    /// The problem with other values of some parameters.
    pub fn with(&self, values: impl IntoIterator<Item = (Parameter, f64)>) -> Result<Self, Error> {
        let mut scene = self.scene.clone();
        for (parameter, value) in values {
            parameter.set(&mut scene, value)?;
        }
        scene.validate()?;
        let mut problem = Self { scene, ..self.clone() };
        problem.check_sizes().map_err(|error| error.in_file(self.scene.path.as_deref()))?;
        problem.find_start()?;
        Ok(problem)
    }

    /// The scene's `[time]`.
    pub fn time(&self) -> Result<&Time, Error> {
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

impl SpatialProblem<'_> {
    /// The unknowns and frames of a rod that has moved to `nodes` without turning about itself.
    pub(crate) fn placed(&self, nodes: &[[f64; 3]]) -> (Vec<f64>, Frames<f64>) {
        let mut q = self.rest();
        for (i, x) in nodes.iter().enumerate() {
            q[4 * i..4 * i + 3].copy_from_slice(x);
        }
        let mut frames = self.model.frames::<f64>();
        SpatialRod::<f64>::rebase(&mut frames, &q);
        (q, frames)
    }
}

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
        let frames = self.model.frames::<D>();
        let start = self.start(&rod, &frames);
        Simulation::new(
            rod,
            (start, frames),
            self.free(),
            properties.damping,
            (self.problem.scene.scheme(), properties.beta),
            self.problem.length,
            self.problem.derivatives,
        )
    }

    /// The rod with the forces that hold it until t = 0.
    fn held_rod<D: Nestable>(&self, rod: &M::Rod<D>) -> M::Rod<D> {
        let mut held = rod.clone();
        self.model.add_forces(&mut held, &self.problem.held);
        held
    }

    /// The state the rod creeps into from its rest shape under its loads.
    pub fn equilibrium(&self) -> Result<Rest<FramesOf<M, W>>, Error> {
        self.equilibrium_of(&self.rod())
    }

    /// The same of a rod with other loads.
    fn equilibrium_of(&self, rod: &M::Rod<f64>) -> Result<Rest<FramesOf<M, W>>, Error> {
        let scales = (self.problem.length, self.zero_frequency_squared());
        Flow::new(rod, self.free(), scales, self.problem.derivatives, self.rest())
            .descend(self.model.frames::<f64>())
    }

    /// Squared frequencies below this are zero, 1/s^2: a billionth of the slowest bending
    /// vibration's, or what rounding errors in a tangent that goes with the fourth power of the
    /// mesh amount to.
    pub(crate) fn zero_frequency_squared(&self) -> f64 {
        let noise = f64::EPSILON * (self.nodes() as f64).powi(4);
        self.bending_frequency_squared() * (1e-9 + 10.0 * noise)
    }

    /// Unknowns of the equilibrium of the held rod, angles measured from the frames at rest.
    fn equilibrium_held(&self) -> Result<Vec<f64>, Error> {
        let rod = self.held_rod(&self.rod());
        let found = self.equilibrium_of(&rod)?;
        let mut q = found.q;
        M::Rod::<f64>::refer(&mut q, &found.frames, &self.model.frames::<f64>());
        Ok(q)
    }

    /// The unknowns at t = 0. One step of Newton's method per order of derivatives that `D` carries
    /// gives an equilibrium its exact derivatives.
    fn start<D: Nestable>(
        &self,
        rod: &M::Rod<D>,
        frames: &<M::Rod<D> as Rod<D, W>>::Frames,
    ) -> Vec<D> {
        let at = match self.problem.initial.is_empty() {
            true => self.rest(),
            false => self.problem.initial.clone(),
        };
        let mut q: Vec<D> = at.into_iter().map(D::from).collect();
        if self.problem.initial.is_empty() || D::ORDER == 0 {
            return q;
        }
        let held = self.held_rod(rod);
        let n = q.len();
        let (mut gradient, mut tangent) = (vec![D::from(0.0); n], BandMatrix::zeros(n));
        let mut factors = Ldlt::with_order(n);
        for _ in 0..D::ORDER {
            held.tangent(&q, frames, Derivatives::Hand, &mut gradient, &mut tangent);
            // Where nothing resists, such as the spin of a round rod between hinges, any answer
            // along that direction will do.
            if factors.factor(&tangent, self.free()).is_err() {
                let (free, zero) = (self.free(), D::from(self.zero_frequency_squared()));
                let (mass, one) = (held.mass(), D::from(1.0));
                if factors.factor_sum(mass, zero, &tangent, one, free).is_err() {
                    // Not finite: the first step says so.
                    return vec![D::from(f64::NAN); n];
                }
            }
            factors.solve(&mut gradient);
            for i in self.free() {
                q[i] -= gradient[i];
            }
        }
        q
    }

    /// The sensitivity of a simulation to one parameter, at the start.
    pub fn sensitivity(&self, parameter: Parameter) -> Sensitivity<M::Rod<Dual64>, W> {
        let seed = |p, value| Dual64::new(value, f64::from(p == parameter));
        let simulation = self.simulation();
        if simulation.is_direct() {
            return Sensitivity::direct(self.simulation_over(seed));
        }
        let properties = Properties::of(&self.problem.scene, seed);
        let rod = self.model.rod(&properties);
        let frames = self.model.frames::<Dual64>();
        let start = self.start(&rod, &frames);
        Sensitivity::Implicit(Box::new(ImplicitSensitivity::new(
            rod,
            (start, frames),
            properties.damping,
            properties.beta,
            &simulation,
        )))
    }
}

/// The rest shape's mesh, cut by the walls.
fn mesh(scene: &Scene) -> Result<Mesh, Error> {
    let cut = |support| support == Support::Clamped && scene.supports.clamp == Clamp::MidEdge;
    let cuts = [cut(scene.supports.start), cut(scene.supports.end)];
    scene.rod.shape.mesh(scene.rod.segments.unwrap_or(0), cuts, &scene.folder())
}

/// The lengths of the edges' arcs, where the discretisation counts them.
fn arcs<'a>(scene: &Scene, mesh: &'a Mesh) -> Option<&'a [f64]> {
    (scene.discretization() == Discretization::Corrected).then_some(&mesh.arcs[..])
}

/// The smallest model that can hold the scene, or the one asked for; and why.
fn choose(
    scene: &Scene,
    mesh: &Mesh,
    forces: &[(usize, [f64; 3])],
) -> Result<(AnyModel, String), Error> {
    let (nodes, arcs) = (&mesh.nodes[..], arcs(scene, mesh));
    let asked = scene.rod.dimension;
    let why = match asked {
        Dimension::Spatial => "asked for".to_string(),
        Dimension::Auto | Dimension::Planar => {
            match PlanarModel::new(scene, nodes, arcs, forces)? {
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
    if scene.material.shear_modulus.is_none() && scene.material.poisson_ratio.is_none() {
        let found = format!("neither shear_modulus nor poisson_ratio, in a spatial scene ({why})");
        return Err(Error::invalid("material", found, "one of the two: the rod can twist"));
    }
    Ok((AnyModel::Spatial(SpatialModel::new(scene, nodes, arcs, forces)?), why))
}

fn forces_on(
    loads: &[PointForce],
    table: &str,
    nodes: usize,
) -> Result<Vec<(usize, [f64; 3])>, Error> {
    let mut forces = Vec::new();
    for (k, load) in loads.iter().enumerate() {
        let node = match load.node {
            Node::Named(NamedNode::Tip) => nodes - 1,
            Node::Index(i) if i < nodes => i,
            Node::Index(i) => {
                let allowed = format!("\"tip\" or 0 .. {}", nodes - 1);
                return Err(Error::invalid(format!("{table}.point[{k}].node"), i, allowed));
            }
        };
        forces.push((node, load.force));
    }
    Ok(forces)
}
