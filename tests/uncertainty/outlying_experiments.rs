//! One bad recording of many is reported as an outlier; bad ones in the majority are a fault of the common setup.

use rodfit::code::Code;
use rodfit::fit::{Experiment, Loss};
use rodfit::scene::Scene;
use rodfit::{Fit, FitReport, Observation, Parameter};

use crate::common::coarse;
use crate::common::fits::{noisy, observe, of_a_right_mesh, value};

const NOISE: f64 = 1e-3;
const MODULUS: Parameter = Parameter::YoungsModulus;

fn scene() -> Scene {
    let mut scene = coarse(12, 4e-3, 0.8);
    scene.loads.damping.mass = 0.5;
    scene
}

/// A recording of the rod, or of one that is twice as stiff.
fn recording(is_bad: bool, seed: u64) -> Observation {
    let mut other = scene();
    if is_bad {
        other.material.youngs_modulus *= 2.0;
    }
    noisy(&observe(&other, 80), NOISE, seed).sigma(NOISE).loss(Loss::Cauchy)
}

/// A fit of so many recordings, of which the last ones are bad, and of one as validation data.
fn solve(count: u64, bad: u64) -> FitReport {
    let problem = scene().problem().unwrap();
    let experiment = |k: u64| {
        let is_bad = k >= count - bad && k < count;
        let name = if is_bad { format!("bad {k}") } else { format!("clip {k}") };
        let observation = recording(is_bad, 40 + k);
        let observation = if k == count { observation.held_out() } else { observation };
        Experiment::new(&name, &problem).observe(observation)
    };
    let fit = Fit::of((0..=count).map(experiment)).identify(MODULUS);
    fit.analyse(of_a_right_mesh()).solve().unwrap()
}

#[test]
fn one_bad_recording_of_eight_is_reported_as_an_outlier() {
    let report = solve(8, 1);
    println!("{report}");
    // The modulus of the seven good recordings is 1e8 Pa.
    assert!((value(&report, MODULUS) / 1e8 - 1.0).abs() < 0.01, "{report}");
    assert!(report.warning_codes.contains(&Code::OutlyingExperiment), "{report}");
    assert!(!report.warning_codes.contains(&Code::LargeResiduals), "{report}");
    assert!(!report.verdict.contains("setup"), "{}", report.verdict);
    assert!(report.verdict.contains("bad 7 stands out"), "{}", report.verdict);
    let mut all = report.warnings.iter().zip(&report.warning_codes);
    let (outlying, _) = all.find(|(_, code)| **code == Code::OutlyingExperiment).unwrap();
    assert!(outlying.starts_with("bad 7"), "{outlying}");
    assert!(outlying.contains("the median of 8 experiments is"), "{outlying}");
}

#[test]
fn bad_recordings_in_the_majority_are_a_fault_of_the_set_up() {
    let report = solve(4, 2);
    println!("{report}");
    assert!(!report.warning_codes.contains(&Code::OutlyingExperiment), "{report}");
}

/// The RMS error of a right model is that of the noise.
#[test]
fn validation_error_follows_the_status() {
    let report = solve(8, 1);
    let text = report.to_string();
    let line = text.split("\n\n").nth(1).unwrap();
    assert!(line.starts_with("  Validation error "), "{text}");
    let mut words = line.split("RMS error ").nth(1).unwrap().split([' ', ',']);
    let value: f64 = words.next().unwrap().parse().unwrap();
    let unit = [("m", 1.0), ("mm", 1e-3), ("um", 1e-6)]
        .iter()
        .find(|unit| Some(unit.0) == words.clone().next());
    // The RMS error of the right model is the noise.
    assert!((value * unit.unwrap().1 / NOISE - 1.0).abs() < 0.2, "{line}");
}

#[test]
fn many_warnings_of_one_kind_are_summarized_in_one_line() {
    let report = solve(16, 6);
    println!("{report}");
    for code in &report.warning_codes {
        let lines = report.warning_codes.iter().filter(|other| *other == code).count();
        assert!(lines <= 2, "{lines} lines of {code}\n{report}");
    }
    assert!(report.warnings.iter().any(|w| w.contains("; 5 more ")), "{report}");
}
