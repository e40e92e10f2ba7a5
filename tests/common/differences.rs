//! Derivatives by seven-point finite differences, and checks of assembled gradients and tangents against them.

use rodfit::numerics::tangent::Tangent;
use rodfit::rod::Rod;
use rodfit::{Derivatives, Parameter, Problem, Trajectory};

/// The seven-point difference of a quantity by a parameter, in steps of `h`.
pub fn difference(
    problem: &Problem,
    parameter: Parameter,
    h: f64,
    quantity: impl Fn(&Problem) -> Vec<f64>,
) -> Vec<f64> {
    let value = parameter.of(problem.scene()).unwrap();
    let at = |k: f64| quantity(&problem.with([(parameter, value + k * h)]).unwrap());
    let side = |k: f64| -> Vec<f64> {
        at(k).iter().zip(at(-k)).map(|(above, below)| above - below).collect()
    };
    let [a, b, c] = [1.0, 2.0, 3.0].map(side);
    (0..a.len()).map(|i| (45.0 * a[i] - 9.0 * b[i] + c[i]) / (60.0 * h)).collect()
}

/// The largest absolute value of a list.
pub fn largest(x: &[f64]) -> f64 {
    x.iter().fold(0.0, |most, x| most.max(x.abs()))
}

/// The largest difference of two lists.
pub fn apart(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

/// All nodes at rest, with derivatives.
pub fn at_rest(problem: &Problem, parameters: &[Parameter]) -> Trajectory {
    let all: Vec<usize> = (0..problem.nodes()).collect();
    Trajectory::at_rest(problem, &all, parameters).unwrap()
}

/// The largest error of the derivatives of all nodes at rest by a parameter against differences in steps of `h`, and the
/// largest derivative.
pub fn mismatch_at_rest(problem: &Problem, parameter: Parameter, h: f64) -> [f64; 2] {
    let positions = |problem: &Problem| -> Vec<f64> {
        let run = at_rest(problem, &[]);
        (0..problem.nodes()).flat_map(|i| run.node(i, 0)).collect()
    };
    let (_, _, derivatives) = at_rest(problem, &[parameter]).into_parts();
    let exact: Vec<f64> = derivatives[0].iter().flat_map(|[place, _]| *place).collect();
    [apart(&exact, &difference(problem, parameter, h, positions)), largest(&exact)]
}

/// Every element counts once in the assembled rod: gradient and tangent by both routes, the gradient
/// alone against the one that comes with the tangent, and both against differences in steps of `h`.
pub fn assembled<R: Rod<f64>>(rod: &R, q: &[f64], frames: &R::Frames, h: f64) {
    let n = q.len();
    let mut results = Vec::new();
    for route in [Derivatives::Hand, Derivatives::Dual] {
        let (mut alone, mut gradient) = (vec![0.0; n], vec![0.0; n]);
        let mut tangent = rod.zero_tangent();
        rod.gradient(q, frames, route, &mut alone);
        // A second assembly must not see the first.
        let elsewhere: Vec<f64> = q.iter().map(|x| 1.3 * x).collect();
        rod.tangent(&elsewhere, frames, route, &mut gradient, &mut tangent);
        rod.tangent(q, frames, route, &mut gradient, &mut tangent);
        for (a, b) in alone.iter().zip(&gradient) {
            // The gradient alone and with the tangent have the same terms: rounding errors.
            assert!((a - b).abs() < 1e-11, "{a} {b}");
        }
        results.push((gradient, tangent));
    }
    let [(hand, k_hand), (dual, k_dual)] = &results[..] else { unreachable!() };
    for i in 0..n {
        // Both derivatives are exact: rounding errors.
        assert!((hand[i] - dual[i]).abs() < 1e-10, "{i}: {} {}", hand[i], dual[i]);
        for j in k_hand.coupled(i, i + 1) {
            let (a, b) = (k_hand.get(i, j), k_dual.get(i, j));
            let size = (k_hand.get(i, i) * k_hand.get(j, j)).sqrt();
            // As above, relative to the diagonal.
            assert!((a - b).abs() < 1e-10 * size, "{i} {j}: {a} {b}");
        }
    }
    // Directional difference of the energy and of the gradient.
    let direction: Vec<f64> = (0..n).map(|i| ((i * i) as f64).sin()).collect();
    let shifted = |s: f64| q.iter().zip(&direction).map(|(q, d)| q + s * d).collect::<Vec<f64>>();
    let energy = |s: f64| rod.energies(&shifted(s), frames).total();
    let slope = (energy(h) - energy(-h)) / (2.0 * h);
    let exact: f64 = hand.iter().zip(&direction).map(|(g, d)| g * d).sum();
    // Central differences have errors of second order in `h`, and rounding errors.
    assert!((slope / exact - 1.0).abs() < 1e-6, "{slope} {exact}");
    let gradient = |s: f64| {
        let mut gradient = vec![0.0; n];
        rod.gradient(&shifted(s), frames, Derivatives::Hand, &mut gradient);
        gradient
    };
    let (ahead, behind) = (gradient(h), gradient(-h));
    for i in 0..n {
        let exact: f64 = (0..n).map(|j| k_hand.get(i, j) * direction[j]).sum();
        let difference = (ahead[i] - behind[i]) / (2.0 * h);
        // As above, for the tangent.
        assert!((difference - exact).abs() < 1e-6 * k_hand.get(i, i), "{i}: {difference} {exact}");
    }
}
