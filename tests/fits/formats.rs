//! Files of motion-capture and video-tracking programs: the same tip gives the same modulus in all formats, and markers, axes
//! and other keys beside a file are as in the file.

use rodfit::fit::{Axes, FitFile, Format, Recording, Vertical};
use rodfit::scene::{InitialState, Material, Recorded, Support, Track};
use rodfit::{Fit, Observation, Parameter, Point, Problem};
use std::path::PathBuf;
use tempfile::TempDir;

use crate::common::fits::same_mesh;
use crate::common::formats::{GAP, Written, all, short_file, tip};
use crate::common::{coarse, straight_rod};
use crate::faulty_files::refused;

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
        let named = file.with_format();
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
    let folder = TempDir::new().unwrap();
    let same = |name: &str, change: &dyn Fn(&str) -> String| {
        let file = &short_file(name);
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
    let folder = TempDir::new().unwrap();
    written(&folder, &short_file("motive.csv"));
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

/// Keys that are not supported together with a file are errors with the allowed keys.
#[test]
fn keys_beside_a_file_are_checked() {
    let folder = TempDir::new().unwrap();
    let case = |name: &str, change: &dyn Fn(&mut Recording), words: &[&str]| {
        let file = &short_file(name);
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
    let file = &short_file("deeplabcut.csv");
    let up = Recording { y: Some(Vertical::Up), ..file.recording.clone() };
    let read = Observation::read_as(written(&folder, file), &up).unwrap().at(Point::Tip);
    assert_eq!(read.samples[1].position[1], Some(2.25 * 1e-3));
}

/// In images y points down in any unit; spots with a depth keep the direction of the file.
#[test]
fn trackmate_units_determine_direction_of_y() {
    let file = &short_file("spots.csv");
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
