//! C3D files with the motion of a tip: 0, 1 and 2 mm along x, 5 mm along y, in steps of 10 ms; a second point is
//! missing in one frame. Files are written here, in both formats of numbers, and damaged.

use marker_files::{Clock, Format, LengthUnit, Recording, load, open, parse, read};
use std::path::Path;

/// What differs between files.
#[derive(Clone)]
struct Written {
    /// Scale of integers; none for floats.
    scale: Option<f32>,
    /// Number of analog words per frame.
    analog: u16,
    first: u16,
    units: &'static str,
    labels: [&'static str; 2],
    processor: u8,
    /// Whether the group TRIAL has the first and the last frame.
    has_trial: bool,
}

/// A usual file: floats, three analog words, from frame 1, in mm.
const USUAL: Written = Written {
    scale: None,
    analog: 3,
    first: 1,
    units: "mm",
    labels: ["tip", "base"],
    processor: 84,
    has_trial: false,
};

/// A record of a parameter of a group: type, sizes of the dimensions and values.
fn parameter(group: i8, name: &str, kind: i8, sizes: &[u8], values: &[u8]) -> Vec<u8> {
    let mut own = vec![name.len() as u8, group.cast_unsigned()];
    own.extend(name.bytes());
    // From here to the next record: this word, type, dimensions, values, and a description of no characters.
    own.extend((2 + 2 + sizes.len() as u16 + values.len() as u16 + 1).to_le_bytes());
    own.extend([kind.cast_unsigned(), sizes.len() as u8]);
    own.extend(sizes);
    own.extend(values);
    own.push(0);
    own
}

/// A record of a group.
fn group(number: i8, name: &str) -> Vec<u8> {
    let mut own = vec![(-(name.len() as i8)).cast_unsigned(), (-number).cast_unsigned()];
    own.extend(name.bytes());
    own.extend([3, 0, 0]);
    own
}

/// Texts of one length, padded with spaces.
fn texts(all: &[&str]) -> Vec<u8> {
    all.iter().flat_map(|text| format!("{text:<6}").into_bytes()).collect()
}

/// The bytes of a file of three frames and two points. The points of the second frame: the tip, and none.
fn file(w: &Written) -> Vec<u8> {
    let scale = w.scale.unwrap_or(-0.1);
    let last = w.first + 2;
    let mut header = vec![2, 0x50];
    for word in [2, w.analog, w.first, last, 10] {
        header.extend(word.to_le_bytes());
    }
    header.extend(scale.to_le_bytes());
    header.extend([3, 0, 1, 0]);
    header.extend(100.0f32.to_le_bytes());
    header.resize(512, 0);
    let mut section = vec![1, 0x50, 1, w.processor];
    section.extend(group(1, "POINT"));
    section.extend(parameter(1, "USED", 2, &[], &2u16.to_le_bytes()));
    section.extend(parameter(1, "SCALE", 4, &[], &scale.to_le_bytes()));
    section.extend(parameter(1, "RATE", 4, &[], &100.0f32.to_le_bytes()));
    section.extend(parameter(1, "DATA_START", 2, &[], &3u16.to_le_bytes()));
    section.extend(parameter(1, "FRAMES", 2, &[], &3u16.to_le_bytes()));
    section.extend(parameter(1, "LABELS", -1, &[6, 2], &texts(&w.labels)));
    section.extend(parameter(1, "UNITS", -1, &[w.units.len() as u8], w.units.as_bytes()));
    if w.has_trial {
        let field = |frame: u16| [frame.to_le_bytes(), [0, 0]].concat();
        section.extend(group(2, "TRIAL"));
        section.extend(parameter(2, "ACTUAL_START_FIELD", 2, &[2], &field(w.first)));
        section.extend(parameter(2, "ACTUAL_END_FIELD", 2, &[2], &field(last)));
    }
    section.resize(512, 0);
    let mut data = Vec::new();
    let mut word = |value: f32| match w.scale {
        None => data.extend(value.to_le_bytes()),
        Some(_) => data.extend((value as i16).to_le_bytes()),
    };
    let unit = w.scale.unwrap_or(1.0);
    for k in 0..3 {
        for (point, residual) in
            [([k as f32, 5.0, 0.0], 0.0), ([7.0; 3], if k == 1 { -1.0 } else { 2.0 })]
        {
            point.iter().for_each(|x| word(x / unit));
            word(residual);
        }
        (0..w.analog).for_each(|_| word(-9.0));
    }
    [header, section, data].concat()
}

/// Writes bytes into a folder and returns the path.
fn written(folder: &tempfile::TempDir, bytes: &[u8]) -> std::path::PathBuf {
    let path = folder.path().join("take.c3d");
    std::fs::write(&path, bytes).unwrap();
    path
}

#[test]
fn points_are_read_in_both_formats_of_numbers() {
    let folder = tempfile::tempdir().unwrap();
    for w in [
        USUAL,
        Written { scale: Some(0.25), ..USUAL },
        Written { analog: 0, has_trial: true, ..USUAL },
        Written { scale: Some(0.5), analog: 0, ..USUAL },
    ] {
        let path = written(&folder, &file(&w));
        let (format, bytes) = open(&path, None).unwrap();
        assert_eq!(format, Format::C3d);
        let own = parse(&path, format, &bytes).unwrap();
        assert_eq!(own.clock, Clock::Frames { first: 1.0, rate: Some(100.0) });
        assert_eq!(own.lengths, LengthUnit::Known("mm", 1e-3));
        assert_eq!(own.markers[1].positions, [[Some(7.0); 3], [None; 3], [Some(7.0); 3]]);
        let tip =
            read(&path, &Recording { marker: Some("tip".into()), ..Recording::default() }).unwrap();
        for (k, (time, position)) in tip.times.iter().zip(&tip.positions).enumerate() {
            let k = k as f64;
            let error =
                [time - 0.01 * k, position[0].unwrap() - 1e-3 * k, position[1].unwrap() - 5e-3];
            assert!(error.into_iter().all(|e| e.abs() < 1e-15), "{tip:?}");
        }
        assert_eq!(tip.times.len(), 3);
    }
}

#[test]
fn parts_of_recordings_keep_their_time() {
    let folder = tempfile::tempdir().unwrap();
    let path =
        written(&folder, &file(&Written { first: 101, units: "", labels: ["", "b"], ..USUAL }));
    let own = load(&path, &Recording::default()).unwrap();
    assert_eq!(own.frames[0].clock, 101.0);
    assert_eq!((&own.markers[0].name[..], own.lengths), ("point 1", LengthUnit::Calibrated));
    let recording =
        Recording { marker: Some("b".into()), scale: Some(1e-3), ..Recording::default() };
    let b = read(&path, &recording).unwrap();
    // Frame 101 of 100 Hz is 1 s after frame 1; the point is missing in the next one.
    assert_eq!(b.times, [1.0, 1.02]);
    assert_eq!(b.positions[0], [Some(7e-3); 3]);
}

#[test]
fn damaged_files_are_rejected_with_the_reason() {
    let whole = file(&USUAL);
    let changed = |at: usize, bytes: &[u8]| {
        let mut own = whole.clone();
        own[at..at + bytes.len()].copy_from_slice(bytes);
        own
    };
    for (bytes, words) in [
        (
            file(&Written { processor: 85, ..USUAL }),
            "found numbers of DEC (VAX), allowed: numbers of Intel",
        ),
        (file(&Written { processor: 86, ..USUAL }), "found numbers of SGI (MIPS)"),
        (file(&Written { processor: 7, ..USUAL }), "found processor 7"),
        (file(&Written { units: "ft", ..USUAL }), "POINT:UNITS `ft`"),
        (whole[..whole.len() - 1].to_vec(), "found 2 frames of 3"),
        (whole[..600].to_vec(), "parameters that do not end"),
        (whole[..300].to_vec(), "found 300 bytes"),
        (changed(2, &[5, 0]), "found POINT:USED = 2 and 5 in the header"),
        (changed(16, &[9, 0]), "found POINT:DATA_START = 3 and 9 in the header"),
        (changed(6, &[9, 0]), "found the frames 9 to 3"),
        (changed(1024, &f32::INFINITY.to_le_bytes()), "an infinite coordinate of `tip` in frame 1"),
        (b"t,x\n0,1\n".to_vec(), "found other first bytes"),
    ] {
        let error = parse(Path::new("take.c3d"), Format::C3d, &bytes).unwrap_err().to_string();
        assert!(error.starts_with("take.c3d:1: ") && error.contains(words), "{words}: {error}");
    }
}
