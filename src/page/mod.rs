//! HTML pages of results, one function per kind: fit, field fit, prediction, simulation of a rod or a structure,
//! study, design, comparison of fits.
//!
//! Input: a report of the library, for simulations also the stored frames of the motion. Output: one HTML file with
//! style, charts (SVG), tables, CSV data and, for motions, an animation. It opens offline, without scripts, fonts or
//! links from elsewhere; control characters in names are escaped. Each kind of page has a module of its name. Modules
//! of sections are `card`, `estimate`, `parameters`, `residuals`, `recordings`, `discretization`, `budget`, `effects`,
//! `correlation`, `profile`, `search`, `trajectory`, `overlay`, `snapshots`, `player` and `settings`. They use `chart`
//! with `plotted`, `drawing` and `csv`, `figure`, `table`, `plane`, `number` and `html`.

mod budget;
mod card;
mod chart;
mod comparison;
mod correlation;
mod csv;
mod design;
mod discretization;
mod drawing;
mod effects;
mod estimate;
mod field;
mod figure;
mod fit;
mod html;
mod number;
mod obstacles;
mod overlay;
mod parameters;
mod plane;
mod player;
mod plotted;
mod posterior;
mod prediction;
mod profile;
mod recordings;
mod residuals;
mod search;
mod settings;
mod simulation;
mod snapshots;
mod structure;
mod study;
mod table;
mod trajectory;

pub use comparison::comparison_page;
pub use design::design_page;
pub use field::field_page;
pub use fit::fit_page;
pub use prediction::prediction_page;
pub use simulation::simulation_page;
pub use structure::structure_page;
pub use study::study_page;

use crate::page::html::escaped;
use marker_files::printable::printable;

/// The style sheet (CSS) of all pages.
const STYLE: &str = include_str!("page.css");
/// The title of the program in citations.
const CITED_TITLE: &str = "rodfit: simulation of slender elastic rods and identification of their parameters from recorded motion";

/// A whole HTML page with style, header, `body` and a citation as footer. `kind` (such as `Fit`) and `body` are HTML,
/// `title` is text; `version` is that of the program that computed the result, by default this one. Control characters
/// are escaped, as names from files may have them.
fn page(kind: &str, title: &str, body: &str, version: Option<&str>) -> String {
    let title = escaped(&printable(title));
    let body = printable(body);
    let version = escaped(version.unwrap_or(env!("CARGO_PKG_VERSION")));
    format!(
        "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\
         <meta name=\"color-scheme\" content=\"light dark\"><title>{kind}: {title}</title>\n\
         <style>{STYLE}</style></head>\n<body><main>\n\
         <header><p class=\"kind\">{kind}</p><h1>{title}</h1></header>\n{body}\
         <footer><p class=\"cite\">Cite as: The rodfit authors. <i>{CITED_TITLE}</i>. Version {version}. Computer \
         software.</p></footer></main></body></html>\n"
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cited_title_is_that_of_the_citation_file() {
        let citation = include_str!("../../CITATION.cff");
        assert!(citation.contains(&format!("title: \"{CITED_TITLE}\"")));
        assert!(citation.contains(concat!("version: ", env!("CARGO_PKG_VERSION"))));
    }
}
