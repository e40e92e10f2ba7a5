//! Expected uncertainty of planned data against fits of such data, other plans and closed forms.

use nalgebra::DMatrix;
use rodfit::fit::{Advice, Choice, Design, DesignVariable, Frequencies, Known, RestShape};
use rodfit::scene::Scene;
use rodfit::vibration::LinearizationPoint;
use rodfit::{Fit, Observation, Parameter, Point};

use crate::budget::stiff;
use crate::common::coarse;
use crate::common::fits::{fit_with, mean_and_spread, noisy, observe, same_mesh, value};

const SIGMA: f64 = 1e-3;
const RATE: f64 = 100.0;
const BOTH: [Parameter; 2] = [Parameter::YoungsModulus, Parameter::DampingMass];

/// A damped cantilever.
fn scene() -> Scene {
    let mut scene = coarse(10, 4e-3, 0.8);
    scene.loads.damping.mass = 0.8;
    scene
}

/// A planned observation of the tip: duration, s, rate, 1/s, and the noise `SIGMA`.
fn planned(duration: f64, rate: f64) -> Observation {
    Observation::planned(duration, rate).unwrap().sigma(SIGMA)
}

/// The design of an experiment that identifies both parameters.
fn design(scene: &Scene, plan: Observation) -> Design {
    let fit = Fit::new(&scene.problem().unwrap()).observe(plan);
    BOTH.iter().fold(fit, |fit, p| fit.identify(*p)).design().unwrap()
}

fn errors(design: &Design) -> Vec<Option<f64>> {
    design.parameters.iter().map(|e| e.std_error).collect()
}

/// Requires that all pairs exist and agree within the relative tolerance `part`.
#[track_caller]
fn near(found: &[Option<f64>], expected: &[Option<f64>], part: f64) {
    assert_eq!(found.len(), expected.len());
    for pair in found.iter().zip(expected) {
        let (Some(a), Some(b)) = pair else { panic!("{pair:?}") };
        assert!((a / b - 1.0).abs() < part, "{a}, expected {b}");
    }
}

/// Exact data at the planned times.
fn as_planned(scene: &Scene) -> Observation {
    observe(scene, 80).sigma(SIGMA)
}

/// Standard errors are the roots of the diagonal of `(J'J)^-1` at the same values, to rounding.
#[test]
fn expected_errors_equal_those_of_the_normal_matrix() {
    let scene = scene();
    let fit = Fit::new(&scene.problem().unwrap()).observe(as_planned(&scene));
    let fit = BOTH.iter().fold(fit, |fit, p| fit.identify(*p));
    let values = BOTH.map(|p| p.of(&scene).unwrap());
    let rows = fit.residuals().unwrap().jacobian_at(&values.map(f64::ln)).unwrap();
    let j = DMatrix::from_fn(rows.len(), 2, |i, k| rows[i][k]);
    let covariance = j.tr_mul(&j).try_inverse().unwrap();
    let expected = [0, 1].map(|k| Some(covariance[(k, k)].sqrt() * values[k]));
    // Both are computed by the same derivatives.
    near(&errors(&design(&scene, planned(0.8, RATE))), &expected, 1e-6);
    // A design uses only the times of data.
    near(&errors(&design(&scene, noisy(&as_planned(&scene), 0.1, 3))), &expected, 1e-6);
}

/// 120 fits of random data have the expected spread and standard errors.
#[test]
fn spread_of_fits_equals_the_expected_error() {
    let scene = scene();
    let expected = errors(&design(&scene, planned(0.8, RATE)));
    let clean = as_planned(&scene);
    let (mut found, mut standard_errors) = ([Vec::new(), Vec::new()], Vec::new());
    for seed in 0..120 {
        let report = fit_with(&scene, &noisy(&clean, SIGMA, seed), &BOTH, same_mesh());
        for (k, parameter) in BOTH.iter().enumerate() {
            found[k].push(value(&report, *parameter));
        }
        standard_errors.push(report.estimate(BOTH[0]).unwrap().std_error.unwrap());
    }
    // The median: some fits take white noise for autocorrelated noise by chance.
    standard_errors.sort_by(f64::total_cmp);
    near(&[Some(standard_errors[standard_errors.len() / 2])], &expected[..1], 0.02);
    for (values, expected) in found.iter().zip(expected) {
        let [_, spread] = mean_and_spread(values);
        // The spread of n values has the relative standard error 1/sqrt(2 n).
        near(&[Some(spread)], &[expected], 3.0 / (2.0 * values.len() as f64).sqrt());
    }
}

/// The advice of a design on a variable, and its best choice.
fn advice(design: &Design, variable: DesignVariable) -> (&Advice, &Choice) {
    let advice = design.advice.iter().find(|a| a.variable == variable).unwrap();
    let best: Vec<&Choice> = advice.choices.iter().filter(|c| c.best).collect();
    assert!(advice.choices.windows(2).all(|c| c[0].value < c[1].value));
    assert_eq!((best.len(), advice.choices.iter().filter(|c| c.planned).count()), (1, 1));
    (advice, best[0])
}

/// The errors of a choice are those of a plan with it.
#[test]
fn choices_have_the_errors_of_their_plans() {
    let scene = scene();
    let whole = design(&scene, planned(0.4, RATE));
    let (places, best) = advice(&whole, DesignVariable::MarkerPosition);
    for choice in [&places.choices[4], &places.choices[9]] {
        let plan = planned(0.4, RATE).at(Point::ArcLength(choice.value));
        // The error of a choice is that of its plan: rounding errors.
        near(&choice.std_error, &errors(&design(&scene, plan)), 1e-9);
    }
    assert_eq!((best.value, best.planned), (0.5, true));
    let (lengths, best) = advice(&whole, DesignVariable::Duration);
    for choice in lengths.choices.iter().filter(|c| c.value > 0.15) {
        // As above.
        near(&choice.std_error, &errors(&design(&scene, planned(choice.value, RATE))), 1e-9);
    }
    // The longest duration, twice the planned one, is the best.
    assert_eq!(best.value, 0.8);
    let (rates, best) = advice(&whole, DesignVariable::FrameRate);
    for choice in rates.choices.iter().filter(|c| c.value > 20.0) {
        // As above.
        near(&choice.std_error, &errors(&design(&scene, planned(0.4, choice.value))), 1e-9);
    }
    // The highest frame rate, four times the planned one, is the best.
    assert!((best.value / (4.0 * RATE) - 1.0).abs() < 1e-9);
}

/// Independent noise of n frames: errors scale as `1/sqrt(n)`.
#[test]
fn errors_scale_as_the_inverse_root_of_the_frame_rate() {
    let design = design(&scene(), planned(0.8, 1000.0));
    let (rates, _) = advice(&design, DesignVariable::FrameRate);
    for pair in rates.choices.windows(2).skip(1) {
        let ratio = (pair[1].value / pair[0].value).sqrt();
        let expected: Vec<_> = pair[0].std_error.iter().map(|e| Some(e.unwrap() / ratio)).collect();
        // Independent noise of n frames: 1/sqrt(n).
        near(&pair[1].std_error, &expected, 0.02);
    }
}

/// A deflection scales as 1/E, a frequency as its root: 1 % of them is 1 % and 2 % of E.
#[test]
fn errors_of_deflection_and_frequency_equal_closed_forms() {
    let scene = stiff(9.8);
    let problem = scene.problem().unwrap();
    let droop = -problem.equilibrium().unwrap().tip[1];
    let modulus = 2e10;
    let plan = RestShape::planned(&[0.5]).sigma(0.01 * droop);
    let radius = Known::new(Parameter::Radius, 5e-5);
    let fit = Fit::new(&problem).observe(plan).identify(Parameter::YoungsModulus).known(radius);
    let design = fit.design().unwrap();
    // A deflection is proportional to 1/E: 1 % of it is 1 % of E.
    near(&errors(&design), &[Some(0.01 * modulus)], 1e-3);
    // The deflection under the own weight scales as r^-2.
    let combined = modulus * 0.01_f64.hypot(2.0 * 0.01);
    near(&[design.parameters[0].combined_std], &[Some(combined)], 1e-3);

    let frequency = problem.modes(1, LinearizationPoint::Equilibrium).unwrap().frequencies_rad_s[0];
    let rings = Frequencies::new(&[7.0], 0.01 * frequency);
    let fit = Fit::new(&problem).observe(rings).identify(Parameter::YoungsModulus);
    // A frequency is proportional to sqrt(E): 1 % of it is 2 % of E.
    near(&errors(&fit.design().unwrap()), &[Some(0.02 * modulus)], 1e-3);
}

/// Modulus and density enter only as a ratio, whatever the choice. A plan has no data to fit.
#[test]
fn ratio_is_never_identifiable_and_a_plan_cannot_be_fitted() {
    let scene = scene();
    let fit = Fit::new(&scene.problem().unwrap()).observe(planned(0.4, RATE));
    let fit = fit.identify(Parameter::YoungsModulus).identify(Parameter::Density);
    let design = fit.design().unwrap();
    assert_eq!(design.never_identifiable, ["youngs_modulus", "density"]);
    assert!(design.not_identifiable[0].description.contains("youngs_modulus/density"));
    let refused = fit.solve().unwrap_err().to_string();
    assert!(refused.contains("observation[0].file") && refused.contains("planned"), "{refused}");
}

/// The information of independent measurements, inverse variances, adds up.
#[test]
fn contributions_of_independent_measurements_add_up() {
    let problem = scene().problem().unwrap();
    let fit = Fit::new(&problem)
        .observe(planned(0.8, RATE))
        .observe(planned(0.4, RATE).at(Point::ArcLength(0.25)))
        .identify(Parameter::YoungsModulus);
    let design = fit.design().unwrap();
    assert_eq!(design.contributions.len(), 2);
    let information = |error: Option<f64>| error.unwrap().powi(-2);
    let all = information(design.parameters[0].std_error);
    let [first, second] = [0, 1].map(|k| information(design.contributions[k].std_error_alone[0]));
    // Information of independent measurements adds up.
    assert!(((first + second) / all - 1.0).abs() < 1e-9, "{first:e} {second:e} {all:e}");
    let without: Vec<f64> =
        design.contributions.iter().map(|c| information(c.std_error_without[0])).collect();
    assert!((without[0] / second - 1.0).abs() < 1e-9 && (without[1] / first - 1.0).abs() < 1e-9);
    assert!(first > second, "a longer record of the tip has more information");
}
