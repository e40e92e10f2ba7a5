//! Invalid scenes, polylines, lists and columns are rejected with exit code 2 and one message: key, found value,
//! allowed values.

use crate::folder::{FIT, Folder, SCENE, change, polyline, refused, stderr, stdout, succeeds};

/// All kinds of invalid scenes: the error names the key, the found value and the allowed values.
#[test]
fn invalid_scene_is_rejected() {
    let cases: Vec<(String, &[&str])> = vec![
        (change("segments = 20", "sgements = 20"), &["sgements", "line 3", "segments"]),
        (change("beta = 0.5", "beta = 0.5\ntheta = 1"), &["theta", "beta"]),
        (change("density = 1273.52", ""), &["line 7: missing key: material.density"]),
        (
            change("step = 2e-3", "step = 2e-3").replace("end =", "# end ="),
            &["time.end", "inf, or none"],
        ),
        (format!("accuracy = 2.0\n{SCENE}"), &["accuracy", "found 2", "1e-8 .. 0.1"]),
        (change("segments = 20", "segments = \"many\""), &["line 3", "string"]),
        (change("segments = 20", "segments = -4"), &["line 3", "-4"]),
        (change("segments = 20", "segments = 0"), &["rod.segments", "found 0", "2 .. 1e7"]),
        (change("segments = 20", "segments = 1"), &["rod.segments", "found 1", "2 .. 1e7"]),
        (change("segments = 20", "segments = 1000000000"), &["rod.segments", "1000000000", "1e7"]),
        (change("radius = 0.005", "radius = -0.005"), &["rod.section.radius", "-0.005"]),
        (change("radius = 0.005", "radius = nan"), &["rod.section.radius", "NaN"]),
        (change("radius = 0.005", "radius = 0"), &["rod.section.radius", "found 0"]),
        (change("radius = 0.005", "radius = 1e-170"), &["rod.section"]),
        (change("radius = 0.005", "radius = 0.005, width = 1"), &["width"]),
        (change("\"circle\"", "\"oval\""), &["oval", "circle"]),
        (change("density = 1273.52", "density = inf"), &["material.density", "inf"]),
        (change("youngs_modulus = 1e8", "youngs_modulus = 0.0"), &["material.youngs_modulus"]),
        (
            change("poisson_ratio = 0.5", "poisson_ratio = 0.6"),
            &["material.poisson_ratio", "0.6", "(-1, 0.5]"],
        ),
        (change("poisson_ratio = 0.5", "poisson_ratio = -1.0"), &["material.poisson_ratio", "-1"]),
        (
            change("poisson_ratio = 0.5", "poisson_ratio = 0.5\nshear_modulus = 1e7"),
            &["shear_modulus", "one of the two"],
        ),
        (change("beta = 0.5", "beta = 0.49"), &["time.beta", "0.49", "[0.5, 1]"]),
        (change("beta = 0.5", "beta = 1.01"), &["time.beta", "1.01"]),
        (
            change("direction = [1, 0, 0]", "direction = [0, 0, 0]"),
            &["rod.shape.direction", "non-zero"],
        ),
        (change("length = 0.5", "length = -1.0"), &["rod.shape.length", "-1"]),
        (change("step = 2e-3", "step = 0"), &["time.step", "found 0"]),
        (change("step = 2e-3", "step = 1e-10"), &["time.step", "1e9 steps"]),
        (change("end = 0.3", "end = -0.3"), &["time.end", "-0.3"]),
        (change("beta = 0.5", "scheme = \"verlet\""), &["verlet", "newmark-beta"]),
        (SCENE.split("[time]").next().unwrap().to_string(), &["time", "[time] with end"]),
        (change("[0, -9.8, 0]", "[0, -9.8]"), &["gravity"]),
        (change("[0, -9.8, 0]", "[0, nan, 0]"), &["loads.gravity", "NaN"]),
        (change("gravity", "damping = { mass = -1.0 }\ngravity"), &["loads.damping.mass", "-1"]),
        (
            change("[time]", "[[loads.point]]\nnode = 21\nforce = [0, 1, 0]\n[time]"),
            &["loads.point[0].node", "21", "0 .. 20"],
        ),
        (change("[time]", "[[loads.point]]\nnode = \"top\"\nforce = [0, 1, 0]\n[time]"), &["tip"]),
        (change("[time]", "[supports]\nend = \"wheel\"\n[time]"), &["wheel", "roller"]),
        (
            change("[time]", "[supports]\nstart = \"roller\"\nend = \"roller\"\n[time]"),
            &["supports.end", "second roller"],
        ),
        (
            change("[time]", "[supports]\nroller = [1, 0, 0]\n[time]"),
            &["supports.roller", "no end that rolls"],
        ),
        (
            change("[time]", "[[supports.motion]]\nend = \"end\"\nramp = 1.0\n[time]"),
            &["supports.motion[0].end", "clamped, pinned or recorded"],
        ),
        (
            change(
                "[time]",
                "[[supports.motion]]\nend = \"start\"\ndisplacement = [0.1, 0, 0]\n[time]",
            ),
            &["supports.motion[0]", "ramp or frequency"],
        ),
        (
            change(
                "[time]",
                "[[supports.motion]]\nend = \"start\"\nramp = 1.0\nfrequency = 2.0\n[time]",
            ),
            &["supports.motion[0].frequency", "one of the two"],
        ),
        (
            change(
                "[time]",
                "[[supports.motion]]\nend = \"start\"\nramp = 0.0\ntwist = 1.0\n[time]",
            ),
            &["supports.motion[0].ramp", "above 0"],
        ),
        (
            change(
                "[time]",
                "[supports]\nstart = \"pinned\"\n[[supports.motion]]\nend = \"start\"\nramp = 1.0\n\
                 rotation = [0, 0, 1]\n[time]",
            ),
            &["supports.motion[0].rotation", "clamped"],
        ),
        (
            change("[time]", "[initial]\nstate = \"shape\"\n[time]"),
            &["initial.shape", "no such key"],
        ),
        (
            change(
                "[time]",
                "[initial]\nshape = { kind = \"arc\", length = 0.5, angle = 1.0 }\n[time]",
            ),
            &["initial.shape", "state"],
        ),
        (
            change(
                "[time]",
                "[initial]\nstate = \"shape\"\n\
                 shape = { kind = \"arc\", length = -0.5, angle = 1.0 }\n[time]",
            ),
            &["initial.shape.length", "above 0"],
        ),
        (
            change("poisson_ratio = 0.5\n", "")
                .replace("[time]", "[[loads.point]]\nnode = \"tip\"\nforce = [0, 0, 1]\n[time]"),
            &["spatial", "loads.point[0].force", "poisson_ratio"],
        ),
        (
            change("segments = 20", "segments = 20\ndimension = \"planar\"")
                .replace("[time]", "[[loads.point]]\nnode = \"tip\"\nforce = [0, 0, 1]\n[time]"),
            &["rod.dimension", "loads.point[0].force leaves the plane"],
        ),
        (
            change("[time]", "[[initial.point]]\nnode = \"tip\"\nforce = [0, 1, 0]\n[time]"),
            &["initial.point", "equilibrium"],
        ),
        (change("[time]", "[initial]\nstate = \"moving\"\n[time]"), &["moving", "equilibrium"]),
        (
            change("beta = 0.5", "beta = 0.5\nscheme = \"average-vector-field\""),
            &["time.beta", "newmark-beta only"],
        ),
        (
            change("beta = 0.5", "scheme = \"verlet\""),
            &["time.step", "found 0.002", "up to 9.", "e-5 s with verlet", "rodas4"],
        ),
        (
            change("beta = 0.5", "scheme = \"rodas4\"")
                .replace("[time]", "[loads.damping]\nstiffness = 1e-3\n[time]"),
            &["loads.damping.stiffness", "found 0.001", "0 with rodas4", "newmark-beta"],
        ),
        (change("beta = 0.5", "scheme = \"euler\""), &["euler", "rodas4", "verlet", "pefrl"]),
        (
            change("segments = 20", "segments = 20\nnatural_curvature = inf"),
            &["rod.natural_curvature", "inf"],
        ),
        (
            change("segments = 20", "segments = 20\ndiscretization = \"exact\""),
            &["exact", "corrected", "paper"],
        ),
        (polyline(), &["rest.csv", "No such file"]),
        ("[rod".to_string(), &["line 1"]),
    ];
    let folder = Folder::new();
    for (text, words) in cases {
        folder.write("scene.toml", &text);
        let output = folder.run(&["simulate", "scene.toml"]);
        refused(&output, words);
        assert!(
            stderr(&output).contains("scene.toml") || stderr(&output).contains("rest.csv"),
            "{}",
            stderr(&output)
        );
    }
    refused(&folder.run(&["simulate", "absent.toml"]), &["absent.toml", "No such file"]);
    refused(&folder.run(&["simulate", "scene.toml", "--out", "no/such/folder.csv"]), &["line 1"]);
    folder.write("scene.toml", SCENE);
    refused(
        &folder.run(&["simulate", "scene.toml", "--out", "no/such/folder.csv"]),
        &["no/such/folder.csv"],
    );
}

#[test]
fn invalid_polyline_is_rejected() {
    let folder = Folder::new();
    let shape = polyline();
    folder.write("scene.toml", &shape);
    for (rest, words) in [
        ("x,y\n0,0\n1,0\n2,0\n", &["rest.csv:1", "no column `z`"][..]),
        ("x,y,z\n0,0,0\n1,0,0\n", &["rest.csv:1", "at least 3"]),
        ("x,y,z\n0,0,0\n1,,0\n2,0,0\n", &["rest.csv:3", "blank"]),
        ("x,y,z\n0,0,0\n1,0,0\n1,0,0\n2,0,0\n", &["rest.csv:4", "same point"]),
        ("x,y,z\n0,0,0\n1,0,0\n0.5,0,0\n2,0,0\n", &["rest.csv:3", "180 degrees", "up to 90"]),
        ("x,y,z\n0,0,0\n1,0,0\n2,1,0\n2,1,1\n2,1,0\n", &["rest.csv:5", "180 degrees", "up to 90"]),
        ("x[in],y,z\n0,0,0\n1,0,0\n2,0,0\n", &["rest.csv:1", "unit [in] of `x`", "m, cm, mm"]),
        ("x,y,z,s\n0,0,0,0\n1,0,0,1\n2,0,0,2\n", &["rest.csv:1", "column `s`", "initial.shape"]),
    ] {
        folder.write("rest.csv", rest);
        refused(&folder.run(&["simulate", "scene.toml"]), words);
    }
    // Where the points are the nodes only the fold itself is out of the question.
    folder.write("nodes.toml", &shape.replace("[loads]", "[supports]\nclamp = \"nodes\"\n[loads]"));
    folder.write("rest.csv", "x,y,z\n0,0,0\n1,0,0\n0.5,0,0\n2,0,0\n");
    refused(&folder.run(&["simulate", "nodes.toml"]), &["fold at node 1", "180"]);
    folder.write("rest.csv", "x[mm],y[mm],z[mm]\n0,0,0\n100,0,0\n100,100,0\n50,50,0\n");
    succeeds(&folder.run(&["static", "nodes.toml", "--json", "rest.json"]));
    // Another shape of a rod says how much of it there is.
    let initial =
        "[initial]\nstate = \"shape\"\nshape = { kind = \"polyline\", file = \"rest.csv\" }\n";
    folder.write("start.toml", &change("[time]", &format!("{initial}[time]")));
    for (s, words) in [
        ("x,y,z,s\n0,0,0,0\n0.2,0,0,0.2\n0.4,0,0,0.4\n", &["s from 0 to 0.4 m", "0.5 m"][..]),
        ("x,y,z,s\n0,0,0,0\n0.2,0,0,0.2\n0.4,0,0,0.2\n", &["rest.csv:4", "increasing"]),
    ] {
        folder.write("rest.csv", s);
        refused(&folder.run(&["simulate", "start.toml"]), words);
    }
    for z in [0.0, 0.01] {
        let rest = format!("x,y,z\n0,0,0\n0.1,0.01,0\n0.2,0,0\n0.3,0.02,{z}\n");
        folder.write("rest.csv", &rest);
        succeeds(&folder.run(&["simulate", "scene.toml", "--json", "run.json"]));
        let model = if z == 0.0 { "planar" } else { "spatial" };
        assert_eq!(folder.json("run.json")["model"], model);
    }
}

/// Lists that are too long or too short, wherever a scene or a fit file has one.
#[test]
fn list_of_wrong_length_is_rejected() {
    let folder = Folder::new();
    let table = |text: &str| change("[time]", &format!("{text}\n[time]"));
    let scenes = [
        change("[0, -9.8, 0]", "LIST"),
        change("[1, 0, 0]", "LIST"),
        change(
            "kind = \"straight\", length = 0.5, direction = [1, 0, 0]",
            "kind = \"helix\", length = 0.5, radius = 0.02, pitch = 0.05, axis = LIST, handedness = \"left\"",
        ),
        change(
            "{ kind = \"circle\", radius = 0.005 }",
            "{ kind = \"rectangle\", width = 0.01, height = 0.01, up = LIST }",
        ),
        table("[[loads.point]]\nnode = \"tip\"\nforce = LIST"),
        table("[[loads.point]]\nnode = \"tip\"\nmoment = LIST"),
        table("[[initial.point]]\nnode = \"tip\"\nforce = LIST"),
        table("[initial]\nvelocity = LIST"),
        table("[initial]\nangular_velocity = LIST"),
        table("[supports]\nend = \"roller\"\nroller = LIST"),
        table("[[supports.motion]]\nend = \"start\"\nramp = 1.0\ndisplacement = LIST"),
        table("[[supports.motion]]\nend = \"start\"\nramp = 1.0\nrotation = LIST"),
        table("[camera]\nclamp_position = LIST"),
    ];
    let fits = [
        (3, FIT.replace("point = \"tip\"", "point = \"tip\"\norigin = LIST")),
        (3, format!("{FIT}[[shape]]\nfile = \"tip.csv\"\norigin = LIST")),
        (2, format!("{FIT}bounds = LIST")),
        (3, format!("{FIT}[[frequencies]]\nhz = [1.0]\nsigma = 0.1\ndirection = LIST")),
    ];
    let scenes = scenes.map(|text| ("simulate", 3, text));
    for (command, numbers, text) in
        scenes.into_iter().chain(fits.map(|(numbers, text)| ("fit", numbers, text)))
    {
        for found in [numbers - 1, numbers + 1, numbers + 50] {
            folder.write("file.toml", &text.replace("LIST", &format!("{:?}", vec![1; found])));
            let length = format!("invalid length {found}");
            let expected = format!("expected {numbers} numbers");
            refused(
                &folder.run(&[command, "file.toml"]),
                &["file.toml", "line ", &length, &expected],
            );
        }
    }
}

/// All keys that a file lacks are named at once.
#[test]
fn missing_keys_are_named_together() {
    let folder = Folder::new();
    let helix =
        "shape = { kind = \"helix\", radius = 0.1 }\nsection = { kind = \"custom\", i1 = 1.0 }";
    let polyline = "shape = { kind = \"polyline\" }\nsection = {}";
    for (command, text, keys) in [
        (
            "simulate",
            "".to_string(),
            "rod.shape, rod.section, material.density, material.youngs_modulus",
        ),
        (
            "modes",
            format!("[rod]\n{helix}\n[time]\nstep = 1\n[material]\ndensity = 1"),
            "material.youngs_modulus, rod.shape.length, rod.shape.pitch, rod.shape.axis, \
             rod.shape.handedness, rod.section.area, rod.section.i2, rod.section.j, rod.section.up, time.end",
        ),
        (
            "static",
            format!("[rod]\n{polyline}\n[[loads.point]]\n[[loads.point]]\nnode = 2\n[material]"),
            "material.density, material.youngs_modulus, rod.shape.file, rod.section.kind, loads.point[0].node",
        ),
        (
            "fit",
            "[[experiment]]\n[[experiment.observation]]\n[[experiment]]\nname = \"b\"".to_string(),
            "parameter, experiment[0].name, experiment[0].scene, experiment[1].scene, \
             experiment[0].observation[0].file",
        ),
        (
            "fit",
            "[[parameter]]\n[[parameter]]\nname = \"beta\"\nprior = { }\n[[frequencies]]"
                .to_string(),
            "parameter[0].name, parameter[1].prior.mean, parameter[1].prior.sigma, frequencies[0].sigma",
        ),
    ] {
        folder.write("file.toml", &text);
        refused(
            &folder.run(&[command, "file.toml"]),
            &[&format!("file.toml: missing keys: {keys}\n")],
        );
    }
}

/// A factor of the natural curvature without effect, for a straight rod, is rejected.
#[test]
fn curvature_factor_of_a_straight_rod_is_rejected() {
    let folder = Folder::new();
    let why = "1 in a scene with a straight rest shape";
    for factor in ["3.0", "0", "[1.0, 0.5]"] {
        let key = format!("segments = 20\nnatural_curvature = {factor}");
        folder.write("curved.toml", &change("segments = 20", &key));
        refused(&folder.run(&["simulate", "curved.toml"]), &["rod.natural_curvature: found", why]);
    }
    folder.write(
        "curved.toml",
        &change("segments = 20", "segments = 20\nnatural_curvature = [1, 1]"),
    );
    succeeds(&folder.run(&["simulate", "curved.toml"]));
    folder.write("fit.toml", &format!("{FIT}[[parameter]]\nname = \"natural_curvature\"\n"));
    let words = [
        "parameter[1].name: found natural_curvature in a scene with a straight rest shape",
        "curved",
    ];
    refused(&folder.run(&["fit", "fit.toml"]), &words);
}

/// The clamp's angle cannot be identified beside keys in the axes of the world: the error names each of them.
#[test]
fn clamp_angle_with_excluded_keys_is_rejected() {
    let folder = Folder::new();
    folder.write("fit.toml", &FIT.replace("youngs_modulus", "clamp_angle"));
    let arc = "state = \"shape\"\nshape = { kind = \"arc\", length = 0.5, angle = 1.0 }";
    let roller = "start = \"pinned\"\nend = \"roller\"\nroller = [1, 0, 0]";
    for (text, named) in [
        (format!("[initial]\n{arc}"), "initial.shape,"),
        (format!("[supports]\n{roller}\n[initial]\n{arc}"), "initial.shape,"),
        ("[[loads.point]]\nnode = 3\nforce = [0, 0, 1]".into(), "a spatial model,"),
        ("[initial]\nvelocity = [0, 0, 1]".into(), "a spatial model,"),
    ] {
        folder.write("scene.toml", &change("[time]", &format!("{text}\n[time]")));
        let found = format!("parameter[0].name: found clamp_angle in a scene with {named} allowed");
        refused(&folder.run(&["fit", "fit.toml"]), &[&found]);
    }
}

/// Lengths whose squares or fourth powers overflow or underflow are rejected with the limits, and not as folds.
#[test]
fn sizes_beyond_their_limits_are_rejected() {
    let folder = Folder::new();
    for length in ["1e308", "1e160", "1e60", "1e-60", "1e-160", "1e-320"] {
        folder.write("scene.toml", &change("length = 0.5", &format!("length = {length}")));
        let output = folder.run(&["simulate", "scene.toml"]);
        refused(&output, &["rod.shape: found an edge of ", "1e-50 to 1e50 m"]);
        assert!(!stderr(&output).contains("fold"));
    }
}

/// Reading options without effect, for columns that a file does not have, are rejected; rows without values are
/// counted.
#[test]
fn keys_without_columns_are_rejected_and_lost_rows_counted() {
    let folder = Folder::new();
    let observation = |keys: &str| FIT.replace("point = \"tip\"", keys);
    let pixels = "scale = 1e-3\ny = \"down\"\n";
    let seconds = "t,x,y\n0,0.5,0\n0.01,0.5,0\n";
    for (csv, keys, words) in [
        (seconds, "fps = 30".to_string(), &["fps = 30", "time column `t`", "column `frame`"][..]),
        (seconds, "scale = 4e-4".into(), &["scale = 0.0004", "x[px]", "without a unit"]),
        ("t,x[mm],y[mm]\n0,500,0\n", "scale = 1e-3".into(), &["scale = 0.001", "x[px]"]),
        ("t,x\n0,0.5\n", "y = \"down\"".into(), &["y = \"up\" or \"down\"", "no column y"]),
        (seconds, "origin = [0, 0, 0.1]".into(), &["origin = 0.1 along z", "no column z"]),
        (seconds, "origin = [nan, 0, 0]".into(), &["origin = NaN along x", "finite"]),
        (seconds, "time_zero = inf".into(), &["time_zero = inf", "finite"]),
        ("frame[ms],x,y\n0,0.5,0\n", "fps = 30".into(), &["unit [ms] of `frame`"]),
        (seconds, "time_zero = 3".into(), &["no usable value in 2 rows", "2 before time_zero"]),
        (
            "frame,x[px],y[px]\n1,500,0\n2,,\n3,nan,nan\n",
            format!("fps = 30\n{pixels}time_zero = 2"),
            &["no usable value in 3 rows", "1 before time_zero, 2 without a value"],
        ),
    ] {
        folder.write("tip.csv", csv);
        folder.write("fit.toml", &observation(&keys));
        refused(&folder.run(&["fit", "fit.toml"]), &[&["tip.csv:1"], words].concat());
    }
    folder.write("shape.csv", "s,x,y\n0.1,0.1,0\n");
    let shape = "[[shape]]\nfile = \"shape.csv\"\nscale = 2.0\n";
    folder.write("fit.toml", &format!("{FIT}{shape}"));
    folder.write("tip.csv", seconds);
    refused(&folder.run(&["fit", "fit.toml"]), &["shape.csv:1", "scale = 2"]);

    let row = |t: f64| format!("{t},{},{}\n", 0.5 - 2.0 * t * t * t, -2.0 * t * t);
    let rows: String = (0..30).map(|k| row(f64::from(k) * 0.01)).collect();
    let lost = "-0.03,0.5,0\n-0.02,0.5,0\n-0.01,0.5,0\n";
    folder.write("tip.csv", &format!("t,x,y\n{lost}{rows}0.295,,\n0.297,nan,\n"));
    folder.write("fit.toml", &observation("time_zero = 0.0"));
    let output = folder.run(&["fit", "fit.toml", "--report", "page"]);
    let said = "Rows left out           tip.csv: 3 before time_zero, 2 without a value";
    assert!(stdout(&output).contains(said), "{}", stderr(&output));
    let dropped = &folder.json("page/fit.json")["dropped"];
    assert_eq!((&dropped[0]["before_time_zero"], &dropped[0]["empty"]), (&3.into(), &2.into()));
    // Lengths may be seen from below and from elsewhere.
    let seen = rows.replace(",-", ",");
    folder.write("tip.csv", &format!("t,x,y\n{seen}"));
    folder.write("fit.toml", &observation("y = \"down\"\norigin = [0.001, 0, 0]"));
    let output = folder.run(&["fit", "fit.toml", "--json", "fit.json"]);
    assert_ne!(output.status.code(), Some(2), "{}", stderr(&output));
    assert!(folder.json("fit.json").get("dropped").is_none());
}
