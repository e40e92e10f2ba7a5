//! Checks of assemblies of rods in the plane and in space: derivatives, factors, and residuals of fits.

use nalgebra::{DMatrix, DVector};
use num_dual::Dual64;
use rodfit::fit::Residuals;
use rodfit::numerics::tangent::{Factors, Tangent};
use rodfit::rod::Rod;
use rodfit::{Derivatives, Structure};

/// Compares gradient and tangent at the unknowns `q` with central differences of the energy in steps of `h`, and with the
/// gradient in dual numbers, along three directions. Entries of the product with the tangent are exact to a part `exact` of the
/// largest. `ignored` unknowns have no effect, and no product.
pub fn check_derivatives(structure: &Structure, q: &[f64], h: f64, exact: f64, ignored: &[usize]) {
    let at_rest = structure.at_rest();
    let (assembly, frames) = (&at_rest.assembly, &at_rest.frames);
    let n = q.len();
    let (mut gradient, mut alone) = (vec![0.0; n], vec![0.0; n]);
    let mut tangent = assembly.zero_tangent();
    assembly.tangent(q, frames, Derivatives::Hand, &mut gradient, &mut tangent);
    assembly.gradient(q, frames, Derivatives::Hand, &mut alone);
    let size = gradient.iter().fold(0.0_f64, |size, g| size.max(g.abs()));
    assert!(gradient.iter().zip(&alone).all(|(a, b)| (a - b).abs() < 1e-12 * size));
    let dual = structure.at_rest_over(|_, value, _| Dual64::from(value)).unwrap();
    let tied: Vec<usize> = assembly.unknowns_without_effect().collect();
    for seed in 1..=3 {
        let mut x: Vec<f64> = (0..n).map(|i| (1.3 * (seed * i) as f64).cos()).collect();
        tied.iter().for_each(|i| x[*i] = 0.0);
        let moved = |h: f64| q.iter().zip(&x).map(|(q, x)| q + h * x).collect::<Vec<f64>>();
        let energy = |h: f64| assembly.energies(&moved(h), frames).total();
        let slope: f64 = gradient.iter().zip(&x).map(|(g, x)| g * x).sum();
        let difference = (energy(h) - energy(-h)) / (2.0 * h);
        println!("{slope} {difference}");
        assert!((slope - difference).abs() < 1e-5 * slope.abs().max(1.0), "{slope} {difference}");
        let moved: Vec<Dual64> = q.iter().zip(&x).map(|(q, x)| Dual64::new(*q, *x)).collect();
        let mut rates = vec![Dual64::from(0.0); n];
        dual.assembly.gradient(&moved, &dual.frames, Derivatives::Hand, &mut rates);
        let mut product = vec![0.0; n];
        tangent.product(&x, &mut product);
        ignored.iter().for_each(|i| product[*i] = 0.0);
        let size = product.iter().fold(0.0_f64, |size, p| size.max(p.abs()));
        for (i, (rate, product)) in rates.iter().zip(&product).enumerate() {
            assert!((rate.eps - product).abs() < exact * size, "{i}: {} {product}", rate.eps);
        }
    }
}

/// Compares factors of the tangent at the unknowns `q` plus a multiple of the masses with the sum as a dense matrix: residuals of
/// solutions, and the number of negative pivots with that of negative eigenvalues. The multiple is positive, zero or negative.
/// `ignored` unknowns have no effect.
pub fn check_factors(structure: &Structure, q: &[f64], ignored: &[usize]) {
    let at_rest = structure.at_rest();
    let (assembly, n) = (&at_rest.assembly, q.len());
    let (mut gradient, mut tangent) = (vec![0.0; n], assembly.zero_tangent());
    assembly.tangent(q, &at_rest.frames, Derivatives::Hand, &mut gradient, &mut tangent);
    let b: Vec<f64> = (0..n).map(|i| (0.7 * i as f64).sin()).collect();
    let free: Vec<usize> = (0..n).filter(|i| !ignored.contains(i)).collect();
    let mut factors = tangent.new_factors();
    for shift in [1e6, 0.0, -2e5] {
        let dense = DMatrix::from_fn(n, n, |i, j| {
            tangent.get(i, j) + if i == j { shift * assembly.mass()[i] } else { 0.0 }
        });
        factors.factor_sum(assembly.mass(), shift, &tangent, 1.0, 0..n).unwrap();
        let mut x = b.clone();
        factors.solve(&mut x);
        let residual = &dense * DVector::from_column_slice(&x) - DVector::from_column_slice(&b);
        let size = dense.amax() * x.iter().fold(0.0_f64, |size, x| size.max(x.abs()));
        for i in &free {
            assert!(residual[*i].abs() < 1e-11 * size, "{shift} {i}: {:e} {size:e}", residual[*i]);
        }
        let own = DMatrix::from_fn(free.len(), free.len(), |i, j| dense[(free[i], free[j])]);
        let negative = own.symmetric_eigenvalues().iter().filter(|l| **l < 0.0).count();
        let mut mass = assembly.mass().to_vec();
        ignored.iter().for_each(|i| mass[*i] = 0.0);
        factors.factor_sum(&mass, shift, &tangent, 1.0, 0..n).unwrap();
        assert_eq!(factors.negative_pivots(), negative, "{shift}");
    }
}

/// The value of the number of a path, and the placed unknowns of a simulation in dual numbers that are seeded by it, after these
/// times, s.
pub fn dual_run(
    structure: &Structure,
    path: &str,
    times: impl Iterator<Item = f64>,
) -> (f64, Vec<Dual64>) {
    let mut value = f64::NAN;
    let seed = |own: &str, x: f64, _| {
        if own == path {
            value = x;
        }
        Dual64::new(x, f64::from(own == path))
    };
    let mut dual = structure.simulation_over(seed).unwrap();
    times.for_each(|time| dual.step_to(time).unwrap());
    let mut q = dual.state().q.clone();
    dual.rod().place_carried(&mut q, &dual.state().frames);
    (value, q)
}

/// The structure with the number of a path changed by `h`.
pub fn shifted(structure: &Structure, path: &str, h: f64) -> Structure {
    let scene = structure.scene().map_numbers(|own, x, _| if own == path { x + h } else { x });
    Structure::new(scene).unwrap()
}

/// Compares the derivative of a motion by the number of a path, of a run in dual numbers over these times, s, with central
/// differences in steps of `step` times the number. `end` returns the unknowns of the rods at the end of a run in plain
/// numbers. Both runs agree to the first bound, m, and the derivatives to the second one, relative to the largest.
pub fn check_motion_derivative(
    structure: &Structure,
    path: &str,
    times: impl Iterator<Item = f64>,
    end: impl Fn(&Structure) -> Vec<f64>,
    step: f64,
    [largest_distance, largest_error]: [f64; 2],
) {
    let (value, q) = dual_run(structure, path, times);
    let plain = end(structure);
    let h = step * value.abs();
    let [plus, minus] = [h, -h].map(|h| end(&shifted(structure, path, h)));
    let (mut size, mut apart, mut off) = (0.0_f64, 0.0_f64, 0.0_f64);
    for (i, plain) in plain.iter().enumerate() {
        size = size.max(q[i].eps.abs());
        apart = apart.max((q[i].re - plain).abs());
        off = off.max((q[i].eps - (plus[i] - minus[i]) / (2.0 * h)).abs());
    }
    println!("{path}: off by {:.1e} of {size:.2e}, positions by {apart:.1e} m", off / size);
    assert!(size > 0.0 && apart < largest_distance, "{path}: {apart:e}");
    assert!(off < largest_error * size, "{path}: {off:e} of {size:e}");
}

/// Compares the exact Jacobian of residuals at `x` with central differences in these steps, relative to the largest entry of each
/// column.
pub fn check_jacobian(residuals: &Residuals, x: &[f64], step: f64, bound: f64) {
    let exact = residuals.jacobian_at(x).unwrap();
    for j in 0..x.len() {
        let at = |step: f64| {
            let mut x = x.to_vec();
            x[j] += step;
            residuals.residuals(&x).unwrap()
        };
        let [above, below] = [at(step), at(-step)];
        let largest = exact.iter().map(|row| row[j].abs()).fold(0.0, f64::max);
        for (i, row) in exact.iter().enumerate() {
            let error = (row[j] - (above[i] - below[i]) / (2.0 * step)).abs() / largest;
            assert!(error < bound, "{} of row {i}: {error:e}", residuals.unknowns()[j]);
        }
    }
}
