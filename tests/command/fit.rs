//! `rodfit fit`: results of the shipped fits against the parameters of their data, reports, exit codes, several fits in one call,
//! and errors of invalid fit files.

use std::path::Path;

use crate::folder::{FIT, Folder, refused, status, stderr, stdout, succeeds, words};

/// The shipped fits give the parameters of their data, at the cost of so many simulations: two of full length with derivatives,
/// the coarser ones for the discretization error, the search on the coarse model, a tenth for omitted effects, and one with
/// derivatives by the inputs.
#[test]
fn shipped_fits_recover_known_parameters() {
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("data");
    let folder = Folder::new();
    for (file, truth, rms, most) in [
        ("cantilever-fit.toml", 1e8, 1e-3, 4.8),
        ("beta-fit.toml", 0.75, 1e-3, 4.8),
        ("helix-fit.toml", 1e7, 2e-4, 5.3),
    ] {
        let path = data.join(file);
        succeeds(&folder.run(&[
            "fit",
            path.to_str().unwrap(),
            "--json",
            "fit.json",
            "--save",
            "fitted.toml",
        ]));
        let fit = folder.json("fit.json");
        assert_eq!(fit["converged"], true);
        let parameter = &fit["parameters"][0];
        let [low, high] = [0, 1].map(|i| parameter["interval95"][i].as_f64().unwrap());
        // Truth: the parameter with which `examples/make_data` simulates the data. The width is an upper bound.
        assert!(low < truth && truth < high && high - low < 0.02 * truth, "{parameter}");
        // The RMS residual is the noise of the data, with an error of a few per cent.
        assert!((fit["residual_rms"].as_f64().unwrap() / rms - 1.0).abs() < 0.1, "{fit}");
        let work = fit["simulations"].as_f64().unwrap();
        assert!(work < most, "{file}: {work}");
        assert!(fit["warnings"].as_array().unwrap().is_empty(), "{fit}");
        // The saved scene runs.
        succeeds(&folder.run(&["simulate", "fitted.toml"]));
    }
}

#[test]
fn unidentifiable_fit_exits_with_3_and_writes_its_report() {
    let folder = Folder::new();
    let fit = FIT.replace(
        "name = \"youngs_modulus\"",
        "name = \"youngs_modulus\"\n[[parameter]]\nname = \"density\"",
    );
    folder.write("fit.toml", &fit);
    let output = folder.run(&["fit", "fit.toml", "--json", "fit.json"]);
    assert_eq!(output.status.code(), Some(3), "{}", stderr(&output));
    let fit = folder.json("fit.json");
    for parameter in fit["parameters"].as_array().unwrap() {
        assert_eq!(parameter["identifiable"], false);
        assert!(
            parameter["value"].is_null()
                && parameter["std_error"].is_null()
                && parameter["interval95"].is_null()
        );
    }
    assert!(fit["status"].as_str().unwrap().contains("youngs_modulus/density"));
}

/// Requested analyses are in the JSON, others are not.
#[test]
fn requested_analyses_are_in_the_report() {
    let folder = Folder::new();
    let plain = {
        folder.run(&["fit", "fit.toml", "--json", "fit.json", "-q"]);
        folder.json("fit.json")
    };
    assert_eq!(plain["discretization_error"][0]["name"], "youngs_modulus");
    assert!(plain["discretization_error"][0]["relative"].as_f64().unwrap() > 0.0);
    assert_eq!(plain["residual_tests"].as_array().unwrap().len(), 2);
    assert_eq!(plain["grade"], "model-does-not-explain", "{plain}");
    assert!(plain["parameters"][0].get("profile95").is_none());
    assert!(plain.get("method_intervals").is_none());
    let analysis = "[analysis]\nprofile = true\nbootstrap = 20\nseed = 3\n\
                    observed_information = true\ndiscretization_error = \"none\"\n\
                    posterior = { draws = 1000, chains = 2, warmup = 40 }\n";
    folder.write("fit.toml", &format!("{FIT}{analysis}"));
    let draws = ["--posterior", "30", "--draws", "draws.csv"];
    let output = folder.run(&[&["fit", "fit.toml", "--json", "fit.json"], &draws[..]].concat());
    succeeds(&output);
    let fit = folder.json("fit.json");
    let e = &fit["parameters"][0];
    for key in ["profile95", "observed_std_error"] {
        assert!(!e[key].is_null(), "{key}: {e}");
    }
    assert!(e["bootstrap"]["std_error"].as_f64().unwrap() > 0.0, "{e}");
    assert!(fit["discretization_error"].as_array().unwrap().is_empty());
    // The option replaces the number of draws of the file, and its warning has a code.
    assert_eq!(e["posterior"]["draws"], 60, "{e}");
    let codes = fit["warning_codes"].as_array().unwrap();
    assert!(codes.iter().any(|code| code == "posterior-not-converged"), "{fit}");
    let table = std::fs::read_to_string(folder.path("draws.csv")).unwrap();
    assert!(table.starts_with("chain,draw,youngs_modulus,lp\n0,0,"), "{table}");
    assert_eq!(table.lines().count(), 61);
    let shown = stdout(&output);
    assert!(shown.contains("Bootstrap") && shown.contains("Posterior"), "{shown}");
    // One table has the intervals of all methods.
    let table = shown.split("95 % intervals by method").nth(1).unwrap_or_else(|| panic!("{shown}"));
    let headings: Vec<&str> = table.lines().nth(1).unwrap().split("  ").map(str::trim).collect();
    for method in ["linear", "profile", "bootstrap", "posterior"] {
        assert!(headings.contains(&method), "{method}: {shown}");
    }
    let compared = fit["method_intervals"].as_array().unwrap();
    assert_eq!((compared.len(), &compared[0]["parameter"]), (1, &"youngs_modulus".into()));
    for (key, own) in [
        ("linear95", &e["interval95"]),
        ("profile95", &e["profile95"]),
        ("bootstrap95", &e["bootstrap"]["interval95"]),
        ("posterior95", &e["posterior"]["interval95"]),
    ] {
        assert!(own.is_array() && compared[0][key] == *own, "{key}: {fit}");
    }
}

/// The first printed line has the grade, and an unusable fit has exit code 3.
#[test]
fn grade_is_the_first_line() {
    let folder = Folder::new();
    let graded = |rows: &dyn Fn(f64) -> [f64; 2]| {
        let row = |k: i32| {
            let t = 0.01 * f64::from(k);
            let [x, y] = rows(t);
            format!("{t},{x},{y}\n")
        };
        let rows: String = (0..30).map(row).collect();
        folder.write("tip.csv", &format!("t,x,y\n{rows}"));
        let output = folder.run(&["fit", "fit.toml", "--json", "fit.json"]);
        let shown = stdout(&output);
        let fit = folder.json("fit.json");
        let first = status(&shown);
        assert!(first.contains(fit["verdict"].as_str().unwrap()), "{shown}");
        for words in fit["warnings"].as_array().unwrap() {
            assert!(words.as_str().unwrap().len() < 400, "{words}");
        }
        (output.status.code(), fit["grade"].as_str().unwrap().to_string(), first)
    };
    // Nearly free fall.
    let (code, grade, first) = graded(&|t| [0.5 - 2.0 * t * t * t, -2.0 * t * t]);
    assert_eq!((code, &grade[..]), (Some(0), "model-does-not-explain"), "{first}");
    assert!(first.starts_with("fit.toml: model inadequate: "), "{first}");
    // Of a stiff rod, held where only a limp one is.
    folder.write("fit.toml", &format!("{FIT}bounds = [1e3, 1e5]\n"));
    let (code, grade, first) = graded(&|t| [0.5, 1e-3 * ((60.0 * t).cos() - 1.0)]);
    assert_eq!((code, &grade[..]), (Some(3), "not-usable"), "{first}");
    assert!(first.starts_with("fit.toml: unusable: "), "{first}");
}

#[test]
fn invalid_fit_or_data_is_rejected() {
    let folder = Folder::new();
    let data = folder.read("tip.csv");
    let cases: Vec<(&str, String, &[&str])> = vec![
        (
            "fit.toml",
            FIT.replace("scene = \"scene.toml\"", ""),
            &["fit.toml", "scene", "found none"],
        ),
        (
            "fit.toml",
            FIT.replace("scene.toml", "none.toml"),
            &["fit.toml: ", "none.toml", "No such file"],
        ),
        ("fit.toml", FIT.replace("youngs_modulus", "stiffness"), &["stiffness", "youngs_modulus"]),
        ("fit.toml", FIT.replace("point = \"tip\"", "point = \"nose\""), &["tip", "arc_length"]),
        (
            "fit.toml",
            FIT.replace("point = \"tip\"", "point = 400"),
            &["observation[0].point", "400"],
        ),
        (
            "fit.toml",
            FIT.replace("point = \"tip\"", "point = { arc_length = 0.7 }"),
            &["observation[0].point", "0.7"],
        ),
        (
            "fit.toml",
            FIT.replace("point = \"tip\"", "sigma = -1.0"),
            &["observation[0].sigma", "-1"],
        ),
        ("fit.toml", FIT.replace("point = \"tip\"", "colour = 1"), &["colour"]),
        ("fit.toml", format!("{FIT}start = 0.0\n"), &["parameter[0].start", "found 0"]),
        ("fit.toml", format!("{FIT}bounds = [2.0, 1.0]\n"), &["parameter[0].bounds"]),
        (
            "fit.toml",
            FIT.replace("tip.csv", "absent.csv"),
            &["fit.toml: ", "absent.csv", "No such file"],
        ),
        ("tip.csv", data.replace("t,x,y", "clock,x,y"), &["tip.csv:1", "`clock`"]),
        ("tip.csv", data.replace("t,x,y", "x,y,a"), &["tip.csv:1", "`a`"]),
        ("tip.csv", "x,y\n0.5,0\n0.4,0\n".into(), &["tip.csv:1", "no column t"]),
        ("tip.csv", data.replace("t,x,y", "frame,x,y"), &["tip.csv:1", "fps"]),
        ("tip.csv", data.replace("t,x,y", "t,x[px],y[px]"), &["tip.csv:1", "`x`", "scale"]),
        ("tip.csv", data.replace("0.02,", "-0.02,"), &["tip.csv:4", "time_zero"]),
        (
            "tip.csv",
            "t,x,y\n0,500,0\n0.1,490,-30\n0.2,450,-80\n".into(),
            &["tip.csv", "0.5 m", "x[mm]"],
        ),
        ("fit.toml", FIT.replace("point = \"tip\"", "y = \"left\""), &["left", "down"]),
        ("fit.toml", format!("{FIT}[analysis]\nprofiles = true\n"), &["profiles", "bootstrap"]),
        ("fit.toml", format!("{FIT}[analysis]\nbootstrap = 1\n"), &["analysis.bootstrap", "2 .. "]),
        (
            "fit.toml",
            format!("{FIT}[analysis]\nposterior = {{ draws = 5 }}\n"),
            &["analysis.posterior.draws", "20 .. "],
        ),
        (
            "fit.toml",
            format!("{FIT}[analysis]\nposterior = {{ chains = 0 }}\n"),
            &["analysis.posterior.chains", "1 .. 1000"],
        ),
        ("fit.toml", format!("{FIT}[analysis]\nposterior = {{ thin = 5 }}\n"), &["thin", "draws"]),
        (
            "fit.toml",
            format!("{FIT}[analysis]\nposterior = 1000\n"),
            &["posterior", "draws = 1000"],
        ),
        (
            "fit.toml",
            format!("{FIT}[analysis]\ndiscretization_error = \"all\"\n"),
            &["all", "refitted"],
        ),
        ("tip.csv", data.replace("t,x,y", "t,a,b"), &["tip.csv:1", "`a`"]),
        ("tip.csv", data.replace("t,x,y", "t,x,x"), &["tip.csv:1", "two columns `x`"]),
        ("tip.csv", "t\n0\n1\n".into(), &["tip.csv:1", "no column x, y or z"]),
        ("tip.csv", data.replace("t,x,y", "t[min],x,y"), &["tip.csv:1", "[min]", "ms"]),
        ("tip.csv", data.replace("0.02,", "0.01,"), &["tip.csv:4", "increasing"]),
        ("tip.csv", data.replace("0.02,", "abc,"), &["tip.csv:4", "`abc`"]),
        ("tip.csv", data.replace("0.02,", ","), &["tip.csv:4", "blank time"]),
        ("tip.csv", format!("{data}0.9,0,0\n"), &["tip.csv", "0.9", "time.end", "time_zero"]),
        ("tip.csv", format!("{data}0.295,0\n"), &["tip.csv:32", "2 fields"]),
        ("tip.csv", "t,x,y\n0,,\n0.1,nan,\n".into(), &["tip.csv:1", "no usable value"]),
        ("tip.csv", "t,x,y\n0.1,0.5,\n".into(), &["observation", "at least 2"]),
        ("tip.csv", String::new(), &["tip.csv:1"]),
    ];
    for (file, text, words) in cases {
        folder.write("fit.toml", FIT);
        folder.write("tip.csv", &data);
        folder.write(file, &text);
        refused(&folder.run(&["fit", "fit.toml"]), words);
    }
}

#[test]
fn units_and_gaps_of_data_do_not_change_the_result() {
    let folder = Folder::new();
    let data = folder.read("tip.csv");
    let value = || {
        let output = folder.run(&["fit", "fit.toml", "--json", "fit.json", "-q"]);
        assert!(output.status.success() && output.stdout.is_empty(), "{}", stderr(&output));
        folder.json("fit.json")["parameters"][0]["value"].as_f64().unwrap()
    };
    let metres = value();
    let rows = data.lines().skip(1).map(|line| {
        let v: Vec<f64> = line.split(',').map(|f| f.parse().unwrap()).collect();
        format!("{}, {}, {}\n", 1e3 * v[1], 1e2 * v[2], 1e3 * v[0])
    });
    folder.write(
        "tip.csv",
        &format!("# a tracker's comment\nx[mm], y [cm], t[ms]\n{}", rows.collect::<String>()),
    );
    // Other units of the same values differ by rounding only.
    assert!((value() / metres - 1.0).abs() < 1e-9);

    // A camera's frames and pixels, y down, released at frame 12; a continental spreadsheet.
    let samples: Vec<Vec<f64>> = data
        .lines()
        .skip(1)
        .map(|line| line.split(',').map(|f| f.parse().unwrap()).collect())
        .collect();
    let number = |x: f64| x.to_string().replace('.', ",");
    let frames = samples.iter().map(|v| {
        let (x, y) = (100.0 + v[1] / 2.5e-4, 200.0 - v[2] / 2.5e-4);
        format!("{};{};{}\n", number(12.0 + 100.0 * v[0]), number(y), number(x))
    });
    let header = "\u{feff}Frame;Y (px);X (px)\n11;1;1\n";
    folder.write("tip.csv", &format!("{header}{}", frames.collect::<String>()));
    let keys = "point = \"tip\"\nfps = 100\nscale = 2.5e-4\norigin = [100, 200, 0]\n\
                y = \"down\"\ntime_zero = 12";
    folder.write("fit.toml", &FIT.replace("point = \"tip\"", keys));
    // Pixels of 0.25 mm with origin and frame rate describe the same values.
    assert!((value() / metres - 1.0).abs() < 1e-9);
}

/// The folder of the report has the page and its data beside the result.
#[test]
fn report_folder_has_page_and_json() {
    let folder = Folder::new();
    let output = folder.run(&["fit", "fit.toml", "--report", "pages/new", "--json", "fit.json"]);
    // Data that no rod produces: the grade is the first statement of the page.
    assert!(output.status.code().is_some_and(|code| code != 2), "{}", stderr(&output));
    let page = folder.read("pages/new/fit.html");
    for part in ["id=\"verdict\"", "tip.csv", "youngs_modulus", "<svg", "scene.toml"] {
        assert!(page.contains(part), "{part}");
    }
    let (fit, same) = (folder.json("fit.json"), folder.json("pages/new/fit.json"));
    assert_eq!(fit, same);
    assert_eq!(fit["plot_data"]["series"].as_array().unwrap().len(), 2);
    assert_eq!(fit["plot_data"]["series"][0]["observed"].as_array().unwrap().len(), 30);
    assert!(fit["local_minima"]["count"].as_u64().unwrap() >= 1);
    // Without a page no plot data are kept.
    folder.run(&["fit", "fit.toml", "--json", "plain.json"]);
    let plain = folder.json("plain.json");
    assert!(plain.get("plot_data").is_none() && plain["local_minima"]["count"].is_u64());
}

/// The scan and the coarse fits run on all cores; results do not depend on the number or order of threads.
#[test]
fn results_are_equal_for_any_number_of_threads() {
    let folder = Folder::new();
    let two = "name = \"youngs_modulus\"\n[[parameter]]\nname = \"damping.mass\"";
    folder.write("fit.toml", &FIT.replace("name = \"youngs_modulus\"", two));
    let run = |threads: &str| {
        let mut command = folder.command(&["fit", "fit.toml", "-q", "--report", threads]);
        let status = command.env("RAYON_NUM_THREADS", threads).output().unwrap().status;
        let mut fit = folder.json(&format!("{threads}/fit.json"));
        fit["wall_seconds"] = 0.0.into();
        (status.code(), fit)
    };
    let (code, alone) = run("1");
    assert!(alone["plot_data"]["history"].as_array().unwrap().len() > 10, "{alone}");
    for threads in ["2", "5"] {
        assert_eq!(run(threads), (code, alone.clone()), "{threads} threads");
    }
}

/// Under weight alone only E/density is determined: half the density gives half the modulus.
#[test]
fn fixed_value_replaces_that_of_the_scene() {
    let data = concat!(env!("CARGO_MANIFEST_DIR"), "/data");
    let folder = Folder::new();
    let modulus = |density: &str| {
        folder.write(
            "fit.toml",
            &format!(
                "scene = \"{data}/cantilever.toml\"\n[[observation]]\n\
                 file = \"{data}/cantilever-tip.csv\"\n[[parameter]]\n\
                 name = \"youngs_modulus\"\n{density}"
            ),
        );
        succeeds(&folder.run(&["fit", "fit.toml", "--json", "fit.json"]));
        folder.json("fit.json")["parameters"][0]["value"].as_f64().unwrap()
    };
    let half = modulus("[[parameter]]\nname = \"density\"\nfixed = 636.76\n");
    // 636.76 kg/m^3 is half of the density of the scene, 1273.52 kg/m^3.
    assert!((half / modulus("") - 0.5).abs() < 1e-6);
}

/// Input uncertainties of the file and of the command line are in the budget.
#[test]
fn budget_has_inputs_of_file_and_command_line() {
    let folder = Folder::new();
    folder.write("fit.toml", &format!("{FIT}\n[[known]]\nname = \"radius\"\nsigma = 5e-5\n"));
    let known = ["--known", "rod.shape.length=1e-3", "--monte-carlo", "4"];
    let output = folder.run(
        &[&["fit", "fit.toml", "--json", "fit.json", "--report", "page"], &known[..]].concat(),
    );
    succeeds(&output);
    let printed = stdout(&output) + &stderr(&output);
    assert!(
        printed.contains("Uncertainty budget") && words(&printed).contains("radius 50 um -2.00"),
        "{printed}"
    );
    let fit = folder.json("fit.json");
    let parameter = &fit["parameters"][0];
    let sources: Vec<&str> =
        fit["budget"].as_array().unwrap().iter().map(|l| l["source"].as_str().unwrap()).collect();
    assert_eq!(sources[..3], ["radius", "rod.shape.length", "noise"]);
    assert_eq!(fit["budget"], parameter["budget"]);
    let number = |key: &str| parameter[key].as_f64().unwrap();
    let end = |k: usize| parameter["expanded95"][k].as_f64().unwrap();
    let half = 0.5 * (end(1) - end(0));
    // The stated inputs contribute at least 5 % to the combined uncertainty.
    assert!(number("combined_std") > 1.05 * number("std_error"), "{parameter}");
    // Definition: half width of the expanded interval = coverage factor times combined uncertainty.
    assert!((half / number("combined_std") - number("coverage_factor")).abs() < 1e-9);
    assert_eq!(parameter["monte_carlo"]["fits"], 4);
    assert_eq!(parameter["input_sensitivities"][0]["source"], "material.density");
    let page = folder.read("page/fit.html");
    assert!(page.contains("<h2>Uncertainty budget</h2>") && page.contains("coverage factor"));
    refused(&folder.run(&["fit", "fit.toml", "--known", "radius"]), &["--known", "NAME=SIGMA"]);
    refused(&folder.run(&["fit", "fit.toml", "--known", "nothing=1"]), &["nothing"]);
    refused(
        &folder.run(&["fit", "fit.toml", "--known", "youngs_modulus=1e6"]),
        &["a parameter of the fit"],
    );
}

/// Several fits in one call have the results of separate calls, named after their files; all are checked before the first runs.
#[test]
fn several_fits_run_in_order() {
    let folder = Folder::new();
    for template in ["droop", "frequencies"] {
        succeeds(&folder.run(&["init", template]));
    }
    let both = ["fit", "droop-fit.toml", "frequencies-fit.toml"];
    let written = ["--json", "found.json", "--save", "fitted.toml", "--report", "page"];
    let output = folder.run(&[&both[..], &written].concat());
    succeeds(&output);
    let shown = stdout(&output);
    assert!(
        shown.starts_with("droop-fit.toml: ") && shown.contains("\nfrequencies-fit.toml: "),
        "{shown}"
    );
    // And what came of each, in a table.
    let table: Vec<&str> = shown.lines().rev().take(2).collect();
    assert!(table[1].starts_with("  droop-fit.toml        trustworthy "), "{shown}");
    assert!(table[0].starts_with("  frequencies-fit.toml  trustworthy "), "{shown}");
    assert!(table.iter().all(|line| line.contains("youngs_modulus ") && line.contains(" +- ")));
    for name in ["droop-fit", "frequencies-fit"] {
        let value = |json: serde_json::Value| json["parameters"][0]["value"].as_f64().unwrap();
        let together = value(folder.json(&format!("found-{name}.json")));
        assert!(folder.read(&format!("page/{name}/fit.html")).contains("</html>"));
        assert!(folder.read(&format!("fitted-{name}.toml")).contains("youngs_modulus"));
        succeeds(&folder.run(&["fit", &format!("{name}.toml"), "--json", "alone.json"]));
        assert_eq!(together, value(folder.json("alone.json")));
    }
    let comparison = folder.read("page/comparison.html");
    for name in ["droop-fit", "frequencies-fit"] {
        assert!(
            comparison.contains(&format!("<a href=\"./{name}/fit.html\">{name}</a>")),
            "{name}"
        );
    }
    folder.write("broken.toml", "scene = 1\n");
    let output = folder.run(&["fit", "droop-fit.toml", "broken.toml", "--json", "none.json"]);
    refused(&output, &["broken.toml"]);
    assert!(stdout(&output).is_empty() && !folder.path("none-droop-fit.json").exists());
    refused(&folder.run(&["fit", "droop-fit.toml", "droop-fit.toml"]), &["droop-fit.toml twice"]);
    refused(&folder.run(&[&both[..], &["--json", "-"]].concat()), &["--json", "several fits"]);
    refused(&folder.run(&["fit"]), &["FIT"]);
}

/// Fit files of one name in different folders are named with their folders; no output replaces another.
#[test]
fn fits_of_one_name_get_names_with_folders() {
    let folder = Folder::new();
    for specimen in ["one", "two"] {
        succeeds(&folder.run(&["init", "droop", "--out", specimen]));
    }
    let both = ["fit", "one/droop-fit.toml", "two/droop-fit.toml"];
    let output = folder.run(&[&both[..], &["--json", "found.json"]].concat());
    succeeds(&output);
    for name in ["one", "two"] {
        let json = folder.json(&format!("found-{name}-droop-fit.json"));
        assert_eq!(json["grade"], "trustworthy");
    }
    // The worst of all is the exit code, and one that fails leaves the others.
    let fit = folder.read("one/droop-fit.toml");
    let unknown = "[[parameter]]\nname = \"loads.damping.mass\"\n";
    folder.write("one/droop-fit.toml", &format!("{fit}\n{unknown}"));
    let output = folder.run(&both);
    let shown = stdout(&output);
    assert_eq!(output.status.code(), Some(3), "{shown}");
    let table: Vec<&str> = shown.lines().rev().filter(|line| line.contains("-fit.toml")).collect();
    assert!(
        table[1].contains(" not-identifiable ") && table[0].contains(" trustworthy "),
        "{shown}"
    );
    let line = shown.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(line.contains("do not determine all parameters. Fix one of them"), "{shown}");
    // What one writes, another may not read.
    let over = ["--save", "two/droop.toml"];
    let alone = ["fit", "one/droop-fit.toml", "two/droop-fit.toml"];
    folder.write("two/droop-fit.toml", &fit.replace("droop.toml", "droop-one-droop-fit.toml"));
    folder.write("two/droop-one-droop-fit.toml", &folder.read("two/droop.toml"));
    refused(&folder.run(&[&alone[..], &over].concat()), &["--save", "an input of this run"]);
}
