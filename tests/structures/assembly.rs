//! Gradient, tangent and factors of an assembly.

use crate::derivative_checks::{check_derivatives, check_factors};
use crate::scenes::mixed;
use rodfit::Derivatives;
use rodfit::numerics::tangent::Tangent;
use rodfit::rod::Rod;

/// A deformed state of the mixed frame.
fn deformed(q: &[f64]) -> Vec<f64> {
    q.iter().enumerate().map(|(i, q)| q + 2e-3 * (3.7 * i as f64).sin()).collect()
}

/// Oracle: central differences of the energy, and dual numbers of the gradient, along three directions.
#[test]
fn gradient_and_tangent_are_derivatives_of_the_energy() {
    let structure = mixed(8);
    check_derivatives(&structure, &deformed(&structure.at_rest().q), 1e-7, 1e-11, &[]);
}

/// Oracle: the dense matrix of all entries, its LU factors and its eigenvalues.
#[test]
fn factors_solve_and_count_as_the_dense_matrix() {
    let structure = mixed(7);
    let at_rest = structure.at_rest();
    let (assembly, q) = (&at_rest.assembly, deformed(&at_rest.q));
    check_factors(&structure, &q, &[]);
    let n = q.len();
    let (mut gradient, mut tangent) = (vec![0.0; n], assembly.zero_tangent());
    assembly.tangent(&q, &at_rest.frames, Derivatives::Hand, &mut gradient, &mut tangent);
    let b: Vec<f64> = (0..n).map(|i| (0.7 * i as f64).sin()).collect();
    let mut product = vec![0.0; n];
    tangent.product(&b, &mut product);
    let dense = nalgebra::DMatrix::from_fn(n, n, |i, j| tangent.get(i, j));
    let expected = dense * nalgebra::DVector::from_column_slice(&b);
    assert!((0..n).all(|i| (product[i] - expected[i]).abs() < 1e-9 * expected.amax()));
}
