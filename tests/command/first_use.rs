//! First use of the command: templates with values to be filled in, files of other kinds, unset environment variables,
//! lengths in millimeters, units of residuals, and recordings that begin before the release.

use crate::folder::{Folder, SCENE, refused, replaced, status, stderr, stdout, succeeds, words};

/// A file of Tracker whose unit of lengths is not named.
fn tracker() -> String {
    let rows = (0..40).map(|k| f64::from(k) * 0.01);
    let row = |t: f64| format!("{t},{},{}\n", 0.5 - t * t, -t * t);
    format!(",mass_A,\nt,x,y\n{}", rows.map(row).collect::<String>())
}

#[test]
fn open_value_of_a_template_is_refused_by_name() {
    let folder = Folder::new();
    folder.write("tracker.csv", &tracker());
    let output = folder.run(&["init", "cantilever", "--from", "tracker.csv", "--out", "out"]);
    succeeds(&output);
    let shown = stdout(&output);
    assert!(words(&shown).contains("To fill in scale"), "{shown}");
    let output = folder.run(&["fit", "out/cantilever-fit.toml"]);
    refused(&output, &["cantilever-fit.toml", "scale is still to be filled in", "m per unit"]);
    assert!(!stderr(&output).contains("mantissa"), "{}", stderr(&output));
    // Of a scene as well, and several at once.
    let open = replaced(SCENE, "density = 1273.52", "density = ..   # kg/m^3");
    folder.write("open.toml", &replaced(&open, "radius = 0.005 }", "radius = 0.005 }\ntaper = ?"));
    let output = folder.run(&["static", "open.toml"]);
    refused(&output, &["density is still to be filled in (kg/m^3)", "taper is still"]);
}

#[test]
fn template_takes_the_measures_of_the_rod() {
    let folder = Folder::new();
    let sizes = ["--width", "0.01", "--height", "0.002", "--length", "0.3", "--density", "1100"];
    for template in ["cantilever", "droop", "frequencies"] {
        let arguments = ["init", template, "--section", "rectangle", "--out", template];
        succeeds(&folder.run(&[&arguments[..], &sizes[..]].concat()));
        let scene = folder.read(&format!("{template}/{template}.toml"));
        for words in [
            "kind = \"rectangle\", width = 0.01, height = 0.002, up = [0, 1, 0]",
            "length = 0.3",
            "density = 1100.0",
        ] {
            assert!(scene.contains(words), "{words} in {scene}");
        }
        assert!(!scene.contains("# measure"), "{scene}");
        succeeds(&folder.run(&["parameters", &format!("{template}/{template}.toml"), "-q"]));
    }
    let tube = ["init", "helix", "--radius", "0.004", "--thickness", "0.001", "--out", "tube"];
    succeeds(&folder.run(&tube));
    let scene = folder.read("tube/helix.toml");
    assert!(scene.contains("kind = \"tube\", radius = 0.004, thickness = 0.001"), "{scene}");
    for (arguments, words) in [
        (&["--radius", "0.1", "--width", "0.1"][..], ["--radius", "another section"]),
        (&["--length", "-1"][..], ["--length", "above 0"]),
    ] {
        let output = folder.run(&[&["init", "droop"][..], arguments].concat());
        assert!(
            words.iter().all(|word| stderr(&output).contains(word))
                || output.status.code() == Some(2)
        );
    }
}

#[test]
fn file_of_another_kind_is_named() {
    let folder = Folder::new();
    refused(&folder.run(&["fit", "scene.toml"]), &["this is a scene, not a fit file"]);
    refused(&folder.run(&["simulate", "fit.toml"]), &["this is a fit file, not a scene"]);
    let brackets = replaced(SCENE, "[material]", "[[material]]");
    folder.write("brackets.toml", &brackets);
    refused(&folder.run(&["static", "brackets.toml"]), &["found [[material]]", "[material]"]);
}

#[test]
fn unset_environment_variable_is_named() {
    let folder = Folder::new();
    folder.write(
        "scene.toml",
        &replaced(
            &crate::folder::polyline(),
            "file = \"rest.csv\"",
            "file = \"$ROD_FOLDER/rest.csv\"",
        ),
    );
    for (variable, is_set) in [("", false), ("none", true)] {
        let mut command = folder.command(&["parameters", "scene.toml"]);
        match is_set {
            true => command.env("ROD_FOLDER", variable),
            false => command.env_remove("ROD_FOLDER"),
        };
        let output = command.output().unwrap();
        assert_eq!(output.status.code(), Some(2));
        let message = stderr(&output);
        assert_eq!(
            message.contains("environment variable ROD_FOLDER is not set"),
            !is_set,
            "{message}"
        );
    }
    // Of the data of a fit as well.
    folder.write("scene.toml", SCENE);
    for (table, file) in [("observation", "$ROD_FOLDER/tip.csv"), ("shape", "$ROD_FOLDER/s.csv")] {
        folder.write("fit.toml", &format!(
            "scene = \"scene.toml\"\n[[{table}]]\nfile = \"{file}\"\n[[parameter]]\nname = \"youngs_modulus\"\n"
        ));
        let output =
            folder.command(&["fit", "fit.toml"]).env_remove("ROD_FOLDER").output().unwrap();
        refused(&output, &["environment variable ROD_FOLDER is not set"]);
    }
}

/// 350.000 mm is 0.35000000000000003 m.
#[test]
fn tip_in_millimetres_is_on_the_rod() {
    let folder = Folder::new();
    let scene = replaced(SCENE, "length = 0.5", "length = 0.35");
    folder.write("scene.toml", &replaced(&scene, "1e8", "1e7"));
    folder.write("fit.toml", "scene = \"scene.toml\"\n[[shape]]\nfile = \"s.csv\"\n[[parameter]]\nname = \"youngs_modulus\"\n");
    let rows = "s[mm],x[mm],y[mm]\n100.000,99.9,-2\n200.000,199.8,-6\n300.000,299.2,-12\n";
    folder.write("s.csv", &format!("{rows}350.000,348.9,-16\n"));
    let output = folder.run(&["fit", "fit.toml"]);
    assert_ne!(output.status.code(), Some(2), "{}", stderr(&output));
    folder.write("s.csv", &format!("{rows}350.001,348.9,-16\n"));
    refused(&folder.run(&["fit", "fit.toml"]), &["0.350001", "0 .. 0.35"]);
}

/// Frequencies that are given in Hz are reported in Hz, in rad/s in rad/s; the JSON has rad/s.
#[test]
fn residuals_are_in_the_unit_of_the_data() {
    let folder = Folder::new();
    let still = replaced(SCENE, "[time]\nend = 0.3\nstep = 2e-3\nbeta = 0.5\n", "");
    folder.write("scene.toml", &still);
    let fit = |given: &str| {
        format!(
            "scene = \"scene.toml\"\n[[frequencies]]\n{given}\n[[parameter]]\nname = \"youngs_modulus\"\n"
        )
    };
    folder.write("fit.toml", &fit("hz = [1.6, 9.8, 27.4]\nsigma = 0.1"));
    let output = folder.run(&["fit", "fit.toml", "--json", "fit.json", "--report", "page"]);
    let shown = stdout(&output);
    assert!(shown.contains("sigma 0.1000 Hz") && !shown.contains("rad/s"), "{shown}");
    let json = folder.json("fit.json");
    let rms = json["residual_rms"].as_f64().unwrap() / std::f64::consts::TAU;
    let printed = shown.split("RMS ").nth(1).unwrap().split(" Hz").next().unwrap();
    let printed: f64 = printed.parse().unwrap();
    // The printed value is the JSON value in Hz, rounded to four digits.
    assert!((printed / rms - 1.0).abs() < 1e-3, "{rms}: {shown}");
    assert_eq!((&json["units"][0], &json["data_units"][0]), (&"rad/s".into(), &"Hz".into()));
    let page = folder.read("page/fit.html");
    assert!(page.contains("f (Hz)") && !page.contains("rad/s"), "the page is in another unit");
    folder.write("fit.toml", &fit("rad_s = [10.05, 61.6, 172.2]\nsigma = 0.628"));
    let shown = stdout(&folder.run(&["fit", "fit.toml"]));
    assert!(shown.contains("sigma 0.6280 rad/s") && !shown.contains(" Hz"), "{shown}");
}

/// Center lines without arc lengths.
#[test]
fn photograph_needs_no_arc_lengths() {
    let folder = Folder::new();
    succeeds(&folder.run(&["init", "droop"]));
    let data = folder.read("droop.csv");
    let bare: String = data
        .lines()
        .filter(|line| !line.starts_with('#'))
        .map(|line| line.split_once(',').unwrap().1.to_string() + "\n")
        .collect();
    folder.write("droop.csv", &bare);
    let output = folder.run(&["fit", "droop-fit.toml", "--json", "fit.json", "--report", "page"]);
    succeeds(&output);
    // Made with 30 MPa.
    let modulus = &folder.json("fit.json")["parameters"][0];
    let [low, high] = [0, 1].map(|end| modulus["interval95"][end].as_f64().unwrap());
    let room = 0.5 * (high - low);
    assert!(low - room < 3e7 && 3e7 < high + room, "{modulus}");
    folder.write("droop.csv", "x[mm],y[mm]\n1,0\n2,0\n");
    refused(
        &folder.run(&["fit", "droop-fit.toml"]),
        &["droop.csv:1", "no column s or node and 2 points", "at least 3"],
    );
}

/// A rod that is filmed before its release: the first frames show it at rest.
fn pre_trigger(rest: f64) -> Folder {
    let folder = Folder::new();
    let scene = replaced(SCENE, "end = 0.3\nstep = 2e-3\nbeta = 0.5", "end = 1.2");
    folder.write("scene.toml", &replaced(&scene, "poisson_ratio = 0.5", ""));
    let fine = replaced(&scene, "end = 1.2", "end = 0.8\nstep = 2e-3");
    folder.write("fine.toml", &fine);
    succeeds(&folder.run(&["simulate", "fine.toml", "--out", "nodes.csv", "-q"]));
    let nodes = folder.read("nodes.csv");
    let mut text = "t,x,y\n".to_string();
    // 250 frames a second; noise of 0.2 mm that no library makes.
    let noise = |k: usize| 2e-4 * (((k * 7919 + 13) % 101) as f64 / 50.5 - 1.0);
    let count = (rest * 250.0).round() as usize;
    for k in 0..count {
        text += &format!("{},{},{}\n", k as f64 / 250.0, 0.5 + noise(2 * k), noise(2 * k + 1));
    }
    let rows = nodes.lines().skip(1).step_by(2).enumerate();
    for (k, line) in rows {
        let fields: Vec<f64> = line.split(',').map(|field| field.parse().unwrap()).collect();
        let [x, y] = [fields[fields.len() - 3], fields[fields.len() - 2]];
        let i = count + k;
        text += &format!("{},{},{}\n", i as f64 / 250.0, x + noise(2 * i), y + noise(2 * i + 1));
    }
    folder.write("tip.csv", &text);
    folder
}

#[test]
fn late_release_is_named_with_the_release_time() {
    let folder = pre_trigger(0.2);
    let output = folder.run(&["fit", "fit.toml"]);
    let shown = stdout(&output) + &stderr(&output);
    assert!(shown.contains("[late-release]"), "{shown}");
    assert!(status(&shown).contains("began before the release"), "{shown}");
    let at = words(&shown);
    let at = at.split("Raise time_zero by ").nth(1).unwrap();
    let by: f64 = at.split(' ').next().unwrap().parse().unwrap();
    // The recording is at rest for 0.2 s; the tolerance is five frames of 4 ms.
    assert!((by - 0.2).abs() < 0.02, "{by}: {shown}");
    // With it the fit is one of the rod.
    let with = crate::folder::FIT.replace("point =", "time_zero = 0.2\npoint =");
    folder.write("fit.toml", &with);
    let output = folder.run(&["fit", "fit.toml", "--json", "fit.json"]);
    let modulus = folder.json("fit.json")["parameters"][0]["value"].as_f64().unwrap();
    // The tip of the shared folder is simulated with 1e8 Pa.
    assert!((modulus / 1e8 - 1.0).abs() < 0.01, "{}", stdout(&output));
    assert!(!stdout(&output).contains("[late-release]"), "{}", stdout(&output));
    // `init` writes the release time.
    let output = folder.run(&["init", "cantilever", "--from", "tip.csv", "--out", "new"]);
    succeeds(&output);
    let written = folder.read("new/cantilever-fit.toml");
    let zero = written.split("time_zero = ").nth(1).unwrap().split_whitespace().next().unwrap();
    // The onset of the motion at 0.2 s, to five frames of 4 ms.
    assert!((zero.parse::<f64>().unwrap() - 0.2).abs() < 0.02, "{written}");
}
