//! The setup of a problem over any number type of its scene: mesh, rest shape, initial shape, and the rod with its
//! loads and drag.
//!
//! [`Setup`] with dual numbers gives rods with derivatives by the scene's parameters. It distributes point loads over
//! the four nodes around them by cubic weights (two in a clamped edge, one at a node). Point masses (kg) with their
//! weight are divided between the two nodes next to them. It adds line loads, loads without a potential
//! (`follower_loads`), user-defined energies, actuators and contacts; `initial.point` is added by
//! `rod_with_release_forces` only. `rod_at` has the signals of loads and actuators at a time, s. `rod_in_motion` leaves
//! out loads that have signals and a potential, which `timed_loads` returns; `actuators` returns the other parts that
//! follow signals. `rod` is the rod with the signals at `loads.at_time`, `drag` the drag on the nodes (none without a
//! fluid). `loads_at` are the loads of nodes with the values of signals at a time; without a time only those without a
//! signal. `start_shape` are the nodes of the initial shape, m, none without one. `tied` returns the rod without loads,
//! with springs to fixed points. [`between_markers`] returns the positions (m) of all nodes on straight lines between
//! recorded markers at a time. [`nodal`] and [`nodal_masses`] return loads (world axes) and masses of nodes; a point
//! outside the rod is an error with its key.

use crate::energy::adapter::Chart;
use crate::error::Error;
use crate::numerics::scalar::{RodScalar, Scalar};
use crate::numerics::vector::Vector;
use crate::problem::actuation::{ENERGIES_PER_TENDON, Interval, natural_shifts, tendon};
use crate::problem::contact::rod_contacts;
use crate::problem::line_loads::line_loads;
use crate::problem::model::{Model, NodalLoad, NodalMass};
use crate::problem::own::{self, NodeTie};
use crate::rod::{
    Actuator, ActuatorEffect, Actuators, AssembledRod, NaturalShifts, NodalDrag, ReferenceFrames,
    Rod, TimedLoad, TimedLoads, UnknownForce, UserEnergies,
};
use crate::scene::mesh::Mesh;
use crate::scene::{Actuation, LineForce, PointForce, PointMass, Scene, Signal, Tension, Track};

/// Scene over a number type with its mesh, and its rest shape in the axes of a model.
#[derive(Clone, Debug)]
pub(crate) struct Setup<D: RodScalar, M: Model> {
    pub scene: Scene<D>,
    pub mesh: Mesh<D>,
    pub rest: M::Rest<D>,
    /// Nodes of the initial shape, m; none if that is the rest shape.
    pub start: Option<Vec<Vector<D>>>,
}

impl<D: RodScalar, M: Model> Setup<D, M> {
    /// The mesh, rest shape in the axes of the model, and initial shape of a scene. It panics for a scene that was not
    /// validated and checked on its mesh.
    pub fn new(model: &M, scene: Scene<D>) -> Self {
        let mesh = scene.made_mesh();
        let rest = model.at_rest(&scene, &mesh);
        let start = start_shape(&scene, &mesh).expect("a problem's start has been made");
        Self { scene, mesh, rest, start }
    }

    /// The rod of the model, to which point masses with their weight, point and line loads, user-defined energies,
    /// actuators, contacts and loads without a potential are added. Signals have their values at `loads.at_time`.
    /// Obstacles are at their places at t = 0. Forces of `initial.point` are not included.
    pub fn rod(&self, model: &M) -> M::Rod<D> {
        self.rod_under(model, &self.loads(model), [self.scene.loads.at_time, 0.0])
    }

    /// [`rod`](Self::rod) with the values of signals and the places of obstacles at a time, s.
    pub fn rod_at(&self, model: &M, time: f64) -> M::Rod<D> {
        self.rod_under(model, &self.loads_at(model, Some(time)), [time; 2])
    }

    /// [`rod`](Self::rod) without the loads that have signals and a potential, for simulations. Actuators, and loads
    /// without a potential, have the values of their signals at t = 0.
    pub fn rod_in_motion(&self, model: &M) -> M::Rod<D> {
        self.rod_under(model, &self.loads_at(model, None), [0.0; 2])
    }

    /// [`rod`](Self::rod) with `loads` in place of point and line loads that have a potential. Other loads and
    /// actuators are those at the first, obstacles those at the second of two times, s.
    fn rod_under(
        &self,
        model: &M,
        loads: &[NodalLoad<D>],
        [time, contact_time]: [f64; 2],
    ) -> M::Rod<D> {
        let mut rod = model.rod(&self.scene, &self.rest);
        // Point masses have weight too.
        let gravity = model.components(self.scene.loads.gravity);
        for NodalMass { node, mass } in self.masses() {
            rod.add_mass(node, mass, gravity);
        }
        self.add_loads(model, &mut rod, loads);
        // User-defined energies are attached last: they refer to the rest state.
        if !self.scene.energies.is_empty() {
            let chart = model.chart(&self.scene, &self.rest);
            let (q, frames) = (model.unknowns(&self.rest), model.frames(&self.rest));
            let rest = own::RestState { q: &q, frames: frames.edge_frames() };
            rod.set_own(own::attached_energies(&chart, &self.scene, &self.mesh, rest));
        }
        self.actuate(model, &mut rod, time);
        if !self.scene.contacts.is_empty() {
            let chart = model.chart(&self.scene, &self.rest);
            rod.set_contacts(rod_contacts(&chart, &self.scene, &self.mesh, contact_time));
        }
        let followers = self.follower_loads(model, time);
        if !followers.is_empty() {
            rod.set_follower_loads(followers);
        }
        rod
    }

    /// The value of the signal of an actuator at a time, s; 1 without a signal.
    fn actuator_signal(&self, actuator: &Actuation<D>, time: f64) -> D {
        let signal = actuator.signal().and_then(|name| self.signal(name));
        signal.map_or(D::from(1.0), |signal| signal.curve().value(D::from(time)))
    }

    /// Adds the actuators as at a time, s: changes of natural strains, and the energies of tendons after the
    /// user-defined ones of the rod.
    fn actuate(&self, model: &M, rod: &mut M::Rod<D>, time: f64) {
        if self.scene.actuation.is_empty() {
            return;
        }
        let chart = model.chart(&self.scene, &self.rest);
        let mut tendons = Vec::new();
        for (i, actuator) in self.scene.actuation.iter().enumerate() {
            match actuator {
                Actuation::Curvature { .. } => {
                    let factor = self.actuator_signal(actuator, time);
                    if let Some(shifts) = self.natural_shifts(actuator, &chart) {
                        rod.shift_natural_strains(&shifts, factor);
                    }
                }
                Actuation::Tendon { tension, route } => {
                    let tension = match tension {
                        Tension::Constant(tension) => *tension,
                        Tension::Signal(_) => self.actuator_signal(actuator, time),
                    };
                    let name = format!("actuation[{i}]");
                    tendons.extend(tendon(&name, tension, route, &chart, &self.mesh));
                }
            }
        }
        if !tendons.is_empty() {
            rod.add_own(UserEnergies::new(tendons));
        }
    }

    /// The changes of natural strains by a curvature actuator at the value 1 of its signal; `None` of a tendon.
    fn natural_shifts(
        &self,
        actuator: &Actuation<D>,
        chart: &Chart<D>,
    ) -> Option<NaturalShifts<D>> {
        let Actuation::Curvature { component, from, to, gain, .. } = actuator else { return None };
        // Without an end the actuator lasts beyond the last joint.
        let last = self.mesh.arc_length.len() - 1;
        let part = Interval { from: *from, to: to.unwrap_or(self.mesh.arc_length[last]) };
        let across = match chart {
            Chart::Plane { across, .. } => Some(*across),
            Chart::Space { .. } => None,
        };
        Some(natural_shifts(*component, *gain, part, &self.mesh, across))
    }

    /// The actuators (changes of natural strains, tendons), and the groups of loads without a potential, that follow
    /// signals, for a simulation that begins at t = 0. They refer to energies and groups of
    /// [`rod_in_motion`](Self::rod_in_motion).
    pub fn actuators(&self, model: &M) -> Actuators<D> {
        let timed = self.scene.actuation.iter().any(|actuator| actuator.signal().is_some());
        // Factors of loads without a potential follow their signals as actuators do; the first group is constant.
        let followers = self.follower_signals().enumerate().map(|(k, signal)| Actuator {
            signal: signal.curve(),
            effect: ActuatorEffect::FollowerLoads(k + 1),
        });
        if !timed {
            return Actuators::at(followers.collect(), 0.0);
        }
        let chart = model.chart(&self.scene, &self.rest);
        let (mut list, mut next_energy) = (Vec::new(), self.scene.energies.len());
        for actuator in &self.scene.actuation {
            let effect = match self.natural_shifts(actuator, &chart) {
                Some(shifts) => ActuatorEffect::Strains(shifts),
                None => {
                    next_energy += ENERGIES_PER_TENDON;
                    ActuatorEffect::Tensions(
                        (next_energy - ENERGIES_PER_TENDON..next_energy).collect(),
                    )
                }
            };
            if let Some(signal) = actuator.signal().and_then(|name| self.signal(name)) {
                list.push(Actuator { signal: signal.curve(), effect });
            }
        }
        list.extend(followers);
        Actuators::at(list, 0.0)
    }

    /// The rod without weight, loads, actuators, contacts, point masses and user-defined energies. The axial stiffness
    /// of every edge `j` is multiplied by `stiffer(j)`, and nodes are tied to fixed points by springs (`ties`).
    pub fn tied(
        &self,
        model: &M,
        stiffer: impl Fn(usize) -> f64,
        ties: &[NodeTie<D>],
    ) -> M::Rod<D> {
        let mut scene = self.scene.clone();
        scene.loads.gravity = [D::from(0.0); 3];
        let mut rod = model.rod(&scene, &self.rest);
        rod.stiffen_edges(stiffer);
        let chart = model.chart(&scene, &self.rest);
        rod.set_own(own::ties(&chart, ties));
        rod
    }

    /// Drag coefficients of the fluid, its velocity in the axes of the model, and the tributary length of every node.
    /// None without `loads.drag`.
    pub fn drag(&self, model: &M) -> Option<NodalDrag<D>> {
        let drag = self.scene.loads.drag.as_ref()?;
        let axes = M::STRIDE.min(3);
        Some(NodalDrag {
            normal: [drag.linear_normal, drag.quadratic_normal],
            tangential: [drag.linear_tangential, drag.quadratic_tangential],
            fluid: model.components(drag.fluid_velocity),
            lengths: M::tributary(&self.rest).node.clone(),
            unknowns: [M::STRIDE, axes],
        })
    }

    /// Point masses of the scene, kg, each divided between the two nodes next to it by the lever rule.
    pub fn masses(&self) -> Vec<NodalMass<D>> {
        nodal_masses(&self.scene, &self.mesh).expect("checked when the model was chosen")
    }

    /// Forces and moments on nodes, in world axes: those of `loads.point`, then those of `loads.line`, with the values
    /// of signals at `loads.at_time`. A node may have several entries. Follower forces, and follower moments in space,
    /// are left out.
    pub fn loads(&self, model: &M) -> Vec<NodalLoad<D>> {
        self.loads_at(model, Some(self.scene.loads.at_time))
    }

    /// [`loads`](Self::loads) with the values of signals at a time, s; without it only those that have no signal.
    pub fn loads_at(&self, model: &M, time: Option<f64>) -> Vec<NodalLoad<D>> {
        let loads = &self.scene.loads;
        let factor = |signal: &Option<String>| match (signal, time) {
            (None, _) => Some(D::from(1.0)),
            (Some(name), Some(time)) => Some(self.signal(name)?.curve().value(D::from(time))),
            (Some(_), None) => None,
        };
        let scaled = |vector: Vector<D>, factor: D| vector.map(|c| c * factor);
        let point = loads.point.iter().filter_map(|load| {
            let factor = factor(&load.signal)?;
            let load = self.dead_part(model, load);
            let [force, moment] = [load.force, load.moment].map(|vector| scaled(vector, factor));
            Some(PointForce { force, moment, ..load })
        });
        let line = loads.line.iter().filter(|load| !load.follower).filter_map(|load| {
            let force = scaled(load.force, factor(&load.signal)?);
            Some(LineForce { force, ..load.clone() })
        });
        let mut nodal = self.nodal(&point.collect::<Vec<_>>());
        nodal.extend(line_loads(&line.collect::<Vec<_>>(), &self.mesh));
        nodal
    }

    /// The signal of a name; none that the scene does not have.
    fn signal(&self, name: &str) -> Option<&Signal<D>> {
        self.scene.signals.iter().find(|signal| signal.name == name)
    }

    /// The forces on the unknowns of the model, and in a plane the moments on edges, at the value 1 of their signals:
    /// one entry for each signal that a load has. Follower forces, and moments in space, are left out.
    pub fn timed_loads(&self, model: &M) -> TimedLoads<D> {
        let loads = &self.scene.loads;
        let mut timed = TimedLoads::none();
        for signal in &self.scene.signals {
            let has_signal = |name: &Option<String>| name.as_deref() == Some(&*signal.name);
            let point = loads.point.iter().filter(|load| has_signal(&load.signal));
            let point = point.map(|load| self.dead_part(model, load));
            let dead = loads.line.iter().filter(|load| !load.follower);
            let line = dead.filter(|load| has_signal(&load.signal)).cloned();
            let mut nodal = self.nodal(&point.collect::<Vec<_>>());
            nodal.extend(line_loads(&line.collect::<Vec<_>>(), &self.mesh));
            if nodal.is_empty() {
                continue;
            }
            let moments = model.edge_moments(self.mesh.nodes.len() - 1, &nodal);
            let axes = M::STRIDE.min(3);
            let mut forces = Vec::with_capacity(axes * nodal.len());
            for load in nodal {
                let first = M::STRIDE * load.node;
                let own = model.components(load.force).into_iter().take(axes).enumerate();
                forces.extend(own.map(|(c, force)| UnknownForce { unknown: first + c, force }));
            }
            timed.loads.push(TimedLoad { signal: signal.curve(), forces, moments });
        }
        timed
    }

    /// A copy of `rod` with the forces and moments of `initial.point` added, which act until t = 0.
    pub fn rod_with_release_forces(&self, model: &M, rod: &M::Rod<D>) -> M::Rod<D> {
        let mut rod = rod.clone();
        self.add_loads(model, &mut rod, &self.nodal(&self.scene.initial.point));
        rod
    }

    /// Adds forces, and in a plane moments, on nodes to a rod; `loads` are in world axes.
    fn add_loads(&self, model: &M, rod: &mut M::Rod<D>, loads: &[NodalLoad<D>]) {
        for load in loads {
            rod.add_force(load.node, model.components(load.force));
        }
        model.add_moments(rod, &self.rest, loads);
    }

    /// Forces and moments of a list on the nodes of the mesh, in world axes. Each is divided over the four nodes around
    /// its point with cubic weights. In the edge of a clamp it is divided over two with linear ones; a node takes it
    /// alone. It panics for a point outside the rod, which was rejected before.
    pub(super) fn nodal(&self, points: &[PointForce<D>]) -> Vec<NodalLoad<D>> {
        nodal(points, "loads", &self.mesh).expect("checked when the model was chosen")
    }
}

/// Nodes of the initial shape, m, in the world. With `supports.path` they are on straight lines between the markers at
/// t = 0, else those of `initial.shape`; none without both. An error if the shape does not fit the mesh `rest`, or the
/// recording is not read.
pub(crate) fn start_shape<D: Scalar>(
    scene: &Scene<D>,
    rest: &Mesh<D>,
) -> Result<Option<Vec<Vector<D>>>, Error> {
    if let Some(path) = &scene.supports.path {
        return Ok(Some(between_markers(path.track()?, 0.0, rest.nodes.len() - 1)));
    }
    scene.initial.shape.as_ref().map(|shape| shape.nodes_of(rest)).transpose()
}

/// Positions, m, of all nodes of a rod with `segments` edges at a time, s. Markers divide the rod into equally many
/// edges; nodes between two markers are on the straight line, equally spaced. `segments` must be a multiple of the
/// number of parts.
pub(crate) fn between_markers<D: Scalar>(
    track: &Track,
    time: f64,
    segments: usize,
) -> Vec<Vector<D>> {
    let markers = track.markers();
    // Markers divide the rod into equally many edges.
    let edges = segments / (markers.len() - 1);
    let place = |i: usize| {
        let (marker, part) = (i / edges, (i % edges) as f64 / edges as f64);
        let x = markers[marker].at(time);
        // At the last node there is no next marker.
        match part == 0.0 {
            true => x.map(D::from),
            false => {
                let next = markers[marker + 1].at(time);
                std::array::from_fn(|c| D::from(x[c] + part * (next[c] - x[c])))
            }
        }
    };
    (0..=segments).map(place).collect()
}

/// Point loads distributed over the nodes of a mesh, in world axes. Each node of the stencil of a load gets its weight
/// times force and moment. The weights are cubic over the four nodes around the point, linear over two in the edge of a
/// clamp, and 1 at a node. `table` is the key of their list, for the error of a load outside the rod.
pub(crate) fn nodal<D: Scalar>(
    loads: &[PointForce<D>],
    table: &str,
    mesh: &Mesh<D>,
) -> Result<Vec<NodalLoad<D>>, Error> {
    let mut nodal = Vec::with_capacity(loads.len());
    for (k, load) in loads.iter().enumerate() {
        // Cubic weights keep the force and its moment about any point.
        let stencil = load.node.stencil(mesh).map_err(|e| off_the_rod(e, table, "point", k))?;
        nodal.extend(stencil.nodes.into_iter().map(|(node, weight)| {
            let share = |vector: Vector<D>| vector.map(|c| c * weight);
            NodalLoad { node, force: share(load.force), moment: share(load.moment) }
        }));
    }
    Ok(nodal)
}

/// Point masses of a scene, kg, each divided between the two nodes next to it by the lever rule. A mass at a node has
/// one entry. An error for a mass outside the rod.
pub(crate) fn nodal_masses<D: Scalar>(
    scene: &Scene<D>,
    mesh: &Mesh<D>,
) -> Result<Vec<NodalMass<D>>, Error> {
    let mut nodal = Vec::with_capacity(scene.rod.mass.len());
    for (k, PointMass { node, mass }) in scene.rod.mass.iter().enumerate() {
        // Linear weights: cubic ones are partly negative, which masses must not be.
        let shares = node.shares(mesh).map_err(|error| off_the_rod(error, "rod", "mass", k))?;
        let share = |(node, part)| NodalMass { node, mass: *mass * part };
        nodal.extend(shares.nodes.into_iter().map(share));
    }
    Ok(nodal)
}

/// For a point outside the rod, the error with the key of entry `k` of `table.list` and the allowed range. Other errors
/// are unchanged.
fn off_the_rod(error: Error, table: &str, list: &str, k: usize) -> Error {
    match error {
        Error::OutOfRange { what, found, low, high } => {
            let key = if what == "node" { "node" } else { "node.arc_length" };
            let allowed = format!("{low} .. {high}, or \"tip\"");
            Error::invalid(format!("{table}.{list}[{k}].{key}"), found, allowed)
        }
        error => error,
    }
}
