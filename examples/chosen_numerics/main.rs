//! Errors of mesh, step and scheme that the program chooses, over random scenes of ten kinds: the true error of the whole rod
//! against the requested one, and the work of choosing against that of the chosen run.
//!
//! `cargo run --release --example chosen_numerics -- [costs] [SCENES] [FIRST SEED]`; 10 scenes if no number is given. The true
//! error is the largest distance of eight points along the rod, at 200 times, from a reference: a run on a finer mesh with
//! smaller steps. Its own error is estimated by another run; where it is too large to decide whether the request is kept, the
//! scene counts as undecided. The errors and costs are summarized for each kind of scene, and over all.
//! `costs` also compares the work with the least one of numerics picked by hand, which takes many times as long. `-- schemes
//! [SCENES] [FIRST SEED]` prints the errors of the step alone, by scheme. `-- fits [SCENES] [FIRST SEED]` fits E to the tip of
//! each scene, with everything chosen, and counts the intervals that hold.

mod by_hand;
mod fits;
mod reference;
mod scenes;
mod summary;

use rayon::prelude::*;
use reference::Reference;
use rodfit::accuracy::simulate_checked;
use rodfit::{Error, Point, Problem, Scene, Trajectory};
use scenes::{KINDS, scene};
use summary::{Comparison, Outcome, summarize};

/// Requested errors over the length.
const REQUESTED: [f64; 2] = [1e-2, 1e-3];
/// Number of times at which motions are compared.
const TIMES: usize = 200;
/// Number of points along the rod at which motions are compared.
const PARTS: usize = 8;
/// Newton iterations that take as much time as a step of `rodas4`, in a plane and in space.
const ITERATIONS_OF_RODAS4: [usize; 2] = [5, 3];

/// The scene of a text, with lines in the places of its numerics; an empty line leaves the choice to the program.
fn read(text: &str, accuracy: &str, segments: &str, step: &str) -> Result<Scene, Error> {
    let text = text.replace("ACCURACY", accuracy).replace("SEGMENTS", segments);
    Scene::from_toml(&text.replace("STEP", step), ".")
}

/// Simulates a scene. Numerics that it leaves open are chosen and checked; the nodes about the compared points are recorded.
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

/// A run, reduced to positions at the compared points and times, with its cost.
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
    /// Reduces a run to the compared positions. The work of `rodas4`, which has no Newton iterations, is converted.
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

/// The largest distance of two lists of positions.
fn distance(a: &[[f64; 3]], b: &[[f64; 3]]) -> f64 {
    let square =
        |(a, b): (&[f64; 3], &[f64; 3])| (0..3).map(|c| (a[c] - b[c]).powi(2)).sum::<f64>();
    a.iter().zip(b).map(square).fold(0.0, f64::max).sqrt()
}

/// The median of values (the upper one of an even number); NaN of none.
fn median(mut values: Vec<f64>) -> f64 {
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
    let scenes: Vec<Scenes> = (first..first + count)
        .into_par_iter()
        .map(|seed| compare(seed, is_asked("costs")))
        .collect();
    for (request, requested) in REQUESTED.into_iter().enumerate() {
        let results: Vec<&Outcome> = scenes.iter().map(|outcomes| &outcomes[request]).collect();
        summarize(requested, &results);
    }
    Ok(())
}

/// The results of a scene, one for each request.
type Scenes = [Outcome; 2];

/// Simulates a scene for both requests, and compares the runs with its true motion.
fn compare(seed: u64, with_costs: bool) -> Scenes {
    let text = scene(seed);
    let kind = KINDS[(seed % KINDS.len() as u64) as usize];
    let runs = REQUESTED.map(|requested| {
        let scene = read(&text, &format!("accuracy = {requested}"), "", "")?;
        let (problem, run) = simulate(&scene)?;
        let motion = Motion::of(&problem, &run)?;
        Ok::<_, Error>((problem, motion))
    });
    // One reference for both requests: it is finer than the finer run.
    let finest = runs.iter().rev().find_map(|run| run.as_ref().ok());
    let reference = finest.map(|(problem, _)| Reference::new(&text, problem));
    let mut requests = REQUESTED.into_iter();
    runs.map(|run| {
        let requested = requests.next().unwrap_or_default();
        let (problem, motion) = match run {
            Ok(run) => run,
            Err(error) => {
                println!("{seed} {kind}, {requested:.0e}: failed: {error}");
                return Outcome::Failed;
            }
        };
        let Some(resolution) = problem.resolution() else { return Outcome::Failed };
        let is_warned = resolution.bound.is_some();
        let reference = match &reference {
            Some(Ok(reference)) => reference,
            Some(Err(error)) => {
                println!("{seed} {kind}, {requested:.0e}: no reference: {error}");
                return Outcome::Undecided { is_warned };
            }
            None => return Outcome::Undecided { is_warned },
        };
        let error = distance(&motion.places, &reference.places);
        let is_within = reference.is_within(error, requested);
        // The comparison by hand takes many times as long as everything else.
        let by_hand = (with_costs && is_within.is_some())
            .then(|| by_hand::cheapest(&text, requested, &reference.places, &motion))
            .flatten();
        let cost = by_hand.map(|least| (resolution.work + motion.work) / least);
        let choosing = resolution.work / motion.work;
        println!(
            "{seed} {kind}, {requested:.0e}: error {error:.1e}, estimated {:.1e}{}{}; {} segments, {} steps, {}; choosing \
             {choosing:.2} runs{}",
            resolution.error.unwrap_or(f64::NAN),
            if is_warned { ", warned" } else { "" },
            match is_within {
                None => ", UNDECIDED",
                Some(false) => ", EXCEEDED",
                Some(true) => "",
            },
            problem.segments(),
            problem.time().map_or(0, rodfit::scene::Time::steps),
            problem.time().map_or("", |time| time.scheme.name()),
            cost.map_or(String::new(), |cost| format!(", {cost:.1} times the least work by hand")),
        );
        let ratio = error / requested;
        match is_within {
            Some(is_within) => Outcome::Compared(Comparison { kind, ratio, is_within, is_warned, choosing, cost }),
            None => Outcome::Undecided { is_warned },
        }
    })
}
