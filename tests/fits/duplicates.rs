//! Duplicate samples in two measurements are rejected, in whatever units and order; repeated measurements are accepted.

use rodfit::fit::{
    Buckling, Experiment, Frequencies, LoadDeflection, LoadedPoint, Measurement, RestShape, Sample,
    ShapePoint,
};
use rodfit::{Fit, Observation, Parameter, Point, Scene};

use crate::common::coarse;
use crate::common::fits::{noisy, observe};

const ROWS: usize = 40;
const NOISE: f64 = 1e-3;

fn scene() -> Scene {
    coarse(8, 4e-3, 0.4)
}

/// Noisy data of the scene, with noise from `seed`.
fn take(seed: u64) -> Observation {
    noisy(&observe(&scene(), ROWS), NOISE, seed)
}

/// The error of a fit of these measurements.
fn refusal(measured: impl IntoIterator<Item = Measurement>) -> Option<String> {
    let problem = scene().problem().unwrap();
    let fit = Fit::new(&problem).identify(Parameter::YoungsModulus);
    let fit = measured.into_iter().fold(fit, Fit::observe);
    // Whatever is refused is refused before anything is simulated.
    fit.residuals().err().map(|error| error.to_string())
}

/// Requires that these measurements are rejected as the same samples twice.
fn refused(measured: impl IntoIterator<Item = Measurement>) {
    let words = refusal(measured).expect("the same samples twice");
    assert!(words.contains("samples that") && words.contains("[0]"), "{words}");
}

/// Requires that these measurements are accepted.
fn admitted(measured: impl IntoIterator<Item = Measurement>) {
    assert_eq!(refusal(measured), None);
}

/// The observation with a change of each sample.
fn changed(mut observation: Observation, change: impl Fn(&mut Sample)) -> Measurement {
    observation.samples.iter_mut().for_each(change);
    observation.into()
}

/// With positions rounded to a unit, m.
fn rounded(observation: Observation, unit: f64) -> Measurement {
    changed(observation, |s| {
        s.position.iter_mut().flatten().for_each(|x| *x = (*x / unit).round() * unit);
    })
}

fn with_samples(samples: Vec<Sample>, mut observation: Observation) -> Measurement {
    observation.samples = samples;
    observation.into()
}

/// The observation with a range of its samples.
fn part(observation: Observation, range: std::ops::Range<usize>) -> Measurement {
    with_samples(observation.samples[range].to_vec(), observation)
}

#[test]
fn copy_of_a_recording_is_rejected() {
    refused([take(1).into(), take(1).into()]);
    refused([take(1).into(), take(1).held_out().into()]);
    // Times in ms and positions in mm, each with the rounding errors of another unit.
    let other_units = changed(take(1), |s| {
        s.time = (s.time * 1e3) / 1e3 * (1.0 + 1e-15);
        s.position.iter_mut().flatten().for_each(|x| *x = (*x * 1e3) * 1e-3);
    });
    refused([other_units, take(1).into()]);
    // Copies with micrometers and with millimeters.
    refused([take(1).into(), rounded(take(1), 1e-6)]);
    refused([take(1).into(), rounded(take(1), 1e-3)]);
    // At another point of the rod the same places are as impossible.
    refused([take(1).into(), take(1).at(Point::ArcLength(0.4)).into()]);
}

#[test]
fn overlapping_parts_are_rejected_and_disjoint_parts_accepted() {
    refused([part(take(1), 0..25), part(take(1), 15..40)]);
    refused([part(take(1), 0..40), part(take(1), 10..20)]);
    admitted([part(take(1), 0..20), part(take(1), 20..40)]);
    // Every other frame.
    let every = |first: usize| {
        let samples = take(1).data.samples.into_iter().skip(first).step_by(2).collect();
        with_samples(samples, take(1))
    };
    admitted([every(0), every(1)]);
}

#[test]
fn repeated_measurements_are_accepted() {
    admitted([take(1).into(), take(2).into()]);
    // Pixels as large as the noise: about a third of the values is equal by chance.
    admitted([rounded(take(1), NOISE), rounded(take(2), NOISE)]);
    admitted([take(1).into(), rounded(take(2), NOISE)]);
    // One of two cameras has pixels five times as large as the noise.
    admitted([take(1).into(), rounded(take(2), 5.0 * NOISE)]);
    // An axis in which nothing moves says nothing, and other axes are other samples.
    let axes = |keep: [bool; 3], seed: u64| {
        changed(take(seed), |s| {
            for (x, keep) in s.position.iter_mut().zip(keep) {
                *x = x.filter(|_| keep);
            }
        })
    };
    admitted([axes([true, false, false], 1), axes([false, true, false], 1)]);
    let still = |seed: u64| changed(take(seed), |s| s.position[2] = Some(0.0));
    admitted([still(1), still(2)]);
}

#[test]
fn recording_in_two_experiments_is_rejected() {
    let problem = scene().problem().unwrap();
    let fit_of = |seeds: [u64; 2]| {
        let named = ["a", "b"].into_iter().zip(seeds);
        let experiments =
            named.map(|(name, seed)| Experiment::new(name, &problem).observe(take(seed)));
        Fit::of(experiments).identify(Parameter::YoungsModulus).residuals()
    };
    let words = fit_of([1, 1]).unwrap_err().to_string();
    assert!(words.contains("a.observation[0]") && words.contains("b.observation[0]"), "{words}");
    assert!(fit_of([1, 2]).is_ok());
}

#[test]
fn duplicate_shapes_and_frequencies_are_rejected() {
    let shape = |off: f64| {
        let sighting = |k: usize| {
            let s = 0.1 * k as f64;
            let position = [Some(s), Some(-0.1 * s * s + off * k as f64), None];
            ShapePoint::new(Point::ArcLength(s), position)
        };
        Measurement::from(RestShape::new((1..=5).map(sighting).collect()).sigma(1e-3))
    };
    refused([shape(0.0), shape(0.0)]);
    admitted([shape(0.0), shape(1e-4)]);
    let of = |hz: &[f64], modes: &[usize]| {
        Measurement::from(Frequencies::hz(hz, 0.1).of_modes(modes).unwrap())
    };
    refused([of(&[4.0, 25.0], &[1, 2]), of(&[4.0, 25.0], &[1, 2])]);
    refused([of(&[4.0, 25.0], &[1, 2]), of(&[25.0], &[2])]);
    admitted([of(&[4.0, 25.0], &[1, 2]), of(&[4.1, 24.9], &[1, 2])]);
    admitted([of(&[4.0], &[1]), of(&[25.0], &[2])]);
}

/// Rows of one table that occur twice are rejected; repeated measurements, with values of their own, are accepted.
#[test]
fn repeated_rows_of_one_table_are_rejected() {
    let twice = |second: f64| (0..10).map(move |k| (k % 5, 1.0 + if k < 5 { 0.0 } else { second }));
    let shape = |second: f64| {
        let sighting = |(k, factor): (usize, f64)| {
            let s = 0.1 * (k + 1) as f64;
            ShapePoint::new(Point::ArcLength(s), [Some(0.97 * s), Some(-0.0123 * s * factor), None])
        };
        Measurement::from(RestShape::new(twice(second).map(sighting).collect()).sigma(1e-3))
    };
    refused([shape(0.0)]);
    admitted([shape(1e-4)]);
    // Every position twice along a centerline without arc lengths, and each once.
    let line = |copies: usize| {
        let position = |k: usize| {
            let x = 0.0371 * (k / copies + 1) as f64;
            [Some(x), Some(-0.2 * x * x), None]
        };
        let positions: Vec<_> = (0..10 * copies).map(position).collect();
        Measurement::from(RestShape::center_line(&positions).sigma(1e-3))
    };
    refused([line(2)]);
    admitted([line(1)]);
    // Bending under a force at the tip, in a scene that has one.
    let mut loaded = scene();
    loaded.time = None;
    loaded.loads.point = crate::common::at_tip([0.0, -1e-3, 0.0]);
    let problem = loaded.problem().unwrap();
    let curve = |change: &dyn Fn(f64, f64) -> f64, second: f64| {
        let point = |(k, factor): (usize, f64)| {
            let load = -1e-3 * (k + 1) as f64;
            LoadedPoint { load, displacement: change(load * 1.23457, factor) }
        };
        let points = twice(second).map(point).collect();
        let load = "loads.point.0.force.y".parse().unwrap();
        let measured = LoadDeflection::new(load, Point::Tip, 1, points).sigma(1e-4);
        let fit = Fit::new(&problem).observe(measured).identify(Parameter::YoungsModulus);
        fit.residuals().err().map(|error| error.to_string())
    };
    let exact = |x: f64, factor: f64| x * factor;
    let words = curve(&exact, 0.0).expect("the same rows twice");
    assert!(words.contains("load_deflection[0]") && words.contains("5 samples that"), "{words}");
    assert_eq!(curve(&exact, 1e-4), None);
    // A ruler of 1 mm for a range of 5 mm reads the same value again.
    assert_eq!(curve(&|x: f64, factor: f64| (x * factor * 1e3).round() * 1e-3, 0.0), None);
}

/// The same critical load twice is rejected, also as validation data; two measured values are accepted.
#[test]
fn duplicate_critical_loads_are_rejected() {
    let mut loaded = scene();
    loaded.time = None;
    loaded.loads.gravity = [0.0; 3];
    loaded.loads.point = crate::common::at_tip([0.0; 3]);
    let problem = loaded.problem().unwrap();
    let load: Parameter = "loads.point.0.force.x".parse().unwrap();
    let error = |first: Buckling, second: Buckling| {
        let fit = Fit::new(&problem).observe(first).observe(second);
        fit.identify(Parameter::YoungsModulus).residuals().err().map(|error| error.to_string())
    };
    let of = |value: f64| Buckling::new(load, value, 0.01);
    for second in [of(-0.48), of(-0.48).held_out()] {
        let words = error(of(-0.48), second).expect("the same load twice");
        assert!(words.contains("buckling[1]") && words.contains("buckling[0]"), "{words}");
    }
    assert_eq!(error(of(-0.48), of(-0.481)), None);
}
