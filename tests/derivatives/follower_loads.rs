//! Derivatives of equilibria and motions under follower loads and moments in space, compared with runs in dual numbers and
//! differences.

use rodfit::scene::*;
use rodfit::{Parameter, Trajectory};

use crate::all_schemes::{check_equilibria, check_motions, curved_rod, parameters_at, sine, steps};

/// A curved rod with weight, follower loads at a point and along a part, and in space a moment about fixed axes.
fn scene(planar: bool, scheme: Scheme, timed: bool) -> Scene {
    let (mut scene, z) = (curved_rod(planar), if planar { 0.0 } else { 1.0 });
    let signal = timed.then(|| "s".to_string());
    let point = |node, force, moment, follower| PointForce {
        node,
        force,
        moment,
        follower,
        signal: signal.clone(),
    };
    let (force, moment) = ([-0.3, 0.4, 0.2 * z], [0.004 * z, -0.003 * z, 0.006]);
    scene.loads.point = vec![
        point(Point::ArcLength(0.437), force, moment, true),
        point(Point::Tip, [0.1, 0.2, 0.1 * z], [0.005 * z, 0.004 * z, -0.006], false),
    ];
    let force = [0.5, -0.8, 0.6 * z];
    scene.loads.line =
        vec![LineForce { from: 0.113, to: Some(0.38), force, follower: true, signal: None }];
    if timed {
        scene.signals = vec![sine("s", 1.3)];
    }
    scene.time = steps(scheme);
    scene
}

/// Places of the parameters of equilibria.
const PLACES: [&str; 3] = ["loads.point.", "loads.line.", "rod."];

#[test]
fn derivatives_of_motions_equal_those_in_dual_numbers_and_differences() {
    check_motions(scene);
}

#[test]
fn derivatives_of_equilibria_equal_differences() {
    check_equilibria(scene, &PLACES);
}

/// A moment in space is a parameter only if there is one: scenes without it keep symmetric tangents and the adjoint.
#[test]
fn moment_of_zero_in_space_is_no_parameter() {
    let count = |scene: &Scene| {
        let problem = scene.problem().unwrap();
        parameters_at(&problem, &PLACES).iter().filter(|p| p.path().contains(".moment.")).count()
    };
    let mut scene = scene(false, Scheme::NewmarkBeta, false);
    assert_eq!(count(&scene), 6);
    scene.loads.point = vec![PointForce { force: [0.0, 0.1, 0.2], ..PointForce::default() }];
    scene.loads.line.clear();
    assert_eq!(count(&scene), 0);
}

/// The adjoint does not take loads without a potential; the error has their key.
#[test]
fn adjoint_rejects_loads_without_a_potential() {
    let mut scene = scene(false, Scheme::NewmarkBeta, false);
    let message =
        |scene: &Scene| scene.problem().unwrap().check_reversible().unwrap_err().to_string();
    assert!(message(&scene).contains("loads.point[0].follower"), "{}", message(&scene));
    scene.loads.point.remove(0);
    assert!(message(&scene).contains("loads.point[0].moment"), "{}", message(&scene));
    scene.loads.point[0].moment = [0.0; 3];
    assert!(message(&scene).contains("loads.line[0].follower"), "{}", message(&scene));
}

/// A run with derivatives, whose steps are made in dual numbers, has the reactions and energies of a run without them, also
/// those of viscous stress and of the springs of relaxation and friction.
#[test]
fn reactions_and_energies_of_a_run_with_derivatives_equal_those_of_a_plain_one() {
    let mut scene = scene(true, Scheme::NewmarkBeta, true);
    scene.loads.damping.stiffness = 2e-3;
    let branch = Maxwell { stiffness: 0.3, time: 0.05 };
    scene.loads.damping.maxwell = MaxwellBranches::Series(vec![branch]);
    let problem = scene.problem().unwrap();
    let run = |parameters: &[Parameter]| {
        let run = Trajectory::new(&problem, &[], parameters).unwrap();
        let mut run = run.keep_reactions().keep_energies();
        run.run(&problem, problem.time().unwrap().steps(), |_| {}).unwrap();
        run
    };
    let (plain, derived) = (run(&[]), run(&[Parameter::YoungsModulus]));
    for (a, b) in plain.reactions().iter().zip(derived.reactions()) {
        for (a, b) in [(a.start.force, b.start.force), (a.start.moment, b.start.moment)] {
            for (x, y) in a.into_iter().zip(b) {
                // Rounding of forces of up to some N.
                assert!((x - y).abs() < 1e-8, "{a:?} {b:?}");
            }
        }
    }
    for (a, b) in plain.energies().iter().zip(derived.energies()) {
        assert!((a.bend - b.bend).abs() < 1e-10 * (a.bend + a.kinetic), "{a:?} {b:?}");
    }
    // Kept reactions do not count in comparisons of motions.
    let mut without = Trajectory::new(&problem, &[], &[]).unwrap();
    without.run(&problem, problem.time().unwrap().steps(), |_| {}).unwrap();
    assert_eq!(without, plain);
}
