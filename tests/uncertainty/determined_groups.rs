//! Groups of parameters, such as modulus over density, that the data determine without a scale of forces.

use rodfit::fit::DeterminedGroup;
use rodfit::scene::{PointForce, Scene};
use rodfit::{FitReport, Parameter, Point};

use crate::common::coarse;
use crate::common::fits::{fit_with, noisy, observe, of_a_right_mesh, value};

const RADIUS: f64 = 0.005;

/// A fit of Young's modulus with this density in the scene, and of the data with that of 1273.52 kg/m^3.
fn solve(density: f64) -> FitReport {
    let truth = coarse(12, 4e-3, 0.8);
    let data = noisy(&observe(&truth, 80), 1e-3, 5);
    let mut scene = truth;
    scene.material.density = density;
    fit_with(&scene, &data, &[Parameter::YoungsModulus, Parameter::DampingMass], of_a_right_mesh())
}

/// The single determined group of a report.
fn only(report: &FitReport) -> &DeterminedGroup {
    assert_eq!(report.determined_groups.len(), 1, "{report}");
    &report.determined_groups[0]
}

/// A circle has `I/A = r^2/4`.
#[test]
fn group_is_modulus_over_density_times_a_quarter_of_the_squared_radius() {
    let report = solve(1273.52);
    println!("{report}");
    let group = only(&report);
    let e = report.estimate(Parameter::YoungsModulus).unwrap();
    let expected = e.value.unwrap() / 1273.52 * RADIUS * RADIUS / 4.0;
    // Definition of the group: E/density times r^2/4.
    assert!((group.value / expected - 1.0).abs() < 1e-12, "{group}");
    let relative = e.std_error.unwrap() / e.value.unwrap();
    assert!((group.relative_std_error / relative - 1.0).abs() < 1e-12, "{group}");
    assert_eq!((&group.name[..], &group.unit[..]), ("EI/(rho A)", "m^4/s^2"));
    assert!(report.to_string().contains("EI/(rho A) = 4.9"), "{report}");
}

/// The ratio of two parameters that are not identifiable by themselves equals the modulus over the given density, with its error.
#[test]
fn modulus_and_density_together_determine_their_ratio() {
    let (truth, unknowns) = (coarse(12, 4e-3, 0.8), [Parameter::YoungsModulus, Parameter::Density]);
    let data = noisy(&observe(&truth, 80), 1e-3, 5);
    let alone = fit_with(&truth, &data, &unknowns[..1], of_a_right_mesh());
    let e = &alone.parameters[0];
    let both = fit_with(&truth, &data, &unknowns, of_a_right_mesh());
    println!("{both}");
    assert!(both.parameters.iter().all(|e| !e.identifiable && e.value.is_none()));
    let group = only(&both);
    assert_eq!((&group.name[..], &group.unit[..]), ("youngs_modulus/density", "m^2/s^2"));
    let (value, error) = (e.value.unwrap(), e.std_error.unwrap());
    // The ratio of the first fit, to a hundredth of its standard error.
    assert!((group.value * 1273.52 / value - 1.0).abs() < 0.01 * error / value, "{group} {value}");
    // One degree of freedom of 160 less.
    assert!((group.relative_std_error * value / error - 1.0).abs() < 0.02, "{group} {error}");
    let ends = group.interval95.unwrap().map(|end| end * 1273.52);
    for (end, other) in ends.iter().zip(e.interval95.unwrap()) {
        assert!((end - other).abs() < 0.1 * error, "{ends:?} {:?}", e.interval95);
    }
    assert!(both.to_string().contains("combination  youngs_modulus/density = 7.85"), "{both}");
}

#[test]
fn group_stays_where_the_density_is_doubled() {
    let (one, two) = (solve(1273.52), solve(2.0 * 1273.52));
    let ratio = value(&two, Parameter::YoungsModulus) / value(&one, Parameter::YoungsModulus);
    // Motions without measured forces determine E/rho only: E doubles with rho, the group stays.
    assert!((ratio / 2.0 - 1.0).abs() < 1e-6, "{ratio}");
    let ratio = only(&two).value / only(&one).value;
    assert!((ratio - 1.0).abs() < 1e-6, "{ratio}");
}

/// A load of a known force has a scale of forces: the modulus alone is determined.
#[test]
fn data_with_a_known_force_determine_no_group() {
    let mut scene: Scene = coarse(12, 4e-3, 0.8);
    scene.loads.point =
        vec![PointForce { node: Point::Tip, force: [0.0, -0.2, 0.0], ..PointForce::default() }];
    let data = noisy(&observe(&scene, 80), 1e-3, 5);
    let report = fit_with(&scene, &data, &[Parameter::YoungsModulus], of_a_right_mesh());
    assert!(report.determined_groups.is_empty(), "{report}");
}
