//! Steps that lead a rod through an obstacle are halved, or end the run; those past it are not.

use rodfit::scene::{
    Contact, Material, ObstacleMotion, Scene, Scheme, Section, Shape, Support, Time,
};
use rodfit::{Code, Error, Trajectory};

use crate::common::distance;

/// Largest distance of the tips of a coarse and a fine run, m: a fifth of the length. Tips of rods that pass differ by 0.13 m
/// and more.
const BOUND: f64 = 0.1;

/// A straight rod along x of this length and radius, m, and Young's modulus, Pa.
fn straight(length: f64, radius: f64, segments: usize, modulus: f64) -> Scene {
    let shape = Shape::Straight { length, direction: [1.0, 0.0, 0.0] };
    let mut material = Material::new(1000.0, modulus);
    material.poisson_ratio = Some(0.3);
    Scene::new(segments, shape, Section::Circle { radius }, material)
}

/// A cylinder across the plane about this point, with damping.
fn peg([x, y]: [f64; 2], radius: f64, stiffness: Option<f64>, damping: f64) -> Contact {
    let peg = Contact::cylinder([x, y, 0.0], [0.0, 0.0, 1.0], radius);
    peg.stiffness(stiffness).damping(damping)
}

/// A run of the scene to `end` with a step, s.
fn run(scene: &Scene, end: f64, step: f64, rho_inf: f64) -> Result<Trajectory, Error> {
    let scheme = Scheme::GeneralisedAlpha;
    let time = Some(Time { scheme, rho_inf, ..Time::new(end, step) });
    let mut scene = scene.clone();
    scene.time = time;
    scene.problem().unwrap().simulate()
}

/// The tip at the end of a run.
fn last_tip(run: &Trajectory) -> [f64; 3] {
    run.tip(run.times().len() - 1)
}

/// The angle by which a rod winds round a point at the end of a run, rad: negative for one from left to right above it.
fn winding(run: &Trajectory, [x, y]: [f64; 2]) -> f64 {
    let last = run.times().len() - 1;
    let nodes: Vec<_> = (0..run.nodes()).map(|i| run.node(i, last)).collect();
    let turn = |pair: &[[f64; 3]]| {
        let [a, b] = [0, 1].map(|i| [pair[i][0] - x, pair[i][1] - y]);
        (a[0] * b[1] - a[1] * b[0]).atan2(a[0] * b[0] + a[1] * b[1])
    };
    nodes.windows(2).map(turn).sum()
}

/// Compares runs with coarse steps, s, with one with a fine step. The rod remains above the peg and the tips agree within
/// [`BOUND`], or the coarse run ends with an error. A rod that passes through the peg differs by more.
fn compare(scene: &Scene, center: [f64; 2], end: f64, coarse: &[f64], fine: f64, rho_inf: f64) {
    let exact = run(scene, end, fine, rho_inf).unwrap();
    assert!(winding(&exact, center) < 0.0);
    for step in coarse {
        match run(scene, end, *step, rho_inf) {
            Ok(run) => {
                let difference = distance(last_tip(&run), last_tip(&exact));
                println!("{step} s: tip {:?}, off by {difference:.2e} m", last_tip(&run));
                assert!(winding(&run, center) < 0.0, "{step}");
                assert!(difference < BOUND, "{step}: {difference}");
            }
            Err(error) => println!("{step} s: {error}"),
        }
    }
}

/// A free rod at 10 m/s, and a stiff peg 25 mm below it, smaller than a coarse step.
#[test]
fn rod_thrown_at_a_thin_stiff_peg_does_not_pass_it_in_coarse_steps() {
    let mut scene = straight(0.5, 0.005, 40, 1e7);
    scene.supports.start = Support::Free;
    scene.initial.velocity = [0.0, -10.0, 0.0];
    scene.contacts = vec![peg([0.4, -0.025], 0.001, Some(1e11), 1.0)];
    compare(&scene, [0.4, -0.025], 0.02, &[5e-3, 1e-3], 5e-5, 0.5);
}

/// A peg thrown at a rod at rest is that of the test above in another frame: no coarse step passes.
#[test]
fn thin_stiff_peg_thrown_at_a_rod_does_not_pass_it_in_coarse_steps() {
    let (center, end, speed) = ([0.4, -0.025], 0.02, 10.0);
    let mut scene = straight(0.5, 0.005, 40, 1e7);
    scene.supports.start = Support::Free;
    let mut contact = peg(center, 0.001, Some(1e11), 1.0);
    if let Contact::Cylinder { motion, .. } = &mut contact {
        let velocity = [0.0, speed, 0.0];
        *motion = vec![ObstacleMotion { velocity, ..ObstacleMotion::default() }];
    }
    scene.contacts = vec![contact];
    compare(&scene, [center[0], center[1] + speed * end], end, &[5e-3, 1e-3], 5e-5, 0.5);
}

/// The default stiffness is too small to stop the rod of the test above at any step: the run ends with the error.
#[test]
fn rod_that_a_soft_peg_does_not_stop_ends_the_run() {
    let mut scene = straight(0.5, 0.005, 40, 1e7);
    scene.supports.start = Support::Free;
    scene.initial.velocity = [0.0, -10.0, 0.0];
    scene.contacts = vec![peg([0.4, -0.025], 0.001, None, 1.0)];
    for step in [5e-3, 1e-3, 1e-4] {
        let error = run(&scene, 0.02, step, 0.5).map(|run| last_tip(&run)).unwrap_err();
        println!("{step} s: {error}");
        assert!(matches!(error, Error::PassedObstacle { contact: 0, .. }), "{error}");
        assert_eq!(error.code(), Some(Code::PassedObstacle));
        let message = error.to_string();
        for part in ["contacts[0]", "a smaller time.step", "contacts[0].stiffness"] {
            assert!(message.contains(part), "{part}: {message}");
        }
    }
}

/// A cantilever swings under its weight onto a peg of 1 mm diameter, and bounces back. At 0.2 s it has not slid off the peg yet.
/// Without rejections it swings on below the peg.
#[test]
fn swinging_cantilever_does_not_pass_a_thin_peg_in_coarse_steps() {
    let mut scene = straight(0.5, 0.002, 40, 1e7);
    scene.loads.gravity = [0.0, -9.81, 0.0];
    scene.contacts = vec![peg([0.4, -0.1], 0.0005, None, 1.0)];
    compare(&scene, [0.4, -0.1], 0.2, &[1e-2, 5e-3], 2e-4, 0.8);
}

/// A free rod in contact with a peg away from its middle tilts, slides along and off it: no step is halved, and coarse steps
/// agree with fine ones.
#[test]
fn rod_that_slides_off_a_peg_is_accepted() {
    for (radius, modulus, friction) in [(0.01, 1e8, None), (0.0015, 1e7, Some(0.2))] {
        let mut scene = straight(0.3, 0.005, 30, modulus);
        scene.supports.start = Support::Free;
        scene.loads.gravity = [0.0, -9.81, 0.0];
        let mut contact = peg([0.12, -0.005 - radius], radius, None, 5.0);
        if let Contact::Cylinder { friction: own, .. } = &mut contact {
            *own = friction;
        }
        scene.contacts = vec![contact];
        let end = 0.4;
        let exact = last_tip(&run(&scene, end, 2e-4, 0.5).unwrap());
        for step in [2e-3, 1e-3] {
            let run = run(&scene, end, step, 0.5).unwrap();
            let difference = distance(last_tip(&run), exact);
            println!("R = {radius} m, {step} s: {difference:.2e} m, {:?}", run.work());
            assert_eq!(run.work().steps, (end / step).round() as usize);
            // The rod has left the peg.
            assert!(exact[1] < -0.3 && difference < 5e-3, "{exact:?} {difference}");
        }
    }
}

/// A rod that falls beside the end of a capsule, or beside a sphere, moves as without them.
#[test]
fn rod_that_falls_beside_an_obstacle_is_accepted() {
    let mut scene = straight(0.3, 0.005, 10, 1e8);
    scene.rod.dimension = rodfit::scene::Dimension::Spatial;
    scene.supports.start = Support::Free;
    scene.initial.velocity = [0.0, -10.0, 0.0];
    let (end, step) = (0.02, 2e-3);
    let alone = run(&scene, end, step, 0.5).unwrap();
    // 1 mm beside the surface of the rod.
    let near = [0.15, -0.05, 0.016];
    let capsule = Contact::capsule([near, [0.15, -0.05, 0.1]], 0.01).stiffness(1e11);
    let sphere = Contact::sphere(near, 0.01).stiffness(1e11);
    for contact in [capsule, sphere] {
        scene.contacts = vec![contact];
        let run = run(&scene, end, step, 0.5).unwrap();
        assert_eq!(run.work().steps, alone.work().steps);
        assert!(distance(last_tip(&run), last_tip(&alone)) < 1e-12);
    }
}
