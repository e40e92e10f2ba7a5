//! Scenes with known answers, for `rodfit bench --published`: the list [`CASES`].
//!
//! Each case has a scene file of `data/published`, a quantity that is measured in a simulation, its exact value, and
//! the meshes, steps and schemes that are compared. Exact values are [closed
//! forms](crate::command::bench::closed_forms); that of the bend of 45 degrees is a number of an independent
//! integration. Numbers of the scenes that they require stand here once more: a test compares simulations on several
//! meshes with them. Lengths are 1 m, except in the bend and the capstan.

use crate::command::bench::closed_forms::{
    cantilever_root, catenary_sag, elastica_deflection, pendulum_period, released_cantilever,
    torsion_frequency,
};
use rodfit::scene::Scheme;
use rodfit::vibration::{LinearizationPoint, ModeKind};
use rodfit::{Equilibrium, Error, Problem, Trajectory};
use std::f64::consts::{FRAC_PI_2, PI};
use std::time::{Duration, Instant};

/// The measured quantity of a simulation, and its cost.
pub struct CaseMeasurement {
    /// The quantity of the case; none if the motion does not have it.
    pub value: Option<f64>,
    /// Wall time of the computation, without the reading of the scene.
    pub time: Duration,
    /// Newton iterations; none for frequencies.
    pub newton_iterations: Option<usize>,
}

/// A scene, a quantity and its exact value.
pub struct PublishedCase {
    /// Name of the scene file without its extension.
    pub scene: &'static str,
    /// Text of the scene file.
    pub toml: &'static str,
    /// The quantity that is measured.
    pub quantity: &'static str,
    /// The quantity of which errors are fractions.
    pub error_unit: &'static str,
    /// The exact value as a formula.
    pub formula: &'static str,
    /// Where the formula or the value is published.
    pub source: &'static str,
    /// The exact value.
    pub exact: fn() -> f64,
    /// The divisor of errors, from the exact value.
    pub scale: fn(f64) -> f64,
    /// Computes the quantity of a problem.
    pub measure: fn(&Problem) -> Result<CaseMeasurement, Error>,
    /// Numbers of edges.
    pub meshes: &'static [usize],
    /// Numbers of time steps on the meshes, in their order; empty without a motion.
    pub steps: &'static [usize],
    /// Schemes of a motion; empty without one.
    pub schemes: &'static [Scheme],
}

/// Meshes of equilibria and frequencies.
const MESHES: &[usize] = &[10, 20, 40, 80];

/// Defaults of cases without a motion.
const STILL: PublishedCase = PublishedCase {
    scene: "",
    toml: "",
    quantity: "",
    error_unit: "",
    formula: "",
    source: "",
    exact: || f64::NAN,
    scale: |_| f64::NAN,
    measure: |_| Ok(CaseMeasurement { value: None, time: Duration::ZERO, newton_iterations: None }),
    meshes: MESHES,
    steps: &[],
    schemes: &[],
};

/// Acceleration of gravity of the pendulum, m/s^2.
const PENDULUM_GRAVITY: f64 = 9.81;

/// All cases, in the order of the table.
pub const CASES: [PublishedCase; 10] = [
    PublishedCase {
        scene: "elastica",
        toml: include_str!("../../../data/published/elastica.toml"),
        quantity: "deflection of the tip at P L^2/EI = 3",
        error_unit: "length",
        formula: "1 - 2 (E(k) - E(theta, k))/a, K(k) - F(theta, k) = a = sqrt(P L^2/EI), sin(theta) = 1/(k sqrt(2))",
        source: "Bisshopp, Drucker, Quarterly of Applied Mathematics 3 (1945) 272",
        exact: || elastica_deflection(3.0),
        scale: |_| 1.0,
        measure: |problem| equilibrium(problem, |found| -found.tip[1]),
        ..STILL
    },
    PublishedCase {
        scene: "bend",
        toml: include_str!("../../../data/published/bend.toml"),
        quantity: "height of the tip of a bend of 45 degrees at P = 600",
        error_unit: "length",
        formula: "53.471763, Kirchhoff's rod with the elongation n/EA, by shooting (DOP853, tolerance 1e-12)",
        source: "scene of Bathe, Bolourchi, Int. J. Numer. Methods Eng. 14 (1979) 961",
        exact: || 53.471763,
        scale: |_| 25.0 * PI,
        measure: |problem| equilibrium(problem, |found| found.tip[2]),
        ..STILL
    },
    PublishedCase {
        scene: "catenary",
        toml: include_str!("../../../data/published/catenary.toml"),
        quantity: "sag of a limp rod between hinges at sin(1) of its length",
        error_unit: "length",
        formula: "(cosh(x) - 1)/(2 sinh(x)), sinh(x)/x = length/distance",
        source: "Routh, A Treatise on Analytical Statics, vol. 1 (1896)",
        exact: || catenary_sag(1.0_f64.sin()),
        scale: |_| 1.0,
        measure: |problem| equilibrium(problem, |found| sag_below_chord(&found.nodes)),
        ..STILL
    },
    PublishedCase {
        scene: "vibration",
        toml: include_str!("../../../data/published/vibration.toml"),
        quantity: "frequency of the first bending mode of a cantilever",
        error_unit: "frequency",
        formula: "x^2 sqrt(EI/(rho A L^4)), cos(x) cosh(x) = -1, x = 1.8751",
        source: "Rayleigh, The Theory of Sound, vol. 1 (1894), chapter 8",
        exact: || cantilever_root(1).powi(2),
        scale: |exact| exact,
        measure: |problem| frequency(problem, ModeKind::Bending, 1),
        ..STILL
    },
    PublishedCase {
        scene: "vibration",
        toml: include_str!("../../../data/published/vibration.toml"),
        quantity: "frequency of the third bending mode of a cantilever",
        error_unit: "frequency",
        formula: "x^2 sqrt(EI/(rho A L^4)), cos(x) cosh(x) = -1, x = 7.8548",
        source: "Rayleigh, The Theory of Sound, vol. 1 (1894), chapter 8",
        exact: || cantilever_root(3).powi(2),
        scale: |exact| exact,
        measure: |problem| frequency(problem, ModeKind::Bending, 3),
        ..STILL
    },
    PublishedCase {
        scene: "torsion",
        toml: include_str!("../../../data/published/torsion.toml"),
        quantity: "frequency of the first torsional mode, held at one end",
        error_unit: "frequency",
        formula: "pi/2 sqrt(G/(rho L^2))",
        source: "Rayleigh, The Theory of Sound, vol. 1 (1894), chapter 7",
        exact: || torsion_frequency(1),
        scale: |exact| exact,
        measure: |problem| frequency(problem, ModeKind::Torsion, 1),
        ..STILL
    },
    PublishedCase {
        scene: "torsion",
        toml: include_str!("../../../data/published/torsion.toml"),
        quantity: "frequency of the second torsional mode, held at one end",
        error_unit: "frequency",
        formula: "3 pi/2 sqrt(G/(rho L^2))",
        source: "Rayleigh, The Theory of Sound, vol. 1 (1894), chapter 7",
        exact: || torsion_frequency(2),
        scale: |exact| exact,
        measure: |problem| frequency(problem, ModeKind::Torsion, 2),
        ..STILL
    },
    PublishedCase {
        scene: "vibration",
        toml: include_str!("../../../data/published/vibration.toml"),
        quantity: "largest difference of the released tip from its motion, in two periods",
        error_unit: "static deflection",
        formula: "sum 32 (-1)^(n+1) s/x^5 (1 - cos(x^2 t)), s = (cosh(x) + cos(x))/(sinh(x) + sin(x)), roots x as above",
        source: "Timoshenko, Vibration Problems in Engineering (1937)",
        exact: || 0.0,
        scale: |_| 1.0,
        measure: released_tip,
        meshes: &[10, 20, 50, 100],
        steps: &[200, 400, 1000, 2000],
        schemes: &[Scheme::NewmarkBeta, Scheme::Rodas4],
    },
    PublishedCase {
        scene: "pendulum",
        toml: include_str!("../../../data/published/pendulum.toml"),
        quantity: "period of a rod that swings by 90 degrees",
        error_unit: "period",
        formula: "4 sqrt(2 L/(3 g)) K(sin(amplitude/2))",
        source: "Landau, Lifshitz, Mechanics (1960), section 11",
        exact: || pendulum_period(FRAC_PI_2) / PENDULUM_GRAVITY.sqrt(),
        scale: |exact| exact,
        measure: period,
        meshes: &[10, 20, 50, 100],
        steps: &[250, 500, 1250, 2500],
        // The periods of rodas4 and average-vector-field are wrong, as they do not resolve stretching that is so stiff.
        schemes: &[Scheme::NewmarkBeta, Scheme::GeneralisedAlpha],
    },
    PublishedCase {
        scene: "capstan",
        toml: include_str!("../../../data/published/capstan.toml"),
        quantity: "ratio of the tensions of a limp rod that slides over a drum, friction 0.3",
        error_unit: "ratio",
        formula: "exp(friction angle)",
        source: "Euler, Mem. de l'Acad. de Berlin 18 (1762) 265",
        exact: || (CAPSTAN_FRICTION * capstan_angle()).exp(),
        scale: |exact| exact,
        measure: tension_ratio,
        meshes: &[20, 40, 80],
        steps: &[500, 500, 500],
        schemes: &[Scheme::GeneralisedAlpha],
    },
];

/// Coefficient of friction of the scene `capstan`.
const CAPSTAN_FRICTION: f64 = 0.3;

/// Angle of contact of the rod with the drum of the scene `capstan` at its end, rad: from the point at which the
/// tangent through the start touches to the top, where the end is pulled along the tangent.
fn capstan_angle() -> f64 {
    // Height of the center over the start, displacement of the start, and distance of the axis of the rod from the
    // center, m.
    let (height, displacement, radius) = (0.1015_f64, 0.001_f64, 0.101);
    let distance = height.hypot(displacement);
    PI - (radius / distance).acos() + (displacement / height).atan()
}

/// The tension at the start over that at the end, 1 N, from the reaction of the start at the end of a motion. Errors
/// are those of the simulation.
fn tension_ratio(problem: &Problem) -> Result<CaseMeasurement, Error> {
    let mut run = Trajectory::new(problem, &[], &[])?.keep_reactions();
    run.run(problem, problem.time()?.steps(), |_| {})?;
    let value = run.reactions().last().map(|all| all.start.force[0].hypot(all.start.force[1]));
    Ok(of_motion(&run, value))
}

/// The equilibrium, with a quantity of it. Errors are those of the search.
fn equilibrium(
    problem: &Problem,
    quantity: fn(&Equilibrium) -> f64,
) -> Result<CaseMeasurement, Error> {
    let start = Instant::now();
    let found = problem.equilibrium()?;
    let time = start.elapsed();
    let newton_iterations = Some(found.newton_iterations);
    Ok(CaseMeasurement { value: Some(quantity(&found)), time, newton_iterations })
}

/// Distance of the middle node from the line between the first and the last one, in the xy plane, m; 0 without nodes.
fn sag_below_chord(nodes: &[[f64; 3]]) -> f64 {
    let ([first, ..], [.., last]) = (nodes, nodes) else { return 0.0 };
    let middle = nodes[nodes.len() / 2];
    let along = |a: &[f64; 3]| [a[0] - first[0], a[1] - first[1]];
    let ([x, y], [u, v]) = (along(&middle), along(last));
    (x * v - y * u) / u.hypot(v)
}

/// Angular frequency, rad/s, of the mode with this `number`, from 1 on, among those of a kind about the rest shape.
/// Errors are those of the modes.
fn frequency(problem: &Problem, kind: ModeKind, number: usize) -> Result<CaseMeasurement, Error> {
    /// Number of modes that are computed, among which are those of the kind.
    const COUNT: usize = 4;
    let start = Instant::now();
    let found = problem.modes(COUNT, LinearizationPoint::Rest)?;
    let time = start.elapsed();
    let mode = found.modes.iter().filter(|mode| mode.kind == kind).nth(number - 1);
    let value = mode.map(|mode| mode.frequency_rad_s);
    Ok(CaseMeasurement { value, time, newton_iterations: None })
}

/// A measurement of a motion, with the cost of its steps.
fn of_motion(run: &Trajectory, value: Option<f64>) -> CaseMeasurement {
    let newton_iterations = Some(run.work().newton_iterations);
    CaseMeasurement { value, time: run.stepping(), newton_iterations }
}

/// The largest difference of the tip of the released cantilever from its [series](released_cantilever) at all steps,
/// over the static deflection. Errors are those of the simulation.
fn released_tip(problem: &Problem) -> Result<CaseMeasurement, Error> {
    /// Weight of the scene, N/m, of which 1/8 is the static deflection, m.
    const WEIGHT: f64 = 1e-3;
    let run = problem.simulate()?;
    let exact = released_cantilever();
    let difference =
        |(k, time): (usize, &f64)| (-8.0 * run.tip(k)[1] / WEIGHT - exact(*time)).abs();
    let largest = run.times().iter().enumerate().map(difference).fold(0.0, f64::max);
    Ok(of_motion(&run, Some(largest)))
}

/// The period of a pendulum that starts on the positive side of the vertical: time between two passages of the tip
/// towards the negative side, by cubic interpolation within a step, s. None if it passes less often. Errors are those
/// of the simulation.
fn period(problem: &Problem) -> Result<CaseMeasurement, Error> {
    let run = problem.simulate()?;
    let times = run.times();
    let passes = |k: &usize| run.tip(k - 1)[0] > 0.0 && run.tip(*k)[0] <= 0.0;
    let mut passages = Vec::new();
    for k in (1..times.len()).filter(passes) {
        let (mut before, mut after) = (times[k - 1], times[k]);
        // Bisection to rounding.
        for _ in 0..50 {
            let middle = 0.5 * (before + after);
            let (position, _) = run.at(rodfit::Point::Tip, middle)?;
            if position[0] > 0.0 { before = middle } else { after = middle }
        }
        passages.push(0.5 * (before + after));
    }
    let value = match passages[..] {
        [first, second, ..] => Some(second - first),
        _ => None,
    };
    Ok(of_motion(&run, value))
}
