//! The generalized-alpha scheme against Newmark's scheme, and against its published form (Chung & Hulbert 1993) on an
//! oscillator.

use nalgebra::Vector3;
use rodfit::scene::{Clamp, Damping, InitialState, Scheme, StepTolerance, Time};

use crate::common::{at_tip, cantilever, cantilever_with, helix_with, planar};

/// At `rho_inf` = 1 generalised-alpha has the steps of Newmark's scheme at beta = 1/2, damped or not.
#[test]
fn generalised_alpha_without_dissipation_equals_newmark() {
    for (mass, stiffness) in [(0.0, 0.0), (2.0, 3e-4)] {
        for mut scene in [cantilever(), helix_with(0.5, 1e-3, 0.2, Clamp::MidEdge)] {
            scene.loads.damping = Damping { mass, stiffness, ..Damping::default() };
            let mut run = |scheme| {
                let tolerance = StepTolerance::Rounding;
                let (beta, rho_inf) = (0.5, 1.0);
                let time = Time::new(0.2, 1e-3);
                scene.time = Some(Time { scheme, beta, rho_inf, tolerance, ..time });
                scene.problem().unwrap().simulate().unwrap()
            };
            let [newmark, alpha] = [Scheme::NewmarkBeta, Scheme::GeneralisedAlpha].map(&mut run);
            let way = Vector3::from(newmark.tip(0)) - Vector3::from(newmark.tip(200));
            let apart = Vector3::from(alpha.tip(200)) - Vector3::from(newmark.tip(200));
            println!("after {:.3} m apart by {:.1e} m", way.norm(), apart.norm());
            // Both schemes have the same equations: rounding errors and the tolerance of Newton's method.
            assert!(way.norm() > 0.01 && apart.norm() < 1e-10);
        }
    }
}

/// A vibration far too fast for the step decays by `rho_inf` per step: an axially stretched rod is released, with steps of
/// many axial periods.
#[test]
fn generalised_alpha_damps_unresolved_vibrations() {
    for rho_inf in [0.8, 0.6, 0.5, 0.4] {
        let mut scene = cantilever_with(0.5, 2e-2, 0.4, Clamp::MidEdge);
        scene.material.youngs_modulus = 1e10;
        scene.loads.gravity = [0.0; 3];
        scene.initial.state = InitialState::Equilibrium;
        scene.initial.point = at_tip([1e-3, 0.0, 0.0]);
        let time = scene.time.as_mut().unwrap();
        (time.scheme, time.rho_inf) = (Scheme::GeneralisedAlpha, rho_inf);
        let problem = scene.problem().unwrap();
        let mut simulation = planar(&problem).simulation().unwrap();
        let tip = simulation.state().q.len() - 2;
        let length = planar(&problem).rest()[tip];
        // Its energy may rise before it falls, which step control would not have.
        let mut stretch = vec![simulation.state().q[tip] - length];
        for k in 1..=20 {
            simulation.step_to(f64::from(k) * 2e-2).unwrap();
            stretch.push(simulation.state().q[tip] - length);
        }
        // Such modes go down as the scheme as published takes down one of them.
        let one = oscillation(rho_inf, 200.0, 20);
        let left = |x: &[f64]| (x[19].abs().max(x[20].abs()) / x[0].abs()).ln() / 20.0;
        let [rod, one] = [left(&stretch), left(&one)];
        println!("rho {rho_inf}: a step leaves {:.4}, of one mode {:.4}", rod.exp(), one.exp());
        // The rate of the published scheme on one mode, at 200 radians per step.
        assert!(stretch[0] > 1e-10 && (rod - one).abs() < 0.05, "{rod} {one}");
    }
}

/// Positions of a released oscillator by the published scheme; `w` is its frequency times the step.
fn oscillation(rho: f64, w: f64, steps: usize) -> Vec<f64> {
    let (am, af) = ((2.0 * rho - 1.0) / (rho + 1.0), rho / (rho + 1.0));
    let (gamma, beta) = (0.5 - am + af, 0.25 * (1.0 - am + af).powi(2));
    let (mut x, mut v, mut a) = (1.0, 0.0, -w * w);
    let mut all = vec![x];
    for _ in 0..steps {
        let there = x + v + (0.5 - beta) * a;
        let force = w * w * ((1.0 - af) * there + af * x);
        let next = -(am * a + force) / (1.0 - am + w * w * (1.0 - af) * beta);
        (x, v, a) = (there + beta * next, v + (1.0 - gamma) * a + gamma * next, next);
        all.push(x);
    }
    all
}
