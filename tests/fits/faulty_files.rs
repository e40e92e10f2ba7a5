//! Faulty files of motion-capture and video-tracking programs are rejected with the line and a remedy.

use rodfit::Observation;
use rodfit::fit::Recording;
use std::path::Path;
use tempfile::TempDir;

use crate::common::formats::short_file;

/// Requires that the file is rejected with its path, a line and all words.
pub fn refused(path: &Path, recording: &Recording, words: &[&str]) {
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
    let file = &short_file(name);
    let folder = TempDir::new().unwrap();
    let path = folder.path().join(name);
    let named = file.with_format();
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
