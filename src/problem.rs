//! A validated scene, ready to simulate: rest state, supports, loads and the model they need.

use crate::energy::{DeadLoad, Derivatives, PlanarBend, Stretch, planar_bend};
use crate::error::Error;
use crate::parameter::{Parameter, Properties};
use crate::planar_rod::{HALF_BANDWIDTH, PlanarRod};
use crate::point::{Point, Stencil};
use crate::scalar::Nestable;
use crate::scene::{Clamp, Dimension, NamedNode, Node, Plane, Scene, Support, Time};
use crate::sensitivity::Sensitivity;
use crate::simulation::Simulation;
use nalgebra::Vector3;
use num_dual::Dual64;
use std::ops::Range;

/// The simulation of a planar scene over the scalar `D`.
pub type PlanarSimulation<D> = Simulation<D, PlanarRod<D>, HALF_BANDWIDTH>;

/// A scene with its mesh and model. Made by [`Scene::problem`].
#[derive(Clone, Debug)]
pub struct Problem {
    scene: Scene,
    derivatives: Derivatives,
    plane: Plane,
    /// Rest positions in the plane, m.
    nodes: Vec<[f64; 2]>,
    /// From the wall, m.
    arc_length: Vec<f64>,
    length: f64,
    rest_length: Vec<f64>,
    natural_curvature: Vec<f64>,
    /// Which of the section's two second moments resists bending in the plane.
    second_moment: usize,
    /// In the plane, m/s^2.
    gravity: [f64; 2],
    /// Node and force in the plane, N.
    forces: Vec<(usize, [f64; 2])>,
}

impl Scene {
    /// Validates the scene and builds what a simulation needs.
    pub fn problem(&self) -> Result<Problem, Error> {
        self.validate()?;
        Problem::new(self.clone()).map_err(|error| error.in_file(self.path.as_deref()))
    }
}

impl Problem {
    fn new(scene: Scene) -> Result<Self, Error> {
        let cut = |support| support == Support::Clamped && scene.supports.clamp == Clamp::MidEdge;
        let cuts = [cut(scene.supports.start), cut(scene.supports.end)];
        let mesh = scene.rod.shape.mesh(scene.rod.segments.unwrap_or(0), cuts, &scene.folder())?;
        let forces = point_forces(&scene, mesh.nodes.len())?;
        let plane = plane_of(&scene, &mesh.nodes)?;
        let second_moment = second_moment_in(&scene, &plane, &mesh.nodes)?;

        let nodes: Vec<[f64; 2]> = mesh.nodes.iter().map(|x| plane.project((*x).into())).collect();
        let rest_length: Vec<f64> =
            nodes.windows(2).map(|p| (p[1][0] - p[0][0]).hypot(p[1][1] - p[0][1])).collect();
        let natural_curvature: Vec<f64> = nodes
            .windows(3)
            .map(|p| planar_bend::curvature(p.first_chunk().expect("windows of three")))
            .collect();
        if let Some(i) = natural_curvature.iter().position(|k| !k.is_finite()) {
            let found = format!("a fold at node {}", i + 1);
            return Err(Error::invalid("rod.shape", found, "turning angles below 180 degrees"));
        }
        let gravity = plane.project(scene.loads.gravity.into());
        let forces = forces.into_iter().map(|(i, f)| (i, plane.project(f.into()))).collect();
        let problem = Self {
            derivatives: Derivatives::default(),
            plane,
            nodes,
            arc_length: mesh.arc_length,
            length: mesh.length,
            rest_length,
            natural_curvature,
            second_moment,
            gravity,
            forces,
            scene,
        };
        problem.check_sizes()?;
        Ok(problem)
    }

    /// Refuses stiffnesses and masses that overflow or vanish.
    fn check_sizes(&self) -> Result<(), Error> {
        let rod = self.rod();
        let numbers = rod.stretch.iter().map(|s| s.stiffness);
        let numbers =
            numbers.chain(rod.bend.iter().map(|b| b.stiffness)).chain(rod.mass.iter().copied());
        match numbers.into_iter().find(|x| !(x.is_normal() && *x > 0.0)) {
            Some(x) => Err(Error::invalid(
                "rod.section, material",
                format!("a stiffness or nodal mass of {x:e}"),
                "sizes, density and modulus that double precision can hold",
            )),
            None => Ok(()),
        }
    }

    /// The scene.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }
    /// The model chosen, and why.
    pub fn model(&self) -> (&'static str, String) {
        let why = match self.scene.rod.dimension {
            Dimension::Planar => "asked for".to_string(),
            _ => {
                let n = self.plane.x.cross(&self.plane.y);
                let n = [n.x, n.y, n.z].map(|c| (c * 1e6).round() / 1e6 + 0.0);
                format!("rest shape, loads and section lie in the plane with normal {n:?}")
            }
        };
        ("planar", why)
    }
    /// Number of unknowns, the supported ones included.
    pub fn dof(&self) -> usize {
        2 * self.nodes.len()
    }
    /// Number of edges.
    pub fn segments(&self) -> usize {
        self.rest_length.len()
    }
    /// Length between wall and tip, m.
    pub fn length(&self) -> f64 {
        self.length
    }
    /// The plane of the scene.
    pub fn plane(&self) -> &Plane {
        &self.plane
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
        let problem = Self { scene, ..self.clone() };
        problem.check_sizes().map_err(|error| error.in_file(self.scene.path.as_deref()))?;
        Ok(problem)
    }

    /// The scene's `[time]`.
    pub fn time(&self) -> Result<&Time, Error> {
        self.scene.time.as_ref().ok_or_else(|| {
            Error::invalid("time", "no such table", "[time] with end and step, to simulate")
                .in_file(self.scene.path.as_deref())
        })
    }

    /// Rest positions `[x0, y0, x1, ..]` in the plane, m.
    pub fn rest(&self) -> Vec<f64> {
        self.nodes.iter().flatten().copied().collect()
    }

    /// The unknowns that the supports leave free.
    pub fn free(&self) -> Range<usize> {
        let held = |support| match support {
            Support::Free => 0,
            Support::Pinned => 2,
            Support::Clamped => 4,
        };
        let start = held(self.scene.supports.start).min(self.dof());
        start..(self.dof() - held(self.scene.supports.end)).max(start)
    }

    /// The rod with plain numbers.
    pub fn rod(&self) -> PlanarRod<f64> {
        self.rod_over(&Properties::of(&self.scene, |_, value| value))
    }

    /// The rod over any scalar.
    pub fn rod_over<D: Nestable>(&self, properties: &Properties<D>) -> PlanarRod<D> {
        let p = properties;
        let (axial, bending) =
            (p.youngs_modulus * p.area, p.youngs_modulus * p.second_moments[self.second_moment]);
        let line_density = p.density * p.area;
        let stretch = self.rest_length.iter().map(|l| Stretch {
            stiffness: axial,
            rest_length: D::from(*l),
            natural_strain: D::from(0.0),
        });
        let bends = self.rest_length.windows(2).zip(&self.natural_curvature);
        let bend = bends.map(|(l, k)| PlanarBend {
            // EI over the Voronoi length.
            stiffness: bending * (2.0 / (l[0] + l[1])),
            natural_curvature: D::from(*k),
        });
        // Half of each adjacent edge.
        let share = |i: usize| {
            let edge = |j: Option<usize>| j.and_then(|j| self.rest_length.get(j)).unwrap_or(&0.0);
            0.5 * (edge(i.checked_sub(1)) + edge(Some(i)))
        };
        let node_mass: Vec<D> = (0..self.nodes.len()).map(|i| line_density * share(i)).collect();
        let mut load: Vec<DeadLoad<D>> =
            node_mass.iter().map(|m| DeadLoad { force: self.gravity.map(|g| *m * g) }).collect();
        for (i, force) in &self.forces {
            load[*i].force[0] += D::from(force[0]);
            load[*i].force[1] += D::from(force[1]);
        }
        PlanarRod {
            stretch: stretch.collect(),
            bend: bend.collect(),
            mass: node_mass.iter().flat_map(|m| [*m, *m]).collect(),
            load,
        }
    }

    /// A simulation at the start, over plain numbers.
    pub fn simulation(&self) -> PlanarSimulation<f64> {
        self.simulation_over(|_, value| value)
    }

    /// A simulation at the start over any scalar; `seed` makes the numbers of the parameters.
    ///
    /// ```no_run
    /// # use rodfit::{Scene, Parameter};
    /// use num_dual::Dual64;
    /// let problem = Scene::load("cantilever.toml")?.problem()?;
    /// let mut simulation = problem.simulation_over(|parameter, value| {
    ///     Dual64::new(value, if parameter == Parameter::YoungsModulus { 1.0 } else { 0.0 })
    /// });
    /// simulation.step_to(1e-3)?;
    /// # Ok::<(), rodfit::Error>(())
    /// ```
    pub fn simulation_over<D: Nestable>(
        &self,
        seed: impl Fn(Parameter, f64) -> D,
    ) -> PlanarSimulation<D> {
        let properties = Properties::of(&self.scene, seed);
        let rest = self.nodes.iter().flatten().map(|x| D::from(*x)).collect();
        Simulation::new(
            self.rod_over(&properties),
            rest,
            self.free(),
            properties.damping,
            properties.beta,
            self.length,
            self.derivatives,
        )
    }

    /// The sensitivity of a simulation to one parameter, at the start.
    pub fn sensitivity(&self, parameter: Parameter) -> Sensitivity<PlanarRod<Dual64>> {
        let seed = |p, value| Dual64::new(value, f64::from(p == parameter));
        let properties = Properties::of(&self.scene, seed);
        Sensitivity::new(
            self.rod_over(&properties),
            properties.damping,
            properties.beta,
            &self.simulation(),
        )
    }

    /// The nodes and weights whose sum is a point of the rod.
    pub fn stencil(&self, point: Point) -> Result<Stencil, Error> {
        match point {
            Point::Tip => Ok(Stencil::node(self.nodes.len() - 1)),
            Point::Node(i) if i < self.nodes.len() => Ok(Stencil::node(i)),
            Point::Node(i) => Err(Error::OutOfRange {
                what: "node",
                found: i as f64,
                low: 0.0,
                high: (self.nodes.len() - 1) as f64,
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
            Point::Tip => self.arc_length[self.nodes.len() - 1],
            Point::Node(i) => self.arc_length[i],
            Point::ArcLength(s) => s,
        })
    }
}

fn point_forces(scene: &Scene, nodes: usize) -> Result<Vec<(usize, [f64; 3])>, Error> {
    let mut forces = Vec::new();
    for (k, load) in scene.loads.point.iter().enumerate() {
        let node = match load.node {
            Node::Named(NamedNode::Tip) => nodes - 1,
            Node::Index(i) if i < nodes => i,
            Node::Index(i) => {
                let allowed = format!("\"tip\" or 0 .. {}", nodes - 1);
                return Err(Error::invalid(format!("loads.point[{k}].node"), i, allowed));
            }
        };
        forces.push((node, load.force));
    }
    Ok(forces)
}

fn plane_of(scene: &Scene, nodes: &[[f64; 3]]) -> Result<Plane, Error> {
    let mut vectors = vec![("loads.gravity".to_string(), Vector3::from(scene.loads.gravity))];
    for (i, load) in scene.loads.point.iter().enumerate() {
        vectors.push((format!("loads.point[{i}].force"), load.force.into()));
    }
    let up = scene.rod.section.up().map(Vector3::from);
    Plane::through(nodes, &vectors, up)
        .map_err(|what| spatial(&format!("{what} leaves the plane of the rest")))
}

fn spatial(why: &str) -> Error {
    Error::unavailable(
        "rod.dimension",
        format!("this scene is spatial ({why}); spatial scenes are not available, planar ones are"),
    )
}

/// Which second moment resists bending in the plane: 0 with `up` in the plane, 1 across it.
fn second_moment_in(scene: &Scene, plane: &Plane, nodes: &[[f64; 3]]) -> Result<usize, Error> {
    let Some(up) = scene.rod.section.up() else { return Ok(0) };
    let [i1, i2] = scene.rod.section.second_moments();
    let first_edge = (Vector3::from(nodes[1]) - Vector3::from(nodes[0])).normalize();
    let up = Vector3::from(up);
    let across_edge = up - first_edge * first_edge.dot(&up);
    if across_edge.norm() <= 1e-9 * up.norm() {
        let found = "a direction along the first edge";
        return Err(Error::invalid("rod.section.up", found, "a direction with a part across it"));
    }
    let (in_plane, out) = plane.components(across_edge.normalize());
    match () {
        () if i1 == i2 || out.abs() <= 1e-9 => Ok(0),
        () if in_plane.norm() <= 1e-9 => Ok(1),
        () => Err(spatial("rod.section.up is neither in the plane of the rest nor across it")),
    }
}
