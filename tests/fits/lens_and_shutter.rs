//! Recordings by a distorting lens and a rolling shutter: both are identified together with the modulus, and their omission is
//! found by score tests.

use rodfit::fit::Sample;
use rodfit::scene::Scene;
use rodfit::{Fit, FitReport, Observation, Parameter, Point, Trajectory, Unknown};

use crate::common::coarse;
use crate::common::fits::{add_noise, observe, of_a_right_mesh, value};

/// Standard deviation of the noise, m.
const SIGMA: f64 = 1e-3;
/// Number of frames.
const FRAMES: usize = 120;

/// Lens and shutter of a camera whose optical center is at the `center` of the picture.
#[derive(Clone, Copy)]
struct Sensor {
    /// Time of the clock at the release in the row of the clamp, s.
    offset: f64,
    /// Delay of the rows, s/m.
    row_delay: f64,
    /// Radial distortion, 1/m^2.
    distortion: f64,
    /// Optical center, m.
    center: [f64; 2],
}

impl Sensor {
    /// The recorded position of a point whose undistorted recorded position is `u`: the root of
    /// `(1 + distortion r^2) (p - center) = u - center`, by bisection of the distance from the center.
    fn distorted(&self, u: [f64; 3]) -> [f64; 3] {
        let arm = [u[0] - self.center[0], u[1] - self.center[1]];
        let distance = arm[0].hypot(arm[1]);
        let (mut low, mut high) = (0.0, 2.0 * distance);
        for _ in 0..80 {
            let middle = 0.5 * (low + high);
            match middle * (1.0 + self.distortion * middle * middle) < distance {
                true => low = middle,
                false => high = middle,
            }
        }
        let factor = if distance > 0.0 { low / distance } else { 1.0 };
        [self.center[0] + factor * arm[0], self.center[1] + factor * arm[1], u[2]]
    }

    /// The tip of a run in frames of equal distance: each shows the tip where it is when its row is read.
    fn film(&self, run: &Trajectory) -> Observation {
        let end = run.times()[run.times().len() - 1];
        let wall = run.node(0, 0);
        let frame = |k: usize| {
            let clock = 0.05 + (end - 0.1) * k as f64 / FRAMES as f64;
            let mut time = clock - self.offset;
            let mut place = [0.0; 3];
            // The delay is small against the period: each pass has about a tenth of the error before.
            for _ in 0..60 {
                place = self.distorted(run.at(Point::Tip, time).unwrap().0);
                time = clock - self.offset - self.row_delay * (place[1] - wall[1]);
            }
            Sample { time: clock, position: [Some(place[0]), Some(place[1]), None] }
        };
        Observation::new((0..=FRAMES).map(frame).collect())
    }
}

/// A soft cantilever of 0.5 m that swings by about half its length.
fn scene() -> Scene {
    coarse(20, 2e-3, 1.0)
}

/// The fit of a recording with these unknowns beside the modulus.
fn solved(scene: &Scene, data: Observation, unknowns: &[&str]) -> FitReport {
    let mut fit = Fit::new(&scene.problem().unwrap()).observe(data).analyse(of_a_right_mesh());
    fit = fit.keep_plot_data();
    fit = fit.identify(Parameter::YoungsModulus);
    for name in unknowns {
        fit = fit.identify(Unknown::new(name.parse().unwrap()));
    }
    fit.solve().unwrap()
}

/// A film at 240 frames per second that is read as one at 250: from exact data the ratio of both clocks is found beside
/// the modulus, of a rod that swings by its weight. Without it a score test of the first rank names the frame rate.
#[test]
fn frame_rate_is_identified_and_named() {
    let truth = scene();
    let sensor = Sensor { offset: 0.013, row_delay: 0.0, distortion: 0.0, center: [0.0; 2] };
    let mut data = sensor.film(&truth.problem().unwrap().simulate().unwrap());
    data.samples.iter_mut().for_each(|sample| sample.time *= 0.96);
    let report = solved(&truth, data.clone(), &["camera.time_offset", "camera.time_scale"]);
    let found = |name: &str| value(&report, name.parse().unwrap());
    let modulus = truth.material.youngs_modulus;
    assert!((found("youngs_modulus") / modulus - 1.0).abs() < 1e-7, "{report}");
    assert!((found("camera.time_scale") / 0.96 - 1.0).abs() < 1e-8, "{report}");
    assert!((found("camera.time_offset") / (0.96 * 0.013) - 1.0).abs() < 1e-6, "{report}");
    add_noise(&mut data, SIGMA, 1);
    let report = solved(&truth, data.sigma(SIGMA), &["camera.time_offset"]);
    println!("{report}");
    // Gravity of another size has the same effect; the data cannot separate them.
    let best = report.score_tests.iter().filter(|test| test.rank == 1);
    assert!(best.map(|test| &test.source).any(|source| source == "camera.time_scale"), "{report}");
}

/// From exact data of a recording with both effects, all their numbers and the modulus are found to 1e-7.
#[test]
fn lens_and_shutter_are_identified_from_exact_data() {
    let mut truth = scene();
    truth.material.youngs_modulus *= 1.2;
    let sensor = Sensor { offset: 0.013, row_delay: 0.04, distortion: 0.3, center: [0.2, -0.1] };
    let data = sensor.film(&truth.problem().unwrap().simulate().unwrap());
    let mut start = scene();
    start.camera.optical_center = [0.2, -0.1, 0.0];
    let report =
        solved(&start, data, &["camera.time_offset", "camera.row_delay.y", "camera.distortion"]);
    println!("{report}");
    assert!(report.is_success(), "{report}");
    let found = |name: &str| value(&report, name.parse().unwrap());
    let modulus = truth.material.youngs_modulus;
    assert!((found("youngs_modulus") / modulus - 1.0).abs() < 1e-7);
    assert!((found("camera.time_offset") - sensor.offset).abs() < 1e-8);
    assert!((found("camera.row_delay.y") / sensor.row_delay - 1.0).abs() < 1e-6);
    assert!((found("camera.distortion") / sensor.distortion - 1.0).abs() < 1e-6);
    // The curves of plots are those of the distorted recording: the data lie on them.
    let plots = report.plot_data.as_ref().unwrap();
    for series in &plots.series {
        for (time, observed) in series.abscissa_values.iter().zip(&series.observed) {
            let distance = |point: &&[f64; 2]| (point[0] - time).abs();
            let nearest = series.curve.iter().min_by(|a, b| distance(a).total_cmp(&distance(b)));
            let [clock, x] = nearest.unwrap();
            // The speed is below 4 m/s.
            assert!(
                (x - observed).abs() < 1e-5 + 4.0 * (clock - time).abs(),
                "{time}: {x} {observed}"
            );
        }
    }
}

/// With either effect in noisy data, a fit that identifies it has the modulus within three standard errors, and a fit without
/// it names it: the score test is significant, with the effect among the first two.
#[test]
fn omitted_lens_and_shutter_are_named_and_modulus_is_unbiased_with_them() {
    let none = Sensor { offset: 0.0, row_delay: 0.0, distortion: 0.0, center: [0.0; 2] };
    let shutter = Sensor { row_delay: 0.02, ..none };
    let lens = Sensor { distortion: 0.08, ..none };
    let cases = [("camera.row_delay.y", shutter), ("camera.distortion", lens)];
    for (name, sensor) in cases {
        let run = scene().problem().unwrap().simulate().unwrap();
        let clean = sensor.film(&run);
        let (mut named, mut within) = (0, 0);
        for seed in 0..10 {
            let mut data = clean.clone();
            add_noise(&mut data, SIGMA, seed);
            let without = solved(&scene(), data.clone().sigma(SIGMA), &[]);
            let best = without.score_tests.iter().filter(|test| test.rank <= 2);
            let is_first = best.map(|test| &test.source).any(|source| source == name);
            named += usize::from(is_first && without.score_tests[0].is_significant());
            let with = solved(&scene(), data.sigma(SIGMA), &[name]);
            let [own, other] = [&with, &without].map(|report| {
                let estimate = &report.parameters[0];
                let off = estimate.value.unwrap() - scene().material.youngs_modulus;
                off / estimate.std_error.unwrap()
            });
            within += usize::from(own.abs() < 3.0);
            println!(
                "{name} {seed}: with {own:.2}, without {other:.2} standard errors; named {is_first}"
            );
        }
        assert!(named >= 9 && within == 10, "{name}: {named} {within}");
    }
}

/// Of a recording without distortion, with noise, a free distortion is zero beside a free scale: the size of the noise does
/// not depend on the distortion. With the true model no score test is significant.
#[test]
fn distortion_of_an_undistorted_recording_is_zero_beside_a_free_scale() {
    let none = Sensor { offset: 0.0, row_delay: 0.0, distortion: 0.0, center: [0.0; 2] };
    let clean = none.film(&scene().problem().unwrap().simulate().unwrap());
    let (mut within, mut significant) = (0, 0);
    for seed in 0..8 {
        let mut data = clean.clone();
        add_noise(&mut data, SIGMA, 100 + seed);
        let data = data.sigma(SIGMA);
        let scale = solved(&scene(), data.clone(), &["camera.pixel_scale"]);
        significant += usize::from(scale.score_tests.first().is_some_and(|t| t.is_significant()));
        let both = solved(&scene(), data, &["camera.pixel_scale", "camera.distortion"]);
        let distortion = both.estimate("camera.distortion".parse().unwrap()).unwrap();
        let off = distortion.value.unwrap() / distortion.std_error.unwrap();
        println!("{seed}: distortion {off:.2} standard errors");
        within += usize::from(off.abs() < 2.5);
    }
    // A standard normal variable is within 2.5 in 98.8 % of all cases.
    assert!(within >= 7 && significant <= 1, "{within} {significant}");
}

/// Recordings without a coordinate that an effect needs are rejected with its key.
#[test]
fn lens_and_shutter_without_a_coordinate_are_rejected() {
    let mut data = observe(&scene(), 20);
    data.samples[3].position[1] = None;
    for (name, key) in
        [("camera.row_delay.y", "camera.row_delay.y"), ("camera.distortion", "camera.distortion")]
    {
        let fit = Fit::new(&scene().problem().unwrap()).observe(data.clone());
        let fit =
            fit.identify(Parameter::YoungsModulus).identify(Unknown::new(name.parse().unwrap()));
        let error = fit.solve().unwrap_err().to_string();
        assert!(error.contains(key) && error.contains("without y"), "{error}");
    }
    // A delay of columns needs x only.
    let fit = Fit::new(&scene().problem().unwrap()).observe(data);
    let fit = fit.identify(Parameter::YoungsModulus);
    let delay = Unknown::new("camera.row_delay.x".parse().unwrap());
    assert!(fit.identify(delay).solve().is_ok());
}

/// A coordinate that is constant by whole pixels is used where the camera needs it: the modulus is that of data whose
/// coordinate is not exactly constant.
#[test]
fn constant_coordinate_that_the_camera_needs_is_kept() {
    let mut scene = scene();
    scene.camera.row_delay = [0.03, 0.0, 0.0];
    let mut data = observe(&scene, 60).sigma(SIGMA);
    data.samples.iter_mut().for_each(|sample| sample.position[0] = Some(0.5));
    data.samples.pop();
    let mut varied = data.clone();
    varied.samples[7].position[0] = Some(0.5 + 1e-12);
    let [one, two] = [data, varied].map(|data| solved(&scene, data, &[]).parameters[0].value);
    assert!((one.unwrap() / two.unwrap() - 1.0).abs() < 1e-9, "{one:?} {two:?}");
}

/// A plan has no positions yet: lens and rows act at the simulated ones, so that the data determine their numbers.
#[test]
fn plan_determines_lens_and_shutter_at_simulated_positions() {
    let planned = Observation::planned(0.9, 100.0).unwrap().sigma(SIGMA);
    let start = |name: &str, value: f64| Unknown::new(name.parse().unwrap()).start(value);
    let modulus = scene().material.youngs_modulus;
    let fit = Fit::new(&scene().problem().unwrap()).observe(planned).analyse(of_a_right_mesh());
    let fit = fit.identify(start("youngs_modulus", modulus));
    let fit = fit.identify(start("camera.row_delay.y", 0.02));
    let design = fit.identify(start("camera.distortion", 0.1)).design().unwrap();
    assert!(design.never_identifiable.is_empty(), "{:?}", design.never_identifiable);
    for estimate in &design.parameters {
        assert!(estimate.std_error.is_some_and(f64::is_finite), "{estimate:?}");
    }
}
