//! Reproduces Fig. 3 of Huang & Jawed (2019): tip deflection of the cantilever (a) and of the helix (b)
//! over time for three values of beta (1 to 3), and the first minimum over the step (4), with the
//! paper's discretization. Writes the curves as CSV and the figure as SVG.
//!
//! `cargo run --release --example paper_figure_3 [FOLDER]`, by default `target/paper_figure_3`

use kuva::prelude::{Figure, Layout, LinePlot, Plot, SvgBackend};
use rodfit::scene::{Clamp, Scene, Time};
use std::path::PathBuf;

/// Colors of the curves of a panel.
const COLORS: [&str; 3] = ["#0072b2", "#d55e00", "#009e73"];
/// Points of a curve: abscissa and ordinate.
type Curve = Vec<(f64, f64)>;

/// Deflection of the tip along gravity over the length `scale`, m, at every step until `end`, s. None if the simulation fails.
fn deflection(scene: &Scene, scale: f64, beta: f64, step: f64, end: f64) -> Option<Curve> {
    let mut scene = scene.clone();
    scene.supports.clamp = Clamp::Nodes;
    scene.time = Some(Time { beta, ..Time::new(end, step) });
    let down = scene.loads.gravity.iter().position(|g| *g < 0.0)?;
    // A failed step ends the simulation: there is no curve to draw.
    let run = scene.problem().ok()?.simulate().ok()?;
    let drop = |k: usize| (run.tip(0)[down] - run.tip(k)[down]) / scale;
    Some(run.times().iter().enumerate().map(|(k, t)| (*t, drop(k))).collect())
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let root = env!("CARGO_MANIFEST_DIR");
    let folder = std::env::args().nth(1).map_or(format!("{root}/target/paper_figure_3"), |f| f);
    let folder = PathBuf::from(folder);
    std::fs::create_dir_all(&folder)?;
    let (mut plots, mut layouts) = (Vec::new(), Vec::new());
    // Length scale and the window of the first minimum, s.
    for (name, panel, scale, window) in
        [("cantilever", "a", 0.5, [0.35, 0.75]), ("helix", "b", 0.184_88, [0.16, 0.26])]
    {
        let scene = Scene::load(format!("{root}/data/{name}.toml"))?;
        let mut draw = |curves: Vec<(String, Curve)>, part: usize, title: String, x: &str| {
            let mut table = csv::Writer::from_path(folder.join(format!("{panel}{part}.csv")))?;
            table.write_record(["curve", x, "deflection/length"])?;
            for (label, curve) in &curves {
                for (x, y) in curve {
                    table.serialize((label, x, y))?;
                }
            }
            let lines = curves.into_iter().zip(COLORS).map(|((label, curve), color)| {
                Plot::Line(LinePlot::new().with_data(curve).with_color(color).with_legend(label))
            });
            plots.push(lines.collect::<Vec<Plot>>());
            let layout = Layout::auto_from_plots(&plots[plots.len() - 1]).with_title(title);
            layouts.push(layout.with_x_label(x).with_y_label("deflection/length"));
            table.flush().map_err(csv::Error::from)
        };
        for (part, beta) in [(1, 1.0), (2, 0.75), (3, 0.5)] {
            let curve = |step: f64| {
                Some((format!("{} ms", 1e3 * step), deflection(&scene, scale, beta, step, 5.0)?))
            };
            let curves = [5e-3, 2e-3, 1e-3].into_iter().filter_map(curve).collect();
            draw(curves, part, format!("({panel}{part}) {name}, beta = {beta}"), "time, s")?;
        }
        // The fourth panel has the first minimum over the step, which shows the numerical dissipation.
        let minimum = |beta: f64, step: f64| {
            let curve = deflection(&scene, scale, beta, step, window[1])?;
            let inside = curve.iter().filter(|(t, _)| *t >= window[0]);
            Some((1e3 * step, inside.map(|(_, y)| *y).fold(f64::INFINITY, f64::min)))
        };
        let steps = [0.1, 0.2, 0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0];
        let curves = [1.0, 0.75, 0.5].map(|beta| {
            let curve = steps.iter().filter_map(|ms| minimum(beta, 1e-3 * ms)).collect();
            (format!("beta = {beta}"), curve)
        });
        draw(curves.into(), 4, format!("({panel}4) {name}, first minimum"), "step, ms")?;
    }
    let figure = Figure::new(2, 4).with_plots(plots).with_layouts(layouts);
    let scene = figure.with_cell_size(420.0, 320.0).render();
    std::fs::write(folder.join("figure_3.svg"), SvgBackend::default().render_scene(&scene))?;
    println!("{}", folder.display());
    Ok(())
}
