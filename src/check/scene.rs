//! The check of a whole scene: every element, at the scene's own states and at random ones.

use super::{CheckReport, Tolerance};
use crate::energy::{AsEnergy, Element};
use crate::error::Error;
use crate::planar_rod::PlanarRod;
use crate::problem::Problem;
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

/// Checks the derivatives of every kind of element of a scene: in its rest shape, along its
/// motion when it has a `[time]` (without one, or when a step fails, as far as it goes), and in
/// seeded random states with turning angles up to 150 degrees and strains up to 30 %.
pub fn check_problem(problem: &Problem, tolerance: Tolerance) -> Result<CheckReport, Error> {
    let mut report = CheckReport::new(tolerance);
    let rod = problem.rod();
    compare_all(&mut report, &rod, &problem.rest());
    if let Ok(time) = problem.time() {
        let mut simulation = problem.simulation();
        let steps = time.steps().min(OWN_STEPS);
        for k in 1..=steps {
            if simulation.step_to(time.at(k)).is_err() {
                break;
            }
            if k % steps.div_ceil(OWN_STATES) == 0 {
                compare_all(&mut report, &rod, &simulation.state().q);
            }
        }
    }
    let mut random = ChaCha8Rng::seed_from_u64(1);
    for _ in 0..RANDOM_STATES {
        compare_all(&mut report, &rod, &random_shape(&rod, &mut random));
    }
    Ok(report)
}

/// A rod of the same rest lengths with random turns and strains.
fn random_shape(rod: &PlanarRod<f64>, random: &mut ChaCha8Rng) -> Vec<f64> {
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

fn compare_all(report: &mut CheckReport, rod: &PlanarRod<f64>, q: &[f64]) {
    compare(report, &rod.stretch, q, 0);
    compare(report, &rod.bend, q, 1);
}

/// Compares elements that start at node `i` and are numbered from `first`.
fn compare<E: Element<f64, N>, const N: usize>(
    report: &mut CheckReport,
    elements: &[E],
    q: &[f64],
    first: usize,
) {
    for (i, element) in elements.iter().enumerate().step_by(elements.len().div_ceil(ELEMENTS)) {
        let own: &[f64; N] = q[2 * i..].first_chunk().expect("the element's nodes");
        // Energies do not change under translation; finite differences need small coordinates.
        let local = std::array::from_fn(|k| own[k] - own[k % 2]);
        let name = format!("{} {}", E::NAME, i + first);
        report.compare(&AsEnergy(*element), &local, &name, |k| {
            format!("{}{}", ["x", "y"][k % 2], i + k / 2)
        });
    }
}
