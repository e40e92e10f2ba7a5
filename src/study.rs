//! Speed against error: which scheme, step and mesh a scene needs.
//!
//! The scene is run over schemes, meshes and steps (on every mesh until the step no longer
//! matters) and compared with the continuum: two runs that are finer than any of them, the last two
//! meshes at the finest step, extrapolated to edges of no length. Two more comparisons take the
//! error apart: with the finest step on the same mesh, and of that with the continuum. No known
//! answer is needed; what the reference itself is worth shows in how far it is from the nearest
//! other. A scene that comes with its mesh (forces on nodes by index) is studied on that mesh alone.

use crate::accuracy::{
    Extrapolation, Positions, largest_distance, largest_step, smooth_mesh_order,
};
use crate::dynamics::SimulationReport;
use crate::dynamics::Trajectory;
use crate::error::Error;
use crate::problem::Problem;
use crate::scene::Point;
use crate::scene::{Recorded, Scene, Scheme};
use crate::summary::quantity::{number, quantity};
use crate::summary::{Summary, SummaryTable, TextColumn, Tone};
use serde::{Deserialize, Serialize};

/// Steps over the scene's.
const STEPS: [f64; 6] = [4.0, 2.0, 1.0, 0.5, 0.25, 0.125];
/// Meshes over the scene's.
const MESHES: [f64; 5] = [0.25, 0.5, 1.0, 2.0, 4.0];
/// Steps of explicit schemes over the largest stable one.
const EXPLICIT_STEPS: [f64; 3] = [0.95, 0.5, 0.25];
/// The reference's mesh over the scene's.
const FINEST_MESH: f64 = 8.0;
/// The reference's step over the scene's, with the scheme of high order; and with the other, where
/// that one cannot take the damping or the motion of supports.
const FINEST_STEP: [(Scheme, f64); 2] = [(Scheme::Rodas4, 0.125), (Scheme::NewmarkBeta, 0.0625)];
/// A mesh is not stepped more finely once the step makes less than this part of what it makes.
const ENOUGH: f64 = 0.1;
/// Times at which tips are compared.
const SAMPLES: usize = 400;
/// Runs shorter than this, s, are timed again.
const SHORT: f64 = 0.05;
/// Significant digits of steps and times on the terminal.
const DIGITS: usize = 3;
/// The same in the table of all runs, whose columns must fit into 80.
const FEW_DIGITS: usize = 2;

/// One run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Row {
    /// The time integrator.
    pub scheme: Scheme,
    /// Parameter of the Newmark-beta scheme; 0.5 beside schemes that have none.
    pub beta: f64,
    /// Time step, s.
    pub step: f64,
    /// Number of edges.
    pub segments: usize,
    /// Largest distance of the tip from the continuum's, over the rod's length; absent when the run
    /// failed.
    pub error: Option<f64>,
    /// The part of `error` that the step makes: against the finest step on the same mesh.
    pub step_error: Option<f64>,
    /// The part of `error` that the mesh makes: of the finest step on this mesh.
    pub mesh_error: f64,
    /// Wall time of the stepping, s, the shortest of up to three runs.
    pub wall_seconds: f64,
    /// Newton iterations of all steps.
    pub newton_iterations: usize,
    /// Largest change of the energy over the largest kinetic energy.
    pub energy_drift: f64,
    /// `completed`, or what stopped the run.
    pub status: String,
}

/// The cheapest row for an error.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Advice {
    /// Error of the tip that is wanted, over the length.
    pub error: f64,
    /// Index of the row; absent when no row is that good.
    pub row: Option<usize>,
}

/// A work-precision study.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Study {
    /// All runs, in the order of schemes, meshes and steps.
    pub rows: Vec<Row>,
    /// How far the reference is from the nearest other run, over the length: errors below are
    /// indistinguishable from its own.
    pub reference_error: f64,
    /// What to use for smaller and smaller errors.
    pub advice: Vec<Advice>,
}

/// The limit of two meshes.
fn continuum(coarse: &(usize, Positions), fine: &(usize, Positions), scene: &Scene) -> Positions {
    let ratio = fine.0 as f64 / coarse.0 as f64;
    let beyond = Extrapolation { ratio, order: smooth_mesh_order(scene) }.error_after();
    let limit = |(coarse, fine): (&[f64; 3], &[f64; 3])| {
        std::array::from_fn(|c| fine[c] + beyond * (fine[c] - coarse[c]))
    };
    coarse.1.iter().zip(&fine.1).map(limit).collect()
}

impl Study {
    /// Runs the study; `progress` is told how many of how many runs are done.
    ///
    /// # Errors
    ///
    /// A scene that is not valid or has no `[time]`, or a reference run that fails.
    pub fn new(scene: &Scene, mut progress: impl FnMut(usize, usize)) -> Result<Self, Error> {
        let problem = scene.problem()?;
        // With mesh and step where it leaves them open.
        let scene = problem.scene();
        let time = problem.time()?.clone();
        let length = problem.length();
        let fixed = scene.mesh_is_given();
        let meshes: Vec<usize> = match fixed {
            true => vec![problem.segments()],
            false => {
                // Markers stand at nodes.
                let spans = scene.supports.path.as_ref().map_or(1, Recorded::spans);
                let parts = problem.segments() as f64 / spans as f64;
                let mesh = |factor: &f64| {
                    ((parts * factor).round() as usize).max(if spans == 1 { 2 } else { 1 }) * spans
                };
                let mut meshes: Vec<usize> = MESHES.iter().map(mesh).collect();
                meshes.dedup();
                meshes
            }
        };
        let mut schemes: Vec<(Scheme, f64)> =
            Scheme::all().filter(|s| scene.is_taken_by(*s)).map(|s| (s, 0.5)).collect();
        if time.scheme.takes_beta() && time.beta > 0.5 {
            schemes.push((time.scheme, time.beta));
        }
        let steps_of = |scheme: Scheme| match scheme.traits().stability_limit {
            Some(_) => &EXPLICIT_STEPS[..],
            None => &STEPS[..],
        };
        let steps: usize = schemes.iter().map(|s| steps_of(s.0).len()).sum();
        let total = meshes.len() * (steps + 1) + usize::from(!fixed);
        let mut done = 0;
        let mut tick = || {
            done += 1;
            progress(done, total);
        };
        let at = |scheme: (Scheme, f64), step: f64, segments: usize| -> Result<Problem, Error> {
            let mut scene = scene.clone();
            if !fixed {
                scene.rod.segments = Some(segments);
            }
            if let Some(time) = &mut scene.time {
                (time.scheme, time.beta, time.step) = (scheme.0, scheme.1, Some(step));
            }
            scene.build()
        };

        // The finest step on every mesh, and on a finer one than any.
        let (finest_scheme, finest_step) =
            FINEST_STEP[usize::from(!scene.is_taken_by(FINEST_STEP[0].0))];
        let finest_step = time.step_size() * finest_step;
        let mut fine: Vec<(usize, Positions)> = Vec::new();
        let finest_mesh = (problem.segments() as f64 * FINEST_MESH).round() as usize;
        let extra = (!fixed).then_some(finest_mesh);
        for segments in meshes.iter().copied().chain(extra) {
            let run = Run::new(&at((finest_scheme, 0.5), finest_step, segments)?)?;
            fine.push((segments, run.outcome?));
            tick();
        }
        let reference = &match &fine[..] {
            [.., coarse, fine] => continuum(coarse, fine, scene),
            [(_, tips), ..] => tips.clone(),
            [] => unreachable!("a mesh at least"),
        };
        let mut rows = Vec::new();
        // Meshes on which the largest stable step is enough for an explicit scheme of low order.
        let mut settled = Vec::new();
        for scheme in schemes {
            for (segments, same_mesh) in &fine[..meshes.len()] {
                let of_mesh = largest_distance(same_mesh, reference) / length;
                let largest = largest_step(&at(scheme, time.step_size(), *segments)?)?;
                let mut enough =
                    scheme.0.traits().stability_limit.is_some() && settled.contains(segments);
                for (k, part) in steps_of(scheme.0).iter().enumerate() {
                    let step = part * largest.unwrap_or(time.step_size());
                    tick();
                    if enough {
                        continue;
                    }
                    let run = Run::new(&at(scheme, step, *segments)?)?;
                    let tips = run.outcome.as_ref().ok();
                    let part =
                        |to: &Positions| tips.map(|tips| largest_distance(tips, to) / length);
                    let step_error = part(same_mesh);
                    enough = step_error.is_some_and(|e| e < ENOUGH * of_mesh);
                    if enough && k == 0 && scheme.0.traits().stability_limit.is_some() {
                        settled.push(*segments);
                    }
                    let status = match &run.outcome {
                        Ok(_) => "completed".into(),
                        Err(error) => format!("stopped: {error}"),
                    };
                    rows.push(Row {
                        scheme: scheme.0,
                        beta: scheme.1,
                        step,
                        segments: *segments,
                        error: part(reference),
                        step_error,
                        mesh_error: of_mesh,
                        wall_seconds: run.seconds,
                        newton_iterations: run.newton_iterations,
                        energy_drift: run.energy_drift,
                        status,
                    });
                }
            }
        }
        let next = rows.iter().filter_map(|r| r.error).fold(f64::INFINITY, f64::min);
        let advice = (1..=6)
            .map(|k| {
                let error = 10f64.powi(-k);
                let good = |i: &usize| rows[*i].error.is_some_and(|e| e <= error);
                let row = (0..rows.len())
                    .filter(good)
                    .min_by(|a, b| rows[*a].wall_seconds.total_cmp(&rows[*b].wall_seconds));
                Advice { error, row }
            })
            .collect();
        Ok(Self { rows, reference_error: next, advice })
    }

    /// One line a target.
    pub fn advice_lines(&self) -> Vec<String> {
        let line = |a: &Advice| match a.row.map(|i| &self.rows[i]) {
            Some(row) => format!(
                "for a tip error of {:.0e} of the length use {}, a step of {:.4e} s and {} segments: \
                 it takes {:.2e} s",
                a.error,
                name(row),
                row.step,
                row.segments,
                row.wall_seconds
            ),
            None => {
                format!("a tip error of {:.0e} of the length needs finer runs than these", a.error)
            }
        };
        self.advice.iter().map(line).collect()
    }
}

/// A row's scheme in words.
pub fn name(row: &Row) -> String {
    match row.scheme.takes_beta() {
        true => format!("{} {}", row.scheme.name(), row.beta),
        false => row.scheme.name().into(),
    }
}

/// A run and what it cost.
struct Run {
    outcome: Result<Positions, Error>,
    seconds: f64,
    newton_iterations: usize,
    energy_drift: f64,
}

impl Run {
    fn new(problem: &Problem) -> Result<Self, Error> {
        let time = problem.time()?;
        let tip: Vec<usize> = problem.tip().nodes.iter().map(|(node, _)| *node).collect();
        let mut report = SimulationReport::new(problem);
        let mut trajectory = Trajectory::new(problem, &tip, &[])?;
        let outcome =
            trajectory.run(problem, time.steps(), |now| report.push(problem, now)).and_then(|()| {
                let at = |k: usize| time.end * k as f64 / SAMPLES as f64;
                (1..=SAMPLES).map(|k| Ok(trajectory.at(Point::Tip, at(k))?.0)).collect()
            });
        let mut seconds = trajectory.stepping().as_secs_f64();
        for _ in 0..2 {
            if outcome.is_ok() && seconds < SHORT {
                let mut again = Trajectory::new(problem, &tip, &[])?;
                again.run(problem, time.steps(), |_| {})?;
                seconds = seconds.min(again.stepping().as_secs_f64());
            }
        }
        Ok(Self {
            outcome,
            seconds,
            newton_iterations: trajectory.work().newton_iterations,
            energy_drift: report.energy_drift(),
        })
    }
}

impl std::fmt::Display for Study {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        self.summary().fmt(f)
    }
}

impl Study {
    /// The result as text for a terminal.
    pub fn summary(&self) -> Summary {
        let status = format!(
            "{} runs; error of the reference at most {} of the length",
            self.rows.len(),
            percent(self.reference_error)
        );
        let mut fastest = SummaryTable::new([
            TextColumn::left("tip error"),
            TextColumn::left("scheme"),
            TextColumn::right("step"),
            TextColumn::right("segments"),
            TextColumn::right("time"),
        ]);
        for Advice { error, row } in &self.advice {
            let limit = format!("{} of the length", percent(*error));
            match row.map(|i| &self.rows[i]) {
                Some(row) => fastest.row([
                    limit,
                    name(row),
                    quantity(row.step, "s", DIGITS),
                    row.segments.to_string(),
                    quantity(row.wall_seconds, "s", DIGITS),
                ]),
                None => fastest.row([limit, "finer than all runs".into()]),
            }
        }
        let mut runs = SummaryTable::new([
            TextColumn::left("scheme"),
            TextColumn::right("step"),
            TextColumn::right("mesh"),
            TextColumn::right("error"),
            TextColumn::right("(step)"),
            TextColumn::right("(mesh)"),
            TextColumn::right("time"),
            TextColumn::right("energy"),
        ]);
        let size = |x: Option<f64>| x.map_or("failed".into(), |x| format!("{x:.1e}"));
        for row in &self.rows {
            runs.row([
                name(row),
                quantity(row.step, "s", FEW_DIGITS),
                row.segments.to_string(),
                size(row.error),
                size(row.step_error),
                size(Some(row.mesh_error)),
                quantity(row.wall_seconds, "s", FEW_DIGITS),
                format!("{:.1e}", row.energy_drift),
            ]);
        }
        let title = "All runs: step, segments, error of the tip over the length (total, by the step, by the mesh), \
                     computing time, change of the energy over the largest kinetic energy";
        Summary::new(status, Tone::Neutral)
            .table("Fastest run for a tip error", fastest)
            .warnings(Vec::<String>::new())
            .table(title, runs)
    }
}

/// A fraction in per cent.
fn percent(fraction: f64) -> String {
    format!("{} %", number(100.0 * fraction, 2))
}
