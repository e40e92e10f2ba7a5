//! Reactions of a clamp between two nodes: all loads and masses of the rod count, also those next to the wall.

use rodfit::scene::{Drag, LineForce, PointForce, PointMass, Scene, StretchLaw};
use rodfit::{Point, Reaction};

use crate::common::{at_tip, cantilever, rest};

/// Stiff cantilever of ten edges, in which half an edge is a twentieth of the length.
fn coarse() -> Scene {
    let mut scene = cantilever();
    scene.rod.segments = Some(10);
    scene.material.youngs_modulus = 1e13;
    scene
}

/// Mass of the rod, kg.
fn mass(scene: &Scene) -> f64 {
    0.5 * scene.material.density * scene.rod.section.moments().area
}

/// Force, N, upward and moment, N m, of the clamp of a scene.
fn reaction(scene: &Scene) -> [f64; 2] {
    let Reaction { force: [_, up, _], moment: [.., about] } = rest(scene).reactions.start;
    [up, about]
}

/// Compares force and moment with those of a `weight`, N, that is even along the rod. Masses of ten edges are lumped, with a
/// moment that is larger by a quarter of a per cent.
fn compare(scene: &Scene, weight: f64) {
    let [force, moment] = reaction(scene);
    assert!((force / weight - 1.0).abs() < 1e-6, "{force} {weight}");
    assert!((moment / (0.25 * weight) - 1.0).abs() < 5e-3, "{moment} {weight}");
}

/// A line load as heavy as the rod has the reaction of its weight.
#[test]
fn reaction_to_a_line_load_is_that_to_the_weight() {
    let mut scene = coarse();
    let weight = 9.8 * mass(&scene);
    compare(&scene, weight);
    scene.loads.gravity = [0.0; 3];
    let load = LineForce { force: [0.0, -2.0 * weight, 0.0], ..LineForce::default() };
    scene.loads.line = vec![load];
    compare(&scene, weight);
}

/// A force and a mass within half an edge of the wall are carried in full, with their moment about the wall.
#[test]
fn reaction_includes_loads_next_to_the_wall() {
    let at = Point::ArcLength(0.01);
    let mut scene = coarse();
    let alone = reaction(&scene);
    let added = |scene: &Scene, force: f64| {
        let with = reaction(scene);
        assert!(((with[0] - alone[0]) / force - 1.0).abs() < 1e-6, "{with:?} {alone:?}");
        assert!(((with[1] - alone[1]) / (0.01 * force) - 1.0).abs() < 1e-6, "{with:?} {alone:?}");
    };
    scene.loads.point =
        vec![PointForce { node: at, force: [0.0, -3.0, 0.0], ..PointForce::default() }];
    added(&scene, 3.0);
    scene.loads.point.clear();
    scene.rod.mass = vec![PointMass::new(at, 0.2)];
    added(&scene, 9.8 * 0.2);
}

/// In a fluid the clamp carries the weight less the buoyancy, and no added mass.
#[test]
fn reaction_in_a_fluid_is_the_weight_less_the_buoyancy() {
    let mut scene = coarse();
    let volume = 0.5 * scene.rod.section.moments().area;
    let weight = 9.8 * (mass(&scene) - 1000.0 * volume);
    scene.loads.drag = Some(Drag { fluid_density: 1000.0, added_mass: 0.05, ..Drag::default() });
    compare(&scene, weight);
}

/// A neo-Hookean bar under `EA/3 (s - 1/s^2)` has the stretch `s` up to its wall in the middle of an edge.
#[test]
fn neo_hookean_bar_is_stretched_evenly_up_to_the_wall() {
    for law in [StretchLaw::NeoHookean, StretchLaw::MooneyRivlin] {
        let mut scene = cantilever();
        scene.rod.segments = Some(10);
        scene.loads.gravity = [0.0; 3];
        scene.material.stretch_law = law;
        let second = 0.4;
        scene.material.mooney_rivlin_ratio = (law == StretchLaw::MooneyRivlin).then_some(second);
        let stiffness = scene.material.youngs_modulus * scene.rod.section.moments().area;
        let stretch: f64 = 1.5;
        let share = scene.material.mooney_rivlin_ratio.unwrap_or(0.0);
        let moduli = 1.0 - share + share / stretch;
        let force = stiffness / 3.0 * moduli * (stretch - stretch.powi(-2));
        scene.loads.point = at_tip([force, 0.0, 0.0]);
        let tip = rest(&scene).tip[0];
        assert!((tip / (0.5 * stretch) - 1.0).abs() < 1e-9, "{law:?}: {tip}");
    }
}
