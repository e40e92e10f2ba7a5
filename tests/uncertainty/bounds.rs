//! One-sided bounds: dampings near zero, and parameters whose likelihood is flat on one side.

use rodfit::fit::{
    Analysis, Channel, Observation, ReactionPart, Reading, RestShape, Sample, Sensor, ShapePoint,
};
use rodfit::scene::{End, Material, Scene, Time};
use rodfit::{Code, Fit, Parameter, Point, Unknown};

use crate::common::fits::{noisy, same_mesh};
use crate::common::{simulate, straight_rod};

/// A horizontal rod that is released; without `segments` the program chooses the mesh.
fn falling(segments: Option<usize>, damping: f64) -> Scene {
    let material = Material { poisson_ratio: Some(0.5), ..Material::new(1300.0, 1.602e8) };
    let mut scene = straight_rod(24, [0.3, 1.5e-3], material);
    scene.rod.segments = segments;
    scene.loads.gravity = [0.0, -9.81, 0.0];
    scene.loads.damping.mass = damping;
    scene.time = Some(Time::new(0.81, 5e-4));
    scene
}

/// The tip at `count` times.
fn tip(scene: &Scene, count: usize, end: f64) -> Observation {
    let run = simulate(scene);
    let sample = |k: usize| {
        let time = end * k as f64 / count as f64;
        let [x, y, _] = run.at(Point::Tip, time).unwrap().0;
        Sample { time, position: [Some(x), Some(y), None] }
    };
    Observation::new((0..=count).map(sample).collect())
}

/// On the first, coarse mesh the damping of some seeds is below zero; on the final one it is not, and must get up again.
/// Before, 3 of 40 undamped recordings had no bound, and 35 of 40 slightly damped ones.
#[test]
fn damping_near_zero_always_has_a_bound_that_covers() {
    let mut open = falling(None, 0.0).to_toml().unwrap();
    open = open.lines().filter(|line| !line.starts_with("step")).collect::<Vec<_>>().join("\n");
    let problem = Scene::from_toml(&open, ".").unwrap().problem().unwrap();
    // The standard error is 1.4e-3 1/s.
    for (truth, least) in [(0.0, 32), (4e-3, 26)] {
        let clean = tip(&falling(Some(120), truth), 200, 0.8);
        let (mut covered, mut bounded) = (0, 0);
        for seed in 0..32 {
            let fit = Fit::new(&problem)
                .observe(noisy(&clean, 3.95e-4, seed))
                .identify(Parameter::YoungsModulus)
                .identify(Parameter::DampingMass)
                .analyse(Analysis { sensitivity_analysis: Some(false), ..Analysis::default() });
            let report = fit.solve().unwrap();
            let damping = &report.parameters[1];
            assert!(report.is_success() && damping.identifiable, "{seed}: {report}");
            let [low, high] = damping.interval95.unwrap();
            // The data exclude a damping of 0.02 1/s.
            assert!(high < 0.02, "{seed}: {report}");
            covered += usize::from(low <= truth && truth <= high);
            bounded += usize::from(damping.upper95.is_some());
        }
        println!("{truth}: {covered} covered, {bounded} one-sided of 32");
        // Of 32 intervals 30 cover on average; three standard deviations fewer are 26.
        assert!(covered >= least, "{truth}: {covered}");
        // Zero is more than three standard errors off once in 700 times.
        assert!(truth > 0.0 || bounded >= 31, "{bounded}");
    }
}

/// A cantilever so stiff that the noise hides its bending, with a marker on a tip that a force pulls.
fn stiff(modulus: f64) -> Scene {
    let text = format!(
        "[rod]\nshape = {{ kind = \"helix\", length = 0.03132, radius = 7.287e-4, pitch = 1.474e-3, \
         axis = [0, 0, -1], handedness = \"right\" }}\n\
         section = {{ kind = \"circle\", radius = 5.433e-5 }}\nsegments = 57\n\
         discretization = \"corrected-statics\"\n\
         [material]\ndensity = 1236.0\nyoungs_modulus = {modulus}\nshear_modulus = 7.5e9\n\
         [supports]\nstart = \"pinned\"\n\
         [loads]\ndamping = {{ mass = 3.768 }}\n\
         point = [{{ node = \"tip\", force = [-1.094e-6, 9.578e-7, 5.536e-7] }}]\n\
         [time]\nend = 0.02634\nstep = 6.85e-5\nscheme = \"newmark-beta\"\n"
    );
    Scene::from_toml(&text, ".").unwrap()
}

/// From start values on both sides of the truth the result is a lower bound, not a value with an error of 5 %. The
/// exact Hessian gives no error of it either, but one of the damping.
#[test]
fn modulus_without_visible_bending_is_bounded_from_below() {
    let (truth, sigma) = (1.9e10, 5.1e-5);
    let run = simulate(&stiff(truth));
    let sample = |k: usize| {
        let time = 0.026 * k as f64 / 100.0;
        Sample { time, position: run.at(Point::Tip, time).unwrap().0.map(Some) }
    };
    let clean = Observation::new((0..=100).map(sample).collect());
    let problem = stiff(5e10).problem().unwrap();
    let mut bounds = Vec::new();
    for (seed, start) in [(0, None), (1, None), (0, Some(0.1 * truth)), (0, Some(100.0 * truth))] {
        let modulus = Unknown::new(Parameter::YoungsModulus);
        let unknown = match start {
            Some(start) => modulus.start(start),
            None => modulus,
        };
        let report = Fit::new(&problem)
            .observe(noisy(&clean, sigma, seed).sigma(sigma))
            .identify(Parameter::DampingMass)
            .identify(unknown)
            .analyse(Analysis {
                sensitivity_analysis: Some(false),
                observed_information: seed == 1,
                ..Analysis::default()
            })
            .solve()
            .unwrap();
        let [damping, modulus] = &report.parameters[..] else { panic!("{report}") };
        assert_eq!(damping.observed_std_error.is_some(), seed == 1, "{report}");
        assert!(modulus.observed_std_error.is_none(), "{report}");
        println!("{seed} {start:?}: {:?}, {:.0} simulations", modulus.lower95, report.simulations);
        assert!(report.is_success() && modulus.identifiable, "{report}");
        assert!(modulus.interval95.is_none() && modulus.std_error.is_none(), "{report}");
        assert!(modulus.upper95.is_none() && modulus.lower95.unwrap() < truth, "{report}");
        assert!(report.warning_codes.contains(&Code::OneSided), "{report}");
        assert!(report.to_string().contains("at least") && report.in_a_line().contains("at least"));
        let [low, high] = damping.interval95.unwrap();
        // The damping is determined: its interval overlaps 3 to 4.5 1/s.
        assert!(low < 4.5 && 3.0 < high, "{report}");
        bounds.push(modulus.lower95.unwrap());
    }
    // The one recording bounds it alike from all starts.
    assert!(bounds.iter().all(|bound| *bound > 1e8), "{bounds:?}");
    let [first, .., far] = bounds[..] else { panic!("{bounds:?}") };
    assert!((far / first).ln().abs() < 1.0, "{bounds:?}");
}

/// A modulus that the data determine has an interval, and the scan is not flat.
#[test]
fn modulus_with_visible_bending_has_an_interval() {
    let clean = tip(&falling(Some(24), 0.1), 100, 0.8);
    let problem = falling(Some(24), 0.1).problem().unwrap();
    let fit = Fit::new(&problem).observe(noisy(&clean, 1e-3, 1)).identify(Parameter::YoungsModulus);
    let report = fit.solve().unwrap();
    assert!(report.parameters[0].interval95.is_some(), "{report}");
    // An upper bound of the cost.
    assert!(report.parameters[0].lower95.is_none() && report.simulations < 12.0, "{report}");
}

/// A damping that nothing observed depends on has no bound: its profile is flat to its largest value.
#[test]
fn damping_of_a_rod_at_rest_has_no_bound() {
    let mut scene = falling(Some(24), 0.1);
    scene.time = None;
    let droop = scene.problem().unwrap().equilibrium().unwrap();
    let sighting = |k: usize| {
        let position = droop.nodes[2 * k].map(Some);
        ShapePoint::new(Point::Node(2 * k), position)
    };
    let shape = RestShape::new((1..=12).map(sighting).collect()).sigma(1e-4);
    let report = Fit::new(&scene.problem().unwrap())
        .observe(shape)
        .identify(Parameter::YoungsModulus)
        .identify(Parameter::DampingMass)
        .solve()
        .unwrap();
    let damping = &report.parameters[1];
    assert!(!damping.identifiable && damping.upper95.is_none(), "{report}");
    assert!(damping.lower95.is_none() && report.parameters[0].interval95.is_some(), "{report}");
}

/// Readings of the weight in a wrong unit give a density beyond the largest one of the search, 20 000 kg/m^3. They
/// determine it as well as any other: it has the interval of the mean of the readings, and no one-sided bound.
#[test]
fn density_beyond_the_scan_has_an_interval() {
    let mut scene = falling(Some(12), 0.0);
    scene.time = None;
    scene.material.youngs_modulus = 1e12;
    let density = 1.3e6;
    let weight = density * 9.81 * 0.3 * std::f64::consts::PI * 1.5e-3_f64.powi(2);
    // Deviations of +-1 % with the mean zero, in no order.
    let reading = |sign: char| {
        let deviation = if sign == '+' { 0.01 } else { -0.01 };
        Reading { time: None, value: weight * (1.0 + deviation) }
    };
    let readings = "++-+--+++--+-+---++-".chars().map(reading).collect();
    let channel = Channel::along_world(End::Start, ReactionPart::Force, 1);
    let sensor = Sensor::new(channel, readings).sigma(0.01 * weight);
    let fit = Fit::new(&scene.problem().unwrap()).observe(sensor).identify(Parameter::Density);
    let report = fit.analyse(same_mesh()).solve().unwrap();
    let found = &report.parameters[0];
    assert!(!report.warning_codes.contains(&Code::OneSided), "{report}");
    assert!((found.value.unwrap() / density - 1.0).abs() < 1e-3, "{report}");
    // Stated noise of 1 % over the root of 20 readings.
    let error = found.std_error.unwrap() / density;
    assert!((error * 20.0_f64.sqrt() / 0.01 - 1.0).abs() < 0.2, "{error}");
    assert!(found.interval95.is_some() && found.lower95.is_none(), "{report}");
}
