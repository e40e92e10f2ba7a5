//! What no user means, or means badly: every input here gets an answer within seconds, with the exit code and the words
//! that say what is wrong, and never a panic.

use rayon::prelude::*;
use std::fmt::Write;
use std::process::Output;
use std::time::{Duration, Instant};

use crate::folder::{FIT, Folder, SCENE, stderr};

/// No answer takes longer, on however busy a machine.
const PATIENCE: Duration = Duration::from_secs(60);

/// An input and the answer to it.
struct Case {
    name: String,
    /// Written beside the scene, the fit file and the data, or instead of them.
    files: Vec<(&'static str, Vec<u8>)>,
    arguments: Vec<String>,
    code: i32,
    words: Vec<&'static str>,
}

impl Case {
    fn new(name: impl Into<String>, arguments: &[&str], code: i32, words: &[&'static str]) -> Self {
        let arguments = arguments.iter().map(|a| a.to_string()).collect();
        Self { name: name.into(), files: Vec::new(), arguments, code, words: words.to_vec() }
    }
    fn with(mut self, name: &'static str, content: impl Into<Vec<u8>>) -> Self {
        self.files.push((name, content.into()));
        self
    }

    /// What is wrong with the answer.
    fn fault(&self) -> Option<String> {
        let folder = Folder::new();
        for (name, content) in &self.files {
            std::fs::write(folder.path(name), content).unwrap();
        }
        let arguments: Vec<&str> = self.arguments.iter().map(String::as_str).collect();
        let start = Instant::now();
        let output = match within(PATIENCE, &folder, &arguments) {
            Some(output) => output,
            None => return Some(format!("{}: no answer in {PATIENCE:?}", self.name)),
        };
        let (message, took) = (stderr(&output), start.elapsed());
        let mut faults = String::new();
        if output.status.code() != Some(self.code) {
            write!(faults, " {} instead of {}", output.status, self.code).unwrap();
        }
        for word in self.words.iter().filter(|word| !message.contains(**word)) {
            write!(faults, " no `{word}`").unwrap();
        }
        if message.len() > 5000 {
            write!(faults, " {} bytes of message", message.len()).unwrap();
        }
        if self.code != 0 && !arguments.is_empty() && !message.contains("error: ") {
            faults += " no error";
        }
        let shown: String = message.chars().take(600).collect();
        (!faults.is_empty()).then(|| format!("{}, {took:.1?}:{faults}\n    {shown}", self.name))
    }
}

/// Runs the command, and ends it if it takes too long.
fn within(time: Duration, folder: &Folder, arguments: &[&str]) -> Option<Output> {
    let mut command = folder.command(arguments);
    // Into files, as nobody reads pipes while it runs.
    let file = |name: &str| std::fs::File::create(folder.path(name)).unwrap();
    let mut child = command.stdout(file("stdout")).stderr(file("stderr")).spawn().unwrap();
    let start = Instant::now();
    let status = loop {
        match child.try_wait().unwrap() {
            Some(status) => break status,
            None if start.elapsed() > time => {
                child.kill().unwrap();
                child.wait().unwrap();
                return None;
            }
            None => std::thread::sleep(Duration::from_millis(5)),
        }
    };
    let read = |name: &str| std::fs::read(folder.path(name)).unwrap();
    Some(Output { status, stdout: read("stdout"), stderr: read("stderr") })
}

fn all_are_answered(cases: Vec<Case>, least: usize) {
    assert!(cases.len() >= least, "{} cases", cases.len());
    let faults: Vec<String> = cases.par_iter().filter_map(Case::fault).collect();
    assert!(faults.is_empty(), "{} of {}:\n{}", faults.len(), cases.len(), faults.join("\n"));
}

/// A text with a part replaced.
fn replaced(text: &str, from: &str, to: &str) -> String {
    assert!(text.contains(from), "{from}");
    text.replace(from, to)
}

const LENGTH: &str = "length = 0.5";
const SHAPE: &str = "{ kind = \"straight\", length = 0.5, direction = [1, 0, 0] }";
const SECTION: &str = "{ kind = \"circle\", radius = 0.005 }";
const GRAVITY: &str = "gravity = [0, -9.8, 0]";
const TIME: &str = "[time]";

/// A part of the scene, what stands there instead, and words of the answer.
const SCENES: &[(&str, &str, &[&str])] = &[
    // Numbers of the wrong kind.
    ("segments = 20", "segments = 20.5", &["scene.toml", "line 3", "20.5"]),
    ("segments = 20", "segments = 1e3", &["scene.toml", "line 3"]),
    ("segments = 20", "segments = 99999999999999999999", &["scene.toml", "line 3"]),
    ("segments = 20", "segments = true", &["scene.toml", "line 3"]),
    ("segments = 20", "segments = [20]", &["scene.toml", "line 3"]),
    ("segments = 20", "segments = 20\nsegments = 30", &["scene.toml", "line 4", "segments"]),
    (LENGTH, "length = nan", &["rod.shape.length", "NaN"]),
    (LENGTH, "length = inf", &["rod.shape.length", "inf"]),
    (LENGTH, "length = -inf", &["rod.shape.length", "-inf"]),
    (LENGTH, "length = \"0.5\"", &["scene.toml", "string"]),
    (LENGTH, "length = 0", &["rod.shape.length", "found 0"]),
    (LENGTH, "length = -0.0", &["rod.shape.length", "found -0"]),
    (LENGTH, "length = 1e-320", &["scene.toml"]),
    ("[1, 0, 0]", "[1, 0]", &["scene.toml", "line 4"]),
    ("[1, 0, 0]", "[nan, 0, 0]", &["rod.shape.direction", "NaN"]),
    ("[1, 0, 0]", "[inf, 0, 0]", &["rod.shape.direction", "inf"]),
    ("[1, 0, 0]", "[\"x\", 0, 0]", &["scene.toml", "line 4"]),
    ("[1, 0, 0]", "\"x\"", &["scene.toml", "line 4"]),
    ("[1, 0, 0]", "[1e200, 1e200, 0]", &["rod.shape.direction"]),
    ("density = 1273.52", "density = 0", &["material.density", "found 0"]),
    ("density = 1273.52", "density = -1", &["material.density", "found -1"]),
    ("density = 1273.52", "density = nan", &["material.density", "NaN"]),
    ("density = 1273.52", "density = \"steel\"", &["scene.toml", "string"]),
    ("density = 1273.52", "density = 1e-320", &["scene.toml"]),
    ("= 1e8", "= -1e8", &["material.youngs_modulus", "-1"]),
    ("= 1e8", "= nan", &["material.youngs_modulus", "NaN"]),
    ("= 1e8", "= inf", &["material.youngs_modulus", "inf"]),
    ("= 1e8", "= 1e-320", &["scene.toml"]),
    ("= 1e8", "= \"soft\"", &["scene.toml", "string"]),
    ("poisson_ratio = 0.5", "poisson_ratio = nan", &["material.poisson_ratio", "NaN"]),
    ("poisson_ratio = 0.5", "poisson_ratio = inf", &["material.poisson_ratio", "inf"]),
    ("poisson_ratio = 0.5", "poisson_ratio = 0.50001", &["material.poisson_ratio", "0.50001"]),
    ("poisson_ratio = 0.5", "shear_modulus = 0", &["material.shear_modulus", "found 0"]),
    ("poisson_ratio = 0.5", "shear_modulus = nan", &["material.shear_modulus", "NaN"]),
    // Sections.
    (SECTION, "{ kind = \"circle\" }", &["scene.toml", "radius"]),
    (SECTION, "{ radius = 0.005 }", &["scene.toml", "kind"]),
    (SECTION, "0.005", &["scene.toml", "line 5"]),
    (SECTION, "{ kind = \"circle\", radius = \"5 mm\" }", &["scene.toml", "line 5"]),
    (SECTION, "{ kind = \"circle\", radius = 1e200 }", &["scene.toml", "section"]),
    (SECTION, "{ kind = \"rectangle\", height = 0.01, up = [0, 1, 0] }", &["width"]),
    (
        SECTION,
        "{ kind = \"rectangle\", width = 0, height = 0.01, up = [0, 1, 0] }",
        &["rod.section.width", "found 0"],
    ),
    (
        SECTION,
        "{ kind = \"rectangle\", width = 0.01, height = inf, up = [0, 1, 0] }",
        &["rod.section.height", "inf"],
    ),
    (
        SECTION,
        "{ kind = \"rectangle\", width = 0.01, height = 0.01, up = [1, 0, 0] }",
        &["rod.section.up"],
    ),
    (
        SECTION,
        "{ kind = \"rectangle\", width = 0.01, height = 0.01, up = [0, 0, 0] }",
        &["rod.section.up"],
    ),
    (
        SECTION,
        "{ kind = \"custom\", area = nan, i1 = 1e-9, i2 = 1e-9, j = 1e-9, up = [0, 1, 0] }",
        &["rod.section.area", "NaN"],
    ),
    (
        SECTION,
        "{ kind = \"custom\", area = 1e-4, i1 = -1e-9, i2 = 1e-9, j = 1e-9, up = [0, 1, 0] }",
        &["rod.section.i1", "-"],
    ),
    // Shapes.
    (SHAPE, "{ kind = \"straight\" }", &["scene.toml", "length"]),
    (SHAPE, "\"straight\"", &["scene.toml", "line 4"]),
    (SHAPE, "{ kind = \"arc\", length = 0, angle = 1 }", &["rod.shape.length", "found 0"]),
    (SHAPE, "{ kind = \"arc\", length = 0.5, angle = nan }", &["rod.shape.angle", "NaN"]),
    (SHAPE, "{ kind = \"arc\", length = 0.5 }", &["scene.toml", "angle"]),
    (
        SHAPE,
        "{ kind = \"arc\", length = 0.5, angle = 1e9 }",
        &["rod.segments", "found 20", "half a turn"],
    ),
    (
        SHAPE,
        "{ kind = \"helix\", length = 0.5, radius = 0, pitch = 0.05, axis = [0, 0, 1], handedness = \"left\" }",
        &["rod.shape.radius", "found 0"],
    ),
    (
        SHAPE,
        "{ kind = \"helix\", length = 0.5, radius = 0.02, pitch = -1, axis = [0, 0, 1], handedness = \"left\" }",
        &["rod.shape.pitch", "found -1"],
    ),
    (
        SHAPE,
        "{ kind = \"helix\", length = 0.5, radius = 0.02, pitch = 0.05, axis = [0, 0, 0], handedness = \"left\" }",
        &["rod.shape.axis", "non-zero"],
    ),
    (
        SHAPE,
        "{ kind = \"helix\", length = 0.5, radius = 0.02, pitch = 0.05, axis = [0, 0, 1], handedness = \"up\" }",
        &["scene.toml", "left", "right"],
    ),
    (
        SHAPE,
        "{ kind = \"helix\", length = 0.5, radius = 1e-200, pitch = 1e-200, axis = [0, 0, 1], handedness = \"left\" }",
        &["rod.segments", "found 20", "half a turn"],
    ),
    ("segments = 20\nshape = {", "shape = { kind = \"polyline\" } #", &["scene.toml", "file"]),
    ("segments = 20\nshape = {", "shape = { kind = \"polyline\", file = 3 } #", &["scene.toml"]),
    (
        "segments = 20\nshape = {",
        "shape = { kind = \"polyline\", file = \".\" } #",
        &["allowed: a regular file"],
    ),
    (
        "segments = 20\nshape = {",
        "shape = { kind = \"polyline\", file = \"/dev/zero\" } #",
        &["/dev/zero", "allowed: a regular file"],
    ),
    (
        "segments = 20\nshape = {",
        "shape = { kind = \"polyline\", file = \"scene.toml\" } #",
        &["scene.toml:"],
    ),
    ("segments = 20", "segments = 20\ndimension = \"2d\"", &["`planar`", "`spatial`"]),
    ("segments = 20", "segments = 20\ndiscretization = 1", &["scene.toml", "line 4"]),
    (
        "segments = 20",
        "segments = 20\nnatural_curvature = []",
        &["rod.natural_curvature", "one finite number or more"],
    ),
    ("segments = 20", "segments = 20\nnatural_curvature = \"much\"", &["scene.toml", "a number"]),
    ("segments = 20", "segments = 20\nnatural_twist = nan", &["rod.natural_twist", "NaN"]),
    // Loads.
    (GRAVITY, "gravity = 9.8", &["scene.toml", "line 13"]),
    (GRAVITY, "gravity = \"down\"", &["scene.toml", "line 13"]),
    (GRAVITY, "gravity = [0, -inf, 0]", &["loads.gravity", "inf"]),
    (GRAVITY, "gravity = [[0], [0], [0]]", &["scene.toml", "line 13"]),
    (GRAVITY, "gravty = [0, -9.8, 0]", &["gravty", "gravity"]),
    (GRAVITY, "damping = 3", &["scene.toml", "line 13"]),
    (GRAVITY, "damping = { mass = nan }", &["loads.damping.mass", "NaN"]),
    (GRAVITY, "damping = { stiffness = -1 }", &["loads.damping.stiffness", "-1"]),
    (GRAVITY, "damping = { stiffness = inf }", &["loads.damping.stiffness", "inf"]),
    (GRAVITY, "damping = { viscous = 1 }", &["viscous", "stiffness"]),
    (TIME, "[[loads.point]]\nnode = -1\nforce = [0, 1, 0]\n[time]", &["scene.toml", "tip"]),
    (TIME, "[[loads.point]]\nnode = 1.5\nforce = [0, 1, 0]\n[time]", &["scene.toml", "tip"]),
    (TIME, "[[loads.point]]\nforce = [0, 1, 0]\n[time]", &["scene.toml", "node"]),
    (
        TIME,
        "[[loads.point]]\nnode = \"tip\"\nforce = [nan, 1, 0]\n[time]",
        &["loads.point[0].force", "NaN"],
    ),
    (
        TIME,
        "[[loads.point]]\nnode = \"tip\"\nmoment = [0, 0, inf]\n[time]",
        &["loads.point[0].moment", "inf"],
    ),
    (
        TIME,
        "[[loads.point]]\nnode = 99999999999\nforce = [0, 1, 0]\n[time]",
        &["loads.point[0].node", "99999999999", "0 .. 20"],
    ),
    // Supports.
    (TIME, "[supports]\nstart = \"glued\"\n[time]", &["glued", "`clamped`"]),
    (TIME, "[supports]\nclamp = \"edge\"\n[time]", &["`edge`", "`mid-edge`"]),
    (TIME, "[supports]\nangle = nan\n[time]", &["supports.angle", "NaN"]),
    (TIME, "[supports]\nangle = \"up\"\n[time]", &["scene.toml", "string"]),
    (TIME, "[supports]\nend = \"roller\"\nroller = [0, 0, 0]\n[time]", &["supports.roller"]),
    (TIME, "[supports]\nend = \"roller\"\nroller = [nan, 0, 0]\n[time]", &["supports.roller"]),
    (
        TIME,
        "[[supports.motion]]\nend = \"middle\"\nramp = 1\n[time]",
        &["`middle`", "`start`", "`end`"],
    ),
    (TIME, "[[supports.motion]]\nend = \"start\"\nramp = -1\n[time]", &["supports.motion[0].ramp"]),
    (
        TIME,
        "[[supports.motion]]\nend = \"start\"\nramp = nan\n[time]",
        &["supports.motion[0].ramp"],
    ),
    (
        TIME,
        "[[supports.motion]]\nend = \"start\"\nfrequency = inf\n[time]",
        &["supports.motion[0].frequency"],
    ),
    (
        TIME,
        "[[supports.motion]]\nend = \"start\"\nramp = 1\ndisplacement = [nan, 0, 0]\n[time]",
        &["supports.motion[0].displacement", "NaN"],
    ),
    // The start, the camera, the clock.
    (TIME, "[initial]\nvelocity = [0, nan, 0]\n[time]", &["initial.velocity", "NaN"]),
    (TIME, "[initial]\nangular_velocity = [0, 0, inf]\n[time]", &["initial.angular_velocity"]),
    (TIME, "[initial]\nstate = 1\n[time]", &["scene.toml", "line 16"]),
    (TIME, "[camera]\ntime_offset = nan\n[time]", &["camera.time_offset", "NaN"]),
    (TIME, "[camera]\nzoom = 2\n[time]", &["zoom", "time_offset"]),
    (TIME, "[timing]", &["timing", "time"]),
    ("end = 0.3", "end = 0", &["time.end", "found 0"]),
    ("end = 0.3", "end = nan", &["time.end", "NaN"]),
    ("end = 0.3", "end = inf", &["time.end", "inf"]),
    ("end = 0.3", "end = 1e308", &["time", "1e9 steps"]),
    ("end = 0.3", "end = \"1 s\"", &["scene.toml", "string"]),
    ("step = 2e-3", "step = nan", &["time.step", "NaN"]),
    ("step = 2e-3", "step = -1e-3", &["time.step", "-0.001"]),
    ("step = 2e-3", "step = 1e-320", &["time.step", "1e9 steps"]),
    ("beta = 0.5", "beta = nan", &["time.beta", "NaN"]),
    ("beta = 0.5", "beta = -1", &["time.beta", "-1"]),
    ("beta = 0.5", "scheme = \"\"", &["newmark-beta"]),
    ("beta = 0.5", "scheme = [\"verlet\"]", &["scene.toml"]),
    // The file itself.
    ("[rod]", "[rods]", &["rod"]),
    ("[rod]", "[[rod]]", &["scene.toml"]),
    ("[rod]", "[rod", &["scene.toml", "line 2"]),
    ("[rod]", "[rod]\n\"\" = 1", &["scene.toml", "line 3"]),
    ("[rod]", "[rod]\nshape.kind = \"arc\"", &["scene.toml"]),
    ("[material]", "[rod]", &["scene.toml", "rod"]),
    ("[material]", "material = 1\n[x]", &["scene.toml"]),
    (SCENE, "", &["scene.toml", "rod"]),
    (SCENE, "rod = 1\nmaterial = 2\n", &["scene.toml"]),
    (SCENE, "\u{0}", &["scene.toml", "line 1"]),
    (SCENE, "{\"rod\": {\"segments\": 20}}", &["scene.toml", "line 1"]),
    (SCENE, "# nothing but a comment", &["scene.toml", "rod"]),
];

#[test]
fn scenes() {
    let case = |(from, to, words): &(&str, &str, &[&'static str])| {
        Case::new(format!("scene: {to}"), &["simulate", "scene.toml"], 2, words)
            .with("scene.toml", replaced(SCENE, from, to))
    };
    all_are_answered(SCENES.iter().map(case).collect(), 100);
}

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
    (POINT, "sigma = \"1 mm\"", &["fit.toml", "string"]),
    (POINT, "origin = [0]", &["fit.toml", "line 6"]),
    (POINT, "origin = \"tip\"", &["fit.toml", "line 6"]),
    (POINT, "y = 1", &["fit.toml", "line 6"]),
    (POINT, "time_zero = 1e9", &["tip.csv", "no value"]),
    (POINT, "loss = 3", &["fit.toml", "line 6"]),
    (POINT, "loss = \"huberr\"", &["`huberr`", "`huber`"]),
    (POINT, "held_out = \"yes\"", &["fit.toml", "line 6"]),
    (POINT, "held_out = true", &["observation", "not held out"]),
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
    (FIT, "", &["fit.toml", "parameter"]),
    (FIT, SCENE, &["fit.toml"]),
];

#[test]
fn fits() {
    let case = |(from, to, words): &(&str, &str, &[&'static str])| {
        Case::new(format!("fit: {to}"), &["fit", "fit.toml"], 2, words)
            .with("fit.toml", replaced(FIT, from, to))
    };
    all_are_answered(FITS.iter().map(case).collect(), 60);
}

#[test]
fn recordings() {
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
        ("two times", b"t,time,x\n0,0,0.5\n".to_vec(), &["tip.csv:1", "two clocks"]),
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

/// What is said of a line that is not shown whole.
const LEFT_OUT: &str = "bytes left out";

/// 50 MB without a break are not echoed.
#[test]
fn long_lines() {
    let long = "9".repeat(50_000_000);
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
    // One after the other: together they would take a gigabyte.
    let faults: Vec<String> = cases.into_iter().map(case).filter_map(|case| case.fault()).collect();
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

#[test]
fn command_lines() {
    let name = "x".repeat(4000);
    let long = ["simulate", &name];
    let cases: Vec<(&[&str], i32, &[&'static str])> = vec![
        (&[], 2, &["Usage"]),
        (&["simulat", "scene.toml"], 2, &["simulat"]),
        (&["simulate"], 2, &["SCENE"]),
        (&["simulate", "scene.toml", "scene.toml"], 2, &["scene.toml"]),
        (&["simulate", "scene.toml", "--fast"], 2, &["--fast"]),
        (&["simulate", "scene.toml", "--json"], 2, &["--json"]),
        (&["simulate", "scene.toml", "--derivatives", "auto"], 2, &["auto", "hand", "dual"]),
        (&["modes", "scene.toml", "--count", "-1"], 2, &["-1"]),
        (&["modes", "scene.toml", "--count", "201"], 2, &["201"]),
        (&["modes", "scene.toml", "--count", "ten"], 2, &["ten"]),
        (&["simulate", ""], 2, &["SCENE"]),
        (&["simulate", "-"], 2, &["-: ", "No such file"]),
        (&["simulate", "."], 2, &["regular file"]),
        (&["simulate", "scene.toml/"], 2, &["scene.toml/"]),
        (&["simulate", "no\nsuch\nfile"], 2, &["No such file"]),
        (&["simulate", "/dev/null"], 2, &["/dev/null", "regular file"]),
        (&["simulate", "/dev/zero"], 2, &["/dev/zero", "regular file"]),
        (&["simulate", "tip.csv"], 2, &["tip.csv", "line 1"]),
        (&["simulate", "fit.toml"], 2, &["fit.toml"]),
        (&long, 2, &["too long"]),
        (&["static", "fit.toml"], 2, &["fit.toml"]),
        (&["modes", "absent.toml"], 2, &["absent.toml", "No such file"]),
        (&["check", "tip.csv"], 2, &["tip.csv"]),
        (&["study", "/dev/zero"], 2, &["/dev/zero"]),
        (&["fit", "scene.toml"], 2, &["scene.toml"]),
        (&["fit", "tip.csv"], 2, &["tip.csv", "line 1"]),
        (&["fit", "."], 2, &["regular file"]),
        (&["fit", "/dev/zero"], 2, &["/dev/zero"]),
        // Nothing comes through this pipe, and it ends.
        (&["simulate", "/dev/stdin"], 2, &["/dev/stdin"]),
    ];
    let case = |(arguments, code, words): &(&[&str], i32, &[&'static str])| {
        Case::new(format!("{arguments:.60?}"), arguments, *code, words)
    };
    all_are_answered(cases.iter().map(case).collect(), 25);
}

/// What would take all memory, a night or a year is refused, with the estimate and the limit.
#[test]
fn boundless_runs() {
    let fine = |n: u32| replaced(SCENE, "segments = 20", &format!("segments = {n}"));
    let in_space = |n: u32| format!("segments = {n}\ndimension = \"spatial\"");
    let in_space = |n: u32| replaced(SCENE, "segments = 20", &in_space(n));
    let step = |step: &str| replaced(SCENE, "step = 2e-3", &format!("step = {step}"));
    let memory: &[&'static str] =
        &["rod.segments", "nodes", "GB of memory", "up to 4.0 GB", "--force"];
    let time: &[&'static str] = &["time.step", "steps of 21 nodes", "up to 60 min", "--force"];
    let at = |text: String, arguments: &[&str], words: &[&'static str]| {
        Case::new(format!("{arguments:?}"), arguments, 2, words).with("scene.toml", text)
    };
    let experiment = |i: usize| format!("[[experiment]]\nname = \"{i}\"\nscene = \"scene.toml\"\n");
    let many: String = (0..100_000).map(experiment).collect();
    let parameter = "[[parameter]]\nname = \"youngs_modulus\"\n";
    let named = |name: &str| replaced(&experiment(0), "\"0\"", &format!("\"{name}\""));
    let experiments = |text: &str, words: &[&'static str]| {
        Case::new("experiments", &["fit", "fit.toml"], 2, words)
            .with("fit.toml", format!("{text}{parameter}"))
    };
    let mut cases = vec![
        at(fine(10_000_000), &["simulate", "scene.toml"], memory),
        at(fine(10_000_000), &["static", "scene.toml"], memory),
        at(fine(10_000_000), &["modes", "scene.toml"], memory),
        at(fine(10_000_000), &["check", "scene.toml"], memory),
        at(fine(10_000_000), &["study", "scene.toml"], &["GB of memory", "--force"]),
        at(fine(10_000_000), &["fit", "fit.toml"], memory),
        at(fine(1_000_000), &["modes", "scene.toml", "--count", "200"], memory),
        at(in_space(3_000_000), &["simulate", "scene.toml"], memory),
        at(in_space(2_000_000), &["static", "scene.toml"], memory),
        at(step("1e-9"), &["simulate", "scene.toml", "--json", "-"], &["GB", "--force"]),
        at(step("1e-8"), &["fit", "fit.toml"], &["fit.toml", "scene", "steps", "60 min"]),
        at(step("1e-7"), &["study", "scene.toml"], &["time.step", "--force"]),
        at(replaced(&step("1e-6"), "end = 0.3", "end = 900"), &["simulate", "scene.toml"], time),
        at(
            replaced(&step("1e-4"), "end = 0.3", "end = 3000"),
            &["simulate", "scene.toml", "--out", "nodes.csv"],
            &["GB of disk", "up to 10.0 GB", "--force"],
        ),
        experiments(&many, &["fit.toml", "experiment", "found 100000", "up to 1000"]),
        experiments(&named(&"n".repeat(101)), &["experiment[0].name", "up to 100 characters"]),
    ];
    let nodes: String = (0..2_000_000).map(|i| format!("{i},0,0.00000000000000\n")).collect();
    cases.push(
        at(
            replaced(
                SCENE,
                "segments = 20\nshape = {",
                "shape = { kind = \"polyline\", file = \"rest.csv\" } #",
            ),
            &["static", "scene.toml"],
            memory,
        )
        .with("rest.csv", format!("x,y,z\n{}", nodes.repeat(2))),
    );
    all_are_answered(cases, 15);
}

/// A pipe into which nobody writes is not waited for.
#[cfg(target_os = "linux")]
#[test]
fn pipes_without_a_writer() {
    let folder = Folder::new();
    let pipe = folder.path("pipe");
    assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    folder.write("piped.toml", &replaced(FIT, "scene.toml", "pipe"));
    folder.write("data.toml", &replaced(FIT, "tip.csv", "pipe"));
    let runs = [
        ["simulate", "pipe"],
        ["static", "pipe"],
        ["fit", "pipe"],
        ["fit", "piped.toml"],
        ["fit", "data.toml"],
    ];
    for arguments in runs {
        let output = within(PATIENCE, &folder, &arguments).expect("an answer");
        crate::folder::refused(&output, &["pipe", "regular file", "/dev/stdin"]);
    }
    // What a shell hands over is read.
    let shell = |text: &str| {
        let line = format!("{text} | \"$0\" simulate /dev/stdin -q");
        let mut command = std::process::Command::new("sh");
        command.args(["-c", &line, env!("CARGO_BIN_EXE_rodfit")]).current_dir(folder.path(""));
        command.output().unwrap()
    };
    assert_eq!(shell("cat scene.toml").status.code(), Some(0));
    let output = shell("cat /dev/zero");
    crate::folder::refused(&output, &["/dev/stdin", "more than 100 MB"]);
}

/// As many threads as are of use.
#[test]
fn threads_by_the_hundred_thousand() {
    let folder = Folder::new();
    let mut command = folder.command(&["fit", "fit.toml"]);
    let output = command.env("RAYON_NUM_THREADS", "100000").output().unwrap();
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    assert!(
        stderr(&output).contains("RAYON_NUM_THREADS = 100000; 256 threads"),
        "{}",
        stderr(&output)
    );
}
