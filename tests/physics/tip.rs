//! The tip of a rod is its end: with a clamp between two nodes that is not the last node.

use rodfit::dynamics::SimulationReport;
use rodfit::scene::{End, Motion, Point, Scene, Support, Time};
use rodfit::{Problem, Trajectory};

use crate::common::cantilever;

/// A rod of 0.5 m between two clamps, the end of which moves to (0.4, 0.1) m.
fn moved_end(segments: usize) -> Scene {
    let mut scene = cantilever();
    scene.rod.segments = Some(segments);
    scene.supports.end = Support::Clamped;
    let displacement = [-0.1, 0.1, 0.0];
    scene.supports.motion =
        vec![Motion { end: End::End, displacement, ramp: Some(0.05), ..Motion::default() }];
    scene.loads.damping.mass = 3.0;
    scene.time = Some(Time::new(0.1, 1e-3));
    scene
}

/// Requires the tip at the prescribed position of the end, (0.4, 0.1, 0) m.
fn assert_at_end(tip: [f64; 3], case: &str) {
    for (found, exact) in tip.into_iter().zip([0.4, 0.1, 0.0]) {
        // The prescribed position of the end, (0.4, 0.1) m.
        assert!((found - exact).abs() < 1e-12, "{case}: {tip:?}");
    }
}

#[test]
fn tip_of_a_clamped_end_is_the_end_on_every_mesh() {
    for segments in [6, 10, 20, 100] {
        let problem: Problem = moved_end(segments).problem().unwrap();
        let mut report = SimulationReport::new(&problem);
        let all: Vec<usize> = (0..problem.nodes()).collect();
        let mut run = Trajectory::new(&problem, &all, &[]).unwrap();
        run.run(&problem, 100, |now| report.push(&problem, now)).unwrap();
        let [_, x, y, z] = report.last_tip().unwrap();
        // The place that the motion of the support prescribes at t = 0.1 s.
        assert_at_end([x, y, z], "report");
        assert_at_end(run.tip(100), "trajectory");
        assert_at_end(run.at(Point::Tip, 0.1).unwrap().0, "point");
        assert_at_end(run.at(Point::ArcLength(0.5), 0.1).unwrap().0, "arc length");
        assert_at_end(problem.equilibrium().unwrap().tip, "equilibrium");
        let walls = run.at(Point::ArcLength(0.0), 0.1).unwrap().0;
        // The first wall is at the origin.
        assert!(walls.iter().all(|x| x.abs() < 1e-12), "{walls:?}");
    }
}

/// A free end is the last node.
#[test]
fn tip_of_a_free_end_is_the_last_node() {
    let problem = cantilever().problem().unwrap();
    assert_eq!(problem.stencil(Point::Tip).unwrap().nodes, [(problem.segments(), 1.0)]);
}
