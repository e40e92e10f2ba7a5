//! Markers beside the centerline of a rod at rest: closed forms of their positions, exact derivatives, columns of files, and
//! the fit of the example `tendon_takes` to takes that the program makes.

#[path = "../../examples/tendon_takes/tentacle.rs"]
#[allow(dead_code, reason = "the example uses more of it")]
mod tentacle;

use rodfit::fit::{Experiment, FitFile, Residuals, RestShape, ShapePoint};
use rodfit::scene::{ActuatedStrain, Actuation, Dimension, Material, Section, Taper};
use rodfit::{Fit, Parameter, Point, Scene};
use tentacle::{BASIC, Model, Take, fit, predict};

use crate::common::straight_rod;

const LENGTH: f64 = 0.3;
const SEGMENTS: usize = 40;
/// Middle of an edge: the wall is in the middle of the first one.
const PLACE: f64 = 25.0 * LENGTH / (SEGMENTS as f64 - 0.5);
/// Offset of a marker along the tangent and both material directors, m.
const OFFSET: [f64; 3] = [0.004, 0.02, -0.013];

/// A straight rod along x without weight, with an actuated strain.
fn actuated(component: ActuatedStrain, gain: f64) -> Scene {
    let mut scene = straight_rod(SEGMENTS, [LENGTH, 4e-3], Material::new(1200.0, 2e6));
    scene.material.poisson_ratio = Some(0.4);
    scene.rod.dimension = Dimension::Spatial;
    scene.actuation =
        vec![Actuation::Curvature { component, from: 0.0, to: None, signal: None, gain }];
    scene
}

/// Residuals of a shape, with a standard deviation of 1 m.
fn residuals_of(scene: &Scene, sightings: &[ShapePoint], parameters: &[Parameter]) -> Residuals {
    let shape = RestShape::new(sightings.to_vec()).sigma(1.0);
    let fit = Fit::of([Experiment::new("", &scene.problem().unwrap()).observe(shape)]);
    parameters.iter().fold(fit, |fit, p| fit.identify(*p)).residuals().unwrap()
}

/// Simulated position of a marker at [`PLACE`], m.
fn marker(scene: &Scene, offset: [f64; 3]) -> [f64; 3] {
    let sighting = ShapePoint::new(Point::ArcLength(PLACE), [Some(0.0); 3]).offset(offset);
    let residuals = residuals_of(scene, &[sighting], &[Parameter::YoungsModulus]);
    let found = residuals.residuals(&[scene.material.youngs_modulus.ln()]).unwrap();
    [found[0], found[1], found[2]]
}

/// On a rod with an actuated twist or curvature the offset is rotated by its integral up to the point. The first director is
/// y, the second z.
#[test]
fn marker_at_rest_rotates_by_the_integral_of_the_strain() {
    let gain = 4.0;
    let (sine, cosine) = (gain * PLACE).sin_cos();
    let [t, d1, d2] = OFFSET;
    for (component, expected) in [
        (ActuatedStrain::Twist, [t, d1 * cosine - d2 * sine, d1 * sine + d2 * cosine]),
        (ActuatedStrain::D1, [t * cosine - d1 * sine, t * sine + d1 * cosine, d2]),
        (ActuatedStrain::D2, [t * cosine - d2 * sine, d1, t * sine + d2 * cosine]),
    ] {
        let mut scenes = vec![actuated(component, gain)];
        if component == ActuatedStrain::D1 {
            // The planar model has an offset out of its plane too.
            scenes.push(actuated(component, gain));
            scenes[1].rod.dimension = Dimension::Planar;
        }
        for scene in scenes {
            let [with, without] = [OFFSET, [0.0; 3]].map(|offset| marker(&scene, offset));
            let off = (0..3).map(|c| (with[c] - without[c] - expected[c]).abs());
            let off = off.fold(0.0, f64::max);
            println!("{component:?}: off by {off:.1e} m");
            // In the middle of an edge a twist is exact. A joint bends by 2 atan(x/2) = x - x^3/12 with x = k h.
            let joint = gain * PLACE / 25.0;
            let bound = match component {
                ActuatedStrain::Twist => 1e-12,
                _ => 1.1 * gain * PLACE * joint * joint / 12.0 * 0.024,
            };
            assert!(off < bound, "{component:?}: {off:e} of {bound:e}");
        }
    }
}

/// The Jacobian equals differences of the residuals, and the Hessian those of the gradient, by parameters that bend, twist,
/// tilt and lengthen a rod under its weight.
#[test]
fn marker_at_rest_has_exact_derivatives() {
    let mut spatial = actuated(ActuatedStrain::Twist, 3.0);
    spatial.rod.section = Section::Rectangle { width: 0.012, height: 0.008, up: [0.0, 1.0, 1.0] };
    spatial.rod.taper = Taper { height: Some(vec![1.0, 0.8].into()), ..Taper::default() };
    spatial.loads.gravity = [0.0, -9.81, 2.0];
    let mut planar = actuated(ActuatedStrain::D1, 3.0);
    planar.rod.dimension = Dimension::Planar;
    planar.loads.gravity = [0.0, -9.81, 0.0];
    let both = ["youngs_modulus", "density", "rod.shape.length", "actuation.0.gain"];
    let in_space = ["rod.shape.direction.z", "rod.section.up.y"];
    for (scene, names) in
        [(&planar, both.to_vec()), (&spatial, [&both[..], &in_space[..]].concat())]
    {
        let parameters: Vec<Parameter> = names.iter().map(|name| name.parse().unwrap()).collect();
        let position = [Some(0.2), Some(-0.1), Some(0.05)];
        let at = |point| ShapePoint::new(point, position).offset(OFFSET);
        let sightings = [at(Point::ArcLength(0.21)), at(Point::Tip)];
        let residuals = residuals_of(scene, &sightings, &parameters);
        let unknowns = residuals.unknowns().iter();
        let x: Vec<f64> = unknowns.map(|u| u.to_scale(u.parameter.of(scene).unwrap())).collect();
        let (jacobian, hessian) =
            (residuals.jacobian_at(&x).unwrap(), residuals.hessian_at(&x).unwrap());
        let gradient = |x: &[f64]| -> Vec<f64> {
            let (r, j) = (residuals.residuals(x).unwrap(), residuals.jacobian_at(x).unwrap());
            (0..x.len()).map(|i| r.iter().zip(&j).map(|(r, row)| r * row[i]).sum()).collect()
        };
        for (i, name) in names.iter().enumerate() {
            let h = 1e-4;
            let along = |k: f64| {
                let mut x = x.clone();
                x[i] += k * h;
                x
            };
            let by_differences = |value: &dyn Fn(&[f64]) -> Vec<f64>| -> Vec<f64> {
                let side = |k: f64| {
                    let [a, b] = [k, -k].map(|k| value(&along(k)));
                    a.iter().zip(b).map(|(a, b)| a - b).collect::<Vec<f64>>()
                };
                let [a, b] = [1.0, 2.0].map(side);
                (0..a.len()).map(|k| (8.0 * a[k] - b[k]) / (12.0 * h)).collect()
            };
            let largest = |values: &[f64]| values.iter().fold(0.0_f64, |a, x| a.max(x.abs()));
            let off = |exact: &[f64], differences: Vec<f64>| {
                let off: Vec<f64> = exact.iter().zip(differences).map(|(a, b)| a - b).collect();
                largest(&off) / largest(exact)
            };
            let column: Vec<f64> = jacobian.iter().map(|row| row[i]).collect();
            let first = off(&column, by_differences(&|x| residuals.residuals(x).unwrap()));
            let second = off(&hessian[i], by_differences(&gradient));
            println!("{name}: off by {first:.1e}, second derivatives by {second:.1e}");
            // Five-point differences in steps of 1e-4.
            assert!(first < 1e-6 && second < 1e-6, "{name}: {first:e} {second:e}");
        }
    }
}

/// Offsets in columns of the file are those of the library; blank ones are zero. Without arc lengths, and longer than the rod,
/// they are rejected.
#[test]
fn offset_columns_of_a_shape_are_read_and_checked() {
    let folder = tempfile::tempdir().unwrap();
    let mut scene = actuated(ActuatedStrain::D1, 3.0);
    scene.loads.gravity = [0.0, -9.81, 0.0];
    std::fs::write(folder.path().join("scene.toml"), scene.to_toml().unwrap()).unwrap();
    let read = |table: &str| {
        std::fs::write(folder.path().join("shape.csv"), table).unwrap();
        let text = "scene = \"scene.toml\"\n[[shape]]\nfile = \"shape.csv\"\nsigma = 1e-3\n\
                    [[parameter]]\nname = \"youngs_modulus\"\n";
        FitFile::from_toml(text, folder.path())
    };
    let table = "s[mm],offset_t[mm],offset_d1[mm],x,y\n200,1,20,0.2,0.01\n300,,,0.3,0.02\n";
    let fit = read(table).unwrap().fit();
    let shape = RestShape::read(folder.path().join("shape.csv")).unwrap();
    let at =
        |s: f64, x: f64, y: f64| ShapePoint::new(Point::ArcLength(s), [Some(x), Some(y), None]);
    let expected = [at(0.2, 0.2, 0.01).offset([1e-3, 0.02, 0.0]), at(0.3, 0.3, 0.02)];
    assert_eq!(shape.data.sightings, expected);
    assert!(fit.residuals().is_ok());
    for (table, part) in [
        ("x,y,offset_d1\n0.1,0,0.01\n0.2,0,0.01\n0.3,0,0.01\n", "column `offset_d1`"),
        ("s,x,y,offset_d1\n0.1,0,0,20\n", "up to the rod's length"),
        ("s,x,y,offset_d1[kg]\n0.1,0,0,20\n", "unit [kg]"),
    ] {
        let error = match read(table) {
            Err(error) => error.to_string(),
            Ok(file) => file.fit().solve().unwrap_err().to_string(),
        };
        assert!(error.contains(part), "{error}");
    }
}

/// Four takes with known modulus and density, in the plane of a tendon, across and between: the fit returns both.
#[test]
fn exact_tendon_takes_give_exact_modulus_and_density() {
    let truth = [3.7e5, 1150.0];
    let tensions = [[1.5, 0.0], [0.0, 4.0], [3.0, 3.0], [6.0, 3.0]];
    let model = Model { segments: 4, ..BASIC };
    let mut takes: Vec<Take> = (0..tensions.len())
        .map(|k| Take {
            name: format!("take {k}"),
            tensions: tensions[k],
            markers: vec![[k as f64, 0.0, 0.0]; 4],
        })
        .collect();
    let exact = predict(&model, &takes, &truth).unwrap();
    for (take, markers) in takes.iter_mut().zip(exact) {
        take.markers = markers;
    }
    let report = fit(&model, &takes, false).unwrap();
    for (estimate, truth) in report.parameters.iter().zip(truth) {
        let off = (estimate.value.unwrap() / truth - 1.0).abs();
        println!("{}: off by {off:.1e}", estimate.name);
        // Takes of the same mesh: the convergence criterion of the search.
        assert!(off < 1e-6, "{report}");
    }
}
