//! Sensitivities to inputs against refits with the input changed.

use rodfit::fit::{Analysis, Experiment, Known};
use rodfit::scene::{Along, Linear, Scene, Scheme, Section};
use rodfit::{Fit, FitReport, Observation, Parameter, Unknown};

use crate::common::coarse;
use crate::common::fits::{noisy, observe, of_a_right_mesh, value};

const INPUTS: [&str; 4] =
    ["rod.shape.length", "material.density", "loads.gravity.y", "rod.section.radius"];

/// Relative change of an input for a refit.
const CHANGE: f64 = 1e-3;
/// Sensitivities below this, in per cent of a parameter per per cent of an input, are compared to this.
const SMALL: f64 = 0.3;

fn parameter(name: &str) -> Parameter {
    name.parse().unwrap()
}

/// Uncertainty of the number `name` of 1 % of its size.
fn known(scene: &Scene, name: &str) -> Known {
    Known::new(parameter(name), 0.01 * parameter(name).of(scene).unwrap().abs())
}

fn fit(scene: &Scene, data: &Observation, unknowns: &[Parameter]) -> Fit {
    // Sensitivities are those of the exact minimum: the tolerance of the search is tight.
    let analysis = Analysis { tolerance: 1e-7, ..of_a_right_mesh() };
    let fit = Fit::new(&scene.problem().unwrap()).observe(data.clone()).analyse(analysis);
    unknowns.iter().fold(fit, |fit, unknown| fit.identify(*unknown))
}

/// Per cent of a parameter per per cent of an input, as the report has it.
fn reported(report: &FitReport, unknown: Parameter, input: &str) -> f64 {
    let estimate = report.estimate(unknown).unwrap();
    let vector = input.strip_suffix(".y").unwrap_or(input);
    let line = estimate.input_sensitivities.iter().find(|line| line.source == vector);
    line.map_or(0.0, |line| 100.0 * line.relative.unwrap())
}

/// The same by refits with the input larger and smaller by 0.1 %.
fn refitted(scene: &Scene, data: &Observation, unknowns: &[Parameter], input: &str) -> Vec<f64> {
    let size = parameter(input).of(scene).unwrap();
    let [high, low] = [1.0, -1.0].map(|side| {
        let problem = scene.problem().unwrap();
        let other = problem.with([(parameter(input), size * (1.0 + side * CHANGE))]).unwrap();
        fit(other.scene(), data, unknowns).solve().unwrap()
    });
    let of = |unknown: &Parameter| {
        (value(&high, *unknown) / value(&low, *unknown)).ln() / (2.0 * CHANGE)
    };
    unknowns.iter().map(of).collect()
}

/// Sensitivities to every input within 10 % of refits, and those of the budget the same to 1e-6.
#[track_caller]
fn check(scene: &Scene, data: &Observation, unknowns: &[Parameter]) {
    let report = fit(scene, data, unknowns).solve().unwrap();
    println!("{report}");
    let inputs = INPUTS.iter().filter(|input| parameter(input).of(scene).is_some());
    let inputs: Vec<&str> = inputs.copied().collect();
    let with_known =
        inputs.iter().fold(fit(scene, data, unknowns), |fit, input| fit.known(known(scene, input)));
    let budget = with_known.solve().unwrap();
    for input in inputs {
        let expected = refitted(scene, data, unknowns, input);
        for (unknown, expected) in unknowns.iter().zip(expected) {
            let found = reported(&report, *unknown, input);
            println!("{input} {unknown}: {found:.4}, refit {expected:.4}");
            // The stated tolerance of 10 %; small sensitivities are compared on the scale of `SMALL`.
            assert!(
                (found - expected).abs() < 0.1 * expected.abs().max(SMALL),
                "{input}, {unknown}: {found}, refits {expected}"
            );
            let lines = &budget.estimate(*unknown).unwrap().budget;
            let line = lines.iter().find(|line| line.source == input).unwrap();
            // A negative input has a relative sensitivity too.
            let in_budget = line.relative_sensitivity.unwrap();
            assert!(
                (in_budget - found).abs() < 1e-6 * found.abs()
                    || found == 0.0 && in_budget.abs() < 1e-3,
                "{input}, {unknown}: {found}, budget {in_budget}"
            );
        }
    }
}

/// A limp strip of silicone with fast motion, which Kelvin-Voigt damping ends.
fn limp_strip() -> Scene {
    let mut scene = crate::sensitivity_growth::limp_strip(0.004, 1.2);
    scene.rod.section = Section::Circle { radius: 1.5e-3 };
    scene
}

#[test]
fn sensitivities_of_a_limp_strip_equal_those_of_refits() {
    let scene = limp_strip();
    let data = noisy(&observe(&scene, 144), 5e-4, 7);
    let unknowns = [Parameter::YoungsModulus, Parameter::DampingMass, Parameter::DampingStiffness];
    check(&scene, &data, &unknowns);
}

#[test]
fn sensitivities_of_a_long_vibration_equal_those_of_refits() {
    let mut scene = coarse(16, 2e-3, 4.0);
    scene.loads.damping.mass = 0.5;
    let data = noisy(&observe(&scene, 400), 1e-3, 11);
    check(&scene, &data, &[Parameter::YoungsModulus, Parameter::DampingMass]);
}

/// The model lacks the taper of the rod: the residuals are far beyond the noise.
#[test]
fn sensitivities_beside_a_missing_effect_equal_those_of_refits() {
    let mut scene = coarse(16, 2e-3, 1.2);
    scene.loads.damping.mass = 0.5;
    let mut truth = scene.clone();
    truth.rod.taper.radius = Some(Along::Linear(Linear { from: 1.0, to: 0.8 }));
    let data = noisy(&observe(&truth, 200), 1e-4, 13);
    check(&scene, &data, &[Parameter::YoungsModulus, Parameter::DampingMass]);
}

/// A number that one of two experiments identifies is an input of the other one only: the sensitivities of the first are those
/// of a fit of it alone.
#[test]
fn number_identified_in_one_experiment_is_no_input_there() {
    let mut scene = coarse(16, 2e-3, 0.6);
    scene.loads.damping.mass = 0.5;
    let mut truth = scene.clone();
    truth.material.youngs_modulus *= 0.7;
    let data = noisy(&observe(&truth, 80), 1e-4, 13);
    let own = |name: &str, data: &Observation| {
        Experiment::new(name, &scene.problem().unwrap()).observe(data.clone().sigma(1e-4))
    };
    let of = |parameter: Parameter, name: &str| Unknown::new(parameter).of_experiment(name);
    let modulus = of(Parameter::YoungsModulus, "a");
    let analysis = Analysis { tolerance: 1e-7, ..of_a_right_mesh() };
    let alone = Fit::of([own("a", &data)]).identify(modulus.clone()).analyse(analysis.clone());
    let other = noisy(&observe(&scene, 80), 1e-4, 14);
    let both = Fit::of([own("a", &data), own("b", &other)]).analyse(analysis);
    let both = both.identify(modulus).identify(of(Parameter::DampingMass, "b"));
    let (alone, both) = (alone.solve().unwrap(), both.solve().unwrap());
    for input in ["rod.shape.length", "rod.section.radius", "material.density"] {
        let [one, two] = [&alone, &both].map(|r| reported(r, Parameter::YoungsModulus, input));
        assert!((one / two - 1.0).abs() < 1e-4, "{input}: {one} {two}");
    }
}

/// Numbers of contacts are inputs, but neither lengths of directions nor the speed that regularizes friction.
#[test]
fn numbers_of_contacts_are_inputs() {
    let mut scene = coarse(16, 2e-3, 0.6);
    scene.loads.damping.mass = 0.5;
    scene.time.as_mut().unwrap().scheme = Scheme::GeneralisedAlpha;
    let contact = "kind = \"plane\"\npoint = [0, -0.05, 0]\nnormal = [0, 2, 0]\nstiffness = 1e7\n\
                   friction = 0.2\nslip_velocity = 0.01\n";
    scene.contacts = vec![toml::from_str(contact).unwrap()];
    let data = noisy(&observe(&scene, 100), 1e-4, 3);
    let report = fit(&scene, &data, &[Parameter::YoungsModulus]).solve().unwrap();
    let estimate = report.estimate(Parameter::YoungsModulus).unwrap();
    let sources: Vec<&str> =
        estimate.input_sensitivities.iter().map(|line| &line.source[..]).collect();
    println!("{sources:?}");
    for own in
        ["rod.shape.length", "contacts.0.stiffness", "contacts.0.friction", "contacts.0.point"]
    {
        assert!(sources.contains(&own), "{own}: {sources:?}");
    }
    let is_left_out = |own: &&str| own.contains("normal") || own.contains("slip_velocity");
    assert!(!sources.iter().any(is_left_out), "{sources:?}");
}
