//! The exact Hessian of the misfit, against finite differences of the exact gradient and against
//! Gauss-Newton.

use argmin::core::{Gradient, Hessian};
use num_dual::HyperDual64;
use rodfit::fit::{Experiment, Frequencies, Loss, Residuals, RestShape, ShapePoint};
use rodfit::scene::{
    Clamp, Handedness, InitialState, Material, Scene, Scheme, Section, Shape, Time,
};
use rodfit::vibration::LinearizationPoint;
use rodfit::{Fit, Observation, Parameter, Point, Trajectory, Unknown};

use crate::common::fits::{observe, record, record_in_space};
use crate::common::{at_tip, coarse, helix_with, simulate};

fn small(end: f64) -> Scene {
    coarse(10, 4e-3, end)
}

fn residuals(scene: &Scene, data: &Observation, parameters: &[Parameter]) -> Residuals {
    let fit = Fit::new(&scene.problem().unwrap()).observe(data.clone().sigma(1e-3));
    let fit = parameters.iter().fold(fit, |fit, p| fit.identify(Unknown::new(*p)));
    fit.residuals().unwrap()
}

fn values(scene: &Scene, residuals: &Residuals) -> Vec<f64> {
    let unknowns = residuals.unknowns().iter();
    unknowns.map(|u| u.to_scale(u.parameter.of(scene).unwrap())).collect()
}

/// Largest difference of two matrices over the square root of the product of the diagonals.
fn mismatch(a: &[Vec<f64>], b: &[Vec<f64>]) -> f64 {
    let mut worst = 0.0_f64;
    for i in 0..a.len() {
        for j in 0..a.len() {
            worst = worst.max((a[i][j] - b[i][j]).abs() / (b[i][i] * b[j][j]).abs().sqrt());
        }
    }
    worst
}

/// Central differences of the gradient, extrapolated to steps of zero.
fn differences(residuals: &Residuals, x: &[f64]) -> Vec<Vec<f64>> {
    let row = |i: usize| -> Vec<f64> {
        let central = |h: f64| -> Vec<f64> {
            let side = |h: f64| {
                let mut x = x.to_vec();
                x[i] += h;
                residuals.gradient(&x).unwrap()
            };
            let (above, below) = (side(h), side(-h));
            above.iter().zip(below).map(|(a, b)| (a - b) / (2.0 * h)).collect()
        };
        // Angles and times in steps that stay within a time step, where the interpolant is smooth. The
        // misfit depends on beta so little that rounding errors of its gradients, 1e-7 of its second
        // derivative at twice the step, need four times.
        let parameter = residuals.unknowns()[i].parameter;
        let h = match parameter {
            _ if parameter == Parameter::Beta => 1.6e-3,
            _ if parameter.is_positive() => 8e-3,
            _ => 4e-4,
        };
        let (coarse, fine, finest) = (central(h), central(0.5 * h), central(0.25 * h));
        let twice = |k: usize| {
            let [a, b] = [(4.0 * fine[k] - coarse[k]) / 3.0, (4.0 * finest[k] - fine[k]) / 3.0];
            (16.0 * b - a) / 15.0
        };
        (0..x.len()).map(twice).collect()
    };
    (0..x.len()).map(row).collect()
}

/// Every parameter at once, far from the data, so that the second derivatives matter.
#[test]
fn hessian_of_the_misfit_equals_differences_of_its_gradient() {
    let mut damped = small(0.3);
    damped.loads.damping.mass = 0.8;
    damped.loads.damping.stiffness = 2e-3;
    damped.time = Some(Time { beta: 0.6, ..Time::new(0.3, 1e-3) });
    let planar = vec![
        Parameter::YoungsModulus,
        Parameter::DampingMass,
        Parameter::DampingStiffness,
        Parameter::Beta,
        Parameter::Radius,
    ];
    let mut drooping = small(0.4);
    drooping.initial.state = InitialState::Equilibrium;
    drooping.initial.point = at_tip([0.0, 0.05, 0.0]);
    let mut averaged = small(0.4);
    averaged.time = Some(Time { scheme: Scheme::AverageVectorField, ..Time::new(0.4, 4e-3) });
    let mut thrown = small(0.3);
    thrown.loads.damping.stiffness = 2e-3;
    thrown.initial.velocity = [0.1, -0.2, 0.0];
    let mut helix = helix_with(0.55, 4e-3, 0.3, Clamp::MidEdge);
    helix.rod.segments = Some(14);
    (helix.material.poisson_ratio, helix.material.shear_modulus) = (None, Some(4e6));
    let cases = [
        ("damped", damped, planar),
        ("from equilibrium", drooping, vec![Parameter::YoungsModulus, Parameter::Density]),
        ("average vector field", averaged, vec![Parameter::YoungsModulus]),
        (
            "thrown",
            thrown,
            vec![
                Parameter::YoungsModulus,
                Parameter::InitialVelocityY,
                Parameter::InitialAngularVelocityZ,
                Parameter::ClampAngle,
            ],
        ),
        (
            "helix",
            helix,
            vec![Parameter::YoungsModulus, Parameter::ShearModulus, Parameter::NaturalCurvature],
        ),
    ];
    for (name, scene, parameters) in cases {
        let data = match name {
            "helix" => record_in_space(&simulate(&scene), 30),
            _ => observe(&scene, 40),
        };
        let residuals = residuals(&scene, &data, &parameters);
        let mut x = values(&scene, &residuals);
        let at_truth = gauss_newton(&residuals, &x);
        let error = mismatch(&residuals.hessian(&x).unwrap(), &at_truth);
        println!("{name}: {error:.1e} from Gauss-Newton without residuals");
        assert!(error < 1e-10, "{name}: {error:e}");

        for (k, x) in x.iter_mut().enumerate() {
            *x += 0.02 * (1.0 + 0.1 * k as f64);
        }
        let exact = residuals.hessian(&x).unwrap();
        let error = mismatch(&exact, &differences(&residuals, &x));
        let second = mismatch(&gauss_newton(&residuals, &x), &exact);
        println!("{name}: {error:.1e} from differences, Gauss-Newton is {second:.1e} off");
        assert!(error < 1e-7, "{name}: {error:e}");
        assert!(second > 1e-4, "{name}: the test must see second derivatives, {second:e}");
    }
}

/// Two experiments with their own clamp and clock, a droop, a frequency, robust losses and a prior:
/// everything a misfit may be made of.
#[test]
fn hessian_of_all_kinds_of_data_equals_differences_of_the_gradient() {
    let mut scenes = [small(0.2), small(0.2)];
    scenes[1].rod.shape = Shape::Straight { length: 0.4, direction: [1.0, 0.0, 0.0] };
    let problems = scenes.clone().map(|scene| scene.problem().unwrap());
    let shape = {
        let nodes = problems[0].equilibrium().unwrap().nodes;
        let seen = |i: usize| ShapePoint::new(Point::Node(i), nodes[i].map(Some));
        RestShape::new((2..11).map(seen).collect()).sigma(1e-3).loss(Loss::SoftL1)
    };
    let natural_frequencies =
        problems[1].modes(2, LinearizationPoint::Equilibrium).unwrap().frequencies_rad_s;
    let film = |k: usize, loss| {
        let run = problems[k].simulate().unwrap();
        record(&run, 20).sigma(2e-3).loss(loss)
    };
    let fit = Fit::of([
        Experiment::new("a", &problems[0]).observe(film(0, Loss::Cauchy)).observe(shape),
        Experiment::new("b", &problems[1])
            .observe(film(1, Loss::SoftL1))
            .observe(Frequencies::new(&natural_frequencies, 0.2).loss(Loss::Cauchy)),
    ]);
    let residuals = fit
        .identify(Unknown::new(Parameter::YoungsModulus).prior(1.1e8, 1e6))
        .identify(Parameter::Density)
        .identify(Unknown::new(Parameter::ClampAngle).of_experiment("a"))
        .identify(Unknown::new(Parameter::TimeOffset).of_experiment("b"))
        .residuals()
        .unwrap();
    let x = vec![1.02e8_f64.ln(), 1240.0_f64.ln(), 0.01, -0.0025];
    let (exact, by_hand) = (residuals.hessian(&x).unwrap(), differences(&residuals, &x));
    let error = mismatch(&exact, &by_hand);
    println!("{error:.1e} from differences");
    assert!(error < 1e-7, "{error:e}\n{exact:?}\n{by_hand:?}");
    let still = Fit::of([Experiment::new("b", &problems[1])
        .observe(Frequencies::new(&natural_frequencies, 2.0).loss(Loss::Cauchy))])
    .identify(Parameter::YoungsModulus)
    .residuals()
    .unwrap();
    let x = vec![1.02e8_f64.ln()];
    let error = mismatch(&still.hessian(&x).unwrap(), &differences(&still, &x));
    println!("frequencies alone: {error:.1e} from differences");
    assert!(error < 1e-7, "{error:e}");
}

fn gauss_newton(residuals: &Residuals, x: &[f64]) -> Vec<Vec<f64>> {
    let rows = residuals.jacobian_at(x).unwrap();
    let entry = |i: usize, j: usize| rows.iter().map(|row| row[i] * row[j]).sum();
    (0..x.len()).map(|i| (0..x.len()).map(|j| entry(i, j)).collect()).collect()
}

fn hanging_helix() -> Scene {
    let shape = Shape::Helix {
        length: 0.3,
        radius: 0.02,
        pitch: 0.05,
        axis: [0.0, 0.0, -1.0],
        handedness: Handedness::Left,
    };
    let material = Material { poisson_ratio: Some(0.4), ..Material::new(1200.0, 1e7) };
    let mut scene = Scene::new(16, shape, Section::Circle { radius: 4e-3 }, material);
    scene.loads.gravity = [0.0, 0.0, -9.8];
    scene
}

/// Second derivatives of the place of rest against differences of the first.
#[test]
fn hessian_of_equilibria_equals_differences_of_the_gradient() {
    let mut arc = hanging_helix();
    arc.rod.shape = Shape::Arc { length: 0.3, angle: 1.0 };
    arc.loads.gravity = [0.0, -9.8, 0.0];
    for scene in [hanging_helix(), arc] {
        let problem = scene.problem().unwrap();
        let tip = problem.nodes() - 1;
        let plain = Trajectory::at_rest(&problem, &[tip], &[]).unwrap();
        for pair in [
            [Parameter::YoungsModulus, Parameter::YoungsModulus],
            [Parameter::YoungsModulus, Parameter::Density],
            [Parameter::YoungsModulus, Parameter::NaturalCurvature],
            [Parameter::NaturalCurvature, Parameter::NaturalCurvature],
            [Parameter::ClampAngle, Parameter::YoungsModulus],
        ] {
            let [one, two] = pair;
            if one.of(&scene).is_none()
                || problem.planar().is_none() && one == Parameter::ClampAngle
            {
                continue;
            }
            let along = |p: Parameter, q: Parameter| f64::from(u8::from(p == q));
            let seed = |p, value| HyperDual64::new(value, along(p, one), along(p, two), 0.0);
            let run = plain.over(seed).unwrap();
            let both = run.tip(0).map(|x| x.eps1eps2);
            let value = two.of(&scene).unwrap();
            let h = 2e-3 * value;
            let slope = |k: f64| {
                let other = problem.with([(two, value + k * h)]).unwrap();
                let run = Trajectory::at_rest(&other, &[tip], &[one]).unwrap();
                run.at(Point::Tip, 0.0).unwrap().1[0]
            };
            let [a, b, c, d] = [1.0, -1.0, 2.0, -2.0].map(slope);
            let (mut off, mut size) = (0.0_f64, 0.0_f64);
            for i in 0..3 {
                let difference = (8.0 * (a[i] - b[i]) - (c[i] - d[i])) / (12.0 * h);
                off = off.max((both[i] - difference).abs());
                size = size.max(difference.abs());
            }
            println!("{one}, {two}: {:.1e}", off / size);
            assert!(off < 1e-7 * size, "{one}, {two}: {both:?} {off:e} {size:e}");
        }
    }
}
