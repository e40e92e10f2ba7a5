//! `rodfit bench`

use crate::command::output::Outputs;
use crate::command::{Json, Manner, conclude};
use rodfit::fit::Sample;
use rodfit::numerics::simd::simd_level;
use rodfit::summary::{Summary, SummaryTable, TextColumn, Tone};
use rodfit::{Error, Fit, Observation, Parameter, Point, Problem, Scene, Trajectory};
use serde::Serialize;
use std::time::{Duration, Instant};

#[derive(clap::Args)]
pub struct Options {
    /// Time for which each row is repeated, s; the fastest run counts.
    #[arg(long, default_value_t = 0.3, value_parser = not_negative)]
    seconds: f64,
    #[command(flatten)]
    json: Json,
}

fn not_negative(text: &str) -> Result<f64, String> {
    let seconds: f64 = text.parse().map_err(|_| format!("{text} is not a number"))?;
    match (0.0..=1e3).contains(&seconds) {
        true => Ok(seconds),
        false => Err("it must be between 0 and 1000".into()),
    }
}

/// A scene as it is shipped, with the record of its tip.
struct Shipped {
    name: &'static str,
    scene: &'static str,
    tip: &'static str,
}

const CANTILEVER: Shipped = Shipped {
    name: "cantilever",
    scene: include_str!("../../data/cantilever.toml"),
    tip: include_str!("../../data/cantilever-tip.csv"),
};
const HELIX: Shipped = Shipped {
    name: "helix",
    scene: include_str!("../../data/helix.toml"),
    tip: include_str!("../../data/helix-tip.csv"),
};

/// What was simulated: scene, step in s, and the scheme's parameter.
const RUNS: [(Shipped, f64, f64); 4] =
    [(CANTILEVER, 1e-3, 0.5), (CANTILEVER, 5e-3, 1.0), (HELIX, 1e-3, 0.5), (HELIX, 5e-3, 0.5)];

/// How fast steps are.
#[derive(Serialize)]
struct Stepping {
    scene: &'static str,
    segments: usize,
    /// s.
    step: f64,
    beta: f64,
    steps_per_second: f64,
}

/// How long a fit takes, s.
#[derive(Serialize)]
struct Fitting {
    scene: &'static str,
    seconds: f64,
}

#[derive(Serialize)]
struct Report {
    version: &'static str,
    vector_unit: &'static str,
    threads: usize,
    steps: Vec<Stepping>,
    fits: Vec<Fitting>,
}

pub fn run(options: &Options, manner: Manner) -> Result<u8, Error> {
    let mut outputs = Outputs::new(manner);
    let (option, path) = options.json.output();
    let json = outputs.add(option, path);
    outputs.check(&[])?;
    let least = Duration::from_secs_f64(options.seconds);
    let mut steps = Vec::new();
    for (shipped, step, beta) in RUNS {
        let problem = shipped.problem(step, beta)?;
        let all = problem.time()?.steps();
        let fastest = fastest(least, || {
            let mut trajectory = Trajectory::unrecorded(&problem)?;
            trajectory.run(&problem, all, |_| {})?;
            Ok(trajectory.stepping())
        })?;
        let (scene, segments) = (shipped.name, problem.segments());
        let steps_per_second = all as f64 / fastest.as_secs_f64();
        steps.push(Stepping { scene, segments, step, beta, steps_per_second });
    }
    let mut fits = Vec::new();
    for shipped in [CANTILEVER, HELIX] {
        let problem = shipped.problem(1e-3, 0.5)?;
        let fit =
            Fit::new(&problem).observe(shipped.observation()).identify(Parameter::YoungsModulus);
        let fastest = fastest(least, || {
            let begun = Instant::now();
            fit.solve()?;
            Ok(begun.elapsed())
        })?;
        fits.push(Fitting { scene: shipped.name, seconds: fastest.as_secs_f64() });
    }
    let report = Report {
        version: env!("CARGO_PKG_VERSION"),
        vector_unit: simd_level(),
        threads: rayon::current_num_threads(),
        steps,
        fits,
    };
    Ok(conclude(0, [outputs.write_json(json, &report), outputs.summary(&report.summary())]))
}

/// The shortest of the times that repetitions take, which go on for at least so long.
fn fastest(
    least: Duration,
    mut once: impl FnMut() -> Result<Duration, Error>,
) -> Result<Duration, Error> {
    let begun = Instant::now();
    let mut fastest = once()?;
    while begun.elapsed() < least {
        fastest = fastest.min(once()?);
    }
    Ok(fastest)
}

impl Shipped {
    fn problem(&self, step: f64, beta: f64) -> Result<Problem, Error> {
        let mut scene = Scene::from_toml(self.scene, ".")?;
        if let Some(time) = &mut scene.time {
            (time.step, time.beta) = (Some(step), beta);
        }
        scene.problem()
    }

    /// The tip as it was recorded: a time and two or three coordinates a line, under one of titles.
    fn observation(&self) -> Observation {
        let line = |line: &str| {
            let mut numbers = line.split(',').map(|number| number.trim().parse().ok());
            let time = numbers.next()??;
            let mut position = [None; 3];
            position.iter_mut().zip(numbers).for_each(|(to, number)| *to = number);
            Some(Sample { time, position })
        };
        Observation::new(self.tip.lines().filter_map(line).collect()).at(Point::Tip)
    }
}

impl Report {
    /// The result as text for a terminal.
    fn summary(&self) -> Summary {
        let Self { version, vector_unit, threads, .. } = self;
        let mut steps = SummaryTable::new([
            TextColumn::left("scene"),
            TextColumn::right("segments"),
            TextColumn::right("step"),
            TextColumn::right("beta"),
            TextColumn::right("steps per second"),
        ]);
        for Stepping { scene, segments, step, beta, steps_per_second } in &self.steps {
            steps.row([
                scene.to_string(),
                segments.to_string(),
                format!("{} ms", step * 1e3),
                format!("{beta:.1}"),
                format!("{steps_per_second:.0}"),
            ]);
        }
        let mut fits = SummaryTable::new([TextColumn::left("scene"), TextColumn::right("time")]);
        for Fitting { scene, seconds } in &self.fits {
            fits.row([scene.to_string(), format!("{seconds:.3} s")]);
        }
        let status =
            format!("rodfit {version}, vector unit {vector_unit}, fits on {threads} threads");
        Summary::new(status, Tone::Neutral)
            .table("Simulation", steps)
            .table("Fit of Young's modulus", fits)
    }
}
