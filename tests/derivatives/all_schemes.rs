//! Checks of derivatives of motions and equilibria, for scenes in the plane and in space with any scheme.

use rodfit::scene::{Scene, Scheme};
use rodfit::{Parameter, Point, Problem};

use crate::common::differences::{at_rest, difference};
use crate::recorded::check;

/// Compares derivatives of motions by at least eight parameters with runs in dual numbers and differences: of `scene(planar,
/// scheme, timed)` in the plane and in space, with every scheme, and with a signal where the scheme takes one.
pub fn check_motions(scene: impl Fn(bool, Scheme, bool) -> Scene) {
    for timed in [false, true] {
        for scheme in Scheme::all() {
            if timed && !scheme.traits().takes_timed_actuation {
                continue;
            }
            for planar in [true, false] {
                let problem = scene(planar, scheme, timed).problem().unwrap();
                println!("{scheme:?}, planar: {planar}, timed: {timed}");
                assert_eq!(problem.planar().is_some(), planar, "{:?}", problem.model());
                assert!(check(&problem, true) >= 8);
            }
        }
    }
}

/// Compares derivatives of equilibria by the parameters `own` with differences, of `scene` in the plane and in space.
pub fn check_equilibria(
    scene: impl Fn(bool, Scheme, bool) -> Scene,
    own: impl Fn(&Problem) -> Vec<Parameter>,
) {
    for planar in [true, false] {
        let mut scene = scene(planar, Scheme::NewmarkBeta, false);
        scene.time = None;
        let problem = scene.problem().unwrap();
        let own = own(&problem);
        assert!(own.len() >= if planar { 10 } else { 14 }, "{own:?}");
        let run = at_rest(&problem, &own);
        for (k, parameter) in own.iter().enumerate() {
            let positions = |problem: &Problem| {
                let run = at_rest(problem, &[]);
                (0..problem.nodes()).flat_map(|i| run.node(i, 0)).collect::<Vec<f64>>()
            };
            let value = parameter.of(problem.scene()).unwrap();
            let h = 1e-3 * if value == 0.0 { 1e-3 } else { value.abs() };
            let numbers = difference(&problem, *parameter, h, positions);
            let exact: Vec<f64> = (0..problem.nodes())
                .flat_map(|i| run.at(Point::Node(i), 0.0).unwrap().1[k])
                .collect();
            let size = exact.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
            let off =
                exact.iter().zip(&numbers).fold(0.0, |most: f64, (a, b)| most.max((a - b).abs()));
            println!("{parameter}: {size:.1e}, differences {:.1e}", off / size);
            assert!(off < 1e-6 * size || size < 1e-9, "{parameter}: {off:e} {size:e}");
        }
    }
}
