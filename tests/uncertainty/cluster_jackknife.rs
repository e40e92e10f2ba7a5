//! Jackknife over experiments, for a model with an omitted effect that differs between them: intervals cover the truth.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;
use rodfit::fit::{Experiment, Glitches};
use rodfit::{Fit, FitReport, Observation, Parameter, Unknown};

use crate::common::coarse;
use crate::common::fits::{noisy, observe, same_mesh, value};
use crate::common::recordings::{MODULUS, cable, recorded};

const SIGMA: f64 = 1e-5;
const TRUTH: f64 = MODULUS;
/// Standard deviation of the logarithm of the density between recordings.
const OTHER: f64 = 0.08;

/// A fit to 8 recordings of cables with different densities.
fn fit(number: u64) -> FitReport {
    let mut random = ChaCha8Rng::seed_from_u64(number);
    let mut experiments = Vec::new();
    for k in 0..8 {
        let draw: f64 = StandardNormal.sample(&mut random);
        let track = recorded(100 * number + k, 40, SIGMA, |scene| {
            scene.material.density *= (OTHER * draw).exp();
        });
        let problem = cable(track).problem().unwrap();
        let free = Observation::of_free_markers(&problem, 3, Glitches::Keep).unwrap();
        let observe = |e: Experiment, o: Observation| e.observe(o.sigma(SIGMA));
        experiments.push(free.into_iter().fold(Experiment::new(format!("{k}"), &problem), observe));
    }
    Fit::of(experiments)
        .analyse(same_mesh())
        .identify(Unknown::new(Parameter::YoungsModulus).start(TRUTH))
        .solve()
        .unwrap()
}

#[test]
fn intervals_cover_where_experiments_differ() {
    let count = 100;
    let covers: Vec<[bool; 2]> = (0..count)
        .into_par_iter()
        .map(|number| {
            let report = fit(number);
            let estimate = report.estimate(Parameter::YoungsModulus).unwrap();
            let across = estimate.cluster_jackknife.as_ref().unwrap_or_else(|| panic!("{report}"));
            assert_eq!(across.experiments, 8);
            if across.reported {
                assert_eq!(estimate.interval95, Some(across.interval95));
                let text = report.to_string();
                let words = text.split_whitespace().collect::<Vec<_>>().join(" ");
                assert!(words.contains("from the differences between 8 experiments"), "{report}");
            }
            let holds = |[low, high]: [f64; 2]| low <= TRUTH && TRUTH <= high;
            [holds(across.residual_interval95), holds(across.interval95)]
        })
        .collect();
    let part = |i: usize| covers.iter().filter(|c| c[i]).count() as f64 / count as f64;
    println!("95 % intervals cover: residuals {:.3}, experiments {:.3}", part(0), part(1));
    // 95 % of 100 campaigns within three standard errors of the count; residuals alone cover far
    // fewer.
    assert!(part(0) < 0.7, "{}", part(0));
    assert!((0.90..=0.98).contains(&part(1)), "{}", part(1));
}

/// Of five strips whose moduli differ by up to 0.7 %, the linearized estimate of each strip is that of a fit to its data alone.
#[test]
fn estimate_of_each_experiment_equals_its_separate_fit() {
    let scene = coarse(12, 4e-3, 0.8);
    let problem = scene.problem().unwrap();
    let recording = |k: usize, factor: f64| {
        let mut other = scene.clone();
        other.material.youngs_modulus *= factor;
        noisy(&observe(&other, 80), 1e-4, k as u64).sigma(1e-4)
    };
    let factors = [1.004, 0.994, 1.002, 1.007, 0.996];
    let data: Vec<Observation> =
        factors.iter().enumerate().map(|(k, factor)| recording(k, *factor)).collect();
    let solve = |fit: Fit| {
        let unknown = Unknown::new(Parameter::YoungsModulus).start(scene.material.youngs_modulus);
        fit.analyse(same_mesh()).identify(unknown).solve().unwrap()
    };
    let experiment = |(k, data): (usize, &Observation)| {
        Experiment::new(format!("strip {k}"), &problem).observe(data.clone())
    };
    let common = solve(Fit::of(data.iter().enumerate().map(experiment)));
    let jackknife = common.parameters[0].cluster_jackknife.as_ref().unwrap();
    assert!(jackknife.reported && jackknife.estimates.len() == 5, "{common}");
    for ((own, data), factor) in jackknife.estimates.iter().zip(&data).zip(factors) {
        let alone =
            value(&solve(Fit::new(&problem).observe(data.clone())), Parameter::YoungsModulus);
        println!("{}: {:.6e}, alone {alone:.6e}", own.experiment, own.value);
        // One step over at most 0.7 % leaves an error of second order, (7e-3)^2 times a constant near 10.
        assert!((own.value / alone - 1.0).abs() < 5e-4, "{factor}: {} {alone}", own.value);
    }
    assert!(common.to_string().contains("Estimates by each experiment alone"), "{common}");
}
