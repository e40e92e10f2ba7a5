//! Growth rates of unstable equilibria against theory, on the mesh that is chosen for them.

use rodfit::accuracy::Calculation;
use rodfit::scene::{Material, Scene, Section, Shape, Support};
use rodfit::vibration::LinearizationPoint;
use std::f64::consts::PI;

use crate::common::at_tip;

/// A pinned column on a roller with the mode sin(pi s/L): under a force of `ratio` Euler loads it grows by
/// `pi/L sqrt((ratio - 1) P/(rho A))`.
#[test]
fn growth_rate_of_euler_column_is_within_its_error_estimate() {
    let (length, radius, modulus, density) = (1.0_f64, 4e-3_f64, 2e11, 7850.0);
    let critical = PI.powi(3) * modulus * radius.powi(4) / (4.0 * length.powi(2));
    let shape = Shape::Straight { length, direction: [0.0, 0.0, 1.0] };
    let section = Section::Circle { radius };
    for ratio in [1.05, 1.2, 2.0, 3.9] {
        let mut scene =
            Scene::new(8, shape.clone(), section.clone(), Material::new(density, modulus));
        scene.rod.segments = None;
        (scene.supports.start, scene.supports.end) = (Support::Pinned, Support::Roller);
        let force = [0.0, 0.0, -ratio * critical];
        scene.loads.point = at_tip(force);
        let exact =
            PI / length * ((ratio - 1.0) * critical / (density * PI * radius.powi(2))).sqrt();
        for count in [1, 2, 3] {
            let problem = scene.problem_for(Calculation::Modes(count)).unwrap();
            let resolution = *problem.resolution().unwrap();
            let found = problem.modes(count, LinearizationPoint::Equilibrium).unwrap();
            assert_eq!(found.unstable, 1, "{ratio} {count}");
            let error = (-found.frequencies_rad_s[0] / exact - 1.0).abs();
            let estimate = resolution.error.unwrap();
            println!(
                "{ratio} {count}: {} segments, error {error:.2e}, estimate {estimate:.2e}",
                resolution.segments
            );
            // The requested accuracy of 1e-3, with a small margin.
            assert!(error < 1.1e-3, "{ratio} {count}: {error:e}");
            // The estimate has the order of the true error, and is within the request.
            assert!(estimate > 0.2 * error && estimate < 1e-3, "{estimate:e} {error:e}");
        }
    }
}
