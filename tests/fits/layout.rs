//! Mesh and model of a scene are chosen for generic values of the identified parameters, so that the misfit is smooth at special
//! ones, such as zero curvature.

use rodfit::fit::{RestShape, ShapePoint};
use rodfit::scene::{Material, Scene, Section, Shape};
use rodfit::{Fit, Parameter, Point, Problem, Unknown};

use crate::common::{at_tip, rest};

/// A quarter of a circle that hangs under its weight.
fn arc() -> Scene {
    let shape = Shape::Arc { length: 0.5, angle: 1.5 };
    let section = Section::Circle { radius: 0.005 };
    let mut scene = Scene::new(20, shape, section, Material::new(1273.52, 1e8));
    scene.loads.gravity = [0.0, -9.8, 0.0];
    scene
}

/// Where the nodes of a rod are at rest, m.
fn droop(scene: &Scene) -> RestShape {
    let nodes = rest(scene).nodes;
    let seen = |(i, x): (usize, &[f64; 3])| ShapePoint::new(Point::Node(i), x.map(Some));
    RestShape::new(nodes.iter().enumerate().skip(2).map(seen).collect()).sigma(1.0)
}

fn curved(factor: f64) -> Scene {
    let mut scene = arc();
    scene.rod.natural_curvature = factor.into();
    scene
}

fn fit(problem: &Problem, data: RestShape, unknown: impl Into<Unknown>) -> Fit {
    Fit::new(problem).observe(data).identify(unknown)
}

/// A rod with zero natural curvature is discretized like a curved one if its curvature is an unknown.
#[test]
fn misfit_is_smooth_at_a_straight_rod() {
    let problem = curved(0.5).problem().unwrap();
    let h = 1e-6;
    let tip = |x: f64| {
        let problem = problem.with([(Parameter::NaturalCurvature, x)]).unwrap();
        problem.equilibrium().unwrap().tip[1]
    };
    let kink = |f: &dyn Fn(f64) -> f64| (f(h) - 2.0 * f(0.0) + f(-h)).abs();
    println!("decided anew, the tip jumps by {:.1e} m", kink(&tip));
    // With a mesh chosen for each value, the tip jumps: otherwise the test would be without effect.
    assert!(kink(&tip) > 1e-5, "the test would show nothing");

    let fit = fit(&problem, droop(&curved(0.3)), Parameter::NaturalCurvature);
    let residuals = fit.residuals().unwrap();
    for i in 0..residuals.len() {
        let jump = kink(&|x| residuals.residuals(&[x]).unwrap()[i]);
        // Smooth: the second difference is a rounding error.
        assert!(jump < 1e-11, "{i}: {jump:e}");
    }
    let slope = |x: f64| residuals.jacobian_at(&[x]).unwrap();
    for (a, b) in slope(0.0).iter().zip(slope(h)) {
        // The Jacobian is continuous.
        assert!((a[0] - b[0]).abs() < 1e-6, "{a:?} {b:?}");
    }
}

#[test]
fn natural_curvature_is_identified_from_zero() {
    for truth in [0.3, -0.2] {
        let unknown = Unknown::new(Parameter::NaturalCurvature).start(0.0);
        let problem = curved(0.0).problem().unwrap();
        let report = fit(&problem, droop(&curved(truth)).sigma(1e-4), unknown).solve().unwrap();
        let found = report.parameters()[0].1;
        println!("{truth}: {found}");
        // Data without noise: the error is that of the convergence criterion.
        assert!(report.converged && (found - truth).abs() < 1e-8, "{found}: {report}");
    }
}

/// An arc with zero angle at the start of the fit has the layout of a curved one.
#[test]
fn arc_angle_is_identified_from_a_straight_rod() {
    let bent = |angle: f64| {
        let mut scene = arc();
        scene.rod.shape = Shape::Arc { length: 0.5, angle };
        scene
    };
    let angle: Parameter = "rod.shape.angle".parse().unwrap();
    let report =
        fit(&bent(0.0).problem().unwrap(), droop(&bent(0.4)).sigma(1e-4), angle).solve().unwrap();
    let found = report.parameters()[0].1;
    // Exact data of an arc of 0.4 rad.
    assert!(report.converged && (found - 0.4).abs() < 1e-8, "{found}: {report}");
}

/// With `up` perpendicular to the plane, the width of a square resists bending like that of a rectangle.
#[test]
fn square_section_may_become_rectangular() {
    let mut scene = arc();
    scene.rod.section = Section::Rectangle { width: 0.008, height: 0.008, up: [0.0, 0.0, 1.0] };
    let problem = scene.problem().unwrap();
    let residuals = fit(&problem, droop(&scene), Parameter::Width).residuals().unwrap();
    let (x, h) = (0.008_f64.ln(), 1e-4);
    let [above, below] = [x + h, x - h].map(|x| residuals.residuals(&[x]).unwrap());
    let exact = residuals.jacobian_at(&[x]).unwrap();
    let size = exact.iter().map(|row| row[0].abs()).fold(0.0, f64::max);
    for ((a, b), row) in above.iter().zip(&below).zip(&exact) {
        let difference = (a - b) / (2.0 * h);
        // Central differences in steps of `h`.
        assert!((difference - row[0]).abs() < 1e-6 * size, "{difference:e} {row:?}");
    }
}

/// A spatial scene stays spatial if the force out of its plane is zero at the start.
#[test]
fn spatial_rod_stays_spatial_at_a_planar_start() {
    let mut scene = arc();
    scene.material.poisson_ratio = Some(0.3);
    scene.loads.point = at_tip([0.0, -0.01, 0.02]);
    let problem = scene.problem().unwrap();
    assert_eq!(problem.model().0, "spatial");
    let force: Parameter = "loads.point.0.force.z".parse().unwrap();
    let residuals = fit(&problem, droop(&scene), force).residuals().unwrap();
    let [at, beside] = [0.0, 1e-7].map(|x| residuals.jacobian_at(&[x]).unwrap());
    let size = at.iter().map(|row| row[0].abs()).fold(0.0, f64::max);
    // The force has an effect at zero, which requires the spatial model.
    assert!(size > 0.1, "{size}");
    for (a, b) in at.iter().zip(&beside) {
        // The Jacobian is continuous at zero force.
        assert!((a[0] - b[0]).abs() < 1e-4 * size, "{a:?} {b:?}");
    }
}
