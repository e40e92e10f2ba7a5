//! Errors of mesh, step and scheme that the program chooses, over random scenes of ten kinds: the true error of the whole rod
//! against the requested one, and the work of choosing against that of the chosen run.
//!
//! `cargo run --release --example chosen_numerics -- [costs] [SCENES] [FIRST SEED]`; 10 scenes if no number is given. The true
//! error is the largest distance of eight points along the rod, at 200 times, from a run on a finer mesh with smaller steps.
//! `costs` also compares the work with the least one of numerics picked by hand, which takes many times as long. `-- schemes
//! [SCENES] [FIRST SEED]` prints the errors of the step alone, by scheme. `-- fits [SCENES] [FIRST SEED]` fits E to the tip of
//! each scene, with everything chosen, and counts the intervals that hold.

mod by_hand;
mod fits;
mod scenes;

use rodfit::accuracy::simulate_checked;
use rodfit::{Error, Point, Problem, Scene, Trajectory};
use scenes::{KINDS, scene};

/// Requested errors over the length.
const REQUESTED: [f64; 2] = [1e-2, 1e-3];
/// Times and parts of the rod at which motions are compared.
const TIMES: usize = 200;
const PARTS: usize = 8;
/// Refinement of the reference over the numerics chosen for the smallest request.
const FINER: usize = 3;
/// The same of the step of `rodas4`, which is of fourth order.
const FINER_RODAS4: f64 = 2.0;
/// Newton iterations that take as long as a step of `rodas4`, in a plane and in space.
const ITERATIONS_OF_RODAS4: [usize; 2] = [5, 3];

/// A scene with its numerics, where they are given.
fn read(text: &str, accuracy: &str, segments: &str, step: &str) -> Result<Scene, Error> {
    let text = text.replace("ACCURACY", accuracy).replace("SEGMENTS", segments);
    Scene::from_toml(&text.replace("STEP", step), ".")
}

/// A run whose numerics are chosen and checked where they are left open; the nodes about the compared points are recorded.
fn simulate(scene: &Scene) -> Result<(Problem, Trajectory), Error> {
    let (problem, check) = scene.checked_problem()?;
    simulate_checked(problem, check, |problem| {
        let mut nodes = Vec::new();
        for point in points(&problem) {
            nodes.extend(problem.stencil(point)?.nodes.iter().map(|(node, _)| *node));
        }
        nodes.sort_unstable();
        nodes.dedup();
        let trajectory = Trajectory::new(&problem, &nodes, &[])?;
        Ok((problem, trajectory))
    })
}

/// Points at equal distances along the rod.
fn points(problem: &Problem) -> impl Iterator<Item = Point> {
    let length = problem.length();
    (1..=PARTS).map(move |part| match part {
        PARTS => Point::Tip,
        part => Point::ArcLength(length * part as f64 / PARTS as f64),
    })
}

/// A run at the points and times of comparison.
struct Motion {
    /// Places over the length.
    places: Vec<[f64; 3]>,
    segments: f64,
    steps: f64,
    /// End of the run, s.
    end: f64,
    /// Edges times Newton iterations.
    work: f64,
}

impl Motion {
    fn of(problem: &Problem, run: &Trajectory) -> Result<Self, Error> {
        let (time, length) = (problem.time()?, problem.length());
        let mut places = Vec::new();
        for point in points(problem) {
            for k in 1..=TIMES {
                let at = run.at(point, time.end * k as f64 / TIMES as f64)?.0;
                places.push(at.map(|x| x / length));
            }
        }
        let work = run.work();
        let iterations = match work.newton_iterations {
            0 => ITERATIONS_OF_RODAS4[usize::from(problem.model().0 == "spatial")] * work.steps,
            iterations => iterations,
        };
        let (segments, steps) = (problem.segments() as f64, time.steps() as f64);
        Ok(Self { places, segments, steps, end: time.end, work: iterations as f64 * segments })
    }
}

fn distance(a: &[[f64; 3]], b: &[[f64; 3]]) -> f64 {
    let square =
        |(a, b): (&[f64; 3], &[f64; 3])| (0..3).map(|c| (a[c] - b[c]).powi(2)).sum::<f64>();
    a.iter().zip(b).map(square).fold(0.0, f64::max).sqrt()
}

/// What is counted over the scenes of one request.
#[derive(Default)]
struct Counts {
    scenes: usize,
    within: usize,
    silent: usize,
    false_alarms: usize,
    failed: usize,
    ratios: Vec<f64>,
    choosing: Vec<f64>,
    /// Work of choosing and of the run over the least work by hand.
    costs: Vec<f64>,
}

fn median(values: &mut [f64]) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
}

fn main() -> Result<(), Error> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let is_asked = |word: &str| words.iter().any(|w| w == word);
    let numbers: Vec<u64> = words.iter().filter_map(|a| a.parse().ok()).collect();
    let count = numbers.first().copied().unwrap_or(10);
    let first = numbers.get(1).copied().unwrap_or(0);
    if is_asked("schemes") {
        return by_hand::compare_schemes(first..first + count);
    }
    if is_asked("fits") {
        fits::cover(first..first + count);
        return Ok(());
    }
    let mut counts = REQUESTED.map(|_| Counts::default());
    for seed in first..first + count {
        let text = scene(seed);
        let kind = KINDS[(seed % KINDS.len() as u64) as usize];
        let runs = REQUESTED.map(|requested| {
            let scene = read(&text, &format!("accuracy = {requested}"), "", "")?;
            let (problem, run) = simulate(&scene)?;
            let motion = Motion::of(&problem, &run)?;
            Ok::<_, Error>((problem, motion))
        });
        let Some(Ok((finest, _))) = runs.last() else {
            for (counts, run) in counts.iter_mut().zip(&runs) {
                counts.scenes += 1;
                counts.failed += usize::from(run.is_err());
            }
            println!(
                "{seed} {kind}: {:?}",
                runs.last().and_then(|r| r.as_ref().err()).map(ToString::to_string)
            );
            continue;
        };
        let segments = format!("segments = {}", FINER * finest.segments());
        let step = finest.time()?.step_size();
        let step = match finest.time()?.scheme.name() {
            "rodas4" => format!("step = {}\nscheme = \"rodas4\"", step / FINER_RODAS4),
            _ => {
                let step = step / FINER as f64;
                format!("step = {step}\nscheme = \"generalised-alpha\"\nrho_inf = 0.9")
            }
        };
        let reference = simulate(&read(&text, "", &segments, &step)?);
        let reference = reference.and_then(|(problem, run)| Motion::of(&problem, &run));
        let reference = match reference {
            Ok(reference) => reference.places,
            Err(error) => {
                println!("{seed} {kind}: no reference: {error}");
                continue;
            }
        };
        for ((counts, run), requested) in counts.iter_mut().zip(&runs).zip(REQUESTED) {
            counts.scenes += 1;
            let Ok((problem, motion)) = run else {
                counts.failed += 1;
                println!("{seed} {kind}, {requested:.0e}: failed");
                continue;
            };
            let error = distance(&motion.places, &reference);
            let resolution = problem.resolution().expect("chosen numerics");
            let warned = resolution.bound.is_some();
            let within = error <= requested;
            counts.within += usize::from(within);
            counts.silent += usize::from(!within && !warned);
            counts.false_alarms += usize::from(within && warned);
            counts.ratios.push(error / requested);
            counts.choosing.push(resolution.work / motion.work);
            let by_hand = is_asked("costs")
                .then(|| by_hand::cheapest(&text, requested, &reference, motion))
                .flatten();
            let cost = by_hand.map(|least| (resolution.work + motion.work) / least);
            counts.costs.extend(cost);
            println!(
                "{seed} {kind}, {requested:.0e}: error {error:.1e}, estimated {:.1e}{}{}; {} segments, {} steps, {}; choosing \
                 {:.2} runs{}",
                resolution.error.unwrap_or(f64::NAN),
                if warned { ", warned" } else { "" },
                if within { "" } else { ", EXCEEDED" },
                problem.segments(),
                problem.time()?.steps(),
                problem.time()?.scheme.name(),
                resolution.work / motion.work,
                cost.map_or(String::new(), |cost| format!(
                    ", {cost:.1} times the least work by hand"
                )),
            );
        }
    }
    for (counts, requested) in counts.iter_mut().zip(REQUESTED) {
        println!(
            "requested {requested:.0e}: {} of {} within, {} exceeded without a warning, {} warned although within, {} failed; \
             median error {:.2} of the requested one, choosing takes {:.2} runs in the median and {:.2} at most",
            counts.within,
            counts.scenes,
            counts.silent,
            counts.false_alarms,
            counts.failed,
            median(&mut counts.ratios),
            median(&mut counts.choosing),
            counts.choosing.iter().copied().fold(0.0, f64::max),
        );
        if !counts.costs.is_empty() {
            let number = counts.costs.len();
            println!(
                "  {:.2} times the least work by hand in the median of {number}",
                median(&mut counts.costs)
            );
        }
    }
    Ok(())
}
