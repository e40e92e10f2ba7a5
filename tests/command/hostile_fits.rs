//! Invalid and hostile fit files and recordings: each is rejected with exit code 2 and the name of the fault; long
//! lines are clipped in messages.

use crate::folder::{FIT, SCENE, replaced};
use crate::hostile::{Case, all_are_answered};

const POINT: &str = "point = \"tip\"";
const NAME: &str = "name = \"youngs_modulus\"";

const FITS: &[(&str, &str, &[&str])] = &[
    ("\"scene.toml\"", "3", &["fit.toml", "line 2"]),
    ("\"scene.toml\"", "\"\"", &["No such file"]),
    ("\"scene.toml\"", "\".\"", &["regular file"]),
    ("\"scene.toml\"", "\"fit.toml\"", &["fit.toml"]),
    ("\"scene.toml\"", "\"tip.csv\"", &["tip.csv", "line 1"]),
    ("\"scene.toml\"", "\"/dev/zero\"", &["/dev/zero", "regular file"]),
    ("\"tip.csv\"", "\"scene.toml\"", &["scene.toml"]),
    ("\"tip.csv\"", "\".\"", &["regular file"]),
    ("\"tip.csv\"", "\"tip.csv\\u0000\"", &["tip.csv"]),
    ("\"tip.csv\"", "[\"tip.csv\"]", &["fit.toml"]),
    ("[[parameter]]\nname = \"youngs_modulus\"", "", &["fit.toml", "parameter"]),
    (NAME, "name = \"\"", &["fit.toml", "youngs_modulus"]),
    (NAME, "name = 3", &["fit.toml", "line 9"]),
    (NAME, "name = \"Youngs Modulus\"", &["Youngs Modulus", "youngs_modulus"]),
    (NAME, "name = \"width\"", &["parameter[0].name", "width", "rectang"]),
    (NAME, "name = \"youngs_modulus\"\nstart = nan", &["parameter[0].start", "NaN"]),
    (NAME, "name = \"youngs_modulus\"\nstart = -1", &["parameter[0].start", "-1"]),
    (NAME, "name = \"youngs_modulus\"\nstart = inf", &["parameter[0].start", "inf"]),
    (NAME, "name = \"youngs_modulus\"\nstart = \"soft\"", &["fit.toml", "string"]),
    (NAME, "name = \"youngs_modulus\"\nbounds = [1e7]", &["fit.toml", "line 10"]),
    (NAME, "name = \"youngs_modulus\"\nbounds = [nan, 1e9]", &["parameter[0].bounds"]),
    (NAME, "name = \"youngs_modulus\"\nbounds = [-1, 1e9]", &["parameter[0].bounds"]),
    (NAME, "name = \"youngs_modulus\"\nbounds = [1e9, 1e9]", &["parameter[0].bounds"]),
    (NAME, "name = \"youngs_modulus\"\nprior = { mean = nan, sigma = 1 }", &["parameter[0].prior"]),
    (
        NAME,
        "name = \"youngs_modulus\"\nprior = { mean = 1e8, sigma = -1 }",
        &["parameter[0].prior"],
    ),
    (NAME, "name = \"youngs_modulus\"\nfixed = nan", &["parameter[0].fixed"]),
    (NAME, "name = \"youngs_modulus\"\nfixed = 1e8", &["parameter"]),
    (
        NAME,
        "name = \"youngs_modulus\"\n[[parameter]]\nname = \"youngs_modulus\"",
        &["parameter[1].name"],
    ),
    (NAME, "name = \"youngs_modulus\"\nexperiment = \"none\"", &["parameter[0].experiment"]),
    (POINT, "point = -1", &["fit.toml", "tip"]),
    (POINT, "point = 1.5", &["fit.toml", "tip"]),
    (POINT, "point = 99999999999", &["observation[0].point", "0 .. 20"]),
    (POINT, "point = { arc_length = -0.1 }", &["observation[0].point", "-0.1"]),
    (POINT, "point = { arc_length = nan }", &["observation[0].point", "NaN"]),
    (POINT, "point = { x = 1 }", &["fit.toml", "arc_length"]),
    (POINT, "sigma = 0", &["observation[0].sigma", "found 0"]),
    (POINT, "sigma = nan", &["observation[0].sigma", "NaN"]),
    (POINT, "sigma = inf", &["observation[0].sigma", "inf"]),
    (POINT, "sigma = \"1 mm\"", &["tip.csv:1", "`1 mm` for sigma", "a number"]),
    (POINT, "origin = [0]", &["fit.toml", "line 6"]),
    (POINT, "origin = \"tip\"", &["fit.toml", "line 6"]),
    (POINT, "y = 1", &["fit.toml", "line 6"]),
    (POINT, "time_zero = 1e9", &["tip.csv", "no usable value"]),
    (POINT, "loss = 3", &["fit.toml", "line 6"]),
    (POINT, "loss = \"huberr\"", &["`huberr`", "`huber`"]),
    (POINT, "held_out = \"yes\"", &["fit.toml", "line 6"]),
    ("[[observation]]\nfile = \"tip.csv\"\npoint = \"tip\"", "", &["fit.toml"]),
    ("[[observation]]", "[observation]", &["fit.toml", "line 4"]),
    ("[[observation]]", "[[observations]]", &["`observations`", "`observation`"]),
    ("[[observation]]", "[[shape]]\n[[observation]]", &["fit.toml", "file"]),
    (
        "[[observation]]",
        "[[frequencies]]\nhz = [nan]\nsigma = 1\n[[observation]]",
        &["frequencies[0].hz[0]"],
    ),
    (
        "[[observation]]",
        "[[frequencies]]\nhz = [inf]\nsigma = 1\n[[observation]]",
        &["frequencies[0].hz[0]"],
    ),
    (
        "[[observation]]",
        "[[frequencies]]\nhz = 3\nsigma = 1\n[[observation]]",
        &["fit.toml", "line 5"],
    ),
    (
        "[[observation]]",
        "[[frequencies]]\nhz = [26.3, 4.2]\nsigma = 1\n[[observation]]",
        &["frequencies[0].modes", "4.2000 Hz as mode 2", "rise with the mode number"],
    ),
    (
        "[[observation]]",
        "[[frequencies]]\nhz = [1]\nmodes = [201]\nsigma = 1\n[[observation]]",
        &["frequencies[0].modes[0]", "201"],
    ),
    (
        "[[observation]]",
        "[[frequencies]]\nhz = [1]\nmodes = [1.5]\nsigma = 1\n[[observation]]",
        &["fit.toml", "line 6"],
    ),
    ("[[parameter]]", "[analysis]\nbootstrap = -1\n[[parameter]]", &["fit.toml", "line 9"]),
    ("[[parameter]]", "[analysis]\nbootstrap = 1e9\n[[parameter]]", &["fit.toml", "line 9"]),
    (
        "[[parameter]]",
        "[analysis]\nbootstrap = 1000000000000\n[[parameter]]",
        &["analysis.bootstrap", "1000000000000"],
    ),
    ("[[parameter]]", "[analysis]\nprofile = \"yes\"\n[[parameter]]", &["fit.toml", "line 9"]),
    ("[[parameter]]", "[analysis]\nseed = -1\n[[parameter]]", &["fit.toml", "line 9"]),
    (FIT, "", &["fit.toml", "scene"]),
    (FIT, SCENE, &["fit.toml"]),
];

#[test]
fn faulty_fit_file_exits_with_2_and_names_the_fault() {
    let case = |(from, to, words): &(&str, &str, &[&'static str])| {
        Case::new(format!("fit: {to}"), &["fit", "fit.toml"], 2, words)
            .with("fit.toml", replaced(FIT, from, to))
    };
    all_are_answered(FITS.iter().map(case).collect(), 60);
}

#[test]
fn faulty_recording_exits_with_2_and_names_the_fault() {
    let utf16: Vec<u8> = "t,x\n0,0.5\n".encode_utf16().flat_map(u16::to_le_bytes).collect();
    let cases: Vec<(&str, Vec<u8>, &[&'static str])> = vec![
        ("noise", (0..2000_u32).map(|i| (i * i % 251) as u8).collect(), &["tip.csv:"]),
        ("UTF-16", utf16, &["tip.csv:"]),
        ("NUL", vec![0; 1000], &["tip.csv:1"]),
        ("a header", b"t,x,y\n".to_vec(), &["tip.csv:1", "no value"]),
        ("a comment", b"# t,x,y\n".to_vec(), &["tip.csv:1"]),
        ("line ends", b"\n\n\n".to_vec(), &["tip.csv:1"]),
        ("commas", b",,\n,,\n".to_vec(), &["tip.csv:1"]),
        ("infinite", b"t,x\n0,inf\n1,1\n".to_vec(), &["tip.csv:2", "`x`", "`inf`"]),
        ("overflow", b"t,x\n0,1e999\n1,1\n".to_vec(), &["tip.csv:2", "`x`", "`1e999`"]),
        ("hexadecimal", b"t,x\n0,0x10\n1,1\n".to_vec(), &["tip.csv:2", "`0x10`"]),
        ("decimal commas", b"t,x\n0,0,5\n".to_vec(), &["tip.csv:2", "3 fields"]),
        ("units in fields", b"t,x\n0,5 mm\n".to_vec(), &["tip.csv:2", "`5 mm`"]),
        ("open quote", b"t,x\n0,\"0.5\n0.1,0.4\n".to_vec(), &["tip.csv:2"]),
        ("infinite time", b"t,x\n0,0.5\ninf,0.5\n".to_vec(), &["tip.csv:3", "`t`"]),
        ("no time", b"t,x\nnan,0.5\n".to_vec(), &["tip.csv:2", "time"]),
        ("far time", b"t,x\n0,0.5\n1e300,0.5\n".to_vec(), &["time.end"]),
        ("two times", b"t,time,x\n0,0,0.5\n".to_vec(), &["tip.csv:1", "two time columns"]),
        ("same column", b"t,x,X\n0,1,1\n".to_vec(), &["tip.csv:1", "two columns `x`"]),
        ("unknown unit", b"t[h],x\n0,1\n".to_vec(), &["tip.csv:1", "[h]"]),
        ("no unit", b"t,x[]\n0,1\n".to_vec(), &["tip.csv:1", "[]"]),
        ("kilometres", b"t,x\n0,5e2\n0.1,4e2\n".to_vec(), &["tip.csv", "0.5 m"]),
        ("page", b"<!doctype html><html><body>404</body></html>".to_vec(), &["tip.csv:1"]),
    ];
    let case = |(name, text, words): (&str, Vec<u8>, &[&'static str])| {
        Case::new(format!("recording: {name}"), &["fit", "fit.toml"], 2, words)
            .with("tip.csv", text)
    };
    all_are_answered(cases.into_iter().map(case).collect(), 20);
}

/// Text in the place of the rest of a clipped line.
const LEFT_OUT: &str = "bytes left out";

/// 5 MB without a break are not echoed.
#[test]
fn long_lines_are_clipped_in_messages() {
    let long = "9".repeat(5_000_000);
    let scene = |to: &str| replaced(SCENE, "segments = 20", to).into_bytes();
    let fit = |to: &str| replaced(FIT, NAME, to).into_bytes();
    let cases: Vec<(&'static str, Vec<u8>, &[&'static str])> = vec![
        ("scene.toml", scene(&format!("segments = {long}")), &["scene.toml", "line 3", LEFT_OUT]),
        (
            "scene.toml",
            scene(&format!("a{long} = 1")),
            &["scene.toml", "line 3", LEFT_OUT, "`segments`"],
        ),
        (
            "scene.toml",
            scene(&format!("dimension = \"{long}\"")),
            &["line 3", LEFT_OUT, "`planar`"],
        ),
        ("scene.toml", long.clone().into_bytes(), &["scene.toml", "line 1"]),
        ("fit.toml", fit(&format!("name = \"{long}\"")), &["fit.toml", LEFT_OUT, "youngs_modulus"]),
        ("tip.csv", long.clone().into_bytes(), &["tip.csv:1", LEFT_OUT]),
        (
            "tip.csv",
            format!("t,x\n0,{long}x\n").into_bytes(),
            &["tip.csv:2", LEFT_OUT, "a finite number"],
        ),
        ("tip.csv", format!("t,x[{long}]\n0,1\n").into_bytes(), &["tip.csv:1", LEFT_OUT, "mm"]),
    ];
    let case = |(file, content, words): (&'static str, Vec<u8>, &[&'static str])| {
        Case::new(format!("long: {file}"), &["fit", "fit.toml"], 2, words).with(file, content)
    };
    let faults: Vec<String> = cases.into_iter().map(case).filter_map(|case| case.fault()).collect();
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}
