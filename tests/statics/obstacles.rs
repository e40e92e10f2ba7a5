//! Equilibria on round obstacles: the side that a rod reaches without passing through the obstacle, against damped motions.

use rodfit::scene::{Contact, Material, Scene, Scheme, Section, Shape, Time};

use crate::common::{distance, rest, simulate};

/// Radius of the rod, m.
const RADIUS: f64 = 0.005;
/// Step and duration of the damped motions, s. Vibrations decay with 5/s.
const STEP: f64 = 1e-3;
const STEPS: usize = 1500;

/// A peg across the plane below a rod.
#[derive(Clone, Copy, Debug)]
struct Peg {
    /// Distance from the clamp, m.
    place: f64,
    /// Radius, m.
    radius: f64,
    /// Distance from the surface of the undeformed rod, m.
    gap: f64,
}

/// A cantilever of 0.5 m above a peg, with weight and damping.
fn cantilever_above(peg: Peg, modulus: f64) -> Scene {
    let shape = Shape::Straight { length: 0.5, direction: [1.0, 0.0, 0.0] };
    let material = Material::new(1000.0, modulus);
    let mut scene = Scene::new(40, shape, Section::Circle { radius: RADIUS }, material);
    scene.loads.gravity = [0.0, -9.81, 0.0];
    scene.loads.damping.mass = 10.0;
    let point = [peg.place, -RADIUS - peg.gap - peg.radius, 0.0];
    scene.contacts = vec![Contact::cylinder(point, [0.0, 0.0, 1.0], peg.radius).damping(5.0)];
    let end = STEP * STEPS as f64;
    scene.time = Some(Time { scheme: Scheme::GeneralisedAlpha, ..Time::new(end, STEP) });
    scene
}

/// A cantilever above a peg comes to rest on it: the tip of the equilibrium is that at the end of a damped motion. Steps of the
/// descent are larger than the pegs, and end below them unless they are rejected.
#[test]
fn equilibrium_above_a_peg_is_the_end_of_a_damped_motion() {
    let peg = |place, radius, gap| Peg { place, radius, gap };
    for (peg, modulus) in [
        (peg(0.2, 0.01, 1e-4), 1e8),
        (peg(0.2, 0.001, 1e-4), 1e8),
        (peg(0.4, 0.002, 0.01), 1e8),
        (peg(0.4, 0.001, 1e-4), 1e9),
    ] {
        let scene = cantilever_above(peg, modulus);
        let (found, moved) = (rest(&scene), simulate(&scene).tip(STEPS));
        let difference = distance(found.tip, moved);
        println!(
            "{peg:?}, {modulus:e} Pa: tip {:?}, of the motion {moved:?}, {} iterations",
            found.tip, found.newton_iterations
        );
        assert!(difference < 1e-4, "{peg:?}: {difference:e}");
    }
}

/// The tip above a peg of 20 mm diameter at rest, as that of the damped motion after 3 s.
#[test]
fn equilibrium_on_a_thick_peg_has_the_known_tip() {
    let scene = cantilever_above(Peg { place: 0.2, radius: 0.01, gap: 1e-4 }, 1e8);
    let found = rest(&scene);
    let difference = distance(found.tip, [0.498_769, -0.026_723, 0.0]);
    assert!(difference < 1e-4, "{:?}", found.tip);
    assert!(found.warnings.is_empty(), "{:?}", found.warnings);
}

/// The same in space, where the peg is a cylinder or a capsule.
#[test]
fn equilibrium_on_a_peg_is_the_same_in_space() {
    let mut scene = cantilever_above(Peg { place: 0.2, radius: 0.01, gap: 1e-4 }, 1e8);
    scene.material.poisson_ratio = Some(0.3);
    scene.rod.dimension = rodfit::scene::Dimension::Spatial;
    let center = [0.2, -RADIUS - 1e-4 - 0.01, 0.0];
    let cylinder = scene.contacts[0].clone();
    let ends = [-0.02, 0.02].map(|z| [center[0], center[1], z]);
    let capsule = Contact::capsule(ends, 0.01);
    for contact in [cylinder, capsule] {
        scene.contacts = vec![contact];
        let found = rest(&scene);
        let difference = distance(found.tip, [0.498_769, -0.026_723, 0.0]);
        println!("{:?}, {} iterations", found.tip, found.newton_iterations);
        assert!(difference < 1e-4, "{:?}", found.tip);
    }
}
