//! A strip that is dragged over a floor, whose motion determines modulus and friction coefficient.

use rodfit::Scene;
use rodfit::scene::{Contact, End, InitialState, Material, Motion, Scheme, Section, Shape, Time};

/// Young's modulus, Pa.
pub const MODULUS: f64 = 1e8;
/// Friction coefficient.
pub const FRICTION: f64 = 0.3;

/// A sloping strip that its clamp presses onto a floor by 40 mm, and moves by 30 mm to either side.
pub fn dragged_strip() -> Scene {
    let shape = Shape::Straight { length: 0.3, direction: [0.6, -0.8, 0.0] };
    let section = Section::Circle { radius: 2e-3 };
    let mut scene = Scene::new(10, shape, section, Material::new(1200.0, MODULUS));
    scene.loads.gravity = [0.0, -9.81, 0.0];
    scene.loads.damping.stiffness = 5e-3;
    let motion = |displacement, frequency| Motion {
        end: End::Start,
        displacement,
        frequency,
        ..Motion::default()
    };
    scene.supports.motion =
        vec![motion([0.0, -0.04, 0.0], None), motion([0.03, 0.0, 0.0], Some(2.0))];
    let floor = Contact::plane([0.0, -0.245, 0.0], [0.0, 1.0, 0.0]).stiffness(1e7);
    scene.contacts = vec![floor.friction(FRICTION).slip_velocity(0.01)];
    scene.initial.state = InitialState::Equilibrium;
    let scheme = Scheme::GeneralisedAlpha;
    scene.time = Some(Time { scheme, ..Time::new(0.5, 5e-3) });
    scene
}
