//! The cantilever of Huang & Jawed (2019): published figures against independent values, the misprint of Eq. (6a), and the
//! limit of small segments.

use rodfit::energy::Derivatives;
use rodfit::numerics::banded::{BandMatrix, Ldlt};
use rodfit::numerics::tangent::Factors;
use rodfit::rod::Rod;
use rodfit::scene::{Clamp, Time};

use crate::common::{cantilever, cantilever_with, extremum, planar, sag, simulate};

/// First maximum and minimum of the sag, nodes clamped as in the paper: independent values to 1e-6.
#[test]
fn first_maximum_and_minimum_of_the_released_cantilever() {
    for (beta, step, maximum, minimum) in [
        (1.0, 5e-3, 0.506426, 0.043219),
        (1.0, 1e-3, 0.522206, 0.007194),
        (0.75, 5e-3, 0.515853, 0.020912),
        (0.5, 1e-3, 0.526851, -0.001696),
        (0.5, 1e-4, 0.526885, -0.001649),
    ] {
        let scene = cantilever_with(beta, step, 0.8, Clamp::Nodes);
        let trajectory = simulate(&scene);
        let (times, sag) = (trajectory.times(), sag(&trajectory));
        let high = extremum(times, &sag, [0.15, 0.45], 1.0);
        let low = extremum(times, &sag, [0.45, 0.75], -1.0);
        println!("beta {beta}, step {step}: maximum {high:.6}, minimum {low:.6}");
        // Independent values, given to six digits.
        assert!((high - maximum).abs() < 1e-6, "beta {beta}, step {step}: {high}");
        assert!((low - minimum).abs() < 1e-6, "beta {beta}, step {step}: {low}");
    }
}

/// "At h = 5 ms, the amplitude reduces to one-third of the initial amplitude within 5 s."
#[test]
fn dissipation_of_implicit_euler_equals_the_published_one() {
    let scene = cantilever_with(1.0, 5e-3, 5.0, Clamp::Nodes);
    let trajectory = simulate(&scene);
    let (times, sag) = (trajectory.times(), sag(&trajectory));
    let first = extremum(times, &sag, [0.15, 0.45], 1.0);
    let last = sag.iter().zip(times).filter(|(_, t)| **t > 5.0 - 0.62).map(|(s, _)| *s);
    let (high, low) = last.fold((f64::MIN, f64::MAX), |(h, l), s| (h.max(s), l.min(s)));
    let ratio = (high - low) / first;
    println!("last peak-to-peak over first peak {ratio:.4}");
    // Near the published third; 0.284 is the value of this mesh and step.
    assert!((ratio - 0.284).abs() < 5e-4, "{ratio}");
}

/// Sag over length at the final state of a strongly damped rod. With large `h` and beta = 1, a step is nearly a Newton solution
/// of the equilibrium.
fn static_sag(segments: usize, clamp: Clamp) -> f64 {
    let mut scene = cantilever();
    scene.rod.segments = Some(segments);
    scene.supports.clamp = clamp;
    scene.loads.damping.mass = 20.0;
    scene.time = Some(Time { beta: 1.0, ..Time::new(40.0, 0.05) });
    let trajectory = simulate(&scene);
    let sag = sag(&trajectory);
    let last = sag.len() - 1;
    // The motion has come to rest.
    assert!((sag[last] - sag[last - 1]).abs() < 1e-13, "at rest");
    sag[last]
}

/// Independent values at 51 nodes, and the continuum limit 0.29061133785: second order with the
/// wall at the middle of the first edge, first order with the wall at the nodes.
#[test]
fn static_sag_and_its_order_in_the_segment_length() {
    let mid = [50, 100, 200].map(|n| static_sag(n, Clamp::MidEdge));
    let nodes = [50, 100, 200].map(|n| static_sag(n, Clamp::Nodes));
    println!("static sag: mid-edge {mid:.8?}, nodes {nodes:.8?}");
    // Independent values at 51 nodes.
    assert!((mid[0] - 0.29052485).abs() < 1e-8, "{}", mid[0]);
    assert!((nodes[0] - 0.28014829).abs() < 1e-8, "{}", nodes[0]);
    let order = |s: [f64; 3]| {
        let error = s.map(|s| (s - 0.29061133785).abs());
        [(error[0] / error[1]).log2(), (error[1] / error[2]).log2()]
    };
    let (second, first) = (order(mid), order(nodes));
    println!("orders: mid-edge {second:.3?}, nodes {first:.3?}");
    // Second order with the wall in the middle of an edge.
    assert!(second.iter().all(|p| (p - 2.0).abs() < 0.05), "{second:?}");
    // First order with the wall at nodes.
    assert!(first.iter().all(|p| (p - 1.0).abs() < 0.05), "{first:?}");
}

/// Amplification matrix of one step on an oscillator of frequency w, with force factors `end` and
/// `start` (times h^2).
fn amplification(beta: f64, hw: f64, end: f64, start: f64) -> [[f64; 2]; 2] {
    // (1 + end hw^2) q1 = (1 - start hw^2) q0 + h v0, with h v as the second unknown.
    let w2 = hw * hw;
    let by = 1.0 / (1.0 + end * w2);
    let (qq, qv) = ((1.0 - start * w2) * by, by);
    [[qq, qv], [(qq - 1.0) / beta, qv / beta - (1.0 - beta) / beta]]
}

fn determinant([[a, b], [c, d]]: [[f64; 2]; 2]) -> f64 {
    a * d - b * c
}

/// The printed Eq. (6a) neither dissipates at any beta nor agrees with "at beta = 1 it reduces to
/// Eq. (4)"; the corrected form dissipates above 1/2 and is neutral at 1/2.
#[test]
fn published_scheme_does_not_dissipate() {
    for beta in [0.5, 0.6, 0.75, 0.9, 1.0] {
        for hw in [0.01, 0.3, 1.0, 2.5, 30.0] {
            let printed = amplification(beta, hw, beta * (1.0 - beta), beta * beta);
            // The determinant of the amplification matrix is 1: no dissipation.
            assert!((determinant(printed) - 1.0).abs() < 1e-12, "beta {beta}, hw {hw}");
            let corrected = amplification(beta, hw, beta * beta, beta * (1.0 - beta));
            let d = determinant(corrected);
            // Neutral at 1/2, dissipative above.
            assert!(if beta == 0.5 { (d - 1.0).abs() < 1e-12 } else { d < 1.0 }, "{beta} {hw} {d}");
        }
    }
}

/// A step of `M dq - h M v + end n1 + start n0 = 0`, solved here with the library's rod and band
/// solver; `None` when Newton fails.
struct ByHand {
    problem: rodfit::Problem,
    q: Vec<f64>,
    v: Vec<f64>,
    h: f64,
    beta: f64,
    end: f64,
    start: f64,
}

impl ByHand {
    /// The rod at its rest shape, with a step `h`, s, and the weights of the forces at the end and at the start of a step.
    fn new(beta: f64, h: f64, [end, start]: [f64; 2]) -> Self {
        let problem = cantilever_with(0.5, h, 1.0, Clamp::Nodes).problem().unwrap();
        let q = planar(&problem).rest();
        Self { v: vec![0.0; q.len()], problem, q, h, beta, end, start }
    }

    fn step(&mut self) -> Option<()> {
        let (rod, free) = (planar(&self.problem).rod(), planar(&self.problem).free());
        let n = self.q.len();
        let (mut n0, mut n1) = (vec![0.0; n], vec![0.0; n]);
        let mut tangent = BandMatrix::zeros(n);
        let mut factors = Ldlt::with_order(n);
        rod.gradient(&self.q, &(), Derivatives::Hand, &mut n0);
        let mut q1: Vec<f64> = self.q.iter().zip(&self.v).map(|(q, v)| q + self.h * v).collect();
        for iteration in 0.. {
            rod.tangent(&q1, &(), Derivatives::Hand, &mut n1, &mut tangent);
            let mut dx: Vec<f64> = (0..n)
                .map(|i| {
                    let inertia = rod.mass[i] * (q1[i] - self.q[i] - self.h * self.v[i]);
                    -(inertia + self.end * n1[i] + self.start * n0[i])
                })
                .collect();
            factors.factor_sum(&rod.mass, 1.0, &tangent, self.end, free.clone()).ok()?;
            factors.solve(&mut dx);
            q1.iter_mut().zip(&dx).for_each(|(q, d)| *q += d);
            let largest = dx.iter().fold(0.0_f64, |m, d| m.max(d.abs()));
            if !largest.is_finite() || iteration == 40 {
                return None;
            }
            if largest < 1e-13 {
                break;
            }
        }
        for i in 0..n {
            let dq = q1[i] - self.q[i];
            self.v[i] = dq / (self.h * self.beta) - (1.0 - self.beta) / self.beta * self.v[i];
        }
        self.q = q1;
        Some(())
    }
}

/// beta = 1 against Eq. (4) written down on its own.
#[test]
fn beta_one_is_implicit_euler() {
    let h = 5e-3;
    let mut euler = ByHand::new(1.0, h, [h * h, 0.0]);
    let problem = cantilever_with(1.0, h, 1.0, Clamp::Nodes).problem().unwrap();
    let mut simulation = planar(&problem).simulation().unwrap();
    for k in 1..=100 {
        euler.step().unwrap();
        simulation.step_to(k as f64 * h).unwrap();
        let state = simulation.state();
        let difference =
            state.q.iter().zip(&euler.q).fold(0.0_f64, |m, (a, b)| m.max((a - b).abs()));
        // Implicit Euler, solved here: tolerance of Newton's method.
        assert!(difference < 1e-12, "step {k}: {difference:e}");
    }
}

/// On the cantilever the printed form blows up at the paper's steps where the corrected one runs.
#[test]
fn published_scheme_is_unstable_on_the_cantilever() {
    for (beta, h) in [(0.75, 5e-3), (0.75, 1e-3), (0.9, 5e-3)] {
        let h2 = h * h;
        let mut printed = ByHand::new(beta, h, [h2 * beta * (1.0 - beta), h2 * beta * beta]);
        let mut corrected = ByHand::new(beta, h, [h2 * beta * beta, h2 * beta * (1.0 - beta)]);
        let steps = (0.5 / h) as usize;
        let speed = |s: &ByHand| s.v.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
        let exploded = (0..steps).any(|_| printed.step().is_none() || speed(&printed) > 100.0);
        assert!(exploded, "beta {beta}, step {h}: fastest node {} m/s", speed(&printed));
        // The corrected form remains at plausible velocities, m/s.
        assert!((0..steps).all(|_| corrected.step().is_some()) && speed(&corrected) < 10.0);
    }
}
