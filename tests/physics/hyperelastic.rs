//! Rods with a neo-Hookean stretch: force against stretch, conservation of energy, order in the step, and what is refused.

use rodfit::scene::{
    Compliance, InitialState, Material, Scene, Scheme, Shape, StepTolerance, StretchLaw, Time,
};
use std::f64::consts::PI;

use crate::common::differences::at_rest;
use crate::common::{at_tip, planar, rest, straight_rod};

/// Length and radius of the rods, m, and Young's modulus, Pa.
const LENGTH: f64 = 0.2;
const RADIUS: f64 = 0.004;
const MODULUS: f64 = 3e5;

/// A rubber rod along x that is clamped at its start.
fn rubber(segments: usize) -> Scene {
    let mut material = Material::new(1100.0, MODULUS);
    material.stretch_law = StretchLaw::NeoHookean;
    let mut scene = straight_rod(segments, [LENGTH, RADIUS], material);
    scene.loads.gravity = [0.0; 3];
    scene
}

/// Stretches at rest of the free edges of a rod that is made short enough for no force here to make it buckle.
fn free_stretches(mut scene: Scene) -> Vec<f64> {
    scene.rod.shape = Shape::Straight { length: 0.01, direction: [1.0, 0.0, 0.0] };
    let problem = scene.problem().unwrap();
    let run = at_rest(&problem, &[]);
    let rod = planar(&problem).rod();
    // The first edge of a clamp at mid-edge is half in the wall.
    let stretch =
        |j: usize| (run.node(j + 1, 0)[0] - run.node(j, 0)[0]) / rod.stretch[j].rest_length;
    (2..problem.nodes() - 1).map(stretch).collect()
}

/// `E A/3 (lambda - 1/lambda^2)`.
#[test]
fn force_against_stretch_is_that_of_an_incompressible_neo_hookean_bar() {
    let area = PI * RADIUS * RADIUS;
    for force in [-1.0, -0.1, -1e-6, 1e-6, 0.5, 5.0, 20.0] {
        let mut scene = rubber(10);
        scene.loads.point = at_tip([force, 0.0, 0.0]);
        for stretch in free_stretches(scene) {
            let exact = MODULUS * area / 3.0 * (stretch - 1.0 / (stretch * stretch));
            // Relative to the force, or to the rounding errors of places.
            let scale = force.abs().max(0.1 * MODULUS * area);
            assert!((exact - force).abs() < 1e-12 * scale, "{force}: {exact} at {stretch}");
        }
    }
    // The linear law has another stretch.
    let mut scene = rubber(10);
    scene.loads.point = at_tip([5.0, 0.0, 0.0]);
    let neo_hookean = rest(&scene).tip[0];
    scene.material.stretch_law = StretchLaw::Linear;
    let linear = rest(&scene).tip[0];
    assert!(neo_hookean > linear + 0.02, "{neo_hookean} {linear}");
}

/// `E A/3 (1 - r + r/lambda) (lambda - 1/lambda^2)` with the ratio `r = C2/(C1 + C2)`.
#[test]
fn force_against_stretch_is_that_of_an_incompressible_mooney_rivlin_bar() {
    let area = PI * RADIUS * RADIUS;
    for (force, ratio) in [(-1.0, 0.3), (-1e-6, 0.3), (0.5, 0.0), (5.0, 0.3), (2.0, 1.0)] {
        let mut scene = rubber(10);
        (scene.material.stretch_law, scene.material.mooney_rivlin_ratio) =
            (StretchLaw::MooneyRivlin, Some(ratio));
        scene.loads.point = at_tip([force, 0.0, 0.0]);
        for stretch in free_stretches(scene) {
            let exact = MODULUS * area / 3.0
                * (1.0 - ratio + ratio / stretch)
                * (stretch - 1.0 / (stretch * stretch));
            let scale = force.abs().max(0.1 * MODULUS * area);
            assert!((exact - force).abs() < 1e-12 * scale, "{force}: {exact} at {stretch}");
        }
    }
    let refused = |law, ratio| {
        let mut scene = rubber(4);
        (scene.material.stretch_law, scene.material.mooney_rivlin_ratio) = (law, ratio);
        scene.problem().unwrap_err().to_string()
    };
    for message in [
        refused(StretchLaw::MooneyRivlin, None),
        refused(StretchLaw::MooneyRivlin, Some(1.5)),
        refused(StretchLaw::NeoHookean, Some(0.2)),
    ] {
        assert!(message.contains("material.mooney_rivlin_ratio"), "{message}");
    }
}

/// A rod that is released from its equilibrium under a force that stretches it by a third.
fn released(scheme: Scheme, end: f64, step: f64) -> Scene {
    let mut scene = rubber(6);
    scene.initial.state = InitialState::Equilibrium;
    scene.initial.point = at_tip([4.0, 0.3, 0.0]);
    let time = Time { scheme, tolerance: StepTolerance::Rounding, ..Time::new(end, step) };
    scene.time = Some(time);
    scene
}

/// Largest change of the total energy over the largest kinetic energy, the largest part of stretching in the start, and
/// the place of the tip at the end, m.
struct Motion {
    drift: f64,
    stretching: f64,
    tip: [f64; 2],
}

fn motion(scene: &Scene) -> Motion {
    let problem = scene.problem().unwrap();
    let time = problem.time().unwrap();
    let mut simulation = planar(&problem).simulation().unwrap();
    let start = simulation.energies();
    let (mut change, mut kinetic) = (0.0_f64, 0.0_f64);
    for k in 1..=time.steps() {
        simulation.step_to(time.at(k)).unwrap();
        let energies = simulation.energies();
        change = change.max((energies.total() - start.total()).abs());
        kinetic = kinetic.max(energies.kinetic);
    }
    let tip = *simulation.state().q.last_chunk().unwrap();
    Motion { drift: change / kinetic, stretching: start.stretch / start.total(), tip }
}

#[test]
fn average_vector_field_conserves_the_energy_of_large_stretches() {
    // The error of the quadrature over a step is of eighth order: 4e-7 at 1 ms.
    let found = motion(&released(Scheme::AverageVectorField, 0.25, 2.5e-4));
    println!("energy changes by {:.1e}, stretching has {:.3}", found.drift, found.stretching);
    assert!(found.stretching > 0.5, "{}", found.stretching);
    assert!(found.drift < 1e-9, "{:e}", found.drift);
    // Newmark-beta does not.
    let newmark = motion(&released(Scheme::NewmarkBeta, 0.25, 2.5e-4));
    assert!(newmark.drift > 1e-6, "{:e}", newmark.drift);
}

#[test]
fn schemes_have_their_order_under_large_stretches() {
    for (scheme, parameter, h, order) in [
        (Scheme::NewmarkBeta, 0.5, 1e-4, 2.0),
        (Scheme::AverageVectorField, 0.5, 1e-4, 2.0),
        (Scheme::GeneralisedAlpha, 0.5, 1e-4, 2.0),
        (Scheme::Verlet, 0.5, 1e-4, 2.0),
        (Scheme::Pefrl, 0.5, 1e-4, 4.0),
        (Scheme::Rodas4, 0.5, 2e-4, 4.0),
    ] {
        let at = |h: f64| {
            let mut scene = released(scheme, 0.02, h);
            let time = scene.time.as_mut().unwrap();
            (time.beta, time.rho_inf) = (parameter, parameter);
            motion(&scene).tip
        };
        let exact = at(h / 32.0);
        let errors = [1.0, 0.5, 0.25].map(|part| {
            let tip = at(part * h);
            (tip[0] - exact[0]).hypot(tip[1] - exact[1])
        });
        let orders = [(errors[0] / errors[1]).log2(), (errors[1] / errors[2]).log2()];
        println!("{scheme:?}: orders {orders:.3?} of errors {errors:?}");
        assert!(orders.iter().all(|own| (own - order).abs() < 0.15), "{scheme:?} {orders:?}");
    }
}

/// Compressible materials, and compliances in series with an edge.
#[test]
fn compressible_materials_and_axial_compliances_are_rejected() {
    let mut scene = rubber(6);
    scene.material.poisson_ratio = Some(0.3);
    let refused = scene.problem().unwrap_err().to_string();
    assert!(
        refused.contains("material.poisson_ratio") && refused.contains("neo-hookean"),
        "{refused}"
    );
    let mut scene = rubber(6);
    scene.supports.start_compliance = Compliance { axial: 1e-4, rotation: 0.0 };
    let refused = scene.problem().unwrap_err().to_string();
    assert!(refused.contains("supports.start_compliance.axial"), "{refused}");
}
