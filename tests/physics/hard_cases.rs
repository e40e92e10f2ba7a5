//! Difficult simulations with a known outcome: folds, snap-through, extreme slenderness, large steps, fast walls, fine meshes.

use rodfit::scene::{
    End, Initial, InitialState, Material, Motion, Point, PointForce, Scene, Scheme, Section, Shape,
    StepTolerance, Support, Time,
};
use rodfit::{Error, Trajectory};
use std::f64::consts::PI;

use crate::common::{cantilever, simulate};

const SCHEMES: [(Scheme, f64); 4] = [
    (Scheme::NewmarkBeta, 0.5),
    (Scheme::NewmarkBeta, 1.0),
    (Scheme::AverageVectorField, 0.5),
    (Scheme::Rodas4, 0.5),
];

/// Time stepping to `end` with a step, s, by a scheme and its `beta`.
fn timed(end: f64, step: f64, (scheme, beta): (Scheme, f64)) -> Option<Time> {
    Some(Time { scheme, beta, ..Time::new(end, step) })
}

/// Two edges, each 1 m long, that close on each other like the jaws of tongs; `spatial`: also out of plane.
fn tongs(speed: f64, step: f64, scheme: (Scheme, f64), spatial: bool) -> Scene {
    let shape = Shape::Straight { length: 2.0, direction: [1.0, 0.0, 0.0] };
    let section = Section::Circle { radius: 0.1 };
    // EI = 1, masses 1/2, 1, 1/2.
    let material = Material {
        poisson_ratio: Some(0.3),
        ..Material::new(1.0 / (PI * 0.01), 4.0 / (PI * 1e-4))
    };
    let mut scene = Scene::new(2, shape, section, material);
    scene.supports.start = Support::Free;
    if spatial {
        scene.rod.dimension = rodfit::scene::Dimension::Spatial;
    }
    scene.initial = Initial {
        state: InitialState::Shape,
        // Turned by 120 degrees already.
        shape: Some(Shape::Arc { length: 2.0, angle: 2.0 * 2.0 * PI / 3.0 }),
        ..Initial::default()
    };
    scene.initial.velocity = [0.0, speed, 0.0];
    scene.time = timed(1.0 / speed, step / speed, scheme);
    scene
}

/// Edges that close to a fold rebound at any speed, as a fold has infinite energy. Too large steps are rejected and never pass
/// through the fold; with small steps all schemes rebound.
#[test]
fn strike_through_a_fold_is_rejected() {
    for spatial in [false, true] {
        for scheme in SCHEMES {
            for (step, must_finish) in [(1e-4, true), (1e-2, false), (0.1, false), (0.4, false)] {
                let mut scene = tongs(200.0, step, scheme, spatial);
                // The middle flies ahead of both ends.
                scene.initial.velocity = [0.0; 3];
                let problem = scene.problem().unwrap();
                let outcome = strike(&problem, spatial, must_finish);
                if let Err(error) = outcome {
                    assert!(!must_finish && !error.is_input(), "{scheme:?} {step}: {error}");
                }
            }
        }
    }
}

/// Lets the jaws fly at each other and watches them; none gets past the other.
fn strike(problem: &rodfit::Problem, spatial: bool, rebounds: bool) -> Result<(), Error> {
    let time = problem.time().unwrap();
    let (steps, dt) = (time.steps(), time.step_size());
    let mut closest = f64::INFINITY;
    // Which side of the first jaw the second is on.
    let mut see = |a: [f64; 3], b: [f64; 3], c: [f64; 3]| {
        let (e, f) = ([b[0] - a[0], b[1] - a[1]], [c[0] - b[0], c[1] - b[1]]);
        let turn = (e[0] * f[1] - e[1] * f[0]).atan2(e[0] * f[0] + e[1] * f[1]);
        // Swung open beyond straight is another matter.
        assert!(turn > -0.5 * PI, "the jaws have gone through each other: {turn}");
        closest = closest.min(PI - turn);
        turn
    };
    let mut last = 0.0;
    macro_rules! fly {
        ($discretized:expr, $stride:expr) => {{
            let discretized = $discretized;
            let mut simulation = discretized.simulation().unwrap();
            let q = simulation.state().q.clone();
            let at = |q: &[f64], i: usize| [q[$stride * i], q[$stride * i + 1], 0.0];
            // Both jaws turn about the middle, towards each other.
            let (a, b, c) = (at(&q, 0), at(&q, 1), at(&q, 2));
            let mut v = vec![0.0; q.len()];
            for (i, end, way) in [(0, a, 200.0), (2, c, -200.0)] {
                let arm = [end[0] - b[0], end[1] - b[1]];
                v[$stride * i] = way * arm[1];
                v[$stride * i + 1] = -way * arm[0];
            }
            simulation.set_velocity(&v);
            for k in 1..=steps {
                simulation.step_to(k as f64 * dt)?;
                let q = &simulation.state().q;
                assert!(q.iter().all(|x| x.is_finite()));
                last = see(at(q, 0), at(q, 1), at(q, 2));
            }
        }};
    }
    match spatial {
        true => fly!(problem.spatial().unwrap(), 4),
        false => fly!(problem.planar().unwrap(), 2),
    }
    if rebounds {
        // The jaws came close to a fold and opened again.
        assert!(closest < 0.1 && last < PI - 2.0 * closest, "{closest} {last}");
    }
    Ok(())
}

/// A joint folded to 179.999 degrees springs open: energy never grows under implicit Euler.
#[test]
fn folded_rod_springs_open() {
    for degrees in [179.0_f64, 179.9, 179.99, 179.999] {
        let mut scene = tongs(1.0, 1e-3, (Scheme::NewmarkBeta, 1.0), false);
        scene.initial.velocity = [0.0; 3];
        scene.initial.shape = Some(Shape::Arc { length: 2.0, angle: 2.0 * degrees.to_radians() });
        // A wall at neither end; the joint takes half of the arc's turn.
        let problem = scene.problem().unwrap();
        let mut energies = Vec::new();
        let mut run = Trajectory::new(&problem, &[0, 1, 2], &[]).unwrap();
        let outcome = run.run(&problem, 100, |now| energies.push(now.energies()));
        println!("{degrees} degrees: {} steps, {outcome:?}", energies.len() - 1);
        outcome.unwrap();
        let grows = |e: &[rodfit::rod::Energies]| e[1].total() > e[0].total() * (1.0 + 1e-9);
        assert!(!energies.windows(2).any(grows), "{degrees}");
        // After 20 steps nearly all bending energy is released.
        assert!(energies[20].bend < 1e-2 * energies[0].bend, "{degrees}");
    }
}

/// A shallow arch between hinges snaps through under a load above its limit and not below it; a
/// finer mesh has the same limit, and damped motion ends where the creeping rod does.
#[test]
fn shallow_arch_snaps_through() {
    let arch = |segments: usize, load: f64| {
        let shape = Shape::Arc { length: 1.0, angle: 0.8 };
        let modulus = 4.0 / (PI * 1e-8);
        let section = Section::Circle { radius: 1e-2 };
        let material = Material::new(1.0 / (PI * 1e-4), modulus);
        let mut scene = Scene::new(segments, shape, section, material);
        (scene.supports.start, scene.supports.end) = (Support::Pinned, Support::Pinned);
        // The arch bulges towards -y; its chord rises by 0.4 rad.
        // The load leans by a millionth: an exactly symmetric rod would creep along its symmetric,
        // unstable way as long as rounding errors let it.
        let (sin, cos) = (0.4 + 1e-6_f64).sin_cos();
        let up = [-sin, cos, 0.0].map(|c| c * load);
        scene.loads.point = vec![PointForce {
            node: Point::Node(segments / 2),
            force: up,
            ..PointForce::default()
        }];
        scene
    };
    let height = |scene: &Scene, middle: [f64; 3]| {
        let chord = scene.rod.shape.clone();
        assert!(matches!(chord, Shape::Arc { .. }));
        -0.4_f64.sin() * middle[0] + 0.4_f64.cos() * middle[1]
    };
    let inverted = |segments: usize, load: f64| {
        let scene = arch(segments, load);
        let found = scene.problem().unwrap().equilibrium().unwrap();
        assert_eq!(found.stable_in_plane, Some(true), "{found}");
        height(&scene, found.nodes[segments / 2]) > 0.0
    };
    let limit = |segments: usize| {
        let (mut low, mut high) = (0.0, 100.0);
        assert!(!inverted(segments, low) && inverted(segments, high));
        while high - low > 1e-3 * high {
            let middle = 0.5 * (low + high);
            if inverted(segments, middle) { high = middle } else { low = middle }
        }
        low
    };
    let limits = [40, 80].map(limit);
    println!("snap-through at {limits:?} EI/L^2");
    // The limit load converges with the mesh.
    assert!((limits[0] / limits[1] - 1.0).abs() < 0.01, "{limits:?}");
    for (part, through) in [(0.5, false), (1.5, true)] {
        let mut scene = arch(40, part * limits[0]);
        let still = scene.problem().unwrap().equilibrium().unwrap();
        scene.loads.damping.mass = 5.0;
        scene.time = timed(6.0, 2e-3, (Scheme::NewmarkBeta, 0.6));
        let run = simulate(&scene);
        let middle = run.node(20, 3000);
        assert_eq!(height(&scene, middle) > 0.0, through);
        let apart = (0..2).map(|c| (middle[c] - still.nodes[20][c]).abs()).fold(0.0, f64::max);
        // The damped motion ends at the equilibrium.
        assert!(apart < 1e-4, "{part}: {apart}");
    }
}

/// A cantilever a hundred times as slender (EA L^2/EI = 4e10) moves as the paper's does.
#[test]
fn scaled_hair_moves_as_the_rod() {
    let tip = |slenderness: f64| {
        let mut scene = cantilever();
        scene.rod.section = Section::Circle { radius: 0.5 * slenderness };
        // EI/(rho A g L^3) stays.
        scene.material.youngs_modulus = 1e8 * (0.01 / slenderness).powi(2);
        scene.time = Some(Time { beta: 0.6, ..Time::new(0.5, 1e-3) });
        simulate(&scene).tip(500)
    };
    let [rod, hair] = [1e-3, 1e-5].map(tip);
    let apart = (rod[0] - hair[0]).hypot(rod[1] - hair[1]) / 0.5;
    println!("EA L^2/EI = 4e6 and 4e10: {apart:.1e} L apart");
    // The equations depend on EA L^2/EI only by small stretching.
    assert!(apart < 1e-5);
}

/// Moduli of 1e3 to 1e12 Pa at steps of 1 and 100 ms. Implicit Euler and the average vector field complete all runs; other
/// schemes complete them or return a stated error. All computed positions are finite.
#[test]
fn stiff_and_soft_rods_are_stable_in_large_steps() {
    for modulus in [1e3, 1e5, 1e8, 1e10, 1e12] {
        for step in [1e-3, 0.1] {
            for scheme in SCHEMES {
                let mut scene = cantilever();
                scene.material.youngs_modulus = modulus;
                scene.time = timed(1.0, step, scheme);
                let problem = scene.problem().unwrap();
                let mut run = Trajectory::new(&problem, &[50], &[]).unwrap();
                let outcome = run.run(&problem, problem.time().unwrap().steps(), |now| {
                    assert!(now.position(50).iter().all(|x| x.is_finite()));
                });
                let sure = scheme.1 == 1.0 || scheme.0 == Scheme::AverageVectorField;
                match outcome {
                    Ok(()) => assert_eq!(run.times().len(), problem.time().unwrap().steps() + 1),
                    Err(error) => {
                        println!("E = {modulus:e}, {step} s, {scheme:?}: {error}");
                        assert!(!sure && !error.is_input(), "{modulus:e} {step}: {error}");
                    }
                }
            }
        }
    }
}

/// A wall that shakes at 2 kHz, far above the frequencies of the mesh. The rod stays near rest beyond its first edges, at steps
/// that resolve the shaking well or badly; a step of two periods is rejected.
#[test]
fn rod_on_a_wall_shaken_at_high_frequency_follows_theory() {
    for step in [2.5e-5, 1e-4, 1e-3] {
        let mut scene = cantilever();
        scene.loads.gravity = [0.0; 3];
        scene.loads.damping.stiffness = 1e-4;
        scene.supports.motion = vec![Motion {
            end: End::Start,
            displacement: [0.0, 1e-4, 0.0],
            frequency: Some(2000.3),
            ..Motion::default()
        }];
        scene.time = timed(0.1, step, (Scheme::NewmarkBeta, 0.5));
        let outcome = scene.problem().unwrap().simulate();
        if step == 1e-3 {
            let error = outcome.map(|_| ()).expect_err("half a step a period").to_string();
            assert!(error.starts_with("supports.motion[0].frequency: found 2000.3 Hz"), "{error}");
            continue;
        }
        let run = outcome.unwrap();
        let last = run.times().len() - 1;
        let most = (0..=last).map(|k| run.tip(k)[1].abs()).fold(0.0, f64::max);
        println!("step {step}: the tip moves by {:.3} of the wall's swing", most / 1e-4);
        // The tip stays within three amplitudes of the wall, 1e-4 m.
        assert!(most < 3e-4, "{most}");
    }
}

/// A hundred thousand nodes: the work of a step is that of fifty nodes. Rounding errors grow with
/// the fourth power of the mesh, to 0.3 % of this motion, where 10,000 nodes still give six digits.
#[test]
fn rod_of_a_hundred_thousand_nodes_is_simulated() {
    let run = |segments: usize| {
        let mut scene = cantilever();
        scene.rod.segments = Some(segments);
        scene.time = Some(Time::new(0.01, 1e-3));
        let run = simulate(&scene);
        let work = run.work();
        println!("{segments}: tip at {:?}, {work:?}", run.tip(10));
        assert!(work.newton_iterations <= 3 * work.steps);
        run.tip(10)[1]
    };
    let [coarse, fine, finest] = [1_000, 10_000, 100_000].map(run);
    // Rounding errors as stated above: six digits at 10 000 nodes, 0.3 % at 100 000.
    assert!((fine / coarse - 1.0).abs() < 1e-5 && (finest / coarse - 1.0).abs() < 1e-2);
}

/// A rod that untwists by about a radian per step, which makes the curvature of the other equations hard to estimate. The error
/// of the tip must still be within the tolerance of Newton's method.
#[test]
fn newton_converges_for_a_rapidly_rotating_rod() {
    let circle = Section::Circle { radius: 2e-3 };
    let up = [0.0, 1.0, 0.5];
    let flat = Section::Rectangle { width: 4e-3, height: 3.5e-3, up };
    for (section, twist, damping, segments, step) in [
        (circle.clone(), 5.0, 8e-4, 40, 4.7e-4),
        (circle.clone(), 1.6, 8e-4, 13, 3e-3),
        (circle.clone(), 0.5, 8e-4, 8, 1.1e-2),
        (circle, 1.6, 0.0, 13, 3e-3),
        (flat, 1.6, 8e-4, 60, 1.7e-3),
    ] {
        let shape = Shape::Straight { length: 0.24, direction: [1.0, 0.0, 0.0] };
        let material = Material { poisson_ratio: Some(0.3), ..Material::new(1100.0, 4.6e8) };
        let mut scene = Scene::new(segments, shape, section, material);
        scene.rod.dimension = rodfit::scene::Dimension::Spatial;
        scene.rod.natural_twist = twist.into();
        scene.loads.gravity = [0.0, -9.8, 0.0];
        scene.loads.damping.stiffness = damping;
        let mut run = |tolerance| {
            let scheme = Scheme::GeneralisedAlpha;
            let time = Time { scheme, rho_inf: 0.8, tolerance, ..Time::new(0.12, step) };
            scene.time = Some(time);
            simulate(&scene)
        };
        let exact = run(StepTolerance::Rounding);
        let mut left = |tolerance| {
            let run = run(tolerance);
            let apart = |k: usize| {
                let (a, b) = (run.tip(k), exact.tip(k));
                (0..3).map(|i| (a[i] - b[i]).powi(2)).sum::<f64>().sqrt()
            };
            (0..exact.times().len()).map(apart).fold(0.0, f64::max) / 0.24
        };
        let [usual, rough] =
            [StepTolerance::default(), StepTolerance::Predicted(1e-10)].map(&mut left);
        println!(
            "{twist} rad/m, {step} s: the tip is off by {usual:.1e} of the length, {rough:.1e} with 1e-10"
        );
        // Error in lengths of the rod, against a run to rounding.
        assert!(usual < 1e-10 && rough < 1e-6, "{twist} rad/m, {step} s: {usual:e}, {rough:e}");
    }
}
