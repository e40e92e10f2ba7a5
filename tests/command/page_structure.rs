//! Structure of the pages: no empty columns, units on all axes, CSV data equal to the plotted points, escaped names and links.

use rodfit::fit::FitSummary;
use rodfit::page::{comparison_page, fit_page};

use crate::folder::{Folder, SCENE, succeeds};
use crate::report::{FITTED, is_whole};

/// Labels of axes without a unit.
const DIMENSIONLESS: [&str; 7] = [
    "(model \u{2212} data) / \u{3c3}",
    "autocorrelation",
    "rise of 2 \u{d7} misfit / noise\u{b2}",
    "misfit / lowest misfit",
    "RMS residual / final one",
    "standard error / that of the plan",
    "fit",
];

/// Text between two marks, everywhere.
fn between<'a>(text: &'a str, from: &str, to: &str) -> Vec<&'a str> {
    text.split(from).skip(1).map(|part| part.split(to).next().unwrap()).collect()
}

/// The cells of a table's body, row by row.
fn rows(table: &str) -> Vec<Vec<String>> {
    let body = table.split("<tbody>").nth(1).unwrap_or_default();
    let text = |cell: &str| cell.split_once('>').unwrap().1.to_string();
    let cells = |row: &str| between(row, "<td", "</td>").into_iter().map(text).collect();
    between(body, "<tr", "</tr>").into_iter().map(cells).collect()
}

#[track_caller]
fn has_no_empty_column(page: &str) {
    for table in between(page, "<table", "</table>").into_iter().filter(|t| t.contains("<thead>")) {
        let rows = rows(table);
        for k in 0..rows[0].len() {
            let is_filled = |row: &Vec<String>| !["", "\u{2013}"].contains(&&row[k][..]);
            assert!(rows.iter().any(is_filled), "column {k} of {table}");
        }
    }
}

#[track_caller]
fn has_units_on_axes(page: &str) {
    let labels = between(page, "font-size=\"13\"", "</text>");
    assert!(!labels.is_empty());
    for label in labels.iter().map(|label| label.split_once('>').unwrap().1) {
        let has_unit = label.ends_with(')') && label.contains(" (");
        let is_number = label.ends_with("mode number");
        assert!(has_unit || is_number || DIMENSIONLESS.contains(&label), "{label}");
    }
    assert!(!page.contains("(10\u{207b}"), "a power of ten as a unit");
}

/// The rows of the file that a figure offers.
fn csv(page: &str, figure: &str) -> Vec<Vec<String>> {
    let link = page.split(&format!("aria-label=\"CSV of {figure}\"")).nth(1).unwrap();
    let encoded = link.split("utf-8,").nth(1).unwrap().split('"').next().unwrap();
    let mut parts = encoded.split('%');
    let mut bytes = parts.next().unwrap().as_bytes().to_vec();
    for part in parts {
        bytes.push(u8::from_str_radix(&part[..2], 16).unwrap());
        bytes.extend_from_slice(&part.as_bytes()[2..]);
    }
    let text = String::from_utf8(bytes).unwrap();
    text.lines().map(|line| line.split(',').map(String::from).collect()).collect()
}

/// The number of circles in the drawing of a figure.
fn circles(page: &str, figure: &str) -> usize {
    let drawing = page.split(&format!("aria-label=\"{figure}\"")).nth(1).unwrap();
    drawing.split("</svg>").next().unwrap().matches("<circle").count()
}

#[test]
fn fit_page_has_units_filled_columns_and_the_answer_first() {
    let (_, report) = &*FITTED;
    let page = fit_page(report, "fit");
    has_no_empty_column(&page);
    has_units_on_axes(&page);
    let card = page.split("</section>").next().unwrap();
    for part in ["id=\"answer\"", "youngs_modulus", "95 % interval", "MPa"] {
        assert!(card.contains(part), "{part}");
    }
    assert!(page.contains(concat!("Version ", env!("CARGO_PKG_VERSION"))));
    assert!(page.contains("prefers-color-scheme:dark") && page.contains("@media print"));
}

#[test]
fn correlation_matrix_is_shown_for_several_parameters_only() {
    let (_, report) = &*FITTED;
    assert!(!fit_page(report, "one").contains("Correlation matrix"));
    let mut two = report.clone();
    two.parameters.push(two.parameters[0].clone());
    two.correlation = vec![vec![Some(1.0), Some(-0.5)], vec![Some(-0.5), Some(1.0)]];
    let page = fit_page(&two, "two");
    assert!(page.contains("<h2>Correlation matrix</h2>") && page.contains("\u{2212}0.500</td>"));
}

#[test]
fn downloaded_data_are_the_plotted_data() {
    let (_, report) = &*FITTED;
    let mut report = report.clone();
    let plots = report.plot_data.as_mut().unwrap();
    plots.series.iter_mut().for_each(|series| series.label = "tip".into());
    let page = fit_page(&report, "fit");
    let series = &report.plot_data.as_ref().unwrap().series[1];
    let rows = csv(&page, "tip, y: data and model");
    assert_eq!(rows[0], ["series", "time (ms)", "y (mm)"]);
    let observed: Vec<&Vec<String>> = rows.iter().filter(|row| row[0] == "observed").collect();
    assert_eq!(observed.len(), circles(&page, "tip, y: data and model"));
    // The tables have six digits or more, in ms and mm.
    let near = |text: &str, value: f64| (text.parse::<f64>().unwrap() - value).abs() < 1e-6;
    for (row, (at, y)) in observed.iter().zip(series.abscissa_values.iter().zip(&series.observed)) {
        assert!(near(&row[1], 1e3 * at) && near(&row[2], 1e3 * y), "{row:?}, {at} {y}");
    }
    assert_eq!(rows.len(), 1 + observed.len() + series.curve.len());
    let residuals = csv(&page, "tip, y: residuals");
    assert_eq!(residuals.len(), 1 + observed.len());
    for (row, residual) in residuals[1..].iter().zip(series.residuals()) {
        assert!(near(&row[1], residual), "{row:?}, {residual}");
    }
}

/// Stages follow each other, and the cost grows.
#[test]
fn convergence_plot_runs_forwards() {
    let (_, report) = &*FITTED;
    let mut report = report.clone();
    // The history may have been stored in another order.
    report.plot_data.as_mut().unwrap().history.reverse();
    let rows = csv(&fit_page(&report, "fit"), "convergence of the search");
    let costs: Vec<f64> = rows[1..].iter().map(|row| row[1].parse().unwrap()).collect();
    assert!(costs.len() > 3 && costs.windows(2).all(|pair| pair[0] <= pair[1]), "{costs:?}");
    assert_eq!((&rows[1][0][..], &rows.last().unwrap()[0][..]), ("global scan", "full model"));
}

#[test]
fn comparison_has_every_fit_with_escaped_names_and_links() {
    let (_, report) = &*FITTED;
    let mut fits: Vec<FitSummary> =
        ["A1", "javascript:x", "<b>\"B\"</b>"].map(|name| FitSummary::new(name, report)).to_vec();
    fits[1].page = Some("javascript:x/fit.html".into());
    let error = "no <data>";
    fits.push(FitSummary::without_result("C", error));
    let page = comparison_page(&fits, "<campaign>");
    is_whole(&page);
    has_no_empty_column(&page);
    has_units_on_axes(&page);
    assert!(page.contains("&lt;campaign&gt;") && page.contains("No &lt;data&gt;"));
    assert!(page.contains("href=\"./javascript%3Ax/fit.html\"") && !page.contains("<b>\"B"));
    assert!(page.contains(&format!("<p>3: {}, 1: without a result.</p>", report.grade)));
    let figure = "youngs_modulus of every fit";
    let rows = csv(&page, figure);
    assert_eq!(rows.len(), 4);
    assert_eq!(circles(&page, figure), 3);
    let e = &report.parameters[0];
    let ends = e.interval95.unwrap();
    // The table is in MPa, the report in Pa.
    for (cell, value) in rows[1][1..].iter().zip([e.value.unwrap(), ends[0], ends[1]]) {
        assert!((cell.parse::<f64>().unwrap() * 1e6 / value - 1.0).abs() < 1e-8, "{cell} {value}");
    }
}

#[test]
fn comparison_numbers_fits_whose_shortened_names_are_equal() {
    let (_, report) = &*FITTED;
    let names = ["density = 1200, radius = 0.0049", "density = 1273.52, radius = 0.0049"];
    let fits = names.map(|name| FitSummary::new(name, report));
    let page = comparison_page(&fits, "campaign");
    for name in names.iter().zip(1..).map(|(name, k)| format!("{k}: {name}")) {
        assert!(page.contains(&format!("<th scope=\"row\">{name}</th>")), "{name}");
    }
    assert!(page.contains(">1: density") && page.contains(">2: density"));
    assert!(!comparison_page(&fits[..1], "campaign").contains("1: density"));
}

#[test]
fn campaign_page_compares_all_specimens_and_links_their_pages() {
    let folder = Folder::new();
    for (name, radius) in [("soft", "0.0052"), ("hard", "0.0048"), ("middle", "0.005")] {
        folder.write(&format!("{name}.toml"), &SCENE.replace("0.005 }", &format!("{radius} }}")));
    }
    let rows = "name,scene,#by\nsoft,soft.toml,A\nhard,hard.toml,B\nmiddle,middle.toml,A\n";
    folder.write("specimens.csv", rows);
    folder.write("campaign.toml", "fits = [\"fit.toml\"]\ntable = \"specimens.csv\"\n");
    succeeds(&folder.run(&["campaign", "plan", "campaign.toml", "--out", "out"]));
    succeeds(&folder.run(&["campaign", "run", "out"]));
    folder.run(&["fit", "fit.toml", "--report", "pages/soft"]);
    succeeds(&folder.run(&["campaign", "collect", "out", "--report", "pages"]));
    let page = folder.read("pages/comparison.html");
    is_whole(&page);
    for name in [">soft</a>", "<th scope=\"row\">hard</th>", "<th scope=\"row\">middle</th>"] {
        assert!(page.contains(name), "{name}");
    }
    assert!(page.contains("href=\"./soft/fit.html\"") && !page.contains("./hard/fit.html"));
    assert_eq!(csv(&page, "youngs_modulus of every fit").len(), 4);
}

#[test]
fn design_page_has_contributions_choices_and_the_expected_error() {
    let folder = Folder::new();
    let arguments =
        ["design", "fit.toml", "--sigma", "1e-3", "--json", "d.json", "--report", "page"];
    succeeds(&folder.run(&arguments));
    let (page, design) = (folder.read("page/design.html"), folder.json("d.json"));
    is_whole(&page);
    has_no_empty_column(&page);
    has_units_on_axes(&page);
    for part in [
        "<h2>Contribution of each measurement</h2>",
        "<h2>Marker position, duration and frame rate</h2>",
        "recommended: ",
        "arc length from the wall (mm)",
        "frame rate (Hz)",
    ] {
        assert!(page.contains(part), "{part}");
    }
    // One measurement: its coordinates.
    let contributions = design["contributions"].as_array().unwrap();
    let axes: Vec<&str> = contributions.iter().map(|c| c["axis"].as_str().unwrap()).collect();
    assert_eq!(axes, ["x", "y"]);
    let error = design["parameters"][0]["std_error"].as_f64().unwrap();
    let alone = contributions.iter().map(|c| c["std_error_alone"][0].as_f64().unwrap());
    let information: f64 = alone.map(|e| e.powi(-2)).sum();
    assert!((information * error.powi(2) - 1.0).abs() < 1e-6, "{contributions:?}");
}
