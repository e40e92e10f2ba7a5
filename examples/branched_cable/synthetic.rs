//! Stiffnesses and joint of a branched cable whose ends follow recorded markers, from its other markers.
//!
//! The recording is a simulation with 0.1 mm of noise, and the identified numbers are compared with those of the simulation.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};
use rodfit::fit::{Analysis, Experiment, Refinement, Sample};
use rodfit::numerics::rotation::{exponential, times};
use rodfit::numerics::vector::add;
use rodfit::scene::structure::{RodEnd, StructureSupport, SupportedEnd};
use rodfit::scene::structure_point::{ArcLengthOfRod, RodPoint, StructurePoint};
use rodfit::scene::{InitialState, StructureRecording, Support, Track};
use rodfit::{Error, Fit, Observation, Parameter, Structure, StructureScene, Unknown};

/// Identified numbers with their values in the data and in the scene of the fit.
const NUMBERS: [(&str, f64, f64); 4] = [
    ("materials.trunk.youngs_modulus", 2e7, 1.5e7),
    ("materials.branch.youngs_modulus", 1.2e7, 1.5e7),
    ("joints.2.rotation", 30.0, 20.0),
    ("joints.2.rest.1", 0.3, 0.2),
];
/// Standard deviation of the data, m.
const SIGMA: f64 = 1e-4;
/// Duration of the recording and time between two frames, s.
const END: f64 = 1.0;
const FRAME: f64 = 0.01;

/// A trunk of two pieces between two hands, and a branch at its middle. The joint is a small body: rigid to the first
/// piece, with springs to the second one and to the branch.
const SCENE: &str = r#"
dimension = "spatial"
[[rods]]
name = "left"
segments = 6
shape = { kind = "straight", length = 0.2, direction = [1, 0, 0] }
section = { kind = "circle", radius = 3e-3 }
material = "trunk"
[[rods]]
name = "right"
segments = 6
shape = { kind = "straight", length = 0.2, direction = [1, 0, 0] }
section = { kind = "circle", radius = 3e-3 }
material = "trunk"
[[rods]]
name = "branch"
segments = 6
shape = { kind = "straight", length = 0.12, direction = [0, -0.6, 0.8] }
section = { kind = "circle", radius = 3e-3 }
material = "branch"
[[materials]]
name = "trunk"
density = 1100
youngs_modulus = 2e7
poisson_ratio = 0.4
[[materials]]
name = "branch"
density = 1100
youngs_modulus = 1.2e7
poisson_ratio = 0.4
[[bodies]]
name = "hub"
mass = 1e-3
inertia = [2e-8, 2e-8, 2e-8]
position = [0.2, 0, 0]
[[joints]]
kind = "rigid"
connects = [{ body = "hub" }, { rod = "left", at = "end" }]
[[joints]]
kind = "spring"
connects = [{ body = "hub" }, { rod = "right", at = "start" }]
rotation = 10.0
[[joints]]
kind = "spring"
connects = [{ body = "hub" }, { rod = "branch", at = "start" }]
rotation = 30.0
rest = [0.0, 0.3, 0.0]
damping = 0.02
[loads]
gravity = [0, 0, -9.81]
damping = { mass = 0.3, stiffness = 0.02 }
[time]
end = 1.0
step = 0.01
scheme = "generalised-alpha"
"#;

/// Recording of the pairs of markers of two hands that shift and turn.
fn hands() -> Track {
    let times_of: Vec<f64> =
        (0..=(END / FRAME).round() as usize).map(|k| FRAME * k as f64).collect();
    let edge = 0.2 / 5.5;
    let place = |x: f64, arm: f64, t: f64, rate: f64| {
        let swing = 0.5 * (1.0 - (rate * t).cos());
        let turned = times(&exponential([0.0, 0.5 * swing, -0.4 * swing]), [arm, 0.0, 0.0]);
        Some(add([x, 0.04 * swing, 0.06 * swing], turned))
    };
    let marker = |name: &str, x: f64, arm: f64, rate: f64| {
        (name.to_string(), times_of.iter().map(|t| place(x, arm, *t, rate)).collect())
    };
    let markers = vec![
        marker("a0", 0.01, 0.0, 7.0),
        marker("a1", 0.01, edge, 7.0),
        marker("b0", 0.39, 0.0, 9.0),
        marker("b1", 0.39, -edge, 9.0),
    ];
    Track::new(times_of.clone(), markers).expect("every marker has positions")
}

/// The scene between both hands, with the values of the identified numbers that `value` selects.
fn scene(value: impl Fn(&(&str, f64, f64)) -> f64) -> Result<StructureScene, Error> {
    let mut scene = StructureScene::from_toml(SCENE, ".")?;
    let held = |rod: &str, at: RodEnd, names: [&str; 2]| StructureSupport {
        of: SupportedEnd { rod: rod.into(), at },
        kind: Support::Recorded,
        markers: names.map(String::from).into(),
        edges: 1,
        free_twist: false,
    };
    scene.supports =
        vec![held("left", RodEnd::Start, ["a0", "a1"]), held("right", RodEnd::End, ["b0", "b1"])];
    scene.recording = Some(StructureRecording::of(hands()));
    scene.initial.state = InitialState::Equilibrium;
    Ok(scene.map_numbers(|path, own, _| {
        NUMBERS.iter().find(|number| number.0 == path).map_or(own, &value)
    }))
}

/// The simulated motion of five points, m, with noise.
fn observations() -> Result<Vec<Observation>, Error> {
    let on = |rod: &str, arc_length| {
        StructurePoint::on_rod(rod, RodPoint::ArcLength(ArcLengthOfRod { arc_length }))
    };
    let places = [
        on("left", 0.12),
        StructurePoint::tip("left"),
        on("right", 0.08),
        on("branch", 0.06),
        StructurePoint::tip("branch"),
    ];
    let structure = Structure::new(scene(|number| number.1)?)?;
    let mut motion = structure.simulation()?;
    let mut samples = vec![Vec::new(); places.len()];
    let noise = Normal::new(0.0, SIGMA).expect("a positive sigma");
    let mut random = ChaCha8Rng::seed_from_u64(1);
    for k in 1..=(END / FRAME).round() as usize {
        let time = FRAME * k as f64;
        motion.step_to(time)?;
        for (samples, place) in samples.iter_mut().zip(&places) {
            let place = motion.position(place)?;
            let position = place.map(|x| Some(x + noise.sample(&mut random)));
            samples.push(Sample { time, position });
        }
    }
    let pairs = samples.into_iter().zip(places);
    Ok(pairs.map(|(samples, place)| Observation::new(samples).of_structure(place)).collect())
}

/// Fits the synthetic cable and prints the report.
pub fn run() -> Result<(), Error> {
    let experiment = Experiment::of_structure("", scene(|number| number.2)?)?;
    let experiment = observations()?.into_iter().fold(experiment, Experiment::observe);
    let unknown = |number: &(&str, f64, f64)| {
        Ok(Unknown::new(number.0.parse::<Parameter>()?).start(number.2))
    };
    let unknowns = NUMBERS.iter().map(unknown).collect::<Result<Vec<_>, Error>>()?;
    let fit = unknowns.into_iter().fold(Fit::of([experiment]), Fit::identify).analyse(Analysis {
        discretization_error: Refinement::None,
        sensitivity_analysis: Some(false),
        ..Analysis::default()
    });
    let report = fit.solve()?;
    println!("{report}");
    for (name, truth, _) in NUMBERS {
        let found = report.estimate(name.parse()?).and_then(|estimate| estimate.value);
        println!("{name}: {found:?}, in the simulation {truth}");
    }
    Ok(())
}
