//! The command: what it writes, and that bad input gets one clear message and exit code 2.

use serde_json::Value;

use crate::folder::{FIT, Folder, SCENE, change, refused, stderr};

#[test]
fn simulate_writes_what_it_promises() {
    let folder = Folder::new();
    let output =
        folder.run(&["simulate", "scene.toml", "--out", "nodes.csv", "--json", "run.json"]);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let run = folder.json("run.json");
    assert_eq!(
        (&run["model"], &run["dof"], &run["steps"]),
        (&"planar".into(), &42.into(), &150.into())
    );
    assert_eq!(run["status"], "completed");
    assert_eq!(run["scene"]["supports"]["clamp"], "mid-edge");
    assert!(run["newton_iterations"].as_u64().unwrap() >= 150);
    let (tip, energy) = (run["tip"].as_array().unwrap(), run["energy"].as_array().unwrap());
    assert_eq!((tip.len(), energy.len()), (151, 151));
    assert_eq!((tip[0].as_array().unwrap().len(), energy[0].as_array().unwrap().len()), (4, 6));

    let mut reader = csv::Reader::from_path(folder.path("nodes.csv")).unwrap();
    let header: Vec<String> = reader.headers().unwrap().iter().map(Into::into).collect();
    assert_eq!(header[..4], ["t", "x_0", "y_0", "z_0"]);
    assert_eq!(header.len(), 1 + 3 * 21);
    let rows: Vec<Vec<f64>> =
        reader.records().map(|r| r.unwrap().iter().map(|f| f.parse().unwrap()).collect()).collect();
    assert_eq!(rows.len(), 151);
    for c in 1..4 {
        // The JSON reader of this test rounds the last bit on its own.
        let (json, csv) = (tip[150][c].as_f64().unwrap(), rows[150][60 + c]);
        assert!((json - csv).abs() <= 2.0 * f64::EPSILON * csv.abs(), "{json} {csv}");
    }
}

/// The same scene turned out of the xy plane moves the same, in world axes.
#[test]
fn any_plane_is_planar() {
    let folder = Folder::new();
    folder.write(
        "turned.toml",
        &SCENE.replace("[1, 0, 0]", "[0, 0.6, 0.8]").replace("[0, -9.8, 0]", "[9.8, 0, 0]"),
    );
    for (scene, json) in [("scene.toml", "a.json"), ("turned.toml", "b.json")] {
        assert!(folder.run(&["simulate", scene, "--json", json]).status.success());
    }
    let (a, b) = (folder.json("a.json"), folder.json("b.json"));
    for k in [40, 150] {
        let at = |run: &Value, c: usize| run["tip"][k][c].as_f64().unwrap();
        let along = 0.6 * at(&b, 2) + 0.8 * at(&b, 3);
        assert!((at(&a, 1) - along).abs() < 1e-12 && (at(&a, 2) + at(&b, 1)).abs() < 1e-12);
    }
}

#[test]
fn json_on_stdout_is_only_json() {
    let folder = Folder::new();
    for arguments in
        [&["simulate", "scene.toml", "--json", "-"][..], &["check", "scene.toml", "--json", "-"]]
    {
        let output = folder.run(arguments);
        assert!(output.status.success(), "{}", stderr(&output));
        serde_json::from_slice::<Value>(&output.stdout).unwrap();
    }
}

#[test]
fn both_routes_of_derivatives_simulate_the_same() {
    let folder = Folder::new();
    for route in ["hand", "dual"] {
        let json = format!("{route}.json");
        let output =
            folder.run(&["simulate", "scene.toml", "--derivatives", route, "--json", &json]);
        assert!(output.status.success(), "{}", stderr(&output));
    }
    let (hand, dual) = (folder.json("hand.json"), folder.json("dual.json"));
    assert_eq!(hand["newton_iterations"], dual["newton_iterations"]);
    for c in 1..4 {
        let at = |run: &Value| run["tip"][150][c].as_f64().unwrap();
        assert!((at(&hand) - at(&dual)).abs() < 1e-11);
    }
}

#[test]
fn check_reports_agreement() {
    let folder = Folder::new();
    let output = folder.run(&["check", "scene.toml", "--json", "check.json"]);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let check = folder.json("check.json");
    for (key, limit) in [("gradient", 1e-12), ("hessian", 1e-12), ("finite_difference", 1e-7)] {
        let error = check["max_relative_error"][key].as_f64().unwrap();
        assert!(error > 0.0 && error < limit, "{key}: {error}");
    }
    for key in ["element", "dof", "hand", "dual"] {
        assert!(!check["worst"][key].is_null(), "{key}");
    }
}

/// Where the rod hangs, and how it vibrates there.
#[test]
fn static_and_modes_write_what_they_promise() {
    let folder = Folder::new();
    let output = folder.run(&["static", "scene.toml", "--json", "rest.json", "--out", "rest.csv"]);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let rest = folder.json("rest.json");
    let tip: Vec<f64> =
        rest["tip"].as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect();
    assert!((tip[1] / 0.5 + 0.2900).abs() < 1e-3 && tip[2] == 0.0, "{tip:?}");
    assert!(rest["energy"].as_f64().unwrap() < 0.0 && rest["residual"].as_f64().unwrap() < 1e-8);
    assert!(rest["newton_iterations"].as_u64().unwrap() > 0);
    assert_eq!((&rest["stable"], &rest["stable_in_plane"]), (&true.into(), &true.into()));
    // What it writes is a polyline.
    let rows = std::fs::read_to_string(folder.path("rest.csv")).unwrap();
    assert_eq!((rows.lines().next(), rows.lines().count()), (Some("x,y,z,s"), 22));

    let output = folder.run(&["modes", "scene.toml", "--count", "6", "--json", "modes.json"]);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let modes = folder.json("modes.json");
    let frequencies: Vec<f64> = modes["frequencies_rad_s"]
        .as_array()
        .unwrap()
        .iter()
        .map(|w| w.as_f64().unwrap())
        .collect();
    assert!(frequencies.len() == 6 && frequencies.is_sorted() && frequencies[0] > 0.0);
    // A rod that nothing holds falls for ever.
    folder.write("free.toml", &change("[time]", "[supports]\nstart = \"free\"\n[time]"));
    let output = folder.run(&["static", "free.toml"]);
    assert_eq!(output.status.code(), Some(3), "{}", stderr(&output));
    refused(&folder.run(&["modes", "scene.toml", "--count", "0"]), &["--count", "1..=200"]);
}

/// A run that dies keeps what it computed.
#[test]
fn a_failed_step_exits_with_three_and_keeps_the_rest() {
    let folder = Folder::new();
    // Long enough for beta = 0.5 to gain energy at this step.
    let scene = change("segments = 20", "segments = 50").replace("end = 0.3", "end = 20.0");
    folder.write("scene.toml", &scene.replace("step = 2e-3", "step = 1e-2"));
    let output =
        folder.run(&["simulate", "scene.toml", "--out", "nodes.csv", "--json", "run.json"]);
    assert_eq!(output.status.code(), Some(3), "{}", stderr(&output));
    assert!(stderr(&output).contains("the total energy has changed by"), "{}", stderr(&output));
    let run = folder.json("run.json");
    let steps = run["steps"].as_u64().unwrap() as usize;
    assert!(run["status"].as_str().unwrap().contains("stopped"));
    assert_eq!(run["tip"].as_array().unwrap().len(), steps + 1);
    assert!(
        run["tip"]
            .as_array()
            .unwrap()
            .iter()
            .flat_map(|t| t.as_array().unwrap())
            .all(|x| x.is_f64())
    );
    let rows = std::fs::read_to_string(folder.path("nodes.csv")).unwrap().lines().count();
    assert_eq!(rows, steps + 2);
}

/// Every way a scene can be wrong: key, what was found, what is allowed.
#[test]
fn bad_scenes_are_refused() {
    let cases: Vec<(String, &[&str])> = vec![
        (change("segments = 20", "sgements = 20"), &["sgements", "line 3", "segments"]),
        (change("beta = 0.5", "beta = 0.5\ntheta = 1"), &["theta", "beta"]),
        (change("density = 1273.52", ""), &["line 7: missing key: material.density"]),
        (change("segments = 20", ""), &["rod.segments", "2 .. 1e7"]),
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
        (SCENE.split("[time]").next().unwrap().to_string(), &["time", "end and step"]),
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
            &["supports.motion[0].end", "clamped or pinned"],
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
        (
            change("segments = 20", "").replace(
                "kind = \"straight\", length = 0.5, direction = [1, 0, 0]",
                "kind = \"polyline\", file = \"rest.csv\"",
            ),
            &["rest.csv", "No such file"],
        ),
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
fn bad_polylines_are_refused() {
    let folder = Folder::new();
    let shape = SCENE.replace("segments = 20", "").replace(
        "kind = \"straight\", length = 0.5, direction = [1, 0, 0]",
        "kind = \"polyline\", file = \"rest.csv\"",
    );
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
    let output = folder.run(&["static", "nodes.toml", "--json", "rest.json"]);
    assert!(output.status.success(), "{}", stderr(&output));
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
        let output = folder.run(&["simulate", "scene.toml", "--json", "run.json"]);
        assert!(output.status.success(), "{}", stderr(&output));
        let model = if z == 0.0 { "planar" } else { "spatial" };
        assert_eq!(folder.json("run.json")["model"], model);
    }
}

/// The wall stands at a line's first point: the shipped fit finds the same modulus with its rod
/// given by points, and its discretisation error; the nodes were the points once, and the modulus
/// 4.1 % off.
#[test]
fn a_rod_of_points_is_as_long_as_the_line() {
    let folder = Folder::new();
    let data = concat!(env!("CARGO_MANIFEST_DIR"), "/data/");
    let read = |name: &str| std::fs::read_to_string(format!("{data}{name}")).unwrap();
    let rows: String = (0..=50).map(|i| format!("{},0,0\n", 0.01 * f64::from(i))).collect();
    folder.write("rest.csv", &format!("x,y,z\n{rows}"));
    let straight = read("cantilever.toml");
    let shape = "{ kind = \"straight\", length = 0.5, direction = [1, 0, 0] }";
    assert!(straight.contains(shape) && straight.contains("segments = 50\n"));
    let points = straight.replace("segments = 50\n", "");
    folder.write("straight.toml", &straight);
    folder.write(
        "points.toml",
        &points.replace(shape, "{ kind = \"polyline\", file = \"rest.csv\" }"),
    );
    let fit = read("cantilever-fit.toml")
        .replace("\"cantilever-tip.csv\"", &format!("'{data}cantilever-tip.csv'"));
    let found = ["straight", "points"].map(|name| {
        folder.write("fit.toml", &fit.replace("cantilever.toml", &format!("{name}.toml")));
        let output = folder.run(&["fit", "fit.toml", "-q", "--json", "fit.json"]);
        assert!(output.status.success(), "{}", stderr(&output));
        folder.json("fit.json")
    });
    let values = [0, 1].map(|i| found[i]["parameters"][0]["value"].as_f64().unwrap());
    assert!((values[1] / values[0] - 1.0).abs() < 1e-8, "{values:?}");
    let mesh = [0, 1].map(|i| found[i]["discretization_error"][0]["mesh"].as_f64().unwrap());
    assert!((mesh[1] / mesh[0] - 1.0).abs() < 1e-4, "{mesh:?}");
}

/// Lists that are too long or too short, wherever a scene or a fit file has one.
#[test]
fn lists_of_other_lengths_are_refused() {
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
fn missing_keys_are_named_all_at_once() {
    let folder = Folder::new();
    let helix =
        "shape = { kind = \"helix\", radius = 0.1 }\nsection = { kind = \"custom\", i1 = 1.0 }";
    let polyline = "shape = { kind = \"polyline\" }\nsection = {}";
    for (command, text, keys) in [
        (
            "simulate",
            "".to_string(),
            "rod.segments, rod.shape, rod.section, material.density, material.youngs_modulus",
        ),
        (
            "modes",
            format!("[rod]\n{helix}\n[time]\nstep = 1\n[material]\ndensity = 1"),
            "rod.segments, material.youngs_modulus, rod.shape.length, rod.shape.pitch, rod.shape.axis, \
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

/// What does nothing is not taken.
#[test]
fn factors_on_no_curvature_are_refused() {
    let folder = Folder::new();
    let why = "1 beside a straight rest shape, which has no curvature";
    for factor in ["3.0", "0", "[1.0, 0.5]"] {
        let key = format!("segments = 20\nnatural_curvature = {factor}");
        folder.write("curved.toml", &change("segments = 20", &key));
        refused(&folder.run(&["simulate", "curved.toml"]), &["rod.natural_curvature: found", why]);
    }
    folder.write(
        "curved.toml",
        &change("segments = 20", "segments = 20\nnatural_curvature = [1, 1]"),
    );
    assert!(folder.run(&["simulate", "curved.toml"]).status.success());
    folder.write("fit.toml", &format!("{FIT}[[parameter]]\nname = \"natural_curvature\"\n"));
    let words =
        ["parameter[1].name: found natural_curvature beside a straight rest shape", "curved"];
    refused(&folder.run(&["fit", "fit.toml"]), &words);
}

/// The clamp's angle cannot be found beside what stands in the world's axes: each is named.
#[test]
fn the_clamps_angle_says_what_it_cannot_stand_beside() {
    let folder = Folder::new();
    folder.write("fit.toml", &FIT.replace("youngs_modulus", "clamp_angle"));
    let arc = "state = \"shape\"\nshape = { kind = \"arc\", length = 0.5, angle = 1.0 }";
    let roller = "start = \"pinned\"\nend = \"roller\"\nroller = [1, 0, 0]";
    for (text, named) in [
        (format!("[initial]\n{arc}"), "initial.shape,"),
        (format!("[supports]\n{roller}\n[initial]\n{arc}"), "initial.shape,"),
        ("[[loads.point]]\nnode = 3\nforce = [0, 0, 1]".into(), "a scene in space,"),
        ("[initial]\nvelocity = [0, 0, 1]".into(), "a scene in space,"),
    ] {
        folder.write("scene.toml", &change("[time]", &format!("{text}\n[time]")));
        let found = format!("parameter[0].name: found clamp_angle beside {named} allowed");
        refused(&folder.run(&["fit", "fit.toml"]), &[&found]);
    }
}

/// Sizes beyond what squares and fourth powers can hold are said to be that, and not folds.
#[test]
fn sizes_out_of_this_world_are_refused_as_such() {
    let folder = Folder::new();
    for length in ["1e308", "1e160", "1e60", "1e-60", "1e-160", "1e-320"] {
        folder.write("scene.toml", &change("length = 0.5", &format!("length = {length}")));
        let output = folder.run(&["simulate", "scene.toml"]);
        refused(&output, &["rod.shape: found an edge of ", "1e-50 to 1e50 m"]);
        assert!(!stderr(&output).contains("fold"));
    }
}

/// What says how to read columns that a file does not have does nothing, and is refused; rows that
/// say nothing are counted.
#[test]
fn keys_without_their_columns_are_refused_and_lost_rows_counted() {
    let folder = Folder::new();
    let observation = |keys: &str| FIT.replace("point = \"tip\"", keys);
    let pixels = "scale = 1e-3\ny = \"down\"\n";
    let seconds = "t,x,y\n0,0.5,0\n0.01,0.5,0\n";
    for (csv, keys, words) in [
        (seconds, "fps = 30".to_string(), &["fps = 30", "clock `t`", "column `frame`"][..]),
        (seconds, "scale = 4e-4".into(), &["scale = 0.0004", "x[px]", "without a unit"]),
        ("t,x[mm],y[mm]\n0,500,0\n", "scale = 1e-3".into(), &["scale = 0.001", "x[px]"]),
        ("t,x\n0,0.5\n", "y = \"down\"".into(), &["y = \"up\" or \"down\"", "without a column y"]),
        (seconds, "origin = [0, 0, 0.1]".into(), &["origin = 0.1 along z", "without a column z"]),
        (seconds, "origin = [nan, 0, 0]".into(), &["origin = NaN along x", "finite"]),
        (seconds, "time_zero = inf".into(), &["time_zero = inf", "finite"]),
        ("frame[ms],x,y\n0,0.5,0\n", "fps = 30".into(), &["unit [ms] of `frame`"]),
        (seconds, "time_zero = 3".into(), &["no value is left of 2 rows", "2 before time_zero"]),
        (
            "frame,x[px],y[px]\n1,500,0\n2,,\n3,nan,nan\n",
            format!("fps = 30\n{pixels}time_zero = 2"),
            &["no value is left of 3 rows", "1 before time_zero, 2 without a value"],
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
    let said = "tip.csv: rows left out: 3 before time_zero, 2 without a value";
    assert!(String::from_utf8_lossy(&output.stdout).contains(said), "{}", stderr(&output));
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

/// Every number of a scene with its names, value, unit and limits; what leads out of its plane says so.
#[test]
fn the_numbers_of_a_scene_are_listed() {
    let folder = Folder::new();
    folder.write("scene.toml", SCENE);
    let output = folder.run(&["parameters", "scene.toml", "--json", "list.json"]);
    assert!(output.status.success(), "{}", stderr(&output));
    let shown = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(shown.contains("rod.shape.length") && shown.contains("youngs_modulus"), "{shown}");
    let list = std::fs::read_to_string(folder.path("list.json")).unwrap();
    let list: serde_json::Value = serde_json::from_str(&list).unwrap();
    let of = |name: &str| list.as_array().unwrap().iter().find(|p| p["name"] == name).unwrap();
    let length = of("rod.shape.length");
    assert_eq!((&length["value"], &length["unit"]), (&0.5.into(), &"m".into()));
    assert!(length["limits"][0].as_f64().unwrap() > 0.0 && length.get("note").is_none());
    assert_eq!(of("material.youngs_modulus")["aliases"][0], "youngs_modulus");
    let note = of("loads.gravity.z")["note"].as_str().unwrap();
    assert!(note.contains("rod.dimension"), "{note}");
}
