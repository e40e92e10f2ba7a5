//! Files of motion-capture and video-tracking programs: the same tip gives the same modulus in all formats, and faulty
//! files are rejected with the line and a remedy.

use rodfit::fit::{Axes, FitFile, Format, Recording, Vertical};
use rodfit::scene::{InitialState, Material, Recorded, Support, Track};
use rodfit::{Fit, Observation, Parameter, Point, Problem};
use std::path::{Path, PathBuf};
use tempfile::TempDir;

use crate::common::fits::same_mesh;
use crate::common::formats::{GAP, Written, all, tip};
use crate::common::{coarse, straight_rod};

const FRAMES: usize = 24;

fn problem() -> Problem {
    coarse(8, 3.90625e-3, 0.4).problem().unwrap()
}

/// Writes a file into the folder and returns its path.
fn written(folder: &TempDir, file: &Written) -> PathBuf {
    let path = folder.path().join(file.name);
    std::fs::write(&path, &file.text).unwrap();
    path
}

/// All readers give the same positions to the last digit, and therefore the same modulus.
#[test]
fn modulus_is_the_same_in_every_file_format() {
    let problem = problem();
    let tip = tip(&problem, FRAMES);
    let folder = TempDir::new().unwrap();
    let mut before = None;
    for file in all(&tip) {
        let path = written(&folder, &file);
        let seen = Observation::read_as(&path, &file.recording).unwrap();
        assert_eq!(
            (seen.samples.len(), seen.header.dropped.empty),
            (FRAMES - 1, 1),
            "{}",
            file.name
        );
        // The frame without a position is missing.
        assert!(!seen.samples.iter().any(|s| s.time == GAP as f64 / 64.0), "{}", file.name);
        // Named, it is read alike.
        let named = Recording {
            format: Some(serde_json::from_str(&format!("\"{}\"", file.format)).unwrap()),
            ..file.recording.clone()
        };
        assert_eq!(Observation::read_as(&path, &named).unwrap().samples, seen.samples);
        let fit = Fit::new(&problem)
            .observe(seen.clone().sigma(1e-6))
            .identify(Parameter::YoungsModulus)
            .analyse(same_mesh())
            .solve()
            .unwrap();
        let found = (seen.data.samples, fit.parameters[0].value.unwrap().to_bits());
        println!("{:16} {:?}", file.name, fit.parameters[0].value);
        // The modulus of the simulation; positions are rounded to 1/1024 mm.
        assert!((f64::from_bits(found.1) / 1e8 - 1.0).abs() < 1e-4);
        assert_eq!(before.get_or_insert(found.clone()), &found, "{}", file.name);
    }
}

/// Versions and settings of the programs have different layouts of the same data.
#[test]
fn csv_layouts_are_equivalent() {
    let tip: Vec<[f64; 2]> = (0..9).map(|k| [500.5 - f64::from(k), -2.25 * f64::from(k)]).collect();
    let folder = TempDir::new().unwrap();
    let files = all(&tip);
    let same = |name: &str, change: &dyn Fn(&str) -> String| {
        let file = files.iter().find(|f| f.name == name).unwrap();
        let path = written(&folder, file);
        let before = Observation::read_as(&path, &file.recording).unwrap().data.samples;
        let text = change(&file.text);
        assert_ne!(text, file.text, "{name}");
        std::fs::write(&path, &text).unwrap();
        let read = Observation::read_as(&path, &file.recording);
        assert_eq!(read.unwrap_or_else(|e| panic!("{e}: {text}")).samples, before, "{name}");
    };
    let data = |text: &str, header: usize, change: &dyn Fn(usize, &str) -> String| {
        let lines = text.lines().enumerate();
        let lines =
            lines.map(|(i, line)| if i < header { line.into() } else { change(i - header, line) });
        lines.map(|line| line + "\n").collect::<String>()
    };
    // Motive 3: a row of parents, and no blank line; Windows' ends of lines; a mark of the bytes' order.
    same("motive.csv", &|t| {
        let t = t.replacen("\n\n", "\n", 1);
        t.replacen("\n,,Rotation", "\n,Parent,,,,,base,base,base,base,base,base\n,,Rotation", 1)
    });
    same("motive.csv", &|t| t.replacen("\n\n", "\n,,,,,,,,,,,\n", 1));
    same("motive.csv", &|t| format!("\u{feff}{}", t.replace('\n', "\r\n")));
    same("vicon.csv", &|t| t.replace("\r\n", "\n").replacen("\n\n", "", 1));
    same("vicon.csv", &|t| {
        t.replace("X,Y,Z,X,Y,Z", "X,Y,Z,X,Y,Z,X',Y',Z'").replace(",250,-0.4,0", ",250,-0.4,0,,,")
    });
    // Frames, times, names of columns, tabs at the ends of lines.
    same("qualisys.tsv", &|t| data(t, 11, &|k, l| format!("{}\t{}\t{l}", k + 1, k as f64 / 64.0)));
    same("qualisys.tsv", &|t| {
        data(t, 11, &|k, l| format!("{}\t{}\t{l}\t", k + 1, k as f64 / 64.0))
    });
    same("qualisys.tsv", &|t| data(t, 11, &|k, l| format!("{}\t{l}", k + 1)));
    same("qualisys.tsv", &|t| data(t, 11, &|_, l| format!("{l}\t")));
    same("qualisys.tsv", &|t| t.replace("0.000\t0.000\t0.000", "\t\t"));
    same("qualisys.tsv", &|t| {
        t.replacen("Measured\n", "Measured\nmid X\tmid Y\tmid Z\ttip X\ttip Y\ttip Z\n", 1)
    });
    // Delimiters, and decimal commas beside semicolons.
    same("tracks.txt", &|t| t.replace(',', ";"));
    same("tracks.txt", &|t| t.replace(',', ";").replace('.', ","));
    same("tracker.txt", &|t| t.replacen("mass_A\n", "#multi:\tmass_A\t\n", 1));
    same("kinovea.csv", &|t| t.replace(',', ".").replace(';', ","));
    same("deeplabcut.csv", &|t| {
        data(t, 3, &|k, l| l.replacen(&format!("{k},"), &format!("a/b{k:03}.png,"), 1))
    });
    same("deeplabcut.csv", &|t| t.replace(",3.5,4.5,0.1", ",,,"));
}

/// Markers of a file prescribe the ends of a rod like those of a table, in any order of the file.
#[test]
fn recordings_of_other_programs_prescribe_ends() {
    let folder = TempDir::new().unwrap();
    let path = |name: &str, text: &str| {
        let path = folder.path().join(name);
        std::fs::write(&path, text).unwrap();
        path
    };
    let table = path(
        "t.csv",
        "t,xa,ya,za,xb,yb,zb\n0,.1,0,.2,1,2,3\n0.01,.2,0,.2,,,\n0.02,.3,.1,.2,1,2,4\n",
    );
    let vicon = path(
        "v.csv",
        "Trajectories\n100\n,,b,,,a,,\nFrame,Sub Frame,X,Y,Z,X,Y,Z\n,,m,m,m,m,m,m\n8,0,9,9,9,9,9,9\n9,0,1,-3,2,.1,-.2,0\n\
         10,0,,,,.2,-.2,0\n11,0,1,-4,2,.3,-.2,.1\n",
    );
    let recording = Recording {
        axes: Some(Axes::new(["x", "z", "-y"]).unwrap()),
        time_zero: Some(9.0),
        ..Recording::default()
    };
    let read = Track::read_as(&vicon, &recording, &["a".into(), "b".into()]).unwrap();
    let expected = Track::read(&table).unwrap();
    assert_eq!(read.markers(), expected.markers());
    // Frames of 100 per second.
    assert_eq!(read.times(), [0.0, 0.01, 0.02]);
    let late = Track::read(&vicon).unwrap_err().to_string();
    assert!(late.contains("found 0.07 s") && late.contains("time_zero"), "{late}");
    let none = Track::read_as(&vicon, &recording, &["c".into()]).unwrap_err().to_string();
    assert!(
        none.contains(
            "marker = \"c\" in a file of Vicon Nexus, allowed: marker with one of the names b, a"
        ),
        "{none}"
    );
}

/// Marker names keep their case. A name in another case is accepted if it is unique.
#[test]
fn marker_names_keep_their_case() {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("t.csv");
    std::fs::write(&path, "T,xA,yA,XTip,yTip\n0,.1,0,1,2\n0.01,.2,0,1,2\n").unwrap();
    let names = |asked: &[&str]| {
        let asked: Vec<String> = asked.iter().map(|name| name.to_string()).collect();
        let track =
            Track::read_as(&path, &Recording::default(), &asked).map_err(|e| e.to_string())?;
        Ok::<_, String>(track.markers().iter().map(|m| m.name.clone()).collect::<Vec<_>>())
    };
    assert_eq!(names(&[]).unwrap(), ["A", "Tip"]);
    assert_eq!(names(&["tip", "A"]).unwrap(), ["Tip", "A"]);
    assert!(names(&["B"]).unwrap_err().contains("A, Tip"));
    let hands = |inner: &str| {
        let material = Material::new(1200.0, 1e7);
        let mut scene = straight_rod(4, [0.4, 2e-3], material);
        let text = "t,xa,ya,xB,yB,xC,yC,xD,yD,xE,yE\n0,0,0,.1,0,.2,0,.3,0,.4,0\n0.1,0,0,.1,0,.2,0,.3,0,.4,0\n";
        let file = folder.path().join("c.csv");
        std::fs::write(&file, text).unwrap();
        scene.supports.start = Support::Recorded;
        scene.initial.state = InitialState::Recorded;
        scene.supports.path = Some(Recorded { inner: vec![inner.into()], ..Recorded::new(file) });
        scene.problem().map(|_| ()).map_err(|error| error.to_string())
    };
    assert_eq!((hands("D"), hands("d")), (Ok(()), Ok(())));
    assert!(hands("x").unwrap_err().contains("[\"C\", \"D\", \"E\"]"), "{:?}", hands("x"));
}

/// A fit file reads several markers of one file, each at its point.
#[test]
fn several_markers_of_a_file_are_read() {
    let tip: Vec<[f64; 2]> = (0..9).map(|k| [500.5 - f64::from(k), -2.25 * f64::from(k)]).collect();
    let folder = TempDir::new().unwrap();
    let files = all(&tip);
    written(&folder, files.iter().find(|f| f.name == "motive.csv").unwrap());
    let scene = coarse(8, 3.90625e-3, 0.4).to_toml().unwrap();
    std::fs::write(folder.path().join("scene.toml"), scene).unwrap();
    let text = |keys: &str| {
        format!(
            "scene = \"scene.toml\"\n[[observation]]\nfile = \"motive.csv\"\naxes = [\"x\", \"y\", \"none\"]\n\
             sigma = 1e-3\n{keys}\n[[parameter]]\nname = \"youngs_modulus\"\n"
        )
    };
    let read = |keys: &str| FitFile::from_toml(&text(keys), folder.path());
    let markers = "markers = { \"rod:mid\" = { arc_length = 0.25 }, \"rod:tip\" = \"tip\" }";
    let fit = read(markers).unwrap();
    let seen: Vec<_> = fit.experiments[0].measurements.iter().filter_map(|m| m.motion()).collect();
    assert_eq!(seen.iter().map(|o| o.samples.len()).collect::<Vec<_>>(), [9, 8]);
    // The points of the fit file.
    assert_eq!(
        seen.iter().map(|o| o.point).collect::<Vec<_>>(),
        [Point::ArcLength(0.25), Point::Tip]
    );
    let measured = &fit.experiments[0].measurements;
    // The sigma of the fit file, 1e-3 m.
    assert!(measured.iter().all(|m| m.sigma() == Some(1e-3)));
    let one = read("marker = \"rod:tip\"").unwrap();
    assert_eq!(one.experiments[0].measurements[0].motion().unwrap().samples, seen[1].samples);
    for (keys, words) in [
        ("", "2 markers and no key marker"),
        ("marker = \"rod\"", "rod:mid, rod:tip"),
        ("markers = { \"rod\" = \"tip\" }", "rod:mid, rod:tip"),
        ("markers = {}", "observation[0].markers"),
        ("markers = { \"rod:tip\" = \"tip\" }\npoint = \"tip\"", "neither marker nor point"),
        ("markers = \"all\"", "a table of markers"),
        ("format = \"optitrack\"", "optitrack"),
        ("marker = \"rod:tip\"\nlikelihood = 0.5", "no column likelihood"),
    ] {
        let error = read(keys).unwrap_err().to_string();
        assert!(error.contains(words), "{keys}: {error}");
    }
    let mirrored = text("marker = \"rod:tip\"").replace("\"y\", \"none\"", "\"z\", \"y\"");
    let error = FitFile::from_toml(&mirrored, folder.path()).unwrap_err().to_string();
    assert!(error.contains("mirror") && error.contains("axes"), "{error}");
}

/// Axes have to be right-handed: mirrored coordinates are not those of the rod.
#[test]
fn axes_are_rotated_and_mirrors_rejected() {
    for names in [["x", "z", "-y"], ["-y", "x", "z"], ["z", "x", "y"], ["-x", "-y", "z"]] {
        assert!(Axes::new(names).is_ok(), "{names:?}");
    }
    for (names, words) in [
        (["x", "z", "y"], "mirror"),
        (["-x", "y", "z"], "mirror"),
        (["x", "x", "z"], "once"),
        (["x", "w", "z"], "allowed: x, y, z"),
        (["none", "none", "none"], "at least one"),
        (["x", "-none", "z"], "allowed: x, y, z"),
    ] {
        let error = Axes::new(names).unwrap_err();
        assert!(error.contains(words), "{names:?}: {error}");
    }
}

/// Requires that the file is rejected with its path, a line and all words.
fn refused(path: &Path, recording: &Recording, words: &[&str]) {
    match Observation::read_as(path, recording) {
        Ok(_) => panic!("{} is read: {:?}", path.display(), std::fs::read_to_string(path)),
        Err(error) => {
            let error = error.to_string();
            assert!(
                error.contains(&format!("{}:", path.display())),
                "no file and line in: {error}"
            );
            for word in words {
                assert!(error.contains(word), "`{word}` in: {error}");
            }
        }
    }
}

/// A fault of a file: the replaced text, its replacement, and words of the error message, the line number among them.
type Broken<'a> = (&'a str, &'a str, &'a [&'a str]);

/// Requires that each fault in the file of this name is rejected with its words.
fn broken(name: &str, cases: &[Broken]) {
    let tip: Vec<[f64; 2]> = (0..9).map(|k| [500.5 - f64::from(k), -2.25 * f64::from(k)]).collect();
    let files = all(&tip);
    let file = files.iter().find(|f| f.name == name).unwrap();
    let folder = TempDir::new().unwrap();
    let path = folder.path().join(name);
    let named = Recording {
        format: Some(serde_json::from_str(&format!("\"{}\"", file.format)).unwrap()),
        ..file.recording.clone()
    };
    for (from, to, words) in cases {
        assert!(file.text.contains(from), "{from:?} in {}", file.text);
        std::fs::write(&path, file.text.replacen(from, to, 1)).unwrap();
        refused(&path, &named, words);
    }
    // Half a file, cut anywhere, is refused or read, but never more than that.
    for cut in (0..file.text.len()).step_by(7).filter(|cut| file.text.is_char_boundary(*cut)) {
        std::fs::write(&path, &file.text[..cut]).unwrap();
        let _ = Observation::read_as(&path, &named);
        let _ = Observation::read_as(&path, &file.recording);
    }
}

#[test]
fn broken_motive_files_are_rejected() {
    broken(
        "motive.csv",
        &[
            ("Format Version", "Version", &["1: ", "`Format Version`", "format = \"csv\""]),
            ("Length Units,Millimeters", "Units,mm", &["1: ", "no `Length Units`", "Meters"]),
            ("Millimeters", "Inches", &["1: ", "`Inches`", "Millimeters"]),
            ("Frame,Time", "Bild,Time", &["begins with `Frame`"]),
            (",Type,", ",Art,", &["7: ", "`Type` and `Name`"]),
            ("Time (Seconds)", "Zeit", &["7: ", "`Zeit`", "Time (Seconds)"]),
            (
                "Marker,Marker,Marker,Marker,Marker,Marker",
                "Bone,Bone,Bone,Bone,Bone,Bone",
                &["3: ", "Bone", "Markers"],
            ),
            (
                "rod:tip,rod:tip,rod:tip",
                "rod:end,rod:end,rod:end",
                &["marker = \"rod:tip\"", "rod:mid, rod:end"],
            ),
            ("rod:tip,rod:tip,rod:tip", "rod:mid,rod:mid,rod:mid", &["two columns x", "rod:mid"]),
            ("1,0.015625,", "1,0.000000,", &["9: ", "increasing"]),
            ("1,0.015625,", "1,,", &["9: ", "Time (Seconds)", "blank"]),
            ("1,0.015625,0,1,2,3,", "1,0.015625,0,1,2,", &["9: ", "11 fields", "12"]),
            ("499.5", "4q9.5", &["9: ", "`4q9.5`", "rod:tip x"]),
            ("X,Y,Z,X,Y,Z", "X,Y,Z,X,W,Z", &["7: ", "`rod:mid` without a column x or y"]),
        ],
    );
}

#[test]
fn broken_vicon_files_are_rejected() {
    broken(
        "vicon.csv",
        &[
            ("Trajectories\r\n", "Trajektorien\r\n", &["`Trajectories`", "no section"]),
            ("64\r\n,,rod", "fast\r\n,,rod", &["11: ", "`fast`"]),
            ("64\r\n,,rod", "0\r\n,,rod", &["11: ", "above 0"]),
            ("Frame,Sub Frame,X,Y,Z,X", "Bild,Sub Frame,X,Y,Z,X", &["13: ", "`Bild`", "`Frame`"]),
            (",,mm,mm,mm", ",,mm,in,mm", &["14: ", "`in`", "mm, cm or m"]),
            (",,mm,mm,mm", ",,mm,m,mm", &["14: ", "several units"]),
            (",,rod:tip,,,rod:mid", ",,,,,rod:mid", &["12: ", "no marker name above the first"]),
            (
                ",,rod:tip,,,rod:mid",
                ",,rod:end,,,rod:mid",
                &["marker = \"rod:tip\"", "rod:end, rod:mid"],
            ),
            ("2,0,499.5", "1,0,499.5", &["16: ", "increasing"]),
            ("2,0,499.5", "zwei,0,499.5", &["16: ", "`zwei`", "Frame"]),
            ("2,0,499.5", "2,499.5", &["16: ", "7 fields", "8"]),
            ("499.5", "inf", &["16: ", "`inf`"]),
            ("X,Y,Z,X,Y,Z", "X,Y',Z,X,Y,Z", &["13: ", "`rod:tip` without"]),
        ],
    );
}

#[test]
fn broken_tracker_files_are_rejected() {
    broken(
        "tracks.txt",
        &[
            ("t,x,y", "x,t,y", &["2: ", "the time `t`"]),
            ("t,x,y", "Zeit,x,y", &["2: ", "`Zeit`"]),
            ("mass_C,,,,", "mass_D,,,,", &["marker = \"mass_C\"", "mass_A, mass_D"]),
            (",vx,vy,x,y", ",vx,vy,x,x", &["2: ", "two columns x", "mass_C"]),
            (",vx,vy,x,y", ",vx,vy,x,r", &["2: ", "`mass_C` without"]),
            ("\n0.015625,", "\n0,", &["4: ", "increasing"]),
            ("\n0.015625,", "\n,", &["4: ", "blank `t`"]),
            ("\n0.015625,1", "\n0.015625", &["4: ", "11 fields", "12"]),
            ("499.5", "499..5", &["4: ", "499..5"]),
            ("499.5,-2.25,5,6,7,8,9", "499.5,-2.25,5,6,7,8,9,10", &["4: ", "13 fields"]),
        ],
    );
    broken(
        "tracker.txt",
        &[
            ("x\ty", "r\tw", &["2: ", "no columns x and y"]),
            ("mass_A\nt\tx\ty\n", "", &["the time `t`"]),
        ],
    );
}

#[test]
fn broken_deeplabcut_files_are_rejected() {
    broken(
        "deeplabcut.csv",
        &[
            ("scorer", "model", &["1: ", "`scorer`"]),
            ("bodyparts", "parts", &["1: ", "`bodyparts`"]),
            ("coords", "what", &["1: ", "`coords`"]),
            ("x,y,likelihood", "x,y,p", &["3: ", "coords `p`", "likelihood"]),
            ("x,y,likelihood", "x,x,likelihood", &["3: ", "two columns x", "`tip`"]),
            ("x,y,likelihood", "x,z,likelihood", &["3: ", "`tip` without"]),
            ("\n1,", "\n0,", &["5: ", "increasing"]),
            ("\n1,", "\nfirst,", &["5: ", "`first`", "frame number"]),
            ("\n1,499.5", "\n1", &["5: ", "3 fields", "4"]),
            ("499.5", "x", &["5: ", "`x`"]),
            ("0.99", "sure", &["4: ", "`sure`", "likelihood"]),
        ],
    );
    broken(
        "animals.csv",
        &[("rod2,rod2,rod2", "rod3,rod3,rod3", &["marker = \"rod2:tip\"", "rod1:tip, rod3:tip"])],
    );
}

#[test]
fn broken_dltdv_files_are_rejected() {
    broken(
        "xypts.csv",
        &[
            ("pt1_cam1_X", "frame", &["1: ", "column `frame`", "pt1_X"]),
            ("pt1_cam1_Y", "pt1_cam1_X", &["1: ", "two columns x"]),
            ("pt1_cam1_Y", "pt1_cam1_Q", &["1: ", "`pt1_cam1_Q`"]),
            (
                "pt1_cam1_X,pt1_cam1_Y",
                "pt1_X,pt1_Y",
                &["1: ", "with a camera number and columns without"],
            ),
            (
                "pt1_cam2_X,pt1_cam2_Y",
                "pt2_cam2_X,pt2_cam2_Y",
                &["marker = \"pt1_cam2\"", "pt1_cam1, pt2_cam2"],
            ),
            (",pt1_cam2_Y", "", &["1: ", "`pt1_cam2` without"]),
            ("NaN,NaN,500.5", "NaN,500.5", &["3: ", "3 fields", "4"]),
            ("NaN,NaN,500.5", "NaN,NaN,Inf", &["3: ", "`Inf`"]),
            ("NaN,NaN,500.5", "NaN,NaN,-", &["3: ", "`-`"]),
            ("NaN,NaN,500.5", "NaN,NaN,500.5,1", &["3: ", "5 fields"]),
        ],
    );
}

#[test]
fn broken_qualisys_files_are_rejected() {
    broken(
        "qualisys.tsv",
        &[
            ("MARKER_NAMES", "NAMES_OF_MARKERS", &["1: ", "`MARKER_NAMES`"]),
            ("\nFREQUENCY", "\nRATE_HZ", &["1: ", "`FREQUENCY`"]),
            ("\t64\n", "\t-64\n", &["4: ", "above 0"]),
            ("\t64\n", "\tfast\n", &["4: ", "`fast`"]),
            ("DATA_INCLUDED\t3D", "DATA_INCLUDED\t6D", &["9: ", "6D", "3D"]),
            ("mid\ttip", "mid\tend", &["marker = \"tip\"", "mid, end"]),
            ("FREQUENCY\t64", "FREQUENCY\t1e-320", &["13: ", "not finite", "fps"]),
            ("mid\ttip", "tip\ttip", &["10: ", "two columns x"]),
            ("mid\ttip", "mid\ttip\tleft", &["12: ", "6 columns for 3 markers"]),
            ("499.5", "4,5,6", &["13: ", "`4,5,6`"]),
            ("250\t-1\t0\t499.5", "250\t-1\t499.5", &["13: ", "5 fields"]),
        ],
    );
}

#[test]
fn broken_kinovea_files_are_rejected() {
    broken(
        "kinovea.csv",
        &[
            ("Time (ms)", "Frame", &["1: ", "`Frame`", "`Time`"]),
            ("Time (ms)", "Time (h)", &["1: ", "[h]", "ms"]),
            ("/0/X (mm)", "/0/X (cm)", &["1: ", "several units"]),
            ("/0/X (mm)", "/0/X (in)", &["1: ", "[in]", "px"]),
            ("/0/X (mm)", "/0/W (mm)", &["1: ", "NAME/X"]),
            ("/0/Y (mm)", "/0/X (mm)", &["1: ", "two columns x"]),
            ("Trajectory 1/0/Y (mm)", "speed", &["1: ", "`speed`"]),
            ("\n15,625", "\n0:00:00:15", &["3: ", "milliseconds"]),
            ("\n15,625", "\n0", &["3: ", "increasing"]),
            ("499,5;", "", &["3: ", "2 fields", "3"]),
            ("499,5", "4 9", &["3: ", "`4 9`"]),
        ],
    );
}

/// Keys that are not supported together with a file are errors with the allowed keys.
#[test]
fn keys_beside_a_file_are_checked() {
    let tip: Vec<[f64; 2]> = (0..9).map(|k| [500.5 - f64::from(k), -2.25 * f64::from(k)]).collect();
    let files = all(&tip);
    let folder = TempDir::new().unwrap();
    let case = |name: &str, change: &dyn Fn(&mut Recording), words: &[&str]| {
        let file = files.iter().find(|f| f.name == name).unwrap();
        let path = written(&folder, file);
        let mut recording = file.recording.clone();
        change(&mut recording);
        refused(&path, &recording, words);
    };
    case("motive.csv", &|r| r.marker = None, &["2 markers", "rod:mid, rod:tip"]);
    case("motive.csv", &|r| r.fps = Some(64.0), &["fps = 64 and times in the file"]);
    case("motive.csv", &|r| r.scale = Some(1e-3), &["scale", "lengths in mm"]);
    case("motive.csv", &|r| r.likelihood = Some(0.5), &["likelihood = 0.5", "column likelihood"]);
    case("motive.csv", &|r| r.format = Some(Format::Vicon), &["Trajectories", "Vicon"]);
    case("vicon.csv", &|r| r.fps = Some(64.0), &["64 frames per second in the file"]);
    case("deeplabcut.csv", &|r| r.fps = None, &["Set fps to the number of frames per second"]);
    case("deeplabcut.csv", &|r| r.scale = None, &["Set scale to the size of a pixel in m"]);
    case("deeplabcut.csv", &|r| r.likelihood = Some(60.0), &["likelihood = 60", "from 0 to 1"]);
    case("deeplabcut.csv", &|r| r.origin = Some([0.0, 0.0, 1.0]), &["origin = 1 along z"]);
    let in_space = |r: &mut Recording| r.axes = Some(Axes::new(["x", "z", "-y"]).unwrap());
    case("deeplabcut.csv", &in_space, &["found z in axes", "none"]);
    case("xypts.csv", &|r| r.y = None, &["y = \"down\""]);
    case("xypts.csv", &|r| r.fps = Some(0.0), &["fps = 0"]);
    case("tracker.txt", &|r| r.scale = Some(f64::NAN), &["scale = NaN"]);
    case("tracker.txt", &|r| r.time_zero = Some(f64::INFINITY), &["time_zero = inf"]);
    case("table.csv", &in_space, &["found z in axes"]);
    case("table.csv", &|r| r.likelihood = Some(0.5), &["column likelihood"]);
    case("markers.csv", &|r| r.marker = Some("top".into()), &["marker = \"top\"", "mid, tip"]);
    // An image's y axis points down without a word; a word turns it.
    let file = files.iter().find(|f| f.name == "deeplabcut.csv").unwrap();
    let up = Recording { y: Some(Vertical::Up), ..file.recording.clone() };
    let read = Observation::read_as(written(&folder, file), &up).unwrap().at(Point::Tip);
    assert_eq!(read.samples[1].position[1], Some(2.25 * 1e-3));
}

#[test]
fn broken_kinovea_texts_are_rejected() {
    broken(
        "kinovea.txt",
        &[
            ("0 250 -1", "0:00:00:00 250 -1", &["5: ", "0:00:00:00", "seconds"]),
            ("0 250 -1", "0 250", &["5: ", "2 numbers", "three numbers: T, X and Y"]),
            ("0 250 -1", "0 250 -1 3", &["5: ", "4 numbers", "three numbers: T, X and Y"]),
            ("0 250 -1", "0 250 low", &["5: ", "found `low`", "finite number"]),
            ("0 250 -1", "0 1e999 -1", &["5: ", "finite number"]),
            (
                "# Trajectory 2",
                "# Trajectory 1",
                &["second position", "`Trajectory 1`", "one position at each time"],
            ),
            (
                "0.015625 250 -1",
                "0 250 -1",
                &["6: ", "second position", "one position at each time"],
            ),
            (
                "# Trajectory 2",
                "# Trajectory two",
                &["1: ", "marker = \"Trajectory 2\"", "Trajectory two"],
            ),
        ],
    );
}

#[test]
fn broken_sleap_files_are_rejected() {
    broken(
        "sleap.csv",
        &[
            ("track,frame_idx", "animal,frame_idx", &["1: ", "no columns `track` and `frame_idx`"]),
            ("frame_idx", "frame", &["1: ", "no columns `track` and `frame_idx`"]),
            ("mid.x", "mid", &["1: ", "column `mid`", "NODE.x"]),
            ("mid.x", "mid.z", &["1: ", "column `mid.z`", "NODE.x"]),
            ("mid.x", "tip.x", &["1: ", "two columns `tip.x`"]),
            ("mid.x", "end.x", &["1: ", "node `end` without x or y"]),
            ("rod,0,0.9,250", "rod,0,250", &["2: ", "8 fields", "9 fields, as in the header"]),
            ("rod,0,", "rod,,", &["2: ", "blank `frame_idx`"]),
            ("rod,0,0.9,250", "rod,0,0.9,far", &["2: ", "found `far`", "finite number"]),
            ("rod,1,", "rod,0,", &["4: ", "second position of the marker `rod:mid` at 0"]),
        ],
    );
}

#[test]
fn broken_trackmate_files_are_rejected() {
    broken(
        "spots.csv",
        &[
            ("TRACK_ID", "TRACK", &["1: ", "no column `TRACK_ID`", "Export the spots"]),
            ("POSITION_X", "X_POSITION", &["1: ", "no column `POSITION_X`", "Export the spots"]),
            ("POSITION_Z", "DEPTH", &["1: ", "no column `POSITION_Z`"]),
            ("FRAME,", "FRAMES,", &["1: ", "no column `FRAME`"]),
            ("(pixel)", "(furlong)", &["4: ", "unit (furlong)", "micron, mm"]),
            ("(frame)", "(fortnight)", &["4: ", "time in (fortnight)", "sec, ms"]),
            ("(pixel)", "(mm)", &["scale = 0.001", "lengths in mm"]),
            ("ID0,0,7,3.3,500.5", "ID0,0,7,3.3,far", &["5: ", "found `far`"]),
            (
                "ID0,0,7,3.3,500.5",
                "ID0,0,7,500.5",
                &["5: ", "10 fields", "11 fields, as in the header"],
            ),
            ("ID0,0,2,", "ID0,0,7,", &["second position of the marker `7` at 0"]),
        ],
    );
}

/// In images y points down in any unit; spots with a depth keep the direction of the file.
#[test]
fn trackmate_units_determine_direction_of_y() {
    let tip: Vec<[f64; 2]> = (0..9).map(|k| [500.5 - f64::from(k), -2.25 * f64::from(k)]).collect();
    let files = all(&tip);
    let file = files.iter().find(|f| f.name == "spots.csv").unwrap();
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("spots.csv");
    let text = file.text.replace("(pixel)", "(mm)").replace("(frame)", "(sec)");
    std::fs::write(&path, text.replacen("ID0,0,7,3.3,500.5,0,0,", "ID0,0,7,3.3,500.5,0,3,", 1))
        .unwrap();
    let recording = Recording { marker: Some("7".into()), ..Recording::default() };
    refused(&path, &recording, &["y = \"down\""]);
    let down = Recording { y: Some(Vertical::Down), ..recording };
    let seen = Observation::read_as(&path, &down).unwrap();
    let [first, second] = [0, 1].map(|k| seen.samples[k]);
    // Millimeters of the file, in m.
    assert_eq!(first.position, [500.5, 0.0, 3.0].map(|x| Some(x * 1e-3)));
    assert_eq!((second.time, second.position[1]), (1.0, Some(-2.25 * 1e-3)));
}
