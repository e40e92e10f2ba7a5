//! Rods whose ends go as markers were seen to go, where that is violent.

use rodfit::Trajectory;
use rodfit::scene::{InitialState, Material, Recorded, Scene, Scheme, Section, Shape, Support};
use rodfit::scene::{Time, Track};
use std::f64::consts::TAU;

const MARKERS: usize = 9;
const APART: f64 = 0.07;

/// Two hands that crack a cable like a whip: 2 m/s and 35 m/s^2.
fn whip() -> Track {
    let hands = [(2.112, 2.908), (3.005, 2.344), (3.717, 0.87), (2.245, 5.442)];
    let swing = |k: usize, t: f64| {
        let (frequency, phase): (f64, f64) = hands[k];
        0.1 * ((TAU * frequency * t + phase).sin() - phase.sin())
    };
    let span = 0.6 * APART * (MARKERS - 1) as f64;
    let (along, down) = (0.9 * APART, 0.436 * APART);
    let place = |j: usize, t: f64| {
        let (a, b) = ([swing(0, t), swing(1, t)], [span + swing(2, t), swing(3, t)]);
        let [x, y] = match j {
            0 => a,
            1 => [a[0] + along, a[1] - down],
            _ if j == MARKERS - 1 => b,
            _ if j == MARKERS - 2 => [b[0] - along, b[1] - down],
            _ => {
                let u = (j - 1) as f64 / (MARKERS - 3) as f64;
                let sag = 0.6 * u * (1.0 - u);
                [
                    a[0] + along + u * (b[0] - a[0] - 2.0 * along),
                    a[1] - down + u * (b[1] - a[1]) - sag,
                ]
            }
        };
        [x, y, 0.0]
    };
    let times: Vec<f64> = (0..150).map(|k| 0.01 * f64::from(k)).collect();
    let seen = |j: usize| times.iter().map(|t| Some(place(j, *t))).collect();
    let markers = (0..MARKERS).map(|j| (j.to_string(), seen(j))).collect();
    Track::new(times, markers).unwrap()
}

/// A cable as many times as long as the markers are apart.
fn run(track: Track, modulus: f64, longer: f64) -> Trajectory {
    let length = longer * APART * (MARKERS - 1) as f64;
    let shape = Shape::Straight { length, direction: [1.0, 0.0, 0.0] };
    let section = Section::Circle { radius: 1.5e-3 };
    let mut scene = Scene::new(MARKERS - 1, shape, section, Material::new(1100.0, modulus));
    scene.loads.gravity = [0.0, -9.8, 0.0];
    scene.loads.damping.mass = 0.3;
    scene.loads.damping.stiffness = 0.03;
    scene.supports.start = Support::Recorded;
    scene.supports.end = Support::Recorded;
    scene.initial.state = InitialState::Recorded;
    let scheme = Scheme::GeneralisedAlpha;
    scene.time = Some(Time { scheme, ..Time::new(track.end(), 0.01) });
    scene.supports.path = Some(Recorded::of(track));
    scene.problem().unwrap().simulate().unwrap()
}

/// In steps of the frames Newton's method finds roots there that are not the motion: the rod struck
/// through itself within a frame. The supports do work, so the energy does not tell; how far edges turn does.
#[test]
fn a_whip_between_two_hands_finds_no_other_root() {
    for modulus in [1e7, 5e7] {
        let run = run(whip(), modulus, 1.0);
        let edge = |j: usize, k: usize| {
            let (a, b) = (run.node(j, k), run.node(j + 1, k));
            (b[1] - a[1]).atan2(b[0] - a[0])
        };
        let turn = |j: usize, k: usize| {
            let turn = (edge(j, k) - edge(j, k - 1)).rem_euclid(TAU);
            turn.min(TAU - turn).to_degrees()
        };
        let frames = 1..run.times().len();
        let most = frames.flat_map(|k| (0..MARKERS - 1).map(move |j| (j, k)));
        let most = most.map(|(j, k)| turn(j, k)).fold(0.0, f64::max);
        println!("E = {modulus:e} Pa: an edge turns by {most:.0} degrees from frame to frame");
        assert!((10.0..60.0).contains(&most), "{most}");
    }
}

/// What is seen of a run from a frame on, nine frames of it.
fn seen(run: &Trajectory, from: usize) -> Track {
    let frames = from..from + 9;
    let marker = |j: usize| frames.clone().map(|k| Some(run.node(j, k))).collect();
    let markers = (0..MARKERS).map(|j| (j.to_string(), marker(j))).collect();
    Track::new((0..9).map(|k| 0.01 * f64::from(k)).collect(), markers).unwrap()
}

/// A cable that is whipped between two hands, and a little longer than what is seen of it between the markers that
/// are held, goes on from two frames of its markers as it did: in the middle between them it has the mean velocity,
/// and its acceleration takes that to where it starts.
#[test]
fn a_recording_goes_on_from_two_of_its_frames() {
    let run = run(whip(), 5e7, 1.02);
    let mut most = [0.0_f64; 2];
    for from in [25, 55, 70] {
        let track = seen(&run, from);
        let again = self::run(track.clone(), 5e7, 1.02);
        for k in 0..9 {
            for (j, marker) in track.markers().iter().enumerate() {
                let (found, seen) = (again.node(j, k), marker.seen[k].unwrap());
                let off = (0..3).map(|c| (found[c] - seen[c]).powi(2)).sum::<f64>().sqrt();
                let most = &mut most[usize::from(k > 0)];
                *most = most.max(off);
            }
        }
    }
    let [begin, later] = most.map(|x| 1e3 * x);
    println!("{begin:.3} mm off at the start, {later:.3} mm later");
    assert!(begin < 0.2 && later < 1.5, "{begin} {later}");
}
