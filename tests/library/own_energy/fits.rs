//! Identification of parameters of user-defined energies, and their discretization error.

use crate::common::fits::record_in_space;
use crate::common::simulate;
use crate::own_energy::energies::{Foundation, Magnet};
use crate::own_energy::scenes::{named, plane_and_space, straight};
use rodfit::energy::At;
use rodfit::fit::{Analysis, Refinement};
use rodfit::scene::Time;
use rodfit::{Fit, Parameter, Unknown};

#[test]
fn magnetic_moment_is_identified() {
    for (name, scene, field) in plane_and_space() {
        for beside in [None, Some(Parameter::YoungsModulus)] {
            let magnet = Magnet { field, by_hand: false };
            let mut scene = scene.clone();
            scene.time = Some(Time::new(0.2, 1e-3));
            let scene = scene.with_energy("magnet", At::End, magnet, [2e-3]);
            let moment = named("energy.magnet.moment");
            let data = record_in_space(&simulate(&scene), 25);
            let problem = scene.problem().unwrap().with([(moment, 5e-4)]).unwrap();
            let fit = Fit::new(&problem).observe(data).identify(moment);
            let fit = match beside {
                Some(other) => fit.identify(Unknown::new(other).start(4e7)),
                None => fit,
            };
            let report = fit.solve().unwrap();
            // The values with which the data were simulated, without noise.
            for (parameter, truth) in [(moment, 2e-3), (Parameter::YoungsModulus, 2e7)] {
                let Some(estimate) = report.estimate(parameter) else { continue };
                let error = estimate.value.unwrap() / truth - 1.0;
                println!("{name}, {parameter}: {error:.1e}");
                // Exact data: within the tolerance of the search.
                assert!(error.abs() < 1e-7, "{name}: {report}");
            }
            assert!(report.is_success(), "{report}");
        }
    }
}

/// Refined meshes keep the interval of the springs; the estimated error of the mesh agrees with the true one.
#[test]
fn discretization_error_of_user_defined_energy_is_estimated() {
    let springs = |segments: usize| {
        let mut scene = straight(segments);
        scene.time = Some(Time::new(0.1, 1e-3));
        let springs = Foundation { by_hand: true };
        scene.with_energy("springs", At::Interval(0.1, 0.27), springs, [20.0, 0.0])
    };
    let data = record_in_space(&simulate(&springs(64)), 25).sigma(1e-4);
    let k = named("energy.springs.k");
    let analysis = Analysis { discretization_error: Refinement::Refitted, ..Analysis::default() };
    let report = Fit::new(&springs(16).problem().unwrap())
        .observe(data)
        .identify(k)
        .analyse(analysis)
        .solve()
        .unwrap();
    let error = report.discretization_error[0].clone();
    let value = report.estimate(k).unwrap().value.unwrap();
    println!("{value} {error:?}");
    let (relative, off) = (error.mesh.unwrap(), (value / 20.0 - 1.0).abs());
    // The data are simulated with 20 N/m^2; the estimated error is right to within a factor of two.
    assert!(off < 2.0 * relative && relative < 0.2, "{value} {error:?}");
}
