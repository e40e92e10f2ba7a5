//! The warning of a given step that is too long, against runs with much shorter steps.

use rodfit::dynamics::SimulationReport;
use rodfit::{Scene, Trajectory};

const LENGTH: f64 = 0.3;
/// Number of edges, and the nodes that are compared.
const SEGMENTS: usize = 20;
const NODES: [usize; 4] = [5, 10, 15, 20];
/// Steps of the reference within one of the run.
const FINER: usize = 16;

/// A clamped rod that is released at the time 0, with the end of `[time]` in s, and additional lines of other tables.
struct Released {
    name: &'static str,
    modulus: f64,
    end: f64,
    scheme: &'static str,
    loads: &'static str,
}

/// A run with equal steps: its warning of a coarse step, and the positions of the compared nodes in every state.
struct Run {
    warning: Option<String>,
    places: Vec<[[f64; 3]; 4]>,
}

impl Released {
    /// The run with so many steps.
    fn run(&self, steps: usize) -> Run {
        let Self { modulus, end, scheme, loads, .. } = self;
        let text = format!(
            "[rod]\nsegments = {SEGMENTS}\n\
             shape = {{ kind = \"straight\", length = {LENGTH}, direction = [1, 0, 0] }}\n\
             section = {{ kind = \"circle\", radius = 0.002 }}\n\
             [material]\ndensity = 1100\nyoungs_modulus = {modulus:e}\n\
             [supports]\nstart = \"clamped\"\n[loads]\n{loads}\n\
             [time]\nend = {end}\nstep = {:e}\n{scheme}\n",
            end / steps as f64
        );
        let problem = Scene::from_toml(&text, ".").unwrap().problem().unwrap();
        let mut report = SimulationReport::new(&problem);
        let mut run = Trajectory::new(&problem, &NODES, &[]).unwrap();
        let outcome = run.run(&problem, steps, |state| report.push(&problem, state));
        report.finish(&run, &outcome);
        outcome.unwrap();
        let warning = report.warnings.into_iter().find(|text| text.contains("[coarse-step]"));
        let places = (0..=steps).map(|k| NODES.map(|node| run.node(node, k)));
        Run { warning, places: places.collect() }
    }

    /// Largest distance of the compared nodes from those of a run with steps shorter by `FINER`, over the length.
    fn error(&self, run: &Run) -> f64 {
        let exact = self.run((run.places.len() - 1) * FINER).places;
        let pairs = run.places.iter().enumerate().flat_map(|(k, own)| {
            own.iter().zip(&exact[k * FINER]).map(|(a, b)| crate::common::distance(*a, *b))
        });
        pairs.fold(0.0, f64::max) / LENGTH
    }
}

/// The stated error of a warning, as a fraction of the length; `None` where it says that the motion is not resolved.
fn stated(warning: &str) -> Option<f64> {
    let (_, words) = warning.split_once("estimated error of ")?;
    Some(words.split(' ').next()?.parse::<f64>().unwrap() / LENGTH)
}

/// The step that a warning recommends, s.
fn recommended(warning: &str) -> f64 {
    let (_, words) = warning.split_once("time.step = ").unwrap();
    words.split(' ').next().unwrap().parse().unwrap()
}

/// Scenes with errors of their own kind: phase, amplitude, a scheme with damping, and a small motion.
const SCENES: [Released; 4] = [
    Released {
        name: "sagging",
        modulus: 2e8,
        end: 0.75,
        scheme: "",
        loads: "gravity = [0, -9.81, 0]",
    },
    Released {
        name: "implicit",
        modulus: 2e8,
        end: 0.75,
        scheme: "beta = 0.7",
        loads: "gravity = [0, -9.81, 0]",
    },
    Released {
        name: "generalised-alpha",
        modulus: 2e8,
        end: 0.75,
        scheme: "scheme = \"generalised-alpha\"\nrho_inf = 0.5",
        loads: "gravity = [0, -9.81, 0]",
    },
    Released {
        name: "small",
        modulus: 1e10,
        end: 0.15,
        scheme: "",
        loads: "point = [{ node = \"tip\", force = [0, 0, 1e-3] }]",
    },
];

/// Runs with a large error have the warning, runs with a small one have none. The stated error is right within a factor
/// of four: phases may add up or cancel between the vibrations of a motion.
#[test]
fn coarse_given_steps_are_warned_of() {
    for scene in &SCENES {
        let mut warned = [0, 0];
        for steps in [20, 40, 80, 160, 320, 640] {
            let run = scene.run(steps);
            let error = scene.error(&run);
            let extent = (run.places.iter())
                .map(|own| crate::common::distance(own[3], run.places[0][3]))
                .fold(0.0, f64::max);
            let limit = 0.02_f64.min(0.1 * extent / LENGTH);
            println!(
                "{} with {steps} steps: {error:.5}, limit {limit:.5}, {:?}",
                scene.name, run.warning
            );
            warned[usize::from(run.warning.is_some())] += 1;
            assert!(run.warning.is_some() || error < 2.0 * limit, "{} {steps}", scene.name);
            assert!(run.warning.is_none() || error > 0.25 * limit, "{} {steps}", scene.name);
            let Some(error_stated) = run.warning.as_deref().and_then(stated) else { continue };
            let ratio = error_stated / error;
            assert!((0.25..4.0).contains(&ratio), "{} {steps}: {ratio}", scene.name);
        }
        assert!(warned[0] > 0 && warned[1] > 0, "{}: {warned:?}", scene.name);
    }
}

/// The recommended step has no warning.
#[test]
fn recommended_steps_suffice() {
    for scene in &SCENES {
        let warning = scene.run(20).warning.unwrap();
        let steps = (scene.end / recommended(&warning)).ceil() as usize;
        let run = scene.run(steps);
        println!("{}: {steps} steps, {:?}", scene.name, run.warning);
        assert!(run.warning.is_none(), "{}", scene.name);
    }
}

/// A rod without motion has no such warning.
#[test]
fn resting_rods_have_no_coarse_step() {
    let still = Released { loads: "", ..SCENES[3] };
    assert_eq!(still.run(20).warning, None);
}
