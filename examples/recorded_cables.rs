//! From recordings of a cable to its physics: a ladder of models, each fitted to some of the
//! recordings and judged on all the others, which it predicts from their first two frames.
//!
//! `cargo run --release --example recorded_cables` makes a synthetic cable, moves it between two hands,
//! and identifies it. With the environment variable `RODFIT_MOCAP_DIR` naming the folder of the DEFORM
//! recordings (Chen et al., CoRL 2024, arXiv 2406.05931; files `DLO1_train_48.csv`, ..,
//! `DLO1_rest_raw.csv`, ..) it identifies the real ones: all five, or those named behind `--`.
//! `k` behind `--` adds a curvature at rest for every marker.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rodfit::fit::{Experiment, FitReport, Loss, Sample};
use rodfit::scene::{
    Discretization, Friction, InitialState, Material, Recorded, Section, Shape, Support, Taper,
    Time, Track,
};
use rodfit::{Fit, Observation, Parameter, Point, Problem, Scene, Unknown};
use std::error::Error;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

/// Nobody weighed the cables: only moduli over this density have a meaning, kg/m^3.
const DENSITY: f64 = 1000.0;
/// A radius that makes them hardly stretch, m.
const RADIUS: f64 = 1.2e-3;
/// How far off a good model is, m: what is farther off counts less than its square.
const SIGMA: f64 = 0.01;
/// Of the frames, one in so many is fitted.
const EVERY: usize = 10;

/// Recordings of one cable.
struct Cable {
    name: String,
    clips: Vec<(PathBuf, Arc<Track>)>,
    /// Where its vertices were when it lay on a table.
    table: Option<PathBuf>,
    /// Median distances between its markers, m.
    lengths: Vec<f64>,
}

impl Cable {
    fn new(
        name: String,
        mut files: Vec<PathBuf>,
        table: Option<PathBuf>,
    ) -> Result<Self, Box<dyn Error>> {
        let number = |path: &PathBuf| -> Option<u32> {
            path.file_stem()?.to_str()?.rsplit('_').next()?.parse().ok()
        };
        files.sort_by_key(number);
        let read = |path: PathBuf| Ok((path.clone(), Arc::new(Track::read(&path)?)));
        let clips: Vec<_> = files.into_iter().map(read).collect::<Result<_, rodfit::Error>>()?;
        let markers = clips.first().ok_or("no recordings")?.1.markers().len();
        let mut lengths = Vec::new();
        for j in 1..markers {
            let mut all: Vec<f64> = Vec::new();
            for (_, track) in &clips {
                let [a, b] = [j - 1, j].map(|j| &track.markers()[j].seen);
                let pairs = a.iter().zip(b).filter_map(|(a, b)| Some(((*a)?, (*b)?)));
                all.extend(pairs.map(|(a, b)| distance(a, b)));
            }
            all.sort_by(f64::total_cmp);
            lengths.push(all[all.len() / 2]);
        }
        Ok(Self { name, clips, table, lengths })
    }

    /// A straight cable, or, `curved`, one with the turns it has on the table.
    fn scene(&self, curved: bool) -> Scene {
        let shape = match &self.table {
            Some(table) if curved => Shape::polyline(table),
            _ => {
                let ends = self.lengths.iter().scan(0.0, |sum, l| {
                    *sum += l;
                    Some([*sum, 0.0, 0.0])
                });
                Shape::points(std::iter::once([0.0; 3]).chain(ends))
            }
        };
        let section = Section::Circle { radius: RADIUS };
        let modulus = 1e8;
        let material =
            Material { shear_modulus: Some(0.5 * modulus), ..Material::new(DENSITY, modulus) };
        let mut scene = Scene::new(self.lengths.len(), shape, section, material);
        if let Shape::Polyline { lengths, .. } = &mut scene.rod.shape {
            *lengths = self.lengths.clone();
        }
        scene.rod.discretization = Some(Discretization::Paper);
        scene.rod.dimension = rodfit::scene::Dimension::Spatial;
        (scene.supports.start, scene.supports.end) = (Support::Recorded, Support::Recorded);
        scene.loads.gravity = [0.0, 0.0, -9.81];
        scene.loads.damping.mass = 0.2;
        scene.loads.damping.stiffness = 0.08;
        scene.initial.state = InitialState::Recorded;
        scene
    }

    /// The scene of a clip, in steps of its frames.
    fn problem(&self, scene: &Scene, clip: usize) -> Result<Problem, rodfit::Error> {
        let mut scene = scene.clone();
        let (path, track) = &self.clips[clip];
        scene.supports.path = Some(Recorded { track: Some(track.clone()), ..Recorded::new(path) });
        let times = track.times();
        let mut time = Time::new(times[times.len() - 1], times[1] - times[0]);
        time.scheme = rodfit::scene::Scheme::GeneralisedAlpha;
        scene.time = Some(time);
        scene.problem()
    }

    /// A fit of the free markers of these clips.
    fn fit(&self, scene: &Scene, clips: &[usize]) -> Result<Fit, rodfit::Error> {
        let mut experiments = Vec::new();
        for clip in clips {
            let (path, track) = &self.clips[*clip];
            let name = path.file_stem().unwrap_or_default().to_string_lossy();
            let mut experiment = Experiment::new(name, &self.problem(scene, *clip)?);
            let markers = track.markers();
            for (node, marker) in markers.iter().enumerate().take(markers.len() - 2).skip(2) {
                let sample = |k: usize| Sample {
                    time: track.times()[k],
                    position: marker.seen[k].map_or([None; 3], |x| x.map(Some)),
                };
                let frames = (2..track.times().len()).step_by(EVERY);
                let samples = frames.filter(|k| marker.seen[*k].is_some()).map(sample);
                let observation = Observation::new(samples.collect()).at(Point::Node(node));
                experiment = experiment.observe(observation.sigma(SIGMA).loss(Loss::SoftL1));
            }
            experiments.push(experiment);
        }
        Ok(Fit::of(experiments))
    }

    /// Mean distance per coordinate of all markers but for the first two frames, m: the metric of the
    /// recordings' authors. None where the simulation ends before the clip.
    fn error(&self, scene: &Scene, clip: usize) -> Option<f64> {
        let problem = self.problem(scene, clip).ok()?;
        let run = problem.simulate().ok()?;
        let track = &self.clips[clip].1;
        let (mut sum, mut count) = (0.0, 0.0);
        for (k, time) in track.times().iter().enumerate().skip(2) {
            for (node, marker) in track.markers().iter().enumerate() {
                let found = run.at(Point::Node(node), *time).ok()?.0;
                for (c, seen) in marker.seen[k].into_iter().flatten().enumerate() {
                    sum += (found[c] - seen).abs();
                    count += 1.0;
                }
            }
        }
        Some(sum / count)
    }
}

fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|c| (a[c] - b[c]).powi(2)).sum::<f64>().sqrt()
}

/// A step of the ladder: its name, how many clips it is fitted to, and the numbers it adds with their starts.
type Step = (&'static str, usize, Vec<(String, f64)>);

fn ladder(markers: usize, with_curvatures: bool) -> Vec<Step> {
    let named = |names: &[(&str, f64)]| names.iter().map(|(n, x)| (n.to_string(), *x)).collect();
    let mut steps: Vec<Step> = vec![
        (
            "B3",
            8,
            named(&[("youngs_modulus", 1e8), ("damping.stiffness", 0.08), ("damping.mass", 0.2)]),
        ),
        ("T5", 8, named(&[("rod.natural_curvature", 0.6), ("shear_modulus", 5e7)])),
        (
            "T7",
            16,
            named(&[
                ("loads.damping.friction.stiffness", 1.0),
                ("loads.damping.friction.curvature", 1.5),
            ]),
        ),
        (
            "T10",
            16,
            named(&[
                ("rod.taper.youngs_modulus.0", 1.0),
                ("rod.taper.youngs_modulus.2", 1.0),
                ("rod.shape.scale", 1.0),
            ]),
        ),
    ];
    if with_curvatures {
        let pairs = (1..markers - 1)
            .flat_map(|j| ["d1", "d2"].map(|d| (format!("rod.natural_bending.{j}.{d}"), 0.0)));
        steps.push(("K", 16, pairs.collect()));
    }
    steps
}

fn climb(cable: &Cable, with_curvatures: bool) -> Result<(), Box<dyn Error>> {
    let total = cable.clips.len();
    let markers = cable.lengths.len() + 1;
    println!(
        "{}: {total} recordings of {markers} markers, {:.3} m long",
        cable.name,
        cable.lengths.iter().sum::<f64>()
    );
    let mut found: Vec<(Parameter, f64)> = Vec::new();
    // Dampings that are not there.
    let mut gone: Vec<Parameter> = Vec::new();
    for (name, most, added) in ladder(markers, with_curvatures) {
        let mut scene = cable.scene(name != "B3");
        if !matches!(name, "B3" | "T5") {
            scene.loads.damping.friction = Some(Friction { stiffness: 1.0, curvature: 1.5 });
        }
        if matches!(name, "T10" | "K") {
            scene.rod.taper =
                Taper { youngs_modulus: Some(vec![1.0; 3].into()), ..Taper::default() };
        }
        if name == "K" {
            scene.rod.natural_bending = vec![[0.0; 2]; markers];
        }
        for parameter in &gone {
            parameter.set(&mut scene, 0.0)?;
        }
        let since = Instant::now();
        // Evenly spread over the recordings; the others judge.
        let fitted: Vec<usize> =
            (0..most.min(total / 2)).map(|i| i * total / most.min(total / 2)).collect();
        let mut fit = cable.fit(&scene, &fitted)?;
        for (parameter, value) in &found {
            fit = fit.identify(Unknown::new(*parameter).start(*value));
        }
        for (parameter, start) in added {
            let unknown = Unknown::new(parameter.parse()?);
            // Of the modulus nothing is known.
            let known = parameter != "youngs_modulus";
            fit = fit.identify(if known { unknown.start(start) } else { unknown });
        }
        let report = fit.solve()?;
        found = values(&report);
        gone.extend(
            report.parameters.iter().filter(|e| e.value.is_none_or(|x| x < 1e-9)).map(|e| e.name),
        );
        found.retain(|(parameter, _)| !gone.contains(parameter));
        for parameter in &gone {
            parameter.set(&mut scene, 0.0)?;
        }
        for (parameter, value) in &found {
            parameter.set(&mut scene, *value)?;
        }
        let took = since.elapsed().as_secs_f64();
        let errors = |judged: bool| -> Vec<f64> {
            let clips = (0..total).filter(|clip| fitted.contains(clip) != judged);
            clips.map(|clip| cable.error(&scene, clip).unwrap_or(f64::NAN)).collect()
        };
        let [own, others] = [false, true].map(errors);
        let mean = |x: &[f64]| 100.0 * x.iter().sum::<f64>() / x.len() as f64;
        println!(
            "  {name:4} {:2} numbers, {:2} recordings: {:.3} cm off, {:.3} cm on the {} others; {took:.1} s",
            report.parameters.len(),
            fitted.len(),
            mean(&own),
            mean(&others),
            others.len()
        );
        for estimate in report.parameters.iter().take(10) {
            let interval =
                estimate.interval95.map_or(String::new(), |[a, b]| format!(" [{a:.4e}, {b:.4e}]"));
            println!(
                "         {} = {:.4e}{interval} {}",
                estimate.name,
                estimate.value.unwrap_or(0.0),
                estimate.name.unit()
            );
        }
    }
    Ok(())
}

fn values(report: &FitReport) -> Vec<(Parameter, f64)> {
    report.parameters.iter().filter_map(|e| Some((e.name, e.value?))).collect()
}

/// The recordings `PREFIX_train_N.csv` of a folder.
fn recordings(folder: &Path, name: &str) -> Result<Cable, Box<dyn Error>> {
    let prefix = format!("{name}_train_");
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder)? {
        let path = entry?.path();
        let own = path.file_name().is_some_and(|f| f.to_string_lossy().starts_with(&prefix));
        files.extend(own.then_some(path));
    }
    let table = folder.join(format!("{name}_rest_raw.csv"));
    Cable::new(name.into(), files, table.exists().then_some(table))
}

fn main() -> Result<(), Box<dyn Error>> {
    let asked: Vec<String> = std::env::args().skip(1).collect();
    let with_curvatures = asked.iter().any(|word| word == "k");
    let Some(folder) = std::env::var_os("RODFIT_MOCAP_DIR") else {
        println!("RODFIT_MOCAP_DIR names no folder of recordings: a synthetic cable instead");
        let folder = tempfile::tempdir()?;
        twin(folder.path())?;
        return climb(&recordings(folder.path(), "twin")?, with_curvatures);
    };
    for name in ["DLO1", "DLO2", "DLO3", "DLO4", "DLO5"] {
        let named = asked.iter().filter(|word| *word != "k").count() > 0;
        if !named || asked.iter().any(|word| word == name) {
            climb(&recordings(Path::new(&folder), name)?, with_curvatures)?;
        }
    }
    Ok(())
}

/// Eight recordings of a cable that two hands swing, as a camera would see it: nine markers, 100 frames a
/// second, 20 micrometres of noise.
fn twin(folder: &Path) -> Result<(), Box<dyn Error>> {
    const MARKERS: usize = 9;
    let mut random = ChaCha8Rng::seed_from_u64(7);
    let mut lengths = vec![0.1; MARKERS - 1];
    (lengths[0], lengths[MARKERS - 2]) = (0.03, 0.03);
    // On the table it lies in a bow.
    let mut line = vec![[0.0; 3]];
    for (j, length) in lengths.iter().enumerate() {
        let turn = 0.12 * j as f64;
        let [x, y, _] = line[j];
        line.push([x + length * f64::cos(turn), y + length * f64::sin(turn), 0.0]);
    }
    let text: String = line.iter().map(|[x, y, z]| format!("{x},{y},{z}\n")).collect();
    std::fs::write(folder.join("twin_rest_raw.csv"), format!("x,y,z\n{text}"))?;
    for clip in 0..8 {
        let mut swing = || -> [f64; 4] { std::array::from_fn(|_| random.random_range(0.5..1.0)) };
        let (a, b) = (swing(), swing());
        let times: Vec<f64> = (0..200).map(|k| 0.01 * f64::from(k)).collect();
        // Both hands point down and inwards; the free markers hang somehow between them.
        let place = |j: usize, t: f64| {
            let sway = |s: &[f64; 4], c: usize| 0.06 * s[c] * (5.0 * s[3] * t + 2.0 * s[c]).sin();
            let hand = |s: &[f64; 4], x: f64| [x + sway(s, 0), sway(s, 1), sway(s, 2)];
            let (left, right) = (hand(&a, 0.0), hand(&b, 0.45));
            let inwards = 0.03 * std::f64::consts::FRAC_1_SQRT_2;
            match j {
                0 => left,
                1 => [left[0] + inwards, left[1], left[2] - inwards],
                _ if j == MARKERS - 1 => right,
                _ if j == MARKERS - 2 => [right[0] - inwards, right[1], right[2] - inwards],
                _ => {
                    let u = j as f64 / (MARKERS - 1) as f64;
                    let between = |c: usize| left[c] + u * (right[c] - left[c]);
                    [between(0), between(1), between(2) - 0.9 * u * (1.0 - u)]
                }
            }
        };
        let seen = |j: usize| (j.to_string(), times.iter().map(|t| Some(place(j, *t))).collect());
        let hands = Track::new(times.clone(), (0..MARKERS).map(seen).collect())?;
        let truth = Cable {
            name: "twin".into(),
            clips: vec![(PathBuf::from("twin"), Arc::new(hands))],
            table: Some(folder.join("twin_rest_raw.csv")),
            lengths: lengths.clone(),
        };
        let mut scene = truth.scene(true);
        scene.material.youngs_modulus = 2.5e8;
        scene.material.shear_modulus = Some(1e8);
        scene.rod.natural_curvature = 0.8.into();
        scene.loads.damping.mass = 0.3;
        scene.loads.damping.stiffness = 0.03;
        scene.loads.damping.friction = Some(Friction { stiffness: 0.8, curvature: 1.0 });
        let run = truth.problem(&scene, 0)?.simulate()?;
        let header = (0..MARKERS).map(|j| format!(",x{j},y{j},z{j}")).collect::<String>();
        let mut text = format!("t{header}\n");
        for (k, time) in run.times().iter().enumerate() {
            text += &time.to_string();
            for j in 0..MARKERS {
                for x in run.node(j, k) {
                    let noise: f64 = (0..12).map(|_| random.random_range(-0.5..0.5)).sum();
                    text += &format!(",{:.6}", x + 20e-6 * noise);
                }
            }
            text += "\n";
        }
        std::fs::write(folder.join(format!("twin_train_{clip}.csv")), text)?;
    }
    Ok(())
}
