//! Scenes for the tests of user-defined energies.

use crate::own_energy::energies::{Foundation, Magnet};
use rodfit::Parameter;
use rodfit::energy::At;
use rodfit::scene::*;

pub const RADIUS: f64 = 2e-3;

/// A polymer rod under gravity (1200 kg/m^3, 20 MPa), simulated for 0.05 s in steps of 1 ms.
pub fn scene(shape: Shape, segments: usize) -> Scene {
    let material = Material { poisson_ratio: Some(0.4), ..Material::new(1200.0, 2e7) };
    let mut scene = Scene::new(segments, shape, Section::Circle { radius: RADIUS }, material);
    scene.loads.gravity = [0.0, -9.8, 0.0];
    scene.time = Some(Time::new(0.05, 1e-3));
    scene
}

/// A horizontal straight rod of 0.3 m.
pub fn straight(segments: usize) -> Scene {
    scene(Shape::Straight { length: 0.3, direction: [1.0, 0.0, 0.0] }, segments)
}

/// A left-handed helix of 0.3 m with downward axis.
pub fn helix(segments: usize) -> Scene {
    let axis = [0.0, 0.0, -1.0];
    let (radius, pitch, handedness) = (0.02, 0.05, Handedness::Left);
    let mut scene = scene(Shape::Helix { length: 0.3, radius, pitch, axis, handedness }, segments);
    scene.loads.gravity = [0.0, 0.0, -9.8];
    scene
}

/// Both rods with their names, and a magnetic field for each.
pub fn plane_and_space() -> [(&'static str, Scene, [f64; 3]); 2] {
    [("plane", straight(12), [0.0, 0.05, 0.0]), ("space", helix(14), [0.03, 0.05, 0.02])]
}

/// With a magnet at the end and springs along a part of the rod.
pub fn with_both(scene: Scene, by_hand: bool, field: [f64; 3]) -> Scene {
    scene.with_energy("magnet", At::End, Magnet { field, by_hand }, [2e-3]).with_energy(
        "springs",
        At::Interval(0.1, 0.22),
        Foundation { by_hand },
        [3.0, 3e4],
    )
}

/// The schemes of the tests: two implicit, one linearly implicit and two explicit.
pub fn schemes() -> [Scheme; 5] {
    use Scheme::*;
    [NewmarkBeta, AverageVectorField, Rodas4, Verlet, Pefrl]
}

/// The scene with this scheme and a step at which the scheme is stable.
pub fn in_scheme(mut scene: Scene, scheme: Scheme) -> Scene {
    let explicit = matches!(scheme, Scheme::Verlet | Scheme::Pefrl);
    let step = if explicit { 2e-5 } else { 1e-3 };
    scene.time = Some(Time { scheme, ..Time::new(0.05, step) });
    scene
}

pub fn named(name: &str) -> Parameter {
    name.parse().unwrap()
}
