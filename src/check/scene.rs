//! The check of a whole scene: every element, at the scene's own states and at random ones.

use crate::check::scaled::Scaled;
use crate::check::{CheckReport, Tolerance, own};
use crate::energy::bend_twist::UNKNOWNS;
use crate::energy::frame::{EdgeFrame, Frames};
use crate::energy::place::Spot;
use crate::energy::{AsEnergy, Element, Stretch};
use crate::error::Error;
use crate::numerics::vector::{Vector, add, cross, dot, scale, unit};
use crate::problem::Model;
use crate::problem::{AnyProblem, Discretized, Modelled, PlanarProblem, Problem, SpatialModel};
use crate::rod::State;
use crate::rod::{Extra, Placed, PlanarRod, Rod, SpatialRod};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Elements looked at in every state, spread over the rod.
const ELEMENTS: usize = 100;
/// States taken from the scene's own motion.
const OWN_STATES: usize = 8;
/// Steps simulated to reach them.
const OWN_STEPS: usize = 400;
/// Random states of every element.
const RANDOM_STATES: usize = 20;
/// Largest turning angle of random states, degrees: up to here finite differences reach 1e-7.
const LARGEST_TURN: f64 = 150.0;
/// Largest rotation of an edge since its reference in random states, degrees.
const LARGEST_ROTATION: f64 = 120.0;

/// Checks the derivatives of every kind of element of a scene: in its rest shape, along its
/// motion when it has a `[time]` (without one, or when a step fails, as far as it goes), and in
/// seeded random states with turning angles up to 150 degrees and strains up to 30 %; in space also
/// with the edges rotated by up to 120 degrees since the reference of their frames.
/// [Energies of one's own](crate::energy::own) are elements like all others, under their names.
///
/// # Errors
///
/// A scene whose derivatives cannot be evaluated in its rest shape.
pub fn check_problem(problem: &Problem, tolerance: Tolerance) -> Result<CheckReport, Error> {
    let mut report = CheckReport::new(tolerance);
    let mut random = ChaCha8Rng::seed_from_u64(1);
    match problem.discretized() {
        AnyProblem::Planar(discretized) => {
            let rod = discretized.rod();
            let space = Space::of(problem);
            let mut compare = |q: &[f64]| {
                compare_planar(&mut report, &rod, q);
                if let Some(space) = &space {
                    space.compare(&mut report, problem, &discretized, q);
                }
            };
            own_states(problem, &discretized, |state, _| compare(&state.q))?;
            for _ in 0..RANDOM_STATES {
                compare(&random_planar(&rod, &mut random));
            }
        }
        AnyProblem::Spatial(discretized) => {
            let rod = discretized.rod();
            own_states(problem, &discretized, |state, before| {
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

/// What a planar scene is in space, where its energies of one's own may leave its plane, though they
/// say that they keep it.
struct Space {
    model: Modelled<SpatialModel>,
    rod: SpatialRod<f64>,
}

impl Space {
    /// None where there is nothing to look at. A scene with moments has no model in space.
    fn of(problem: &Problem) -> Option<Self> {
        if problem.scene().energies.is_empty() {
            return None;
        }
        let model = problem.spatial_model().ok()?;
        let rod = problem.discretized_as(&model).rod();
        Some(Self { model, rod })
    }

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
        for (placed, spot) in spots(&self.rod.own) {
            let (unknowns, edges) = placed.span(spot);
            let site = placed.site(spot, &frames.edges[edges]);
            let name = name(placed, spot);
            let named = (&*name, of_edge(&self.rod.stretch, spot.first));
            own::compare_across(report, (&*placed.energy, &site), &q[unknowns], named, normal);
        }
    }
}

/// Some of the places of energies of one's own.
fn spots(own: &Extra<f64>) -> impl Iterator<Item = (&Placed<f64>, &Spot<f64>)> {
    let of = |placed: &'_ Placed<f64>| some(placed.spots.len());
    own.placed().iter().flat_map(move |p| of(p).map(move |i| (p, &p.spots[i])))
}

fn name(placed: &Placed<f64>, spot: &Spot<f64>) -> String {
    format!("{} at {:.4} m", placed.name, spot.numbers[0])
}

/// Shows the state at rest and some along the motion, each with the one a step before.
fn own_states<M: Model>(
    problem: &Problem,
    discretized: &Discretized<'_, M>,
    mut show: impl FnMut(&Frozen<M>, &Frozen<M>),
) -> Result<(), Error> {
    let mut simulation = discretized.simulation()?;
    show(simulation.state(), simulation.previous());
    let Ok(time) = problem.time() else { return Ok(()) };
    let steps = time.steps().min(OWN_STEPS);
    for k in 1..=steps {
        if simulation.step_to(time.at(k)).is_err() {
            break;
        }
        if k % steps.div_ceil(OWN_STATES) == 0 {
            show(simulation.state(), simulation.previous());
        }
    }
    Ok(())
}

/// A state of a model's rod.
type Frozen<M> = State<f64, <<M as Model>::Rod<f64> as Rod<f64>>::Frames>;

/// A rod of the same rest lengths with random turns and strains.
fn random_planar(rod: &PlanarRod<f64>, random: &mut ChaCha8Rng) -> Vec<f64> {
    let mut angle: f64 = random.random_range(-3.1..3.1);
    let mut q = vec![0.0, 0.0];
    for edge in &rod.stretch {
        let length = edge.rest_length * random.random_range(0.7..1.3);
        let [x, y] = [q[q.len() - 2], q[q.len() - 1]];
        q.extend([x + length * angle.cos(), y + length * angle.sin()]);
        angle += random.random_range(-LARGEST_TURN..LARGEST_TURN).to_radians();
    }
    q
}

fn random_unit(random: &mut ChaCha8Rng) -> Vector<f64> {
    loop {
        let v = [0; 3].map(|_| random.random_range(-1.0..1.0));
        if (0.01..1.0).contains(&dot(v, v)) {
            return unit(v);
        }
    }
}

/// `t` turned by `angle` about a random axis across it.
fn turned(t: Vector<f64>, angle: f64, random: &mut ChaCha8Rng) -> Vector<f64> {
    let across = loop {
        let across = cross(t, random_unit(random));
        if dot(across, across) > 0.01 {
            break unit(across);
        }
    };
    unit(add(scale(t, angle.cos()), scale(across, angle.sin())))
}

/// A rod of the same rest lengths with random turns, strains, angles and references.
fn random_spatial(rod: &SpatialRod<f64>, random: &mut ChaCha8Rng) -> (Vec<f64>, Frames<f64>) {
    let mut t = random_unit(random);
    let mut x = [0.0; 3];
    let mut q = x.to_vec();
    let mut references = Vec::new();
    for edge in &rod.stretch {
        let length = edge.rest_length * random.random_range(0.7..1.3);
        x = add(x, scale(t, length));
        q.push(random.random_range(-6.0..6.0));
        q.extend(x);
        let rotation = random.random_range(0.0..LARGEST_ROTATION).to_radians();
        references.push(turned(t, rotation, random));
        let turn = random.random_range(0.0..LARGEST_TURN).to_radians();
        t = turned(t, turn, random);
    }
    let director = unit(cross(references[0], random_unit(random)));
    let mut frames = Frames::bishop(&references, director);
    for twist in &mut frames.twist {
        *twist = random.random_range(-6.0..6.0);
    }
    (q, frames)
}

/// Every so manieth of `count` elements.
fn some(count: usize) -> impl Iterator<Item = usize> {
    (0..count).step_by(count.div_ceil(ELEMENTS).max(1))
}

fn compare_planar(report: &mut CheckReport, rod: &PlanarRod<f64>, q: &[f64]) {
    fn compare<E: Element<f64, N>, const N: usize>(
        report: &mut CheckReport,
        elements: &[E],
        q: &[f64],
        [first, node]: [usize; 2],
    ) {
        for i in some(elements.len()) {
            let own: &[f64; N] = q[2 * i..].first_chunk().expect("the element's nodes");
            // Energies do not change under translation; differences need small coordinates.
            let local = std::array::from_fn(|k| own[k] - own[k % 2]);
            let name = format!("{} {}", E::NAME, i + first);
            report.compare(&AsEnergy(elements[i]), &local, &name, |k| {
                format!("{}{}", ["x", "y"][k % 2], node + i + k / 2)
            });
        }
    }
    compare(report, &rod.stretch, q, [0, 0]);
    compare(report, &rod.joint, q, [1, 0]);
    for (i, moment) in &rod.moments.list {
        compare(report, &[*moment], &q[2 * i..], [*i, *i]);
    }
    compare_own(report, &rod.own, (q, &[]), |i| of_edge(&rod.stretch, i));
}

/// The energies of one's own at some of their places, near which edges are `length` long, m.
fn compare_own(
    report: &mut CheckReport,
    own: &Extra<f64>,
    (q, frames): (&[f64], &[EdgeFrame<f64>]),
    length: impl Fn(usize) -> f64,
) {
    for (placed, spot) in spots(own) {
        let (unknowns, edges) = placed.span(spot);
        let site = placed.site(spot, &frames[edges]);
        let name = name(placed, spot);
        own::compare(
            report,
            (&*placed.energy, &site),
            &q[unknowns],
            (&name, spot.first),
            length(spot.first),
        );
    }
}

/// The rest length of the edge behind a node, or of the last, m.
fn of_edge<const M: usize>(edges: &[Stretch<f64, M>], node: usize) -> f64 {
    edges[node.min(edges.len() - 1)].rest_length
}

/// In units of the edge's length, so that differences treat lengths and angles alike.
fn compare_spatial(
    report: &mut CheckReport,
    rod: &SpatialRod<f64>,
    q: &[f64],
    frames: &Frames<f64>,
) {
    let dof = |i: usize, k: usize| format!("{}{}", ["x", "y", "z", "theta"][k % 4], i + k / 4);
    for i in some(rod.stretch.len()) {
        let own: &[f64; 7] = q[4 * i..].first_chunk().expect("the edge's nodes");
        let local = std::array::from_fn(|k| if k < 3 { 0.0 } else { own[k + 1] - own[k - 3] });
        let units = [rod.stretch[i].rest_length; 6];
        let scaled = Scaled { energy: AsEnergy(rod.stretch[i]), units };
        let name = format!("stretch {i}");
        report.compare(&scaled, &scaled.scaled(&local), &name, |k| dof(i, k + k / 3));
    }
    for i in some(rod.joint.len()) {
        let own: &[f64; UNKNOWNS] = q[4 * i..].first_chunk().expect("the joint's nodes");
        let local = std::array::from_fn(|k| if k % 4 == 3 { own[k] } else { own[k] - own[k % 4] });
        let length = rod.stretch[i].rest_length;
        let units = std::array::from_fn(|k| if k % 4 == 3 { 1.0 } else { length });
        let scaled = Scaled { energy: AsEnergy(rod.bend_twist(i, frames)), units };
        let name = format!("bend and twist {}", i + 1);
        report.compare(&scaled, &scaled.scaled(&local), &name, |k| dof(i, k));
    }
    compare_own(report, &rod.own, (q, &frames.edges), |i| of_edge(&rod.stretch, i));
}

#[cfg(test)]
mod tests;
