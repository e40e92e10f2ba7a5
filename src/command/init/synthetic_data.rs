//! Synthetic data of the templates of `rodfit init`.
//!
//! Motion, equilibrium or modes of the scene of a template are computed with other parameter values than its own. All
//! but the cable have [`refined`] meshes and steps, whose error is far below the noise. Normal noise with a fixed seed
//! is added to positions, so that the data are reproducible; those of markers on the grippers of a cable have none.
//! Output are the scene, the fit and the data: tip motion, shape at rest, two natural frequencies (in the fit file,
//! without noise), or recordings of a cable's markers.

use crate::command::init::cable::cable_scene;
use crate::command::init::{NewFile, Template, TemplateTexts, toml_string};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};
use rodfit::scene::{Time, Track};
use rodfit::vibration::ModePlane;
use rodfit::{Error, Parameter, Point, Scene};
use std::f64::consts::TAU;

/// Number of markers of a cable, of which two are on each gripper.
const MARKERS: usize = 7;
/// Distance between two markers of a cable, m.
const MARKER_DISTANCE: f64 = 0.07;
/// Time between two frames of a cable's recording, s.
const FRAME_INTERVAL: f64 = 0.01;
/// Frames of a cable's recording.
const FRAMES: usize = 150;
/// Simulated frames before the recording, in which the transient of the straight initial shape decays.
const TRANSIENT_FRAMES: usize = 40;
/// Number of recordings of a cable; the last is validation data.
const RECORDINGS: usize = 4;

/// Reproducible normal noise: a seeded generator, and the standard deviation `sigma`, m.
struct NormalNoise {
    random: ChaCha8Rng,
    sigma: f64,
}

impl NormalNoise {
    /// Noise of the standard deviation `sigma`, m, whose generator starts from a `seed`.
    fn new(sigma: f64, seed: usize) -> Self {
        Self { random: ChaCha8Rng::seed_from_u64(seed as u64), sigma }
    }

    /// A coordinate, m, plus a sample of the noise, rounded to 1e-5 m.
    fn add(&mut self, x: f64) -> f64 {
        let normal = Normal::new(0.0, self.sigma);
        let noise = normal.map_or(0.0, |normal| normal.sample(&mut self.random));
        ((x + noise) * 1e5).round() / 1e5
    }
}

/// Scene, fit and data files of a template, with their texts. All are sorted by name, except those of the cable. An
/// error if the scene is invalid or its simulation fails.
pub(super) fn synthetic_files(texts: &TemplateTexts) -> Result<Vec<NewFile>, Error> {
    let TemplateTexts { template, name, scene, fit } = texts;
    let mut files = match template {
        Template::Cantilever | Template::Helix => {
            let scene = scene.replace("{end}", "1.0");
            let data = format!("{name}-tip.csv");
            let text = tip_motion(&read(&scene)?, *template == Template::Helix)?;
            let observation = format!(
                "[[observation]]\nfile = \"{data}\"{}# t, x, y, z in s and m; rodfit inspect describes other files\n\
                 point = \"tip\"\n",
                " ".repeat(20usize.saturating_sub(data.len()))
            );
            let mut files = texts.files(scene, fit.replace("{observation}", &observation));
            files.push(NewFile::new(data, text));
            files
        }
        Template::Droop => {
            let mut files = texts.files(scene, fit.replace("{file}", "\"droop.csv\""));
            files.push(NewFile::new("droop.csv", rest_shape(&read(scene)?)?));
            files
        }
        Template::Frequencies => {
            // Frequencies are written into the fit file itself, rounded to 0.01 Hz.
            let problem = refined(&read(scene)?).problem()?;
            let problem = problem.with([(Parameter::YoungsModulus, 1.1e8)])?;
            let modes = problem.modes(4, Default::default())?;
            let planar =
                modes.modes.iter().filter(|mode| mode.plane == Some(ModePlane::In)).take(2);
            let hz = planar.map(|mode| (mode.frequency_rad_s / TAU * 100.0).round() / 100.0);
            let hz: Vec<f64> = hz.collect();
            texts.files(scene, fit.replace("{hz}", &format!("{hz:?}")))
        }
        Template::Cable => return cable_files(scene, fit),
    };
    files.sort_by(|a, b| a.name.cmp(&b.name));
    Ok(files)
}

/// The scene of a TOML text; its data files are relative to the current folder. Errors are those of
/// [`Scene::from_toml`].
fn read(scene: &str) -> Result<Scene, Error> {
    Scene::from_toml(scene, ".")
}

/// The scene with 100 segments and, if it has a time, steps of 5e-4 s, whose discretization error is far below the
/// noise.
fn refined(scene: &Scene) -> Scene {
    let mut scene = scene.clone();
    scene.rod.segments = Some(100);
    scene.time = scene.time.map(|time| Time::new(time.end, 5e-4));
    scene
}

/// The simulated motion of the tip as CSV: a header, and 100 rows with time, s, from 0.01 to 1, and coordinates, m.
/// They are two of a planar rod and three in space, with noise of 0.5 mm from a fixed seed, rounded to 1e-5 m.
/// Young's modulus is 1.1e8 Pa, or 1.1e7 Pa in space: 2.2 times that of the template. A planar rod has a mass damping
/// of 0.4 1/s. Mesh and step are [`refined`]. An error if the scene is invalid or its simulation fails.
fn tip_motion(scene: &Scene, is_spatial: bool) -> Result<String, Error> {
    let mut truth = vec![(Parameter::YoungsModulus, if is_spatial { 1.1e7 } else { 1.1e8 })];
    if !is_spatial {
        truth.push((Parameter::DampingMass, 0.4));
    }
    // The parameters differ from those of the scene, so that the fit has a task.
    let run = refined(scene).problem()?.with(truth)?.simulate()?;
    let mut noise = NormalNoise::new(5e-4, 1);
    let mut text = if is_spatial { "t,x,y,z\n" } else { "t,x,y\n" }.to_string();
    for k in 1..=100 {
        let t = 0.01 * f64::from(k);
        let (x, _) = run.at(Point::Tip, t)?;
        let [a, b, c] = [x[0], x[1], x[2]].map(|x| noise.add(x));
        let z = if is_spatial { format!(",{c}") } else { String::new() };
        text += &format!("{t:.2},{a},{b}{z}\n");
    }
    Ok(text)
}

/// The equilibrium of the scene with Young's modulus 3e7 Pa as CSV with noise of 0.3 mm: arc length and two
/// coordinates, mm, at every tenth node from the tenth on. Errors: an invalid scene, or no equilibrium.
fn rest_shape(scene: &Scene) -> Result<String, Error> {
    let problem = refined(scene).problem()?.with([(Parameter::YoungsModulus, 3e7)])?;
    let rest = problem.equilibrium()?;
    let mut noise = NormalNoise::new(3e-4, 1);
    let mut text = "s[mm],x[mm],y[mm]\n".to_string();
    for i in (10..=problem.segments()).step_by(10) {
        let s = problem.arc_lengths()[i];
        let [x, y, _] = rest.nodes[i].map(|x| 1e3 * noise.add(x));
        text += &format!("{:.2},{x:.2},{y:.2}\n", 1e3 * s);
    }
    Ok(text)
}

/// The track of [`MARKERS`] markers, named from `0`. `position(j, k)` returns the coordinates, m, of marker `j` in
/// frame `k`; `times` are those of the frames, s. Errors are those of [`Track::new`].
fn cable_track(
    times: Vec<f64>,
    position: impl Fn(usize, usize) -> [f64; 3],
) -> Result<Track, Error> {
    let positions = |j: usize| (0..times.len()).map(|k| Some(position(j, k))).collect();
    let markers = (0..MARKERS).map(|j| (j.to_string(), positions(j))).collect();
    Track::new(times, markers).map_err(Error::Fit)
}

/// Times of this number of `frames`, s: multiples of [`FRAME_INTERVAL`] from 0 on.
fn frame_times(frames: usize) -> Vec<f64> {
    (0..frames).map(|k| FRAME_INTERVAL * k as f64).collect()
}

/// The prescribed motion of recording number `recording`, with [`TRANSIENT_FRAMES`] in front: two grippers with two
/// markers each move and rotate in the x-y plane. Each of the six coordinates is a sine of time, less its value at 0,
/// with an amplitude and a frequency of its own. The inner markers lie on a parabola between them, which is 0.07 m
/// below the chord in its middle. Errors are those of [`cable_track`].
fn gripper_motion(recording: usize) -> Result<Track, Error> {
    // The grippers are closer than the cable is long, so that the cable sags.
    let span = 0.65 * MARKER_DISTANCE * (MARKERS - 1) as f64;
    // Amplitude and frequency of each coordinate by an irregular phase.
    let swing = |k: usize, t: f64| {
        let phase = (recording * 7 + k * 3) as f64;
        let amplitude = 0.008 + 0.01 * phase.sin().abs();
        let frequency = 0.8 + 1.2 * (2.0 * phase).cos().abs();
        amplitude * ((TAU * frequency * t + phase).sin() - phase.sin())
    };
    let times = frame_times(FRAMES + TRANSIENT_FRAMES);
    let position = |j: usize, k: usize| {
        let t = FRAME_INTERVAL * k as f64;
        let first = [swing(0, t), swing(1, t)];
        let last = [span + swing(2, t), swing(3, t)];
        let [first_angle, last_angle] = [-0.5 + 8.0 * swing(4, t), 0.5 + 8.0 * swing(5, t)];
        let shifted = |[x, y]: [f64; 2], angle: f64, by: f64| {
            [x + by * angle.cos(), y + by * angle.sin(), 0.0]
        };
        let inner = [
            shifted(first, first_angle, MARKER_DISTANCE),
            shifted(last, last_angle, -MARKER_DISTANCE),
        ];
        match j {
            0 => shifted(first, first_angle, 0.0),
            1 => inner[0],
            j if j == MARKERS - 2 => inner[1],
            j if j == MARKERS - 1 => shifted(last, last_angle, 0.0),
            j => {
                let [a, b] = inner;
                let u = (j - 1) as f64 / (MARKERS - 3) as f64;
                let sag = -0.28 * u * (1.0 - u);
                [a[0] + u * (b[0] - a[0]), a[1] + u * (b[1] - a[1]) + sag, 0.0]
            }
        }
    };
    cable_track(times, position)
}

/// A planar recording as CSV text: a header, then one row per frame with time, s, rounded to 1e-6, and the coordinates
/// x, y of each marker, m.
fn csv(track: &Track) -> String {
    let names = track.markers().iter().map(|m| format!(",x{0},y{0}", m.name));
    let mut text = format!("t{}\n", names.collect::<String>());
    for (k, t) in track.times().iter().enumerate() {
        let positions = track.markers().iter().filter_map(|m| m.seen[k]);
        let positions = positions.map(|[x, y, _]| format!(",{x},{y}"));
        text += &format!("{}{}\n", (t * 1e6).round() / 1e6, positions.collect::<String>());
    }
    text
}

/// Scene, fit and [`RECORDINGS`] recordings of a simulated cable with Young's modulus 1e7 Pa and noise of 0.2 mm on the
/// free markers. Positions on the grippers are rounded to 1e-6 m. The prescribed motion is passed to the simulation by
/// a temporary folder. The last recording is validation data in the fit. Errors: an invalid scene, a failed simulation,
/// and a temporary file that cannot be written.
fn cable_files(scene: &str, fit: &str) -> Result<Vec<NewFile>, Error> {
    let mut files = Vec::new();
    let not_written = |source| Error::io(&std::env::temp_dir(), source);
    let folder = tempfile::tempdir().map_err(not_written)?;
    let straight = cable_track(frame_times(2), |j, _| [MARKER_DISTANCE * j as f64, 0.0, 0.0])?;
    let first_file = toml_string("cable-1.csv");
    let truth = cable_scene(scene, &straight, &first_file, "")?;
    for k in 0..RECORDINGS {
        // The scene reads the motion of the grippers from a file.
        std::fs::write(folder.path().join("cable-1.csv"), csv(&gripper_motion(k)?))
            .map_err(not_written)?;
        let problem = Scene::from_toml(&truth, folder.path())?.problem()?;
        let run = problem.with([(Parameter::YoungsModulus, 1e7)])?.simulate()?;
        let mut noise = NormalNoise::new(2e-4, k);
        // Noise is drawn frame by frame. Markers on the grippers have none.
        let mut positions = vec![[[0.0; 3]; MARKERS]; FRAMES];
        for (frame, positions) in positions.iter_mut().enumerate() {
            for (j, position) in positions.iter_mut().enumerate() {
                let [x, y, _] = run.node(j, frame + TRANSIENT_FRAMES);
                let is_held = j < 2 || j + 2 >= MARKERS;
                let [x, y] = [x, y].map(|x| match is_held {
                    true => (x * 1e6).round() / 1e6,
                    false => noise.add(x),
                });
                *position = [x, y, 0.0];
            }
        }
        let recorded = cable_track(frame_times(FRAMES), |j, frame| positions[frame][j])?;
        files.push(NewFile::new(format!("cable-{}.csv", k + 1), csv(&recorded)));
        // The scene has the lengths and the time step of the first recording.
        if k == 0 {
            let text = cable_scene(scene, &recorded, &first_file, "")?;
            files.push(NewFile::new("cable.toml", text));
        }
    }
    let validation = "\n[[experiment]]              # predicted only\nscene = \"cable.toml\"\npaths = [\"cable-4.csv\"]\n\
                      held_out = true\n[[experiment.observation]]\nmarkers = \"free\"\nsigma = 3e-4\n";
    let fitted = "[\"cable-1.csv\", \"cable-2.csv\", \"cable-3.csv\"]";
    let sigma = "3e-4                # m, of the synthetic noise; for real cables 0.01, the error \
                 of a good model";
    let fit = fit.replace("{fitted}", fitted).replace("{held_out}", validation);
    files.push(NewFile::new("cable-fit.toml", fit.replace("{sigma}", sigma)));
    Ok(files)
}
