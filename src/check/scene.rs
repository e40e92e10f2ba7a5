//! Check of the derivatives of the elements of a rod in a scene: hand-derived against dual numbers and finite
//! differences. Contacts are left out.
//!
//! Input: a scene with its mesh (a [`Problem`]) and a tolerance. States are the initial state of the scene, up to
//! `OWN_STATES` states of the first `OWN_STEPS` time steps of its motion (none without `[time]`), and `RANDOM_STATES`
//! random states from a fixed seed. Elements are those of stretch, of bending (in space also twist), the moments of a
//! planar rod, and user-defined energies; at most `ELEMENTS` of each kind are compared in each state, and all moments.
//! In space each state of the scene is compared twice: with its own frames and with those of the step before. Output:
//! one `CheckReport`. A planar scene's user-defined energies are also checked for forces out of the plane, in a spatial
//! model. An initial state that cannot be made is an error; a step that fails ends the states of the motion.

use crate::check::own::{self, EnergyAt};
use crate::check::random_states::{random_planar, random_spatial};
use crate::check::scaled::Scaled;
use crate::check::{CheckReport, Tolerance};
use crate::energy::bend_twist::UNKNOWNS;
use crate::energy::frame::{EdgeFrame, Frames};
use crate::energy::place::ElementPlacement;
use crate::energy::{AsEnergy, Element, Stretch};
use crate::error::Error;
use crate::numerics::vector::Vector;
use crate::problem::Model;
use crate::problem::{
    AnyProblem, Discretized, ModelWithSetup, PlanarProblem, Problem, SpatialModel,
};
use crate::rod::State;
use crate::rod::{Placed, PlanarRod, Rod, SpatialRod, UserEnergies};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

/// Largest number of elements of one kind that are compared in every state, evenly spaced along the rod. It limits run
/// time.
const ELEMENTS: usize = 100;
/// Largest number of states of the scene's motion that are compared.
const OWN_STATES: usize = 8;
/// Largest number of time steps over which these states are distributed.
const OWN_STEPS: usize = 400;
/// Number of random states of the rod.
const RANDOM_STATES: usize = 20;

/// Compares the hand-derived gradients and Hessians of the elements of a rod (up to `ELEMENTS` of each kind) with those
/// of dual numbers and with finite differences. Kinds are stretch, bending (in space with twist), moments in a plane,
/// and [user-defined energies](crate::energy::own) under their names; those of a planar scene are also checked for
/// forces out of the plane. States are the initial state of the scene, its motion if it has a `[time]` (up to a step
/// that fails), and seeded random ones. These have turning angles up to 150 degrees and strains up to 30 %; in space
/// also edges rotated by up to 120 degrees since the reference of their frames.
///
/// # Errors
///
/// A scene whose initial state cannot be made, as an equilibrium that is not found.
pub fn check_problem(problem: &Problem, tolerance: Tolerance) -> Result<CheckReport, Error> {
    let mut report = CheckReport::new(tolerance);
    // A fixed seed: the same states in every run.
    let mut random = ChaCha8Rng::seed_from_u64(1);
    match problem.discretized() {
        AnyProblem::Planar(discretized) => {
            let rod = discretized.rod();
            let space = SpatialCounterpart::new(problem);
            let mut compare = |q: &[f64]| {
                compare_planar(&mut report, &rod, q);
                if let Some(space) = &space {
                    space.compare(&mut report, problem, &discretized, q);
                }
            };
            visit_states(problem, &discretized, |state, _| compare(&state.q))?;
            for _ in 0..RANDOM_STATES {
                compare(&random_planar(&rod, &mut random));
            }
        }
        AnyProblem::Spatial(discretized) => {
            let rod = discretized.rod();
            visit_states(problem, &discretized, |state, before| {
                // With the frames at the state, and with those of the step before, which have
                // rotated.
                compare_spatial(&mut report, &rod, &state.q, &state.frames);
                compare_spatial(&mut report, &rod, &state.q, &before.frames);
            })?;
            for _ in 0..RANDOM_STATES {
                let (q, frames) = random_spatial(&rod, &mut random);
                compare_spatial(&mut report, &rod, &q, &frames);
            }
        }
    }
    Ok(report)
}

/// Spatial model of a planar scene: tests whether user-defined energies that claim to keep the plane have forces out of
/// it.
struct SpatialCounterpart {
    model: ModelWithSetup<SpatialModel>,
    rod: SpatialRod<f64>,
}

impl SpatialCounterpart {
    /// The spatial model of a planar scene; `None` without user-defined energies.
    fn new(problem: &Problem) -> Option<Self> {
        if problem.scene().energies.is_empty() {
            return None;
        }
        let model = problem.spatial_model();
        let rod = problem.discretized_as(&model).rod();
        Some(Self { model, rod })
    }

    /// Checks the user-defined energies in space, at up to [`ELEMENTS`] of their places each. Nodes are those of the
    /// unknowns `q` of the planar rod, to which the spatial rod is moved from its rest shape: no force along the normal
    /// of the plane, no moment about the tangents. Violations are added to the report.
    fn compare(
        &self,
        report: &mut CheckReport,
        problem: &Problem,
        plane: &PlanarProblem<'_>,
        q: &[f64],
    ) {
        let space = problem.discretized_as(&self.model);
        let nodes: Vec<Vector<f64>> =
            (0..problem.nodes()).map(|i| plane.model.position(q, i)).collect();
        let (q, frames) = space.placed_still(&nodes);
        let normal = space.model.components(plane.model.normal().into());
        for (placed, placement) in selected_placements(&self.rod.own) {
            let (unknowns, edges) = placed.span(placement);
            let context = placed.context(placement, &frames.edges[edges]);
            let name = name(placed, placement);
            let length = edge_length(&self.rod.stretch, placement.first);
            let energy = &*placed.energy;
            let place =
                EnergyAt { energy, context: &context, name: &name, first: placement.first, length };
            own::check_plane_is_kept(report, place, &q[unknowns], normal);
        }
    }
}

/// Each user-defined energy with at most [`ELEMENTS`] of its places, evenly spaced.
fn selected_placements(
    own: &UserEnergies<f64>,
) -> impl Iterator<Item = (&Placed<f64>, &ElementPlacement<f64>)> {
    let of = |placed: &'_ Placed<f64>| spaced_indices(placed.placements.len());
    own.placed().iter().flat_map(move |p| of(p).map(move |i| (p, &p.placements[i])))
}

/// Name of a place of an energy for the report: the energy's name and the arc length in m.
fn name(placed: &Placed<f64>, placement: &ElementPlacement<f64>) -> String {
    format!("{} at {:.4} m", placed.name, placement.numbers[0])
}

/// Calls `show(state, previous state)` at the start and at up to [`OWN_STATES`] states of the motion, evenly spaced
/// over its first [`OWN_STEPS`] steps. At the start both states are the same. A scene without `[time]` has the start
/// only; a step that fails ends the visit without an error. Error: the initial state cannot be made.
fn visit_states<M: Model>(
    problem: &Problem,
    discretized: &Discretized<'_, M>,
    mut show: impl FnMut(&StateOf<M>, &StateOf<M>),
) -> Result<(), Error> {
    let mut simulation = discretized.simulation()?;
    show(simulation.state(), simulation.previous());
    let Ok(time) = problem.time() else { return Ok(()) };
    let steps = time.steps().min(OWN_STEPS);
    for k in 1..=steps {
        // A step that fails ends the visit: the states so far are enough.
        if simulation.step_to(time.at(k)).is_err() {
            break;
        }
        if k % steps.div_ceil(OWN_STATES) == 0 {
            show(simulation.state(), simulation.previous());
        }
    }
    Ok(())
}

/// State of the rod of a model.
type StateOf<M> = State<f64, <<M as Model>::Rod<f64> as Rod<f64>>::Frames>;

/// Every k-th index below `count` from 0 on, with the smallest k at which there are at most [`ELEMENTS`] of them.
fn spaced_indices(count: usize) -> impl Iterator<Item = usize> {
    (0..count).step_by(count.div_ceil(ELEMENTS).max(1))
}

/// Compares the derivatives of the elements of a planar rod at the unknowns `q` with dual numbers and finite
/// differences, and adds the errors to the report. Kinds are stretch, joints, moments, and user-defined ones. At most
/// [`ELEMENTS`] elements of each kind are compared, and all moments. Coordinates are relative to the first node of each
/// element.
fn compare_planar(report: &mut CheckReport, rod: &PlanarRod<f64>, q: &[f64]) {
    /// Compares the derivatives of elements of one kind with dual numbers and finite differences, and adds the errors
    /// to the report: at most [`ELEMENTS`], evenly spaced. Element `i` has its first node at node `i` of `q`. `first`
    /// and `node` are the numbers of the first element and of its first node in the report.
    fn compare<E: Element<f64, N>, const N: usize>(
        report: &mut CheckReport,
        elements: &[E],
        q: &[f64],
        first: usize,
        node: usize,
    ) {
        for i in spaced_indices(elements.len()) {
            let own: &[f64; N] = q[2 * i..].first_chunk().expect("the element's nodes");
            // Energies do not change under translation; differences need small coordinates.
            let local = std::array::from_fn(|k| own[k] - own[k % 2]);
            let name = format!("{} {}", E::NAME, i + first);
            report.compare(&AsEnergy(elements[i]), &local, &name, |k| {
                format!("{}{}", ["x", "y"][k % 2], node + i + k / 2)
            });
        }
    }
    let stretch: Vec<_> = (0..rod.stretch.len()).map(|i| rod.stretch_element(i)).collect();
    compare(report, &stretch, q, 0, 0);
    compare(report, &rod.joint, q, 1, 0);
    for (i, moment) in &rod.moments.list {
        compare(report, &[*moment], &q[2 * i..], *i, *i);
    }
    compare_own(report, &rod.own, q, &[], |i| edge_length(&rod.stretch, i));
}

/// Compares the derivatives of user-defined energies at up to [`ELEMENTS`] of their places each, and adds them to the
/// report. `q` are the unknowns of the rod, `frames` the references of its edges (none in a plane). `length(i)` is that
/// of the edge at node `i`, m, the unit of lengths.
fn compare_own(
    report: &mut CheckReport,
    own: &UserEnergies<f64>,
    q: &[f64],
    frames: &[EdgeFrame<f64>],
    length: impl Fn(usize) -> f64,
) {
    for (placed, placement) in selected_placements(own) {
        let (unknowns, edges) = placed.span(placement);
        let context = placed.context(placement, &frames[edges]);
        let name = name(placed, placement);
        let (energy, first) = (&*placed.energy, placement.first);
        let place =
            EnergyAt { energy, context: &context, name: &name, first, length: length(first) };
        own::compare(report, place, &q[unknowns]);
    }
}

/// Rest length, m, of the edge behind the node with this index; that of the last edge for the last node.
fn edge_length<const M: usize>(edges: &[Stretch<f64, M>], node: usize) -> f64 {
    edges[node.min(edges.len() - 1)].rest_length
}

/// Compares the derivatives of the elements of a spatial rod at the unknowns `q` with dual numbers and finite
/// differences, and adds the errors to the report. Up to [`ELEMENTS`] of each kind: stretch, bend and twist, and
/// user-defined ones. `frames` are the reference frames. Coordinates are relative to the first node and in units of the
/// edge length, so that finite differences by lengths and angles are comparable.
fn compare_spatial(
    report: &mut CheckReport,
    rod: &SpatialRod<f64>,
    q: &[f64],
    frames: &Frames<f64>,
) {
    let dof = |i: usize, k: usize| format!("{}{}", ["x", "y", "z", "theta"][k % 4], i + k / 4);
    for i in spaced_indices(rod.stretch.len()) {
        let own: &[f64; 7] = q[4 * i..].first_chunk().expect("the edge's nodes");
        // Coordinates relative to the first node, in units of the edge length.
        let local = std::array::from_fn(|k| if k < 3 { 0.0 } else { own[k + 1] - own[k - 3] });
        let units = [rod.stretch[i].rest_length; 6];
        let scaled = Scaled { energy: AsEnergy(rod.stretch_element(i)), units };
        let name = format!("stretch {i}");
        report.compare(&scaled, &scaled.scaled(&local), &name, |k| dof(i, k + k / 3));
    }
    // Joints: three nodes and two twist angles; positions relative to the first node.
    for i in spaced_indices(rod.joint.len()) {
        let own: &[f64; UNKNOWNS] = q[4 * i..].first_chunk().expect("the joint's nodes");
        let local = std::array::from_fn(|k| if k % 4 == 3 { own[k] } else { own[k] - own[k % 4] });
        let length = rod.stretch[i].rest_length;
        let units = std::array::from_fn(|k| if k % 4 == 3 { 1.0 } else { length });
        let scaled = Scaled { energy: AsEnergy(rod.bend_twist(i, frames)), units };
        let name = format!("bend and twist {}", i + 1);
        report.compare(&scaled, &scaled.scaled(&local), &name, |k| dof(i, k));
    }
    compare_own(report, &rod.own, q, &frames.edges, |i| edge_length(&rod.stretch, i));
}
