//! Data for templates: what the scene does with other numbers than it says, with noise.

use crate::command::init::{Files, Template, cable, quoted, read};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};
use rodfit::scene::{Time, Track};
use rodfit::vibration::ModePlane;
use rodfit::{Error, Parameter, Point, Scene};
use std::f64::consts::TAU;

/// Of the cable's recordings: markers, of which two are in each hand; distance between two of them, m; time between
/// frames, s; frames; and of those before, in which what the first shape is not settles.
const MARKERS: usize = 7;
const APART: f64 = 0.07;
const FRAME: f64 = 0.01;
const FRAMES: usize = 150;
const SETTLING: usize = 40;

/// Normal noise, always the same.
struct Noise(ChaCha8Rng, f64);

impl Noise {
    fn new(sigma: f64, seed: usize) -> Self {
        Self(ChaCha8Rng::seed_from_u64(seed as u64), sigma)
    }

    /// A number with noise, rounded to hundredths of a millimetre of metres.
    fn on(&mut self, x: f64) -> f64 {
        let noise = Normal::new(0.0, self.1).map_or(0.0, |normal| normal.sample(&mut self.0));
        ((x + noise) * 1e5).round() / 1e5
    }
}

/// Scene, fit and data of a template.
pub fn files(template: Template, (name, scene, fit): (&str, &str, &str)) -> Result<Files, Error> {
    let mut files = match template {
        Template::Cantilever | Template::Helix => {
            let scene = scene.replace("{end}", "1.0");
            let data = format!("{name}-tip.csv");
            let in_space = matches!(template, Template::Helix);
            let text = tip(&read(&scene)?, in_space)?;
            let observation = format!(
                "[[observation]]\nfile = \"{data}\"{}# t, x, y, z in s and m; rodfit inspect tells of other files\n\
                 point = \"tip\"\n",
                " ".repeat(20usize.saturating_sub(data.len()))
            );
            let fit = fit.replace("{observation}", &observation);
            vec![(format!("{name}.toml"), scene), (format!("{name}-fit.toml"), fit), (data, text)]
        }
        Template::Droop => {
            let fit = fit.replace("{file}", "\"droop.csv\"");
            let text = droop(&read(scene)?)?;
            vec![
                (format!("{name}.toml"), scene.into()),
                (format!("{name}-fit.toml"), fit),
                ("droop.csv".into(), text),
            ]
        }
        Template::Frequencies => {
            let problem =
                finely(&read(scene)?).problem()?.with([(Parameter::YoungsModulus, 1.1e8)])?;
            let modes = problem.modes(4, Default::default())?;
            let seen = modes.modes.iter().filter(|mode| mode.plane == Some(ModePlane::In)).take(2);
            let hz = seen.map(|mode| (mode.frequency_rad_s / TAU * 100.0).round() / 100.0);
            let hz: Vec<f64> = hz.collect();
            let fit = fit.replace("{hz}", &format!("{hz:?}"));
            vec![(format!("{name}.toml"), scene.into()), (format!("{name}-fit.toml"), fit)]
        }
        Template::Cable => return recordings(scene, fit),
    };
    files.sort();
    Ok(files)
}

/// A scene with a mesh and steps whose errors are far below the noise.
fn finely(scene: &Scene) -> Scene {
    let mut scene = scene.clone();
    scene.rod.segments = Some(100);
    scene.time = scene.time.map(|time| Time::new(time.end, 5e-4));
    scene
}

fn tip(scene: &Scene, in_space: bool) -> Result<String, Error> {
    let mut truth = vec![(Parameter::YoungsModulus, if in_space { 1.1e7 } else { 1.1e8 })];
    if !in_space {
        truth.push((Parameter::DampingMass, 0.4));
    }
    let run = finely(scene).problem()?.with(truth)?.simulate()?;
    let mut noise = Noise::new(5e-4, 1);
    let mut text = if in_space { "t,x,y,z\n" } else { "t,x,y\n" }.to_string();
    for k in 1..=100 {
        let t = 0.01 * f64::from(k);
        let (x, _) = run.at(Point::Tip, t)?;
        let [a, b, c] = [x[0], x[1], x[2]].map(|x| noise.on(x));
        let z = if in_space { format!(",{c}") } else { String::new() };
        text += &format!("{t:.2},{a},{b}{z}\n");
    }
    Ok(text)
}

fn droop(scene: &Scene) -> Result<String, Error> {
    let problem = finely(scene).problem()?.with([(Parameter::YoungsModulus, 3e7)])?;
    let rest = problem.equilibrium()?;
    let mut noise = Noise::new(3e-4, 1);
    let mut text = "s[mm],x[mm],y[mm]\n".to_string();
    for i in (10..=problem.segments()).step_by(10) {
        let s = problem.arc_lengths()[i];
        let [x, y, _] = rest.nodes[i].map(|x| 1e3 * noise.on(x));
        text += &format!("{:.2},{x:.2},{y:.2}\n", 1e3 * s);
    }
    Ok(text)
}

/// Hands that swing, each in its own way, with the markers between them on a sagging line.
fn hands(clip: usize, frames: usize) -> Result<Track, Error> {
    let span = 0.65 * APART * (MARKERS - 1) as f64;
    let swing = |k: usize, t: f64| {
        let phase = (clip * 7 + k * 3) as f64;
        let (size, frequency) =
            (0.008 + 0.01 * phase.sin().abs(), 0.8 + 1.2 * (2.0 * phase).cos().abs());
        size * ((TAU * frequency * t + phase).sin() - phase.sin())
    };
    let place = |j: usize, t: f64| {
        let first = [swing(0, t), swing(1, t)];
        let last = [span + swing(2, t), swing(3, t)];
        let [down, up] = [-0.5 + 8.0 * swing(4, t), 0.5 + 8.0 * swing(5, t)];
        let along = |[x, y]: [f64; 2], angle: f64, way: f64| {
            [x + way * angle.cos(), y + way * angle.sin(), 0.0]
        };
        match j {
            0 => along(first, down, 0.0),
            1 => along(first, down, APART),
            j if j == MARKERS - 2 => along(last, up, -APART),
            j if j == MARKERS - 1 => along(last, up, 0.0),
            j => {
                let (a, b) = (along(first, down, APART), along(last, up, -APART));
                let u = (j - 1) as f64 / (MARKERS - 3) as f64;
                let sag = -0.28 * u * (1.0 - u);
                [a[0] + u * (b[0] - a[0]), a[1] + u * (b[1] - a[1]) + sag, 0.0]
            }
        }
    };
    let times: Vec<f64> = (0..frames).map(|k| FRAME * k as f64).collect();
    let seen = |j: usize| times.iter().map(|t| Some(place(j, *t))).collect();
    track(times.clone(), (0..MARKERS).map(|j| (j.to_string(), seen(j))).collect())
}

type Seen = Vec<(String, Vec<Option<[f64; 3]>>)>;

fn track(times: Vec<f64>, markers: Seen) -> Result<Track, Error> {
    Track::new(times, markers).map_err(Error::Fit)
}

/// A recording as a file.
fn csv(track: &Track) -> String {
    let names = track.markers().iter().map(|m| format!(",x{0},y{0}", m.name));
    let mut text = format!("t{}\n", names.collect::<String>());
    for (k, t) in track.times().iter().enumerate() {
        let places = track.markers().iter().filter_map(|m| m.seen[k]);
        let places = places.map(|[x, y, _]| format!(",{x},{y}"));
        text += &format!("{}{}\n", (t * 1e6).round() / 1e6, places.collect::<String>());
    }
    text
}

/// Four recordings of a cable, of which the last is held out.
fn recordings(scene: &str, fit: &str) -> Result<Files, Error> {
    let mut files = Vec::new();
    let unwritten = |source| Error::Io { named_in: None, path: std::env::temp_dir(), source };
    let folder = tempfile::tempdir().map_err(unwritten)?;
    let line = |j: usize| vec![Some([APART * j as f64, 0.0, 0.0]); 2];
    let straight =
        track(vec![0.0, FRAME], (0..MARKERS).map(|j| (j.to_string(), line(j))).collect())?;
    let truth = cable(scene, &straight, &quoted("cable-1.csv"), "");
    for clip in 0..4 {
        let hands = hands(clip, FRAMES + SETTLING)?;
        std::fs::write(folder.path().join("cable-1.csv"), csv(&hands)).map_err(unwritten)?;
        let made = Scene::from_toml(&truth, folder.path())?.problem()?;
        let run = made.with([(Parameter::YoungsModulus, 1e7)])?.simulate()?;
        let mut noise = Noise::new(2e-4, clip);
        let mut seen: Seen = (0..MARKERS).map(|j| (j.to_string(), Vec::new())).collect();
        for k in 0..FRAMES {
            for (j, (_, seen)) in seen.iter_mut().enumerate() {
                let [x, y, _] = run.node(j, k + SETTLING);
                // Hands are where they are.
                let held = j < 2 || j + 2 >= MARKERS;
                let [x, y] =
                    [x, y].map(|x| if held { (x * 1e6).round() / 1e6 } else { noise.on(x) });
                seen.push(Some([x, y, 0.0]));
            }
        }
        let recorded = track((0..FRAMES).map(|k| FRAME * k as f64).collect(), seen)?;
        files.push((format!("cable-{}.csv", clip + 1), csv(&recorded)));
        if clip == 0 {
            files.push(("cable.toml".into(), cable(scene, &recorded, &quoted("cable-1.csv"), "")));
        }
    }
    let held_out = "\n[[experiment]]              # predicted only\nscene = \"cable.toml\"\npaths = [\"cable-4.csv\"]\n\
                    held_out = true\n[[experiment.observation]]\nmarkers = \"free\"\nsigma = 3e-4\n";
    let fitted = "[\"cable-1.csv\", \"cable-2.csv\", \"cable-3.csv\"]";
    let sigma = "3e-4                # m, of the made-up noise; of real cables 0.01: how far off a good model is";
    let fit = fit.replace("{fitted}", fitted).replace("{held_out}", held_out);
    let fit = fit.replace("{sigma}", sigma);
    files.push(("cable-fit.toml".into(), fit));
    Ok(files)
}
