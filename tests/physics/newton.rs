//! Newton's method in a time step: number of tangents and corrections, and its error in the motion.

use nalgebra::Vector3;
use rodfit::Trajectory;
use rodfit::scene::{Clamp, Material, Scheme, StepTolerance, Support, Time};

use crate::common::{cantilever_with, helix_with, straight_rod};

/// Tangents and corrections per step: a loss of convergence or of the reuse of factors increases them.
#[test]
fn work_per_step_does_not_increase() {
    for (step, tangents, corrections) in
        [(1e-4, 1.01, 2.02), (1e-3, 1.02, 3.01), (5e-3, 2.2, 3.2), (1e-2, 3.0, 3.8)]
    {
        let problem = cantilever_with(0.5, step, 0.5, Clamp::Nodes).problem().unwrap();
        let work = problem.simulate().unwrap().work();
        let [factored, corrected] =
            [work.factorizations, work.newton_iterations].map(|n| n as f64 / work.steps as f64);
        println!("step {step}: {corrected:.3} corrections by {factored:.3} tangents, {work:?}");
        assert!(factored <= tangents && corrected <= corrections, "step {step}: {work:?}");
        assert_eq!(work.factorizations, work.tangents);
        let with = problem.simulate_with(&[rodfit::Parameter::YoungsModulus]).unwrap().work();
        assert_eq!(with.newton_iterations, work.newton_iterations);
        assert_eq!(with.factorizations, work.factorizations + work.steps);
    }
}

/// A cord that hardly stretches, in large steps: tangents under the expected tensions need half the corrections (without
/// them 6.6, 5.9 and 4.9 a step), and the motion is the same.
#[test]
fn cord_converges_in_few_corrections() {
    for (step, damping, tangents, corrections) in
        [(1e-2, 0.0, 3.1, 3.1), (1e-2, 1e-2, 3.1, 3.1), (5e-3, 0.0, 2.8, 2.9)]
    {
        let mut scene = straight_rod(40, [1.0, 4e-4], Material::new(1e3, 1e9));
        scene.supports.start = Support::Pinned;
        scene.loads.gravity = [0.0, 0.0, -9.81];
        scene.loads.damping.stiffness = damping;
        let mut run = |tolerance| {
            let time = Time::new(2.0, step);
            let scheme = Scheme::GeneralisedAlpha;
            scene.time = Some(Time { scheme, rho_inf: 0.0, tolerance, ..time });
            scene.problem().unwrap().simulate().unwrap()
        };
        let (found, exact) = (run(StepTolerance::default()), run(StepTolerance::Rounding));
        let work = found.work();
        let [factored, corrected] =
            [work.factorizations, work.newton_iterations].map(|n| n as f64 / work.steps as f64);
        let last = work.steps;
        let apart = Vector3::from(found.tip(last)) - Vector3::from(exact.tip(last));
        println!(
            "{step} {damping}: {corrected:.2} by {factored:.2} tangents, {:.1e}",
            apart.norm()
        );
        assert!(factored <= tangents && corrected <= corrections, "{step} {damping}: {work:?}");
        // The motion is the same up to the tolerance of Newton's method.
        assert!(apart.norm() < 1e-8, "{step} {damping}: {apart:?}");
    }
}

/// The error that Newton's method leaves in the motion is far below that of the discretization.
#[test]
fn newton_error_stays_below_1e_10_of_length() {
    let scenes = [
        ("cantilever", cantilever_with(0.5, 1e-3, 1.0, Clamp::Nodes)),
        ("cantilever", cantilever_with(1.0, 5e-3, 1.0, Clamp::Nodes)),
        ("cantilever", cantilever_with(0.5, 2e-3, 1.0, Clamp::MidEdge)),
        ("helix", helix_with(0.5, 1e-3, 1.0, Clamp::Nodes)),
        ("helix", helix_with(0.5, 5e-3, 1.0, Clamp::Nodes)),
    ];
    let alpha = [1, 3, 4].map(|k| {
        let (name, mut scene) = scenes[k].clone();
        scene.time.as_mut().unwrap().scheme = Scheme::GeneralisedAlpha;
        (name, scene)
    });
    let mut fine = cantilever_with(1.0, 5e-3, 1.0, Clamp::Nodes);
    fine.rod.segments = Some(200);
    for (name, mut scene) in scenes.into_iter().chain(alpha).chain([("fine", fine)]) {
        let mut run = |tolerance: StepTolerance| {
            scene.time.as_mut().unwrap().tolerance = tolerance;
            scene.problem().unwrap().simulate().unwrap()
        };
        let [exact, usual, rough] =
            [StepTolerance::Rounding, StepTolerance::default(), StepTolerance::Predicted(1e-10)]
                .map(&mut run);
        let left = |run: &Trajectory| {
            let apart = |k: usize| (Vector3::from(run.tip(k)) - Vector3::from(exact.tip(k))).norm();
            (0..run.times().len()).map(apart).fold(0.0, f64::max) / 0.5
        };
        let time = scene.time.unwrap();
        println!(
            "{name}, {}, {} s, beta {}: the tip is off by {:.1e} of the length after 1 s, by {:.1e} with 1e-10",
            time.scheme.name(),
            time.step_size(),
            time.beta,
            left(&usual),
            left(&rough)
        );
        // Rounding errors of many edges exceed the Newton error.
        assert!(name != "fine" || left(&usual) < 2e-12);
        assert!(left(&usual) < 1e-10 && left(&rough) < 1e-6 && left(&rough) > left(&usual));
    }
}
