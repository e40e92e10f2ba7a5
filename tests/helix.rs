//! The paper's helix: its figures, energy, and the work it takes.

use num_dual::Dual64;
use rodfit::banded::BandMatrix;
use rodfit::energy::Element;
use rodfit::energy::bend_twist::Published;
use rodfit::frame::Frames;
use rodfit::rod::{Energies, Rod, SpatialRod};
use rodfit::scene::Clamp;
use rodfit::simulation::Simulation;
use rodfit::{Derivatives, Problem};

mod common;
use common::{extremum, helix_with};

/// Extension of the tip over the axial length at every step.
fn extension(problem: &Problem) -> (Vec<f64>, Vec<f64>) {
    let run = problem.simulate().unwrap();
    let axial = 0.5 * 0.05 / (0.05_f64.powi(2) + (std::f64::consts::TAU * 0.02).powi(2)).sqrt();
    let start = run.tip(0)[2];
    let values = (0..run.times().len()).map(|k| (start - run.tip(k)[2]) / axial).collect();
    (run.times().to_vec(), values)
}

/// Independent values of the first maximum and minimum of the extension, walls at the nodes.
#[test]
fn the_helix_moves_as_published() {
    for (segments, beta, step, maximum, minimum) in [
        (50, 0.5, 1e-4, Some(0.127335), 0.012742),
        (50, 1.0, 1e-3, None, 0.018793),
        (50, 1.0, 5e-3, None, 0.035955),
        (100, 0.5, 1e-4, Some(0.135717), 0.012572),
    ] {
        let mut scene = helix_with(beta, step, 0.27, Clamp::Nodes);
        scene.rod.segments = Some(segments);
        let (times, values) = extension(&scene.problem().unwrap());
        let highest = extremum(&times, &values, [0.05, 0.16], 1.0);
        let lowest = extremum(&times, &values, [0.16, 0.26], -1.0);
        println!("{segments} segments, beta {beta}, {step} s: {highest:.6} {lowest:.6}");
        if let Some(maximum) = maximum {
            assert!((highest - maximum).abs() < 3e-6, "{highest}");
        }
        assert!((lowest - minimum).abs() < 3e-6, "{lowest}");
    }
}
