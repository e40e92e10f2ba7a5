//! The page of a simulation of a structure.
//!
//! Input are the structure, the report and the film of a run. The film has frames with the nodes of all rods, and
//! samples of the energies and of the last rod's tip. The first card has the status of the run, the tips of all rods at
//! its end, and the warnings. Sections follow with the animation, shapes of several frames side by side, energies
//! and the tip of the last rod over time. The last one has scene, model, mesh, time step, scheme and cost. Without
//! frames there are the card and the settings only. Output is a self-contained HTML page.

use crate::page::chart::labeled;
use crate::page::html::{escaped, section};
use crate::page::number::{Scale, quantity};
use crate::page::page;
use crate::page::plane::{AXES, planes};
use crate::page::player::{PlayedMotion, motion_player};
use crate::page::simulation::{coordinate, energy, run_card, run_settings, snapshots, tip};
use crate::page::table::HtmlTable;
use crate::structure::{Structure, StructureFilm, StructureReport};

/// A self-contained HTML page of a simulation of a structure. The film has the stored frames (nodes of all rods) and
/// samples (energies, tip of the last rod). `title` names the simulation, for example its scene file. Without stored
/// frames it has the first card and the settings only.
pub fn structure_page(
    structure: &Structure,
    report: &StructureReport,
    film: &StructureFilm,
    title: &str,
) -> String {
    let (frames, samples) = (film.frames(), film.samples());
    let mut body = first_card(report);
    let planes = planes(|| frames.iter().flat_map(|frame| &frame.nodes));
    // The film has the nodes of all rods, but only the tip of the last one.
    if let (false, Some(last)) = (frames.is_empty(), structure.scene().rods.last()) {
        let motion = PlayedMotion {
            frames,
            samples,
            length: structure.length(),
            gravity: structure.scene().loads.gravity,
            contacts: &structure.scene().contacts,
            thinned: String::new(),
            model: format!("The path is that of the tip of {}", escaped(&last.name)),
        };
        body += &section("Trajectory", &motion_player(&motion, &planes));
        body += &section("Shapes over time", &snapshots(frames, &planes));
        body += &section("Energy", &energy(samples));
        body += &section(&format!("Tip of {}", last.name), &tip(samples, &planes));
    }
    body += &section("Settings and cost", &settings(structure, report));
    page("Simulation", title, &body, None)
}

/// The first card, HTML: the status of the run, a table with the tips of all rods at its end, and the warnings. The
/// tips have one unit with a prefix, by the largest absolute coordinate.
fn first_card(report: &StructureReport) -> String {
    let rods = report.shape.rods.iter();
    let scale = Scale::for_values(rods.clone().flat_map(|(_, rod)| rod.tip), "m");
    let mut table = HtmlTable::new("tips of the rods at the end", rods)
        .id("answer")
        .text("rod", |(name, _)| name.to_string());
    for (c, axis) in AXES.iter().enumerate() {
        let head = labeled(axis, &scale.unit);
        table = table.text(&head, |(_, rod)| coordinate(&scale, rod.tip[c]));
    }
    run_card(&report.status, &report.warnings, &table.render())
}

/// The HTML table of scene file, model, number and length of segments, time step, scheme, and cost of the run.
fn settings(structure: &Structure, report: &StructureReport) -> String {
    let scene = structure.scene();
    let edges = format!(
        "{} rods with {} segments on {}",
        scene.rods.len(),
        structure.segments(),
        quantity(structure.length(), "m")
    );
    let space = if structure.is_spatial() { "in space" } else { "in a plane" };
    let model = format!("structure {space}, {} degrees of freedom", report.dof);
    let work = &report.work;
    let cost = format!("{} steps, {} Newton iterations", work.steps, work.newton_iterations);
    run_settings(scene.path.as_deref(), model, edges, scene.time.as_ref())
        .row("cost", cost)
        .render()
}
