//! Draws the picture of the README as SVG: the falling cantilever at seven times, and its simulated tip height against the
//! recorded one.
//!
//! `cargo run --release --example picture`

use rodfit::{Fit, Observation, Parameter, Point, Scene};
use std::fmt::Write;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let root = env!("CARGO_MANIFEST_DIR");
    let problem = Scene::load(format!("{root}/data/cantilever.toml"))?.problem()?;
    let seen = Observation::read(format!("{root}/data/cantilever-tip.csv"))?;
    let fit =
        Fit::new(&problem).observe(seen.clone()).identify(Parameter::YoungsModulus).solve()?;
    let run = problem.with(fit.parameters())?.simulate()?;

    let mut svg = String::from(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 760 250\" \
         font-family=\"sans-serif\" font-size=\"13\" fill=\"none\">\n\
         <rect width=\"760\" height=\"250\" fill=\"#fff\"/>\n\
         <rect x=\"22\" y=\"10\" width=\"8\" height=\"50\" fill=\"#888\"/>\n",
    );
    // Shapes of the rod, later ones darker.
    for k in (0..=300).step_by(50) {
        let points = (0..run.nodes()).map(|i| run.node(i, k));
        let points: String = points
            .map(|[x, y, _]| format!("{:.1},{:.1} ", 30.0 + 500.0 * x, 35.0 - 500.0 * y))
            .collect();
        let shade = 200 - k * 2 / 3;
        writeln!(
            svg,
            "<polyline points=\"{points}\" stroke=\"rgb({shade},{shade},{shade})\" stroke-width=\"2\"/>"
        )?;
    }
    // Tip height over time: line simulated, dots recorded.
    let place = |t: f64, y: f64| (340.0 + 400.0 * t, 35.0 - 500.0 * y);
    let mut line = String::new();
    for k in 0..=500 {
        let t = f64::from(k) / 500.0;
        let (x, y) = place(t, run.at(Point::Tip, t)?.0[1]);
        write!(line, "{x:.1},{y:.1} ")?;
    }
    for sample in &seen.samples {
        if let [_, Some(y), _] = sample.position {
            let (x, y) = place(sample.time, y);
            writeln!(svg, "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"2.2\" fill=\"#d55e00\"/>")?;
        }
    }
    writeln!(svg, "<polyline points=\"{line}\" stroke=\"#0072b2\" stroke-width=\"1.3\"/>")?;
    let estimate = &fit.parameters[0];
    let (e, error) = (estimate.value.unwrap_or(f64::NAN), estimate.std_error.unwrap_or(f64::NAN));
    writeln!(
        svg,
        "<text x=\"370\" y=\"212\" fill=\"#333\">tip height over 1 s, recorded (dots) and fitted (line)</text>\n\
         <text x=\"370\" y=\"232\" fill=\"#333\">E = {:.2} &#177; {:.2} MPa</text>\n</svg>",
        e / 1e6,
        error / 1e6
    )?;
    std::fs::write(format!("{root}/docs/cantilever.svg"), svg)?;
    Ok(())
}
