//! Rods with point masses and tapered rods: both are identified together with the modulus; a scene without the mass gives a
//! wrong modulus.

use rodfit::scene::{Along, Dimension, PointMass};
use rodfit::{Parameter, Point};

use crate::common::coarse;
use crate::common::fits::{fit_with, found, observe, same_mesh, value};

/// A marker of 1 g on a rod of 50 g. A scene with the marker gives the right modulus. Without it the modulus is too small by
/// the inertia that the marker adds to the first mode and by its sag, 5 to 8 %.
#[test]
fn marker_mass_is_identified() {
    for dimension in [Dimension::Planar, Dimension::Spatial] {
        let mut scene = coarse(20, 2e-3, 0.4);
        scene.rod.dimension = dimension;
        scene.material.poisson_ratio = Some(0.5);
        scene.rod.mass = vec![PointMass::new(Point::Tip, 1e-3)];
        let data = observe(&scene, 200);
        let report = fit_with(&scene, &data, &[Parameter::YoungsModulus], same_mesh());
        // Exact data: the search stops within its tolerance.
        found(&report, &[(Parameter::YoungsModulus, 1e8)], 1e-7);
        scene.rod.mass.clear();
        let report = fit_with(&scene, &data, &[Parameter::YoungsModulus], same_mesh());
        let softer = 1.0 - value(&report, Parameter::YoungsModulus) / 1e8;
        println!("{dimension:?}: without the marker {:.1} % softer", 100.0 * softer);
        // 5 to 8 %, as derived above: the inertia of the marker in the first mode, and its sag.
        assert!((0.04..0.09).contains(&softer), "{softer}\n{report}");
    }
}

/// Mass and position of a point mass are identified together with the modulus.
#[test]
fn mass_and_its_position_are_identified() {
    let mut scene = coarse(20, 2e-3, 0.4);
    let at = |s: f64, mass: f64| vec![PointMass::new(Point::ArcLength(s), mass)];
    scene.rod.mass = at(0.33, 4e-3);
    let data = observe(&scene, 200);
    scene.rod.mass = at(0.36, 2e-3);
    let [mass, place]: [Parameter; 2] =
        ["rod.mass.0.mass", "rod.mass.0.node.arc_length"].map(|name| name.parse().unwrap());
    let report = fit_with(&scene, &data, &[Parameter::YoungsModulus, mass, place], same_mesh());
    let truths = [(Parameter::YoungsModulus, 1e8), (mass, 4e-3), (place, 0.33)];
    // The values with which the data are simulated, without noise.
    found(&report, &truths, 1e-6);
}

/// The ratio of the radii at both ends is identified together with the modulus, and so is each part of it.
#[test]
fn taper_is_identified() {
    let mut scene = coarse(20, 2e-3, 0.4);
    let [to, second]: [Parameter; 2] =
        ["rod.taper.radius.to", "rod.taper.youngs_modulus.1"].map(|name| name.parse().unwrap());
    scene.rod.taper.radius = Some(Along::linear(1.0, 0.7));
    let data = observe(&scene, 200);
    scene.rod.taper.radius = Some(Along::linear(1.0, 1.0));
    let report = fit_with(&scene, &data, &[Parameter::YoungsModulus, to], same_mesh());
    // The taper of the simulated rod.
    found(&report, &[(Parameter::YoungsModulus, 1e8), (to, 0.7)], 1e-6);

    scene.rod.taper = Default::default();
    scene.rod.taper.youngs_modulus = Some(vec![1.0, 0.6].into());
    let data = observe(&scene, 200);
    scene.rod.taper.youngs_modulus = Some(vec![1.0, 1.0].into());
    let report = fit_with(&scene, &data, &[Parameter::YoungsModulus, second], same_mesh());
    // The factor of the simulated rod's second half.
    found(&report, &[(Parameter::YoungsModulus, 1e8), (second, 0.6)], 1e-6);
}
