//! Python script for PyElastica: a Cosserat rod with the nodes of the rod, which prints its tip over time as CSV.
//!
//! Input: a [`RodChain`]; conversions are added to the notes of the export. The script sets positions, directors, nodal
//! masses, gravity, stiffness matrices (shear by Timoshenko's coefficient) and curvatures without stress. Without a
//! shear modulus G = E/3, and the stiffness of twist is 2/3 of that of bending about the first director. Rotational
//! inertia of the sections is that of PyElastica: of a solid circle of the radius. A clamped end holds its two outer
//! nodes and the directors of the edge between them, as the rod does; a pinned one holds its node. Mass-proportional
//! damping is the uniform constant of the linear damper. The time step is [`STEP_FRACTION`] of the shortest time of an
//! axial wave over an edge or of the shear oscillation of a section. The script runs for the duration of the scene, or
//! 1 s without one.

use crate::export::links::RodChain;
use crate::numerics::vector::Vector;
use crate::scene::Support;

/// Time step over the shortest of the times of an axial wave over an edge and of the shear oscillation of a section.
const STEP_FRACTION: f64 = 0.3;

/// The text of the script of a chain. Notes on its conversions are added to `notes`, all of which become comments in
/// the script.
pub(super) fn script(chain: &RodChain, notes: &mut Vec<String>) -> String {
    let moduli = &chain.moduli;
    let shear = moduli.shear.unwrap_or(moduli.young / 3.0);
    if moduli.shear.is_none() {
        notes.push(
            "shear modulus E/3: the scene has neither poisson_ratio nor shear_modulus".into(),
        );
    }
    notes.push(
        "this rod shears, with Timoshenko's coefficient; the model of the scene does not".into(),
    );
    let stretch = (moduli.young / moduli.density).sqrt();
    // Of every edge: the time of a wave, and the period of a section that turns against its shear stiffness.
    let times = chain.links.iter().map(|link| {
        let gyration = (link.inertia / (2.0 * link.mass)).sqrt();
        let slip = (moduli.shear_coefficient * shear / moduli.density).sqrt();
        (link.length / stretch).min(2.0 * gyration / slip)
    });
    let step = STEP_FRACTION * times.fold(f64::INFINITY, f64::min);
    notes
        .push(format!("time step {step:.1e} s of an explicit method; larger ones may be unstable"));
    let header: String = notes.iter().map(|note| format!("# {note}\n")).collect();
    let directors =
        |k: usize| vectors(&chain.frames.iter().map(|frame| frame[k]).collect::<Vec<_>>());
    let joints = |pick: &dyn Fn(usize) -> f64| numbers((0..chain.joints.len()).map(pick));
    let rigidity = |k: usize| joints(&|i| chain.joints[i].stiffness[k] * chain.joints[i].length);
    let natural = |k: usize| joints(&|i| chain.joints[i].reference[k] / chain.joints[i].length);
    let edges = |pick: &dyn Fn(usize) -> f64| numbers((0..chain.links.len()).map(pick));
    let mut masses = vec![0.0; chain.nodes.len()];
    for (j, link) in chain.links.iter().enumerate() {
        masses[j] += 0.5 * link.mass;
        masses[j + 1] += 0.5 * link.mass;
    }
    chain.masses.iter().for_each(|at| masses[at.node] += at.mass);
    let torsion = match moduli.shear {
        Some(_) => rigidity(0),
        None => joints(&|i| 2.0 / 3.0 * chain.joints[i].stiffness[1] * chain.joints[i].length),
    };
    let constraints: String = chain
        .supports
        .iter()
        .zip([("(0, 1)", "(0,)", "(0,)"), ("(-2, -1)", "(-1,)", "(-1,)")])
        .filter_map(|(support, (clamped, directors, pinned))| match support {
            Support::Clamped => Some(format!("held({clamped}, {directors})\n")),
            Support::Pinned => Some(format!("held({pinned}, ())\n")),
            _ => None,
        })
        .collect();
    format!(
        r#"{header}import numpy as np
import elastica as ea

END = {end}  # s
frames = 100  # recorded after the first
per_frame = int(np.ceil(END / {step:e} / frames))
STEP = END / (frames * per_frame)  # s
positions = np.array({positions}).T  # m
directors = np.array([{d1}, {d2}, {t}]).transpose(0, 2, 1)
radii = np.array({radii})  # m


class System(ea.BaseSystemCollection, ea.Constraints, ea.Forcing, ea.Damping, ea.CallBacks):
    pass


system = System()
rod = ea.CosseratRod.straight_rod(
    n_elements={count},
    start=positions[:, 0],
    direction=directors[2, :, 0],
    normal=directors[0, :, 0],
    base_length={length},
    base_radius=radii,
    density={density},
    youngs_modulus={young},
    shear_modulus={shear},
    position=positions,
    directors=directors,
)
area = np.array({areas})  # m^2
rod.shear_matrix[:] = 0.0
rod.shear_matrix[0, 0] = rod.shear_matrix[1, 1] = {coefficient} * {shear} * area  # N
rod.shear_matrix[2, 2] = np.array({axial})  # N
rod.bend_matrix[:] = 0.0
rod.bend_matrix[0, 0] = np.array({about_first})  # N m^2, about the first director
rod.bend_matrix[1, 1] = np.array({about_second})  # N m^2, about the second director
rod.bend_matrix[2, 2] = np.array({torsion})  # N m^2
rod.mass[:] = np.array({masses})  # kg
inertia = np.array({inertias})  # kg m^2, about the tangent; half of it about each director
rod.mass_second_moment_of_inertia[:] = 0.0
rod.inv_mass_second_moment_of_inertia[:] = 0.0
for axis, part in enumerate([0.5, 0.5, 1.0]):
    rod.mass_second_moment_of_inertia[axis, axis] = part * inertia
    rod.inv_mass_second_moment_of_inertia[axis, axis] = 1.0 / (part * inertia)
rod.rest_lengths[:] = np.linalg.norm(np.diff(positions), axis=0)
rod.compute_internal_forces_and_torques(0.0)
# The given shape has no stress but for the curvatures that follow, 1/m.
rod.rest_sigma[:] = rod.sigma
rod.rest_kappa[:] = rod.kappa + np.array([{k1}, {k2}, {k3}])
system.append(rod)


def held(nodes, frames):
    system.constrain(rod).using(
        ea.FixedConstraint, constrained_position_idx=nodes, constrained_director_idx=frames
    )


{constraints}system.add_forcing_to(rod).using(ea.GravityForces, acc_gravity=np.array({gravity}))
system.dampen(rod).using(
    ea.AnalyticalLinearDamper, uniform_damping_constant={damping}, time_step=STEP
)
system.finalize()
stepper = ea.PositionVerlet()
print("t,x,y,z")
time = 0.0
for frame in range(frames + 1):
    last = rod.position_collection[:, -2:]
    x, y, z = last[:, 0] + {tip} * (last[:, 1] - last[:, 0])
    print(f"{{time}},{{x}},{{y}},{{z}}")
    for _ in range(per_frame if frame < frames else 0):
        time = stepper.step(system, time, STEP)
"#,
        end = chain.end,
        positions = vectors(&chain.nodes),
        d1 = directors(1),
        d2 = directors(2),
        t = directors(0),
        radii = edges(&|j| chain.links[j].radius),
        count = chain.links.len(),
        length = chain.length,
        density = moduli.density,
        young = moduli.young,
        coefficient = moduli.shear_coefficient,
        areas = edges(&|j| chain.links[j].area),
        axial = edges(&|j| chain.links[j].axial),
        about_first = rigidity(1),
        about_second = rigidity(2),
        masses = numbers(masses.iter().copied()),
        inertias = edges(&|j| chain.links[j].inertia),
        k1 = natural(1),
        k2 = natural(2),
        k3 = natural(0),
        gravity = vector(chain.gravity),
        damping = chain.mass_damping,
        tip = chain.tip_fraction(),
    )
}

/// A list of numbers in Python's syntax.
fn numbers(values: impl Iterator<Item = f64>) -> String {
    let texts: Vec<String> = values.map(|value| format!("{value:e}")).collect();
    format!("[{}]", texts.join(", "))
}

/// A vector as a list in Python's syntax.
fn vector(v: Vector<f64>) -> String {
    numbers(v.into_iter())
}

/// A list of vectors in Python's syntax.
fn vectors(list: &[Vector<f64>]) -> String {
    let texts: Vec<String> = list.iter().map(|v| vector(*v)).collect();
    format!("[{}]", texts.join(", "))
}
