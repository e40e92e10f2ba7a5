//! Rods whose small motions tell what mesh and step their motions need.
//!
//! Of a rod that one clamp holds and constant loads bend by a part of its length the linear motion is off by what the motion itself
//! is off by: both are let go by the same forces, and what is lost is lost in the higher modes, which are small. A step of it takes
//! a solve instead of Newton's iterations.

use crate::problem::Problem;
use crate::scene::{Compliance, Damping, InitialState, Scene, Scheme, Support};

/// How far loads may bend a rod, over its length, as if they were across it all.
const MOST_BENT: f64 = 0.5;

/// How far, over its length, loads may bend a rod whose small motions tell; none of others.
pub(super) fn little_bent(scene: &Scene, guess: &Problem) -> Option<f64> {
    let Scene { rod, supports, loads, initial, .. } = scene;
    let Damping { bending, twisting, stretching, maxwell, friction, .. } = &loads.damping;
    let one_clamp = matches!(
        (supports.start, supports.end),
        (Support::Clamped, Support::Free) | (Support::Free, Support::Clamped)
    );
    let rigid = [&supports.start_compliance, &supports.end_compliance]
        .into_iter()
        .all(|gives| *gives == Compliance::default());
    let still = supports.motion.is_empty() && supports.path.is_none() && !initial.moves();
    let starts = matches!(initial.state, InitialState::Rest | InitialState::Equilibrium);
    let linear = [bending, twisting, stretching].iter().all(|time| **time == 0.0)
        && maxwell.is_none()
        && friction.is_none()
        && loads.drag.is_none()
        && scene.energies.is_empty();
    let open = scene.left_open();
    let open = open.segments && open.step && guess.scene().scheme() == Scheme::GeneralisedAlpha;
    (open && one_clamp && rigid && still && starts && linear && rod.is_unstressed())
        .then(|| bent(scene, guess))
        .filter(|bent| *bent <= MOST_BENT)
}

/// How far the loads would bend the rod, were it straight and they across it, over its length.
fn bent(scene: &Scene, guess: &Problem) -> f64 {
    let size = |v: &[f64; 3]| v.iter().map(|c| c * c).sum::<f64>().sqrt();
    let (section, material) = scene.at(0.5);
    let (moments, length) = (section.moments(), guess.length());
    let gravity = size(&scene.loads.gravity);
    let weight = material.density * moments.area * length * gravity;
    let bobs = scene.rod.mass.iter().map(|bob| bob.mass * gravity).sum::<f64>();
    let points = scene.loads.point.iter().chain(&scene.initial.point);
    let [forces, turning] = points.fold([0.0; 2], |[forces, turning], point| {
        [forces + size(&point.force), turning + size(&point.moment)]
    });
    // Of a tapered rod its ends too.
    let stiffness = |place: f64| {
        let (section, material) = scene.at(place);
        let [i1, i2] = section.moments().second_moments;
        material.youngs_modulus * i1.min(i2)
    };
    let softest = [0.0, 0.5, 1.0].into_iter().map(stiffness).fold(f64::INFINITY, f64::min);
    let stiffness = softest / (length * length);
    (weight / 8.0 + (bobs + forces) / 3.0 + turning / (2.0 * length)) / stiffness
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Material, Point, PointForce, Section, Shape, Time};

    fn bent_of(change: impl Fn(&mut Scene)) -> Option<f64> {
        let shape = Shape::Straight { length: 0.5, direction: [1.0, 0.0, 0.0] };
        let section = Section::Circle { radius: 0.005 };
        let mut scene = Scene::new(8, shape, section, Material::new(1273.52, 1e8));
        scene.rod.segments = None;
        scene.loads.gravity = [0.0, -9.8, 0.0];
        scene.time = Some(Time::lasting(1.0));
        change(&mut scene);
        let guess = scene.resolved(8, 1e-2).posed().unwrap();
        little_bent(&scene, &guess)
    }

    #[test]
    fn a_cantilever_sags_as_beam_theory_says() {
        // q L^3/(8 EI), and F L^2/(3 EI) more.
        let weight = 1273.52 * 9.8 * 0.5_f64.powi(3) / (2.0 * 1e8 * 0.005 * 0.005);
        let bent = bent_of(|_| {}).unwrap();
        assert!((bent / weight - 1.0).abs() < 1e-3, "{bent} {weight}");
        let force = 0.01;
        let tip = force * 0.25 * 4.0 / (3.0 * 1e8 * std::f64::consts::PI * 0.005_f64.powi(4));
        let pulled = |scene: &mut Scene| {
            let force = [0.0, force, 0.0];
            scene.loads.point = vec![PointForce { node: Point::Tip, force, moment: [0.0; 3] }];
        };
        let more = bent_of(pulled).unwrap();
        assert!(((more - bent) / tip - 1.0).abs() < 1e-3, "{more} {tip}");
    }

    #[test]
    fn others_are_run_themselves() {
        assert!(bent_of(|scene| scene.material.youngs_modulus = 1e7).is_none());
        assert!(bent_of(|scene| scene.supports.end = Support::Clamped).is_none());
        assert!(bent_of(|scene| scene.supports.start = Support::Pinned).is_none());
        assert!(bent_of(|scene| scene.supports.start_compliance.rotation = 1.0).is_none());
        assert!(bent_of(|scene| scene.initial.velocity = [0.0, 1.0, 0.0]).is_none());
        assert!(bent_of(|scene| scene.loads.damping.bending = 1e-3).is_none());
        assert!(bent_of(|scene| scene.rod.segments = Some(8)).is_none());
        assert!(bent_of(|scene| scene.time = Some(Time::new(1.0, 1e-2))).is_none());
    }
}
