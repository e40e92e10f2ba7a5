//! The work-precision study: its errors decrease with step and mesh, and its schemes and meshes suit the scene.

use rodfit::page::study_page;
use rodfit::scene::{
    Clamp, End, InitialState, Motion, Point, PointForce, Recorded, Scheme, Shape, Support, Track,
};
use rodfit::study::Study;

use crate::common::coarse;

#[test]
fn study_errors_fall_with_step_and_mesh() {
    let scene = coarse(12, 4e-3, 0.3);
    let mut last = 0;
    let study = Study::new(&scene, |done, total| {
        assert!(done == last + 1 && done <= total);
        last = done;
    })
    .unwrap();
    let error = |segments: usize, step: f64| {
        let row = study.rows.iter().find(|r| {
            (r.scheme, r.segments) == (Scheme::NewmarkBeta, segments)
                && (r.step - step).abs() < 1e-12
        });
        row.and_then(|r| r.error).unwrap()
    };
    // Refined in both, the error falls; and the parts add up to no less than the whole.
    assert!(error(48, 1e-3) < 0.3 * error(12, 4e-3));
    for row in &study.rows {
        // Large steps of some schemes may fail, and say so.
        let (Some(whole), Some(step)) = (row.error, row.step_error) else {
            assert!(row.status.starts_with("stopped: ") && row.step > 4e-3, "{row:?}");
            continue;
        };
        // Triangle inequality of the errors of step and mesh, up to rounding.
        assert!(whole <= 1.0001 * (step + row.mesh_error), "{row:?}");
        assert_eq!(row.status, "completed");
    }
    // All schemes take part, and one of high order beats those of second order in the step.
    for scheme in [Scheme::AverageVectorField, Scheme::Rodas4, Scheme::Verlet] {
        assert!(study.rows.iter().any(|row| row.scheme == scheme), "{scheme:?}");
    }
    let of = |scheme: Scheme| {
        let rows = study.rows.iter().filter(move |row| row.scheme == scheme && row.segments == 12);
        rows.filter_map(|row| Some((row.step, row.step_error?)))
            .find(|(step, _)| (step - 1e-3).abs() < 1e-12)
    };
    if let (Some((_, high)), Some((_, low))) = (of(Scheme::Rodas4), of(Scheme::NewmarkBeta)) {
        // At equal steps the scheme of fourth order is far more accurate than that of second order.
        assert!(high < 0.1 * low, "{high:e} {low:e}");
    }
    for advice in &study.advice {
        let good = study.rows.iter().filter(|r| r.error.is_some_and(|e| e <= advice.error));
        let cheapest = good.map(|r| r.wall_seconds).fold(f64::INFINITY, f64::min);
        match advice.row {
            Some(i) => assert_eq!(study.rows[i].wall_seconds, cheapest),
            None => assert_eq!(cheapest, f64::INFINITY),
        }
    }
    assert!(study.advice[1].row.is_some(), "{study}");
    let page = study_page(&study, "<scene>");
    assert!(
        page.contains("<svg")
            && page.contains("&lt;scene&gt;")
            && !page.contains("<script")
            && !page.contains("src=")
    );
    // In the style of the other page, light and dark, with a name for the drawing.
    assert!(page.contains("prefers-color-scheme:dark") && page.contains("viewport"));
    assert_eq!(page.matches("<svg").count(), page.matches("role=\"img\" aria-label=\"").count());
    assert!(page.contains("<th scope=\"col\">tip error / length</th>") && !page.contains("NaN"));
}

/// A force on a node by its index belongs to the scene's own mesh. The reference is none of the runs, so that its estimated
/// error is not zero.
#[test]
fn study_keeps_a_given_mesh() {
    let mut scene = coarse(12, 4e-3, 0.1);
    scene.loads.point =
        vec![PointForce { node: Point::Node(9), force: [0.0, 0.1, 0.0], ..PointForce::default() }];
    let study = Study::new(&scene, |_, _| {}).unwrap();
    assert!(study.rows.iter().all(|row| row.segments == 12 && row.mesh_error == 0.0));
    // The reference must be much more accurate than the runs.
    assert!(study.rows[0].error.unwrap() > 10.0 * study.reference_error, "{study}");
    assert!(study.reference_error > 0.0, "{study}");
}

/// All runs of a study, the reference included, use a scheme that supports the moving supports of the scene.
#[test]
fn study_of_moving_supports_uses_schemes_that_take_them() {
    let mut scene = coarse(6, 2e-3, 0.02);
    let displacement = [0.0, 0.01, 0.0];
    let motion =
        Motion { end: End::Start, displacement, frequency: Some(5.0), ..Motion::default() };
    scene.supports.motion.push(motion);
    let study = Study::new(&scene, |_, _| {}).unwrap();
    assert!(study.rows.iter().all(|row| row.scheme.traits().takes_boundary_motion));
    let error = study.rows.iter().filter_map(|row| row.error).fold(f64::INFINITY, f64::min);
    // Some run of the study is accurate, with schemes that take moving supports.
    assert!(error < 1e-3, "{error:e}");
}

/// Markers stand at the nodes of every mesh.
#[test]
fn study_of_recorded_ends_has_nodes_at_markers() {
    let times: Vec<f64> = (0..=10).map(|k| 0.01 * f64::from(k)).collect();
    let place = |j: usize, t: f64| [0.1 * j as f64, 0.05 * t, 0.0];
    let seen = |j: usize| (j.to_string(), times.iter().map(|t| Some(place(j, *t))).collect());
    let track = Track::new(times.clone(), (0..5).map(seen).collect()).unwrap();
    let mut scene = coarse(4, 5e-3, 0.1);
    scene.rod.shape = Shape::Straight { length: 0.4, direction: [1.0, 0.0, 0.0] };
    scene.supports.start = Support::Recorded;
    scene.supports.clamp = Clamp::Nodes;
    scene.supports.path = Some(Recorded::of(track));
    scene.initial.state = InitialState::Recorded;
    let study = Study::new(&scene, |_, _| {}).unwrap();
    assert!(study.rows.iter().all(|row| row.segments.is_multiple_of(4)));
    assert!(study.rows.iter().any(|row| row.segments == 16));
}
