//! Synthetic recordings of cables with known parameters: simulated between given grippers, with the noise of a camera; and the
//! coverage of the 95 % intervals of their fits.

use crate::cable::Cable;
use crate::models::{Found, Rung, fit, ladder, scene_of, start};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use rodfit::scene::{Friction, Track};
use rodfit::{Parameter, Trajectory};
use std::error::Error;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Writes eight recordings of a cable that two grippers swing: nine markers, 100 frames per second, 20 micrometers of noise.
pub fn twin(folder: &Path) -> Result<(), Box<dyn Error>> {
    pub const MARKERS: usize = 9;
    let mut random = ChaCha8Rng::seed_from_u64(7);
    let mut lengths = vec![0.1; MARKERS - 1];
    (lengths[0], lengths[MARKERS - 2]) = (0.03, 0.03);
    // The shape at rest on the table is a curve with increasing angle.
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
        // Both grippers point down and inwards; the free markers lie on a parabola between them.
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
        // The true parameters of the synthetic cable.
        let mut scene = truth.scene(true, 1);
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
                    let noise = normal(&mut random);
                    text += &format!(",{:.6}", x + 20e-6 * noise);
                }
            }
            text += "\n";
        }
        std::fs::write(folder.join(format!("twin_train_{clip}.csv")), text)?;
    }
    Ok(())
}

/// Noise of the camera, m.
const NOISE: f64 = 20e-6;
/// Number of synthetic versions of every cable.
const TWINS: usize = 20;
/// Number of recordings of each synthetic version.
const CLIPS: usize = 8;

/// Simulates recordings of [`TWINS`] cables with random known values, fits model T7 to each, and prints for every value how
/// many of the 95 % intervals contain it.
pub fn twins(cable: &Cable) -> Result<(), Box<dyn Error>> {
    let rung = ladder(cable.lengths.len() + 1, 1).into_iter().find(|rung| rung.name == "T7");
    let rung = rung.ok_or("no T7 in the ladder")?;
    let mut inside = vec![0; rung.numbers.len()];
    let mut widths = vec![Vec::new(); rung.numbers.len()];
    for seed in 0..TWINS {
        let mut random = ChaCha8Rng::seed_from_u64(seed as u64);
        // True values are within a factor of 1.4 of the start values.
        let draw = |name: &String| {
            let factor = 1.4_f64.powf(random.random_range(-1.0..1.0));
            (name.clone(), start(name) * factor)
        };
        let truth: Found = rung.numbers.iter().map(draw).collect();
        let total = cable.clips.len();
        let clips: Vec<usize> =
            (0..CLIPS.min(total)).map(|i| (seed + i * total / CLIPS) % total).collect();
        let seen = clips
            .iter()
            .map(|clip| recorded(cable, &rung, &truth, (*clip, &mut random)))
            .collect::<Result<_, _>>()?;
        // A cable with the recordings of the known one, between the original grippers.
        let twin = Cable {
            name: cable.name.clone(),
            clips: seen,
            table: cable.table.clone(),
            lengths: cable.lengths.clone(),
        };
        let all: Vec<usize> = (0..clips.len()).collect();
        let guess = rung.numbers.iter().map(|name| (name.clone(), start(name))).collect();
        let (report, _) = fit(&twin, &rung, &all, &guess)?;
        // A one-sided bound counts as an interval.
        for (k, name) in rung.numbers.iter().enumerate() {
            let parameter: Parameter = name.parse()?;
            let Some(estimate) = report.parameters.iter().find(|e| e.name == parameter) else {
                continue;
            };
            let truth = truth[name];
            let holds = match (estimate.interval95, estimate.upper95) {
                (Some([low, high]), _) => {
                    widths[k].push(0.5 * (high - low) / truth);
                    (low..=high).contains(&truth)
                }
                (None, Some(upper)) => truth <= upper,
                (None, None) => false,
            };
            inside[k] += usize::from(holds);
        }
    }
    println!(
        "{}: T7 of {CLIPS} recordings, {TWINS} twins with {:.0} micrometres of noise",
        cable.name,
        1e6 * NOISE
    );
    for ((name, inside), widths) in rung.numbers.iter().zip(inside).zip(&mut widths) {
        widths.sort_by(f64::total_cmp);
        let width = widths.get(widths.len() / 2).map_or(f64::NAN, |width| 100.0 * width);
        println!(
            "         {name}: inside {inside} times; half an interval is {width:.2} % in the median"
        );
    }
    Ok(())
}

/// The simulated recording of a cable with known parameters between the grippers of a clip.
fn recorded(
    cable: &Cable,
    rung: &Rung,
    truth: &Found,
    (clip, random): (usize, &mut ChaCha8Rng),
) -> Result<(PathBuf, Arc<Track>), Box<dyn Error>> {
    let problem = cable.problem(&scene_of(cable, rung, truth)?, clip)?;
    let run: Trajectory = problem.simulate()?;
    let mut noise = || NOISE * normal(random);
    let markers = cable.lengths.len() + 1;
    let mut seen = vec![Vec::new(); markers];
    for k in 0..run.times().len() {
        for (j, seen) in seen.iter_mut().enumerate() {
            seen.push(Some(run.node(j, k).map(|x| x + noise())));
        }
    }
    let named = seen.into_iter().enumerate().map(|(j, seen)| (j.to_string(), seen)).collect();
    let track = Track::new(run.times().to_vec(), named)?;
    Ok((cable.clips[clip].0.clone(), Arc::new(track)))
}

/// A sample of the standard normal distribution.
fn normal(random: &mut ChaCha8Rng) -> f64 {
    StandardNormal.sample(random)
}
