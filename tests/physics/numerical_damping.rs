//! Loss of energy by a scheme in a rod without damping is reported, with its size.

use rodfit::Code;
use rodfit::dynamics::SimulationReport;
use rodfit::scene::{Scene, Scheme, Time};

use crate::common::cantilever;

/// A cantilever without weight that starts with a small velocity, in steps of so many periods of its first mode.
fn struck(periods: f64, scheme: Scheme) -> Scene {
    let mut scene = cantilever();
    scene.rod.segments = Some(10);
    scene.loads.gravity = [0.0; 3];
    scene.initial.velocity = [0.0, 1e-3, 0.0];
    // omega_1 = 1.875^2/L^2 sqrt(E r^2/(4 rho)).
    let omega = 1.8751_f64.powi(2) / 0.25 * (1e8 * 0.005_f64.powi(2) / (4.0 * 1273.52)).sqrt();
    let step = periods * std::f64::consts::TAU / omega;
    scene.time = Some(Time { scheme, ..Time::new(20.0 * step, step) });
    scene
}

/// Runs a scene and returns its report; the run must succeed.
fn run(scene: &Scene) -> SimulationReport {
    let (report, outcome) = crate::energy::run(scene);
    outcome.unwrap();
    report
}

/// Rodas4 is L-stable: in steps of ten periods all modes decay, and 100 % of the initial kinetic energy is lost.
#[test]
fn energy_lost_by_rodas4_is_reported() {
    let report = run(&struck(10.0, Scheme::Rodas4));
    assert!((report.energy_drift() - 1.0).abs() < 0.01, "{}", report.energy_drift());
    assert_eq!(report.warning_codes, [Code::NumericalDamping]);
    assert!(report.warnings[0].contains("100 %"), "{:?}", report.warnings);
    assert!(!report.energy_in_words().contains("conserved"), "{}", report.energy_in_words());
}

/// The trapezoidal rule keeps the energy of a linear vibration at every step, also where steps of a period do not
/// resolve it.
#[test]
fn energy_kept_is_not_reported() {
    for scheme in [Scheme::NewmarkBeta, Scheme::AverageVectorField] {
        let report = run(&struck(1.0, scheme));
        assert_eq!(report.warning_codes, [Code::CoarseStep], "{:?}", report.warnings);
        assert!(report.energy_in_words().starts_with("energy conserved within "));
    }
}

/// Implicit Euler with steps of ten periods ends at the equilibrium. It dissipates the work of the weight, twice the
/// elastic energy, which is far above the kinetic energy of the motion.
#[test]
fn energy_lost_beyond_the_kinetic_energy_is_reported_for_dissipative_schemes() {
    let mut scene = struck(10.0, Scheme::NewmarkBeta);
    scene.time.as_mut().unwrap().beta = 1.0;
    scene.initial.velocity = [0.0; 3];
    scene.loads.gravity = [0.0, -0.98, 0.0];
    let report = run(&scene);
    assert!(report.energy_drift() > 2.0, "{}", report.energy_drift());
    let expected = [Code::NumericalDamping, Code::CoarseStep];
    assert_eq!(report.warning_codes, expected, "{:?}", report.warnings);
}

/// A step beyond the end is taken as one step, with a warning.
#[test]
fn step_beyond_the_end_is_reported() {
    let mut scene = cantilever();
    for (step, end, expected) in [(0.3, 0.1, true), (0.1, 0.1, false), (0.1 + 1e-16, 0.1, false)] {
        scene.time = Some(Time::new(end, step));
        let problem = scene.problem().unwrap();
        let found = problem.warnings().iter().any(|words| words.contains("[step-beyond-end]"));
        assert_eq!((found, problem.time().unwrap().steps()), (expected, 1), "{step}");
    }
}
