//! Reports, scenes and fits are unchanged after they are written and read; files in the documents are valid.

use rodfit::fit::{Experiment, FitFile, FitReport, RestShape, ShapePoint};
use rodfit::scene::{PointForce, Shape, Signal, Time};
use rodfit::{Fit, Observation, Parameter, Point, Scene, Trajectory};

use crate::calls::{refused, short};
use crate::common::fits::{record, write_scene_and_record};

/// Writes a report as JSON, reads it and requires equality to the last digit. Returns the report that was read.
fn round_trip<T>(report: &T) -> T
where
    T: serde::Serialize + serde::de::DeserializeOwned + PartialEq + std::fmt::Debug,
{
    let json = serde_json::to_string(report).unwrap();
    let back: T = serde_json::from_str(&json).unwrap();
    assert_eq!(back, *report);
    back
}

/// Error of the position of sample `k`, m.
fn off(k: usize) -> f64 {
    1e-3 * (k as f64 * 2.4).sin()
}

/// A record with these errors.
fn displaced(mut record: Observation) -> Observation {
    record.samples.iter_mut().enumerate().for_each(|(k, s)| {
        s.position = s.position.map(|x| x.map(|x| x + off(k)));
    });
    record
}

#[test]
fn report_is_equal_after_reading_its_json() {
    let mut scene = short();
    scene.material.poisson_ratio = Some(0.4);
    let problem = scene.problem().unwrap();
    let rest = problem.equilibrium().unwrap();
    assert_eq!(round_trip(&rest).model, "planar");
    let modes = problem.modes(4, Default::default()).unwrap();
    assert_eq!(round_trip(&modes).modes.len(), 4);
    let check = rodfit::check::check_problem(&problem, Default::default()).unwrap();
    assert!(round_trip(&check).passed());

    let mut report = rodfit::dynamics::SimulationReport::new(&problem);
    let mut run = Trajectory::new(&problem, &[12], &[]).unwrap();
    let outcome = run.run(&problem, 50, |state| report.push(&problem, state));
    report.finish(&run, &outcome);
    let back = round_trip(&report);
    // The start and 50 steps.
    assert_eq!((back.tip.len(), back.energy_in_words()), (51, report.energy_in_words()));
    let mut short = rodfit::dynamics::SimulationReport::new(&problem).without_series();
    let outcome = Trajectory::new(&problem, &[12], &[])
        .and_then(|mut run| run.run(&problem, 5, |state| short.push(&problem, state)));
    outcome.unwrap();
    assert_eq!(round_trip(&short).last_tip(), short.last_tip());

    let motion = displaced(record(&run, 20));
    let sighting =
        |i: usize| ShapePoint::new(Point::Node(i), rest.nodes[i].map(|x| Some(x + off(i))));
    let droop = RestShape::new([4, 8, 12].map(sighting).into()).sigma(1e-3).held_out();
    let report = Fit::of([Experiment::new("one", &problem).observe(motion).observe(droop)])
        .identify(Parameter::YoungsModulus)
        .analyse(rodfit::fit::Analysis { profile: true, ..Default::default() })
        .keep_plot_data()
        .solve()
        .unwrap();
    let back: FitReport = round_trip(&report);
    assert_eq!(back.to_string(), report.to_string());
    let plots = back.plot_data.as_ref();
    assert!(plots.is_some_and(|e| e.profiles.len() == 1) && back.predictions.len() == 1);

    scene.time = Some(Time::new(0.02, 4e-3));
    scene.loads.point = vec![PointForce { node: Point::Node(9), ..PointForce::default() }];
    let study = rodfit::study::Study::new(&scene, |_, _| {}).unwrap();
    assert_eq!(round_trip(&study).rows.len(), study.rows.len());
}

/// Infinite numbers, such as the misfit of a failed simulation in a scan, are `null` in JSON and infinite after reading.
#[test]
fn infinite_numbers_are_equal_after_reading_json() {
    let text = r#"{"name":"density","label":"density","values":[1.0,2.0],"misfit":[0.5,null]}"#;
    let landscape: rodfit::fit::Landscape = serde_json::from_str(text).unwrap();
    assert_eq!(landscape.misfit, [0.5, f64::INFINITY]);
    round_trip(&landscape);
    let mut errors = rodfit::check::Errors::default();
    errors.hessian = f64::INFINITY;
    round_trip(&errors);
}

/// Scenes and fits are read from text in memory, with their data in a folder.
#[test]
fn files_are_read_from_text() {
    let folder = tempfile::tempdir().unwrap();
    let scene = short().to_toml().unwrap();
    let mut read = Scene::from_toml(&scene, folder.path()).unwrap();
    assert_eq!(read.folder(), folder.path());
    read.path = None;
    assert_eq!(read, short());
    let error = Scene::from_toml(&scene.replace("segments", "segmnts"), "lab").unwrap_err();
    assert!(error.to_string().starts_with("line 2, column 1: unknown field"), "{error}");

    let data = record(&short().problem().unwrap().simulate().unwrap(), 25);
    write_scene_and_record(folder.path(), &short(), &data);
    let text = |name: &str| {
        format!(
            "scene = \"scene.toml\"\n[[observation]]\nfile = \"tip.csv\"\n\
             [[parameter]]\nname = \"{name}\"\nstart = 0.004\n"
        )
    };
    let error = FitFile::from_toml(&text("redius"), folder.path()).unwrap_err().to_string();
    assert!(error.starts_with("line 5, ") && error.contains("rod.section.radius"), "{error}");

    // Results go by the name that was written.
    for name in ["radius", "rod.section.radius"] {
        let fit = FitFile::from_toml(&text(name), folder.path()).unwrap().fit();
        let report = fit.keep_plot_data().solve().unwrap();
        let json = serde_json::to_value(&report).unwrap();
        assert_eq!(json["parameters"][0]["name"], name);
        assert_eq!(json["plot_data"]["ranges"][0]["name"], name);
        assert_eq!(json["plot_data"]["landscape"][0]["label"], name);
        assert!(report.to_string().contains(&format!("\n  {name} ")), "{report}");
        assert!(rodfit::page::fit_page(&report, "").contains(&format!(">{name}<")));
        let found = report.estimate(Parameter::Radius).unwrap().value.unwrap();
        // The radius of the scene with which the data are simulated.
        assert!((found / 0.005 - 1.0).abs() < 1e-6, "{report}");
        round_trip(&report);
    }
}

/// Lists have as many numbers as their keys, those within lists too.
#[test]
fn list_of_wrong_length_is_rejected() {
    let own = "[rod]\nshape = { kind = \"polyline\", points = POINTS }\n\
               section = { kind = \"circle\", radius = 0.004 }\nnatural_bending = PAIRS\n\
               [material]\ndensity = 1100\nyoungs_modulus = 1e7\npoisson_ratio = 0.4\n";
    let read = |points: &str, pairs: &str| {
        Scene::from_toml(&own.replace("POINTS", points).replace("PAIRS", pairs), "")
    };
    let (points, pairs) = ("[[0, 0, 0], [0.5, 0, 0.1], [1, 0, 0.2]]", "[[0.1, 0], [0.2, 0]]");
    // The numbers of the text.
    assert_eq!(read(points, pairs).unwrap().rod.natural_bending, [[0.1, 0.0], [0.2, 0.0]]);
    for (points, pairs, words) in [
        ("[[0, 0, 0], [0.5, 0, 0.1, 7], [1, 0, 0.2]]", pairs, "expected 3 numbers"),
        ("[[0, 0], [0.5, 0], [1, 0]]", pairs, "expected 3 numbers"),
        (points, "[[0.1, 0, 5], [0.2, 0, 6]]", "expected 2 numbers"),
        (points, "[[0.1], [0.2]]", "expected 2 numbers"),
    ] {
        let error = read(points, pairs).unwrap_err().to_string();
        assert!(error.contains(words), "{points} {pairs}: {error}");
    }
}

/// Tables of a fit file that are read separately are equal to those of the file, and rejected alike.
#[test]
fn tables_of_a_fit_file_are_read_separately() {
    let folder = tempfile::tempdir().unwrap();
    let problem = short().problem().unwrap();
    let data = record(&problem.simulate().unwrap(), 25);
    write_scene_and_record(folder.path(), &short(), &data);
    let observation = "[[observation]]\nfile = \"tip.csv\"\nsigma = 1e-3\n";
    let parameter = "[[parameter]]\nname = \"radius\"\nstart = 0.004\n";
    let known = "[[known]]\nname = \"density\"\nsigma = 1.0\n[analysis]\nwhat_if = false\n";
    let text = format!("scene = \"scene.toml\"\n{observation}{parameter}{known}");
    let whole = FitFile::from_toml(&text, folder.path()).unwrap().fit().solve().unwrap();
    let add = |fit: Fit, text: &str| fit.add_toml(text, folder.path());
    let parts = [observation, parameter, known].into_iter();
    let fit = parts.fold(Fit::new(&problem), |fit, text| add(fit, text).unwrap());
    let own = fit.solve().unwrap();
    assert_eq!((&own.parameters, &own.sigma), (&whole.parameters, &whole.sigma));
    assert!(!own.budget.is_empty());

    for (text, words) in [
        ("[[parameter]]\nname = \"redius\"\n", "Similar names"),
        ("[[parameter]]\nname = \"E\"\n", "Similar names: youngs_modulus"),
        ("[[parameter]]\nstart = 1.0\n", "missing key: parameter[0].name"),
        ("[[observation]]\nfile = \"none.csv\"\n", "none.csv"),
        ("[[observations]]\nfile = \"tip.csv\"\n", "unknown field"),
        ("[[parameter]]\nname = \"radius\"\nfixed = -1.0\n", "parameter[0].fixed"),
    ] {
        let error = add(Fit::new(&problem), text).err().unwrap().to_string();
        assert!(error.contains(words), "{text}: {error}");
    }
    // Measurements need an experiment that they belong to.
    let error = add(Fit::of([]), observation).err().unwrap().to_string();
    assert!(error.contains("measurements without one"), "{error}");
}

/// A search continues until the next step would be below its tolerance.
#[test]
fn search_ends_at_its_tolerance() {
    let problem = short().problem().unwrap();
    let motion = displaced(record(&problem.simulate().unwrap(), 20));
    let fit = Fit::new(&problem).observe(motion.sigma(1e-3)).identify(Parameter::YoungsModulus);
    let solved = |tolerance: f64| {
        let analysis = rodfit::fit::Analysis {
            tolerance,
            sensitivity_analysis: Some(false),
            discretization_error: rodfit::fit::Refinement::None,
            ..Default::default()
        };
        fit.clone().analyse(analysis).solve()
    };
    let residuals = fit.residuals().unwrap();
    // Remaining Gauss-Newton step, in standard errors.
    let left = |tolerance: f64| {
        let x = [solved(tolerance).unwrap().parameters[0].value.unwrap().ln()];
        let (rows, r) = (residuals.jacobian_at(&x).unwrap(), residuals.residuals(&x).unwrap());
        let slope: f64 = rows.iter().zip(&r).map(|(row, r)| row[0] * r).sum();
        let square: f64 = rows.iter().map(|row| row[0] * row[0]).sum();
        slope.abs() / square.sqrt()
    };
    let [early, late] = [1e-3, 1e-7].map(left);
    println!("left of a step: {early:e} and {late:e} standard errors");
    // The remaining step at the end is below the tolerance, in standard errors; a looser tolerance leaves more.
    assert!(late < 1e-6 && early > 10.0 * late && early < 1e-3);
    for tolerance in [-1e-3, 0.2, f64::NAN] {
        let error = solved(tolerance).unwrap_err().to_string();
        assert!(error.contains("analysis.tolerance"), "{error}");
    }
}

/// A shape from points in memory is saved with its points, and is the shape of a file of them.
#[test]
fn shape_through_points_is_saved_with_its_points() {
    let points = (0..=20).map(|i| {
        let s = f64::from(i) / 20.0;
        [0.4 * s, 0.1 * s * s, 0.0]
    });
    let mut scene = short();
    scene.rod.segments = None;
    scene.rod.shape = Shape::points(points.clone());
    let tip = |scene: &Scene| scene.problem().unwrap().equilibrium().unwrap().tip;
    let saved = scene.to_toml().unwrap();
    let back = Scene::from_toml(&saved, "nowhere").unwrap();
    assert_eq!((tip(&back), back.files().len()), (tip(&scene), 1), "{saved}");

    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("points.csv");
    let rows: String = points.map(|[x, y, z]| format!("{x},{y},{z}\n")).collect();
    std::fs::write(&file, format!("x,y,z\n{rows}")).unwrap();
    let mut from_file = scene.clone();
    from_file.rod.shape = Shape::polyline(&file);
    assert_eq!(tip(&from_file), tip(&scene));

    for (points, key) in [
        (vec![[0.0; 3], [1.0, f64::NAN, 0.0], [2.0; 3]], "rod.shape.points[1]"),
        (vec![[0.0; 3], [1.0; 3], [1.0; 3], [2.0; 3]], "rod.shape.points[2]"),
        (vec![[0.0; 3], [1.0; 3]], "rod.shape.points"),
        (vec![], "rod.shape.points"),
    ] {
        scene.rod.shape = Shape::points(points);
        let [found, ..] = refused(scene.problem());
        assert_eq!(found, key);
    }
}

/// All TOML blocks of the README and of the scene reference parse; their complete scenes are valid.
#[test]
fn files_in_the_documents_are_valid() {
    let blocks = |text: &str| -> Vec<String> {
        let parts = text.split("```toml\n").skip(1);
        parts.map(|part| part.split("```").next().unwrap().to_string()).collect()
    };
    let readme = blocks(include_str!("../../README.md"));
    let files = blocks(include_str!("../../docs/reference/scene.md"));
    for block in readme.iter().chain(&files) {
        block.parse::<toml::Table>().unwrap_or_else(|error| panic!("{error} in\n{block}"));
    }
    for scene in [&readme[0], &files[0]] {
        toml::from_str::<rodfit::Scene>(scene)
            .unwrap_or_else(|error| panic!("{error} in\n{scene}"));
    }
}

/// The file of a signal is one of the files of its scene, and is found where the scene is saved elsewhere.
#[test]
fn file_of_a_signal_belongs_to_its_scene() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("tap.csv");
    std::fs::write(&file, "t[s],value\n0,0\n5,1\n10,0\n").unwrap();
    let mut scene = short();
    let signal = Some("tap".to_string());
    let node = Point::Node(9);
    scene.loads.point = vec![PointForce { node, signal, ..PointForce::default() }];
    scene.signals = vec![Signal { file: "tap.csv".into(), ..Signal::new("tap") }];
    let mut read = Scene::from_toml(&scene.to_toml().unwrap(), folder.path()).unwrap();
    assert_eq!(read.files().last(), Some(&file));
    read.make_paths_absolute().unwrap();
    let elsewhere = tempfile::tempdir().unwrap();
    let saved = Scene::from_toml(&read.to_toml().unwrap(), elsewhere.path()).unwrap();
    assert_eq!(saved.signals[0].file, file);
}
