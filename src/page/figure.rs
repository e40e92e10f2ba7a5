//! Figures in HTML: the drawing of a chart with its title, legend, caption and a link to its data as CSV.
//!
//! Input of [`figure`]: one chart with its title and name (text) and caption (HTML). The name, unique on the page, is
//! that of the CSV file; a chart without data has no link. [`row`] places several figures side by side, and is empty
//! without figures. Colors of observed and simulated data are CSS variables of the page, also those of several series
//! ([`series_color`]), which repeat after the sixth. All sections with charts use this module.

use crate::page::chart::PageChart;
use crate::page::drawing::svg;
use crate::page::html::escaped;

/// CSS color of observed data.
pub(super) const OBSERVED: &str = "var(--observed)";
/// CSS color of simulated data.
pub(super) const MODEL: &str = "var(--model)";

/// CSS color of series number `k` (from 0) of several; the colors repeat after the sixth.
pub(super) fn series_color(k: usize) -> String {
    format!("var(--scheme{})", k % 6)
}

/// A figure in HTML: title with the label of the y axis, drawing, legend, caption and CSV link (none without data).
/// `title` is text; `caption` is HTML; `name` is text, unique on the page, for screen readers and for the name of the
/// CSV file.
pub(super) fn figure(title: &str, name: &str, chart: &PageChart, caption: &str) -> String {
    let label = format!("role=\"img\" aria-label=\"{}\"", escaped(name));
    let drawing = svg(chart).replacen("role=\"img\"", &label, 1);
    let legend = chart.legend();
    let mut parts = vec![legend.trim(), caption.trim()];
    parts.retain(|part| !part.is_empty());
    let link = match (chart.csv(name), parts.is_empty()) {
        (link, _) if link.is_empty() => link,
        (link, true) => format!("<span class=\"csv\">{link}</span>"),
        (link, false) => format!("<span class=\"csv\"> \u{2013} {link}</span>"),
    };
    // Narrow screens have no room for the label of a vertical axis beside the drawing.
    let axis = escaped(&chart.axes[1].label);
    let axis = format!("<span class=\"axis\"> \u{2013} {axis}</span>");
    format!(
        "<figure><h3 class=\"small\">{}{axis}</h3>{drawing}<figcaption>{}{link}</figcaption></figure>\n",
        escaped(title),
        parts.join(" \u{2013} ")
    )
}

/// Figures (HTML) side by side where there is room; empty without figures.
pub(super) fn row(figures: &str) -> String {
    match figures.is_empty() {
        true => String::new(),
        false => format!("<div class=\"row\">{figures}</div>\n"),
    }
}
