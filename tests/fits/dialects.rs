//! Variants of tables and of programs' files are read as the same motion; unsupported files are described in the error.

use rodfit::Observation;
use rodfit::fit::{ColumnKey, ColumnRule, ColumnRules, ColumnWithUnit};
use rodfit::fit::{Format, Inspection, Recording, Sample, Vertical};
use rodfit::scene::Track;

const FRAMES: usize = 12;

/// Time, s, and place, m, of a tip.
fn tip(k: usize) -> [f64; 3] {
    [0.01 * k as f64, 0.5 - 0.001 * k as f64, -0.002 * (k * k) as f64]
}

/// Lines of all frames.
fn lines(line: impl Fn(usize, [f64; 3]) -> String) -> String {
    (0..FRAMES).map(|k| line(k, tip(k)) + "\n").collect()
}

/// The motion in a file with this text.
fn read(text: &str, recording: &Recording) -> Result<Vec<Sample>, String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("tip.csv");
    std::fs::write(&path, text).unwrap();
    Observation::read_as(&path, recording)
        .map(|o| o.data.samples)
        .map_err(|error| error.to_string())
}

/// Requires that the text, read with these options, gives the motion of [`tip`].
fn is_the_tip(text: &str, recording: &Recording) {
    let samples = read(text, recording).unwrap_or_else(|error| panic!("{error}\n{text}"));
    assert_eq!(samples.len(), FRAMES, "{text}");
    for (k, sample) in samples.iter().enumerate() {
        let [t, x, y] = tip(k);
        let [found_x, found_y] = [0, 1].map(|c| sample.position[c].unwrap());
        let off = [sample.time - t, found_x - x, found_y - y].map(f64::abs);
        // All texts describe the motion of `tip`; files have at least nine decimals.
        assert!(off.into_iter().fold(0.0, f64::max) < 1e-9, "{k}: {sample:?} in {text}");
    }
}

/// Inspects a file with this text and reads it with the proposed keys. Returns the inspection and the samples.
fn inspected(text: &str, said: &Recording) -> (Inspection, Vec<Sample>) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("tip.csv");
    std::fs::write(&path, text).unwrap();
    let inspection = Inspection::of(&path, said).unwrap();
    let samples = Observation::read_as(&path, &inspection.recording).unwrap().data.samples;
    (inspection, samples)
}

fn plain() -> Recording {
    Recording::default()
}

#[test]
fn only_marker_of_a_file_is_read_without_name() {
    for header in ["t,x_tip,y_tip", "t,xA,yA", "t,tip_x,tip_y", "Time (s),Tip x (m),Tip y (m)"] {
        let text = format!("{header}\n{}", lines(|_, [t, x, y]| format!("{t:.2},{x:.6},{y:.6}")));
        is_the_tip(&text, &plain());
        let (inspection, samples) = inspected(&text, &plain());
        assert_eq!(samples.len(), FRAMES);
        assert!(
            !inspection.observation.contains("rejects these keys"),
            "{}",
            inspection.observation
        );
    }
    let error = read("t,xA,yA,xB,yB\n0,1,2,3,4\n", &plain()).unwrap_err();
    assert!(error.contains("2 markers and no key marker"), "{error}");
}

#[test]
fn column_suffixes_are_marker_names_with_their_case() {
    let recording = |marker: &str| Recording { marker: Some(marker.into()), ..plain() };
    let text = format!(
        "t,Base_x,Base_y,Tip_x,Tip_y\n{}",
        lines(|_, [t, x, y]| format!("{t:.2},0,0,{x:.6},{y:.6}"))
    );
    is_the_tip(&text, &recording("Tip"));
    let (inspection, _) = inspected(&text, &plain());
    assert_eq!(inspection.recording.marker.as_deref(), Some("Tip"));
}

#[test]
fn frame_numbers_beside_a_clock_are_ignored() {
    let row = |k: usize, [t, x, y]: [f64; 3]| format!("{k},{t:.2},{x:.6},{y:.6}");
    is_the_tip(&format!("frame,time,x,y\n{}", lines(row)), &plain());
    is_the_tip(&format!("Frame,Time (s),Point 1 X,Point 1 Y\n{}", lines(row)), &plain());
    // An index as pandas writes it.
    is_the_tip(&format!(",t,x,y\n{}", lines(row)), &plain());
    let at = |fps| Recording { fps: Some(fps), ..plain() };
    is_the_tip(&format!("frame,time,x,y\n{}", lines(row)), &at(100.0));
}

#[test]
fn decimal_commas_with_tabs_or_semicolons_are_read() {
    for separator in ["\t", ";"] {
        let row = |_: usize, row: [f64; 3]| {
            row.map(|x| format!("{x:.9E}").replace('.', ",")).join(separator)
        };
        let header = ["t", "x", "y"].join(separator);
        is_the_tip(&format!("{header}\n{}", lines(row)), &plain());
        is_the_tip(&format!("mass_A\n{header}\n{}", lines(row)), &plain());
    }
}

#[test]
fn padded_headers_are_read() {
    let padded = |_: usize, [t, x, y]: [f64; 3]| format!("{t:.2},{x:.6},{y:.6},,");
    is_the_tip(&format!("t,x,y,,\n{}", lines(padded)), &plain());
    is_the_tip(&format!("mass_A,,,,\nt,x,y,,\n{}", lines(padded)), &plain());
    is_the_tip(&format!("Time (s),tip/0/X (m),tip/0/Y (m),,\n{}", lines(padded)), &plain());
    let pixels = Recording { fps: Some(100.0), scale: Some(1e-3), ..plain() };
    let row = |k: usize, [_, x, y]: [f64; 3]| format!("{k},{:.6},{:.6},,", 1e3 * x, -1e3 * y);
    is_the_tip(
        &format!("scorer,A,A,,\nbodyparts,tip,tip,,\ncoords,x,y,,\n{}", lines(row)),
        &pixels,
    );
}

#[test]
fn image_names_are_numbered_by_their_increasing_number() {
    let pixels = Recording { fps: Some(100.0), scale: Some(1e-3), ..plain() };
    let row = |k: usize, [_, x, y]: [f64; 3]| {
        format!("labeled-data/rod/2026-04-03_{k:04}_cam1.png,{:.6},{:.6}", 1e3 * x, -1e3 * y)
    };
    is_the_tip(&format!("scorer,A,A\nbodyparts,tip,tip\ncoords,x,y\n{}", lines(row)), &pixels);
}

#[test]
fn kinovea_pixels_have_y_up() {
    let row = |_: usize, [t, x, y]: [f64; 3]| format!("{t:.2},{:.6},{:.6}", 1e3 * x, 1e3 * y);
    let text = format!("\"Time (s)\",\"tip/0/X (px)\",\"tip/0/Y (px)\"\n{}", lines(row));
    let scaled = Recording { scale: Some(1e-3), ..plain() };
    is_the_tip(&text, &scaled);
    let (inspection, samples) = inspected(&text, &scaled);
    assert!(!inspection.observation.contains("down"), "{}", inspection.observation);
    // The motion of the test falls by 0.05 m until sample 5.
    assert!((samples[5].position[1].unwrap() + 0.05).abs() < 1e-9);
}

#[test]
fn stated_direction_of_y_is_in_the_proposed_observation() {
    let row = |_: usize, [t, x, y]: [f64; 3]| format!("{t:.2},{:.6},{:.6}", 1e3 * x, 1e3 * y);
    let text = format!("t,x[px],y[px]\n{}", lines(row));
    let up = Recording { y: Some(Vertical::Up), scale: Some(1e-3), ..plain() };
    let (Inspection { observation, .. }, samples) = inspected(&text, &up);
    assert!(observation.contains("y = \"up\""), "{observation}");
    assert!(!observation.contains("down") && !observation.contains("rejects"), "{observation}");
    // The motion of the test falls by 0.05 m until sample 5.
    assert!((samples[5].position[1].unwrap() + 0.05).abs() < 1e-9);
}

#[test]
fn repeated_frames_of_converted_video_are_detected() {
    let swing = |t: f64| 40.0 * (12.0 * t).cos();
    let text = |rate: f64, own: f64, places: &dyn Fn(f64) -> f64| {
        let row = |k: u32| {
            let seen = (f64::from(k) * own / rate).floor() / own;
            format!("{},{:.3}\n", f64::from(k) / rate, places(seen))
        };
        format!("t,y[mm]\n{}", (0..120).map(row).collect::<String>())
    };
    let repeated = |text: &str| inspected(text, &plain()).0;
    let doubled = repeated(&text(60.0, 30.0, &swing));
    // 60 of 120 frames repeat the one before; some at the turning points may be counted differently.
    assert!((55..=60).contains(&doubled.markers[0].repeated), "{}", doubled.markers[0].repeated);
    assert!(doubled.to_string().contains("frames repeat the one before"), "{doubled}");
    let pulled = repeated(&text(30.0, 24.0, &swing));
    // 6 of 30 frames a second are repeated: 24 of 120.
    assert!((20..=24).contains(&pulled.markers[0].repeated), "{}", pulled.markers[0].repeated);
    // Whole pixels, and a rest, repeat places.
    let coarse = |t: f64| (swing(t) / 2.0).round() * 2.0;
    let rest = |t: f64| if t < 1.0 { 40.0 } else { swing(t - 1.0) };
    for places in [&coarse as &dyn Fn(f64) -> f64, &rest, &swing] {
        let shown = repeated(&text(120.0, 120.0, places)).to_string();
        assert!(!shown.contains("repeat"), "{shown}");
    }
}

#[test]
fn trc_files_are_read_in_their_dialects() {
    let rows = |separator: &str, first: usize| {
        lines(|k, [t, x, y]| {
            let fields = [
                (k + first).to_string(),
                format!("{t:.5}"),
                format!("{:.5}", 1e3 * x),
                format!("{:e}", 1e3 * y),
                if k == 3 { "nan".into() } else { "0.0".to_string() },
                String::new(),
                String::new(),
                if k % 2 == 0 { "NaN".into() } else { String::new() },
            ];
            fields.join(separator)
        })
    };
    // Names and labels as four programs write them; the motion is that of the other dialects.
    for (separator, names, labels, blank) in [
        ("\t", "tip\t\t\tbase", "\t\tX1\tY1\tZ1\tX2\tY2\tZ2", "\n"),
        (",", "tip,,,base,,", ",,X5,Y5,Z5,X1,Y1,Z1", ""),
        ("\t", "tip\tbase", "\t\tX1\tY1\tZ1\tX2\tY2\tZ2", ""),
    ] {
        for first in [0, 1] {
            let head = [
                "PathFileType,4,(X/Y/Z),tip.trc".to_string(),
                "DataRate,CameraRate,NumFrames,NumMarkers,Units".into(),
                format!("100,100,{FRAMES},2,mm"),
                format!("Frame#{separator}Time{separator}{names}"),
                labels.into(),
            ];
            let head = head.join("\n").replace(',', separator);
            let text = format!("{head}\n{blank}{}", rows(separator, first));
            assert_eq!(Inspection::of(&written(&text).1, &plain()).unwrap().format, Format::Trc);
            let recording = Recording { marker: Some("tip".into()), ..plain() };
            let samples = read(&text, &recording).unwrap();
            for (k, sample) in samples.iter().enumerate() {
                let [t, x, y] = tip(k);
                let [own_x, own_y] = [0, 1].map(|c| sample.position[c].unwrap());
                // The motion of `tip` in s and m, rounded in the file.
                assert!((sample.time - t).abs() < 1e-9 && (own_x - x).abs() < 1e-8);
                assert!((own_y - y).abs() < 1e-8);
                assert_eq!(sample.position[2].is_none(), k == 3);
            }
        }
    }
}

#[test]
fn columns_of_a_file_without_header_are_inspected_as_they_are_read() {
    let rule = |(name, column, unit): (&str, usize, &str)| {
        let (column, unit) = (ColumnKey::Number(column), unit.to_string());
        (name.to_string(), ColumnRule::WithUnit(ColumnWithUnit { column, unit }))
    };
    let rules = [("t", 1, "ms"), ("x", 3, "mm"), ("y", 2, "mm")].map(rule);
    let columns = Some(ColumnRules(rules.into_iter().collect()));
    let recording = Recording { columns, ..plain() };
    let row =
        |_: usize, [t, x, y]: [f64; 3]| format!("{:.3} {:.6}  {:.6}", 1e3 * t, 1e3 * y, 1e3 * x);
    is_the_tip(&lines(row), &recording);
    let (inspection, samples) = inspected(&lines(row), &recording);
    assert_eq!(samples.len(), FRAMES);
    let observation = &inspection.observation;
    assert!(observation.contains("x = { column = 3, unit = \"mm\" }"), "{observation}");
    assert!(!observation.contains("rejects these keys"), "{observation}");
}

/// A file with this text, in a folder that lasts as long.
fn written(text: &str) -> (tempfile::TempDir, std::path::PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("tip.csv");
    std::fs::write(&path, text).unwrap();
    (folder, path)
}

#[test]
fn unsupported_file_error_lists_the_formats() {
    for (text, words) in [
        ("PK\u{3}\u{4}..", "a zip archive"),
        ("0,0.5,0\n0.01,0.5,0\n", "no header"),
        ("t x y\n0.0 0.5\n", "spaces between"),
        ("\"Time (s)\";\"Linear Acceleration x (m/s^2)\"\n0,0E0;1,2E-1\n", "accelerations"),
    ] {
        let (_folder, path) = written(text);
        let errors = [
            Observation::read_as(&path, &plain()).unwrap_err(),
            Inspection::of(&path, &plain()).unwrap_err(),
            Track::read(&path).unwrap_err(),
        ];
        for error in errors.map(|error| error.to_string()) {
            for words in [words, "a header such as `t,x,y`", "OptiTrack Motive", "TRC"] {
                assert!(error.contains(words), "{words} in {error}");
            }
        }
    }
    // What is wrong in one row of a table is that.
    let error = read("t,x,y\n0,1,2\n1,one,2\n", &plain()).unwrap_err();
    assert!(error.contains(":3: column `x`: found `one`"), "{error}");
}
