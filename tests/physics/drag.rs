//! Drag and added mass of rods in a fluid, against closed forms: terminal velocity, decay, frequencies, reactions.

use rodfit::problem::Model;
use rodfit::scene::{
    Clamp, Dimension, Drag, Initial, Material, Scene, Scheme, Section, Shape, Support, Time,
};
use rodfit::vibration::LinearizationPoint;
use rodfit::{AnyProblem, Trajectory};

use crate::common::cantilever;
use crate::energy::first_mode;

const LENGTH: f64 = 0.5;
const DENSITY: f64 = 1273.52;

/// Mass per length, kg/m.
fn line() -> f64 {
    DENSITY * std::f64::consts::PI * 0.005_f64.powi(2)
}

/// A free rod along a direction.
fn free(direction: [f64; 3], planar: bool, scheme: Scheme) -> Scene {
    let shape = Shape::Straight { length: LENGTH, direction };
    let material = Material { poisson_ratio: Some(0.4), ..Material::new(DENSITY, 1e8) };
    let mut scene = Scene::new(12, shape, Section::Circle { radius: 0.005 }, material);
    scene.rod.dimension = if planar { Dimension::Auto } else { Dimension::Spatial };
    (scene.supports.start, scene.supports.end) = (Support::Free, Support::Free);
    scene.time = Some(Time { scheme, rho_inf: 0.9, ..Time::new(2.0, 5e-3) });
    scene
}

/// The velocities of all nodes at the end.
fn velocities(scene: &Scene) -> Vec<[f64; 3]> {
    let problem = scene.problem().unwrap();
    let time = problem.time().unwrap();
    macro_rules! run {
        ($discretized:expr) => {{
            let mut simulation = $discretized.simulation().unwrap();
            (1..=time.steps()).for_each(|k| simulation.step_to(time.at(k)).unwrap());
            let v = &simulation.state().v;
            (0..problem.nodes()).map(|i| $discretized.model.rate(v, i)).collect()
        }};
    }
    match problem.discretized() {
        AnyProblem::Planar(discretized) => run!(discretized),
        AnyProblem::Spatial(discretized) => run!(discretized),
    }
}

/// A falling rod reaches the velocity at which drag balances its weight, broadside and end-on; a floating one moves with the
/// fluid.
#[test]
fn falling_rod_reaches_its_terminal_velocity() {
    let across = Drag { linear_normal: 0.5, linear_tangential: 90.0, ..Drag::default() };
    let along = Drag { linear_normal: 90.0, linear_tangential: 0.7, ..Drag::default() };
    let square = Drag { quadratic_normal: 0.4, quadratic_tangential: 90.0, ..Drag::default() };
    let end_on = Drag { quadratic_normal: 90.0, quadratic_tangential: 0.6, ..Drag::default() };
    let weight = line() * 9.8;
    for scheme in [Scheme::NewmarkBeta, Scheme::GeneralisedAlpha] {
        for planar in [true, false] {
            for (drag, direction, speed) in [
                (across, [1.0, 0.0, 0.0], weight / 0.5),
                (along, [0.0, 1.0, 0.0], weight / 0.7),
                (square, [1.0, 0.0, 0.0], (weight / 0.4).sqrt()),
                (end_on, [0.0, 1.0, 0.0], (weight / 0.6).sqrt()),
            ] {
                let mut scene = free(direction, planar, scheme);
                scene.loads.gravity = [0.0, -9.8, 0.0];
                scene.loads.drag = Some(Drag { fluid_velocity: [0.0, 0.3, 0.0], ..drag });
                scene.time.as_mut().unwrap().end = 6.0;
                for [x, y, z] in velocities(&scene) {
                    let off = (y - 0.3 + speed).abs().max(x.abs()).max(z.abs());
                    // Terminal velocity: drag equals weight, relative to the fluid that rises with 0.3 m/s.
                    assert!(off < 1e-6 * speed, "{scheme:?} {planar} {drag:?}: {x} {y} {z}");
                }
            }
            // Of the fluid's density, carried along.
            let mut scene = free([1.0, 0.4, 0.0], planar, scheme);
            scene.loads.gravity = [0.0, -9.8, 0.0];
            scene.loads.drag = Some(Drag {
                linear_normal: 0.5,
                quadratic_tangential: 2.0,
                linear_tangential: 0.3,
                fluid_velocity: [0.2, -0.1, 0.0],
                fluid_density: DENSITY,
                ..Drag::default()
            });
            scene.time.as_mut().unwrap().end = 6.0;
            for [x, y, _] in velocities(&scene) {
                // With the density of the fluid the rod is weightless, and takes the velocity of the fluid, (0.2, -0.1) m/s.
                assert!((x - 0.2).abs() < 1e-6 && (y + 0.1).abs() < 1e-6, "{x} {y}");
            }
            scene.loads.drag = Some(Drag { fluid_density: DENSITY, ..Drag::default() });
            let fastest =
                velocities(&scene).into_iter().flatten().fold(0.0, |a: f64, b| a.max(b.abs()));
            // A weightless rod at rest in a fluid at rest stays at rest.
            assert!(fastest < 1e-10, "{fastest:e}");
        }
    }
}

/// Without weight a rod slows down as 1/(1 + k t) in quadratic drag, at second order in the step.
#[test]
fn velocity_under_quadratic_drag_decreases_as_inverse_time() {
    for scheme in [Scheme::NewmarkBeta, Scheme::GeneralisedAlpha] {
        for (direction, normal) in [([1.0, 0.0, 0.0], true), ([0.0, 1.0, 0.0], false)] {
            let (k, speed) = (0.3, 1.5);
            let errors = [2e-2, 1e-2, 5e-3].map(|step| {
                let mut scene = free(direction, true, scheme);
                let [n, t] = if normal { [k, 9.0] } else { [9.0, k] };
                let drag = Drag { quadratic_normal: n, quadratic_tangential: t, ..Drag::default() };
                scene.loads.drag = Some(drag);
                let velocity = [0.0, speed, 0.0];
                scene.initial = Initial { velocity, ..Initial::default() };
                scene.time = Some(Time { scheme, rho_inf: 0.9, ..Time::new(1.0, step) });
                let exact = speed / (1.0 + k / line() * speed);
                velocities(&scene)[5][1] / exact - 1.0
            });
            let order = (errors[0] / errors[2]).log2() / 2.0;
            println!("{scheme:?}, across: {normal}: {errors:?}, order {order:.2}");
            // Second order in the step against `v/(1 + k v t)`.
            assert!(errors[2].abs() < 2e-4 && (order - 2.0).abs() < 0.2, "{errors:?} {order}");
        }
    }
}

/// The tangents of a rod that turns are where they belong to second order in the step.
#[test]
fn drag_of_a_rotating_rod_is_of_second_order() {
    for scheme in [Scheme::NewmarkBeta, Scheme::GeneralisedAlpha] {
        for planar in [true, false] {
            let at = |step: f64| {
                let mut scene = free([1.0, 0.0, 0.0], planar, scheme);
                let drag = Drag { linear_normal: 0.2, quadratic_normal: 0.1, ..Drag::default() };
                scene.loads.drag = Some(drag);
                let (velocity, angular_velocity) = ([0.5, 1.0, 0.0], [0.0, 0.0, 4.0]);
                scene.initial = Initial { velocity, angular_velocity, ..Initial::default() };
                scene.time = Some(Time { scheme, rho_inf: 0.8, ..Time::new(0.5, step) });
                // Of the whole rod: a sudden start shakes it faster than these steps resolve.
                let all = velocities(&scene);
                let mean = |c: usize| {
                    all.windows(2).map(|v| 0.5 * (v[0][c] + v[1][c])).sum::<f64>() / 12.0
                };
                [mean(0), mean(1)]
            };
            let exact = at(3.125e-4);
            let errors = [1e-2, 5e-3, 2.5e-3].map(|step| {
                let v = at(step);
                (v[0] - exact[0]).hypot(v[1] - exact[1])
            });
            let order = (errors[0] / errors[2]).log2() / 2.0;
            println!("{scheme:?}, planar: {planar}: {errors:?}, order {order:.2}");
            // Second order in the step against the rigid rotation.
            assert!(errors[2] < 1e-3 && (order - 2.0).abs() < 0.3, "{errors:?} {order}");
        }
    }
}

/// Energies of a cantilever that swings in its first mode, at these times.
fn swing(drag: Drag, speed: f64, step: f64, times: &[f64]) -> Vec<f64> {
    let mut scene = cantilever();
    scene.rod.segments = Some(20);
    scene.loads.gravity = [0.0; 3];
    scene.loads.drag = Some(drag);
    scene.time = Some(Time::new(3.0, step));
    let problem = scene.problem().unwrap();
    let planar = problem.planar().unwrap();
    let mut simulation = planar.simulation().unwrap();
    let rest = planar.rest();
    let v: Vec<f64> = (0..rest.len() / 2)
        .flat_map(|i| [0.0, speed * first_mode((rest[2 * i] / LENGTH).max(0.0))])
        .collect();
    simulation.set_velocity(&v);
    let mut k = 0;
    times
        .iter()
        .map(|t| {
            while simulation.state().time < t - 0.5 * step {
                k += 1;
                simulation.step_to(f64::from(k) * step).unwrap();
            }
            simulation.energies().total()
        })
        .collect()
}

/// Linear drag across a rod reduces its amplitude as `exp(-c t/(2 rho A))`; added mass of the fluid lowers frequencies by
/// `sqrt(m/(m + ma))`.
#[test]
fn drag_and_added_mass_of_a_cantilever_equal_theory() {
    let frequency = |added_mass: f64| {
        let mut scene = cantilever();
        scene.loads.drag = Some(Drag { added_mass, ..Drag::default() });
        scene.loads.gravity = [0.0; 3];
        scene.problem().unwrap().modes(1, LinearizationPoint::Equilibrium).unwrap().modes[0]
            .frequency_rad_s
    };
    let lowered = frequency(0.07) / frequency(0.0);
    // Added mass of 0.07 kg/m lowers the frequency by sqrt(m/(m + 0.07)).
    assert!((lowered / (line() / (line() + 0.07)).sqrt() - 1.0).abs() < 1e-9, "{lowered}");
    let period = std::f64::consts::TAU / frequency(0.0);
    let c = 0.06;
    let drag = Drag { linear_normal: c, ..Drag::default() };
    let e = swing(drag, 1e-3, period / 400.0, &[0.5 * period, 4.5 * period]);
    let decay = (e[0] / e[1]).ln() / (4.0 * period);
    println!("{decay} {}", c / line());
    // The energy decays with the rate c over the mass per length, twice that of the amplitude.
    assert!((decay / (c / line()) - 1.0).abs() < 1e-3, "{decay}");
}

/// The amplitude of small swings in quadratic drag goes as `1/(1 + k a t)` with
/// `k = 4 b w I3/(3 pi rho A I2)`, where `I2` and `I3` are the means of the mode's square and cube.
#[test]
fn quadratic_drag_of_a_cantilever_is_proportional_to_its_amplitude() {
    let wave = (1e8_f64 / DENSITY).sqrt();
    let w = 1.875104068711961_f64.powi(2) * wave * 0.0025 / LENGTH.powi(2);
    let period = std::f64::consts::TAU / w;
    let mean = |n: i32| {
        (0..2000).map(|k| first_mode((f64::from(k) + 0.5) / 2000.0).powi(n)).sum::<f64>() / 2000.0
    };
    let (b, speed) = (60.0, 3e-3);
    let k = 4.0 * b * mean(3) / (3.0 * std::f64::consts::PI * line() * mean(2));
    let drag = Drag { quadratic_normal: b, ..Drag::default() };
    // Speeds are amplitudes times w.
    let times: Vec<f64> = [0.0, 1.0, 2.0, 4.0].iter().map(|n| n * period).collect();
    let e = swing(drag, speed, period / 400.0, &times);
    for (t, now) in times.iter().zip(&e) {
        let (found, exact) = ((now / e[0]).sqrt(), 1.0 / (1.0 + k * speed * t));
        println!("{t:.2} s: {found:.5}, {exact:.5}");
        // Theory above: amplitude `1/(1 + k a t)`, averaged over a period.
        assert!((found / exact - 1.0).abs() < 5e-3, "{found} {exact}");
    }
}

/// Drag with a scheme without support for it is rejected, with a scheme that has it named; so is a negative coefficient. A
/// stream out of the plane gives a spatial model.
#[test]
fn drag_with_unsupported_scheme_is_rejected() {
    let mut scene = cantilever();
    scene.loads.drag = Some(Drag { linear_normal: 0.1, ..Drag::default() });
    scene.time.as_mut().unwrap().scheme = Scheme::Rodas4;
    let refused = scene.problem().unwrap_err().to_string();
    assert!(refused.contains("loads.drag") && refused.contains("generalised-alpha"), "{refused}");
    scene.time.as_mut().unwrap().scheme = Scheme::NewmarkBeta;
    scene.loads.drag = Some(Drag { linear_normal: -0.1, ..Drag::default() });
    let refused = scene.problem().unwrap_err().to_string();
    assert!(refused.contains("loads.drag.linear_normal"), "{refused}");
    scene.loads.drag = Some(Drag { fluid_velocity: [0.0, 0.0, 1.0], ..Drag::default() });
    scene.material.poisson_ratio = Some(0.4);
    assert!(scene.problem().unwrap().planar().is_none());
}

/// The reaction of a wall balances the whole force of a stream on the rod, that on the held nodes included.
#[test]
fn reaction_of_a_wall_balances_the_force_of_a_stream() {
    for planar in [true, false] {
        let mut scene = free([1.0, 0.0, 0.0], planar, Scheme::GeneralisedAlpha);
        scene.supports.start = Support::Clamped;
        scene.supports.clamp = Clamp::Nodes;
        let (drag, speed) = (0.5, 0.1);
        scene.loads.drag = Some(Drag {
            linear_normal: drag,
            linear_tangential: drag,
            fluid_velocity: [0.0, speed, 0.0],
            ..Drag::default()
        });
        scene.loads.damping.mass = 20.0;
        scene.time = Some(Time { scheme: Scheme::GeneralisedAlpha, ..Time::new(4.0, 5e-3) });
        let problem = scene.problem().unwrap();
        let mut run = Trajectory::new(&problem, &[], &[]).unwrap().keep_reactions();
        run.run(&problem, 800, |_| {}).unwrap();
        let [x, y, z] = run.reactions().last().unwrap().start.force;
        let off = (y + drag * speed * LENGTH).abs().max(x.abs()).max(z.abs());
        // Drag per length times length at the speed of the stream.
        assert!(off < 1e-6 * drag * speed * LENGTH, "{planar}: {x} {y} {z}");
    }
}
