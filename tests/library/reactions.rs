//! Reactions of supports in a motion: balance of angular momentum, the static limit, and derivatives by all numbers.

use num_dual::Dual64;
use rodfit::scene::{
    Clamp, Drag, End, InitialState, Interpolation, Motion, PointForce, Recorded, Scene, Scheme,
    Signal, SignalKind, StepTolerance, Support, Time, Track,
};
use rodfit::{Parameter, Point, Problem, Reactions, Trajectory};

use crate::calls::short;
use crate::common::helix_with;

/// Axial stiffness of the stiffest rod here, N.
const EA: f64 = 8e3;

/// The reactions at all recorded times of a run of the whole scene, with their derivatives.
fn run(problem: &Problem, parameters: &[Parameter]) -> Trajectory {
    let mut run = Trajectory::new(problem, &[0], parameters).unwrap().keep_reactions();
    run.run(problem, problem.time().unwrap().steps(), |_| {}).unwrap();
    run
}

/// Forces and moments of both ends at all times in one list.
fn flat<D: Copy>(reactions: &[Reactions<D>]) -> Vec<D> {
    let of = |r: &Reactions<D>| [r.start.force, r.start.moment, r.end.force, r.end.moment];
    reactions.iter().flat_map(of).flatten().collect()
}

/// The change of angular momentum about the wall over each step less the impulse of the moments by the trapezoidal rule, over
/// the largest angular momentum: the largest value of all steps.
fn angular_defect(step: f64) -> f64 {
    let mut scene = short();
    scene.time = Some(Time { tolerance: StepTolerance::Rounding, ..Time::new(0.1, step) });
    let problem = scene.problem().unwrap();
    let mass = problem.planar().unwrap().rod().mass;
    let all: Vec<usize> = (0..problem.nodes()).collect();
    let mut run = Trajectory::new(&problem, &all, &[]).unwrap().keep_reactions();
    run.run(&problem, problem.time().unwrap().steps(), |_| {}).unwrap();
    let (reactions, times, g) = (run.reactions(), run.times(), scene.loads.gravity);
    let about_wall = |k: usize, i: usize, v: [f64; 3]| {
        let x = run.node(i, k);
        x[0] * v[1] - x[1] * v[0]
    };
    let outside = || 1..problem.nodes();
    let momentum =
        |k: usize| outside().map(|i| mass[2 * i] * about_wall(k, i, run.velocity(i, k))).sum();
    let moment = |k: usize| {
        let weight: f64 = outside().map(|i| mass[2 * i] * about_wall(k, i, g)).sum();
        reactions[k].start.moment[2] + weight
    };
    let momenta: Vec<f64> = (0..times.len()).map(momentum).collect();
    let largest = momenta.iter().fold(0.0_f64, |most, l| most.max(l.abs()));
    let defect = |k: usize| {
        let impulse = 0.5 * (times[k] - times[k - 1]) * (moment(k - 1) + moment(k));
        (momenta[k] - momenta[k - 1] - impulse).abs() / largest
    };
    (1..times.len()).map(defect).fold(0.0, f64::max)
}

#[test]
fn moment_of_wall_balances_angular_momentum_to_second_order() {
    let [coarse, fine] = [1e-3, 5e-4].map(angular_defect);
    // The scheme is of second order, its defect in one step of third order for the modes that the step resolves.
    println!("defect per step {coarse:e}, {fine:e}");
    assert!(coarse < 1e-6 && coarse / fine > 4.0, "{coarse:e} {fine:e}");
}

#[test]
fn reactions_of_motion_that_has_come_to_rest_equal_those_at_rest() {
    let mut helix = helix_with(0.5, 2e-3, 2.0, Clamp::MidEdge);
    helix.rod.segments = Some(20);
    helix.material.poisson_ratio = Some(0.4);
    for mut scene in [short(), helix] {
        scene.loads.damping.mass = 8.0;
        scene.loads.damping.stiffness = 0.02;
        // The dissipative scheme damps axial waves, which the steps do not resolve.
        let tolerance = StepTolerance::Rounding;
        scene.time = Some(Time { tolerance, beta: 0.7, ..Time::new(8.0, 8e-3) });
        let problem = scene.problem().unwrap();
        let found = flat(&run(&problem, &[]).reactions()[1000..]);
        let rest = flat(&[problem.equilibrium().unwrap().reactions]);
        let size = rest.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
        // Remaining motion after 8 s at a rate of 4/s, and the tolerance of the equilibrium.
        for (a, b) in found.iter().zip(&rest) {
            assert!((a - b).abs() < 1e-6 * size, "{found:?} {rest:?}");
        }
        // The wall alone carries the weight of the rod outside of it: the same from `static`.
        assert!(size > 0.0 && found[6..].iter().all(|x| *x == 0.0), "{found:?}");
    }
}

/// A moving, viscous rod in a stream with loads in time, in the plane or in space.
fn rich(planar: bool, scheme: Scheme) -> Scene {
    let mut scene = match planar {
        true => short(),
        false => helix_with(0.5, 1e-3, 0.02, Clamp::MidEdge),
    };
    scene.rod.segments = Some(8);
    scene.material.poisson_ratio = Some(0.4);
    scene.loads.damping.mass = 0.7;
    scene.loads.damping.stiffness = 3e-3;
    scene.loads.drag = Some(Drag {
        linear_normal: 0.02,
        linear_tangential: 0.01,
        quadratic_normal: 0.03,
        quadratic_tangential: 0.01,
        fluid_velocity: [6.0, -5.0, if planar { 0.0 } else { 3.0 }],
        fluid_density: 300.0,
        added_mass: 0.003,
    });
    let name = Some("s".to_string());
    let force = [0.03, -0.04, if planar { 0.0 } else { 0.02 }];
    let moment = [0.0; 3];
    scene.loads.point.push(PointForce {
        node: Point::ArcLength(0.31),
        force,
        moment,
        signal: name,
        follower: false,
    });
    scene.signals = vec![Signal {
        kind: Some(SignalKind::Sine),
        amplitude: Some(0.8),
        frequency: Some(40.0),
        phase: Some(0.3),
        interpolation: Interpolation::Linear,
        ..Signal::new("s")
    }];
    scene.supports.motion = vec![Motion {
        displacement: [0.01, 0.02, if planar { 0.0 } else { -0.01 }],
        rotation: [0.0, 0.0, 0.2],
        frequency: Some(12.0),
        end: End::Start,
        ..Motion::default()
    }];
    let time = Time::new(0.02, 1e-3);
    scene.time = Some(Time { scheme, rho_inf: 0.4, tolerance: StepTolerance::Rounding, ..time });
    scene
}

/// A cable whose start follows two recorded markers.
fn recorded() -> Scene {
    let times: Vec<f64> = (0..30).map(|k| 0.002 * f64::from(k)).collect();
    let place = |j: usize, t: f64| [0.1 * j as f64, 0.02 * (20.0 * t).sin(), 0.0];
    let marker =
        |j: usize| (format!("{j}"), times.iter().map(|t| Some(place(j, *t))).collect::<Vec<_>>());
    let mut scene = short();
    scene.rod.segments = Some(10);
    scene.initial.state = InitialState::Recorded;
    scene.supports.start = Support::Recorded;
    scene.supports.path =
        Some(Recorded::of(Track::new(times.clone(), (0..6).map(marker).collect()).unwrap()));
    let time = Time::new(0.02, 1e-3);
    scene.time = Some(Time { tolerance: StepTolerance::Rounding, ..time });
    scene
}

/// Checks the derivatives of the reactions of a run by every number against the run in dual numbers, and for a `smooth`
/// solution against differences. Returns how many were checked.
fn check(problem: &Problem, is_static: bool) -> usize {
    let mut checked = 0;
    for parameter in Parameter::all(problem.scene()) {
        let name = parameter.to_string();
        let value = parameter.of(problem.scene()).unwrap();
        // Dampings that are absent cannot be less.
        let is_absent = parameter.is_positive() && value == 0.0;
        let is_other =
            parameter.is_of_the_recording() || problem.check_parameter(parameter).is_err();
        if is_absent || is_other {
            continue;
        }
        let made = |problem: &Problem, parameters: &[Parameter]| match is_static {
            false => run(problem, parameters),
            true => {
                let rest = Trajectory::new(problem, &[0], parameters).unwrap();
                rest.keep_reactions().find_equilibrium().unwrap()
            }
        };
        let plain = made(problem, &[parameter]);
        let exact = flat(&plain.reaction_rates()[0]);
        let seed = |p, value| Dual64::new(value, f64::from(u8::from(p == parameter)));
        let dual = flat(&plain.over(seed).unwrap().reactions());
        let dual: Vec<f64> = dual.iter().map(|x| x.eps).collect();
        let size = dual.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
        let unit = if value == 0.0 { 1.0 } else { value.abs() };
        let largest = flat(&plain.reactions()).iter().fold(0.0_f64, |most, x| most.max(x.abs()));
        // Numbers without an effect on the reactions.
        if size * unit < 1e-7 * largest {
            continue;
        }
        let apart = |a: &[f64], b: &[f64]| {
            a.iter().zip(b).fold(0.0_f64, |most, (a, b)| most.max((a - b).abs())) / size
        };
        let off = apart(&exact, &dual);
        // Rounding errors of places, 2e-14 m at both ends of edges of 4 cm, are strains of 1e-12. Times EA they limit
        // parameters with little effect.
        let rounding = 1e-12 * EA / (size * unit);
        println!("{name}: {size:.1e}, off by {off:.1e}, allowed {rounding:.1e}");
        assert!(off < rounding.max(1e-9), "{name}: {off:e}");
        checked += 1;
        // Numbers of the scheme stand at the end of their range.
        if name.starts_with("time.") {
            continue;
        }
        // Five points: truncation errors of fourth order.
        let h = 2e-4 * unit;
        let at = |k: f64| {
            let changed = problem.with([(parameter, value + k * h)]).unwrap();
            flat(&made(&changed, &[]).reactions())
        };
        let [a, b, c, d] = [1.0, -1.0, 2.0, -2.0].map(at);
        let by_difference: Vec<f64> =
            (0..exact.len()).map(|i| (8.0 * (a[i] - b[i]) - (c[i] - d[i])) / (12.0 * h)).collect();
        let difference = apart(&exact, &by_difference);
        println!("{name}: {size:.1e}, off by {off:.1e}, differences {difference:.1e}");
        let worst = (0..exact.len()).max_by(|i, j| {
            let apart = |i: usize| (exact[i] - by_difference[i]).abs();
            apart(*i).total_cmp(&apart(*j))
        });
        let worst = worst.map(|i| (i, exact[i], by_difference[i]));
        let tolerance = 1e-6_f64.max(1e-6 * largest / (size * unit));
        assert!(difference < tolerance, "{name}: {difference:e} {worst:?}");
    }
    checked
}

#[test]
fn derivatives_of_reactions_equal_dual_numbers_and_differences() {
    let mut checked = 0;
    for scheme in [Scheme::NewmarkBeta, Scheme::GeneralisedAlpha, Scheme::AverageVectorField] {
        for planar in [true, false] {
            let mut scene = rich(planar, scheme);
            // This scheme takes no drag.
            if scheme == Scheme::AverageVectorField {
                scene.loads.drag = None;
            }
            checked += check(&scene.problem().unwrap(), false);
        }
    }
    let mut elastic = short();
    elastic.rod.segments = Some(8);
    elastic.time = Some(Time { scheme: Scheme::Rodas4, ..Time::new(0.02, 1e-3) });
    checked += check(&elastic.problem().unwrap(), false);
    println!("{checked} derivatives");
    assert!(checked > 60, "{checked}");
}

#[test]
fn derivatives_of_reactions_of_recorded_end_equal_dual_numbers_and_differences() {
    let checked = check(&recorded().problem().unwrap(), false);
    assert!(checked > 5, "{checked}");
}

#[test]
fn derivatives_of_reactions_at_rest_equal_dual_numbers_and_differences() {
    let mut between = short();
    (between.supports.start, between.supports.end) = (Support::Pinned, Support::Clamped);
    let mut helix = helix_with(0.5, 1e-3, 0.1, Clamp::MidEdge);
    helix.rod.segments = Some(12);
    helix.material.poisson_ratio = Some(0.4);
    let checked: usize =
        [short(), between, helix].map(|scene| check(&scene.problem().unwrap(), true)).iter().sum();
    assert!(checked > 10, "{checked}");
}
