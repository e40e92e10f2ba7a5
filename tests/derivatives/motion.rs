//! Sensitivities against the whole simulation run in dual numbers.

use nalgebra::Vector3;
use num_dual::{Dual64, DualSVec64};
use rodfit::numerics::tangent::Factors;
use rodfit::problem::Model;
use rodfit::scene::{
    Clamp, Damping, Friction, Material, Maxwell, PointForce, Scene, Scheme, Section, Shape,
    StepTolerance, Support, Time,
};
use rodfit::{AnyProblem, Derivatives, Discretized, Parameter, Point, Problem};

use crate::common::{at_tip, cantilever, cantilever_with, helix_with, planar, straight_rod};

/// Both routes solve the same equations to rounding. What remains are the rounding errors of the
/// two trajectories, which beta = 0.5 does not damp.
pub const LARGEST: f64 = 1e-9;

/// Largest difference between the derivatives of all nodes at all steps and those of the
/// simulation in dual numbers, over the largest derivative of the run.
pub fn mismatch(scene: &Scene, parameter: Parameter, derivatives: Derivatives) -> f64 {
    let problem = scene.problem().unwrap().with_derivatives(derivatives);
    match problem.discretized() {
        AnyProblem::Planar(discretized) => mismatch_of(&problem, &discretized, parameter),
        AnyProblem::Spatial(discretized) => mismatch_of(&problem, &discretized, parameter),
    }
}

fn mismatch_of<M: Model>(
    problem: &Problem,
    discretized: &Discretized<'_, M>,
    parameter: Parameter,
) -> f64 {
    let run = problem.simulate_with(&[parameter]).unwrap();
    let mut oracle = discretized
        .simulation_over(|p, value| Dual64::new(value, if p == parameter { 1.0 } else { 0.0 }))
        .unwrap();
    let time = problem.time().unwrap();
    let (mut worst, mut size) = (0.0_f64, 0.0_f64);
    for k in 1..=time.steps() {
        oracle.step_to(time.at(k)).unwrap();
        let rates: Vec<f64> = oracle.state().q.iter().map(|q| q.eps).collect();
        for node in 0..problem.nodes() {
            let (_, derivative) = run.at(Point::Node(node), time.at(k)).unwrap();
            let exact = Vector3::from(discretized.model.rate(&rates, node));
            worst = worst.max((Vector3::from(derivative[0]) - exact).norm());
            size = size.max(exact.norm());
        }
    }
    assert!(size > 0.0, "{parameter} has no effect");
    worst / size
}

#[test]
fn derivatives_of_an_undamped_cantilever_equal_dual_numbers() {
    for (beta, step) in [(0.5, 1e-3), (0.8, 5e-3), (1.0, 1e-3)] {
        for clamp in [Clamp::MidEdge, Clamp::Nodes] {
            let scene = cantilever_with(beta, step, 0.5, clamp);
            for parameter in
                [Parameter::YoungsModulus, Parameter::Density, Parameter::Radius, Parameter::Beta]
            {
                let error = mismatch(&scene, parameter, Derivatives::Hand);
                println!("beta {beta}, step {step}, {clamp:?}, {parameter}: {error:.1e}");
                assert!(error < LARGEST, "beta {beta}, {clamp:?}, {parameter}: {error:e}");
            }
        }
    }
}

/// A curved rod with an end force and both dampings, at a step that does not divide the duration.
pub fn rich_scene() -> Scene {
    let mut scene = cantilever();
    scene.rod.shape = Shape::Arc { length: 0.6, angle: 1.2 };
    scene.rod.segments = Some(30);
    scene.loads.damping.mass = 0.7;
    scene.loads.damping.stiffness = 3e-3;
    scene.loads.point = at_tip([0.1, -0.2, 0.0]);
    scene.time = Some(Time { beta: 0.6, ..Time::new(0.4013, 2e-3) });
    scene
}

#[test]
fn derivatives_of_a_damped_curved_rod_equal_dual_numbers() {
    for parameter in [
        Parameter::YoungsModulus,
        Parameter::Density,
        Parameter::Radius,
        Parameter::Beta,
        Parameter::DampingMass,
        Parameter::DampingStiffness,
    ] {
        for derivatives in [Derivatives::Hand, Derivatives::Dual] {
            let error = mismatch(&rich_scene(), parameter, derivatives);
            println!("{parameter}, {derivatives:?}: {error:.1e}");
            assert!(error < LARGEST, "{parameter}, {derivatives:?}: {error:e}");
        }
    }
}

/// Damping that is zero still has a derivative by the mass-proportional part.
#[test]
fn derivative_by_zero_mass_damping_equals_dual_numbers() {
    let mut scene = rich_scene();
    scene.loads.damping = Default::default();
    let error = mismatch(&scene, Parameter::DampingMass, Derivatives::Hand);
    assert!(error < LARGEST, "{error:e}");
}

#[test]
fn derivatives_with_every_support_equal_dual_numbers() {
    for (start, end) in [
        (Support::Pinned, Support::Free),
        (Support::Free, Support::Pinned),
        (Support::Clamped, Support::Clamped),
        (Support::Pinned, Support::Clamped),
    ] {
        let mut scene = rich_scene();
        scene.supports.start = start;
        scene.supports.end = end;
        scene.loads.point[0].node = rodfit::Point::Node(9);
        let error = mismatch(&scene, Parameter::YoungsModulus, Derivatives::Hand);
        assert!(error < LARGEST, "{start:?} {end:?}: {error:e}");
    }
}

#[test]
fn derivatives_of_a_rectangular_section_equal_dual_numbers() {
    let mut scene = rich_scene();
    scene.rod.section = Section::Rectangle { width: 0.01, height: 0.004, up: [0.0, 1.0, 0.0] };
    let error = mismatch(&scene, Parameter::YoungsModulus, Derivatives::Hand);
    assert!(error < LARGEST, "{error:e}");
    assert!(
        scene.problem().unwrap().simulate_with(&[Parameter::Radius]).is_err(),
        "no radius to vary"
    );
}

/// E and beta together: the same numbers as one at a time, and as a simulation with both seeded.
/// Derivatives do not depend on what else is derived, to the last bit.
fn assert_same_in_any_company(problem: &Problem, all: &[Parameter]) {
    let end = problem.time().unwrap().end;
    let rates = |parameters: &[Parameter]| {
        problem.simulate_with(parameters).unwrap().at(Point::Tip, end).unwrap().1
    };
    let together = rates(all);
    for size in [1, 2, 3] {
        let apart: Vec<_> = all.chunks(size).flat_map(rates).collect();
        assert_eq!(apart, together, "{size} at a time");
    }
}

#[test]
fn derivatives_of_spatial_rods_are_the_same_in_any_group() {
    let scene = helix_with(0.5, 1e-3, 0.05, Clamp::MidEdge);
    let all = [
        Parameter::YoungsModulus,
        Parameter::PoissonRatio,
        Parameter::Beta,
        Parameter::Density,
        Parameter::Radius,
        Parameter::NaturalCurvature,
        Parameter::DampingMass,
    ];
    assert_same_in_any_company(&scene.problem().unwrap(), &all);
}

#[test]
fn derivatives_of_planar_rods_are_the_same_in_any_group() {
    let scene = cantilever_with(0.7, 2e-3, 0.4, Clamp::MidEdge);
    let problem = scene.problem().unwrap();
    let all = [
        Parameter::YoungsModulus,
        Parameter::Beta,
        Parameter::Density,
        Parameter::Radius,
        Parameter::DampingMass,
    ];
    let together = problem.simulate_with(&all).unwrap();
    // The oracle: the whole simulation in dual numbers with two derivatives.
    let mut oracle = planar(&problem)
        .simulation_over(|p, value| {
            let seeded = DualSVec64::<2>::from_re(value);
            match [Parameter::YoungsModulus, Parameter::Beta].iter().position(|own| *own == p) {
                Some(i) => seeded.derivative(i),
                None => seeded,
            }
        })
        .unwrap();
    let time = problem.time().unwrap();
    for k in 1..=time.steps() {
        oracle.step_to(time.at(k)).unwrap();
    }
    let (_, at_end) = together.at(Point::Tip, time.end).unwrap();
    assert_same_in_any_company(&problem, &all);
    let tip: &[_; 2] = oracle.state().q.last_chunk().unwrap();
    for (c, tip) in tip.iter().enumerate() {
        let eps = tip.eps.unwrap_generic(nalgebra::U2, nalgebra::U1);
        for i in 0..2 {
            assert!(
                (eps[i] / at_end[i][c] - 1.0).abs() < 1e-9,
                "{i} {c}: {} {}",
                eps[i],
                at_end[i][c]
            );
        }
    }
}

/// With Kelvin-Voigt damping, relaxation and friction.
#[test]
fn derivatives_with_slipping_springs_are_the_same_in_any_group() {
    for mut scene in [
        cantilever_with(0.7, 2e-3, 0.1, Clamp::MidEdge),
        helix_with(0.5, 1e-3, 0.03, Clamp::MidEdge),
    ] {
        scene.loads.damping = Damping {
            mass: 0.3,
            stiffness: 1e-3,
            bending: 2e-3,
            maxwell: Maxwell { stiffness: 0.4, time: 0.02 }.into(),
            friction: Some(Friction { stiffness: 0.8, curvature: 0.1 }),
            ..Damping::default()
        };
        let problem = scene.problem().unwrap();
        let of_damping = |p: &Parameter| p.to_string().contains("damping");
        let mut all: Vec<Parameter> =
            Parameter::all(problem.scene()).into_iter().filter(of_damping).collect();
        all.extend([Parameter::YoungsModulus, Parameter::Density, Parameter::Radius]);
        assert!(all.len() >= 10);
        assert_same_in_any_company(&problem, &all);
    }
}

/// A rod without damping of its strains has no memory of them, until one asks what such a damping would do.
#[test]
fn derivatives_by_zero_viscous_damping_equal_dual_numbers() {
    let [stiffness, bending, stretching, twisting] =
        ["stiffness", "bending", "stretching", "twisting"]
            .map(|key| format!("loads.damping.{key}").parse::<Parameter>().unwrap());
    let schemes = [Scheme::NewmarkBeta, Scheme::GeneralisedAlpha, Scheme::AverageVectorField];
    for scheme in schemes {
        // Not 0.5, which leaves axial vibrations, and their rounding errors, as they are.
        let mut plane = cantilever_with(0.7, 2e-3, 0.05, Clamp::MidEdge);
        let mut space = helix_with(0.7, 2e-3, 0.05, Clamp::MidEdge);
        for scene in [&mut plane, &mut space] {
            scene.loads.damping = Damping::default();
            let tolerance = StepTolerance::Rounding;
            scene.time = scene.time.take().map(|time| Time { scheme, tolerance, ..time });
        }
        for (scene, of) in [(&plane, stretching), (&space, twisting)] {
            for parameter in [stiffness, bending, of] {
                let error = mismatch(scene, parameter, Derivatives::Hand);
                // Rounding errors of axial vibrations, a thousand times as fast, leave it more: 1.5e-9 with newmark-beta.
                let most = if parameter == stretching { 2e-8 } else { LARGEST };
                assert!(error < most, "{scheme:?}, {parameter}: {error:e}");
                let problem = scene.problem().unwrap();
                let tip = |run: rodfit::Trajectory| run.at(Point::Tip, 0.05).unwrap();
                let at = |time: f64| {
                    tip(problem.with([(parameter, time)]).unwrap().simulate().unwrap()).0
                };
                let exact = tip(problem.simulate_with(&[parameter]).unwrap()).1[0];
                let h = 1e-6;
                let [none, some, twice] = [0.0, h, 2.0 * h].map(at);
                let size = Vector3::from(exact).norm();
                for c in 0..3 {
                    let difference = (4.0 * some[c] - 3.0 * none[c] - twice[c]) / (2.0 * h);
                    let off = (difference - exact[c]).abs();
                    assert!(
                        off < 1e-3 * size + 1e-8,
                        "{scheme:?}, {parameter}: {difference} {exact:?}"
                    );
                }
            }
        }
    }
    // Schemes that take no such damping have no derivatives by it.
    let mut scene = cantilever_with(0.5, 2e-3, 0.05, Clamp::MidEdge);
    scene.time = scene.time.map(|time| Time { scheme: Scheme::Rodas4, ..time });
    let error = scene.problem().unwrap().simulate_with(&[bending]).err().unwrap().to_string();
    assert!(error.contains("loads.damping.bending with the scheme rodas4"), "{error}");
}

/// Between the steps, the derivative of the interpolant.
#[test]
fn derivatives_between_steps_equal_differences() {
    let scene = cantilever_with(0.5, 2e-3, 0.3, Clamp::MidEdge);
    let problem = scene.problem().unwrap();
    let (point, time) = (Point::ArcLength(0.317), 0.2117);
    let (_, exact) =
        problem.simulate_with(&[Parameter::YoungsModulus]).unwrap().at(point, time).unwrap();
    let e = scene.material.youngs_modulus;
    let at = |factor: f64| {
        let other = problem.with([(Parameter::YoungsModulus, e * factor)]).unwrap();
        other.simulate().unwrap().at(point, time).unwrap().0
    };
    let h = 1e-5;
    let (ahead, behind) = (at(1.0 + h), at(1.0 - h));
    for c in 0..2 {
        let difference = (ahead[c] - behind[c]) / (2.0 * h * e);
        assert!((difference / exact[0][c] - 1.0).abs() < 1e-7, "{c}: {difference} {}", exact[0][c]);
    }
}

/// A material point of a straight rod at rest stays where it is when the rod becomes longer, also at a node, whose
/// neighbors have the weight zero there, but derivatives of it.
#[test]
fn derivative_by_length_at_a_node_is_that_of_the_material_point() {
    let material = Material { poisson_ratio: Some(0.4), ..Material::new(1200.0, 1e8) };
    let mut scene = straight_rod(8, [1.0, 0.005], material);
    scene.supports.clamp = Clamp::Nodes;
    scene.time = Some(Time::new(0.01, 1e-3));
    let run =
        scene.problem().unwrap().simulate_with(&["rod.shape.length".parse().unwrap()]).unwrap();
    for s in [0.5, 0.55] {
        let (position, by) = run.at(Point::ArcLength(s), 0.0).unwrap();
        assert!((position[0] - s).abs() < 1e-12, "{position:?}");
        assert!(by[0][0].abs() < 1e-12, "at {s} m: {by:?}");
    }
}

/// Where the step's tangent is indefinite (a rod on its way to buckling, at a step that is large
/// for it), the solutions are checked and still exact.
#[test]
fn derivatives_with_an_indefinite_tangent_equal_dual_numbers() {
    let mut scene = rich_scene();
    scene.rod.shape = Shape::Arc { length: 0.6, angle: 0.02 };
    scene.loads.damping = Default::default();
    scene.loads.gravity = [0.0; 3];
    scene.loads.point[0].force = [-5.0, 0.1, 0.0];
    scene.time = Some(Time { beta: 1.0, ..Time::new(0.6, 3e-2) });
    let problem = scene.problem().unwrap();
    let mut simulation = planar(&problem).simulation().unwrap();
    simulation.keep_tangent();
    let negative = (1..=20).filter(|k| {
        simulation.step_to(f64::from(*k) * 3e-2).unwrap();
        simulation.linearization().unwrap().factors.negative_pivots() > 0
    });
    assert!(negative.count() > 0, "the scene is meant to pass through an indefinite tangent");
    let error = mismatch(&scene, Parameter::YoungsModulus, Derivatives::Hand);
    assert!(error < LARGEST, "{error:e}");
}

/// In space every derivative also travels through the frames. The rest shape is curved.
#[test]
fn derivatives_of_a_helix_equal_dual_numbers() {
    for (beta, step, clamp) in [(0.5, 1e-3, Clamp::Nodes), (0.9, 5e-3, Clamp::MidEdge)] {
        let mut scene = helix_with(beta, step, 0.5, clamp);
        for parameter in [
            Parameter::YoungsModulus,
            Parameter::PoissonRatio,
            Parameter::Density,
            Parameter::Radius,
            Parameter::Beta,
            Parameter::NaturalCurvature,
        ] {
            let error = mismatch(&scene, parameter, Derivatives::Hand);
            println!("beta {beta}, step {step}, {clamp:?}, {parameter}: {error:.1e}");
            assert!(error < LARGEST, "beta {beta}, {clamp:?}, {parameter}: {error:e}");
        }
        (scene.material.poisson_ratio, scene.material.shear_modulus) = (None, Some(4e6));
        let error = mismatch(&scene, Parameter::ShearModulus, Derivatives::Hand);
        println!("beta {beta}, step {step}, {clamp:?}, shear_modulus: {error:.1e}");
        assert!(error < LARGEST, "{error:e}");
    }
}

/// A flat helix with a rectangular section, pulled sideways and damped, held at both ends in turn.
#[test]
fn derivatives_of_a_damped_twisted_rod_equal_dual_numbers() {
    for (start, end) in [
        (Support::Clamped, Support::Free),
        (Support::Clamped, Support::Clamped),
        (Support::Pinned, Support::Pinned),
        (Support::Free, Support::Free),
    ] {
        let mut scene = helix_with(0.6, 2e-3, 0.2, Clamp::MidEdge);
        scene.rod.segments = Some(30);
        scene.rod.natural_curvature = 0.8.into();
        scene.rod.natural_twist = 3.0.into();
        scene.rod.section = Section::Rectangle { width: 0.01, height: 0.004, up: [1.0, 0.3, 0.0] };
        scene.supports.start = start;
        scene.supports.end = end;
        scene.loads.damping.mass = 0.7;
        scene.loads.damping.stiffness = 3e-3;
        let force = [0.1, -0.05, 0.02];
        scene.loads.point =
            vec![PointForce { node: rodfit::Point::Node(20), force, ..PointForce::default() }];
        for parameter in [
            Parameter::YoungsModulus,
            Parameter::PoissonRatio,
            Parameter::Density,
            Parameter::Beta,
            Parameter::NaturalCurvature,
            Parameter::NaturalTwist,
            Parameter::Width,
            Parameter::Height,
            Parameter::DampingMass,
            Parameter::DampingStiffness,
        ] {
            let error = mismatch(&scene, parameter, Derivatives::Hand);
            println!("{start:?} {end:?} {parameter}: {error:.1e}");
            assert!(error < LARGEST, "{start:?} {end:?} {parameter}: {error:e}");
        }
        let error = mismatch(&scene, Parameter::NaturalCurvature, Derivatives::Dual);
        println!("{start:?} {end:?} natural_curvature by num-dual: {error:.1e}");
        assert!(error < LARGEST, "{error:e}");
    }
}

/// The average vector field: forces along the whole step depend on its start.
#[test]
fn derivatives_of_the_average_vector_field_equal_dual_numbers() {
    let average = |mut scene: Scene| {
        scene.time.as_mut().unwrap().scheme = Scheme::AverageVectorField;
        scene
    };
    let mut damped = helix_with(0.5, 2e-3, 0.2, Clamp::MidEdge);
    damped.loads.damping.mass = 0.7;
    damped.loads.damping.stiffness = 3e-3;
    let scenes = [
        ("cantilever", cantilever_with(0.5, 5e-3, 0.5, Clamp::MidEdge)),
        ("damped arc", rich_scene()),
        ("helix", helix_with(0.5, 5e-3, 0.4, Clamp::Nodes)),
        ("damped helix", damped),
    ];
    for (name, scene) in scenes {
        let scene = average(scene);
        for parameter in [
            Parameter::YoungsModulus,
            Parameter::Density,
            Parameter::Radius,
            Parameter::NaturalCurvature,
            Parameter::DampingStiffness,
        ] {
            let idle = parameter == Parameter::NaturalCurvature && name == "cantilever"
                || parameter == Parameter::DampingStiffness && !name.contains("damped");
            if !idle {
                let error = mismatch(&scene, parameter, Derivatives::Hand);
                println!("{name}, {parameter}: {error:.1e}");
                assert!(error < LARGEST, "{name}, {parameter}: {error:e}");
            }
        }
        assert!(Parameter::Beta.of(&scene).is_none());
    }
}

/// Schemes that need no iteration take their derivatives from the same step in dual numbers: against
/// those of the whole simulation, and against differences of five simulations.
#[test]
fn derivatives_of_explicit_schemes_equal_dual_numbers_and_differences() {
    let damped = |mut scene: Scene| {
        scene.loads.damping.mass = 0.7;
        scene.rod.segments = Some(20);
        scene
    };
    let scenes = [
        ("cantilever", damped(cantilever_with(0.5, 1e-3, 0.1, Clamp::MidEdge)), [8e-5, 1.2e-4]),
        ("helix", damped(helix_with(0.5, 1e-3, 0.1, Clamp::MidEdge)), [2e-4, 3e-4]),
    ];
    for (name, scene, [small, large]) in scenes {
        for (scheme, step) in
            [(Scheme::Verlet, small), (Scheme::Pefrl, large), (Scheme::Rodas4, 1e-3)]
        {
            let mut scene = scene.clone();
            scene.time = Some(Time { scheme, ..Time::new(0.3, step) });
            for parameter in [
                Parameter::YoungsModulus,
                Parameter::Density,
                Parameter::Radius,
                Parameter::NaturalCurvature,
                Parameter::DampingMass,
            ] {
                if parameter == Parameter::NaturalCurvature && name == "cantilever" {
                    continue;
                }
                let dual = mismatch(&scene, parameter, Derivatives::Hand);
                let difference = difference(&scene, parameter);
                println!("{name}, {scheme:?}, {parameter}: {dual:.1e}, {difference:.1e}");
                assert!(dual < LARGEST, "{name}, {scheme:?}, {parameter}: {dual:e}");
                assert!(difference < LARGEST, "{name}, {scheme:?}, {parameter}: {difference:e}");
            }
        }
    }
}

/// The run in dual numbers that makes the derivative makes the steps too, also those taken in halves:
/// the motion and the work are those of a plain run.
#[test]
fn motion_of_explicit_schemes_is_the_same_with_derivatives() {
    let mut scene = helix_with(0.5, 1e-3, 0.1, Clamp::MidEdge);
    scene.rod.segments = Some(12);
    for (scheme, step) in [(Scheme::Verlet, 2e-4), (Scheme::Rodas4, 1e-3), (Scheme::Rodas4, 5e-2)] {
        scene.time = Some(Time { scheme, ..Time::new(0.3, step) });
        let problem = scene.problem().unwrap();
        let plain = problem.simulate().unwrap();
        let derived =
            problem.simulate_with(&[Parameter::YoungsModulus, Parameter::Radius]).unwrap();
        let tip = |run: &rodfit::Trajectory| Vector3::from(run.at(Point::Tip, 0.3).unwrap().0);
        let off = (tip(&plain) - tip(&derived)).norm();
        println!("{scheme:?}, {step}: {off:.1e}, {} tangents", plain.work().tangents);
        assert!(off < 1e-10, "{scheme:?}, {step}: {off:e}");
        // A wild step in dual numbers may be refused for another reason, and counts as none then.
        let evaluations = |run: &rodfit::Trajectory| [run.work().tangents, run.work().gradients];
        assert_eq!(evaluations(&plain), evaluations(&derived));
    }
}

/// Error of the derivative of the tip's last position against the five-point difference, over the
/// derivative.
pub fn difference(scene: &Scene, parameter: Parameter) -> f64 {
    let problem = scene.problem().unwrap();
    let end = problem.time().unwrap().end;
    let value = parameter.of(scene).unwrap();
    // Axial vibrations turn through thousands of radians: small differences.
    let h = match parameter {
        _ if parameter == Parameter::DampingMass => 1e-2 * value,
        _ if parameter == Parameter::ClampAngle || parameter.name().starts_with("initial") => 1e-3,
        _ => 1e-4 * value,
    };
    let at = |k: f64| {
        let other = problem.with([(parameter, value + k * h)]).unwrap();
        Vector3::from(other.simulate().unwrap().at(Point::Tip, end).unwrap().0)
    };
    let slope = ((at(1.0) - at(-1.0)) * 8.0 - (at(2.0) - at(-2.0))) / (12.0 * h);
    let run = problem.simulate_with(&[parameter]).unwrap();
    let exact = Vector3::from(run.at(Point::Tip, end).unwrap().1[0]);
    (slope - exact).norm() / exact.norm()
}
