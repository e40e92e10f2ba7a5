//! Uncertainty budgets against closed forms and against Monte Carlo.

use rodfit::fit::{
    Analysis, Correlation, Estimate, Experiment, FitFile, Frequencies, Grade, Known,
};
use rodfit::fit::{RestShape, ShapePoint};
use rodfit::scene::{Material, Scene, Shape};
use rodfit::vibration::LinearizationPoint;
use rodfit::{Fit, FitReport, Parameter, Point};

use crate::common::fits::{noisy, observe, of_a_right_mesh};
use crate::common::{coarse, straight_rod};
use crate::intervals::small;

/// Known inputs with their relative standard uncertainties.
const KNOWN: [(&str, f64); 3] =
    [("rod.shape.length", 0.004), ("rod.section.radius", 0.01), ("material.density", 0.02)];

fn named(name: &str) -> Parameter {
    name.parse().unwrap()
}

/// A known input with a relative standard uncertainty.
fn known(scene: &Scene, name: &str, part: f64) -> Known {
    Known::new(named(name), part * named(name).of(scene).unwrap())
}

/// The fit with all inputs of `KNOWN` with their uncertainties.
fn all_known(fit: Fit, scene: &Scene) -> Fit {
    KNOWN.iter().fold(fit, |fit, (name, part)| fit.known(known(scene, name, *part)))
}

/// A rod with the small deflections of a linear beam.
pub fn stiff(gravity: f64) -> Scene {
    let mut scene = straight_rod(20, [0.5, 0.005], Material::new(1200.0, 2e10));
    scene.loads.gravity = [0.0, -gravity, 0.0];
    scene
}

/// A fit of the modulus to one frequency with relative noise.
fn frequency(noise: f64) -> (Scene, Fit) {
    let scene = stiff(0.0);
    let problem = scene.problem().unwrap();
    let first = problem.modes(1, LinearizationPoint::Equilibrium).unwrap().frequencies_rad_s[0];
    let fit = Fit::new(&problem).observe(Frequencies::new(&[first], noise * first));
    (scene, fit.identify(Parameter::YoungsModulus))
}

/// The deflection of the tip with relative noise.
fn droop(scene: &Scene, noise: f64) -> RestShape {
    let tip = scene.problem().unwrap().equilibrium().unwrap().tip;
    let position = [None, Some(tip[1]), None];
    RestShape::new(vec![ShapePoint::new(Point::Tip, position)]).sigma(noise * tip[1].abs())
}

/// A stiff rod and the fit of its modulus to its static shape with this noise.
fn fit_droop(noise: f64) -> (Scene, Fit) {
    let scene = stiff(9.8);
    let fit = Fit::new(&scene.problem().unwrap()).observe(droop(&scene, noise));
    (scene, fit.identify(Parameter::YoungsModulus))
}

/// A fit of the modulus to a small oscillation, released under its weight.
fn swing() -> (Scene, Fit) {
    let mut scene = coarse(10, 1e-3, 0.15);
    scene.material.youngs_modulus = 1e10;
    let mut data = observe(&scene, 60);
    // The distance of the tip from the wall would determine the length.
    data.samples.iter_mut().for_each(|sample| sample.position[0] = None);
    let size =
        data.samples.iter().filter_map(|s| s.position[1]).fold(0.0_f64, |m, y| m.max(y.abs()));
    let data = noisy(&data, 0.02 * size, 3).sigma(0.02 * size);
    let fit = Fit::new(&scene.problem().unwrap()).observe(data);
    (scene, fit.identify(Parameter::YoungsModulus))
}

fn modulus(report: &FitReport) -> &Estimate {
    report.estimate(Parameter::YoungsModulus).unwrap()
}

/// Requires equality within the relative tolerance `part`.
#[track_caller]
fn near(found: f64, expected: f64, part: f64) {
    assert!((found / expected - 1.0).abs() < part, "{found}, expected {expected}");
}

/// Relative sensitivity of an estimate to a source.
#[track_caller]
fn relative(estimate: &Estimate, source: &str) -> f64 {
    let line = estimate.budget.iter().find(|line| line.source == source);
    line.unwrap_or_else(|| panic!("no {source}")).relative_sensitivity.unwrap()
}

/// Contribution of a source to the standard error, relative to the value.
#[track_caller]
fn contribution(estimate: &Estimate, source: &str) -> f64 {
    let line = estimate.budget.iter().find(|line| line.source == source);
    line.unwrap_or_else(|| panic!("no {source}")).contribution / estimate.value.unwrap()
}

/// `E = w^2 L^4 rho/(c r^2)` of the frequency `w` of a beam: exponents 4, -2 and 1 of length, radius and density. An oscillation
/// has the same, and a deflection `y = rho g L^4/(c E r^2)` too; the noise of `w` counts twice, that of `y` once.
#[test]
fn sensitivities_equal_the_exponents_of_the_closed_forms() {
    let (noise, slack) = (0.003, [1e-6, 1e-3, 5e-3]);
    let fits = [frequency(noise), fit_droop(noise), swing()];
    for (k, ((scene, fit), slack)) in fits.into_iter().zip(slack).enumerate() {
        let report = all_known(fit, &scene).solve().unwrap();
        println!("{report}");
        let e = modulus(&report);
        // Exponents 4, -2 and 1 of the closed form.
        near(relative(e, "rod.shape.length"), 4.0, slack);
        near(relative(e, "rod.section.radius"), -2.0, slack);
        near(relative(e, "material.density"), 1.0, slack);
        // 4 times the standard uncertainty of the length, 0.4 %.
        near(contribution(e, "rod.shape.length"), 0.016, slack);
        if k < 2 {
            let power = [2.0, 1.0][k];
            // Powers of the frequency (2) and of the deflection (1).
            near(contribution(e, "noise"), power * noise, 1e-3);
        }
        let square = |name: &str| contribution(e, name).powi(2);
        let sources = ["rod.shape.length", "rod.section.radius", "material.density", "noise"];
        let mesh = e.budget.iter().filter(|l| ["mesh", "step"].contains(&&l.source[..]));
        let mesh: f64 = mesh.map(|l| (l.contribution / e.value.unwrap()).powi(2)).sum();
        let sum = sources.iter().map(|name| square(name)).sum::<f64>() + mesh;
        // GUM: the combined variance is the sum of squared contributions.
        near(e.combined_std.unwrap() / e.value.unwrap(), sum.sqrt(), 1e-9);
        let [from, to] = e.expanded95.unwrap();
        let expanded = e.coverage_factor.unwrap() * e.combined_std.unwrap();
        // GUM: half width = coverage factor times combined uncertainty.
        near(0.5 * (to - from), expanded, 1e-9);
        near(e.coverage_factor.unwrap(), 1.95996, 1e-5);
        // Shares of the variance add up to one.
        near(e.budget.iter().map(|l| l.share).sum(), 1.0, 1e-12);
        // The standard error is that of the noise alone.
        near(e.std_error.unwrap() / e.value.unwrap(), contribution(e, "noise"), 1e-9);
    }
}

/// Random errors of all inputs and random noise in 600 fits: their spread has an error of 3 %.
#[test]
fn monte_carlo_spread_agrees_with_the_budget() {
    for (scene, fit) in [frequency(0.003), fit_droop(0.003), swing()] {
        let analysis = Analysis { monte_carlo: 600, seed: 5, ..Analysis::default() };
        let report = all_known(fit, &scene).analyse(analysis).solve().unwrap();
        let found = modulus(&report).monte_carlo.clone().unwrap();
        println!("{report}");
        // 600 fits: the standard deviation has a relative error of 3 %.
        near(found.std, found.linear_std, 0.05);
        let [low, high] = found.interval95;
        // The 95 % interval of the sample, with larger scatter.
        near(high - low, 2.0 * 1.96 * found.linear_std, 0.08);
        assert!(!report.warnings.iter().any(|w| w.contains("Monte Carlo")), "{report}");
    }
}

/// Contributions of 4 % and -4 % with the correlation `r` add up to `4 sqrt(2 - 2 r)` per cent.
#[test]
fn correlated_errors_add_with_their_signs() {
    for (correlation, expected) in [(1.0, 0.0), (0.5, 4.0), (0.0, 5.656854), (-1.0, 8.0)] {
        let (scene, fit) = frequency(1e-9);
        // 1 % of the length is 4 % of E, 2 % of the radius -4 %.
        let radius = named("rod.section.radius");
        let length = known(&scene, "rod.shape.length", 0.01).correlated(radius, correlation);
        let quiet = Analysis {
            discretization_error: rodfit::fit::Refinement::None,
            monte_carlo: 100,
            ..Analysis::default()
        };
        let fit = fit.known(known(&scene, "rod.section.radius", 0.02)).known(length).analyse(quiet);
        let report = fit.solve().unwrap();
        let e = modulus(&report);
        let percent = 100.0 * e.combined_std.unwrap() / e.value.unwrap();
        // `4 sqrt(2 - 2 r)` per cent.
        assert!((percent - expected).abs() < 1e-4, "{correlation}: {percent}");
        // The Monte Carlo has the same correlation; where the contributions cancel, a second-order spread remains.
        let drawn = 100.0 * e.monte_carlo.as_ref().unwrap().std / e.value.unwrap();
        assert!((drawn - expected).abs() < 0.25 * expected + 0.2, "{correlation}: {drawn}");
    }
}

/// A shared length error of 1 % is 4 % of E; independent ones of two experiments are `4/sqrt(2)` per cent.
#[test]
fn experiments_share_an_error_or_have_their_own() {
    let scene = stiff(9.8);
    let problem = scene.problem().unwrap();
    let percent = |knowns: Vec<Known>| {
        let both =
            ["one", "two"].map(|name| Experiment::new(name, &problem).observe(droop(&scene, 1e-6)));
        let fit = Fit::of(both).identify(Parameter::YoungsModulus);
        let report = knowns.into_iter().fold(fit, Fit::known).solve().unwrap();
        let e = modulus(&report);
        let own = e.budget.iter().filter(|line| line.std.is_some());
        let square: f64 = own.map(|line| line.contribution.powi(2)).sum();
        100.0 * square.sqrt() / e.value.unwrap()
    };
    let length = known(&scene, "rod.shape.length", 0.01);
    // 4 times 1 %, shared; independent errors of two experiments average.
    near(percent(vec![length.clone()]), 4.0, 1e-3);
    let own = |name: &str| length.clone().of_experiment(name);
    near(percent(vec![own("one"), own("two")]), 4.0 / 2.0_f64.sqrt(), 1e-3);
}

/// Eight values and one unknown: Student's t of seven degrees of freedom, 2.3646. A dominant known input has the normal factor.
#[test]
fn few_values_increase_the_coverage_factor() {
    let scene = small(0.3);
    let data = noisy(&observe(&scene, 4), 1e-4, 1);
    let fit = |known: Option<Known>| {
        let fit = Fit::new(&scene.problem().unwrap()).observe(data.clone());
        let fit = fit.identify(Parameter::YoungsModulus).analyse(crate::common::fits::same_mesh());
        known.into_iter().fold(fit, Fit::known).solve().unwrap()
    };
    let report = fit(None);
    let e = modulus(&report);
    // Quantile of Student's t with seven degrees of freedom.
    near(e.coverage_factor.unwrap(), 2.364624, 1e-5);
    let [low, high] = e.interval95.unwrap();
    let [from, to] = e.expanded95.unwrap();
    // Without inputs the expanded interval is the statistical one.
    near(to - from, high - low, 1e-4);
    let report = fit(Some(known(&scene, "rod.shape.length", 0.01)));
    // A dominant normal input has a factor near 1.96.
    assert!(modulus(&report).coverage_factor.unwrap() < 1.97, "{report}");
}

/// Sensitivities to inputs cost one run with derivatives, and omitted effects a run of a coarse model.
#[test]
fn all_inputs_have_sensitivities_and_cost_one_run() {
    let (scene, fit) = swing();
    let asked = Analysis { sensitivity_analysis: Some(true), ..Analysis::default() };
    let fit = fit.analyse(asked);
    let report = fit.clone().solve().unwrap();
    println!("{report}");
    let e = modulus(&report);
    let all: Vec<(&str, f64)> =
        e.input_sensitivities.iter().map(|p| (&p.source[..], p.relative.unwrap())).collect();
    let of = |name: &str| all.iter().find(|(source, _)| *source == name).unwrap().1;
    assert_eq!(all[0].0, "rod.shape.length");
    // Exponents 4, -2 and 1 of the closed form, in per cent per per cent.
    near(100.0 * of("rod.shape.length"), 4.0, 0.02);
    near(100.0 * of("rod.section.radius"), -2.0, 0.02);
    near(100.0 * of("material.density"), 1.0, 0.02);
    assert!(all.iter().any(|(source, _)| *source == "loads.gravity"), "{all:?}");
    assert!(all.iter().any(|(source, _)| *source == "camera.pixel_scale"), "{all:?}");
    let text = report.to_string();
    let title = "Input sensitivities: change of youngs_modulus for +1 % of an input";
    assert!(text.contains(title) && text.contains("rod.shape.length "), "{report}");
    // A known input is in the budget instead.
    let length = known(&scene, "rod.shape.length", 0.01);
    let stated = fit.clone().known(length).solve().unwrap();
    assert!(modulus(&stated).input_sensitivities.iter().all(|p| p.source != "rod.shape.length"));
    let quiet = Analysis { sensitivity_analysis: Some(false), ..Analysis::default() };
    let quiet = fit.analyse(quiet).solve().unwrap();
    assert!(modulus(&quiet).input_sensitivities.is_empty());
    // One more run with derivatives, as stated above.
    assert!(report.simulations < 1.3 * quiet.simulations + 1.0, "{report}\n{quiet}");
}

/// Contradictory inputs are rejected before any computation, with the allowed values.
#[test]
fn contradictory_known_inputs_are_rejected() {
    let folder = std::env::current_dir().unwrap().join("data");
    let head = "scene = \"cantilever.toml\"\nobservation = [{ file = \"cantilever-tip.csv\" }]\n";
    let modulus = "[[parameter]]\nname = \"youngs_modulus\"\n";
    let with_prior =
        "[[parameter]]\nname = \"youngs_modulus\"\nprior = { mean = 1e8, sigma = 1e7 }\n";
    let radius = "[[known]]\nname = \"radius\"\nsigma = 1e-5\n";
    let length = "[[known]]\nname = \"rod.shape.length\"\nsigma = 1e-3\n";
    let cases = [
        (
            modulus,
            "[[known]]\nname = \"youngs_modulus\"\nsigma = 1e6\n",
            "which is a parameter of the fit",
        ),
        (modulus, "[[known]]\nname = \"radius\"\nsigma = 1e160\n", "up to 1e100"),
        (with_prior, "[[known]]\nname = \"youngs_modulus\"\nsigma = 1e6\n", "which has a prior"),
        (modulus, "[[known]]\nname = \"radius\"\nsigma = 0.0\n", "known[0].sigma"),
        (modulus, "[[known]]\nname = \"radius\"\n", "sigma"),
        (modulus, "[[known]]\nname = \"width\"\nsigma = 1.0\n", "rectangular"),
        (modulus, &format!("{radius}{radius}"), "each name once"),
        (
            modulus,
            &format!("{radius}correlation = [{{ with = \"density\", value = 0.5 }}]\n"),
            "[[known]]",
        ),
        (
            modulus,
            &format!(
                "{length}{radius}correlation = [{{ with = \"rod.shape.length\", value = 1.5 }}]\n"
            ),
            "-1 .. 1",
        ),
        (modulus, &format!("{radius}experiment = \"other\"\n"), "experiment"),
    ];
    for (parameter, known, words) in cases {
        let error = FitFile::from_toml(&format!("{head}{parameter}{known}"), &folder).unwrap_err();
        assert!(error.to_string().contains(words), "{known}: {error}");
    }
    // Correlations of 0.9, 0.9 and -0.9 have no positive semidefinite matrix.
    let [a, b, c] = ["radius", "density", "rod.shape.length"].map(named);
    let with = |with, value| Correlation { with, experiment: None, value };
    let one = Known { correlations: vec![with(b, 0.9), with(c, 0.9)], ..Known::new(a, 1.0) };
    let two = Known::new(b, 1.0).correlated(c, -0.9);
    let (_, fit) = swing();
    let error = fit.known(one).known(two).known(Known::new(c, 1.0)).solve().unwrap_err();
    assert!(error.to_string().contains("negative eigenvalues"), "{error}");
}

/// An error of a known length within its uncertainty explains the residuals that it causes: they are neither noise nor a fault of
/// the model. A larger error is a warning.
#[test]
fn error_of_a_known_input_explains_its_residuals() {
    let true_length = 0.5 * 1.006;
    let mut scene = coarse(10, 2e-3, 0.4);
    let nominal = scene.clone();
    scene.rod.shape = Shape::Straight { length: true_length, direction: [1.0, 0.0, 0.0] };
    let data = noisy(&observe(&scene, 80), 2e-4, 9);
    let solved = |scene: &Scene, sigma: Option<f64>| {
        let fit = Fit::new(&scene.problem().unwrap()).observe(data.clone());
        let fit = fit.identify(Parameter::YoungsModulus).analyse(of_a_right_mesh());
        let known = sigma.map(|sigma| Known::new(named("rod.shape.length"), sigma));
        known.into_iter().fold(fit, Fit::known).solve().unwrap()
    };
    let (right, wrong) = (solved(&scene, None), solved(&nominal, None));
    assert_eq!((right.grade, wrong.grade), (Grade::Trustworthy, Grade::ModelDoesNotExplain));
    let report = solved(&nominal, Some(2e-3));
    println!("{report}");
    assert_eq!(report.grade, Grade::Trustworthy, "{report}");
    let relative =
        |report: &FitReport| modulus(report).std_error.unwrap() / modulus(report).value.unwrap();
    // The uncertainty of the estimate is that of a fit with the right length, but for the noise.
    near(relative(&report), relative(&right), 0.25);
    // Without the known input the residuals increase the error.
    assert!(relative(&wrong) > 3.0 * relative(&right));
    // The noise of the data, 2e-4 m.
    near(report.sigma[0], 2e-4, 0.1);
    // The reported residuals are the measured ones.
    near(report.residual_rms, wrong.residual_rms, 1e-6);
    let e = modulus(&report);
    let [from, to] = e.expanded95.unwrap();
    assert!((from..to).contains(&1e8));
    let report = solved(&nominal, Some(2e-4));
    let contradicts = |w: &String| {
        w.contains("contradict the stated rod.shape.length by")
            && w.contains("standard uncertainties")
    };
    assert!(report.warnings.iter().any(contradicts), "{report}");
    assert_eq!(report.grade, Grade::ModelDoesNotExplain);
}
