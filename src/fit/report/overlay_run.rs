//! Places of the rod and of the markers in the pictures of the recordings, at a point of the unknowns.
//!
//! Input: experiments whose measurements have pictures (key `image`), fitted or validation data. Of each recording
//! [`SHOWN_FRAMES`] pictures are evenly spaced over those that are there, and one has the largest distance between
//! recorded and simulated markers. An experiment is simulated twice: the first run has the markers of all pictures, the
//! second one stores the whole rod around the times of the chosen ones. A rolling shutter reads each node at a time of
//! its own. All positions are those that the camera records, lens distortion included. Output: [`ImageOverlay`] with
//! the bytes of the pictures, up to [`MOST_BYTES`] in total; further ones and those that cannot be read have none.
//! Errors are those of the simulations.

use crate::dynamics::Trajectory;
use crate::error::Error;
use crate::fit::image::{
    ImageFrame, ImageSeries, MOST_BYTES, SHOWN_FRAMES, evenly_spaced, read_image,
};
use crate::fit::measurement::Measurement;
use crate::fit::measurement::experiment::Experiment;
use crate::fit::misfit::camera::View;
use crate::fit::misfit::observed_experiment::ExperimentRun;
use crate::fit::misfit::residuals::Residuals;
use crate::fit::report::image_overlay::{ImageOverlay, OverlayMarker};
use crate::fit::report::node_history::NodeHistory;
use crate::fit::report::replay::ROW_ITERATIONS;
use crate::fit::search::Search;
use crate::fit::structure::structure_run::{motion_at_rest, repeated_motion};
use crate::fit::unknown::Unknown;
use crate::numerics::total_order;
use crate::scene::marker::MarkerStencil;
use crate::structure::Structure;
use std::path::Path;

/// Largest difference between the times of one frame in two files, s.
const SAME_TIME: f64 = 1e-9;

/// The overlays of all `experiments` with pictures, at `x`, the unknowns of `search` on their scales, in the order of
/// the experiments, recordings and times.
pub(crate) fn image_overlays(
    search: &Search,
    experiments: &[Experiment],
    x: &[f64],
) -> Result<Vec<ImageOverlay>, Error> {
    let mut all = Vec::new();
    for experiment in experiments {
        let own = experiment.only(|m| m.header.images.is_some());
        if !own.measurements.is_empty() {
            all.extend(overlays_of(search, &own, x)?);
        }
    }
    add_files(&mut all);
    Ok(all)
}

/// Measurements with the same pictures.
struct ImagedGroup<'a> {
    images: &'a ImageSeries,
    measurements: Vec<&'a Measurement>,
}

/// The measurements of an experiment by their pictures. Tables with one pattern and one placement share them.
fn groups(experiment: &Experiment) -> Vec<ImagedGroup<'_>> {
    let mut groups: Vec<ImagedGroup> = Vec::new();
    for measurement in &experiment.measurements {
        let Some(images) = measurement.header.images.as_deref() else { continue };
        let is_same = |group: &&mut ImagedGroup| {
            let own = group.images;
            own.name == images.name && own.placement == images.placement && own.size == images.size
        };
        match groups.iter_mut().find(is_same) {
            Some(group) => group.measurements.push(measurement),
            None => groups.push(ImagedGroup { images, measurements: vec![measurement] }),
        }
    }
    groups
}

/// The overlays of one experiment, all of whose measurements have pictures.
fn overlays_of(
    search: &Search,
    experiment: &Experiment,
    x: &[f64],
) -> Result<Vec<ImageOverlay>, Error> {
    let unknowns: Vec<Unknown> =
        search.unknowns.iter().map(|u| Unknown { prior: None, ..u.clone() }).collect();
    let ones = vec![1.0; experiment.measurements.len()];
    let alone = std::slice::from_ref(experiment);
    let residuals = Residuals::new(alone, &ones, &unknowns, &[f64::MAX], search.full_work)?
        .with_work_counter(search.work.clone());
    let run = residuals.run(0, x, false, &mut |_, _| {})?;
    let view = View::new(&run.problem, |_, value: f64| value);
    let mut overlays = Vec::new();
    let mut intervals = Vec::new();
    for group in groups(experiment) {
        for overlay in chosen_overlays(experiment, &group, &run, &view)? {
            if let Some(clock) = overlay.time {
                intervals.push(time_interval(group.images, &view, clock));
            }
            overlays.push((group.images, overlay));
        }
    }
    // The second run stores the whole rod around the times of the chosen pictures.
    let lines = line_lengths(&run);
    let mut history = NodeHistory::new(intervals, run.problem.scene().time.as_ref());
    match (&run.structure, &run.moving) {
        (_, None) => {}
        (None, Some(_)) => {
            residuals.run(0, x, false, &mut |problem, simulation| {
                let nodes = (0..problem.nodes()).map(|i| simulation.position(i));
                history.store(simulation.time(), nodes);
            })?;
        }
        (Some(structure), Some(moving)) => {
            let all: Vec<usize> = (0..lines.iter().sum()).collect();
            let (times, taken) = (moving.times(), &moving.record().taken);
            let motions = repeated_motion(structure, &all, times, taken, |_, value: f64, _| value)?;
            for (time, motions) in times.iter().zip(motions.chunks_exact(all.len().max(1))) {
                history.store(*time, motions.iter().map(|[position, _]| *position));
            }
        }
    }
    let end = run.moving.as_ref().and_then(|own| own.times().last().copied()).unwrap_or(0.0);
    let resting = resting_nodes(&run, lines.iter().sum())?;
    for (images, overlay) in &mut overlays {
        let mut first = 0;
        for count in &lines {
            let nodes = first..first + count;
            first += count;
            let recorded = |i: usize| match overlay.time {
                Some(clock) => recorded_node(&history, &view, i, [clock, end]),
                None => resting.get(i).map(|x| view.pictured(*x)),
            };
            let places = nodes.filter_map(|i| images.placement.place(recorded(i)?.map(Some)));
            overlay.rods.push(places.collect());
        }
    }
    Ok(overlays.into_iter().map(|(_, overlay)| overlay).collect())
}

/// The overlays of the chosen pictures of a group, by increasing time, with their markers and without rods and files.
fn chosen_overlays(
    experiment: &Experiment,
    group: &ImagedGroup,
    run: &ExperimentRun,
    view: &View<f64>,
) -> Result<Vec<ImageOverlay>, Error> {
    let images = group.images;
    let mut all = Vec::with_capacity(images.frames.len());
    for frame in &images.frames {
        let mut markers = Vec::new();
        for measurement in &group.measurements {
            markers.extend(markers_in(frame, measurement, images, run, view)?);
        }
        all.push(ImageOverlay {
            experiment: experiment.name.clone(),
            pattern: images.name.clone(),
            file: frame.file.display().to_string(),
            time: frame.time,
            size: images.size,
            pixel: images.placement.pixel,
            rods: Vec::new(),
            rms: ImageOverlay::rms_distance(&markers),
            markers,
            is_worst: false,
            held_out: group.measurements.iter().all(|m| m.held_out()),
            image: None,
        });
    }
    let distances = all.iter().enumerate().filter_map(|(k, own)| Some((k, own.rms?)));
    let worst = distances.max_by_key(|(_, rms)| total_order(*rms)).map(|(k, _)| k);
    let mut chosen = evenly_spaced(all.len(), SHOWN_FRAMES);
    if let Some(worst) = worst.filter(|_| all.len() > 1) {
        all[worst].is_worst = true;
        chosen.push(worst);
        chosen.sort_unstable();
        chosen.dedup();
    }
    let is_chosen = |k: usize| chosen.binary_search(&k).is_ok();
    Ok(all.into_iter().enumerate().filter(|(k, _)| is_chosen(*k)).map(|(_, own)| own).collect())
}

/// The markers of a measurement in a picture: the recorded and the simulated place of each. Markers without a recorded
/// place are left out. Errors: points that are not on the rod, and times after the end of the simulation.
fn markers_in(
    frame: &ImageFrame,
    measurement: &Measurement,
    images: &ImageSeries,
    run: &ExperimentRun,
    view: &View<f64>,
) -> Result<Vec<OverlayMarker>, Error> {
    let mesh = run.problem.scene().made_mesh();
    let structure = run.structure.as_ref().map(Structure::nodes);
    let mut markers = Vec::new();
    let mut add = |position: [Option<f64>; 3], simulated: Option<[f64; 3]>| {
        if let Some(recorded) = images.placement.place(position) {
            let pictured = simulated.map(|x| view.pictured(x).map(Some));
            let simulated = pictured.and_then(|x| images.placement.place(x));
            markers.push(OverlayMarker { recorded, simulated });
        }
    };
    if let (Some(own), Some(clock), Some(moving)) = (measurement.motion(), frame.time, &run.moving)
    {
        // As they were read: a fit leaves out coordinates that are constant.
        let positions = &measurement.header.imaged;
        let k = positions.partition_point(|s| s.time < clock - SAME_TIME);
        if let Some(sample) = positions.get(k).filter(|s| s.time <= clock + SAME_TIME) {
            let end = moving.times().last().copied().unwrap_or(0.0);
            let time = view.sample_time(sample.time, &sample.position).min(end);
            let stencil = own.stencil(&mesh, structure.as_ref())?;
            add(sample.position, Some(moving.record().read().marker(&stencil, time)?));
        }
    }
    if let (Some(own), Some(resting)) = (measurement.shape(), &run.resting) {
        for sighting in &own.sightings {
            // Points without arc lengths are compared with the nearest points of the rod.
            let simulated = match (own.place(sighting.point), &structure) {
                _ if own.arc_lengths_fitted => None,
                (Some(place), Some(nodes)) => {
                    let stencil = nodes.stencil(&place, "shape.rod")?;
                    Some(resting.record().read().position(&stencil, 0.0)?)
                }
                _ => {
                    let stencil =
                        MarkerStencil::new(sighting.point.fixed(), sighting.offset, &mesh)?;
                    Some(resting.record().read().marker(&stencil, 0.0)?)
                }
            };
            add(sighting.position, simulated);
        }
    }
    Ok(markers)
}

/// The times of the motion, s, at which the rows of a picture are read whose frame has the time `clock`.
fn time_interval(images: &ImageSeries, view: &View<f64>, clock: f64) -> [f64; 2] {
    let [width, height] = images.size.map(f64::from);
    let corners = [[0.0, 0.0], [width, 0.0], [0.0, height], [width, height]];
    let times = corners.map(|corner| view.sample_time(clock, &images.placement.recorded(corner)));
    // The row of a node follows from that of the clamp, which may be outside of the picture.
    times.iter().fold([view.time(clock); 2], |[a, b], t| [a.min(*t), b.max(*t)])
}

/// Number of nodes of each rod, in their order.
fn line_lengths(run: &ExperimentRun) -> Vec<usize> {
    match &run.structure {
        Some(structure) => structure.at_rest().meshes.iter().map(|m| m.nodes.len()).collect(),
        None => vec![run.problem.nodes()],
    }
}

/// The positions of the `count` nodes of all rods at rest, m; empty if no measurement requires the equilibrium.
fn resting_nodes(run: &ExperimentRun, count: usize) -> Result<Vec<[f64; 3]>, Error> {
    let nodes: Vec<usize> = (0..count).collect();
    match (&run.resting, &run.structure) {
        (None, _) => Ok(Vec::new()),
        (Some(_), Some(structure)) => {
            let motions = motion_at_rest(structure, &nodes, |_, value: f64, _| value)?;
            Ok(motions.iter().map(|[position, _]| *position).collect())
        }
        (Some(_), None) => {
            let rest = Trajectory::at_rest(&run.problem, &nodes, &[])?;
            Ok(nodes.iter().map(|i| rest.node(*i, 0)).collect())
        }
    }
}

/// The position of a node, m, as the camera records it in the frame with the time `clock`, at the latest at the `end`
/// of the motion, s; `None` if it was not stored.
fn recorded_node(
    history: &NodeHistory,
    view: &View<f64>,
    node: usize,
    [clock, end]: [f64; 2],
) -> Option<[f64; 3]> {
    let mut time = view.time(clock).min(end);
    let mut pictured = view.pictured(history.position(node, time)?);
    // The row in which the node is read, and with it the time, follows from the position.
    for _ in 0..ROW_ITERATIONS {
        let in_row = view.sample_time(clock, &pictured.map(Some)).min(end);
        if in_row == time {
            break;
        }
        time = in_row;
        pictured = view.pictured(history.position(node, time)?);
    }
    Some(pictured)
}

/// Reads the files of the overlays: first those with the largest distance, and then the others in their order, as long
/// as all files together have at most [`MOST_BYTES`]. Files that are no such pictures are left out.
fn add_files(overlays: &mut [ImageOverlay]) {
    let mut order: Vec<usize> = (0..overlays.len()).collect();
    order.sort_by_key(|k| !overlays[*k].is_worst);
    let mut total = 0;
    for k in order {
        let own = &mut overlays[k];
        // Only the pictures that are evenly spaced were examined before the fit.
        let Ok(image) = read_image(Path::new(&own.file), "image") else { continue };
        let size = image.bytes.len() as u64;
        if image.size == own.size && total + size <= MOST_BYTES {
            total += size;
            own.image = Some(image);
        }
    }
}
