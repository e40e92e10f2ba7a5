//! Derivatives of trajectories by every number that a scene has, on scenes of all kinds made from
//! seeds: against the whole run in dual numbers, and against differences of problems built anew.

use num_dual::Dual64;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rodfit::scene::*;
use rodfit::{AnyProblem, Parameter, Problem};
use std::collections::BTreeSet;

use crate::common::at_tip;
use crate::common::differences::{apart, difference, largest};

pub const SEEDS: u64 = 60;
/// The first seed of scenes with generalised-alpha.
const ALPHA: u64 = 48;
pub const STEPS: usize = 12;
/// Of the largest derivative, against the run in dual numbers.
const AGAINST_DUALS: f64 = 1e-9;
/// Numbers that move the rod by less, m, have derivatives of fewer digits: a billionth of it is a
/// hundred roundings of a position.
const FEWER_DIGITS: f64 = 5e-6;
/// What the default tolerance of Newton's method may leave of a derivative.
const LEFT: f64 = 1e-8;
/// Of the largest derivative, against differences.
const AGAINST_DIFFERENCES: f64 = 1e-6;

/// Chooses from lists, always alike for a seed.
struct Choice(ChaCha8Rng);

impl Choice {
    fn of<T: Clone>(&mut self, list: &[T]) -> T {
        list[self.0.random_range(0..list.len())].clone()
    }
    fn yes(&mut self) -> bool {
        self.0.random_range(0..2) == 1
    }
    fn near(&mut self, value: f64) -> f64 {
        value * self.0.random_range(0.8..1.25)
    }
    fn vector(&mut self, size: f64, planar: bool) -> [f64; 3] {
        let mut part = || size * self.0.random_range(-1.0..1.0);
        [part(), part(), if planar { 0.0 } else { part() }]
    }
}

/// A scene of the plane or of space.
pub fn scene(seed: u64, planar: bool) -> Scene {
    let mut c = Choice(ChaCha8Rng::seed_from_u64(seed));
    let length = c.near(0.5);
    let axis = c.vector(1.0, false);
    let helix = Shape::Helix {
        length,
        radius: 0.05,
        pitch: 0.1,
        axis,
        handedness: c.of(&[Handedness::Left, Handedness::Right]),
    };
    let direction = c.vector(1.0, planar);
    let straight = Shape::Straight { length, direction };
    let arc = Shape::Arc { length, angle: c.near(1.2) };
    let shape = if planar { c.of(&[straight, arc]) } else { c.of(&[straight, arc, helix]) };
    let up = if planar { [0.0, 0.0, 1.0] } else { [0.3, -0.4, 0.9] };
    let section = c.of(&[
        Section::Circle { radius: 0.005 },
        Section::Rectangle { width: 0.012, height: 0.008, up },
        Section::Custom { area: 8e-5, i1: 5e-10, i2: 4e-10, j: 6e-10, up },
    ]);
    let mut material = Material::new(c.near(1200.0), c.near(2e7));
    if c.yes() {
        material.poisson_ratio = Some(0.35);
    } else {
        material.shear_modulus = Some(8e6);
    }
    let curved = !matches!(shape, Shape::Straight { .. });
    let mut scene = Scene::new(7, shape, section, material);
    scene.rod.dimension = if planar { Dimension::Auto } else { Dimension::Spatial };
    if curved {
        scene.rod.natural_curvature = c.of(&[1.0.into(), 0.8.into(), vec![1.1, 0.7].into()]);
    }
    if !planar {
        scene.rod.natural_twist = c.of(&[0.0.into(), 2.0.into(), vec![1.0, -2.0, 0.5].into()]);
    }
    scene.rod.discretization = c.of(&[None, Some(Discretization::Paper)]);
    let supports = &mut scene.supports;
    (supports.start, supports.end) = c.of(&[
        (Support::Clamped, Support::Free),
        (Support::Clamped, Support::Clamped),
        (Support::Pinned, Support::Pinned),
        (Support::Clamped, Support::Roller),
        (Support::Free, Support::Free),
    ]);
    if supports.end == Support::Roller {
        supports.roller = Some(c.vector(1.0, planar));
    }
    supports.clamp = c.of(&[Clamp::MidEdge, Clamp::Nodes]);
    let scheme = c.of(&[
        Scheme::NewmarkBeta,
        Scheme::NewmarkBeta,
        Scheme::AverageVectorField,
        Scheme::Rodas4,
        Scheme::Verlet,
    ]);
    let scheme = if seed < ALPHA { scheme } else { Scheme::GeneralisedAlpha };
    let step = if scheme == Scheme::Verlet { 2e-5 } else { 1e-3 };
    let mut time = Time { scheme, ..Time::new(STEPS as f64 * step, step) };
    if scheme == Scheme::NewmarkBeta {
        time.beta = c.of(&[0.6, 0.7]);
    }
    if scheme == Scheme::GeneralisedAlpha {
        time.rho_inf = c.of(&[0.3, 0.8]);
    }
    if scheme.traits().takes_boundary_motion && supports.start == Support::Clamped && c.yes() {
        let motion = Motion {
            end: End::Start,
            displacement: c.vector(0.01, planar),
            rotation: if planar { [0.0, 0.0, 0.1] } else { c.vector(0.1, false) },
            twist: if planar { 0.0 } else { 0.2 },
            ..Motion::default()
        };
        supports.motion.push(Motion { frequency: Some(c.near(20.0)), ..motion.clone() });
        supports.motion.push(Motion { ramp: Some(c.near(0.02)), ..motion });
        // A gripper, which places a rod with a free end.
        if !planar && supports.end == Support::Free {
            let hand = crate::posed_ends::hand(0.1, 0.3);
            let mut gripper = crate::common::poses::driven(End::Start, hand);
            let pose = gripper.pose.as_mut().expect("a pose");
            (pose.offset, pose.rotation) = ([0.01, -0.02, 0.03], [0.2, -0.1, 0.3]);
            supports.motion.push(gripper);
        }
    }
    scene.loads.gravity = c.vector(9.8, planar);
    scene.loads.damping.mass = c.of(&[0.0, 1.5]);
    if scheme.traits().takes_viscosity {
        scene.loads.damping.stiffness = c.of(&[0.0, 2e-3]);
    }
    let force = c.vector(0.02, planar);
    let moment = if planar { [0.0, 0.0, 1e-3] } else { [0.0; 3] };
    scene.loads.point = vec![PointForce {
        node: c.of(&[Point::Tip, Point::Node(3), Point::ArcLength(0.11)]),
        force,
        moment,
        ..PointForce::default()
    }];
    if seed % 3 == 1 {
        let sine = Signal {
            kind: Some(SignalKind::Sine),
            amplitude: Some(0.8),
            frequency: Some(0.03 / step),
            phase: Some(0.3),
            gain: 1.3,
            delay: 0.2 * step,
            ..Signal::new("sine")
        };
        let node = Point::ArcLength(0.37 * length);
        let signal = Some(sine.name.clone());
        scene.signals = vec![sine];
        scene.loads.point.push(PointForce {
            node,
            force,
            moment: [0.0; 3],
            follower: false,
            signal,
        });
    }
    let held = supports_hold(&scene.supports);
    if held && c.yes() && scheme != Scheme::Verlet {
        scene.initial.state = InitialState::Equilibrium;
        let force = c.vector(0.02, planar);
        scene.initial.point = at_tip(force);
    } else {
        scene.initial.velocity = c.vector(0.3, planar);
        scene.initial.angular_velocity =
            if planar { [0.0, 0.0, 1.0] } else { c.vector(1.0, false) };
    }
    if planar && scene.initial.shape.is_none() && scene.supports.roller.is_none() {
        scene.supports.angle = c.of(&[0.0, 0.2]);
    }
    scene.time = Some(time);
    let marker = PointMass::new(Point::Tip, c.near(2e-3));
    // Derivatives jump where a mass passes a node.
    let disc = PointMass::new(Point::ArcLength(0.27 * length), 3e-3);
    scene.rod.mass =
        c.of(&[vec![], vec![marker], vec![PointMass::new(Point::Node(4), 2e-3), disc]]);
    taper(&mut scene, &mut c);
    if curved && c.yes() {
        scene.rod.natural_curvature = Along::linear(1.1, 0.7);
    }
    let soft = Compliance { rotation: 0.3, axial: 1e-4 };
    let supports = &mut scene.supports;
    if seed.is_multiple_of(3) && supports.start == Support::Clamped {
        supports.start_compliance = soft;
    }
    if seed.is_multiple_of(5) && supports.end == Support::Clamped {
        supports.end_compliance = soft;
    }
    scene
}

/// Factors along the rod on the numbers that its section and material have.
fn taper(scene: &mut Scene, c: &mut Choice) {
    if c.yes() {
        return;
    }
    let along = [Some(vec![0.9, 1.2, 0.8].into()), Some(Along::linear(1.1, 0.7))];
    let mut factor = || c.of(&[None, along[0].clone(), along[1].clone()]);
    let taper = &mut scene.rod.taper;
    (taper.density, taper.youngs_modulus) = (factor(), factor());
    if scene.material.shear_modulus.is_some() {
        taper.shear_modulus = factor();
    }
    match scene.rod.section {
        Section::Circle { radius } => {
            taper.radius = factor();
            scene.rod.section = Section::Tube { radius, thickness: 0.4 * radius };
            taper.thickness = factor();
        }
        Section::Rectangle { .. } => (taper.width, taper.height) = (factor(), factor()),
        _ => (taper.area, taper.i1, taper.i2, taper.j) = (factor(), factor(), factor(), factor()),
    }
}

fn supports_hold(supports: &Supports) -> bool {
    supports.start == Support::Clamped
}

/// Where all nodes are at the end, m.
pub fn end(problem: &Problem) -> Vec<f64> {
    let run = problem.simulate().unwrap();
    (0..problem.nodes()).flat_map(|i| run.node(i, STEPS)).collect()
}

/// The same with its derivative by a parameter, as fits use it.
pub fn derivative(problem: &Problem, parameter: Parameter) -> Vec<f64> {
    let nodes = problem.nodes();
    let (_, _, derivatives) = problem.simulate_with(&[parameter]).unwrap().into_parts();
    let last = &derivatives[0][STEPS * nodes..][..nodes];
    last.iter().flat_map(|[place, _]| *place).collect()
}

/// The derivative carried through the whole run.
pub fn in_duals(problem: &Problem, parameter: Parameter) -> Vec<f64> {
    let seed = |p, value| Dual64::new(value, f64::from(u8::from(p == parameter)));
    let time = problem.time().unwrap();
    let nodes = problem.nodes();
    macro_rules! run {
        ($discretized:expr) => {{
            let mut simulation = $discretized.simulation_over(seed).unwrap();
            (1..=STEPS).for_each(|k| simulation.step_to(time.at(k)).unwrap());
            let q = &simulation.state().q;
            use rodfit::problem::Model;
            (0..nodes).flat_map(|i| $discretized.model.position(q, i).map(|x| x.eps)).collect()
        }};
    }
    match problem.discretized() {
        AnyProblem::Planar(discretized) => run!(discretized),
        AnyProblem::Spatial(discretized) => run!(discretized),
    }
}

fn by_differences(problem: &Problem, parameter: Parameter) -> Vec<f64> {
    let value = parameter.of(problem.scene()).unwrap();
    // Zero is the middle of numbers of the size of one, but for loads and dampings.
    let h = match value == 0.0 {
        true => 1e-3,
        false => 2e-3 * value.abs(),
    };
    difference(problem, parameter, h, end)
}

#[test]
fn derivatives_of_random_scenes_by_every_number_equal_differences() {
    let mut seen = BTreeSet::new();
    let mut worst = [(0.0_f64, String::new()), (0.0, String::new())];
    let mut checked = [0; 2];
    let (mut differences, mut wrong, mut left) = (0, Vec::new(), 0.0_f64);
    for seed in 0..SEEDS {
        let planar = seed % 2 == 0;
        let scene = scene(seed, planar);
        let problem = match scene.problem() {
            Ok(problem) if problem.simulate().is_ok() => problem,
            // Rods that fold or find no rest are other tests' matter.
            _ => continue,
        };
        assert_eq!(problem.planar().is_some(), planar, "{seed}: {}", problem.model().1);
        let mut solved = scene.clone();
        solved.time.as_mut().unwrap().tolerance = StepTolerance::Rounding;
        let to_rounding = solved.problem().unwrap();
        checked[usize::from(planar)] += 1;
        let supports = &scene.supports;
        println!(
            "{seed}: {}, {:?} {:?} {:?}, {} motions, eta {}, {:?}",
            scene.scheme().name(),
            supports.start,
            supports.end,
            supports.clamp,
            supports.motion.len(),
            scene.loads.damping.stiffness,
            scene.initial.state
        );
        for parameter in Parameter::all(&scene) {
            if parameter.is_of_the_recording() {
                continue;
            }
            if let Err(refused) = problem.check_parameter(parameter) {
                let refused = refused.to_string();
                let why = [
                    "rod.dimension",
                    "planar scenes",
                    "supports.roller",
                    "curved rest",
                    "of an end without a clamp",
                    "with the scheme",
                ];
                assert!(why.iter().any(|why| refused.contains(why)), "{seed}: {refused}");
                continue;
            }
            seen.insert(parameter.path());
            let exact = derivative(&problem, parameter);
            // The run in dual numbers is solved to rounding, and so is this one: what a tolerance
            // leaves of a stiff rod's motion has its own derivatives.
            let solved = derivative(&to_rounding, parameter);
            let dual = in_duals(&problem, parameter);
            // The scheme's own number moves the rod by parts of what a step gets wrong, 1e-8 m.
            let least = if parameter.path() == "time.rho_inf" { 1e-4 } else { 0.0 };
            let size = largest(&dual).max(least);
            let off = apart(&solved, &dual);
            let label = format!("{seed}, {parameter}: {off:.1e} of {size:.1e}");
            // By how much a number of its size moves the rod, m: what moves it by nothing has no
            // digits to compare, and the rounding errors of differences need a thousandth of it.
            let value = parameter.of(&scene).unwrap().abs();
            let moved = size
                * match value == 0.0 {
                    // Dampings that are not there are times of milliseconds where they are.
                    true if parameter.is_positive() => 1e-3,
                    true => 1.0,
                    false => value,
                };
            if moved < 1e-12 {
                continue;
            }
            let few = (FEWER_DIGITS / moved).max(1.0);
            let tolerated = apart(&exact, &solved);
            if off > AGAINST_DUALS * size * few || tolerated > LEFT * size * few {
                wrong.push(label.clone());
            }
            left = left.max(apart(&exact, &solved) / size);
            if off > worst[0].0 * size {
                worst[0] = (off / size, label);
            }
            // Dampings that are not there cannot be less.
            if moved < 1e-6 || parameter.is_positive() && value == 0.0 {
                continue;
            }
            let difference = by_differences(&problem, parameter);
            let off = apart(&exact, &difference);
            let label = format!("{seed}, {parameter}: {off:.1e} of {size:.1e} by differences");
            if off > AGAINST_DIFFERENCES * size {
                wrong.push(label.clone());
            }
            differences += 1;
            if off > worst[1].0 * size {
                worst[1] = (off / size, label);
            }
        }
    }
    println!("{checked:?} scenes, {} numbers, {differences} by differences: {seen:?}", seen.len());
    println!("worst against duals {}, against differences {}", worst[0].1, worst[1].1);
    println!("the default tolerance leaves at most {left:.1e} of a derivative");
    assert!(wrong.is_empty(), "{wrong:#?}");
    assert!(checked.iter().all(|scenes| *scenes >= 6), "{checked:?}");
    assert!(seen.len() >= 50, "{}", seen.len());
}

/// A rod given by points has their scale as a number; its file is read once, another file anew.
#[test]
fn polyline_shape_has_a_scale_and_is_read_once() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str, bend: f64| {
        let line = |i: u32| {
            let s = 0.05 * f64::from(i);
            format!("{s},{},0\n", bend * s * s)
        };
        let path = folder.path().join(name);
        std::fs::write(&path, format!("x,y,z\n{}", (0..9).map(line).collect::<String>())).unwrap();
        path
    };
    let unread = Shape::polyline(file("bent.csv", 0.8));
    let refused = unread.mesh(None, [0.5, 0.0]).unwrap_err().to_string();
    assert!(refused.contains("has not been read"), "{refused}");
    let section = Section::Circle { radius: 0.005 };
    let mut scene = Scene::new(8, unread, section, Material::new(1200.0, 2e7));
    scene.loads.gravity = [0.0, -9.8, 0.0];
    scene.time = Some(Time::new(STEPS as f64 * 1e-3, 1e-3));
    let problem = scene.problem().unwrap();
    let scale: Parameter = "rod.shape.scale".parse().unwrap();
    let exact = derivative(&problem, scale);
    let size = largest(&exact);
    assert!(apart(&exact, &in_duals(&problem, scale)) < AGAINST_DUALS * size);
    assert!(apart(&exact, &by_differences(&problem, scale)) < AGAINST_DIFFERENCES * size);
    // The file is read by now, and another one is named.
    let mut other = problem.scene().clone();
    let Shape::Polyline { file: path, .. } = &mut other.rod.shape else { unreachable!() };
    *path = file("more.csv", 1.6);
    assert!(apart(&end(&other.problem().unwrap()), &end(&problem)) > 0.05);
}

/// A problem with other values is the problem of the scene with these values, and no older one.
#[test]
fn problem_with_other_values_equals_that_of_the_changed_scene() {
    let tip = |problem: &Problem| problem.equilibrium().unwrap().tip;
    let shape = Shape::Arc { length: 0.5, angle: 0.9 };
    let mut arc =
        Scene::new(30, shape, Section::Circle { radius: 0.005 }, Material::new(1200.0, 1e7));
    arc.loads.gravity = [0.0, -9.8, 0.0];
    let fresh = arc.problem().unwrap();
    // Whether joints count as curved goes with the natural curvature.
    arc.rod.natural_curvature = 0.0.into();
    let straightened = arc.problem().unwrap();
    assert!(apart(&tip(&straightened), &tip(&fresh)) > 1e-3);
    let again = straightened.with([(Parameter::NaturalCurvature, 1.0)]).unwrap();
    assert_eq!(tip(&again), tip(&fresh));
    // A square lies in any plane, and a rectangle askew to it in none.
    let up = [0.0, 1.0, 1.0];
    let mut square = arc.clone();
    square.rod.natural_curvature = 1.0.into();
    square.rod.section = Section::Rectangle { width: 0.01, height: 0.01, up };
    square.material.poisson_ratio = Some(0.3);
    let problem = square.problem().unwrap();
    assert!(problem.planar().is_some());
    square.rod.section = Section::Rectangle { width: 0.02, height: 0.01, up };
    let fresh = square.problem().unwrap();
    assert!(fresh.planar().is_none());
    assert_eq!(tip(&problem.with([(Parameter::Width, 0.02)]).unwrap()), tip(&fresh));
}
