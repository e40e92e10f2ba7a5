//! Interrupted fits and simulations, whose flag is set at a stage: the best values or steps so far remain, and unfinished
//! analyses are not reported.

use rodfit::fit::Analysis;
use rodfit::page::fit_page;
use rodfit::{Error, Fit, FitReport, Parameter, Point, Problem, Trajectory};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};

use crate::common::coarse;
use crate::report::disturbed;

fn problem() -> Problem {
    coarse(8, 4e-3, 0.4).problem().unwrap()
}

/// A fit of the modulus, stopped as soon as the stage in its progress contains `word`; from the start if it is empty.
fn stopped_at(word: &'static str) -> Result<FitReport, Error> {
    stopped_with(word, 0)
}

/// The same with replicates of a bootstrap.
fn stopped_with(word: &'static str, bootstrap: usize) -> Result<FitReport, Error> {
    let problem = problem();
    let run = problem.simulate().unwrap();
    let flag = Arc::new(AtomicBool::new(word.is_empty()));
    let set = flag.clone();
    Fit::new(&problem)
        .observe(disturbed(&run, Point::Tip, 20, 1e-3))
        .identify(Parameter::YoungsModulus)
        .analyse(Analysis { profile: true, bootstrap, ..Analysis::default() })
        .keep_plot_data()
        .stop_when(flag)
        .on_progress(move |stage, _| {
            if stage.contains(word) {
                set.store(true, Ordering::Relaxed);
            }
        })
        .solve()
}

/// Requires an interrupted report: values without errors, and no claim of convergence.
fn is_unfinished(report: &FitReport) {
    assert!(report.interrupted && !report.converged && !report.is_success());
    assert_eq!(report.status, "interrupted");
    assert!(report.verdict.contains("not a result"), "{}", report.verdict);
    let estimate = &report.parameters[0];
    assert!(estimate.value.is_some() && estimate.std_error.is_none());
    assert!(estimate.interval95.is_none() && estimate.profile95.is_none());
    assert!(report.residual_rms.is_finite() && report.simulations > 0.0);
    let json = serde_json::to_value(report).unwrap();
    assert_eq!((&json["interrupted"], &json["converged"]), (&true.into(), &false.into()));
    assert!(report.to_string().contains("interrupted"));
    assert!(fit_page(report, "stopped").contains("interrupted"));
}

#[test]
fn stopped_search_reports_its_best_values() {
    let whole = stopped_at("never").unwrap();
    assert!(whole.is_success() && !whole.interrupted);
    let best = whole.parameters[0].value.unwrap();
    // In the scan: a candidate, within its grid of the truth or anywhere before that. Progress is
    // reported, and so the flag set, after 16 of its 31 points, which take 7.8 of all 35 simulations.
    let scan = stopped_at("scan").unwrap();
    is_unfinished(&scan);
    assert!(scan.verdict.contains("scan") && scan.simulations < 0.25 * whole.simulations);
    // On the full model: all but there.
    let iterating = stopped_at("iteration 1,").unwrap();
    is_unfinished(&iterating);
    let coarse = stopped_at("coarse model").unwrap();
    is_unfinished(&coarse);
    for report in [&iterating, &coarse] {
        let value = report.parameters[0].value.unwrap();
        // The values are near the optimum, though not converged.
        assert!((value / best - 1.0).abs() < 0.1, "{value:e} {best:e}");
        assert!(report.simulations < whole.simulations);
    }
}

/// Results found before the stop are kept; unfinished ones (the profile) are absent.
#[test]
fn stopped_analysis_keeps_the_estimates() {
    let report = stopped_at("profile of").unwrap();
    assert!(report.converged && report.interrupted && !report.is_success());
    assert!(report.status.contains("interrupted"), "{}", report.status);
    let estimate = &report.parameters[0];
    assert!(estimate.std_error.is_some() && estimate.profile95.is_none());
    assert!(fit_page(&report, "stopped").contains("class=\"verdict bad\""));
}

/// Of a million replicates, 16 are done.
#[test]
fn stopped_bootstrap_is_not_reported() {
    let report = stopped_with("bootstrap", 1_000_000).unwrap();
    assert!(report.converged && report.interrupted, "{report}");
    assert!(report.warnings.iter().all(|warning| !warning.contains("bootstrap")), "{report}");
    let estimate = &report.parameters[0];
    assert!(estimate.profile95.is_some() && estimate.bootstrap.is_none());
}

/// A stop in any stage after the first simulation returns the best values, also between two meshes or two estimates of
/// the noise, and in the analyses after the search. Here the fit chooses the mesh, and estimates the noise on each.
#[test]
fn stop_in_any_stage_keeps_the_best_values() {
    let mut scene = coarse(8, 4e-3, 0.4);
    scene.rod.segments = None;
    scene.time.as_mut().unwrap().step = None;
    let problem = scene.problem().unwrap();
    let data = disturbed(&problem.simulate().unwrap(), Point::Tip, 20, 1e-3);
    let solve = |stop_at: usize| {
        let stages = Arc::new(Mutex::new(Vec::new()));
        let (flag, seen) = (Arc::new(AtomicBool::new(false)), stages.clone());
        let set = flag.clone();
        let fit = Fit::new(&problem).observe(data.clone()).identify(Parameter::YoungsModulus);
        let report = fit.stop_when(flag).on_progress(move |stage, _| {
            let mut seen = seen.lock().unwrap();
            seen.push(stage.to_string());
            set.store(seen.len() > stop_at, Ordering::Relaxed);
        });
        let report = report.solve();
        let stages = stages.lock().unwrap().clone();
        (report, stages)
    };
    let (whole, stages) = solve(usize::MAX);
    assert!(whole.unwrap().is_success() && stages.len() > 8, "{stages:?}");
    for (number, stage) in stages.iter().enumerate() {
        let report = solve(number).0.unwrap_or_else(|error| panic!("stopped at {stage}: {error}"));
        let value = report.parameters[0].value.unwrap();
        assert!(report.interrupted && (1e7..1e9).contains(&value), "stopped at {stage}: {report}");
    }
}

#[test]
fn stop_before_the_first_value_is_an_error() {
    let error = stopped_at("").unwrap_err();
    assert!(matches!(error, Error::Interrupted) && !error.is_input());
}

/// A simulation stops at the next step, and keeps those before.
#[test]
fn stopped_simulation_keeps_its_steps() {
    let flag = Arc::new(AtomicBool::new(false));
    let problem = problem().stop_when(flag.clone());
    let mut trajectory = Trajectory::new(&problem, &[8], &[]).unwrap();
    let mut seen = 0;
    let outcome = trajectory.run(&problem, 100, |_| {
        seen += 1;
        flag.store(seen == 11, Ordering::Relaxed);
    });
    assert!(matches!(outcome, Err(Error::Interrupted)));
    assert_eq!((seen, trajectory.times().len(), trajectory.work().steps), (11, 11, 10));
    // Problems made from it stop too.
    let stiffer = problem.with([(Parameter::YoungsModulus, 2e8)]).unwrap();
    assert!(matches!(stiffer.simulate(), Err(Error::Interrupted)));
    assert!(matches!(stiffer.equilibrium(), Err(Error::Interrupted)));
}
