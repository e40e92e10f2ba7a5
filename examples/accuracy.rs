//! What mesh, step and scheme of the program's own choice are worth: over random scenes the true error against
//! the one that was asked for, and the time of choosing and running over that of the cheapest fixed setting.
//!
//! `cargo run --release --example accuracy -- [costs] [SCENES] [FIRST SEED]`, of 6 scenes if no number is given; without
//! `costs` no cheapest setting is looked for, which takes many times as long. And `-- schemes [SCENES]` for the errors of schemes
//! by their steps, `-- struck [SCENES] [FIRST SEED]` for rods that start with a velocity, `-- tilted [SCENES] [FIRST SEED]` for
//! cantilevers in any direction.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rodfit::scene::Scheme;
use rodfit::{Error, Point, Problem, Scene};
use std::f64::consts::{PI, TAU};
use std::time::Instant;

/// Accuracies that are asked for.
const ASKED: [f64; 3] = [1e-2, 1e-3, 1e-4];
/// Times at which runs are compared.
const SAMPLES: usize = 200;
/// How the schemes are written that may be picked by hand.
const SCHEMES: [&str; 3] = [
    "scheme = \"newmark-beta\"",
    "scheme = \"generalised-alpha\"\nrho_inf = 0.8",
    "scheme = \"rodas4\"",
];

/// A rod with numbers drawn at random: straight, arc or helix, from stiff to limp, damped or not, with loads, let go or
/// plucked, over one to six periods; or `struck`, with a velocity that jumps at the clamp. The words SEGMENTS and STEP stand for
/// its numerics.
fn scene(seed: u64, struck: bool) -> String {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut between = |a: f64, b: f64| a + (b - a) * random.random::<f64>();
    let gravity = 9.81;
    let length = 0.1 * 10f64.powf(between(0.0, 1.0));
    let radius = length * 10f64.powf(between(-2.7, -1.5));
    let density = between(900.0, 8000.0);
    // By how much of its length it would sag, were it straight.
    let sag = 10f64.powf(between(-2.0, 0.0));
    let modulus = density * gravity * length.powi(3) / (2.0 * radius * radius * sag);
    let kind = between(0.0, 6.0) as usize;
    let shape = match kind {
        0..=2 => format!("{{ kind = \"straight\", length = {length}, direction = [1, 0, 0] }}"),
        3 => format!("{{ kind = \"arc\", length = {length}, angle = {} }}", between(0.3, 3.0)),
        4 => {
            let (wide, pitch) = (0.06 * length, 0.12 * length);
            format!(
                "{{ kind = \"helix\", length = {length}, radius = {wide}, pitch = {pitch}, axis = [0, 0, -1], \
                 handedness = \"left\" }}"
            )
        }
        _ => {
            let up = between(0.0, 0.6);
            format!("{{ kind = \"straight\", length = {length}, direction = [1, 0, {up}] }}")
        }
    };
    let bending = 3.516 * (modulus * radius * radius / 4.0 / density).sqrt() / length.powi(2);
    let rate = bending.max((gravity / length).sqrt());
    let end = between(1.0, 6.0) * TAU / rate;
    let damping = match between(0.0, 4.0) as usize {
        0 => format!("mass = {}", between(0.02, 0.3) * rate),
        1 => format!("stiffness = {}", between(0.005, 0.05) / rate),
        _ => String::new(),
    };
    let weight = density * PI * radius * radius * length * gravity;
    let along_z = if kind == 4 { -gravity } else { 0.0 };
    let across = if kind >= 4 { between(0.1, 0.5) * weight } else { 0.0 };
    let load = match between(0.0, 4.0) as usize {
        0 => {
            let up = between(0.1, 0.5) * weight;
            format!("point = [{{ node = \"tip\", force = [0, {up}, {across}] }}]")
        }
        _ => String::new(),
    };
    let initial = match between(0.0, 4.0) as usize {
        kind if struck => match kind % 2 {
            0 => format!("velocity = [0, {}, 0]", between(0.05, 0.5) * rate * length),
            _ => format!("angular_velocity = [0, 0, {}]", between(0.1, 1.0) * rate),
        },
        0 => {
            let up = between(-0.5, 0.5) * weight;
            format!("state = \"equilibrium\"\npoint = [{{ node = \"tip\", force = [0, {up}, 0] }}]")
        }
        _ => String::new(),
    };
    format!(
        "ACCURACY\n[rod]\nSEGMENTS\nshape = {shape}\nsection = {{ kind = \"circle\", radius = {radius} }}\n\
         [material]\ndensity = {density}\nyoungs_modulus = {modulus}\npoisson_ratio = 0.35\n\
         [loads]\ngravity = [0, {}, {along_z}]\ndamping = {{ {damping} }}\n{load}\n[initial]\n{initial}\n\
         [time]\nend = {end}\nSTEP\n",
        -gravity
    )
}

/// A cantilever that its loads would bend by 3 to 50 % of its length, were they across it: straight in any direction, a third
/// of them nearly upright or hanging, or an arc; half of them with a force and a third with a mass at the tip, and some plucked.
fn tilted(seed: u64) -> String {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut between = |a: f64, b: f64| a + (b - a) * random.random::<f64>();
    let gravity = 9.81;
    let length = 0.1 * 10f64.powf(between(0.0, 1.0));
    let radius = length * 10f64.powf(between(-2.7, -1.5));
    let density = between(900.0, 8000.0);
    let rod = density * PI * radius * radius * length;
    let weight = rod * gravity;
    let shape = match between(0.0, 10.0) as usize {
        0..=1 => format!("{{ kind = \"arc\", length = {length}, angle = {} }}", between(0.3, 2.0)),
        kind => {
            let upright = (kind % 2) as f64 * PI + PI / 2.0 + between(-0.05, 0.05);
            let angle = if kind < 6 { between(0.0, TAU) } else { upright };
            let aside = if kind % 3 == 0 { between(-1.0, 1.0) } else { 0.0 };
            let direction = [angle.cos(), angle.sin(), aside];
            format!("{{ kind = \"straight\", length = {length}, direction = {direction:?} }}")
        }
    };
    let [force, mass] = [between(-1.5, 1.5), between(-1.0, 0.5)].map(|part| part.max(0.0));
    let (towards, damped, plucked) =
        (between(0.0, TAU), between(0.0, 3.0) as usize, between(0.0, 3.0) < 1.0);
    let pull = |part: f64| {
        let [x, y] = [towards.cos(), towards.sin()].map(|c| part * weight * c);
        format!("point = [{{ node = \"tip\", force = [{x}, {y}, 0] }}]")
    };
    let bent = 10f64.powf(between(-1.5, -0.3));
    let across = weight * (0.125 + (force + mass) / 3.0);
    let modulus = across * length.powi(2) / (bent * PI / 4.0 * radius.powi(4));
    let rate = 3.516 * (modulus * radius * radius / 4.0 / density).sqrt() / length.powi(2);
    let end = between(1.0, 6.0) * TAU / rate;
    let damping = match damped {
        0 => format!("mass = {}", between(0.02, 0.3) * rate),
        1 => format!("stiffness = {}", between(0.005, 0.05) / rate),
        _ => String::new(),
    };
    let bob = match mass {
        0.0 => String::new(),
        _ => format!("mass = [{{ node = \"tip\", mass = {} }}]", mass * rod),
    };
    let load = if force > 0.0 { pull(force) } else { String::new() };
    let initial = match plucked {
        true => format!("state = \"equilibrium\"\n{}", pull(0.3)),
        false => String::new(),
    };
    format!(
        "ACCURACY\n[rod]\nSEGMENTS\nshape = {shape}\nsection = {{ kind = \"circle\", radius = {radius} }}\n{bob}\n\
         [material]\ndensity = {density}\nyoungs_modulus = {modulus}\npoisson_ratio = 0.35\n\
         [loads]\ngravity = [0, {}, 0]\ndamping = {{ {damping} }}\n{load}\n[initial]\n{initial}\n\
         [time]\nend = {end}\nSTEP\n",
        -gravity
    )
}

/// The scene with numerics of one's own.
fn with(text: &str, segments: usize, step: f64, scheme: &str) -> Result<Scene, Error> {
    let text = text.replace("ACCURACY", "").replace("SEGMENTS", &format!("segments = {segments}"));
    Scene::from_toml(&text.replace("STEP", &format!("step = {step}\n{scheme}")), ".")
}

/// Its problem.
fn fixed(text: &str, segments: usize, step: f64, scheme: &str) -> Result<Problem, Error> {
    with(text, segments, step, scheme)?.problem()
}

/// Steps take as long as so many edges more would, and those of the linearly implicit scheme as so many Newton iterations, in a
/// plane and in space.
const OF_STEP: f64 = 8.0;
const OF_ROSENBROCK: [usize; 2] = [5, 3];

/// What a run came to.
struct Ran {
    /// The tip over the length.
    tips: Vec<[f64; 3]>,
    edges: f64,
    /// Newton iterations, or what takes as long.
    iterations: f64,
}

impl Ran {
    /// Edges times Newton iterations.
    fn work(&self) -> f64 {
        self.edges * self.iterations
    }

    /// What goes with the time that it takes.
    fn takes(&self) -> f64 {
        (self.edges + OF_STEP) * self.iterations
    }
}

fn run(problem: &Problem) -> Result<Ran, Error> {
    let run = problem.simulate()?;
    let work = run.work();
    let of_rosenbrock = OF_ROSENBROCK[usize::from(problem.model().0 == "spatial")];
    let iterations = match work.newton_iterations {
        0 => of_rosenbrock * work.steps,
        iterations => iterations,
    } as f64;
    let (end, edges) = (problem.time()?.end, problem.segments() as f64);
    let at = |k: usize| Ok(run.at(Point::Tip, end * k as f64 / SAMPLES as f64)?.0);
    let tips = (1..=SAMPLES).map(at).collect::<Result<Vec<[f64; 3]>, Error>>()?;
    let over = problem.length().recip();
    let tips = tips.into_iter().map(|x| x.map(|x| over * x)).collect();
    Ok(Ran { tips, edges, iterations })
}

fn apart(a: &[[f64; 3]], b: &[[f64; 3]]) -> f64 {
    let distance = |(a, b): (&[f64; 3], &[f64; 3])| {
        a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
    };
    a.iter().zip(b).map(distance).fold(0.0, f64::max)
}

/// A fixed setting and its run.
struct Fixed {
    segments: usize,
    steps: f64,
    scheme: &'static str,
    ran: Ran,
}

/// The cheapest fixed setting of this accuracy: on the coarsest mesh that can be as
/// exact and two finer ones, the largest step of each scheme that is, in factors of the root of two.
fn cheapest(
    text: &str,
    asked: f64,
    truth: &[[f64; 3]],
    (segments, steps, end): (f64, f64, f64),
) -> Option<Fixed> {
    let good = |segments: f64, steps: f64, scheme: &str| {
        let ran =
            fixed(text, segments as usize, end / steps, scheme).and_then(|problem| run(&problem));
        ran.ok().filter(|ran| apart(&ran.tips, truth) <= asked)
    };
    let meshes = (-7..3).map(|k| (segments * 2f64.powf(0.5 * f64::from(k))).round().max(4.0));
    let mut meshes: Vec<f64> = meshes.collect();
    meshes.dedup();
    // Steps may have been chosen for a scheme that takes larger ones than another.
    let can =
        |n: &f64| [2.0, 12.0].iter().any(|finer| good(*n, finer * steps, SCHEMES[1]).is_some());
    let first = meshes.iter().position(can)?;
    let mut best: Option<Fixed> = None;
    for segments in &meshes[first..(first + 3).min(meshes.len())] {
        for scheme in SCHEMES {
            for k in -8..9 {
                let steps = (steps * 2f64.powf(0.5 * f64::from(k))).round();
                // Nothing does a step in less.
                let least = best.as_ref().map_or(f64::INFINITY, |best| best.ran.takes());
                if 1.5 * steps * (segments + OF_STEP) > least {
                    break;
                }
                if let Some(ran) = good(*segments, steps, scheme) {
                    if ran.takes() < least {
                        best = Some(Fixed { segments: *segments as usize, steps, scheme, ran });
                    }
                    break;
                }
            }
        }
    }
    best
}

/// The time that a scene takes which leaves its numerics to the program, over that of one with a fixed setting: from the scene
/// to the motion, the shortest of seven each, in turn.
fn time_over(open: &Scene, fixed: &Scene) -> Result<f64, Error> {
    let mut shortest = [f64::INFINITY; 2];
    for _ in 0..7 {
        for (scene, shortest) in [open, fixed].into_iter().zip(&mut shortest) {
            let start = Instant::now();
            scene.problem()?.simulate()?;
            *shortest = shortest.min(start.elapsed().as_secs_f64());
        }
    }
    Ok(shortest[0] / shortest[1])
}

/// The motion that both mesh and step have no part in, from runs beside one of an accuracy of 1e-4.
fn limit(text: &str, problem: &Problem) -> Result<Vec<[f64; 3]>, Error> {
    let (n, time) = (problem.segments(), problem.time()?);
    // What rodas4 leaves falls faster than what the mesh does: it is made small, not carried on.
    let (scheme, finer) = match time.scheme {
        Scheme::Rodas4 => (SCHEMES[2], 2.0),
        _ => (SCHEMES[1], 1.0),
    };
    let tips = |n: usize, step: f64| Ok::<_, Error>(run(&fixed(text, n, step, scheme)?)?.tips);
    let (coarse, fine) = (tips(n, time.step / finer)?, tips(2 * n, time.step / 2.0)?);
    let limit = |(c, f): (&[f64; 3], &[f64; 3])| [0, 1, 2].map(|i| f[i] + (f[i] - c[i]) / 3.0);
    Ok(coarse.iter().zip(&fine).map(limit).collect())
}

fn accuracy(seeds: std::ops::Range<u64>, with_costs: bool) -> Result<(), Error> {
    let mut ratios = ASKED.map(|_| Vec::new());
    let mut costs = ASKED.map(|_| Vec::new());
    for seed in seeds {
        let text = scene(seed, false);
        let open = text.replace("SEGMENTS", "").replace("STEP", "");
        let chosen = ASKED.map(|asked| {
            let text = open.replace("ACCURACY", &format!("accuracy = {asked}"));
            let scene = Scene::from_toml(&text, ".")?;
            let problem = scene.problem()?;
            let ran = run(&problem)?;
            Ok::<_, Error>((scene, problem, ran))
        });
        let finest = chosen[2].as_ref().ok().map(|(_, problem, _)| limit(&text, problem));
        let Some(Ok(truth)) = finest else {
            println!("{seed}: {:?}", chosen[2].as_ref().err().map(ToString::to_string));
            continue;
        };
        for (k, (asked, chosen)) in ASKED.iter().zip(&chosen).enumerate() {
            let Ok((scene, problem, ran)) = chosen else { continue };
            let resolution = problem.resolution().expect("it was chosen");
            let (choosing, running) = (resolution.work, ran.work());
            let (error, time) = (apart(&ran.tips, &truth), problem.time()?);
            let own = (problem.segments() as f64, time.steps() as f64, time.end);
            let best = with_costs.then(|| cheapest(&text, *asked, &truth, own)).flatten();
            let cost = match &best {
                None => String::new(),
                Some(best) => {
                    let Fixed { segments, steps, scheme, ran } = best;
                    let fixed = with(&text, *segments, time.end / steps, scheme)?;
                    let by_time = time_over(scene, &fixed)?;
                    let by_work = (choosing + running) / ran.work();
                    costs[k].push([by_time, by_work]);
                    let name = scheme.split('"').nth(1).unwrap_or_default();
                    format!(
                        "; {by_time:.1} times the time and {by_work:.1} the work of {segments} edges, {steps} steps, {name}"
                    )
                }
            };
            println!(
                "{seed} {:7} {asked:.0e}: error {error:.1e} estimated {:.1e}{} by {} edges, {} steps, {}; choosing {:.1} \
                 runs{cost}",
                problem.model().0,
                resolution.error.unwrap_or(f64::NAN),
                if resolution.bound.is_some() { " (bound)" } else { "" },
                problem.segments(),
                time.steps(),
                time.scheme.name(),
                choosing / running,
            );
            if resolution.bound.is_none() {
                ratios[k].push(error / asked);
            }
        }
    }
    for ((asked, mut ratios), costs) in ASKED.iter().zip(ratios).zip(costs) {
        ratios.sort_by(f64::total_cmp);
        let good = ratios.iter().filter(|ratio| **ratio <= 1.0).count();
        let median = |k: usize| {
            let mut costs: Vec<f64> = costs.iter().map(|costs| costs[k]).collect();
            costs.sort_by(f64::total_cmp);
            costs.get(costs.len() / 2).copied()
        };
        let cost = median(0).zip(median(1)).map_or(String::new(), |(time, work)| {
            format!(
                "; in the median {time:.2} times the time and {work:.2} the work of the cheapest"
            )
        });
        println!(
            "asked {asked:.0e}: kept in {good} of {}, median error {:.2} of it{cost}",
            ratios.len(),
            ratios.get(ratios.len() / 2).unwrap_or(&f64::NAN),
        );
    }
    Ok(())
}

/// Errors at an accuracy, against four times as many edges and steps.
fn errors(
    scene: impl Fn(u64) -> String,
    asked: f64,
    seeds: std::ops::Range<u64>,
) -> Result<(), Error> {
    let (mut count, mut kept) = (seeds.end - seeds.start, 0);
    for seed in seeds {
        let text = scene(seed);
        let open = text.replace("ACCURACY", &format!("accuracy = {asked}"));
        let open = open.replace("SEGMENTS", "").replace("STEP", "");
        let problem = Scene::from_toml(&open, ".")?.problem()?;
        let (segments, time) = (problem.segments(), problem.time()?);
        let scheme = if time.scheme == Scheme::Rodas4 { SCHEMES[2] } else { SCHEMES[1] };
        let fine = run(&fixed(&text, 4 * segments, time.step / 4.0, scheme)?)?;
        let error = match run(&problem) {
            Ok(ran) => apart(&ran.tips, &fine.tips),
            Err(error) => {
                println!("{seed}: {error}");
                continue;
            }
        };
        let resolution = problem.resolution().expect("it was chosen");
        let says_so = resolution.bound.is_some();
        count -= u64::from(says_so);
        kept += u64::from(error <= asked && !says_so);
        println!(
            "{seed}: error {error:.1e} estimated {:.1e}{} by {segments} edges, {} steps, {}",
            resolution.error.unwrap_or(f64::NAN),
            if says_so { " (bound)" } else { "" },
            time.steps(),
            time.scheme.name(),
        );
    }
    println!("asked {asked:.0e}: kept in {kept} of {count}");
    Ok(())
}

/// Errors of the step alone, by scheme and steps.
fn schemes(seeds: std::ops::Range<u64>) -> Result<(), Error> {
    let others = [
        "scheme = \"generalised-alpha\"\nrho_inf = 0.5",
        "scheme = \"generalised-alpha\"\nrho_inf = 0",
    ];
    for seed in seeds {
        let text = scene(seed, false);
        let end = fixed(&text, 24, 1e-3, SCHEMES[0])?.time()?.end;
        let Ok(Ran { tips: truth, .. }) =
            fixed(&text, 24, end / 16000.0, SCHEMES[1]).and_then(|p| run(&p))
        else {
            continue;
        };
        println!("{seed}");
        for scheme in SCHEMES.iter().chain(&others) {
            print!("  {:44}", scheme.replace('\n', " "));
            for steps in [60.0, 125.0, 250.0, 500.0, 1000.0, 2000.0, 4000.0] {
                match fixed(&text, 24, end / steps, scheme).and_then(|problem| run(&problem)) {
                    Ok(ran) => print!(" {:.1e}", apart(&ran.tips, &truth)),
                    Err(_) => print!(" {:6}", "failed"),
                }
            }
            println!();
        }
    }
    Ok(())
}

fn main() -> Result<(), Error> {
    let mut words = std::env::args().skip(1).peekable();
    let of_schemes = words.next_if(|word| word == "schemes").is_some();
    let of_struck = words.next_if(|word| word == "struck").is_some();
    let of_tilted = words.next_if(|word| word == "tilted").is_some();
    let with_costs = words.next_if(|word| word == "costs").is_some();
    let mut number =
        |default: u64| words.next().and_then(|word| word.parse().ok()).unwrap_or(default);
    let (count, first) = (number(6), number(1));
    if of_schemes {
        schemes(first..first + count)
    } else if of_struck {
        errors(|seed| scene(seed, true), ASKED[0], first..first + count)
    } else if of_tilted {
        errors(tilted, ASKED[0], first..first + count)?;
        errors(tilted, ASKED[1], first..first + count)
    } else {
        accuracy(first..first + count, with_costs)
    }
}
