//! Errors of mesh, step and scheme that the program chooses, over random scenes of ten kinds: the true error of the whole rod
//! against the requested one, and the work of choosing against that of the chosen run.
//!
//! `cargo run --release --example chosen_numerics -- [SCENES] [FIRST SEED]`; 10 scenes if no number is given. The true error is
//! the largest distance of nine points along the rod, at 200 times, from a run on a finer mesh with smaller steps.

mod scenes;

use rodfit::{Error, Point, Problem, Scene, Trajectory};
use scenes::{KINDS, scene};

/// Requested errors over the length.
const REQUESTED: [f64; 2] = [1e-2, 1e-3];
/// Times and parts of the rod at which motions are compared.
const TIMES: usize = 200;
const PARTS: usize = 8;
/// Refinement of the reference over the numerics chosen for the smallest request.
const FINER: usize = 3;

/// A scene with its numerics, where they are given.
fn read(text: &str, accuracy: &str, segments: &str, step: &str) -> Result<Scene, Error> {
    let text = text.replace("ACCURACY", accuracy).replace("SEGMENTS", segments);
    Scene::from_toml(&text.replace("STEP", step), ".")
}

/// Points along the rod at equal distances in time, over the length, and the work of the run: edges times Newton iterations.
fn motion(problem: &Problem, run: &Trajectory) -> Result<(Vec<[f64; 3]>, f64), Error> {
    let (end, length) = (problem.time()?.end, problem.length());
    let mut places = Vec::new();
    for part in 1..=PARTS {
        let point = match part {
            PARTS => Point::Tip,
            part => Point::ArcLength(length * part as f64 / PARTS as f64),
        };
        for k in 1..=TIMES {
            places.push(run.at(point, end * k as f64 / TIMES as f64)?.0.map(|x| x / length));
        }
    }
    let of_rosenbrock = if problem.model().0 == "spatial" { 3 } else { 5 };
    let work = run.work();
    let iterations = match work.newton_iterations {
        0 => of_rosenbrock * work.steps,
        iterations => iterations,
    };
    Ok((places, (iterations * problem.segments()) as f64))
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
}

fn median(values: &mut [f64]) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
}

fn main() -> Result<(), Error> {
    let numbers: Vec<u64> = std::env::args().skip(1).filter_map(|a| a.parse().ok()).collect();
    let count = numbers.first().copied().unwrap_or(10);
    let first = numbers.get(1).copied().unwrap_or(0);
    let mut counts = REQUESTED.map(|_| Counts::default());
    for seed in first..first + count {
        let text = scene(seed);
        let kind = KINDS[(seed % KINDS.len() as u64) as usize];
        let runs = REQUESTED.map(|requested| {
            let scene = read(&text, &format!("accuracy = {requested}"), "", "")?;
            let (problem, run) = scene.simulate()?;
            let (places, work) = motion(&problem, &run)?;
            Ok::<_, Error>((problem, places, work))
        });
        let Some(Ok((finest, ..))) = runs.last() else {
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
        let step = finest.time()?.step / FINER as f64;
        let step = format!("step = {step}\nscheme = \"generalised-alpha\"\nrho_inf = 0.9");
        let reference = read(&text, "", &segments, &step)?.simulate();
        let reference = reference.and_then(|(problem, run)| motion(&problem, &run));
        let reference = match reference {
            Ok((reference, _)) => reference,
            Err(error) => {
                println!("{seed} {kind}: no reference: {error}");
                continue;
            }
        };
        for ((counts, run), requested) in counts.iter_mut().zip(&runs).zip(REQUESTED) {
            counts.scenes += 1;
            let Ok((problem, places, work)) = run else {
                counts.failed += 1;
                println!("{seed} {kind}, {requested:.0e}: failed");
                continue;
            };
            let error = distance(places, &reference);
            let resolution = problem.resolution().expect("chosen numerics");
            let warned = resolution.bound.is_some();
            let within = error <= requested;
            counts.within += usize::from(within);
            counts.silent += usize::from(!within && !warned);
            counts.false_alarms += usize::from(within && warned);
            counts.ratios.push(error / requested);
            counts.choosing.push(resolution.work / work);
            println!(
                "{seed} {kind}, {requested:.0e}: error {error:.1e}, estimated {:.1e}{}{}; {} segments, {} steps, {}; choosing \
                 {:.2} runs",
                resolution.error.unwrap_or(f64::NAN),
                if warned { ", warned" } else { "" },
                if within { "" } else { ", EXCEEDED" },
                problem.segments(),
                problem.time()?.steps(),
                problem.time()?.scheme.name(),
                resolution.work / work,
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
    }
    Ok(())
}
