//! Pages that open offline: one file each, without scripts, fonts or links from elsewhere.

mod chart;
mod figures;
mod fit;
mod number;
mod study;

pub use fit::fit_page;
pub use study::study_page;

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
