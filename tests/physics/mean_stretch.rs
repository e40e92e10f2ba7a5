//! Pendulums with the average vector field, whose edges rotate within a step.

use rodfit::dynamics::SimulationReport;
use rodfit::{Scene, Trajectory};

const LENGTH: f64 = 0.5;

/// The report of a pendulum that is released in horizontal position, and its tip after 0.3 s.
fn pendulum(modulus: f64, scheme: &str, step: f64) -> (SimulationReport, [f64; 3]) {
    let text = format!(
        "[rod]\nsegments = 20\nshape = {{ kind = \"straight\", length = {LENGTH}, direction = [1, 0, 0] }}\n\
         section = {{ kind = \"circle\", radius = 0.005 }}\n\
         [material]\ndensity = 1000\nyoungs_modulus = {modulus:e}\n\
         [supports]\nstart = \"pinned\"\n[loads]\ngravity = [0, -9.81, 0]\n\
         [time]\nend = 0.3\nstep = {step:e}\nscheme = \"{scheme}\"\n"
    );
    let problem = Scene::from_toml(&text, ".").unwrap().problem().unwrap();
    let mut report = SimulationReport::new(&problem);
    let mut run = Trajectory::new(&problem, &[20], &[]).unwrap();
    let steps = problem.time().unwrap().steps();
    let outcome = run.run(&problem, steps, |state| report.push(&problem, state));
    report.finish(&run, &outcome);
    (report, run.tip(steps))
}

/// Distance of two tips over the length.
fn off(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|c| (a[c] - b[c]).powi(2)).sum::<f64>().sqrt() / LENGTH
}

/// The energy is conserved, and the motion of a stiff pendulum is too slow. The warning has a step without it.
#[test]
fn stretching_of_mean_states_slows_stiff_pendulums() {
    for (modulus, most, warned) in
        [(1e8, 5e-3, false), (1e10, 0.03, true), (1e11, 0.2, true), (1e14, 2.0, true)]
    {
        let (_, exact) = pendulum(modulus, "newmark-beta", 5e-4);
        let (report, tip) = pendulum(modulus, "average-vector-field", 5e-3);
        let found = report.warnings.iter().find(|text| text.contains("[mean-stretch]"));
        println!("{modulus:e}: off by {:.4} of the length, {found:?}", off(tip, exact));
        assert!(off(tip, exact) < most, "{modulus:e}");
        assert_eq!(found.is_some(), warned, "{modulus:e}: {:?}", report.warnings);
        let Some(found) = found else { continue };
        assert!(off(tip, exact) > 5e-3, "{modulus:e}");
        let Some((_, words)) = found.split_once("at most ") else { continue };
        let step = words.split(' ').next().unwrap();
        let (report, tip) = pendulum(modulus, "average-vector-field", step.parse().unwrap());
        println!("  with steps of {step} s: off by {:.4}, {:?}", off(tip, exact), report.warnings);
        assert!(off(tip, exact) < 5e-3 && report.warnings.is_empty(), "{modulus:e}");
    }
}
