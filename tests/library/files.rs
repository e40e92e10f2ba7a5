//! Reports and the documents' files can be read.

use rodfit::fit::{Experiment, FitReport, RestShape, Sighting};
use rodfit::scene::{PointForce, Time};
use rodfit::{Fit, Parameter, Point, Trajectory};

use crate::calls::short;
use crate::common::fits::record;

/// The same but for the last digit, which JSON may cost.
fn same(a: &serde_json::Value, b: &serde_json::Value) -> bool {
    use serde_json::Value::{Array, Number, Object};
    match (a, b) {
        (Number(a), Number(b)) => {
            let [a, b] = [a, b].map(|x| x.as_f64().unwrap());
            (a - b).abs() <= 1e-15 * a.abs()
        }
        (Array(a), Array(b)) => a.len() == b.len() && a.iter().zip(b).all(|(a, b)| same(a, b)),
        (Object(a), Object(b)) => {
            a.len() == b.len() && a.iter().all(|(key, a)| b.get(key).is_some_and(|b| same(a, b)))
        }
        (a, b) => a == b,
    }
}

/// What is written is read again as what it was.
fn round_trip<T: serde::Serialize + serde::de::DeserializeOwned>(report: &T) -> T {
    let json = serde_json::to_string(report).unwrap();
    let back: T = serde_json::from_str(&json).unwrap();
    let [a, b] = [report, &back].map(|r| serde_json::to_value(r).unwrap());
    assert!(same(&a, &b), "{json}");
    back
}

#[test]
fn reports_are_read_back() {
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
    assert_eq!(round_trip(&report).tip.len(), 51);

    let off = |k: usize| 1e-3 * (k as f64 * 2.4).sin();
    let mut motion = record(&run, 20);
    motion.samples.iter_mut().enumerate().for_each(|(k, s)| {
        s.position = s.position.map(|x| x.map(|x| x + off(k)));
    });
    let sighting = |i: usize| Sighting {
        point: Point::Node(i),
        position: rest.nodes[i].map(|x| Some(x + off(i))),
    };
    let droop = RestShape::new([4, 8, 12].map(sighting).into()).sigma(1e-3).held_out();
    let report = Fit::of([Experiment::new("one", &problem).observe(motion).observe(droop)])
        .identify(Parameter::YoungsModulus)
        .analyse(rodfit::fit::Analysis { profile: true, ..Default::default() })
        .keep_plot_data()
        .solve()
        .unwrap();
    let back: FitReport = round_trip(&report);
    assert_eq!(back.to_string(), report.to_string());
    assert!(back.plot_data.is_some_and(|e| e.profiles.len() == 1) && back.predictions.len() == 1);

    scene.time = Some(Time::new(0.02, 4e-3));
    scene.loads.point = vec![PointForce { node: Point::Node(9), ..PointForce::default() }];
    let study = rodfit::study::Study::new(&scene, |_, _| {}).unwrap();
    assert_eq!(round_trip(&study).rows.len(), study.rows.len());
}

/// What the documents show of files can be read: their scenes are scenes.
#[test]
fn the_documents_files_can_be_read() {
    let blocks = |text: &str| -> Vec<String> {
        let parts = text.split("```toml\n").skip(1);
        parts.map(|part| part.split("```").next().unwrap().to_string()).collect()
    };
    let readme = blocks(include_str!("../../README.md"));
    let files = blocks(include_str!("../../docs/files.md"));
    for block in readme.iter().chain(&files) {
        block.parse::<toml::Table>().unwrap_or_else(|error| panic!("{error} in\n{block}"));
    }
    for scene in [&readme[0], &files[0]] {
        toml::from_str::<rodfit::Scene>(scene)
            .unwrap_or_else(|error| panic!("{error} in\n{scene}"));
    }
}
