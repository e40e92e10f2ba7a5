//! Markers beside the center line: their positions follow the axes of the rod, with exact derivatives and interpolation between
//! time steps.

use nalgebra::{Rotation3, Unit, Vector3};
use rodfit::energy::frame::EdgeFrame;
use rodfit::fit::{Experiment, FitFile, Sample};
use rodfit::problem::Model;
use rodfit::scene::{Clamp, Dimension, End, Motion, Point, Scene, Scheme, Section, Shape, Time};
use rodfit::{AnyProblem, Fit, Observation, Parameter, Problem};

use crate::common::fits::{fit_with, found, of_a_right_mesh, same_mesh, value};
use crate::common::{coarse, helix_with};

type Vector = Vector3<f64>;

/// Tangent and directors of every edge at every step, and the nodes, from the simulation's own state: the
/// first director is `up` at rest on the first edge and turns with the material.
fn shapes(problem: &Problem, up: Vector) -> Vec<(f64, Vec<Vector>, Vec<[Vector; 3]>)> {
    let time = problem.time().unwrap();
    let steps = 0..=time.steps();
    let nodes = problem.nodes();
    macro_rules! run {
        ($discretized:expr, $directors:expr) => {{
            let mut simulation = $discretized.simulation().unwrap();
            let mut turn = None;
            let mut shape = |k: usize| {
                if k > 0 {
                    simulation.step_to(time.at(k)).unwrap();
                }
                let state = simulation.state();
                let place = |i: usize| Vector::from($discretized.model.position(&state.q, i));
                let x: Vec<Vector> = (0..nodes).map(place).collect();
                let axes = |j: usize| {
                    let t = (x[j + 1] - x[j]).normalize();
                    let first: Vector = $directors(state, j, t);
                    // Measured once, on the first edge at rest.
                    let angle = *turn.get_or_insert_with(|| {
                        let across = (up - t * t.dot(&up)).normalize();
                        first.cross(&across).dot(&t).atan2(first.dot(&across))
                    });
                    let d1 = Rotation3::from_axis_angle(&Unit::new_normalize(t), angle) * first;
                    [t, d1, t.cross(&d1)]
                };
                let axes = (0..nodes - 1).map(axes).collect();
                (time.at(k), x.clone(), axes)
            };
            steps.map(&mut shape).collect()
        }};
    }
    match problem.discretized() {
        AnyProblem::Planar(planar) => {
            run!(planar, |_: &_, _, t: Vector| Vector::z().cross(&t))
        }
        AnyProblem::Spatial(spatial) => {
            use rodfit::energy::frame::Frames;
            use rodfit::rod::State;
            run!(spatial, |state: &State<f64, Frames<f64>>, j: usize, t: Vector| {
                let frame: EdgeFrame<f64> = state.frames.edges[j];
                let [d1, _] = frame.material(t.into(), state.q[4 * j + 3]);
                Vector::from(d1)
            })
        }
    }
}

/// A cubic through four values one apart, `at` so far from the first.
fn cubic(values: [Vector; 4], at: f64) -> Vector {
    (0..4).fold(Vector::zeros(), |sum, i| {
        let others = (0..4).filter(|j| *j != i);
        let weight: f64 = others.map(|j| (at - j as f64) / (i as f64 - j as f64)).product();
        sum + values[i] * weight
    })
}

/// Observation of a marker at `offset` (along the axes of the edge, m) from a node. The offset is interpolated by a cubic through
/// the middles of the four nearest edges.
fn seen(problem: &Problem, up: Vector, node: usize, offset: [f64; 3]) -> Observation {
    let last = problem.nodes() - 1;
    let first = (node.max(2) - 2).min(last - 4);
    let sample = |(time, x, axes): (f64, Vec<Vector>, Vec<[Vector; 3]>)| {
        let beside = |j: usize| (0..3).map(|c| axes[j][c] * offset[c]).sum::<Vector>();
        let values = [0, 1, 2, 3].map(|k| beside(first + k));
        let place = x[node] + cubic(values, node as f64 - 0.5 - first as f64);
        Sample { time, position: [0, 1, 2].map(|c| Some(place[c])) }
    };
    let samples = shapes(problem, up).into_iter().map(sample).collect();
    let point = if node == last { Point::Tip } else { Point::Node(node) };
    Observation::new(samples).at(point)
}

fn planar_rod() -> Scene {
    coarse(20, 2e-3, 0.4)
}

/// A ruler in space that bends about an axis askew to it, and twists.
fn twisting_rod(scheme: Scheme) -> Scene {
    let step = if scheme == Scheme::AverageVectorField { 2.5e-4 } else { 1e-3 };
    let mut scene = coarse(16, step, 100.0 * step);
    scene.rod.dimension = Dimension::Spatial;
    scene.rod.section = Section::Rectangle { width: 0.012, height: 0.008, up: [0.0, 1.0, 1.0] };
    scene.material.poisson_ratio = Some(0.4);
    scene.rod.natural_twist = 6.0.into();
    scene.time = Some(Time { scheme, ..Time::new(100.0 * step, step) });
    scene
}

fn helix() -> Scene {
    let mut scene = helix_with(0.5, 1e-3, 0.1, Clamp::MidEdge);
    scene.rod.segments = Some(30);
    scene
}

/// The residuals at the true parameters are rounding errors with the offset of the marker in the axes of the rod, and as
/// large as the offset without.
#[test]
fn marker_position_follows_the_axes_of_the_rod() {
    let diagonal = Vector::new(0.0, 1.0, 1.0);
    let avf = Scheme::AverageVectorField;
    let moved = {
        let mut scene = twisting_rod(Scheme::NewmarkBeta);
        let ramp = Some(0.05);
        scene.supports.motion = vec![Motion {
            end: End::Start,
            rotation: [0.3, 0.0, 0.2],
            twist: 0.5,
            ramp,
            ..Motion::default()
        }];
        scene
    };
    let mut steep = planar_rod();
    steep.rod.shape = Shape::Straight { length: 0.5, direction: [0.1, -0.995, 0.0] };
    let mut spatial = planar_rod();
    spatial.rod.dimension = Dimension::Spatial;
    spatial.material.poisson_ratio = Some(0.4);
    for (name, scene, up) in [
        ("planar", planar_rod(), Vector::y()),
        ("the same in space", spatial, Vector::y()),
        ("hanging", steep, Vector::x()),
        ("twisting", twisting_rod(Scheme::NewmarkBeta), diagonal),
        ("rosenbrock", twisting_rod(Scheme::Rodas4), diagonal),
        ("average", twisting_rod(avf), diagonal),
        ("turned at the wall", moved, diagonal),
        ("helix", helix(), Vector::y()),
    ] {
        let problem = scene.problem().unwrap();
        let run = problem.simulate().unwrap();
        // What `shapes` cannot follow: steps in halves.
        assert_eq!(run.work().steps, run.times().len() - 1, "{name}");
        for node in [problem.nodes() - 1, 7] {
            let offset = [0.003, 0.01, -0.006];
            let data = seen(&problem, up, node, offset).sigma(1.0);
            let largest = |data: Observation| {
                let fit = Fit::of([Experiment::new("", &problem).observe(data)])
                    .identify(Parameter::YoungsModulus);
                let residuals = fit.residuals().unwrap();
                let x = [scene.material.youngs_modulus.ln()];
                residuals.residuals(&x).unwrap().iter().fold(0.0_f64, |a, r| a.max(r.abs()))
            };
            let (with, without) = (largest(data.clone().offset(offset)), largest(data));
            println!("{name}, node {node}: {with:.1e} with the offset, {without:.1e} without");
            // Rounding errors with the offset; without it at least 5 mm of the offset remain.
            assert!(with < 1e-13 && without > 5e-3, "{name} {node}: {with} {without}");
        }
    }
}

/// The Jacobian equals differences of the residuals, also between the time steps, by parameters that move or rotate the rod,
/// slide the marker along it, or shift the clock. The Hessian equals differences of the gradient.
#[test]
fn marker_derivatives_equal_differences() {
    let planar: &[&str] = &["youngs_modulus", "rod.shape.length", "supports.angle", "time_offset"];
    let spatial: &[&str] =
        &["youngs_modulus", "rod.section.up.y", "rod.natural_twist", "rod.shape.direction.z"];
    let helical: &[&str] = &["youngs_modulus", "rod.shape.pitch", "shear_modulus"];
    let mut helix = helix();
    helix.material.poisson_ratio = None;
    helix.material.shear_modulus = Some(4e6);
    for (scene, names) in [
        (planar_rod(), planar),
        (twisting_rod(Scheme::NewmarkBeta), spatial),
        (twisting_rod(Scheme::Rodas4), spatial),
        (helix, helical),
    ] {
        let mut scene = scene;
        scene.time.as_mut().unwrap().tolerance = rodfit::scene::StepTolerance::Rounding;
        let problem = scene.problem().unwrap();
        let step = scene.time.as_ref().unwrap().step_size();
        let sample = |k: usize| Sample {
            // Where two steps meet the interpolant has no second derivative.
            time: (8.0 * k as f64 + 5.4) * step,
            position: [Some(0.2), Some(-0.1), Some(0.05)],
        };
        let data = Observation::new((0..11).map(sample).collect()).sigma(1.0);
        let data = data.at(Point::ArcLength(0.31)).offset([0.004, 0.02, -0.01]);
        let parameters: Vec<Parameter> = names.iter().map(|name| name.parse().unwrap()).collect();
        let fit = Fit::of([Experiment::new("", &problem).observe(data)]);
        let fit = parameters.iter().fold(fit, |fit, p| fit.identify(*p));
        let residuals = fit.residuals().unwrap();
        let x: Vec<f64> = parameters
            .iter()
            .map(|p| {
                let value = p.of(&scene).unwrap();
                if p.is_positive() { value.ln() } else { value }
            })
            .collect();
        let jacobian = residuals.jacobian_at(&x).unwrap();
        let along = |i: usize, h: f64| {
            let mut x = x.clone();
            x[i] += h;
            x
        };
        for (i, name) in names.iter().enumerate() {
            let h = 1e-4;
            let side = |k: f64| {
                let [a, b] = [k, -k].map(|k| residuals.residuals(&along(i, k * h)).unwrap());
                a.iter().zip(b).map(|(a, b)| a - b).collect::<Vec<f64>>()
            };
            let [a, b, c] = [1.0, 2.0, 3.0].map(side);
            let size = jacobian.iter().map(|row| row[i].abs()).fold(0.0, f64::max);
            let off = (0..a.len())
                .map(|k| ((45.0 * a[k] - 9.0 * b[k] + c[k]) / (60.0 * h) - jacobian[k][i]).abs())
                .fold(0.0, f64::max);
            println!("{name}: {off:.1e} of {size:.1e}");
            // Seven-point differences (sixth order) in steps of `h`.
            assert!(off < 1e-7 * size, "{name}: {off} of {size}");
        }
        let hessian = residuals.hessian_at(&x).unwrap();
        let gradient = |x: &[f64]| -> Vec<f64> {
            let (r, j) = (residuals.residuals(x).unwrap(), residuals.jacobian_at(x).unwrap());
            (0..x.len()).map(|i| r.iter().zip(&j).map(|(r, row)| r * row[i]).sum()).collect()
        };
        let h = 1e-5;
        let [ahead, behind] = [h, -h].map(|h| gradient(&along(0, h)));
        let size = hessian[0].iter().fold(0.0_f64, |a, b| a.max(b.abs()));
        for (j, exact) in hessian[0].iter().enumerate() {
            let off = ((ahead[j] - behind[j]) / (2.0 * h) - exact).abs();
            // Central differences in steps of 1e-5.
            assert!(off < 1e-5 * size, "{}: {off} of {size}", names[j]);
        }
    }
}

/// Halfway between steps the position of a marker equals the cubic through two steps on each side up to the
/// fourth order: its velocity includes the rotation of the axes.
#[test]
fn markers_between_steps_are_interpolated() {
    for (name, scene) in [("planar", planar_rod()), ("helix", helix())] {
        let errors = [1.0, 0.5].map(|part| {
            let mut scene = scene.clone();
            let time = scene.time.as_mut().unwrap();
            // Slow enough for the rod's swings to be resolved.
            (time.step, time.end) = (Some(2.5e-4 * part), 0.05);
            let (step, steps) = (time.step_size(), time.steps());
            let problem = scene.problem().unwrap();
            let beside = |shift: f64| {
                let sample =
                    |k: usize| Sample { time: (k as f64 + shift) * step, position: [Some(0.0); 3] };
                let data = Observation::new((0..steps).map(sample).collect()).sigma(1.0);
                let place = |data: Observation| {
                    let fit = Fit::of([Experiment::new("", &problem).observe(data)])
                        .identify(Parameter::YoungsModulus);
                    let x = [scene.material.youngs_modulus.ln()];
                    fit.residuals().unwrap().residuals(&x).unwrap()
                };
                let (marker, centre) = (place(data.clone().offset([0.0, 0.01, 0.01])), place(data));
                marker.iter().zip(centre).map(|(m, c)| m - c).collect::<Vec<f64>>()
            };
            let (at, between) = (beside(0.0), beside(0.5));
            let off = |i: usize| {
                let [a, b, c, d] = [0, 3, 6, 9].map(|k| at[i + k]);
                (between[i + 3] - (9.0 * (b + c) - a - d) / 16.0).abs()
            };
            (0..at.len() - 9).map(off).fold(0.0, f64::max)
        });
        println!("{name}: {errors:?}");
        // Third order at least: half the step reduces the error by a factor of about 8 or more.
        assert!(errors[0] < 1e-6 && errors[1] < errors[0] / 7.0, "{name}: {errors:?}");
    }
}

/// A marker 2 cm above the tip of a rod that bends by tens of degrees: a fit file with the offset gives the right E, without
/// it a wrong one.
#[test]
fn marker_offset_gives_exact_modulus() {
    for mut scene in [planar_rod(), twisting_rod(Scheme::NewmarkBeta)] {
        scene.material.youngs_modulus = 2e7;
        let problem = scene.problem().unwrap();
        let up = if problem.planar().is_some() { Vector::y() } else { Vector::new(0.0, 1.0, 1.0) };
        let offset = [0.0, 0.02, 0.0];
        let data = seen(&problem, up, problem.nodes() - 1, offset);
        let by = [Parameter::YoungsModulus];
        let report = fit_with(&scene, &data.clone().offset(offset), &by, same_mesh());
        // The modulus of the simulation.
        found(&report, &[(Parameter::YoungsModulus, 2e7)], 1e-7);
        if problem.planar().is_none() {
            continue;
        }
        // The offset is taken off where the rod starts, as who does not know better would.
        let mut shifted = data;
        let start = shifted.samples[0].position;
        let rest = problem.simulate().unwrap().tip(0);
        for sample in &mut shifted.samples {
            for c in 0..3 {
                sample.position[c] = sample.position[c].map(|x| x - start[c].unwrap() + rest[c]);
            }
        }
        let report = fit_with(&scene, &shifted, &by, same_mesh());
        let off = (value(&report, Parameter::YoungsModulus) / 2e7 - 1.0).abs();
        println!("without the offset E is off by {:.2} %", 100.0 * off);
        // A lower bound of the bias, so that the offset matters.
        assert!(off > 3e-3, "{off}");
    }
}

/// An arc length that is that of a node up to rounding gives the same result as the node.
#[test]
fn arc_length_of_a_node_equals_the_node() {
    for (segments, node) in [(24, 18), (12, 9), (40, 13)] {
        let mut scene = coarse(segments, 4e-3, 0.3);
        scene.rod.shape = Shape::Straight { length: 0.513, direction: [1.0, 0.0, 0.0] };
        scene.supports.clamp = Clamp::Nodes;
        let run = scene.problem().unwrap().simulate().unwrap();
        let sample =
            |k: &usize| Sample { time: run.times()[*k], position: run.node(node, *k).map(Some) };
        let data = Observation::new([20, 40, 60, 75].iter().map(sample).collect());
        let place = 0.513 * node as f64 / segments as f64;
        let data = data.at(Point::ArcLength((place * 1e7).round() * 1e-7)).sigma(1e-4);
        let report = fit_with(&scene, &data, &[Parameter::YoungsModulus], of_a_right_mesh());
        // The modulus of the simulation; the arc length is rounded to 1e-7 m.
        found(&report, &[(Parameter::YoungsModulus, scene.material.youngs_modulus)], 1e-5);
    }
}

#[test]
fn fit_file_offsets_are_read_and_checked() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
    write("scene.toml", &planar_rod().to_toml().unwrap());
    write("tip.csv", "t,x,y\n0.1,0.5,-0.01\n0.2,0.49,-0.1\n0.3,0.49,-0.05\n");
    let fit = |offset: &str| {
        let text = format!(
            "scene = \"scene.toml\"\n[[observation]]\nfile = \"tip.csv\"\noffset = {offset}\n\
             [[parameter]]\nname = \"youngs_modulus\"\n"
        );
        FitFile::from_toml(&text, folder.path())
    };
    let file = fit("[0, 0.004, 0]").unwrap();
    let motion = file.experiments[0].measurements[0].motion().unwrap();
    // The numbers of the file, m.
    assert_eq!(motion.offset, [0.0, 0.004, 0.0]);
    for (wrong, message) in [
        (
            "[0, 4, 0]",
            "observation[0].offset: found [0.0, 4.0, 0.0], allowed: up to the rod's length",
        ),
        ("[0, nan, 0]", "observation[0].offset"),
        ("[0.004]", "3 numbers, or 2"),
    ] {
        let refused = fit(wrong).unwrap_err().to_string();
        assert!(refused.contains(message), "{refused}");
    }
}
