//! Derivatives of damping and friction of rods in contact with each other: tangent and factors of a step, balance of
//! the forces, and motions.

use crate::contact_scenes::{DIMENSIONS, LOSSES, bundle, collision};
use crate::derivative_checks::check_motion_derivative;
use nalgebra::{DMatrix, DVector};
use num_dual::Dual64;
use rodfit::numerics::tangent::{Factors, Tangent};
use rodfit::rod::{Rod, StepVelocities};
use rodfit::{Derivatives, Structure};

/// Derivatives of the losses and factors of their tangent, against dual numbers and dense matrices.
#[test]
fn tangent_of_losses_of_rods_agrees_with_dual_numbers() {
    let slope = 400.0;
    for dimension in DIMENSIONS {
        let own = bundle(dimension, LOSSES);
        let plain = own.at_rest();
        let dual = own.at_rest_over(|_, value, _| Dual64::from(value)).unwrap();
        let (assembly, dual_assembly) =
            (plain.assembly.clone().by_increments(), dual.assembly.by_increments());
        let (mut q, frames, n) = (plain.q.clone(), &plain.frames, plain.q.len());
        (0..n).for_each(|i| q[i] += 1e-4 * (0.9 * i as f64).cos());
        let ranges = assembly.rod_ranges();
        let stride = if dimension == DIMENSIONS[0] { 2 } else { 4 };
        ranges[1].clone().skip(1).step_by(stride).for_each(|i| q[i] -= 4.5e-3);
        ranges[2].clone().skip(1).step_by(stride).for_each(|i| q[i] += 4.5e-3);
        assembly.place_carried(&mut q, frames);
        let v: Vec<f64> = (0..n).map(|i| 0.05 * (1.7 * i as f64).sin()).collect();
        let (mut forces, mut tangent) = (vec![0.0; n], assembly.zero_tangent());
        let velocities = StepVelocities { velocity: &v[..], slope };
        assert!(assembly.has_contact_losses());
        assembly.add_contact_losses(&q, frames, velocities, &mut forces, Some(&mut tangent));
        let mut alone = vec![0.0; n];
        assembly.add_contact_losses(&q, frames, velocities, &mut alone, None);
        assert_eq!(forces, alone);
        let touched = ranges.iter().filter(|rod| (*rod).clone().any(|i| forces[i] != 0.0)).count();
        assert_eq!(touched, 3, "rods without a force");
        let tied: Vec<usize> = assembly.unknowns_without_effect().collect();
        for seed in 1..=3 {
            let mut x: Vec<f64> = (0..n).map(|i| (1.3 * (seed * i) as f64).cos()).collect();
            tied.iter().for_each(|i| x[*i] = 0.0);
            let along = |own: &[f64], rate: f64| -> Vec<Dual64> {
                own.iter().zip(&x).map(|(own, d)| Dual64::new(*own, rate * d)).collect()
            };
            let (moved, rates) = (along(&q, 1.0), along(&v, slope));
            let velocities = StepVelocities { velocity: &rates[..], slope: Dual64::from(slope) };
            let mut exact = vec![Dual64::from(0.0); n];
            dual_assembly.add_contact_losses(&moved, &dual.frames, velocities, &mut exact, None);
            let mut product = vec![0.0; n];
            tangent.product(&x, &mut product);
            let by_entries = |i: usize| -> f64 { (0..n).map(|j| tangent.get(i, j) * x[j]).sum() };
            let size = exact.iter().fold(0.0_f64, |size, f| size.max(f.eps.abs()));
            println!("{dimension}{seed}: {size:.3e} N");
            assert!(size > 1.0);
            for i in (0..n).filter(|i| !tied.contains(i)) {
                assert!((exact[i].re - forces[i]).abs() < 1e-12 * size / slope);
                let off = (exact[i].eps - product[i]).abs().max((product[i] - by_entries(i)).abs());
                assert!(off < 1e-9 * size, "{i}: {} {}", exact[i].eps, product[i]);
            }
        }
        // The matrix of a step, with elastic forces.
        let mut gradient = vec![0.0; n];
        assembly.tangent(&q, frames, Derivatives::Hand, &mut gradient, &mut tangent);
        let symmetric = tangent.clone();
        assembly.add_contact_losses(&q, frames, velocities, &mut gradient, Some(&mut tangent));
        let shift = slope * slope;
        let dense = DMatrix::from_fn(n, n, |i, j| {
            tangent.get(i, j) + if i == j { shift * assembly.mass()[i] } else { 0.0 }
        });
        let differs = |i: usize, j: usize| (dense[(i, j)] - dense[(j, i)]).abs() > 1.0;
        assert!(ranges[1].clone().any(|i| ranges[0].clone().any(|j| differs(i, j))));
        let mut factors = tangent.new_factors();
        let b: Vec<f64> = (0..n).map(|i| (0.7 * i as f64).sin()).collect();
        factors.factor_sum(assembly.mass(), shift, &tangent, 1.0, 0..n).unwrap();
        let mut x = b.clone();
        factors.solve(&mut x);
        let residual = &dense * DVector::from_column_slice(&x) - DVector::from_column_slice(&b);
        let size = dense.amax() * x.iter().fold(0.0_f64, |size, x| size.max(x.abs()));
        let off =
            (0..n).filter(|i| !tied.contains(i)).map(|i| residual[i].abs()).fold(0.0, f64::max);
        println!("residual {off:.1e} of {size:.1e}");
        assert!(off < 1e-12 * size, "{off:e} {size:e}");
        // A cleared matrix has no entries of the losses.
        tangent.clear();
        tangent.add_scaled(&symmetric, 1.0);
        assert!((0..n).all(|i| (0..n).all(|j| tangent.get(i, j) == symmetric.get(i, j))));
    }
}

/// Derivatives of a collision with damping and friction, from dual numbers and from differences.
#[test]
fn derivatives_of_a_collision_with_losses_agree_with_differences() {
    let keys = "tolerance = \"rounding\"\nscheme = \"generalised-alpha\"";
    let own = collision(4e-4, 0.005, "friction = 0.4\ndamping = 2.0\nslip_velocity = 2e-2", keys);
    let times = || (1..=250).map(|k| 4e-4 * f64::from(k));
    let rods = own.at_rest().assembly.body_coordinates().start;
    let end = |own: &Structure| {
        let (mut motion, mut contact) = (own.simulation().unwrap(), 0.0_f64);
        times().for_each(|t| {
            motion.step_to(t).unwrap();
            contact = contact.max(motion.energies().own);
        });
        assert!(contact > 0.0 && motion.taken().len() == 250);
        let mut q = motion.simulation().state().q.clone();
        motion.simulation().rod().place_carried(&mut q, &motion.simulation().state().frames);
        q.truncate(rods);
        q
    };
    // The second derivative of friction jumps at the slip velocity. Differences by that, and by numbers that change the
    // time at which it is passed, converge with the first power of their step only. Rounding errors of the positions
    // limit this step: 4e-6 is reached.
    for (path, bound) in [
        ("rod_contacts.0.friction", 1e-6),
        ("rod_contacts.0.damping", 1e-6),
        ("rod_contacts.0.slip_velocity", 1e-5),
        ("rod_contacts.0.stiffness", 1e-5),
        ("materials.steel.youngs_modulus", 1e-5),
    ] {
        check_motion_derivative(&own, path, times(), end, 1e-5, [1e-10, bound]);
    }
}
