//! Figures: a chart with its title, legend, caption and data.

use crate::page::chart::Chart;
use crate::page::drawing::svg;
use crate::page::html::escaped;

/// Colors of observations and of the model.
pub(super) const OBSERVED: &str = "var(--observed)";
pub(super) const MODEL: &str = "var(--model)";

/// A figure. `title` and `caption` are HTML; `name` is text, unique on the page, which names the drawing and its CSV.
pub(super) fn figure(title: &str, name: &str, chart: &Chart, caption: &str) -> String {
    let drawing = svg(chart);
    let label = format!("role=\"img\" aria-label=\"{}\"", escaped(name));
    let drawing = drawing.replacen("role=\"img\"", &label, 1);
    let parts = [chart.legend(), caption.into()];
    let parts: Vec<&str> = parts.iter().map(|part| part.trim()).filter(|p| !p.is_empty()).collect();
    let link = match (chart.csv(name), parts.is_empty()) {
        (link, _) if link.is_empty() => link,
        (link, true) => format!("<span class=\"csv\">{link}</span>"),
        (link, false) => format!("<span class=\"csv\"> \u{2013} {link}</span>"),
    };
    format!(
        "<figure><h3 class=\"small\">{title}</h3>{drawing}<figcaption>{}{link}</figcaption></figure>\n",
        parts.join(" \u{2013} ")
    )
}

/// Figures side by side where there is room.
pub(super) fn row(figures: &str) -> String {
    match figures.is_empty() {
        true => String::new(),
        false => format!("<div class=\"row\">{figures}</div>\n"),
    }
}
