//! Detection of omitted effects: ten terms that a fitted scene lacks, each of the size that biases Young's modulus by two
//! standard errors, with several realizations of noise, in laboratories that record more or less of the motion.
//!
//! A term is detectable if it contributes at least three standard deviations to the residuals, by the Jacobian of the right
//! model. A detectable term must be ranked first or second by the score tests. Others must be listed as undetected bias,
//! with an effect on the modulus that is right to 20 %. Terms that the data do not distinguish share a rank. Therefore the
//! table counts the first two terms and the first two ranks, with the number of terms of these ranks, then the terms under
//! undetected bias, and the correct results.
//!
//! `cargo run --release --example wrong_models -- [NOISES] [FIRST SEED] [LABORATORY]`; default: one noise from seed 0 in all
//! laboratories.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;
use rodfit::fit::{Analysis, Experiment, Refinement, Sample};
use rodfit::scene::{
    Along, Compliance, Drag, Friction, Material, PointMass, Scene, Section, Shape, Time,
};
use rodfit::{Error, Fit, FitReport, Observation, Parameter, Point};

/// Standard deviation of the noise of each coordinate, m.
const SIGMA: f64 = 5e-4;
/// Frames per second.
const RATE: f64 = 100.0;
/// Edges of all rods: so many that small compliances and curvatures have effects free of the mesh.
const EDGES: usize = 40;
/// Time step of all simulations, s.
const STEP: f64 = 2e-3;
/// Bias of the modulus by each term, standard errors.
const BIAS: f64 = 2.0;
/// Contribution to the residuals, in standard deviations, to which a term is limited: Kelvin-Voigt damping hardly biases the
/// modulus, and would have to stop the rod within one swing.
const CLEAR: f64 = 100.0;
/// Contribution to the residuals, in standard deviations, above which a term is detectable.
const DETECTABLE: f64 = 3.0;
/// Name of the stiffness of internal friction.
const FRICTION: &str = "loads.damping.friction.stiffness";
/// Largest relative error of a listed effect that counts as right.
const RIGHT: f64 = 0.2;

/// An omitted term: its name, a first guess of its size, and the function that adds it to a scene; friction also gets a yield
/// curvature, 1/m.
struct Wrong {
    place: &'static str,
    size: f64,
    there: fn(&mut Scene, f64, f64),
}

/// The omitted terms.
const WRONG: [Wrong; 10] = [
    Wrong {
        place: "supports.start_compliance.rotation",
        size: 0.02,
        there: |s, size, _| s.supports.start_compliance = Compliance { rotation: size, axial: 0.0 },
    },
    Wrong { place: "supports.angle", size: 2e-3, there: |s, size, _| s.supports.angle = size },
    Wrong {
        place: "rod.mass.0.mass",
        size: 2e-4,
        there: |s, size, _| s.rod.mass = vec![PointMass::new(Point::Tip, size)],
    },
    Wrong {
        place: "rod.taper.radius.to",
        size: -0.01,
        there: |s, size, _| {
            s.rod.taper.radius = Some(Along::linear(1.0 - 0.5 * size, 1.0 + 0.5 * size))
        },
    },
    Wrong {
        place: "rod.shape.angle",
        size: 6e-3,
        there: |s, size, _| {
            if let Shape::Straight { length, .. } = s.rod.shape {
                s.rod.shape = Shape::Arc { length, angle: size };
            }
        },
    },
    Wrong {
        place: "loads.damping.stiffness",
        size: 4e-4,
        there: |s, size, _| s.loads.damping.stiffness = size,
    },
    Wrong {
        place: FRICTION,
        size: 5e-3,
        there: |s, size, curvature| {
            s.loads.damping.friction = Some(Friction { stiffness: size, curvature });
        },
    },
    Wrong {
        place: "loads.drag.quadratic_normal",
        size: 0.03,
        there: |s, size, _| {
            s.loads.drag = Some(Drag { quadratic_normal: size, ..Drag::default() });
        },
    },
    Wrong {
        place: "camera.time_offset",
        size: 1e-3,
        there: |s, size, _| s.camera.time_offset = size,
    },
    Wrong {
        place: "camera.pixel_scale",
        size: 1e-3,
        there: |s, size, _| s.camera.pixel_scale = 1.0 + size,
    },
];

/// The recorded quantities: free lengths of the rods, m, duration, s, and observed places over the length.
struct Laboratory {
    name: &'static str,
    lengths: &'static [f64],
    end: f64,
    places: &'static [f64],
}

/// The laboratories.
const LABORATORIES: [Laboratory; 2] = [
    Laboratory { name: "the tip", lengths: &[0.5], end: 1.2, places: &[1.0] },
    Laboratory { name: "three markers", lengths: &[0.5], end: 2.4, places: &[0.35, 0.7, 1.0] },
];

/// The fitted scene: a rod released under gravity.
fn model(length: f64, end: f64) -> Scene {
    let shape = Shape::Straight { length, direction: [1.0, 0.0, 0.0] };
    let section = Section::Circle { radius: 0.005 };
    let mut scene = Scene::new(EDGES, shape, section, Material::new(1273.52, 1e8));
    scene.loads.gravity = [0.0, -9.81, 0.0];
    scene.loads.damping.mass = 0.5;
    scene.time = Some(Time::new(end, STEP));
    scene
}

impl Laboratory {
    /// The experiments without noise: data of rods with a term of some size, to be fitted by scenes without it.
    fn records(&self, wrong: Option<(&Wrong, f64, f64)>) -> Result<Vec<Experiment>, Error> {
        let experiment = |length: &f64| {
            let scene = model(*length, self.end);
            let mut truth = scene.clone();
            if let Some((wrong, size, yields)) = wrong {
                (wrong.there)(&mut truth, size, yields);
            }
            let camera = std::mem::take(&mut truth.camera);
            let run = truth.problem()?.simulate()?;
            let mut experiment = Experiment::new(format!("{length} m"), &scene.problem()?);
            for place in self.places {
                let point = match *place {
                    1.0 => Point::Tip,
                    place => Point::ArcLength(place * length),
                };
                // Time offset and scale of the camera act on the data, not on the motion.
                let frame = |k: usize| {
                    let time = (k + 1) as f64 / RATE;
                    let ([x, y, _], _) = run.at(point, (time - camera.time_offset).max(0.0))?;
                    let [x, y] = [x, y].map(|x| camera.pixel_scale * x);
                    Ok::<_, Error>(Sample { time, position: [Some(x), Some(y), None] })
                };
                let frames = (self.end * RATE).round() as usize;
                let samples = (0..frames).map(frame).collect::<Result<_, _>>()?;
                experiment = experiment.observe(Observation::new(samples).at(point).sigma(SIGMA));
            }
            Ok(experiment)
        };
        self.lengths.iter().map(experiment).collect()
    }
}

/// The experiments with normal noise of [`SIGMA`] from a seed.
fn with_noise(mut experiments: Vec<Experiment>, seed: u64) -> Vec<Experiment> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
    for measurement in experiments.iter_mut().flat_map(|e| &mut e.measurements) {
        if measurement.motion().is_some() {
            measurement.data.values_mut().into_iter().for_each(|x| *x += SIGMA * normal());
        }
    }
    experiments
}

/// Fits modulus and damping, with the sensitivity analysis if required.
fn fitted(experiments: Vec<Experiment>, sensitivity_analysis: bool) -> Result<FitReport, Error> {
    let analysis = Analysis {
        discretization_error: Refinement::None,
        sensitivity_analysis: Some(sensitivity_analysis),
        ..Analysis::default()
    };
    Fit::of(experiments)
        .identify(Parameter::YoungsModulus)
        .identify(Parameter::DampingMass)
        .analyse(analysis)
        .solve()
}

/// The bias of the modulus, Pa, and its standard error.
fn bias(report: &FitReport) -> [f64; 2] {
    let estimate = &report.parameters[0];
    match (estimate.value, estimate.std_error) {
        (Some(value), Some(error)) => [value - 1e8, error],
        _ => [f64::NAN; 2],
    }
}

/// Contribution to the residuals, in standard deviations, and to the modulus, Pa, of a term of size 1.
fn undetected_effect(report: &FitReport, place: &str) -> Option<[f64; 2]> {
    let modulus = report.parameters[0].name.to_string();
    let own =
        report.undetected_bias.iter().find(|h| h.source == place && h.parameter == modulus)?;
    Some([own.residual_effect / own.size, own.change / own.size])
}

/// Results of the fits of a wrong model.
#[derive(Default)]
struct Count {
    /// First or second term; first or second rank; listed as undetected bias, right to 20 %.
    first: usize,
    placed: usize,
    hides: usize,
    /// One of the last two as it must be.
    good: usize,
    /// Terms in the first two places, summed over the fits that name any.
    terms: usize,
    naming: usize,
}

impl Count {
    /// Adds the counts of other fits.
    fn add(&mut self, other: &Self) {
        self.first += other.first;
        self.placed += other.placed;
        self.hides += other.hides;
        self.good += other.good;
        self.terms += other.terms;
        self.naming += other.naming;
    }

    /// The counts as a part of a line.
    fn words(&self) -> String {
        let Self { first, placed, hides, good, terms, naming } = self;
        let terms = *terms as f64 / (*naming).max(1) as f64;
        format!("{first:4} {placed:4} ({terms:.1} terms) {hides:4} {good:4}")
    }
}

/// Counts the fits of a wrong model with a term of this size, whose bias is `off`, with these seeds.
fn count(
    (laboratory, wrong): (&Laboratory, &Wrong),
    (size, yields): (f64, f64),
    (off, detectable): (f64, bool),
    seeds: std::ops::Range<u64>,
) -> Result<Count, Error> {
    let data = laboratory.records(Some((wrong, size, yields)))?;
    let fits: Vec<FitReport> = seeds
        .into_par_iter()
        .map(|seed| fitted(with_noise(data.clone(), seed), true))
        .collect::<Result<_, _>>()?;
    let mut count = Count::default();
    for report in fits {
        let tests = &report.score_tests;
        // Terms of a rank whose first one is significant.
        let found = |place: usize| {
            tests.iter().find(|t| t.rank == place).is_some_and(|first| first.is_significant())
        };
        let named: Vec<_> = tests.iter().filter(|t| t.rank <= 2 && found(t.rank)).collect();
        let own = |t: &&&rodfit::fit::ScoreTest| t.source == wrong.place;
        let first = named.iter().take(2).any(|t| own(&t) && t.is_significant());
        let placed = named.iter().any(|t| own(&t));
        let effect = undetected_effect(&report, wrong.place).map(|[_, change]| change * size);
        let hides = effect.is_some_and(|effect| (effect / off - 1.0).abs() <= RIGHT);
        count.first += usize::from(first);
        count.placed += usize::from(placed);
        count.hides += usize::from(hides);
        count.good += usize::from(if detectable { placed } else { placed || hides });
        count.terms += named.len();
        count.naming += usize::from(!named.is_empty());
    }
    Ok(count)
}

/// The smallest size of a term that biases the modulus by [`BIAS`] standard errors, and this bias, Pa.
fn strength(laboratory: &Laboratory, wrong: &Wrong, yields: f64) -> Result<(f64, f64), Error> {
    let moved = |size: f64| -> Result<[f64; 2], Error> {
        let [moved, error] =
            bias(&fitted(laboratory.records(Some((wrong, size, yields)))?, false)?);
        Ok([moved, BIAS * error])
    };
    // A term of size zero may change the mesh: a compliant clamp has a joint of its own. Its effect is subtracted.
    let [none, _] = moved(1e-6 * wrong.size)?;
    let (mut size, mut before) = (1e-2 * wrong.size, 0.0);
    for _ in 0..40 {
        let [there, asked] = moved(size)?;
        let off = there - none;
        if off.abs() >= asked {
            let (small, part) = (0.5 * size, (asked - before) / (off.abs() - before));
            let size = if before > 0.0 { small + part * (size - small) } else { part * size };
            return Ok((size, moved(size)?[0] - none));
        }
        (size, before) = (2.0 * size, off.abs());
    }
    // Counted as neither named nor listed.
    Ok((size, f64::NAN))
}

fn main() -> Result<(), Error> {
    let mut numbers = std::env::args().skip(1).map(|n| n.parse::<u64>().ok());
    let mut number = |usual: u64| numbers.next().flatten().unwrap_or(usual);
    let (noises, first) = (number(1), number(0));
    let only = numbers.next().flatten().map(|n| n as usize);
    for (k, laboratory) in
        LABORATORIES.iter().enumerate().filter(|(k, _)| only.is_none_or(|o| o == *k))
    {
        println!("{k}: {}", laboratory.name);
        let right = fitted(with_noise(laboratory.records(None)?, 1_000_000), true)?;
        // The yield curvature that the library assumes for friction.
        let friction = right.undetected_bias.iter().find(|h| h.source == FRICTION);
        let yields = friction.and_then(|h| h.effect.split_whitespace().rev().nth(1)?.parse().ok());
        let yields = yields.unwrap_or(0.15);
        println!("  friction yields at {yields} 1/m");
        let mut all = [Count::default(), Count::default()];
        for wrong in &WRONG {
            // The contribution to the residuals is taken from the right model, and limits the size.
            let (mut size, mut off) = strength(laboratory, wrong, yields)?;
            let mut sigmas = undetected_effect(&right, wrong.place)
                .map_or(0.0, |[visible, _]| visible * size.abs());
            if sigmas > CLEAR {
                let less = CLEAR / sigmas;
                (size, off, sigmas) = (less * size, less * off, CLEAR);
            }
            let detectable = sigmas >= DETECTABLE;
            let seeds = first..first + noises;
            let found = count((laboratory, wrong), (size, yields), (off, detectable), seeds)?;
            println!(
                "  {:36} {size:8.1e} leaves {sigmas:6.1} sigma: {}",
                wrong.place,
                found.words()
            );
            all[usize::from(detectable)].add(&found);
        }
        for (words, count) in ["not detectable", "detectable"].iter().zip(&all) {
            println!("  {words}: {}", count.words());
        }
        let good: usize = all.iter().map(|count| count.good).sum();
        println!("  as it must be in {good} of {}", WRONG.len() * noises as usize);
    }
    Ok(())
}
