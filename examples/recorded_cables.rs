//! From recordings of a cable to its physics: a ladder of models, each fitted to some of the
//! recordings and judged on all the others, which it predicts from their first two frames.
//!
//! `cargo run --release --example recorded_cables` makes a synthetic cable, moves it between two hands,
//! and identifies it. With the environment variable `RODFIT_MOCAP_DIR` naming the folder of the DEFORM
//! recordings (Chen et al., CoRL 2024, arXiv 2406.05931; files `DLO1_train_48.csv`, ..,
//! `DLO1_rest_raw.csv`, ..) it identifies the real ones: all five, or those named behind `--`.
//! `k` behind `--` adds a curvature at rest for every marker, and `halves` fits T5 to two halves of the
//! recordings, each without the other.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rodfit::fit::{Analysis, Experiment, FitReport, Glitches, Loss, Refinement};
use rodfit::scene::{
    Discretization, Friction, InitialState, LostFrames, Material, Recorded, Section, Shape,
    Support, SwappedLabels, Taper, Time, Track,
};
use rodfit::{Fit, Observation, Parameter, Point, Problem, Scene, Unknown};
use std::collections::BTreeMap;
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

    /// The scene of a clip, in steps of its frames, with what is wrong in the recording mended.
    fn problem(&self, scene: &Scene, clip: usize) -> Result<Problem, rodfit::Error> {
        let mut scene = scene.clone();
        let (path, track) = &self.clips[clip];
        scene.supports.path = Some(Recorded {
            track: Some(track.clone()),
            lost_frames: LostFrames::Stretch,
            swapped_labels: SwappedLabels::Mend,
            ..Recorded::new(path)
        });
        let times = track.times();
        let mut time = Time::new(Time::TO_THE_END, times[1] - times[0]);
        time.scheme = rodfit::scene::Scheme::GeneralisedAlpha;
        scene.time = Some(time);
        scene.problem()
    }

    /// The name of a clip.
    fn name_of(&self, clip: usize) -> String {
        self.clips[clip].0.file_stem().unwrap_or_default().to_string_lossy().into()
    }

    /// A fit of the free markers of these clips.
    fn fit(&self, scene: &Scene, clips: &[usize]) -> Result<Fit, rodfit::Error> {
        let mut experiments = Vec::new();
        for clip in clips {
            let problem = self.problem(scene, *clip)?;
            let free = Observation::of_free_markers(&problem, EVERY, Glitches::Mask)?;
            let observe =
                |e: Experiment, o: Observation| e.observe(o.sigma(SIGMA).loss(Loss::SoftL1));
            experiments.push(
                free.into_iter().fold(Experiment::new(self.name_of(*clip), &problem), observe),
            );
        }
        // One edge between any two markers is part of the model.
        let same_mesh = Analysis { discretization_error: Refinement::None, ..Analysis::default() };
        Ok(Fit::of(experiments).analyse(same_mesh))
    }

    /// Mean distance per coordinate of all markers but for the first two frames, m: the metric of the
    /// recordings' authors.
    fn error(&self, scene: &Scene, clip: usize) -> Result<f64, rodfit::Error> {
        let problem = self.problem(scene, clip)?;
        let run = problem.simulate()?;
        // The recording as it is mended.
        let path = problem.scene().supports.path.as_ref();
        let track = path.and_then(|path| path.track.as_ref()).unwrap_or(&self.clips[clip].1);
        let (mut sum, mut count) = (0.0, 0.0);
        for (k, time) in track.times().iter().enumerate().skip(2) {
            for (node, marker) in track.markers().iter().enumerate() {
                let found = run.at(Point::Node(node), *time)?.0;
                for (c, seen) in marker.seen[k].into_iter().flatten().enumerate() {
                    sum += (found[c] - seen).abs();
                    count += 1.0;
                }
            }
        }
        Ok(sum / count)
    }
}

fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|c| (a[c] - b[c]).powi(2)).sum::<f64>().sqrt()
}

/// A model: its name, how many clips it is fitted to at most, and its numbers.
struct Rung {
    name: &'static str,
    most: usize,
    numbers: Vec<String>,
}

/// The models for cables of so many markers, simplest first. The last two with ten numbers are rivals.
fn ladder(markers: usize) -> Vec<Rung> {
    let listed = |names: &[&str]| names.iter().map(|name| name.to_string()).collect::<Vec<_>>();
    let rung = |name, most, numbers: Vec<String>| Rung { name, most, numbers };
    let bending = |j: usize| ["d1", "d2"].map(|d| format!("rod.natural_bending.{j}.{d}"));
    let b3 = listed(&["youngs_modulus", "damping.stiffness", "damping.mass"]);
    let t5 = [b3.clone(), listed(&["rod.natural_curvature", "shear_modulus"])].concat();
    let friction =
        listed(&["loads.damping.friction.stiffness", "loads.damping.friction.curvature"]);
    let t7 = [t5.clone(), friction].concat();
    let along = ["rod.taper.youngs_modulus.0", "rod.taper.youngs_modulus.2", "rod.shape.scale"];
    let t10 = [t7.clone(), listed(&along)].concat();
    let without = |names: &[String], not: &[&str]| -> Vec<String> {
        names.iter().filter(|name| !not.contains(&name.as_str())).cloned().collect()
    };
    // Hands do not hold the cable along its line: the turns at their edges, instead of the drag.
    let turns = [1, markers - 2].into_iter().flat_map(bending).collect();
    let t10e = [without(&t7, &["damping.mass"]), turns].concat();
    // A curvature for every marker has the table's in it.
    let curvatures = (1..markers - 1).flat_map(bending).collect();
    let k = [without(&t7, &["rod.natural_curvature"]), listed(&along[2..]), curvatures].concat();
    vec![
        rung("B3", 16, b3),
        rung("T5", 16, t5),
        rung("T7", 16, t7),
        rung("T10", 16, t10),
        rung("T10e", 16, t10e),
        rung("K", 16, k),
    ]
}

/// Where a number starts that no simpler model had.
fn start(name: &str) -> f64 {
    match name {
        "youngs_modulus" => 1e8,
        "shear_modulus" => 5e7,
        "damping.stiffness" => 0.08,
        "damping.mass" => 0.2,
        "rod.natural_curvature" => 0.6,
        "loads.damping.friction.stiffness" => 1.0,
        "loads.damping.friction.curvature" => 1.5,
        _ if name.starts_with("rod.natural_bending") => 0.0,
        _ => 1.0,
    }
}

/// What a model found: values by name, those that came out at zero among them.
type Found = BTreeMap<String, f64>;

/// The scene of a model with these values, the number's start where there is none.
fn scene_of(cable: &Cable, rung: &Rung, found: &Found) -> Result<Scene, Box<dyn Error>> {
    let markers = cable.lengths.len() + 1;
    let has = |part: &str| rung.numbers.iter().any(|name| name.contains(part));
    let mut scene = cable.scene(has("shear_modulus"));
    if has("friction") {
        scene.loads.damping.friction = Some(Friction { stiffness: 1.0, curvature: 1.5 });
    }
    if has("taper") {
        scene.rod.taper = Taper { youngs_modulus: Some(vec![1.0; 3].into()), ..Taper::default() };
    }
    if has("natural_bending") {
        scene.rod.natural_bending = vec![[0.0; 2]; markers];
    }
    if !has("damping.mass") {
        scene.loads.damping.mass = 0.0;
    }
    if has("natural_bending") && !has("rod.natural_curvature") {
        // Curvatures of its own go on from the table's as T7 found them.
        if let Some(value) = found.get("rod.natural_curvature") {
            "rod.natural_curvature".parse::<Parameter>()?.set(&mut scene, *value)?;
        }
    }
    for name in &rung.numbers {
        let value = found.get(name).copied().unwrap_or_else(|| start(name));
        name.parse::<Parameter>()?.set(&mut scene, value)?;
    }
    Ok(scene)
}

/// Fits a model to some clips, from what simpler ones found.
fn fit(
    cable: &Cable,
    rung: &Rung,
    clips: &[usize],
    before: &Found,
) -> Result<(FitReport, Found), Box<dyn Error>> {
    let scene = scene_of(cable, rung, before)?;
    let mut fit = cable.fit(&scene, clips)?;
    // A damping that came out at zero is not there.
    for name in rung.numbers.iter().filter(|name| before.get(*name) != Some(&0.0)) {
        let unknown = Unknown::new(name.parse()?);
        // Of the modulus nothing is known before.
        let scanned = name == "youngs_modulus" && !before.contains_key(name);
        let value = before.get(name).copied().unwrap_or_else(|| start(name));
        fit = fit.identify(if scanned { unknown } else { unknown.start(value) });
    }
    let report = fit.solve()?;
    let mut found = before.clone();
    for (name, estimate) in rung.numbers.iter().filter_map(|name| {
        let parameter: Parameter = name.parse().ok()?;
        Some((name, report.parameters.iter().find(|e| e.name == parameter)?))
    }) {
        // What these recordings do not show stays where it was.
        if let Some(value) = estimate.value {
            found.insert(name.clone(), value);
        }
    }
    Ok((report, found))
}

/// So many of all clips, evenly spread; the others judge.
fn spread(total: usize, most: usize) -> Vec<usize> {
    let count = most.min(2 * total / 3);
    (0..count).map(|i| i * total / count).collect()
}

fn climb(cable: &Cable, with_curvatures: bool) -> Result<(), Box<dyn Error>> {
    let total = cable.clips.len();
    let markers = cable.lengths.len() + 1;
    println!(
        "{}: {total} recordings of {markers} markers, {:.3} m long",
        cable.name,
        cable.lengths.iter().sum::<f64>()
    );
    let mut found = Found::new();
    // Rivals go on from the same rung.
    let mut t7 = None;
    for rung in ladder(markers) {
        if rung.name == "K" && !with_curvatures {
            continue;
        }
        if matches!(rung.name, "T10e" | "K") {
            found = t7.clone().unwrap_or(found);
        }
        let since = Instant::now();
        let fitted = spread(total, rung.most);
        let (report, values) = fit(cable, &rung, &fitted, &found)?;
        found = values;
        if rung.name == "T7" {
            t7 = Some(found.clone());
        }
        let took = since.elapsed().as_secs_f64();
        let scene = scene_of(cable, &rung, &found)?;
        let mut errors = [Vec::new(), Vec::new()];
        for clip in 0..total {
            match cable.error(&scene, clip) {
                Ok(error) => errors[usize::from(!fitted.contains(&clip))].push(error),
                Err(error) => println!("         {}: {error}", cable.name_of(clip)),
            }
        }
        let mean = |x: &[f64]| 100.0 * x.iter().sum::<f64>() / x.len() as f64;
        println!(
            "  {:4} {:2} numbers, {:2} recordings: {:.3} cm off, {:.3} cm on {} of the {} others; {took:.1} s, {:.0} simulations",
            rung.name,
            report.parameters.len(),
            fitted.len(),
            mean(&errors[0]),
            mean(&errors[1]),
            errors[1].len(),
            total - fitted.len(),
            report.simulations,
        );
        print(&report, 10);
    }
    Ok(())
}

/// The first estimates of a report.
fn print(report: &FitReport, most: usize) {
    for estimate in report.parameters.iter().take(most) {
        let interval = match (estimate.interval95, estimate.upper95) {
            (Some([a, b]), _) => format!("[{a:.4e}, {b:.4e}]"),
            (None, Some(upper)) => format!("at most {upper:.4e}"),
            (None, None) => "not determined".into(),
        };
        let value = estimate.value.map_or(String::new(), |value| format!("{value:.4e} "));
        println!("         {} = {value}{interval} {}", estimate.name, estimate.name.unit());
    }
}

/// T5 of both halves of the recordings, each without the other: whether the intervals tell how well the
/// modulus over the density is known.
fn halves(cable: &Cable) -> Result<(), Box<dyn Error>> {
    let rungs = ladder(cable.lengths.len() + 1);
    let mut logs = Vec::new();
    for half in 0..2 {
        let clips: Vec<usize> = (0..cable.clips.len()).filter(|k| k % 2 == half).collect();
        let mut found = Found::new();
        let mut last = None;
        for rung in rungs.iter().filter(|rung| matches!(rung.name, "B3" | "T5")) {
            let (report, values) = fit(cable, rung, &clips, &found)?;
            (found, last) = (values, Some(report));
        }
        let Some(report) = last else { continue };
        let modulus = &report.parameters[0];
        let (Some(value), Some([low, high])) = (modulus.value, modulus.interval95) else {
            println!("{}: half {half}: E is not determined", cable.name);
            continue;
        };
        println!(
            "{}: half {half}, {} recordings: EI/(rho A) = {:.4e} [{:.4e}, {:.4e}] m^4/s^2",
            cable.name,
            clips.len(),
            flexural(value),
            flexural(low),
            flexural(high)
        );
        logs.push((value.ln(), 0.5 * (high / low).ln()));
    }
    if let [(a, da), (b, db)] = logs[..] {
        let (apart, within) = ((a - b).abs(), da.hypot(db));
        println!(
            "{}: halves are {:.1} % apart, the intervals say {:.1} %",
            cable.name,
            100.0 * apart,
            100.0 * within
        );
    }
    Ok(())
}

/// `EI/(rho A)`, m^4/s^2, of a modulus, Pa.
fn flexural(modulus: f64) -> f64 {
    modulus * RADIUS * RADIUS / (4.0 * DENSITY)
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
    let said = |word: &str| asked.iter().any(|asked| asked == word);
    let study =
        |cable: &Cable| if said("halves") { halves(cable) } else { climb(cable, said("k")) };
    let Some(folder) = std::env::var_os("RODFIT_MOCAP_DIR") else {
        println!("RODFIT_MOCAP_DIR names no folder of recordings: a synthetic cable instead");
        let folder = tempfile::tempdir()?;
        twin(folder.path())?;
        return study(&recordings(folder.path(), "twin")?);
    };
    let all = ["DLO1", "DLO2", "DLO3", "DLO4", "DLO5"];
    let named = all.iter().any(|name| said(name));
    for name in all.into_iter().filter(|name| !named || said(name)) {
        study(&recordings(Path::new(&folder), name)?)?;
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
