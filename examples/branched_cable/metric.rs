//! Error of a model on a clip, as the authors of the recordings measure it.
//!
//! The motion starts from the first two frames. Errors are averaged over frames, coordinates and slots of markers. Slots are as
//! many for each branch as the parent has markers; those without a marker, and held markers, count as zero. A junction counts
//! again for each child that starts there.

use crate::cable::Cable;
use rodfit::scene::StructurePoint;
use rodfit::{Error, Structure, StructureScene};

/// Mean square error of a clip, m^2, in the units of the metric.
pub fn mean_square(cable: &Cable, scene: &StructureScene) -> Result<f64, Error> {
    let structure = Structure::new(scene.clone())?;
    let Some(recording) = &structure.scene().recording else {
        return Err(Error::Fit("no recording".into()));
    };
    let Some(track) = recording.track.clone() else {
        return Err(Error::Fit("a recording that is not read".into()));
    };
    // Number of times that each marker counts.
    let count = |name: &str| {
        let i = cable.markers.iter().position(|marker| marker.name == name).unwrap_or(0);
        let roots = cable
            .markers
            .iter()
            .filter(|m| m.previous == Some(i) && m.branch != cable.markers[i].branch);
        1.0 + roots.count() as f64
    };
    let points: Vec<(usize, f64, StructurePoint)> = recording
        .markers
        .iter()
        .filter_map(|(name, place)| {
            let marker = track.markers().iter().position(|marker| marker.name == *name)?;
            Some((marker, count(name), place.clone()))
        })
        .collect();
    let nodes = structure.nodes();
    let stencils: Vec<_> = points
        .iter()
        .map(|(_, _, point)| nodes.stencil(point, "recording.markers"))
        .collect::<Result<_, _>>()?;
    let mut motion = structure.simulation()?;
    let (time, mut sum) = (structure.time()?.clone(), 0.0);
    let mut steps = 0;
    for (k, at) in track.times().iter().enumerate().skip(1) {
        while time.at(steps) < at - 1e-9 {
            steps += 1;
            motion.step_to(time.at(steps))?;
        }
        if k < 2 {
            continue;
        }
        let state = motion.simulation().state();
        let rod = motion.simulation().rod();
        let all = structure.node_motions(rod, [&state.q, &state.v], &state.frames);
        for ((marker, weight, _), stencil) in points.iter().zip(&stencils) {
            let Some(seen) = track.markers()[*marker].seen[k] else { continue };
            let found =
                |c: usize| stencil.nodes.iter().map(|(i, w)| w * all[*i][0][c]).sum::<f64>();
            sum += weight * (0..3).map(|c| (found(c) - seen[c]).powi(2)).sum::<f64>();
        }
    }
    let slots = (1 + cable.children) * cable.parent;
    Ok(sum / (track.times().len() * slots * 3) as f64)
}
