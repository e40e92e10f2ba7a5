//! Recordings of a cable with known parameters between two moving grippers, with the noise of a camera.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use rodfit::scene::{InitialState, Material, Recorded, Scene, Scheme, Support, Time, Track};
use std::f64::consts::TAU;

use crate::common::straight_rod;

/// Markers along the cable, two of them in each gripper.
pub const MARKERS: usize = 7;
/// Young's modulus of the cable, Pa.
pub const MODULUS: f64 = 5e8;
/// Distance of consecutive markers, m; after it the time between two frames, s.
const APART: f64 = 0.07;
const FRAME: f64 = 0.01;

/// Scene of a planar cable of 0.42 m between two grippers that follow the recording `track`.
pub fn cable(track: Track) -> Scene {
    driven_cable(track, APART * (MARKERS - 1) as f64, MODULUS, [0.5, 0.02])
}

/// Scene of a planar cable of this length, m, and Young's modulus, Pa, between two grippers that follow the recording `track`,
/// with an edge between any two markers. Its damping is by mass, 1/s, and by stiffness, s.
pub fn driven_cable(track: Track, length: f64, modulus: f64, damping: [f64; 2]) -> Scene {
    let segments = track.markers().len() - 1;
    let mut scene = straight_rod(segments, [length, 1.5e-3], Material::new(1100.0, modulus));
    scene.loads.gravity = [0.0, -9.8, 0.0];
    [scene.loads.damping.mass, scene.loads.damping.stiffness] = damping;
    scene.supports.start = Support::Recorded;
    scene.supports.end = Support::Recorded;
    scene.initial.state = InitialState::Recorded;
    let scheme = Scheme::GeneralisedAlpha;
    scene.time = Some(Time { scheme, ..Time::new(track.end(), FRAME) });
    scene.supports.path = Some(Recorded::of(track));
    scene
}

/// Recording of two grippers with motions drawn from `seed`. The markers between them are on a sagging line, which is used
/// only as the first shape of the cable.
fn hands(seed: u64, frames: usize) -> Track {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut draw = |low: f64, high: f64| random.random_range(low..high);
    let swings: Vec<[f64; 3]> =
        (0..6).map(|_| [draw(0.005, 0.02), draw(0.6, 2.2), draw(0.0, TAU)]).collect();
    let swing = |k: usize, t: f64| {
        let [size, frequency, phase] = swings[k];
        size * ((TAU * frequency * t + phase).sin() - phase.sin())
    };
    let span = 0.65 * APART * (MARKERS - 1) as f64;
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
    let markers = (0..MARKERS).map(|j| (j.to_string(), seen(j))).collect();
    Track::new(times, markers).unwrap()
}

/// Recording of the cable, with `change` applied to its scene, between the grippers of `seed`: positions of all markers with
/// normal noise of standard deviation `sigma`, m.
pub fn recorded(seed: u64, frames: usize, sigma: f64, change: impl Fn(&mut Scene)) -> Track {
    // The first frames settle what the line is not.
    let settling = 30;
    let mut scene = cable(hands(seed, frames + settling));
    change(&mut scene);
    let run = scene.problem().unwrap().simulate().unwrap();
    let mut random = ChaCha8Rng::seed_from_u64(seed ^ 0x5eed);
    let mut noise =
        || sigma * <StandardNormal as Distribution<f64>>::sample(&StandardNormal, &mut random);
    let mut seen = vec![Vec::new(); MARKERS];
    for k in settling..settling + frames {
        for (j, seen) in seen.iter_mut().enumerate() {
            let [x, y, _] = run.node(j, k);
            seen.push(Some([x + noise(), y + noise(), 0.0]));
        }
    }
    let times = (0..frames).map(|k| FRAME * k as f64).collect();
    let markers = seen.into_iter().enumerate().map(|(j, seen)| (j.to_string(), seen)).collect();
    Track::new(times, markers).unwrap()
}

/// A recording as a file.
pub fn csv(track: &Track) -> String {
    let names = track.markers().iter().map(|m| format!(",x{0},y{0}", m.name));
    let mut text = format!("t{}\n", names.collect::<String>());
    for (k, t) in track.times().iter().enumerate() {
        let places = track.markers().iter().map(|m| match m.seen[k] {
            Some([x, y, _]) => format!(",{x},{y}"),
            None => ",,".into(),
        });
        text += &format!("{t}{}\n", places.collect::<String>());
    }
    text
}
