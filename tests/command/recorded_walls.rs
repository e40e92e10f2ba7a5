//! Recordings that move a wall have the checks of those that move recorded ends: units, clock, gaps, jumps, and motion
//! that the time steps alias.

use crate::common::recordings::{csv, recorded};
use crate::folder::{Folder, refused, replaced, stdout, succeeds};
use rodfit::scene::Track;
use std::f64::consts::TAU;

const SCENE: &str = r#"
[rod]
segments = 20
shape = { kind = "straight", length = 0.5, direction = [1, 0, 0] }
section = { kind = "circle", radius = 0.005 }
[material]
density = 1270
youngs_modulus = 1e8
[[supports.motion]]
end = "start"
file = "wall.csv"
[time]
end = 0.5
step = 1e-3
"#;

/// Rows of a wall with vertical motion `y`, in steps of 1 ms.
fn rows(last: u32, y: impl Fn(u32, f64) -> Option<f64>) -> String {
    let row = |k: u32| {
        let t = f64::from(k) * 1e-3;
        let y = y(k, t).map_or(String::new(), |y| format!("{y:.9}"));
        format!("{t:.3},0,{y}\n")
    };
    (0..=last).map(row).collect()
}

/// 5 mm at so many Hz, beginning smoothly.
fn swing(hertz: f64) -> impl Fn(u32, f64) -> Option<f64> {
    move |_, t| Some(0.005 * (1.0 - (-(t / 0.1).powi(4)).exp()) * (TAU * hertz * t).sin())
}

/// The summary of a run of the scene with this wall, with its warnings.
fn run(scene: &str, wall: &str) -> String {
    let folder = Folder::new();
    folder.write("wall.toml", scene);
    folder.write("wall.csv", wall);
    let output = folder.run(&["simulate", "wall.toml"]);
    succeeds(&output);
    stdout(&output)
}

/// Requires that a simulation with this scene and this wall motion is rejected with all words.
fn is_refused(scene: &str, wall: &str, words: &[&str]) {
    let folder = Folder::new();
    folder.write("wall.toml", scene);
    folder.write("wall.csv", wall);
    refused(&folder.run(&["simulate", "wall.toml"]), words);
}

#[test]
fn accelerations_are_read_in_the_unit_of_their_header() {
    let tip = |unit: &str, factor: f64| {
        let acceleration = |k: u32, t: f64| Some(factor * swing(6.0)(k, t).unwrap() * 400.0);
        let shown = run(SCENE, &format!("t,ax{unit},ay{unit}\n{}", rows(500, acceleration)));
        shown.lines().find(|line| line.starts_with("  Tip ")).unwrap().to_string()
    };
    let expected = tip("", 1.0);
    for (unit, factor) in [
        ("[m/s^2]", 1.0),
        (" (m/s\u{b2})", 1.0),
        ("[mm/s^2]", 1e3),
        ("[mm/s2]", 1e3),
        ("[cm/s^2]", 1e2),
        ("[g]", 1.0 / 9.80665),
    ] {
        assert_eq!(tip(unit, factor), expected, "{unit}");
    }
    let still = rows(500, |_, _| Some(0.0));
    is_refused(
        SCENE,
        &format!("t,ax[banana],ay[g]\n{still}"),
        &["unit [banana] of `ax`", "mm/s^2, g"],
    );
    is_refused(SCENE, &format!("t,ax,a_y\n{still}"), &["column `a_y`", "ax, ay and az"]);
}

#[test]
fn accelerations_with_gravity_are_reported() {
    let shaken = |k: u32, t: f64| Some(9.81 + 100.0 * swing(6.0)(k, t).unwrap());
    let warned = run(SCENE, &format!("t,ax,ay\n{}", rows(500, shaken)));
    assert!(warned.contains("[gravity-in-acceleration]"), "{warned}");
    let in_g = |k: u32, t: f64| Some(shaken(k, t).unwrap() / 9.80665);
    let warned = run(SCENE, &format!("t,ax[g],ay[g]\n{}", rows(500, in_g)));
    assert!(warned.contains("[gravity-in-acceleration]"), "{warned}");
    let subtracted = |k: u32, t: f64| Some(100.0 * swing(6.0)(k, t).unwrap());
    let warned = run(SCENE, &format!("t,ax,ay\n{}", rows(500, subtracted)));
    assert!(!warned.contains("gravity-in-acceleration"), "{warned}");
}

#[test]
fn clocks_that_start_elsewhere_are_refused() {
    let late: String =
        (0..600).map(|k| format!("{:.3},0,0\n", 3.0 + 1e-3 * f64::from(k))).collect();
    for header in ["t,x,y", "t,ax,ay"] {
        let words = ["wall.csv:2", "3 s as the first time", "time_zero"];
        is_refused(SCENE, &format!("{header}\n{late}"), &words);
    }
    let without_file = SCENE.replace("file = \"wall.csv\"", "time_zero = 1.0");
    is_refused(&without_file, "t,x,y\n0,0,0\n1,0,0\n", &["supports.motion[0].time_zero"]);
}

/// A log in ms that begins two seconds before the motion gives the run of the motion alone.
#[test]
fn time_zero_leaves_out_earlier_rows() {
    let tip = |scene: &str, wall: &str| {
        let shown = run(scene, wall);
        shown.lines().find(|line| line.starts_with("  Tip ")).unwrap().to_string()
    };
    for (header, factor) in [("x,y", 1.0), ("ax,ay", 400.0)] {
        let place = |k: u32, t: f64| Some(factor * swing(6.0)(k, t).unwrap());
        let row = |k: u32| {
            let y = if k < 2000 {
                factor * 0.3
            } else {
                place(k - 2000, f64::from(k - 2000) * 1e-3).unwrap()
            };
            format!("{k},0,{y:.9}\n")
        };
        let log: String = (0..=2500).map(row).collect();
        let scene = SCENE.replace("file = \"wall.csv\"", "file = \"wall.csv\"\ntime_zero = 2000");
        let late = tip(&scene, &format!("t[ms],{header}\n{log}"));
        assert_eq!(late, tip(SCENE, &format!("t,{header}\n{}", rows(500, place))), "{header}");
    }
}

#[test]
fn recordings_that_end_before_the_scene_are_refused() {
    for header in ["t,x,y", "t,ax,ay"] {
        let wall = format!("{header}\n{}", rows(400, |_, _| Some(0.0)));
        is_refused(SCENE, &wall, &["time.end", "0.5 s", "up to 0.4 s, where wall.csv ends"]);
    }
}

#[test]
fn motion_that_the_step_aliases_is_refused() {
    let wall = format!("t,x,y\n{}", rows(500, swing(45.0)));
    let scene = |step: &str| replaced(SCENE, "step = 1e-3", step);
    is_refused(&scene("step = 0.02"), &wall, &["supports.motion[0].file", "2 steps per period"]);
    let warned = run(&scene("step = 4e-3"), &wall);
    assert!(warned.contains("[step-too-large]"), "{warned}");
    let warned = run(&scene("step = 1e-3"), &wall);
    assert!(!warned.contains("[step-too-large]"), "{warned}");
    // Accelerations from a standstill, whose integral drifts by half a meter.
    let shaken = |_: u32, t: f64| Some(400.0 * (TAU * 45.0 * t).sin());
    let wall = format!("t,ax,ay\n{}", rows(500, shaken));
    is_refused(&scene("step = 0.02"), &wall, &["supports.motion[0].file", "2 steps per period"]);
    // Noise of 1 % is not followed.
    let noisy =
        |k: u32, t: f64| Some(swing(3.0)(k, t).unwrap() + 5e-5 * f64::from(k * k * 7919).sin());
    let warned = run(&scene("step = 5e-3"), &format!("t,x,y\n{}", rows(500, noisy)));
    assert!(!warned.contains("[step-too-large]"), "{warned}");
}

#[test]
fn missing_frames_are_reported_where_interpolation_is_inaccurate() {
    let blank = |gap: std::ops::Range<u32>| {
        move |k: u32, t: f64| (!gap.contains(&k)).then(|| swing(4.0)(k, t)).flatten()
    };
    // Two fifths of a period.
    let warned = run(SCENE, &format!("t,x,y\n{}", rows(500, blank(200..300))));
    for words in ["100 frames are missing from t = 0.1990 s to 0.3000 s", "[missing-frames]"] {
        assert!(warned.contains(words), "{warned}");
    }
    // The same rows left out.
    let whole = rows(500, swing(4.0));
    let left_out = whole.lines().enumerate().filter(|(k, _)| !(200..300).contains(k));
    let left_out: String = left_out.map(|(_, line)| format!("{line}\n")).collect();
    let warned = run(SCENE, &format!("t,x,y\n{left_out}"));
    assert!(warned.contains("100 frames are missing"), "{warned}");
    // Beyond the last place it would be extrapolated.
    let warned = run(SCENE, &format!("t,x,y\n{}", rows(500, blank(450..501))));
    assert!(warned.contains("from t = 0.4490 s to 0.5000 s"), "{warned}");
    // A hundredth of a period is interpolated.
    let warned = run(SCENE, &format!("t,x,y\n{}", rows(500, blank(200..203))));
    assert!(!warned.contains("[missing-frames]"), "{warned}");
}

#[test]
fn jumps_are_reported() {
    let jumping = |at: u32, until: u32| {
        move |k: u32, t: f64| {
            let jump = if (at..until).contains(&k) { 0.02 } else { 0.0 };
            Some(swing(4.0)(k, t).unwrap() + jump)
        }
    };
    let warned = run(SCENE, &format!("t,x,y\n{}", rows(500, jumping(250, 501))));
    for words in [
        "wall.csv: the motion jumps once at t = 0.2500 s",
        "by up to 2.01e-2 m",
        "[recording-jumps]",
    ] {
        assert!(warned.contains(words), "{warned}");
    }
    let warned = run(SCENE, &format!("t,x,y\n{}", rows(500, jumping(250, 251))));
    assert!(warned.contains("jumps 2 times, first at t = 0.2500 s"), "{warned}");
    // A motion that begins with a velocity does not jump.
    let sudden =
        |_: u32, t: f64| Some(if t < 0.2 { 0.0 } else { 0.01 * (TAU * 5.0 * (t - 0.2)).sin() });
    let warned = run(SCENE, &format!("t,x,y\n{}", rows(500, sudden)));
    assert!(!warned.contains("[recording-jumps]"), "{warned}");
}

/// Place of a marker, by its name, the frame and the place without a defect.
type Change<'a> = &'a dyn Fn(&str, usize, [f64; 3]) -> Option<[f64; 3]>;

#[test]
fn recorded_ends_have_the_same_guards() {
    let clean = recorded(0, 120, 1e-5, |_| {});
    let warned = |change: Change| {
        let of = |m: &rodfit::scene::track::Marker| {
            let seen = m.seen.iter().enumerate();
            (m.name.clone(), seen.map(|(k, x)| change(&m.name, k, (*x)?)).collect())
        };
        let markers = clean.markers().iter().map(of).collect();
        let track = Track::new(clean.times().to_vec(), markers).unwrap();
        let folder = Folder::new();
        folder.write("clip.csv", &csv(&track));
        succeeds(&folder.run(&["init", "cable", "--from", "clip.csv"]));
        stdout(&folder.run(&["simulate", "cable.toml"]))
    };
    let unchanged = warned(&|_, _, place| Some(place));
    for code in ["missing-frames", "recording-jumps", "step-too-large"] {
        assert!(!unchanged.contains(code), "{unchanged}");
    }
    let gap = warned(&|name, k, place| (name != "0" || !(40..70).contains(&k)).then_some(place));
    assert!(gap.contains("30 frames are missing of marker 0"), "{gap}");
    // Not where a free marker was not seen.
    let free = warned(&|name, k, place| (name != "3" || !(40..70).contains(&k)).then_some(place));
    assert!(!free.contains("[missing-frames]"), "{free}");
    let slip = warned(&|name, k, [x, y, z]| {
        Some(if name == "1" && k >= 50 { [x, y + 0.006, z] } else { [x, y, z] })
    });
    assert!(slip.contains("of marker 1 jumps once at t = 0.5000 s"), "{slip}");
}
