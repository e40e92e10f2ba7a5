//! Page of a simulation of a structure.

use crate::scenes::{joint, spatial, spatial_rod, support};
use rodfit::page::structure_page;
use rodfit::structure::{StructureFilm, StructureReport};

/// Two rods in space without weight, whose spring opens: the page names the model, the z axis is upwards, and the tips
/// have a unit with a prefix.
#[test]
fn page_of_a_structure_in_space_has_model_upward_axis_and_unit_of_tips() {
    let structure = spatial(&[
        spatial_rod("a", 8, 0.2, [1.0, 0.2, 0.0]),
        spatial_rod("b", 8, 0.15, [0.3, 1.0, 0.5]),
        joint("spring", &["a.end", "b.start"], "rotation = 20.0\nrest = [0.1, 0.0, 0.0]"),
        support("a.start", "clamped"),
        "[time]\nend = 2e-4\nstep = 1e-4\n".into(),
    ]);
    let time = structure.time().unwrap();
    let mut motion = structure.simulation().unwrap();
    let (mut report, mut film) = (StructureReport::new(&structure), StructureFilm::new(2));
    report.push(&motion);
    film.push(&motion);
    for k in 1..=2 {
        motion.step_to(time.at(k)).unwrap();
        report.push(&motion);
        film.push(&motion);
    }
    report.finish(&structure, &Ok(()));
    let page = structure_page(&structure, &report, &film, "spring");
    assert!(page.contains("structure in space, "));
    assert!(page.contains("\"axes\":[\"x\",\"y\",\"z\"]"));
    let tips = page.split("id=\"answer\"").nth(1).unwrap().split("</table>").next().unwrap();
    assert!(tips.contains("x (mm)"), "{tips}");
}
