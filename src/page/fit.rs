//! The page of a fit: what to believe first, then the numbers, then what they rest on.

use crate::code::Code;
use crate::fit::Grade;
use crate::fit::ResidualTests;
use crate::fit::{Estimate, FitReport};
use crate::fit::{
    LocalMinimum, Measured, MinimumSource, PlotData, Profile, Series, SimulationSettings,
};
use crate::fit::{Recording, Vertical};
use crate::numerics::order;
use crate::page::budget::budgets;
use crate::page::coded::with_its_code;
use crate::page::number::{Scale, quantity, short};
use crate::page::recordings::recordings;
use crate::page::{capitalised, escaped, figures, page, section};

const NONE: &str = "\u{2013}";
/// More coordinates than this are not all drawn, but so many that fit worst.
const MOST_SERIES: usize = 36;
const WORST_SERIES: usize = 12;

/// A self-contained HTML page of a fit. `title` says which, such as the fit file's name. Data,
/// model and the search are shown if the fit [kept its plots](crate::Fit::keep_plot_data).
pub fn fit_page(report: &FitReport, title: &str) -> String {
    let mut body = verdict(report);
    body += &section("Parameters", &parameters(report));
    let plots = report.plot_data.as_ref();
    if let Some(errors) = &report.recordings {
        let drawn = plots.and_then(|plots| plots.recordings.as_ref());
        body += &section("Recordings", &recordings(errors, drawn));
    }
    if let Some(plots) = plots {
        body += &section("Data and model", &data(&plots.series, Some(&report.residual_tests)));
    }
    let budgets = budgets(report);
    if !budgets.is_empty() {
        body += &section("Budget of uncertainty", &budgets);
    }
    body += &section("How the parameters hang together", &correlation(report));
    if let Some(plots) = plots.filter(|e| !e.profiles.is_empty()) {
        let one = |p: &Profile| figures::profile(p, estimate(report, &p.label));
        let all: String = plots.profiles.iter().map(one).collect();
        body += &section("Likelihood profiles", &format!("<div class=\"row\">{all}</div>"));
    }
    body += &section("The search", &search(report, plots));
    if let Some(plots) = plots {
        let shapes = figures::shapes(report.interrupted, plots);
        if !shapes.is_empty() {
            body += &section("The rod at the optimum", &shapes);
        }
    }
    body += &section("What was run", &run(report, plots));
    page("Fit", &escaped(title), &body)
}

/// By its name, with its experiments.
fn estimate<'a>(report: &'a FitReport, label: &str) -> Option<&'a Estimate> {
    report.parameters.iter().find(|e| e.label() == label)
}

/// Whether to believe it, and everything that speaks against it.
fn verdict(report: &FitReport) -> String {
    let class = match report.grade {
        Grade::Trustworthy => "good",
        grade if grade.is_usable() => "doubt",
        _ => "bad",
    };
    let items = |words: &mut dyn Iterator<Item = &String>| -> String {
        words.map(|words| format!("<li>{}</li>\n", with_its_code(words))).collect()
    };
    let warnings = items(&mut report.warnings.iter());
    let told = |words: Vec<String>| items(&mut words.iter());
    let lacking = |words: &String| Code::OmittedEffect.behind(capitalised(words));
    let lacking = told(report.looks_like().iter().map(lacking).collect());
    let hidden = |words: &String| Code::UndetectedBias.behind(capitalised(words));
    let hidden = told(report.hidden().iter().map(hidden).collect());
    let unknown = report.not_identifiable.iter();
    let unknown = told(unknown.map(|found| found.kind.code().behind(&found.description)).collect());
    let list = |title: &str, items: String| match items.is_empty() {
        true => String::new(),
        false => format!("<h2>{title}</h2>\n<ul>\n{items}</ul>\n"),
    };
    format!(
        "<section class=\"verdict {class}\" id=\"verdict\"><p class=\"words\">{}</p><div>{}</div>\n\
         <p class=\"note\">{}</p>\n{}{}{}{}</section>\n",
        escaped(&capitalised(&report.grade.to_string())),
        with_its_code(&report.grade.code().behind(capitalised(&report.verdict))),
        escaped(&report.status),
        list("Warnings", warnings),
        list("Not determined by these data", unknown),
        list("What would explain what is left", lacking),
        list("What could hide without a trace in these data", hidden),
    )
}

/// A column of the table of parameters: its head, and what stands in it.
type Column<'a> = (&'static str, Box<dyn Fn(usize, &Estimate, &Scale) -> Option<String> + 'a>);

fn parameters(report: &FitReport) -> String {
    let range = |i: usize| report.plot_data.as_ref().and_then(|e| e.ranges.get(i));
    let ends = |[low, high]: [Option<f64>; 2], e: &Estimate, scale: &Scale| {
        let end = |x: Option<f64>| x.map_or("none".into(), |x| scale.show(x, e.std_error));
        format!("{} \u{2026} {}", end(low), end(high))
    };
    let interval = move |[low, high]: [f64; 2], e: &Estimate, scale: &Scale| {
        ends([Some(low), Some(high)], e, scale)
    };
    let columns: Vec<Column> = vec![
        (
            "value \u{b1} standard error",
            Box::new(|_, e, scale| {
                let value = scale.show(e.value?, e.std_error);
                Some(match e.std_error {
                    Some(error) => {
                        format!("<b>{value}</b> \u{b1} {}", scale.show(error, Some(error)))
                    }
                    None => format!("<b>{value}</b>, no error"),
                })
            }),
        ),
        ("95 % interval", Box::new(move |_, e, s| Some(interval(e.interval95?, e, s)))),
        ("unit", Box::new(|_, _, scale| Some(escaped(&scale.unit)))),
        (
            "how experiments differ, 95 %",
            Box::new(move |_, e, s| Some(interval(e.cluster_jackknife.as_ref()?.interval95, e, s))),
        ),
        (
            "residuals alone, 95 %",
            Box::new(move |_, e, s| {
                Some(interval(e.cluster_jackknife.as_ref()?.residual_interval95, e, s))
            }),
        ),
        (
            "mesh and step",
            Box::new(|i, _, _| {
                let relative = report.discretization_error.get(i)?.relative?;
                let percent = 100.0 * relative;
                Some(match percent < 1e-3 {
                    true => "below 0.001 %".into(),
                    false => format!("\u{2264} {} %", short(percent)),
                })
            }),
        ),
        (
            "observed Hessian",
            Box::new(|_, e, s| {
                Some(format!("\u{b1} {}", s.show(e.observed_std_error?, e.std_error)))
            }),
        ),
        ("profile 95 %", Box::new(move |_, e, s| Some(ends(e.profile95?, e, s)))),
        (
            "bootstrap",
            Box::new(move |_, e, s| {
                let b = e.bootstrap.as_ref()?;
                let error = s.show(b.std_error, e.std_error);
                Some(format!("\u{b1} {error}, {}", interval(b.interval95, e, s)))
            }),
        ),
        (
            "prior",
            Box::new(|_, e, s| {
                let prior = e.prior?;
                let (mean, sigma) = (prior.mean, Some(prior.sigma));
                Some(format!("{} \u{b1} {}", s.show(mean, sigma), s.show(prior.sigma, sigma)))
            }),
        ),
        (
            "bounds",
            Box::new(|i, e, _| {
                let [low, high] = range(i)?.bounds?.map(|end| quantity(end, e.name.unit()));
                Some(format!("{low} \u{2026} {high}"))
            }),
        ),
        ("start", Box::new(|i, e, _| Some(quantity(range(i)?.start?, e.name.unit())))),
    ];
    let scales: Vec<Scale> = report
        .parameters
        .iter()
        .map(|e| Scale::of(e.value.unwrap_or(0.0), e.name.unit()))
        .collect();
    let rows = || report.parameters.iter().zip(&scales).enumerate();
    let cells: Vec<(&str, Vec<Option<String>>)> = columns
        .iter()
        .map(|(head, cell)| (*head, rows().map(|(i, (e, scale))| cell(i, e, scale)).collect()))
        .filter(|(_, cells): &(&str, Vec<Option<String>>)| cells.iter().any(Option::is_some))
        .collect();
    let heads: String = cells.iter().map(|(head, _)| format!("<th>{head}</th>")).collect();
    // For narrow screens, where every cell stands on a line of its own.
    let head = |k: usize| format!(" data-head=\"{}\"", cells[k].0);
    let body: String = rows()
        .map(|(i, (e, _))| {
            let known = e.value.is_some();
            let cell = |(k, (_, cells)): (usize, &(&str, Vec<Option<String>>))| match &cells[i] {
                Some(text) if known || k > 0 => {
                    format!("<td{}><span>{text}</span></td>", head(k))
                }
                _ if k == 0 => format!("<td class=\"bad\"{}>not identifiable</td>", head(k)),
                _ => format!("<td{}>{NONE}</td>", head(k)),
            };
            let cells: String = cells.iter().enumerate().map(cell).collect();
            format!("<tr><th>{}</th>{cells}</tr>\n", escaped(&e.label()))
        })
        .collect();
    format!(
        "<div class=\"wide\" tabindex=\"0\"><table id=\"parameters\" class=\"cards\"><thead><tr><th>parameter</th>{heads}</tr></thead>\n\
         <tbody>{body}</tbody></table></div>\n{}",
        left_over(report)
    )
}

/// What is left of the data, what robust losses did, and how what was held out is predicted.
fn left_over(report: &FitReport) -> String {
    let series = report.plot_data.as_ref().map_or(&[][..], |e| &e.series);
    let unit = match series.iter().any(|s| s.unit == "m") || series.is_empty() {
        true => "m",
        // Series are in the unit of the data.
        false if series[0].unit == "Hz" => "rad/s",
        false => &series[0].unit,
    };
    let with_unit = |value: f64, unit: &str| {
        let (value, unit) = report.in_data_unit(value, unit);
        let scale = Scale::of(value, unit);
        format!("{} {}", scale.show(value, Some(0.01 * value)), scale.unit)
    };
    let mut lines =
        vec![format!("Root mean square residual {}", with_unit(report.residual_rms, unit))];
    lines.extend(report.losses.iter().map(|l| {
        format!(
            "{}: {} of {} values count less, {} are beyond 5 \u{3c3}; standard errors times {:.2}",
            l.observation, l.down_weighted, l.values, l.beyond_5_sigma, l.std_error_factor
        )
    }));
    lines.extend(report.predictions.iter().map(|p| {
        format!(
            "{}, held out: off by {}, {} expected",
            p.observation,
            with_unit(p.rms, &p.unit),
            with_unit(p.expected, &p.unit)
        )
    }));
    lines.iter().map(|line| format!("<p class=\"note\">{}.</p>\n", escaped(line))).collect()
}

/// Every observation with its coordinates, and with the tests of what is left where those were made.
pub(super) fn data(series: &[Series], tests: Option<&[ResidualTests]>) -> String {
    if series.is_empty() {
        return "<p class=\"none\">not compared over the whole record: the fit was interrupted</p>"
            .into();
    }
    let mut html = String::new();
    let mut before = None;
    let shown = worst(series);
    if shown.len() < series.len() {
        html += &format!(
            "<p class=\"note\">The {} of {} coordinates whose residuals are largest against \u{3c3}; all are in \
             the JSON.</p>\n",
            shown.len(),
            series.len()
        );
    }
    for series in shown {
        let parts = [series.experiment.as_str(), series.label.as_str()];
        let named: Vec<&str> = parts.into_iter().filter(|part| !part.is_empty()).collect();
        let name = named.join(": ");
        if before.as_ref() != Some(&name) {
            html += &format!("<h3>{}</h3>\n", escaped(&name));
        }
        // Center lines are tested along their normal.
        let own = |t: &&ResidualTests| {
            t.observation == name && (t.axis == series.axis || t.axis == "normal")
        };
        html += &figures::series(series, tests.map(|tests| tests.iter().find(own)));
        before = Some(name);
    }
    html
}

/// All coordinates, or those that fit worst where there are many, in their order.
fn worst(series: &[Series]) -> Vec<&Series> {
    let off = |s: &Series| {
        let residuals = s.residuals();
        residuals.iter().map(|r| r * r).sum::<f64>() / residuals.len().max(1) as f64
    };
    let mut ranked: Vec<(usize, f64)> = series.iter().map(off).enumerate().collect();
    if ranked.len() > MOST_SERIES {
        order::sort_down_by(&mut ranked, |x| x.1);
        ranked.truncate(WORST_SERIES);
        order::sort_by_key(&mut ranked, |(i, _)| *i);
    }
    ranked.into_iter().map(|(i, _)| &series[i]).collect()
}

fn correlation(report: &FitReport) -> String {
    let names: Vec<String> = report.parameters.iter().map(|e| escaped(&e.label())).collect();
    let head: String = names.iter().map(|name| format!("<th>{name}</th>")).collect();
    let cell = |value: &Option<f64>| match value.filter(|c| c.is_finite()) {
        Some(c) => {
            let color = if c < 0.0 { "var(--minus)" } else { "var(--plus)" };
            let strength = 45.0 * c.abs().min(1.0);
            format!(
                "<td style=\"background:color-mix(in srgb,{color} {strength:.0}%,transparent)\">{}</td>",
                format!("{c:.3}").replace('-', "\u{2212}").replace("\u{2212}0.000", "0.000")
            )
        }
        None => format!("<td>{NONE}</td>"),
    };
    let row = |(name, row): (&String, &Vec<Option<f64>>)| {
        format!("<tr><th>{name}</th>{}</tr>\n", row.iter().map(cell).collect::<String>())
    };
    let rows: String = names.iter().zip(&report.correlation).map(row).collect();
    let values: Vec<String> = report.singular_values.iter().map(|s| short(*s)).collect();
    let condition = match (report.singular_values.first(), report.singular_values.last()) {
        (Some(first), Some(last)) if report.singular_values.len() > 1 && *last > 0.0 => {
            format!("; the largest is {} times the smallest", short(first / last))
        }
        _ => String::new(),
    };
    format!(
        "<div class=\"wide\" tabindex=\"0\"><table class=\"matrix\"><thead><tr><th>correlation</th>{head}</tr></thead>\n\
         <tbody>{rows}</tbody></table></div>\n<p class=\"note\">Singular values of the Jacobian, columns \
         scaled to length one: {}{condition}.</p>",
        if values.is_empty() { "none".into() } else { values.join(", ") }
    )
}

fn search(report: &FitReport, plots: Option<&PlotData>) -> String {
    let minima = &report.local_minima;
    let mut html = String::new();
    if !minima.summary.is_empty() {
        html += &format!("<p>{}.</p>\n", escaped(&capitalised(&minima.summary)));
    }
    if let Some(plots) = plots {
        html += &format!("<div class=\"row\">{}", figures::history(plots));
        let moves = plots.settings.iter().any(|settings| settings.step.is_some());
        for landscape in &plots.landscape {
            let value = estimate(report, &landscape.label).and_then(|e| e.value);
            html += &figures::landscape(landscape, value, moves);
        }
        html += "</div>\n";
    }
    if minima.list.is_empty() {
        return html;
    }
    let names: Vec<String> = report.parameters.iter().map(|e| escaped(&e.label())).collect();
    let scale = |i: usize, value: f64| {
        let scale = Scale::of(value, report.parameters[i].name.unit());
        escaped(format!("{} {}", scale.show(value, Some(value * 1e-3)), scale.unit).trim())
    };
    let row = |basin: &LocalMinimum| {
        let values: String = (basin.values.iter().enumerate().take(names.len()))
            .map(|(i, value)| format!("<td>{}</td>", scale(i, *value)))
            .collect();
        let seen = match basin.found_by {
            MinimumSource::Fit if basin.converged => "fit of the whole record",
            MinimumSource::Fit => "fit of the whole record, not converged",
            MinimumSource::Scan
                if plots.is_some_and(|p| p.settings.iter().all(|s| s.step.is_none())) =>
            {
                "scan on a coarse mesh"
            }
            MinimumSource::Scan => "scan of the first period",
        };
        format!(
            "<tr{}><td>{}</td>{values}<td>{}</td><td>{seen}</td></tr>\n",
            if basin.chosen { " class=\"chosen\"" } else { "" },
            if basin.chosen { "chosen" } else { "" },
            short(basin.relative),
        )
    };
    let heads: String = names.iter().map(|name| format!("<th>{name}</th>")).collect();
    let rows: String = minima.list.iter().map(row).collect();
    html += &format!(
        "<div class=\"wide\" tabindex=\"0\"><table><thead><tr><td></td>{heads}<th>misfit over the least seen in the same way</th>\
         <th>seen in</th></tr></thead>\n<tbody>{rows}</tbody></table></div>"
    );
    html
}

/// How much was measured, and how the file was read.
fn measured(measured: &Measured) -> String {
    let Measured { label, points, values, recording } = measured;
    let mut words = vec![format!("{label}: {points} points, {values} values")];
    if let Some(recording) = recording {
        let Recording { format, marker, likelihood, axes, fps, scale, origin, y, time_zero, sigma } =
            recording;
        words.extend(sigma.as_ref().map(|_| "with a noise of each row's own".to_string()));
        words.extend(format.map(|format| format!("a file of {}", format.program())));
        words.extend(marker.as_ref().map(|marker| format!("marker {marker}")));
        words.extend(likelihood.map(|least| format!("likelihood {least} and above")));
        words.extend(axes.map(|axes| format!("axes {}", Vec::from(axes).join(", "))));
        words.extend(fps.map(|fps| format!("{fps} frames a second")));
        words.extend(scale.map(|scale| format!("{} a pixel", quantity(scale, "m"))));
        words.extend(origin.map(|[x, y, z]| format!("origin at ({x}, {y}, {z})")));
        words.extend(y.map(|y| match y {
            Vertical::Up => "y up".to_string(),
            Vertical::Down => "y down".to_string(),
        }));
        words.extend(
            time_zero.map(|t| format!("motion from {t} on the clock of the file, in its unit")),
        );
    }
    words.join("; ")
}

/// What was simulated, experiment by experiment.
pub(super) fn settings_table(settings: &[SimulationSettings]) -> String {
    table(&settings_rows(settings))
}

/// Keys with plain text.
type Rows = Vec<(&'static str, String)>;

fn settings_rows(all: &[SimulationSettings]) -> Rows {
    let mut rows = Rows::new();
    for settings in all {
        if !settings.experiment.is_empty() {
            rows.push(("experiment", settings.experiment.clone()));
        }
        rows.extend(settings.scene.iter().map(|scene| ("scene", scene.clone())));
        rows.extend(settings.measurements.iter().map(|own| ("measured", measured(own))));
        rows.push(("model", settings.model.clone()));
        rows.extend(settings.scheme.iter().map(|scheme| ("scheme", scheme.clone())));
        if let (Some(step), Some(end)) = (settings.step, settings.end) {
            rows.push(("step", format!("{} up to {}", quantity(step, "s"), quantity(end, "s"))));
        }
        let edge = settings.length / settings.segments.max(1) as f64;
        let segments = format!(
            "{} on {}, about {} each",
            settings.segments,
            quantity(settings.length, "m"),
            quantity(edge, "m")
        );
        rows.push(("segments", segments));
    }
    rows
}

fn table(rows: &Rows) -> String {
    let row = |(key, value): &(&str, String)| {
        format!("<tr><th>{key}</th><td>{}</td></tr>\n", escaped(value))
    };
    format!("<table class=\"plain\">{}</table>", rows.iter().map(row).collect::<String>())
}

fn run(report: &FitReport, plots: Option<&PlotData>) -> String {
    let mut rows = settings_rows(plots.map_or(&[][..], |e| &e.settings));
    for dropped in &report.dropped {
        rows.push(("left out", format!("{}: rows {}", dropped.observation, dropped.rows)));
    }
    rows.push(("work", format!("{:.1} simulations", report.simulations)));
    rows.push(("time", format!("{} s", short(report.wall_seconds))));
    if let Some(plots) = plots {
        rows.push(("rodfit", plots.version.clone()));
    }
    table(&rows)
}
