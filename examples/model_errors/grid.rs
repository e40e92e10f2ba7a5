//! Gauss-Legendre quadrature on panels of an interval, and cumulative integrals at its nodes.
//!
//! The integrand is interpolated at the `N` nodes of each panel by Legendre polynomials, with coefficients
//! `a_n = (2n + 1)/2 sum_j w_j P_n(x_j) f_j`, and `int_-1^x P_n = (P_{n+1}(x) - P_{n-1}(x))/(2n + 1)`.
//! A jump of the integrand between two panels costs no accuracy.

use nalgebra::DMatrix;

/// Newton iterations for a node: far more than the quadratic convergence from the usual initial guess needs.
const NEWTON_ITERATIONS: usize = 20;

/// Nodes and weights of a quadrature on `[0, end]`, with cumulative integrals.
pub struct Grid {
    pub nodes: Vec<f64>,
    pub weights: Vec<f64>,
    /// Row `i` holds the weights of the integral from 0 to node `i`; the last row those up to the end.
    pub cumulative: DMatrix<f64>,
}

/// Legendre polynomials `P_0 .. P_{count - 1}` at `x`.
pub fn legendre(count: usize, x: f64) -> Vec<f64> {
    let mut values = vec![1.0, x];
    for n in 1..count.saturating_sub(1) {
        let degree = n as f64;
        let next = ((2.0 * degree + 1.0) * x * values[n] - degree * values[n - 1]) / (degree + 1.0);
        values.push(next);
    }
    values.truncate(count);
    values
}

/// Nodes and weights of the Gauss-Legendre rule on `[-1, 1]`.
fn gauss_legendre(count: usize) -> Vec<(f64, f64)> {
    let n = count as f64;
    let node = |i: usize| {
        let mut x = -(std::f64::consts::PI * (i as f64 + 0.75) / (n + 0.5)).cos();
        let derivative = |x: f64| {
            let values = legendre(count + 1, x);
            (values[count], n * (x * values[count] - values[count - 1]) / (x * x - 1.0))
        };
        for _ in 0..NEWTON_ITERATIONS {
            let (value, slope) = derivative(x);
            x -= value / slope;
        }
        let (_, slope) = derivative(x);
        (x, 2.0 / ((1.0 - x * x) * slope * slope))
    };
    (0..count).map(node).collect()
}

impl Grid {
    /// `count` nodes on each panel between two neighboring `bounds`; the first bound is 0.
    pub fn new(bounds: &[f64], count: usize) -> Self {
        let rule = gauss_legendre(count);
        let total = count * (bounds.len() - 1);
        let (mut nodes, mut weights) = (Vec::new(), Vec::new());
        let mut cumulative = DMatrix::zeros(total + 1, total);
        for (panel, ends) in bounds.windows(2).enumerate() {
            let half = 0.5 * (ends[1] - ends[0]);
            let first = panel * count;
            for (i, (x, weight)) in rule.iter().enumerate() {
                let row = first + i;
                for (j, earlier) in weights.iter().enumerate().take(first) {
                    cumulative[(row, j)] = *earlier;
                }
                // Within the panel: the integral of the interpolating polynomial up to node `x`.
                let upper = legendre(count + 1, *x);
                for (j, (y, weight_j)) in rule.iter().enumerate() {
                    let lower = legendre(count, *y);
                    let term = |n: usize| {
                        let before = if n == 0 { -1.0 } else { upper[n - 1] };
                        0.5 * weight_j * lower[n] * (upper[n + 1] - before)
                    };
                    cumulative[(row, first + j)] = half * (0..count).map(term).sum::<f64>();
                }
                nodes.push(ends[0] + half * (1.0 + x));
                weights.push(half * weight);
            }
        }
        for (j, weight) in weights.iter().enumerate() {
            cumulative[(total, j)] = *weight;
        }
        Self { nodes, weights, cumulative }
    }
}
