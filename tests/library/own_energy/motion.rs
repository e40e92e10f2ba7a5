//! Motion of rods with user-defined energies by all schemes: both kinds of derivatives agree, and energy is conserved.

use crate::own_energy::energies::{Bending, Everything, Floor, Stretching};
use crate::own_energy::scenes::{
    RADIUS, helix, in_scheme, plane_and_space, schemes, straight, with_both,
};
use rodfit::energy::{At, Derivatives};
use rodfit::scene::*;
use rodfit::{Problem, Trajectory};
use std::f64::consts::PI;

fn run(problem: &Problem) -> Trajectory {
    problem.simulate().unwrap()
}

/// The largest distance of two runs' nodes, m.
fn apart(a: &Trajectory, b: &Trajectory) -> f64 {
    let mut most = 0.0_f64;
    for k in 0..a.times().len() {
        for i in 0..a.nodes() {
            let (x, y) = (a.node(i, k), b.node(i, k));
            most = (0..3).fold(most, |most, c| most.max((x[c] - y[c]).abs()));
        }
    }
    most
}

#[test]
fn dual_numbers_and_hand_derived_formulas_agree() {
    for scheme in schemes() {
        for (name, scene, field) in plane_and_space() {
            let of = |by_hand: bool| {
                let scene = in_scheme(scene.clone(), scheme);
                run(&with_both(scene, by_hand, field).problem().unwrap())
            };
            let off = apart(&of(true), &of(false));
            println!("{name} {scheme:?}: {off:.1e}");
            // Both derivatives are exact: rounding errors over the run.
            assert!(off < 1e-12, "{name} {scheme:?}: {off:e}");
        }
        let scene = in_scheme(helix(14), scheme);
        let scene =
            scene.with_energy("all", At::Interval(0.1, 0.2), Everything { wrong: 0.0 }, [3e-5]);
        let problem = scene.problem().unwrap();
        let off = apart(&run(&problem), &run(&problem.with_derivatives(Derivatives::Dual)));
        println!("{scheme:?}: {off:.1e}");
        // Both derivatives are exact: rounding errors over the run.
        assert!(off < 1e-12, "{scheme:?}: {off:e}");
    }
}

/// The average vector field keeps the energy, the explicit schemes keep it in bounds, and it is not
/// the rod's alone that is kept.
#[test]
fn energy_with_user_defined_energy_is_conserved() {
    for (scheme, allowed) in [
        (Scheme::AverageVectorField, 1e-9),
        (Scheme::Verlet, 1e-2),
        (Scheme::Pefrl, 1e-5),
        (Scheme::Rodas4, 0.05),
    ] {
        for (name, scene, field) in plane_and_space() {
            let problem = with_both(in_scheme(scene, scheme), true, field).problem().unwrap();
            let mut trajectory = Trajectory::new(&problem, &[], &[]).unwrap().keep_energies();
            trajectory.run(&problem, problem.time().unwrap().steps(), |_| {}).unwrap();
            let energies = trajectory.energies();
            let kinetic = energies.iter().fold(0.0_f64, |most, e| most.max(e.kinetic));
            let drift = energies
                .iter()
                .fold(0.0_f64, |most, e| most.max((e.total() - energies[0].total()).abs()));
            let own =
                energies.iter().fold(0.0_f64, |most, e| most.max((e.own - energies[0].own).abs()));
            println!("{name} {scheme:?}: {:.1e}, own {:.1e}", drift / kinetic, own / kinetic);
            // The limit depends on the scheme (see `allowed`); the user-defined energy has a visible part of the exchange.
            assert!(drift < allowed * kinetic && own > 0.05 * kinetic, "{name} {scheme:?}");
        }
    }
}

/// A floor has no third derivative at contact, where the quadrature of the average vector field is not exact. Runs of all
/// schemes continue nevertheless.
#[test]
fn contact_with_a_floor_does_not_stop_any_scheme() {
    for scheme in schemes() {
        let mut scene = in_scheme(straight(20), scheme);
        if let Some(time) = &mut scene.time {
            time.end = 0.2;
        }
        let floor = Floor { height: -0.01, bottom: -1.0 };
        let problem = scene.with_energy("floor", At::Whole, floor, [2e4]).problem().unwrap();
        let trajectory = run(&problem);
        let end = trajectory.times().len() - 1;
        let lowest = (0..=end).fold(0.0_f64, |low, k| low.min(trajectory.tip(k)[1]));
        println!("{scheme:?}: {lowest}, {:?}", trajectory.work());
        // The floor is at -0.01 m; its stiffness lets the rod penetrate by less than 0.01 m.
        assert!((-0.02..-0.01).contains(&lowest), "{scheme:?}: {lowest}");
    }
}

/// An energy that keeps a tilted plane moves the planar rod as it does the spatial one.
#[test]
fn planar_and_spatial_models_of_user_defined_energy_agree() {
    let directions = [[0.6, 0.0, 0.8], [0.48, 0.64, 0.6]];
    let up = [[0.0, 1.0, 0.0], [-0.8, 0.6, 0.0]];
    let sections = [
        Section::Circle { radius: RADIUS },
        Section::Rectangle { width: 5e-3, height: 3e-3, up: up[0] },
    ];
    for (direction, across) in directions.into_iter().zip(up) {
        for section in &sections {
            let mut scene = straight(12);
            scene.rod.shape = Shape::Straight { length: 0.3, direction };
            scene.rod.section = section.clone();
            if let Section::Rectangle { up, .. } = &mut scene.rod.section {
                *up = across;
            }
            scene.loads.gravity = across.map(|c| -9.8 * c);
            let field: [f64; 3] = std::array::from_fn(|c| 0.05 * across[c] - 0.03 * direction[c]);
            // A round rod has its directors anywhere: what bends otherwise to either leaves the plane.
            let second = if matches!(section, Section::Circle { .. }) { 2e-4 } else { 3e-4 };
            let bending = Bending { in_space: false };
            let scene = with_both(scene, false, field).with_energy(
                "bend",
                At::Whole,
                bending,
                [2e-4, second, 1e-4],
            );
            let plane = scene.problem().unwrap();
            assert_eq!(plane.model().0, "planar", "{}", plane.model().1);
            let mut scene = scene;
            scene.rod.dimension = Dimension::Spatial;
            let space = scene.problem().unwrap();
            let off = apart(&run(&plane), &run(&space));
            println!("{direction:?}: {off:.1e}");
            // Rounding errors that grow along the run.
            assert!(off < 1e-11, "{direction:?} {section:?}: {off:e}");
        }
    }
}

/// The rod's own energy once more is a rod of twice the stiffness.
#[test]
fn second_bending_energy_doubles_the_stiffness() {
    let area = PI * RADIUS * RADIUS;
    let ei = |youngs: f64, moment: f64| youngs * moment;
    for (name, shape, section) in [
        ("plane", Shape::Arc { length: 0.3, angle: 1.0 }, Section::Circle { radius: RADIUS }),
        (
            "space",
            helix(14).rod.shape,
            Section::Rectangle { width: 5e-3, height: 3e-3, up: [1.0, 0.3, 0.2] },
        ),
    ] {
        let mut scene = straight(14);
        (scene.rod.shape, scene.rod.section) = (shape, section);
        scene.rod.discretization = Some(Discretization::Paper);
        scene.supports.clamp = Clamp::Nodes;
        scene.loads.gravity = if name == "plane" { [0.0, -9.8, 0.0] } else { [1.0, 2.0, -9.0] };
        let youngs = scene.material.youngs_modulus;
        let moments = scene.rod.section.moments();
        // The section of the planar scene is the circle of this area.
        assert!(name == "space" || (moments.area - area).abs() < 1e-15);
        let [i1, i2] = moments.second_moments;
        let gj = youngs / (2.0 * 1.4) * moments.torsion_constant;
        let mut double = scene.clone();
        double.material.youngs_modulus *= 2.0;
        let bending = Bending { in_space: name == "space" };
        let both = scene
            .with_energy("bend", At::Whole, bending, [ei(youngs, i1), ei(youngs, i2), gj])
            .with_energy("stretch", At::Whole, Stretching, [youngs * moments.area]);
        let (double, both) = (double.problem().unwrap(), both.problem().unwrap());
        assert_eq!(both.model().0 == "planar", name == "plane");
        let off = apart(&run(&double), &run(&both));
        println!("{name}: {off:.1e}");
        // Two equal energies add to twice the stiffness: rounding errors that grow along the run.
        assert!(off < 1e-9, "{name}: {off:e}");
    }
}

/// Stiff springs lower the largest step of the explicit schemes, as theory has it.
#[test]
fn stability_limit_of_explicit_schemes_includes_user_defined_energy() {
    for scheme in [Scheme::Verlet, Scheme::Pefrl] {
        let scene = in_scheme(straight(12), scheme);
        let largest = |scene: &Scene| {
            scene.problem().unwrap().planar().unwrap().largest_step().unwrap().unwrap()
        };
        let alone = largest(&scene);
        let line_density = scene.material.density * PI * RADIUS * RADIUS;
        // As much again as the highest frequency squared.
        let limit = if scheme == Scheme::Verlet { 2.0 } else { 2.989 };
        let k = line_density * (limit / alone).powi(2);
        let springs = crate::own_energy::energies::Foundation { by_hand: false };
        let with = largest(&scene.with_energy("springs", At::Whole, springs, [k, 0.0]));
        println!("{scheme:?}: {alone:e} {with:e}");
        // Springs that double the squared highest frequency reduce the largest step by sqrt(2).
        assert!((alone / with - 2f64.sqrt()).abs() < 1e-3, "{alone} {with}");
    }
}
