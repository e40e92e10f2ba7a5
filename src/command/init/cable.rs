//! The scene of a cable between two grippers, derived from a recording of markers along the cable, for `rodfit init
//! cable`.
//!
//! Input are the template of the scene and a track of markers. The rod is straight at rest with one node at each
//! marker. Edge lengths, m, are the medians of the distances of neighboring markers over all frames with both,
//! rounded to 1e-5 m. The time step is the median frame interval, s. Gravity points along -y of planar recordings
//! (all z zero) and along -z of spatial ones. Output is the scene (TOML). Neighboring markers that no frame has both
//! are an error.

use rodfit::Error;
use rodfit::scene::Track;

/// Fewest markers of a cable: two on each gripper, and one between them.
pub(super) const MIN_MARKERS: usize = 5;

/// The middle one of the values after sorting (the upper one of an even number); `None` for an empty list.
fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied()
}

/// A length or coordinate, m, rounded to 1e-5 m.
fn rounded(x: f64) -> f64 {
    (x * 1e5).round() / 1e5
}

/// The template `scene` (TOML) with its places in braces filled from `track`: segments, node positions (m), edge
/// lengths (m), gravity and time step (s, rounded to 1e-7; 0.01 with a single frame). `file` is the recording's path as
/// a TOML string; `keys` are further lines of its table. An error for two neighboring markers without a common frame,
/// whose distance is unknown.
pub(super) fn cable_scene(
    scene: &str,
    track: &Track,
    file: &str,
    keys: &str,
) -> Result<String, Error> {
    let markers = track.markers();
    let mut lengths: Vec<f64> = Vec::new();
    for pair in markers.windows(2) {
        let distance = |(a, b): (&Option<[f64; 3]>, &Option<[f64; 3]>)| {
            let (a, b) = ((*a)?, (*b)?);
            Some((0..3).map(|c| (a[c] - b[c]).powi(2)).sum::<f64>().sqrt())
        };
        let distances = pair[0].seen.iter().zip(&pair[1].seen).filter_map(distance);
        // The median excludes frames with swapped or jumping markers.
        let Some(length) = median(distances.collect()) else {
            let [first, second] = [&pair[0].name, &pair[1].name];
            let found = format!("the neighboring markers {first} and {second} in no common frame");
            let allowed = "a frame with both, which gives the length between them";
            return Err(Error::invalid("--from", found, allowed));
        };
        lengths.push(rounded(length));
    }
    let mut points = vec![[0.0, 0.0, 0.0]];
    let mut arc_length = 0.0;
    for length in &lengths {
        arc_length += length;
        points.push([rounded(arc_length), 0.0, 0.0]);
    }
    // Planar recordings have y upwards, spatial ones z.
    let is_planar = markers.iter().flat_map(|m| m.seen.iter().flatten()).all(|x| x[2] == 0.0);
    let gravity = if is_planar { "[0, -9.81, 0]" } else { "[0, 0, -9.81]" };
    let step = median(track.times().windows(2).map(|t| t[1] - t[0]).collect()).unwrap_or(0.01);
    let texts = [
        ("{segments}", (markers.len() - 1).to_string()),
        ("{points}", format!("{points:?}")),
        ("{lengths}", format!("{lengths:?}")),
        ("{file}", file.into()),
        ("{keys}", keys.into()),
        ("{gravity}", gravity.into()),
        ("{step}", format!("{:?}", (step * 1e7).round() / 1e7)),
    ];
    Ok(texts.iter().fold(scene.to_string(), |scene, (place, text)| scene.replace(place, text)))
}
