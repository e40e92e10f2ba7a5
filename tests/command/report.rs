//! The page of a fit, and its plot data: sections in order, completeness without plot data, and curves that equal a simulation
//! at the estimates.

use rodfit::fit::{Analysis, MinimumSource, PosteriorSettings, Recording, Sample, Vertical};
use rodfit::page::fit_page;
use rodfit::{Fit, FitReport, Observation, Parameter, Point, Problem, Scene, Trajectory};
use std::sync::LazyLock;

use crate::common::coarse;
use crate::folder::{Folder, change, replaced, succeeds, words};

/// Observations of a point at `count` times with reproducible errors of up to `most`, m.
pub fn disturbed(run: &Trajectory, point: Point, count: u32, most: f64) -> Observation {
    let end = run.times()[run.times().len() - 1];
    let sample = |k: u32| {
        let time = end * f64::from(k) / f64::from(count);
        let (x, _) = run.at(point, time).unwrap();
        let off = most * (f64::from(k * k) * 2.4).sin();
        Sample { time, position: [Some(x[0] + off), Some(x[1] - off), None] }
    };
    Observation::new((1..=count).map(sample).collect()).at(point)
}

/// A problem, and a fit of its modulus with all plot data, to its own motion with 1 mm of a known
/// disturbance.
pub static FITTED: LazyLock<(Problem, FitReport)> = LazyLock::new(|| {
    let problem = coarse(8, 4e-3, 0.4).problem().unwrap();
    let run = problem.simulate().unwrap();
    let mut observation = disturbed(&run, Point::Tip, 20, 1e-3);
    observation.header.source = Some("<b>\"tip\" & co</b>.csv".into());
    let report = Fit::new(&problem)
        .observe(observation)
        .identify(Parameter::YoungsModulus)
        .analyse(Analysis { profile: true, ..Analysis::default() })
        .keep_plot_data()
        .solve()
        .unwrap();
    (problem, report)
});

/// Positions of all `parts` in the page; fails if one is missing or out of order.
fn in_order(page: &str, parts: &[&str]) {
    let mut from = 0;
    for part in parts {
        let found = page[from..].find(part);
        from += found.unwrap_or_else(|| panic!("`{part}` is not there, or too early"));
    }
}

/// Nothing is fetched, nothing runs, and every element that opens closes.
pub fn is_whole(page: &str) {
    // A parameter of schemes, and no number.
    let page = page.replace("rho_inf", "rho");
    let links = page.matches("href=\"").count();
    let to_data = page.matches("href=\"data:text/csv;charset=utf-8,").count();
    assert_eq!(links, to_data + page.matches("/fit.html\"").count());
    for forbidden in ["http:", "https:", "src=", "<script", "@import", "NaN", "inf"] {
        let found = page.find(forbidden).map(|at| page[..at + 20].chars().rev().take(100));
        assert!(found.is_none(), "{forbidden}: {:?}", found.map(|f| f.collect::<String>()));
    }
    // Only to what is on the page itself.
    assert_eq!(page.matches("url(").count(), page.matches("url(#").count());
    for tag in ["section", "table", "figure", "svg", "div", "tr", "td", "p", "ul", "li"] {
        let opened =
            page.matches(&format!("<{tag}>")).count() + page.matches(&format!("<{tag} ")).count();
        assert_eq!(opened, page.matches(&format!("</{tag}>")).count(), "{tag}");
    }
}

#[test]
fn fit_page_has_its_sections_in_order() {
    let (_, report) = &*FITTED;
    let page = fit_page(report, "a <fit> & more");
    is_whole(&page);
    in_order(
        &page,
        &[
            "a &lt;fit&gt; &amp; more",
            "id=\"verdict\"",
            "id=\"parameters\"",
            "<h2>Residuals</h2>",
            "&lt;b&gt;&quot;tip&quot; &amp; co&lt;/b&gt;.csv",
            "<h2>Discretization error</h2>",
            "<h2>Uncertainty budget</h2>",
            "<h2>Undetected bias</h2>",
            "<h2>Likelihood profiles</h2>",
            "<h2>Global scan and local minima</h2>",
            "Global scan over youngs_modulus",
            "Convergence",
            "<h2>Trajectory</h2>",
            "<h2>Settings and cost</h2>",
            "Cite as: ",
        ],
    );
    assert!(!page.contains("<b>\"tip\""));
    // Two coordinates with three drawings each, a profile, the search, the scan and the shapes.
    assert_eq!(page.matches("<svg").count(), 2 * 3 + 4);
    // Every drawing has a name of its own for who cannot see it.
    let names: Vec<&str> = page.split("role=\"img\" aria-label=\"").skip(1).collect();
    let mut names: Vec<&str> = names.iter().map(|n| n.split('"').next().unwrap()).collect();
    assert_eq!(names.len(), page.matches("<svg").count());
    names.sort_unstable();
    names.dedup();
    assert_eq!(names.len(), 2 * 3 + 4);
    assert!(names.contains(&"&lt;b&gt;&quot;tip&quot; &amp; co&lt;/b&gt;.csv, x: residuals"));
    for axis in ["x", "y"] {
        for title in ["data and model", "residuals", "residual autocorrelation"] {
            assert!(
                page.contains(&format!("<h3 class=\"small\">{axis}: {title}<span")),
                "{axis} {title}"
            );
        }
    }
    // Every warning stands before the table.
    let mut warned = report.clone();
    warned.warnings = vec!["first <doubt>".into(), "second".into()];
    in_order(&fit_page(&warned, ""), &["first &lt;doubt&gt;", "second", "id=\"parameters\""]);
}

/// The page of a fit with a posterior distribution has its intervals beside those of other methods, and draws of the pair.
#[test]
fn posterior_is_on_the_page_with_other_intervals_and_pairs() {
    let mut scene = coarse(4, 1e-2, 0.4);
    scene.loads.damping.mass = 2.0;
    let problem = scene.problem().unwrap();
    let observation = disturbed(&problem.simulate().unwrap(), Point::Tip, 40, 1e-3);
    let posterior = Some(PosteriorSettings { draws: 40, chains: 2, warmup: 40 });
    let report = Fit::new(&problem)
        .observe(observation)
        .identify(Parameter::YoungsModulus)
        .identify(Parameter::DampingMass)
        .analyse(Analysis { posterior, bootstrap: 8, ..Analysis::default() })
        .solve()
        .unwrap();
    assert_eq!(report.method_intervals.len(), 2);
    for (own, estimate) in report.method_intervals.iter().zip(&report.parameters) {
        let posterior = estimate.posterior.as_ref().unwrap();
        assert_eq!((own.linear95, own.profile95), (estimate.interval95, None));
        assert_eq!(own.posterior95, Some(posterior.interval95));
        assert_eq!(own.bootstrap95, Some(estimate.bootstrap.as_ref().unwrap().interval95));
    }
    let page = fit_page(&report, "fit");
    is_whole(&page);
    let methods = page.split("id=\"methods\"").nth(1).unwrap().split("</table>").next().unwrap();
    for heading in ["linear", "bootstrap", "posterior", "R-hat"] {
        assert!(methods.contains(heading), "{heading}: {methods}");
    }
    // A method that was not requested has no column.
    assert!(!methods.contains("profile likelihood"), "{methods}");
    in_order(
        &page,
        &[
            "95 % intervals by method",
            "<h2>Posterior distribution</h2>",
            "youngs_modulus and ",
            "correlation of the draws",
        ],
    );
    // The report that was read from its JSON has no draws, and no figure of them.
    let stored: FitReport = serde_json::from_str(&serde_json::to_string(&report).unwrap()).unwrap();
    assert_eq!(stored.method_intervals, report.method_intervals);
    assert!(!fit_page(&stored, "fit").contains("Posterior distribution"));
}

/// The page of distributed parameters has their intervals, observations and model.
#[test]
fn distributed_parameters_have_a_page() {
    let along = |numbers: &str| {
        let list = format!("segments = 8\nnatural_curvature = [{numbers}]");
        let arc = "kind = \"arc\", length = 0.5, angle = 2.0";
        let straight = "kind = \"straight\", length = 0.5, direction = [1, 0, 0]";
        replaced(&change("segments = 20", &list), straight, arc)
    };
    let truth = Scene::from_toml(&along("1.3, 0.8, 1.1, 0.9"), ".").unwrap().problem().unwrap();
    let seen = disturbed(&truth.simulate().unwrap(), Point::Tip, 60, 1e-4);
    let row = |s: &Sample| {
        let [x, y, _] = s.position.map(Option::unwrap_or_default);
        format!("{},{x},{y}\n", s.time)
    };
    let folder = Folder::new();
    let rows: String = seen.samples.iter().map(row).collect();
    folder.write("tip.csv", &format!("t,x,y\n{rows}"));
    folder.write("scene.toml", &along("1, 1, 1, 1"));
    let field = "[[field]]\nname = \"natural_curvature\"\nsigma = 0.5\nlength = 0.1\n\
                 [[parameter]]\nname = \"youngs_modulus\"\nprior = { mean = 1e8, sigma = 1e6 }\n";
    let observed = "scene = \"scene.toml\"\n[[observation]]\nfile = \"tip.csv\"\nsigma = 1e-4\n";
    folder.write("fit.toml", &format!("{observed}{field}"));
    succeeds(&folder.run(&["fit", "fit.toml", "--report", "page"]));
    let page = folder.read("page/fit.html");
    is_whole(&page);
    let parts = [
        "id=\"verdict\"",
        "4 values along the rod from 120 coordinates",
        "Values along the rod",
        "natural_curvature over the arc length",
        "band: 95 % interval of each value",
        "id=\"parameters\"",
        "youngs_<wbr>modulus",
        "<h2>Residuals</h2>",
        "tip.csv, x: data and model",
        "tip.csv, y: residuals",
    ];
    in_order(&page, &parts);
    // No tests were made: nothing is said of them.
    assert!(!page.contains("too few values"), "{page}");
    // The value has the digits of its error.
    let row = page.split("youngs_<wbr>modulus</th><td>").nth(1).unwrap();
    let [value, error] =
        [0, 1].map(|k| row.split("<td>").nth(k).unwrap().split(' ').next().unwrap());
    let decimals = |number: &str| number.split('.').nth(1).map_or(0, str::len);
    assert!(decimals(value) > 1 && decimals(value) == decimals(error), "{value} {error}");
    // The band is drawn: as many corners as the numbers have ends.
    let chart = page.split("natural_curvature over the arc length").nth(1).unwrap();
    let chart = chart.split("</svg>").next().unwrap();
    assert!(chart.contains("var(--model)") && chart.matches("<path").count() >= 2, "{chart}");
    let report: serde_json::Value = serde_json::from_str(&folder.read("page/fit.json")).unwrap();
    assert_eq!(report["fields"][0]["values"].as_array().unwrap().len(), 4);
    assert!(report.get("series").is_none());
}

#[test]
fn page_without_plot_data_is_complete() {
    let (_, report) = &*FITTED;
    let change = |change: &dyn Fn(&mut FitReport)| {
        let mut odd = report.clone();
        change(&mut odd);
        let page = fit_page(&odd, "odd");
        is_whole(&page);
        in_order(&page, &["id=\"verdict\"", "id=\"parameters\"", "Settings and cost"]);
        page
    };
    let page = change(&|odd| odd.plot_data = None);
    assert!(!page.contains("<svg"));
    change(&|odd| {
        for series in &mut odd.plot_data.as_mut().unwrap().series {
            series.simulated.iter_mut().for_each(|x| *x = f64::NAN);
            series.curve.iter_mut().for_each(|x| x[1] = f64::INFINITY);
        }
    });
    for keep in [0, 1] {
        change(&|odd| {
            let plots = odd.plot_data.as_mut().unwrap();
            for series in &mut plots.series {
                for values in
                    [&mut series.abscissa_values, &mut series.observed, &mut series.simulated]
                {
                    values.truncate(keep);
                }
                series.curve.clear();
                series.sigma = 0.0;
            }
            plots.shapes.truncate(keep);
            plots.history.truncate(keep);
            plots.landscape.iter_mut().for_each(|l| {
                l.values.truncate(keep);
                l.misfit.truncate(keep);
            });
            plots.profiles.iter_mut().for_each(|p| {
                p.values.truncate(keep);
                p.rise.truncate(keep);
            });
        });
    }
    let page = change(&|odd| {
        odd.residual_rms = f64::NAN;
        odd.sigma = vec![f64::INFINITY];
        odd.residual_tests.clear();
        let estimate = &mut odd.parameters[0];
        (estimate.value, estimate.std_error, estimate.interval95) = (None, None, None);
        odd.correlation = vec![vec![None]];
    });
    assert!(page.contains("not identifiable") && page.contains("too few values"));
}

/// Plot data are equal to a simulation at the estimates.
#[test]
fn plot_data_equal_a_simulation_of_the_estimates() {
    let (problem, report) = &*FITTED;
    let plots = report.plot_data.as_ref().unwrap();
    let best = problem.with(report.parameters()).unwrap();
    let run = best.simulate().unwrap();
    let (mut squares, mut count) = (0.0, 0.0);
    for (c, series) in plots.series.iter().enumerate() {
        assert_eq!((series.axis.as_str(), series.abscissa_values.len()), (["x", "y"][c], 20));
        for ((time, seen), simulated) in
            series.abscissa_values.iter().zip(&series.observed).zip(&series.simulated)
        {
            let (x, _) = run.at(Point::Tip, *time).unwrap();
            assert!((x[c] - simulated).abs() < 1e-12, "{x:?} {simulated}");
            squares += (simulated - seen).powi(2);
            count += 1.0;
        }
        for [time, value] in &series.curve {
            let (x, _) = run.at(Point::Tip, *time).unwrap();
            assert!((x[c] - value).abs() < 1e-12);
        }
        assert_eq!(series.sigma, report.sigma[0]);
    }
    assert!((f64::sqrt(squares / count) / report.residual_rms - 1.0).abs() < 1e-9);
    assert_eq!((plots.shapes.len(), plots.shapes[0].time), (12, Some(0.0)));
    for shape in &plots.shapes {
        let (x, _) = run.at(Point::Tip, shape.time.unwrap()).unwrap();
        let tip = shape.nodes.last().unwrap();
        assert!((0..3).all(|c| (x[c] - tip[c]).abs() < 1e-12));
    }
    assert!((plots.shapes[11].time.unwrap() - 0.4).abs() < 1e-12);

    // The way: work grows, and ends at the optimum.
    let history = &plots.history;
    assert!(history.windows(2).all(|w| w[0].simulations <= w[1].simulations));
    let (first, last) = (&history[0], &history[history.len() - 1]);
    assert_eq!((first.stage.as_str(), last.stage.as_str()), ("scan", "full model"));
    let value = report.parameters[0].value.unwrap();
    assert!((last.values[0] / value - 1.0).abs() < 1e-12 && last.residuals == 40);
    let chosen = &report.local_minima.list[0];
    assert!(chosen.chosen && chosen.converged && chosen.found_by == MinimumSource::Fit);
    assert_eq!((chosen.values[0], chosen.misfit), (last.values[0], last.misfit));
    assert!(
        words(&report.to_string()).contains(&report.local_minima.summary)
            && report.local_minima.count >= 1
    );
    // The scan's lowest point is next to the truth.
    let landscape = &plots.landscape[0];
    let lowest = (0..landscape.values.len())
        .min_by(|a, b| landscape.misfit[*a].total_cmp(&landscape.misfit[*b]))
        .unwrap();
    assert!((landscape.values[lowest] / value).ln().abs() < 0.8, "{landscape:?}");
    // The profile crosses its level at its ends.
    let profile = &plots.profiles[0];
    for end in report.parameters[0].profile95.unwrap() {
        let end = end.unwrap();
        let at = profile.values.iter().position(|x| (x / end - 1.0).abs() < 1e-12).unwrap();
        assert!((profile.rise[at] / profile.level - 1.0).abs() < 5e-3, "{profile:?}");
    }
    let json = serde_json::to_value(report).unwrap();
    assert_eq!(json["plot_data"]["series"][1]["abscissa"], "time");
    assert_eq!(json["plot_data"]["version"], env!("CARGO_PKG_VERSION"));
    assert_eq!(json["vector_unit"], rodfit::numerics::simd::simd_level());
    assert_eq!(json["local_minima"]["list"][0]["found_by"], "fit");
}

/// The page of a fit lists how each recording was read, with the number of measured values.
#[test]
fn fit_page_lists_the_keys_of_recordings() {
    let (problem, _) = &*FITTED;
    let run = problem.simulate().unwrap();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("tip.csv");
    let mut text = "frame,x[px],y[px]\n10,100,100\n".to_string();
    for k in 1..=20_u32 {
        let (x, _) = run.at(Point::Tip, 0.02 * f64::from(k)).unwrap();
        let pixel = |x: f64| (x / 1e-3 + 100.0).round();
        text += &format!("{},{},{}\n", 12 + k, pixel(x[0]), 200.0 - pixel(x[1]));
    }
    std::fs::write(&path, text).unwrap();
    let recording = Recording {
        fps: Some(50.0),
        scale: Some(1e-3),
        origin: Some([100.0, 100.0, 0.0]),
        y: Some(Vertical::Down),
        time_zero: Some(12.0),
        ..Recording::default()
    };
    let fit = Fit::new(problem)
        .observe(Observation::read_as(&path, &recording).unwrap())
        .identify(Parameter::YoungsModulus)
        .keep_plot_data()
        .solve()
        .unwrap();
    let page = fit_page(&fit, "pixels");
    is_whole(&page);
    let words = "tip.csv: 20 points, 40 values; 50 frames per second; 1.00 mm per pixel; \
                 origin at (100, 100, 0); y down; motion from 12 on the clock of the file, in its \
                 unit";
    assert!(page.contains(words), "{page}");
    assert!(page.contains("tip.csv: rows 1 before time_zero"), "{page}");
}

/// Failed tests of residuals, drawn in red, have a warning: uncorrelated outliers beyond the noise.
#[test]
fn failed_residual_tests_have_warnings() {
    let (problem, _) = &*FITTED;
    let run = problem.simulate().unwrap();
    let mut state = 7_u64;
    let mut random = || {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (state >> 40) as f64 / f64::from(1_u32 << 24) - 0.5
    };
    let sample = |k: u32| {
        let time = 2e-3 * f64::from(k);
        let (x, _) = run.at(Point::Tip, time).unwrap();
        let mut off = || if random() > 0.45 { 0.05 * random() } else { 1e-3 * random() };
        Sample { time, position: [Some(x[0] + off()), Some(x[1] + off()), None] }
    };
    let mut sample = sample;
    let report = Fit::new(problem)
        .observe(Observation::new((1..=200).map(&mut sample).collect()))
        .identify(Parameter::YoungsModulus)
        .keep_plot_data()
        .solve()
        .unwrap();
    let red: Vec<_> = report.residual_tests.iter().filter(|t| !t.passed).collect();
    assert!(red.iter().any(|t| t.is_noise()), "{:?}", report.residual_tests);
    for test in red {
        let named =
            |w: &String| w.contains(&test.verdict) && w.contains(&format!(", {}: ", test.axis));
        assert!(report.warnings.iter().any(named), "{test:?} {:?}", report.warnings);
    }
}

/// Two markers whose noise is estimated are weighted anew on the way, which is drawn as if they had
/// had their last weights from the beginning.
#[test]
fn misfit_of_the_search_decreases_in_one_weighting() {
    let (problem, _) = &*FITTED;
    let run = problem.simulate().unwrap();
    let report = Fit::new(problem)
        .observe(disturbed(&run, Point::Tip, 40, 1e-4))
        .observe(disturbed(&run, Point::Node(4), 40, 3e-3))
        .identify(Parameter::YoungsModulus)
        .keep_plot_data()
        .solve()
        .unwrap();
    let history = &report.plot_data.as_ref().unwrap().history;
    let full: Vec<_> = history.iter().filter(|i| i.stage == "full model").collect();
    let mut same = 0;
    for pair in full.windows(2) {
        let [before, after] = [pair[0], pair[1]];
        // Where the weights change the place does not.
        if before.values == after.values {
            same += 1;
            assert!((after.misfit / before.misfit - 1.0).abs() < 1e-9, "{before:?} {after:?}");
        }
    }
    assert!(same > 0, "{full:?}");
    // At the end, residuals are of the size of their sigmas.
    assert!((full[full.len() - 1].rms() - 1.0).abs() < 0.1, "{full:?}");
}
