//! Frames of a motion for ParaView: one VTK file (XML, polydata) per frame, and a collection with their times.
//!
//! Input: a trajectory and the radii of the edges, m. Output: named texts, `rod_0000.vtp` and so on, and `rod.pvd`. A
//! frame has the nodes in world axes, m, one line through them, and per node the velocity, m/s, and the radius, m (of
//! the edge after it). Frames are steps of the run, evenly spaced, with the first and the last one.

use crate::dynamics::Trajectory;
use std::fmt::Write;

/// A file of an export.
#[derive(Clone, Debug)]
pub struct NamedText {
    /// File name without folder.
    pub name: String,
    /// Content.
    pub text: String,
}

/// At most `frames` frames of a trajectory, at least its first and last one, and the collection of them. `radii` are
/// those of the edges, m. Panics for a trajectory without states, or with nodes that were not tracked.
pub(super) fn animation(trajectory: &Trajectory, radii: &[f64], frames: usize) -> Vec<NamedText> {
    let last = trajectory.times().len().saturating_sub(1);
    let parts = frames.saturating_sub(1).clamp(1, last.max(1));
    let mut files = Vec::with_capacity(parts + 2);
    let mut entries = String::new();
    for frame in 0..=parts.min(last) {
        let step = frame * last / parts;
        let name = format!("rod_{frame:04}.vtp");
        let time = trajectory.times()[step];
        let _ = writeln!(entries, "    <DataSet timestep=\"{time}\" file=\"{name}\"/>");
        files.push(NamedText { name, text: polydata(trajectory, radii, step) });
    }
    let text = format!(
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"0.1\" byte_order=\"LittleEndian\">\n  \
         <Collection>\n{entries}  </Collection>\n</VTKFile>\n"
    );
    files.push(NamedText { name: "rod.pvd".into(), text });
    files
}

/// The text of the polydata file of a `step` of a trajectory: nodes, the line through them, velocities and radii.
/// `radii` are those of the edges, m: a node has that of the edge after it, the last node that of the last edge.
fn polydata(trajectory: &Trajectory, radii: &[f64], step: usize) -> String {
    let count = trajectory.nodes();
    let row = |[x, y, z]: [f64; 3]| format!("{x} {y} {z}\n");
    let points: String = (0..count).map(|i| row(trajectory.node(i, step))).collect();
    let velocities: String = (0..count).map(|i| row(trajectory.velocity(i, step))).collect();
    let radius: String =
        (0..count).map(|i| format!("{}\n", radii[i.min(radii.len() - 1)])).collect();
    let line: String = (0..count).map(|i| format!("{i} ")).collect();
    let array = |name: &str, kind: &str, components: usize, values: &str| {
        format!(
            "<DataArray type=\"{kind}\" Name=\"{name}\" NumberOfComponents=\"{components}\" format=\"ascii\">\n\
             {values}</DataArray>\n"
        )
    };
    let offsets = format!("{count}\n");
    format!(
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"PolyData\" version=\"0.1\" byte_order=\"LittleEndian\">\n<PolyData>\n\
         <Piece NumberOfPoints=\"{count}\" NumberOfVerts=\"0\" NumberOfLines=\"1\" NumberOfStrips=\"0\" \
         NumberOfPolys=\"0\">\n<PointData>\n{}{}</PointData>\n<Points>\n{}</Points>\n<Lines>\n{}{}</Lines>\n\
         </Piece>\n</PolyData>\n</VTKFile>\n",
        array("velocity", "Float64", 3, &velocities),
        array("radius", "Float64", 1, &radius),
        array("points", "Float64", 3, &points),
        array("connectivity", "Int64", 1, &format!("{line}\n")),
        array("offsets", "Int64", 1, &offsets),
    )
}
