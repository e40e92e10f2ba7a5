//! Center lines of photographs, whose points have no arc lengths: exact data give the exact modulus, and intervals have their
//! nominal coverage.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};
use rodfit::fit::RestShape;
use rodfit::scene::Material;
use rodfit::{Fit, FitReport, Parameter, Point, Problem};

use crate::common::straight_rod;

const MODULUS: f64 = 2e7;
/// Standard deviation of the noise, m.
const NOISE: f64 = 2e-4;
const POINTS: usize = 60;

/// A horizontal clamped rod of 0.4 m under its weight, with this modulus, Pa.
fn rod(modulus: f64) -> Problem {
    let mut scene = straight_rod(60, [0.4, 2e-3], Material::new(1100.0, modulus));
    scene.loads.gravity = [0.0, -9.81, 0.0];
    scene.problem().unwrap()
}

/// Points of the rod at rest with noise, from the wall to the tip, at uneven distances.
fn observed(seed: u64, noise: f64) -> Vec<[Option<f64>; 3]> {
    let problem = rod(MODULUS);
    let rest = problem.equilibrium().unwrap();
    let normal = Normal::new(0.0, noise).unwrap();
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let place = |k: usize| {
        let part = (k as f64 + 0.4 * (k as f64).sin() + 0.5) / POINTS as f64;
        let stencil = problem.stencil(Point::ArcLength(0.4 * part)).unwrap();
        let at = |c: usize| stencil.nodes.iter().map(|(i, w)| w * rest.nodes[*i][c]).sum::<f64>();
        [0, 1].map(|c| Some(at(c) + normal.sample(&mut random)))
    };
    (0..POINTS).map(place).map(|[x, y]| [x, y, None]).collect()
}

/// Fit of the modulus to a center line, from a third of the true value.
fn fitted(points: &[[Option<f64>; 3]], sigma: Option<f64>) -> FitReport {
    let mut line = RestShape::center_line(points);
    line.header.sigma = sigma;
    Fit::new(&rod(MODULUS / 3.0)).observe(line).identify(Parameter::YoungsModulus).solve().unwrap()
}

/// Without noise the modulus is exact: chords are only the first approximation of the arc lengths.
#[test]
fn exact_centerline_gives_exact_modulus() {
    let points = observed(0, 1e-9);
    for order in [points.clone(), points.into_iter().rev().collect()] {
        let report = fitted(&order, Some(1e-6));
        let value = report.parameters[0].value.unwrap();
        // Noise of 1e-9 m: the modulus of the simulation, up to the interpolation between nodes.
        assert!((value / MODULUS - 1.0).abs() < 1e-5, "{value}");
    }
}

/// 95 % intervals contain the true modulus in 95 % of the cases, with a given sigma and with one estimated from the residuals.
/// The unknown arc lengths take one of two degrees of freedom of each point.
#[test]
fn centerline_intervals_have_nominal_coverage() {
    let count = 24;
    for sigma in [Some(NOISE), None] {
        let (mut held, mut squares, mut scatter, mut alarms) = (0, 0.0, 0.0, 0);
        for seed in 1..=count {
            let report = fitted(&observed(seed, NOISE), sigma);
            let modulus = &report.parameters[0];
            let [low, high] = modulus.interval95.unwrap();
            held += u32::from(low < MODULUS && MODULUS < high);
            let error = modulus.std_error.unwrap();
            squares += ((modulus.value.unwrap() - MODULUS) / error).powi(2);
            scatter += (report.sigma[0] / NOISE).powi(2);
            let [tests] = &report.residual_tests[..] else { panic!("{:?}", report.residual_tests) };
            alarms += u32::from(!tests.passed);
        }
        let [chi, scatter] = [squares, scatter].map(|sum| (sum / count as f64).sqrt());
        println!("{sigma:?}: {held} of {count}, errors over theirs {chi:.3}, sigma {scatter:.3}");
        // One in 100 has a root mean square beyond 1.39, or fewer than 20 of 24.
        assert!(held >= 20 && chi < 1.39 && chi > 0.66, "{held} of {count}, {chi}");
        assert_eq!(alarms, 0, "noise along the normal is called a misfit");
        assert!((scatter - 1.0).abs() < 0.07, "{scatter}");
    }
}
