//! Rods with the bending law `M = EI kappa (1 + b kappa^2)`, or a table of the moment: closed forms, an independent boundary
//! value problem, order in the step, conservation of energy, and agreement of both models.

use rodfit::Point;
use rodfit::scene::{
    BendingLaw, Compliance, Dimension, Initial, InitialState, Material, PointForce, Scene, Scheme,
    Section, StepTolerance, Time,
};
use std::f64::consts::PI;

use crate::common::{at_tip, rest, straight_rod};
use crate::energy::drift;

const LENGTH: f64 = 0.4;
const RADIUS: f64 = 0.004;
const MODULUS: f64 = 2e7;
/// The coefficient b, m^2: at a curvature of 5/m the moment is larger by a half.
const COEFFICIENT: f64 = 0.02;

/// EI, N m^2.
fn bending_stiffness() -> f64 {
    MODULUS * PI * RADIUS.powi(4) / 4.0
}

/// A rod along x that is clamped at its start, without weight.
fn rod(segments: usize, coefficient: f64) -> Scene {
    let mut material = Material::new(1200.0, MODULUS);
    material.poisson_ratio = Some(0.4);
    material.bending_law = Some(BendingLaw::Cubic { coefficient });
    let mut scene = straight_rod(segments, [LENGTH, RADIUS], material);
    scene.loads.gravity = [0.0; 3];
    scene
}

/// The curvature, 1/m, at a moment, N m: the root of the cubic law, which Newton's method finds.
fn curvature_at(moment: f64, coefficient: f64) -> f64 {
    let target = moment / bending_stiffness();
    let mut kappa: f64 = 0.0;
    for _ in 0..60 {
        let value = kappa * (1.0 + coefficient * kappa * kappa) - target;
        kappa -= value / (1.0 + 3.0 * coefficient * kappa * kappa);
    }
    kappa
}

/// A constant moment bends the rod to an arc; its curvature is the root of the cubic law.
#[test]
fn constant_moment_gives_the_curvature_of_the_cubic_law() {
    for coefficient in [COEFFICIENT, -0.005] {
        let moment = 4.0 * bending_stiffness();
        let kappa = curvature_at(moment, coefficient);
        let errors = [20, 40, 80].map(|segments| {
            let mut scene = rod(segments, coefficient);
            let node = Point::Tip;
            let tip = PointForce { node, moment: [0.0, 0.0, moment], ..PointForce::default() };
            scene.loads.point = vec![tip];
            let [x, y, _] = rest(&scene).tip;
            let exact = [(kappa * LENGTH).sin() / kappa, (1.0 - (kappa * LENGTH).cos()) / kappa];
            (x - exact[0]).hypot(y - exact[1]) / LENGTH
        });
        println!("b = {coefficient}: kappa {kappa:.4}, errors {errors:?}");
        // Second order in the edge length; another law has another curvature.
        assert!(errors[2] < 2e-4 && errors[1] / errors[2] > 3.5, "{errors:?}");
        assert!((kappa - 4.0).abs() > 0.2, "{kappa}");
    }
}

/// A table of the moment over `EI kappa`, softening as a cable whose strands begin to slip.
fn table() -> BendingLaw {
    BendingLaw::Table { curvature: vec![1.0, 2.0, 4.0, 6.0], factor: vec![0.9, 0.6, 0.4, 0.38] }
}

/// A constant moment bends the rod to an arc; at the curvatures of the table it is `EI kappa` times their factors. Moments
/// between these lie between.
#[test]
fn constant_moment_gives_the_curvature_of_the_table() {
    for (kappa, factor) in [(1.0, 0.9), (2.0, 0.6), (4.0, 0.4), (7.0, 0.38)] {
        let errors = [20, 40, 80].map(|segments| {
            let mut scene = rod(segments, 0.0);
            scene.material.bending_law = Some(table());
            let moment = [0.0, 0.0, factor * kappa * bending_stiffness()];
            let tip = PointForce { node: Point::Tip, moment, ..PointForce::default() };
            scene.loads.point = vec![tip];
            let [x, y, _] = rest(&scene).tip;
            let exact = [(kappa * LENGTH).sin() / kappa, (1.0 - (kappa * LENGTH).cos()) / kappa];
            (x - exact[0]).hypot(y - exact[1]) / LENGTH
        });
        println!("kappa {kappa}: errors {errors:?}");
        // Second order in the edge length.
        assert!(errors[2] < 2e-5 * kappa * kappa && errors[1] / errors[2] > 3.5, "{errors:?}");
    }
}

/// A table of the cubic law gives its motion, in the plane and in space, where the curvature stays below the last interval.
#[test]
fn table_of_the_cubic_law_gives_its_motion() {
    for planar in [true, false] {
        let curvature = vec![1.0, 3.0, 7.0, 12.0, 40.0];
        let factor = curvature.iter().map(|kappa| 1.0 + COEFFICIENT * kappa * kappa).collect();
        let mut scene = released(planar, Scheme::NewmarkBeta, 0.1, 1e-3);
        let tip = |scene: &Scene| scene.problem().unwrap().simulate().unwrap().tip(100);
        let cubic = tip(&scene);
        scene.material.bending_law = Some(BendingLaw::Table { curvature, factor });
        let table = tip(&scene);
        let off = (0..3).map(|c| (cubic[c] - table[c]).abs()).sum::<f64>() / LENGTH;
        println!("planar {planar}: off by {off:.1e} of the length");
        assert!(off < 1e-10, "{off:e}");
    }
}

/// The tip of the elastica `EI kappa (1 + b kappa^2) = F x` under a tip force across, by integration from the tip with
/// Runge-Kutta steps and a search for the tip angle at which the wall is met: place relative to the wall, m.
fn elastica(force: f64, coefficient: f64) -> [f64; 2] {
    // Unknowns: angle, and the place relative to the tip, integrated towards the wall.
    let wall = |tip_angle: f64| {
        let rate = |[angle, x, _]: [f64; 3]| {
            [-curvature_at(-force * x, coefficient), -angle.cos(), -angle.sin()]
        };
        let (steps, mut state) = (2000, [tip_angle, 0.0, 0.0]);
        let h = LENGTH / f64::from(steps);
        for _ in 0..steps {
            let along = |k: [f64; 3], h: f64| [0, 1, 2].map(|c| state[c] + h * k[c]);
            let k1 = rate(state);
            let k2 = rate(along(k1, 0.5 * h));
            let k3 = rate(along(k2, 0.5 * h));
            let k4 = rate(along(k3, h));
            state = [0, 1, 2].map(|c| state[c] + h / 6.0 * (k1[c] + 2.0 * (k2[c] + k3[c]) + k4[c]));
        }
        state
    };
    let (mut low, mut high) = (0.0, 1.5);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if wall(middle)[0] < 0.0 { low = middle } else { high = middle }
    }
    let [_, x, y] = wall(low);
    [-x, -y]
}

#[test]
fn tip_under_a_force_is_that_of_the_nonlinear_elastica() {
    for coefficient in [COEFFICIENT, -0.003] {
        let force = 2.0 * bending_stiffness() / LENGTH.powi(2);
        let mut scene = rod(200, coefficient);
        scene.loads.point = at_tip([0.0, force, 0.0]);
        let [x, y, _] = rest(&scene).tip;
        let exact = elastica(force, coefficient);
        let off = (x - exact[0]).hypot(y - exact[1]) / LENGTH;
        let linear = elastica(force, 0.0);
        println!("b = {coefficient}: off by {off:.1e}, tip {exact:?}, linear {linear:?}");
        // Stretching of the rod and the edge length have effects of 1e-5.
        assert!(off < 1e-4, "{off:e}");
        assert!((exact[1] - linear[1]).abs() > 3e-3 * LENGTH, "{exact:?} {linear:?}");
    }
}

/// The planar model, and the spatial one with a section that is round or flat, in and across its plane.
#[test]
fn planar_and_spatial_models_agree() {
    let up = [0.0, 1.0, 0.0];
    for section in
        [Section::Circle { radius: RADIUS }, Section::Rectangle { width: 0.01, height: 0.006, up }]
    {
        let tip = |dimension| {
            let mut scene = rod(16, COEFFICIENT);
            scene.rod.section = section.clone();
            scene.rod.dimension = dimension;
            scene.loads.gravity = [0.0, -9.8, 0.0];
            scene.loads.point = at_tip([0.0, 3.0 * bending_stiffness() / LENGTH.powi(2), 0.0]);
            let tolerance = StepTolerance::Rounding;
            scene.time = Some(Time { tolerance, ..Time::new(0.2, 1e-3) });
            scene.problem().unwrap().simulate().unwrap().tip(200)
        };
        let (plane, space) = (tip(Dimension::Planar), tip(Dimension::Spatial));
        let off = (0..3).map(|c| (plane[c] - space[c]).abs()).sum::<f64>();
        assert!(off < 1e-9, "{section:?}: {off:e}");
    }
}

/// A rod in space that is released from its equilibrium under a force.
fn released(planar: bool, scheme: Scheme, end: f64, step: f64) -> Scene {
    let mut scene = rod(6, COEFFICIENT);
    scene.rod.dimension = if planar { Dimension::Auto } else { Dimension::Spatial };
    scene.initial = Initial { state: InitialState::Equilibrium, ..Initial::default() };
    let force = 3.0 * bending_stiffness() / LENGTH.powi(2);
    scene.initial.point = at_tip([0.0, force, if planar { 0.0 } else { 0.3 * force }]);
    let tolerance = StepTolerance::Rounding;
    scene.time = Some(Time { scheme, tolerance, ..Time::new(end, step) });
    scene
}

#[test]
fn schemes_have_their_order_under_large_bending() {
    for planar in [true, false] {
        for (scheme, h, order) in [
            (Scheme::NewmarkBeta, 4e-5, 2.0),
            (Scheme::AverageVectorField, 4e-5, 2.0),
            (Scheme::GeneralisedAlpha, 4e-5, 2.0),
            (Scheme::Verlet, 4e-5, 2.0),
            (Scheme::Pefrl, 1e-4, 4.0),
            (Scheme::Rodas4, 1e-4, 4.0),
        ] {
            let at = |h: f64| {
                let mut scene = released(planar, scheme, 0.04, h);
                // Thick, so that bending is not much slower than stretching.
                scene.rod.section = Section::Circle { radius: 5.0 * RADIUS };
                scene.initial.point[0].force = scene.initial.point[0].force.map(|f| 625.0 * f);
                let time = scene.time.as_mut().unwrap();
                (time.beta, time.rho_inf) = (0.5, 0.5);
                let problem = scene.problem().unwrap();
                problem.simulate().unwrap().tip(problem.time().unwrap().steps())
            };
            let exact = at(h / 16.0);
            let errors = [1.0, 0.5, 0.25].map(|part| {
                let tip = at(part * h);
                (0..3).map(|c| (tip[c] - exact[c]).powi(2)).sum::<f64>().sqrt()
            });
            let orders = [(errors[0] / errors[1]).log2(), (errors[1] / errors[2]).log2()];
            println!("planar {planar}, {scheme:?}: orders {orders:.3?} of errors {errors:?}");
            assert!(orders.iter().all(|own| (own - order).abs() < 0.15), "{scheme:?} {orders:?}");
        }
    }
}

#[test]
fn average_vector_field_conserves_the_energy_of_nonlinear_bending() {
    let scene = released(true, Scheme::AverageVectorField, 0.25, 2.5e-4);
    let change = drift(&scene);
    println!("energy changes by {change:.1e}");
    // The energy without the part beyond the linear law changes by tenths.
    assert!(change < 1e-9, "{change:e}");
}

#[test]
fn invalid_tables_are_rejected() {
    for (curvature, factor, key) in [
        (vec![], vec![], "material.bending_law.curvature"),
        (vec![1.0, 1.0], vec![1.0, 1.0], "material.bending_law.curvature"),
        (vec![0.0, 1.0], vec![1.0, 1.0], "material.bending_law.curvature"),
        (vec![1.0, f64::INFINITY], vec![1.0, 1.0], "material.bending_law.curvature"),
        (vec![1e-170, 1.0], vec![1.0, 1.0], "material.bending_law.curvature"),
        (vec![1.0, 1e200], vec![1.0, 1.0], "material.bending_law.curvature"),
        ((1..=17).map(f64::from).collect(), vec![1.0; 17], "material.bending_law.curvature"),
        (vec![1.0, 2.0], vec![1.0], "material.bending_law.factor"),
        (vec![1.0, 2.0], vec![1.0, 0.0], "material.bending_law.factor"),
        (vec![1.0, 2.0], vec![1.0, f64::NAN], "material.bending_law.factor"),
    ] {
        let mut scene = rod(6, 0.0);
        scene.material.bending_law = Some(BendingLaw::Table { curvature, factor });
        let refused = scene.problem().unwrap_err().to_string();
        assert!(refused.contains(key), "{key}: {refused}");
    }
}

#[test]
fn compliant_clamp_with_a_bending_law_is_rejected() {
    let mut scene = rod(6, COEFFICIENT);
    scene.supports.start_compliance = Compliance { axial: 0.0, rotation: 1e-3 };
    let refused = scene.problem().unwrap_err().to_string();
    assert!(refused.contains("supports.start_compliance.rotation"), "{refused}");
    assert!(refused.contains("bending_law"), "{refused}");
}
