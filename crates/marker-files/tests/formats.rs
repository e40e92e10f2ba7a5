//! Exports of several programs with the same motion: 0, 1 and 2 mm along x, 5 mm along y, in steps of 10 ms. All are
//! read to the same times and positions; standard deviations, errors and escaped control characters are tested too.

use marker_files::{
    Error, Format, Recording, Vertical, open, parse, read, read_bodies, read_several,
};
use std::path::PathBuf;

/// Name of the file, format that is to be recognized, and content.
const EXPORTS: [(&str, Format, &str); 10] = [
    ("table.csv", Format::Csv, "t[ms],xtip[mm],ytip[mm]\n0,0,5\n10,1,5\n20,2,5\n"),
    ("comma.csv", Format::Csv, "t;tip_x[cm];tip_y[cm]\n0;0;0,5\n0,01;0,1;0,5\n0,02;0,2;0,5\n"),
    (
        "take.trc",
        Format::Trc,
        "PathFileType\t4\t(X/Y/Z)\ttake.trc\nDataRate\tUnits\n100\tmm\nFrame#\tTime\ttip\t\t\n\t\tX1\tY1\tZ1\n\
         1\t0.00\t0\t5\t0\n2\t0.01\t1\t5\t0\n3\t0.02\t2\t5\t0\n",
    ),
    (
        "track.txt",
        Format::Tracker,
        "\ntip\nt x y v\n0,00  0,000 0,005 1\n0,01  0,001 0,005 1\n0,02 0,002 0,005 1\n",
    ),
    // Body and point kinematics, coordinates of joints, vectors of the newer tables, and spaces between the columns.
    (
        "pos.sto",
        Format::Sto,
        "Positions\nversion=1\nnRows=3\nnColumns=9\ninDegrees=yes\n\nThis file contains the global positions.\n\n\
         Units are S.I. units (second, meters, Newtons, ...)\nAngles are in degrees.\n\nendheader\n\
         time\ttip_X\ttip_Y\ttip_Z\ttip_Ox\ttip_Oy\ttip_Oz\tslider_tx\tknee\n\
         0.00\t0\t0.005\t0\t1\t2\t3\t9\t8\n0.01\t0.001\t0.005\t0\t1\t2\t3\t9\t8\n\
         0.02\t0.002\t0.005\t0\t1\t2\t3\t9\t8\n",
    ),
    (
        "ik.mot",
        Format::Sto,
        "name ik.mot\ndatacolumns 4\ndatarows 3\nrange 0 0.02\nendheader\n time tip_tx tip_ty knee\n\
         0.00 0 0.005 1\n  0.01   1e-3 0.005 1\n0.02 2e-3 0.005 1\n",
    ),
    (
        "states.sto",
        Format::Sto,
        "Coordinates\nversion=1\nendheader\ntime\ttip_tx/value\ttip_tx/speed\ttip_ty/value\n\
         0.00\t0\t1\t0.005\n0.01\t0.001\t1\t0.005\n0.02\t0.002\t1\t0.005\n",
    ),
    (
        "markers.sto",
        Format::Sto,
        "DataRate=100.000000\nUnits=mm\nDataType=Vec3\nversion=3\nOpenSimVersion=4.4\nendheader\ntime\ttip\tbase\n\
         0.00\t0,5,0\tnan,nan,nan\n0.01\t1,5,0\t0,0,0\n0.02\t2,5,0\t0,0,0\n",
    ),
    (
        "nexus.csv",
        Format::Vicon,
        "Trajectories\n100\n,,tip,,\nFrame,Sub Frame,X,Y,Z\n,,mm,mm,mm\n1,0,0,5,0\n2,0,1,5,0\n3,0,2,5,0\n",
    ),
    (
        "dlc.csv",
        Format::DeepLabCut,
        "scorer,net,net,net\nbodyparts,tip,tip,tip\ncoords,x,y,likelihood\n0,0,-10,0.9\n1,2,-10,0.9\n2,4,-10,0.9\n",
    ),
];

/// Writes a file into a temporary folder and returns its path.
fn written(folder: &tempfile::TempDir, name: &str, text: &str) -> PathBuf {
    let path = folder.path().join(name);
    std::fs::write(&path, text).unwrap();
    path
}

#[test]
fn exports_of_one_motion_are_equal_in_seconds_and_meters() {
    let folder = tempfile::tempdir().unwrap();
    for (name, format, text) in EXPORTS {
        let path = written(&folder, name, text);
        let (found, bytes) = open(&path, None).unwrap();
        assert_eq!(found, format, "{name}");
        assert_eq!(parse(&path, found, &bytes).unwrap().markers[0].name, "tip", "{name}");
        let of_images = format == Format::DeepLabCut;
        let recording = Recording {
            marker: Some("TIP".into()),
            fps: of_images.then_some(100.0),
            scale: of_images.then_some(0.5e-3),
            y: of_images.then_some(Vertical::Down),
            ..Recording::default()
        };
        let tip = read(&path, &recording).unwrap();
        assert_eq!(tip, read_several(&path, &recording, ["tip"]).unwrap()[0], "{name}");
        for (k, (time, position)) in tip.times.iter().zip(&tip.positions).enumerate() {
            // The motion of all exports: frame k at 0.01 k s, x = k mm, y = 5 mm.
            let k = k as f64;
            let [x, y] = [position[0].unwrap(), position[1].unwrap()];
            let error = [time - 0.01 * k, x - 1e-3 * k, y - 5e-3].map(f64::abs);
            assert!(error.into_iter().all(|e| e < 1e-15), "{name}: {tip:?}");
        }
        assert_eq!((tip.times.len(), tip.dropped.empty), (3, 0), "{name}");
    }
}

#[test]
fn standard_deviations_are_in_meters_of_observed_coordinates() {
    let folder = tempfile::tempdir().unwrap();
    let text = "t,x[mm],y[mm],s[mm]\n0,1,,2\n1,,,\n2,1,1,3\n";
    let path = written(&folder, "tip.csv", text);
    let sigma = Some(marker_files::SigmaColumns::All("s".into()));
    let tip = read(&path, &Recording { sigma, ..Recording::default() }).unwrap();
    // The column s is in mm: 2 for x of the first row, 3 for x and y of the third.
    assert_eq!(tip.sigmas, [2e-3, 3e-3, 3e-3]);
    assert_eq!((tip.times, tip.dropped.empty), (vec![0.0, 2.0], 1));
}

#[test]
fn errors_name_line_and_allowed_values() {
    let folder = tempfile::tempdir().unwrap();
    // Content, line of the error (the header is line 1), and a part of its message.
    for (text, line, words) in [
        ("t,x\n0,1\n0,2\n", 3, "increasing times"),
        ("t,x\n0,one\n", 2, "a finite number, blank or NaN"),
        ("t,x[px]\n0,1\n", 1, "Set scale to the size of a pixel in m"),
        ("t,x\n-1,1\n", 2, "Set time_zero"),
        ("t,xa,ya,xb,yb\n0,1,1,2,2\n", 1, "allowed: marker with one of the names a, b"),
    ] {
        let path = written(&folder, "bad.csv", text);
        match read(&path, &Recording::default()) {
            Err(Error::Data { line: found, message, .. }) => {
                assert!(found == line && message.contains(words), "{text}: {found}: {message}");
            }
            other => panic!("{text}: {other:?}"),
        }
    }
    for (text, line, words) in [
        ("PointVelocity\nendheader\ntime\ta_X\ta_Y\n0\t1\t2\n", 1, "found velocities"),
        ("Speeds\nendheader\ntime\ta_tx\ta_ty\n0\t1\t2\n", 1, "found velocities"),
        ("Accelerations\nendheader\ntime\ta_X\ta_Y\n0\t1\t2\n", 1, "found accelerations"),
        (
            "Velocities\nendheader\ntime\ta_X\ta_Y\n0\t1\t2\n",
            1,
            "found velocities, allowed: positions",
        ),
        ("a\nDataType=Quaternion\nendheader\ntime\ta\n0\t1,0,0,0\n", 2, "allowed: double or Vec3"),
        ("a\nUnits=ft\nendheader\ntime\ta_X\n0\t1\n", 2, "allowed: um, mm, cm or m"),
        ("a\nendheader\ntime\tknee\n0\t1\n", 3, "no column with a position"),
        ("a\nendheader\nknee\ttime\n0\t1\n", 3, "allowed: `time`"),
        ("a\nendheader\n", 2, "nothing below"),
        ("a\nendheader\ntime\ta_X\ta_Y\n0\t1\t2\n0\t1\t2\n", 5, "increasing values"),
        ("DataType=Vec3\nendheader\ntime\ta\n0\t1,2,3\n1\t1,2\n", 5, "found 3 fields, allowed: 4"),
    ] {
        let path = written(&folder, "bad.sto", text);
        let error = read(&path, &Recording::default()).unwrap_err().to_string();
        assert!(error.contains(&format!("bad.sto:{line}: ")) && error.contains(words), "{error}");
    }
    let path = written(&folder, "acceleration.csv", "t,ax,ay\n0,1,2\n");
    let error = read(&path, &Recording::default()).unwrap_err().to_string();
    assert!(error.contains("found accelerations instead of positions"), "{error}");
    let missing = read(&folder.path().join("none.csv"), &Recording::default());
    assert!(matches!(missing, Err(Error::Io { .. })));
}

#[test]
fn control_characters_of_files_are_escaped_in_messages() {
    let folder = tempfile::tempdir().unwrap();
    let path = written(&folder, "bad.csv", "t,x\n0,\x1b[31m\n");
    let error = read(&path, &Recording::default()).unwrap_err().to_string();
    assert!(error.contains("\\x1b[31m") && !error.contains('\x1b'), "{error}");
}

#[test]
fn names_of_trajectories_keep_their_commas_and_brackets() {
    let folder = tempfile::tempdir().unwrap();
    let text = "#Kinovea Trajectory data export\n#T X Y\n\n# tip, left\n0,00 0,5 5\n0,01 1,5 5\n0,02 2,5 5\n";
    let aligned = "#Kinovea\n#T X Y\n\n# tip, left\n0.00  0.5   5\n0.01  1.5   5\n0.02  2.5   5\n";
    let sheet =
        "Time (s),tip (left)/0/X (mm),tip (left)/0/Y (mm)\n0,0.5,5\n0.01,1.5,5\n0.02,2.5,5\n";
    for (text, name, scale) in [
        (text, "tip, left", Some(1e-3)),
        (aligned, "tip, left", Some(1e-3)),
        (sheet, "tip (left)/0", None),
    ] {
        let path = written(&folder, "kinovea.txt", text);
        let format = Some(Format::Kinovea);
        let recording =
            Recording { marker: Some(name.into()), format, scale, ..Recording::default() };
        let tip = read(&path, &recording).unwrap();
        assert_eq!(tip.times, [0.0, 0.01, 0.02], "{name}");
        // 0.5, 1.5 and 2.5 mm, whose products with 1e-3 are rounded.
        for (k, position) in tip.positions.iter().enumerate() {
            let x = position[0].unwrap();
            assert!((x - 1e-3 * (k as f64 + 0.5)).abs() < 1e-15, "{name}: {x}");
        }
    }
}

/// An export of Motive with the rigid body `hand` in two frames, and the marker `tip`; `rows` are its last columns.
fn bodies(setting: &str, columns: &str, rows: [&str; 3]) -> String {
    let width = columns.split(',').count();
    let repeated = |text: &str, count: usize| format!(",{text}").repeat(count);
    let (body, own) = (repeated("Rigid Body", width + 3), repeated("hand", width + 3));
    let properties = repeated("Rotation", width) + &repeated("Position", 3);
    let marker = |text: &str| repeated(text, 3);
    let rows: String = (0..3).map(|k| format!("{k},0.0{k},{},{k},5,0\n", rows[k])).collect();
    format!(
        "Format Version,1.23,Rotation Type,{setting},Length Units,Centimeters,Coordinate Space,Global\n\n\
         ,Type{body}{}\n,Name{own}{}\n,{properties}{}\nFrame,Time (Seconds),{columns},X,Y,Z,X,Y,Z\n{rows}",
        marker("Marker"),
        marker("tip"),
        marker("Position"),
    )
}

#[test]
fn rigid_bodies_have_poses_in_meters_and_quaternions() {
    let path = PathBuf::from("take.csv");
    let text = bodies("Quaternion", "X,Y,Z,W", ["0,0,0,1,10,20,30", ",,,,,,", "0.6,0,0,0.8,1,2,3"]);
    let found = read_bodies(&path, text.as_bytes()).unwrap();
    let hand = found.select(None).unwrap();
    assert_eq!((&hand.name[..], &found.times[..]), ("hand", &[0.0, 0.01, 0.02][..]));
    let poses = [0, 2].map(|k| hand.poses[k].unwrap());
    assert_eq!(poses[0].position, [0.1, 0.2, 0.3]);
    assert_eq!(poses[1].quaternion, [0.8, 0.6, 0.0, 0.0]);
    assert_eq!(hand.poses[1], None);
    assert!(
        found.select(Some("foot")).unwrap_err().contains("`foot`, allowed: one of the names hand")
    );
    // The markers of the same file are read as before.
    let file = parse(&path, Format::Motive, text.as_bytes()).unwrap();
    assert_eq!(file.markers[0].name, "tip");
    // 90 deg about x and then about the new z: the axes of the body are the world's z, -x and -y.
    let half = std::f64::consts::FRAC_1_SQRT_2;
    for (setting, angles, expected) in [
        ("XYZ", "90,0,90", [0.5, 0.5, -0.5, 0.5]),
        ("ZYX", "90,0,90", [0.5, 0.5, 0.5, 0.5]),
        ("YXZ", "0,90,0", [half, 0.0, half, 0.0]),
    ] {
        let row = format!("{angles},1,2,3");
        let text = bodies(setting, "X,Y,Z", [&row; 3]);
        let found = read_bodies(&path, text.as_bytes()).unwrap();
        let q = found.bodies[0].poses[0].unwrap().quaternion;
        let error = q.iter().zip(expected).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(error < 1e-15, "{setting}: {q:?}");
    }
}

#[test]
fn faulty_rigid_bodies_are_rejected_with_their_line() {
    let row = "0,0,0,1,10,20,30";
    let text = bodies("Quaternion", "X,Y,Z,W", [row; 3]);
    for (from, to, line, words) in [
        ("Quaternion", "XXY", 1, "Rotation Type `XXY`"),
        ("Quaternion", "XYZ", 6, "`hand` without all of its columns"),
        ("Global", "Local", 1, "Coordinate Space `Local`"),
        (
            "Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body",
            "A,A,A,A,A,A,A",
            3,
            "no column of the type Rigid Body",
        ),
        ("X,Y,Z,W,", "X,Y,Y,W,", 6, "two columns of one coordinate of `hand`"),
        ("1,0.01,0,0,0", "1,0.01,0,,0", 8, "1 of 7 numbers blank"),
        ("1,0.01,0,0,0", "1,0.01,0,one,0", 8, "`one`"),
        ("1,0.01,", "1,0.00,", 8, "increasing values"),
        ("2,0.02,0,", "2,0.02,", 9, "found 11 fields, allowed: 12"),
    ] {
        assert!(text.contains(from), "{from} in {text}");
        let error = read_bodies("take.csv".as_ref(), text.replacen(from, to, 1).as_bytes());
        let error = error.unwrap_err().to_string();
        assert!(error.contains(&format!("take.csv:{line}: ")) && error.contains(words), "{error}");
    }
}

#[test]
fn archive_of_phyphox_is_described() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("phyphox.zip");
    // A local header of the format: 26 bytes, the lengths of name and extra field, and the name.
    let mut bytes = b"PK\x03\x04".to_vec();
    bytes.resize(26, 0);
    bytes.extend([12, 0, 0, 0]);
    bytes.extend(b"Raw Data.csv\x00\x01");
    std::fs::write(&path, bytes).unwrap();
    let error = read(&path, &Recording::default()).unwrap_err().to_string();
    assert!(error.contains("zip archive of CSV tables, as phyphox exports; unpack it"), "{error}");
}
