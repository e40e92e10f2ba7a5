//! Parameters of the camera: clock, scale, tilt and position are identified together with the modulus, with exact derivatives.

use rodfit::fit::Sample;
use rodfit::scene::{Clamp, Scene, Shape};
use rodfit::{Fit, Observation, Parameter, Problem, Unknown};

use crate::common::fits::{record, record_in_space, value};
use crate::common::{coarse, helix_with};

/// A record of the tip by a camera that is rotated (`turn`), scaled and shifted about the wall, with a running clock that shows
/// `offset` at the release of the rod.
fn filmed(problem: &Problem, [offset, scale, turn]: [f64; 3], shift: [f64; 3]) -> Observation {
    let run = problem.simulate().unwrap();
    let wall = run.node(0, 0);
    let true_record = record(&run, 150);
    let (sin, cos) = turn.sin_cos();
    let seen = |sample: &Sample| {
        let x = sample.position.map(|x| x.unwrap_or(0.0));
        let [a, b, c] = [0, 1, 2].map(|i| x[i] - wall[i]);
        let turned = [cos * a - sin * b, sin * a + cos * b, c];
        let place = |i: usize| Some(wall[i] + shift[i] + scale * turned[i]);
        let z = sample.position[2].and(place(2));
        Sample { time: sample.time + offset, position: [place(0), place(1), z] }
    };
    Observation::new(true_record.samples.iter().map(seen).collect())
}

/// The problem of a scene with this modulus, Pa.
fn stiff(mut scene: Scene, modulus: f64) -> Problem {
    scene.material.youngs_modulus = modulus;
    scene.problem().unwrap()
}

/// Clock, scale, tilt and position of the camera are identified together with the modulus, exactly. The clock
/// starts before or after the motion.
#[test]
fn approximate_camera_is_identified_with_modulus() {
    let mut helix = helix_with(0.5, 2e-3, 0.6, Clamp::MidEdge);
    helix.rod.segments = Some(40);
    for (name, scene) in [("cantilever", coarse(20, 2e-3, 0.6)), ("helix", helix)] {
        let truth = scene.material.youngs_modulus * 1.3;
        let shift = [4e-3, -7e-3, 0.0];
        for offset in [0.013, -0.02] {
            let camera = [offset, 1.02, 0.03];
            let mut observation = filmed(&stiff(scene.clone(), truth), camera, shift);
            observation.samples.retain(|sample| sample.time >= 0.0);
            let mut fit = Fit::new(&scene.problem().unwrap()).observe(observation);
            let looked_for = [
                (Parameter::YoungsModulus, truth),
                (Parameter::TimeOffset, offset),
                (Parameter::PixelScale, camera[1]),
                (Parameter::InPlaneRotation, camera[2]),
                (Parameter::ClampPositionX, shift[0]),
                (Parameter::ClampPositionY, shift[1]),
            ];
            // A straight rod's tip swings about its wall in the plane; a helix's hangs below it, and
            // its swing does not determine the rotation about the vertical.
            let looked_for = &looked_for[..if name == "helix" { 3 } else { 6 }];
            if name == "helix" {
                let camera = [offset, camera[1], 0.0];
                let mut observation = filmed(&stiff(scene.clone(), truth), camera, [0.0; 3]);
                observation.samples.retain(|sample| sample.time >= 0.0);
                fit = Fit::new(&scene.problem().unwrap()).observe(observation);
            }
            for (parameter, _) in looked_for {
                fit = fit.identify(Unknown::new(*parameter));
            }
            let report = fit.solve().unwrap();
            println!("{name}, clock {offset} s: {report}");
            assert!(report.is_success(), "{report}");
            for (parameter, exact) in looked_for {
                let found = value(&report, *parameter);
                let scale = if *parameter == Parameter::YoungsModulus { truth } else { 1.0 };
                // Exact data: the values of the simulated camera, within the tolerance of the search.
                assert!((found - exact).abs() < 1e-7 * scale, "{parameter}: {found} {exact}");
            }
        }
    }
}

/// The exact Jacobian and Hessian with respect to camera parameters equal differences of the residuals.
#[test]
fn camera_derivatives_equal_differences() {
    use argmin::core::{Gradient, Hessian};
    let scene = coarse(10, 2e-3, 0.4);
    let truth = stiff(scene.clone(), 0.9e8);
    let observation = filmed(&truth, [0.01, 1.05, -0.1], [0.01, 0.02, 0.0]);
    let unknowns = [
        Parameter::YoungsModulus,
        Parameter::TimeOffset,
        Parameter::PixelScale,
        Parameter::InPlaneRotation,
        Parameter::ClampPositionX,
        Parameter::ClampPositionY,
        Parameter::ClampAngle,
        "camera.row_delay.y".parse().unwrap(),
        "camera.distortion".parse().unwrap(),
        "camera.optical_center.x".parse().unwrap(),
    ];
    let mut fit = Fit::new(&scene.problem().unwrap()).observe(observation);
    for unknown in unknowns {
        fit = fit.identify(Unknown::new(unknown));
    }
    let residuals = fit.residuals().unwrap();
    let x = vec![0.95e8_f64.ln(), 0.0133, 0.01, 0.02, -0.003, 0.004, 0.05, 0.017, 0.2, 0.03];
    let (rows, hessian) = (residuals.jacobian_at(&x).unwrap(), residuals.hessian(&x).unwrap());
    for j in 0..x.len() {
        let moves_times = [Parameter::TimeOffset, "camera.row_delay.y".parse().unwrap()];
        let step = if moves_times.contains(&unknowns[j]) { 1e-6 } else { 1e-5 };
        let at = |h: f64| {
            let mut x = x.clone();
            x[j] += h;
            (residuals.residuals(&x).unwrap(), residuals.gradient(&x).unwrap())
        };
        let (plus, minus) = (at(step), at(-step));
        let size = rows.iter().map(|row| row[j].abs()).fold(0.0, f64::max);
        for (i, row) in rows.iter().enumerate() {
            let slope = (plus.0[i] - minus.0[i]) / (2.0 * step);
            // Central differences with `step`: truncation and rounding errors.
            assert!((slope - row[j]).abs() < 1e-6 * size, "{}: {slope} {}", unknowns[j], row[j]);
        }
        for (i, row) in hessian.iter().enumerate() {
            let slope = (plus.1[i] - minus.1[i]) / (2.0 * step);
            let size = (hessian[i][i] * hessian[j][j]).abs().sqrt();
            // As above, for the Hessian.
            assert!((slope - row[j]).abs() < 1e-5 * size, "{i} {j}: {slope} {}", row[j]);
        }
    }
}

/// A clamp that points slightly upward: the droop and the swing about it determine the angle independently of the
/// tilt of the camera, in any plane of the rod.
#[test]
fn clamp_angle_is_identified() {
    for direction in [[1.0, 0.0, 0.0], [0.6, 0.0, 0.8]] {
        for angle in [0.07, -0.2] {
            let mut scene = coarse(20, 2e-3, 0.8);
            scene.rod.shape = Shape::Straight { length: 0.5, direction };
            let problem = scene.problem().unwrap();
            let truth = problem
                .with([(Parameter::YoungsModulus, 0.8e8), (Parameter::ClampAngle, angle)])
                .unwrap();
            let run = truth.simulate().unwrap();
            let start = run.tip(0);
            let rise = start[1] / 0.5;
            // The rod starts straight in the direction of the clamp, but for the part of an edge in the wall.
            assert!((rise.abs() - angle.sin().abs()).abs() < 0.03, "{start:?}");
            let mut seen = record_in_space(&run, 100);
            seen.samples.iter_mut().for_each(|sample| sample.time += 0.01);
            let report = Fit::new(&problem)
                .observe(seen)
                .identify(Parameter::YoungsModulus)
                .identify(Parameter::TimeOffset)
                .identify(Parameter::ClampAngle)
                .solve()
                .unwrap();
            for (parameter, exact) in [
                (Parameter::YoungsModulus, 0.8e8),
                (Parameter::TimeOffset, 0.01),
                (Parameter::ClampAngle, angle),
            ] {
                let found = value(&report, parameter);
                let scale = if parameter == Parameter::YoungsModulus { exact } else { 1.0 };
                // Exact data: the values of the simulation, within the tolerance of the search.
                assert!((found - exact).abs() < 1e-7 * scale, "{parameter}: {found}\n{report}");
            }
            // The derivative that users get, the turn of the whole rod included.
            let derived = problem.simulate_with(&[Parameter::ClampAngle]).unwrap();
            let at = |angle: f64| {
                problem.with([(Parameter::ClampAngle, angle)]).unwrap().simulate().unwrap()
            };
            let (plus, minus) = (at(1e-5), at(-1e-5));
            let (_, slope) = derived.at(rodfit::Point::Tip, 0.33).unwrap();
            let ends = [&plus, &minus].map(|run| run.at(rodfit::Point::Tip, 0.33).unwrap().0);
            for c in 0..3 {
                let difference = (ends[0][c] - ends[1][c]) / 2e-5;
                // Central differences in steps of 1e-5 rad.
                assert!((difference - slope[0][c]).abs() < 1e-7, "{difference} {}", slope[0][c]);
            }
        }
    }
}

/// A clock offset longer than the whole motion is rejected before a simulation, which would take hours.
#[test]
fn time_offset_beyond_the_motion_is_rejected() {
    let problem = coarse(8, 4e-3, 0.4).problem().unwrap();
    let observation = record(&problem.simulate().unwrap(), 40);
    let fit = Fit::new(&problem).observe(observation).identify(Parameter::YoungsModulus);
    let residuals = fit.identify(Parameter::TimeOffset).residuals().unwrap();
    let at = |offset: f64| residuals.residuals(&[1e8_f64.ln(), offset]);
    // An offset within the motion is valid.
    assert!(at(-0.3).is_ok());
    for offset in [-0.5, -1e9] {
        let error = at(offset).unwrap_err().to_string();
        assert!(error.contains("camera.time_offset"), "{error}");
    }
}
