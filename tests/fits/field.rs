//! Hundreds of parameters along a rod, identified by adjoint derivatives: compared with truth, dense Jacobian and
//! differences.

use argmin::core::{CostFunction, Gradient};
use nalgebra::{DMatrix, DVector};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};
use rodfit::fit::{Field, FieldFit, FieldReport, FitFile, Loss, Sample};
use rodfit::scene::*;
use rodfit::{Fit, Observation, Parameter, Point, Problem, Unknown};

use crate::common::at_tip;

const SIGMA: f64 = 2e-4;

/// A planar arc of so many parts that swings under its weight and a force at its tip.
fn arc(parts: usize) -> Scene {
    let shape = Shape::Arc { length: 0.5, angle: 2.0 };
    let section = Section::Circle { radius: 0.004 };
    let mut scene = Scene::new(parts + 1, shape, section, Material::new(1200.0, 1e7));
    scene.rod.natural_curvature = vec![1.0; parts].into();
    scene.loads.gravity = [0.0, -9.8, 0.0];
    scene.loads.point = at_tip([0.0, 0.02, 0.0]);
    scene.loads.damping.mass = 2.0;
    scene.time =
        Some(Time { scheme: Scheme::GeneralisedAlpha, rho_inf: 0.8, ..Time::new(0.4, 4e-3) });
    scene
}

/// True factor of the natural curvature at a part of the length, 0 to 1.
fn truth(place: f64) -> f64 {
    1.0 + 0.25 * (6.0 * place).sin() - 0.2 * place
}

/// The motion of five points with noise.
fn seen(problem: &Problem, seed: u64) -> Vec<Observation> {
    let run = problem.simulate().unwrap();
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let noise = Normal::new(0.0, SIGMA).unwrap();
    let nodes = problem.nodes() - 1;
    let points = (1..=5).map(|k| k * nodes / 5);
    let observed = points.map(|node| {
        let times = run.times().iter().enumerate().step_by(2);
        let samples = times.map(|(k, time)| {
            let [x, y, _] = run.node(node, k);
            let mut off = |x: f64| Some(x + noise.sample(&mut random));
            Sample { time: *time, position: [off(x), off(y), None] }
        });
        let samples = samples.collect();
        Observation::new(samples).at(Point::Node(node)).sigma(SIGMA)
    });
    observed.collect()
}

/// A field of the natural curvature with this prior standard deviation and correlation length.
fn field(sigma: f64, length: f64) -> Field {
    Field { name: "natural_curvature".into(), sigma, length }
}

/// Solves the fit of a field to observations.
fn solved(problem: &Problem, observations: &[Observation], field: Field) -> FieldReport {
    let fit = observations.iter().cloned().fold(FieldFit::new(problem), FieldFit::observe);
    fit.along(field).solve().unwrap()
}

/// The problem with the true curvatures.
fn in_truth(scene: &Scene, parts: usize) -> Problem {
    let mut bent = scene.clone();
    let at = |k: usize| truth((k as f64 + 0.5) / parts as f64);
    bent.rod.natural_curvature = (0..parts).map(at).collect::<Vec<f64>>().into();
    bent.problem().unwrap()
}

/// The estimates of the curvatures differ from the true ones by their standard errors.
#[test]
fn natural_curvatures_are_identified() {
    let parts = 80;
    let scene = arc(parts);
    let observations = seen(&in_truth(&scene, parts), 1);
    let report = solved(&scene.problem().unwrap(), &observations, field(0.3, 0.1));
    println!("{report}");
    // The residuals of a right model have the standard deviation of the noise.
    assert!(report.converged && (0.9..1.1).contains(&report.normalized_residual_rms));
    let found = &report.fields[0];
    let off = (0..parts).map(|k| {
        let expected = truth(found.arc_lengths[k] / 0.5);
        (found.values[k] - expected) / found.standard_errors[k]
    });
    let off: Vec<f64> = off.collect();
    let rms = (off.iter().map(|x| x * x).sum::<f64>() / parts as f64).sqrt();
    // Deviations over standard errors have an RMS near 1; neighbors are correlated, so that the RMS scatters.
    assert!((0.4..1.6).contains(&rms), "{rms}: {off:?}");
    // The data determine more than the prior near the wall, where the curvature moves the whole rod.
    assert!(found.standard_errors[10] < 0.3 * found.prior_std[10]);
    assert!(
        report.effective_parameters > 5.0 && report.effective_parameters < 40.0,
        "{}",
        report.effective_parameters
    );
}

/// A prior that is too narrow for the true values is a warning with a code in the first line; one that is wide enough
/// is none.
#[test]
fn too_narrow_priors_are_reported() {
    let parts = 40;
    let scene = arc(parts);
    let observations = seen(&in_truth(&scene, parts), 3);
    for (sigma, is_narrow) in [(0.3, false), (0.02, true)] {
        let report = solved(&scene.problem().unwrap(), &observations, field(sigma, 0.1));
        println!("{report}");
        let text = report.to_string();
        // A long first line is wrapped.
        let first =
            text.split("\n\n").next().unwrap().split_whitespace().collect::<Vec<_>>().join(" ");
        assert_eq!(first.contains("prior-conflict"), is_narrow, "{first}");
        let has_code = report.warnings.iter().any(|text| text.ends_with("[prior-conflict]"));
        assert_eq!(has_code, is_narrow, "{:?}", report.warnings);
    }
}

/// Values in the middle of equal parts are a list along the rod, factors at arc lengths of their own are none.
#[test]
fn factors_at_arc_lengths_are_no_list_along_the_rod() {
    let mut scene = arc(4);
    assert_eq!(Parameter::list(&scene, "natural_curvature").unwrap().len(), 4);
    let points = BreakPoints { at: vec![0.0, 0.1, 0.5], factor: vec![1.0, 0.6, 0.9] };
    scene.rod.natural_curvature = Along::BreakPoints(points);
    let error = Parameter::list(&scene, "rod.natural_curvature.factor").unwrap_err();
    assert!(error.to_string().contains("a list of values along the rod"), "{error}");
}

/// The optimum and its standard errors equal those of the dense Jacobian, computed column by column.
#[test]
fn lanczos_optimum_equals_dense_jacobian_optimum() {
    let parts = 16;
    let scene = arc(parts);
    let observations = seen(&in_truth(&scene, parts), 2);
    let (sigma, length) = (0.3, 0.08);
    let report = solved(&scene.problem().unwrap(), &observations, field(sigma, length));
    let found = &report.fields[0];
    let mut there = scene.clone();
    there.rod.natural_curvature = found.values.clone().into();
    let problem = there.problem().unwrap();
    let parameters = Parameter::list(&there, "natural_curvature").unwrap();
    assert_eq!(parameters.len(), parts);
    let run = problem.simulate_with(&parameters).unwrap();
    let (mut rows, mut residuals) = (Vec::new(), Vec::new());
    for observation in &observations {
        for sample in &observation.samples {
            let (place, rates) = run.at(observation.point, sample.time).unwrap();
            for c in 0..2 {
                residuals.push((place[c] - sample.position[c].unwrap()) / SIGMA);
                rows.extend(rates.iter().map(|rate| rate[c] / SIGMA));
            }
        }
    }
    let jacobian = DMatrix::from_row_slice(residuals.len(), parts, &rows);
    // The prior, written down once more.
    let stiffness = (length / (0.5 / parts as f64)).powi(2);
    let smooth = DMatrix::from_fn(parts, parts, |i, j| match i.abs_diff(j) {
        0 => 1.0 + stiffness * if i == 0 || i + 1 == parts { 1.0 } else { 2.0 },
        1 => -stiffness,
        _ => 0.0,
    });
    let inverse = smooth.clone().try_inverse().unwrap();
    let scale = sigma / inverse.row(parts / 2).norm();
    let precision = smooth.transpose() * &smooth / (scale * scale);
    let hessian = jacobian.transpose() * &jacobian + &precision;
    let covariance = hessian.try_inverse().unwrap();
    for k in 0..parts {
        let expected = covariance[(k, k)].sqrt();
        let error = found.standard_errors[k];
        // The reference is the dense covariance; truncation of the Lanczos basis increases the errors slightly.
        assert!((0.999..1.03).contains(&(error / expected)), "{k}: {error} for {expected}");
    }
    let departure = DVector::from_fn(parts, |k, _| found.values[k] - 1.0);
    let slope = jacobian.transpose() * DVector::from_vec(residuals) + precision * departure;
    // Newton's step from here, in standard errors of combinations.
    let left = (slope.transpose() * &covariance * &slope)[(0, 0)].sqrt();
    assert!(left < 0.05, "{left}");
}

/// A fit file with `[[field]]` and single parameters, and the errors for unsupported keys.
#[test]
fn field_table_of_fit_file_is_read() {
    let folder = tempfile::tempdir().unwrap();
    let mut scene = arc(12);
    let observations = seen(&in_truth(&scene, 12), 3);
    let mut table = String::from("t,x,y\n");
    for Sample { time, position } in &observations[4].samples {
        table += &format!("{time},{},{}\n", position[0].unwrap(), position[1].unwrap());
    }
    std::fs::write(folder.path().join("tip.csv"), table).unwrap();
    scene.material.youngs_modulus = 1.03e7;
    std::fs::write(folder.path().join("arc.toml"), scene.to_toml().unwrap()).unwrap();
    let text = "scene = 'arc.toml'\n[[observation]]\nfile = 'tip.csv'\nsigma = 2e-4\n\
                [[field]]\nname = 'natural_curvature'\nsigma = 0.3\nlength = 0.1\n\
                [[parameter]]\nname = 'youngs_modulus'\nprior = { mean = 1e7, sigma = 2e5 }\n";
    let file = FitFile::from_toml(text, folder.path()).unwrap();
    let report = file.field_fit().unwrap().unwrap().solve().unwrap();
    println!("{report}");
    assert!(report.converged && report.parameters[0].name == Parameter::YoungsModulus);
    let modulus = &report.parameters[0];
    // The modulus of the simulation, within three standard errors.
    assert!((modulus.value - 1e7).abs() < 3.0 * modulus.standard_error);
    // Not larger than the prior's standard deviation, 2e5 Pa.
    assert!(modulus.standard_error < 2.01e5);
    let values = report.values(&scene).unwrap();
    assert_eq!(values.len(), 13);

    let refused = |from: &str, to: &str| {
        let text = text.replace(from, to);
        FitFile::from_toml(&text, folder.path()).unwrap_err().to_string()
    };
    let message = refused("sigma = 2e-4\n", "");
    assert!(message.contains("observation[0].sigma: found none"), "{message}");
    let message = refused("'natural_curvature'", "'natural_twist'");
    assert!(
        message.contains("field[0].name") && message.contains("rod.natural_curvature"),
        "{message}"
    );
    let message = refused("length = 0.1", "length = -0.1");
    assert!(message.contains("field[0].length: found -0.1"), "{message}");
    let message = refused("length = 0.1", "length = 50.0");
    assert!(message.contains("field[0].length: found 50"), "{message}");
    let message = refused("prior = { mean = 1e7, sigma = 2e5 }\n", "");
    assert!(message.contains("parameter[0].prior: found none"), "{message}");
    let message = refused("[[field]]", "[analysis]\nbootstrap = 10\n[[field]]");
    assert!(message.contains("analysis") && message.contains("[[field]]"), "{message}");
    let beside = observations[4].clone().offset([0.0, 1e-3, 0.0]);
    let fit = FieldFit::new(&scene.problem().unwrap()).observe(beside).along(field(0.3, 0.1));
    let message = fit.identify(Unknown::new(Parameter::Density)).solve().unwrap_err().to_string();
    assert!(message.contains("parameter[0].prior") || message.contains("offset"), "{message}");
}

/// The adjoint gradient of the misfit by fifty unknowns of all kinds equals that of the Jacobian.
#[test]
fn adjoint_gradient_equals_jacobian_gradient() {
    let parts = 40;
    let scene = arc(parts);
    let problem = scene.problem().unwrap();
    let mut observations = seen(&in_truth(&scene, parts), 3);
    observations[2].header.loss = Loss::SoftL1;
    let mut fit = observations.into_iter().fold(Fit::new(&problem), Fit::observe);
    let others = [
        ("youngs_modulus", 1.1e7),
        ("density", 1150.0),
        ("radius", 0.0041),
        ("rod.shape.length", 0.51),
        ("rod.shape.angle", 1.95),
        ("damping.mass", 1.5),
        ("loads.point.0.force.y", 0.03),
        ("loads.gravity.x", 0.1),
        ("supports.angle", 0.02),
        ("camera.time_offset", -0.013),
        ("camera.pixel_scale", 1.02),
        ("camera.in_plane_rotation", 0.03),
        ("camera.clamp_position.x", 2e-3),
    ];
    let mut x = Vec::new();
    for k in 1..=parts {
        let name = format!("natural_curvature.{k}");
        fit = fit.identify(name.parse::<Parameter>().unwrap());
        x.push(1.0 + 0.01 * (k as f64).sin());
    }
    for (name, value) in others {
        let unknown = Unknown::from(name.parse::<Parameter>().unwrap()).start(value);
        let unknown = if name == "radius" { unknown.prior(0.004, 1e-5) } else { unknown };
        x.push(unknown.to_scale(value));
        fit = fit.identify(unknown);
    }
    let (back, forth) = (fit.residuals().unwrap(), fit.residuals().unwrap());
    let gradient = back.gradient(&x).unwrap();
    let (r, rows) = (forth.residuals(&x).unwrap(), forth.jacobian_at(&x).unwrap());
    let mut differs = false;
    for (j, gradient) in gradient.iter().enumerate() {
        let terms = rows.iter().zip(&r).map(|(row, r)| row[j] * r);
        let (expected, size): (f64, f64) =
            terms.fold((0.0, 0.0), |(sum, size), term| (sum + term, size + term.abs()));
        let name = back.unknowns()[j].parameter;
        // Both are exact: rounding errors of sums with terms of `size`.
        assert!((gradient - expected).abs() < 1e-9 * size, "{name}: {gradient} and {expected}");
        assert!(size > 0.0, "{name} does nothing");
        // Sums in another order: another way was gone.
        differs |= *gradient != expected;
    }
    assert!(differs);
    // The misfit there is known then: nothing is run again.
    let cost = back.cost(&x).unwrap();
    assert!((cost - forth.cost(&x).unwrap()).abs() < 1e-12 * cost);
    assert!(
        (back.simulations() - forth.simulations() / 2.0).abs() < 1e-9,
        "{}",
        back.simulations()
    );
}

#[test]
fn observations_without_values_to_fit_are_refused() {
    let problem = arc(8).problem().unwrap();
    let sample = |time: &f64| Sample { time: *time, position: [Some(0.3), Some(0.2), None] };
    let seen = |times: &[f64]| Observation::new(times.iter().map(sample).collect()).sigma(SIGMA);
    for (observation, words) in [
        (seen(&[0.1, 0.2]).held_out(), "observation[0].held_out: found true"),
        (
            Observation::planned(0.3, 100.0).unwrap().sigma(SIGMA),
            "observation[0].file: found no file",
        ),
        (seen(&[0.2, 0.1]), "found 0.1 s after 0.2 s"),
        (seen(&[-0.1, 0.2]), "found t = -0.1 s"),
        (seen(&[]), "found no values"),
    ] {
        let fit = FieldFit::new(&problem).observe(observation).along(field(0.3, 0.1));
        let message = fit.solve().unwrap_err().to_string();
        assert!(message.contains(words), "{message}");
    }
}
