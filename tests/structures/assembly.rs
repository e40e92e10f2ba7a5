//! Gradient, tangent and factors of an assembly.

use crate::scenes::mixed;
use num_dual::Dual64;
use rodfit::Derivatives;
use rodfit::numerics::tangent::{Factors, Tangent};
use rodfit::rod::Rod;

/// A deformed state of the mixed frame.
fn deformed(q: &[f64]) -> Vec<f64> {
    q.iter().enumerate().map(|(i, q)| q + 2e-3 * (3.7 * i as f64).sin()).collect()
}

/// Oracle: central differences of the energy, and dual numbers of the gradient, along three directions.
#[test]
fn gradient_and_tangent_are_derivatives_of_the_energy() {
    let structure = mixed(8);
    let at_rest = structure.at_rest();
    let (assembly, q) = (&at_rest.assembly, deformed(&at_rest.q));
    let n = q.len();
    let (mut gradient, mut alone) = (vec![0.0; n], vec![0.0; n]);
    let mut tangent = assembly.zero_tangent();
    assembly.tangent(&q, &at_rest.frames, Derivatives::Hand, &mut gradient, &mut tangent);
    assembly.gradient(&q, &at_rest.frames, Derivatives::Hand, &mut alone);
    let size = gradient.iter().fold(0.0_f64, |size, g| size.max(g.abs()));
    assert!(gradient.iter().zip(&alone).all(|(a, b)| (a - b).abs() < 1e-12 * size));
    let dual = structure.at_rest_over(|_, value, _| Dual64::from(value)).unwrap();
    let (dual, dual_frames) = (dual.assembly, dual.frames);
    let tied: Vec<usize> = assembly.unknowns_without_effect().collect();
    for seed in 1..=3 {
        let mut x: Vec<f64> = (0..n).map(|i| (1.3 * (seed * i) as f64).cos()).collect();
        tied.iter().for_each(|i| x[*i] = 0.0);
        let moved = |h: f64| q.iter().zip(&x).map(|(q, x)| q + h * x).collect::<Vec<f64>>();
        let energy = |h: f64| assembly.energies(&moved(h), &at_rest.frames).total();
        let h = 1e-7;
        let slope: f64 = gradient.iter().zip(&x).map(|(g, x)| g * x).sum();
        let difference = (energy(h) - energy(-h)) / (2.0 * h);
        assert!((slope - difference).abs() < 1e-5 * slope.abs().max(1.0), "{slope} {difference}");
        let moved: Vec<Dual64> = q.iter().zip(&x).map(|(q, x)| Dual64::new(*q, *x)).collect();
        let mut rates = vec![Dual64::from(0.0); n];
        dual.gradient(&moved, &dual_frames, Derivatives::Hand, &mut rates);
        let mut product = vec![0.0; n];
        tangent.product(&x, &mut product);
        let size = product.iter().fold(0.0_f64, |size, p| size.max(p.abs()));
        for (i, (rate, product)) in rates.iter().zip(&product).enumerate() {
            assert!((rate.eps - product).abs() < 1e-11 * size, "{i}: {} {product}", rate.eps);
        }
    }
}

/// Oracle: the dense matrix of all entries, its LU factors and its eigenvalues.
#[test]
fn factors_solve_and_count_as_the_dense_matrix() {
    let structure = mixed(7);
    let at_rest = structure.at_rest();
    let (assembly, q) = (&at_rest.assembly, deformed(&at_rest.q));
    let n = q.len();
    let (mut gradient, mut tangent) = (vec![0.0; n], assembly.zero_tangent());
    assembly.tangent(&q, &at_rest.frames, Derivatives::Hand, &mut gradient, &mut tangent);
    let b: Vec<f64> = (0..n).map(|i| (0.7 * i as f64).sin()).collect();
    let mut factors = tangent.new_factors();
    for shift in [1e6, 0.0, -2e5] {
        let dense = nalgebra::DMatrix::from_fn(n, n, |i, j| {
            tangent.get(i, j) + if i == j { shift * assembly.mass()[i] } else { 0.0 }
        });
        factors.factor_sum(assembly.mass(), shift, &tangent, 1.0, 0..n).unwrap();
        let mut x = b.clone();
        factors.solve(&mut x);
        let right = nalgebra::DVector::from_column_slice(&b);
        let residual = &dense * nalgebra::DVector::from_column_slice(&x) - right;
        let size = dense.amax() * x.iter().fold(0.0_f64, |size, x| size.max(x.abs()));
        assert!(residual.amax() < 1e-11 * size, "{shift}: {:e} {size:e}", residual.amax());
        let negative = dense.clone().symmetric_eigenvalues().iter().filter(|l| **l < 0.0).count();
        assert_eq!(factors.negative_pivots(), negative, "{shift}");
        let mut product = vec![0.0; n];
        tangent.product(&b, &mut product);
        let expected = (dense
            - nalgebra::DMatrix::from_diagonal(&nalgebra::DVector::from_iterator(
                n,
                assembly.mass().iter().map(|mass| shift * mass),
            )))
            * nalgebra::DVector::from_column_slice(&b);
        assert!((0..n).all(|i| (product[i] - expected[i]).abs() < 1e-9 * expected.amax()));
    }
}
