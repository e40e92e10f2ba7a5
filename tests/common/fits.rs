//! Shared parts of fit tests: records of simulated motions with and without noise, fits to them, and comparisons with the
//! truth.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};
use rodfit::fit::{Analysis, Refinement, Sample};
use rodfit::scene::Scene;
use rodfit::{Fit, FitReport, Observation, Parameter, Point, Trajectory, Unknown};
use std::path::Path;

use crate::common::simulate;

/// The tip's positions in the xy plane at `count` times evenly spread to the end, without noise.
pub fn record(trajectory: &Trajectory, count: usize) -> Observation {
    let mut seen = record_in_space(trajectory, count);
    seen.samples.iter_mut().for_each(|sample| sample.position[2] = None);
    seen
}

/// The tip's positions with all coordinates.
pub fn record_in_space(trajectory: &Trajectory, count: usize) -> Observation {
    let end = trajectory.times()[trajectory.times().len() - 1];
    let sample = |k: usize| {
        let time = end * k as f64 / count as f64;
        Sample { time, position: trajectory.at(Point::Tip, time).unwrap().0.map(Some) }
    };
    Observation::new((1..=count).map(sample).collect())
}

/// The record of a scene's motion.
pub fn observe(scene: &Scene, count: usize) -> Observation {
    record(&simulate(scene), count)
}

/// Normal noise on every coordinate.
pub fn add_noise(observation: &mut Observation, sigma: f64, seed: u64) {
    let (mut random, noise) = (ChaCha8Rng::seed_from_u64(seed), Normal::new(0.0, sigma).unwrap());
    for x in observation.samples.iter_mut().flat_map(|s| s.position.iter_mut()).flatten() {
        *x += noise.sample(&mut random);
    }
}

/// The same record with noise.
pub fn noisy(clean: &Observation, sigma: f64, seed: u64) -> Observation {
    let mut data = clean.clone();
    add_noise(&mut data, sigma, seed);
    data
}

/// Writes a scene as `scene.toml` and the positions of a record in its plane as `tip.csv` into a folder.
pub fn write_scene_and_record(folder: &Path, scene: &Scene, data: &Observation) {
    std::fs::write(folder.join("scene.toml"), scene.to_toml().unwrap()).unwrap();
    let row =
        |s: &Sample| format!("{},{},{}\n", s.time, s.position[0].unwrap(), s.position[1].unwrap());
    let rows: String = data.samples.iter().map(row).collect();
    std::fs::write(folder.join("tip.csv"), format!("t,x,y\n{rows}")).unwrap();
}

/// Analysis for data from the scene's own mesh and step: no discretization error and no sensitivity analysis.
pub fn same_mesh() -> Analysis {
    Analysis { sensitivity_analysis: Some(false), ..of_a_right_mesh() }
}

/// Analysis for data from the scene's own mesh and step: no discretization error, but a sensitivity analysis.
pub fn of_a_right_mesh() -> Analysis {
    Analysis {
        discretization_error: Refinement::None,
        sensitivity_analysis: Some(true),
        ..Analysis::default()
    }
}

/// A fit of a scene to one record.
pub fn fit<U: Into<Unknown> + Clone>(
    scene: &Scene,
    data: &Observation,
    unknowns: &[U],
) -> FitReport {
    fit_with(scene, data, unknowns, Analysis::default())
}

/// Fits these unknowns of a scene to one observation.
pub fn fit_with<U: Into<Unknown> + Clone>(
    scene: &Scene,
    data: &Observation,
    unknowns: &[U],
    analysis: Analysis,
) -> FitReport {
    let fit = Fit::new(&scene.problem().unwrap()).observe(data.clone()).analyse(analysis);
    unknowns.iter().fold(fit, |fit, unknown| fit.identify(unknown.clone())).solve().unwrap()
}

/// The estimate of a parameter; panics with the report if there is none.
pub fn value(report: &FitReport, parameter: Parameter) -> f64 {
    report.estimate(parameter).unwrap().value.unwrap_or_else(|| panic!("{report}"))
}

/// A fit that succeeded, and by how much the parameter is off, of its size.
#[track_caller]
pub fn error(report: &FitReport, parameter: Parameter, truth: f64) -> f64 {
    assert!(report.is_success(), "{report}");
    (value(report, parameter) / truth - 1.0).abs()
}

/// A fit that succeeded, and found these values to a part of them.
#[track_caller]
pub fn found(report: &FitReport, truths: &[(Parameter, f64)], part: f64) {
    for (parameter, truth) in truths {
        let error = error(report, *parameter, *truth);
        assert!(error < part, "{parameter}: off by {error:e}\n{report}");
    }
}

/// Whether the 95 % interval by the standard error contains the truth.
pub fn covers(report: &FitReport, parameter: Parameter, truth: f64) -> bool {
    let [low, high] = report.estimate(parameter).unwrap().interval95.unwrap();
    low <= truth && truth <= high
}

/// Mean and standard deviation.
pub fn mean_and_spread(values: &[f64]) -> [f64; 2] {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let square = values.iter().map(|x| (x - mean).powi(2)).sum::<f64>();
    [mean, (square / (n - 1.0)).sqrt()]
}

/// Prints the cost of fits, in simulations, and the largest error.
pub fn print_work(worst: f64, mut work: Vec<f64>) {
    work.sort_by(f64::total_cmp);
    let (median, most) = (work[work.len() / 2], work[work.len() - 1]);
    println!("worst error {worst:.1e}; simulations: median {median:.1}, most {most:.1}");
}
