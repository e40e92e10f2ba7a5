//! Separation of misfit and noise without a stated sigma, and undetected biases of the size that the data allow.

use rodfit::fit::{Analysis, Grade, Known, UndetectedBias};
use rodfit::scene::{PointMass, Scene};
use rodfit::{Fit, FitReport, Observation, Parameter, Point};

use crate::common::coarse;
use crate::common::fits::{fit_with, noisy, observe, of_a_right_mesh};
use crate::noise::kinds::Noise;

/// Noise of the recordings, m.
const SIGMA: f64 = 1e-3;
const UNKNOWNS: [Parameter; 2] = [Parameter::YoungsModulus, Parameter::DampingMass];

/// Two lightly damped oscillations.
fn scene() -> Scene {
    let mut scene = coarse(12, 4e-3, 0.8);
    scene.loads.damping.mass = 0.5;
    scene
}

/// Mass of the rod, kg.
fn mass(scene: &Scene) -> f64 {
    scene.material.density * scene.rod.section.moments().area * 0.5
}

/// The scene with a point mass at its tip, given as a part of the mass of the rod.
fn with_tip_mass(part: f64) -> Scene {
    let mut truth = scene();
    truth.rod.mass = vec![PointMass::new(Point::Tip, part * mass(&truth))];
    truth
}

fn fit_to(data: &Observation) -> FitReport {
    fit_with(&scene(), data, &UNKNOWNS, of_a_right_mesh())
}

/// Whether a report has a warning with this code.
fn has(report: &FitReport, code: &str) -> bool {
    report.warning_codes.iter().any(|own| own.name() == code)
}

/// The bias of Young's modulus that is listed for an effect.
fn listed<'a>(report: &'a FitReport, source: &str) -> &'a UndetectedBias {
    let modulus = report.parameters[0].label();
    let own = |h: &&UndetectedBias| h.source == source && h.parameter == modulus;
    report.undetected_bias.iter().find(own).unwrap_or_else(|| panic!("{source}: {report}"))
}

/// An omitted tip mass of 5 % acts like a modulus lower by 4 times 5 % over the modal mass of a quarter, and leaves a
/// misfit of twice the noise. The correlation of the misfit is not taken for noise.
#[test]
fn omitted_tip_mass_without_sigma_is_graded_with_reservation_and_listed() {
    let clean = observe(&with_tip_mass(0.05), 60);
    let (mut named, mut covered) = (0, 0);
    for seed in 0..8 {
        let report = fit_to(&noisy(&clean, SIGMA, seed));
        let [low, high] = report.parameters[0].interval95.unwrap();
        // The bias by the tip mass is beyond the interval, as derived above.
        assert!(!(low..high).contains(&1e8), "the error shows: {report}");
        assert!(
            [Grade::CorrelatedOrMissing, Grade::ModelDoesNotExplain].contains(&report.grade),
            "{seed}: {report}"
        );
        let best = report.score_tests.iter().filter(|t| t.rank <= 2 && t.is_significant());
        named += usize::from(best.into_iter().any(|t| t.source == "rod.mass.0.mass"));
        let bias = report.parameters[0].value.unwrap() - 1e8;
        let ratio = listed(&report, "rod.mass.0.mass").change / bias;
        println!("{seed}: {}, listed over true bias {ratio:.2}", report.grade);
        covered += usize::from((0.8..3.0).contains(&ratio));
    }
    assert!(named >= 6 && covered >= 6, "named {named}, covered {covered} of 8");
}

/// White noise on a right model keeps its grade: at most one in 25 has a reservation.
#[test]
fn white_noise_without_sigma_keeps_its_grade() {
    let clean = observe(&scene(), 60);
    let reserved = (100..150)
        .filter(|seed| fit_to(&noisy(&clean, SIGMA, *seed)).grade != Grade::Trustworthy)
        .count();
    // Two are expected at most, and three standard deviations of that are four.
    assert!(reserved <= 6, "{reserved} of 50");
}

/// AR(1) noise of 0.8 and 0.95 leaves residuals like those of a missing effect: a reservation without sigma, none with
/// it.
#[test]
fn autocorrelated_noise_is_separated_from_misfit_by_a_stated_sigma() {
    let clean = observe(&scene(), 200);
    for correlation in [0.8, 0.95] {
        let mut accepted = 0;
        for seed in 0..6 {
            let mut data = clean.clone();
            Noise::Correlated(correlation).add(&mut data, SIGMA, 0, seed);
            let report = fit_to(&data);
            assert_ne!(report.grade, Grade::Trustworthy, "{correlation}, {seed}: {report}");
            let report = fit_to(&data.sigma(SIGMA));
            accepted += usize::from(report.grade == Grade::Trustworthy);
        }
        assert!(accepted >= 4, "{correlation}: {accepted} of 6");
    }
}

/// A third coordinate that is always zero is no measurement.
#[test]
fn constant_axis_does_not_change_sigma_or_interval() {
    let flat = noisy(&observe(&scene(), 60), SIGMA, 3);
    let mut filled = flat.clone();
    filled.samples.iter_mut().for_each(|s| s.position[2] = Some(0.0));
    let (flat, filled) = (fit_to(&flat), fit_to(&filled));
    assert_eq!(flat.sigma, filled.sigma);
    assert_eq!(flat.grade, filled.grade);
    assert_eq!(flat.parameters[0].interval95, filled.parameters[0].interval95);
    assert!(has(&filled, "constant-axis") && !has(&flat, "constant-axis"), "{filled}");
}

/// In a video of 50 frames a second that was converted to 100, every second position belongs to the frame before.
#[test]
fn repeated_frames_are_reported_and_lower_the_grade() {
    let clean = noisy(&observe(&scene(), 100), SIGMA, 4);
    let mut doubled = clean.clone();
    for k in (1..doubled.samples.len()).step_by(2) {
        doubled.samples[k].position = doubled.samples[k - 1].position;
    }
    let (clean, doubled) = (fit_to(&clean), fit_to(&doubled));
    assert!(!has(&clean, "repeated-frames"), "{clean}");
    assert!(has(&doubled, "repeated-frames"), "{doubled}");
    assert_ne!(doubled.grade, Grade::Trustworthy);
}

/// A fitted modulus that no solid of the density has lowers the grade, as of a rod whose width and height are
/// exchanged, and so does one beside the density of no solid, as in g/cm^3.
#[test]
fn modulus_too_low_for_the_density_lowers_the_grade() {
    let heavy = |factor: f64| {
        let mut scene = scene();
        scene.material.density *= factor;
        scene.material.youngs_modulus *= factor;
        let data = noisy(&observe(&scene, 60), SIGMA, 1);
        fit_with(&scene, &data, &UNKNOWNS, of_a_right_mesh())
    };
    // The density of steel, with 6e8 Pa; the motion is the same.
    let [light, heavy, dust] = [1.0, 6.2, 1e-3].map(heavy);
    assert!(light.grade == Grade::Trustworthy && !has(&light, "implausible-units"), "{light}");
    for wrong in [heavy, dust] {
        assert!(wrong.grade != Grade::Trustworthy && has(&wrong, "implausible-units"), "{wrong}");
    }
}

/// Frames in which a tracker lost the marker and wrote a constant are refused, also at the start, where they would look
/// like a start far from the rod.
#[test]
fn placeholders_of_lost_frames_are_refused() {
    let clean = noisy(&observe(&scene(), 100), SIGMA, 4);
    for lost in [[0, 1, 40], [30, 31, 77]] {
        let mut data = clean.clone();
        for k in lost {
            data.samples[k].position = [Some(-1.0), Some(-1.0), None];
        }
        let fit = Fit::new(&scene().problem().unwrap()).observe(data);
        let error = fit.identify(Parameter::YoungsModulus).solve().unwrap_err().to_string();
        assert!(error.contains("in 3 of 100 frames") && error.contains("an empty cell"), "{error}");
    }
}

/// A stated sigma that is three times too large or too small is reported.
#[test]
fn stated_sigma_off_by_three_is_reported() {
    let data = noisy(&observe(&scene(), 100), SIGMA, 5);
    for (factor, reported) in [(3.0, true), (1.0, false), (1.0 / 3.0, true)] {
        let report = fit_to(&data.clone().sigma(factor * SIGMA));
        let found = has(&report, "sigma-doubtful");
        assert_eq!(found, reported, "{factor}: {report}");
    }
}

/// The noise scale of each coordinate is the noise, whether the model is right or not.
#[test]
fn noise_scale_is_independent_of_the_model() {
    for truth in [scene(), with_tip_mass(0.05)] {
        let report = fit_to(&noisy(&observe(&truth, 200), SIGMA, 7));
        assert_eq!(report.noise_scale.len(), 2);
        for scale in &report.noise_scale {
            let value = scale.value.unwrap_or_else(|| panic!("{scale:?}"));
            // The noise with which the data are made; its estimate from 200 values scatters.
            assert!((value / SIGMA - 1.0).abs() < 0.3, "{scale:?}");
        }
    }
}

/// E over density is all that gravity determines: a density off by its listed size biases E by as much, and the size is
/// that of the prior, 2.78 plausible ones of Student's t with four degrees of freedom.
#[test]
fn collinear_effect_has_the_size_of_its_prior() {
    let report = fit_to(&noisy(&observe(&scene(), 60), SIGMA, 1));
    let density = listed(&report, "material.density");
    assert_eq!(density.estimate, None);
    // Quantile 0.975 of Student's t with four degrees of freedom, 2.776.
    assert!((density.size.abs() / density.plausible_size - 2.776).abs() < 0.06, "{density:?}");
    // The true density is larger by that size: E is too small by the same factor.
    let factor = 1.0 + density.size / 1273.52;
    assert!((density.relative.unwrap() - (1.0 / factor - 1.0)).abs() < 0.02, "{density:?}");
}

/// With known inputs the table shows the expanded interval; without, that inputs are taken as exact.
#[test]
fn headline_interval_is_the_expanded_one_beside_known_inputs() {
    let data = noisy(&observe(&scene(), 60), SIGMA, 1);
    let plain = fit_to(&data).to_string();
    let sentence = plain.split_whitespace().collect::<Vec<_>>().join(" ");
    for part in ["inputs are taken as exact", "Not contained: the largest undetected bias"] {
        assert!(sentence.contains(part), "{part} in {plain}");
    }
    let scene = scene();
    let mut fit = Fit::new(&scene.problem().unwrap()).observe(data);
    fit = fit.analyse(Analysis { ..of_a_right_mesh() });
    fit = fit.known(Known::new("rod.section.radius".parse().unwrap(), 5e-5));
    let report = UNKNOWNS.iter().fold(fit, |fit, p| fit.identify(*p)).solve().unwrap();
    let e = &report.parameters[0];
    let [low, high] = e.expanded95.unwrap();
    let half = e.coverage_factor.unwrap() * e.combined_std.unwrap();
    // E scales as the radius to the power of minus two: 1 % of it is 2 % of E.
    assert!((half / e.value.unwrap() / (2.0 * 0.02) - 1.0).abs() < 0.05, "{report}");
    assert!((high - low - 2.0 * half).abs() < 1e-9 * half);
    let text = report.to_string();
    assert!(
        text.contains("95 % interval (expanded)") && text.contains("statistical only"),
        "{text}"
    );
}
