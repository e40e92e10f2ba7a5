//! Modulus and friction coefficient of a strip that a clamp drags to and fro over a floor, from positions of two markers.

use rodfit::fit::Analysis;
use rodfit::scene::*;
use rodfit::{Fit, FitReport, Observation, Parameter, Point, Trajectory, Unknown};

#[path = "../../examples/coverage/strip.rs"]
mod strip;
use strip::{FRICTION, MODULUS, dragged_strip};

use crate::common::fits::{covers, error, noisy, record, same_mesh};
use crate::common::simulate;

/// Noise of the markers, m.
const SIGMA: f64 = 5e-4;

fn friction() -> Parameter {
    "contacts.0.friction".parse().unwrap()
}

/// The records of the tip and of a marker halfway.
fn markers(run: &Trajectory) -> [Observation; 2] {
    let tip = record(run, 40);
    let mut middle = tip.clone().at(Point::Node(5));
    for sample in &mut middle.samples {
        let [x, y, _] = run.at(Point::Node(5), sample.time).unwrap().0;
        sample.position = [Some(x), Some(y), None];
    }
    [tip, middle]
}

fn fit(scene: &Scene, data: [Observation; 2], analysis: Analysis) -> FitReport {
    let known = |parameter, truth: f64| {
        Unknown::new(parameter).start(1.2 * truth).bounds(0.5 * truth, 2.0 * truth)
    };
    let fit = Fit::new(&scene.problem().unwrap()).analyse(analysis);
    let fit = data.into_iter().fold(fit, |fit, data| fit.observe(data));
    let fit = fit.identify(known(Parameter::YoungsModulus, MODULUS));
    fit.identify(known(friction(), FRICTION)).solve().unwrap()
}

#[test]
fn modulus_and_friction_of_a_dragged_strip_are_identified_from_exact_markers() {
    let scene = dragged_strip();
    let run = simulate(&scene);
    let report = fit(&scene, markers(&run), same_mesh());
    println!("{report}");
    for (parameter, truth) in [(Parameter::YoungsModulus, MODULUS), (friction(), FRICTION)] {
        let error = error(&report, parameter, truth);
        println!("{parameter}: off by {error:.1e}");
        assert!(error < 1e-6, "{parameter}: {error:e}");
    }
}

/// Intervals of 95 % of 20 data sets: fewer than 16 that cover have a probability of 3e-3. `cargo run --release --example
/// coverage -- 100 strip` has more of them.
#[test]
fn intervals_of_a_dragged_strip_cover_the_truth() {
    let scene = dragged_strip();
    let clean = markers(&simulate(&scene));
    let (mut covering, mut size) = ([0; 2], [0.0; 2]);
    for seed in 0..20 {
        let data = [0, 1].map(|i| noisy(&clean[i], SIGMA, 2 * seed + i as u64));
        let report = fit(&scene, data, same_mesh());
        assert!(report.is_success(), "{report}");
        for (i, (parameter, truth)) in
            [(Parameter::YoungsModulus, MODULUS), (friction(), FRICTION)].into_iter().enumerate()
        {
            covering[i] += usize::from(covers(&report, parameter, truth));
            size[i] = report.parameters[i].std_error.unwrap() / truth;
        }
    }
    println!("covered of 20: {covering:?}; relative standard errors {size:?}");
    assert!(covering.iter().all(|count| *count >= 16), "{covering:?}");
}
