//! Structures of a recorded branched cable, the sequence of models with their parameters, and their fits.
//!
//! The parent is cut at the junctions. A junction is a small body with a rigid joint to the piece that ends there, and a spring
//! joint to each piece that starts there. Both ends of the parent follow two markers each, and grippers hold their rotation about the cable.
//! Every branch has its own material. Jumps of the markers that drive the ends are replaced by medians.

use crate::cable::Cable;
use argmin::core::{Executor, State};
use rodfit::fit::{Experiment, Glitches};
use rodfit::numerics::levenberg_marquardt::LevenbergMarquardt;
use rodfit::scene::Track;
use rodfit::{Error, Fit, Observation, StructureScene, Unknown};
use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::Path;

/// Radius, m, and density, kg/m^3, of all branches. The recordings determine ratios to the mass only.
const RADIUS: f64 = 4e-3;
const DENSITY: f64 = 1100.0;
/// Mass, kg, and moment of inertia, kg m^2, of a junction.
const JUNCTION_MASS: f64 = 2e-3;
const JUNCTION_INERTIA: f64 = 2e-7;
/// Compliance of a joint that is nearly rigid, and of one at the start of a fit, rad/(N m).
const STIFF: f64 = 0.05;
const SPRINGY: f64 = 3.0;
/// Viscous time of the joints, s.
const JOINT_TIME: f64 = 0.01;
/// Standard deviation of the prior of a rest rotation, rad, and of a curvature factor. Without them, rotations about a piece
/// and its own curvature are hardly determined.
const REST_SIGMA: f64 = 0.3;
const CURVATURE_SIGMA: f64 = 1.0;
/// Difference from the median of neighboring frames, m, above which a position is a jump, and the number of neighbors on each
/// side.
const JUMP: f64 = 3e-3;
const NEIGHBORS: usize = 3;
/// Standard deviation of the residuals, m: that of the model, not of the markers.
const SIGMA: f64 = 0.03;

/// Values of parameters by their names.
pub type Values = BTreeMap<String, f64>;

/// A parameter of a model with its start value, bounds, and the standard deviation of a prior about the start.
pub struct Number {
    pub name: String,
    pub start: f64,
    pub bounds: [f64; 2],
    pub prior: Option<f64>,
}

/// A model: its parameters are those of the simpler models, and its own.
pub struct Model {
    pub name: &'static str,
    pub numbers: Vec<Number>,
}

/// Duration and step of a simulation, s.
#[derive(Clone, Copy)]
pub struct Grid {
    pub end: f64,
    pub step: f64,
}

/// The simulation of a fit: over this time the effects of all parameters are visible.
const FITTED: Grid = Grid { end: 3.0, step: 0.02 };
/// Largest number of iterations of a fit, and largest step of an unknown on its scale (a logarithm, or rad).
const ITERATIONS: u64 = 12;
const LONGEST_STEP: f64 = 1.5;
/// Every so many frames are compared.
const FRAMES: usize = 10;
/// The simulation over a whole recording.
pub const JUDGED: Grid = Grid { end: 4.99, step: 0.01 };

/// The structure of a cable, with these values of its parameters, driven by a clip.
pub fn scene(
    cable: &Cable,
    grid: Grid,
    values: &Values,
    clip: &Path,
) -> Result<StructureScene, Error> {
    let mut scene = StructureScene::from_toml(&text(cable, grid, clip), ".")?;
    without_jumps(&mut scene)?;
    let mut unused: Vec<&String> = values.keys().collect();
    let scene = scene.map_numbers(|path, own, _| match values.get(path) {
        Some(value) => {
            unused.retain(|name| *name != path);
            *value
        }
        None => own,
    });
    match unused.first() {
        Some(name) => Err(Error::Fit(format!("the structure has no parameter {name}"))),
        None => Ok(scene),
    }
}

/// The scene file of a cable.
fn text(cable: &Cable, grid: Grid, clip: &Path) -> String {
    let mut text = "dimension = \"spatial\"\n".to_string();
    for piece in &cable.pieces {
        let _ = write!(
            text,
            "[[rods]]\nname = \"{}\"\nsegments = {}\nmaterial = \"{}\"\n\
             section = {{ kind = \"circle\", radius = {RADIUS} }}\n\
             shape = {{ kind = \"polyline\", points = {:?} }}\n",
            piece.name, piece.segments, piece.branch, piece.points
        );
    }
    for branch in cable.branches() {
        let _ = write!(
            text,
            "[[materials]]\nname = \"{branch}\"\ndensity = {DENSITY}\nyoungs_modulus = 5e6\n\
             poisson_ratio = 0.4\n"
        );
    }
    for junction in cable.junctions() {
        let marker = &cable.markers[junction.marker];
        let name = &marker.name;
        let _ = write!(
            text,
            "[[bodies]]\nname = \"{name}\"\nmass = {JUNCTION_MASS}\n\
             inertia = [{JUNCTION_INERTIA}, {JUNCTION_INERTIA}, {JUNCTION_INERTIA}]\n\
             position = {:?}\n\
             [[joints]]\nkind = \"rigid\"\n\
             connects = [{{ body = \"{name}\" }}, {{ rod = \"{}\", at = \"end\" }}]\n",
            marker.position, cable.pieces[junction.incoming].name
        );
        for piece in junction.outgoing {
            let _ = write!(
                text,
                "[[joints]]\nkind = \"spring\"\n\
                 connects = [{{ body = \"{name}\" }}, {{ rod = \"{}\", at = \"start\" }}]\n\
                 rotation = {STIFF}\nrest = [0.0, 0.0, 0.0]\ndamping = {JOINT_TIME}\n",
                cable.pieces[piece].name
            );
        }
    }
    for piece in &cable.pieces {
        for (end, at) in ["start", "end"].into_iter().enumerate().filter(|(k, _)| piece.held[*k]) {
            let last = piece.markers.len() - 1;
            let markers = if end == 0 { [0, 1] } else { [last, last - 1] };
            let markers = markers.map(|k| &cable.markers[piece.markers[k]].name);
            let _ = write!(
                text,
                "[[supports]]\nof = {{ rod = \"{}\", at = \"{at}\" }}\nkind = \"recorded\"\n\
                 markers = {markers:?}\n",
                piece.name
            );
        }
    }
    let Grid { end, step } = grid;
    let _ = write!(
        text,
        "[loads]\ngravity = [0, 0, -9.81]\ndamping = {{ mass = 0.1, stiffness = 0.3 }}\n\
         [initial]\nstate = \"recorded\"\n\
         [time]\nend = {end}\nstep = {step}\nscheme = \"generalised-alpha\"\ntolerance = 1e-7\n\
         [recording]\nfile = {clip:?}\n[recording.markers]\n",
    );
    for (name, place) in observed(cable) {
        let _ = writeln!(text, "{name} = {place}");
    }
    text
}

/// Names of the free markers with their places as TOML. A junction is the end of the piece that leads to it.
fn observed(cable: &Cable) -> Vec<(&str, String)> {
    let mut places = Vec::new();
    for piece in &cable.pieces {
        let last = piece.markers.len() - 1;
        let first = if piece.held[0] { 2 } else { 1 };
        let end = if piece.held[1] { last - 2 } else { last };
        for k in first..=end {
            let at = match k == last {
                true => "\"tip\"".to_string(),
                false => format!("{{ arc_length = {} }}", piece.arc_lengths[k]),
            };
            let name = &cable.markers[piece.markers[k]].name[..];
            places.push((name, format!("{{ rod = \"{}\", at = {at} }}", piece.name)));
        }
    }
    places
}

/// Replaces jumps of the markers that drive the ends: positions of which a coordinate differs from the median of neighboring
/// frames by more than [`JUMP`] become that median.
fn without_jumps(scene: &mut StructureScene) -> Result<(), Error> {
    let Some(recording) = &mut scene.recording else { return Ok(()) };
    let Some(track) = &recording.track else { return Ok(()) };
    let is_held = |name: &String| scene.supports.iter().any(|own| own.markers.contains(name));
    let markers = track.markers().iter().map(|marker| {
        let seen = match is_held(&marker.name) {
            true => filtered(&marker.seen),
            false => marker.seen.clone(),
        };
        (marker.name.clone(), seen)
    });
    let track = Track::new(track.times().to_vec(), markers.collect());
    recording.track = Some(track.map_err(|error| Error::Fit(error.to_string()))?.into());
    Ok(())
}

/// Positions without jumps.
fn filtered(seen: &[Option<[f64; 3]>]) -> Vec<Option<[f64; 3]>> {
    let median = |k: usize, c: usize| {
        let near = k.saturating_sub(NEIGHBORS)..(k + NEIGHBORS + 1).min(seen.len());
        let mut own: Vec<f64> = seen[near].iter().flatten().map(|x| x[c]).collect();
        own.sort_by(f64::total_cmp);
        own[own.len() / 2]
    };
    let position = |(k, x): (usize, &Option<[f64; 3]>)| {
        let x = (*x)?;
        let middle = [0, 1, 2].map(|c| median(k, c));
        let is_jump = (0..3).any(|c| (x[c] - middle[c]).abs() > JUMP);
        Some(if is_jump { middle } else { x })
    };
    seen.iter().enumerate().map(position).collect()
}

/// The sequence of models, from the simplest to the most complex.
pub fn models(cable: &Cable) -> Vec<Model> {
    let number =
        |name: String, start: f64, bounds: [f64; 2]| Number { name, start, bounds, prior: None };
    let mut simple: Vec<Number> = cable
        .branches()
        .map(|branch| number(format!("materials.{branch}.youngs_modulus"), 5e6, [1e5, 1e10]))
        .collect();
    simple.push(number("loads.damping.mass".into(), 0.1, [0.01, 20.0]));
    simple.push(number("loads.damping.stiffness".into(), 0.3, [1e-3, 50.0]));
    let (mut springs, mut rests) = (Vec::new(), Vec::new());
    let mut joint = 0;
    for junction in cable.junctions() {
        joint += 1;
        for _ in junction.outgoing {
            springs.push(number(format!("joints.{joint}.rotation"), SPRINGY, [0.02, 1e3]));
            rests.extend((0..3).map(|c| Number {
                prior: Some(REST_SIGMA),
                ..number(format!("joints.{joint}.rest.{c}"), 0.0, [-2.0, 2.0])
            }));
            joint += 1;
        }
    }
    // A piece between two markers is straight.
    let bent = cable.pieces.iter().filter(|piece| piece.markers.len() > 2);
    let curvatures = bent.map(|piece| Number {
        prior: Some(CURVATURE_SIGMA),
        ..number(format!("rods.{}.natural_curvature", piece.name), 1.0, [-3.0, 6.0])
    });
    vec![
        Model { name: "nearly rigid joints", numbers: simple },
        Model { name: "compliance of joints", numbers: springs },
        Model { name: "rest rotations of joints", numbers: rests },
        Model { name: "rest curvature of pieces", numbers: curvatures.collect() },
    ]
}

/// Fits numbers to the beginning of some clips, from those of `values` on or else from their starts, and replaces them there.
/// Returns the number of simulations of all clips.
pub fn fit(
    cable: &Cable,
    values: &mut Values,
    numbers: &[&Number],
    clips: &[usize],
) -> Result<f64, Error> {
    let mut fit = Fit::of([]);
    for k in clips {
        let clip = &cable.clips[*k];
        let name = clip.file_stem().map_or("".into(), |stem| stem.to_string_lossy());
        let mut experiment = Experiment::of_structure(name, scene(cable, FITTED, values, clip)?)?;
        let markers = Observation::of_free_markers(&experiment.problem, FRAMES, Glitches::Mask)?;
        for marker in markers {
            experiment = experiment.observe(marker.sigma(SIGMA));
        }
        fit = fit.experiment(experiment);
    }
    for number in numbers {
        let start = values.get(&number.name).copied().unwrap_or(number.start);
        let [low, high] = number.bounds;
        let unknown = Unknown::new(number.name.parse()?).start(start).bounds(low, high);
        fit = fit.identify(match number.prior {
            Some(sigma) => unknown.prior(number.start, sigma),
            None => unknown,
        });
    }
    let residuals = fit.residuals()?;
    let unknowns = residuals.unknowns().to_vec();
    let starts = unknowns.iter().zip(numbers).map(|(unknown, number)| {
        unknown.to_scale(values.get(&number.name).copied().unwrap_or(number.start))
    });
    let bounds = unknowns.iter().map(Unknown::scaled_bounds).collect();
    // The model does not explain all of the motion: iterations that hardly lower the misfit lead nowhere.
    let solver = LevenbergMarquardt::new(bounds)
        .longest_steps(vec![LONGEST_STEP; unknowns.len()])
        .noise_tolerance(1.0)
        .last_step(1.0)
        .patience(2);
    let start: Vec<f64> = starts.collect();
    let executor = Executor::new(residuals, solver)
        .configure(|state| state.param(start).max_iters(ITERATIONS));
    let mut result = executor.run().map_err(|error| Error::Fit(error.to_string()))?;
    let found = result.state.get_best_param().or_else(|| result.state.get_param());
    let Some(found) = found else { return Err(Error::Fit("no optimum".into())) };
    for ((unknown, number), x) in unknowns.iter().zip(numbers).zip(found) {
        values.insert(number.name.clone(), unknown.from_scale(*x));
    }
    Ok(result.problem.take_problem().map_or(0.0, |residuals| residuals.simulations()))
}
