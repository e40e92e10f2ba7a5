//! Numerics selected by hand, for comparison with those that the program chooses: the least work that reaches an accuracy, and
//! the errors of schemes over their number of steps.

use crate::scenes::{KINDS, scene};
use crate::{Motion, distance, read, simulate};
use rodfit::Error;

/// Schemes among which the cheapest is selected, as lines of a scene.
const SCHEMES: [&str; 3] = [
    "scheme = \"newmark-beta\"",
    "scheme = \"generalised-alpha\"\nrho_inf = 0.8",
    "scheme = \"rodas4\"",
];
/// Schemes with other numerical damping, whose errors are compared too.
const OTHER_DAMPINGS: [&str; 2] = [
    "scheme = \"generalised-alpha\"\nrho_inf = 0.5",
    "scheme = \"generalised-alpha\"\nrho_inf = 0",
];
/// Factor between neighboring meshes and steps.
const RATIO: f64 = std::f64::consts::SQRT_2;
/// Number of meshes from the coarsest accurate one on, among which the cheapest is selected.
const MESHES: usize = 3;

/// A run with given numbers of segments and steps up to `end`, s; none if the run fails.
fn run(text: &str, segments: f64, steps: f64, end: f64, scheme: &str) -> Option<Motion> {
    let step = format!("step = {}\n{scheme}", end / steps);
    let scene = read(text, "", &format!("segments = {segments}"), &step).ok()?;
    let (problem, trajectory) = simulate(&scene).ok()?;
    Motion::of(&problem, &trajectory).ok()
}

/// The least work (edges times Newton iterations) of a run whose error against `reference` is at most `requested`, among
/// meshes and steps about those that were `chosen`. None without such a run.
pub fn cheapest(
    text: &str,
    requested: f64,
    reference: &[[f64; 3]],
    chosen: &Motion,
) -> Option<f64> {
    let is_enough = |motion: &Motion| distance(&motion.places, reference) <= requested;
    let exact = |segments: f64, steps: f64, scheme: &str| {
        run(text, segments, steps, chosen.end, scheme).filter(is_enough)
    };
    let mut meshes: Vec<f64> =
        (-8..3).map(|k| (chosen.segments * RATIO.powi(k)).round().max(4.0)).collect();
    meshes.dedup();
    let can =
        |n: &f64| [2.0, 12.0].iter().any(|by| exact(*n, by * chosen.steps, SCHEMES[1]).is_some());
    // The coarsest accurate mesh is rarely the cheapest, as it needs the most accurate steps: two finer ones are tried too.
    let first = meshes.iter().position(can)?;
    let mut best: Option<f64> = None;
    for segments in meshes.iter().skip(first).take(MESHES) {
        for scheme in SCHEMES {
            for k in -10..9 {
                let steps = (chosen.steps * RATIO.powi(k)).round().max(1.0);
                let found = exact(*segments, steps, scheme);
                if let Some(found) = found {
                    best = Some(best.unwrap_or(f64::INFINITY).min(found.work));
                    break;
                }
            }
        }
    }
    best
}

/// Prints the error of the time step alone on 24 edges, by scheme and number of steps, for the scenes with these seeds.
pub fn compare_schemes(seeds: std::ops::Range<u64>) -> Result<(), Error> {
    for seed in seeds {
        let text = scene(seed);
        let step = "step = 1e-3\nscheme = \"newmark-beta\"";
        let end = read(&text, "", "segments = 24", step)?.time.map_or(0.0, |time| time.end);
        let Some(reference) = run(&text, 24.0, 16_000.0, end, SCHEMES[1]) else { continue };
        println!("{seed} {}", KINDS[(seed % KINDS.len() as u64) as usize]);
        for scheme in SCHEMES.iter().chain(&OTHER_DAMPINGS) {
            print!("  {:44}", scheme.replace('\n', " "));
            for steps in [60.0, 125.0, 250.0, 500.0, 1000.0, 2000.0, 4000.0] {
                match run(&text, 24.0, steps, end, scheme) {
                    Some(motion) => print!(" {:.1e}", distance(&motion.places, &reference.places)),
                    None => print!(" {:6}", "failed"),
                }
            }
            println!();
        }
    }
    Ok(())
}
