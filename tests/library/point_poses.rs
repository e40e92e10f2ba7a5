//! Measured orientation of a point of the rod: values against markers beside the rod, derivatives, exact data, coverage
//! with noise, mountings, tables and rigid bodies, and invalid input.

use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};
use rodfit::fit::{
    Axes, Channel, FitFile, Measurement, Mounting, PointChannel, PoseSensor, ReactionPart,
    RotationReading, Sample, Sensor,
};
use rodfit::scene::{Dimension, End, Scene, Shape};
use rodfit::{Fit, Observation, Parameter, Point, Problem, Unknown};
use std::f64::consts::PI;

use crate::calls::{refused, short};
use crate::common::differences::{apart, largest};
use crate::common::fits::{record, same_mesh};
use crate::point_sensors::{model, steps};
use crate::sensors::readings as reactions;

/// The point of the tests.
pub const PLACE: Point = Point::ArcLength(0.31);

/// An arc in space that falls out of its plane: its bending twists it.
pub fn twisted() -> Scene {
    let mut scene = short();
    scene.rod.dimension = Dimension::Spatial;
    scene.rod.shape = Shape::Arc { length: 0.5, angle: 1.3 };
    scene.material.poisson_ratio = Some(0.3);
    scene.loads.gravity = [0.0, -3.0, -9.8];
    scene
}

/// A fit of these measurements, whose parameters are not yet stated.
fn fit_of(problem: &Problem, measurements: impl IntoIterator<Item = Measurement>) -> Fit {
    measurements.into_iter().fold(Fit::new(problem), Fit::observe).analyse(same_mesh())
}

/// The model's positions of a marker at an offset from a point: residuals of positions of zero.
fn positions(
    problem: &Problem,
    point: Point,
    offset: [f64; 3],
    times: &[f64],
) -> Vec<Vector3<f64>> {
    let sample = |time: &f64| Sample { time: *time, position: [Some(0.0); 3] };
    let seen = Observation::new(times.iter().map(sample).collect()).at(point).offset(offset);
    let fit = fit_of(problem, [seen.sigma(1.0).into()]).identify(Parameter::YoungsModulus);
    let at = [problem.scene().material.youngs_modulus.ln()];
    let values = fit.residuals().unwrap().residuals(&at).unwrap();
    values.chunks(3).map(Vector3::from_column_slice).collect()
}

/// The rotations of the rod's axes at a point, from markers 0.3 m from it along tangent and first director.
fn axes(problem: &Problem, point: Point, times: &[f64]) -> Vec<Rotation3<f64>> {
    let [center, ahead, beside] = [[0.0; 3], [0.3, 0.0, 0.0], [0.0, 0.3, 0.0]]
        .map(|offset| positions(problem, point, offset, times));
    let at = |k: usize| rotation(ahead[k] - center[k], beside[k] - center[k]);
    (0..times.len()).map(at).collect()
}

/// The rotation whose first axis is the direction of `first`, and whose second one is near `second`.
fn rotation(first: Vector3<f64>, second: Vector3<f64>) -> Rotation3<f64> {
    let first = first.normalize();
    let second = (second - first * first.dot(&second)).normalize();
    let columns = [first, second, first.cross(&second)];
    Rotation3::from_matrix_unchecked(Matrix3::from_columns(&columns))
}

/// A rotation as a quaternion; every second one has the other sign.
fn quaternion(k: usize, rotation: &Rotation3<f64>) -> [f64; 4] {
    let q = UnitQuaternion::from_rotation_matrix(rotation);
    let sign = if k % 2 == 1 { -1.0 } else { 1.0 };
    [q.w, q.i, q.j, q.k].map(|c| sign * c)
}

/// Readings at these times of a sensor that is turned against the rod: `M = F C'` with the mounting `C`.
fn readings(
    times: &[f64],
    axes: &[Rotation3<f64>],
    mounting: &Rotation3<f64>,
) -> Vec<RotationReading> {
    let reading = |(k, (time, axes)): (usize, (&f64, &Rotation3<f64>))| RotationReading {
        time: Some(*time),
        quaternion: quaternion(k, &(axes * mounting.inverse())),
    };
    times.iter().zip(axes).enumerate().map(reading).collect()
}

/// Readings at all steps of a sensor whose axes are those of the rod.
pub fn exact(problem: &Problem) -> Vec<RotationReading> {
    let times = steps(problem);
    readings(&times, &axes(problem, PLACE, &times), &Rotation3::identity())
}

/// The measurements of a sensor with a known standard deviation.
pub fn measured(sensor: &PoseSensor, problem: &Problem) -> Vec<Measurement> {
    let mut measurements = sensor.measurements(problem).unwrap();
    measurements.iter_mut().for_each(|own| own.header.sigma = Some(1e-3));
    measurements
}

/// Relative errors of the parameters, which are identified from other values.
fn errors(
    problem: &Problem,
    measurements: impl IntoIterator<Item = Measurement>,
    parameters: &[(Parameter, f64)],
) -> Vec<f64> {
    let others = parameters.iter().map(|(parameter, truth)| (*parameter, 1.2 * truth));
    let start = problem.with(others).unwrap();
    let fit = fit_of(&start, measurements);
    let fit = parameters.iter().fold(fit, |fit, (parameter, _)| fit.identify(*parameter));
    let report = fit.solve().unwrap();
    let error = |(parameter, truth): &(Parameter, f64)| {
        let found = report.parameters.iter().find(|own| own.name == *parameter).unwrap();
        (found.value.unwrap() / truth - 1.0).abs()
    };
    parameters.iter().map(error).collect()
}

/// Modulus and Poisson's ratio of the twisted rod.
fn elastic() -> [(Parameter, f64); 2] {
    let ratio = "material.poisson_ratio".parse().unwrap();
    [(Parameter::YoungsModulus, 1e8), (ratio, 0.3)]
}

#[test]
fn exact_poses_give_modulus_in_a_plane() {
    let problem = short().problem().unwrap();
    let times = steps(&problem);
    let axes = axes(&problem, PLACE, &times);
    let directions = ["-z", "x", "-y"].map(String::from);
    let known = Mounting::Known {
        axes: Some(Axes::try_from(directions.to_vec()).unwrap()),
        rotation: [0.3, -0.2, 0.5],
    };
    // Columns of the mounting: the signed axes of the sensor along tangent and directors, turned by the rotation.
    let by_axes = Matrix3::new(0.0, 1.0, 0.0, 0.0, 0.0, -1.0, -1.0, 0.0, 0.0);
    let turned = Rotation3::new(Vector3::new(0.3, -0.2, 0.5));
    let mounting = turned * Rotation3::from_matrix_unchecked(by_axes);
    let unknown = Rotation3::new(Vector3::new(-1.2, 2.0, 0.4));
    for (mounting, rotation) in
        [(Mounting::default(), Rotation3::identity()), (known, mounting), (Mounting::Free, unknown)]
    {
        let sensor = PoseSensor::new(PLACE, readings(&times, &axes, &rotation)).mounting(mounting);
        let own = measured(&sensor, &problem);
        assert_eq!((own.len(), own[0].data.axis()), (1, Some("angle")));
        let off = errors(&problem, own, &elastic()[..1]);
        assert!(off[0] < 1e-7, "{mounting:?}: {off:?}");
    }
}

/// Poses of one point of an arc that twists: modulus and Poisson's ratio, as positions of the point give both.
#[test]
fn exact_poses_in_space_give_modulus_and_poisson_ratio_as_positions_do() {
    let problem = twisted().problem().unwrap();
    let times = steps(&problem);
    let axes = axes(&problem, PLACE, &times);
    let unknown = Rotation3::new(Vector3::new(-1.2, 2.0, 0.4));
    for (mounting, rotation) in [
        (Mounting::default(), Rotation3::identity()),
        (Mounting::Known { axes: None, rotation: [-1.2, 2.0, 0.4] }, unknown),
        (Mounting::Free, unknown),
    ] {
        let sensor = PoseSensor::new(PLACE, readings(&times, &axes, &rotation)).mounting(mounting);
        let own = measured(&sensor, &problem);
        let names: Vec<_> = own.iter().filter_map(|own| own.data.axis()).collect();
        assert_eq!(names, ["rt", "r1", "r2"]);
        assert!(own.iter().all(|own| own.header.unit == "rad"));
        let off = errors(&problem, own, &elastic());
        assert!(off.iter().all(|off| *off < 1e-7), "{mounting:?}: {off:?}");
    }
    let place = positions(&problem, Point::Tip, [0.0; 3], &times);
    let sample = |(time, x): (&f64, &Vector3<f64>)| Sample {
        time: *time,
        position: [0, 1, 2].map(|c| Some(x[c])),
    };
    let tip = Observation::new(times.iter().zip(&place).map(sample).collect()).sigma(1e-4);
    let off = errors(&problem, [tip.into()], &elastic());
    assert!(off.iter().all(|off| *off < 1e-7), "positions: {off:?}");
}

#[test]
fn pose_at_rest_gives_modulus() {
    for scene in [short(), twisted()] {
        let problem = scene.problem().unwrap();
        // The equilibrium as a start is a motion without any change.
        let mut still = scene.clone();
        still.initial.state = rodfit::scene::InitialState::Equilibrium;
        let axes = axes(&still.problem().unwrap(), PLACE, &[0.0]);
        let quaternion = quaternion(1, &axes[0]);
        let sensor = PoseSensor::new(PLACE, vec![RotationReading { time: None, quaternion }]);
        let off = errors(&problem, measured(&sensor, &problem), &elastic()[..1]);
        assert!(off[0] < 1e-7, "{off:?}");
        let [key, ..] = refused(sensor.mounting(Mounting::Free).measurements(&problem));
        assert_eq!(key, "tare");
    }
}

/// The measured axes pass a filter, by small Euler steps, before they are made orthonormal.
#[test]
fn filter_is_applied_to_the_axes_of_the_model() {
    const PARTS: usize = 20_000;
    let problem = twisted().problem().unwrap();
    let (times, rate) = (steps(&problem), 2.0 * PI * 15.0);
    let all: Vec<f64> = std::iter::once(0.0).chain(times.iter().copied()).collect();
    let axes = axes(&problem, PLACE, &all);
    let columns = |k: usize| axes[k].matrix().fixed_columns::<2>(0).into_owned();
    let (mut y, mut filtered) = (columns(0), Vec::new());
    for k in 1..all.len() {
        let (before, after, h) = (columns(k - 1), columns(k), (all[k] - all[k - 1]) / PARTS as f64);
        for part in 0..PARTS {
            let u = before + (after - before) * ((part as f64 + 0.5) / PARTS as f64);
            // The midpoint rule.
            let middle = y + (u - y) * (0.5 * h * rate);
            y += (u - middle) * (h * rate);
        }
        filtered.push(rotation(y.column(0).into_owned(), y.column(1).into_owned()));
    }
    let sensor = PoseSensor::new(PLACE, readings(&times, &filtered, &Rotation3::identity()));
    let error =
        |sensor: &PoseSensor| errors(&problem, measured(sensor, &problem), &elastic()[..1])[0];
    let (without, with_filter) = (error(&sensor), error(&sensor.clone().low_pass(15.0)));
    // 20000 steps of the midpoint rule per step leave 1e-10.
    assert!(with_filter < 1e-7 && without > 1e-2, "{with_filter:e} {without:e}");
}

/// One rod, measured by each kind of sensor.
#[test]
fn one_rod_has_the_same_modulus_by_each_sensor() {
    let problem = short().problem().unwrap();
    let times = steps(&problem);
    let at_point = |channel: PointChannel| -> Measurement {
        Sensor::new(channel, model(&problem, channel, &times)).sigma(1e-3).into()
    };
    let of_wall = |part, axis| -> Measurement {
        let channel = Channel::along_world(End::Start, part, axis);
        Sensor::new(channel, reactions(&problem, channel)).sigma(1e-3).into()
    };
    let pose = measured(&PoseSensor::new(PLACE, exact(&problem)), &problem).remove(0);
    for own in [
        record(&problem.simulate().unwrap(), 50).sigma(1e-4).into(),
        of_wall(ReactionPart::Force, 1),
        of_wall(ReactionPart::Moment, 2),
        at_point(PointChannel::acceleration(PLACE, 1)),
        at_point(PointChannel::angle(PLACE)),
        at_point(PointChannel::curvature(PLACE, 0)),
        at_point(PointChannel::strain(PLACE, [5e-3, 0.0])),
        pose,
    ] {
        let name = own.data.axis().unwrap_or("position");
        let off = errors(&problem, [own.clone()], &elastic()[..1]);
        assert!(off[0] < 1e-7, "{name}: {off:?}");
    }
}

/// First derivatives of all components against central differences, with measured rotations near the model's, by about
/// half a turn from it, and by exactly half a turn; and a second derivative. Also with a free mounting.
#[test]
fn derivatives_of_poses_equal_differences() {
    let problem = twisted().problem().unwrap();
    let names = [
        "material.youngs_modulus",
        "material.poisson_ratio",
        "rod.shape.length",
        "rod.section.radius",
    ];
    let times = [0.0307, 0.05, 0.0623, 0.0811];
    let axes = axes(&problem, PLACE, &times);
    for (rotation, mounting, low_pass) in [
        ([0.0; 3], Mounting::default(), None),
        ([0.2, -0.1, 0.3], Mounting::default(), Some(20.0)),
        ([0.0, PI - 0.05, 0.0], Mounting::default(), None),
        ([0.4, -2.0, 1.1], Mounting::Free, None),
    ] {
        // Readings that the model does not explain, so that second derivatives of the mounting matter.
        let scattered: Vec<_> = axes
            .iter()
            .enumerate()
            .map(|(k, own)| own * Rotation3::new(Vector3::new(0.3, -0.2, 0.1) * (k as f64).sin()))
            .collect();
        let turned = readings(&times, &scattered, &Rotation3::new(rotation.into()));
        let sensor = PoseSensor { low_pass, ..PoseSensor::new(PLACE, turned).mounting(mounting) };
        let fit = names.iter().fold(fit_of(&problem, measured(&sensor, &problem)), |fit, name| {
            fit.identify(Unknown::new(name.parse::<Parameter>().unwrap()))
        });
        let residuals = fit.residuals().unwrap();
        let value =
            |unknown: &Unknown| unknown.to_scale(unknown.parameter.of(problem.scene()).unwrap());
        let x: Vec<f64> = residuals.unknowns().iter().map(value).collect();
        let exact = residuals.jacobian_at(&x).unwrap();
        let shifted = |j: usize, step: f64| {
            let mut x = x.clone();
            x[j] += step;
            x
        };
        for j in 0..x.len() {
            let at = |step: f64| residuals.residuals(&shifted(j, step)).unwrap();
            let side = |h: f64| -> Vec<f64> {
                at(h).iter().zip(at(-h)).map(|(a, b)| (a - b) / (2.0 * h)).collect()
            };
            // Richardson's extrapolation: of fourth order.
            let [one, two] = [side(1e-4), side(2e-4)];
            let by_differences: Vec<f64> =
                one.iter().zip(two).map(|(a, b)| (4.0 * a - b) / 3.0).collect();
            let column: Vec<f64> = exact.iter().map(|row| row[j]).collect();
            let error = apart(&column, &by_differences) / largest(&column);
            assert!(error < 1e-6, "{rotation:?} by unknown {j}: {error:e}");
        }
        // The second derivative of half the sum of squares by the modulus, against that of its slope.
        let slope = |step: f64| -> f64 {
            let values = residuals.residuals(&shifted(0, step)).unwrap();
            let rows = residuals.jacobian_at(&shifted(0, step)).unwrap();
            values.iter().zip(rows).map(|(value, row)| value * row[0]).sum()
        };
        let second = residuals.hessian_at(&x).unwrap()[0][0];
        let error = (second - (slope(1e-4) - slope(-1e-4)) / 2e-4).abs() / second.abs();
        assert!(error < 1e-6, "{rotation:?}: second derivative {second}, {error:e}");
    }
    // Exactly half a turn from the model.
    let turned = readings(&times, &axes, &Rotation3::new(Vector3::new(PI, 0.0, 0.0)));
    let own = measured(&PoseSensor::new(PLACE, turned), &problem);
    let residuals = fit_of(&problem, own).identify(Parameter::YoungsModulus).residuals().unwrap();
    let x = [1e8_f64.ln()];
    let values = residuals.residuals(&x).unwrap();
    let rows = residuals.jacobian_at(&x).unwrap();
    assert!(rows.iter().flatten().all(|x| x.is_finite()), "{rows:?}");
    let most = largest(&values) * 1e-3;
    assert!((most - PI).abs() < 1e-6, "{most}");
}

/// Of 200 noisy data sets the number whose 95 % interval contains the modulus.
fn covered(scene: Scene, mounting: Mounting) -> usize {
    let mut scene = scene;
    scene.rod.segments = Some(5);
    scene.time.as_mut().unwrap().step = Some(5e-3);
    let problem = scene.problem().unwrap();
    let times = steps(&problem);
    let axes = axes(&problem, Point::Tip, &times);
    let noise = Normal::new(0.0, 0.01).unwrap();
    let contains = |seed: &u64| {
        let mut random = ChaCha8Rng::seed_from_u64(*seed);
        let mut noisy = |own: &Rotation3<f64>| {
            own * Rotation3::new(Vector3::from_fn(|_, _| noise.sample(&mut random)))
        };
        let noisy: Vec<_> = axes.iter().map(&mut noisy).collect();
        let rotation = match mounting {
            Mounting::Free => Rotation3::new(Vector3::new(0.7, -0.4, 1.1)),
            Mounting::Known { .. } => Rotation3::identity(),
        };
        let sensor = PoseSensor::new(Point::Tip, readings(&times, &noisy, &rotation));
        let own = sensor.mounting(mounting).measurements(&problem).unwrap();
        let fit = fit_of(&problem, own).identify(Unknown::new(Parameter::YoungsModulus).start(1e8));
        let report = fit.solve().unwrap();
        let [low, high] = report.parameters[0].interval95.unwrap();
        (low..=high).contains(&1e8)
    };
    let covered = (0..200).filter(contains).count();
    println!("{mounting:?}: {covered} of 200 intervals");
    covered
}

/// The expectation is 190 of 200, the standard deviation 3.1; 92 to 97 % are 184 to 194.
#[test]
fn intervals_from_noisy_poses_cover_the_modulus() {
    for (scene, mounting) in [(short(), Mounting::default()), (twisted(), Mounting::Free)] {
        let covered = covered(scene, mounting);
        assert!((184..=194).contains(&covered), "{mounting:?}: {covered}");
    }
}

/// A fit file with one observation of poses that has these keys, of `name` with this text.
fn fit_file(
    scene: &Scene,
    keys: &str,
    name: &str,
    text: &str,
) -> (tempfile::TempDir, Result<FitFile, rodfit::Error>) {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    std::fs::write(path("scene.toml"), scene.to_toml().unwrap()).unwrap();
    std::fs::write(path(name), text).unwrap();
    let fit = format!(
        "scene = \"scene.toml\"\n[[parameter]]\nname = \"material.youngs_modulus\"\n[[observation]]\n\
         quantity = \"pose\"\nfile = \"{name}\"\n{keys}\n"
    );
    std::fs::write(path("fit.toml"), fit).unwrap();
    let file = FitFile::load(path("fit.toml"));
    (folder, file)
}

/// A table of readings by its header and the row of each.
fn table(
    header: &str,
    readings: &[RotationReading],
    row: impl Fn(f64, [f64; 4]) -> String,
) -> String {
    let line = |own: &RotationReading| row(own.time.unwrap(), own.quaternion) + "\n";
    format!("{header}\n{}", readings.iter().map(line).collect::<String>())
}

/// The rotation vector of a quaternion, rad.
fn vector([w, x, y, z]: [f64; 4]) -> Vector3<f64> {
    UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(w, x, y, z)).scaled_axis()
}

/// An export of Motive with two rigid bodies, the second one with these readings. Rotations are `X, Y, Z, W`.
fn motive(readings: &[RotationReading]) -> String {
    let two = |a: &str, b: &str| format!(",{a}").repeat(7) + &format!(",{b}").repeat(7);
    let head = "Format Version,1.23,Rotation Type,Quaternion,Length Units,Millimeters,Coordinate Space,Global";
    let properties = ",Rotation,Rotation,Rotation,Rotation,Position,Position,Position".repeat(2);
    let rows: String = readings
        .iter()
        .enumerate()
        .map(|(k, own)| {
            let [w, x, y, z] = own.quaternion;
            format!("{k},{},0,0,0,1,1,2,3,{x},{y},{z},{w},250,0,0\n", own.time.unwrap())
        })
        .collect();
    format!(
        "{head}\n\n,Type{}\n,Name{}\n,ID{}\n,{properties}\nFrame,Time (Seconds){}\n{rows}",
        two("Rigid Body", "Rigid Body"),
        two("hand", "cluster"),
        two("1", "2"),
        ",X,Y,Z,W,X,Y,Z".repeat(2),
    )
}

#[test]
fn tables_and_rigid_bodies_give_the_same_modulus() {
    let scene = twisted();
    let problem = scene.problem().unwrap();
    let exact = exact(&problem);
    let point = "point = { arc_length = 0.31 }\nsigma = 1e-3";
    let quaternions = table("qz,qy,t[ms],qw,qx,temperature", &exact, |t, [w, x, y, z]| {
        format!("{z},{y},{},{w},{x},20", 1e3 * t)
    });
    let degrees = table("t,rx[deg],ry[deg],rz[deg]", &exact, |t, q| {
        let r = vector(q).map(f64::to_degrees);
        format!("{t},{},{},{}", r.x, r.y, r.z)
    });
    let axis_angle = table("frame,ux,uy,uz,angle[rad]", &exact, |t, q| {
        let (r, frame) = (vector(q), (t / 2e-3).round());
        let axis = r.normalize();
        // Whole turns do not matter.
        format!("{frame},{},{},{},{}", axis.x, axis.y, axis.z, r.norm() + 2.0 * PI)
    });
    let mut found = Vec::new();
    for (keys, name, text) in [
        ("", "poses.csv", quaternions.clone()),
        ("tare = \"free\"", "poses.csv", quaternions),
        ("", "poses.csv", degrees),
        ("fps = 500", "poses.csv", axis_angle),
        ("body = \"cluster\"", "take.csv", motive(&exact)),
        ("body = \"cluster\"\ntare = \"free\"", "take.csv", motive(&exact)),
    ] {
        let (_folder, file) = fit_file(&scene, &format!("{point}\n{keys}"), name, &text);
        let file = file.unwrap();
        assert_eq!(file.experiments[0].measurements.len(), 3, "{keys}");
        let report = file.fit().analyse(same_mesh()).solve().unwrap();
        assert_eq!(report.units, ["rad"; 3]);
        found.push(report.parameters[0].value.unwrap());
        let off = (found[found.len() - 1] / 1e8 - 1.0).abs();
        assert!(off < 1e-7, "{keys}: {off:e}");
    }
    assert!((found[4] / found[0] - 1.0).abs() < 1e-12, "{found:?}");
}

#[test]
fn invalid_poses_are_refused_with_key_and_line() {
    let row = "t,qw,qx,qy,qz\n0.01,1,0,0,0\n0.02,1,0,0,0\n";
    for (keys, key) in [
        ("of = \"start\"", "observation[0].of"),
        ("tare = [0.1, 0.0, 0.0]", "observation[0].tare"),
        ("tare = 0.1", "observation[0].tare"),
        ("tare = \"free\"\naxes = [\"z\", \"x\", \"y\"]", "observation[0].axes"),
        ("tare = \"free\"\nrotation = [0.1, 0.0, 0.0]", "observation[0].rotation"),
        ("axes = [\"z\", \"x\", \"none\"]", "observation[0].axes"),
        ("offset = [0.0, 0.1, 0.0]", "observation[0].offset"),
        ("point = { arc_length = 7.0 }", "observation[0].point"),
        ("filter = { low_pass = 0.0 }", "observation[0].filter.low_pass"),
        // Of a planar scene.
        ("rotation = [0.3, 0.0, 0.0]", "observation[0].file"),
    ] {
        let (_folder, file) = fit_file(&short(), keys, "poses.csv", row);
        assert_eq!(refused(file)[0], key, "{keys}");
    }
    // A rotation about the normal of the plane, and tilts below ten degrees, are accepted.
    for keys in ["rotation = [0.0, 0.0, 0.3]", "rotation = [0.1, 0.0, 0.0]"] {
        fit_file(&short(), keys, "poses.csv", row).1.unwrap();
    }
    for (keys, text, words) in [
        ("", "t,x\n0.01,1\n", "one form of the rotation"),
        ("", "t,qw,qx,qy,qz,rx,ry,rz\n0.01,1,0,0,0,0,0,0\n", "one form of the rotation"),
        (
            "",
            "t,qw,qx,qy,qz\n0.01,1,0,0,0\n0.02,0.9,0,0,0\n",
            "poses.csv:3: found a quaternion of the length 0.9",
        ),
        ("", "t,qw,qx,qy,qz\n0.01,1,0,,0\n", "poses.csv:2: found a pose without `qy`"),
        ("", "t,ux,uy,uz,angle\n0.01,1,1,0,0.1\n", "found a rotation axis of the length"),
        ("", "t,rx[m],ry,rz\n0.01,1,0,0\n", "unit [m]"),
        (
            "",
            "t,rx,ry,rz\n0.01,0,30,0\n",
            "poses.csv:2: found angles up to 30 in the column ry without a unit",
        ),
        ("", "t,ux,uy,uz,angle\n0.01,1,0,0,30\n", "angle[deg]"),
        ("", "t,qw,qx,qy,qz\n-0.01,1,0,0,0\n", "time_zero"),
        ("", "frame,qw,qx,qy,qz\n1,1,0,0,0\n", "fps"),
        ("", "t,qw,qx,qy,qz\n5.0,1,0,0,0\n", "time.end"),
        ("", "t,qw,qx,qy,qz\n0.01,,,,\n", "found no reading"),
        ("body = \"hand\"", row, "with an export of Motive only"),
        ("window = [0.1, 0.2]", row, "window from 0.1 to 0.2 s"),
        ("window = [0.1, 0.2]", "qw,qx,qy,qz\n1,0,0,0\n", "window and no clock"),
        ("tare = \"free\"", "qw,qx,qy,qz\n1,0,0,0\n1,0,0,0\n", "rotations at rest"),
        ("tare = \"free\"", "t,qw,qx,qy,qz\n0.01,1,0,0,0\n", "of 1 reading"),
        ("tare = \"free\"\nloss = \"huber\"", row, "robust loss"),
        ("filter = { low_pass = 5.0 }", "qw,qx,qy,qz\n1,0,0,0\n", "a filter of readings at rest"),
    ] {
        for scene in [short(), twisted()] {
            let (_folder, file) = fit_file(&scene, keys, "poses.csv", text);
            let error = file.unwrap_err().to_string();
            assert!(error.contains(words), "{keys} {text}: {error}");
        }
    }
    let export = motive(&[RotationReading { time: Some(0.01), quaternion: [1.0, 0.0, 0.0, 0.0] }]);
    for (keys, words) in [("", "several rigid bodies"), ("body = \"foot\"", "hand, cluster")] {
        let error = fit_file(&twisted(), keys, "take.csv", &export).1.unwrap_err().to_string();
        assert!(error.contains(words), "{error}");
    }
    let other = "[[observation]]\nfile = \"poses.csv\"\nbody = \"hand\"";
    let (_folder, file) = fit_file(&short(), other, "poses.csv", row);
    assert_eq!(refused(file)[0], "observation[1].body");
}
