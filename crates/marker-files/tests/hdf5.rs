//! HDF5 files of DeepLabCut and SLEAP are read as the CSV files with the same contents. Damaged and hostile files are
//! errors.
//!
//! The files in `hdf5-deeplabcut` and `hdf5-sleap` were written by pandas 3.1, PyTables 3.11 and h5py 3.16:
//!
//! ```python
//! def frame(animals):  # [] for the files `one`, ["a", "b"] for the files `animals`
//!     levels = [["net"]] + ([animals] if animals else []) + [["mid", "tip"], ["x", "y", "likelihood"]]
//!     names = ["scorer"] + (["individuals"] if animals else []) + ["bodyparts", "coords"]
//!     columns = pandas.MultiIndex.from_product(levels, names=names)
//!     values = numpy.arange(4.0 * len(columns)).reshape(4, -1) / 3
//!     values[:, 2::3] = 0.9
//!     values[2, 3:5] = numpy.nan
//!     return pandas.DataFrame(values, columns=columns)
//!
//! key = "df_with_missing"
//! frame(["a", "b"]).to_hdf("animals_table_zlib.h5", key=key, format="table", complib="zlib", complevel=9)
//! tables.leaf.calc_chunksize = lambda *sizes: 1024  # a small file
//! with pandas.HDFStore("one_table.h5", mode="w") as store:
//!     store.append(key, frame([]), index=False)
//! frame([]).to_hdf("one_fixed.h5", key=key)
//! frame(["a", "b"]).to_hdf("animals_fixed.h5", key=key)
//!
//! for name, count, options in [("one", 1, {}), ("tracks_gzip", 2, {"compression": "gzip", "shuffle": True})]:
//!     tracks = numpy.arange(count * 16.0).reshape(count, 2, 2, 4) / 3
//!     tracks[0, :, 1, 2] = numpy.nan
//!     tracks[:, :, :, 3] = numpy.nan
//!     with h5py.File(f"{name}.h5", "w") as file:
//!         file.create_dataset("tracks", data=tracks, **options)
//!         file.create_dataset("point_scores", data=numpy.full((count, 2, 4), 0.9), **options)
//!         file["node_names"] = [b"mid", b"tip"]
//!         file["track_names"] = [b"a", b"b"][:count]
//! ```

use marker_files::{Error, Format, MarkerFile, Recording, load, parse, read};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Path of a file that was written by Python.
fn path(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests").join(name)
}

/// The bytes of a file that was written by Python.
fn bytes(name: &str) -> Vec<u8> {
    std::fs::read(path(name)).unwrap()
}

/// Reads bytes as a file of the format that is recognized.
fn file(bytes: &[u8]) -> Result<MarkerFile, Error> {
    parse(Path::new("video.h5"), Format::detect(bytes), bytes)
}

/// The text of the error of bytes.
fn error(bytes: &[u8]) -> String {
    file(bytes).unwrap_err().to_string()
}

/// A number as a cell, blank for `None`.
fn cell(value: Option<f64>) -> String {
    value.map_or(String::new(), |value| format!("{value:?}"))
}

/// The CSV file of DeepLabCut with the contents of the files in HDF5.
fn deeplabcut_csv(animals: &[&str]) -> String {
    let columns: Vec<[&str; 3]> = (if animals.is_empty() { &[""] } else { animals })
        .iter()
        .flat_map(|animal| ["mid", "tip"].map(|part| (animal, part)))
        .flat_map(|(animal, part)| ["x", "y", "likelihood"].map(|name| [*animal, part, name]))
        .collect();
    let row = |name: &str, k: usize| {
        columns.iter().fold(name.to_string(), |row, column| format!("{row},{}", column[k])) + "\n"
    };
    let mut text = format!("scorer{}\n", ",net".repeat(columns.len()));
    if !animals.is_empty() {
        text += &row("individuals", 0);
    }
    text += &(row("bodyparts", 1) + &row("coords", 2));
    for frame in 0..4 {
        text += &frame.to_string();
        for column in 0..columns.len() {
            let value = (frame * columns.len() + column) as f64 / 3.0;
            text.push(',');
            text += &match (frame, column) {
                (_, k) if k % 3 == 2 => cell(Some(0.9)),
                (2, 3 | 4) => cell(None),
                _ => cell(Some(value)),
            };
        }
        text.push('\n');
    }
    text
}

/// The CSV file of SLEAP with the contents of the files in HDF5.
fn sleap_csv(tracks: &[&str]) -> String {
    let mut text =
        "track,frame_idx,instance.score,mid.x,mid.y,mid.score,tip.x,tip.y,tip.score\n".to_string();
    for (track, name) in tracks.iter().enumerate() {
        for frame in 0..3 {
            text += &format!("{name},{frame},");
            for node in 0..2 {
                let value =
                    |axis: usize| Some((((2 * track + axis) * 2 + node) * 4 + frame) as f64 / 3.0);
                let found = (track, node, frame) != (0, 1, 2);
                for value in [value(0), value(1), Some(0.9)] {
                    text += &format!(",{}", cell(value.filter(|_| found)));
                }
            }
            text.push('\n');
        }
    }
    text
}

#[test]
fn files_are_those_of_the_tables() {
    let one = deeplabcut_csv(&[]);
    let animals = deeplabcut_csv(&["a", "b"]);
    for (name, format, table, markers) in [
        ("hdf5-deeplabcut/one_table.h5", Format::DeepLabCut, &one, "mid tip"),
        ("hdf5-deeplabcut/one_fixed.h5", Format::DeepLabCut, &one, "mid tip"),
        (
            "hdf5-deeplabcut/animals_table_zlib.h5",
            Format::DeepLabCut,
            &animals,
            "a:mid a:tip b:mid b:tip",
        ),
        (
            "hdf5-deeplabcut/animals_fixed.h5",
            Format::DeepLabCut,
            &animals,
            "a:mid a:tip b:mid b:tip",
        ),
        ("hdf5-sleap/one.h5", Format::Sleap, &sleap_csv(&[""]), "mid tip"),
        (
            "hdf5-sleap/tracks_gzip.h5",
            Format::Sleap,
            &sleap_csv(&["a", "b"]),
            "a:mid a:tip b:mid b:tip",
        ),
    ] {
        assert_eq!(Format::detect(&bytes(name)), format, "{name}");
        let read = load(&path(name), &Recording::default()).unwrap();
        let expected = parse(Path::new("video.csv"), format, table.as_bytes()).unwrap();
        assert_eq!(Format::detect(table.as_bytes()), format);
        assert_eq!(read.format, format);
        assert_eq!((read.clock, read.lengths), (expected.clock, expected.lengths), "{name}");
        assert_eq!(read.frames, expected.frames, "{name}");
        assert_eq!(read.markers, expected.markers, "{name}");
        let names: Vec<&str> = read.markers.iter().map(|marker| &marker.name[..]).collect();
        assert_eq!(names.join(" "), markers, "{name}");
        assert!(read.markers.iter().all(|marker| marker.likelihood.is_some()), "{name}");
    }
}

#[test]
fn trajectories_are_those_of_the_table() {
    let folder = tempfile::tempdir().unwrap();
    let table = folder.path().join("video.csv");
    std::fs::write(&table, deeplabcut_csv(&["a", "b"])).unwrap();
    let recording = Recording {
        marker: Some("b:tip".into()),
        fps: Some(240.0),
        scale: Some(1e-3),
        likelihood: Some(0.5),
        ..Recording::default()
    };
    let [own, expected] = [path("hdf5-deeplabcut/animals_table_zlib.h5"), table]
        .map(|path| read(&path, &recording).unwrap());
    assert_eq!((own.times, own.positions), (expected.times, expected.positions));
}

/// The bytes with all places of a text replaced by another one of the same length.
fn replaced(bytes: &[u8], from: &[u8], to: &[u8]) -> Vec<u8> {
    assert_eq!(from.len(), to.len());
    let mut bytes = bytes.to_vec();
    let places: Vec<usize> = (0..bytes.len()).filter(|at| bytes[*at..].starts_with(from)).collect();
    assert!(!places.is_empty(), "{}", String::from_utf8_lossy(from));
    places.iter().for_each(|at| bytes[*at..at + to.len()].copy_from_slice(to));
    bytes
}

#[test]
fn other_contents_are_errors_with_the_data_set() {
    let [sleap, table, fixed] =
        ["hdf5-sleap/one.h5", "hdf5-deeplabcut/one_table.h5", "hdf5-deeplabcut/one_fixed.h5"]
            .map(bytes);
    let words = |numbers: [u64; 4]| numbers.map(u64::to_le_bytes).concat();
    for (bytes, found) in [
        (
            replaced(&sleap, b"node_names", b"body_parts"),
            "an HDF5 file with the data sets `body_parts`, `point_scores`, `track_names`, `tracks`;",
        ),
        (
            replaced(&table, b"pandas_type", b"pandas_kind"),
            "an HDF5 file with the data sets `df_with_missing/table`;",
        ),
        (
            replaced(&sleap, &words([1, 2, 2, 4]), &words([1, 2, 3, 4])),
            "found 3 nodes in the data set `tracks` of the shape [1, 2, 3, 4], allowed: tracks, 2 coordinates, 2 nodes, frames",
        ),
        (
            replaced(&sleap, &words([1, 2, 2, 4]), &words([1, 2, 2, 1 << 40])),
            "found the data set `tracks` with the shape [1, 2, 2, 1099511627776] and 8 bytes per element, allowed: up to",
        ),
        (replaced(&sleap, b"tip", b"mid"), "two columns `mid.x`"),
        (
            replaced(&table, b"frame_table", b"frame_tabel"),
            "found pandas_type = `frame_tabel`, allowed: frame_table or frame",
        ),
        (
            replaced(&table, b"(lp0\n(Vnet", b"(lp0\nccnet"),
            "found another object than texts in a pickle in the attribute `values_block_0_kind` in the data set \
             `df_with_missing/table` of the shape [4], allowed: names of columns",
        ),
        (replaced(&table, b"Vlikelihood", b"Vconfidence"), "coords `confidence`"),
        (replaced(&fixed, b"likelihood", b"confidence"), "coords `confidence`"),
        (replaced(&fixed, b"axis1\0\0\0", b"axis9\0\0\0"), "data set `df_with_missing/axis1`"),
    ] {
        let error = error(&bytes);
        assert!(error.starts_with("video.h5:") && error.contains(found), "{error}\n{found}");
    }
}

#[test]
fn file_of_the_format_of_a_table_is_described() {
    let error = parse(Path::new("video.h5"), Format::Csv, &bytes("hdf5-sleap/one.h5"))
        .unwrap_err()
        .to_string();
    assert!(error.contains("with the data sets `node_names`, `point_scores`"), "{error}");
    let error = parse(Path::new("video.h5"), Format::Sleap, &bytes("hdf5-deeplabcut/one_table.h5"))
        .unwrap_err();
    assert!(error.to_string().contains("data set `tracks`"), "{error}");
}

#[test]
fn every_truncated_file_is_an_error() {
    for name in ["hdf5-deeplabcut/one_table.h5", "hdf5-sleap/one.h5", "hdf5-sleap/tracks_gzip.h5"] {
        let bytes = bytes(name);
        for length in (8..bytes.len() / 2).step_by(97) {
            assert!(file(&bytes[..length]).is_err(), "{name} {length}");
        }
    }
}

/// Replaces a number of 8 bytes wherever it is.
fn repoint(bytes: &mut Vec<u8>, from: usize, to: usize) {
    *bytes = replaced(bytes, &(from as u64).to_le_bytes(), &(to as u64).to_le_bytes());
}

/// The first place of a text.
fn place(bytes: &[u8], text: &[u8]) -> usize {
    (0..bytes.len()).find(|at| bytes[*at..].starts_with(text)).unwrap()
}

/// Numbers of 8 bytes as bytes.
fn numbers(numbers: &[usize]) -> Vec<u8> {
    numbers.iter().flat_map(|number| (*number as u64).to_le_bytes()).collect()
}

/// A file whose group has levels of nodes that each refer twice to the next one: 2^60 ways to the members.
fn nodes_in_levels() -> Vec<u8> {
    let mut bytes = bytes("hdf5-sleap/one.h5");
    let (leaf, end) = (place(&bytes, b"TREE\0"), bytes.len());
    // No structure is at the former end, whose number is replaced.
    bytes.extend([0; 8]);
    let mut child = leaf;
    for level in 1..=60 {
        let at = bytes.len();
        bytes.extend(b"TREE");
        bytes.extend([0, level, 2, 0]);
        bytes.extend([0xff; 16]);
        bytes.extend(numbers(&[0, child, 8, child, 16, 0]));
        child = at;
    }
    let heap = place(&bytes, b"HEAP");
    bytes = replaced(&bytes, &numbers(&[leaf, heap]), &numbers(&[child, heap]));
    let size = bytes.len();
    repoint(&mut bytes, end, size);
    bytes
}

/// A file whose group has 20 000 members with one name of a million letters.
fn long_names() -> Vec<u8> {
    let mut bytes = bytes("hdf5-sleap/one.h5");
    let end = bytes.len();
    let [leaf, heap, links] = [&b"TREE\0"[..], b"HEAP", b"SNOD"].map(|text| place(&bytes, text));
    let link = bytes[links + 16..links + 48].to_vec();
    bytes.extend([0; 8]);
    let names = bytes.len();
    bytes.extend([b'a'; 1_000_000]);
    bytes.extend([0; 8]);
    let node = bytes.len();
    bytes.extend(b"SNOD\x01\0");
    bytes.extend(20_000u16.to_le_bytes());
    for _ in 0..20_000 {
        bytes.extend([0; 8]);
        bytes.extend(&link);
    }
    for (at, number) in [(heap + 8, 1_000_008), (heap + 24, names), (leaf + 32, node)] {
        bytes[at..at + 8].copy_from_slice(&numbers(&[number]));
    }
    let size = bytes.len();
    repoint(&mut bytes, end, size);
    bytes
}

/// A file whose tracks have the type of a list of lists of lists, 8000 times.
fn nested_types() -> Vec<u8> {
    let mut bytes = bytes("hdf5-sleap/one.h5");
    let (end, links) = (bytes.len(), place(&bytes, b"SNOD"));
    let tracks = usize::from(bytes[links + 136]) + 256 * usize::from(bytes[links + 137]);
    let mut kind = [0x19, 0, 0, 0, 16, 0, 0, 0].repeat(8000);
    kind.extend([0x10, 8, 0, 0, 8, 0, 0, 0, 0, 0, 64, 0, 0, 0, 0, 0]);
    let space = [&[1, 1, 0, 0, 0, 0, 0, 0][..], &numbers(&[2])].concat();
    let layout = [&[3, 1][..], &numbers(&[2048, 32]), &[0; 6]].concat();
    let messages: Vec<u8> = [(1u16, space), (3, kind), (8, layout)]
        .into_iter()
        .flat_map(|(number, body)| {
            let size = (body.len() as u16).to_le_bytes();
            [&number.to_le_bytes()[..], &size, &[0; 4], &body].concat()
        })
        .collect();
    bytes.resize(end.next_multiple_of(8) + 8, 0);
    let at = bytes.len();
    bytes.extend([1, 0, 3, 0, 1, 0, 0, 0]);
    bytes.extend((messages.len() as u32).to_le_bytes());
    bytes.extend([0; 4]);
    bytes.extend(messages);
    bytes[links + 136..links + 144].copy_from_slice(&numbers(&[at]));
    assert!(tracks < end);
    let size = bytes.len();
    repoint(&mut bytes, end, size);
    bytes
}

/// Each of these files made version 0.47 of `hdf5-pure` hang, or end the program for want of memory or of stack.
#[test]
fn hostile_structures_are_errors() {
    for (bytes, found) in [
        (nodes_in_levels(), "refer to each other"),
        (long_names(), "names are longer than"),
        (nested_types(), "the data set `tracks`"),
    ] {
        let since = Instant::now();
        let error = error(&bytes);
        assert!(error.contains(found), "{error}");
        assert!(since.elapsed() < Duration::from_secs(5), "{found}: {:?}", since.elapsed());
    }
}
