//! Derivatives of structures with damping and friction of contacts: tangent and factors of a step, motions, and fits.

use crate::contact_scenes::{DIMENSIONS, LOSSES, RADIUS, body, falling, plane, structure, time};
use crate::derivative_checks::{check_jacobian, check_motion_derivative};
use crate::scenes::{joint, spatial_rod};
use nalgebra::{DMatrix, DVector};
use num_dual::Dual64;
use rodfit::fit::{Analysis, Experiment, Refinement, Sample};
use rodfit::numerics::tangent::{Factors, Tangent};
use rodfit::rod::{Rod, StepVelocities};
use rodfit::scene::structure_point::StructurePoint;
use rodfit::{Derivatives, Fit, Observation, Parameter, Structure};

/// Derivatives of the losses and factors of their tangent, against dual numbers and dense matrices. A frame lies on the
/// floor with all joints, which then moves up.
#[test]
fn tangent_of_losses_agrees_with_dual_numbers() {
    let slope = 400.0;
    for dimension in DIMENSIONS {
        let aside = |z: f64| if dimension == DIMENSIONS[0] { 0.0 } else { z };
        let own = structure(
            dimension,
            2e9,
            &[
                spatial_rod("a", 8, 0.15, [1.0, 0.0, aside(0.3)]),
                spatial_rod("b", 8, 0.1, [0.7, 0.0, aside(-0.8)]),
                spatial_rod("c", 8, 0.1, [1.0, 0.0, aside(0.9)]),
                body(dimension),
                joint("rigid", &["a.end", "b.start"], ""),
                joint("spring", &["b.end", "c.start"], "rotation = 0.5"),
                joint("rigid", &["bob", "c.end"], ""),
                plane([0.0, -1.1 * RADIUS], [0.001, 1.0], &format!("{LOSSES}\nstiffness = 1e8")),
            ],
        );
        let height = |path: &str| if path == "contacts.0.point.y" { 1e-3 } else { 0.0 };
        let plain = own.at_rest_over(|path, value, _| value + height(path)).unwrap();
        let dual = own.at_rest_over(|path, value, _| Dual64::from(value + height(path))).unwrap();
        let (assembly, dual_assembly) =
            (plain.assembly.by_increments(), dual.assembly.by_increments());
        let (mut q, frames, n) = (plain.q.clone(), &plain.frames, plain.q.len());
        (0..n).for_each(|i| q[i] += 2e-4 * (0.9 * i as f64).cos());
        let v: Vec<f64> = (0..n).map(|i| 0.05 * (1.7 * i as f64).sin()).collect();
        let (mut forces, mut tangent) = (vec![0.0; n], assembly.zero_tangent());
        let velocities = StepVelocities { velocity: &v[..], slope };
        assert!(assembly.has_contact_losses());
        assembly.add_contact_losses(&q, frames, velocities, &mut forces, Some(&mut tangent));
        let tied: Vec<usize> = assembly.unknowns_without_effect().collect();
        let bodies = assembly.body_coordinates();
        assert!(bodies.clone().any(|i| forces[i] != 0.0), "no forces on carried nodes");
        for seed in 1..=3 {
            let mut x: Vec<f64> = (0..n).map(|i| (1.3 * (seed * i) as f64).cos()).collect();
            tied.iter().for_each(|i| x[*i] = 0.0);
            let mut change = x.clone();
            assembly.convert_correction(&q, frames, &mut change);
            let along = |x: &[f64], rate: f64| -> Vec<Dual64> {
                x.iter().zip(&change).map(|(x, d)| Dual64::new(*x, rate * d)).collect()
            };
            let (moved, rates) = (along(&q, 1.0), along(&v, slope));
            let velocities = StepVelocities { velocity: &rates[..], slope: Dual64::from(slope) };
            let mut exact = vec![Dual64::from(0.0); n];
            dual_assembly.add_contact_losses(&moved, &dual.frames, velocities, &mut exact, None);
            let mut product = vec![0.0; n];
            tangent.product(&x, &mut product);
            tied.iter().for_each(|i| product[*i] = 0.0);
            let by_entries = |i: usize| -> f64 { (0..n).map(|j| tangent.get(i, j) * x[j]).sum() };
            let size = exact.iter().fold(0.0_f64, |size, f| size.max(f.eps.abs()));
            let of_bodies = bodies.clone().fold(0.0_f64, |size, i| size.max(exact[i].eps.abs()));
            println!("{dimension}{seed}: {size:.3e}, of bodies {of_bodies:.3e} N");
            assert!(of_bodies > 1e-3 * size);
            for i in (0..n).filter(|i| !tied.contains(i)) {
                assert!((exact[i].re - forces[i]).abs() < 1e-12 * size / slope);
                let off = (exact[i].eps - product[i]).abs().max((product[i] - by_entries(i)).abs());
                assert!(off < 1e-9 * size, "{i}: {} {}", exact[i].eps, product[i]);
            }
        }
        // The matrix of a step, with elastic forces.
        let mut gradient = vec![0.0; n];
        assembly.tangent(&q, frames, Derivatives::Hand, &mut gradient, &mut tangent);
        let velocities = StepVelocities { velocity: &v[..], slope };
        assembly.add_contact_losses(&q, frames, velocities, &mut gradient, Some(&mut tangent));
        let shift = slope * slope;
        let dense = DMatrix::from_fn(n, n, |i, j| {
            tangent.get(i, j) + if i == j { shift * assembly.mass()[i] } else { 0.0 }
        });
        assert!((0..n).any(|i| (0..i).any(|j| (dense[(i, j)] - dense[(j, i)]).abs() > 1.0)));
        let mut factors = tangent.new_factors();
        factors.factor_sum(assembly.mass(), shift, &tangent, 1.0, 0..n).unwrap();
        let b: Vec<f64> = (0..n).map(|i| (0.7 * i as f64).sin()).collect();
        let mut x = b.clone();
        factors.solve(&mut x);
        let residual = &dense * DVector::from_column_slice(&x) - DVector::from_column_slice(&b);
        let size = dense.amax() * x.iter().fold(0.0_f64, |size, x| size.max(x.abs()));
        let off =
            (0..n).filter(|i| !tied.contains(i)).map(|i| residual[i].abs()).fold(0.0, f64::max);
        println!("residual {off:.1e} of {size:.1e}");
        assert!(off < 1e-12 * size, "{off:e} {size:e}");
    }
}

/// Derivatives of a motion with damping and friction, from dual numbers and from differences.
#[test]
fn derivatives_of_a_motion_with_losses_agree_with_differences() {
    for dimension in DIMENSIONS {
        let floor = format!("{LOSSES}\nstiffness = 1e8");
        let times = time(0.1, 1e-3, "tolerance = \"rounding\"");
        let own = falling(dimension, 2e9, &floor, &times);
        let times = || (1..=100).map(|k| 1e-3 * f64::from(k));
        let rods = own.at_rest().assembly.body_coordinates().start;
        let end = |structure: &Structure| {
            let (mut motion, mut contact) = (structure.simulation().unwrap(), 0.0_f64);
            times().for_each(|t| {
                motion.step_to(t).unwrap();
                contact = contact.max(motion.energies().own);
            });
            assert!(
                contact > 0.0 && motion.taken().len() == 100,
                "{contact} {}",
                motion.taken().len()
            );
            let mut q = motion.simulation().state().q.clone();
            motion.simulation().rod().place_carried(&mut q, &motion.simulation().state().frames);
            q.truncate(rods);
            q
        };
        for path in [
            "materials.steel.youngs_modulus",
            "contacts.0.friction",
            "contacts.0.damping",
            "contacts.0.slip_velocity",
            "contacts.0.stiffness",
            "bodies.bob.mass",
        ] {
            check_motion_derivative(&own, path, times(), end, 1e-4, [1e-10, 1e-6]);
        }
    }
}

/// Residuals of a fit to the tips of a structure on a moved floor against differences, and friction, damping and
/// modulus from exact data.
#[test]
fn fit_gives_back_friction_damping_and_modulus() {
    const NAMES: [&str; 4] = [
        "contacts.0.friction",
        "contacts.0.damping",
        "materials.steel.youngs_modulus",
        "contacts.0.motion.0.velocity.x",
    ];
    let scene = |[friction, damping, modulus, speed]: [f64; 4]| {
        let floor = format!(
            "friction = {friction:e}\ndamping = {damping:e}\nslip_velocity = 5e-3\nstiffness = 1e8\n\
             motion = [{{ velocity = [{speed:?}, 0, 0] }}]"
        );
        let times = time(0.12, 1e-3, "tolerance = \"rounding\"");
        falling(DIMENSIONS[0], modulus, &floor, &times)
    };
    let truth = [0.35, 6.0, 1.6e9, 0.3];
    let own = scene(truth);
    let places = ["a", "c"].map(StructurePoint::tip);
    let mut motion = own.simulation().unwrap();
    let mut samples = [Vec::new(), Vec::new()];
    for k in 1..=120 {
        let time = 1e-3 * f64::from(k);
        motion.step_to(time).unwrap();
        for (samples, place) in samples.iter_mut().zip(&places) {
            let [x, y, _] = motion.position(place).unwrap();
            samples.push(Sample { time, position: [Some(x), Some(y), None] });
        }
    }
    let fit_from = |values: [f64; 4]| {
        let experiment = Experiment::of_structure("", scene(values).scene().clone()).unwrap();
        let observed = samples.iter().cloned().zip(&places);
        let experiment = observed.fold(experiment, |experiment, (samples, place)| {
            experiment.observe(Observation::new(samples).of_structure(place.clone()).sigma(1e-4))
        });
        let names = NAMES.iter().map(|name| name.parse::<Parameter>().unwrap());
        names.fold(Fit::of([experiment]), Fit::identify).analyse(Analysis {
            discretization_error: Refinement::None,
            sensitivity_analysis: Some(false),
            ..Analysis::default()
        })
    };
    let start = [0.4, 8.0, 2e9, 0.25];
    let residuals = fit_from(start).residuals().unwrap();
    let unknowns = residuals.unknowns().iter().zip(start);
    let x: Vec<f64> = unknowns.map(|(unknown, value)| unknown.to_scale(value)).collect();
    check_jacobian(&residuals, &x, 3e-5, 1e-6);
    let report = fit_from(start).solve().unwrap();
    assert!(report.converged, "{report}");
    for (name, truth) in NAMES.iter().zip(truth) {
        let found = report.estimate(name.parse().unwrap()).unwrap().value.unwrap();
        println!("{name}: off by {:.1e}", found / truth - 1.0);
        assert!((found / truth - 1.0).abs() < 1e-6, "{name}: {found} {truth}");
    }
}
